//! Moves between the roots and every cell, for UAVs that return (D2.7 §3.6): the ways out
//! and home are asked for at nearly every step of the search.
//!
//! Left to others: ways between other cells ([`Router`](super::map::Router)).

use super::map::Cell;
use super::plan::Task;

/// Tables of the moves to every root beyond this many entries in all would be too large;
/// ways home are then searched one by one.
const MOST_HOME: usize = 1 << 23;

/// Moves between roots and any cell: the longest hops of UAVs that return, asked for at
/// every change of what they do first or last.
#[derive(Default)]
pub(super) struct Home {
    /// By cell: which table, if it is a root; empty when there are no tables.
    table_of: Vec<u8>,
    tables: Vec<Vec<u32>>,
}

impl Home {
    /// A cell that is no root.
    const NONE: u8 = u8::MAX;

    /// The tables of a task; none when nobody returns, or they would be too large.
    pub(super) fn new(task: &Task) -> Self {
        let mut roots = task.roots.clone();
        roots.sort_unstable();
        roots.dedup();
        let entries = roots.len().saturating_mul(task.map.table_len());
        if !task.closed || entries > MOST_HOME || roots.len() > usize::from(Self::NONE) {
            return Self::default();
        }
        let mut table_of = vec![Self::NONE; task.map.table_len()];
        for (i, root) in (0u8..).zip(&roots) {
            table_of[*root as usize] = i;
        }
        let tables = roots.iter().map(|r| task.map.distances(&[*r])).collect();
        Self { table_of, tables }
    }

    /// Moves between two cells of which one is a root; `None` when it has to be searched.
    pub(super) fn moves(&self, a: Cell, b: Cell) -> Option<u32> {
        for (root, other) in [(a, b), (b, a)] {
            let table = self.table_of.get(root as usize)?;
            if let Some(table) = self.tables.get(usize::from(*table)) {
                return Some(table[other as usize]);
            }
        }
        None
    }
}
