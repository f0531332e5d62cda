//! What all runs of one scenario share, prepared once: the surveyed site and the
//! common ground of its mission.

use crate::fault::TimedFault;
use crate::spec::Spec;
use crate::swarm::{GeometryCache, Outcome, Swarm, outcome};
use crate::world::Site;
use std::sync::Arc;

/// The seed of the run without faults: the same for every seed that is asked for, so
/// that a seed draws the same storm alone and in a batch.
const FAILURE_FREE_SEED: u64 = 0;

/// A scenario, ready to run with any seed and any faults. Cheap to clone and to share.
#[derive(Clone, Debug)]
pub struct Prepared {
    /// The scenario.
    pub spec: Arc<Spec>,
    /// Its buildings and cells.
    pub site: Arc<Site>,
    /// The common ground of its mission.
    pub grounds: GeometryCache,
}

impl Prepared {
    /// Surveys the site and derives the loop.
    #[must_use]
    pub fn new(spec: Spec) -> Self {
        let site = Arc::new(Site::new(&spec));
        let spec = Arc::new(spec);
        let mut grounds = GeometryCache::default();
        // A mission without a ground is found out by every run; here it is only remembered.
        let _ = grounds.of(&spec.mission);
        Self {
            spec,
            site,
            grounds,
        }
    }

    /// Runs once. `keep` keeps the main events for a timeline. A panic becomes a
    /// violation of S12.
    #[must_use]
    pub fn run(&self, seed: u64, faults: Vec<TimedFault>, keep: bool) -> Outcome {
        outcome::run_guarded(self, seed, faults, keep)
    }

    /// Runs a seed with the scenario's own faults, and compares it with the reference
    /// where at most `compare_up_to` UAVs were killed.
    #[must_use]
    pub fn planned(&self, seed: u64, compare_up_to: u32, keep: bool) -> Outcome {
        self.compared(seed, self.spec.faults.clone(), compare_up_to, keep)
    }

    /// How long the mission takes without faults, milliseconds; the scenario's longest
    /// time when it does not end.
    #[must_use]
    pub fn failure_free_makespan_ms(&self) -> u64 {
        let longest_ms = u64::from(self.spec.max_time_s) * 1000;
        Swarm::new(self, FAILURE_FREE_SEED, Vec::new(), false)
            .run()
            .makespan_ms
            .unwrap_or(longest_ms)
    }

    /// Runs a seed with the faults its storm draws, and compares it with the reference
    /// where at most `compare_up_to` UAVs were killed.
    #[must_use]
    pub fn storm(
        &self,
        seed: u64,
        failure_free_ms: u64,
        compare_up_to: u32,
        keep: bool,
    ) -> Outcome {
        let faults = crate::fault_generator::draw(&self.spec, seed, failure_free_ms);
        self.compared(seed, faults, compare_up_to, keep)
    }

    fn compared(
        &self,
        seed: u64,
        faults: Vec<TimedFault>,
        compare_up_to: u32,
        keep: bool,
    ) -> Outcome {
        let compare = crate::fault_generator::kills(&faults) <= compare_up_to;
        let mut outcome = self.run(seed, faults.clone(), keep);
        if compare && outcome.makespan_ms.is_some() {
            outcome.compare(crate::omniscient_baseline::makespan_ms(self, seed, &faults));
        }
        outcome
    }
}
