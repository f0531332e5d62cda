//! What many runs come to.

use super::{Outcome, Run};
use serde::{Deserialize, Serialize};

/// What one algorithm came to, over all runs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Column {
    /// Runs.
    pub runs: u64,
    /// Runs that came to no agreement in time.
    pub disagreed: u64,
    /// Tasks that two UAVs list at the end.
    pub conflicts: u64,
    /// Tasks that somebody could do and nobody lists at the end.
    pub unassigned: u64,
    /// Value over that of sequential greedy: mean, and the least of all runs.
    pub value_ratio_greedy: Option<f64>,
    /// The least of all runs.
    pub value_ratio_greedy_min: Option<f64>,
    /// Value over the optimum: mean; nothing where it is not known.
    pub value_ratio_optimum: Option<f64>,
    /// The least of all runs.
    pub value_ratio_optimum_min: Option<f64>,
    /// Rounds until no list changed any more: half of the runs that agreed took no more.
    pub rounds_p50: Option<u32>,
    /// And 99 in a hundred.
    pub rounds_p99: Option<u32>,
    /// Transmissions until all agreed, of all peers together: mean of the runs that did.
    pub messages: f64,
    /// Their bytes: mean.
    pub bytes: f64,
}

/// Both algorithms on the same instances.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Totals {
    /// The auction of a peer.
    #[serde(flatten)]
    pub registers: Column,
    /// The published algorithm.
    pub cbba: Column,
    /// Seeds in which the auction of a peer came to no agreement, left a conflict or a task,
    /// or to less than sequential greedy where there was no partition: the first of them.
    pub failed_seeds: Vec<u64>,
}

/// Seeds that failed are listed up to this many.
const LISTED: usize = 20;

/// Sums of one algorithm.
#[derive(Clone, Debug, Default)]
struct Sums {
    column: Column,
    greedy: Vec<f64>,
    optimum: Vec<f64>,
    rounds: Vec<u32>,
    messages: u64,
    bytes: u64,
}

#[allow(clippy::cast_precision_loss, reason = "counts are far below 2^53")]
fn ratio(value: u64, of: u64) -> f64 {
    if of == 0 {
        1.0
    } else {
        value as f64 / of as f64
    }
}

/// Mean and least; the sum is of sorted parts, so that the order of the runs does not show.
fn mean_and_least(mut ratios: Vec<f64>) -> (Option<f64>, Option<f64>) {
    ratios.sort_by(f64::total_cmp);
    let least = ratios.first().copied();
    let mean = least.map(|_| ratios.iter().sum::<f64>() / ratios.len() as f64);
    (mean, least)
}

impl Sums {
    fn add(&mut self, out: &Outcome, run: &Run) {
        let c = &mut self.column;
        c.runs += 1;
        c.disagreed += u64::from(out.rounds.is_none());
        c.conflicts += u64::from(out.conflicts);
        c.unassigned += u64::from(out.unassigned);
        self.greedy.push(ratio(out.value, run.greedy_value));
        let optimum = run.optimum_value.map(|best| ratio(out.value, best));
        self.optimum.extend(optimum);
        if let Some(rounds) = out.rounds {
            self.rounds.push(rounds);
            self.messages += out.messages;
            self.bytes += out.bytes;
        }
    }

    fn column(mut self) -> Column {
        self.rounds.sort_unstable();
        let at = |hundredths: usize| {
            let last = self.rounds.len().checked_sub(1)?;
            let nth = (self.rounds.len() * hundredths / 100).min(last);
            self.rounds.get(nth).copied()
        };
        let (greedy, greedy_min) = mean_and_least(self.greedy);
        let (optimum, optimum_min) = mean_and_least(self.optimum);
        let agreed = self.rounds.len().max(1) as u64;
        Column {
            rounds_p50: at(50),
            rounds_p99: at(99),
            value_ratio_greedy: greedy,
            value_ratio_greedy_min: greedy_min,
            value_ratio_optimum: optimum,
            value_ratio_optimum_min: optimum_min,
            messages: ratio(self.messages, agreed),
            bytes: ratio(self.bytes, agreed),
            ..self.column
        }
    }
}

/// Collects runs in any order: what comes of it does not depend on it.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    registers: Sums,
    cbba: Sums,
    failed: Vec<u64>,
}

impl Tally {
    /// Adds a run.
    pub fn add(&mut self, seed: u64, partition: bool, run: &Run) {
        self.registers.add(&run.registers, run);
        self.cbba.add(&run.cbba, run);
        let out = &run.registers;
        let poor = !partition && out.value < run.greedy_value;
        if out.rounds.is_none() || out.conflicts > 0 || out.unassigned > 0 || poor {
            self.failed.push(seed);
        }
    }

    /// What all of them come to.
    #[must_use]
    pub fn totals(mut self) -> Totals {
        self.failed.sort_unstable();
        self.failed.truncate(LISTED);
        Totals {
            registers: self.registers.column(),
            cbba: self.cbba.column(),
            failed_seeds: self.failed,
        }
    }
}
