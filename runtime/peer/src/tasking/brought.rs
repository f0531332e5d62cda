//! Tasks that a mission itself brings: they begin with it, and end with it (D2.7 §1.2.3, §3.7).
//!
//! | what holds | the task |
//! |---|---|
//! | the mission is flown | open: known to everybody who follows it, and never said |
//! | its time is over, it was cancelled, or begun anew | cancelled |
//!
//! They go before the cells of the mission: a UAV alone does them first.

use super::Tasking;
use crate::effect::Effects;
use crate::input::{AskedTask, NewTask, Time};
use crate::mission::Mission;
use crate::wire::tasks::{TASKS_MAX, Task, TaskId, TaskState};
use skein_geometry::hash::Fnv;

/// Who asks for what a mission brings: nobody has this number.
pub const MISSION: u16 = u16::MAX;

/// Most tasks that a mission brings.
pub const BROUGHT_MAX: usize = 8;

/// Numbers from here on are those of circles, by the sector above which they are flown.
pub(super) const CIRCLES_FROM: u16 = TASKS_MAX + BROUGHT_MAX as u16;

/// Whether it is a task that a mission brings.
pub(super) fn is_brought(id: TaskId) -> bool {
    id.author == MISSION && id.number < CIRCLES_FROM
}

impl Mission {
    /// The tasks that it brings, by the numbers by which they are known; `over` once nobody wants
    /// them any more. What cannot be said is left out.
    #[must_use]
    pub fn brought(&self, over: bool) -> Vec<AskedTask> {
        // Registers that are spoken have lower numbers.
        let all = (TASKS_MAX..).zip(&self.tasks);
        let revision = u32::from(self.sortie) + 1;
        let one = |(number, new): (u16, &NewTask)| {
            let task = new.asked(number, revision).ok()?;
            let state = if over || self.cancelled {
                TaskState::Cancelled
            } else {
                TaskState::Open
            };
            Some(AskedTask {
                number,
                task: Task { state, ..task },
                age_ms: 0,
            })
        };
        all.filter_map(one).collect()
    }

    /// Folds them into its hash.
    pub(crate) fn hash_brought(&self, h: &mut Fnv) {
        if self.tasks.is_empty() {
            return;
        }
        h.write_i64(-6);
        for asked in self.brought(false) {
            let t = asked.task;
            h.write_i64(t.kind as i64);
            h.write_i64(i64::try_from(t.places.len()).unwrap_or(i64::MAX));
            for p in &t.places {
                h.write_i64(i64::from(p.east_mm));
                h.write_i64(i64::from(p.north_mm));
            }
            h.write_i64(i64::from(t.sensor));
            h.write_i64(i64::from(t.worth));
            h.write_i64(i64::from(t.radius_mm));
            h.write_i64(i64::from(t.within_ms));
            h.write_i64(i64::try_from(t.name.len()).unwrap_or(i64::MAX));
            t.name.iter().for_each(|b| h.write_i64(i64::from(*b)));
        }
    }
}

impl Tasking {
    /// Knows of what the mission brings, as it stands.
    pub(super) fn take_brought(&mut self, now: Time, mission: &Mission, over: bool) -> Effects {
        let mut effects = Effects::new();
        for AskedTask { number, task, .. } in mission.brought(over) {
            let id = TaskId {
                author: MISSION,
                number,
            };
            let held = self.known.get(&id);
            let since = held
                .filter(|k| k.task.revision == task.revision)
                .map(|k| k.since);
            // That its time is over nobody takes back.
            if held.is_some_and(|k| k.task.revision == task.revision && !k.task.is_open()) {
                continue;
            }
            effects.extend(self.learn(now, id, task));
            if let Some(since) = since {
                self.was_asked(id, since);
            }
        }
        // What another mission brought is over.
        let known = self.known.iter().filter(|(id, k)| {
            let is_old = usize::from(id.number - TASKS_MAX.min(id.number)) >= mission.tasks.len();
            is_brought(**id) && is_old && k.task.is_open()
        });
        let old: Vec<(TaskId, Task)> = known.map(|(id, k)| (*id, k.task.clone())).collect();
        for (id, task) in old {
            let task = Task {
                state: TaskState::Cancelled,
                ..task
            };
            effects.extend(self.learn(now, id, task));
        }
        effects
    }
}
