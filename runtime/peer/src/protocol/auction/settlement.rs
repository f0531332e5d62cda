//! How a set of offers shares a set of tasks: a sequential auction, improved until no
//! exchange of two UAVs gains anything (D2.7 §1.2.3, §3.2).
//!
//! 1. Every UAV bids for every open task what doing it adds to the value of its order, at the
//!    best place of that order. The highest `(bid, -id)` wins; only the winner bids anew. So
//!    on until nobody can do anything more: sequential greedy, as CBBA (Choi, Brunet, How
//!    2009) approaches it by exchange.
//! 2. A task goes to another place or UAV, two tasks change UAVs, or two UAVs exchange the
//!    ends of their orders, as long as that gains.
//! 3. Some tasks are taken out, put back one after the other where they add most, and all is
//!    improved again; what gains stays. Which, is drawn from a stream that all share.
//!
//! # Guarantees
//! A pure function of [`Problem`]: whoever knows the same offers and tasks gets the same
//! answer, without another message. The value is never below that of sequential greedy. No
//! task is in two orders; a task that somebody could append to its order is in one.
//!
//! # Complexity
//! With m tasks, n UAVs and orders of length k: n·m·k² steps of [`Flying::then`] and another
//! m²·k² for the auction; the improvement ends after [`STEPS_MAX`](super::improvement::STEPS_MAX) of them at the latest.

use crate::PeerId;
use crate::wire::tasks::{Offer, Task, TaskId};
use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};

/// Tasks by name.
pub type Tasks = BTreeMap<TaskId, Task>;

/// What UAVs gain by tasks, step by step. Integers, so that everybody gets the same.
pub trait Flying {
    /// Where a UAV is in its order, and when.
    type At: Clone;

    /// Where its order begins.
    fn begin(&self, who: PeerId, offer: &Offer) -> Self::At;

    /// Does a task next: where that leaves it, and the value of the task done then.
    /// Nothing where it cannot.
    fn then(&self, at: &Self::At, id: TaskId, task: &Task) -> Option<(Self::At, u32)>;
}

/// A UAV that bids.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Bidder {
    /// Who.
    pub id: PeerId,
    /// What its bids follow from.
    pub offer: Offer,
    /// Tasks that it does first whatever is decided, in order.
    pub first: Vec<TaskId>,
    /// Open tasks that it must not win: those that it wants to be relieved of.
    pub barred: BTreeSet<TaskId>,
    /// How many tasks it can win at most.
    pub room: usize,
}

/// Who bids for what.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Problem {
    /// Ascending by id.
    pub bidders: Vec<Bidder>,
    /// What is to be had, ascending.
    pub open: Vec<TaskId>,
}

/// Who won what, in the order of the bidders.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct Settlement {
    /// What each won, in the order in which it is flown, and what each task adds to the
    /// value of that order.
    pub orders: Vec<Vec<(TaskId, u32)>>,
    /// What nobody can do, ascending.
    pub unassigned: Vec<TaskId>,
    /// The value of all orders, and of what bidders do first.
    pub value: u64,
}

/// Whoever settles problems: a part of a peer that can remember, or compute elsewhere.
pub trait Settler {
    /// [`settle`], for the UAVs that it knows.
    fn settle(&self, problem: &Problem, tasks: &Tasks) -> Settlement;
}

impl<F: Flying> Settler for F {
    fn settle(&self, problem: &Problem, tasks: &Tasks) -> Settlement {
        settle(problem, tasks, self)
    }
}

/// Settles without the improvement: sequential greedy alone.
#[must_use]
pub fn settle_greedily<F: Flying>(problem: &Problem, tasks: &Tasks, flying: &F) -> Settlement {
    let mut desk = Desk::new(problem, tasks, flying);
    desk.auction();
    desk.settlement()
}

/// Settles.
#[must_use]
pub fn settle<F: Flying>(problem: &Problem, tasks: &Tasks, flying: &F) -> Settlement {
    let mut desk = Desk::new(problem, tasks, flying);
    desk.auction();
    desk.steps.set(0);
    desk.improve();
    desk.shake();
    desk.settlement()
}

/// Where a task adds most to an order of a UAV, and what it adds; nothing where it cannot.
#[must_use]
pub fn best_insertion<F: Flying>(
    (id, offer): (PeerId, &Offer),
    order: &[TaskId],
    task: TaskId,
    (tasks, flying): (&Tasks, &F),
) -> Option<(i64, usize)> {
    let problem = Problem::alone(id, offer);
    let desk = Desk::new(&problem, tasks, flying);
    let plan = desk.replan(desk.plans.first()?, order.to_vec())?;
    let place = desk.best_place(&plan, task)?;
    Some((place.gain, place.index))
}

/// The value of an order of a UAV; nothing where it cannot fly it.
#[must_use]
pub fn value_of<F: Flying>(
    (id, offer): (PeerId, &Offer),
    order: &[TaskId],
    (tasks, flying): (&Tasks, &F),
) -> Option<u64> {
    let problem = Problem::alone(id, offer);
    let desk = Desk::new(&problem, tasks, flying);
    let worth = desk.worth(desk.plans.first()?.at.first()?, order.iter().copied())?;
    u64::try_from(worth).ok()
}

impl Problem {
    fn alone(id: PeerId, offer: &Offer) -> Self {
        let bidder = Bidder {
            id,
            offer: *offer,
            first: Vec::new(),
            barred: BTreeSet::new(),
            room: usize::MAX,
        };
        Self {
            bidders: vec![bidder],
            open: Vec::new(),
        }
    }
}

/// The order of one UAV, with what is known after each of its tasks.
#[derive(Clone)]
pub(super) struct Plan<A> {
    pub(super) order: Vec<TaskId>,
    /// Before the first task and after each.
    at: Vec<A>,
    /// Value so far, likewise.
    value: Vec<i64>,
}

impl<A: Clone> Plan<A> {
    pub(super) fn total(&self) -> i64 {
        self.value.last().copied().unwrap_or(0)
    }
}

/// Where a task would go, and what it would add there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) gain: i64,
    pub(super) index: usize,
}

/// The desk at which one problem is settled.
pub(super) struct Desk<'a, F: Flying> {
    pub(super) problem: &'a Problem,
    tasks: &'a Tasks,
    flying: &'a F,
    pub(super) plans: Vec<Plan<F::At>>,
    pub(super) left: BTreeSet<TaskId>,
    /// Steps of the improvement so far.
    pub(super) steps: Cell<u64>,
}

impl<'a, F: Flying> Desk<'a, F> {
    fn new(problem: &'a Problem, tasks: &'a Tasks, flying: &'a F) -> Self {
        let then = |at: &F::At, id: TaskId| flying.then(at, id, tasks.get(&id)?);
        let plan = |bidder: &Bidder| {
            let (mut at, mut value) = (flying.begin(bidder.id, &bidder.offer), 0);
            for task in &bidder.first {
                // What it can no longer do it will hand back: it costs no time.
                if let Some((next, adds)) = then(&at, *task) {
                    (at, value) = (next, value + i64::from(adds));
                }
            }
            Plan {
                order: Vec::new(),
                at: vec![at],
                value: vec![value],
            }
        };
        Self {
            problem,
            tasks,
            flying,
            plans: problem.bidders.iter().map(plan).collect(),
            left: problem.open.iter().copied().collect(),
            steps: Cell::new(0),
        }
    }

    pub(super) fn may_have(&self, bidder: usize, task: TaskId) -> bool {
        !self.problem.bidders[bidder].barred.contains(&task)
    }

    fn step(&self, at: &F::At, task: TaskId) -> Option<(F::At, i64)> {
        self.steps.set(self.steps.get() + 1);
        let (next, value) = self.flying.then(at, task, self.tasks.get(&task)?)?;
        Some((next, i64::from(value)))
    }

    /// The value of the rest of an order from somewhere on.
    fn worth(&self, at: &F::At, rest: impl IntoIterator<Item = TaskId>) -> Option<i64> {
        let (mut at, mut sum) = (at.clone(), 0);
        for task in rest {
            let (next, value) = self.step(&at, task)?;
            (at, sum) = (next, sum + value);
        }
        Some(sum)
    }

    /// Another order of the same UAV, from the first task that differs on.
    pub(super) fn replan(&self, plan: &Plan<F::At>, order: Vec<TaskId>) -> Option<Plan<F::At>> {
        let same = order.iter().zip(&plan.order);
        let same = same.take_while(|(a, b)| a == b).count();
        let mut new = Plan {
            at: plan.at[..=same].to_vec(),
            value: plan.value[..=same].to_vec(),
            order,
        };
        for k in same..new.order.len() {
            let (next, value) = self.step(&new.at[k], new.order[k])?;
            new.value.push(new.value[k] + value);
            new.at.push(next);
        }
        Some(new)
    }

    /// The place of an order at which a task adds most; of equal ones the last, which
    /// delays least.
    pub(super) fn best_place(&self, plan: &Plan<F::At>, task: TaskId) -> Option<Place> {
        let mut best: Option<Place> = None;
        for index in (0..=plan.order.len()).rev() {
            let rest = plan.order[index..].iter().copied();
            let rest = std::iter::once(task).chain(rest);
            let Some(worth) = self.worth(&plan.at[index], rest) else {
                continue;
            };
            let gain = plan.value[index] + worth - plan.total();
            if best.is_none_or(|b| gain > b.gain) {
                best = Some(Place { gain, index });
            }
        }
        best
    }

    pub(super) fn bid(&self, bidder: usize, task: TaskId) -> Option<Place> {
        let plan = &self.plans[bidder];
        let full = plan.order.len() >= self.problem.bidders[bidder].room;
        if full || !self.may_have(bidder, task) {
            return None;
        }
        self.best_place(plan, task)
    }

    pub(super) fn insert(&mut self, bidder: usize, task: TaskId, index: usize) {
        let mut order = self.plans[bidder].order.clone();
        order.insert(index, task);
        if let Some(plan) = self.replan(&self.plans[bidder], order) {
            self.plans[bidder] = plan;
            self.left.remove(&task);
        }
    }

    /// Sells one task after the other to whoever bids most.
    pub(super) fn auction(&mut self) {
        let tasks: Vec<TaskId> = self.left.iter().copied().collect();
        let bids = |desk: &Self, b| tasks.iter().map(|t| desk.bid(b, *t)).collect();
        let mut table: Vec<Vec<Option<Place>>> =
            (0..self.plans.len()).map(|b| bids(self, b)).collect();
        loop {
            let mut best: Option<(i64, usize, usize, usize)> = None;
            for (b, row) in table.iter().enumerate() {
                for (t, place) in row.iter().enumerate() {
                    if let Some(p) = place.filter(|_| self.left.contains(&tasks[t]))
                        && best.is_none_or(|(gain, ..)| p.gain > gain)
                    {
                        best = Some((p.gain, b, t, p.index));
                    }
                }
            }
            let Some((_, b, t, index)) = best else {
                return;
            };
            self.insert(b, tasks[t], index);
            for (t, task) in tasks.iter().enumerate() {
                let open = self.left.contains(task);
                table[b][t] = if open { self.bid(b, *task) } else { None };
            }
        }
    }

    pub(super) fn without(&self, bidder: usize, task: TaskId) -> Option<Plan<F::At>> {
        let plan = &self.plans[bidder];
        let order = plan.order.iter().copied().filter(|t| *t != task).collect();
        self.replan(plan, order)
    }

    fn settlement(self) -> Settlement {
        let bid = |bidder: usize, task: TaskId| {
            let rest = self.without(bidder, task).map_or(0, |p| p.total());
            let adds = self.plans[bidder].total() - rest;
            (task, u32::try_from(adds.max(0)).unwrap_or(u32::MAX))
        };
        let order = |b: usize| self.plans[b].order.iter().map(|t| bid(b, *t)).collect();
        let value: i64 = self.plans.iter().map(Plan::total).sum();
        Settlement {
            orders: (0..self.plans.len()).map(order).collect(),
            unassigned: self.left.iter().copied().collect(),
            value: u64::try_from(value).unwrap_or(0),
        }
    }
}
