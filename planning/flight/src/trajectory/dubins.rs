//! The shortest curve of bounded curvature between two poses (D2.7 §2.4.1).
//!
//! A word is three pieces out of L (left), R (right) and S (straight): LSL, RSR,
//! LSR, RSL, LRL, RLR. Each is built from the centres of its turning circles, so
//! the formulas are those of tangent lines and of a circle touching two others.
//!
//! Dubins, "On curves of minimal length with a constraint on average curvature", 1957,
//! <https://doi.org/10.2307/2372560>.

pub mod length;

pub use length::{length_m, lengths_m};

use length::Goal;
use skein_geometry::frame::Pose;
use skein_geometry::math::kernels::angle_tau;
use skein_geometry::math::{FRAC_PI_2, PI, TAU};
use skein_geometry::{Curve, Segment};

/// The shortest Dubins curve from `from` to `to` with turns of `radius_m`.
///
/// # Guarantees
/// Ends at `to` within 1e-12 of the largest of the coordinates and the radius,
/// and within 1e-12 rad. Turns that only rounding makes are left out, so that a
/// goal straight ahead is one straight. Empty when the poses coincide.
#[must_use]
pub fn shortest(from: Pose, to: Pose, radius_m: f64) -> Curve {
    let goal = Goal::new(from, to, radius_m);
    let best = words(&goal)
        .into_iter()
        .flatten()
        .min_by(|a, b| a.length().total_cmp(&b.length()));
    best.map_or_else(Curve::empty, |word| word.curve(from, radius_m, goal.tol))
}

/// All Dubins words that exist between two poses, shortest first (ties by word).
///
/// LRL and RLR come in two forms each, with the middle circle on either side of
/// the line of centres: the second is never the shortest, but may be clear of a
/// zone where the first is not.
#[must_use]
pub fn all(from: Pose, to: Pose, radius_m: f64) -> Vec<Curve> {
    let goal = Goal::new(from, to, radius_m);
    let mut found: Vec<Word> = words(&goal).into_iter().flatten().collect();
    found.sort_by(|a, b| a.length().total_cmp(&b.length()));
    found
        .into_iter()
        .map(|word| word.curve(from, radius_m, goal.tol))
        .collect()
}

/// Three pieces: which way each bends (1 left, 0 straight, −1 right), and how
/// long it is in turn radii.
#[derive(Clone, Copy, Debug)]
struct Word {
    bends: [f64; 3],
    lengths: [f64; 3],
}

impl Word {
    fn length(&self) -> f64 {
        self.lengths[0] + self.lengths[1] + self.lengths[2]
    }

    /// The same word seen in a mirror.
    fn mirrored(self) -> Self {
        Self {
            bends: self.bends.map(|b| -b),
            ..self
        }
    }

    fn curve(&self, from: Pose, radius_m: f64, tol: f64) -> Curve {
        let mut curve = Curve::empty();
        let mut start = from;
        for (bend, length) in self.bends.iter().zip(self.lengths) {
            if length > tol {
                let piece = Segment {
                    start,
                    curvature_per_m: bend / radius_m,
                    length_m: length * radius_m,
                };
                start = piece.end();
                curve.push(piece);
            }
        }
        curve
    }
}

/// The words in a fixed order: LSL, RSR, LSR, RSL, LRL, RLR in both forms.
fn words(goal: &Goal) -> [Option<Word>; 8] {
    let mirror = goal.mirrored();
    let flip = |word: Option<Word>| word.map(Word::mirrored);
    [
        Some(same(goal)),
        Some(same(&mirror).mirrored()),
        cross(goal),
        flip(cross(&mirror)),
        three(goal, 1.0),
        three(goal, -1.0),
        flip(three(&mirror, 1.0)),
        flip(three(&mirror, -1.0)),
    ]
}

/// LSL, which always exists.
fn same(goal: &Goal) -> Word {
    let v = goal.left_left();
    let straight = (v.0 * v.0 + v.1 * v.1).sqrt();
    let (out, straight) = if straight <= goal.tol {
        (0.0, 0.0)
    } else {
        (turn(angle_tau(v.1, v.0), goal.tol / straight), straight)
    };
    Word {
        bends: [1.0, 0.0, 1.0],
        lengths: [
            out,
            straight,
            turn(goal.turn - out, goal.tol / straight.max(1.0)),
        ],
    }
}

/// LSR, where the circles do not overlap.
fn cross(goal: &Goal) -> Option<Word> {
    let v = goal.left_right();
    let gap = v.0 * v.0 + v.1 * v.1 - 4.0;
    if gap < -4.0 * goal.tol {
        return None;
    }
    let straight = gap.max(0.0).sqrt();
    let course = angle_tau(2.0 * v.0 + v.1 * straight, v.0 * straight - 2.0 * v.1);
    let out = turn(course, goal.tol);
    Some(Word {
        bends: [1.0, 0.0, -1.0],
        lengths: [out, straight, turn(out - goal.turn, goal.tol)],
    })
}

/// LRL with the middle circle to the right of the line of centres for `fold` 1
/// (middle turn above a half circle) and to its left for −1.
fn three(goal: &Goal, fold: f64) -> Option<Word> {
    let v = goal.left_left();
    let apart = (v.0 * v.0 + v.1 * v.1).sqrt();
    if apart > 4.0 || apart <= goal.tol {
        return None;
    }
    let cos = apart / 4.0;
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let lean = fold * angle_tau(sin, cos);
    let out = turn(angle_tau(v.1, v.0) + lean + FRAC_PI_2, goal.tol);
    let middle = PI + 2.0 * lean;
    Some(Word {
        bends: [1.0, -1.0, 1.0],
        lengths: [out, middle, turn(goal.turn - out + middle, goal.tol)],
    })
}

/// An angle to turn, in [0, 2π), without full turns that are only rounding.
fn turn(a_rad: f64, tol: f64) -> f64 {
    let mut t = a_rad;
    // Sums of three angles of a circle are at most two circles off.
    for _ in 0..2 {
        t += if t < -tol { TAU } else { 0.0 };
        t -= if t > TAU - tol { TAU } else { 0.0 };
    }
    t.max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use skein_geometry::math::{acos, atan2, cos, sin, wrap_pi, wrap_tau};

    fn pose(east_m: f64, north_m: f64, heading_rad: f64) -> Pose {
        Pose {
            east_m,
            north_m,
            heading_rad,
        }
    }

    fn scale(from: Pose, to: Pose, r: f64) -> f64 {
        [from.east_m, from.north_m, to.east_m, to.north_m]
            .iter()
            .fold(r, |s, c| s.max(c.abs()))
    }

    fn ends_at(curve: &Curve, from: Pose, to: Pose, r: f64) -> bool {
        let end = curve.end().unwrap_or(from);
        (end.position() - to.position()).norm() < 2e-12 * scale(from, to, r)
            && wrap_pi(end.heading_rad - to.heading_rad).abs() < 2e-12
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
        assert!(
            ends_at(&c, pose(0.0, 0.0, FRAC_PI_2), back, 10.0) && c.length_m() > TAU * 10.0 - 1.0
        );
        let c = shortest(pose(0.0, 0.0, 0.0), pose(0.0, 20.0, PI), 10.0);
        assert!((c.length_m() - 10.0 * PI).abs() < 1e-6, "{c:?}");
        let c = shortest(pose(0.0, 0.0, 0.0), pose(0.0, 0.0, PI), 10.0);
        assert!(
            (c.length_m() - 10.0 * PI * 7.0 / 3.0).abs() < 1e-6,
            "{}",
            c.length_m()
        );
    }

    #[test]
    fn on_circle_goals_are_one_arc() {
        for k in 1..32 {
            let turned = f64::from(k) * TAU / 32.0;
            for side in [1.0, -1.0] {
                let from = pose(7000.0, -3000.0, 0.3);
                let arc = Segment {
                    start: from,
                    curvature_per_m: side / 50.0,
                    length_m: 50.0 * turned,
                };
                let found = shortest(from, arc.end(), 50.0);
                assert!(found.length_m() <= 50.0 * turned + 1e-9, "{k} {found:?}");
                assert!(ends_at(&found, from, arc.end(), 50.0));
                assert!((length_m(from, arc.end(), 50.0) - found.length_m()).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn what_is_no_number_has_no_length() {
        let at = pose(0.0, 0.0, 0.0);
        for bad in [f64::NAN, f64::INFINITY, 1e300] {
            assert!(length_m(at, pose(bad, 0.0, 0.0), 1.0) >= 1e299);
            assert!(length_m(at, pose(0.0, 1.0, f64::NAN), 1.0).is_infinite());
            let _ = all(at, pose(bad, bad, bad), 1.0);
            let _ = shortest(at, pose(1.0, 0.0, 0.0), bad);
        }
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
                prop_assert!(ends_at(c, from, to, r), "{c:?}");
                prop_assert!(c.max_curvature_per_m() <= 1.0 / r + 1e-12 && c.largest_gap_m() < 1e-9);
            }
            prop_assert!(found.windows(2).all(|w| w[0].length_m() <= w[1].length_m() + 1e-9));
            let textbook = textbook_lengths(from, to, r).into_iter().fold(f64::INFINITY, f64::min);
            prop_assert!((found[0].length_m() - textbook).abs() < 1e-10, "{} {textbook}", found[0].length_m());
            prop_assert_eq!(&shortest(from, to, r), &found[0]);
        }

        #[test]
        fn length_alone_is_the_length_of_the_shortest_to_the_same_bits_in_any_batch(
            goals in prop::collection::vec((-8.0f64..8.0, -8.0f64..8.0, -7.0f64..7.0), 1..20), a in -4.0f64..4.0,
        ) {
            let from = pose(100.0, -50.0, a);
            let goals: Vec<Pose> = goals.iter().map(|g| pose(100.0 + g.0, g.1 - 50.0, g.2)).collect();
            let mut batch = vec![0.0; goals.len()];
            lengths_m(from, &goals, 1.5, &mut batch);
            for (to, length) in goals.iter().zip(batch) {
                prop_assert_eq!(length_m(from, *to, 1.5).to_bits(), length.to_bits());
                prop_assert!((shortest(from, *to, 1.5).length_m() - length).abs() < 1e-10);
            }
        }

        #[test]
        fn degenerate_goals_on_a_lattice_are_met_as_short_as_any_neighbour_allows(
            i in -8i32..=8, j in -8i32..=8, a in 0i32..16, b in 0i32..16, r in 0usize..3,
            noise in prop::array::uniform3(-1e-16f64..1e-16), far in 0usize..2,
        ) {
            let r = [1.0, 0.5, 2.0][r];
            let angle = |k: i32| f64::from(k) * PI / 8.0;
            let base = [0.0, 8000.0][far];
            let from = pose(base, -base, angle(a));
            let to = pose(base + f64::from(i) / 2.0, f64::from(j) / 2.0 - base, angle(b));
            let noisy = pose(to.east_m + noise[0], to.north_m + noise[1], to.heading_rad + TAU + noise[2]);
            let best = shortest(from, to, r);
            prop_assert!(ends_at(&best, from, to, r), "{best:?}");
            prop_assert!((length_m(from, to, r) - best.length_m()).abs() < 1e-8, "{} {best:?}", length_m(from, to, r));
            prop_assert!((length_m(from, noisy, r) - best.length_m()).abs() < 1e-5);
            let textbook = textbook_lengths(from, to, r).into_iter().fold(f64::INFINITY, f64::min);
            // The textbook takes rounding for full circles; the other way round never happens.
            prop_assert!(best.length_m() <= textbook + 1e-8, "{} {textbook}", best.length_m());
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
            prop_assert!(best <= flown.length_m() + 1e-9, "{best} {}", flown.length_m());
        }
    }
}
