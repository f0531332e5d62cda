//! Many pursuits at once, on the threads of this machine.

use skein_netsim::pursuit::totals::{Tally, Totals};
use skein_netsim::pursuit::{self, Settings};
use std::num::NonZeroUsize;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// Flies a pursuit with each of the seeds; the answer does not depend on `jobs`, the threads.
#[must_use]
pub fn fly(settings: &Settings, seeds: Range<u64>, jobs: Option<NonZeroUsize>) -> Totals {
    let jobs = jobs
        .or_else(|| std::thread::available_parallelism().ok())
        .map_or(1, NonZeroUsize::get);
    let next = AtomicU64::new(seeds.start);
    let tally = Mutex::new(Tally::default());
    let work = || {
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= seeds.end {
                return;
            }
            let run = pursuit::run(settings, seed);
            // A thread that panicked would have ended the scope; the data is whole.
            let mut tally = tally.lock().unwrap_or_else(PoisonError::into_inner);
            tally.add(seed, run);
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(work);
        }
    });
    let tally = tally.into_inner().unwrap_or_else(PoisonError::into_inner);
    tally.totals()
}
