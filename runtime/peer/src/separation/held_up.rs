//! Who finds no way that is clear, on a launcher or in flight: when it shows others what they
//! hold up (decisions 117, 132 and 159).

/// Who has no clear way shows others what they hold up after so long, milliseconds: by then who
/// has somewhere to go is gone.
const HELD_UP_MS: u64 = 5_000;

/// And again after so long, milliseconds: who makes room needs an exchange of messages and some
/// seconds of flight.
const PLEAD_AGAIN_MS: u64 = 10_000;

/// What a look for the next flight found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Found {
    /// Nothing that is clear.
    Nothing,
    /// Nothing that is clear, and what others hold up is shown to them.
    Pleaded,
    /// A clear way that gets to no cell: it may lead round to where it was held up.
    Way,
    /// A clear way that gets to where it wants to.
    There,
}

/// How long it has been without a clear way.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct HeldUp {
    /// Since when it looks in vain.
    since_ms: Option<u64>,
    /// Since when it was held up for the first time on the way to where it wants to.
    first_ms: Option<u64>,
    pleaded_ms: Option<u64>,
}

impl HeldUp {
    /// Whether others are to be shown what they hold up.
    pub fn is_due(self, now_ms: u64) -> bool {
        let long_ms = self
            .first_ms
            .map_or(0, |since| now_ms.saturating_sub(since));
        let lately = self
            .pleaded_ms
            .is_some_and(|at| now_ms < at + PLEAD_AGAIN_MS);
        long_ms >= HELD_UP_MS && !lately
    }

    /// For how long it has found none, milliseconds.
    pub fn since_ms(self, now_ms: u64) -> Option<u64> {
        let since = self.since_ms?;
        Some(now_ms.saturating_sub(since))
    }

    /// It has looked for a way.
    pub fn looked(&mut self, now_ms: u64, found: Found) {
        match found {
            Found::There => *self = Self::default(),
            Found::Way => self.since_ms = None,
            Found::Nothing | Found::Pleaded => {
                self.since_ms.get_or_insert(now_ms);
                self.first_ms.get_or_insert(now_ms);
            }
        }
        if found == Found::Pleaded {
            self.pleaded_ms = Some(now_ms);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_pleads_after_five_seconds_and_every_ten_until_it_gets_there() {
        let mut held_up = HeldUp::default();
        let mut pleaded = Vec::new();
        for now_ms in (0..30_000).step_by(1_000) {
            let found = if held_up.is_due(now_ms) {
                pleaded.push(now_ms);
                Found::Pleaded
            } else {
                Found::Nothing
            };
            held_up.looked(now_ms, found);
        }
        assert_eq!(pleaded, [5_000, 15_000, 25_000]);
        assert_eq!(held_up.since_ms(29_000), Some(29_000));
        held_up.looked(30_000, Found::There);
        assert!(!held_up.is_due(31_000) && !held_up.is_due(60_000));
        assert_eq!(held_up.since_ms(31_000), None);
        held_up.looked(60_000, Found::Nothing);
        assert!(!held_up.is_due(64_000) && held_up.is_due(65_000));
    }

    /// Seed 923007 of the default mission at one height: it flew the way round to its last cell
    /// four times, 25 s each, and was held up for four seconds at the end of each, by one who
    /// circled with nothing to do.
    #[test]
    fn who_is_led_round_to_where_it_was_held_up_pleads_at_once() {
        let mut held_up = HeldUp::default();
        for now_ms in [1_000, 2_000, 3_000, 4_000] {
            held_up.looked(now_ms, Found::Nothing);
        }
        held_up.looked(5_000, Found::Way);
        assert_eq!(held_up.since_ms(6_000), None);
        held_up.looked(12_000, Found::Way);
        assert!(held_up.is_due(29_000));
        held_up.looked(29_000, Found::Pleaded);
        assert_eq!(held_up.since_ms(30_000), Some(1_000));
        assert!(!held_up.is_due(38_000));
    }
}
