//! What became of the tasks that were asked for in flight (D2.7 §3.2): who flew to them, who
//! says to have done them, and when the judge saw them.

use crate::check::tracks::Tracked;
use crate::world::Judge;
use serde::{Deserialize, Serialize};
use skein_peer::Report;
use skein_peer::input::AskedTask;
use skein_peer::output::TaskNews;
use skein_peer::wire::tasks::TaskState;
use std::collections::BTreeMap;

/// One task.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TaskReport {
    /// What people call it.
    pub name: String,
    /// When it was asked for, ms.
    pub asked_ms: u64,
    /// Whether it is a place, a line or an area, which is done once it was seen.
    #[serde(default, skip_serializing_if = "core::ops::Not::not")]
    pub is_look: bool,
    /// What the ground station holds it to be at the end: `open`, `cancelled`, `expired` or
    /// `done`.
    pub state: TaskState,
    /// When all of it had been seen, as the judge knows, ms.
    pub seen_ms: Option<u64>,
    /// Who saw the last of it, as the judge knows.
    pub seen_by: Option<u16>,
    /// Who flew to it, each time one did.
    pub flown_by: Vec<u16>,
    /// Who held it, if it is a relay position, each time one did.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub held_by: Vec<u16>,
    /// How often whoever followed its target said that it lost it.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub lost: u32,
    /// What became of its target, as the world knows, if it is one to follow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tracked: Option<Tracked>,
    /// Who says to have done it; more than one did it more than once.
    pub done_by: Vec<u16>,
    /// Why nobody can do it, as the first UAV said that did.
    pub nobody_can: Option<String>,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "as serde asks")]
fn is_zero(n: &u32) -> bool {
    *n == 0
}

/// All of them, by register and revision.
#[derive(Clone, Debug, Default)]
pub(super) struct Tasks(BTreeMap<(u16, u32), TaskReport>);

impl Tasks {
    /// A task is known to the ground station of its operator.
    pub(super) fn asked(&mut self, now_ms: u64, asked: &AskedTask) {
        let key = (asked.number, asked.task.revision_as_asked());
        let earlier = key.1.checked_sub(1).map(|before| (key.0, before));
        // One that was cancelled or expired is told in a revision of its own.
        let over = asked.task.state;
        if !asked.task.is_open()
            && let Some(task) = earlier.and_then(|k| self.0.get_mut(&k))
        {
            task.state = over;
            return;
        }
        let task = self.0.entry(key).or_insert_with(|| TaskReport {
            name: asked.task.name(),
            is_look: !asked.task.kind.goes_on(),
            asked_ms: now_ms.saturating_sub(asked.age_ms),
            ..TaskReport::default()
        });
        task.state = over;
    }

    /// A peer says something of a task.
    pub(super) fn reported(&mut self, peer: u16, report: &Report) {
        let Report::Task {
            id, revision, news, ..
        } = report
        else {
            return;
        };
        let Some(task) = self.0.get_mut(&(id.number, *revision)) else {
            return;
        };
        match news {
            TaskNews::Flies | TaskNews::Relays | TaskNews::Tracks => task.flown_by.push(peer),
            TaskNews::Holds => task.held_by.push(peer),
            TaskNews::Follows => {
                // Who lost the target and found it again holds it all the while.
                if task.held_by.last() != Some(&peer) {
                    task.held_by.push(peer);
                }
            }
            TaskNews::Seen => task.done_by.push(peer),
            TaskNews::NobodyCan(why) => {
                task.nobody_can.get_or_insert_with(|| why.clone());
            }
            TaskNews::Searches => task.lost += 1,
            TaskNews::Asked
            | TaskNews::Leaving
            | TaskNews::Left
            | TaskNews::DoneBy(_)
            | TaskNews::Over(_) => {}
        }
    }

    /// What the world knows of a target that was to be followed.
    pub(super) fn tracked(&mut self, key: (u16, u32), tracked: &Tracked) {
        if let Some(task) = self.0.get_mut(&key) {
            task.tracked = Some(tracked.clone());
        }
    }

    /// What became of all.
    pub(super) fn reports(&self, judge: &Judge) -> Vec<TaskReport> {
        let told = |(key, task): (&(u16, u32), &TaskReport)| {
            let seen = judge.saw_task(*key);
            TaskReport {
                seen_ms: seen.map(|s| s.at_ms),
                seen_by: seen.map(|s| s.uav),
                ..task.clone()
            }
        };
        self.0.iter().map(told).collect()
    }
}

impl TaskReport {
    /// Why it was seen too late, if it was: what is to be looked at is to be seen within so long,
    /// unless it was taken back before, or the run ended.
    #[must_use]
    pub fn late(&self, within_ms: u64, now_ms: u64) -> Option<String> {
        let seen_ms = self.seen_ms.unwrap_or(now_ms).saturating_sub(self.asked_ms);
        let counts = self.is_look && self.state != TaskState::Cancelled;
        (counts && seen_ms > within_ms).then(|| {
            format!(
                "{}, and was to be within {:.0} s",
                self.line(),
                super::secs(within_ms)
            )
        })
    }

    /// One line for a person.
    #[must_use]
    pub fn line(&self) -> String {
        let secs = super::secs;
        let asked = format!("{} asked for at {:.1} s", self.name, secs(self.asked_ms));
        let state = format!("{:?}", self.state).to_lowercase();
        if !self.held_by.is_empty() {
            let names: Vec<String> = self.held_by.iter().map(|id| format!("uav{id}")).collect();
            let tracked = self
                .tracked
                .as_ref()
                .map_or_else(String::new, Tracked::words);
            return format!("{asked}, held by {}{tracked}, {state}", names.join(", "));
        }
        match (self.seen_ms, self.seen_by, &self.nobody_can) {
            (Some(ms), Some(by), _) => format!(
                "{asked}, seen by uav{by} after {:.1} s",
                secs(ms.saturating_sub(self.asked_ms))
            ),
            (_, _, Some(why)) if self.state == TaskState::Open => {
                format!("{asked}, not seen: {why}")
            }
            _ => format!("{asked}, not seen, {state}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_peer::PeerId;
    use skein_peer::wire::tasks::{Task, TaskId};

    #[test]
    fn a_task_is_followed_over_its_revisions() {
        let mut tasks = Tasks::default();
        let asked = |revision, state| AskedTask {
            number: 3,
            task: Task {
                revision,
                state,
                name: b"gate".to_vec(),
                ..Task::default()
            },
            age_ms: 500,
        };
        let says = |news| Report::Task {
            id: TaskId {
                author: 100,
                number: 3,
            },
            revision: 1,
            name: "gate".into(),
            news,
            held_by: Vec::new(),
        };
        tasks.asked(10_000, &asked(1, TaskState::Open));
        tasks.reported(2, &says(TaskNews::Flies));
        tasks.reported(2, &says(TaskNews::Seen));
        tasks.reported(1, &says(TaskNews::DoneBy(PeerId(2))));
        tasks.asked(30_000, &asked(2, TaskState::Done));
        // The register is used again, and that one is cancelled.
        tasks.asked(40_000, &asked(3, TaskState::Open));
        tasks.asked(50_000, &asked(4, TaskState::Cancelled));
        let all: Vec<_> = tasks.0.values().collect();
        assert_eq!(all.len(), 2);
        assert_eq!((all[0].asked_ms, all[0].state), (9_500, TaskState::Done));
        assert_eq!(
            (&all[0].flown_by[..], &all[0].done_by[..]),
            (&[2][..], &[2][..])
        );
        assert_eq!(all[1].state, TaskState::Cancelled);
        assert!(all[1].line().ends_with("not seen, cancelled"));
        // Not seen for so long it is late; taken back it is not.
        assert!(all[0].is_look && all[0].late(20_000, 29_000).is_none());
        let why = all[0].late(20_000, 30_000).unwrap();
        assert!(
            why.ends_with("not seen, done, and was to be within 20 s"),
            "{why}"
        );
        let seen = TaskReport {
            seen_ms: Some(12_000),
            ..all[0].clone()
        };
        assert!(seen.late(20_000, 90_000).is_none() && seen.late(2_000, 90_000).is_some());
        assert!(all[1].late(1, 90_000).is_none());
    }
}
