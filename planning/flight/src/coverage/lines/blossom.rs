//! Minimum-cost perfect matching in a sparse graph: Edmonds' blossom algorithm, one
//! alternating tree at a time (a tool of D2.7 §3.5; the section itself has none).
//!
//! Edmonds, "Paths, trees, and flowers", 1965, <https://doi.org/10.4153/CJM-1965-045-4>.
//!
//! Leaves to `matching` which edges of a complete graph are worth looking at.

use core::cmp::Reverse;
use std::collections::BinaryHeap;

/// No node, no blossom.
const NONE: u32 = u32::MAX;

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Label {
    Free,
    Plus,
    Minus,
}

/// Something that happens when the tree's dual variables have grown to a key.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Event {
    /// The edge from a plus vertex to another vertex gets tight.
    Tight(u32, u32),
    /// The dual variable of a minus blossom reaches zero.
    Open(u32),
}

/// A vertex or a blossom.
struct Node {
    label: Label,
    /// The blossom around it, or [`NONE`].
    parent: u32,
    /// The tree's growth when the label was given.
    joined: i64,
    /// Dual variable of a blossom; without meaning for a vertex.
    dual: i64,
    /// Matched edge as (vertex inside, vertex outside); valid while outermost.
    matched: Option<(u32, u32)>,
    /// For a minus node: the edge from the tree as (vertex above, vertex inside).
    above: (u32, u32),
    /// All vertices inside.
    vertices: Vec<u32>,
    /// Children in cyclic order.
    children: Vec<u32>,
    /// `links[i]` joins child `i` to the next, as (vertex in it, vertex in the next).
    links: Vec<(u32, u32)>,
}

impl Node {
    fn new(vertices: Vec<u32>) -> Self {
        Self {
            label: Label::Free,
            parent: NONE,
            joined: 0,
            dual: 0,
            matched: None,
            above: (NONE, NONE),
            vertices,
            children: Vec::new(),
            links: Vec::new(),
        }
    }
}

/// A perfect matching of least cost with the dual solution that proves it.
pub(super) struct Matching {
    /// The partner of each vertex.
    pub mate: Vec<u32>,
    /// Per vertex, the sum of its own dual variable and those of all blossoms around it.
    potential: Vec<i64>,
    nodes: Vec<Node>,
}

impl Matching {
    /// An upper bound on how much the pair `(a, b)` may cost before it cannot help.
    pub(super) fn reach(&self, a: usize, b: usize) -> i64 {
        self.potential[a] + self.potential[b]
    }

    /// Reduced cost of any pair, also of one that was not offered; none is negative
    /// exactly if the matching is the cheapest of all pairs.
    pub(super) fn reduced(&self, a: usize, b: usize, cost: i64) -> i64 {
        let shared = |mut x: u32| {
            let mut around = Vec::new();
            while self.nodes[x as usize].parent != NONE {
                x = self.nodes[x as usize].parent;
                around.push(x);
            }
            around
        };
        let (of_a, of_b) = (shared(a as u32), shared(b as u32));
        let common: i64 = of_a
            .iter()
            .filter(|x| of_b.contains(x))
            .map(|&x| self.nodes[x as usize].dual)
            .sum();
        cost - self.reach(a, b) + 2 * common
    }
}

struct Solver<'a> {
    start: Vec<u32>,
    around: Vec<(u32, i64)>,
    nodes: Vec<Node>,
    unused: Vec<u32>,
    outer: Vec<u32>,
    potential: Vec<i64>,
    growth: i64,
    tree: Vec<u32>,
    heap: BinaryHeap<Reverse<(i64, Event)>>,
    n: usize,
    marks: &'a mut Vec<u32>,
    stamp: u32,
}

/// The perfect matching of least total cost of the vertices `0..n`, or `None` when the
/// edges `(a, b, cost)` hold no perfect matching.
///
/// Costs must be even, so that every dual variable stays whole.
///
/// # Complexity
/// One search like Dijkstra's for each vertex that the greedy start leaves single,
/// in the tree that it needs; in the plane nearly linear.
pub(super) fn min_cost_perfect(n: usize, edges: &[(u32, u32, i64)]) -> Option<Matching> {
    let mut marks = vec![0; n + n / 2 + 1];
    let mut s = Solver::new(n, edges, &mut marks);
    s.start_greedily();
    for v in 0..n {
        let root = s.outer[v];
        if s.nodes[root as usize].matched.is_none() && !s.grow(root) {
            return None;
        }
    }
    let mut mate = vec![NONE; n];
    for v in 0..n {
        if mate[v] == NONE {
            let top = s.outer[v];
            settle(&s.nodes, top, s.nodes[top as usize].matched, &mut mate);
        }
    }
    Some(Matching {
        mate,
        potential: s.potential,
        nodes: s.nodes,
    })
}

/// Writes the partners of all vertices inside `b`, whose edge to the outside is `matched`.
fn settle(nodes: &[Node], b: u32, matched: Option<(u32, u32)>, mate: &mut [u32]) {
    let mut todo = vec![(b, matched)];
    while let Some((b, matched)) = todo.pop() {
        let node = &nodes[b as usize];
        let Some((inside, outside)) = matched else {
            continue;
        };
        if node.children.is_empty() {
            mate[inside as usize] = outside;
            continue;
        }
        let k = node.children.len();
        let first = child_of(nodes, b, inside);
        todo.push((node.children[first], matched));
        for i in (1..k).step_by(2) {
            let (one, two) = ((first + i) % k, (first + i + 1) % k);
            let (u, v) = node.links[one];
            todo.push((node.children[one], Some((u, v))));
            todo.push((node.children[two], Some((v, u))));
        }
    }
}

/// The index of the child of `b` that holds vertex `v`.
fn child_of(nodes: &[Node], b: u32, v: u32) -> usize {
    let mut x = v;
    while nodes[x as usize].parent != b {
        x = nodes[x as usize].parent;
    }
    let children = &nodes[b as usize].children;
    children
        .iter()
        .position(|&c| c == x)
        .unwrap_or(children.len())
}

impl<'a> Solver<'a> {
    fn new(n: usize, edges: &[(u32, u32, i64)], marks: &'a mut Vec<u32>) -> Self {
        let mut degree = vec![0u32; n + 1];
        for &(a, b, _) in edges {
            degree[a as usize + 1] += 1;
            degree[b as usize + 1] += 1;
        }
        for v in 0..n {
            degree[v + 1] += degree[v];
        }
        let start = degree.clone();
        let mut around = vec![(0, 0); edges.len() * 2];
        for &(a, b, cost) in edges {
            debug_assert!(cost % 2 == 0, "costs are even");
            for (x, y) in [(a, b), (b, a)] {
                around[degree[x as usize] as usize] = (y, cost);
                degree[x as usize] += 1;
            }
        }
        let nodes = (0..n as u32).map(|v| Node::new(vec![v])).collect();
        Self {
            start,
            around,
            nodes,
            unused: Vec::new(),
            outer: (0..n as u32).collect(),
            potential: vec![0; n],
            growth: 0,
            tree: Vec::new(),
            heap: BinaryHeap::new(),
            n,
            marks,
            stamp: 0,
        }
    }

    fn edges_of(&self, v: u32) -> core::ops::Range<usize> {
        self.start[v as usize] as usize..self.start[v as usize + 1] as usize
    }

    /// Dual variables that make one edge of every vertex tight, and a maximal
    /// matching of tight edges.
    fn start_greedily(&mut self) {
        for v in 0..self.n as u32 {
            let cheapest = self.edges_of(v).map(|e| self.around[e].1).min();
            self.potential[v as usize] = cheapest.unwrap_or(0) / 2;
        }
        for v in 0..self.n as u32 {
            let least = self
                .edges_of(v)
                .map(|e| {
                    let (w, cost) = self.around[e];
                    (cost - self.potential[w as usize], w)
                })
                .min_by_key(|&(p, w)| (p, self.nodes[w as usize].matched.is_some(), w));
            let Some((p, w)) = least else { continue };
            if self.nodes[v as usize].matched.is_some() {
                continue;
            }
            self.potential[v as usize] = p;
            if self.nodes[w as usize].matched.is_none() {
                self.nodes[v as usize].matched = Some((v, w));
                self.nodes[w as usize].matched = Some((w, v));
            }
        }
    }

    /// How much the dual variables inside an outermost node have changed since it was labelled.
    fn pending(&self, b: u32) -> i64 {
        let node = &self.nodes[b as usize];
        match node.label {
            Label::Free => 0,
            Label::Plus => self.growth - node.joined,
            Label::Minus => node.joined - self.growth,
        }
    }

    fn potential_now(&self, v: u32) -> i64 {
        self.potential[v as usize] + self.pending(self.outer[v as usize])
    }

    /// Writes down what is pending for `b`.
    fn materialise(&mut self, b: u32) {
        let change = self.pending(b);
        self.nodes[b as usize].joined = self.growth;
        self.nodes[b as usize].dual += change;
        for i in 0..self.nodes[b as usize].vertices.len() {
            let v = self.nodes[b as usize].vertices[i];
            self.potential[v as usize] += change;
        }
    }

    fn label(&mut self, b: u32, label: Label) {
        self.nodes[b as usize].label = label;
        self.nodes[b as usize].joined = self.growth;
        self.tree.push(b);
        match label {
            Label::Plus => self.announce(b),
            Label::Minus if b as usize >= self.n => {
                let at = self.growth + self.nodes[b as usize].dual;
                self.heap.push(Reverse((at, Event::Open(b))));
            }
            _ => {}
        }
    }

    /// Puts the edges out of a plus node on the calendar.
    fn announce(&mut self, b: u32) {
        for i in 0..self.nodes[b as usize].vertices.len() {
            self.announce_vertex(self.nodes[b as usize].vertices[i]);
        }
    }

    fn announce_vertex(&mut self, u: u32) {
        let (own, at_u) = (self.outer[u as usize], self.potential_now(u));
        for e in self.edges_of(u) {
            let (v, cost) = self.around[e];
            let other = self.outer[v as usize];
            if other == own {
                continue;
            }
            let slack = || cost - at_u - self.potential_now(v);
            let due = match self.nodes[other as usize].label {
                Label::Minus => continue,
                Label::Free => slack(),
                Label::Plus => slack() / 2,
            };
            let due = self.growth + due;
            self.heap.push(Reverse((due, Event::Tight(u, v))));
        }
    }

    /// Grows one tree from the single node `root` until another single node is met;
    /// `false` when there is none to meet.
    fn grow(&mut self, root: u32) -> bool {
        self.growth = 0;
        self.heap.clear();
        self.tree.clear();
        self.label(root, Label::Plus);
        while let Some(Reverse((key, event))) = self.heap.pop() {
            if self.happens(key, event) {
                self.clear_tree();
                return true;
            }
        }
        self.clear_tree();
        false
    }

    fn clear_tree(&mut self) {
        let tree = core::mem::take(&mut self.tree);
        for &b in &tree {
            let node = &self.nodes[b as usize];
            if node.label != Label::Free && node.parent == NONE {
                self.materialise(b);
            }
            self.nodes[b as usize].label = Label::Free;
        }
        self.tree = tree;
    }

    /// Carries out an event if it still holds; `true` when the matching has grown.
    fn happens(&mut self, key: i64, event: Event) -> bool {
        match event {
            Event::Open(b) => {
                let node = &self.nodes[b as usize];
                if node.parent == NONE
                    && node.label == Label::Minus
                    && node.dual + node.joined == key
                {
                    self.growth = key;
                    self.open(b);
                }
                false
            }
            Event::Tight(u, v) => self.tighten(key, u, v),
        }
    }

    fn tighten(&mut self, key: i64, u: u32, v: u32) -> bool {
        let (own, other) = (self.outer[u as usize], self.outer[v as usize]);
        if own == other || self.nodes[own as usize].label != Label::Plus {
            return false;
        }
        let cost = self.cost(u, v);
        let slack = cost - self.potential_now(u) - self.potential_now(v);
        let due = self.growth
            + match self.nodes[other as usize].label {
                Label::Minus => return false,
                Label::Free => slack,
                Label::Plus => slack / 2,
            };
        if due > key {
            self.heap.push(Reverse((due, Event::Tight(u, v))));
            return false;
        }
        self.growth = key.max(self.growth);
        if self.nodes[other as usize].label == Label::Plus {
            self.shrink(u, v);
            return false;
        }
        let Some((_, beyond)) = self.nodes[other as usize].matched else {
            self.augment(u, v);
            return true;
        };
        self.nodes[other as usize].above = (u, v);
        self.label(other, Label::Minus);
        self.label(self.outer[beyond as usize], Label::Plus);
        false
    }

    fn cost(&self, u: u32, v: u32) -> i64 {
        let at = self.edges_of(u);
        self.around[at]
            .iter()
            .filter(|e| e.0 == v)
            .map(|e| e.1)
            .min()
            .unwrap_or(i64::MAX / 4)
    }

    /// Matches along the tree from the root to the single vertex `v`.
    fn augment(&mut self, u: u32, v: u32) {
        let last = self.outer[v as usize];
        self.nodes[last as usize].matched = Some((v, u));
        let (mut u, mut v) = (u, v);
        loop {
            let p = self.outer[u as usize] as usize;
            let old = self.nodes[p].matched.replace((u, v));
            let Some((_, y)) = old else { return };
            let m = self.outer[y as usize] as usize;
            let (above, inside) = self.nodes[m].above;
            self.nodes[m].matched = Some((inside, above));
            (u, v) = (above, inside);
        }
    }

    /// The nodes from plus node `p` up to the root, plus and minus in turn.
    fn step_up(&self, b: u32) -> Option<u32> {
        let node = &self.nodes[b as usize];
        let y = if node.label == Label::Plus {
            node.matched?.1
        } else {
            node.above.0
        };
        Some(self.outer[y as usize])
    }

    /// The lowest node that both tree paths share.
    fn meet(&mut self, a: u32, b: u32) -> u32 {
        self.stamp += 1;
        let (mut one, mut two) = (Some(a), Some(b));
        loop {
            if let Some(x) = one {
                let seen = &mut self.marks[x as usize];
                if *seen == self.stamp {
                    return x;
                }
                *seen = self.stamp;
                one = self.step_up(x);
            }
            core::mem::swap(&mut one, &mut two);
        }
    }

    /// The path from `from` up to, without, `top`, and the links along it upwards.
    fn climb(&self, from: u32, top: u32) -> (Vec<u32>, Vec<(u32, u32)>) {
        let (mut path, mut links, mut x) = (Vec::new(), Vec::new(), from);
        while x != top {
            path.push(x);
            let node = &self.nodes[x as usize];
            let link = if node.label == Label::Plus {
                node.matched.unwrap_or((NONE, NONE))
            } else {
                (node.above.1, node.above.0)
            };
            links.push(link);
            x = self.outer[link.1 as usize];
        }
        (path, links)
    }

    fn new_blossom(&mut self) -> u32 {
        if let Some(b) = self.unused.pop() {
            self.nodes[b as usize] = Node::new(Vec::new());
            return b;
        }
        self.nodes.push(Node::new(Vec::new()));
        if self.marks.len() < self.nodes.len() {
            self.marks.resize(self.nodes.len(), 0);
        }
        self.nodes.len() as u32 - 1
    }

    /// Shrinks the odd cycle that the tight edge between two plus nodes closes.
    fn shrink(&mut self, u: u32, v: u32) {
        let (a, b) = (self.outer[u as usize], self.outer[v as usize]);
        let top = self.meet(a, b);
        let (left, left_links) = self.climb(a, top);
        let (right, right_links) = self.climb(b, top);
        let mut children = vec![top];
        children.extend(left.iter().rev());
        let mut links: Vec<_> = left_links.iter().rev().map(|&(x, y)| (y, x)).collect();
        links.push((u, v));
        children.extend(&right);
        links.extend(&right_links);
        let blossom = self.new_blossom();
        let mut vertices = Vec::new();
        let mut woken = Vec::new();
        for &c in &children {
            self.materialise(c);
            let was_minus = self.nodes[c as usize].label == Label::Minus;
            self.nodes[c as usize].parent = blossom;
            for &x in &self.nodes[c as usize].vertices {
                self.outer[x as usize] = blossom;
                vertices.push(x);
                if was_minus {
                    woken.push(x);
                }
            }
        }
        let matched = self.nodes[top as usize].matched;
        let node = &mut self.nodes[blossom as usize];
        node.vertices = vertices;
        node.children = children;
        node.links = links;
        node.matched = matched;
        node.label = Label::Plus;
        node.joined = self.growth;
        self.tree.push(blossom);
        for x in woken {
            self.announce_vertex(x);
        }
    }

    /// Takes a minus blossom apart: its children stay in the tree where the path
    /// runs through them, the others are free again.
    fn open(&mut self, b: u32) {
        self.materialise(b);
        let node = &mut self.nodes[b as usize];
        let (above, Some(matched)) = (node.above, node.matched) else {
            return;
        };
        node.label = Label::Free;
        let k = node.children.len();
        let out = child_of(&self.nodes, b, matched.0);
        let into = child_of(&self.nodes, b, above.1);
        let children = core::mem::take(&mut self.nodes[b as usize].children);
        let links = core::mem::take(&mut self.nodes[b as usize].links);
        for &c in &children {
            let child = &mut self.nodes[c as usize];
            child.parent = NONE;
            child.label = Label::Free;
            for &x in &child.vertices {
                self.outer[x as usize] = c;
            }
        }
        self.nodes[children[out] as usize].matched = Some(matched);
        for i in (1..k).step_by(2) {
            let (one, two) = ((out + i) % k, (out + i + 1) % k);
            let (x, y) = links[one];
            self.nodes[children[one] as usize].matched = Some((x, y));
            self.nodes[children[two] as usize].matched = Some((y, x));
        }
        let steps = (into + k - out) % k;
        // The first step down from `into` must be its matched edge.
        let backwards = steps.is_multiple_of(2);
        let length = if backwards { steps } else { k - steps };
        let at = |i: usize| {
            if backwards {
                (into + k - i % k) % k
            } else {
                (into + i) % k
            }
        };
        let mut enter = above;
        let mut on_path = vec![false; k];
        for i in 0..=length {
            let c = children[at(i)];
            on_path[at(i)] = true;
            if i % 2 == 0 {
                self.nodes[c as usize].above = enter;
                self.label(c, Label::Minus);
            } else {
                self.label(c, Label::Plus);
                enter = if backwards {
                    let (x, y) = links[at(i + 1)];
                    (y, x)
                } else {
                    links[at(i)]
                };
            }
        }
        for (i, &c) in children.iter().enumerate() {
            if !on_path[i] {
                self.wake_neighbours(c);
            }
        }
        self.unused.push(b);
    }

    /// Puts the edges from plus vertices to a node that has become free on the calendar.
    fn wake_neighbours(&mut self, c: u32) {
        for i in 0..self.nodes[c as usize].vertices.len() {
            let v = self.nodes[c as usize].vertices[i];
            for e in self.edges_of(v) {
                let (u, cost) = self.around[e];
                let other = self.outer[u as usize];
                if self.nodes[other as usize].label == Label::Plus {
                    let slack = cost - self.potential_now(u) - self.potential[v as usize];
                    let due = self.growth + slack;
                    self.heap.push(Reverse((due, Event::Tight(u, v))));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
