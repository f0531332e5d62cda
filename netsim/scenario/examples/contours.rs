//! What is told of a road or a fire beside where it is, with other numbers of UAVs:
//! `cargo run --release -p skein-scenario --example contours -- highway,wildfire 1,2,3 1..4`.
//!
//! A fourth argument, `storm`, draws the faults instead of those of the scenario, and `calm` has
//! none. Prints a line a run, and what was wrong. Exit code 1 if anything was.

mod shared;

use skein_netsim::prepared::Prepared;
use skein_netsim::runs::{Wanted, failure_free_makespan_ms, run, storm};
use std::process::ExitCode;

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let arg = |i: usize, default: &str| args.get(i).map_or(default, String::as_str).to_owned();
    let seeds = match shared::seeds(&arg(2, "1..2")) {
        Ok(seeds) => seeds,
        Err(code) => return code,
    };
    let mut passed = true;
    for name in arg(0, "highway,wildfire").split(',') {
        for n in arg(1, "1,2,3").split(',').filter_map(|n| n.parse().ok()) {
            let prepared = match shared::scenario(name, n, None) {
                Ok(scenario) => Prepared::new(scenario.spec),
                Err(code) => return code,
            };
            let storms = arg(3, "") == "storm";
            let calm = arg(3, "") == "calm";
            let free_ms = storms.then(|| failure_free_makespan_ms(&prepared));
            for seed in seeds.from..seeds.to {
                let outcome = match free_ms {
                    Some(free_ms) => storm(&prepared, seed, free_ms, Wanted::default()),
                    None => run(
                        &prepared,
                        seed,
                        if calm {
                            Vec::new()
                        } else {
                            prepared.spec.faults.clone()
                        },
                        Wanted::default(),
                    ),
                };
                let r = &outcome.report;
                passed &= r.passed;
                let verdict = if r.passed { "passed" } else { "FAILED" };
                let contour = r.contour.as_ref();
                let line = contour.map_or_else(|| "nobody flew along it".to_owned(), |c| c.line());
                println!(
                    "{name} {n} uavs, seed {seed}: {verdict} {:?} {line}",
                    r.reasons
                );
                for v in outcome.violations() {
                    println!(
                        "  {} at {} ms, {:?}: {}",
                        v.check, v.time_ms, v.peer, v.text
                    );
                }
            }
        }
    }
    if passed {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
