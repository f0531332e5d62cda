//! Hashes that are the same on every machine: FNV-1a, and the fingerprint of a structure.
//!
//! Neither is a defence against somebody who wants two contents to agree.

use crate::frame::Point;

/// A number by which two processes compare what they have built (D2.7 §2.3.2: one
/// structure serves a class of UAVs).
///
/// In the field nobody sends a mesh or a map over the radio: each process builds its
/// own from the same zones. All of it is deterministic to the bit, so equal content
/// means equal numbers, and different numbers mean different content.
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

/// Half of a hash, of which both halves are a part.
#[must_use]
#[allow(clippy::cast_possible_truncation, reason = "half of a hash is wanted")]
pub fn folded(hash: u64) -> u32 {
    (hash ^ hash >> 32) as u32
}

/// FNV-1a, 64 bit (Fowler, Noll and Vo, 1991): small and stable.
#[derive(Clone, Copy, Debug)]
pub struct Fnv(u64);

impl Fnv {
    /// An empty hash.
    #[must_use]
    pub fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Adds bytes.
    pub fn write(&mut self, bytes: &[u8]) {
        for b in bytes {
            self.0 = (self.0 ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3);
        }
    }

    /// Adds a number, little-endian.
    pub fn write_i64(&mut self, v: i64) {
        self.write(&v.to_le_bytes());
    }

    /// The hash so far.
    #[must_use]
    pub fn finish(&self) -> u64 {
        self.0
    }
}

/// Writes every integer little-endian, so that a hash is the same everywhere.
impl core::hash::Hasher for Fnv {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        Self::write(self, bytes);
    }

    fn write_u16(&mut self, v: u16) {
        Self::write(self, &v.to_le_bytes());
    }

    fn write_u32(&mut self, v: u32) {
        Self::write(self, &v.to_le_bytes());
    }

    fn write_u64(&mut self, v: u64) {
        Self::write(self, &v.to_le_bytes());
    }

    fn write_usize(&mut self, v: usize) {
        Self::write(self, &(v as u64).to_le_bytes());
    }

    fn write_isize(&mut self, v: isize) {
        Self::write(self, &(v as i64).to_le_bytes());
    }
}

impl Default for Fnv {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fnv_gives_the_published_values() {
        let of = |text: &str| {
            let mut h = Fnv::new();
            h.write(text.as_bytes());
            h.finish()
        };
        assert_eq!(of(""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(of("a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(of("foobar"), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn fingerprints_tell_kinds_order_and_one_bit_apart() {
        let of = |kind: &str, words: &[u64]| {
            let start = Fingerprint::of(kind);
            words.iter().fold(start, |f, w| f.with(*w)).hash()
        };
        let all = [
            of("mesh", &[1, 2]),
            of("mesh", &[2, 1]),
            of("map", &[1, 2]),
            of("mesh", &[1, 3]),
            of("mesh", &[1]),
        ];
        for (i, a) in all.iter().enumerate() {
            assert!(!all[i + 1..].contains(a));
        }
    }
}
