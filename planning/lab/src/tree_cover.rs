//! Min-max tree covers: rooted at given places, or anywhere (D2.7 §3.4.2, algorithm 4,
//! after Even et al.).
//!
//! Even, Garg, Könemann, Ravi and Sinha, "Min-max tree covers of graphs", 2004,
//! <https://doi.org/10.1016/j.orl.2003.11.010>.
//!
//! D2.7's listing omits that a place out of reach of all roots once edges above `B` are
//! gone proves failure too; and a tree is matched to a root by its distance to the root.

use super::graph::{Graph, Paths, Reached};
use skein_flight::coverage::metric::Metric;
use skein_flight::coverage::tour::{Tour, closed_cost};

/// The search for `B` ends when success and failure are this close, relative to `B`.
const PRECISION: f64 = 1e-9;

/// A tree of a cover.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CoverTree {
    /// Its root, for a rooted cover: an index into the roots.
    pub root: Option<usize>,
    /// Its vertices, ascending. A vertex alone is a tree too, and needs a visit.
    pub vertices: Vec<usize>,
    /// Its edges; an edge may be there twice where the way to the root uses it again.
    pub edges: Vec<(usize, usize)>,
    /// Sum of its edges.
    pub weight: f64,
}

/// A cover of all vertices by trees.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeCover {
    /// The trees. A rooted cover has one for every root, in the order of the roots; an
    /// unrooted one at most as many as asked for.
    pub trees: Vec<CoverTree>,
    /// The weight of the heaviest tree.
    pub cost: f64,
    /// No cover by so many trees costs less.
    pub lower_bound: f64,
}

/// Covers all vertices by one tree for each root so that the heaviest weighs at most `4 B`.
///
/// `None` proves that every such cover costs more than `B`.
#[must_use]
pub fn rooted_within(graph: &Graph, roots: &[usize], b: f64) -> Option<Vec<CoverTree>> {
    Rooted::new(graph, roots)?.within(b)
}

/// Covers all vertices by one tree for each root, the heaviest as light as the search
/// for `B` makes it.
///
/// `None` when there is no root, or a vertex that no root can reach.
///
/// # Guarantees
/// The heaviest tree weighs at most `4 (1 + 1e-9)` times the optimum; a tour around it
/// (see [`crate::tree_cover::around_tree`]) at most 8 times the optimal tour cover.
///
/// # Complexity
/// O(k m log n) once, then O(n k + k³) for each `B` that is tried.
#[must_use]
pub fn rooted(graph: &Graph, roots: &[usize]) -> Option<TreeCover> {
    let rooted = Rooted::new(graph, roots)?;
    let far = rooted.farthest();
    let share = rooted.weight / roots.len() as f64;
    let proved = rooted.heaviest_edge.max(share).max(far);
    search(proved, rooted.weight, |b| rooted.within(b))
}

/// Covers all vertices by at most `k` trees, wherever they lie.
///
/// `None` proves that every such cover costs more than `B`.
#[must_use]
pub fn unrooted_within(graph: &Graph, k: usize, b: f64) -> Option<Vec<CoverTree>> {
    let forest: Vec<_> = graph
        .spanning_forest()
        .into_iter()
        .filter(|&e| graph.weight(e) <= b)
        .collect();
    let tree = Reached::from_each_part(graph, &forest);
    let mut needed = 0.0;
    for &top in &tree.tops {
        needed += (tree.weight_below(graph, top) / (2.0 * b)).floor().max(0.0) + 1.0;
    }
    if b <= 0.0 {
        needed = tree.tops.len() as f64;
    }
    if needed > k as f64 {
        return None;
    }
    let mut trees = Vec::new();
    for &top in &tree.tops {
        let (mut parts, rest) = decompose(graph, &tree, top, 2.0 * b);
        let held = |v: usize| parts.iter().any(|p| p.vertices.binary_search(&v).is_ok());
        if !rest.edges.is_empty() || !held(top) {
            parts.push(rest);
        }
        trees.extend(parts);
    }
    Some(trees)
}

/// Covers all vertices by at most `k` trees wherever they lie, the heaviest as light as
/// the search for `B` makes it: for choosing `k` launch points, one in each tree.
///
/// `None` for `k` = 0, or when the graph has more than `k` parts.
///
/// # Guarantees
/// The heaviest tree weighs at most `4 (1 + 1e-9)` times the optimum.
#[must_use]
pub fn unrooted(graph: &Graph, k: usize) -> Option<TreeCover> {
    if graph.is_empty() || k == 0 {
        return None;
    }
    let weight: f64 = graph
        .spanning_forest()
        .into_iter()
        .map(|e| graph.weight(e))
        .sum();
    search(0.0, weight, |b| unrooted_within(graph, k, b))
}

/// Narrows `B` between a failure, which proves a bound, and a success, which gives a
/// cover. Success need not be monotone in `B`, so both ends are kept as found.
fn search(
    proved: f64,
    enough: f64,
    within: impl Fn(f64) -> Option<Vec<CoverTree>>,
) -> Option<TreeCover> {
    let cover = |trees: Vec<CoverTree>, lower_bound: f64| {
        let cost = trees.iter().map(|t| t.weight).fold(0.0, f64::max);
        Some(TreeCover {
            trees,
            cost,
            lower_bound: lower_bound.min(cost),
        })
    };
    if let Some(trees) = within(proved) {
        return cover(trees, proved);
    }
    let (mut low, mut high) = (proved, enough.max(proved));
    let mut best = within(high)?;
    let cost = |trees: &[CoverTree]| trees.iter().map(|t| t.weight).fold(0.0, f64::max);
    while high - low > PRECISION * high {
        let middle = 0.5 * (low + high);
        match within(middle) {
            Some(trees) => {
                high = middle;
                // A larger B may have given a lighter cover: keep that.
                if cost(&trees) < cost(&best) {
                    best = trees;
                }
            }
            None => low = middle,
        }
    }
    cover(best, low)
}

/// What does not depend on `B`.
struct Rooted<'a> {
    graph: &'a Graph,
    roots: &'a [usize],
    /// Minimum spanning tree of the graph with the roots contracted, taken apart again.
    tree: Reached,
    paths: Vec<Paths>,
    weight: f64,
    heaviest_edge: f64,
}

impl<'a> Rooted<'a> {
    fn new(graph: &'a Graph, roots: &'a [usize]) -> Option<Self> {
        if roots.is_empty() || roots.iter().any(|&r| r >= graph.len()) {
            return None;
        }
        let forest = graph.spanning_forest_of_contracted(roots);
        let tree = Reached::from_tops(graph, &forest, roots);
        if !tree.all_reached() {
            return None;
        }
        let weights = || forest.iter().map(|&e| graph.weight(e));
        Some(Self {
            graph,
            roots,
            tree,
            paths: roots.iter().map(|&r| graph.paths_from(r)).collect(),
            weight: weights().sum(),
            heaviest_edge: weights().fold(0.0, f64::max),
        })
    }

    /// The distance of the vertex that is farthest from all roots.
    fn farthest(&self) -> f64 {
        (0..self.graph.len())
            .map(|v| {
                let all = self.paths.iter().map(|p| p.distance(v));
                all.fold(f64::INFINITY, f64::min)
            })
            .fold(0.0, f64::max)
    }

    fn within(&self, b: f64) -> Option<Vec<CoverTree>> {
        // Without the edges above B some vertex would be out of reach.
        if self.heaviest_edge > b {
            return None;
        }
        let (mut leftovers, mut parts) = (Vec::new(), Vec::new());
        for &r in self.roots {
            let (more, rest) = decompose(self.graph, &self.tree, r, b);
            leftovers.push(rest);
            parts.extend(more);
            if parts.len() > self.roots.len() {
                return None;
            }
        }
        let near = |part: &CoverTree, root: usize| {
            let nearest = part.vertices.iter().copied().min_by(|&x, &y| {
                let d = |v: usize| self.paths[root].distance(v);
                d(x).total_cmp(&d(y)).then(x.cmp(&y))
            });
            nearest.filter(|&v| self.paths[root].distance(v) <= b)
        };
        let allowed: Vec<Vec<usize>> = parts
            .iter()
            .map(|p| {
                let roots = 0..self.roots.len();
                roots.filter(|&r| near(p, r).is_some()).collect()
            })
            .collect();
        let owner = match_all(&allowed, self.roots.len())?;
        let mut trees = leftovers;
        for (root, tree) in trees.iter_mut().enumerate() {
            tree.root = Some(root);
        }
        for (part, root) in parts.into_iter().zip(owner) {
            let way = near(&part, root).map_or_else(Vec::new, |v| self.paths[root].way_to(v));
            trees[root].add(self.graph, &part, &way);
        }
        Some(trees)
    }
}

impl CoverTree {
    fn add(&mut self, graph: &Graph, part: &Self, way: &[(usize, usize)]) {
        self.edges.extend(&part.edges);
        self.vertices.extend(&part.vertices);
        for &(x, y) in way {
            self.edges.push((x, y));
            self.vertices.extend([x, y]);
            self.weight += graph.weight((x, y));
        }
        self.weight += part.weight;
        self.vertices.sort_unstable();
        self.vertices.dedup();
    }
}

/// Gives every left node an own right node, or tells that it is impossible.
fn match_all(allowed: &[Vec<usize>], rights: usize) -> Option<Vec<usize>> {
    fn place(
        left: usize,
        allowed: &[Vec<usize>],
        seen: &mut [bool],
        of: &mut [Option<usize>],
    ) -> bool {
        for &r in &allowed[left] {
            if core::mem::replace(&mut seen[r], true) {
                continue;
            }
            let free = match of[r] {
                None => true,
                Some(other) => place(other, allowed, seen, of),
            };
            if free {
                of[r] = Some(left);
                return true;
            }
        }
        false
    }
    let mut of: Vec<Option<usize>> = vec![None; rights];
    for left in 0..allowed.len() {
        if !place(left, allowed, &mut vec![false; rights], &mut of) {
            return None;
        }
    }
    let mut owner = vec![0; allowed.len()];
    for (r, left) in of.iter().enumerate() {
        if let Some(left) = left {
            owner[*left] = r;
        }
    }
    Some(owner)
}

/// A branch that is not cut off yet.
#[derive(Default)]
struct Pending {
    edges: Vec<(usize, usize)>,
    weight: f64,
}

/// Splits the tree below `top` by edges into parts of weight in `[b, 2 b)` and a rest
/// below `b` that holds `top`. No edge of the tree may be above `b`.
fn decompose(graph: &Graph, tree: &Reached, top: usize, b: f64) -> (Vec<CoverTree>, CoverTree) {
    let order = tree.preorder(top);
    let mut parts = Vec::new();
    let mut pending: Vec<Pending> = Vec::new();
    pending.resize_with(graph.len(), Pending::default);
    for &v in order.iter().rev() {
        let mut branch = core::mem::take(&mut pending[v]);
        let Some(up) = tree.up[v].filter(|_| v != top) else {
            let rest = as_tree(branch, top);
            return (parts, rest);
        };
        branch.edges.push((up, v));
        branch.weight += graph.weight((up, v));
        if branch.weight >= b {
            parts.push(as_tree(branch, up));
            continue;
        }
        let sum = &mut pending[up];
        sum.weight += branch.weight;
        sum.edges.append(&mut branch.edges);
        if sum.weight >= b {
            parts.push(as_tree(core::mem::take(sum), up));
        }
    }
    (parts, as_tree(Pending::default(), top))
}

fn as_tree(branch: Pending, at: usize) -> CoverTree {
    let mut vertices: Vec<usize> = branch.edges.iter().flat_map(|&(x, y)| [x, y]).collect();
    vertices.push(at);
    vertices.sort_unstable();
    vertices.dedup();
    CoverTree {
        root: None,
        vertices,
        edges: branch.edges,
        weight: branch.weight,
    }
}

/// The tour around a tree from `start`: its vertices in preorder.
///
/// # Guarantees
/// At most twice the tree's weight, where the costs obey the triangle inequality.
#[must_use]
pub fn around_tree(tree: &CoverTree, start: usize, metric: &impl Metric) -> Tour {
    let mut order = Vec::with_capacity(tree.vertices.len());
    let mut stack = vec![start];
    while let Some(v) = stack.pop() {
        if order.contains(&v) {
            continue;
        }
        order.push(v);
        let mut next: Vec<usize> = tree
            .edges
            .iter()
            .filter(|e| e.0 == v || e.1 == v)
            .map(|e| if e.0 == v { e.1 } else { e.0 })
            .collect();
        next.sort_unstable_by_key(|&w| core::cmp::Reverse(w));
        stack.extend(next);
    }
    let cost = closed_cost(&order, metric);
    Tour { order, cost }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_geometry::random::SplitMix64;

    fn random_graph(random: &mut SplitMix64, n: usize, share: f64) -> Graph {
        let mut edges = Vec::new();
        for a in 0..n {
            for b in a + 1..n {
                if random.unit() < share {
                    edges.push((a, b, 1.0 + random.below(20) as f64));
                }
            }
        }
        Graph::new(n, &edges)
    }

    /// The lightest tree that holds all vertices of each set, possibly others.
    fn steiner(g: &Graph) -> Vec<f64> {
        let n = g.len();
        let span = |set: usize| {
            let (mut inside, mut sum) = (set & set.wrapping_neg(), 0.0);
            while inside != set {
                let mut best = (f64::INFINITY, 0);
                for (a, b, w) in g.edges() {
                    for (x, y) in [(a, b), (b, a)] {
                        let leads_out = inside & (1 << x) != 0 && inside & (1 << y) == 0;
                        if leads_out && set & (1 << y) != 0 && w < best.0 {
                            best = (w, y);
                        }
                    }
                }
                if best.0.is_infinite() {
                    return f64::INFINITY;
                }
                inside |= 1 << best.1;
                sum += best.0;
            }
            sum
        };
        let alone: Vec<f64> = (0..1usize << n).map(span).collect();
        (0..1usize << n)
            .map(|set| {
                let more = (0..1usize << n).filter(|t| t & set == set);
                more.map(|t| alone[t]).fold(f64::INFINITY, f64::min)
            })
            .collect()
    }

    /// The least heaviest tree when tree `i` must hold the vertices of `fixed[i]`.
    fn oracle(g: &Graph, fixed: &[usize]) -> f64 {
        let light = steiner(g);
        let full = (1usize << g.len()) - 1;
        let mut reach = vec![f64::INFINITY; full + 1];
        reach[0] = 0.0;
        for &own in fixed {
            let mut next = vec![f64::INFINITY; full + 1];
            for (set, slot) in next.iter_mut().enumerate() {
                let mut part = set;
                loop {
                    let weight = if part | own == 0 {
                        0.0
                    } else {
                        light[part | own]
                    };
                    *slot = slot.min(weight.max(reach[set & !part]));
                    if part == 0 {
                        break;
                    }
                    part = (part - 1) & set;
                }
            }
            reach = next;
        }
        reach[full]
    }

    fn check(g: &Graph, trees: &[CoverTree], roots: Option<&[usize]>) {
        let mut covered = vec![false; g.len()];
        for (i, t) in trees.iter().enumerate() {
            let sum: f64 = t.edges.iter().map(|&e| g.weight(e)).sum();
            assert!((sum - t.weight).abs() < 1e-9 && sum.is_finite());
            let mut joined = vec![t.vertices[0]];
            let mut i_seen = 0;
            while i_seen < joined.len() {
                let x = joined[i_seen];
                for &(a, b) in &t.edges {
                    for (p, q) in [(a, b), (b, a)] {
                        if p == x && !joined.contains(&q) {
                            joined.push(q);
                        }
                    }
                }
                i_seen += 1;
            }
            joined.sort_unstable();
            assert_eq!(joined, t.vertices, "in one piece");
            for &v in &t.vertices {
                covered[v] = true;
            }
            if let Some(roots) = roots {
                assert_eq!(t.root, Some(i));
                assert!(t.vertices.contains(&roots[i]));
            }
        }
        assert!(covered.iter().all(|&c| c));
    }

    #[test]
    fn rooted_covers_keep_their_factor_and_failures_prove_their_bound() {
        let mut random = SplitMix64::new(21);
        let (mut solved, mut failed, mut worst) = (0, 0, 0.0f64);
        for _ in 0..150 {
            let n = 4 + random.below(4);
            let share = 0.35 + 0.6 * random.unit();
            let g = random_graph(&mut random, n, share);
            let mut all: Vec<usize> = (0..n).collect();
            random.shuffle(&mut all);
            let roots = &all[..1 + random.below(3)];
            let fixed: Vec<usize> = roots.iter().map(|&r| 1 << r).collect();
            let best = oracle(&g, &fixed);
            let Some(cover) = rooted(&g, roots) else {
                assert!(best.is_infinite());
                failed += 1;
                continue;
            };
            solved += 1;
            check(&g, &cover.trees, Some(roots));
            assert_eq!(cover.trees.len(), roots.len());
            assert!(cover.cost <= 4.0 * best * (1.0 + 1e-8) + 1e-9);
            assert!(cover.lower_bound <= best + 1e-9);
            if best > 0.0 {
                worst = worst.max(cover.cost / best);
            }
            for b in [0.3, 0.6, 0.9, 1.0, 1.3, 2.0].map(|s| s * best) {
                match rooted_within(&g, roots, b) {
                    Some(trees) => {
                        check(&g, &trees, Some(roots));
                        assert!(trees.iter().all(|t| t.weight <= 4.0 * b + 1e-9));
                    }
                    None => assert!(b < best),
                }
            }
        }
        assert!(
            solved > 80 && failed > 5 && worst > 1.0,
            "{solved} {failed} {worst}"
        );
    }

    #[test]
    fn unrooted_covers_keep_their_factor_and_failures_prove_their_bound() {
        let mut random = SplitMix64::new(22);
        let (mut solved, mut failed) = (0, 0);
        for _ in 0..150 {
            let n = 4 + random.below(4);
            let share = 0.25 + 0.6 * random.unit();
            let g = random_graph(&mut random, n, share);
            let k = 1 + random.below(3);
            let best = oracle(&g, &vec![0; k]);
            let Some(cover) = unrooted(&g, k) else {
                assert!(best.is_infinite());
                failed += 1;
                continue;
            };
            solved += 1;
            check(&g, &cover.trees, None);
            assert!(cover.trees.len() <= k);
            assert!(cover.cost <= 4.0 * best * (1.0 + 1e-8) + 1e-9);
            assert!(cover.lower_bound <= best + 1e-9);
            for b in [0.3, 0.6, 0.9, 1.0, 1.3, 2.0].map(|s| s * best) {
                match unrooted_within(&g, k, b) {
                    Some(trees) => {
                        check(&g, &trees, None);
                        assert!(trees.len() <= k);
                        assert!(trees.iter().all(|t| t.weight <= 4.0 * b + 1e-9));
                    }
                    None => assert!(b < best),
                }
            }
        }
        assert!(solved > 80 && failed > 5, "{solved} {failed}");
    }

    #[test]
    fn a_place_beyond_all_light_edges_fails_at_once() {
        // Two roots near each other, a vertex behind one edge of weight 10.
        let g = Graph::new(3, &[(0, 1, 1.0), (1, 2, 10.0)]);
        assert!(rooted_within(&g, &[0, 1], 9.9).is_none());
        assert!(rooted_within(&g, &[0, 1], 10.0).is_some());
        let apart = Graph::new(3, &[(0, 1, 1.0)]);
        assert!(rooted(&apart, &[0, 1]).is_none());
        assert!(rooted(&apart, &[]).is_none() && rooted(&apart, &[7]).is_none());
    }
}
