//! What can happen to a peer.

use crate::mission::{Mission, PointMm};
use crate::offload::JobResult;
use crate::transmission::Transmission;
use crate::wire::tasks::{DoneTask, Task, TaskKind};
use serde::{Deserialize, Serialize};
use skein_behaviors::{Orders, Percept};
use std::sync::Arc;

/// The peer's own clock, milliseconds of scenario time since it cares to remember.
/// Never runs backwards; drivers see to that.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct Time(pub u64);

impl Time {
    /// Later by `ms` milliseconds.
    #[must_use]
    pub fn plus_ms(self, ms: u64) -> Self {
        Self(self.0.saturating_add(ms))
    }

    /// Milliseconds since `earlier`, 0 if that is later.
    #[must_use]
    pub fn since_ms(self, earlier: Self) -> u64 {
        self.0.saturating_sub(earlier.0)
    }
}

/// One thing that happened.
#[derive(Clone, Debug)]
#[allow(
    clippy::large_enum_variant,
    reason = "an input lives for one call, and percepts are the most frequent"
)]
pub enum Input {
    /// The first input: what the journal held, in the order it was written
    /// (empty on a fresh disk), and a boot nonce the driver drew.
    Start {
        /// Bodies of the journal records.
        persisted: Vec<Vec<u8>>,
        /// Differs from boot to boot.
        nonce: u32,
    },
    /// The vehicle sensed something.
    Percept(Percept),
    /// A transmission was received.
    Received {
        /// Who transmitted it (not: who wrote it). Not authenticated.
        transmitter: u16,
        /// Hops it had made before this one.
        hops: u8,
        /// The record.
        heard: Arc<Transmission>,
    },
    /// Time passed; harmless at any time.
    Timer,
    /// The transport believes that a neighbour came or went; a hint, never a verdict.
    LinkHint {
        /// The neighbour.
        neighbour: u16,
        /// Whether it came.
        up: bool,
    },
    /// An earlier `Store` ended.
    Stored {
        /// Of that `Store`.
        token: u64,
        /// Whether the record is durable now.
        ok: bool,
    },
    /// An earlier `Compute` was answered.
    Computed {
        /// Of that `Compute`.
        token: u64,
        /// What [`crate::offload::run`] returned.
        result: JobResult,
    },
    /// The operator, at a ground station's own console, wants something.
    Command(Command),
}

/// What an operator can want. Enters at a ground station and travels by radio.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Publish a new mission; nobody takes one whose revision is not the highest, see
    /// [`crate::Peer::next_revision`].
    Mission(Arc<Mission>),
    /// New standing orders, to all and to single ones.
    Orders(Orders),
    /// Something about the tasks that the operator asks for.
    Task(TaskEdit),
}

/// What an operator wants of tasks.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TaskEdit {
    /// One more.
    Add(NewTask),
    /// One less, by name.
    Cancel(String),
    /// What one asks for, by name, was done on the ground: whoever asked for it.
    Done(String),
    /// What was said in an earlier life is said again.
    Again(OperatorsTasks),
}

/// What the operator of a ground station said of tasks, as it stands.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct OperatorsTasks {
    /// The tasks that it asked for.
    pub asked: Vec<AskedTask>,
    /// Tasks of others that it said to be done, ascending.
    #[serde(default)]
    pub done: Vec<DoneTask>,
}

impl OperatorsTasks {
    /// Whether it said nothing.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.asked.is_empty() && self.done.is_empty()
    }
}

/// A task that is asked for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct NewTask {
    /// What people call it; none for the next free number.
    pub name: Option<String>,
    /// What kind it is.
    pub kind: TaskKind,
    /// Where, millimetres from the mission's origin: one place, of a line two at least.
    pub places: Vec<PointMm>,
    /// How far around the place, or to the sides of the line, is to be seen, mm.
    pub radius_mm: u32,
    /// What it is worth, 1 to 1000.
    pub worth: u16,
    /// After so long it is not wanted any more, milliseconds; none for never.
    pub within_ms: Option<u32>,
    /// The sensor that it needs, by number; 0 for any.
    pub sensor: u8,
}

/// A task with the number of its register.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct AskedTask {
    /// The number.
    pub number: u16,
    /// The task as it was said last.
    pub task: Task,
    /// How long ago it was asked for, milliseconds.
    pub age_ms: u64,
}
