//! `plan cover`: an area covered by a team (D2.7 §3.6). Planned by
//! [`skein_survey::area`].

use super::area_input::{self, AreaInput, Asked};
use super::args::{Lanes, LayerArgs, Objective, WindArgs, area_error, flyable, planners};
use super::output::{OutputArgs, Printed, Sheet};
use super::size::Work;
use super::view::{Flags, View};
use super::{team_input, why_home};
use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Map, Value, json};
use skein_survey::area::{
    self, AreaError, AreaPlan, AreaRequest, Facts, Figures, Laid, Planner, Planners, Progress,
    ShapeKind,
};
use skein_survey::flight::Stays;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// An area covered by a team: one closed flight a UAV, the longest as short as can be
/// found, or what `--objective` asks for.
///
/// Without `--exact` or `--approximate` both planners are asked, both are told, and the
/// flights are those of the one that sees more, or as much sooner.
///
/// The survey of a QGroundControl `.plan` with its fences, or a GeoJSON polygon with its
/// holes, and zones with the property "no_fly": true. What the survey says of course,
/// height, lanes and pictures is done unless a flag says otherwise. The property "sensor"
/// of the polygon names the sensor to see it with. Flights that come
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
    /// A file of more zones and fences: those of a `.plan`, or all polygons of GeoJSON as
    /// zones.
    #[arg(long, value_name = "FILE")]
    pub zones: Option<PathBuf>,
    /// Holes of the area need not be seen and may be flown over; without it they are
    /// no-fly zones.
    #[arg(long)]
    pub cross_holes: bool,
    /// Width of the ground that a pass sees, metres; by default the distance between lanes
    /// of the file's survey, else 60.
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub swath_m: Option<f64>,
    /// How far the camera sees before and behind, metres; by default half of what lies
    /// between two pictures of the file's survey, else half the swath.
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub look_ahead_m: Option<f64>,
    /// Turn radius, metres.
    #[arg(
        long,
        default_value_t = 30.0,
        value_name = "M",
        allow_hyphen_values = true
    )]
    pub turn_radius_m: f64,
    /// Distance kept from every zone, metres.
    #[arg(
        long,
        default_value_t = 10.0,
        value_name = "M",
        allow_hyphen_values = true
    )]
    pub clearance_m: f64,
    /// Airspeed, m/s.
    #[arg(
        long,
        default_value_t = 15.0,
        value_name = "V",
        allow_hyphen_values = true
    )]
    pub speed_mps: f64,
    /// The longest time that a UAV flies, seconds; passes beyond that are left out and
    /// listed.
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub endurance_s: Option<f64>,
    /// Course of all lanes, degrees clockwise from north, from -180 up to 360; by default
    /// that of the file's survey, else the shortest found. Lanes of a course are straight
    /// passes: without `--approximate` only these are planned then.
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    pub course_deg: Option<f64>,
    /// Searches for the best course also where the file's survey says one.
    #[arg(long, conflicts_with_all = ["course_deg", "approximate"])]
    pub every_course: bool,
    /// Plans in full only on those courses that promise most when they are planned quickly, and
    /// not on every one that may be best: less time on large areas. Fewer UAVs may then be as
    /// soon as more.
    #[arg(long, conflicts_with_all = ["course_deg", "approximate"])]
    pub quick: bool,
    /// How far each pass runs out straight beyond both ends before a turn, where that is clear,
    /// metres; by default what the file's survey says, else 0.
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub run_out_m: Option<f64>,
    /// Flies the area a second time in the same flight, by passes across the first ones; by
    /// default what the file's survey says (`Refly90Degrees`).
    #[arg(
        long,
        value_name = "BOOL",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "true"
    )]
    pub refly: Option<bool>,
    /// The sensor to see the area with: UAVs without it stay, and its swath counts.
    #[arg(long, value_name = "NAME")]
    pub sensor: Option<String>,
    /// What is to be least. Distance and energy choose which UAVs fly at all.
    #[arg(long, value_enum, default_value_t = Objective::Time)]
    pub objective: Objective,
    /// Lanes for UAVs of unlike swath.
    #[arg(long, value_enum, default_value_t = Lanes::Best)]
    pub lanes: Lanes,
    /// The wind.
    #[command(flatten)]
    pub wind: WindArgs,
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
    args.layers.check()?;
    args.wind.check()?;
    flyable(
        args.speed_mps,
        Some(args.turn_radius_m),
        args.clearance_m,
        args.endurance_s,
    )?;
    View::of(flags(args), None)?;
    let team = team_input::team(fleet, args.k, args.speed_mps, args.endurance_s)?;
    args.output.check(team.len())?;
    let asked = Asked {
        launch: args.launch.as_deref(),
        cross_holes: args.cross_holes,
        zones: args.zones.as_deref(),
    };
    let mut input = area_input::read(&args.file, asked)?;
    let view = View::of(flags(args), input.survey.as_ref())?;
    args.output.check_altitude(view.altitude_m)?;
    let defaults = team_input::Defaults {
        camera: view.camera,
        turn_radius_m: args.turn_radius_m,
    };
    let team = team_input::in_plane(&team, input.origin, defaults)?;
    let shown = || args.file.display().to_string();
    input.check_starts(&team).with_context(shown)?;
    input.site.trigger_m = view.trigger_m.or(view.look_ahead_m.filter(|m| *m > 0.0));
    input.site.pictures_in_turns = view.pictures_in_turns;
    input.site.clearance_m = args.clearance_m;
    input.site.wind_mps = args.wind.velocity();
    input.notices.extend(view.notices.iter().cloned());
    let refly = refly(args, &mut input)?;
    let sensor = sensor(args, &input)?;
    let work = Work {
        area: &input.area,
        team: &team,
        sensor: sensor.as_deref(),
        lanes: args.lanes.asked(),
        altitude_m: view.altitude_m,
    };
    let planners = work.planners(asked_planners(args, &view, refly));
    let (planners, told) = planners.with_context(shown)?;
    input.notices.extend(told);
    let request = AreaRequest {
        area: input.area.clone(),
        holes: input.holes.clone(),
        zones: input.no_fly(),
        fences: input.stay_within(),
        team,
        sensor,
        clearance_m: args.clearance_m,
        look_ahead_m: view.look_ahead_m,
        heading_rad: view.course_deg.map(|course| (90.0 - course).to_radians()),
        quick: args.quick,
        run_out_m: view.run_out_m,
        wind_mps: args.wind.velocity(),
        planners,
        lanes: args.lanes.asked(),
        objective: args.objective.asked(),
        separation: args.layers.separation(),
        altitude_m: view.altitude_m,
        steps: args.steps,
    };
    let plan = planned(&request, refly).map_err(|error| area_error(error, &args.file))?;
    args.output.print(&sheet(args, &input, &request, &plan))
}

/// After so long somebody who waits is told what a plan waits for.
const PATIENCE: Duration = Duration::from_secs(10);

/// Plans. While courses are searched a terminal shows a bar, and elsewhere a line on stderr says
/// so once.
fn planned(request: &AreaRequest, refly: bool) -> Result<AreaPlan, AreaError> {
    if refly {
        return area::plan_crossed(request);
    }
    let terminal = std::io::stderr().is_terminal();
    let bar = terminal.then(|| {
        let bar = ProgressBar::new(0);
        let style = ProgressStyle::with_template("{bar:30.cyan} {pos} of {len} courses {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar
    });
    let (began, told) = (Instant::now(), AtomicBool::new(false));
    let plan = area::plan_telling(request, &|progress: Progress| {
        let late = began.elapsed() > PATIENCE;
        if let Some(bar) = &bar {
            bar.set_length(progress.courses as u64);
            bar.set_position(progress.courses_done as u64);
            if late {
                bar.set_message("(--quick plans the most promising ones only)");
            }
        } else if late && !told.swap(true, Ordering::Relaxed) {
            eprintln!(
                "planning all courses in full: this may take minutes; --quick plans the most promising ones only"
            );
        }
    });
    if let Some(bar) = &bar {
        bar.finish_and_clear();
    }
    plan
}

/// Whether the area is flown a second time, across.
fn refly(args: &CoverArgs, input: &mut AreaInput) -> Result<bool> {
    let own = input.survey.as_ref().is_some_and(|grid| grid.refly);
    let (flag, approximate) = (args.refly, args.approximate);
    ensure!(
        !(approximate && flag == Some(true)),
        "--refly is for straight passes: not with --approximate"
    );
    let told = match (own, flag) {
        (false, _) => None,
        (true, None) if approximate => Some("is ignored: lane cells have no course"),
        (true, None) => Some("is honoured: a second crossing; --refly=false overrides it"),
        (true, Some(false)) => Some("is not honoured: --refly=false"),
        (true, Some(true)) => Some("is honoured"),
    };
    let told = told.map(|told| format!("Refly90Degrees of the survey {told}"));
    input.notices.extend(told);
    Ok(flag.unwrap_or(own && !approximate))
}

/// The planners that are asked: only passes have a course.
fn asked_planners(args: &CoverArgs, view: &View, refly: bool) -> Planners {
    let exact = args.exact || refly || (view.course_deg.is_some() && !args.approximate);
    planners(exact, args.approximate)
}

/// What flags say of how the area is seen.
fn flags(args: &CoverArgs) -> Flags {
    Flags {
        altitude_m: args.output.altitude_m,
        swath_m: args.swath_m,
        look_ahead_m: args.look_ahead_m,
        course_deg: args.course_deg,
        trigger_m: args.output.upload.trigger_m,
        run_out_m: args.run_out_m,
        no_course: args
            .every_course
            .then_some("the survey's angle is not used: --every-course"),
    }
}

/// Why a UAV stays at home.
fn why(uav: usize, stays: Stays, request: &AreaRequest, plan: &AreaPlan) -> String {
    if let (Stays::NoSensor, Some(sensor)) = (stays, &request.sensor) {
        return format!("has no sensor {sensor:?}");
    }
    let left = match plan.facts {
        Some(Facts::Passes {
            unserved_passes, ..
        }) => unserved_passes > 0,
        Some(Facts::Cells { cells_left, .. }) => cells_left > 0,
        None => false,
    };
    let uav = &request.team[uav];
    let way_s = 2.0 * request.area.distance_m(uav.start) / uav.speed_mps;
    why_home(uav.endurance_s, way_s, left)
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
    let at_home = plan.uavs.iter().enumerate().filter_map(|(i, uav)| {
        let why = why(i, uav.stays?, request, plan);
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
    summary["clearance_m"] = json!(request.clearance_m);
    summary["wind_mps"] = json!(args.wind.wind_mps);
    summary["wind_from_deg"] = json!(args.wind.wind_from_deg);
    summary["look_ahead_m"] = json!(request.look_ahead_m);
    summary["at_home"] = at_home.collect();
    summary["notices"] = json!([&input.notices[..], &plan.notices].concat());
    let shapes = plan.shapes.iter().map(|shape| {
        let told = match &shape.kind {
            ShapeKind::Cell { number, area_m2 } => json!({"cell": number, "area_m2": area_m2}),
            ShapeKind::LeftCell => json!({"left": true}),
            ShapeKind::Unreached => json!({"unreached": true}),
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
        site: input.site.clone(),
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
            unreached_passes,
        }) => json!({
            "area_m2": area_m2, "cells": cells, "passes": passes,
            "unserved_passes": unserved_passes, "unreached_passes": unreached_passes,
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
