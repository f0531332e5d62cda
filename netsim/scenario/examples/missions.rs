//! Missions with other numbers of UAVs, each to its verdict:
//! `cargo run --release -p skein-scenario --example missions -- border,fire,inspection 1,8 1..4`.
//!
//! A fourth argument, `storm`, draws the faults instead of those of the scenario, and `calm` has
//! none. Prints a line a run: the verdict, when all was over, the longest time between two visits
//! of a place, how much of the open ground was in sight and of how many samples, and what was
//! wrong. Exit code 1 if anything was.

#[path = "shared/campaign.rs"]
mod campaign;
mod shared;

use campaign::{Campaign, Flown, Teller};
use std::process::ExitCode;

struct Times;

impl Teller for Times {
    fn tell(&mut self, flown: &Flown<'_>) {
        let r = &flown.outcome.report;
        let ground = r.coverage.ground;
        println!(
            "{flown}, {}, revisit {:?} ms, late {:?} ms, ground in sight {:?} {:?}",
            flown.times(),
            r.revisit_ms,
            r.revisit_late_ms,
            ground.map(|g| (g.share, g.samples)),
            r.reasons
        );
    }
}

fn main() -> ExitCode {
    match Campaign::of_arguments("border,fire,inspection", "1,8") {
        Ok(campaign) => campaign.fly(&mut Times),
        Err(code) => code,
    }
}
