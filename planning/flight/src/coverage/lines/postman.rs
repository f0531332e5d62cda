//! One UAV along all lines: the rural postman's tour (D2.7 §3.5, where one tour is k = 1).
//!
//! Pair up the places where an odd number of lines end, join what is still apart, and
//! walk the result. Leaves several tours to `split` and `improve`.

use super::matching::pair_up;
use super::moats::{self, Joining};
use super::network::{Line, Traversal, reversed};
use super::parts::Parts;
use crate::coverage::metric::Metric;
use skein_geometry::random::SplitMix64;

/// Deadheads by the numbers of the places that they join.
pub(super) type Deadheads = Vec<(usize, usize)>;

/// The postman's graph: lines and deadheads over places renumbered from 0.
pub(super) struct Graph<'a, M> {
    lines: &'a [Line],
    chosen: &'a [usize],
    /// The places in use, ascending; the graph numbers them by their index here.
    places: Vec<usize>,
    /// Tours begin at the first; a graph with several is no good for walks.
    depots: Vec<usize>,
    ends: Vec<(usize, usize)>,
    metric: &'a M,
}

/// What the postman found.
pub(super) struct Found {
    /// Closed tours along the same deadheads; they differ in which lines come one after
    /// the other, which matters when a tour is cut.
    pub tours: Vec<Vec<Traversal>>,
    /// No tour along the lines is cheaper.
    pub bound: f64,
}

/// A tour from `depot` along the `chosen` lines and back.
///
/// # Guarantees
/// As [`solve`].
pub(super) fn tour(
    lines: &[Line],
    chosen: &[usize],
    depot: usize,
    metric: &impl Metric,
) -> Vec<Traversal> {
    let graph = Graph::new(lines, chosen, &[depot], metric);
    let mut deadheads = graph.pairs();
    graph.join_parts(&mut deadheads);
    graph.walk(&deadheads, 0)
}

/// Tours from the first of `depots` along the `chosen` lines and back, in `count`
/// different walks, and what no closed tours from the depots can beat together.
///
/// # Guarantees
/// Where the lines hang together and the depot lies on them, and each line costs the
/// same both ways, a tour is the shortest there is: the lines plus a cheapest pairing
/// of the places where an odd number of them end. Otherwise the parts are joined by the
/// cheapest exchanges found, and the bound tells how far off that may be.
pub(super) fn solve(
    lines: &[Line],
    chosen: &[usize],
    depots: &[usize],
    metric: &impl Metric,
    count: usize,
    how: Joining,
) -> Found {
    let mut apart = depots.to_vec();
    apart.sort_unstable();
    apart.dedup();
    let first: Vec<usize> = depots.iter().copied().take(1).collect();
    let graph = Graph::new(lines, chosen, &first, metric);
    let joined = moats::join(&graph, graph.pairs(), how);
    let bound = if apart.len() > 1 {
        // Several depots join for nothing what hangs on them.
        let graph = Graph::new(lines, chosen, &apart, metric);
        moats::join(&graph, graph.pairs(), how).bound
    } else {
        joined.bound
    };
    let flown = chosen
        .iter()
        .map(|&l| lines[l].cost[0].min(lines[l].cost[1]));
    Found {
        bound: flown.sum::<f64>() + bound,
        tours: (0..count)
            .map(|seed| graph.walk(&joined.deadheads, seed as u64))
            .collect(),
    }
}

impl<'a, M: Metric> Graph<'a, M> {
    fn new(lines: &'a [Line], chosen: &'a [usize], depots: &[usize], metric: &'a M) -> Self {
        let mut places: Vec<usize> = chosen
            .iter()
            .flat_map(|&l| [lines[l].a, lines[l].b])
            .chain(depots.iter().copied())
            .collect();
        places.sort_unstable();
        places.dedup();
        let number = |p: usize| places.binary_search(&p).unwrap_or(0);
        let ends = chosen
            .iter()
            .map(|&l| (number(lines[l].a), number(lines[l].b)))
            .collect();
        Self {
            lines,
            chosen,
            depots: depots.iter().map(|&d| number(d)).collect(),
            places,
            ends,
            metric,
        }
    }

    /// How many places there are.
    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    /// The cost of a deadhead.
    pub(super) fn cost(&self, a: usize, b: usize) -> f64 {
        self.metric.cost(self.places[a], self.places[b])
    }

    /// The places where an odd number of lines end.
    pub(super) fn odd(&self) -> Vec<usize> {
        let mut odd = vec![false; self.places.len()];
        for &(a, b) in &self.ends {
            odd[a] = !odd[a];
            odd[b] = !odd[b];
        }
        (0..odd.len()).filter(|&p| odd[p]).collect()
    }

    /// What the lines alone join; all depots count as joined.
    pub(super) fn parts(&self) -> Parts {
        let mut parts = Parts::new(self.places.len());
        for w in self.depots.windows(2) {
            parts.join(w[0], w[1]);
        }
        for &(a, b) in &self.ends {
            parts.join(a, b);
        }
        parts
    }

    /// The cheapest pairing of the places where an odd number of lines end.
    fn pairs(&self) -> Deadheads {
        let places = self.odd();
        let known: Vec<usize> = places.iter().map(|&p| self.places[p]).collect();
        pair_up(&known, self.metric)
            .into_iter()
            .map(|(a, b)| (places[a], places[b]))
            .collect()
    }

    /// Changes the deadheads until all lines and the depots hang together: the smallest
    /// part that is apart is joined in the cheapest way, and so on.
    pub(super) fn join_parts(&self, deadheads: &mut Deadheads) {
        let n = self.places.len();
        let mut parts = self.parts();
        for &(a, b) in deadheads.iter() {
            parts.join(a, b);
        }
        let mut left = (0..n).filter(|&p| parts.find(p) == p).count();
        while left > 1 {
            let root: Vec<usize> = (0..n).map(|p| parts.find(p)).collect();
            let mut size = vec![0usize; n];
            for &r in &root {
                size[r] += 1;
            }
            let smallest = (0..n)
                .filter(|&r| size[r] > 0)
                .min_by_key(|&r| (size[r], r));
            let inside: Vec<bool> = root.iter().map(|&r| Some(r) == smallest).collect();
            let Some(change) = self.cheapest_join(&inside, deadheads) else {
                return;
            };
            let (x, y) = change.apply(deadheads);
            left -= usize::from(parts.join(x, y));
        }
    }

    fn cheapest_join(&self, inside: &[bool], deadheads: &[(usize, usize)]) -> Option<Join> {
        let mut best: Option<(f64, Join)> = None;
        let mut offer = |cost: f64, join: Join| {
            if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, join));
            }
        };
        let (within, without): (Vec<usize>, Vec<usize>) =
            (0..inside.len()).partition(|&p| inside[p]);
        for &x in &within {
            for &y in &without {
                offer(2.0 * self.cost(x, y), Join::Return(x, y));
            }
        }
        let (own, others): (Vec<usize>, Vec<usize>) =
            (0..deadheads.len()).partition(|&d| inside[deadheads[d].0]);
        for (these, places) in [(&own, &without), (&others, &within)] {
            for &d in these {
                let (a, b) = deadheads[d];
                let direct = self.cost(a, b);
                for &via in places {
                    let cost = self.cost(a, via) + self.cost(via, b) - direct;
                    offer(cost, Join::Detour(d, via));
                }
            }
        }
        for &d in &own {
            let (a, b) = deadheads[d];
            for &e in &others {
                let (p, q) = deadheads[e];
                let now = self.cost(a, b) + self.cost(p, q);
                offer(
                    self.cost(a, p) + self.cost(b, q) - now,
                    Join::Exchange(d, e, false),
                );
                offer(
                    self.cost(a, q) + self.cost(b, p) - now,
                    Join::Exchange(d, e, true),
                );
            }
        }
        best.map(|(_, join)| join)
    }

    /// A closed walk from the depot over every line and deadhead once (Hierholzer).
    ///
    /// Where several lead on, the `seed` decides which comes first.
    fn walk(&self, deadheads: &[(usize, usize)], seed: u64) -> Vec<Traversal> {
        let n = self.places.len();
        let edges: Vec<(usize, usize)> = self.ends.iter().chain(deadheads).copied().collect();
        let mut first = vec![0usize; n + 1];
        for &(a, b) in &edges {
            first[a + 1] += 1;
            first[b + 1] += 1;
        }
        for p in 0..n {
            first[p + 1] += first[p];
        }
        let mut fill = first.clone();
        let mut at = vec![0usize; edges.len() * 2];
        let mut order: Vec<usize> = (0..edges.len()).collect();
        if seed > 0 {
            SplitMix64::new(seed).shuffle(&mut order);
        }
        for e in order {
            let (a, b) = edges[e];
            for p in [a, b] {
                at[fill[p]] = e;
                fill[p] += 1;
            }
        }
        let mut used = vec![false; edges.len()];
        let mut next = first.clone();
        let mut stack: Vec<(usize, usize)> =
            vec![(self.depots.first().copied().unwrap_or(0), usize::MAX)];
        let mut passes = Vec::with_capacity(self.chosen.len());
        while let Some(&(p, came)) = stack.last() {
            while next[p] < first[p + 1] && used[at[next[p]]] {
                next[p] += 1;
            }
            if next[p] < first[p + 1] {
                let e = at[next[p]];
                used[e] = true;
                let (a, b) = edges[e];
                stack.push((if a == p { b } else { a }, e));
            } else {
                stack.pop();
                // The walk comes out reversed: the edge that led to `p` is left from `p`.
                if came < self.ends.len() {
                    passes.push(Traversal {
                        line: self.chosen[came],
                        backward: self.ends[came].0 != p,
                    });
                }
            }
        }
        self.cheaper_way_round(passes)
    }

    /// The walk or its reverse, whichever costs less.
    fn cheaper_way_round(&self, passes: Vec<Traversal>) -> Vec<Traversal> {
        let turned = reversed(&passes);
        let cost = |passes: &[Traversal]| passes.iter().map(|p| p.cost(self.lines)).sum::<f64>();
        if cost(&turned) < cost(&passes) {
            turned
        } else {
            passes
        }
    }
}

/// A way to join two parts without making any place odd.
#[derive(Clone, Copy, Debug)]
enum Join {
    /// There and back.
    Return(usize, usize),
    /// A deadhead bends over a place.
    Detour(usize, usize),
    /// Two deadheads exchange their ends.
    Exchange(usize, usize, bool),
}

impl Join {
    /// Carries it out; two places that hang together now.
    fn apply(self, deadheads: &mut Vec<(usize, usize)>) -> (usize, usize) {
        match self {
            Self::Return(x, y) => {
                deadheads.extend([(x, y), (x, y)]);
                (x, y)
            }
            Self::Detour(d, via) => {
                let (a, b) = deadheads[d];
                deadheads[d] = (a, via);
                deadheads.push((via, b));
                (a, via)
            }
            Self::Exchange(d, e, crossed) => {
                let ((a, b), (mut p, mut q)) = (deadheads[d], deadheads[e]);
                if crossed {
                    (p, q) = (q, p);
                }
                deadheads[d] = (a, p);
                deadheads[e] = (b, q);
                (a, p)
            }
        }
    }
}
