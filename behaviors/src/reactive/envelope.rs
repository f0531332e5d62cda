//! The envelope: stall, bank, zones; the last word on every setpoint (D2.7 §1.2.3,
//! reactive layer).
//!
//! Whatever asks for a flight, what leaves here can be flown: the airspeed keeps
//! above the stall, in the steepest turn too, turns keep the bank limit, numbers are numbers, and a flight
//! that would come too near to a zone is replaced by a loiter on the clearer side. So is one that
//! leads to where no loiter is clear of the zones any more, as long as one is.
//! Height belongs to the UAV's slot and is passed through.
//!
//! # Complexity
//! Zones near the UAV are gathered once every 60 m flown; a setpoint is then
//! checked against those alone, and for nothing where there are none.

use super::air::{self, Air};
use super::follow::{HORIZON_S, Offset, Track, fly};
use crate::percept::Percept;
use crate::setpoint::{MAX_STEPS, Setpoint, Side, Steer};
use skein_flight::airframe::Airframe;
use skein_flight::trajectory::wind::Wind;
use skein_geometry::NoFlyZones;
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::TAU;
use skein_geometry::{Curve, Segment};
use std::sync::Arc;

/// Flown distance after which the zones nearby are gathered anew, metres: some four
/// seconds, so that it costs nothing on average.
const GATHER_M: f64 = 60.0;

/// How far ahead the failsafe loiter may begin, seconds: the time without setpoints
/// after which an airframe flies it.
const FAILSAFE_S: f64 = 1.0;
const FAILSAFE_MS: u32 = 1_000;

/// Trochoids are measured by chords of this duration, seconds: at a turn of 0.6 g they
/// stray a few centimetres.
const CHORD_S: f64 = 0.25;

/// A side of the failsafe loiter is changed only for this much more room, metres, so
/// that rounding does not swap it back and forth.
const SIDE_MARGIN_M: f64 = 0.5;

/// As far at least from a zone is a loiter that is clear of it, metres: what flying it may stray.
/// One that is flown is clear until it is half as far, so that rounding does not end it.
const CLEAR_M: f64 = 3.0;

/// Checks setpoints of one UAV.
#[derive(Clone, Debug)]
pub struct Envelope {
    airframe: Airframe,
    zones: Arc<NoFlyZones>,
    /// Nearer than this to a zone a flight is refused, metres.
    least_m: f64,
    near: NoFlyZones,
    gathered_at: Option<Point>,
    side: Side,
    /// The wind of the last percept, and the airspeed commanded in it.
    air: Air,
}

impl Envelope {
    /// An envelope that refuses flights nearer than `least_m` to a zone: the
    /// clearance that curves keep, less what following a curve may stray.
    #[must_use]
    pub fn new(airframe: Airframe, zones: Arc<NoFlyZones>, least_m: f64) -> Self {
        let near = NoFlyZones::new(Vec::new());
        let air = Air::calm(airframe.cruise_mps);
        Self {
            airframe,
            zones,
            least_m,
            near,
            gathered_at: None,
            side: Side::Left,
            air,
        }
    }

    /// Keeps clear of these zones from now on.
    pub fn set_zones(&mut self, zones: Arc<NoFlyZones>) {
        self.zones = zones;
        self.gathered_at = None;
    }

    /// The airspeed nearest to `mps` that may be commanded, m/s.
    #[must_use]
    pub fn airspeed_mps(&self, mps: f64) -> f64 {
        let least = self
            .airframe
            .least_airspeed_mps()
            .min(self.airframe.max_mps);
        let wanted = if mps.is_finite() {
            mps
        } else {
            self.airframe.cruise_mps
        };
        wanted.max(least).min(self.airframe.max_mps)
    }

    /// The setpoint to fly instead of `wanted`, which is `wanted` where it is safe.
    pub fn check(&mut self, percept: &Percept, wanted: Setpoint) -> Setpoint {
        self.check_until(percept, wanted, HORIZON_S)
    }

    /// The same for a flight that ends in so many seconds: no more of it is looked at.
    pub fn check_until(&mut self, percept: &Percept, wanted: Setpoint, looks_s: f64) -> Setpoint {
        let looks_s = looks_s.clamp(0.0, HORIZON_S);
        let mut out = wanted;
        out.airspeed_mps = self.airspeed_mps(out.airspeed_mps);
        let drift = wind_of(percept);
        self.air = Air {
            wind: Wind::new(drift.x, drift.y),
            airspeed_mps: out.airspeed_mps,
        };
        let limit = self.airframe.max_turn_rate_radps(out.airspeed_mps);
        let finite = out.steps.iter().all(|s| s.turn_rate_radps.is_finite());
        out.steps.truncate(MAX_STEPS);
        for s in &mut out.steps {
            s.turn_rate_radps = s.turn_rate_radps.clamp(-limit, limit);
        }
        if !is_finite(&percept.pose) {
            out.loiter = self.side;
            out.steps = self.sharpest(limit);
            return out;
        }
        self.gather(percept.pose.position());
        if !self.near.zones().is_empty() {
            self.side = self.choose_side(&percept.pose);
        }
        out.loiter = self.side;
        if !finite || out.steps.is_empty() {
            out.steps = self.loiter_steps(&percept.pose, limit);
        } else if let Some(side) = self.way_out(percept, &out, looks_s) {
            self.side = side;
            out.loiter = side;
            out.steps = self.loiter_steps(&percept.pose, limit);
        }
        out
    }

    /// The side of a loiter that is clear of the zones now, where none will be any more once the
    /// commanded flight has gone on for as long as nobody may say anything else.
    fn last_way_out(&self, percept: &Percept, setpoint: &Setpoint) -> Option<Side> {
        let v = setpoint.airspeed_mps;
        let radius_m = self
            .circle_radius_m()
            .unwrap_or_else(|| self.airframe.turn_radius_m(v));
        let (pose, wind) = (&percept.pose, wind_of(percept));
        let is_clear = |pose: &Pose, side: Side, by_m: f64| {
            let middle = self.middle(pose, side, radius_m);
            self.near.distance_m(middle) >= radius_m + by_m
        };
        let then = fly(*pose, v, &setpoint.steps, FAILSAFE_MS);
        let then = drifted(then, wind * FAILSAFE_S);
        let sides = match self.side {
            Side::Left => [Side::Left, Side::Right],
            Side::Right => [Side::Right, Side::Left],
        };
        if sides.iter().any(|side| is_clear(&then, *side, CLEAR_M)) {
            return None;
        }
        let mut sides = sides.into_iter();
        sides.find(|side| is_clear(pose, *side, CLEAR_M / 2.0))
    }

    /// The middle of the loiter on a side that begins at a pose.
    fn middle(&self, pose: &Pose, side: Side, radius_m: f64) -> Point {
        let d = self.air.over_ground(*pose).direction();
        let out_m = match side {
            Side::Left => radius_m,
            Side::Right => -radius_m,
        };
        Point::new(pose.east_m - out_m * d.y, pose.north_m + out_m * d.x)
    }

    /// The loiter on the chosen side: the sharpest turn, in a wind the circle over the
    /// ground.
    fn loiter_steps(&self, pose: &Pose, limit_radps: f64) -> Vec<Steer> {
        let Some(radius_m) = self.circle_radius_m() else {
            return self.sharpest(limit_radps);
        };
        let track = Track::new(&self.circle(pose, self.side, radius_m));
        let on_it = Offset {
            cross_m: 0.0,
            heading_rad: 0.0,
        };
        air::steps(&track, on_it, &self.air, limit_radps)
    }

    /// Radius of a loiter that stands over the ground in the wind, metres; `None` in
    /// calm air, and where no loiter can stand.
    fn circle_radius_m(&self) -> Option<f64> {
        let (v, w) = (self.air.airspeed_mps, self.air.wind.speed_mps());
        let stands = !self.air.is_calm() && w < v;
        stands.then(|| self.airframe.ground_turn_radius_m(v, w))
    }

    /// The circle over the ground that begins at a pose with the nose's heading.
    fn circle(&self, pose: &Pose, side: Side, radius_m: f64) -> Curve {
        let bend = match side {
            Side::Left => 1.0 / radius_m,
            Side::Right => -1.0 / radius_m,
        };
        // Halves, because a whole circle ends where it begins.
        let half_m = 0.5 * TAU * radius_m;
        let start = self.air.over_ground(*pose);
        Curve::from_pieces(start, &[(bend, half_m), (bend, half_m)])
    }

    /// The sharpest turn on the chosen side.
    fn sharpest(&self, limit_radps: f64) -> Vec<Steer> {
        let turn_rate_radps = match self.side {
            Side::Left => limit_radps,
            Side::Right => -limit_radps,
        };
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small constant"
        )]
        let duration_ms = (HORIZON_S * 1000.0) as u32;
        vec![Steer {
            turn_rate_radps,
            duration_ms,
        }]
    }

    /// Gathers the zones that matter until the UAV has flown `GATHER_M`.
    fn gather(&mut self, at: Point) {
        if self.gathered_at.is_some_and(|p| (p - at).norm() < GATHER_M) {
            return;
        }
        let flight_m = self.airframe.max_mps * HORIZON_S;
        let radius_m = self.airframe.turn_radius_m(self.airframe.max_mps);
        let radius_m = radius_m.max(self.circle_radius_m().unwrap_or(0.0));
        let wind_mps = self.air.wind.speed_mps();
        let flight_m = flight_m + wind_mps * HORIZON_S;
        let loiter_m = (self.airframe.max_mps + wind_mps) * FAILSAFE_S + 2.0 * radius_m;
        let reach_m = GATHER_M + flight_m.max(loiter_m) + self.least_m.max(0.0);
        let near = self
            .zones
            .zones()
            .iter()
            .filter(|z| z.distance_m(at) < reach_m)
            .cloned()
            .collect();
        self.near = NoFlyZones::new(near);
        self.gathered_at = Some(at);
    }

    /// The side on which a loiter of the least radius, begun here or within
    /// [`FAILSAFE_S`] straight ahead, keeps farther from the zones nearby.
    fn choose_side(&self, pose: &Pose) -> Side {
        let (left, right) = (
            self.room_m(pose, Side::Left),
            self.room_m(pose, Side::Right),
        );
        match self.side {
            Side::Left if right > left + SIDE_MARGIN_M => Side::Right,
            Side::Right if left > right + SIDE_MARGIN_M => Side::Left,
            same => same,
        }
    }

    /// Distance of the failsafe loiter discs from the nearest zone, metres; may be
    /// negative, infinite without zones nearby.
    fn room_m(&self, pose: &Pose, side: Side) -> f64 {
        let circle_m = self.circle_radius_m();
        let radius_m = circle_m.unwrap_or(self.airframe.min_turn_radius_m());
        let d = self.air.over_ground(*pose).direction();
        let centre = self.middle(pose, side, radius_m);
        let fastest_mps = match circle_m {
            Some(_) => self.air.airspeed_mps + self.air.wind.speed_mps(),
            None => self.airframe.cruise_mps,
        };
        let ahead = centre + d * (fastest_mps * FAILSAFE_S);
        self.near
            .distance_m(centre)
            .min(self.near.distance_m(ahead))
            - radius_m
    }

    /// The side of the loiter that is flown instead of a commanded flight that comes too near to a
    /// zone: the chosen one, if that does not come as near; else the last that is clear.
    fn way_out(&self, percept: &Percept, setpoint: &Setpoint, looks_s: f64) -> Option<Side> {
        let (pose, wind) = (&percept.pose, wind_of(percept));
        if self.near.zones().is_empty() {
            return None;
        }
        let reach_m = (setpoint.airspeed_mps + wind.norm()) * HORIZON_S;
        if self.near.distance_m(pose.position()) - reach_m >= self.least_m {
            return None;
        }
        let commanded_m = self.flight_distance_m(pose, setpoint, wind, looks_s);
        if commanded_m >= self.least_m {
            return None;
        }
        let loiter_m = self.loiter_distance_m(pose, setpoint.airspeed_mps, wind);
        if loiter_m > commanded_m + 1e-6 {
            return Some(self.side);
        }
        self.last_way_out(percept, setpoint)
    }

    /// Distance of the commanded flight over some seconds from the nearest zone, metres.
    fn flight_distance_m(
        &self,
        pose: &Pose,
        setpoint: &Setpoint,
        wind: Vector,
        looks_s: f64,
    ) -> f64 {
        let v = setpoint.airspeed_mps;
        let mut start = *pose;
        let mut left_s = looks_s;
        let mut least = f64::INFINITY;
        for (i, s) in setpoint.steps.iter().enumerate() {
            let last = i + 1 == setpoint.steps.len();
            let t = if last {
                left_s
            } else {
                left_s.min(f64::from(s.duration_ms) / 1000.0)
            };
            let piece = Segment {
                start,
                curvature_per_m: s.turn_rate_radps / v,
                length_m: v * t,
            };
            least = least.min(self.drifting_m(&piece, v, wind));
            start = drifted(piece.end(), wind * t);
            left_s -= t;
        }
        least
    }

    /// Distance of the loiter on the chosen side from the nearest zone, metres.
    fn loiter_distance_m(&self, pose: &Pose, airspeed_mps: f64, wind: Vector) -> f64 {
        if let Some(radius_m) = self.circle_radius_m() {
            let circle = self.circle(pose, self.side, radius_m);
            let each = circle.segments().iter();
            return each
                .map(|s| self.near.segment_distance_m(s))
                .fold(f64::INFINITY, f64::min);
        }
        let radius_m = self.airframe.turn_radius_m(airspeed_mps);
        let curvature_per_m = match self.side {
            Side::Left => 1.0 / radius_m,
            Side::Right => -1.0 / radius_m,
        };
        // Halves, because a whole circle ends where it begins.
        let half = Segment {
            start: *pose,
            curvature_per_m,
            length_m: 0.5 * TAU * radius_m,
        };
        let other = Segment {
            start: drifted(half.end(), wind * (half.length_m / airspeed_mps)),
            ..half
        };
        self.drifting_m(&half, airspeed_mps, wind)
            .min(self.drifting_m(&other, airspeed_mps, wind))
    }

    /// Distance from the nearest zone of a piece flown through air that drifts, metres;
    /// a little less where the piece is a trochoid, which is measured by its chords.
    fn drifting_m(&self, piece: &Segment, airspeed_mps: f64, wind: Vector) -> f64 {
        if wind.norm_squared() <= 0.0 {
            return self.near.segment_distance_m(piece);
        }
        let lasts_s = piece.length_m / airspeed_mps;
        let chords = (lasts_s / CHORD_S).ceil().max(1.0);
        let each_s = lasts_s / chords;
        // A stretch of duration d strays at most a d²/8 from its chord.
        let stray_m =
            airspeed_mps * airspeed_mps * piece.curvature_per_m.abs() * each_s * each_s / 8.0;
        let at = |i: f64| {
            let pose = piece.pose_at(airspeed_mps * each_s * i);
            drifted(pose, wind * (each_s * i)).position()
        };
        let (mut least, mut i) = (f64::INFINITY, 0.0);
        while i < chords {
            let chord = Segment::straight(at(i), at(i + 1.0));
            least = least.min(self.near.segment_distance_m(&chord));
            i += 1.0;
        }
        least - stray_m
    }
}

/// The wind a percept tells, m/s; none if it is no number.
fn wind_of(percept: &Percept) -> Vector {
    let wind = Vector::new(percept.wind_east_mps, percept.wind_north_mps);
    if wind.norm().is_finite() {
        wind
    } else {
        Vector::zeros()
    }
}

fn drifted(pose: Pose, by: Vector) -> Pose {
    Pose::new(pose.position() + by, pose.heading_rad)
}

/// Whether a pose is made of numbers.
#[must_use]
pub fn is_finite(pose: &Pose) -> bool {
    pose.east_m.is_finite() && pose.north_m.is_finite() && pose.heading_rad.is_finite()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{airframe, percept_at, square};
    use skein_geometry::math::FRAC_PI_2;

    fn straight(airspeed_mps: f64) -> Setpoint {
        let steps = vec![Steer {
            turn_rate_radps: 0.0,
            duration_ms: 2500,
        }];
        Setpoint {
            from_ms: 0,
            airspeed_mps,
            height_m: 90.0,
            steps,
            loiter: Side::Left,
            gimbal: Vec::new(),
            launch: crate::setpoint::Launch::Stay,
            promised: None,
        }
    }

    fn envelope(zones: Vec<skein_geometry::Polygon>) -> Envelope {
        Envelope::new(airframe(), Arc::new(NoFlyZones::new(zones)), 8.0)
    }

    #[test]
    fn airspeed_and_bank_are_clamped() {
        let a = airframe();
        let mut e = envelope(vec![]);
        let p = percept_at(
            Pose {
                east_m: 0.0,
                north_m: 0.0,
                heading_rad: 0.0,
            },
            0,
        );
        for (asked, given) in [
            (1.0, a.least_airspeed_mps()),
            (99.0, a.max_mps),
            (13.0, 13.0),
            (f64::NAN, a.cruise_mps),
        ] {
            let mut s = straight(asked);
            s.steps = vec![
                Steer {
                    turn_rate_radps: -9.0,
                    duration_ms: 10
                };
                20
            ];
            let out = e.check(&p, s);
            assert!((out.airspeed_mps - given).abs() < 1e-12);
            assert_eq!(out.steps.len(), MAX_STEPS);
            let limit = a.max_turn_rate_radps(given);
            assert!(
                out.steps
                    .iter()
                    .all(|s| (s.turn_rate_radps + limit).abs() < 1e-12)
            );
        }
    }

    #[test]
    fn numbers_that_are_none_become_a_loiter() {
        let mut e = envelope(vec![]);
        let here = Pose {
            east_m: 0.0,
            north_m: 0.0,
            heading_rad: 0.0,
        };
        let mut bad = straight(13.0);
        bad.steps[0].turn_rate_radps = f64::NAN;
        let lost = Pose {
            east_m: f64::NAN,
            ..here
        };
        let mut none = straight(13.0);
        none.steps.clear();
        for (pose, s) in [(here, bad), (lost, straight(13.0)), (here, none)] {
            let out = e.check(&percept_at(pose, 0), s);
            let limit = airframe().max_turn_rate_radps(13.0);
            assert!(
                out.steps.len() == 1 && (out.steps[0].turn_rate_radps.abs() - limit).abs() < 1e-9
            );
        }
    }

    #[test]
    fn a_flight_into_a_zone_becomes_a_loiter_on_the_clear_side() {
        // The zone is ahead and to the left of a UAV that flies north.
        let mut e = envelope(vec![square(-60.0, 35.0, 70.0)]);
        let out = e.check(
            &percept_at(
                Pose {
                    east_m: 0.0,
                    north_m: 0.0,
                    heading_rad: FRAC_PI_2,
                },
                0,
            ),
            straight(13.0),
        );
        assert_eq!(out.loiter, Side::Right);
        assert!(out.steps[0].turn_rate_radps < 0.0);
        // Flying away from it the same UAV is left alone.
        let out = e.check(
            &percept_at(
                Pose {
                    east_m: 0.0,
                    north_m: 30.0,
                    heading_rad: -FRAC_PI_2,
                },
                0,
            ),
            straight(13.0),
        );
        assert!(out.steps[0].turn_rate_radps.abs() < 1e-12);
    }

    #[test]
    fn a_flight_out_of_the_clearance_is_not_held_back() {
        let mut e = envelope(vec![square(-70.0, -35.0, 68.0)]);
        let out = e.check(
            &percept_at(
                Pose {
                    east_m: 0.0,
                    north_m: 0.0,
                    heading_rad: 0.0,
                },
                0,
            ),
            straight(13.0),
        );
        assert!(out.steps[0].turn_rate_radps.abs() < 1e-12);
    }

    /// A gap between two zones becomes too narrow for a circle; the flight is nowhere nearer than
    /// the circles are, so the clearance alone lets it go on.
    #[test]
    fn nobody_flies_to_where_no_loiter_is_clear() {
        let wedge = |side: f64| {
            let corners = [(400.0, 15.0), (400.0, 200.0), (0.0, 200.0), (0.0, 65.0)];
            let corners = corners.map(|(x, y)| Point::new(x, side * y));
            skein_geometry::Polygon::new(corners.to_vec()).unwrap()
        };
        let zones = [wedge(1.0), wedge(-1.0)];
        let mut e = Envelope::new(airframe(), Arc::new(NoFlyZones::new(zones.to_vec())), 60.0);
        let mut pose = Pose::new(Point::new(-100.0, 0.0), 0.0);
        let (mut nearest_m, mut held) = (f64::INFINITY, 0);
        for i in 0..400 {
            let out = e.check(&percept_at(pose, i * 200), straight(13.0));
            held += u32::from(out.steps[0].turn_rate_radps.abs() > 0.1);
            pose = fly(pose, out.airspeed_mps, &out.steps, 200);
            let away_m = zones.iter().map(|z| z.distance_m(pose.position()));
            nearest_m = away_m.fold(nearest_m, f64::min);
        }
        assert!(held > 20 && nearest_m > CLEAR_M - 1.0, "{held} {nearest_m}");
    }

    #[test]
    fn in_a_wind_a_refused_flight_circles_over_one_place() {
        // Towards a zone in the north, with the wind.
        let zone = square(-200.0, 75.0, 400.0);
        let mut e = envelope(vec![zone.clone()]);
        let (wind, mut pose) = (
            Vector::new(0.5, 2.5),
            Pose::new(Point::new(0.0, 0.0), FRAC_PI_2),
        );
        let speed_mps = airframe().least_airspeed_mps();
        let (mut held, mut least_m, mut most_m) = (0, f64::INFINITY, 0.0f64);
        let mut at = pose.position();
        for i in 0..600 {
            let percept = Percept {
                wind_east_mps: wind.x,
                wind_north_mps: wind.y,
                wind_unknown: false,
                ..percept_at(pose, i * 200)
            };
            let out = e.check(&percept, straight(speed_mps));
            if out.steps[0].turn_rate_radps.abs() > 0.05 {
                held += 1;
                if held == 1 {
                    at = pose.position();
                }
                most_m = most_m.max((pose.position() - at).norm());
            } else if held > 0 {
                break;
            }
            pose = fly(pose, out.airspeed_mps, &out.steps, 200);
            pose = drifted(pose, wind * 0.2);
            least_m = least_m.min(zone.distance_m(pose.position()));
        }
        assert!(held > 10 && least_m > 7.0, "{held} {least_m}");
        assert!(most_m < 70.0, "{most_m}");
    }

    #[test]
    fn zones_far_away_come_into_view_while_flying() {
        let mut e = envelope(vec![square(400.0, -50.0, 100.0)]);
        let mut held = false;
        for i in 0..150 {
            let pose = Pose {
                east_m: 2.6 * f64::from(i),
                north_m: 0.0,
                heading_rad: 0.0,
            };
            let out = e.check(&percept_at(pose, 0), straight(13.0));
            held = out.steps[0].turn_rate_radps.abs() > 0.1;
            if held {
                assert!(pose.east_m > 340.0 && pose.east_m < 380.0);
                break;
            }
        }
        assert!(held);
    }
}
