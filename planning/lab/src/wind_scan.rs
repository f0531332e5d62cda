//! A dense oracle for `time_optimal`: samples time, asks all words, knows no structure.
//!
//! Slow on purpose and written from the circles' centres alone, so that it shares no
//! formula with the solver that it judges. For tests and measurements.

use skein_flight::trajectory::wind::{Performance, Wind};
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::{PI, TAU, atan2, sin_cos, wrap_tau};

/// A root is real if the word closes this well, turn radii; jumps do not.
const CLOSES: f64 = 1e-9;

/// Halvings of a bracket: they exhaust the digits of a time.
const HALVINGS: u8 = 60;

/// Steps that narrow a dip down by the golden ratio, to a millionth of a sample.
const GOLDEN_STEPS: u8 = 30;

/// Lengths that differ by more within one sample have jumped by a whole circle.
const JUMP: f64 = 3.0;

/// The question, radius and airspeed 1.
struct Scan {
    from: Pose,
    to: Pose,
    wind: Vector,
}

/// The earliest time before `until_s` at which some word meets the goal, as far as
/// `samples` equally spaced looks (and refinements of what they show) can tell.
///
/// In seconds; `None` if nothing was seen.
#[must_use]
pub fn earliest_s(
    from: Pose,
    to: Pose,
    performance: Performance,
    wind: Wind,
    until_s: f64,
    samples: u32,
) -> Option<f64> {
    let (r, v) = (performance.turn_radius_m, performance.airspeed_mps);
    let scaled = |p: Pose| {
        Pose::new(
            Point::from((p.position() - from.position()) / r),
            p.heading_rad,
        )
    };
    let scan = Scan {
        from: scaled(from),
        to: scaled(to),
        wind: wind.velocity() / v,
    };
    let until = until_s * v / r;
    (0..8)
        .filter_map(|word| scan.word(word, until, samples))
        .min_by(f64::total_cmp)
        .map(|t| t * r / v)
}

impl Scan {
    /// Length of a word to where the goal is at `time`, less `time`.
    fn excess(&self, word: usize, time: f64) -> Option<f64> {
        let goal = self.to.position() - self.wind * time;
        let side = if word.is_multiple_of(2) { 1.0 } else { -1.0 };
        let last = if word / 2 == 1 { -side } else { side };
        let centre = |p: Point, heading: f64, side: f64| {
            let (s, c) = sin_cos(heading);
            Point::new(p.x - side * s, p.y + side * c)
        };
        let (a, b) = (self.from.heading_rad, self.to.heading_rad);
        let v = centre(goal, b, last) - centre(self.from.position(), a, side);
        let (apart, course) = (v.norm(), atan2(v.y, v.x));
        let length = match word / 2 {
            0 => wrap_tau(side * (course - a)) + apart + wrap_tau(side * (b - course)),
            1 => {
                let straight =
                    (apart * apart - 4.0 >= 0.0).then(|| (apart * apart - 4.0).sqrt())?;
                let course = course + side * atan2(2.0, straight);
                wrap_tau(side * (course - a)) + straight + wrap_tau(side * (course - b))
            }
            form => {
                let high = 4.0 - apart * apart / 4.0;
                let lean = (high >= 0.0).then(|| atan2(high.sqrt(), apart / 2.0))?;
                let lean = if form == 2 { lean } else { -lean };
                let (out, back) = (course + lean, course + PI - lean);
                wrap_tau(side * (out - a) + PI / 2.0)
                    + wrap_tau(side * (out - back))
                    + wrap_tau(side * (b - back) - PI / 2.0)
            }
        };
        Some(length - time)
    }

    /// The earliest root of one word.
    fn word(&self, word: usize, until: f64, samples: u32) -> Option<f64> {
        let f = |t: f64| self.excess(word, t);
        let step = until / f64::from(samples);
        let mut past: [Option<(f64, f64)>; 2] = [None, None];
        let mut before = 0.0;
        for i in 0..=samples {
            let t = step * f64::from(i);
            let now = f(t).map(|value| (t, value));
            let found = match (past[1], now) {
                (Some(a), Some(b)) => {
                    let dip = past[0].and_then(|o| dip(&f, o, a, b));
                    [dip, crossing(&f, a, b)]
                }
                // The word begins or ends to exist in between.
                (None, Some(b)) if i > 0 => {
                    [edge(&f, before, b.0).and_then(|a| crossing(&f, a, b)), None]
                }
                (Some(a), None) => [edge(&f, t, a.0).and_then(|b| crossing(&f, a, b)), None],
                _ => [None, None],
            };
            if let Some(t) = found.into_iter().flatten().min_by(f64::total_cmp) {
                return Some(t);
            }
            past = [past[1], now];
            before = t;
        }
        None
    }
}

/// A root between two samples, on either side of a jump if there is one.
fn crossing(f: &dyn Fn(f64) -> Option<f64>, a: (f64, f64), b: (f64, f64)) -> Option<f64> {
    if (a.1 - b.1).abs() < JUMP {
        return change_of_sign(f, a, b);
    }
    let (mut before, mut after) = (a, b);
    for _ in 0..HALVINGS {
        let time = 0.5 * (before.0 + after.0);
        let middle = (time, f(time)?);
        if (middle.1 - before.1).abs() > (middle.1 - after.1).abs() {
            after = middle;
        } else {
            before = middle;
        }
    }
    change_of_sign(f, a, before).or_else(|| change_of_sign(f, after, b))
}

/// A root between two samples of opposite sign.
fn change_of_sign(f: &dyn Fn(f64) -> Option<f64>, a: (f64, f64), b: (f64, f64)) -> Option<f64> {
    if (a.1 > 0.0) == (b.1 > 0.0) {
        return None;
    }
    let (mut low, mut high) = (a.0, b.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        let value = f(middle)?;
        if (value > 0.0) == (a.1 > 0.0) {
            low = middle;
        } else {
            high = middle;
        }
    }
    f(high).filter(|v| v.abs() < CLOSES).map(|_| high)
}

/// The last place at which a function exists between `outside` and `inside`.
fn edge(f: &dyn Fn(f64) -> Option<f64>, outside: f64, inside: f64) -> Option<(f64, f64)> {
    let (mut outside, mut inside) = (outside, inside);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (outside + inside);
        if f(middle).is_some() {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    f(inside).map(|value| (inside, value))
}

/// Two roots between three samples of the same sign of which the middle is nearest
/// to zero; the first of them.
fn dip(f: &dyn Fn(f64) -> Option<f64>, a: (f64, f64), m: (f64, f64), b: (f64, f64)) -> Option<f64> {
    let sign = a.1.signum();
    let (fa, fm, fb) = (sign * a.1, sign * m.1, sign * b.1);
    let could_reach = fm < (fa - fm) + (fb - fm);
    if !(fm > 0.0 && fm < fa && fm < fb && could_reach) || (fa - fb).abs() > TAU {
        return None;
    }
    let ratio = 0.618_033_988_749_894_9;
    let (mut low, mut high) = (a.0, b.0);
    for _ in 0..GOLDEN_STEPS {
        let (x, y) = (high - ratio * (high - low), low + ratio * (high - low));
        let (fx, fy) = (sign * f(x)?, sign * f(y)?);
        if fx <= 0.0 {
            return crossing(f, a, (x, sign * fx));
        }
        if fx < fy {
            high = y;
        } else {
            low = x;
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use skein_flight::trajectory::wind::{Families, time_optimal_over, time_s};
    use skein_geometry::math::{cos, sin};

    const UAV: Performance = Performance {
        airspeed_mps: 20.0,
        turn_radius_m: 50.0,
    };

    fn pose(east_m: f64, north_m: f64, heading_rad: f64) -> Pose {
        Pose {
            east_m,
            north_m,
            heading_rad,
        }
    }

    fn wind(share: f64, towards: f64) -> Wind {
        let speed = share * UAV.airspeed_mps;
        Wind::new(speed * cos(towards), speed * sin(towards))
    }

    proptest! {
        #[test]
        fn the_dense_oracle_sees_nothing_faster(
            x in -200.0f64..200.0, y in -200.0f64..200.0, b in -4.0f64..4.0,
            share in 0.0f64..1.4, towards in 0.0f64..TAU,
        ) {
            let (from, to, w) = (pose(0.0, 0.0, 0.3), pose(x, y, b), wind(share, towards));
            let t = time_s(from, to, UAV, w).unwrap();
            let until_s = if t.is_finite() { t * (1.0 - 1e-7) } else { 120.0 };
            let seen = earliest_s(from, to, UAV, w, until_s, 400);
            prop_assert!(seen.is_none(), "{seen:?} before {t}");
        }

        #[test]
        fn the_oracle_sees_what_straight_middles_miss(
            x in -120.0f64..120.0, y in -120.0f64..120.0, b in -4.0f64..4.0,
            share in 0.0f64..0.5, towards in 0.0f64..TAU,
        ) {
            let (from, to, w) = (pose(0.0, 0.0, 0.3), pose(x, y, b), wind(share, towards));
            let over = |f| time_optimal_over(f, from, to, UAV, w).unwrap().path().unwrap().time_s();
            let (best, straight) = (over(Families::All), over(Families::StraightMiddle));
            if best > straight * (1.0 - 1e-4) {
                // Three goals in four: the straight middle is best.
                return Ok(());
            }
            let seen = earliest_s(from, to, UAV, w, straight * (1.0 - 1e-6), 400);
            prop_assert!(seen.is_some_and(|t| (t - best).abs() < 1e-6 * best), "{seen:?} {best} {straight}");
        }
    }
}
