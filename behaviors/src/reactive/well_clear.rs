//! Keeping well clear of aircraft that are no members (D2.7 §1.2.3, reactive layer): a unilateral
//! rule that asks nobody.
//!
//! What an intruder does next nobody knows; it is taken to fly straight on. As long as what is
//! wanted keeps [`KEPT_M`] and a part more, it is flown. Else that course is flown which deviates
//! least from the wanted one, to the right rather than to the left, and keeps more; it is looked
//! for anew at each percept, until the way back keeps clear too.
//!
//! Height is no way out: all heights about a UAV are those of its fellows.
//!
//! # Guarantees
//! None, if an intruder is faster, turns, or comes from nearer than [`least_range_m`]; measured in
//! docs/protocol.md §11.
//!
//! # Complexity
//! As long as nobody is near a look at each intruder; else O(courses · samples · intruders), some
//! ten thousand arithmetic steps.

use crate::setpoint::Steer;
use crate::traffic::Aircraft;
use skein_geometry::Segment;
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::{TAU, atan2, wrap_pi};

/// What is to stay between a UAV and an aircraft at its height, metres.
pub const KEPT_M: f64 = 50.0;

/// Aircraft whose heights differ by more pass above each other, metres.
pub const KEPT_HEIGHT_M: f64 = 15.0;

/// Whoever differs by less is looked at, metres: heights are held to some metres.
const ABOUT_AS_HIGH_M: f64 = KEPT_HEIGHT_M + 5.0;

/// How far ahead is looked, seconds.
pub const AHEAD_S: f64 = 20.0;

/// And in such steps, seconds.
const STEP_S: f64 = 0.5;

/// What the wanted flight has to keep, in parts of what is to stay: to begin with, and once it was
/// left.
const ALERT: f64 = 1.3;
const CLEAR: f64 = 1.5;

/// What is asked for of an evasion.
const ASKED: f64 = 1.6;

/// Courses that are tried, in parts of a turn.
const COURSES: i32 = 72;

/// A radian to the left counts as so many to the right: those who meet pass left to left.
const LEFT_FACTOR: f64 = 1.5;

/// A metre short of what is asked for costs as much as so many radians; and a metre short of what
/// the wanted flight has to keep so many more, so that it is worth any deviation.
const SHORT_RAD_PER_M: f64 = 0.1;
const TOO_SHORT_RAD_PER_M: f64 = 2.0;

/// What was begun is gone on with unless something else is so much cheaper, radians.
const ANOTHER_RAD: f64 = 0.3;

/// A way that leads into a zone costs as much as so many radians.
const ZONE_RAD: f64 = 30.0;

/// So far ahead a way has to be clear of the zones, seconds: then others are found.
const ZONES_AHEAD_S: f64 = 6.0;

/// The UAV as it flies.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    /// Where it is and where its nose points.
    pub pose: Pose,
    /// How high, metres.
    pub height_m: f64,
    /// Its airspeed, m/s.
    pub airspeed_mps: f64,
    /// The hardest turn that it may fly, rad/s.
    pub limit_radps: f64,
    /// The wind, m/s.
    pub wind_mps: Vector,
}

/// What one UAV does about intruders.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WellClear {
    /// If it evades: where it was to be, and on which heading it evades.
    evasion: Option<(Point, f64)>,
}

impl WellClear {
    /// Whether it flies an evasion.
    #[must_use]
    pub fn evades(&self) -> bool {
        self.evasion.is_some()
    }

    /// The turns of an evasion; `None` where what is wanted may be flown. `wanted` tells where it
    /// would be after so many seconds, and `is_free` which places zones leave free.
    pub fn steer(
        &mut self,
        own: &Flight,
        aircraft: &[Aircraft],
        wanted: impl Fn(f64) -> Point,
        is_free: impl Fn(Point) -> bool,
    ) -> Option<Vec<Steer>> {
        let near: Vec<(Vector, Vector)> = aircraft
            .iter()
            .filter(|a| (a.height_m() - own.height_m).abs() < ABOUT_AS_HIGH_M)
            .map(|a| (a.at() - own.pose.position(), a.velocity_mps()))
            .filter(|(apart, v)| {
                let closing_mps = own.airspeed_mps + own.wind_mps.norm() + v.norm();
                apart.norm() < ASKED * KEPT_M + closing_mps * AHEAD_S
            })
            .collect();
        if near.is_empty() {
            self.evasion = None;
            return None;
        }
        let kept_m = |at: &dyn Fn(f64) -> Point| {
            let steps = (0..).map(|k| STEP_S * f64::from(k));
            let steps = steps.take_while(|t| *t <= AHEAD_S);
            steps.fold(f64::INFINITY, |least_m: f64, t| {
                let own = at(t) - own.pose.position();
                let apart = near.iter().map(|(apart, v)| (apart + v * t - own).norm());
                apart.fold(least_m, f64::min)
            })
        };
        let (goal, begun_rad) = match self.evasion {
            None => {
                if kept_m(&wanted) >= ALERT * KEPT_M {
                    return None;
                }
                (wanted(AHEAD_S), None)
            }
            Some((goal, begun_rad)) => {
                let back = Course::new(own, goal);
                if kept_m(&|t| back.at(t)) >= CLEAR * KEPT_M {
                    self.evasion = None;
                    return None;
                }
                (goal, Some(begun_rad))
            }
        };
        let price_rad = |course: &Course, deviation_rad: f64| {
            let keeps_m = kept_m(&|t| course.at(t));
            let short_m = |of: f64| (of * KEPT_M - keeps_m).max(0.0);
            let short_rad = SHORT_RAD_PER_M * short_m(ASKED) + TOO_SHORT_RAD_PER_M * short_m(ALERT);
            let steps = (1..).map(|k| STEP_S * f64::from(k));
            let mut steps = steps.take_while(|t| *t <= ZONES_AHEAD_S);
            let is_clear = steps.all(|t| is_free(course.at(t)));
            deviation_rad + short_rad + if is_clear { 0.0 } else { ZONE_RAD }
        };
        let course = cheapest(own, goal, begun_rad, price_rad);
        self.evasion = Some((goal, course.heading_rad));
        Some(course.steers())
    }
}

/// The cheapest course; what is begun already is cheaper than another by some.
fn cheapest(
    own: &Flight,
    goal: Point,
    begun_rad: Option<f64>,
    price_rad: impl Fn(&Course, f64) -> f64,
) -> Course {
    let straight = Course::new(own, goal);
    let deviation_rad = |beside_rad: f64| {
        if beside_rad > 0.0 {
            LEFT_FACTOR * beside_rad
        } else {
            -beside_rad
        }
    };
    let mut best = (f64::INFINITY, straight);
    if let Some(heading_rad) = begun_rad {
        let course = Course::of(own, heading_rad);
        let beside_rad = wrap_pi(heading_rad - straight.heading_rad);
        best = (
            price_rad(&course, deviation_rad(beside_rad)) - ANOTHER_RAD,
            course,
        );
    }
    for k in -COURSES / 2..=COURSES / 2 {
        let beside_rad = TAU * f64::from(k) / f64::from(COURSES);
        if deviation_rad(beside_rad) >= best.0 {
            continue;
        }
        let course = Course::of(own, straight.heading_rad + beside_rad);
        let price = price_rad(&course, deviation_rad(beside_rad));
        if price < best.0 {
            best = (price, course);
        }
    }
    best.1
}

/// How far aircraft have to be sensed for a UAV to keep clear of one that flies straight at it,
/// metres: it turns away by a right angle first, and both fly on meanwhile.
#[must_use]
pub fn least_range_m(own_mps: f64, turn_radius_m: f64, their_mps: f64) -> f64 {
    let turns_s = TAU / 4.0 * turn_radius_m / own_mps;
    let away_s = turns_s + ASKED * KEPT_M / own_mps;
    ASKED * KEPT_M + (own_mps + their_mps) * away_s
}

/// A turn the shorter way round to a heading, then straight on.
#[derive(Clone, Copy, Debug)]
struct Course {
    start: Pose,
    heading_rad: f64,
    airspeed_mps: f64,
    rate_radps: f64,
    turns_s: f64,
    wind_mps: Vector,
}

impl Course {
    fn new(own: &Flight, goal: Point) -> Self {
        let to = goal - own.pose.position();
        Self::of(own, atan2(to.y, to.x))
    }

    fn of(own: &Flight, heading_rad: f64) -> Self {
        let turn_rad = wrap_pi(heading_rad - own.pose.heading_rad);
        Self {
            start: own.pose,
            heading_rad,
            airspeed_mps: own.airspeed_mps,
            rate_radps: own.limit_radps.copysign(turn_rad),
            turns_s: turn_rad.abs() / own.limit_radps,
            wind_mps: own.wind_mps,
        }
    }

    /// Where it leads over the ground in so many seconds.
    fn at(&self, after_s: f64) -> Point {
        let turned = Segment {
            start: self.start,
            curvature_per_m: self.rate_radps / self.airspeed_mps,
            length_m: self.airspeed_mps * self.turns_s.min(after_s),
        };
        let pose = turned.end();
        let left_m = self.airspeed_mps * (after_s - self.turns_s).max(0.0);
        pose.position() + pose.direction() * left_m + self.wind_mps * after_s
    }

    fn steers(&self) -> Vec<Steer> {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "less than a turn lasts less than minutes"
        )]
        let turns_ms = (self.turns_s * 1_000.0) as u32;
        let steer = |turn_rate_radps, duration_ms| Steer {
            turn_rate_radps,
            duration_ms,
        };
        let mut steers = Vec::new();
        if turns_ms > 0 {
            steers.push(steer(self.rate_radps, turns_ms));
        }
        steers.push(steer(0.0, 1_000));
        steers
    }
}
