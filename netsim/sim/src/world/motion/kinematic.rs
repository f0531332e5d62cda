//! A kinematic fixed wing: constant airspeed and turn rate piece by piece, flown
//! exactly (D2.7 §2.2, §2.4), in air that drifts with a constant wind; it climbs at a constant
//! rate whatever else it flies. The lag of a real airframe belongs to the dynamic model.
//!
//! A leg is a circular arc or a line from an anchor pose. The pose at any time comes
//! from the anchor in closed form, so it does not depend on how often somebody asked.

use super::promised::Promised;
use crate::world::camera::{Camera, Eye, Picture};
use skein_behaviors::setpoint::GimbalStep;
use skein_behaviors::{Percept, Setpoint, Side};
use skein_flight::airframe::Airframe;
use skein_flight::trajectory::wind::{Course, Heading, Wind};
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::{FRAC_PI_2, atan2, seconds, sin, sin_cos, tan, wrap_pi};

/// An airframe that was given no setpoint for this long loiters on its own. Two
/// percept periods of the slowest sensible peer (500 ms) are lost before it trips.
pub const FAILSAFE_MS: u64 = 1000;

/// Standard gravity, m/s²; the world keeps its own copy of the physics.
const G_MPS2: f64 = 9.806_65;

/// How often the failsafe loiter corrects its turn in a wind, milliseconds: the course
/// turns by a few degrees meanwhile.
const HOLD_STEP_MS: u64 = 100;

/// The part of an error of place that the failsafe loiter takes away in a second.
const HOLD_GAIN: f64 = 0.3;

/// The steepest angle at which it approaches its circle, radians.
const HOLD_MOST_RAD: f64 = 0.3;

/// The circle over the ground that the failsafe loiter holds in a wind.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Hold {
    centre: Point,
    radius_m: f64,
    /// 1 to the left, −1 to the right.
    side: f64,
    /// When the turn is corrected next, milliseconds.
    until_ms: u64,
}

/// A stretch flown at constant airspeed and turn rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// When it began, milliseconds.
    pub from_ms: u64,
    /// When it ended, milliseconds.
    pub to_ms: u64,
    /// Where it began.
    pub start: Pose,
    /// Airspeed, m/s.
    pub speed_mps: f64,
    /// Turn rate, rad/s, positive to the left.
    pub turn_rate_radps: f64,
    /// The wind that carries it.
    pub wind: Wind,
}

impl Piece {
    /// An instant of it.
    pub fn at(pose: Pose, at_ms: u64) -> Self {
        Self {
            from_ms: at_ms,
            to_ms: at_ms,
            start: pose,
            speed_mps: 0.0,
            turn_rate_radps: 0.0,
            wind: Wind::default(),
        }
    }

    /// Length in metres; in a wind the most that it can be over the ground.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        (self.speed_mps + self.wind.speed_mps()) * seconds(self.to_ms - self.from_ms)
    }

    /// The pose a number of seconds after the beginning, exact.
    #[must_use]
    pub fn pose_after(&self, dt_s: f64) -> Pose {
        let half_rad = self.turn_rate_radps * dt_s / 2.0;
        // The chord of the arc: as long as the arc times sin(x)/x, in the mean direction.
        let shrink = if half_rad.abs() < 1e-6 {
            1.0 - half_rad * half_rad / 6.0
        } else {
            sin(half_rad) / half_rad
        };
        let chord_m = self.speed_mps * dt_s * shrink;
        let (s, c) = sin_cos(self.start.heading_rad + half_rad);
        Pose {
            east_m: self.start.east_m + chord_m * c + self.wind.east_mps * dt_s,
            north_m: self.start.north_m + chord_m * s + self.wind.north_mps * dt_s,
            heading_rad: wrap_pi(self.start.heading_rad + 2.0 * half_rad),
        }
    }

    /// The pose at a time, exact; times outside the piece extrapolate.
    #[must_use]
    pub fn pose_at(&self, at_ms: u64) -> Pose {
        self.pose_after(if at_ms >= self.from_ms {
            seconds(at_ms - self.from_ms)
        } else {
            -seconds(self.from_ms - at_ms)
        })
    }

    /// How many equal chords keep the arc within `sagitta_m` of them, at least one.
    #[must_use]
    pub fn chords(&self, sagitta_m: f64) -> u32 {
        let turned_rad = (self.turn_rate_radps * seconds(self.to_ms - self.from_ms)).abs();
        if turned_rad < 1e-9 {
            return 1;
        }
        // A chord over the angle d of radius r has the sagitta r (1 - cos(d/2)) <= r d² / 8;
        // that of a trochoid is no more, for wind adds no acceleration.
        let radius_m = self.speed_mps / self.turn_rate_radps.abs();
        let n = (turned_rad / (8.0 * sagitta_m / radius_m).sqrt()).ceil();
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped to a small positive number"
        )]
        let n = n.clamp(1.0, 1e6) as u32;
        n
    }
}

/// Why an airframe is gone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Loss {
    /// Its tanks ran dry.
    Fuel,
    /// A fault took it.
    Killed,
}

/// One airframe in flight.
#[derive(Clone, Debug)]
pub struct Kinematic {
    airframe: Airframe,
    height_m: f64,
    /// Where it begins.
    slot_m: f64,
    launch: Pose,
    now_ms: u64,
    /// The leg being flown; `to_ms` is not used.
    leg: Piece,
    /// Flight time left.
    fuel_ms: u64,
    setpoint: Option<Setpoint>,
    /// When the failsafe trips unless something newer comes.
    fresh_until_ms: u64,
    failsafe: bool,
    /// The circle of the failsafe, once begun in a wind.
    hold: Option<Hold>,
    /// What it flies for want of setpoints, if others were promised its flight.
    promised: Option<Promised>,
    lost: Option<Loss>,
    camera: Camera,
}

impl Kinematic {
    /// An airframe at its launch pose and height slot, full tanks, cruise airspeed.
    #[must_use]
    pub fn new(airframe: Airframe, launch: Pose, height_m: f64, now_ms: u64) -> Self {
        Self {
            airframe,
            height_m,
            slot_m: height_m,
            launch,
            now_ms,
            leg: Piece {
                from_ms: now_ms,
                to_ms: now_ms,
                start: launch,
                speed_mps: airframe.cruise_mps,
                turn_rate_radps: 0.0,
                wind: Wind::CALM,
            },
            fuel_ms: endurance_ms(&airframe),
            setpoint: None,
            promised: None,
            fresh_until_ms: now_ms + FAILSAFE_MS,
            failsafe: false,
            hold: None,
            lost: None,
            camera: Camera::new(&airframe),
        }
    }

    /// The same, on the ground until it takes off.
    #[must_use]
    pub fn taking_off_at(mut self, takeoff_ms: u64) -> Self {
        self.stand_until(self.now_ms.max(takeoff_ms));
        self
    }

    /// On the ground still, it takes off then.
    pub fn stand_until(&mut self, takeoff_ms: u64) {
        self.now_ms = takeoff_ms;
        self.leg.from_ms = self.now_ms;
        self.leg.to_ms = self.now_ms;
        self.fresh_until_ms = self.now_ms + FAILSAFE_MS;
    }

    /// Time until it takes off, milliseconds; 0 in the air.
    #[must_use]
    pub fn takes_off_in_ms(&self, now_ms: u64) -> u64 {
        self.now_ms.saturating_sub(now_ms)
    }

    /// The same in a wind.
    #[must_use]
    pub fn in_wind(mut self, wind: Wind) -> Self {
        self.leg.wind = wind;
        self
    }

    /// Another wind blows from now on.
    pub fn take_wind(&mut self, wind: Wind) {
        let start = self.leg.pose_at(self.now_ms);
        self.leg = Piece {
            from_ms: self.now_ms,
            to_ms: self.now_ms,
            start,
            wind,
            ..self.leg
        };
        // What the failsafe held was laid out for the wind before.
        self.hold = None;
    }

    /// A new airframe at the launch point.
    pub fn relaunch(&mut self, now_ms: u64) {
        let wind = self.leg.wind;
        *self = Self::new(self.airframe, self.launch, self.slot_m, now_ms).in_wind(wind);
    }

    /// Takes the airframe out of the air.
    pub fn kill(&mut self) {
        self.lost.get_or_insert(Loss::Killed);
    }

    /// Whether it flies, and if not why.
    #[must_use]
    pub fn lost(&self) -> Option<Loss> {
        self.lost
    }

    /// Whether it flies.
    #[must_use]
    pub fn airborne(&self) -> bool {
        self.lost.is_none()
    }

    /// Whether it loiters on its own for want of setpoints.
    #[must_use]
    pub fn failsafe(&self) -> bool {
        self.failsafe
    }

    /// What it can fly, and its camera.
    #[must_use]
    pub fn airframe(&self) -> &Airframe {
        &self.airframe
    }

    /// What looks down from it.
    #[must_use]
    pub fn eye(&self) -> Eye<'_> {
        Eye::new(&self.airframe, &self.camera, self.height_m)
    }

    /// What is in its picture now.
    #[must_use]
    pub fn picture(&self) -> Picture {
        self.eye().picture_now(self.pose())
    }

    /// Its height above the origin, metres.
    #[must_use]
    pub fn height_m(&self) -> f64 {
        self.height_m
    }

    /// Where it is, or was lost.
    #[must_use]
    pub fn pose(&self) -> Pose {
        self.leg.pose_at(self.now_ms)
    }

    /// Where it is, or was lost, without the heading.
    #[must_use]
    pub fn position(&self) -> Point {
        self.pose().position()
    }

    /// What its sensors say; nothing once it is lost.
    #[must_use]
    pub fn percept(&self) -> Option<Percept> {
        self.airborne().then(|| Percept {
            time_ms: self.now_ms,
            pose: self.pose(),
            height_m: self.height_m,
            airspeed_mps: self.leg.speed_mps,
            wind_east_mps: self.leg.wind.east_mps,
            wind_north_mps: self.leg.wind.north_mps,
            wind_unknown: false,
            endurance_s: seconds(self.fuel_ms),
            takes_off_in_ms: 0,
            launch_ready: false,
            failsafe: self.failsafe,
            circles_per_m: self.unattended().and_then(Promised::circle_per_m),
            circles_in_ms: self
                .unattended()
                .map_or(0, |p| p.circles_in_ms(self.now_ms)),
            traffic: skein_behaviors::traffic::Traffic::default(),
            obstacles: skein_behaviors::obstacle::Obstacles::default(),
            sightings: skein_behaviors::sightings::Sightings::default(),
            contour: skein_behaviors::contour::ContourLook::default(),
            crowd: skein_behaviors::crowd::CrowdLook::default(),
            attitude: (!self.airframe.mount.is_level()).then(|| self.camera.attitude()),
        })
    }

    /// Takes a setpoint, unless it answers an older percept than the present one,
    /// is stale already, or holds a number that is none; says whether it was taken.
    ///
    /// A setpoint for the near future counts as fresh from now on, not from then on,
    /// and one for the far future is refused: a wrong time must neither disable the
    /// failsafe nor lock out what comes after it.
    pub fn apply(&mut self, setpoint: Setpoint, now_ms: u64) -> bool {
        let now_ms = now_ms.max(self.now_ms);
        let fresh_until_ms = setpoint.from_ms.min(now_ms) + FAILSAFE_MS;
        let future = setpoint.from_ms > now_ms + FAILSAFE_MS;
        let finite = setpoint.airspeed_mps.is_finite()
            && setpoint.height_m.is_finite()
            && setpoint.steps.iter().all(|s| s.turn_rate_radps.is_finite())
            && setpoint.gimbal.iter().all(GimbalStep::is_finite);
        let older = self
            .setpoint
            .as_ref()
            .is_some_and(|s| s.from_ms > setpoint.from_ms);
        if !finite || older || future || !self.airborne() || fresh_until_ms <= self.now_ms {
            return false;
        }
        self.fresh_until_ms = fresh_until_ms;
        self.camera.take(&setpoint);
        self.promise(&setpoint);
        self.setpoint = Some(setpoint);
        true
    }

    /// What others were promised that it flies, from now on.
    pub fn promise(&mut self, setpoint: &Setpoint) {
        self.promised = Promised::of(setpoint);
    }

    /// What others were promised, if it flies that for want of setpoints.
    fn unattended(&self) -> Option<&Promised> {
        self.promised.as_ref().filter(|_| self.failsafe)
    }

    /// Whether the last setpoint that it took still flies it.
    #[must_use]
    pub fn is_commanded(&self, now_ms: u64) -> bool {
        self.setpoint.is_some() && now_ms.max(self.now_ms) < self.fresh_until_ms
    }

    /// The fuel lasts no longer than this from now on, milliseconds.
    pub fn limit_fuel(&mut self, lasts_ms: u64) {
        self.fuel_ms = self.fuel_ms.min(lasts_ms);
    }

    /// Flies on to a time and appends what was flown. An airframe out of fuel stops
    /// there and is lost.
    pub fn advance(&mut self, to_ms: u64, flown: &mut Vec<Piece>) {
        self.camera.begin();
        while self.airborne() && self.now_ms < to_ms {
            let (rate, speed, until_ms) = self.command();
            self.steer(rate, speed);
            let next_ms = to_ms.min(until_ms).min(self.now_ms + self.fuel_ms);
            if next_ms > self.now_ms {
                let start = self.leg.pose_at(self.now_ms);
                let piece = Piece {
                    from_ms: self.now_ms,
                    to_ms: next_ms,
                    start,
                    ..self.leg
                };
                self.camera.follow(&self.airframe, &piece);
                flown.push(piece);
            }
            self.climb(next_ms - self.now_ms);
            self.fuel_ms -= next_ms - self.now_ms;
            self.now_ms = next_ms;
            if self.fuel_ms == 0 {
                self.lost = Some(Loss::Fuel);
            }
        }
        // What the failsafe is at the end of the step shows in the next percept.
        self.failsafe = self.now_ms >= self.fresh_until_ms;
        if !self.airborne() {
            return;
        }
        self.now_ms = self.now_ms.max(to_ms);
    }

    /// Climbs or descends to the height that was commanded last, also under the failsafe: there
    /// it may stay.
    fn climb(&mut self, for_ms: u64) {
        let Some(to_m) = self.setpoint.as_ref().map(|s| s.height_m) else {
            return;
        };
        let most_m = self.airframe.climb_mps * seconds(for_ms);
        self.height_m += (to_m - self.height_m).clamp(-most_m, most_m);
    }

    /// Turn rate and airspeed from now on, within the limits, and until when.
    fn command(&mut self) -> (f64, f64, u64) {
        self.failsafe = self.now_ms >= self.fresh_until_ms;
        let waits = self.setpoint.is_none() && self.promised.is_some();
        if self.failsafe || waits {
            return self.fly_alone();
        }
        self.hold = None;
        let Some(s) = &self.setpoint else {
            return (0.0, self.airframe.cruise_mps, self.fresh_until_ms);
        };
        let speed = s
            .airspeed_mps
            .max(self.airframe.stall_mps)
            .min(self.airframe.max_mps);
        let (rate, until_ms) = if self.now_ms < s.from_ms {
            (self.leg.turn_rate_radps, s.from_ms)
        } else {
            step_at(s, self.now_ms)
        };
        let limit = self.max_rate(speed);
        (
            rate.max(-limit).min(limit),
            speed,
            until_ms.min(self.fresh_until_ms),
        )
    }

    /// Without setpoints: what others were promised, in the still air for which it was; else the
    /// failsafe loiter.
    fn fly_alone(&mut self) -> (f64, f64, u64) {
        let is_calm = self.leg.wind.speed_mps() <= 0.0;
        let before = (self.leg.turn_rate_radps, self.leg.speed_mps);
        if let Some(here) = self.percept().filter(|_| is_calm)
            && let Some(promised) = &mut self.promised
        {
            let (rate, speed, until_ms) = promised.command(&here, &self.airframe, before);
            let limit = self.max_rate(speed);
            return (rate.clamp(-limit, limit), speed, until_ms);
        }
        self.loiter()
    }

    /// The failsafe: the sharpest turn at cruise, in a wind a circle over the ground.
    fn loiter(&mut self) -> (f64, f64, u64) {
        let side = match self.setpoint.as_ref().map_or(Side::Left, |s| s.loiter) {
            Side::Left => 1.0,
            Side::Right => -1.0,
        };
        let (wind, cruise_mps) = (self.leg.wind, self.airframe.cruise_mps);
        let calm = (side * self.max_rate(cruise_mps), cruise_mps, u64::MAX);
        let v = self.holding_mps();
        if wind.speed_mps() <= 0.0 || wind.speed_mps() >= v {
            return calm;
        }
        let pose = self.leg.pose_at(self.now_ms);
        let mut hold = self.hold.unwrap_or_else(|| {
            let radius_m = self.airframe.ground_turn_radius_m(v, wind.speed_mps());
            let (s, c) = sin_cos(wind.course_of(Heading(pose.heading_rad), v).0);
            let out_m = side * radius_m;
            Hold {
                centre: Point::new(pose.east_m - out_m * s, pose.north_m + out_m * c),
                radius_m,
                side,
                until_ms: self.now_ms,
            }
        });
        let mut rate = self.leg.turn_rate_radps;
        if self.now_ms >= hold.until_ms {
            hold.until_ms = self.now_ms + HOLD_STEP_MS;
            rate = self.holding_rate(&hold, pose, v);
        }
        self.hold = Some(hold);
        (rate, v, hold.until_ms)
    }

    /// The airspeed of the failsafe in a wind: the last that was commanded, for which
    /// turns over the ground were planned, or as slow as turns may be flown.
    fn holding_mps(&self) -> f64 {
        let a = &self.airframe;
        let last = self.setpoint.as_ref().map(|s| s.airspeed_mps);
        last.unwrap_or(a.least_airspeed_mps())
            .max(a.stall_mps)
            .min(a.max_mps)
    }

    /// The turn that has the nose along the circle at the end of the next step.
    fn holding_rate(&self, hold: &Hold, pose: Pose, v: f64) -> f64 {
        let wind = self.leg.wind;
        let out = pose.position() - hold.centre;
        let around_rad = atan2(out.y, out.x) + hold.side * FRAC_PI_2;
        let step_s = seconds(HOLD_STEP_MS);
        let speed_mps = wind.ground_speed_mps(Course(around_rad), v).unwrap_or(v);
        let next_rad = around_rad + hold.side * speed_mps * step_s / hold.radius_m;
        let wide_m = out.norm() - hold.radius_m;
        let inward_rad =
            (HOLD_GAIN * wide_m / speed_mps.max(1.0)).clamp(-HOLD_MOST_RAD, HOLD_MOST_RAD);
        let course = Course(next_rad + hold.side * inward_rad);
        let heading = wind
            .heading_for_course(course, v)
            .unwrap_or(Heading(course.0));
        let limit = self.max_rate(v);
        (wrap_pi(heading.0 - pose.heading_rad) / step_s)
            .max(-limit)
            .min(limit)
    }

    /// The fastest turn that the bank limit allows, rad/s.
    fn max_rate(&self, speed_mps: f64) -> f64 {
        G_MPS2 * tan(self.airframe.max_bank_rad) / speed_mps
    }

    /// Begins a new leg unless the present one already is what is wanted.
    fn steer(&mut self, rate: f64, speed: f64) {
        let same = rate.to_bits() == self.leg.turn_rate_radps.to_bits()
            && speed.to_bits() == self.leg.speed_mps.to_bits();
        if !same {
            let start = self.leg.pose_at(self.now_ms);
            self.leg = Piece {
                from_ms: self.now_ms,
                to_ms: self.now_ms,
                start,
                speed_mps: speed,
                turn_rate_radps: rate,
                wind: self.leg.wind,
            };
        }
    }
}

fn endurance_ms(airframe: &Airframe) -> u64 {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a cast of a float saturates"
    )]
    let ms = (airframe.endurance_s * 1000.0) as u64;
    // Bounded, so that sums with times cannot overflow: 31 years.
    ms.min(1_000_000_000_000)
}

/// The turn rate a setpoint wants at a time not before its own, and until when.
fn step_at(s: &Setpoint, at_ms: u64) -> (f64, u64) {
    let mut end_ms = s.from_ms;
    for step in &s.steps {
        end_ms = end_ms.saturating_add(u64::from(step.duration_ms));
        if at_ms < end_ms {
            return (step.turn_rate_radps, end_ms);
        }
    }
    (s.steps.last().map_or(0.0, |l| l.turn_rate_radps), u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::fixture::airframe;
    use skein_behaviors::Steer;
    use skein_geometry::math::cos;

    #[test]
    fn it_climbs_at_its_rate_to_what_was_commanded_last_also_without_its_computer() {
        let mut k = fresh();
        let mut flown = Vec::new();
        let up = Setpoint {
            launch: skein_behaviors::Launch::Stay,
            promised: None,
            from_ms: 0,
            airspeed_mps: 13.0,
            height_m: 51.0,
            steps: Vec::new(),
            loiter: Side::Left,
            gimbal: Vec::new(),
        };
        let none = Setpoint {
            height_m: f64::NAN,
            ..up.clone()
        };
        assert!(!k.apply(none, 0));
        assert!(k.apply(up, 0));
        k.advance(1_000, &mut flown);
        assert!((k.height_m() - 48.0).abs() < 1e-9, "{}", k.height_m());
        assert!((k.percept().unwrap().height_m - 48.0).abs() < 1e-9);
        k.advance(9_000, &mut flown);
        assert!(k.failsafe() && (k.height_m() - 51.0).abs() < 1e-9);
        k.kill();
        k.relaunch(10_000);
        assert!(
            (k.height_m() - 45.0).abs() < 1e-9,
            "a new one is where it was launched"
        );
    }

    fn fresh() -> Kinematic {
        Kinematic::new(
            airframe(),
            Pose {
                east_m: 10.0,
                north_m: -5.0,
                heading_rad: 3.0,
            },
            45.0,
            0,
        )
    }

    fn setpoint(from_ms: u64, steps: &[(f64, u32)]) -> Setpoint {
        Setpoint {
            from_ms,
            airspeed_mps: 13.0,
            height_m: 45.0,
            steps: steps
                .iter()
                .map(|(r, d)| Steer {
                    turn_rate_radps: *r,
                    duration_ms: *d,
                })
                .collect(),
            loiter: Side::Right,
            gimbal: Vec::new(),
            launch: skein_behaviors::setpoint::Launch::Stay,
            promised: None,
        }
    }

    fn euler(k: &Kinematic, rates: &[(f64, u32)]) -> Pose {
        let mut p = k.pose();
        let dt = 1e-4;
        for (rate, ms) in rates {
            for _ in 0..ms * 10 {
                // The middle of the step, second order.
                let h = p.heading_rad + rate * dt / 2.0;
                p.east_m += 13.0 * dt * cos(h);
                p.north_m += 13.0 * dt * sin(h);
                p.heading_rad += rate * dt;
            }
        }
        p
    }

    #[test]
    fn arcs_agree_with_fine_integration_however_they_are_cut() {
        let steps = [(0.3, 333), (-0.5, 250), (0.0, 100), (1e-8, 217)];
        let mut a = fresh();
        let expected = euler(&a, &steps);
        assert!(a.apply(setpoint(0, &steps), 0));
        let mut b = a.clone();
        let mut flown = Vec::new();
        a.advance(900, &mut flown);
        for t in [1, 7, 333, 400, 401, 650, 899, 900] {
            b.advance(t, &mut Vec::new());
        }
        let p = a.pose();
        assert!(
            (p.position() - expected.position()).norm() < 1e-6,
            "{p:?} {expected:?}"
        );
        assert!(wrap_pi(p.heading_rad - expected.heading_rad).abs() < 1e-9);
        assert_eq!(p, b.pose());
        assert_eq!(flown.len(), 4);
        assert!((flown.iter().map(Piece::length_m).sum::<f64>() - 11.7).abs() < 1e-12);
    }

    #[test]
    fn a_wind_carries_it_along_and_is_told() {
        let wind = Wind::new(3.0, -1.0);
        let (mut calm, mut blown) = (fresh(), fresh().in_wind(wind));
        for k in [&mut calm, &mut blown] {
            assert!(k.apply(setpoint(0, &[(0.3, 333), (-0.5, 400)]), 0));
            k.advance(350, &mut Vec::new());
            k.advance(900, &mut Vec::new());
        }
        let drift = blown.position() - calm.position();
        assert!((drift - wind.velocity() * 0.9).norm() < 1e-9, "{drift}");
        assert!(wrap_pi(blown.pose().heading_rad - calm.pose().heading_rad).abs() < 1e-12);
        let told = blown.percept().unwrap();
        assert!(
            (told.wind_east_mps - 3.0).abs() < 1e-12 && (told.wind_north_mps + 1.0).abs() < 1e-12
        );
        blown.relaunch(1000);
        blown.advance(1500, &mut Vec::new());
        assert!((blown.percept().unwrap().wind_east_mps - 3.0).abs() < 1e-12);
    }

    #[test]
    fn physics_limits_airspeed_and_bank() {
        let mut k = fresh();
        let wild = Setpoint {
            airspeed_mps: 100.0,
            ..setpoint(0, &[(50.0, 1000)])
        };
        assert!(k.apply(wild, 0));
        let mut flown = Vec::new();
        k.advance(100, &mut flown);
        assert!((flown[0].speed_mps - 16.0).abs() < 1e-12);
        assert!((flown[0].turn_rate_radps - 9.806_65 / 16.0).abs() < 1e-9);
        assert!(k.apply(
            Setpoint {
                airspeed_mps: 0.0,
                ..setpoint(100, &[])
            },
            100
        ));
        k.advance(200, &mut flown);
        assert!((flown[1].speed_mps - 9.0).abs() < 1e-12);
    }

    #[test]
    fn without_setpoints_it_loiters_after_a_second_and_recovers() {
        let mut k = fresh();
        k.advance(500, &mut Vec::new());
        assert!(k.apply(setpoint(500, &[(0.0, 400)]), 520));
        k.advance(1499, &mut Vec::new());
        assert!(!k.failsafe());
        k.advance(1600, &mut Vec::new());
        assert!(k.failsafe() && k.percept().unwrap().failsafe);
        let at = k.pose();
        // One full circle of the smallest radius at cruise, to the given side.
        let radius_m = 13.0 * 13.0 / 9.806_65;
        let mut flown = Vec::new();
        k.advance(1600 + 12_000, &mut flown);
        assert!(flown.iter().all(|p| p.turn_rate_radps < 0.0));
        let side = at.direction();
        let centre = at.position() + nalgebra::Vector2::new(side.y, -side.x) * radius_m;
        assert!(((k.position() - centre).norm() - radius_m).abs() < 1e-6);
        assert!(k.apply(setpoint(13_600, &[]), 13_650));
        k.advance(13_700, &mut flown);
        assert!(!k.failsafe());
        assert!(flown.last().unwrap().turn_rate_radps.abs() < 1e-12);
    }

    #[test]
    fn in_a_wind_it_loiters_over_one_place_and_keeps_its_limits() {
        for (wind, side) in [
            (Wind::new(3.0, -1.0), Side::Left),
            (Wind::new(-6.0, 2.0), Side::Right),
            (Wind::new(0.0, 0.4), Side::Right),
        ] {
            let mut k = fresh().in_wind(wind);
            let loiter = side;
            assert!(k.apply(
                Setpoint {
                    loiter,
                    ..setpoint(0, &[(0.2, 400)])
                },
                0
            ));
            k.advance(1000, &mut Vec::new());
            let at = k.pose();
            let radius_m = airframe().ground_turn_radius_m(13.0, wind.speed_mps());
            let (s, c) = sin_cos(wind.course_of(Heading(at.heading_rad), 13.0).0);
            let out_m = if side == Side::Left {
                radius_m
            } else {
                -radius_m
            };
            let centre = Point::new(at.east_m - out_m * s, at.north_m + out_m * c);
            let mut flown = Vec::new();
            let mut other = k.clone();
            k.advance(120_000, &mut flown);
            for p in &flown {
                let off_m = ((p.start.position() - centre).norm() - radius_m).abs();
                assert!(off_m < 0.5, "{wind:?}: {off_m} at {}", p.from_ms);
                assert!(p.turn_rate_radps.abs() <= 9.806_65 / 13.0 + 1e-12);
            }
            for t in [1001, 1777, 9000, 60_123, 120_000] {
                other.advance(t, &mut Vec::new());
            }
            assert_eq!(k.pose(), other.pose(), "however often it is asked");
        }
    }

    #[test]
    fn old_future_and_broken_setpoints_do_no_harm() {
        let mut k = fresh();
        k.advance(5000, &mut Vec::new());
        assert!(!k.apply(setpoint(3000, &[]), 5000), "stale");
        assert!(
            !k.apply(setpoint(5000, &[(f64::NAN, 5)]), 5000),
            "not a number"
        );
        assert!(
            !k.apply(setpoint(u64::MAX - 5, &[(0.1, 10)]), 5000),
            "far future"
        );
        assert!(k.apply(setpoint(5900, &[(0.1, 10)]), 5000));
        k.advance(6100, &mut Vec::new());
        assert!(k.failsafe());
        assert!(
            !k.apply(setpoint(5800, &[]), 6100),
            "older than the one in force"
        );
    }

    #[test]
    fn it_is_lost_when_the_tanks_are_empty() {
        let mut k = Kinematic::new(
            Airframe {
                endurance_s: 2.5,
                ..airframe()
            },
            fresh().pose(),
            45.0,
            1000,
        );
        let mut flown = Vec::new();
        k.advance(3000, &mut flown);
        assert!((k.percept().unwrap().endurance_s - 0.5).abs() < 1e-12);
        k.advance(9000, &mut flown);
        assert_eq!(k.lost(), Some(Loss::Fuel));
        assert_eq!(flown.last().unwrap().to_ms, 3500);
        assert!(k.percept().is_none());
        k.relaunch(9000);
        assert!(k.airborne());
        assert_eq!(k.pose(), fresh().pose());
    }

    #[test]
    fn chords_stay_as_close_as_asked() {
        let p = Piece {
            from_ms: 0,
            to_ms: 5000,
            start: fresh().pose(),
            speed_mps: 13.0,
            turn_rate_radps: 0.7,
            wind: Wind::CALM,
        };
        let n = p.chords(0.01);
        let (a, b) = (p.pose_after(0.0), p.pose_after(5.0 / f64::from(n)));
        let m = p.pose_after(2.5 / f64::from(n));
        let mid = a.position() + (b.position() - a.position()) / 2.0;
        let sagitta = (m.position() - mid).norm();
        assert!(sagitta <= 0.01 && sagitta > 0.002, "{sagitta}");
    }
}
