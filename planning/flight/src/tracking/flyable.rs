//! What of following a target can be flown (D2.7 §3.7): nothing is clipped without a word.
//!
//! A circle of radius r about a target that drifts through the air with d takes the turn
//! rate λ²/(r V cos δ), most where the UAV moves against the drift: (V + d)²/(r V). A
//! target that accelerates by a takes up to a/√(V² − d²) besides. So with the turn rate
//! g tan φ / V of the steepest bank
//!
//! r ≥ (V + d)² / (g tan φ − a V/√(V² − d²)).

use crate::airframe::{Airframe, GRAVITY_MPS2};
use skein_geometry::math::tan;

/// The fastest turn at an airspeed that neither the airframe nor the stall forbids, rad/s.
#[must_use]
pub fn turn_rate_radps(airframe: &Airframe, airspeed_mps: f64) -> f64 {
    let bank_rad = airframe.steepest_bank_rad(airspeed_mps);
    GRAVITY_MPS2 * tan(bank_rad) / airspeed_mps
}

/// The least radius of a circle about a target, metres, at an airspeed, for a target that
/// moves through the air at `drift_mps` and accelerates by `acceleration_mps2` at most.
///
/// `None` where there is no such circle: the target is as fast as the UAV, or accelerates
/// harder than the UAV turns.
#[must_use]
pub fn least_radius_m(
    airframe: &Airframe,
    airspeed_mps: f64,
    drift_mps: f64,
    acceleration_mps2: f64,
) -> Option<f64> {
    let across = airspeed_mps * airspeed_mps - drift_mps * drift_mps;
    if across.is_nan() || across <= 0.0 {
        return None;
    }
    let most_mps2 = turn_rate_radps(airframe, airspeed_mps) * airspeed_mps;
    let left_mps2 = most_mps2 - acceleration_mps2 * airspeed_mps / across.sqrt();
    let fastest_mps = airspeed_mps + drift_mps;
    (left_mps2 > 0.0).then(|| fastest_mps * fastest_mps / left_mps2)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::tracking::field::{Field, Turn};
    use crate::tracking::orbit::{Drift, Orbit};
    use proptest::prelude::*;
    use skein_geometry::frame::Vector;
    use skein_geometry::math::sin_cos;

    /// The fixed wing of the published comparisons: 20 m/s and 30° of bank.
    pub(crate) fn airframe() -> Airframe {
        Airframe {
            stall_mps: 12.0,
            cruise_mps: 20.0,
            max_mps: 26.0,
            max_bank_rad: 30.0_f64.to_radians(),
            endurance_s: 3_600.0,
            reserve_s: 300.0,
            footprint_across_m: 40.0,
            footprint_along_m: 30.0,
            mount: crate::mount::Mount::Level,
            climb_mps: crate::airframe::CLIMB_MPS,
        }
    }

    #[test]
    fn a_still_target_takes_the_turn_radius_and_a_fast_one_has_no_circle() {
        let a = airframe();
        let still = least_radius_m(&a, 20.0, 0.0, 0.0).unwrap();
        assert!((still - a.min_turn_radius_m()).abs() < 1e-9);
        // r = R (1 + d/V)².
        let half = least_radius_m(&a, 20.0, 10.0, 0.0).unwrap();
        assert!((half - 2.25 * still).abs() < 1e-9);
        assert_eq!(least_radius_m(&a, 20.0, 20.0, 0.0), None);
        assert_eq!(least_radius_m(&a, 20.0, 5.0, 6.0), None);
        assert_eq!(least_radius_m(&a, 20.0, f64::NAN, 0.0), None);
    }

    proptest! {
        /// On a circle of the least radius no place takes a faster turn, and without
        /// acceleration one takes just it.
        #[test]
        fn the_least_radius_is_what_the_law_takes(
            d in 0.0..17.0_f64, a in 0.0..2.0_f64, way in -3.1..3.1_f64, left in any::<bool>(),
        ) {
            let frame = airframe();
            let Some(r) = least_radius_m(&frame, 20.0, d, a) else { return Ok(()); };
            let turn = if left { Turn::Left } else { Turn::Right };
            let orbit = Orbit { field: Field::HOPF, radius_m: r, turn };
            let most = turn_rate_radps(&frame, 20.0);
            let (s, c) = sin_cos(way);
            let mut fastest = 0.0_f64;
            for k in 0..720 {
                let (ks, kc) = sin_cos(f64::from(k).to_radians() / 2.0);
                let drift = Drift {
                    velocity_mps: Vector::new(d, 0.0),
                    acceleration_mps2: Vector::new(c, s) * a,
                };
                let at = Vector::new(kc, ks) * r;
                let nose = orbit.nose(at, 20.0, &drift, at).unwrap();
                fastest = fastest.max(nose.rate_radps.abs());
            }
            prop_assert!(fastest <= most + 1e-9, "{fastest} {most}");
            if a < 1e-3 {
                prop_assert!(fastest >= 0.999 * most);
            }
        }
    }
}
