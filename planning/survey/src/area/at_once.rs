//! Plans made at once, each in a thread: how many processors there are changes nothing.

use std::panic::resume_unwind;
use std::thread;

/// Plans that are made at once.
pub(super) const BATCH: usize = 4;

/// Does something for all of a batch at once; the answers are in its order.
pub(super) fn at_once<T: Send, R: Send>(batch: Vec<T>, f: impl Fn(T) -> R + Sync) -> Vec<R> {
    let f = &f;
    thread::scope(|scope| {
        let begun = batch.into_iter().map(|t| scope.spawn(move || f(t)));
        let begun: Vec<_> = begun.collect();
        let done = begun.into_iter();
        done.map(|t| t.join().unwrap_or_else(|p| resume_unwind(p)))
            .collect()
    })
}
