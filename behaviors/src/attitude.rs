//! How an airframe is tilted, and how its camera is turned in it (D2.7 §1.2.1).

use serde::{Deserialize, Serialize};

/// The angles from which a UAV knows what its camera shows.
///
/// The nose goes up by the pitch, then the left wing down by the bank; in the airframe the outer
/// axis of a gimbal adds to the bank, and the inner one lifts the picture forwards.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Attitude {
    /// The left wing down, radians.
    pub bank_rad: f64,
    /// The nose up, radians.
    pub pitch_rad: f64,
    /// The gimbal about the length of the airframe, as the bank, radians.
    pub gimbal_roll_rad: f64,
    /// The gimbal about its inner axis, the picture forwards, radians.
    pub gimbal_pitch_rad: f64,
}

impl Attitude {
    /// Whether all angles are numbers.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let all = [
            self.bank_rad,
            self.pitch_rad,
            self.gimbal_roll_rad,
            self.gimbal_pitch_rad,
        ];
        all.iter().all(|v| v.is_finite())
    }

    /// The angles a share of the way from these to others.
    #[must_use]
    pub fn towards(&self, other: &Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * share;
        Self {
            bank_rad: mix(self.bank_rad, other.bank_rad),
            pitch_rad: mix(self.pitch_rad, other.pitch_rad),
            gimbal_roll_rad: mix(self.gimbal_roll_rad, other.gimbal_roll_rad),
            gimbal_pitch_rad: mix(self.gimbal_pitch_rad, other.gimbal_pitch_rad),
        }
    }
}
