//! Each setpoint with where the gimbal turns (D2.7 §1.2.1), so that the picture stays on the
//! ground that is planned.

use super::Executive;
use crate::event::Event;
use crate::percept::Percept;
use crate::reactive::gaze::{Gaze, hold};
use crate::setpoint::Setpoint;

impl Executive {
    /// Answers a percept with a setpoint, already passed through the envelope.
    pub fn step(
        &mut self,
        percept: &Percept,
        is_open: &dyn Fn(u16) -> bool,
    ) -> (Setpoint, Vec<Event>) {
        self.note_height(percept);
        let (mut setpoint, events) = self.steer(percept, is_open);
        let (airframe, attitude) = (&self.transit.airframe, percept.attitude);
        let Some((gimbal, attitude)) = airframe.mount.gimbal().zip(attitude) else {
            return (setpoint, events);
        };
        let gaze = Gaze {
            gimbal,
            attitude,
            track: (!self.is_pursuing() && !self.evades()).then_some(&self.track),
        };
        setpoint.gimbal = hold(&gaze, percept, &setpoint);
        if let Some(played) = &mut self.played {
            played.gimbal.clone_from(&setpoint.gimbal);
        }
        (setpoint, events)
    }
}
