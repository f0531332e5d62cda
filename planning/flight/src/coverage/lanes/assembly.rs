//! From a problem to the cells of a loop: what is refused, which cells touch the
//! area, and how the closed part and the excursions are put together (D2.7 §3.6.2).
//!
//! Left to others: the closed parts ([`super::blocks`]), how they hang together
//! ([`super::islands`]) and single excursions ([`super::excursion`]).

use super::excursion::{Excursion, Finder};
use super::islands::{self, Crossed};
use crate::coverage::ring::{
    CellId, Grid, LoopCell, LoopError, LoopProblem, check_figures, check_launch, millimetres,
};
use crate::route::{RouteLimits, Router};
use skein_geometry::Curve;
use skein_geometry::Polygon;
use skein_geometry::frame::{MAX_MISSION_RADIUS_M, Point, Pose};
use std::collections::{BTreeMap, BTreeSet};

/// Half a footprint across must be this many lane spacings for one frame to hold a
/// cell from the middle of a quarter turn: √2 − ½.
const ACROSS_SPACINGS: f64 = core::f64::consts::SQRT_2 - 0.5;

/// The same along the track: √½.
const ALONG_SPACINGS: f64 = core::f64::consts::FRAC_1_SQRT_2;

/// Cells of a loop are numbered by `u16`.
const MAX_CELLS: usize = 65_535;

/// Squares of the area's bounding box that are looked at: a thin area of the most
/// cells may fill a sixteenth of its box.
const MAX_SQUARES: f64 = 16.0 * 65_535.0;

/// A cell with less of the area than this share of itself does not touch it: as
/// much as rounding makes of a shared border.
const SLIVER: f64 = 1e-6;

/// Refuses what cannot be flown or has no meaning.
pub(super) fn check(problem: &LoopProblem) -> Result<(), LoopError> {
    let inside = |p: &Point| p.x.abs() <= MAX_MISSION_RADIUS_M && p.y.abs() <= MAX_MISSION_RADIUS_M;
    check_figures(problem)?;
    if !problem.area.vertices().iter().all(inside) || !inside(&problem.launch) {
        return Err(LoopError::Extent);
    }
    check_lanes(problem)?;
    check_launch(problem)
}

/// Refuses lanes that cannot be flown or seen.
fn check_lanes(problem: &LoopProblem) -> Result<(), LoopError> {
    let d = problem.lane_spacing_m;
    if problem.turn_radius_m > d / 2.0 {
        return Err(LoopError::TurnRadius {
            radius_m: problem.turn_radius_m,
            spacing_m: d,
        });
    }
    let across_m = ACROSS_SPACINGS * d + problem.tracking_error_m;
    let along_m = ALONG_SPACINGS * d + problem.tracking_error_m;
    if problem.footprint_across_m < across_m || problem.footprint_along_m < along_m {
        return Err(LoopError::Footprint {
            spacing_m: d,
            across_m,
            along_m,
        });
    }
    Ok(())
}

/// The cells that share some of their inside with the area.
pub(super) fn cells_of(area: &Polygon, grid: Grid) -> Result<BTreeSet<CellId>, LoopError> {
    let d = grid.lane_spacing_m;
    let (low, high) = area.bounds();
    let squares = ((high.x - low.x) / d + 2.0) * ((high.y - low.y) / d + 2.0);
    let farthest = [low.x, low.y, high.x, high.y]
        .into_iter()
        .map(|v| (v / d).abs())
        .fold(0.0, f64::max);
    if squares > MAX_SQUARES || farthest > f64::from(i16::MAX) - 2.0 {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a cast of a float saturates"
        )]
        return Err(LoopError::TooManyCells(squares as usize));
    }
    let (first, last) = (grid.cell_at(low), grid.cell_at(high));
    let mut cells = BTreeSet::new();
    for col in first.col..=last.col {
        for row in first.row..=last.row {
            let cell = CellId { col, row };
            let [low, _, high, _] = grid.corners(cell);
            if area_within_m2(area, low, high) > SLIVER * d * d {
                cells.insert(cell);
            }
        }
    }
    if cells.len() > MAX_CELLS {
        return Err(LoopError::TooManyCells(cells.len()));
    }
    Ok(cells)
}

/// Area of the polygon inside an axis-parallel box: cut off at its four sides in
/// turn. Cutting a hollow polygon leaves edges that run to and fro on a side;
/// they add nothing to the area.
fn area_within_m2(polygon: &Polygon, low: Point, high: Point) -> f64 {
    let mut ring = polygon.vertices().to_vec();
    for (axis, limit, sign) in [
        (0, low.x, 1.0),
        (0, high.x, -1.0),
        (1, low.y, 1.0),
        (1, high.y, -1.0),
    ] {
        let depth = |p: Point| sign * (p[axis] - limit);
        let mut kept = Vec::with_capacity(ring.len() + 4);
        for (i, &b) in ring.iter().enumerate() {
            let a = ring[(i + ring.len() - 1) % ring.len()];
            let (da, db) = (depth(a), depth(b));
            if da * db < 0.0 {
                kept.push(a + (b - a) * (da / (da - db)));
            }
            if db >= 0.0 {
                kept.push(b);
            }
        }
        ring = kept;
    }
    let Some(&o) = ring.first() else {
        return 0.0;
    };
    ring.windows(2)
        .map(|w| (w[0] - o).perp(&(w[1] - o)))
        .sum::<f64>()
        / 2.0
}

/// Puts the closed part, the excursions and the cells that cannot be seen together.
pub(super) struct Assembly {
    pub cells: Vec<LoopCell>,
    pub uncoverable: Vec<(CellId, String)>,
}

impl Assembly {
    pub(super) fn new(
        problem: &LoopProblem,
        grid: Grid,
        needed: &BTreeSet<CellId>,
        loops: Vec<Vec<(CellId, Curve)>>,
    ) -> Result<Self, LoopError> {
        let router = Router::new(
            problem.zones.clone(),
            RouteLimits {
                turn_radius_m: problem.turn_radius_m,
                clearance_m: problem.clearance_m,
            },
        );
        let ring = islands::joined(problem, grid, &router, loops);
        let gates: Vec<Pose> = ring.iter().filter_map(|c| c.curve.start()).collect();
        let on_ring: BTreeSet<CellId> = ring.iter().map(|c| c.id).collect();
        let finder = Finder::new(problem, grid, &gates, router);
        if !finder.launch_reaches_some() {
            return Err(LoopError::CutOff);
        }
        let mut beside: BTreeMap<usize, Vec<LoopCell>> = BTreeMap::new();
        let mut uncoverable = Vec::new();
        for &id in needed.difference(&on_ring) {
            match finder.find(id) {
                Ok(Excursion {
                    gate,
                    curve,
                    view_m,
                }) => {
                    let service_mm = millimetres(&curve);
                    let cell = LoopCell {
                        id,
                        curve,
                        excursion: true,
                        service_mm,
                        travel_mm: 0,
                        needed: true,
                        view_m,
                    };
                    beside.entry(gate).or_default().push(cell);
                }
                Err(reason) => uncoverable.push((id, reason)),
            }
        }
        let mut cells = Vec::with_capacity(needed.len());
        for (i, crossed) in ring.into_iter().enumerate() {
            cells.append(&mut beside.remove(&i).unwrap_or_default());
            let Crossed { id, curve, view_m } = crossed;
            let (length_mm, needed) = (millimetres(&curve), needed.contains(&id));
            cells.push(LoopCell {
                id,
                curve,
                excursion: false,
                service_mm: length_mm,
                travel_mm: length_mm,
                needed,
                view_m,
            });
        }
        if cells.len() > MAX_CELLS {
            return Err(LoopError::TooManyCells(cells.len()));
        }
        Ok(Self { cells, uncoverable })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coverage::lanes;
    use crate::coverage::ring::patch::footprint_contains;
    use crate::coverage::ring::{CoverageLoop, Tree};
    use proptest::prelude::*;
    use skein_geometry::NoFlyZones;
    use skein_geometry::math::wrap_pi;
    use std::sync::Arc;

    fn rectangle(x0: f64, y0: f64, x1: f64, y1: f64) -> Polygon {
        Polygon::new(vec![
            Point::new(x0, y0),
            Point::new(x1, y0),
            Point::new(x1, y1),
            Point::new(x0, y1),
        ])
        .unwrap()
    }

    fn problem(area: Polygon, zones: Vec<Polygon>) -> LoopProblem {
        LoopProblem {
            area,
            zones: Arc::new(NoFlyZones::new(zones)),
            lane_spacing_m: 48.0,
            turn_radius_m: 23.0,
            clearance_m: 9.0,
            footprint_across_m: 46.0,
            footprint_along_m: 36.0,
            tracking_error_m: 2.0,
            launch: Point::new(-20.0, -20.0),
            tree: Tree::default(),
        }
    }

    fn city() -> LoopProblem {
        let zones = vec![
            rectangle(317.0, 272.0, 411.0, 382.0),
            rectangle(152.0, 237.0, 194.0, 278.0),
            rectangle(916.0, 535.0, 930.0, 549.0),
        ];
        problem(rectangle(0.0, 0.0, 1056.0, 960.0), zones)
    }

    /// Everything a loop owes, checked without the code that made it.
    fn judge(p: &LoopProblem, l: &CoverageLoop) {
        let grid = l.grid().unwrap();
        let needed = cells_of(&p.area, grid).unwrap();
        let (across, along) = (
            p.footprint_across_m - p.tracking_error_m,
            p.footprint_along_m - p.tracking_error_m,
        );
        let mut left = needed.clone();
        for (i, c) in l.cells().iter().enumerate() {
            assert_eq!(c.needed, needed.contains(&c.id));
            assert!(left.remove(&c.id) || !c.needed, "{:?} twice", c.id);
            assert_eq!(l.index_of(c.id), u16::try_from(i).ok());
            assert!(p.zones.is_clear(&c.curve, p.clearance_m), "{:?}", c.id);
            assert!(p.contingency_clear(&c.curve), "{:?}", c.id);
            assert!(c.curve.largest_gap_m() < 1e-2);
            assert!(c.curve.max_curvature_per_m() <= 1.0 / p.turn_radius_m + 1e-12);
            let (end, next) = (c.curve.end().unwrap(), l.boundary(i + 1));
            assert!(
                (end.position() - next.position()).norm() < 1e-2,
                "cell {i} {:?} {end:?} {next:?}",
                c.id
            );
            assert!(wrap_pi(end.heading_rad - next.heading_rad).abs() < 1e-3);
            let view = c.curve.pose_at(c.view_m).unwrap();
            assert!(
                footprint_contains(&grid, c.id, view, across + 1e-2, along + 1e-2),
                "{:?}",
                c.id
            );
            assert_eq!(c.travel_mm, if c.excursion { 0 } else { c.service_mm });
            if c.excursion {
                assert!((l.boundary(i).position() - next.position()).norm() < 1e-2);
            }
        }
        let listed: BTreeSet<CellId> = l.uncoverable().iter().map(|u| u.0).collect();
        assert_eq!(left, listed);
    }

    #[test]
    fn a_city_area_is_covered_but_for_the_cells_that_houses_fill() {
        for (clearance_m, footprint) in [(9.0, (46.0, 36.0)), (46.0, (59.7, 45.0))] {
            let mut p = city();
            p.clearance_m = clearance_m;
            (p.footprint_across_m, p.footprint_along_m) = footprint;
            p.launch = Point::new(528.0, 480.0);
            let l = lanes::build(&p).unwrap();
            judge(&p, &l);
            let seen = l.cells().iter().filter(|c| c.needed).count();
            assert!(
                seen * 100 >= 97 * 440,
                "clearance {clearance_m}: {seen} of 440: {:?}",
                l.uncoverable()
            );
            assert_eq!(l.hash(), lanes::build(&p).unwrap().hash());
        }
    }

    #[test]
    fn every_tree_gives_a_loop_over_the_same_cells() {
        let plain = lanes::build(&city()).unwrap();
        let cells = |l: &CoverageLoop| {
            let mut ids: Vec<CellId> = l.cells().iter().map(|c| c.id).collect();
            ids.sort_unstable();
            ids
        };
        let mut turns = Vec::new();
        for tree in Tree::ALL {
            let p = LoopProblem { tree, ..city() };
            let l = lanes::build(&p).unwrap();
            judge(&p, &l);
            assert_eq!(cells(&l), cells(&plain), "{tree:?}");
            let bent = l
                .cells()
                .iter()
                .filter(|c| c.curve.max_curvature_per_m() > 0.0);
            turns.push(bent.count());
        }
        // 1,056 m from west to east, 960 m from south to north.
        assert_eq!(turns[0], turns[1]);
        assert!(turns[0] < turns[2], "{turns:?}");
    }

    #[test]
    fn parts_behind_a_wall_hang_on_the_loop_by_one_way_there_and_back() {
        // A gate of 60 m in a wall across the area: no block fits through it.
        let halves = vec![
            rectangle(480.0, -50.0, 520.0, 440.0),
            rectangle(480.0, 500.0, 520.0, 1010.0),
        ];
        // A room with a door, with a house in it.
        let room = vec![
            rectangle(300.0, 300.0, 310.0, 700.0),
            rectangle(310.0, 690.0, 700.0, 700.0),
            rectangle(690.0, 300.0, 700.0, 690.0),
            rectangle(310.0, 300.0, 480.0, 310.0),
            rectangle(540.0, 300.0, 690.0, 310.0),
        ];
        for zones in [halves, room] {
            let area = rectangle(0.0, 0.0, 1056.0, 960.0);
            let p = problem(area, zones);
            let l = lanes::build(&p).unwrap();
            judge(&p, &l);
            let length_mm: u64 = l.cells().iter().map(|c| u64::from(c.service_mm)).sum();
            let (n, excursions) = (l.len(), l.cells().iter().filter(|c| c.excursion).count());
            assert!(n >= 370 && excursions * 4 < n, "{excursions} of {n}");
            // Cells are 48 m wide; the others are seen by turning once or twice.
            let most_mm = 1000 * (48 * n + 300 * excursions + 1000) as u64;
            assert!(length_mm < most_mm, "{length_mm} mm, {n}, {excursions}");
        }
    }

    #[test]
    fn a_free_area_is_one_closed_loop_of_lanes() {
        let p = problem(rectangle(0.0, 0.0, 480.0, 288.0), vec![]);
        let l = lanes::build(&p).unwrap();
        judge(&p, &l);
        assert_eq!(l.len(), 60);
        assert!(l.uncoverable().is_empty());
        let turns = l
            .cells()
            .iter()
            .filter(|c| c.curve.max_curvature_per_m() > 0.0)
            .count();
        // Three block rows joined at one end: the fewest corners a comb can have.
        assert!(turns <= 16, "{turns} quarter turns");
    }

    #[test]
    fn edge_blocks_stick_out_of_the_area_and_bring_cells_nobody_needs() {
        let p = problem(rectangle(10.0, 10.0, 130.0, 140.0), vec![]);
        let l = lanes::build(&p).unwrap();
        judge(&p, &l);
        assert_eq!(
            (l.len(), l.cells().iter().filter(|c| c.needed).count()),
            (16, 9)
        );
    }

    #[test]
    fn every_bad_problem_has_its_own_error() {
        let good = problem(rectangle(0.0, 0.0, 480.0, 288.0), vec![]);
        let check = |change: &dyn Fn(&mut LoopProblem), what: &str| {
            let mut p = good.clone();
            change(&mut p);
            let e = lanes::build(&p).map(|l| l.len()).unwrap_err();
            assert!(e.to_string().contains(what), "{e}");
        };
        check(&|p| p.lane_spacing_m = 0.0, "lane spacing");
        check(&|p| p.lane_spacing_m = f64::NAN, "lane spacing");
        check(&|p| p.turn_radius_m = f64::INFINITY, "turn radius");
        check(&|p| p.clearance_m = -1.0, "clearance");
        check(&|p| p.launch = Point::new(f64::NAN, 0.0), "20 km");
        check(&|p| p.area = rectangle(0.0, 0.0, 30_000.0, 100.0), "20 km");
        check(&|p| p.turn_radius_m = 24.1, "at most half the spacing");
        check(&|p| p.footprint_across_m = 45.0, "footprint is too small");
        check(&|p| p.footprint_along_m = 35.0, "footprint is too small");
        check(
            &|p| {
                p.area = rectangle(-19_000.0, -19_000.0, 19_000.0, 19_000.0);
                (p.lane_spacing_m, p.turn_radius_m) = (20.0, 5.0);
            },
            "at most 65,535",
        );
        check(
            &|p| (p.lane_spacing_m, p.turn_radius_m) = (0.01, 0.004),
            "at most 65,535",
        );
        check(
            &|p| p.zones = Arc::new(NoFlyZones::new(vec![rectangle(-30.0, -30.0, 0.0, 0.0)])),
            "launch point lies inside",
        );
        check(
            &|p| p.zones = Arc::new(NoFlyZones::new(vec![rectangle(-10.0, -10.0, 500.0, 300.0)])),
            "leave no room",
        );
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        #[test]
        fn any_loop_owes_the_same(
            w in 100.0f64..700.0, h in 100.0f64..500.0, x in -300.0f64..300.0,
            houses in prop::collection::vec((0.0f64..700.0, 0.0f64..500.0, 5.0f64..120.0, 5.0f64..120.0), 0..4),
        ) {
            let zones = houses.iter().map(|&(a, b, c, d)| rectangle(x + a, b, x + a + c, b + d)).collect();
            let mut p = problem(rectangle(x, 0.0, x + w, h), zones);
            p.launch = Point::new(x - 100.0, -100.0);
            match lanes::build(&p) {
                Ok(l) => judge(&p, &l),
                Err(e) => prop_assert!(matches!(e, LoopError::Nothing | LoopError::CutOff), "{e}"),
            }
        }

        #[test]
        fn clipped_areas_add_up(x in -50.0f64..50.0, tall in 20.0f64..90.0, cut in 1.0f64..19.0) {
            // A hollow shape: a U.
            let u = Polygon::new(
                [(0.0, 0.0), (90.0, 0.0), (90.0, tall), (60.0, tall), (60.0, cut), (30.0, cut), (30.0, tall), (0.0, tall)]
                    .map(|(a, b)| Point::new(a + x, b)).to_vec(),
            ).unwrap();
            let mut total = 0.0;
            for i in -6..16 {
                for j in 0..10 {
                    let low = Point::new(f64::from(i) * 10.0, f64::from(j) * 10.0);
                    total += area_within_m2(&u, low, low + nalgebra::Vector2::new(10.0, 10.0));
                }
            }
            prop_assert!((total - u.area_m2()).abs() < 1e-6);
        }
    }
}
