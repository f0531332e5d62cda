//! How airframes move (D2.7 §2.2).

pub mod kinematic;
mod promised;

pub use kinematic::{Kinematic, Piece};
