//! Lower bounds of one leg over an interval of headings at either end.
//!
//! A waypoint's incoming and outgoing leg each choose a heading within the same
//! interval, not the same heading; what that relaxation gives away is taken back
//! to first order by a slope: the incoming leg pays `−λ(θ−c)`, the outgoing one
//! `+λ(θ−c)`, which cancel wherever both agree.
//!
//! For a word with a straight of length p > 0 and turns t, q the length has the
//! gradient ∓(1 − cos t), ±(1 − cos q) in the two headings and the Hessian
//! diag(sin t, sin q) + s sᵀ/p with s = (sin t, sin q). Turns up to a half circle
//! make it convex, so its tangent plane at the centre is a bound, and beyond a
//! half circle it falls below that plane by no more than the sines allow. Turns
//! are continued through zero: a word that would need a full circle there is only
//! longer. Where p may vanish, what the length is at least when circles touch or
//! coincide has a tangent plane; so do words without a straight.

use super::interval;
use crate::frame::Vector;
use crate::math::kernels::{angle_tau, near_pi};
use crate::math::{FRAC_PI_2, PI, TAU};
use crate::trajectory::dubins::length::Goal;

/// A heading interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arc {
    /// Middle, radians.
    pub mid_rad: f64,
    /// Half the width, radians.
    pub half_rad: f64,
    pub sin: f64,
    pub cos: f64,
    /// Which interval of the round before it is a part of.
    pub parent: usize,
}

impl Arc {
    pub fn new(mid_rad: f64, half_rad: f64, parent: usize) -> Self {
        let (sin, cos) = crate::math::kernels::sin_cos(mid_rad);
        Self {
            mid_rad,
            half_rad,
            sin,
            cos,
            parent,
        }
    }
}

/// A bound linear in the slopes: a word is nowhere shorter than
/// `low − |first + λ₁| h₁ − |last − λ₂| h₂` with the slopes paid.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Plane {
    low: f64,
    first: f64,
    last: f64,
}

const NOWHERE: Plane = Plane {
    low: f64::INFINITY,
    first: 0.0,
    last: 0.0,
};

/// A bound further below the length at the middle than this slope times the half
/// widths is doubtful: no word with a straight is steeper than 2.
const DOUBTFUL: f64 = 2.0;

/// Beyond this distance of the centres the middle turn of LRL is too steep for a
/// tangent plane; where they part, at 4, it is infinitely so.
const STEEP_APART: f64 = 3.95;

/// One leg between two intervals, in turn radii.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leg {
    planes: [Plane; 6],
    /// Length of the shortest curve between the middles.
    pub length: f64,
}

/// Half widths of both ends, and the distance of the two waypoints.
#[derive(Clone, Copy)]
struct Reach {
    first: f64,
    last: f64,
    distance: f64,
}

impl Leg {
    /// The leg that goes by `v` turn radii from `a` to `b`.
    pub fn new(v: Vector, a: &Arc, b: &Arc) -> Self {
        let turn = near_pi(b.mid_rad - a.mid_rad);
        let goal = Goal {
            x: v.x * a.cos + v.y * a.sin,
            y: v.y * a.cos - v.x * a.sin,
            turn: if turn < 0.0 { turn + TAU } else { turn },
            sin: b.sin * a.cos - b.cos * a.sin,
            cos: b.cos * a.cos + b.sin * a.sin,
            tol: 1e-12,
        };
        let mirror = goal.mirrored();
        let reach = Reach {
            first: a.half_rad,
            last: b.half_rad,
            distance: (v.x * v.x + v.y * v.y).sqrt(),
        };
        let flip = |(p, l): (Plane, f64)| {
            let flipped = Plane {
                first: -p.first,
                last: -p.last,
                ..p
            };
            (flipped, l)
        };
        let words = [
            same(&goal, reach),
            flip(same(&mirror, reach)),
            cross(&goal, reach),
            flip(cross(&mirror, reach)),
        ];
        let mut planes = [NOWHERE; 6];
        let mut length = f64::INFINITY;
        for (plane, word) in planes.iter_mut().zip(words) {
            *plane = word.0;
            length = length.min(word.1);
        }
        // Beyond 4 radii the shortest has a straight.
        if reach.distance <= 4.0 {
            for (plane, word) in planes[4..].iter_mut().zip([
                three(&goal, reach, length),
                flip(three(&mirror, reach, length)),
            ]) {
                *plane = word.0;
                length = length.min(word.1);
            }
        }
        Self { planes, length }
    }

    /// The bound with only the first slope paid, and the last slope that would
    /// take nothing away from it.
    pub fn open_bound(&self, a: &Arc, slope_a: f64) -> (f64, f64) {
        self.planes.iter().fold((f64::INFINITY, 0.0), |least, p| {
            let low = p.low - (p.first + slope_a).abs() * a.half_rad;
            if low < least.0 { (low, p.last) } else { least }
        })
    }

    /// No pair of headings in the two intervals has a shorter curve, slopes paid.
    ///
    /// Far below the middle's length, where a word may begin or end within the
    /// intervals, the exact optimum without slopes may say more.
    pub fn bound(&self, v: Vector, a: &Arc, slope_a: f64, b: &Arc, slope_b: f64) -> f64 {
        let planes = self.planes.iter().fold(f64::INFINITY, |least, p| {
            let low = p.low
                - (p.first + slope_a).abs() * a.half_rad
                - (p.last - slope_b).abs() * b.half_rad;
            least.min(low)
        });
        if planes > self.length - DOUBTFUL * (a.half_rad + b.half_rad) {
            return planes;
        }
        let paid = slope_a.abs() * a.half_rad + slope_b.abs() * b.half_rad;
        planes.max(interval::shortest(v, a, b) - paid)
    }

    /// How much of the bound's looseness narrower intervals at either end would
    /// take away: all that is known of it is where the slopes do not fit.
    pub fn looseness(&self, bound: f64, a: (&Arc, f64), b: (&Arc, f64)) -> (f64, f64) {
        let wide = (a.0.half_rad, b.0.half_rad);
        if bound < self.length - 2.0 * DOUBTFUL * (wide.0 + wide.1) {
            return (
                if wide.0 > 0.0 { f64::INFINITY } else { 0.0 },
                if wide.1 > 0.0 { f64::INFINITY } else { 0.0 },
            );
        }
        let mut least = (f64::INFINITY, (0.0, 0.0));
        for p in &self.planes {
            let loss = (
                (p.first + a.1).abs() * wide.0,
                (p.last - b.1).abs() * wide.1,
            );
            if p.low - loss.0 - loss.1 < least.0 {
                least = (p.low - loss.0 - loss.1, loss);
            }
        }
        if least.0 < bound {
            return (a.1.abs() * wide.0, b.1.abs() * wide.1);
        }
        least.1
    }
}

/// The turn nearest to `turn` that stays below a full circle when `reach` is added.
fn continued(turn: f64, reach: f64) -> f64 {
    if turn > TAU - reach { turn - TAU } else { turn }
}

/// How far below zero the sine of a turn may be within `reach` of `turn`.
fn dip(turn: f64, reach: f64) -> f64 {
    (reach - turn).max(turn + reach - PI).clamp(0.0, 1.0)
}

/// An angle of at most two circles, in [0, 2π).
fn wrapped(a_rad: f64) -> f64 {
    if a_rad < 0.0 { a_rad + TAU } else { a_rad }
}

/// The tangent plane of a word with a straight, and its length at the middle.
fn tangent(p: f64, turns: (f64, f64), slopes: (f64, f64), swing: f64, r: Reach) -> (Plane, f64) {
    let (near, far) = (r.first + swing, r.last + swing);
    let (t, q) = (continued(turns.0, near), continued(turns.1, far));
    let below = 0.5 * (dip(t, near) * r.first * r.first + dip(q, far) * r.last * r.last);
    let plane = Plane {
        low: p + t + q - below,
        first: slopes.0,
        last: slopes.1,
    };
    (plane, p + turns.0 + turns.1)
}

/// LSL.
fn same(goal: &Goal, r: Reach) -> (Plane, f64) {
    let v = goal.left_left();
    let p = (v.0 * v.0 + v.1 * v.1).sqrt();
    let moved = r.first + r.last;
    let t = angle_tau(v.1, v.0);
    let q = wrapped(goal.turn - t);
    // The centres move by `moved` at most, which turns the straight by asin(moved/p);
    // that is below 1.3 times its argument up to 0.9.
    if p * 0.9 > moved {
        let end = v.0 * goal.cos + v.1 * goal.sin;
        let slopes = (v.0 / p - 1.0, 1.0 - end / p);
        return tangent(p, (t, q), slopes, 1.3 * moved / p, r);
    }
    // Both turns together are the headings' difference, or a circle more.
    let plane = Plane {
        low: continued(goal.turn, moved),
        first: -1.0,
        last: 1.0,
    };
    let length = if p > goal.tol { p + t + q } else { goal.turn };
    (plane, length)
}

/// LSR.
fn cross(goal: &Goal, r: Reach) -> (Plane, f64) {
    let v = goal.left_right();
    let square = v.0 * v.0 + v.1 * v.1;
    let apart = square.sqrt();
    let moved = r.first + r.last;
    if apart + moved < 2.0 {
        return (NOWHERE, f64::INFINITY);
    }
    let p = (square - 4.0).max(0.0).sqrt();
    let course = (v.0 * p - 2.0 * v.1, 2.0 * v.0 + v.1 * p);
    let t = angle_tau(course.1, course.0);
    let q = wrapped(t - goal.turn);
    let nearest = apart - moved;
    let least = (nearest * nearest - 4.0).max(0.0).sqrt();
    if nearest > 2.0 && moved < least {
        let end = course.0 * goal.cos + course.1 * goal.sin;
        let slopes = (course.0 / square - 1.0, end / square - 1.0);
        return tangent(p, (t, q), slopes, moved / least, r);
    }
    let length = if square >= 4.0 {
        p + t + q
    } else {
        f64::INFINITY
    };
    let mut plane = Plane {
        low: r.distance,
        first: 0.0,
        last: 0.0,
    };
    if apart * 0.9 > moved {
        // p + 2 atan(2/p) is at least π, its value for circles that touch. What
        // remains is twice the angle of v less both headings, which bends by no
        // more than the circle's centres do, seen from the nearest they come.
        let swing = 1.3 * moved / apart;
        let t = angle_tau(v.0, -v.1);
        let q = wrapped(t - goal.turn);
        let touching = continued(t, r.first + swing) + continued(q, r.last + swing);
        let squares = r.first * r.first + r.last * r.last;
        let bend = squares / nearest + moved * moved / (nearest * nearest);
        plane = Plane {
            low: touching - bend,
            first: -2.0 * v.1 / square - 1.0,
            last: 2.0 * (v.0 * goal.sin - v.1 * goal.cos) / square - 1.0,
        };
    }
    (plane, length)
}

/// LRL with the middle turn above a half circle.
///
/// Its length is the headings' difference and twice the middle turn, which
/// depends on the distance of the centres alone. Not looked into where the middle
/// turn alone is longer than `other`.
fn three(goal: &Goal, r: Reach, other: f64) -> (Plane, f64) {
    let v = goal.left_left();
    let apart = (v.0 * v.0 + v.1 * v.1).sqrt();
    let moved = r.first + r.last;
    let (least, most) = (apart - moved, apart + moved);
    if least > 4.0 {
        return (NOWHERE, f64::INFINITY);
    }
    let flat = |low: f64| Plane {
        low: low.max(r.distance),
        ..Plane::default()
    };
    // The arc cosine lies above its chord.
    let middle = PI + PI * (1.0 - most / 4.0).max(0.0);
    if other <= middle {
        return (flat(middle), f64::INFINITY);
    }
    if apart * 0.9 <= moved {
        return (flat(middle), goal.three());
    }
    // The middle turn shrinks as the centres part.
    let lean = |d: f64| {
        let cos = d.clamp(0.0, 4.0) / 4.0;
        angle_tau((1.0 - cos * cos).sqrt(), cos)
    };
    let (low, mid, high) = (lean(most), lean(apart), lean(least));
    // Continued through zero, both outer turns follow the headings and the middle.
    let swing = 1.3 * moved / apart + (high - mid).max(mid - low);
    let out = angle_tau(v.1, v.0) + mid + FRAC_PI_2;
    let out = if out >= TAU { out - TAU } else { out };
    let middle = PI + 2.0 * mid;
    let back = goal.turn - out + middle;
    let back = wrapped(if back >= TAU { back - TAU } else { back });
    let (t, q) = (
        continued(out, r.first + swing),
        continued(back, r.last + swing),
    );
    let length = t + middle + q;
    let whole = if apart <= 4.0 {
        out + middle + back
    } else {
        f64::INFINITY
    };
    if most > STEEP_APART {
        return (flat(length - moved - 4.0 * (mid - low)), whole);
    }
    // The middle turn's first and second derivative in the distance, at its steepest.
    let root = |d: f64| (16.0 - d * d).sqrt();
    let steep = 2.0 / root(most);
    let bent = 2.0 * most / (root(most) * root(most) * root(most));
    let squares = r.first * r.first + r.last * r.last;
    let bend = bent * moved * moved + steep * (squares + moved * moved / least);
    let shrink = -4.0 / (root(apart) * apart);
    let plane = Plane {
        low: length - bend,
        first: shrink * v.0 - 1.0,
        last: 1.0 - shrink * (v.0 * goal.cos + v.1 * goal.sin),
    };
    (plane, whole)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::{Point, Pose};
    use crate::trajectory::dubins::length_m;
    use proptest::prelude::*;

    /// The least length over a grid of headings with slopes paid.
    fn brute(v: Vector, a: &Arc, sa: f64, b: &Arc, sb: f64) -> f64 {
        const STEPS: i32 = 16;
        let mut least = f64::INFINITY;
        for i in -STEPS..=STEPS {
            for j in -STEPS..=STEPS {
                let x = a.half_rad * f64::from(i) / f64::from(STEPS);
                let y = b.half_rad * f64::from(j) / f64::from(STEPS);
                let from = Pose::new(Point::new(0.0, 0.0), a.mid_rad + x);
                let to = Pose::new(Point::new(v.x, v.y), b.mid_rad + y);
                least = least.min(length_m(from, to, 1.0) + sa * x - sb * y);
            }
        }
        least
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(3_000))]
        #[test]
        fn no_heading_in_the_intervals_beats_the_bound(
            x in -6.0f64..6.0, y in -6.0f64..6.0, near in 0usize..2, a in 0.0f64..6.3, b in 0.0f64..6.3,
            width in 0.0f64..0.25, ratio in 0.0f64..1.5, slopes in prop::array::uniform2(-2.0f64..2.0),
        ) {
            let scale = [1.0, 0.35][near];
            let v = Vector::new(scale * x, scale * y);
            let (a, b) = (Arc::new(a, width, 0), Arc::new(b, width * ratio, 0));
            let leg = Leg::new(v, &a, &b);
            let to = Pose::new(Point::new(v.x, v.y), b.mid_rad);
            let middle = length_m(Pose::new(Point::new(0.0, 0.0), a.mid_rad), to, 1.0);
            prop_assert!((leg.length - middle).abs() < 1e-7, "{} {middle}", leg.length);
            let least = brute(v, &a, slopes[0], &b, slopes[1]);
            let bound = leg.bound(v, &a, slopes[0], &b, slopes[1]);
            prop_assert!(bound <= least + 1e-9, "{bound} {least}");
        }

        #[test]
        fn the_bound_of_a_long_leg_is_of_second_order(
            course in 0.0f64..6.3, a in 0.0f64..6.3, b in 0.0f64..6.3, width in 0.001f64..0.02,
        ) {
            let v = Vector::new(9.0 * crate::math::cos(course), 9.0 * crate::math::sin(course));
            let (p, q) = (Arc::new(a, width, 0), Arc::new(b, width, 0));
            let leg = Leg::new(v, &p, &q);
            let sharp = leg.planes.iter().find(|w| (w.low - leg.length).abs() < 1e-3);
            prop_assume!(sharp.is_some());
            let (first, last) = sharp.map_or((0.0, 0.0), |w| (w.first, w.last));
            let loss = brute(v, &p, -first, &q, last) - leg.bound(v, &p, -first, &q, last);
            prop_assert!(loss <= 8.0 * width * width + 1e-9, "{loss}");
        }
    }
}
