//! What the mission of a live trial looks for: whether what was told is there, and until when
//! somebody watches it. The rule is that of a simulated run (`detect-false`); what was missed
//! is not judged here, for nobody looks into the peers.

use skein_netsim::{DetectionCheck, DetectionReport, Findings, Truth};
use skein_peer::Mission;
use skein_peer::criteria::Criterion;
use skein_peer::wire::detection::{Detection, Stands};
use skein_peer::wire::tasks::TaskId;
use std::collections::BTreeMap;

/// A detection is heard of by all, and what follows is settled, within so long, milliseconds.
const SETTLED_MS: u64 = 30_000;

/// All of it in one trial.
#[derive(Debug)]
pub(crate) struct LookedFor {
    check: DetectionCheck,
    criteria: Vec<Criterion>,
    ends_when_found: bool,
    /// Whether the mission brings tasks, which go before its cells.
    brings: bool,
    /// Until when what was told is followed, milliseconds, by the task.
    until_ms: BTreeMap<TaskId, u64>,
}

impl LookedFor {
    /// Nothing is told.
    pub(crate) fn new(mission: &Mission) -> Self {
        let mut new = Self {
            check: DetectionCheck::default(),
            criteria: Vec::new(),
            ends_when_found: false,
            brings: false,
            until_ms: BTreeMap::new(),
        };
        new.given(mission);
        new
    }

    /// The operator has a mission.
    pub(crate) fn given(&mut self, mission: &Mission) {
        self.check.on_mission(mission);
        self.criteria.clone_from(&mission.detections);
        self.ends_when_found = mission.ends_when_found();
        self.brings = !mission.tasks.is_empty();
        if mission.cancelled {
            self.until_ms.clear();
        }
    }

    /// A UAV tells of an object; gives what is wrong with that.
    pub(crate) fn told(
        &mut self,
        at: (u64, u16),
        (id, told): (TaskId, &Detection),
        truth: impl Iterator<Item = Truth>,
    ) -> Vec<String> {
        let mut found = Findings::new(0);
        let truth: Vec<Truth> = truth.collect();
        self.check.on_told(at, (id, told), &truth, &mut found);
        let criterion = self.criteria.get(usize::from(told.criterion));
        if let Some(for_ms) = criterion.map(|c| u64::from(c.for_ms)).filter(|ms| *ms > 0)
            && told.stands == Stands::Told
        {
            let settled_ms = at.0 + SETTLED_MS;
            self.until_ms
                .insert(id, settled_ms.max(told.seen_ms + for_ms));
        }
        found.violations.iter().map(ToString::to_string).collect()
    }

    /// Somebody follows the target of a task.
    pub(crate) fn follows(&mut self, now_ms: u64, task: TaskId) {
        self.check.on_follows(now_ms, task);
    }

    /// What came of each.
    pub(crate) fn reports(&self) -> Vec<DetectionReport> {
        self.check.reports()
    }

    /// Whether the mission brings tasks.
    pub(crate) fn brings(&self) -> bool {
        self.brings
    }

    /// Whether something was found that ends the mission.
    pub(crate) fn ends_it(&self) -> bool {
        self.ends_when_found && self.check.has_found()
    }

    /// Whether somebody is to follow what was told.
    pub(crate) fn waits(&self, now_ms: u64) -> bool {
        self.until_ms.values().any(|until| now_ms < *until)
    }

    /// Services on the ground have reached what a task is to follow, by the word of a ground
    /// station: nobody does so from now on.
    pub(crate) fn served(&mut self, said: (u64, u16), task: (TaskId, u32)) {
        self.check.on_served(said, task);
        self.until_ms.remove(&task.0);
    }
}
