//! Whether two motions keep apart, in continuous time and for ever.
//!
//! While both fly straight their nearest moment is a quadratic. Where one turns, time
//! advances by as much as their distance surely lasts: the distance less what is needed,
//! over the speed at which it can shrink at most. Once both loiter it is a closed form.
//!
//! # Guarantees
//! What is said to keep apart does so at every moment from the given one on: in the least
//! step of time two UAVs approach by less than [`SLACK_M`], which is asked for on top.
//!
//! # Complexity
//! O(stretches) where both fly straight; in turns some steps for every halving of the
//! distance, none shorter than 0.4 m of approach.

use super::motion::{End, Motion, Piece};
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::seconds;

/// Time advances by at least as much as two UAVs need to approach by this, metres.
const LEAST_STEP_M: f64 = 0.4;

/// What two UAVs are asked to keep on top, metres: half of the least step, from either of
/// its ends, and the rounding of motions that are branched.
pub const SLACK_M: f64 = 0.25;

/// A piece that ends within this is over, seconds: the clock's sums round by less.
const OVER_S: f64 = 1e-9;

/// Turn rates that differ by less are the same for a day of loitering, rad/s.
const SAME_RATE_RADPS: f64 = 1e-9;

/// The first moment from `from_ms` on at which two motions are nearer to each other than
/// `least_m` metres, in seconds of the clock that all share; `None` if they never are. Where one
/// turns it may come later by what two UAVs take to approach by the least step less the slack.
///
/// For two loiters of unlike turn rates the nearest of all phases counts, whether or not
/// they meet in them.
#[must_use]
pub fn first_loss_s(a: &Motion, b: &Motion, from_ms: u64, least_m: f64) -> Option<f64> {
    let least_m = least_m + SLACK_M;
    let mut pair = Pair {
        a: Walk::new(a, from_ms),
        b: Walk::new(b, from_ms),
    };
    let mut at_s = seconds(from_ms);
    loop {
        let (pa, pb) = (pair.a.piece(at_s)?, pair.b.piece(at_s)?);
        let (until_a, until_b) = (pair.a.base_s + pa.until_s, pair.b.base_s + pb.until_s);
        let until_s = until_a.min(until_b);
        if until_s == f64::INFINITY {
            let nearest_m = nearest_of_loiters_m(pa, pb, pair.phase_gap(at_s));
            return (nearest_m < least_m).then_some(at_s);
        }
        let apart = pair.b.at(pb, at_s) - pair.a.at(pa, at_s);
        let apart_m = apart.norm();
        if apart_m < least_m {
            return Some(at_s);
        }
        if pa.is_straight() && pb.is_straight() {
            let closing = velocity(pb) - velocity(pa);
            let lasts_s = until_s - at_s;
            if let Some(after_s) = first_within(apart, closing, least_m, lasts_s) {
                return Some(at_s + after_s);
            }
            at_s = until_s;
            continue;
        }
        let fastest_mps = pa.airspeed_mps + pb.airspeed_mps;
        let sure_s = (apart_m - least_m).max(LEAST_STEP_M) / fastest_mps;
        at_s = (at_s + sure_s).min(until_s);
    }
}

/// Two motions side by side.
struct Pair<'a> {
    a: Walk<'a>,
    b: Walk<'a>,
}

impl Pair<'_> {
    /// Centre to centre, and the difference of what turns about them, at a time.
    fn phase_gap(&self, at_s: f64) -> impl Fn(&Piece, &Piece) -> Option<(Vector, Vector)> {
        let (a_s, b_s) = (at_s - self.a.base_s, at_s - self.b.base_s);
        move |pa: &Piece, pb: &Piece| {
            let (ca, cb) = (pa.segment.centre()?, pb.segment.centre()?);
            let ra = pa.pose_at(a_s).position() - ca;
            let rb = pb.pose_at(b_s).position() - cb;
            Some((cb - ca, rb - ra))
        }
    }
}

/// A motion asked for times that grow.
struct Walk<'a> {
    pieces: &'a [Piece],
    /// The clock at its beginning, seconds.
    base_s: f64,
    nth: usize,
    leaves: bool,
}

impl<'a> Walk<'a> {
    fn new(motion: &'a Motion, from_ms: u64) -> Self {
        // A motion that has not begun is at its beginning: time is counted from there.
        debug_assert!(motion.plan().start_ms <= from_ms, "asked before it begins");
        Self {
            pieces: motion.pieces(),
            base_s: motion.start_s(),
            nth: 0,
            leaves: motion.plan().end == End::Leaves,
        }
    }

    /// The piece that is flown at a time; `None` once it has left.
    fn piece(&mut self, at_s: f64) -> Option<&'a Piece> {
        while let Some(p) = self.pieces.get(self.nth) {
            if at_s - self.base_s < p.until_s - OVER_S {
                return Some(p);
            }
            self.nth += 1;
        }
        debug_assert!(self.leaves, "a loiter lasts for ever");
        None
    }

    fn at(&self, piece: &Piece, at_s: f64) -> Point {
        piece.pose_at(at_s - self.base_s).position()
    }
}

fn velocity(p: &Piece) -> Vector {
    p.segment.start.direction() * p.airspeed_mps
}

/// After how many seconds, at most `lasts_s`, what is `apart` and moves at `closing` is
/// within `least_m`.
fn first_within(apart: Vector, closing: Vector, least_m: f64, lasts_s: f64) -> Option<f64> {
    let (aa, ab, bb) = (
        closing.norm_squared(),
        apart.dot(&closing),
        apart.norm_squared() - least_m * least_m,
    );
    if ab >= 0.0 {
        return None;
    }
    let root = ab * ab - aa * bb;
    if root < 0.0 {
        return None;
    }
    let after_s = bb / (root.sqrt() - ab);
    (after_s < lasts_s).then_some(after_s)
}

/// The least distance of two circles flown for ever, metres.
fn nearest_of_loiters_m(
    a: &Piece,
    b: &Piece,
    gap: impl Fn(&Piece, &Piece) -> Option<(Vector, Vector)>,
) -> f64 {
    let Some((centres, turning)) = gap(a, b) else {
        return 0.0;
    };
    let rate = |p: &Piece| p.segment.curvature_per_m * p.airspeed_mps;
    if (rate(a) - rate(b)).abs() < SAME_RATE_RADPS {
        return (centres.norm() - turning.norm()).abs();
    }
    let radius_m = |p: &Piece| 1.0 / p.segment.curvature_per_m.abs();
    let (ra, rb, c) = (radius_m(a), radius_m(b), centres.norm());
    (c - ra - rb).max((ra - rb).abs() - c).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::super::motion::{MotionPlan, Stretch};
    use super::*;
    use proptest::prelude::*;

    fn motion(
        (east_m, north_m, heading_rad): (f64, f64, f64),
        legs: &[(i32, u32, u32)],
        end: End,
    ) -> Motion {
        use super::super::motion::{heading_e7, to_signed_mm};
        Motion::new(MotionPlan {
            start_ms: 0,
            east_mm: to_signed_mm(east_m),
            north_mm: to_signed_mm(north_m),
            heading_e7: heading_e7(heading_rad),
            stretches: legs
                .iter()
                .map(|(radius_m, length_m, mps)| Stretch {
                    radius_mm: radius_m * 1000,
                    length_mm: length_m * 1000,
                    airspeed_mmps: mps * 1000,
                })
                .collect(),
            end,
        })
        .unwrap()
    }

    const LOITER: End = End::Loiter {
        radius_mm: -70_600,
        airspeed_mmps: 20_000,
    };

    #[test]
    fn head_on_is_found_when_it_happens() {
        let a = motion((0.0, 0.0, 0.0), &[(0, 1000, 20)], End::Leaves);
        let b = motion(
            (1000.0, 0.0, std::f64::consts::PI),
            &[(0, 1000, 20)],
            End::Leaves,
        );
        let at_s = first_loss_s(&a, &b, 0, 50.0).unwrap();
        assert!((at_s - (1000.0 - 50.25) / 40.0).abs() < 1e-3, "{at_s}");
        let c = motion(
            (1000.0, 51.0, std::f64::consts::PI),
            &[(0, 1000, 20)],
            End::Leaves,
        );
        assert_eq!(first_loss_s(&a, &c, 0, 50.0), None);
    }

    #[test]
    fn loiters_in_step_may_overlap() {
        let a = motion((0.0, 0.0, 0.0), &[], LOITER);
        let beside = motion((0.0, 60.0, 0.0), &[], LOITER);
        assert_eq!(first_loss_s(&a, &beside, 0, 50.0), None);
        let out_of_step = motion((0.0, 60.0, 1.0), &[], LOITER);
        assert!(first_loss_s(&a, &out_of_step, 0, 50.0).is_some());
    }

    /// The slowest two of these motions together, m/s.
    const SLOWEST_MPS: f64 = 30.0;

    fn any_motion() -> impl Strategy<Value = Motion> {
        let leg = (
            prop::sample::select(vec![0, 71, -71, 150, -200]),
            10_u32..400,
            15_u32..26,
        );
        let pose = (-400.0..400.0, -400.0..400.0, -3.1..3.1);
        (pose, prop::collection::vec(leg, 0..5), any::<bool>()).prop_map(|(p, legs, leaves)| {
            motion(p, &legs, if leaves { End::Leaves } else { LOITER })
        })
    }

    proptest! {
        #[test]
        fn dense_samples_agree(a in any_motion(), b in any_motion()) {
            let loss = first_loss_s(&a, &b, 0, 50.0);
            let mut sampled = None;
            for at_ms in (0..300_000).step_by(20) {
                if a.has_left(at_ms) || b.has_left(at_ms) {
                    break;
                }
                let apart = a.pose_at(at_ms).position() - b.pose_at(at_ms).position();
                if apart.norm() < 50.0 {
                    sampled = Some(seconds(at_ms));
                    break;
                }
            }
            match (loss, sampled) {
                (None, Some(at)) => prop_assert!(false, "missed at {at}"),
                (Some(l), Some(s)) => {
                    let late_s = (LEAST_STEP_M - SLACK_M) / SLOWEST_MPS;
                    prop_assert!(l <= s + late_s, "found {l} after {s}");
                }
                _ => {}
            }
        }
    }
}
