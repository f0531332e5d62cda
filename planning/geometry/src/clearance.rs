//! No-fly zones and their outward offset (D2.7 §2.3.1).
//!
//! A curve is outside the exact Minkowski sum of the zones with a disc if and only if
//! it keeps the disc's radius from them, so nothing is polygonised: every curve of a
//! plan is checked by exact distances before it is handed out.

use super::Polygon;
use super::distance::{is_arc, segment_bounds, segment_to_polygon_m};
use super::polygon::point_to_line_m;
use crate::curve::{Curve, Segment};
use crate::frame::{Point, Pose};
use crate::math::TAU;

/// The no-fly zones of a mission at its flight level.
#[derive(Clone, Debug, PartialEq)]
pub struct NoFlyZones {
    zones: Vec<Polygon>,
    boxes: Vec<(Point, Point)>,
    discs: Vec<(Point, f64)>,
}

/// Slack of [`NoFlyZones::is_clear`], metres: curves are built to touch the
/// clearance exactly, and rounding may put them a few nanometres inside.
const ROUNDING_M: f64 = 1e-6;

/// Spacing at which a curve is asked whether a loiter fits beside it, metres.
///
/// Between two samples a loiter circle moves by at most this much, a fraction
/// of the margin it keeps.
const CONTINGENCY_STEP_M: f64 = 2.0;

impl NoFlyZones {
    /// The zones as they are; they may overlap.
    #[must_use]
    pub fn new(zones: Vec<Polygon>) -> Self {
        let boxes: Vec<(Point, Point)> = zones.iter().map(Polygon::bounds).collect();
        let disc = |(zone, (low, high)): (&Polygon, &(Point, Point))| {
            let centre = low + (high - low) / 2.0;
            let farthest = |r: f64, v: &Point| r.max((v - centre).norm());
            (centre, zone.vertices().iter().fold(0.0, farthest))
        };
        let discs = zones.iter().zip(&boxes).map(disc).collect();
        Self {
            zones,
            boxes,
            discs,
        }
    }

    /// The zones as given.
    #[must_use]
    pub fn zones(&self) -> &[Polygon] {
        &self.zones
    }

    /// Distance from `p` to the nearest zone, metres; 0 inside, infinite without zones.
    #[must_use]
    pub fn distance_m(&self, p: Point) -> f64 {
        let mut least = f64::INFINITY;
        for (zone, bounds) in self.zones.iter().zip(&self.boxes) {
            let gap_m = box_gap_m(bounds, &(p, p));
            if gap_m < least {
                // Outside of its box it is outside.
                let outside = gap_m > 0.0;
                least = least.min(if outside {
                    zone.outline_distance_m(p)
                } else {
                    zone.distance_m(p)
                });
            }
        }
        least
    }

    /// Distance from a piece of a curve to the nearest zone, exact for lines and
    /// arcs, metres; 0 when it enters one, infinite without zones.
    #[must_use]
    pub fn segment_distance_m(&self, segment: &Segment) -> f64 {
        self.nearest_m(segment, f64::INFINITY)
    }

    /// Distance from `segment` to the nearest zone, or `limit_m` if none is nearer.
    fn nearest_m(&self, segment: &Segment, limit_m: f64) -> f64 {
        self.first_nearer_m(segment, limit_m, f64::NEG_INFINITY)
    }

    /// As [`NoFlyZones::nearest_m`], but any distance below `enough_m` will do.
    fn first_nearer_m(&self, segment: &Segment, limit_m: f64, enough_m: f64) -> f64 {
        let around = segment_bounds(segment);
        let reach = Reach::of(segment);
        let mut least = limit_m;
        for ((zone, bounds), disc) in self.zones.iter().zip(&self.boxes).zip(&self.discs) {
            if box_gap_m(bounds, &around) < least && reach.gap_m(disc) < least {
                least = segment_to_polygon_m(segment, &around, zone, least, enough_m);
                if least < enough_m {
                    return least;
                }
            }
        }
        least
    }

    /// Whether the whole curve keeps at least `clearance_m` from every zone.
    ///
    /// A curve with a coordinate that is no number is never clear.
    #[must_use]
    pub fn is_clear(&self, curve: &Curve, clearance_m: f64) -> bool {
        curve
            .segments()
            .iter()
            .all(|s| self.is_segment_clear(s, clearance_m))
    }

    /// As [`NoFlyZones::is_clear`], of one piece.
    #[must_use]
    pub fn is_segment_clear(&self, s: &Segment, clearance_m: f64) -> bool {
        let end = s.end();
        (end.east_m + end.north_m + s.start.east_m + s.start.north_m).is_finite()
            && self.first_nearer_m(s, clearance_m, clearance_m - ROUNDING_M)
                >= clearance_m - ROUNDING_M
    }
}

/// Whether a UAV anywhere on the curve could loiter beside it at once: one of the
/// two circles of `radius_m` that touch the curve keeps `margin_m` from the zones.
///
/// Checked at the ends of all pieces and every two metres.
#[must_use]
pub fn contingency_clear(zones: &NoFlyZones, curve: &Curve, radius_m: f64, margin_m: f64) -> bool {
    curve.segments().iter().all(|s| {
        let steps = (s.length_m / CONTINGENCY_STEP_M).ceil().max(1.0);
        let mut at = 0.0;
        while at <= steps {
            if !loiter_clear(
                zones,
                s.pose_at(s.length_m * at / steps),
                radius_m,
                margin_m,
            ) {
                return false;
            }
            at += 1.0;
        }
        true
    })
}

/// Whether the left or the right circle of `radius_m` at `pose` keeps `margin_m`.
#[must_use]
pub fn loiter_clear(zones: &NoFlyZones, pose: Pose, radius_m: f64, margin_m: f64) -> bool {
    let d = pose.direction();
    [1.0, -1.0].into_iter().any(|turn| {
        let centre = Point::new(
            pose.east_m - turn * radius_m * d.y,
            pose.north_m + turn * radius_m * d.x,
        );
        // A free disc is the cheap proof; a circle round a small zone is as good.
        if zones.distance_m(centre) >= radius_m + margin_m {
            return true;
        }
        let circle = Segment {
            start: pose,
            curvature_per_m: turn / radius_m,
            length_m: TAU * radius_m,
        };
        zones.nearest_m(&circle, margin_m) >= margin_m - ROUNDING_M
    })
}

/// What a cheap bound on a distance needs to know of a piece.
enum Reach {
    /// A straight line between two points.
    Line(Point, Point),
    /// All of an arc's circle.
    Circle(Point, f64),
}

impl Reach {
    fn of(segment: &Segment) -> Self {
        let (from, to) = (segment.start.position(), segment.end().position());
        // An arc that hardly turns is measured as a line; so it is bounded as one.
        match segment.centre() {
            Some(centre) if is_arc(segment) => {
                Self::Circle(centre, 1.0 / segment.curvature_per_m.abs())
            }
            _ => Self::Line(from, to),
        }
    }

    /// No more than the distance to anything inside a disc, metres.
    fn gap_m(&self, (centre, radius_m): &(Point, f64)) -> f64 {
        let to_centre_m = match self {
            Self::Line(a, b) => point_to_line_m(*centre, *a, *b),
            // A huge circle's own rounding must not hide a zone.
            Self::Circle(c, r) => ((centre - c).norm() - r).abs() - r * 1e-14,
        };
        to_centre_m - radius_m - ROUNDING_M
    }
}

/// Distance between two boxes, zero when they overlap, metres.
fn box_gap_m(a: &(Point, Point), b: &(Point, Point)) -> f64 {
    let dx = (a.0.x - b.1.x).max(b.0.x - a.1.x).max(0.0);
    let dy = (a.0.y - b.1.y).max(b.0.y - a.1.y).max(0.0);
    crate::math::hypot(dx, dy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{FRAC_PI_2, PI};
    use proptest::prelude::*;

    fn rectangle(x0: f64, y0: f64, x1: f64, y1: f64) -> Polygon {
        Polygon::new(vec![
            Point::new(x0, y0),
            Point::new(x1, y0),
            Point::new(x1, y1),
            Point::new(x0, y1),
        ])
        .unwrap()
    }

    fn pose(east_m: f64, north_m: f64, heading_rad: f64) -> Pose {
        Pose {
            east_m,
            north_m,
            heading_rad,
        }
    }

    #[test]
    fn an_arc_beside_over_and_around_a_square() {
        let zones = NoFlyZones::new(vec![rectangle(-1.0, -1.0, 1.0, 1.0)]);
        let arc = |from: Pose, turn: f64, radius: f64| Segment {
            start: from,
            curvature_per_m: turn / radius,
            length_m: PI * radius,
        };
        // Around: radius 5 about the centre; nearest are the corners.
        let around = arc(pose(5.0, 0.0, FRAC_PI_2), 1.0, 5.0);
        assert!((zones.segment_distance_m(&around) - (5.0 - 2.0f64.sqrt())).abs() < 1e-9);
        // Beside: the crown of the half circle faces the south edge.
        let beside = arc(pose(2.0, -8.0, FRAC_PI_2), 1.0, 2.0);
        assert!((zones.segment_distance_m(&beside) - 5.0).abs() < 1e-9);
        let through = arc(pose(2.0, 0.0, FRAC_PI_2), 1.0, 1.0);
        assert!(zones.segment_distance_m(&through) < 1e-12);
        assert!(
            NoFlyZones::new(vec![])
                .segment_distance_m(&through)
                .is_infinite()
        );
    }

    #[test]
    fn a_loiter_needs_one_free_side() {
        let wall = NoFlyZones::new(vec![rectangle(0.0, 10.0, 400.0, 20.0)]);
        let along = Curve::from_pieces(pose(0.0, 0.0, 0.0), &[(0.0, 400.0)]);
        assert!(contingency_clear(&wall, &along, 23.0, 5.0));
        let street = NoFlyZones::new(vec![
            rectangle(0.0, 10.0, 400.0, 20.0),
            rectangle(0.0, -20.0, 400.0, -10.0),
        ]);
        assert!(!contingency_clear(&street, &along, 23.0, 5.0));
        assert!(contingency_clear(&street, &along, 4.0, 2.0));
    }

    proptest! {
        #[test]
        fn piece_distances_agree_with_dense_samples(
            x in -40.0f64..40.0, y in -40.0f64..40.0, h in -4.0f64..4.0,
            k in -0.4f64..0.4, length in 0.5f64..60.0,
            w in 1.0f64..30.0, tall in 1.0f64..30.0,
        ) {
            let zones = NoFlyZones::new(vec![rectangle(0.0, 0.0, w, tall), rectangle(-30.0, -30.0, -20.0, -25.0)]);
            for curvature_per_m in [k, 0.0] {
                let s = Segment { start: pose(x, y, h), curvature_per_m, length_m: length };
                let exact = zones.segment_distance_m(&s);
                let n = 2000;
                let sampled = (0..=n)
                    .map(|i| zones.distance_m(s.pose_at(length * f64::from(i) / f64::from(n)).position()))
                    .fold(f64::INFINITY, f64::min);
                // A sample is never nearer, and at most half a step farther.
                prop_assert!(exact <= sampled + 1e-6, "{exact} {sampled}");
                prop_assert!(sampled <= exact + length / f64::from(n), "{exact} {sampled}");
                let c = Curve::from_pieces(s.start, &[(curvature_per_m, length)]);
                prop_assert!(zones.is_clear(&c, exact) && !zones.is_clear(&c, exact + 1e-3));
            }
        }
    }
}
