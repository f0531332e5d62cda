//! `plan` and `bench` without the rest of `skein`: the same verbs, built in seconds.

use clap::{Parser, Subcommand};
use skein_workbench::bench::BenchArgs;
use std::process::ExitCode;

/// Plans for a person, and measurements of the planners.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Measures a planner and prints one JSON object.
    Bench(BenchArgs),
}

fn main() -> ExitCode {
    let answer = match &Cli::parse().verb {
        Verb::Bench(args) => skein_workbench::bench::run(args),
    };
    match answer {
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
