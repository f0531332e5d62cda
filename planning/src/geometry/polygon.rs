//! A simple polygon, checked when it is made.

use crate::frame::Point;
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

impl Polygon {
    /// Checks a ring (closed or not, any winding; repeated consecutive vertices
    /// are dropped) and makes it counter-clockwise.
    ///
    /// # Errors
    /// [`PolygonError`] names the vertex or the edges, by index into `ring`.
    pub fn new(ring: Vec<Point>) -> Result<Self, PolygonError> {
        let _ = ring;
        todo!("planning helper")
    }

    /// The vertices, counter-clockwise, the first not repeated.
    #[must_use]
    pub fn vertices(&self) -> &[Point] {
        &self.vertices
    }

    /// Area in square metres.
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        todo!("planning helper")
    }

    /// Whether `p` is inside or on the border.
    #[must_use]
    pub fn contains(&self, p: Point) -> bool {
        let _ = p;
        todo!("planning helper")
    }

    /// Distance from `p` to the polygon, zero inside, metres.
    #[must_use]
    pub fn distance_m(&self, p: Point) -> f64 {
        let _ = p;
        todo!("planning helper")
    }
}
