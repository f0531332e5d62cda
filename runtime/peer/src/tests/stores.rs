//! A disk that fails or is slow: nothing is spoken or flown that rests on what is not durable.

use super::covered;
use crate::journal::{Durable, Entry};
use crate::testing::{Harness, mission};
use crate::wire::codec::Body;
use crate::wire::kinds::Kind;

#[test]
fn a_bid_that_is_not_durable_is_not_spoken_and_the_others_go_on() {
    let mut h = Harness::new(3, mission(1, 6, 4));
    h.seat(1).store_fails = |e| matches!(e, Entry::Bid(_));
    for id in 1..=3 {
        h.start(id);
    }
    assert!(h.run_until(400, |h| h.beliefs(2).finished));
    assert_eq!(h.count_said(1, Kind::Bid), 0);
    assert!(!h.alarms(1).is_empty());
    assert!(h.run_until(30, |h| h.beliefs(1).finished), "it still hears");
}

#[test]
fn an_adoption_that_is_not_durable_is_not_flown_and_its_cells_find_an_owner() {
    let mut h = Harness::new(2, mission(1, 6, 4));
    h.seat(1).store_fails = |e| matches!(e, Entry::Claim(_));
    h.start(1);
    h.start(2);
    h.run_s(30);
    assert!(h.beliefs(1).plan.is_empty() && !h.beliefs(2).plan.is_empty());
    assert!(h.run_until(400, |h| h.beliefs(2).finished));
}

#[test]
fn a_disk_that_recovers_lets_the_peer_work_again() {
    let mut h = Harness::new(2, mission(1, 8, 6));
    h.seat(1).store_fails = |e| matches!(e, Entry::Claim(_));
    h.start(1);
    h.start(2);
    h.run_s(30);
    h.seat(1).store_fails = |_| false;
    assert!(h.run_until(60, |h| !h.beliefs(1).plan.is_empty()));
}

#[test]
fn while_a_store_is_slow_nothing_of_it_is_on_the_air() {
    let mut h = Harness::new(2, mission(1, 6, 4));
    h.seat(1).store_ms = 1500;
    h.start(1);
    h.start(2);
    h.run_s(40);
    // Whatever was said of a round was in the journal first.
    let (durable, unread) = Durable::replay(&h.seat(1).journal);
    assert_eq!(unread, 0);
    let bids = h.seat(1).said.iter().filter_map(|(_, _, b)| match b {
        Body::Bid(b) => Some(b.round.counter),
        _ => None,
    });
    assert!(bids.max().is_some_and(|c| c <= durable.counter));
    assert!(h.run_until(300, |h| h.beliefs(1).finished));
}

#[test]
fn a_take_that_is_not_durable_is_tried_again() {
    let mut h = Harness::started(2, mission(1, 6, 4));
    h.run_s(25);
    assert!(!h.beliefs(1).plan.is_empty());
    // From now on UAV 1 works alone, and cannot write claims.
    h.seat(1).store_fails = |e| matches!(e, Entry::Claim(_));
    h.stop(2);
    h.run_s(60);
    let stuck = covered(&h, 1);
    h.run_s(20);
    assert!(
        covered(&h, 1) <= stuck + 1,
        "what it lists is flown, no more"
    );
    h.seat(1).store_fails = |_| false;
    assert!(h.run_until(300, |h| h.beliefs(1).finished));
}

#[test]
fn covered_cells_are_durable_while_flying() {
    let mut h = Harness::started(1, mission(1, 6, 4));
    assert!(h.run_until(120, |h| covered(h, 1) > 14));
    let (durable, _) = Durable::replay(&h.seat(1).journal);
    let cells = crate::cells::CellSet::decode_rle(durable.cells, &durable.covered).unwrap();
    assert!(usize::from(cells.count()) + 5 >= covered(&h, 1));
}

#[test]
fn covered_cells_that_could_not_be_written_are_written_with_the_next_one() {
    let mut h = Harness::started(1, mission(1, 6, 4));
    h.seat(1).store_fails = |e| matches!(e, Entry::Covered { .. });
    assert!(h.run_until(120, |h| covered(h, 1) > 5));
    h.seat(1).store_fails = |_| false;
    let before = covered(&h, 1);
    assert!(h.run_until(60, |h| covered(h, 1) > before));
    h.run_s(1);
    let (durable, _) = Durable::replay(&h.seat(1).journal);
    let cells = crate::cells::CellSet::decode_rle(durable.cells, &durable.covered).unwrap();
    assert!(usize::from(cells.count()) > before, "{}", cells.count());
}

#[test]
fn runs_that_are_taken_one_after_the_other_are_told_at_once() {
    // UAV 1 can take part in no round, so it takes what it finds without an owner.
    let mut h = Harness::new(1, mission(1, 10, 8));
    h.seat(1).store_fails = |e| matches!(e, Entry::Bid(_));
    h.start(1);
    assert!(h.run_until(60, |h| h.beliefs(1).plan.len() > 10));
    h.run_s(20);
    let said = &h.seat(1).said;
    let claims = said.iter().filter(|(_, _, b)| b.kind() == Kind::Claim);
    let at: Vec<u64> = claims.map(|(at, ..)| *at).collect();
    assert!(
        at.len() > 2 && at.windows(2).all(|w| w[1] - w[0] >= 750),
        "{at:?}"
    );
}

/// Cells that a division gave away are answered for during two waiting times of its round, and
/// a peer that stands still answers for them that much longer: it hears no claim meanwhile.
#[test]
fn cells_that_nobody_takes_over_are_held_for_two_waiting_times_of_listening() {
    for stands_still_ms in [0, 60_000] {
        let mut h = Harness::new(2, mission(1, 8, 6));
        // UAV 2 bids, and can write no section.
        h.seat(2).store_fails = |e| matches!(e, Entry::Claim(_));
        h.start(1);
        h.run_s(25);
        h.start(2);
        assert!(h.run_until(60, |h| !h.beliefs(1).held.is_empty()));
        let held_from_ms = h.now_ms();
        h.run_s(3);
        h.seat(1).clock_ms += stands_still_ms;
        assert!(h.run_until(30, |h| h.beliefs(1).held.is_empty()));
        let held_ms = h.now_ms() - held_from_ms;
        // W is W0, which is 5 T; both ends are looked at every quarter period.
        assert!((9_500..=10_500).contains(&held_ms), "{held_ms}");
    }
}

#[test]
fn records_of_a_later_version_are_skipped_with_an_alarm() {
    let mut h = Harness::new(2, mission(1, 6, 4));
    h.seat(1).journal = vec![Entry::Life(4).encode(), vec![0xff, 0x00]];
    h.start(1);
    h.start(2);
    h.run_s(1);
    assert_eq!(
        h.alarms(1),
        ["1 journal records of a later version were skipped"]
    );
    assert_eq!(h.beliefs(1).incarnation, 5, "what could be read counts");
    assert!(h.alarms(2).is_empty());
}
