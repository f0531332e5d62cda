//! Curves over the ground flown in a wind (D2.7 §2.4.2, reactive layer).
//!
//! Every curve of a mission lies over the ground, where zones and cells are. In a
//! wind the nose crabs so that the course follows the curve, and the ground speed
//! varies with the course. [`Air`] says with which wind and airspeed; times come from
//! [`Trajectory`], and so do the headings that [`steps`] leads the nose through.
//!
//! # Guarantees
//! In calm air everything here is what [`Track`] does by itself, to the bit.

use super::follow::{CORRECTION_S, HORIZON_S, Offset, Steps, Track, correction};
use crate::setpoint::Steer;
use skein_flight::airframe::{Airframe, PowerModel};
use skein_flight::trajectory::Trajectory;
use skein_flight::trajectory::timed::Objective;
use skein_flight::trajectory::wind::{Course, Heading, Wind};
use skein_geometry::Curve;
use skein_geometry::frame::Pose;
use skein_geometry::math::{TAU, cos, wrap_pi};

/// Winds below this are left to the feedback, m/s: a percent of any airspeed.
const CALM_MPS: f64 = 0.1;

/// A turn over the ground is flown as steps of constant rate no longer than this,
/// seconds: between their ends the heading is off by a thousandth of a radian.
const ARC_STEP_S: f64 = 0.4;

/// Airspeeds compared for the thriftiest: neighbours differ by a tenth of a m/s or two,
/// and near its least value an energy changes with the square of that.
const AIRSPEEDS: u8 = 40;

/// Courses over which its energy is averaged.
const COURSES: u8 = 16;

/// The wind that a UAV flies in, and its airspeed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    /// The wind.
    pub wind: Wind,
    /// Airspeed, m/s.
    pub airspeed_mps: f64,
}

impl Air {
    /// Still air.
    #[must_use]
    pub fn calm(airspeed_mps: f64) -> Self {
        Self {
            wind: Wind::CALM,
            airspeed_mps,
        }
    }

    /// The same airspeed in another wind.
    #[must_use]
    pub fn with(self, wind: Wind) -> Self {
        Self { wind, ..self }
    }

    /// Whether there is no wind worth a thought.
    #[must_use]
    pub fn is_calm(&self) -> bool {
        self.wind.speed_mps() < CALM_MPS
    }

    /// The airspeed at which an airframe can follow turns of `radius_m` over the
    /// ground in this wind, at most its cruise, m/s.
    #[must_use]
    pub fn airspeed_for_turns_mps(airframe: &Airframe, wind: Wind, radius_m: f64) -> f64 {
        if wind.speed_mps() < CALM_MPS {
            return airframe.cruise_mps;
        }
        airframe.airspeed_for_turns_mps(radius_m, wind.speed_mps())
    }

    /// The airspeed for an objective, m/s: for energy the one that spends least on a
    /// metre over the ground, averaged over all courses, and no more than turns allow;
    /// else as fast as they allow.
    #[must_use]
    pub fn airspeed_for_mps(
        objective: Objective,
        airframe: &Airframe,
        wind: Wind,
        radius_m: f64,
    ) -> f64 {
        let most_mps = Self::airspeed_for_turns_mps(airframe, wind, radius_m);
        let least_mps = airframe.least_airspeed_mps();
        if objective != Objective::Energy || least_mps >= most_mps {
            return most_mps;
        }
        let model = PowerModel::of(airframe);
        let each_metre = |airspeed_mps: f64| {
            let over = |i: u8| {
                let course = Course(TAU * f64::from(i) / f64::from(COURSES));
                let speed = wind.ground_speed_mps(course, airspeed_mps);
                let makes_way = speed.filter(|speed| *speed > 0.0);
                makes_way.map_or(f64::INFINITY, |speed| 1.0 / speed)
            };
            model.share(airspeed_mps, 0.0) * (0..COURSES).map(over).sum::<f64>()
        };
        let share =
            |i: u8| least_mps + (most_mps - least_mps) * f64::from(i) / f64::from(AIRSPEEDS);
        (0..=AIRSPEEDS)
            .map(|i| share(AIRSPEEDS - i))
            .map(|mps| (each_metre(mps), mps))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or(most_mps, |(_, mps)| mps)
    }

    /// The same place with the course instead of the heading.
    #[must_use]
    pub fn over_ground(&self, pose: Pose) -> Pose {
        if self.is_calm() {
            return pose;
        }
        let course = self
            .wind
            .course_of(Heading(pose.heading_rad), self.airspeed_mps);
        Pose {
            heading_rad: course.0,
            ..pose
        }
    }

    /// Distance through the air while a curve over the ground is flown, metres: its
    /// duration times the airspeed. Infinite where the wind forbids it.
    #[must_use]
    pub fn air_length_m(&self, curve: &Curve) -> f64 {
        if self.is_calm() {
            return curve.length_m();
        }
        Trajectory::along(curve, self.airspeed_mps, self.wind)
            .map_or(f64::INFINITY, |t| t.air_distance_m())
    }

    /// As [`Air::air_length_m`] for turns of so many metres that end as they began:
    /// the most that it can be.
    #[must_use]
    pub fn longest_m(&self, turns_m: f64) -> f64 {
        if self.is_calm() {
            return turns_m;
        }
        let slowest = self.airspeed_mps - self.wind.speed_mps();
        if slowest > 0.0 {
            turns_m * self.airspeed_mps / slowest
        } else {
            f64::INFINITY
        }
    }
}

/// The turns of the nose of the next [`HORIZON_S`] for a UAV whose place and course
/// are off the track by `offset` and that turns at most at `limit_radps`.
#[must_use]
pub fn steps(track: &Track, offset: Offset, air: &Air, limit_radps: f64) -> Vec<Steer> {
    let v = air.airspeed_mps;
    if air.is_calm() {
        return track.steps(offset, v, limit_radps);
    }
    let ahead = track.ahead((v + air.wind.speed_mps()) * HORIZON_S);
    let Ok(plan) = Trajectory::along(&ahead, v, air.wind) else {
        return track.steps(offset, v, limit_radps);
    };
    let Some(now) = plan.at(0.0) else {
        return Vec::new();
    };
    let ground_mps = now.ground_velocity.norm();
    // How much the nose turns for each radian that the course does.
    let (c, h) = (now.course.0, now.heading.0);
    let lead = ground_mps / (v * cos(c - h)).max(1.0);
    let (first, second) = correction(offset, ground_mps.max(1.0));
    let mut out = Steps::new(limit_radps);
    for p in plan.pieces() {
        let k = p.segment.curvature_per_m;
        let beside = (1.0 - k * offset.cross_m).max(0.5);
        let end_s = p.start_s + p.duration_s;
        let mut from_s = p.start_s;
        while from_s < end_s && from_s < HORIZON_S {
            let extra = match from_s {
                t if t < CORRECTION_S => (first, CORRECTION_S),
                t if t < 2.0 * CORRECTION_S => (second, 2.0 * CORRECTION_S),
                _ => (0.0, HORIZON_S),
            };
            let until_s = if k.abs() > 0.0 {
                end_s.min(extra.1).min(from_s + ARC_STEP_S)
            } else {
                end_s.min(extra.1)
            };
            let heading = |t_s: f64| p.state_after(t_s - p.start_s, air.wind).heading.0;
            let turned = wrap_pi(heading(until_s) - heading(from_s));
            let lasts_s = until_s - from_s;
            let rate = if k.abs() > 0.0 && lasts_s > 0.0 {
                turned / lasts_s
            } else {
                0.0
            };
            let early = from_s < 2.0 * CORRECTION_S;
            let rate = if early { rate / beside } else { rate };
            out.turn(rate + lead * extra.0, from_s, until_s);
            from_s = until_s;
        }
    }
    out.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reactive::follow::fly;
    use crate::testing::airframe;
    use proptest::prelude::*;
    use skein_geometry::frame::Point;
    use skein_geometry::math::{FRAC_PI_2, PI, sin};

    /// Lanes with quarter turns of 24 m, as on a loop.
    fn lanes(start: Pose) -> Curve {
        let q = 24.0 * FRAC_PI_2;
        let (l, r) = ((1.0 / 24.0, q), (-1.0 / 24.0, q));
        let round = [
            (0.0, 96.0),
            l,
            l,
            (0.0, 48.0),
            r,
            r,
            (0.0, 96.0),
            l,
            r,
            l,
            l,
        ];
        Curve::from_pieces(start, &[&round[..], &round[..]].concat())
    }

    /// Flies a curve by percepts every `period_ms`; returns the largest distance from
    /// it after the first 5 s, the last, and the time until its end, seconds.
    fn flown(wind: Wind, start: Pose, curve: &Curve, period_ms: u32) -> (f64, f64, f64) {
        let a = airframe();
        let air = Air {
            wind,
            airspeed_mps: Air::airspeed_for_turns_mps(&a, wind, 23.5),
        };
        let limit = a.max_turn_rate_radps(air.airspeed_mps);
        let (mut track, mut pose) = (Track::new(curve), start);
        let (mut worst_m, mut last_m, mut time_s) = (0.0f64, 0.0f64, 0.0);
        while track.left_m() > 1.0 {
            let offset = track.advance(&air.over_ground(pose), 20.0).unwrap();
            if time_s > 5.0 {
                worst_m = worst_m.max(offset.cross_m.abs());
            }
            last_m = offset.cross_m.abs();
            let turns = steps(&track, offset, &air, limit);
            pose = fly(pose, air.airspeed_mps, &turns, period_ms);
            let dt_s = f64::from(period_ms) / 1000.0;
            pose.east_m += wind.east_mps * dt_s;
            pose.north_m += wind.north_mps * dt_s;
            time_s += dt_s;
            assert!(time_s < 600.0, "no end");
        }
        (worst_m, last_m, time_s)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn a_loop_is_followed_in_any_wind_the_airframe_can_take(
            speed in 0.2f64..2.8, towards in 0.0f64..TAU, heading in -3.0f64..3.0,
            period_ms in prop::sample::select(vec![100u32, 200, 500]),
        ) {
            let wind = Wind::new(speed * cos(towards), speed * sin(towards));
            let start = Pose::new(Point::new(0.0, 0.0), heading);
            let curve = lanes(start);
            let (worst_m, last_m, time_s) = flown(wind, start, &curve, period_ms);
            // Half of the default tracking error even with percepts of half a second.
            let most_m = if period_ms > 200 { 1.0 } else { 0.5 };
            prop_assert!(worst_m < most_m && last_m < most_m, "{worst_m} {last_m}");
            // The forecast is what it took.
            let v = Air::airspeed_for_turns_mps(&airframe(), wind, 23.5);
            let air = Air { wind, airspeed_mps: v };
            let foretold_s = air.air_length_m(&curve) / v;
            prop_assert!((foretold_s - time_s).abs() < 1.0, "{foretold_s} {time_s}");
            prop_assert!(air.longest_m(curve.length_m()) >= air.air_length_m(&curve) - 1e-6);
        }
    }

    #[test]
    fn calm_air_changes_nothing() {
        let start = Pose::new(Point::new(3.0, 4.0), 0.7);
        let air = Air::calm(13.0);
        let track = Track::new(&lanes(start));
        let offset = Offset {
            cross_m: 0.7,
            heading_rad: -0.1,
        };
        assert_eq!(
            steps(&track, offset, &air, 0.5),
            track.steps(offset, 13.0, 0.5)
        );
        assert_eq!(air.over_ground(start), start);
        assert!((air.air_length_m(&lanes(start)) - lanes(start).length_m()).abs() < 1e-12);
    }

    #[test]
    fn an_offset_in_a_crosswind_is_taken_away() {
        let curve = Curve::from_pieces(Pose::new(Point::new(0.0, 0.0), 0.0), &[(0.0, 600.0)]);
        let wind = Wind::new(0.0, 2.5);
        let start = Pose::new(Point::new(0.0, 3.0), PI / 8.0);
        let (worst_m, last_m, _) = flown(wind, start, &curve, 200);
        assert!(worst_m < 0.3 && last_m < 0.01, "{worst_m} {last_m}");
    }

    #[test]
    fn the_thriftiest_airspeed_is_slower_than_a_fast_cruise_and_faster_in_a_wind() {
        let fast = Airframe {
            cruise_mps: 22.0,
            max_mps: 28.0,
            ..airframe()
        };
        let of = |objective, wind| Air::airspeed_for_mps(objective, &fast, wind, 200.0);
        let calm_mps = of(Objective::Energy, Wind::CALM);
        // Least energy on a metre is at the least power's airspeed times the fourth root of 3.
        assert!(
            (calm_mps - 1.25 * 9.0 * 3.0f64.sqrt().sqrt()).abs() < 0.3,
            "{calm_mps}"
        );
        let wind = Wind::new(4.0, -3.0);
        let windy_mps = of(Objective::Energy, wind);
        assert!(
            windy_mps > calm_mps + 0.5 && windy_mps < 22.0,
            "{windy_mps}"
        );
        for objective in [Objective::Time, Objective::Distance] {
            assert!((of(objective, Wind::CALM) - 22.0).abs() < 1e-12);
            assert!((of(objective, wind) - 22.0).abs() < 1e-12);
        }
    }
}
