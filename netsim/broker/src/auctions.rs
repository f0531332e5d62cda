//! Many task auctions at once.

use crate::seeds;
use skein_netsim::auctions::totals::{Tally, Totals};
use skein_netsim::auctions::{self, Setup};
use std::num::NonZeroUsize;
use std::ops::Range;

/// Settles an instance for each of the seeds; the answer does not depend on `jobs`, the
/// threads.
#[must_use]
pub fn settle(setup: Setup, range: Range<u64>, jobs: Option<NonZeroUsize>) -> Totals {
    let run = |seed| auctions::run(setup, seed);
    let add = |tally: &mut Tally, seed, run| tally.add(seed, setup.partition, &run);
    seeds::tally(range, jobs, Tally::default(), run, add).totals()
}
