//! `skein bench`: what the algorithms reach, measured on cases drawn from seeds.

mod auction;
mod tracking;

use crate::exit;
use auction::AuctionArgs;
use clap::{Args, Subcommand};
use skein_broker::encounters;
use skein_netsim::encounters::scene::Scene;
use skein_netsim::encounters::{Air, Radio, least_range_m};
use skein_scenario::Seeds;
use std::num::NonZeroUsize;
use std::process::ExitCode;

/// Measures what the algorithms reach, on cases drawn from seeds.
#[derive(Debug, Args)]
pub struct BenchArgs {
    /// What is measured.
    #[command(subcommand)]
    pub what: What,
}

/// What can be measured.
#[derive(Debug, Subcommand)]
pub enum What {
    /// UAVs that would meet, all at one height: 50 m have to stay between any two.
    Conflicts(ConflictsArgs),
    /// UAVs that share tasks, beside the published bundle algorithm.
    Auction(AuctionArgs),
    /// UAVs that follow vehicles on the streets of a town.
    Tracking(tracking::TrackingArgs),
}

/// Fixed wings at one height that would meet, kept apart by promises that change only by
/// agreement (docs/protocol.md §11).
///
/// Without --encounters N of them begin on a circle of 600 m radius, each bound for the
/// opposite side at 20 m/s and 30 degrees of bank. Prints one JSON object; exit code 1 if two
/// came within 50 m or somebody did not arrive.
#[derive(Debug, Args)]
pub struct ConflictsArgs {
    /// UAVs on the circle, 2 to 64.
    #[arg(long, value_name = "N", default_value_t = 8,
          value_parser = clap::value_parser!(u16).range(2..=64))]
    pub n: u16,
    /// Two UAVs instead, 16 to 24 m/s, from any side, that would come near each other.
    #[arg(long, conflicts_with = "n")]
    pub encounters: bool,
    /// The seeds: from A up to but not including B.
    #[arg(long, value_name = "A..B")]
    pub seeds: Seeds,
    /// The share of messages that is lost, drawn for each listener by itself.
    #[arg(long, value_name = "L", default_value_t = 0.0, value_parser = share)]
    pub loss: f64,
    /// How late the others arrive, milliseconds, up to a fifth more.
    #[arg(long, value_name = "D", default_value_t = 0,
          value_parser = clap::value_parser!(u32).range(0..=10_000))]
    pub delay_ms: u32,
    /// No message arrives at all: each UAV has its traffic sensor alone.
    #[arg(long, conflicts_with_all = ["loss", "delay_ms"])]
    pub jam: bool,
    /// Range of the traffic sensor with --jam, metres; without it the least with which the rule
    /// promises anything, which is told.
    #[arg(long, value_name = "M", requires = "jam", value_parser = range)]
    pub range_m: Option<f64>,
    /// Runs at the same time; without it one a processor.
    #[arg(long, value_name = "J")]
    pub jobs: Option<NonZeroUsize>,
}

fn share(text: &str) -> Result<f64, String> {
    let share: f64 = text.parse().map_err(|_| format!("{text:?} is no number"))?;
    if (0.0..=1.0).contains(&share) {
        Ok(share)
    } else {
        Err("a share is between 0 and 1".to_owned())
    }
}

fn range(text: &str) -> Result<f64, String> {
    let range_m: f64 = text.parse().map_err(|_| format!("{text:?} is no number"))?;
    if (0.0..=100_000.0).contains(&range_m) {
        Ok(range_m)
    } else {
        Err("a range is between 0 and 100000 m".to_owned())
    }
}

/// The range of the sensor: what is asked for, or the least that promises anything.
fn sensed_m(asked_m: Option<f64>, scene: Scene) -> f64 {
    let least_m = least_range_m(scene).ceil();
    match asked_m {
        None => eprintln!("note: traffic sensors of {least_m} m"),
        Some(m) if m < least_m => {
            eprintln!("note: below {least_m} m the rule promises nothing");
        }
        Some(_) => {}
    }
    asked_m.unwrap_or(least_m)
}

/// Runs the verb.
///
/// # Errors
/// When stdout cannot be written.
pub fn run(args: &BenchArgs) -> anyhow::Result<ExitCode> {
    match &args.what {
        What::Conflicts(args) => conflicts(args),
        What::Auction(args) => auction::run(args),
        What::Tracking(args) => tracking::run(args),
    }
}

fn conflicts(args: &ConflictsArgs) -> anyhow::Result<ExitCode> {
    let scene = if args.encounters {
        Scene::Pair
    } else {
        Scene::Circle(args.n)
    };
    let radio = if args.jam {
        Radio::Jammed {
            range_m: sensed_m(args.range_m, scene),
        }
    } else {
        Radio::Works(Air {
            loss: args.loss,
            delay_ms: args.delay_ms,
        })
    };
    let seeds = args.seeds.from..args.seeds.to;
    let totals = encounters::fly(scene, radio, seeds, args.jobs);
    exit::print(serde_json::to_string(&totals)?)?;
    let good = totals.failed_seeds.is_empty() && totals.runs > 0;
    Ok(ExitCode::from(if good {
        exit::OK
    } else {
        exit::MISSION_FAILED
    }))
}
