//! Line and strip coverage: the rural postman, for one UAV and for a team (D2.7 §3.5).
//!
//! D2.7 states the min-max k-rural-postman problem and has no algorithm for it. Here:
//! pair up the places where an odd number of lines end, join what is apart, walk it;
//! cut the walk into one tour a UAV; move lines between the tours until the longest
//! stops shrinking.
//!
//! | file | what it holds |
//! |---|---|
//! | `network` | lines, team, tours |
//! | `parts` | union-find over places |
//! | `blossom`, `matching` | the cheapest pairing of places, exact |
//! | `postman` | one tour along all lines |
//! | `moats` | parts that are apart: what joining them costs, and how |
//! | `alone` | local search on a tour of one UAV |
//! | `split` | one tour cut into several |
//! | `improve` | local search on the longest tour |
//! | [`strip`] | strips wider than a swath, as lanes |
//! | `trim` | what is left out when endurance is short |
//! | `bound` | what no plan can beat |
//!
//! Wind: on closed tours a constant wind is a symmetric cost
//! ([`crate::coverage::metric::InWind`]), so nothing here needs to know of it, unless
//! lines are flown at another airspeed than deadheads: then they have two costs.
//!
//! ```
//! use skein_flight::coverage::lines::{Line, Uav, plan};
//! use skein_flight::coverage::metric::{Metric, Straight};
//! use skein_geometry::frame::Point;
//! // Three sides of a square: the fourth is the only deadhead.
//! let at = [(0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0)];
//! let at: Vec<Point> = at.iter().map(|&(x, y)| Point::new(x, y)).collect();
//! let roads = Straight(&at);
//! let lines: Vec<Line> = (0..3).map(|i| Line::new(i, i + 1, roads.cost(i, i + 1))).collect();
//! let plan = plan(&lines, &[Uav::at(0)], &roads, 1000).unwrap();
//! assert!((plan.makespan - 400.0).abs() < 1e-9);
//! assert_eq!(plan.tours[0].places(&lines, 0).len(), 5);
//! ```

mod alone;
mod blossom;
mod bound;
mod improve;
mod matching;
mod moats;
mod network;
mod parts;
mod postman;
mod split;
pub mod strip;
mod trim;

pub use bound::shared as shared_time;
pub use network::{Line, LineError, LinePlan, LineTour, Traversal, Uav, tour_cost};
pub use parts::Parts;

use crate::coverage::metric::Metric;
use moats::Joining;

/// Steps of improvement that a mission uses unless it says otherwise: about a third of a
/// second for the roads of a square kilometre.
pub const DEFAULT_STEPS: usize = 20_000;

/// Steps for a single tour where the way along a line matters: it is improved already.
const STEPS_ALONE: usize = 1_000;

/// Costs that differ by less than this share are the same.
const SAME: f64 = 1e-9;

/// Plans that the improvement begins with; the best goes on.
const STARTS: usize = 4;

/// Lines above which the way along each is left as it is: looking up the neighbours of
/// all would take longer than the tour, for the last tenth of a percent.
const MOST_ALONE: usize = 1_000;

/// Plans closed tours for a team so that every line is flown along once and the longest
/// tour is short.
///
/// `metric` says what it costs to fly from one end of a line (or depot) to another; it
/// must obey the triangle inequality for the guarantees to hold. `steps` bounds the
/// improvement; the same steps give the same plan everywhere.
///
/// # Guarantees
/// Each line is in exactly one tour or in `unserved`; every tour is within its UAV's
/// endurance. For one UAV, with the lines connected, its depot on them and the same cost
/// both ways, the tour is the shortest possible and equals `lower_bound`. Otherwise
/// `makespan / lower_bound` tells how far from the optimum the plan may be at most.
///
/// # Complexity
/// One tour: nearly O(n log n) searches and O(n²) distances. Improvement: O(k) for each
/// line moved in a step.
///
/// # Errors
/// [`LineError`] when there is nobody to fly, or a figure is no sensible number.
pub fn plan(
    lines: &[Line],
    team: &[Uav],
    metric: &impl Metric,
    steps: usize,
) -> Result<LinePlan, LineError> {
    planned(lines, team, metric, steps, Joining::Proven)
}

/// As [`plan`], for passes over an area, which all lie apart: they are joined in the
/// cheapest way at hand, and the local search does the rest. `lower_bound` is weaker.
///
/// # Errors
/// As [`plan`].
pub fn plan_passes(
    lines: &[Line],
    team: &[Uav],
    metric: &impl Metric,
    steps: usize,
) -> Result<LinePlan, LineError> {
    planned(lines, team, metric, steps, Joining::Simple)
}

fn planned(
    lines: &[Line],
    team: &[Uav],
    metric: &impl Metric,
    steps: usize,
    how: Joining,
) -> Result<LinePlan, LineError> {
    network::check(lines, team)?;
    let all: Vec<usize> = (0..lines.len()).collect();
    // One UAV flies the tour as it is; several begin from different walks of it.
    let starts = if team.len() == 1 { 1 } else { STARTS };
    let depots: Vec<usize> = team.iter().map(|u| u.depot).collect();
    let found = postman::solve(lines, &all, &depots, metric, starts, how);
    let lower_bound = bound::makespan(lines, team, metric, found.bound);
    improved(lines, team, metric, steps, lower_bound, found.tours)
}

/// Shares each of the tours `giants` out among the team, improves the shares and goes on
/// with the best: what is the same for lines and for points.
///
/// # Errors
/// As [`plan`].
pub fn improved(
    lines: &[Line],
    team: &[Uav],
    metric: &impl Metric,
    steps: usize,
    lower_bound: f64,
    giants: Vec<Vec<Traversal>>,
) -> Result<LinePlan, LineError> {
    network::check(lines, team)?;
    let mut tours = shared_out(lines, team, metric, steps, lower_bound, giants);
    let unserved = trim::trim(&mut tours, lines, team, metric);
    let times = times(&tours, lines, team, metric);
    let tours = tours
        .into_iter()
        .zip(team)
        .map(|(passes, uav)| LineTour {
            cost: tour_cost(&passes, lines, uav.depot, metric),
            passes,
        })
        .collect();
    Ok(LinePlan {
        tours,
        makespan: times.0,
        lower_bound,
        unserved,
    })
}

fn shared_out(
    lines: &[Line],
    team: &[Uav],
    metric: &impl Metric,
    steps: usize,
    lower_bound: f64,
    giants: Vec<Vec<Traversal>>,
) -> Vec<Vec<Traversal>> {
    let giants = short_giants(lines, team, metric, steps, lower_bound, giants);
    let share = |giant: Vec<Traversal>| match team.len() {
        1 => vec![giant],
        _ => split::split(&giant, lines, team, metric),
    };
    let mut plans: Vec<Vec<Vec<Traversal>>> = giants.into_iter().map(share).collect();
    let key = |tours: &Vec<Vec<Traversal>>| times(tours, lines, team, metric);
    let order = |a: &Vec<Vec<Traversal>>, b: &Vec<Vec<Traversal>>| {
        let (a, b) = (key(a), key(b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    };
    plans.sort_by(order);
    let Some(mut best) = plans.first().cloned() else {
        return vec![Vec::new(); team.len()];
    };
    if key(&best).0 <= lower_bound * (1.0 + SAME) {
        return best;
    }
    let search = improve::Search::new(lines, team, metric, lower_bound);
    if team.len() == 1 {
        // The tour is as short as it gets, unless the way along a line matters.
        let matters = |l: &Line| (l.cost[0] - l.cost[1]).abs() > SAME * l.cost[0];
        if lines.len() <= MOST_ALONE && lines.iter().any(matters) {
            search.run(&mut best, steps.min(STEPS_ALONE), improve::LUKEWARM, 0);
        }
        return best;
    }
    for seed in 0..STARTS {
        let start = seed % plans.len();
        let mut plan = plans[start].clone();
        search.run(&mut plan, steps / (2 * STARTS), improve::WARM, seed as u64);
        if order(&plan, &best).is_lt() {
            best = plan;
        }
    }
    search.run(&mut best, steps / 2, improve::LUKEWARM, STARTS as u64);
    postmen_again(&mut best, lines, team, metric);
    each_alone(&mut best, lines, team, metric, steps);
    best
}

/// Improves every tour of a team by itself; each has its share of the steps.
fn each_alone(
    tours: &mut [Vec<Traversal>],
    lines: &[Line],
    team: &[Uav],
    metric: &impl Metric,
    steps: usize,
) {
    let share = steps / team.len();
    for (tour, uav) in tours.iter_mut().zip(team) {
        alone::improve(tour, lines, uav.depot, metric, share);
    }
}

/// The tours that are shared out: the first of `giants` improved, where that shortens it,
/// in place of all of them.
fn short_giants(
    lines: &[Line],
    team: &[Uav],
    metric: &impl Metric,
    steps: usize,
    lower_bound: f64,
    giants: Vec<Vec<Traversal>>,
) -> Vec<Vec<Traversal>> {
    let (Some(first), Some(uav)) = (giants.first(), team.first()) else {
        return giants;
    };
    let cost = |passes: &[Traversal]| tour_cost(passes, lines, uav.depot, metric);
    let before = cost(first);
    let speed: f64 = team.iter().map(|u| u.speed).sum();
    if before <= lower_bound * speed * (1.0 + SAME) {
        return giants;
    }
    let mut short = first.clone();
    let share = if team.len() == 1 { steps } else { steps / 2 };
    alone::improve(&mut short, lines, uav.depot, metric, share);
    if cost(&short) < before * (1.0 - SAME) {
        vec![short]
    } else {
        giants
    }
}

/// The longest time and the sum of all times.
fn times(
    tours: &[Vec<Traversal>],
    lines: &[Line],
    team: &[Uav],
    metric: &impl Metric,
) -> (f64, f64) {
    let mut both = (0.0f64, 0.0);
    for (tour, uav) in tours.iter().zip(team) {
        let time = tour_cost(tour, lines, uav.depot, metric) / uav.speed;
        both = (both.0.max(time), both.1 + time);
    }
    both
}

/// Replaces a tour by the postman's own for the same lines where that is shorter.
fn postmen_again(tours: &mut [Vec<Traversal>], lines: &[Line], team: &[Uav], metric: &impl Metric) {
    for (tour, uav) in tours.iter_mut().zip(team) {
        let ids: Vec<usize> = tour.iter().map(|p| p.line).collect();
        if ids.is_empty() {
            continue;
        }
        let again = postman::tour(lines, &ids, uav.depot, metric);
        let cost = |passes: &[Traversal]| tour_cost(passes, lines, uav.depot, metric);
        if cost(&again) < cost(tour) {
            *tour = again;
        }
    }
}

#[cfg(test)]
mod tests;
