//! The plane of a plan: metres east and north of its origin, and back to WGS84.
//!
//! Written from the definition (earth-centred coordinates on the ellipsoid, turned into
//! the horizon of the origin, the height left out) and not taken from the planners, so that
//! a mistake there shows here.

use libm::{cos, hypot, sin, sqrt};
use skein_interop::place::LatLon;

/// Equatorial radius of WGS84, metres.
const EQUATOR_M: f64 = 6_378_137.0;

/// Inverse flattening of WGS84.
const INVERSE_FLATTENING: f64 = 298.257_223_563;

/// How far from its origin a plan may reach, metres: beyond, the plane is off by decimetres.
pub const REACH_M: f64 = 20_000.0;

/// A point of the plane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// Metres east of the origin.
    pub x: f64,
    /// Metres north of the origin.
    pub y: f64,
}

impl Point {
    /// A point by its coordinates.
    #[must_use]
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// How far away another one is, metres.
    #[must_use]
    pub fn distance(self, to: Self) -> f64 {
        hypot(to.x - self.x, to.y - self.y)
    }

    pub(crate) fn minus(self, from: Self) -> Self {
        Self::new(self.x - from.x, self.y - from.y)
    }

    pub(crate) fn plus(self, by: Self, times: f64) -> Self {
        Self::new(self.x + by.x * times, self.y + by.y * times)
    }

    pub(crate) fn dot(self, with: Self) -> f64 {
        self.x * with.x + self.y * with.y
    }

    pub(crate) fn cross(self, with: Self) -> f64 {
        self.x * with.y - self.y * with.x
    }

    pub(crate) fn norm(self) -> f64 {
        hypot(self.x, self.y)
    }
}

/// Where a plane touches the ellipsoid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Geodetic latitude of the origin, degrees north.
    pub lat_deg: f64,
    /// Longitude of the origin, degrees east.
    pub lon_deg: f64,
}

/// Squared first eccentricity.
fn e2() -> f64 {
    let f = 1.0 / INVERSE_FLATTENING;
    f * (2.0 - f)
}

/// Radius of the parallel and height above the equator's plane of a place on the ellipsoid.
fn meridian(lat_rad: f64) -> (f64, f64) {
    let s = sin(lat_rad);
    let normal_m = EQUATOR_M / sqrt(1.0 - e2() * s * s);
    (normal_m * cos(lat_rad), normal_m * (1.0 - e2()) * s)
}

impl Plane {
    /// The plane that touches at a place.
    #[must_use]
    pub fn at(place: LatLon) -> Self {
        Self {
            lat_deg: place.lat_deg,
            lon_deg: place.lon_deg,
        }
    }

    /// A place in the plane, however far away.
    #[must_use]
    pub fn project(&self, place: LatLon) -> Point {
        let (lat0, lat) = (self.lat_deg.to_radians(), place.lat_deg.to_radians());
        let east = (place.lon_deg - self.lon_deg).to_radians();
        let ((out0_m, up0_m), (out_m, up_m)) = (meridian(lat0), meridian(lat));
        Point::new(
            out_m * sin(east),
            cos(lat0) * (up_m - up0_m) - sin(lat0) * (out_m * cos(east) - out0_m),
        )
    }

    /// A place in the plane, if it is within [`REACH_M`] of the origin.
    #[must_use]
    pub fn near(&self, place: LatLon) -> Option<Point> {
        let p = self.project(place);
        let east_deg = (place.lon_deg - self.lon_deg).abs();
        // The far side of the earth falls onto the same plane.
        let same_side = (place.lat_deg - self.lat_deg).abs() < 1.0
            && (cos(east_deg.to_radians()) > 0.0 || self.lat_deg.abs() > 89.0);
        (same_side && p.norm() <= REACH_M).then_some(p)
    }

    /// Latitude and longitude of a point of the plane.
    #[must_use]
    pub fn place(&self, p: Point) -> LatLon {
        let s = sin(self.lat_deg.to_radians());
        let w = 1.0 - e2() * s * s;
        let north_m = EQUATOR_M * (1.0 - e2()) / (w * sqrt(w));
        let east_m = (EQUATOR_M / sqrt(w) * cos(self.lat_deg.to_radians())).max(1.0);
        let mut at = LatLon {
            lat_deg: self.lat_deg,
            lon_deg: self.lon_deg,
        };
        // Each step leaves of the error what the radii change over it.
        for _ in 0..8 {
            let off = p.minus(self.project(at));
            at.lat_deg += (off.y / north_m).to_degrees();
            at.lon_deg += (off.x / east_m).to_degrees();
        }
        at
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_planners_and_this_mean_the_same_places() {
        for (lat_deg, lon_deg) in [
            (60.1655, 24.9355),
            (-33.9, 151.2),
            (0.0, 179.99),
            (47.0, -8.0),
        ] {
            let plane = Plane { lat_deg, lon_deg };
            let theirs = skein_geometry::frame::Origin { lat_deg, lon_deg };
            for (x, y) in [
                (0.0, 0.0),
                (1234.5, -987.6),
                (-12_000.0, 9_000.0),
                (300.0, 14_000.0),
            ] {
                let p = Point::new(x, y);
                let (lat_deg, lon_deg) =
                    theirs.to_geodetic(skein_geometry::frame::Point::new(x, y));
                let back = plane.project(LatLon { lat_deg, lon_deg });
                assert!(back.distance(p) < 1e-5, "{p:?}: {back:?}");
                let at = plane.place(p);
                assert!(plane.project(at).distance(p) < 1e-6);
            }
        }
    }

    /// The greatest distance between where the planners and this put a place, metres, and
    /// between a point and itself by way of degrees: of sites of 5 km at a latitude.
    fn apart_m(lat_deg: f64, lon_deg: f64) -> (f64, f64) {
        let plane = Plane { lat_deg, lon_deg };
        let theirs = skein_geometry::frame::Origin { lat_deg, lon_deg };
        let (mut placed_m, mut there_and_back_m) = (0.0_f64, 0.0_f64);
        for i in -5..=5 {
            for j in -5..=5 {
                let p = Point::new(500.0 * f64::from(i), 500.0 * f64::from(j));
                let at = plane.place(p);
                let other = theirs.to_enu(at.lat_deg, at.lon_deg);
                placed_m = placed_m.max(plane.project(at).distance(Point::new(other.x, other.y)));
                let (lat_deg, lon_deg) =
                    theirs.to_geodetic(skein_geometry::frame::Point::new(p.x, p.y));
                let back = plane.project(LatLon { lat_deg, lon_deg });
                there_and_back_m = there_and_back_m.max(back.distance(p));
            }
        }
        (placed_m, there_and_back_m)
    }

    #[test]
    fn both_agree_to_the_millimetre_up_to_89_degrees() {
        let mut worst = (0.0_f64, 0.0_f64);
        for i in -89..=89 {
            let lat_deg = f64::from(i);
            for lon_deg in [0.0, 8.55, -71.3, 179.999, -180.0] {
                let (placed_m, there_and_back_m) = apart_m(lat_deg, lon_deg);
                worst = (worst.0.max(placed_m), worst.1.max(there_and_back_m));
            }
        }
        for near_equator in [1e-9, -1e-6, 0.001, -0.02] {
            let (placed_m, there_and_back_m) = apart_m(near_equator, 33.0);
            worst = (worst.0.max(placed_m), worst.1.max(there_and_back_m));
        }
        assert!(worst.0 < 1e-3 && worst.1 < 1e-3, "{worst:?}");
        // Within some kilometres of a pole, where longitudes run together, degrees are found
        // no more; where both put a place is the same even there.
        assert!(apart_m(89.9, 20.0).0 < 1e-3);
    }

    #[test]
    fn the_far_side_of_the_earth_is_not_near() {
        let plane = Plane {
            lat_deg: 0.0,
            lon_deg: 0.0,
        };
        let far = LatLon {
            lat_deg: 0.0,
            lon_deg: 180.0,
        };
        assert!(plane.near(far).is_none());
        assert!(
            plane
                .near(LatLon {
                    lat_deg: 0.1,
                    lon_deg: 0.1
                })
                .is_some()
        );
        assert!(
            plane
                .near(LatLon {
                    lat_deg: 0.2,
                    lon_deg: 0.1
                })
                .is_none()
        );
    }
}
