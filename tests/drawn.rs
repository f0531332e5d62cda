//! A few missions that nobody thought of, one drawn from each seed, hold in a storm.

use skein_netsim::Prepared;
use skein_netsim::runs::{Wanted, failure_free_makespan_ms, storm};
use skein_scenario::drawn::drawn;

/// More of them are flown by `cargo run --release -p skein-scenario --example drawn`.
const SEEDS: core::ops::Range<u64> = 0..10;

#[test]
fn missions_that_nobody_thought_of_hold() {
    let (mut flown, mut failed) = (0, Vec::new());
    for seed in SEEDS {
        let Ok(drawn) = drawn(seed) else { continue };
        let prepared = Prepared::new(drawn.scenario.spec);
        let free_ms = failure_free_makespan_ms(&prepared);
        let run = storm(&prepared, 1, free_ms, Wanted::default());
        flown += 1;
        if !run.report.passed {
            let broken: Vec<_> = run.violations().iter().take(3).collect();
            failed.push(format!("{seed}: {:?} {broken:?}", run.report.reasons));
        }
    }
    assert!(flown >= 8, "{flown}");
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}
