//! The quickest way along a network from a place to a place (D2.7 §3.1: path hints for emergency
//! vehicles), by Dijkstra's algorithm from petgraph.
//!
//! # Guarantees
//! No way along the streets takes less, from the place of a street that is nearest to the first
//! place to that nearest to the second, by the seconds a metre that each stretch is given. Where
//! these two do not hang together, the nearest that do take their part.

use super::matching::Matched;
use super::network::Network;
use petgraph::algo::astar;
use petgraph::graph::{NodeIndex, UnGraph};
use petgraph::unionfind::UnionFind;
use skein_geometry::frame::Point;
use std::collections::BTreeMap;

/// Who asks is no farther from a street, metres.
pub const REACH_M: f64 = 150.0;

/// What is shorter is no part of a way, metres.
const LEAST_M: f64 = 1e-6;

/// A part of a way: a stretch, or some of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leg {
    /// Which stretch.
    pub edge: u16,
    /// From where to where along it, metres; the second is the less where it is driven backwards.
    pub from_m: f64,
    /// To where.
    pub to_m: f64,
}

impl Leg {
    /// How long it is, metres.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        (self.to_m - self.from_m).abs()
    }
}

impl Network {
    /// The place of a street that is nearest; none within [`REACH_M`].
    #[must_use]
    pub fn nearest(&self, to: Point) -> Option<Matched> {
        self.near(to).reduce(nearer)
    }

    /// The places of all pieces of streets within [`REACH_M`].
    fn near(&self, to: Point) -> impl Iterator<Item = Matched> {
        let all = self.on_each_piece(to).map(|(m, _)| m);
        all.filter(|m| m.aside_m <= REACH_M)
    }

    /// Where a way begins and where it ends: where streets that hang together pass nearest to both
    /// places. A stub of a street that leads nowhere does not keep the next street from serving.
    fn ends_of_way(&self, from: Point, to: Point) -> Option<(Matched, Matched)> {
        let mut joined = UnionFind::<usize>::new(self.crossings().len());
        for e in self.edges() {
            let [a, b] = e.ends.map(usize::from);
            joined.try_union(a, b).ok()?;
        }
        let of = |m: &Matched| {
            let e = self.edges().get(usize::from(m.edge))?;
            joined.try_find(usize::from(e.ends[0]))
        };
        let nearest = |place: Point| {
            let mut by: BTreeMap<usize, Matched> = BTreeMap::new();
            for m in self.near(place) {
                if let Some(part) = of(&m) {
                    let best = by.entry(part).or_insert(m);
                    *best = nearer(*best, m);
                }
            }
            by
        };
        let (begins, ends) = (nearest(from), nearest(to));
        let both = begins
            .iter()
            .filter_map(|(part, a)| Some((*a, *ends.get(part)?)));
        both.min_by(|(a, b), (c, d)| (a.aside_m + b.aside_m).total_cmp(&(c.aside_m + d.aside_m)))
    }

    /// The quickest way, its parts in order; none where the streets do not lead there, or a place
    /// is far from all of them. `s_per_m` gives the seconds a metre of each stretch.
    #[must_use]
    pub fn quickest(
        &self,
        from: Point,
        to: Point,
        s_per_m: &dyn Fn(u16) -> f64,
    ) -> Option<Vec<Leg>> {
        let (begin, end) = self.ends_of_way(from, to)?;
        // Nodes are the crossings, then the two places.
        let mut graph: UnGraph<(), (f64, Leg)> = UnGraph::default();
        let nodes: Vec<NodeIndex> = (0..self.crossings().len() + 2)
            .map(|_| graph.add_node(()))
            .collect();
        let (first, last) = (nodes[nodes.len() - 2], nodes[nodes.len() - 1]);
        let node = |crossing: u16| nodes.get(usize::from(crossing)).copied();
        let mut join = |a: NodeIndex, b: NodeIndex, leg: Leg| {
            let cost_s = leg.length_m() * s_per_m(leg.edge).max(0.0);
            graph.add_edge(a, b, (cost_s, leg));
        };
        for (edge, e) in (0_u16..).zip(self.edges()) {
            let whole = Leg {
                edge,
                from_m: 0.0,
                to_m: e.length_m,
            };
            join(node(e.ends[0])?, node(e.ends[1])?, whole);
        }
        for (at, m) in [(first, begin), (last, end)] {
            let e = self.edges().get(usize::from(m.edge))?;
            for (end, to_m) in [(e.ends[0], 0.0), (e.ends[1], e.length_m)] {
                let part = Leg {
                    edge: m.edge,
                    from_m: m.along_m,
                    to_m,
                };
                join(at, node(end)?, part);
            }
        }
        if begin.edge == end.edge {
            let part = Leg {
                edge: begin.edge,
                from_m: begin.along_m,
                to_m: end.along_m,
            };
            join(first, last, part);
        }
        let cost = |e: petgraph::graph::EdgeReference<'_, (f64, Leg)>| e.weight().0;
        let (_, way) = astar(&graph, first, |n| n == last, cost, |_| 0.0)?;
        let legs = way.windows(2).map(|w| {
            let between = graph.edges_connecting(w[0], w[1]);
            let least = between.min_by(|a, b| a.weight().0.total_cmp(&b.weight().0))?;
            let leg = least.weight().1;
            // Edges of the graph have no direction: a stretch begins where it was put in.
            let (source, _) = graph.edge_endpoints(petgraph::visit::EdgeRef::id(&least))?;
            Some(if source == w[0] {
                leg
            } else {
                Leg {
                    from_m: leg.to_m,
                    to_m: leg.from_m,
                    ..leg
                }
            })
        });
        let mut legs = legs.collect::<Option<Vec<Leg>>>()?;
        // Who begins or ends at a crossing drives nothing of the stretch that was found nearest.
        let driven = legs.iter().any(|l| l.length_m() > LEAST_M);
        legs.retain(|l| !driven || l.length_m() > LEAST_M);
        Some(legs)
    }

    /// The middle line of a way, metres.
    #[must_use]
    pub fn line(&self, legs: &[Leg]) -> Vec<Point> {
        let mut line = Vec::new();
        for leg in legs {
            let Some(e) = self.edges().get(usize::from(leg.edge)) else {
                continue;
            };
            let (low_m, high_m) = (leg.from_m.min(leg.to_m), leg.from_m.max(leg.to_m));
            let mut part: Vec<Point> = super::network::along(&e.way, low_m).into_iter().collect();
            let mut m = 0.0;
            for w in e.way.windows(2) {
                m += (w[1] - w[0]).norm();
                if m > low_m && m < high_m {
                    part.push(w[1]);
                }
            }
            part.extend(super::network::along(&e.way, high_m));
            if leg.from_m > leg.to_m {
                part.reverse();
            }
            line.extend(part);
        }
        line.dedup();
        line
    }
}

/// Of two places the nearer one, of two as near the later one.
fn nearer(a: Matched, b: Matched) -> Matched {
    if b.aside_m <= a.aside_m { b } else { a }
}

#[cfg(test)]
mod tests {
    use super::super::network::tests::grid;
    use super::*;
    use crate::streets::network::length_m;
    use skein_geometry::random::SplitMix64;

    #[test]
    fn the_way_is_the_quickest_and_goes_round_what_is_slow() {
        let net = Network::of(&grid(3, 100.0));
        let (from, to) = (Point::new(0.0, 150.0), Point::new(300.0, 150.0));
        let even = net.quickest(from, to, &|_| 0.1).unwrap();
        assert!((even.iter().map(Leg::length_m).sum::<f64>() - 400.0).abs() < 1e-6);
        let line = net.line(&even);
        assert!((length_m(&line) - 400.0).abs() < 1e-6);
        assert!((line[0] - from).norm() < 1e-9 && (line[line.len() - 1] - to).norm() < 1e-9);
        let slow: Vec<u16> = even.iter().map(|l| l.edge).collect();
        let round = net
            .quickest(from, to, &|e| {
                if slow[1..slow.len() - 1].contains(&e) {
                    2.0
                } else {
                    0.1
                }
            })
            .unwrap();
        assert!(
            !round
                .iter()
                .any(|l| slow[1..slow.len() - 1].contains(&l.edge))
        );
        assert!(net.quickest(Point::new(900.0, 0.0), to, &|_| 0.1).is_none());
        let near = net
            .quickest(from, Point::new(0.0, 180.0), &|_| 0.1)
            .unwrap();
        assert!(near.len() == 1 && (near[0].length_m() - 30.0).abs() < 1e-9);
    }

    #[test]
    fn a_stub_that_leads_nowhere_is_passed_over() {
        let mut streets = grid(3, 100.0);
        streets.push((0, vec![Point::new(-30.0, 20.0), Point::new(-30.0, 80.0)]));
        let net = Network::of(&streets);
        let (from, to) = (Point::new(-25.0, 50.0), Point::new(300.0, 150.0));
        assert!((net.nearest(from).unwrap().aside_m - 5.0).abs() < 1e-9);
        let way = net.quickest(from, to, &|_| 0.1).unwrap();
        assert!((way.iter().map(Leg::length_m).sum::<f64>() - 400.0).abs() < 1e-6);
        // Who drives from end to end of the stub stays on it.
        let along = net
            .quickest(from, Point::new(-30.0, 58.0), &|_| 0.1)
            .unwrap();
        assert!((along.iter().map(Leg::length_m).sum::<f64>() - 8.0).abs() < 1e-6);
    }

    /// Bellman and Ford, on crossings alone.
    #[test]
    fn no_way_by_brute_force_takes_less() {
        let net = Network::of(&grid(3, 100.0));
        let mut random = SplitMix64::new(4);
        for _ in 0..50 {
            let pace: Vec<f64> = net.edges().iter().map(|_| 0.05 + random.unit()).collect();
            let n = net.crossings().len();
            let (a, b) = (random.below(n), random.below(n));
            if a == b {
                continue;
            }
            let mut least = vec![f64::INFINITY; n];
            least[a] = 0.0;
            for _ in 0..n {
                for (e, s) in net.edges().iter().zip(&pace) {
                    let [x, y] = e.ends.map(usize::from);
                    let cost = e.length_m * s;
                    least[y] = least[y].min(least[x] + cost);
                    least[x] = least[x].min(least[y] + cost);
                }
            }
            let (from, to) = (net.crossings()[a], net.crossings()[b]);
            let legs = net.quickest(from, to, &|e| pace[usize::from(e)]).unwrap();
            let cost: f64 = legs
                .iter()
                .map(|l| l.length_m() * pace[usize::from(l.edge)])
                .sum();
            assert!((cost - least[b]).abs() < 1e-6, "{cost} {}", least[b]);
        }
    }
}
