//! One closed tour through all points: the minimum spanning tree's preorder walk, then
//! exchanges of up to three legs (`exchange`), and kicks (`kicks`) where steps are told
//! (D2.7 §3.4.1, algorithm 3). Prim's tree is written out: it asks a metric for n² costs and keeps n,
//! where a graph library wants all of them as edges.

mod exchange;
mod kicks;

use crate::coverage::metric::Metric;
use exchange::Exchange;

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

/// Exchanges up to three legs at once while that helps, and no further.
///
/// # Guarantees
/// Never longer than before; the first place stays the first.
#[must_use]
pub fn improve(tour: Tour, metric: &impl Metric) -> Tour {
    searched(tour, metric, 0)
}

/// As [`improve`], and then kicks and repairs it `steps` times.
///
/// A leg of negative cost is never given up, so a caller can ask for legs that stay.
///
/// # Guarantees
/// Never longer than before, the first place stays the first; the same steps give the
/// same tour everywhere.
///
/// # Complexity
/// O(n²) for the near places, and steps of nearly the same work in tours of any size.
#[must_use]
pub fn searched(tour: Tour, metric: &impl Metric, steps: usize) -> Tour {
    let n = tour.order.len();
    if n < 4 {
        return tour;
    }
    let first = tour.order[0];
    let legs = (0..n).map(|i| metric.cost(tour.order[i], tour.order[(i + 1) % n]));
    let least_gain = ROUNDING * legs.map(|c| c.max(0.0)).sum::<f64>() / n as f64;
    let mut exchange = Exchange::new(tour.order.clone(), metric, least_gain);
    let best = kicks::search(&mut exchange, steps);
    let mut order = exchange.places(&best);
    let at = order.iter().position(|&p| p == first).unwrap_or(0);
    order.rotate_left(at);
    let cost = closed_cost(&order, metric);
    if cost < tour.cost {
        Tour { order, cost }
    } else {
        tour
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
