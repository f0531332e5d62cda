//! Tests of the decompositions: they share the free space, each the same one.

use super::super::frame::{Axes, Kind, Ring, edges};
use super::{Cell, Decomposition, decompose};
use proptest::prelude::*;
use skein_geometry::frame::Point;
use skein_geometry::math::{PI, TAU, cos, sin};

type Shape = (Vec<Point>, Kind);

fn ring(points: &[(f64, f64)]) -> Vec<Point> {
    points.iter().map(|&(x, y)| Point::new(x, y)).collect()
}

fn square(x: f64, y: f64, half: f64) -> Vec<Point> {
    ring(&[
        (x - half, y - half),
        (x + half, y - half),
        (x + half, y + half),
        (x - half, y + half),
    ])
}

fn cells(shapes: &[Shape], heading_rad: f64, kind: Decomposition) -> Vec<Cell> {
    let rings: Vec<Ring<'_>> = shapes
        .iter()
        .map(|(points, kind)| Ring {
            points,
            kind: *kind,
        })
        .collect();
    decompose(&edges(&rings, Axes::new(heading_rad)), kind)
}

fn area(cells: &[Cell]) -> f64 {
    cells.iter().map(Cell::area_m2).sum()
}

fn inside(p: Point, ring: &[Point]) -> bool {
    (0..ring.len()).fold(false, |odd, i| {
        let (a, b) = (ring[i], ring[(i + 1) % ring.len()]);
        let hit = (a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y);
        odd != hit
    })
}

fn near_border(p: Point, ring: &[Point]) -> bool {
    (0..ring.len()).any(|i| {
        let (a, b) = (ring[i], ring[(i + 1) % ring.len()]);
        skein_geometry::polygon::point_to_line_m(p, a, b) < 1e-4
    })
}

/// Each point of the free space is in one cell, any other in none.
fn check_partition(shapes: &[Shape], heading_rad: f64, kind: Decomposition) {
    let axes = Axes::new(heading_rad);
    let found = cells(shapes, heading_rad, kind);
    let rings: Vec<Vec<Point>> = found.iter().map(Cell::ring).collect();
    for i in 0..60 {
        for j in 0..60 {
            let p = Point::new(f64::from(i) * 5.03 - 151.0, f64::from(j) * 5.03 - 151.0);
            let q = axes.into(p);
            if shapes.iter().any(|(ring, _)| near_border(p, ring))
                || rings.iter().any(|ring| near_border(q, ring))
            {
                continue;
            }
            let free = shapes
                .iter()
                .all(|(ring, kind)| inside(p, ring) == (*kind == Kind::Area));
            let count = rings.iter().filter(|ring| inside(q, ring)).count();
            assert_eq!(count, usize::from(free), "{p} at heading {heading_rad}");
        }
    }
    for cell in &found {
        // The line meets the cell in one piece: slices follow each other and touch.
        for pair in cell.slices.windows(2) {
            assert!((pair[0].right - pair[1].left).abs() < 1e-12);
            let x = pair[0].right;
            let low = pair[0].floor.y_at(x).max(pair[1].floor.y_at(x));
            let high = pair[0].ceiling.y_at(x).min(pair[1].ceiling.y_at(x));
            assert!(high > low);
        }
    }
}

#[test]
fn one_hole_in_a_square_makes_four_cells_and_trapezoids_are_no_fewer() {
    let shapes = [
        (square(0.0, 0.0, 100.0), Kind::Area),
        (square(0.0, 0.0, 20.0), Kind::Zone),
    ];
    for heading in [0.0, PI / 2.0] {
        let b = cells(&shapes, heading, Decomposition::Boustrophedon);
        assert_eq!(b.len(), 4, "vertical edges are ordinary");
        assert!((area(&b) - 38_400.0).abs() < 1e-3);
    }
    let turned = cells(&shapes, 0.4, Decomposition::Boustrophedon);
    let trapezoids = cells(&shapes, 0.4, Decomposition::Trapezoidal);
    assert_eq!((turned.len(), trapezoids.len()), (4, 8));
    assert!((area(&turned) - area(&trapezoids)).abs() < 1e-3);
}

#[test]
fn degenerate_borders_are_ordinary() {
    let area_ring = (square(0.0, 0.0, 150.0), Kind::Area);
    let cases: Vec<(Vec<Shape>, f64)> = vec![
        // Holes that touch in a point, and along a side.
        (
            vec![
                (square(-20.0, -20.0, 20.0), Kind::Hole),
                (square(20.0, 20.0, 20.0), Kind::Hole),
            ],
            3_200.0,
        ),
        (
            vec![
                (square(-20.0, 0.0, 20.0), Kind::Hole),
                (square(20.0, 0.0, 20.0), Kind::Hole),
            ],
            3_200.0,
        ),
        // Holes above each other: the same x twice.
        (
            vec![
                (square(0.0, 60.0, 20.0), Kind::Hole),
                (square(0.0, -60.0, 20.0), Kind::Zone),
            ],
            3_200.0,
        ),
        // A hole that touches the border in a vertex, and one along its side.
        (
            vec![(
                ring(&[(150.0, 0.0), (110.0, 40.0), (110.0, -40.0)]),
                Kind::Hole,
            )],
            1_600.0,
        ),
        (vec![(square(130.0, 0.0, 20.0), Kind::Zone)], 1_600.0),
        // One that reaches out of the area, and one that overlaps another.
        (vec![(square(150.0, 0.0, 20.0), Kind::Zone)], 800.0),
        (
            vec![
                (square(0.0, 0.0, 20.0), Kind::Hole),
                (square(20.0, 0.0, 20.0), Kind::Zone),
            ],
            2_400.0,
        ),
    ];
    for (holes, gone) in cases {
        let shapes: Vec<Shape> = [area_ring.clone()].into_iter().chain(holes).collect();
        for heading in [0.0, PI / 2.0, PI / 4.0, 0.3, -1.1] {
            for kind in [Decomposition::Boustrophedon, Decomposition::Trapezoidal] {
                let found = cells(&shapes, heading, kind);
                assert!(
                    (area(&found) - 90_000.0 + gone).abs() < 1e-2,
                    "{gone} at {heading}: {}",
                    area(&found)
                );
                check_partition(&shapes, heading, kind);
            }
        }
    }
}

#[test]
fn an_area_that_is_all_zone_has_no_cell() {
    let shapes = [
        (square(0.0, 0.0, 100.0), Kind::Area),
        (square(0.0, 0.0, 100.0), Kind::Zone),
    ];
    for heading in [0.0, 0.7] {
        assert!(cells(&shapes, heading, Decomposition::Boustrophedon).is_empty());
    }
}

fn star(x: f64, y: f64, radii: &[f64], turn: f64) -> Vec<Point> {
    let n = radii.len();
    (0..n)
        .map(|i| {
            let a = TAU * i as f64 / n as f64 + turn;
            Point::new(x + radii[i] * cos(a), y + radii[i] * sin(a))
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    #[test]
    fn cells_share_the_free_space_in_any_direction(
        border in prop::collection::vec(60.0f64..150.0, 5..12),
        holes in prop::collection::vec(
            (-80.0f64..80.0, -80.0f64..80.0, prop::collection::vec(5.0f64..40.0, 5..8), 0.0f64..6.0), 0..6),
        heading in -1.6f64..1.6,
        (dx, dy) in (-900.0f64..900.0, -900.0f64..900.0),
    ) {
        let mut shapes = vec![(star(0.0, 0.0, &border, 0.0), Kind::Area)];
        // Holes may overlap each other and the border.
        shapes.extend(holes.iter().map(|(x, y, r, turn)| (star(*x, *y, r, *turn), Kind::Hole)));
        check_partition(&shapes, heading, Decomposition::Boustrophedon);
        check_partition(&shapes, heading, Decomposition::Trapezoidal);
        let b = cells(&shapes, heading, Decomposition::Boustrophedon);
        let t = cells(&shapes, heading, Decomposition::Trapezoidal);
        prop_assert!(b.len() <= t.len());
        prop_assert!((area(&b) - area(&t)).abs() < 1e-3);
        let other = cells(&shapes, heading + 1.0, Decomposition::Boustrophedon);
        prop_assert!((area(&b) - area(&other)).abs() < 1e-2, "{} {}", area(&b), area(&other));
        // Moved, and turned together with the lanes, the cells are the same ones.
        let moved: Vec<Shape> = shapes
            .iter()
            .map(|(r, k)| (r.iter().map(|p| {
                let q = Axes::new(0.7).into(*p);
                Point::new(q.x + dx, q.y + dy)
            }).collect(), *k))
            .collect();
        let again = cells(&moved, heading + PI / 2.0 - 0.7, Decomposition::Boustrophedon);
        prop_assert_eq!(b.len(), again.len());
        prop_assert!((area(&b) - area(&again)).abs() < 1e-2);
    }
}
