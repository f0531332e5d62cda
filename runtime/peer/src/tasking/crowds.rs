//! What follows where an event that a mission watches is too dense (D2.7 §3.1): people are told,
//! and where the mission says so somebody looks there again and again, by the auction, or stays
//! above it (`circles.rs`). Who is where is [`crate::gathering`]'s.
//!
//! | what holds | what follows |
//! |---|---|
//! | its mission watches an event, and is not over for it | each look counts |
//! | a sector is too dense, this UAV saw it last, and that was so long ago as the mission says | a task of this peer to look at it |
//! | that task is open, and the sector has eased, or somebody stays above it | cancelled |
//! | the mission is over or cancelled | likewise; what was seen is told |
//!
//! Whoever looked last asks, so where it is lost the next one to fly past goes on asking.

use super::{Known, Tasking};
use crate::Mission;
use crate::cooperation::Situation;
use crate::crowd::{CrowdWatch, ThenWatch};
use crate::effect::{Effect, Effects};
use crate::gathering::{Crowd, Sector};
use crate::mission_state::MissionState;
use crate::wire::codec::Body;
use crate::wire::detection::DETECTIONS_MAX;
use crate::wire::tasks::{TASKS_MAX, Task, TaskId, TaskKind, TaskPlace};
use skein_behaviors::Percept;
use std::sync::Arc;

/// Registers of tasks below this are those of detections.
const FIRST: u16 = DETECTIONS_MAX;

/// A task that is asked for so often is of so much higher a revision in each life.
const A_LIFE: u32 = 1 << 12;

impl Tasking {
    /// A look at the event.
    pub(super) fn gather(&mut self, percept: &Percept, state: &MissionState) {
        let mission = &state.geometry.mission;
        self.gathering.follow(mission);
        if let Some(airframe) = self.flies {
            let looks = !mission.cancelled && !state.silent && !state.stage.ended();
            self.gathering.look(percept, &airframe, looks);
            self.circles.height_m = percept.height_m;
        }
    }

    /// Tells what is to be told of the event: of a ground station what nobody else does.
    pub(super) fn tell_of_event(&mut self, s: &Situation<'_>, state: &MissionState) -> Effects {
        self.gathering.follow(&state.geometry.mission);
        if !s.speaks || state.geometry.mission.crowd.is_none() {
            return Effects::new();
        }
        let (mut uavs, mut rank) = (1, 0);
        for id in s.membership.live_uavs() {
            uavs += 1;
            rank += u64::from(id < self.me || self.flies.is_none());
        }
        let air = (s.membership.interval_ms(), uavs, rank);
        self.gathering.tell(s.now, air, looks_at(state))
    }

    /// Tells of the event, and asks for looks at it.
    pub(super) fn watch_event(&mut self, s: &Situation<'_>, state: &MissionState) -> Effects {
        let mut effects = self.tell_of_event(s, state);
        if !s.speaks {
            return effects;
        }
        let (mission, looks) = (Arc::clone(&state.geometry.mission), looks_at(state));
        effects.extend(self.derive_circles(s, state));
        effects.extend(self.leave_eased(s, &mission, looks));
        if let Some(watch) = mission.crowd.as_ref().filter(|_| looks) {
            effects.extend(self.ask_for_looks(s, &mission, watch));
        }
        effects.retain(|e| !matches!(e, Effect::Negotiate));
        effects
    }

    /// Own looks that are asked for where it has eased are wanted no more.
    fn leave_eased(&mut self, s: &Situation<'_>, mission: &Mission, looks: bool) -> Effects {
        let circled = self.circled(s, mission);
        let dense = self.gathering.dense().map(|(n, _)| n);
        let dense: Vec<u16> = dense
            .filter(|n| !circled.contains(n))
            .map(register)
            .collect();
        let own = self.known.iter().filter(|(id, k)| {
            let is_look = (FIRST..TASKS_MAX).contains(&id.number);
            id.author == self.me && is_look && k.is_open()
        });
        let over = own.filter(|(id, _)| !looks || !dense.contains(&id.number));
        let over: Vec<(TaskId, u32)> = over.map(|(id, k)| (*id, k.task.revision)).collect();
        let each = over
            .into_iter()
            .map(|(id, revision)| self.take_back(s.now, id, revision + 1));
        each.flatten().collect()
    }

    fn ask_for_looks(
        &mut self,
        s: &Situation<'_>,
        mission: &Arc<Mission>,
        watch: &CrowdWatch,
    ) -> Effects {
        let mut effects = Effects::new();
        if watch.then == ThenWatch::Notify {
            return effects;
        }
        let circled = self.circled(s, mission);
        let every_ms = 1_000 * u64::from(watch.look_every_s);
        let now_ms = self.gathering.last_ms();
        let is_due = |(sector, _): &(u16, Sector)| {
            let last = self.gathering.seen_last(*sector);
            last.is_some_and(|look| look.by == self.me && look.seen_ms + every_ms <= now_ms)
        };
        let due = self.gathering.dense().filter(is_due);
        let due: Vec<(u16, Sector)> = due.filter(|(n, _)| !circled.contains(n)).collect();
        for (sector, _) in due {
            let id = TaskId {
                author: self.me,
                number: register(sector),
            };
            let held = self.known.get(&id);
            if held.is_some_and(Known::is_open) {
                continue;
            }
            let least = s.me.incarnation.saturating_mul(A_LIFE).max(1);
            let before = held.map_or(0, |k| k.task.revision.saturating_add(2));
            let Some(task) = look_at(watch, sector, before.max(least)) else {
                continue;
            };
            if mission.can_do(&task).is_ok() {
                effects.extend(self.learn(s.now, id, task.clone()));
                effects.push(Effect::Speak(id.number, Body::Task(task)));
            }
        }
        effects
    }

    /// What all together saw of the event of a mission, as far as is known here.
    pub fn crowd(&self, mission: &Mission) -> Option<Crowd> {
        self.gathering.crowd(mission)
    }

    /// What this UAV saw of the event itself in this life, by sector.
    pub fn own_crowd(&self) -> impl Iterator<Item = (u16, Sector)> {
        self.gathering.own()
    }
}

/// Whether looks at the event count.
pub(super) fn looks_at(state: &MissionState) -> bool {
    !state.geometry.mission.cancelled && !state.stage.ended()
}

/// In which register of its author a look at a sector is asked for.
fn register(sector: u16) -> u16 {
    FIRST + sector % (TASKS_MAX - FIRST)
}

/// The task to look at a sector.
fn look_at(watch: &CrowdWatch, sector: u16, revision: u32) -> Option<Task> {
    let (east_mm, north_mm) = watch.middle_mm(sector)?;
    Some(Task {
        revision,
        kind: TaskKind::Pinpoint,
        places: vec![TaskPlace { east_mm, north_mm }],
        worth: watch.worth,
        radius_mm: 500 * u32::from(watch.sector_m),
        within_ms: 2_000 * u32::from(watch.look_every_s),
        name: format!("crowd-{sector}").into_bytes(),
        ..Task::default()
    })
}
