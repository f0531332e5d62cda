//! Small maps on which everything touches or is collinear, for tests of both engines.

use super::mesh::Mesh;
use skein_geometry::frame::Point;

/// Border and holes.
pub(crate) type Rings = Vec<Vec<Point>>;

/// A square with its lower left corner at (x, y).
pub(crate) fn square(x: f64, y: f64, side: f64) -> Vec<Point> {
    [(x, y), (x + side, y), (x + side, y + side), (x, y + side)]
        .map(|(x, y)| Point::new(x, y))
        .to_vec()
}

/// What lies inside an odd number of rings.
pub(crate) fn mesh_of(rings: &Rings) -> Mesh {
    let rings: Vec<&[Point]> = rings.iter().map(Vec::as_slice).collect();
    Mesh::from_rings(&rings).unwrap()
}

/// Boxes on a coarse grid: they share corners and lines, and all is collinear.
pub(crate) fn crowded(cells: &[bool], n: usize, offset: f64) -> Rings {
    let mut rings = vec![square(offset, offset, n as f64 * 10.0)];
    for (i, _) in cells.iter().enumerate().filter(|(_, full)| **full) {
        let (x, y) = ((i % n) as f64 * 10.0, (i / n) as f64 * 10.0);
        rings.push(square(offset + x, offset + y, 10.0));
    }
    rings
}
