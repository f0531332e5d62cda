//! Flights in a wind that is the same everywhere: how long a piece takes, and how tight its
//! turns are through the air.
//!
//! Written from the triangle of velocities: what the wind has across a course the nose leans
//! against, and the rest of the airspeed and what the wind has along it make the speed over
//! the ground.

use crate::path::Piece;
use core::f64::consts::{PI, TAU};
use libm::{ceil, cos, hypot, sin, sqrt};

/// How far a course turns between two looks at the ground speed, radians.
const LOOK_RAD: f64 = 0.02;

/// The air of a flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Air {
    /// Speed through the air, m/s.
    pub airspeed_mps: f64,
    /// Where the wind blows to, m/s east and north; slower than the UAV.
    pub wind_mps: (f64, f64),
}

/// The two parts of the velocity along a course, m/s: what is left of the airspeed, and what
/// the wind adds.
struct Along {
    own_mps: f64,
    wind_mps: f64,
}

impl Air {
    fn along(&self, course_rad: f64) -> Along {
        let (east, north) = self.wind_mps;
        let (s, c) = (sin(course_rad), cos(course_rad));
        let across = north * c - east * s;
        Along {
            own_mps: sqrt(self.airspeed_mps * self.airspeed_mps - across * across),
            wind_mps: east * c + north * s,
        }
    }

    fn ground_speed_mps(&self, course_rad: f64) -> f64 {
        let along = self.along(course_rad);
        along.own_mps + along.wind_mps
    }

    /// Whether every course can be flown.
    #[must_use]
    pub fn flyable(&self) -> bool {
        hypot(self.wind_mps.0, self.wind_mps.1) < self.airspeed_mps
    }

    /// How long the first metres of a piece take, seconds; `None` where the wind is as fast
    /// as the UAV.
    #[must_use]
    pub fn time_s(&self, piece: &Piece, length_m: f64) -> Option<f64> {
        if !self.flyable() {
            return None;
        }
        let turn_rad = piece.radius_m.map_or(0.0, |r| -length_m / r);
        // Simpson's rule over the slowness.
        let halves = 2.0 * ceil(turn_rad.abs() / LOOK_RAD).max(1.0);
        let slowness = |i: f64| {
            let course = piece.heading_rad + turn_rad * i / halves;
            let weight = match i {
                i if i <= 0.0 || i >= halves => 1.0,
                i if i % 2.0 > 0.5 => 4.0,
                _ => 2.0,
            };
            weight / self.ground_speed_mps(course)
        };
        let sum: f64 = (0..=halves as u32).map(|i| slowness(f64::from(i))).sum();
        Some(length_m * sum / (3.0 * halves))
    }

    /// The tightest radius of an arc through the air, metres: where its course is nearest to
    /// that of the wind. `None` for lines.
    #[must_use]
    pub fn radius_m(&self, piece: &Piece) -> Option<f64> {
        let radius_m = piece.radius_m?.abs();
        let off = |course_rad: f64| {
            let wind_rad = libm::atan2(self.wind_mps.1, self.wind_mps.0);
            (course_rad - wind_rad + PI).rem_euclid(TAU) - PI
        };
        let (begins, turned) = (off(piece.heading_rad), piece.turned_rad());
        let ends = begins + turned;
        let passes = turned.abs() >= TAU
            || [-TAU, 0.0, TAU]
                .iter()
                .any(|w| (begins - w) * (ends - w) <= 0.0);
        let nearest = if passes {
            0.0
        } else {
            begins.abs().min(off(piece.end_heading_rad()).abs())
        };
        let wind = hypot(self.wind_mps.0, self.wind_mps.1);
        let across = wind * sin(nearest);
        let own = sqrt(self.airspeed_mps * self.airspeed_mps - across * across);
        let ground = own + wind * cos(nearest);
        Some(radius_m * self.airspeed_mps * own / (ground * ground))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plane::Point;

    fn arc(heading_rad: f64, length_m: f64, radius_m: Option<f64>) -> Piece {
        Piece {
            start: Point::new(0.0, 0.0),
            heading_rad,
            length_m,
            radius_m,
            sees: false,
        }
    }

    const AIR: Air = Air {
        airspeed_mps: 20.0,
        wind_mps: (12.0, 0.0),
    };

    #[test]
    fn lines_take_what_the_triangle_of_velocities_says() {
        for (heading_rad, mps) in [(0.0, 32.0), (PI, 8.0), (PI / 2.0, 16.0)] {
            let time_s = AIR.time_s(&arc(heading_rad, 160.0, None), 160.0).unwrap();
            assert!((time_s - 160.0 / mps).abs() < 1e-9, "{time_s}");
        }
        let storm = Air {
            wind_mps: (0.0, 20.0),
            ..AIR
        };
        assert_eq!(storm.time_s(&arc(0.0, 1.0, None), 1.0), None);
    }

    /// Small steps through the air: the nose turns, the wind carries.
    #[test]
    fn arcs_take_as_long_as_small_steps_and_turn_as_tightly() {
        for (heading_rad, turn, radius_m) in [
            (0.3, 2.0, 90.0),
            (2.0, 4.5, -80.0),
            (-3.0, 1.0, 100.0),
            (1.0, 8.0, -120.0),
        ] {
            let piece = arc(heading_rad, turn * f64::abs(radius_m), Some(radius_m));
            let n = 200_000;
            let step_m = piece.length_m / f64::from(n);
            let nose = |course: f64| {
                let across = AIR.wind_mps.1 * cos(course) - AIR.wind_mps.0 * sin(course);
                course - libm::asin(across / AIR.airspeed_mps)
            };
            let (mut time_s, mut tightest_m) = (0.0, f64::INFINITY);
            for i in 0..n {
                let course = |share: f64| heading_rad - (f64::from(i) + share) * step_m / radius_m;
                let along = course(0.5);
                let speed =
                    AIR.wind_mps.0 * cos(along) + AIR.airspeed_mps * cos(nose(along) - along);
                time_s += step_m / speed;
                let turned = (nose(course(1.0)) - nose(course(0.0))).abs();
                tightest_m = f64::min(tightest_m, AIR.airspeed_mps * step_m / speed / turned);
            }
            let told_s = AIR.time_s(&piece, piece.length_m).unwrap();
            assert!((told_s - time_s).abs() < 1e-4 * time_s, "{told_s} {time_s}");
            let told_m = AIR.radius_m(&piece).unwrap();
            assert!(
                (told_m - tightest_m).abs() < 1e-3 * told_m,
                "{told_m} {tightest_m}"
            );
        }
    }
}
