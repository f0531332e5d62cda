//! How the streets of a mission are used, beside where vehicles are.

use super::Swarm;
use super::sim_peer::{Process, SimPeer};
use crate::check::PeerSnapshot;
use crate::check::streets::StreetLook;
use skein_geometry::frame::Point;

/// What UAVs counted is asked for so often, milliseconds.
const ASKED_MS: u64 = 5_000;

impl Swarm {
    /// A UAV looked: which streets it watches is judged beside what drives there.
    pub(super) fn note_streets(&mut self, idx: usize) {
        let peer = &self.peers[idx];
        let is_running = peer.process == Process::Running;
        if self.checker.rules.streets.is_idle() || !is_running {
            return;
        }
        let id = peer.id();
        let world = self.air.world();
        let (Some(mind), Some(body)) = (&peer.peer, world.body(id)) else {
            return;
        };
        let (Some(watched), Some(life)) = (mind.watched_streets(), mind.lives_in()) else {
            return;
        };
        let look = StreetLook {
            uav: (id, life),
            picture: body.picture(),
            displaced_m: self.air.vehicles().displaced_m(id),
            is_late: peer.slow_ms > 0,
            sees: &|at: Point| world.is_open_to(id, at),
            watched,
        };
        let truth: Vec<Point> = self.air.vehicles().places().collect();
        let (rules, found) = (&mut self.checker.rules, &mut self.checker.found);
        rules.streets.on_look(self.now_ms, &truth, look, found);
    }

    /// Who could watch streets now; and each few seconds what each counted itself.
    pub(super) fn judge_streets(&mut self, peers: &[PeerSnapshot]) {
        if self.checker.rules.streets.is_idle() {
            return;
        }
        let newest = self.operator.mission().revision;
        let watches = |m: &&PeerSnapshot| {
            let view = &m.view;
            m.uav && view.speaks && view.revision >= newest && !view.finished
        };
        let able = peers.iter().filter(watches).map(|m| m.id).collect();
        self.checker.rules.streets.on_able(able);
        if self.streets_at_ms + ASKED_MS <= self.now_ms {
            self.streets_at_ms = self.now_ms;
            self.ask_of_streets();
        }
    }

    /// What each UAV that speaks counted itself.
    fn ask_of_streets(&mut self) {
        for p in &self.peers {
            let minds = p.peer.as_ref().filter(|_| p.process == Process::Running);
            let life = minds.and_then(|mind| Some((mind, mind.speaks_in()?)));
            if let Some((mind, life)) = life
                && let Some(own) = mind.own_usages()
            {
                self.checker.rules.streets.on_own((p.id(), life), own);
            }
        }
    }

    /// What the ground station knows at the end, or who knows most, beside what is true.
    pub(super) fn conclude_streets(&mut self) {
        if self.checker.rules.streets.is_idle() {
            return;
        }
        self.ask_of_streets();
        let running = |p: &&SimPeer| p.process == Process::Running;
        let minds = self.peers.iter().filter(running);
        let minds = minds.filter_map(|p| p.peer.as_ref());
        let known =
            minds.filter_map(|mind| Some((mind.is_ground_station(), mind.usages()?, mind.hints())));
        let best = known.max_by_key(|(ground, usages, _)| (*ground, usages.watched_m_s()));
        let (rules, found) = (&mut self.checker.rules, &mut self.checker.found);
        if let Some((_, usages, hints)) = best {
            rules.streets.on_known(self.now_ms, usages, &hints, found);
        }
        rules.streets.on_end(self.now_ms, found);
        let report = rules.streets.report();
        self.account.used(report);
    }
}
