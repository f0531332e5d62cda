//! The radio between the peers: who reaches whom, and a narrow channel that all share
//! (D2.7 §2.2, communication range).
//!
//! | module | what it holds |
//! |---|---|
//! | [`link`] | the state of every link, from range, sight and faults |
//! | [`graph`] | who is connected with whom over how many hops |
//! | [`medium`] | the half-duplex channel: queues, airtime, collisions |

pub mod graph;
pub mod link;
pub mod medium;

pub use link::{Change, LinkTable, Overlay};
pub use medium::{Delivery, Frame, Medium, Tally};
