//! No-fly zones and their outward offset (D2.7 §2.3.1).

use super::Polygon;
use crate::frame::Point;
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
        let _ = p;
        todo!("planning helper")
    }

    /// Distance from a piece of a curve to the nearest zone, exact for lines and
    /// arcs, metres; 0 when it enters one, infinite without zones.
    #[must_use]
    pub fn segment_distance_m(&self, segment: &Segment) -> f64 {
        let _ = segment;
        todo!("planning helper")
    }

    /// Whether the whole curve keeps at least `clearance_m` from every zone.
    #[must_use]
    pub fn is_clear(&self, curve: &Curve, clearance_m: f64) -> bool {
        let _ = (curve, clearance_m);
        todo!("planning helper")
    }

    /// The zones grown by `radius_m` and united: polygons (outer rings and holes
    /// as `(outer, holes)`) that contain the exact Minkowski sum.
    ///
    /// # Errors
    /// [`ZoneError::Offset`] when an output fails its certificate.
    pub fn offset(&self, radius_m: f64) -> Result<Vec<(Polygon, Vec<Polygon>)>, ZoneError> {
        let _ = radius_m;
        todo!("planning helper")
    }
}
