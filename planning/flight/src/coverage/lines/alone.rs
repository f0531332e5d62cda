//! The tour of one UAV along lines, as a tour through their ends (D2.7 §3.5 with k = 1).
//!
//! The two ends of a line stand side by side in the tour and stay so: what lies between
//! them costs less than nothing. The exchanges of [`crate::coverage::tour`] then choose
//! the order of the lines and the way along each at once.

use super::network::{Line, Traversal, reversed};
use crate::coverage::metric::Metric;
use crate::coverage::tour::{self, Tour};

/// Costs between the ends of lines.
struct Ends<'a, M> {
    metric: &'a M,
    /// By node: its place, and the line that it is an end of.
    of: Vec<(usize, usize)>,
    /// What makes the ends of a line stay together: more than any exchange can gain.
    bond: f64,
}

/// Steps for each line at most: a tour of few lines is as good as it gets after that.
const MOST_STEPS_A_LINE: usize = 100;

/// No line: the depot.
const NONE: usize = usize::MAX;

impl<M: Metric> Metric for Ends<'_, M> {
    fn cost(&self, a: usize, b: usize) -> f64 {
        let ((p, line), (q, other)) = (self.of[a], self.of[b]);
        if line == other && a != b {
            return -self.bond;
        }
        self.metric.cost(p, q)
    }
}

/// Improves the tour from `depot` along `passes` in `steps` steps.
///
/// # Guarantees
/// The same lines; never longer than before. The same steps give the same tour.
///
/// # Complexity
/// O(n²) distances, then O(1) for a step in most networks.
pub(super) fn improve(
    passes: &mut Vec<Traversal>,
    lines: &[Line],
    depot: usize,
    metric: &impl Metric,
    steps: usize,
) {
    let before = super::tour_cost(passes, lines, depot, metric);
    let steps = steps.min(MOST_STEPS_A_LINE * passes.len());
    let mut of = vec![(depot, NONE)];
    for pass in passes.iter() {
        let (start, end) = (pass.start(lines), pass.end(lines));
        of.push((start, pass.line));
        if start != end {
            of.push((end, pass.line));
        }
    }
    let ends = Ends {
        metric,
        of,
        bond: 1.0 + before,
    };
    let order: Vec<usize> = (0..ends.of.len()).collect();
    let cost = tour::closed_cost(&order, &ends);
    let found = tour::searched(Tour { order, cost }, &ends, steps);
    let mut ahead = Vec::with_capacity(passes.len());
    let mut nodes = found.order.iter().skip(1).map(|&node| ends.of[node]);
    while let Some((place, line)) = nodes.next() {
        let l = lines[line];
        let backward = l.a != place;
        if l.a != l.b {
            nodes.next();
        }
        ahead.push(Traversal { line, backward });
    }
    let back = reversed(&ahead);
    let cost = |passes: &[Traversal]| super::tour_cost(passes, lines, depot, metric);
    let found = if cost(&back) < cost(&ahead) {
        back
    } else {
        ahead
    };
    if cost(&found) < before {
        *passes = found;
    }
}
