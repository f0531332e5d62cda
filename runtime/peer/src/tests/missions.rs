//! Missions over the radio.

use super::{covered, record, with_operator};
use crate::input::Command;
use crate::library::chunks;
use crate::mission::Mission;
use crate::testing::{GROUND_STATION, Harness, mission};
use crate::wire::codec::Body;
use crate::wire::kinds::Kind;
use crate::{Input, Role};
use std::sync::Arc;

fn command(h: &mut Harness, mission: Mission) {
    let command = Command::Mission(Arc::new(mission));
    h.feed(GROUND_STATION, Input::Command(command));
}

#[test]
fn a_uav_without_a_mission_learns_it_by_radio() {
    let mut h = Harness::new(1, mission(1, 6, 4));
    h.add(2, Role::Uav, None);
    h.add_ground_station(Some(mission(1, 6, 4)));
    for id in [1, 2, GROUND_STATION] {
        h.start(id);
    }
    assert!(h.run_until(15, |h| h.beliefs(2).revision == 1));
    assert_eq!(h.beliefs(2).loop_hash, h.beliefs(1).loop_hash);
    assert!(h.run_until(250, |h| h.beliefs(2).finished));
}

/// What others listed before it had a mission is known to it with its loop.
#[test]
fn who_learns_the_mission_late_takes_nothing_that_another_lists() {
    let mut h = with_operator(1, mission(1, 10, 8));
    h.run_s(20);
    h.add(2, Role::Uav, None);
    h.start(2);
    assert!(h.run_until(30, |h| h.beliefs(2).revision == 1));
    let both = |h: &Harness| {
        let (a, b) = (h.beliefs(1).plan, h.beliefs(2).plan);
        a.iter().any(|c| b.contains(c))
    };
    assert!(h.run_until(10, |h| both(h) || h.beliefs(2).epoch.counter > 0));
    assert!(!both(&h));
}

/// All know the first mission before they start; what is newer is told until all follow it.
#[test]
fn a_mission_is_said_while_somebody_follows_an_older_one() {
    let mut h = with_operator(3, mission(1, 6, 4));
    let said = |h: &Harness| [1, 2, 3, GROUND_STATION].map(|id| h.count_said(id, Kind::Mission));
    h.run_s(40);
    assert_eq!(said(&h), [0; 4]);
    command(&mut h, mission(2, 8, 4));
    assert!(h.run_until(15, |h| (1..=3).all(|id| h.beliefs(id).revision == 2)));
    h.run_s(5);
    let told = said(&h);
    assert!(told[3] > 0);
    // A newer record of the ground station, and one that somebody lacks, bring no piece.
    h.isolate(2, true);
    h.run_s(15);
    h.isolate(2, false);
    h.run_s(30);
    assert_eq!(said(&h), told);
}

#[test]
fn a_new_revision_is_taken_by_all_and_covered_cells_keep_their_names() {
    let mut h = with_operator(2, mission(1, 6, 4));
    h.run_s(40);
    let before = covered(&h, 1);
    assert!(before > 4);
    command(&mut h, mission(2, 8, 4));
    assert!(h.run_until(10, |h| h.beliefs(1).revision == 2
        && h.beliefs(2).revision == 2));
    assert!(covered(&h, 1) >= before, "{} of {before}", covered(&h, 1));
    assert_eq!(h.newest_mission(1).as_deref(), Some(&mission(2, 8, 4)));
    assert!(h.run_until(300, |h| h.beliefs(1).finished && h.beliefs(2).finished));
    assert_eq!(h.beliefs(1).covered.capacity(), 32);
}

/// The way home from a base that has moved away costs fuel that was planned: what is cut
/// from the plan is cut from the flight.
#[test]
fn a_base_that_moves_away_shortens_plan_and_flight() {
    let mut h = with_operator(1, mission(1, 8, 6));
    h.run_s(30);
    let before = h.beliefs(1);
    let spare_s = f64::from(before.spendable_ms - h.eta_ms(1)) / 1000.0;
    h.seat(1).fuel_s -= spare_s - 5.0;
    h.run_s(1);
    let moved = Mission {
        base: (-600_000, -60_000),
        ..mission(2, 8, 6)
    };
    command(&mut h, moved);
    assert!(h.run_until(10, |h| h.beliefs(1).revision == 2));
    h.run_s(1);
    let after = h.beliefs(1);
    assert!(after.plan.len() + 4 < before.plan.len());
    assert!(!after.plan.is_empty());
    assert!(
        h.eta_ms(1) <= after.spendable_ms,
        "{} of {}",
        h.eta_ms(1),
        after.spendable_ms
    );
}

/// A zone beside the area leaves the loop as it is: who flies between other zones knows no
/// way yet, which is no reason to give up its plan.
#[test]
fn a_zone_beside_the_area_takes_no_cell_from_anybody() {
    let mut h = with_operator(1, mission(1, 8, 6));
    h.run_s(30);
    let before = h.beliefs(1);
    let zoned = Mission {
        zones: vec![vec![
            (1_000_000, 0),
            (1_050_000, 0),
            (1_050_000, 50_000),
            (1_000_000, 50_000),
        ]],
        ..mission(2, 8, 6)
    };
    command(&mut h, zoned);
    assert!(h.run_until(10, |h| h.beliefs(1).revision == 2));
    let after = h.beliefs(1);
    assert_eq!(after.loop_hash, before.loop_hash);
    assert!(
        after.plan.len() + 4 > before.plan.len(),
        "{} of {}",
        after.plan.len(),
        before.plan.len()
    );
}

#[test]
fn an_older_revision_changes_nothing() {
    let mut h = Harness::started(1, mission(3, 6, 4));
    h.add_ground_station(Some(mission(2, 4, 4)));
    h.start(GROUND_STATION);
    h.run_s(15);
    assert_eq!(h.beliefs(1).revision, 3);
}

#[test]
fn a_forged_piece_is_an_alarm_and_the_old_mission_stays() {
    let mut h = Harness::started(1, mission(1, 6, 4));
    h.run_s(10);
    let pieces = chunks(&mission(2, 8, 4)).unwrap();
    for (i, mut piece) in (0u16..).zip(pieces) {
        piece.content_hash ^= 1;
        h.inject(1, record(9, 1, u32::from(i) + 1, i, &Body::Mission(piece)));
    }
    h.run_s(5);
    assert_eq!(h.beliefs(1).revision, 1);
    assert_eq!(
        h.alarms(1),
        ["mission revision 2 is not what its hash says"]
    );
}

#[test]
fn a_mission_that_cannot_be_flown_is_an_alarm_and_the_old_one_stays() {
    let mut h = with_operator(1, mission(1, 6, 4));
    h.run_s(10);
    let mut crossed = mission(2, 6, 4);
    crossed.area.swap(1, 2);
    command(&mut h, crossed);
    h.run_s(10);
    assert_eq!(h.beliefs(1).revision, 1);
    assert!(
        h.alarms(1)
            .iter()
            .all(|a| a.starts_with("the mission cannot be flown: "))
    );
    assert!(!h.alarms(1).is_empty());
    assert!(h.run_until(250, |h| h.beliefs(1).finished));
}

#[test]
fn a_mission_too_large_for_the_radio_is_an_alarm() {
    let mut h = Harness::new(1, mission(1, 6, 4));
    let mut large = mission(1, 6, 4);
    large.zones = (0..4000)
        .map(|i| vec![(i, 1_000_000), (i + 1, 1_000_000), (i, 1_000_001)])
        .collect();
    h.add_ground_station(Some(large));
    h.start(GROUND_STATION);
    h.run_s(6);
    assert_eq!(h.count_said(GROUND_STATION, Kind::Mission), 0);
    let alarm = "the mission is too large to be spoken";
    assert!(
        h.alarms(GROUND_STATION)
            .iter()
            .any(|a| a.starts_with(alarm))
    );
}

#[test]
fn laps_follow_each_other_in_all_peers() {
    let mut patrol = mission(1, 4, 4);
    patrol.further_laps = 1;
    let mut h = Harness::started(2, patrol);
    assert!(h.run_until(200, |h| h.beliefs(1).revision == 2));
    assert!(h.run_until(10, |h| h.beliefs(2).revision == 2));
    assert!(h.run_until(200, |h| h.beliefs(1).finished && h.beliefs(2).finished));
}

/// Who was out of reach when a lap ended hears of a later one from a beacon.
#[test]
fn who_missed_the_end_of_laps_begins_the_one_that_others_fly() {
    let mut patrol = mission(1, 4, 4);
    patrol.further_laps = 5;
    let mut h = with_operator(2, patrol);
    h.run_s(15);
    for id in [2, GROUND_STATION] {
        h.isolate(id, true);
    }
    // It has seen little, and goes no further.
    h.stop(2);
    assert!(h.run_until(600, |h| h.beliefs(1).revision == 3));
    h.start(2);
    assert_eq!(h.beliefs(GROUND_STATION).revision, 1);
    for id in [2, GROUND_STATION] {
        h.isolate(id, false);
    }
    let all = |h: &Harness| {
        [2, GROUND_STATION]
            .iter()
            .all(|id| h.beliefs(*id).revision == 3)
    };
    assert!(h.run_until(20, all));
    assert_eq!(h.beliefs(2).loop_hash, h.beliefs(1).loop_hash);
}

#[test]
fn an_operator_s_mission_outranks_the_laps_that_a_peer_began_out_of_reach() {
    let mut patrol = mission(1, 4, 4);
    patrol.further_laps = 9;
    let mut h = with_operator(2, patrol.clone());
    assert!(h.run_until(200, |h| h.beliefs(GROUND_STATION).revision == 2));
    h.isolate(2, true);
    let mut revised = patrol;
    revised.revision = h.next_revision(GROUND_STATION);
    revised.base.0 -= 50_000;
    assert!(h.run_until(600, |h| h.beliefs(2).revision > 3));
    let newest = revised.revision;
    command(&mut h, revised.clone());
    h.isolate(2, false);
    assert!(h.run_until(60, |h| {
        [1, 2].iter().all(|id| h.beliefs(*id).revision == newest)
    }));
    assert!(
        h.run_until(300, |h| h.beliefs(2).revision == newest + 1),
        "laps go on"
    );
    // What is no newer is ignored, and the operator hears of it.
    revised.base.0 -= 50_000;
    command(&mut h, revised);
    let alarm = "a mission is no newer than the one that is held; it was ignored";
    assert!(h.alarms(GROUND_STATION).contains(&alarm.to_owned()));
}

#[test]
fn a_lap_begins_three_periods_after_the_last_cell_of_the_one_before() {
    let mut patrol = mission(1, 4, 4);
    patrol.further_laps = 1;
    let mut h = Harness::started(1, patrol);
    assert!(h.run_until(200, |h| covered(h, 1) == 16));
    let complete_ms = h.now_ms();
    assert!(h.run_until(10, |h| h.beliefs(1).revision == 2));
    // Both are looked at every quarter period, by the peer and here.
    let after_ms = h.now_ms() - complete_ms;
    assert!((2_750..=3_750).contains(&after_ms), "{after_ms}");
    assert_eq!(covered(&h, 1), 0);
}

/// A mission of many pieces: so many zones are far beside it.
fn in_pieces(revision: u32, cols: i32, zones: i32) -> Mission {
    let mut large = mission(revision, cols, 4);
    large.zones = (0..zones)
        .map(|i| 1_000_000 + 20_000 * i)
        .map(|x| vec![(x, 900_000), (x + 9_000, 900_000), (x, 909_000)])
        .collect();
    large
}

/// Two hold halves of a mission whose author is gone: each says what the other lacks, once.
#[test]
fn halves_of_a_mission_are_brought_together_after_its_author_is_gone() {
    let mut h = Harness::started(2, mission(1, 6, 4));
    h.run_s(10);
    let pieces = chunks(&in_pieces(2, 8, 120)).unwrap();
    let n = pieces.len();
    assert!(n > 10, "{n}");
    for id in [1, 2] {
        h.isolate(id, true);
    }
    for (i, piece) in (0u16..).zip(pieces) {
        let said = record(9, 1, u32::from(i) + 1, i, &Body::Mission(piece));
        h.inject(1 + i % 2, said);
    }
    h.run_s(5);
    for id in [1, 2] {
        h.isolate(id, false);
        h.seat(id).passed_on.clear();
    }
    assert!(h.run_until(30, |h| (1..=2).all(|id| h.beliefs(id).revision == 2)));
    h.run_s(10);
    let is_piece = |kind: &&Kind| **kind == Kind::Mission;
    let said = [1, 2].map(|id| h.seat(id).passed_on.iter().filter(is_piece).count());
    assert_eq!(said.iter().sum::<usize>(), n, "{said:?}");
    let lacking = h.count_said(1, Kind::Lacking);
    h.run_s(10);
    assert_eq!(h.count_said(1, Kind::Lacking), lacking, "nobody lacks any");
}

/// The pieces of a mission, as their author says them from a number on.
fn pieces_of(mission: &Mission, author: u16, first_seq: u32) -> Vec<Vec<u8>> {
    let pieces = (0u16..).zip(chunks(mission).unwrap());
    let said = |(i, piece)| {
        let seq = first_seq + u32::from(i);
        record(author, 1, seq, i, &Body::Mission(piece))
    };
    pieces.map(said).collect()
}

/// The author says one piece of a newer mission to one of three and is gone. Who holds the
/// former mission whole lends it to who has begun anew, also beyond its own earshot.
#[test]
fn a_piece_of_a_newer_mission_takes_the_former_one_from_nobody() {
    const AUTHOR: u16 = 9;
    let mut h = Harness::started(3, mission(1, 6, 4));
    for (a, b) in [(1, 3), (3, 1)] {
        h.link(a, b).cut = true;
    }
    h.run_s(10);
    for id in [2, 3] {
        h.stop(id);
    }
    let former = pieces_of(&in_pieces(2, 8, 40), AUTHOR, 1);
    let newer = pieces_of(&in_pieces(3, 10, 40), AUTHOR, 100);
    assert!(former.len() > 1 && newer.len() > 1);
    for said in former {
        h.inject(1, said);
    }
    assert!(h.run_until(5, |h| h.beliefs(1).revision == 2));
    h.run_s(5);
    h.inject(1, newer[0].clone());
    h.run_s(5);
    for id in [2, 3] {
        h.start(id);
    }
    let all =
        |revision: u32| move |h: &Harness| (1..=3).all(|id| h.beliefs(id).revision == revision);
    assert!(h.run_until(120, all(2)), "the author is gone");
    // It is met again: the newer mission goes on from the piece that is known.
    for said in newer.iter().skip(1) {
        h.inject(3, said.clone());
    }
    assert!(h.run_until(120, all(3)), "the author is back");
}
