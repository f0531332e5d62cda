//! Zones as they come, cleaned so far that every edge has a direction.
//!
//! Carries the repairs of D2.7 §2.3.1. Crossings and contacts are left as they are:
//! the union of what surrounds each edge needs no simple ring.

use super::boxes::Bounds;
use super::{OffsetError, Place, Repair, RepairKind, Zone};
use crate::frame::Point;
use crate::polygon::{MAX_COORDINATE_M, side};

/// A ring without repeated vertices: an outer ring runs counter-clockwise, a hole
/// clockwise, so that the zone lies to the left of every edge of a simple ring.
#[derive(Debug)]
pub(super) struct Ring {
    pub(super) points: Vec<Point>,
    /// For each vertex its number in the ring as given.
    pub(super) origin: Vec<u32>,
    /// 0 for the outer ring, then the holes.
    pub(super) number: u32,
}

impl Ring {
    /// The vertices each edge joins.
    pub(super) fn edges(&self) -> impl Iterator<Item = (Point, Point)> + '_ {
        let n = self.points.len();
        (0..n).map(move |i| (self.points[i], self.points[(i + 1) % n]))
    }

    /// How often the ring winds round `p`; anything for a point on the ring.
    pub(super) fn winding(&self, p: Point) -> i32 {
        winding(&self.points, p)
    }
}

/// A zone ready to be grown.
#[derive(Debug)]
pub(super) struct Shape {
    /// Which zone of the caller's list.
    pub(super) zone: u32,
    /// The outer ring first.
    pub(super) rings: Vec<Ring>,
    pub(super) bounds: Bounds,
    /// Whether the outer ring encloses nothing and is grown as the line it is.
    pub(super) flat: bool,
}

impl Shape {
    /// Checks the numbers, drops repeats, orients the rings.
    ///
    /// # Errors
    /// A coordinate that is no number or too large, or fewer than three vertices.
    pub fn new(
        zone_idx: usize,
        zone: &Zone,
        repairs: &mut Vec<Repair>,
    ) -> Result<Self, OffsetError> {
        let zone_idx = small(zone_idx);
        let outer = ring(zone_idx, 0, &zone.outer, repairs)?;
        if outer.points.len() < 3 {
            return Err(OffsetError::TooFewVertices {
                zone: zone_idx as usize,
                found: outer.points.len(),
            });
        }
        let flat = is_flat(&outer.points);
        if flat {
            repairs.push(Repair {
                place: place(zone_idx, 0, 0),
                kind: RepairKind::NoArea,
            });
        }
        let bounds = Bounds::around(&outer.points, zone_idx);
        let mut shape = Self {
            zone: zone_idx,
            bounds: bounds.unwrap_or(Bounds::of(outer.points[0], outer.points[0], zone_idx)),
            rings: vec![turned(outer, 1.0)],
            flat,
        };
        for (i, hole) in zone.holes.iter().enumerate() {
            let number = small(i + 1);
            let hole = ring(zone_idx, number, hole, repairs)?;
            if hole.points.len() < 3 || is_flat(&hole.points) {
                repairs.push(Repair {
                    place: place(zone_idx, number, 0),
                    kind: RepairKind::HoleWithoutArea,
                });
                continue;
            }
            // A hole that reaches out of its zone still has edges to keep away from.
            if let Some(b) = Bounds::around(&hole.points, zone_idx) {
                shape.bounds.west = shape.bounds.west.min(b.west);
                shape.bounds.east = shape.bounds.east.max(b.east);
                shape.bounds.south = shape.bounds.south.min(b.south);
                shape.bounds.north = shape.bounds.north.max(b.north);
            }
            shape.rings.push(turned(hole, -1.0));
        }
        Ok(shape)
    }

    /// Whether `p`, away from all edges, is in the zone: the outer ring winds round
    /// it in either sense and no hole does.
    pub(super) fn contains(&self, p: Point) -> bool {
        self.bounds.holds(p)
            && self.rings[0].winding(p) != 0
            && self.rings[1..].iter().all(|h| h.winding(p) == 0)
    }
}

/// How often a ring winds round `p`, counter-clockwise positive.
pub(super) fn winding(points: &[Point], p: Point) -> i32 {
    let mut count = 0;
    let Some(&last) = points.last() else { return 0 };
    let mut a = last;
    for &b in points {
        if (a.y <= p.y) != (b.y <= p.y) {
            let s = side(a, b, p);
            if a.y <= p.y && s > 0 {
                count += 1;
            } else if b.y <= p.y && s < 0 {
                count -= 1;
            }
        }
        a = b;
    }
    count
}

/// Twice the signed area of a ring, counter-clockwise positive.
pub(super) fn double_area(points: &[Point]) -> f64 {
    let Some(&o) = points.first() else { return 0.0 };
    points
        .windows(2)
        .map(|w| (w[0] - o).perp(&(w[1] - o)))
        .sum()
}

pub(super) fn place(zone: u32, ring: u32, vertex: u32) -> Place {
    Place {
        zone: zone as usize,
        ring: ring as usize,
        vertex: vertex as usize,
    }
}

/// Numbers of zones, rings and vertices fit 32 bits: four thousand million vertices
/// would need 64 GB before they got here.
pub(super) fn small(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

fn ring(
    zone: u32,
    number: u32,
    given: &[Point],
    repairs: &mut Vec<Repair>,
) -> Result<Ring, OffsetError> {
    let mut points: Vec<Point> = Vec::with_capacity(given.len());
    let mut origin: Vec<u32> = Vec::with_capacity(given.len());
    for (i, p) in given.iter().enumerate() {
        let at = place(zone, number, small(i));
        if !(p.x.is_finite() && p.y.is_finite()) {
            return Err(OffsetError::NotFinite(at));
        }
        if p.x.abs() > MAX_COORDINATE_M || p.y.abs() > MAX_COORDINATE_M {
            return Err(OffsetError::TooFar(at));
        }
        // Adding zero turns −0 into 0, so that equal points compare equal.
        let p = Point::new(p.x + 0.0, p.y + 0.0);
        if points.last().is_some_and(|&q| same(p, q)) {
            repairs.push(Repair {
                place: at,
                kind: RepairKind::RepeatedVertex,
            });
        } else {
            points.push(p);
            origin.push(small(i));
        }
    }
    // A closed ring is the usual way to write one, so its last point is no repair.
    while points.len() > 1 && same(points[0], points[points.len() - 1]) {
        points.pop();
        origin.pop();
    }
    Ok(Ring {
        points,
        origin,
        number,
    })
}

fn same(a: Point, b: Point) -> bool {
    a.x.total_cmp(&b.x).is_eq() && a.y.total_cmp(&b.y).is_eq()
}

/// Whether all points lie on one line.
fn is_flat(points: &[Point]) -> bool {
    let (a, b) = (points[0], points[1]);
    points.iter().all(|&c| side(a, b, c) == 0)
}

/// The ring with its area of the given sign.
fn turned(mut ring: Ring, sign: f64) -> Ring {
    if double_area(&ring.points) * sign < 0.0 {
        ring.points.reverse();
        ring.origin.reverse();
    }
    ring
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn winding_counts_turns_with_their_sense() {
        let p = |x, y| Point::new(x, y);
        let square = [p(0.0, 0.0), p(4.0, 0.0), p(4.0, 4.0), p(0.0, 4.0)];
        let twice: Vec<Point> = square.iter().chain(&square).copied().collect();
        let back: Vec<Point> = square.iter().rev().copied().collect();
        for (ring, want) in [(&square[..], 1), (&twice, 2), (&back, -1)] {
            assert_eq!(winding(ring, p(2.0, 2.0)), want);
            assert_eq!(winding(ring, p(5.0, 4.0)), 0);
            assert_eq!(winding(ring, p(2.0, -1.0)), 0);
        }
        assert!((double_area(&square) - 32.0).abs() < 1e-12);
    }
}
