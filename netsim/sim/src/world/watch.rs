//! How often what is seen is seen again, where a mission goes on once everything is: by the
//! pictures alone, whatever anybody says.

/// Pictures are taken so close in time that a cell which is in none for less than this has not
/// left them, milliseconds.
const APART_MS: u64 = 1_000;

/// When each cell was in a picture.
#[derive(Clone, Debug, Default)]
pub(super) struct Watch {
    /// When each cell was in a picture last.
    seen_ms: Vec<Option<u64>>,
    /// From when on a cell was in no picture, and for how long.
    gaps: Vec<(u64, u64)>,
}

impl Watch {
    pub(super) fn new(cells: usize) -> Self {
        Self {
            seen_ms: vec![None; cells],
            gaps: Vec::new(),
        }
    }

    /// A cell is in a picture.
    pub(super) fn see(&mut self, cell: usize, at_ms: u64) {
        let Some(seen_ms) = self.seen_ms.get_mut(cell) else {
            return;
        };
        if let Some(last_ms) = *seen_ms {
            let gap_ms = at_ms.saturating_sub(last_ms);
            if gap_ms > APART_MS {
                self.gaps.push((last_ms, gap_ms));
            }
        }
        *seen_ms = Some(at_ms);
    }

    /// A cell is the same place as one that was watched before.
    pub(super) fn remember(&mut self, cell: usize, other: &Self, was: usize) {
        if let (Some(mine), Some(theirs)) = (self.seen_ms.get_mut(cell), other.seen_ms.get(was)) {
            *mine = (*mine).max(*theirs);
        }
    }

    /// The longest time in which a cell was in no picture until it was again, of those times that
    /// began then or later, milliseconds.
    pub(super) fn longest_gap_ms(&self, from_ms: u64) -> u64 {
        let late = self
            .gaps
            .iter()
            .filter(|(began_ms, _)| *began_ms >= from_ms);
        late.map(|(_, gap_ms)| *gap_ms).max().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_lasts_from_one_picture_of_a_cell_to_the_next() {
        let mut watch = Watch::new(2);
        for at_ms in [1_000, 1_500, 2_000] {
            watch.see(0, at_ms);
        }
        assert_eq!(watch.longest_gap_ms(0), 0, "in the picture all the while");
        watch.see(0, 62_000);
        watch.see(1, 200_000);
        watch.see(0, 92_000);
        watch.see(7, 900_000);
        assert_eq!(watch.longest_gap_ms(0), 60_000);
        assert_eq!(watch.longest_gap_ms(2_001), 30_000, "begun before");
        let mut revised = Watch::new(1);
        revised.remember(0, &watch, 0);
        revised.see(0, 102_000);
        assert_eq!(revised.longest_gap_ms(0), 10_000);
    }
}
