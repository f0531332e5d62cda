//! Bytes that nobody should send: they are reported and change nothing.

use super::{beacon, covered, record};
use crate::testing::{Harness, mission};
use crate::wire::codec::Body;
use crate::wire::kinds::{Kind, RECORD_MAX_BYTES};
use crate::wire::message::{CellRun, Claim, Epoch, Finished, Gossip};
use crate::wire::message::{ListedRun, Member, Round, Stamp};
use crate::wire::samples;
use crate::{Input, PeerId, Report};
use std::collections::BTreeMap;

fn refused(h: &mut Harness, id: u16) -> usize {
    let refused = |(_, r): &&(u64, Report)| matches!(r, Report::Refused { .. });
    h.seat(id).reports.iter().filter(refused).count()
}

#[test]
fn cut_oversize_and_unknown_bytes_are_refused_and_change_nothing() {
    let mut h = Harness::started(2, mission(1, 6, 4));
    h.run_s(20);
    let sample = record(9, 1, 1, 0, &Body::Finished(Finished { revision: 1 }));
    let mut hostile: Vec<Vec<u8>> = (0..sample.len()).map(|n| sample[..n].to_vec()).collect();
    hostile.push(vec![0x80; RECORD_MAX_BYTES + 1]);
    let mut trailing = sample.clone();
    trailing.push(0);
    hostile.push(trailing);
    for kind in 0..=u8::MAX {
        let mut other = sample.clone();
        // The fourth field is the kind; numbers from 24 on take a byte more.
        other.splice(
            4..5,
            if kind < 24 {
                vec![kind]
            } else {
                vec![0x18, kind]
            },
        );
        if kind != Kind::Finished.number() && kind != Kind::Operator.number() {
            hostile.push(other);
        }
    }
    let before = h.beliefs(1);
    let (count, already) = (hostile.len(), refused(&mut h, 1));
    for bytes in hostile {
        h.inject(1, bytes);
    }
    assert_eq!(refused(&mut h, 1) - already, count);
    assert_eq!(h.beliefs(1), before);
}

#[test]
fn a_percept_that_is_not_finite_is_refused() {
    let mut h = Harness::started(1, mission(1, 6, 4));
    h.run_s(10);
    let already = refused(&mut h, 1);
    let mut percept = h.seat(1).percept_now();
    percept.endurance_s = f64::NAN;
    h.feed(1, Input::Percept(percept));
    percept.endurance_s = 10.0;
    percept.pose.east_m = f64::INFINITY;
    h.feed(1, Input::Percept(percept));
    assert_eq!(refused(&mut h, 1) - already, 2);
}

#[test]
fn a_rival_loop_is_an_alarm_once_and_its_peer_no_member() {
    let mut h = Harness::started(2, mission(1, 6, 4));
    h.run_s(20);
    // Who follows another revision, or has derived nothing yet, is no rival.
    for (n, revision, loop_hash) in [(1, 7, 0xbad), (2, 1, 0)] {
        let mut other = beacon(n, 5);
        (other.able, other.revision, other.loop_hash) = (true, revision, loop_hash);
        h.inject(1, record(8, 1, n, 0, &Body::Beacon(other)));
    }
    assert!(h.alarms(1).is_empty());
    for n in 1..10 {
        let mut rival = beacon(n, 5);
        (rival.able, rival.revision, rival.loop_hash) = (true, 1, 0xbad);
        h.inject(1, record(9, 1, n, 0, &Body::Beacon(rival)));
        h.run_s(1);
    }
    assert_eq!(
        h.alarms(1),
        ["peer 9 derived another loop from the same mission"]
    );
    let named = |(_, r): &(u64, Report)| match r {
        Report::Round { members, .. } => members.contains(&PeerId(9)),
        _ => false,
    };
    assert!(!h.seat(1).reports.iter().any(named));
}

/// A claim that names other cells than its reader has in mind would take cells that
/// nobody flies.
#[test]
fn a_claim_of_another_loop_takes_nothing() {
    let mut h = Harness::started(2, mission(1, 6, 4));
    h.run_s(12);
    let plan = h.beliefs(1).plan;
    let mine = h.beliefs(1).loop_hash;
    let all = ListedRun {
        run: CellRun {
            first: 0,
            count: 24,
        },
        backward: false,
        stamp: Stamp {
            epoch: Epoch {
                counter: 99,
                hash: 0,
            },
            take: 0,
            id: 2,
        },
    };
    let claim = |loop_hash| Claim {
        loop_hash,
        plan: vec![all],
        ..Claim::default()
    };
    assert!(plan.len() > 4);
    h.inject(1, record(2, 1, 5_000, 0, &Body::Claim(claim(mine ^ 1))));
    let left = h.beliefs(1).plan.len();
    assert!(plan.len() - left <= 1, "{left} of {}", plan.len());
    // The same on its own loop takes all that it is not committed to.
    h.inject(1, record(2, 1, 6_000, 0, &Body::Claim(claim(mine))));
    assert!(h.run_until(3, |h| h.beliefs(1).plan.len() <= 2));
}

#[test]
fn among_more_than_a_round_holds_cells_are_taken_without_one() {
    let mut h = Harness::new(1, mission(1, 6, 4));
    h.start(1);
    h.run_s(2);
    let loop_hash = h.beliefs(1).loop_hash;
    assert_ne!(loop_hash, 0);
    for n in 1..12_u32 {
        for id in 2..=70_u16 {
            let mut other = beacon(n, 5);
            (other.able, other.revision, other.loop_hash) = (true, 1, loop_hash);
            h.inject(1, record(id, 1, n, 0, &Body::Beacon(other)));
        }
        h.run_s(1);
    }
    let bids = h.seat(1).said.iter();
    let bids = bids.filter(|(_, _, b)| matches!(b, Body::Bid(_)));
    assert_eq!(bids.count(), 0);
    assert!(!h.beliefs(1).plan.is_empty());
}

#[test]
fn made_up_suspicions_of_others_bring_no_takeover_of_the_living() {
    let mut h = Harness::started(2, mission(1, 6, 4));
    h.run_s(25);
    let mut liar = beacon(1, 5);
    liar.gossip.push(Gossip {
        id: 2,
        incarnation: 1,
        heartbeat: 1,
        age_ds: 0,
        hops: 1,
        interval: 4,
        suspected_ds: Some(u16::MAX),
        able: true,
        max_seq: 0,
        digest: 0,
    });
    h.inject(1, record(9, 1, 1, 0, &Body::Beacon(liar)));
    h.run_s(2);
    let statuses: BTreeMap<_, _> = h.beliefs(1).peers;
    assert_eq!(statuses[&PeerId(2)].1, crate::output::Status::Alive);
    assert!(covered(&h, 1) > 0);
}

#[test]
fn a_counter_that_was_made_up_stops_no_round() {
    let mut h = Harness::started(3, mission(1, 8, 6));
    h.run_s(25);
    let epoch = h.beliefs(1).epoch;
    for n in 1..=3 {
        for id in 1..=3 {
            let mut poison = beacon(n, 5);
            poison.counter = u32::MAX;
            h.inject(id, record(9, 1, n, 0, &Body::Beacon(poison)));
        }
    }
    h.stop(3);
    assert!(h.run_until(60, |h| h.beliefs(1).epoch > epoch
        && h.beliefs(2).epoch > epoch));
    h.stop(2);
    assert!(h.run_until(400, |h| h.beliefs(1).finished));
}

#[test]
fn counters_and_lives_that_were_made_up_block_nobody() {
    let mut h = Harness::started(2, mission(1, 6, 4));
    h.run_s(4);
    let life = |id| Gossip {
        id,
        incarnation: u32::MAX,
        heartbeat: 1,
        age_ds: 0,
        hops: 1,
        interval: 4,
        suspected_ds: None,
        able: true,
        max_seq: 0,
        digest: 0,
    };
    let mut poison = beacon(1, 1);
    poison.counter = u32::MAX;
    poison.gossip = vec![life(1), life(2)];
    for id in [1, 2] {
        h.inject(id, record(9, 1, 1, 0, &Body::Beacon(poison.clone())));
        let already = refused(&mut h, id);
        h.inject(
            id,
            record(3 - id, u32::MAX, 1, 0, &Body::Beacon(beacon(1, 1))),
        );
        let finished = Body::Finished(Finished { revision: 1 });
        h.inject(id, record(3 - id, u32::MAX, 1, 0, &finished));
        assert_eq!(refused(&mut h, id) - already, 2);
    }
    assert!(h.run_until(250, |h| h.beliefs(1).finished && h.beliefs(2).finished));
    for id in [1, 2] {
        let b = h.beliefs(id);
        assert!(b.incarnation == 1 && b.adoptions > 0, "{b:?}");
        assert!((1..5000).contains(&b.epoch.counter), "{:?}", b.epoch);
        assert_eq!(b.peers[&PeerId(3 - id)].0, 1);
    }
}

#[test]
fn bids_and_claims_far_ahead_of_all_that_was_heard_of_are_refused() {
    let mut h = Harness::started(2, mission(1, 6, 4));
    h.run_s(20);
    let loop_hash = h.beliefs(1).loop_hash;
    let far = 1_000_000;
    let ahead = Epoch {
        counter: far,
        hash: 0,
    };
    let own = Claim {
        loop_hash,
        epoch: ahead,
        ..Claim::default()
    };
    let listed = |stamp_epoch| Claim {
        loop_hash,
        plan: vec![ListedRun {
            run: CellRun { first: 0, count: 4 },
            backward: false,
            stamp: Stamp {
                epoch: stamp_epoch,
                take: 0,
                id: 2,
            },
        }],
        ..Claim::default()
    };
    let held = Claim {
        held: listed(ahead).plan,
        plan: Vec::new(),
        ..listed(ahead)
    };
    let round = Round {
        counter: far,
        members: [1, 2].map(|id| Member { id, incarnation: 1 }).to_vec(),
        revision: 1,
        loop_hash,
        repair: true,
        wait_ms: 5_000,
    };
    let ahead_bid = Body::Bid(samples::bid(round));
    let bodies = [own, listed(ahead), held].map(Body::Claim).into_iter();
    for (seq, body) in (5_000..).zip(bodies.chain([ahead_bid])) {
        let already = refused(&mut h, 1);
        h.inject(1, record(2, 1, seq, 0, &body));
        assert_eq!(refused(&mut h, 1) - already, 1, "{body:?}");
    }
    // One that is not far ahead is heard.
    let already = refused(&mut h, 1);
    let near = Epoch {
        counter: 2,
        hash: 0,
    };
    h.run_s(2);
    h.inject(1, record(2, 1, 6_000, 0, &Body::Claim(listed(near))));
    assert_eq!(refused(&mut h, 1), already);
    assert!(h.run_until(200, |h| h.beliefs(1).finished));
}
