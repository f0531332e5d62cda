//! A stream of numbers that looks random and is the same on every machine: what a search
//! draws its choices from, so that every peer computes the same plan byte for byte.

/// The stream; its seed is its whole state.
#[derive(Clone, Copy, Debug)]
pub struct Stream(u64);

impl Stream {
    /// The stream of a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next 64 bits: a Weyl sequence with two mixing steps.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// A number below `n`; 0 when `n` is 0.
    pub fn below(&mut self, n: usize) -> usize {
        // The high half of a product of 32-bit numbers: no division, and no index of a
        // map is above 32 bits.
        let product = (self.bits() >> 32) * n as u64;
        usize::try_from(product >> 32).unwrap_or(0)
    }
}
