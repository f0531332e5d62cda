//! Many encounters at once.

use crate::seeds;
use skein_netsim::encounters::scene::Scene;
use skein_netsim::encounters::totals::{Tally, Totals};
use skein_netsim::encounters::{self, Radio};
use std::num::NonZeroUsize;
use std::ops::Range;

/// Flies a scene with each of the seeds; the answer does not depend on `jobs`, the threads.
#[must_use]
pub fn fly(scene: Scene, radio: Radio, range: Range<u64>, jobs: Option<NonZeroUsize>) -> Totals {
    let run = |seed| encounters::run(scene, radio, seed);
    let add = |tally: &mut Tally, seed, run| tally.add(seed, &run);
    seeds::tally(range, jobs, Tally::default(), run, add).totals()
}
