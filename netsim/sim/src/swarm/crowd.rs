//! The people of a mass event as UAVs see and tell of them, beside where they are.

use super::Swarm;
use super::sim_peer::Process;
use crate::check::crowds::CrowdGlance;
use skein_geometry::frame::Point;
use skein_geometry::hash::folded;
use skein_geometry::random::mix;
use skein_peer::gathering::Sector;
use skein_peer::output::TaskNews;
use skein_peer::wire::tasks::{TaskId, TaskKind};
use skein_peer::{Peer, Report, Role};

/// What UAVs ask for has numbers from here on.
const UAVS: u16 = 1 << 15;

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
        if !people.looks_at(self.now_ms) {
            return;
        }
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
            looks: body.takes_off_in_ms(self.now_ms) == 0,
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

    /// A UAV asks for a look at what is too dense: the world looks whether that is taken.
    pub(super) fn note_look_asked(&mut self, id: u16, peer: &Peer, report: &Report) {
        let Report::Task {
            id: task,
            news: TaskNews::Asked,
            ..
        } = report
        else {
            return;
        };
        let is_own = self
            .peer_idx(id)
            .is_some_and(|idx| self.peers[idx].config.id.0 == task.author);
        if !is_own || self.checker.rules.crowds.is_idle() || peer.is_ground_station() {
            return;
        }
        let asked = peer.operators_tasks().asked.into_iter();
        let asked = asked.filter(|t| t.number == task.number && t.task.is_open());
        for asked in asked.filter(|t| t.task.kind == TaskKind::Pinpoint) {
            let pieces = self.operator.mission().pieces_of(&asked.task);
            let key = self.judged_as(*task, asked.task.revision_as_asked());
            let all = self.spec.uavs.iter().map(|u| u.id).collect();
            let since_ms = self.now_ms.saturating_sub(asked.age_ms);
            self.air.ask(key, pieces.unwrap_or_default(), all, since_ms);
        }
    }

    /// By which number and revision the world knows a task: the registers of UAVs have the numbers
    /// of those of operators.
    pub(super) fn judged_as(&self, task: TaskId, revision: u32) -> (u16, u32) {
        let is_uav = self.spec.uavs.iter().any(|u| u.id == task.author);
        if !is_uav {
            return (task.number, revision);
        }
        let all = u64::from(task.author) << 48 | u64::from(task.number) << 32 | u64::from(revision);
        (task.number | UAVS, folded(mix(all)))
    }

    /// What was told beside what was true, at the end.
    pub(super) fn conclude_crowd(&mut self) {
        let (rules, found) = (&mut self.checker.rules, &mut self.checker.found);
        rules.crowds.on_end(self.now_ms, found);
        let report = rules.crowds.report();
        self.account.gathered(report);
    }
}
