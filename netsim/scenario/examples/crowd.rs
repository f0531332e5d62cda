//! How a scenario goes with more or fewer UAVs, on other radios:
//! `cargo run -p skein-scenario --example crowd -- helsinki 8,20,50 64000 1..3 2`.
//!
//! The arguments are a scenario, numbers of UAVs, bit rates, seeds, and how many UAVs are
//! killed, one every five seconds from the 60th on; otherwise there are no faults. Prints a
//! line a run.

use skein_netsim::fault::{Fault, TimedFault};
use skein_netsim::history::What;
use skein_netsim::prepared::Prepared;
use skein_netsim::runs::{Wanted, run};
use skein_netsim::swarm::Outcome;
use skein_peer::Report;
use skein_scenario::{Overrides, Seeds, open};
use std::collections::BTreeSet;
use std::process::ExitCode;
use std::time::Instant;

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let arg = |i: usize, default: &str| args.get(i).map_or(default, String::as_str).to_owned();
    let numbers =
        |text: &str| -> Vec<u32> { text.split(',').filter_map(|n| n.parse().ok()).collect() };
    let (peers, rates) = (numbers(&arg(1, "8")), numbers(&arg(2, "64000")));
    let (seeds, kills) = (arg(3, "1..2"), arg(4, "0").parse().unwrap_or(0));
    let seeds = match seeds.parse::<Seeds>() {
        Ok(seeds) => seeds,
        Err(e) => {
            eprintln!("{e}");
            return ExitCode::from(2);
        }
    };
    for n in &peers {
        for rate_bps in &rates {
            let over = Overrides {
                peers: u16::try_from(*n).ok(),
                ..Overrides::default()
            };
            let mut spec = match open(Some(&arg(0, "helsinki")), &over) {
                Ok(scenario) => scenario.spec,
                Err(e) => {
                    eprintln!("{e}");
                    return ExitCode::from(2);
                }
            };
            spec.radio.rate_bps = *rate_bps;
            let faults = deaths(kills, spec.uavs.iter().map(|u| u.id));
            let prepared = Prepared::new(spec);
            for seed in seeds.from..seeds.to {
                let wanted = Wanted {
                    events: true,
                    ..Wanted::default()
                };
                let started = Instant::now();
                let outcome = run(&prepared, seed, faults.clone(), wanted);
                tell(*n, *rate_bps, &outcome, started.elapsed().as_secs_f64());
            }
        }
    }
    ExitCode::SUCCESS
}

/// Every third UAV, one every five seconds.
fn deaths(kills: u64, uavs: impl Iterator<Item = u16>) -> Vec<TimedFault> {
    let victims = uavs.skip(1).step_by(3).zip(0..kills);
    victims
        .map(|(peer, i)| TimedFault {
            at_ms: 60_000 + 5_000 * i,
            fault: Fault::Kill { peer },
        })
        .collect()
}

fn tell(n: u32, rate_bps: u32, outcome: &Outcome, wall_s: f64) {
    let report = &outcome.report;
    let rounds: BTreeSet<u32> = outcome
        .entries
        .iter()
        .filter_map(|e| match &e.what {
            What::Report {
                report: Report::Round { counter, .. },
                ..
            } => Some(*counter),
            _ => None,
        })
        .collect();
    let mut detections: Vec<u64> = report
        .kills
        .iter()
        .flat_map(|k| k.detections_ms.values().copied())
        .collect();
    detections.sort_unstable();
    let part = |percent: usize| {
        let i = (detections.len() * percent / 100).min(detections.len().saturating_sub(1));
        detections.get(i).copied().unwrap_or(0)
    };
    let ran_s = report.peer_ms as f64 / 1000.0;
    let kinds = report.simulated.as_ref().map(|s| &s.bytes_by_kind);
    let kinds: Vec<String> = kinds
        .into_iter()
        .flatten()
        .map(|(kind, bytes)| format!("{kind} {:.0}", *bytes as f64 / ran_s))
        .collect();
    println!(
        "{n} UAVs {rate_bps} bit/s seed {}: makespan {:?} ms, {:.2} of the work bound, end {} ms; false downs {}; rounds {}; detection p50 {} p95 {} ms; lost by collision {}; bytes/s a peer: {}; violations {:?}; {:.0} times real time",
        report.seed,
        report.makespan_ms,
        report.makespan_over_work_bound.unwrap_or(0.0),
        report.end_ms,
        outcome.false_downs().len(),
        rounds.len(),
        part(50),
        part(95),
        report.radio.lost.get("collision").copied().unwrap_or(0),
        kinds.join(", "),
        report.violations.as_ref().map(|v| &v.counts),
        report.end_ms as f64 / 1000.0 / wall_s,
    );
    for down in outcome.false_downs().iter().take(12) {
        println!("    {down:?}");
    }
    for v in outcome.violations().iter().take(6) {
        println!(
            "    {} at {} ms, peer {:?}: {}",
            v.check, v.time_ms, v.peer, v.text
        );
    }
}
