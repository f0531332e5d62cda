//! What a peer makes durable before it speaks of it, and how it reads it back.

use crate::Incarnation;
use crate::wire::message::{Register, Snapshot};
use serde::{Deserialize, Serialize};

/// The state that a journal holds after all its records.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Durable {
    /// The latest life.
    pub incarnation: Incarnation,
    /// The highest round counter promised.
    pub counter: u32,
    /// The latest bid.
    pub snapshot: Option<Snapshot>,
    /// The latest section adopted.
    pub register: Option<Register>,
    /// Covered cells, run-length encoded along the loop of `loop_hash`.
    pub union: Vec<u8>,
    /// The loop of `union`.
    pub loop_hash: u64,
}

impl Durable {
    /// Reads journal records in the order they were written. A record that cannot
    /// be read is skipped and counted; it was written by a later version.
    #[must_use]
    pub fn replay(records: &[Vec<u8>]) -> (Self, usize) {
        let _ = records;
        todo!("peer")
    }
}
