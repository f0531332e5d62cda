//! The loop of an area in lanes: spanning-tree coverage over 2×2 blocks, and single
//! excursions where blocks do not fit (D2.7 §3.6.2, algorithm 5).
//!
//! A block cell is crossed from the middle of one edge to the middle of another:
//! straight, or by a quarter arc of half a lane spacing. So the loop is one
//! tangential curve of lines and arcs, flyable whenever the turn radius is at
//! most half the lane spacing. A cell that no block holds is an *excursion*: a
//! closed curve that leaves the loop at a boundary, looks at the cell, and comes
//! back to the same boundary pose; skipping it costs nothing.
//!
//! `skein-survey` has another spanning-tree loop (`regions::spanning`), and both are
//! wanted. That one counts moves: it hops over cells, makes several loops at once and
//! takes maps of a million cells. This one is made of curves that are proved clear of the
//! zones. A walk round a tree is all that they share.
//!
//! Gabriely and Rimon, "Spanning-tree based coverage of continuous areas by a mobile
//! robot", 2001, <https://doi.org/10.1023/A:1016610507833>.
//!
//! | file | what it holds |
//! |---|---|
//! | `assembly` | what is refused, which cells touch the area, the whole put together |
//! | `blocks` | the closed parts: blocks, spanning trees, the ways round them |
//! | `islands` | closed parts that hang on the first one by a way there and back |
//! | `excursion` | cells that no block holds |

mod assembly;
mod blocks;
mod excursion;
mod islands;

use super::ring::patch::Patches;
use super::ring::{CoverageLoop, Grid, LoopError, LoopProblem, hash_of};
use assembly::{Assembly, cells_of, check};
use blocks::closed_loops;

/// Lays the loop of an area in lanes.
///
/// # Guarantees
/// Every cell that touches the area is on the loop exactly once or listed as
/// uncoverable with a reason. Every curve keeps the clearance.
///
/// # Complexity
/// O(n log n) in the number of cells, plus the excursions.
///
/// # Errors
/// [`LoopError`].
pub fn build(problem: &LoopProblem) -> Result<CoverageLoop, LoopError> {
    check(problem)?;
    let grid = Grid {
        lane_spacing_m: problem.lane_spacing_m,
    };
    let needed = cells_of(&problem.area, grid)?;
    let loops = closed_loops(problem, grid, &needed);
    if loops.is_empty() {
        return Err(LoopError::Nothing);
    }
    let Assembly { cells, uncoverable } = Assembly::new(problem, grid, &needed, loops)?;
    let hash = hash_of(grid.lane_spacing_m.to_bits(), &cells);
    Ok(CoverageLoop::assembled(
        Patches::Grid(grid),
        cells,
        uncoverable,
        hash,
    ))
}
