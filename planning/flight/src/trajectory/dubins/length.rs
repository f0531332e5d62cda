//! The length of the shortest Dubins curve alone, fast (D2.7 §2.4.1).
//!
//! The start is moved to the origin heading along +x and lengths are divided by
//! the turn radius; every word is then a formula in the goal's place and turn.
//! LSL and RSR turn by as much as the headings differ, plus a full circle unless
//! the straight's course lies between them: a sign test, no angle. LSR and RSL
//! need one angle each, LRL and RLR one, and only when their circles are near.
//! The curves themselves are made by the parent module from the same quantities.

use skein_geometry::frame::Pose;
use skein_geometry::math::kernels::{angle_tau, near_pi, near_sin_cos, sin_cos};
use skein_geometry::math::{PI, TAU, wrap_tau};

/// How far from the goal a curve may end, as a share of the coordinates or the
/// radius: rounding of the input reaches 1e-15 of them, the promise is 1e-12.
pub(super) const SNAP: f64 = 2e-13;

/// Goals solved side by side.
const LANES: usize = 8;

/// Headings beyond this are taken modulo 2π before anything else, radians.
const LARGEST_RAD: f64 = 1e5;

/// A goal seen from the start, in turn radii.
#[derive(Clone, Copy, Debug)]
pub struct Goal {
    /// Ahead.
    pub x: f64,
    /// To the left.
    pub y: f64,
    /// How much further left the goal's heading points, radians in [0, 2π).
    pub turn: f64,
    /// Sine of `turn`.
    pub sin: f64,
    /// Cosine of `turn`.
    pub cos: f64,
    /// What counts as no distance.
    pub tol: f64,
}

/// The start's part of the change to a [`Goal`].
#[derive(Clone, Copy)]
struct Frame {
    east_m: f64,
    north_m: f64,
    heading_rad: f64,
    sin: f64,
    cos: f64,
    per_radius: f64,
    size: f64,
}

impl Frame {
    fn of(from: Pose, radius_m: f64) -> Self {
        let heading_rad = tame(from.heading_rad);
        let (sin, cos) = sin_cos(heading_rad);
        let per_radius = 1.0 / radius_m;
        Self {
            east_m: from.east_m,
            north_m: from.north_m,
            heading_rad,
            sin,
            cos,
            per_radius,
            size: 1.0 + (from.east_m.abs() + from.north_m.abs()) * per_radius,
        }
    }

    #[inline(always)]
    fn goal(&self, east_m: f64, north_m: f64, heading_rad: f64) -> Goal {
        let e = (east_m - self.east_m) * self.per_radius;
        let n = (north_m - self.north_m) * self.per_radius;
        let turn = near_pi(heading_rad - self.heading_rad);
        let (sin, cos) = near_sin_cos(turn);
        let turned = if turn < -SNAP { turn + TAU } else { turn };
        Goal {
            x: e * self.cos + n * self.sin,
            y: n * self.cos - e * self.sin,
            turn: if turned < 0.0 { 0.0 } else { turned },
            sin,
            cos,
            tol: SNAP * (self.size + e.abs() + n.abs()),
        }
    }
}

/// A heading small enough for exact reduction.
#[inline(always)]
fn tame(heading_rad: f64) -> f64 {
    if heading_rad.abs() > LARGEST_RAD {
        wrap_tau(heading_rad)
    } else {
        heading_rad
    }
}

impl Goal {
    /// The goal seen from `from`.
    pub fn new(from: Pose, to: Pose, radius_m: f64) -> Self {
        Frame::of(from, radius_m).goal(to.east_m, to.north_m, tame(to.heading_rad))
    }

    /// The goal seen in a mirror that swaps left and right.
    #[inline(always)]
    pub fn mirrored(&self) -> Self {
        // A turn of nothing stays nothing.
        let turn = if self.turn > 0.0 {
            TAU - self.turn
        } else {
            0.0
        };
        Self {
            y: -self.y,
            turn: if turn > TAU - SNAP { 0.0 } else { turn },
            sin: -self.sin,
            ..*self
        }
    }

    /// From the start's left centre to the goal's left centre.
    #[inline(always)]
    pub fn left_left(&self) -> (f64, f64) {
        (self.x - self.sin, self.y + self.cos - 1.0)
    }

    /// From the start's left centre to the goal's right centre.
    #[inline(always)]
    pub fn left_right(&self) -> (f64, f64) {
        (self.x + self.sin, self.y - self.cos - 1.0)
    }

    /// Whether the direction `v` is met when turning left by `turn` onto the
    /// direction `(cos, sin)`, give or take `tol` at the start and at the end.
    #[inline(always)]
    fn meets(v: (f64, f64), turn: f64, (sin, cos): (f64, f64), tol: (f64, f64)) -> bool {
        let after_start = v.1 >= -tol.0;
        let before_end = v.0 * sin - v.1 * cos >= -tol.1;
        let not_behind = v.0 * (1.0 + cos) + v.1 * sin >= -tol.0;
        if turn <= PI {
            after_start & before_end & not_behind
        } else {
            after_start | before_end
        }
    }

    /// LSL.
    #[inline(always)]
    pub fn same(&self) -> f64 {
        let v = self.left_left();
        let straight = (v.0 * v.0 + v.1 * v.1).sqrt();
        // A last turn left out turns the goal itself, a first one the straight.
        let tol = (self.tol, self.tol * least(straight, 1.0));
        let met = Self::meets(v, self.turn, (self.sin, self.cos), tol);
        let circle = if met | (straight <= self.tol) {
            0.0
        } else {
            TAU
        };
        straight + self.turn + circle
    }

    /// LSR; infinite where the circles overlap.
    #[inline(always)]
    pub fn cross(&self) -> f64 {
        let v = self.left_right();
        let square = v.0 * v.0 + v.1 * v.1;
        let gap = square - 4.0;
        let straight = (if gap > 0.0 { gap } else { 0.0 }).sqrt();
        let out = angle_tau(2.0 * v.0 + v.1 * straight, v.0 * straight - 2.0 * v.1);
        let out = if out > TAU - self.tol { 0.0 } else { out };
        let back = out - self.turn;
        let back = if back < -self.tol { back + TAU } else { back };
        let length = straight + out + (if back < 0.0 { 0.0 } else { back });
        if gap >= -4.0 * self.tol {
            length
        } else {
            f64::INFINITY
        }
    }

    /// LRL with the middle turn above a half circle; infinite where the circles
    /// are too far apart, or one and the same.
    pub fn three(&self) -> f64 {
        let v = self.left_left();
        let apart = (v.0 * v.0 + v.1 * v.1).sqrt();
        if apart > 4.0 || apart <= self.tol {
            return f64::INFINITY;
        }
        let cos = apart / 4.0;
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let middle = PI + 2.0 * angle_tau(sin, cos);
        // The heading at the first switch is a quarter turn left of the middle centre.
        let (x, y) = (v.0 / apart, v.1 / apart);
        let switch = (-(x * sin + y * cos), x * cos - y * sin);
        // Both left turns together make up for the right turn between them.
        let (sin_m, cos_m) = (-2.0 * sin * cos, 2.0 * sin * sin - 1.0);
        let end = (
            self.sin * cos_m + self.cos * sin_m,
            self.cos * cos_m - self.sin * sin_m,
        );
        let both = self.turn + middle;
        let both = if both >= TAU - self.tol {
            both - TAU
        } else {
            both
        };
        let both = if both < 0.0 { 0.0 } else { both };
        let circle = if Self::meets(switch, both, end, (self.tol, self.tol)) {
            0.0
        } else {
            TAU
        };
        middle + both + circle
    }

    /// The shortest of the four words with a straight.
    #[inline(always)]
    fn with_straight(&self) -> f64 {
        let m = self.mirrored();
        least(least(self.same(), m.same()), least(self.cross(), m.cross()))
    }

    /// The shorter of the two words without a straight.
    fn without_straight(&self) -> f64 {
        least(self.three(), self.mirrored().three())
    }

    /// Whether a word without a straight can be the shortest: beyond 4 radii it
    /// never is (Shkel and Lumelsky, 2001).
    #[inline(always)]
    fn near(&self) -> bool {
        self.x * self.x + self.y * self.y <= 16.001
    }

    /// The shortest of all; infinite when something is not a number.
    #[inline(always)]
    pub fn shortest(&self) -> f64 {
        self.finish(self.with_straight())
    }

    /// The shortest of all, given the best with a straight.
    #[inline(always)]
    pub fn finish(&self, best: f64) -> f64 {
        // A middle turn alone is longer than a half circle.
        if self.near() && best > PI {
            least(self.without_straight(), best)
        } else {
            least(best, f64::INFINITY)
        }
    }
}

/// The smaller; the other one where one is not a number.
#[inline(always)]
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// Length of the shortest Dubins curve, metres; infinite when a coordinate is
/// not a number.
#[must_use]
pub fn length_m(from: Pose, to: Pose, radius_m: f64) -> f64 {
    Goal::new(from, to, radius_m).shortest() * radius_m
}

/// [`length_m`] from one start to many goals, to the same bits: `out_m[i]` is
/// the length to `to[i]`; the longer of the two slices is used as far as the
/// shorter goes.
pub fn lengths_m(from: Pose, to: &[Pose], radius_m: f64, out_m: &mut [f64]) {
    let frame = Frame::of(from, radius_m);
    let whole = to.len().min(out_m.len());
    for (goals, out) in to[..whole]
        .chunks(LANES)
        .zip(out_m[..whole].chunks_mut(LANES))
    {
        let mut east = [0.0; LANES];
        let mut north = [0.0; LANES];
        let mut heading = [0.0; LANES];
        for (i, g) in goals.iter().enumerate() {
            east[i] = g.east_m;
            north[i] = g.north_m;
            heading[i] = tame(g.heading_rad);
        }
        let mut best = [0.0; LANES];
        for i in 0..LANES {
            best[i] = frame.goal(east[i], north[i], heading[i]).with_straight();
        }
        for (i, o) in out.iter_mut().enumerate() {
            let (e, n) = (east[i] - from.east_m, north[i] - from.north_m);
            // A little more than what counts as near: only those are seen again.
            let length = if e * e + n * n <= 17.0 * radius_m * radius_m {
                let goal = frame.goal(east[i], north[i], heading[i]);
                goal.finish(best[i])
            } else {
                least(best[i], f64::INFINITY)
            };
            *o = length * radius_m;
        }
    }
}
