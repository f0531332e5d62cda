//! `bench wind`: the fastest flight in a constant wind, against reference times or
//! against a dense oracle.

use super::figures::{Times, timed};
use anyhow::{Context, Result, anyhow, bail};
use clap::{Args, ValueEnum};
use serde::Serialize;
use skein_flight::trajectory::wind::{
    Answer, Families, Performance, Wind, time_optimal, time_optimal_over,
};
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::{TAU, sin_cos};
use skein_geometry::random::SplitMix64;
use skein_lab::wind_scan;
use std::hint::black_box;
use std::path::PathBuf;

/// Times that differ by less than this share are the same: references have nine digits.
const SAME: f64 = 1e-6;

/// An oracle's time is a miss if it is earlier by more than this share.
const EARLIER: f64 = 1e-7;

/// Numbers in a line of a case file.
const COLUMNS: usize = 10;

/// How long the oracle looks where nothing was found, radians of turning.
const PATIENCE: f64 = 40.0;

/// Cases from a file, or random ones.
#[derive(Debug, Args)]
pub struct WindArgs {
    /// Cases: `x0 y0 psi0 xf yf psif wx wy speed curvature`, one a line.
    #[arg(long, value_name = "FILE", conflicts_with = "n")]
    pub cases: Option<PathBuf>,

    /// Time-optimal durations of the words with a straight in the middle, one a line.
    #[arg(long, value_name = "FILE", requires = "cases")]
    pub reference: Option<PathBuf>,

    /// How many random cases.
    #[arg(long, default_value_t = 100_000, value_name = "N")]
    pub n: usize,

    /// Where the goals of random cases lie and how strong the wind is.
    #[arg(long, value_enum, default_value_t = Kind::Near)]
    pub kind: Kind,

    /// Looks of the oracle per word and random case; 0 asks no oracle.
    #[arg(long, default_value_t = 0, value_name = "N")]
    pub oracle: u32,

    /// Seed of the random cases.
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub seed: u64,
}

/// Random cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// Goals within 4 turn radii, wind up to half the airspeed.
    Near,
    /// Goals at 4 to 20 radii, wind up to half the airspeed.
    Far,
    /// Goals within 20 radii, wind up to 0.9 of the airspeed.
    Mixed,
    /// Goals within 8 radii, wind from 0.9 to 1.5 of the airspeed.
    Storm,
}

struct Case {
    from: Pose,
    to: Pose,
    performance: Performance,
    wind: Wind,
}

#[derive(Serialize)]
struct Answers {
    n: usize,
    /// Largest error of the straight-middle time against the reference.
    max_rel_error: f64,
    /// Cases in which it differs, or in which the best path is slower.
    mismatches: usize,
    /// Cases in which the best path is faster than the reference.
    better: usize,
    /// Cases in which the oracle saw a faster path.
    #[serde(skip_serializing_if = "Option::is_none")]
    misses: Option<usize>,
    unreachable: usize,
    /// Largest distance of a path's end from its goal, turn radii.
    max_end_error: f64,
    #[serde(flatten)]
    times: Times,
}

/// Solves every case once by itself and reports errors and times.
///
/// # Errors
/// When a file cannot be read or a line of it has no ten numbers.
pub fn run(args: &WindArgs) -> Result<String> {
    let cases = match &args.cases {
        Some(path) => read_cases(path)?,
        None => random_cases(args),
    };
    let reference = args.reference.as_ref().map(read_reference).transpose()?;
    if reference.as_ref().is_some_and(|r| r.len() != cases.len()) {
        bail!("the reference has another number of lines than the cases");
    }
    let mut each_us = Vec::with_capacity(cases.len());
    let mut found = Vec::with_capacity(cases.len());
    for c in &cases {
        let (answer, us) =
            timed(|| time_optimal(black_box(c.from), c.to, c.performance, black_box(c.wind)));
        each_us.push(us);
        found.push(answer?);
    }
    let mut answers = Answers {
        n: cases.len(),
        max_rel_error: 0.0,
        mismatches: 0,
        better: 0,
        misses: None,
        unreachable: found.iter().filter(|a| a.path().is_none()).count(),
        max_end_error: worst_end(&cases, &found),
        times: Times::of(each_us),
    };
    if let Some(reference) = reference {
        compare(&cases, &found, &reference, &mut answers)?;
    }
    if args.oracle > 0 {
        answers.misses = Some(
            cases
                .iter()
                .zip(&found)
                .filter(|(c, a)| missed(c, a, args.oracle))
                .count(),
        );
    }
    Ok(serde_json::to_string(&answers)?)
}

/// Whether the oracle knows an earlier time.
fn missed(case: &Case, answer: &Answer, looks: u32) -> bool {
    let unit_s = case.performance.turn_radius_m / case.performance.airspeed_mps;
    let until_s = answer
        .path()
        .map_or(PATIENCE * unit_s, |p| p.time_s() * (1.0 - EARLIER));
    wind_scan::earliest_s(
        case.from,
        case.to,
        case.performance,
        case.wind,
        until_s,
        looks,
    )
    .is_some()
}

fn worst_end(cases: &[Case], found: &[Answer]) -> f64 {
    let pairs = cases.iter().zip(found);
    pairs
        .filter_map(|(c, a)| {
            let off = a.path()?.end().position() - c.to.position();
            Some(off.norm() / c.performance.turn_radius_m)
        })
        .fold(0.0, f64::max)
}

fn compare(
    cases: &[Case],
    found: &[Answer],
    reference: &[f64],
    answers: &mut Answers,
) -> Result<()> {
    for ((c, a), &theirs_s) in cases.iter().zip(found).zip(reference) {
        let straight = time_optimal_over(
            Families::StraightMiddle,
            c.from,
            c.to,
            c.performance,
            c.wind,
        )?;
        let ours_s = |a: &Answer| a.path().map_or(f64::INFINITY, |p| p.time_s());
        let error = ((ours_s(&straight) - theirs_s) / theirs_s).abs();
        answers.max_rel_error = answers.max_rel_error.max(error);
        let gain = (theirs_s - ours_s(a)) / theirs_s;
        if error > SAME || gain < -SAME {
            answers.mismatches += 1;
        }
        if gain > SAME {
            answers.better += 1;
        }
    }
    Ok(())
}

fn read_cases(path: &PathBuf) -> Result<Vec<Case>> {
    let text = std::fs::read_to_string(path).with_context(|| format!("{}", path.display()))?;
    parse_cases(&text).with_context(|| format!("{}", path.display()))
}

fn parse_cases(text: &str) -> Result<Vec<Case>> {
    let mut cases = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let numbers: Result<Vec<f64>, _> = line.split_whitespace().map(str::parse).collect();
        let numbers = numbers.with_context(|| format!("line {}", i + 1))?;
        let [x0, y0, a, x1, y1, b, wx, wy, speed, curvature] = <[f64; COLUMNS]>::try_from(numbers)
            .map_err(|n| anyhow!("line {}: {} numbers instead of {COLUMNS}", i + 1, n.len()))?;
        cases.push(Case {
            from: Pose::new(Point::new(x0, y0), a),
            to: Pose::new(Point::new(x1, y1), b),
            performance: Performance {
                airspeed_mps: speed,
                turn_radius_m: 1.0 / curvature,
            },
            wind: Wind::new(wx, wy),
        });
    }
    Ok(cases)
}

fn read_reference(path: &PathBuf) -> Result<Vec<f64>> {
    let text = std::fs::read_to_string(path).with_context(|| format!("{}", path.display()))?;
    text.lines()
        .enumerate()
        .map(|(i, line)| {
            line.trim()
                .parse()
                .with_context(|| format!("{}: line {}", path.display(), i + 1))
        })
        .collect()
}

fn random_cases(args: &WindArgs) -> Vec<Case> {
    let mut random = SplitMix64::new(args.seed);
    let mut between = |low: f64, high: f64| low + (high - low) * random.unit();
    let (distance, strength) = match args.kind {
        Kind::Near => ((0.0, 4.0), (0.02, 0.5)),
        Kind::Far => ((4.0, 20.0), (0.02, 0.5)),
        Kind::Mixed => ((0.0, 20.0), (0.02, 0.9)),
        Kind::Storm => ((0.0, 8.0), (0.9, 1.5)),
    };
    let mut polar = |range: (f64, f64)| {
        let (size, (s, c)) = (between(range.0, range.1), sin_cos(between(0.0, TAU)));
        (size * c, size * s, between(0.0, TAU))
    };
    (0..args.n)
        .map(|_| {
            let (x, y, heading) = polar(distance);
            let (wx, wy, _) = polar(strength);
            Case {
                from: Pose::new(Point::new(0.0, 0.0), 0.0),
                to: Pose::new(Point::new(x, y), heading),
                performance: Performance {
                    airspeed_mps: 1.0,
                    turn_radius_m: 1.0,
                },
                wind: Wind::new(wx, wy),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const CASES: &str = include_str!("../data/wind/cases.txt");
    const TIMES: &str = include_str!("../data/wind/straight_middle_times.txt");

    #[test]
    fn the_published_solver_agrees_on_straight_middles_and_is_never_faster() {
        let cases = parse_cases(CASES).unwrap();
        let times: Vec<f64> = TIMES.lines().map(|l| l.parse().unwrap()).collect();
        assert_eq!(cases.len(), times.len());
        for (c, theirs) in cases.iter().zip(times) {
            let over = |f| {
                time_optimal_over(f, c.from, c.to, c.performance, c.wind)
                    .unwrap()
                    .path()
                    .unwrap()
                    .time_s()
            };
            assert!((over(Families::StraightMiddle) / theirs - 1.0).abs() < SAME);
            assert!(over(Families::All) < theirs * (1.0 + SAME));
        }
    }

    #[test]
    fn a_short_line_is_named() {
        let error = parse_cases("0 0 0 1 1 1 0 0 1 1\n1 2 3").err().unwrap();
        assert!(error.to_string().contains("line 2"), "{error}");
    }
}
