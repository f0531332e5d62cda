//! Common ground derived once for many peers and many runs: the loop of a mission is
//! a pure function of it, so a thousand runs of one scenario build it once.

use skein_peer::Mission;
use skein_peer::mission::GeometryError;
use skein_peer::offload::{Job, JobResult, MissionGeometry, run};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Answers by [`Mission::content_hash`]. Cheap to clone: the ground is shared.
#[derive(Clone, Debug, Default)]
pub struct GeometryCache {
    by_hash: BTreeMap<u64, Result<Arc<MissionGeometry>, GeometryError>>,
}

impl GeometryCache {
    /// A cache that holds what was derived from this mission.
    #[must_use]
    pub fn holding(mission: &Mission, ground: Arc<MissionGeometry>) -> Self {
        Self {
            by_hash: BTreeMap::from([(mission.content_hash(), Ok(ground))]),
        }
    }

    /// The ground of a mission, derived on first use.
    pub fn of(&mut self, mission: &Arc<Mission>) -> Result<Arc<MissionGeometry>, GeometryError> {
        self.by_hash
            .entry(mission.content_hash())
            .or_insert_with(|| mission.geometry())
            .clone()
    }

    /// Solves a problem, ground from memory.
    pub fn answer(&mut self, job: &Job) -> JobResult {
        match job {
            Job::Geometry(mission) => JobResult::Geometry(self.of(mission)),
            Job::Divide { .. } => run(job),
        }
    }
}
