//! Which cells the camera has seen whole (D2.7 §1.2.3; the footprint is §2.2's).
//!
//! A cell is reported only for a pose that the UAV was truly at: the poses of
//! percepts, and poses between two percepts where the commanded turns, played from
//! the first, end at the second. Anything else stays unseen and is flown again. A picture that
//! tilts is looked at between two percepts only while its angles hardly change.

use crate::percept::Percept;
use crate::reactive::follow::fly;
use crate::setpoint::{GimbalStep, Steer};
use crate::view::View;
use skein_flight::airframe::Airframe;
use skein_flight::coverage::ring::CoverageLoop;
use skein_flight::coverage::ring::patch::Corners;
use skein_flight::mount::DIRECTION_OFF_RAD;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::wrap_pi;

/// Margin taken off the footprint, metres: what a percept's pose may be off and rounding,
/// and so much more that a judge who samples the flight every 0.25 m sees the cell too.
pub const POSE_ERROR_M: f64 = 0.4;

/// Taken off besides where the pose is played between two percepts, metres.
const BETWEEN_M: f64 = 0.1;

/// Longest time between two percepts that is filled, milliseconds: after it the
/// airframe flies its failsafe, and the commanded turns no longer tell where it was.
const FILLED_MS: u64 = 1000;

/// The prediction must meet the second percept within these.
const MET_M: f64 = 0.3;
const MET_RAD: f64 = 0.01;

/// Between two percepts a picture that tilts is looked at while its angles vary by no more than
/// this, radians: 2 m on the ground from 100 m.
const STEADY_RAD: f64 = 0.02;

/// Distance between the poses that are looked at, metres: a third of the stretch of a
/// quarter turn from which a cell just fits the frame.
const BETWEEN_POSES_M: f64 = 1.0;

/// What was commanded at a percept.
#[derive(Clone, Debug)]
pub struct Played {
    /// The percept.
    pub percept: Percept,
    /// The turns from then on.
    pub steps: Vec<Steer>,
    /// The airspeed from then on, m/s.
    pub airspeed_mps: f64,
    /// How the gimbal is turned from then on.
    pub gimbal: Vec<GimbalStep>,
}

/// Patches of the ground by number, and which lie near a camera.
pub trait Ground {
    /// Calls `visit` with each that a frame at `at` reaching `across_m` and `along_m` to its
    /// sides may hold whole.
    fn near(&self, at: Point, across_m: f64, along_m: f64, visit: &mut dyn FnMut(u16, &Corners));
}

impl Ground for CoverageLoop {
    fn near(&self, at: Point, across_m: f64, along_m: f64, visit: &mut dyn FnMut(u16, &Corners)) {
        self.cells_near(at, across_m, along_m, &mut |cell, corners| {
            visit(cell, corners);
        });
    }
}

/// A few patches: each is looked at.
impl Ground for [Corners] {
    fn near(&self, _: Point, _: f64, _: f64, visit: &mut dyn FnMut(u16, &Corners)) {
        (0u16..)
            .zip(self)
            .for_each(|(n, corners)| visit(n, corners));
    }
}

/// Reports open patches of the ground, by number, that were seen whole at `now` or since
/// `before`.
pub fn look<G: Ground + ?Sized>(
    ground: &G,
    airframe: &Airframe,
    before: Option<&Played>,
    now: &Percept,
    is_open: &dyn Fn(u16) -> bool,
    seen: &mut Vec<u16>,
) {
    let view = View::of(now, airframe);
    let lens = Lens { ground, is_open };
    lens.look(&view, (POSE_ERROR_M, DIRECTION_OFF_RAD), seen);
    let Some(before) = before else { return };
    let Some(ms) = now
        .time_ms
        .checked_sub(before.percept.time_ms)
        .filter(|ms| (1..=FILLED_MS).contains(ms))
    else {
        return;
    };
    if now.failsafe || before.percept.failsafe {
        return;
    }
    let v = before.airspeed_mps;
    #[allow(clippy::cast_possible_truncation, reason = "at most FILLED_MS")]
    let ms = ms as u32;
    let wind = (before.percept.wind_east_mps, before.percept.wind_north_mps);
    let flown = |ms: u32| {
        let pose = fly(before.percept.pose, v, &before.steps, ms);
        let t_s = f64::from(ms) / 1000.0;
        Pose {
            east_m: pose.east_m + wind.0 * t_s,
            north_m: pose.north_m + wind.1 * t_s,
            ..pose
        }
    };
    let end = flown(ms);
    let off_m = (end.position() - now.pose.position()).norm();
    let off_rad = wrap_pi(end.heading_rad - now.pose.heading_rad).abs();
    if !(off_m <= MET_M && off_rad <= MET_RAD) {
        return;
    }
    let reach_m = airframe.footprint_across_m + airframe.footprint_along_m;
    let slack_m = POSE_ERROR_M + BETWEEN_M + off_m + off_rad * reach_m;
    let varied_rad = if airframe.mount.is_level() {
        0.0
    } else {
        before.varied_rad(now, ms)
    };
    if varied_rad > STEADY_RAD {
        return;
    }
    let slack = (slack_m, DIRECTION_OFF_RAD + varied_rad);
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a few dozen poses at most"
    )]
    let parts = (v * f64::from(ms) / 1000.0 / BETWEEN_POSES_M)
        .ceil()
        .clamp(1.0, 64.0) as u32;
    for i in 1..parts {
        let pose = flown(ms * i / parts);
        lens.look(&view.moved(pose, now.attitude), slack, seen);
    }
}

impl Played {
    /// By how much any angle of the camera may have differed since then from those at the next
    /// percept, `ms` later, radians. Wings and gimbal move towards what was commanded, so they
    /// stay between that and where they are at both ends.
    fn varied_rad(&self, now: &Percept, ms: u32) -> f64 {
        let (Some(was), Some(is)) = (self.percept.attitude, now.attitude) else {
            return f64::INFINITY;
        };
        let (mut banks, mut at_ms) = (vec![was.bank_rad], 0);
        for step in &self.steps {
            if at_ms >= ms {
                break;
            }
            banks.push(Airframe::bank_rad(self.airspeed_mps, step.turn_rate_radps));
            at_ms = at_ms.saturating_add(step.duration_ms);
        }
        let spread = |angles: &mut dyn Iterator<Item = f64>, is: f64| {
            angles.map(|a| (a - is).abs()).fold(0.0, f64::max)
        };
        let bank_rad = spread(&mut banks.into_iter(), is.bank_rad);
        let pitch_rad = (was.pitch_rad - is.pitch_rad).abs();
        let mut until_ms = 0;
        let mut begun = self.gimbal.iter().filter(|step| {
            let begins = until_ms < ms;
            until_ms = until_ms.saturating_add(step.duration_ms);
            begins
        });
        let (mut roll_rad, mut lift_rad) = (
            (was.gimbal_roll_rad - is.gimbal_roll_rad).abs(),
            (was.gimbal_pitch_rad - is.gimbal_pitch_rad).abs(),
        );
        for step in begun.by_ref() {
            roll_rad = f64::max(roll_rad, (step.roll_rad - is.gimbal_roll_rad).abs());
            lift_rad = f64::max(lift_rad, (step.pitch_rad - is.gimbal_pitch_rad).abs());
        }
        bank_rad + pitch_rad + roll_rad + lift_rad
    }
}

struct Lens<'a, G: ?Sized> {
    ground: &'a G,
    is_open: &'a dyn Fn(u16) -> bool,
}

impl<G: Ground + ?Sized> Lens<'_, G> {
    /// Patches that a picture contains, though places and angles are off by so much.
    fn look(&self, view: &View, (slack_m, slack_rad): (f64, f64), seen: &mut Vec<u16>) {
        let (across_m, along_m) = view.reach_m(slack_m);
        let p = view.from();
        let mut contained = |cell: u16, corners: &Corners| {
            if (self.is_open)(cell)
                && !seen.contains(&cell)
                && view.holds(corners, slack_m, slack_rad)
            {
                seen.push(cell);
            }
        };
        self.ground.near(p, across_m, along_m, &mut contained);
    }
}
