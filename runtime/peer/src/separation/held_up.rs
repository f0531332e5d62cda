//! Who finds no way that is clear, on a launcher or in flight: when it shows others what they
//! hold up (decisions 117 and 132).

/// Who has no clear way shows others what they hold up after so long, milliseconds: by then who
/// has somewhere to go is gone.
const HELD_UP_MS: u64 = 5_000;

/// And again after so long, milliseconds: who makes room needs an exchange of messages and some
/// seconds of flight.
const PLEAD_AGAIN_MS: u64 = 10_000;

/// How long it has been without a clear way.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct HeldUp {
    held_up_since_ms: Option<u64>,
    pleaded_ms: Option<u64>,
}

impl HeldUp {
    /// Whether others are to be shown what they hold up.
    pub fn is_due(self, now_ms: u64) -> bool {
        let long_ms = self.held_up_since_ms.map_or(0, |since| now_ms - since);
        let lately = self
            .pleaded_ms
            .is_some_and(|at| now_ms < at + PLEAD_AGAIN_MS);
        long_ms >= HELD_UP_MS && !lately
    }

    /// For how long it has found none, milliseconds.
    pub fn since_ms(self, now_ms: u64) -> Option<u64> {
        let since = self.held_up_since_ms?;
        Some(now_ms.saturating_sub(since))
    }

    /// It has looked for a way.
    pub fn looked(&mut self, now_ms: u64, is_clear: bool, offers: bool) {
        if is_clear {
            *self = Self::default();
            return;
        }
        self.held_up_since_ms.get_or_insert(now_ms);
        if offers {
            self.pleaded_ms = Some(now_ms);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_pleads_after_five_seconds_and_every_ten_until_a_way_is_clear() {
        let mut held_up = HeldUp::default();
        let mut pleaded = Vec::new();
        for now_ms in (0..30_000).step_by(1_000) {
            let pleads = held_up.is_due(now_ms);
            if pleads {
                pleaded.push(now_ms);
            }
            held_up.looked(now_ms, false, pleads);
        }
        assert_eq!(pleaded, [5_000, 15_000, 25_000]);
        assert_eq!(held_up.since_ms(29_000), Some(29_000));
        held_up.looked(30_000, true, true);
        assert!(!held_up.is_due(31_000) && !held_up.is_due(60_000));
        assert_eq!(held_up.since_ms(31_000), None);
        held_up.looked(60_000, false, false);
        assert!(!held_up.is_due(64_000) && held_up.is_due(65_000));
    }
}
