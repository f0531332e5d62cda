//! How long a swarm takes, over the work bound and over a coordinator that knows all:
//! `cargo run --release -p skein-scenario --example pace -- helsinki 1000..1020 none --peers 8`.
//!
//! The third argument is `none` (no faults), `kills` (three UAVs lost for good as in the
//! `helsinki` trial, nothing else), `planned` (the scenario's own faults) or `storm`.
//! `--spread` has all begin round the loop; `--rate BPS` changes the radio; `--backtracking`
//! the division.

use skein_flight::coverage::ring::division::Rule;
use skein_netsim::fault::Fault;
use skein_netsim::prepared::Prepared;
use skein_netsim::runs::{Wanted, failure_free_makespan_ms, run, storm};
use skein_netsim::summary::Spread;
use skein_scenario::{Launch, Overrides, Seeds, open};
use std::process::ExitCode;
use std::sync::Arc;

fn main() -> ExitCode {
    match told() {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::from(2)
        }
    }
}

fn told() -> Result<(), String> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [name, seeds, faults, ..] = &args[..] else {
        return Err("expected: SCENARIO 1000..1020 none|kills|planned|storm".to_owned());
    };
    let number = |flag: &str| -> Option<u32> {
        let at = args.iter().position(|a| a == flag)?;
        args.get(at + 1)?.parse().ok()
    };
    let over = Overrides {
        peers: number("--peers").and_then(|n| u16::try_from(n).ok()),
        launch: args
            .iter()
            .any(|a| a == "--spread")
            .then_some(Launch::Spread),
        ..Overrides::default()
    };
    let scenario = open(Some(name), &over).map_err(|e| e.to_string())?;
    let mut spec = scenario.spec;
    if let Some(rate_bps) = number("--rate") {
        spec.radio.rate_bps = rate_bps;
    }
    if args.iter().any(|a| a == "--backtracking") {
        Arc::make_mut(&mut spec.mission).division = Rule::Backtracking;
    }
    let seeds: Seeds = seeds.parse()?;
    let prepared = Prepared::new(spec);
    let free_ms = failure_free_makespan_ms(&prepared);
    let wanted = Wanted {
        baseline: true,
        ..Wanted::default()
    };
    let kept = |f: &Fault| match faults.as_str() {
        "kills" => matches!(f, Fault::Kill { .. }),
        _ => faults == "planned",
    };
    let mut planned = prepared.spec.faults.clone();
    planned.retain(|f| kept(&f.fault));
    let (mut over_bound, mut over_baseline, mut failed) = (Vec::new(), Vec::new(), Vec::new());
    let mut false_downs = 0;
    for seed in seeds.from..seeds.to {
        let o = if faults == "storm" {
            storm(&prepared, seed, free_ms, wanted)
        } else {
            run(&prepared, seed, planned.clone(), wanted)
        };
        let swarm = o.report.simulated.as_ref();
        false_downs += swarm.map_or(0, |s| s.false_downs.len());
        over_bound.extend(o.report.makespan_over_work_bound);
        over_baseline.extend(o.report.makespan_over_baseline);
        if !o.report.passed {
            failed.push(seed);
            eprintln!("seed {seed}: {:?}", o.report.reasons);
            for v in o.violations().iter().take(3) {
                eprintln!(
                    "  {} at {} ms, peer {:?}: {}",
                    v.check, v.time_ms, v.peer, v.text
                );
            }
        }
    }
    let (a, b) = (Spread::of(over_bound), Spread::of(over_baseline));
    println!(
        "{}: over the work bound p50 {:.2} p95 {:.2} max {:.2}; over a coordinator p50 {:.2} p95 {:.2}; false downs {false_downs}; failed {failed:?}",
        args.join(" "),
        a.p50,
        a.p95,
        a.max,
        b.p50,
        b.p95
    );
    Ok(())
}
