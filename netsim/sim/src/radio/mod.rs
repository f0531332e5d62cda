//! The radio between the peers: who reaches whom, and a narrow channel that all share
//! (D2.7 §2.2, communication range).
//!
//! | module | what it holds |
//! |---|---|
//! | [`link`] | the state of every link, from range, sight and faults |
//! | [`graph`] | who is connected with whom over how many hops |
//!
//! The half-duplex channel itself, with its queues, airtime and collisions, is
//! [`skein_link::medium`].

pub mod graph;
pub mod link;

pub use link::{LinkTable, Overlay};
pub use skein_link::medium::{Channel, Delivery, Frame, Medium, Tally};
