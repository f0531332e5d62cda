//! Lives and probation.

use super::{beacon, covered, record};
use crate::cells::CellSet;
use crate::journal::{Durable, Entry};
use crate::output::Status;
use crate::testing::{Harness, mission};
use crate::wire::codec::Body;
use crate::wire::kinds::Kind;
use crate::wire::message::{Finished, Gossip};
use crate::{PeerId, Report};
use std::collections::BTreeSet;

#[test]
fn a_peer_that_lost_its_disk_takes_a_life_above_the_one_others_know() {
    let mut h = Harness::started(2, mission(1, 6, 4));
    h.run_s(12);
    assert_eq!(h.beliefs(2).peers[&PeerId(1)], (1, Status::Alive));
    h.stop(1);
    h.seat(1).journal.clear();
    h.run_s(2);
    h.start(1);
    assert!(h.run_until(12, |h| h.beliefs(2).peers[&PeerId(1)] == (2, Status::Alive)));
    assert_eq!(h.beliefs(1).incarnation, 2);
}

/// By it a process knows its own beacons from those of a twin.
#[test]
fn every_beacon_carries_the_number_drawn_for_its_process() {
    let mut h = Harness::started(1, mission(1, 6, 4));
    h.run_s(10);
    let nonces = h.seat(1).said.iter().filter_map(|(_, _, body)| match body {
        Body::Beacon(b) => Some(b.nonce),
        _ => None,
    });
    // The harness draws them by id and start.
    assert_eq!(nonces.collect::<BTreeSet<_>>(), BTreeSet::from([1001]));
}

#[test]
fn a_life_begun_anew_that_outlasted_the_first_is_known_by_the_records_of_the_first() {
    let mut h = Harness::started(2, mission(1, 12, 10));
    h.run_s(40);
    let records = |h: &mut Harness| h.seat(1).said.len();
    let heartbeats = |h: &Harness| h.count_said(1, Kind::Beacon) + h.count_said(1, Kind::Heartbeat);
    let (first_records, first_heartbeats) = (records(&mut h), heartbeats(&h));
    h.isolate(1, true);
    h.stop(1);
    h.seat(1).journal.clear();
    // Its disk takes neither bids nor sections at first, so that it says little.
    h.seat(1).store_fails = |e| matches!(e, Entry::Bid(_) | Entry::Claim(_));
    h.start(1);
    h.run_s(50);
    let second_heartbeats = heartbeats(&h) - first_heartbeats;
    let second_records = records(&mut h) - first_records - second_heartbeats;
    assert!(second_heartbeats > first_heartbeats, "{second_heartbeats}");
    assert!(
        second_records + 10 < first_records - first_heartbeats,
        "{second_records} records"
    );
    h.seat(1).store_fails = |_| false;
    h.run_s(10);
    let plans = |h: &Harness, id: u16| h.beliefs(id).plan.into_iter().collect::<BTreeSet<_>>();
    let both = |h: &Harness| plans(h, 1).intersection(&plans(h, 2)).count();
    assert_eq!(h.beliefs(1).incarnation, 1);
    assert!(both(&h) > 20, "each plans all that is open");
    h.isolate(1, false);
    assert!(h.run_until(4, |h| h.beliefs(2).peers[&PeerId(1)] == (2, Status::Alive)));
    // As L3 wants it: (3D + 5) T for both claims to arrive, 2 T to yield.
    assert!(h.run_until(6, |h| both(h) == 0), "{}", both(&h));
}

#[test]
fn a_restart_with_its_disk_goes_on_above_what_it_promised() {
    let mut h = Harness::started(2, mission(1, 6, 4));
    h.run_s(40);
    let (before, counter) = (covered(&h, 1), h.beliefs(1).counter);
    assert!(before > 4 && counter > 0);
    h.stop(1);
    h.start(1);
    h.run_s(1);
    let restarted = h.beliefs(1);
    assert_eq!((restarted.incarnation, restarted.counter), (2, counter));
    let (journal, _) = Durable::replay(&h.seat(1).journal);
    let remembered = CellSet::decode_rle(journal.cells, &journal.covered).unwrap();
    assert!(covered(&h, 1) >= usize::from(remembered.count()));
    h.run_s(5);
    assert!(
        covered(&h, 1) >= before,
        "what it forgot it hears again: {} of {before}",
        covered(&h, 1)
    );
}

#[test]
fn a_life_that_cannot_be_stored_is_silent_and_tried_again() {
    let mut h = Harness::new(2, mission(1, 6, 4));
    h.seat(1).store_fails = |e| matches!(e, Entry::Life(_));
    h.start(1);
    h.start(2);
    h.run_s(120);
    let alarms = h.alarms(1).len();
    assert!(
        h.seat(1).said.is_empty() && (8..16).contains(&alarms),
        "{alarms}"
    );
    h.seat(1).store_fails = |_| false;
    assert!(h.run_until(17, |h| h.count_said(1, Kind::Beacon) > 0));
}

#[test]
fn a_later_life_that_cannot_be_stored_leaves_the_peer_speaking_in_the_old_one() {
    let mut h = Harness::started(1, mission(1, 6, 4));
    h.run_s(8);
    h.seat(1).store_fails = |e| matches!(e, Entry::Life(_));
    let echo = |life| record(1, life, 1, 0, &Body::Finished(Finished { revision: 1 }));
    h.inject(1, echo(5));
    h.run_s(2);
    let said = h.count_said(1, Kind::Beacon);
    h.run_s(3);
    assert!(h.beliefs(1).incarnation == 1 && h.count_said(1, Kind::Beacon) > said);
    h.seat(1).store_fails = |_| false;
    h.inject(1, echo(5));
    assert!(h.run_until(2, |h| h.beliefs(1).incarnation == 6));
}

#[test]
fn a_suspicion_heard_is_refuted_at_once_without_gossip() {
    let mut h = Harness::started(2, mission(1, 6, 4));
    h.run_s(20);
    let spoken = |h: &Harness| h.count_said(1, Kind::Beacon) + h.count_said(1, Kind::Heartbeat);
    let before = spoken(&h);
    let suspicion = Gossip {
        id: 1,
        incarnation: 1,
        heartbeat: 1,
        age_ds: 40,
        hops: 1,
        interval: 4,
        suspected_ds: Some(0),
        able: true,
        max_seq: 0,
        digest: 0,
    };
    let mut told = beacon(1, 1);
    told.gossip.push(suspicion);
    h.inject(1, record(9, 1, 1, 0, &Body::Beacon(told)));
    h.isolate(1, true);
    h.run_s(2);
    let spoken = spoken(&h) - before;
    assert!(spoken >= 6, "four a period until it is believed: {spoken}");
    let bare = h.seat(1).said.iter().rev().take(4);
    let bare = bare.filter(|(_, _, b)| matches!(b, Body::Heartbeat(_)));
    assert!(bare.count() >= 2);
}

#[test]
fn who_hears_again_whom_others_suspect_tells_them_soon() {
    for seed_s in 20..26 {
        let mut h = Harness::started(3, mission(1, 12, 10));
        h.run_s(seed_s);
        let status = |h: &Harness, of: u16| h.beliefs(of).peers[&PeerId(1)].1;
        h.isolate(1, true);
        assert!(h.run_until(6, |h| (2..=3).all(|id| status(h, id) == Status::Suspect)));
        h.isolate(1, false);
        // Of the two others only one hears it.
        h.link(1, 3).cut = true;
        h.link(3, 1).cut = true;
        assert!(h.run_until(2, |h| status(h, 2) == Status::Alive));
        let heard_ms = h.now_ms();
        let beacons = |h: &mut Harness| -> Vec<u64> {
            let said = h.seat(2).said.iter();
            let full = said.filter(|(.., b)| matches!(b, Body::Beacon(_)));
            full.map(|(at, ..)| *at).collect()
        };
        // It was heard within the last quarter of a period.
        let before = beacons(&mut h)
            .into_iter()
            .filter(|at| at + 250 < heard_ms)
            .max();
        h.run_s(2);
        let next = beacons(&mut h)
            .into_iter()
            .find(|at| at + 250 >= heard_ms)
            .unwrap();
        let latest = (heard_ms + 125).max(before.unwrap() + 500) + 20;
        assert!(next <= latest, "{next} {latest}");
    }
}

#[test]
fn nothing_is_said_in_the_first_three_periods() {
    let mut h = Harness::started(2, mission(1, 6, 4));
    h.run_s(10);
    for id in [1, 2] {
        let first = h.seat(id).said.first().map(|(at, ..)| *at);
        assert!(
            first.is_some_and(|at| (3000..4500).contains(&at)),
            "{first:?}"
        );
        let booted = |(_, r): &(u64, Report)| matches!(r, Report::Booted { incarnation: 1 });
        assert!(h.seat(id).reports.iter().any(booted));
    }
}
