//! The turned frame in which an area is swept, and the borders in it (D2.7 §3.6.1).
//!
//! Lanes run along `y`, the sweep goes along `x`. Coordinates are rounded to a grid of
//! a power of two, so that "the same x" is a comparison of equal numbers and every
//! degenerate case (vertical edges, shared or aligned vertices, touching holes) is an
//! ordinary one. Leaves the sweep itself to [`super::cells`].

use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::sin_cos;

/// Steps of the grid in a metre: 2²⁰, a little less than a micrometre each. Coordinates
/// of a mission keep 12 bits beyond the grid, which the heights of edges are told with.
const GRID_PER_M: f64 = 1_048_576.0;

/// Heights nearer than this are the same, metres: a few steps of the grid.
pub(super) const SAME_M: f64 = 4.0e-6;

/// Axes that are turned so that lanes run along `y`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axes {
    along: Vector,
}

impl Axes {
    /// Axes for lanes of this heading, radians counter-clockwise from east.
    pub(super) fn new(heading_rad: f64) -> Self {
        let (s, c) = sin_cos(heading_rad);
        Self {
            along: Vector::new(c, s),
        }
    }

    /// The point in the turned frame.
    pub(super) fn into(self, p: Point) -> Point {
        let d = self.along;
        Point::new(p.x * d.y - p.y * d.x, p.x * d.x + p.y * d.y)
    }

    /// The point of the plane for one of the turned frame.
    pub(super) fn back(self, p: Point) -> Point {
        let d = self.along;
        Point::new(p.x * d.y + p.y * d.x, -p.x * d.x + p.y * d.y)
    }

    /// The point in the turned frame, on the grid.
    pub(super) fn snapped(self, p: Point) -> Point {
        let q = self.into(p);
        Point::new(snap(q.x), snap(q.y))
    }
}

/// The nearest number of the grid.
pub(super) fn snap(c: f64) -> f64 {
    // Adding zero turns −0 into 0: the two would be told apart.
    (c * GRID_PER_M).round() / GRID_PER_M + 0.0
}

/// What a border parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// What is to be seen from what is not: lanes may cross it.
    Area,
    /// A hole of the area: nothing to be seen inside, and lanes may cross it.
    Hole,
    /// Where nobody may fly.
    Zone,
}

/// An edge of a border, from left to right; never vertical.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Edge {
    pub(super) left: Point,
    pub(super) right: Point,
    pub(super) kind: Kind,
    /// What going up across it adds to the count of the rings of its kind around: 1 or −1.
    pub(super) step: i32,
}

impl Edge {
    /// Its height at `x`, exact at its ends.
    pub(super) fn y_at(&self, x: f64) -> f64 {
        if x <= self.left.x {
            return self.left.y;
        }
        if x >= self.right.x {
            return self.right.y;
        }
        let t = (x - self.left.x) / (self.right.x - self.left.x);
        self.left.y + (self.right.y - self.left.y) * t
    }
}

/// A ring of the plane with what it parts: counter-clockwise round what it encloses,
/// clockwise round holes in that.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ring<'a> {
    pub(super) points: &'a [Point],
    pub(super) kind: Kind,
}

/// The edges of rings in the turned frame, vertical ones left out: the sweep needs none
/// of them, as what they part begins or ends at their `x` anyway.
pub(super) fn edges(rings: &[Ring<'_>], axes: Axes) -> Vec<Edge> {
    let mut edges = Vec::new();
    for ring in rings {
        let n = ring.points.len();
        for i in 0..n {
            let a = axes.snapped(ring.points[i]);
            let b = axes.snapped(ring.points[(i + 1) % n]);
            // Rings run counter-clockwise: the inside is above an edge that runs right.
            let (left, right, step) = if a.x < b.x {
                (a, b, 1)
            } else if a.x > b.x {
                (b, a, -1)
            } else {
                continue;
            };
            edges.push(Edge {
                left,
                right,
                kind: ring.kind,
                step,
            });
        }
    }
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_turn_there_and_back() {
        for i in 0..40 {
            let axes = Axes::new(f64::from(i) * 0.17);
            let p = Point::new(123.4, -77.0 + f64::from(i));
            assert!((axes.back(axes.into(p)) - p).norm() < 1e-12);
            // A step along the lanes is a step along y.
            let (s, c) = sin_cos(f64::from(i) * 0.17);
            let q = axes.into(p + Vector::new(c, s)) - axes.into(p);
            assert!(q.x.abs() < 1e-12 && (q.y - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_axes_keep_the_sense_of_rotation() {
        let square =
            [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0)].map(|(x, y)| Point::new(x, y));
        let ring = Ring {
            points: &square,
            kind: Kind::Area,
        };
        let up = edges(&[ring], Axes::new(0.3));
        assert_eq!(up.len(), 4);
        assert_eq!(up.iter().map(|e| e.step).sum::<i32>(), 0);
        // The lowest edge in the middle of the frame has the inside above it.
        let x = 0.5 * (up[0].left.x + up[0].right.x);
        let lowest = up
            .iter()
            .filter(|e| e.left.x <= x && e.right.x >= x)
            .min_by(|a, b| a.y_at(x).total_cmp(&b.y_at(x)))
            .unwrap();
        assert_eq!(lowest.step, 1);
    }
}
