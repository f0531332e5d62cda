//! What follows when a peer's own camera sees what its mission looks for (D2.7 §1.2.3, §3.7):
//! it is told once, and where its criterion says so a task to follow it is asked for. The
//! auction gives that out as it gives all others. What is one object is [`crate::detections`]'s.
//!
//! | event | what follows |
//! |---|---|
//! | something was watched for long enough, fits a criterion and is not told yet | told: to all and to people |
//! | and its criterion says follow, and it can be flown after | a task of this peer to follow it, for so long |
//! | a detection of another | told to people |
//! | a later life of who told it is heard, and it is still followed | both are void: nobody passes on what an earlier life said; who sees it tells it anew |
//! | an own one is the object of an earlier one | withdrawn, and its task cancelled |
//! | who is followed for a task is followed by another for one that goes before | the later task is done |
//! | the mission is cancelled, or begun anew | own tasks of it are cancelled |
//!
//! A mission that looks for nothing says nothing of all this.

use super::{Known, Tasking};
use crate::cooperation::Situation;
use crate::criteria::{Criterion, Then, looks_name};
use crate::detections::{Place, Seen};
use crate::effect::{Effect, Effects};
use crate::input::Time;
use crate::mission_state::MissionState;
use crate::output::{Report, TaskNews};
use crate::protocol::auction::Event;
use crate::targets::PLACE_M;
use crate::wire::codec::Body;
use crate::wire::detection::Detection;
use crate::wire::message::Record;
use crate::wire::tasks::{Progress, Task, TaskId, TaskKind, TaskPlace, TaskState};

impl Tasking {
    /// A detection of another peer.
    pub(super) fn hear_detection(&mut self, record: &Record, told: &Detection) -> Effects {
        let id = TaskId {
            author: record.author,
            number: record.subject,
        };
        if !self.detections.hear(id, *told, record.incarnation) {
            return Effects::new();
        }
        vec![Effect::Report(Report::Detected { id, told: *told })]
    }

    /// Where the target of an open task is, as far as somebody who saw it says.
    fn followed(&self, id: TaskId) -> Option<Place> {
        let known = self.known.get(&id).filter(|k| k.is_open())?;
        if known.task.kind != TaskKind::Track {
            return None;
        }
        let sought = (id, known.task.revision_as_asked());
        let followed = self.targets.known(sought)?;
        Some(Place {
            at: followed.motion.position,
            unseen_s: followed.unseen_s,
        })
    }

    /// Looks at what its camera saw, and at what was told before.
    pub(super) fn detect(&mut self, s: &Situation<'_>, state: &mut MissionState) -> Effects {
        let geometry = std::sync::Arc::clone(&state.geometry);
        let mission = &geometry.mission;
        let mut effects = Effects::new();
        if mission.detections.is_empty() && self.detections.known().next().is_none() {
            return effects;
        }
        self.date_tasks(s.now);
        effects.extend(self.void_former(s));
        effects.extend(self.drop_old(s.now, (mission.sortie, mission.cancelled)));
        if mission.cancelled {
            return effects;
        }
        let mut detections = core::mem::take(&mut self.detections);
        let withdrawn = detections.withdraw(self.me, &|id| self.followed(id));
        self.detections = detections;
        for (id, told) in withdrawn {
            effects.extend(self.say_detection(id, told));
            effects.extend(self.cancel(s.now, id));
        }
        effects.extend(self.finish_double(s.now, state));
        let (tracks, now_ms) = self.targets.tracks();
        let seen: Vec<Seen> = self.detections.seen(now_ms, tracks, PLACE_M).collect();
        for seen in seen {
            effects.extend(self.tell_of(s, &seen, mission));
        }
        effects
    }

    /// What an earlier life of somebody told and is still followed is void: that one knows nothing
    /// of it, so it would never be settled among all.
    pub(super) fn void_former(&mut self, s: &Situation<'_>) -> Effects {
        let life_of = |author: u16| {
            if author == s.me.id {
                return Some(s.me.incarnation);
            }
            let mut all = s.membership.all();
            all.find(|(id, ..)| *id == author).map(|(_, life, _)| life)
        };
        let former = self.detections.former(&life_of).into_iter();
        let open: Vec<TaskId> = former
            .filter(|id| self.known.get(id).is_some_and(Known::is_open))
            .collect();
        let mut effects = Effects::new();
        for id in open {
            self.detections.void(id);
            if let Some(known) = self.known.get(&id) {
                let (since, mut task) = (known.since, known.task.clone());
                task.state = TaskState::Cancelled;
                effects.extend(self.learn(s.now, id, task));
                self.was_asked(id, since);
            }
        }
        effects
    }

    /// Tells of what was seen, if that is asked for and news.
    fn tell_of(
        &mut self,
        s: &Situation<'_>,
        seen: &Seen,
        mission: &std::sync::Arc<crate::Mission>,
    ) -> Effects {
        let speed_mmps = seen.speed_mmps();
        let criteria = (0_u8..).zip(&mission.detections);
        let fitting = criteria.filter(|(_, c)| c.fits(seen.looks, speed_mmps));
        let Some((nth, criterion)) = fitting.into_iter().next() else {
            return Effects::new();
        };
        let followed = |id: TaskId| self.followed(id);
        let sortie = mission.sortie;
        let is_followed = || {
            let open = self.known.iter().filter(|(_, k)| k.is_open());
            let mut places = open.filter_map(|(id, _)| self.followed(*id));
            places.any(|p| seen.is_at(p))
        };
        let is_full = self.detections.count(sortie, nth) >= usize::from(criterion.at_most);
        if is_full || self.detections.is_told(sortie, seen, &followed) || is_followed() {
            return Effects::new();
        }
        let Some((id, told)) = self.detections.tell(self.me, (sortie, nth), seen) else {
            return Effects::new();
        };
        let mut effects = self.say_detection(id, told);
        if criterion.then == Then::Follow {
            let task = task_of(id, &told, criterion, s.me.incarnation);
            // What cannot be flown after is told alone.
            if mission.can_do(&task).is_ok() {
                effects.extend(self.learn(s.now, id, task.clone()));
                effects.push(Effect::Speak(id.number, Body::Task(task)));
            }
        }
        effects
    }

    fn say_detection(&self, id: TaskId, told: Detection) -> Effects {
        vec![
            Effect::Report(Report::Detected { id, told }),
            Effect::Speak(id.number, Body::Detection(told)),
        ]
    }

    /// A task of this peer's own is wanted no more, if it was.
    fn cancel(&mut self, now: Time, id: TaskId) -> Effects {
        let open = self.known.get(&id).filter(|k| k.is_open());
        match open.map(|k| k.task.revision) {
            Some(revision) => self.take_back(now, id, revision),
            None => Effects::new(),
        }
    }

    /// Own tasks of an earlier sortie, or of a mission that is cancelled, are wanted no more.
    fn drop_old(&mut self, now: Time, (sortie, cancelled): (u16, bool)) -> Effects {
        let own = self.detections.known().filter(|(id, _)| {
            let is_open = self.known.get(id).is_some_and(Known::is_open);
            id.author == self.me && is_open
        });
        let old = own.filter(|(_, d)| d.sortie != sortie || cancelled);
        let old: Vec<TaskId> = old.map(|(id, _)| id).collect();
        old.into_iter()
            .flat_map(|id| self.cancel(now, id))
            .collect()
    }

    /// Tasks count from when their objects were seen, by the clock of percepts: so they end at one
    /// time for all, also for who hears of them late or again.
    fn date_tasks(&mut self, now: Time) {
        let (_, now_ms) = self.targets.tracks();
        if now_ms == 0 {
            return;
        }
        for (id, d) in self.detections.known() {
            if let Some(known) = self.known.get_mut(&id) {
                known.since = Time(now.0.saturating_sub(now_ms.saturating_sub(d.seen_ms)));
            }
        }
    }

    /// Whom it follows another follows for a task that goes before: then this one is done.
    fn finish_double(&mut self, now: Time, state: &mut MissionState) -> Effects {
        let Some((id, _)) = self.sought() else {
            return Effects::new();
        };
        if self.detections.get(id).is_none() {
            return Effects::new();
        }
        let Some(mine) = self.followed(id) else {
            return Effects::new();
        };
        let is_begun = |other: TaskId| {
            let all = self.bundles.values().flat_map(|(_, b)| &b.tasks);
            all.into_iter()
                .any(|t| t.task == other && t.progress == Progress::Begun)
        };
        let is_it = |(other, _): &(&TaskId, &Known)| {
            let theirs = self.followed(**other);
            **other != id
                && self.detections.goes_before(**other, id)
                && theirs.is_some_and(|p| p.is_one_with(mine))
                && is_begun(**other)
        };
        let open = self.known.iter().filter(|(_, k)| k.is_open());
        if open.into_iter().find(is_it).is_none() {
            return Effects::new();
        }
        self.leave(Some(state));
        if let Some(known) = self.known.get_mut(&id) {
            known.done = Some((self.me, now));
        }
        let mut effects: Effects = self.told(id, TaskNews::Left).into_iter().collect();
        effects.extend(self.handle(vec![Event::Finished(id)], state));
        effects
    }

    /// What is known of objects that the mission looks for, a sentence each.
    pub fn detections_told(&self) -> Vec<String> {
        let all = self.detections.known();
        all.map(|(id, d)| d.sentence(id.author)).collect()
    }
}

/// The task to follow an object that was told.
fn task_of(id: TaskId, told: &Detection, criterion: &Criterion, life: u32) -> Task {
    Task {
        // Where a register is used again the later life counts.
        revision: life.max(1),
        kind: TaskKind::Track,
        places: vec![TaskPlace {
            east_mm: told.east_mm,
            north_mm: told.north_mm,
        }],
        worth: criterion.worth,
        radius_mm: criterion.stand_off_mm,
        within_ms: criterion.for_ms,
        name: format!(
            "{}-{}.{}",
            looks_name(told.looks).replace(' ', "-"),
            id.author,
            id.number
        )
        .into_bytes(),
        ..Task::default()
    }
}
