//! Lower bound of the makespan of plans for lines (D2.7 §3.5 has none).
//!
//! Some UAV flies to each line, along it and back. All tours together pair up the places
//! where an odd number of lines end and join all parts (`postman`). And a UAV that works
//! farther than `d` from the depots crosses every circle up to `d` twice: what a team
//! flies is at least those crossings, and of lines and pairing what they do not need for
//! themselves to get on outwards or inwards. How many UAVs must work beyond each `d`
//! follows from a makespan that is supposed; the least that leads to no contradiction is
//! the bound.

use super::matching::pair_up;
use super::network::{Line, Uav};
use crate::coverage::metric::Metric;

/// Distances `d` that are tried, besides zero: the bound is flat near its maximum.
const DISTANCES: usize = 12;

/// Halvings of the interval of the bound: below a millionth of it.
const HALVINGS: usize = 24;

/// No plan that flies along every line has a makespan below this; `whole` is the least
/// that all tours cost together.
///
/// # Guarantees
/// A lower bound where the costs obey the triangle inequality and no line is shorter
/// than the distance between its ends. With one UAV and connected lines it is reached.
pub(super) fn makespan(lines: &[Line], team: &[Uav], metric: &impl Metric, whole: f64) -> f64 {
    let speed: f64 = team.iter().map(|u| u.speed).sum();
    let mut best = farthest(lines, team, metric).max(whole / speed);
    if team.len() > 1 {
        let beyond = Beyond::new(lines, team, metric);
        best = Circles::new(team, &beyond).least_time(best);
    }
    best
}

/// The time in which UAVs that each lose `2 d` can do `work` together.
#[must_use]
pub fn shared(team: &[Uav], d: f64, work: f64) -> f64 {
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
fn farthest(lines: &[Line], team: &[Uav], metric: &impl Metric) -> f64 {
    let mut kinds: Vec<&Uav> = Vec::new();
    for uav in team {
        let no_better = |k: &&Uav| k.depot == uav.depot && k.speed >= uav.speed;
        if !kinds.iter().any(no_better) {
            kinds.push(uav);
        }
    }
    let alone = |l: &Line, u: &Uav| {
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

/// Circles round the depots, and the work beyond and within each.
struct Circles {
    /// The speeds of the team, the fastest first.
    speeds: Vec<f64>,
    rings: Vec<Ring>,
}

/// A circle and the ring between it and the next smaller one.
struct Ring {
    radius: f64,
    width: f64,
    /// What those who come beyond the circle fly besides crossing it and all smaller ones.
    beyond: f64,
    /// What lines within the circle need besides.
    within: f64,
}

impl Circles {
    fn new<M: Metric>(team: &[Uav], beyond: &Beyond<'_, M>) -> Self {
        let mut speeds: Vec<f64> = team.iter().map(|u| u.speed).collect();
        speeds.sort_by(|a, b| b.total_cmp(a));
        let far = beyond.reach.iter().copied().fold(0.0, f64::max);
        let width = far / (DISTANCES + 1) as f64;
        let ring = |step: usize| {
            let radius = width * step as f64;
            let (out, within) = beyond.work(radius);
            Ring {
                radius,
                width,
                beyond: out,
                within,
            }
        };
        Self {
            speeds,
            rings: (1..=DISTANCES).map(ring).collect(),
        }
    }

    /// The least time, from `least` on, in which the team may be done.
    fn least_time(&self, least: f64) -> f64 {
        if self.is_possible(least) {
            return least;
        }
        let (mut least, mut most) = (least, 2.0 * least);
        while !self.is_possible(most) && most.is_finite() {
            (least, most) = (most, 2.0 * most);
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (least + most);
            if self.is_possible(middle) {
                most = middle;
            } else {
                least = middle;
            }
        }
        least
    }

    /// Whether nothing here speaks against a makespan of `time`.
    fn is_possible(&self, time: f64) -> bool {
        let all: f64 = self.speeds.iter().map(|v| v * time).sum();
        let mut crossings = 0.0;
        for ring in &self.rings {
            let Some(count) = self.needed(ring, time) else {
                return false;
            };
            crossings += 2.0 * ring.width * count as f64;
            if crossings + ring.beyond + ring.within > all {
                return false;
            }
        }
        true
    }

    /// How many UAVs at least work beyond a circle; `None` when all are too few.
    fn needed(&self, ring: &Ring, time: f64) -> Option<usize> {
        let (mut left, mut count) = (ring.beyond, 0);
        for v in &self.speeds {
            if left <= 0.0 {
                break;
            }
            left -= (v * time - 2.0 * ring.radius).max(0.0);
            count += 1;
        }
        (left <= 0.0).then_some(count)
    }
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
    fn new(lines: &'a [Line], team: &[Uav], metric: &'a M) -> Self {
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

    /// The least that is flown by those who come farther than `d` from all depots, and
    /// on lines within `d`, both besides crossing the circles up to `d`.
    ///
    /// Along a line the distance from the depots changes by the difference of its ends at
    /// least; that much of it may be what a circle's crossing needs, the rest is not.
    fn work(&self, d: f64) -> (f64, f64) {
        let out = |r: f64| (r - d).max(0.0);
        let (mut beyond, mut within) = (0.0, 0.0);
        for (l, &(a, b)) in self.lines.iter().zip(&self.ends) {
            let besides = l.cost[0].min(l.cost[1]) - (a.min(d) - b.min(d)).abs();
            if a.max(b) > d {
                beyond += besides.max(0.0);
            } else {
                within += besides.max(0.0);
            }
        }
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
        (beyond + deadheads.sum::<f64>(), within)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_does_not_get_there_does_not_help() {
        let team = |speeds: &[f64]| -> Vec<Uav> {
            speeds
                .iter()
                .map(|&speed| Uav {
                    speed,
                    ..Uav::at(0)
                })
                .collect()
        };
        // Two equal UAVs: 2·100 m there and back, half of 300 m each.
        assert!((shared(&team(&[1.0, 1.0]), 100.0, 300.0) - 350.0).abs() < 1e-9);
        // The slow one would need 2,000 s only to get there and back.
        assert!((shared(&team(&[0.1, 1.0]), 100.0, 300.0) - 500.0).abs() < 1e-9);
    }
}
