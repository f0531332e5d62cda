//! Endurance too short for all lines: which of them are left out (D2.7 §3.5 with the
//! limits of §2.2).

use super::network::{Line, Traversal, Uav, tour_cost};
use crate::coverage::metric::Metric;

/// A tour may be this much longer than the endurance allows: rounding of sums.
const ROUNDING: f64 = 1e-9;

/// Takes lines out of tours that are too long, those first that free the most for the
/// work they hold, then puts back what fits elsewhere. The lines left out, ascending.
///
/// # Guarantees
/// Every tour is within its UAV's endurance afterwards. Which lines are left out is a
/// heuristic choice.
pub(super) fn trim(
    tours: &mut [Vec<Traversal>],
    lines: &[Line],
    team: &[Uav],
    metric: &impl Metric,
) -> Vec<usize> {
    let fits = |tour: &[Traversal], uav: &Uav| {
        tour_cost(tour, lines, uav.depot, metric) <= uav.endurance * uav.speed * (1.0 + ROUNDING)
    };
    let mut left: Vec<Traversal> = Vec::new();
    for (tour, uav) in tours.iter_mut().zip(team) {
        while !tour.is_empty() && !fits(tour, uav) {
            let worst = worst(tour, lines, uav, metric);
            left.push(tour.remove(worst));
        }
    }
    // The longest first: they are the hardest to place.
    left.sort_by(|a, b| b.cost(lines).total_cmp(&a.cost(lines)).then(a.cmp(b)));
    let mut unserved = Vec::new();
    for pass in left {
        let placed = tours
            .iter_mut()
            .zip(team)
            .any(|(tour, uav)| place(tour, pass, lines, uav, metric));
        if !placed {
            unserved.push(pass.line);
        }
    }
    unserved.sort_unstable();
    unserved
}

/// The pass whose removal saves the most flight for each metre of work given up.
fn worst(tour: &[Traversal], lines: &[Line], uav: &Uav, metric: &impl Metric) -> usize {
    let saved = |i: usize| {
        let before = i.checked_sub(1).map_or(uav.depot, |j| tour[j].end(lines));
        let after = tour.get(i + 1).map_or(uav.depot, |p| p.start(lines));
        let own = tour[i].cost(lines);
        let there = metric.cost(before, tour[i].start(lines));
        let back = metric.cost(tour[i].end(lines), after);
        (there + own + back - metric.cost(before, after)) / own.max(1e-9)
    };
    (0..tour.len())
        .max_by(|&a, &b| saved(a).total_cmp(&saved(b)).then(b.cmp(&a)))
        .unwrap_or(0)
}

/// Puts `pass` where it costs least in `tour`, if the UAV can still fly that.
fn place(
    tour: &mut Vec<Traversal>,
    pass: Traversal,
    lines: &[Line],
    uav: &Uav,
    metric: &impl Metric,
) -> bool {
    let now = tour_cost(tour, lines, uav.depot, metric);
    let mut best: Option<(f64, usize, Traversal)> = None;
    for i in 0..=tour.len() {
        let before = i.checked_sub(1).map_or(uav.depot, |j| tour[j].end(lines));
        let after = tour.get(i).map_or(uav.depot, |p| p.start(lines));
        for backward in [false, true] {
            let turned = Traversal { backward, ..pass };
            let more = metric.cost(before, turned.start(lines))
                + turned.cost(lines)
                + metric.cost(turned.end(lines), after)
                - metric.cost(before, after);
            if best.as_ref().is_none_or(|b| more < b.0) {
                best = Some((more, i, turned));
            }
        }
    }
    match best {
        Some((more, i, turned)) if now + more <= uav.endurance * uav.speed => {
            tour.insert(i, turned);
            true
        }
        _ => false,
    }
}
