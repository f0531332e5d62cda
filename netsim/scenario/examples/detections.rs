//! Missions that look for something besides what they are to see, run by run: what was told, by
//! whom, how soon and how far off, and for how long it was followed.
//!
//! `cargo run --release -p skein-scenario --example detections -- lookout,search 1,3,8 0..10 storm`
//!
//! Faults are `none` or what the `storm` of the seed draws.

#[path = "shared/campaign.rs"]
mod campaign;
mod shared;

use campaign::{Campaign, Flown, Teller};
use std::process::ExitCode;

struct Detections;

impl Teller for Detections {
    fn tell(&mut self, flown: &Flown<'_>) {
        let r = &flown.outcome.report;
        println!("{flown}, {} {:?}", flown.times(), r.reasons);
        for task in &r.tasks {
            println!("  {}", task.line());
        }
        for told in &r.detections {
            println!("  {}", told.line());
        }
    }
}

fn main() -> ExitCode {
    match Campaign::of_arguments("lookout,search", "1,3,8") {
        Ok(campaign) => campaign.fly(&mut Detections),
        Err(code) => code,
    }
}
