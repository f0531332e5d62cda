//! Flights after targets of every kind, in closed loop.

use super::*;
use crate::tracking::flyable::least_radius_m;
use crate::tracking::flyable::tests::airframe;
use proptest::prelude::*;

fn settings(field: Field, stand_off: StandOff) -> Settings {
    Settings {
        airframe: airframe(),
        airspeeds: Airspeeds::of(&airframe()),
        field,
        stand_off,
    }
}

/// Airspeed and turn rate of each step stay within what the airframe has.
fn check_limits(c: &Command) {
    let a = airframe();
    assert!((a.least_airspeed_mps()..=a.max_mps).contains(&c.airspeed_mps));
    assert!(c.turn_rate_radps.abs() <= turn_rate_radps(&a, c.airspeed_mps) + 1e-12);
}

/// Flies after a target whose motion is a function of time, and hands each place to `look`.
fn flight(
    settings: Settings,
    wind: Wind,
    start: Pose,
    lasts_s: f64,
    target: &dyn Fn(f64) -> TargetMotion,
    look: &mut dyn FnMut(f64, &Pose, &Command),
) -> Follower {
    let mut follower = Follower::new(settings);
    let (mut pose, mut now_s) = (start, 0.0);
    while now_s < lasts_s {
        for c in follower.commands(pose, wind, &target(now_s), 0.2, None) {
            check_limits(&c);
            pose = fly(&pose, &c, wind);
            now_s += c.lasts_s;
            look(now_s, &pose, &c);
        }
    }
    follower
}

fn straight(vx: f64, vy: f64) -> impl Fn(f64) -> TargetMotion {
    move |t| TargetMotion {
        position: Point::new(vx * t, vy * t),
        velocity_mps: Vector::new(vx, vy),
        acceleration_mps2: Vector::zeros(),
    }
}

/// Root mean square of the error of the stand-off after `from_s`, metres.
fn rms_m(
    settings: Settings,
    wind: Wind,
    target: &dyn Fn(f64) -> TargetMotion,
    wanted_m: f64,
    from_s: f64,
) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    let start = Pose::new(Point::new(-300.0, 100.0), 0.3);
    flight(
        settings,
        wind,
        start,
        from_s + 200.0,
        target,
        &mut |t, p, _| {
            if t > from_s {
                let off = (p.position() - target(t).position).norm() - wanted_m;
                sum += off * off;
                n += 1.0;
            }
        },
    );
    f64::sqrt(sum / n)
}

#[test]
fn a_flyable_orbit_is_kept_to_half_a_metre() {
    for field in [Field::HOPF, Field::Lyapunov] {
        for (v, w) in [(0.0, 0.0), (4.0, 0.0), (8.0, 0.0), (3.0, 4.0), (9.0, 3.0)] {
            let wind = Wind::new(0.6 * w, -0.8 * w);
            let s = settings(field, StandOff::Distance(250.0));
            let rms = rms_m(s, wind, &straight(0.0, v), 250.0, 120.0);
            assert!(rms < 0.5, "{field:?}, target {v}, wind {w}: {rms} m");
        }
    }
}

#[test]
fn a_target_that_turns_is_kept_too() {
    // 6 m/s on a circle of 60 m: it turns at 0.1 rad/s.
    let round = |t: f64| {
        let (s, c) = sin_cos(0.1 * t);
        TargetMotion {
            position: Point::new(60.0 * c, 60.0 * s),
            velocity_mps: Vector::new(-6.0 * s, 6.0 * c),
            acceleration_mps2: Vector::new(-0.6 * c, -0.6 * s),
        }
    };
    let s = settings(Field::HOPF, StandOff::Distance(200.0));
    let rms = rms_m(s, Wind::new(2.0, 1.0), &round, 200.0, 120.0);
    assert!(rms < 0.5, "{rms} m");
}

#[test]
fn without_feeding_the_drift_forward_the_error_is_metres() {
    // What is measured can fail: to a law that takes the target for still, 4 m/s are 10 m.
    let told = |t: f64| TargetMotion {
        velocity_mps: Vector::zeros(),
        ..straight(4.0, 0.0)(t)
    };
    let s = settings(Field::HOPF, StandOff::Distance(250.0));
    assert!(rms_m(s, Wind::CALM, &told, 250.0, 120.0) > 5.0);
}

#[test]
fn what_cannot_be_circled_at_the_distance_is_circled_wider_and_told() {
    // In a wind of 9 m/s a parked car at 40 m: the ground speed downwind is too high.
    let wind = Wind::new(9.0, 0.0);
    let s = settings(Field::HOPF, StandOff::Distance(40.0));
    let mut radius_m = 0.0;
    let start = Pose::new(Point::new(-300.0, 0.0), 0.0);
    let mut worst_m = 0.0_f64;
    flight(
        s,
        wind,
        start,
        300.0,
        &straight(0.0, 0.0),
        &mut |t, p, c| {
            let Flown::Orbit(r) = c.flown else {
                panic!("{c:?}");
            };
            radius_m = r;
            if t > 120.0 {
                worst_m = worst_m.max((p.position().coords.norm() - r).abs());
                assert!(!c.saturated, "{t} s");
            }
        },
    );
    let mps = s.airspeeds.of_loiter_mps(9.0);
    let least = least_radius_m(&airframe(), mps, 9.0, 0.0).unwrap();
    assert!(radius_m >= least && radius_m < 1.1 * least && worst_m < 1.0);
}

#[test]
fn fast_targets_are_accompanied() {
    // One airspeed, as the published comparison has it: farthest 49 m at a ratio of 1.15, and
    // 108 at 1.3.
    for (ratio, most_m) in [(1.1, 50.0), (1.15, 75.0), (1.3, 135.0)] {
        let mut s = settings(Field::HOPF, StandOff::Distance(60.0));
        s.airspeeds = Airspeeds {
            least_mps: 20.0,
            most_mps: 20.0,
        };
        let target = straight(20.0 / ratio, 0.0);
        let mut farthest_m = 0.0_f64;
        let start = Pose::new(Point::new(-30.0, 20.0), 0.0);
        let f = flight(s, Wind::CALM, start, 600.0, &target, &mut |t, p, _| {
            if t > 200.0 {
                let off_m = (p.position() - target(t).position).norm();
                farthest_m = farthest_m.max(off_m);
            }
        });
        assert_eq!(f.switch().mode(), Some(Mode::Weave));
        assert!(farthest_m < most_m, "{ratio}: {farthest_m} m");
    }
}

#[test]
fn with_a_choice_of_airspeeds_a_fast_target_is_flown_over() {
    let s = settings(Field::HOPF, StandOff::Distance(100.0));
    for v in [15.0, 20.0, 23.0] {
        let target = straight(0.0, v);
        let mut farthest_m = 0.0_f64;
        let start = Pose::new(Point::new(-200.0, 0.0), 1.0);
        flight(
            s,
            Wind::new(1.0, 1.0),
            start,
            400.0,
            &target,
            &mut |t, p, _| {
                if t > 200.0 {
                    farthest_m = farthest_m.max((p.position() - target(t).position).norm());
                }
            },
        );
        assert!(farthest_m < 15.0, "{v}: {farthest_m} m");
    }
}

#[test]
fn who_is_outrun_says_so_and_catches_up_when_the_target_stops() {
    let target = |t: f64| {
        let moved = if t < 60.0 { 35.0 * t } else { 2_100.0 };
        let v = if t < 60.0 { 35.0 } else { 0.0 };
        TargetMotion {
            position: Point::new(moved, 0.0),
            velocity_mps: Vector::new(v, 0.0),
            acceleration_mps2: Vector::zeros(),
        }
    };
    let s = settings(Field::HOPF, StandOff::Distance(100.0));
    let (mut outrun, mut last_m) = (false, 0.0);
    let start = Pose::new(Point::new(0.0, 10.0), 0.0);
    flight(s, Wind::CALM, start, 240.0, &target, &mut |t, p, c| {
        outrun |= t < 60.0 && c.flown == Flown::Outrun;
        last_m = (p.position() - target(t).position).norm();
    });
    assert!(outrun && (last_m - 100.0).abs() < 1.0, "{outrun} {last_m}");
}

/// A car that stood speeds away from a UAV that flies the other way: it turns round slowly, for
/// then it turns fast, and the car is in its picture all the time (219 m on the ground).
#[test]
fn who_is_left_behind_turns_round_before_it_hurries() {
    let away = |t: f64| {
        let v = (2.0 * t).min(23.4);
        let moved = if t < 11.7 {
            t * t
        } else {
            11.7 * 11.7 + 23.4 * (t - 11.7)
        };
        TargetMotion {
            position: Point::new(-moved, 0.0),
            velocity_mps: Vector::new(-v, 0.0),
            acceleration_mps2: Vector::new(if t < 11.7 { -2.0 } else { 0.0 }, 0.0),
        }
    };
    let s = settings(Field::HOPF, StandOff::Distance(150.0));
    let mut farthest_m = 0.0_f64;
    for nth in 0..24 {
        let bearing_rad = f64::from(nth) * TAU / 24.0;
        let (sin, cos) = sin_cos(bearing_rad);
        let on_circle = Point::new(150.0 * cos, 150.0 * sin);
        let begin = Pose::new(on_circle, wrap_pi(bearing_rad + TAU / 4.0));
        flight(s, Wind::CALM, begin, 120.0, &away, &mut |t, p, _| {
            farthest_m = farthest_m.max((p.position() - away(t).position).norm());
        });
    }
    assert!(farthest_m < 219.0, "{farthest_m} m");
}

#[test]
fn beside_a_target_at_a_bearing() {
    // 15 m/s is an airspeed: the UAV stands 80 m to its left.
    let s = settings(
        Field::HOPF,
        StandOff::bearing(std::f64::consts::FRAC_PI_2, 80.0),
    );
    let target = straight(15.0, 0.0);
    let start = Pose::new(Point::new(-100.0, 0.0), 0.0);
    let mut worst_m = 0.0_f64;
    flight(s, Wind::CALM, start, 300.0, &target, &mut |t, p, _| {
        if t > 150.0 {
            let beside = p.position() - target(t).position;
            worst_m = worst_m.max((beside - Vector::new(0.0, 80.0)).norm());
        }
    });
    assert!(worst_m < 15.0, "{worst_m} m");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// From everywhere, also from the centre and in either sense, the circle is reached.
    #[test]
    fn the_circle_attracts_from_everywhere(
        x in -700.0..700.0_f64, y in -700.0..700.0_f64, heading in -3.1..3.1_f64,
        v in 0.0..6.0_f64, w in 0.0..4.0_f64, lyapunov in any::<bool>(), centre in 0_u8..4,
    ) {
        let at = if centre == 0 { Point::new(0.0, 0.0) } else { Point::new(x, y) };
        let field = if lyapunov { Field::Lyapunov } else { Field::HOPF };
        let s = settings(field, StandOff::Distance(150.0));
        let (target, wind) = (straight(v, 0.0), Wind::new(0.0, w));
        let mut last_m = 0.0;
        flight(s, wind, Pose::new(at, heading), 240.0, &target, &mut |t, p, _| {
            last_m = (p.position() - target(t).position).norm();
        });
        prop_assert!((last_m - 150.0).abs() < 0.5, "{last_m}");
    }

    /// Whatever a target does, commands are numbers within the limits.
    #[test]
    fn whatever_happens_commands_can_be_flown(
        x in -50.0..50.0_f64, vx in -40.0..40.0_f64, vy in -40.0..40.0_f64,
        wx in -30.0..30.0_f64, none in 0_u8..5, d in 0.0..400.0_f64,
    ) {
        let broken = if none == 0 { f64::NAN } else { 0.0 };
        let target = TargetMotion {
            position: Point::new(x + broken, 0.0),
            velocity_mps: Vector::new(vx, vy),
            acceleration_mps2: Vector::new(0.5, -1.0),
        };
        let mut follower = Follower::new(settings(Field::HOPF, StandOff::Distance(d)));
        for _ in 0..5 {
            let pose = Pose::new(Point::new(0.0, 0.0), 1.0);
            for c in follower.commands(pose, Wind::new(wx, 0.0), &target, 0.2, None) {
                check_limits(&c);
            }
        }
    }
}
