//! Services on the ground (D2.7 §3.7): what they are called to, and that they are there.
//!
//! | event | what follows |
//! |---|---|
//! | an object to be followed is told | the ground station has a call for it, with the place where it was seen last |
//! | its operator says that a task was done on the ground | it is done: who follows goes on with its own |
//! | who asked for it hears that | told in the task's next revision, so that who begins anew knows as well |
//! | the ground station begins another life | what its operator said to be done is said again |
//!
//! A ground station says so in a bundle without an offer, as a UAV says what it did: so nothing
//! has to be settled anew about whose word it is.

use super::{Known, Tasking};
use crate::effect::{Effect, Effects};
use crate::input::Time;
use crate::mission::mm;
use crate::wire::codec::Body;
use crate::wire::detection::DETECTIONS_MAX;
use crate::wire::tasks::{Bundle, DONE_MAX, DoneTask, Task, TaskId, TaskKind};
use serde::{Deserialize, Serialize};

/// What services on the ground are wanted for, as a ground station knows it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Call {
    /// The task to follow it.
    pub task: TaskId,
    /// In which revision that was asked for.
    pub revision: u32,
    /// What people call the task.
    pub name: String,
    /// What it looks like.
    pub looks: u8,
    /// Where it was seen last, mm east and north of the mission's origin.
    pub at_mm: (i32, i32),
}

impl Tasking {
    /// What services are wanted for: objects that are to be followed.
    pub fn calls(&self, now: Time) -> Vec<Call> {
        let open = self.known.iter();
        let open = open.filter(|(_, k)| k.is_open() && k.task.kind == TaskKind::Track);
        let call = |(id, k): (&TaskId, &Known)| {
            let told = self.detections.get(*id)?;
            let revision = k.task.revision_as_asked();
            let seen = self.targets.heard_at(now, (*id, revision));
            let at_mm = seen.map_or((told.east_mm, told.north_mm), |p| (mm(p.x), mm(p.y)));
            Some(Call {
                task: *id,
                revision,
                name: k.task.name(),
                looks: told.looks,
                at_mm,
            })
        };
        open.filter_map(call).collect()
    }

    /// Tasks of others that this peer's operator said to be done.
    pub fn said_done(&self) -> &[DoneTask] {
        &self.said_done
    }

    /// This peer's operator says that tasks were done on the ground. Of others' that is said in
    /// its bundle, its own will say so themselves.
    pub fn done_on_ground(&mut self, now: Time, tasks: &[TaskId]) -> Effects {
        let mut effects = Effects::new();
        for id in tasks {
            let asked = self.known.get(id).map(|k| k.task.revision_as_asked());
            let Some(revision) = asked else { continue };
            effects.extend(self.note_done(now, *id, revision, self.me));
            if id.author != self.me {
                self.say_done(DoneTask {
                    task: *id,
                    revision,
                });
            }
        }
        effects.extend(self.bundle_of_done());
        effects.push(Effect::Negotiate);
        effects
    }

    /// What was said to be done before this process began counts.
    pub fn was_said_done(&mut self, now: Time, done: &[DoneTask]) -> Effects {
        for d in done {
            self.say_done(*d);
            self.note_done(now, d.task, d.revision, self.me);
        }
        self.bundle_of_done().into_iter().collect()
    }

    /// One more, ascending; of more than a bundle holds those that are over go first.
    fn say_done(&mut self, done: DoneTask) {
        self.said_done.retain(|d| d.task != done.task);
        if self.said_done.len() >= DONE_MAX {
            let is_over = |d: &DoneTask| {
                let known = self.known.get(&d.task);
                known.is_none_or(|k| !k.task.is_open() || k.task.revision != d.revision)
            };
            let over = self.said_done.iter().position(is_over);
            self.said_done.remove(over.unwrap_or(0));
        }
        self.said_done.push(done);
        self.said_done.sort_unstable();
    }

    /// The word of this peer's operator, if there is one.
    pub(super) fn bundle_of_done(&self) -> Option<Effect> {
        let done = self.said_done.clone();
        (!done.is_empty()).then(|| {
            let bundle = Bundle {
                done,
                ..Bundle::default()
            };
            Effect::Speak(0, Body::Bundle(bundle))
        })
    }

    /// An object that this peer told of, and that is done with, is told to be so by its task.
    pub(super) fn tell_served(&mut self, now: Time) -> Effects {
        let served = self.own().filter(|(id, k)| {
            let is_object = id.number < DETECTIONS_MAX;
            is_object && k.is_newly_done()
        });
        let served: Vec<(TaskId, Task)> = served.map(|(id, k)| (*id, k.ended(now))).collect();
        let mut effects = Effects::new();
        for (id, task) in served {
            effects.extend(self.learn(now, id, task.clone()));
            effects.push(Effect::Speak(id.number, Body::Task(task)));
        }
        effects
    }
}
