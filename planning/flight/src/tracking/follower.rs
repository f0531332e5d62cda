//! Turn rate and airspeed that follow a target, from percept to percept (D2.7 §3.7).
//!
//! What is kept in between is small: the mode, the sense of the orbit, the phase of
//! the weave. What is flown is told with each command ([`Flown`]): a circle that is wider than
//! was asked for, a target that outruns the UAV, a turn that was asked for in vain.

use super::bend::{self, Guard};
use super::field::{Field, Turn};
use super::flyable::turn_rate_radps;
use super::mode::{Airspeeds, Mode, Prospect, Switch};
use super::orbit::{Drift, Nose, Orbit, carried};
use super::weave::{LARGEST_RATIO, Weave, ratio_of};
use crate::airframe::Airframe;
use crate::trajectory::wind::Wind;
use serde::{Deserialize, Serialize};
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::{TAU, atan2, sin, sin_cos, wrap_pi};

/// Commands are computed for steps of this, seconds: within it the turn rate of an orbit
/// changes by a few thousandths of a radian a second.
const STEP_S: f64 = 0.05;

/// The part of an error of heading that is taken away in a second.
const HEADING_GAIN: f64 = 2.0;

/// Farther outside of a circle than so many radii it is approached at cruise.
const OUTSIDE: f64 = 1.4;

/// Farther from the target than so many times what a weave takes, it is gone after first.
const FAR: f64 = 2.0;

/// On top of that, metres: weaves may be as narrow as nothing.
const FAR_M: f64 = 60.0;

/// Who has to turn by more than this turns slowly before it hurries, radians.
const TURNS_RAD: f64 = 0.5;

/// A weave is begun this near its greatest distance, metres.
const BEGIN_M: f64 = 25.0;

/// The part of what a weave is behind its target that it makes good in a second.
const ALONG_GAIN: f64 = 0.05;

/// Who is ahead weaves so much more than it should, as a ratio of length and progress, at
/// most.
const STEEPER: f64 = 0.15;

/// Beside its line by this much, metres, a weave turns back by about a radian.
const BESIDE_M: f64 = 60.0;

/// The most that it turns back, radians.
const BESIDE_MOST_RAD: f64 = 0.6;

/// An airspeed within this share of what it should be is kept: each change disturbs.
const AIRSPEED_BAND: f64 = 0.12;

/// What is known of a target.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TargetMotion {
    /// Where it is.
    pub position: Point,
    /// Its velocity over the ground, m/s.
    pub velocity_mps: Vector,
    /// Its acceleration, m/s²; zero where it is not known.
    pub acceleration_mps2: Vector,
}

impl TargetMotion {
    /// What is known of it some seconds later.
    #[must_use]
    pub fn after(&self, s: f64) -> Self {
        Self {
            position: self.position
                + self.velocity_mps * s
                + self.acceleration_mps2 * (s * s / 2.0),
            velocity_mps: self.velocity_mps + self.acceleration_mps2 * s,
            ..*self
        }
    }
}

/// Where a UAV is to be, relative to its target.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum StandOff {
    /// At a distance, metres, on whatever side.
    Distance(f64),
    /// About one place beside it: metres east and north of the target. A fixed wing cannot
    /// stand there, so it circles or weaves about it as tightly as it can.
    Beside(Vector),
}

impl StandOff {
    /// That place from a bearing, radians counter-clockwise from east, and a distance.
    #[must_use]
    pub fn bearing(bearing_rad: f64, distance_m: f64) -> Self {
        let (s, c) = sin_cos(bearing_rad);
        Self::Beside(Vector::new(c, s) * distance_m)
    }

    fn offset(self) -> Vector {
        match self {
            Self::Distance(_) => Vector::zeros(),
            Self::Beside(offset) => offset,
        }
    }

    fn radius_m(self) -> f64 {
        match self {
            Self::Distance(m) => m,
            Self::Beside(_) => 0.0,
        }
    }
}

/// How a target is followed at the moment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Flown {
    /// On a circle of this radius, metres; wider than was asked for where that cannot be flown.
    Orbit(f64),
    /// On a weave that comes this far from it, metres.
    Weave(f64),
    /// On the way to it.
    Approach,
    /// After it: it is faster through the air than the UAV.
    Outrun,
}

/// What to fly for a while.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Command {
    /// For how long, seconds.
    pub lasts_s: f64,
    /// Airspeed, m/s.
    pub airspeed_mps: f64,
    /// Turn rate, rad/s, positive to the left.
    pub turn_rate_radps: f64,
    /// What it is part of.
    pub flown: Flown,
    /// Whether a faster turn was wanted than the airframe has.
    pub saturated: bool,
    /// Whether it leaves the wanted way for a zone.
    pub bent: bool,
}

/// The limits and wishes of one that follows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// What it can fly.
    pub airframe: Airframe,
    /// The airspeeds that it may fly.
    pub airspeeds: Airspeeds,
    /// The field of its orbits.
    pub field: Field,
    /// Where it is to be.
    pub stand_off: StandOff,
}

/// One UAV that follows a target.
#[derive(Clone, Debug, PartialEq)]
pub struct Follower {
    settings: Settings,
    switch: Switch,
    turn: Option<Turn>,
    phase_rad: f64,
    airspeed_mps: f64,
    approaches: bool,
    /// The radius of its circles instead of the stand-off, metres.
    circle_m: Option<f64>,
}

/// What one step is to do before it is limited.
struct Wanted {
    nose: Nose,
    airspeed_mps: f64,
    flown: Flown,
}

/// A UAV beside its target.
struct Scene<'a> {
    pose: &'a Pose,
    /// From the place to be to the UAV.
    from: Vector,
    drift: Drift,
    prospect: Prospect,
}

impl Follower {
    /// One that has not begun.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        Self {
            settings,
            switch: Switch::default(),
            turn: None,
            phase_rad: 0.0,
            airspeed_mps: settings.airspeeds.least_mps,
            approaches: true,
            circle_m: None,
        }
    }

    /// From now on circles have this radius, metres, or that of the stand-off; what cannot be
    /// flown is flown wider. Whether it circles or weaves goes by the stand-off all the same.
    pub fn circle(&mut self, radius_m: Option<f64>) {
        self.circle_m = radius_m;
    }

    /// What it was told to do.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The mode that is flown, and its changes.
    #[must_use]
    pub fn switch(&self) -> &Switch {
        &self.switch
    }

    /// What to fly for the next `period_s` seconds, in steps of 0.05 s, at most 64 of them;
    /// where `guard` has zones, beside the wanted way as far as these take.
    pub fn commands(
        &mut self,
        pose: Pose,
        wind: Wind,
        target: &TargetMotion,
        period_s: f64,
        guard: Option<&Guard<'_>>,
    ) -> Vec<Command> {
        let (mode, prospect) = self.prospect(wind, target, period_s);
        let around = |own: &mut Self, horizon_s: f64| {
            let steps = (horizon_s / STEP_S).round().clamp(1.0, 1_000.0);
            let (mut at, mut done, mut commands) = (pose, 0.0, Vec::new());
            while done < steps {
                let then = target.after(done * STEP_S);
                let command = own.step(&at, wind, &then, (mode, prospect), STEP_S);
                at = fly(&at, &command, wind);
                commands.push(command);
                done += 1.0;
            }
            commands
        };
        let Some(guard) = guard else {
            return around(self, period_s);
        };
        let mut ahead = self.clone();
        let wanted = around(&mut ahead, bend::LOOK_S.max(period_s));
        let bent = guard.bend(&self.settings.airframe, pose, wind, &wanted);
        let commands = around(self, period_s);
        match bent {
            None => commands,
            Some(turn_rate_radps) => commands
                .into_iter()
                .map(|c| Command {
                    turn_rate_radps,
                    bent: true,
                    ..c
                })
                .collect(),
        }
    }

    /// Where it would be after each of so many steps of `step_s` seconds, if the target moved so,
    /// by a copy of it; no zones are looked at.
    #[must_use]
    pub fn ahead(&self, pose: Pose, wind: Wind, step_s: f64, moves: &[TargetMotion]) -> Vec<Pose> {
        let mut own = self.clone();
        let Some(first) = moves.first() else {
            return Vec::new();
        };
        let how = own.prospect(wind, first, 0.0);
        let mut at = pose;
        let each = moves.iter().map(|target| {
            let command = own.step(&at, wind, target, how, step_s);
            at = fly(&at, &command, wind);
            at
        });
        each.collect()
    }

    /// The mode, and what it comes to, after `period_s` seconds of a target that moves so.
    fn prospect(&mut self, wind: Wind, target: &TargetMotion, period_s: f64) -> (Mode, Prospect) {
        let drift_mps = (target.velocity_mps - wind.velocity()).norm();
        let s = &self.settings;
        let (mode, mut prospect) = self.switch.update(
            &s.airframe,
            &s.airspeeds,
            drift_mps,
            s.stand_off.radius_m(),
            period_s,
        );
        if let Some(circle_m) = self.circle_m {
            prospect.loiter_m = prospect.least_radius_m.map(|m| m.max(circle_m));
        }
        (mode, prospect)
    }

    fn step(
        &mut self,
        pose: &Pose,
        wind: Wind,
        target: &TargetMotion,
        (mode, prospect): (Mode, Prospect),
        step_s: f64,
    ) -> Command {
        let scene = Scene {
            pose,
            from: pose.position() - (target.position + self.settings.stand_off.offset()),
            drift: Drift {
                velocity_mps: target.velocity_mps - wind.velocity(),
                acceleration_mps2: target.acceleration_mps2,
            },
            prospect,
        };
        let wanted = match mode {
            Mode::Loiter => self.loiter(&scene),
            Mode::Weave => self.weave(&scene, step_s),
        };
        let off_rad = wrap_pi(wanted.nose.heading_rad - pose.heading_rad);
        let most = turn_rate_radps(&self.settings.airframe, wanted.airspeed_mps);
        let gain = HEADING_GAIN.min(1.0 / step_s);
        let asked = wanted.nose.rate_radps + gain * off_rad;
        // Who is told no number about its target circles where it is.
        let asked = if asked.is_finite() { asked } else { most };
        Command {
            lasts_s: step_s,
            airspeed_mps: wanted.airspeed_mps,
            turn_rate_radps: asked.clamp(-most, most),
            flown: wanted.flown,
            saturated: asked.abs() > most,
            bent: false,
        }
    }

    /// On an orbit, or on the way to it.
    fn loiter(&mut self, scene: &Scene<'_>) -> Wanted {
        self.approaches = true;
        let radius_m = scene.prospect.loiter_m.unwrap_or(1.0);
        let speeds = self.settings.airspeeds;
        let drift_mps = scene.drift.velocity_mps.norm();
        let is_far = scene.from.norm() > OUTSIDE * radius_m;
        let airspeed_mps = if is_far {
            let cruise_mps = self.settings.airframe.cruise_mps;
            cruise_mps.max(speeds.least_mps).min(speeds.most_mps)
        } else {
            self.kept(speeds.of_loiter_mps(drift_mps))
        };
        let turn = *self.turn.get_or_insert_with(|| sense(scene));
        let orbit = Orbit {
            field: self.settings.field,
            radius_m,
            turn,
        };
        let towards = scene.pose.direction();
        match orbit.nose(scene.from, airspeed_mps, &scene.drift, towards) {
            Some(nose) => Wanted {
                nose,
                airspeed_mps,
                flown: Flown::Orbit(radius_m),
            },
            None => self.chase(scene),
        }
    }

    /// Along with the target, or on the way to it.
    fn weave(&mut self, scene: &Scene<'_>, step_s: f64) -> Wanted {
        let drift = scene.drift.velocity_mps;
        let drift_mps = drift.norm();
        let far_m = scene.prospect.weave_m.unwrap_or(0.0);
        let distance_m = scene.from.norm();
        let within_m = if self.approaches {
            far_m + BEGIN_M
        } else {
            FAR * far_m + FAR_M
        };
        // The sense of a later orbit is that of the way on which it is met.
        self.turn = None;
        if distance_m.is_nan() || distance_m > within_m || drift_mps < f64::MIN_POSITIVE {
            self.approaches = true;
            return self.chase(scene);
        }
        let ahead = drift / drift_mps;
        let left = Vector::new(-ahead.y, ahead.x);
        let (along_m, beside_m) = (scene.from.dot(&ahead), scene.from.dot(&left));
        let Some(steady) = self.weave_for(drift_mps, f64::INFINITY) else {
            return self.chase(scene);
        };
        if self.approaches {
            self.approaches = false;
            let climbs = scene.pose.direction().dot(&left) >= 0.0;
            self.phase_rad = steady.0.phase_at(beside_m, climbs);
        }
        // Who is ahead of where it should be makes less progress, by a wider weave.
        let gained_m = along_m - steady.0.ahead_m(self.phase_rad);
        let progress_mps = (drift_mps - ALONG_GAIN * gained_m).max(0.0);
        let Some((weave, airspeed_mps)) = self.weave_for(progress_mps, steady.0.slope) else {
            return self.chase(scene);
        };
        let speeds = self.settings.airspeeds;
        let (beside_rad, turning, line_m) = weave.at(self.phase_rad);
        let phase_rate = weave.phase_rate_radps(self.phase_rad, airspeed_mps);
        self.phase_rad = (self.phase_rad + phase_rate * step_s) % TAU;
        let back_rad = ((line_m - beside_m) / BESIDE_M).clamp(-BESIDE_MOST_RAD, BESIDE_MOST_RAD);
        let veer_radps = scene.drift.acceleration_mps2.dot(&left) / drift_mps;
        self.airspeed_mps = airspeed_mps;
        let flown = if drift_mps > speeds.most_mps {
            Flown::Outrun
        } else {
            Flown::Weave(far_m)
        };
        Wanted {
            nose: Nose {
                heading_rad: atan2(ahead.y, ahead.x) + beside_rad + back_rad,
                rate_radps: turning * phase_rate + veer_radps,
            },
            airspeed_mps,
            flown,
        }
    }

    /// A weave that makes so much progress, and its airspeed, m/s; steeper than `slope` by no
    /// more than a little.
    fn weave_for(&self, progress_mps: f64, slope: f64) -> Option<(Weave, f64)> {
        let airspeed_mps = self.settings.airspeeds.of_weave_mps(progress_mps);
        let most = (ratio_of(slope.min(LARGEST_RATIO)) + STEEPER).min(LARGEST_RATIO);
        let ratio = (airspeed_mps / progress_mps).clamp(1.0, most);
        let turn_radius_m = self.settings.airframe.turn_radius_m(airspeed_mps);
        Weave::of(ratio, turn_radius_m).map(|w| (w, airspeed_mps))
    }

    /// The straightest way to the target as fast as may be; after it where it is faster.
    fn chase(&mut self, scene: &Scene<'_>) -> Wanted {
        let speeds = self.settings.airspeeds;
        let distance_m = scene.from.norm();
        let straight = if distance_m > 1.0 {
            -scene.from / distance_m
        } else {
            scene.pose.direction()
        };
        let at = |airspeed_mps: f64| {
            let carried = carried(straight, 0.0, airspeed_mps, &scene.drift);
            let (nose, flown) = match carried {
                Some(nose) => (nose, Flown::Approach),
                None => {
                    let nose = Nose {
                        heading_rad: atan2(straight.y, straight.x),
                        rate_radps: 0.0,
                    };
                    (nose, Flown::Outrun)
                }
            };
            Wanted {
                nose,
                airspeed_mps,
                flown,
            }
        };
        let fast = at(speeds.most_mps);
        let off_rad = wrap_pi(fast.nose.heading_rad - scene.pose.heading_rad);
        let turns = off_rad.abs() > TURNS_RAD;
        // The slowest wing turns fastest: it comes round soonest, and loses the least way. As fast
        // as its target it would turn half as fast, and see it leave the picture meanwhile.
        let wanted = if turns {
            Wanted {
                airspeed_mps: speeds.least_mps,
                ..fast
            }
        } else {
            fast
        };
        self.airspeed_mps = wanted.airspeed_mps;
        wanted
    }

    /// The airspeed of before, if it is near enough.
    fn kept(&mut self, wanted_mps: f64) -> f64 {
        let now_mps = self.airspeed_mps;
        if now_mps < wanted_mps || now_mps > wanted_mps * (1.0 + AIRSPEED_BAND) {
            self.airspeed_mps = wanted_mps;
        }
        self.airspeed_mps
    }
}

/// The sense in which a UAV already goes round, or would with the least turn.
fn sense(scene: &Scene<'_>) -> Turn {
    let relative = scene.pose.direction();
    let round = scene.from.x * relative.y - scene.from.y * relative.x;
    if round < 0.0 { Turn::Right } else { Turn::Left }
}

/// Where a command takes a UAV: an arc through the air, which the wind carries.
#[must_use]
pub fn fly(pose: &Pose, command: &Command, wind: Wind) -> Pose {
    let half_rad = command.turn_rate_radps * command.lasts_s / 2.0;
    let shrink = if half_rad.abs() < 1e-6 {
        1.0 - half_rad * half_rad / 6.0
    } else {
        sin(half_rad) / half_rad
    };
    let chord_m = command.airspeed_mps * command.lasts_s * shrink;
    let (s, c) = sin_cos(pose.heading_rad + half_rad);
    let at = pose.position() + Vector::new(c, s) * chord_m + wind.velocity() * command.lasts_s;
    Pose::new(at, wrap_pi(pose.heading_rad + 2.0 * half_rad))
}

#[cfg(test)]
mod tests;
