//! Where tasks are asked for, and what people are told of them (D2.7 §1.2.2): an operator's
//! words at a ground station become registers of it, and every peer can say what it knows.

use crate::cooperation::Cooperation;
use crate::effect::{Effect, Effects};
use crate::input::{AskedTask, NewTask, OperatorsTasks, TaskEdit, Time};
use crate::mission::Mission;
use crate::tasking::{KEPT_FOR_COVER, Known, Tasking, after_ms, why_nobody};
use crate::wire::codec::Body;
use crate::wire::tasks::{
    Progress, TASK_NAME_MAX_BYTES, TASKS_MAX, Task, TaskId, TaskKind, TaskPlace, TaskState,
    check_task, is_task_name, sensor_name,
};
use serde::{Deserialize, Serialize};
use skein_geometry::hash::Fnv;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

/// What a peer knows of a task, for a person.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TaskView {
    /// What people call it.
    pub name: String,
    /// Who asks for it.
    pub author: u16,
    /// In which register of its author.
    pub number: u16,
    /// What kind it is.
    pub kind: TaskKind,
    /// What became of it.
    pub state: TaskState,
    /// Where: east and north of the mission's origin, millimetres.
    pub places_mm: Vec<(i32, i32)>,
    /// How far around is to be seen, mm.
    pub radius_mm: u32,
    /// The sensor that it needs, by name; `any` for none in particular.
    pub needs: String,
    /// What it is worth.
    pub worth: u16,
    /// How long ago it was asked for, as far as this peer knows, milliseconds.
    pub age_ms: u64,
    /// After so long it is not wanted any more, milliseconds; 0 for never.
    pub within_ms: u32,
    /// Who did it.
    pub done_by: Option<u16>,
    /// How long after it was asked for it was over, as far as this peer knows, milliseconds.
    pub over_after_ms: Option<u64>,
    /// Who holds it, with its bid, and how far it is.
    pub held_by: Vec<TaskHolder>,
    /// Why nobody can do it, where that is known.
    pub nobody_can: Option<String>,
}

/// Somebody's claim on a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TaskHolder {
    /// Who.
    pub uav: u16,
    /// What it adds to the value of its bundle, in millionths of the task's worth.
    pub bid: u32,
    /// How far it is.
    pub progress: Progress,
}

impl Tasking {
    /// What this peer's own operator said of tasks.
    pub fn asked(&self, now: Time) -> OperatorsTasks {
        let asked = |(id, known): (&TaskId, &Known)| AskedTask {
            number: id.number,
            task: known.task.clone(),
            age_ms: now.since_ms(known.since),
        };
        OperatorsTasks {
            asked: self.own().map(asked).collect(),
            done: self.said_done().to_vec(),
        }
    }

    /// A task that this peer asked for is wanted no more, by this revision of it.
    pub fn take_back(&mut self, now: Time, id: TaskId, revision: u32) -> Effects {
        let Some(known) = self.known.get(&id) else {
            return Effects::new();
        };
        let since = known.since;
        let task = Task {
            revision,
            state: TaskState::Cancelled,
            over_after_ms: after_ms(now, since),
            ..known.task.clone()
        };
        let mut effects = self.learn(now, id, task.clone());
        self.was_asked(id, since);
        effects.push(Effect::Speak(id.number, Body::Task(task)));
        effects
    }

    /// Changes with the tasks of this peer's own operator, and with what it says to be done; 0
    /// where there is neither.
    pub fn asked_version(&self) -> u64 {
        let revisions = self.own().map(|(id, k)| (*id, k.task.revision));
        let done = self.said_done().iter().map(|d| (d.task, d.revision));
        let said: Vec<(TaskId, u32)> = revisions.chain(done).collect();
        if said.is_empty() {
            return 0;
        }
        let mut hash = Fnv::new();
        said.hash(&mut hash);
        Hasher::finish(&hash).max(1)
    }

    /// All tasks that are known.
    pub fn views(&self, now: Time) -> Vec<TaskView> {
        let view = |(id, known): (&TaskId, &Known)| self.view(now, *id, known);
        self.known.iter().map(view).collect()
    }

    fn view(&self, now: Time, id: TaskId, known: &Known) -> TaskView {
        let task = &known.task;
        let done = known.done;
        let state = match (task.state, done) {
            (TaskState::Open, Some(_)) => TaskState::Done,
            (state, _) => state,
        };
        let told_ms = (task.over_after_ms > 0).then_some(u64::from(task.over_after_ms));
        let here_ms = done.map(|(_, at)| at.since_ms(known.since));
        let is_open = state == TaskState::Open;
        TaskView {
            name: task.name(),
            author: id.author,
            number: id.number,
            kind: task.kind,
            state,
            places_mm: task
                .places
                .iter()
                .map(|p| (p.east_mm, p.north_mm))
                .collect(),
            radius_mm: task.radius_mm,
            needs: sensor_name(task.sensor),
            worth: task.worth,
            age_ms: now.since_ms(known.since),
            within_ms: task.within_ms,
            done_by: done.map(|(by, _)| by),
            over_after_ms: told_ms.or(here_ms),
            held_by: if is_open {
                self.holders(id)
            } else {
                Vec::new()
            },
            nobody_can: self.why_not(id, task).filter(|_| is_open),
        }
    }

    /// Who holds a task, with its bid, as far as this peer knows.
    pub(crate) fn holders(&self, id: TaskId) -> Vec<TaskHolder> {
        let own = self.auction.held().iter();
        let own = own.map(|t| (self.me_id(), t));
        let others = self.bundles.iter();
        let others = others.flat_map(|(peer, (_, b))| b.tasks.iter().map(move |t| (peer.0, t)));
        let of_it = own.chain(others).filter(|(_, t)| t.task == id);
        of_it
            .map(|(uav, t)| TaskHolder {
                uav,
                bid: t.bid,
                progress: t.progress,
            })
            .collect()
    }

    /// Why nobody can do a task: of a UAV by its auction, of a ground station by what carries
    /// whom.
    fn why_not(&self, id: TaskId, task: &Task) -> Option<String> {
        if self.auction.unassigned().contains(&id) {
            if self.auction.kept_for_cover().contains(&id) {
                return Some(KEPT_FOR_COVER.to_owned());
            }
            return Some(why_nobody(task, self.auction.offers()));
        }
        let heard = self.bundles.values().map(|(_, b)| &b.offer);
        let flying = heard.clone().filter(|o| o.speed_mmps > 0).count();
        let carried = heard
            .clone()
            .any(|o| crate::tasking::carries(o.sensors, task.sensor));
        (flying > 0 && !carried).then(|| why_nobody(task, heard))
    }

    /// A name that no open task has: `task-1` and so on.
    fn free_name(&self) -> String {
        let mut names = (1..).map(|n: u32| format!("task-{n}"));
        names.find(|n| self.named(n).is_none()).unwrap_or_default()
    }

    /// The task of this operator with a name, the open one first.
    fn named(&self, name: &str) -> Option<(TaskId, &Known)> {
        let named = self.own();
        let named = named.filter(|(_, k)| k.task.name == name.as_bytes());
        named
            .max_by_key(|(_, k)| k.is_open())
            .map(|(id, known)| (*id, known))
    }

    /// The open tasks that are called so, whoever asked for them.
    fn open_named(&self, name: &str) -> Vec<TaskId> {
        let all = self.known.iter();
        let open = all.filter(|(_, k)| k.is_open() && k.task.name == name.as_bytes());
        open.map(|(id, _)| *id).collect()
    }

    /// The one open task of a name, its operator's own first.
    fn to_be_done(&self, name: &str) -> Result<TaskId, String> {
        if let Some((id, _)) = self.named(name).filter(|(_, k)| k.is_open()) {
            return Ok(id);
        }
        match &self.open_named(name)[..] {
            [id] => Ok(*id),
            [] => {
                let all = self.known.values();
                let is_over = all.into_iter().any(|k| k.task.name == name.as_bytes());
                if is_over {
                    return Err(format!("the task {name:?} is over already"));
                }
                Err(self.none_named(name))
            }
            several => {
                let by: Vec<String> = several.iter().map(|t| t.author.to_string()).collect();
                Err(format!(
                    "{} ask for a task {name:?}; only one that one of them asks for can be done",
                    by.join(", ")
                ))
            }
        }
    }

    /// That no open task is called so, and which there are.
    fn none_named(&self, name: &str) -> String {
        let open = self.known.values().filter(|k| k.is_open());
        let open: Vec<String> = open.map(|k| k.task.name()).collect();
        let known = if open.is_empty() {
            "none".to_owned()
        } else {
            open.join(", ")
        };
        format!("no open task is named {name:?}; there are: {known}")
    }

    /// A task of this operator, and if it is the first for its target those who are to stay
    /// with that beside it.
    fn with_those_beside(&self, first: TaskId) -> Vec<TaskId> {
        let place = |k: &Known| (k.task.kind, k.task.places.clone());
        let Some(asked) = self.known.get(&first).map(place) else {
            return Vec::new();
        };
        let tracks = asked.0 == TaskKind::Track;
        let same = self.own().filter(|(_, k)| k.is_open() && place(k) == asked);
        let same: Vec<TaskId> = same.map(|(id, _)| *id).collect();
        if tracks && same.first() == Some(&first) {
            same
        } else {
            vec![first]
        }
    }

    /// A register for one more task: one that was never used, or of those that are over the one
    /// asked for first; with the revision that it gets.
    fn free_register(&self) -> Result<(u16, u32), String> {
        let id = |number| TaskId {
            author: self.me_id(),
            number,
        };
        let unused = (0..TASKS_MAX).find(|n| !self.known.contains_key(&id(*n)));
        if let Some(number) = unused {
            return Ok((number, 1));
        }
        let over = self.own().filter(|(_, k)| !k.task.is_open());
        let first = over.min_by_key(|(id, k)| (k.since, **id));
        first
            .map(|(id, k)| (id.number, k.task.revision.saturating_add(1)))
            .ok_or_else(|| format!("{TASKS_MAX} open tasks are the most; cancel one first"))
    }

    /// The task that is asked for, and its register.
    fn asked_for(&self, new: &NewTask) -> Result<(u16, Task), String> {
        let name = new.name.clone().unwrap_or_else(|| self.free_name());
        if !is_task_name(&name) {
            return Err(format!(
                "{name:?} is no name of a task; expected 1 to {TASK_NAME_MAX_BYTES} letters, digits, '-', '_' or '.'"
            ));
        }
        if self.named(&name).is_some_and(|(_, k)| k.is_open()) {
            return Err(format!(
                "a task {name:?} is open already; cancel it first, or choose another name"
            ));
        }
        let (number, revision) = self.free_register()?;
        let named = NewTask {
            name: Some(name),
            ..new.clone()
        };
        let task = named.asked(number, revision)?;
        Ok((number, task))
    }
}

/// Most UAVs that may be asked to stay with one target.
pub const WATCHERS_MAX: u8 = 4;

impl NewTask {
    /// The same for so many UAVs, each by a task of its own: tasks to follow what is at one place
    /// are of one target. Who stays beside is worth half: a target that nobody follows goes
    /// before.
    #[must_use]
    pub fn for_watchers(self, watchers: u8) -> Vec<Self> {
        let beside = (2..=watchers).map(|nth| Self {
            name: self.name.as_ref().map(|name| format!("{name}.{nth}")),
            worth: (self.worth / 2).max(1),
            ..self.clone()
        });
        let beside: Vec<Self> = beside.collect();
        core::iter::once(self).chain(beside).collect()
    }

    /// The task as it is said in a register and a revision.
    ///
    /// # Errors
    /// What of it is out of range.
    pub fn asked(&self, number: u16, revision: u32) -> Result<Task, String> {
        let place = |p: &crate::mission::PointMm| TaskPlace {
            east_mm: p.0,
            north_mm: p.1,
        };
        let name = self.name.clone();
        let task = Task {
            revision,
            kind: self.kind,
            places: self.places.iter().map(place).collect(),
            sensor: self.sensor,
            worth: self.worth,
            radius_mm: self.radius_mm,
            within_ms: self.within_ms.unwrap_or(0),
            name: name
                .unwrap_or_else(|| format!("task-{number}"))
                .into_bytes(),
            ..Task::default()
        };
        check_task(&task).map_err(|e| format!("the task cannot be said: {e}"))?;
        Ok(task)
    }
}

impl Cooperation {
    /// Whether the operator's words can be carried out in this mission.
    pub fn check_task(
        &self,
        edit: &TaskEdit,
        mission: Option<&Arc<Mission>>,
    ) -> Result<(), String> {
        match edit {
            TaskEdit::Add(new) => {
                let (_, task) = self.tasking.asked_for(new)?;
                let mission = mission.ok_or("the ground station holds no mission with a place")?;
                mission.can_do(&task)
            }
            TaskEdit::Cancel(name) => match self.tasking.named(name) {
                Some((_, known)) if known.is_open() => Ok(()),
                Some(_) => Err(format!("the task {name:?} is over already")),
                None => Err(self.tasking.none_named(name)),
            },
            TaskEdit::Done(name) => self.tasking.to_be_done(name).map(|_| ()),
            TaskEdit::Again(_) => Ok(()),
        }
    }

    /// Carries the operator's words out.
    pub fn edit_task(
        &mut self,
        now: Time,
        edit: &TaskEdit,
        mission: Option<&Arc<Mission>>,
    ) -> Result<Effects, String> {
        self.check_task(edit, mission)?;
        let author = self.tasking.me_id();
        match edit {
            TaskEdit::Add(new) => {
                let (number, mut task) = self.tasking.asked_for(new)?;
                if let Some(mission) = mission {
                    task.stay_ms = mission.area_ms(&task)?;
                }
                let id = TaskId { author, number };
                let mut effects = self.tasking.learn(now, id, task.clone());
                effects.push(Effect::Speak(number, Body::Task(task)));
                Ok(effects)
            }
            TaskEdit::Cancel(name) => {
                let Some((id, _)) = self.tasking.named(name) else {
                    return Ok(Effects::new());
                };
                let mut effects = Effects::new();
                for id in self.tasking.with_those_beside(id) {
                    let held = self.tasking.known.get(&id);
                    let revision = held.map_or(0, |k| k.task.revision.saturating_add(1));
                    effects.extend(self.tasking.take_back(now, id, revision));
                }
                Ok(effects)
            }
            TaskEdit::Done(name) => {
                let first = self.tasking.to_be_done(name)?;
                let own = first.author == author;
                let all = if own {
                    self.tasking.with_those_beside(first)
                } else {
                    vec![first]
                };
                Ok(self.tasking.done_on_ground(now, &all))
            }
            TaskEdit::Again(OperatorsTasks { asked, done }) => {
                let mut effects = self.tasking.was_said_done(now, done);
                for AskedTask {
                    number,
                    task,
                    age_ms,
                } in asked
                {
                    let id = TaskId {
                        author,
                        number: *number,
                    };
                    effects.extend(self.tasking.learn(now, id, task.clone()));
                    self.tasking
                        .was_asked(id, Time(now.0.saturating_sub(*age_ms)));
                }
                self.tasking.say_anew();
                Ok(effects)
            }
        }
    }
}
