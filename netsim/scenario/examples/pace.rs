//! How long a swarm takes, over the work bound and over a coordinator that knows all, how soon
//! each peer knows of a death, and how often the living are believed dead:
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
    let (mut false_downs, mut peer_ms, mut detections_s) = (0, 0, Vec::new());
    for seed in seeds.from..seeds.to {
        let o = if faults == "storm" {
            storm(&prepared, seed, free_ms, wanted)
        } else {
            run(&prepared, seed, planned.clone(), wanted)
        };
        for down in o.false_downs() {
            eprintln!("seed {seed}: {down:?}");
        }
        false_downs += o.false_downs().len();
        peer_ms += o.report.peer_ms;
        let detections_ms = o.report.kills.iter().flat_map(|k| k.detections_ms.values());
        detections_s.extend(detections_ms.map(|ms| *ms as f64 / 1000.0));
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
    let detection = Spread::of(detections_s);
    let an_hour = f64::from(u32::try_from(false_downs).unwrap_or(u32::MAX)) * 3.6e6;
    println!(
        "{}: over the work bound p50 {:.2} p95 {:.2} max {:.2}; over a coordinator p50 {:.2} p95 {:.2}; detection p50 {:.1} p95 {:.1} max {:.1} s; false downs {false_downs}, {:.3} a peer-hour; failed {failed:?}",
        args.join(" "),
        a.p50,
        a.p95,
        a.max,
        b.p50,
        b.p95,
        detection.p50,
        detection.p95,
        detection.max,
        an_hour / peer_ms.max(1) as f64,
    );
    Ok(())
}
