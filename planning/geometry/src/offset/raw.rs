//! Closed curves whose windings add up to the grown zone (D2.7 §2.3.1).
//!
//! The convolution of a simple ring with a disc winds round a point as often as the
//! disc round that point meets the zone in separate pieces, so the grown zone is where
//! the winding is positive. Arcs are circumscribed: every piece is tangent to a circle
//! of at least the radius. The same holds for each edge alone, whatever its ring does;
//! such a capsule is the fallback for rings that are not simple.

use super::shape::Ring;
use crate::frame::{Point, Vector};
use crate::math::{PI, atan2, sin_cos};
use crate::random;

/// Cosine of a turn beyond which an inward corner is not mitred: near a full
/// reversal the mitre would lie far from the corner.
const SHARPEST_MITRE: f64 = -0.9;

/// Turns are split as if this much smaller, radians, so that a quarter turn is four
/// pieces of a sixteenth and not five for a rounding error.
const ANGLE_SLACK_RAD: f64 = 1e-9;

/// Where a raw vertex comes from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    pub(super) zone: u32,
    pub(super) ring: u32,
    pub(super) vertex: u32,
}

/// How to grow this time: the radius, and how much of jitter is on top of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reach {
    pub(super) radius_m: f64,
    /// Every vertex gets between one and two times this on top: no two pieces of
    /// different vertices coincide, and rounding has room.
    pub(super) margin_m: f64,
    pub(super) step_rad: f64,
    /// Changes the jitter from one attempt to the next.
    pub(super) attempt: u32,
}

/// The two outlines a vertex can be part of get jitters of their own.
const EDGES_BEHIND: u32 = 1 << 31;

impl Reach {
    /// The radius at a vertex.
    pub(super) fn at(&self, source: Source) -> f64 {
        self.radius_m + self.margin_m * (1.0 + unit(source, self.attempt))
    }

    /// The farthest any piece may lie from its zone, metres.
    pub(super) fn farthest_m(&self) -> f64 {
        let (_, c) = sin_cos(self.step_rad / 2.0);
        (self.radius_m + 2.0 * self.margin_m) / c
    }
}

/// A number in [0, 1) that depends on the place and the attempt only.
fn unit(s: Source, attempt: u32) -> f64 {
    let place = (u64::from(s.zone) << 32 | u64::from(s.vertex))
        ^ (u64::from(s.ring) << 24 | u64::from(attempt) << 56);
    random::unit(random::mix(place))
}

/// Closed polylines, one after the other.
#[derive(Debug, Default)]
pub(super) struct Raw {
    pub(super) points: Vec<Point>,
    pub(super) source: Vec<Source>,
    /// One past the last vertex of each polyline.
    pub(super) ends: Vec<usize>,
    directions: Vec<(Vector, f64)>,
}

impl Raw {
    /// Adds the convolution of a ring with a disc.
    pub(super) fn convolve(&mut self, zone: u32, ring: &Ring, reach: &Reach) {
        let n = ring.points.len();
        let mut directions = core::mem::take(&mut self.directions);
        directions.clear();
        directions.extend(ring.edges().map(|(a, b)| direction(a, b)));
        let mut before = directions[n - 1];
        for (i, &after) in directions.iter().enumerate() {
            let source = Source {
                zone,
                ring: ring.number,
                vertex: ring.origin[i],
            };
            self.corner(ring.points[i], before, after, source, reach);
            before = after;
        }
        self.directions = directions;
        self.ends.push(self.points.len());
    }

    /// Adds a capsule round every edge of a ring.
    pub(super) fn capsules(&mut self, zone: u32, ring: &Ring, reach: &Reach) {
        let n = ring.points.len();
        for i in 0..n {
            let j = (i + 1) % n;
            let (a, b) = (ring.points[i], ring.points[j]);
            let (d, _) = direction(a, b);
            let source = |vertex: usize| Source {
                zone,
                ring: ring.number,
                vertex: ring.origin[vertex],
            };
            // The capsules that meet at a vertex get different radii there.
            let mut behind = source(j);
            behind.vertex |= EDGES_BEHIND;
            self.round(b, right(d), PI, source(j), reach.at(behind), reach);
            self.round(a, -right(d), PI, source(i), reach.at(source(i)), reach);
            self.ends.push(self.points.len());
        }
    }

    fn corner(
        &mut self,
        v: Point,
        (d1, len1): (Vector, f64),
        (d2, len2): (Vector, f64),
        source: Source,
        reach: &Reach,
    ) {
        let (sine, cosine) = (d1.perp(&d2), d1.dot(&d2));
        let (n1, n2) = (right(d1), right(d2));
        // An exact reversal counts as outward: a half circle too many lies within
        // the grown zone, one too few would leave a gap.
        if sine >= 0.0 {
            let turn_rad = atan2(sine, cosine);
            if turn_rad <= reach.step_rad {
                self.push(v + (n1 + n2) * (reach.at(source) / (1.0 + cosine)), source);
            } else {
                self.round(v, n1, turn_rad, source, reach.at(source), reach);
            }
            return;
        }
        let radius_m = reach.at(source);
        if cosine > SHARPEST_MITRE {
            // The two offset edges cut each other this far from their ends. Within
            // the nearer halves the cut-off loop lies inside both edges' strips.
            let trim_m = radius_m * -sine / (1.0 + cosine);
            if trim_m <= 0.5 * len1.min(len2) {
                self.push(v + (n1 + n2) * (radius_m / (1.0 + cosine)), source);
                return;
            }
        }
        self.push(v + n1 * radius_m, source);
        self.push(v, source);
        self.push(v + n2 * radius_m, source);
    }

    /// Tangent pieces round an arc that begins at the normal `from` and turns left.
    fn round(
        &mut self,
        v: Point,
        from: Vector,
        turn_rad: f64,
        source: Source,
        radius_m: f64,
        reach: &Reach,
    ) {
        let pieces = ((turn_rad - ANGLE_SLACK_RAD) / reach.step_rad)
            .ceil()
            .max(1.0);
        let (s, c) = sin_cos(turn_rad / (2.0 * pieces));
        let mut arm = turn(from, s, c) * (radius_m / c);
        let (s2, c2) = (2.0 * s * c, c * c - s * s);
        let mut left = pieces;
        loop {
            self.push(v + arm, source);
            left -= 1.0;
            if left < 0.5 {
                return;
            }
            arm = turn(arm, s2, c2);
        }
    }

    fn push(&mut self, p: Point, source: Source) {
        self.points.push(p);
        self.source.push(source);
    }
}

fn direction(a: Point, b: Point) -> (Vector, f64) {
    let along = b - a;
    // Two divisions keep the direction when the square of a tiny edge underflows.
    let scale = along.x.abs().max(along.y.abs());
    let along = along / scale;
    let norm = along.norm();
    (along / norm, norm * scale)
}

fn right(d: Vector) -> Vector {
    Vector::new(d.y, -d.x)
}

fn turn(v: Vector, s: f64, c: f64) -> Vector {
    Vector::new(c * v.x - s * v.y, s * v.x + c * v.y)
}
