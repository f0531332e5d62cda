//! The wavefront: windows on the sides of cells, carried on in order of distance.

use super::envelope::{Run, Runs, Wave};
use super::{Effort, Label, PathMap, Reach};
use skein_flight::route::mesh::{Mesh, NONE};
use skein_flight::route::visibility_step::{self, Ray, SOURCE, View, Watcher};
use skein_geometry::frame::Point;
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
pub(super) struct Bound {
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

/// The wavefront while it spreads.
pub(super) struct Front<'m> {
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
    pub fn new(mesh: &'m Mesh, source: Point) -> Self {
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

    pub fn spread(&mut self) {
        let mesh = self.mesh;
        while let Some((Reverse(key), index)) = self.queue.pop() {
            self.bound_m = f64::from_bits(key);
            if index & IS_VERTEX != 0 {
                let vertex = index & !IS_VERTEX;
                self.root_m = self.labels[vertex as usize].length_m;
                if self.root_m >= self.bound_m {
                    visibility_step::look_round(self, mesh, vertex);
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
            visibility_step::look_through(self, mesh, view);
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

    pub fn into_map(self, source_cells: &[u32]) -> PathMap<'m> {
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
        if step_m > 0.0 && visibility_step::bends(self.mesh, origin, vertex) != (false, false) {
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
