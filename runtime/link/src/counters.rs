//! What one node's radio did: numbers for a verdict.

use crate::Reason;
use serde::{Deserialize, Serialize};

/// What one node's radio did since it started.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RadioCounters {
    /// Transmissions.
    pub sent: u64,
    /// Their bytes.
    pub sent_bytes: u64,
    /// Transmissions that arrived.
    pub received: u64,
    /// Those among them whose record had been passed on at least once before.
    pub multi_hop: u64,
    /// Receptions of passed-on records, by who transmitted them, ascending.
    pub relayed_by: Vec<(u16, u64)>,
    /// Transmissions that did not arrive here, by reason, ascending.
    pub lost: Vec<(Reason, u64)>,
    /// Transmissions refused for their form: no attachment, too many hops.
    pub refused: u64,
    /// Transmissions dropped because the node was too slow to take them.
    pub overrun: u64,
}
