//! Waypoints of a turn: an autopilot flies straight from one to the next.
//!
//! # Guarantees
//! Where one of the ways tried here keeps the clearance, so do the straight legs that are
//! written. The chords of an arc lie on its inner side, the legs that touch it on its outer
//! one; the more there are, the nearer both are to the arc, which is proved clear.

use skein_geometry::Segment;
use skein_geometry::frame::Point;
use skein_geometry::math::PI;
use skein_survey::flown::Airspace;

/// The most that an arc turns between two waypoints, radians: its chord is within 3.4 % of
/// the radius then.
const MOST_TURN_RAD: f64 = PI / 6.0;

/// The most waypoints of one arc, so that no curve is endless.
const MOST_ON_ARC: f64 = 1_000.0;

/// So many times are the legs halved where they are not clear: to a 256th of what the longest
/// may leave the arc by, 3 mm on a radius of 25 m.
const HALVINGS: u32 = 4;

/// Whether straight legs from one to the next keep clear.
fn keeps(air: &Airspace, from: Point, way: &[Point]) -> bool {
    let starts = std::iter::once(&from).chain(way);
    starts
        .zip(way)
        .map(|(a, b)| Segment::straight(*a, *b))
        .all(|leg| air.zones().is_segment_clear(&leg, air.clearance_m()))
}

/// Points of a piece without its beginning, up to its end, and whether straight legs between
/// them are clear.
pub(super) fn waypoints(piece: &Segment, air: Option<&Airspace>) -> (Vec<Point>, bool) {
    let turned_rad = piece.curvature_per_m.abs() * piece.length_m;
    // A hair less than a whole number of steps is that number.
    let parts = (turned_rad / MOST_TURN_RAD - 1e-9).ceil();
    let parts = if turned_rad.is_finite() {
        parts.clamp(1.0, MOST_ON_ARC)
    } else {
        1.0
    };
    let chords = on_circle(piece, parts);
    let Some(air) = air else {
        return (chords, true);
    };
    let is_clear = |way: &Vec<Point>| keeps(air, piece.start.position(), way);
    if is_clear(&chords) {
        return (chords, true);
    }
    let mut others = (0..=HALVINGS)
        .filter(|_| turned_rad.is_finite() && turned_rad > 0.0)
        .map(|halvings| (parts * f64::from(1_u32 << halvings)).min(MOST_ON_ARC))
        .flat_map(|finer| [touching(piece, finer), on_circle(piece, finer)]);
    match others.find(is_clear) {
        Some(way) => (way, true),
        None => (chords, false),
    }
}

/// The ends of so many equal parts.
fn on_circle(piece: &Segment, parts: f64) -> Vec<Point> {
    let at = |i: u32| piece.length_m * f64::from(i) / parts;
    (1..=whole(parts))
        .map(|i| piece.pose_at(at(i)).position())
        .collect()
}

/// Where the lines cross that touch the arc at the ends of so many equal parts, and its end.
fn touching(piece: &Segment, parts: f64) -> Vec<Point> {
    let part_m = piece.length_m / parts;
    let half_rad = piece.curvature_per_m.abs() * part_m / 2.0;
    let ahead_m = half_rad.tan() / piece.curvature_per_m.abs();
    let corner = |i: u32| {
        let touch = piece.pose_at(part_m * f64::from(i));
        touch.position() + touch.direction() * ahead_m
    };
    let corners = (0..whole(parts)).map(corner);
    corners.chain([piece.end().position()]).collect()
}

fn whole(parts: f64) -> u32 {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between 1 and a thousand"
    )]
    let n = parts as u32;
    n
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_geometry::frame::{Pose, Vector};
    use skein_geometry::{NoFlyZones, Polygon};

    const RADIUS_M: f64 = 25.0;

    fn piece(length_m: f64) -> Segment {
        Segment {
            start: Pose::new(Point::origin(), 0.0),
            curvature_per_m: 1.0 / RADIUS_M,
            length_m,
        }
    }

    /// A square zone round a point.
    fn zone(at: Point, half_m: f64) -> Polygon {
        let corner = |x: f64, y: f64| Point::new(at.x + x * half_m, at.y + y * half_m);
        Polygon::new(vec![
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ])
        .unwrap()
    }

    #[test]
    fn an_arc_has_as_many_waypoints_as_it_needs() {
        let count = |length_m| waypoints(&piece(length_m), None).0.len();
        assert_eq!(count(1e9), 1_000);
        assert_eq!(count(f64::INFINITY), 1);
        assert_eq!(count(RADIUS_M * PI / 6.0), 1);
        assert_eq!(count(RADIUS_M * PI / 6.0 + 0.1), 2);
    }

    /// A zone inside the circle, one round it, or both, as near as the arc is proved clear of.
    #[test]
    fn legs_keep_the_clearance_that_the_arc_keeps() {
        let turn = piece(RADIUS_M * PI);
        let centre = Point::new(0.0, RADIUS_M);
        let (half_m, clearance_m) = (5.0, 10.0);
        let diagonal_m = half_m * 2_f64.sqrt();
        let inner = zone(centre, half_m);
        let inner_m = RADIUS_M - diagonal_m;
        // Its corner towards the circle is at 45 degrees.
        let away_m = (RADIUS_M + inner_m) / 2_f64.sqrt() + half_m;
        let outer = zone(centre + Vector::new(away_m, away_m), half_m);
        for (zones, keeps_m) in [
            (vec![inner.clone()], inner_m),
            (vec![outer.clone()], inner_m),
            (vec![inner, outer], inner_m - 0.01),
            (Vec::new(), clearance_m),
        ] {
            let zones = NoFlyZones::new(zones);
            assert!(zones.is_segment_clear(&turn, keeps_m), "the arc itself");
            let air = Airspace::new(&zones, &[], [].into_iter(), keeps_m).unwrap();
            let (way, is_clear) = waypoints(&turn, Some(&air));
            assert!(is_clear && keeps(&air, turn.start.position(), &way));
            assert!((way[way.len() - 1] - turn.end().position()).norm() < 1e-9);
        }
        // Where the arc itself is too near, nothing is invented.
        let zones = NoFlyZones::new(vec![zone(centre, half_m)]);
        let air = Airspace::new(&zones, &[], [].into_iter(), inner_m + 1.0).unwrap();
        let (way, is_clear) = waypoints(&turn, Some(&air));
        assert!(!is_clear && way.len() == 6);
    }
}
