//! How airframes move (D2.7 §2.2).

pub mod kinematic;

pub use kinematic::{Kinematic, Piece};
