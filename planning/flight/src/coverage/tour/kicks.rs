//! Iterated local search over a closed tour: two runs of places beside each other change
//! places, exchanges repair what that made worse, and what ends up longer is taken back
//! (a tool of D2.7 §3.4 and §3.5).
//!
//! Martin, Otto and Felten, "Large-step Markov chains for the traveling salesman problem",
//! 1991; short runs as in Johnson and McGeoch, "The traveling salesman problem: a case
//! study in local optimization", 1997: a kick and its repair stay near one place, so they
//! cost the same in a large tour as in a small one.

use super::exchange::Exchange;
use crate::coverage::metric::Metric;
use skein_geometry::random::SplitMix64;

/// Kicks in a step: a step of the search of teams moves about as many places.
const KICKS_A_STEP: usize = 10;

/// The longest run of places that a kick moves.
const LONGEST_RUN: usize = 50;

/// The fewest places that there is more than one tour of.
const FEWEST: usize = 5;

/// Kicks and repairs, `steps` times ten.
///
/// # Guarantees
/// Never longer than before.
///
/// # Complexity
/// Nearly the same for each step, however large the tour.
pub(super) fn search<M: Metric>(tour: &mut Exchange<'_, M>, steps: usize) {
    tour.descend();
    tour.keep();
    let n = tour.len();
    if n < FEWEST + 3 {
        return;
    }
    let mut random = SplitMix64::new(n as u64);
    for _ in 0..steps.saturating_mul(KICKS_A_STEP) {
        let Some(lost) = kick(tour, &mut random) else {
            continue;
        };
        if tour.descend() < lost {
            tour.take_back();
        } else {
            tour.keep();
        }
    }
}

/// Two runs somewhere change places; what the tour grows by, or nothing where a leg that
/// must stay would be given up.
fn kick<M: Metric>(tour: &mut Exchange<'_, M>, random: &mut SplitMix64) -> Option<f64> {
    let n = tour.len();
    let longest = LONGEST_RUN.min((n - 2) / 3);
    let from = random.below(n);
    let first = 1 + random.below(longest);
    let second = 1 + random.below(longest);
    let at = |position: usize| (tour.node(from + position), tour.node(from + position + n - 1));
    let ((a, before), (b, a_last), (after, b_last)) = (at(0), at(first), at(first + second));
    let old = [tour.cost(before, a), tour.cost(a_last, b), tour.cost(b_last, after)];
    if old.iter().any(|cost| *cost < 0.0) {
        return None;
    }
    let new = tour.cost(before, b) + tour.cost(b_last, a) + tour.cost(a_last, after);
    tour.swap_runs(from, first, second);
    for v in [before, a, a_last, b, b_last, after] {
        tour.look_at(v);
    }
    Some(new - old.iter().sum::<f64>())
}
