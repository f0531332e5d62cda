//! Routes against the visibility graph: an oracle that shares nothing with the router.

use proptest::prelude::*;
use skein_flight::route::{RouteLimits, Router};
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::TAU;
use skein_geometry::offset::{Growth, Zone, grow};
use skein_geometry::{NoFlyZones, Polygon};
use skein_survey::visibility::VisibilityGraph;
use std::sync::Arc;

const TURN_M: f64 = 23.5;

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

fn rectangle(x: f64, y: f64, wide: f64, tall: f64) -> Polygon {
    let ring = [(x, y), (x + wide, y), (x + wide, y + tall), (x, y + tall)];
    Polygon::new(ring.map(|(x, y)| Point::new(x, y)).to_vec()).unwrap()
}

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

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Where a point finds a way that keeps two turn radii more than the clearance,
    /// and both ends have that room, a UAV finds one too, and not a much longer one.
    #[test]
    fn where_there_is_room_there_is_a_route(
        zones in prop::collection::vec(zone(), 1..7), clearance_m in 2.0f64..60.0,
        x in -100.0f64..600.0, y in -100.0f64..600.0, a in -3.0f64..3.0,
        p in -100.0f64..600.0, q in -100.0f64..600.0, b in -3.0f64..3.0,
    ) {
        let router = router(zones, clearance_m);
        let (from, to) = (pose(x, y, a), pose(p, q, b));
        let drawn: Vec<Zone> = router.zones().zones().iter().map(Zone::from).collect();
        let growth = Growth::new(clearance_m + 2.0 * TURN_M).unwrap();
        let regions = grow(&drawn, &growth).unwrap().regions;
        let roomy = VisibilityGraph::round(&regions);
        if let Some(taut) = roomy.shortest(from.position(), to.position()) {
            let curve = router.route(from, to).unwrap();
            // A turn at either end costs no more than a circle.
            prop_assert!(
                curve.length_m() <= taut.length_m + 2.0 * TAU * TURN_M,
                "{} {}", curve.length_m(), taut.length_m
            );
            prop_assert!(router.route_to_point(from, to.position()).is_ok());
        }
    }
}
