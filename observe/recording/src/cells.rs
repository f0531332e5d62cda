//! Who has which cell: covered by whom, listed by whom, orphaned by whom. It follows from the
//! scenes and events of a run alone, so that whoever draws a map from a recording or from a
//! stream sees what the driver saw.

use crate::model::event::What;
use crate::model::{Event, Record, Scene};
use std::collections::{BTreeMap, BTreeSet};

/// What is known of one cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cell {
    /// Nobody lists it.
    #[default]
    Open,
    /// A peer lists it: where several do, the lowest number.
    Planned(u16),
    /// The peer that listed it is gone, and nobody has taken it.
    Orphaned(u16),
    /// A peer's camera saw it first.
    Covered(u16),
}

/// The cells of the scene in force.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cells {
    loop_hash: String,
    covered: Vec<Option<u16>>,
    listed: BTreeMap<u16, Vec<u16>>,
    held: BTreeMap<u16, Vec<u16>>,
    /// Whose each orphan was.
    orphans: BTreeMap<u16, u16>,
}

impl Cells {
    /// Those of a scene, all open.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        Self {
            loop_hash: scene.loop_hash.clone(),
            covered: vec![None; scene.cells.len()],
            ..Self::default()
        }
    }

    /// Takes the next word of a run.
    pub fn hear(&mut self, record: &Record) {
        match record {
            Record::Scene(scene) if scene.loop_hash != self.loop_hash => *self = Self::of(scene),
            Record::Scene(scene) => self.covered.resize(scene.cells.len(), None),
            Record::Event(event) => self.happen(event),
            Record::Frame(_) | Record::FailureFree(_) | Record::End(_) => {}
        }
    }

    /// Takes the next event of a run.
    pub fn happen(&mut self, event: &Event) {
        let Some(peer) = event.uav else {
            return;
        };
        match &event.what {
            What::Claim { cells, held, .. } => drop(self.claim(peer, cells, held)),
            What::Covered { cells, .. } => drop(self.cover(peer, cells)),
            What::Ended { .. } => drop(self.end(peer)),
            _ => {}
        }
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.covered.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.covered.is_empty()
    }

    /// What is known of each, in the order of the loop.
    #[must_use]
    pub fn all(&self) -> Vec<Cell> {
        let mut all: Vec<Cell> = vec![Cell::Open; self.covered.len()];
        for (cell, of) in &self.orphans {
            set(&mut all, *cell, Cell::Orphaned(*of));
        }
        // What a peer gave away it answers for until another lists it.
        for list in [&self.held, &self.listed] {
            for (peer, cells) in list.iter().rev() {
                cells
                    .iter()
                    .for_each(|c| set(&mut all, *c, Cell::Planned(*peer)));
            }
        }
        for (cell, by) in all.iter_mut().zip(&self.covered) {
            if let Some(by) = by {
                *cell = Cell::Covered(*by);
            }
        }
        all
    }

    /// Uncovered cells that a peer lists as its own future.
    #[must_use]
    pub fn n_left(&self, peer: u16) -> usize {
        let open = |c: &&u16| !self.is_covered(**c);
        let listed = self.listed.get(&peer).into_iter().flatten();
        listed.filter(open).collect::<BTreeSet<_>>().len()
    }

    /// Whether a claim says something else than the peer's last one.
    #[must_use]
    pub fn is_news(&self, peer: u16, cells: &[u16], held: &[u16]) -> bool {
        let said = |of: &BTreeMap<u16, Vec<u16>>, now: &[u16]| {
            of.get(&peer).is_some_and(|before| before == now)
        };
        !(said(&self.listed, cells) && said(&self.held, held))
    }

    /// A peer lists cells; gives the orphans among them, by whose they were, those that were
    /// its own left out.
    pub fn claim(&mut self, peer: u16, cells: &[u16], held: &[u16]) -> BTreeMap<u16, Vec<u16>> {
        let mut taken: BTreeMap<u16, Vec<u16>> = BTreeMap::new();
        for cell in cells {
            if let Some(from) = self.orphans.remove(cell).filter(|from| *from != peer) {
                taken.entry(from).or_default().push(*cell);
            }
        }
        self.listed.insert(peer, cells.to_vec());
        self.held.insert(peer, held.to_vec());
        taken
    }

    /// A peer's camera saw cells; gives those that are new.
    pub fn cover(&mut self, peer: u16, cells: &[u16]) -> Vec<u16> {
        let mut new = Vec::new();
        for cell in cells {
            if let Some(by @ None) = self.covered.get_mut(usize::from(*cell)) {
                *by = Some(peer);
                new.push(*cell);
            }
            self.orphans.remove(cell);
        }
        new
    }

    /// A peer is no more; gives its open cells, and those of them that nobody else lists.
    pub fn end(&mut self, peer: u16) -> (Vec<u16>, Vec<u16>) {
        let mut open: BTreeSet<u16> = BTreeSet::new();
        for list in [&mut self.listed, &mut self.held] {
            open.extend(list.remove(&peer).into_iter().flatten());
        }
        open.retain(|c| !self.is_covered(*c));
        let others: BTreeSet<u16> = (self.listed.values().chain(self.held.values()).flatten())
            .copied()
            .collect();
        let orphans: Vec<u16> = open.difference(&others).copied().collect();
        self.orphans.extend(orphans.iter().map(|c| (*c, peer)));
        (open.into_iter().collect(), orphans)
    }

    fn is_covered(&self, cell: u16) -> bool {
        let by = self.covered.get(usize::from(cell));
        by.is_some_and(Option::is_some)
    }
}

fn set(all: &mut [Cell], cell: u16, to: Cell) {
    if let Some(cell) = all.get_mut(usize::from(cell)) {
        *cell = to;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn five() -> Cells {
        Cells::of(&Scene {
            cells: vec![crate::model::scene::Cell::default(); 5],
            ..Scene::default()
        })
    }

    #[test]
    fn the_cells_of_a_dead_peer_are_orphans_until_somebody_lists_or_sees_them() {
        let mut cells = five();
        assert!(cells.claim(1, &[0, 1, 2, 3], &[]).is_empty());
        assert!(cells.claim(2, &[3, 4], &[]).is_empty());
        assert_eq!(cells.cover(1, &[0]), [0]);
        assert_eq!((cells.n_left(1), cells.n_left(2)), (3, 2));
        assert_eq!(cells.end(1), (vec![1, 2, 3], vec![1, 2]));
        let (open, orphan) = (Cell::Covered(1), Cell::Orphaned(1));
        let mine = Cell::Planned(2);
        assert_eq!(cells.all(), [open, orphan, orphan, mine, mine]);
        // One is taken over, the other seen in passing.
        assert_eq!(
            cells.claim(2, &[1, 3, 4], &[]),
            BTreeMap::from([(1, vec![1])])
        );
        assert_eq!(cells.cover(3, &[2, 0]), [2]);
        assert_eq!(cells.all(), [open, mine, Cell::Covered(3), mine, mine]);
    }

    #[test]
    fn whoever_comes_back_takes_nothing_over() {
        let mut cells = five();
        cells.claim(1, &[0, 1], &[2]);
        assert_eq!(cells.end(1), (vec![0, 1, 2], vec![0, 1, 2]));
        assert!(cells.claim(1, &[0, 1, 2], &[]).is_empty());
        assert_eq!(cells.all()[2], Cell::Planned(1));
    }

    #[test]
    fn cells_that_no_scene_has_change_nothing() {
        let mut cells = five();
        cells.claim(1, &[4, 900], &[901]);
        assert_eq!(cells.cover(1, &[902]), Vec::<u16>::new());
        assert_eq!(cells.all()[4], Cell::Planned(1));
        assert_eq!(cells.len(), 5);
    }
}
