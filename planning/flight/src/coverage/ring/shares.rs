//! Whether a division gives somebody far more than an even share of the work although
//! another could serve the last of it sooner.
//!
//! Leaves who takes what then to `free_entry`.

use super::backtracking::{Division, RingCell, Uav};
use super::coverage_loop::Direction;
use super::division::RouteNetwork;

/// More than so many even shares of the remaining time are too much.
pub const EVEN_SHARES_MAX: u64 = 2;

/// Another serves a cell sooner if so many percent of the time that it takes are less.
pub const SOONER_PERCENT: u32 = 110;

/// Most legs of a section: who has so many takes no more.
const LEGS_MAX: usize = 6;

/// Somebody who is given too much.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Overburdened {
    /// Who.
    pub id: u16,
    /// For how long it flies, milliseconds.
    pub given_ms: u64,
    /// An even share: the length of all open cells at the speed of all UAVs, milliseconds.
    pub even_ms: u64,
    /// The cell that it serves last.
    pub cell: u16,
    /// Who would serve that after its own section a tenth sooner.
    pub helper: u16,
}

/// Who of a division has more than twice an even share of the remaining time while another,
/// after its own section and within its endurance, could serve its last cell a tenth sooner
/// by the router's way.
///
/// The division is one of these open cells among these UAVs.
#[must_use]
pub fn overburdened(
    ring: &[RingCell],
    uavs: &[Uav],
    network: RouteNetwork<'_>,
    division: &Division,
) -> Option<Overburdened> {
    let open = ring.iter().filter(|c| c.open);
    let work_mm: u64 = open.map(|c| u64::from(c.service_mm)).sum();
    let speed_mmps: u64 = uavs.iter().map(|u| u64::from(u.speed_mmps)).sum();
    let even_ms = work_mm * 1000 / speed_mmps.max(1);
    let n = ring.len();
    let pose = |boundary: usize, way| network.coverage_loop.boundary_towards(boundary, way);
    let into = |cell: u16, way| {
        let behind = usize::from(way == Direction::Backward);
        pose(usize::from(cell) + behind, way)
    };
    let out_of = |cell: u16, way| {
        let behind = usize::from(way == Direction::Forward);
        pose(usize::from(cell) + behind, way)
    };
    let section_of = |id: u16| division.sections.iter().find(|s| s.id == id);
    let begins_ms = |u: &Uav| u.off_loop.map_or(u.release_ms, |off| off.ready_ms);
    uavs.iter().find_map(|late| {
        let section = section_of(late.id)?;
        let given_ms = u64::from(section.finish_ms.saturating_sub(begins_ms(late)));
        let last = section.legs.last()?.cells(n).last()?;
        if given_ms <= EVEN_SHARES_MAX * even_ms {
            return None;
        }
        let helper = uavs.iter().filter(|u| u.id != late.id).find(|u| {
            let Some(own) = section_of(u.id).filter(|s| s.legs.len() < LEGS_MAX) else {
                return false;
            };
            let end = own.legs.last();
            let end = end.and_then(|l| Some((l.cells(n).last()?, l.direction)));
            let (from, at_ms) = match (end, u.off_loop) {
                (Some((cell, way)), _) => (out_of(cell, way), own.finish_ms),
                (None, Some(off)) => (off.pose(), off.ready_ms),
                (None, None) => (pose(usize::from(u.anchor), u.heading), u.release_ms),
            };
            let ways = [Direction::Forward, Direction::Backward];
            let routes = ways.map(|way| network.router.route(from, into(last, way)));
            let lengths_m = routes.into_iter().flatten().map(|c| c.length_m());
            lengths_m.reduce(f64::min).is_some_and(|way_m| {
                let flown_m = way_m + f64::from(ring[usize::from(last)].service_mm) / 1000.0;
                let ms = f64::from(at_ms) + flown_m * 1e6 / f64::from(u.speed_mmps.max(1));
                let until_ms = f64::from(u.release_ms) + f64::from(u.endurance_ms);
                ms * f64::from(SOONER_PERCENT) < 100.0 * f64::from(section.finish_ms)
                    && ms <= until_ms
            })
        })?;
        Some(Overburdened {
            id: late.id,
            given_ms,
            even_ms,
            cell: last,
            helper: helper.id,
        })
    })
}
