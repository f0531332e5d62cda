//! Obstacles that no map shows: found by one, flown round by all.

use super::with_operator;
use crate::Input;
use crate::input::Command;
use crate::mission::{Mission, PointMm, mm};
use crate::testing::{GROUND_STATION, Harness, mission};
use crate::wire::kinds::Kind;
use skein_behaviors::obstacle::Obstacle;
use std::sync::Arc;

fn finding(mission: Mission) -> Mission {
    Mission {
        finds_obstacles: true,
        ..mission
    }
}

fn crane(east_m: i32, north_m: i32) -> Obstacle {
    Obstacle {
        east_dm: 10 * east_m,
        north_dm: 10 * north_m,
        radius_dm: 120,
    }
}

fn revise(h: &mut Harness, change: impl FnOnce(&Mission) -> Mission) {
    let newest = h.newest_mission(GROUND_STATION).unwrap();
    let revision = h.next_revision(GROUND_STATION);
    let changed = Mission {
        revision,
        ..change(&newest)
    };
    let command = Command::Mission(Arc::new(changed));
    h.feed(GROUND_STATION, Input::Command(command));
}

fn square(east_m: f64, north_m: f64) -> Vec<PointMm> {
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(a, b)| (mm(east_m + 15.0 * a), mm(north_m + 15.0 * b)))
        .to_vec()
}

/// Zones round what was found that a peer's mission has.
fn zones_round_found(h: &Harness, id: u16) -> usize {
    h.newest_mission(id).unwrap().zones_round_found()
}

/// Whether these peers fly the same mission, and it has so many zones round what was found.
fn agree(h: &Harness, ids: &[u16], found: usize) -> bool {
    let all = ids.iter().map(|id| {
        let b = h.beliefs(*id);
        (b.revision, b.loop_hash)
    });
    let all: Vec<(u32, u64)> = all.collect();
    let follow = |id: &u16| h.newest_mission(*id).map(|m| m.revision) == Some(all[0].0);
    all.windows(2).all(|w| w[0] == w[1])
        && ids.iter().all(follow)
        && ids.iter().all(|id| zones_round_found(h, *id) == found)
}

/// Runs; nobody comes into an obstacle.
fn runs_clear(h: &mut Harness, seconds: u64, uavs: &[u16], obstacles: &[Obstacle]) {
    for _ in 0..4 * seconds {
        let now_ms = h.now_ms();
        h.run_until(1, |h| h.now_ms() > now_ms);
        for id in uavs {
            for o in obstacles {
                let from_m = (h.pose(*id).position() - o.at()).norm();
                assert!(from_m > o.radius_m(), "{id} at {now_ms}: {from_m} m");
            }
        }
    }
}

#[test]
fn what_one_senses_is_flown_round_by_all_and_what_is_left_is_covered() {
    let mut h = with_operator(3, finding(mission(1, 10, 8)));
    let stands = [crane(260, 180)];
    // Only the first has a sensor.
    h.seat(1).obstacles = stands.to_vec();
    let all = [1, 2, 3, GROUND_STATION];
    assert!(h.run_until(60, |h| agree(h, &all, 1)), "nobody tells");
    runs_clear(&mut h, 240, &[1, 2, 3], &stands);
    assert!(h.run_until(400, |h| h.beliefs(2).finished));
    assert!(agree(&h, &all, 1));
    assert_eq!(h.count_said(1, Kind::Obstacle), 1);
    assert_eq!(h.count_said(2, Kind::Obstacle), 0);
}

#[test]
fn whoever_finds_what_where_and_whatever_the_operator_says_meanwhile_all_comes_together() {
    let mut h = with_operator(2, finding(mission(1, 16, 8)));
    let (west, east) = (crane(120, 220), crane(620, 200));
    h.run_s(12);
    h.isolate(1, true);
    h.isolate(2, true);
    h.seat(1).obstacles = vec![west, crane(140, 330)];
    h.seat(2).obstacles = vec![east];
    h.seat(1).pose.east_m = 100.0;
    h.seat(2).pose.east_m = 600.0;
    assert!(h.run_until(60, |h| zones_round_found(h, 1) == 2
        && zones_round_found(h, 2) == 1));
    revise(&mut h, |m| {
        m.with_zone("fire", &square(400.0, 200.0)).unwrap()
    });
    let of_operator = h.newest_mission(GROUND_STATION).unwrap().revision;
    h.run_s(10);
    h.isolate(1, false);
    h.isolate(2, false);
    let all = [1, 2, GROUND_STATION];
    assert!(h.run_until(60, |h| agree(h, &all, 3)), "they never agree");
    let flown = h.newest_mission(1).unwrap();
    assert!(flown.added_zones.contains_key("fire"));
    assert!(flown.revision > of_operator);
    // And the operator's next word counts more than all that.
    revise(&mut h, |m| m.without_zone("fire").unwrap());
    assert!(h.run_until(60, |h| {
        let flown = h.newest_mission(2).unwrap();
        !flown.added_zones.contains_key("fire") && agree(h, &all, 3)
    }));
}

#[test]
fn what_an_operator_takes_out_comes_again_only_where_it_still_stands() {
    let mut h = with_operator(1, finding(mission(1, 8, 6)));
    h.seat(1).obstacles = vec![crane(200, 150)];
    let all = [1, GROUND_STATION];
    assert!(h.run_until(60, |h| agree(h, &all, 1)));
    let name = |h: &Harness| {
        let m = h.newest_mission(GROUND_STATION).unwrap();
        m.added_zones.keys().next().cloned()
    };
    let first = name(&h).unwrap();
    revise(&mut h, |m| m.without_zone(&first).unwrap());
    assert!(h.run_until(30, |h| name(h).is_some_and(|n| n != first)));
    let second = name(&h).unwrap();
    h.seat(1).obstacles.clear();
    revise(&mut h, |m| m.without_zone(&second).unwrap());
    h.run_s(30);
    assert!(agree(&h, &all, 0), "{:?}", name(&h));
}

#[test]
fn who_comes_when_the_finder_is_gone_is_told_by_others() {
    let mut h = with_operator(3, finding(mission(1, 10, 8)));
    h.isolate(3, true);
    h.seat(1).obstacles = vec![crane(260, 180)];
    assert!(h.run_until(60, |h| agree(h, &[1, 2, GROUND_STATION], 1)));
    h.stop(1);
    h.stop(2);
    h.seat(2).journal.clear();
    h.run_s(40);
    h.start(2);
    h.isolate(3, false);
    assert!(h.run_until(60, |h| agree(h, &[2, 3, GROUND_STATION], 1)));
}

#[test]
fn on_patrol_laps_and_what_is_found_count_beside_each_other() {
    let patrol = Mission {
        further_laps: 3,
        ..finding(mission(1, 5, 4))
    };
    let mut h = with_operator(2, patrol);
    h.run_s(20);
    let lap = |h: &Harness, id: u16| h.newest_mission(id).unwrap().lap;
    assert!(h.run_until(300, |h| lap(h, 2) == 1));
    h.seat(1).obstacles = vec![crane(110, 90)];
    let all = [1, 2, GROUND_STATION];
    assert!(h.run_until(60, |h| agree(h, &all, 1)));
    assert!(h.run_until(300, |h| lap(h, 2) == 2 && lap(h, 1) == 2));
    h.seat(2).obstacles = vec![crane(30, 150)];
    assert!(h.run_until(600, |h| h.beliefs(2).finished && agree(h, &all, 2)));
    assert_eq!((lap(&h, 1), lap(&h, 2)), (3, 3));
}

#[test]
fn where_a_mission_counts_nothing_found_the_envelope_alone_keeps_clear() {
    let mut h = with_operator(1, mission(1, 8, 6));
    let stands = [crane(200, 150)];
    h.seat(1).obstacles = stands.to_vec();
    h.run_s(10);
    runs_clear(&mut h, 200, &[1], &stands);
    assert_eq!(h.beliefs(1).revision, 1);
}
