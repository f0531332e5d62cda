//! What many encounters come to.

use super::Encounter;
use serde::{Deserialize, Serialize};

/// Sums over the runs of a bench, with the fields that it prints.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Totals {
    /// Runs that were flown.
    pub runs: u64,
    /// Moments at which two UAVs came within the separation.
    pub losses_of_separation: u64,
    /// The nearest approach of all runs, metres; nothing if nobody met anybody.
    pub min_separation_m: Option<f64>,
    /// The share of UAVs that arrived.
    pub arrived: f64,
    /// Mean flying time of those that arrived, over that of their direct ways.
    pub time_ratio_mean: Option<f64>,
    /// Different statements in a run, of all its UAVs: 99 in a hundred runs need no more.
    pub messages_p99: Option<u32>,
    /// Transmissions in a run, repetitions included: likewise.
    pub transmissions_p99: Option<u32>,
    /// How far a UAV strayed at most from what it had promised, metres.
    pub strayed_max_m: f64,
    /// Runs whose beginning left no room for everybody's loiter: they are not flown, and
    /// count nowhere else.
    pub no_escape: u64,
    /// Seeds with a loss of separation or somebody who did not arrive: the first of them.
    pub failed_seeds: Vec<u64>,
}

/// Seeds that failed are listed up to this many.
const LISTED: usize = 20;

/// Collects runs in any order: what comes of it does not depend on it.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    totals: Totals,
    uavs: u64,
    arrived: u64,
    ratios: Vec<(u64, f64)>,
    messages: Vec<u32>,
    transmissions: Vec<u32>,
    failed: Vec<u64>,
}

impl Tally {
    /// Adds a run.
    pub fn add(&mut self, seed: u64, run: &Encounter) {
        let t = &mut self.totals;
        if run.no_escape {
            t.no_escape += 1;
            return;
        }
        t.runs += 1;
        t.losses_of_separation += u64::from(run.losses_of_separation);
        if run.min_separation_m.is_finite() {
            let before = t.min_separation_m.unwrap_or(f64::INFINITY);
            t.min_separation_m = Some(before.min(run.min_separation_m));
        }
        t.strayed_max_m = t.strayed_max_m.max(run.strayed_m);
        self.uavs += u64::from(run.uavs);
        self.arrived += u64::from(run.arrived);
        self.ratios
            .push((run.time_ratios.len() as u64, run.time_ratios.iter().sum()));
        self.messages.push(run.messages);
        self.transmissions.push(run.transmissions);
        if run.losses_of_separation > 0 || run.arrived < run.uavs {
            self.failed.push(seed);
        }
    }

    /// What all of them come to.
    #[must_use]
    #[allow(clippy::cast_precision_loss, reason = "counts are far below 2^53")]
    pub fn totals(mut self) -> Totals {
        let mut totals = self.totals;
        totals.arrived = if self.uavs == 0 {
            0.0
        } else {
            self.arrived as f64 / self.uavs as f64
        };
        // Sums are of sorted parts, so that the order of the runs does not show.
        self.ratios.sort_by(|a, b| a.1.total_cmp(&b.1));
        let of: u64 = self.ratios.iter().map(|r| r.0).sum();
        let sum: f64 = self.ratios.iter().map(|r| r.1).sum();
        totals.time_ratio_mean = (of > 0).then(|| sum / of as f64);
        totals.messages_p99 = p99(self.messages);
        totals.transmissions_p99 = p99(self.transmissions);
        self.failed.sort_unstable();
        self.failed.truncate(LISTED);
        totals.failed_seeds = self.failed;
        totals
    }
}

fn p99(mut counts: Vec<u32>) -> Option<u32> {
    counts.sort_unstable();
    let last = counts.len().checked_sub(1)?;
    counts.get((counts.len() * 99 / 100).min(last)).copied()
}
