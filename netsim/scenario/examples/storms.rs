//! Many storms of one scenario, without the rest of the program:
//! `cargo run -p skein-scenario --example storms -- helsinki 0..200`.
//!
//! A third argument, `base` or `spread`, says where the UAVs begin. Prints each run that failed and the rules it broke. Exit code 1 if any did, so that a
//! mistake put into the code on purpose is noticed or not.

use skein_netsim::prepared::Prepared;
use skein_netsim::runs::{Wanted, failure_free_makespan_ms, storm};
use skein_netsim::summary::summarise;
use skein_scenario::{Overrides, Seeds, open};
use std::collections::BTreeMap;
use std::process::ExitCode;

fn main() -> ExitCode {
    let mut args = std::env::args().skip(1);
    let name = args.next().unwrap_or_else(|| "helsinki".to_owned());
    let seeds = args.next().unwrap_or_else(|| "0..20".to_owned());
    let Seeds { from, to } = match seeds.parse() {
        Ok(seeds) => seeds,
        Err(e) => {
            eprintln!("{e}");
            return ExitCode::from(2);
        }
    };
    let launch = match args.next().map(|word| word.parse()).transpose() {
        Ok(launch) => launch,
        Err(e) => {
            eprintln!("{e}");
            return ExitCode::from(2);
        }
    };
    let over = Overrides {
        launch,
        ..Overrides::default()
    };
    let scenario = match open(Some(&name), &over) {
        Ok(scenario) => scenario,
        Err(e) => {
            eprintln!("{e}");
            return ExitCode::from(2);
        }
    };
    let prepared = Prepared::new(scenario.spec);
    let free_ms = failure_free_makespan_ms(&prepared);
    let mut runs = Vec::new();
    let mut told: BTreeMap<String, u32> = BTreeMap::new();
    for seed in from..to {
        let wanted = Wanted {
            events: to == from + 1,
            ..Wanted::default()
        };
        let run = storm(&prepared, seed, free_ms, wanted);
        for e in &run.entries {
            println!("{} {:?}", e.time_ms, e.what);
        }
        for v in run.violations() {
            let n = told.entry(v.check.clone().into_owned()).or_default();
            *n += 1;
            if *n <= 12 {
                println!(
                    "seed {seed} {} at {} ms, peer {:?}: {}",
                    v.check, v.time_ms, v.peer, v.text
                );
            }
        }
        for kill in run.report.kills.iter().filter(|_| to == from + 1) {
            println!("{kill:?}");
        }
        for down in run.false_downs() {
            println!("seed {seed} {down:?}");
        }
        if !run.report.passed && run.violations().is_empty() {
            println!("seed {seed} failed: {:?}", run.report.reasons);
        }
        runs.push(run);
    }
    let mut summary = summarise(runs, 1.0);
    summary.judge_batch(&prepared.spec);
    println!("history {}", summary.history_hash);
    println!("violations {:?}", summary.violations);
    println!(
        "pace {:?}\nidle {:?}",
        summary.makespan_over_work_bound, summary.idle_share
    );
    println!("takeover {:?}", summary.takeover_s);
    println!("reached {:?}", summary.reached);
    println!("struck {:?}", summary.struck);
    println!("liveness {:?}", summary.liveness_share);
    println!(
        "false downs {:.3} {:.3}",
        summary.false_downs_per_peer_hour, summary.false_downs_per_peer_hour_at_any_loss
    );
    println!("failed seeds {:?}", summary.failed_seeds);
    if summary.failed_seeds.is_empty() && summary.violations.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
