//! The closed coverage loop: spanning-tree coverage over 2×2 blocks, and single
//! excursions where blocks do not fit (D2.7 §3.6.2, algorithm 5).
//!
//! A block cell is crossed from the middle of one edge to the middle of another:
//! straight, or by a quarter arc of half a lane spacing. So the loop is one
//! tangential curve of lines and arcs, flyable whenever the turn radius is at
//! most half the lane spacing. A cell that no block holds is an *excursion*: a
//! closed curve that leaves the loop at a boundary, looks at the cell, and comes
//! back to the same boundary pose; skipping it costs nothing.

use super::grid::{CellId, Grid};
use crate::frame::{Point, Pose};
use crate::geometry::{NoFlyZones, Polygon};
use crate::trajectory::Curve;
use serde::{Deserialize, Serialize};
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
}

/// The loop on which all UAVs work. Cell `i` lies between boundary `i` and
/// boundary `i + 1`, cyclically.
#[derive(Clone, Debug)]
pub struct CoverageLoop {
    grid: Grid,
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
    #[error("a turn radius of {radius_m:.1} m does not fit lanes of {spacing_m:.1} m: the radius may be at most half the spacing")]
    TurnRadius {
        /// Turn radius, metres.
        radius_m: f64,
        /// Lane spacing, metres.
        spacing_m: f64,
    },
    /// The footprint is too small to see a cell from the loop.
    #[error("the camera footprint is too small: seeing a {spacing_m:.1} m cell from a turn needs half a footprint of at least {across_m:.1} m across and {along_m:.1} m along")]
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
        Builder::new(problem)?.build()
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

    /// The grid that names the cells.
    #[must_use]
    pub fn grid(&self) -> Grid {
        self.grid
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

    /// Identifies the loop: equal on all peers that derived it from the same mission.
    #[must_use]
    pub fn hash(&self) -> u64 {
        self.hash
    }
}

/// Half a footprint across must be this many lane spacings for one frame to hold a
/// cell from the middle of a quarter turn: √2 − ½.
const ACROSS_SPACINGS: f64 = core::f64::consts::SQRT_2 - 0.5;

/// The same along the track: √½.
const ALONG_SPACINGS: f64 = core::f64::consts::FRAC_1_SQRT_2;

type Block = (i16, i16);

struct Builder<'a> {
    problem: &'a AreaProblem,
    grid: Grid,
}

impl<'a> Builder<'a> {
    fn new(problem: &'a AreaProblem) -> Result<Self, LoopError> {
        let d = problem.lane_spacing_m;
        if !(problem.turn_radius_m <= d / 2.0) {
            return Err(LoopError::TurnRadius { radius_m: problem.turn_radius_m, spacing_m: d });
        }
        let across_m = ACROSS_SPACINGS * d + problem.tracking_error_m;
        let along_m = ALONG_SPACINGS * d + problem.tracking_error_m;
        if !(problem.footprint_across_m >= across_m && problem.footprint_along_m >= along_m) {
            return Err(LoopError::Footprint { spacing_m: d, across_m, along_m });
        }
        Ok(Self { problem, grid: Grid { lane_spacing_m: d } })
    }

    fn build(&self) -> Result<CoverageLoop, LoopError> {
        let needed = self.needed_cells()?;
        let blocks = self.component(&needed);
        if blocks.is_empty() {
            return Err(LoopError::Nothing);
        }
        let order = circumnavigate(&blocks);
        let n = order.len();
        let mut boundaries = Vec::with_capacity(n);
        for i in 0..n {
            boundaries.push(self.boundary(order[(i + n - 1) % n], order[i]));
        }
        let mut cells = Vec::with_capacity(n);
        for i in 0..n {
            let curve = self.through(boundaries[i], boundaries[(i + 1) % n]);
            let mm = mm(curve.length_m());
            cells.push(LoopCell {
                id: order[i],
                curve,
                excursion: false,
                service_mm: mm,
                needed: needed.contains(&order[i]),
                travel_mm: mm,
            });
        }
        let index: BTreeMap<CellId, u16> =
            order.iter().enumerate().map(|(i, c)| (*c, u16::try_from(i).unwrap_or(u16::MAX))).collect();
        let uncoverable = needed
            .iter()
            .filter(|c| !index.contains_key(c))
            .map(|c| (*c, "no straight pass that sees all of it keeps clear of the zones".to_owned()))
            .collect();
        let mut hash = 0xcbf2_9ce4_8422_2325u64;
        for c in &cells {
            for v in [i64::from(c.id.col), i64::from(c.id.row), i64::from(c.service_mm), i64::from(c.needed)] {
                for b in v.to_le_bytes() {
                    hash = (hash ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3);
                }
            }
        }
        Ok(CoverageLoop { grid: self.grid, cells, boundaries, index, uncoverable, hash })
    }

    /// Cells that have a point in common with the area (its corners, its border or a
    /// vertex of it).
    fn needed_cells(&self) -> Result<std::collections::BTreeSet<CellId>, LoopError> {
        let v = self.problem.area.vertices();
        let (mut lo, mut hi) = (v[0], v[0]);
        for p in v {
            lo = Point::new(lo.x.min(p.x), lo.y.min(p.y));
            hi = Point::new(hi.x.max(p.x), hi.y.max(p.y));
        }
        let (a, b) = (self.grid.cell_at(lo), self.grid.cell_at(hi));
        let count = (i64::from(b.col) - i64::from(a.col) + 1) * (i64::from(b.row) - i64::from(a.row) + 1);
        if count > 65_535 {
            return Err(LoopError::TooManyCells(usize::try_from(count).unwrap_or(usize::MAX)));
        }
        let mut out = std::collections::BTreeSet::new();
        for row in a.row..=b.row {
            for col in a.col..=b.col {
                let id = CellId { col, row };
                if self.touches_area(id) {
                    out.insert(id);
                }
            }
        }
        Ok(out)
    }

    fn touches_area(&self, id: CellId) -> bool {
        let c = self.grid.centre(id);
        let h = self.grid.lane_spacing_m / 2.0 - 1e-6;
        let inner = [(-h, -h), (h, -h), (h, h), (-h, h)].map(|(x, y)| Point::new(c.x + x, c.y + y));
        let inside = |p: &Point| (p.x - c.x).abs() <= h && (p.y - c.y).abs() <= h;
        inner.iter().any(|p| self.problem.area.contains(*p))
            || self.problem.area.vertices().iter().any(inside)
            || self.problem.area.edges().any(|(a, b)| {
                (0..4).any(|i| crate::geometry::polygon::segments_meet(a, b, inner[i], inner[(i + 1) % 4]))
            })
    }

    /// The connected blocks with the most needed cells.
    fn component(&self, needed: &std::collections::BTreeSet<CellId>) -> std::collections::BTreeSet<Block> {
        let mut free: std::collections::BTreeSet<Block> =
            needed.iter().map(|c| (c.col.div_euclid(2), c.row.div_euclid(2))).collect();
        free.retain(|b| self.block_clear(*b));
        let mut best = (0, std::collections::BTreeSet::new());
        while let Some(first) = free.pop_first() {
            let mut open = vec![first];
            let mut part = std::collections::BTreeSet::from([first]);
            while let Some(b) = open.pop() {
                for n in neighbours(b) {
                    if free.remove(&n) {
                        part.insert(n);
                        open.push(n);
                    }
                }
            }
            let size = part.iter().flat_map(|b| cells_of(*b)).filter(|c| needed.contains(c)).count();
            if size > best.0 {
                best = (size, part);
            }
        }
        best.1
    }

    fn block_clear(&self, block: Block) -> bool {
        let d = self.grid.lane_spacing_m;
        let centre = Point::new((f64::from(block.0) * 2.0 + 1.0) * d, (f64::from(block.1) * 2.0 + 1.0) * d);
        let reach = d * core::f64::consts::SQRT_2 * 0.75 + self.problem.clearance_m;
        self.problem.zones.distance_m(centre) >= reach
    }

    /// The pose in the middle of the edge between two neighbouring cells.
    fn boundary(&self, from: CellId, to: CellId) -> Pose {
        let (a, b) = (self.grid.centre(from), self.grid.centre(to));
        let v = b - a;
        Pose::new(a + v * 0.5, crate::math::atan2(v.y, v.x))
    }

    /// From the middle of one edge to the middle of another.
    fn through(&self, from: Pose, to: Pose) -> Curve {
        let d = self.grid.lane_spacing_m;
        let turn = crate::math::wrap_pi(to.heading_rad - from.heading_rad);
        if turn.abs() < 0.1 {
            Curve::from_pieces(from, &[(0.0, d)])
        } else {
            let r = d / 2.0;
            Curve::from_pieces(from, &[(turn.signum() / r, r * crate::math::FRAC_PI_2)])
        }
    }
}

fn mm(m: f64) -> u32 {
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "curves are shorter than 4,000 km")]
    let mm = (m * 1000.0).round() as u32;
    mm
}

fn neighbours((x, y): Block) -> [Block; 4] {
    [(x, y + 1), (x, y - 1), (x - 1, y), (x + 1, y)]
}

fn cells_of((x, y): Block) -> [CellId; 4] {
    let c = |col, row| CellId { col, row };
    [c(2 * x, 2 * y), c(2 * x + 1, 2 * y), c(2 * x + 1, 2 * y + 1), c(2 * x, 2 * y + 1)]
}

/// The cells round a spanning tree of the blocks, counter-clockwise.
fn circumnavigate(blocks: &std::collections::BTreeSet<Block>) -> Vec<CellId> {
    let mut tree = std::collections::BTreeSet::new();
    let mut seen = std::collections::BTreeSet::new();
    let Some(root) = blocks.first().copied() else {
        return Vec::new();
    };
    let mut stack = vec![(root, root)];
    while let Some((from, b)) = stack.pop() {
        if !seen.insert(b) {
            continue;
        }
        tree.insert((from, b));
        tree.insert((b, from));
        for n in neighbours(b).into_iter().rev() {
            if blocks.contains(&n) && !seen.contains(&n) {
                stack.push((b, n));
            }
        }
    }
    let next = |c: CellId| -> CellId {
        let b = (c.col.div_euclid(2), c.row.div_euclid(2));
        let linked = |n: Block| n != b && tree.contains(&(b, n));
        let (right, top) = (c.col.rem_euclid(2) == 1, c.row.rem_euclid(2) == 1);
        let step = |dc: i16, dr: i16| CellId { col: c.col + dc, row: c.row + dr };
        match (right, top) {
            (false, false) if linked((b.0, b.1 - 1)) => step(0, -1),
            (false, false) => step(1, 0),
            (true, false) if linked((b.0 + 1, b.1)) => step(1, 0),
            (true, false) => step(0, 1),
            (true, true) if linked((b.0, b.1 + 1)) => step(0, 1),
            (true, true) => step(-1, 0),
            (false, true) if linked((b.0 - 1, b.1)) => step(-1, 0),
            (false, true) => step(0, -1),
        }
    };
    let start = CellId { col: root.0 * 2, row: root.1 * 2 };
    let mut order = vec![start];
    let mut at = next(start);
    while at != start && order.len() < blocks.len() * 4 {
        order.push(at);
        at = next(at);
    }
    order
}

/// Whether the footprint of a camera at `pose` contains the whole cell.
///
/// The footprint is a rectangle aligned with the heading, of half sizes
/// `across_m` and `along_m`.
#[must_use]
pub fn footprint_contains(grid: &Grid, cell: CellId, pose: Pose, across_m: f64, along_m: f64) -> bool {
    let d = pose.direction();
    grid.corners(cell).iter().all(|c| {
        let v = c - pose.position();
        let along = v.x * d.x + v.y * d.y;
        let across = v.y * d.x - v.x * d.y;
        along.abs() <= along_m && across.abs() <= across_m
    })
}
