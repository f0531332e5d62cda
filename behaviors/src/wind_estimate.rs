//! The wind as a UAV finds it out itself: from its airspeed, its heading and its way over the
//! ground, where nobody tells it.
//!
//! A UAV moves through the air along its nose: of its velocity over the ground less the wind,
//! `v - w`, the part along the heading is its airspeed, and there is none across. What the sensor
//! reads is that airspeed times a factor that stays and is near one. An extended Kalman filter of
//! three states, the wind and the factor, compares both with the way between two percepts; the
//! wind may change, which is a random walk. On one course the factor cannot be told from a wind
//! along it: there it stays what it was held to be, and turns make it known. (So do autopilots:
//! the ArduPilot project calibrates its airspeed sensors by the same three states.)
//!
//! The noise of an airspeed is one of what is compared, not of what it is compared with: taken
//! the other way round, the factor would sink on every straight flight.

use crate::Percept;
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};
use skein_flight::trajectory::wind::Wind;
use skein_geometry::frame::Pose;
use skein_geometry::math::{seconds, sin, sin_cos, wrap_pi};

/// How strong a wind may be before anything is known of it: its standard deviation along each
/// axis, m/s.
const WIND_MPS: f64 = 8.0;

/// How far the factor of the airspeed may be from one, as a standard deviation.
const FACTOR: f64 = 0.03;

/// By how much the wind is held to change in a second along each axis, (m/s)².
const WIND_WALK_M2PS3: f64 = 0.005;

/// By how much the factor is held to change in a second.
const FACTOR_WALK_PS: f64 = 1e-8;

/// The error of one airspeed, (m/s)².
const AIRSPEED_M2PS2: f64 = 0.16;

/// The error of one look across the heading, (m/s)²: turns that began between two percepts.
const ACROSS_M2PS2: f64 = 0.06;

/// What differs from what is expected by more than this many standard deviations, twice and
/// more, is another wind.
const SURPRISE: f64 = 4.0;

/// So many surprises one after the other begin the estimate anew.
const SURPRISES: u8 = 3;

/// Two percepts farther apart than this say nothing of each other, milliseconds.
const GAP_MS: u64 = 2_500;

/// The wind that is told follows the estimate when that has moved so far, m/s: each change of it
/// is planned for anew.
const TOLD_MPS: f64 = 0.25;

/// A percept, as far as it counts here.
#[derive(Clone, Copy, Debug)]
struct Look {
    time_ms: u64,
    pose: Pose,
    airspeed_mps: f64,
}

/// The wind by a UAV's own sensors. Feed it every percept.
#[derive(Clone, Debug)]
pub struct WindEstimate {
    /// Wind towards east and north, m/s, and the factor.
    state: Vector3<f64>,
    covariance: Matrix3<f64>,
    last: Option<Look>,
    surprises: u8,
    told: Wind,
}

impl Default for WindEstimate {
    fn default() -> Self {
        Self {
            state: Vector3::new(0.0, 0.0, 1.0),
            covariance: unknown(FACTOR * FACTOR),
            last: None,
            surprises: 0,
            told: Wind::CALM,
        }
    }
}

/// Of a wind of which nothing is known.
fn unknown(factor2: f64) -> Matrix3<f64> {
    let wind2 = WIND_MPS * WIND_MPS;
    Matrix3::from_diagonal(&Vector3::new(wind2, wind2, factor2))
}

impl WindEstimate {
    /// A percept with the wind in it: the one that it tells, or else the one that is estimated by
    /// it and those before. Calm until two percepts of the flight are there.
    #[must_use]
    pub fn complete(&mut self, percept: Percept) -> Percept {
        if !percept.wind_unknown {
            return percept;
        }
        self.look(&percept);
        Percept {
            wind_east_mps: self.told.east_mps,
            wind_north_mps: self.told.north_mps,
            ..percept
        }
    }

    /// The wind, and how far it may be wrong along each axis: one standard deviation, m/s.
    #[must_use]
    pub fn wind(&self) -> (Wind, f64) {
        let worst = self.covariance[(0, 0)].max(self.covariance[(1, 1)]);
        (Wind::new(self.state.x, self.state.y), worst.max(0.0).sqrt())
    }

    /// The airspeed that is read over the true one.
    #[must_use]
    pub fn factor(&self) -> f64 {
        self.state.z
    }

    fn look(&mut self, percept: &Percept) {
        let is_known = percept.airspeed_mps.is_finite() && percept.pose.heading_rad.is_finite();
        if percept.takes_off_in_ms > 0 || !is_known {
            self.last = None;
            return;
        }
        let now = Look {
            time_ms: percept.time_ms,
            pose: percept.pose,
            airspeed_mps: percept.airspeed_mps,
        };
        let before = self.last.filter(|b| b.time_ms < now.time_ms);
        self.last = Some(now);
        let Some(before) = before.filter(|b| now.time_ms - b.time_ms <= GAP_MS) else {
            return;
        };
        self.compare(&before, &now);
        let (wind, _) = self.wind();
        if (wind.velocity() - self.told.velocity()).norm() >= TOLD_MPS {
            self.told = wind;
        }
    }

    /// The way over the ground between two looks against the way through the air.
    fn compare(&mut self, before: &Look, now: &Look) {
        let dt_s = seconds(now.time_ms - before.time_ms);
        let way = now.pose.position() - before.pose.position();
        let ground = Vector2::new(way.x, way.y) / dt_s;
        // The chord of an even turn lies along its middle heading, and is shorter than its arc.
        let half_rad = wrap_pi(now.pose.heading_rad - before.pose.heading_rad) / 2.0;
        let shrink = if half_rad.abs() < 1e-6 {
            1.0
        } else {
            sin(half_rad) / half_rad
        };
        let (s, c) = sin_cos(before.pose.heading_rad + half_rad);
        let (nose, side) = (Vector2::new(c, s), Vector2::new(-s, c));

        let walk = Vector3::new(WIND_WALK_M2PS3, WIND_WALK_M2PS3, FACTOR_WALK_PS) * dt_s;
        self.covariance += Matrix3::from_diagonal(&walk);
        let factor = self.state.z;
        let through_air = ground - Vector2::new(self.state.x, self.state.y);
        let along_mps = nose.dot(&through_air);
        let off = Vector2::new(
            now.airspeed_mps * shrink - factor * along_mps,
            -side.dot(&through_air),
        );
        let seen = Matrix2x3::new(
            -factor * nose.x,
            -factor * nose.y,
            along_mps,
            -side.x,
            -side.y,
            0.0,
        );
        let errors = Matrix2::new(AIRSPEED_M2PS2, 0.0, 0.0, ACROSS_M2PS2);
        let spread = seen * self.covariance * seen.transpose() + errors;
        let Some(inverse) = spread.try_inverse() else {
            return;
        };
        if (off.transpose() * inverse * off).x > SURPRISE * SURPRISE {
            self.surprises += 1;
            if self.surprises < SURPRISES {
                return;
            }
            // Another wind; what is known of the sensor stays.
            self.covariance = unknown(self.covariance[(2, 2)]);
            self.surprises = 0;
            return self.compare(before, now);
        }
        self.surprises = 0;
        let gain = self.covariance * seen.transpose() * inverse;
        self.state += gain * off;
        let left = Matrix3::identity() - gain * seen;
        self.covariance =
            left * self.covariance * left.transpose() + gain * errors * gain.transpose();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::percept_at;
    use proptest::prelude::*;
    use skein_geometry::random::SplitMix64;

    /// Seconds between percepts.
    const DT_S: f64 = 0.2;

    /// A flight in a wind, by small steps; `turn` tells the turn rate at a time.
    struct Flight {
        pose: Pose,
        time_ms: u64,
        wind: Wind,
        factor: f64,
        noise_mps: f64,
        random: SplitMix64,
        estimate: WindEstimate,
    }

    impl Flight {
        fn new(wind: Wind, factor: f64, noise_mps: f64) -> Self {
            Self {
                pose: percept_at(
                    Pose::new(skein_geometry::frame::Point::new(0.0, 0.0), 0.3),
                    0,
                )
                .pose,
                time_ms: 0,
                wind,
                factor,
                noise_mps,
                random: SplitMix64::new(5),
                estimate: WindEstimate::default(),
            }
        }

        fn fly(&mut self, for_s: f64, turn_radps: f64) -> Percept {
            let percept = self.percept();
            let mut told = self.estimate.complete(percept);
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "small"
            )]
            let looks = (for_s / DT_S) as u32;
            for _ in 0..looks {
                for _ in 0..20 {
                    let dt_s = DT_S / 20.0;
                    let middle = self.pose.heading_rad + turn_radps * dt_s / 2.0;
                    let (s, c) = sin_cos(middle);
                    self.pose.east_m += (15.0 * c + self.wind.east_mps) * dt_s;
                    self.pose.north_m += (15.0 * s + self.wind.north_mps) * dt_s;
                    self.pose.heading_rad = wrap_pi(self.pose.heading_rad + turn_radps * dt_s);
                }
                self.time_ms += 200;
                let percept = self.percept();
                told = self.estimate.complete(percept);
            }
            told
        }

        fn percept(&mut self) -> Percept {
            Percept {
                airspeed_mps: 15.0 * self.factor + self.noise_mps * self.random.normal(),
                wind_unknown: true,
                ..percept_at(self.pose, self.time_ms)
            }
        }

        fn off_mps(&self, told: &Percept) -> f64 {
            let wind = Wind::new(told.wind_east_mps, told.wind_north_mps);
            (wind.velocity() - self.wind.velocity()).norm()
        }
    }

    #[test]
    fn what_is_told_is_believed() {
        let mut estimate = WindEstimate::default();
        let p = Percept {
            wind_east_mps: 3.0,
            ..percept_at(
                Pose::new(skein_geometry::frame::Point::new(0.0, 0.0), 0.3),
                0,
            )
        };
        assert_eq!(estimate.complete(p), p);
    }

    #[test]
    fn before_the_take_off_it_is_calm() {
        let mut f = Flight::new(Wind::new(5.0, 0.0), 1.0, 0.0);
        let waiting = |time_ms| Percept {
            takes_off_in_ms: 5_000,
            wind_unknown: true,
            ..percept_at(f.pose, time_ms)
        };
        for t in 0..20 {
            assert!(f.estimate.complete(waiting(200 * t)).wind_east_mps.abs() < 1e-12);
        }
        let told = f.fly(2.0, 0.0);
        assert!(f.off_mps(&told) < 0.3, "{told:?}");
    }

    #[test]
    fn another_wind_is_known_within_seconds_and_a_gap_says_nothing() {
        let mut f = Flight::new(Wind::new(-3.0, 2.0), 1.0, 0.3);
        f.fly(40.0, 0.1);
        f.wind = Wind::new(4.0, -5.0);
        let told = f.fly(4.0, 0.0);
        assert!(f.off_mps(&told) < 0.7, "{} m/s", f.off_mps(&told));
        // Where it was ten seconds ago is no way that it flew.
        f.time_ms += 10_000;
        f.pose.east_m += 900.0;
        let told = f.fly(0.2, 0.0);
        assert!(f.off_mps(&told) < 0.7, "{} m/s", f.off_mps(&told));
    }

    proptest! {
        /// However wrong its airspeed is within what it expects: after a turn the wind is known
        /// to half a metre a second, and the factor to one in a hundred.
        #[test]
        fn turns_tell_the_wind_from_a_wrong_airspeed(
            east in -9.0..9.0f64, north in -9.0..9.0f64, factor in 0.95..1.05f64, left in any::<bool>(),
        ) {
            let mut f = Flight::new(Wind::new(east, north), factor, 0.3);
            let straight = f.fly(10.0, 0.0);
            // On one course they cannot be told apart, but a wrong wind is as small as that.
            prop_assert!(f.off_mps(&straight) < 15.0 * 0.055 + 0.4);
            let turn_radps = if left { 0.25 } else { -0.25 };
            f.fly(30.0, turn_radps);
            let told = f.fly(5.0, 0.0);
            prop_assert!(f.off_mps(&told) < 0.5, "{} m/s", f.off_mps(&told));
            prop_assert!((f.estimate.factor() - factor).abs() < 0.01, "{}", f.estimate.factor());
            // On a long straight flight what is known of it stays known.
            let told = f.fly(120.0, 0.0);
            prop_assert!(f.off_mps(&told) < 0.6, "{} m/s", f.off_mps(&told));
            prop_assert!((f.estimate.factor() - factor).abs() < 0.02, "{}", f.estimate.factor());
        }
    }
}
