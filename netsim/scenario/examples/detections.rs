//! Missions that look for something besides what they are to see, run by run: what was told, by
//! whom, how soon and how far off, and for how long it was followed.
//!
//! `cargo run --release -p skein-scenario --example detections -- lookout,search 1,3,8 0..10 storm`
//!
//! Faults are `none` or what the `storm` of the seed draws.

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
    let lines = args.iter().any(|a| a == "timeline");
    let mut passed = true;
    for name in arg(0, "lookout,search").split(',') {
        for n in arg(1, "1,3,8").split(',').filter_map(|n| n.parse().ok()) {
            let prepared = match shared::scenario(name, n, None) {
                Ok(scenario) => Prepared::new(scenario.spec),
                Err(code) => return code,
            };
            let free_ms = (arg(3, "none") == "storm").then(|| failure_free_makespan_ms(&prepared));
            for seed in seeds.from..seeds.to {
                let wanted = Wanted {
                    events: lines,
                    ..Wanted::default()
                };
                let outcome = match free_ms {
                    Some(free_ms) => storm(&prepared, seed, free_ms, wanted),
                    None => run(&prepared, seed, prepared.spec.faults.clone(), wanted),
                };
                let r = &outcome.report;
                passed &= r.passed;
                println!(
                    "{name} {n} uavs, seed {seed}: {}, over {:?} ms, end {} ms {:?}",
                    if r.passed { "passed" } else { "FAILED" },
                    r.makespan_ms,
                    r.end_ms,
                    r.reasons
                );
                for task in &r.tasks {
                    println!("  {}", task.line());
                }
                for told in &r.detections {
                    println!("  {}", told.line());
                }
                for v in outcome.violations() {
                    println!(
                        "  {} at {} ms, {:?}: {}",
                        v.check, v.time_ms, v.peer, v.text
                    );
                }
                if lines {
                    println!("{}", skein_netsim::timeline::timeline(&outcome.entries));
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
