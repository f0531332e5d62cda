//! What a node and a world share: the queue before the channel, the link table, the
//! fate of a transmission, counters, the frames of the vehicle stream.
//!
//! The radio is judged per message, at the receiver, by [`fate()`]: a pure function
//! of the seed, the two ends, the number of the transmission and the state of the
//! link. The simulator and a live node call the same one.

pub mod counters;
pub mod fate;
pub mod frame;
pub mod queue;

pub use counters::RadioCounters;
pub use fate::{Fate, LinkState, Reason, fate};
pub use queue::SendQueue;
