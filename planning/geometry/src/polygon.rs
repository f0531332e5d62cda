//! A simple polygon, checked when it is made (D2.7 §2.3.1).
//!
//! Orientation tests are exact (adaptive predicates), so "simple" and "contains"
//! mean the same on every machine and for every near-degenerate ring. Offsets
//! and distances to curves are in [`super::clearance`].

use crate::frame::{Point, Vector};
use robust::{Coord, orient2d};
use thiserror::Error;

/// The largest coordinate a polygon may have, metres.
///
/// Missions end at 20 km from their origin; the rest is room for zones that
/// reach in from outside. Products of such numbers are far from overflow.
pub const MAX_COORDINATE_M: f64 = 1.0e6;

/// A simple polygon without holes: at least three vertices, no repeated vertex,
/// no crossing or touching edges, counter-clockwise, area above zero.
#[derive(Clone, Debug, PartialEq)]
pub struct Polygon {
    vertices: Vec<Point>,
}

/// Every way in which a ring of points can fail to be a [`Polygon`].
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PolygonError {
    /// Fewer than three distinct vertices.
    #[error("a polygon needs at least 3 distinct vertices, this one has {0}")]
    TooFewVertices(usize),
    /// A coordinate is NaN or infinite.
    #[error("vertex {0} is not a finite number")]
    NotFinite(usize),
    /// A coordinate is larger than any mission.
    #[error("vertex {0} lies more than {MAX_COORDINATE_M} m from the origin")]
    TooFar(usize),
    /// Two edges cross or touch.
    #[error("edge {0} crosses or touches edge {1}")]
    SelfCrossing(usize, usize),
    /// All vertices lie on one line.
    #[error("the polygon has no area")]
    NoArea,
}

impl Polygon {
    /// Checks a ring (closed or not, any winding; repeated consecutive vertices
    /// are dropped) and makes it counter-clockwise.
    ///
    /// # Complexity
    /// O(n²) in the number of vertices, with a bounding-box test a pair.
    ///
    /// # Errors
    /// [`PolygonError`] names the vertex or the edges, by index into `ring`.
    pub fn new(ring: Vec<Point>) -> Result<Self, PolygonError> {
        for (i, p) in ring.iter().enumerate() {
            if !(p.x.is_finite() && p.y.is_finite()) {
                return Err(PolygonError::NotFinite(i));
            }
            if p.x.abs() > MAX_COORDINATE_M || p.y.abs() > MAX_COORDINATE_M {
                return Err(PolygonError::TooFar(i));
            }
        }
        let (mut vertices, indices) = without_repeats(&ring);
        if vertices.len() < 3 {
            return Err(PolygonError::TooFewVertices(vertices.len()));
        }
        let (a, b) = (vertices[0], vertices[1]);
        if vertices.iter().all(|&c| side(a, b, c) == 0) {
            return Err(PolygonError::NoArea);
        }
        if let Some((i, j)) = first_contact(&vertices) {
            return Err(PolygonError::SelfCrossing(indices[i], indices[j]));
        }
        if winding(&vertices) < 0 {
            vertices.reverse();
        }
        Ok(Self { vertices })
    }

    /// The vertices, counter-clockwise, the first not repeated.
    #[must_use]
    pub fn vertices(&self) -> &[Point] {
        &self.vertices
    }

    /// The edges, each from a vertex to the next, the last back to the first.
    pub fn edges(&self) -> impl Iterator<Item = (Point, Point)> + '_ {
        let n = self.vertices.len();
        (0..n).map(move |i| (self.vertices[i], self.vertices[(i + 1) % n]))
    }

    /// Area in square metres.
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        // Relative to the first vertex, so that far polygons lose no digits.
        let o = self.vertices[0];
        self.edges()
            .map(|(a, b)| (a - o).perp(&(b - o)))
            .sum::<f64>()
            / 2.0
    }

    /// The smallest axis-parallel box: its south-west and north-east corners.
    #[must_use]
    pub fn bounds(&self) -> (Point, Point) {
        let mut low = self.vertices[0];
        let mut high = low;
        for v in &self.vertices {
            low = Point::new(low.x.min(v.x), low.y.min(v.y));
            high = Point::new(high.x.max(v.x), high.y.max(v.y));
        }
        (low, high)
    }

    /// Whether `p` is inside or on the border.
    #[must_use]
    pub fn contains(&self, p: Point) -> bool {
        let mut inside = false;
        for (a, b) in self.edges() {
            // Of the others none is met by a ray to the east.
            if p.y < a.y.min(b.y) || p.y > a.y.max(b.y) || p.x > a.x.max(b.x) {
                continue;
            }
            // Half-open in y, so that a ray through a vertex counts it once.
            let (upward, downward) = (a.y <= p.y && p.y < b.y, b.y <= p.y && p.y < a.y);
            if p.x < a.x.min(b.x) {
                inside ^= upward || downward;
                continue;
            }
            let s = side(a, b, p);
            if s == 0 && in_box(a, b, p) {
                return true;
            }
            inside ^= (upward && s > 0) || (downward && s < 0);
        }
        inside
    }

    /// Distance from `p` to the polygon, zero inside, metres.
    #[must_use]
    pub fn distance_m(&self, p: Point) -> f64 {
        if self.contains(p) {
            return 0.0;
        }
        self.outline_distance_m(p)
    }

    /// Distance from `p` to the nearest edge, metres.
    #[must_use]
    pub fn outline_distance_m(&self, p: Point) -> f64 {
        let squares = self.edges().map(|(a, b)| to_line(p, a, b).norm_squared());
        squares.fold(f64::INFINITY, f64::min).sqrt()
    }
}

/// Sign of the turn a → b → c, exact: 1 left, −1 right, 0 straight.
pub fn side(a: Point, b: Point, c: Point) -> i8 {
    let coord = |p: Point| Coord { x: p.x, y: p.y };
    let d = orient2d(coord(a), coord(b), coord(c));
    if d > 0.0 {
        1
    } else if d < 0.0 {
        -1
    } else {
        0
    }
}

/// Whether the closed pieces `a b` and `c d` have a point in common, exact.
pub fn segments_meet(a: Point, b: Point, c: Point, d: Point) -> bool {
    let (s1, s2) = (side(a, b, c), side(a, b, d));
    let (s3, s4) = (side(c, d, a), side(c, d, b));
    if s1 * s2 < 0 && s3 * s4 < 0 {
        return true;
    }
    (s1 == 0 && in_box(a, b, c))
        || (s2 == 0 && in_box(a, b, d))
        || (s3 == 0 && in_box(c, d, a))
        || (s4 == 0 && in_box(c, d, b))
}

/// Distance from `p` to the piece `a b`, metres.
pub fn point_to_line_m(p: Point, a: Point, b: Point) -> f64 {
    to_line(p, a, b).norm()
}

/// The way from the piece `a b` to `p`.
fn to_line(p: Point, a: Point, b: Point) -> Vector {
    let along = b - a;
    let square = along.norm_squared();
    let t = if square > 0.0 {
        ((p - a).dot(&along) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    p - (a + along * t)
}

/// Distance between the pieces `a b` and `c d`, metres.
pub fn line_to_line_m(a: Point, b: Point, c: Point, d: Point) -> f64 {
    if segments_meet(a, b, c, d) {
        return 0.0;
    }
    point_to_line_m(a, c, d)
        .min(point_to_line_m(b, c, d))
        .min(point_to_line_m(c, a, b))
        .min(point_to_line_m(d, a, b))
}

fn in_box(a: Point, b: Point, p: Point) -> bool {
    p.x >= a.x.min(b.x) && p.x <= a.x.max(b.x) && p.y >= a.y.min(b.y) && p.y <= a.y.max(b.y)
}

fn same(a: Point, b: Point) -> bool {
    a.x.total_cmp(&b.x).is_eq() && a.y.total_cmp(&b.y).is_eq()
}

/// Drops repeated consecutive vertices; also returns where each one came from.
fn without_repeats(ring: &[Point]) -> (Vec<Point>, Vec<usize>) {
    let mut vertices: Vec<Point> = Vec::with_capacity(ring.len());
    let mut indices = Vec::with_capacity(ring.len());
    for (i, p) in ring.iter().enumerate() {
        // Adding zero turns −0 into 0, so that equal points compare equal.
        let p = Point::new(p.x + 0.0, p.y + 0.0);
        if vertices.last().is_none_or(|&q| !same(p, q)) {
            vertices.push(p);
            indices.push(i);
        }
    }
    while vertices.len() > 1 && same(vertices[0], vertices[vertices.len() - 1]) {
        vertices.pop();
        indices.pop();
    }
    (vertices, indices)
}

/// The first pair of edges that share more than the vertex between them.
fn first_contact(v: &[Point]) -> Option<(usize, usize)> {
    let n = v.len();
    for i in 0..n {
        let (a, b) = (v[i], v[(i + 1) % n]);
        for j in i + 1..n {
            let (c, d) = (v[j], v[(j + 1) % n]);
            let contact = if j == i + 1 {
                folds_back(a, b, d)
            } else if (j + 1) % n == i {
                folds_back(c, d, b)
            } else {
                boxes_meet(a, b, c, d) && segments_meet(a, b, c, d)
            };
            if contact {
                return Some((i, j));
            }
        }
    }
    None
}

/// Whether the edge `middle to` runs back over the edge `from middle`.
fn folds_back(from: Point, middle: Point, to: Point) -> bool {
    side(from, middle, to) == 0 && (from - middle).dot(&(to - middle)) > 0.0
}

fn boxes_meet(a: Point, b: Point, c: Point, d: Point) -> bool {
    a.x.min(b.x) <= c.x.max(d.x)
        && c.x.min(d.x) <= a.x.max(b.x)
        && a.y.min(b.y) <= c.y.max(d.y)
        && c.y.min(d.y) <= a.y.max(b.y)
}

/// Winding of a simple ring, exact: the turn at its south-west extreme vertex,
/// which no simple ring passes straight.
fn winding(v: &[Point]) -> i8 {
    let n = v.len();
    let mut low = 0;
    for i in 1..n {
        if v[i]
            .x
            .total_cmp(&v[low].x)
            .then(v[i].y.total_cmp(&v[low].y))
            .is_lt()
        {
            low = i;
        }
    }
    side(v[(low + n - 1) % n], v[low], v[(low + 1) % n])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn ring(points: &[(f64, f64)]) -> Vec<Point> {
        points.iter().map(|&(x, y)| Point::new(x, y)).collect()
    }

    #[test]
    fn every_bad_ring_has_its_own_error() {
        let check = |points: &[(f64, f64)], want: PolygonError| {
            assert_eq!(Polygon::new(ring(points)), Err(want), "{points:?}");
        };
        check(&[], PolygonError::TooFewVertices(0));
        check(
            &[(0.0, 0.0), (1.0, 0.0), (1.0, 0.0), (0.0, 0.0)],
            PolygonError::TooFewVertices(2),
        );
        check(
            &[(0.0, 0.0), (f64::NAN, 0.0), (1.0, 1.0)],
            PolygonError::NotFinite(1),
        );
        check(
            &[(0.0, 0.0), (1.0, f64::INFINITY), (1.0, 1.0)],
            PolygonError::NotFinite(1),
        );
        check(
            &[(0.0, 0.0), (1e300, 0.0), (1.0, 1.0)],
            PolygonError::TooFar(1),
        );
        check(&[(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)], PolygonError::NoArea);
        check(
            &[(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)],
            PolygonError::SelfCrossing(0, 2),
        );
        // A spike, and a vertex that touches another edge.
        check(
            &[(0.0, 0.0), (4.0, 0.0), (2.0, 0.0), (2.0, 2.0)],
            PolygonError::SelfCrossing(0, 1),
        );
        check(
            &[(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, 0.0), (0.0, 4.0)],
            PolygonError::SelfCrossing(0, 2),
        );
    }

    #[test]
    fn a_clockwise_closed_ring_becomes_counter_clockwise() {
        let p = Polygon::new(ring(&[
            (0.0, 0.0),
            (0.0, 2.0),
            (3.0, 2.0),
            (3.0, 0.0),
            (0.0, 0.0),
        ]))
        .unwrap();
        assert_eq!(p.vertices().len(), 4);
        assert!((p.area_m2() - 6.0).abs() < 1e-12);
        assert!(p.contains(Point::new(3.0, 1.0)) && p.contains(Point::new(0.0, 0.0)));
        assert!(!p.contains(Point::new(3.0 + 1e-12, 1.0)));
        assert!((p.distance_m(Point::new(6.0, 6.0)) - 5.0).abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn star_rings_are_accepted_and_know_their_inside(
            radii in prop::collection::vec(1.0f64..100.0, 3..24),
            x in -120.0f64..120.0, y in -120.0f64..120.0,
        ) {
            let n = radii.len();
            let at = |i: usize| {
                let a = crate::math::TAU * i as f64 / n as f64;
                Point::new(radii[i % n] * crate::math::cos(a), radii[i % n] * crate::math::sin(a))
            };
            // Three spokes may leave the centre outside, which makes no star.
            prop_assume!(n > 4);
            let p = Polygon::new((0..n).map(at).collect()).unwrap();
            let q = Point::new(x, y);
            let in_a_slice = (0..n).any(|i| {
                let (o, a, b) = (Point::origin(), at(i), at(i + 1));
                side(o, a, q) >= 0 && side(a, b, q) >= 0 && side(b, o, q) >= 0
            });
            // Points on a spoke may round to either side of it.
            let near_border = p.edges().any(|(a, b)| point_to_line_m(q, a, b) < 1e-9);
            prop_assert!(near_border || p.contains(q) == in_a_slice);
            prop_assert_eq!(p.distance_m(q) == 0.0, p.contains(q));
        }
    }
}
