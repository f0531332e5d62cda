//! What a UAV senses, from a simulator or an autopilot.

use crate::attitude::Attitude;
use crate::contour::ContourLook;
use crate::crowd::CrowdLook;
use crate::obstacle::Obstacles;
use crate::sightings::Sightings;
use crate::traffic::Traffic;
use serde::{Deserialize, Serialize};
use skein_geometry::frame::Pose;

/// One reading of all sensors that matter here.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Percept {
    /// The vehicle's scenario time at which this held, milliseconds.
    pub time_ms: u64,
    /// Where the UAV is.
    pub pose: Pose,
    /// Height above the origin, metres.
    pub height_m: f64,
    /// Airspeed, m/s.
    pub airspeed_mps: f64,
    /// Wind, m/s towards east.
    pub wind_east_mps: f64,
    /// Wind, m/s towards north.
    pub wind_north_mps: f64,
    /// Whether nobody tells the wind, and the two above say nothing: then it is estimated
    /// ([`crate::wind_estimate`]).
    #[serde(default, skip_serializing_if = "core::ops::Not::not")]
    pub wind_unknown: bool,
    /// Flight time left at cruise, seconds.
    pub endurance_s: f64,
    /// Time until it takes off, milliseconds; 0 in the air.
    #[serde(default)]
    pub takes_off_in_ms: u32,
    /// Whether it stands on its launcher, next to go, and takes off at the word of its computer
    /// alone ([`crate::setpoint::Launch`]): not before `takes_off_in_ms`, which stays above 0.
    #[serde(default, skip_serializing_if = "core::ops::Not::not")]
    pub launch_ready: bool,
    /// Whether the airframe flies its own failsafe loiter for want of setpoints.
    pub failsafe: bool,
    /// The circle in which it ends for want of setpoints because others were promised it: its
    /// curvature, 1/m, positive to the left.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub circles_per_m: Option<f64>,
    /// For how long it flies the way there that others were promised, milliseconds; 0 on the
    /// circle, and where there is none.
    #[serde(default)]
    pub circles_in_ms: u32,
    /// Other UAVs that it senses.
    #[serde(default, skip_serializing_if = "Traffic::is_absent")]
    pub traffic: Traffic,
    /// What it senses that stands in its way and may be on no map.
    #[serde(default, skip_serializing_if = "Obstacles::is_absent")]
    pub obstacles: Obstacles,
    /// Vehicles that its camera sees.
    #[serde(default, skip_serializing_if = "Sightings::is_absent")]
    pub sightings: Sightings,
    /// What its camera sees of a contour.
    #[serde(default, skip_serializing_if = "ContourLook::is_absent")]
    pub contour: ContourLook,
    /// What its camera sees of a crowd.
    #[serde(default, skip_serializing_if = "CrowdLook::is_absent")]
    pub crowd: CrowdLook,
    /// How it is tilted, where its camera is not held level by something else.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub attitude: Option<Attitude>,
}
