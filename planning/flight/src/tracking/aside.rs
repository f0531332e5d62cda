//! A circle round a target beside a zone lies aside from it (D2.7 §2.3.1, §3.7.1).
//!
//! Where a zone takes a part of the circle round a target, whoever flies it is bent round the
//! zone, at worst round its far side, and has lost the target by then. The circle is therefore
//! moved away from the zone, as far as it reaches into what is kept clear of, and never so far
//! that the target would leave the picture.

use skein_geometry::clearance::NoFlyZones;
use skein_geometry::frame::{Point, Vector};

/// The way away from the zones is told by the distance from them this far to all sides, metres.
const FEEL_M: f64 = 5.0;

/// Flatter than this no way leads away: the target is between zones, or in one.
const FLAT: f64 = 0.2;

/// From the target to the middle of a circle round it that reaches `wanted_m` around the target
/// where no zone is, metres: how far from zones the target would have to be. It is moved by
/// `most_m` at most.
#[must_use]
pub fn aside(target: Point, zones: &NoFlyZones, wanted_m: f64, most_m: f64) -> Vector {
    let lacks_m = wanted_m - zones.distance_m(target);
    if lacks_m <= 0.0 {
        return Vector::zeros();
    }
    let slope = |to: Vector| zones.distance_m(target + to) - zones.distance_m(target - to);
    let east = slope(Vector::new(FEEL_M, 0.0));
    let north = slope(Vector::new(0.0, FEEL_M));
    let away = Vector::new(east, north) / (2.0 * FEEL_M);
    if away.norm() < FLAT {
        return Vector::zeros();
    }
    away * (lacks_m.min(most_m) / away.norm())
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_geometry::polygon::Polygon;

    fn square(x: f64, y: f64, half_m: f64) -> Polygon {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corner = |(a, b): (f64, f64)| Point::new(x + a * half_m, y + b * half_m);
        Polygon::new(corners.map(corner).to_vec()).unwrap()
    }

    #[test]
    fn it_moves_away_from_the_zone_as_far_as_it_must_and_may() {
        let zones = NoFlyZones::new(vec![square(0.0, 0.0, 20.0)]);
        let at = |x: f64| aside(Point::new(x, 0.0), &zones, 90.0, 24.0);
        assert!((at(80.0) - Vector::new(24.0, 0.0)).norm() < 1e-6);
        assert!((at(100.0) - Vector::new(10.0, 0.0)).norm() < 1e-6);
        assert!((at(-100.0) - Vector::new(-10.0, 0.0)).norm() < 1e-6);
        assert!(at(111.0).norm() < 1e-9);
        // Within a zone, and without one, nothing is known of a way.
        assert!(at(0.0).norm() < 1e-9);
        let none = NoFlyZones::new(Vec::new());
        assert!(aside(Point::origin(), &none, 90.0, 24.0).norm() < 1e-9);
        // Half-way between two zones neither side is better.
        let two = NoFlyZones::new(vec![square(-60.0, 0.0, 20.0), square(60.0, 0.0, 20.0)]);
        assert!(aside(Point::origin(), &two, 90.0, 24.0).norm() < 1e-9);
    }
}
