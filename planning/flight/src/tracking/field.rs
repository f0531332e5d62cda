//! Vector fields that wind a UAV onto a circle round a centre (D2.7 §3.7.1).
//!
//! A field of this kind is round: its direction makes an angle with the way from the centre
//! that depends on the distance alone. So its curvature follows in closed form: along
//! a path that follows a field of angle χ(ρ) the direction turns by sin χ / ρ + χ′ cos χ a
//! metre.
//!
//! Two fields are here. Hopf's is that of D2.7, by Quigley, Goodrich and Beard ("Semi-autonomous
//! human-UAV interfaces for fixed-wing mini-UAVs", 2004), with the quadrant kept
//! (`atan2`), both senses of turning, and a heading in its centre, where the printed one is
//! zero. Lyapunov's is that of Lawrence, Frew and Pisano ("Lyapunov vector fields for
//! autonomous unmanned aircraft flight control", 2008), with which it is compared.

use serde::{Deserialize, Serialize};
use skein_geometry::frame::Vector;
use skein_geometry::math::{atan2, sin_cos};

/// Nearer to the centre than this the way from it has no direction of its own, metres.
const CENTRE_M: f64 = 1e-6;

/// The sense of an orbit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Turn {
    /// Counter-clockwise.
    Left,
    /// Clockwise, as D2.7 prints it.
    Right,
}

impl Turn {
    /// 1 to the left, −1 to the right.
    #[must_use]
    pub fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }
}

/// A field round a centre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Field {
    /// Hopf's. The gain is D2.7's α: the larger, the longer the approach.
    Hopf {
        /// α, of no dimension, positive.
        gain: f64,
    },
    /// Lyapunov's.
    Lyapunov,
}

/// A field in one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flow {
    /// Its direction, of length 1.
    pub along: Vector,
    /// How fast its direction turns along it, radians a metre, positive to the left.
    pub curvature_per_m: f64,
}

impl Field {
    /// Hopf's field with a gain of 1: outside of its circle it bends nowhere harder than
    /// the circle itself.
    pub const HOPF: Self = Self::Hopf { gain: 1.0 };

    /// The field at a place `from_centre`. In the very centre it leads away from it, towards
    /// `towards` (any direction, of length 1).
    #[must_use]
    pub fn at(self, from_centre: Vector, radius_m: f64, turn: Turn, towards: Vector) -> Flow {
        let distance_m = from_centre.norm();
        if distance_m < CENTRE_M {
            return Flow {
                along: towards,
                curvature_per_m: 0.0,
            };
        }
        let (angle_rad, angle_per_m) = self.angle(distance_m, radius_m);
        let (sine, cosine) = sin_cos(angle_rad);
        let s = turn.sign();
        let out = from_centre / distance_m;
        let round = Vector::new(-out.y, out.x) * s;
        Flow {
            along: out * cosine + round * sine,
            curvature_per_m: s * (sine / distance_m + angle_per_m * cosine),
        }
    }

    /// The angle between the way from the centre and the field, radians from 0 to π for an
    /// orbit to the left, and its derivative by the distance, radians a metre.
    fn angle(self, distance_m: f64, radius_m: f64) -> (f64, f64) {
        match self {
            // ρ̇ = ρ (r² − ρ²) / (α r²) and θ̇ = 1.
            Self::Hopf { gain } => {
                let scale = gain * radius_m * radius_m;
                let outward = (radius_m * radius_m - distance_m * distance_m) / scale;
                let slope_per_m = 2.0 * distance_m / (scale * (1.0 + outward * outward));
                (atan2(1.0, outward), slope_per_m)
            }
            // Outward (r² − ρ²) / (r² + ρ²), round 2 r ρ / (r² + ρ²).
            Self::Lyapunov => {
                let square = radius_m * radius_m + distance_m * distance_m;
                (2.0 * atan2(distance_m, radius_m), 2.0 * radius_m / square)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use skein_geometry::math::wrap_pi;

    const EAST: Vector = Vector::new(1.0, 0.0);

    fn any_field() -> impl Strategy<Value = Field> {
        prop_oneof![
            Just(Field::Lyapunov),
            (0.3..4.0).prop_map(|gain| Field::Hopf { gain }),
        ]
    }

    fn any_turn() -> impl Strategy<Value = Turn> {
        prop_oneof![Just(Turn::Left), Just(Turn::Right)]
    }

    #[test]
    fn hopf_is_what_d27_prints_for_orbits_to_the_right() {
        let (r, gain) = (100.0, 0.7);
        for (x, y) in [(30.0, 40.0), (-150.0, 20.0), (0.0, -100.0), (5.0, -260.0)] {
            let inward = (r * r - x * x - y * y) / (gain * r * r);
            let printed = Vector::new(y + x * inward, -x + y * inward).normalize();
            let flow = Field::Hopf { gain }.at(Vector::new(x, y), r, Turn::Right, EAST);
            assert!((flow.along - printed).norm() < 1e-12, "{x} {y}");
        }
    }

    #[test]
    fn lyapunov_is_what_lawrence_and_frew_print() {
        let r = 80.0;
        for (x, y) in [(30.0, 40.0), (-150.0, 20.0), (0.0, -80.0)] {
            let rho2: f64 = x * x + y * y;
            let scale = -1.0 / (rho2.sqrt() * (rho2 + r * r));
            let twice = 2.0 * rho2.sqrt() * r;
            let printed = Vector::new(
                x * (rho2 - r * r) + y * twice,
                y * (rho2 - r * r) - x * twice,
            ) * scale;
            let flow = Field::Lyapunov.at(Vector::new(x, y), r, Turn::Left, EAST);
            assert!((flow.along - printed).norm() < 1e-12, "{x} {y}");
        }
    }

    #[test]
    fn in_the_centre_it_leads_away() {
        for field in [Field::HOPF, Field::Lyapunov] {
            let flow = field.at(Vector::zeros(), 50.0, Turn::Left, EAST);
            assert_eq!(flow.along, EAST);
        }
    }

    proptest! {
        #[test]
        fn curvature_is_how_the_direction_turns(
            field in any_field(), turn in any_turn(),
            x in -400.0..400.0_f64, y in -400.0..400.0_f64, r in 20.0..300.0_f64,
        ) {
            let at = Vector::new(x, y);
            prop_assume!(at.norm() > 5.0);
            let flow = field.at(at, r, turn, EAST);
            let h = 1e-4;
            let angle = |p: Vector| {
                let a = field.at(p, r, turn, EAST).along;
                atan2(a.y, a.x)
            };
            let turned = wrap_pi(angle(at + flow.along * h) - angle(at - flow.along * h));
            let measured = turned / (2.0 * h);
            prop_assert!((measured - flow.curvature_per_m).abs() < 1e-6, "{measured} {flow:?}");
            prop_assert!((flow.along.norm() - 1.0).abs() < 1e-12);
        }

        /// Both fields lead towards the circle from everywhere, and along it on it.
        #[test]
        fn distance_to_the_circle_shrinks(
            field in any_field(), turn in any_turn(),
            x in -900.0..900.0_f64, y in -900.0..900.0_f64, r in 20.0..300.0_f64,
        ) {
            let at = Vector::new(x, y);
            prop_assume!(at.norm() > 1e-3);
            let flow = field.at(at, r, turn, EAST);
            let outward = flow.along.dot(&at) / at.norm();
            prop_assert!(outward * (r - at.norm()) >= -1e-12);
            let on = at * (r / at.norm());
            let round = field.at(on, r, turn, EAST);
            prop_assert!(round.along.dot(&on).abs() < 1e-9 * r);
            let sense = (on.x * round.along.y - on.y * round.along.x) * turn.sign();
            prop_assert!((sense - r).abs() < 1e-9 * r);
        }

        #[test]
        fn turned_places_have_turned_fields(
            field in any_field(), turn in any_turn(),
            x in -300.0..300.0_f64, y in -300.0..300.0_f64, by in -3.0..3.0_f64,
        ) {
            let (s, c) = sin_cos(by);
            let spun = |v: Vector| Vector::new(c * v.x - s * v.y, s * v.x + c * v.y);
            let at = Vector::new(x, y);
            prop_assume!(at.norm() > 1.0);
            let (a, b) = (field.at(at, 90.0, turn, EAST), field.at(spun(at), 90.0, turn, EAST));
            prop_assert!((spun(a.along) - b.along).norm() < 1e-9);
            prop_assert!((a.curvature_per_m - b.curvature_per_m).abs() < 1e-9);
        }

        #[test]
        fn outside_of_its_circle_hopf_bends_no_harder_than_it(
            distance in 1.0..50.0_f64, turn in any_turn(),
        ) {
            let r = 100.0;
            let flow = Field::HOPF.at(Vector::new(distance * r, 0.0), r, turn, EAST);
            prop_assert!(flow.curvature_per_m.abs() * r <= 1.0 + 1e-12);
        }
    }
}
