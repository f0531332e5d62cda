//! How a mission's camera is held in its airframe (D2.7 §1.2.1, §2.2).

use serde::{Deserialize, Serialize};

/// What is farther away than the corner of a picture from straight above, by this factor, is too
/// small to be recognised: a tilted picture shows the ground to the horizon.
pub const RESOLVED: f64 = 1.1;

/// What each angle that a UAV is told of itself and its camera may be off, radians: a quarter of a
/// degree.
pub const TOLD_RAD: f64 = 0.004;

/// What the direction of a picture may be off by that, radians: about either axis two angles add,
/// and both axes do so by Pythagoras.
pub const DIRECTION_OFF_RAD: f64 = 3.0 * TOLD_RAD;

/// So much farther than wings bank a gimbal has to roll to hold a picture in turns, radians: for
/// the error of the path, which it looks across to.
pub const ROLL_SPARE_RAD: f64 = 0.05;

/// How a camera is held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Mount {
    /// It looks straight down whatever the airframe does: something else levels it.
    #[default]
    Level,
    /// It looks out of the belly, and its picture tilts with bank and pitch.
    Fixed,
    /// It is turned in roll and pitch as it is told.
    Gimbal(Gimbal),
}

/// A gimbal of two axes: the outer one rolls, the inner one pitches.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gimbal {
    /// How far it rolls to either side of straight out of the belly, radians.
    pub roll_rad: f64,
    /// How far it pitches forwards and backwards from there, radians.
    pub pitch_rad: f64,
    /// How fast it turns about each axis, rad/s.
    pub rate_radps: f64,
}

impl Mount {
    /// Whether its picture never tilts.
    #[must_use]
    pub fn is_level(&self) -> bool {
        *self == Self::Level
    }

    /// The gimbal, if it is on one.
    #[must_use]
    pub fn gimbal(&self) -> Option<Gimbal> {
        match self {
            Self::Gimbal(gimbal) => Some(*gimbal),
            Self::Level | Self::Fixed => None,
        }
    }

    /// Whether a gimbal holds its picture in turns in which wings bank so far, radians.
    #[must_use]
    pub fn holds_in_turns(&self, bank_rad: f64) -> bool {
        let gimbal = self.gimbal();
        gimbal.is_some_and(|g| g.roll_rad >= bank_rad + ROLL_SPARE_RAD)
    }
}
