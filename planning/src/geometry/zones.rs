//! No-fly zones and their outward offset (D2.7 §2.3.1).

use super::Polygon;
use super::polygon::{point_segment_m, segments_meet};
use crate::frame::Point;
use crate::math::{atan2, hypot, wrap_tau};
use crate::trajectory::{Curve, Segment};
use thiserror::Error;

/// The no-fly zones of a mission at its flight level.
#[derive(Clone, Debug, PartialEq)]
pub struct NoFlyZones {
    zones: Vec<Polygon>,
}

/// Why zones cannot be used.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ZoneError {
    /// The offset of a zone could not be certified to contain the exact one.
    #[error("the offset of zone {0} could not be certified")]
    Offset(usize),
}

impl NoFlyZones {
    /// The zones as they are; they may overlap.
    #[must_use]
    pub fn new(zones: Vec<Polygon>) -> Self {
        Self { zones }
    }

    /// The zones as given.
    #[must_use]
    pub fn zones(&self) -> &[Polygon] {
        &self.zones
    }

    /// Distance from `p` to the nearest zone, metres; 0 inside, infinite without zones.
    #[must_use]
    pub fn distance_m(&self, p: Point) -> f64 {
        self.zones.iter().map(|z| z.distance_m(p)).fold(f64::INFINITY, f64::min)
    }

    /// Distance from a piece of a curve to the nearest zone, exact for lines and
    /// arcs, metres; 0 when it enters one, infinite without zones.
    #[must_use]
    pub fn segment_distance_m(&self, segment: &Segment) -> f64 {
        self.zones.iter().map(|z| piece_distance_m(z, segment)).fold(f64::INFINITY, f64::min)
    }

    /// Whether the whole curve keeps at least `clearance_m` from every zone.
    #[must_use]
    pub fn is_clear(&self, curve: &Curve, clearance_m: f64) -> bool {
        curve.segments().iter().all(|s| self.segment_distance_m(s) >= clearance_m)
    }
}

fn piece_distance_m(zone: &Polygon, s: &Segment) -> f64 {
    let (a, b) = (s.start.position(), s.end().position());
    if zone.contains(a) || zone.contains(b) {
        return 0.0;
    }
    match s.centre() {
        None => zone
            .edges()
            .map(|(c, d)| if segments_meet(a, b, c, d) { 0.0 } else { segment_segment_m(a, b, c, d) })
            .fold(f64::INFINITY, f64::min),
        Some(centre) => zone.edges().map(|(c, d)| arc_segment_m(s, centre, c, d)).fold(f64::INFINITY, f64::min),
    }
}

fn segment_segment_m(a: Point, b: Point, c: Point, d: Point) -> f64 {
    point_segment_m(a, c, d)
        .min(point_segment_m(b, c, d))
        .min(point_segment_m(c, a, b))
        .min(point_segment_m(d, a, b))
}

/// Whether the arc passes the direction of `p` from its centre.
fn on_arc(s: &Segment, centre: Point, p: Point) -> bool {
    let from = s.start.position() - centre;
    let to = p - centre;
    let swept = s.curvature_per_m * s.length_m;
    let turn = wrap_tau(atan2(to.y, to.x) - atan2(from.y, from.x));
    if swept >= 0.0 { turn <= swept } else { turn >= crate::math::TAU + swept || turn <= 0.0 }
}

fn arc_point_m(s: &Segment, centre: Point, p: Point) -> f64 {
    let r = 1.0 / s.curvature_per_m.abs();
    let ends = (p - s.start.position()).norm().min((p - s.end().position()).norm());
    if on_arc(s, centre, p) { ends.min(((p - centre).norm() - r).abs()) } else { ends }
}

/// Distance between an arc and a segment: it is reached at an end of either, at the
/// foot of the centre on the segment, or it is zero where they cross.
fn arc_segment_m(s: &Segment, centre: Point, c: Point, d: Point) -> f64 {
    let r = 1.0 / s.curvature_per_m.abs();
    let cd = d - c;
    let foot = (centre - c).dot(&cd) / cd.norm_squared();
    let h = (centre - (c + cd * foot)).norm();
    if h <= r {
        let half = (r * r - h * h).max(0.0).sqrt() / cd.norm();
        for t in [foot - half, foot + half] {
            if (0.0..=1.0).contains(&t) && on_arc(s, centre, c + cd * t) {
                return 0.0;
            }
        }
    }
    let mut best = point_segment_m(s.start.position(), c, d)
        .min(point_segment_m(s.end().position(), c, d))
        .min(arc_point_m(s, centre, c))
        .min(arc_point_m(s, centre, d));
    if (0.0..=1.0).contains(&foot) {
        let p = c + cd * foot;
        if on_arc(s, centre, p) {
            best = best.min((hypot(p.x - centre.x, p.y - centre.y) - r).abs());
        }
    }
    best
}
