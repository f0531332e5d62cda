//! Weighted undirected graphs as the tree covers need them (D2.7 §3.4): spanning forests,
//! shortest ways, rooted trees.

use core::cmp::Reverse;
use skein_flight::coverage::lines::Parts;
use skein_flight::coverage::metric::Metric;
use std::collections::BinaryHeap;

/// A graph with weights that are finite and not negative.
#[derive(Clone, Debug)]
pub struct Graph {
    /// For every vertex its neighbours with the lightest edge to each, ascending.
    around: Vec<Vec<(usize, f64)>>,
}

/// Orders weights for a heap; they are never NaN.
#[derive(Clone, Copy)]
struct Weight(f64);

impl PartialEq for Weight {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl PartialOrd for Weight {
    fn partial_cmp(&self, other: &Self) -> Option<core::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Eq for Weight {}

impl Ord for Weight {
    fn cmp(&self, other: &Self) -> core::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl Graph {
    /// A graph of `n` vertices. Loops, edges that leave the graph and weights that are
    /// negative or no number are left out; of parallel edges the lightest counts.
    #[must_use]
    pub fn new(n: usize, edges: &[(usize, usize, f64)]) -> Self {
        let mut around = vec![Vec::new(); n];
        for &(a, b, w) in edges {
            if a != b && a < n && b < n && w >= 0.0 && w.is_finite() {
                around[a].push((b, w));
                around[b].push((a, w));
            }
        }
        for list in &mut around {
            list.sort_by(|x: &(usize, f64), y| x.0.cmp(&y.0).then(x.1.total_cmp(&y.1)));
            list.dedup_by_key(|e| e.0);
        }
        Self { around }
    }

    /// The full graph of `n` places under a metric.
    #[must_use]
    pub fn complete(n: usize, metric: &impl Metric) -> Self {
        let mut edges = Vec::with_capacity(n * n / 2);
        for a in 0..n {
            for b in a + 1..n {
                edges.push((a, b, metric.cost(a, b)));
            }
        }
        Self::new(n, &edges)
    }

    /// The number of vertices.
    #[must_use]
    pub fn len(&self) -> usize {
        self.around.len()
    }

    /// Whether the graph has no vertices.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.around.is_empty()
    }

    /// All edges as (lower vertex, higher vertex, weight), ascending.
    pub fn edges(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        self.around.iter().enumerate().flat_map(|(a, list)| {
            let up = list.iter().filter(move |e| e.0 > a);
            up.map(move |&(b, w)| (a, b, w))
        })
    }

    /// The weight of an edge; infinite where there is none.
    #[must_use]
    pub fn weight(&self, (a, b): (usize, usize)) -> f64 {
        let list = &self.around[a];
        match list.binary_search_by_key(&b, |e| e.0) {
            Ok(i) => list[i].1,
            Err(_) => f64::INFINITY,
        }
    }

    /// A minimum spanning forest (Kruskal; ties by vertex).
    pub(super) fn spanning_forest(&self) -> Vec<(usize, usize)> {
        self.spanning_forest_of_contracted(&[])
    }

    /// A minimum spanning forest of the graph in which `roots` are one vertex.
    pub(super) fn spanning_forest_of_contracted(&self, roots: &[usize]) -> Vec<(usize, usize)> {
        let mut edges: Vec<_> = self.edges().collect();
        edges.sort_by(|x, y| x.2.total_cmp(&y.2).then((x.0, x.1).cmp(&(y.0, y.1))));
        let mut parts = Parts::new(self.len());
        for pair in roots.windows(2) {
            parts.join(pair[0], pair[1]);
        }
        let light = edges.into_iter().filter(|&(a, b, _)| parts.join(a, b));
        light.map(|(a, b, _)| (a, b)).collect()
    }

    /// Shortest ways from `from` to every vertex (Dijkstra).
    pub(super) fn paths_from(&self, from: usize) -> Paths {
        let mut paths = Paths {
            distance: vec![f64::INFINITY; self.len()],
            before: vec![from; self.len()],
            from,
        };
        paths.distance[from] = 0.0;
        let mut heap = BinaryHeap::from([Reverse((Weight(0.0), from))]);
        while let Some(Reverse((Weight(d), v))) = heap.pop() {
            if d > paths.distance[v] {
                continue;
            }
            for &(w, weight) in &self.around[v] {
                let through = d + weight;
                if through < paths.distance[w] {
                    paths.distance[w] = through;
                    paths.before[w] = v;
                    heap.push(Reverse((Weight(through), w)));
                }
            }
        }
        paths
    }
}

/// Shortest ways from one vertex.
pub(super) struct Paths {
    distance: Vec<f64>,
    before: Vec<usize>,
    from: usize,
}

impl Paths {
    pub(super) fn distance(&self, v: usize) -> f64 {
        self.distance[v]
    }

    /// The edges of the way to `v`.
    pub(super) fn way_to(&self, mut v: usize) -> Vec<(usize, usize)> {
        let mut way = Vec::new();
        while v != self.from && self.distance[v].is_finite() {
            way.push((self.before[v], v));
            v = self.before[v];
        }
        way
    }
}

/// A forest hung up at its tops.
pub(super) struct Reached {
    /// The vertex above each; none for tops and for what is not reached.
    pub up: Vec<Option<usize>>,
    below: Vec<Vec<usize>>,
    /// The vertices that the trees hang from.
    pub tops: Vec<usize>,
    reached: Vec<bool>,
}

impl Reached {
    /// Hangs `forest` up at `tops`.
    pub(super) fn from_tops(graph: &Graph, forest: &[(usize, usize)], tops: &[usize]) -> Self {
        let n = graph.len();
        let mut beside = vec![Vec::new(); n];
        for &(a, b) in forest {
            beside[a].push(b);
            beside[b].push(a);
        }
        let mut tree = Self {
            up: vec![None; n],
            below: vec![Vec::new(); n],
            tops: tops.to_vec(),
            reached: vec![false; n],
        };
        for &top in tops {
            tree.reached[top] = true;
        }
        for &top in tops {
            tree.hang(top, &mut beside);
        }
        tree
    }

    /// Hangs every part of `forest` up at its lowest vertex.
    pub(super) fn from_each_part(graph: &Graph, forest: &[(usize, usize)]) -> Self {
        let mut parts = Parts::new(graph.len());
        for &(a, b) in forest {
            parts.join(a, b);
        }
        let tops: Vec<usize> = (0..graph.len()).filter(|&v| parts.find(v) == v).collect();
        Self::from_tops(graph, forest, &tops)
    }

    fn hang(&mut self, top: usize, beside: &mut [Vec<usize>]) {
        let mut stack = vec![top];
        while let Some(v) = stack.pop() {
            for w in core::mem::take(&mut beside[v]) {
                if !self.reached[w] {
                    self.reached[w] = true;
                    self.up[w] = Some(v);
                    self.below[v].push(w);
                    stack.push(w);
                }
            }
        }
    }

    pub(super) fn all_reached(&self) -> bool {
        self.reached.iter().all(|&r| r)
    }

    /// The vertices below `top`, each after the one above it.
    pub(super) fn preorder(&self, top: usize) -> Vec<usize> {
        let (mut order, mut stack) = (Vec::new(), vec![top]);
        while let Some(v) = stack.pop() {
            order.push(v);
            stack.extend(self.below[v].iter().rev());
        }
        order
    }

    pub(super) fn weight_below(&self, graph: &Graph, top: usize) -> f64 {
        let below = self.preorder(top).into_iter().filter(|&v| v != top);
        below
            .filter_map(|v| self.up[v].map(|up| graph.weight((up, v))))
            .sum()
    }
}
