//! Exact distances between pieces of curves and polygons.
//!
//! A piece is a straight line or a circular arc; an arc is nearest to an edge at
//! an end of either, at a crossing, or where the edge's normal meets the arc.

use super::Polygon;
use super::polygon::{line_to_line_m, point_to_line_m};
use crate::curve::Segment;
use crate::frame::Point;
use crate::math::{TAU, atan2, wrap_tau};

/// Turned angles below this are taken as on the arc, radians; errs towards
/// nearer, by less than a micrometre for arcs of up to a kilometre.
const ON_ARC_RAD: f64 = 1e-9;

/// Boxes are right to far less than this, metres.
const ROUNDING_M: f64 = 1e-6;

/// A piece turning less than this is a straight line to the nanometre, radians.
const STRAIGHT_RAD: f64 = 1e-9;

/// Distance from a piece, which lies in the box `around`, to a polygon, metres; 0 when it
/// touches or enters it. `limit_m` if it is no nearer than that, and any distance below
/// `enough_m` if one is found.
pub(super) fn segment_to_polygon_m(
    segment: &Segment,
    around: &(Point, Point),
    polygon: &Polygon,
    limit_m: f64,
    enough_m: f64,
) -> f64 {
    let (from, to) = (segment.start.position(), segment.end().position());
    let arc = segment
        .centre()
        .filter(|_| is_arc(segment))
        .map(|centre| Arc::new(centre, segment, from, to));
    let mut least = limit_m;
    for (a, b) in polygon.edges() {
        if is_farther(around, a, b, least) {
            continue;
        }
        least = least.min(match &arc {
            Some(arc) => arc.distance_m(a, b),
            None => line_to_line_m(from, to, a, b),
        });
        if least < enough_m {
            return least;
        }
    }
    if polygon.contains(from) { 0.0 } else { least }
}

/// Whether an edge is certainly farther from a box than `least_m`.
fn is_farther((low, high): &(Point, Point), a: Point, b: Point, least_m: f64) -> bool {
    let gap = |low: f64, high: f64, a: f64, b: f64| (a.min(b) - high).max(low - a.max(b)).max(0.0);
    let (x, y) = (gap(low.x, high.x, a.x, b.x), gap(low.y, high.y, a.y, b.y));
    let far_m = least_m + ROUNDING_M;
    x * x + y * y > far_m * far_m
}

/// Whether a piece is measured as an arc, not as a line.
pub(super) fn is_arc(segment: &Segment) -> bool {
    (segment.curvature_per_m * segment.length_m).abs() > STRAIGHT_RAD
}

/// The smallest box around a piece: south-west and north-east corners.
///
/// For arcs the box of the whole circle or of the chord grown by the length,
/// whichever is smaller: never too small, seldom much too large.
pub(super) fn segment_bounds(segment: &Segment) -> (Point, Point) {
    let (a, b) = (segment.start.position(), segment.end().position());
    let mut low = Point::new(a.x.min(b.x), a.y.min(b.y));
    let mut high = Point::new(a.x.max(b.x), a.y.max(b.y));
    if let Some(c) = segment.centre() {
        let r = 1.0 / segment.curvature_per_m.abs();
        // An arc of length s strays at most s/2 from both ends.
        let h = segment.length_m / 2.0;
        low = Point::new((low.x - h).max(c.x - r), (low.y - h).max(c.y - r));
        high = Point::new((high.x + h).min(c.x + r), (high.y + h).min(c.y + r));
    }
    (low, high)
}

/// Distance from an arc, walked counter-clockwise from the first end to the second,
/// to the edge `a b`, metres.
pub(super) fn arc_to_edge_m(
    centre: Point,
    radius_m: f64,
    ends: [Point; 2],
    a: Point,
    b: Point,
) -> f64 {
    let (v, w) = (ends[0] - centre, ends[1] - centre);
    let arc = Arc {
        centre,
        radius_m,
        begin_rad: atan2(v.y, v.x),
        turned_rad: wrap_tau(atan2(v.perp(&w), v.dot(&w))),
        ends,
    };
    arc.distance_m(a, b)
}

struct Arc {
    centre: Point,
    radius_m: f64,
    /// Angle at which the arc begins if walked counter-clockwise.
    begin_rad: f64,
    /// How far it turns, counter-clockwise, not negative.
    turned_rad: f64,
    ends: [Point; 2],
}

impl Arc {
    fn new(centre: Point, segment: &Segment, from: Point, to: Point) -> Self {
        let turned_rad = (segment.curvature_per_m * segment.length_m).abs();
        let first = if segment.curvature_per_m > 0.0 {
            from
        } else {
            to
        };
        let v = first - centre;
        Self {
            centre,
            radius_m: 1.0 / segment.curvature_per_m.abs(),
            begin_rad: atan2(v.y, v.x),
            turned_rad,
            ends: [from, to],
        }
    }

    /// Whether the point of the circle in the direction of `p` is on the arc.
    fn faces(&self, p: Point) -> bool {
        let v = p - self.centre;
        let a = wrap_tau(atan2(v.y, v.x) - self.begin_rad);
        a <= self.turned_rad + ON_ARC_RAD || a >= TAU - ON_ARC_RAD
    }

    fn distance_m(&self, a: Point, b: Point) -> f64 {
        let mut least =
            point_to_line_m(self.ends[0], a, b).min(point_to_line_m(self.ends[1], a, b));
        for p in [a, b] {
            if self.faces(p) {
                least = least.min(((p - self.centre).norm() - self.radius_m).abs());
            }
        }
        let along = b - a;
        let square = along.norm_squared();
        if square <= 0.0 {
            return least;
        }
        // The edge is a + t·along; its line passes the centre at t = foot.
        let foot = (self.centre - a).dot(&along) / square;
        let nearest = a + along * foot;
        let away = (nearest - self.centre).norm();
        if away > self.radius_m {
            if (0.0..=1.0).contains(&foot) && self.faces(nearest) {
                least = least.min(away - self.radius_m);
            }
            return least;
        }
        let half = ((self.radius_m * self.radius_m - away * away) / square).sqrt();
        for t in [foot - half, foot + half] {
            if (0.0..=1.0).contains(&t) && self.faces(a + along * t) {
                return 0.0;
            }
        }
        // Inside the circle the normal through the centre meets the arc on both sides.
        if (0.0..=1.0).contains(&foot) {
            let normal = nalgebra::Vector2::new(-along.y, along.x) / square.sqrt();
            for n in [normal, -normal] {
                let p = self.centre + n * self.radius_m;
                if self.faces(p) {
                    least = least.min(point_to_line_m(p, a, b));
                }
            }
        }
        least
    }
}
