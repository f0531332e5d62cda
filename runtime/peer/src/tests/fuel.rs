//! Fuel that ends.

use super::covered;
use crate::Input;
use crate::output::Report;
use crate::testing::{Harness, mission};
use crate::wire::codec::Body;
use crate::wire::message::MissionStatus;

const DUE: &str = "the fuel is due: returning to base";

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
        let eta_ms = h.eta_ms(1);
        assert!(
            eta_ms <= b.spendable_ms + 2000,
            "{eta_ms} {}",
            b.spendable_ms
        );
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
    let spent_ms = before.spendable_ms - h.eta_ms(1) / 2;
    h.seat(1).fuel_s -= f64::from(spent_ms) / 1000.0;
    h.run_s(2);
    let after = h.beliefs(1);
    assert!(!after.plan.is_empty() && after.plan.len() < before.plan.len());
    assert!(h.eta_ms(1) <= after.spendable_ms, "{after:?}");
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
    assert!(h.run_until(300, idle));
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
