//! The fastest flight between two poses in a constant wind (D2.7 §2.4.2).
//!
//! A UAV flies Dubins words relative to the air; the air drifts over the ground. Seen
//! from the air the goal moves with the opposite of the wind, and the fastest flight
//! is the word that meets it first. D2.7 searches the time at which UAV and goal
//! arrive together by descent on the shortest word's length; that length jumps where
//! a word begins or ends to exist, so here every word with every winding number is a
//! branch of its own, whose roots are all found:
//!
//! | words | branch | roots |
//! |---|---|---|
//! | LSL, RSR | time against length is a quadratic | one, in closed form |
//! | LSR, RSL | falls and is convex where the circles are apart | one, by Newton's steps |
//! | LRL, RLR | a quadratic against a cosine, of known convexity | each isolated by tangents |
//!
//! Turns are at most whole circles: of a longer turn a circle could be flown
//! elsewhere at no cost, and the path would then break Pontryagin's conditions.
//!
//! The nose points along the [`Heading`]; over the ground the UAV moves along its
//! [`Course`]. The two are different types, and the wind converts between them.
//!
//! # Guarantees
//! The path found is the fastest over all six words, both forms of the three-turn
//! ones included, and ends within 1e-9 turn radii (flown for less than a thousand) of
//! the goal. In a wind at least as fast as the UAV a goal may be out of reach; then
//! the answer is [`Answer::Unreachable`], and reachable goals are found all the same.
//!
//! # Complexity
//! Constant: some twenty evaluations of a word.
//!
//! # Errors
//! [`WindError`] for numbers that are none, and for speeds or radii that are not
//! positive.
//!
//! ```
//! use skein_geometry::frame::{Point, Pose};
//! use skein_flight::trajectory::wind::{Answer, Performance, Wind, time_optimal};
//!
//! let uav = Performance { airspeed_mps: 20.0, turn_radius_m: 60.0 };
//! let wind = Wind::new(-8.0, 0.0);
//! let from = Pose::new(Point::new(0.0, 0.0), 0.0);
//! let to = Pose::new(Point::new(600.0, 0.0), 0.0);
//! let Ok(Answer::Path(path)) = time_optimal(from, to, uav, wind) else { panic!() };
//! assert!((path.time_s() - 50.0).abs() < 1e-9, "head wind: 12 m/s over the ground");
//! ```

mod cross;
mod problem;
#[cfg(test)]
mod tests;
mod triple;

use crate::airframe::Airframe;
use problem::{Problem, fastest};
use serde::{Deserialize, Serialize};
use skein_geometry::Segment;
use skein_geometry::frame::{Pose, Vector};
use skein_geometry::math::{PI, TAU, asin, atan2, hypot, sin_cos, wrap_pi};
use thiserror::Error;

/// Courses from which a turn round is timed: its time changes smoothly with the course,
/// so every 15° will do for an estimate.
const COURSES: u8 = 24;

/// Where the nose points: radians counter-clockwise from east.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
pub struct Heading(pub f64);

/// Where the UAV moves over the ground: radians counter-clockwise from east.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
pub struct Course(pub f64);

/// A constant wind: the velocity of the air over the ground.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Wind {
    /// Towards east, m/s.
    pub east_mps: f64,
    /// Towards north, m/s.
    pub north_mps: f64,
}

impl Wind {
    /// No wind.
    pub const CALM: Self = Self {
        east_mps: 0.0,
        north_mps: 0.0,
    };

    /// A wind that blows towards east and north with these speeds, m/s.
    #[must_use]
    pub fn new(east_mps: f64, north_mps: f64) -> Self {
        Self {
            east_mps,
            north_mps,
        }
    }

    /// The velocity of the air, m/s.
    #[must_use]
    pub fn velocity(&self) -> Vector {
        Vector::new(self.east_mps, self.north_mps)
    }

    /// Its speed, m/s.
    #[must_use]
    pub fn speed_mps(&self) -> f64 {
        hypot(self.east_mps, self.north_mps)
    }

    /// Velocity over the ground of a UAV that points along `heading`, m/s.
    #[must_use]
    pub fn ground_velocity(&self, heading: Heading, airspeed_mps: f64) -> Vector {
        let (s, c) = sin_cos(heading.0);
        Vector::new(
            airspeed_mps * c + self.east_mps,
            airspeed_mps * s + self.north_mps,
        )
    }

    /// The course of a UAV that points along `heading`; that of the heading itself
    /// when it stands still over the ground.
    #[must_use]
    pub fn course_of(&self, heading: Heading, airspeed_mps: f64) -> Course {
        let v = self.ground_velocity(heading, airspeed_mps);
        if v.norm_squared() > 0.0 {
            Course(atan2(v.y, v.x))
        } else {
            Course(wrap_pi(heading.0))
        }
    }

    /// The heading to point along so as to move along `course` with `airspeed_mps`,
    /// the faster one if there are two; `None` when the wind forbids it.
    #[must_use]
    pub fn heading_for_course(&self, course: Course, airspeed_mps: f64) -> Option<Heading> {
        let across = self.across(course);
        let makes_way = self.ground_speed_mps(course, airspeed_mps)? > 0.0;
        makes_way.then(|| Heading(wrap_pi(course.0 - asin(across / airspeed_mps))))
    }

    /// Speed over the ground along `course`, m/s, the larger one if there are two;
    /// `None` when the crosswind is faster than the UAV, not positive when it cannot
    /// make way.
    #[must_use]
    pub fn ground_speed_mps(&self, course: Course, airspeed_mps: f64) -> Option<f64> {
        let across = self.across(course);
        let square = airspeed_mps * airspeed_mps - across * across;
        let (s, c) = sin_cos(course.0);
        (square >= 0.0).then(|| self.east_mps * c + self.north_mps * s + square.sqrt())
    }

    /// Part of the wind that blows across `course`, positive to its left, m/s.
    fn across(&self, course: Course) -> f64 {
        let (s, c) = sin_cos(course.0);
        self.north_mps * c - self.east_mps * s
    }
}

/// How fast a UAV flies and how tight it turns, in the air.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Performance {
    /// Airspeed, m/s.
    pub airspeed_mps: f64,
    /// Smallest turn radius relative to the air, metres.
    pub turn_radius_m: f64,
}

impl Performance {
    /// An airframe at `airspeed_mps` with its largest bank.
    #[must_use]
    pub fn of(airframe: &Airframe, airspeed_mps: f64) -> Self {
        Self {
            airspeed_mps,
            turn_radius_m: airframe.turn_radius_m(airspeed_mps),
        }
    }

    /// Turn rate at the smallest radius, rad/s.
    #[must_use]
    pub fn turn_rate_radps(&self) -> f64 {
        self.airspeed_mps / self.turn_radius_m
    }
}

/// The six Dubins words.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Word {
    /// Left, straight, left.
    Lsl,
    /// Right, straight, right.
    Rsr,
    /// Left, straight, right.
    Lsr,
    /// Right, straight, left.
    Rsl,
    /// Left, right, left.
    Lrl,
    /// Right, left, right.
    Rlr,
}

impl Word {
    /// Sides of the three pieces: 1 left, 0 straight, −1 right.
    #[must_use]
    pub fn sides(self) -> [f64; 3] {
        match self {
            Self::Lsl => [1.0, 0.0, 1.0],
            Self::Rsr => [-1.0, 0.0, -1.0],
            Self::Lsr => [1.0, 0.0, -1.0],
            Self::Rsl => [-1.0, 0.0, 1.0],
            Self::Lrl => [1.0, -1.0, 1.0],
            Self::Rlr => [-1.0, 1.0, -1.0],
        }
    }
}

/// A flight of three pieces through moving air.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WindPath {
    /// Where it begins.
    pub start: Pose,
    /// Its word.
    pub word: Word,
    /// Durations of its pieces, seconds, not negative.
    pub durations_s: [f64; 3],
    /// Speed and turns in the air.
    pub performance: Performance,
    /// The wind it was made for.
    pub wind: Wind,
}

impl WindPath {
    /// Its duration, seconds.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.durations_s.iter().sum()
    }

    /// Turn rates of its pieces, rad/s, positive to the left.
    #[must_use]
    pub fn turn_rates_radps(&self) -> [f64; 3] {
        let rate = self.performance.turn_rate_radps();
        self.word.sides().map(|side| side * rate)
    }

    /// Angles its pieces turn by, radians, positive to the left.
    #[must_use]
    pub fn turned_rad(&self) -> [f64; 3] {
        let rates = self.turn_rates_radps();
        core::array::from_fn(|i| rates[i] * self.durations_s[i])
    }

    /// The pieces as they are flown relative to the air that was at the start.
    #[must_use]
    pub fn air_segments(&self) -> [Segment; 3] {
        let mut start = self.start;
        let (sides, p) = (self.word.sides(), self.performance);
        core::array::from_fn(|i| {
            let segment = Segment {
                start,
                curvature_per_m: sides[i] / p.turn_radius_m,
                length_m: self.durations_s[i] * p.airspeed_mps,
            };
            start = segment.end();
            segment
        })
    }

    /// Place over the ground and heading of the nose after `t_s` seconds, clamped to
    /// the ends.
    #[must_use]
    pub fn pose_at(&self, t_s: f64) -> Pose {
        let mut left_s = t_s.clamp(0.0, self.time_s());
        let drift = self.wind.velocity() * left_s;
        let mut pose = self.start;
        for (segment, lasts_s) in self.air_segments().iter().zip(self.durations_s) {
            pose = segment.pose_at(left_s.min(lasts_s) * self.performance.airspeed_mps);
            left_s -= lasts_s;
            if left_s <= 0.0 {
                break;
            }
        }
        Pose {
            east_m: pose.east_m + drift.x,
            north_m: pose.north_m + drift.y,
            ..pose
        }
    }

    /// Where it ends.
    #[must_use]
    pub fn end(&self) -> Pose {
        self.pose_at(self.time_s())
    }
}

/// What the search for a path found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Answer {
    /// The fastest path.
    Path(WindPath),
    /// The wind is at least as fast as the UAV and keeps it from the goal, whatever
    /// it flies (or for more than a year).
    Unreachable,
}

impl Answer {
    /// The path, if there is one.
    #[must_use]
    pub fn path(self) -> Option<WindPath> {
        match self {
            Self::Path(path) => Some(path),
            Self::Unreachable => None,
        }
    }
}

/// Why a question about a flight in wind has no answer; nothing was computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum WindError {
    /// A coordinate, heading or wind is no number or not finite.
    #[error("a pose or the wind is not finite")]
    NotFinite,
    /// The airspeed or the turn radius is zero, negative or no number.
    #[error("airspeed and turn radius must be positive")]
    NotPositive,
}

/// Which words are searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Families {
    /// All six.
    #[default]
    All,
    /// Those with a straight in the middle, which is what others search.
    StraightMiddle,
}

/// The fastest flight from `from` to `to`, both with the heading of the nose.
///
/// # Errors
/// [`WindError`] when a number is none or not in its range.
pub fn time_optimal(
    from: Pose,
    to: Pose,
    performance: Performance,
    wind: Wind,
) -> Result<Answer, WindError> {
    time_optimal_over(Families::All, from, to, performance, wind)
}

/// The fastest flight among the words of `families`.
///
/// # Errors
/// [`WindError`] when a number is none or not in its range.
pub fn time_optimal_over(
    families: Families,
    from: Pose,
    to: Pose,
    performance: Performance,
    wind: Wind,
) -> Result<Answer, WindError> {
    let problem = normalised(from, to, performance, wind)?;
    let found = fastest(&problem, families == Families::All);
    let unit_s = performance.turn_radius_m / performance.airspeed_mps;
    Ok(found.map_or(Answer::Unreachable, |best| {
        Answer::Path(WindPath {
            start: from,
            word: best.word,
            durations_s: best.pieces.map(|d| d * unit_s),
            performance,
            wind,
        })
    }))
}

/// Duration of [`time_optimal`], seconds, infinite when unreachable, without the path.
///
/// # Errors
/// [`WindError`] when a number is none or not in its range.
pub fn time_s(
    from: Pose,
    to: Pose,
    performance: Performance,
    wind: Wind,
) -> Result<f64, WindError> {
    let problem = normalised(from, to, performance, wind)?;
    let unit_s = performance.turn_radius_m / performance.airspeed_mps;
    Ok(fastest(&problem, true).map_or(f64::INFINITY, |best| best.time * unit_s))
}

/// The longest time to turn round in place, seconds, of 24 courses all round: from a
/// course over the ground to its opposite. Infinite when the wind forbids some course.
///
/// # Errors
/// [`WindError`] when a number is none or not in its range.
pub fn turn_round_s(performance: Performance, wind: Wind) -> Result<f64, WindError> {
    let nose = |rad: f64| wind.heading_for_course(Course(rad), performance.airspeed_mps);
    let mut longest_s = 0.0f64;
    for i in 0..COURSES {
        let course_rad = TAU * f64::from(i) / f64::from(COURSES);
        let lasts_s = match (nose(course_rad), nose(course_rad + PI)) {
            (Some(from), Some(to)) => {
                let at = |heading: Heading| Pose {
                    east_m: 0.0,
                    north_m: 0.0,
                    heading_rad: heading.0,
                };
                time_s(at(from), at(to), performance, wind)?
            }
            _ => f64::INFINITY,
        };
        longest_s = longest_s.max(lasts_s);
    }
    Ok(longest_s)
}

/// The question with radius and airspeed 1, from the origin heading east.
fn normalised(
    from: Pose,
    to: Pose,
    performance: Performance,
    wind: Wind,
) -> Result<Problem, WindError> {
    let (radius, speed) = (performance.turn_radius_m, performance.airspeed_mps);
    if !(radius > 0.0 && speed > 0.0 && (radius + speed).is_finite()) {
        return Err(WindError::NotPositive);
    }
    let (s, c) = sin_cos(from.heading_rad);
    let turned = |x: f64, y: f64, unit: f64| ((x * c + y * s) / unit, (y * c - x * s) / unit);
    let (x, y) = turned(to.east_m - from.east_m, to.north_m - from.north_m, radius);
    let (wx, wy) = turned(wind.east_mps, wind.north_mps, speed);
    let heading = to.heading_rad - from.heading_rad;
    if !(x + y + wx + wy + heading).is_finite() {
        return Err(WindError::NotFinite);
    }
    Ok(Problem::new(x, y, heading, wx, wy))
}
