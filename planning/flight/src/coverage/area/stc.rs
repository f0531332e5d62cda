//! The closed coverage loop: spanning-tree coverage over 2×2 blocks, and single
//! excursions where blocks do not fit (D2.7 §3.6.2, algorithm 5).
//!
//! A block cell is crossed from the middle of one edge to the middle of another:
//! straight, or by a quarter arc of half a lane spacing. So the loop is one
//! tangential curve of lines and arcs, flyable whenever the turn radius is at
//! most half the lane spacing. A cell that no block holds is an *excursion*: a
//! closed curve that leaves the loop at a boundary, looks at the cell, and comes
//! back to the same boundary pose; skipping it costs nothing.

use super::assembly::{Assembly, cells_of, check, hash_of};
use super::blocks::closed_loop;
use super::grid::{CellId, Grid};
use super::patch::Patches;
use super::tree::Tree;
use crate::coverage::exact::ExactError;
use serde::{Deserialize, Serialize};
use skein_geometry::Curve;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::{NoFlyZones, Polygon};
use std::collections::BTreeMap;
use std::sync::Arc;
use thiserror::Error;

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

/// What is to be covered, and with what.
#[derive(Clone, Debug)]
pub struct AreaProblem {
    /// The area to see.
    pub area: Polygon,
    /// Where nobody may fly.
    pub zones: Arc<NoFlyZones>,
    /// Side of a cell, metres.
    pub lane_spacing_m: f64,
    /// Smallest turn radius of all UAVs of the mission, metres.
    pub turn_radius_m: f64,
    /// Distance that every curve keeps from the zones, metres.
    pub clearance_m: f64,
    /// Half the camera footprint across the track, metres.
    pub footprint_across_m: f64,
    /// Half the camera footprint along the track, metres.
    pub footprint_along_m: f64,
    /// How far a UAV may stray from its curve, metres; taken off the footprint.
    pub tracking_error_m: f64,
    /// A point from which the loop must be reachable (a launch point).
    pub launch: Point,
    /// Which spanning tree the loop goes round.
    pub tree: Tree,
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

/// Why there is no loop.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LoopError {
    /// The turn radius does not fit into the lane spacing.
    #[error(
        "a turn radius of {radius_m:.1} m does not fit lanes of {spacing_m:.1} m: the radius may be at most half the spacing"
    )]
    TurnRadius {
        /// Turn radius, metres.
        radius_m: f64,
        /// Lane spacing, metres.
        spacing_m: f64,
    },
    /// The footprint is too small to see a cell from the loop.
    #[error(
        "the camera footprint is too small: seeing a {spacing_m:.1} m cell from a turn needs half a footprint of at least {across_m:.1} m across and {along_m:.1} m along"
    )]
    Footprint {
        /// Lane spacing, metres.
        spacing_m: f64,
        /// Needed half width, metres.
        across_m: f64,
        /// Needed half length, metres.
        along_m: f64,
    },
    /// No cell of the area can be flown.
    #[error("no cell of the area can be flown: the no-fly zones leave no room")]
    Nothing,
    /// More cells than a mission may have.
    #[error("the area has {0} cells, a mission may have at most 65,535")]
    TooManyCells(usize),
    /// The area or the launch point lies too far from the origin.
    #[error("the area or the launch point lies more than 20 km from the mission's origin")]
    Extent,
    /// A length is no number, negative or too small.
    #[error("the {0} is not a usable length")]
    Number(&'static str),
    /// The zones could not be grown by the clearance.
    #[error("the no-fly zones could not be grown safely")]
    Zones,
    /// No route leads from the launch point to the loop.
    #[error("no flyable route leads from the launch point to the area: no-fly zones part them")]
    CutOff,
    /// No exact passes over the area.
    #[error(transparent)]
    Exact(#[from] ExactError),
    /// The launch point cannot reach the loop.
    #[error("the launch point lies inside a no-fly zone or its clearance")]
    Launch,
}

impl CoverageLoop {
    /// Builds the loop.
    ///
    /// # Guarantees
    /// Every cell that touches the area is on the loop exactly once or listed as
    /// uncoverable with a reason. Every curve keeps the clearance.
    ///
    /// # Complexity
    /// O(n log n) in the number of cells, plus the excursions.
    ///
    /// # Errors
    /// [`LoopError`].
    pub fn build(problem: &AreaProblem) -> Result<Self, LoopError> {
        check(problem)?;
        let grid = Grid {
            lane_spacing_m: problem.lane_spacing_m,
        };
        let needed = cells_of(&problem.area, grid)?;
        let ring = closed_loop(problem, grid, &needed);
        if ring.is_empty() {
            return Err(LoopError::Nothing);
        }
        let Assembly { cells, uncoverable } = Assembly::new(problem, grid, &needed, ring)?;
        let hash = hash_of(grid.lane_spacing_m.to_bits(), &cells);
        Ok(Self::assembled(
            Patches::Grid(grid),
            cells,
            uncoverable,
            hash,
        ))
    }

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

    /// The same loop another time round: what was covered before does not count on it.
    #[must_use]
    pub fn of_lap(mut self, lap: u16) -> Self {
        // The golden ratio's odd multiple spreads small numbers over all bits.
        self.hash ^= u64::from(lap).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        self
    }

    /// Identifies the loop: equal on all peers that derived it from the same mission.
    #[must_use]
    pub fn hash(&self) -> u64 {
        self.hash
    }
}
