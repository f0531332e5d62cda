//! The default planner: a region for each UAV, a path round it, and a local search that
//! evens the times and removes repeats (D2.7 §3.6.4–3.6.5, and what beats them).
//!
//! It stops after a number of *steps*, not after a time, so that every peer computes the
//! same plan byte for byte.

use super::insertion::insert_missing;
use super::map::Cell;
use super::partition::{Partition, Regions};
use super::plan::{Plan, Task};
use super::root_distances::Home;
use super::search::{PACE, Search};
use super::spanning::{Tree, best_offset, region_loops};
use super::{bounds, corridor_first, loop_arcs};
use std::sync::Arc;

/// Steps in a round: between two of them the aim is set anew and the caller may stop.
pub const ROUND: usize = 20_000;

/// Loss accepted at the beginning of coolings in turn, thousandths of a move: the hot one
/// moves work from afar, the mild one leaves less flown twice.
const HEATS: [i64; 2] = [1500, 500];

/// Steps of each of the first coolings; of the next ones twice as many, and so on.
const FIRST_COOLING: usize = 750_000;

/// Times that work is peeled off to find how many moves suffice.
const PEELS: usize = 6;

/// They end when one part in this many is all that is still unknown.
const NEAR: u32 = 100;

/// One cell in this many may be left over when work is peeled off: neighbours take it.
const FEW_LEFT: usize = 300;

/// Times that regions are evened by what their paths take.
const EVENINGS: usize = 3;

/// Steps spent on each first plan to see which leads on.
const TRY: usize = 6 * ROUND;

/// A first plan that takes this many times as long as the other one is not tried.
const OUT_OF_REACH: i64 = 2;

/// First plans that take more than so many hundredths of what any takes at least, seen from
/// the ways alone, are far from even: then UAVs are sent far, too.
const UNEVEN: i64 = 125;

/// Steps by default.
pub const STEPS: usize = 2 * TRY + 2 * FIRST_COOLING;

/// A plan that gets better the longer it is improved.
pub struct Improver<'a> {
    task: &'a Task,
    home: Arc<Home>,
    search: Search<'a>,
    /// First plans that have not been tried yet, and searches from those that have.
    waiting: Vec<Vec<Vec<Cell>>>,
    tried: Vec<Search<'a>>,
    best: Vec<Vec<Cell>>,
    best_score: (i64, i64),
    /// No makespan is less.
    bound: i64,
    done: usize,
    steps: usize,
    /// The cooling at hand: steps done when it began, and its number.
    began: usize,
    cooling: usize,
}

/// Steps that are worth it while a plan takes more than so many hundredths of what any takes at
/// least: few plans are that far, mostly of many UAVs that share few doors.
const WHILE_FAR: [(i64, usize); 3] = [(108, 8 * STEPS), (115, 16 * STEPS), (125, 48 * STEPS)];

/// Plans with the default number of steps, and with more while the plan is far from what any
/// takes at least: up to 8, 16 and 48 times as many while it takes more than 1.08, 1.15 and 1.25
/// times that.
///
/// # Guarantees
/// Covers every cell of the task, unless a UAV's endurance is too short. The same task
/// gives the same plan on every machine. No factor of the optimum is promised;
/// [`bounds`] says how far from it a plan can be.
///
/// # Complexity
/// O(k N) for the first plan; a step costs O(1) and, when it is taken, a move of up to
/// one UAV's cells in memory.
#[must_use]
pub fn best(task: &Task) -> Plan {
    let mut improver = Improver::new(task, STEPS);
    while improver.round() {}
    let least = improver.least();
    for (hundredths, steps) in WHILE_FAR {
        improver.steps = steps;
        let far = least.map(|least| least * PACE * hundredths / 100);
        while far.is_some_and(|far| improver.best_score > (0, far)) && improver.round() {}
    }
    improver.plan()
}

/// Length in steps, and loss accepted at the beginning in thousandths of a move.
fn cooling(number: usize) -> (usize, i64) {
    let length = FIRST_COOLING.saturating_mul(1 << (number / HEATS.len()).min(32));
    (length, HEATS[number % HEATS.len()])
}

impl<'a> Improver<'a> {
    /// The first plan: regions and loops round them; `steps` is how long the search is
    /// going to be, in whole rounds.
    #[must_use]
    pub fn new(task: &'a Task, steps: usize) -> Self {
        let home = Arc::new(Home::new(task));
        let mut firsts: Vec<Search<'a>> = first_orders(task, &home)
            .into_iter()
            .map(|orders| Search::with(task, Arc::clone(&home), orders))
            .collect();
        let equal = task.speeds.iter().all(|v| *v == task.speeds[0]);
        let bound = if equal {
            i64::from(bounds::reach_moves(task)) * PACE
        } else {
            0
        };
        let soonest = firsts.iter().map(Search::makespan).min();
        if soonest.is_none_or(|m| m > bound / 100 * UNEVEN)
            && let Some(orders) = loop_arcs::orders(task, &home)
        {
            firsts.push(Search::with(task, Arc::clone(&home), orders));
        }
        firsts.sort_by_key(Search::score);
        let search = firsts.remove(0);
        let least = search.makespan();
        firsts.retain(|s| s.makespan() < least * OUT_OF_REACH);
        let best = search.orders().to_vec();
        let best_score = search.score();
        firsts.reverse();
        Self {
            task,
            home,
            waiting: firsts.iter().map(|s| s.orders().to_vec()).collect(),
            search,
            tried: Vec::new(),
            best,
            best_score,
            bound,
            done: 0,
            steps,
            began: 0,
            cooling: 0,
        }
    }

    /// Moves that any plan takes at least; for equal UAVs only.
    fn least(&self) -> Option<i64> {
        let equal = self.task.speeds.iter().all(|v| *v == self.task.speeds[0]);
        equal.then(|| i64::from(bounds::least_moves(self.task)))
    }

    /// Improves for one round; false when the steps are spent or nothing better exists.
    pub fn round(&mut self) -> bool {
        if self.done >= self.steps || self.best_score <= (0, self.bound) {
            return false;
        }
        self.cool();
        self.search.run(ROUND);
        self.done += ROUND;
        self.search.aim();
        let score = self.search.score();
        if score < self.best_score {
            self.best_score = score;
            self.best = self.search.orders().to_vec();
        }
        true
    }

    /// Sets the heat of the next round: none while first plans are tried one after the
    /// other; then from the best of them in coolings, each longer than the one before.
    fn cool(&mut self) {
        if self.cooling == 0 {
            if self.done < self.began + TRY {
                return;
            }
            self.began = self.done;
            if let Some(next) = self.waiting.pop() {
                let next = Search::with(self.task, Arc::clone(&self.home), next);
                self.tried.push(core::mem::replace(&mut self.search, next));
                return;
            }
            while let Some(other) = self.tried.pop() {
                if other.score() <= self.search.score() {
                    self.search = other;
                }
            }
            self.cooling = 1;
        } else if self.done >= self.began + cooling(self.cooling - 1).0 {
            self.began = self.done;
            self.cooling += 1;
            if self.search.score() > self.best_score {
                self.search.restart(self.best.clone());
            }
        }
        // Cooling to nothing at three quarters of the way.
        let (length, hottest) = cooling(self.cooling - 1);
        let left = (self.began + length - self.done) as i64;
        let length = length as i64;
        self.search
            .heat(hottest * (left - length / 4).max(0) / length);
    }

    /// The best plan so far. A UAV whose endurance does not suffice flies as much of its
    /// share as it can; [`Plan::uncovered`] tells what is left.
    #[must_use]
    pub fn plan(&self) -> Plan {
        self.task.fly(&self.best)
    }
}

/// The first plans: a region each that all grow at once, and work peeled off from afar.
fn first_orders(task: &Task, home: &Arc<Home>) -> [Vec<Vec<Cell>>; 2] {
    let offset = best_offset(&task.map);
    [
        grown_orders(task, home, offset),
        peeled_orders(task, offset),
    ]
}

/// Work peeled off from afar, with about the least moves that suffice for all.
fn peeled_orders(task: &Task, offset: (u32, u32)) -> Vec<Vec<Cell>> {
    let n_cells = task.map.n_free();
    let n_uavs = u32::try_from(task.n_uavs()).unwrap_or(u32::MAX).max(1);
    let mut low = bounds::reach_moves(task);
    let mut high = u32::MAX;
    let mut moves = low + low / 80;
    let mut best = None;
    for _ in 0..PEELS {
        let (orders, left) = corridor_first::orders(task, offset, moves);
        if left * FEW_LEFT > n_cells {
            low = moves;
            let more = u32::try_from(left).unwrap_or(u32::MAX) / n_uavs;
            // What is left does not tell much when much is left.
            moves = (moves + 1 + more).min(low.midpoint(high).max(low + 1));
            best = best.or(Some(orders));
        } else {
            best = Some(orders);
            high = moves;
            moves = low.midpoint(moves);
        }
        if high - low <= 1 + low / NEAR {
            break;
        }
    }
    best.unwrap_or_default()
}

/// Regions that all grow at once, in the order of loops round them, shaken and evened
/// until that pays no more.
fn grown_orders(task: &Task, home: &Arc<Home>, offset: (u32, u32)) -> Vec<Vec<Cell>> {
    let mut partition = Partition::grown(task, home, offset);
    let mut best = loop_orders(task, &partition.regions(), offset);
    let mut search = Search::with(task, Arc::clone(home), best.clone());
    let mut best_score = search.score();
    for round in 0..=EVENINGS {
        if round == 0 {
            partition.shake();
        } else if partition.hopeless() {
            break;
        } else {
            partition.even(search.moves());
        }
        let orders = loop_orders(task, &partition.regions(), offset);
        search = Search::with(task, Arc::clone(home), orders.clone());
        if search.score() < best_score {
            best_score = search.score();
            best = orders;
        }
    }
    best
}

/// Regions in the order of loops round them.
fn loop_orders(task: &Task, regions: &Regions, offset: (u32, u32)) -> Vec<Vec<Cell>> {
    let entries: Vec<Cell> = regions.entry.iter().flatten().copied().collect();
    let loops = region_loops(
        &task.map,
        &regions.owner,
        offset,
        Tree::DepthFirst,
        &entries,
    );
    let order = |entry: &Option<Cell>| {
        let cells = entry.map(|e| loops.from(e));
        cells.map(|c| cut_open(task, c)).unwrap_or_default()
    };
    insert_missing(task, regions.entry.iter().map(order).collect())
}

/// An open path drops the last link of its loop: the longer one of the two at the entry.
fn cut_open(task: &Task, mut order: Vec<Cell>) -> Vec<Cell> {
    if let [entry, second, .., last] = order[..]
        && task.map.straight(entry, second) > task.map.straight(entry, last)
    {
        order[1..].reverse();
    }
    order
}

#[cfg(test)]
mod tests {
    use super::super::map::LaneMap;
    use super::*;
    use proptest::prelude::*;

    fn assert_sound(task: &Task, plan: &Plan) {
        assert_eq!(plan.n_covered(task), task.map.n_free());
        for (path, root) in plan.paths.iter().zip(&task.roots) {
            assert_eq!(path[0], *root);
            assert!(!task.closed || path.last() == Some(root));
            for step in path.windows(2) {
                assert!(task.map.adjacent(step[0], step[1]) && task.map.is_free(step[1]));
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]

        #[test]
        fn every_cell_is_covered_by_paths_from_the_roots(
            free in prop::collection::vec(prop::bool::weighted(0.75), 12 * 13),
            picks in prop::collection::vec(any::<prop::sample::Index>(), 1..6),
            closed in any::<bool>(),
            speeds in prop::collection::vec(1u32..4, 6),
        ) {
            let map = LaneMap::new(12, 13, |r, c| free[(r * 13 + c) as usize]).unwrap();
            let cells: Vec<Cell> = map.cells().collect();
            prop_assume!(!cells.is_empty());
            let roots: Vec<Cell> = picks.iter().map(|p| cells[p.index(cells.len())]).collect();
            let mut task = Task::new(&map, &roots, closed).unwrap();
            let mut improver = Improver::new(&task, 40_000);
            while improver.round() {}
            let plan = improver.plan();
            assert_sound(&task, &plan);
            prop_assert!(plan.makespan_moves() >= bounds::reach_moves(&task));
            task.speeds = speeds[..roots.len()].to_vec();
            let mut improver = Improver::new(&task, 20_000);
            while improver.round() {}
            assert_sound(&task, &improver.plan());
            for orders in [grown_orders(&task, &Arc::new(Home::new(&task)), (0, 1)), peeled_orders(&task, (1, 0))] {
                let mut all: Vec<Cell> = orders.into_iter().flatten().collect();
                all.sort_unstable();
                let cells: Vec<Cell> = task.map.cells().collect();
                prop_assert_eq!(all, cells, "each cell in one order");
            }
        }
    }

    #[test]
    fn from_one_base_more_uavs_pay() {
        let map = LaneMap::new(40, 40, |r, c| r % 9 != 4 || c % 7 > 1).unwrap();
        let base = |k: usize| vec![map.cell(20, 20).unwrap(); k];
        let mut last = u32::MAX;
        for k in [1, 2, 4, 8] {
            let task = Task::new(&map, &base(k), false).unwrap();
            let mut improver = Improver::new(&task, 300_000);
            while improver.round() {}
            let plan = improver.plan();
            assert_sound(&task, &plan);
            let ratio = f64::from(plan.makespan_moves()) / f64::from(bounds::reach_moves(&task));
            assert!(ratio < 1.12, "k = {k}: {ratio}");
            assert!(plan.makespan_moves() < last);
            last = plan.makespan_moves();
        }
    }

    /// Borders cannot even these: half of all cells lie in rooms one behind the other, each
    /// with one door, and the UAVs begin in the other half.
    #[test]
    fn rooms_behind_rooms_are_shared_by_all() {
        let room = |c: u32| c < 14 || c % 7 != 6;
        let map = LaneMap::new(12, 55, |r, c| room(c) || r == c / 7).unwrap();
        let roots: Vec<Cell> = (0..8).map(|u| map.cell(11, u).unwrap()).collect();
        let task = Task::new(&map, &roots, true).unwrap();
        let plan = best(&task);
        assert_sound(&task, &plan);
        let ratio = f64::from(plan.makespan_moves()) / f64::from(bounds::least_moves(&task));
        assert!(ratio < 1.2, "{ratio}");
    }

    #[test]
    fn one_more_uav_is_not_slower() {
        for every in [7, 11, 13] {
            let map = LaneMap::new(26, 34, |r, c| (r * 5 + c * c) % every != 0).unwrap();
            let cells: Vec<Cell> = map.cells().collect();
            let roots: Vec<Cell> = (0..8).map(|u| cells[u * 97 % cells.len()]).collect();
            let mut last = u32::MAX;
            for k in 1..=roots.len() {
                let task = Task::new(&map, &roots[..k], true).unwrap();
                let mut improver = Improver::new(&task, 400_000);
                while improver.round() {}
                let makespan = improver.plan().makespan_moves();
                assert!(
                    makespan <= last,
                    "{every}, {k} UAVs: {makespan} after {last}"
                );
                last = makespan;
            }
        }
    }

    #[test]
    fn more_steps_go_on_from_fewer() {
        let map = LaneMap::new(24, 40, |r, c| r % 6 != 5 || c % 8 > 1).unwrap();
        let task = Task::new(&map, &[map.cell(20, 20).unwrap(); 5], true).unwrap();
        let mut few = Improver::new(&task, 5 * ROUND);
        let mut many = Improver::new(&task, 40 * ROUND);
        while few.round() {
            many.round();
        }
        assert_eq!(few.plan(), many.plan());
        while many.round() {}
        assert!(many.plan().makespan_moves() <= few.plan().makespan_moves());
    }

    #[test]
    fn the_same_task_gives_the_same_plan() {
        let map = LaneMap::new(30, 30, |r, c| (r * 7 + c * 3) % 11 != 0).unwrap();
        let roots: Vec<Cell> = map.cells().step_by(200).collect();
        let task = Task::new(&map, &roots, false).unwrap();
        let plan = || {
            let mut improver = Improver::new(&task, 100_000);
            while improver.round() {}
            improver.plan()
        };
        assert_eq!(plan(), plan());
    }

    #[test]
    fn a_team_that_stands_on_all_of_its_cells_has_nothing_to_do() {
        let map = LaneMap::new(2, 1, |_, _| true).unwrap();
        for n_uavs in [1, 2, 3] {
            for closed in [false, true] {
                let roots = vec![map.cell(0, 0).unwrap(); n_uavs];
                let task = Task::new(&map, &roots, closed).unwrap();
                assert_eq!(best(&task).moves().len(), n_uavs);
            }
        }
        let map = LaneMap::new(1, 1, |_, _| true).unwrap();
        let task = Task::new(&map, &[map.cell(0, 0).unwrap()], true).unwrap();
        assert_eq!(best(&task).moves(), [0]);
    }

    #[test]
    fn a_short_endurance_is_kept_and_the_rest_is_told() {
        let map = LaneMap::new(20, 20, |_, _| true).unwrap();
        for closed in [false, true] {
            let roots = [map.cell(0, 0).unwrap(), map.cell(19, 19).unwrap()];
            let mut task = Task::new(&map, &roots, closed).unwrap();
            task.endurance = vec![50, 300];
            let mut improver = Improver::new(&task, 200_000);
            while improver.round() {}
            let plan = improver.plan();
            let moves = plan.moves();
            assert!(moves[0] <= 50 && moves[1] <= 300, "{moves:?}");
            let left = plan.uncovered(&task).len();
            assert_eq!(left + plan.n_covered(&task), 400);
            assert!(left <= 70, "{left}");
            // Enough for all when it is shared unevenly.
            task.endurance = vec![60, 360];
            let mut improver = Improver::new(&task, 200_000);
            while improver.round() {}
            let left = improver.plan().uncovered(&task).len();
            assert!(left <= 4, "{left}");
        }
    }
}
