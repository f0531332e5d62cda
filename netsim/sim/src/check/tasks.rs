//! Tasks other than coverage among the members of a component: no two claim one for long
//! (`task-twice`), and each that one of them knows to be open is in somebody's bundle
//! (`task-lost`).

use super::{Clocks, Findings, Grade, PeerSnapshot, Snapshot};
use skein_peer::output::TaskNews;
use skein_peer::wire::tasks::{Progress, TaskId, TaskState};
use std::collections::{BTreeMap, BTreeSet};

/// A single case may take so many bounds, since bundles collide like all else.
const FACTOR: u64 = 3;

/// A task is heard of, offered for, and won: each takes a record to all.
const WAYS: u64 = 3;

/// A task and the revision in which it was asked for.
type Asked = (TaskId, u32);

/// What came of tasks in one run.
#[derive(Clone, Debug, Default)]
pub struct TaskCheck {
    twice: Clocks<(u16, u16, Asked)>,
    lost: Clocks<(u16, Asked)>,
    /// What somebody said to have done, who may be dead by now, and whose time was over for
    /// somebody: those who heard of it need nobody, though the word of who asked for it does not
    /// reach them.
    over: BTreeSet<Asked>,
}

impl TaskCheck {
    /// A peer tells its people of a task. Its time is over for each peer so long after that heard
    /// of it: for nobody before it is in truth, unless a clock jumped.
    pub fn on_report(&mut self, peer: u16, task: (TaskId, u32), news: &TaskNews) {
        if *news == TaskNews::Over(TaskState::Expired) {
            let (id, revision) = task;
            self.over.insert(task);
            // Who asked for it says so in the next revision.
            let asked = revision.saturating_sub(u32::from(id.author == peer));
            self.over.insert((id, asked));
        }
    }

    /// Looks at all components.
    pub fn on_snapshot(&mut self, snapshot: &Snapshot<'_>, found: &mut Findings) {
        let (mut twice, mut lost) = (BTreeSet::new(), BTreeSet::new());
        let all = snapshot.peers.iter().flat_map(|m| &m.view.tasks);
        let done = all.filter(|(.., progress)| *progress == Progress::Done);
        self.over
            .extend(done.map(|(id, revision, _)| (*id, *revision)));
        for members in snapshot.graph.components() {
            let peers = snapshot.speaking_uavs(&members);
            let Some(first) = peers.first() else { continue };
            let Some(whole_ms) = snapshot.stability.component_since_ms(first.id) else {
                continue;
            };
            self.look_for_doubles(snapshot, (&peers, whole_ms), &mut twice, found);
            self.look_for_lost(snapshot, (&peers, whole_ms), &mut lost, found);
        }
        self.twice.retain(|k| twice.contains(k));
        self.lost.retain(|k| lost.contains(k));
    }

    fn look_for_doubles(
        &mut self,
        snapshot: &Snapshot<'_>,
        (peers, whole_ms): (&[&PeerSnapshot], u64),
        seen: &mut BTreeSet<(u16, u16, Asked)>,
        found: &mut Findings,
    ) {
        let mut claims: BTreeMap<Asked, Vec<&PeerSnapshot>> = BTreeMap::new();
        for m in peers {
            let claimed = m.view.tasks.iter();
            let claimed = claimed.filter(|t| matches!(t.2, Progress::Committed | Progress::Begun));
            for (id, revision, _) in claimed {
                claims.entry((*id, *revision)).or_default().push(m);
            }
        }
        let bound_ms = snapshot.bounds.spread_ms() + snapshot.bounds.yield_ms();
        for (task, by) in claims.iter().filter(|(_, by)| by.len() > 1) {
            let (a, b) = (by[0], by[1]);
            let key = (a.id, b.id, *task);
            seen.insert(key);
            let began_ms = self.twice.start(key, snapshot.now_ms);
            let from_ms = began_ms.max(whole_ms).max(a.since_ms).max(b.since_ms);
            let limit_ms = snapshot.grown_ms(bound_ms, from_ms) * FACTOR;
            let took_ms = snapshot.now_ms - from_ms;
            let graded = snapshot.grade() != Grade::Reported;
            if graded && took_ms > limit_ms && self.twice.tell_once(key) {
                found.broken("task-twice", snapshot.now_ms, Some(b.id), || {
                    format!(
                        "claims the task {}.{} as peer {} in its component does, for {took_ms} ms (bound {bound_ms} ms)",
                        task.0.author, task.0.number, a.id
                    )
                });
            }
        }
    }

    fn look_for_lost(
        &mut self,
        snapshot: &Snapshot<'_>,
        (peers, whole_ms): (&[&PeerSnapshot], u64),
        seen: &mut BTreeSet<(u16, Asked)>,
        found: &mut Findings,
    ) {
        let able = peers.iter().filter(|m| m.view.able);
        let held: BTreeSet<Asked> = peers
            .iter()
            .flat_map(|m| {
                m.view
                    .tasks
                    .iter()
                    .map(|(id, revision, _)| (*id, *revision))
            })
            .collect();
        let bound_ms = WAYS * snapshot.bounds.spread_ms();
        for m in able {
            let nobodys = |t: &&Asked| !held.contains(t) && !self.over.contains(t);
            for task in m.view.open_tasks.iter().filter(nobodys) {
                let key = (m.id, *task);
                seen.insert(key);
                let began_ms = self.lost.start(key, snapshot.now_ms);
                let from_ms = began_ms.max(whole_ms).max(m.since_ms);
                let limit_ms = snapshot.grown_ms(bound_ms, from_ms) * FACTOR;
                let took_ms = snapshot.now_ms - from_ms;
                let graded = snapshot.grade() <= Grade::Light;
                if graded && took_ms > limit_ms && self.lost.tell_once(key) {
                    found.broken("task-lost", snapshot.now_ms, Some(m.id), || {
                        format!(
                            "knows the task {}.{} to be open, which is in nobody's bundle in its component for {took_ms} ms (bound {bound_ms} ms)",
                            task.0.author, task.0.number
                        )
                    });
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Story, speaking};
    use super::*;
    use skein_peer::Beliefs;

    const TASK: TaskId = TaskId {
        author: 100,
        number: 3,
    };

    fn after(seconds: u64, views: &[(u16, Beliefs)]) -> BTreeMap<&'static str, u64> {
        let (mut story, mut found) = (Story::new(0), Findings::new(1));
        let mut check = TaskCheck::default();
        for t in 0..seconds {
            story.snapshot(t * 1000, views, |s| check.on_snapshot(s, &mut found));
        }
        found.counts
    }

    fn holding(progress: Option<Progress>) -> Beliefs {
        Beliefs {
            tasks: progress.map(|p| (TASK, 1, p)).into_iter().collect(),
            open_tasks: vec![(TASK, 1)],
            ..speaking()
        }
    }

    #[test]
    fn two_who_claim_one_task_for_long_are_found() {
        let claims = || holding(Some(Progress::Committed));
        let twice = |views: &[(u16, Beliefs)], s| after(s, views).contains_key("task-twice");
        assert!(twice(&[(1, claims()), (2, claims())], 60));
        assert!(!twice(&[(1, claims()), (2, claims())], 10));
        assert!(!twice(
            &[(1, claims()), (2, holding(Some(Progress::Tentative)))],
            60
        ));
        assert!(!twice(&[(1, claims())], 60));
    }

    #[test]
    fn a_task_that_nobody_holds_is_found() {
        let lost = |views: &[(u16, Beliefs)], s| after(s, views).contains_key("task-lost");
        assert!(lost(&[(1, holding(None)), (2, speaking())], 100));
        assert!(!lost(&[(1, holding(None)), (2, speaking())], 20));
        assert!(!lost(
            &[(1, holding(None)), (2, holding(Some(Progress::Done)))],
            100
        ));
        // Done by who is dead since.
        let mut check = TaskCheck::default();
        let (mut story, mut found) = (Story::new(0), Findings::new(1));
        for t in 0..100 {
            let both = [(1, holding(None)), (2, holding(Some(Progress::Done)))];
            let views = if t == 0 { &both[..] } else { &both[..1] };
            story.snapshot(t * 1000, views, |s| check.on_snapshot(s, &mut found));
        }
        assert!(found.counts.is_empty(), "{:?}", found.violations);
        // Its time was over for somebody who heard of it sooner, or for who asked for it.
        let expired = TaskNews::Over(TaskState::Expired);
        let cancelled = TaskNews::Over(TaskState::Cancelled);
        for (by, revision, news, demanded) in [
            (2, 1, &expired, false),
            (100, 2, &expired, false),
            (2, 2, &expired, true),
            (100, 2, &cancelled, true),
        ] {
            let (mut story, mut found) = (Story::new(0), Findings::new(1));
            let mut check = TaskCheck::default();
            check.on_report(by, (TASK, revision), news);
            for t in 0..100 {
                let views = [(1, holding(None)), (2, speaking())];
                story.snapshot(t * 1000, &views, |s| check.on_snapshot(s, &mut found));
            }
            assert_eq!(found.counts.contains_key("task-lost"), demanded, "{news:?}");
        }
        let cannot = Beliefs {
            able: false,
            ..holding(None)
        };
        assert!(!lost(&[(1, cannot), (2, speaking())], 100));
    }
}
