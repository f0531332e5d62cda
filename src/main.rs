//! The `skein` command: arguments in, text out, no logic of its own.

// What a verb tells goes through `exit::print`: a closed pipe is no defect.
#![deny(clippy::print_stdout)]

mod bench;
mod chaos;
mod check;
mod cli;
mod console;
mod exit;
mod export;
mod hint;
mod log;
mod mission;
mod nfz;
mod observe;
mod onlookers;
mod page;
mod peer;
mod places;
mod plan;
mod replay;
mod report;
mod scenario_args;
mod schema;
mod shell;
mod sim;
mod task;
mod trial;
mod watch;
mod why;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = cli::Cli::parse_from(std::env::args_os().map(cli::south_or_west));
    match cli::run(&cli) {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error:#}");
            let asked_wrongly =
                error.is::<page::ServerError>() || error.is::<onlookers::NoTerminal>();
            ExitCode::from(if asked_wrongly {
                exit::USAGE
            } else {
                exit::INTERNAL
            })
        }
    }
}
