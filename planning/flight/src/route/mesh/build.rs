//! A mesh from an area with holes: triangulate, keep what is free, merge.
//!
//! The triangulation is constrained Delaunay ([`super::triangles`]). What is free is decided by parity: each ring line that is crossed changes sides. Then
//! every line between two free cells that together are convex is taken out, the
//! longest first: fewer cells mean fewer steps of a search.

use super::triangles::{FRAME, Triangles, WALL, next, previous};
use super::{HalfEdge, MAX_MESH_COORDINATE_M, Mesh, MeshError, NONE, turn};
use skein_geometry::frame::Point;

/// Coordinates below this are zero: the triangulation squares them without underflow.
const SMALLEST_M: f64 = 1e-30;

/// The plane around rings ends so far beyond everything, metres.
const OUTSKIRTS_M: f64 = 1_000.0;

impl Mesh {
    /// What lies inside an odd number of rings; each ring may run either way.
    ///
    /// Holes may touch each other and the border, in points or along lines; they
    /// must not cross. A ring inside a hole is free space again, and so on.
    ///
    /// # Complexity
    /// O(n log n) in the number of vertices.
    ///
    /// # Errors
    /// [`MeshError::Crossing`] names the line that crosses another one,
    /// [`MeshError::Empty`] says that nothing is left, [`MeshError::BadCoordinate`]
    /// counts over all rings.
    pub fn from_rings(rings: &[&[Point]]) -> Result<Self, MeshError> {
        let points = checked(rings)?;
        let mut first = 0;
        let mut lines = Vec::with_capacity(points.len());
        for ring in rings {
            let n = ring.len();
            lines.extend((0..n).map(|i| [first + i, first + (i + 1) % n]));
            first += n;
        }
        let (points, edges, starts) = cells_between(&points, &lines)?;
        Self::finish(&points, edges, starts)
    }

    /// The plane around the outlines of zones, to a kilometre beyond all of them and some places.
    ///
    /// # Errors
    /// As [`Mesh::from_rings`].
    pub fn around(rings: &[&[Point]], places: &[Point]) -> Result<Self, MeshError> {
        let inside = rings.iter().flat_map(|ring| ring.iter()).chain(places);
        let far_m = inside.map(|p| p.coords.amax()).fold(0.0, f64::max);
        let half_m = far_m + OUTSKIRTS_M;
        let border = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| Point::new(x * half_m, y * half_m));
        let border = core::iter::once(border.as_slice());
        Self::from_rings(&border.chain(rings.iter().copied()).collect::<Vec<_>>())
    }
}

/// Points, half-edges by cell, and where each cell's half-edges begin.
pub(super) type CellParts = (Vec<Point>, Vec<HalfEdge>, Vec<u32>);

/// Convex cells of what an odd number of lines parts from the outside.
pub(super) fn cells_between(
    points: &[Point],
    lines: &[[usize; 2]],
) -> Result<CellParts, MeshError> {
    if lines.is_empty() {
        return Err(MeshError::Empty);
    }
    let (mut triangles, ids) = Triangles::of(points);
    for line in lines {
        let [a, b] = line.map(|i| ids[i]);
        triangles.set_line(a, b)?;
    }
    let cells = Faces::of(triangles).merge().into_cells();
    if cells.1.is_empty() {
        return Err(MeshError::Empty);
    }
    Ok(cells)
}

/// The Delaunay triangles of some points, each by its corners counter-clockwise, exact
/// but for the last bits. Of points in one place one is used; on a straight border
/// slivers may be missing.
///
/// # Complexity
/// O(n log n) on points as maps have them.
///
/// # Errors
/// As [`Mesh::from_rings`] for coordinates, and [`MeshError::Empty`] without points.
pub fn delaunay(points: &[Point]) -> Result<Vec<[usize; 3]>, MeshError> {
    let points = checked(&[points])?;
    let (triangles, ids) = Triangles::of(&points);
    let mut of_id = vec![NONE; triangles.points.len()];
    for (&id, i) in ids.iter().zip(0u32..) {
        of_id[id as usize] = i;
    }
    let inner = triangles.origin.chunks_exact(3);
    let inner = inner.filter(|corners| corners.iter().all(|&v| v >= FRAME));
    Ok(inner
        .map(|t| [t[0], t[1], t[2]].map(|v| of_id[v as usize] as usize))
        .collect())
}

/// The points of all rings.
pub(super) fn checked(rings: &[&[Point]]) -> Result<Vec<Point>, MeshError> {
    let snap = |c: f64| if c.abs() < SMALLEST_M { 0.0 } else { c };
    let all: Vec<Point> = rings
        .iter()
        .flat_map(|ring| ring.iter())
        .map(|p| p.map(snap))
        .collect();
    let bad = |c: f64| !c.is_finite() || c.abs() > MAX_MESH_COORDINATE_M;
    if let Some(i) = all.iter().position(|p| bad(p.x) || bad(p.y)) {
        return Err(MeshError::BadCoordinate(i));
    }
    if all.len() >= NONE as usize / 8 {
        return Err(MeshError::TooLarge(all.len(), NONE / 8));
    }
    if all.is_empty() {
        return Err(MeshError::Empty);
    }
    Ok(all)
}

/// Faces of a planar subdivision by their half-edges.
struct Faces {
    points: Vec<Point>,
    origin: Vec<u32>,
    twin: Vec<u32>,
    next: Vec<u32>,
    previous: Vec<u32>,
    /// Whether a triangle is free.
    free: Vec<bool>,
    /// Whether the side was taken out.
    gone: Vec<bool>,
}

/// Which triangles lie inside an odd number of rings.
fn free_triangles(triangles: &Triangles) -> Vec<bool> {
    let n = triangles.origin.len() / 3;
    let mut free = vec![false; n];
    let mut seen = vec![false; n];
    let of_the_frame = triangles.around[0] / 3;
    let mut stack = vec![of_the_frame];
    seen[of_the_frame as usize] = true;
    while let Some(t) = stack.pop() {
        for e in 3 * t..3 * t + 3 {
            let twin = triangles.twin[e as usize];
            if twin == NONE || seen[twin as usize / 3] {
                continue;
            }
            let is_wall = triangles.marks[e as usize] & WALL != 0;
            seen[twin as usize / 3] = true;
            free[twin as usize / 3] = free[t as usize] != is_wall;
            stack.push(twin / 3);
        }
    }
    free
}

impl Faces {
    fn of(triangles: Triangles) -> Self {
        let n = triangles.origin.len();
        Self {
            free: free_triangles(&triangles),
            points: triangles.points,
            origin: triangles.origin,
            twin: triangles.twin,
            next: (0..n as u32).map(next).collect(),
            previous: (0..n as u32).map(previous).collect(),
            gone: vec![false; n],
        }
    }

    fn at(&self, side: u32) -> Point {
        self.points[self.origin[side as usize] as usize]
    }

    fn is_free(&self, side: u32) -> bool {
        self.free[side as usize / 3]
    }

    /// Takes out every side between two free faces that together are convex.
    fn merge(mut self) -> Self {
        for e in self.inner_longest_first() {
            self.try_take_out(e);
        }
        self
    }

    /// The sides between free faces, by length to within a few per cent.
    fn inner_longest_first(&self) -> Vec<u32> {
        /// Bits of a length's square that do not count: an octave is cut in sixteen.
        const FINE_BITS: u32 = 48;
        /// What is 2⁶⁴ times shorter than the longest is as good as that.
        const CLASSES: usize = 16 * 128;
        let is_inner = |&(e, &twin): &(u32, &u32)| {
            e < twin && twin != NONE && self.is_free(e) && self.is_free(twin)
        };
        // Squares are not negative, so their bits sort as they do.
        let inner: Vec<(u32, u32)> = (0..)
            .zip(&self.twin)
            .filter(is_inner)
            .map(|(e, &twin)| {
                let square = (self.at(twin) - self.at(e)).norm_squared();
                ((square.to_bits() >> FINE_BITS) as u32, e)
            })
            .collect();
        let longest = inner.iter().map(|&(class, _)| class).max().unwrap_or(0);
        let class = |c: u32| ((longest - c) as usize).min(CLASSES - 1);
        let mut ends = vec![0u32; CLASSES + 1];
        for &(c, _) in &inner {
            ends[class(c) + 1] += 1;
        }
        for c in 0..CLASSES {
            ends[c + 1] += ends[c];
        }
        let mut sorted = vec![0u32; inner.len()];
        for (c, e) in inner {
            let end = &mut ends[class(c)];
            sorted[*end as usize] = e;
            *end += 1;
        }
        sorted
    }

    fn try_take_out(&mut self, e: u32) {
        let back = self.twin[e as usize];
        if self.stays_convex(e, back) && self.stays_convex(back, e) {
            self.join(self.previous[e as usize], self.next[back as usize]);
            self.join(self.previous[back as usize], self.next[e as usize]);
            self.gone[e as usize] = true;
            self.gone[back as usize] = true;
        }
    }

    /// Whether the ring without `e` goes straight or left where `e` begins.
    fn stays_convex(&self, e: u32, back: u32) -> bool {
        let before = self.at(self.previous[e as usize]);
        let here = self.at(e);
        let after = self.at(self.next[self.next[back as usize] as usize]);
        let bend = turn(before, here, after);
        bend > 0.0 || (bend >= 0.0 && (here - before).dot(&(after - here)) > 0.0)
    }

    fn join(&mut self, before: u32, after: u32) {
        self.next[before as usize] = after;
        self.previous[after as usize] = before;
    }

    /// The free faces as cells.
    fn into_cells(mut self) -> CellParts {
        let n = self.origin.len();
        let mut index = vec![NONE; n];
        let mut edges = Vec::with_capacity(n);
        let mut sources = Vec::with_capacity(n);
        let mut starts = vec![0];
        for first in 0..n as u32 {
            let i = first as usize;
            if !self.is_free(first) || self.gone[i] || index[i] != NONE {
                continue;
            }
            let mut e = first;
            loop {
                index[e as usize] = edges.len() as u32;
                sources.push(e);
                edges.push(HalfEdge {
                    origin: self.at(e),
                    vertex: self.origin[e as usize] - FRAME,
                    twin: NONE,
                    cell: starts.len() as u32 - 1,
                    block: NONE,
                });
                e = self.next[e as usize];
                if e == first {
                    break;
                }
            }
            starts.push(edges.len() as u32);
        }
        for (edge, &e) in edges.iter_mut().zip(&sources) {
            let twin = self.twin[e as usize];
            edge.twin = if twin == NONE {
                NONE
            } else {
                index[twin as usize]
            };
        }
        (self.points.split_off(FRAME as usize), edges, starts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(points: &[(f64, f64)]) -> Vec<Point> {
        points.iter().map(|&(x, y)| Point::new(x, y)).collect()
    }

    fn square(x: f64, y: f64, side: f64) -> Vec<Point> {
        ring(&[(x, y), (x + side, y), (x + side, y + side), (x, y + side)])
    }

    fn area_m2(mesh: &Mesh) -> f64 {
        (0..mesh.n_cells())
            .map(|c| {
                let ring: Vec<Point> = mesh.cell(c).collect();
                let n = ring.len();
                (0..n)
                    .map(|i| (ring[i] - ring[0]).perp(&(ring[(i + 1) % n] - ring[0])))
                    .sum::<f64>()
                    / 2.0
            })
            .sum()
    }

    #[test]
    fn rings_within_rings_change_sides() {
        let rings = [
            square(0.0, 0.0, 10.0),
            square(2.0, 2.0, 6.0),
            square(4.0, 4.0, 2.0),
        ];
        let rings: Vec<&[Point]> = rings.iter().map(Vec::as_slice).collect();
        let mesh = Mesh::from_rings(&rings).unwrap();
        assert!((area_m2(&mesh) - (100.0 - 36.0 + 4.0)).abs() < 1e-9);
        assert!(mesh.contains(Point::new(5.0, 5.0)) && !mesh.contains(Point::new(3.0, 5.0)));
        assert!(mesh.contains(Point::new(2.0, 5.0)) && !mesh.contains(Point::new(10.1, 5.0)));
        assert_eq!(mesh.n_corners(), 4);
    }

    #[test]
    fn holes_may_touch_in_points_and_along_lines() {
        let rings = [
            square(0.0, 0.0, 10.0),
            square(2.0, 2.0, 2.0),
            square(4.0, 4.0, 2.0),
            square(4.0, 2.5, 1.0),
            square(0.0, 7.0, 1.0),
        ];
        let rings: Vec<&[Point]> = rings.iter().map(Vec::as_slice).collect();
        let mesh = Mesh::from_rings(&rings).unwrap();
        assert!((area_m2(&mesh) - 90.0).abs() < 1e-9);
        // The point where two squares touch is one vertex for either side.
        let twice = mesh
            .vertices
            .iter()
            .filter(|v| (v.at - Point::new(4.0, 4.0)).norm() < 1e-9);
        assert_eq!(twice.count(), 2);
    }

    #[test]
    fn a_bad_area_is_refused_and_the_place_named() {
        let crossed = [square(0.0, 0.0, 10.0), square(8.0, 8.0, 4.0)];
        let crossed: Vec<&[Point]> = crossed.iter().map(Vec::as_slice).collect();
        assert!(matches!(
            Mesh::from_rings(&crossed),
            Err(MeshError::Crossing(_, _))
        ));
        assert_eq!(Mesh::from_rings(&[]).unwrap_err(), MeshError::Empty);
        let flat = ring(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)]);
        assert_eq!(Mesh::from_rings(&[&flat]).unwrap_err(), MeshError::Empty);
        let twice = square(0.0, 0.0, 1.0);
        assert_eq!(
            Mesh::from_rings(&[&twice, &twice]).unwrap_err(),
            MeshError::Empty
        );
        let far = ring(&[(0.0, 0.0), (1e300, 0.0), (0.0, 1.0)]);
        assert_eq!(
            Mesh::from_rings(&[&far]).unwrap_err(),
            MeshError::BadCoordinate(1)
        );
    }
}
