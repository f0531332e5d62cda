//! What a pursuit came to, measured from the truth.

use super::totals::Pursuit;
use super::{KEEPS, SETTLED_S, Truth};
use skein_flight::airframe::Airframe;
use skein_flight::tracking::field::{Field, Turn};
use skein_flight::tracking::flyable::turn_rate_radps;
use skein_flight::tracking::follower::{Command, Flown};
use skein_flight::tracking::fusion::{Fused, Register};
use skein_flight::tracking::mode::Mode;
use skein_flight::tracking::orbit::{Drift, Orbit};
use skein_flight::trajectory::wind::Wind;
use skein_geometry::frame::{Point, Pose};
use std::collections::BTreeMap;

/// A circle is reached this near to it, metres.
const REACHED_M: f64 = 2.0;

/// And while the distance to the target changes by less than this, m/s.
const ALONG_MPS: f64 = 0.5;

/// Its error counts from so long after it was reached, seconds, until a turn is taken that the
/// airframe does not have.
const ON_CIRCLE_S: f64 = 5.0;

/// The part of the hardest turn that the law itself may take where a circle counts as flyable.
const LEFT: f64 = 0.95;

/// A UAV that saw a target this recently counts as having it, seconds.
const REACQUIRED_WITHIN_S: f64 = 10.0;

/// A mode that is left so soon again has chattered, if the target's speed has hardly changed
/// meanwhile, seconds.
const CHATTER_S: f64 = 10.0;

/// What hardly means, m/s.
const HARDLY_MPS: f64 = 2.0;

/// Estimates are compared with the nearest vehicle within this, metres.
const MEANT_M: f64 = 60.0;

/// Consistency is sampled this often, milliseconds: errors last for some looks.
const SAMPLE_MS: u64 = 5_000;

/// One UAV at a moment, as the judge sees it.
pub(super) struct Look<'a> {
    pub(super) id: u16,
    pub(super) pose: Pose,
    pub(super) airframe: &'a Airframe,
    pub(super) command: Option<&'a Command>,
    pub(super) mode: Option<Mode>,
    pub(super) target: Option<&'a Fused>,
    /// Whether the middle of its circle is aside of the target.
    pub(super) is_aside: bool,
    /// Of each vehicle that is to be followed: whether the camera has it.
    pub(super) sees: Vec<bool>,
    /// Of each: whether it would be in the picture if no building stood there.
    pub(super) frames: Vec<bool>,
}

/// Since when a circle that was asked for has been flown and could be.
#[derive(Clone, Copy, Debug, Default)]
struct Orbiting {
    since_s: Option<f64>,
    /// The error of the look before, metres.
    off_m: Option<f64>,
}

/// Modes of one UAV.
#[derive(Clone, Copy, Debug)]
struct Modes {
    mode: Mode,
    since_s: f64,
    /// The least and the most speed of the target through the air since then, m/s.
    drift_mps: (f64, f64),
}

pub(super) struct Judge {
    stand_off_m: f64,
    wind: Wind,
    orbiting: BTreeMap<u16, Orbiting>,
    modes: BTreeMap<u16, Modes>,
    /// Of each target: since when it can be kept up with, and when it was last seen.
    kept_since_s: Vec<Option<f64>>,
    seen_s: Vec<Option<f64>>,
    /// Who was taken away, when, and the target that it followed.
    lost: Option<(f64, usize)>,
    out: Pursuit,
    squares_m2: f64,
}

impl Judge {
    pub(super) fn new(stand_off_m: f64, wind: Wind, targets: usize) -> Self {
        Self {
            stand_off_m,
            wind,
            orbiting: BTreeMap::new(),
            modes: BTreeMap::new(),
            kept_since_s: vec![None; targets],
            seen_s: vec![None; targets],
            lost: None,
            out: Pursuit::default(),
            squares_m2: 0.0,
        }
    }

    /// A UAV that followed a target is taken away.
    pub(super) fn take_away(&mut self, now_s: f64, target: usize) {
        self.lost = Some((now_s, target));
        self.out.trackers_lost += 1;
    }

    /// Which targets nobody has seen yet.
    pub(super) fn unseen(&self) -> Vec<bool> {
        self.seen_s.iter().map(Option::is_none).collect()
    }

    /// A UAV was in a zone or too near to one, or not.
    pub(super) fn near_zone(&mut self, near: bool, step_s: f64) {
        self.out.in_zone_s += if near { step_s } else { 0.0 };
    }

    /// Everything at a moment; `truth` are the targets, `step_s` the time since the last.
    pub(super) fn observe(&mut self, now_s: f64, step_s: f64, truth: &[Truth], looks: &[Look<'_>]) {
        for l in looks {
            let meant = l.target.and_then(|t| nearest(truth, t.estimate.position()));
            // What nobody sees is followed by a guess: that is not the law's error.
            let seen = meant.filter(|i| looks.iter().any(|l| l.sees.get(*i) == Some(&true)));
            self.stand_off(now_s, step_s, l, seen.map(|i| &truth[i]));
            self.mode(now_s, l, meant.map(|i| &truth[i]));
            if l.command.is_some_and(|c| c.saturated) {
                self.out.saturated_s += step_s;
            }
            self.out.flown_s += step_s;
        }
        let fastest_mps = looks.first().map_or(0.0, |l| l.airframe.max_mps);
        for (i, t) in truth.iter().enumerate() {
            self.footprint(now_s, step_s, i, t, looks, fastest_mps);
        }
        self.reacquire(now_s, truth, looks);
    }

    fn drift_mps(&self, t: &Truth) -> f64 {
        (t.motion.velocity_mps - self.wind.velocity()).norm()
    }

    /// The error of the stand-off, where the circle that was asked for has been flown for a
    /// while and could be flown all the time.
    fn stand_off(&mut self, now_s: f64, step_s: f64, l: &Look<'_>, meant: Option<&Truth>) {
        let (Some(c), Some(t)) = (l.command, meant) else {
            self.orbiting.remove(&l.id);
            return;
        };
        let as_asked = match c.flown {
            Flown::Orbit(r) => (r - self.stand_off_m).abs() < 1e-6 && !l.is_aside,
            Flown::Weave(_) | Flown::Approach | Flown::Outrun => false,
        };
        let flyable = as_asked && self.is_flyable(l, c.airspeed_mps, t);
        let since = self.orbiting.entry(l.id).or_default();
        let off_m = (l.pose.position() - t.motion.position).norm() - self.stand_off_m;
        // Who only crosses the circle has not reached it.
        let crossing_mps = since
            .off_m
            .map_or(f64::INFINITY, |m| (off_m - m).abs() / step_s);
        since.off_m = Some(off_m);
        let settles = off_m.abs() < REACHED_M && crossing_mps < ALONG_MPS;
        let reached = flyable && (since.since_s.is_some() || settles);
        since.since_s = reached.then(|| since.since_s.unwrap_or(now_s));
        if since.since_s.is_some_and(|s| now_s - s >= ON_CIRCLE_S) {
            self.squares_m2 += off_m * off_m * step_s;
            self.out.flyable_s += step_s;
            self.out.worst_standoff_m = self.out.worst_standoff_m.max(off_m.abs());
        }
    }

    /// Whether the airframe has the turn that the circle takes where the UAV is, with the
    /// velocity and the acceleration that the target has at this moment, and a twentieth left
    /// for corrections.
    fn is_flyable(&self, l: &Look<'_>, airspeed_mps: f64, t: &Truth) -> bool {
        let drift = Drift {
            velocity_mps: t.motion.velocity_mps - self.wind.velocity(),
            acceleration_mps2: t.motion.acceleration_mps2,
        };
        let from = l.pose.position() - t.motion.position;
        let relative = l.pose.direction() * airspeed_mps - drift.velocity_mps;
        let left = from.x * relative.y - from.y * relative.x >= 0.0;
        let orbit = Orbit {
            field: Field::HOPF,
            radius_m: self.stand_off_m,
            turn: if left { Turn::Left } else { Turn::Right },
        };
        let on_circle = from * (self.stand_off_m / from.norm().max(f64::MIN_POSITIVE));
        let nose = orbit.nose(on_circle, airspeed_mps, &drift, relative);
        let most = turn_rate_radps(l.airframe, airspeed_mps);
        nose.is_some_and(|n| n.rate_radps.abs() <= LEFT * most)
    }

    /// A mode that is left at once for the one before it.
    fn mode(&mut self, now_s: f64, l: &Look<'_>, meant: Option<&Truth>) {
        let (Some(mode), Some(t)) = (l.mode, meant) else {
            return;
        };
        // Who has lost its target looks for it: that is no boundary of modes.
        if !l.sees.contains(&true) {
            self.modes.remove(&l.id);
            return;
        }
        let drift_mps = self.drift_mps(t);
        let now = Modes {
            mode,
            since_s: now_s,
            drift_mps: (drift_mps, drift_mps),
        };
        // The first mode was not switched to.
        let first = Modes {
            since_s: f64::NEG_INFINITY,
            ..now
        };
        let before = self.modes.entry(l.id).or_insert(first);
        let (least_mps, most_mps) = before.drift_mps;
        before.drift_mps = (least_mps.min(drift_mps), most_mps.max(drift_mps));
        if before.mode != mode {
            let soon = now_s - before.since_s < CHATTER_S;
            let alike = before.drift_mps.1 - before.drift_mps.0 < HARDLY_MPS;
            self.out.chatter += u32::from(soon && alike);
            *before = now;
        }
    }

    fn footprint(
        &mut self,
        now_s: f64,
        step_s: f64,
        i: usize,
        t: &Truth,
        looks: &[Look<'_>],
        fastest_mps: f64,
    ) {
        let seen = looks.iter().any(|l| l.sees.get(i) == Some(&true));
        let framed = looks.iter().any(|l| l.frames.get(i) == Some(&true));
        if seen {
            self.seen_s[i] = Some(now_s);
        }
        // A target counts once it was seen for the first time.
        let Some(last_s) = self.seen_s[i] else {
            return;
        };
        self.out.longest_gap_s = self.out.longest_gap_s.max(now_s - last_s);
        self.out.whole_s += step_s;
        self.out.seen_s += if seen { step_s } else { 0.0 };
        self.out.hidden_s += if framed && !seen { step_s } else { 0.0 };
        self.out.covered_s += if t.is_covered { step_s } else { 0.0 };
        let keeps = self.drift_mps(t) * KEEPS <= fastest_mps;
        self.kept_since_s[i] = if keeps {
            self.kept_since_s[i].or(Some(now_s))
        } else {
            None
        };
        if self.kept_since_s[i].is_some_and(|s| now_s - s >= SETTLED_S) {
            self.out.kept_s += step_s;
            self.out.kept_seen_s += if seen { step_s } else { 0.0 };
        }
    }

    /// Whether another one has the target of who was taken away.
    fn reacquire(&mut self, now_s: f64, truth: &[Truth], looks: &[Look<'_>]) {
        let Some((lost_s, i)) = self.lost else { return };
        let has = |l: &Look<'_>| {
            let follows = l.target.and_then(|t| nearest(truth, t.estimate.position()));
            follows == Some(i) && l.sees.get(i) == Some(&true)
        };
        let found = looks.iter().any(has);
        if found {
            let after_s = now_s - lost_s;
            self.out.reacquired_after_s.push(after_s);
            self.out.reacquired_in_time += u32::from(after_s <= REACQUIRED_WITHIN_S);
            self.lost = None;
        }
    }

    /// Whether estimates know their errors: those of one author, and those of all.
    pub(super) fn consistency(
        &mut self,
        now_ms: u64,
        truth: &[Truth],
        own: &[Register],
        all: &[Fused],
    ) {
        if !now_ms.is_multiple_of(SAMPLE_MS) {
            return;
        }
        for r in own.iter().filter(|r| r.estimate.time_ms == now_ms) {
            if let Some(i) = nearest(truth, r.estimate.position()) {
                let m = &truth[i].motion;
                self.out
                    .nees
                    .push(r.estimate.normalised_error(m.position, m.velocity_mps));
                let off = r.estimate.position() - m.position;
                self.out.position_m2.push(off.norm_squared());
            }
        }
        for f in all.iter().filter(|f| f.authors > 1) {
            if let Some(i) = nearest(truth, f.estimate.position()) {
                let m = &truth[i].motion;
                self.out
                    .nees_fused
                    .push(f.estimate.normalised_error(m.position, m.velocity_mps));
            }
        }
    }

    pub(super) fn finish(mut self, switches: u32) -> Pursuit {
        self.out.squares_m2s = self.squares_m2;
        self.out.mode_switches = switches;
        self.out
    }
}

/// The vehicle that an estimate means.
pub(super) fn nearest(truth: &[Truth], at: Point) -> Option<usize> {
    let far = |i: &usize| (truth[*i].motion.position - at).norm();
    let best = (0..truth.len()).min_by(|a, b| far(a).total_cmp(&far(b)))?;
    (far(&best) <= MEANT_M).then_some(best)
}
