//! Loops through stations: points, pieces of lines, passes over an area, each seen by
//! one frame, strung on one closed curve that a fixed wing can fly (D2.7 §3.4–3.6).
//!
//! The result is the same [`CoverageLoop`] that lanes over an area give, so a team
//! divides it, takes over parts of it and reports on it in the same way.
//!
//! | file | what it holds |
//! |---|---|
//! | [`targets`] | what a mission may ask for, and its pieces |
//! | `bundle` | which pieces of lines one frame holds together |
//! | `order` | in which order the pieces are flown |
//! | `stand` | where a UAV may be when it sees a piece |
//! | `parts` | which places zones part from where all take off |
//! | `chain` | which of these places are joined, and how |

mod bundle;
mod chain;
mod order;
mod parts;
mod stand;
pub mod targets;
#[cfg(test)]
mod tests;

use super::ring::patch::{Corners, Listed, Patches};
use super::ring::{
    CellId, CoverageLoop, LoopCell, LoopError, LoopProblem, check_figures, check_launch, hash_of,
    hash_words, millimetres,
};
use crate::route::{RouteLimits, Router};
use chain::Chain;
use parts::Parts;
use skein_geometry::Curve;
use skein_geometry::frame::{MAX_MISSION_RADIUS_M, Point, Pose};
use std::sync::Arc;

/// What is to be strung on a loop, and with what it is flown.
#[derive(Clone, Debug)]
pub struct StationsProblem<'a> {
    /// Zones, lengths and launch point of the mission; pieces of lines are as long as its
    /// lanes are wide.
    pub flown: &'a LoopProblem,
    /// The pieces, each to be held by one frame; their numbers name the cells.
    pub stations: Vec<Corners>,
    /// The order in which they are flown: each number once.
    pub order: Vec<usize>,
}

/// Why a station is not flown that zones part from the launch point.
const PARTED: &str = "no-fly zones part it from the launch point";

/// Most stations of a loop: cells are numbered by `u16`.
const MAX_STATIONS: usize = 65_535;

/// Builds the loop.
///
/// # Guarantees
/// Every station is on the loop exactly once or listed as uncoverable with a reason.
/// Every curve keeps the clearance and bends no more than the turn radius allows; from
/// everywhere on it one turning circle is clear of the zones.
///
/// # Complexity
/// O(n) in the number of stations, and a search of routes where zones are in the way.
///
/// # Errors
/// [`LoopError`].
pub fn build(problem: &StationsProblem<'_>) -> Result<CoverageLoop, LoopError> {
    check(problem)?;
    let flown = problem.flown;
    let limits = RouteLimits {
        turn_radius_m: flown.turn_radius_m,
        clearance_m: flown.clearance_m,
    };
    let router = Router::new(Arc::clone(&flown.zones), limits);
    let mut uncoverable = Vec::new();
    let mut stands = Vec::with_capacity(problem.order.len());
    let parts = Parts::of(flown);
    for &n in &problem.order {
        let poses = stand::stands(problem, n).and_then(|mut poses| {
            poses.retain(|pose| !parts.is_parted(pose.position()));
            let is_reached = !poses.is_empty();
            is_reached.then_some(poses).ok_or(PARTED)
        });
        match poses {
            Ok(poses) => stands.push((n, poses)),
            Err(why) => uncoverable.push((name(n), why.to_owned())),
        }
    }
    let chain = Chain::new(flown, &router, stands);
    let (visits, cut_off) = chain.solve();
    uncoverable.extend(cut_off.into_iter().map(|n| {
        (
            name(n),
            "no flyable curve links it with the others".to_owned(),
        )
    }));
    if visits.is_empty() {
        return Err(LoopError::Nothing);
    }
    let cells = cells(&visits);
    let gates: Vec<Pose> = cells.iter().filter_map(|c| c.curve.start()).collect();
    if !flown.launch_reaches(&router, &gates) {
        return Err(LoopError::CutOff);
    }
    uncoverable.sort();
    let corners = problem.stations.clone();
    let hash = hash_of(corners_hash(&corners), &cells);
    let reach_m = flown.footprint_across_m.max(flown.footprint_along_m);
    Ok(CoverageLoop::assembled(
        Patches::Listed(Listed::new(corners, reach_m)),
        cells,
        uncoverable,
        hash,
    ))
}

/// The poses at which one station may be seen, a straight before and after each clear of the
/// zones.
///
/// # Errors
/// A clause that says why there is none, or what is wrong with the problem.
pub fn views(problem: &StationsProblem<'_>, station: usize) -> Result<Vec<Pose>, String> {
    check(problem).map_err(|e| e.to_string())?;
    if station >= problem.stations.len() {
        return Err("no such piece".to_owned());
    }
    stand::stands(problem, station).map_err(str::to_owned)
}

/// The straight that is flown through such a pose.
#[must_use]
pub fn pass_through(pose: Pose) -> Curve {
    stand::run(pose)
}

/// The name of the cell of a station.
fn name(n: usize) -> CellId {
    CellId::numbered(u16::try_from(n).unwrap_or(u16::MAX))
}

/// Refuses what cannot be flown or has no meaning.
fn check(p: &StationsProblem<'_>) -> Result<(), LoopError> {
    check_figures(p.flown)?;
    if p.stations.len() > MAX_STATIONS {
        return Err(LoopError::TooManyCells(p.stations.len()));
    }
    if p.stations.is_empty() {
        return Err(LoopError::Nothing);
    }
    let inside = |p: &Point| p.x.abs() <= MAX_MISSION_RADIUS_M && p.y.abs() <= MAX_MISSION_RADIUS_M;
    if !p.stations.iter().flatten().all(inside) || !inside(&p.flown.launch) {
        return Err(LoopError::Extent);
    }
    check_launch(p.flown)
}

/// A station as it is flown: at this pose, and on to the next by this curve.
struct Visit {
    station: usize,
    onward: Curve,
}

/// Cells that meet half way between two stations.
fn cells(visits: &[Visit]) -> Vec<LoopCell> {
    let halves: Vec<(Curve, Curve)> = visits
        .iter()
        .map(|v| v.onward.split_at(v.onward.length_m() / 2.0))
        .collect();
    let n = visits.len();
    (0..n)
        .map(|i| {
            let mut curve = halves[(i + n - 1) % n].1.clone();
            let view_m = curve.length_m();
            curve.extend(&halves[i].0);
            let length_mm = millimetres(&curve);
            LoopCell {
                id: name(visits[i].station),
                curve,
                excursion: false,
                service_mm: length_mm,
                needed: true,
                travel_mm: length_mm,
                view_m,
            }
        })
        .collect()
}

/// Identifies what the pieces look like, to the millimetre.
fn corners_hash(corners: &[Corners]) -> u64 {
    #[allow(
        clippy::cast_possible_truncation,
        reason = "within 20 km of the origin"
    )]
    let mm = |v: f64| ((v * 1000.0).round() as i64).cast_unsigned();
    let words = |p: &Point| [mm(p.x), mm(p.y)];
    hash_words(corners.iter().flatten().flat_map(words))
}
