//! Common ground derived once for many peers and many runs: the loop of a mission is
//! a pure function of it, so a thousand runs of one scenario build it once.

use skein_peer::Mission;
use skein_peer::plan::{Answer, Ground, Problem, solve};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Answers by [`Mission::content_hash`]. Cheap to clone: the ground is shared.
#[derive(Clone, Debug, Default)]
pub struct Grounds {
    by_hash: BTreeMap<u64, Result<Arc<Ground>, String>>,
}

impl Grounds {
    /// The ground of a mission, derived on first use.
    pub fn of(&mut self, mission: &Arc<Mission>) -> Result<Arc<Ground>, String> {
        self.by_hash
            .entry(mission.content_hash())
            .or_insert_with(|| mission.ground())
            .clone()
    }

    /// Solves a problem, ground from memory.
    pub fn answer(&mut self, problem: &Problem) -> Answer {
        match problem {
            Problem::Ground(mission) => Answer::Ground(self.of(mission)),
            Problem::Divide { .. } => solve(problem),
        }
    }
}
