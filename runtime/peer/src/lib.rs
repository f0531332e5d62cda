//! The mind of one peer: a deterministic state machine without clock, entropy or IO.
//!
//! # The contract
//!
//! > A [`Peer`] looks at no clock, draws no randomness but from the seeded stream it
//! > was given, and does no IO. **Give it one [`Input`] with the current time, then
//! > drain every [`Output`]**, then wait for the earliest of: the next timeout, a
//! > message, a percept, a command.
//!
//! Same seed and same inputs give the same outputs, byte for byte.
//!
//! The canonical loop:
//!
//! 1. build an [`Input`] from whatever happened,
//! 2. call [`Peer::handle`] with the peer's own time,
//! 3. call [`Peer::poll`] until it returns `None`, doing what each output says,
//! 4. sleep until [`Peer::next_timeout`] or the next thing that happens.
//!
//! `Publish` is a one-hop broadcast: there are no addressees. `Store` is answered by
//! `Stored` when the record is durable, not before. `Compute` is answered by `Computed`
//! with what [`plan::solve`] returned, computed wherever the driver likes.

pub mod beliefs;
pub mod cells;
pub mod config;
mod cooperation;
mod effect;
mod inbound;
pub mod input;
pub mod journal;
pub mod mission;
mod mission_state;
pub mod offload;
mod outbound;
pub mod output;
pub mod peer;
pub mod protocol;
pub mod task;
pub mod timers;
pub mod wire;

pub use beliefs::Beliefs;
pub use config::{PeerConfig, Role};
pub use input::{Command, Input, Time};
pub use mission::Mission;
pub use output::{Output, Priority, Report};
pub use peer::Peer;
pub use task::CoverageTask;

use serde::{Deserialize, Serialize};

/// Identifies a peer for as long as its fleet exists.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct PeerId(pub u16);

/// Counts the lives of a peer; a later one supersedes all that an earlier one said.
pub type Incarnation = u32;

impl core::fmt::Display for PeerId {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "uav{}", self.0)
    }
}
