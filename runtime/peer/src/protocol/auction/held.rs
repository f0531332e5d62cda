//! Tasks that are held until somebody ends them, relay positions: who holds one does nothing
//! else, so while cells are to be covered one UAV at least holds none (D2.7 §3.2, §3.6.5).
//!
//! | what holds | what follows |
//! |---|---|
//! | cells are open, and all others who can fly hold one | nobody may win another |
//! | likewise, and one of them more is not left for `(2D + 3)` periods | of all that are held that of the least worth is let go |
//! | no cell is open | all who can fly may hold one |
//!
//! A relay serves those who cover: if nobody did, there would be nothing to tell of. How many
//! can fly, and what they hold, is in the offers and claims that all know.

use super::{Auction, Effect, Rank};
use crate::PeerId;
use crate::wire::tasks::{Bundle, BundleTask, Progress, Task, TaskId};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

impl Auction {
    /// Whether a task is held until somebody ends it.
    pub(super) fn is_held(&self, id: TaskId) -> bool {
        self.tasks.get(&id).is_some_and(Task::is_held)
    }

    /// How many may hold something while cells are open.
    fn most_held(&self, bidders: &[(PeerId, &Bundle)]) -> usize {
        if !self.cells_open {
            return usize::MAX;
        }
        let able = bidders.iter().filter(|(_, b)| b.offer.speed_mmps > 0);
        able.count().saturating_sub(1)
    }

    /// Tasks by worth, the worthiest first.
    fn by_worth(&self, id: TaskId) -> (Reverse<u16>, TaskId) {
        (Reverse(self.tasks.get(&id).map_or(0, |t| t.worth)), id)
    }

    /// Of open tasks those that nobody may win, since nobody would be left to cover.
    pub(super) fn held_back(
        &self,
        bidders: &[(PeerId, &Bundle)],
        holders: &BTreeMap<TaskId, Rank>,
        open: &[TaskId],
    ) -> BTreeSet<TaskId> {
        let mut wanted: Vec<TaskId> = open.iter().copied().filter(|t| self.is_held(*t)).collect();
        let held = holders.keys().filter(|t| self.is_held(**t)).count();
        let room = self.most_held(bidders).saturating_sub(held);
        wanted.sort_by_key(|t| self.by_worth(*t));
        wanted.into_iter().skip(room).collect()
    }

    /// Tasks that nobody takes since nobody would be left to cover.
    #[must_use]
    pub fn kept_for_cover(&self) -> BTreeSet<TaskId> {
        let bidders = self.bidders();
        let open = self.open_before_claims(&bidders);
        let (holders, open) = self.to_be_had(&bidders, &open, false);
        self.held_back(&bidders, &holders, &open)
    }

    /// The task that this peer is to hold.
    fn own_held(&self) -> Option<&BundleTask> {
        let claims = self.own.tasks.iter();
        let mut claims = claims.filter(|t| is_claim(t) && self.is_current(t));
        claims.find(|t| self.is_held(t.task))
    }

    /// Whether this peer holds a task although nobody is left to cover, and is to let go.
    pub(super) fn is_one_too_many(&self) -> bool {
        let Some(own) = self.own_held().map(|t| t.task) else {
            return false;
        };
        let bidders = self.bidders();
        let claims = bidders.iter().flat_map(|(_, b)| b.tasks.iter());
        let claimed = claims.filter(|t| is_claim(t)).map(|t| t.task);
        let all: BTreeSet<TaskId> = claimed.filter(|t| self.is_held(*t)).collect();
        let before = all
            .iter()
            .filter(|t| self.by_worth(**t) < self.by_worth(own));
        before.count() >= self.most_held(&bidders)
    }

    /// Lets go of what this peer holds, if it was one too many for long enough that others
    /// would have been heard of.
    pub(super) fn drop_to_cover(&mut self) -> Vec<Effect> {
        if self.too_many < self.patience {
            return Vec::new();
        }
        self.too_many = 0;
        let lost: Vec<TaskId> = self.own_held().map(|t| t.task).into_iter().collect();
        self.let_go(&lost)
    }
}

/// Whether somebody is under way to it, or at it.
fn is_claim(held: &BundleTask) -> bool {
    !matches!(held.progress, Progress::Tentative | Progress::Done)
}
