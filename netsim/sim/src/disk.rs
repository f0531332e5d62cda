//! A virtual disk: a record is durable only when its sync has ended; a crash before
//! that loses it, and a record torn in its middle is truncated when the journal is
//! read again. Framing and checksums of real files belong to `node`.

use crate::swarm::stream::Stream;
use std::collections::VecDeque;

/// The shortest and the longest time a sync takes, milliseconds: what the flash of a
/// small flight computer needs for one page.
pub const SYNC_MS: (u64, u64) = (5, 20);

/// A write under way.
#[derive(Clone, Debug)]
struct Pending {
    token: u64,
    record: Vec<u8>,
}

/// The disk of one peer. It outlives the peer's process.
#[derive(Clone, Debug)]
pub struct Disk {
    synced: Vec<Vec<u8>>,
    pending: VecDeque<Pending>,
    busy_until_ms: u64,
    stream: Stream,
    torn: u64,
}

impl Disk {
    /// An empty disk whose delays come from `stream`.
    #[must_use]
    pub fn new(stream: Stream) -> Self {
        Self {
            synced: Vec::new(),
            pending: VecDeque::new(),
            busy_until_ms: 0,
            stream,
            torn: 0,
        }
    }

    /// Begins to write a record and says when it will be durable. Writes end in the
    /// order in which they began, like appends to one file.
    pub fn write(&mut self, now_ms: u64, token: u64, record: Vec<u8>) -> u64 {
        let takes_ms = self.stream.between(SYNC_MS.0, SYNC_MS.1);
        self.busy_until_ms = self.busy_until_ms.max(now_ms) + takes_ms;
        self.pending.push_back(Pending { token, record });
        self.busy_until_ms
    }

    /// Ends the oldest write under way: its record is durable now. Returns its token.
    pub fn sync(&mut self) -> Option<u64> {
        let p = self.pending.pop_front()?;
        self.synced.push(p.record);
        Some(p.token)
    }

    /// Power is lost: what was not synced is gone. The oldest write may have reached
    /// the disk in part; the reader truncates such a tail, so only its count remains.
    pub fn crash(&mut self) {
        if !self.pending.is_empty() && self.stream.one_in(2) {
            self.torn += 1;
        }
        self.pending.clear();
        self.busy_until_ms = 0;
    }

    /// Everything is gone.
    pub fn erase(&mut self) {
        self.pending.clear();
        self.synced.clear();
        self.busy_until_ms = 0;
    }

    /// The durable records in the order they were written.
    #[must_use]
    pub fn records(&self) -> &[Vec<u8>] {
        &self.synced
    }

    /// How many writes are under way.
    #[must_use]
    pub fn pending(&self) -> usize {
        self.pending.len()
    }

    /// How many crashes tore a record.
    #[must_use]
    pub fn torn(&self) -> u64 {
        self.torn
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::swarm::stream::Concern;

    fn disk() -> Disk {
        Disk::new(Stream::new(3, Concern::Disk(1)))
    }

    #[test]
    fn a_crash_loses_exactly_what_was_not_synced() {
        let mut d = disk();
        let first = d.write(100, 1, vec![1]);
        let second = d.write(100, 2, vec![2]);
        assert!((105..=120).contains(&first) && second >= first + 5 && second <= 140);
        assert_eq!(d.sync(), Some(1));
        d.crash();
        assert_eq!(d.records(), [vec![1u8]]);
        assert_eq!(d.sync(), None);
    }

    #[test]
    fn a_fresh_disk_is_empty() {
        let mut d = disk();
        d.write(0, 1, vec![1]);
        d.sync();
        d.erase();
        assert!(d.records().is_empty());
    }
}
