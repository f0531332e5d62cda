//! What an airframe flies without setpoints where others were promised its flight (D2.7 §1.3,
//! §2.2): the promised way and, at its end, the promised circle, for ever.
//!
//! Nobody has to hear that its computer is silent: it is where it was to be all the same.

use skein_behaviors::reactive::promise::fly;
use skein_behaviors::{Percept, Setpoint};
use skein_flight::airframe::Airframe;
use skein_flight::separation::Motion;
use skein_geometry::math::seconds;

/// How often its turn is corrected, milliseconds: as often as that of a loiter in a wind.
const STEP_MS: u64 = 100;

/// A flight that others were promised.
#[derive(Clone, Debug)]
pub(super) struct Promised {
    motion: Motion,
    /// When the turn is corrected next, milliseconds.
    until_ms: u64,
}

impl Promised {
    /// What a setpoint says of it.
    pub fn of(setpoint: &Setpoint) -> Option<Self> {
        let motion = setpoint.promise()?;
        let until_ms = 0;
        Some(Self { motion, until_ms })
    }

    /// Turn rate and airspeed from now on, and until when; of who flew like this before, as
    /// long as that is not to be corrected.
    pub fn command(
        &mut self,
        at: &Percept,
        airframe: &Airframe,
        before: (f64, f64),
    ) -> (f64, f64, u64) {
        if at.time_ms < self.until_ms {
            return (before.0, before.1, self.until_ms);
        }
        let wanted = fly(&self.motion, at, airframe, at.height_m);
        let first = wanted.steps.first();
        let lasts_ms = first.map_or(STEP_MS, |s| u64::from(s.duration_ms).clamp(1, STEP_MS));
        self.until_ms = at.time_ms + lasts_ms;
        let rate_radps = first.map_or(0.0, |s| s.turn_rate_radps);
        (rate_radps, wanted.airspeed_mps, self.until_ms)
    }

    /// The circle that is flown at a time, 1/m, positive to the left; none on the way there.
    pub fn circles_per_m(&self, at_ms: u64) -> Option<f64> {
        let begun = seconds(at_ms) >= self.motion.ends_at_s();
        begun.then(|| self.motion.loiter_per_m()).flatten()
    }
}
