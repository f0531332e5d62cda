//! The Dubins interval problem: the shortest curve that leaves with a heading out
//! of one interval and arrives with a heading out of another.
//!
//! On a shortest curve each end is where nothing is gained by turning it: either
//! the heading is at the edge towards which its turn would shrink, or the end is
//! free and lies on the line that carries the straight or the two switches of
//! turns (the adjoint of the heading vanishes there). So with a first turn to the
//! left the candidates are LSL, LSR and LRL between edges; LS, and LR with a second
//! turn above a half circle, from an edge to a free end; S, and one turn of at
//! least a half circle, free at both ends; and all of them mirrored and reversed
//! (Manyam, Rathinam, Casbeer and Garcia, 2017; Váňa and Faigl, 2018).

use super::leg::Arc;
use skein_flight::trajectory::dubins::length::Goal;
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::kernels::{angle_tau, near_pi, sin_cos};
use skein_geometry::math::{FRAC_PI_2, PI, TAU};

/// A free end this far outside its interval counts as inside, radians: too many
/// candidates only make the bound smaller.
const EDGE_RAD: f64 = 1e-9;

/// An interval problem in turn radii, seen with the goal ahead as it lies.
#[derive(Clone, Copy)]
struct Problem {
    v: Vector,
    /// Middle and half width of the first heading.
    first: (f64, f64),
    /// Middle and half width of the last heading.
    last: (f64, f64),
}

/// Length of the shortest curve by `v` turn radii between the two intervals.
pub(super) fn shortest(v: Vector, a: &Arc, b: &Arc) -> f64 {
    let p = Problem {
        v,
        first: (a.mid_rad, a.half_rad),
        last: (b.mid_rad, b.half_rad),
    };
    if v.norm_squared() < 1e-18 {
        return 0.0;
    }
    let m = p.mirrored();
    let (r, s) = (p.reversed(), m.reversed());
    let free = [p, m].map(|q| q.free_at_both());
    let fixed = [p, m].map(|q| q.between_edges());
    let half = [p, m, r, s].map(|q| q.edge_to_free());
    fixed
        .into_iter()
        .chain(half)
        .chain(free)
        .fold(f64::INFINITY, f64::min)
}

impl Problem {
    fn mirrored(&self) -> Self {
        Self {
            v: Vector::new(self.v.x, -self.v.y),
            first: (-self.first.0, self.first.1),
            last: (-self.last.0, self.last.1),
        }
    }

    fn reversed(&self) -> Self {
        Self {
            v: -self.v,
            first: (self.last.0 + PI, self.last.1),
            last: (self.first.0 + PI, self.first.1),
        }
    }

    fn arrives(&self, heading_rad: f64) -> bool {
        near_pi(heading_rad - self.last.0).abs() <= self.last.1 + EDGE_RAD
    }

    fn leaves(&self, heading_rad: f64) -> bool {
        near_pi(heading_rad - self.first.0).abs() <= self.first.1 + EDGE_RAD
    }

    /// LSL, LSR and LRL, each from the edges it shrinks towards.
    fn between_edges(&self) -> f64 {
        let from = Pose::new(Point::new(0.0, 0.0), self.first.0 + self.first.1);
        let to = |side: f64| {
            let heading = self.last.0 + side * self.last.1;
            Goal::new(
                from,
                Pose::new(Point::new(self.v.x, self.v.y), heading),
                1.0,
            )
        };
        let (right, left) = (to(-1.0), to(1.0));
        right.same().min(left.cross()).min(right.three())
    }

    /// LS and LR from the left edge to a free end.
    fn edge_to_free(&self) -> f64 {
        let start = self.first.0 + self.first.1;
        let (s, c) = sin_cos(start);
        let w = (self.v.x + s, self.v.y - c);
        let square = w.0 * w.0 + w.1 * w.1;
        let mut least = f64::INFINITY;
        let out = |course: f64| {
            let t = near_pi(course - start);
            if t < -EDGE_RAD { t + TAU } else { t.max(0.0) }
        };
        let bearing = angle_tau(w.1, w.0);
        if square >= 1.0 {
            let straight = (square - 1.0).sqrt();
            let course = bearing + angle_tau(1.0, straight);
            if self.arrives(course) {
                least = straight + out(course);
            }
        }
        let apart = square.sqrt();
        let cos = (square + 3.0) / (4.0 * apart);
        if cos <= 1.0 {
            let lean = angle_tau((1.0 - cos * cos).sqrt(), cos);
            for lean in [lean, -lean] {
                let towards = bearing + lean;
                let (s, c) = sin_cos(towards);
                let end = angle_tau(w.1 - 2.0 * s, w.0 - 2.0 * c);
                let back = near_pi(towards + PI - end);
                let back = if back < 0.0 { back + TAU } else { back };
                if self.arrives(towards + FRAC_PI_2 - back) {
                    least = least.min(out(towards + FRAC_PI_2) + back);
                }
            }
        }
        least
    }

    /// S, and one left turn of at least a half circle.
    fn free_at_both(&self) -> f64 {
        let distance = (self.v.x * self.v.x + self.v.y * self.v.y).sqrt();
        let bearing = angle_tau(self.v.y, self.v.x);
        if self.leaves(bearing) && self.arrives(bearing) {
            return distance;
        }
        let sin = distance / 2.0;
        if sin > 1.0 {
            return f64::INFINITY;
        }
        let half = PI - angle_tau(sin, (1.0 - sin * sin).sqrt());
        if self.leaves(bearing - half) && self.arrives(bearing + half) {
            return 2.0 * half;
        }
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use skein_flight::trajectory::dubins::length_m;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]
        #[test]
        fn the_interval_optimum_is_the_least_of_a_grid(
            x in -5.0f64..5.0, y in -5.0f64..5.0, near in 0usize..2, a in 0.0f64..6.3, b in 0.0f64..6.3,
            first in 0.0f64..1.5, last in 0.0f64..1.5,
        ) {
            const STEPS: i32 = 30;
            let v = Vector::new(x, y) * [1.0, 0.4][near];
            let found = shortest(v, &Arc::new(a, first, 0), &Arc::new(b, last, 0));
            let mut least = f64::INFINITY;
            for i in -STEPS..=STEPS {
                for j in -STEPS..=STEPS {
                    let share = |k: i32| f64::from(k) / f64::from(STEPS);
                    let from = Pose::new(Point::new(0.0, 0.0), a + first * share(i));
                    let to = Pose::new(Point::new(v.x, v.y), b + last * share(j));
                    least = least.min(length_m(from, to, 1.0));
                }
            }
            prop_assert!(found <= least + 1e-9, "{found} {least}");
            // A grid may miss a corner of the reachable set, hence only most of them are near.
            prop_assert!(found >= v.norm() - 1e-9);
            if v.norm() > 4.0 {
                prop_assert!(least <= found + 2.0 * (first + last) / f64::from(STEPS) + 1e-9, "{found} {least}");
            }
        }
    }
}
