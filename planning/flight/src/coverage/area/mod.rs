//! Area coverage: lane grid, spanning-tree loop, division among UAVs (D2.7 §3.6).
//!
//! [`grid`] names cells, [`stc`] strings them on one closed loop, [`backtracking`]
//! divides the loop.

mod assembly;
pub mod backtracking;
mod blocks;
mod excursion;
pub mod grid;
pub mod patch;
mod shares;
pub mod stc;
mod tree;

pub(super) use assembly::{check_figures, check_launch, hash_of, hash_words, millimetres};
pub use grid::{CellId, Grid};
pub use stc::{AreaProblem, CoverageLoop, Direction, LoopCell, LoopError};
pub use tree::Tree;
