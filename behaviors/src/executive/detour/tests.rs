//! Detours in an exact world: flown whole between cells, seen, and foretold.

use super::*;
use crate::executive::{GivenFlight, Goal};
use crate::testing::{CLEARANCE_M, Wing, airframe, loop_and_router, square};
use skein_flight::coverage::ring::Direction;
use skein_flight::coverage::ring::backtracking::Leg;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::{Curve, NoFlyZones, Polygon};

const PERIOD_MS: u64 = 200;

struct Test {
    executive: Executive,
    wing: Wing,
    open: Vec<bool>,
    told: Vec<(u64, Event)>,
    zones: NoFlyZones,
}

impl Test {
    fn new(zones: Vec<Polygon>) -> Self {
        let (coverage_loop, router) = loop_and_router(8, 6, zones.clone());
        let start = coverage_loop.curve(0, Direction::Forward).start().unwrap();
        Self {
            open: vec![true; coverage_loop.len()],
            executive: Executive::new(airframe(), 90.0, coverage_loop, router),
            wing: Wing::new(start),
            told: Vec::new(),
            zones: NoFlyZones::new(zones),
        }
    }

    fn all(&self) -> Vec<Leg> {
        vec![Leg {
            first: 0,
            count: u16::try_from(self.open.len()).unwrap(),
            direction: Direction::Forward,
        }]
    }

    fn goal(&mut self, goal: Goal) {
        let open = self.open.clone();
        self.executive.set_goal(goal, &|c| open[usize::from(c)]);
    }

    fn step(&mut self) {
        let open = self.open.clone();
        let (setpoint, events) = self
            .executive
            .step(&self.wing.percept(), &|c| open[usize::from(c)]);
        for e in events {
            if let Event::Seen(cells) = &e {
                cells
                    .iter()
                    .for_each(|c| self.open[usize::from(*c)] = false);
            }
            self.told.push((self.wing.time_ms, e));
        }
        self.wing.setpoint = Some(setpoint);
        self.wing.fly(PERIOD_MS);
    }

    fn fly_s(&mut self, s: u64) {
        (0..s * 1000 / PERIOD_MS).for_each(|_| self.step());
    }

    fn finish_ms(&self) -> u64 {
        let open = |c: u16| self.open[usize::from(c)];
        u64::from(self.executive.finish_ms(&open))
    }

    fn when(&self, is: impl Fn(&Event) -> bool) -> Option<u64> {
        self.told.iter().find(|(_, e)| is(e)).map(|(t, _)| *t)
    }
}

fn straight_over(at: Point) -> GivenFlight {
    let start = Pose::new(Point::new(at.x - 20.0, at.y), 0.0);
    GivenFlight {
        curve: Curve::from_pieces(start, &[(0.0, 40.0)]),
        airspeed_mps: 13.0,
        lands: false,
    }
}

/// The square around a place.
fn place(at: Point) -> Watched {
    let corner = |x: f64, y: f64| Point::new(at.x + x, at.y + y);
    let r = 10.0;
    Watched::new(Arc::new([[
        corner(-r, -r),
        corner(r, -r),
        corner(r, r),
        corner(-r, r),
    ]]))
}

#[test]
fn a_place_is_seen_between_two_cells_and_all_cells_after_it() {
    for at in [
        Point::new(500.0, 100.0),
        Point::new(-180.0, 60.0),
        Point::new(190.0, 150.0),
    ] {
        let mut test = Test::new(vec![square(420.0, 60.0, 30.0)]);
        test.goal(Goal::Legs(test.all()));
        test.fly_s(30);
        let before_ms = test.finish_ms();
        test.executive.watch(Some(place(at)));
        let flight = straight_over(at);
        test.goal(Goal::Detour(flight.clone(), test.all()));
        let end_ms = test.wing.time_ms + test.finish_ms();
        assert!(test.finish_ms() > before_ms, "a detour takes time");
        // The same said again in the middle of it changes nothing.
        for _ in 0..20 {
            test.fly_s(2);
            test.goal(Goal::Detour(flight.clone(), test.all()));
        }
        while test.when(|e| *e == Event::PlanDone).is_none() {
            assert!(test.wing.time_ms < end_ms + 30_000, "{at}: {:?}", test.told);
            test.step();
        }
        let flown = test.when(|e| *e == Event::DetourFlown).unwrap();
        let seen = Event::Sighted { seen: 1, of: 1 };
        let seen = test.when(|e| *e == seen).unwrap();
        assert!(seen <= flown + PERIOD_MS);
        let done = test.when(|e| *e == Event::PlanDone).unwrap();
        // It is sooner done where the way leads over cells of the plan.
        let sooner_ms = if at.x > 480.0 { 4_000 } else { end_ms };
        let range = end_ms - sooner_ms..end_ms + 4_000;
        assert!(range.contains(&done), "{at}: {done} of {range:?}");
        assert!(!test.open.contains(&true), "{at}");
        let cuts = test.when(|e| matches!(e, Event::CutShort { .. } | Event::Refused { .. }));
        assert_eq!(cuts, None);
        let near = test.wing.flown.iter();
        let near_m = near.map(|p| test.zones.distance_m(p.position()));
        assert!(near_m.fold(f64::INFINITY, f64::min) > CLEARANCE_M - 2.0);
    }
}

#[test]
fn a_detour_that_cannot_be_flown_is_told_and_the_legs_are_flown() {
    let mut test = Test::new(vec![square(500.0, 80.0, 60.0)]);
    test.goal(Goal::Legs(test.all()));
    test.fly_s(10);
    test.goal(Goal::Detour(
        straight_over(Point::new(530.0, 110.0)),
        test.all(),
    ));
    test.fly_s(5);
    assert!(test.when(|e| matches!(e, Event::CutShort { .. })).is_some());
    assert!(test.when(|e| *e == Event::DetourFlown).is_some());
    while test.when(|e| *e == Event::PlanDone).is_none() {
        assert!(test.wing.time_ms < 400_000);
        test.step();
    }
    assert!(!test.open.contains(&true));
}

#[test]
fn what_is_given_up_in_mid_detour_leaves_all_cells_to_be_flown() {
    let mut test = Test::new(Vec::new());
    test.goal(Goal::Legs(test.all()));
    test.fly_s(20);
    test.goal(Goal::Detour(
        straight_over(Point::new(560.0, 300.0)),
        test.all(),
    ));
    test.fly_s(10);
    test.goal(Goal::Legs(test.all()));
    while test.when(|e| *e == Event::PlanDone).is_none() {
        assert!(test.wing.time_ms < 400_000);
        test.step();
    }
    assert!(!test.open.contains(&true));
    assert_eq!(test.when(|e| *e == Event::DetourFlown), None);
}
