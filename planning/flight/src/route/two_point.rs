//! The shortest path between two points of a mesh, exact (D2.7 §2.3.2, §2.3.3).
//!
//! A best-first search in the manner of Polyanya (Cui, Harabor and Grastien,
//! IJCAI 2017, <https://doi.org/10.24963/ijcai.2017/70>): what a point sees through a side of a cell is one node, carried
//! from cell to cell and split where corners cut it. Here the sight is bounded
//! by rays through mesh vertices, not by computed points, so every decision is
//! an exact orientation test of input coordinates and no error builds up. A
//! corner becomes a node of its own, is opened only when the search gets to it,
//! and only if the path bends round its wall. Cells that no simple path between
//! the ends can enter are skipped ([`super::mesh`]).
//!
//! One source with many goals is the business of continuous Dijkstra (in `skein-lab`).

use super::lower_bounds::{self, Lengths, LowerBounds};
use super::mesh::{Mesh, NONE};
use super::visibility_step::{self, Ray, SOURCE, View, Watcher};
use skein_geometry::frame::Point;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Marks a bound of sight that is the straight continuation of the way to the root.
const STRAIGHT_ON: u32 = NONE - 1;

/// Nodes opened before the landmarks are asked: most near goals are found sooner.
const BEFORE_LANDMARKS: u32 = 24;

/// Something left to look at, with a lower bound of the paths through it.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// The least length of a path through this node, metres.
    bound_m: f64,
    /// Length from the start to the root, metres.
    root_m: f64,
    /// The vertex that sees, or [`SOURCE`].
    root: u32,
    /// The side that is looked through, seen from the cell beyond; [`NONE`] for a
    /// corner that has still to look round.
    edge: u32,
    /// The vertex on the left ray of the sight, or [`STRAIGHT_ON`].
    left: u32,
    /// The vertex on the right ray.
    right: u32,
    /// Whether the landmarks have had their say.
    sharp: bool,
}

impl Node {
    /// The start itself.
    const START: Self = Self {
        bound_m: 0.0,
        root_m: 0.0,
        root: SOURCE,
        edge: NONE,
        left: NONE,
        right: NONE,
        sharp: true,
    };
}

/// The best way to a vertex so far.
#[derive(Clone, Copy, Debug)]
struct Label {
    length_m: f64,
    /// The query that wrote this label.
    query: u32,
    /// The bend before, or [`SOURCE`].
    before: u32,
}

/// Two-point queries on one mesh; keeps its memory between queries.
#[derive(Clone, Debug)]
pub struct Search<'m> {
    mesh: &'m Mesh,
    query: u32,
    labels: Vec<Label>,
    block_marks: Vec<u32>,
    cell_marks: Vec<u32>,
    goal_marks: Vec<u32>,
    heap: BinaryHeap<(Reverse<u64>, u32)>,
    nodes: Vec<Node>,
    /// The cheapest node made last, which often is the next one to open.
    carried: Option<Node>,
    from_cells: Vec<u32>,
    to_cells: Vec<u32>,
    from: Point,
    to: Point,
    best_m: f64,
    best_root: u32,
    /// The node being opened.
    opened: Node,
    n_opened: u32,
    landmarks: Option<&'m dyn LowerBounds>,
    from_lengths: Lengths,
    to_lengths: Lengths,
}

impl<'m> Search<'m> {
    /// Memory for queries on this mesh.
    #[must_use]
    pub fn new(mesh: &'m Mesh) -> Self {
        let blank = Label {
            length_m: 0.0,
            query: 0,
            before: NONE,
        };
        Self {
            mesh,
            query: 0,
            labels: vec![blank; mesh.vertices.len()],
            block_marks: vec![0; mesh.blocks.len()],
            cell_marks: vec![0; mesh.n_cells()],
            goal_marks: vec![0; mesh.n_cells()],
            heap: BinaryHeap::new(),
            nodes: Vec::new(),
            carried: None,
            from_cells: Vec::new(),
            to_cells: Vec::new(),
            from: Point::origin(),
            to: Point::origin(),
            best_m: f64::INFINITY,
            best_root: NONE,
            opened: Node::START,
            n_opened: 0,
            landmarks: None,
            from_lengths: Lengths::default(),
            to_lengths: Lengths::default(),
        }
    }

    /// Memory for queries that are guided by landmarks of the same mesh: the same
    /// lengths, sooner.
    #[must_use]
    pub fn with_landmarks(mesh: &'m Mesh, landmarks: &'m dyn LowerBounds) -> Self {
        Self {
            landmarks: Some(landmarks),
            ..Self::new(mesh)
        }
    }

    /// The shortest path, both ends included, bends at corners of the mesh only.
    /// None if an end is outside the mesh or the ends are not connected.
    pub fn shortest(&mut self, from: Point, to: Point) -> Option<Vec<Point>> {
        let mut path = Vec::new();
        self.shortest_into(from, to, &mut path).then_some(path)
    }

    /// As [`Search::shortest`], into a list that is reused; tells whether there is a path.
    pub fn shortest_into(&mut self, from: Point, to: Point, path: &mut Vec<Point>) -> bool {
        path.clear();
        if self.distance_m(from, to).is_none() {
            return false;
        }
        path.push(to);
        let mut root = self.best_root;
        while root != SOURCE {
            path.push(self.mesh.vertices[root as usize].at);
            root = self.labels[root as usize].before;
        }
        path.push(from);
        path.reverse();
        // An end that lies on a corner would appear twice.
        path.dedup_by(|b, a| (*b - *a).norm_squared() <= 0.0);
        if path.len() == 1 {
            path.push(to);
        }
        true
    }

    /// The length of the shortest path, metres.
    pub fn distance_m(&mut self, from: Point, to: Point) -> Option<f64> {
        self.mesh.cells_at(from, &mut self.from_cells);
        self.mesh.cells_at(to, &mut self.to_cells);
        self.begin(from, to);
        if !self.mark() {
            return None;
        }
        let together = self
            .from_cells
            .iter()
            .any(|&c| self.goal_marks[c as usize] == self.query);
        if together {
            self.best_m = (to - from).norm();
            self.best_root = SOURCE;
            return Some(self.best_m);
        }
        let mesh = self.mesh;
        self.opened = Node::START;
        for i in 0..self.from_cells.len() {
            visibility_step::look_from_start(self, mesh, self.from_cells[i]);
        }
        while let Some(node) = self.next_node() {
            if node.bound_m >= self.best_m {
                break;
            }
            let stale =
                node.root != SOURCE && node.root_m > self.labels[node.root as usize].length_m;
            if stale {
                continue;
            }
            if !node.sharp
                && self.n_opened >= BEFORE_LANDMARKS
                && let Some(landmarks) = self.landmarks
            {
                self.sharpen(node, landmarks);
                continue;
            }
            self.n_opened += 1;
            self.opened = node;
            if node.edge == NONE {
                visibility_step::look_round(self, mesh, node.root);
            } else {
                self.look_for_goal(&node);
                let view = View {
                    root: node.root,
                    edge: node.edge,
                    left: node.left,
                    right: node.right,
                };
                visibility_step::look_through(self, mesh, view);
            }
        }
        self.best_m.is_finite().then_some(self.best_m)
    }

    /// Puts a node back with what the landmarks say about it.
    fn sharpen(&mut self, node: Node, landmarks: &dyn LowerBounds) {
        if self.n_opened == BEFORE_LANDMARKS {
            self.n_opened += 1;
            self.from_lengths = landmarks.at_point(self.from);
            self.to_lengths = landmarks.at_point(self.to);
        }
        let root = if node.root == SOURCE {
            &self.from_lengths
        } else {
            landmarks.at_vertex(node.root)
        };
        let mut rest_m = lower_bounds::between_m(root, &self.to_lengths);
        if node.edge != NONE {
            let a = &self.mesh.edges[node.edge as usize];
            let b = &self.mesh.edges[self.mesh.next(node.edge) as usize];
            let (l, r) = (landmarks.at_vertex(a.vertex), landmarks.at_vertex(b.vertex));
            let along = b.origin - a.origin;
            let square = along.norm_squared();
            let d = self.at(node.root) - a.origin;
            let nearest = along * (d.dot(&along) / square).clamp(0.0, 1.0);
            let beyond_m = lower_bounds::to_side_m(&self.to_lengths, l, r, square.sqrt());
            rest_m = rest_m.max((d - nearest).norm() + beyond_m);
        }
        self.push(Node {
            bound_m: node.bound_m.max(node.root_m + rest_m),
            sharp: true,
            ..node
        });
    }

    fn begin(&mut self, from: Point, to: Point) {
        if self.query == u32::MAX {
            self.labels.iter_mut().for_each(|l| l.query = 0);
            self.block_marks.fill(0);
            self.cell_marks.fill(0);
            self.goal_marks.fill(0);
            self.query = 0;
        }
        self.query += 1;
        self.heap.clear();
        self.nodes.clear();
        self.carried = None;
        self.n_opened = 0;
        self.from = from;
        self.to = to;
        self.best_m = f64::INFINITY;
        self.best_root = NONE;
    }

    /// Marks what a simple path between the ends may enter; false if there is none.
    fn mark(&mut self) -> bool {
        let blocks = &self.mesh.blocks;
        let query = self.query;
        let (block_marks, cell_marks) = (&mut self.block_marks, &mut self.cell_marks);
        let mut joined = false;
        for &a in &self.from_cells {
            for &b in &self.to_cells {
                if blocks.joined(a, b) {
                    joined = true;
                    blocks.between(a, b, |block, top| {
                        block_marks[block as usize] = query;
                        cell_marks[top as usize] = query;
                    });
                }
            }
        }
        for &c in self.from_cells.iter().chain(&self.to_cells) {
            self.cell_marks[c as usize] = query;
        }
        for &c in &self.to_cells {
            self.goal_marks[c as usize] = query;
        }
        joined
    }

    fn next_node(&mut self) -> Option<Node> {
        let top = self.heap.peek().map(|&(Reverse(key), _)| key);
        if let Some(node) = self.carried.take() {
            if top.is_none_or(|key| node.bound_m.to_bits() <= key) {
                return Some(node);
            }
            self.keep(node);
        }
        let (_, index) = self.heap.pop()?;
        Some(self.nodes[index as usize])
    }

    /// Bounds are not negative, so their bits sort as they do.
    fn keep(&mut self, node: Node) {
        let index = self.nodes.len() as u32;
        self.nodes.push(node);
        self.heap.push((Reverse(node.bound_m.to_bits()), index));
    }

    fn push(&mut self, node: Node) {
        if node.bound_m >= self.best_m {
            return;
        }
        match self.carried {
            Some(other) if other.bound_m <= node.bound_m => self.keep(node),
            Some(other) => {
                self.keep(other);
                self.carried = Some(node);
            }
            None => self.carried = Some(node),
        }
    }

    /// The shortest line from the root through the sight to the goal or its mirror image.
    fn bound_m(&self, root: u32, edge: u32, left: u32, right: u32) -> f64 {
        let e = &self.mesh.edges[edge as usize];
        let f = &self.mesh.edges[self.mesh.next(edge) as usize];
        let (a, b) = (e.origin, f.origin);
        let along = b - a;
        let mut to = self.to;
        let height = along.perp(&(to - a));
        if height < 0.0 {
            // Whoever comes back through the side goes as far as its mirror image.
            let normal = nalgebra::Vector2::new(-along.y, along.x);
            to -= normal * (2.0 * height / along.norm_squared());
        }
        let origin = self.at(root);
        let rough = |r: Ray, p: Point| (r.1 - r.0).perp(&(p - r.0));
        let r = self.ray(root, right);
        let past_right = rough(r, to) < 0.0;
        let l = self.ray(root, left);
        if !past_right && rough(l, to) <= 0.0 {
            return (to - origin).norm();
        }
        let (ray, vertex, end) = if past_right {
            (r, right, f)
        } else {
            (l, left, e)
        };
        let x = if vertex == end.vertex {
            end.origin
        } else {
            ray.crossing(a, b)
        };
        (x - origin).norm() + (to - x).norm()
    }

    /// Whether the goal lies in the cell that is looked into, and in sight.
    fn look_for_goal(&mut self, node: &Node) {
        let cell = self.mesh.edges[node.edge as usize].cell;
        if self.goal_marks[cell as usize] == self.query
            && self.ray(node.root, node.right).side(self.to) >= 0.0
            && self.ray(node.root, node.left).side(self.to) <= 0.0
        {
            self.reach(node.root);
        }
    }

    /// The goal is seen straight from `root`.
    fn reach(&mut self, root: u32) {
        let length_m = self.opened.root_m + (self.to - self.at(root)).norm();
        if length_m < self.best_m {
            self.best_m = length_m;
            self.best_root = root;
        }
    }
}

impl Watcher for Search<'_> {
    type Bound = u32;

    #[inline]
    fn through(&self, vertex: u32) -> u32 {
        vertex
    }

    #[inline]
    fn straight_on(&self) -> u32 {
        STRAIGHT_ON
    }

    #[inline]
    fn vertex_of(&self, bound: u32) -> u32 {
        bound
    }

    #[inline]
    fn ray(&self, root: u32, bound: u32) -> Ray {
        if bound == STRAIGHT_ON {
            let before = self.labels[root as usize].before;
            Ray(self.at(before), self.at(root))
        } else {
            Ray(self.at(root), self.at(bound))
        }
    }

    #[inline]
    fn at(&self, root: u32) -> Point {
        if root == SOURCE {
            self.from
        } else {
            self.mesh.vertices[root as usize].at
        }
    }

    #[inline]
    fn is_open(&self, cell: u32) -> bool {
        let above = self.mesh.blocks.above[cell as usize];
        (above != NONE && self.block_marks[above as usize] == self.query)
            || self.cell_marks[cell as usize] == self.query
    }

    #[inline]
    fn see_cell(&mut self, root: u32, cell: u32) {
        if self.goal_marks[cell as usize] == self.query {
            self.reach(root);
        }
    }

    fn see_vertex(&mut self, root: u32, vertex: u32) {
        let v = &self.mesh.vertices[vertex as usize];
        if !v.corner {
            return;
        }
        let origin = self.at(root);
        let step_m = (v.at - origin).norm();
        // The start on a corner sees all round anyway.
        if step_m <= 0.0 {
            return;
        }
        let length_m = self.opened.root_m + step_m;
        let label = &mut self.labels[vertex as usize];
        // A way as long as the known one leads to nothing shorter: whatever only it
        // can go on to without slack, another path reaches sooner.
        if label.query == self.query && label.length_m <= length_m {
            return;
        }
        *label = Label {
            length_m,
            query: self.query,
            before: root,
        };
        if visibility_step::bends(self.mesh, origin, vertex) == (false, false) {
            return;
        }
        self.push(Node {
            bound_m: length_m + (self.to - v.at).norm(),
            root_m: length_m,
            root: vertex,
            edge: NONE,
            left: NONE,
            right: NONE,
            sharp: false,
        });
    }

    #[inline]
    fn see_side(&mut self, root: u32, edge: u32, left: u32, right: u32) {
        let e = &self.mesh.edges[edge as usize];
        if e.twin == NONE || self.block_marks[e.block as usize] != self.query {
            return;
        }
        let root_m = self.opened.root_m;
        let bound_m = self.bound_m(root, e.twin, left, right) + root_m;
        self.push(Node {
            bound_m: bound_m.max(self.opened.bound_m),
            root_m,
            root,
            edge: e.twin,
            left,
            right,
            sharp: false,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::route::degenerate_maps::{Rings, crowded, mesh_of, square};
    use proptest::prelude::*;
    use skein_geometry::polygon::side;

    /// The oracle: Dijkstra over all points that see each other, where sight is
    /// tested box by box: a line is blocked if it enters the inside of a box, or
    /// slips between two boxes that touch (sampled on both sides of the line).
    fn oracle(cells: &[bool], n: usize, from: Point, to: Point) -> Option<f64> {
        let full = |x: f64, y: f64| {
            let (i, j) = ((x / 10.0).floor(), (y / 10.0).floor());
            let out = i < 0.0 || j < 0.0 || i >= n as f64 || j >= n as f64;
            out || cells[j as usize * n + i as usize]
        };
        let mut points = vec![from, to];
        for j in 0..=n {
            for i in 0..=n {
                points.push(Point::new(i as f64 * 10.0, j as f64 * 10.0));
            }
        }
        let sees = |a: Point, b: Point| {
            let d = b - a;
            let steps = (d.norm() / 0.05).ceil() as usize;
            let normal = nalgebra::Vector2::new(-d.y, d.x).normalize() * 1e-6;
            let free = |side: f64| {
                (0..steps).all(|k| {
                    let p = a + d * ((k as f64 + 0.5) / steps as f64) + normal * side;
                    !full(p.x, p.y)
                })
            };
            free(1.0) || free(-1.0)
        };
        let m = points.len();
        let mut best = vec![f64::INFINITY; m];
        let mut done = vec![false; m];
        best[0] = 0.0;
        while let Some(i) = (0..m)
            .filter(|&i| !done[i] && best[i].is_finite())
            .min_by(|&a, &b| best[a].total_cmp(&best[b]))
        {
            done[i] = true;
            for j in 0..m {
                let step = (points[j] - points[i]).norm();
                if !done[j] && sees(points[i], points[j]) {
                    best[j] = best[j].min(best[i] + step);
                }
            }
        }
        Some(best[1]).filter(|b| b.is_finite())
    }

    /// Whether boxes touch in a corner only: the oracle would slip through there.
    fn touches_in_a_point(cells: &[bool], n: usize) -> bool {
        (0..n - 1).any(|j| {
            (0..n - 1).any(|i| {
                let at = |i: usize, j: usize| cells[j * n + i];
                let (a, b) = (at(i, j), at(i + 1, j));
                let (c, d) = (at(i, j + 1), at(i + 1, j + 1));
                (a && d && !b && !c) || (b && c && !a && !d)
            })
        })
    }

    /// Bends only at corners of rings, and never through one.
    fn check_path(rings: &Rings, path: &[Point]) -> Result<(), TestCaseError> {
        for w in path.windows(3) {
            prop_assert!(side(w[0], w[1], w[2]) != 0 || (w[1] - w[0]).dot(&(w[2] - w[1])) > 0.0);
            let corner = rings.iter().flatten().any(|p| (p - w[1]).norm() < 1e-12);
            prop_assert!(corner, "a bend at {:?}", w[1]);
        }
        Ok(())
    }

    fn length_m(path: &[Point]) -> f64 {
        path.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
    }

    #[test]
    fn a_straight_way_a_way_round_and_no_way() {
        let rings = vec![
            square(0.0, 0.0, 10.0),
            square(4.0, 0.0, 2.0),
            square(20.0, 0.0, 5.0),
        ];
        let mesh = mesh_of(&rings);
        let mut search = Search::new(&mesh);
        let p = |x, y| Point::new(x, y);
        assert_eq!(search.shortest(p(1.0, 1.0), p(9.0, 9.0)).unwrap().len(), 2);
        let round = search.shortest(p(4.0, 0.0), p(6.0, 0.0)).unwrap();
        assert_eq!(
            round,
            vec![p(4.0, 0.0), p(4.0, 2.0), p(6.0, 2.0), p(6.0, 0.0)]
        );
        assert!(search.shortest(p(1.0, 1.0), p(5.0, 1.0)).is_none());
        assert!(search.shortest(p(1.0, 1.0), p(22.0, 1.0)).is_none());
        assert!(search.shortest(p(f64::NAN, 1.0), p(2.0, 1.0)).is_none());
        assert_eq!(search.shortest(p(1.0, 1.0), p(1.0, 1.0)).unwrap().len(), 2);
    }

    #[test]
    fn nothing_flies_between_boxes_that_touch() {
        let rings = vec![
            square(0.0, 0.0, 20.0),
            square(0.0, 0.0, 10.0),
            square(10.0, 10.0, 10.0),
        ];
        let mesh = mesh_of(&rings);
        let mut search = Search::new(&mesh);
        let (a, b) = (Point::new(5.0, 15.0), Point::new(15.0, 5.0));
        assert!(search.shortest(a, b).is_none());
        // The point itself belongs to both sides.
        assert!(search.shortest(a, Point::new(10.0, 10.0)).is_some());
        assert!(search.shortest(Point::new(10.0, 10.0), b).is_some());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(96))]

        #[test]
        fn paths_among_crowded_boxes_are_those_of_all_pairs(
            cells in prop::collection::vec(prop::bool::weighted(0.35), 25),
            ends in prop::collection::vec(0u8..=50, 4),
        ) {
            prop_assume!(!touches_in_a_point(&cells, 5) && cells.iter().any(|full| !full));
            let rings = crowded(&cells, 5, 0.0);
            let mesh = mesh_of(&rings);
            let at = |i: usize| Point::new(f64::from(ends[i]), f64::from(ends[i + 1]));
            let (a, b) = (at(0), at(2));
            prop_assume!(mesh.contains(a) && mesh.contains(b));
            let mut search = Search::new(&mesh);
            let path = search.shortest(a, b);
            let want = oracle(&cells, 5, a, b);
            prop_assert_eq!(path.is_some(), want.is_some());
            if let (Some(path), Some(want)) = (path, want) {
                prop_assert!((length_m(&path) - want).abs() < 1e-9, "{} {want}", length_m(&path));
                check_path(&rings, &path)?;
                let back = search.distance_m(b, a).unwrap();
                prop_assert!((back - want).abs() < 1e-9);
            }
        }

        #[test]
        fn far_from_the_origin_nothing_changes(
            cells in prop::collection::vec(prop::bool::weighted(0.3), 64),
            ends in prop::collection::vec(0u8..=80, 4),
        ) {
            prop_assume!(cells.iter().any(|full| !full));
            let near = mesh_of(&crowded(&cells, 8, 0.0));
            let far = mesh_of(&crowded(&cells, 8, 1e6));
            let at = |i: usize, o: f64| Point::new(o + f64::from(ends[i]), o + f64::from(ends[i + 1]));
            let here = Search::new(&near).distance_m(at(0, 0.0), at(2, 0.0));
            let there = Search::new(&far).distance_m(at(0, 1e6), at(2, 1e6));
            prop_assert_eq!(here.is_some(), there.is_some());
            if let (Some(here), Some(there)) = (here, there) {
                prop_assert!((here - there).abs() < 1e-9);
            }
        }
    }
}
