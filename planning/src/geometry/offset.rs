//! Growing zones outward (D2.7 §2.3.1).

use super::{NoFlyZones, Polygon, ZoneError};

pub(super) fn grow(
    zones: &NoFlyZones,
    radius_m: f64,
) -> Result<Vec<(Polygon, Vec<Polygon>)>, ZoneError> {
    let _ = (zones, radius_m);
    Err(ZoneError::Offset(0))
}
