//! The closed coverage loop on which all UAVs of a mission work (D2.7 §3.6.2, 3.6.5).
//!
//! Whatever is asked for, an area in lanes, points, lines or passes, becomes cells on one
//! closed curve; a cell is what one frame sees. Left to others: how the loop is laid
//! ([`crate::coverage::lanes`], [`crate::coverage::stations`]) and who flies which cells
//! ([`super::division`]).

use super::backtracking::RingCell;
use super::grid::{CellId, Grid};
use super::patch::{Listed, Patches};
use serde::{Deserialize, Serialize};
use skein_geometry::Curve;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::hash::Fnv;
use std::collections::BTreeMap;

/// Which way round the loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Direction {
    /// In the order of the cells.
    Forward,
    /// Against the order of the cells.
    Backward,
}

impl Direction {
    /// The other one.
    #[must_use]
    pub fn opposite(self) -> Self {
        match self {
            Self::Forward => Self::Backward,
            Self::Backward => Self::Forward,
        }
    }
}

/// One cell of the loop.
#[derive(Clone, Debug, PartialEq)]
pub struct LoopCell {
    /// Which cell.
    pub id: CellId,
    /// The curve that sees it, flown forward, from boundary `i` to boundary `i + 1`.
    pub curve: Curve,
    /// Whether it is an excursion (boundary `i` and `i + 1` are the same pose).
    pub excursion: bool,
    /// Length of `curve`, millimetres.
    pub service_mm: u32,
    /// Whether it touches the area; other cells are only flown over.
    pub needed: bool,
    /// Length flown when the cell needs no service, millimetres: 0 for excursions.
    pub travel_mm: u32,
    /// Where along `curve` one frame holds the whole cell, metres.
    pub view_m: f64,
}

impl LoopCell {
    /// Length flown along the loop when nothing is covered, millimetres.
    #[must_use]
    pub fn flown_mm(&self) -> u32 {
        if self.needed {
            self.service_mm
        } else {
            self.travel_mm
        }
    }
}

/// The loop on which all UAVs work. Cell `i` lies between boundary `i` and
/// boundary `i + 1`, cyclically.
#[derive(Clone, Debug)]
pub struct CoverageLoop {
    patches: Patches,
    cells: Vec<LoopCell>,
    boundaries: Vec<Pose>,
    index: BTreeMap<CellId, u16>,
    uncoverable: Vec<(CellId, String)>,
    hash: u64,
}

impl CoverageLoop {
    /// A loop of cells whose curves already join.
    pub(in crate::coverage) fn assembled(
        patches: Patches,
        cells: Vec<LoopCell>,
        uncoverable: Vec<(CellId, String)>,
        hash: u64,
    ) -> Self {
        Self {
            patches,
            boundaries: cells.iter().filter_map(|c| c.curve.start()).collect(),
            index: (0u16..).zip(&cells).map(|(i, c)| (c.id, i)).collect(),
            cells,
            uncoverable,
            hash,
        }
    }

    /// No loop: for a UAV that flies what was planned before, and has nothing to share.
    #[must_use]
    pub fn none() -> Self {
        let patches = Patches::Listed(Listed::new(Vec::new(), 0.0));
        Self::assembled(patches, Vec::new(), Vec::new(), 0)
    }

    /// Number of cells.
    #[must_use]
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Whether the loop has no cell; never true for a built loop.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// What the cells look like, and which lie where.
    #[must_use]
    pub fn patches(&self) -> &Patches {
        &self.patches
    }

    /// The grid that names the cells; none where the cells are pieces of targets.
    #[must_use]
    pub fn grid(&self) -> Option<Grid> {
        match self.patches {
            Patches::Grid(grid) => Some(grid),
            Patches::Listed(_) => None,
        }
    }

    /// Calls `visit` with every cell of the loop, by index and corners, that a frame
    /// at `at` reaching `across_m` and `along_m` to its sides may hold whole, whatever
    /// its heading; and perhaps with others.
    pub fn cells_near(
        &self,
        at: Point,
        across_m: f64,
        along_m: f64,
        visit: &mut impl FnMut(u16, &[Point; 4]),
    ) {
        self.patches
            .near(at, across_m, along_m, &mut |id, corners| {
                if let Some(cell) = self.index_of(id) {
                    visit(cell, corners);
                }
            });
    }

    /// The cells in forward order.
    #[must_use]
    pub fn cells(&self) -> &[LoopCell] {
        &self.cells
    }

    /// The cells as a division sees them, those open that `is_open` tells.
    #[must_use]
    pub fn ring(&self, is_open: impl Fn(u16, &LoopCell) -> bool) -> Vec<RingCell> {
        let cells = self.cells.iter().zip(0..=u16::MAX);
        cells
            .map(|(cell, i)| RingCell {
                service_mm: cell.service_mm,
                travel_mm: cell.travel_mm,
                open: is_open(i, cell),
            })
            .collect()
    }

    /// The pose at a boundary, looking forward; `index` is taken modulo the length.
    #[must_use]
    pub fn boundary(&self, index: usize) -> Pose {
        self.boundaries[index % self.boundaries.len()]
    }

    /// The pose at a boundary, looking the given way.
    #[must_use]
    pub fn boundary_towards(&self, index: usize, direction: Direction) -> Pose {
        match direction {
            Direction::Forward => self.boundary(index),
            Direction::Backward => self.boundary(index).reversed(),
        }
    }

    /// The curve through a cell, flown the given way.
    #[must_use]
    pub fn curve(&self, cell: usize, direction: Direction) -> Curve {
        match direction {
            Direction::Forward => self.cells[cell].curve.clone(),
            Direction::Backward => self.cells[cell].curve.reversed(),
        }
    }

    /// Where on the loop a cell is.
    #[must_use]
    pub fn index_of(&self, cell: CellId) -> Option<u16> {
        self.index.get(&cell).copied()
    }

    /// Cells that touch the area and cannot be seen, with the reason.
    #[must_use]
    pub fn uncoverable(&self) -> &[(CellId, String)] {
        &self.uncoverable
    }

    /// The same loop in another lap: what was covered before does not count on it.
    #[must_use]
    pub fn of_lap(mut self, lap: u16) -> Self {
        self.hash ^= lap_bits(lap);
        self
    }

    /// The same loop of another mission that is begun anew: what was covered before does not
    /// count on it.
    #[must_use]
    pub fn of_sortie(mut self, sortie: u16) -> Self {
        // Laps take small multiples of the same number; a turn keeps the two apart.
        self.hash ^= lap_bits(sortie).rotate_left(32);
        self
    }

    /// The same loop of a patrol that an operator changed so many times: laps that are begun
    /// again after a change are others than those of the same number before it.
    #[must_use]
    pub fn of_edit(mut self, edit: u16) -> Self {
        self.hash ^= lap_bits(edit).rotate_left(16);
        self
    }

    /// The same loop of a mission whose laps are flown at these heights, by their hash; 0 where
    /// all are flown at one.
    #[must_use]
    pub fn of_heights(mut self, heights: u64) -> Self {
        self.hash ^= heights;
        self
    }

    /// What identifies the loop in another lap than `lap`, which this one is of.
    #[must_use]
    pub fn hash_in_lap(&self, lap: u16, other: u16) -> u64 {
        self.hash ^ lap_bits(lap) ^ lap_bits(other)
    }

    /// Identifies the loop: equal on all peers that derived it from the same mission.
    #[must_use]
    pub fn hash(&self) -> u64 {
        self.hash
    }
}

fn lap_bits(lap: u16) -> u64 {
    // The golden ratio's odd multiple spreads small numbers over all bits.
    u64::from(lap).wrapping_mul(0x9e37_79b9_7f4a_7c15)
}

/// Length of a curve in whole millimetres, as loops count it.
pub(in crate::coverage) fn millimetres(curve: &Curve) -> u32 {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a cast of a float saturates"
    )]
    let mm = (curve.length_m() * 1000.0).round() as u32;
    mm
}

/// FNV-1a over whole numbers.
pub(in crate::coverage) fn hash_words(words: impl IntoIterator<Item = u64>) -> u64 {
    let mut hash = Fnv::new();
    for word in words {
        hash.write(&word.to_le_bytes());
    }
    hash.finish()
}

/// Identifies a loop; `patches` stands for what the cells look like.
pub(in crate::coverage) fn hash_of(patches: u64, cells: &[LoopCell]) -> u64 {
    let cell = |c: &LoopCell| {
        [
            u64::from(c.id.col.cast_unsigned()) << 16 | u64::from(c.id.row.cast_unsigned()),
            u64::from(c.service_mm) << 32 | u64::from(c.travel_mm),
            u64::from(c.excursion) << 1 | u64::from(c.needed),
        ]
    };
    hash_words(std::iter::once(patches).chain(cells.iter().flat_map(cell)))
}
