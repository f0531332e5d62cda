//! A simple polygon, checked when it is made.

use crate::frame::{Point, Vector};
use robust::{Coord, orient2d};
use thiserror::Error;

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
    /// Two edges cross or touch.
    #[error("edge {0} crosses or touches edge {1}")]
    SelfCrossing(usize, usize),
    /// All vertices lie on one line.
    #[error("the polygon has no area")]
    NoArea,
}

/// The sign of the turn a → b → c: positive to the left, zero only when exactly straight.
#[must_use]
pub fn orientation(a: Point, b: Point, c: Point) -> f64 {
    let coord = |p: Point| Coord { x: p.x, y: p.y };
    orient2d(coord(a), coord(b), coord(c))
}

/// Whether two closed segments have a point in common, decided exactly.
#[must_use]
pub fn segments_meet(a: Point, b: Point, c: Point, d: Point) -> bool {
    let (o1, o2) = (orientation(a, b, c), orientation(a, b, d));
    let (o3, o4) = (orientation(c, d, a), orientation(c, d, b));
    if o1 * o2 < 0.0 && o3 * o4 < 0.0 {
        return true;
    }
    let within = |p: Point, q: Point, r: Point, o: f64| {
        o.abs() <= 0.0
            && r.x >= p.x.min(q.x)
            && r.x <= p.x.max(q.x)
            && r.y >= p.y.min(q.y)
            && r.y <= p.y.max(q.y)
    };
    within(a, b, c, o1) || within(a, b, d, o2) || within(c, d, a, o3) || within(c, d, b, o4)
}

/// Distance from `p` to the segment `a`–`b`, metres.
#[must_use]
pub fn point_segment_m(p: Point, a: Point, b: Point) -> f64 {
    let ab: Vector = b - a;
    let t = ((p - a).dot(&ab) / ab.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (p - (a + ab * t)).norm()
}

impl Polygon {
    /// Checks a ring (closed or not, any winding; repeated consecutive vertices
    /// are dropped) and makes it counter-clockwise.
    ///
    /// # Errors
    /// [`PolygonError`] names the vertex or the edges, by index into `ring`.
    pub fn new(ring: Vec<Point>) -> Result<Self, PolygonError> {
        if let Some(i) = ring.iter().position(|p| !p.x.is_finite() || !p.y.is_finite()) {
            return Err(PolygonError::NotFinite(i));
        }
        let mut kept: Vec<(usize, Point)> = Vec::with_capacity(ring.len());
        for (i, p) in ring.iter().enumerate() {
            if kept.last().is_none_or(|(_, q)| q != p) {
                kept.push((i, *p));
            }
        }
        while kept.len() > 1 && kept.first().map(|k| k.1) == kept.last().map(|k| k.1) {
            kept.pop();
        }
        if kept.len() < 3 {
            return Err(PolygonError::TooFewVertices(kept.len()));
        }
        let n = kept.len();
        let area2: f64 = (0..n)
            .map(|i| {
                let (a, b) = (kept[i].1, kept[(i + 1) % n].1);
                (a.x - kept[0].1.x) * (b.y - kept[0].1.y) - (b.x - kept[0].1.x) * (a.y - kept[0].1.y)
            })
            .sum();
        if area2.abs() < 1e-6 {
            return Err(PolygonError::NoArea);
        }
        for i in 0..n {
            for j in i + 1..n {
                let neighbours = j == i + 1 || (i == 0 && j == n - 1);
                let (a, b) = (kept[i].1, kept[(i + 1) % n].1);
                let (c, d) = (kept[j].1, kept[(j + 1) % n].1);
                let bad = if neighbours {
                    let (tip, other, far) = if j == i + 1 { (b, a, d) } else { (a, b, c) };
                    orientation(other, tip, far).abs() <= 0.0 && (other - tip).dot(&(far - tip)) > 0.0
                } else {
                    segments_meet(a, b, c, d)
                };
                if bad {
                    return Err(PolygonError::SelfCrossing(kept[i].0, kept[j].0));
                }
            }
        }
        let mut vertices: Vec<Point> = kept.into_iter().map(|k| k.1).collect();
        if area2 < 0.0 {
            vertices.reverse();
        }
        Ok(Self { vertices })
    }

    /// The vertices, counter-clockwise, the first not repeated.
    #[must_use]
    pub fn vertices(&self) -> &[Point] {
        &self.vertices
    }

    /// The edges, counter-clockwise.
    pub fn edges(&self) -> impl Iterator<Item = (Point, Point)> + '_ {
        let n = self.vertices.len();
        (0..n).map(move |i| (self.vertices[i], self.vertices[(i + 1) % n]))
    }

    /// Area in square metres.
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        let o = self.vertices[0];
        self.edges().map(|(a, b)| (a - o).perp(&(b - o))).sum::<f64>() / 2.0
    }

    /// Whether `p` is inside or on the border.
    #[must_use]
    pub fn contains(&self, p: Point) -> bool {
        let mut inside = false;
        for (a, b) in self.edges() {
            let o = orientation(a, b, p);
            if o.abs() <= 0.0 && (p - a).dot(&(p - b)) <= 0.0 {
                return true;
            }
            if (a.y > p.y) != (b.y > p.y) && (o > 0.0) == (b.y > a.y) {
                inside = !inside;
            }
        }
        inside
    }

    /// Distance from `p` to the polygon, zero inside, metres.
    #[must_use]
    pub fn distance_m(&self, p: Point) -> f64 {
        if self.contains(p) { 0.0 } else { self.border_distance_m(p) }
    }

    /// Distance from `p` to the border, inside or out, metres.
    #[must_use]
    pub fn border_distance_m(&self, p: Point) -> f64 {
        self.edges().map(|(a, b)| point_segment_m(p, a, b)).fold(f64::INFINITY, f64::min)
    }
}
