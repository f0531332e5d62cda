//! Coverage of a lane-cell map by a team that moves from cell to cell (D2.7 §3.6.2,
//! 3.6.4–3.6.5): how long it takes at least, and the default planner, in which each UAV
//! flies a region of its own. The document's own planners stand in `skein-lab`.
//!
//! | module | what it holds |
//! |---|---|
//! | [`map`] | which cells are free, distances, shortest ways |
//! | [`plan`] | a task, a plan, and what a plan costs |
//! | [`bounds`] | how long any plan takes at least |
//! | [`spanning`] | one closed loop over all cells, from a spanning tree over 2×2 blocks |
//! | `loop_repair` | cells that a loop leaves out, brought together so that they cost nothing |
//! | [`partition`] | a connected region for each UAV |
//! | [`corridor_first`] | work for UAVs that begin close together, farthest first |
//! | `loop_arcs` | work for UAVs of whom many have to fly far: arcs of one loop |
//! | [`search`] | local search over the orders of cells |
//! | [`improve`] | the default planner |
//! | [`raster`] | which cells an area becomes |
//!
//! Left to others: exact curves, cameras and no-fly zones (`area`).

pub mod bounds;
pub mod corridor_first;
pub mod improve;
mod insertion;
mod loop_arcs;
mod loop_repair;
pub mod map;
pub mod partition;
pub mod plan;
pub mod raster;
mod root_distances;
pub mod search;
pub mod spanning;

pub use map::{Cell, LaneMap, MapError, NOWHERE};
pub use plan::{Plan, Task, TaskError};
