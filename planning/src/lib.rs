//! Geometry, routes, trajectories and coverage plans: pure functions of their inputs.
//!
//! No clock, no peers, no files, no randomness. Everything here gives the same
//! answer on every machine, because every peer derives the same coverage loop
//! and the same division of work from it.
//!
//! | module | what it holds | D2.7 |
//! |---|---|---|
//! | [`frame`] | poses, the ENU tangent plane of a mission | 2.2 |
//! | [`math`] | the only source of transcendental functions | |
//! | [`airframe`] | what a UAV can fly | 2.2 |
//! | [`geometry`] | polygons valid by construction, no-fly zones and their offset | 2.3.1 |
//! | [`path`] | the shortest route with clearance | 2.3.2 |
//! | [`trajectory`] | curves, Dubins words, flights in wind, timed trajectories | 2.4 |
//! | [`coverage`] | the spanning-tree loop and its division among UAVs | 3.6.2, 3.6.5 |

pub mod airframe;
pub mod coverage;
pub mod frame;
pub mod geometry;
pub mod math;
pub mod path;
pub mod trajectory;
