//! What is followed and looked for, beside where vehicles are and who has them in its picture.

use super::Swarm;
use super::sim_peer::Process;
use crate::check::PeerSnapshot;
use crate::check::contours::Tracer;
use crate::check::counts::CountLook;
use crate::check::detections::Truth;
use crate::check::tracks::Look;
use skein_flight::tracing::outline::Stretch;
use skein_geometry::frame::Point;
use skein_peer::wire::count::Count;
use skein_peer::{MISSION, Report};

impl Swarm {
    /// What a UAV has in its picture, and what it says that it follows.
    fn look(&self, m: &PeerSnapshot) -> Look {
        Look {
            uav: m.id,
            at: m.at,
            since_ms: m.since_ms,
            says: m.view.follows.filter(|_| m.view.speaks),
            pictured: self.air.pictured(m.id),
        }
    }

    /// Who says that it follows somebody is looked at beside where vehicles are.
    pub(super) fn judge_tracks(&mut self, peers: &[PeerSnapshot]) {
        if self.air.vehicles().is_empty() {
            return;
        }
        let uavs = peers.iter().filter(|m| m.uav);
        let looks: Vec<Look> = uavs.map(|m| self.look(m)).collect();
        let truth: Vec<Point> = self.air.vehicles().places().collect();
        let tracks = &mut self.checker.rules.tracks;
        tracks.on_looks(self.now_ms, &truth, &looks, &mut self.checker.found);
        for (task, tracked) in tracks.tracked() {
            self.account.tracked(task, tracked);
        }
    }

    /// What the mission looks for is judged beside what was in the pictures of those who fly it.
    pub(super) fn judge_detections(&mut self, peers: &[PeerSnapshot]) {
        if self.checker.rules.detections.is_idle() {
            return;
        }
        let newest = self.operator.mission().revision;
        let flies = |m: &&PeerSnapshot| m.uav && m.view.speaks && m.view.revision >= newest;
        let flying = peers.iter().filter(flies);
        let looks: Vec<Look> = flying.map(|m| self.look(m)).collect();
        let truth: Vec<Truth> = self.air.vehicles().truth().collect();
        self.checker.on_detections(self.now_ms, &truth, &looks);
        let reports = self.checker.rules.detections.reports();
        self.account.detected(reports);
    }

    /// Who flies along a contour is judged beside where that is, and so is what is told of it: by
    /// what the ground station knows, or the first UAV where there is none.
    pub(super) fn judge_contour(&mut self, peers: &[PeerSnapshot]) {
        let Some(contour) = self.air.world().contour() else {
            return;
        };
        if !self.operator.mission().traces() {
            return;
        }
        let uavs = peers.iter().filter(|m| m.uav);
        let tracer = |m: &PeerSnapshot| Tracer {
            uav: m.id,
            is_to: m.view.speaks && self.checker.rules.traces(m),
            says: m.view.traces,
            pictured: self.air.world().contour_pictured(m.id),
        };
        let all: Vec<Tracer> = uavs.map(tracer).collect();
        self.checker.on_tracers(self.now_ms, contour, &all);
        if self.checker.rules.contours.is_due(self.now_ms) {
            let ground = peers.iter().find(|m| !m.uav);
            if let Some(m) = ground.or_else(|| peers.first()) {
                let all: Vec<Stretch> = m.view.trails.iter().map(|(_, t)| t.stretch()).collect();
                let (rules, found) = (&mut self.checker.rules, &mut self.checker.found);
                rules
                    .contours
                    .on_told(self.now_ms, contour, (m.id, &all), found);
            }
        }
        self.account.traced(self.checker.rules.contours.report());
    }

    /// A UAV tells of an object of its own: the world knows whether it is there.
    pub(super) fn note_detection(&mut self, id: u16, report: &Report) {
        let Report::Detected { id: task, told } = report else {
            return;
        };
        let is_own = self
            .peer_idx(id)
            .is_some_and(|idx| self.peers[idx].config.id.0 == task.author);
        if !is_own {
            return;
        }
        self.air.advance(self.now_ms);
        let truth: Vec<Truth> = self.air.vehicles().truth().collect();
        let (rules, found) = (&mut self.checker.rules, &mut self.checker.found);
        let at = (self.now_ms, id);
        rules.detections.on_told(at, (*task, told), &truth, found);
    }

    /// A UAV looked: what it counts is judged beside what drives in its picture.
    pub(super) fn note_counts(&mut self, idx: usize) {
        let peer = &self.peers[idx];
        let is_running = peer.process == Process::Running;
        if self.checker.rules.counts.is_idle() || !is_running {
            return;
        }
        let id = peer.id();
        let world = self.air.world();
        let (Some(mind), Some(body)) = (&peer.peer, world.body(id)) else {
            return;
        };
        let counted: Vec<(bool, Count)> = mind.counted().collect();
        let look = CountLook {
            uav: id,
            picture: body.picture(),
            is_late: peer.slow_ms > 0,
            sees: &|at: Point| world.is_open_to(id, at),
            displaced_m: self.air.vehicles().displaced_m(id),
            counted: &counted,
        };
        let truth: Vec<Point> = self.air.vehicles().places().collect();
        let (rules, found) = (&mut self.checker.rules, &mut self.checker.found);
        rules.counts.on_look(self.now_ms, &truth, look, found);
    }

    /// A UAV looked: the middle of its picture is judged beside where it is planned.
    pub(super) fn note_footprint(&mut self, idx: usize) {
        let peer = &self.peers[idx];
        let id = peer.id();
        // A twin, or who is late, does not fly what it plans.
        let flies = peer.process == Process::Running
            && peer.slow_ms == 0
            && self.airframe_of(id) == id
            && self.air.world().commands(id);
        let Some(body) = self.air.world().body(id).filter(|_| flies) else {
            return;
        };
        let Some(footprint) = peer.peer.as_ref().and_then(|p| p.footprint()) else {
            return;
        };
        let (mount, bank_rad) = (&body.airframe().mount, body.airframe().max_bank_rad);
        let is_held = mount.holds_in_turns(bank_rad);
        let (rules, found) = (&mut self.checker.rules, &mut self.checker.found);
        let look = (self.now_ms, id);
        rules.footprint.on_look(
            look,
            footprint,
            (&body.picture(), body.height_m()),
            is_held,
            found,
        );
    }

    /// What the ground station knows of counts, beside what is true.
    pub(super) fn judge_counts(&mut self, peers: &[PeerSnapshot]) {
        if self.checker.rules.counts.is_idle() {
            return;
        }
        let newest = self.operator.mission().revision;
        let counts = |m: &&PeerSnapshot| {
            let view = &m.view;
            m.uav && view.speaks && view.revision >= newest && !view.finished
        };
        let able = peers.iter().filter(counts).map(|m| m.id).collect();
        self.checker.rules.counts.on_able(able);
        let watched_ms = |m: &PeerSnapshot| -> u64 {
            let all = m.view.counts.iter();
            all.map(|c| c.watched_ms).sum()
        };
        let ground = peers.iter().find(|m| !m.uav);
        let most = || peers.iter().max_by_key(|m| watched_ms(m));
        if let Some(knows) = ground.or_else(most) {
            let known = &knows.view.counts;
            let reports = self.checker.rules.counts.reports(self.now_ms, known);
            self.account.counted(reports);
        }
    }

    /// Whether somebody is to follow what a UAV saw.
    pub(super) fn is_following(&self, peers: &[PeerSnapshot]) -> bool {
        let uavs = peers.iter().filter(|m| m.uav);
        let mut open = uavs.flat_map(|m| &m.view.open_tasks);
        open.any(|(id, _)| {
            let is_uav = self.spec.uavs.iter().any(|u| u.id == id.author);
            is_uav || id.author == MISSION
        })
    }
}
