//! What the detectors on board of a mission's UAVs have in common: what is in the picture of
//! their camera, places with errors, some missed; drawn from the seed, the UAV and the
//! time alone, so who asks twice at one time is told the same.

use super::camera::Picture;
use super::motion::Kinematic;
use super::obstacles::{Obstacles, Place};
use crate::pursuit::sensor::{Noise, rooted};
use skein_flight::tracking::estimate::Detection;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::random::{SplitMix64, mix};

/// What a UAV has in its picture, from where.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    picture: Picture,
    from: Place,
}

impl Sight {
    /// That of a UAV as it is now.
    pub fn of(body: &Kinematic) -> Self {
        Self {
            picture: body.picture(),
            from: Place {
                at: body.position(),
                height_m: body.height_m(),
            },
        }
    }

    /// Whether a place is in the picture.
    pub fn shows(&self, at: Point) -> bool {
        self.picture.shows(at, 1.0)
    }

    /// Whether a place is in the picture, and nothing stands in between.
    pub fn sees(&self, place: Place, obstacles: &Obstacles) -> bool {
        self.shows(place.at) && obstacles.sees(self.from, place)
    }
}

/// What is drawn for one look.
#[derive(Debug)]
pub struct Look {
    /// Tells looks of UAVs and times apart.
    pub seed: u64,
    /// By how much detectors err.
    pub noise: Noise,
    /// What else is drawn for it.
    pub random: SplitMix64,
    /// How far off its UAV takes itself to be, metres.
    displaced: Vector,
}

/// Tells UAVs apart.
fn of_uav(seed: u64, uav: u16) -> u64 {
    mix(seed ^ u64::from(uav) << 48)
}

/// How far off a UAV takes itself to be for the whole flight, metres.
pub fn displaced(seed: u64, uav: u16, noise: &Noise) -> Vector {
    let mut random = SplitMix64::new(of_uav(seed, uav));
    Vector::new(random.normal(), random.normal()) * noise.place_m
}

impl Look {
    /// The look of a UAV at a time.
    pub fn new(seed: u64, uav: u16, now_ms: u64) -> Self {
        let noise = Noise::usual();
        let displaced = displaced(seed, uav, &noise);
        let seed = of_uav(seed, uav) ^ now_ms;
        Self {
            seed,
            noise,
            random: SplitMix64::new(mix(seed)),
            displaced,
        }
    }

    /// Whether the next thing is recognised, and how far off its place is taken, in standard
    /// deviations.
    pub fn recognised(&mut self) -> (bool, Vector) {
        let is_recognised = self.random.unit() < self.noise.detection;
        let off = Vector::new(self.random.normal(), self.random.normal());
        (is_recognised, off)
    }

    /// How far off its UAV takes itself to be, metres.
    pub fn displaced(&self) -> Vector {
        self.displaced
    }

    /// Where something is told to be that is so far off its place, with the error that is told:
    /// seen from there, from so high above it, metres.
    pub fn told(
        &self,
        (from, height_m): (Point, f64),
        at: Point,
        off: Vector,
    ) -> (Point, Detection) {
        let told = Detection::from_sight(from, height_m, at, &self.noise.sight);
        let at = at + rooted(&told.covariance_m2, off) + self.displaced;
        (at, told)
    }
}
