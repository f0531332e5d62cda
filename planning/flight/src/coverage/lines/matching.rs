//! The cheapest way to pair up places (D2.7 §3.5: which crossings are joined by
//! deadheads). Exact for any symmetric costs.
//!
//! Only near neighbours are offered to `blossom`; its dual solution then tells which of
//! all other pairs could be cheaper, and these are added until there are none.

use super::blossom::{Matching, min_cost_perfect};
use crate::coverage::metric::Metric;

/// Neighbours offered at first: in the plane the optimum rarely uses a farther one
/// (measured on road networks: one or two rounds).
const NEIGHBOURS: usize = 8;

/// Whole units in a metre: costs are exact to a micrometre, and eight thousand places
/// a thousand kilometres apart still add up within 63 bits.
const UNITS_PER_M: f64 = 1_048_576.0;

/// The largest cost told from others, metres.
const FARTHEST_M: f64 = 1.0e7;

/// A cost in whole units; even, as the dual variables need halves.
fn units(cost_m: f64) -> i64 {
    2 * (cost_m.clamp(0.0, FARTHEST_M) * UNITS_PER_M).round() as i64
}

/// Pairs up `places` (an even number) at the least total cost.
///
/// Each pair is `(lower, higher)` by its index in `places`. With an odd number the
/// last place is left out.
///
/// # Guarantees
/// Optimal over all pairings, for costs rounded to a micrometre.
pub(super) fn pair_up(places: &[usize], metric: &impl Metric) -> Vec<(usize, usize)> {
    let n = places.len() - places.len() % 2;
    if n == 0 {
        return Vec::new();
    }
    let cost = |a: usize, b: usize| units(metric.cost(places[a], places[b]));
    let mut edges = neighbours(n, &cost);
    edges.extend(greedy_pairs(n, &edges, &cost));
    edges.sort_unstable();
    edges.dedup();
    loop {
        // The greedy pairs are a perfect matching, so there is always one.
        let Some(matching) = min_cost_perfect(n, &edges) else {
            return Vec::new();
        };
        let better = overlooked(n, &matching, &cost);
        if better.is_empty() {
            return matching
                .mate
                .iter()
                .enumerate()
                .map(|(a, &b)| (a, b as usize))
                .filter(|(a, b)| a < b)
                .collect();
        }
        edges.extend(better);
    }
}

fn ordered(a: usize, b: usize, cost: i64) -> (u32, u32, i64) {
    (a.min(b) as u32, a.max(b) as u32, cost)
}

fn neighbours(n: usize, cost: &impl Fn(usize, usize) -> i64) -> Vec<(u32, u32, i64)> {
    let mut edges = Vec::with_capacity(n * NEIGHBOURS);
    let mut row = Vec::with_capacity(n);
    for a in 0..n {
        row.clear();
        row.extend((0..n).filter(|&b| b != a).map(|b| (cost(a, b), b)));
        if row.len() > NEIGHBOURS {
            row.select_nth_unstable(NEIGHBOURS - 1);
            row.truncate(NEIGHBOURS);
        }
        edges.extend(row.iter().map(|&(c, b)| ordered(a, b, c)));
    }
    edges
}

/// A perfect matching by always taking the cheapest neighbour pair left.
fn greedy_pairs(
    n: usize,
    edges: &[(u32, u32, i64)],
    cost: &impl Fn(usize, usize) -> i64,
) -> Vec<(u32, u32, i64)> {
    let mut sorted = edges.to_vec();
    sorted.sort_unstable_by_key(|&(a, b, c)| (c, a, b));
    let mut single = vec![true; n];
    for &(a, b, _) in &sorted {
        let (a, b) = (a as usize, b as usize);
        if single[a] && single[b] {
            single[a] = false;
            single[b] = false;
        }
    }
    let mut left: Vec<usize> = (0..n).filter(|&v| single[v]).collect();
    let mut pairs = Vec::new();
    while let Some(a) = left.pop() {
        let near = (0..left.len()).min_by_key(|&i| (cost(a, left[i]), left[i]));
        if let Some(i) = near {
            let b = left.swap_remove(i);
            pairs.push(ordered(a, b, cost(a, b)));
        }
    }
    pairs
}

/// The pairs whose reduced cost is negative: they were not offered and might help.
fn overlooked(
    n: usize,
    matching: &Matching,
    cost: &impl Fn(usize, usize) -> i64,
) -> Vec<(u32, u32, i64)> {
    let mut found = Vec::new();
    for a in 0..n {
        for b in a + 1..n {
            let c = cost(a, b);
            if c < matching.reach(a, b) && matching.reduced(a, b, c) < 0 {
                found.push(ordered(a, b, c));
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coverage::metric::Straight;
    use skein_geometry::frame::Point;

    fn scattered(n: usize) -> Vec<Point> {
        let mut state = 5u64;
        let mut unit = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) as f64 / f64::from(1u32 << 31)
        };
        (0..n)
            .map(|i| {
                // Two far clusters of odd size: the pair across is nobody's neighbour.
                let shift = if i % 2 == 0 && n % 4 == 2 {
                    5000.0
                } else {
                    0.0
                };
                Point::new(1000.0 * unit() + shift, 1000.0 * unit())
            })
            .collect()
    }

    #[test]
    fn pairs_beyond_the_neighbours_are_found() {
        for n in [2usize, 26, 60, 122] {
            let points = scattered(n);
            let places: Vec<usize> = (0..n).collect();
            let pairs = pair_up(&places, &Straight(&points));
            assert_eq!(pairs.len(), n / 2);
            let sum = |pairs: &[(usize, usize)]| -> i64 {
                let m = Straight(&points);
                pairs.iter().map(|&(a, b)| units(m.cost(a, b))).sum()
            };
            let mut all = Vec::new();
            for a in 0..n {
                for b in a + 1..n {
                    all.push(ordered(a, b, units(Straight(&points).cost(a, b))));
                }
            }
            let exact: Vec<(usize, usize)> = min_cost_perfect(n, &all)
                .unwrap()
                .mate
                .iter()
                .enumerate()
                .map(|(a, &b)| (a, b as usize))
                .filter(|(a, b)| a < b)
                .collect();
            assert_eq!(sum(&pairs), sum(&exact), "{n}");
        }
    }
}
