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

    /// The circle in which it ends, 1/m, positive to the left.
    pub fn circle_per_m(&self) -> Option<f64> {
        self.motion.loiter_per_m()
    }

    /// How long after this time it begins, milliseconds.
    pub fn circles_in_ms(&self, at_ms: u64) -> u32 {
        let left_s = self.motion.ends_at_s() - seconds(at_ms);
        let left_s = left_s.max(0.0);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "not below 0, and above what fits it is as much as that"
        )]
        let left_ms = (left_s * 1e3).ceil() as u32;
        left_ms
    }
}

#[cfg(test)]
mod tests {
    use crate::world::fixture::airframe;
    use crate::world::motion::Kinematic;
    use skein_behaviors::Setpoint;
    use skein_flight::separation::{End, Motion, MotionPlan, Stretch};
    use skein_geometry::frame::{Point, Pose};

    fn plan() -> MotionPlan {
        let stretch = |radius_mm, length_mm| Stretch {
            radius_mm,
            length_mm,
            airspeed_mmps: 13_000,
        };
        let circle = End::Loiter {
            radius_mm: 28_000,
            airspeed_mmps: 13_000,
        };
        MotionPlan {
            stretches: vec![stretch(0, 60_000), stretch(-25_000, 40_000)],
            end: circle,
            ..MotionPlan::on_ground(0, Pose::new(Point::new(0.0, 0.0), 0.4))
        }
    }

    fn silent(promised: Option<MotionPlan>) -> Kinematic {
        let start = Pose::new(Point::new(0.0, 0.0), 0.4);
        let mut k = Kinematic::new(airframe(), start, 45.0, 0);
        let setpoint = Setpoint {
            from_ms: 0,
            airspeed_mps: 13.0,
            height_m: 45.0,
            steps: vec![skein_behaviors::Steer {
                turn_rate_radps: 0.0,
                duration_ms: 2_500,
            }],
            loiter: skein_behaviors::Side::Left,
            gimbal: Vec::new(),
            launch: skein_behaviors::Launch::Stay,
            promised,
        };
        assert!(k.apply(setpoint, 0));
        k
    }

    #[test]
    fn without_setpoints_it_flies_what_others_were_promised() {
        let motion = Motion::new(plan()).unwrap();
        let (mut k, mut other) = (silent(Some(plan())), silent(Some(plan())));
        let mut circled = 0;
        for at_ms in (0..120_000).step_by(500) {
            k.advance(at_ms, &mut Vec::new());
            let off_m = (k.position() - motion.pose_at(at_ms).position()).norm();
            assert!(off_m < 1.0, "{off_m} m off at {at_ms} ms");
            let seen = k.percept().unwrap();
            assert_eq!(seen.failsafe, at_ms >= 1_000);
            let ends_on_it = seen
                .circles_per_m
                .is_some_and(|c| (c - 1.0 / 28.0).abs() < 1e-9);
            assert_eq!(ends_on_it, seen.failsafe);
            let left_ms = if ends_on_it {
                7_693u64.saturating_sub(at_ms)
            } else {
                0
            };
            assert_eq!(u64::from(seen.circles_in_ms), left_ms, "{at_ms}");
            circled += usize::from(ends_on_it && left_ms == 0);
        }
        assert!(circled > 200);
        other.advance(119_500, &mut Vec::new());
        assert_eq!(k.pose(), other.pose(), "however often it is asked");
    }

    #[test]
    fn where_nobody_was_promised_anything_it_loiters_where_it_is() {
        let mut k = silent(None);
        k.advance(1_000, &mut Vec::new());
        let at = k.position();
        k.advance(60_000, &mut Vec::new());
        assert!((k.position() - at).norm() < 40.0 && k.percept().unwrap().circles_per_m.is_none());
    }
}
