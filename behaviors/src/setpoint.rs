//! What a UAV is told to fly: a short piece of trajectory, timed.
//!
//! Steps carry times relative to the percept they answer, so a setpoint that
//! arrives late does not shift what is flown, and percepts may be seldom.

use serde::{Deserialize, Serialize};
use skein_flight::separation::{Motion, MotionPlan};

/// A side of the UAV.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Side {
    /// Counter-clockwise.
    Left,
    /// Clockwise.
    Right,
}

/// A turn held for a while.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Steer {
    /// Turn rate, rad/s, positive to the left.
    pub turn_rate_radps: f64,
    /// For how long, milliseconds.
    pub duration_ms: u32,
}

/// The most steps a setpoint may hold: a lane, a corner, a lane, a corner and one
/// correction fit into the horizon with room to spare.
pub const MAX_STEPS: usize = 8;

/// Where a gimbal is to be turned in the airframe.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GimbalStep {
    /// Within so long from the step before, evenly, milliseconds.
    pub duration_ms: u32,
    /// About the length of the airframe, as the bank, radians.
    pub roll_rad: f64,
    /// About its inner axis, the picture forwards, radians.
    pub pitch_rad: f64,
}

impl GimbalStep {
    /// Whether both angles are numbers.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.roll_rad.is_finite() && self.pitch_rad.is_finite()
    }
}

/// The most steps of a gimbal: until the airframe's failsafe acts, and half a second to spare,
/// in tenths of a second.
pub const MAX_GIMBAL_STEPS: usize = 16;

/// What a UAV that stands ready on its launcher is told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Launch {
    /// It has nothing to fly for: the next one may go before it.
    #[default]
    Stay,
    /// It is to take off, and not yet: others who fly here are asked first.
    Wish,
    /// It takes off at this time, milliseconds.
    At(u64),
}

impl Launch {
    fn is_stay(&self) -> bool {
        *self == Self::Stay
    }
}

/// A command to the airframe.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setpoint {
    /// The time of the percept that this answers, milliseconds.
    pub from_ms: u64,
    /// Airspeed to hold, m/s.
    pub airspeed_mps: f64,
    /// Height to hold above the origin, metres.
    pub height_m: f64,
    /// Turns from `from_ms` on, one after the other; after the last one its rate is held.
    pub steps: Vec<Steer>,
    /// On which side the failsafe loiter is clear of the zones.
    pub loiter: Side,
    /// How a gimbal is turned from `from_ms` on; after the last one it stays. Empty without one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub gimbal: Vec<GimbalStep>,
    /// What it is told while it stands ready to be launched; of no meaning in the air.
    #[serde(default, skip_serializing_if = "Launch::is_stay")]
    pub launch: Launch,
    /// What others were promised that it flies, where they were: what the airframe flies for want
    /// of newer setpoints, instead of the failsafe loiter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub promised: Option<MotionPlan>,
}

impl Setpoint {
    /// What others were promised, if it is something that can be flown.
    #[must_use]
    pub fn promise(&self) -> Option<Motion> {
        Motion::new(self.promised.clone()?).ok()
    }
}
