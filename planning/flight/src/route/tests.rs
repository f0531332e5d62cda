//! Routes: what is promised of every one, and stories that need a bend.

use super::*;
use crate::coverage::lanes;
use crate::coverage::ring::{LoopError, LoopProblem};
use proptest::prelude::*;
use skein_geometry::Polygon;
use skein_geometry::math::{FRAC_PI_2, PI, wrap_pi};

const TURN_M: f64 = 23.5;

fn rectangle(x: f64, y: f64, wide: f64, tall: f64) -> Polygon {
    let ring = [(x, y), (x + wide, y), (x + wide, y + tall), (x, y + tall)];
    Polygon::new(ring.map(|(x, y)| Point::new(x, y)).to_vec()).unwrap()
}

fn router(zones: Vec<Polygon>, clearance_m: f64) -> Router {
    let limits = RouteLimits {
        turn_radius_m: TURN_M,
        clearance_m,
    };
    Router::new(Arc::new(NoFlyZones::new(zones)), limits)
}

fn pose(x: f64, y: f64, heading_rad: f64) -> Pose {
    Pose::new(Point::new(x, y), heading_rad)
}

/// Checks what every route promises.
fn judge(router: &Router, from: Pose, to: Point, heading_rad: Option<f64>, curve: &Curve) {
    let limits = router.limits();
    assert!(router.zones().is_clear(curve, limits.clearance_m));
    assert!(curve.max_curvature_per_m() <= 1.0 / limits.turn_radius_m + 1e-12);
    assert!(curve.largest_gap_m() < 1e-5, "{curve:?}");
    for w in curve.segments().windows(2) {
        let bend = wrap_pi(w[1].start.heading_rad - w[0].end().heading_rad);
        assert!(bend.abs() < 1e-5, "{curve:?}");
    }
    let start = curve.start().unwrap_or(from);
    let end = curve.end().unwrap_or(from);
    assert!((start.position() - from.position()).norm() < 1e-3);
    assert!(wrap_pi(start.heading_rad - from.heading_rad).abs() < 1e-4);
    assert!((end.position() - to).norm() < 2e-3, "{end:?} {to:?}");
    if let Some(h) = heading_rad {
        assert!(wrap_pi(end.heading_rad - h).abs() < 2e-4, "{end:?} {h}");
    }
    assert!(curve.length_m() >= (to - from.position()).norm() - 1e-3);
}

#[test]
fn a_route_bends_round_a_large_zone() {
    // Two kilometres wide: no Dubins word leads past it.
    for clearance_m in [8.0, 23.5, 46.0] {
        let router = router(vec![rectangle(-1000.0, 0.0, 2000.0, 300.0)], clearance_m);
        let (from, to) = (pose(0.0, -100.0, 0.0), pose(0.0, 400.0, PI));
        let curve = router.route(from, to).unwrap();
        judge(&router, from, to.position(), Some(PI), &curve);
        // Round the east end: out, up and back, with arcs of the larger radius.
        let reach = clearance_m.max(TURN_M);
        let taut = 2.0 * 1000.0 + 300.0 + 2.0 * reach * PI;
        assert!(curve.length_m() < taut, "{} {taut}", curve.length_m());
        assert!(curve.length_m() > 2.0 * 1000.0 + 300.0);
        let there = router.route_to_point(from, to.position()).unwrap();
        judge(&router, from, to.position(), None, &there);
        assert!(there.length_m() < curve.length_m() + 1e-6);
    }
}

#[test]
fn a_route_threads_a_street_and_leaves_a_dead_end() {
    // A street 60 m wide between two long blocks, and a yard open to the west.
    let zones = vec![
        rectangle(0.0, 0.0, 800.0, 200.0),
        rectangle(0.0, 260.0, 800.0, 200.0),
        rectangle(780.0, 190.0, 20.0, 80.0),
    ];
    let router = router(zones, 10.0);
    let from = pose(700.0, 230.0, PI);
    for to in [
        pose(400.0, -100.0, 0.0),
        pose(900.0, 230.0, 0.0),
        pose(900.0, 600.0, FRAC_PI_2),
    ] {
        let curve = router.route(from, to).unwrap();
        judge(&router, from, to.position(), Some(to.heading_rad), &curve);
    }
    // Facing the closed end it can neither turn nor go on.
    assert_eq!(
        router.route(pose(700.0, 230.0, 0.0), pose(400.0, -100.0, 0.0)),
        Err(RouteError::NoRoute)
    );
}

#[test]
fn no_way_through_a_closed_wall() {
    let zones = vec![
        rectangle(0.0, 0.0, 400.0, 20.0),
        rectangle(0.0, 380.0, 400.0, 20.0),
        rectangle(0.0, 0.0, 20.0, 400.0),
        rectangle(380.0, 0.0, 20.0, 400.0),
    ];
    let router = router(zones, 10.0);
    let inside = pose(200.0, 200.0, 0.0);
    assert_eq!(
        router.route(inside, pose(600.0, 200.0, 0.0)),
        Err(RouteError::NoRoute)
    );
    assert!(router.route(inside, pose(200.0, 220.0, PI)).is_ok());
    assert_eq!(
        router.route(inside, pose(10.0, 10.0, 0.0)),
        Err(RouteError::GoalInZone)
    );
    assert_eq!(
        router.route(pose(10.0, 10.0, 0.0), inside),
        Err(RouteError::StartInZone)
    );
    assert_eq!(
        router.route_to_point(inside, Point::new(f64::NAN, 0.0)),
        Err(RouteError::GoalInZone)
    );
}

#[test]
fn a_launch_behind_a_large_zone_is_not_cut_off() {
    // No Dubins word leads from the launch point round either end of the zone.
    let zones = Arc::new(NoFlyZones::new(vec![rectangle(
        -2000.0, -200.0, 4400.0, 100.0,
    )]));
    let problem = LoopProblem {
        area: rectangle(0.0, 0.0, 384.0, 192.0),
        zones,
        lane_spacing_m: 48.0,
        turn_radius_m: TURN_M,
        clearance_m: 8.0,
        footprint_across_m: 46.0,
        footprint_along_m: 36.0,
        tracking_error_m: 2.0,
        launch: Point::new(200.0, -400.0),
        tree: crate::coverage::ring::Tree::default(),
    };
    let coverage_loop = lanes::build(&problem).unwrap();
    assert_eq!(coverage_loop.len(), 32);
    let router = router(problem.zones.zones().to_vec(), problem.clearance_m);
    let (from, gate) = (Pose::new(problem.launch, 0.0), coverage_loop.boundary(0));
    let route = router.route(from, gate).unwrap();
    judge(
        &router,
        from,
        gate.position(),
        Some(gate.heading_rad),
        &route,
    );
    assert!(route.length_m() > 4000.0);
    // Walls all around it do cut it off.
    let mut walls = problem.zones.zones().to_vec();
    walls.push(rectangle(-2000.0, -800.0, 4400.0, 100.0));
    walls.push(rectangle(-2000.0, -800.0, 100.0, 700.0));
    walls.push(rectangle(2300.0, -800.0, 100.0, 700.0));
    let closed = LoopProblem {
        zones: Arc::new(NoFlyZones::new(walls)),
        ..problem
    };
    assert!(matches!(lanes::build(&closed), Err(LoopError::CutOff)));
}

/// A zone of the property tests: any triangle or rectangle.
fn zone() -> impl Strategy<Value = Polygon> {
    let corner = || (0.0f64..500.0, 0.0f64..500.0);
    prop_oneof![
        (corner(), 5.0f64..200.0, 5.0f64..200.0).prop_map(|((x, y), w, h)| rectangle(x, y, w, h)),
        (corner(), 20.0f64..120.0, 0.0f64..1.0, 0.2f64..0.8).prop_map(|((x, y), size, a, b)| {
            let at = |t: f64| {
                let (s, c) = skein_geometry::math::sin_cos(TAU * t);
                Point::new(x + size * c, y + size * s)
            };
            Polygon::new(vec![at(a), at(a + 0.4 * b + 0.1), at(a + b + 0.15)]).unwrap()
        }),
    ]
}

#[test]
fn a_point_is_reached_where_a_pose_there_is() {
    let triangle =
        |ring: [(f64, f64); 3]| Polygon::new(ring.map(|(x, y)| Point::new(x, y)).to_vec()).unwrap();
    let zones = vec![
        triangle([(359.13, 378.48), (322.43, 379.99), (355.39, 358.02)]),
        triangle([(270.70, 255.78), (373.48, 282.77), (295.41, 369.96)]),
    ];
    let router = router(zones, 17.8);
    let (from, to) = (pose(522.93, 366.9, -2.50883), Point::new(0.0, 370.99));
    assert!(router.find(from, Goal::Point(to)).is_none());
    let curve = router.route_to_point(from, to).unwrap();
    judge(&router, from, to, None, &curve);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn every_route_keeps_its_promises(
        zones in prop::collection::vec(zone(), 0..7), clearance_m in 2.0f64..60.0,
        x in -100.0f64..600.0, y in -100.0f64..600.0, a in -3.0f64..3.0,
        p in -100.0f64..600.0, q in -100.0f64..600.0, b in -3.0f64..3.0,
    ) {
        let router = router(zones, clearance_m);
        let (from, to) = (pose(x, y, a), pose(p, q, b));
        if let Ok(curve) = router.route(from, to) {
            judge(&router, from, to.position(), Some(b), &curve);
            // A fresh router, and one that has been asked, give the same answer.
            let fresh = Router::new(Arc::clone(router.zones()), router.limits());
            prop_assert_eq!(fresh.route(from, to), Ok(curve.clone()));
            prop_assert!(
                curve.length_m() >= dubins::length_m(from, to, TURN_M) - 1e-3
            );
            // No longer than the shortest Dubins word that is clear.
            let word = dubins::all(from, to, TURN_M)
                .into_iter()
                .find(|c| router.zones().is_clear(c, clearance_m));
            if let Some(word) = word {
                prop_assert!(curve.length_m() <= word.length_m() + 1e-9);
            }
        }
        if let Ok(curve) = router.route_to_point(from, to.position()) {
            judge(&router, from, to.position(), None, &curve);
        }
    }
}
