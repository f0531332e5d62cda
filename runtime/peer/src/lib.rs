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
//! # How it is built
//!
//! | module | what it holds |
//! |---|---|
//! | [`input`], [`output`] | what can happen to a peer, and what it wants done |
//! | [`peer`] | routes events to the parts and carries out their effects |
//! | [`transmission`], `inbound`, `outbound` | bytes as they are read, and what they are to a peer; what is spoken, and when |
//! | `cooperation`, `mission_state`, `listening` | mission, goal, the peer's part in negotiations; where it waits |
//! | `targets` | vehicles on the ground: tracks, what all tell of them, whom a task is bound to |
//! | `tasking`, `task_desk`, [`errand`], [`relay_circle`] | tasks other than coverage: the peer's part in their auction, its operator's, the flight that does one, the circle that is held |
//! | [`protocol`] | the machines and rules by which peers agree |
//! | `timers` | every deadline, in one table |
//! | [`journal`] | what is durable before it is spoken of |
//! | [`offload`] | work that takes too long for a percept to wait |
//! | [`wire`] | keys, kinds, messages, their bytes and limits |
//! | [`mission`], [`revision`], `task`, [`cells`] | what is to be seen, and what was |
//! | [`found_obstacles`], `sensed_aircraft` | what UAVs sense and no map shows |
//! | [`library`] | how a mission comes in pieces |
//!
//! Each part takes events and returns effects; none touches another.
//!
//! # The canonical loop
//!
//! 1. build an [`Input`] from whatever happened,
//! 2. call [`Peer::handle`] with the peer's own time,
//! 3. call [`Peer::poll`] until it returns `None`, doing what each output says,
//! 4. sleep until [`Peer::next_timeout`] or the next thing that happens.
//!
//! ```
//! use skein_peer::config::Objective;
//! use skein_peer::{Input, Output, Peer, PeerConfig, PeerId, Role, Time, offload};
//! use std::collections::VecDeque;
//!
//! let mut peer = Peer::new(PeerConfig {
//!     id: PeerId(1),
//!     role: Role::GroundStation,
//!     fleet: "demo".into(),
//!     beacon_period_ms: 1000,
//!     rate_bps: 64_000,
//!     airframe: None,
//!     objective: Objective::Time,
//!     height_m: 0.0,
//!     mission: None,
//!     launches: [].into(),
//!     sensors: 0,
//!     seed: 1,
//! });
//! let (mut now, mut journal, mut sent) = (Time(0), Vec::new(), 0);
//! let persisted = journal.clone();
//! let mut inputs = VecDeque::from([Input::Start { persisted, nonce: 7 }]);
//! while now < Time(10_000) {
//!     let input = inputs.pop_front().unwrap_or_else(|| {
//!         // Nothing else happened: sleep until the next timeout.
//!         now = peer.next_timeout().unwrap_or(now);
//!         Input::Timer
//!     });
//!     peer.handle(now, input);
//!     while let Some(output) = peer.poll() {
//!         match output {
//!             Output::Publish { .. } => sent += 1, // put `bytes` on the air under `key`
//!             Output::Store { token, record } => {
//!                 journal.push(record);
//!                 inputs.push_back(Input::Stored { token, ok: true });
//!             }
//!             Output::Compute { token, job } => {
//!                 let result = offload::run(&job);
//!                 inputs.push_back(Input::Computed { token, result });
//!             }
//!             Output::Setpoint(_) => {} // tell the autopilot
//!             Output::Report(_) => {}   // tell people
//!         }
//!     }
//! }
//! // It promised a life, listened for three periods, then beaconed once a period, with a
//! // heartbeat between two beacons.
//! assert_eq!(journal.len(), 1);
//! assert!((12..=16).contains(&sent));
//! ```
//!
//! `Publish` is a one-hop broadcast: there are no addressees. `Store` is answered by
//! `Stored` when the record is durable, not before. `Compute` is answered by `Computed`
//! with what [`offload::run`] returned, computed wherever the driver likes.

pub mod beliefs;
pub mod buildings;
mod carried;
pub mod cells;
mod company;
pub mod config;
mod cooperation;
pub mod count_site;
pub mod counting;
mod coverage_told;
pub mod criteria;
pub mod crowd;
pub mod detections;
pub mod diagram;
mod diary;
mod effect;
pub mod errand;
pub mod footprint;
pub mod found_obstacles;
mod fuel;
pub mod gathering;
pub mod hint;
mod inbound;
pub mod input;
pub mod journal;
pub mod layers;
pub mod library;
mod listening;
pub mod mission;
mod mission_change;
pub mod mission_edit;
mod mission_state;
pub mod offload;
mod outbound;
pub mod output;
pub mod overview;
pub mod peer;
pub mod protocol;
mod registers;
pub mod relay_circle;
pub mod revision;
mod sensed_aircraft;
mod separation;
mod sight;
mod stage;
pub mod streets;
mod taking;
mod targets;
mod task;
mod task_desk;
mod tasking;
#[cfg(any(test, feature = "testing"))]
pub mod testing;
#[cfg(test)]
mod tests;
mod timers;
mod trails;
pub mod transmission;
pub mod usage;
mod varint;
pub mod why;
pub mod wire;
pub mod witness;
mod zone_watch;

pub use beliefs::Beliefs;
pub use config::{PeerConfig, Role};
pub use input::{Command, Input, Time};
pub use mission::Mission;
pub use output::{Output, Priority, Report};
pub use overview::Overview;
pub use peer::Peer;
pub use stage::WIND_CALMER_MPS;
pub use task::{CoverageTask, LineTask, PointTask};
pub use task_desk::{TaskHolder, TaskView, WATCHERS_MAX};
pub use tasking::{BROUGHT_MAX, Call, Follows, MISSION, circled_sector};
pub use transmission::Transmission;
pub use why::Why;

use serde::{Deserialize, Serialize};

/// Identifies a peer for as long as its fleet exists.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct PeerId(pub u16);

/// Counts the lives of a peer; a later one supersedes all that an earlier one said.
pub type Incarnation = u32;

impl core::fmt::Display for PeerId {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "peer {}", self.0)
    }
}
