//! Properties of the fastest flight in wind.

use super::*;
use crate::trajectory::dubins;
use proptest::prelude::*;
use skein_geometry::math::{PI, TAU, cos, sin};

const UAV: Performance = Performance {
    airspeed_mps: 20.0,
    turn_radius_m: 50.0,
};

fn pose(east_m: f64, north_m: f64, heading_rad: f64) -> Pose {
    Pose {
        east_m,
        north_m,
        heading_rad,
    }
}

fn wind(share: f64, towards: f64) -> Wind {
    let speed = share * UAV.airspeed_mps;
    Wind::new(speed * cos(towards), speed * sin(towards))
}

fn solve(from: Pose, to: Pose, wind: Wind) -> Option<WindPath> {
    time_optimal(from, to, UAV, wind).unwrap().path()
}

/// Flies turn rates for their durations with the classical Runge-Kutta method.
fn integrate(path: &WindPath) -> Pose {
    let mut at = [
        path.start.east_m,
        path.start.north_m,
        path.start.heading_rad,
    ];
    let speed = path.performance.airspeed_mps;
    for (rate, lasts_s) in path.turn_rates_radps().into_iter().zip(path.durations_s) {
        let velocity = |s: [f64; 3]| {
            let v = path.wind.ground_velocity(Heading(s[2]), speed);
            [v.x, v.y, rate]
        };
        let steps = (lasts_s / 0.005).ceil().max(1.0);
        let h = lasts_s / steps;
        let go = |s: [f64; 3], d: [f64; 3], h: f64| [0, 1, 2].map(|i| s[i] + h * d[i]);
        let mut i = 0.0;
        while i < steps {
            let a = velocity(at);
            let b = velocity(go(at, a, h / 2.0));
            let c = velocity(go(at, b, h / 2.0));
            let d = velocity(go(at, c, h));
            let mean = [0, 1, 2].map(|i| (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]) / 6.0);
            at = go(at, mean, h);
            i += 1.0;
        }
    }
    pose(at[0], at[1], at[2])
}

fn off(a: Pose, b: Pose) -> f64 {
    let turned = wrap_pi(a.heading_rad - b.heading_rad).abs();
    (a.position() - b.position()).norm() / UAV.turn_radius_m + turned
}

#[test]
fn degenerate_goals() {
    let at = pose(10.0, -20.0, 1.25);
    for w in [Wind::CALM, wind(0.5, 2.0), wind(1.0, 0.3), wind(1.7, 4.0)] {
        let path = solve(at, at, w).unwrap();
        assert!(path.time_s() < 1e-9, "already there: {path:?}");
    }
    // With and against the wind, straight ahead.
    let ahead = pose(10.0 + 400.0 * cos(1.25), -20.0 + 400.0 * sin(1.25), 1.25);
    assert!((solve(at, ahead, wind(0.5, 1.25)).unwrap().time_s() - 400.0 / 30.0).abs() < 1e-9);
    assert!((solve(at, ahead, wind(0.5, 1.25 + PI)).unwrap().time_s() - 40.0).abs() < 1e-9);
    // Downwind of the start at wind speed: a full circle in the air drifts there.
    let circle_s = TAU / UAV.turn_rate_radps();
    let w = wind(0.4, -1.0);
    let there = pose(
        10.0 + w.east_mps * circle_s,
        -20.0 + w.north_mps * circle_s,
        1.25,
    );
    let path = solve(at, there, w).unwrap();
    assert!(path.time_s() <= circle_s + 1e-9 && off(path.end(), there) < 1e-9);
}

#[test]
fn nonsense_is_refused() {
    let at = pose(0.0, 0.0, 0.0);
    let nan = pose(f64::NAN, 0.0, 0.0);
    assert_eq!(
        time_optimal(at, nan, UAV, Wind::CALM),
        Err(WindError::NotFinite)
    );
    assert_eq!(
        time_optimal(at, at, UAV, Wind::new(f64::INFINITY, 0.0)),
        Err(WindError::NotFinite)
    );
    for airspeed_mps in [0.0, -3.0, f64::NAN, f64::INFINITY] {
        let uav = Performance {
            airspeed_mps,
            ..UAV
        };
        assert_eq!(
            time_optimal(at, at, uav, Wind::CALM),
            Err(WindError::NotPositive)
        );
    }
}

#[test]
fn a_wind_as_fast_as_the_uav_can_forbid_a_goal() {
    let at = pose(0.0, 0.0, 0.0);
    let upwind = pose(-300.0, 0.0, 0.0);
    for share in [1.0, 1.2] {
        assert_eq!(
            time_optimal(at, upwind, UAV, wind(share, 0.0)),
            Ok(Answer::Unreachable)
        );
        let downwind = pose(600.0, 30.0, 0.5);
        let path = solve(at, downwind, wind(share, 0.0)).unwrap();
        assert!(off(path.end(), downwind) < 1e-9);
    }
}

#[test]
fn heading_and_course_differ_by_the_drift() {
    let w = Wind::new(0.0, 10.0);
    let heading = w.heading_for_course(Course(0.0), 20.0).unwrap();
    assert!((heading.0 + PI / 6.0).abs() < 1e-12, "nose into the wind");
    assert!(w.course_of(heading, 20.0).0.abs() < 1e-12);
    let speed = w.ground_speed_mps(Course(0.0), 20.0).unwrap();
    assert!((speed - 20.0 * cos(PI / 6.0)).abs() < 1e-12);
    assert!(
        w.heading_for_course(Course(0.0), 9.0).is_none(),
        "crosswind too strong"
    );
    assert!(
        w.heading_for_course(Course(-PI / 2.0), 9.0).is_none(),
        "no way against it"
    );
    assert!(w.heading_for_course(Course(PI / 2.0), 9.0).is_some());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn the_controls_integrate_to_the_goal(
        x in -400.0f64..400.0, y in -400.0f64..400.0, a in -4.0f64..4.0, b in -4.0f64..4.0,
        share in 0.0f64..0.95, towards in 0.0f64..TAU,
    ) {
        let (from, to, w) = (pose(7.0, -3.0, a), pose(x, y, b), wind(share, towards));
        let path = solve(from, to, w).unwrap();
        prop_assert!(off(integrate(&path), to) < 1e-9, "{path:?}");
        prop_assert!(off(path.end(), to) < 1e-10);
        prop_assert!(path.durations_s.iter().all(|d| *d >= 0.0));
        let quick = time_s(from, to, UAV, w).unwrap();
        prop_assert!((quick - path.time_s()).abs() < 1e-9 * (1.0 + quick));
        // Not faster than flying there straight with the wind behind.
        let straight = (to.position() - from.position()).norm();
        prop_assert!(path.time_s() * (UAV.airspeed_mps + w.speed_mps()) >= straight - 1e-6);
    }

    #[test]
    fn without_wind_it_is_the_dubins_curve(
        x in -400.0f64..400.0, y in -400.0f64..400.0, a in -4.0f64..4.0, b in -4.0f64..4.0,
    ) {
        let (from, to) = (pose(7.0, -3.0, a), pose(x, y, b));
        let curve_s = dubins::length_m(from, to, UAV.turn_radius_m) / UAV.airspeed_mps;
        for share in [0.0, 1e-12, 1e-9] {
            let t = solve(from, to, wind(share, 1.0)).unwrap().time_s();
            prop_assert!((t - curve_s).abs() < 1e-4, "{t} {curve_s}");
        }
    }

    #[test]
    fn turning_or_mirroring_the_world_changes_nothing(
        x in -400.0f64..400.0, y in -400.0f64..400.0, a in -4.0f64..4.0, b in -4.0f64..4.0,
        share in 0.0f64..1.3, towards in 0.0f64..TAU, by in -3.0f64..3.0,
    ) {
        let from = pose(0.0, 0.0, a);
        let t = time_s(from, pose(x, y, b), UAV, wind(share, towards)).unwrap();
        let (s, c) = sin_cos(by);
        let turned = time_s(
            pose(0.0, 0.0, a + by), pose(c * x - s * y, s * x + c * y, b + by),
            UAV, wind(share, towards + by),
        ).unwrap();
        let mirrored = time_s(
            pose(0.0, 0.0, -a), pose(x, -y, -b), UAV, wind(share, -towards),
        ).unwrap();
        for other in [turned, mirrored] {
            let same = (t.is_infinite() && other.is_infinite()) || (t - other).abs() < 1e-7 * (1.0 + t);
            prop_assert!(same, "{t} {other}");
        }
    }

    #[test]
    fn no_flown_word_is_faster(
        a in -3.0f64..3.0, turns in prop::array::uniform4(-1i8..=1), parts in prop::array::uniform4(0.0f64..5.0),
        share in 0.0f64..1.6, towards in 0.0f64..TAU,
    ) {
        // Any pieces of bounded turn rate are a candidate for the fastest, in any wind.
        let (from, w) = (pose(1.0, 2.0, a), wind(share, towards));
        let mut at = from;
        let mut flown_s = 0.0;
        for (turn, part) in turns.into_iter().zip(parts) {
            let piece = Segment {
                start: at,
                curvature_per_m: f64::from(turn) / UAV.turn_radius_m,
                length_m: part * UAV.turn_radius_m,
            };
            at = piece.end();
            flown_s += piece.length_m / UAV.airspeed_mps;
        }
        let to = Pose::new(at.position() + w.velocity() * flown_s, at.heading_rad);
        let best_s = time_s(from, to, UAV, w).unwrap();
        prop_assert!(best_s <= flown_s * (1.0 + 1e-7) + 1e-6, "{best_s} {flown_s}");
    }

    #[test]
    fn course_and_heading_invert_each_other(
        heading in -3.1f64..3.1, share in 0.0f64..0.99, towards in 0.0f64..TAU,
    ) {
        let w = wind(share, towards);
        let course = w.course_of(Heading(heading), UAV.airspeed_mps);
        let back = w.heading_for_course(course, UAV.airspeed_mps).unwrap();
        prop_assert!(wrap_pi(back.0 - heading).abs() < 1e-9);
        let speed = w.ground_velocity(back, UAV.airspeed_mps).norm();
        prop_assert!((w.ground_speed_mps(course, UAV.airspeed_mps).unwrap() - speed).abs() < 1e-9);
    }
}
