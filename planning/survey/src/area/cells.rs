//! The approximate planner of an area for a team: the area as lane cells, a region of
//! cells for each UAV (D2.7 §3.6.2, 3.6.4–3.6.6).
//!
//! Leaves to others: the cells' planner ([`crate::regions`]), and straight passes.

use super::PlannerError;
use crate::detours::{DetourSearch, Detours};
use crate::flight::length_m;
use crate::regions::improve::Improver;
use crate::regions::raster::Raster;
use crate::regions::{Cell, Task, TaskError, bounds};
use crate::team::PlannedUav;
use skein_geometry::Polygon;
use skein_geometry::frame::Point;

/// Speeds are counted in whole hundredths of a metre a second.
const SPEED_UNITS: f64 = 100.0;

/// Corners with less than this sine of their angle are none: rounding.
const STRAIGHT: f64 = 1e-9;

/// What is asked for.
pub(crate) struct CellProblem<'a> {
    /// The area.
    pub area: &'a Polygon,
    /// Parts of it that need not be seen.
    pub holes: &'a [Polygon],
    /// Zones with clearance.
    pub detours: &'a Detours,
    /// The team.
    pub team: &'a [PlannedUav],
    /// Width of a lane: of the narrowest swath, metres.
    pub lane_m: f64,
    /// Steps of improvement.
    pub steps: usize,
}

/// A plan of cells.
pub(crate) struct CellFlights {
    /// The grid.
    pub raster: Raster,
    /// By UAV: corners of its flight, from its start and back to it.
    pub tracks: Vec<Vec<Point>>,
    /// By UAV: the corners of its flight over cells alone.
    pub laps: Vec<Vec<Point>>,
    /// By UAV: length of its flight, metres.
    pub lengths_m: Vec<f64>,
    /// By cell number: whether somebody covers it.
    covered: Vec<bool>,
    /// Middles of the cells that nobody has the endurance or the way to cover.
    pub left: Vec<Point>,
    /// No plan of these cells is done sooner than this, seconds; for equal UAVs only.
    pub least_s: Option<f64>,
}

impl CellFlights {
    /// Whether a point of the area is seen.
    pub(crate) fn sees(&self, p: Point) -> bool {
        let cell = self.raster.cell_at(p);
        cell.is_some_and(|c| self.covered[c as usize])
    }
}

/// Plans.
///
/// # Errors
/// When the area has no cell that can be flown, or a UAV has no way to it.
pub(crate) fn plan(request: &CellProblem<'_>) -> Result<CellFlights, PlannerError> {
    let rings = request.detours.rings();
    let area = std::slice::from_ref(request.area);
    let raster = Raster::fit(area, request.holes, &rings, request.lane_m)?;
    let mut search = request.detours.search();
    let mut roots = Vec::new();
    let mut ways = Vec::new();
    for uav in request.team {
        let root = raster.nearest(uav.start).ok_or(PlannerError::NoCell)?;
        let way = search
            .way(uav.start, raster.middle(root))
            .ok_or_else(|| PlannerError::NoWay(uav.name.clone()))?;
        roots.push(root);
        ways.push(way);
    }
    let task = task(request, &raster, &roots, &ways)?;
    let mut improver = Improver::new(&task, request.steps);
    while improver.round() {}
    let plan = improver.plan();
    let middles =
        |cells: &[Cell]| -> Vec<Point> { cells.iter().map(|c| raster.middle(*c)).collect() };
    let tracks: Vec<Vec<Point>> = plan
        .paths
        .iter()
        .zip(&ways)
        .map(|(path, way)| track(&middles(path), way, &mut search))
        .collect();
    let laps = plan.paths.iter().map(|path| corners(middles(path)));
    let laps = laps.collect();
    let mut covered = vec![false; raster.map.table_len()];
    // A UAV that stays at home does not see the cell where it would begin.
    for cell in plan.paths.iter().filter(|p| p.len() > 1).flatten() {
        covered[*cell as usize] = true;
    }
    let left: Vec<Cell> = raster
        .map
        .cells()
        .filter(|c| !covered[*c as usize])
        .collect();
    let first = &request.team[0];
    let equal = request.team.iter().all(|m| {
        (m.speed_mps - first.speed_mps).abs() < 1e-9 && (m.pace - first.pace).abs() < 1e-9
    });
    let least_m = f64::from(bounds::least_moves(&task)) * raster.side_m();
    Ok(CellFlights {
        lengths_m: tracks.iter().map(|t| length_m(t)).collect(),
        tracks,
        laps,
        left: middles(&left),
        covered,
        least_s: equal.then(|| least_m / first.speed_mps),
        raster,
    })
}

/// The task in cells: speeds, and what endurance leaves for the cells.
fn task(
    request: &CellProblem<'_>,
    raster: &Raster,
    roots: &[Cell],
    ways: &[Vec<Point>],
) -> Result<Task, TaskError> {
    let mut task = Task::new(&raster.map, roots, true)?;
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a cast of a float saturates"
    )]
    let whole = |x: f64| x.max(0.0) as u32;
    for (i, uav) in request.team.iter().enumerate() {
        task.speeds[i] = whole((uav.speed_mps * uav.pace * SPEED_UNITS).round()).max(1);
        if uav.endurance_s.is_finite() {
            let left_m = uav.endurance_s * uav.speed_mps - 2.0 * length_m(&ways[i]);
            task.endurance[i] = whole((left_m / raster.side_m()).floor());
        }
    }
    Ok(task)
}

/// The corners of a flight; a UAV without cells stays where it is.
fn track(path: &[Point], way: &[Point], search: &mut DetourSearch<'_>) -> Vec<Point> {
    let (Some(start), Some(last)) = (way.first(), path.last()) else {
        return Vec::new();
    };
    if path.len() < 2 {
        return vec![*start];
    }
    let mut track = way.to_vec();
    track.extend(path.iter().skip(1));
    let home = search.way(*last, *start).unwrap_or_default();
    track.extend(home.iter().skip(1));
    corners(track)
}

/// Leaves out what lies straight between its neighbours.
fn corners(track: Vec<Point>) -> Vec<Point> {
    let mut kept: Vec<Point> = Vec::new();
    for p in track {
        while let [.., a, b] = kept[..] {
            let (u, v) = (b - a, p - b);
            let straight = u.perp(&v).abs() <= STRAIGHT * u.norm() * v.norm() && u.dot(&v) >= 0.0;
            if !straight {
                break;
            }
            kept.pop();
        }
        kept.push(p);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(half_m: f64) -> Polygon {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let at = |(x, y): (f64, f64)| Point::new(x * half_m, y * half_m);
        Polygon::new(corners.map(at).to_vec()).unwrap()
    }

    fn team(speeds: &[f64], endurance_s: f64, start: Point) -> Vec<PlannedUav> {
        let flyer = |(uav, v): (usize, &f64)| PlannedUav {
            uav,
            name: String::new(),
            start,
            speed_mps: *v,
            endurance_s,
            swath_m: 30.0,
            turn_radius_m: 15.0,
            cruise_power_w: None,
            pace: 1.0,
        };
        speeds.iter().enumerate().map(flyer).collect()
    }

    fn planned(team: &[PlannedUav]) -> CellFlights {
        let detours = Detours::new(&[], 0.0, &[]).unwrap();
        plan(&CellProblem {
            area: &square(300.0),
            holes: &[],
            detours: &detours,
            team,
            lane_m: 30.0,
            steps: 60_000,
        })
        .unwrap()
    }

    #[test]
    fn a_faster_uav_flies_more_and_all_is_seen() {
        let start = Point::new(-400.0, -300.0);
        let flights = planned(&team(&[10.0, 20.0], f64::INFINITY, start));
        assert!(flights.left.is_empty() && flights.least_s.is_none());
        assert!(flights.sees(Point::new(299.0, -299.0)) && !flights.sees(Point::new(330.0, 0.0)));
        let ratio = flights.lengths_m[1] / flights.lengths_m[0];
        assert!((1.6..2.4).contains(&ratio), "{ratio}");
        for track in &flights.tracks {
            assert!((track[0] - start).norm() < 1e-9);
            assert!((track[track.len() - 1] - start).norm() < 1e-9);
        }
        let all: f64 = flights.lengths_m.iter().sum();
        assert!(all < 1.15 * 600.0 * 600.0 / 30.0 + 4.0 * 400.0, "{all}");
    }

    #[test]
    fn a_short_endurance_is_kept_and_the_rest_is_listed() {
        let flights = planned(&team(&[15.0, 15.0], 300.0, Point::new(0.0, 0.0)));
        assert!(flights.lengths_m.iter().all(|l| *l <= 4500.0 + 1e-6));
        // 9 km of lanes of the 12 km that there are.
        assert!(
            (80..=140).contains(&flights.left.len()),
            "{}",
            flights.left.len()
        );
        assert!(!flights.sees(flights.left[0]));
    }
}
