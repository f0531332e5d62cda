//! LSR in wind (RSL when mirrored): turns to different sides with a straight between.
//!
//! Let v(T) = v₀ − wT lead from the left circle of the start to the right circle of
//! the goal, D = |v|, p = √(D² − 4) the straight and θ its direction. For fixed
//! winding number k the path lasts L = p + 2θ − b + 2πk. The gradient of L by the
//! goal is the straight's unit vector u, so L′ = −w·u and F = L − T falls with a
//! slope in [−(1 + w), −(1 − w)] if w < 1. Moving the goal across the straight turns
//! it by 1/p, so L″ = (w × u)²/p ≥ 0: F is convex, whatever the wind.
//!
//! Where D ≥ 2 (at most two intervals of T) the direction θ stays within a half
//! plane, since it stands still when it lies along the wind; so it is unwound from
//! the interval's beginning without doubt. In a wind faster than the UAV each
//! interval is cut where F′ = 0, which is where u·w = −1: the tangent of a known
//! direction, so a linear equation for T. On each monotone piece the values at its
//! ends tell which winding numbers have a root there, and Newton's steps from the
//! end where F is above zero cannot leave the piece.

use super::Word;
use super::problem::{Best, Problem};
use skein_geometry::math::{TAU, atan2, wrap_tau};

/// Residuals below this are rounding of times of up to a thousand radians.
const RESIDUAL: f64 = 1e-13;

/// Steps of third order that are spent before bisection takes over: two to four do.
const QUICK_STEPS: u8 = 12;

/// Bisections that exhaust the digits of a time.
const SLOW_STEPS: u8 = 80;

/// F + 2πn at one time, with what its derivatives need.
#[derive(Clone, Copy, Debug)]
struct Sample {
    time: f64,
    /// Straight length.
    p: f64,
    /// v(T)·(p + 2i): direction of the straight, of length D².
    zx: f64,
    zy: f64,
    /// Direction of the straight less that at the interval's beginning.
    swept: f64,
    /// L for k = 0, less T.
    value: f64,
}

/// One interval of T with D ≥ 2.
struct Span<'a> {
    problem: &'a Problem,
    vx: f64,
    vy: f64,
    /// z at the beginning, and its angle in [0, 2π).
    base: (f64, f64),
    base_angle: f64,
}

impl Span<'_> {
    fn sample(&self, time: f64) -> Sample {
        let (vx, vy) = (
            self.vx - self.problem.wx * time,
            self.vy - self.problem.wy * time,
        );
        let p = (vx * vx + vy * vy - 4.0).max(0.0).sqrt();
        let (zx, zy) = (vx * p - 2.0 * vy, vy * p + 2.0 * vx);
        let (bx, by) = self.base;
        let swept = atan2(bx * zy - by * zx, bx * zx + by * zy);
        Sample {
            time,
            p,
            zx,
            zy,
            swept,
            value: p + 2.0 * (self.base_angle + swept) - self.problem.b - time,
        }
    }

    /// First and second derivative of F.
    fn slopes(&self, s: &Sample) -> (f64, f64) {
        let (wx, wy) = (self.problem.wx, self.problem.wy);
        // |z| = D² = p² + 4 wherever D ≥ 2.
        let size = s.p * s.p + 4.0;
        let along = (wx * s.zx + wy * s.zy) / size;
        let across = (wx * s.zy - wy * s.zx) / size;
        (-along - 1.0, across * across / s.p.max(1e-9))
    }

    /// The time in the monotone piece `low`..`high` at which the value is `target`.
    fn root(&self, low: &Sample, high: &Sample, target: f64) -> Sample {
        let falls = low.value >= high.value;
        let (mut above, mut below) = if falls {
            (low.time, high.time)
        } else {
            (high.time, low.time)
        };
        let mut at = if falls { *low } else { *high };
        for _ in 0..QUICK_STEPS {
            let f = at.value - target;
            if f.abs() <= RESIDUAL {
                return at;
            }
            if f > 0.0 {
                above = at.time;
            } else {
                below = at.time;
            }
            let (d1, d2) = self.slopes(&at);
            let halley = 2.0 * d1 * d1 - f * d2;
            let step = if halley > d1 * d1 {
                2.0 * f * d1 / halley
            } else {
                f / d1
            };
            let (a, b) = if above < below {
                (above, below)
            } else {
                (below, above)
            };
            let next = at.time - step;
            let next = if next > a && next < b {
                next
            } else {
                0.5 * (a + b)
            };
            if (next - at.time).abs() <= RESIDUAL * 1e-3 {
                return at;
            }
            at = self.sample(next);
        }
        for _ in 0..SLOW_STEPS {
            let f = at.value - target;
            if f.abs() <= RESIDUAL {
                break;
            }
            if f > 0.0 {
                above = at.time;
            } else {
                below = at.time;
            }
            at = self.sample(0.5 * (above + below));
        }
        at
    }

    /// Looks for roots in a monotone piece, earliest first.
    fn search(&self, low: &Sample, high: &Sample, word: Word, best: &mut Best) {
        let falls = low.value >= high.value;
        let (top, bottom) = if falls {
            (low.value, high.value)
        } else {
            (high.value, low.value)
        };
        let (first, last) = ((bottom / TAU).ceil(), (top / TAU).floor());
        let mut turn = if falls { last } else { first };
        while turn >= first && turn <= last {
            if self.may_wind(low, high, turn) {
                let found = self.root(low, high, turn * TAU);
                if found.time >= best.time {
                    return;
                }
                let theta = self.base_angle + found.swept;
                let sum = 2.0 * theta - self.problem.b - turn * TAU;
                if let Some((t, q)) = self.problem.split(theta, sum, found.p) {
                    *best = Best {
                        time: found.time,
                        word,
                        pieces: [t, found.p, q],
                    };
                    return;
                }
            }
            turn += if falls { -1.0 } else { 1.0 };
        }
    }

    /// Whether with the winding number −`turn` both turns can be in [0, 2π].
    ///
    /// Let t = θ + 2πj. With k = 2j the last turn is t − b, so t ≥ b; with
    /// k = 2j + 1 it is t − b + 2π, so t ≤ b.
    fn may_wind(&self, low: &Sample, high: &Sample, turn: f64) -> bool {
        let j = (-turn / 2.0).floor();
        let odd = -turn - 2.0 * j > 0.5;
        let shift = self.base_angle + j * TAU;
        let least = shift + low.swept.min(high.swept);
        let most = shift + low.swept.max(high.swept);
        let slack = 1e-6;
        if odd {
            most >= -slack && least <= self.problem.b + slack
        } else {
            most >= self.problem.b - slack && least <= TAU + slack
        }
    }

    /// Where F has its lowest point in a wind faster than the UAV, if inside.
    fn turning_points(&self, from: f64, to: f64) -> Vec<f64> {
        let g = self.problem;
        // u·w = −1: two directions, mirrored at the wind.
        let across = (g.ww - 1.0).max(0.0).sqrt();
        let mut times: Vec<f64> = [across, -across]
            .into_iter()
            .filter_map(|a| {
                let (ux, uy) = ((-g.wx - a * g.wy) / g.ww, (-g.wy + a * g.wx) / g.ww);
                // The centres are 2 apart across the straight: u × v = −2.
                let time = (ux * self.vy - uy * self.vx + 2.0) / (ux * g.wy - uy * g.wx);
                (time > from && time < to).then_some(time)
            })
            .collect();
        times.sort_by(f64::total_cmp);
        times
    }
}

/// Looks for LSR paths that are faster than the best so far and not later than `latest`.
pub(super) fn search(problem: &Problem, word: Word, latest: f64, best: &mut Best) {
    let (vx, vy) = (problem.x + problem.sin_b, problem.y - problem.cos_b - 1.0);
    let (from, to) = (problem.earliest, latest.min(best.time));
    let along = vx * problem.wx + vy * problem.wy;
    let square = vx * vx + vy * vy - 4.0;
    let disc = along * along - problem.ww * square;
    if problem.ww <= 0.0 || disc <= 0.0 {
        if square >= 0.0 {
            interval(problem, (vx, vy), (from, to), word, best);
        }
        return;
    }
    // Between these times the circles overlap.
    let root = disc.sqrt();
    let (enter, leave) = if along > 0.0 {
        (square / (along + root), (along + root) / problem.ww)
    } else {
        ((along - root) / problem.ww, square / (along - root))
    };
    interval(problem, (vx, vy), (from, to.min(enter)), word, best);
    let to = to.min(best.time);
    interval(problem, (vx, vy), (from.max(leave), to), word, best);
}

/// Looks for roots in one interval of T with D ≥ 2.
fn interval(
    problem: &Problem,
    (vx, vy): (f64, f64),
    (from, to): (f64, f64),
    word: Word,
    best: &mut Best,
) {
    if from >= to {
        return;
    }
    let mut span = Span {
        problem,
        vx,
        vy,
        base: (1.0, 0.0),
        base_angle: 0.0,
    };
    let start = span.sample(from);
    span.base = (start.zx, start.zy);
    span.base_angle = wrap_tau(start.swept);
    let mut low = Sample {
        swept: 0.0,
        value: start.p + 2.0 * span.base_angle - problem.b - from,
        ..start
    };
    if problem.ww > 1.0 {
        for time in span.turning_points(from, to) {
            let high = span.sample(time);
            span.search(&low, &high, word, best);
            low = high;
        }
    }
    let high = span.sample(to);
    span.search(&low, &high, word, best);
}
