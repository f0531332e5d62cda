//! The formats of the outside world: QGroundControl plans and GeoJSON; and the one reader
//! of JSON and JSON5 that keeps places, for these and for Skein's own files.
//!
//! Text in, text out: no files are opened here, and nothing of WGS84 leaves this
//! crate but through [`place::to_plane`]. Malformed input is refused with line, column
//! and path of the value that is wrong; what is well-formed but has no meaning for
//! Skein comes back as a [`Notice`], so that nothing is dropped silently.
//!
//! | module | what it holds |
//! |---|---|
//! | [`json`] | a parsed text whose values know their places |
//! | [`place`] | latitude and longitude, rings, circles, the way to a mission's plane |
//! | [`plan`] | QGroundControl `.plan`, read: geofence, surveys, waypoints |
//! | [`mission`] | QGroundControl `.plan`, written: what one UAV uploads |
//! | [`geojson`] | areas, and buildings with heights |
//! | [`targets`] | points and lines to look at, of both formats |
//! | [`airframe`] | airframes of scenarios and of peers, with their limits |
//! | [`mount`] | how cameras are held |
//! | [`fleet`] | fleet files of plans for a team |
//! | [`height`] | heights as map data writes them: `12.13 m`, `3.5`, `40 ft` |
//!
//! ```
//! let text = r#"{"type":"FeatureCollection","features":[{"type":"Feature",
//!     "properties":{"building":"yes","building:levels":"2.5"},
//!     "geometry":{"type":"Polygon","coordinates":[[[24.9,60.1],[24.91,60.1],[24.91,60.11],[24.9,60.1]]]}}]}"#;
//! let read = skein_interop::geojson::buildings(text, &Default::default()).unwrap();
//! assert_eq!(read.buildings.len(), 1);
//! assert!((read.buildings[0].height_m - 7.5).abs() < 1e-9);
//! ```

pub mod airframe;
pub mod fleet;
pub mod geojson;
pub mod height;
pub mod json;
pub mod landing;
pub mod mission;
pub mod mount;
pub mod place;
pub mod plan;
pub mod targets;

use core::fmt;

/// Something in the input that was understood, but not used as it stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Notice {
    /// JSON pointer (RFC 6901) of the value.
    pub pointer: String,
    /// What it is and what was done with it.
    pub text: String,
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at {}: {}", self.pointer, self.text)
    }
}
