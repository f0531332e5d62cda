//! From a scenario's text to a [`Spec`] with nothing left open: mission, fleet on
//! its loop, radio, faults. Leaves judging whether it can succeed to `feasibility`.

use crate::choose_tree;
use crate::document::{Document, Fields, Node};
use crate::error::{Finding, ScenarioError, Severity};
use crate::feasibility::{self, loop_trouble};
use crate::files::Files;
use crate::flight_model;
use crate::forecast::AreaPlanner;
use crate::read::faults::{self, Known, permille};
use crate::read::fleet::{self, Fleet, word};
use crate::read::terrain::{self, MAX_HEIGHT_M, Notices, Terrain, position};
use skein_flight::trajectory::timed::Objective;
use skein_flight::trajectory::wind::Wind;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::{NoFlyZones, Polygon};
use skein_netsim::spec::{GroundStationSpec, RadioSpec, Spec, UavSpec};
use skein_peer::mission::{PointMm, mm};
use skein_peer::offload::MissionGeometry;
use skein_peer::{CoverageTask, Mission};
use std::collections::BTreeSet;
use std::sync::Arc;

/// All fields of a scenario.
const FIELDS: &[&str] = &[
    "name",
    "seed",
    "time_scale",
    "max_time_s",
    "origin",
    "area",
    "points",
    "lines",
    "planner",
    "laps",
    "level_m",
    "vertical_margin_m",
    "no_fly",
    "buildings",
    "lanes",
    "base",
    "airframes",
    "fleet",
    "ground",
    "wind",
    "objective",
    "radio",
    "beacon_period_s",
    "percept_period_ms",
    "faults",
    "storm",
    "checks",
];

/// Shortest beacon period in wall time, seconds: the transport's own timers run in
/// wall time and must stay faster than the protocol's.
const MIN_WALL_BEACON_S: f64 = 0.1;

/// What a command line changes in a scenario.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Overrides {
    /// Number of UAVs of a generated fleet. Faults that name others are left out.
    pub peers: Option<u16>,
    /// The default seed.
    pub seed: Option<u64>,
    /// Scenario seconds per second of wall time, at most 10.
    pub time_scale: Option<f64>,
    /// Who plans an area, instead of whom the scenario names.
    pub planner: Option<AreaPlanner>,
}

/// A scenario, resolved, and all that was noticed on the way.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// What a run needs.
    pub spec: Spec,
    /// The coverage loop and the routes that follow from the mission.
    pub ground: Arc<MissionGeometry>,
    /// Notes and warnings, with their places; no errors.
    pub findings: Vec<Finding>,
}

/// Resolves a scenario from its text; `file` names it in errors.
///
/// # Errors
/// [`ScenarioError`] names the place of what is wrong, in form or in meaning.
pub fn parse_with(
    file: &str,
    text: &str,
    files: &Files<'_>,
    over: &Overrides,
) -> Result<Scenario, ScenarioError> {
    let document = Document::new(file, text);
    let value = document.parse()?;
    let root = Node::root(&document, &value);
    let mut findings = Vec::new();
    let (spec, ground) = resolve(&root, files, over, &mut findings)?;
    for mut finding in feasibility::with_ground(&spec, Ok(&ground)) {
        let place = root.locate(&finding.field);
        if finding.severity == Severity::Error {
            return Err(ScenarioError::Invalid {
                place,
                field: finding.field,
                problem: finding.problem,
            });
        }
        finding.place = Some(place);
        findings.push(finding);
    }
    Ok(Scenario {
        spec,
        ground,
        findings,
    })
}

fn resolve(
    root: &Node<'_>,
    files: &Files<'_>,
    over: &Overrides,
    findings: &mut Vec<Finding>,
) -> Result<(Spec, Arc<MissionGeometry>), ScenarioError> {
    let f = root.fields(FIELDS)?;
    let name = word(f.need("name", "\"city\"")?)?;
    let max_time_s = f.whole_or("max_time_s", 6000, 1, 604_800, "seconds")?;
    let (time_scale, beacon_period_ms) = times(&f, over)?;
    let mut terrain = told_terrain(root, &f, files, findings)?;
    if let Some(planner) = over.planner {
        if AreaPlanner::of(&terrain.task).is_none() {
            let node = f.get("points").or(f.get("lines")).unwrap_or(f.node());
            return Err(node.wrong(
                "a planner can be chosen for an area; points and lines have one planner each",
            ));
        }
        terrain.task = planner.task();
    }
    let ground_spec = f.get("ground").map(ground_station).transpose()?;
    let ground_id = ground_spec.as_ref().map(|g| g.id);
    let fleet = the_fleet(&f, &name, terrain.level_m, ground_id, over)?;
    let wind = f.get("wind").map_or(Ok(Wind::CALM), flight_model::wind)?;
    let mission = Arc::new(mission(&f, &terrain, &fleet, ground_spec.as_ref(), wind)?);
    check_size(&f, &mission, &terrain.area)?;
    check_places(&f, &mission, &terrain, &fleet)?;
    let ground = common_ground(root, &mission)?;
    let (mission, ground) = if choose_tree::stated(&choose_tree::lanes(&f)?)?.is_none() {
        let airframes: Vec<_> = fleet.members.iter().map(|m| m.airframe).collect();
        choose_tree::cheapest(mission, ground, &airframes, wind)
    } else {
        (mission, ground)
    };
    let uavs = launch(&fleet, &ground);
    let radio = radio(f.need("radio", "{ range_m: 500, rate_bps: 64000 }")?)?;
    let peers: BTreeSet<u16> = uavs.iter().map(|u| u.id).chain(ground_id).collect();
    let known = Known {
        peers: Some(&peers),
        max_time_s,
        loss_permille: radio.loss_permille,
        lenient: over.peers.is_some(),
    };
    let faults = f
        .get("faults")
        .map_or(Ok(Vec::new()), |list| faults::read(list, &known, findings))?;
    let storm = faults::storm(f.get("storm"), uavs.len(), over.peers.is_some())?;
    let (min_coverable, min_separation_m) = checks(f.get("checks"))?;
    let spec = Spec {
        name,
        fleet: fleet.key,
        mission,
        buildings: terrain.buildings,
        zones: terrain.zones,
        uavs,
        ground: ground_spec,
        wind,
        objective: f
            .get("objective")
            .map_or(Ok(Objective::Time), flight_model::objective)?,
        radio,
        beacon_period_ms,
        percept_period_ms: f.whole_or("percept_period_ms", 200, 20, 1000, "milliseconds")?,
        time_scale,
        max_time_s,
        min_coverable,
        min_separation_m,
        faults,
        storm,
        seed: match over.seed {
            Some(s) => s,
            None => u64::from(f.whole_or("seed", 1, 0, u32::MAX, "any number")?),
        },
    };
    Ok((spec, ground))
}

/// The terrain, and what its files told as notes.
fn told_terrain(
    root: &Node<'_>,
    f: &Fields<'_>,
    files: &Files<'_>,
    findings: &mut Vec<Finding>,
) -> Result<Terrain, ScenarioError> {
    let mut notices = Notices::new();
    let terrain = terrain::read(f, files, &mut notices)?;
    findings.extend(notices.into_iter().map(|(field, text)| {
        let mut note = Finding::new(Severity::Note, &field, text);
        note.place = Some(root.locate(&field));
        note
    }));
    Ok(terrain)
}

fn the_fleet(
    f: &Fields<'_>,
    name: &str,
    level_m: f64,
    ground_id: Option<u16>,
    over: &Overrides,
) -> Result<Fleet, ScenarioError> {
    let airframes = fleet::airframes(f.need("airframes", "{ swift: { ... } }")?, level_m)?;
    let example = "{ count: 8, airframes: [\"swift\"], launch: \"spread\" }";
    fleet::read(
        f.need("fleet", example)?,
        &airframes,
        name,
        level_m,
        ground_id,
        over,
    )
}

/// The loop and the routes that all UAVs derive from the mission.
fn common_ground(
    root: &Node<'_>,
    mission: &Arc<Mission>,
) -> Result<Arc<MissionGeometry>, ScenarioError> {
    mission.geometry().map_err(|e| {
        let (field, problem) = loop_trouble(mission, &e);
        ScenarioError::Invalid {
            place: root.locate(&field),
            field,
            problem,
        }
    })
}

/// Time scale and beacon period, which limit each other.
fn times(f: &Fields<'_>, over: &Overrides) -> Result<(f64, u32), ScenarioError> {
    let in_file = f.number_or("time_scale", 1.0, 0.1, 10.0, "scenario seconds per second")?;
    let time_scale = over.time_scale.unwrap_or(in_file);
    if !(0.1..=10.0).contains(&time_scale) {
        return Err(f.node().wrong(format!(
            "a time scale of {time_scale} was asked for; expected 0.1 to 10"
        )));
    }
    let beacon_s = f.number_or("beacon_period_s", 1.0, 0.1, 60.0, "seconds")?;
    if beacon_s / time_scale < MIN_WALL_BEACON_S - 1e-9 {
        let at = f.get("beacon_period_s").unwrap_or(f.node());
        return Err(at.wrong(format!(
            "{beacon_s} s at time scale {time_scale} are less than {MIN_WALL_BEACON_S} s of wall time; lower time_scale to {:.1}",
            beacon_s / MIN_WALL_BEACON_S
        )));
    }
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 0.1 and 60 s"
    )]
    Ok((time_scale, (beacon_s * 1000.0).round() as u32))
}

fn ground_station(node: &Node<'_>) -> Result<GroundStationSpec, ScenarioError> {
    let f = node.fields(&["id", "east_m", "north_m", "height_m"])?;
    Ok(GroundStationSpec {
        id: f.small_or("id", 100, 1, u16::MAX, "a peer's number")?,
        position: position(&f)?,
        height_m: f.number_or("height_m", 2.0, 0.0, MAX_HEIGHT_M, "metres")?,
    })
}

fn radio(node: &Node<'_>) -> Result<RadioSpec, ScenarioError> {
    let f = node.fields(&[
        "range_m",
        "rate_bps",
        "loss_percent",
        "delay_ms",
        "queue_age_ms",
        "share",
    ])?;
    Ok(RadioSpec {
        range_m: f.need("range_m", "500")?.number(1.0, 1e6, "metres")?,
        rate_bps: f.whole_or("rate_bps", 64_000, 1200, 1_000_000_000, "bit/s")?,
        loss_permille: f.get("loss_percent").map_or(Ok(0), permille)?,
        delay_ms: f.small_or("delay_ms", 5, 0, 10_000, "milliseconds")?,
        queue_age_ms: f.whole_or("queue_age_ms", 2000, 1, 60_000, "milliseconds")?,
        share: f.number_or("share", 0.5, 0.01, 1.0, "as a share of the channel")?,
    })
}

fn checks(node: Option<&Node<'_>>) -> Result<(f64, f64), ScenarioError> {
    let Some(node) = node else {
        return Ok((0.97, 0.0));
    };
    let f = node.fields(&["min_coverable", "min_separation_m"])?;
    Ok((
        f.number_or("min_coverable", 0.97, 0.0, 1.0, "as a share of the area")?,
        f.number_or("min_separation_m", 0.0, 0.0, 10_000.0, "metres")?,
    ))
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "saturates, and readers limit it"
)]
fn length_mm(m: f64) -> u32 {
    m.round() as u32
}

fn ring_mm(p: &Polygon) -> Vec<PointMm> {
    p.vertices().iter().map(|v| (mm(v.x), mm(v.y))).collect()
}

fn mission(
    f: &Fields<'_>,
    t: &Terrain,
    fleet: &Fleet,
    ground: Option<&GroundStationSpec>,
    wind: Wind,
) -> Result<Mission, ScenarioError> {
    let lanes = choose_tree::lanes(f)?;
    let spacing_m = lanes
        .need("spacing_m", "48")?
        .number(2.0, 5000.0, "metres")?;
    let error_m = lanes.number_or("tracking_error_m", 3.0, 0.0, 1000.0, "metres")?;
    let airframes = || fleet.members.iter().map(|m| &m.airframe);
    let over = |value: fn(&skein_flight::airframe::Airframe) -> f64| airframes().map(value);
    let turn_m = over(|a| a.min_turn_radius_m()).fold(0.0, f64::max);
    if turn_m > spacing_m / 2.0 {
        return Err(lanes.need("spacing_m", "48")?.wrong(format!(
            "lanes of {spacing_m} m are too narrow for a turn radius of {turn_m:.1} m at cruise; expected at least {:.1} m, or a lower cruise_mps, or a larger bank_deg",
            2.0 * turn_m
        )));
    }
    let turn_m = airframes()
        .map(|a| flight_model::turn_radius_m(a, wind, spacing_m))
        .fold(turn_m, f64::max);
    // An airframe without its computer circles where it is, within two radii.
    let clearance_m =
        lanes.number_or("clearance_m", 2.0 * turn_m + error_m, 0.0, 5000.0, "metres")?;
    let base = match (f.get("base"), ground) {
        (Some(node), _) => position(&node.fields(&["east_m", "north_m"])?)?,
        (None, Some(g)) => g.position,
        (None, None) => centre(&t.area),
    };
    // A launch point that reaches the loop; UAVs that start on the loop do so anyway.
    let launch = fleet
        .members
        .first()
        .and_then(|m| m.launch)
        .map_or(base, |l| l.position());
    let seen = |side: fn((f64, f64)) -> f64| {
        let each = airframes().map(|a| side(flight_model::footprint_m(a, wind, turn_m)));
        each.fold(f64::MAX, f64::min)
    };
    Ok(Mission {
        revision: 1,
        origin_lat_e7: e7(t.origin.lat_deg),
        origin_lon_e7: e7(t.origin.lon_deg),
        area: ring_mm(&t.area),
        zones: t.zones.iter().map(ring_mm).collect(),
        lane_spacing_mm: length_mm(spacing_m * 1000.0),
        turn_radius_mm: length_mm((turn_m * 1000.0).ceil()),
        clearance_mm: length_mm((clearance_m * 1000.0).ceil()),
        footprint_across_mm: length_mm((seen(|m| m.0) * 1000.0).floor()),
        footprint_along_mm: length_mm((seen(|m| m.1) * 1000.0).floor()),
        tracking_error_mm: length_mm(error_m * 1000.0),
        launch: (mm(launch.x), mm(launch.y)),
        base: (mm(base.x), mm(base.y)),
        task: t.task.clone(),
        lap: 0,
        further_laps: laps(f, t)? - 1,
        tree: choose_tree::stated(&lanes)?.unwrap_or_default(),
    })
}

/// How often everything is to be seen.
fn laps(f: &Fields<'_>, t: &Terrain) -> Result<u16, ScenarioError> {
    let laps = f.small_or("laps", 1, 1, 1000, "times")?;
    match f.get("laps") {
        Some(node) if laps > 1 && t.task == CoverageTask::Exact => Err(node
            .wrong("exact passes are flown once; for several times round take planner \"lanes\"")),
        _ => Ok(laps),
    }
}

#[allow(clippy::cast_possible_truncation, reason = "at most 1.8e9")]
fn e7(degrees: f64) -> i32 {
    (degrees * 1e7).round() as i32
}

fn centre(area: &Polygon) -> Point {
    let (low, high) = bounds(area);
    Point::new((low.x + high.x) / 2.0, (low.y + high.y) / 2.0)
}

pub(crate) fn bounds(area: &Polygon) -> (Point, Point) {
    let first = area.vertices().first().copied().unwrap_or_default();
    area.vertices().iter().fold((first, first), |(a, b), v| {
        (
            Point::new(a.x.min(v.x), a.y.min(v.y)),
            Point::new(b.x.max(v.x), b.y.max(v.y)),
        )
    })
}

/// Refuses missions of more cells than one may have before anything is built.
fn check_size(f: &Fields<'_>, mission: &Mission, area: &Polygon) -> Result<(), ScenarioError> {
    /// Cells of the bounding box: four times the 65,535 that a mission may have, so
    /// that slanted and concave areas pass.
    const MAX_BOX_CELLS: f64 = 262_140.0;
    let spacing_m = f64::from(mission.lane_spacing_mm) / 1000.0;
    let (low, high) = bounds(area);
    let cells = ((high.x - low.x) / spacing_m + 2.0) * ((high.y - low.y) / spacing_m + 2.0);
    // Cells are named by 16-bit columns and rows.
    let farthest = low.coords.abs().max().max(high.coords.abs().max()) / spacing_m;
    if cells > MAX_BOX_CELLS || farthest > 32_000.0 {
        let lanes = choose_tree::lanes(f)?;
        return Err(lanes.need("spacing_m", "48")?.wrong(format!(
            "an area of {:.0} x {:.0} m has too many cells of {spacing_m} m; a mission may have 65,535: widen the lanes or shrink the area",
            high.x - low.x,
            high.y - low.y
        )));
    }
    Ok(())
}

/// Launch points and the base must be clear of the zones.
fn check_places(
    f: &Fields<'_>,
    mission: &Mission,
    t: &Terrain,
    fleet: &Fleet,
) -> Result<(), ScenarioError> {
    let zones = NoFlyZones::new(t.zones.clone());
    let clearance_m = f64::from(mission.clearance_mm) / 1000.0;
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
    let uavs = f
        .need("fleet", "{}")?
        .members()?
        .into_iter()
        .find(|(n, _)| *n == "uavs");
    if let Some((_, list)) = uavs {
        for item in list.items()? {
            let launch = item.members()?.into_iter().find(|(n, _)| *n == "launch");
            if let Some((_, node)) = launch
                && let Some(problem) = trouble(position(&node.fields(&[
                    "east_m",
                    "north_m",
                    "heading_deg",
                ])?)?)
            {
                return Err(node.wrong(format!("this launch point {problem}")));
            }
        }
    }
    let base = skein_peer::mission::point_m(mission.base);
    if let Some(problem) = trouble(base) {
        let at = f.get("base").or(f.get("ground")).unwrap_or(f.node());
        return Err(at.wrong(format!(
            "the base, where UAVs loiter at the end, {problem}; set base: {{ east_m, north_m }}"
        )));
    }
    debug_assert!(!fleet.members.is_empty());
    Ok(())
}

/// Gives every UAV its launch pose: its own, or evenly spread round the loop.
fn launch(fleet: &Fleet, ground: &MissionGeometry) -> Vec<UavSpec> {
    let n = ground.coverage_loop.len();
    let k = fleet.members.len();
    let on_loop = |i: usize| -> Pose { ground.coverage_loop.boundary(i * n / k) };
    let uav = |(i, m): (usize, &fleet::Member)| UavSpec {
        id: m.id,
        airframe: m.airframe,
        launch: m.launch.unwrap_or_else(|| on_loop(i)),
        height_m: m.height_m,
    };
    fleet.members.iter().enumerate().map(uav).collect()
}
