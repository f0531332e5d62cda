//! What a detector makes of a camera's picture (D2.7 §1.5.2): places with errors, some missed,
//! some that are nothing. Truth stays with the judge.

use super::camera::Camera;
use crate::world::obstacles::Obstacles;
use nalgebra::Matrix2;
use serde::{Deserialize, Serialize};
use skein_flight::tracking::estimate::{Detection, SightErrors};
use skein_flight::tracking::tracks::{Kind, Sighting};
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::{TAU, sin_cos};
use skein_geometry::random::SplitMix64;

/// The errors of a detector and of what carries it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// Of one look.
    pub sight: SightErrors,
    /// Of the UAV's own place, the same for the whole flight, a standard deviation in metres.
    pub place_m: f64,
    /// The share of looks in which a vehicle that is in the picture is recognised.
    pub detection: f64,
    /// The share of looks with a false alarm somewhere in the picture.
    pub false_alarms: f64,
}

impl Noise {
    /// A small camera with a detector on board: 0.6° of attitude and picture, satellite
    /// navigation without corrections, nine of ten vehicles recognised.
    #[must_use]
    pub fn usual() -> Self {
        Self {
            sight: SightErrors {
                angle_rad: 0.01,
                place_m: 0.5,
            },
            place_m: 2.0,
            detection: 0.9,
            false_alarms: 0.05,
        }
    }
}

/// A detector with its draws.
#[derive(Clone, Debug)]
pub(super) struct Sensor {
    noise: Option<Noise>,
    /// How far off its UAV takes itself to be, metres.
    displaced: Vector,
    random: SplitMix64,
}

/// A vehicle as it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub(super) at: Point,
    pub(super) kind: Kind,
}

/// Without noise places are still no better than this, metres: a filter needs some error.
const EXACT_M: f64 = 0.02;

impl Sensor {
    pub(super) fn new(noise: Option<Noise>, seed: u64) -> Self {
        let mut random = SplitMix64::new(seed);
        let place_m = noise.map_or(0.0, |n| n.place_m);
        let displaced = Vector::new(random.normal(), random.normal()) * place_m;
        Self {
            noise,
            displaced,
            random,
        }
    }

    /// How far off its UAV takes itself to be, metres.
    pub(super) fn displaced(&self) -> Vector {
        self.displaced
    }

    /// One look at all vehicles.
    pub(super) fn look(
        &mut self,
        camera: &Camera,
        from: Point,
        height_m: f64,
        vehicles: &[Seen],
        obstacles: Option<&Obstacles>,
    ) -> Vec<Sighting> {
        let Some(noise) = self.noise else {
            let exact = Matrix2::identity() * (EXACT_M * EXACT_M);
            let seen = vehicles.iter().filter(|v| camera.sees(v.at, obstacles));
            return seen
                .map(|v| Sighting {
                    detection: Detection {
                        at: v.at,
                        covariance_m2: exact,
                    },
                    kind: v.kind,
                })
                .collect();
        };
        let mut sightings = Vec::new();
        for v in vehicles {
            let recognised = self.random.unit() < noise.detection;
            let off = Vector::new(self.random.normal(), self.random.normal());
            if recognised && camera.sees(v.at, obstacles) {
                let mut detection = Detection::from_sight(from, height_m, v.at, &noise.sight);
                detection.at += rooted(&detection.covariance_m2, off) + self.displaced;
                sightings.push(Sighting {
                    detection,
                    kind: v.kind,
                });
            }
        }
        let alarm = self.random.unit() < noise.false_alarms;
        let (way, far, what) = (
            self.random.unit() * TAU,
            self.random.unit().sqrt(),
            self.random.below(usize::from(super::KINDS)),
        );
        if let Some(middle) = camera.middle().filter(|_| alarm) {
            let (s, c) = sin_cos(way);
            let at = middle + Vector::new(c, s) * (far * 0.3 * height_m);
            let detection = Detection::from_sight(from, height_m, at, &noise.sight);
            #[allow(clippy::cast_possible_truncation, reason = "a few kinds")]
            let kind = Kind(what as u8);
            sightings.push(Sighting { detection, kind });
        }
        sightings
    }
}

/// Draws of the standard normal distribution, spread as a covariance says.
pub(crate) fn rooted(covariance_m2: &Matrix2<f64>, off: Vector) -> Vector {
    let root = covariance_m2.cholesky().map(|c| c.l());
    root.map_or_else(Vector::zeros, |l| l * off)
}
