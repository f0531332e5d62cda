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
//! `Stored` when the record is durable, not before. `Plan` is answered by `Planned`
//! with what [`plan::solve`] returned, computed wherever the driver likes.

pub mod cells;
pub mod config;
pub mod input;
pub mod journal;
pub mod membership;
pub mod mission;
pub mod output;
pub mod plan;
pub mod relay;
pub mod wire;

pub use config::{PeerConfig, Role};
pub use input::{Command, Input, Time};
pub use mission::Mission;
pub use output::{Output, Priority, Report};

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

pub use view::View;

pub mod view;

/// The mind of one peer.
#[derive(Debug)]
pub struct Peer {
    config: PeerConfig,
}

impl Peer {
    /// A peer that has not started; its first input must be [`Input::Start`].
    #[must_use]
    pub fn new(config: PeerConfig) -> Self {
        Self { config }
    }

    /// Takes one input at the peer's own time.
    pub fn handle(&mut self, now: Time, input: Input) {
        let _ = (now, input, &self.config);
        todo!("peer")
    }

    /// The next output of the last input, if there is one left.
    pub fn poll(&mut self) -> Option<Output> {
        todo!("peer")
    }

    /// When the peer wants [`Input::Timer`] at the latest.
    #[must_use]
    pub fn next_timeout(&self) -> Option<Time> {
        todo!("peer")
    }

    /// A copy of what it believes.
    #[must_use]
    pub fn view(&self) -> View {
        todo!("peer")
    }

    /// What it believes to be durable, in the order it was written: a judge
    /// compares it with what replaying the journal gives.
    #[must_use]
    pub fn durable(&self) -> journal::Durable {
        todo!("peer")
    }
}
