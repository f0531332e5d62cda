//! `bench alike`: whether a trial of processes and a simulated run can be told apart.
//!
//! Both fly the same scenario with the same seeds, and what their reports (`docs/report.md`)
//! measure alike is compared by the Mann-Whitney U test (1947), two-sided, corrected for the
//! number of figures by Holm's method (1979). Both are flown by the command `skein`, as a
//! child: nothing here links Zenoh.

use crate::live::{Program, report_of};
use anyhow::{Context, Result};
use clap::Args;
use serde::Serialize;
use serde_json::Value;
use statrs::stats_tests::Alternative;
use statrs::stats_tests::mannwhitneyu::{MannWhitneyUMethod, mannwhitneyu};

/// Below this probability, after Holm's correction, a figure tells the two apart.
const SIGNIFICANCE: f64 = 0.01;

/// Trials, and simulated runs of the same seeds.
#[derive(Debug, Args)]
pub struct AlikeArgs {
    /// A scenario file or the name of a built-in scenario.
    #[arg(long, default_value = "helsinki", value_name = "SCENARIO")]
    pub scenario: String,
    /// UAVs, instead of the scenario's number.
    #[arg(long, value_name = "N")]
    pub peers: Option<u16>,
    /// How many runs each.
    #[arg(long, default_value_t = 10, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub runs: u32,
    /// Seed of the first run; the next ones have the next seeds.
    #[arg(long, default_value_t = 1, value_name = "S")]
    pub seed: u32,
    /// Scenario seconds per second that are asked for in trials; without it the scenario's.
    #[arg(long, value_name = "X")]
    pub time_scale: Option<f64>,
    #[command(flatten)]
    program: Program,
}

/// How a report tells a figure; nothing where the run has none.
type Figure = fn(&Value) -> Option<f64>;

/// What is compared.
const FIGURES: [(&str, Figure); 9] = [
    ("makespan_s", |r| seconds(&r["makespan_ms"])),
    ("end_after_makespan_s", |r| {
        Some(seconds(&r["end_ms"])? - seconds(&r["makespan_ms"])?)
    }),
    ("bytes_per_peer_s", |r| {
        r["radio"]["bytes_per_peer_s"].as_f64()
    }),
    ("transmissions_per_peer_s", |r| {
        per_peer_s(r, &r["radio"]["sent"])
    }),
    ("receptions_per_peer_s", |r| {
        per_peer_s(r, &r["radio"]["received"])
    }),
    ("collisions_per_peer_s", |r| {
        per_peer_s(r, &r["radio"]["lost"]["collision"])
    }),
    ("detection_s", |r| {
        mean_s(
            kills(r)
                .flat_map(|k| k["detections_ms"].as_object().into_iter().flatten())
                .map(|(_, v)| v),
        )
    }),
    ("takeover_s", |r| {
        mean_s(kills(r).map(|k| &k["takeover_ms"]))
    }),
    ("covered_share", |r| r["coverage"]["covered_share"].as_f64()),
];

fn kills(report: &Value) -> impl Iterator<Item = &Value> {
    report["kills"].as_array().into_iter().flatten()
}

fn seconds(ms: &Value) -> Option<f64> {
    Some(ms.as_f64()? / 1000.0)
}

fn per_peer_s(report: &Value, n: &Value) -> Option<f64> {
    Some(n.as_f64().unwrap_or(0.0) / seconds(&report["peer_ms"])?.max(1e-3))
}

fn mean_s<'a>(each_ms: impl Iterator<Item = &'a Value>) -> Option<f64> {
    let each: Vec<f64> = each_ms.filter_map(seconds).collect();
    (!each.is_empty()).then(|| each.iter().sum::<f64>() / each.len() as f64)
}

/// One figure of both.
#[derive(Debug, PartialEq, Serialize)]
struct Compared {
    figure: &'static str,
    /// Runs that have it.
    n_live: usize,
    n_sim: usize,
    /// Medians.
    live: f64,
    sim: f64,
    /// Probability that two samples of one population differ so much.
    p: f64,
    /// The same after Holm's correction.
    p_holm: f64,
}

/// What is printed.
#[derive(Debug, Serialize)]
struct Outcome<'a> {
    scenario: &'a str,
    runs: u32,
    seeds: [u32; 2],
    /// Trials and simulated runs that passed.
    passed_live: usize,
    passed_sim: usize,
    /// Scenario seconds per second of the slowest trial.
    slowest_time_scale: f64,
    figures: Vec<Compared>,
    alike: bool,
}

/// Flies all runs, one after the other, and compares. What the trials say meanwhile goes to
/// stderr.
///
/// # Errors
/// When there is no program, or it tells of no flight.
pub fn run(args: &AlikeArgs) -> Result<String> {
    let program = args.program.path()?;
    let end = args.seed.saturating_add(args.runs);
    let (mut live, mut sim) = (Vec::new(), Vec::new());
    for seed in args.seed..end {
        let flown = |verb: &str, time_scale: Option<f64>| {
            let flags = [
                ("--seed", Some(seed.to_string())),
                ("--peers", args.peers.map(|n| n.to_string())),
                ("--time-scale", time_scale.map(|x| x.to_string())),
            ];
            let report = report_of(&program, verb, &args.scenario, &flags);
            report.with_context(|| format!("{verb} of seed {seed}"))
        };
        sim.push(flown("sim", None)?);
        live.push(flown("trial", args.time_scale)?);
    }
    let figures = compare(&live, &sim);
    let passed = |reports: &[Value]| reports.iter().filter(|r| r["passed"] == true).count();
    let scales = live
        .iter()
        .filter_map(|r| r["live"]["mean_time_scale"].as_f64());
    let outcome = Outcome {
        scenario: &args.scenario,
        runs: args.runs,
        seeds: [args.seed, end],
        passed_live: passed(&live),
        passed_sim: passed(&sim),
        slowest_time_scale: scales.fold(f64::INFINITY, f64::min),
        alike: figures.iter().all(|f| f.p_holm > SIGNIFICANCE),
        figures,
    };
    serde_json::to_string_pretty(&outcome).context("the figures")
}

/// Compares every figure that both have.
fn compare(live: &[Value], sim: &[Value]) -> Vec<Compared> {
    let mut all = Vec::new();
    for (figure, of) in FIGURES {
        let sample = |reports: &[Value]| reports.iter().filter_map(of).collect::<Vec<f64>>();
        let (live, sim) = (sample(live), sample(sim));
        if live.is_empty() || sim.is_empty() {
            continue;
        }
        let p = same_population(&live, &sim);
        all.push(Compared {
            figure,
            n_live: live.len(),
            n_sim: sim.len(),
            live: median(live),
            sim: median(sim),
            p,
            p_holm: p,
        });
    }
    correct(&mut all);
    all
}

/// The probability that two samples of one population differ as these do.
fn same_population(a: &[f64], b: &[f64]) -> f64 {
    let first = a.first().copied().unwrap_or(0.0);
    // Without any spread there is nothing to rank.
    if a.iter().chain(b).all(|x| x.total_cmp(&first).is_eq()) {
        return 1.0;
    }
    // The normal distribution does from some ten values each. The library's exact method takes
    // the wrong tail where the first sample is not the larger one (statrs 0.19.1).
    let method = MannWhitneyUMethod::AsymptoticInclContinuityCorrection;
    mannwhitneyu(a, b, method, Alternative::TwoSided).map_or(1.0, |(_, p)| p)
}

/// Holm's correction: the least of m probabilities counts m times, the next m - 1 times, and
/// none less than one before it.
fn correct(all: &mut [Compared]) {
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by(|i, j| all[*i].p.total_cmp(&all[*j].p));
    let mut least = 0.0_f64;
    for (rank, i) in order.into_iter().enumerate() {
        let times = (all.len() - rank) as f64;
        least = least.max((all[i].p * times).min(1.0));
        all[i].p_holm = least;
    }
}

fn median(mut each: Vec<f64>) -> f64 {
    each.sort_by(f64::total_cmp);
    let middle = each.len() / 2;
    match each.as_slice() {
        [] => 0.0,
        some if some.len() % 2 == 1 => some[middle],
        some => f64::midpoint(some[middle - 1], some[middle]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;
    use skein_netsim::account::RunReport;

    #[test]
    fn samples_that_overlap_are_alike_and_shifted_ones_are_not() {
        // U = 25 of 25, mean 12.5, deviation sqrt(5 * 5 * 11 / 12): z = 12 / 4.787 = 2.507.
        let low = [1.0, 2.0, 3.0, 4.0, 5.0];
        let high = [6.0, 7.0, 8.0, 9.0, 10.0];
        assert!((same_population(&low, &high) - 0.012_186).abs() < 1e-6);
        assert!(same_population(&[1.0, 3.0, 5.0, 7.0], &[2.0, 4.0, 6.0, 8.0]) > 0.6);
        assert!((same_population(&[4.0; 5], &[4.0; 5]) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn many_figures_need_stronger_evidence_each() {
        let with = |p| Compared {
            figure: "x",
            n_live: 1,
            n_sim: 1,
            live: 0.0,
            sim: 0.0,
            p,
            p_holm: p,
        };
        let mut all = [with(0.04), with(0.01), with(0.03)];
        correct(&mut all);
        let holm: Vec<f64> = all.iter().map(|c| c.p_holm).collect();
        for (got, wanted) in holm.iter().zip([0.06, 0.03, 0.06]) {
            assert!((got - wanted).abs() < 1e-12, "{holm:?}");
        }
    }

    #[test]
    fn every_figure_is_one_of_the_report() {
        let mut report = serde_json::to_value(RunReport {
            makespan_ms: Some(200_000),
            end_ms: 210_000,
            peer_ms: 100_000,
            ..RunReport::default()
        })
        .unwrap();
        report["radio"]["sent"] = json!(300);
        report["kills"] = json!([
            { "detections_ms": { "1": 8_000, "2": 10_000 }, "takeover_ms": 12_000 },
            { "detections_ms": { "1": 12_000 }, "takeover_ms": null }
        ]);
        let told: Vec<(&str, Option<f64>)> =
            FIGURES.iter().map(|(n, of)| (*n, of(&report))).collect();
        let of = |name| told.iter().find(|(n, _)| *n == name).unwrap().1.unwrap();
        let wanted = [
            ("makespan_s", 200.0),
            ("end_after_makespan_s", 10.0),
            ("transmissions_per_peer_s", 3.0),
            ("detection_s", 10.0),
            ("takeover_s", 12.0),
        ];
        for (name, value) in wanted {
            assert!((of(name) - value).abs() < 1e-9, "{name}: {}", of(name));
        }
        let missing: Vec<&str> = told.iter().filter(|t| t.1.is_none()).map(|t| t.0).collect();
        assert_eq!(missing, Vec::<&str>::new());
        assert!((median(vec![3.0, 1.0, 2.0, 10.0]) - 2.5).abs() < 1e-12);
    }
}
