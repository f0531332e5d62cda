//! Work for UAVs of whom many have to fly far to get any: equal arcs of one loop over all
//! cells, each for the UAV that it suits (after "MSTC*", Tang, Sun and Zhang, ICRA 2021;
//! D2.7 §3.6.5 lets UAVs only follow the loop).
//!
//! Regions that grow from where UAVs begin are as many on each side of a narrow place as
//! UAVs begin there, and what passes a border cell by cell does not change that. Here the
//! work is divided without heeding where UAVs begin, and then they are sent to it: as many
//! cross as there are arcs on the other side, those for whom it is least.
//!
//! Left to others: everything that a local search finds.

use super::map::Cell;
use super::partition::assign::assign;
use super::plan::Task;
use super::root_distances::Home;
use super::spanning::{Tree, lean_loop};

/// More UAVs than this are not assigned: the time for it grows with their cube.
const MOST_ASSIGNED: usize = 256;

/// Times that arcs are given to UAVs anew after their lengths were evened.
const EVENINGS: usize = 8;

/// Places where the first arc begins that are tried, within one arc.
const OFFSETS: usize = 4;

/// Loops whose arcs are tried.
const TREES: [Tree; 4] = [
    Tree::BreadthFirst,
    Tree::DepthFirst,
    Tree::Rows,
    Tree::Columns,
];

/// Powers of the times of which the sum is to be least: the first saves ways, the second spares
/// those who have the longest ones.
const POWERS: [i32; 2] = [1, 2];

/// Steps of assigning arcs at most, but for the first try: the cube of the UAVs each time.
const MOST_STEPS: usize = 50_000_000;

/// Halvings by which the time is found in which all can fly their arcs.
const HALVINGS: usize = 40;

/// Orders of arcs of the loop over all cells, of those tried, of which the last UAV is done
/// first; none where there is no such loop, or too many UAVs.
pub(super) fn orders(task: &Task, home: &Home) -> Option<Vec<Vec<Cell>>> {
    let k = task.n_uavs();
    let root = *task.roots.first()?;
    if k > MOST_ASSIGNED {
        return None;
    }
    let mut tries = (MOST_STEPS / (EVENINGS * k.pow(3))).max(1);
    let mut best: Option<(f64, Vec<Vec<Cell>>)> = None;
    for tree in TREES {
        if tries == 0 {
            break;
        }
        let cells = lean_loop(&task.map, root, tree);
        let n = cells.len();
        // From one root only its own part of the map is reached.
        if n != task.map.n_free() || n < k {
            return None;
        }
        let dealer = Dealer { task, home, cells };
        let all = POWERS
            .into_iter()
            .flat_map(|p| (0..OFFSETS).map(move |i| (p, i)));
        for (power, i) in all {
            if tries == 0 {
                break;
            }
            tries -= 1;
            let (latest, arcs) = dealer.dealt(i * n / (OFFSETS * k), power);
            if best.as_ref().is_none_or(|(least, _)| latest < *least) {
                best = Some((latest, dealer.orders(&arcs)));
            }
        }
    }
    best.map(|(_, orders)| orders)
}

/// A run of cells of the loop, and who flies it.
#[derive(Clone, Copy)]
struct Arc {
    uav: usize,
    from: usize,
    len: usize,
}

struct Dealer<'a> {
    task: &'a Task,
    home: &'a Home,
    /// The loop.
    cells: Vec<Cell>,
}

impl Dealer<'_> {
    fn cell(&self, place: usize) -> Cell {
        self.cells[place % self.cells.len()]
    }

    /// By UAV: the cells of its arc.
    fn orders(&self, arcs: &[Arc]) -> Vec<Vec<Cell>> {
        let mut orders = vec![Vec::new(); arcs.len()];
        for arc in arcs {
            orders[arc.uav] = (0..arc.len).map(|i| self.cell(arc.from + i)).collect();
        }
        orders
    }

    /// Arcs of which the first begins at a place, and the longest time for one in moves of
    /// the fastest UAV.
    fn dealt(&self, begin: usize, power: i32) -> (f64, Vec<Arc>) {
        let (n, k) = (self.cells.len(), self.task.n_uavs());
        let even = |i: usize| Arc {
            uav: i,
            from: begin + i * n / k,
            len: (i + 1) * n / k - i * n / k,
        };
        let mut arcs: Vec<Arc> = (0..k).map(even).collect();
        let mut best = (f64::INFINITY, Vec::new());
        for _ in 0..EVENINGS {
            self.give(&mut arcs, power);
            self.even(&mut arcs);
            let latest = arcs.iter().map(|a| self.time(a.uav, a));
            let latest = latest.fold(0.0, f64::max);
            if latest < best.0 {
                best = (latest, arcs.clone());
            }
        }
        best
    }

    /// Gives each arc to a UAV, so that the powers of all times are least together.
    fn give(&self, arcs: &mut [Arc], power: i32) {
        #[allow(
            clippy::cast_possible_truncation,
            reason = "times are far below what a whole number holds"
        )]
        let cost = |uav: usize, i: usize| self.time(uav, &arcs[i]).powi(power).min(1e15) as i64;
        let arc_of = assign(arcs.len(), cost);
        for (uav, arc) in arc_of.into_iter().enumerate() {
            arcs[arc].uav = uav;
        }
    }

    /// Makes arcs as long as their UAVs can fly in a common time, in the order that they have.
    fn even(&self, arcs: &mut [Arc]) {
        let n = self.cells.len() as f64;
        let lengths = |time: f64| -> Vec<f64> {
            let each = arcs.iter().map(|arc| {
                let moves = time * self.pace(arc.uav) - self.way(arc.uav, arc);
                let most = f64::from(self.task.endurance[arc.uav]) - self.way(arc.uav, arc);
                moves.min(most).max(0.0)
            });
            each.collect()
        };
        let (mut low, mut high) = (0.0, 4.0 * f64::from(u32::MAX));
        if lengths(high).iter().sum::<f64>() < n {
            // The endurance of all is too short: nobody's share is better than another.
            return;
        }
        for _ in 0..HALVINGS {
            let time = f64::midpoint(low, high);
            if lengths(time).iter().sum::<f64>() < n {
                low = time;
            } else {
                high = time;
            }
        }
        let wanted = lengths(high);
        let all: f64 = wanted.iter().sum();
        let begin = arcs[0].from;
        let mut done = 0.0;
        let mut from = 0;
        for (arc, wanted) in arcs.iter_mut().zip(wanted) {
            done += wanted;
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "no more than there are cells"
            )]
            let to = ((done / all * n).round() as usize).min(self.cells.len());
            (arc.from, arc.len) = (begin + from, to - from);
            from = to;
        }
        // Rounding may have left the last cell to nobody.
        if let Some(last) = arcs.last_mut() {
            last.len += self.cells.len() - from;
        }
    }

    /// The time of a UAV for an arc, in moves of the fastest one.
    fn time(&self, uav: usize, arc: &Arc) -> f64 {
        (self.way(uav, arc) + arc.len as f64) / self.pace(uav)
    }

    /// How fast a UAV is as a part of the fastest.
    fn pace(&self, uav: usize) -> f64 {
        let fastest = self.task.speeds.iter().copied().max().unwrap_or(1).max(1);
        f64::from(self.task.speeds[uav].max(1)) / f64::from(fastest)
    }

    /// Moves of a UAV to an arc and, if it returns, from there.
    fn way(&self, uav: usize, arc: &Arc) -> f64 {
        let root = self.task.roots[uav];
        let moves = |cell: Cell| {
            let known = self.home.moves(root, cell);
            f64::from(known.unwrap_or_else(|| self.task.map.straight(root, cell)))
        };
        let first = moves(self.cell(arc.from));
        if !self.task.closed {
            return first;
        }
        first + moves(self.cell(arc.from + arc.len.max(1) - 1))
    }
}

#[cfg(test)]
mod tests {
    use super::super::map::LaneMap;
    use super::*;

    #[test]
    fn as_many_cross_a_wall_as_there_is_work_behind_it() {
        // Two halves, a gap of one cell; all but two UAVs begin in one of them.
        let map = LaneMap::new(40, 41, |r, c| c != 20 || r == 31).unwrap();
        let root = |u: u32| if u < 14 { (u, 3) } else { (u, 35) };
        let roots: Vec<Cell> = (0..16)
            .map(|u| map.cell(root(u).0, root(u).1).unwrap())
            .collect();
        for closed in [true, false] {
            let task = Task::new(&map, &roots, closed).unwrap();
            let found = orders(&task, &Home::new(&task)).unwrap();
            let mut all: Vec<Cell> = found.iter().flatten().copied().collect();
            all.sort_unstable();
            assert_eq!(all, task.map.cells().collect::<Vec<Cell>>());
            let east = |c: &Cell| map.place(*c).1 > 20;
            let east = found.iter().filter(|o| o.first().is_some_and(east)).count();
            // Who crosses has less time left to work: rather more than half of them.
            assert!((6..=12).contains(&east), "{east} of 16, closed {closed}");
        }
    }

    #[test]
    fn fewer_cells_than_uavs_or_parts_that_are_apart_are_left_to_others() {
        let map = LaneMap::new(1, 3, |_, _| true).unwrap();
        let root = map.cell(0, 0).unwrap();
        let orders_of = |map: &LaneMap, roots: &[Cell]| {
            let task = Task::new(map, roots, true).unwrap();
            orders(&task, &Home::new(&task))
        };
        assert!(orders_of(&map, &[root; 4]).is_none());
        assert!(orders_of(&map, &[root; 3]).is_some());
        let apart = LaneMap::new(1, 5, |_, c| c != 2).unwrap();
        let both = [apart.cell(0, 0).unwrap(), apart.cell(0, 4).unwrap()];
        assert!(orders_of(&apart, &both).is_none());
    }
}
