//! What each fault does to a simulated swarm. A fault that does not fit the state of
//! its peer (restarting one that runs) changes nothing.

use super::sim_peer::{Clock, Process, SimPeer};
use super::{Event, Kind, Phase, Swarm, What};
use crate::account::Cause;
use crate::check::record::Said;
use crate::disk::Trouble;
use crate::fault::Fault;
use crate::world::Survey;
use skein_peer::input::{Command, TaskEdit};
use skein_peer::{Beliefs, Input, Mission, Role, Transmission};
use std::sync::Arc;

/// The number of a radio that belongs to nobody.
const OUTSIDER: u16 = u16::MAX;

/// After so many wrong bits a record that can still be read is let be.
const MOST_FLIPS: u32 = 64;

impl Swarm {
    /// Applies a fault now.
    pub fn strike(&mut self, fault: &Fault) {
        let fault = &self.with_twins_aside(fault);
        self.history
            .keep(self.now_ms, || What::Fault(fault.clone()));
        self.air.advance(self.now_ms);
        self.air.strike(fault);
        self.checker.on_fault(self.now_ms, fault);
        let subject = match fault {
            Fault::Kill { peer } => self.end(*peer, Cause::Killed),
            Fault::KillComputer { peer } => self.end(*peer, Cause::ComputerKilled),
            Fault::Terminate { peer } => self.end(*peer, Cause::Terminated),
            Fault::Pause { peer } => {
                self.pause(*peer);
                *peer
            }
            Fault::Resume { peer } => {
                self.resume(*peer);
                *peer
            }
            Fault::Restart { peer, fresh_disk } => {
                if let Some(idx) = self.peer_idx(*peer)
                    && self.peers[idx].process == Process::Stopped
                {
                    self.boot(idx, true, *fresh_disk);
                }
                *peer
            }
            Fault::Cut { a, .. } => *a,
            Fault::Partition { groups } => {
                let named = groups.iter().enumerate();
                self.sides = named
                    .flat_map(|(i, g)| g.iter().map(move |p| (*p, i)))
                    .collect();
                self.checker.on_partition(true, |_| 0);
                0
            }
            Fault::Heal => {
                let sides = std::mem::take(&mut self.sides);
                self.checker
                    .on_partition(false, |id| sides.get(&id).copied().unwrap_or(usize::MAX));
                0
            }
            Fault::Rebase { east_mm, north_mm } => {
                let base = (*east_mm, *north_mm);
                let before = (**self.operator.mission()).clone();
                let next = self.next_mission(Mission { base, ..before });
                // A console refuses one that nobody can fly to.
                let geometry = self.geometry_cache.of(&next);
                // Nor does anybody make a base of where a crane stands.
                let room_m = next.clearance_m() + 2.0 * next.turn_radius_m();
                let unmapped = self.air.world().unmapped();
                let stands_free = unmapped.is_clear(next.base_m(), room_m);
                if stands_free && geometry.is_ok_and(|g| g.base_is_clear().is_ok()) {
                    self.revise(next);
                }
                0
            }
            Fault::Revise { area, zones, task } => {
                let before = (**self.operator.mission()).clone();
                self.give_mission(Mission {
                    area: area.clone(),
                    zones: zones.clone(),
                    task: task.clone().unwrap_or_else(|| before.task.clone()),
                    ..before
                });
                0
            }
            Fault::AddZone { name, ring } => {
                let zoned = self.operator.mission().with_zone(name, ring);
                // The reader of a scenario refuses what cannot be done.
                zoned.into_iter().for_each(|next| self.give_mission(next));
                0
            }
            Fault::RemoveZone { name } => {
                let freed = self.operator.mission().without_zone(name);
                freed.into_iter().for_each(|next| self.give_mission(next));
                0
            }
            Fault::AddTask { task } => {
                self.edit_task(TaskEdit::Add(task.clone()));
                0
            }
            Fault::CancelTask { name } => {
                self.edit_task(TaskEdit::Cancel(name.clone()));
                0
            }
            Fault::DoneTask { name } => {
                self.edit_task(TaskEdit::Done(name.clone()));
                0
            }
            Fault::Order { order, uav } => {
                self.operator.order(*uav, *order);
                self.checker.rules.on_order(*order);
                self.repeat_order();
                uav.unwrap_or(0)
            }
            Fault::FailStores { peer, one_in } => self.trouble(*peer, Trouble::Fails(*one_in)),
            Fault::SlowStores { peer, delay_ms } => self.trouble(*peer, Trouble::Slow(*delay_ms)),
            Fault::HealStores { peer } => self.trouble(*peer, Trouble::None),
            Fault::SlowComputer { peer, delay_ms } => {
                self.slow(*peer, u64::from(*delay_ms));
                *peer
            }
            Fault::ClockDrift { peer, ppm } => {
                let now_ms = self.now_ms;
                self.set_clock(*peer, |clock| clock.drift(now_ms, *ppm))
            }
            Fault::ClockJump { peer, ahead_ms } => {
                let now_ms = self.now_ms;
                self.set_clock(*peer, |clock| clock.jump(now_ms, u64::from(*ahead_ms)))
            }
            Fault::ShortFuel { peer, lasts_ms } => {
                self.air.limit_fuel(*peer, u64::from(*lasts_ms));
                self.note_short_fuel(*peer, u64::from(*lasts_ms));
                *peer
            }
            Fault::SpoiltRecord { peer } => self.send_spoilt(*peer),
            Fault::Twin { peer, aboard } => {
                self.switch_on_twin(*peer, *aboard);
                *peer
            }
            Fault::Loss { permille } => {
                self.loss_max_permille = self.loss_max_permille.max(*permille);
                *permille
            }
        };
        self.history.fold(self.now_ms, subject, Kind::Fault, 0);
        self.observe_graph();
    }

    /// The operator says something about tasks, as soon as the ground station speaks.
    fn edit_task(&mut self, edit: TaskEdit) {
        self.operator.wants(edit);
        self.speak_tasks();
    }

    /// What is in an airframe can work until its battery has nothing but the reserve.
    fn note_short_fuel(&mut self, peer: u16, lasts_ms: u64) {
        let uav = self.spec.uavs.iter().find(|u| u.id == peer);
        let reserve_s = uav.map_or(0.0, |u| u.airframe.reserve_s);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "casts from floats saturate, and a reserve is not negative"
        )]
        let reserve_ms = (reserve_s * 1000.0) as u64;
        let until_ms = self.now_ms + lasts_ms.saturating_sub(reserve_ms);
        for id in self.peers.iter().map(SimPeer::id) {
            if self.airframe_of(id) == peer {
                self.account.limited(id, until_ms);
            }
        }
    }

    /// A program is started in an airframe only where that is in the air.
    fn switch_on_twin(&mut self, peer: u16, aboard: bool) {
        let of = |s: &SimPeer| {
            let is_aboard = self.airframe_of(s.id()) == peer;
            s.is_twin() && s.config.id.0 == peer && s.boots == 0 && is_aboard == aboard
        };
        let twin = self.peers.iter().position(of);
        let there = !aboard || self.air.percept(peer).is_some();
        if let Some(idx) = twin.filter(|_| there) {
            self.boot(idx, false, false);
        }
    }

    /// A twin that a partition does not name is where its airframe is; or, in one of its own,
    /// in one of the groups or in none, by the time at which it begins.
    fn with_twins_aside(&self, fault: &Fault) -> Fault {
        let mut fault = fault.clone();
        if let Fault::Partition { groups } = &mut fault {
            for twin in self.peers.iter().filter(|s| s.is_twin()) {
                let aside = self.now_ms % (groups.len() as u64 + 1);
                let named = groups.iter().any(|g| g.contains(&twin.id()));
                let host = self.airframe_of(twin.id());
                let drawn = usize::try_from(aside).ok();
                let hosted =
                    (host != twin.id()).then(|| groups.iter().position(|g| g.contains(&host)));
                let group = hosted.unwrap_or(drawn).and_then(|i| groups.get_mut(i));
                if let Some(group) = group.filter(|_| !named) {
                    group.push(twin.id());
                }
            }
        }
        fault
    }

    /// Starts a process, with a new airframe where the old one is gone.
    pub(super) fn boot(&mut self, idx: usize, again: bool, fresh: bool) {
        let now_ms = self.now_ms;
        let s = &mut self.peers[idx];
        if fresh {
            s.disk.erase();
        }
        let uav = s.config.role == Role::Uav;
        if uav {
            s.airframe = true;
            self.air.start(s.id());
        }
        let start = s.start(now_ms);
        let (id, boot) = (s.id(), s.boots);
        self.history.fold(now_ms, id, Kind::Boot, u64::from(boot));
        self.checker.on_boot(now_ms, id, again, fresh);
        if again {
            self.account.restarted(now_ms, id, fresh);
        } else {
            self.account.started(now_ms, id);
        }
        self.feed(idx, start);
        if uav {
            let first_ms = self.first_percept_ms(idx);
            self.queue
                .push(first_ms, Phase::Sense, Event::Percept { idx, boot });
        }
    }

    fn end(&mut self, peer: u16, cause: Cause) -> u16 {
        if let Some(idx) = self.peer_idx(peer) {
            self.end_process(idx, cause);
        }
        peer
    }

    /// The process ends, and the airframe with it or not, and then all that is in it.
    fn end_process(&mut self, idx: usize, cause: Cause) {
        let airframe = self.airframe_of(self.peers[idx].id());
        let all = 0..self.peers.len();
        let (own, others): (Vec<usize>, Vec<usize>) = all
            .filter(|i| {
                *i == idx
                    || cause.takes_airframe() && self.airframe_of(self.peers[*i].id()) == airframe
            })
            .partition(|i| *i == idx);
        for i in own.into_iter().chain(others) {
            self.end_one(i, cause);
        }
    }

    fn end_one(&mut self, idx: usize, cause: Cause) {
        let (now_ms, airframe) = (self.now_ms, cause.takes_airframe());
        let s = &mut self.peers[idx];
        let id = s.id();
        s.airframe &= !airframe;
        self.air.stop(id, airframe);
        if s.process == Process::Stopped {
            return;
        }
        let untold = s.untold_writes();
        if let Some(peer) = s.stop() {
            let kept = (&peer.durable(), self.peers[idx].disk.records(), untold);
            self.checker.on_crash(now_ms, id, kept);
        }
        self.refresh_covered();
        let held = self.account.ended(now_ms, id, cause);
        self.checker.on_silent(now_ms, id, true, held.second_hand);
    }

    /// The world took the airframe: out of fuel, or flown into something.
    pub(super) fn airframe_lost(&mut self, idx: usize) {
        self.end_process(idx, Cause::Lost);
        self.observe_graph();
    }

    /// What the operator says at the ground station; where that is down, of what was given last.
    fn next_mission(&self, mission: Mission) -> Arc<Mission> {
        let ground = self.ground_station().map(|idx| &self.peers[idx]);
        let held = ground.and_then(|s| s.peer.as_ref()?.mission());
        self.operator.next(mission, held.map(|m| m.revision))
    }

    /// The operator gives another mission. A console refuses one that cannot be flown; no
    /// operator wants one of which the planner leaves out what could be seen.
    fn give_mission(&mut self, mission: Mission) {
        let next = self.next_mission(mission);
        let survey = Survey::of_mission(&self.spec, &next);
        let (Ok(geometry), Ok(survey)) = (self.geometry_cache.of(&next), survey) else {
            return;
        };
        let enough = survey.coverable_share() >= self.spec.min_coverable;
        let flown = enough && geometry.base_is_clear().is_ok();
        if flown && survey.left_out(&geometry).is_empty() {
            self.air.revise(Arc::new(survey), &geometry);
            self.account.revised();
            self.revise(next);
        }
    }

    /// The operator's next revision enters at the ground station.
    fn revise(&mut self, next: Arc<Mission>) {
        self.operator.give(Arc::clone(&next));
        self.ask_for_what_is_left();
        self.checker.rules.on_mission(&next);
        if let Some(idx) = self.ground_station() {
            // What the operator said last is what the next life begins with.
            self.peers[idx].config.mission = Some(Arc::clone(&next));
            self.feed(idx, Input::Command(Command::Mission(next)));
        }
    }

    /// A peer is sent the last record on the air with bits wrong, so that nobody can read
    /// it: it is refused and changes nothing. (What can be read is no worse than any record,
    /// as long as nobody signs.)
    fn send_spoilt(&mut self, id: u16) -> u16 {
        let running = |idx: &usize| {
            let s = &self.peers[*idx];
            s.process == Process::Running && s.slow_ms == 0
        };
        let Some(idx) = self.peer_idx(id).filter(running) else {
            return id;
        };
        let mut bytes = self.last_said.clone();
        let last = (bytes.len() as u64).saturating_sub(1);
        for _ in 0..MOST_FLIPS {
            let at = usize::try_from(self.outsider.between(0, last)).unwrap_or(0);
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << self.outsider.between(0, 7);
            }
            if Said::read(&bytes).is_none() {
                break;
            }
        }
        if bytes.is_empty() || Said::read(&bytes).is_some() {
            return id;
        }
        let believes = |swarm: &Self| {
            let view = swarm.view(id);
            // What depends on time alone, and on what was heard before, is left out.
            view.map(|v| Beliefs {
                loads: Vec::new(),
                diameter: 0,
                interval_ms: 0,
                unheard: 0,
                speaks: false,
                ..v
            })
        };
        // What is due now follows from the time, not from the bytes.
        self.feed(idx, Input::Timer);
        let before = believes(self);
        self.spoilt = true;
        let input = Input::Received {
            transmitter: OUTSIDER,
            hops: 0,
            heard: Transmission::read(bytes).into(),
        };
        self.feed(idx, input);
        let taken = std::mem::take(&mut self.spoilt);
        if taken || before != believes(self) {
            let found = &mut self.checker.found;
            found.broken("S8", self.now_ms, Some(id), || {
                "took bytes that nobody can read".to_owned()
            });
        }
        id
    }

    fn trouble(&mut self, peer: u16, trouble: Trouble) -> u16 {
        if let Some(idx) = self.peer_idx(peer) {
            self.peers[idx].disk.set_trouble(trouble);
        }
        peer
    }

    /// A computer that becomes quicker gets round to what waits at once.
    fn slow(&mut self, peer: u16, slow_ms: u64) {
        if let Some(idx) = self.peer_idx(peer) {
            let quicker = slow_ms < self.peers[idx].slow_ms;
            self.peers[idx].slow_ms = slow_ms;
            if quicker && self.peers[idx].process == Process::Running {
                self.catch_up(idx);
            }
        }
    }

    /// The peer asks for its next timer anew: it comes at another time now.
    fn set_clock(&mut self, peer: u16, change: impl FnOnce(&mut Clock)) -> u16 {
        if let Some(idx) = self.peer_idx(peer) {
            change(&mut self.peers[idx].clock);
            if self.peers[idx].process == Process::Running {
                self.schedule_timer(idx);
            }
        }
        peer
    }

    fn pause(&mut self, id: u16) {
        if let Some(idx) = self.peer_idx(id)
            && self.peers[idx].process == Process::Running
        {
            self.peers[idx].stand_still();
            self.account.paused(self.now_ms, id);
            self.checker.on_silent(self.now_ms, id, false, false);
        }
    }

    /// What waited is handled at once, in order; what the peer says to it comes late.
    fn resume(&mut self, id: u16) {
        let Some(idx) = self.peer_idx(id) else {
            return;
        };
        let s = &mut self.peers[idx];
        if s.process != Process::Paused {
            return;
        }
        let now_ms = self.now_ms;
        s.process = Process::Running;
        s.since_ms = now_ms;
        s.timer_ms = None;
        let waiting: Vec<(u64, Input)> = s.inbox.drain(..).collect();
        if !self.peers[idx].silent {
            self.account.resumed(now_ms, id);
            self.checker.on_resume(id);
        }
        for (arrived_ms, input) in waiting {
            if self.peers[idx].slow_ms == 0 {
                self.hear_late(idx, arrived_ms, &input);
            }
            self.feed_arrived(idx, arrived_ms, input);
        }
        self.feed(idx, Input::Timer);
    }
}
