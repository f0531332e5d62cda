//! How a scenario goes with more or fewer UAVs, on other radios:
//! `cargo run -p skein-scenario --example crowd -- helsinki 8,20,50 64000 1..3 2`.
//!
//! The arguments are a scenario, numbers of UAVs, bit rates, seeds, how many UAVs are
//! killed, one every five seconds from the 60th on (otherwise there are no faults), and an SVG
//! file for a figure of it all. Prints a line a run.

use plotters::prelude::*;
use skein_netsim::fault::{Fault, TimedFault};
use skein_netsim::history::What;
use skein_netsim::prepared::Prepared;
use skein_netsim::runs::{Wanted, run};
use skein_netsim::summary::Spread;
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
    let mut points = Vec::new();
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
                let point = Point::of(*n, *rate_bps, &outcome);
                tell(&point, &outcome, started.elapsed().as_secs_f64());
                points.push(point);
            }
        }
    }
    if let Some(path) = args.get(5)
        && let Err(e) = draw(path, &points)
    {
        eprintln!("{path}: {e}");
        return ExitCode::from(3);
    }
    ExitCode::SUCCESS
}

/// One run, as the figure shows it.
struct Point {
    n: u32,
    rate_bps: u32,
    makespan_over_launch_bound: Option<f64>,
    /// How long it took each live UAV to find out about each dead one.
    detection_ms: Spread,
    bytes_per_peer_s: f64,
}

impl Point {
    fn of(n: u32, rate_bps: u32, outcome: &Outcome) -> Self {
        let report = &outcome.report;
        let each_ms = report.kills.iter().flat_map(|k| k.detections_ms.values());
        Self {
            n,
            rate_bps,
            makespan_over_launch_bound: report.makespan_over_launch_bound,
            detection_ms: Spread::of(each_ms.map(|ms| *ms as f64).collect()),
            bytes_per_peer_s: report.radio.bytes_sent as f64 * 1000.0
                / (report.peer_ms.max(1) as f64),
        }
    }
}

type Drawn = Result<(), Box<dyn std::error::Error>>;

/// What a panel shows of a run; nothing where the run has none.
type Shown = fn(&Point) -> Option<f64>;

/// Three panels over the number of UAVs, a line a bit rate.
fn draw(path: &str, points: &[Point]) -> Drawn {
    let root = SVGBackend::new(path, (960, 320)).into_drawing_area();
    root.fill(&WHITE)?;
    let panels = root.split_evenly((1, 3));
    let wanted: [(&str, Shown); 3] = [
        ("makespan over the launch bound", |p| {
            p.makespan_over_launch_bound
        }),
        ("deaths noticed within, s (95 %)", |p| {
            Some(p.detection_ms.p95 / 1000.0).filter(|_| p.detection_ms.n > 0)
        }),
        ("bytes a second and peer", |p| Some(p.bytes_per_peer_s)),
    ];
    for (number, (panel, (title, of))) in panels.iter().zip(wanted).enumerate() {
        let highest = points.iter().filter_map(of).fold(1.0, f64::max) * 1.1;
        let widest = points.iter().map(|p| p.n).max().unwrap_or(1);
        let mut chart = ChartBuilder::on(panel)
            .margin(10)
            .caption(title, ("sans-serif", 15))
            .x_label_area_size(34)
            .y_label_area_size(40)
            .build_cartesian_2d(0..widest + 1, 0.0..highest)?;
        chart
            .configure_mesh()
            .x_desc("UAVs")
            .x_labels(6)
            .y_labels(6)
            .light_line_style(TRANSPARENT)
            .draw()?;
        let rates: BTreeSet<u32> = points.iter().map(|p| p.rate_bps).collect();
        for (i, rate_bps) in rates.into_iter().enumerate() {
            let colour = Palette99::pick(i).filled();
            let line: Vec<(u32, f64)> = points
                .iter()
                .filter(|p| p.rate_bps == rate_bps)
                .filter_map(|p| Some((p.n, of(p)?)))
                .collect();
            let marks = line.iter().map(|at| Circle::new(*at, 3, colour));
            chart.draw_series(marks)?;
            chart
                .draw_series(LineSeries::new(line, colour))?
                .label(format!("{} kbit/s", rate_bps / 1000))
                .legend(move |(x, y)| Circle::new((x, y), 3, colour));
        }
        if number > 0 {
            continue;
        }
        chart
            .configure_series_labels()
            .border_style(BLACK)
            .background_style(WHITE)
            .position(SeriesLabelPosition::LowerRight)
            .draw()?;
    }
    root.present()?;
    Ok(())
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

fn tell(point: &Point, outcome: &Outcome, wall_s: f64) {
    let Point { n, rate_bps, .. } = point;
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
    let ran_s = report.peer_ms as f64 / 1000.0;
    let kinds = report.simulated.as_ref().map(|s| &s.bytes_by_kind);
    let kinds: Vec<String> = kinds
        .into_iter()
        .flatten()
        .map(|(kind, bytes)| format!("{kind} {:.0}", *bytes as f64 / ran_s))
        .collect();
    println!(
        "{n} UAVs {rate_bps} bit/s seed {}: makespan {:?} ms, {:.2} of the work bound, {:.2} of that from the take-offs on, end {} ms; false downs {}; rounds {}; detection p50 {:.0} p95 {:.0} ms; lost by collision {}; bytes/s a peer: {}; violations {:?}; {:.0} times real time",
        report.seed,
        report.makespan_ms,
        report.makespan_over_work_bound.unwrap_or(0.0),
        report.makespan_over_launch_bound.unwrap_or(0.0),
        report.end_ms,
        outcome.false_downs().len(),
        rounds.len(),
        point.detection_ms.p50,
        point.detection_ms.p95,
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
