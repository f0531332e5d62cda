//! Lower bounds of distances from a few shortest path maps (landmarks, "ALT").
//!
//! Goldberg and Harrelson, "Computing the shortest path: A* search meets graph theory",
//! SODA 2005.
//!
//! For a landmark L, d(L, a) and d(L, b) differ by no more than d(a, b). Eight maps
//! far from each other know how far everything is round the obstacles, where the
//! straight line does not. A two-point search with them opens a fraction of the
//! nodes and finds the same lengths.

use super::continuous::PathMap;
use skein_flight::route::lower_bounds::{COUNT, Lengths, LowerBounds};
use skein_flight::route::mesh::Mesh;
use skein_geometry::frame::Point;

/// Distances from a few far corners of a mesh to all of its vertices.
#[derive(Clone, Debug)]
pub struct Landmarks<'m> {
    maps: Vec<PathMap<'m>>,
    vertices: Vec<Lengths>,
}

impl<'m> Landmarks<'m> {
    /// Chooses each landmark as far as possible from those before.
    ///
    /// # Complexity
    /// Nine shortest path maps.
    #[must_use]
    pub fn new(mesh: &'m Mesh) -> Self {
        let mut nearest_m = vec![f64::INFINITY; mesh.n_vertices()];
        let mut maps: Vec<PathMap<'m>> = Vec::with_capacity(COUNT);
        let first = PathMap::new(mesh, mesh.middle_of_largest_part());
        let mut next = farthest(&first, |v| first.vertex_length_m(v), mesh.n_vertices());
        while maps.len() < COUNT {
            let map = PathMap::new(mesh, next);
            for (v, length_m) in nearest_m.iter_mut().enumerate() {
                *length_m = length_m.min(map.vertex_length_m(v));
            }
            next = farthest(&map, |v| nearest_m[v], mesh.n_vertices());
            maps.push(map);
        }
        let of = |v: usize| std::array::from_fn(|i| maps[i].vertex_length_m(v));
        let vertices = (0..mesh.n_vertices()).map(of).collect();
        Self { maps, vertices }
    }
}

impl LowerBounds for Landmarks<'_> {
    fn at_vertex(&self, vertex: u32) -> &Lengths {
        &self.vertices[vertex as usize]
    }

    fn at_point(&self, p: Point) -> Lengths {
        std::array::from_fn(|i| self.maps[i].distance_m(p).unwrap_or(f64::INFINITY))
    }
}

/// The vertex with the largest finite length.
fn farthest(map: &PathMap, length_m: impl Fn(usize) -> f64, n: usize) -> Point {
    (0..n)
        .filter(|&v| length_m(v).is_finite())
        .max_by(|&a, &b| length_m(a).total_cmp(&length_m(b)).then(b.cmp(&a)))
        .map_or(map.source(), |v| map.vertex(v))
}
