//! A coverage task on a lane-cell map, a plan for it, and what the plan costs
//! (D2.7 §3.6): the longest path counts, in moves or in time at each UAV's speed.

use super::map::{Cell, LaneMap, Router};
use thiserror::Error;

/// Why there is no task.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum TaskError {
    /// No UAV was named; nothing was built.
    #[error("nobody to cover the map")]
    NoUav,
    /// A root is no free cell of the map; nothing was built.
    #[error("UAV {uav} does not begin at a free cell")]
    RootBlocked {
        /// Which UAV, from 0.
        uav: usize,
    },
}

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
    /// A task for equal UAVs of unlimited endurance that begin at `roots`; cells that no
    /// root reaches are left out.
    ///
    /// # Errors
    /// When there is no root, or one is not free.
    pub fn new(map: &LaneMap, roots: &[Cell], closed: bool) -> Result<Self, TaskError> {
        if roots.is_empty() {
            return Err(TaskError::NoUav);
        }
        if let Some(uav) = roots.iter().position(|r| !map.is_free(*r)) {
            return Err(TaskError::RootBlocked { uav });
        }
        Ok(Self {
            map: map.reachable(roots),
            roots: roots.to_vec(),
            closed,
            speeds: vec![1; roots.len()],
            endurance: vec![u32::MAX; roots.len()],
        })
    }

    /// How many UAVs there are.
    #[must_use]
    pub fn n_uavs(&self) -> usize {
        self.roots.len()
    }

    /// Expands the order in which each UAV first comes to its cells into paths that move
    /// from neighbour to neighbour, and closes them when the task says so. A path ends
    /// early where the UAV's endurance does.
    #[must_use]
    pub fn fly(&self, orders: &[Vec<Cell>]) -> Plan {
        let mut router = Router::new(&self.map);
        let paths = orders.iter().enumerate().map(|(uav, order)| {
            let root = self.roots[uav];
            let mut path = vec![root];
            let mut at = root;
            for cell in order {
                router.append_way(at, *cell, &mut path);
                at = *cell;
            }
            self.end_in_time(uav, path, &mut router)
        });
        Plan {
            paths: paths.collect(),
        }
    }

    /// Cuts a path where the endurance ends, or where the UAV must turn home, and closes
    /// it when the task says so.
    fn end_in_time(&self, uav: usize, mut path: Vec<Cell>, router: &mut Router) -> Vec<Cell> {
        let root = self.roots[uav];
        let most = usize::try_from(self.endurance[uav]).unwrap_or(usize::MAX);
        path.truncate(most.saturating_add(1));
        if self.closed {
            let mut home = |path: &Vec<Cell>| {
                let last = path.last().copied().unwrap_or(root);
                router.moves(last, root, u32::MAX).map_or(0, |m| m as usize)
            };
            // Each cell given up saves at most two moves.
            loop {
                let excess = (path.len() - 1 + home(&path)).saturating_sub(most);
                if excess == 0 {
                    break;
                }
                path.truncate(path.len().saturating_sub(excess.div_ceil(2)).max(1));
            }
            let last = path.last().copied().unwrap_or(root);
            router.append_way(last, root, &mut path);
        }
        path
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

    /// The cells of the task that no path visits, row by row.
    #[must_use]
    pub fn uncovered(&self, task: &Task) -> Vec<Cell> {
        let mut seen = vec![false; task.map.table_len()];
        for cell in self.paths.iter().flatten() {
            seen[*cell as usize] = true;
        }
        task.map.cells().filter(|c| !seen[*c as usize]).collect()
    }

    /// How many cells of the task some path visits.
    #[must_use]
    pub fn n_covered(&self, task: &Task) -> usize {
        task.map.n_free() - self.uncovered(task).len()
    }
}
