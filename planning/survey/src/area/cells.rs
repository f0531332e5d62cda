//! The approximate planner of an area for a team: the area as lane cells, a region of
//! cells for each UAV (D2.7 §3.6.2, 3.6.4–3.6.6).
//!
//! Leaves to others: the cells' planner ([`crate::regions`]), and straight passes.

use super::PlannerError;
use crate::detours::Detours;
use crate::flight::length_m;
use crate::regions::improve::Improver;
use crate::regions::raster::Raster;
use crate::regions::{Cell, Task, TaskError, bounds};
use crate::team::PlannedUav;
use skein_flight::coverage::passes::Pass;
use skein_geometry::Polygon;
use skein_geometry::frame::Point;
use std::collections::BTreeSet;

/// Speeds are counted in whole hundredths of a metre a second.
const SPEED_UNITS: f64 = 100.0;

/// A pass over a single cell, metres.
const SHORT_M: f64 = 2.0;

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
    /// By UAV: the straight passes that see its cells, in order.
    pub passes: Vec<Vec<Pass>>,
    /// By UAV: the corners of its path over cells alone.
    pub laps: Vec<Vec<Point>>,
    /// Middles of the cells that nobody has the endurance or the way to cover.
    pub left: Vec<Point>,
    /// No plan of these cells is done sooner than this, seconds; for equal UAVs only.
    pub least_s: Option<f64>,
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
    let passes = plan.paths.iter();
    let passes = passes.map(|path| passes_over(path, |c| raster.middle(c)));
    let passes = passes.collect();
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
        passes,
        laps,
        left: middles(&left),
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

/// The straight passes that see all cells of a path, in its order; none where it has but
/// the cell where it would begin.
///
/// Each cell is seen once, by the longest straight part of the path that leads over it: what
/// is left of the others is flown if anything is.
fn passes_over(path: &[Cell], middle: impl Fn(Cell) -> Point) -> Vec<Pass> {
    let at: Vec<Point> = path.iter().map(|c| middle(*c)).collect();
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for i in 1..path.len() {
        let goes_on = i > 1 && {
            let (u, v) = (at[i - 1] - at[i - 2], at[i] - at[i - 1]);
            u.perp(&v).abs() <= STRAIGHT * u.norm() * v.norm() && u.dot(&v) > 0.0
        };
        match runs.last_mut() {
            Some(run) if goes_on => run.1 = i,
            _ => runs.push((i - 1, i)),
        }
    }
    runs.sort_by_key(|(first, last)| (std::cmp::Reverse(last - first), *first));
    let mut seen: BTreeSet<Cell> = BTreeSet::new();
    let mut spans: Vec<(usize, usize)> = Vec::new();
    for (first, last) in runs {
        let mut span: Option<(usize, usize)> = None;
        for (i, cell) in path.iter().enumerate().take(last + 1).skip(first) {
            if seen.insert(*cell) {
                span = Some((span.map_or(i, |s| s.0), i));
            } else {
                spans.extend(span.take());
            }
        }
        spans.extend(span);
    }
    spans.sort_unstable();
    let pass = |(first, last): (usize, usize)| {
        let d = match path.len() {
            0 | 1 => return None,
            n if last + 1 < n => at[last + 1] - at[last],
            _ => at[last] - at[last - 1],
        };
        let along = if first < last {
            at[last] - at[first]
        } else {
            d
        };
        // Over a single cell it is short.
        let half = along / along.norm() * (SHORT_M / 2.0);
        Some(if first < last {
            Pass {
                from: at[first],
                to: at[last],
            }
        } else {
            Pass {
                from: at[first] - half,
                to: at[first] + half,
            }
        })
    };
    spans.into_iter().filter_map(pass).collect()
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
        let lengths_m: Vec<f64> = flights.laps.iter().map(|l| length_m(l)).collect();
        let ratio = lengths_m[1] / lengths_m[0];
        assert!((1.6..2.4).contains(&ratio), "{ratio}");
        let all: f64 = lengths_m.iter().sum();
        assert!(all < 1.15 * 600.0 * 600.0 / 30.0 + 4.0 * 400.0, "{all}");
        // Every cell is seen by one pass: what passes see beyond their ends is their own.
        let passes = || flights.passes.iter().flatten();
        for i in 0..60 {
            for j in 0..60 {
                let p = Point::new(f64::from(i) * 10.0 - 295.0, f64::from(j) * 10.0 - 295.0);
                assert!(passes().any(|pass| pass.sees(p, 15.0, 15.0)), "{p}");
            }
        }
        let seen_m: f64 = passes()
            .map(|p| (p.length_m() / 30.0).floor() * 30.0 + 30.0)
            .sum();
        assert!(seen_m < 1.02 * 600.0 * 600.0 / 30.0, "{seen_m}");
    }

    #[test]
    fn a_short_endurance_is_kept_and_the_rest_is_listed() {
        let flights = planned(&team(&[15.0, 15.0], 300.0, Point::new(0.0, 0.0)));
        assert!(flights.laps.iter().all(|l| length_m(l) <= 4500.0 + 1e-6));
        // 9 km of lanes of the 12 km that there are.
        assert!(
            (80..=140).contains(&flights.left.len()),
            "{}",
            flights.left.len()
        );
        let seen = |p| {
            flights
                .passes
                .iter()
                .flatten()
                .any(|pass| pass.sees(p, 14.0, 14.0))
        };
        assert!(!seen(flights.left[0]));
    }
}
