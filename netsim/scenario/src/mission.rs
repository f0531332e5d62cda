//! From what a scenario states to the mission that is spoken to the swarm: metres become
//! millimetres here. Leaves the loop to the mission itself, and whether it can succeed to
//! `feasibility`.

use crate::flight_model::turn_radius_m;
use crate::mounts::{check_mounts, held_footprint_m};
use crate::read::fleet::Member;
use crate::read::targets::Asked;
use crate::read::{Stated, layers};
use crate::request::AreaPlanner;
use skein_flight::airframe::Airframe;
use skein_flight::trajectory::wind::Wind;
use skein_geometry::frame::Point;
use skein_geometry::{NoFlyZones, Polygon};
use skein_interop::json::Error;
use skein_netsim::spec::{ObstaclePlace, Spec};
use skein_netsim::world::{intruders, unmapped};
use skein_peer::diagram::DiagramError;
use skein_peer::mission::{mm, ring_mm};
use skein_peer::wire::obstacle::Found;
use skein_peer::wire::tasks::TaskKind;
use skein_peer::{CoverageTask, Mission};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "saturates, and readers limit it"
)]
fn length_mm(mm: f64) -> u32 {
    mm.round() as u32
}

#[allow(clippy::cast_possible_truncation, reason = "at most 1.8e9")]
fn e7(degrees: f64) -> i32 {
    (degrees * 1e7).round() as i32
}

/// The mission of a scenario, with the tree that it states or else the default one.
pub(crate) fn mission(s: &Stated) -> Result<Mission, Error> {
    let (lanes, terrain) = (&s.lanes, &s.terrain);
    let airframes = || s.fleet.members.iter().map(|m| &m.airframe);
    let turn_m = turning(s)?;
    // An airframe without its computer circles where it is, within two radii.
    let clearance_m = lanes
        .clearance_m
        .unwrap_or(2.0 * turn_m + lanes.tracking_error_m);
    let station = s.ground_station.as_ref().map(|g| g.position);
    let base = s.base.or(station).unwrap_or_else(|| centre(&terrain.area));
    // A launch point that reaches the loop; UAVs that start on the loop do so anyway.
    let first = s.fleet.members.first().and_then(|m| m.launch);
    let launch = first.map_or(base, |l| l.position());
    let seen = |side: fn((f64, f64)) -> f64| {
        let wind = s.wind.strongest_held();
        let members = s.fleet.members.iter();
        let each = members.map(|m| side(held_footprint_m(&m.airframe, wind, turn_m, m.height_m)));
        each.fold(f64::MAX, f64::min)
    };
    let mission = Mission {
        revision: 1,
        origin_lat_e7: e7(terrain.origin.lat_deg),
        origin_lon_e7: e7(terrain.origin.lon_deg),
        area: ring_mm(terrain.area.vertices()),
        zones: terrain
            .zones
            .iter()
            .map(|z| ring_mm(z.vertices()))
            .collect(),
        lane_spacing_mm: length_mm(lanes.spacing_m * 1000.0),
        turn_radius_mm: length_mm((turn_m * 1000.0).ceil()),
        clearance_mm: length_mm((clearance_m * 1000.0).ceil()),
        footprint_across_mm: length_mm((seen(|m| m.0) * 1000.0).floor()),
        footprint_along_mm: length_mm((seen(|m| m.1) * 1000.0).floor()),
        tracking_error_mm: length_mm(lanes.tracking_error_m * 1000.0),
        launch: (mm(launch.x), mm(launch.y)),
        base: (mm(base.x), mm(base.y)),
        task: match &s.asked {
            Asked::Area(planner) => planner.task(),
            Asked::Targets(targets) => CoverageTask::of_targets(targets),
        },
        lap: 0,
        further_laps: laps(s)? - 1,
        layers: layers::of_fleet(&s.layers_m, &s.fleet),
        added_zones: BTreeMap::new(),
        dismissed: BTreeSet::new(),
        finds_obstacles: finds_obstacles(s),
        sortie: 0,
        cancelled: false,
        diagram: s.diagram.clone().map(Arc::new),
        detections: s.detections.clone(),
        tasks: s.brought.clone(),
        counts: s.counts.clone(),
        streets: s.streets.clone(),
        crowd: s.crowd.clone(),
        buildings: s.buildings_told.clone(),
        tree: lanes.tree.unwrap_or_default(),
        division: s.division,
        separation_mm: length_mm((s.fleet.separation_m * 1000.0).ceil()),
        fastest_mmps: if s.fleet.separation_m > 0.0 {
            length_mm((airframes().map(|a| a.cruise_mps).fold(0.0, f64::max) * 1000.0).ceil())
        } else {
            0
        },
    };
    check_mounts(s)?;
    layers::check(s, &mission)?;
    check_separation(s, &mission)?;
    check_intruders(s)?;
    check_obstacle_range(s, &mission)?;
    check_diagram(s, &mission)?;
    check_brought(s, &mission)?;
    check_size(s)?;
    check_places(s, &mission)?;
    Ok(mission)
}

/// The turn radius of the mission, metres: the widest of the fleet, which must fit the
/// lanes.
fn turning(s: &Stated) -> Result<f64, Error> {
    let spacing_m = s.lanes.spacing_m;
    let widest = |radius: &dyn Fn(&Airframe) -> f64| {
        let all = s.fleet.members.iter().map(|m| radius(&m.airframe));
        all.fold(0.0, f64::max)
    };
    let calm_m = widest(&Airframe::min_turn_radius_m);
    if calm_m > spacing_m / 2.0 {
        return Err(s.places.wrong("lanes.spacing_m", format!(
            "lanes of {spacing_m} m are too narrow for a turn radius of {calm_m:.1} m at cruise; expected at least {:.1} m, or a lower cruise_mps, or a larger bank_deg",
            2.0 * calm_m
        )));
    }
    Ok(calm_m.max(widest(&|a| {
        turn_radius_m(a, s.wind.strongest_held(), spacing_m)
    })))
}

/// How far UAVs sense each other and aircraft that are no members, metres: what is stated, or what
/// flying at one height and making way ask for.
pub(crate) fn traffic_range_m(s: &Stated, mission: &Mission) -> f64 {
    let others_m = if mission.layers.is_some() {
        layers::SENSED_M
    } else if s.fleet.separation_m > 0.0 {
        mission.least_traffic_range_m()
    } else {
        0.0
    };
    let least_m = others_m.max(least_range_to_intruders_m(s));
    s.fleet.traffic_range_m.unwrap_or_else(|| least_m.ceil())
}

/// How far aircraft have to be sensed for every UAV to make way for every intruder of the
/// scenario, metres; 0 where there are none.
fn least_range_to_intruders_m(s: &Stated) -> f64 {
    let fastest_mps = s.intruders.iter().map(|i| i.speed_mps).reduce(f64::max);
    let Some(fastest_mps) = fastest_mps else {
        return 0.0;
    };
    let wind_mps = s.wind.strongest_held().speed_mps();
    let is_promised = s.fleet.separation_m > 0.0;
    let of =
        |m: &Member| intruders::least_range_m(&m.airframe, fastest_mps + wind_mps, is_promised);
    s.fleet.members.iter().map(of).fold(0.0, f64::max)
}

/// Every UAV senses intruders in time to make way for them.
fn check_intruders(s: &Stated) -> Result<(), Error> {
    let least_m = least_range_to_intruders_m(s).ceil();
    match s.fleet.traffic_range_m {
        Some(range_m) if range_m < least_m => Err(s.places.wrong(
            "fleet.traffic_range_m",
            format!(
                "{range_m} m are too short to make way for an intruder that flies straight at a UAV; expected at least {least_m} m"
            ),
        )),
        _ => Ok(()),
    }
}

/// Whether UAVs sense obstacles that are on no map.
fn finds_obstacles(s: &Stated) -> bool {
    !s.obstacles.is_empty() || s.fleet.obstacle_range_m.is_some_and(|m| m > 0.0)
}

/// How far they sense them, metres: what is stated, or what turning away asks for; 0 where nothing
/// is to be sensed.
pub(crate) fn obstacle_range_m(s: &Stated, mission: &Mission) -> f64 {
    let least_m = || {
        if s.obstacles.is_empty() {
            0.0
        } else {
            least_range_to_obstacles_m(s, mission).ceil()
        }
    };
    s.fleet.obstacle_range_m.unwrap_or_else(least_m)
}

/// How far obstacles have to be sensed for every UAV to turn away from them, metres.
fn least_range_to_obstacles_m(s: &Stated, mission: &Mission) -> f64 {
    let wind_mps = s.wind.strongest_held().speed_mps();
    let of = |m: &Member| unmapped::least_range_m(&m.airframe, wind_mps, mission.clearance_m());
    s.fleet.members.iter().map(of).fold(0.0, f64::max)
}

fn check_obstacle_range(s: &Stated, mission: &Mission) -> Result<(), Error> {
    let least_m = least_range_to_obstacles_m(s, mission).ceil();
    match s.fleet.obstacle_range_m {
        Some(range_m) if finds_obstacles(s) && range_m < least_m => Err(s.places.wrong(
            "fleet.obstacle_range_m",
            format!(
                "{range_m} m are too short to turn away from an obstacle on no map; expected at least {least_m} m"
            ),
        )),
        _ => Ok(()),
    }
}

/// Obstacles at stated places stand where UAVs start and come home unhindered, and the mission can
/// be flown round them.
pub(crate) fn check_obstacles(s: &Stated, spec: &Spec) -> Result<(), Error> {
    let mission = &spec.mission;
    let room_m = mission.clearance_m() + 2.0 * mission.turn_radius_m();
    let starts = spec.uavs.iter().filter(|u| u.twin_of.is_none());
    let starts = starts.map(|u| {
        (
            format!("the launch place of uav{}", u.id),
            u.launch.position(),
        )
    });
    let kept: Vec<(String, Point)> = starts
        .chain([("the base".to_owned(), mission.base_m())])
        .collect();
    let mut stated = BTreeSet::new();
    for (n, obstacle) in s.obstacles.iter().enumerate() {
        let ObstaclePlace::At(at) = obstacle.place else {
            continue;
        };
        let field = format!("obstacles[{n}]");
        for (what, place) in &kept {
            let from_m = (place - at).norm() - obstacle.radius_m;
            if from_m < room_m {
                return Err(s.places.wrong(
                    &field,
                    format!(
                        "its edge is {from_m:.1} m from {what}; expected at least {room_m:.1} m"
                    ),
                ));
            }
        }
        stated.insert(Found::of(&obstacle.standing(at)));
    }
    let Some(round) = mission.with_found(&stated) else {
        return Ok(());
    };
    let flown = Arc::new(round).geometry().map_err(|e| e.to_string());
    flown.and_then(|g| g.base_is_clear()).map_err(|why| {
        let text = format!("nobody can fly round all of them: {why}");
        s.places.wrong("obstacles", text)
    })
}

/// What flying at one height by agreement asks for.
fn check_separation(s: &Stated, mission: &Mission) -> Result<(), Error> {
    if s.fleet.separation_m <= 0.0 {
        return Ok(());
    }
    if s.wind.winds().any(|w| w != Wind::CALM) {
        return Err(s.places.wrong(
            "fleet.separation_m",
            "UAVs keep apart at one height in still air only; leave the wind out, or separation_m, so that each has a height of its own",
        ));
    }
    if let Some(range_m) = s.fleet.traffic_range_m
        && range_m < mission.least_traffic_range_m()
    {
        return Err(s.places.wrong(
            "fleet.traffic_range_m",
            format!(
                "{range_m} m are too short: two UAVs that are farther apart could meet before either asks the other; expected at least {:.0} m",
                mission.least_traffic_range_m().ceil()
            ),
        ));
    }
    Ok(())
}

/// What it brings has to be done in it.
fn check_brought(s: &Stated, mission: &Mission) -> Result<(), Error> {
    let whole = Arc::new(mission.clone());
    for (i, asked) in mission.brought(false).iter().enumerate() {
        let place = format!("mission.tasks[{i}]");
        if asked.task.kind == TaskKind::Area {
            let text = "an area is asked for in flight, by an operator; give its places as points, or a line";
            return Err(s.places.wrong(&place, text));
        }
        whole
            .can_do(&asked.task)
            .map_err(|why| s.places.wrong(&place, why))?;
    }
    Ok(())
}

/// A diagram has to fit what is asked for.
fn check_diagram(s: &Stated, mission: &Mission) -> Result<(), Error> {
    let wrong = |e: DiagramError| {
        let text = format!("does not fit this mission: {e}");
        s.places.wrong("mission.diagram", text)
    };
    mission.machine().map(drop).map_err(wrong)
}

/// How often everything is to be seen.
fn laps(s: &Stated) -> Result<u16, Error> {
    if s.laps > 1 && s.asked == Asked::Area(AreaPlanner::Exact) {
        return Err(s.places.wrong(
            "laps",
            "exact passes are flown once; for several laps take planner \"lanes\"",
        ));
    }
    layers::laps(s)
}

fn centre(area: &Polygon) -> Point {
    let (low, high) = area.bounds();
    Point::new((low.x + high.x) / 2.0, (low.y + high.y) / 2.0)
}

/// Refuses missions of more cells than one may have before anything is built.
fn check_size(s: &Stated) -> Result<(), Error> {
    /// Cells of the bounding box: four times the 65,535 that a mission may have, so
    /// that slanted and concave areas pass.
    const MAX_BOX_CELLS: f64 = 262_140.0;
    let spacing_m = s.lanes.spacing_m;
    let (low, high) = s.terrain.area.bounds();
    let cells = ((high.x - low.x) / spacing_m + 2.0) * ((high.y - low.y) / spacing_m + 2.0);
    // Cells are named by 16-bit columns and rows.
    let farthest = low.coords.abs().max().max(high.coords.abs().max()) / spacing_m;
    if cells > MAX_BOX_CELLS || farthest > 32_000.0 {
        return Err(s.places.wrong("lanes.spacing_m", format!(
            "an area of {:.0} x {:.0} m has too many cells of {spacing_m} m; a mission may have 65,535: widen the lanes or shrink the area",
            high.x - low.x,
            high.y - low.y
        )));
    }
    Ok(())
}

/// Launch points and the base must be clear of the zones.
fn check_places(s: &Stated, mission: &Mission) -> Result<(), Error> {
    let zones = NoFlyZones::new(s.terrain.zones.clone());
    let clearance_m = mission.clearance_m();
    let trouble = |p: Point| {
        let d = zones.distance_m(p);
        (d < clearance_m).then(|| {
            if d <= 0.0 {
                "lies inside a no-fly zone; move it out".to_owned()
            } else {
                format!("is {d:.1} m from a no-fly zone; expected at least the clearance of {clearance_m:.1} m")
            }
        })
    };
    for uav in &s.fleet.members {
        if let Some(launch) = uav.launch
            && let Some(problem) = trouble(launch.position())
        {
            let problem = format!("this launch point {problem}");
            return Err(s.places.wrong(&uav.field, problem));
        }
    }
    if let Some(problem) = trouble(mission.base_m()) {
        let field = match (s.base, &s.ground_station) {
            (Some(_), _) => "base",
            (None, Some(_)) => "ground",
            (None, None) => "scenario",
        };
        return Err(s.places.wrong(
            field,
            format!(
                "the base, where UAVs loiter at the end, {problem}; set base: {{ east_m, north_m }}"
            ),
        ));
    }
    Ok(())
}
