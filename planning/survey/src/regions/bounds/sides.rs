//! The bound of sides (D2.7 §3.6): who begins on one side of a map and works on the other
//! spends the way there, however near others begin.
//!
//! For any set of cells, a UAV at least `d` moves from it has spent `d − 1` moves on cells
//! outside before the first that it visits inside, and as many after the last if it returns.
//! Here the sets are what lies beyond a row or a column. The bound by distance looks at the
//! nearest root alone, for which many UAVs in one corner are as good as UAVs everywhere.
//!
//! Left to others: the ways inside ([`gates`](super::gates)).

use super::super::map::{Cell, UNREACHED};
use super::super::plan::Task;

/// Levels along either axis, each with what lies on both sides of it.
const LEVELS: u32 = 16;

/// No plan for equal UAVs has a shorter longest path, in moves.
///
/// # Complexity
/// O(N) for each level.
pub(super) fn moves(task: &Task) -> u64 {
    let place = |c: Cell| task.map.place(c);
    let mut bound = 0;
    for level in 1..LEVELS {
        let (row, col) = (
            task.map.rows() * level / LEVELS,
            task.map.cols() * level / LEVELS,
        );
        let sides: [&dyn Fn(Cell) -> bool; 4] = [
            &|c| place(c).0 < row,
            &|c| place(c).0 >= row,
            &|c| place(c).1 < col,
            &|c| place(c).1 >= col,
        ];
        for side in sides {
            let inside: Vec<Cell> = task.map.cells().filter(|c| side(*c)).collect();
            bound = bound.max(of_side(task, &inside));
        }
    }
    bound
}

/// The least longest path of UAVs that visit all these cells together.
fn of_side(task: &Task, inside: &[Cell]) -> u64 {
    if inside.is_empty() {
        return 0;
    }
    let away = task.map.distances(inside);
    let ways = task.roots.iter().map(|r| away[*r as usize]);
    let mut ways: Vec<u64> = ways.filter(|d| *d != UNREACHED).map(u64::from).collect();
    ways.sort_unstable();
    let each = if task.closed { 2 } else { 1 };
    let visits = |moves: u64| -> u64 {
        let seen = ways.iter().map(|d| match d {
            // A closed path visits as many cells as it has moves, an open one its first too.
            0 => moves + u64::from(!task.closed || moves == 0),
            d => (moves + 1).saturating_sub(each * d),
        });
        seen.sum()
    };
    let wanted = inside.len() as u64;
    if ways.is_empty() {
        return 0;
    }
    let (mut low, mut high) = (0, 2 * (wanted + ways[0]) + 2);
    while low < high {
        let middle = low.midpoint(high);
        if visits(middle) >= wanted {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    low
}
