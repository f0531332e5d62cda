//! Holds the planned footprint: turns a gimbal so that the middle of the picture lies where the
//! plan has it, straight below the track, against bank, pitch and an error of the path
//! (D2.7 §1.2.1, reactive layer).
//!
//! A percept comes five times a second and wings roll faster, so what is commanded is a sequence:
//! the turns of the setpoint are played ahead, the bank follows them at the airframe's rate, and
//! for each tenth of a second there are the two angles that look at the planned place from where
//! the UAV will be. The pitch is taken to stay what it is.
//!
//! # Guarantees
//! Angles stay within the limits of the gimbal, and two of them are no farther apart than it
//! turns in between. Who is farther off its track than [`MOST_M`] looks straight down.
//!
//! # Complexity
//! O(steps of the setpoint + pieces of the track ahead) for each tenth of a second.

use super::follow::{Track, fly};
use crate::attitude::Attitude;
use crate::percept::Percept;
use crate::setpoint::{GimbalStep, MAX_GIMBAL_STEPS, Setpoint, Steer};
use skein_flight::airframe::{Airframe, ROLL_RATE_RADPS};
use skein_flight::mount::Gimbal;
use skein_geometry::frame::{Pose, Vector};
use skein_geometry::math::{asin, atan2, sin_cos};

/// The time between two angles, milliseconds.
const STEP_MS: u32 = 100;

/// An error of the path up to this is made up for, metres: beyond, a UAV is on its way back to
/// its track, and what is below it is as good.
pub const MOST_M: f64 = 12.0;

/// What a gimbal is turned by.
#[derive(Clone, Copy, Debug)]
pub struct Gaze<'a> {
    /// What it can.
    pub gimbal: Gimbal,
    /// How it and the airframe are turned now.
    pub attitude: Attitude,
    /// What is to be flown; none where the plan is what is below.
    pub track: Option<&'a Track>,
}

/// The angles from a percept on that hold the planned place while a setpoint is flown.
#[must_use]
pub fn hold(gaze: &Gaze<'_>, percept: &Percept, setpoint: &Setpoint) -> Vec<GimbalStep> {
    let Gimbal {
        roll_rad,
        pitch_rad,
        rate_radps,
    } = gaze.gimbal;
    let wind = Vector::new(percept.wind_east_mps, percept.wind_north_mps);
    let mut before = (
        gaze.attitude.gimbal_roll_rad,
        gaze.attitude.gimbal_pitch_rad,
    );
    let mut bank_rad = gaze.attitude.bank_rad;
    let mut steps = Vec::with_capacity(MAX_GIMBAL_STEPS);
    let (mut flown_m, mut last) = (0.0, percept.pose);
    for at_ms in (1..).map(|n| n * STEP_MS).take(MAX_GIMBAL_STEPS) {
        let at_s = f64::from(at_ms) / 1000.0;
        let air = fly(percept.pose, setpoint.airspeed_mps, &setpoint.steps, at_ms);
        let pose = Pose::new(air.position() + wind * at_s, air.heading_rad);
        flown_m += (pose.position() - last.position()).norm();
        last = pose;
        bank_rad = rolled(bank_rad, setpoint, at_ms - STEP_MS);
        let off = gaze.track.map_or_else(Vector::zeros, |track| {
            planned(track, flown_m, pose) - pose.position()
        });
        let off = if off.norm() > MOST_M {
            Vector::zeros()
        } else {
            off
        };
        let (roll, lift) = towards(off, &pose, percept.height_m, gaze.attitude.pitch_rad);
        let most = rate_radps * f64::from(STEP_MS) / 1000.0;
        let near = |from: f64, to: f64, limit: f64| {
            to.clamp(-limit, limit).clamp(from - most, from + most)
        };
        before = (
            near(before.0, roll - bank_rad, roll_rad),
            near(before.1, lift, pitch_rad),
        );
        steps.push(GimbalStep {
            duration_ms: STEP_MS,
            roll_rad: before.0,
            pitch_rad: before.1,
        });
    }
    steps
}

/// Where the plan has a UAV that flew so far since it was where its track says.
fn planned(track: &Track, flown_m: f64, pose: Pose) -> skein_geometry::frame::Point {
    let guess = |at_m: f64| track.pose_at(at_m).unwrap_or(pose);
    let at_m = track.at_m() + flown_m;
    let first = guess(at_m);
    // Who flies beside an arc gets on by another length than the arc's.
    let ahead_m = (pose.position() - first.position()).dot(&first.direction());
    guess(at_m + ahead_m).position()
}

/// The bank [`STEP_MS`] after a time, where it was this.
fn rolled(bank_rad: f64, setpoint: &Setpoint, from_ms: u32) -> f64 {
    let rate_at = |ms: u32| turn_at(&setpoint.steps, ms);
    let mut bank_rad = bank_rad;
    // In parts of a step: a turn begins somewhere within it.
    for ms in (from_ms..from_ms + STEP_MS).step_by(10) {
        let wanted = Airframe::bank_rad(setpoint.airspeed_mps, rate_at(ms));
        let most = ROLL_RATE_RADPS * 0.01;
        bank_rad += (wanted - bank_rad).clamp(-most, most);
    }
    bank_rad
}

/// The turn that is flown at a time after the percept, rad/s.
fn turn_at(steps: &[Steer], at_ms: u32) -> f64 {
    let mut until_ms = 0_u32;
    let on = steps.iter().find(|s| {
        until_ms = until_ms.saturating_add(s.duration_ms);
        at_ms < until_ms
    });
    on.or(steps.last()).map_or(0.0, |s| s.turn_rate_radps)
}

/// Roll, counted from level wings, and pitch in the airframe at which the middle of the picture
/// lies so far from straight below, of an airframe whose nose is up by `pitch_rad`.
fn towards(off: Vector, pose: &Pose, height_m: f64, pitch_rad: f64) -> (f64, f64) {
    let forward = pose.direction();
    let (x, y, z) = (forward.dot(&off), forward.perp(&off), height_m.max(1.0));
    let long = (x * x + y * y + z * z).sqrt();
    // The direction in the airframe before it banks: forward, left, down.
    let (s, c) = sin_cos(pitch_rad);
    let (x, y, z) = ((x * c - z * s) / long, y / long, (z * c + x * s) / long);
    (atan2(-y, z), asin(x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::setpoint::Side;
    use crate::testing::{airframe, percept_at};
    use crate::view::View;
    use skein_flight::mount::Mount;
    use skein_geometry::Curve;
    use skein_geometry::frame::Point;

    fn gimbal() -> Gimbal {
        Gimbal {
            roll_rad: 0.8,
            pitch_rad: 0.6,
            rate_radps: 2.0,
        }
    }

    fn setpoint(steps: Vec<Steer>) -> Setpoint {
        Setpoint {
            from_ms: 0,
            airspeed_mps: 13.0,
            height_m: 90.0,
            steps,
            loiter: Side::Left,
            gimbal: Vec::new(),
            launch: crate::setpoint::Launch::Stay,
            promised: None,
        }
    }

    /// After a while of the angles that are commanded a narrow camera has the planned place in
    /// its picture, whatever bank, pitch and error of the path.
    #[test]
    fn the_middle_of_the_picture_lies_on_the_planned_place() {
        let start = Pose::new(Point::new(0.0, 0.0), 0.4);
        let curve = Curve::from_pieces(start, &[(1.0 / 40.0, 200.0)]);
        for cross_m in [-6.0, 0.0, 5.0] {
            let left = Vector::new(-start.direction().y, start.direction().x);
            let at = Pose::new(start.position() + left * cross_m, 0.4);
            let rate = 13.0 / (40.0 - cross_m);
            let attitude = Attitude {
                bank_rad: Airframe::bank_rad(13.0, rate),
                pitch_rad: 0.07,
                ..Attitude::default()
            };
            let track = Track::new(&curve);
            let gaze = Gaze {
                gimbal: gimbal(),
                attitude,
                track: Some(&track),
            };
            let flown = setpoint(vec![Steer {
                turn_rate_radps: rate,
                duration_ms: 2500,
            }]);
            let steps = hold(&gaze, &percept_at(at, 0), &flown);
            assert_eq!(steps.len(), MAX_GIMBAL_STEPS);
            for n in [6_u16, 10, 15] {
                let then = fly(at, 13.0, &flown.steps, u32::from(n + 1) * STEP_MS);
                let step = steps[usize::from(n)];
                let narrow = Airframe {
                    footprint_across_m: 0.6,
                    footprint_along_m: 0.6,
                    mount: Mount::Gimbal(gimbal()),
                    ..airframe()
                };
                let mut percept = percept_at(then, 0);
                percept.attitude = Some(Attitude {
                    gimbal_roll_rad: step.roll_rad,
                    gimbal_pitch_rad: step.pitch_rad,
                    ..attitude
                });
                let turned = f64::from(n + 1) * 0.1 * rate * 40.0;
                let place = curve.pose_at(turned).unwrap().position();
                assert!(
                    View::of(&percept, &narrow).shows(place, 1.0),
                    "{cross_m} {n}"
                );
            }
        }
    }

    #[test]
    fn limits_and_rates_are_kept_and_turns_are_met_ahead() {
        let narrow = Gimbal {
            roll_rad: 0.3,
            pitch_rad: 0.2,
            rate_radps: 1.5,
        };
        let at = Pose::new(Point::new(0.0, 0.0), 0.0);
        let turn = |turn_rate_radps, duration_ms| Steer {
            turn_rate_radps,
            duration_ms,
        };
        let gaze = Gaze {
            gimbal: narrow,
            attitude: Attitude::default(),
            track: None,
        };
        let flown = setpoint(vec![turn(0.0, 500), turn(0.5, 2000)]);
        let steps = hold(&gaze, &percept_at(at, 0), &flown);
        let rolls: Vec<f64> = steps.iter().map(|s| s.roll_rad).collect();
        // The wings are level for half a second, then roll to 33° within 0.6 s.
        assert!(rolls[..5].iter().all(|r| r.abs() < 1e-9), "{rolls:?}");
        assert!((rolls[5] + 0.1047).abs() < 0.01, "{rolls:?}");
        assert!(rolls.iter().all(|r| *r >= -0.3) && (rolls[15] + 0.3).abs() < 1e-9);
        let most = rolls.windows(2).map(|r| (r[1] - r[0]).abs());
        assert!(most.fold(0.0, f64::max) <= 0.15 + 1e-9);
    }
}
