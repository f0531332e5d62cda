//! Loops through stations: points, pieces of lines, passes over an area, each seen by
//! one frame, strung on one closed curve that a fixed wing can fly (D2.7 §3.4–3.6).
//!
//! The result is the same [`CoverageLoop`] that lanes over an area give, so a team
//! divides it, takes over parts of it and reports on it in the same way.
//!
//! | file | what it holds |
//! |---|---|
//! | [`targets`] | what a mission may ask for, and its pieces |
//! | `order` | in which order the pieces are flown |
//! | `stand` | where a UAV may be when it sees a piece |
//! | `chain` | which of these places are joined, and how |

mod chain;
mod order;
mod stand;
pub mod targets;
#[cfg(test)]
mod tests;

use super::area::patch::{Corners, Listed, Patches};
use super::area::stc::{CoverageLoop, LoopCell, LoopError};
use super::area::{CellId, hash_of, millimetres};
use crate::frame::{MAX_MISSION_RADIUS_M, Point, Pose};
use crate::geometry::NoFlyZones;
use crate::path::{RouteLimits, Router};
use crate::trajectory::Curve;
use chain::Chain;
use std::sync::Arc;

/// What is to be strung on a loop, and with what it is flown.
#[derive(Clone, Debug)]
pub struct StationsProblem {
    /// The pieces, each to be held by one frame; their numbers name the cells.
    pub stations: Vec<Corners>,
    /// The order in which they are flown: each number once.
    pub order: Vec<usize>,
    /// Where nobody may fly.
    pub zones: Arc<NoFlyZones>,
    /// Smallest turn radius of all UAVs of the mission, metres.
    pub turn_radius_m: f64,
    /// Distance that every curve keeps from the zones, metres.
    pub clearance_m: f64,
    /// Half the camera footprint across the track, metres.
    pub footprint_across_m: f64,
    /// Half the camera footprint along the track, metres.
    pub footprint_along_m: f64,
    /// How far a UAV may stray from its curve, metres; taken off the footprint.
    pub tracking_error_m: f64,
    /// A point from which the loop must be reachable (a launch point).
    pub launch: Point,
}

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
pub fn build(problem: &StationsProblem) -> Result<CoverageLoop, LoopError> {
    check(problem)?;
    let limits = RouteLimits {
        turn_radius_m: problem.turn_radius_m,
        clearance_m: problem.clearance_m,
    };
    let router = Router::new(Arc::clone(&problem.zones), limits);
    let mut uncoverable = Vec::new();
    let mut stands = Vec::with_capacity(problem.order.len());
    for &n in &problem.order {
        match stand::stands(problem, n) {
            Ok(poses) => stands.push((n, poses)),
            Err(why) => uncoverable.push((name(n), why.to_owned())),
        }
    }
    let chain = Chain::new(problem, &router, stands);
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
    reachable(problem, &router, &cells)?;
    uncoverable.sort();
    let corners = problem.stations.clone();
    let hash = hash_of(corners_hash(&corners), &cells);
    let reach_m = problem.footprint_across_m.max(problem.footprint_along_m);
    Ok(CoverageLoop::assembled(
        Patches::Listed(Listed::new(corners, reach_m)),
        cells,
        uncoverable,
        hash,
    ))
}

/// The name of the cell of a station.
fn name(n: usize) -> CellId {
    CellId::numbered(u16::try_from(n).unwrap_or(u16::MAX))
}

/// Refuses what cannot be flown or has no meaning.
fn check(p: &StationsProblem) -> Result<(), LoopError> {
    let positive = [(p.turn_radius_m, "turn radius")];
    let not_negative = [
        (p.clearance_m, "clearance"),
        (p.footprint_across_m, "footprint across the track"),
        (p.footprint_along_m, "footprint along the track"),
        (p.tracking_error_m, "tracking error"),
    ];
    let bad = |(value, least, name): (f64, f64, &'static str)| {
        (!value.is_finite() || value < least).then_some(LoopError::Number(name))
    };
    let figures = positive
        .map(|(v, name)| (v, 1e-3, name))
        .into_iter()
        .chain(not_negative.map(|(v, name)| (v, 0.0, name)));
    if let Some(e) = figures.into_iter().find_map(bad) {
        return Err(e);
    }
    if p.stations.len() > MAX_STATIONS {
        return Err(LoopError::TooManyCells(p.stations.len()));
    }
    if p.stations.is_empty() {
        return Err(LoopError::Nothing);
    }
    let inside = |p: &Point| p.x.abs() <= MAX_MISSION_RADIUS_M && p.y.abs() <= MAX_MISSION_RADIUS_M;
    if !p.stations.iter().flatten().all(inside) || !inside(&p.launch) {
        return Err(LoopError::Extent);
    }
    if p.zones.distance_m(p.launch) < p.clearance_m {
        return Err(LoopError::Launch);
    }
    Ok(())
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

/// Boundaries of the loop that are tried from the launch point, evenly spread.
const LAUNCH_GATES: usize = 8;

/// Headings tried at the launch point.
const LAUNCH_HEADINGS: u8 = 8;

fn reachable(p: &StationsProblem, router: &Router, cells: &[LoopCell]) -> Result<(), LoopError> {
    let gates = cells
        .iter()
        .step_by(cells.len().div_ceil(LAUNCH_GATES))
        .filter_map(|c| c.curve.start());
    let heading = |i: u8| crate::math::TAU * f64::from(i) / f64::from(LAUNCH_HEADINGS);
    for gate in gates {
        if (0..LAUNCH_HEADINGS).any(|i| router.route(Pose::new(p.launch, heading(i)), gate).is_ok())
        {
            return Ok(());
        }
    }
    Err(LoopError::CutOff)
}

/// FNV-1a over the corners, in whole millimetres.
fn corners_hash(corners: &[Corners]) -> u64 {
    let mut h: u64 = 0xcbf2_9ce4_8422_2325;
    for p in corners.iter().flatten() {
        for v in [p.x, p.y] {
            #[allow(
                clippy::cast_possible_truncation,
                reason = "within 20 km of the origin"
            )]
            let mm = (v * 1000.0).round() as i64;
            for byte in mm.to_le_bytes() {
                h = (h ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
            }
        }
    }
    h
}
