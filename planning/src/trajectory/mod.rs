//! From waypoints to curves a fixed wing can fly (D2.7 §2.4).
//!
//! [`curve`] holds lines and arcs joined tangentially; [`dubins`] the shortest
//! such curve between two poses; [`headings`] the headings at waypoints that make
//! the chain of them short; [`wind`] the fastest in a constant wind; [`timed`]
//! paths with the time at which every place is passed.

pub mod curve;
pub mod dubins;
pub mod headings;
pub mod timed;
pub mod wind;

pub use curve::{Curve, Segment};
pub use timed::Trajectory;
