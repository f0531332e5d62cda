//! `bench headings`: headings at random waypoints with a certified gap (D2.7 §2.4.3).
//!
//! Waypoints are uniform in a square of 20 turn radii and visited by nearest
//! neighbour, so the more there are the nearer they lie.

use super::figures::{Times, timed};
use anyhow::{Result, bail};
use clap::Args;
use serde::Serialize;
use skein_flight::trajectory::wind::Wind;
use skein_geometry::frame::Point;
use skein_geometry::math::{TAU, cos, sin};
use skein_geometry::random::SplitMix64;
use skein_lab::headings::{Chain, HeadingsError, Request, choose, choose_in_wind};

/// Random waypoints in a square, in the order of the nearest neighbour.
#[derive(Debug, Args)]
pub struct HeadingsArgs {
    /// Waypoints of an instance.
    #[arg(long, default_value_t = 50, value_name = "N")]
    pub n: usize,
    /// Turn radius, metres.
    #[arg(long, default_value_t = 50.0, value_name = "R")]
    pub radius_m: f64,
    /// Side of the square, turn radii.
    #[arg(long, default_value_t = 20.0, value_name = "RADII")]
    pub side: f64,
    /// How many instances.
    #[arg(long, default_value_t = 10, value_name = "COUNT")]
    pub instances: usize,
    /// The share of the length by which the answer may exceed the optimum.
    #[arg(long, default_value_t = 1e-3, value_name = "SHARE")]
    pub gap: f64,
    /// Pairs of intervals looked at for each leg at most; by default 8,000 in wind.
    #[arg(long, value_name = "PAIRS")]
    pub pairs_a_leg: Option<usize>,
    /// Return to the first waypoint.
    #[arg(long)]
    pub closed: bool,
    /// Speed of a wind from a random quarter, as a share of the airspeed; with one,
    /// seconds are minimised instead of metres.
    #[arg(long, default_value_t = 0.0, value_name = "SHARE")]
    pub wind_ratio: f64,
    /// Airspeed, which only matters in wind, m/s.
    #[arg(long, default_value_t = 20.0, value_name = "MPS")]
    pub airspeed_mps: f64,
    /// Where the random numbers begin.
    #[arg(long, default_value_t = 1, value_name = "SEED")]
    pub seed: u64,
}

#[derive(Serialize)]
struct Answer {
    n: usize,
    instances: usize,
    /// The largest certified gap, and the mean.
    gap: f64,
    mean_gap: f64,
    /// The gap asked for, and whether it is certified for every instance.
    asked_gap: f64,
    certified: bool,
    /// Instances for which it is not.
    misses: usize,
    wind_ratio: f64,
    /// Sums over all instances, metres; seconds in wind.
    lower_bound: f64,
    length: f64,
    max_rounds: usize,
    #[serde(flatten)]
    times: Times,
}

/// Solves the instances and reports gaps and times.
///
/// # Errors
/// When the request is malformed.
pub fn run(args: &HeadingsArgs) -> Result<String> {
    if args.wind_ratio.is_sign_negative() {
        bail!("--wind-ratio is a share of the airspeed, zero or more");
    }
    let mut random = SplitMix64::new(args.seed);
    let mut answer = Answer {
        n: args.n,
        instances: args.instances,
        gap: 0.0,
        mean_gap: 0.0,
        asked_gap: args.gap,
        certified: true,
        misses: 0,
        wind_ratio: args.wind_ratio,
        lower_bound: 0.0,
        length: 0.0,
        max_rounds: 0,
        times: Times::of(Vec::new()),
    };
    let mut each_us = Vec::with_capacity(args.instances);
    for _ in 0..args.instances {
        let waypoints = draw(args, &mut random);
        let chain = if args.closed {
            Chain::Closed
        } else {
            Chain::Open {
                first_rad: None,
                last_rad: None,
            }
        };
        let request = Request {
            waypoints: &waypoints,
            chain,
            radius_m: args.radius_m,
            gap: args.gap,
            pairs_a_leg: args.pairs_a_leg,
        };
        let course = if args.wind_ratio > 0.0 {
            TAU * random.unit()
        } else {
            0.0
        };
        let (found, us) = timed(|| solve(args, &request, course));
        let found = found?;
        each_us.push(us);
        let gap = 1.0 - found.lower_bound / found.length.max(f64::MIN_POSITIVE);
        answer.gap = answer.gap.max(gap);
        answer.mean_gap += gap / args.instances as f64;
        answer.certified &= found.certified;
        answer.misses += usize::from(!found.certified);
        answer.lower_bound += found.lower_bound;
        answer.length += found.length;
        answer.max_rounds = answer.max_rounds.max(found.rounds);
    }
    answer.times = Times::of(each_us);
    Ok(serde_json::to_string(&answer)?)
}

/// Both bounds of one instance and the rounds they took.
struct Found {
    lower_bound: f64,
    length: f64,
    certified: bool,
    rounds: usize,
}

/// Solves one instance, in calm or in a wind that blows along `course_rad`.
fn solve(args: &HeadingsArgs, request: &Request, course_rad: f64) -> Result<Found, HeadingsError> {
    if args.wind_ratio == 0.0 {
        return choose(request).map(|h| Found {
            lower_bound: h.lower_bound_m,
            length: h.length_m,
            certified: h.certified,
            rounds: h.rounds.len(),
        });
    }
    let speed = args.wind_ratio * args.airspeed_mps;
    let wind = Wind::new(speed * cos(course_rad), speed * sin(course_rad));
    choose_in_wind(request, args.airspeed_mps, wind).map(|h| Found {
        lower_bound: h.lower_bound_s,
        length: h.time_s,
        certified: h.certified,
        rounds: h.rounds_s.len(),
    })
}

/// Uniform waypoints, each followed by the nearest not yet visited.
fn draw(args: &HeadingsArgs, random: &mut SplitMix64) -> Vec<Point> {
    let side_m = args.side * args.radius_m;
    let mut unit = || random.unit();
    let mut left: Vec<Point> = (0..args.n)
        .map(|_| Point::new(side_m * unit(), side_m * unit()))
        .collect();
    let mut order: Vec<Point> = left.pop().into_iter().collect();
    while let Some(at) = order.last().copied() {
        let away = |p: &Point| (p - at).norm_squared();
        let nearest = (0..left.len()).min_by(|&a, &b| away(&left[a]).total_cmp(&away(&left[b])));
        let Some(nearest) = nearest else { break };
        order.push(left.swap_remove(nearest));
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_instances_are_certified_in_calm_and_in_wind() {
        for wind_ratio in [0.0, 0.3] {
            let answer = run(&HeadingsArgs {
                n: 6,
                radius_m: 50.0,
                side: 20.0,
                instances: 2,
                gap: 1e-2,
                pairs_a_leg: None,
                closed: false,
                wind_ratio,
                airspeed_mps: 20.0,
                seed: 7,
            })
            .unwrap();
            assert!(answer.contains("\"misses\":0"), "{answer}");
        }
    }
}
