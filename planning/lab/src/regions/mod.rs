//! Other planners of lane cells, to compare `skein_survey::regions` with (D2.7 §3.6.1–3.6.6).
//!
//! | module | what it holds |
//! |---|---|
//! | [`boustrophedon`] | the decomposition of a lane-cell map |
//! | [`mstc`] | one loop divided without and with backtracking, from where the UAVs stand |
//! | [`ring`] | the exact division with backtracking, mixed speeds and endurance |
//! | [`forest`] | a tree cover with a proven factor |
//! | [`free_entry`] | the loop divided, each UAV flying straight to its arc |
//! | [`patrol`] | the first period of a loop flown again and again |

pub mod boustrophedon;
pub mod forest;
pub mod free_entry;
pub mod mstc;
pub mod patrol;
pub mod ring;
