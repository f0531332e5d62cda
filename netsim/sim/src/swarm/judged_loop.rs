//! The loop on which cells are counted, and which of its cells cameras saw.

use super::air::Air;
use crate::geometry_cache::GeometryCache;
use skein_peer::Mission;
use skein_peer::cells::CellSet;
use skein_peer::offload::MissionGeometry;
use std::sync::Arc;

/// The newest loop that any peer has begun.
#[derive(Debug)]
pub(super) struct JudgedLoop {
    mission: Arc<Mission>,
    /// Of that mission, where it has any.
    geometry: Option<Arc<MissionGeometry>>,
    hash: u64,
    covered: CellSet,
    /// The newest lap that any peer has begun, from 0.
    lap: u16,
    /// The version of the judge that the covered cells are of; none once they are counted
    /// otherwise.
    judged: Option<u64>,
}

impl JudgedLoop {
    pub(super) fn new(mission: &Arc<Mission>, cache: &mut GeometryCache) -> Self {
        let geometry = cache.of(mission).ok();
        Self {
            mission: Arc::clone(mission),
            hash: geometry.as_ref().map_or(0, |g| g.coverage_loop.hash()),
            covered: uncovered(geometry.as_deref()),
            geometry,
            lap: 0,
            judged: None,
        }
    }

    /// What follows from the mission, where it has a loop.
    pub(super) fn derived(&self) -> Option<&Arc<MissionGeometry>> {
        self.geometry.as_ref()
    }

    pub(super) fn hash(&self) -> u64 {
        self.hash
    }

    /// The cells that are covered; those that nobody needs are.
    pub(super) fn covered(&self) -> &CellSet {
        &self.covered
    }

    /// A peer begins a revision. If it is of the mission given last, and nobody has begun it
    /// before, or it is another one of that number, cells are counted on its loop from now on.
    /// Returns whether that is another one.
    pub(super) fn begin(
        &mut self,
        (given, is_beside): (&Arc<Mission>, bool),
        revision: u32,
        loop_hash: u64,
        (cache, air): (&mut GeometryCache, &Air),
    ) -> bool {
        let laps = revision.checked_sub(given.revision);
        let laps = laps.and_then(|laps| u16::try_from(laps).ok());
        let Some(laps) = laps.filter(|laps| *laps <= given.further_laps) else {
            return false;
        };
        let lap = given.lap.saturating_add(laps);
        if !is_beside && (given.revision, lap) <= (self.mission.revision, self.lap) {
            return false;
        }
        self.mission = Arc::clone(given);
        self.geometry = cache.of(given).ok();
        self.lap = lap;
        self.judged = None;
        let is_another = loop_hash != self.hash;
        if is_another {
            self.hash = loop_hash;
            self.covered = uncovered(self.geometry.as_deref());
            self.refresh(air);
        }
        is_another
    }

    /// Marks what was seen since.
    pub(super) fn refresh(&mut self, air: &Air) {
        let Some(geometry) = &self.geometry else {
            return;
        };
        // Most of what is said is said between two sightings.
        let version = Some(air.judge().version());
        if core::mem::replace(&mut self.judged, version) == version {
            return;
        }
        let (revision, laps) = (self.mission.revision, self.lap + 1);
        let cells = geometry.coverage_loop.cells();
        for c in self.covered.complement().iter() {
            let cell = &cells[usize::from(c)];
            if !cell.needed || air.is_covered(revision, cell.id, laps) {
                self.covered.insert(c);
            }
        }
    }
}

/// None of the cells of a loop.
fn uncovered(geometry: Option<&MissionGeometry>) -> CellSet {
    let n = geometry.map_or(0, |g| g.coverage_loop.len());
    CellSet::new(u16::try_from(n).unwrap_or(u16::MAX))
}
