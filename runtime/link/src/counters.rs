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
    /// Bytes of records that arrived, by who transmitted and who received them, ascending.
    pub bytes_by_link: Vec<((u16, u16), u64)>,
    /// Transmissions that did not arrive here, by reason, ascending.
    pub lost: Vec<(Reason, u64)>,
    /// Transmissions refused for their form: no attachment, too many hops.
    pub refused: u64,
    /// Transmissions dropped because the node was too slow to take them.
    pub overrun: u64,
    /// Transmissions that a node of a trial got from the transport, heard by its radio or not.
    pub arrived: u64,
    /// Those among them that came [`LATE_MS`] of scenario time after they were handed over,
    /// or later: the computer's doing, not the radio's.
    pub late: u64,
    /// How old those were that the peer was given.
    pub ages: Ages,
}

/// What takes this long from a node to another is late, milliseconds of scenario time: a
/// tenth of it is more than loopback takes on a machine that keeps up.
pub const LATE_MS: u64 = 500;

/// How old transmissions were, in classes that grow by a half or so.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Ages(Vec<u64>);

/// The oldest of each class but the last, which has no end, milliseconds.
const OLDEST_MS: [u64; 22] = [
    1, 2, 3, 5, 7, 10, 15, 20, 30, 50, 70, 100, 150, 200, 300, 500, 700, 1_000, 1_500, 2_000,
    3_000, 5_000,
];

impl Ages {
    /// Notes one.
    pub fn note(&mut self, age_ms: u64) {
        let class = OLDEST_MS.partition_point(|oldest| *oldest < age_ms);
        self.0.resize(OLDEST_MS.len() + 1, 0);
        self.0[class] += 1;
    }

    /// Adds those of another node.
    pub fn add(&mut self, other: &Self) {
        // What comes from a stream may hold any number of classes.
        self.0.resize(OLDEST_MS.len() + 1, 0);
        for (sum, n) in self.0.iter_mut().zip(&other.0) {
            *sum = sum.saturating_add(*n);
        }
    }

    /// An age that this share of them, 0 to 1, does not exceed, milliseconds: the end of a
    /// class, twice the last one beyond all. Nothing where there are none.
    #[must_use]
    pub fn quantile_ms(&self, share: f64) -> Option<u64> {
        let total: u64 = self.0.iter().fold(0, |sum, n| sum.saturating_add(*n));
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "a count times a share saturates"
        )]
        let wanted = ((total as f64 * share).ceil() as u64).max(1);
        let mut seen: u64 = 0;
        let class = self.0.iter().position(|n| {
            seen = seen.saturating_add(*n);
            seen >= wanted
        })?;
        Some(
            OLDEST_MS
                .get(class)
                .copied()
                .unwrap_or(2 * OLDEST_MS[OLDEST_MS.len() - 1]),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_the_ends_of_classes() {
        let mut ages = Ages::default();
        assert_eq!(ages.quantile_ms(0.5), None);
        (0..98).for_each(|_| ages.note(4));
        ages.note(700);
        let mut other = Ages::default();
        other.note(9_000);
        ages.add(&other);
        let at = |share| ages.quantile_ms(share);
        assert_eq!((at(0.0), at(0.5), at(0.98)), (Some(5), Some(5), Some(5)));
        assert_eq!((at(0.99), at(1.0)), (Some(700), Some(10_000)));
        // What was cut short or blown up on the way is no panic.
        let odd = Ages(vec![u64::MAX; 40]);
        ages.add(&odd);
        assert_eq!(ages.quantile_ms(0.01), Some(1));
    }
}
