//! What the operator wants, from a ground station over the radio.

use super::{covered, with_operator};
use crate::testing::{GROUND_STATION, Harness, mission};
use crate::wire::codec::Body;
use crate::wire::kinds::Kind;
use crate::{Command, Input};
use skein_behaviors::Order;
use skein_geometry::frame::{Point, Vector};
use std::sync::Arc;

fn at_work() -> Harness {
    let mut h = with_operator(2, mission(1, 6, 4));
    h.run_s(25);
    assert!(covered(&h, 1) > 0);
    h
}

fn from_base_m(h: &mut Harness, id: u16) -> f64 {
    let pose = h.seat(id).pose;
    (pose.east_m + 60.0).hypot(pose.north_m + 60.0)
}

#[test]
fn hold_loiters_where_it_is_and_resume_goes_on() {
    let mut h = at_work();
    h.order(GROUND_STATION, Order::Hold);
    h.run_s(6);
    assert!(!h.beliefs(1).able && !h.beliefs(2).able);
    assert_eq!(h.beliefs(2).order, Order::Hold);
    let (places, seen) = ([h.seat(1).pose, h.seat(2).pose], covered(&h, 1));
    for _ in 0..6 {
        h.run_s(5);
        for (id, place) in [1, 2].into_iter().zip(places) {
            let away_m = (h.seat(id).pose.position() - place.position()).norm();
            assert!(away_m < 120.0, "{id} strays {away_m} m");
        }
    }
    assert!(covered(&h, 1) <= seen + 2, "nothing is looked for on hold");
    h.order(GROUND_STATION, Order::Resume);
    assert!(h.run_until(200, |h| h.beliefs(1).finished));
}

#[test]
fn return_flies_home_and_resume_finishes_the_mission() {
    let mut h = at_work();
    h.order(GROUND_STATION, Order::ReturnToBase);
    h.run_s(60);
    for id in [1, 2] {
        let away_m = from_base_m(&mut h, id);
        assert!(away_m < 100.0, "{id} is {away_m} m from base");
    }
    h.order(GROUND_STATION, Order::Resume);
    assert!(h.run_until(250, |h| h.beliefs(1).finished && h.beliefs(2).finished));
}

/// What the last claim of a peer lists.
fn listed(h: &mut Harness, id: u16) -> Option<usize> {
    let said = h.seat(id).said.iter().rev();
    let mut claims = said.filter_map(|(_, _, body)| match body {
        Body::Claim(claim) => Some(claim.plan.len()),
        _ => None,
    });
    claims.next()
}

#[test]
fn who_is_told_to_return_lets_go_first_and_when_all_are_nobody_takes_over() {
    let mut h = at_work();
    assert!(listed(&mut h, 1) > Some(0));
    h.order(GROUND_STATION, Order::ReturnToBase);
    h.run_s(3);
    for id in [1, 2] {
        assert_eq!(listed(&mut h, id), Some(0), "{id}");
    }
    let seen = covered(&h, 1);
    for _ in 0..60 {
        h.run_s(1);
        let beliefs = [1, 2].map(|id| h.beliefs(id));
        assert!(
            beliefs
                .iter()
                .all(|b| b.plan.is_empty() && b.held.is_empty())
        );
    }
    // The camera sees a few more on the way home.
    assert!(covered(&h, 1) <= seen + 4);
}

#[test]
fn one_that_returns_leaves_its_cells_to_the_other_and_joins_again() {
    let mut h = with_operator(2, mission(1, 8, 6));
    h.run_s(25);
    let left: Vec<u16> = h.beliefs(1).plan;
    assert!(left.len() > 8);
    h.order_one(GROUND_STATION, 1, Order::ReturnToBase);
    h.run_s(3);
    assert_eq!(
        (h.beliefs(1).order, h.beliefs(2).order),
        (Order::ReturnToBase, Order::Resume)
    );
    assert!(h.beliefs(1).plan.is_empty() && h.beliefs(2).able);
    h.run_s(20);
    let (other, open) = (h.beliefs(2).plan, h.beliefs(2).covered);
    assert!(left.iter().all(|c| other.contains(c) || open.contains(*c)));
    h.run_s(30);
    assert!(from_base_m(&mut h, 1) < 100.0 && from_base_m(&mut h, 2) > 0.0);
    h.order_one(GROUND_STATION, 1, Order::Resume);
    assert!(h.run_until(60, |h| !h.beliefs(1).plan.is_empty()));
    assert!(h.run_until(400, |h| h.beliefs(1).finished && h.beliefs(2).finished));
}

#[test]
fn what_a_round_gives_to_who_returns_meanwhile_is_let_go_too() {
    // The order comes while bids are on their way: at any time since it can be spoken.
    for second in 0..12 {
        let mut h = with_operator(2, mission(1, 6, 4));
        assert!(h.run_until(20, |h| h.beliefs(GROUND_STATION).speaks));
        h.run_s(second);
        h.order_one(GROUND_STATION, 1, Order::ReturnToBase);
        h.run_s(5);
        for _ in 0..10 {
            h.run_s(1);
            assert!(h.beliefs(1).plan.is_empty(), "told after {second} s");
        }
        assert!(
            h.run_until(400, |h| h.beliefs(2).finished),
            "told after {second} s"
        );
    }
}

#[test]
fn an_order_to_all_ends_those_to_single_ones() {
    let mut h = at_work();
    h.order_one(GROUND_STATION, 1, Order::ReturnToBase);
    h.order_one(GROUND_STATION, 2, Order::Hold);
    h.run_s(5);
    let orders = h.beliefs(1).orders;
    assert_eq!(orders.to_string(), "resume, uav1 return-to-base, uav2 hold");
    assert_eq!(h.beliefs(2).orders, orders);
    let why = h.why(1).to_string();
    assert!(
        why.contains("order     return-to-base, to it alone; resume to all"),
        "{why}"
    );
    assert!(
        why.contains("flies home: the operator said return-to-base"),
        "{why}"
    );
    h.order(GROUND_STATION, Order::Resume);
    assert!(h.run_until(300, |h| h.beliefs(1).finished && h.beliefs(2).finished));
}

#[test]
fn an_order_reaches_a_peer_that_was_out_of_reach_and_an_older_one_does_not_come_back() {
    let mut h = at_work();
    h.isolate(2, true);
    h.order(GROUND_STATION, Order::Hold);
    h.run_s(3);
    assert!(!h.beliefs(1).able && h.beliefs(2).able);
    h.order(GROUND_STATION, Order::ReturnToBase);
    h.isolate(2, false);
    assert!(h.run_until(15, |h| !h.beliefs(2).able));
    h.run_s(60);
    assert!(from_base_m(&mut h, 2) < 100.0);
}

#[test]
fn finished_uavs_fly_home() {
    let mut h = Harness::started(2, mission(1, 6, 4));
    assert!(h.run_until(250, |h| h.beliefs(1).finished && h.beliefs(2).finished));
    h.run_s(60);
    for id in [1, 2] {
        assert!(from_base_m(&mut h, id) < 100.0);
        assert_eq!(h.count_said(id, Kind::Finished), 1);
    }
}

/// The only UAV has finished, and where it circles at its base something hides the ground station.
fn out_of_earshot() -> (Harness, impl Fn(&Harness) -> bool) {
    let mut h = with_operator(1, mission(1, 4, 3));
    assert!(h.run_until(250, |h| h.beliefs(1).finished));
    h.run_s(60);
    h.isolate(GROUND_STATION, true);
    let base = Point::new(-60.0, -60.0);
    let mut middle = Vector::zeros();
    for _ in 0..30 {
        h.run_s(1);
        middle += (h.pose(1).position() - base) / 30.0;
    }
    let behind = middle.normalize();
    let in_earshot = move |h: &Harness| (h.pose(1).position() - base).dot(&behind) < -12.0;
    (h, in_earshot)
}

/// Lets links be as where the UAV is, and says whether it comes to where it hears the station.
fn comes_to_hear(h: &mut Harness, in_earshot: &impl Fn(&Harness) -> bool, for_s: u64) -> bool {
    (0..for_s).any(|_| {
        h.run_s(1);
        assert!(from_base_m(h, 1) < 120.0);
        let hears = in_earshot(h);
        h.isolate(GROUND_STATION, !hears);
        h.beliefs(1).revision == 2
    })
}

#[test]
fn who_waits_where_it_hears_no_station_tries_other_circles_until_the_next_mission_comes() {
    let (mut h, in_earshot) = out_of_earshot();
    let next = Command::Mission(Arc::new(mission(2, 6, 4)));
    h.feed(GROUND_STATION, Input::Command(next));
    assert!(comes_to_hear(&mut h, &in_earshot, 500));
    h.isolate(GROUND_STATION, false);
    assert!(h.run_until(300, |h| h.beliefs(1).finished));
}

#[test]
fn who_was_told_to_return_waits_at_its_base_whoever_is_heard() {
    let (mut h, in_earshot) = out_of_earshot();
    h.isolate(GROUND_STATION, false);
    h.order(GROUND_STATION, Order::ReturnToBase);
    assert!(h.run_until(10, |h| h.beliefs(1).order == Order::ReturnToBase));
    h.isolate(GROUND_STATION, true);
    for _ in 0..300 {
        h.run_s(1);
        assert!(!in_earshot(&h));
    }
}

#[test]
fn a_command_at_a_uav_is_ignored_with_an_alarm() {
    let mut h = at_work();
    h.order(1, Order::Hold);
    h.run_s(3);
    assert!(h.beliefs(1).able);
    let alarm = "a command reached a peer that is no ground station; it was ignored";
    assert!(h.alarms(1).contains(&alarm.to_owned()));
}
