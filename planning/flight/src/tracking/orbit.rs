//! Headings along a field that a moving target carries with it, in a wind (D2.7 §3.7.1).
//!
//! As D2.7 prints it the law takes the target for a place and the air for still: its error
//! grows with the speed of either. Here the UAV's motion *relative to the target* follows
//! the field f: with d = v_target − wind, the drift of the target through the air, an
//! airspeed V and λ = −f·d + √((f·d)² − d² + V²), the velocity through the air λ f + d has
//! the length V and moves the UAV along f in the target's frame. It exists where the
//! target is slower through the air than the UAV.
//!
//! The turn rate that this takes is fed forward too, so that a controller has no error to
//! live on: with κ the field's curvature, n its left normal, a the acceleration of the
//! target, and V cos δ = λ + f·d,
//!
//! ψ̇ = (κ λ² + a·n) / (V cos δ).

use super::field::{Field, Turn};
use serde::{Deserialize, Serialize};
use skein_geometry::frame::Vector;
use skein_geometry::math::atan2;

/// The cosine of the largest angle between field and nose: beyond it the turn rate is
/// without bound, and the target all but outruns the UAV.
const LEAST_COSINE: f64 = 0.05;

/// A circle about a target.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Orbit {
    /// Which field leads to it.
    pub field: Field,
    /// Its radius, metres.
    pub radius_m: f64,
    /// Its sense.
    pub turn: Turn,
}

/// What a target does, seen from the air mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// The target's velocity less the wind's, m/s.
    pub velocity_mps: Vector,
    /// The target's acceleration, m/s².
    pub acceleration_mps2: Vector,
}

/// Where the nose should point, and how fast that turns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nose {
    /// The heading, radians counter-clockwise from east.
    pub heading_rad: f64,
    /// How fast it turns, rad/s, positive to the left.
    pub rate_radps: f64,
}

impl Orbit {
    /// The heading at a place `from_target` at an airspeed; `None` if the target is as fast
    /// through the air as the UAV or nearly, so that the field cannot be followed.
    #[must_use]
    pub fn nose(
        &self,
        from_target: Vector,
        airspeed_mps: f64,
        drift: &Drift,
        towards: Vector,
    ) -> Option<Nose> {
        let flow = self
            .field
            .at(from_target, self.radius_m, self.turn, towards);
        carried(flow.along, flow.curvature_per_m, airspeed_mps, drift)
    }
}

/// The heading with which a UAV moves along `along` relative to a target that drifts.
///
/// `None` if the target is as fast through the air as the UAV or nearly.
#[must_use]
pub fn carried(
    along: Vector,
    curvature_per_m: f64,
    airspeed_mps: f64,
    drift: &Drift,
) -> Option<Nose> {
    let d = drift.velocity_mps;
    let with = along.dot(&d);
    let square = with * with - d.norm_squared() + airspeed_mps * airspeed_mps;
    // A drift as fast as the UAV has no root, or one that moves it backwards.
    if square.is_nan() || square <= 0.0 || d.norm_squared() >= airspeed_mps * airspeed_mps {
        return None;
    }
    let ahead_mps = square.sqrt();
    if ahead_mps < LEAST_COSINE * airspeed_mps {
        return None;
    }
    let relative_mps = ahead_mps - with;
    let through_air = along * relative_mps + d;
    let normal = Vector::new(-along.y, along.x);
    let asked =
        curvature_per_m * relative_mps * relative_mps + drift.acceleration_mps2.dot(&normal);
    Some(Nose {
        heading_rad: atan2(through_air.y, through_air.x),
        rate_radps: asked / ahead_mps,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use skein_geometry::math::{sin_cos, wrap_pi};

    const EAST: Vector = Vector::new(1.0, 0.0);
    const V: f64 = 20.0;

    fn steady(x: f64, y: f64) -> Drift {
        Drift {
            velocity_mps: Vector::new(x, y),
            acceleration_mps2: Vector::zeros(),
        }
    }

    proptest! {
        /// The motion relative to the target is along the field, at just this airspeed.
        #[test]
        fn the_uav_moves_along_the_field_in_the_frame_of_the_target(
            x in -400.0..400.0_f64, y in -400.0..400.0_f64,
            dx in -13.0..13.0_f64, dy in -13.0..13.0_f64, left in any::<bool>(),
        ) {
            let turn = if left { Turn::Left } else { Turn::Right };
            let orbit = Orbit { field: Field::HOPF, radius_m: 150.0, turn };
            let at = Vector::new(x, y);
            prop_assume!(at.norm() > 1.0);
            let nose = orbit.nose(at, V, &steady(dx, dy), EAST).unwrap();
            let (s, c) = sin_cos(nose.heading_rad);
            let relative = Vector::new(c, s) * V - Vector::new(dx, dy);
            let flow = Field::HOPF.at(at, 150.0, turn, EAST).along;
            let across = flow.x * relative.y - flow.y * relative.x;
            prop_assert!(across.abs() < 1e-9 && relative.dot(&flow) > 0.0);
        }

        /// The rate that is told is the derivative of the heading along what is flown.
        #[test]
        fn the_rate_is_the_derivative_of_the_heading(
            x in -400.0..400.0_f64, y in -400.0..400.0_f64,
            dx in -12.0..12.0_f64, dy in -12.0..12.0_f64,
            ax in -2.0..2.0_f64, ay in -2.0..2.0_f64,
        ) {
            let orbit = Orbit { field: Field::HOPF, radius_m: 150.0, turn: Turn::Left };
            let at = Vector::new(x, y);
            prop_assume!(at.norm() > 20.0);
            let (d, a) = (Vector::new(dx, dy), Vector::new(ax, ay));
            let drift = |t: f64| Drift { velocity_mps: d + a * t, acceleration_mps2: a };
            let nose = orbit.nose(at, V, &drift(0.0), EAST).unwrap();
            let (s, c) = sin_cos(nose.heading_rad);
            let relative = Vector::new(c, s) * V - d;
            let h = 1e-4;
            let later = orbit.nose(at + relative * h, V, &drift(h), EAST).unwrap();
            let before = orbit.nose(at - relative * h, V, &drift(-h), EAST).unwrap();
            let measured = wrap_pi(later.heading_rad - before.heading_rad) / (2.0 * h);
            prop_assert!((measured - nose.rate_radps).abs() < 1e-5, "{measured} {nose:?}");
        }

        /// Who watches from a frame that moves sees the same headings (Galilei).
        #[test]
        fn only_the_difference_of_target_and_wind_counts(
            tx in -9.0..9.0_f64, ty in -9.0..9.0_f64, wx in -5.0..5.0_f64, by in -30.0..30.0_f64,
        ) {
            let orbit = Orbit { field: Field::HOPF, radius_m: 150.0, turn: Turn::Right };
            let at = Vector::new(60.0, -90.0);
            let a = orbit.nose(at, V, &steady(tx - wx, ty), EAST);
            let b = orbit.nose(at, V, &steady((tx + by) - (wx + by), ty), EAST);
            let (a, b) = (a.unwrap(), b.unwrap());
            prop_assert!(wrap_pi(a.heading_rad - b.heading_rad).abs() < 1e-9);
        }

        #[test]
        fn whatever_the_drift_there_is_an_answer_or_none(
            dx in -60.0..60.0_f64, dy in -60.0..60.0_f64, x in -1.0..1.0_f64,
        ) {
            let orbit = Orbit { field: Field::HOPF, radius_m: 150.0, turn: Turn::Left };
            let speed = Vector::new(dx, dy).norm();
            match orbit.nose(Vector::new(x, 0.0), V, &steady(dx, dy), EAST) {
                Some(n) => prop_assert!(n.heading_rad.is_finite() && n.rate_radps.is_finite() && speed < V),
                None => prop_assert!(speed > 0.9 * V),
            }
        }
    }

    #[test]
    fn numbers_that_are_none_give_no_heading() {
        let orbit = Orbit {
            field: Field::HOPF,
            radius_m: 150.0,
            turn: Turn::Left,
        };
        assert_eq!(orbit.nose(EAST, V, &steady(f64::NAN, 0.0), EAST), None);
        assert_eq!(orbit.nose(EAST, V, &steady(V, 0.0), EAST), None);
    }
}
