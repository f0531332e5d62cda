//! What of the covered cells a peer says next: what is news, and now and then all.
//!
//! Sets merge by union, so any part of one may be said. Each cell that becomes known is
//! said twice; what is lost both times comes with the whole union.

use crate::cells::CellSet;
use crate::input::Time;
use crate::wire::message::CellRun;

/// The whole union is said so many intervals after it was said last, if a neighbour still
/// knows other cells: three times in the least bound of L4 for coverage, 12 I and more. Where
/// it is said in parts, twice as many: there are many who say other parts meanwhile.
pub const WHOLE_INTERVALS: u64 = 4;

/// Run-length bytes of one record. What many have covered in short runs does not fit: at 25
/// in one earshot of 64 kbit/s the record of it all was larger than the bucket (decision 50).
pub const COVERED_PART_BYTES: usize = 160;

/// What a peer said of one loop.
#[derive(Clone, Debug, Default)]
pub(crate) struct CoverageTold {
    loop_hash: u64,
    /// What it said at least once, and at least twice.
    once: Option<CellSet>,
    twice: Option<CellSet>,
    /// When all was said, or a part of it where it does not fit.
    whole: Option<Time>,
    /// Where the next part of all begins, and whether all was said in parts last.
    from: u16,
    in_parts: bool,
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
        let whole_ms = WHOLE_INTERVALS * interval_ms * if self.in_parts { 2 } else { 1 };
        let again = self.whole.map(|t| t.plus_ms(whole_ms));
        let mut news = covered.clone();
        if let Some(twice) = &self.twice {
            news.subtract(twice);
        }
        let said = match again {
            Some(again) if now < again && !self.stranger && !covered.is_full() => {
                if news.is_empty() {
                    return Err(again);
                }
                self.part(&news, &CellSet::new(covered.capacity()))
            }
            _ => {
                self.whole = Some(now);
                self.stranger = false;
                self.part(&news, covered)
            }
        };
        self.count(&said);
        Ok(said)
    }

    /// A neighbour said so: that counts as if it had been said here.
    pub fn heard(&mut self, loop_hash: u64, said: &CellSet) {
        if self.loop_hash == loop_hash && self.once.is_some() {
            self.count(said);
        }
    }

    /// So much was said once more.
    fn count(&mut self, said: &CellSet) {
        if let Some(before) = &self.once {
            let mut again = before.clone();
            again.intersect_with(said);
            if let Some(twice) = &self.twice {
                again.union_with(twice);
            }
            self.twice = Some(again);
        }
        let mut once = self.once.take().unwrap_or_else(|| said.clone());
        once.union_with(said);
        self.once = Some(once);
    }

    /// As much as one record holds: what is news first, then of all that is known the next
    /// runs in turn.
    fn part(&mut self, news: &CellSet, all: &CellSet) -> CellSet {
        let fits = |set: &CellSet| set.rle_len() <= COVERED_PART_BYTES;
        let mut said = news.clone();
        said.union_with(all);
        let in_parts = !fits(&said);
        if !all.is_empty() {
            self.in_parts = in_parts;
        }
        if !in_parts {
            return said;
        }
        said = CellSet::new(news.capacity());
        for set in [news, all] {
            let (before, from): (Vec<CellRun>, Vec<CellRun>) =
                set.runs().into_iter().partition(|r| r.first < self.from);
            for run in from.into_iter().chain(before) {
                let mut more = said.clone();
                more.insert_run(run);
                if !fits(&more) {
                    self.from = run.first;
                    return said;
                }
                said = more;
            }
        }
        said
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

    /// Every third cell of many: runs of one, which do not fit into one record.
    fn scattered(n: u16) -> CellSet {
        CellSet::of(n, (0..n).filter(|c| c % 3 == 0))
    }

    #[test]
    fn what_does_not_fit_is_said_in_parts_and_all_of_it_in_turn() {
        let covered = scattered(1500);
        let mut told = CoverageTold::default();
        let (mut said, mut now, mut records) = (CellSet::new(1500), Time(0), 0);
        while said != covered && records < 40 {
            match told.next(now, 7, &covered, 1000) {
                Ok(part) => {
                    assert!(part.encode_rle(None).len() <= COVERED_PART_BYTES);
                    assert!(part.is_subset(&covered) && !part.is_empty());
                    said.union_with(&part);
                    records += 1;
                    now = now.plus_ms(2000);
                }
                Err(again) => now = again,
            }
        }
        // 500 runs of two bytes each.
        assert!((7..=8).contains(&records), "{records}");
    }

    #[test]
    fn what_neighbours_said_twice_is_no_news() {
        let mut told = CoverageTold::default();
        let mut known = set(&[1]);
        assert!(told.next(Time(0), 7, &known, 1000).is_ok());
        assert!(told.next(Time(100), 7, &known, 1000).is_ok());
        known = set(&[1, 5, 9]);
        for _ in 0..2 {
            told.heard(7, &set(&[5]));
            told.heard(8, &set(&[9]));
        }
        assert_eq!(told.next(Time(200), 7, &known, 1000), Ok(set(&[9])));
    }
}
