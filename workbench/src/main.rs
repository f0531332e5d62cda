//! `plan` and `bench` without the rest of `skein`: the same verbs, built in seconds.

use clap::{Parser, Subcommand};
use skein_workbench::bench::BenchArgs;
use skein_workbench::plan::PlanArgs;
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
    /// Plans for a person, from files as other programs write them.
    Plan(PlanArgs),
}

fn main() -> ExitCode {
    let answer = match &Cli::parse().verb {
        Verb::Bench(args) => skein_workbench::bench::run(args),
        Verb::Plan(args) => skein_workbench::plan::run(args),
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
