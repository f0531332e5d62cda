//! No-fly zones grown by a safety radius: circumscribed, united, proved (D2.7 §2.3.1).
//!
//! [`grow`] takes zones as map data has them and returns disjoint simple regions with
//! holes that contain the exact Minkowski sum of the zones with a disc. Arcs become
//! tangent polygons, so the outline is never nearer than the radius; a certificate
//! checks that for every answer and nothing is handed out without it. [`grow_exact`]
//! keeps the arcs, for routes that turn with the radius itself. Curves are
//! measured against the zones as they are in [`super::clearance`].
//!
//! # Guarantees
//! Every point nearer than `radius_m` to a zone is inside a region. No vertex of a
//! region is farther from all zones than `radius_m / cos(step_rad / 2)` and the margin
//! of the attempt, between two micrometres and 8.2 mm (see [`Grown::margin_m`]).
//!
//! # Complexity
//! O(n log n) and the pairs of edges whose boxes overlap, for n vertices.

mod arcs;
mod arrangement;
mod boxes;
mod certificate;
mod layers;
mod raw;
mod shape;

#[cfg(test)]
mod tests;

pub use arcs::{ArcGrown, ArcRegion, Piece, grow_exact};
pub use layers::{LayeredZone, at_level};

use super::Polygon;
use crate::frame::Point;
use crate::math::{PI, acos};
use arrangement::Loops;
use boxes::{Bounds, overlaps, sort};
use raw::{Raw, Reach, Source};
use shape::{Shape, double_area, small, winding};
use thiserror::Error;

/// The turn of one tangent piece of an arc: outlines overshoot by at most 0.49 % of
/// the radius, and a full circle has 32 corners.
pub const DEFAULT_STEP_RAD: f64 = PI / 16.0;

/// The smallest and the largest turn of a piece that [`Growth::new`] takes: 6,283
/// corners a circle, and four.
const STEPS_RAD: (f64, f64) = (1e-3, PI / 2.0);

/// The largest radius, metres: a mission's, so that sums stay far from overflow.
pub const MAX_RADIUS_M: f64 = 20_000.0;

/// What the first attempt adds to the radius, metres: ten thousand units in the last
/// place of the largest coordinate, so that pieces cross where they seem to.
const FIRST_MARGIN_M: f64 = 1e-6;

/// How much larger the margin is at every further attempt.
const MARGIN_FACTOR: f64 = 8.0;

/// Attempts before a zone is refused: the last one adds 4.1 mm to the radius. One in
/// ten thousand outlines needs a second, none yet a fourth.
const ATTEMPTS: u32 = 5;

/// The boundary is traced with edges no shorter than this share of the margin; what
/// the merged vertices move is within the margin.
const MERGE_SHARE: f64 = 0.05;

/// Neighbouring edges are looked at together up to this size, in radii: half a circle
/// is two wide and one high.
const CHAIN_RADII: f64 = 3.0;

/// A zone as it is drawn: any winding, closed or not.
///
/// Inside is whatever the outer ring winds round in either sense and no hole does, so
/// a ring that crosses itself keeps all of its lobes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Zone {
    /// The outer ring, metres.
    pub outer: Vec<Point>,
    /// Rings round what is free inside, metres.
    pub holes: Vec<Vec<Point>>,
}

impl From<&Polygon> for Zone {
    fn from(polygon: &Polygon) -> Self {
        Self {
            outer: polygon.vertices().to_vec(),
            holes: Vec::new(),
        }
    }
}

/// How far zones grow, and how finely their round corners are cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    radius_m: f64,
    step_rad: f64,
}

impl Growth {
    /// Grows by `radius_m` with the usual step.
    ///
    /// # Errors
    /// [`OffsetError::Radius`] unless the radius is from 0 to [`MAX_RADIUS_M`].
    pub fn new(radius_m: f64) -> Result<Self, OffsetError> {
        if (0.0..=MAX_RADIUS_M).contains(&radius_m) {
            Ok(Self {
                radius_m,
                step_rad: DEFAULT_STEP_RAD,
            })
        } else {
            Err(OffsetError::Radius(radius_m))
        }
    }

    /// The same growth with outlines at most this share of the radius too far out.
    ///
    /// # Errors
    /// [`OffsetError::Overshoot`] unless the share is from 0.000000125 to 0.414.
    pub fn with_overshoot(self, share: f64) -> Result<Self, OffsetError> {
        let step_rad = 2.0 * acos(1.0 / (1.0 + share));
        if share > 0.0 && (STEPS_RAD.0..=STEPS_RAD.1).contains(&step_rad) {
            Ok(Self { step_rad, ..self })
        } else {
            Err(OffsetError::Overshoot(share))
        }
    }

    /// The radius, metres.
    #[must_use]
    pub fn radius_m(&self) -> f64 {
        self.radius_m
    }

    /// The largest turn of one tangent piece, radians.
    #[must_use]
    pub fn step_rad(&self) -> f64 {
        self.step_rad
    }
}

/// A vertex of the caller's zones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Index of the zone.
    pub zone: usize,
    /// 0 for the outer ring, then the holes from 1.
    pub ring: usize,
    /// Index of the vertex in that ring as given.
    pub vertex: usize,
}

impl core::fmt::Display for Place {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "zone {}, ", self.zone)?;
        if self.ring > 0 {
            write!(f, "hole {}, ", self.ring - 1)?;
        }
        write!(f, "vertex {}", self.vertex)
    }
}

/// Something of a zone that was put right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Repair {
    /// Where.
    pub place: Place,
    /// What.
    pub kind: RepairKind,
}

/// The repairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RepairKind {
    /// A vertex equal to the one before it was dropped.
    RepeatedVertex,
    /// The zone encloses nothing; it was grown as the line it is.
    NoArea,
    /// The hole encloses nothing; it was filled.
    HoleWithoutArea,
    /// The ring crosses or touches itself, or a hole its outer ring; all that is
    /// wound round counts as zone.
    NotSimple,
}

/// Why zones were not grown.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum OffsetError {
    /// A coordinate is NaN or infinite.
    #[error("{0} is not a finite number")]
    NotFinite(Place),
    /// A coordinate is larger than any mission.
    #[error("{0} lies farther from the origin than any mission reaches")]
    TooFar(Place),
    /// A ring has fewer than three distinct vertices.
    #[error("zone {zone} has {found} distinct vertices; at least 3 make an area")]
    TooFewVertices {
        /// Index of the zone.
        zone: usize,
        /// Distinct vertices found.
        found: usize,
    },
    /// The radius is negative, too large or no number.
    #[error("a safety radius of {0} m is not between 0 and {MAX_RADIUS_M} m")]
    Radius(f64),
    /// The overshoot is out of its range.
    #[error("an overshoot of {0} times the radius is not between 1.25e-7 and 0.414")]
    Overshoot(f64),
    /// No attempt gave an outline that could be proved to contain the grown zones.
    #[error("no outline round {0} could be proved; the zone is not grown")]
    Unproven(Place),
}

/// A simple region with simple holes in it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Region {
    /// The outer ring, counter-clockwise, the first vertex not repeated.
    pub outer: Vec<Point>,
    /// The holes, clockwise.
    pub holes: Vec<Vec<Point>>,
}

impl Region {
    /// Area without the holes, square metres.
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        let holes: f64 = self.holes.iter().map(|h| double_area(h)).sum();
        (double_area(&self.outer) + holes) / 2.0
    }

    /// Whether `p` is inside; a point on the border may count either way.
    #[must_use]
    pub fn contains(&self, p: Point) -> bool {
        winding(&self.outer, p) != 0 && self.holes.iter().all(|h| winding(h, p) == 0)
    }

    /// The rings, outer first.
    pub fn rings(&self) -> impl Iterator<Item = &[Point]> {
        core::iter::once(self.outer.as_slice()).chain(self.holes.iter().map(Vec::as_slice))
    }
}

/// Grown zones: disjoint regions with the proof that they contain what they must.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Grown {
    /// The regions; no two touch, no ring crosses itself.
    pub regions: Vec<Region>,
    /// What was put right in the zones.
    pub repairs: Vec<Repair>,
    /// The least distance from an outline to a zone, metres: at least the radius, and
    /// infinite without zones.
    pub least_distance_m: f64,
    /// The most that any attempt added to the radius, metres.
    pub margin_m: f64,
}

impl Grown {
    /// Whether `p` is in any region.
    #[must_use]
    pub fn contains(&self, p: Point) -> bool {
        self.regions.iter().any(|r| r.contains(p))
    }

    /// The area of all regions, square metres.
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        self.regions.iter().map(Region::area_m2).sum()
    }
}

/// Grows zones and unites what overlaps.
///
/// ```
/// use skein_geometry::frame::Point;
/// use skein_geometry::offset::{Growth, Zone, grow};
///
/// let square = |x: f64| Zone {
///     outer: [(x, 0.0), (x + 100.0, 0.0), (x + 100.0, 100.0), (x, 100.0)]
///         .map(|(x, y)| Point::new(x, y))
///         .to_vec(),
///     holes: Vec::new(),
/// };
/// let grown = grow(&[square(0.0), square(150.0), square(500.0)], &Growth::new(30.0)?)?;
/// assert_eq!(grown.regions.len(), 2);
/// assert!(grown.least_distance_m >= 30.0);
/// # Ok::<(), skein_geometry::offset::OffsetError>(())
/// ```
///
/// # Errors
/// [`OffsetError`] names the zone and the vertex; nothing is grown then.
pub fn grow(zones: &[Zone], growth: &Growth) -> Result<Grown, OffsetError> {
    let mut grown = Grown {
        least_distance_m: f64::INFINITY,
        ..Grown::default()
    };
    let shapes = zones
        .iter()
        .enumerate()
        .map(|(i, z)| Shape::new(i, z, &mut grown.repairs))
        .collect::<Result<Vec<_>, _>>()?;
    for cluster in clusters(&shapes, last_reach(growth).farthest_m()) {
        grow_cluster(&cluster, growth, &mut grown)?;
    }
    Ok(grown)
}

/// The reach of one attempt.
fn reach(growth: &Growth, attempt: u32) -> Reach {
    let margin_m = (0..attempt).fold(FIRST_MARGIN_M, |m, _| m * MARGIN_FACTOR);
    Reach {
        radius_m: growth.radius_m,
        margin_m,
        step_rad: growth.step_rad,
        attempt,
    }
}

fn last_reach(growth: &Growth) -> Reach {
    reach(growth, ATTEMPTS - 1)
}

/// Groups of shapes whose grown boxes overlap, in the order of their first members.
fn clusters(shapes: &[Shape], farthest_m: f64) -> Vec<Vec<&Shape>> {
    if let [one] = shapes {
        return vec![vec![one]];
    }
    let mut boxes: Vec<Bounds> = shapes
        .iter()
        .enumerate()
        .map(|(i, s)| {
            let mut b = s.bounds.grown(farthest_m);
            b.id = small(i);
            b
        })
        .collect();
    sort(&mut boxes);
    let mut parent: Vec<usize> = (0..shapes.len()).collect();
    let done: Result<(), ()> = overlaps(&boxes, |i, j| {
        let (a, b) = (root(&mut parent, i as usize), root(&mut parent, j as usize));
        parent[a.max(b)] = a.min(b);
        Ok(())
    });
    debug_assert!(done.is_ok());
    let mut slot = vec![usize::MAX; shapes.len()];
    let mut groups: Vec<Vec<&Shape>> = Vec::new();
    for (i, s) in shapes.iter().enumerate() {
        let r = root(&mut parent, i);
        if slot[r] == usize::MAX {
            slot[r] = groups.len();
            groups.push(Vec::new());
        }
        groups[slot[r]].push(s);
    }
    groups
}

fn root(parent: &mut [usize], mut i: usize) -> usize {
    while parent[i] != i {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    i
}

fn grow_cluster(shapes: &[&Shape], growth: &Growth, grown: &mut Grown) -> Result<(), OffsetError> {
    let mut by_edge: Vec<bool> = shapes.iter().map(|s| s.flat).collect();
    let mut at = None;
    for attempt in 0..ATTEMPTS {
        let reach = reach(growth, attempt);
        match outline(shapes, &by_edge, &reach) {
            Ok((loops, least_m)) => {
                grown.least_distance_m = grown.least_distance_m.min(least_m);
                grown.margin_m = grown.margin_m.max(2.0 * reach.margin_m);
                nest(&loops, &mut grown.regions);
                return Ok(());
            }
            // Where pieces met by chance, another margin may be enough.
            Err(Failure {
                by_chance: true, ..
            }) if attempt == 0 => {}
            Err(failure) => {
                at = Some(failure.at);
                edge_by_edge(shapes, &mut by_edge, failure.at, &mut grown.repairs);
            }
        }
    }
    let at = at.map_or(shape::place(shapes[0].zone, 0, 0), |s| {
        shape::place(s.zone, s.ring, s.vertex)
    });
    Err(OffsetError::Unproven(at))
}

/// Chooses what is grown edge by edge next: right for every ring, but slower. First
/// the zones that are not simple, then the one that failed, then all.
fn edge_by_edge(
    shapes: &[&Shape],
    by_edge: &mut [bool],
    failed: Source,
    repairs: &mut Vec<Repair>,
) {
    let before = by_edge.iter().filter(|e| **e).count();
    for (mode, s) in by_edge.iter_mut().zip(shapes) {
        if !*mode && !certificate::is_simple(s) {
            *mode = true;
            repairs.push(Repair {
                place: shape::place(s.zone, 0, 0),
                kind: RepairKind::NotSimple,
            });
        }
    }
    if by_edge.iter().filter(|e| **e).count() > before {
        return;
    }
    let blamed = shapes.iter().position(|s| s.zone == failed.zone);
    match blamed {
        Some(i) if !by_edge[i] => by_edge[i] = true,
        _ => by_edge.fill(true),
    }
}

/// Why one attempt gave nothing.
struct Failure {
    at: Source,
    /// Pieces met without crossing, which the next margin may well undo.
    by_chance: bool,
}

fn outline(shapes: &[&Shape], by_edge: &[bool], reach: &Reach) -> Result<(Loops, f64), Failure> {
    let mut raw = Raw::default();
    let chain_m = CHAIN_RADII * reach.radius_m;
    for (s, &by_edge) in shapes.iter().zip(by_edge) {
        for ring in &s.rings {
            if by_edge {
                raw.capsules(s.zone, ring, reach);
            } else {
                raw.convolve(s.zone, ring, reach);
            }
        }
    }
    let mut loops = arrangement::positive_region(&raw, chain_m, MERGE_SHARE * reach.margin_m)
        .map_err(|d| Failure {
            at: d.0,
            by_chance: true,
        })?;
    let least_m =
        certificate::prove(shapes, &mut loops, reach.radius_m, chain_m).map_err(|u| Failure {
            at: u.0,
            by_chance: false,
        })?;
    Ok((loops, least_m))
}

/// Sorts loops into outer rings and the holes in them.
fn nest(loops: &Loops, regions: &mut Vec<Region>) {
    let first = regions.len();
    let mut sizes = Vec::new();
    let mut holes = Vec::new();
    for ring in loops.iter() {
        let size = double_area(ring);
        if size > 0.0 {
            sizes.push(size);
            regions.push(Region {
                outer: ring.to_vec(),
                holes: Vec::new(),
            });
        } else {
            holes.push(ring);
        }
    }
    for hole in holes {
        // The smallest ring around it; loops do not touch, so any vertex will do.
        let around = (0..sizes.len())
            .filter(|&i| winding(&regions[first + i].outer, hole[0]) != 0)
            .min_by(|&i, &j| sizes[i].total_cmp(&sizes[j]));
        if let Some(i) = around {
            regions[first + i].holes.push(hole.to_vec());
        }
    }
}
