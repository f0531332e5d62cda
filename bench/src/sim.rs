//! `bench sim`: how fast a swarm flies in virtual time, checks on, and what the computer
//! is busy with meanwhile.

use anyhow::{Context, Result, ensure};
use clap::Args;
use serde::Serialize;
use skein_netsim::Prepared;
use skein_netsim::swarm::Swarm;
use skein_netsim::swarm::meter::{Meter, Part};
use skein_scenario::Overrides;
use std::collections::BTreeMap;
use std::sync::OnceLock;
use std::time::Instant;

/// One run of a scenario, alone on its thread.
#[derive(Debug, Args)]
pub struct SimArgs {
    /// A scenario file or the name of a built-in scenario.
    #[arg(long, default_value = skein_scenario::DEFAULT, value_name = "SCENARIO")]
    pub scenario: String,
    /// UAVs, instead of the scenario's number.
    #[arg(long, value_name = "N")]
    pub peers: Option<u16>,
    /// Seed of the run, instead of the scenario's.
    #[arg(long, value_name = "SEED")]
    pub seed: Option<u64>,
    /// Stops after so many simulated seconds; without it at the end of the mission.
    #[arg(long, value_name = "S")]
    pub seconds: Option<u32>,
}

#[derive(Serialize)]
struct Figures {
    scenario: String,
    uavs: usize,
    seed: u64,
    /// Simulated time, s.
    simulated_s: f64,
    /// Time of one processor, and of the clock on the wall, s.
    cpu_s: f64,
    wall_s: f64,
    /// Simulated time over that of the processor.
    real_time_factor: f64,
    /// Percepts, receptions, timers, answers that peers were given.
    inputs: u64,
    inputs_per_peer_s: f64,
    /// Processor time per peer and simulated second, microseconds.
    cpu_us_per_peer_s: BTreeMap<&'static str, f64>,
    /// Whether the mission ended before the run was stopped.
    ended: bool,
    covered_share: f64,
    /// Rules that were broken so far, and how often.
    violations: BTreeMap<&'static str, u64>,
}

/// Flies once and measures.
///
/// # Errors
/// When the scenario cannot be flown.
pub fn run(args: &SimArgs) -> Result<String> {
    let over = Overrides {
        peers: args.peers,
        seed: args.seed,
        ..Overrides::default()
    };
    let scenario = skein_scenario::open(Some(&args.scenario), &over)?;
    let prepared = Prepared::with_geometry(scenario.spec, scenario.geometry);
    let spec = &prepared.spec;
    let longest_s = spec.max_time_s;
    let until_s = args.seconds.unwrap_or(longest_s);
    ensure!(until_s > 0, "--seconds must be above 0");
    let mut swarm = Swarm::new(&prepared, spec.seed, spec.faults.clone(), false)
        .measured(Meter::with(clock_ns));
    let (began, cpu_began_s) = (Instant::now(), cpu_s());
    let goes_on = swarm.run_until(u64::from(until_s) * 1000);
    let wall_s = began.elapsed().as_secs_f64();
    // Where the system does not tell, the run had a processor to itself.
    let cpu_s = match (cpu_began_s, cpu_s()) {
        (Some(from), Some(to)) if to > from => to - from,
        _ => wall_s,
    };
    let simulated_s = swarm.now_ms() as f64 / 1000.0;
    let peers = spec.uavs.len() + usize::from(spec.ground.is_some());
    let peer_s = peers as f64 * simulated_s;
    let meter = swarm.meter();
    let metered_ns: u64 = Part::ALL.iter().map(|p| meter.spent_ns(*p)).sum();
    let each = |part: Part| {
        let share = meter.spent_ns(part) as f64 / metered_ns.max(1) as f64;
        (part.name(), share * cpu_s * 1e6 / peer_s)
    };
    let figures = Figures {
        scenario: spec.name.clone(),
        uavs: spec.uavs.len(),
        seed: spec.seed,
        simulated_s,
        cpu_s,
        wall_s,
        real_time_factor: simulated_s / cpu_s,
        inputs: meter.inputs(),
        inputs_per_peer_s: meter.inputs() as f64 / peer_s,
        cpu_us_per_peer_s: Part::ALL.iter().map(|p| each(*p)).collect(),
        ended: !goes_on && swarm.account().covered_ms().is_some(),
        covered_share: swarm.covered_share(),
        violations: swarm.checker().found.counts.clone(),
    };
    serde_json::to_string_pretty(&figures).context("the figures")
}

/// The machine's monotonic clock.
fn clock_ns() -> u64 {
    static BEGAN: OnceLock<Instant> = OnceLock::new();
    let since = BEGAN.get_or_init(Instant::now).elapsed();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}

/// What this process has used of processors so far, seconds, where Linux tells it.
fn cpu_s() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/schedstat").ok()?;
    let ns: u64 = text.split_whitespace().next()?.parse().ok()?;
    Some(ns as f64 / 1e9)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_minute_of_three_uavs_is_measured_part_by_part() {
        let args = SimArgs {
            scenario: "field".to_owned(),
            peers: Some(3),
            seed: Some(5),
            seconds: Some(20),
        };
        let json: serde_json::Value = serde_json::from_str(&run(&args).unwrap()).unwrap();
        assert_eq!(
            (json["uavs"].as_u64(), json["seed"].as_u64()),
            (Some(3), Some(5))
        );
        assert!((19.0..=20.0).contains(&json["simulated_s"].as_f64().unwrap()));
        assert_eq!(json["ended"], false);
        // Percepts alone are five a second.
        assert!(json["inputs_per_peer_s"].as_f64().unwrap() > 5.0, "{json}");
        let parts = json["cpu_us_per_peer_s"].as_object().unwrap();
        assert_eq!(parts.len(), Part::ALL.len());
        let busy = |part: &str| parts[part].as_f64().unwrap() > 0.0;
        assert!(
            ["peer", "medium", "checks", "world"].map(busy) == [true; 4],
            "{json}"
        );
        let factor = json["real_time_factor"].as_f64().unwrap();
        assert!(factor > 0.1 && factor.is_finite(), "{json}");
    }

    #[test]
    fn a_scenario_that_is_none_is_an_error() {
        let args = SimArgs {
            scenario: "nowhere".to_owned(),
            peers: None,
            seed: None,
            seconds: None,
        };
        assert!(run(&args).unwrap_err().to_string().contains("nowhere"));
    }
}
