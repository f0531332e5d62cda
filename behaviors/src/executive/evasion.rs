//! Making way for aircraft that are no members (D2.7 §1.2.3, executive layer).
//!
//! | event | what follows |
//! |---|---|
//! | what is flown next leads too near to an aircraft that flies straight on | an evasion, from percept to percept |
//! | the way to where it was to be is clear again | a new track to the cell that it was in, or whatever else was to be flown |
//! | UAVs keep apart by agreement, and one comes near what was promised | that is flown, higher, until it is past |
//!
//! How to evade is told by [`well_clear`](crate::reactive::well_clear), and how high to pass by
//! [`pass_over`]. Cells that it left are flown
//! anew, as after any silence; what the camera sees meanwhile counts.

use super::{Executive, Kind};
use crate::percept::Percept;
use crate::reactive::follow::Track;
use crate::reactive::pass_over::{self, Level};
use crate::reactive::well_clear::Flight;
use crate::setpoint::Setpoint;
use crate::traffic::Aircraft;
use skein_geometry::Segment;
use skein_geometry::frame::{Point, Pose, Vector};

impl Executive {
    /// Whether it makes way for an aircraft that is no member.
    #[must_use]
    pub fn evades(&self) -> bool {
        self.well_clear.evades()
    }

    /// The setpoint of an evasion, where one has to be flown.
    pub(super) fn evade(&mut self, percept: &Percept) -> Option<Setpoint> {
        let aircraft: Vec<Aircraft> = percept.traffic.aircraft().copied().collect();
        let evaded = self.well_clear.evades();
        if aircraft.is_empty() && !evaded {
            return None;
        }
        let airspeed_mps = self.speed_mps();
        let wind_mps = Vector::new(percept.wind_east_mps, percept.wind_north_mps);
        let own = Flight {
            pose: percept.pose,
            height_m: percept.height_m,
            airspeed_mps,
            limit_radps: self.transit.airframe.max_turn_rate_radps(airspeed_mps),
            wind_mps,
        };
        let router = &self.transit.router;
        let (zones, least_m) = (router.zones(), router.limits().clearance_m);
        let track = Some(&self.track).filter(|_| !self.replan && !self.stretches.is_empty());
        let ground_mps = (percept.pose.direction() * airspeed_mps + wind_mps).norm();
        // Beyond what is planned so far it circles on, or flies straight on; where nothing is
        // planned it turns on as it was told last.
        let circles_per_m = match self.stretches.back().map(|s| s.kind) {
            Some(Kind::Loiter(circle)) => circle.curvature_per_m,
            _ => 0.0,
        };
        let turns_radps = self.played.as_ref().and_then(|p| p.steps.last());
        let turns_per_m = turns_radps.map_or(0.0, |s| s.turn_rate_radps) / airspeed_mps;
        let wanted = |after_s: f64| -> Point {
            let along_m = ground_mps * after_s;
            match track {
                Some(track) => along(track, circles_per_m, along_m),
                None => on_circle(percept.pose, turns_per_m, along_m),
            }
        };
        let is_free = |at: Point| zones.zones().is_empty() || zones.distance_m(at) >= least_m;
        let steers = self.well_clear.steer(&own, &aircraft, wanted, is_free);
        // What was planned is left: expectations are those of a plan from here.
        if evaded || steers.is_some() {
            self.leave_track();
        }
        let setpoint = self.setpoint(percept, steers?);
        let setpoint = self.envelope.check(percept, setpoint);
        self.plays(percept, &setpoint);
        Some(setpoint)
    }

    /// The height at which what was promised is flown now, metres.
    pub(super) fn passes_at_m(&mut self, percept: &Percept, bend_per_m: f64) -> f64 {
        let aircraft: Vec<Aircraft> = percept.traffic.aircraft().copied().collect();
        let own = Level {
            height_m: percept.height_m,
            level_m: self.height_m,
            climb_mps: self.transit.airframe.climb_mps,
        };
        self.passes_over = false;
        if aircraft.is_empty() || !percept.height_m.is_finite() {
            return own.level_m;
        }
        let speed_mps = self.speed_mps();
        // What is promised ends soon, in a circle, or is gone on with.
        let circles = |after_s: f64| along(&self.track, bend_per_m, speed_mps * after_s);
        let flies_on = |after_s: f64| {
            let (end_m, along_m) = (self.flight_end_m(), speed_mps * after_s);
            let beyond_m = (self.track.at_m() + along_m - end_m).max(0.0);
            let at = along(&self.track, bend_per_m, along_m - beyond_m);
            let end = self.track.pose_at(end_m).filter(|_| beyond_m > 0.0);
            end.map_or(at, |end| on_circle(end, 0.0, beyond_m))
        };
        let promised_s = (self.flight_end_m() - self.track.at_m()).max(0.0) / speed_mps;
        let ways: [&dyn Fn(f64) -> Point; 2] = [&circles, &flies_on];
        let height_m = pass_over::height_m(&own, &aircraft, &ways, promised_s);
        self.passes_over = height_m > own.level_m;
        height_m
    }

    /// Whether it flies higher than its mission, over an aircraft that is no member.
    #[must_use]
    pub fn passes_over(&self) -> bool {
        self.passes_over
    }
}

/// Where a track leads in so many metres, and beyond its end a turn.
fn along(track: &Track, bend_per_m: f64, along_m: f64) -> Point {
    let until_m = (track.at_m() + along_m).min(track.end_m());
    let left_m = track.at_m() + along_m - until_m;
    let end = track.pose_at(until_m);
    end.map_or_else(Point::origin, |end| on_circle(end, bend_per_m, left_m))
}

fn on_circle(start: Pose, curvature_per_m: f64, length_m: f64) -> Point {
    let turn = Segment {
        start,
        curvature_per_m,
        length_m,
    };
    turn.end().position()
}

#[cfg(test)]
mod tests {
    use crate::executive::pursuit::Quarry;
    use crate::executive::{Executive, Goal};
    use crate::testing::{Wing, aircraft, airframe, loop_and_router, square};
    use crate::traffic::Traffic;
    use crate::{Event, Percept};
    use skein_flight::coverage::ring::Direction;
    use skein_flight::coverage::ring::backtracking::Leg;
    use skein_flight::tracking::follower::TargetMotion;
    use skein_geometry::frame::{Point, Pose, Vector};
    use skein_geometry::math::{TAU, sin_cos};
    use skein_geometry::random::SplitMix64;
    use std::collections::BTreeSet;

    /// Flies over an area while aircraft come straight at the UAV, one a minute, from any side;
    /// how near they came, how long it evaded, and how many cells were not seen.
    fn flies(seed: u64, (height_m, zoned, senses): (f64, bool, bool)) -> (f64, u32, usize) {
        let zones = if zoned {
            vec![square(240.0, 140.0, 60.0)]
        } else {
            Vec::new()
        };
        let (coverage_loop, router) = loop_and_router(12, 10, zones);
        let n = coverage_loop.len();
        let mut executive = Executive::new(airframe(), 90.0, coverage_loop, router);
        let legs = vec![Leg {
            first: 0,
            count: u16::try_from(n).unwrap(),
            direction: Direction::Forward,
        }];
        let mut open: BTreeSet<u16> = (0..u16::try_from(n).unwrap()).collect();
        executive.set_goal(Goal::Legs(legs), &|cell| open.contains(&cell));
        let mut wing = Wing::new(Pose::new(Point::new(-30.0, -30.0), 0.3));
        let mut random = SplitMix64::new(seed);
        let (mut at, mut v) = (Point::new(1e5, 1e5), Vector::zeros());
        let (mut nearest_m, mut evaded) = (f64::INFINITY, 0);
        for k in 0..12_000_u32 {
            if k % 300 == 0 {
                let (s, c) = sin_cos(TAU * random.unit());
                v = Vector::new(c, s) * (15.0 + 25.0 * random.unit());
                let meets_s = 25.0 + 10.0 * random.unit();
                let there = wing.pose.position() + wing.pose.direction() * (13.0 * meets_s);
                let there = if k % 600 == 0 {
                    there
                } else {
                    wing.pose.position()
                };
                at = there - v * meets_s;
            }
            let sensed = senses.then(|| aircraft(at, v, height_m));
            let percept = Percept {
                traffic: Traffic::new(1_500.0, []).with_aircraft(sensed),
                ..wing.percept()
            };
            let (setpoint, events) = executive.step(&percept, &|cell| open.contains(&cell));
            for event in events {
                if let Event::Seen(cells) | Event::Refused { cells } = event {
                    open.retain(|cell| !cells.contains(cell));
                }
            }
            evaded += u32::from(executive.evades());
            wing.setpoint = Some(setpoint);
            wing.fly(200);
            at += v * 0.2;
            nearest_m = nearest_m.min((wing.pose.position() - at).norm());
            if open.is_empty() {
                break;
            }
        }
        (nearest_m, evaded, open.len())
    }

    #[test]
    fn way_is_made_for_aircraft_from_any_side_and_all_is_seen() {
        let mut evaded = 0;
        for seed in 0..12 {
            let (nearest_m, steps, left) = flies(seed, (95.0, seed % 2 == 1, true));
            assert!(
                nearest_m > 50.0 && left == 0,
                "{seed}: {nearest_m} m, {left} left"
            );
            evaded += steps;
        }
        assert!(evaded > 500, "{evaded}");
    }

    #[test]
    fn nobody_makes_way_for_what_passes_above_or_is_not_sensed() {
        for (height_m, senses) in [(115.0, true), (95.0, false)] {
            let flights = (0..6).map(|seed| flies(seed, (height_m, false, senses)));
            let mut nearest_m = f64::INFINITY;
            for (near_m, evaded, left) in flights {
                assert_eq!((evaded, left), (0, 0));
                nearest_m = nearest_m.min(near_m);
            }
            assert!(nearest_m < 50.0, "{nearest_m}");
        }
    }

    #[test]
    fn who_follows_a_target_makes_way_and_follows_on() {
        let (coverage_loop, router) = loop_and_router(12, 10, Vec::new());
        let mut executive = Executive::new(airframe(), 90.0, coverage_loop, router);
        executive.set_goal(Goal::Follow(60.0), &|_| false);
        let target = Point::new(300.0, 250.0);
        let mut wing = Wing::new(Pose::new(Point::new(240.0, 250.0), 1.6));
        let mut random = SplitMix64::new(5);
        let (mut at, mut v) = (Point::new(1e5, 1e5), Vector::zeros());
        let (mut nearest_m, mut evaded) = (f64::INFINITY, 0);
        for k in 0..6_000_u32 {
            if k % 300 == 0 {
                let (s, c) = sin_cos(TAU * random.unit());
                v = Vector::new(c, s) * (15.0 + 25.0 * random.unit());
                at = wing.pose.position() - v * (25.0 + 10.0 * random.unit());
            }
            let percept = Percept {
                traffic: Traffic::new(1_500.0, []).with_aircraft([aircraft(at, v, 95.0)]),
                ..wing.percept()
            };
            executive.pursue_at(Some(Quarry {
                at_ms: percept.time_ms,
                motion: TargetMotion {
                    position: target,
                    velocity_mps: Vector::zeros(),
                    acceleration_mps2: Vector::zeros(),
                },
            }));
            let (setpoint, _) = executive.step(&percept, &|_| false);
            evaded += u32::from(executive.evades());
            wing.setpoint = Some(setpoint);
            wing.fly(200);
            at += v * 0.2;
            nearest_m = nearest_m.min((wing.pose.position() - at).norm());
            if k % 300 == 299 {
                let off_m = (wing.pose.position() - target).norm() - 60.0;
                assert!(off_m.abs() < 15.0, "{off_m} m off its circle at step {k}");
            }
        }
        assert!(nearest_m > 50.0, "{nearest_m}");
        assert!(evaded > 100, "{evaded}");
    }
}
