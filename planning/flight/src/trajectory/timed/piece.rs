//! One piece of a trajectory: a line or an arc, either through the air, which drifts
//! (a trochoid over the ground), or over the ground, against which the nose crabs.
//!
//! Let δ be the course less the wind's direction, V the airspeed and w the wind's
//! speed. Over the ground the UAV makes w cos δ + √(V² − w² sin² δ), so the time along
//! an arc of curvature k is (V E(δ | w²/V²) − w sin δ) / (k (V² − w²)), and the nose
//! turns at k g²/√(V² − w² sin² δ) for a ground speed of g: the fastest where the
//! course is nearest to downwind. Through the air the ground speed is
//! √((V + w)² − 4Vw sin²(θ/2)) for a heading θ off the wind, and the length over the
//! ground 2(V + w) E(θ/2 | 4Vw/(V + w)²) per radius.

use super::elliptic::second_kind_between;
use super::{State, TimedError};
use crate::airframe::{Airframe, GRAVITY_MPS2, PowerModel};
use crate::trajectory::wind::{Course, Heading, Wind};
use skein_geometry::Segment;
use skein_geometry::math::{PI, atan2, sin, wrap_pi};

/// Newton's steps for a place on an arc: its rate varies by at most the ratio of
/// ground speeds, so a handful do; the rest are bisections near headwinds.
const STEPS: u8 = 60;

/// Times agree to this, seconds: micrometres at any airspeed.
const SAME_S: f64 = 1e-11;

/// Samples per radian for the power along an arc over the ground: Simpson's rule is
/// then right to seven digits.
const SAMPLES_PER_RAD: f64 = 16.0;

/// Turning less than this over its whole length, a piece is straight, radians.
const STRAIGHT_RAD: f64 = 1e-9;

/// What a piece's line or arc is fixed to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Medium {
    /// The air: the piece begins with the heading of the nose, and drifts.
    Air,
    /// The ground: the piece begins with the course, and the nose crabs.
    Ground,
}

/// A line or an arc with the time it takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// The line or arc; for the air as it was at the piece's beginning.
    pub segment: Segment,
    /// What it is fixed to.
    pub medium: Medium,
    /// Airspeed, m/s.
    pub airspeed_mps: f64,
    /// When it begins, seconds from the trajectory's start.
    pub start_s: f64,
    /// How long it takes, seconds.
    pub duration_s: f64,
}

impl Piece {
    /// A piece through the air, beginning at time zero.
    pub(super) fn air(segment: Segment, airspeed_mps: f64) -> Self {
        Self {
            segment,
            medium: Medium::Air,
            airspeed_mps,
            start_s: 0.0,
            duration_s: segment.length_m / airspeed_mps,
        }
    }

    /// A piece over the ground, beginning at time zero.
    pub(super) fn ground(
        segment: Segment,
        airspeed_mps: f64,
        wind: Wind,
    ) -> Result<Self, TimedError> {
        let mut piece = Self {
            segment,
            medium: Medium::Ground,
            airspeed_mps,
            start_s: 0.0,
            duration_s: 0.0,
        };
        if piece.is_arc() {
            if wind.speed_mps() >= airspeed_mps {
                return Err(TimedError::NoWay);
            }
            piece.duration_s = piece.time_along_s(segment.length_m, wind);
        } else {
            let course = Course(segment.start.heading_rad);
            let speed = wind
                .ground_speed_mps(course, airspeed_mps)
                .filter(|speed| *speed > 0.0)
                .ok_or(TimedError::NoWay)?;
            piece.duration_s = segment.length_m / speed;
        }
        Ok(piece)
    }

    pub(super) fn is_arc(&self) -> bool {
        (self.segment.curvature_per_m * self.segment.length_m).abs() > STRAIGHT_RAD
    }

    /// How the UAV flies `after_s` seconds from the piece's beginning.
    #[must_use]
    pub fn state_after(&self, after_s: f64, wind: Wind) -> State {
        let time_s = self.start_s + after_s;
        match self.medium {
            Medium::Air => {
                let pose = self.segment.pose_at(self.airspeed_mps * after_s);
                let heading = Heading(pose.heading_rad);
                State {
                    time_s,
                    position: pose.position() + wind.velocity() * after_s,
                    heading,
                    course: wind.course_of(heading, self.airspeed_mps),
                    ground_velocity: wind.ground_velocity(heading, self.airspeed_mps),
                    airspeed_mps: self.airspeed_mps,
                    turn_rate_radps: self.segment.curvature_per_m * self.airspeed_mps,
                }
            }
            Medium::Ground => {
                let pose = self.segment.pose_at(self.along_m(after_s, wind));
                let course = Course(pose.heading_rad);
                let heading = wind
                    .heading_for_course(course, self.airspeed_mps)
                    .unwrap_or(Heading(course.0));
                State {
                    time_s,
                    position: pose.position(),
                    heading,
                    course,
                    ground_velocity: wind.ground_velocity(heading, self.airspeed_mps),
                    airspeed_mps: self.airspeed_mps,
                    turn_rate_radps: self.nose_rate_radps(course, wind),
                }
            }
        }
    }

    /// How fast the nose turns on a piece over the ground, rad/s.
    fn nose_rate_radps(&self, course: Course, wind: Wind) -> f64 {
        let (v, w) = (self.airspeed_mps, wind.speed_mps());
        let across = w * sin(off_wind(wind, course.0));
        let ahead = (v * v - across * across).max(0.0).sqrt();
        let ground = wind.ground_speed_mps(course, v).unwrap_or(0.0);
        self.segment.curvature_per_m * ground * ground / ahead.max(f64::MIN_POSITIVE)
    }

    /// Time from the beginning of an arc over the ground to `s_m` along it, seconds.
    fn time_along_s(&self, s_m: f64, wind: Wind) -> f64 {
        let (v, w) = (self.airspeed_mps, wind.speed_mps());
        if w <= 0.0 {
            return s_m / v;
        }
        let k = self.segment.curvature_per_m;
        let from = off_wind(wind, self.segment.start.heading_rad);
        let to = from + k * s_m;
        let m = (w / v) * (w / v);
        let arc = second_kind_between(from, to, m);
        (v * arc - w * (sin(to) - sin(from))) / (k * (v * v - w * w))
    }

    /// Distance along a piece over the ground after a time, metres.
    fn along_m(&self, after_s: f64, wind: Wind) -> f64 {
        let length_m = self.segment.length_m;
        if !self.is_arc() {
            return length_m * (after_s / self.duration_s).clamp(0.0, 1.0);
        }
        let (mut low, mut high) = (0.0, length_m);
        let mut s_m = length_m * (after_s / self.duration_s).clamp(0.0, 1.0);
        for _ in 0..STEPS {
            let late_s = self.time_along_s(s_m, wind) - after_s;
            if late_s.abs() < SAME_S {
                break;
            }
            if late_s > 0.0 {
                high = s_m;
            } else {
                low = s_m;
            }
            let course =
                Course(self.segment.start.heading_rad + self.segment.curvature_per_m * s_m);
            let speed = wind
                .ground_speed_mps(course, self.airspeed_mps)
                .unwrap_or(0.0);
            let next = s_m - late_s * speed;
            s_m = if next > low && next < high {
                next
            } else {
                0.5 * (low + high)
            };
        }
        s_m
    }

    /// Length over the ground, metres.
    pub(super) fn ground_length_m(&self, wind: Wind) -> f64 {
        let (v, w) = (self.airspeed_mps, wind.speed_mps());
        match self.medium {
            Medium::Ground => self.segment.length_m,
            Medium::Air if !self.is_arc() => {
                let heading = Heading(self.segment.start.heading_rad);
                wind.ground_velocity(heading, v).norm() * self.duration_s
            }
            Medium::Air => {
                let from = off_wind(wind, self.segment.start.heading_rad);
                let k = self.segment.curvature_per_m;
                let to = from + k * self.segment.length_m;
                let m = 4.0 * v * w / ((v + w) * (v + w));
                let arc = second_kind_between(from / 2.0, to / 2.0, m);
                2.0 * (v + w) * arc / (k * v)
            }
        }
    }

    /// The steepest bank, radians, and when it is flown, seconds from the
    /// trajectory's start.
    pub(super) fn steepest(&self, wind: Wind) -> (f64, f64) {
        if self.medium == Medium::Air || !self.is_arc() {
            let rate = self.state_after(0.0, wind).turn_rate_radps;
            return (bank_rad(self.airspeed_mps, rate), self.start_s);
        }
        let k = self.segment.curvature_per_m;
        let from = off_wind(wind, self.segment.start.heading_rad);
        let to = from + k * self.segment.length_m;
        let (low, high) = (from.min(to), from.max(to));
        // Downwind if the arc passes it, else the nearer end.
        let turns = (low / (2.0 * PI)).ceil() * 2.0 * PI;
        let s_m = if turns <= high {
            (turns - from) / k
        } else if wrap_pi(from).abs() < wrap_pi(to).abs() {
            0.0
        } else {
            self.segment.length_m
        };
        let course = Course(self.segment.start.heading_rad + k * s_m);
        let rate = self.nose_rate_radps(course, wind);
        let at_s = self.start_s + self.time_along_s(s_m, wind);
        (bank_rad(self.airspeed_mps, rate), at_s)
    }

    /// Energy, in seconds of level flight at cruise.
    pub(super) fn energy_s(&self, airframe: &Airframe, wind: Wind) -> f64 {
        let model = PowerModel::of(airframe);
        let power = |rate: f64| model.share(self.airspeed_mps, bank_rad(self.airspeed_mps, rate));
        let k = self.segment.curvature_per_m;
        if self.medium == Medium::Air || !self.is_arc() {
            let rate = match self.medium {
                Medium::Air => k * self.airspeed_mps,
                Medium::Ground => 0.0,
            };
            return power(rate) * self.duration_s;
        }
        // Simpson's rule over the arc's length.
        let turned = (k * self.segment.length_m).abs();
        let pairs = (turned * SAMPLES_PER_RAD / 2.0).ceil().max(1.0);
        let step_m = self.segment.length_m / (2.0 * pairs);
        let at = |i: f64| {
            let course = Course(self.segment.start.heading_rad + k * step_m * i);
            let speed = wind
                .ground_speed_mps(course, self.airspeed_mps)
                .unwrap_or(f64::MIN_POSITIVE);
            power(self.nose_rate_radps(course, wind)) / speed
        };
        let (mut sum, mut i) = (0.0, 0.0);
        while i < pairs {
            let first = 2.0 * i;
            sum += at(first) + 4.0 * at(first + 1.0) + at(first + 2.0);
            i += 1.0;
        }
        sum * step_m / 3.0
    }

    /// The UAV is never faster than this over the ground, m/s.
    pub(super) fn velocity_bound_mps(&self, wind: Wind) -> f64 {
        self.airspeed_mps + wind.speed_mps()
    }

    /// The largest acceleration over the ground, m/s²: that of the turn.
    pub(super) fn acceleration_mps2(&self) -> f64 {
        self.airspeed_mps * self.airspeed_mps * self.segment.curvature_per_m.abs()
    }

    /// Whether it is a trochoid, which only bounds can prove clear of a zone.
    pub(super) fn is_trochoid(&self, wind: Wind) -> bool {
        self.medium == Medium::Air && self.is_arc() && wind.speed_mps() > 0.0
    }
}

/// The bank of a coordinated turn, radians, without sign.
pub(super) fn bank_rad(airspeed_mps: f64, turn_rate_radps: f64) -> f64 {
    atan2((airspeed_mps * turn_rate_radps).abs(), GRAVITY_MPS2)
}

/// An angle less the direction towards which the wind blows.
fn off_wind(wind: Wind, angle_rad: f64) -> f64 {
    angle_rad - atan2(wind.north_mps, wind.east_mps)
}
