//! Many simulated runs at the same time, one thread each.

use crate::seeds;
use skein_netsim::Prepared;
use skein_netsim::runs::{self, Wanted};
use skein_netsim::summary::{self, Summary};
use skein_netsim::swarm::Outcome;
use std::num::NonZeroUsize;
use std::ops::Range;
use std::time::Instant;

/// What a batch is to be.
#[derive(Clone, Debug)]
pub struct Batch {
    /// The seeds of the runs.
    pub seeds: Range<u64>,
    /// Whether each run draws its faults from the scenario's storm.
    pub storm: bool,
    /// Runs at the same time; one a processor without it.
    pub jobs: Option<NonZeroUsize>,
}

/// Runs a batch and sums it up: the same figures for any number of jobs. `failed` is told
/// of each run that failed, as soon as it has.
pub fn run(prepared: &Prepared, batch: &Batch, failed: &(dyn Fn(&Outcome) + Sync)) -> Summary {
    let free_ms = batch
        .storm
        .then(|| runs::failure_free_makespan_ms(prepared));
    let wanted = Wanted {
        events: false,
        baseline: true,
    };
    let started = Instant::now();
    let run = |seed| {
        let outcome = match free_ms {
            Some(free_ms) => runs::storm(prepared, seed, free_ms, wanted),
            None => runs::planned(prepared, seed, wanted),
        };
        if !outcome.report.passed {
            failed(&outcome);
        }
        outcome
    };
    let add = |all: &mut Vec<Outcome>, _, outcome| all.push(outcome);
    let outcomes = seeds::tally(batch.seeds.clone(), batch.jobs, Vec::new(), run, add);
    let mut total = summary::summarise(outcomes, started.elapsed().as_secs_f64());
    if batch.storm {
        total.judge_batch(&prepared.spec);
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_netsim::world::fixture;
    use std::sync::atomic::{AtomicU64, Ordering};

    #[test]
    fn any_number_of_jobs_gives_the_same_figures() {
        let mut spec = fixture::square(3);
        // Too short to end: every run fails, and is told of.
        spec.max_time_s = 20;
        let prepared = Prepared::new(spec);
        let run = |jobs: usize| {
            let told = AtomicU64::new(0);
            let batch = Batch {
                seeds: 3..7,
                storm: true,
                jobs: NonZeroUsize::new(jobs),
            };
            let mut summary = run(&prepared, &batch, &|o: &Outcome| {
                told.fetch_add(o.report.seed, Ordering::Relaxed);
            });
            summary.real_time_factor = 0.0;
            (summary, told.into_inner())
        };
        let (one, told) = run(1);
        assert_eq!((one.runs, one.completed, told), (4, 0, 3 + 4 + 5 + 6));
        assert_eq!((one, told), run(3));
    }
}
