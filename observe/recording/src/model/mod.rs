//! The model of what a run shows.
//!
//! A run is one [`Scene`], then [`Frame`]s and [`Event`]s in the order of their times, then one
//! [`End`]; somewhere between them stands the [`FailureFree`] run, where one is known. Another scene follows wherever the mission changes: what was covered, claimed or
//! orphaned before it says nothing about its cells. All is JSON in `snake_case` with the unit
//! in the name; places are told twice, in metres east and north of the scene's origin, in which
//! things are drawn, and in degrees of WGS84. Numbers are rounded to millimetres and to 1e-7
//! degrees.
//!
//! Who knows it is told with it: frames are the truth of the simulated world, each event has
//! its [`Origin`](event::Origin).

pub mod event;
pub mod frame;
pub mod scene;

pub use event::{Event, What};
pub use frame::Frame;
pub use scene::Scene;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use skein_geometry::frame::{Origin, Point};
use skein_netsim::account::RunReport;

/// Counted up when something of the model changes its meaning or goes; what is new leaves it as
/// it is.
pub const MODEL_VERSION: u32 = 1;

/// A position of the plane and on the ellipsoid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Place {
    /// East of the scene's origin, metres.
    pub east_m: f64,
    /// North of the scene's origin, metres.
    pub north_m: f64,
    /// Latitude, degrees (WGS84).
    pub lat_deg: f64,
    /// Longitude, degrees (WGS84).
    pub lon_deg: f64,
}

impl Place {
    /// A point of the plane round an origin.
    #[must_use]
    pub fn of(origin: &Origin, p: Point) -> Self {
        let (lat_deg, lon_deg) = origin.to_geodetic(p);
        Self {
            east_m: rounded(p.x, 1e3),
            north_m: rounded(p.y, 1e3),
            lat_deg: rounded(lat_deg, 1e7),
            lon_deg: rounded(lon_deg, 1e7),
        }
    }

    /// The same in the plane.
    #[must_use]
    pub fn point(&self) -> Point {
        Point::new(self.east_m, self.north_m)
    }
}

/// A closed line, the first corner not repeated.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Ring {
    /// Its corners, east and north of the scene's origin, metres.
    pub east_north_m: Vec<[f64; 2]>,
    /// The same corners, latitude and longitude, degrees (WGS84).
    pub lat_lon_deg: Vec<[f64; 2]>,
}

impl Ring {
    /// Corners of the plane round an origin.
    #[must_use]
    pub fn of(origin: &Origin, corners: &[Point]) -> Self {
        let places = corners.iter().map(|p| Place::of(origin, *p));
        let (east_north_m, lat_lon_deg) = places
            .map(|p| ([p.east_m, p.north_m], [p.lat_deg, p.lon_deg]))
            .unzip();
        Self {
            east_north_m,
            lat_lon_deg,
        }
    }
}

/// The last word of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct End {
    /// When it ended, milliseconds of scenario time.
    pub time_ms: u64,
    /// What the run came to: every field is told in `docs/report.md`.
    #[schemars(with = "serde_json::Map<String, serde_json::Value>")]
    pub report: Box<RunReport>,
}

/// The run of the same scenario and seed without failures: what the operator wants happens as
/// in the run itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FailureFree {
    /// Its seed.
    pub seed: u64,
    /// When it ended, milliseconds of scenario time.
    pub end_ms: u64,
    /// When all was covered and everybody knew it, milliseconds of scenario time; none where
    /// that was never so.
    pub makespan_ms: Option<u64>,
    /// Pairs of a time, milliseconds of scenario time, and the covered share by then, between 0
    /// and 1.
    pub coverage: Vec<(u64, f64)>,
}

/// One word of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Record {
    /// What does not change until the next one.
    Scene(Box<Scene>),
    /// How everything stands.
    Frame(Frame),
    /// Something happened.
    Event(Event),
    /// What the run would have been without failures: said once, when it is known.
    FailureFree(FailureFree),
    /// The run is over.
    End(End),
}

impl Record {
    /// When it holds, milliseconds of scenario time.
    #[must_use]
    pub fn time_ms(&self) -> u64 {
        match self {
            Self::Scene(scene) => scene.time_ms,
            Self::Frame(frame) => frame.time_ms,
            Self::Event(event) => event.time_ms,
            Self::FailureFree(_) => 0,
            Self::End(end) => end.time_ms,
        }
    }
}

/// Who knows what a run shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Knowledge {
    /// The simulated world: it is true.
    World,
    /// The swarm's own records: it is believed, and as old as the radio makes it.
    Swarm,
}

/// To the nearest of so many parts of one.
pub(crate) fn rounded(x: f64, parts: f64) -> f64 {
    // Adding zero makes no difference but to the sign of zero, which people need not see.
    (x * parts).round() / parts + 0.0
}
