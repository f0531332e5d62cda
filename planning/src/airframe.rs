//! What a UAV can fly: airspeeds, bank, endurance (D2.7 §1.1, §2.2).

use crate::math::tan;
use serde::{Deserialize, Serialize};

/// Standard gravity, m/s².
pub const GRAVITY_MPS2: f64 = 9.806_65;

/// The limits of a fixed-wing airframe and its camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Airframe {
    /// Below this airspeed the wing stalls, m/s.
    pub stall_mps: f64,
    /// The airspeed at which a mission is flown, m/s.
    pub cruise_mps: f64,
    /// The highest airspeed thrust allows, m/s.
    pub max_mps: f64,
    /// The largest bank angle, radians.
    pub max_bank_rad: f64,
    /// Flight time from full tanks at cruise, seconds.
    pub endurance_s: f64,
    /// Flight time that is never planned away, seconds.
    pub reserve_s: f64,
    /// Half the camera footprint across the track at the flight level, metres.
    pub footprint_across_m: f64,
    /// Half the camera footprint along the track at the flight level, metres.
    pub footprint_along_m: f64,
}

impl Airframe {
    /// Radius of a turn at cruise with the largest bank, metres: v² / (g tan φ).
    #[must_use]
    pub fn min_turn_radius_m(&self) -> f64 {
        self.turn_radius_m(self.cruise_mps)
    }

    /// Radius of a turn at `airspeed_mps` with the largest bank, metres.
    #[must_use]
    pub fn turn_radius_m(&self, airspeed_mps: f64) -> f64 {
        airspeed_mps * airspeed_mps / (GRAVITY_MPS2 * tan(self.max_bank_rad))
    }

    /// The fastest turn at `airspeed_mps`, rad/s.
    #[must_use]
    pub fn max_turn_rate_radps(&self, airspeed_mps: f64) -> f64 {
        GRAVITY_MPS2 * tan(self.max_bank_rad) / airspeed_mps
    }
}
