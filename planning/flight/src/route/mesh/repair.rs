//! One zone more or less: only the cells near it are triangulated again (D2.7 §2.3.2
//! builds once and assumes that zones stay).
//!
//! What is free is a matter of parity, so a zone comes and goes by the same step: the
//! inside of its ring changes from free to not, and back. Cells that the ring's
//! bounding box does not reach stay as they are.

use super::build::{CellParts, cells_between, checked};
use super::{HalfEdge, Mesh, MeshError, NONE};
use skein_geometry::frame::Point;
use std::collections::BTreeMap;

impl Mesh {
    /// The mesh in which free space and zones have changed places inside a ring: adds a
    /// zone to free space, or removes one that is there. The ring must not cross what
    /// else is there; the mesh must have been made of rings.
    ///
    /// # Complexity
    /// O(k log k) for k sides near the ring, and a pass over the mesh to link it anew.
    ///
    /// # Errors
    /// As [`Mesh::from_rings`]; this mesh is left as it was.
    pub fn with_ring_changed(&self, ring: &[Point]) -> Result<Self, MeshError> {
        let ring = checked(&[ring])?;
        let stays = self.numbers_of_those_that_stay(&ring);
        let (new_points, new_edges, new_starts) = match self.patch(&ring, &stays) {
            // All that was near has become zone.
            Err(MeshError::Empty) => (Vec::new(), Vec::new(), vec![0]),
            other => other?,
        };
        let mut points: Vec<Point> = self.vertices.iter().map(|v| v.at).collect();
        points.truncate(self.vertices.len() - self.twice.len());
        let (mut edges, mut starts) = self.kept(&stays);
        let n_kept = edges.len() as u32;
        let cells_kept = starts.len() as u32 - 1;
        // Sides of cells that stay, whose other cell goes, by their ends.
        let mut open = BTreeMap::new();
        let mut places = BTreeMap::new();
        for w in starts.windows(2) {
            for i in w[0]..w[1] {
                let next = if i + 1 == w[1] { w[0] } else { i + 1 };
                let (a, b) = (edges[i as usize].vertex, edges[next as usize].vertex);
                if edges[i as usize].block == OPEN {
                    open.insert((a, b), i);
                    places.insert(key(edges[i as usize].origin), a);
                    places.insert(key(edges[next as usize].origin), b);
                }
            }
        }
        let mut place = |p: Point| {
            *places.entry(key(p)).or_insert_with(|| {
                points.push(p);
                points.len() as u32 - 1
            })
        };
        edges.extend(new_edges.iter().map(|e| HalfEdge {
            vertex: place(new_points[e.vertex as usize]),
            twin: if e.twin == NONE {
                NONE
            } else {
                e.twin + n_kept
            },
            cell: e.cell + cells_kept,
            ..*e
        }));
        starts.extend(new_starts[1..].iter().map(|s| s + n_kept));
        for w in new_starts.windows(2) {
            for i in w[0]..w[1] {
                let next = if i + 1 == w[1] { w[0] } else { i + 1 };
                let (i, next) = (i + n_kept, next + n_kept);
                let ends = (edges[next as usize].vertex, edges[i as usize].vertex);
                if edges[i as usize].twin == NONE
                    && let Some(&kept) = open.get(&ends)
                {
                    edges[i as usize].twin = kept;
                    edges[kept as usize].twin = i;
                }
            }
        }
        if edges.is_empty() {
            return Err(MeshError::Empty);
        }
        let points = only_used(&points, &mut edges);
        Self::finish(&points, edges, starts)
    }

    /// For each cell its number among those that the bounding box of a ring does not
    /// reach, or [`NONE`].
    fn numbers_of_those_that_stay(&self, ring: &[Point]) -> Vec<u32> {
        let (low, high) = bounds(ring.iter().copied());
        let mut n = 0;
        let number = |c| {
            let (l, h) = bounds(self.cell(c));
            let apart = l.x > high.x || l.y > high.y || h.x < low.x || h.y < low.y;
            if apart {
                n += 1;
                n - 1
            } else {
                NONE
            }
        };
        (0..self.n_cells()).map(number).collect()
    }

    /// New cells for what is near the ring.
    fn patch(&self, ring: &[Point], stays: &[u32]) -> Result<CellParts, MeshError> {
        // A line that is there twice changes nothing: where a zone goes, its corners go.
        let mut odd = BTreeMap::new();
        let mut change = |a: Point, b: Point| {
            let name = (key(a).min(key(b)), key(a).max(key(b)));
            if odd.remove(&name).is_none() {
                odd.insert(name, [a, b]);
            }
        };
        let ends = ring.iter().cycle().skip(1);
        ring.iter().zip(ends).for_each(|(&a, &b)| change(a, b));
        for (e, i) in self.edges.iter().zip(0u32..) {
            let goes = |cell: u32| stays[cell as usize] == NONE;
            let beyond = |twin: u32| self.edges[twin as usize].cell;
            if goes(e.cell) && (e.twin == NONE || !goes(beyond(e.twin))) {
                change(e.origin, self.edges[self.next(i) as usize].origin);
            }
        }
        let lines: Vec<[usize; 2]> = (0..odd.len()).map(|i| [2 * i, 2 * i + 1]).collect();
        let points: Vec<Point> = odd.into_values().flatten().collect();
        cells_between(&points, &lines)
    }

    /// The half-edges of the cells that stay, with new numbers; those beside a cell that
    /// goes are marked [`OPEN`].
    fn kept(&self, stays: &[u32]) -> (Vec<HalfEdge>, Vec<u32>) {
        let mut number = vec![NONE; self.edges.len()];
        let mut edges = Vec::with_capacity(self.edges.len());
        let mut starts = vec![0];
        for (cell, &to) in stays.iter().enumerate() {
            if to == NONE {
                continue;
            }
            for i in self.starts[cell]..self.starts[cell + 1] {
                number[i as usize] = edges.len() as u32;
                let e = &self.edges[i as usize];
                edges.push(HalfEdge {
                    vertex: self.place_of(e.vertex),
                    cell: to,
                    block: NONE,
                    ..*e
                });
            }
            starts.push(edges.len() as u32);
        }
        for e in &mut edges {
            if e.twin != NONE {
                e.twin = number[e.twin as usize];
                e.block = if e.twin == NONE { OPEN } else { NONE };
            }
        }
        (edges, starts)
    }
}

/// Marks, in place of a block, a side whose other cell is gone.
const OPEN: u32 = NONE - 1;

/// A place by the bits of its coordinates; both zeros are one.
fn key(p: Point) -> (u64, u64) {
    ((p.x + 0.0).to_bits(), (p.y + 0.0).to_bits())
}

fn bounds(points: impl Iterator<Item = Point>) -> (Point, Point) {
    let none = (
        Point::new(f64::INFINITY, f64::INFINITY),
        Point::new(f64::NEG_INFINITY, f64::NEG_INFINITY),
    );
    points.fold(none, |(low, high), p| (low.inf(&p), high.sup(&p)))
}

/// Drops the points that no half-edge starts from.
fn only_used(points: &[Point], edges: &mut [HalfEdge]) -> Vec<Point> {
    let mut number = vec![NONE; points.len()];
    for e in edges.iter() {
        number[e.vertex as usize] = 0;
    }
    let mut used = Vec::with_capacity(points.len());
    for (n, &p) in number.iter_mut().zip(points) {
        if *n != NONE {
            *n = used.len() as u32;
            used.push(p);
        }
    }
    for e in edges {
        e.vertex = number[e.vertex as usize];
    }
    used
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::route::degenerate_maps::{mesh_of, square};
    use crate::route::two_point::Search;
    use proptest::prelude::*;

    fn same_lengths(ours: &Mesh, rebuilt: &Mesh, ends: &[Point]) -> Result<(), TestCaseError> {
        let (mut a, mut b) = (Search::new(ours), Search::new(rebuilt));
        for &p in ends {
            for &q in ends {
                let (a, b) = (a.distance_m(p, q), b.distance_m(p, q));
                prop_assert_eq!(a.is_some(), b.is_some(), "{:?} {:?}", p, q);
                prop_assert!((a.unwrap_or(0.0) - b.unwrap_or(0.0)).abs() < 1e-9);
            }
        }
        Ok(())
    }

    #[test]
    fn a_zone_that_comes_and_goes_leaves_nothing_behind() {
        let mesh = mesh_of(&vec![square(0.0, 0.0, 40.0), square(10.0, 10.0, 5.0)]);
        let zone = square(20.0, 20.0, 5.0);
        let more = mesh.with_ring_changed(&zone).unwrap();
        assert!(!more.contains(Point::new(22.0, 22.0)));
        assert_eq!(more.n_corners(), 8);
        let back = more.with_ring_changed(&zone).unwrap();
        assert!(back.contains(Point::new(22.0, 22.0)));
        assert_eq!((back.n_corners(), back.n_vertices()), (4, 8));
        // All of the area as a zone leaves nothing; a crossing ring is refused.
        let all = square(0.0, 0.0, 40.0);
        let inner = square(10.0, 10.0, 5.0);
        let rest = mesh.with_ring_changed(&all).unwrap();
        assert!(rest.contains(Point::new(12.0, 12.0)) && !rest.contains(Point::new(5.0, 5.0)));
        assert_eq!(
            rest.with_ring_changed(&inner).unwrap_err(),
            MeshError::Empty
        );
        let crossing = mesh.with_ring_changed(&square(12.0, 12.0, 10.0));
        assert!(matches!(crossing, Err(MeshError::Crossing(_, _))));
    }

    proptest! {
        #[test]
        fn boxes_that_come_and_go_leave_the_mesh_of_what_is_there(
            cells in prop::collection::vec(prop::bool::weighted(0.3), 49),
            changes in prop::collection::vec(0usize..49, 1..6),
            ends in prop::collection::vec((0u8..=140, 0u8..=140), 6),
        ) {
            prop_assume!(cells.iter().filter(|full| !**full).count() > 7);
            let rings = crate::route::degenerate_maps::crowded(&cells, 7, 0.0);
            let mut mesh = mesh_of(&rings);
            let mut there = cells.clone();
            for &i in &changes {
                let (x, y) = ((i % 7) as f64 * 10.0, (i / 7) as f64 * 10.0);
                mesh = mesh.with_ring_changed(&square(x, y, 10.0)).unwrap();
                there[i] = !there[i];
            }
            let rebuilt = mesh_of(&crate::route::degenerate_maps::crowded(&there, 7, 0.0));
            let ends: Vec<Point> = ends
                .iter()
                .map(|&(x, y)| Point::new(f64::from(x) / 2.0, f64::from(y) / 2.0))
                .collect();
            same_lengths(&mesh, &rebuilt, &ends)?;
        }
    }
}
