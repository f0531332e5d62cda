//! What every grown outline must be, on random and on hostile zones.

use super::*;
use crate::math::{TAU, sin_cos};
use proptest::prelude::*;

fn zone(points: &[(f64, f64)]) -> Zone {
    Zone {
        outer: points.iter().map(|&(x, y)| Point::new(x, y)).collect(),
        holes: Vec::new(),
    }
}

fn by(radius_m: f64) -> Growth {
    Growth::new(radius_m).unwrap()
}

/// Distance to the zone with its interior, by definition.
fn distance_m(zone: &Zone, p: Point) -> f64 {
    let rings = || core::iter::once(&zone.outer).chain(&zone.holes);
    let inside = winding(&zone.outer, p) != 0 && zone.holes.iter().all(|h| winding(h, p) == 0);
    if inside {
        return 0.0;
    }
    rings()
        .flat_map(|r| (0..r.len()).map(move |i| (r[i], r[(i + 1) % r.len()])))
        .map(|(a, b)| crate::polygon::point_to_line_m(p, a, b))
        .fold(f64::INFINITY, f64::min)
}

/// Rings are simple and disjoint, contain all that is nearer than the radius, and
/// nothing farther than the overshoot.
fn check(zones: &[Zone], grown: &Grown, growth: &Growth) {
    let rings: Vec<&[Point]> = grown.regions.iter().flat_map(Region::rings).collect();
    for (i, r) in rings.iter().enumerate() {
        Polygon::new(r.to_vec()).expect("a simple ring");
        for q in &rings[i + 1..] {
            for k in 0..r.len() {
                for l in 0..q.len() {
                    assert!(!crate::polygon::segments_meet(
                        r[k],
                        r[(k + 1) % r.len()],
                        q[l],
                        q[(l + 1) % q.len()]
                    ));
                }
            }
        }
    }
    let (_, c) = sin_cos(growth.step_rad() / 2.0);
    let farthest_m = (growth.radius_m() + grown.margin_m) / c + 1e-9;
    let nearest = |p| {
        zones
            .iter()
            .map(|z| distance_m(z, p))
            .fold(f64::INFINITY, f64::min)
    };
    for p in rings.iter().flat_map(|r| r.iter()) {
        let d = nearest(*p);
        assert!(d >= growth.radius_m() && d <= farthest_m, "{d}");
    }
    for z in zones {
        for r in core::iter::once(&z.outer).chain(&z.holes) {
            for i in 0..r.len() {
                let (a, b) = (r[i], r[(i + 1) % r.len()]);
                for k in 0..16 {
                    let (s, c) = sin_cos(TAU * f64::from(k) / 16.0);
                    let at = a + (b - a) * (f64::from(k) * 0.37).fract();
                    let p = Point::new(
                        at.x + c * growth.radius_m() * 0.999_999,
                        at.y + s * growth.radius_m() * 0.999_999,
                    );
                    assert!(grown.contains(p), "{p:?} is near {at:?}");
                }
            }
        }
    }
}

fn grown(zones: &[Zone], radius_m: f64) -> Grown {
    let growth = by(radius_m);
    let g = grow(zones, &growth).unwrap_or_else(|e| panic!("{e}: {zones:?}"));
    check(zones, &g, &growth);
    g
}

const SQUARE: [(f64, f64); 4] = [(0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0)];

#[test]
fn a_convex_zone_grows_by_perimeter_and_disc() {
    let g = grown(&[zone(&SQUARE)], 30.0);
    let exact = 1e4 + 400.0 * 30.0 + core::f64::consts::PI * 900.0;
    let area = g.area_m2();
    assert!(area >= exact && area <= exact * 1.005, "{area} {exact}");
    assert!(g.repairs.is_empty());
}

#[test]
fn either_winding_and_a_closing_vertex_give_the_same_outline() {
    let back: Vec<_> = SQUARE.iter().rev().copied().collect();
    let mut closed = SQUARE.to_vec();
    closed.push(SQUARE[0]);
    for other in [back, closed] {
        let g = grown(&[zone(&other)], 30.0);
        assert!((g.area_m2() - grown(&[zone(&SQUARE)], 30.0).area_m2()).abs() < 1e-2);
        assert!(g.repairs.is_empty());
    }
}

#[test]
fn holes_stay_until_the_radius_fills_them() {
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
    z.holes
        .push(zone(&[(340.0, 340.0), (360.0, 340.0), (350.0, 360.0)]).outer);
    for (radius_m, holes) in [
        (10.0, 1),
        (99.0, 1),
        (99.9999, 1),
        (100.0, 0),
        (150.0, 0),
        (300.0, 0),
    ] {
        let g = grown(core::slice::from_ref(&z), radius_m);
        assert_eq!(g.regions.len(), 1);
        assert_eq!(g.regions[0].holes.len(), holes, "{radius_m}");
    }
}

#[test]
fn a_ring_that_closes_on_itself_encloses_a_hole() {
    // A court with a gate of 40 m: closed to everybody who keeps 20 m.
    let court = zone(&[
        (0.0, 0.0),
        (300.0, 0.0),
        (300.0, 300.0),
        (170.0, 300.0),
        (170.0, 280.0),
        (280.0, 280.0),
        (280.0, 20.0),
        (20.0, 20.0),
        (20.0, 280.0),
        (130.0, 280.0),
        (130.0, 300.0),
        (0.0, 300.0),
    ]);
    assert_eq!(
        grown(core::slice::from_ref(&court), 19.99).regions[0]
            .holes
            .len(),
        0
    );
    assert_eq!(
        grown(core::slice::from_ref(&court), 20.0).regions[0]
            .holes
            .len(),
        1
    );
    assert_eq!(grown(&[court], 131.0).regions[0].holes.len(), 0);
}

#[test]
fn degenerate_rings_are_grown_and_named() {
    let kinds = |points: &[(f64, f64)]| -> Vec<RepairKind> {
        grown(&[zone(points)], 25.0)
            .repairs
            .iter()
            .map(|r| r.kind)
            .collect()
    };
    use RepairKind::{NoArea, NotSimple, RepeatedVertex};
    // Repeats, points on edges, and a spike outward and inward.
    assert_eq!(
        kinds(&[
            (0.0, 0.0),
            (0.0, 0.0),
            (50.0, 0.0),
            (100.0, 0.0),
            (100.0, 90.0)
        ]),
        [RepeatedVertex]
    );
    assert_eq!(kinds(&[(0.0, 0.0), (50.0, 0.0), (90.0, 0.0)]), [NoArea]);
    kinds(&[
        (0.0, 0.0),
        (100.0, 0.0),
        (200.0, 0.0),
        (100.0, 0.0),
        (100.0, 100.0),
        (0.0, 100.0),
    ]);
    kinds(&[
        (0.0, 0.0),
        (100.0, 0.0),
        (50.0, 0.0),
        (100.0, 0.0),
        (100.0, 100.0),
        (0.0, 100.0),
    ]);
    kinds(&[
        (0.0, 0.0),
        (100.0, 0.0),
        (100.0, 100.0),
        (50.0, 100.0),
        (50.0, 40.0),
        (50.0, 100.0),
        (0.0, 100.0),
    ]);
    // A sliver, a figure of eight with equal lobes, two squares that share a corner.
    kinds(&[(0.0, 0.0), (1000.0, 1e-9), (500.0, 1e-9)]);
    assert_eq!(
        kinds(&[(0.0, 0.0), (200.0, 200.0), (200.0, 0.0), (0.0, 200.0)]),
        [NotSimple]
    );
    kinds(&[
        (0.0, 0.0),
        (100.0, 0.0),
        (100.0, 100.0),
        (200.0, 100.0),
        (200.0, 200.0),
        (100.0, 200.0),
        (100.0, 100.0),
        (0.0, 100.0),
    ]);
    // The same square twice round.
    let twice: Vec<_> = SQUARE.iter().chain(&SQUARE).copied().collect();
    kinds(&twice);
}

#[test]
fn what_cannot_be_grown_is_named() {
    let nan = zone(&[(0.0, 0.0), (1.0, 0.0), (f64::NAN, 1.0)]);
    let far = zone(&[(0.0, 0.0), (1e7, 0.0), (0.0, 1.0)]);
    let two = zone(&[(0.0, 0.0), (1.0, 0.0), (1.0, 0.0), (0.0, 0.0)]);
    let at = |zone, vertex| Place {
        zone,
        ring: 0,
        vertex,
    };
    let fails = |zones: &[Zone]| grow(zones, &by(1.0)).unwrap_err();
    assert_eq!(
        fails(&[zone(&SQUARE), nan]),
        OffsetError::NotFinite(at(1, 2))
    );
    assert_eq!(fails(&[far]), OffsetError::TooFar(at(0, 1)));
    assert_eq!(
        fails(&[two]),
        OffsetError::TooFewVertices { zone: 0, found: 2 }
    );
    let mut holed = zone(&SQUARE);
    holed.holes.push(zone(&[(0.0, f64::INFINITY)]).outer);
    let place = Place {
        zone: 0,
        ring: 1,
        vertex: 0,
    };
    assert_eq!(fails(&[holed]), OffsetError::NotFinite(place));
    assert_eq!(place.to_string(), "zone 0, hole 0, vertex 0");
    for r in [-1.0, f64::NAN, f64::INFINITY, 1e6] {
        assert!(Growth::new(r).is_err());
    }
    for share in [0.0, -1.0, 0.5, f64::NAN, 1e-12] {
        assert!(by(1.0).with_overshoot(share).is_err());
    }
}

#[test]
fn walls_in_common_and_zones_given_twice_are_one_region() {
    let right: Vec<_> = SQUARE.iter().map(|&(x, y)| (x + 100.0, y)).collect();
    let g = grown(
        &[zone(&SQUARE), zone(&right), zone(&SQUARE), zone(&right)],
        30.0,
    );
    assert_eq!((g.regions.len(), g.regions[0].holes.len()), (1, 0));
    let whole = grown(
        &[zone(&[
            (0.0, 0.0),
            (200.0, 0.0),
            (200.0, 100.0),
            (0.0, 100.0),
        ])],
        30.0,
    );
    assert!((g.area_m2() - whole.area_m2()).abs() < 0.01);
    assert!(grow(&[], &by(10.0)).unwrap().regions.is_empty());
}

/// A ring of random radii round a centre, which never crosses itself.
fn star(n: core::ops::Range<usize>) -> impl Strategy<Value = Zone> {
    (
        proptest::collection::vec(100.0..500.0f64, n),
        -300.0..300.0,
        -300.0..300.0,
    )
        .prop_map(|(radii, x, y)| {
            let step = TAU / radii.len() as f64;
            let points = radii.iter().enumerate().map(|(i, r)| {
                let (s, c) = sin_cos(step * i as f64);
                (x + r * c, y + r * s)
            });
            zone(&points.collect::<Vec<_>>())
        })
}

/// Numbers that arithmetic likes least.
fn nasty() -> impl Strategy<Value = f64> {
    prop_oneof![
        proptest::sample::select(vec![
            0.0,
            -0.0,
            1.0,
            -1.0,
            1.0 + 1e-15,
            5e-324,
            1e-300,
            1e-12,
            1e-6,
            0.1,
            1e3,
            1e6,
            -1e6,
            1e6 - 1e-9,
            f64::NAN,
            f64::INFINITY,
            1e300,
        ]),
        -1e6..1e6f64,
        -1e-3..1e-3f64,
    ]
}

/// Any ring at all, on a coarse grid half of the time, so that contacts are common.
fn wild() -> impl Strategy<Value = Zone> {
    let free = proptest::collection::vec((-200.0..200.0f64, -200.0..200.0f64), 3..14);
    let grid = proptest::collection::vec((-4..4i32, -4..4i32), 3..14).prop_map(|v| {
        v.iter()
            .map(|&(x, y)| (f64::from(x) * 40.0, f64::from(y) * 40.0))
            .collect()
    });
    prop_oneof![free, grid].prop_map(|points: Vec<(f64, f64)>| zone(&points))
}

fn moved(z: &Zone, angle_rad: f64, by: (f64, f64)) -> Zone {
    let (s, c) = sin_cos(angle_rad);
    let go = |p: &Point| Point::new(c * p.x - s * p.y + by.0, s * p.x + c * p.y + by.1);
    Zone {
        outer: z.outer.iter().map(go).collect(),
        holes: z.holes.iter().map(|h| h.iter().map(go).collect()).collect(),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]
    #[test]
    fn simple_zones_are_contained_and_tight(z in star(3..24), radius_m in 0.5..200.0f64) {
        let g = grown(&[z], radius_m);
        prop_assert!(g.repairs.is_empty());
    }

    #[test]
    fn any_rings_are_grown_or_refused_with_their_place(
        zones in proptest::collection::vec(wild(), 1..4), radius_m in 0.0..100.0f64,
    ) {
        let growth = by(radius_m);
        match grow(&zones, &growth) {
            Ok(g) => if radius_m > 0.01 { check(&zones, &g, &growth) },
            Err(OffsetError::TooFewVertices { zone, .. }) => prop_assert!(zone < zones.len()),
            Err(e) => prop_assert!(false, "{} {:?}", e, zones),
        }
    }

    #[test]
    fn no_numbers_cause_a_panic(
        outer in proptest::collection::vec((nasty(), nasty()), 0..9),
        hole in proptest::collection::vec((nasty(), nasty()), 0..6),
        radius_m in prop_oneof![nasty(), 0.0..100.0],
    ) {
        let mut z = zone(&outer);
        z.holes.push(zone(&hole).outer);
        let zones = [z, zone(&SQUARE)];
        if let Ok(growth) = Growth::new(radius_m) {
            if let Ok(g) = grow(&zones, &growth) {
                prop_assert!(g.least_distance_m >= radius_m);
            }
            if let Ok(g) = grow_exact(&zones, radius_m) {
                prop_assert!(g.least_distance_m >= radius_m);
            }
        }
    }

    #[test]
    fn a_larger_radius_contains_a_smaller_one(z in star(3..16), r in 1.0..100.0f64, more in 0.1..50.0f64) {
        let zones = [z];
        let (small, large) = (grown(&zones, r), grown(&zones, r + more));
        let vertices = small.regions[0].rings().flatten();
        for p in vertices {
            // A vertex of the smaller outline may overshoot by its tangent share only.
            let d = distance_m(&zones[0], *p);
            prop_assert!(d > r + more || large.contains(*p));
        }
        prop_assert!(large.area_m2() > small.area_m2());
    }

    #[test]
    fn the_union_is_that_of_the_parts(a in star(3..12), b in star(3..12), r in 1.0..80.0f64) {
        let both = grown(&[a.clone(), b.clone()], r);
        let (a, b) = (grown(&[a], r), grown(&[b], r));
        // Compared where the outlines are known to differ by more than the overshoot.
        for region in &both.regions {
            for p in region.rings().flatten() {
                let near = |g: &Grown| g.regions.iter().flat_map(Region::rings).any(|ring| {
                    (0..ring.len()).any(|i| crate::polygon::point_to_line_m(
                        *p, ring[i], ring[(i + 1) % ring.len()]) < 1e-3)
                });
                prop_assert!(near(&a) || near(&b));
            }
        }
        prop_assert!(both.area_m2() <= a.area_m2() + b.area_m2() + 0.1);
        prop_assert!(both.area_m2() >= a.area_m2().max(b.area_m2()) - 0.1);
    }

    #[test]
    fn area_does_not_depend_on_place_and_heading(z in star(3..16), angle_rad in 0.0..6.0f64) {
        let there = moved(&z, angle_rad, (9e5, -8e5));
        let (a, b) = (grown(&[z], 30.0).area_m2(), grown(&[there], 30.0).area_m2());
        prop_assert!((a - b).abs() <= 1e-7 * a, "{a} {b}");
    }

    #[test]
    fn growing_the_union_by_nothing_changes_little(a in star(3..12), b in star(3..12)) {
        let once = grown(&[a, b], 30.0);
        let again: Vec<Zone> = once.regions.iter()
            .map(|r| Zone { outer: r.outer.clone(), holes: r.holes.clone() })
            .collect();
        let twice = grow(&again, &by(0.0)).unwrap();
        prop_assert_eq!(twice.regions.len(), once.regions.len());
        prop_assert!((twice.area_m2() - once.area_m2()).abs() < 0.05);
    }
}
