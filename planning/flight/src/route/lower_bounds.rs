//! Lower bounds of distances that guide a two-point search ([`super::two_point`]).
//!
//! For a landmark L, d(L, a) and d(L, b) differ by no more than d(a, b). Where the lengths
//! from a few landmarks to all vertices are known, a search opens fewer nodes and finds
//! the same lengths. The swarm's missions are too small for it to pay; the landmarks
//! themselves are in `skein-lab`.

use skein_geometry::frame::Point;

/// Landmarks: one cache line of lengths a vertex.
pub const COUNT: usize = 8;

/// Length from each landmark, metres.
pub type Lengths = [f64; COUNT];

/// What knows the lengths from the landmarks of a mesh.
pub trait LowerBounds: core::fmt::Debug {
    /// Lengths to a vertex of the mesh.
    fn at_vertex(&self, vertex: u32) -> &Lengths;

    /// Lengths to any point.
    fn at_point(&self, p: Point) -> Lengths;
}

/// The least distance between two points with these lengths from the landmarks.
/// Where a landmark reaches neither, its difference is no number and drops out.
#[inline]
pub(crate) fn between_m(a: &Lengths, b: &Lengths) -> f64 {
    let mut best = 0.0f64;
    for i in 0..COUNT {
        best = best.max((a[i] - b[i]).abs());
    }
    best
}

/// The least distance between a point and any point of the side between two vertices.
#[inline]
pub(crate) fn to_side_m(goal: &Lengths, a: &Lengths, b: &Lengths, side_m: f64) -> f64 {
    let mut best = 0.0f64;
    for i in 0..COUNT {
        // From either end a length changes by no more than the way along the side;
        // together: nowhere by more than half the side from the mean of the ends.
        let middle = 0.5 * (a[i] + b[i]);
        best = best.max((goal[i] - middle).abs() - 0.5 * side_m);
    }
    best
}
