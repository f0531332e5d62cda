//! A coverage task on a lane-cell map, a plan for it, and what the plan costs
//! (D2.7 §3.6): the longest path counts, in moves or in time at each UAV's speed.

use super::map::{Cell, LaneMap, Router};

/// What is to be covered, by whom.
#[derive(Clone, Debug)]
pub struct Task {
    /// The cells to be covered: all free cells that a root reaches.
    pub map: LaneMap,
    /// Where each UAV begins.
    pub roots: Vec<Cell>,
    /// Whether each UAV returns to its root.
    pub closed: bool,
    /// Cells each UAV flies in a unit of time; above zero.
    pub speeds: Vec<u32>,
    /// Moves that each UAV can make at most.
    pub endurance: Vec<u32>,
}

impl Task {
    /// A task for equal UAVs of unlimited endurance that begin at free cells `roots`;
    /// cells that no root reaches are left out.
    #[must_use]
    pub fn new(map: &LaneMap, roots: &[Cell], closed: bool) -> Self {
        Self {
            map: map.reachable(roots),
            roots: roots.to_vec(),
            closed,
            speeds: vec![1; roots.len()],
            endurance: vec![u32::MAX; roots.len()],
        }
    }

    /// How many UAVs there are.
    #[must_use]
    pub fn n_uavs(&self) -> usize {
        self.roots.len()
    }

    /// Expands the order in which each UAV first comes to its cells into paths that move
    /// from neighbour to neighbour, and closes them when the task says so.
    #[must_use]
    pub fn fly(&self, orders: &[Vec<Cell>]) -> Plan {
        let mut router = Router::new(&self.map);
        let paths = self.roots.iter().zip(orders).map(|(root, order)| {
            let mut path = vec![*root];
            let mut at = *root;
            for cell in order {
                router.append_way(at, *cell, &mut path);
                at = *cell;
            }
            if self.closed {
                router.append_way(at, *root, &mut path);
            }
            path
        });
        Plan {
            paths: paths.collect(),
        }
    }
}

/// A path for each UAV.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// By UAV: the cells in order of flight, from its root; each a neighbour of the one
    /// before.
    pub paths: Vec<Vec<Cell>>,
}

impl Plan {
    /// Moves of each UAV.
    #[must_use]
    pub fn moves(&self) -> Vec<u32> {
        let moves = |p: &Vec<Cell>| u32::try_from(p.len().saturating_sub(1)).unwrap_or(u32::MAX);
        self.paths.iter().map(moves).collect()
    }

    /// Moves of the longest path.
    #[must_use]
    pub fn makespan_moves(&self) -> u32 {
        self.moves().into_iter().max().unwrap_or(0)
    }

    /// How many cells of the task some path visits.
    #[must_use]
    pub fn n_covered(&self, task: &Task) -> usize {
        let mut seen = vec![false; task.map.table_len()];
        for cell in self.paths.iter().flatten() {
            seen[*cell as usize] = true;
        }
        task.map.cells().filter(|c| seen[*c as usize]).count()
    }
}
