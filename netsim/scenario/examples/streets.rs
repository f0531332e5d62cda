//! Missions that measure how streets are used, run by run: what is told of them and the ways that
//! are hinted, beside the truth.
//!
//! `cargo run --release -p skein-scenario --example streets -- streets 1,3,8 0..10 storm`
//!
//! Faults are those of the scenario, none where that is `calm`, or what the `storm` of the seed draws.

#[path = "shared/campaign.rs"]
mod campaign;
mod shared;

use campaign::{Campaign, Flown, Teller};
use skein_netsim::StreetsReport;
use std::process::ExitCode;

/// All runs together.
#[derive(Debug, Default)]
struct Totals {
    runs: u32,
    density: (u32, u32),
    speed: (u32, u32),
    squares: (f64, f64),
    turns: (u32, u32, u32),
    hints: u32,
    in_range: u32,
    /// Of hints: the true time as a share of the best, and of the shortest way's.
    of_best: Vec<f64>,
    of_shortest: Vec<f64>,
    most_kbps: f64,
}

impl Totals {
    fn add(&mut self, r: &StreetsReport) {
        let sum = |a: (u32, u32), b: (u32, u32)| (a.0 + b.0, a.1 + b.1);
        self.density = sum(self.density, r.density_holds);
        self.speed = sum(self.speed, r.speed_holds);
        self.squares.0 += r.density_off.0;
        self.squares.1 += r.speed_off_mps;
        self.turns.0 += r.turns;
        self.turns.1 += r.turns_wrong;
        self.turns.2 += r.turned;
        for h in &r.hints {
            self.hints += 1;
            let (_, low, high) = h.told_s;
            self.in_range += u32::from((low..=high).contains(&h.true_s));
            self.of_best.push(h.true_s / h.best_s.max(1e-9));
            self.of_shortest.push(h.true_s / h.shortest_s.max(1e-9));
        }
    }

    fn line(&self) -> String {
        let n = f64::from(self.runs.max(1));
        let mean = |all: &[f64]| all.iter().sum::<f64>() / (all.len().max(1) as f64);
        let worst = self.of_best.iter().copied().fold(0.0, f64::max);
        format!(
            "{} runs; density in range {} of {}, off {:.2} a km; speed in range {} of {}, off {:.2} m/s; turns {} told, {} wrong, {} taken; {} hints, {} in range, of the best time {:.2} and {worst:.2} at most, of the shortest way's {:.2}; usage at most {:.2} kbit/s",
            self.runs,
            self.density.0,
            self.density.1,
            self.squares.0 / n,
            self.speed.0,
            self.speed.1,
            self.squares.1 / n,
            self.turns.0,
            self.turns.1,
            self.turns.2,
            self.hints,
            self.in_range,
            mean(&self.of_best),
            mean(&self.of_shortest),
            self.most_kbps
        )
    }
}

impl Teller for Totals {
    fn tell(&mut self, flown: &Flown<'_>) {
        let r = &flown.outcome.report;
        self.runs += 1;
        println!("{flown}, {} {:?}", flown.times(), r.reasons);
        if let Some(simulated) = &r.simulated {
            let bytes = simulated.bytes_by_kind.get("usage").copied().unwrap_or(0);
            #[allow(clippy::cast_precision_loss, reason = "far below 2^52")]
            let kbps = bytes as f64 * 8.0 / r.end_ms.max(1) as f64;
            self.most_kbps = self.most_kbps.max(kbps);
        }
        for told in r.streets.iter() {
            told.lines().iter().for_each(|line| println!("  {line}"));
            self.add(told);
        }
    }

    fn conclude(&mut self, name: &str, uavs: u16) {
        println!("{name} {uavs} uavs: {}", core::mem::take(self).line());
    }
}

fn main() -> ExitCode {
    match Campaign::of_arguments("streets", "1,3,8") {
        Ok(campaign) => campaign.fly(&mut Totals::default()),
        Err(code) => code,
    }
}
