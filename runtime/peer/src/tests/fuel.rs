//! Fuel that ends.

use super::covered;
use super::diagrams::rounds;
use crate::Input;
use crate::mission::{Mission, PointMm};
use crate::output::Report;
use crate::task::{CoverageTask, PointTask};
use crate::testing::{Harness, mission};
use crate::wire::codec::Body;
use crate::wire::message::MissionStatus;
use std::sync::Arc;

const DUE: &str = "the fuel is due: returning to base";

/// The straight way home from the farthest end of some cells, seconds.
fn home_s<'a>(cells: impl Iterator<Item = &'a u16>) -> f64 {
    let geometry = Arc::new(mission(1, 8, 6)).geometry().unwrap();
    let lp = &geometry.coverage_loop;
    let base = geometry.mission.base_m();
    let away_m = |i: usize| (lp.boundary(i % lp.len()).position() - base).norm();
    let ends = cells.map(|c| usize::from(*c)).flat_map(|i| [i, i + 1]);
    ends.map(away_m).fold(0.0, f64::max) / 13.0
}

/// Whether a UAV comes home with its reserve, but for two seconds, from where its plan ends.
fn comes_home(h: &mut Harness, id: u16) -> bool {
    let b = h.beliefs(id);
    let Some(last) = b.plan.last() else {
        return true;
    };
    let cell_s = 5.0;
    let takes_s = f64::from(h.eta_ms(id)) / 1000.0 + home_s([*last].iter()) - cell_s;
    takes_s <= h.seat(id).fuel_s - 60.0 + 2.0
}

#[test]
fn a_uav_whose_fuel_is_due_flies_home_and_the_other_finishes() {
    let mut h = Harness::started(2, mission(1, 8, 6));
    h.run_s(25);
    assert!(!h.beliefs(1).plan.is_empty());
    h.seat(1).fuel_s = 150.0;
    assert!(h.run_until(120, |h| h.alarms(1).contains(&DUE.to_owned())));
    let left_s = h.seat(1).fuel_s;
    assert!(left_s > 60.0, "the reserve is not planned away: {left_s}");
    h.run_s(1);
    assert!(h.beliefs(1).plan.is_empty() && !h.beliefs(1).able);
    assert!(h.run_until(60, |h| {
        let pose = h.pose(1);
        (pose.east_m + 60.0).hypot(pose.north_m + 60.0) < 100.0
    }));
    assert!(h.run_until(500, |h| h.beliefs(2).finished));
    let due = h.alarms(1).into_iter().filter(|a| a == DUE);
    assert_eq!(due.count(), 1, "it comes due once");
}

#[test]
fn no_plan_is_longer_than_what_may_be_spent() {
    let mut h = Harness::new(1, mission(1, 8, 6));
    h.seat(1).fuel_s = 260.0;
    h.start(1);
    let mut longest = 0;
    for _ in 0..120 {
        h.run_s(1);
        let b = h.beliefs(1);
        longest = longest.max(b.plan.len());
        assert!(comes_home(&mut h, 1), "{b:?}");
    }
    assert!(longest > 4);
    let all = |(_, r): &(u64, Report)| matches!(r, Report::Alarm { text } if text.ends_with("beyond the endurance of all"));
    assert!(h.seat(1).reports.iter().any(all));
}

#[test]
fn a_plan_that_became_longer_than_the_fuel_is_cut_while_it_is_flown() {
    let mut h = Harness::started(2, mission(1, 8, 6));
    h.run_s(25);
    let before = h.beliefs(1);
    let farthest_s = home_s(before.plan.iter());
    let takes_s = f64::from(h.eta_ms(1)) / 2000.0 + farthest_s + 31.0;
    h.seat(1).fuel_s = 60.0 + takes_s;
    h.run_s(2);
    let after = h.beliefs(1);
    assert!(!after.plan.is_empty() && after.plan.len() < before.plan.len());
    assert!(comes_home(&mut h, 1), "{after:?}");
    assert!(h.run_until(500, |h| h.beliefs(2).finished));
}

#[test]
fn one_percept_without_fuel_does_not_end_the_flight() {
    let mut h = Harness::started(1, mission(1, 6, 4));
    h.run_s(20);
    let mut glitch = h.seat(1).percept_now();
    glitch.endurance_s = 0.0;
    h.feed(1, Input::Percept(glitch));
    h.run_s(40);
    assert!(h.beliefs(1).able);
    assert!(covered(&h, 1) > 6);
    assert!(h.run_until(250, |h| h.beliefs(1).finished));
}

#[test]
fn cells_beyond_everybody_are_taken_once_somebody_has_the_fuel() {
    let mut h = Harness::new(2, mission(1, 8, 6));
    for id in [1, 2] {
        h.seat(id).fuel_s = 200.0;
        h.start(id);
    }
    let idle = |h: &Harness| [1, 2].iter().all(|id| h.beliefs(*id).plan.is_empty());
    assert!(h.run_until(60, |h| !h.beliefs(1).unassigned.is_empty()));
    // What was left over is taken run by run, until nobody can fly any more of it.
    let is_due = |h: &Harness| [1, 2].iter().all(|id| h.beliefs(*id).is_fuel_due);
    assert!(h.run_until(300, is_due));
    h.run_s(20);
    let before = covered(&h, 1);
    assert!(idle(&h) && before < 48, "{before}");
    let status = |h: &mut Harness| {
        let said = h.seat(1).said.iter().rev();
        let status = said.filter_map(|(_, _, b)| match b {
            Body::State(state) => Some(state.mission),
            _ => None,
        });
        status.collect::<Vec<_>>()
    };
    let told = status(&mut h);
    assert_eq!(told.first(), Some(&MissionStatus::Failed));
    assert_eq!(told.last(), Some(&MissionStatus::Active));
    h.seat(2).fuel_s = 3600.0;
    assert!(
        h.run_until(400, |h| h.beliefs(1).finished),
        "{}",
        covered(&h, 1)
    );
    h.run_s(12);
    assert_eq!(status(&mut h)[0], MissionStatus::Accomplished);
}

#[test]
fn who_was_refuelled_a_little_works_again_with_half_a_minute_to_spend() {
    let mut h = Harness::started(1, mission(1, 8, 6));
    h.run_s(20);
    h.seat(1).fuel_s = 100.0;
    assert!(h.run_until(60, |h| h.alarms(1).contains(&DUE.to_owned())));
    h.run_s(30);
    // It loiters above its base: what may be spent is what is beyond the reserve and home.
    let spendable_ms = |h: &mut Harness, fuel_s: f64| {
        h.seat(1).fuel_s = fuel_s;
        h.run_s(1);
        h.beliefs(1).spendable_ms
    };
    let mut fuel_s = 60.0;
    while spendable_ms(&mut h, fuel_s) < 20_000 {
        fuel_s += 5.0;
    }
    assert!(!h.beliefs(1).able && spendable_ms(&mut h, fuel_s) < 30_000);
    while spendable_ms(&mut h, fuel_s) < 31_000 {
        fuel_s += 1.0;
    }
    h.run_s(1);
    assert!(h.beliefs(1).able);
}

/// A rectangle between two corners, millimetres.
fn rectangle(west: i32, south: i32, east: i32, north: i32) -> Vec<PointMm> {
    vec![(west, south), (east, south), (east, north), (west, north)]
}

/// How far a UAV is from the base of a mission, metres.
fn away_m(h: &Harness, id: u16, mission: &Mission) -> f64 {
    let (pose, base) = (h.pose(id), mission.base_m());
    (pose.east_m - base.x).hypot(pose.north_m - base.y)
}

/// Whether the fuel of the only UAV is due within three seconds with so much above its reserve,
/// once it is so far from its base.
fn is_due_at(mission: &Mission, far: impl Fn(f64) -> bool, above_s: f64, wind: (f64, f64)) -> bool {
    let mut h = Harness::started(1, mission.clone());
    h.seat(1).wind_mps = wind;
    let at_work = |h: &Harness| !h.beliefs(1).plan.is_empty() && far(away_m(h, 1, mission));
    assert!(h.run_until(200, at_work));
    h.seat(1).fuel_s = 60.0 + above_s;
    h.run_s(3);
    h.beliefs(1).is_fuel_due
}

#[test]
fn beside_the_base_it_flies_on_with_fuel_that_is_due_in_the_far_corner() {
    let m = mission(1, 8, 6);
    let calm = (0.0, 0.0);
    assert!(!is_due_at(&m, |away_m| away_m < 250.0, 60.0, calm));
    assert!(is_due_at(&m, |away_m| away_m > 500.0, 60.0, calm));
}

#[test]
fn behind_a_wall_its_fuel_is_due_earlier() {
    let open = Mission {
        base: (192_000, -120_000),
        ..mission(1, 8, 6)
    };
    let walled = Mission {
        zones: vec![rectangle(-500_000, -50_000, 900_000, -40_000)],
        ..open.clone()
    };
    let near = |away_m| away_m < 400.0;
    assert!(!is_due_at(&open, near, 70.0, (0.0, 0.0)));
    assert!(is_due_at(&walled, near, 70.0, (0.0, 0.0)));
}

/// On its way home it sees that the way is shorter than it feared on the loop, and has nothing to
/// see: that is no reason to go round again.
#[test]
fn on_a_patrol_the_fuel_is_due_once() {
    // Places far from each other: from one of them the next comes before the way home.
    let place = |at: PointMm| PointTask {
        at,
        radius_mm: 20_000,
    };
    let places = [(0, 0), (1_200_000, 0), (1_200_000, 900_000), (0, 900_000)];
    let patrol = Mission {
        area: rectangle(-60_000, -60_000, 1_300_000, 1_000_000),
        base: (600_000, -120_000),
        zones: vec![rectangle(100_000, -60_000, 1_100_000, -50_000)],
        task: CoverageTask::Points(places.map(place).to_vec()),
        diagram: Some(Arc::new(rounds(3_000))),
        ..mission(1, 8, 6)
    };
    let n = Arc::new(patrol.clone())
        .geometry()
        .unwrap()
        .coverage_loop
        .len();
    let mut h = Harness::started(1, patrol);
    assert!(h.run_until(900, |h| covered(h, 1) == n));
    h.run_s(20);
    h.seat(1).fuel_s = 60.0 + 300.0;
    assert!(h.run_until(400, |h| h.beliefs(1).is_fuel_due));
    h.run_s(100);
    let due = h.alarms(1).into_iter().filter(|a| a == DUE).count();
    assert_eq!(due, 1);
    assert!(h.beliefs(1).is_fuel_due);
}

#[test]
fn the_way_home_against_the_wind_counts() {
    let m = mission(1, 8, 6);
    // The base lies in the southwest.
    let far = |away_m| away_m > 400.0;
    assert!(!is_due_at(&m, far, 90.0, (0.0, 0.0)));
    assert!(is_due_at(&m, far, 90.0, (3.5, 3.0)));
}

#[test]
fn the_last_cells_are_flown_beside_the_base_and_the_reserve_is_untouched() {
    let m = mission(1, 8, 6);
    let mut h = Harness::new(1, m.clone());
    h.seat(1).fuel_s = 260.0;
    h.start(1);
    assert!(h.run_until(260, |h| h.beliefs(1).is_fuel_due));
    let home = |h: &Harness| away_m(h, 1, &m) < 100.0;
    assert!(h.run_until(90, home));
    let left_s = h.seat(1).fuel_s;
    assert!(left_s >= 60.0, "{left_s} s");
    let seen = h.seat(1).reports.iter();
    let seen = seen.filter(|(_, r)| matches!(r, Report::Covered { .. }));
    let last_ms = seen.map(|(at, _)| *at).max().unwrap();
    // From the farthest corner it is 73 s home: with that in reserve it would have turned home
    // after 127 s.
    assert!(last_ms > 130_000, "{last_ms} ms");
}

#[test]
fn nothing_is_planned_from_where_there_is_no_way_home() {
    // The base lies in a yard without a gate.
    let yard = Mission {
        base: (192_000, -250_000),
        zones: vec![
            rectangle(0, -100_000, 400_000, -90_000),
            rectangle(0, -400_000, 10_000, -100_000),
            rectangle(390_000, -400_000, 400_000, -100_000),
            rectangle(0, -410_000, 400_000, -400_000),
        ],
        ..mission(1, 8, 6)
    };
    let mut h = Harness::started(2, yard);
    for _ in 0..60 {
        h.run_s(1);
        for id in [1, 2] {
            assert!(h.beliefs(id).plan.is_empty(), "{:?}", h.beliefs(id).plan);
        }
    }
    for id in [1, 2] {
        // Where it waits its camera sees some.
        let (b, seen) = (h.beliefs(id), covered(&h, id));
        assert_eq!(b.unassigned.len() + seen, 48);
        let why = |a: &String| a.starts_with("no way home is known from ");
        let told = h.alarms(id).into_iter().filter(why);
        assert_eq!(told.count(), 1, "{:?}", h.alarms(id));
    }
}
