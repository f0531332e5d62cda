//! What a cell looks like from above: a patch of the ground that one frame has to hold
//! whole (D2.7 §3.3), and which patches lie near a camera.

use super::grid::{CellId, Grid};
use skein_geometry::frame::{Point, Pose};
use std::collections::BTreeMap;

/// The corners of a patch; one that has fewer repeats some. What a frame sees is its
/// convex hull.
pub type Corners = [Point; 4];

/// The patches of a loop.
#[derive(Clone, Debug)]
pub enum Patches {
    /// Squares of the lane grid.
    Grid(Grid),
    /// Pieces of targets, by number.
    Listed(Listed),
}

/// Patches in a list; patch `n` belongs to the cell [`CellId::numbered`] `n`.
#[derive(Clone, Debug)]
pub struct Listed {
    corners: Vec<Corners>,
    /// Squares in which the middles lie, for looking up.
    squares: Grid,
    within: BTreeMap<CellId, Vec<u16>>,
}

impl Listed {
    /// Patches, found again by squares of `reach_m`: as far as a camera sees.
    #[must_use]
    pub fn new(corners: Vec<Corners>, reach_m: f64) -> Self {
        let squares = Grid {
            lane_spacing_m: reach_m.max(1.0),
        };
        let mut within: BTreeMap<CellId, Vec<u16>> = BTreeMap::new();
        for (n, patch) in (0u16..).zip(&corners) {
            within
                .entry(squares.cell_at(middle(patch)))
                .or_default()
                .push(n);
        }
        Self {
            corners,
            squares,
            within,
        }
    }

    /// The patches by number.
    #[must_use]
    pub fn corners(&self) -> &[Corners] {
        &self.corners
    }
}

impl Patches {
    /// The corners of a cell; `None` where there is no such cell.
    #[must_use]
    pub fn corners(&self, id: CellId) -> Option<Corners> {
        match self {
            Self::Grid(grid) => Some(grid.corners(id)),
            Self::Listed(list) => list.corners.get(usize::from(id.number()?)).copied(),
        }
    }

    /// Calls `visit` with every patch that a frame at `at` reaching `across_m` and
    /// `along_m` to its sides may hold whole, whatever its heading.
    pub fn near(
        &self,
        at: Point,
        across_m: f64,
        along_m: f64,
        visit: &mut impl FnMut(CellId, &Corners),
    ) {
        match self {
            Self::Grid(grid) => near_on_grid(*grid, at, across_m, along_m, visit),
            Self::Listed(list) => {
                let reach_m = (across_m * across_m + along_m * along_m).sqrt();
                let low = list.squares.cell_at(at.map(|x| x - reach_m));
                let high = list.squares.cell_at(at.map(|x| x + reach_m));
                for row in low.row..=high.row {
                    for col in low.col..=high.col {
                        let here = list.within.get(&CellId { col, row });
                        for &n in here.into_iter().flatten() {
                            visit(CellId::numbered(n), &list.corners[usize::from(n)]);
                        }
                    }
                }
            }
        }
    }
}

fn near_on_grid(
    grid: Grid,
    at: Point,
    across_m: f64,
    along_m: f64,
    visit: &mut impl FnMut(CellId, &Corners),
) {
    let side_m = grid.lane_spacing_m;
    // Seen from its centre a cell reaches at least half a side in any direction.
    let (a, b) = (across_m - 0.5 * side_m, along_m - 0.5 * side_m);
    if a < 0.0 || b < 0.0 {
        return;
    }
    let reach_m = (a * a + b * b).sqrt();
    let low = grid.cell_at(at.map(|x| x - reach_m - 0.5 * side_m));
    let high = grid.cell_at(at.map(|x| x + reach_m - 0.5 * side_m));
    for row in low.row..=high.row {
        for col in low.col..=high.col {
            let id = CellId { col, row };
            if (grid.centre(id) - at).norm_squared() <= reach_m * reach_m {
                visit(id, &grid.corners(id));
            }
        }
    }
}

/// The mean of the corners.
#[must_use]
pub fn middle(patch: &Corners) -> Point {
    Point::from(
        patch
            .iter()
            .map(|c| c.coords)
            .sum::<skein_geometry::frame::Vector>()
            / 4.0,
    )
}

/// Whether the frame of a camera at `pose` holds the whole patch.
///
/// The frame is a rectangle along the heading, of half sizes `across_m` and `along_m`.
#[must_use]
pub fn frame_holds(patch: &Corners, pose: Pose, across_m: f64, along_m: f64) -> bool {
    let d = pose.direction();
    patch.iter().all(|c| {
        let v = c - pose.position();
        let along = v.x * d.x + v.y * d.y;
        let across = v.y * d.x - v.x * d.y;
        along.abs() <= along_m && across.abs() <= across_m
    })
}

/// Whether the footprint of a camera at `pose` contains the whole cell of a grid.
#[must_use]
pub fn footprint_contains(
    grid: &Grid,
    cell: CellId,
    pose: Pose,
    across_m: f64,
    along_m: f64,
) -> bool {
    frame_holds(&grid.corners(cell), pose, across_m, along_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn nothing_that_a_frame_holds_is_overlooked(
            patches in prop::collection::vec((-300.0f64..300.0, -300.0f64..300.0, 0.0f64..40.0, 0.0f64..40.0), 1..60),
            (x, y, heading_rad) in (-300.0f64..300.0, -300.0f64..300.0, -3.0f64..3.0),
            (across_m, along_m) in (20.0f64..90.0, 20.0f64..90.0),
        ) {
            let corners: Vec<Corners> = patches.iter().map(|&(x, y, w, h)| {
                [(x, y), (x + w, y), (x + w, y + h), (x, y + h)].map(|(x, y)| Point::new(x, y))
            }).collect();
            let pose = Pose::new(Point::new(x, y), heading_rad);
            let held = |c: &Corners| frame_holds(c, pose, across_m, along_m);
            let mut found = Vec::new();
            let list = Patches::Listed(Listed::new(corners.clone(), 50.0));
            list.near(pose.position(), across_m, along_m, &mut |id, c| {
                if held(c) {
                    found.push(id.number().unwrap());
                }
            });
            found.sort_unstable();
            let all: Vec<u16> = (0u16..).zip(&corners).filter(|(_, c)| held(c)).map(|(n, _)| n).collect();
            prop_assert_eq!(found, all);
        }
    }

    #[test]
    fn numbers_and_names_are_one_to_one() {
        for n in [0, 1, 255, 256, 40_000, u16::MAX] {
            assert_eq!(CellId::numbered(n).number(), Some(n));
        }
        assert_eq!(CellId { col: -1, row: 0 }.number(), None);
        assert_eq!(CellId { col: 256, row: 0 }.number(), None);
    }
}
