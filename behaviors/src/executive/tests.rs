//! One UAV on a real loop, flown by an exact airframe.
//!
//! Every flight checks on the way what must always hold: what is reported seen was in
//! a true frame, and the flown path keeps its distance from the zones.

use super::*;
use crate::testing::{CLEARANCE_M, LANE_M, Wing, airframe, loop_and_router, rectangle, square};
use Direction::{Backward, Forward};
use proptest::prelude::*;
use skein_geometry::Polygon;
use skein_geometry::frame::Pose;

struct Flight {
    executive: Executive,
    wing: Wing,
    open: Vec<bool>,
    told: Vec<Event>,
    zones: Vec<Polygon>,
    looked: usize,
}

impl Flight {
    fn new(cols: u32, rows: u32, zones: Vec<Polygon>, start: Pose) -> Self {
        let (coverage_loop, router) = loop_and_router(cols, rows, zones.clone());
        let open = vec![true; coverage_loop.len()];
        let executive = Executive::new(airframe(), 90.0, coverage_loop, router);
        Self {
            executive,
            wing: Wing::new(start),
            open,
            told: Vec::new(),
            zones,
            looked: 0,
        }
    }

    /// The cell being flown, to serve it or on the way.
    fn under_way(&self) -> Option<(u16, Direction)> {
        let front = self.executive.stretches.front();
        front
            .filter(|_| !self.executive.replan)
            .and_then(|s| s.kind.cell())
    }

    fn n(&self) -> u16 {
        u16::try_from(self.open.len()).unwrap()
    }

    fn legs(&mut self, legs: &[(u16, u16, Direction)]) {
        let legs = legs
            .iter()
            .map(|&(first, count, direction)| Leg {
                first,
                count,
                direction,
            })
            .collect();
        let open = self.open.clone();
        self.executive
            .set_goal(Goal::Legs(legs), &|c| open[usize::from(c)]);
    }

    fn leg_time_ms(&self, legs: &[(u16, u16, Direction)]) -> u32 {
        let legs: Vec<Leg> = legs
            .iter()
            .map(|&(first, count, direction)| Leg {
                first,
                count,
                direction,
            })
            .collect();
        let times = self
            .executive
            .schedule(&legs, &|c| self.open[usize::from(c)]);
        times.last().map_or(0, |(_, ms)| *ms)
    }

    fn forecast(&self, window_ms: u32) -> Forecast {
        self.executive
            .forecast(window_ms, &|c| self.open[usize::from(c)])
    }

    /// One percept, answered at once, and the flight until the next.
    fn step(&mut self, period_ms: u64) -> Vec<Event> {
        self.step_late(period_ms, 0)
    }

    /// One percept whose answer takes `late_ms`, and the flight until the next.
    fn step_late(&mut self, period_ms: u64, late_ms: u64) -> Vec<Event> {
        let open = self.open.clone();
        let (setpoint, events) = self
            .executive
            .step(&self.wing.percept(), &|c| open[usize::from(c)]);
        for e in &events {
            if let Event::Seen(cells) = e {
                for i in cells.iter().copied().map(usize::from) {
                    let id = self.executive.transit.coverage_loop.cells()[i].id;
                    self.assert_truly_seen(id);
                    self.open[i] = false;
                }
            }
        }
        self.told.extend(
            events
                .iter()
                .filter(|e| !matches!(e, Event::Seen(_)))
                .cloned(),
        );
        self.looked = self.wing.flown.len() - 1;
        self.wing.fly(late_ms);
        self.wing.setpoint = Some(setpoint);
        self.wing.fly(period_ms - late_ms);
        events
    }

    /// Some pose truly flown since the percept before had all of the cell in frame.
    fn assert_truly_seen(&self, id: skein_flight::coverage::ring::CellId) {
        let (w, s) = (f64::from(id.col) * LANE_M, f64::from(id.row) * LANE_M);
        let corners = [
            (w, s),
            (w + LANE_M, s),
            (w, s + LANE_M),
            (w + LANE_M, s + LANE_M),
        ];
        let a = airframe();
        let framed = self.wing.flown[self.looked..].iter().any(|p| {
            let (sin, cos) = p.heading_rad.sin_cos();
            corners.iter().all(|(x, y)| {
                let (x, y) = (x - p.east_m, y - p.north_m);
                (x * cos + y * sin).abs() <= a.footprint_along_m
                    && (y * cos - x * sin).abs() <= a.footprint_across_m
            })
        });
        assert!(framed, "{id:?} was reported and not seen");
    }

    fn until(
        &mut self,
        periods_ms: &[u64],
        late_ms: u64,
        most_s: u64,
        end: impl Fn(&Event) -> bool,
    ) {
        for i in 0.. {
            assert!(
                self.wing.time_ms < most_s * 1000,
                "no end: {:?}, {:?}",
                self.executive.stretches.front(),
                self.executive.queue
            );
            let events = self.step_late(periods_ms[i % periods_ms.len()], late_ms);
            if events.iter().any(&end) {
                return;
            }
        }
    }

    fn until_done(&mut self, most_s: u64) {
        self.until(&[200], 0, most_s, |e| *e == Event::PlanDone);
    }

    fn least_distance_m(&self) -> f64 {
        let distance = |p: &Pose| {
            self.zones
                .iter()
                .map(|z| z.distance_m(p.position()))
                .fold(f64::INFINITY, f64::min)
        };
        self.wing
            .flown
            .iter()
            .map(distance)
            .fold(f64::INFINITY, f64::min)
    }
}

fn outside() -> Pose {
    Pose {
        east_m: -30.0,
        north_m: -30.0,
        heading_rad: 0.7,
    }
}

fn block() -> Vec<Polygon> {
    vec![rectangle(
        4.0 * LANE_M + 10.0,
        2.0 * LANE_M + 12.0,
        60.0,
        70.0,
    )]
}

#[test]
fn one_uav_sees_the_whole_loop_in_either_direction() {
    for direction in [Forward, Backward] {
        let mut flight = Flight::new(10, 8, block(), outside());
        let n = flight.n();
        assert!(n > 60);
        flight.step(200);
        let foretold_s = u64::from(flight.leg_time_ms(&[(3, n, direction)])) / 1000;
        flight.legs(&[(3, n, direction)]);
        flight.until_done(foretold_s + 60);
        assert!(flight.open.iter().all(|o| !o));
        assert_eq!(flight.told, [Event::PlanDone]);
        // It is never late; cells seen in passing make it early, for their excursions
        // are not flown.
        let flown_s = flight.wing.time_ms / 1000;
        assert!(flown_s * 10 > foretold_s * 6, "{flown_s} {foretold_s}");
        assert!(
            flight.least_distance_m() > CLEARANCE_M - 0.3,
            "{}",
            flight.least_distance_m()
        );
        // Afterwards it loiters where it is, and says nothing more.
        let there = flight.wing.pose.position();
        for _ in 0..400 {
            assert!(flight.step(200).is_empty());
            assert!((flight.wing.pose.position() - there).norm() < 120.0);
        }
        assert!(flight.least_distance_m() > CLEARANCE_M - 0.3);
    }
}

#[test]
fn a_flight_that_is_set_up_once_is_on_time_to_the_second() {
    let mut flight = Flight::new(10, 8, vec![], outside());
    flight.step(200);
    let legs = [(0, 30, Forward), (70, 8, Backward)];
    let foretold_ms = u64::from(flight.leg_time_ms(&legs));
    let from_ms = flight.wing.time_ms - 200;
    flight.legs(&legs);
    flight.until_done(1000);
    let flown_ms = flight.wing.time_ms - from_ms;
    assert!(
        flown_ms.abs_diff(foretold_ms) < 2000,
        "{flown_ms} {foretold_ms}"
    );
}

#[test]
fn a_wind_hides_no_cell_and_brings_nobody_nearer_to_a_zone() {
    for (direction, wind) in [
        (Forward, (1.8, -0.9)),
        (Backward, (-1.2, 1.6)),
        (Forward, (0.0, 2.4)),
    ] {
        let mut flight = Flight::new(10, 8, block(), outside());
        flight.wing.wind_mps = wind;
        let n = flight.n();
        flight.step(200);
        let foretold_s = u64::from(flight.leg_time_ms(&[(3, n, direction)])) / 1000;
        flight.legs(&[(3, n, direction)]);
        flight.until_done(foretold_s + 60);
        assert!(flight.open.iter().all(|o| !o));
        assert_eq!(flight.told, [Event::PlanDone]);
        let least_m = flight.least_distance_m();
        assert!(least_m > CLEARANCE_M - 0.6, "{wind:?}: {least_m}");
        // Its loiter stands over the ground.
        let there = flight.wing.pose.position();
        for _ in 0..400 {
            assert!(flight.step(200).is_empty());
            assert!((flight.wing.pose.position() - there).norm() < 120.0);
        }
        assert!(flight.least_distance_m() > CLEARANCE_M - 0.6);
    }
}

#[test]
fn in_a_wind_it_is_on_time_too() {
    let mut times_ms = Vec::new();
    for wind in [(0.0, 0.0), (2.0, 0.0), (-1.0, -1.5)] {
        let mut flight = Flight::new(10, 8, vec![], outside());
        flight.wing.wind_mps = wind;
        flight.step(200);
        let legs = [(0, 30, Forward), (70, 8, Backward)];
        let foretold_ms = u64::from(flight.leg_time_ms(&legs));
        let from_ms = flight.wing.time_ms - 200;
        flight.legs(&legs);
        flight.until_done(1000);
        let flown_ms = flight.wing.time_ms - from_ms;
        let late_ms = flown_ms.abs_diff(foretold_ms);
        assert!(late_ms < 2500, "{wind:?}: {flown_ms} {foretold_ms}");
        times_ms.push(foretold_ms);
    }
    assert!(
        times_ms[0] + 5000 < times_ms[1].min(times_ms[2]),
        "{times_ms:?}"
    );
}

#[test]
fn a_wind_that_turns_on_the_way_is_followed() {
    let mut flight = Flight::new(10, 8, block(), outside());
    flight.step(200);
    flight.legs(&[(0, flight.n(), Forward)]);
    for (i, wind) in [(0.0, 2.0), (2.0, 0.4), (0.0, 0.0), (-1.4, -1.4)]
        .into_iter()
        .enumerate()
    {
        flight.wing.wind_mps = wind;
        for _ in 0..200 + i {
            flight.step(200);
        }
    }
    flight.until_done(1500);
    assert!(flight.open.iter().all(|o| !o));
    assert!(flight.least_distance_m() > CLEARANCE_M - 1.0);
}

#[test]
fn a_cell_without_its_proof_is_refused_and_not_flown() {
    // The loop knows nothing of the zone: the certificate alone keeps the UAV out of it.
    let mut flight = Flight::new(10, 8, vec![], outside());
    let zones = vec![square(186.0, 138.0, 60.0)];
    let (_, router) = loop_and_router(10, 8, zones.clone());
    let blind = Arc::clone(&flight.executive.transit.coverage_loop);
    flight.executive = Executive::new(airframe(), 90.0, blind, router);
    flight.zones = zones;
    flight.step(200);
    flight.legs(&[(0, flight.n(), Forward)]);
    flight.until_done(1500);
    let refused = flight.told.iter().filter_map(|e| match e {
        Event::Refused { cells } => Some(cells.len()),
        _ => None,
    });
    let refused: usize = refused.sum();
    let open = flight.open.iter().filter(|o| **o).count();
    assert!(refused > 0 && refused < 12, "{:?}", flight.told);
    assert!(open <= refused, "{open} {refused}");
    let least_m = flight.least_distance_m();
    assert!(least_m > DEFAULT_TRACKING_ERROR_M, "{least_m}");
}

#[test]
fn gaps_in_a_plan_are_passed_or_cut_short() {
    let mut flight = Flight::new(10, 8, block(), outside());
    for i in (10..30).chain(33..50) {
        flight.open[i] = false;
    }
    flight.step(200);
    let whole_ms = u64::from(flight.n()) * 3700;
    flight.legs(&[(5, 50, Forward)]);
    flight.until_done(400);
    let left: Vec<usize> = (5..55).filter(|i| flight.open[*i]).collect();
    assert!(left.is_empty(), "{left:?}");
    assert!(flight.wing.time_ms < whole_ms, "{}", flight.wing.time_ms);
    assert!(flight.least_distance_m() > CLEARANCE_M - 0.3);
}

#[test]
fn it_turns_round_for_a_second_leg() {
    let mut flight = Flight::new(10, 8, vec![], outside());
    flight.step(200);
    flight.legs(&[(10, 6, Forward), (9, 6, Backward)]);
    flight.until_done(300);
    assert!((4..16).all(|i| !flight.open[i]));
    assert_eq!(flight.told, [Event::PlanDone]);
}

#[test]
fn late_and_missing_percepts_leave_no_gap() {
    for (periods, late) in [
        (&[500, 420, 610, 380][..], 0),
        (&[500, 420, 610, 380][..], 120),
        (&[200, 200, 900][..], 50),
        (&[[200; 150].as_slice(), &[3500]].concat()[..], 30),
    ] {
        let mut flight = Flight::new(10, 8, block(), outside());
        flight.step(200);
        flight.legs(&[(0, 40, Forward)]);
        flight.until(periods, late, 900, |e| *e == Event::PlanDone);
        assert!((0..40).all(|i| !flight.open[i]), "{periods:?}");
        assert_eq!(flight.told, [Event::PlanDone]);
        assert!(
            flight.least_distance_m() > CLEARANCE_M - 2.0,
            "{periods:?}: {}",
            flight.least_distance_m()
        );
    }
}

#[test]
fn a_cell_that_cannot_be_reached_is_refused_and_the_rest_flown() {
    // Walls on all sides of the area but no way in: the UAV is outside.
    let wall = |e: f64, n: f64, w: f64, h: f64| rectangle(e, n, w, h);
    let zones = vec![
        wall(-140.0, -140.0, 680.0, 20.0),
        wall(-140.0, 500.0, 680.0, 20.0),
        wall(-140.0, -120.0, 20.0, 620.0),
        wall(520.0, -120.0, 20.0, 620.0),
    ];
    let mut flight = Flight::new(
        8,
        8,
        zones,
        Pose {
            east_m: -300.0,
            north_m: 0.0,
            heading_rad: 1.0,
        },
    );
    flight.step(200);
    assert_eq!(flight.forecast(5000).release_ms, UNREACHABLE_MS);
    flight.legs(&[(0, 5, Forward)]);
    flight.until_done(20);
    let refused: Vec<u16> = flight
        .told
        .iter()
        .flat_map(|e| {
            if let Event::Refused { cells } = e {
                cells.clone()
            } else {
                vec![]
            }
        })
        .collect();
    assert_eq!(refused, [0, 1, 2, 3, 4]);
}

#[test]
fn a_cell_that_the_camera_never_sees_is_refused_after_three_tries() {
    let mut flight = Flight::new(6, 6, vec![], outside());
    flight.executive.transit.airframe.footprint_along_m = 20.0;
    flight.step(200);
    flight.legs(&[(3, 1, Forward)]);
    flight.until_done(300);
    assert_eq!(
        flight.told,
        [Event::Refused { cells: vec![3] }, Event::PlanDone]
    );
    assert!(flight.wing.time_ms > 30_000);
}

#[test]
fn new_legs_that_begin_where_it_is_change_nothing_on_the_way() {
    let mut plain = Flight::new(10, 8, vec![], outside());
    plain.step(200);
    plain.legs(&[(0, 20, Forward)]);
    let mut again = Flight::new(10, 8, vec![], outside());
    again.step(200);
    again.legs(&[(0, 20, Forward)]);
    let mut last = 0;
    while again.open[15] {
        plain.step(200);
        again.step(200);
        if let Some((cell, Forward)) = again.under_way()
            && cell < 15
        {
            // The cell under way may be seen already: the plan then begins after it.
            let first = if again.open[usize::from(cell)] {
                cell
            } else {
                cell + 1
            };
            again.legs(&[(first, 20 - first, Forward)]);
            last = cell;
        }
        let off_m = (plain.wing.pose.position() - again.wing.pose.position()).norm();
        assert!(off_m < 0.05, "{off_m} {:?}", again.under_way());
    }
    assert!(last >= 13);
}

#[test]
fn forecasts_come_true() {
    let mut flight = Flight::new(10, 8, block(), outside());
    flight.step(200);
    let first = flight.forecast(1000);
    assert!(first.cells.is_empty() && first.release_ms > 0 && first.release_ms < 60_000);
    flight.legs(&[(0, 40, Forward)]);
    flight.step(200);
    while flight.open[6] {
        flight.step(200);
    }
    for window_ms in [0, 3_000, 15_000] {
        flight.step(200);
        let f = flight.forecast(window_ms);
        assert_eq!(f.heading, Forward);
        // The cell under way is finished, and an excursion takes up to 15 s.
        assert!(f.release_ms <= window_ms + 15_000, "{f:?}");
        let mut later = Flight {
            executive: flight.executive.clone(),
            wing: flight.wing.clone(),
            open: flight.open.clone(),
            told: vec![],
            zones: vec![],
            looked: flight.looked,
        };
        // The forecast was made 200 ms ago, at the last percept.
        for _ in 0..f.release_ms.saturating_sub(200) / 10 {
            later.wing.fly(10);
            if later.wing.time_ms.is_multiple_of(200) {
                later.step(0);
            }
        }
        let anchor = later.executive.transit.place(f.anchor, f.heading).pose;
        let off_m = (later.wing.pose.position() - anchor.position()).norm();
        assert!(off_m < 0.5, "{f:?}: {off_m}");
        assert!(
            f.cells.iter().all(|c| !later.open[usize::from(*c)]),
            "{f:?}"
        );
    }
}

#[test]
fn it_flies_to_a_point_and_stays_there() {
    let mut flight = Flight::new(10, 8, block(), outside());
    let goal = Point::new(420.0, 330.0);
    flight.step(200);
    flight.executive.set_goal(Goal::Point(goal), &|_| false);
    // A block stands in the way, so it may have to follow the loop for a while.
    let away_m = |flight: &Flight| (flight.wing.pose.position() - goal).norm();
    while away_m(&flight) > 40.0 {
        assert!(flight.wing.time_ms < 600_000, "it never gets there");
        flight.step(200);
    }
    for _ in 0..300 {
        flight.step(200);
        flight.executive.set_goal(Goal::Point(goal), &|_| false);
        assert!(away_m(&flight) < 130.0);
    }
    assert!(flight.told.is_empty());
}

#[test]
fn without_a_goal_it_holds_where_it_is() {
    let mut flight = Flight::new(10, 8, block(), outside());
    for _ in 0..500 {
        flight.step(200);
        assert!((flight.wing.pose.position() - outside().position()).norm() < 70.0);
    }
    assert!(flight.told.is_empty());
}

#[test]
fn it_comes_back_from_its_failsafe() {
    let mut flight = Flight::new(10, 8, block(), outside());
    flight.step(200);
    flight.legs(&[(0, 30, Forward)]);
    for i in 0..200 {
        flight.step(if i % 60 == 59 { 20_000 } else { 200 });
    }
    flight.until_done(900);
    assert!((0..30).all(|i| !flight.open[i]));
    assert!(flight.least_distance_m() > 0.5);
}

#[test]
fn a_percept_without_numbers_is_answered_safely() {
    let mut flight = Flight::new(6, 6, vec![], outside());
    let mut percept = flight.wing.percept();
    percept.pose.heading_rad = f64::NAN;
    let (setpoint, events) = flight.executive.step(&percept, &|_| true);
    assert!(events.is_empty() && setpoint.steps.iter().all(|s| s.turn_rate_radps.is_finite()));
}

#[test]
fn leg_times_grow_with_the_legs() {
    let mut flight = Flight::new(10, 8, block(), outside());
    assert_eq!(flight.leg_time_ms(&[(0, 1, Forward)]), 0, "no percept yet");
    flight.step(200);
    let times: Vec<u32> = (0..20)
        .map(|k| flight.leg_time_ms(&[(0, k, Forward)]))
        .collect();
    assert!(times[0] == 0 && times.windows(2).all(|w| w[0] < w[1]));
    let p = flight.wing.percept();
    assert_eq!(flight.executive.spendable_ms(&p), 2_880_000);
    assert_eq!(
        flight.executive.spendable_ms(&Percept {
            endurance_s: 5.0,
            ..p
        }),
        0
    );
    assert!((12_000..17_000).contains(&flight.executive.turn_ms()));
}

/// The track is lengthened cell by cell and never made anew while all goes well.
#[test]
fn a_steady_flight_plans_nothing() {
    let mut flight = Flight::new(10, 8, vec![square(100.0, 900.0, 50.0)], outside());
    flight.step(200);
    flight.legs(&[(0, 60, Forward)]);
    while flight.open[5] {
        flight.step(200);
    }
    for _ in 0..300 {
        flight.step(200);
        assert!(flight.executive.stretches.len() <= 4 && !flight.executive.replan);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]
    #[test]
    fn no_open_cell_of_the_legs_is_skipped(
        legs in prop::collection::vec((0u16..70, 1u16..9, any::<bool>()), 1..4),
        closed in prop::collection::vec(0usize..70, 0..40),
        period in 15u64..60,
        east in -60.0..300.0f64,
        heading in -3.0..3.0f64,
    ) {
        let start = Pose { east_m: east, north_m: -60.0, heading_rad: heading };
        let mut flight = Flight::new(10, 8, block(), start);
        for c in closed {
            flight.open[c] = false;
        }
        flight.step(200);
        let n = flight.n();
        let legs: Vec<_> = legs.into_iter()
            .map(|(f, c, b)| (f % n, c, if b { Backward } else { Forward }))
            .collect();
        flight.legs(&legs);
        flight.until(&[period * 10], 0, 1200, |e| *e == Event::PlanDone);
        for (first, count, direction) in legs {
            for cell in (Leg { first, count, direction }).cells(usize::from(n)) {
                prop_assert!(!flight.open[usize::from(cell)], "cell {cell} was skipped: {:?}", flight.told);
            }
        }
        prop_assert!(flight.least_distance_m() > CLEARANCE_M - 2.0);
    }

    #[test]
    fn whatever_is_asked_in_a_wind_every_track_keeps_its_margin(
        blocks in prop::collection::vec((1u32..8, 1u32..6, 10.0f64..60.0, 10.0f64..60.0), 0..4),
        (speed, towards) in (0.0f64..2.7, 0.0f64..std::f64::consts::TAU),
        goals in prop::collection::vec((0u8..3, 0u16..70, -20.0f64..500.0, -20.0f64..400.0), 1..5),
        heading in -3.0..3.0f64,
    ) {
        let at = |cell: u32, side_m: f64| f64::from(cell) * LANE_M + 30.0 - side_m / 2.0;
        let zones = blocks.iter().map(|&(x, y, w, h)| rectangle(at(x, w), at(y, h), w, h));
        let start = Pose { east_m: -30.0, north_m: -30.0, heading_rad: heading };
        let mut flight = Flight::new(10, 8, zones.collect(), start);
        flight.wing.wind_mps = (speed * towards.cos(), speed * towards.sin());
        let n = flight.n();
        for (kind, first, east, north) in goals {
            match kind {
                0 => flight.executive.set_goal(Goal::Hold, &|_| true),
                1 => flight.legs(&[(first % n, 6, if first % 2 == 0 { Forward } else { Backward })]),
                _ => flight.executive.set_goal(Goal::Point(Point::new(east, north)), &|_| true),
            }
            for _ in 0..150 {
                flight.step(200);
                let ahead = flight.executive.track.ahead(1e9);
                let mut at_m = 0.0;
                while at_m < ahead.length_m() {
                    let p = ahead.pose_at(at_m).unwrap().position();
                    let near = flight.zones.iter().map(|z| z.distance_m(p));
                    let least_m = near.fold(f64::INFINITY, f64::min);
                    prop_assert!(least_m > DEFAULT_TRACKING_ERROR_M - 1e-3, "{least_m} at {p}");
                    at_m += 0.5;
                }
            }
        }
        prop_assert!(flight.least_distance_m() > CLEARANCE_M - 2.0, "{}", flight.least_distance_m());
    }
}

#[test]
fn who_has_not_taken_off_sees_nothing_and_is_foretold_from_where_it_stands() {
    let mut f = Flight::new(6, 4, Vec::new(), outside());
    f.legs(&[(0, 24, Forward)]);
    // It stands in the middle of a cell that a frame there would hold.
    let cell = f.executive.transit.coverage_loop.cells()[2].clone();
    let on_cell = cell.curve.pose_at(cell.view_m).unwrap();
    let percept = |pose, time_ms, takes_off_in_ms| Percept {
        takes_off_in_ms,
        ..crate::testing::percept_at(pose, time_ms)
    };
    let is_open = |_| true;
    for t in 0..5 {
        let ground = percept(on_cell, 200 * t, 9_000 - 200 * u32::try_from(t).unwrap());
        let (_, events) = f.executive.step(&ground, &is_open);
        assert!(events.is_empty(), "{events:?}");
    }
    let forecast = f.executive.forecast(5_000, &is_open);
    let off = forecast.off_loop.unwrap();
    assert_eq!(
        (off, forecast.cells.len()),
        (OffLoop::of(on_cell, 8_200), 0)
    );
    assert!(forecast.release_ms >= 8_200 && forecast.finish_ms > forecast.release_ms);
    // In the air it sees the cell.
    let (_, events) = f.executive.step(&percept(on_cell, 9_000, 0), &is_open);
    assert!(matches!(&events[..], [Event::Seen(_)]), "{events:?}");
}

/// From close before a zone no way home is found; from elsewhere on the circle there is one.
#[test]
fn who_finds_no_way_from_where_it_is_tries_again_from_its_circle() {
    let zones = vec![square(200.0, 100.0, 40.0)];
    let (coverage_loop, router) = loop_and_router(12, 10, zones);
    let transit = Transit::new(Arc::clone(&coverage_loop), Arc::clone(&router), airframe());
    let home = Point::new(225.0, 420.0);
    let poses = (0..12).flat_map(|k| {
        let at = move |n: u32| Point::new(150.0 + 4.0 * f64::from(k), 90.0 + 10.0 * f64::from(n));
        (0..6).map(move |n| Pose::new(at(n), 0.1))
    });
    let is_stranded = |pose: &Pose| {
        let from = Place {
            pose: *pose,
            boundary: None,
        };
        transit.way_to_wait_at(&from, home).is_none()
    };
    let stranded: Vec<Pose> = poses.filter(is_stranded).collect();
    assert!(stranded.len() > 3, "{}", stranded.len());
    for pose in stranded.into_iter().step_by(2) {
        let mut executive = Executive::new(
            airframe(),
            90.0,
            Arc::clone(&coverage_loop),
            Arc::clone(&router),
        );
        executive.set_goal(Goal::Point(home), &|_| false);
        let mut wing = Wing::new(pose);
        for _ in 0..600 {
            let (setpoint, _) = executive.step(&wing.percept(), &|_| false);
            wing.setpoint = Some(setpoint);
            wing.fly(200);
        }
        let away_m = (wing.pose.position() - home).norm();
        assert!(away_m < 60.0, "{pose:?}: {away_m} m");
    }
}
