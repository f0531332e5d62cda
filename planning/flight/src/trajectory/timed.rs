//! Trajectories: paths with the time at which every place is passed (D2.7 §2.4).
//!
//! A [`Trajectory`] is a sequence of lines and arcs, each flown at an airspeed in a
//! constant wind. A piece is fixed either to the air (then it is a trochoid over the
//! ground) or to the ground (then the nose crabs and the ground speed varies). It can
//! be asked for the state at any time, its length, duration and energy, whether an
//! airframe can fly it, and for a proof that it keeps clear of the zones.
//!
//! [`Flight`] chooses among trajectories by time, distance or energy.
//!
//! # Guarantees
//! Positions, times and lengths are closed forms (elliptic integrals included), right
//! to rounding; only energies over the ground are sums, right to seven digits.
//!
//! # Complexity
//! A state costs O(log pieces) and, on an arc over the ground, some Newton steps.
//!
//! # Errors
//! [`TimedError`] when the wind forbids a piece or two pieces do not join.
//!
//! ```
//! use skein_geometry::frame::{Point, Pose};
//! use skein_flight::trajectory::wind::Wind;
//! use skein_geometry::Curve;
//! use skein_flight::trajectory::Trajectory;
//!
//! let lane = Curve::from_pieces(Pose::new(Point::new(0.0, 0.0), 0.0), &[(0.0, 240.0)]);
//! let flight = Trajectory::along(&lane, 20.0, Wind::new(-8.0, 0.0)).unwrap();
//! assert!((flight.duration_s() - 20.0).abs() < 1e-9, "12 m/s over the ground");
//! assert!((flight.at(5.0).unwrap().position.x - 60.0).abs() < 1e-9);
//! ```

mod clearance;
pub(crate) mod elliptic;
mod fit;
mod piece;
mod plan;
#[cfg(test)]
mod tests;

use super::wind::{Course, Heading, Wind, WindError, WindPath};
use crate::airframe::Airframe;
use piece::bank_rad;
pub use piece::{Medium, Piece};
pub use plan::{Airspeeds, Flight, Objective};
use skein_geometry::Curve;
use skein_geometry::frame::{Point, Pose, Vector};
use thiserror::Error;

/// Trajectories joined farther apart than this are not one, metres: curves leave out
/// pieces of a tenth of a millimetre.
const JOINED_M: f64 = 1e-2;

/// The same for the heading of the nose, radians.
const JOINED_RAD: f64 = 1e-3;

/// Limits may be exceeded by this share: rounding.
const ROUNDING: f64 = 1e-9;

/// How a UAV flies at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Seconds from the trajectory's start.
    pub time_s: f64,
    /// Where it is.
    pub position: Point,
    /// Where its nose points.
    pub heading: Heading,
    /// Where it moves over the ground.
    pub course: Course,
    /// Its velocity over the ground, m/s.
    pub ground_velocity: Vector,
    /// Its speed through the air, m/s.
    pub airspeed_mps: f64,
    /// How fast its nose turns, rad/s, positive to the left.
    pub turn_rate_radps: f64,
}

impl State {
    /// Position and heading of the nose.
    #[must_use]
    pub fn pose(&self) -> Pose {
        Pose::new(self.position, self.heading.0)
    }

    /// The bank of its coordinated turn, radians, without sign.
    #[must_use]
    pub fn bank_rad(&self) -> f64 {
        bank_rad(self.airspeed_mps, self.turn_rate_radps)
    }
}

/// Pieces flown one after the other in one constant wind; may be empty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trajectory {
    pieces: Vec<Piece>,
    wind: Wind,
}

/// Why there is no such trajectory; nothing was changed.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum TimedError {
    /// The wind is too strong for a course or a goal.
    #[error("the wind lets no trajectory get there")]
    NoWay,
    /// The airspeed is zero, negative or no number, or a length is no number.
    #[error("airspeed and lengths must be finite and positive")]
    NotFinite,
    /// The second trajectory does not begin where the first ends, or in another wind.
    #[error("the trajectories do not join: {gap_m} m and {turned_rad} rad apart")]
    Apart {
        /// Distance between end and beginning, metres.
        gap_m: f64,
        /// Difference of the headings, radians.
        turned_rad: f64,
    },
    /// Every trajectory found comes too near to a zone.
    #[error("no trajectory keeps clear of the zones")]
    NotClear,
    /// The airframe cannot fly it.
    #[error(transparent)]
    Limit(#[from] LimitError),
    /// The question about the wind had no answer.
    #[error(transparent)]
    Wind(#[from] WindError),
}

/// Which limit of an airframe a trajectory breaks first.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum LimitError {
    /// The wing would stall, in a turn under its load.
    #[error("at {at_s} s the airspeed of {airspeed_mps} m/s is below the stall at {stall_mps} m/s")]
    Stall {
        /// When, seconds.
        at_s: f64,
        /// Airspeed flown, m/s.
        airspeed_mps: f64,
        /// Airspeed at which the wing stalls, m/s.
        stall_mps: f64,
    },
    /// Faster than thrust allows.
    #[error("at {at_s} s the airspeed of {airspeed_mps} m/s is above the greatest")]
    TooFast {
        /// When, seconds.
        at_s: f64,
        /// Airspeed flown, m/s.
        airspeed_mps: f64,
    },
    /// Steeper than the airframe may bank.
    #[error("at {at_s} s the bank of {bank_rad} rad is steeper than allowed")]
    Bank {
        /// When, seconds.
        at_s: f64,
        /// Bank needed, radians.
        bank_rad: f64,
    },
}

impl Trajectory {
    /// A flight found by the search for the fastest one in wind.
    #[must_use]
    pub fn through_air(path: &WindPath) -> Self {
        let mut trajectory = Self::empty(path.wind);
        let mut at = path.start;
        for segment in path.air_segments() {
            if segment.length_m > 0.0 {
                let start = Pose::new(at.position(), segment.start.heading_rad);
                let speed = path.performance.airspeed_mps;
                let piece = Piece::air(skein_geometry::Segment { start, ..segment }, speed);
                at = trajectory.push(piece);
            }
        }
        trajectory
    }

    /// A curve over the ground, flown at an airspeed with the nose held into the wind.
    ///
    /// # Errors
    /// [`TimedError::NoWay`] if the wind forbids a course on it, or is at least as
    /// fast as the UAV and the curve has an arc.
    pub fn along(curve: &Curve, airspeed_mps: f64, wind: Wind) -> Result<Self, TimedError> {
        if !(airspeed_mps > 0.0 && (airspeed_mps + wind.speed_mps()).is_finite()) {
            return Err(TimedError::NotFinite);
        }
        let mut trajectory = Self::empty(wind);
        for &segment in curve.segments() {
            let piece = Piece::ground(segment, airspeed_mps, wind)?;
            if !piece.duration_s.is_finite() {
                return Err(TimedError::NotFinite);
            }
            trajectory.push(piece);
        }
        Ok(trajectory)
    }

    /// A trajectory of no duration.
    #[must_use]
    pub fn empty(wind: Wind) -> Self {
        Self {
            pieces: Vec::new(),
            wind,
        }
    }

    /// Flies `next` afterwards.
    ///
    /// # Errors
    /// [`TimedError::Apart`] if it begins elsewhere, with another heading or in
    /// another wind.
    pub fn append(&mut self, next: &Self) -> Result<(), TimedError> {
        if let (Some(end), Some(start)) = (self.end(), next.start()) {
            let gap_m = (end.position - start.position).norm();
            let turned_rad = skein_geometry::math::wrap_pi(end.heading.0 - start.heading.0).abs();
            let same_wind = (self.wind.velocity() - next.wind.velocity()).norm() < ROUNDING;
            if !(gap_m <= JOINED_M && turned_rad <= JOINED_RAD && same_wind) {
                return Err(TimedError::Apart { gap_m, turned_rad });
            }
        }
        if self.pieces.is_empty() {
            self.wind = next.wind;
        }
        for &piece in &next.pieces {
            self.push(piece);
        }
        Ok(())
    }

    /// Appends a piece as it is and returns where it ends.
    fn push(&mut self, piece: Piece) -> Pose {
        let piece = Piece {
            start_s: self.duration_s(),
            ..piece
        };
        self.pieces.push(piece);
        piece.state_after(piece.duration_s, self.wind).pose()
    }

    /// The pieces, in order of flight.
    #[must_use]
    pub fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// The wind it was made for.
    #[must_use]
    pub fn wind(&self) -> Wind {
        self.wind
    }

    /// Whether there is nothing to fly.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Its duration, seconds.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.pieces.last().map_or(0.0, |p| p.start_s + p.duration_s)
    }

    /// Its length over the ground, metres.
    #[must_use]
    pub fn ground_length_m(&self) -> f64 {
        let lengths = self.pieces.iter().map(|p| p.ground_length_m(self.wind));
        lengths.sum()
    }

    /// Its length through the air, metres.
    #[must_use]
    pub fn air_distance_m(&self) -> f64 {
        let lengths = self.pieces.iter().map(|p| p.airspeed_mps * p.duration_s);
        lengths.sum()
    }

    /// What it costs, in seconds of level flight at cruise: what it takes from the
    /// airframe's endurance.
    #[must_use]
    pub fn energy_s(&self, airframe: &Airframe) -> f64 {
        let energies = self.pieces.iter().map(|p| p.energy_s(airframe, self.wind));
        energies.sum()
    }

    /// How the UAV flies after `t_s` seconds, clamped to both ends; `None` when empty.
    #[must_use]
    pub fn at(&self, t_s: f64) -> Option<State> {
        let after = self.pieces.partition_point(|p| p.start_s <= t_s);
        let piece = self.pieces.get(after.saturating_sub(1))?;
        let after_s = (t_s - piece.start_s).clamp(0.0, piece.duration_s);
        Some(piece.state_after(after_s, self.wind))
    }

    /// How it begins; `None` when empty.
    #[must_use]
    pub fn start(&self) -> Option<State> {
        self.pieces.first().map(|p| p.state_after(0.0, self.wind))
    }

    /// How it ends; `None` when empty.
    #[must_use]
    pub fn end(&self) -> Option<State> {
        let last = self.pieces.last()?;
        Some(last.state_after(last.duration_s, self.wind))
    }

    /// Whether an airframe can fly it: airspeeds, bank with the wind's drift on curves
    /// over the ground, and the stall, which a banked wing meets earlier.
    ///
    /// # Errors
    /// The first limit that is broken.
    pub fn check(&self, airframe: &Airframe) -> Result<(), LimitError> {
        for p in &self.pieces {
            let (bank_rad, at_s) = p.steepest(self.wind);
            let airspeed_mps = p.airspeed_mps;
            if airspeed_mps > airframe.max_mps * (1.0 + ROUNDING) {
                let at_s = p.start_s;
                return Err(LimitError::TooFast { at_s, airspeed_mps });
            }
            if bank_rad > airframe.max_bank_rad + ROUNDING {
                return Err(LimitError::Bank { at_s, bank_rad });
            }
            let stall_mps = airframe.stall_in_turn_mps(bank_rad);
            if airspeed_mps < stall_mps * (1.0 - ROUNDING) {
                return Err(LimitError::Stall {
                    at_s,
                    airspeed_mps,
                    stall_mps,
                });
            }
        }
        Ok(())
    }
}
