//! What no plan for lines can beat (D2.7 §3.5 has no bound).
//!
//! Two arguments. Somebody flies to each line, along it and back. And whoever works
//! farther than `d` from the depots spends at least `2 d` on the way there and back, so
//! the work that lies beyond `d`, deadheads included, must fit into what is left.

use super::matching::pair_up;
use super::network::{Line, Surveyor};
use crate::coverage::metric::Metric;

/// Distances `d` that are tried, besides zero: the bound is flat near its maximum.
const DISTANCES: usize = 8;

/// No plan that flies along every line has a makespan below this; `whole` is the least
/// that all tours cost together.
///
/// # Guarantees
/// A lower bound where the costs obey the triangle inequality and no line is shorter
/// than the distance between its ends. With one UAV and connected lines it is reached.
pub(super) fn makespan(lines: &[Line], team: &[Surveyor], metric: &impl Metric, whole: f64) -> f64 {
    let speed: f64 = team.iter().map(|u| u.speed).sum();
    let mut best = farthest(lines, team, metric).max(whole / speed);
    if team.len() > 1 {
        let beyond = Beyond::new(lines, team, metric);
        let far = beyond.reach.iter().copied().fold(0.0, f64::max);
        for step in 1..=DISTANCES {
            // Beyond two thirds of the way little work is left.
            let d = far * step as f64 / (1.5 * DISTANCES as f64);
            best = best.max(shared(team, d, beyond.work(d)));
        }
    }
    best
}

/// The time in which UAVs that each lose `2 d` can do `work` together.
pub(in crate::coverage) fn shared(team: &[Surveyor], d: f64, work: f64) -> f64 {
    let mut slowest_first: Vec<f64> = team.iter().map(|u| u.speed).collect();
    slowest_first.sort_by(f64::total_cmp);
    let speed: f64 = slowest_first.iter().sum();
    let (mut speed, mut count) = (speed, team.len() as f64);
    for v in &slowest_first {
        let time = (work + 2.0 * d * count) / speed;
        // Whoever would not even get beyond `d` and back takes no part.
        if time * v >= 2.0 * d || count < 1.5 {
            return time;
        }
        speed -= v;
        count -= 1.0;
    }
    0.0
}

/// The time for the line that takes longest on its own, flown by whoever is best placed.
fn farthest(lines: &[Line], team: &[Surveyor], metric: &impl Metric) -> f64 {
    let mut kinds: Vec<&Surveyor> = Vec::new();
    for uav in team {
        let no_better = |k: &&Surveyor| k.depot == uav.depot && k.speed >= uav.speed;
        if !kinds.iter().any(no_better) {
            kinds.push(uav);
        }
    }
    let alone = |l: &Line, u: &Surveyor| {
        let ahead = metric.cost(u.depot, l.a) + l.cost[0] + metric.cost(l.b, u.depot);
        let back = metric.cost(u.depot, l.b) + l.cost[1] + metric.cost(l.a, u.depot);
        ahead.min(back) / u.speed
    };
    let easiest = |l: &Line| {
        let times = kinds.iter().map(|u| alone(l, u));
        times.fold(f64::INFINITY, f64::min)
    };
    lines.iter().map(easiest).fold(0.0, f64::max)
}

/// How much of the work lies beyond a distance from all depots.
struct Beyond<'a, M> {
    lines: &'a [Line],
    metric: &'a M,
    /// The distance of both ends of every line from the nearest depot.
    ends: Vec<(f64, f64)>,
    /// The same of the places where an odd number of lines end.
    reach: Vec<f64>,
    odd: Vec<usize>,
}

impl<'a, M: Metric> Beyond<'a, M> {
    fn new(lines: &'a [Line], team: &[Surveyor], metric: &'a M) -> Self {
        let mut depots: Vec<usize> = team.iter().map(|u| u.depot).collect();
        depots.sort_unstable();
        depots.dedup();
        let from_depot = |p: usize| {
            let costs = depots.iter().map(|&d| metric.cost(d, p));
            costs.fold(f64::INFINITY, f64::min)
        };
        let mut places: Vec<usize> = lines.iter().flat_map(|l| [l.a, l.b]).collect();
        places.sort_unstable();
        let odd: Vec<usize> = places
            .chunk_by(|a, b| a == b)
            .filter(|same| same.len() % 2 == 1)
            .map(|same| same[0])
            .collect();
        Self {
            lines,
            metric,
            ends: lines
                .iter()
                .map(|l| (from_depot(l.a), from_depot(l.b)))
                .collect(),
            reach: odd.iter().map(|&p| from_depot(p)).collect(),
            odd,
        }
    }

    /// The least that is flown beyond `d`.
    ///
    /// A point at `s` along a leg from `a` is at most `s` nearer to the depots than `a`,
    /// so at least the lesser of the leg and of what both ends stick out lies outside.
    fn work(&self, d: f64) -> f64 {
        let out = |r: f64| (r - d).max(0.0);
        let flown =
            |(l, &(a, b)): (&Line, &(f64, f64))| l.cost[0].min(l.cost[1]).min(out(a) + out(b));
        let flown: f64 = self.lines.iter().zip(&self.ends).map(flown).sum();
        let mut outside: Vec<usize> = (0..self.odd.len()).filter(|&i| self.reach[i] > d).collect();
        if outside.len() % 2 == 1 {
            // One of them is joined to the inside.
            outside.push(self.odd.len());
        }
        let stub = |i: usize| self.reach.get(i).map_or(0.0, |&r| out(r));
        let joined = |i: usize, j: usize| {
            let over = stub(i) + stub(j);
            match (self.odd.get(i), self.odd.get(j)) {
                (Some(&a), Some(&b)) => over.min(self.metric.cost(a, b)),
                _ => over,
            }
        };
        let pairs = pair_up(&outside, &joined);
        let deadheads = pairs.iter().map(|&(x, y)| joined(outside[x], outside[y]));
        flown + deadheads.sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_does_not_get_there_does_not_help() {
        let team = |speeds: &[f64]| -> Vec<Surveyor> {
            speeds
                .iter()
                .map(|&speed| Surveyor {
                    speed,
                    ..Surveyor::at(0)
                })
                .collect()
        };
        // Two equal UAVs: 2·100 m there and back, half of 300 m each.
        assert!((shared(&team(&[1.0, 1.0]), 100.0, 300.0) - 350.0).abs() < 1e-9);
        // The slow one would need 2,000 s only to get there and back.
        assert!((shared(&team(&[0.1, 1.0]), 100.0, 300.0) - 500.0).abs() < 1e-9);
    }
}
