//! The laboratory: baselines and oracles that tests and measurements compare with.
//!
//! No UAV flies anything of it and no plan for a person is made by it; only tests and
//! `skein-bench` may use it.
//!
//! | module | what it holds | D2.7 |
//! |---|---|---|
//! | [`headings`] | headings at waypoints for the shortest chain, with a certified gap | 2.4.3 |
//! | [`graph`], [`tree_cover`] | min-max tree covers of weighted graphs | 3.4.2 |
//! | [`route`] | continuous Dijkstra, landmarks, cuts | 2.3.2–2.3.3 |
//! | [`wind_scan`] | a dense oracle of the fastest flight in wind | 2.4.2 |
//! | [`regions`] | other planners of lane cells: forest, MSTC, divided rings | 3.6.1–3.6.6 |
//!
//! ```
//! use skein_flight::route::mesh::Mesh;
//! use skein_flight::route::two_point::Search;
//! use skein_geometry::frame::Point;
//! use skein_lab::route::continuous::PathMap;
//!
//! let square = |low: f64, side: f64| {
//!     [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)]
//!         .map(|(x, y)| Point::new(low + x, low + y))
//! };
//! // A yard of 30 m with a house of 10 m in its middle.
//! let mesh = Mesh::from_rings(&[&square(0.0, 30.0), &square(10.0, 10.0)])?;
//! let (from, to) = (Point::new(5.0, 15.0), Point::new(25.0, 16.0));
//! let oracle_m = PathMap::new(&mesh, from).distance_m(to).unwrap();
//! assert!((Search::new(&mesh).distance_m(from, to).unwrap() - oracle_m).abs() < 1e-9);
//! # Ok::<(), skein_flight::route::mesh::MeshError>(())
//! ```

pub mod graph;
pub mod headings;
pub mod regions;
pub mod route;
pub mod tree_cover;
pub mod wind_scan;

#[cfg(test)]
mod route_tests;

#[cfg(test)]
mod tests {
    use crate::route::continuous::PathMap;
    use skein_flight::route::mesh::Mesh;
    use skein_geometry::frame::Point;
    use skein_survey::visibility::VisibilityGraph;

    fn square(x: f64, y: f64, side: f64) -> Vec<Point> {
        [(x, y), (x + side, y), (x + side, y + side), (x, y + side)]
            .map(|(x, y)| Point::new(x, y))
            .to_vec()
    }

    #[test]
    fn the_same_rings_give_the_same_numbers_and_others_do_not() {
        let rings = |east_m: f64| vec![square(0.0, 0.0, 30.0), square(east_m, 10.0, 10.0)];
        let numbers = |east_m: f64| {
            let rings = rings(east_m);
            let mesh = Mesh::from_rings(&[&rings[0], &rings[1]]).unwrap();
            let map = PathMap::new(&mesh, Point::new(1.0, 1.0));
            let graph = VisibilityGraph::of_rings((0..).zip(rings.iter().map(Vec::as_slice)));
            [
                mesh.content_hash(),
                map.content_hash(),
                graph.content_hash(),
            ]
        };
        let (here, again, there) = (numbers(10.0), numbers(10.0), numbers(10.0 + 1e-12));
        assert_eq!(here, again);
        for (k, n) in here.iter().enumerate() {
            assert!(!there.contains(n) && !here[k + 1..].contains(n));
        }
    }
}
