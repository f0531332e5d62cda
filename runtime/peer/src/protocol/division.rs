//! What a complete round decides: a function of its bids alone.

use super::rounds::OpenRound;
use super::runs::{PlannedCell, direction_of};
use super::sections::{LivePeers, Sections};
use crate::cells::CellSet;
use crate::offload::MissionGeometry;
use crate::wire::message::{Bid, Epoch};
use skein_flight::coverage::ring::backtracking::{Division, RingCell, Uav};
use skein_flight::coverage::ring::{CoverageLoop, Direction};

/// A rebalancing is adopted only if it ends the work this much sooner:
/// the new makespan is at most this many percent of the present one.
const GAIN_PERCENT: u64 = 90;

/// The open cells and the members of a complete round, as the solver wants them. What is
/// `needless` is the same at every peer, and never what this one knows to be covered.
#[must_use]
pub fn problem(
    open: &OpenRound,
    coverage_loop: &CoverageLoop,
    needless: &CellSet,
) -> (Vec<RingCell>, Vec<Uav>) {
    let n = needless.capacity();
    let mut done = needless.clone();
    for s in open.bids.values() {
        if let Ok(covered) = CellSet::decode_rle(n, &s.covered) {
            done.union_with(&covered);
        }
        done.union_with(&commits_of(s, n));
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
pub fn worthwhile(open: &OpenRound, division: &Division) -> bool {
    if open.round.repair {
        return true;
    }
    let all = || open.bids.values();
    let present = all().map(|s| u64::from(s.eta_ms)).max().unwrap_or(0);
    let calm = all().all(|s| s.calm);
    let progress = all().any(|s| s.progressed);
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

/// The plan of a member once it adopts: what it committed to in its bid, then its section.
#[must_use]
pub fn adopted(
    sections: &Sections,
    epoch: Epoch,
    bid: &Bid,
    section: &[(u16, Direction)],
) -> Vec<PlannedCell> {
    let committed = commits_of(bid, sections.cells());
    let kept = sections
        .plan()
        .iter()
        .filter(|p| committed.contains(p.cell));
    let commits: Vec<(u16, Direction)> = kept.map(|p| (p.cell, p.direction)).collect();
    sections.adopted(epoch, &commits, section)
}

/// The cells that the flyer of a bid is about to fly and keeps.
#[must_use]
pub fn commits_of(bid: &Bid, n: u16) -> CellSet {
    CellSet::of_runs(n, bid.commits.iter().copied())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::mission;
    use crate::wire::message::{CellRun, Claim, Epoch, ListedRun, Member, OffLoop, Round, Stamp};
    use crate::wire::samples;
    use std::sync::Arc;

    fn uav(id: u16, anchor: u16, heading: Direction) -> Uav {
        Uav {
            anchor,
            id,
            heading,
            release_ms: 0,
            speed_mmps: 12_000,
            turn_ms: 8_000,
            endurance_ms: 3_000_000,
            off_loop: None,
        }
    }

    /// Peer 2 claims cells 4 to 19, this way; so does 3 what is left, but it is dead.
    fn claimed(backward: bool) -> (Sections, LivePeers) {
        let mut sections = Sections::new(1, 24, CellSet::new(24));
        for (id, run) in [
            (
                2,
                CellRun {
                    first: 4,
                    count: 16,
                },
            ),
            (
                3,
                CellRun {
                    first: 20,
                    count: 8,
                },
            ),
        ] {
            let epoch = Epoch::default();
            let plan = vec![ListedRun {
                run,
                backward,
                stamp: Stamp { epoch, take: 0, id },
            }];
            let claim = Claim {
                plan,
                ..Claim::default()
            };
            assert!(sections.hear(id, 1, 1, claim));
        }
        (sections, LivePeers::from([(1, 1), (2, 1), (4, 1)]))
    }

    /// As §4.4 wants it: owners are at the next cell of their plans, as fast as the idle one
    /// and at work at once; W0 passes before anything changes, and a tenth is to be gained.
    #[test]
    fn a_gain_is_foreseen_where_a_division_and_the_wait_end_a_tenth_sooner() {
        let geometry = Arc::new(mission(1, 6, 4)).geometry().unwrap();
        let place = |id: u16| geometry.coverage_loop.boundary(usize::from(id));
        let mut idle = uav(1, 12, Direction::Forward);
        idle.release_ms = 3_000;
        idle.off_loop = Some(OffLoop {
            east_mm: (place(12).east_m * 1000.0) as i32 + 40_000,
            north_mm: (place(12).north_m * 1000.0) as i32,
            course_e4: 0,
            ready_ms: 2_000,
        });
        for (backward, owner) in [
            (false, uav(2, 4, Direction::Forward)),
            (true, uav(2, 20, Direction::Backward)),
        ] {
            let (sections, live) = claimed(backward);
            let ring = geometry.coverage_loop.ring(|c, _| (4..20).contains(&c));
            let division = geometry.divide(&ring, &[idle, owner]);
            let ends_ms = u64::from(division.makespan_ms) + 5_000;
            let least_ms = (ends_ms * 100).div_ceil(90);
            let sees =
                |present_ms| gain_in_sight(&geometry, (&sections, &live), idle, present_ms, 5_000);
            assert!(
                sees(least_ms) && !sees(least_ms - 1),
                "{backward} {least_ms}"
            );
        }
        // Nobody alive has anything to share.
        let (sections, _) = claimed(false);
        let live = LivePeers::from([(1, 1), (4, 1)]);
        assert!(!gain_in_sight(
            &geometry,
            (&sections, &live),
            idle,
            u64::MAX / 1000,
            0
        ));
    }

    fn bid(eta_ms: u32, calm: bool, progressed: bool) -> Bid {
        let round = Round {
            counter: 1,
            members: [1, 2].map(|id| Member { id, incarnation: 1 }).to_vec(),
            revision: 1,
            loop_hash: 7,
            repair: false,
            wait_ms: 5_000,
        };
        Bid {
            eta_ms,
            calm,
            progressed,
            speed_mmps: 12_000,
            ..samples::bid(round)
        }
    }

    fn round_of(bids: [Bid; 2]) -> OpenRound {
        OpenRound {
            round: bids[0].round.clone(),
            bids: (1..).zip(bids).collect(),
        }
    }

    /// §4.3: at most 90 % of the present makespan, if all members are calm and one has
    /// covered a cell since.
    #[test]
    fn a_rebalancing_is_adopted_for_a_tenth_after_calm_and_with_progress() {
        let worth = |makespan_ms: u32, bids: [Bid; 2]| {
            let division = Division {
                sections: Vec::new(),
                unassigned: Vec::new(),
                makespan_ms,
            };
            worthwhile(&round_of(bids), &division)
        };
        let calm = || [bid(100_000, true, false), bid(60_000, true, true)];
        assert!(worth(90_000, calm()) && !worth(90_001, calm()));
        let [a, b] = calm();
        assert!(
            !worth(1, [bid(100_000, false, false), b]),
            "one adopted lately"
        );
        assert!(
            !worth(1, [a, bid(60_000, true, false)]),
            "nothing was covered"
        );
        // A repair always is.
        let mut repair = calm();
        repair.iter_mut().for_each(|b| b.round.repair = true);
        assert!(worth(u32::MAX, repair));
    }

    #[test]
    fn what_is_divided_is_open_in_all_bids_and_committed_in_none() {
        let geometry = Arc::new(mission(1, 6, 4)).geometry().unwrap();
        let mut bids = [bid(0, false, false), bid(0, false, false)];
        bids[0].covered = CellSet::of(24, [0, 1]).encode_rle(None);
        bids[0].commits = vec![CellRun {
            first: 23,
            count: 1,
        }];
        bids[1].covered = CellSet::of(24, [1, 9]).encode_rle(None);
        bids[1].commits = vec![CellRun {
            first: 10,
            count: 2,
        }];
        (bids[1].anchor, bids[1].backward, bids[1].release_ms) = (12, true, 4_000);
        let base = CellSet::of(24, [15]);
        let (ring, uavs) = problem(&round_of(bids), &geometry.coverage_loop, &base);
        let open: Vec<usize> = (0..24).filter(|i| !ring[*i].open).collect();
        assert_eq!(open, [0, 1, 9, 10, 11, 15, 23]);
        assert_eq!(uavs[0], uav(1, 0, Direction::Forward));
        let second = Uav {
            release_ms: 4_000,
            ..uav(2, 12, Direction::Backward)
        };
        assert_eq!(uavs[1], second);
    }
}
