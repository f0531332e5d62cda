//! One loop divided among UAVs from where they stand (D2.7 §3.6.5): without backtracking
//! (algorithm 6), each flying on to the next one's place, and with it (algorithm 7).
//!
//! Backtracking MSTC is the rule for takeovers. It is no good first plan when all UAVs
//! begin at one base: more of them hardly help, since the longest gap of the ring has
//! only the two UAVs at its ends.

use super::ring::{Uav, divide};
use skein_survey::regions::map::{Cell, NOWHERE, Router};
use skein_survey::regions::plan::{Plan, Task};
use skein_survey::regions::spanning::{Tree, closed_loop, lean_loop};

/// Cells a UAV from which on the loop is laid so that little is flown twice.
const LONG_ARC: usize = 500;

/// The closed walk over all cells, each a neighbour of the next and the last of the
/// first; a cell with no way round is there more than once.
#[must_use]
pub fn closed_walk(task: &Task, tree: Tree) -> Vec<Cell> {
    let Some(&root) = task.roots.first() else {
        return Vec::new();
    };
    // Where arcs are short, where the UAVs happen to stand weighs more than the length.
    let long = task.map.n_free() >= LONG_ARC * task.n_uavs();
    let lay = if long { lean_loop } else { closed_loop };
    let order = lay(&task.map, root, tree);
    let mut router = Router::new(&task.map);
    let mut walk = Vec::with_capacity(order.len() + order.len() / 8);
    walk.extend(order.first());
    for pair in order.windows(2) {
        router.append_way(pair[0], pair[1], &mut walk);
    }
    if let (Some(&first), Some(&last)) = (order.first(), order.last())
        && first != last
    {
        router.append_way(last, first, &mut walk);
        walk.pop();
    }
    walk
}

/// The first place of each root on a walk.
pub(super) fn places(task: &Task, walk: &[Cell]) -> Vec<usize> {
    let mut place = vec![usize::MAX; task.map.table_len()];
    for (i, cell) in walk.iter().enumerate().rev() {
        place[*cell as usize] = i;
    }
    task.roots.iter().map(|r| place[*r as usize]).collect()
}

/// Each UAV flies the walk from its root up to the next UAV's.
#[must_use]
pub fn without_backtracking(task: &Task) -> Plan {
    on_the_ring(task, |n, uavs| {
        let mut order: Vec<usize> = (0..uavs.len()).collect();
        order.sort_by_key(|i| (uavs[*i].place, *i));
        let mut legs = vec![(0, 0); uavs.len()];
        for (i, uav) in order.iter().enumerate() {
            let here = uavs[*uav].place;
            let next = order
                .get(i + 1)
                .map_or(uavs[order[0]].place + n, |o| uavs[*o].place);
            legs[*uav] = (0, next.saturating_sub(here + 1));
        }
        legs
    })
}

/// Each UAV flies the walk both ways from its root, dividing the gaps to both neighbours
/// so that the last is done as soon as possible; mixed speeds count.
#[must_use]
pub fn with_backtracking(task: &Task) -> Plan {
    on_the_ring(task, |n, uavs| {
        let shares = divide(n, uavs).map(|d| d.shares).unwrap_or_default();
        shares.iter().map(|s| (s.before, s.after)).collect()
    })
}

/// Paths along the walk from cells before and after each root.
fn on_the_ring(task: &Task, split: impl Fn(u32, &[Uav]) -> Vec<(u32, u32)>) -> Plan {
    let walk = closed_walk(task, Tree::DepthFirst);
    let n = walk.len();
    let places = places(task, &walk);
    let uavs: Vec<Uav> = places
        .iter()
        .zip(task.speeds.iter().zip(&task.endurance))
        .map(|(place, (speed, endurance))| Uav {
            place: u32::try_from(*place).unwrap_or(0),
            speed: *speed,
            endurance: *endurance,
        })
        .collect();
    let shares = split(u32::try_from(n).unwrap_or(u32::MAX), &uavs);
    let mut router = Router::new(&task.map);
    let paths = (0..task.n_uavs()).map(|uav| {
        let (before, after) = shares.get(uav).copied().unwrap_or((0, 0));
        let at = places[uav];
        let ahead = (1..=after as usize).map(|i| walk[(at + i) % n]);
        let behind = (1..=before as usize).map(|i| walk[(at + n - i) % n]);
        let back = |side: u32, first: bool| if first { side as usize } else { 0 };
        let mut path = vec![task.roots[uav]];
        // The shorter side first, since it is flown twice.
        if before <= after {
            path.extend(behind.clone());
            path.extend(
                (0..back(before, after > 0)).map(|i| walk[(at + n - before as usize + 1 + i) % n]),
            );
            path.extend(ahead);
        } else {
            path.extend(ahead.clone());
            path.extend(
                (0..back(after, before > 0)).map(|i| walk[(at + after as usize - 1 - i) % n]),
            );
            path.extend(behind);
        }
        if task.closed {
            let last = path.last().copied().unwrap_or(NOWHERE);
            router.append_way(last, task.roots[uav], &mut path);
        }
        path
    });
    Plan {
        paths: paths.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use skein_survey::regions::map::LaneMap;

    proptest! {
        #[test]
        fn both_divisions_cover_every_cell(
            free in prop::collection::vec(prop::bool::weighted(0.8), 80),
            picks in prop::collection::vec(any::<prop::sample::Index>(), 1..5),
        ) {
            let map = LaneMap::new(8, 10, |r, c| free[(r * 10 + c) as usize]).unwrap();
            let cells: Vec<Cell> = map.cells().collect();
            prop_assume!(!cells.is_empty());
            let first = cells[picks[0].index(cells.len())];
            let map = map.reachable(&[first]);
            let cells: Vec<Cell> = map.cells().collect();
            let roots: Vec<Cell> = picks.iter().map(|p| cells[p.index(cells.len())]).collect();
            let task = Task::new(&map, &roots, false).unwrap();
            for plan in [without_backtracking(&task), with_backtracking(&task)] {
                prop_assert_eq!(plan.n_covered(&task), cells.len());
                for (path, root) in plan.paths.iter().zip(&roots) {
                    prop_assert_eq!(path[0], *root);
                    prop_assert!(path.windows(2).all(|w| map.adjacent(w[0], w[1]) && map.is_free(w[1])));
                }
            }
            prop_assert!(with_backtracking(&task).makespan_moves() <= without_backtracking(&task).makespan_moves());
        }
    }
}
