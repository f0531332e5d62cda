//! Position and velocity of a target from detections (D2.7 §3.7.1: "the estimated position of
//! the target").
//!
//! A Kalman filter over position and velocity. The target may accelerate as it likes:
//! acceleration is white noise of a density that the caller names. A detection is a place on
//! the ground with a covariance, in which the errors of the observer's own pose stand too.
//!
//! An observer's error of place hardly changes from look to look (satellite navigation drifts
//! over minutes), so no number of looks averages it out. The filter therefore estimates the
//! target *as its observer sees it*, displaced by that error, and [`Estimate::told`] adds the
//! error once, when the estimate is told to others. Bar-Shalom, Li and Kirubarajan,
//! "Estimation with applications to tracking and navigation", 2001, §6.2 (model), §5.4
//! (consistency).

use nalgebra::{Matrix2, Matrix2x4, Matrix4, Vector4};
use serde::{Deserialize, Serialize};
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::sin_cos;

/// What a target's speed may be before anything is known of it: one standard deviation, m/s.
const SPEED_MPS: f64 = 12.0;

/// Steps of prediction are at most this long, milliseconds: a gap of hours is as bad.
const LONGEST_MS: u64 = 600_000;

/// A place at which a target was seen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Detection {
    /// Metres east and north of the origin.
    pub at: Point,
    /// Covariance of its error, m².
    pub covariance_m2: Matrix2<f64>,
}

/// Standard deviations of one look.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SightErrors {
    /// Of the line of sight, camera and attitude together, radians.
    pub angle_rad: f64,
    /// Of the observer's place from one look to the next, metres.
    pub place_m: f64,
}

/// Standard deviations of a range finder and of where it looks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RangeErrors {
    /// Of the range, metres.
    pub range_m: f64,
    /// Of the bearing from the nose and of the heading together, radians.
    pub bearing_rad: f64,
    /// Of the observer's place from one look to the next, metres.
    pub place_m: f64,
}

impl Detection {
    /// A place on the ground in the picture of a camera `height_m` above it: an error of angle
    /// grows with the range, and lengthwise once more with the slant.
    #[must_use]
    pub fn from_sight(observer: Point, height_m: f64, at: Point, errors: &SightErrors) -> Self {
        let out = at - observer;
        let slant2 = out.norm_squared() + height_m * height_m;
        let across_m = errors.angle_rad * slant2.sqrt();
        let along_m = errors.angle_rad * slant2 / height_m.max(1.0);
        Self {
            at,
            covariance_m2: spread(out, along_m, across_m, errors.place_m),
        }
    }

    /// A range over the ground and a bearing from the nose, radians counter-clockwise.
    #[must_use]
    pub fn from_range(
        observer: &Pose,
        range_m: f64,
        bearing_rad: f64,
        errors: &RangeErrors,
    ) -> Self {
        let (s, c) = sin_cos(observer.heading_rad + bearing_rad);
        let out = Vector::new(c, s) * range_m;
        let across_m = errors.bearing_rad * range_m;
        Self {
            at: observer.position() + out,
            covariance_m2: spread(out, errors.range_m, across_m, errors.place_m),
        }
    }
}

/// Covariance of errors along and across a direction and of one that is alike all round.
fn spread(out: Vector, along_m: f64, across_m: f64, round_m: f64) -> Matrix2<f64> {
    let length_m = out.norm();
    let u = if length_m > 0.0 {
        out / length_m
    } else {
        Vector::new(1.0, 0.0)
    };
    let lengthwise = u * u.transpose();
    let crosswise = Matrix2::identity() - lengthwise;
    lengthwise * (along_m * along_m)
        + crosswise * (across_m * across_m)
        + Matrix2::identity() * (round_m * round_m)
}

/// What is known of a target at a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// When, milliseconds.
    pub time_ms: u64,
    /// Metres east and north, m/s east and north.
    pub state: Vector4<f64>,
    /// Covariance of its error, in the same units.
    pub covariance: Matrix4<f64>,
}

impl Estimate {
    /// From one detection: it stands there, or does not.
    #[must_use]
    pub fn first(time_ms: u64, detection: &Detection) -> Self {
        let mut covariance = Matrix4::zeros();
        covariance
            .fixed_view_mut::<2, 2>(0, 0)
            .copy_from(&detection.covariance_m2);
        covariance[(2, 2)] = SPEED_MPS * SPEED_MPS;
        covariance[(3, 3)] = SPEED_MPS * SPEED_MPS;
        Self {
            time_ms,
            state: Vector4::new(detection.at.x, detection.at.y, 0.0, 0.0),
            covariance,
        }
    }

    /// Where it is.
    #[must_use]
    pub fn position(&self) -> Point {
        Point::new(self.state[0], self.state[1])
    }

    /// Its velocity over the ground, m/s.
    #[must_use]
    pub fn velocity_mps(&self) -> Vector {
        Vector::new(self.state[2], self.state[3])
    }

    /// The standard deviation of its place in the worst direction, metres.
    #[must_use]
    pub fn spread_m(&self) -> f64 {
        let p = self.covariance.fixed_view::<2, 2>(0, 0);
        let half = f64::midpoint(p[(0, 0)], p[(1, 1)]);
        let skew = (p[(0, 0)] - p[(1, 1)]) / 2.0;
        (half + (skew * skew + p[(0, 1)] * p[(0, 1)]).sqrt()).sqrt()
    }

    /// The same at a later time, if the target accelerates by white noise of a density of
    /// `density_m2ps3`, m²/s³; an earlier time changes nothing.
    #[must_use]
    pub fn at(&self, time_ms: u64, density_m2ps3: f64) -> Self {
        let step_ms = time_ms.saturating_sub(self.time_ms).min(LONGEST_MS);
        #[allow(clippy::cast_precision_loss, reason = "ten minutes at most")]
        let t = step_ms as f64 / 1e3;
        let mut f = Matrix4::identity();
        f[(0, 2)] = t;
        f[(1, 3)] = t;
        Self {
            time_ms: self.time_ms.max(time_ms),
            state: f * self.state,
            covariance: f * self.covariance * f.transpose() + wander(t) * density_m2ps3,
        }
    }

    /// How unlikely a detection is, a square in standard deviations (chi-square of two);
    /// infinite for one that is no number.
    #[must_use]
    pub fn surprise(&self, detection: &Detection) -> f64 {
        let off = detection.at - self.position();
        let spread = self.covariance.fixed_view::<2, 2>(0, 0) + detection.covariance_m2;
        let square = spread.try_inverse().map(|i| (off.transpose() * i * off)[0]);
        square.filter(|d| *d >= 0.0).unwrap_or(f64::INFINITY)
    }

    /// With a detection of the same time; `None` for one that is no number.
    #[must_use]
    pub fn with(&self, detection: &Detection) -> Option<Self> {
        let h = Matrix2x4::identity();
        let off = detection.at - self.position();
        let spread = h * self.covariance * h.transpose() + detection.covariance_m2;
        let gain = self.covariance * h.transpose() * spread.try_inverse()?;
        // Joseph's form: it stays symmetric and positive whatever is rounded.
        let rest = Matrix4::identity() - gain * h;
        let next = Self {
            time_ms: self.time_ms,
            state: self.state + gain * off,
            covariance: rest * self.covariance * rest.transpose()
                + gain * detection.covariance_m2 * gain.transpose(),
        };
        next.is_sound().then_some(next)
    }

    /// As it is told to others by an observer whose own place is off by `place_m`, a standard
    /// deviation in metres, for long.
    #[must_use]
    pub fn told(&self, place_m: f64) -> Self {
        let mut told = *self;
        told.covariance[(0, 0)] += place_m * place_m;
        told.covariance[(1, 1)] += place_m * place_m;
        told
    }

    /// The square of the error in standard deviations (NEES): four in the mean of one that
    /// knows its errors. Infinite where the covariance is none.
    #[must_use]
    pub fn normalised_error(&self, position: Point, velocity_mps: Vector) -> f64 {
        let truth = Vector4::new(position.x, position.y, velocity_mps.x, velocity_mps.y);
        let off = self.state - truth;
        let inverse = self.covariance.try_inverse();
        inverse.map_or(f64::INFINITY, |i| (off.transpose() * i * off)[0])
    }

    /// Whether all of it is numbers and its variances are positive: what a radio brings
    /// may be neither.
    #[must_use]
    pub fn is_sound(&self) -> bool {
        let finite = self.state.iter().chain(self.covariance.iter());
        finite.into_iter().all(|x| x.is_finite()) && self.covariance.cholesky().is_some()
    }
}

/// What white noise of density 1 m²/s³ in the acceleration adds in `t` seconds.
fn wander(t: f64) -> Matrix4<f64> {
    let (place, both, speed) = (t * t * t / 3.0, t * t / 2.0, t);
    Matrix4::new(
        place, 0.0, both, 0.0, //
        0.0, place, 0.0, both, //
        both, 0.0, speed, 0.0, //
        0.0, both, 0.0, speed,
    )
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use proptest::prelude::*;
    use skein_geometry::random::SplitMix64;

    pub(crate) const DENSITY: f64 = 0.8;

    /// A target that moves as the model says.
    pub(crate) fn wandered(state: Vector4<f64>, t: f64, random: &mut SplitMix64) -> Vector4<f64> {
        let root = (wander(t) * DENSITY).cholesky().unwrap().l();
        let noise = Vector4::from_fn(|_, _| random.normal());
        let mut f = Matrix4::identity();
        f[(0, 2)] = t;
        f[(1, 3)] = t;
        f * state + root * noise
    }

    pub(crate) fn seen(at: Point, covariance: Matrix2<f64>, random: &mut SplitMix64) -> Detection {
        let root = covariance.cholesky().unwrap().l();
        let noise = Vector::new(random.normal(), random.normal());
        Detection {
            at: at + root * noise,
            covariance_m2: covariance,
        }
    }

    /// Mean NEES after some looks, over runs, of an observer displaced by a bias.
    fn mean_nees(runs: u32, bias_m: f64, told_m: f64) -> f64 {
        let mut sum = 0.0;
        for run in 0..runs {
            let mut random = SplitMix64::new(u64::from(run) + 77);
            let n = |r: &mut SplitMix64, s: f64| s * r.normal();
            let mut truth = Vector4::new(
                n(&mut random, 50.0),
                n(&mut random, 50.0),
                n(&mut random, SPEED_MPS),
                n(&mut random, SPEED_MPS),
            );
            let bias = Vector::new(n(&mut random, bias_m), n(&mut random, bias_m));
            let errors = SightErrors {
                angle_rad: 0.02,
                place_m: 1.0,
            };
            let mut estimate: Option<Estimate> = None;
            for k in 0..40_u64 {
                let at = Point::new(truth[0], truth[1]);
                let from = Point::new(100.0, -20.0) + Vector::new(n(&mut random, 60.0), 0.0);
                let d = Detection::from_sight(from, 120.0, at, &errors);
                let mut d = seen(at, d.covariance_m2, &mut random);
                d.at += bias;
                estimate = match estimate {
                    None => Some(Estimate::first(k * 500, &d)),
                    Some(e) => e.at(k * 500, DENSITY).with(&d),
                };
                if k < 39 {
                    truth = wandered(truth, 0.5, &mut random);
                }
            }
            let told = estimate.unwrap().told(told_m);
            let (p, v) = (
                Point::new(truth[0], truth[1]),
                Vector::new(truth[2], truth[3]),
            );
            sum += told.normalised_error(p, v);
        }
        sum / f64::from(runs)
    }

    #[test]
    fn errors_are_as_large_as_is_said() {
        // The sum of 600 draws of chi-square(4) is nearly normal: mean 4, and its mean's
        // standard deviation √(8/600) = 0.115; 99.9 % lie within 3.3 of them.
        for bias_m in [0.0, 4.0] {
            let nees = mean_nees(600, bias_m, bias_m);
            assert!((nees - 4.0).abs() < 3.3 * 0.1155, "bias {bias_m}: {nees}");
        }
        // An observer that forgets its own error is not consistent.
        assert!(mean_nees(100, 4.0, 0.0) > 8.0);
    }

    #[test]
    fn a_look_from_afar_is_long_and_a_range_is_round() {
        let errors = SightErrors {
            angle_rad: 0.01,
            place_m: 0.0,
        };
        let d = Detection::from_sight(Point::new(0.0, 0.0), 100.0, Point::new(300.0, 0.0), &errors);
        assert!((d.covariance_m2[(0, 0)].sqrt() - 10.0).abs() < 1e-9);
        assert!((d.covariance_m2[(1, 1)].sqrt() - 3.162).abs() < 1e-3);
        let range = RangeErrors {
            range_m: 5.0,
            bearing_rad: 0.05,
            place_m: 0.0,
        };
        let pose = Pose::new(Point::new(10.0, 0.0), 1.0);
        let d = Detection::from_range(&pose, 100.0, std::f64::consts::FRAC_PI_2 - 1.0, &range);
        assert!((d.at - Point::new(10.0, 100.0)).norm() < 1e-9);
        assert!((d.covariance_m2 - Matrix2::identity() * 25.0).norm() < 1e-9);
    }

    #[test]
    fn what_is_no_number_changes_nothing() {
        let good = Detection {
            at: Point::new(1.0, 2.0),
            covariance_m2: Matrix2::identity(),
        };
        let e = Estimate::first(0, &good);
        assert!(e.is_sound());
        let nowhere = Detection {
            at: Point::new(f64::NAN, 0.0),
            ..good
        };
        let sure = Detection {
            covariance_m2: Matrix2::identity() * -50.0,
            ..good
        };
        assert_eq!(e.with(&nowhere), None);
        assert_eq!(e.with(&sure).filter(|e| !e.is_sound()), None);
        assert!(e.surprise(&nowhere).is_infinite());
    }

    proptest! {
        /// One step of a second and ten of a tenth are the same; what is known shrinks with
        /// looks and grows without.
        #[test]
        fn prediction_does_not_depend_on_its_steps(vx in -20.0..20.0_f64, q in 0.1..4.0_f64) {
            let d = Detection { at: Point::new(3.0, -2.0), covariance_m2: Matrix2::identity() * 9.0 };
            let mut e = Estimate::first(0, &d);
            e.state[2] = vx;
            let once = e.at(1_000, q);
            let often = (1..=10).fold(e, |e, k| e.at(k * 100, q));
            prop_assert!((once.state - often.state).norm() < 1e-9);
            prop_assert!((once.covariance - often.covariance).norm() < 1e-9);
            prop_assert!(once.spread_m() > e.spread_m());
            prop_assert!(once.with(&d).unwrap().spread_m() < 3.0);
            prop_assert_eq!(e.at(0, q), e);
        }
    }
}
