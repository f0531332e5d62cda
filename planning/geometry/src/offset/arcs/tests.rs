//! Exact outlines against the definition of distance, and against the tangent ones.

use super::*;
use crate::math::TAU;
use crate::polygon::point_to_line_m;
use proptest::prelude::*;

fn zone(points: &[(f64, f64)]) -> Zone {
    Zone {
        outer: points.iter().map(|&(x, y)| Point::new(x, y)).collect(),
        holes: Vec::new(),
    }
}

const SQUARE: [(f64, f64); 4] = [(0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0)];

fn distance_m(zone: &Zone, p: Point) -> f64 {
    let inside = winding(&zone.outer, p) != 0 && zone.holes.iter().all(|h| winding(h, p) == 0);
    if inside {
        return 0.0;
    }
    core::iter::once(&zone.outer)
        .chain(&zone.holes)
        .flat_map(|r| (0..r.len()).map(move |i| (r[i], r[(i + 1) % r.len()])))
        .map(|(a, b)| point_to_line_m(p, a, b))
        .fold(f64::INFINITY, f64::min)
}

/// Closed loops on which every point has the radius, and the tangent outline is around.
fn check(zones: &[Zone], radius_m: f64) -> ArcGrown {
    let g = grow_exact(zones, radius_m).unwrap_or_else(|e| panic!("{e}: {zones:?} {radius_m}"));
    assert!(g.least_distance_m >= radius_m);
    let farthest_m = g.radius_m + g.united_m * 1.02 + 2e-6;
    for pieces in g.regions.iter().flat_map(ArcRegion::loops) {
        for (i, p) in pieces.iter().enumerate() {
            let next = &pieces[(i + 1) % pieces.len()];
            assert!((p.to() - next.from()).norm() <= 0.0);
            for k in 0..=10 {
                let at = p.at(f64::from(k) / 10.0);
                let d = zones
                    .iter()
                    .map(|z| distance_m(z, at))
                    .fold(f64::INFINITY, f64::min);
                assert!(d >= radius_m - 1e-9 && d <= farthest_m, "{d} {p:?}");
            }
        }
    }
    if g.united_m <= 0.0 {
        let tangent = grow(zones, &Growth::new(radius_m).unwrap()).unwrap();
        let (exact, around): (f64, f64) = (
            g.regions.iter().map(ArcRegion::area_m2).sum(),
            tangent.area_m2(),
        );
        assert!(exact <= around + 1.0, "{exact} {around}");
        assert!(exact * 1.006 + 10.0 >= around, "{exact} {around}");
    }
    g
}

#[test]
fn a_square_becomes_four_lines_and_four_quarters() {
    let g = check(&[zone(&SQUARE)], 30.0);
    assert_eq!((g.regions.len(), g.regions[0].outer.len()), (1, 8));
    let r = g.radius_m;
    let exact = 1e4 + 400.0 * r + PI * r * r;
    assert!((g.regions[0].area_m2() - exact).abs() < 1e-6);
    for p in &g.regions[0].outer {
        if let Piece::Arc { .. } = p {
            assert!((p.turn_rad() - PI / 2.0).abs() < 1e-9);
        }
    }
}

#[test]
fn inward_corners_have_no_arc_and_holes_stay() {
    let mut z = zone(&[(0.0, 0.0), (400.0, 0.0), (400.0, 400.0), (0.0, 400.0)]);
    z.holes.push(
        zone(&[
            (100.0, 100.0),
            (300.0, 100.0),
            (300.0, 300.0),
            (100.0, 300.0),
        ])
        .outer,
    );
    for (radius_m, holes) in [(10.0, 1), (99.0, 1), (100.0, 0), (300.0, 0)] {
        let g = check(core::slice::from_ref(&z), radius_m);
        assert_eq!(g.regions[0].holes.len(), holes, "{radius_m}");
        for hole in &g.regions[0].holes {
            assert_eq!(hole.len(), 4);
        }
    }
}

#[test]
fn touching_zones_are_united_first() {
    let right: Vec<_> = SQUARE.iter().map(|&(x, y)| (x + 100.0, y)).collect();
    let zones = [zone(&SQUARE), zone(&right), zone(&SQUARE)];
    let g = check(&zones, 30.0);
    assert_eq!(g.regions.len(), 1);
    assert!(g.united_m <= 1.4e-3);
    let eight = zone(&[(0.0, 0.0), (200.0, 200.0), (200.0, 0.0), (0.0, 200.0)]);
    check(&[eight], 10.0);
}

#[test]
fn a_radius_of_nothing_is_refused() {
    assert_eq!(grow_exact(&[], 0.0), Err(OffsetError::Radius(0.0)));
    assert!(grow_exact(&[], 5.0).unwrap().regions.is_empty());
}

fn star(n: core::ops::Range<usize>) -> impl Strategy<Value = Zone> {
    let radii = proptest::collection::vec(100.0..500.0f64, n);
    (radii, -900.0..900.0, -900.0..900.0).prop_map(|(radii, x, y)| {
        let step = TAU / radii.len() as f64;
        let points = radii.iter().enumerate().map(|(i, r)| {
            let (s, c) = sin_cos(step * i as f64);
            (x + r * c, y + r * s)
        });
        zone(&points.collect::<Vec<_>>())
    })
}

fn wild() -> impl Strategy<Value = Zone> {
    proptest::collection::vec((-4..4i32, -4..4i32), 3..12).prop_map(|v| {
        let points: Vec<_> = v
            .iter()
            .map(|&(x, y)| (f64::from(x) * 40.0, f64::from(y) * 40.0))
            .collect();
        zone(&points)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]
    #[test]
    fn outlines_of_simple_zones_are_exact(
        zones in proptest::collection::vec(star(3..16), 1..4), radius_m in 0.5..150.0f64,
    ) {
        check(&zones, radius_m);
    }

    #[test]
    fn points_almost_on_the_edges_do_no_harm(z in star(3..9), share in 0.01..0.99f64, radius_m in 0.5..150.0f64) {
        let n = z.outer.len();
        let halved = (0..n)
            .flat_map(|i| {
                let (a, b) = (z.outer[i], z.outer[(i + 1) % n]);
                [a, a + (b - a) * share, a + (b - a) * (0.5 + share / 2.0)]
            })
            .collect();
        check(&[Zone { outer: halved, holes: Vec::new() }], radius_m);
    }

    #[test]
    fn any_rings_are_grown_or_refused_with_their_place(
        zones in proptest::collection::vec(wild(), 1..3), radius_m in 0.5..90.0f64,
    ) {
        let few = zones.iter().any(|z| {
            matches!(Shape::new(0, z, &mut Vec::new()), Err(OffsetError::TooFewVertices { .. }))
        });
        if !few {
            check(&zones, radius_m);
        }
    }
}
