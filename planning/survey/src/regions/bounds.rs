//! How long any plan takes at least (D2.7 §3.6): what a planner's answer is measured
//! against, without knowing the optimum.
//!
//! Cells at least `d` moves from every root can only be visited by UAVs that have spent
//! `d − 1` moves elsewhere; the rest of their moves visit at most one new cell each.

mod gates;
mod pairs;
mod sides;

use super::map::UNREACHED;
use super::plan::Task;

/// How many cells of the task lie at each distance from the nearest root.
fn layers(task: &Task) -> Vec<u64> {
    let moves = task.map.distances(&task.roots);
    let mut layers = Vec::new();
    for d in moves.into_iter().filter(|d| *d != UNREACHED) {
        let d = d as usize;
        if d >= layers.len() {
            layers.resize(d + 1, 0);
        }
        layers[d] += 1;
    }
    layers
}

/// No plan for equal UAVs has a shorter longest path, in moves.
///
/// # Guarantees
/// At most the optimum, open or closed as the task says; speeds and endurance are left
/// out.
///
/// # Complexity
/// O(N).
#[must_use]
pub fn reach_moves(task: &Task) -> u32 {
    let k = task.n_uavs().max(1) as u64;
    let mut far = 0;
    let mut bound = 0;
    let layers = layers(task);
    // Where every cell is a root no move is needed, not even there and back.
    if layers.len() <= 1 {
        return 0;
    }
    for (d, here) in (0u64..).zip(layers).collect::<Vec<_>>().into_iter().rev() {
        far += here;
        // A UAV that returns flies the way to the first and from the last far cell.
        let ways = if task.closed { 2 * d } else { d };
        let closing = u64::from(task.closed && d == 0);
        bound = bound.max((ways + far.div_ceil(k) + closing).saturating_sub(1));
    }
    u32::try_from(bound).unwrap_or(u32::MAX)
}

/// No plan for equal UAVs has a shorter longest path, in moves: the greatest of
/// [`reach_moves`], the bound of narrow places, the bound of sides and the bound of cells that
/// are no neighbours.
///
/// # Guarantees
/// At most the optimum, open or closed as the task says; speeds and endurance are left
/// out.
///
/// # Complexity
/// O(k N log N), and a matching, near O(N) on maps.
#[must_use]
pub fn least_moves(task: &Task) -> u32 {
    let reach = reach_moves(task);
    if reach == 0 {
        return 0;
    }
    let k = task.n_uavs().max(1) as u64;
    let visits = pairs::visits(task).div_ceil(k);
    // On a closed walk every second visit at most; an open one also begins and ends so.
    let paired = if task.closed {
        2 * visits.max(1)
    } else {
        (2 * visits).saturating_sub(2)
    };
    let paired = u32::try_from(paired).unwrap_or(u32::MAX);
    let sides = u32::try_from(sides::moves(task)).unwrap_or(u32::MAX);
    let moves = gates::Gates::new(task).least(reach.max(paired).max(sides));
    // A closed walk on a grid has as many moves east as west, north as south.
    moves + u32::from(task.closed && moves % 2 == 1)
}

#[cfg(test)]
mod tests {
    use super::super::map::{Cell, LaneMap};
    use super::*;
    use proptest::prelude::*;
    use std::collections::VecDeque;

    /// Moves of the shortest walk from `root` that visits each set of cells, by set;
    /// back to the root if closed.
    fn walks(cells: &[Cell], map: &LaneMap, root: Cell, closed: bool) -> Vec<u32> {
        let n = cells.len();
        let place = |c: Cell| cells.binary_search(&c).unwrap();
        let mut moves = vec![vec![u32::MAX; n]; 1 << n];
        let mut least = vec![u32::MAX; 1 << n];
        let start = place(root);
        moves[1 << start][start] = 0;
        let mut open = VecDeque::from([(1usize << start, start)]);
        while let Some((set, at)) = open.pop_front() {
            let here = moves[set][at];
            if !closed || at == start {
                least[set] = least[set].min(here);
            }
            for near in map.neighbours(cells[at]).map(place) {
                let to = set | 1 << near;
                if moves[to][near] == u32::MAX {
                    moves[to][near] = here + 1;
                    open.push_back((to, near));
                }
            }
        }
        least
    }

    /// The least longest walk of two or one UAVs that visit all cells.
    fn optimum(task: &Task) -> u32 {
        let cells: Vec<Cell> = task.map.cells().collect();
        let all = (1usize << cells.len()) - 1;
        let of = |root: Cell| walks(&cells, &task.map, root, task.closed);
        let one = of(task.roots[0]);
        let Some(second) = task.roots.get(1) else {
            return one[all];
        };
        let two = of(*second);
        // What a walk visits at most beyond a set costs no less: least over supersets.
        let mut least = u32::MAX;
        for (a, first) in one.iter().enumerate().filter(|x| *x.1 != u32::MAX) {
            for (b, other) in two.iter().enumerate().filter(|x| *x.1 != u32::MAX) {
                if a | b == all {
                    least = least.min(*first.max(other));
                }
            }
        }
        least
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        #[test]
        fn no_plan_is_below_the_bounds(
            free in prop::collection::vec(prop::bool::weighted(0.6), 15),
            picks in prop::collection::vec(any::<prop::sample::Index>(), 1..3),
            closed in any::<bool>(),
        ) {
            let map = LaneMap::new(3, 5, |r, c| free[(r * 5 + c) as usize]).unwrap();
            let cells: Vec<Cell> = map.cells().collect();
            prop_assume!(!cells.is_empty());
            let roots: Vec<Cell> = picks.iter().map(|p| cells[p.index(cells.len())]).collect();
            let task = Task::new(&map, &roots, closed).unwrap();
            prop_assume!(task.map.n_free() <= 11);
            let least = optimum(&task);
            prop_assert!(reach_moves(&task) <= least);
            prop_assert!(least_moves(&task) <= least, "{} {least}", least_moves(&task));
            prop_assert!(least_moves(&task) >= reach_moves(&task));
        }
    }

    #[test]
    fn a_comb_is_flown_twice() {
        // Four teeth of three cells on a spine of seven.
        let map = LaneMap::new(4, 7, |r, c| r == 0 || c % 2 == 0).unwrap();
        let root = map.cell(0, 0).unwrap();
        let task = Task::new(&map, &[root], true).unwrap();
        assert_eq!(reach_moves(&task), 19);
        assert_eq!(least_moves(&task), 36, "each of 18 edges twice");
    }

    #[test]
    fn a_corridor_needs_its_length() {
        let map = LaneMap::new(1, 10, |_, _| true).unwrap();
        let end = map.cell(0, 0).unwrap();
        assert_eq!(reach_moves(&Task::new(&map, &[end], false).unwrap()), 9);
        assert_eq!(reach_moves(&Task::new(&map, &[end], true).unwrap()), 18);
        assert_eq!(
            reach_moves(&Task::new(&map, &[end, end], false).unwrap()),
            9
        );
    }

    #[test]
    fn an_open_field_is_shared() {
        let map = LaneMap::new(20, 20, |_, _| true).unwrap();
        let at = map.cell(10, 10).unwrap();
        // The other 399 cells, shared by four; who returns flies over some of the four
        // beside the root once more.
        assert_eq!(reach_moves(&Task::new(&map, &[at; 4], false).unwrap()), 100);
        assert_eq!(reach_moves(&Task::new(&map, &[at; 4], true).unwrap()), 102);
    }
}
