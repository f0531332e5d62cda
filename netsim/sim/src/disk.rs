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
    fails: bool,
}

/// What is wrong with a disk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Trouble {
    /// Nothing.
    #[default]
    None,
    /// Of the writes that begin now one in so many fails; all of them at 1.
    Fails(u32),
    /// Writes that begin now take this much longer, milliseconds.
    Slow(u32),
}

/// The disk of one peer. It outlives the peer's process.
#[derive(Clone, Debug)]
pub struct Disk {
    synced: Vec<Vec<u8>>,
    pending: VecDeque<Pending>,
    busy_until_ms: u64,
    stream: Stream,
    torn: u64,
    trouble: Trouble,
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
            trouble: Trouble::None,
        }
    }

    /// Begins to write a record and says when it will be durable. Writes end in the
    /// order in which they began, like appends to one file.
    pub fn write(&mut self, now_ms: u64, token: u64, record: Vec<u8>) -> u64 {
        let slower_ms = match self.trouble {
            Trouble::Slow(ms) => u64::from(ms),
            Trouble::None | Trouble::Fails(_) => 0,
        };
        let takes_ms = self.stream.between(SYNC_MS.0, SYNC_MS.1) + slower_ms;
        let fails = match self.trouble {
            Trouble::Fails(one_in) => one_in <= 1 || self.stream.one_in(u64::from(one_in)),
            Trouble::None | Trouble::Slow(_) => false,
        };
        self.busy_until_ms = self.busy_until_ms.max(now_ms) + takes_ms;
        self.pending.push_back(Pending {
            token,
            record,
            fails,
        });
        self.busy_until_ms
    }

    /// Ends the oldest write under way. Returns its token, and whether its record is
    /// durable now.
    pub fn sync(&mut self) -> Option<(u64, bool)> {
        let p = self.pending.pop_front()?;
        if !p.fails {
            self.synced.push(p.record);
        }
        Some((p.token, !p.fails))
    }

    /// Something is wrong with it from now on, or nothing any more; writes under way end
    /// as they began.
    pub fn set_trouble(&mut self, trouble: Trouble) {
        self.trouble = trouble;
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
        assert_eq!(d.sync(), Some((1, true)));
        d.crash();
        assert_eq!(d.records(), [vec![1u8]]);
        assert_eq!(d.sync(), None);
    }

    #[test]
    fn a_disk_in_trouble_keeps_nothing_or_takes_its_time() {
        let mut d = disk();
        d.set_trouble(Trouble::Fails(1));
        d.write(0, 1, vec![1]);
        d.set_trouble(Trouble::Slow(3_000));
        let late_ms = d.write(1_000, 2, vec![2]);
        d.set_trouble(Trouble::None);
        d.write(9_000, 3, vec![3]);
        assert!((4_005..=4_020).contains(&late_ms), "{late_ms}");
        assert_eq!(d.sync(), Some((1, false)));
        assert_eq!(d.sync(), Some((2, true)));
        assert_eq!(d.sync(), Some((3, true)));
        assert_eq!(d.records(), [vec![2u8], vec![3]]);
    }

    #[test]
    fn of_many_writes_about_one_in_so_many_fails() {
        let mut d = disk();
        d.set_trouble(Trouble::Fails(5));
        let fails = |d: &mut Disk| {
            d.write(0, 1, vec![1]);
            d.sync() == Some((1, false))
        };
        let failed = (0..1000).filter(|_| fails(&mut d)).count();
        assert!((150..250).contains(&failed), "{failed}");
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
