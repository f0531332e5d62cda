//! What a peer makes durable before it speaks of it, and how it reads it back.
//!
//! A journal is a sequence of [`Entry`] records. Only promises are in it: the life
//! (incarnation), the bids with their round counter, the sections adopted or taken,
//! and the union of covered cells now and then. Everything else a peer hears again.

use crate::Incarnation;
use crate::cells::CellSet;
use crate::wire::cbor::{In, Out, Wire};
use crate::wire::codec::WireError;
use crate::wire::message::{Bid, Claim};

/// One journal record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Entry {
    /// A life begins.
    Life(Incarnation),
    /// A bid is about to be spoken.
    Bid(Bid),
    /// A section is about to be flown.
    Claim(Claim),
    /// Covered cells known of.
    Covered {
        /// The loop they are counted on.
        loop_hash: u64,
        /// Number of cells of that loop.
        cells: u16,
        /// Run-length encoded.
        covered: Vec<u8>,
    },
}

impl Entry {
    /// The bytes of the record: the number of the kind of entry, then its body in the
    /// encoding of the wire.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        let mut out = Out::new();
        out.array(2);
        match self {
            Self::Life(incarnation) => {
                0_u8.put(&mut out);
                incarnation.put(&mut out);
            }
            Self::Bid(bid) => {
                1_u8.put(&mut out);
                bid.put(&mut out);
            }
            Self::Claim(claim) => {
                2_u8.put(&mut out);
                claim.put(&mut out);
            }
            Self::Covered {
                loop_hash,
                cells,
                covered,
            } => {
                3_u8.put(&mut out);
                out.array(3);
                loop_hash.put(&mut out);
                cells.put(&mut out);
                covered.put(&mut out);
            }
        }
        out.into_bytes()
    }

    /// Reads a record back; `None` when it was written by another version.
    #[must_use]
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let mut input = In::new(bytes);
        let entry = Self::read(&mut input).ok()?;
        input.end().ok()?;
        Some(entry)
    }

    fn read(input: &mut In<'_>) -> Result<Self, WireError> {
        input.array("entry", 2)?;
        match u8::get(input)? {
            0 => Wire::get(input).map(Self::Life),
            1 => Wire::get(input).map(Self::Bid),
            2 => Wire::get(input).map(Self::Claim),
            3 => {
                input.array("covered", 3)?;
                Ok(Self::Covered {
                    loop_hash: Wire::get(input)?,
                    cells: Wire::get(input)?,
                    covered: Wire::get(input)?,
                })
            }
            number => Err(WireError::Kind { number }),
        }
    }
}

/// The state that a journal holds after all its records.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Durable {
    /// The latest life.
    pub incarnation: Incarnation,
    /// The highest round counter promised.
    pub counter: u32,
    /// The latest bid.
    pub bid: Option<Bid>,
    /// The latest claim: a division adopted, or cells taken.
    pub claim: Option<Claim>,
    /// Covered cells, run-length encoded along the loop of `loop_hash`.
    pub covered: Vec<u8>,
    /// The loop of `covered`.
    pub loop_hash: u64,
    /// Number of cells of that loop.
    pub cells: u16,
}

impl Durable {
    /// Reads journal records in the order they were written. A record that cannot
    /// be read is skipped and counted; it was written by a later version.
    #[must_use]
    pub fn replay(records: &[Vec<u8>]) -> (Self, usize) {
        let mut durable = Self::default();
        let mut unread = 0;
        for bytes in records {
            match Entry::decode(bytes) {
                Some(entry) => durable.apply(&entry),
                None => unread += 1,
            }
        }
        (durable, unread)
    }

    /// Takes one more record into account. Coverage only grows: unions on the same
    /// loop are merged, not replaced.
    pub fn apply(&mut self, entry: &Entry) {
        match entry {
            Entry::Life(incarnation) => self.incarnation = self.incarnation.max(*incarnation),
            Entry::Bid(bid) => {
                self.counter = self.counter.max(bid.round.counter);
                self.bid = Some(bid.clone());
            }
            Entry::Claim(claim) => {
                self.counter = self.counter.max(claim.epoch.counter);
                self.claim = Some(claim.clone());
            }
            Entry::Covered {
                loop_hash,
                cells,
                covered,
            } => {
                let mut merged = covered.clone();
                if (self.loop_hash, self.cells) == (*loop_hash, *cells)
                    && let (Ok(mut a), Ok(b)) = (
                        CellSet::decode_rle(*cells, &self.covered),
                        CellSet::decode_rle(*cells, covered),
                    )
                {
                    a.union_with(&b);
                    merged = a.encode_rle(None);
                }
                self.loop_hash = *loop_hash;
                self.cells = *cells;
                self.covered = merged;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn covered(cells: &[u16]) -> Entry {
        let set = CellSet::of(20, cells.iter().copied());
        Entry::Covered {
            loop_hash: 5,
            cells: 20,
            covered: set.encode_rle(None),
        }
    }

    #[test]
    fn replaying_gives_the_newest_promises_and_all_coverage() {
        let entries = [
            Entry::Life(3),
            covered(&[1, 2]),
            covered(&[7]),
            Entry::Life(4),
        ];
        let mut records: Vec<Vec<u8>> = entries.iter().map(Entry::encode).collect();
        records.push(vec![0xff, 0x00]);
        let (d, unread) = Durable::replay(&records);
        assert_eq!((d.incarnation, unread), (4, 1));
        let set = CellSet::decode_rle(20, &d.covered).unwrap();
        assert_eq!(set.iter().collect::<Vec<_>>(), [1, 2, 7]);
    }
}
