//! Where one may fly: outside of all zones and inside of all fences, as zones alone.
//!
//! What lies outside of a fence is cut into two polygons along the level lines through its
//! leftmost and its rightmost corner: no line leads from inside to beyond them but through
//! one of them.

use skein_flight::route::{RouteLimits, Router};
use skein_geometry::frame::Point;
use skein_geometry::offset::Zone;
use skein_geometry::polygon::PolygonError;
use skein_geometry::{NoFlyZones, Polygon};
use std::sync::Arc;
use thiserror::Error;

/// How far beyond everything what lies outside of a fence ends, metres.
const OUTSKIRTS_M: f64 = 500.0;

/// The least clearance, metres: a zone is entered where the distance is nothing, so that
/// without any clearance nothing could be proved.
pub const LEAST_CLEARANCE_M: f64 = 0.01;

/// Why there is no airspace.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum AirspaceError {
    /// A fence is too far away, or its outside is no polygon.
    #[error("the outside of inclusion fence {number}")]
    Fence {
        /// Which one, from 1.
        number: usize,
        /// Why.
        source: PolygonError,
    },
    /// A zone or a fence is no polygon.
    #[error("a no-fly zone or a fence")]
    Zone {
        /// Why.
        source: PolygonError,
    },
}

/// Zones and fences, and the distance that is kept from them.
#[derive(Clone, Debug)]
pub struct Airspace {
    zones: Arc<NoFlyZones>,
    clearance_m: f64,
}

impl Airspace {
    /// Zones, and fences round these places.
    ///
    /// # Errors
    /// When a fence has no outside in the plane.
    pub fn new(
        zones: &NoFlyZones,
        fences: &[Polygon],
        places: impl Iterator<Item = Point>,
        clearance_m: f64,
    ) -> Result<Self, AirspaceError> {
        // What is no length is for others to refuse.
        let clearance_m = if clearance_m >= 0.0 {
            clearance_m.max(LEAST_CLEARANCE_M)
        } else {
            clearance_m
        };
        let mut all = zones.zones().to_vec();
        let corners = fences.iter().flat_map(|f| f.vertices().iter().copied());
        let all_places: Vec<Point> = places.chain(corners).collect();
        for (i, fence) in fences.iter().enumerate() {
            let outside = outside(fence, &all_places);
            let outside = outside.map_err(|source| AirspaceError::Fence {
                number: i + 1,
                source,
            })?;
            all.extend(outside);
        }
        Ok(Self {
            zones: Arc::new(NoFlyZones::new(all)),
            clearance_m,
        })
    }

    /// As [`Airspace::new`], of zones as planners of ways have them: what lies round a fence
    /// is a zone with the fence as its hole.
    ///
    /// # Errors
    /// When a zone is no polygon, or a fence has no outside in the plane.
    pub fn of_zones(
        zones: &[Zone],
        places: impl Iterator<Item = Point>,
        clearance_m: f64,
    ) -> Result<Self, AirspaceError> {
        let polygon = |ring: &[Point]| {
            Polygon::new(ring.to_vec()).map_err(|source| AirspaceError::Zone { source })
        };
        let (mut out, mut fences) = (Vec::new(), Vec::new());
        for zone in zones {
            if zone.holes.is_empty() {
                out.push(polygon(&zone.outer)?);
            }
            for hole in &zone.holes {
                fences.push(polygon(hole)?);
            }
        }
        Self::new(&NoFlyZones::new(out), &fences, places, clearance_m)
    }

    /// Zones, and what lies outside of fences.
    pub fn zones(&self) -> &Arc<NoFlyZones> {
        &self.zones
    }

    /// The distance kept from them, metres.
    pub fn clearance_m(&self) -> f64 {
        self.clearance_m
    }

    /// Ways for a UAV that turns no tighter.
    pub fn router(&self, turn_radius_m: f64) -> Router {
        let limits = RouteLimits {
            turn_radius_m,
            clearance_m: self.clearance_m,
        };
        Router::new(Arc::clone(&self.zones), limits)
    }
}

/// What lies outside of a fence, as far as these places and a little more.
fn outside(fence: &Polygon, places: &[Point]) -> Result<[Polygon; 2], PolygonError> {
    let v = fence.vertices();
    let by_east = |a: &usize, b: &usize| {
        let (p, q) = (v[*a], v[*b]);
        p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y))
    };
    // A polygon has corners.
    let leftmost = (0..v.len()).min_by(by_east).unwrap_or(0);
    let rightmost = (0..v.len()).max_by(by_east).unwrap_or(0);
    let (mut low, mut high) = fence.bounds();
    for p in places {
        (low.x, low.y) = (low.x.min(p.x), low.y.min(p.y));
        (high.x, high.y) = (high.x.max(p.x), high.y.max(p.y));
    }
    let (west, east) = (low.x - OUTSKIRTS_M, high.x + OUTSKIRTS_M);
    let (south, north) = (low.y - OUTSKIRTS_M, high.y + OUTSKIRTS_M);
    let chain = |from: usize, to: usize| {
        let n = v.len();
        let steps = (to + n - from) % n;
        (0..=steps).map(move |i| v[(from + i) % n])
    };
    // Counter-clockwise the lower side leads from the leftmost corner to the rightmost.
    let (l, r) = (v[leftmost], v[rightmost]);
    let below = [Point::new(west, south), Point::new(west, l.y)];
    let below = below.into_iter().chain(chain(leftmost, rightmost));
    let below = below.chain([Point::new(east, r.y), Point::new(east, south)]);
    let above = [Point::new(east, north), Point::new(east, r.y)];
    let above = above.into_iter().chain(chain(rightmost, leftmost));
    let above = above.chain([Point::new(west, l.y), Point::new(west, north)]);
    Ok([
        Polygon::new(below.collect())?,
        Polygon::new(above.collect())?,
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polygon(points: &[(f64, f64)]) -> Polygon {
        Polygon::new(points.iter().map(|&(x, y)| Point::new(x, y)).collect()).unwrap()
    }

    #[test]
    fn outside_of_a_fence_is_zone_and_inside_is_as_far_from_it_as_from_the_fence() {
        let u = polygon(&[
            (0.0, 0.0),
            (300.0, 0.0),
            (300.0, 200.0),
            (200.0, 200.0),
            (200.0, 80.0),
            (100.0, 80.0),
            (100.0, 200.0),
            (0.0, 200.0),
        ]);
        let none = NoFlyZones::new(Vec::new());
        let far = Point::new(1000.0, -700.0);
        let air = Airspace::new(&none, std::slice::from_ref(&u), [far].into_iter(), 0.0).unwrap();
        assert!((air.clearance_m() - LEAST_CLEARANCE_M).abs() < 1e-12);
        for i in -20..60 {
            for j in -20..50 {
                let p = Point::new(f64::from(i) * 13.7, f64::from(j) * 11.3);
                let d = air.zones().distance_m(p);
                if u.contains(p) {
                    assert!((d - u.outline_distance_m(p)).abs() < 1e-9, "{p} {d}");
                } else {
                    assert!(d < 1e-9, "{p} {d}");
                }
            }
        }
        assert!(air.zones().distance_m(far) < 1e-9);
    }
}
