//! Properties of trajectories: exact forms against integration, limits, certificates.

use super::*;
use crate::airframe::PowerModel;
use crate::trajectory::wind::{Performance, time_optimal};
use proptest::prelude::*;
use skein_geometry::math::{FRAC_PI_2, TAU, cos, sin, wrap_pi};
use skein_geometry::{NoFlyZones, Polygon};

fn airframe() -> Airframe {
    Airframe {
        stall_mps: 10.0,
        cruise_mps: 16.0,
        max_mps: 24.0,
        max_bank_rad: 0.6,
        endurance_s: 1800.0,
        reserve_s: 120.0,
        footprint_across_m: 20.0,
        footprint_along_m: 15.0,
        mount: crate::mount::Mount::Level,
        climb_mps: crate::airframe::CLIMB_MPS,
    }
}

fn pose(east_m: f64, north_m: f64, heading_rad: f64) -> Pose {
    Pose {
        east_m,
        north_m,
        heading_rad,
    }
}

fn blowing(speed_mps: f64, towards: f64) -> Wind {
    Wind::new(speed_mps * cos(towards), speed_mps * sin(towards))
}

fn flight<'a>(a: &'a Airframe, zones: &'a NoFlyZones) -> Flight<'a> {
    Flight {
        from: pose(0.0, 0.0, 0.0),
        to: pose(600.0, 200.0, 1.0),
        airframe: a,
        airspeeds: Airspeeds::Cruise,
        wind: blowing(5.0, 2.0),
        objective: Objective::Time,
        zones,
        margin_m: 10.0,
        turning: 1.0,
    }
}

/// Sums over time by Simpson's rule: length over the ground, and energy; checks on
/// the way that the velocity is the change of place and the airspeed is kept.
fn flown(t: &Trajectory, a: &Airframe) -> (f64, f64) {
    let model = PowerModel::of(a);
    let (mut length_m, mut energy_s) = (0.0, 0.0);
    for p in t.pieces() {
        let n = 1000;
        let h = p.duration_s / f64::from(n);
        let mut before: Option<State> = None;
        for i in 0..=n {
            let s = p.state_after(h * f64::from(i), t.wind());
            let weight = match i {
                0 => 1.0,
                _ if i == n => 1.0,
                _ if i % 2 == 1 => 4.0,
                _ => 2.0,
            } * h
                / 3.0;
            length_m += weight * s.ground_velocity.norm();
            energy_s += weight * model.share(s.airspeed_mps, s.bank_rad());
            let through_air = s.ground_velocity - t.wind().velocity();
            assert!((through_air.norm() - s.airspeed_mps).abs() < 1e-9, "{s:?}");
            let along = s.ground_velocity.norm()
                * wrap_pi(s.course.0 - s.ground_velocity.y.atan2(s.ground_velocity.x));
            assert!(along.abs() < 1e-6);
            if let Some(b) = before {
                let mean = (b.ground_velocity + s.ground_velocity) / 2.0;
                let moved = s.position - b.position;
                assert!(
                    (moved - mean * h).norm() < 3.0 * h * h + 1e-9,
                    "{b:?} {s:?}"
                );
                let turned = wrap_pi(s.heading.0 - b.heading.0);
                let rate = (b.turn_rate_radps + s.turn_rate_radps) / 2.0;
                assert!((turned - rate * h).abs() < h * h + 1e-9, "{b:?} {s:?}");
            }
            before = Some(s);
        }
    }
    (length_m, energy_s)
}

#[test]
fn calm_air_is_the_curve() {
    let curve = Curve::from_pieces(
        pose(1.0, 2.0, 0.5),
        &[(0.02, 100.0), (0.0, 50.0), (-0.01, 200.0)],
    );
    let t = Trajectory::along(&curve, 16.0, Wind::CALM).unwrap();
    assert!((t.duration_s() - 350.0 / 16.0).abs() < 1e-9);
    assert!(
        (t.ground_length_m() - 350.0).abs() < 1e-9 && (t.air_distance_m() - 350.0).abs() < 1e-9
    );
    for i in 0..=350 {
        let s_m = f64::from(i);
        let state = t.at(s_m / 16.0).unwrap();
        let on = curve.pose_at(s_m).unwrap();
        assert!((state.position - on.position()).norm() < 1e-9);
        assert!(wrap_pi(state.heading.0 - on.heading_rad).abs() < 1e-9);
    }
    assert!(Trajectory::empty(Wind::CALM).at(1.0).is_none());
}

#[test]
fn what_the_wind_forbids_is_refused() {
    let north = Curve::from_pieces(pose(0.0, 0.0, FRAC_PI_2), &[(0.0, 100.0)]);
    let against = Trajectory::along(&north, 16.0, Wind::new(0.0, -16.0));
    assert_eq!(against, Err(TimedError::NoWay));
    assert_eq!(
        Trajectory::along(&north, 16.0, Wind::new(17.0, 0.0)),
        Err(TimedError::NoWay)
    );
    assert!(Trajectory::along(&north, 16.0, Wind::new(0.0, 30.0)).is_ok());
    assert_eq!(
        Trajectory::along(&north, f64::NAN, Wind::CALM),
        Err(TimedError::NotFinite)
    );
    let circle = Curve::from_pieces(pose(0.0, 0.0, 0.0), &[(0.01, 600.0)]);
    assert_eq!(
        Trajectory::along(&circle, 16.0, Wind::new(16.0, 0.0)),
        Err(TimedError::NoWay)
    );
}

#[test]
fn limits_are_those_of_the_airframe_in_the_wind() {
    let a = airframe();
    let radius_m = a.turn_radius_m(16.0);
    let circle = |r: f64| Curve::from_pieces(pose(0.0, 0.0, 0.0), &[(1.0 / r, TAU * r)]);
    let wind = Wind::new(4.0, 0.0);
    let calm = Trajectory::along(&circle(radius_m), 16.0, Wind::CALM).unwrap();
    assert_eq!(calm.check(&a), Ok(()));
    let tight = Trajectory::along(&circle(radius_m), 16.0, wind).unwrap();
    assert!(matches!(tight.check(&a), Err(LimitError::Bank { .. })));
    let wide = Trajectory::along(&circle(radius_m * 1.25 * 1.25), 16.0, wind).unwrap();
    assert_eq!(wide.check(&a), Ok(()), "(1 + w/V)² is just wide enough");
    let line = Curve::from_pieces(pose(0.0, 0.0, 0.0), &[(0.0, 100.0)]);
    let at = |v: f64| Trajectory::along(&line, v, wind).unwrap().check(&a);
    assert!(matches!(at(9.0), Err(LimitError::Stall { .. })));
    assert!(matches!(at(25.0), Err(LimitError::TooFast { .. })));
    let banked = Curve::from_pieces(pose(0.0, 0.0, 0.0), &[(1.0 / 17.0, 50.0)]);
    let slow = Trajectory::along(&banked, 10.2, Wind::CALM).unwrap();
    assert!(
        matches!(slow.check(&a), Err(LimitError::Stall { .. })),
        "the load stalls it"
    );
}

#[test]
fn trajectories_join_only_end_to_start() {
    let line = |p: Pose| Curve::from_pieces(p, &[(0.0, 160.0)]);
    let wind = Wind::new(3.0, 1.0);
    let mut t = Trajectory::along(&line(pose(0.0, 0.0, 0.0)), 16.0, wind).unwrap();
    let next = Trajectory::along(&line(pose(160.0, 0.0, 0.0)), 16.0, wind).unwrap();
    t.append(&next).unwrap();
    assert!((t.ground_length_m() - 320.0).abs() < 1e-9);
    assert!((t.at(1e9).unwrap().position.x - 320.0).abs() < 1e-9);
    assert!(matches!(t.append(&next), Err(TimedError::Apart { .. })));
}

#[test]
fn an_objective_gets_the_least_of_its_own() {
    let (a, none) = (airframe(), NoFlyZones::new(vec![]));
    let mut f = flight(&a, &none);
    f.airspeeds = Airspeeds::Any;
    let mut best = |objective| {
        f.objective = objective;
        f.best().unwrap().0
    };
    let (time, distance, energy) = (
        best(Objective::Time),
        best(Objective::Distance),
        best(Objective::Energy),
    );
    assert!(time.duration_s() < distance.duration_s().min(energy.duration_s()));
    assert!(distance.ground_length_m() < time.ground_length_m().min(energy.ground_length_m()));
    assert!(energy.energy_s(&a) < time.energy_s(&a).min(distance.energy_s(&a)));
}

#[test]
fn a_zone_in_the_way_is_flown_round_or_refused() {
    let a = airframe();
    let block = |x0: f64, y0: f64, x1: f64, y1: f64| {
        let at = Point::new;
        Polygon::new(vec![at(x0, y0), at(x1, y0), at(x1, y1), at(x0, y1)]).unwrap()
    };
    let none = NoFlyZones::new(vec![]);
    let narrow = |zones| Flight {
        margin_m: 1.0,
        to: pose(0.0, 150.0, 2.0),
        ..flight(&a, zones)
    };
    let free = narrow(&none).best().unwrap();
    // On the fastest way, but not on every other.
    let on_it = free.0.at(free.1 * 0.5).unwrap().position;
    let (x, y) = (on_it.x, on_it.y);
    let zones = NoFlyZones::new(vec![block(x - 0.5, y - 0.5, x + 0.5, y + 0.5)]);
    assert!(!free.0.stays_clear(&zones, 1.0));
    let round = narrow(&zones).best().unwrap();
    assert!(round.0.stays_clear(&zones, 1.0) && round.1 > free.1);
    let wall = NoFlyZones::new(vec![block(300.0, -9000.0, 310.0, 9000.0)]);
    assert_eq!(flight(&a, &wall).best().unwrap_err(), TimedError::NotClear);
    let mut storm = flight(&a, &none);
    (storm.wind, storm.to) = (Wind::new(-30.0, 0.0), pose(300.0, 0.0, 0.0));
    assert_eq!(storm.best().unwrap_err(), TimedError::NoWay);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn closed_forms_are_what_is_flown(
        x in -400.0f64..400.0, y in -400.0f64..400.0, a in -4.0f64..4.0, b in -4.0f64..4.0,
        speed in 0.0f64..12.0, towards in 0.0f64..TAU, k in -0.03f64..0.03, length in 5.0f64..500.0,
    ) {
        let (uav, wind) = (airframe(), blowing(speed, towards));
        let path = time_optimal(pose(1.0, -2.0, a), pose(x, y, b), Performance::of(&uav, 16.0), wind)
            .unwrap().path().unwrap();
        let air = Trajectory::through_air(&path);
        let end = air.end().map_or(path.start, |s| s.pose());
        prop_assert!((end.position() - Point::new(x, y)).norm() < 1e-6);
        prop_assert!((air.duration_s() - path.time_s()).abs() < 1e-9);
        for i in 0..10 {
            let t = air.duration_s() * f64::from(i) / 10.0;
            if let Some(s) = air.at(t) {
                prop_assert!((s.position - path.pose_at(t).position()).norm() < 1e-6);
            }
        }
        prop_assert!(air.check(&uav).is_ok());
        let curve = Curve::from_pieces(pose(0.0, 0.0, a), &[(k, length), (0.0, 40.0)]);
        let ground = Trajectory::along(&curve, 16.0, wind).unwrap();
        for t in [&air, &ground] {
            let (length_m, energy_s) = flown(t, &uav);
            prop_assert!((t.ground_length_m() - length_m).abs() < 1e-5 * (1.0 + length_m));
            prop_assert!((t.energy_s(&uav) - energy_s).abs() < 1e-4 * (1.0 + energy_s));
        }
        let end = ground.end().unwrap();
        prop_assert!((end.position - curve.end().unwrap().position()).norm() < 1e-6);
        // The steepest bank is nowhere exceeded and somewhere reached.
        let steepest = ground.pieces()[0].steepest(wind);
        let n = 300;
        let most = (0..=n)
            .map(|i| ground.at(ground.pieces()[0].duration_s * f64::from(i) / f64::from(n)).unwrap().bank_rad())
            .take(n as usize)
            .fold(0.0, f64::max);
        prop_assert!(most <= steepest.0 + 1e-9 && most >= steepest.0 * 0.9 - 1e-9, "{most} {steepest:?}");
        prop_assert!((ground.at(steepest.1).unwrap().bank_rad() - steepest.0).abs() < 1e-6 || steepest.1 >= ground.pieces()[0].duration_s - 1e-6);
    }

    #[test]
    fn the_certificate_is_exact(
        x in -200.0f64..200.0, y in -200.0f64..200.0, b in -4.0f64..4.0,
        speed in 0.0f64..20.0, towards in 0.0f64..TAU, zx in -150.0f64..150.0, zy in -150.0f64..150.0,
        size in 1.0f64..40.0,
    ) {
        let (uav, wind) = (airframe(), blowing(speed, towards));
        let found = time_optimal(pose(0.0, 0.0, 0.0), pose(x, y, b), Performance::of(&uav, 16.0), wind);
        if let Some(path) = found.unwrap().path() {
            let t = Trajectory::through_air(&path);
            let square = [(0.0, 0.0), (size, 0.0), (size, size), (0.0, size)];
            let ring = square.iter().map(|(dx, dy)| Point::new(zx + dx, zy + dy)).collect();
            let zones = NoFlyZones::new(vec![Polygon::new(ring).unwrap()]);
            let n = 4000;
            let step_s = t.duration_s() / f64::from(n);
            let nearest = (0..=n)
                .map(|i| zones.distance_m(t.at(step_s * f64::from(i)).unwrap().position))
                .fold(f64::INFINITY, f64::min);
            // Samples are never nearer than the truth, and at most half a step farther.
            let half_step = 0.5 * step_s * (16.0 + speed);
            prop_assert!(!t.stays_clear(&zones, nearest + 1e-5));
            prop_assert!(nearest - half_step < 0.0 || t.stays_clear(&zones, nearest - half_step - 1e-5));
            prop_assert!(!t.stays_clear(&zones, f64::INFINITY));
        }
    }

    #[test]
    fn turning_the_other_way_takes_as_long(a in -4.0f64..4.0, k in 0.001f64..0.03, length in 5.0f64..500.0, speed in 0.0f64..15.0) {
        // Mirrored at the wind's axis.
        let wind = Wind::new(speed, 0.0);
        let time = |heading, k| {
            let c = Curve::from_pieces(pose(0.0, 0.0, heading), &[(k, length)]);
            Trajectory::along(&c, 16.0, wind).unwrap().duration_s()
        };
        prop_assert!((time(a, k) - time(-a, -k)).abs() < 1e-7);
        // A full circle against the wind and with it is one and the same loss.
        let full = Curve::from_pieces(pose(0.0, 0.0, a), &[(k, TAU / k)]);
        let t = Trajectory::along(&full, 16.0, wind).unwrap().duration_s();
        prop_assert!(t >= TAU / k / 16.0 - 1e-9);
    }

    #[test]
    fn lines_and_arcs_follow_a_trochoid_closely(
        x in -400.0f64..400.0, y in -400.0f64..400.0, a in -4.0f64..4.0, b in -4.0f64..4.0,
        share in 0.0f64..0.8, towards in 0.0f64..TAU, tolerance_m in 0.005f64..0.5,
    ) {
        let (uav, wind) = (airframe(), blowing(16.0 * share, towards));
        let path = time_optimal(pose(1.0, -2.0, a), pose(x, y, b), Performance::of(&uav, 16.0), wind)
            .unwrap().path().unwrap();
        let t = Trajectory::through_air(&path);
        let curve = t.over_ground(tolerance_m);
        prop_assert!(curve.largest_gap_m() < 2e-4, "{}", curve.largest_gap_m());
        for w in curve.segments().windows(2) {
            let turned = wrap_pi(w[1].start.heading_rad - w[0].end().heading_rad).abs();
            prop_assert!(turned < 1e-3 + w[0].curvature_per_m.abs().max(w[1].curvature_per_m.abs()) * 2e-4, "{turned}");
        }
        let (start, end) = (t.start().unwrap(), t.end().unwrap());
        prop_assert!((curve.start().unwrap().position() - start.position).norm() < 1e-3);
        prop_assert!((curve.end().unwrap().position() - end.position).norm() < 1e-3);
        // A curve beside another at the tolerance is longer by it times what it turns.
        let (drawn_m, flown_m) = (curve.length_m(), t.ground_length_m());
        let turned_rad: f64 = curve.segments().iter().map(|s| s.curvature_per_m.abs() * s.length_m).sum();
        prop_assert!(
            (drawn_m - flown_m).abs() < 1e-3 * (10.0 + flown_m) + tolerance_m * turned_rad,
            "{drawn_m} m drawn, {flown_m} m flown in {} pieces", curve.segments().len()
        );
        // Places on the trochoid, by distance flown over the ground, lie on the curve.
        let n = 400;
        let (mut at_m, mut before) = (0.0, start.position);
        for i in 1..=n {
            let s = t.at(t.duration_s() * f64::from(i) / f64::from(n)).unwrap();
            at_m += (s.position - before).norm();
            before = s.position;
            let on = (-40..=40)
                .map(|j| curve.pose_at(at_m + 0.05 * f64::from(j)).unwrap().position())
                .map(|p| (p - s.position).norm())
                .fold(f64::INFINITY, f64::min);
            prop_assert!(on < 1.5 * tolerance_m + 0.03, "{on} off at {at_m} of {}", curve.length_m());
        }
        prop_assert!(curve.segments().len() < 400, "{}", curve.segments().len());
    }
}
