//! How long things may take (docs/protocol.md §8), and how hard a bound is at which loss.

/// The bounds at one beacon period and one diameter, milliseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bounds {
    /// Beacon period T.
    pub period_ms: u64,
    /// The longest interval I that a running peer's beacons announced lately, at least T.
    pub interval_ms: u64,
    /// Hop diameter D: the larger of the true one within the last 10·T and the one
    /// that any live peer reckons with, because peers must act on the latter.
    pub diameter: u64,
}

/// So many bounds are what a single case may take where something is lost: of some 700 storms
/// of seven scenarios at up to 30 % loss none took more than 0.9 of a
/// bound that this is for, and 1.4 among twenty UAVs over several hops.
pub const LOSSY_FACTOR: u64 = 2;

impl Bounds {
    /// Everybody in a component knows of a death: (k1 + k2 + D + 2)·I with
    /// k1 = 4 + D/4 and k2 = 4 + D/2, plus the rounding of an age, 100 ms a hop.
    #[must_use]
    pub fn detection_ms(&self) -> u64 {
        let quarters = 4 * (4 + 4 + 2) + (1 + 2 + 4) * self.diameter;
        (quarters * self.interval_ms).div_ceil(4) + 100 * (self.diameter + 1)
    }

    /// W0 = (2D + 3)·I: how long a round waits for its snapshots at first.
    #[must_use]
    pub fn first_wait_ms(&self) -> u64 {
        (2 * self.diameter + 3) * self.interval_ms
    }

    /// L2: an orphan is listed by a live peer within 2·I + 2·W0.
    #[must_use]
    pub fn takeover_ms(&self) -> u64 {
        2 * self.interval_ms + 2 * self.first_wait_ms()
    }

    /// L4: every record older than (3D + 5)·I is held by all.
    #[must_use]
    pub fn spread_ms(&self) -> u64 {
        (3 * self.diameter + 5) * self.interval_ms
    }

    /// L3: a peer yields what it hears listed at a higher stamp within 2·T.
    #[must_use]
    pub fn yield_ms(&self) -> u64 {
        2 * self.period_ms
    }

    /// A boot listens for 3·T before it speaks.
    #[must_use]
    pub fn probation_ms(&self) -> u64 {
        3 * self.period_ms
    }

    /// L6: a restarted peer is productive within 20·I of the end of its probation.
    #[must_use]
    pub fn productive_ms(&self) -> u64 {
        20 * self.interval_ms
    }
}

/// How hard a graded bound is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Grade {
    /// No loss: every case keeps the bound.
    Hard,
    /// At most a tenth is lost: 95 of 100 cases keep the bound, each twice it.
    Light,
    /// At most three tenths are lost, as in the worst of storms: each case keeps twice the bound.
    Heavy,
    /// More is lost: cases are reported.
    Reported,
}

impl Grade {
    /// The grade at some loss, thousandths.
    #[must_use]
    pub fn of(loss_permille: u16) -> Self {
        match loss_permille {
            0 => Self::Hard,
            1..=100 => Self::Light,
            101..=300 => Self::Heavy,
            _ => Self::Reported,
        }
    }

    /// What no single case may exceed, if anything, milliseconds.
    #[must_use]
    pub fn limit_ms(self, bound_ms: u64) -> Option<u64> {
        self.limit_of(bound_ms, LOSSY_FACTOR)
    }

    /// The same where a single case may take so many bounds when something is lost.
    #[must_use]
    pub fn limit_of(self, bound_ms: u64, lossy_factor: u64) -> Option<u64> {
        match self {
            Self::Hard => Some(bound_ms),
            Self::Light | Self::Heavy => Some(bound_ms * lossy_factor),
            Self::Reported => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bounds_are_those_of_the_protocol() {
        let b = Bounds {
            period_ms: 1000,
            interval_ms: 1000,
            diameter: 4,
        };
        assert_eq!(b.detection_ms(), (5 + 6 + 4 + 2) * 1000 + 500);
        assert_eq!(b.first_wait_ms(), 11_000);
        assert_eq!(b.takeover_ms(), 24_000);
        assert_eq!(b.spread_ms(), 17_000);
        let crowded = Bounds {
            interval_ms: 2500,
            ..b
        };
        assert_eq!(crowded.detection_ms(), 17 * 2500 + 500);
        assert_eq!(crowded.probation_ms(), 3000);
    }

    #[test]
    fn loss_grades_a_bound() {
        assert_eq!(Grade::of(0).limit_ms(10), Some(10));
        assert_eq!(Grade::of(100).limit_ms(10), Some(20));
        assert_eq!(Grade::of(101).limit_ms(10), Some(20));
        assert_eq!(Grade::of(300).limit_of(10, 3), Some(30));
        assert_eq!(Grade::of(301).limit_ms(10), None);
    }
}
