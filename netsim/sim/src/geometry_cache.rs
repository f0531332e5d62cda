//! Geometry derived once for many peers and many runs: the loop of a mission is
//! a pure function of it, so a thousand runs of one scenario build it once. So is a
//! division of its problem, and all members of a round solve the same one.

use skein_flight::coverage::ring::backtracking::{Division, RingCell, Uav};
use skein_peer::Mission;
use skein_peer::mission::GeometryError;
use skein_peer::offload::{Job, JobResult, MissionGeometry};
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

/// Answers by [`Mission::content_hash`]. Cheap to clone: what was derived is shared.
#[derive(Clone, Debug, Default)]
pub struct GeometryCache {
    by_hash: BTreeMap<u64, Result<Arc<MissionGeometry>, GeometryError>>,
    /// The newest divisions: all members of a round ask for the same.
    divided: VecDeque<Divided>,
}

/// Divisions remembered: the parts of a swarm that is split negotiate at the same time.
const DIVISIONS_KEPT: usize = 4;

#[derive(Clone, Debug)]
struct Divided {
    loop_hash: u64,
    ring: Vec<RingCell>,
    uavs: Vec<Uav>,
    division: Division,
}

/// The geometry of a mission that is asked for once.
///
/// # Errors
/// [`GeometryError`] names what is wrong with the mission.
pub fn geometry_of(mission: &Arc<Mission>) -> Result<Arc<MissionGeometry>, GeometryError> {
    GeometryCache::default().of(mission)
}

impl GeometryCache {
    /// A cache that holds what was derived from this mission.
    #[must_use]
    pub fn holding(mission: &Mission, geometry: Arc<MissionGeometry>) -> Self {
        Self {
            by_hash: BTreeMap::from([(mission.content_hash(), Ok(geometry))]),
            ..Self::default()
        }
    }

    /// The geometry of a mission, derived on first use.
    pub fn of(&mut self, mission: &Arc<Mission>) -> Result<Arc<MissionGeometry>, GeometryError> {
        self.by_hash
            .entry(mission.content_hash())
            .or_insert_with(|| mission.geometry())
            .clone()
    }

    /// Solves a problem, from memory if it was solved before.
    pub fn answer(&mut self, job: &Job) -> JobResult {
        match job {
            Job::Geometry(mission) => JobResult::Geometry(self.of(mission)),
            Job::Errand(request) => JobResult::Errand(request.plan()),
            Job::Divide {
                geometry,
                ring,
                uavs,
            } => {
                let loop_hash = geometry.coverage_loop.hash();
                let is_same =
                    |d: &&Divided| d.loop_hash == loop_hash && d.ring == *ring && d.uavs == *uavs;
                if let Some(known) = self.divided.iter().find(is_same) {
                    return JobResult::Divide(known.division.clone());
                }
                let division = geometry.divide(ring, uavs);
                self.divided.truncate(DIVISIONS_KEPT - 1);
                self.divided.push_front(Divided {
                    loop_hash,
                    ring: ring.clone(),
                    uavs: uavs.clone(),
                    division: division.clone(),
                });
                JobResult::Divide(division)
            }
        }
    }
}
