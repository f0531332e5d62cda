//! The lane grid: squares of one lane spacing, named by where they are.
//!
//! The grid is anchored at the mission's origin, so a cell keeps its name when
//! zones or the area change.

use serde::{Deserialize, Serialize};
use skein_geometry::frame::Point;

/// A lane cell: column east and row north of the origin, in lane spacings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct CellId {
    /// Columns east of the origin.
    pub col: i16,
    /// Rows north of the origin.
    pub row: i16,
}

/// Numbers in one row of names: a cell that no grid names is named by its number.
const NUMBERS_A_ROW: u16 = 256;

impl CellId {
    /// The name of the cell with this number, where cells are pieces of targets.
    #[must_use]
    pub fn numbered(n: u16) -> Self {
        Self {
            col: (n % NUMBERS_A_ROW).cast_signed(),
            row: (n / NUMBERS_A_ROW).cast_signed(),
        }
    }

    /// The number of such a cell; `None` for a name that no number has.
    #[must_use]
    pub fn number(self) -> Option<u16> {
        let (col, row) = (u16::try_from(self.col).ok()?, u16::try_from(self.row).ok()?);
        (col < NUMBERS_A_ROW && row < NUMBERS_A_ROW).then(|| row * NUMBERS_A_ROW + col)
    }
}

/// The grid of one lane spacing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Side of a cell, metres.
    pub lane_spacing_m: f64,
}

impl Grid {
    /// Centre of a cell.
    #[must_use]
    pub fn centre(&self, cell: CellId) -> Point {
        let d = self.lane_spacing_m;
        Point::new(
            (f64::from(cell.col) + 0.5) * d,
            (f64::from(cell.row) + 0.5) * d,
        )
    }

    /// The four corners of a cell, counter-clockwise from the south-west.
    #[must_use]
    pub fn corners(&self, cell: CellId) -> [Point; 4] {
        let d = self.lane_spacing_m;
        let (x, y) = (f64::from(cell.col) * d, f64::from(cell.row) * d);
        [
            Point::new(x, y),
            Point::new(x + d, y),
            Point::new(x + d, y + d),
            Point::new(x, y + d),
        ]
    }

    /// The cell a point lies in.
    #[must_use]
    pub fn cell_at(&self, p: Point) -> CellId {
        let d = self.lane_spacing_m;
        #[allow(
            clippy::cast_possible_truncation,
            reason = "missions end at 20 km from the origin"
        )]
        CellId {
            col: (p.x / d).floor() as i16,
            row: (p.y / d).floor() as i16,
        }
    }
}
