//! The ring of cells on which all UAVs of a mission work, and its division (D2.7 §3.6).
//!
//! | module | what it holds |
//! |---|---|
//! | [`coverage_loop`] | the closed loop: its cells, their curves, its hash |
//! | [`problem`] | what a loop is laid for |
//! | [`error`] | why there is none |
//! | [`grid`] | names of cells; the grid of lanes |
//! | [`tree`] | which spanning tree a loop of lanes goes round |
//! | [`patch`] | what a cell looks like from above |
//! | [`division`] | the division among UAVs that is flown: the best of those below |
//! | [`backtracking`] | the division among UAVs: backtracking MSTC |
//! | `free_entry` | the division without ties to where UAVs are |
//! | [`shares`] | whether a division gives somebody too much |
//! | `transfers` | how long the ways between its runs are |
//! | `endurance_limited` | the division when endurance does not suffice for all cells |

pub mod backtracking;
pub mod coverage_loop;
pub mod division;
mod endurance_limited;
pub mod error;
mod free_entry;
pub mod grid;
pub mod patch;
pub mod problem;
pub mod shares;
mod transfers;
pub mod tree;

pub use coverage_loop::{CoverageLoop, Direction, LoopCell};
pub(super) use coverage_loop::{hash_of, hash_words, millimetres};
pub use error::LoopError;
pub use grid::{CellId, Grid};
pub use problem::LoopProblem;
pub(super) use problem::{check_figures, check_launch};
pub use tree::Tree;
