//! One closed tour through all points: the minimum spanning tree's preorder walk, then
//! 2-opt and Or-opt (D2.7 §3.4.1, algorithm 3).
//!
//! Croes, "A method for solving traveling-salesman problems", 1958,
//! <https://doi.org/10.1287/opre.6.6.791>; Or's exchange moves runs of up to three places
//! (thesis, 1976). Prim's tree is written out: it asks a metric for n² costs and keeps n,
//! where a graph library wants all of them as edges.

use crate::coverage::metric::Metric;

/// Neighbours of a point among which improving exchanges are sought.
const NEIGHBOURS: usize = 10;

/// The longest run of points that is moved at once.
const LONGEST_RUN: usize = 3;

/// A gain below this share of the tour's mean leg is rounding.
const ROUNDING: f64 = 1e-9;

/// A closed tour.
#[derive(Clone, Debug, PartialEq)]
pub struct Tour {
    /// The places in order of visit, the first not repeated.
    pub order: Vec<usize>,
    /// Its length, back to the first place included.
    pub cost: f64,
}

/// The length of a closed tour.
#[must_use]
pub fn closed_cost(order: &[usize], metric: &impl Metric) -> f64 {
    let n = order.len();
    (0..n)
        .map(|i| metric.cost(order[i], order[(i + 1) % n]))
        .sum()
}

/// The minimum spanning tree of `places` (Prim): for each place but the first, the index
/// of the one it hangs from; and its weight.
#[must_use]
pub fn spanning_tree(places: &[usize], metric: &impl Metric) -> (Vec<usize>, f64) {
    let n = places.len();
    let mut from = vec![0; n];
    let mut near = vec![f64::INFINITY; n];
    let mut inside = vec![false; n];
    let (mut weight, mut last) = (0.0, 0);
    for _ in 1..n {
        inside[last] = true;
        let mut next = (f64::INFINITY, usize::MAX);
        for v in (0..n).filter(|&v| !inside[v]) {
            let cost = metric.cost(places[last], places[v]);
            if cost < near[v] {
                near[v] = cost;
                from[v] = last;
            }
            if near[v] < next.0 || next.1 == usize::MAX {
                next = (near[v], v);
            }
        }
        weight += near[next.1];
        last = next.1;
    }
    (from, weight)
}

/// D2.7's algorithm 3: the spanning tree of `places` in preorder from the first of them.
///
/// # Guarantees
/// Every place once; at most twice the spanning tree and so twice the optimum, where the
/// costs obey the triangle inequality.
///
/// # Complexity
/// O(n²).
#[must_use]
pub fn mst_tour(places: &[usize], metric: &impl Metric) -> Tour {
    let (from, _) = spanning_tree(places, metric);
    let mut below = vec![Vec::new(); places.len()];
    for v in 1..places.len() {
        below[from[v]].push(v);
    }
    let mut stack: Vec<usize> = (0..places.len().min(1)).collect();
    let mut order = Vec::with_capacity(places.len());
    while let Some(v) = stack.pop() {
        order.push(places[v]);
        stack.extend(below[v].iter().rev());
    }
    let cost = closed_cost(&order, metric);
    Tour { order, cost }
}

/// The default tour: algorithm 3, then exchanges until none helps. Keeps the first place.
///
/// # Guarantees
/// Never longer than [`mst_tour`].
#[must_use]
pub fn tour(places: &[usize], metric: &impl Metric) -> Tour {
    let start = mst_tour(places, metric);
    improve(start, metric)
}

/// Exchanges legs (2-opt) and moves short runs of places (Or-opt) while that helps.
///
/// # Guarantees
/// Never longer than before; the first place stays the first.
#[must_use]
pub fn improve(tour: Tour, metric: &impl Metric) -> Tour {
    let n = tour.order.len();
    if n < 4 {
        return tour;
    }
    let first = tour.order[0];
    let before = tour.clone();
    let mut search = Exchange::new(tour, metric);
    search.run();
    let mut order = search.order;
    let at = order.iter().position(|&p| p == first).unwrap_or(0);
    order.rotate_left(at);
    let cost = closed_cost(&order, metric);
    if cost < before.cost {
        Tour { order, cost }
    } else {
        before
    }
}

struct Exchange<'a, M> {
    metric: &'a M,
    order: Vec<usize>,
    /// Where each place (by its index in `names`) stands in the tour.
    at: Vec<usize>,
    names: Vec<usize>,
    near: Vec<Vec<usize>>,
    least_gain: f64,
}

impl<'a, M: Metric> Exchange<'a, M> {
    /// Places are renumbered in their first order; `order` holds these numbers.
    fn new(tour: Tour, metric: &'a M) -> Self {
        let names = tour.order;
        let n = names.len();
        let near = (0..n)
            .map(|i| {
                let mut row: Vec<(f64, usize)> = (0..n)
                    .filter(|&j| j != i)
                    .map(|j| (metric.cost(names[i], names[j]), j))
                    .collect();
                let order =
                    |x: &(f64, usize), y: &(f64, usize)| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1));
                if row.len() > NEIGHBOURS {
                    row.select_nth_unstable_by(NEIGHBOURS - 1, order);
                    row.truncate(NEIGHBOURS);
                }
                row.sort_unstable_by(order);
                row.iter().map(|r| r.1).collect()
            })
            .collect();
        Self {
            metric,
            order: (0..n).collect(),
            at: (0..n).collect(),
            names,
            near,
            least_gain: ROUNDING * tour.cost / n as f64,
        }
    }

    fn cost(&self, a: usize, b: usize) -> f64 {
        self.metric.cost(self.names[a], self.names[b])
    }

    fn step(&self, v: usize, by: isize) -> usize {
        let n = self.order.len() as isize;
        let i = (self.at[v] as isize + by).rem_euclid(n);
        self.order[i as usize]
    }

    fn run(&mut self) {
        let n = self.order.len();
        let mut waiting = vec![true; n];
        let mut queue: std::collections::VecDeque<usize> = (0..n).collect();
        while let Some(v) = queue.pop_front() {
            waiting[v] = false;
            let Some(touched) = self.two_opt(v).or_else(|| self.or_opt(v)) else {
                continue;
            };
            for w in touched {
                if !core::mem::replace(&mut waiting[w], true) {
                    queue.push_back(w);
                }
            }
        }
        self.order = self.order.iter().map(|&v| self.names[v]).collect();
    }

    /// Reverses the places from position `i` on, `len` of them, cyclically; the shorter
    /// side of the tour is turned, which is the same closed tour.
    fn reverse(&mut self, i: usize, len: usize) {
        let n = self.order.len();
        let (mut i, mut len) = (i % n, len);
        if 2 * len > n {
            i = (i + len) % n;
            len = n - len;
        }
        for s in 0..len / 2 {
            let (x, y) = ((i + s) % n, (i + len - 1 - s) % n);
            self.order.swap(x, y);
            self.at[self.order[x]] = x;
            self.at[self.order[y]] = y;
        }
    }

    /// Replaces the legs (v, w) and (x, y) by (v, x) and (w, y) if that is shorter.
    fn two_opt(&mut self, v: usize) -> Option<Vec<usize>> {
        let n = self.order.len();
        for ahead in [true, false] {
            let by = if ahead { 1 } else { -1 };
            let w = self.step(v, by);
            let old = self.cost(v, w);
            for i in 0..self.near[v].len() {
                let x = self.near[v][i];
                let new = self.cost(v, x);
                if new >= old {
                    break;
                }
                let y = self.step(x, by);
                let gain = old + self.cost(x, y) - new - self.cost(w, y);
                if gain <= self.least_gain {
                    continue;
                }
                let (from, to) = if ahead {
                    (self.at[w], self.at[x])
                } else {
                    (self.at[x], self.at[w])
                };
                // Between the two removed legs: from w to x ahead, from x to w back.
                let len = (to + n - from) % n + 1;
                let (from, len) = if ahead {
                    (from, len)
                } else {
                    (self.at[v], (self.at[y] + n - self.at[v]) % n + 1)
                };
                self.reverse(from, len);
                return Some(vec![v, w, x, y]);
            }
        }
        None
    }

    /// Moves a run of up to three places that begins or ends at `v` between two others.
    fn or_opt(&mut self, v: usize) -> Option<Vec<usize>> {
        let n = self.order.len();
        for len in 1..=LONGEST_RUN.min(n - 3) {
            for ahead in [true, false] {
                let by = if ahead { 1 } else { -1 };
                // `v` is one end of the run, `end` the other.
                let end = self.step(v, by * (len as isize - 1));
                let (before, after) = (self.step(v, -by), self.step(end, by));
                let freed = self.cost(before, v) + self.cost(end, after) - self.cost(before, after);
                if freed <= self.least_gain {
                    continue;
                }
                let first = self.at[if ahead { v } else { end }];
                for i in 0..self.near[v].len() {
                    let x = self.near[v][i];
                    if self.cost(v, x) >= freed {
                        break;
                    }
                    if (self.at[x] + n - first) % n < len {
                        continue;
                    }
                    for y in [self.step(x, 1), self.step(x, -1)] {
                        if (self.at[y] + n - first) % n < len {
                            continue;
                        }
                        let more = self.cost(x, v) + self.cost(end, y) - self.cost(x, y);
                        if freed - more > self.least_gain {
                            self.carry(first, len, (x, y), v);
                            return Some(vec![v, end, before, after, x, y]);
                        }
                    }
                }
            }
        }
        None
    }

    /// Takes the run of `len` places from position `first` out and puts it between the
    /// neighbours `x` and `y`, its end `v` beside `x`.
    fn carry(&mut self, first: usize, len: usize, (x, y): (usize, usize), v: usize) {
        let n = self.order.len();
        let mut run: Vec<usize> = (0..len).map(|i| self.order[(first + i) % n]).collect();
        let mut rest: Vec<usize> = (len..n).map(|i| self.order[(first + i) % n]).collect();
        let (p, q) = (
            rest.iter().position(|&z| z == x).unwrap_or(0),
            rest.iter().position(|&z| z == y).unwrap_or(0),
        );
        // In the rest x and y are neighbours, possibly round the corner.
        let x_first = q == p + 1 || (p + 1 == rest.len() && q == 0);
        if (run.first() == Some(&v)) != x_first {
            run.reverse();
        }
        let gap = if x_first { p + 1 } else { q + 1 };
        rest.splice(gap..gap, run);
        self.order = rest;
        for (i, &z) in self.order.iter().enumerate() {
            self.at[z] = i;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coverage::metric::{Matrix, Straight};
    use skein_geometry::frame::Point;
    use skein_geometry::random::SplitMix64;

    /// The shortest closed tour (Held and Karp).
    fn oracle(n: usize, m: &impl Metric) -> f64 {
        let full = 1usize << (n - 1);
        let mut best = vec![vec![f64::INFINITY; n]; full];
        for v in 1..n {
            best[1 << (v - 1)][v] = m.cost(0, v);
        }
        for set in 1..full {
            for v in (1..n).filter(|v| set & (1 << (v - 1)) != 0) {
                for w in (1..n).filter(|w| set & (1 << (w - 1)) == 0) {
                    let next = set | 1 << (w - 1);
                    best[next][w] = best[next][w].min(best[set][v] + m.cost(v, w));
                }
            }
        }
        (1..n)
            .map(|v| best[full - 1][v] + m.cost(v, 0))
            .fold(f64::INFINITY, f64::min)
    }

    fn check(t: &Tour, n: usize, m: &impl Metric) {
        let mut sorted = t.order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..n).collect::<Vec<_>>());
        assert!((closed_cost(&t.order, m) - t.cost).abs() < 1e-6);
    }

    #[test]
    fn tours_keep_their_factor_on_any_metric() {
        let mut random = SplitMix64::new(31);
        let (mut sum, mut rounds) = (0.0, 0);
        for round in 0..80 {
            let n = 3 + random.below(7);
            let at: Vec<Point> = (0..n)
                .map(|_| Point::new(random.unit(), random.unit()))
                .collect();
            let plane = Matrix::of(n, &Straight(&at));
            let costs: Vec<f64> = (0..n * n).map(|_| 1.0 + random.unit() * 30.0).collect();
            let any = |a: usize, b: usize| costs[a.min(b) * n + a.max(b)];
            let m = if round % 2 == 0 {
                plane
            } else {
                Matrix::of(n, &any).closure()
            };
            let places: Vec<usize> = (0..n).collect();
            let best = oracle(n, &m);
            let (_, tree) = spanning_tree(&places, &m);
            let simple = mst_tour(&places, &m);
            let better = tour(&places, &m);
            check(&simple, n, &m);
            check(&better, n, &m);
            assert!(tree <= best + 1e-9 && best <= simple.cost + 1e-9);
            assert!(simple.cost <= 2.0 * tree + 1e-9);
            assert!(better.cost <= simple.cost + 1e-9 && best <= better.cost + 1e-9);
            assert_eq!(better.order[0], 0);
            sum += better.cost / best;
            rounds += 1;
        }
        assert!(sum / f64::from(rounds) < 1.03, "{sum}");
    }

    #[test]
    fn exchanges_take_most_of_the_excess_away_from_large_tours() {
        let mut random = SplitMix64::new(32);
        let at: Vec<Point> = (0..600)
            .map(|_| Point::new(random.unit(), random.unit()))
            .collect();
        let places: Vec<usize> = (0..600).collect();
        let m = Straight(&at);
        let t = tour(&places, &m);
        check(&t, 600, &m);
        // Random points in a unit square: the optimum is near 0.7124 · sqrt(n) (1 + 0.33/n).
        let expected = 0.7124 * 600.0f64.sqrt() * 1.05;
        assert!(t.cost < 1.09 * expected, "{} {expected}", t.cost);
        for n in 0..4 {
            assert_eq!(tour(&places[..n], &m).order.len(), n);
        }
    }
}
