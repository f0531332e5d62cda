//! Many pursuits at once, on the threads of this machine.

use crate::seeds;
use skein_netsim::pursuit::totals::{Tally, Totals};
use skein_netsim::pursuit::{self, Settings};
use std::num::NonZeroUsize;
use std::ops::Range;

/// Flies a pursuit with each of the seeds; the answer does not depend on `jobs`, the threads.
#[must_use]
pub fn fly(settings: &Settings, seeds: Range<u64>, jobs: Option<NonZeroUsize>) -> Totals {
    let run = |seed| pursuit::run(settings, seed);
    let add = |all: &mut Tally, seed, run| all.add(seed, run);
    seeds::tally(seeds, jobs, Tally::default(), run, add).totals()
}
