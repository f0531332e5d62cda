//! Streets as a mission has them (D2.7 §3.1): a network of crossings and of the stretches between
//! them, where on it a vehicle is, and the quickest way along it.
//!
//! | module | what it holds |
//! |---|---|
//! | [`network`] | crossings, stretches, the turns at crossings, all numbered |
//! | [`matching`] | on which stretch a vehicle is, by its place and its heading |
//! | [`quickest`] | the quickest way from a place to a place, by a speed for each stretch |
//! | [`chains`] | lines of a map joined and thinned, for whoever makes a mission |

pub mod chains;
pub mod matching;
pub mod network;
pub mod quickest;

pub use network::{Edge, Network, Turn};
