//! The default planner: a region for each UAV, a path round it, and a local search that
//! evens the times and removes repeats (D2.7 §3.6.4–3.6.5, and what beats them).
//!
//! It stops after a number of *steps*, not after a time, so that every peer computes the
//! same plan byte for byte.

use super::map::{Cell, NOWHERE};
use super::partition;
use super::plan::{Plan, Task};
use super::search::Search;
use super::spanning::{Tree, best_offset, region_loops};

/// Steps in a round: between two of them the aim is set anew and the caller may stop.
pub const ROUND: usize = 20_000;

/// Steps by default.
pub const STEPS: usize = 3_000_000;

/// A plan that gets better the longer it is improved.
pub struct Improver<'a> {
    task: &'a Task,
    search: Search<'a>,
    best: Vec<Vec<Cell>>,
    best_makespan: i64,
    done: usize,
    steps: usize,
}

/// Plans with the default number of steps.
#[must_use]
pub fn best(task: &Task) -> Plan {
    let mut improver = Improver::new(task, STEPS);
    while improver.round() {}
    improver.plan()
}

impl<'a> Improver<'a> {
    /// The first plan: regions and loops round them; `steps` is how long the search is
    /// going to be.
    #[must_use]
    pub fn new(task: &'a Task, steps: usize) -> Self {
        let search = Search::new(task, first_orders(task));
        let best = search.orders().to_vec();
        let best_makespan = search.makespan();
        Self {
            task,
            search,
            best,
            best_makespan,
            done: 0,
            steps,
        }
    }

    /// Improves for one round; false when the steps are spent.
    pub fn round(&mut self) -> bool {
        if self.done >= self.steps {
            return false;
        }
        let left = (self.steps - self.done) as i64;
        // Cooling to nothing at three quarters of the way.
        let heat = (left * 4 / self.steps.max(1) as i64).max(0);
        let _ = heat;
        self.search
            .heat(300 * (left - self.steps as i64 / 4).max(0) / self.steps as i64);
        self.search.run(ROUND.min(self.steps - self.done));
        self.done += ROUND;
        self.search.aim();
        let makespan = self.search.makespan();
        if makespan < self.best_makespan {
            self.best_makespan = makespan;
            self.best = self.search.orders().to_vec();
        }
        true
    }

    /// The best plan so far.
    #[must_use]
    pub fn plan(&self) -> Plan {
        self.task.fly(&self.best)
    }
}

/// Each UAV's region in the order of a loop round it, cut open where it enters.
fn first_orders(task: &Task) -> Vec<Vec<Cell>> {
    let offset = best_offset(&task.map);
    let regions = partition::regions(task, offset);
    let entries: Vec<Cell> = regions.entry.iter().flatten().copied().collect();
    let loops = region_loops(
        &task.map,
        &regions.owner,
        offset,
        Tree::DepthFirst,
        &entries,
    );
    let order = |entry: &Option<Cell>| {
        let mut order = entry.map(|e| loops.from(e)).unwrap_or_default();
        // An open path drops the last link: the longer one of the two at the entry.
        let link = |c: Option<&Cell>| {
            let (entry, c) = (
                order.first().copied().unwrap_or(NOWHERE),
                c.copied().unwrap_or(NOWHERE),
            );
            task.map.straight(entry, c)
        };
        if link(order.get(1)) > link(order.last()) {
            order[1..].reverse();
        }
        order
    };
    regions.entry.iter().map(order).collect()
}
