//! What several tests of this crate need.

use skein_behaviors::Percept;
use skein_peer::Mission;

/// A percept of that time.
pub fn percept(time_ms: u64) -> Percept {
    let json = serde_json::json!({
        "time_ms": time_ms,
        "pose": { "east_m": 1.0, "north_m": 2.0, "heading_rad": 0.5 },
        "height_m": 60.0,
        "airspeed_mps": 13.0,
        "wind_east_mps": 0.0,
        "wind_north_mps": 0.0,
        "endurance_s": 2400.0,
        "failsafe": false,
    });
    serde_json::from_value(json).unwrap()
}

/// A mission of ten by eight cells over open country.
pub fn mission() -> Mission {
    let json = serde_json::json!({
        "revision": 1,
        "origin_lat_e7": 601_655_000,
        "origin_lon_e7": 249_355_000,
        "area": [[0, 0], [480_000, 0], [480_000, 384_000], [0, 384_000]],
        "zones": [],
        "lane_spacing_mm": 48_000,
        "turn_radius_mm": 23_000,
        "clearance_mm": 8_000,
        "footprint_across_mm": 46_000,
        "footprint_along_mm": 36_000,
        "tracking_error_mm": 2_000,
        "launch": [0, 0],
        "base": [240_000, 192_000],
    });
    serde_json::from_value(json).unwrap()
}
