//! Path following: a curve and a pose in, timed turns out (D2.7 §1.2.3, reactive
//! layer; the curves come from §2.4).
//!
//! A [`Track`] is a growing curve with the progress of the UAV on it. From a pose
//! it makes turns that carry their own times: the curvature of the pieces ahead,
//! switched to the millisecond, and on top of it one pair of opposite turns that
//! takes the error of place and heading away. So a setpoint stays right when the
//! next percept is late. Zones, stall and bank are the [`envelope`](super::envelope)'s.
//!
//! # Guarantees
//! In still air at the commanded airspeed the pair of turns brings a small error
//! to zero at its end (dead beat); repeated at every percept it is a second-order
//! filter with a damping of 0.75. A track knows nothing of wind; [`air`](super::air)
//! does.
//!
//! # Complexity
//! O(pieces within the horizon) a percept, no allocation but the steps.

use crate::setpoint::{MAX_STEPS, Steer};
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::{TAU, atan2, cos, sin, wrap_pi, wrap_tau};
use skein_geometry::{Curve, Segment};
use std::collections::VecDeque;

/// How far a setpoint reaches, seconds: one second until the airframe's failsafe
/// would act, one percept of half a second, and a second to spare.
pub const HORIZON_S: f64 = 2.5;

/// Duration of each of the two correcting turns, seconds: three percepts of
/// 200 ms, so that the filter (natural frequency 1/T) is sampled well, and short
/// enough to end before the next corner.
pub(super) const CORRECTION_S: f64 = 0.6;

/// Errors of place count as at most this in a correction, metres: larger ones are
/// approached at up to asin(4 / (1.5 V T)), some 20 degrees, and not head-on.
const MAX_CORRECTED_M: f64 = 4.0;

/// Errors below these are left alone: they are rounding of times to milliseconds.
const DEAD_BAND_M: f64 = 1e-3;
const DEAD_BAND_RAD: f64 = 1e-4;

/// Where the UAV is, seen from the curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Offset {
    /// Distance to the left of the curve, metres.
    pub cross_m: f64,
    /// Heading of the UAV minus that of the curve, radians, positive to the left.
    pub heading_rad: f64,
}

/// A curve that grows in front and is forgotten behind, with a progress on it.
#[derive(Clone, Debug, Default)]
pub struct Track {
    segments: VecDeque<Segment>,
    /// Arc length at the start of the first piece, counted from the first ever, metres.
    front_m: f64,
    /// Arc length at the end of the last piece, metres.
    end_m: f64,
    /// Arc length where the UAV is, metres.
    at_m: f64,
}

impl Track {
    /// A track along `curve`, beginning at its start.
    #[must_use]
    pub fn new(curve: &Curve) -> Self {
        let mut track = Self::default();
        track.extend(curve);
        track
    }

    /// Appends a curve that begins where the track ends.
    pub fn extend(&mut self, curve: &Curve) {
        for s in curve.segments() {
            self.end_m += s.length_m;
            self.segments.push_back(*s);
        }
    }

    /// Arc length flown, metres since the first piece.
    #[must_use]
    pub fn at_m(&self) -> f64 {
        self.at_m
    }

    /// Arc length at the end of the last piece, metres since the first.
    #[must_use]
    pub fn end_m(&self) -> f64 {
        self.end_m
    }

    /// What is left to fly, metres.
    #[must_use]
    pub fn left_m(&self) -> f64 {
        self.end_m - self.at_m
    }

    /// Forgets everything that lies more than a micrometre beyond `end_m`.
    pub fn truncate(&mut self, end_m: f64) {
        while let Some(last) = self.segments.back_mut() {
            let from = self.end_m - last.length_m;
            if from >= end_m - 1e-6 {
                self.end_m = from;
                self.segments.pop_back();
            } else {
                if self.end_m > end_m + 1e-6 {
                    last.length_m = end_m - from;
                    self.end_m = end_m;
                }
                break;
            }
        }
    }

    /// Forgets the whole curve; arc lengths go on from where the UAV is.
    pub fn clear(&mut self) {
        self.segments.clear();
        self.front_m = self.at_m;
        self.end_m = self.at_m;
    }

    /// The pose on the curve where the UAV should be; `None` on an empty track.
    #[must_use]
    pub fn pose(&self) -> Option<Pose> {
        self.pose_at(self.at_m)
    }

    /// The pose at the end of the track; `None` on an empty one.
    #[must_use]
    pub fn end(&self) -> Option<Pose> {
        self.segments.back().map(Segment::end)
    }

    /// Moves the progress to the point nearest to `pose` that is not behind it and
    /// not more than `window_m` ahead, and tells how far off the UAV is there.
    ///
    /// The window keeps the progress from jumping to another pass over the same
    /// place. `None` on an empty track.
    pub fn advance(&mut self, pose: &Pose, window_m: f64) -> Option<Offset> {
        let limit = self.at_m + window_m.max(0.0);
        let p = pose.position();
        let mut best: Option<(f64, f64)> = None;
        let mut from = self.front_m;
        for s in &self.segments {
            let to = from + s.length_m;
            if to >= self.at_m && from <= limit {
                let lo = (self.at_m - from).max(0.0);
                let hi = (limit - from).min(s.length_m).max(lo);
                let along = nearest_on(s, p).clamp(lo, hi);
                let d = (s.pose_at(along).position() - p).norm_squared();
                if best.is_none_or(|(b, _)| d < b) {
                    best = Some((d, from + along));
                }
            }
            if from > limit {
                break;
            }
            from = to;
        }
        let (_, at_m) = best?;
        self.at_m = at_m;
        self.forget();
        let on = self.pose()?;
        let (v, d) = (p - on.position(), on.direction());
        Some(Offset {
            cross_m: v.y * d.x - v.x * d.y,
            heading_rad: wrap_pi(pose.heading_rad - on.heading_rad),
        })
    }

    /// Moves the progress on to an arc length.
    pub fn skip_to(&mut self, at_m: f64) {
        self.at_m = at_m.clamp(self.at_m, self.end_m.max(self.at_m));
        self.forget();
    }

    /// Drops pieces that are wholly behind.
    fn forget(&mut self) {
        while self.segments.len() > 1 {
            let Some(first) = self.segments.front() else {
                return;
            };
            if self.front_m + first.length_m > self.at_m {
                return;
            }
            self.front_m += first.length_m;
            self.segments.pop_front();
        }
    }

    /// What is ahead of the UAV, at most `length_m` of it.
    #[must_use]
    pub fn ahead(&self, length_m: f64) -> Curve {
        self.between(self.at_m, self.at_m + length_m)
    }

    /// The part of the track between two arc lengths, as far as it is held.
    #[must_use]
    pub fn between(&self, from_m: f64, until_m: f64) -> Curve {
        let mut part = Curve::empty();
        let mut from = self.front_m;
        for s in &self.segments {
            let to = from + s.length_m;
            let (a, b) = (from.max(from_m), to.min(until_m));
            if b > a {
                part.push(Segment {
                    start: s.pose_at(a - from),
                    length_m: b - a,
                    ..*s
                });
            }
            if to >= until_m {
                break;
            }
            from = to;
        }
        part
    }

    /// The pose at an arc length, at the nearest end of what is held where it lies beyond;
    /// `None` on an empty track.
    #[must_use]
    pub fn pose_at(&self, at_m: f64) -> Option<Pose> {
        let mut from = self.front_m;
        for s in &self.segments {
            if at_m <= from + s.length_m {
                return Some(s.pose_at((at_m - from).max(0.0)));
            }
            from += s.length_m;
        }
        self.end()
    }

    /// The turns of the next [`HORIZON_S`] for a UAV that is off by `offset`,
    /// flies at `speed_mps` and turns at most at `limit_radps`.
    #[must_use]
    pub fn steps(&self, offset: Offset, speed_mps: f64, limit_radps: f64) -> Vec<Steer> {
        let (first, second) = correction(offset, speed_mps);
        let mut out = Steps::new(limit_radps);
        let mut from = self.front_m;
        let mut time_s = 0.0;
        for s in &self.segments {
            let to = from + s.length_m;
            if to > self.at_m {
                // Beside the curve an arc is flown with another radius about the same centre.
                let k = s.curvature_per_m;
                let beside = (1.0 - k * offset.cross_m).max(0.5);
                let until_s = (to - self.at_m) / speed_mps;
                let late = k * speed_mps;
                let early = if time_s < 2.0 * CORRECTION_S {
                    late / beside
                } else {
                    late
                };
                out.turn(early + first, time_s, until_s.min(CORRECTION_S));
                out.turn(
                    early + second,
                    time_s.max(CORRECTION_S),
                    until_s.min(2.0 * CORRECTION_S),
                );
                out.turn(late, time_s.max(2.0 * CORRECTION_S), until_s.min(HORIZON_S));
                time_s = until_s;
            }
            if time_s >= HORIZON_S {
                break;
            }
            from = to;
        }
        out.finish()
    }
}

/// The two rates that, held for [`CORRECTION_S`] each, end on the curve and along
/// it: with e' = V η and η' = δ these are the only pair.
pub(super) fn correction(offset: Offset, speed_mps: f64) -> (f64, f64) {
    if offset.cross_m.abs() < DEAD_BAND_M && offset.heading_rad.abs() < DEAD_BAND_RAD {
        return (0.0, 0.0);
    }
    let e = offset.cross_m.clamp(-MAX_CORRECTED_M, MAX_CORRECTED_M);
    let vt = speed_mps * CORRECTION_S;
    let first = -(e + 1.5 * vt * offset.heading_rad) / (vt * CORRECTION_S);
    let second = (e + 0.5 * vt * offset.heading_rad) / (vt * CORRECTION_S);
    (first, second)
}

/// Arc length on `s` of the point of its line or circle nearest to `p`, not yet
/// clamped to the piece; on a circle the representative nearest to the piece.
fn nearest_on(s: &Segment, p: Point) -> f64 {
    let d = s.start.direction();
    let v = p - s.start.position();
    let along = v.x * d.x + v.y * d.y;
    let k = s.curvature_per_m;
    if k.abs() < 1e-9 {
        return along;
    }
    // In the frame of the start, with the centre on the left for k > 0.
    let left = v.y * d.x - v.x * d.y;
    let angle = wrap_tau(atan2(along * k.abs(), 1.0 - left * k));
    let around = angle / k.abs();
    // Past the middle of what the piece leaves out, the point is before its start.
    let whole = TAU / k.abs();
    if around > 0.5 * (s.length_m + whole) {
        around - whole
    } else {
        around
    }
}

/// Collects turns, merges equal ones and rounds their ends to milliseconds.
pub(super) struct Steps {
    limit_radps: f64,
    out: Vec<Steer>,
    end_ms: u32,
    limit_ms: u32,
}

impl Steps {
    pub(super) fn new(limit_radps: f64) -> Self {
        Self {
            limit_radps,
            out: Vec::with_capacity(MAX_STEPS),
            end_ms: 0,
            limit_ms: u32::MAX,
        }
    }

    pub(super) fn turn(&mut self, rate_radps: f64, from_s: f64, until_s: f64) {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "times are within the horizon"
        )]
        let until_ms = (until_s.clamp(0.0, HORIZON_S) * 1000.0).round() as u32;
        if until_s <= from_s || until_ms <= self.end_ms || self.end_ms >= self.limit_ms {
            return;
        }
        let turn_rate_radps = rate_radps.clamp(-self.limit_radps, self.limit_radps);
        let duration_ms = until_ms - self.end_ms;
        let full = self.out.len() == MAX_STEPS;
        match self.out.last_mut() {
            Some(last) if (last.turn_rate_radps - turn_rate_radps).abs() < 1e-9 => {
                last.duration_ms += duration_ms
            }
            // What comes after this is cut off: the next percept is earlier.
            _ if full => self.limit_ms = self.end_ms,
            _ => self.out.push(Steer {
                turn_rate_radps,
                duration_ms,
            }),
        }
        if self.limit_ms == u32::MAX {
            self.end_ms = until_ms;
        }
    }

    pub(super) fn finish(self) -> Vec<Steer> {
        self.out
    }
}

/// The pose after flying `steps` at `speed_mps` for `after_ms`; the last rate is held.
#[must_use]
pub fn fly(pose: Pose, speed_mps: f64, steps: &[Steer], after_ms: u32) -> Pose {
    let mut at = pose;
    let mut left_ms = after_ms;
    for (i, s) in steps.iter().enumerate() {
        let held = i + 1 == steps.len();
        let ms = if held {
            left_ms
        } else {
            left_ms.min(s.duration_ms)
        };
        at = turn(at, speed_mps, s.turn_rate_radps, ms);
        left_ms -= ms;
        if left_ms == 0 {
            break;
        }
    }
    turn(
        at,
        speed_mps,
        0.0,
        if steps.is_empty() { left_ms } else { 0 },
    )
}

/// The pose after one turn.
fn turn(at: Pose, speed_mps: f64, rate_radps: f64, ms: u32) -> Pose {
    if ms == 0 {
        return at;
    }
    let t = f64::from(ms) / 1000.0;
    let half = 0.5 * rate_radps * t;
    // The chord of an arc: its length shrinks by sin(x)/x, it points half-way.
    let sinc = if half.abs() < 1e-6 {
        1.0
    } else {
        sin(half) / half
    };
    let chord = speed_mps * t * sinc;
    let course = at.heading_rad + half;
    Pose {
        east_m: at.east_m + chord * cos(course),
        north_m: at.north_m + chord * sin(course),
        heading_rad: wrap_pi(at.heading_rad + 2.0 * half),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_geometry::math::FRAC_PI_2;

    const V: f64 = 13.0;
    const LIMIT: f64 = V / 23.0;

    fn lane() -> Curve {
        let start = Pose {
            east_m: 0.0,
            north_m: 0.0,
            heading_rad: 0.4,
        };
        let q = 24.0 * FRAC_PI_2;
        let (l, r) = ((1.0 / 24.0, q), (-1.0 / 24.0, q));
        let pieces = [
            (0.0, 96.0),
            l,
            l,
            (0.0, 48.0),
            r,
            l,
            r,
            r,
            (0.0, 48.0),
            (0.0, 48.0),
            l,
            (0.0, 48.0),
            l,
            l,
            l,
            r,
        ];
        Curve::from_pieces(start, &[&pieces[..], &pieces[..], &pieces[..]].concat())
    }

    /// Flies the lane with exact piecewise turns; percepts come after the given
    /// times, in turn, and their answers `late_ms` later. Returns the largest and
    /// the last distance from the curve.
    fn flown(start: Pose, periods_ms: &[u32], late_ms: u32) -> (f64, f64) {
        let curve = lane();
        let mut track = Track::new(&curve);
        let mut pose = start;
        let mut old: (Vec<Steer>, u32) = (
            vec![Steer {
                turn_rate_radps: 0.0,
                duration_ms: 1,
            }],
            0,
        );
        let (mut worst, mut last): (f64, f64) = (0.0, 0.0);
        let mut i = 0;
        while track.left_m() > 60.0 {
            let period = periods_ms[i % periods_ms.len()];
            i += 1;
            let offset = track
                .advance(&pose, V * f64::from(period) / 1000.0 * 1.5 + 5.0)
                .unwrap();
            last = offset.cross_m.abs();
            worst = worst.max(last);
            let steps = track.steps(offset, V, LIMIT);
            // The old setpoint is played until the new one arrives; then the new
            // one from the time it was made for.
            let late = late_ms.min(period);
            for ms in 1..=period {
                let (s, age) = if ms <= late {
                    (&old.0, old.1 + ms - 1)
                } else {
                    (&steps, ms - 1)
                };
                let rate = rate_at(s, age);
                pose = turn(pose, V, rate, 1);
            }
            old = if late < period {
                (steps, period)
            } else {
                (old.0, old.1 + period)
            };
        }
        (worst, last)
    }

    fn rate_at(steps: &[Steer], age_ms: u32) -> f64 {
        let mut left = age_ms;
        for s in steps {
            if left < s.duration_ms {
                return s.turn_rate_radps;
            }
            left -= s.duration_ms;
        }
        steps.last().map_or(0.0, |s| s.turn_rate_radps)
    }

    #[test]
    fn lanes_and_corners_are_tracked_closely() {
        let start = lane().start().unwrap();
        for (periods, late, bound) in [
            (&[200][..], 0, 0.1),
            (&[200][..], 40, 0.2),
            (&[500, 430, 570, 300, 650][..], 0, 0.2),
            (&[500, 430, 570, 300, 650][..], 120, 0.5),
            (&[1000, 900][..], 50, 1.0),
        ] {
            let (worst, _) = flown(start, periods, late);
            assert!(worst < bound, "{periods:?} late {late}: {worst}");
        }
    }

    #[test]
    fn a_start_beside_the_lane_is_corrected() {
        for (cross, turned) in [(3.0, 0.0), (-3.0, 0.2), (5.0, -0.3), (0.0, 0.35)] {
            let s = lane().start().unwrap();
            let (sn, cs) = (sin(s.heading_rad), cos(s.heading_rad));
            let start = Pose {
                east_m: s.east_m - cross * sn,
                north_m: s.north_m + cross * cs,
                heading_rad: s.heading_rad + turned,
            };
            for periods in [&[200][..], &[500, 350, 600][..]] {
                let (worst, last) = flown(start, periods, 0);
                assert!(
                    worst < 5.6 && last < 0.05,
                    "{cross} {turned}: {worst} {last}"
                );
            }
        }
    }

    #[test]
    fn progress_never_goes_back_or_jumps() {
        // A circle passes the same place again and again.
        let start = Pose {
            east_m: 0.0,
            north_m: 0.0,
            heading_rad: 0.0,
        };
        let circle =
            Curve::from_pieces(start, &[(1.0 / 24.0, 24.0 * TAU), (1.0 / 24.0, 24.0 * TAU)]);
        let mut track = Track::new(&circle);
        let mut before = 0.0;
        for i in 0..110 {
            let pose = circle.pose_at(f64::from(i) * 2.6).unwrap();
            let o = track.advance(&pose, 6.0).unwrap();
            assert!(o.cross_m.abs() < 1e-6);
            assert!((track.at_m() - f64::from(i) * 2.6).abs() < 1e-6 && track.at_m() >= before);
            before = track.at_m();
        }
    }

    #[test]
    fn truncating_keeps_what_is_before() {
        let mut t = Track::new(&lane());
        t.truncate(100.0);
        assert!((t.end_m() - 100.0).abs() < 1e-9);
        let expected = lane().pose_at(100.0).unwrap();
        assert!((t.end().unwrap().position() - expected.position()).norm() < 1e-6);
        t.truncate(1e9);
        assert!((t.end_m() - 100.0).abs() < 1e-9);
    }

    #[test]
    fn no_more_steps_than_allowed() {
        let start = Pose {
            east_m: 0.0,
            north_m: 0.0,
            heading_rad: 0.0,
        };
        let wiggle: Vec<(f64, f64)> = (0..40)
            .map(|i| (if i % 2 == 0 { 0.04 } else { -0.04 }, 2.0))
            .collect();
        let track = Track::new(&Curve::from_pieces(start, &wiggle));
        let steps = track.steps(
            Offset {
                cross_m: 1.0,
                heading_rad: 0.1,
            },
            V,
            LIMIT,
        );
        assert!(steps.len() <= MAX_STEPS && !steps.is_empty());
        assert!(steps.iter().all(|s| s.turn_rate_radps.abs() <= LIMIT));
    }
}
