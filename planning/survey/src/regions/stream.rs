//! A stream of numbers that looks random and is the same on every machine: what a search
//! draws its choices from, so that every peer computes the same plan byte for byte.

use skein_geometry::random::SplitMix64;

/// The stream; its seed is its whole state.
#[derive(Clone, Copy, Debug)]
pub struct Stream(SplitMix64);

impl Stream {
    /// The stream of a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0.bits()
    }

    /// A number below `n`; 0 when `n` is 0.
    pub fn below(&mut self, n: usize) -> usize {
        // The high half of a product of 32-bit numbers: no division, and no index of a
        // map is above 32 bits.
        let product = (self.bits() >> 32) * n as u64;
        usize::try_from(product >> 32).unwrap_or(0)
    }
}
