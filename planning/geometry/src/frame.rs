//! Poses and the local tangent plane of a mission (D2.7 §2.2, flat earth).
//!
//! Inside Skein everything is metres east and north of the mission's origin and
//! radians counter-clockwise from east. WGS84 appears only at the edges.

use crate::math::{cos, sin, sin_cos, wrap_pi};
use nalgebra::{Point2, Vector2};
use serde::{Deserialize, Serialize};

/// A position in metres east (`x`) and north (`y`) of the mission's origin.
pub type Point = Point2<f64>;

/// A displacement in metres east and north.
pub type Vector = Vector2<f64>;

/// Where a UAV is and where its nose points.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Metres east of the origin.
    pub east_m: f64,
    /// Metres north of the origin.
    pub north_m: f64,
    /// Radians counter-clockwise from east.
    pub heading_rad: f64,
}

impl Pose {
    /// A pose at `position`, heading as given.
    #[must_use]
    pub fn new(position: Point, heading_rad: f64) -> Self {
        Self {
            east_m: position.x,
            north_m: position.y,
            heading_rad,
        }
    }

    /// The position without the heading.
    #[must_use]
    pub fn position(&self) -> Point {
        Point::new(self.east_m, self.north_m)
    }

    /// The unit vector of the heading.
    #[must_use]
    pub fn direction(&self) -> Vector {
        let (s, c) = sin_cos(self.heading_rad);
        Vector::new(c, s)
    }

    /// The same place, looking back.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self {
            heading_rad: wrap_pi(self.heading_rad + crate::math::PI),
            ..*self
        }
    }
}

/// The origin of a mission's east-north-up plane, on the WGS84 ellipsoid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// Geodetic latitude, degrees north.
    pub lat_deg: f64,
    /// Longitude, degrees east.
    pub lon_deg: f64,
}

/// The largest distance from the origin at which the plane is used, metres.
///
/// At 10 km the plane is off by 4 mm horizontally and 7.8 m vertically.
pub const MAX_MISSION_RADIUS_M: f64 = 20_000.0;

const WGS84_A_M: f64 = 6_378_137.0;
const WGS84_E2: f64 = 6.694_379_990_141_317e-3;

impl Origin {
    fn ecef(lat_rad: f64, lon_rad: f64, height_m: f64) -> [f64; 3] {
        let (sp, cp) = sin_cos(lat_rad);
        let (sl, cl) = sin_cos(lon_rad);
        let n = WGS84_A_M / (1.0 - WGS84_E2 * sp * sp).sqrt();
        [
            (n + height_m) * cp * cl,
            (n + height_m) * cp * sl,
            (n * (1.0 - WGS84_E2) + height_m) * sp,
        ]
    }

    /// Metres east and north of this origin of the ground point at the given
    /// geodetic coordinates in degrees (height zero on both ends).
    #[must_use]
    pub fn to_enu(&self, lat_deg: f64, lon_deg: f64) -> Point {
        let (p0, l0) = (self.lat_deg.to_radians(), self.lon_deg.to_radians());
        let o = Self::ecef(p0, l0, 0.0);
        let q = Self::ecef(lat_deg.to_radians(), lon_deg.to_radians(), 0.0);
        let d = [q[0] - o[0], q[1] - o[1], q[2] - o[2]];
        let (sp, cp, sl, cl) = (sin(p0), cos(p0), sin(l0), cos(l0));
        Point::new(
            -sl * d[0] + cl * d[1],
            -sp * cl * d[0] - sp * sl * d[1] + cp * d[2],
        )
    }

    /// Geodetic latitude and longitude in degrees of a point of the plane.
    ///
    /// Inverts [`Origin::to_enu`] by Newton steps on the local radii; three of
    /// them reach 1e-9 degrees within [`MAX_MISSION_RADIUS_M`].
    #[must_use]
    pub fn to_geodetic(&self, p: Point) -> (f64, f64) {
        let s0 = sin(self.lat_deg.to_radians());
        let w = 1.0 - WGS84_E2 * s0 * s0;
        let meridian_m = WGS84_A_M * (1.0 - WGS84_E2) / (w * w.sqrt());
        let parallel_m = WGS84_A_M / w.sqrt() * cos(self.lat_deg.to_radians());
        let (mut lat, mut lon) = (self.lat_deg, self.lon_deg);
        for _ in 0..6 {
            let q = self.to_enu(lat, lon);
            lat += ((p.y - q.y) / meridian_m).to_degrees();
            lon += ((p.x - q.x) / parallel_m).to_degrees();
        }
        (lat, lon)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn geodetic_and_enu_invert_each_other() {
        let o = Origin {
            lat_deg: 60.1655,
            lon_deg: 24.9355,
        };
        for p in [
            Point::new(1000.0, 1000.0),
            Point::new(-8000.0, 12000.0),
            Point::new(0.0, 0.0),
        ] {
            let (lat, lon) = o.to_geodetic(p);
            assert!((o.to_enu(lat, lon) - p).norm() < 1e-5, "{p:?}");
        }
    }

    #[test]
    fn one_arc_minute_of_latitude_is_about_a_nautical_mile() {
        let o = Origin {
            lat_deg: 45.0,
            lon_deg: 0.0,
        };
        let p = o.to_enu(45.0 + 1.0 / 60.0, 0.0);
        assert!((p.y - 1852.0).abs() < 1.0 && p.x.abs() < 1e-6, "{p:?}");
    }
}
