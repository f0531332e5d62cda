//! Keys, kinds, messages, their bytes and their signatures.

pub(crate) mod cbor;
pub mod codec;
pub mod key;
pub mod kinds;
pub mod limits;
pub mod message;
#[cfg(test)]
mod samples;
pub mod schema;
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
