//! The proof that a grown outline contains every point nearer to its zones than the
//! radius (D2.7 §2.3.1).
//!
//! Nothing here trusts how the loops came about. Every edge of theirs keeps at least
//! the radius from every edge of the zones, no loop lies in a zone, and of each zone
//! one point is inside. The points nearer than the radius to a zone are connected and
//! meet no loop, so with that one point all of them are inside.

use super::arrangement::Loops;
use super::boxes::{Bounds, Chains, sort};
use super::raw::Source;
use super::shape::{Shape, double_area, small, winding};
use crate::frame::Point;
use crate::polygon::{segments_meet, side};

/// Distances are computed to a part in 10¹² of the lengths involved; this much on top
/// of the radius makes up for it, metres.
const ROUNDING_M: f64 = 1e-9;

/// Turns above this share of their two products have the sign they seem to have: some
/// thirty times the bound of the exact predicates' own first stage.
const CLEAR_TURN: f64 = 1e-14;

/// What is wrong with an outline, and at which vertex of which zone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Unproven(pub(super) Source);

/// Drops loops that lie inside a zone or bound no free space, and proves the rest.
/// Returns the least distance between the loops and the zones, metres.
///
/// # Errors
/// [`Unproven`] when an edge comes too near, loops touch, or a zone is not enclosed.
pub(super) fn prove(
    shapes: &[&Shape],
    loops: &mut Loops,
    radius_m: f64,
    chain_m: f64,
) -> Result<f64, Unproven> {
    keep(loops, |ring| !shapes.iter().any(|s| s.contains(ring[0])));
    let mut outline = Outline::of(loops, chain_m);
    let mut least = distances(shapes, &outline, radius_m)?;
    if least.too_near.iter().any(|&n| n) {
        // Where a disc surrounds a whole hole, the windings of the two rings cancel
        // and leave a loop with nothing free behind it. To fill it is safe.
        let mut number = 0;
        keep(loops, |ring| {
            number += 1;
            !(least.too_near[number - 1] && double_area(ring) < 0.0)
        });
        outline = Outline::of(loops, chain_m);
        least = distances(shapes, &outline, radius_m)?;
        if let Some(place) = least.place {
            return Err(Unproven(place));
        }
    }
    simple(&outline).map_err(|()| Unproven(first_of(shapes[0])))?;
    for s in shapes {
        let p = s.rings[0].points[0];
        if loops.iter().map(|r| winding(r, p)).sum::<i32>() != 1 {
            return Err(Unproven(first_of(s)));
        }
    }
    Ok(least.least_m)
}

fn first_of(shape: &Shape) -> Source {
    Source {
        zone: shape.zone,
        ring: 0,
        vertex: shape.rings[0].origin[0],
    }
}

/// Keeps the loops that `good` approves of, asked once each in order.
fn keep(loops: &mut Loops, mut good: impl FnMut(&[Point]) -> bool) {
    let mut kept = Loops::default();
    let mut all = true;
    for ring in loops.iter() {
        if good(ring) {
            kept.points.extend_from_slice(ring);
            kept.ends.push(kept.points.len());
        } else {
            all = false;
        }
    }
    if !all {
        *loops = kept;
    }
}

/// The edges of all loops.
struct Outline {
    chains: Chains,
    edges: Vec<Edge>,
}

#[derive(Clone, Copy)]
struct Edge {
    a: Point,
    b: Point,
    ring: u32,
    /// The number of the edge that follows in its loop.
    next: u32,
}

impl Outline {
    fn of(loops: &Loops, chain_m: f64) -> Self {
        let mut edges: Vec<Edge> = Vec::with_capacity(loops.points.len());
        let mut first = 0;
        for (ring, points) in loops.iter().enumerate() {
            let n = points.len();
            edges.extend((0..n).map(|i| Edge {
                a: points[i],
                b: points[(i + 1) % n],
                ring: small(ring),
                next: small(first + (i + 1) % n),
            }));
            first += n;
        }
        let chains = Chains::new(&loops.points, &loops.ends, chain_m);
        Self { chains, edges }
    }
}

struct Distances {
    least_m: f64,
    /// For each loop whether one of its edges is nearer than the radius.
    too_near: Vec<bool>,
    /// A vertex of a zone that an edge comes too near to.
    place: Option<Source>,
}

fn distances(shapes: &[&Shape], outline: &Outline, radius_m: f64) -> Result<Distances, Unproven> {
    let rings = outline.edges.last().map_or(0, |e| e.ring as usize + 1);
    if rings == 0 {
        return Err(Unproven(first_of(shapes[0])));
    }
    let enough = (radius_m + ROUNDING_M) * (radius_m + ROUNDING_M) * (1.0 + 1e-12);
    let mut found = Distances {
        least_m: f64::INFINITY,
        too_near: vec![false; rings],
        place: None,
    };
    let mut square = f64::INFINITY;
    for s in shapes {
        for r in &s.rings {
            let edges: Vec<(Point, Point)> = r.edges().collect();
            let mut near: Vec<Bounds> = edges
                .iter()
                .enumerate()
                // A little more than the radius, so that the tangent edges count.
                .map(|(i, e)| Bounds::of(e.0, e.1, small(i)).grown(radius_m * (1.0 + 1e-6) + 1e-4))
                .collect();
            sort(&mut near);
            let done: Result<(), ()> = outline.chains.overlaps_with(&near, |i, j| {
                let (a, b) = edges[i as usize];
                let e = outline.edges[j as usize];
                let d = gap_squared(a, b, e.a, e.b);
                square = square.min(d);
                if d < enough || meet(a, b, e.a, e.b) {
                    found.too_near[e.ring as usize] = true;
                    found.place = Some(Source {
                        zone: s.zone,
                        ring: r.number,
                        vertex: r.origin[i as usize],
                    });
                }
                Ok(())
            });
            debug_assert!(done.is_ok());
        }
    }
    found.least_m = square.sqrt();
    Ok(found)
}

/// The squared distance from the begins of two edges to the other edge: with all pairs
/// that are near each other, every end is some edge's begin.
#[inline]
fn gap_squared(a: Point, b: Point, c: Point, d: Point) -> f64 {
    from_end(c, a, b).min(from_end(a, c, d))
}

/// As [`segments_meet`], quickly for pairs that are clearly apart: then `c` and `d` are
/// on one side of the line `a b` by more than rounding can undo.
#[inline]
fn meet(a: Point, b: Point, c: Point, d: Point) -> bool {
    let along = b - a;
    let clear_side = |p: Point| {
        let to = p - a;
        let (l, r) = (along.x * to.y, along.y * to.x);
        let turn = l - r;
        if turn.abs() > CLEAR_TURN * (l.abs() + r.abs()) {
            turn.signum()
        } else {
            0.0
        }
    };
    clear_side(c) * clear_side(d) <= 0.0 && segments_meet(a, b, c, d)
}

#[inline]
fn from_end(p: Point, a: Point, b: Point) -> f64 {
    let along = b - a;
    let to = p - a;
    let square = along.norm_squared();
    let t = to.dot(&along);
    if t <= 0.0 {
        to.norm_squared()
    } else if t >= square {
        (p - b).norm_squared()
    } else {
        (to - along * (t / square)).norm_squared()
    }
}

/// Whether the rings of a shape neither touch nor cross themselves or each other.
pub(super) fn is_simple(shape: &Shape) -> bool {
    let mut rings = Loops::default();
    for r in &shape.rings {
        rings.points.extend_from_slice(&r.points);
        rings.ends.push(rings.points.len());
    }
    simple(&Outline::of(&rings, 0.0)).is_ok()
}

/// Whether no two edges have more in common than the vertex between them.
fn simple(outline: &Outline) -> Result<(), ()> {
    let edges = &outline.edges;
    outline.chains.overlaps(|i, j| {
        let (e, f) = (edges[i as usize], edges[j as usize]);
        let contact = if e.next == j {
            folds_back(e.a, e.b, f.b)
        } else if f.next == i {
            folds_back(f.a, f.b, e.b)
        } else {
            segments_meet(e.a, e.b, f.a, f.b)
        };
        if contact { Err(()) } else { Ok(()) }
    })
}

fn folds_back(from: Point, middle: Point, to: Point) -> bool {
    (from - middle).dot(&(to - middle)) > 0.0 && side(from, middle, to) == 0
}
