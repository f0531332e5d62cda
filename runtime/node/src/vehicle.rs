//! The vehicle under the peer: percepts up, setpoints down (D2.7 §1.1).
//!
//! [`crate::simulator`] has one; an autopilot's (PX4, `ArduPilot`) would be another file: it
//! turns telemetry into percepts, five a second in the scenarios, and flies setpoints, an
//! airspeed, a height and up to eight timed turn rates. It owes the failsafe: without a
//! setpoint for a second the airframe loiters by itself, on the side that the last one
//! named; where that one says what others were promised, it flies that instead. A ground station
//! has no vehicle.

use skein_behaviors::{Percept, Setpoint};
use std::future::Future;

/// What the driver needs of a vehicle.
pub trait Vehicle: Send {
    /// What it senses next: the newest, not what waited behind it. A vehicle that is
    /// gone senses nothing any more. Cancel-safe.
    fn sense(&mut self) -> impl Future<Output = Percept> + Send;

    /// Flies this from now on. What cannot be delivered is dropped.
    fn fly(&mut self, setpoint: Setpoint) -> impl Future<Output = ()> + Send;
}

/// Perhaps no vehicle.
impl<V: Vehicle> Vehicle for Option<V> {
    async fn sense(&mut self) -> Percept {
        match self {
            Some(vehicle) => vehicle.sense().await,
            None => std::future::pending().await,
        }
    }

    async fn fly(&mut self, setpoint: Setpoint) {
        if let Some(vehicle) = self {
            vehicle.fly(setpoint).await;
        }
    }
}
