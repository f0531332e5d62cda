//! Lower bounds of one leg over an interval of headings at either end.
//!
//! A waypoint's incoming and outgoing leg each choose a heading within the same
//! interval, not the same heading; what that relaxation gives away is taken back
//! to first order by a slope: the incoming leg pays `−λ(θ−c)`, the outgoing one
//! `+λ(θ−c)`, which cancel wherever both agree.
//!
//! A word with a straight is, for any fixed direction, at least its share in that
//! direction plus its turns: a sum of one function a heading whose second derivative
//! is the sine of the turn. Its tangent plane at the middle is a bound wherever the
//! turns are below a half circle, and falls short by no more than the sines allow
//! elsewhere. Turns are continued through zero: a word that would need a full circle
//! there is only longer. Where it does, the word ends: a clip, one linear condition
//! that must hold for the plane to count, takes away what the plane gives too much
//! beyond. Words without a straight have tangent planes and clips, too.

use super::interval;
use super::plane::{NOWHERE, Plane};
use super::words::{Reach, cross, same, three, three_short};
use skein_flight::trajectory::dubins::length::Goal;
use skein_geometry::frame::Vector;
use skein_geometry::math::TAU;
use skein_geometry::math::kernels::near_pi;

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
        let (sin, cos) = skein_geometry::math::kernels::sin_cos(mid_rad);
        Self {
            mid_rad,
            half_rad,
            sin,
            cos,
            parent,
        }
    }
}

/// A bound further below the length at the middle than this slope times the half
/// widths is doubtful: no word with a straight is steeper than 2.
const DOUBTFUL: f64 = 2.0;

/// A clip may make any slope of a word's plane; beyond this, that of a word with a
/// straight, it fits no other leg.
const STEEPEST: f64 = 2.0;

/// One leg between two intervals, in turn radii.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leg {
    planes: [Plane; 8],
    /// Length of the shortest curve between the middles.
    pub length: f64,
    /// What is known without planes, when the air drifts.
    pub slice: Option<Slice>,
}

/// Times between which planes hold.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slice {
    /// No pair of headings arrives before.
    pub from: f64,
    /// What arrives later is not bounded by a plane.
    pub until: f64,
}

/// The air's drift while a leg is flown; one turn radius and one radian's time.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Drift {
    /// The air's velocity in airspeeds.
    pub wind: Vector,
    /// Where the goal is looked at, and how much earlier or later it may be met.
    pub moment: f64,
    pub spread: f64,
}

impl Leg {
    /// A leg that no heading flies.
    pub fn nowhere() -> Self {
        Self {
            planes: [NOWHERE; 8],
            length: f64::INFINITY,
            slice: None,
        }
    }

    /// The leg that goes by `v` turn radii from `a` to `b`.
    pub fn new(v: Vector, a: &Arc, b: &Arc) -> Self {
        Self::drifting(v, a, b, &Drift::default())
    }

    /// The leg to a goal that lies by `v` at the drift's moment.
    pub fn drifting(v: Vector, a: &Arc, b: &Arc, drift: &Drift) -> Self {
        let turn = near_pi(b.mid_rad - a.mid_rad);
        let seen = |v: Vector| (v.x * a.cos + v.y * a.sin, v.y * a.cos - v.x * a.sin);
        let (x, y) = seen(v);
        let goal = Goal {
            x,
            y,
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
            moment: drift.moment,
            drift: drift.spread * drift.wind.norm(),
            wind: seen(drift.wind),
            from: drift.moment - drift.spread,
        };
        let back = reach.mirrored();
        let flip = |(p, l): (Plane, f64)| (p.mirrored(), l);
        let words = [
            same(&goal, reach),
            flip(same(&mirror, back)),
            cross(&goal, reach),
            flip(cross(&mirror, back)),
        ];
        let mut planes = [NOWHERE; 8];
        let mut length = f64::INFINITY;
        for (plane, word) in planes.iter_mut().zip(words) {
            *plane = word.0;
            length = length.min(word.1);
        }
        // Beyond 4 radii the shortest has a straight.
        if reach.nearest() <= 4.0 {
            let other = if drift.spread > 0.0 {
                f64::INFINITY
            } else {
                length
            };
            for (plane, word) in planes[4..].iter_mut().zip([
                three(&goal, reach, other),
                flip(three(&mirror, back, other)),
            ]) {
                *plane = word.0;
                length = length.min(word.1);
            }
        }
        if drift.spread > 0.0 {
            planes[6] = three_short(&goal, reach);
            planes[7] = three_short(&mirror, back).mirrored();
        }
        Self {
            planes,
            length,
            slice: None,
        }
    }

    /// The planes there are: middle turns below a half circle are in drifting air only.
    fn known(&self) -> &[Plane] {
        &self.planes[..if self.slice.is_some() { 8 } else { 6 }]
    }

    /// The least over all planes, no slopes paid.
    pub fn least(&self, a: &Arc, b: &Arc) -> f64 {
        let h = (a.half_rad, b.half_rad);
        self.known()
            .iter()
            .fold(f64::INFINITY, |l, p| l.min(p.least(h, (0.0, 0.0)).0))
    }

    /// The bound with only the first slope paid, and the last slope that would
    /// take nothing away from it.
    pub fn open_bound(&self, a: &Arc, slope_a: f64) -> (f64, f64) {
        let h = (a.half_rad, 0.0);
        self.known().iter().fold((f64::INFINITY, 0.0), |least, p| {
            let (low, share) = p.least(h, (slope_a, p.last));
            if low < least.0 {
                let slope = p.last - share * p.clip.last;
                let bent = slope.clamp(-STEEPEST, STEEPEST);
                (low, if share > 0.0 { bent } else { slope })
            } else {
                least
            }
        })
    }

    /// No pair of headings in the two intervals has a shorter curve, slopes paid.
    ///
    /// Far below the middle's length, where a word may begin or end within the
    /// intervals, the exact optimum without slopes may say more.
    pub fn bound(&self, v: Vector, a: &Arc, slope_a: f64, b: &Arc, slope_b: f64) -> f64 {
        let h = (a.half_rad, b.half_rad);
        let planes = self.known().iter().fold(f64::INFINITY, |least, p| {
            least.min(p.least(h, (slope_a, slope_b)).0)
        });
        let paid = slope_a.abs() * a.half_rad + slope_b.abs() * b.half_rad;
        if let Some(slice) = &self.slice {
            return planes.min(slice.until - paid).max(slice.from - paid);
        }
        if planes > self.length - DOUBTFUL * (a.half_rad + b.half_rad) {
            return planes;
        }
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
        for p in self.known() {
            let (low, share) = p.least(wide, (a.1, b.1));
            if low < least.0 {
                let loss = (
                    (p.first + a.1 - share * p.clip.first).abs() * wide.0,
                    (p.last - b.1 - share * p.clip.last).abs() * wide.1,
                );
                least = (low, loss);
            }
        }
        if least.0 < bound {
            return (a.1.abs() * wide.0, b.1.abs() * wide.1);
        }
        least.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::headings::air::Air;
    use proptest::prelude::*;
    use skein_flight::trajectory::dubins::length_m;
    use skein_geometry::frame::{Point, Pose};

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
        fn no_flight_in_wind_beats_the_bound(
            x in -6.0f64..6.0, y in -6.0f64..6.0, near in 0usize..2, a in 0.0f64..6.3, b in 0.0f64..6.3,
            width in 0.0f64..0.25, ratio in 0.0f64..1.5, slopes in prop::array::uniform2(-2.0f64..2.0),
            share in 0.0f64..0.6, course in 0.0f64..6.3,
        ) {
            const STEPS: i32 = 8;
            let v = Vector::new(x, y) * [1.0, 0.35][near];
            let air = Air { wind: Some(Vector::new(skein_geometry::math::cos(course), skein_geometry::math::sin(course)) * share) };
            let (a, b) = (Arc::new(a, width, 0), Arc::new(b, width * ratio, 0));
            let mut least = f64::INFINITY;
            for i in -STEPS..=STEPS {
                for j in -STEPS..=STEPS {
                    let x = a.half_rad * f64::from(i) / f64::from(STEPS);
                    let y = b.half_rad * f64::from(j) / f64::from(STEPS);
                    least = least.min(air.cost(v, a.mid_rad + x, b.mid_rad + y) + slopes[0] * x - slopes[1] * y);
                }
            }
            let bound = air.leg(v, &a, &b).bound(v, &a, slopes[0], &b, slopes[1]);
            prop_assert!(bound <= least + 1e-7, "{bound} {least}");
        }

        #[test]
        fn the_bound_of_a_long_leg_is_of_second_order(
            course in 0.0f64..6.3, a in 0.0f64..6.3, b in 0.0f64..6.3, width in 0.001f64..0.02,
        ) {
            let v = Vector::new(9.0 * skein_geometry::math::cos(course), 9.0 * skein_geometry::math::sin(course));
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
