//! The question of `wind` in numbers: radius 1, airspeed 1, start at the
//! origin heading east; and the four words whose turns go the same way or whose
//! straight is of length zero at most by chance: LSL here, LSR in `cross`, LRL in
//! `triple`, the mirrored ones by mirroring the question.
//!
//! The unit of length is the turn radius, of time the time to turn one radian.

use super::Word;
use super::{cross, triple};
use skein_geometry::math::{TAU, atan2, wrap_tau};

/// An angle of a solution may miss its range by this much, radians: rounding. It
/// moves the end by the same number of turn radii per radius of straight flown.
const ANGLE_SLACK_RAD: f64 = 1e-11;

/// Rounding of a coordinate as a share of the largest number involved.
const ROUNDING: f64 = 1e-15;

/// Beyond this time, in radians of turning, a goal in a wind that is as fast as the
/// UAV counts as out of reach: 10^7 radians are a year.
const LONGEST: f64 = 1e7;

/// A time-optimal path to a goal that stands on the ground, seen from the air.
#[derive(Clone, Copy, Debug)]
pub(super) struct Problem {
    /// The goal at time zero.
    pub x: f64,
    pub y: f64,
    /// Heading at the goal, [0, 2π), with its sine and cosine.
    pub b: f64,
    pub sin_b: f64,
    pub cos_b: f64,
    /// The wind; in the air the goal moves with the opposite.
    pub wx: f64,
    pub wy: f64,
    /// The square of the wind's speed.
    pub ww: f64,
    /// No path is faster than this.
    pub earliest: f64,
    /// Size of the numbers involved, for the slack of angles.
    pub scale: f64,
}

/// The best path found so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Best {
    /// Its duration; infinite for none.
    pub time: f64,
    pub word: Word,
    /// Durations of its three pieces.
    pub pieces: [f64; 3],
}

impl Problem {
    /// The question for a goal at `(x, y)` and `heading` in the wind `(wx, wy)`.
    pub fn new(x: f64, y: f64, heading: f64, wx: f64, wy: f64) -> Self {
        let b = wrap_tau(heading);
        let (sin_b, cos_b) = skein_geometry::math::sin_cos(b);
        let ww = wx * wx + wy * wy;
        let mut problem = Self {
            x,
            y,
            b,
            sin_b,
            cos_b,
            wx,
            wy,
            ww,
            earliest: 0.0,
            scale: 1.0 + x.abs() + y.abs(),
        };
        problem.earliest = problem.straight(x, y)[0].unwrap_or(f64::INFINITY);
        problem
    }

    /// The same question with left and right exchanged.
    fn mirrored(&self) -> Self {
        Self {
            y: -self.y,
            b: if self.b > 0.0 { TAU - self.b } else { 0.0 },
            sin_b: -self.sin_b,
            wy: -self.wy,
            ..*self
        }
    }

    /// Times s ≥ 0 with |v − w s| = s, the first and the second.
    ///
    /// In a wind slower than the UAV there is exactly one.
    fn straight(&self, vx: f64, vy: f64) -> [Option<f64>; 2] {
        let square = vx * vx + vy * vy;
        let along = vx * self.wx + vy * self.wy;
        let a = 1.0 - self.ww;
        let disc = along * along + a * square;
        if square <= 0.0 {
            return [Some(0.0), None];
        }
        if a > 0.0 {
            let root = disc.sqrt();
            let s = if along >= 0.0 {
                square / (along + root)
            } else {
                (root - along) / a
            };
            return [Some(s), None];
        }
        if disc < 0.0 || along <= 0.0 {
            return [None, None];
        }
        let root = disc.sqrt();
        let second = along - root;
        [
            Some(square / (along + root)),
            (second > square / LONGEST).then(|| square / second),
        ]
    }

    /// The latest time that has to be looked at when nothing is found yet.
    fn latest(&self) -> f64 {
        match self.detour() {
            Some(path) => path.time,
            // Later, the goal has drifted out of reach even of a straight flight.
            None => self.straight(self.x, self.y)[1].unwrap_or(LONGEST),
        }
    }

    /// From the left circle at the start to the left circle at the goal, time zero.
    pub fn left_left(&self) -> (f64, f64) {
        (self.x - self.sin_b, self.y + self.cos_b - 1.0)
    }

    /// How far an angle may be off when it belongs to a vector of this length.
    fn slack(&self, length: f64) -> f64 {
        ANGLE_SLACK_RAD + ROUNDING * self.scale / length.max(1e-300)
    }

    /// Splits a sum of two turns: the first is `angle` modulo 2π, both in [0, 2π].
    ///
    /// `length` is that of the vector whose angle this is.
    pub fn split(&self, angle: f64, sum: f64, length: f64) -> Option<(f64, f64)> {
        let slack = self.slack(length);
        let t = wrap_tau(angle);
        let fits = |t: f64| {
            let q = sum - t;
            let good = t >= -slack && t <= TAU + slack && q >= -slack && q <= TAU + slack;
            good.then(|| (t.max(0.0), q.max(0.0)))
        };
        let other = if t < TAU / 2.0 { t + TAU } else { t - TAU };
        fits(t).or_else(|| fits(other))
    }

    /// LSL (RSR when mirrored): a quadratic for each winding number.
    fn same(&self, word: Word, best: &mut Best) {
        let (vx, vy) = self.left_left();
        for turned in [self.b, self.b + TAU] {
            if turned >= best.time {
                return;
            }
            let start = (vx - self.wx * turned, vy - self.wy * turned);
            for s in self.straight(start.0, start.1).into_iter().flatten() {
                let time = turned + s;
                if time >= best.time {
                    break;
                }
                let angle = atan2(start.1 - self.wy * s, start.0 - self.wx * s);
                if let Some((t, q)) = self.split(angle, turned, s) {
                    *best = Best {
                        time,
                        word,
                        pieces: [t, s, q],
                    };
                    break;
                }
            }
            // More turns take longer on every branch that has one root only.
            if best.word == word && best.time.is_finite() && self.ww < 1.0 {
                return;
            }
        }
    }

    /// LSL with a whole circle more than it needs; exists in every slower wind.
    fn detour(&self) -> Option<Best> {
        if self.ww >= 1.0 {
            return None;
        }
        let (vx, vy) = self.left_left();
        let turned = self.b + 2.0 * TAU;
        let start = (vx - self.wx * turned, vy - self.wy * turned);
        let s = self.straight(start.0, start.1)[0]?;
        let t = wrap_tau(atan2(start.1 - self.wy * s, start.0 - self.wx * s));
        Some(Best {
            time: turned + s,
            word: Word::Lsl,
            pieces: [t, s, turned - t],
        })
    }
}

/// The fastest path over all words, or none; with `three_turns` false only over the
/// words with a straight in the middle.
pub(super) fn fastest(problem: &Problem, three_turns: bool) -> Option<Best> {
    let mut best = Best {
        time: f64::INFINITY,
        word: Word::Lsl,
        pieces: [0.0; 3],
    };
    if problem.earliest.is_infinite() {
        return None;
    }
    let mirrored = problem.mirrored();
    problem.same(Word::Lsl, &mut best);
    mirrored.same(Word::Rsr, &mut best);
    let latest = if best.time.is_finite() {
        best.time
    } else {
        problem.latest()
    };
    cross::search(problem, Word::Lsr, latest, &mut best);
    cross::search(&mirrored, Word::Rsl, latest, &mut best);
    if three_turns {
        triple::search(problem, Word::Lrl, &mut best);
        triple::search(&mirrored, Word::Rlr, &mut best);
    }
    if best.time.is_finite() {
        return Some(best);
    }
    problem.detour()
}
