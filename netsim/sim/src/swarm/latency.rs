//! How long single inputs keep the mind of a peer busy: from a percept to its setpoint, and what
//! a percept may have to wait for (D2.7 §1.2.3: the reactive layer answers in time, whatever is
//! planned).
//!
//! Measured by a lent clock, as [`super::meter`] does, and of no effect on the run.

/// Bins of a doubling: a quantile is told within 9 %.
const FINE: u32 = 8;

/// Bins up to 2³² ns, four seconds.
const BINS: usize = 32 * FINE as usize;

/// What a peer was asked while something else may have been planned for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// A percept, with no plan under way.
    Percept,
    /// A percept, beside a plan that is computed for it.
    PerceptBesidePlan,
    /// Anything else: a percept that comes meanwhile waits for so long.
    Other,
}

impl Asked {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Percept, Self::PerceptBesidePlan, Self::Other];

    /// Its name in figures.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Percept => "percept",
            Self::PerceptBesidePlan => "percept beside a plan",
            Self::Other => "other inputs",
        }
    }
}

/// Times of one kind.
#[derive(Clone, Copy, Debug)]
pub struct Latency {
    bins: [u32; BINS],
    n: u64,
    max_ns: u64,
}

impl Default for Latency {
    fn default() -> Self {
        Self {
            bins: [0; BINS],
            n: 0,
            max_ns: 0,
        }
    }
}

impl Latency {
    /// Takes one more.
    pub fn note(&mut self, took_ns: u64) {
        let ns = took_ns.max(1);
        let octave = ns.ilog2();
        // The next bits below the leading one, however many there are.
        let below = ((u128::from(ns) << 3) >> octave) as u32 - FINE;
        let bin = (octave * FINE + below) as usize;
        self.bins[bin.min(BINS - 1)] += 1;
        self.n += 1;
        self.max_ns = self.max_ns.max(took_ns);
    }

    /// How many there were.
    #[must_use]
    pub fn n(&self) -> u64 {
        self.n
    }

    /// The longest, nanoseconds.
    #[must_use]
    pub fn max_ns(&self) -> u64 {
        self.max_ns
    }

    /// What this many of a thousand do not exceed, nanoseconds.
    #[must_use]
    pub fn quantile_ns(&self, permille: u64) -> u64 {
        let wanted = (self.n * permille).div_ceil(1000);
        let mut below = 0;
        for (bin, n) in (0_u32..).zip(self.bins) {
            below += u64::from(n);
            if below >= wanted {
                let (octave, part) = (bin / FINE, u64::from(bin % FINE));
                let ends = (((u64::from(FINE) + part + 1) as u128) << octave) / u128::from(FINE);
                return u64::try_from(ends).unwrap_or(u64::MAX).min(self.max_ns);
            }
        }
        self.max_ns
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_told_within_a_tenth() {
        let mut times = Latency::default();
        for ns in 1..=100_000_u64 {
            times.note(ns * 37);
        }
        for permille in [10, 500, 990, 999] {
            let (told, is) = (times.quantile_ns(permille), permille * 3_700);
            assert!(
                told >= is && told as f64 <= is as f64 * 1.13,
                "{permille}: {told} {is}"
            );
        }
        assert_eq!((times.n(), times.max_ns()), (100_000, 3_700_000));
        let mut few = Latency::default();
        few.note(0);
        few.note(5_000_000_000_000);
        assert_eq!(
            few.quantile_ns(1000),
            few.max_ns().min(few.quantile_ns(1000))
        );
        assert_eq!(Latency::default().quantile_ns(990), 0);
    }
}
