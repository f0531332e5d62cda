//! Zones grown exactly: outlines of lines and true arcs (D2.7 §2.3.1).
//!
//! D2.7 grows by at least the turn radius and then turns the outline into a polygon,
//! which throws away what the radius was for: round arcs of the turn radius a taut path
//! can be flown as it is. Here the outline keeps its arcs. Boundary candidates are the
//! edges moved outward and an arc round every convex corner; they are cut where they
//! meet, what keeps its distance from all zones stays, and the ends are joined. Every
//! piece is then measured against the zones as given, and each zone must be enclosed.

mod parts;

use super::boxes::{Bounds, overlaps_between, sort};
use super::certificate::Unproven;
use super::raw::Source;
use super::shape::{Shape, double_area, small, winding};
use super::{Grown, Growth, OffsetError, Repair, Zone, clusters, grow, shape};
use crate::distance::arc_to_edge_m;
use crate::frame::{Point, Vector};
use crate::math::{PI, atan2, sin_cos, wrap_tau};
use crate::polygon::line_to_line_m;
use parts::{Candidate, candidates, join};

/// Added to the radius, metres, so that rounding has room.
const MARGIN_M: f64 = 1e-6;

/// Zones that touch are first united in an outline this far out, metres; if that does
/// not help, in the next.
const UNITED_M: [f64; 4] = [0.0, 1e-3, 4e-3, 1.6e-2];

/// That outline is coarse, at most this share farther out: few corners of its own.
const UNITED_OVERSHOOT: f64 = 0.08;

/// Inward corners of that outline shallower than this share of it are filled: they
/// come from its jitter, and arcs round them would nearly touch.
const SHALLOW_SHARE: f64 = 0.2;

/// Chords of an arc that stand for it where only sides matter.
const CHORD_RAD: f64 = PI / 4.0;

/// A piece of an outline, the grown zone on its left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Piece {
    /// A straight line.
    Line {
        /// Where it begins.
        from: Point,
        /// Where it ends.
        to: Point,
    },
    /// An arc, counter-clockwise, of the outline's radius.
    Arc {
        /// Its centre, a corner of a zone.
        centre: Point,
        /// Where it begins.
        from: Point,
        /// Where it ends.
        to: Point,
    },
}

impl Piece {
    /// Where it begins.
    #[must_use]
    pub fn from(&self) -> Point {
        match *self {
            Self::Line { from, .. } | Self::Arc { from, .. } => from,
        }
    }

    /// Where it ends.
    #[must_use]
    pub fn to(&self) -> Point {
        match *self {
            Self::Line { to, .. } | Self::Arc { to, .. } => to,
        }
    }

    /// By how much it turns, radians, from 0 to 2π.
    #[must_use]
    pub fn turn_rad(&self) -> f64 {
        match *self {
            Self::Line { .. } => 0.0,
            Self::Arc { centre, from, to } => turn_rad(from - centre, to - centre),
        }
    }

    /// A point at a share of the way, 0 to 1.
    #[must_use]
    pub fn at(&self, share: f64) -> Point {
        match *self {
            Self::Line { from, to } => from + (to - from) * share,
            Self::Arc { centre, from, .. } => {
                centre + turned(from - centre, self.turn_rad() * share)
            }
        }
    }
}

/// A region with holes, bounded by lines and arcs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ArcRegion {
    /// The outer boundary, counter-clockwise.
    pub outer: Vec<Piece>,
    /// The boundaries of the holes, clockwise; their arcs still turn left.
    pub holes: Vec<Vec<Piece>>,
}

impl ArcRegion {
    /// The boundaries, outer first.
    pub fn loops(&self) -> impl Iterator<Item = &[Piece]> {
        core::iter::once(self.outer.as_slice()).chain(self.holes.iter().map(Vec::as_slice))
    }

    /// Area without the holes, square metres.
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        self.loops().map(area_m2).sum()
    }
}

/// Zones grown exactly, with the proof that nothing nearer is outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ArcGrown {
    /// The regions; no two overlap.
    pub regions: Vec<ArcRegion>,
    /// Radius of every arc, metres: the one asked for and a micrometre.
    pub radius_m: f64,
    /// What was put right in the zones.
    pub repairs: Vec<Repair>,
    /// The least distance from an outline to a zone, metres: at least the radius, and
    /// infinite without zones.
    pub least_distance_m: f64,
    /// How far at most touching zones were grown before, metres.
    pub united_m: f64,
}

/// Grows zones exactly and unites what overlaps.
///
/// Zones that touch or cross, themselves or each other, are first united in an
/// outline at most [`ArcGrown::united_m`] farther out.
///
/// # Errors
/// [`OffsetError`] names the zone and the vertex; a radius of 0 has no arcs and is
/// refused.
///
/// # Complexity
/// O(n²) comparisons of boxes for n edges that lie near each other.
pub fn grow_exact(zones: &[Zone], radius_m: f64) -> Result<ArcGrown, OffsetError> {
    let growth = Growth::new(radius_m)?;
    if radius_m <= 0.0 {
        return Err(OffsetError::Radius(radius_m));
    }
    let mut grown = ArcGrown {
        radius_m: radius_m + MARGIN_M,
        least_distance_m: f64::INFINITY,
        ..ArcGrown::default()
    };
    let shapes = zones
        .iter()
        .enumerate()
        .map(|(i, z)| Shape::new(i, z, &mut grown.repairs))
        .collect::<Result<Vec<_>, _>>()?;
    let farthest_m = super::last_reach(&growth).farthest_m() + 2.0 * UNITED_M[UNITED_M.len() - 1];
    for cluster in clusters(&shapes, farthest_m) {
        grow_cluster(zones, &cluster, radius_m, &mut grown)?;
    }
    Ok(grown)
}

fn grow_cluster(
    zones: &[Zone],
    cluster: &[&Shape],
    radius_m: f64,
    grown: &mut ArcGrown,
) -> Result<(), OffsetError> {
    let mut failed = Unproven(Source {
        zone: cluster[0].zone,
        ring: 0,
        vertex: 0,
    });
    for mut united_m in UNITED_M {
        let united;
        let shapes: Vec<&Shape> = if united_m > 0.0 {
            let members: Vec<Zone> = cluster
                .iter()
                .map(|s| zones[s.zone as usize].clone())
                .collect();
            // The same zones in one outline; where they cannot be, the place is theirs.
            let outline =
                grow(&members, &Growth::new(united_m)?).map_err(|e| in_cluster(e, cluster))?;
            united = simple_shapes(&outline, SHALLOW_SHARE * united_m)?;
            united_m =
                (united_m + 2.0 * outline.margin_m) * (1.0 + UNITED_OVERSHOOT + SHALLOW_SHARE);
            united.iter().collect()
        } else {
            cluster.to_vec()
        };
        let loops = join(&candidates(&shapes, grown.radius_m));
        let Some(loops) = loops else { continue };
        match prove(cluster, &loops, radius_m) {
            Ok(least_m) => {
                grown.least_distance_m = grown.least_distance_m.min(least_m);
                grown.united_m = grown.united_m.max(united_m);
                nest(loops, &mut grown.regions);
                return Ok(());
            }
            Err(u) => failed = u,
        }
    }
    let s = failed.0;
    Err(OffsetError::Unproven(shape::place(
        s.zone, s.ring, s.vertex,
    )))
}

fn simple_shapes(outline: &Grown, shallow_m: f64) -> Result<Vec<Shape>, OffsetError> {
    let mut ignored = Vec::new();
    outline
        .regions
        .iter()
        .enumerate()
        .map(|(i, r)| {
            let zone = Zone {
                outer: filled(&r.outer, shallow_m),
                holes: r.holes.iter().map(|h| filled(h, shallow_m)).collect(),
            };
            Shape::new(i, &zone, &mut ignored)
        })
        .collect()
}

/// A ring with the zone on its left without its shallow inward corners.
fn filled(ring: &[Point], shallow_m: f64) -> Vec<Point> {
    let mut out = ring.to_vec();
    // To fill one corner may make its neighbours inward ones, hence the repetition;
    // it ends because every round but the last drops a corner.
    loop {
        let before = out.len();
        fill(&mut out, shallow_m);
        if out.len() == before {
            return out;
        }
    }
}

/// Drops shallow inward corners once around, down to three.
fn fill(ring: &mut Vec<Point>, shallow_m: f64) {
    let mut i = 0;
    while i < ring.len() && ring.len() > 3 {
        let n = ring.len();
        let (a, b, c) = (ring[(i + n - 1) % n], ring[i], ring[(i + 1) % n]);
        let along = c - a;
        let height_m = along.perp(&(b - a)) / along.norm().max(shallow_m);
        if (0.0..shallow_m).contains(&height_m) {
            ring.remove(i);
        } else {
            i += 1;
        }
    }
}

/// The error with the number that the zone has in the caller's list.
fn in_cluster(error: OffsetError, cluster: &[&Shape]) -> OffsetError {
    match error {
        OffsetError::Unproven(mut at) => {
            at.zone = cluster.get(at.zone).map_or(at.zone, |s| s.zone as usize);
            OffsetError::Unproven(at)
        }
        other => other,
    }
}

/// The least distance from the loops to the shapes, if it is enough and each shape is
/// enclosed once.
fn prove(shapes: &[&Shape], loops: &[Vec<Piece>], radius_m: f64) -> Result<f64, Unproven> {
    let pieces: Vec<Piece> = loops.iter().flatten().copied().collect();
    let arc_m = radius_m + MARGIN_M;
    let mut boxes: Vec<Bounds> = pieces
        .iter()
        .enumerate()
        .map(|(i, &piece)| {
            let turn_rad = piece.turn_rad();
            Candidate { piece, turn_rad }.bounds(small(i), arc_m)
        })
        .collect();
    sort(&mut boxes);
    let mut least = f64::INFINITY;
    for s in shapes {
        for r in &s.rings {
            let edges: Vec<(Point, Point)> = r.edges().collect();
            let mut near: Vec<Bounds> = edges
                .iter()
                .enumerate()
                .map(|(i, e)| Bounds::of(e.0, e.1, small(i)).grown(arc_m + MARGIN_M))
                .collect();
            sort(&mut near);
            overlaps_between(&near, &boxes, |e, p| {
                let (a, b) = edges[e.id as usize];
                let d = match pieces[p.id as usize] {
                    Piece::Line { from, to } => line_to_line_m(from, to, a, b),
                    Piece::Arc { centre, from, to } => {
                        arc_to_edge_m(centre, arc_m, [from, to], a, b)
                    }
                };
                least = least.min(d);
                if d >= radius_m {
                    Ok(())
                } else {
                    Err(Unproven(Source {
                        zone: s.zone,
                        ring: r.number,
                        vertex: r.origin[e.id as usize],
                    }))
                }
            })?;
        }
    }
    let sides: Vec<Vec<Point>> = loops.iter().map(|r| chords(r)).collect();
    for s in shapes {
        let p = s.rings[0].points[0];
        let inside = sides.iter().any(|r| s.contains(r[0]));
        if inside || sides.iter().map(|r| winding(r, p)).sum::<i32>() != 1 {
            return Err(Unproven(Source {
                zone: s.zone,
                ring: 0,
                vertex: s.rings[0].origin[0],
            }));
        }
    }
    Ok(least)
}

fn nest(loops: Vec<Vec<Piece>>, regions: &mut Vec<ArcRegion>) {
    let first = regions.len();
    let mut holes = Vec::new();
    for pieces in loops {
        if area_m2(&pieces) > 0.0 {
            regions.push(ArcRegion {
                outer: pieces,
                holes: Vec::new(),
            });
        } else {
            holes.push(pieces);
        }
    }
    for hole in holes {
        let at = hole[0].from();
        let around = (first..regions.len())
            .filter(|&i| winding(&chords(&regions[i].outer), at) != 0)
            .min_by(|&i, &j| area_m2(&regions[i].outer).total_cmp(&area_m2(&regions[j].outer)));
        if let Some(i) = around {
            regions[i].holes.push(hole);
        }
    }
}

/// The loop as a polygon with several chords an arc.
fn chords(pieces: &[Piece]) -> Vec<Point> {
    let mut ring = Vec::with_capacity(pieces.len());
    for p in pieces {
        let turn = p.turn_rad();
        let mut done = 0.0;
        while done <= 0.0 || done < turn {
            ring.push(p.at(if turn > 0.0 { done / turn } else { 0.0 }));
            done += CHORD_RAD;
        }
    }
    ring
}

/// Signed area of a loop, counter-clockwise positive.
fn area_m2(pieces: &[Piece]) -> f64 {
    let corners: Vec<Point> = pieces.iter().map(Piece::from).collect();
    let caps: f64 = pieces
        .iter()
        .map(|p| match p {
            Piece::Line { .. } => 0.0,
            Piece::Arc { centre, from, .. } => {
                let turn = p.turn_rad();
                (from - centre).norm_squared() * (turn - sin_cos(turn).0)
            }
        })
        .sum();
    (double_area(&corners) + caps) / 2.0
}

/// The angle from `a` to `b`, counter-clockwise, in [0, 2π).
fn turn_rad(a: Vector, b: Vector) -> f64 {
    wrap_tau(atan2(a.perp(&b), a.dot(&b)))
}

fn turned(v: Vector, by_rad: f64) -> Vector {
    let (s, c) = sin_cos(by_rad);
    Vector::new(c * v.x - s * v.y, s * v.x + c * v.y)
}

#[cfg(test)]
mod tests;
