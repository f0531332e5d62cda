//! Why there is no path: a closed chain of walls between the two ends (D2.7 §2.3.2).
//!
//! That a search found nothing is hard to check. That a chain of zone edges runs round
//! one end and not round the other is easy, and needs neither the mesh nor the search.

use skein_flight::route::mesh::{Mesh, NONE, turn};
use skein_geometry::frame::Point;

/// A closed chain of walls that parts two places.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut {
    /// Its corners, in order; each side lies on the edge of a zone or of the area.
    pub ring: Vec<Point>,
    /// A place beside each end that is on no wall, in the same cell as the end: an end
    /// may lie on the chain itself. An end inside a zone is its own.
    pub beside: [Point; 2],
}

impl Cut {
    /// Whether the chain runs round one of the two places and not round the other:
    /// then every line between them meets it. Exact.
    #[must_use]
    pub fn parts(&self) -> bool {
        let [a, b] = self.beside;
        is_round(&self.ring, a) != is_round(&self.ring, b)
    }
}

/// Whether a ring winds round a point an odd number of times.
fn is_round(ring: &[Point], p: Point) -> bool {
    let ends = ring.iter().cycle().skip(1);
    ring.iter().zip(ends).fold(false, |odd, (&a, &b)| {
        let crosses = if a.y <= p.y {
            b.y > p.y && turn(a, b, p) > 0.0
        } else {
            b.y <= p.y && turn(a, b, p) < 0.0
        };
        odd ^ crosses
    })
}

/// What parts two places between which there is no path. None if there is one, if
/// neither of them is in free space, or if one is no place. An end on a wall
/// between several parts of free space stands for the first of them.
#[must_use]
pub fn cut_between(mesh: &Mesh, from: Point, to: Point) -> Option<Cut> {
    let mut cells = [Vec::new(), Vec::new()];
    mesh.cells_at(from, &mut cells[0]);
    mesh.cells_at(to, &mut cells[1]);
    let joined = |&a: &u32| cells[1].iter().any(|&b| mesh.joined(a, b));
    let finite = |p: Point| p.x.is_finite() && p.y.is_finite();
    if cells[0].iter().any(joined) || !finite(from) || !finite(to) {
        return None;
    }
    let beside = |cells: &[u32], p| cells.first().map_or(p, |&c| mesh.middle_of(c));
    let beside = [beside(&cells[0], from), beside(&cells[1], to)];
    let part = *cells[0].first().or(cells[1].first())?;
    // The walls of a part are its border: all chains together are round its inside
    // once and round everything else an even number of times, so one of them parts.
    let mut seen = vec![false; mesh.edges.len()];
    for first in 0..mesh.edges.len() as u32 {
        let e = &mesh.edges[first as usize];
        let is_new = e.twin == NONE && !seen[first as usize];
        if !is_new || !mesh.joined(e.cell, part) {
            continue;
        }
        let cut = Cut {
            ring: chain_of_walls(mesh, first, &mut seen),
            beside,
        };
        if cut.parts() {
            return Some(cut);
        }
    }
    None
}

/// From wall to wall with free space on the left, until the chain closes.
fn chain_of_walls(mesh: &Mesh, first: u32, seen: &mut [bool]) -> Vec<Point> {
    let mut ring = Vec::new();
    let mut wall = first;
    while !seen[wall as usize] {
        seen[wall as usize] = true;
        ring.push(mesh.edges[wall as usize].origin);
        wall = mesh.next(wall);
        while mesh.edges[wall as usize].twin != NONE {
            wall = mesh.next(mesh.edges[wall as usize].twin);
        }
    }
    ring
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::route::degenerate_maps::{Rings, crowded, mesh_of, square};
    use proptest::prelude::*;
    use skein_flight::route::two_point::Search;

    /// Whether the line between two points lies on edges of the rings.
    fn lies_on_edges(rings: &Rings, a: Point, b: Point) -> bool {
        let middle = nalgebra::center(&a, &b);
        rings.iter().any(|ring| {
            (0..ring.len()).any(|i| {
                let (p, q) = (ring[i], ring[(i + 1) % ring.len()]);
                let on = |x: Point| turn(p, q, x).abs() <= 0.0 && (x - p).dot(&(x - q)) <= 0.0;
                on(a) && on(b) && on(middle)
            })
        })
    }

    #[test]
    fn a_wall_round_a_yard_and_a_zone_have_cuts() {
        let rings = vec![
            square(0.0, 0.0, 40.0),
            square(10.0, 10.0, 20.0),
            square(15.0, 15.0, 10.0),
        ];
        let mesh = mesh_of(&rings);
        let (yard, outside, wall) = (20.0, 5.0, 12.0);
        let cut = |a: f64, b: f64| cut_between(&mesh, Point::new(a, a), Point::new(b, b));
        assert_eq!(cut(yard, outside).unwrap().ring.len(), 4);
        assert!(cut(yard, wall).unwrap().parts());
        assert!(cut(wall, outside).unwrap().parts());
        assert!(cut(outside, 50.0).unwrap().parts());
        assert!(cut(outside, 35.0).is_none() && cut(wall, wall).is_none());
        assert!(cut(outside, f64::NAN).is_none());
        let mut fake = cut(yard, outside).unwrap();
        fake.ring = square(30.0, 0.0, 5.0);
        assert!(!fake.parts());
    }

    proptest! {
        #[test]
        fn where_there_is_no_path_there_is_a_cut_of_zone_edges(
            cells in prop::collection::vec(prop::bool::weighted(0.45), 64),
            ends in prop::collection::vec(0u8..=160, 4),
        ) {
            prop_assume!(cells.iter().any(|full| !full));
            let rings = crowded(&cells, 8, 0.0);
            let mesh = mesh_of(&rings);
            let at = |i: usize| Point::new(f64::from(ends[i]) / 2.0, f64::from(ends[i + 1]) / 2.0);
            let (a, b) = (at(0), at(2));
            let path = Search::new(&mesh).shortest(a, b);
            let cut = cut_between(&mesh, a, b);
            let blind = !mesh.contains(a) && !mesh.contains(b);
            prop_assert_eq!(cut.is_some(), path.is_none() && !blind);
            if let Some(cut) = cut {
                prop_assert!(cut.parts());
                let n = cut.ring.len();
                for i in 0..n {
                    prop_assert!(lies_on_edges(&rings, cut.ring[i], cut.ring[(i + 1) % n]));
                }
                // What stands for an end sees it: no edge of a zone lies between.
                for (end, beside) in [a, b].into_iter().zip(cut.beside) {
                    if let Some(path) = Search::new(&mesh).shortest(end, beside) {
                        prop_assert_eq!(path.len(), 2);
                    }
                }
            }
        }
    }
}
