//! What a peer begins another mission with: its executive, and a negotiation on the new loop
//! that keeps what was covered at the same places.

use crate::cells::CellSet;
use crate::config::PeerConfig;
use crate::journal::Durable;
use crate::mission::{Mission, PointMm, ring_mm};
use crate::offload::MissionGeometry;
use crate::protocol::Negotiation;
use crate::separation::{Rules, Separation};
use crate::wire::message::{Claim, Member};
use skein_behaviors::Executive;
use skein_behaviors::reactive::climb::Climb;
use skein_flight::coverage::ring::patch::Patches;
use skein_flight::coverage::ring::{CellId, CoverageLoop};
use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;

/// An executive for a mission; none for a ground station.
pub(crate) fn executive_for(geometry: &MissionGeometry, config: &PeerConfig) -> Option<Executive> {
    let (mission, airframe) = (&geometry.mission, config.airframe?);
    let (coverage_loop, router) = (&geometry.coverage_loop, &geometry.router);
    let executive = Executive::new(
        airframe,
        config.height_m,
        Arc::clone(coverage_loop),
        Arc::clone(router),
    );
    let executive = executive
        .with_tracking_error_m(mission.tracking_error_m())
        .with_objective(config.objective)
        .with_home(mission.base_m())
        .with_town(geometry.town.clone())
        .with_late_ms(config.beacon_period_ms);
    Some(if mission.separation_mm > 0 {
        executive.with_promises()
    } else if let Some(layers) = &mission.layers {
        let slots = layers.slots();
        let lowest_m = slots.layers_m.first().copied();
        let offset_m = config.height_m - lowest_m.unwrap_or(config.height_m);
        let own = (config.id.0, offset_m);
        let speeds_mps = (airframe.climb_mps, layers.fastest_mps());
        let layer = layers.of_lap(mission.lap);
        executive.with_layer(Climb::new(slots, own, layer, speeds_mps))
    } else {
        executive
    })
}

/// How a UAV is kept apart from others at its height; not at all where the mission gives
/// each a height of its own.
pub(crate) fn separation_for(
    geometry: &MissionGeometry,
    me: Member,
    config: &PeerConfig,
) -> Option<Separation> {
    let (mission, airframe) = (&geometry.mission, config.airframe?);
    (mission.separation_mm > 0).then(|| {
        let rules = Rules {
            separation_m: mission.separation_m(),
            tubes_m: 2.0 * mission.tracking_error_m(),
            fastest_mps: mission.fastest_mps(),
            turn_radius_m: mission.turn_radius_m(),
        };
        Separation::new(me, rules, airframe)
    })
}

/// Of so many loops a peer remembers what was covered, that which it left last among them.
const REMEMBERED: usize = 5;

/// What was covered on the last loops: a zone that comes over some cells and goes again gives
/// back the loop there was, and what was seen of those cells is known still.
#[derive(Clone, Debug, Default)]
pub(crate) struct SeenBefore(VecDeque<(Begun, u64, CellSet)>);

/// Every lap begins with nothing covered, and every mission that is begun anew, or flown at
/// other heights.
type Begun = (u16, u16, u64);

fn begun(mission: &Mission) -> Begun {
    let heights = mission.layers.as_ref().map_or(0, |l| l.bits());
    (mission.lap, mission.sortie, heights)
}

impl SeenBefore {
    /// With what is known of one more loop, which is left now.
    pub fn left(mut self, geometry: &MissionGeometry, negotiation: &Negotiation) -> Self {
        let key = (begun(&geometry.mission), geometry.coverage_loop.hash());
        self.0.retain(|(begun, hash, _)| (*begun, *hash) != key);
        let covered = negotiation.sections.covered().clone();
        self.0.push_back((key.0, key.1, covered));
        if self.0.len() > REMEMBERED {
            self.0.pop_front();
        }
        self
    }

    fn of(&self, geometry: &MissionGeometry) -> Option<&CellSet> {
        let key = (begun(&geometry.mission), geometry.coverage_loop.hash());
        let same = self.0.iter().find(|(b, hash, _)| (*b, *hash) == key);
        same.map(|(_, _, covered)| covered)
    }
}

/// A negotiation on a new loop, with all that is known to be covered: before, on the loop of
/// an `old` mission and on those before it, and by the journal.
pub(crate) fn negotiation_begun(
    geometry: &MissionGeometry,
    old: Option<(&MissionGeometry, &Negotiation)>,
    seen_before: &SeenBefore,
    me: Member,
    durable: &Durable,
    cells: u16,
) -> Negotiation {
    let coverage_loop = &geometry.coverage_loop;
    // Of a mission that was cancelled nothing is to be seen.
    let without_need = (0u16..)
        .zip(coverage_loop.cells())
        .filter(|(_, c)| !c.needed || geometry.mission.cancelled);
    let needless = CellSet::of(cells, without_need.map(|(i, _)| i));
    let counter = old.map_or(0, |(_, negotiation)| negotiation.rounds.counter());
    let mut negotiation = Negotiation::new(me, needless, counter.max(durable.counter));
    if old.is_some_and(|(before, _)| before.coverage_loop.hash() != coverage_loop.hash()) {
        negotiation.rounds.begin_at(geometry.mission.revision);
    }
    let is_same = |g: &MissionGeometry| begun(&g.mission) == begun(&geometry.mission);
    if let Some((before, old)) = old.filter(|(g, _)| is_same(g)) {
        let covered = old.sections.covered();
        let covered = carried_over(&before.coverage_loop, covered, coverage_loop);
        negotiation.sections.cover(&covered);
    }
    if let Some(covered) = seen_before.of(geometry) {
        negotiation.sections.cover(covered);
    }
    if let Some(covered) = remembered(durable, coverage_loop.hash(), cells) {
        negotiation.sections.cover(&covered);
    }
    let of_this_loop = |claim: &&Claim| claim.loop_hash == coverage_loop.hash();
    if let Some(claim) = durable.claim.as_ref().filter(of_this_loop) {
        negotiation.sections.restore_epoch(claim.epoch);
    }
    negotiation
}

/// Covered cells the journal held, if they are counted on this loop.
fn remembered(durable: &Durable, loop_hash: u64, cells: u16) -> Option<CellSet> {
    if durable.loop_hash == loop_hash && durable.cells == cells {
        CellSet::decode_rle(cells, &durable.covered).ok()
    } else {
        None
    }
}

/// Covered cells of one loop, found again at the same places of another: by name on one grid;
/// pieces, whose names are mere numbers, by their corners.
fn carried_over(old: &CoverageLoop, covered: &CellSet, new: &CoverageLoop) -> CellSet {
    let before = |c: u16| old.cells().get(usize::from(c)).filter(|c| c.needed);
    let seen = covered.iter().filter_map(before).map(|c| c.id);
    let found: Vec<CellId> = match (old.patches(), new.patches()) {
        (Patches::Grid(a), Patches::Grid(b)) if a == b => seen.collect(),
        (Patches::Listed(a), Patches::Listed(b)) => {
            let place = |n: u16| a.corners().get(usize::from(n)).map(|c| ring_mm(c));
            let places: BTreeSet<Vec<PointMm>> =
                seen.filter_map(|id| place(id.number()?)).collect();
            let pieces = (0_u16..).zip(b.corners());
            let same = pieces.filter(|(_, c)| places.contains(&ring_mm(&c[..])));
            same.map(|(n, _)| CellId::numbered(n)).collect()
        }
        _ => Vec::new(),
    };
    let found = found.into_iter().filter_map(|id| new.index_of(id));
    CellSet::of(u16::try_from(new.len()).unwrap_or(u16::MAX), found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CoverageTask, PointTask};

    #[test]
    fn covered_cells_are_carried_to_another_loop_by_name() {
        let of = |cols| {
            Arc::new(crate::testing::mission(1, cols, 4))
                .geometry()
                .unwrap()
        };
        let (before, after) = (of(6), of(8));
        let (old, new) = (&before.coverage_loop, &after.coverage_loop);
        let mut renumbered = 0;
        for (i, cell) in (0u16..).zip(old.cells()) {
            let n = u16::try_from(old.len()).unwrap();
            let carried = carried_over(old, &CellSet::of(n, [i]), new);
            let found: Vec<u16> = carried.iter().collect();
            let wanted = new.index_of(cell.id).filter(|_| cell.needed);
            assert_eq!(found, wanted.into_iter().collect::<Vec<_>>());
            renumbered += u32::from(wanted.is_some_and(|w| w != i));
        }
        assert!(renumbered > 0, "no cell has another number");
        // On lanes of another spacing the same name is another place.
        let wider = Mission {
            lane_spacing_mm: crate::testing::LANE_MM + 8_000,
            footprint_across_mm: 60_000,
            footprint_along_mm: 50_000,
            ..crate::testing::mission(1, 6, 4)
        };
        let wider = Arc::new(wider).geometry().unwrap();
        let all = CellSet::full(u16::try_from(old.len()).unwrap());
        assert!(carried_over(old, &all, &wider.coverage_loop).is_empty());
    }

    /// Of other targets the third is what the second was: not the number counts.
    #[test]
    fn covered_points_are_carried_to_another_loop_by_their_places() {
        let points = |at: &[PointMm]| {
            let point = |at: &PointMm| PointTask {
                at: *at,
                radius_mm: 1_000,
            };
            let task = CoverageTask::Points(at.iter().map(point).collect());
            let mission = Mission {
                task,
                ..crate::testing::mission(1, 6, 4)
            };
            Arc::new(mission).geometry().unwrap()
        };
        let (a, b, c) = ((20_000, 30_000), (150_000, 40_000), (80_000, 120_000));
        let (before, after) = (points(&[a, b]), points(&[c, a, b]));
        let (old, new) = (&before.coverage_loop, &after.coverage_loop);
        for n in 0..2 {
            let seen = old.index_of(CellId::numbered(n)).unwrap();
            let carried = carried_over(old, &CellSet::of(2, [seen]), new);
            let wanted = new.index_of(CellId::numbered(n + 1));
            assert_eq!(carried.iter().next(), wanted);
            assert_eq!(carried.count(), 1);
        }
        // A lane's name says nothing of a point, nor a point's number of a lane.
        let lanes = Arc::new(crate::testing::mission(1, 6, 4))
            .geometry()
            .unwrap();
        let (old, new) = (&lanes.coverage_loop, &after.coverage_loop);
        let all = |l: &CoverageLoop| CellSet::full(u16::try_from(l.len()).unwrap());
        assert!(carried_over(old, &all(old), new).is_empty());
        assert!(carried_over(new, &all(new), old).is_empty());
    }
}
