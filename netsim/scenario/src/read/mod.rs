//! From the text of a scenario to values with units, one subject a file. Leaves what the
//! values mean together (mission, loop, feasibility) to the modules that follow.

pub(crate) mod buildings;
pub(crate) mod contour;
pub(crate) mod counts;
pub(crate) mod crowd;
pub(crate) mod detections;
pub(crate) mod faults;
pub(crate) mod fleet;
mod intruders;
pub(crate) mod lanes;
pub(crate) mod layers;
mod obstacles;
pub(crate) mod operator;
pub(crate) mod radio;
pub(crate) mod run;
mod services;
mod shared;
pub(crate) mod streets;
pub(crate) mod targets;
mod tasks;
pub(crate) mod terrain;
#[cfg(test)]
pub(crate) mod testing;
mod vehicles;
pub(crate) mod wind;

use crate::diagram;
use crate::error::{Finding, ScenarioError, Severity};
use crate::files::Files;
use crate::request::{AreaPlanner, Overrides};
use faults::Known;
use fleet::Fleet;
use lanes::Lanes;
use run::Run;
use shared::{Notices, position};
use skein_flight::coverage::ring::division::Rule;
use skein_flight::trajectory::timed::Objective;
use skein_geometry::frame::Point;
use skein_interop::airframe;
use skein_interop::json::{Document, Error, Fields, Node, Places};
use skein_netsim::fault::TimedFault;
use skein_netsim::spec::{
    ContourSpec, CrowdSpec, GroundStationSpec, IntruderSpec, ObstacleSpec, RadioSpec, ServiceSpec,
    StormSpec, VehicleSpec,
};
use skein_netsim::weather::Weather;
use skein_peer::buildings::Buildings;
use skein_peer::count_site::CountSite;
use skein_peer::criteria::Criterion;
use skein_peer::crowd::CrowdWatch;
use skein_peer::diagram::Diagram;
use skein_peer::input::NewTask;
use skein_peer::streets::Streets;
use std::collections::BTreeSet;
use std::sync::Arc;
use targets::Asked;
use terrain::Terrain;

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
    "mission",
    "division",
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
    "operator",
    "vehicles",
    "services",
    "intruders",
    "obstacles",
    "contour",
    "crowd",
    "storm",
    "checks",
];

/// A scenario as its text and the command line state it: values in metres and seconds,
/// nothing derived from them, and the place of each.
#[derive(Clone, Debug)]
pub(crate) struct Stated {
    pub(crate) name: String,
    pub(crate) run: Run,
    pub(crate) terrain: Terrain,
    pub(crate) asked: Asked,
    /// How often everything is to be seen.
    pub(crate) laps: u16,
    /// The diagram that the mission is flown by; none for the default one.
    pub(crate) diagram: Option<Diagram>,
    /// What is looked for besides.
    pub(crate) detections: Vec<Criterion>,
    /// Tasks that begin with the mission.
    pub(crate) brought: Vec<NewTask>,
    /// Where vehicles are counted.
    pub(crate) counts: Vec<CountSite>,
    /// The streets of the mission.
    pub(crate) streets: Option<Arc<Streets>>,
    /// Heights at each of which all is to be seen, metres; none where all is flown at one.
    pub(crate) layers_m: Vec<f64>,
    /// The mass event that the mission watches.
    pub(crate) crowd: Option<Arc<CrowdWatch>>,
    /// The buildings that it tells.
    pub(crate) buildings_told: Option<Arc<Buildings>>,
    /// By what rule the loop is divided.
    pub(crate) division: Rule,
    pub(crate) lanes: Lanes,
    pub(crate) fleet: Fleet,
    pub(crate) ground_station: Option<GroundStationSpec>,
    /// Where UAVs loiter at the end, where the file says so.
    pub(crate) base: Option<Point>,
    pub(crate) wind: Weather,
    pub(crate) objective: Objective,
    pub(crate) radio: RadioSpec,
    pub(crate) faults: Vec<TimedFault>,
    /// The file that they are of, where it is not the scenario's own.
    pub(crate) faults_of: Option<String>,
    /// What the operator does, ascending by time.
    pub(crate) operator: Vec<operator::Act>,
    /// Vehicles on the ground.
    pub(crate) vehicles: Vec<VehicleSpec>,
    /// Services on the ground.
    pub(crate) services: Vec<ServiceSpec>,
    /// Aircraft that are no members.
    pub(crate) intruders: Vec<IntruderSpec>,
    /// Obstacles that are on no map.
    pub(crate) obstacles: Vec<ObstacleSpec>,
    /// A road or a fire that no peer knows.
    pub(crate) contour: Option<ContourSpec>,
    /// The people of a mass event.
    pub(crate) crowd_there: Option<CrowdSpec>,
    pub(crate) storm: StormSpec,
    /// What its files told besides what was asked, and faults that were left out.
    pub(crate) findings: Vec<Finding>,
    pub(crate) places: Places,
}

/// Reads everything that a scenario states.
pub(crate) fn scenario(
    file: &str,
    text: &str,
    files: &Files<'_>,
    over: &Overrides,
) -> Result<Stated, ScenarioError> {
    let document = Document::parse("scenario", file, text)?;
    let root = document.root();
    let f = root.fields(FIELDS)?;
    let places = document.places();
    let name = f.need("name", "\"city\"")?.word()?;
    let run = run::read(&f, over)?;
    let mut notices = Notices::new();
    let (terrain, asked) = terrain::read(&f, files, &mut notices)?;
    let asked = planned_by(&f, asked, over.planner)?;
    let ground_station = f.get("ground").map(fleet::ground_station).transpose()?;
    let ground_id = ground_station.as_ref().map(|g| g.id);
    let fleet = fleet::read(&f, &name, terrain.level_m, ground_id, over)?;
    let radio = radio::read(f.need("radio", "{ range_m: 500, rate_bps: 64000 }")?)?;
    let peers: BTreeSet<u16> = fleet
        .members
        .iter()
        .map(|m| m.id)
        .chain(ground_id)
        .collect();
    let known = Known {
        peers: Some(&peers),
        ground: ground_id,
        max_time_s: run.max_time_s,
        loss_permille: radio.loss_permille,
        lenient: over.peers.is_some(),
    };
    let operator = f.get("operator").map_or_else(
        || Ok(Vec::new()),
        |list| operator::read(list, (&terrain, files), &known, &mut notices),
    )?;
    let vehicles = f.get("vehicles").map_or_else(
        || Ok(Vec::new()),
        |list| vehicles::read(list, (terrain.origin, files), &mut notices),
    )?;
    let services = f.get("services").map_or_else(
        || Ok(Vec::new()),
        |list| services::read(list, (terrain.origin, files), ground_id, &mut notices),
    )?;
    let streets = f.get("mission").map_or(Ok(None), |node| {
        streets::of_mission(node, (terrain.origin, files), &terrain.area, &mut notices)
    })?;
    let buildings_told = f.get("mission").map_or(Ok(None), |node| {
        buildings::of_mission(node, (&terrain, &fleet), files, &mut notices)
    })?;
    let mut findings: Vec<Finding> = notices
        .into_iter()
        .map(|(field, text)| Finding {
            place: Some(places.locate(&field)),
            ..Finding::new(Severity::Note, &field, text)
        })
        .collect();
    let own = match f.get("faults") {
        Some(list) => faults::read(list, &known, &mut findings)?,
        None => Vec::new(),
    };
    let faults = match &over.faults {
        Some(plan) => faults::load_chaos_plan(plan, Some(&peers))?,
        None => own,
    };
    Ok(Stated {
        faults_of: over.faults.as_ref().map(|plan| plan.display().to_string()),
        storm: faults::storm(f.get("storm"), fleet.members.len(), over.peers.is_some())?,
        laps: f.small_or("laps", 1, 1, 1000, "times")?,
        diagram: f
            .get("mission")
            .map_or(Ok(None), |node| diagram::of_mission(node, files))?,
        detections: f
            .get("mission")
            .map_or(Ok(Vec::new()), detections::of_mission)?,
        brought: f.get("mission").map_or(Ok(Vec::new()), tasks::of_mission)?,
        counts: f
            .get("mission")
            .map_or(Ok(Vec::new()), counts::of_mission)?,
        streets,
        layers_m: f.get("mission").map_or(Ok(Vec::new()), |node| {
            layers::of_mission(node, terrain.level_m)
        })?,
        crowd: f.get("mission").map_or(Ok(None), crowd::of_mission)?,
        buildings_told,
        division: f.get("division").map_or(Ok(Rule::Best), division)?,
        lanes: lanes::read(&f)?,
        base: f
            .get("base")
            .map(|node| position(&node.fields(&["east_m", "north_m"])?))
            .transpose()?,
        wind: f.get("wind").map_or(Ok(Weather::default()), wind::read)?,
        objective: f
            .get("objective")
            .map_or(Ok(Objective::Time), airframe::objective)?,
        name,
        run,
        terrain,
        asked,
        fleet,
        ground_station,
        radio,
        faults,
        operator,
        vehicles,
        services,
        intruders: f
            .get("intruders")
            .map_or_else(|| Ok(Vec::new()), intruders::read)?,
        obstacles: f
            .get("obstacles")
            .map_or_else(|| Ok(Vec::new()), obstacles::read)?,
        contour: f.get("contour").map(contour::read).transpose()?,
        crowd_there: f.get("crowd").map(crowd::read).transpose()?,
        findings,
        places,
    })
}

fn division(node: &Node<'_>) -> Result<Rule, Error> {
    node.one_of(&[("best", Rule::Best), ("backtracking", Rule::Backtracking)])
}

/// What is asked for, by the planner that the command line names.
fn planned_by(f: &Fields<'_>, asked: Asked, planner: Option<AreaPlanner>) -> Result<Asked, Error> {
    match (planner, &asked) {
        (None, _) => Ok(asked),
        (Some(planner), Asked::Area(_)) => Ok(Asked::Area(planner)),
        (Some(_), Asked::Targets(_)) => {
            let node = f.get("points").or(f.get("lines")).unwrap_or(f.node());
            Err(node.wrong(
                "a planner can be chosen for an area; points and lines have one planner each",
            ))
        }
    }
}
