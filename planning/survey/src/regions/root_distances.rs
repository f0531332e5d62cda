//! Distances in moves between the roots and every cell (D2.7 §3.6): the search asks for the
//! ways out and home at nearly every step, and so does the choice of a UAV for a region.
//!
//! Left to others: ways between other cells ([`Router`](super::map::Router)).

use super::map::{Cell, UNREACHED};
use super::plan::Task;

/// Tables of the moves to every root beyond this many entries in all would be too large;
/// ways are then searched one by one.
const MOST_HOME: usize = 1 << 24;

/// Moves between roots and any cell: the longest hops of UAVs that return, asked for at
/// every change of what they do first or last.
#[derive(Default)]
pub(super) struct Home {
    /// By cell: which table, if it is a root; empty when there are no tables.
    table_of: Vec<u16>,
    /// By cell: its place in a table.
    place: Vec<u32>,
    n_free: usize,
    /// Tables one after another.
    moves: Vec<u16>,
}

impl Home {
    /// A cell that is no root.
    const NONE: u16 = u16::MAX;

    /// The tables of a task; none when they would be too large.
    pub(super) fn new(task: &Task) -> Self {
        let mut roots = task.roots.clone();
        roots.sort_unstable();
        roots.dedup();
        let n_free = task.map.n_free();
        if roots.len().saturating_mul(n_free) > MOST_HOME || roots.len() >= usize::from(Self::NONE)
        {
            return Self::default();
        }
        let mut home = Self {
            table_of: vec![Self::NONE; task.map.table_len()],
            place: vec![UNREACHED; task.map.table_len()],
            n_free,
            moves: Vec::with_capacity(roots.len() * n_free),
        };
        for (place, cell) in (0u32..).zip(task.map.cells()) {
            home.place[cell as usize] = place;
        }
        for (i, root) in (0u16..).zip(&roots) {
            home.table_of[*root as usize] = i;
            let moves = task.map.distances(&[*root]);
            for cell in task.map.cells() {
                // What cannot be reached, or is too far for the table, is searched.
                let moves = u16::try_from(moves[cell as usize]);
                home.moves.push(moves.unwrap_or(u16::MAX));
            }
        }
        home
    }

    /// Moves between two cells of which one is a root; `None` when it has to be searched.
    pub(super) fn moves(&self, a: Cell, b: Cell) -> Option<u32> {
        for (root, other) in [(a, b), (b, a)] {
            let table = *self.table_of.get(root as usize)?;
            if table != Self::NONE {
                let place = self.place[other as usize] as usize;
                let moves = *self.moves.get(usize::from(table) * self.n_free + place)?;
                return (moves != u16::MAX).then_some(u32::from(moves));
            }
        }
        None
    }
}
