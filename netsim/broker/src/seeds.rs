//! Many seeds at once, on the threads of this machine.

use std::num::NonZeroUsize;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// Runs each of the seeds and adds what it comes to; who adds must not care for the order,
/// so that the answer does not depend on `jobs`, the threads.
#[must_use]
pub fn tally<R, T: Send>(
    seeds: Range<u64>,
    jobs: Option<NonZeroUsize>,
    into: T,
    run: impl Fn(u64) -> R + Sync,
    add: impl Fn(&mut T, u64, R) + Sync,
) -> T {
    let jobs = jobs
        .or_else(|| std::thread::available_parallelism().ok())
        .map_or(1, NonZeroUsize::get);
    let next = AtomicU64::new(seeds.start);
    let tally = Mutex::new(into);
    let work = || {
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= seeds.end {
                return;
            }
            let run = run(seed);
            // A thread that panicked would have ended the scope; the data is whole.
            let mut tally = tally.lock().unwrap_or_else(PoisonError::into_inner);
            add(&mut tally, seed, run);
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(work);
        }
    });
    tally.into_inner().unwrap_or_else(PoisonError::into_inner)
}
