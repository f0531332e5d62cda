//! What must hold for lengths of paths whatever the map looks like: they do not depend
//! on where a map lies, how it is turned or in which order it is written down, and a
//! zone less never makes a path longer.

use super::degenerate_maps::{Rings, mesh_of, square};
use super::mesh::Mesh;
use super::two_point::Search;
use proptest::prelude::*;
use skein_geometry::frame::Point;
use skein_geometry::math::{TAU, sin_cos};

/// Stars in a grid of 5 by 5 squares of 10 m: no two touch, nothing is regular.
fn stars(radii: &[f64]) -> Rings {
    let mut rings = vec![square(0.0, 0.0, 50.0)];
    for (i, star) in radii.chunks(7).enumerate() {
        let (x, y) = ((i % 5) as f64 * 10.0 + 5.0, (i / 5) as f64 * 10.0 + 5.0);
        let spoke = |k: usize| {
            let (s, c) = sin_cos(TAU * k as f64 / 7.0);
            Point::new(x + star[k] * c, y + star[k] * s)
        };
        rings.push((0..7).map(spoke).collect());
    }
    rings
}

fn radii() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(0.5f64..4.9, 25 * 7)
}

fn ends() -> impl Strategy<Value = Vec<Point>> {
    let place = (0.0f64..50.0, 0.0f64..50.0).prop_map(|(x, y)| Point::new(x, y));
    prop::collection::vec(place, 5)
}

/// Lengths between all pairs, NaN where there is no path.
fn lengths(mesh: &Mesh, ends: &[Point]) -> Vec<f64> {
    let mut search = Search::new(mesh);
    let pairs = ends.iter().flat_map(|&a| ends.iter().map(move |&b| (a, b)));
    pairs
        .map(|(a, b)| search.distance_m(a, b).unwrap_or(f64::NAN))
        .collect()
}

/// Equal to within `slack_m`. A turned or moved end may fall on the other side of an
/// edge by rounding; these ends are nowhere near one.
fn check_equal(a: &[f64], b: &[f64], slack_m: f64) -> Result<(), TestCaseError> {
    for (a, b) in a.iter().zip(b) {
        prop_assert_eq!(a.is_nan(), b.is_nan());
        prop_assert!(a.is_nan() || (a - b).abs() < slack_m, "{} {}", a, b);
    }
    Ok(())
}

fn moved(rings: &Rings, to_there: impl Fn(Point) -> Point) -> Rings {
    rings
        .iter()
        .map(|ring| ring.iter().map(|&p| to_there(p)).collect())
        .collect()
}

/// Small whole numbers, so that rings touch, and what no map has.
fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        20 => (-6i8..6).prop_map(f64::from),
        4 => -6.0f64..6.0,
        1 => prop::sample::select(vec![
            1e8, -1e8, 1e-30, -1e-31, -0.0, 1e9, f64::NAN, f64::INFINITY, f64::MIN_POSITIVE,
        ]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn lengths_do_not_depend_on_where_a_map_lies_or_how_it_is_turned(
        radii in radii(), ends in ends(), angle_rad in 0.0..TAU,
    ) {
        let rings = stars(&radii);
        let here = lengths(&mesh_of(&rings), &ends);
        let (s, c) = sin_cos(angle_rad);
        let turned = |p: Point| Point::new(c * p.x - s * p.y, s * p.x + c * p.y);
        let there: Vec<Point> = ends.iter().map(|&p| turned(p)).collect();
        check_equal(&here, &lengths(&mesh_of(&moved(&rings, turned)), &there), 1e-9)?;
        // A million metres away a coordinate is rounded to 1e-10 m.
        let far = |p: Point| Point::new(p.x + 1e6, p.y - 1e6);
        let there: Vec<Point> = ends.iter().map(|&p| far(p)).collect();
        check_equal(&here, &lengths(&mesh_of(&moved(&rings, far)), &there), 1e-7)?;
    }

    #[test]
    fn lengths_do_not_depend_on_the_order_in_which_a_map_is_written(
        radii in radii(), ends in ends(), by in 0usize..7, start in 0usize..26,
    ) {
        let mut rings = stars(&radii);
        let here = lengths(&mesh_of(&rings), &ends);
        for (i, ring) in rings.iter_mut().enumerate() {
            let n = ring.len();
            ring.rotate_left(by % n);
            if i % 2 == 0 {
                ring.reverse();
            }
        }
        rings.rotate_left(start);
        check_equal(&here, &lengths(&mesh_of(&rings), &ends), 1e-9)?;
    }

    #[test]
    fn a_zone_less_never_makes_a_path_longer(
        radii in radii(), ends in ends(), which in 1usize..26,
    ) {
        let mut rings = stars(&radii);
        let mesh = mesh_of(&rings);
        let before = lengths(&mesh, &ends);
        let gone = rings.remove(which);
        let after = lengths(&mesh_of(&rings), &ends);
        for (before, after) in before.iter().zip(&after) {
            prop_assert!(before.is_nan() || *after <= before + 1e-9, "{before} {after}");
        }
        // The repaired mesh is as good as the new one.
        let repaired = mesh.with_ring_changed(&gone).unwrap();
        check_equal(&after, &lengths(&repaired, &ends), 1e-9)?;
        let again = repaired.with_ring_changed(&gone).unwrap();
        check_equal(&before, &lengths(&again, &ends), 1e-9)?;
    }

    /// Whatever the rings, there is a mesh or an error, and what a mesh answers holds.
    #[test]
    fn no_ring_is_too_odd_for_an_answer(
        rings in prop::collection::vec(prop::collection::vec((coordinate(), coordinate()), 0..8), 0..5),
        change in prop::collection::vec((coordinate(), coordinate()), 0..6),
        ends in prop::collection::vec((coordinate(), coordinate()), 2),
    ) {
        let points = |ring: &Vec<(f64, f64)>| -> Vec<Point> {
            ring.iter().map(|&(x, y)| Point::new(x, y)).collect()
        };
        let rings: Rings = rings.iter().map(points).collect();
        let slices: Vec<&[Point]> = rings.iter().map(Vec::as_slice).collect();
        if let Ok(mesh) = Mesh::from_rings(&slices) {
            let ends = points(&ends);
            if let Some(length_m) = Search::new(&mesh).distance_m(ends[0], ends[1]) {
                prop_assert!(length_m >= (ends[1] - ends[0]).norm() * (1.0 - 1e-9));
            }
            if let Ok(changed) = mesh.with_ring_changed(&points(&change)) {
                prop_assert!(changed.n_cells() > 0);
            }
        }
    }
}
