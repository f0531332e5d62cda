//! From a percept to its setpoint, by this machine's clock, input by input, while swarms fly and
//! plans are computed for them:
//! `cargo run --release -p skein-scenario --example answers -- swarm_20 1..4 storm`.
//!
//! Told of percepts alone, of percepts that come while a plan is under way for the same UAV (a
//! live peer computes it on another thread, a simulated one between two inputs), and of all other
//! inputs, for which a percept may have to wait. A number at the end is how many threads compute
//! the geometry of the mission over and over meanwhile, as live peers do beside their loops.
//! Exit code 1 if 99 of 100 percepts take longer than 10 ms.

#[allow(dead_code, reason = "each example begins as it needs")]
mod shared;

use skein_netsim::prepared::Prepared;
use skein_netsim::runs::{failure_free_makespan_ms, faults_of};
use skein_netsim::swarm::Swarm;
use skein_netsim::swarm::latency::Asked;
use skein_netsim::swarm::meter::Meter;
use skein_scenario::{Overrides, Seeds, open};
use std::process::ExitCode;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::Instant;

/// Ten milliseconds.
const GOAL_NS: u64 = 10_000_000;

fn main() -> ExitCode {
    told().unwrap_or_else(|code| code)
}

#[allow(
    clippy::disallowed_methods,
    reason = "the clock of the machine is what is measured by"
)]
fn clock_ns() -> u64 {
    static BEGAN: OnceLock<Instant> = OnceLock::new();
    let since = BEGAN.get_or_init(Instant::now).elapsed();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}

fn told() -> Result<ExitCode, ExitCode> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let arg = |i: usize, default: &str| args.get(i).map_or(default, String::as_str).to_owned();
    let seeds = shared::seeds(&arg(1, "1..2"))?;
    let scenario = open(Some(&arg(0, "swarm_20")), &Overrides::default()).map_err(|e| {
        eprintln!("{e}");
        ExitCode::from(2)
    })?;
    let prepared = Prepared::with_geometry(scenario.spec, scenario.geometry);
    let storms = arg(2, "storm") == "storm";
    let free_ms = storms.then(|| failure_free_makespan_ms(&prepared));
    let (over, plans) = (AtomicBool::new(false), AtomicU32::new(0));
    let threads: u32 = arg(3, "0").parse().unwrap_or(0);
    let kept = std::thread::scope(|scope| {
        for _ in 0..threads {
            let mission = std::sync::Arc::clone(&prepared.spec.mission);
            let (over, plans) = (&over, &plans);
            scope.spawn(move || {
                while !over.load(Ordering::Relaxed) {
                    drop(mission.geometry());
                    plans.fetch_add(1, Ordering::Relaxed);
                }
            });
        }
        let kept = fly(&prepared, seeds, free_ms);
        over.store(true, Ordering::Relaxed);
        kept
    });
    println!(
        "{} plans on {threads} threads",
        plans.load(Ordering::Relaxed)
    );
    Ok(if kept {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

/// Whether 99 of 100 percepts of each seed are answered in time.
fn fly(prepared: &Prepared, seeds: Seeds, free_ms: Option<u64>) -> bool {
    let mut kept = true;
    for seed in seeds.from..seeds.to {
        let (prepared, faults) = faults_of(prepared, seed, free_ms);
        let mut swarm = Swarm::new(&prepared, seed, faults, false).measured(Meter::with(clock_ns));
        swarm.run_until(u64::from(prepared.spec.max_time_s) * 1000);
        for asked in Asked::ALL {
            let times = swarm.meter().answers(asked);
            let ms = |ns: u64| ns as f64 / 1e6;
            println!(
                "seed {seed} {}: {} times, p50 {:.3} ms, p99 {:.3} ms, p99.9 {:.3} ms, max {:.3} ms",
                asked.name(),
                times.n(),
                ms(times.quantile_ns(500)),
                ms(times.quantile_ns(990)),
                ms(times.quantile_ns(999)),
                ms(times.max_ns())
            );
        }
        if let Some((ns, plan)) = swarm.meter().longest() {
            println!(
                "seed {seed} longest: {:.3} ms beside {plan}",
                ns as f64 / 1e6
            );
        }
        for asked in [Asked::Percept, Asked::PerceptBesidePlan] {
            kept &= swarm.meter().answers(asked).quantile_ns(990) <= GOAL_NS;
        }
    }
    kept
}
