//! What a settlement follows from: offers of the living, what they claimed before, what is
//! open, and the hash of all that.

use super::settlement::{Bidder, Problem};
use super::{Auction, Rank, kept, rank};
use crate::PeerId;
use crate::wire::tasks::{
    BUNDLE_MAX, Bundle, BundleTask, DONE_MAX, Progress, Task, TaskId, TaskState,
};
use skein_geometry::hash::{Fnv, folded};
use std::collections::{BTreeMap, BTreeSet};
use std::hash::{Hash, Hasher};

impl Auction {
    /// All who bid, ascending: this peer and those who live, as far as they were heard.
    pub(super) fn bidders(&self) -> Vec<(PeerId, &Bundle)> {
        let mut all: Vec<(PeerId, &Bundle)> = self.living().chain([(self.me, &self.own)]).collect();
        all.sort_by_key(|(id, _)| *id);
        all
    }

    /// What is to be settled with claims as they are; and where claims of those who are only on
    /// their way are open too.
    pub(super) fn problems(&self) -> (Problem, Problem) {
        let bidders = self.bidders();
        let open = self.open_before_claims(&bidders);
        let problem = |moves| self.problem(&bidders, &open, moves);
        (problem(false), problem(true))
    }

    fn problem(&self, bidders: &[(PeerId, &Bundle)], open: &[TaskId], moves: bool) -> Problem {
        let (holders, open) = self.to_be_had(bidders, open, moves);
        let held_back = self.held_back(bidders, &holders, &open);
        let bidder = |(id, bundle): &(PeerId, &Bundle)| {
            let first = kept(bundle).map(|t| t.task);
            let mine = |t: &TaskId| holders.get(t).is_some_and(|h| h.2.0 == *id);
            let leaving = kept(bundle).filter(|t| t.progress == Progress::Leaving);
            let used = usize::from(bundle.kept) + bundle.done.len();
            let fixed = if moves { bundle.begun } else { bundle.kept };
            let mut fixed = kept(bundle).take(usize::from(fixed));
            // Who is to hold something does nothing else.
            let is_tied = fixed.any(|t| self.is_current(t) && self.is_held(t.task));
            let room = DONE_MAX
                .saturating_sub(used)
                .min(BUNDLE_MAX.saturating_sub(usize::from(bundle.kept)));
            Bidder {
                id: *id,
                offer: bundle.offer,
                first: first.filter(mine).collect(),
                barred: leaving
                    .map(|t| t.task)
                    .chain(held_back.iter().copied())
                    .collect(),
                room: if is_tied { 0 } else { room },
            }
        };
        Problem {
            bidders: bidders.iter().map(bidder).collect(),
            open,
        }
    }

    /// What is to be done, whoever claims it, ascending.
    pub(super) fn open_before_claims(&self, bidders: &[(PeerId, &Bundle)]) -> Vec<TaskId> {
        let done = self.done_before_offers(bidders);
        let open = self
            .tasks
            .iter()
            .filter(|(id, task)| self.counts_open(**id, task) && !done.contains(id));
        open.map(|(id, _)| *id).collect()
    }

    /// Which tasks are somebody's, and which of those to be done are to be had.
    pub(super) fn to_be_had(
        &self,
        bidders: &[(PeerId, &Bundle)],
        open: &[TaskId],
        moves: bool,
    ) -> (BTreeMap<TaskId, Rank>, Vec<TaskId>) {
        let mut holders: BTreeMap<TaskId, Rank> = BTreeMap::new();
        for (id, bundle) in bidders {
            let fixed = if moves { bundle.begun } else { bundle.kept };
            let fixed = kept(bundle).take(usize::from(fixed));
            let stays = |t: &&BundleTask| t.progress != Progress::Leaving && self.is_current(t);
            for held in fixed.filter(stays) {
                let best = holders.entry(held.task).or_insert_with(|| rank(*id, held));
                *best = (*best).max(rank(*id, held));
            }
        }
        let free = open.iter().filter(|id| !holders.contains_key(id));
        let free = free.copied().collect();
        (holders, free)
    }

    /// What was done before the offers of those who live, and what others did at all: what
    /// was done since an offer is still settled on it, so that doing changes nothing.
    fn done_before_offers(&self, bidders: &[(PeerId, &Bundle)]) -> BTreeSet<TaskId> {
        let current = |task: &TaskId, revision: u32| {
            let known = self.tasks.get(task);
            known.is_some_and(|t| t.revision_as_asked() == revision)
        };
        let before = bidders.iter().map(|(_, b)| *b);
        let gone = self.others.iter().filter(|(id, _)| !self.live.contains(id));
        let gone: Vec<&Bundle> = gone.map(|(_, (_, b))| b).collect();
        let by_gone = gone.iter().flat_map(|b| b.tasks.iter());
        let by_gone = by_gone.filter(|t| t.progress == Progress::Done);
        let by_gone = by_gone.map(|t| (t.task, t.revision));
        let told = before.chain(gone.iter().copied());
        let told = told.flat_map(|b| b.done.iter().map(|d| (d.task, d.revision)));
        let all = told.chain(by_gone);
        all.filter(|(task, revision)| current(task, *revision))
            .map(|(task, _)| task)
            .collect()
    }

    /// Whether a task counts as open: it is, or it was done since an offer that stands, by
    /// whom its author tells. So being told of what was done changes nobody's list.
    fn counts_open(&self, id: TaskId, task: &Task) -> bool {
        if task.is_open() || task.state != TaskState::Done {
            return task.is_open();
        }
        let since = |b: &Bundle| {
            let done = |t: &BundleTask| t.task == id && t.progress == Progress::Done;
            b.tasks.iter().any(done)
        };
        self.living().any(|(_, b)| since(b)) || since(&self.own)
    }

    /// Hash of all that a settlement follows from. 0 stands for none.
    pub(super) fn basis(&self) -> u32 {
        let mut hash = Fnv::new();
        for (id, task) in &self.tasks {
            (id, task.revision_as_asked(), self.counts_open(*id, task)).hash(&mut hash);
        }
        self.map.hash(&mut hash);
        self.problems().hash(&mut hash);
        folded(Hasher::finish(&hash)).max(1)
    }
}
