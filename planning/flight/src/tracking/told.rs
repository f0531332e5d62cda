//! Estimates in few numbers, as they are told by radio (D2.7 §3.7): place, velocity, and a
//! covariance that is alike in all directions.
//!
//! # Guarantees
//! The covariance that is told bounds the one that is known: what it leaves out of directions is
//! added to both variances. With a the variance of place, b that of velocity, both the largest
//! in any direction, C the cross block and c the half of its trace, [[a + nr, c], [c, b + n/r]]
//! less the known one is positive for n = ‖C − cI‖ and any r > 0; r = √(a/b) adds alike.

use super::estimate::{Detection, Estimate};
use nalgebra::{Matrix2, Matrix4, Vector4};
use skein_geometry::frame::{Point, Vector};

/// Variances and covariance of place and velocity, alike in all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Of place, m².
    pub place_m2: f64,
    /// Of place and velocity, m²/s.
    pub both: f64,
    /// Of velocity, m²/s².
    pub speed: f64,
}

impl Estimate {
    /// Of a target at a time, milliseconds, with a spread alike in all directions.
    #[must_use]
    pub fn round(time_ms: u64, at: Point, velocity_mps: Vector, spread: Spread) -> Self {
        let (p, b, s) = (spread.place_m2, spread.both, spread.speed);
        Self {
            time_ms,
            state: Vector4::new(at.x, at.y, velocity_mps.x, velocity_mps.y),
            covariance: Matrix4::new(
                p, 0.0, b, 0.0, //
                0.0, p, 0.0, b, //
                b, 0.0, s, 0.0, //
                0.0, b, 0.0, s,
            ),
        }
    }

    /// A spread alike in all directions that bounds its covariance.
    #[must_use]
    pub fn spread(&self) -> Spread {
        let p = &self.covariance;
        let worst = |i: usize| largest(p[(i, i)], p[(i + 1, i + 1)], p[(i, i + 1)]);
        let both = f64::midpoint(p[(0, 2)], p[(1, 3)]);
        let off = [p[(0, 2)] - both, p[(1, 3)] - both, p[(0, 3)], p[(1, 2)]];
        let left_out = off.iter().map(|x| x * x).sum::<f64>().sqrt();
        let (place, speed) = (worst(0).max(1e-9), worst(2).max(1e-9));
        let ratio = (place / speed).sqrt();
        Spread {
            place_m2: place + left_out * ratio,
            both,
            speed: speed + left_out / ratio,
        }
    }
}

/// The largest variance in any direction, of those along two axes and what they have in common.
fn largest(a: f64, b: f64, both: f64) -> f64 {
    let (half, skew) = (f64::midpoint(a, b), (a - b) / 2.0);
    half + (skew * skew + both * both).sqrt()
}

impl Detection {
    /// A place with the same error in all directions, a standard deviation in metres.
    #[must_use]
    pub fn round(at: Point, spread_m: f64) -> Self {
        Self {
            at,
            covariance_m2: Matrix2::identity() * (spread_m * spread_m),
        }
    }

    /// The largest error in any direction, a standard deviation in metres.
    #[must_use]
    pub fn spread_m(&self) -> f64 {
        let p = &self.covariance_m2;
        largest(p[(0, 0)], p[(1, 1)], p[(0, 1)]).max(0.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_told_bounds_what_is_known(
            looks in prop::collection::vec((-200.0..200.0_f64, -200.0..200.0_f64, 20.0..150.0_f64), 1..9),
            density in 0.1..9.0_f64,
        ) {
            let errors = super::super::estimate::SightErrors { angle_rad: 0.02, place_m: 0.5 };
            let look = |(x, y, h): (f64, f64, f64)| {
                Detection::from_sight(Point::new(x, y), h, Point::new(0.0, 0.0), &errors)
            };
            let mut e = Estimate::first(0, &look(looks[0]));
            for (k, l) in looks.iter().enumerate().skip(1) {
                e = e.at(200 * k as u64, density).with(&look(*l)).unwrap();
            }
            e = e.at(9_000, density);
            let told = Estimate::round(e.time_ms, e.position(), e.velocity_mps(), e.spread());
            prop_assert!(told.is_sound());
            let slack = told.covariance - e.covariance + Matrix4::identity() * 1e-9;
            prop_assert!(slack.cholesky().is_some(), "{slack}");
        }
    }
}
