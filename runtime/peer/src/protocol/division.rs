//! What a complete round decides: a function of its bids alone.

use super::rounds::OpenRound;
use super::runs::{cells_of, direction_of};
use super::sections::{LivePeers, Sections};
use crate::cells::CellSet;
use crate::offload::MissionGeometry;
use crate::wire::message::{Bid, CellRun};
use skein_flight::coverage::ring::backtracking::{Division, RingCell, Uav};
use skein_flight::coverage::ring::{CoverageLoop, Direction};

/// A division without a loss is adopted only if it ends the work this much sooner:
/// the new makespan is at most this many percent of the present one.
const GAIN_PERCENT: u64 = 90;

/// Divisions without a loss are at least this many beacon periods apart.
pub const CALM_PERIODS: u64 = 20;

/// The open cells and the members of a complete round, as the solver wants them.
#[must_use]
pub fn problem(
    open: &OpenRound,
    coverage_loop: &CoverageLoop,
    covered: &CellSet,
) -> (Vec<RingCell>, Vec<Uav>) {
    let n = covered.capacity();
    let mut done = covered.clone();
    for s in open.bids.values() {
        if let Ok(covered) = CellSet::decode_rle(n, &s.covered) {
            done.union_with(&covered);
        }
        for run in &s.commits {
            for c in cells_of(*run, n) {
                done.insert(c);
            }
        }
    }
    let ring = coverage_loop.ring(|i, _| !done.contains(i));
    let uavs: Vec<Uav> = open
        .bids
        .iter()
        .map(|(id, s)| Uav {
            anchor: s.anchor % n.max(1),
            id: *id,
            heading: direction_of(s.backward),
            release_ms: s.release_ms,
            speed_mmps: s.speed_mmps.max(1),
            turn_ms: s.turn_ms,
            endurance_ms: s.endurance_ms,
            off_loop: s.off_loop.first().copied(),
        })
        .collect();
    assert!(
        uavs.is_sorted_by(|a, b| a.id < b.id),
        "all members solve the same problem"
    );
    (ring, uavs)
}

/// Whether the division of a complete round is adopted. All members judge alike:
/// only the bids count.
#[must_use]
pub fn worthwhile(open: &OpenRound, division: &Division, beacon_period_ms: u64) -> bool {
    if open.round.loss {
        return true;
    }
    let all = || open.bids.values();
    let present = all().map(|s| u64::from(s.eta_ms)).max().unwrap_or(0);
    let calm = all().all(|s| u64::from(s.adopted_ago_ms) >= CALM_PERIODS * beacon_period_ms);
    let progress = all().any(|s| s.cells_since > 0);
    calm && progress && gains(u64::from(division.makespan_ms), present)
}

/// Whether a division of what live claims list, among their owners and one UAV that has
/// nothing to fly, would be adopted: from what is held, so without asking anybody. Owners
/// are taken to be as fast as that UAV, and at the next cell of their plans; who else is
/// idle is left out.
#[must_use]
pub fn gain_in_sight(
    geometry: &MissionGeometry,
    (sections, live): (&Sections, &LivePeers),
    idle: Uav,
    present_ms: u64,
    delay_ms: u64,
) -> bool {
    let n = sections.cells();
    let mut listed = CellSet::new(n);
    let mut uavs = vec![idle];
    for id in live.keys().filter(|id| **id != idle.id) {
        let plan = sections.plan_of(*id);
        let Some(next) = plan.first() else { continue };
        let behind = u16::from(next.direction == Direction::Backward);
        uavs.push(Uav {
            anchor: (next.cell + behind) % n.max(1),
            id: *id,
            heading: next.direction,
            release_ms: 0,
            off_loop: None,
            ..idle
        });
        for p in &plan {
            listed.insert(p.cell);
        }
    }
    if uavs.len() == 1 {
        return false;
    }
    uavs.sort_unstable_by_key(|u| u.id);
    let ring = geometry.coverage_loop.ring(|c, _| listed.contains(c));
    let division = geometry.divide(&ring, &uavs);
    gains(u64::from(division.makespan_ms) + delay_ms, present_ms)
}

/// Whether one makespan is shorter than another by what makes a division worthwhile.
fn gains(new_ms: u64, present_ms: u64) -> bool {
    new_ms * 100 <= present_ms * GAIN_PERCENT
}

/// The cells of one member's section that are open in the round, in order of
/// flight, each with the way it is flown.
#[must_use]
pub fn section_of(division: &Division, ring: &[RingCell], id: u16) -> Vec<(u16, Direction)> {
    let mut out = Vec::new();
    let Some(section) = division.sections.iter().find(|s| s.id == id) else {
        return out;
    };
    let mut seen = vec![false; ring.len()];
    for leg in &section.legs {
        for c in leg.cells(ring.len()) {
            let i = usize::from(c);
            if ring.get(i).is_some_and(|r| r.open) && !seen[i] {
                seen[i] = true;
                out.push((c, leg.direction));
            }
        }
    }
    out
}

/// Cells of commitments, in the order of the runs.
#[must_use]
pub fn commits_of(bid: &Bid, n: u16) -> CellSet {
    let mut set = CellSet::new(n);
    for run in &bid.commits {
        for c in cells_of(*run, n) {
            set.insert(c);
        }
    }
    set
}

/// Runs of the given cells, in forward order, for a bid.
#[must_use]
pub fn runs_of(cells: &[u16], n: u16) -> Vec<CellRun> {
    let mut set = CellSet::new(n);
    for c in cells {
        set.insert(*c);
    }
    set.runs()
}
