//! What the radios of a run were given and brought.

use skein_link::RadioCounters;
use skein_link::medium::Tally;
use std::collections::BTreeMap;

/// Counts of one run.
#[derive(Debug, Default)]
pub(super) struct Traffic {
    received: u64,
    /// Receptions of what had been passed on before, by who transmitted it.
    relayed_by: BTreeMap<u16, u64>,
    /// Bytes of records received, by transmitter and receiver.
    bytes_by_link: BTreeMap<(u16, u16), u64>,
    /// Bytes handed to the radios, by kind of record.
    bytes_by_kind: BTreeMap<String, u64>,
}

impl Traffic {
    pub(super) fn transmitted(&mut self, key: &str, bytes: u64) {
        let kind = key.split('/').nth(2).unwrap_or_default();
        match self.bytes_by_kind.get_mut(kind) {
            Some(sum) => *sum += bytes,
            None => drop(self.bytes_by_kind.insert(kind.to_owned(), bytes)),
        }
    }

    pub(super) fn received(&mut self, transmitter: u16, receiver: u16, bytes: usize, hops: u8) {
        self.received += 1;
        *self
            .bytes_by_link
            .entry((transmitter, receiver))
            .or_default() += bytes as u64;
        if hops > 0 {
            *self.relayed_by.entry(transmitter).or_default() += 1;
        }
    }

    pub(super) fn bytes_by_kind(&self) -> BTreeMap<String, u64> {
        self.bytes_by_kind.clone()
    }

    /// With what the channel did, as the account of a run wants it.
    pub(super) fn counters(&self, channel: Tally) -> RadioCounters {
        RadioCounters {
            sent: channel.frames,
            sent_bytes: channel.bytes,
            received: self.received,
            multi_hop: self.relayed_by.values().sum(),
            relayed_by: self.relayed_by.iter().map(|(k, v)| (*k, *v)).collect(),
            bytes_by_link: self.bytes_by_link.iter().map(|(k, v)| (*k, *v)).collect(),
            lost: channel.dropped.into_iter().collect(),
            ..RadioCounters::default()
        }
    }
}
