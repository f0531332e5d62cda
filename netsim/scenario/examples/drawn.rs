//! Storms of missions that nobody thought of, one scenario a seed:
//! `cargo run --release -p skein-scenario --example drawn -- 0..100`.
//!
//! The first argument may be one seed alone, too. A second one says how many storms of each are
//! flown, 2 without it; if it is `text`, the scenario is printed as it would stand in a file. Prints a line for each
//! scenario, and what broke. Exit code 1 if anything did.

use skein_netsim::prepared::Prepared;
use skein_netsim::runs::{Wanted, failure_free_makespan_ms, storm};
use skein_peer::CoverageTask;
use skein_scenario::Seeds;
use skein_scenario::drawn::{Drawn, drawn};
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut args = std::env::args().skip(1);
    let seeds = args.next().unwrap_or_else(|| "0..20".to_owned());
    let one = seeds.parse::<u64>().ok();
    let one = one.and_then(|n| {
        Some(Seeds {
            from: n,
            to: n.checked_add(1)?,
        })
    });
    let Seeds { from, to } = match one.map_or_else(|| seeds.parse(), Ok) {
        Ok(seeds) => seeds,
        Err(e) => {
            eprintln!("{e}");
            return ExitCode::from(2);
        }
    };
    let storms = args.next().unwrap_or_else(|| "2".to_owned());
    if storms == "text" {
        for seed in from..to {
            match drawn(seed) {
                Ok(drawn) => print!("{}", drawn.text),
                Err(e) => eprintln!("{seed}: {e}"),
            }
        }
        return ExitCode::SUCCESS;
    }
    let Ok(storms) = storms.parse::<u64>() else {
        eprintln!("{storms:?} is no number of storms");
        return ExitCode::from(2);
    };
    let (mut failed, mut flown) = (Vec::new(), 0);
    for seed in from..to {
        match drawn(seed) {
            Ok(drawn) => {
                flown += storms;
                let broken = fly(seed, &drawn, storms);
                failed.extend((broken > 0).then_some(seed));
            }
            Err(e) => println!("{seed}: nothing of it can be flown: {e}"),
        }
    }
    println!("{flown} storms, failed seeds {failed:?}");
    if failed.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// Flies a scenario in so many storms, says what it is and what broke; returns how many failed.
fn fly(seed: u64, drawn: &Drawn, storms: u64) -> usize {
    let scenario = &drawn.scenario;
    let what = match scenario.spec.mission.task {
        CoverageTask::Area => "lanes",
        CoverageTask::Exact => "passes",
        CoverageTask::Points(_) => "points",
        CoverageTask::Lines(_) => "lines",
    };
    let left_out = scenario.survey.left_out(&scenario.geometry).len();
    println!(
        "{seed}: {what}, {} UAVs, {} cells, {left_out} left out, {} zones; {} refused before",
        scenario.spec.uavs.len(),
        scenario.summary.cells,
        scenario.spec.zones.len(),
        drawn.refused.len(),
    );
    let prepared = Prepared::new(scenario.spec.clone());
    let free_ms = failure_free_makespan_ms(&prepared);
    let run = |n: u64| storm(&prepared, n, free_ms, Wanted::default());
    let mut failed = 0;
    for n in 1..=storms {
        let run = run(n);
        failed += usize::from(!run.report.passed);
        for v in run.violations().iter().take(4) {
            let (at_ms, peer, text) = (v.time_ms, v.peer, &v.text);
            println!(
                "  storm {n}: {} at {at_ms} ms, peer {peer:?}: {text}",
                v.check
            );
        }
        if !run.report.passed && run.violations().is_empty() {
            println!("  storm {n}: {:?}", run.report.reasons);
        }
    }
    failed
}
