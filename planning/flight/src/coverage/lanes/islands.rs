//! Closed parts of the loop that no blocks link with the first one, because a zone or a narrow
//! place lies between: a way there and back makes one loop of all of them (D2.7 §3.6.2, which
//! has one spanning tree).
//!
//! Without it each of their cells is an excursion of its own: behind a wall with a gate that
//! is the way round the wall for every cell.

use crate::coverage::ring::{CellId, Grid, LoopProblem};
use crate::route::Router;
use crate::trajectory::dubins;
use skein_geometry::Curve;
use skein_geometry::frame::Pose;
use skein_geometry::math::TAU;

/// A cell of the closed part of a loop.
#[derive(Clone, Debug)]
pub(super) struct Crossed {
    pub id: CellId,
    /// The curve through it, and where it is the first or the last of an island the way there
    /// or back.
    pub curve: Curve,
    /// Where along the curve the camera sees the whole cell, metres.
    pub view_m: f64,
}

impl Crossed {
    fn new((id, curve): (CellId, Curve)) -> Self {
        let view_m = curve.length_m() / 2.0;
        Self { id, curve, view_m }
    }

    fn start(&self) -> Option<Pose> {
        self.curve.start()
    }
}

/// Gates of an island that are tried, evenly spread over it, each with the gate of the loop
/// to which there and back is shortest if no zone is in the way.
const ISLAND_GATES: usize = 48;

/// A way from the loop to an island and back.
struct Bridge {
    /// Before which cell of the loop it leaves, and to where it comes back.
    gate: usize,
    /// At which cell of the island it arrives.
    entry: usize,
    there: Curve,
    back: Curve,
}

impl Bridge {
    fn length_m(&self) -> f64 {
        self.there.length_m() + self.back.length_m()
    }
}

/// One loop of the first closed part and of all others that are worth the way: shorter than
/// an excursion to each of their cells can be.
pub(super) fn joined(
    problem: &LoopProblem,
    grid: Grid,
    router: &Router,
    loops: Vec<Vec<(CellId, Curve)>>,
) -> Vec<Crossed> {
    let mut loops = loops
        .into_iter()
        .map(|cells| cells.into_iter().map(Crossed::new).collect::<Vec<_>>());
    let mut ring = loops.next().unwrap_or_default();
    for island in loops {
        if let Some(bridge) = shortest_bridge(problem, router, &ring, &island) {
            let round_m: f64 = island.iter().map(|c| c.curve.length_m()).sum();
            if bridge.length_m() + round_m <= excursions_m(problem, grid, &ring, &island) {
                ring = spliced(ring, island, &bridge);
            }
        }
    }
    ring
}

/// What single excursions to all cells of an island take at least, metres: each is a closed
/// curve, and from some pose of it the cell is in view.
fn excursions_m(problem: &LoopProblem, grid: Grid, ring: &[Crossed], island: &[Crossed]) -> f64 {
    let full_turn_m = TAU * problem.turn_radius_m;
    let view_m = problem.footprint_across_m.max(problem.footprint_along_m);
    let least_m = |cell: &Crossed| {
        let centre = grid.centre(cell.id);
        let away = |c: &Crossed| Some((c.start()?.position() - centre).norm());
        let nearest_m = ring.iter().filter_map(away).fold(f64::INFINITY, f64::min);
        full_turn_m.max(2.0 * (nearest_m - view_m))
    };
    island.iter().map(least_m).sum()
}

/// The shortest of the bridges that are tried.
fn shortest_bridge(
    problem: &LoopProblem,
    router: &Router,
    ring: &[Crossed],
    island: &[Crossed],
) -> Option<Bridge> {
    let radius_m = problem.turn_radius_m;
    let both_ways_m =
        |a: Pose, b: Pose| dubins::length_m(a, b, radius_m) + dubins::length_m(b, a, radius_m);
    let stride = island.len().div_ceil(ISLAND_GATES).max(1);
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (entry, cell) in island.iter().enumerate().step_by(stride) {
        let Some(at) = cell.start() else { continue };
        let gates = ring.iter().enumerate();
        let bounds = gates.filter_map(|(gate, c)| Some((both_ways_m(c.start()?, at), gate)));
        let nearest = bounds.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        pairs.extend(nearest.map(|(bound_m, gate)| (bound_m, gate, entry)));
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let way = |from: Pose, to: Pose| problem.routed(router, from, to);
    let mut best: Option<Bridge> = None;
    for (bound_m, gate, entry) in pairs {
        if best.as_ref().is_some_and(|b| b.length_m() <= bound_m) {
            break;
        }
        let (Some(from), Some(to)) = (ring[gate].start(), island[entry].start()) else {
            continue;
        };
        let (Some(there), Some(back)) = (way(from, to), way(to, from)) else {
            continue;
        };
        let bridge = Bridge {
            gate,
            entry,
            there,
            back,
        };
        if best
            .as_ref()
            .is_none_or(|b| bridge.length_m() < b.length_m())
        {
            best = Some(bridge);
        }
    }
    best
}

/// The loop with an island between two of its cells. A closed part has four cells at least,
/// so the way there and the way back belong to different ones.
fn spliced(mut ring: Vec<Crossed>, mut island: Vec<Crossed>, bridge: &Bridge) -> Vec<Crossed> {
    island.rotate_left(bridge.entry);
    if let Some(first) = island.first_mut() {
        let crossing = core::mem::replace(&mut first.curve, bridge.there.clone());
        first.view_m += bridge.there.length_m();
        first.curve.extend(&crossing);
    }
    if let Some(last) = island.last_mut() {
        last.curve.extend(&bridge.back);
    }
    let rest = ring.split_off(bridge.gate);
    ring.extend(island);
    ring.extend(rest);
    ring
}
