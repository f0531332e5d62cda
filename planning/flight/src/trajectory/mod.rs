//! From waypoints to curves a fixed wing can fly (D2.7 §2.4).
//!
//! [`dubins`] holds the shortest curve between two poses; [`wind`] the fastest in a
//! constant wind; [`timed`] paths with the time at which every place is passed. The
//! curves themselves are geometry: [`skein_geometry::curve`].

pub mod dubins;
pub mod timed;
pub mod wind;

pub use timed::Trajectory;
