//! Which cells the camera has seen whole (D2.7 §1.2.3; the footprint is §2.2's).
//!
//! A cell is reported only for a pose that the UAV was truly at: the poses of
//! percepts, and poses between two percepts where the commanded turns, played from
//! the first, end at the second. Anything else stays unseen and is flown again.

use crate::percept::Percept;
use crate::reactive::follow::fly;
use crate::setpoint::Steer;
use skein_flight::airframe::Airframe;
use skein_flight::coverage::ring::CoverageLoop;
use skein_flight::coverage::ring::patch::{Corners, frame_holds};
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
    let lens = Lens {
        ground,
        airframe,
        is_open,
    };
    lens.look(&now.pose, POSE_ERROR_M, seen);
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
        lens.look(&pose, slack_m, seen);
    }
}

struct Lens<'a, G: ?Sized> {
    ground: &'a G,
    airframe: &'a Airframe,
    is_open: &'a dyn Fn(u16) -> bool,
}

impl<G: Ground + ?Sized> Lens<'_, G> {
    /// Cells that the footprint at `pose` contains, its sides shortened by `slack_m`.
    fn look(&self, pose: &Pose, slack_m: f64, seen: &mut Vec<u16>) {
        let across_m = self.airframe.footprint_across_m - slack_m;
        let along_m = self.airframe.footprint_along_m - slack_m;
        let p = pose.position();
        let mut contained = |cell: u16, corners: &Corners| {
            if (self.is_open)(cell)
                && !seen.contains(&cell)
                && frame_holds(corners, *pose, across_m, along_m)
            {
                seen.push(cell);
            }
        };
        self.ground.near(p, across_m, along_m, &mut contained);
    }
}
