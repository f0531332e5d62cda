//! Tasks other than coverage, as whoever listens believes them: who asked, and from the bundles
//! that UAVs say, who holds which with what bid.

use skein_peer::PeerId;
use skein_peer::output::TaskNews;
use skein_peer::wire::tasks::{Bundle, Progress, Task, TaskId, TaskState};
use skein_recording::model::event::{TaskBid, What};
use std::collections::BTreeMap;

/// Tasks that are kept in mind: as many peers keep, about.
const MAX_TASKS: usize = 1024;

/// What is known of the tasks of a swarm.
#[derive(Debug, Default)]
pub(crate) struct Tasks {
    asked: BTreeMap<TaskId, Known>,
    /// What each UAV holds. Bounded by the peers that are kept in mind and the tasks of a
    /// bundle.
    bundles: BTreeMap<u16, Vec<Held>>,
}

#[derive(Clone, Debug)]
struct Known {
    name: String,
    revision: u32,
    state: TaskState,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Held {
    task: TaskId,
    revision: u32,
    bid: u32,
    progress: Progress,
}

impl Tasks {
    /// Somebody asks for a task, or says what became of it.
    pub(crate) fn asked(&mut self, author: u16, number: u16, task: &Task) -> Vec<(String, What)> {
        let id = TaskId { author, number };
        let known = Known {
            name: task.name(),
            revision: task.revision_as_asked(),
            state: task.state,
        };
        let before = self.asked.get(&id);
        let room = before.is_some() || self.asked.len() < MAX_TASKS;
        let same = before.is_some_and(|k| (k.revision, k.state) == (known.revision, known.state));
        if !room || same {
            return Vec::new();
        }
        let news = match task.state {
            TaskState::Open => TaskNews::Asked,
            over => TaskNews::Over(over),
        };
        let mut told = Vec::new();
        if task.state == TaskState::Done && task.done_by != 0 {
            let by = TaskNews::DoneBy(PeerId(task.done_by));
            let text = by.sentence(&known.name);
            told.push(self.say(id, &known, (by.word(), Some(task.done_by), text)));
        }
        let text = news.sentence(&known.name);
        told.push(self.say(id, &known, (news.word(), None, text)));
        self.asked.insert(id, known);
        told
    }

    /// A UAV says what it holds.
    pub(crate) fn bundle(&mut self, uav: u16, bundle: &Bundle) -> Vec<(String, What)> {
        let held = bundle.tasks.iter().map(|t| Held {
            task: t.task,
            revision: t.revision,
            bid: t.bid,
            progress: t.progress,
        });
        let held: Vec<Held> = held.collect();
        let before = self.bundles.insert(uav, held.clone()).unwrap_or_default();
        let had = |id: TaskId| before.iter().find(|h| h.task == id);
        let mut told = Vec::new();
        for now in &held {
            let was = had(now.task).map(|h| h.progress);
            let begun = |p: Progress| !matches!(p, Progress::Tentative | Progress::Done);
            let (news, does) = match (was, now.progress) {
                (Some(Progress::Done), _) => continue,
                (_, Progress::Done) => ("seen", "did"),
                (was, p) if begun(p) && !was.is_some_and(begun) => ("flies", "flies to"),
                (None, Progress::Tentative) => ("won", "won"),
                _ => continue,
            };
            told.extend(self.does(uav, now.task, now.revision, (news, does)));
        }
        let done =
            |h: &Held| h.progress == Progress::Done || bundle.done.iter().any(|d| d.task == h.task);
        for gone in before.iter().filter(|h| !done(h)) {
            if held.iter().all(|h| h.task != gone.task) {
                told.extend(self.does(uav, gone.task, gone.revision, ("left", "left")));
            }
        }
        told
    }

    /// Of a task of which nobody heard who asked for it nothing is told.
    fn does(
        &self,
        uav: u16,
        id: TaskId,
        revision: u32,
        (news, does): (&str, &str),
    ) -> Option<(String, What)> {
        let known = self.asked.get(&id)?;
        let known = Known {
            revision,
            ..known.clone()
        };
        let text = format!("uav{uav} {does} the task {:?}", known.name);
        Some(self.say(id, &known, (news, None, text)))
    }

    fn say(
        &self,
        id: TaskId,
        known: &Known,
        (news, by, text): (&str, Option<u16>, String),
    ) -> (String, What) {
        let holders = self.bundles.iter().flat_map(|(by, held)| {
            let of_it = held.iter().filter(move |h| h.task == id);
            of_it.map(|h| TaskBid {
                by: *by,
                bid_ppm: h.bid,
            })
        });
        let what = What::Task {
            name: known.name.clone(),
            news: news.to_owned(),
            author: Some(id.author),
            number: Some(id.number),
            revision: Some(known.revision),
            by,
            held_by: holders.collect(),
        };
        (text, what)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_peer::wire::tasks::{BundleTask, DoneTask};

    fn holds(progress: Progress) -> Bundle {
        Bundle {
            tasks: vec![BundleTask {
                task: TaskId {
                    author: 100,
                    number: 4,
                },
                revision: 1,
                bid: 640_000,
                progress,
            }],
            ..Bundle::default()
        }
    }

    fn news(told: &[(String, What)]) -> Vec<(String, Vec<TaskBid>)> {
        let of = |(_, what): &(String, What)| match what {
            What::Task { news, held_by, .. } => (news.clone(), held_by.clone()),
            other => panic!("{other:?}"),
        };
        told.iter().map(of).collect()
    }

    fn words(told: &[(String, What)]) -> Vec<String> {
        news(told).into_iter().map(|(word, _)| word).collect()
    }

    #[test]
    fn a_task_is_told_from_asking_to_its_end_by_those_who_have_it() {
        let mut tasks = Tasks::default();
        // Who asked was not heard yet.
        assert!(tasks.bundle(3, &holds(Progress::Tentative)).is_empty());
        let mut task = Task {
            revision: 1,
            name: b"gate".to_vec(),
            ..Task::default()
        };
        let asked = tasks.asked(100, 4, &task);
        let bid = |by| TaskBid {
            by,
            bid_ppm: 640_000,
        };
        assert_eq!(news(&asked), [("asked".to_owned(), vec![bid(3)])]);
        assert!(tasks.asked(100, 4, &task).is_empty());
        let won = tasks.bundle(5, &holds(Progress::Tentative));
        assert_eq!(news(&won), [("won".to_owned(), vec![bid(3), bid(5)])]);
        assert_eq!(words(&tasks.bundle(3, &Bundle::default())), ["left"]);
        assert_eq!(
            words(&tasks.bundle(5, &holds(Progress::Committed))),
            ["flies"]
        );
        assert!(tasks.bundle(5, &holds(Progress::Begun)).is_empty());
        assert_eq!(words(&tasks.bundle(5, &holds(Progress::Done))), ["seen"]);
        assert!(tasks.bundle(5, &holds(Progress::Done)).is_empty());
        // A later offer says it among what was done before.
        let mut later = Bundle::default();
        later.done.push(DoneTask {
            task: TaskId {
                author: 100,
                number: 4,
            },
            revision: 1,
        });
        assert!(tasks.bundle(5, &later).is_empty());
        (task.revision, task.state, task.done_by) = (2, TaskState::Done, 5);
        let over = tasks.asked(100, 4, &task);
        assert_eq!(words(&over), ["done-by", "over"]);
        assert!(over[1].0.contains("done"), "{}", over[1].0);
    }
}
