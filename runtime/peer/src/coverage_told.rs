//! What of the covered cells a peer says next: what is news, and now and then all.
//!
//! Sets merge by union, so any part of one may be said. Each cell that becomes known is
//! said twice; what is lost both times comes with the whole union.

use crate::cells::CellSet;
use crate::input::Time;

/// The whole union is said so many intervals after it was said last, if a neighbour still
/// knows other cells: three times in the least bound of L4 for coverage, 12 I and more.
pub const WHOLE_INTERVALS: u64 = 4;

/// What a peer said of one loop.
#[derive(Clone, Debug, Default)]
pub(crate) struct CoverageTold {
    loop_hash: u64,
    /// All that it knew when it spoke last, and the time before.
    last: Option<CellSet>,
    before: Option<CellSet>,
    whole: Option<Time>,
    /// Somebody may know nothing of what was said.
    stranger: bool,
}

impl CoverageTold {
    /// Somebody is heard who was not there lately.
    pub fn meet(&mut self) {
        self.stranger = true;
    }

    /// What to say of what is covered; the time to ask again where that is nothing yet.
    pub fn next(
        &mut self,
        now: Time,
        loop_hash: u64,
        covered: &CellSet,
        interval_ms: u64,
    ) -> Result<CellSet, Time> {
        if self.loop_hash != loop_hash {
            *self = Self {
                loop_hash,
                ..Self::default()
            };
        }
        let mut said = covered.clone();
        let again = self.whole.map(|t| t.plus_ms(WHOLE_INTERVALS * interval_ms));
        match again {
            Some(again) if now < again && !self.stranger && !covered.is_full() => {
                if let Some(before) = &self.before {
                    said.subtract(before);
                }
                if said.is_empty() {
                    return Err(again);
                }
            }
            _ => {
                self.whole = Some(now);
                self.stranger = false;
            }
        }
        self.before = self.last.replace(covered.clone());
        Ok(said)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(cells: &[u16]) -> CellSet {
        CellSet::of(20, cells.iter().copied())
    }

    #[test]
    fn news_is_said_twice_and_all_of_it_now_and_then() {
        let mut told = CoverageTold::default();
        let mut say = |t: u64, cells: &[u16]| told.next(Time(t), 7, &set(cells), 1000);
        assert_eq!(say(0, &[1, 2]), Ok(set(&[1, 2])));
        assert_eq!(say(500, &[1, 2, 3]), Ok(set(&[1, 2, 3])));
        assert_eq!(say(1_000, &[1, 2, 3, 4]), Ok(set(&[3, 4])));
        assert_eq!(say(1_500, &[1, 2, 3, 4]), Ok(set(&[4])));
        assert_eq!(say(2_000, &[1, 2, 3, 4]), Err(Time(4_000)));
        assert_eq!(say(3_000, &[1, 2, 3, 4, 9]), Ok(set(&[9])));
        assert_eq!(say(4_000, &[1, 2, 3, 4, 9]), Ok(set(&[1, 2, 3, 4, 9])));
    }

    #[test]
    fn who_was_not_there_is_told_all_and_so_is_everybody_at_the_end_and_on_another_loop() {
        let mut told = CoverageTold::default();
        let all: Vec<u16> = (0..20).collect();
        for (t, loop_hash, cells, whole) in [
            (0, 7, &all[..8], true),
            (1_000, 7, &all[..9], true),
            (2_000, 7, &all[..10], false),
            (3_000, 7, &all[..11], true),
            (4_000, 8, &all[..3], true),
            (5_000, 8, &all[..4], true),
            (6_000, 8, &all[..5], false),
            (7_000, 8, &all[..], true),
        ] {
            if t == 3_000 {
                told.meet();
            }
            let said = told.next(Time(t), loop_hash, &set(cells), 1000).unwrap();
            assert_eq!(said == set(cells), whole, "at {t}");
        }
    }
}
