//! How a settlement gets better than sequential greedy: by exchanges, and by taking some
//! tasks out and putting them back.

use super::settlement::{Desk, Flying, Place, Plan};
use crate::wire::tasks::TaskId;
use skein_geometry::random::SplitMix64;

/// Steps of flying that an improvement may try, all exchanges together: beyond eight tasks it is
/// what bounds them.
pub const STEPS_MAX: u64 = 100_000;

/// So often tasks are taken out and put back: with ten tasks more finds nothing better.
const SHAKES: usize = 60;

/// Seed of the draws of tasks to take out: the same for everybody.
const SHAKEN_BY: u64 = 0x0005_4A4B;

impl<F: Flying> Desk<'_, F> {
    /// Improves until nothing gains any more, or the steps are used up.
    pub(super) fn improve(&mut self) {
        let may = |desk: &Self| desk.steps.get() < STEPS_MAX;
        loop {
            let moved = self.move_tasks(&may);
            let moved = self.swap_tasks(&may) || moved;
            let moved = self.swap_ends(&may) || moved;
            if !moved || !may(self) {
                return;
            }
            // An exchange may have made room for what nobody could do.
            self.auction();
        }
    }

    fn total(&self) -> i64 {
        self.plans.iter().map(Plan::total).sum()
    }

    /// Takes some tasks out and puts them back, again and again.
    pub(super) fn shake(&mut self) {
        let mut random = SplitMix64::new(SHAKEN_BY);
        for _ in 0..SHAKES {
            let mut tasks: Vec<TaskId> =
                self.plans.iter().flat_map(|p| &p.order).copied().collect();
            if tasks.len() < 2 || self.steps.get() >= STEPS_MAX {
                return;
            }
            let before = (self.plans.clone(), self.left.clone());
            let total = self.total();
            random.shuffle(&mut tasks);
            tasks.truncate(2 + random.below(3));
            for task in &tasks {
                self.take_out(*task);
            }
            for task in &tasks {
                self.put_back(*task);
            }
            self.auction();
            self.improve();
            if self.total() <= total || self.left.len() > before.1.len() {
                (self.plans, self.left) = before;
            }
        }
    }

    fn take_out(&mut self, task: TaskId) {
        let holder = self.plans.iter().position(|p| p.order.contains(&task));
        if let Some(b) = holder
            && let Some(plan) = self.without(b, task)
        {
            self.plans[b] = plan;
            self.left.insert(task);
        }
    }

    fn put_back(&mut self, task: TaskId) {
        let mut best: Option<(Place, usize)> = None;
        for b in 0..self.plans.len() {
            if let Some(place) = self.bid(b, task)
                && best.is_none_or(|(p, _)| place.gain > p.gain)
            {
                best = Some((place, b));
            }
        }
        if let Some((place, b)) = best {
            self.insert(b, task, place.index);
        }
    }

    /// The two plans take the place of those of two bidders, if that gains.
    fn adopt(&mut self, new: [(usize, Plan<F::At>); 2]) -> bool {
        let before: i64 = new.iter().map(|(b, _)| self.plans[*b].total()).sum();
        let after: i64 = new.iter().map(|(_, p)| p.total()).sum();
        let gains = after > before;
        if gains {
            for (bidder, plan) in new {
                self.plans[bidder] = plan;
            }
        }
        gains
    }

    /// Each task where it adds most.
    fn move_tasks(&mut self, may: &impl Fn(&Self) -> bool) -> bool {
        let mut moved = false;
        for from in 0..self.plans.len() {
            for task in self.plans[from].order.clone() {
                let Some(rest) = self.without(from, task).filter(|_| may(self)) else {
                    continue;
                };
                let lost = self.plans[from].total() - rest.total();
                let own = self.best_place(&rest, task).map(|p| (p, from));
                let others = (0..self.plans.len()).filter(|b| *b != from);
                let others = others.filter_map(|b| Some((self.bid(b, task)?, b)));
                let mut best: Option<(Place, usize)> = None;
                for (place, b) in own.into_iter().chain(others) {
                    if place.gain > best.map_or(lost, |(p, _)| p.gain) {
                        best = Some((place, b));
                    }
                }
                if let Some((place, b)) = best {
                    self.plans[from] = rest;
                    self.insert(b, task, place.index);
                    moved = true;
                }
            }
        }
        moved
    }

    /// Each pair of bidders once.
    fn pairs(&self) -> Vec<(usize, usize)> {
        let n = self.plans.len();
        (0..n)
            .flat_map(|a| (a + 1..n).map(move |b| (a, b)))
            .collect()
    }

    /// Two tasks of two UAVs change hands.
    fn swap_tasks(&mut self, may: &impl Fn(&Self) -> bool) -> bool {
        let mut moved = false;
        for (a, b) in self.pairs() {
            for one in self.plans[a].order.clone() {
                for other in self.plans[b].order.clone() {
                    if !may(self) {
                        return moved;
                    }
                    if let Some(new) = self.swapped((a, one), (b, other))
                        && self.adopt(new)
                    {
                        moved = true;
                        break;
                    }
                }
            }
        }
        moved
    }

    fn swapped(
        &self,
        (a, one): (usize, TaskId),
        (b, other): (usize, TaskId),
    ) -> Option<[(usize, Plan<F::At>); 2]> {
        let held = self.plans[a].order.contains(&one) && self.plans[b].order.contains(&other);
        if !held || !self.may_have(a, other) || !self.may_have(b, one) {
            return None;
        }
        let with = |bidder, gives, takes| {
            let plan: Plan<F::At> = self.without(bidder, gives)?;
            let place = self.best_place(&plan, takes)?;
            let mut order = plan.order.clone();
            order.insert(place.index, takes);
            self.replan(&plan, order)
        };
        Some([(a, with(a, one, other)?), (b, with(b, other, one)?)])
    }

    /// Two UAVs exchange the ends of their orders.
    fn swap_ends(&mut self, may: &impl Fn(&Self) -> bool) -> bool {
        let mut moved = false;
        for (a, b) in self.pairs() {
            let (n, m) = (self.plans[a].order.len(), self.plans[b].order.len());
            let cuts = (0..=n).flat_map(|i| (0..=m).map(move |j| (i, j)));
            for (i, j) in cuts {
                if !may(self) {
                    return moved;
                }
                if let Some(new) = self.crossed((a, i), (b, j))
                    && self.adopt(new)
                {
                    moved = true;
                    break;
                }
            }
        }
        moved
    }

    fn crossed(
        &self,
        (a, i): (usize, usize),
        (b, j): (usize, usize),
    ) -> Option<[(usize, Plan<F::At>); 2]> {
        let (one, other) = (&self.plans[a].order, &self.plans[b].order);
        let joined = |head: &[TaskId], tail: &[TaskId]| [head, tail].concat();
        let new_a = joined(&one[..i], &other[j..]);
        let new_b = joined(&other[..j], &one[i..]);
        let fits = |bidder: usize, order: &[TaskId]| {
            order.len() <= self.problem.bidders[bidder].room
                && order.iter().all(|t| self.may_have(bidder, *t))
        };
        if !fits(a, &new_a) || !fits(b, &new_b) {
            return None;
        }
        let new_a = self.replan(&self.plans[a], new_a)?;
        Some([(a, new_a), (b, self.replan(&self.plans[b], new_b)?)])
    }
}
