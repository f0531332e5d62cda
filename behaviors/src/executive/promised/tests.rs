//! One UAV that flies by promises, accepted late or never.

use super::*;
use crate::setpoint::Launch;
use crate::testing::{Wing, airframe, loop_and_router, rectangle};
use crate::{Goal, Percept};
use skein_flight::coverage::ring::Direction::Forward;
use skein_flight::coverage::ring::backtracking::Leg;
use skein_flight::separation::Motion;
use skein_geometry::Polygon;

const PERCEPT_MS: u64 = 200;
const LEAD_MS: u64 = 2_000;

/// One UAV whose promises are accepted after `answer_ms`, unless nobody answers.
struct Flight {
    executive: Executive,
    wing: Wing,
    open: Vec<bool>,
    answer_ms: u64,
    asked: Option<(u64, Extension)>,
    in_force: Option<Motion>,
    imposed: u32,
    done: bool,
    may_give_up: bool,
    /// Cells that were given up, and when.
    given_up: Vec<(u16, u64)>,
}

impl Flight {
    fn new(promises: bool) -> Self {
        Self::around(promises, (6, 4), Vec::new())
    }

    /// Over so many cells, around zones.
    fn around(promises: bool, (cols, rows): (u32, u32), zones: Vec<Polygon>) -> Self {
        let (coverage_loop, router) = loop_and_router(cols, rows, zones);
        let n = u16::try_from(coverage_loop.len()).unwrap();
        let start = coverage_loop.boundary_towards(0, Forward);
        let mut executive = Executive::new(airframe(), 90.0, coverage_loop, router);
        if promises {
            executive = executive.with_promises();
        }
        let mut flight = Self {
            executive,
            wing: Wing::new(start),
            open: vec![true; usize::from(n)],
            answer_ms: 400,
            asked: None,
            in_force: None,
            imposed: 0,
            done: false,
            may_give_up: false,
            given_up: Vec::new(),
        };
        flight.legs(0, n);
        flight
    }

    fn legs(&mut self, first: u16, count: u16) {
        let direction = Forward;
        let legs = vec![Leg {
            first,
            count,
            direction,
        }];
        let open = self.open.clone();
        let is_open = |c: u16| open[usize::from(c)];
        self.executive.set_goal(Goal::Legs(legs), &is_open);
        self.asked = None;
    }

    /// Flies for so long, or until all is seen.
    fn fly(&mut self, seconds: u64) {
        let end_ms = self.wing.time_ms + 1_000 * seconds;
        while self.wing.time_ms < end_ms && !self.done {
            self.percept();
            self.wing.fly(PERCEPT_MS);
            if let Some(motion) = &self.in_force {
                let at = motion.pose_at(self.wing.time_ms).position();
                let off_m = (self.wing.pose.position() - at).norm();
                assert!(off_m < 0.5, "{off_m} m off at {} ms", self.wing.time_ms);
            }
        }
    }

    fn percept(&mut self) {
        let (percept, open) = (self.wing.percept(), self.open.clone());
        let is_open = |c: u16| open[usize::from(c)];
        let (setpoint, events) = self.executive.step(&percept, &is_open);
        self.wing.setpoint = Some(setpoint);
        for event in events {
            match event {
                Event::Seen(cells) => cells
                    .iter()
                    .for_each(|c| self.open[usize::from(*c)] = false),
                Event::PlanDone
                | Event::CutShort { .. }
                | Event::Sighted { .. }
                | Event::DetourFlown => {}
                Event::Refused { cells } if !self.may_give_up => panic!("refused {cells:?}"),
                Event::Refused { cells } => {
                    let at_ms = percept.time_ms;
                    self.given_up.extend(cells.into_iter().map(|c| (c, at_ms)));
                }
            }
        }
        self.done = !self.open.contains(&true);
        for (cell, _) in &self.given_up {
            self.open[usize::from(*cell)] = false;
        }
        let now_ms = percept.time_ms;
        if self.executive.take_imposed() {
            self.imposed += 1;
            self.in_force = self
                .executive
                .in_force(now_ms)
                .and_then(|p| Motion::new(p).ok());
        }
        if let Some((at_ms, asked)) = self.asked.take() {
            if now_ms > asked.branch_ms {
                // Withdrawn.
            } else if now_ms < at_ms + self.answer_ms {
                self.asked = Some((at_ms, asked));
            } else {
                self.in_force = Motion::new(asked.plan.clone()).ok();
                self.executive.agree(asked);
            }
        } else if self.executive.wants_more(now_ms) {
            let best = self.executive.extensions(now_ms, LEAD_MS, &is_open);
            self.asked = best.into_iter().next().map(|e| (now_ms, e));
        }
    }
}

fn time_to_see_all_s(promises: bool) -> f64 {
    let mut flight = Flight::new(promises);
    flight.fly(1_500);
    assert!(
        flight.done,
        "{} open",
        flight.open.iter().filter(|o| **o).count()
    );
    #[allow(clippy::cast_precision_loss)]
    let took_s = flight.wing.time_ms as f64 / 1e3;
    took_s
}

#[test]
fn who_is_answered_in_time_takes_as_long_as_who_asks_nobody() {
    let free_s = time_to_see_all_s(false);
    let asks_s = time_to_see_all_s(true);
    // The first circle has begun before anybody could answer.
    assert!(asks_s < free_s + 15.0, "{asks_s} s instead of {free_s} s");
}

#[test]
fn who_is_not_answered_circles_where_it_promised_and_then_goes_on() {
    let mut flight = Flight::new(true);
    flight.fly(60);
    let seen = flight.open.iter().filter(|o| !**o).count();
    assert!(seen > 8, "{seen}");
    flight.answer_ms = u64::MAX / 2;
    flight.fly(40);
    let before = flight.wing.pose.position();
    let motion = flight.in_force.clone().unwrap();
    flight.fly(120);
    assert_eq!(
        flight.in_force.as_ref(),
        Some(&motion),
        "nothing was agreed"
    );
    assert!((flight.wing.pose.position() - before).norm() < 60.0);
    flight.answer_ms = 400;
    flight.asked = None;
    flight.fly(1_500);
    assert!(flight.done);
    assert_eq!(flight.imposed, 1, "only the first circle was imposed");
}

/// A wall from the edge into the area: the loop leads round it within one cell, farther than may
/// be promised at once.
fn at_a_wall(promises: bool) -> Flight {
    let wall = rectangle(148.0, -60.0, 34.0, 380.0);
    Flight::around(promises, (8, 8), vec![wall])
}

#[test]
fn a_cell_whose_way_is_longer_than_a_promise_is_flown_in_parts() {
    let mut flight = at_a_wall(true);
    let cells = flight.executive.transit.coverage_loop.len();
    let length_m = |c: usize| {
        let coverage_loop = &flight.executive.transit.coverage_loop;
        coverage_loop.curve(c, Forward).length_m()
    };
    let longest_m = (0..cells).map(length_m).fold(0.0, f64::max);
    let most_m = PROMISED_MOST_S * flight.executive.speed_mps();
    assert!(longest_m > most_m, "{longest_m} m, {most_m} m are promised");
    flight.fly(2_000);
    let open = flight.open.iter().filter(|o| **o).count();
    assert!(flight.done, "{open} of {cells} open");
    let mut free = at_a_wall(false);
    free.fly(2_000);
    assert!(free.done);
    let (asks_ms, free_ms) = (flight.wing.time_ms, free.wing.time_ms);
    assert!(
        asks_ms < free_ms + 30_000,
        "{asks_ms} ms instead of {free_ms} ms"
    );
}

/// From places of a circle beside a zone no way leads on.
#[test]
fn who_has_to_circle_anywhere_gives_no_cell_up() {
    let zones = vec![
        rectangle(100.0, 100.0, 20.0, 20.0),
        rectangle(200.0, 60.0, 20.0, 200.0),
        rectangle(320.0, 100.0, 60.0, 60.0),
    ];
    for silent_s in [19, 23, 27, 31] {
        let mut flight = Flight::around(true, (10, 8), zones.clone());
        while !flight.done && flight.wing.time_ms < 3_000_000 {
            flight.answer_ms = 400;
            flight.asked = None;
            flight.fly(24);
            flight.answer_ms = u64::MAX / 2;
            flight.fly(silent_s);
        }
        assert!(flight.done, "{silent_s} s without an answer");
    }
}

#[test]
fn what_no_place_of_a_circle_leads_to_is_given_up_after_one() {
    let mut flight = Flight::new(true);
    // The loop leads through a zone of which the mission knew nothing.
    let (coverage_loop, _) = loop_and_router(6, 4, Vec::new());
    let within = coverage_loop
        .curve(9, Forward)
        .pose_at(10.0)
        .unwrap()
        .position();
    let zone = rectangle(within.x - 5.0, within.y - 5.0, 10.0, 10.0);
    let (_, router) = loop_and_router(6, 4, vec![zone]);
    flight.executive = Executive::new(airframe(), 90.0, coverage_loop, router).with_promises();
    flight.may_give_up = true;
    flight.legs(9, 1);
    flight.fly(60);
    let circle_s = TAU * flight.executive.circle_radius_m() / flight.executive.speed_mps();
    let [(9, at_ms)] = flight.given_up[..] else {
        panic!("{:?}", flight.given_up);
    };
    assert!(
        (circle_s..circle_s + 12.0).contains(&(at_ms as f64 / 1e3)),
        "{at_ms} ms"
    );
}

#[test]
fn a_goal_that_is_told_again_lets_what_is_agreed_stand() {
    let mut flight = at_a_wall(true);
    let n = u16::try_from(flight.open.len()).unwrap();
    // Every two seconds, as claims change.
    for _ in 0..1_000 {
        flight.fly(2);
        let asked = flight.asked.take();
        flight.legs(0, n);
        flight.asked = asked.filter(|(_, e)| flight.executive.suits(e));
    }
    let open = flight.open.iter().filter(|o| **o).count();
    assert!(flight.done, "{open} of {n} open");
}

/// A percept of who stands where it will begin, ready to be launched.
fn on_launcher(flight: &Flight, time_ms: u64) -> Percept {
    Percept {
        time_ms,
        takes_off_in_ms: 1_000,
        launch_ready: true,
        ..flight.wing.percept()
    }
}

/// Stands from a time on until its first flight is agreed, and is told to the airframe:
/// when it takes off, milliseconds.
fn launched(flight: &mut Flight, from_ms: u64, answered: bool) -> u64 {
    let is_open = |_: u16| true;
    let step = |f: &mut Flight, ms| {
        let percept = on_launcher(f, ms);
        f.executive.step(&percept, &is_open).0
    };
    assert_eq!(step(flight, from_ms).launch, Launch::Wish);
    assert!(flight.executive.stands() && flight.executive.wants_more(from_ms));
    assert!(!flight.executive.circles(from_ms) && !flight.executive.take_imposed());
    let ways = flight.executive.extensions(from_ms, LEAD_MS, &is_open);
    let way = ways.into_iter().next().unwrap();
    let (at_ms, motion) = (way.plan.start_ms, Motion::new(way.plan.clone()).unwrap());
    assert!(at_ms > from_ms + LEAD_MS && way.branch_ms < at_ms);
    let begins_off_m = (motion.pose_at(at_ms).position() - flight.wing.pose.position()).norm();
    assert!(begins_off_m < 0.01, "{begins_off_m} m");
    if answered {
        flight.executive.agree(way);
        flight.in_force = Some(motion);
        let told = step(flight, from_ms + PERCEPT_MS);
        assert_eq!(told.launch, Launch::At(at_ms));
        assert!(!flight.executive.wants_more(from_ms + PERCEPT_MS));
    }
    at_ms
}

#[test]
fn who_is_launched_flies_what_was_agreed_from_the_ground_on() {
    let mut flight = Flight::new(true);
    let at_ms = launched(&mut flight, 1_000, true);
    flight.wing.time_ms = at_ms;
    flight.fly(1_500);
    assert!(flight.done);
    assert_eq!(flight.imposed, 0, "nothing is imposed on others");
}

#[test]
fn who_missed_its_launch_asks_anew() {
    let mut flight = Flight::new(true);
    let at_ms = launched(&mut flight, 1_000, true);
    let at_ms = launched(&mut flight, at_ms, false);
    // Another goal: what was looked for is not wanted any more, and it still stands.
    flight.legs(0, 3);
    let at_ms = launched(&mut flight, at_ms, true);
    flight.wing.time_ms = at_ms;
    flight.fly(100);
    assert!(flight.open[..3].iter().all(|open| !open) && flight.imposed == 0);
}

#[test]
fn who_has_nothing_to_fly_for_or_is_held_up_lets_others_go_before() {
    let mut flight = Flight::new(true);
    let is_open = |_: u16| true;
    let percept = on_launcher(&flight, 1_000);
    assert_eq!(
        flight.executive.step(&percept, &is_open).0.launch,
        Launch::Wish
    );
    flight.executive.is_held_up(true);
    assert_eq!(
        flight.executive.step(&percept, &is_open).0.launch,
        Launch::Stay
    );
    // In the line it forgets that, and looks again when it is ready.
    let waits = Percept {
        launch_ready: false,
        ..percept
    };
    let _ = flight.executive.step(&waits, &is_open);
    assert!(!flight.executive.stands());
    assert_eq!(
        flight.executive.step(&percept, &is_open).0.launch,
        Launch::Wish
    );
    flight.executive.set_goal(Goal::Legs(Vec::new()), &is_open);
    assert_eq!(
        flight.executive.step(&percept, &is_open).0.launch,
        Launch::Stay
    );
}

/// What nobody has given it yet it need not wait for on its launcher.
#[test]
fn who_is_to_be_given_cells_takes_off_before_and_turns_to_them_in_the_air() {
    let mut flight = Flight::new(true);
    let (n, is_open) = (flight.open.len(), |_: u16| true);
    let percept = on_launcher(&flight, 1_000);
    let said = |f: &mut Flight| f.executive.step(&percept, &is_open).0.launch;
    flight.executive.set_goal(Goal::Hold, &is_open);
    assert_eq!(said(&mut flight), Launch::Stay);
    assert!(!flight.executive.wants_more(1_000));
    flight.executive.expect_cells(true);
    assert_eq!(said(&mut flight), Launch::Wish);
    let ways = flight.executive.extensions(1_000, LEAD_MS, &is_open);
    // Straight on first, and to both sides.
    let side = |e: &Extension| {
        let motion = Motion::new(e.plan.clone()).unwrap();
        let flown_ms = (motion.ends_at_s() * 1e3) as u64;
        let way = motion.pose_at(flown_ms).position() - percept.pose.position();
        percept.pose.direction().perp(&way) / way.norm()
    };
    assert!(side(&ways[0]).abs() < 0.01, "{}", side(&ways[0]));
    assert!(ways.iter().any(|e| side(e) > 0.5) && ways.iter().any(|e| side(e) < -0.5));
    let at_ms = launched(&mut flight, 1_000, true);
    flight.wing.time_ms = at_ms;
    flight.fly(3);
    assert_eq!(flight.imposed, 0);
    // It comes to where it waits, with nothing to ask for; then it turns off at once.
    assert!(!flight.executive.wants_more(flight.wing.time_ms));
    flight.legs(0, u16::try_from(n).unwrap());
    assert!(flight.executive.wants_more(flight.wing.time_ms));
    flight.fly(1_500);
    assert!(flight.done && flight.imposed == 0);
}

#[test]
fn another_goal_is_taken_up_when_that_is_agreed() {
    let mut flight = Flight::new(true);
    flight.fly(40);
    let n = u16::try_from(flight.open.len()).unwrap();
    flight.legs(n / 2, n / 2);
    flight.fly(60);
    let seen = (n / 2..n).filter(|c| !flight.open[usize::from(*c)]).count();
    assert!(seen > 3, "{seen}");
    flight.legs(0, n);
    flight.fly(1_500);
    assert!(flight.done && flight.imposed == 1);
}

#[test]
fn ways_aside_lead_away_and_end_in_a_circle() {
    let mut flight = Flight::new(true);
    flight.answer_ms = u64::MAX / 2;
    flight.fly(40);
    let now_ms = flight.wing.time_ms;
    assert!(flight.executive.circles(now_ms));
    let ways = flight.executive.ways_aside(now_ms, LEAD_MS);
    assert!(ways.len() > 8, "{}", ways.len());
    for way in ways {
        assert!(matches!(way.plan.end, End::Loiter { .. }));
        assert!(Motion::new(way.plan).is_ok());
    }
}

/// Who flies what it promised, and a long while without a percept: its airframe flies on.
fn stood_still() -> Flight {
    let mut flight = Flight::new(true);
    flight.fly(60);
    assert_eq!(flight.imposed, 1);
    flight.asked = None;
    let at_ms = flight.wing.time_ms + 47_000;
    let motion = flight.in_force.clone().unwrap();
    assert!(motion.ends_at_s() * 1e3 < 107_000.0 && flight.wing.time_ms == 60_000);
    flight.wing.time_ms = at_ms;
    flight.wing.pose = motion.pose_at(at_ms);
    flight
}

#[test]
fn who_stood_still_goes_on_with_what_it_promised() {
    let mut flight = stood_still();
    let before = flight.in_force.clone();
    flight.answer_ms = u64::MAX / 2;
    flight.fly(30);
    assert_eq!((flight.imposed, &flight.in_force), (1, &before));
    flight.answer_ms = 400;
    flight.asked = None;
    flight.fly(1_500);
    assert!(flight.done && flight.imposed == 1);
}

#[test]
fn who_stood_still_knows_where_it_is_before_it_senses_that() {
    let flight = stood_still();
    let at_ms = flight.wing.time_ms;
    let last_ms = 60_000;
    assert!(flight.executive.flown_on(last_ms + 1_000).is_none());
    let on = flight.executive.flown_on(at_ms).unwrap();
    let here = on.here().unwrap().pose;
    let off_m = (here.position() - flight.wing.pose.position()).norm();
    assert!(off_m < 0.1, "{off_m} m");
    let forecast = on.forecast(0, &|_| true);
    let there = forecast.off_loop.unwrap().pose().position();
    assert!((there - here.position()).norm() < 0.1);
}

#[test]
fn who_stood_still_and_is_elsewhere_imposes_a_circle() {
    let mut flight = stood_still();
    flight.wing.pose.east_m += 20.0;
    flight.fly(30);
    assert_eq!(flight.imposed, 2);
}

#[test]
fn another_mission_lets_what_was_promised_stand() {
    let mut flight = Flight::new(true);
    flight.fly(60);
    flight.asked = None;
    let before = flight.in_force.clone();
    // Other cells, and a zone where it is not.
    let zone = rectangle(400.0, 300.0, 40.0, 40.0);
    let (coverage_loop, router) = loop_and_router(12, 10, vec![zone]);
    let n = u16::try_from(coverage_loop.len()).unwrap();
    let mut other = Executive::new(airframe(), 90.0, coverage_loop, router).with_promises();
    assert!(other.take_over(&flight.executive));
    assert!(!other.clone().take_imposed());
    flight.executive = other;
    flight.open = vec![true; usize::from(n)];
    // Nobody answers: it is flown to its end, and then the circle.
    flight.answer_ms = u64::MAX / 2;
    flight.legs(0, n);
    flight.fly(40);
    assert_eq!((flight.imposed, &flight.in_force), (1, &before));
    flight.answer_ms = 400;
    flight.asked = None;
    flight.fly(100);
    assert!(flight.imposed == 1 && flight.open.iter().any(|open| !open));
}

#[test]
fn a_computer_that_begins_anew_flies_on_the_circle_of_its_airframe() {
    let mut flight = Flight::new(true);
    let circle_m = 31.0;
    let percept = Percept {
        failsafe: true,
        circles_per_m: Some(-1.0 / circle_m),
        ..flight.wing.percept()
    };
    // On the way there it does nothing.
    let under_way = Percept {
        circles_in_ms: 1,
        ..percept
    };
    assert!(flight.executive.leaves_alone(&under_way));
    assert!(!flight.executive.leaves_alone(&percept));
    let _ = flight.executive.step(&percept, &|_| true);
    assert!(flight.executive.take_imposed());
    let End::Loiter { radius_mm, .. } = flight.executive.in_force(percept.time_ms).unwrap().end
    else {
        panic!("no circle");
    };
    assert_eq!(radius_mm, -31_000);
    // Of what it flies itself it knows the way.
    assert!(!flight.executive.leaves_alone(&under_way));
}
