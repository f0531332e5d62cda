//! `skein check`: what is wrong with a scenario before it is flown, and what it amounts to.

use crate::exit;
use crate::scenario_args::ScenarioArgs;
use clap::{Args, ValueEnum};
use skein_flight::coverage::ring::CellId;
use skein_netsim::spec::Spec;
use skein_peer::CoverageTask;
use skein_scenario::{
    AreaPlanner, Coverable, Forecast, Scenario, ScenarioError, Summary, extent_m,
};
use std::fmt::Write as _;
use std::process::ExitCode;

/// Cells that are listed for each reason; the rest is counted.
const LISTED_CELLS: usize = 12;

/// Checks a scenario: every field, and whether the mission can be flown at all.
///
/// What is wrong is named by file, line, column and field (exit code 3). Otherwise
/// prints what the scenario amounts to: area, cells, zones, length of the loop,
/// time to cover it, and everything worth a warning.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// What is to be flown; without a planner's flag both planners are told side by side.
    #[command(flatten)]
    pub scenario: ScenarioArgs,
    /// How the result is printed.
    #[arg(long, value_enum, default_value_t = Format::Text)]
    pub format: Format,
}

/// Forms of the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// For people.
    Text,
    /// One JSON object.
    Json,
}

/// Runs the verb: the result on stdout, complaints on stderr.
///
/// # Errors
/// Only when stdout cannot be written.
pub fn run(args: &CheckArgs) -> anyhow::Result<ExitCode> {
    let scenario = match args.scenario.open(None, None) {
        Ok(s) => s,
        Err(e) => {
            match args.format {
                Format::Text => eprintln!("error: {e}"),
                Format::Json => {
                    exit::print(serde_json::json!({ "ok": false, "error": e.to_string() }))?;
                }
            }
            return Ok(ExitCode::from(exit::CONFIG_INVALID));
        }
    };
    let total = &scenario.summary;
    let judged = Coverable::of(&scenario);
    let forecasts = match args.scenario.planner.chosen() {
        Some(planner) => scenario
            .forecast()
            .map(|f| (planner, Ok(f)))
            .into_iter()
            .collect(),
        None => scenario.side_by_side(),
    };
    match args.format {
        Format::Text => exit::print(text(&scenario, total, &judged, &forecasts))?,
        Format::Json => exit::print(json(&scenario, total, &judged, &forecasts))?,
    }
    Ok(ExitCode::from(exit::OK))
}

/// Names of the first cells of a list.
fn names(cells: &[CellId]) -> String {
    let first: Vec<String> = cells
        .iter()
        .take(LISTED_CELLS)
        .map(|c| format!("({},{})", c.col, c.row))
        .collect();
    let more = if cells.len() > LISTED_CELLS {
        " ..."
    } else {
        ""
    };
    format!("{}{more}", first.join(" "))
}

fn text(
    scenario: &Scenario,
    total: &Summary,
    judged: &Coverable,
    forecasts: &[Forecasted],
) -> String {
    let mut lines = area_lines(&scenario.spec, total, judged);
    lines.extend(fleet_lines(&scenario.spec, total));
    let own = AreaPlanner::of(&scenario.spec.mission.task);
    lines.extend(forecasts.iter().map(|told| planner_line(told, own)));
    let mut out = String::new();
    for (name, text) in lines {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "{name:<12}{text}");
    }
    for finding in &scenario.findings {
        let _ = writeln!(out, "{finding}");
    }
    out
}

type Line = (&'static str, String);

fn area_lines(spec: &Spec, total: &Summary, judged: &Coverable) -> Vec<Line> {
    let (width_m, height_m) = extent_m(spec);
    let mission = &spec.mission;
    let area = format!(
        "{:.3} km² in {width_m:.0} x {height_m:.0} m; {} of {} cells can be seen, {:.2} % of the area",
        total.area_m2 / 1e6,
        judged.n_coverable,
        judged.n_cells,
        judged.share * 100.0
    );
    let zones = format!(
        "{} no-fly, clearance {:.1} m; {} buildings block radio",
        spec.zones.len(),
        mission.clearance_m(),
        spec.buildings.len()
    );
    let cells = format!(
        "{} of {} m on the loop, {} of them seen by excursions",
        total.cells,
        mission.lane_m(),
        total.excursions
    );
    let mut lines = vec![
        ("scenario", format!("{}, ok", spec.name)),
        ("area", area),
        ("zones", zones),
        ("cells", cells),
    ];
    for (reason, cells) in &total.uncoverable {
        lines.push((
            "uncovered",
            format!("{} cells, {reason}: {}", cells.len(), names(cells)),
        ));
    }
    if !judged.missed.is_empty() {
        let n = judged.missed.len();
        let text = format!(
            "{n} cells that could be seen are not on the loop: {}",
            names(&judged.missed)
        );
        lines.push(("missed", text));
    }
    let lanes = match mission.task {
        CoverageTask::Area => format!(", round the tree \"{}\"", mission.tree.name()),
        CoverageTask::Exact | CoverageTask::Points(_) | CoverageTask::Lines(_) => String::new(),
    };
    lines.push(("loop", format!("{:.1} km{lanes}", total.loop_m / 1000.0)));
    lines
}

/// What a planner is expected to make of the area, or why it has no plan.
type Forecasted = (AreaPlanner, Result<Forecast, ScenarioError>);

fn planner_line((planner, told): &Forecasted, own: Option<AreaPlanner>) -> Line {
    let kind = match planner {
        AreaPlanner::Lanes => "approximate",
        AreaPlanner::Exact => "exact",
    };
    let mut text = match told {
        Ok(f) => {
            let energy = f.energy_s.map_or("no energy in this wind".to_owned(), |s| {
                format!("energy {s:.0} s of cruise")
            });
            format!(
                "about {:.0} s, sees {:.2} % of the area, loop {:.1} km, {energy}",
                f.makespan_s,
                f.seen_share * 100.0,
                f.loop_m / 1000.0
            )
        }
        Err(e) => e.to_string(),
    };
    if own == Some(*planner) {
        text.push_str(" (flown)");
    }
    (kind, text)
}

fn fleet_lines(spec: &Spec, total: &Summary) -> Vec<Line> {
    let ground = spec.ground.as_ref();
    let ground = ground.map_or("no ground station".to_owned(), |g| {
        format!("ground station {}", g.id)
    });
    let heights = spec.uavs.iter().map(|u| u.height_m);
    let fleet = format!(
        "{} UAVs at {:.0} to {:.0} m, {ground}",
        spec.uavs.len(),
        heights.clone().fold(f64::INFINITY, f64::min),
        heights.fold(0.0, f64::max)
    );
    let (n, kills) = (spec.faults.len(), spec.storm.max_kills);
    vec![
        ("fleet", fleet),
        (
            "faults",
            format!("{n} at stated times, up to {kills} kills in a storm"),
        ),
        (
            "makespan",
            format!("about {:.0} s without failures", total.makespan_s),
        ),
    ]
}

fn json(
    scenario: &Scenario,
    total: &Summary,
    judged: &Coverable,
    forecasts: &[Forecasted],
) -> serde_json::Value {
    let planners: Vec<serde_json::Value> = forecasts
        .iter()
        .map(|(planner, told)| match told {
            Ok(f) => serde_json::json!({
                "planner": planner.name(),
                "makespan_s": f.makespan_s,
                "seen_share": f.seen_share,
                "loop_m": f.loop_m,
                "energy_s": f.energy_s,
            }),
            Err(e) => serde_json::json!({"planner": planner.name(), "error": e.to_string()}),
        })
        .collect();
    let spec = &scenario.spec;
    let uncoverable: serde_json::Map<String, serde_json::Value> = total
        .uncoverable
        .iter()
        .map(|(reason, cells)| {
            (
                reason.clone(),
                cells
                    .iter()
                    .map(|c| vec![c.col, c.row])
                    .collect::<Vec<_>>()
                    .into(),
            )
        })
        .collect();
    let findings: Vec<serde_json::Value> = scenario
        .findings
        .iter()
        .map(|f| {
            serde_json::json!({
                "severity": f.severity.to_string(),
                "place": f.place.as_ref().map(ToString::to_string),
                "field": f.field,
                "problem": f.problem,
            })
        })
        .collect();
    serde_json::json!({
        "ok": true,
        "scenario": spec.name,
        "area_m2": total.area_m2,
        "coverable_share": judged.share,
        "coverable_cells": judged.n_coverable,
        "planned_share": total.coverable_share,
        "missed": judged.missed.iter().map(|c| [c.col, c.row]).collect::<Vec<_>>(),
        "zones": spec.zones.len(),
        "buildings": spec.buildings.len(),
        "cells": total.cells,
        "excursions": total.excursions,
        "uncoverable": uncoverable,
        "loop_m": total.loop_m,
        "tree": spec.mission.tree.name(),
        "uavs": spec.uavs.len(),
        "makespan_s": total.makespan_s,
        "planners": planners,
        "findings": findings,
    })
}
