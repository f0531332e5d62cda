//! The bound of lines in several parts (D2.7 §3.5 has none): a tour that serves every part
//! crosses the border of each at least twice, so each part may be given a moat whose
//! width is paid at every crossing.
//!
//! With moats of width r the deadheads between parts get cheaper by the moats that they
//! cross; the cheapest pairing under what is left, and twice every moat, is a bound. The
//! widths are found by raising them where the pairing crosses too seldom.

use super::matching::pair_up;
use super::network::{Line, Parts};
use crate::coverage::metric::Metric;

/// Parts that are told apart at most: ways over other parts cost their square for each
/// pair of places.
const MOST_PARTS: usize = 16;

/// Widths tried: each costs a pairing.
const ROUNDS: usize = 12;

/// Deadheads of one tour, or of several from one depot, cost at least this much.
///
/// # Guarantees
/// A lower bound where the costs obey the triangle inequality. Zero when there are too
/// many parts, or only one.
pub(super) fn deadheads(lines: &[Line], depot: usize, metric: &impl Metric) -> f64 {
    let Some(network) = Network::new(lines, depot, metric) else {
        return 0.0;
    };
    let mut best = 0.0f64;
    let mut widths = vec![0.0; network.n_parts];
    for round in 1..=ROUNDS {
        let (bound, crossings) = network.bound(&widths);
        best = best.max(bound);
        // Steps that shrink like 1/n come as near as is wanted.
        let step = 1.0 / round as f64;
        for (part, width) in widths.iter_mut().enumerate() {
            let most = network.widest[part];
            *width = (*width + step * most * (2.0 - crossings[part]) / 2.0).clamp(0.0, most);
        }
    }
    best
}

/// The parts and what is between them.
struct Network<'a, M> {
    metric: &'a M,
    n_parts: usize,
    /// Places where an odd number of lines end, and the part of each.
    odd: Vec<usize>,
    part: Vec<usize>,
    /// By odd place and part: the least cost to it.
    near: Vec<Vec<f64>>,
    /// By two parts: the least cost between them.
    gaps: Vec<Vec<f64>>,
    /// By part: the widest moat, half of the least gap.
    widest: Vec<f64>,
}

impl<'a, M: Metric> Network<'a, M> {
    fn new(lines: &[Line], depot: usize, metric: &'a M) -> Option<Self> {
        let ends = lines.iter().flat_map(|l| [l.a, l.b]);
        let mut places: Vec<usize> = ends.clone().chain([depot]).collect();
        places.sort_unstable();
        places.dedup();
        let number = |p: usize| places.binary_search(&p).unwrap_or(0);
        let mut joined = Parts::new(places.len());
        for l in lines {
            joined.join(number(l.a), number(l.b));
        }
        let roots: Vec<usize> = (0..places.len()).map(|i| joined.find(i)).collect();
        let mut names = roots.clone();
        names.sort_unstable();
        names.dedup();
        if !(2..=MOST_PARTS).contains(&names.len()) {
            return None;
        }
        let n_parts = names.len();
        let part_of: Vec<usize> = roots
            .iter()
            .map(|r| names.binary_search(r).unwrap_or(0))
            .collect();
        let mut degree = vec![0usize; places.len()];
        for p in ends {
            degree[number(p)] += 1;
        }
        let nearest = |place: usize| {
            let mut near = vec![f64::INFINITY; n_parts];
            for (i, &other) in places.iter().enumerate() {
                let slot = &mut near[part_of[i]];
                *slot = slot.min(metric.cost(place, other));
            }
            near
        };
        let (mut odd, mut part, mut near) = (Vec::new(), Vec::new(), Vec::new());
        let mut gaps = vec![vec![f64::INFINITY; n_parts]; n_parts];
        for (i, &place) in places.iter().enumerate() {
            let to = nearest(place);
            let from = part_of[i];
            for (gap, cost) in gaps[from].iter_mut().zip(&to) {
                *gap = gap.min(*cost);
            }
            if degree[i] % 2 == 1 {
                odd.push(place);
                part.push(from);
                near.push(to);
            }
        }
        let widest = (0..n_parts).map(|a| {
            let others = (0..n_parts).filter(|b| *b != a);
            others.map(|b| gaps[a][b]).fold(f64::INFINITY, f64::min) / 2.0
        });
        Some(Self {
            metric,
            n_parts,
            odd,
            part,
            near,
            widest: widest.collect(),
            gaps,
        })
    }

    /// The bound with moats of these widths, and how often the pairing crosses each.
    fn bound(&self, widths: &[f64]) -> (f64, Vec<f64>) {
        let n = self.n_parts;
        let mut between = self.gaps.clone();
        for a in 0..n {
            for b in 0..n {
                between[a][b] = if a == b {
                    0.0
                } else {
                    (self.gaps[a][b] - widths[a] - widths[b]).max(0.0)
                };
            }
        }
        for via in 0..n {
            for a in 0..n {
                for b in 0..n {
                    between[a][b] = between[a][b].min(between[a][via] + between[via][b]);
                }
            }
        }
        // From an odd place to each part, moats paid, inside the part for nothing.
        let out: Vec<Vec<f64>> = (0..self.odd.len())
            .map(|i| {
                let own = self.part[i];
                let direct = |k: usize| {
                    if k == own {
                        f64::INFINITY
                    } else {
                        (self.near[i][k] - widths[own] - widths[k]).max(0.0)
                    }
                };
                let over = |to: usize| {
                    let ways = (0..n).map(|k| direct(k) + between[k][to]);
                    ways.fold(f64::INFINITY, f64::min)
                };
                (0..n).map(over).collect()
            })
            .collect();
        let cost = |i: usize, j: usize| {
            let (a, b) = (self.part[i], self.part[j]);
            let moats = if a == b { 0.0 } else { widths[a] + widths[b] };
            let direct = (self.metric.cost(self.odd[i], self.odd[j]) - moats).max(0.0);
            let ends = (0..n).map(|k| {
                let last = if k == b {
                    // Arrives inside the other's part from without.
                    f64::INFINITY
                } else {
                    (self.near[j][k] - widths[b] - widths[k]).max(0.0)
                };
                out[i][k] + last
            });
            direct.min(ends.fold(f64::INFINITY, f64::min))
        };
        let all: Vec<usize> = (0..self.odd.len()).collect();
        let pairs = pair_up(&all, &cost);
        let mut crossings = vec![0.0; n];
        let mut total: f64 = widths.iter().map(|w| 2.0 * w).sum();
        for (i, j) in pairs {
            total += cost(i, j);
            if self.part[i] != self.part[j] {
                crossings[self.part[i]] += 1.0;
                crossings[self.part[j]] += 1.0;
            }
        }
        (total, crossings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coverage::metric::Straight;
    use crate::frame::Point;

    #[test]
    fn two_rings_apart_are_joined_there_and_back() {
        let mut at = Vec::new();
        for x in [0.0, 300.0] {
            for (dx, dy) in [(0.0, 0.0), (100.0, 0.0), (50.0, 80.0)] {
                at.push(Point::new(x + dx, dy));
            }
        }
        let roads = Straight(&at);
        let line = |a: usize, b: usize| Line::new(a, b, roads.cost(a, b));
        let lines: Vec<Line> = [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3)]
            .map(|(a, b)| line(a, b))
            .to_vec();
        // From (100, 0) to (300, 0) and back.
        assert!((deadheads(&lines, 0, &roads) - 400.0).abs() < 1e-6);
        assert!(deadheads(&lines[..3], 0, &roads) < 1e-9, "one part alone");
    }
}
