//! Turns that follow a moving target, from percept to percept (D2.7 §1.2.3, executive layer;
//! §3.7): the laws of [`skein_flight::tracking`] in an executive.
//!
//! | event | what follows |
//! |---|---|
//! | the goal is to follow | it holds until it is told of a target |
//! | told of a target | it flies by that, dead reckoned to each percept |
//! | told of a target where buildings are known | once a second it chooses the circle from which they hide it least, and flies that |
//! | told of none, or of another goal | it holds, or that goal begins from where it is |
//!
//! # Guarantees
//! What is flown keeps clear of the zones as far as a bent way does, and every setpoint passes
//! the envelope. No track is kept meanwhile, so the way home is reckoned from where the UAV is.
//!
//! # Complexity
//! A percept costs some hundred steps of the law, with zones some more for each turn tried; once a
//! second, where buildings are known, what [`skein_flight::tracking::vantage`] costs.

use super::transit::Transit;
use super::{Aim, Executive};
use crate::percept::Percept;
use crate::reactive::follow::HORIZON_S;
use crate::setpoint::{MAX_STEPS, Setpoint, Steer};
use crate::view::View;
use skein_flight::tracking::aside::aside;
use skein_flight::tracking::bend::Guard;
use skein_flight::tracking::buildings::Town;
use skein_flight::tracking::field::Field;
use skein_flight::tracking::follower::{Command, Follower, Settings, StandOff, TargetMotion};
use skein_flight::tracking::mode::Airspeeds;
use skein_flight::tracking::vantage::{self, Circle, Vantage};
use skein_flight::trajectory::wind::Wind;
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::seconds;

/// Commands of the law that make each step of a setpoint: the first until the next percept,
/// later ones longer. All together they last as long as a setpoint looks ahead.
const GROUPS: [usize; MAX_STEPS] = [4, 4, 6, 6, 6, 8, 8, 8];

/// D2.7's α: outside of its circle the field then bends nowhere harder than the circle.
const GAIN: f64 = 1.0;

/// What is kept clear of is this much less than what is kept, metres: rounding.
const NEARER_M: f64 = 0.2;

/// A command of the law lasts so long, milliseconds.
const COMMAND_MS: u32 = 50;

/// Farthest that a circle is moved aside from its target, as a share of what the camera sees
/// to either side: with the usual stand-off, of half of that, the target stays in its picture.
const ASIDE: f64 = 0.4;

/// Circles are chosen for what is in this inner part of the picture, each way: places are known to
/// some metres.
const INNER: f64 = 0.9;

/// Longest time for which the law's own state goes on between two percepts, seconds.
const LATE_S: f64 = 2.0;

/// A target as it was at some time of the UAV's percepts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quarry {
    /// When, milliseconds.
    pub at_ms: u64,
    /// Where it was, and how it moved.
    pub motion: TargetMotion,
}

/// One that follows.
#[derive(Clone, Debug)]
pub(super) struct Pursuit {
    follower: Follower,
    quarry: Option<Quarry>,
    /// When it was flown last, milliseconds.
    flown_ms: Option<u64>,
    vantage: Vantage,
}

impl Pursuit {
    /// The circle from which buildings hide the target least; none where none are known.
    fn choose(
        &mut self,
        (percept, transit): (&Percept, &Transit),
        town: Option<&Town>,
        (target, wind): (&TargetMotion, Wind),
    ) -> Option<Circle> {
        let town = town.filter(|t| !t.buildings.is_empty())?;
        let (airframe, height_m) = (&transit.airframe, percept.height_m);
        let sees = |from: Pose, at: Point| {
            let is_in_picture = View::level(from, airframe).shows(at, INNER);
            is_in_picture && !town.buildings.hide(from.position(), height_m, at)
        };
        let view = vantage::View {
            sees: &sees,
            aside: &|middle, radius_m| beside_zones(transit, middle, radius_m),
            reach_m: INNER * airframe.footprint_across_m,
            streets: town.streets.as_ref(),
        };
        let by = (percept.pose, wind);
        let now_ms = percept.time_ms;
        self.vantage
            .choose(&self.follower, by, target, &view, now_ms)
    }
}

/// How far a circle about a place lies aside of it, where zones take a part of it.
fn beside_zones(transit: &Transit, middle: Point, radius_m: f64) -> Vector {
    let wanted_m = guarded_m(transit, f64::INFINITY) + radius_m;
    let most_m = ASIDE * transit.airframe.footprint_across_m;
    aside(middle, transit.router.zones(), wanted_m, most_m)
}

impl Executive {
    /// Begins to follow at a stand-off, metres; who follows at that goes on.
    pub(super) fn begin_pursuit(&mut self, stand_off_m: f64) {
        let airframe = self.transit.airframe;
        let settings = Settings {
            airframe,
            airspeeds: Airspeeds::of(&airframe),
            field: Field::Hopf { gain: GAIN },
            stand_off: StandOff::Distance(stand_off_m),
        };
        let goes_on = self
            .pursuit
            .as_ref()
            .is_some_and(|p| *p.follower.settings() == settings);
        if !goes_on {
            let quarry = self.pursuit.as_ref().and_then(|p| p.quarry);
            self.pursuit = Some(Pursuit {
                follower: Follower::new(settings),
                quarry,
                flown_ms: None,
                vantage: Vantage::default(),
            });
        }
    }

    pub(super) fn end_pursuit(&mut self) {
        self.pursuit = None;
    }

    /// Where whom it follows is, as far as is known; none while nothing is.
    pub fn pursue_at(&mut self, quarry: Option<Quarry>) {
        if let Some(pursuit) = &mut self.pursuit {
            pursuit.quarry = quarry;
        }
    }

    /// Whether it flies after a target.
    #[must_use]
    pub fn is_pursuing(&self) -> bool {
        self.aim == Aim::Follow && self.pursuit.as_ref().is_some_and(|p| p.quarry.is_some())
    }

    /// The setpoint that follows the target; none where there is none to follow.
    pub(super) fn pursue(&mut self, percept: &Percept) -> Option<Setpoint> {
        if self.aim != Aim::Follow {
            return None;
        }
        let pursuit = self.pursuit.as_mut()?;
        let quarry = pursuit.quarry?;
        let wind = Wind::new(percept.wind_east_mps, percept.wind_north_mps);
        let since_s = |ms: u64| seconds(percept.time_ms.saturating_sub(ms)).min(LATE_S);
        let mut target = quarry.motion.after(since_s(quarry.at_ms));
        let zones = self.transit.router.zones();
        let scene = (percept, &self.transit);
        let circle = pursuit.choose(scene, self.town.as_deref(), (&target, wind));
        pursuit.follower.circle(circle.map(|c| c.radius_m));
        target.position += circle.map_or_else(Vector::zeros, |c| c.beside);
        // Where zones take a part of its circle, the circle lies aside from them.
        if let StandOff::Distance(stand_off_m) = pursuit.follower.settings().stand_off {
            let radius_m = circle.map_or(stand_off_m, |c| c.radius_m);
            target.position += beside_zones(&self.transit, target.position, radius_m);
        }
        // The state of the law goes on by the time that has passed, and what is to come is
        // flown by a copy: percepts may be late.
        if let Some(flown_ms) = pursuit.flown_ms.replace(percept.time_ms) {
            let passed_s = since_s(flown_ms);
            let follower = &mut pursuit.follower;
            follower.commands(percept.pose, wind, &target, passed_s, None);
        }
        let guard = Guard {
            zones,
            clearance_m: guarded_m(&self.transit, zones.distance_m(percept.pose.position())),
        };
        let mut ahead = pursuit.follower.clone();
        let commands = ahead.commands(percept.pose, wind, &target, HORIZON_S, Some(&guard));
        let airspeed_mps = commands.first().map(|c| c.airspeed_mps);
        let setpoint = Setpoint {
            airspeed_mps: airspeed_mps.unwrap_or_else(|| self.speed_mps()),
            ..self.setpoint(percept, steps(&commands))
        };
        // Nothing of a track is left: whatever comes next begins where the UAV is.
        self.leave_track();
        let setpoint = self.envelope.check(percept, setpoint);
        self.plays(percept, &setpoint);
        Some(setpoint)
    }
}

/// What a UAV that far from the zones keeps clear of them, metres. The law turns tighter than
/// routes do, and whatever comes next begins with a route: room is left for its wider turn, and
/// for what a UAV may stray. Who is nearer than that already comes no nearer.
fn guarded_m(transit: &Transit, away_m: f64) -> f64 {
    let limits = transit.router.limits();
    let airframe = &transit.airframe;
    let least_m = airframe.turn_radius_m(airframe.least_airspeed_mps());
    let wider_m = 2.0 * (limits.turn_radius_m - least_m).max(0.0);
    let wanted_m = limits.clearance_m + transit.tracking_error_m + wider_m;
    wanted_m.min(away_m - NEARER_M).max(0.0)
}

/// Commands of the law as a few turns, each the mean of those that it stands for.
fn steps(commands: &[Command]) -> Vec<Steer> {
    let mut rest = commands;
    let mut steps = Vec::with_capacity(MAX_STEPS);
    for n in GROUPS {
        let (group, left) = rest.split_at(n.min(rest.len()));
        rest = left;
        let Ok(count) = u32::try_from(group.len()) else {
            break;
        };
        if count == 0 {
            break;
        }
        let sum: f64 = group.iter().map(|c| c.turn_rate_radps).sum();
        steps.push(Steer {
            turn_rate_radps: sum / f64::from(count),
            duration_ms: count * COMMAND_MS,
        });
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Goal;
    use crate::testing::{CLEARANCE_M, Wing, airframe, loop_and_router, square};
    use skein_flight::tracking::buildings::{Building, Buildings};
    use skein_geometry::Polygon;
    use std::sync::Arc;

    /// A target that drives along at a speed, m/s; how far from it the UAV was after it had
    /// come to it, least and most, and how near a zone.
    fn follows(stand_off_m: f64, speed_mps: f64, zoned: bool) -> (f64, f64, f64) {
        let zones = if zoned {
            vec![square(240.0, 140.0, 60.0)]
        } else {
            Vec::new()
        };
        let (coverage_loop, router) = loop_and_router(12, 10, zones);
        let zones = Arc::clone(router.zones());
        let mut executive = Executive::new(airframe(), 90.0, coverage_loop, router);
        executive.set_goal(Goal::Follow(stand_off_m), &|_| false);
        assert!(!executive.is_pursuing());
        let mut wing = Wing::new(Pose::new(Point::new(0.0, 0.0), 0.3));
        let (mut least_m, mut most_m, mut zone_m) = (f64::MAX, 0.0_f64, f64::MAX);
        for k in 0..600_u32 {
            let at = Point::new(60.0 + speed_mps * 0.2 * f64::from(k), 120.0);
            let percept = wing.percept();
            executive.pursue_at(Some(Quarry {
                at_ms: percept.time_ms,
                motion: TargetMotion {
                    position: at,
                    velocity_mps: Vector::new(speed_mps, 0.0),
                    acceleration_mps2: Vector::zeros(),
                },
            }));
            let (setpoint, _) = executive.step(&percept, &|_| false);
            wing.setpoint = Some(setpoint);
            wing.fly(200);
            zone_m = zone_m.min(zones.distance_m(wing.pose.position()));
            if k > 200 {
                let away_m = (wing.pose.position() - at).norm();
                (least_m, most_m) = (least_m.min(away_m), most_m.max(away_m));
            }
        }
        assert!(executive.is_pursuing());
        (least_m, most_m, zone_m)
    }

    #[test]
    fn a_standing_and_a_driving_target_are_kept_at_the_stand_off() {
        let (least_m, most_m, _) = follows(60.0, 0.0, false);
        assert!(least_m > 55.0 && most_m < 65.0, "{least_m} {most_m}");
        let (least_m, most_m, _) = follows(60.0, 3.0, false);
        assert!(least_m > 45.0 && most_m < 80.0, "{least_m} {most_m}");
    }

    #[test]
    fn a_zone_beside_the_target_is_kept_clear_of() {
        let (_, most_m, zone_m) = follows(60.0, 2.0, true);
        assert!(zone_m > CLEARANCE_M - 2.0, "{zone_m} m from a zone");
        assert!(most_m < 200.0, "{most_m}");
    }

    /// Rows of houses along both sides of a street, so far beside its middle.
    fn street(roof_m: f64) -> Town {
        let row = |south_m: f64| {
            let corner = |x: f64, y: f64| Point::new(x, south_m + y);
            let ring = vec![
                corner(-300.0, 0.0),
                corner(900.0, 0.0),
                corner(900.0, 20.0),
                corner(-300.0, 20.0),
            ];
            Building {
                footprint: Polygon::new(ring).unwrap(),
                roof_m,
            }
        };
        Town {
            buildings: Buildings::of([row(110.0 + HALF_M), row(90.0 - HALF_M)]),
            streets: None,
        }
    }

    /// The share of time for which a target that drives along the street is in the picture past
    /// its houses, and the least radius of its circle, by who knows these or does not.
    fn sees(roof_m: f64, knows: bool) -> (f64, f64) {
        let town = street(roof_m);
        let (coverage_loop, router) = loop_and_router(12, 10, vec![]);
        let mut executive = Executive::new(airframe(), HEIGHT_M, coverage_loop, router)
            .with_town(knows.then(|| Arc::new(town.clone())));
        executive.set_goal(Goal::Follow(STAND_OFF_M), &|_| false);
        let mut wing = Wing::new(Pose::new(Point::new(0.0, 60.0), 0.3));
        let (mut seen, mut least_m) = (0_u32, f64::MAX);
        for k in 0..900_u32 {
            let at = Point::new(3.0 * 0.2 * f64::from(k), 110.0);
            let percept = Percept {
                height_m: HEIGHT_M,
                ..wing.percept()
            };
            executive.pursue_at(Some(Quarry {
                at_ms: percept.time_ms,
                motion: TargetMotion {
                    position: at,
                    velocity_mps: Vector::new(3.0, 0.0),
                    acceleration_mps2: Vector::zeros(),
                },
            }));
            let (setpoint, _) = executive.step(&percept, &|_| false);
            wing.setpoint = Some(setpoint);
            wing.fly(200);
            let from = wing.pose.position();
            let is_in_picture = View::level(wing.pose, &airframe()).shows(at, 1.0);
            if k >= 150 {
                let is_seen = is_in_picture && !town.buildings.hide(from, HEIGHT_M, at);
                seen += u32::from(is_seen);
                least_m = least_m.min((from - at).norm());
            }
        }
        (f64::from(seen) / 750.0, least_m)
    }

    /// How high it flies, how far it is to stay away, and how wide half of the street is, metres.
    const HEIGHT_M: f64 = 60.0;
    const STAND_OFF_M: f64 = 36.0;
    const HALF_M: f64 = 8.0;

    #[test]
    fn who_knows_the_houses_beside_a_street_sees_more_and_stays_farther_away_where_they_are_low() {
        let (blind, blind_m) = sees(30.0, false);
        let (known, known_m) = sees(30.0, true);
        assert!(known > blind + 0.1, "{blind} {known}");
        assert!(known_m < blind_m - 5.0, "{blind_m} {known_m}");
        let (low, low_m) = sees(6.0, true);
        assert!(
            low > 0.9 && low_m > known_m + 1.0,
            "{low} {low_m} {known_m}"
        );
    }

    #[test]
    fn told_of_no_target_it_holds_and_another_goal_ends_it() {
        let (coverage_loop, router) = loop_and_router(12, 10, vec![]);
        let mut executive = Executive::new(airframe(), 90.0, coverage_loop, router);
        executive.set_goal(Goal::Follow(60.0), &|_| false);
        let mut wing = Wing::new(Pose::new(Point::new(200.0, 200.0), 0.0));
        for _ in 0..200 {
            let (setpoint, _) = executive.step(&wing.percept(), &|_| false);
            wing.setpoint = Some(setpoint);
            wing.fly(200);
        }
        assert!((wing.pose.position() - Point::new(200.0, 200.0)).norm() < 150.0);
        executive.set_goal(Goal::Point(Point::new(0.0, 0.0)), &|_| false);
        executive.pursue_at(None);
        assert!(!executive.is_pursuing());
    }
}
