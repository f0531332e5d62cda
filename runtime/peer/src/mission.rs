//! What a mission is: area, zones, lanes, level, origin, revision.

use crate::plan::Ground;
use serde::{Deserialize, Serialize};
use skein_planning::coverage::area::{AreaProblem, CoverageLoop};
use skein_planning::frame::Point;
use skein_planning::geometry::{NoFlyZones, Polygon};
use skein_planning::path::{RouteLimits, Router};
use std::sync::Arc;

/// A point in millimetres east and north of the mission's origin.
pub type PointMm = (i32, i32);

/// An area-coverage mission. Integers only, so that its bytes and its hash are the
/// same everywhere.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Mission {
    /// Counts the operator's changes; a later one replaces an earlier one.
    pub revision: u32,
    /// Latitude of the origin, 1e-7 degrees.
    pub origin_lat_e7: i32,
    /// Longitude of the origin, 1e-7 degrees.
    pub origin_lon_e7: i32,
    /// The area to be seen, a simple ring.
    pub area: Vec<PointMm>,
    /// No-fly zones at the lowest flight level, simple rings.
    pub zones: Vec<Vec<PointMm>>,
    /// Lane spacing, mm.
    pub lane_spacing_mm: u32,
    /// Smallest turn radius that every UAV of the mission can fly at its cruise airspeed, mm.
    pub turn_radius_mm: u32,
    /// Distance every curve keeps from the zones, mm.
    pub clearance_mm: u32,
    /// Half the camera footprint across the track at the lowest level, mm.
    pub footprint_across_mm: u32,
    /// Half the camera footprint along the track at the lowest level, mm.
    pub footprint_along_mm: u32,
    /// How far a UAV may stray from its curve, mm.
    pub tracking_error_mm: u32,
    /// A launch point, which must reach the loop.
    pub launch: PointMm,
    /// Where UAVs loiter when all is done.
    pub base: PointMm,
}

fn metres(mm: u32) -> f64 {
    f64::from(mm) / 1000.0
}

/// A point of the plane, in metres.
#[must_use]
pub fn point_m(p: PointMm) -> Point {
    Point::new(f64::from(p.0) / 1000.0, f64::from(p.1) / 1000.0)
}

impl Mission {
    /// Identifies the content: FNV-1a over all fields in order.
    #[must_use]
    pub fn content_hash(&self) -> u64 {
        let mut h = crate::wire::Fnv::new();
        for v in [self.origin_lat_e7, self.origin_lon_e7] {
            h.write_i64(i64::from(v));
        }
        h.write_i64(i64::from(self.revision));
        let ring = |h: &mut crate::wire::Fnv, r: &[PointMm]| {
            h.write_i64(i64::try_from(r.len()).unwrap_or(i64::MAX));
            for p in r {
                h.write_i64(i64::from(p.0));
                h.write_i64(i64::from(p.1));
            }
        };
        ring(&mut h, &self.area);
        h.write_i64(i64::try_from(self.zones.len()).unwrap_or(i64::MAX));
        for z in &self.zones {
            ring(&mut h, z);
        }
        for v in [
            self.lane_spacing_mm,
            self.turn_radius_mm,
            self.clearance_mm,
            self.footprint_across_mm,
            self.footprint_along_mm,
            self.tracking_error_mm,
        ] {
            h.write_i64(i64::from(v));
        }
        ring(&mut h, &[self.launch, self.base]);
        h.finish()
    }

    /// Derives the loop and the router.
    ///
    /// # Errors
    /// A sentence that names what is wrong with the mission.
    pub fn ground(self: &Arc<Self>) -> Result<Arc<Ground>, String> {
        let ring = |r: &[PointMm]| Polygon::new(r.iter().copied().map(point_m).collect());
        let area = ring(&self.area).map_err(|e| format!("area: {e}"))?;
        let mut zones = Vec::with_capacity(self.zones.len());
        for (i, z) in self.zones.iter().enumerate() {
            zones.push(ring(z).map_err(|e| format!("zone {i}: {e}"))?);
        }
        let zones = Arc::new(NoFlyZones::new(zones));
        let problem = AreaProblem {
            area,
            zones: Arc::clone(&zones),
            lane_spacing_m: metres(self.lane_spacing_mm),
            turn_radius_m: metres(self.turn_radius_mm),
            clearance_m: metres(self.clearance_mm),
            footprint_across_m: metres(self.footprint_across_mm),
            footprint_along_m: metres(self.footprint_along_mm),
            tracking_error_m: metres(self.tracking_error_mm),
            launch: point_m(self.launch),
        };
        let coverage_loop = CoverageLoop::build(&problem).map_err(|e| e.to_string())?;
        let limits = RouteLimits {
            turn_radius_m: problem.turn_radius_m,
            clearance_m: problem.clearance_m,
        };
        let router = Router::new(zones, limits).map_err(|e| e.to_string())?;
        Ok(Arc::new(Ground {
            mission: Arc::clone(self),
            coverage_loop: Arc::new(coverage_loop),
            router: Arc::new(router),
        }))
    }
}
