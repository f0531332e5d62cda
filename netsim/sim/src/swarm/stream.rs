//! Independent random streams, one a concern, all derived from one seed, so that an
//! extra draw in one place shifts nothing elsewhere.

use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

/// What randomness is drawn for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Concern {
    /// The faults of a storm.
    Storm,
    /// What else goes wrong in it.
    Troubles,
    /// How long the disk of a peer takes to sync.
    Disk(u16),
    /// The seed a peer is configured with, and the offset of its clock.
    Peer(u16),
    /// The boot nonces of a peer.
    Nonce(u16),
    /// What an outsider sends.
    Outsider,
    /// The radio: fates of transmissions.
    Radio,
    /// One of the kinds of trouble that are drawn each for itself.
    Rare(u16),
}

impl Concern {
    fn stream(self) -> u64 {
        let (kind, who) = match self {
            Self::Storm => (1u64, 0),
            Self::Disk(p) => (2, p),
            Self::Peer(p) => (3, p),
            Self::Nonce(p) => (4, p),
            Self::Radio => (5, 0),
            Self::Troubles => (6, 0),
            Self::Outsider => (7, 0),
            Self::Rare(n) => (8, n),
        };
        (kind << 16) | u64::from(who)
    }
}

/// The stream of one concern.
#[derive(Clone, Debug)]
pub struct Stream(ChaCha8Rng);

impl Stream {
    /// The stream of `concern` under `seed`.
    #[must_use]
    pub fn new(seed: u64, concern: Concern) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(concern.stream());
        Self(rng)
    }

    /// Any 64-bit number.
    pub fn any(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// A number from `low` to `high`, both included; `low` when they are reversed.
    ///
    /// Taking the remainder of 64 random bits favours small numbers by less than
    /// one part in 2³², since no range here is longer than 2³².
    pub fn between(&mut self, low: u64, high: u64) -> u64 {
        let span = high.saturating_sub(low).saturating_add(1);
        low + self.0.next_u64() % span
    }

    /// True once in `n` times.
    pub fn one_in(&mut self, n: u64) -> bool {
        self.between(1, n.max(1)) == 1
    }

    /// An order of `0..n` in which every one is equally likely (Fisher-Yates).
    pub fn shuffled(&mut self, items: &[u16]) -> Vec<u16> {
        let mut out = items.to_vec();
        for i in (1..out.len()).rev() {
            let j = self.between(0, i as u64);
            out.swap(i, usize::try_from(j).unwrap_or(0));
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_draw_of_one_concern_shifts_no_other() {
        let mut a = Stream::new(7, Concern::Disk(1));
        let mut b = Stream::new(7, Concern::Disk(1));
        let mut other = Stream::new(7, Concern::Disk(2));
        let first = other.any();
        assert_ne!(first, b.any());
        a.any();
        assert_eq!(a.any(), b.any());
    }

    #[test]
    fn ranges_include_both_ends_and_nothing_else() {
        let mut s = Stream::new(1, Concern::Storm);
        let mut hit = [0u32; 4];
        for _ in 0..4000 {
            let v = s.between(3, 6);
            hit[usize::try_from(v - 3).unwrap()] += 1;
        }
        assert!(hit.iter().all(|h| (900..1100).contains(h)), "{hit:?}");
        assert_eq!(s.between(9, 2), 9);
    }
}
