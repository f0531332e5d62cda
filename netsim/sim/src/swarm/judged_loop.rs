//! The loop on which cells are counted, and which of its cells cameras saw.

use super::air::Air;
use crate::geometry_cache::GeometryCache;
use skein_peer::Mission;
use std::sync::Arc;

/// The newest loop that any peer has begun.
#[derive(Debug)]
pub(super) struct JudgedLoop {
    mission: Arc<Mission>,
    hash: u64,
    covered: Vec<bool>,
    /// The newest lap that any peer has begun, from 0.
    lap: u16,
}

impl JudgedLoop {
    pub(super) fn new(mission: &Arc<Mission>, cache: &mut GeometryCache) -> Self {
        let (covered, hash) = cache.of(mission).map_or((Vec::new(), 0), |g| {
            (vec![false; g.coverage_loop.len()], g.coverage_loop.hash())
        });
        Self {
            mission: Arc::clone(mission),
            hash,
            covered,
            lap: 0,
        }
    }

    pub(super) fn hash(&self) -> u64 {
        self.hash
    }

    /// By cell whether it is covered; one that nobody needs is.
    pub(super) fn covered(&self) -> &[bool] {
        &self.covered
    }

    /// A peer begins a revision. If it is of the mission given last, and nobody has begun it
    /// before, cells are counted on its loop from now on. Returns whether that is another one.
    pub(super) fn begin(
        &mut self,
        given: &Arc<Mission>,
        revision: u32,
        loop_hash: u64,
        (cache, air): (&mut GeometryCache, &Air),
    ) -> bool {
        let lap = revision.checked_sub(given.revision);
        let lap = lap.and_then(|lap| u16::try_from(lap).ok());
        let Some(lap) = lap.filter(|lap| *lap <= given.further_laps) else {
            return false;
        };
        if (given.revision, lap) <= (self.mission.revision, self.lap) {
            return false;
        }
        self.mission = Arc::clone(given);
        self.lap = lap;
        let is_another = loop_hash != self.hash;
        if is_another {
            self.hash = loop_hash;
            let geometry = cache.of(&self.mission);
            self.covered = vec![false; geometry.map_or(0, |g| g.coverage_loop.len())];
            self.refresh(cache, air);
        }
        is_another
    }

    /// Marks what was seen since.
    pub(super) fn refresh(&mut self, cache: &mut GeometryCache, air: &Air) {
        if let Ok(geometry) = cache.of(&self.mission) {
            let (revision, laps) = (self.mission.revision, self.lap + 1);
            for (flag, cell) in self.covered.iter_mut().zip(geometry.coverage_loop.cells()) {
                *flag = *flag || !cell.needed || air.is_covered(revision, cell.id, laps);
            }
        }
    }
}
