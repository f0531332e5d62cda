//! Since when which cells are orphans: a place for each cell of the loop, because among many all
//! of them are at first, and which of these places count.

use crate::Time;
use crate::cells::CellSet;

/// Since when which cells of a loop are orphans.
#[derive(Clone, Debug)]
pub(super) struct OrphanedAt {
    noted: CellSet,
    /// Of a cell that is not noted it says nothing.
    since: Vec<Time>,
}

impl OrphanedAt {
    /// None of so many cells.
    pub fn new(cells: u16) -> Self {
        Self {
            noted: CellSet::new(cells),
            since: vec![Time(0); usize::from(cells)],
        }
    }

    /// The cells that are noted.
    pub fn cells(&self) -> &CellSet {
        &self.noted
    }

    /// Since when a cell is one, if it is noted.
    pub fn since(&self, cell: u16) -> Option<Time> {
        let is_noted = self.noted.contains(cell);
        is_noted.then(|| self.since[usize::from(cell)])
    }

    /// Notes a cell, unless it is.
    pub fn note(&mut self, cell: u16, since: Time) {
        if self.noted.insert(cell) {
            self.since[usize::from(cell)] = since;
        }
    }

    /// A cell is no orphan any more.
    pub fn forget(&mut self, cell: u16) {
        self.noted.remove(cell);
    }

    /// All noted cells are orphans since so much later.
    pub fn delay(&mut self, ms: u64) {
        for since in &mut self.since {
            *since = since.plus_ms(ms);
        }
    }

    /// The cells that have been orphans for so long.
    pub fn older_than(&self, now: Time, ms: u64) -> CellSet {
        let is_old = |cell: &u16| now.since_ms(self.since[usize::from(*cell)]) >= ms;
        CellSet::of(self.noted.capacity(), self.noted.iter().filter(is_old))
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
        assert!(orphaned.cells().iter().eq([3, 69]));
        assert_eq!(orphaned.since(69), Some(Time(5)));
        orphaned.delay(10);
        let old = orphaned.older_than(Time(25), 10);
        assert!(old.iter().eq([69]));
        orphaned.forget(69);
        orphaned.forget(69);
        assert!(orphaned.cells().iter().eq([3]));
        assert_eq!(orphaned.since(69), None);
    }
}
