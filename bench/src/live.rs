//! `bench live`: how well this machine flies a swarm of processes: the pace it held, how
//! late messages were, what a process needs, and whether the mission ended.
//!
//! The trial is flown by the command `skein`, as a child, and all figures come from its
//! report (`docs/report.md`): nothing here links Zenoh.

use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// One trial, alone on this machine.
#[derive(Debug, Args)]
pub struct LiveArgs {
    /// A scenario file or the name of a built-in scenario.
    #[arg(long, default_value = "swarm_20", value_name = "SCENARIO")]
    pub scenario: String,
    /// UAVs, a process each.
    #[arg(long, default_value_t = 50, value_name = "N")]
    pub peers: u16,
    /// Stops after so many scenario seconds if the mission is not over by then.
    #[arg(long, default_value_t = 600, value_name = "S")]
    pub seconds: u32,
    /// Scenario seconds per second that are asked for.
    #[arg(long, default_value_t = 1.0, value_name = "X")]
    pub time_scale: f64,
    /// Where the UAVs begin: `spread` or `base`.
    #[arg(long, default_value = "spread", value_name = "WHERE")]
    pub launch: String,
    #[command(flatten)]
    program: Program,
}

/// The command that flies.
#[derive(Debug, Args)]
pub(crate) struct Program {
    /// The command `skein`; without it the one beside this program.
    #[arg(long, value_name = "FILE")]
    program: Option<PathBuf>,
}

impl Program {
    /// Its file.
    ///
    /// # Errors
    /// When this program does not know its own place.
    pub(crate) fn path(&self) -> Result<PathBuf> {
        let beside = || -> Result<PathBuf> {
            let own = std::env::current_exe().context("this program's own file")?;
            Ok(own.with_file_name("skein"))
        };
        self.program.clone().map_or_else(beside, Ok)
    }
}

/// The report of what a verb of `program` flies, with those flags that have a value; what it
/// says meanwhile goes to stderr.
///
/// # Errors
/// When there is no program, or it tells of no flight.
pub(crate) fn report_of(
    program: &Path,
    verb: &str,
    scenario: &str,
    flags: &[(&str, Option<String>)],
) -> Result<Value> {
    let given = flags
        .iter()
        .filter_map(|(flag, v)| Some([*flag, v.as_deref()?]));
    let out = Command::new(program)
        .args([verb, scenario, "--format", "json"])
        .args(given.flatten())
        .stdin(Stdio::null())
        .stderr(Stdio::inherit())
        .output()
        .with_context(|| format!("{}: build it first: cargo build", program.display()))?;
    // A mission that failed is measured, too.
    if !matches!(out.status.code(), Some(0 | 1)) {
        bail!("it could not be flown: {}", out.status);
    }
    serde_json::from_slice(&out.stdout).context("the report")
}

/// Flies once and measures. What the trial says meanwhile goes to stderr.
///
/// # Errors
/// When there is no program, or it tells of no flight.
pub fn run(args: &LiveArgs) -> Result<String> {
    let flags = [
        ("--peers", Some(args.peers.to_string())),
        ("--launch", Some(args.launch.clone())),
        ("--max-time", Some(args.seconds.to_string())),
        ("--time-scale", Some(args.time_scale.to_string())),
    ];
    let report = report_of(&args.program.path()?, "trial", &args.scenario, &flags)?;
    serde_json::to_string_pretty(&figures(&report)).context("the figures")
}

/// What a report says of the machine.
fn figures(report: &Value) -> Value {
    let live = &report["live"];
    let number = |v: &Value| v.as_f64().unwrap_or(0.0);
    let count = |v: &Value| v.as_array().map_or(0, Vec::len);
    let (simulated_s, wall_s) = (number(&report["end_ms"]) / 1000.0, number(&live["wall_s"]));
    let processes = &live["processes"];
    // A second of scenario time of each UAV that flew with a computer: the ground station
    // runs all the time and senses nothing.
    let ran_s = (number(&report["peer_ms"]) / 1000.0 - simulated_s).max(1e-3);
    let cpu_s = number(&processes["cpu_s_mean"]);
    json!({
        "scenario": report["scenario"],
        "uavs": count(&report["uavs"]),
        "simulated_s": simulated_s,
        "wall_s": wall_s,
        "asked_time_scale": live["time_scale"],
        "real_time_factor": live["mean_time_scale"],
        "lowest_time_scale": live["lowest_time_scale"],
        "held_s": live["held_s"],
        "setpoints_hz": number(&live["setpoints"]) / ran_s,
        "setpoint_delay_ms_max": live["setpoint_delay_ms"],
        "starved": live["starved"],
        "message_age_ms": { "p50": report["radio"]["age_ms_p50"], "p99": report["radio"]["age_ms_p99"] },
        "late_share": report["radio"]["late_share"],
        "overrun": report["radio"]["overrun"],
        "cpu_s_per_process": { "mean": cpu_s, "max": processes["cpu_s_max"] },
        "cpu_ms_per_process_and_simulated_s": 1000.0 * cpu_s / simulated_s.max(1e-3),
        "cpu_s_of_the_trial": processes["trial_cpu_s"],
        "peak_mb_per_process": { "mean": processes["peak_mb_mean"], "max": processes["peak_mb_max"] },
        "covered_share": report["coverage"]["covered_share"],
        "covered_after_ms": report["makespan_ms"],
        "ended_and_said": report["completed"],
        "finished": count(&report["finished"]),
        "unfinished": count(&report["unfinished"]),
        "passed": report["passed"],
        "reasons": report["reasons"],
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_netsim::account::{Live, Processes, RunReport};

    #[test]
    fn the_figures_are_those_of_the_report() {
        let report = RunReport {
            end_ms: 100_000,
            // Two UAVs and the ground station.
            peer_ms: 300_000,
            uavs: vec![1, 2],
            finished: vec![1],
            unfinished: vec![2],
            live: Some(Live {
                wall_s: 125.0,
                time_scale: 1.0,
                mean_time_scale: 0.8,
                setpoints: 400,
                starved: 3,
                processes: Processes {
                    counted: 3,
                    cpu_s_mean: 5.0,
                    ..Processes::default()
                },
                ..Live::default()
            }),
            ..RunReport::default()
        };
        let told = figures(&serde_json::to_value(&report).unwrap());
        let wanted = [
            ("uavs", json!(2)),
            ("real_time_factor", json!(0.8)),
            ("setpoints_hz", json!(2.0)),
            ("starved", json!(3)),
            ("cpu_ms_per_process_and_simulated_s", json!(50.0)),
            ("finished", json!(1)),
            ("ended_and_said", json!(false)),
        ];
        for (field, value) in wanted {
            assert_eq!(told[field], value, "{field}");
        }
        // No field of the report is misspelt: only what a run cannot tell is null.
        let nulls: Vec<&String> = told
            .as_object()
            .unwrap()
            .iter()
            .filter_map(|(name, v)| v.is_null().then_some(name))
            .collect();
        assert_eq!(nulls, ["covered_after_ms", "late_share"]);
    }

    #[test]
    fn a_program_that_is_not_there_is_named() {
        let args = LiveArgs {
            scenario: "field".to_owned(),
            peers: 2,
            seconds: 5,
            time_scale: 1.0,
            launch: "base".to_owned(),
            program: Program {
                program: Some("/nowhere/skein".into()),
            },
        };
        let error = format!("{:#}", run(&args).unwrap_err());
        assert!(error.contains("/nowhere/skein"), "{error}");
    }
}
