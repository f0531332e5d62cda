//! `plan cover`: an area covered by a team (D2.7 §3.6). Planned by
//! [`skein_survey::area`].

use super::area_input::{self, AreaInput};
use super::args::{Lanes, LayerArgs, Objective, area_error, planners, positive};
use super::output::{OutputArgs, Printed, Sheet};
use super::{NOT_NEEDED, team_input};
use anyhow::{Result, bail};
use clap::Args;
use serde_json::{Map, Value, json};
use skein_survey::area::{self, AreaPlan, AreaRequest, Facts, Figures, Laid, Planner, ShapeKind};
use skein_survey::flight::Stays;
use std::path::PathBuf;

/// An area covered by a team: one closed flight a UAV, the longest as short as can be
/// found, or what `--objective` asks for.
///
/// Without `--exact` or `--approximate` both planners are asked, both are told, and the
/// flights are those of the one that sees more, or as much sooner.
///
/// The survey of a QGroundControl `.plan` with its exclusion fences, or a GeoJSON polygon
/// with its holes, and zones with the property "no_fly": true. The property "sensor" of
/// the polygon names the sensor to see it with. Times are without wind. Flights that come
/// near to each other get heights of their own.
#[derive(Debug, Args)]
pub struct CoverArgs {
    /// A QGroundControl `.plan` or GeoJSON.
    pub file: PathBuf,
    /// Exact coverage: cells of the area as it is drawn, in straight passes.
    #[arg(long, conflicts_with = "approximate")]
    pub exact: bool,
    /// Approximate coverage: lane cells as wide as the swath, a region of them each.
    #[arg(long)]
    pub approximate: bool,
    /// How many UAVs.
    #[arg(long, visible_alias = "uavs", default_value_t = 1, value_name = "N")]
    pub k: usize,
    /// The UAVs, one by one, instead of `--k`: JSON5, a list of `{name, speed_mps,
    /// endurance_s?, start?: [lat, lon], swath_m? or fov_across_deg?, turn_radius_m?,
    /// sensors?: {rgb: {swath_m or fov_across_deg}, ...}, cruise_power_w?}`.
    #[arg(long, value_name = "FILE")]
    pub fleet: Option<PathBuf>,
    /// Where all UAVs start and end, degrees; by default the file's home position, or the
    /// area's first corner.
    #[arg(
        long,
        visible_alias = "depot",
        value_name = "LAT,LON",
        allow_hyphen_values = true
    )]
    pub launch: Option<String>,
    /// Width of the ground that a pass sees, metres.
    #[arg(long, default_value_t = 60.0, value_name = "M")]
    pub swath_m: f64,
    /// How far the camera sees before and behind, metres; half the swath by default.
    #[arg(long, value_name = "M")]
    pub look_ahead_m: Option<f64>,
    /// Turn radius, metres.
    #[arg(long, default_value_t = 30.0, value_name = "M")]
    pub turn_radius_m: f64,
    /// Distance kept from every zone, metres.
    #[arg(
        long,
        default_value_t = 10.0,
        value_name = "M",
        allow_hyphen_values = true
    )]
    pub clearance_m: f64,
    /// Speed, m/s: there is no wind, so over the ground as through the air.
    #[arg(long, default_value_t = 15.0, value_name = "V")]
    pub speed_mps: f64,
    /// The longest time that a UAV flies, seconds; passes beyond that are left out and
    /// listed.
    #[arg(long, value_name = "S")]
    pub endurance_s: Option<f64>,
    /// Course of all lanes, degrees clockwise from north; by default the shortest found.
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    pub course_deg: Option<f64>,
    /// The sensor to see the area with: UAVs without it stay, and its swath counts.
    #[arg(long, value_name = "NAME")]
    pub sensor: Option<String>,
    /// What is to be least. Distance and energy choose which UAVs fly at all.
    #[arg(long, value_enum, default_value_t = Objective::Time)]
    pub objective: Objective,
    /// Lanes for UAVs of unlike swath.
    #[arg(long, value_enum, default_value_t = Lanes::Best)]
    pub lanes: Lanes,
    /// How flights are kept apart.
    #[command(flatten)]
    pub layers: LayerArgs,
    /// Steps of improvement; the same steps give the same plan everywhere.
    #[arg(long, default_value_t = area::DEFAULT_STEPS, value_name = "N")]
    pub steps: usize,
    /// The form of the result.
    #[command(flatten)]
    pub output: OutputArgs,
}

/// Plans, and returns the text to print.
///
/// # Errors
/// When the file or a flag is wrong; the error names the place.
pub fn run(args: &CoverArgs) -> Result<String> {
    let fleet = args.fleet.as_deref();
    let team = team_input::team(fleet, args.k, args.speed_mps, args.endurance_s)?;
    args.output.check(team.len())?;
    positive(args.speed_mps, args.turn_radius_m, args.swath_m)?;
    let input = area_input::read(&args.file, args.launch.as_deref())?;
    let defaults = team_input::Defaults {
        swath_m: args.swath_m,
        turn_radius_m: args.turn_radius_m,
    };
    let request = AreaRequest {
        area: input.area.clone(),
        holes: input.holes.clone(),
        zones: input.zones.clone(),
        fences: Vec::new(),
        team: team_input::in_plane(&team, input.origin, defaults)?,
        sensor: sensor(args, &input)?,
        clearance_m: args.clearance_m,
        look_ahead_m: args.look_ahead_m,
        heading_rad: args.course_deg.map(|course| (90.0 - course).to_radians()),
        planners: planners(args.exact, args.approximate),
        lanes: args.lanes.asked(),
        objective: args.objective.asked(),
        separation: args.layers.separation(),
        altitude_m: args.output.altitude_m,
        steps: args.steps,
    };
    let plan = area::plan(&request).map_err(|error| area_error(error, &args.file))?;
    args.output.print(&sheet(args, &input, &request, &plan))
}

/// The sensor that is asked for by the file or the flag.
fn sensor(args: &CoverArgs, input: &AreaInput) -> Result<Option<String>> {
    match (&args.sensor, &input.sensor) {
        (Some(flag), Some(own)) if flag != own => {
            bail!("--sensor {flag}: the area asks for {own:?}")
        }
        (flag, own) => Ok(flag.clone().or_else(|| own.clone())),
    }
}

fn sheet(args: &CoverArgs, input: &AreaInput, request: &AreaRequest, plan: &AreaPlan) -> Sheet {
    let at_home = plan.uavs.iter().filter_map(|uav| {
        let why = match (uav.stays?, &request.sensor) {
            (Stays::NoSensor, Some(sensor)) => format!("has no sensor {sensor:?}"),
            _ => NOT_NEEDED.to_owned(),
        };
        Some(json!({"name": uav.name, "why": why}))
    });
    let mut summary = figures(&plan.figures);
    for (key, value) in facts(plan) {
        summary[key] = value;
    }
    if !plan.compared.is_empty() {
        summary["compared"] = plan.compared.iter().map(figures).collect();
    }
    summary["objective"] = json!(args.objective.name());
    summary["sensor"] = json!(request.sensor);
    summary["at_home"] = at_home.collect();
    summary["notices"] = json!([&input.notices[..], &plan.notices].concat());
    let shapes = plan.shapes.iter().map(|shape| {
        let told = match &shape.kind {
            ShapeKind::Cell { number, area_m2 } => json!({"cell": number, "area_m2": area_m2}),
            ShapeKind::LeftCell => json!({"left": true}),
            ShapeKind::Section {
                number,
                uavs,
                lane_m,
            } => json!({"section": number, "uavs": uavs, "lane_m": lane_m}),
        };
        (shape.ring.clone(), told)
    });
    Sheet {
        origin: input.origin,
        flights: plan.uavs.iter().map(Printed::new).collect(),
        summary,
        shapes: shapes.collect(),
    }
}

/// What a planner is called.
pub(super) fn planner_name(planner: Planner) -> &'static str {
    match planner {
        Planner::Exact => "exact",
        Planner::Approximate => "approximate",
    }
}

/// What a person compares.
fn figures(figures: &Figures) -> Value {
    let mut out = json!({
        "planner": planner_name(figures.planner),
        "lanes": match figures.laid {
            Laid::Common => "common",
            Laid::Sections => "sections",
        },
        "makespan_s": figures.makespan_s,
        "covered_share": figures.covered_share,
        "total_m": figures.total_m,
        "energy_s": figures.energy_s,
        "uavs_flying": figures.uavs_flying,
    });
    if let Some(energy_wh) = figures.energy_wh {
        out["energy_wh"] = json!(energy_wh);
    }
    out
}

/// What the planner tells of its own.
fn facts(plan: &AreaPlan) -> Map<String, Value> {
    let told = match plan.facts {
        None => return Map::new(),
        Some(Facts::Passes {
            area_m2,
            cells,
            passes,
            unserved_passes,
        }) => json!({
            "area_m2": area_m2, "cells": cells, "passes": passes,
            "unserved_passes": unserved_passes,
        }),
        Some(Facts::Cells {
            lower_bound_s,
            cells,
            cells_blocked,
            cells_left,
            turns_fit,
        }) => {
            let mut told = json!({
                "cells": cells, "cells_blocked": cells_blocked, "cells_left": cells_left,
                "turns_fit": turns_fit,
            });
            // Sections have no bound together.
            if plan.figures.laid == Laid::Common {
                told["lower_bound_s"] = json!(lower_bound_s);
            }
            told
        }
    };
    match told {
        Value::Object(fields) => fields,
        _ => Map::new(),
    }
}

#[cfg(test)]
mod tests;
