//! Latitude and longitude, and the way from there to a mission's plane (D2.7 §2.2).
//! Leaves validity of polygons to `skein_geometry`.

use skein_geometry::frame::{MAX_MISSION_RADIUS_M, Origin, Point};
use skein_geometry::math::{TAU, cos, sin_cos};
use skein_geometry::polygon::side;
use thiserror::Error;

/// A point on the WGS84 ellipsoid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LatLon {
    /// Geodetic latitude, degrees north.
    pub lat_deg: f64,
    /// Longitude, degrees east.
    pub lon_deg: f64,
}

/// A closed region of a foreign file.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A ring, the first point not repeated, counter-clockwise.
    Ring(Vec<LatLon>),
    /// A circle.
    Circle {
        /// Its centre.
        centre: LatLon,
        /// Its radius, metres.
        radius_m: f64,
    },
}

/// A point is too far from the origin for one tangent plane.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error(
    "{lat_deg:.7}, {lon_deg:.7} lies {distance_km:.1} km from the origin: a mission ends at {limit_km:.0} km, where the tangent plane stops being exact",
    limit_km = MAX_MISSION_RADIUS_M / 1000.0
)]
pub struct TooFar {
    /// Latitude of the point, degrees north.
    pub lat_deg: f64,
    /// Longitude of the point, degrees east.
    pub lon_deg: f64,
    /// Distance in the plane, kilometres.
    pub distance_km: f64,
}

/// A point of the plane, if it is near enough to the origin.
///
/// # Errors
/// [`TooFar`] beyond 20 km.
pub fn to_plane(origin: Origin, at: LatLon) -> Result<Point, TooFar> {
    let p = origin.to_enu(at.lat_deg, at.lon_deg);
    let distance_m = p.coords.norm();
    // Half the earth away the plane folds back on itself, hence the second test: near the
    // equator the far side has the same latitude, near a pole every longitude is near.
    let around = cos((at.lon_deg - origin.lon_deg).to_radians()) > 0.0;
    let near = (at.lat_deg - origin.lat_deg).abs() < 1.0 && (around || origin.lat_deg.abs() > 89.0);
    if near && distance_m <= MAX_MISSION_RADIUS_M {
        Ok(p)
    } else {
        Err(TooFar {
            lat_deg: at.lat_deg,
            lon_deg: at.lon_deg,
            distance_km: distance_m / 1000.0,
        })
    }
}

/// A point of the plane as latitude and longitude.
#[must_use]
pub fn from_plane(origin: Origin, p: Point) -> LatLon {
    let (lat_deg, lon_deg) = origin.to_geodetic(p);
    // East of the antimeridian longitudes begin anew.
    let lon_deg = if lon_deg >= 180.0 {
        lon_deg - 360.0
    } else if lon_deg < -180.0 {
        lon_deg + 360.0
    } else {
        lon_deg
    };
    LatLon { lat_deg, lon_deg }
}

/// A ring in degrees east and north, its longitudes counted on beyond the antimeridian from
/// where it begins: so that a ring across it is one.
fn counted_on(ring: &[LatLon]) -> Vec<Point> {
    let first_deg = ring.first().map_or(0.0, |p| p.lon_deg);
    let point = |p: &LatLon| {
        let turns = ((p.lon_deg - first_deg) / 360.0).round();
        Point::new(p.lon_deg - 360.0 * turns, p.lat_deg)
    };
    ring.iter().map(point).collect()
}

/// Corners of the polygon that stands for a circle: 32 keep the difference between
/// the inner and the outer polygon below half a percent of the radius.
pub const CIRCLE_CORNERS: u32 = 32;

/// Whether a polygon for a circle lies inside or outside of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The polygon is contained in the circle (right for where one may be).
    Inside,
    /// The polygon contains the circle (right for where one may not be).
    Outside,
}

/// A regular polygon for a circle in the plane, counter-clockwise.
#[must_use]
pub fn circle_ring(centre: Point, radius_m: f64, side: Side) -> Vec<Point> {
    let step = TAU / f64::from(CIRCLE_CORNERS);
    let reach_m = match side {
        Side::Inside => radius_m,
        Side::Outside => radius_m / cos(step / 2.0),
    };
    (0..CIRCLE_CORNERS)
        .map(|i| {
            let (s, c) = sin_cos(step * f64::from(i));
            Point::new(centre.x + reach_m * c, centre.y + reach_m * s)
        })
        .collect()
}

impl Shape {
    /// The shape as a ring of the plane.
    ///
    /// # Errors
    /// [`TooFar`] names the first point beyond 20 km.
    pub fn to_plane(&self, origin: Origin, side: Side) -> Result<Vec<Point>, TooFar> {
        match self {
            Self::Ring(ring) => ring.iter().map(|p| to_plane(origin, *p)).collect(),
            Self::Circle { centre, radius_m } => {
                Ok(circle_ring(to_plane(origin, *centre)?, *radius_m, side))
            }
        }
    }
}

/// Twice the signed area of a ring in degrees: positive when counter-clockwise.
fn winding(ring: &[LatLon]) -> f64 {
    let (ring, n) = (counted_on(ring), ring.len());
    (0..n)
        .map(|i| {
            let (a, b) = (ring[i], ring[(i + 1) % n]);
            a.x * b.y - b.x * a.y
        })
        .sum()
}

/// Drops a repeated last point and turns the ring counter-clockwise. Rings of map
/// data are wound either way, and unions of mixed windings are silently wrong.
#[must_use]
pub fn orient(mut ring: Vec<LatLon>) -> Vec<LatLon> {
    if ring.len() > 1 && ring.first() == ring.last() {
        ring.pop();
    }
    if winding(&ring) < 0.0 {
        ring.reverse();
    }
    ring
}

/// Where two edges of a ring cross.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error(
    "the ring crosses itself near {:.7}, {:.7}: its edge from {:.7}, {:.7} to {:.7}, {:.7} and that from {:.7}, {:.7} to {:.7}, {:.7}; draw it so that edges meet at corners only, or as two polygons",
    .at.lat_deg, .at.lon_deg,
    .first[0].lat_deg, .first[0].lon_deg, .first[1].lat_deg, .first[1].lon_deg,
    .second[0].lat_deg, .second[0].lon_deg, .second[1].lat_deg, .second[1].lon_deg
)]
pub struct Crossing {
    /// Where.
    pub at: LatLon,
    /// Both ends of one edge.
    pub first: [LatLon; 2],
    /// Both ends of the other.
    pub second: [LatLon; 2],
}

/// Refuses a ring of which two edges cross, each on both sides of the other; what merely
/// touches itself passes.
///
/// # Complexity
/// O(n²) in the number of corners, with a box test a pair.
///
/// # Errors
/// [`Crossing`] names the first two such edges.
pub fn check_ring(ring: &[LatLon]) -> Result<(), Crossing> {
    let (points, n) = (counted_on(ring), ring.len());
    let edge = |i: usize| [ring[i], ring[(i + 1) % n]];
    let line = |i: usize| [points[i], points[(i + 1) % n]];
    for i in 0..n {
        for j in i + 2..n {
            if let Some(at) = crossing(line(i), line(j)) {
                return Err(Crossing {
                    at,
                    first: edge(i),
                    second: edge(j),
                });
            }
        }
    }
    Ok(())
}

/// Where two edges cross, if each lies on both sides of the other.
fn crossing([a, b]: [Point; 2], [c, d]: [Point; 2]) -> Option<LatLon> {
    // Most edges lie apart, and this is told without a product.
    let beside = |a: f64, b: f64, c: f64, d: f64| a.max(b) < c.min(d) || c.max(d) < a.min(b);
    if beside(a.x, b.x, c.x, d.x) || beside(a.y, b.y, c.y, d.y) {
        return None;
    }
    let apart = |s: i8, t: i8| s * t < 0;
    if !apart(side(a, b, c), side(a, b, d)) || !apart(side(c, d, a), side(c, d, b)) {
        return None;
    }
    let (u, v) = (b - a, d - c);
    let share = (c - a).perp(&v) / u.perp(&v);
    let at = a + u * share;
    Some(LatLon {
        lat_deg: at.y,
        lon_deg: at.x,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const ORIGIN: Origin = Origin {
        lat_deg: 60.1655,
        lon_deg: 24.9355,
    };

    #[test]
    fn rings_become_counter_clockwise_and_open() {
        let p = |lat_deg, lon_deg| LatLon { lat_deg, lon_deg };
        let clockwise = vec![p(0.0, 0.0), p(1.0, 0.0), p(1.0, 1.0), p(0.0, 0.0)];
        let ring = orient(clockwise);
        assert_eq!(ring.len(), 3);
        assert!(winding(&ring) > 0.0);
        assert_eq!(orient(ring.clone()), ring);
    }

    #[test]
    fn rings_that_cross_themselves_are_refused_where_they_do() {
        let ring = |corners: &[(f64, f64)]| -> Vec<LatLon> {
            let corner = |&(lat_deg, lon_deg): &(f64, f64)| LatLon { lat_deg, lon_deg };
            corners.iter().map(corner).collect()
        };
        let bow_tie = ring(&[(47.0, 8.0), (47.0, 8.2), (47.2, 8.0), (47.2, 8.2)]);
        let crossing = check_ring(&bow_tie).unwrap_err();
        assert!((crossing.at.lat_deg - 47.1).abs() < 1e-9, "{crossing}");
        assert!((crossing.at.lon_deg - 8.1).abs() < 1e-9, "{crossing}");
        assert!(
            crossing
                .to_string()
                .contains("near 47.1000000, 8.1000000: its edge from 47.0")
        );
        assert_eq!(crossing.first, [bow_tie[1], bow_tie[2]]);
        assert_eq!(crossing.second, [bow_tie[3], bow_tie[0]]);
        // Edges that share a corner, and a corner on an edge, cross nothing.
        for corners in [
            &[(0.0, 0.0), (0.0, 1.0), (1.0, 1.0)][..],
            &[(0.0, 0.0), (0.0, 2.0), (1.0, 1.0), (0.0, 1.0), (1.0, 0.0)],
            &[(0.0, 0.0), (0.0, 1.0)],
            &[],
        ] {
            assert_eq!(check_ring(&ring(corners)), Ok(()), "{corners:?}");
        }
    }

    #[test]
    fn a_mission_ends_at_twenty_kilometres() {
        assert!(
            to_plane(
                ORIGIN,
                LatLon {
                    lat_deg: 60.30,
                    lon_deg: 24.9355
                }
            )
            .is_ok()
        );
        assert!(
            to_plane(
                ORIGIN,
                LatLon {
                    lat_deg: 60.40,
                    lon_deg: 24.9355
                }
            )
            .is_err()
        );
        let antipode = LatLon {
            lat_deg: -60.1655,
            lon_deg: 24.9355 - 180.0,
        };
        assert!(to_plane(ORIGIN, antipode).is_err());
        // Near the equator the far side has the same latitude.
        let (lat_deg, lon_deg) = (0.1, 10.0);
        let equator = Origin { lat_deg, lon_deg };
        let lon_deg = lon_deg - 180.0;
        assert!(to_plane(equator, LatLon { lat_deg, lon_deg }).is_err());
    }

    #[test]
    fn a_ring_across_the_antimeridian_is_one() {
        let (lat_deg, lon_deg) = (-17.0, 179.999);
        let fiji = Origin { lat_deg, lon_deg };
        let corners = [(0.0, 0.0), (900.0, 0.0), (900.0, 500.0), (0.0, 500.0)];
        let ring: Vec<LatLon> = corners
            .iter()
            .map(|&(x, y)| from_plane(fiji, Point::new(x, y)))
            .collect();
        assert!(
            ring[1].lon_deg < -179.9 && ring[0].lon_deg > 179.9,
            "{ring:?}"
        );
        assert_eq!(orient(ring.clone()), ring);
        assert_eq!(check_ring(&ring), Ok(()));
        for (at, (x, y)) in ring.iter().zip(corners) {
            let back = to_plane(fiji, *at).unwrap();
            assert!((back - Point::new(x, y)).norm() < 1e-6);
        }
        let bow_tie = [ring[0], ring[2], ring[1], ring[3]];
        let lon_deg = check_ring(&bow_tie).unwrap_err().at.lon_deg;
        assert!((179.9..180.1).contains(&lon_deg.abs()), "{lon_deg}");
    }

    #[test]
    fn the_outer_polygon_contains_the_circle_and_the_inner_is_contained() {
        let c = Point::new(3.0, -7.0);
        for (side, inner) in [(Side::Outside, false), (Side::Inside, true)] {
            let ring = circle_ring(c, 100.0, side);
            for i in 0..ring.len() {
                let mid = nalgebra_mid(ring[i], ring[(i + 1) % ring.len()]);
                let r = (mid - c).norm();
                assert!(
                    if inner { r < 100.0 } else { r > 100.0 - 1e-9 },
                    "{side:?} {r}"
                );
            }
        }
    }

    fn nalgebra_mid(a: Point, b: Point) -> Point {
        Point::new((a.x + b.x) / 2.0, (a.y + b.y) / 2.0)
    }
}
