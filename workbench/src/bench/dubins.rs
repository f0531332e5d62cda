//! `bench dubins`: the shortest of all six words to random goals, no wind.

use super::figures::{Times, timed};
use anyhow::Result;
use clap::Args;
use serde::Serialize;
use skein_planning::frame::{Point, Pose};
use skein_planning::trajectory::dubins;
use std::hint::black_box;

/// Goals solved between two looks at the clock: one solve is shorter than a look.
const BATCH: usize = 1000;

/// Random goals in a square of 24 turn radii.
#[derive(Debug, Args)]
pub struct DubinsArgs {
    /// How many goals.
    #[arg(long, default_value_t = 1_000_000, value_name = "N")]
    pub n: usize,
}

#[derive(Serialize)]
struct Answer {
    n: usize,
    #[serde(flatten)]
    times: Times,
}

/// Solves `n` goals and reports the time per goal.
///
/// # Errors
/// None today.
pub fn run(args: &DubinsArgs) -> Result<String> {
    let from = Pose::new(Point::new(0.0, 0.0), 0.0);
    let mut stream = 1u64;
    let mut unit = || {
        // Weyl sequence with a mixing step: the same goals in every run.
        stream = stream.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = stream;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    };
    let goals: Vec<Pose> = (0..args.n)
        .map(|_| {
            let at = Point::new(24.0 * unit() - 12.0, 24.0 * unit() - 12.0);
            Pose::new(at, core::f64::consts::TAU * unit())
        })
        .collect();
    let mut each_us = Vec::new();
    for batch in goals.chunks(BATCH) {
        let ((), us) = timed(|| {
            for &to in batch {
                black_box(dubins::length_m(from, to, 1.0));
            }
        });
        each_us.push(us / batch.len() as f64);
    }
    Ok(serde_json::to_string(&Answer {
        n: args.n,
        times: Times::of(each_us),
    })?)
}
