//! What a UAV senses that stands in its way and is on no map (D2.7 §1.2.3): a crane, a mast, a
//! tethered balloon.

use serde::{Deserialize, Serialize};
use skein_geometry::frame::Point;

/// Most that a reading holds, the nearest.
pub const OBSTACLES_MAX: usize = 8;

/// Something that stands there through all heights at which UAVs fly.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct Obstacle {
    /// Its middle, decimetres east of the mission's origin.
    pub east_dm: i32,
    /// And north of it.
    pub north_dm: i32,
    /// All of it is nearer to its middle than this, decimetres.
    pub radius_dm: u16,
}

impl Obstacle {
    /// Its middle, in metres.
    #[must_use]
    pub fn at(&self) -> Point {
        Point::new(
            f64::from(self.east_dm) / 10.0,
            f64::from(self.north_dm) / 10.0,
        )
    }

    /// How far from its middle it reaches, metres.
    #[must_use]
    pub fn radius_m(&self) -> f64 {
        f64::from(self.radius_dm) / 10.0
    }
}

/// All that is sensed of obstacles at one moment.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Obstacles([Option<Obstacle>; OBSTACLES_MAX]);

impl Obstacles {
    /// A reading of a sensor: of more than [`OBSTACLES_MAX`] the first, so the nearest come first.
    #[must_use]
    pub fn new(nearest_first: impl IntoIterator<Item = Obstacle>) -> Self {
        let mut all = Self::default();
        for (place, obstacle) in all.0.iter_mut().zip(nearest_first) {
            *place = Some(obstacle);
        }
        all
    }

    /// Whether nothing is sensed.
    #[must_use]
    pub fn is_absent(&self) -> bool {
        self.0.iter().all(Option::is_none)
    }

    /// What is sensed.
    pub fn sensed(&self) -> impl Iterator<Item = &Obstacle> {
        self.0.iter().flatten()
    }
}
