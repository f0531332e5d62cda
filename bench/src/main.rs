//! `skein-bench`: measures a planner or a swarm and prints one JSON object.

use clap::Parser;
use skein_bench::BenchArgs;
use std::process::ExitCode;

/// Measurements of planners and swarms.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100)]
struct Cli {
    #[command(flatten)]
    bench: BenchArgs,
}

fn main() -> ExitCode {
    match skein_bench::run(&Cli::parse().bench) {
        Ok(text) => {
            println!("{text}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(3)
        }
    }
}
