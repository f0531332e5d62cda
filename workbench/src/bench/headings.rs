//! `bench headings`: headings at random waypoints with a certified gap (D2.7 §2.4.3).
//!
//! Waypoints are uniform in a square of 20 turn radii and visited by nearest
//! neighbour, so the more there are the nearer they lie.

use super::figures::{Times, timed};
use super::stream::Stream;
use anyhow::Result;
use clap::Args;
use serde::Serialize;
use skein_planning::frame::Point;
use skein_planning::trajectory::headings::{Chain, Request, choose};

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
    /// Return to the first waypoint.
    #[arg(long)]
    pub closed: bool,
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
    /// Instances whose gap is above the one asked for.
    misses: usize,
    /// Sums over all instances, metres.
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
    let mut stream = Stream(args.seed);
    let mut answer = Answer {
        n: args.n,
        instances: args.instances,
        gap: 0.0,
        mean_gap: 0.0,
        misses: 0,
        lower_bound: 0.0,
        length: 0.0,
        max_rounds: 0,
        times: Times::of(Vec::new()),
    };
    let mut each_us = Vec::with_capacity(args.instances);
    for _ in 0..args.instances {
        let waypoints = draw(args, &mut stream);
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
        };
        let (found, us) = timed(|| choose(&request));
        let found = found?;
        each_us.push(us);
        answer.gap = answer.gap.max(found.gap());
        answer.mean_gap += found.gap() / args.instances as f64;
        answer.misses += usize::from(found.gap() > args.gap);
        answer.lower_bound += found.lower_bound_m;
        answer.length += found.length_m;
        answer.max_rounds = answer.max_rounds.max(found.rounds.len());
    }
    answer.times = Times::of(each_us);
    Ok(serde_json::to_string(&answer)?)
}

/// Uniform waypoints, each followed by the nearest not yet visited.
fn draw(args: &HeadingsArgs, stream: &mut Stream) -> Vec<Point> {
    let side_m = args.side * args.radius_m;
    let mut unit = || stream.unit();
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
    fn small_instances_are_certified() {
        let answer = run(&HeadingsArgs {
            n: 6,
            radius_m: 50.0,
            side: 20.0,
            instances: 2,
            gap: 1e-2,
            closed: true,
            seed: 7,
        })
        .unwrap();
        assert!(answer.contains("\"misses\":0"), "{answer}");
    }
}
