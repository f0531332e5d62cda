//! Keys, kinds, messages, their bytes and their signatures.

mod cbor;
pub mod codec;
pub mod key;
pub mod kinds;
pub mod limits;
pub mod message;
#[cfg(test)]
mod samples;
pub mod signature;

/// FNV-1a, 64 bit: small, stable, and the same everywhere. Not for adversaries.
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

impl Default for Fnv {
    fn default() -> Self {
        Self::new()
    }
}
