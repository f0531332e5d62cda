//! Line plans against exhaustive search, and what must hold of every plan.

use super::*;
use crate::coverage::metric::{InWind, Straight};
use skein_geometry::frame::{Point, Vector};
use skein_geometry::random::SplitMix64;

fn scattered(random: &mut SplitMix64, n: usize) -> Vec<Point> {
    (0..n)
        .map(|_| Point::new(1000.0 * random.unit(), 1000.0 * random.unit()))
        .collect()
}

/// Random lines between `places` places; `both` makes the costs differ by direction.
fn random_lines(
    random: &mut SplitMix64,
    places: usize,
    n: usize,
    m: &impl Metric,
    both: bool,
) -> Vec<Line> {
    (0..n)
        .map(|_| {
            let (a, b) = (random.below(places), random.below(places));
            let cost = m.cost(a, b) * (1.0 + random.unit()) + 10.0 * random.unit();
            let mut line = Line::new(a, b, cost);
            if both {
                line.cost[1] *= 1.0 + random.unit();
            }
            line
        })
        .collect()
}

/// `best[set]`: the cheapest tour from the depot along all lines of the set.
fn oracle(lines: &[Line], depot: usize, m: &impl Metric) -> Vec<f64> {
    let n = lines.len();
    let arcs: Vec<Traversal> = (0..2 * n)
        .map(|i| Traversal {
            line: i / 2,
            backward: i % 2 == 1,
        })
        .collect();
    let mut least = vec![vec![f64::INFINITY; 2 * n]; 1 << n];
    let mut best = vec![f64::INFINITY; 1 << n];
    best[0] = 0.0;
    for set in 0..1usize << n {
        for last in 0..2 * n {
            let here = arcs[last];
            if set & (1 << here.line) == 0 {
                continue;
            }
            let rest = set & !(1 << here.line);
            let into = if rest == 0 {
                m.cost(depot, here.start(lines))
            } else {
                (0..2 * n)
                    .map(|p| least[rest][p] + m.cost(arcs[p].end(lines), here.start(lines)))
                    .fold(f64::INFINITY, f64::min)
            };
            least[set][last] = into + here.cost(lines);
            best[set] = best[set].min(least[set][last] + m.cost(here.end(lines), depot));
        }
    }
    best
}

/// The least makespan over all ways to share the lines.
fn oracle_makespan(lines: &[Line], team: &[Uav], m: &impl Metric) -> f64 {
    let full = (1usize << lines.len()) - 1;
    let mut reach: Vec<f64> = vec![f64::INFINITY; full + 1];
    reach[0] = 0.0;
    for uav in team {
        let own = oracle(lines, uav.depot, m);
        let mut next = vec![f64::INFINITY; full + 1];
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
    reach[full]
}

/// What must hold of every plan, recounted from its passes alone.
fn recount(plan: &LinePlan, lines: &[Line], team: &[Uav], m: &impl Metric) {
    let mut flown: Vec<usize> = plan
        .tours
        .iter()
        .flat_map(|t| t.passes.iter().map(|p| p.line))
        .chain(plan.unserved.iter().copied())
        .collect();
    flown.sort_unstable();
    assert_eq!(flown, (0..lines.len()).collect::<Vec<_>>());
    let mut longest = 0.0f64;
    for (tour, uav) in plan.tours.iter().zip(team) {
        let (mut at, mut cost) = (uav.depot, 0.0);
        for p in &tour.passes {
            let l = lines[p.line];
            let (from, to) = if p.backward { (l.b, l.a) } else { (l.a, l.b) };
            cost += m.cost(at, from) + l.cost[usize::from(p.backward)];
            at = to;
        }
        cost += m.cost(at, uav.depot);
        assert!((cost - tour.cost).abs() < 1e-6);
        assert!(cost / uav.speed <= uav.endurance + 1e-6);
        longest = longest.max(cost / uav.speed);
    }
    assert!((longest - plan.makespan).abs() < 1e-6);
    if plan.unserved.is_empty() {
        assert!(plan.makespan >= plan.lower_bound - 1e-6);
    }
}

#[test]
fn one_tour_over_connected_lines_is_optimal_and_meets_its_bound() {
    let mut random = SplitMix64::new(11);
    for _ in 0..60 {
        let at = scattered(&mut random, 6);
        let m = Straight(&at);
        let mut lines = random_lines(&mut random, 6, 3, &m, false);
        // A path through all places keeps the lines together.
        for i in 0..5 {
            lines.push(Line::new(i, i + 1, m.cost(i, i + 1)));
        }
        let team = [Uav::at(random.below(6))];
        let found = plan(&lines, &team, &m, 0).unwrap();
        recount(&found, &lines, &team, &m);
        let best = oracle(&lines, team[0].depot, &m)[(1 << lines.len()) - 1];
        assert!((found.makespan - best).abs() < 1e-4, "{found:?} {best}");
        assert!((found.makespan - found.lower_bound).abs() < 1e-4);
    }
}

#[test]
fn scattered_lines_come_close_to_the_optimum() {
    let mut random = SplitMix64::new(12);
    let (mut sum, mut worst, rounds) = (0.0, 0.0f64, 60);
    for _ in 0..rounds {
        let at = scattered(&mut random, 9);
        let m = Straight(&at);
        let lines = random_lines(&mut random, 9, 7, &m, true);
        let team = [Uav::at(random.below(9))];
        let found = plan(&lines, &team, &m, 1000).unwrap();
        recount(&found, &lines, &team, &m);
        let best = oracle(&lines, team[0].depot, &m)[(1 << lines.len()) - 1];
        assert!(found.lower_bound <= best + 1e-6);
        let ratio = found.makespan / best;
        assert!(ratio > 1.0 - 1e-9);
        (sum, worst) = (sum + ratio, worst.max(ratio));
    }
    assert!(
        sum / f64::from(rounds) < 1.002 && worst < 1.03,
        "{sum} {worst}"
    );
}

#[test]
fn joining_parts_costs_little_more_than_its_bound() {
    let mut random = SplitMix64::new(17);
    let (mut loose, mut far, rounds) = (0.0, 0.0, 200);
    for _ in 0..rounds {
        let mut at = scattered(&mut random, 9);
        // A few parts far from each other: pairing leaves most of them apart.
        for (i, p) in at.iter_mut().enumerate() {
            p.x += 1500.0 * (i / 3) as f64;
        }
        let m = Straight(&at);
        let lines: Vec<Line> = (0..8)
            .map(|_| {
                let part = 3 * random.below(3);
                let (a, b) = (part + random.below(3), part + random.below(3));
                Line::new(a, b, m.cost(a, b) * (1.0 + random.unit()))
            })
            .collect();
        let team = [Uav::at(random.below(9))];
        let found = plan(&lines, &team, &m, 0).unwrap();
        recount(&found, &lines, &team, &m);
        let best = oracle(&lines, team[0].depot, &m)[(1 << lines.len()) - 1];
        assert!(found.lower_bound <= best + 1e-4, "{found:?} {best}");
        loose += best / found.lower_bound;
        far += found.makespan / best;
    }
    let (loose, far) = (loose / f64::from(rounds), far / f64::from(rounds));
    // A pairing alone lies 1.5 times below the best tours of these.
    assert!(loose < 1.085 && far < 1.03, "{loose} {far}");
}

#[test]
fn teams_come_close_to_the_least_makespan() {
    let mut random = SplitMix64::new(13);
    let (mut sum, mut worst, rounds) = (0.0, 0.0f64, 60);
    for round in 0..rounds {
        let at = scattered(&mut random, 8);
        let m = Straight(&at);
        let lines = random_lines(&mut random, 8, 7, &m, round % 2 == 0);
        let k = 2 + random.below(2);
        let common = random.below(8);
        let team: Vec<Uav> = (0..k)
            .map(|i| {
                let depot = if round % 3 == 0 {
                    random.below(8)
                } else {
                    common
                };
                let speed = if round % 4 == 0 { 1.0 + i as f64 } else { 1.0 };
                Uav {
                    speed,
                    ..Uav::at(depot)
                }
            })
            .collect();
        let found = plan(&lines, &team, &m, 3000).unwrap();
        recount(&found, &lines, &team, &m);
        let best = oracle_makespan(&lines, &team, &m);
        assert!(
            found.lower_bound <= best + 1e-6,
            "{} {best}",
            found.lower_bound
        );
        let ratio = found.makespan / best;
        assert!(ratio > 1.0 - 1e-9);
        (sum, worst) = (sum + ratio, worst.max(ratio));
    }
    assert!(
        sum / f64::from(rounds) < 1.01 && worst < 1.10,
        "{sum} {worst}"
    );
}

#[test]
fn short_endurance_leaves_lines_out_and_says_which() {
    let mut random = SplitMix64::new(14);
    for _ in 0..30 {
        let at = scattered(&mut random, 12);
        let m = Straight(&at);
        let lines = random_lines(&mut random, 12, 15, &m, false);
        let roomy = plan(&lines, &[Uav::at(0); 2], &m, 500).unwrap();
        assert!(roomy.unserved.is_empty());
        let team = [Uav {
            endurance: roomy.makespan * 0.7,
            ..Uav::at(0)
        }; 2];
        let tight = plan(&lines, &team, &m, 500).unwrap();
        recount(&tight, &lines, &team, &m);
        assert!(!tight.unserved.is_empty() && tight.unserved.len() < 12);
        let nobody = [Uav {
            endurance: 0.0,
            ..Uav::at(0)
        }];
        let none = plan(&lines, &nobody, &m, 100).unwrap();
        recount(&none, &lines, &nobody, &m);
    }
}

#[test]
fn in_a_constant_wind_the_single_tour_stays_optimal_in_true_times() {
    let mut random = SplitMix64::new(15);
    for _ in 0..20 {
        let at = scattered(&mut random, 6);
        let wind = Vector::new(9.0 * random.unit(), 9.0 * random.unit());
        let m = InWind::new(&at, 15.0, wind).unwrap();
        let lines: Vec<Line> = (0..6)
            .map(|i| Line::new(i, (i * 2 + 1) % 6, m.cost(i, (i * 2 + 1) % 6)))
            .chain((0..5).map(|i| Line::new(i, i + 1, m.cost(i, i + 1))))
            .collect();
        let lines = &lines[3..];
        let found = plan(lines, &[Uav::at(0)], &m, 0).unwrap();
        // The oracle flies true one-way times, which differ by direction.
        let truly: Vec<Line> = lines
            .iter()
            .map(|l| Line {
                cost: [m.one_way_s(l.a, l.b), m.one_way_s(l.b, l.a)],
                ..*l
            })
            .collect();
        let one_way = |a: usize, b: usize| m.one_way_s(a, b);
        let best = oracle(&truly, 0, &one_way)[(1 << truly.len()) - 1];
        let flown = tour_cost(&found.tours[0].passes, &truly, 0, &one_way);
        assert!((flown - best).abs() < 1e-4, "{flown} {best}");
        assert!((flown - found.makespan).abs() < 1e-6);
    }
}

#[test]
fn the_same_problem_gives_the_same_plan_and_odd_problems_are_answered() {
    let mut random = SplitMix64::new(16);
    let at = scattered(&mut random, 20);
    let m = Straight(&at);
    let lines = random_lines(&mut random, 20, 30, &m, false);
    let team = [Uav::at(3); 4];
    let one = plan(&lines, &team, &m, 2000).unwrap();
    assert_eq!(one, plan(&lines, &team, &m, 2000).unwrap());
    recount(&one, &lines, &team, &m);
    let none = plan(&[], &team, &m, 100).unwrap();
    assert!(none.makespan.abs() < 1e-12 && none.tours.len() == 4);
    assert_eq!(plan(&lines, &[], &m, 100), Err(LineError::NoTeam));
    let bad = [Line::new(0, 1, f64::NAN)];
    assert!(matches!(
        plan(&bad, &team, &m, 1),
        Err(LineError::Cost { index: 0, .. })
    ));
    let still = [Uav {
        speed: 0.0,
        ..Uav::at(0)
    }];
    assert!(matches!(
        plan(&lines, &still, &m, 1),
        Err(LineError::Uav { index: 0, .. })
    ));
    // More UAVs than lines, a line that ends where it begins, two equal lines.
    let few = [
        Line::new(2, 2, 50.0),
        Line::new(4, 5, m.cost(4, 5)),
        Line::new(4, 5, m.cost(4, 5)),
    ];
    let plan = plan(&few, &[Uav::at(0); 5], &m, 200).unwrap();
    recount(&plan, &few, &[Uav::at(0); 5], &m);
}
