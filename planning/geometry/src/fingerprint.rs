//! A number by which two processes compare what they have built (D2.7 §2.3.2: one
//! structure serves a class of UAVs).
//!
//! In the field nobody sends a mesh or a map over the radio: each process builds its
//! own from the same zones. All of it is deterministic to the bit, so equal content
//! means equal numbers, and different numbers mean different content. The number is
//! no defence against somebody who wants two contents to agree.

use crate::frame::Point;

/// Gathers words into 64 bits.
#[derive(Clone, Copy, Debug)]
pub struct Fingerprint(u64);

impl Fingerprint {
    /// Begins with the kind of the structure, so that no two kinds agree.
    #[must_use]
    pub fn of(kind: &str) -> Self {
        kind.bytes()
            .fold(Self(0xcbf2_9ce4_8422_2325), |c, b| c.with(u64::from(b)))
    }

    /// Adds a word. Every step is one to one, so one changed word never goes unseen.
    #[must_use]
    pub fn with(self, word: u64) -> Self {
        let mixed = (self.0.rotate_left(23) ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        Self(mixed ^ (mixed >> 29))
    }

    /// Adds a number by its bits.
    #[must_use]
    pub fn with_number(self, number: f64) -> Self {
        self.with(number.to_bits())
    }

    /// Adds a place.
    #[must_use]
    pub fn with_point(self, p: Point) -> Self {
        self.with_number(p.x).with_number(p.y)
    }

    /// Adds a list of indices, with its length.
    #[must_use]
    pub fn with_indices(self, list: impl ExactSizeIterator<Item = u32>) -> Self {
        let start = self.with(list.len() as u64);
        list.fold(start, |c, i| c.with(u64::from(i)))
    }

    /// The number.
    #[must_use]
    pub fn hash(self) -> u64 {
        self.0
    }
}
