//! All shortest paths from one source: continuous Dijkstra (D2.7 §2.3.3).
//!
//! A wavefront spreads over the mesh in windows: stretches of a side that one
//! root sees and serves best. Windows are carried on in the order of their
//! distance; where two meet on a side, each keeps what it serves better, and the
//! boundary is the point of equal distance. What is left at the end is a map: a
//! distance query finds the cell and takes the best of the few roots that reach
//! into it.
//!
//! The structure is that of Mitchell, Mount and Papadimitriou (1987), in the
//! plane with obstacles. Hershberger and Suri (1999) bound the worst case by
//! O(n log n); here it is quadratic in theory, `docs/continuous-dijkstra.md` has
//! measured counts. Decisions whether a vertex is seen are exact; boundaries
//! between windows are rounded, and windows overlap a little there, so that
//! rounding loses nothing.

mod envelope;

use super::mesh::{Mesh, NONE};
use super::sight::{self, Ray, SOURCE, View, Watcher};
use crate::frame::Point;
use envelope::{Run, Runs, Wave};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A bound of sight that is the straight continuation of the way to the root.
const STRAIGHT_ON: u32 = NONE - 1;

/// Marks a vertex among the indices of the queue; windows have the bit clear.
const IS_VERTEX: u32 = 1 << 31;

/// How far a window that lost a part looks into that part, as a share of the
/// side: well above rounding, well below anything that costs time.
const OVERLAP: f64 = 1e-7;

/// A ray that bounds a sight.
#[derive(Clone, Copy, Debug)]
struct Bound {
    /// The vertex it runs through, [`STRAIGHT_ON`], or [`NONE`] for a point.
    vertex: u32,
    /// That vertex or point.
    at: Point,
}

/// A stretch of a side, and the root that looks through it.
#[derive(Clone, Copy, Debug)]
struct Window {
    /// The side, seen from the cell that is looked into.
    edge: u32,
    root: u32,
    /// The next window on the same side, from its first to its second end.
    next: u32,
    state: State,
    left: Bound,
    right: Bound,
    wave: Wave,
    run: Run,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Waiting,
    Done,
    /// Lost to others everywhere.
    Dead,
}

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
            sight::look_from_start(&mut front, mesh, cell);
        }
        front.spread();
        front.into_map(&cells)
    }

    /// Where all paths begin.
    #[must_use]
    pub fn source(&self) -> Point {
        self.source
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

/// The wavefront while it spreads.
struct Front<'m> {
    mesh: &'m Mesh,
    source: Point,
    labels: Vec<Label>,
    windows: Vec<Window>,
    /// The first window on each side, under the smaller of its two half-edges.
    heads: Vec<u32>,
    queue: BinaryHeap<(Reverse<u64>, u32)>,
    /// Length to the root that is looking, and to what it looks through.
    root_m: f64,
    bound_m: f64,
    chain: Vec<u32>,
    runs: Runs,
}

impl<'m> Front<'m> {
    fn new(mesh: &'m Mesh, source: Point) -> Self {
        let unknown = Label {
            length_m: f64::INFINITY,
            before: NONE,
        };
        Self {
            mesh,
            source,
            labels: vec![unknown; mesh.vertices.len()],
            windows: Vec::with_capacity(mesh.edges.len()),
            heads: vec![NONE; mesh.edges.len()],
            queue: BinaryHeap::new(),
            root_m: 0.0,
            bound_m: 0.0,
            chain: Vec::new(),
            runs: Runs::default(),
        }
    }

    fn spread(&mut self) {
        let mesh = self.mesh;
        while let Some((Reverse(key), index)) = self.queue.pop() {
            self.bound_m = f64::from_bits(key);
            if index & IS_VERTEX != 0 {
                let vertex = index & !IS_VERTEX;
                self.root_m = self.labels[vertex as usize].length_m;
                if self.root_m >= self.bound_m {
                    sight::look_round(self, mesh, vertex);
                }
                continue;
            }
            let w = &mut self.windows[index as usize];
            if w.state != State::Waiting {
                continue;
            }
            w.state = State::Done;
            self.root_m = w.wave.root_m;
            let view = View {
                root: w.root,
                edge: w.edge,
                left: w.left,
                right: w.right,
            };
            sight::look_through(self, mesh, view);
        }
    }

    fn push(&mut self, bound_m: f64, index: u32) {
        let bound_m = bound_m.max(self.bound_m);
        self.queue.push((Reverse(bound_m.to_bits()), index));
    }

    /// Puts a window among the others on its side; each keeps what it serves better.
    fn place(&mut self, new: Window, side: usize) {
        self.chain.clear();
        let mut index = self.heads[side];
        while index != NONE {
            self.chain.push(index);
            index = self.windows[index as usize].next;
        }
        self.runs.new.clear();
        let mut at = new.run.from;
        let mut changed = false;
        for i in 0..self.chain.len() {
            let index = self.chain[i];
            let old = &self.windows[index as usize];
            let shared = new.run.with(old.run);
            if shared.is_empty() {
                continue;
            }
            if at < shared.from {
                Runs::add(&mut self.runs.new, at, shared.from);
            }
            at = shared.to;
            if self.runs.divide(&new.wave, &old.wave, old.run, shared) {
                changed = true;
                self.keep_runs(index);
            }
        }
        if at < new.run.to {
            Runs::add(&mut self.runs.new, at, new.run.to);
        }
        if self.runs.new.is_empty() && !changed {
            return;
        }
        for i in 0..self.runs.new.len() {
            let run = self.runs.new[i];
            self.chain.push(self.windows.len() as u32);
            let piece = self.cut(new, run);
            self.enqueue(piece);
        }
        self.relink(side);
    }

    /// Leaves an old window what it kept; further pieces become windows of their own.
    fn keep_runs(&mut self, index: u32) {
        let old = self.windows[index as usize];
        let Some(&first) = self.runs.old.first() else {
            self.windows[index as usize].state = State::Dead;
            return;
        };
        self.windows[index as usize] = self.cut(old, first);
        for i in 1..self.runs.old.len() {
            let piece = self.cut(old, self.runs.old[i]);
            self.chain.push(self.windows.len() as u32);
            if piece.state == State::Waiting {
                self.enqueue(piece);
            } else {
                self.windows.push(piece);
            }
        }
    }

    fn enqueue(&mut self, window: Window) {
        self.push(window.wave.least_m(window.run), self.windows.len() as u32);
        self.windows.push(window);
    }

    /// A window reduced to a part of its stretch.
    fn cut(&self, mut window: Window, run: Run) -> Window {
        let e = &self.mesh.edges[window.edge as usize];
        let (side, forward) = (window.edge.min(e.twin), window.edge < e.twin);
        let a = self.mesh.edges[side as usize].origin;
        let b = self.mesh.edges[self.mesh.next(side) as usize].origin;
        let length_m = (b - a).norm();
        let point = |t: f64| Bound {
            vertex: NONE,
            at: a + (b - a) * (t / length_m),
        };
        if run.from > window.run.from {
            let t = (run.from - OVERLAP * length_m).max(window.run.from);
            let bound = if forward {
                &mut window.left
            } else {
                &mut window.right
            };
            *bound = point(t);
        }
        if run.to < window.run.to {
            let t = (run.to + OVERLAP * length_m).min(window.run.to);
            let bound = if forward {
                &mut window.right
            } else {
                &mut window.left
            };
            *bound = point(t);
        }
        window.run = run;
        window
    }

    /// Links the living windows of a side in order.
    fn relink(&mut self, side: usize) {
        let windows = &mut self.windows;
        self.chain
            .retain(|&i| windows[i as usize].state != State::Dead);
        self.chain.sort_unstable_by(|&i, &j| {
            let from = |k: u32| windows[k as usize].run.from;
            from(i).total_cmp(&from(j)).then(i.cmp(&j))
        });
        let mut next = NONE;
        for &i in self.chain.iter().rev() {
            windows[i as usize].next = next;
            next = i;
        }
        self.heads[side] = next;
    }

    /// Whether the way along the side from one of its ends beats the whole window.
    fn is_beaten_from_an_end(&self, side: u32, length_m: f64, wave: &Wave, run: Run) -> bool {
        // Above rounding, so that nothing is lost that is a shortest path.
        const MARGIN: f64 = 1e-11;
        let label = |e: u32| {
            let vertex = self.mesh.edges[e as usize].vertex;
            self.labels[vertex as usize].length_m
        };
        // A distance changes no faster than the point moves, so one end decides.
        let to = wave.at_m(run.to) * (1.0 - MARGIN);
        let from = wave.at_m(run.from) * (1.0 - MARGIN);
        label(side) + run.to < to || label(self.mesh.next(side)) + length_m - run.from < from
    }

    fn into_map(self, source_cells: &[u32]) -> PathMap<'m> {
        let mesh = self.mesh;
        let mut starts = Vec::with_capacity(mesh.n_cells() + 1);
        let mut reaches = Vec::with_capacity(self.windows.len());
        let mut effort = Effort {
            windows: self.windows.len(),
            ..Effort::default()
        };
        for cell in 0..mesh.n_cells() as u32 {
            starts.push(reaches.len() as u32);
            if source_cells.contains(&cell) {
                reaches.push(Reach::inside(self.source, 0.0, SOURCE));
            }
            for e in mesh.starts[cell as usize]..mesh.starts[cell as usize + 1] {
                let (on_side, entering) = self.reach_through(e, &mut reaches);
                effort.kept += entering;
                effort.most_on_a_side = effort.most_on_a_side.max(on_side);
                let vertex = mesh.edges[e as usize].vertex;
                let label = self.labels[vertex as usize];
                let v = &mesh.vertices[vertex as usize];
                if v.corner && label.length_m.is_finite() {
                    reaches.push(Reach::inside(v.at, label.length_m, vertex));
                }
            }
        }
        starts.push(reaches.len() as u32);
        PathMap {
            mesh,
            source: self.source,
            labels: self.labels,
            starts,
            reaches,
            effort,
        }
    }

    /// The roots that look into a cell through one of its sides; returns how many
    /// windows the side has, and how many of them look this way.
    fn reach_through(&self, edge: u32, reaches: &mut Vec<Reach>) -> (usize, usize) {
        let e = &self.mesh.edges[edge as usize];
        if e.twin == NONE {
            return (0, 0);
        }
        let side = edge.min(e.twin);
        let a = self.mesh.edges[side as usize].origin;
        let b = self.mesh.edges[self.mesh.next(side) as usize].origin;
        let along = (b - a) / (b - a).norm();
        let (mut on_side, mut entering) = (0, 0);
        let mut index = self.heads[side as usize];
        while index != NONE {
            let w = &self.windows[index as usize];
            on_side += 1;
            if w.edge == edge {
                entering += 1;
                let (from, to) = (a + along * w.run.from, a + along * w.run.to);
                let (left, right) = if edge == side { (from, to) } else { (to, from) };
                reaches.push(Reach {
                    at: self.at(w.root),
                    root_m: w.wave.root_m,
                    right,
                    left,
                    root: w.root,
                    inside: false,
                });
            }
            index = w.next;
        }
        (on_side, entering)
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

impl Watcher for Front<'_> {
    type Bound = Bound;

    fn through(&self, vertex: u32) -> Bound {
        Bound {
            vertex,
            at: self.mesh.vertices[vertex as usize].at,
        }
    }

    fn straight_on(&self) -> Bound {
        Bound {
            vertex: STRAIGHT_ON,
            at: self.source,
        }
    }

    fn vertex_of(&self, bound: Bound) -> u32 {
        bound.vertex
    }

    fn ray(&self, root: u32, bound: Bound) -> Ray {
        if bound.vertex == STRAIGHT_ON {
            let before = self.labels[root as usize].before;
            Ray(self.at(before), self.at(root))
        } else {
            Ray(self.at(root), bound.at)
        }
    }

    fn at(&self, root: u32) -> Point {
        if root == SOURCE {
            self.source
        } else {
            self.mesh.vertices[root as usize].at
        }
    }

    fn is_open(&self, _: u32) -> bool {
        true
    }

    fn see_cell(&mut self, _: u32, _: u32) {}

    fn see_vertex(&mut self, root: u32, vertex: u32) {
        let origin = self.at(root);
        let step_m = (self.mesh.vertices[vertex as usize].at - origin).norm();
        let length_m = self.root_m + step_m;
        let label = &mut self.labels[vertex as usize];
        if label.length_m <= length_m {
            return;
        }
        *label = Label {
            length_m,
            before: root,
        };
        if step_m > 0.0 && sight::bends(self.mesh, origin, vertex) != (false, false) {
            self.push(length_m, vertex | IS_VERTEX);
        }
    }

    fn see_side(&mut self, root: u32, edge: u32, left: Bound, right: Bound) {
        let mesh = self.mesh;
        let inside = &mesh.edges[edge as usize];
        if inside.twin == NONE {
            return;
        }
        let beyond = inside.twin;
        let (l, r) = (
            &mesh.edges[beyond as usize],
            &mesh.edges[mesh.next(beyond) as usize],
        );
        let side = edge.min(beyond);
        let forward = side == beyond;
        let (a, b) = if forward {
            (l.origin, r.origin)
        } else {
            (r.origin, l.origin)
        };
        let length_m = (b - a).norm();
        let along = (b - a) / length_m;
        let at = |bound: Bound, end: u32| {
            if bound.vertex == end {
                bound.at
            } else {
                self.ray(root, bound).crossing(a, b)
            }
        };
        let t = |p: Point| (p - a).dot(&along).clamp(0.0, length_m);
        let (t_left, t_right) = (t(at(left, l.vertex)), t(at(right, r.vertex)));
        let run = if forward {
            Run::new(t_left, t_right)
        } else {
            Run::new(t_right, t_left)
        };
        if run.is_empty() {
            return;
        }
        let d = self.at(root) - a;
        let wave = Wave {
            root_m: self.root_m,
            along_m: d.dot(&along),
            height_m: along.perp(&d).abs(),
        };
        if self.is_beaten_from_an_end(side, length_m, &wave, run) {
            return;
        }
        let new = Window {
            edge: beyond,
            root,
            next: NONE,
            state: State::Waiting,
            left,
            right,
            wave,
            run,
        };
        self.place(new, side as usize);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::crowded::{Rings, crowded, mesh_of, square};
    use crate::path::two_point::Search;
    use proptest::prelude::*;

    fn compare(rings: &Rings, source: Point, goals: &[Point]) -> Result<(), TestCaseError> {
        let mesh = mesh_of(rings);
        let map = PathMap::new(&mesh, source);
        let mut search = Search::new(&mesh);
        for &goal in goals {
            let (near, far) = (map.distance_m(goal), search.distance_m(source, goal));
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
        #![proptest_config(ProptestConfig::with_cases(128))]

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
                    let (s, c) = crate::math::sin_cos(crate::math::TAU * k as f64 / 7.0);
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
