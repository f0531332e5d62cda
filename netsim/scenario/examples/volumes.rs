//! Volumes flown in height layers, with other numbers of UAVs, each run to its verdict:
//! `cargo run --release -p skein-scenario --example volumes -- volume 1,3,8 1..4 storm`.
//!
//! The fourth argument is `storm`, `calm` or left out for the faults of the scenario. Prints a
//! row for each number of UAVs; runs that did not pass go before it. Exit code 1 if any did not.

#[path = "shared/campaign.rs"]
mod campaign;
mod shared;

use campaign::{Campaign, Flown, Teller};
use std::process::ExitCode;

/// What all seeds of a row came to.
#[derive(Default)]
struct Row {
    runs: u32,
    passed: u32,
    /// When each layer was seen, seconds, layer by layer.
    seen_s: Vec<Vec<f64>>,
    over_work: Vec<f64>,
    nearest_m: Vec<f64>,
}

fn p(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a place in a short list"
    )]
    let at = (share * values.len() as f64).ceil() as usize;
    values.get(at.max(1) - 1).copied().unwrap_or(f64::NAN)
}

impl Teller for Row {
    fn tell(&mut self, flown: &Flown<'_>) {
        let r = &flown.outcome.report;
        self.runs += 1;
        self.passed += u32::from(r.passed);
        if !r.passed {
            println!("{flown}, {}, {:?}", flown.times(), r.reasons);
        }
        self.seen_s.resize(r.layers.len(), Vec::new());
        for (all, layer) in self.seen_s.iter_mut().zip(&r.layers) {
            all.extend(layer.seen_ms.map(|ms| ms as f64 / 1e3));
        }
        self.over_work.extend(r.makespan_over_work_bound);
        self.nearest_m.extend(r.nearest_approach_m);
    }

    fn conclude(&mut self, name: &str, uavs: u16) {
        let mut row = core::mem::take(self);
        let layers = row.seen_s.iter_mut();
        let seen: Vec<String> = layers.map(|s| format!("{:.0} s", p(s, 0.5))).collect();
        println!(
            "| {name}, {uavs} | {} of {} | {} | {:.2}, {:.2} | {:.1} m |",
            row.passed,
            row.runs,
            seen.join(", "),
            p(&mut row.over_work, 0.5),
            p(&mut row.over_work, 0.95),
            p(&mut row.nearest_m, 0.0),
        );
    }
}

fn main() -> ExitCode {
    println!(
        "| trial, UAVs | passed | layers seen, p50 | time over the work bound, p50, p95 | nearest |"
    );
    println!("|---|---|---|---|---|");
    match Campaign::of_arguments("volume", "1,3,8") {
        Ok(campaign) => campaign.fly(&mut Row::default()),
        Err(code) => code,
    }
}
