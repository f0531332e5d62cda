//! The people of a mass event as UAVs see and tell of them, beside where they are.

use super::Swarm;
use super::sim_peer::Process;
use crate::check::crowds::CrowdGlance;
use skein_geometry::frame::Point;
use skein_peer::gathering::Sector;
use skein_peer::{Report, Role};

impl Swarm {
    /// A UAV looked: what it sees of the event is judged beside who is in its picture.
    pub(super) fn note_crowd(&mut self, idx: usize) {
        if self.checker.rules.crowds.is_idle() {
            return;
        }
        let world = self.air.world();
        let Some(people) = world.crowd() else { return };
        self.checker.rules.crowds.on_people(people);
        let peer = &self.peers[idx];
        if peer.process != Process::Running {
            return;
        }
        let id = peer.id();
        let (Some(mind), Some(body)) = (&peer.peer, world.body(id)) else {
            return;
        };
        let (Some(known), Some(life)) = (mind.crowd(), mind.speaks_in()) else {
            return;
        };
        let own: Vec<(u16, Sector)> = mind.own_crowd().collect();
        let look = CrowdGlance {
            uav: (id, life),
            picture: body.picture(),
            is_late: peer.slow_ms > 0,
            looks: people.looks_at(self.now_ms) && body.takes_off_in_ms(self.now_ms) == 0,
            sees: &|at: Point| world.is_open_to(id, at),
            own: &own,
            known: &known,
        };
        let (rules, found) = (&mut self.checker.rules, &mut self.checker.found);
        rules.crowds.on_look(self.now_ms, look, found);
    }

    /// Where people are is remembered, and what is told beside it goes into the account.
    pub(super) fn judge_crowd(&mut self) {
        if self.checker.rules.crowds.is_idle() {
            return;
        }
        if let Some(people) = self.air.world().crowd() {
            self.checker.rules.crowds.on_people(people);
        }
    }

    /// A peer tells people that a sector became too dense, or has eased.
    pub(super) fn note_alert(&mut self, id: u16, report: &Report) {
        let Report::Crowd { told } = report else {
            return;
        };
        let idx = self.peer_idx(id);
        let is_ground = idx.is_some_and(|idx| self.peers[idx].config.role == Role::GroundStation);
        let (rules, found) = (&mut self.checker.rules, &mut self.checker.found);
        let at = (self.now_ms, id, is_ground);
        rules.crowds.on_told(at, told, found);
    }

    /// What was told beside what was true, at the end.
    pub(super) fn conclude_crowd(&mut self) {
        let (rules, found) = (&mut self.checker.rules, &mut self.checker.found);
        rules.crowds.on_end(self.now_ms, found);
        let report = rules.crowds.report();
        self.account.gathered(report);
    }
}
