//! Handover of the last cells of a UAV that a plan gives far more than the others, where another
//! could serve them sooner.
//!
//! The search goes by curves without zones wherever it has not asked for a way yet, so behind
//! walls it may end with a plan that leaves a far cell to whoever is last. Here only ways that
//! the router knows count, and only those that this takes are asked for.
//!
//! # Guarantees
//! By the ways that the router finds, the plan that comes out is never worse by
//! [`Tours::cost`], flies the same cells and keeps every endurance. Unless the number of
//! steps ended it, nobody is overburdened as [`shares`](super::super::shares) has it.

use super::{RUNS_MAX, Run, Search, Tours};
use crate::coverage::ring::shares::{EVEN_SHARES_MAX, SOONER_PERCENT};
use core::cmp::Reverse;

/// Most pieces that are moved. Each makes the later of the two that it moves between sooner.
const HANDOVERS_MAX: usize = 64;

/// What whole milliseconds and millimetres take off a duration at most, milliseconds.
const ROUNDING_MS: u64 = 3;

impl Search<'_> {
    /// The plan after the last cells of whoever has too much went to others, while there is
    /// somebody who has too much and somebody who serves them sooner. The plan's ways are
    /// proved.
    pub fn handed_over(&mut self, mut plan: Tours) -> Tours {
        for _ in 0..HANDOVERS_MAX {
            let Some(next) = self.handover(&plan) else {
                break;
            };
            plan = next;
        }
        plan
    }

    /// The plan with one piece moved.
    fn handover(&mut self, plan: &Tours) -> Option<Tours> {
        let speed_mmps: u64 = self.uavs.iter().map(|u| u64::from(u.speed_mmps)).sum();
        let even_ms = self.served_mm[self.open.len()] * 1000 / speed_mmps.max(1);
        let given_ms = |u: usize| plan.tours[u].done_ms.saturating_sub(self.ready_ms(u));
        let uavs = 0..plan.tours.len();
        let mut late: Vec<usize> = uavs
            .filter(|u| given_ms(*u) > EVEN_SHARES_MAX * even_ms)
            .collect();
        late.sort_by_key(|u| (Reverse(plan.tours[*u].done_ms), *u));
        late.into_iter().find_map(|u| self.handover_from(u, plan))
    }

    /// The plan in which another serves the last cells of this UAV: whoever would have
    /// served the very last one soonest, as many as make both end soonest.
    fn handover_from(&mut self, late: usize, plan: &Tours) -> Option<Tours> {
        let own = &plan.tours[late];
        let run = *own.runs.last()?;
        let mut helper: Option<(u64, usize)> = None;
        for to in (0..plan.tours.len()).filter(|to| *to != late) {
            for forward in [true, false] {
                let last = Run {
                    forward,
                    ..self.tail(&run, 1)
                };
                let soonest_ms = helper.map_or(u64::MAX, |(ms, _)| ms);
                let is_sooner = |ms: u64| {
                    let rounded_ms = ms.saturating_sub(ROUNDING_MS);
                    ms < soonest_ms && rounded_ms * u64::from(SOONER_PERCENT) < own.done_ms * 100
                };
                if let Some(ms) = self.proved_end_ms((to, plan), &last, is_sooner) {
                    helper = Some((ms, to));
                }
            }
        }
        let (_, to) = helper?;
        let mut best: Option<(u64, Tours)> = None;
        let mut count = 1;
        while count <= run.count {
            let mut rest = own.runs.clone();
            rest.pop();
            if count < run.count {
                rest.push(self.head(&run, run.count - count));
            }
            let rest = self.tour(late, rest);
            for forward in [run.forward, !run.forward] {
                let piece = Run {
                    forward,
                    ..self.tail(&run, count)
                };
                let most_ms = best.as_ref().map_or(own.done_ms, |(ms, _)| *ms);
                let is_sooner = |ms: u64| ms.max(rest.done_ms) < most_ms;
                if let Some(ms) = self.proved_end_ms((to, plan), &piece, is_sooner) {
                    let mut next = plan.clone();
                    let mut runs = plan.tours[to].runs.clone();
                    let follows = runs
                        .last()
                        .is_some_and(|r| self.exit(r) == self.entry(&piece));
                    runs.push(piece);
                    if follows {
                        self.merge(&mut runs);
                    }
                    next.tours[late] = rest.clone();
                    next.tours[to] = self.tour(to, runs);
                    best = Some((ms.max(rest.done_ms), next));
                }
            }
            count += 1 + count / 3;
        }
        let (_, next) = best?;
        (next.cost() < plan.cost() && self.is_flyable(&next)).then_some(next)
    }

    /// When a UAV would end that flies a run after all of its own, by a way that the router
    /// knows; nothing where it may not, or where that is not wanted.
    fn proved_end_ms(
        &mut self,
        (uav, plan): (usize, &Tours),
        run: &Run,
        is_wanted: impl Fn(u64) -> bool,
    ) -> Option<u64> {
        let tour = &plan.tours[uav];
        if tour.runs.len() >= RUNS_MAX {
            return None;
        }
        let last = tour.runs.last();
        let from = last.map_or_else(|| self.transfers.start(uav), |r| self.exit(r));
        let to = self.entry(run);
        let ends_ms = |search: &Self| {
            let mm = tour.flown_mm + search.transfers.mm(from, to) + search.work_mm(run);
            search.done_ms(uav, mm).filter(|ms| is_wanted(*ms))
        };
        // Without zones no way is longer: most need not be asked for.
        ends_ms(self)?;
        if from != to {
            self.transfers.prove(from, to);
        }
        ends_ms(self)
    }

    /// So many cells of a run, those that are flown last.
    fn tail(&self, run: &Run, count: usize) -> Run {
        let skipped = if run.forward { run.count - count } else { 0 };
        let first = (run.first + skipped) % self.open.len();
        Run {
            first,
            count,
            ..*run
        }
    }

    /// So many cells of a run, those that are flown first.
    fn head(&self, run: &Run, count: usize) -> Run {
        let skipped = if run.forward { 0 } else { run.count - count };
        let first = (run.first + skipped) % self.open.len();
        Run {
            first,
            count,
            ..*run
        }
    }
}
