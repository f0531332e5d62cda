//! All shortest paths from one source: continuous Dijkstra (D2.7 §2.3.3).
//!
//! A wavefront spreads over the mesh in windows: stretches of a side that one
//! root sees and serves best. Windows are carried on in the order of their
//! distance; where two meet on a side, each keeps what it serves better, and the
//! boundary is the point of equal distance. What is left at the end is a map: a
//! distance query finds the cell and takes the best of the few roots that reach
//! into it.
//!
//! The structure is that of Mitchell, Mount and Papadimitriou (1987,
//! <https://doi.org/10.1137/0216045>), in the plane with obstacles. Hershberger and Suri
//! (1999, <https://doi.org/10.1137/S0097539795289604>) bound the worst case by
//! O(n log n); here it is quadratic in theory, `docs/continuous-dijkstra.md` has
//! measured counts. Decisions whether a vertex is seen are exact; boundaries
//! between windows are rounded, and windows overlap a little there, so that
//! rounding loses nothing.

mod envelope;
mod front;

use front::Front;
use skein_flight::route::mesh::{Mesh, NONE};
use skein_flight::route::visibility_step::{self, SOURCE};
use skein_geometry::frame::Point;
use skein_geometry::hash::Fingerprint;

/// The shortest way to a vertex so far.
#[derive(Clone, Copy, Debug)]
struct Label {
    length_m: f64,
    before: u32,
}

/// One root that reaches into a cell, through a stretch of one of its sides.
#[derive(Clone, Copy, Debug)]
struct Reach {
    at: Point,
    root_m: f64,
    right: Point,
    left: Point,
    root: u32,
    /// The root is in the cell itself and sees all of it.
    inside: bool,
}

/// How much work a map was: what the worst-case bounds are about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effort {
    /// Windows that were better than the others somewhere when they were found.
    pub windows: usize,
    /// Windows that are part of the map.
    pub kept: usize,
    /// The most windows that any side ended with.
    pub most_on_a_side: usize,
}

/// Distances and shortest paths from one source to every point of a mesh.
#[derive(Clone, Debug)]
pub struct PathMap<'m> {
    mesh: &'m Mesh,
    source: Point,
    labels: Vec<Label>,
    /// Where each cell's roots begin; one entry more than cells.
    starts: Vec<u32>,
    reaches: Vec<Reach>,
    effort: Effort,
}

impl<'m> PathMap<'m> {
    /// Spreads the wavefront from `source`. From a source outside the mesh
    /// nothing can be reached.
    ///
    /// # Complexity
    /// O(w log w) in the number of windows w.
    #[must_use]
    pub fn new(mesh: &'m Mesh, source: Point) -> Self {
        let mut front = Front::new(mesh, source);
        let mut cells = Vec::new();
        mesh.cells_at(source, &mut cells);
        for &cell in &cells {
            visibility_step::look_from_start(&mut front, mesh, cell);
        }
        front.spread();
        front.into_map(&cells)
    }

    /// Where all paths begin.
    #[must_use]
    pub fn source(&self) -> Point {
        self.source
    }

    /// The same number for the same map, on every machine: processes that built their
    /// own compare it.
    #[must_use]
    pub fn content_hash(&self) -> u64 {
        let start = Fingerprint::of("map")
            .with(self.mesh.content_hash())
            .with_point(self.source);
        let add = |c: Fingerprint, l: &Label| c.with_number(l.length_m).with(u64::from(l.before));
        self.labels.iter().fold(start, add).hash()
    }

    /// How much work the map was.
    #[must_use]
    pub fn effort(&self) -> Effort {
        self.effort
    }

    /// Length of the shortest path to `to`, metres; none if it cannot be reached.
    #[must_use]
    pub fn distance_m(&self, to: Point) -> Option<f64> {
        self.best(to).map(|(length_m, _)| length_m)
    }

    /// The shortest path from the source to `to`, both ends included.
    #[must_use]
    pub fn path(&self, to: Point) -> Option<Vec<Point>> {
        let (_, mut root) = self.best(to)?;
        let mut path = vec![to];
        while root != SOURCE {
            path.push(self.mesh.vertices[root as usize].at);
            root = self.labels[root as usize].before;
        }
        path.push(self.source);
        path.reverse();
        path.dedup_by(|b, a| (*b - *a).norm_squared() <= 0.0);
        if path.len() == 1 {
            path.push(to);
        }
        Some(path)
    }

    /// Length to each vertex, metres, infinite where none leads.
    pub fn vertex_length_m(&self, vertex: usize) -> f64 {
        self.labels[vertex].length_m
    }

    /// Where a vertex of the mesh is.
    pub fn vertex(&self, vertex: usize) -> Point {
        self.mesh.vertices[vertex].at
    }

    /// The best root for a point: the least over all that reach into its cells.
    fn best(&self, to: Point) -> Option<(f64, u32)> {
        let mut best = Best::default();
        self.mesh.for_cells_at(to, |cell| {
            let first = self.starts[cell as usize] as usize;
            let last = self.starts[cell as usize + 1] as usize;
            for reach in &self.reaches[first..last] {
                best.improve(reach, to);
            }
        });
        best.answer()
    }
}

/// The best root for a point so far: one that sees it, and one that sees it but for
/// the rounding of its window's end.
#[derive(Clone, Copy, Debug)]
struct Best {
    length_m: f64,
    root: u32,
    round_m: f64,
    round_root: u32,
}

impl Default for Best {
    fn default() -> Self {
        Self {
            length_m: f64::INFINITY,
            root: NONE,
            round_m: f64::INFINITY,
            round_root: NONE,
        }
    }
}

impl Best {
    #[inline]
    fn improve(&mut self, reach: &Reach, to: Point) {
        let d = to - reach.at;
        let straight_m = reach.root_m + d.norm();
        if straight_m >= self.length_m {
            return;
        }
        if !reach.inside {
            let past_right = (reach.right - reach.at).perp(&d) < 0.0;
            let past_left = (reach.left - reach.at).perp(&d) > 0.0;
            if past_right || past_left {
                // Round the end of the stretch: never shorter than the truth.
                let x = if past_right { reach.right } else { reach.left };
                let round_m = reach.root_m + (x - reach.at).norm() + (to - x).norm();
                if round_m < self.round_m {
                    (self.round_m, self.round_root) = (round_m, reach.root);
                }
                return;
            }
        }
        (self.length_m, self.root) = (straight_m, reach.root);
    }

    /// The way round an end counts only in the gap that rounding leaves between two
    /// windows; elsewhere a root that sees the point is as good, up to rounding.
    fn answer(self) -> Option<(f64, u32)> {
        const MARGIN: f64 = 1e-12;
        if self.round_m < self.length_m * (1.0 - MARGIN) {
            Some((self.round_m, self.round_root))
        } else {
            (self.root != NONE).then_some((self.length_m, self.root))
        }
    }
}

impl Reach {
    fn inside(at: Point, root_m: f64, root: u32) -> Self {
        Self {
            at,
            root_m,
            right: at,
            left: at,
            root,
            inside: true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::route::degenerate_maps::{Rings, crowded, mesh_of, square};
    use crate::route::landmarks::Landmarks;
    use proptest::prelude::*;
    use skein_flight::route::two_point::Search;

    fn compare(rings: &Rings, source: Point, goals: &[Point]) -> Result<(), TestCaseError> {
        let mesh = mesh_of(rings);
        let map = PathMap::new(&mesh, source);
        let mut search = Search::new(&mesh);
        let landmarks = Landmarks::new(&mesh);
        let mut guided = Search::with_landmarks(&mesh, &landmarks);
        for &goal in goals {
            let (near, far) = (map.distance_m(goal), search.distance_m(source, goal));
            let sooner = guided.distance_m(source, goal);
            prop_assert_eq!(sooner.is_some(), far.is_some());
            prop_assert!((sooner.unwrap_or(0.0) - far.unwrap_or(0.0)).abs() <= 1e-9);
            prop_assert_eq!(near.is_some(), far.is_some(), "{:?}", goal);
            if let (Some(near), Some(far)) = (near, far) {
                prop_assert!((near - far).abs() <= 1e-9, "{near} {far} to {goal:?}");
                let path = map.path(goal).unwrap();
                let length_m: f64 = path.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
                prop_assert!((length_m - far).abs() <= 1e-9, "{path:?}");
            }
        }
        Ok(())
    }

    #[test]
    fn two_ways_round_meet_behind_an_obstacle() {
        let mesh = mesh_of(&vec![square(0.0, 0.0, 30.0), square(10.0, 10.0, 10.0)]);
        let map = PathMap::new(&mesh, Point::new(5.0, 15.0));
        let behind = |y: f64| map.distance_m(Point::new(25.0, y)).unwrap();
        assert!((behind(15.1) - behind(14.9)).abs() < 1e-9);
        assert!(behind(15.1) < behind(15.0));
        assert!(map.distance_m(Point::new(15.0, 15.0)).is_none());
        assert!(map.distance_m(map.source()).unwrap().abs() < 1e-12);
        assert_eq!(map.path(Point::new(25.0, 16.0)).unwrap().len(), 4);
    }

    #[test]
    fn from_outside_nothing_is_reached() {
        let mesh = mesh_of(&vec![square(0.0, 0.0, 30.0), square(10.0, 10.0, 10.0)]);
        let map = PathMap::new(&mesh, Point::new(15.0, 15.0));
        assert!(map.distance_m(Point::new(5.0, 5.0)).is_none());
        assert!(map.path(Point::new(f64::NAN, 5.0)).is_none());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn a_map_agrees_with_two_point_queries_where_everything_touches(
            cells in prop::collection::vec(prop::bool::weighted(0.4), 144),
            far in prop::bool::ANY,
            ends in prop::collection::vec((0u16..=240, 0u16..=240), 40),
        ) {
            prop_assume!(cells.iter().any(|full| !full));
            let o = if far { 1e6 } else { 0.0 };
            let points: Vec<Point> = ends
                .iter()
                .map(|&(x, y)| Point::new(o + f64::from(x) / 2.0, o + f64::from(y) / 2.0))
                .collect();
            compare(&crowded(&cells, 12, o), points[0], &points[1..])?;
        }

        #[test]
        fn a_map_agrees_with_two_point_queries_among_odd_polygons(
            radii in prop::collection::vec(0.05f64..0.49, 36 * 7),
            ends in prop::collection::vec((0.0f64..6.0, 0.0f64..6.0), 40),
        ) {
            // Stars in a grid of 6 by 6 squares: no two touch, nothing is regular.
            let mut rings = vec![square(0.0, 0.0, 6.0)];
            for (i, star) in radii.chunks(7).enumerate() {
                let (x, y) = ((i % 6) as f64 + 0.5, (i / 6) as f64 + 0.5);
                let spoke = |k: usize| {
                    let (s, c) = skein_geometry::math::sin_cos(skein_geometry::math::TAU * k as f64 / 7.0);
                    Point::new(x + star[k] * c, y + star[k] * s)
                };
                rings.push((0..7).map(spoke).collect());
            }
            let points: Vec<Point> = ends.iter().map(|&(x, y)| Point::new(x, y)).collect();
            let free = points.iter().copied().find(|&p| mesh_of(&rings).contains(p));
            prop_assume!(free.is_some());
            compare(&rings, free.unwrap(), &points)?;
        }
    }
}
