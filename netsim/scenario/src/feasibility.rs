//! Whether a scenario can succeed at all: turn radius, footprint, endurance, zones,
//! faults. Estimates only; the world decides.

use crate::error::{Finding, Severity};
use crate::flight_model::{Pace, return_s, too_windy};
use skein_flight::coverage::passes::PassesError;
use skein_flight::coverage::ring::backtracking::{Division, OffLoop, Uav};
use skein_flight::coverage::ring::patch::Patches;
use skein_flight::coverage::ring::{CellId, CoverageLoop, Direction, Grid, LoopError};
use skein_geometry::frame::{Point, Vector};
use skein_geometry::{Polygon, math};
use skein_netsim::fault::Fault;
use skein_netsim::fault_generator::kills;
use skein_netsim::spec::{Spec, UavSpec};
use skein_netsim::world::Survey;
use skein_peer::CoverageTask;
use skein_peer::mission::{GeometryError, point_m};
use skein_peer::offload::MissionGeometry;
use skein_peer::wire::limits::PEERS_MAX;
use std::collections::{BTreeMap, BTreeSet};

/// Endurance, in flights round the whole loop, below which the death of some UAVs
/// may leave cells that nobody has the fuel for.
const COMFORTABLE_LOOPS: f64 = 2.5;

/// Circles through the base that are tried for their room.
const WAITING_HEADINGS: u32 = 32;

/// Checks everything that can be told before a run.
///
/// A scenario that came from a file was checked when it was read; this is for those
/// that were built otherwise.
#[must_use]
pub fn feasibility(spec: &Spec) -> Vec<Finding> {
    match spec.mission.geometry() {
        Ok(geometry) => with_geometry(spec, &geometry, &Survey::new(spec)).0,
        Err(e) => {
            let mut out = without_geometry(spec);
            out.push(Finding::new(Severity::Error, blamed(&e), e.to_string()));
            out
        }
    }
}

/// What was found, and what the scenario amounts to.
pub(crate) fn with_geometry(
    spec: &Spec,
    geometry: &MissionGeometry,
    survey: &Survey,
) -> (Vec<Finding>, Summary) {
    let mut out = without_geometry(spec);
    let summary = summary(spec, geometry);
    let planned = survey.clone().as_planned(geometry);
    nothing_is_left_out(spec, survey, &planned, &mut out);
    enough_is_coverable(spec, &summary, &planned, &mut out);
    on_loop(spec, geometry, &summary, &mut out);
    (out, summary)
}

fn without_geometry(spec: &Spec) -> Vec<Finding> {
    let mut out = Vec::new();
    fleet(spec, &mut out);
    faults(spec, &mut out);
    if spec.ground.is_none() {
        let text = "there is no ground station: nobody hears the swarm when it has finished; add ground: { east_m, north_m }";
        out.push(Finding::new(Severity::Warning, "ground", text));
    }
    out
}

/// The field to change when a mission has no geometry.
pub(crate) fn blamed(e: &GeometryError) -> &'static str {
    match e {
        GeometryError::Area(_) => "area",
        GeometryError::Diagram(_) => "mission.diagram",
        GeometryError::Detections(_) => "mission.detections",
        GeometryError::Tasks(_) => "mission.tasks",
        GeometryError::Counts(_) => "mission.counts",
        GeometryError::Streets(..) => "mission.streets",
        GeometryError::Layers(_) => "mission.layers_m",
        GeometryError::Crowd(..) => "mission.crowd",
        GeometryError::Buildings(_) => "mission.buildings",
        GeometryError::Laps => "laps",
        GeometryError::Zone(..) | GeometryError::AddedZone(..) | GeometryError::ZoneName => {
            "no_fly"
        }
        GeometryError::Loop(e) => match e {
            LoopError::TurnRadius { .. } | LoopError::TooManyCells(_) => "lanes.spacing_m",
            LoopError::Footprint { .. } => "airframes",
            LoopError::Nothing => "no_fly",
            LoopError::Extent => "area",
            LoopError::Number(_) => "lanes",
            LoopError::CutOff | LoopError::Launch => "base",
            LoopError::Passes(e) => match e {
                PassesError::TooMany => "lanes.spacing_m",
                PassesError::Zones(_) | PassesError::Nothing => "no_fly",
                PassesError::Launch => "base",
                PassesError::Number(_) | PassesError::Team(_) => "lanes",
            },
        },
    }
}

fn fleet(spec: &Spec, out: &mut Vec<Finding>) {
    let mut error =
        |field: &str, text: String| out.push(Finding::new(Severity::Error, field, text));
    if spec.uavs.is_empty() {
        error("fleet", "there is no UAV; expected at least one".to_owned());
    }
    let peers = spec.uavs.len() + usize::from(spec.ground.is_some());
    if peers > PEERS_MAX {
        let text = format!(
            "{} UAVs are too many: a fleet is of {PEERS_MAX} peers at most, the ground station included",
            spec.uavs.len()
        );
        error("fleet", text);
    }
    let mut ids = BTreeSet::new();
    for (i, id) in spec
        .uavs
        .iter()
        .map(|u| u.id)
        .chain(spec.ground.as_ref().map(|g| g.id))
        .enumerate()
    {
        if !ids.insert(id) {
            error(
                &format!("fleet.uavs[{i}].id"),
                format!("the number {id} is taken twice; every peer has its own"),
            );
        }
    }
    for (i, u) in spec.uavs.iter().enumerate() {
        if u.airframe.endurance_s <= u.airframe.reserve_s || !u.airframe.endurance_s.is_finite() {
            let text = format!(
                "UAV {} has no endurance beyond its reserve of {} s",
                u.id, u.airframe.reserve_s
            );
            error(&format!("fleet.uavs[{i}].airframe"), text);
        }
    }
    if let Some(text) = too_windy(spec) {
        error("wind.speed_mps", text);
    }
}

fn faults(spec: &Spec, out: &mut Vec<Finding>) {
    let ids: BTreeSet<u16> = spec
        .uavs
        .iter()
        .map(|u| u.id)
        .chain(spec.ground.as_ref().map(|g| g.id))
        .collect();
    let mut down: BTreeSet<u16> = BTreeSet::new();
    for f in &spec.faults {
        // The list of the file is expanded and sorted by now, so its place is all one can name.
        let at_s = f.at_ms / 1000;
        let mut tell = |severity, text: String| out.push(Finding::new(severity, "faults", text));
        if f.at_ms > u64::from(spec.max_time_s) * 1000 {
            let text = format!(
                "the fault at {at_s} s is after the end of the run at {} s",
                spec.max_time_s
            );
            tell(Severity::Error, text);
        }
        if let Some(id) = f.fault.peers().iter().find(|id| !ids.contains(id)) {
            tell(
                Severity::Error,
                format!("the fault at {at_s} s names a peer {id} that is not there"),
            );
        }
        match &f.fault {
            Fault::Kill { peer }
            | Fault::KillComputer { peer }
            | Fault::Terminate { peer }
            | Fault::Pause { peer } => {
                down.insert(*peer);
            }
            Fault::Restart { peer, .. } | Fault::Resume { peer } if !down.remove(peer) => {
                let text = format!(
                    "peer {peer} is neither down nor paused at {at_s} s: nothing will happen"
                );
                tell(Severity::Warning, text);
            }
            fault if fault.is_spoken() && spec.ground.is_none() => {
                let text = format!("at {at_s} s there is no ground station to speak it");
                tell(Severity::Error, text);
            }
            _ => {}
        }
    }
    if !spec.uavs.is_empty() && spec.uavs.iter().all(|u| down.contains(&u.id)) {
        let text = "in the end no UAV is left to finish the mission; at least one must live";
        out.push(Finding::new(Severity::Error, "faults", text));
    }
}

/// How many UAVs are left when as many are lost as the scenario or its storm may take.
fn survivors(spec: &Spec) -> usize {
    let killed = usize::try_from(kills(&spec.faults)).unwrap_or(usize::MAX);
    let losses = killed.max(usize::from(spec.storm.max_kills));
    spec.uavs.len().saturating_sub(losses).max(1)
}

/// What the loop reaches, and what the judge of a run will count.
/// Nobody looks for cells that could be seen and that the planner leaves out: they count as those
/// that cannot be seen, and whoever asks for them is told.
fn nothing_is_left_out(spec: &Spec, survey: &Survey, planned: &Survey, out: &mut Vec<Finding>) {
    let left_out = survey.n_coverable() - planned.n_coverable();
    if left_out > 0 {
        let field = match spec.mission.task {
            CoverageTask::Area | CoverageTask::Exact => "area",
            CoverageTask::Points(_) => "points",
            CoverageTask::Lines(_) => "lines",
        };
        let text = format!(
            "{left_out} of {} cells could be seen, but the planner finds no way to them: nobody looks for them, and the report counts them among those that cannot be seen",
            survey.cells().len()
        );
        out.push(Finding::new(Severity::Warning, field, text));
    }
}

fn enough_is_coverable(spec: &Spec, summary: &Summary, survey: &Survey, out: &mut Vec<Finding>) {
    let share = survey.coverable_share().min(summary.coverable_share);
    if share < spec.min_coverable {
        let text = format!(
            "only {:.1} % of the area can be covered, {:.1} % are asked for{}",
            share * 100.0,
            spec.min_coverable * 100.0,
            summary.reasons()
        );
        out.push(Finding::new(Severity::Error, "checks.min_coverable", text));
    }
}

fn on_loop(spec: &Spec, geometry: &MissionGeometry, summary: &Summary, out: &mut Vec<Finding>) {
    let reach_m = |u: &UavSpec| reach_m(u, spec, &geometry.coverage_loop);
    let usable_m: f64 = spec.uavs.iter().map(reach_m).sum();
    if usable_m < summary.loop_m {
        let text = format!(
            "all UAVs together fly {:.1} km before their reserve, the loop has {:.1} km",
            usable_m / 1000.0,
            summary.loop_m / 1000.0
        );
        out.push(Finding::new(Severity::Error, "airframes", text));
    } else if !summary.unassigned_cells.is_empty() {
        let text = format!(
            "{} cells are beyond the endurance of every UAV that could serve them",
            summary.unassigned_cells.len()
        );
        out.push(Finding::new(Severity::Error, "airframes", text));
    }
    let mut weakest_m: Vec<f64> = spec.uavs.iter().map(reach_m).collect();
    weakest_m.sort_by(f64::total_cmp);
    let n_left = survivors(spec);
    let loops = weakest_m.iter().take(n_left).sum::<f64>() / summary.loop_m;
    if loops < COMFORTABLE_LOOPS {
        let who = match n_left {
            1 => "the weakest UAV flies".to_owned(),
            n => format!("the weakest {n} UAVs together fly"),
        };
        let text = format!(
            "{who} {loops:.1} times the loop; with less than {COMFORTABLE_LOOPS} those who are left after the losses of the storm may be unable to finish"
        );
        out.push(Finding::new(Severity::Warning, "airframes", text));
    }
    if summary.makespan_s > f64::from(spec.max_time_s) {
        let text = format!(
            "covering takes about {:.0} s without any failure, the run ends at {} s",
            summary.makespan_s, spec.max_time_s
        );
        out.push(Finding::new(Severity::Error, "max_time_s", text));
    }
    timed(spec, summary, out);
    launches(spec, geometry, out);
    room_at_base(spec, geometry, out);
    moved_bases(spec, geometry, out);
}

/// A mission that ends after so many seconds ends before anything else does: all has to be seen by
/// then, and somebody has to fly as long.
fn timed(spec: &Spec, summary: &Summary, out: &mut Vec<Finding>) {
    let Some(ends_s) = spec.mission.ends_after_s().map(f64::from) else {
        return;
    };
    let mut error = |text| out.push(Finding::new(Severity::Error, "mission.for_s", text));
    let airframes = || spec.uavs.iter().map(|u| &u.airframe);
    let longest_s = airframes()
        .map(|a| a.endurance_s - a.reserve_s)
        .fold(0.0, f64::max);
    if ends_s >= longest_s {
        error(format!(
            "the mission ends after {ends_s:.0} s, and no UAV flies longer than {longest_s:.0} s before its reserve"
        ));
    }
    if ends_s < summary.makespan_s {
        error(format!(
            "the mission ends after {ends_s:.0} s, and covering takes about {:.0} s without any failure",
            summary.makespan_s
        ));
        return;
    }
    let mut speeds_mps: Vec<f64> = airframes().map(|a| a.cruise_mps).collect();
    speeds_mps.sort_by(f64::total_cmp);
    let left_mps: f64 = speeds_mps.iter().take(survivors(spec)).sum();
    let alone_s = summary.loop_m / left_mps;
    if ends_s < alone_s {
        let text = format!(
            "the mission ends after {ends_s:.0} s, and those who are left after the losses of the storm may need {alone_s:.0} s for the loop"
        );
        out.push(Finding::new(Severity::Warning, "mission.for_s", text));
    }
}

/// Where the base is moved while it is flown nobody can come home to within the clearance.
fn moved_bases(spec: &Spec, geometry: &MissionGeometry, out: &mut Vec<Finding>) {
    for f in &spec.faults {
        let Fault::Rebase { east_mm, north_mm } = f.fault else {
            continue;
        };
        if let Err(why) = geometry.may_be_base(point_m((east_mm, north_mm))) {
            let text = format!("the mission that is given at {} s: {why}", f.at_ms / 1000);
            out.push(Finding::new(Severity::Error, "faults", text));
        }
    }
}

/// Who has finished waits on a circle through the base.
fn room_at_base(spec: &Spec, geometry: &MissionGeometry, out: &mut Vec<Finding>) {
    let limits = geometry.router.limits();
    let (base, radius_m) = (spec.mission.base_m(), limits.turn_radius_m);
    let room_m = (0..WAITING_HEADINGS).map(|k| {
        let (sin, cos) = math::sin_cos(f64::from(k) * math::TAU / f64::from(WAITING_HEADINGS));
        let middle = base + Vector::new(cos, sin) * radius_m;
        geometry.router.zones().distance_m(middle) - radius_m
    });
    let room_m = room_m.fold(f64::NEG_INFINITY, f64::max);
    if room_m < limits.clearance_m - 0.01 {
        let text = format!(
            "no circle of {radius_m:.1} m radius through it stays farther than {:.1} m from the no-fly zones; expected at least the clearance of {:.1} m: who has finished waits there",
            room_m.max(0.0),
            limits.clearance_m
        );
        out.push(Finding::new(Severity::Error, "base", text));
    }
}

fn launches(spec: &Spec, geometry: &MissionGeometry, out: &mut Vec<Finding>) {
    let clearance_m = spec.mission.clearance_m();
    for (i, u) in spec.uavs.iter().enumerate() {
        let d = geometry.router.zones().distance_m(u.launch.position());
        // A launch pose on the loop keeps the clearance but for the last rounding.
        if d < clearance_m - 0.01 {
            let text = format!(
                "starts {d:.1} m from a no-fly zone; expected at least the clearance of {clearance_m:.1} m"
            );
            out.push(Finding::new(
                Severity::Error,
                &format!("fleet.uavs[{i}].launch"),
                text,
            ));
        }
    }
}

/// How far over the ground a UAV flies along the loop before it must return with its
/// reserve, metres.
fn reach_m(u: &UavSpec, spec: &Spec, the_loop: &CoverageLoop) -> f64 {
    let pace = Pace::of(u, spec, the_loop);
    let kept_s = u.airframe.reserve_s + return_s(&pace, spec, the_loop);
    (u.airframe.endurance_s - kept_s).max(0.0) * pace.loop_mps
}

/// What a scenario amounts to, before it is flown.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// What is to be seen, square metres: the area, or all pieces of the targets.
    pub area_m2: f64,
    /// Cells of the area on the loop.
    pub cells: usize,
    /// Cells outside of the area that the loop passes.
    pub passed: usize,
    /// Cells on the loop that are seen by an excursion from it.
    pub excursions: usize,
    /// Cells that touch the area and cannot be seen, by reason.
    pub uncoverable: BTreeMap<String, Vec<CellId>>,
    /// Share of the area that can be seen, 0 to 1.
    pub coverable_share: f64,
    /// Length of the loop with its excursions, metres.
    pub loop_m: f64,
    /// Time to cover without any failure, by the planner's own division, seconds.
    pub makespan_s: f64,
    /// Cells that no UAV has the endurance for.
    pub unassigned_cells: Vec<u16>,
}

impl Summary {
    /// The reasons for uncoverable cells in one line, each after a mark; nothing if there are
    /// none.
    #[must_use]
    pub fn reasons(&self) -> String {
        let one =
            |(reason, cells): (&String, &Vec<CellId>)| format!("{} cells: {reason}", cells.len());
        self.uncoverable
            .iter()
            .map(one)
            .enumerate()
            .map(|(i, text)| format!("{} {text}", if i == 0 { ":" } else { ";" }))
            .collect()
    }
}

/// Adds up what a scenario amounts to.
#[must_use]
pub fn summary(spec: &Spec, geometry: &MissionGeometry) -> Summary {
    let the_loop = &geometry.coverage_loop;
    let area = spec.mission.area_m();
    // A mission for targets asks for their pieces.
    let area_m2 = match spec.mission.pieces() {
        Some(pieces) => pieces
            .iter()
            .map(|p| ring_area_m2(p).max(POINT_M2))
            .sum::<f64>(),
        None => ring_area_m2(&area),
    };
    let mut uncoverable: BTreeMap<String, Vec<CellId>> = BTreeMap::new();
    let mut lost_m2 = 0.0;
    for (cell, reason) in the_loop.uncoverable() {
        uncoverable.entry(reason.clone()).or_default().push(*cell);
        lost_m2 += match (the_loop.grid(), the_loop.patches().corners(*cell)) {
            (Some(grid), _) => overlap_m2(&area, &grid, *cell),
            (None, Some(corners)) => ring_area_m2(&corners).max(POINT_M2),
            (None, None) => 0.0,
        };
    }
    // Stations may be larger than the pieces that they hold.
    let whole_m2 = match the_loop.patches() {
        Patches::Listed(list) => list
            .corners()
            .iter()
            .map(|c| ring_area_m2(c).max(POINT_M2))
            .sum(),
        Patches::Grid(_) => area_m2,
    };
    let division = failure_free(spec, geometry);
    Summary {
        area_m2,
        cells: the_loop.cells().iter().filter(|c| c.needed).count(),
        passed: the_loop.cells().iter().filter(|c| !c.needed).count(),
        excursions: the_loop.cells().iter().filter(|c| c.excursion).count(),
        uncoverable,
        coverable_share: (1.0 - lost_m2 / whole_m2).clamp(0.0, 1.0),
        loop_m: the_loop
            .cells()
            .iter()
            .map(|c| f64::from(c.flown_mm()) / 1000.0)
            .sum(),
        makespan_s: f64::from(division.makespan_ms) / 1000.0,
        unassigned_cells: division.unassigned,
    }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "saturates, which is as good as infinite here"
)]
fn whole(x: f64) -> u32 {
    x.round() as u32
}

/// The division that the swarm would find with everybody alive and in contact, by the
/// rule of its mission.
fn failure_free(spec: &Spec, geometry: &MissionGeometry) -> Division {
    let the_loop = &geometry.coverage_loop;
    let ring = the_loop.ring(|_, c| c.needed);
    let uavs: Vec<Uav> = spec
        .uavs
        .iter()
        .map(|u| division_uav(u, spec, the_loop))
        .collect();
    geometry.divide(&ring, &uavs)
}

fn division_uav(u: &UavSpec, spec: &Spec, the_loop: &CoverageLoop) -> Uav {
    let here = u.launch.position();
    let gap_m = |i: usize| (the_loop.boundary(i).position() - here).norm();
    let anchor = (0..the_loop.len())
        .min_by(|a, b| gap_m(*a).total_cmp(&gap_m(*b)))
        .unwrap_or(0);
    let ahead = the_loop
        .boundary(anchor)
        .direction()
        .dot(&u.launch.direction())
        >= 0.0;
    let pace = Pace::of(u, spec, the_loop);
    let takeoff_s = f64::from(u.takeoff_ms) / 1000.0;
    let release_s = takeoff_s + gap_m(anchor) / pace.least_mps.max(0.0);
    let kept_s = u.airframe.reserve_s + return_s(&pace, spec, the_loop);
    let usable_s = u.airframe.endurance_s - kept_s - release_s;
    Uav {
        anchor: u16::try_from(anchor).unwrap_or(0),
        id: u.id,
        heading: if ahead {
            Direction::Forward
        } else {
            Direction::Backward
        },
        release_ms: whole(release_s * 1000.0),
        speed_mmps: whole(pace.loop_mps * 1000.0).max(1),
        turn_ms: whole(pace.turn_s * 1000.0),
        endurance_ms: whole(usable_s.max(0.0) * 1000.0),
        off_loop: Some(OffLoop::of(u.launch, u.takeoff_ms)),
    }
}

/// What a point, or a line without width, counts for, square metres.
const POINT_M2: f64 = 1e-6;

fn ring_area_m2(ring: &[Point]) -> f64 {
    let n = ring.len();
    let cross = |i: usize| {
        let (a, b) = (ring[i], ring[(i + 1) % n]);
        a.x * b.y - b.x * a.y
    };
    ((0..n).map(cross).sum::<f64>() / 2.0).abs()
}

/// Area that a cell shares with the ring: the ring clipped by the cell's four sides
/// (Sutherland-Hodgman; for concave rings its bridges have no area).
fn overlap_m2(ring: &[Point], grid: &Grid, cell: CellId) -> f64 {
    let [low, _, high, _] = grid.corners(cell);
    let sides: [(bool, f64, f64); 4] = [
        (true, low.x, 1.0),
        (true, high.x, -1.0),
        (false, low.y, 1.0),
        (false, high.y, -1.0),
    ];
    let mut ring = ring.to_vec();
    for (is_x, at, sign) in sides {
        let depth = |p: &Point| sign * (if is_x { p.x } else { p.y } - at);
        let mut out = Vec::with_capacity(ring.len() + 4);
        for i in 0..ring.len() {
            let (a, b) = (ring[i], ring[(i + 1) % ring.len()]);
            let (da, db) = (depth(&a), depth(&b));
            if da >= 0.0 {
                out.push(a);
            }
            if (da >= 0.0) != (db >= 0.0) {
                let t = da / (da - db);
                out.push(Point::new(a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)));
            }
        }
        ring = out;
    }
    if ring.len() < 3 {
        0.0
    } else {
        ring_area_m2(&ring)
    }
}

/// Width and height of the area's bounding box, metres.
#[must_use]
pub fn extent_m(spec: &Spec) -> (f64, f64) {
    match Polygon::new(spec.mission.area_m()) {
        Ok(p) => {
            let (low, high) = p.bounds();
            (high.x - low.x, high.y - low.y)
        }
        Err(_) => (0.0, 0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_geometry::frame::Pose;
    use skein_netsim::fault::TimedFault;
    use skein_peer::diagram::MissionEvent;
    use skein_peer::mission::Mission;
    use std::sync::Arc;

    #[test]
    fn cells_are_clipped_by_the_area() {
        let grid = Grid {
            lane_spacing_m: 10.0,
        };
        let p = Point::new;
        let triangle = [p(0.0, 0.0), p(20.0, 0.0), p(0.0, 20.0)];
        let cases = [
            ((0, 0), 100.0),
            ((1, 0), 50.0),
            ((1, 1), 0.0),
            ((5, 5), 0.0),
            ((-1, 0), 0.0),
        ];
        for ((col, row), want) in cases {
            let got = overlap_m2(&triangle, &grid, CellId { col, row });
            assert!((got - want).abs() < 1e-9, "{col},{row}: {got}");
        }
        let total: f64 = (0..2)
            .flat_map(|c| (0..2).map(move |r| CellId { col: c, row: r }))
            .map(|c| overlap_m2(&triangle, &grid, c))
            .sum();
        assert!((total - ring_area_m2(&triangle)).abs() < 1e-9);
    }

    /// Breaks the fixture and returns errors (or worse findings) as lines.
    fn told(n: u16, change: impl FnOnce(&mut Spec)) -> Vec<String> {
        let mut spec = skein_netsim::world::fixture::square(n);
        change(&mut spec);
        feasibility(&spec).iter().map(ToString::to_string).collect()
    }

    fn at(at_ms: u64, fault: Fault) -> TimedFault {
        TimedFault { at_ms, fault }
    }

    /// What is done to the fixture, and what must be said.
    type Case = (fn(&mut Spec), &'static str);

    #[test]
    fn what_cannot_succeed_is_an_error() {
        let cases: [Case; 12] = [
            (|s| s.uavs.clear(), "error: fleet: there is no UAV"),
            (
                |s| {
                    s.uavs = (1..=257)
                        .map(|id| UavSpec {
                            id,
                            ..s.uavs[0].clone()
                        })
                        .collect()
                },
                "error: fleet: 257 UAVs are too many",
            ),
            (
                |s| s.uavs[1].id = 1,
                "error: fleet.uavs[1].id: the number 1 is taken twice",
            ),
            (
                |s| s.uavs[0].id = 100,
                "error: fleet.uavs[3].id: the number 100 is taken twice",
            ),
            (
                |s| s.uavs[2].airframe.endurance_s = 0.0,
                "error: fleet.uavs[2].airframe: UAV 3 has no endurance",
            ),
            (
                |s| s.ground = None,
                "warning: ground: there is no ground station",
            ),
            (
                |s| s.max_time_s = 5,
                "error: max_time_s: covering takes about",
            ),
            (
                |s| s.uavs[0].launch = Pose::new(Point::new(240.0, 240.0), 0.0),
                "error: fleet.uavs[0].launch: starts 0.0 m from a no-fly zone",
            ),
            (
                |s| {
                    s.uavs
                        .iter_mut()
                        .for_each(|u| u.airframe.endurance_s = 70.0)
                },
                "error: airframes: all UAVs together fly",
            ),
            (
                |s| {
                    s.faults = vec![at(
                        1,
                        Fault::Partition {
                            groups: vec![vec![1], vec![9]],
                        },
                    )]
                },
                "error: faults: the fault at 0 s names a peer 9 that is not there",
            ),
            (
                |s| s.faults = vec![at(10_000_000, Fault::Heal)],
                "error: faults: the fault at 10000 s is after the end",
            ),
            (
                |s| s.faults = (1..=3).map(|peer| at(1, Fault::Kill { peer })).collect(),
                "error: faults: in the end no UAV is left",
            ),
        ];
        for (change, want) in cases {
            let all = told(3, change);
            assert!(
                all.iter().any(|f| f.starts_with(want)),
                "expected {want}, found {all:#?}"
            );
        }
    }

    #[test]
    fn what_may_disappoint_is_a_warning() {
        let all = told(3, |s| {
            s.faults = vec![at(
                1,
                Fault::Restart {
                    peer: 2,
                    fresh_disk: false,
                },
            )]
        });
        assert!(
            all.iter()
                .any(|f| f.starts_with("warning: faults: peer 2 is neither down")),
            "{all:?}"
        );
        let short = |s: &mut Spec| {
            s.uavs
                .iter_mut()
                .for_each(|u| u.airframe.endurance_s = 500.0)
        };
        let all = told(3, short);
        assert!(
            all.iter()
                .any(|f| f.starts_with("warning: airframes: the weakest UAV")),
            "{all:?}"
        );
    }

    #[test]
    fn a_mission_that_ends_by_time_has_the_time_and_somebody_who_flies_as_long() {
        let of = |ends_s: u32| {
            told(3, |s| {
                let mut diagram = crate::diagram::builtin("patrol").unwrap();
                let timers = diagram.transitions.iter_mut();
                timers
                    .filter(|t| t.on == MissionEvent::Timer)
                    .for_each(|t| t.after_s = ends_s);
                s.mission = Arc::new(Mission {
                    diagram: Some(Arc::new(diagram)),
                    ..(*s.mission).clone()
                });
                s.storm.max_kills = 2;
            })
        };
        let says = |ends_s: u32, want: &str| {
            let all = of(ends_s);
            let of_time = |f: &&String| f.contains("mission.for_s");
            let found: Vec<&String> = all.iter().filter(of_time).collect();
            match want {
                "" => assert!(found.is_empty(), "{ends_s}: {found:?}"),
                _ => assert!(
                    found.iter().any(|f| f.starts_with(want)),
                    "{ends_s}: {all:#?}"
                ),
            }
        };
        says(
            20,
            "error: mission.for_s: the mission ends after 20 s, and covering takes",
        );
        says(
            120,
            "warning: mission.for_s: the mission ends after 120 s, and those who are left",
        );
        says(600, "");
        says(
            80_000,
            "error: mission.for_s: the mission ends after 80000 s, and no UAV flies longer",
        );
    }

    #[test]
    fn a_base_without_room_to_wait_is_an_error() {
        let at = |east_m: i32, north_m: i32| {
            let all = told(3, |s| {
                let mut mission = (*s.mission).clone();
                mission.base = (east_m * 1000, north_m * 1000);
                s.mission = std::sync::Arc::new(mission);
            });
            let text = "error: base: no circle of ";
            all.into_iter().find(|f| f.starts_with(text))
        };
        // In the zone of the fixture, within its clearance, and well away.
        assert!(at(240, 240).is_some_and(|f| f.contains("stays farther than 0.0 m")));
        assert!(at(240, 258).is_some());
        assert_eq!(at(-40, -40), None);
    }

    #[test]
    fn lanes_that_are_too_narrow_are_blamed() {
        let all = told(3, |s| {
            let mut mission = (*s.mission).clone();
            mission.lane_spacing_mm = 40_000;
            s.mission = std::sync::Arc::new(mission);
        });
        assert!(
            all.iter()
                .any(|f| f.starts_with("error: lanes.spacing_m: a turn radius of 23.0 m")),
            "{all:?}"
        );
    }
}
