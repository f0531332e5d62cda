//! The flight that does one task: past a place, along a line or over an area, so that all that the
//! task asks for is seen (D2.7 §3.2, §3.4, §3.5).
//!
//! Stations of a loop are seen from poses that are proved clear; a task is a few of them. A
//! place is passed on the heading that costs its UAV least, a line is flown from the end from
//! which it is done sooner, and so are the passes over an area. The way there and back is the executive's.
//!
//! # Guarantees
//! The flight keeps the clearance of the mission, and from it the camera holds every piece.
//!
//! # Complexity
//! For a place some Dubins curves and at most `ROUTED` routes; for a line or an area that of a
//! loop of its pieces.

use crate::mission::{Mission, point_m};
use crate::offload::MissionGeometry;
use crate::relay_circle::{self, Eye};
use crate::wire::limits::DURATION_MAX_MS;
use crate::wire::tasks::{Task, TaskKind};
use skein_behaviors::executive::GivenFlight;
use skein_behaviors::executive::circle::halves;
use skein_flight::coverage::passes::{self, PassesProblem};
use skein_flight::coverage::ring::LoopProblem;
use skein_flight::coverage::ring::patch::Corners;
use skein_flight::coverage::stations::targets::{LineTarget, PointTarget, Targets};
use skein_flight::coverage::stations::{StationsProblem, build, pass_through, views};
use skein_flight::trajectory::dubins::length_m;
use skein_geometry::frame::Pose;
use skein_geometry::{Curve, NoFlyZones, Polygon, Segment};
use std::sync::Arc;

/// Of the headings past a place, so many of the nearest are asked of the router.
const ROUTED: usize = 4;

/// An area that takes more pieces is several tasks: of so many lanes of four a UAV comes back to
/// its section within some minutes, and nobody else waits for it meanwhile.
pub const AREA_PIECES_MAX: usize = 64;

/// The time of an area is reckoned at this speed, that of a slow UAV, m/s: who asks for it need
/// not know who will fly.
const AREA_MPS: f64 = 10.0;

/// What is flown before the first and after the last pose from which a line is seen, metres.
const RUN_M: f64 = 5.0;

/// A flight that does a task.
#[derive(Clone, Debug)]
pub struct Errand {
    /// What has to be seen, each piece by one frame.
    pub pieces: Arc<[Corners]>,
    /// From where it is seen.
    pub flight: GivenFlight,
}

/// What was planned for a task.
#[derive(Clone, Debug)]
pub enum Planned {
    /// A flight from which all of it is seen.
    Flight(Errand),
    /// A circle to be held.
    Circle(Segment),
}

impl Planned {
    /// What is flown of it before the way home can be begun.
    #[must_use]
    pub fn flown(&self) -> Curve {
        match self {
            Self::Flight(errand) => errand.flight.curve.clone(),
            Self::Circle(circle) => halves(circle),
        }
    }
}

/// Who asks for such a flight, and for what.
#[derive(Clone, Debug)]
pub struct Request {
    /// The mission that is flown meanwhile.
    pub geometry: Arc<MissionGeometry>,
    /// What is to be done.
    pub task: Task,
    /// From where, and where it comes back to.
    pub from: Pose,
    /// How fast, m/s.
    pub airspeed_mps: f64,
    /// Of a circle above a place, by which camera it is watched.
    pub eye: Option<Eye>,
}

/// What a task asks to see, of a place or a line; none for other kinds.
fn targets(task: &Task) -> Option<Targets> {
    let places = task.places.iter();
    let mut places = places.map(|p| point_m((p.east_mm, p.north_mm)));
    let radius_m = f64::from(task.radius_mm) / 1000.0;
    match task.kind {
        TaskKind::Pinpoint => {
            let at = places.next()?;
            Some(Targets::Points(vec![PointTarget { at, radius_m }]))
        }
        TaskKind::Line => Some(Targets::Lines(vec![LineTarget {
            way: places.collect(),
            width_m: 2.0 * radius_m,
        }])),
        TaskKind::Area | TaskKind::Track | TaskKind::Relay => None,
    }
}

impl Mission {
    /// The pieces that a task asks to see, as a judge cuts them; none for kinds of which nothing
    /// is to be seen.
    #[must_use]
    pub fn pieces_of(&self, task: &Task) -> Option<Vec<Corners>> {
        if task.kind == TaskKind::Area {
            let problem = self.loop_problem(&Arc::new(NoFlyZones::new(Vec::new())));
            return Some(stations_of(&problem.ok()?, task).ok()?.stations);
        }
        Some(targets(task)?.pieces(self.lane_m()))
    }

    /// How long the flight over an area takes, from its first piece to its last, milliseconds; 0
    /// of other tasks.
    ///
    /// # Errors
    /// A sentence that says why there is none.
    pub fn area_ms(self: &Arc<Self>, task: &Task) -> Result<u32, String> {
        if task.kind != TaskKind::Area {
            return Ok(0);
        }
        let zones = self.no_fly_zones().map_err(|e| e.to_string())?;
        let problem = self.loop_problem(&zones).map_err(|e| e.to_string())?;
        let (curves, _) = planned(&problem, task)?;
        let longest_m = curves.iter().map(Curve::length_m).fold(0.0, f64::max);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a cast of a float saturates"
        )]
        let takes_ms = (longest_m / AREA_MPS * 1000.0).ceil() as u32;
        Ok(takes_ms.min(DURATION_MAX_MS))
    }

    /// Whether a task could be done by anybody in this mission.
    ///
    /// # Errors
    /// A sentence that says why not.
    pub fn can_do(self: &Arc<Self>, task: &Task) -> Result<(), String> {
        if self.separation_mm > 0 {
            return Err("no tasks are flown where UAVs are kept apart by agreement".to_owned());
        }
        let zones = self.no_fly_zones().map_err(|e| e.to_string())?;
        if task.is_held() {
            return self.relay_circle(task, &zones).map(drop);
        }
        let problem = self.loop_problem(&zones).map_err(|e| e.to_string())?;
        planned(&problem, task).map(drop)
    }
}

/// The pieces of a task in the order in which they are flown. Those of an area follow from its
/// corners alone, whatever zones there are: who plans and who judges cut the same way.
fn stations_of<'a>(problem: &'a LoopProblem, task: &Task) -> Result<StationsProblem<'a>, String> {
    if task.kind != TaskKind::Area {
        let targets = targets(task).ok_or_else(|| {
            format!(
                "no mission flies tasks of the kind {:?} yet; expected a point, a line, an area or a relay position",
                task.kind
            )
        })?;
        return Ok(StationsProblem::of_targets(problem, &targets));
    }
    let corners = task.places.iter();
    let corners = corners.map(|p| point_m((p.east_mm, p.north_mm))).collect();
    let area = Polygon::new(corners).map_err(|e| format!("it is no area: {e}"))?;
    let lane_m = problem.lane_spacing_m;
    let most_m2 = AREA_PIECES_MAX as f64 * lane_m * lane_m;
    let too_large = |pieces: usize| {
        format!(
            "the area takes {pieces} pieces of {lane_m:.0} m by {lane_m:.0} m, more than the {AREA_PIECES_MAX} of one task; expected several areas, each smaller than {most_m2:.0} m²"
        )
    };
    // What is beyond doubt too large is not planned.
    if area.area_m2() > most_m2 {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a cast of a float saturates"
        )]
        let pieces = (area.area_m2() / lane_m / lane_m).ceil() as usize;
        return Err(too_large(pieces));
    }
    let passes = passes::plan(&PassesProblem {
        // What the camera sees beyond the ends of a pass is left for the turns.
        look_ahead_m: 0.0,
        ..PassesProblem::new(area, lane_m, problem.turn_radius_m, problem.launch)
    });
    let passes = passes.map_err(|e| format!("the area cannot be cut into passes: {e}"))?;
    let stations = StationsProblem::of_passes(problem, &passes.passes);
    match stations.stations.len() {
        pieces if pieces > AREA_PIECES_MAX => Err(too_large(pieces)),
        _ => Ok(stations),
    }
}

/// The curves that do a task, either of which will do, and what is seen from them.
fn planned(problem: &LoopProblem, task: &Task) -> Result<(Vec<Curve>, Vec<Corners>), String> {
    let stations = stations_of(problem, task)?;
    let pieces = stations.stations.clone();
    let what = if task.kind == TaskKind::Area {
        "area"
    } else {
        "line"
    };
    for n in 0..pieces.len() {
        views(&stations, n).map_err(|why| match pieces.len() {
            1 => format!("it cannot be seen: {why}"),
            all => format!(
                "piece {} of {all} of the {what} cannot be seen: {why}",
                n + 1
            ),
        })?;
    }
    if let [_] = pieces[..] {
        let poses = views(&stations, 0)?;
        return Ok((poses.into_iter().map(pass_through).collect(), pieces));
    }
    let along = along(&stations, what)?;
    Ok((vec![along.reversed(), along], pieces))
}

/// The loop of a line or an area, cut open where it is longest between two of its pieces.
fn along(stations: &StationsProblem<'_>, what: &str) -> Result<Curve, String> {
    let closed = build(stations).map_err(|e| format!("the {what} cannot be flown: {e}"))?;
    if let Some((_, why)) = closed.uncoverable().first() {
        return Err(format!("a piece of the {what} cannot be flown: {why}"));
    }
    let cells = closed.cells();
    let n = cells.len();
    let onward_m = |i: usize| {
        let (cell, next) = (&cells[i], &cells[(i + 1) % n]);
        cell.curve.length_m() - cell.view_m + next.view_m
    };
    let longest = (0..n).max_by(|a, b| onward_m(*a).total_cmp(&onward_m(*b)));
    let Some(last) = longest.filter(|_| n > 1) else {
        return Err(format!("the {what} has no length"));
    };
    let mut curve = Curve::empty();
    for k in 1..=n {
        let cell = &cells[(last + k) % n];
        let run_m = RUN_M
            .min(cell.view_m)
            .min(cell.curve.length_m() - cell.view_m);
        let (from_m, to_m) = (cell.view_m - run_m, cell.view_m + run_m);
        let piece = match k {
            1 => cell.curve.split_at(from_m).1,
            _ if k == n => cell.curve.split_at(to_m).0,
            _ => cell.curve.clone(),
        };
        curve.extend(&piece);
    }
    Ok(curve)
}

impl Request {
    /// Plans the flight, or the circle.
    ///
    /// # Errors
    /// A sentence that says why there is none.
    pub fn plan(&self) -> Result<Planned, String> {
        if self.task.is_held() {
            let (mission, router) = (&self.geometry.mission, &self.geometry.router);
            let circle =
                relay_circle::planned(mission, router, (&self.task, self.eye.as_ref()), self.from)?;
            return Ok(Planned::Circle(circle));
        }
        self.flight().map(Planned::Flight)
    }

    fn flight(&self) -> Result<Errand, String> {
        let zones = self.geometry.router.zones();
        let mission = &self.geometry.mission;
        let problem = mission.loop_problem(zones).map_err(|e| e.to_string())?;
        let (curves, pieces) = planned(&problem, &self.task)?;
        let curve = self.cheapest(curves);
        let curve = curve.ok_or("no way leads to it that keeps clear of the no-fly zones")?;
        Ok(Errand {
            pieces: pieces.into(),
            flight: GivenFlight {
                curve,
                airspeed_mps: self.airspeed_mps,
                lands: false,
            },
        })
    }

    /// Of some curves that with the shortest way there, along it and back to where the UAV is.
    fn cheapest(&self, curves: Vec<Curve>) -> Option<Curve> {
        let radius_m = self.geometry.mission.turn_radius_m();
        let guess = |c: Curve| {
            let (start, end) = c.start().zip(c.end())?;
            let way_m = length_m(self.from, start, radius_m);
            Some((way_m + length_m(end, self.from, radius_m), c))
        };
        let mut all: Vec<(f64, Curve)> = curves.into_iter().filter_map(guess).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let routed = |(_, c): (f64, Curve)| {
            let (start, end) = c.start().zip(c.end())?;
            let there = self.geometry.router.route(self.from, start).ok()?;
            let back = self.geometry.router.route(end, self.from).ok();
            // Who begins in a corner need not come back to it.
            let back_m = back.map_or_else(|| length_m(end, self.from, radius_m), |b| b.length_m());
            Some((there.length_m() + back_m, c))
        };
        // Where none of the nearest can be reached, one of the others may.
        let found = all.into_iter().filter_map(routed).take(ROUTED);
        let best = found.min_by(|a, b| a.0.total_cmp(&b.0));
        best.map(|(_, c)| c)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::mission;
    use crate::wire::tasks::TaskPlace;
    use skein_flight::coverage::ring::patch::frame_holds;
    use skein_geometry::frame::Point;

    fn task(kind: TaskKind, places: &[(i32, i32)], radius_m: u32) -> Task {
        let place = |(east_m, north_m): &(i32, i32)| TaskPlace {
            east_mm: east_m * 1000,
            north_mm: north_m * 1000,
        };
        Task {
            revision: 1,
            kind,
            places: places.iter().map(place).collect(),
            radius_mm: radius_m * 1000,
            worth: 100,
            ..Task::default()
        }
    }

    fn zoned() -> Arc<Mission> {
        let mut m = mission(1, 8, 6);
        m.zones = vec![vec![
            (200_000, 100_000),
            (260_000, 100_000),
            (260_000, 160_000),
            (200_000, 160_000),
        ]];
        Arc::new(m)
    }

    /// From outside of its zone nobody sees its middle.
    fn widely_zoned() -> Arc<Mission> {
        let mut m = (*zoned()).clone();
        m.zones = vec![vec![
            (150_000, 60_000),
            (310_000, 60_000),
            (310_000, 200_000),
            (150_000, 200_000),
        ]];
        Arc::new(m)
    }

    fn errand(task: &Task, from: Pose) -> Result<Errand, String> {
        errand_in(&zoned(), task, from)
    }

    fn errand_in(mission: &Arc<Mission>, task: &Task, from: Pose) -> Result<Errand, String> {
        let geometry = mission.geometry().unwrap();
        let request = Request {
            geometry,
            task: task.clone(),
            from,
            airspeed_mps: 13.0,
            eye: None,
        };
        request.flight()
    }

    /// Which pieces some pose of a flight holds, looked at every metre.
    fn seen(errand: &Errand) -> Vec<bool> {
        let curve = &errand.flight.curve;
        let holds = |corners: &Corners| {
            (0..=curve.length_m() as u32).any(|m| {
                let pose = curve.pose_at(f64::from(m)).unwrap();
                frame_holds(corners, pose, 45.0, 35.0)
            })
        };
        errand.pieces.iter().map(holds).collect()
    }

    #[test]
    fn places_and_lines_are_seen_whole_and_clear_of_the_zones() {
        let from = Pose::new(Point::new(20.0, 20.0), 0.0);
        let zones = zoned().no_fly_zones().unwrap();
        for (kind, places, radius_m) in [
            (TaskKind::Pinpoint, vec![(100, 100)], 15),
            (TaskKind::Pinpoint, vec![(900, -300)], 0),
            // Beside the zone, nearer than the clearance.
            (TaskKind::Pinpoint, vec![(195, 130)], 5),
            // In the middle of it: what burns there is seen from outside.
            (TaskKind::Pinpoint, vec![(230, 130)], 5),
            (TaskKind::Line, vec![(20, 250), (330, 250)], 5),
            (
                TaskKind::Line,
                vec![(20, 40), (180, 60), (330, 70), (330, 250)],
                0,
            ),
        ] {
            let task = task(kind, &places, radius_m);
            let errand = errand(&task, from).unwrap();
            assert!(!errand.pieces.is_empty());
            assert!(!seen(&errand).contains(&false), "{places:?}");
            assert!(zones.is_clear(&errand.flight.curve, 7.99), "{places:?}");
            assert!(errand.flight.curve.max_curvature_per_m() < 1.0 / 23.4);
            assert!(errand.flight.curve.largest_gap_m() < 1e-6);
            zoned().can_do(&task).unwrap();
        }
    }

    /// A mission whose camera holds a square of a lane.
    fn wide() -> Arc<Mission> {
        let mut m = (*zoned()).clone();
        (m.footprint_across_mm, m.footprint_along_mm) = (110_000, 90_000);
        Arc::new(m)
    }

    #[test]
    fn an_area_is_seen_whole_in_one_flight_and_judged_by_the_same_pieces() {
        let mission = wide();
        let zones = mission.no_fly_zones().unwrap();
        let request = |places: &[(i32, i32)]| Request {
            geometry: mission.geometry().unwrap(),
            task: task(TaskKind::Area, places, 0),
            from: Pose::new(Point::new(20.0, 20.0), 0.0),
            airspeed_mps: 13.0,
            eye: None,
        };
        for places in [
            vec![(20, 180), (140, 180), (140, 280), (20, 280)],
            vec![(-200, -200), (-60, -180), (-120, -60)],
        ] {
            let request = request(&places);
            let errand = request.flight().unwrap();
            assert!(errand.pieces.len() > 3);
            let holds = |corners: &Corners| {
                let curve = &errand.flight.curve;
                (0..=curve.length_m() as u32).any(|m| {
                    let pose = curve.pose_at(f64::from(m)).unwrap();
                    frame_holds(corners, pose, 110.0, 90.0)
                })
            };
            assert!(errand.pieces.iter().all(holds), "{places:?}");
            assert!(zones.is_clear(&errand.flight.curve, 7.99), "{places:?}");
            assert!(errand.flight.curve.largest_gap_m() < 1e-6);
            let judged = mission.pieces_of(&request.task).unwrap();
            assert_eq!(judged.len(), errand.pieces.len());
            // What lies within the corners lies in a piece.
            let ring = places
                .iter()
                .map(|(x, y)| Point::new(f64::from(*x), f64::from(*y)));
            let area = Polygon::new(ring.collect()).unwrap();
            let is_in = |p: Point, c: &Corners, slack_m: f64| {
                let left = |a: Point, b: Point| (b - a).perp(&(p - a));
                let sides = (0..4).map(|i| left(c[i], c[(i + 1) % 4]));
                let (low, high) = sides.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
                    (l.min(v), h.max(v))
                });
                low >= -slack_m * 48.0 || high <= slack_m * 48.0
            };
            let (mut inside, mut held) = (0, 0);
            for k in 0..10_000 {
                let (x, y) = (f64::from(k % 100), f64::from(k / 100));
                let p = Point::new(4.0 * x - 220.0, 5.0 * y - 220.0);
                if area.distance_m(p) > 0.0 {
                    continue;
                }
                inside += 1;
                held += u32::from(judged.iter().any(|c| is_in(p, c, 0.0)));
                // At its corners a metre or two is left out.
                assert!(judged.iter().any(|c| is_in(p, c, 3.0)), "{p:?}");
            }
            assert!(held * 100 >= inside * 99, "{held} of {inside}");
            let takes_ms = mission.area_ms(&request.task).unwrap();
            assert!(takes_ms > 10_000, "{takes_ms}");
        }
    }

    #[test]
    fn an_area_that_is_none_too_large_or_in_a_zone_is_refused() {
        let mut mission = (*wide()).clone();
        mission.zones = vec![vec![
            (100_000, -20_000),
            (460_000, -20_000),
            (460_000, 340_000),
            (100_000, 340_000),
        ]];
        let mission = Arc::new(mission);
        for (places, why) in [
            (vec![(0, 0), (90, 90), (90, 0), (0, 80)], "it is no area"),
            (
                vec![(0, 0), (900, 0), (900, 900)],
                "expected several areas, each smaller",
            ),
            (
                vec![(250, 130), (310, 130), (310, 190), (250, 190)],
                "cannot be seen",
            ),
        ] {
            let task = task(TaskKind::Area, &places, 0);
            let said = mission.can_do(&task).err().unwrap_or_default();
            assert!(said.contains(why), "{places:?}: {said:?}");
        }
    }

    #[test]
    fn a_line_is_begun_at_the_end_from_which_it_is_done_sooner() {
        let line = task(TaskKind::Line, &[(20, 250), (330, 250)], 0);
        for (x, begins_near) in [(-100.0, 20.0), (450.0, 330.0)] {
            let facing = if x < 0.0 { 0.0 } else { core::f64::consts::PI };
            let errand = errand(&line, Pose::new(Point::new(x, 250.0), facing)).unwrap();
            let start = errand.flight.curve.start().unwrap();
            assert!((start.east_m - begins_near).abs() < 40.0, "{start:?}");
        }
    }

    #[test]
    fn what_cannot_be_seen_is_refused_with_the_reason() {
        let from = Pose::new(Point::new(20.0, 20.0), 0.0);
        let deep = task(TaskKind::Pinpoint, &[(230, 130)], 5);
        let from_afar = Pose::new(Point::new(20.0, -120.0), 0.0);
        let said = errand_in(&widely_zoned(), &deep, from_afar).unwrap_err();
        assert!(said.contains("inside a no-fly zone"), "{said}");
        assert!(widely_zoned().can_do(&deep).is_err());
        for (task, why) in [
            (
                task(TaskKind::Pinpoint, &[(100, 100)], 60),
                "larger than what one frame of the camera holds",
            ),
            (task(TaskKind::Pinpoint, &[(90_000, 0)], 0), ""),
        ] {
            let said = errand(&task, from).unwrap_err();
            assert!(said.contains(why), "{said}");
            assert!(zoned().can_do(&task).is_err());
        }
        let line = task(TaskKind::Line, &[(150, 130), (310, 130)], 0);
        let said = errand_in(&widely_zoned(), &line, from_afar).unwrap_err();
        assert!(said.contains("of the line cannot be seen"), "{said}");
    }
}
