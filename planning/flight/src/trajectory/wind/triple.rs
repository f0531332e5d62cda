//! LRL in wind (RLR when mirrored): three turns.
//!
//! Let v(T) = v₀ − wT lead from the left circle of the start to that of the goal.
//! With the middle turn β the centres are 4 sin(β/2) apart, and the path lasts
//! T = S + 2β with S = b + 2πk, the turns left less those right. So β solves
//!
//! h(β) = |v₀ − wS − 2wβ|² − 8 + 8 cos β = 0 on [0, 2π],
//!
//! a quadratic against a cosine. h″ = 8w² − 8 cos β changes sign where cos β = w²,
//! that is twice if w < 1 and never otherwise: on each of the three pieces h is
//! convex or concave, so it has at most two roots there, and tangents prove where it
//! has none. β below and above π are both in the range, and D ≤ 4 wherever h = 0.
//!
//! The first turn follows: t = (angle of v) + β/2, and the last is S + β − t.

use super::Word;
use super::problem::{Best, Problem};
use skein_geometry::math::{TAU, acos, atan2, sin_cos};

/// Values of h below this are rounding: centres at most a few radii apart.
const RESIDUAL: f64 = 4e-15;

/// Halvings or tangents spent on separating a double root: each at least halves the
/// doubt, and 60 exhaust the digits.
const SEPARATIONS: u8 = 60;

/// Newton steps; on a convex function they only approach, so these never run out
/// except at double roots, where each halves the distance.
const NEWTON_STEPS: u8 = 60;

/// The function whose roots are sought.
#[derive(Clone, Copy, Debug)]
struct Gap {
    a: f64,
    b: f64,
    c: f64,
    /// 1 where h is convex, −1 where it is concave, so that this is convex.
    sign: f64,
}

/// Its value and slope at a middle turn.
#[derive(Clone, Copy, Debug)]
struct Point {
    beta: f64,
    value: f64,
    slope: f64,
}

impl Gap {
    fn at(&self, beta: f64) -> Point {
        let (s, c) = sin_cos(beta);
        Point {
            beta,
            value: self.sign * (self.a + beta * (self.b + beta * self.c) - 8.0 + 8.0 * c),
            slope: self.sign * (self.b + 2.0 * self.c * beta - 8.0 * s),
        }
    }

    /// The roots of a convex function between two points, earliest first.
    fn roots(&self, low: Point, high: Point) -> [Option<f64>; 2] {
        let at_edge = |p: &Point| p.value.abs() <= RESIDUAL * 16.0;
        match (low.value > 0.0, high.value > 0.0) {
            (true, false) => [Some(self.newton(low)), None],
            (false, true) => [at_edge(&low).then_some(low.beta), Some(self.newton(high))],
            (false, false) => [
                at_edge(&low).then_some(low.beta),
                at_edge(&high).then_some(high.beta),
            ],
            (true, true) => match self.below(low, high) {
                Some(_) => [Some(self.newton(low)), Some(self.newton(high))],
                None => [
                    at_edge(&low).then_some(low.beta),
                    at_edge(&high).then_some(high.beta),
                ],
            },
        }
    }

    /// A point where a convex function that is positive at both ends is not, or none
    /// if tangents prove that it is positive.
    fn below(&self, mut low: Point, mut high: Point) -> Option<Point> {
        for _ in 0..SEPARATIONS {
            if low.slope >= 0.0 || high.slope <= 0.0 {
                return None;
            }
            // The tangents meet here, below the function.
            let meet = (high.value - low.value + low.slope * low.beta - high.slope * high.beta)
                / (low.slope - high.slope);
            if low.value + low.slope * (meet - low.beta) > 0.0 {
                return None;
            }
            let middle = self.at(meet.clamp(low.beta, high.beta));
            if middle.value <= 0.0 {
                return Some(middle);
            }
            if middle.slope < 0.0 {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(low)
    }

    /// From where a convex function is positive towards its next root.
    fn newton(&self, from: Point) -> f64 {
        let mut at = from;
        for _ in 0..NEWTON_STEPS {
            if at.value.abs() <= RESIDUAL {
                break;
            }
            let next = self.at(at.beta - at.value / at.slope);
            // Past the root by rounding alone, or at the bottom of a double root.
            if !next.value.is_finite() || next.value.abs() >= at.value.abs() {
                break;
            }
            at = next;
        }
        at.beta
    }
}

/// Looks for LRL paths that are faster than the best so far.
pub(super) fn search(problem: &Problem, word: Word, best: &mut Best) {
    let (vx, vy) = problem.left_left();
    let Some((enter, leave)) = near(problem, vx, vy) else {
        return;
    };
    let bend = if problem.ww < 1.0 {
        acos(problem.ww)
    } else {
        0.0
    };
    for turns in [-1.0, 0.0, 1.0] {
        let sum = problem.b + turns * TAU;
        let low = (-sum)
            .max(0.5 * (enter.max(problem.earliest) - sum))
            .max(0.0);
        let high = (0.5 * (leave.min(best.time) - sum)).min(TAU);
        if low < high {
            winding(problem, word, sum, (low, high), bend, best);
        }
    }
}

/// When the circles are near enough for a third between them: D ≤ 4.
fn near(problem: &Problem, vx: f64, vy: f64) -> Option<(f64, f64)> {
    let along = vx * problem.wx + vy * problem.wy;
    let square = vx * vx + vy * vy - 16.0;
    if problem.ww <= 1e-30 {
        return (square <= 0.0).then_some((0.0, f64::INFINITY));
    }
    let disc = along * along - problem.ww * square;
    if disc < 0.0 {
        return None;
    }
    let root = disc.sqrt();
    let leave = (along + root) / problem.ww;
    (leave >= 0.0).then_some(((along - root) / problem.ww, leave))
}

/// One winding number: the middle turn between `low` and `high`.
fn winding(
    problem: &Problem,
    word: Word,
    sum: f64,
    (low, high): (f64, f64),
    bend: f64,
    best: &mut Best,
) {
    let (vx, vy) = problem.left_left();
    let (vx, vy) = (vx - problem.wx * sum, vy - problem.wy * sum);
    let mut gap = Gap {
        a: vx * vx + vy * vy,
        b: -4.0 * (vx * problem.wx + vy * problem.wy),
        c: 4.0 * problem.ww,
        sign: 1.0,
    };
    let mut from = gap.at(low);
    for (until, sign) in [(bend, -1.0), (TAU - bend, 1.0), (TAU, -1.0)] {
        let until = until.min(high);
        if until <= from.beta {
            continue;
        }
        gap.sign = sign;
        let to = gap.at(until);
        let start = Point {
            value: from.value * sign,
            slope: from.slope * sign,
            ..from
        };
        for beta in gap.roots(start, to).into_iter().flatten() {
            let time = sum + 2.0 * beta;
            if time >= best.time {
                return;
            }
            let (dx, dy) = (vx - 2.0 * problem.wx * beta, vy - 2.0 * problem.wy * beta);
            let angle = atan2(dy, dx) + 0.5 * beta;
            let apart = skein_geometry::math::hypot(dx, dy);
            if let Some((t, q)) = problem.split(angle, sum + beta, apart) {
                *best = Best {
                    time,
                    word,
                    pieces: [t, beta, q],
                };
                return;
            }
        }
        from = Point {
            value: to.value * sign,
            slope: to.slope * sign,
            ..to
        };
    }
}
