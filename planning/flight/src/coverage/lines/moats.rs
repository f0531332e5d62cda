//! Lower bound of joining parts that are apart, and tours that join them cheaply (D2.7
//! §3.5 has neither): moats round parts.
//!
//! A closed tour along all lines crosses the border of every set of parts twice. A moat
//! round such a set takes its width off every deadhead across and pays twice its width
//! for certain; the cheapest pairing in what is left of the costs, with all moats paid,
//! is then a lower bound. Widths climb where the pairing does not cross its moat, and
//! fall where it crosses more than twice (a subgradient ascent); each pairing on the
//! way, joined up, is a tour to choose from.
//!
//! The ascent is that of Held and Karp, "The traveling-salesman problem and minimum
//! spanning trees", 1970, <https://doi.org/10.1287/opre.18.6.1138>, with a pairing in the
//! place of the tree.
//!
//! Leaves the pairing itself to `matching`, joining and walking to `postman`.

use super::matching::pair_up;
use super::parts::Parts;
use super::postman::{Deadheads, Graph};
use crate::coverage::metric::Metric;
use core::cmp::Reverse;
use std::collections::BinaryHeap;

/// Rounds of the ascent; widths hardly move afterwards.
const ROUNDS: usize = 30;

/// Looks at a cost that the ascent may take: some 30 ms.
const LOOKS: usize = 40_000_000;

/// Rounds without a better bound after which steps get shorter.
const PATIENCE: usize = 3;

/// Parts above which the ascent is left out: sets of parts are words of 64 bits, and the
/// passes of an area are a part each.
const MOST_PARTS: usize = 64;

/// Ways in what moats leave of the costs are looked for up to this many times the
/// longest deadhead of the pairing without moats. Farther ones count as that long, which
/// leaves the bound a bound; where one is used, the reach doubles.
const REACH: f64 = 1.5;

/// A reach beyond all deadheads, metres.
const FARTHEST: f64 = 1.0e7;

/// What the ascent ended with.
pub(super) struct Joined {
    /// No deadheads that join all parts and pair up all odd places cost less.
    pub bound: f64,
    /// The cheapest that were found.
    pub deadheads: Deadheads,
}

/// A moat round a set of parts.
struct Moat {
    inside: u64,
    width: f64,
}

struct Ascent<'a, M> {
    graph: &'a Graph<'a, M>,
    /// The part of each place, the places of odd parity.
    part: Vec<usize>,
    odd: Vec<usize>,
    parts: usize,
    /// The places of each part.
    members: Vec<Vec<usize>>,
    /// Costs between places and the least between parts, row by row.
    costs: Vec<f64>,
    least: Vec<f64>,
    reach: f64,
    moats: Vec<Moat>,
}

/// How thoroughly parts are joined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Joining {
    /// In the cheapest way at hand; the bound is that of the pairing.
    Simple,
    /// Against a bound that moats raise.
    Proven,
}

/// Joins the parts of `graph`, whose cheapest pairing is `pairs`.
pub(super) fn join<M: Metric>(graph: &Graph<'_, M>, pairs: Deadheads, how: Joining) -> Joined {
    let simple = |deadheads: &Deadheads| -> f64 {
        let costs = deadheads.iter().map(|&(a, b)| graph.cost(a, b));
        costs.sum()
    };
    let mut best = Joined {
        bound: simple(&pairs),
        deadheads: pairs.clone(),
    };
    graph.join_parts(&mut best.deadheads);
    let mut cost = simple(&best.deadheads);
    if best.deadheads.len() == pairs.len() && cost <= best.bound * (1.0 + 1e-12) {
        return best;
    }
    if how == Joining::Simple {
        return best;
    }
    let Some(mut ascent) = Ascent::new(graph, &pairs) else {
        return best;
    };
    let looks = ascent.odd.len() * graph.len() * graph.len() / 2;
    let (mut stride, mut since) = (1.0, 0);
    let mut found = pairs;
    for round in 0..ROUNDS.min(LOOKS / looks.max(1)) {
        if round > 0 {
            let (bound, deadheads) = ascent.pairing();
            found = deadheads;
            since += 1;
            if bound > best.bound {
                best.bound = bound;
                since = 0;
            }
            if since == PATIENCE {
                (stride, since) = (0.5 * stride, 0);
            }
        }
        let mut joined = found.clone();
        graph.join_parts(&mut joined);
        if simple(&joined) < cost {
            cost = simple(&joined);
            best.deadheads = joined;
        }
        let gap = cost - best.bound;
        if gap <= 1e-9 * cost || !ascent.climb(&found, stride * gap) {
            break;
        }
    }
    best
}

impl<'a, M: Metric> Ascent<'a, M> {
    fn new(graph: &'a Graph<'a, M>, pairs: &Deadheads) -> Option<Self> {
        let n = graph.len();
        let mut joined = graph.parts();
        let roots: Vec<usize> = (0..n).map(|p| joined.find(p)).collect();
        let mut tops = roots.clone();
        tops.sort_unstable();
        tops.dedup();
        let part: Vec<usize> = roots
            .iter()
            .map(|r| tops.partition_point(|t| t < r))
            .collect();
        let parts = tops.len();
        let odd = graph.odd();
        if !(2..=MOST_PARTS).contains(&parts) || odd.len() * n * n > LOOKS {
            return None;
        }
        let mut costs = vec![0.0; n * n];
        let mut least = vec![f64::INFINITY; parts * parts];
        for a in 0..n {
            for b in 0..a {
                let cost = graph.cost(a, b);
                costs[a * n + b] = cost;
                costs[b * n + a] = cost;
                for pair in [part[a] * parts + part[b], part[b] * parts + part[a]] {
                    least[pair] = cost.min(least[pair]);
                }
            }
        }
        let longest = pairs.iter().map(|&(a, b)| graph.cost(a, b));
        let widest = (0..parts)
            .map(|p| {
                let others = (0..parts).filter(|&q| q != p);
                others
                    .map(|q| least[p * parts + q])
                    .fold(f64::INFINITY, f64::min)
            })
            .fold(0.0, f64::max);
        Some(Self {
            reach: REACH * longest.fold(widest, f64::max),
            graph,
            members: (0..parts)
                .map(|i| (0..n).filter(|&p| part[p] == i).collect())
                .collect(),
            part,
            odd,
            parts,
            costs,
            least,
            moats: Vec::new(),
        })
    }

    /// What the moats take off a deadhead from part to part, row by row.
    fn taken_off(&self) -> Vec<f64> {
        let mut taken = vec![0.0; self.parts * self.parts];
        for moat in &self.moats {
            for i in 0..self.parts {
                for j in 0..self.parts {
                    if (moat.inside >> i ^ moat.inside >> j) & 1 == 1 {
                        taken[i * self.parts + j] += moat.width;
                    }
                }
            }
        }
        taken
    }

    /// The cheapest pairing in what the moats leave of the costs: the bound, and the
    /// deadheads, which may lead over places of other parts.
    fn pairing(&mut self) -> (f64, Deadheads) {
        let (n, taken) = (self.graph.len(), self.taken_off());
        let m = self.odd.len();
        let mut ways = vec![0.0; m * m];
        let mut came = vec![usize::MAX; m * n];
        let all: Vec<usize> = (0..m).collect();
        loop {
            for (i, &from) in self.odd.iter().enumerate() {
                let to = self.search(from, &taken, &mut came[i * n..(i + 1) * n]);
                for (j, &other) in self.odd.iter().enumerate() {
                    ways[i * m + j] = to[other].min(self.reach);
                }
            }
            // Rounding may make the way there and back differ.
            let way = |i: usize, j: usize| ways[i.min(j) * m + i.max(j)];
            let pairs = pair_up(&all, &way);
            let beyond = pairs.iter().any(|&(i, j)| way(i, j) >= self.reach);
            if beyond && self.reach < FARTHEST {
                self.reach *= 2.0;
                continue;
            }
            let paid: f64 = self.moats.iter().map(|moat| 2.0 * moat.width).sum();
            let bound = paid + pairs.iter().map(|&(i, j)| way(i, j)).sum::<f64>();
            let mut deadheads = Vec::new();
            for (i, j) in pairs {
                let mut at = self.odd[j];
                while at != self.odd[i] {
                    let before = came[i * n + at];
                    // A place that was never come near is flown to straight.
                    let before = if before == usize::MAX {
                        self.odd[i]
                    } else {
                        before
                    };
                    deadheads.push((before, at));
                    at = before;
                }
            }
            return (bound, deadheads);
        }
    }

    /// Shortest ways from a place in what the moats leave of the costs, up to the reach;
    /// `came` gets the place before each.
    ///
    /// By the triangle inequality, of two deadheads in a row one crosses a moat.
    fn search(&self, from: usize, taken: &[f64], came: &mut [usize]) -> Vec<f64> {
        let n = self.graph.len();
        let mut to = vec![f64::INFINITY; n];
        let mut over_moat = vec![false; n];
        to[from] = 0.0;
        over_moat[from] = true;
        // Costs are not negative, so that their bits are in order as they are.
        let mut heap = BinaryHeap::from([Reverse((0u64, from))]);
        while let Some(Reverse((bits, at))) = heap.pop() {
            let so_far = f64::from_bits(bits);
            if so_far >= self.reach {
                break;
            }
            if so_far > to[at] {
                continue;
            }
            let row = &self.costs[at * n..(at + 1) * n];
            for (members, less) in self
                .members
                .iter()
                .zip(&taken[self.part[at] * self.parts..])
            {
                if *less <= 0.0 && !over_moat[at] {
                    continue;
                }
                for &p in members {
                    let way = so_far + (row[p] - less).max(0.0);
                    if way < to[p] {
                        to[p] = way;
                        over_moat[p] = *less > 0.0;
                        came[p] = at;
                        heap.push(Reverse((way.to_bits(), p)));
                    }
                }
            }
        }
        to
    }

    /// Widens and narrows the moats by what `deadheads` cross; new ones are dug round
    /// what they leave apart. `false` when nothing calls for a change.
    fn climb(&mut self, deadheads: &Deadheads, gap: f64) -> bool {
        for inside in self.apart(deadheads) {
            if self.moats.iter().all(|m| m.inside != inside) {
                self.moats.push(Moat { inside, width: 0.0 });
            }
        }
        let crossings = |moat: &Moat| {
            let over = |&&(a, b): &&(usize, usize)| {
                (moat.inside >> self.part[a] ^ moat.inside >> self.part[b]) & 1 == 1
            };
            deadheads.iter().filter(over).count()
        };
        let slopes: Vec<f64> = self
            .moats
            .iter()
            .map(|moat| match 2.0 - crossings(moat) as f64 {
                slope if slope < 0.0 && moat.width <= 0.0 => 0.0,
                slope => slope,
            })
            .collect();
        let steep: f64 = slopes.iter().map(|s| s * s).sum();
        if steep < 0.5 {
            return false;
        }
        for (moat, slope) in self.moats.iter_mut().zip(slopes) {
            moat.width = (moat.width + gap * slope / steep).max(0.0);
        }
        self.keep_costs_above_zero();
        true
    }

    /// The sets of parts that `deadheads` leave apart, each without the first part.
    fn apart(&self, deadheads: &Deadheads) -> Vec<u64> {
        let mut joined = Parts::new(self.parts);
        for &(a, b) in deadheads {
            joined.join(self.part[a], self.part[b]);
        }
        let mut sets = vec![0u64; self.parts];
        for p in 0..self.parts {
            sets[joined.find(p)] |= 1 << p;
        }
        sets.retain(|&set| set != 0 && set & 1 == 0);
        sets
    }

    /// Narrows moats until no deadhead is shorter than those that it crosses.
    fn keep_costs_above_zero(&mut self) {
        for i in 0..self.parts {
            for j in 0..i {
                let across = |moat: &Moat| (moat.inside >> i ^ moat.inside >> j) & 1 == 1;
                let between = self.moats.iter().filter(|m| across(m));
                let width: f64 = between.map(|m| m.width).sum();
                let most = self.least[i * self.parts + j];
                if width > most {
                    for moat in self.moats.iter_mut().filter(|m| across(m)) {
                        moat.width *= most / width;
                    }
                }
            }
        }
    }
}
