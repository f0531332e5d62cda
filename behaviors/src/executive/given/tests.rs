//! Given flights in an exact world: on time, clear of zones, and whole.

use super::*;
use crate::executive::{DEFAULT_TRACKING_ERROR_M, Goal};
use crate::testing::{CLEARANCE_M, Wing, airframe, rectangle, square};
use proptest::prelude::*;
use skein_flight::coverage::ring::CoverageLoop;
use skein_flight::route::{RouteLimits, Router};
use skein_flight::trajectory::Trajectory;
use skein_geometry::frame::Point;
use skein_geometry::math::FRAC_PI_2;
use skein_geometry::{NoFlyZones, Polygon};
use std::sync::Arc;

/// Turns of all flights here, metres; the airframe turns in 22.9 m at its cruise, and over
/// the ground in 32 m in a wind of 1.7 m/s.
const RADIUS_M: f64 = 34.0;

const PERIOD_MS: u64 = 200;

struct Test {
    executive: Executive,
    wing: Wing,
    zones: NoFlyZones,
    told: Vec<Event>,
}

impl Test {
    fn new(zones: Vec<Polygon>, start: Pose) -> Self {
        let zones = NoFlyZones::new(zones);
        let limits = RouteLimits {
            turn_radius_m: RADIUS_M,
            clearance_m: CLEARANCE_M,
        };
        let router = Arc::new(Router::new(Arc::new(zones.clone()), limits));
        let none = Arc::new(CoverageLoop::none());
        Self {
            executive: Executive::new(airframe(), 90.0, none, router),
            wing: Wing::new(start),
            zones,
            told: Vec::new(),
        }
    }

    fn give(&mut self, flight: &GivenFlight) {
        self.executive
            .set_goal(Goal::Given(flight.clone()), &|_| false);
    }

    fn step(&mut self) {
        let (setpoint, events) = self.executive.step(&self.wing.percept(), &|_| false);
        self.told.extend(events);
        self.wing.setpoint = Some(setpoint);
        self.wing.fly(PERIOD_MS);
    }

    fn fly_s(&mut self, s: u64) {
        for _ in 0..s * 1000 / PERIOD_MS {
            self.step();
        }
    }

    /// Flies until the end of the flight is told.
    fn until_done(&mut self, most_s: u64) {
        while !self.told.contains(&Event::PlanDone) {
            assert!(self.wing.time_ms < most_s * 1000, "{:?}", self.told);
            self.step();
        }
    }

    /// The greatest distance of a place on a curve from what was flown, metres.
    fn missed_m(&self, curve: &Curve) -> f64 {
        let (mut worst_m, mut at_m) = (0.0_f64, 0.0);
        while at_m <= curve.length_m() {
            let p = curve.pose_at(at_m).unwrap().position();
            let flown = self.wing.flown.iter();
            let least_m = flown.map(|q| (q.position() - p).norm());
            worst_m = worst_m.max(least_m.fold(f64::INFINITY, f64::min));
            at_m += 4.0;
        }
        worst_m
    }

    fn least_distance_m(&self) -> f64 {
        let each = self.wing.flown.iter();
        let each = each.map(|p| self.zones.distance_m(p.position()));
        each.fold(f64::INFINITY, f64::min)
    }

    fn flown_s(&self) -> f64 {
        #[allow(clippy::cast_precision_loss, reason = "minutes")]
        let s = self.wing.time_ms as f64 / 1000.0;
        s
    }
}

fn origin() -> Pose {
    Pose::new(Point::new(0.0, 0.0), 0.0)
}

/// Three lanes with turns between them.
fn lanes() -> GivenFlight {
    let half = RADIUS_M * 2.0 * FRAC_PI_2;
    let (left, right) = ((1.0 / RADIUS_M, half), (-1.0 / RADIUS_M, half));
    let pieces = [(0.0, 260.0), left, (0.0, 260.0), right, (0.0, 260.0)];
    GivenFlight {
        curve: Curve::from_pieces(origin(), &pieces),
        airspeed_mps: 13.0,
        lands: false,
    }
}

/// The cuts that were told.
fn cuts(told: &[Event]) -> Vec<(f64, Unflyable)> {
    let cut = |event: &Event| match event {
        Event::CutShort { at_m, why } => Some((*at_m, *why)),
        _ => None,
    };
    told.iter().filter_map(cut).collect()
}

#[test]
fn a_flight_takes_its_time_and_ends_in_a_circle_in_any_wind_that_it_can() {
    for wind in [(0.0, 0.0), (1.5, -0.8), (-0.4, 1.6)] {
        let flight = lanes();
        let in_air = Wind::new(wind.0, wind.1);
        let time_s = Trajectory::along(&flight.curve, 13.0, in_air)
            .unwrap()
            .duration_s();
        let heading = in_air.heading_for_course(skein_flight::trajectory::wind::Course(0.0), 13.0);
        let mut test = Test::new(
            vec![rectangle(50.0, -60.0, 80.0, 50.0)],
            Pose::new(Point::new(0.0, 0.0), heading.unwrap().0),
        );
        test.wing.wind_mps = wind;
        test.give(&flight);
        test.step();
        let told_s = f64::from(test.executive.finish_ms(&|_| false)) / 1000.0;
        assert!((told_s - time_s).abs() < 0.05, "{told_s} {time_s}");
        test.until_done(200);
        // It is told at the percept after the end, and then flown for a period.
        let late_s = test.flown_s() - time_s;
        assert!((0.0..0.5).contains(&late_s), "{wind:?}: {late_s}");
        assert_eq!(test.told, [Event::PlanDone]);
        assert!(test.missed_m(&flight.curve) < 0.3);
        let end = flight.curve.end().unwrap().position();
        for _ in 0..200 {
            test.step();
            let away_m = (test.wing.pose.position() - end).norm();
            assert!(away_m < 4.0 * RADIUS_M, "{away_m}");
        }
        assert_eq!(test.told, [Event::PlanDone]);
        assert!(test.least_distance_m() > CLEARANCE_M - 0.5);
    }
}

#[test]
fn who_is_elsewhere_finds_the_way_to_the_start_round_a_zone() {
    let start = Pose::new(Point::new(-200.0, 60.0), 2.0);
    let mut test = Test::new(vec![rectangle(-120.0, -50.0, 60.0, 200.0)], start);
    let flight = lanes();
    test.give(&flight);
    test.step();
    let told_s = f64::from(test.executive.finish_ms(&|_| false)) / 1000.0;
    test.until_done(300);
    assert!((test.flown_s() - told_s - 0.2).abs() < 0.5, "{told_s}");
    assert_eq!(cuts(&test.told), []);
    assert!(test.missed_m(&flight.curve) < 0.3);
    assert!(test.least_distance_m() > CLEARANCE_M - 0.5);
}

#[test]
fn who_is_blown_off_goes_on_where_it_left() {
    let flight = lanes();
    let mut test = Test::new(Vec::new(), origin());
    test.give(&flight);
    test.fly_s(25);
    test.wing.pose.north_m -= 40.0;
    test.wing.pose.heading_rad += 1.0;
    test.until_done(300);
    assert_eq!(cuts(&test.told), []);
    // What was on its right when it was carried off is flown afterwards.
    assert!(test.missed_m(&flight.curve) < 3.0);
}

#[test]
fn a_flight_ends_before_a_zone_where_there_is_room_to_wait() {
    // A corridor 60 m wide leads to a zone across it: circles fit only before it.
    let zones = vec![
        rectangle(100.0, 30.0, 150.0, 50.0),
        rectangle(100.0, -80.0, 150.0, 50.0),
        square(240.0, -20.0, 40.0),
    ];
    let mut test = Test::new(zones, origin());
    let flight = lanes();
    test.give(&flight);
    test.until_done(200);
    test.fly_s(120);
    let cuts = cuts(&test.told);
    assert_eq!(cuts.len(), 1, "{cuts:?}");
    let (at_m, why) = cuts[0];
    assert_eq!(why, Unflyable::NearZone);
    assert!(at_m > 20.0 && at_m < 100.0, "{at_m}");
    assert!(test.least_distance_m() > CLEARANCE_M - 0.5);
}

#[test]
fn a_flight_that_ends_where_nobody_can_wait_ends_before_that() {
    // Eight metres before a wall there is no way to turn.
    let wall = rectangle(312.0, -200.0, 30.0, 400.0);
    let mut flight = lanes();
    flight.curve = Curve::from_pieces(origin(), &[(0.0, 300.0)]);
    let mut test = Test::new(vec![wall], origin());
    test.give(&flight);
    test.until_done(100);
    test.fly_s(60);
    let cuts = cuts(&test.told);
    assert!(
        matches!(cuts[..], [(m, Unflyable::NoRoom)] if m > 250.0 && m < 290.0),
        "{cuts:?}"
    );
    assert!(test.least_distance_m() > CLEARANCE_M - 0.5);
    // Who lands there needs none.
    flight.lands = true;
    let mut test = Test::new(vec![rectangle(312.0, -200.0, 30.0, 400.0)], origin());
    test.give(&flight);
    test.until_done(100);
    assert_eq!(test.told, [Event::PlanDone]);
    assert!(test.missed_m(&flight.curve) < 0.3);
    flight.lands = false;
    // Between two blocks there is none either, but behind them one can turn and go back.
    let blocks = [20.0, -40.0].map(|south| rectangle(285.0, south, 30.0, 20.0));
    let mut test = Test::new(blocks.to_vec(), origin());
    test.give(&flight);
    test.until_done(100);
    test.fly_s(60);
    assert_eq!(test.told, [Event::PlanDone]);
    assert!(test.least_distance_m() > CLEARANCE_M - 0.5);
}

#[test]
fn a_flight_within_a_zone_is_not_begun() {
    let mut test = Test::new(
        vec![square(-20.0, -20.0, 40.0)],
        Pose::new(Point::new(0.0, 120.0), 0.0),
    );
    test.give(&lanes());
    test.fly_s(60);
    assert_eq!(cuts(&test.told), [(0.0, Unflyable::NearZone)]);
    assert!(test.least_distance_m() > CLEARANCE_M - 0.5);
}

#[test]
fn bends_that_the_airframe_cannot_follow_are_not_flown() {
    let mut flight = lanes();
    let tight = [(0.0, 150.0), (1.0 / 11.0, 30.0), (0.0, 50.0)];
    flight.curve = Curve::from_pieces(origin(), &tight);
    let mut test = Test::new(Vec::new(), origin());
    test.give(&flight);
    test.until_done(100);
    assert_eq!(cuts(&test.told), [(150.0, Unflyable::Bend)]);
    // What it can follow more slowly it flies more slowly.
    let slow = [(0.0, 150.0), (1.0 / 20.0, 60.0), (0.0, 50.0)];
    flight.curve = Curve::from_pieces(origin(), &slow);
    let mut test = Test::new(Vec::new(), origin());
    test.give(&flight);
    test.until_done(100);
    assert_eq!(cuts(&test.told), []);
    assert!(test.missed_m(&flight.curve) < 0.5);
    assert!(test.flown_s() > 260.0 / 13.0 + 1.0, "{}", test.flown_s());
}

#[test]
fn a_wind_that_rises_ends_a_flight_and_one_that_abates_lets_it_go_on() {
    let flight = lanes();
    let mut test = Test::new(Vec::new(), origin());
    test.give(&flight);
    test.fly_s(5);
    test.wing.wind_mps = (0.0, 6.0);
    test.fly_s(60);
    let bend = cuts(&test.told);
    assert!(
        matches!(bend[..], [(_, Unflyable::Bend)]),
        "{bend:?} {:?}",
        test.told
    );
    test.wing.wind_mps = (0.0, 0.5);
    test.told.clear();
    test.until_done(400);
    assert_eq!(cuts(&test.told), []);
    let missed_m = test.missed_m(&flight.curve);
    // As far as the wind pushes it when it rises at once.
    assert!(missed_m < 3.0, "{missed_m}");
    // Nobody makes way against a wind that is faster.
    let mut test = Test::new(Vec::new(), origin());
    test.give(&flight);
    test.wing.wind_mps = (-14.0, 0.0);
    test.fly_s(4);
    assert!(matches!(
        cuts(&test.told)[..],
        [(_, Unflyable::Wind | Unflyable::Bend)]
    ));
}

#[test]
fn what_is_no_flight_is_told_and_flown_as_far_as_it_is_one() {
    let line = Segment {
        start: origin(),
        curvature_per_m: 0.0,
        length_m: 100.0,
    };
    let elsewhere = Segment {
        start: Pose::new(Point::new(100.0, 3.0), 0.0),
        ..line
    };
    let spoiled = Segment {
        length_m: f64::NAN,
        ..line
    };
    let backwards = Segment {
        length_m: -5.0,
        ..line
    };
    for (pieces, at_m) in [
        (vec![line, elsewhere], Some(100.0)),
        (vec![spoiled], Some(0.0)),
        (vec![backwards, line], Some(0.0)),
        (vec![], None),
    ] {
        let mut curve = Curve::empty();
        pieces.iter().for_each(|s| curve.push(*s));
        let flight = GivenFlight {
            curve,
            airspeed_mps: 13.0,
            lands: false,
        };
        let mut test = Test::new(Vec::new(), origin());
        test.give(&flight);
        test.until_done(60);
        let told = at_m.map(|m| (m, Unflyable::Gap));
        assert_eq!(cuts(&test.told), Vec::from_iter(told));
    }
    for airspeed_mps in [f64::NAN, 0.0, -3.0, 1e9] {
        let flight = GivenFlight {
            airspeed_mps,
            ..lanes()
        };
        let mut test = Test::new(Vec::new(), origin());
        test.give(&flight);
        test.until_done(200);
        assert!(test.missed_m(&flight.curve) < 0.5);
    }
}

#[test]
fn another_goal_ends_a_flight_and_the_same_flight_given_twice_goes_on() {
    let flight = lanes();
    let mut test = Test::new(Vec::new(), origin());
    test.give(&flight);
    test.fly_s(15);
    test.give(&flight);
    test.until_done(200);
    let once_s = flight.curve.length_m() / 13.0;
    assert!((test.flown_s() - once_s).abs() < 0.6, "{}", test.flown_s());
    let mut test = Test::new(Vec::new(), origin());
    test.give(&flight);
    test.fly_s(15);
    test.executive.set_goal(Goal::Hold, &|_| false);
    test.fly_s(30);
    assert_eq!(test.told, []);
    let away_m = (test.wing.pose.position() - Point::new(200.0, 0.0)).norm();
    assert!(away_m < 4.0 * RADIUS_M, "{away_m}");
    // Given again it begins at its start, and another one at its own.
    test.give(&flight);
    test.fly_s(10);
    let other = GivenFlight {
        curve: flight.curve.reversed(),
        ..flight.clone()
    };
    test.give(&other);
    test.until_done(300);
    assert!(test.missed_m(&other.curve) < 0.5);
    assert_eq!(cuts(&test.told), []);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn whatever_is_given_nobody_comes_near_to_a_zone(
        pieces in prop::collection::vec((-1i8..=1, 5.0f64..120.0), 1..8),
        blocks in prop::collection::vec((30.0f64..340.0, -200.0f64..240.0, 8.0f64..70.0, 8.0f64..70.0), 0..5),
        wind in (-1.5f64..1.5, -1.5f64..1.5),
    ) {
        let zones = blocks.iter().map(|&(x, y, w, h)| rectangle(x, y, w, h)).collect();
        let bent = pieces.iter().map(|&(side, m)| (f64::from(side) / RADIUS_M, m));
        let flight = GivenFlight {
            curve: Curve::from_pieces(origin(), &bent.collect::<Vec<_>>()),
            airspeed_mps: 13.0,
            lands: false,
        };
        let mut test = Test::new(zones, origin());
        test.wing.wind_mps = wind;
        test.give(&flight);
        test.until_done(400);
        test.fly_s(60);
        let least_m = test.least_distance_m();
        prop_assert!(least_m > CLEARANCE_M - DEFAULT_TRACKING_ERROR_M - 0.5, "{least_m} {:?}", test.told);
        if cuts(&test.told).is_empty() {
            prop_assert!(test.missed_m(&flight.curve) < 1.0);
        }
    }
}
