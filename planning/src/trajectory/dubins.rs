//! The shortest curve of bounded curvature between two poses (D2.7 §2.4.1).
//!
//! A word is three pieces out of L (left), R (right) and S (straight): LSL, RSR,
//! LSR, RSL, LRL, RLR. Each is built from the centres of its turning circles, so
//! the formulas are those of tangent lines and of a circle touching two others.

use super::Curve;
use crate::frame::{Point, Pose, Vector};
use crate::math::{FRAC_PI_2, PI, TAU, atan2, wrap_tau};

/// Centres nearer than this are one and the same, metres: the curve then misses
/// its end by no more, which is a hundredth of what a curve leaves out anyway.
const SAME_CENTRE_M: f64 = 1e-6;

/// A turn this little short of a full circle is rounding, radians.
const FULL_TURN_RAD: f64 = 1e-9;

/// The shortest Dubins curve from `from` to `to` with turns of `radius_m`.
///
/// # Guarantees
/// Ends within a tenth of a millimetre and 1e-5 rad of `to`: pieces shorter than
/// that are left out. Empty when the poses coincide.
#[must_use]
pub fn shortest(from: Pose, to: Pose, radius_m: f64) -> Curve {
    let best = words(from, to, radius_m)
        .into_iter()
        .flatten()
        .min_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or_else(Curve::empty, |(pieces, _)| {
        Curve::from_pieces(from, &pieces)
    })
}

/// Length of [`shortest`], metres, without making the curve.
#[must_use]
pub fn length_m(from: Pose, to: Pose, radius_m: f64) -> f64 {
    words(from, to, radius_m)
        .into_iter()
        .flatten()
        .map(|w| w.1)
        .fold(f64::INFINITY, f64::min)
}

/// All Dubins words that exist between two poses, shortest first (ties by word).
///
/// LRL and RLR come in two forms each, with the middle circle on either side of
/// the line of centres: the second is never the shortest, but may be clear of a
/// zone where the first is not.
#[must_use]
pub fn all(from: Pose, to: Pose, radius_m: f64) -> Vec<Curve> {
    let mut found: Vec<(Word, f64)> = words(from, to, radius_m).into_iter().flatten().collect();
    found.sort_by(|a, b| a.1.total_cmp(&b.1));
    found
        .into_iter()
        .map(|(pieces, _)| Curve::from_pieces(from, &pieces))
        .collect()
}

/// Three pieces as (curvature, length).
type Word = [(f64, f64); 3];

/// The words in a fixed order, each with its length.
fn words(from: Pose, to: Pose, r: f64) -> [Option<(Word, f64)>; 8] {
    let (a, b) = (from.heading_rad, to.heading_rad);
    let left = |p: Pose| centre(p, r);
    let right = |p: Pose| centre(p, -r);
    let made = |turns: [f64; 3], lengths: [f64; 3]| {
        let k = 1.0 / r;
        let word = [
            (turns[0] * k, lengths[0]),
            (turns[1] * k, lengths[1]),
            (turns[2] * k, lengths[2]),
        ];
        (word, lengths[0] + lengths[1] + lengths[2])
    };
    // Mirrored east-west axis: a right turn is a left turn with angles negated.
    let same = |side: f64, v: Vector| {
        let straight = v.norm();
        let (t, q) = if straight < SAME_CENTRE_M {
            (turn(side * (b - a)), 0.0)
        } else {
            let course = atan2(v.y, v.x);
            (turn(side * (course - a)), turn(side * (b - course)))
        };
        made([side, 0.0, side], [t * r, straight, q * r])
    };
    let cross = |side: f64, v: Vector| {
        let square = v.norm_squared() - 4.0 * r * r;
        // Circles that touch to rounding have a straight of length zero.
        if square < -SAME_CENTRE_M * r {
            return None;
        }
        let straight = square.max(0.0).sqrt();
        let course = atan2(v.y, v.x) + side * atan2(2.0 * r, straight);
        let (t, q) = (turn(side * (course - a)), turn(side * (course - b)));
        Some(made([side, 0.0, -side], [t * r, straight, q * r]))
    };
    let three = |side: f64, v: Vector, fold: f64| {
        let half = v.norm() / 2.0;
        if half > 2.0 * r || half < SAME_CENTRE_M {
            return None;
        }
        // Angle at the first centre between the line of centres and the middle circle.
        let lean = atan2((4.0 * r * r - half * half).max(0.0).sqrt(), half);
        let course = atan2(v.y, v.x);
        let (out, back) = (course + fold * lean, course + PI - fold * lean);
        let t = turn(side * (out + side * FRAC_PI_2 - a));
        let middle = turn(side * (out - back));
        let q = turn(side * (b - (back + side * FRAC_PI_2)));
        Some(made([side, -side, side], [t * r, middle * r, q * r]))
    };
    let (ll, rr) = (left(to) - left(from), right(to) - right(from));
    [
        Some(same(1.0, ll)),
        Some(same(-1.0, rr)),
        cross(1.0, right(to) - left(from)),
        cross(-1.0, left(to) - right(from)),
        three(1.0, ll, 1.0),
        three(1.0, ll, -1.0),
        three(-1.0, rr, 1.0),
        three(-1.0, rr, -1.0),
    ]
}

/// Centre of the circle that touches the pose, at its left for a positive radius.
fn centre(p: Pose, radius_m: f64) -> Point {
    let d = p.direction();
    Point::new(p.east_m - radius_m * d.y, p.north_m + radius_m * d.x)
}

/// An angle to turn, in [0, 2π), without full turns that are only rounding.
fn turn(a_rad: f64) -> f64 {
    let t = wrap_tau(a_rad);
    if t > TAU - FULL_TURN_RAD { 0.0 } else { t }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{acos, cos, sin, wrap_pi};
    use proptest::prelude::*;

    fn pose(east_m: f64, north_m: f64, heading_rad: f64) -> Pose {
        Pose {
            east_m,
            north_m,
            heading_rad,
        }
    }

    fn ends_at(curve: &Curve, from: Pose, to: Pose) -> bool {
        let end = curve.end().unwrap_or(from);
        (end.position() - to.position()).norm() < 2e-3
            && wrap_pi(end.heading_rad - to.heading_rad).abs() < 2e-4
    }

    /// Lengths of the six words by the textbook's normalised formulas.
    fn textbook_lengths(from: Pose, to: Pose, r: f64) -> Vec<f64> {
        let v = to.position() - from.position();
        let (d, theta) = (v.norm() / r, atan2(v.y, v.x));
        let (a, b) = (
            wrap_tau(from.heading_rad - theta),
            wrap_tau(to.heading_rad - theta),
        );
        let (sa, sb, ca, cb, cab) = (sin(a), sin(b), cos(a), cos(b), cos(a - b));
        let mut lengths = Vec::new();
        let mut csc = |square: f64, t: &dyn Fn(f64) -> f64, q: &dyn Fn(f64) -> f64| {
            if square >= 0.0 {
                let p = square.sqrt();
                lengths.push(r * (wrap_tau(t(p)) + p + wrap_tau(q(p))));
            }
        };
        let lsl = atan2(cb - ca, d + sa - sb);
        csc(
            2.0 + d * d - 2.0 * cab + 2.0 * d * (sa - sb),
            &|_| lsl - a,
            &|_| b - lsl,
        );
        let rsr = atan2(ca - cb, d - sa + sb);
        csc(
            2.0 + d * d - 2.0 * cab + 2.0 * d * (sb - sa),
            &|_| a - rsr,
            &|_| rsr - b,
        );
        let lsr = |p: f64| atan2(-ca - cb, d + sa + sb) - atan2(-2.0, p);
        csc(
            d * d - 2.0 + 2.0 * cab + 2.0 * d * (sa + sb),
            &|p| lsr(p) - a,
            &|p| lsr(p) - b,
        );
        let rsl = |p: f64| atan2(ca + cb, d - sa - sb) - atan2(2.0, p);
        csc(
            d * d - 2.0 + 2.0 * cab - 2.0 * d * (sa + sb),
            &|p| a - rsl(p),
            &|p| b - rsl(p),
        );
        let rlr = (6.0 - d * d + 2.0 * cab + 2.0 * d * (sa - sb)) / 8.0;
        if rlr.abs() <= 1.0 {
            let p = TAU - acos(rlr);
            let t = wrap_tau(a - rsr + p / 2.0);
            lengths.push(r * (t + p + wrap_tau(a - b - t + p)));
        }
        let lrl = (6.0 - d * d + 2.0 * cab + 2.0 * d * (sb - sa)) / 8.0;
        if lrl.abs() <= 1.0 {
            let p = TAU - acos(lrl);
            let t = wrap_tau(p / 2.0 - a + lsl);
            lengths.push(r * (t + p + wrap_tau(b - a - t + p)));
        }
        lengths
    }

    #[test]
    fn degenerate_cases() {
        let at = pose(3.0, -4.0, 1.25);
        assert!(shortest(at, at, 20.0).is_empty());
        let ahead = pose(3.0 + 50.0 * cos(1.25), -4.0 + 50.0 * sin(1.25), 1.25);
        let c = shortest(at, ahead, 20.0);
        assert!(
            (c.length_m() - 50.0).abs() < 1e-6 && c.segments().len() == 1,
            "{c:?}"
        );
        // Straight back costs a whole loop; abeam by 2r with equal heading does not.
        let back = pose(0.0, -1.0, FRAC_PI_2);
        let c = shortest(pose(0.0, 0.0, FRAC_PI_2), back, 10.0);
        assert!(ends_at(&c, at, back) && c.length_m() > TAU * 10.0 - 1.0);
        let c = shortest(pose(0.0, 0.0, 0.0), pose(0.0, 20.0, PI), 10.0);
        assert!((c.length_m() - 10.0 * PI).abs() < 1e-6, "{c:?}");
        let c = shortest(pose(0.0, 0.0, 0.0), pose(0.0, 0.0, PI), 10.0);
        assert!(
            (c.length_m() - 10.0 * PI * 7.0 / 3.0).abs() < 1e-6,
            "{}",
            c.length_m()
        );
    }

    proptest! {
        #[test]
        fn every_word_ends_at_the_goal_and_the_shortest_agrees_with_the_textbook(
            x in -120.0f64..120.0, y in -120.0f64..120.0, a in -4.0f64..4.0, b in -4.0f64..4.0,
            r in 5.0f64..40.0,
        ) {
            let (from, to) = (pose(10.0, 20.0, a), pose(10.0 + x, 20.0 + y, b));
            let found = all(from, to, r);
            prop_assert!(found.len() >= 2);
            for c in &found {
                prop_assert!(ends_at(c, from, to), "{c:?}");
                prop_assert!(c.max_curvature_per_m() <= 1.0 / r + 1e-12 && c.largest_gap_m() < 1e-9);
            }
            prop_assert!(found.windows(2).all(|w| w[0].length_m() <= w[1].length_m() + 1e-3));
            let textbook = textbook_lengths(from, to, r).into_iter().fold(f64::INFINITY, f64::min);
            prop_assert!((found[0].length_m() - textbook).abs() < 1e-3, "{} {textbook}", found[0].length_m());
            prop_assert_eq!(&shortest(from, to, r), &found[0]);
        }

        #[test]
        fn no_flown_word_is_shorter(
            a in -3.0f64..3.0, turns in prop::array::uniform3(0usize..3), parts in prop::array::uniform3(0.0f64..5.0),
        ) {
            // Any three pieces of bounded curvature are a candidate for the shortest.
            let from = pose(0.0, 0.0, a);
            let curvature = [0.05, 0.0, -0.05];
            let pieces: Vec<(f64, f64)> = (0..3).map(|i| (curvature[turns[i]], 20.0 * parts[i])).collect();
            let flown = Curve::from_pieces(from, &pieces);
            let to = flown.end().unwrap_or(from);
            let best = shortest(from, to, 20.0).length_m();
            prop_assert!(best <= flown.length_m() + 1e-3, "{best} {}", flown.length_m());
        }
    }
}
