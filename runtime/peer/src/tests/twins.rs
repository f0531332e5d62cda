//! Twins: two processes under one id.

use super::{beacon, covered, record};
use crate::journal::Entry;
use crate::mission::mm;
use crate::output::Status;
use crate::testing::{Harness, mission};
use crate::wire::codec::Body;
use crate::{PeerId, Report};
use std::collections::BTreeSet;

/// The seat of the twin of peer 1.
const TWIN: u16 = 9;

/// What is listed by whom.
fn planned(h: &Harness, ids: &[u16]) -> BTreeSet<u16> {
    ids.iter().flat_map(|id| h.beliefs(*id).plan).collect()
}

fn silent(h: &Harness, id: u16) -> bool {
    h.beliefs(id).is_silent
}

/// How far a UAV is from the base of the mission, metres.
fn from_base_m(h: &Harness, id: u16) -> f64 {
    let pose = h.pose(id);
    (pose.east_m + 60.0).hypot(pose.north_m + 60.0)
}

#[test]
fn a_second_process_with_an_id_never_speaks_while_the_first_is_heard() {
    let mut h = Harness::started(3, mission(1, 24, 10));
    h.run_s(30);
    let before = h.beliefs(2).peers[&PeerId(1)];
    h.add_twin(TWIN, 1);
    h.start(TWIN);
    h.run_s(60);
    assert!(h.seat(TWIN).said.is_empty() && silent(&h, TWIN) && !silent(&h, 1));
    assert_eq!(h.alarms(TWIN).len(), 1, "{:?}", h.alarms(TWIN));
    assert_eq!(h.beliefs(1).incarnation, 1);
    assert!(!h.beliefs(1).plan.is_empty() && h.beliefs(TWIN).plan.is_empty());
    // Nobody noticed anything.
    assert_eq!(h.beliefs(2).peers[&PeerId(1)], before);
    let about = |(at, r): &(u64, Report)| {
        *at > 30_000
            && matches!(
                r,
                Report::Membership {
                    peer: PeerId(1),
                    ..
                }
            )
    };
    assert!(!h.seat(2).reports.iter().any(about));
    assert!(from_base_m(&h, TWIN) < 120.0, "it went home");
}

#[test]
fn a_twin_takes_over_when_the_first_is_gone_as_after_a_restart() {
    let mut h = Harness::started(2, mission(1, 24, 12));
    h.run_s(20);
    h.add_twin(TWIN, 1);
    h.start(TWIN);
    h.run_s(20);
    h.stop(1);
    let seen = covered(&h, 2);
    // k1 + k2 + D + 2 for the first, 3 T of listening, a beacon.
    assert!(h.run_until(25, |h| h.beliefs(TWIN).speaks));
    assert!(h.run_until(3, |h| {
        h.beliefs(2).peers[&PeerId(1)] == (h.beliefs(TWIN).incarnation, Status::Alive)
    }));
    assert!(h.run_until(40, |h| !h.beliefs(TWIN).plan.is_empty()));
    assert!(h.run_until(900, |h| h.beliefs(2).finished && h.beliefs(TWIN).finished));
    assert!(covered(&h, 2) > seen);
}

/// Both said that all is seen, each in its own life; who is silenced and speaks again later has
/// said it in none that counts.
#[test]
fn a_twin_that_takes_over_after_the_end_says_again_that_the_mission_is_finished() {
    let mut h = Harness::started(2, mission(1, 6, 4));
    h.add_twin(TWIN, 1);
    let apart = |h: &mut Harness, cut: bool| {
        for (a, b) in [(1, TWIN), (1, 2)] {
            h.link(a, b).cut = cut;
            h.link(b, a).cut = cut;
        }
    };
    apart(&mut h, true);
    h.start(TWIN);
    assert!(h.run_until(400, |h| h.beliefs(1).finished && h.beliefs(TWIN).finished));
    h.run_s(10);
    apart(&mut h, false);
    assert!(h.run_until(10, |h| silent(h, 1) != silent(h, TWIN)));
    h.run_s(20);
    let (stays, goes) = if silent(&h, 1) { (TWIN, 1) } else { (1, TWIN) };
    h.stop(stays);
    assert!(h.run_until(60, |h| h.beliefs(goes).speaks));
    let life = h.beliefs(goes).incarnation;
    h.run_s(10);
    let mut said = h.seat(goes).said.iter();
    assert!(said.any(|(_, r, body)| r.incarnation == life && matches!(body, Body::Finished(_))));
    assert!(h.beliefs(goes).finished);
}

#[test]
fn twins_that_both_speak_and_meet_leave_one_and_no_cell_without_an_owner() {
    for elder_alone in [true, false] {
        let mut h = Harness::started(2, mission(1, 24, 12));
        h.add_twin(TWIN, 1);
        // Each hears one half of the swarm: nobody, or peer 2.
        let apart = |h: &mut Harness, cut: bool| {
            let with = if elder_alone { 1 } else { TWIN };
            for (a, b) in [(1, TWIN), (with, 2)] {
                h.link(a, b).cut = cut;
                h.link(b, a).cut = cut;
            }
        };
        apart(&mut h, true);
        h.run_s(20);
        h.start(TWIN);
        h.run_s(40);
        assert!(!silent(&h, 1) && !silent(&h, TWIN));
        assert!(!h.beliefs(1).plan.is_empty() && !h.beliefs(TWIN).plan.is_empty());
        apart(&mut h, false);
        assert!(h.run_until(2, |h| silent(h, 1) != silent(h, TWIN)));
        let stays = if silent(&h, 1) { TWIN } else { 1 };
        let goes = if stays == 1 { TWIN } else { 1 };
        assert!(h.beliefs(goes).plan.is_empty());
        let life = h.beliefs(stays).incarnation;
        h.run_s(30);
        assert!(silent(&h, goes) && h.beliefs(stays).incarnation <= life + 1);
        let believed = h.beliefs(2).peers[&PeerId(1)];
        assert_eq!(believed, (h.beliefs(stays).incarnation, Status::Alive));
        // All that is open is listed again.
        let open = usize::from(h.beliefs(2).covered.complement().count());
        assert!(planned(&h, &[stays, 2]).len() + 2 >= open, "{open}");
        assert!(h.run_until(900, |h| {
            [2, stays, goes].iter().all(|id| h.beliefs(*id).finished)
        }));
    }
}

#[test]
fn twins_that_hear_of_each_other_only_through_others_leave_one_that_speaks() {
    for late_s in [0, 1, 17] {
        let mut h = Harness::started(3, mission(1, 24, 12));
        h.add_twin(TWIN, 1);
        h.link(1, TWIN).cut = true;
        h.link(TWIN, 1).cut = true;
        h.run_s(late_s);
        h.start(TWIN);
        assert!(
            h.run_until(15, |h| silent(h, 1) != silent(h, TWIN)),
            "{late_s}"
        );
        let (stays, goes) = if silent(&h, 1) { (TWIN, 1) } else { (1, TWIN) };
        h.run_s(10);
        let life = h.beliefs(stays).incarnation;
        assert!(life < 4, "life {life}");
        h.run_s(60);
        assert!(silent(&h, goes), "{late_s}: it is told of the other");
        assert_eq!(h.beliefs(stays).incarnation, life);
        assert_eq!(h.beliefs(2).peers[&PeerId(1)], (life, Status::Alive));
        assert!(stays == 1 || late_s < 17, "the elder stays");
    }
}

#[test]
fn a_restart_without_a_disk_is_no_twin_of_itself() {
    for seconds in [1, 3, 9] {
        let mut h = Harness::started(3, mission(1, 12, 10));
        h.run_s(25);
        h.stop(1);
        h.seat(1).journal.clear();
        h.run_s(seconds);
        h.start(1);
        assert!(h.run_until(6, |h| h.beliefs(2).peers[&PeerId(1)] == (2, Status::Alive)));
        let silenced = |(_, r): &(u64, Report)| *r == Report::Silenced;
        assert!(!h.seat(1).reports.iter().any(silenced));
    }
}

#[test]
fn of_two_programs_in_one_airframe_one_flies_it() {
    let mut h = Harness::started(2, mission(1, 24, 10));
    h.run_s(25);
    // The other program was started here, has a later life, and senses the same place.
    let tell = |h: &mut Harness, heartbeat, off_mm: i32| {
        let at = h.pose(1);
        let mut told = beacon(heartbeat, 77);
        (told.east_mm, told.north_mm) = (mm(at.east_m) + off_mm, mm(at.north_m));
        h.inject(1, record(1, 2, heartbeat, 0, &Body::Beacon(told)));
    };
    tell(&mut h, 1, 5_000);
    assert!(silent(&h, 1));
    let fed = |h: &mut Harness, s: u64| {
        let before = h.seat(1).setpoints;
        h.run_s(s);
        h.seat(1).setpoints - before
    };
    assert_eq!(fed(&mut h, 3), 0);
    tell(&mut h, 2, 5_000);
    assert_eq!(fed(&mut h, 3), 0);
    // One that flies elsewhere has a body of its own: this one goes home.
    tell(&mut h, 3, 90_000);
    assert!(fed(&mut h, 3) > 10);
}

#[test]
fn a_section_that_becomes_durable_after_its_peer_was_silenced_is_not_flown() {
    let sections = |h: &mut Harness| {
        let claim = |e: &&Vec<u8>| matches!(Entry::decode(e), Some(Entry::Claim(_)));
        h.seat(1).journal.iter().filter(claim).count()
    };
    let mut late = 0;
    for seconds in 4..16 {
        let mut h = Harness::started(2, mission(1, 12, 10));
        h.seat(1).store_ms = 900;
        h.run_s(seconds);
        let before = sections(&mut h);
        let twin = Body::Beacon(beacon(1, 77));
        h.inject(1, record(1, 9, 1, 0, &twin));
        h.run_s(6);
        assert!(silent(&h, 1) && h.beliefs(1).plan.is_empty());
        late += sections(&mut h) - before;
    }
    assert!(late > 0, "none was under way");
}
