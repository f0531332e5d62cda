//! What a UAV can fly: airspeeds, bank, endurance (D2.7 §1.1, §2.2).

use crate::mount::Mount;
use serde::{Deserialize, Serialize};
use skein_geometry::math::{acos, atan2, cos, tan};

/// Standard gravity, m/s².
pub const GRAVITY_MPS2: f64 = 9.806_65;

/// How fast the wings roll into a turn and out of it, rad/s: 60° a second.
pub const ROLL_RATE_RADPS: f64 = core::f64::consts::FRAC_PI_3;

/// Share of the ground speed that turns may need in a wind: following them takes the rest.
const TURN_AUTHORITY: f64 = 0.97;

/// The least airspeed that is commanded in level flight, in stall speeds: a gust of a
/// tenth must not stall the wing.
const STALL_MARGIN: f64 = 1.1;

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
    /// How the camera is held: both halves are those of a picture from straight above.
    #[serde(default, skip_serializing_if = "Mount::is_level")]
    pub mount: Mount,
    /// How fast it climbs and descends at any airspeed, m/s.
    #[serde(default = "usual_climb_mps", skip_serializing_if = "is_usual_climb")]
    pub climb_mps: f64,
}

/// How fast an airframe climbs that does not say so, m/s: what small fixed wings do at cruise.
pub const CLIMB_MPS: f64 = 3.0;

fn usual_climb_mps() -> f64 {
    CLIMB_MPS
}

#[allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde hands over a reference"
)]
fn is_usual_climb(climb_mps: &f64) -> bool {
    climb_mps.to_bits() == CLIMB_MPS.to_bits()
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
        self.banked_radius_m(airspeed_mps, self.max_bank_rad)
    }

    /// Radius of a coordinated turn at `airspeed_mps` and a bank, metres.
    #[must_use]
    pub fn banked_radius_m(&self, airspeed_mps: f64, bank_rad: f64) -> f64 {
        airspeed_mps * airspeed_mps / (GRAVITY_MPS2 * tan(bank_rad))
    }

    /// The least radius of a turn over the ground that can be followed at `airspeed_mps`
    /// in a wind of `wind_mps`, with a little to spare for corrections, metres: the
    /// answer of [`Airframe::airspeed_for_turns_mps`], asked for the radius.
    #[must_use]
    pub fn ground_turn_radius_m(&self, airspeed_mps: f64, wind_mps: f64) -> f64 {
        self.turn_radius_m((airspeed_mps + wind_mps) / TURN_AUTHORITY)
    }

    /// The airspeed, at most cruise, at which turns of `radius_m` over the ground can be
    /// followed in a wind of `wind_mps`, with a little to spare for corrections, m/s; may
    /// be below the stall.
    ///
    /// Downwind such a turn needs the turn rate (V + w)²/(V r), and so g tan φ = (V + w)²/r.
    #[must_use]
    pub fn airspeed_for_turns_mps(&self, radius_m: f64, wind_mps: f64) -> f64 {
        let most = (radius_m * GRAVITY_MPS2 * tan(self.max_bank_rad)).sqrt();
        self.cruise_mps.min(TURN_AUTHORITY * most - wind_mps)
    }

    /// The bank of a coordinated turn, radians, positive to the left: tan φ = V ω / g.
    #[must_use]
    pub fn bank_rad(airspeed_mps: f64, turn_rate_radps: f64) -> f64 {
        atan2(airspeed_mps * turn_rate_radps, GRAVITY_MPS2)
    }

    /// The fastest turn at `airspeed_mps`, rad/s.
    #[must_use]
    pub fn max_turn_rate_radps(&self, airspeed_mps: f64) -> f64 {
        GRAVITY_MPS2 * tan(self.max_bank_rad) / airspeed_mps
    }

    /// The steepest bank at `airspeed_mps` that neither the airframe nor the stall
    /// forbids, radians: the wing of a coordinated turn carries 1/cos φ times the
    /// weight, and its stalling speed grows with the root of that. Zero at or below
    /// the stall.
    #[must_use]
    pub fn steepest_bank_rad(&self, airspeed_mps: f64) -> f64 {
        let share = self.stall_mps / airspeed_mps;
        self.max_bank_rad.min(acos(share * share))
    }

    /// The least airspeed that is commanded, m/s: a tenth above the stall, and no less
    /// than the wing needs in the steepest turn, where it carries 1/cos φ times the
    /// weight; at most cruise, at which turns are planned.
    #[must_use]
    pub fn least_airspeed_mps(&self) -> f64 {
        let turning_mps = self.stall_in_turn_mps(self.max_bank_rad);
        let least_mps = turning_mps.max(STALL_MARGIN * self.stall_mps);
        least_mps.min(self.cruise_mps)
    }

    /// Airspeed at which the wing stalls in a coordinated turn, m/s.
    #[must_use]
    pub fn stall_in_turn_mps(&self, bank_rad: f64) -> f64 {
        self.stall_mps / cos(bank_rad).max(f64::MIN_POSITIVE).sqrt()
    }
}

/// Airspeed of least power as a multiple of the stall's, for propeller aircraft of the
/// aspect ratios that survey UAVs have (usual values are 1.2 to 1.3).
const LEAST_POWER_STALLS: f64 = 1.25;

/// Power in level flight and in turns, as a share of that in level cruise.
///
/// Parasitic drag costs a power that grows with the cube of the airspeed V, induced
/// drag n²/V for a load factor n = 1/cos φ at bank φ:
///
/// P(V, φ) = a V³ + b / (V cos² φ).
///
/// Two facts that an airframe states fix a and b: P = 1 at level cruise, which is what
/// its endurance is given for, and least power at 1.25 times the stall, where
/// b = 3 a V⁴. So energies are seconds of cruise and compare with the endurance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerModel {
    parasitic: f64,
    induced: f64,
}

impl PowerModel {
    /// The model of an airframe.
    #[must_use]
    pub fn of(airframe: &Airframe) -> Self {
        let least = LEAST_POWER_STALLS * airframe.stall_mps;
        let ratio = 3.0 * least * least * least * least;
        let v = airframe.cruise_mps;
        let parasitic = 1.0 / (v * v * v + ratio / v);
        Self {
            parasitic,
            induced: ratio * parasitic,
        }
    }

    /// Power at an airspeed and a bank, as a share of that in level cruise.
    #[must_use]
    pub fn share(&self, airspeed_mps: f64, bank_rad: f64) -> f64 {
        let v = airspeed_mps;
        let level = cos(bank_rad);
        self.parasitic * v * v * v + self.induced / (v * level * level)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_is_one_at_cruise_and_least_above_the_stall() {
        let a = Airframe {
            stall_mps: 9.0,
            cruise_mps: 13.0,
            max_mps: 20.0,
            max_bank_rad: 0.6,
            endurance_s: 1800.0,
            reserve_s: 120.0,
            footprint_across_m: 20.0,
            footprint_along_m: 15.0,
            mount: Mount::Level,
            climb_mps: CLIMB_MPS,
        };
        let p = PowerModel::of(&a);
        assert!((p.share(13.0, 0.0) - 1.0).abs() < 1e-12);
        let least = p.share(11.25, 0.0);
        assert!(p.share(11.0, 0.0) > least && p.share(11.5, 0.0) > least && least < 1.0);
        assert!(p.share(13.0, 0.5) > 1.0, "turning costs");
        assert!((a.steepest_bank_rad(20.0) - 0.6).abs() < 1e-12);
        let slow = a.steepest_bank_rad(9.5);
        assert!(slow < 0.6 && (a.stall_in_turn_mps(slow) - 9.5).abs() < 1e-9);
        assert!(a.steepest_bank_rad(8.0).abs() < 1e-12);
    }
}
