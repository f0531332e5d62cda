//! Closed tours of a team through all points, the longest as short as can be found: the
//! default planner of pinpoint coverage (D2.7 §3.4.2).
//!
//! A point to visit is a line from a place to itself, so the local search of line
//! coverage does the work. A point with a radius is a line too: one pass over it, or a
//! small sweep.

use skein_flight::coverage::lines::{
    Line, LineError, LinePlan, Traversal, Uav, improved, shared_time,
};
use skein_flight::coverage::metric::Metric;
use skein_flight::coverage::tour::{spanning_tree, tour};
use skein_geometry::frame::Point;
use skein_geometry::math::sin_cos;

/// Distances from the depots that the bound tries.
const DISTANCES: usize = 8;

/// Plans closed tours for a team so that every target is visited once and the longest
/// tour is short.
///
/// A target is a [`Line`]: a place to fly over is `Line::new(p, p, 0.0)`, a small sweep
/// goes from its first to its last point (see [`look_at`]). `metric` and `steps` as in
/// [`skein_flight::coverage::lines::plan`].
///
/// # Guarantees
/// Each target in exactly one tour or in `unserved`, every tour within its UAV's
/// endurance. No plan is faster than `lower_bound`, where the costs obey the triangle
/// inequality. One UAV flies at most twice the optimum (over places without extent).
///
/// # Errors
/// [`LineError`] when there is nobody to fly, or a figure is no sensible number.
pub fn visit(
    targets: &[Line],
    team: &[Uav],
    metric: &impl Metric,
    steps: usize,
) -> Result<LinePlan, LineError> {
    let lower_bound = if team.is_empty() {
        0.0
    } else {
        bound(targets, team, metric)
    };
    let giant = giant(targets, team, metric);
    improved(targets, team, metric, steps, lower_bound, vec![giant])
}

/// All targets in one tour from the first depot.
fn giant(targets: &[Line], team: &[Uav], metric: &impl Metric) -> Vec<Traversal> {
    let Some(first) = team.first() else {
        return Vec::new();
    };
    // Place 0 is the depot, place i + 1 target i; between two targets their nearer ends.
    let ends = |i: usize| match i.checked_sub(1) {
        Some(t) => [targets[t].a, targets[t].b],
        None => [first.depot; 2],
    };
    let between = |i: usize, j: usize| {
        let mut least = f64::INFINITY;
        for a in ends(i) {
            for b in ends(j) {
                least = least.min(metric.cost(a, b));
            }
        }
        least
    };
    let places: Vec<usize> = (0..=targets.len()).collect();
    let order = tour(&places, &between).order;
    let mut at = first.depot;
    let mut passes = Vec::with_capacity(targets.len());
    for &i in order.iter().skip(1) {
        let l = targets[i - 1];
        let backward = metric.cost(at, l.b) < metric.cost(at, l.a);
        at = if backward { l.a } else { l.b };
        passes.push(Traversal {
            line: i - 1,
            backward,
        });
    }
    passes
}

/// No plan that visits every target has a makespan below this.
///
/// Somebody flies to each target and back. And whoever works beyond `d` from the depots
/// spends `2 d` on the way; the flights beyond `d` together with what lies within join
/// all targets, so they are at least a spanning tree.
fn bound(targets: &[Line], team: &[Uav], metric: &impl Metric) -> f64 {
    let mut depots: Vec<usize> = team.iter().map(|u| u.depot).collect();
    depots.sort_unstable();
    depots.dedup();
    let to_depot = |p: usize| {
        let all = depots.iter().map(|&d| metric.cost(d, p));
        all.fold(f64::INFINITY, f64::min)
    };
    let reach: Vec<f64> = targets
        .iter()
        .map(|t| to_depot(t.a).min(to_depot(t.b)))
        .collect();
    let fastest = team.iter().map(|u| u.speed).fold(0.0, f64::max);
    let own = |t: &Line| t.cost[0].min(t.cost[1]);
    let alone = targets.iter().map(|t| {
        let way = (to_depot(t.a) + to_depot(t.b)).max(0.0);
        (way + own(t)) / fastest
    });
    let mut best = alone.fold(0.0, f64::max);
    let far = reach.iter().copied().fold(0.0, f64::max);
    for step in 0..DISTANCES {
        let d = far * step as f64 / DISTANCES as f64;
        let out = |i: usize| reach.get(i).map_or(0.0, |r| (r - d).max(0.0));
        let mut outside: Vec<usize> = (0..targets.len()).filter(|&i| reach[i] > d).collect();
        // Work on a target whose ends lie outside is not counted: it may dip inside.
        let flown: f64 = if step == 0 {
            targets.iter().map(own).sum()
        } else {
            0.0
        };
        outside.push(targets.len());
        let joined = |i: usize, j: usize| {
            let over = out(i) + out(j);
            match (targets.get(i), targets.get(j)) {
                (Some(s), Some(t)) => {
                    let mut least = over;
                    for a in [s.a, s.b] {
                        for b in [t.a, t.b] {
                            least = least.min(metric.cost(a, b));
                        }
                    }
                    least
                }
                _ => over,
            }
        };
        let (_, tree) = spanning_tree(&outside, &joined);
        best = best.max(shared_time(team, d, flown + tree));
    }
    best
}

/// The flight that sees a disc wholly: one pass if the swath is as wide as the disc, or
/// parallel lanes a swath apart; the point alone for a radius of 0.
///
/// The lanes run along `heading_rad` (counter-clockwise from east). `None` when a figure
/// is no sensible number or more than ten thousand lanes would be needed.
#[must_use]
pub fn look_at(centre: Point, radius_m: f64, swath_m: f64, heading_rad: f64) -> Option<Vec<Point>> {
    // Written so that a value that is no number fails too.
    let sensible = radius_m >= 0.0 && swath_m > 0.0 && radius_m.is_finite();
    if !sensible || !heading_rad.is_finite() || radius_m / swath_m > 5_000.0 {
        return None;
    }
    if radius_m <= 0.0 {
        return Some(vec![centre]);
    }
    let (s, c) = sin_cos(heading_rad);
    let at = |along: f64, across: f64| {
        Point::new(
            centre.x + along * c - across * s,
            centre.y + along * s + across * c,
        )
    };
    let lanes = (2.0 * radius_m / swath_m).ceil().max(1.0);
    // The lanes share the width evenly, so that neighbours overlap a little.
    let width = 2.0 * radius_m / lanes;
    let mut way = Vec::new();
    for i in 0..lanes as usize {
        let middle = -radius_m + (i as f64 + 0.5) * width;
        // The lane reaches as far as the disc does anywhere in its strip.
        let inner = (middle.abs() - width / 2.0).max(0.0);
        let half = (radius_m * radius_m - inner * inner).max(0.0).sqrt();
        let (from, to) = if i % 2 == 0 {
            (-half, half)
        } else {
            (half, -half)
        };
        way.extend([at(from, middle), at(to, middle)]);
    }
    Some(way)
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_flight::coverage::metric::Straight;
    use skein_geometry::random::SplitMix64;

    /// The least makespan of closed tours through all points.
    fn oracle(n: usize, team: &[Uav], m: &impl Metric) -> f64 {
        let full = 1usize << n;
        let tours = |depot: usize| {
            let mut best = vec![vec![f64::INFINITY; n]; full];
            let mut closed = vec![f64::INFINITY; full];
            closed[0] = 0.0;
            for set in 1..full {
                for v in (0..n).filter(|v| set & (1 << v) != 0) {
                    let rest = set & !(1 << v);
                    let into = if rest == 0 {
                        m.cost(depot, v)
                    } else {
                        (0..n)
                            .map(|w| best[rest][w] + m.cost(w, v))
                            .fold(f64::INFINITY, f64::min)
                    };
                    best[set][v] = into;
                    closed[set] = closed[set].min(into + m.cost(v, depot));
                }
            }
            closed
        };
        let mut reach = vec![f64::INFINITY; full];
        reach[0] = 0.0;
        for uav in team {
            let own = tours(uav.depot);
            let mut next = vec![f64::INFINITY; full];
            for (set, slot) in next.iter_mut().enumerate() {
                let mut part = set;
                loop {
                    *slot = slot.min((own[part] / uav.speed).max(reach[set & !part]));
                    if part == 0 {
                        break;
                    }
                    part = (part - 1) & set;
                }
            }
            reach = next;
        }
        reach[full - 1]
    }

    #[test]
    fn teams_come_close_to_the_least_makespan() {
        let mut random = SplitMix64::new(41);
        let (mut sum, mut worst, rounds) = (0.0, 0.0f64, 60);
        for round in 0..rounds {
            let n = 7;
            let at: Vec<Point> = (0..n + 2)
                .map(|_| Point::new(1000.0 * random.unit(), 1000.0 * random.unit()))
                .collect();
            let m = Straight(&at);
            let k = 1 + random.below(3);
            let team: Vec<Uav> = (0..k)
                .map(|i| Uav {
                    speed: if round % 3 == 0 { 1.0 + i as f64 } else { 1.0 },
                    ..Uav::at(n + if round % 2 == 0 { i % 2 } else { 0 })
                })
                .collect();
            let targets: Vec<Line> = (0..n).map(|p| Line::new(p, p, 0.0)).collect();
            let plan = visit(&targets, &team, &m, 2000).unwrap();
            let mut seen: Vec<usize> = plan
                .tours
                .iter()
                .flat_map(|t| t.passes.iter().map(|p| p.line))
                .collect();
            seen.sort_unstable();
            assert_eq!(seen, (0..n).collect::<Vec<_>>());
            let best = oracle(n, &team, &m);
            assert!(plan.lower_bound <= best + 1e-6);
            let ratio = plan.makespan / best;
            assert!(ratio > 1.0 - 1e-9);
            (sum, worst) = (sum + ratio, worst.max(ratio));
        }
        assert!(
            sum / f64::from(rounds) < 1.01 && worst < 1.10,
            "{sum} {worst}"
        );
    }

    #[test]
    fn a_disc_is_seen_wholly() {
        for (radius_m, swath_m) in [(20.0, 40.0), (50.0, 30.0), (100.0, 7.0)] {
            let centre = Point::new(10.0, -5.0);
            let way = look_at(centre, radius_m, swath_m, 0.7).unwrap();
            for i in 0..60 {
                for j in 0..60 {
                    let p = Point::new(
                        centre.x + radius_m * (f64::from(i) / 29.5 - 1.0),
                        centre.y + radius_m * (f64::from(j) / 29.5 - 1.0),
                    );
                    if (p - centre).norm() > radius_m {
                        continue;
                    }
                    let seen = way.windows(2).any(|w| {
                        let d = w[1] - w[0];
                        let t = (p - w[0]).dot(&d) / d.norm_squared();
                        (-1e-9..=1.0 + 1e-9).contains(&t)
                            && (p - (w[0] + d * t)).norm() <= swath_m / 2.0 + 1e-9
                    });
                    assert!(seen, "{p:?} {radius_m} {swath_m}");
                }
            }
        }
        assert_eq!(look_at(Point::origin(), 0.0, 5.0, 0.0).unwrap().len(), 1);
        assert_eq!(look_at(Point::origin(), 2.0, 5.0, 0.0).unwrap().len(), 2);
        assert!(look_at(Point::origin(), f64::NAN, 5.0, 0.0).is_none());
        assert!(look_at(Point::origin(), 1e9, 5.0, 0.0).is_none());
    }

    #[test]
    fn nobody_visits_nothing() {
        let at = [Point::origin()];
        let m = Straight(&at);
        assert_eq!(visit(&[], &[], &m, 10), Err(LineError::NoTeam));
        let idle = visit(&[], &[Uav::at(0)], &m, 10).unwrap();
        assert!(idle.makespan.abs() < 1e-12);
    }
}
