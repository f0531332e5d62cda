//! Since when which cells are orphans: a place for each cell of the loop, since among many all
//! of them are at first.

use crate::Time;
use crate::cells::CellSet;

/// Since when which cells of a loop are orphans.
#[derive(Clone, Debug)]
pub(super) struct OrphanedAt {
    since: Vec<Option<Time>>,
    noted: usize,
}

impl OrphanedAt {
    /// None of so many cells.
    pub fn new(cells: u16) -> Self {
        Self {
            since: vec![None; usize::from(cells)],
            noted: 0,
        }
    }

    /// How many cells are noted.
    pub fn len(&self) -> usize {
        self.noted
    }

    /// Since when a cell is one, if it is noted.
    pub fn since(&self, cell: u16) -> Option<Time> {
        self.since.get(usize::from(cell)).copied().flatten()
    }

    /// Notes a cell, unless it is.
    pub fn note(&mut self, cell: u16, since: Time) {
        if let Some(place @ None) = self.since.get_mut(usize::from(cell)) {
            *place = Some(since);
            self.noted += 1;
        }
    }

    /// A cell is no orphan any more.
    pub fn forget(&mut self, cell: u16) {
        let place = self.since.get_mut(usize::from(cell));
        self.noted -= usize::from(place.and_then(Option::take).is_some());
    }

    /// All noted cells are orphans since so much later.
    pub fn delay(&mut self, ms: u64) {
        for since in self.since.iter_mut().flatten() {
            *since = since.plus_ms(ms);
        }
    }

    /// The cells that have been orphans for so long.
    pub fn older_than(&self, now: Time, ms: u64) -> CellSet {
        let cells = u16::try_from(self.since.len()).unwrap_or(u16::MAX);
        let is_old = |since: &Option<Time>| since.is_some_and(|t| now.since_ms(t) >= ms);
        let old = (0..).zip(&self.since).filter(|(_, since)| is_old(since));
        CellSet::of(cells, old.map(|(cell, _)| cell))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_is_an_orphan_since_it_was_noted_first() {
        let mut orphaned = OrphanedAt::new(70);
        orphaned.note(69, Time(5));
        orphaned.note(69, Time(8));
        orphaned.note(3, Time(7));
        orphaned.note(70, Time(1));
        assert_eq!((orphaned.len(), orphaned.since(69)), (2, Some(Time(5))));
        orphaned.delay(10);
        let old = orphaned.older_than(Time(25), 10);
        assert!(old.iter().eq([69]));
        orphaned.forget(69);
        orphaned.forget(69);
        assert_eq!((orphaned.len(), orphaned.since(69)), (1, None));
    }
}
