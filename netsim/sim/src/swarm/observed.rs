//! What an observer may look at while a swarm runs. Looking changes nothing: a run that is
//! looked at has the history of one that is not.

use super::{Outcome, Process, Swarm};
use crate::history::What;
use crate::radio::LinkTable;
use crate::spec::Spec;
use crate::world::{Fact, Loss, World};
use skein_peer::offload::MissionGeometry;
use std::sync::Arc;

impl Swarm {
    /// Runs to the end as [`Swarm::run`] does; `look` sees the swarm before its first event,
    /// then every so many milliseconds of scenario time, and at the end.
    pub fn run_watched(mut self, every_ms: u64, look: &mut dyn FnMut(&Self)) -> Outcome {
        look(&self);
        let mut until_ms = every_ms;
        while self.run_until(until_ms) {
            look(&self);
            until_ms += every_ms;
        }
        let outcome = self.outcome();
        look(&self);
        self.fly_home(outcome)
    }

    /// The scenario, with the twins that its faults switch on.
    #[must_use]
    pub fn spec(&self) -> &Spec {
        &self.spec
    }

    /// The world, as far as it has moved.
    #[must_use]
    pub fn world(&self) -> &World {
        self.air.world()
    }

    /// Who hears whom.
    #[must_use]
    pub fn links(&self) -> &LinkTable {
        self.air.links()
    }

    /// Whether a peer's process runs and does not stand still.
    #[must_use]
    pub fn runs(&self, id: u16) -> bool {
        self.peer_idx(id)
            .is_some_and(|idx| self.peers[idx].process == Process::Running)
    }

    /// What follows from the mission on whose loop cells are counted; none where it has no
    /// loop.
    #[must_use]
    pub fn geometry(&self) -> Option<&Arc<MissionGeometry>> {
        self.judged.derived()
    }

    /// Keeps what the world recorded and no report says.
    pub(super) fn keep_fact(&mut self, fact: &Fact) {
        match *fact {
            Fact::ZoneEntry {
                at_ms, uav, zone, ..
            } => self
                .history
                .keep(at_ms, || What::ZoneEntry { peer: uav, zone }),
            Fact::Lost {
                at_ms, uav, cause, ..
            } if cause != Loss::Killed => {
                self.history.keep(at_ms, || What::Lost { peer: uav });
            }
            Fact::TookOff { at_ms, uav } => {
                self.history.keep(at_ms, || What::TookOff { peer: uav });
            }
            Fact::Failsafe { at_ms, uav, on } => {
                self.history
                    .keep(at_ms, || What::Failsafe { peer: uav, on });
            }
            Fact::Seen { .. }
            | Fact::TooClose(_)
            | Fact::Intruded(_)
            | Fact::Collided(_)
            | Fact::Lost { .. } => {}
        }
    }
}
