//! A seeded pseudo-random generator, the same on every machine: SplitMix64.
//!
//! For searches that try moves in no particular order, for instances of tests and
//! measurements, and for draws of the simulated radio. It asks no entropy: the seed is
//! part of the problem. Steele, Lea and Flood, "Fast splittable pseudorandom number
//! generators", OOPSLA 2014, <https://doi.org/10.1145/2660193.2660195>.

use crate::math::{TAU, cos, ln};

/// What the state grows by at each draw: 2⁶⁴ over the golden ratio, odd.
const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;

/// The first number of the stream of seed `x`: a hash of `x` with full avalanche.
#[must_use]
pub fn mix(x: u64) -> u64 {
    let mut z = x.wrapping_add(GOLDEN);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// The upper 53 of 64 bits as a number in [0, 1).
#[must_use]
pub fn unit(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

/// The generator; its seed is its whole state.
#[derive(Clone, Copy, Debug)]
pub struct SplitMix64(u64);

impl SplitMix64 {
    /// The stream of a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        let bits = mix(self.0);
        self.0 = self.0.wrapping_add(GOLDEN);
        bits
    }

    /// A number below `n`; 0 for `n` = 0.
    pub fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.bits()) * n as u128) >> 64) as usize
    }

    /// A number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        unit(self.bits())
    }

    /// A number of the standard normal distribution, by the transform of Box and Muller.
    pub fn normal(&mut self) -> f64 {
        // One less the draw is never zero, so its logarithm is finite.
        let radius = (-2.0 * ln(1.0 - self.unit())).sqrt();
        radius * cos(TAU * self.unit())
    }

    /// Puts a list into some order (Fisher and Yates).
    pub fn shuffle<T>(&mut self, list: &mut [T]) {
        for i in (1..list.len()).rev() {
            let j = self.below(i + 1);
            list.swap(i, j);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stream_is_the_published_one() {
        // Java's SplittableRandom and Vigna's splitmix64.c with seed 1234567.
        let mut random = SplitMix64::new(1_234_567);
        let expected = [
            6_457_827_717_110_365_317,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
            4_593_380_528_125_082_431,
            16_408_922_859_458_223_821,
        ];
        assert_eq!(expected.map(|_| random.bits()), expected);
        assert_eq!(SplitMix64::new(1).below(0), 0);
    }

    #[test]
    #[allow(clippy::cast_precision_loss, reason = "a few thousand draws")]
    fn normal_draws_have_mean_zero_and_variance_one() {
        let mut random = SplitMix64::new(11);
        let draws: Vec<f64> = (0..20_000).map(|_| random.normal()).collect();
        let n = draws.len() as f64;
        let mean = draws.iter().sum::<f64>() / n;
        let variance = draws.iter().map(|x| x * x).sum::<f64>() / n;
        let beyond_two = draws.iter().filter(|x| x.abs() > 2.0).count() as f64 / n;
        assert!(mean.abs() < 0.03 && (variance - 1.0).abs() < 0.04);
        assert!((beyond_two - 0.0455).abs() < 0.006, "{beyond_two}");
    }

    #[test]
    fn shuffles_keep_all_and_draws_stay_below() {
        let mut random = SplitMix64::new(3);
        let mut list: Vec<usize> = (0..50).collect();
        random.shuffle(&mut list);
        assert!(list.iter().enumerate().any(|(i, x)| i != *x));
        list.sort_unstable();
        assert_eq!(list, (0..50).collect::<Vec<_>>());
        assert!((0..200).all(|_| random.below(7) < 7));
        assert!((0..200).all(|_| (0.0..1.0).contains(&random.unit())));
    }
}
