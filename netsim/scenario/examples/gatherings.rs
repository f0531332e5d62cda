//! Missions that watch a mass event, run by run: what is told of the people there and of where they
//! are too dense, beside the truth.
//!
//! `cargo run --release -p skein-scenario --example gatherings -- event 1,3,8 0..10 storm`
//!
//! Faults are those of the scenario, none where that is `calm`, or what the `storm` of the seed draws.

#[path = "shared/campaign.rs"]
mod campaign;
mod shared;

use campaign::{Campaign, Flown, Teller};
use skein_netsim::CrowdReport;
use std::process::ExitCode;

/// All runs together.
#[derive(Debug, Default)]
struct Totals {
    runs: u32,
    broken: u32,
    ranges: (u32, u32),
    then: (u32, u32),
    now: (u32, u32),
    told: usize,
    untold: usize,
    near: u32,
    /// From when a sector truly was too dense to the look, and from the look to the ground
    /// station, ms.
    to_look: Vec<u64>,
    to_ground: Vec<u64>,
    kbps: Vec<f64>,
    /// How long sectors were known to be too dense, in somebody's picture of that, and how long
    /// somebody circled above, ms.
    dense: (u64, u64, u64),
    /// How long after something was too dense somebody circled, ms.
    to_circle: Vec<u64>,
}

fn at(mut all: Vec<u64>, share: f64) -> f64 {
    all.sort_unstable();
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "some thousands"
    )]
    let nth = (share * (all.len().max(1) - 1) as f64).round() as usize;
    all.get(nth).map_or(0.0, |ms| *ms as f64 / 1e3)
}

impl Totals {
    fn add(&mut self, r: &CrowdReport) {
        let sum = |a: (u32, u32), b: (u32, u32)| (a.0 + b.0, a.1 + b.1);
        self.ranges = sum(self.ranges, r.ranges);
        self.then = sum(self.then, r.people_then);
        self.now = sum(self.now, r.people_now);
        self.told += r.episodes.0;
        self.untold += r.episodes.1.untold;
        let w = &r.watched;
        let (all, pictured, circled) = self.dense;
        self.dense = (
            all + w.dense_ms,
            pictured + w.pictured_ms,
            circled + w.circled_ms,
        );
        self.to_circle.extend(&w.after_ms);
        for a in &r.alerts {
            match a.truly_since_ms {
                Some(ms) => self.to_look.push(a.told.since_ms.saturating_sub(ms)),
                None => self.near += 1,
            }
            if let Some(ms) = a.ground_ms {
                self.to_ground.push(ms.saturating_sub(a.told.since_ms));
            }
        }
    }

    fn line(&self) -> String {
        let most = self.kbps.iter().copied().fold(0.0, f64::max);
        let mean = self.kbps.iter().sum::<f64>() / (self.kbps.len().max(1) as f64);
        format!(
            "{} runs, {} failed; sectors in range {} of {}; all people {} of {}, as they walk {} of {}; too dense {} told, {} not; {} told near to it; seen after p50 {:.0} s p95 {:.0} s, on the ground {:.1} s and {:.1} s later, at most {:.1} s; too dense for {} s, in a picture for {} s of that; circled above for {} s, {} times after p50 {:.0} s p95 {:.0} s; crowd records {mean:.1} kbit/s, at most {most:.1}",
            self.runs,
            self.broken,
            self.ranges.0,
            self.ranges.1,
            self.then.0,
            self.then.1,
            self.now.0,
            self.now.1,
            self.told,
            self.untold,
            self.near,
            at(self.to_look.clone(), 0.5),
            at(self.to_look.clone(), 0.95),
            at(self.to_ground.clone(), 0.5),
            at(self.to_ground.clone(), 0.95),
            at(self.to_ground.clone(), 1.0),
            self.dense.0 / 1_000,
            self.dense.1 / 1_000,
            self.dense.2 / 1_000,
            self.to_circle.len(),
            at(self.to_circle.clone(), 0.5),
            at(self.to_circle.clone(), 0.95),
        )
    }
}

impl Teller for Totals {
    fn tell(&mut self, flown: &Flown<'_>) {
        let r = &flown.outcome.report;
        self.runs += 1;
        self.broken += u32::from(!r.passed);
        println!("{flown}, {} {:?}", flown.times(), r.reasons);
        if let Some(simulated) = &r.simulated {
            let bytes = simulated.bytes_by_kind.get("crowd").copied().unwrap_or(0);
            #[allow(clippy::cast_precision_loss, reason = "far below 2^52")]
            self.kbps.push(bytes as f64 * 8.0 / r.end_ms.max(1) as f64);
            println!("  bytes by kind: {:?}", simulated.bytes_by_kind);
        }
        for told in r.crowd.iter() {
            told.lines().iter().for_each(|line| println!("  {line}"));
            self.add(told);
        }
    }

    fn conclude(&mut self, name: &str, uavs: u16) {
        println!("{name} {uavs} uavs: {}", core::mem::take(self).line());
    }
}

fn main() -> ExitCode {
    match Campaign::of_arguments("event", "1,3,8") {
        Ok(campaign) => campaign.fly(&mut Totals::default()),
        Err(code) => code,
    }
}
