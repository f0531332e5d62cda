//! `bench dubins`: the shortest of all six words to random goals, no wind (D2.7 §2.4.1).
//!
//! Lengths are compared with the six textbook formulas on the library's sines and
//! arc tangents, ends with the goal by flying the curve.

use super::figures::{Times, timed};
use anyhow::Result;
use clap::Args;
#[cfg(feature = "rivals")]
use clap::ValueEnum;
use serde::Serialize;
use skein_flight::trajectory::dubins;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::{TAU, acos, atan2, cos, sin, wrap_pi, wrap_tau};
use skein_geometry::random::SplitMix64;
use std::hint::black_box;

/// Goals solved between two looks at the clock: one solve is shorter than a look.
const BATCH: usize = 1000;

/// Lengths further apart than this share are different curves.
const MISMATCH: f64 = 1e-9;

/// Random goals in a square, headings of both ends random.
#[derive(Debug, Args)]
pub struct DubinsArgs {
    /// How many goals.
    #[arg(long, default_value_t = 1_000_000, value_name = "N")]
    pub n: usize,
    /// Side of the square about the start, turn radii.
    #[arg(long, default_value_t = 24.0, value_name = "RADII")]
    pub side: f64,
    /// Solve the same goals with another library, too.
    #[cfg(feature = "rivals")]
    #[arg(long, value_enum)]
    pub against: Option<Rival>,
}

/// Libraries to compare with.
#[cfg(feature = "rivals")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Rival {
    /// The `dubins_paths` crate.
    DubinsPaths,
}

/// Lengths against the oracle, and times.
#[derive(Serialize)]
struct Figures {
    max_rel_error: f64,
    /// Lengths further than a billionth above the oracle's.
    mismatches: usize,
    /// Lengths further than a billionth below it.
    better: usize,
    /// Distance of the flown curve's end from the goal, and of its heading, as a
    /// share of the scale.
    max_endpoint_error: f64,
    #[serde(flatten)]
    times: Times,
}

#[derive(Serialize)]
struct Answer {
    n: usize,
    side: f64,
    #[serde(flatten)]
    figures: Figures,
    /// Mean and median time a goal from one start to many.
    batch_mean_us: f64,
    batch_p50_us: f64,
    /// Mean time a goal with the curve made.
    curve_mean_us: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    rival: Option<Figures>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ratio: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    batch_ratio: Option<f64>,
}

/// Solves `n` goals and reports errors and the time per goal.
///
/// # Errors
/// None today.
pub fn run(args: &DubinsArgs) -> Result<String> {
    let pairs = draw(args);
    let oracle: Vec<f64> = pairs.iter().map(|p| textbook(p.0, p.1)).collect();
    let figures = measure(
        &pairs,
        &oracle,
        |a, b| dubins::length_m(a, b, 1.0),
        |a, b| dubins::shortest(a, b, 1.0).end().unwrap_or(a),
    );
    let from = Pose::new(Point::new(0.0, 0.0), 0.3);
    let goals: Vec<Pose> = pairs.iter().map(|p| p.1).collect();
    let mut out = vec![0.0; BATCH];
    let mut batch_us = Vec::with_capacity(goals.len() / BATCH + 1);
    for batch in goals.chunks(BATCH) {
        let ((), us) = timed(|| dubins::lengths_m(from, black_box(batch), 1.0, &mut out));
        black_box(&out);
        batch_us.push(us / batch.len() as f64);
    }
    let batch = Times::of(batch_us);
    let ((), curve_us) = timed(|| {
        for p in &pairs {
            black_box(dubins::shortest(p.0, p.1, 1.0));
        }
    });
    let n = pairs.len().max(1) as f64;
    #[cfg(feature = "rivals")]
    let rival = args.against.map(|_| rivals::measure(&pairs, &oracle));
    #[cfg(not(feature = "rivals"))]
    let rival: Option<Figures> = None;
    let ratio = |us: f64| rival.as_ref().map(|r| us / r.times.mean_us);
    Ok(serde_json::to_string(&Answer {
        n: args.n,
        side: args.side,
        ratio: ratio(figures.times.mean_us),
        batch_ratio: ratio(batch.mean_us),
        figures,
        batch_mean_us: batch.mean_us,
        batch_p50_us: batch.p50_us,
        curve_mean_us: curve_us / n,
        rival,
    })?)
}

/// Starts at the origin and goals about it, the same in every run.
fn draw(args: &DubinsArgs) -> Vec<(Pose, Pose)> {
    let mut random = SplitMix64::new(1);
    let mut unit = || random.unit();
    (0..args.n)
        .map(|_| {
            let from = Pose::new(Point::new(0.0, 0.0), TAU * unit());
            let at = Point::new(args.side * (unit() - 0.5), args.side * (unit() - 0.5));
            (from, Pose::new(at, TAU * unit()))
        })
        .collect()
}

fn measure(
    pairs: &[(Pose, Pose)],
    oracle: &[f64],
    length: impl Fn(Pose, Pose) -> f64,
    end: impl Fn(Pose, Pose) -> Pose,
) -> Figures {
    let mut each_us = Vec::with_capacity(pairs.len() / BATCH + 1);
    for batch in pairs.chunks(BATCH) {
        let ((), us) = timed(|| {
            for &(from, to) in batch {
                black_box(length(from, to));
            }
        });
        each_us.push(us / batch.len() as f64);
    }
    let mut figures = Figures {
        max_rel_error: 0.0,
        mismatches: 0,
        better: 0,
        max_endpoint_error: 0.0,
        times: Times::of(each_us),
    };
    for (&(from, to), &wanted) in pairs.iter().zip(oracle) {
        let error = length(from, to) / wanted - 1.0;
        figures.max_rel_error = figures.max_rel_error.max(error.abs());
        figures.mismatches += usize::from(error > MISMATCH);
        figures.better += usize::from(error < -MISMATCH);
        let reached = end(from, to);
        let scale = to.east_m.abs().max(to.north_m.abs()).max(1.0);
        let off = (reached.position() - to.position()).norm() / scale;
        let turned = wrap_pi(reached.heading_rad - to.heading_rad).abs();
        figures.max_endpoint_error = figures.max_endpoint_error.max(off).max(turned);
    }
    figures
}

/// The six words by the textbook's formulas in normalised coordinates, radius 1.
fn textbook(from: Pose, to: Pose) -> f64 {
    let v = to.position() - from.position();
    let (d, theta) = (v.norm(), atan2(v.y, v.x));
    let (a, b) = (from.heading_rad - theta, to.heading_rad - theta);
    let (sa, sb, ca, cb, cab) = (sin(a), sin(b), cos(a), cos(b), cos(a - b));
    let lsl = atan2(cb - ca, d + sa - sb);
    let rsr = atan2(ca - cb, d - sa + sb);
    let csc = |square: f64, out: &dyn Fn(f64) -> f64, back: &dyn Fn(f64) -> f64| {
        let p = square.sqrt();
        if square < 0.0 {
            f64::INFINITY
        } else {
            p + wrap_tau(out(p)) + wrap_tau(back(p))
        }
    };
    let lsr = |p: f64| atan2(-ca - cb, d + sa + sb) + atan2(2.0, p);
    let rsl = |p: f64| atan2(ca + cb, d - sa - sb) - atan2(2.0, p);
    let ccc = |c: f64, out: &dyn Fn(f64) -> f64, turn: f64| {
        let m = TAU - acos(c);
        let t = wrap_tau(out(m));
        if c.abs() > 1.0 {
            f64::INFINITY
        } else {
            t + m + wrap_tau(turn - t + m)
        }
    };
    let base = d * d + 2.0 - 2.0 * cab;
    [
        csc(base + 2.0 * d * (sa - sb), &|_| lsl - a, &|_| b - lsl),
        csc(base + 2.0 * d * (sb - sa), &|_| a - rsr, &|_| rsr - b),
        csc(
            d * d - 2.0 + 2.0 * cab + 2.0 * d * (sa + sb),
            &|p| lsr(p) - a,
            &|p| lsr(p) - b,
        ),
        csc(
            d * d - 2.0 + 2.0 * cab - 2.0 * d * (sa + sb),
            &|p| a - rsl(p),
            &|p| b - rsl(p),
        ),
        ccc(
            (6.0 - d * d + 2.0 * cab + 2.0 * d * (sa - sb)) / 8.0,
            &|m| a - rsr + m / 2.0,
            a - b,
        ),
        ccc(
            (6.0 - d * d + 2.0 * cab + 2.0 * d * (sb - sa)) / 8.0,
            &|m| lsl - a + m / 2.0,
            b - a,
        ),
    ]
    .into_iter()
    .fold(f64::INFINITY, f64::min)
}

#[cfg(feature = "rivals")]
mod rivals {
    use super::{Figures, Pose};
    use dubins_paths::f64::{DubinsPath, PosRot};

    fn solve(from: Pose, to: Pose) -> Option<DubinsPath> {
        let pose = |p: Pose| PosRot::from_floats(p.east_m, p.north_m, p.heading_rad);
        DubinsPath::shortest_from(pose(from), pose(to), 1.0).ok()
    }

    pub fn measure(pairs: &[(Pose, Pose)], oracle: &[f64]) -> Figures {
        super::measure(
            pairs,
            oracle,
            |a, b| solve(a, b).map_or(f64::INFINITY, |p| p.length()),
            |a, b| {
                solve(a, b).map_or(a, |p| {
                    let e = p.endpoint();
                    Pose {
                        east_m: e.x(),
                        north_m: e.y(),
                        heading_rad: e.rot(),
                    }
                })
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thousand_goals_agree_with_the_textbook() {
        let pairs = draw(&DubinsArgs {
            n: 1000,
            side: 6.0,
            #[cfg(feature = "rivals")]
            against: None,
        });
        for (from, to) in pairs {
            let wanted = textbook(from, to);
            assert!((dubins::length_m(from, to, 1.0) - wanted).abs() < 1e-9);
        }
    }
}
