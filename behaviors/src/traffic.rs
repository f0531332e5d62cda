//! What a UAV senses of others near by, whether or not they speak to it: by their
//! transponders, by remote identification, or by a radar of its own.

use serde::{Deserialize, Serialize};
use skein_geometry::frame::{Point, Vector};

/// Most UAVs that a reading holds, the nearest. Who senses that many plans nothing new: there
/// may be more.
pub const TRAFFIC_MAX: usize = 16;

/// Of decimetres.
fn metres(dm: impl Into<f64>) -> f64 {
    dm.into() / 10.0
}

/// One other UAV.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sighting {
    /// Who.
    pub id: u16,
    /// Where, decimetres east of the mission's origin.
    pub east_dm: i32,
    /// Where, decimetres north of it.
    pub north_dm: i32,
    /// How high above it, decimetres.
    #[serde(default)]
    pub height_dm: i32,
}

impl Sighting {
    /// Where, in metres.
    #[must_use]
    pub fn at(&self) -> Point {
        Point::new(metres(self.east_dm), metres(self.north_dm))
    }

    /// How high above the origin, in metres.
    #[must_use]
    pub fn height_m(&self) -> f64 {
        metres(self.height_dm)
    }
}

/// Most aircraft that are no members that a reading holds, the nearest.
pub const AIRCRAFT_MAX: usize = 8;

/// An aircraft that is no member: it says nothing, agrees to nothing, and makes way for nobody.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct Aircraft {
    /// Where, decimetres east of the mission's origin.
    pub east_dm: i32,
    /// Where, decimetres north of it.
    pub north_dm: i32,
    /// How high above it, decimetres.
    pub height_dm: i32,
    /// How fast over the ground, decimetres a second to the east.
    pub east_dmps: i16,
    /// And to the north.
    pub north_dmps: i16,
}

impl Aircraft {
    /// Where, in metres.
    #[must_use]
    pub fn at(&self) -> Point {
        Point::new(metres(self.east_dm), metres(self.north_dm))
    }

    /// How high above the origin, in metres.
    #[must_use]
    pub fn height_m(&self) -> f64 {
        metres(self.height_dm)
    }

    /// How fast over the ground, m/s.
    #[must_use]
    pub fn velocity_mps(&self) -> Vector {
        Vector::new(metres(self.east_dmps), metres(self.north_dmps))
    }
}

/// All that is sensed of others at one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Traffic {
    /// Whoever is nearer than this is sensed, metres; 0 without a sensor.
    pub range_m: f64,
    seen: [Option<Sighting>; TRAFFIC_MAX],
    /// Those who are no members.
    #[serde(default, skip_serializing_if = "nobody")]
    aircraft: [Option<Aircraft>; AIRCRAFT_MAX],
}

fn nobody(aircraft: &[Option<Aircraft>; AIRCRAFT_MAX]) -> bool {
    aircraft.iter().all(Option::is_none)
}

impl Traffic {
    /// A reading of a sensor: of more than [`TRAFFIC_MAX`] the first, so the nearest come
    /// first.
    #[must_use]
    pub fn new(range_m: f64, nearest_first: impl IntoIterator<Item = Sighting>) -> Self {
        let mut seen = [None; TRAFFIC_MAX];
        for (place, sighting) in seen.iter_mut().zip(nearest_first) {
            *place = Some(sighting);
        }
        Self {
            range_m,
            seen,
            aircraft: [None; AIRCRAFT_MAX],
        }
    }

    /// The same with aircraft that are no members: of more than [`AIRCRAFT_MAX`] the first, so the
    /// nearest come first.
    #[must_use]
    pub fn with_aircraft(mut self, nearest_first: impl IntoIterator<Item = Aircraft>) -> Self {
        for (place, aircraft) in self.aircraft.iter_mut().zip(nearest_first) {
            *place = Some(aircraft);
        }
        self
    }

    /// Whether there is no sensor.
    #[must_use]
    pub fn is_absent(&self) -> bool {
        !self.is_sensed()
    }

    /// Whether there is a sensor.
    #[must_use]
    pub fn is_sensed(&self) -> bool {
        self.range_m > 0.0
    }

    /// Whether there may be more than it holds.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.seen.iter().all(Option::is_some)
    }

    /// Aircraft that are sensed and are no members.
    pub fn aircraft(&self) -> impl Iterator<Item = &Aircraft> {
        self.aircraft.iter().flatten()
    }

    /// Who is sensed.
    pub fn seen(&self) -> impl Iterator<Item = &Sighting> {
        self.seen.iter().flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reading_holds_the_nearest() {
        let all = (0..20).map(|id| Sighting {
            id,
            ..Sighting::default()
        });
        let traffic = Traffic::new(500.0, all);
        assert!(traffic.is_sensed());
        let ids: Vec<u16> = traffic.seen().map(|s| s.id).collect();
        assert_eq!(ids, (0..16).collect::<Vec<u16>>());
        assert!(traffic.is_full());
        assert!(!Traffic::default().is_sensed());
    }
}
