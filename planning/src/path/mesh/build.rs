//! A mesh from an area with holes: triangulate, keep what is free, merge.
//!
//! The triangulation is constrained Delaunay (`spade`, exact predicates). What is
//! free is decided by parity: each ring line that is crossed changes sides. Then
//! every line between two free cells that together are convex is taken out, the
//! longest first: fewer cells mean fewer steps of a search.

use super::{HalfEdge, MAX_MESH_COORDINATE_M, Mesh, MeshError, NONE, turn};
use crate::frame::Point;
use crate::geometry::Polygon;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};
use std::collections::VecDeque;

/// Coordinates below this are zero: the triangulation squares them without underflow.
const SMALLEST_M: f64 = 1e-30;

impl Mesh {
    /// The inside of `outer` without the insides of `holes`.
    ///
    /// Holes may touch each other and the border, in points or along lines; they
    /// must not cross. A polygon inside a hole is free space again, and so on.
    ///
    /// # Complexity
    /// O(n log n) in the number of vertices.
    ///
    /// # Errors
    /// [`MeshError::Crossing`] names the line that crosses another one,
    /// [`MeshError::Empty`] says that nothing is left.
    pub fn from_polygons(outer: &Polygon, holes: &[Polygon]) -> Result<Self, MeshError> {
        let rings: Vec<&[Point]> = std::iter::once(outer)
            .chain(holes)
            .map(Polygon::vertices)
            .collect();
        Self::from_rings(&rings)
    }

    /// What lies inside an odd number of rings; each ring may run either way.
    ///
    /// # Errors
    /// As [`Mesh::from_polygons`], and [`MeshError::BadCoordinate`], counted over
    /// all rings.
    pub fn from_rings(rings: &[&[Point]]) -> Result<Self, MeshError> {
        let (points, ids) = distinct(rings)?;
        let mut lines = Vec::with_capacity(ids.len());
        let mut first = 0;
        for ring in rings {
            for i in 0..ring.len() {
                let a = ids[first + i];
                let b = ids[first + (i + 1) % ring.len()];
                if a != b {
                    lines.push([a as usize, b as usize]);
                }
            }
            first += ring.len();
        }
        if lines.is_empty() {
            return Err(MeshError::Empty);
        }
        let triangles = Triangles::of(&points, lines)?;
        triangles.merge().into_mesh(&points)
    }
}

/// Distinct points of all rings, and the point of each ring vertex.
fn distinct(rings: &[&[Point]]) -> Result<(Vec<Point>, Vec<u32>), MeshError> {
    let snap = |c: f64| if c.abs() < SMALLEST_M { 0.0 } else { c };
    let all: Vec<Point> = rings
        .iter()
        .flat_map(|ring| ring.iter())
        .map(|p| Point::new(snap(p.x), snap(p.y)))
        .collect();
    let bad = |c: f64| !c.is_finite() || c.abs() > MAX_MESH_COORDINATE_M;
    if let Some(i) = all.iter().position(|p| bad(p.x) || bad(p.y)) {
        return Err(MeshError::BadCoordinate(i));
    }
    if all.len() >= NONE as usize / 8 {
        return Err(MeshError::TooLarge(all.len(), NONE / 8));
    }
    let mut order: Vec<u32> = (0..all.len() as u32).collect();
    let by_place = |&a: &u32, &b: &u32| {
        let (p, q) = (all[a as usize], all[b as usize]);
        p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y))
    };
    order.sort_unstable_by(by_place);
    let mut points: Vec<Point> = Vec::with_capacity(all.len());
    let mut ids = vec![0u32; all.len()];
    for i in order {
        let p = all[i as usize];
        if points.last().is_none_or(|q| (p - q).norm_squared() > 0.0) {
            points.push(p);
        }
        ids[i as usize] = points.len() as u32 - 1;
    }
    Ok((points, ids))
}

/// A planar subdivision by directed edges; `e ^ 1` is `e` the other way round.
struct Triangles<'a> {
    points: &'a [Point],
    origin: Vec<u32>,
    next: Vec<u32>,
    previous: Vec<u32>,
    /// Whether the face on the left is free.
    free: Vec<bool>,
    /// Whether the edge was taken out.
    gone: Vec<bool>,
}

impl<'a> Triangles<'a> {
    fn of(points: &'a [Point], lines: Vec<[usize; 2]>) -> Result<Self, MeshError> {
        let vertices = points.iter().map(|p| Point2::new(p.x, p.y)).collect();
        let mut crossing = None;
        let cdt: ConstrainedDelaunayTriangulation<Point2<f64>> =
            ConstrainedDelaunayTriangulation::try_bulk_load_cdt(vertices, lines.clone(), |line| {
                crossing = crossing.or(Some(line));
            })
            .map_err(|_| MeshError::Empty)?;
        if let Some([a, b]) = crossing {
            return Err(MeshError::Crossing(points[a], points[b]));
        }
        let n = cdt.num_directed_edges();
        let mut edges = Self {
            points,
            origin: vec![0; n],
            next: vec![NONE; n],
            previous: vec![NONE; n],
            free: vec![false; n],
            gone: vec![false; n],
        };
        let mut around = vec![NONE; points.len()];
        for e in cdt.directed_edges() {
            let i = e.fix().index();
            edges.origin[i] = e.from().fix().index() as u32;
            edges.next[i] = e.next().fix().index() as u32;
            edges.previous[i] = e.prev().fix().index() as u32;
            around[edges.origin[i] as usize] = i as u32;
        }
        let outside = cdt
            .outer_face()
            .adjacent_edge()
            .ok_or(MeshError::Empty)?
            .fix()
            .index() as u32;
        let walls = edges.walls(&around, &lines)?;
        edges.fill(&walls, outside);
        Ok(edges)
    }

    fn at(&self, edge: u32) -> Point {
        self.points[self.origin[edge as usize] as usize]
    }

    /// Which edges change sides: those that an odd number of ring lines runs over.
    fn walls(&self, around: &[u32], lines: &[[usize; 2]]) -> Result<Vec<bool>, MeshError> {
        let mut walls = vec![false; self.origin.len()];
        for &[a, b] in lines {
            let (mut at, to) = (a as u32, b as u32);
            let crossing = MeshError::Crossing(self.points[a], self.points[b]);
            while at != to {
                let e = self
                    .towards(around[at as usize], to)
                    .ok_or(crossing.clone())?;
                walls[e as usize] = !walls[e as usize];
                walls[e as usize ^ 1] = !walls[e as usize ^ 1];
                at = self.origin[e as usize ^ 1];
            }
        }
        Ok(walls)
    }

    /// The edge from a vertex to `to`, or to a vertex on the straight way there.
    fn towards(&self, first: u32, to: u32) -> Option<u32> {
        let goal = self.points[to as usize];
        let mut e = first;
        let mut on_the_way = None;
        loop {
            let end = self.origin[e as usize ^ 1];
            if end == to {
                return Some(e);
            }
            let (a, b) = (self.at(e), self.points[end as usize]);
            if turn(a, b, goal).abs() <= 0.0 && (b - a).dot(&(goal - a)) > 0.0 {
                on_the_way = Some(e);
            }
            e = self.previous[e as usize] ^ 1;
            if e == first {
                return on_the_way;
            }
        }
    }

    /// Colours all faces from the outside inwards.
    fn fill(&mut self, walls: &[bool], outside: u32) {
        let mut seen = vec![false; self.origin.len()];
        let mut queue = VecDeque::from([(outside, false)]);
        while let Some((first, free)) = queue.pop_front() {
            if seen[first as usize] {
                continue;
            }
            let mut e = first;
            loop {
                seen[e as usize] = true;
                self.free[e as usize] = free;
                if !seen[e as usize ^ 1] {
                    queue.push_back((e ^ 1, free != walls[e as usize]));
                }
                e = self.next[e as usize];
                if e == first {
                    break;
                }
            }
        }
    }

    /// Takes out every line between two free faces that together are convex.
    fn merge(mut self) -> Self {
        let mut inner: Vec<(u64, u32)> = (0..self.origin.len() as u32)
            .step_by(2)
            .filter(|&e| self.free[e as usize] && self.free[e as usize ^ 1])
            .map(|e| ((self.at(e ^ 1) - self.at(e)).norm_squared().to_bits(), e))
            .collect();
        // Squares are not negative, so their bits sort as they do.
        inner.sort_unstable_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
        for (_, e) in inner {
            self.try_take_out(e);
        }
        self
    }

    fn try_take_out(&mut self, e: u32) {
        let back = e ^ 1;
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
    fn into_mesh(self, points: &[Point]) -> Result<Mesh, MeshError> {
        let n = self.origin.len();
        let mut index = vec![NONE; n];
        let mut edges = Vec::with_capacity(n);
        let mut sources = Vec::with_capacity(n);
        let mut starts = vec![0];
        for first in 0..n as u32 {
            let i = first as usize;
            if !self.free[i] || self.gone[i] || index[i] != NONE {
                continue;
            }
            let mut e = first;
            loop {
                index[e as usize] = edges.len() as u32;
                sources.push(e);
                edges.push(HalfEdge {
                    origin: self.at(e),
                    vertex: self.origin[e as usize],
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
        if edges.is_empty() {
            return Err(MeshError::Empty);
        }
        for (edge, &e) in edges.iter_mut().zip(&sources) {
            edge.twin = index[e as usize ^ 1];
        }
        Mesh::finish(points, edges, starts)
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
