//! Sets of cells of the coverage loop: what is covered, listed or open.
//!
//! Carries out the bookkeeping of covered cells of D2.7 §3.6 (progress survives its
//! author). Coverage merges by union and nothing else, so that loss, order,
//! duplication and relaying cannot harm it. What the cells mean, and which loop they
//! are counted on, is left to the callers.

use crate::varint;
use crate::wire::message::CellRun;
use skein_geometry::hash::{Fnv, folded};

/// Why run lengths were refused; nothing was decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CellsError {
    /// A run length is cut off, longer than it need be, or beyond 65,535.
    #[error("run length at byte {at} is malformed; the set is refused")]
    Length {
        /// Offset of the byte.
        at: usize,
    },
    /// A run other than the first is empty: the same set would have two encodings.
    #[error("run {run} is empty; the set is refused")]
    Empty {
        /// Which run, from 0.
        run: usize,
    },
    /// The runs reach beyond the loop.
    #[error("runs cover {cells} cells of a loop of {n}; the set is refused")]
    Beyond {
        /// Cells the runs add up to.
        cells: u32,
        /// Cells of the loop.
        n: u16,
    },
    /// The last run is an uncovered one: the same set would have two encodings.
    #[error("the last run is not of covered cells; the set is refused")]
    Open,
}

/// A set of the cells `0 .. n` of a loop.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct CellSet {
    n: u16,
    words: Vec<u64>,
}

impl CellSet {
    /// The empty set over a loop of `n` cells.
    #[must_use]
    pub fn new(n: u16) -> Self {
        Self {
            n,
            words: vec![0; usize::from(n).div_ceil(64)],
        }
    }

    /// All cells of a loop of `n` cells.
    #[must_use]
    pub fn full(n: u16) -> Self {
        let mut words = vec![u64::MAX; usize::from(n).div_ceil(64)];
        if let Some(last) = words.last_mut()
            && !n.is_multiple_of(64)
        {
            *last = (1 << (n % 64)) - 1;
        }
        Self { n, words }
    }

    /// The set of these cells; those beyond the loop are left out.
    #[must_use]
    pub fn of(n: u16, cells: impl IntoIterator<Item = u16>) -> Self {
        let mut set = Self::new(n);
        for cell in cells {
            set.insert(cell);
        }
        set
    }

    /// The cells of some runs (cyclic).
    #[must_use]
    pub fn of_runs(n: u16, runs: impl IntoIterator<Item = CellRun>) -> Self {
        let mut set = Self::new(n);
        for run in runs {
            set.insert_run(run);
        }
        set
    }

    fn place(cell: u16) -> (usize, u64) {
        (usize::from(cell / 64), 1_u64 << (cell % 64))
    }

    /// Adds a cell; returns whether it was missing. A cell beyond the loop is ignored.
    pub fn insert(&mut self, cell: u16) -> bool {
        if cell >= self.n {
            return false;
        }
        let (word, bit) = Self::place(cell);
        let fresh = self.words[word] & bit == 0;
        self.words[word] |= bit;
        fresh
    }

    /// Adds the cells of a run (cyclic); returns whether any was missing.
    pub fn insert_run(&mut self, run: CellRun) -> bool {
        if self.n == 0 {
            return false;
        }
        let first = run.first % self.n;
        let count = run.count.min(self.n);
        // What reaches beyond the last cell goes on at the first.
        let before = count.min(self.n - first);
        let fresh = self.insert_stretch(first, before);
        self.insert_stretch(0, count - before) || fresh
    }

    /// Adds `count` cells from `first` on, none of them beyond the loop, word by word.
    fn insert_stretch(&mut self, first: u16, count: u16) -> bool {
        let (mut fresh, mut at, end) =
            (false, u32::from(first), u32::from(first) + u32::from(count));
        while at < end {
            let next = end.min((at / 64 + 1) * 64);
            let bits = (u64::MAX >> (64 - (next - at))) << (at % 64);
            let word = &mut self.words[(at / 64) as usize];
            fresh |= bits & !*word != 0;
            *word |= bits;
            at = next;
        }
        fresh
    }

    /// Takes a cell out; returns whether it was there.
    pub fn remove(&mut self, cell: u16) -> bool {
        if !self.contains(cell) {
            return false;
        }
        let (word, bit) = Self::place(cell);
        self.words[word] &= !bit;
        true
    }

    /// Whether the cell is in the set.
    #[must_use]
    pub fn contains(&self, cell: u16) -> bool {
        let (word, bit) = Self::place(cell);
        self.words.get(word).is_some_and(|w| w & bit != 0)
    }

    /// Cells of the loop, in the set or not.
    #[must_use]
    pub fn capacity(&self) -> u16 {
        self.n
    }

    /// Whether no cell is in the set.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.words.iter().all(|w| *w == 0)
    }

    /// Cells in the set.
    #[must_use]
    pub fn count(&self) -> u16 {
        let ones: u32 = self.words.iter().map(|w| w.count_ones()).sum();
        u16::try_from(ones).unwrap_or(u16::MAX)
    }

    /// Whether every cell of the loop is in the set.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.next_from(0, false) == self.n
    }

    /// Adds all cells of `other`; returns whether any was missing. A set over another
    /// loop length is ignored: its cells have other names.
    pub fn union_with(&mut self, other: &Self) -> bool {
        if other.n != self.n {
            return false;
        }
        let mut fresh = false;
        for (mine, theirs) in self.words.iter_mut().zip(&other.words) {
            fresh |= theirs & !*mine != 0;
            *mine |= theirs;
        }
        fresh
    }

    /// Takes all cells of `other` out. A set over another loop length is ignored.
    pub fn subtract(&mut self, other: &Self) {
        if other.n != self.n {
            return;
        }
        for (mine, theirs) in self.words.iter_mut().zip(&other.words) {
            *mine &= !theirs;
        }
    }

    /// Keeps only what is in `other` too. A set over another loop length is ignored.
    pub fn intersect_with(&mut self, other: &Self) {
        if other.n != self.n {
            return;
        }
        for (mine, theirs) in self.words.iter_mut().zip(&other.words) {
            *mine &= theirs;
        }
    }

    /// Whether every cell of this set is in `other` too.
    #[must_use]
    pub fn is_subset(&self, other: &Self) -> bool {
        self.n == other.n
            && self
                .words
                .iter()
                .zip(&other.words)
                .all(|(a, b)| a & !b == 0)
    }

    /// Whether some cell is in both sets.
    #[must_use]
    pub fn intersects(&self, other: &Self) -> bool {
        self.n == other.n && self.words.iter().zip(&other.words).any(|(a, b)| a & b != 0)
    }

    /// The cells of the loop that are not in the set.
    #[must_use]
    pub fn complement(&self) -> Self {
        let mut rest = Self::full(self.n);
        rest.subtract(self);
        rest
    }

    /// The cells in the set, ascending.
    pub fn iter(&self) -> impl Iterator<Item = u16> + '_ {
        self.words.iter().zip(0_u16..).flat_map(|(word, i)| {
            let mut left = *word;
            core::iter::from_fn(move || {
                let bit = left.trailing_zeros();
                // Clears the lowest bit; 0 stays 0 and ends the iteration.
                left &= left.wrapping_sub(1);
                (bit < 64).then(|| i * 64 + u16::try_from(bit).unwrap_or(0))
            })
        })
    }

    /// Identifies the content: two sets that differ differ here but for chance.
    #[must_use]
    pub fn digest(&self) -> u32 {
        let mut h = Fnv::new();
        h.write(&self.n.to_le_bytes());
        for word in &self.words {
            h.write(&word.to_le_bytes());
        }
        folded(h.finish())
    }

    /// The longest runs of consecutive cells, ascending; no run crosses the seam
    /// between the last cell and cell 0.
    #[must_use]
    pub fn runs(&self) -> Vec<CellRun> {
        self.each_run().collect()
    }

    fn each_run(&self) -> impl Iterator<Item = CellRun> + '_ {
        let mut at = 0;
        core::iter::from_fn(move || {
            let first = self.next_from(at, true);
            at = self.next_from(first, false);
            let count = at - first;
            (count > 0).then_some(CellRun { first, count })
        })
    }

    /// The first cell from one on that is in the set, or that is not; the number of cells where
    /// there is none.
    fn next_from(&self, from: u16, is_in: bool) -> u16 {
        let (word, bit) = Self::place(from);
        let mut from_here = !(bit - 1);
        let mut cells_before = from - from % 64;
        for word in self.words.iter().skip(word) {
            let found = if is_in { *word } else { !word } & from_here;
            if found != 0 {
                let bit = u16::try_from(found.trailing_zeros()).unwrap_or(0);
                // Past the last cell bits are neither.
                return (cells_before + bit).min(self.n);
            }
            from_here = u64::MAX;
            cells_before = cells_before.saturating_add(64);
        }
        self.n
    }

    /// Bytes of the run lengths of the whole set.
    #[must_use]
    pub fn rle_len(&self) -> usize {
        lengths_of(self.each_run()).map(varint::len).sum()
    }

    /// Run lengths, uncovered first, alternating, each as a little-endian base-128
    /// number; the uncovered rest of the loop is left out, so the empty set is no
    /// bytes. Where `max_bytes` is too little the shortest covered runs are left out:
    /// that forgets coverage, which costs duplicate work and never leaves a gap.
    #[must_use]
    pub fn encode_rle(&self, max_bytes: Option<usize>) -> Vec<u8> {
        let Some(cap) = max_bytes.filter(|cap| self.rle_len() > *cap) else {
            return encode_runs(self.each_run());
        };
        let runs = self.runs();
        let mut by_length: Vec<usize> = (0..runs.len()).collect();
        by_length.sort_by_key(|i| (runs[*i].count, *i));
        let mut dropped_at = vec![0_usize; runs.len()];
        for (rank, i) in by_length.iter().enumerate() {
            dropped_at[*i] = rank;
        }
        // Leaving out one run more never lengthens the bytes (three numbers become
        // one that is no longer than they were), so the search may halve.
        let without = |drop: usize| {
            encode_runs(
                runs.iter()
                    .zip(&dropped_at)
                    .filter(|(_, rank)| **rank >= drop)
                    .map(|(run, _)| *run),
            )
        };
        let (mut low, mut high) = (0, runs.len());
        while high - low > 1 {
            let mid = usize::midpoint(low, high);
            if without(mid).len() > cap {
                low = mid;
            } else {
                high = mid;
            }
        }
        without(high)
    }

    /// Reads what [`CellSet::encode_rle`] wrote, over a loop of `n` cells.
    ///
    /// # Errors
    /// [`CellsError`] where the bytes are not the one encoding of a set that fits.
    pub fn decode_rle(n: u16, bytes: &[u8]) -> Result<Self, CellsError> {
        let mut set = Self::new(n);
        let (mut at, mut cells, mut run) = (0_usize, 0_u32, 0_usize);
        while at < bytes.len() {
            let read = varint::read(&bytes[at..]);
            let read = read.and_then(|(value, used)| Some((u16::try_from(value).ok()?, used)));
            let (length, used) = read.ok_or(CellsError::Length { at })?;
            at += used;
            if length == 0 && run > 0 {
                return Err(CellsError::Empty { run });
            }
            let first = cells;
            cells += u32::from(length);
            if cells > u32::from(n) {
                return Err(CellsError::Beyond { cells, n });
            }
            if run % 2 == 1 {
                let first = u16::try_from(first).unwrap_or(u16::MAX);
                set.insert_run(CellRun {
                    first,
                    count: length,
                });
            }
            run += 1;
        }
        if run % 2 == 1 {
            return Err(CellsError::Open);
        }
        Ok(set)
    }
}

fn encode_runs(runs: impl Iterator<Item = CellRun>) -> Vec<u8> {
    let mut bytes = Vec::new();
    lengths_of(runs).for_each(|length| varint::write(&mut bytes, length));
    bytes
}

/// How many cells are not in any run, how many are in the first, and so on by turns.
fn lengths_of(runs: impl Iterator<Item = CellRun>) -> impl Iterator<Item = u32> {
    let mut end = 0_u16;
    runs.flat_map(move |run| {
        let gap = run.first - end;
        // A run ends at the loop's last cell at most, so the sum fits.
        end = run.first.saturating_add(run.count);
        [u32::from(gap), u32::from(run.count)]
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::vec;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    /// Bytes of the longest run length: a `u16` in groups of seven bits.
    const VARINT_MAX_BYTES: usize = 3;

    fn sets() -> impl Strategy<Value = (u16, BTreeSet<u16>)> {
        (0_u16..700)
            .prop_flat_map(|n| (Just(n), vec((0..n.max(1), 1_u16..40), 0..40)))
            .prop_map(|(n, runs)| {
                let cells = runs
                    .iter()
                    .flat_map(|(first, count)| *first..first.saturating_add(*count));
                (n, cells.filter(|c| *c < n).collect())
            })
    }

    proptest! {
        #[test]
        fn a_set_behaves_like_a_sorted_set((n, cells) in sets(), probe in any::<u16>()) {
            let mut set = CellSet::of(n, cells.iter().copied());
            prop_assert_eq!(set.iter().collect::<Vec<_>>(), cells.iter().copied().collect::<Vec<_>>());
            prop_assert_eq!(usize::from(set.count()), cells.len());
            prop_assert_eq!(set.contains(probe), cells.contains(&probe));
            prop_assert_eq!(set.is_full(), cells.len() == usize::from(n));
            prop_assert_eq!(set.complement().count(), n - set.count());
            let listed: u32 = set.runs().iter().map(|r| u32::from(r.count)).sum();
            prop_assert_eq!(listed, u32::from(set.count()));
            // Between two runs a cell is missing, and each is as long as can be.
            let apart = set.runs().windows(2).all(|r| r[0].first + r[0].count < r[1].first);
            prop_assert!(apart);
            prop_assert_eq!(CellSet::of_runs(n, set.runs()), set.clone());
            prop_assert_eq!(set.remove(probe), cells.contains(&probe));
            prop_assert!(!set.contains(probe));
        }

        #[test]
        fn a_run_is_its_cells_one_by_one((n, cells) in sets(), first in any::<u16>(), count in any::<u16>()) {
            let mut set = CellSet::of(n, cells);
            let mut other = set.clone();
            let listed = (0..u32::from(count.min(n))).map(|k| (u32::from(first) + k) % u32::from(n.max(1)));
            // Not any(): each of them is added.
            let fresh = listed.map(|c| other.insert(u16::try_from(c).unwrap())).fold(false, |a, b| a | b);
            prop_assert_eq!(set.insert_run(CellRun { first, count }), fresh);
            let flags = |set: &CellSet| (0..n).map(|c| set.contains(c)).collect::<Vec<bool>>();
            prop_assert_eq!(flags(&set), flags(&other));
            prop_assert_eq!(set, other);
        }

        #[test]
        fn run_lengths_come_back((n, cells) in sets()) {
            let set = CellSet::of(n, cells);
            let bytes = set.encode_rle(None);
            prop_assert_eq!(bytes.len(), set.rle_len());
            prop_assert_eq!(CellSet::decode_rle(n, &bytes), Ok(set));
        }

        #[test]
        fn capped_run_lengths_forget_and_never_invent((n, cells) in sets(), cap in 0_usize..40) {
            let set = CellSet::of(n, cells);
            let bytes = set.encode_rle(Some(cap));
            prop_assert!(bytes.len() <= cap);
            let read = CellSet::decode_rle(n, &bytes).unwrap();
            prop_assert!(read.is_subset(&set));
            let longest = set.runs().iter().map(|r| r.count).max();
            if cap >= 2 * VARINT_MAX_BYTES && longest.is_some() {
                prop_assert_eq!(read.runs().iter().map(|r| r.count).max(), longest);
            }
        }

        #[test]
        fn union_is_commutative_associative_idempotent((n, a) in sets(), b in vec(any::<u16>(), 0..60), c in vec(any::<u16>(), 0..60)) {
            let of = |cells: &[u16]| CellSet::of(n, cells.iter().map(|x| x % n.max(1)));
            let join = |x: &CellSet, y: &CellSet| { let mut z = x.clone(); z.union_with(y); z };
            let a = CellSet::of(n, a);
            let (b, c) = (of(&b), of(&c));
            prop_assert_eq!(join(&a, &b), join(&b, &a));
            prop_assert_eq!(join(&join(&a, &b), &c), join(&a, &join(&b, &c)));
            prop_assert_eq!(join(&a, &a), a.clone());
            let mut grown = a.clone();
            prop_assert_eq!(grown.union_with(&b), !b.is_subset(&a));
            prop_assert_eq!(grown.digest() == a.digest(), b.is_subset(&a));
            let mut left = a.clone();
            left.subtract(&b);
            prop_assert!(!left.intersects(&b) && left.is_subset(&a));
            let mut common = a.clone();
            common.intersect_with(&b);
            prop_assert!(common.is_subset(&a) && common.is_subset(&b));
            prop_assert_eq!(join(&left, &common), a);
        }

        #[test]
        fn garbage_is_refused_or_is_the_one_encoding(n in 0_u16..400, bytes in vec(any::<u8>(), 0..30)) {
            if let Ok(set) = CellSet::decode_rle(n, &bytes) {
                prop_assert_eq!(set.encode_rle(None), bytes);
            }
        }
    }

    #[test]
    fn malformed_run_lengths_are_named() {
        let refused = [
            (vec![0x80], CellsError::Length { at: 0 }),
            (vec![0x80, 0x00], CellsError::Length { at: 0 }),
            (vec![0xff, 0xff, 0x7f], CellsError::Length { at: 0 }),
            (vec![0, 0], CellsError::Empty { run: 1 }),
            (vec![0, 11], CellsError::Beyond { cells: 11, n: 10 }),
            (vec![0, 2, 3], CellsError::Open),
        ];
        for (bytes, why) in refused {
            assert_eq!(CellSet::decode_rle(10, &bytes), Err(why), "{bytes:?}");
        }
    }

    #[test]
    fn the_largest_loop_fits() {
        let set = CellSet::full(u16::MAX);
        assert!(set.is_full());
        assert_eq!(
            CellSet::decode_rle(u16::MAX, &set.encode_rle(None)),
            Ok(set)
        );
        let mut wrapped = CellSet::new(10);
        assert!(wrapped.insert_run(CellRun { first: 8, count: 4 }));
        assert_eq!(wrapped.iter().collect::<Vec<_>>(), [0, 1, 8, 9]);
    }

    #[test]
    fn a_digest_is_the_folded_hash_of_size_and_words() {
        let set = CellSet::of(70, [0, 3, 64, 69]);
        let mut hash = Fnv::new();
        hash.write(&70_u16.to_le_bytes());
        hash.write(&0b1001_u64.to_le_bytes());
        hash.write(&0b10_0001_u64.to_le_bytes());
        let (high, low) = (hash.finish() >> 32, hash.finish() & 0xffff_ffff);
        // Bits that both halves have in common tell an exclusive fold from any other.
        assert_ne!(high & low, 0);
        assert_eq!(u64::from(set.digest()), high ^ low);
    }

    #[test]
    fn no_more_runs_are_left_out_than_the_bytes_ask_for_and_the_shortest_first() {
        let set = CellSet::of(40, [3, 10, 11, 20, 21, 22, 30]);
        let left = |max_bytes| {
            let bytes = set.encode_rle(Some(max_bytes));
            assert!(bytes.len() <= max_bytes);
            let left = CellSet::decode_rle(40, &bytes).unwrap();
            left.runs().iter().map(|r| r.first).collect::<Vec<_>>()
        };
        // Two bytes a run; of runs as long the first goes first.
        assert_eq!(left(8), [3, 10, 20, 30]);
        assert_eq!(left(7), [10, 20, 30]);
        assert_eq!(left(6), [10, 20, 30]);
        assert_eq!(left(4), [10, 20]);
        assert_eq!(left(2), [20]);
        assert!(left(1).is_empty());
    }
}
