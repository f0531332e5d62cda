//! What a peer is told before it starts.

use crate::{Mission, PeerId};
use serde::{Deserialize, Serialize};
pub use skein_flight::airframe::Airframe;
pub use skein_flight::trajectory::timed::Objective;
use std::sync::Arc;

/// What a peer is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Flies and plans.
    Uav,
    /// Stands on the ground, relays, speaks for the operator, never plans.
    #[serde(rename = "ground")]
    GroundStation,
}

/// Where and when a UAV of the fleet is launched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Launch {
    /// Who.
    pub id: u16,
    /// East of the mission's origin, millimetres.
    pub east_mm: i32,
    /// North of it, millimetres.
    pub north_mm: i32,
    /// From the start of the fleet on, milliseconds.
    pub takeoff_ms: u32,
    /// Its cruise speed, mm/s.
    pub speed_mmps: u32,
}

/// The configuration of one peer.
#[derive(Clone, Debug, PartialEq)]
pub struct PeerConfig {
    /// Who it is.
    pub id: PeerId,
    /// What it is for.
    pub role: Role,
    /// First part of every key; peers of other fleets are not heard.
    pub fleet: String,
    /// Beacon period T, milliseconds of the peer's clock.
    pub beacon_period_ms: u32,
    /// Bit rate of the shared radio channel, bit/s.
    pub rate_bps: u32,
    /// The airframe, for a UAV.
    pub airframe: Option<Airframe>,
    /// What transfers off the loop, and the airspeed, should spend little of. Peers of one
    /// mission may differ in it.
    pub objective: Objective,
    /// Height slot above the origin, metres, for a UAV.
    pub height_m: f64,
    /// The mission it was launched with, if any; a ground station speaks it.
    pub mission: Option<Arc<Mission>>,
    /// Who is launched where and when, as planned; empty where nobody planned it. The same for
    /// the whole fleet.
    pub launches: Arc<[Launch]>,
    /// What it carries, for a UAV: a bit for each of [`crate::wire::tasks::SENSORS`], the lowest
    /// for the first.
    pub sensors: u32,
    /// Seed of the peer's own random stream (beacon jitter, boot nonce).
    pub seed: u64,
}
