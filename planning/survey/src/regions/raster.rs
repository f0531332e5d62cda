//! Which lane cells an area becomes (D2.7 §3.6.2): a grid of squares one swath wide, with
//! the heading and the offset that need the fewest cells.
//!
//! Every cell that the area touches is to be covered, unless a forbidden region reaches
//! into the cross over which UAVs come and go. Left to others: regions that already
//! contain the clearance, curves, and the plan itself.

use super::map::{Cell, LaneMap, MapError};
use skein_flight::coverage::passes::sweep_directions;
use skein_geometry::Polygon;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::sin_cos;
use thiserror::Error;

/// Headings tried: of all edges of the area's hull the ones with the lowest areas, and
/// the first axis. More win less than a hundredth of the cells.
const HEADINGS: usize = 4;

/// Parts of a cell by which the grid is shifted along both axes.
const SHIFTS: u32 = 3;

/// A cell touched by less than this share of its side is not to be covered: rounding of
/// a common border.
const SLIVER: f64 = 1e-6;

/// Why an area has no grid.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum RasterError {
    /// The side of a cell is no length; nothing was built.
    #[error("a cell of {0} m has no meaning")]
    Side(f64),
    /// There is no area; nothing was built.
    #[error("there is no area to cover")]
    NoArea,
    /// The area is too large for cells of this size; nothing was built.
    #[error("the area is too large for cells of this size: {0}")]
    TooLarge(#[from] MapError),
}

/// A grid over an area.
#[derive(Clone, Debug)]
pub struct Raster {
    /// Free cells are those to be covered.
    pub map: LaneMap,
    /// Corner of row 0, column 0.
    corner: Point,
    /// Along the columns' numbers, length 1.
    along: Vector,
    /// Side of a cell, metres.
    side_m: f64,
    /// Cells that the area touches but nobody may fly.
    pub n_blocked: usize,
}

impl Raster {
    /// The grid with the fewest cells for `areas` without `holes`, which need not be seen;
    /// `forbidden` are rings of regions that do not overlap (outlines and holes alike).
    ///
    /// # Complexity
    /// For n cells and m vertices O(n + m · columns), for each heading and shift.
    ///
    /// # Errors
    /// [`RasterError`].
    pub fn fit(
        areas: &[Polygon],
        holes: &[Polygon],
        forbidden: &[&[Point]],
        side_m: f64,
    ) -> Result<Self, RasterError> {
        if !side_m.is_finite() || side_m <= 0.0 {
            return Err(RasterError::Side(side_m));
        }
        let rings: Vec<&[Point]> = areas.iter().map(Polygon::vertices).collect();
        let holes: Vec<&[Point]> = holes.iter().map(Polygon::vertices).collect();
        let shapes = Shapes {
            areas: &rings,
            holes: &holes,
            forbidden,
        };
        let mut headings: Vec<f64> = sweep_directions(&rings)
            .into_iter()
            .take(HEADINGS - 1)
            .map(|d| d.0)
            .collect();
        headings.push(0.0);
        let mut best: Option<Self> = None;
        for heading in headings {
            for shift in 0..SHIFTS * SHIFTS {
                let part = |n: u32| f64::from(n) / f64::from(SHIFTS);
                let shift = Vector::new(part(shift / SHIFTS), part(shift % SHIFTS));
                let next = Self::at(shapes, side_m, heading, shift)?;
                // Cells that nobody may fly count double: they are area lost.
                let cost = |r: &Self| r.map.n_free() + 2 * r.n_blocked;
                if best.as_ref().is_none_or(|b| cost(&next) < cost(b)) {
                    best = Some(next);
                }
            }
        }
        best.ok_or(RasterError::NoArea)
    }

    /// The grid of one heading, shifted by these parts of a cell.
    fn at(
        shapes: Shapes<'_>,
        side_m: f64,
        heading_rad: f64,
        shift: Vector,
    ) -> Result<Self, RasterError> {
        let (s, c) = sin_cos(heading_rad);
        let along = Vector::new(c, s);
        let turn = |ring: &[Point]| -> Vec<Point> {
            let turned = ring.iter().map(|p| {
                let v = p.coords;
                Point::new(v.dot(&along) / side_m, along.perp(&v) / side_m)
            });
            turned.collect()
        };
        let all =
            |rings: &[&[Point]]| -> Vec<Vec<Point>> { rings.iter().map(|r| turn(r)).collect() };
        let (areas, holes) = (all(shapes.areas), all(shapes.holes));
        let forbidden = all(shapes.forbidden);
        let mut all = areas.iter().flatten();
        let first = all.next().ok_or(RasterError::NoArea)?.coords;
        let (low, high) = all.fold((first, first), |(l, h), p| {
            (l.inf(&p.coords), h.sup(&p.coords))
        });
        let low = low - shift;
        let count = |from: f64, to: f64| -> u32 {
            let n = (to - from).ceil().max(1.0);
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a cast of a float saturates, and too many cells are refused"
            )]
            let n = n as u32;
            n
        };
        let (rows, cols) = (count(low.y, high.y), count(low.x, high.x));
        // Refused before anything of this size is made.
        LaneMap::check(rows, cols)?;
        let frame = Frame { low, rows, cols };
        let touched = frame.touched(&areas, &holes);
        let mut shut = vec![false; frame.len()];
        let rings: Vec<&Vec<Point>> = forbidden.iter().collect();
        frame.fill(&rings, &mut shut);
        for ring in &forbidden {
            frame.each_near(ring, |at, cell| shut[cell] |= meets_cross(at));
        }
        let number = |row: u32, col: u32| row as usize * cols as usize + col as usize;
        let map = LaneMap::new(rows, cols, |row, col| {
            touched[number(row, col)] && !shut[number(row, col)]
        })?;
        let n_blocked = touched
            .iter()
            .zip(&shut)
            .filter(|(t, s)| **t && **s)
            .count();
        let across = Vector::new(-along.y, along.x);
        Ok(Self {
            map,
            corner: Point::from((along * low.x + across * low.y) * side_m),
            along,
            side_m,
            n_blocked,
        })
    }

    /// Side of a cell, metres.
    #[must_use]
    pub fn side_m(&self) -> f64 {
        self.side_m
    }

    /// The middle of a cell.
    #[must_use]
    pub fn middle(&self, cell: Cell) -> Point {
        let (row, col) = self.map.place(cell);
        let across = Vector::new(-self.along.y, self.along.x);
        self.corner
            + (self.along * (f64::from(col) + 0.5) + across * (f64::from(row) + 0.5)) * self.side_m
    }

    /// The cell to be covered that holds a point.
    #[must_use]
    pub fn cell_at(&self, p: Point) -> Option<Cell> {
        let v = (p - self.corner) / self.side_m;
        let (x, y) = (v.dot(&self.along), self.along.perp(&v));
        if !(x >= 0.0 && y >= 0.0) {
            return None;
        }
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "not negative; a cast saturates beyond the grid"
        )]
        self.map.cell(y as u32, x as u32)
    }

    /// The cell to be covered whose middle is nearest to a point.
    #[must_use]
    pub fn nearest(&self, p: Point) -> Option<Cell> {
        self.map.cells().min_by(|a, b| {
            let far = |c: Cell| (self.middle(c) - p).norm_squared();
            far(*a).total_cmp(&far(*b)).then(a.cmp(b))
        })
    }
}

/// What makes a grid, as rings.
#[derive(Clone, Copy)]
struct Shapes<'a> {
    areas: &'a [&'a [Point]],
    holes: &'a [&'a [Point]],
    forbidden: &'a [&'a [Point]],
}

/// Rows and columns over the plane, in units of a cell.
struct Frame {
    low: Vector,
    rows: u32,
    cols: u32,
}

impl Frame {
    fn len(&self) -> usize {
        self.rows as usize * self.cols as usize
    }

    /// The cells that touch an area and are not wholly inside a hole.
    fn touched(&self, areas: &[Vec<Point>], holes: &[Vec<Point>]) -> Vec<bool> {
        let mut touched = vec![false; self.len()];
        for ring in areas {
            self.fill(&[ring], &mut touched);
            self.each_near(ring, |at, cell| {
                touched[cell] |= meets_box(at, SLIVER - 0.5)
            });
        }
        for ring in holes {
            let mut inside = vec![false; self.len()];
            self.fill(&[ring], &mut inside);
            self.each_near(ring, |at, cell| {
                inside[cell] &= !meets_box(at, SLIVER - 0.5);
            });
            for (cell, inside) in touched.iter_mut().zip(inside) {
                *cell &= !inside;
            }
        }
        touched
    }

    /// Marks the cells whose middle is inside rings by the count of crossings.
    fn fill(&self, rings: &[&Vec<Point>], marks: &mut [bool]) {
        let mut crossings = Vec::new();
        for (row, marks) in (0..self.rows).zip(marks.chunks_mut(self.cols.max(1) as usize)) {
            let y = self.low.y + f64::from(row) + 0.5;
            crossings.clear();
            for ring in rings {
                for (a, b) in edges(ring) {
                    if (a.y <= y) != (b.y <= y) {
                        crossings.push(a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x) - self.low.x);
                    }
                }
            }
            crossings.sort_by(f64::total_cmp);
            for pair in crossings.chunks_exact(2) {
                for (x, mark) in (0u32..).zip(&mut *marks) {
                    let middle = f64::from(x) + 0.5;
                    *mark |= middle > pair[0] && middle < pair[1];
                }
            }
        }
    }

    /// Calls with each edge of a ring, relative to the middle of each cell that its box
    /// touches, and the number of that cell.
    fn each_near(&self, ring: &[Point], mut call: impl FnMut([Vector; 2], usize)) {
        let clamp = |x: f64, n: u32| -> u32 {
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "clamped before"
            )]
            let x = x.clamp(0.0, f64::from(n.saturating_sub(1))) as u32;
            x
        };
        for (a, b) in edges(ring) {
            let (a, b) = (a.coords - self.low, b.coords - self.low);
            let (low, high) = (a.inf(&b), a.sup(&b));
            let outside = high.x < 0.0
                || high.y < 0.0
                || low.x > f64::from(self.cols)
                || low.y > f64::from(self.rows);
            if outside {
                continue;
            }
            for row in clamp(low.y, self.rows)..=clamp(high.y, self.rows) {
                for col in clamp(low.x, self.cols)..=clamp(high.x, self.cols) {
                    let middle = Vector::new(f64::from(col) + 0.5, f64::from(row) + 0.5);
                    let cell = row as usize * self.cols as usize + col as usize;
                    call([a - middle, b - middle], cell);
                }
            }
        }
    }
}

fn edges(ring: &[Point]) -> impl Iterator<Item = (Point, Point)> + '_ {
    (0..ring.len()).map(|i| (ring[i], ring[(i + 1) % ring.len()]))
}

/// Whether an edge meets the square from `low` to −`low` on both axes.
fn meets_box([a, b]: [Vector; 2], low: f64) -> bool {
    let d = b - a;
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for (start, step) in [(a.x, d.x), (a.y, d.y)] {
        if step.abs() < f64::EPSILON {
            if start < low || start > -low {
                return false;
            }
            continue;
        }
        let (s, t) = ((low - start) / step, (-low - start) / step);
        from = from.max(s.min(t));
        to = to.min(s.max(t));
    }
    from <= to
}

/// Whether an edge meets the cross from side to side through a cell's middle.
fn meets_cross([a, b]: [Vector; 2]) -> bool {
    let on_axis = |a: Vector, b: Vector| {
        if (a.y <= 0.0) == (b.y <= 0.0) {
            return false;
        }
        let x = a.x - a.y / (b.y - a.y) * (b.x - a.x);
        x.abs() <= 0.5
    };
    let turned = |v: Vector| Vector::new(v.y, v.x);
    on_axis(a, b) || on_axis(turned(a), turned(b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn ring(points: &[(f64, f64)]) -> Vec<Point> {
        points.iter().map(|&(x, y)| Point::new(x, y)).collect()
    }

    fn rectangle(x: f64, y: f64, w: f64, h: f64) -> Vec<Point> {
        ring(&[(x, y), (x + w, y), (x + w, y + h), (x, y + h)])
    }

    #[test]
    fn a_turned_rectangle_needs_no_more_cells_than_it_holds() {
        let (s, c) = sin_cos(0.4);
        let turned: Vec<Point> = rectangle(0.0, 0.0, 200.0, 100.0)
            .iter()
            .map(|p| Point::new(300.0 + c * p.x - s * p.y, 50.0 + s * p.x + c * p.y))
            .collect();
        let area = Polygon::new(turned).unwrap();
        let raster = Raster::fit(&[area], &[], &[], 20.0).unwrap();
        assert_eq!(raster.map.n_free(), 50);
        for cell in raster.map.cells() {
            assert_eq!(raster.cell_at(raster.middle(cell)), Some(cell));
        }
    }

    #[test]
    fn nobody_flies_into_a_forbidden_region_from_cell_to_cell() {
        let area = Polygon::new(rectangle(0.0, 0.0, 300.0, 300.0)).unwrap();
        let zone = ring(&[(103.0, 95.0), (191.0, 120.0), (170.0, 207.0), (96.0, 160.0)]);
        let raster = Raster::fit(&[area], &[], &[&zone], 20.0).unwrap();
        let shape = Polygon::new(zone).unwrap();
        assert!(raster.n_blocked > 4 && raster.map.n_free() > 170);
        for cell in raster.map.cells() {
            for near in raster.map.neighbours(cell) {
                let (a, b) = (raster.middle(cell), raster.middle(near));
                for i in 0..=20 {
                    let p = a + (b - a) * (f64::from(i) / 20.0);
                    assert!(!shape.contains(p), "{p}");
                }
            }
        }
    }

    #[test]
    fn cells_inside_a_hole_are_left_out() {
        let area = Polygon::new(rectangle(0.0, 0.0, 200.0, 200.0)).unwrap();
        let hole = Polygon::new(rectangle(55.0, 60.0, 70.0, 60.0)).unwrap();
        let raster = Raster::fit(&[area], std::slice::from_ref(&hole), &[], 20.0).unwrap();
        // Two whole columns and three whole rows of the hole at least.
        assert!(
            (88..=94).contains(&raster.map.n_free()),
            "{}",
            raster.map.n_free()
        );
        assert_eq!(raster.cell_at(Point::new(90.0, 90.0)), None);
    }

    #[test]
    fn senseless_sides_are_refused() {
        let area = [Polygon::new(rectangle(0.0, 0.0, 300.0, 300.0)).unwrap()];
        for side in [0.0, -1.0, f64::NAN] {
            assert!(Raster::fit(&area, &[], &[], side).is_err());
        }
        assert!(matches!(
            Raster::fit(&area, &[], &[], 1e-4),
            Err(RasterError::TooLarge(_))
        ));
        assert!(Raster::fit(&[], &[], &[], 10.0).is_err());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]

        #[test]
        fn every_point_of_the_area_lies_in_a_cell(
            corners in prop::collection::vec((0.0..6.2f64, 40.0..200.0f64), 3..9),
            samples in prop::collection::vec((-200.0..200.0f64, -200.0..200.0f64), 40),
        ) {
            let mut corners = corners;
            corners.sort_by(|a, b| a.0.total_cmp(&b.0));
            let points = corners.iter().map(|(t, r)| {
                let (s, c) = sin_cos(*t);
                Point::new(r * c, r * s)
            });
            let Ok(area) = Polygon::new(points.collect()) else { return Ok(()) };
            let raster = Raster::fit(std::slice::from_ref(&area), &[], &[], 15.0).unwrap();
            for (x, y) in samples {
                let p = Point::new(x, y);
                if area.contains(p) && area.distance_m(p) <= 0.0 {
                    prop_assert!(raster.cell_at(p).is_some(), "{p}");
                }
            }
        }
    }
}
