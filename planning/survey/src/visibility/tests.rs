//! The graph against brute force: every pair of vertices tested by cutting the
//! line at all edges, and Dijkstra over all of them.

use super::*;
use proptest::prelude::*;
use skein_flight::route::mesh::Mesh;
use skein_flight::route::two_point::Search;
use skein_geometry::math::atan2;
use skein_geometry::offset::{Growth, Zone, grow};
use skein_geometry::polygon::point_to_line_m;

fn polygon(points: &[(i32, i32)]) -> Option<Polygon> {
    let ring = points
        .iter()
        .map(|&(x, y)| Point::new(f64::from(x), f64::from(y)));
    Polygon::new(ring.collect()).ok()
}

fn rectangle(x0: i32, y0: i32, x1: i32, y1: i32) -> Polygon {
    polygon(&[(x0, y0), (x1, y0), (x1, y1), (x0, y1)]).unwrap()
}

fn point(x: i32, y: i32) -> Point {
    Point::new(f64::from(x), f64::from(y))
}

/// Depth below which a point of the integer grid's lines counts as on the border.
const SKIN: f64 = 1e-7;

fn strictly_inside(o: &Polygon, p: Point) -> bool {
    o.contains(p) && o.edges().all(|(a, b)| point_to_line_m(p, a, b) > SKIN)
}

/// Whether a line meets no open interior: it is cut at every edge, and the middle of
/// each part is looked at.
fn free(obstacles: &[Polygon], p: Point, q: Point) -> bool {
    obstacles.iter().all(|o| {
        let d = q - p;
        let mut cuts = vec![0.0, 1.0];
        for (a, b) in o.edges() {
            let e = b - a;
            let across = d.perp(&e);
            if across.abs() > 1e-12 {
                cuts.push((a - p).perp(&e) / across);
            } else if d.norm_squared() > 0.0 {
                cuts.extend([a, b].map(|v| (v - p).dot(&d) / d.norm_squared()));
            }
        }
        cuts.retain(|t| (0.0..=1.0).contains(t));
        cuts.sort_by(f64::total_cmp);
        cuts.windows(2)
            .all(|w| !strictly_inside(o, p + d * ((w[0] + w[1]) / 2.0)))
    })
}

/// The shortest length by brute force.
fn oracle(obstacles: &[Polygon], from: Point, to: Point) -> Option<f64> {
    let inside = |p: Point| obstacles.iter().any(|o| strictly_inside(o, p));
    if inside(from) || inside(to) {
        return None;
    }
    let mut nodes = vec![from, to];
    nodes.extend(obstacles.iter().flat_map(|o| o.vertices().iter().copied()));
    nodes.retain(|&p| !inside(p));
    let mut best = vec![f64::INFINITY; nodes.len()];
    let mut done = vec![false; nodes.len()];
    best[0] = 0.0;
    loop {
        let open = (0..nodes.len()).filter(|&i| !done[i] && best[i].is_finite());
        let i = open.min_by(|&i, &j| best[i].total_cmp(&best[j]))?;
        if i == 1 {
            return Some(best[1]);
        }
        done[i] = true;
        for j in 0..nodes.len() {
            if !done[j] && free(obstacles, nodes[i], nodes[j]) {
                best[j] = best[j].min(best[i] + (nodes[j] - nodes[i]).norm());
            }
        }
    }
}

/// A ring round the middle of its box, of any convexity, on the integer grid.
fn ring() -> impl Strategy<Value = Option<Polygon>> {
    let spread = prop::collection::vec((0..7i32, 0..7i32), 3..8);
    (0..18i32, 0..18i32, spread).prop_map(|(x, y, mut points)| {
        let angle = |p: &(i32, i32)| atan2(f64::from(p.1) - 3.1, f64::from(p.0) - 2.9);
        points.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
        for p in &mut points {
            *p = (p.0 + x, p.1 + y);
        }
        polygon(&points)
    })
}

fn map(most: usize) -> impl Strategy<Value = Vec<Polygon>> {
    prop::collection::vec(ring(), 0..most)
        .prop_map(|rings| rings.into_iter().flatten().collect::<Vec<_>>())
}

fn place() -> impl Strategy<Value = Point> {
    (0..25i32, 0..25i32).prop_map(|(x, y)| point(x, y))
}

/// Whether each bend wraps a convex vertex of an obstacle on the inner side.
fn is_taut(obstacles: &[Polygon], path: &TautPath) -> bool {
    path.points.windows(3).all(|w| {
        let turn = side(w[0], w[1], w[2]);
        obstacles.iter().any(|o| {
            let v = o.vertices();
            (0..v.len()).any(|i| {
                let (before, after) = (v[(i + v.len() - 1) % v.len()], v[(i + 1) % v.len()]);
                let inner =
                    |u: Point| side(w[0], w[1], u) * turn >= 0 && side(w[1], w[2], u) * turn >= 0;
                same(v[i], w[1])
                    && side(before, v[i], after) > 0
                    && turn != 0
                    && inner(before)
                    && inner(after)
            })
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    #[test]
    fn the_graph_agrees_with_brute_force(obstacles in map(6), from in place(), to in place()) {
        let graph = VisibilityGraph::new(&obstacles);
        let found = graph.shortest(from, to);
        let want = oracle(&obstacles, from, to);
        prop_assert_eq!(found.is_some(), want.is_some(), "{:?} {:?}", found, want);
        if let (Some(path), Some(want)) = (found, want) {
            prop_assert!((path.length_m - want).abs() < 1e-9, "{path:?} {want}");
            let walked: f64 = path.points.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
            prop_assert!((walked - path.length_m).abs() < 1e-9);
            prop_assert!(path.points.windows(2).all(|w| free(&obstacles, w[0], w[1])));
            prop_assert!(is_taut(&obstacles, &path), "{path:?}");
            prop_assert!(path.length_m >= (to - from).norm() - 1e-9);
            let back = graph.shortest(to, from).unwrap();
            prop_assert!((back.length_m - path.length_m).abs() < 1e-9);
        }
    }

    #[test]
    fn the_graph_agrees_with_the_mesh(
        obstacles in map(8), radius_m in 0.05f64..2.0, from in place(), to in place(),
    ) {
        let drawn: Vec<Zone> = obstacles.iter().map(Zone::from).collect();
        let regions = grow(&drawn, &Growth::new(radius_m).unwrap()).unwrap().regions;
        let graph = VisibilityGraph::round(&regions).shortest(from, to);
        let border = rectangle(-100, -100, 150, 150);
        let rings: Vec<&[Point]> = std::iter::once(border.vertices())
            .chain(regions.iter().flat_map(Region::rings))
            .collect();
        let mesh = Mesh::from_rings(&rings).unwrap();
        let meshed = Search::new(&mesh).distance_m(from, to);
        let equal = match (&graph, meshed) {
            (Some(a), Some(b)) => (a.length_m - b).abs() < 1e-9,
            (a, b) => a.is_none() && b.is_none(),
        };
        prop_assert!(equal, "{graph:?} {meshed:?}");
    }

    #[test]
    fn moved_and_turned_maps_have_the_same_lengths(
        obstacles in map(6), from in place(), to in place(), east in -9e5f64..9e5, north in -9e5f64..9e5,
    ) {
        let shift = skein_geometry::frame::Vector::new(east.round(), north.round());
        let moves: [&dyn Fn(Point) -> Point; 3] = [
            &|p| p + shift,
            &|p| Point::new(-p.y, p.x),
            &|p| Point::new(p.x, -p.y),
        ];
        let before = VisibilityGraph::new(&obstacles).shortest(from, to).map(|p| p.length_m);
        for to_there in moves {
            let there: Vec<Polygon> = obstacles
                .iter()
                .map(|o| {
                    let mut ring: Vec<Point> = o.vertices().iter().map(|&p| to_there(p)).collect();
                    ring.rotate_left(1);
                    Polygon::new(ring).unwrap()
                })
                .collect();
            let after = VisibilityGraph::new(&there)
                .shortest(to_there(from), to_there(to))
                .map(|p| p.length_m);
            let equal = match (before, after) {
                (Some(a), Some(b)) => (a - b).abs() < 1e-9,
                (a, b) => a.is_none() && b.is_none(),
            };
            prop_assert!(equal, "{before:?} {after:?}");
        }
    }

    #[test]
    fn lengths_are_a_metric_and_grow_with_obstacles(
        mut obstacles in map(8), a in place(), b in place(), c in place(),
    ) {
        let length = |graph: &VisibilityGraph, p, q| {
            graph.shortest(p, q).map_or(f64::INFINITY, |p| p.length_m)
        };
        let graph = VisibilityGraph::new(&obstacles);
        prop_assert!(length(&graph, a, c) <= length(&graph, a, b) + length(&graph, b, c) + 1e-9);
        let most = length(&graph, a, c);
        obstacles.pop();
        let fewer = VisibilityGraph::new(&obstacles);
        prop_assert!(length(&fewer, a, c) <= most + 1e-9);
    }
}

#[test]
fn walls_all_around_leave_no_way() {
    let walls = [
        rectangle(0, 0, 10, 2),
        rectangle(8, 0, 10, 10),
        rectangle(0, 8, 10, 10),
        rectangle(0, 0, 2, 10),
    ];
    let graph = VisibilityGraph::new(&walls);
    assert!(graph.shortest(point(5, 5), point(20, 5)).is_none());
    assert!(graph.shortest(point(3, 3), point(7, 7)).is_some());
    // From inside a wall there is none either, from its border there is.
    assert!(graph.shortest(point(1, 5), point(20, 5)).is_none());
    assert!(graph.shortest(point(10, 5), point(20, 5)).is_some());
    // One wall less, and the way leads out round its neighbours' corners.
    let graph = VisibilityGraph::new(&walls[..3]);
    let path = graph.shortest(point(5, 5), point(20, 5)).unwrap();
    assert_eq!(path.points.len(), 5, "{path:?}");
    assert!(is_taut(&walls, &path));
}

#[test]
fn a_hole_is_a_country_of_its_own() {
    let outer: Vec<Point> = rectangle(0, 0, 10, 10).vertices().to_vec();
    let mut hole: Vec<Point> = rectangle(3, 3, 7, 7).vertices().to_vec();
    hole.reverse();
    let rings = [(0, outer.as_slice()), (0, hole.as_slice())];
    let graph = VisibilityGraph::of_rings(rings.into_iter());
    assert!(graph.shortest(point(4, 4), point(6, 5)).is_some());
    assert!(graph.shortest(point(4, 4), point(12, 5)).is_none());
    assert!(graph.shortest(point(1, 1), point(12, 5)).is_none());
    assert!(graph.shortest(point(3, 3), point(7, 7)).is_some());
}

#[test]
fn ends_that_are_no_places_have_no_path() {
    let graph = VisibilityGraph::new(&[rectangle(0, 0, 1, 1)]);
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        assert!(graph.shortest(Point::new(bad, 0.0), point(3, 3)).is_none());
        assert!(graph.shortest(point(3, 3), Point::new(0.0, bad)).is_none());
    }
    let here = graph.shortest(point(3, 3), point(3, 3)).unwrap();
    assert!(here.points.len() == 1 && here.length_m < 1e-12);
    let empty = VisibilityGraph::new(&[]);
    assert_eq!(
        empty
            .shortest(point(0, 0), point(3, 4))
            .unwrap()
            .points
            .len(),
        2
    );
}
