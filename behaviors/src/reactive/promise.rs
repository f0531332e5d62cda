//! Flies a promised motion: at each moment at the place that was promised for it (D2.7
//! §1.2.3, reactive layer).
//!
//! Following a track corrects the error across it; a promise has a time for each place, so
//! the error along it is corrected too, by the airspeed.
//!
//! # Guarantees
//! In still air an error of place dies away with a time constant of [`CATCH_UP_S`], within
//! the airspeeds of the airframe.

use super::follow::{HORIZON_S, Offset, Track};
use crate::percept::Percept;
use crate::setpoint::{Setpoint, Side};
use skein_flight::airframe::Airframe;
use skein_flight::separation::Motion;
use skein_geometry::Curve;
use skein_geometry::math::wrap_pi;

/// An error along the promise is caught up within about so long, seconds: ten percepts.
pub const CATCH_UP_S: f64 = 2.0;

/// Catching up changes the airspeed by at most this share.
pub const MOST_SHARE: f64 = 0.1;

/// The setpoint that keeps a UAV on its promise.
#[must_use]
pub fn fly(motion: &Motion, percept: &Percept, airframe: &Airframe, height_m: f64) -> Setpoint {
    let on = motion.pose_at(percept.time_ms);
    let (off, d) = (percept.pose.position() - on.position(), on.direction());
    let offset = Offset {
        cross_m: off.y * d.x - off.x * d.y,
        heading_rad: wrap_pi(percept.pose.heading_rad - on.heading_rad),
    };
    let behind_m = -off.dot(&d);
    let steering = motion.steering_from(percept.time_ms, HORIZON_S);
    let promised_mps = steering.first().map_or(airframe.cruise_mps, |s| s.1);
    let most_mps = MOST_SHARE * promised_mps;
    let catch_up_mps = (behind_m / CATCH_UP_S).clamp(-most_mps, most_mps);
    let airspeed_mps = (promised_mps + catch_up_mps).clamp(airframe.stall_mps, airframe.max_mps);
    let pieces: Vec<(f64, f64)> = steering
        .iter()
        .map(|(lasts_s, mps, rate_radps)| (rate_radps / mps, lasts_s * mps))
        .collect();
    let track = Track::new(&Curve::from_pieces(on, &pieces));
    let limit_radps = airframe.max_turn_rate_radps(airspeed_mps);
    Setpoint {
        from_ms: percept.time_ms,
        airspeed_mps,
        height_m,
        steps: track.steps(offset, airspeed_mps, limit_radps),
        loiter: Side::Right,
        gimbal: Vec::new(),
        launch: crate::setpoint::Launch::Stay,
        promised: None,
    }
}
