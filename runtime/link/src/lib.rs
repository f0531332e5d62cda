//! What a node and a world share: the radio channel with the queues before it, the fate
//! of a transmission, counters, the frames of the vehicle stream.
//!
//! There is one radio: [`Medium`] decides when a frame is on the air and who receives
//! it. The simulator has one for all stations; in a trial each live node has one for
//! the stations around it.

pub mod counters;
pub mod fate;
pub mod frame;
pub mod medium;
pub mod neighbourhood;
pub mod queue;

pub use counters::{Ages, RadioCounters};
pub use fate::{Fate, LinkState, Reason, fate};
pub use medium::Medium;
pub use neighbourhood::{Hearing, LinkNews, Neighbourhood};
pub use queue::SendQueue;
