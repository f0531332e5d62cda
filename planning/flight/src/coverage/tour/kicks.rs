//! Iterated local search over a closed tour: two runs of places beside each other change
//! places, exchanges repair what that made worse, and what ends up much longer is taken
//! back (a tool of D2.7 §3.4 and §3.5).
//!
//! Martin, Otto and Felten, "Large-step Markov chains for the traveling salesman problem",
//! 1991; short runs as in Johnson and McGeoch, "The traveling salesman problem: a case
//! study in local optimization", 1997: a kick and its repair stay near one place, so they
//! cost the same in a large tour as in a small one.

use super::exchange::Exchange;
use crate::coverage::metric::Metric;
use skein_geometry::math;
use skein_geometry::random::SplitMix64;

/// Kicks in a step: a step of the search of teams moves about as many places.
const KICKS_A_STEP: usize = 10;

/// The longest run of places that a kick moves.
const LONGEST_RUN: usize = 30;

/// Losses that are kept at first and at last, in mean legs that may be given up.
const HEATS: (f64, f64) = (0.1, 0.02);

/// The same where some legs stay: what lies between these is harder to turn.
const HEATS_OF_LINES: (f64, f64) = (2.0, 0.05);

/// Tours of fewer places have no room for two runs and what is around them.
const FEWEST: usize = 8;

/// Kicks and repairs, `steps` times ten; the nodes of the best tour in order.
///
/// # Guarantees
/// Never longer than before.
///
/// # Complexity
/// Nearly the same for each step, however large the tour.
pub(super) fn search<M: Metric>(tour: &mut Exchange<'_, M>, steps: usize) -> Vec<u32> {
    tour.descend();
    tour.keep();
    let n = tour.len();
    let mut best = tour.order().to_vec();
    let kicks = steps.saturating_mul(KICKS_A_STEP);
    if n < FEWEST || kicks == 0 {
        return best;
    }
    let mut random = SplitMix64::new(n as u64);
    let (mean_leg, some_stay) = tour.mean_leg();
    let (warm, cold) = if some_stay { HEATS_OF_LINES } else { HEATS };
    let cooling = math::exp(math::ln(cold / warm) / kicks as f64);
    let mut heat = warm * mean_leg;
    // What the tour is longer by than the best one.
    let mut excess = 0.0;
    for _ in 0..kicks {
        heat *= cooling;
        let Some(lost) = kick(tour, &mut random) else {
            continue;
        };
        let grown = lost - tour.descend();
        // Keeps a loss with the probability exp(-loss / heat).
        if grown > -heat * math::ln(random.unit().max(1e-12)) {
            tour.take_back();
            continue;
        }
        tour.keep();
        excess += grown;
        if excess < 0.0 {
            excess = 0.0;
            best.copy_from_slice(tour.order());
        }
    }
    best
}

/// Two runs somewhere change places; what the tour grows by, or nothing where the runs do
/// not fit.
fn kick<M: Metric>(tour: &mut Exchange<'_, M>, random: &mut SplitMix64) -> Option<f64> {
    let n = tour.len();
    let longest = LONGEST_RUN.min(n / 3);
    // A run begins where the leg that leads to it may be given up.
    let from = begin(tour, random.below(n))?;
    let middle = begin(tour, from + 1 + random.below(longest))?;
    let end = begin(tour, middle + 1 + random.below(longest))?;
    if end - from >= n {
        return None;
    }
    let cut = |position: usize| (tour.node(position + n - 1), tour.node(position));
    let [(before, a), (a_last, b), (b_last, after)] = [from, middle, end].map(cut);
    let old = tour.cost(before, a) + tour.cost(a_last, b) + tour.cost(b_last, after);
    let new = tour.cost(before, b) + tour.cost(b_last, a) + tour.cost(a_last, after);
    tour.swap_runs([before, after], [a, a_last], [b, b_last]);
    Some(new - old)
}

/// The first position from this one on that is entered by a leg which may be given up.
fn begin<M: Metric>(tour: &Exchange<'_, M>, position: usize) -> Option<usize> {
    let n = tour.len();
    let stays = |p: usize| tour.cost(tour.node(p + n - 1), tour.node(p)) < 0.0;
    (position..position + 3).find(|&p| !stays(p))
}
