//! What is told of a road or a fire beside where it is, with other numbers of UAVs:
//! `cargo run --release -p skein-scenario --example contours -- highway,wildfire 1,2,3 1..4`.
//!
//! A fourth argument, `storm`, draws the faults instead of those of the scenario, and `calm` has
//! none. Prints a line a run, and what was wrong. Exit code 1 if anything was.

#[path = "shared/campaign.rs"]
mod campaign;
mod shared;

use campaign::{Campaign, Flown, Teller};
use std::process::ExitCode;

struct Contours;

impl Teller for Contours {
    fn tell(&mut self, flown: &Flown<'_>) {
        let r = &flown.outcome.report;
        let contour = r.contour.as_ref();
        let line = contour.map_or_else(|| "nobody flew along it".to_owned(), |c| c.line());
        println!("{flown} {:?} {line}", r.reasons);
    }
}

fn main() -> ExitCode {
    match Campaign::of_arguments("highway,wildfire", "1,2,3") {
        Ok(campaign) => campaign.fly(&mut Contours),
        Err(code) => code,
    }
}
