//! A timed flight through the air that ends in a loiter for ever.
//!
//! What is promised to others must be the same to the bit at whoever promises it and at
//! whoever hears it. So a [`MotionPlan`] is integers alone, and a [`Motion`] is derived
//! from it by everybody.

use serde::{Deserialize, Serialize};
use skein_geometry::Segment;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::{seconds, wrap_pi};
use thiserror::Error;

/// Stretches that a plan may have: what is left of the present flight (two at most), a
/// circle to wait, and a way with two turns take seven; lanes round a zone, between two
/// places with room for a circle, up to two dozen.
pub const STRETCHES_MAX: usize = 24;

/// The tightest circle that makes sense of a fixed wing, millimetres.
const RADIUS_LEAST_MM: u32 = 1_000;

/// The longest stretch, millimetres: the extent on which the tangent plane is trusted.
const LENGTH_MOST_MM: u32 = 40_000_000;

/// The slowest airspeed of a fixed wing, mm/s.
const AIRSPEED_LEAST_MMPS: u32 = 1_000;

/// The fastest, mm/s.
const AIRSPEED_MOST_MMPS: u32 = 200_000;

/// Headings are said in so many parts of a radian: over a kilometre one is 0.1 mm.
const HEADING_PARTS: f64 = 1e7;

/// The largest heading, in those parts: half a turn.
pub const HEADING_MOST_E7: u32 = 31_415_927;

/// One stretch of a flight, as it is said.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Stretch {
    /// Radius of its turn, millimetres: positive to the left, negative to the right, 0 on a
    /// straight line.
    pub radius_mm: i32,
    /// Its length through the air, millimetres.
    pub length_mm: u32,
    /// The airspeed, mm/s.
    pub airspeed_mmps: u32,
}

/// What follows the last stretch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum End {
    /// A circle for ever: the contingency.
    Loiter {
        /// Its radius, millimetres: positive to the left, negative to the right.
        radius_mm: i32,
        /// The airspeed on it, mm/s.
        airspeed_mmps: u32,
    },
    /// It leaves the airspace: it has landed, or climbs out.
    Leaves,
}

/// A flight in integers: where and when it begins, its stretches, and what follows them.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct MotionPlan {
    /// When it begins, milliseconds of the clock that all share.
    pub start_ms: u64,
    /// Where, millimetres east of the origin.
    pub east_mm: i32,
    /// Where, millimetres north of it.
    pub north_mm: i32,
    /// Its heading there, 1e-7 rad, counter-clockwise from east.
    pub heading_e7: i32,
    /// What is flown, in order.
    pub stretches: Vec<Stretch>,
    /// What follows.
    pub end: End,
}

impl MotionPlan {
    /// Of a UAV that stands on the ground there: no flight, and in nobody's way.
    #[must_use]
    pub fn on_ground(at_ms: u64, pose: Pose) -> Self {
        Self {
            start_ms: at_ms,
            east_mm: to_signed_mm(pose.east_m),
            north_mm: to_signed_mm(pose.north_m),
            heading_e7: heading_e7(pose.heading_rad),
            stretches: Vec::new(),
            end: End::Leaves,
        }
    }
}

/// Why a plan is no flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum MotionError {
    /// More stretches than [`STRETCHES_MAX`].
    #[error("a flight of {0} stretches, more than {STRETCHES_MAX}")]
    TooMany(usize),
    /// A turn tighter than any fixed wing flies.
    #[error("a turn of {0} mm")]
    Radius(i32),
    /// A stretch longer than any flight.
    #[error("a stretch of {0} mm")]
    Length(u32),
    /// An airspeed that no fixed wing has.
    #[error("an airspeed of {0} mm/s")]
    Airspeed(u32),
}

/// A stretch, derived.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    pub segment: Segment,
    pub airspeed_mps: f64,
    /// Seconds from the beginning of the motion to its end; infinite for the loiter.
    pub until_s: f64,
    /// The same to its beginning.
    pub from_s: f64,
}

impl Piece {
    /// The pose so many seconds after the motion began.
    pub fn pose_at(&self, at_s: f64) -> Pose {
        self.segment
            .pose_at((at_s - self.from_s) * self.airspeed_mps)
    }

    pub fn is_straight(&self) -> bool {
        self.segment.curvature_per_m == 0.0
    }
}

/// A flight that can be asked where it is at any time.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    plan: MotionPlan,
    pieces: Vec<Piece>,
    /// When the last stretch ends, seconds from the beginning.
    duration_s: f64,
}

impl Motion {
    /// Derives a flight from its plan.
    ///
    /// # Errors
    /// When the plan holds what no fixed wing flies.
    pub fn new(plan: MotionPlan) -> Result<Self, MotionError> {
        if plan.stretches.len() > STRETCHES_MAX {
            return Err(MotionError::TooMany(plan.stretches.len()));
        }
        for s in &plan.stretches {
            check(s.radius_mm, s.airspeed_mmps, true)?;
            if s.length_mm > LENGTH_MOST_MM {
                return Err(MotionError::Length(s.length_mm));
            }
        }
        let mut at = Pose {
            east_m: f64::from(plan.east_mm) / 1e3,
            north_m: f64::from(plan.north_mm) / 1e3,
            heading_rad: f64::from(plan.heading_e7) / HEADING_PARTS,
        };
        let mut pieces = Vec::with_capacity(plan.stretches.len() + 1);
        let mut from_s = 0.0;
        for s in &plan.stretches {
            let segment = Segment {
                start: at,
                curvature_per_m: curvature_per_m(s.radius_mm),
                length_m: f64::from(s.length_mm) / 1e3,
            };
            let airspeed_mps = f64::from(s.airspeed_mmps) / 1e3;
            let until_s = from_s + segment.length_m / airspeed_mps;
            pieces.push(Piece {
                segment,
                airspeed_mps,
                until_s,
                from_s,
            });
            at = segment.end();
            from_s = until_s;
        }
        if let End::Loiter {
            radius_mm,
            airspeed_mmps,
        } = plan.end
        {
            check(radius_mm, airspeed_mmps, false)?;
            pieces.push(Piece {
                segment: Segment {
                    start: at,
                    curvature_per_m: curvature_per_m(radius_mm),
                    length_m: f64::INFINITY,
                },
                airspeed_mps: f64::from(airspeed_mmps) / 1e3,
                until_s: f64::INFINITY,
                from_s,
            });
        }
        Ok(Self {
            plan,
            pieces,
            duration_s: from_s,
        })
    }

    /// The plan it was derived from.
    #[must_use]
    pub fn plan(&self) -> &MotionPlan {
        &self.plan
    }

    /// When its last stretch ends and the loiter begins, seconds of the clock that all
    /// share.
    #[must_use]
    pub fn ends_at_s(&self) -> f64 {
        self.start_s() + self.duration_s
    }

    /// When it begins, seconds of the clock that all share.
    #[must_use]
    pub fn start_s(&self) -> f64 {
        seconds(self.plan.start_ms)
    }

    /// The circle in which it ends, 1/m, positive to the left; `None` where it leaves.
    #[must_use]
    pub fn loiter_per_m(&self) -> Option<f64> {
        match self.plan.end {
            End::Loiter { radius_mm, .. } => Some(curvature_per_m(radius_mm)),
            End::Leaves => None,
        }
    }

    /// Whether it has left the airspace at this time.
    #[must_use]
    pub fn has_left(&self, at_ms: u64) -> bool {
        self.plan.end == End::Leaves && seconds(at_ms) >= self.ends_at_s()
    }

    /// Where it is at a time, the wind not counted; before its beginning there, and after
    /// it has left where it left.
    #[must_use]
    pub fn pose_at(&self, at_ms: u64) -> Pose {
        let at_s = (seconds(at_ms) - self.start_s()).max(0.0);
        match self.piece_at(at_s) {
            Some(piece) => piece.pose_at(at_s),
            None => self.last(),
        }
    }

    fn last(&self) -> Pose {
        self.pieces.last().map_or(
            Pose {
                east_m: f64::from(self.plan.east_mm) / 1e3,
                north_m: f64::from(self.plan.north_mm) / 1e3,
                heading_rad: f64::from(self.plan.heading_e7) / HEADING_PARTS,
            },
            |p| p.segment.end(),
        )
    }

    fn piece_at(&self, at_s: f64) -> Option<&Piece> {
        self.pieces.iter().find(|p| at_s < p.until_s)
    }

    pub(super) fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Airspeed and turn rate from a time on, as (for how many seconds, m/s, rad/s), at most
    /// `horizon_s` of them.
    #[must_use]
    pub fn steering_from(&self, at_ms: u64, horizon_s: f64) -> Vec<(f64, f64, f64)> {
        let at_s = (seconds(at_ms) - self.start_s()).max(0.0);
        let ahead = self.pieces.iter().filter(|p| p.until_s > at_s);
        let mut steering = Vec::new();
        for p in ahead {
            let from_s = p.from_s.max(at_s);
            if from_s >= at_s + horizon_s {
                break;
            }
            let lasts_s = p.until_s.min(at_s + horizon_s) - from_s;
            let rate_radps = p.segment.curvature_per_m * p.airspeed_mps;
            steering.push((lasts_s, p.airspeed_mps, rate_radps));
        }
        steering
    }

    /// The plan that flies as this one from `now_ms` until `branch_ms`, and then something
    /// else. The beginning is rounded anew, so it may lie a millimetre beside this flight.
    #[must_use]
    pub fn branched(&self, now_ms: u64, branch_ms: u64, then: &[Stretch], end: End) -> MotionPlan {
        let start = self.pose_at(now_ms);
        let (now_s, branch_s) = (
            seconds(now_ms) - self.start_s(),
            seconds(branch_ms) - self.start_s(),
        );
        let mut stretches: Vec<Stretch> = self
            .pieces
            .iter()
            .filter(|p| p.until_s > now_s && p.from_s < branch_s)
            .map(|p| {
                let flown_s = p.until_s.min(branch_s) - p.from_s.max(now_s);
                Stretch {
                    radius_mm: radius_mm(p.segment.curvature_per_m),
                    length_mm: to_mm(flown_s * p.airspeed_mps),
                    airspeed_mmps: to_mm(p.airspeed_mps),
                }
            })
            .collect();
        stretches.extend_from_slice(then);
        stretches.retain(|s| s.length_mm > 0);
        MotionPlan {
            start_ms: now_ms,
            east_mm: to_signed_mm(start.east_m),
            north_mm: to_signed_mm(start.north_m),
            heading_e7: heading_e7(start.heading_rad),
            stretches,
            end,
        }
    }

    /// How near it comes to a place from a time on, metres, to within a tenth of a second of
    /// flight; one round of the loiter counts for all.
    #[must_use]
    pub fn nearest_to_m(&self, place: Point, from_ms: u64) -> f64 {
        const STEP_MS: usize = 200;
        let round_s = match (self.plan.end, self.pieces.last()) {
            (End::Loiter { .. }, Some(p)) => {
                core::f64::consts::TAU / (p.segment.curvature_per_m.abs() * p.airspeed_mps)
            }
            _ => 0.0,
        };
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "flights of some minutes"
        )]
        let until_ms = ((self.ends_at_s() + round_s) * 1e3) as u64;
        let fastest = self.pieces.iter().map(|p| p.airspeed_mps);
        let stray_m = fastest.fold(0.0, f64::max) * 1e-3 * STEP_MS as f64 / 2.0;
        (from_ms..=until_ms.max(from_ms))
            .step_by(STEP_MS)
            .map(|at_ms| (self.pose_at(at_ms).position() - place).norm() - stray_m)
            .fold(f64::INFINITY, f64::min)
    }

    /// The centre and radius of a disc in which it stays from a time on, metres.
    #[must_use]
    pub fn extent_from(&self, at_ms: u64) -> (Point, f64) {
        let centre = self.pose_at(at_ms).position();
        let at_s = seconds(at_ms) - self.start_s();
        let left_m: f64 = self
            .pieces
            .iter()
            .filter(|p| p.until_s > at_s && p.until_s.is_finite())
            .map(|p| (p.until_s - p.from_s.max(at_s)) * p.airspeed_mps)
            .sum();
        let loiter_m = match self.plan.end {
            End::Loiter { radius_mm, .. } => 2.0 * f64::from(radius_mm.unsigned_abs()) / 1e3,
            End::Leaves => 0.0,
        };
        (centre, left_m + loiter_m)
    }
}

fn check(radius_mm: i32, airspeed_mmps: u32, may_be_straight: bool) -> Result<(), MotionError> {
    let straight = radius_mm == 0 && may_be_straight;
    if !straight && radius_mm.unsigned_abs() < RADIUS_LEAST_MM {
        return Err(MotionError::Radius(radius_mm));
    }
    if !(AIRSPEED_LEAST_MMPS..=AIRSPEED_MOST_MMPS).contains(&airspeed_mmps) {
        return Err(MotionError::Airspeed(airspeed_mmps));
    }
    Ok(())
}

fn curvature_per_m(radius_mm: i32) -> f64 {
    if radius_mm == 0 {
        0.0
    } else {
        1e3 / f64::from(radius_mm)
    }
}

/// The radius of a curvature, millimetres with its sign; 0 for a straight line.
#[must_use]
pub fn radius_mm(curvature_per_m: f64) -> i32 {
    if curvature_per_m == 0.0 {
        0
    } else {
        to_signed_mm(1.0 / curvature_per_m)
    }
}

/// Metres to whole millimetres; what is negative or no number is 0.
#[must_use]
pub fn to_mm(metres: f64) -> u32 {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "float to integer casts saturate, and no number gives 0"
    )]
    let mm = (metres * 1e3).round() as u32;
    mm
}

/// Metres to whole millimetres with their sign.
#[must_use]
pub fn to_signed_mm(metres: f64) -> i32 {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "float to integer casts saturate"
    )]
    let mm = (metres * 1e3).round() as i32;
    mm
}

/// A heading in 1e-7 rad, within half a turn either way.
#[must_use]
pub fn heading_e7(heading_rad: f64) -> i32 {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "half a turn is far below the limit"
    )]
    let e7 = (wrap_pi(heading_rad) * HEADING_PARTS).round() as i32;
    e7
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan() -> MotionPlan {
        MotionPlan {
            start_ms: 5_000,
            east_mm: 10_000,
            north_mm: -20_000,
            heading_e7: 0,
            stretches: vec![
                Stretch {
                    radius_mm: 0,
                    length_mm: 100_000,
                    airspeed_mmps: 20_000,
                },
                Stretch {
                    radius_mm: 50_000,
                    length_mm: 80_000,
                    airspeed_mmps: 16_000,
                },
            ],
            end: End::Loiter {
                radius_mm: -70_000,
                airspeed_mmps: 20_000,
            },
        }
    }

    #[test]
    fn stretches_are_flown_in_order_and_then_the_loiter() {
        let m = Motion::new(plan()).unwrap();
        assert!((m.ends_at_s() - 15.0).abs() < 1e-9);
        assert!((m.pose_at(7_000).east_m - 50.0).abs() < 1e-9);
        let round_ms = 2.0 * std::f64::consts::PI * 70.0 / 20.0 * 1e3;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let later = m.pose_at(20_000 + round_ms.round() as u64);
        let once = m.pose_at(20_000);
        assert!((later.position() - once.position()).norm() < 0.02);
        assert!(!m.has_left(1_000_000));
    }

    #[test]
    fn a_branch_flies_on_and_then_turns_off() {
        let m = Motion::new(plan()).unwrap();
        let then = [Stretch {
            radius_mm: 0,
            length_mm: 300_000,
            airspeed_mmps: 20_000,
        }];
        for branch_ms in [7_000, 12_000, 21_000] {
            let b = Motion::new(m.branched(6_000, branch_ms, &then, End::Leaves)).unwrap();
            for at_ms in (6_000..=branch_ms).step_by(100) {
                let apart = m.pose_at(at_ms).position() - b.pose_at(at_ms).position();
                assert!(apart.norm() < 3e-3, "{branch_ms} {at_ms}: {apart}");
            }
            let branch_s = seconds(branch_ms);
            assert!((b.ends_at_s() - branch_s - 15.0).abs() < 1e-3);
            assert!(b.has_left(branch_ms + 15_002));
        }
    }

    #[test]
    fn what_no_fixed_wing_flies_is_refused() {
        let refused = |change: &dyn Fn(&mut MotionPlan)| {
            let mut p = plan();
            change(&mut p);
            Motion::new(p).unwrap_err()
        };
        assert_eq!(
            refused(&|p| p.stretches[1].radius_mm = 5),
            MotionError::Radius(5)
        );
        assert_eq!(
            refused(&|p| p.stretches[0].airspeed_mmps = 0),
            MotionError::Airspeed(0)
        );
        assert_eq!(
            refused(&|p| p.stretches = vec![p.stretches[0]; STRETCHES_MAX + 1]),
            MotionError::TooMany(STRETCHES_MAX + 1)
        );
        assert_eq!(
            refused(&|p| p.stretches[0].length_mm = u32::MAX),
            MotionError::Length(u32::MAX)
        );
        let no_circle = End::Loiter {
            radius_mm: 0,
            airspeed_mmps: 20_000,
        };
        assert_eq!(refused(&|p| p.end = no_circle), MotionError::Radius(0));
    }
}
