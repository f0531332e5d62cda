//! Places as people write them at consoles, and as they are told them.

use skein_geometry::frame::Origin;
use skein_interop::place::{LatLon, from_plane};
use skein_peer::Overview;
use skein_peer::mission::{PointMm, point_m};

/// Finite numbers with commas between them.
pub fn numbers(text: &str) -> Option<Vec<f64>> {
    let number = |part: &str| part.trim().parse().ok().filter(|x: &f64| x.is_finite());
    text.split(',').map(number).collect()
}

/// A place on the earth.
pub fn place(lat_deg: f64, lon_deg: f64) -> Option<LatLon> {
    let on_earth = lat_deg.abs() <= 90.0 && lon_deg.abs() <= 180.0;
    on_earth.then_some(LatLon { lat_deg, lon_deg })
}

/// Degrees north and east.
pub fn corner(text: &str) -> Result<LatLon, String> {
    let found = match numbers(text).as_deref() {
        Some([lat_deg, lon_deg]) => place(*lat_deg, *lon_deg),
        _ => None,
    };
    found.ok_or_else(|| "write degrees north and east, for example 60.1655,24.9355".to_owned())
}

/// The origin of the mission's plane.
pub fn origin(overview: &Overview) -> Origin {
    Origin {
        lat_deg: overview.origin_lat_deg,
        lon_deg: overview.origin_lon_deg,
    }
}

fn degrees(origin: Origin, points: &[PointMm]) -> impl Iterator<Item = LatLon> {
    points.iter().map(move |p| from_plane(origin, point_m(*p)))
}

/// Points of the plane as latitudes and longitudes, degrees.
pub fn pairs(origin: Origin, points: &[PointMm]) -> Vec<[f64; 2]> {
    let all = degrees(origin, points);
    all.map(|p| [p.lat_deg, p.lon_deg]).collect()
}

/// The same in a line of text.
pub fn words(origin: Origin, points: &[PointMm]) -> String {
    let all = degrees(origin, points);
    let all: Vec<String> = all
        .map(|p| format!("{:.6},{:.6}", p.lat_deg, p.lon_deg))
        .collect();
    all.join(" ")
}
