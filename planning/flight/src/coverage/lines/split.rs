//! One tour cut into as many as there are UAVs (D2.7 §3.5; route first, cluster second).
//!
//! Beasley, "Route first–cluster second methods for vehicle routing", 1983,
//! <https://doi.org/10.1016/0305-0483(83)90033-6>.
//!
//! Leaves to `improve` to move lines between the tours.

use super::network::{Line, Traversal, Uav};
use crate::coverage::metric::Metric;

/// Rotations of the tour that are tried; more gain less than the improvement that follows.
const ROTATIONS: usize = 256;

/// Halvings of the makespan's interval: below a millionth of the tour.
const HALVINGS: usize = 20;

/// A closed tour as a cyclic list with the cost of every stretch.
struct Ring<'a, M> {
    passes: &'a [Traversal],
    lines: &'a [Line],
    team: &'a [Uav],
    metric: &'a M,
    /// Cost from the start of the first pass to the start of pass `i`, over two rounds.
    upto: Vec<f64>,
}

/// Cuts the cyclic tour `passes` into one stretch a UAV, in the order of the team.
///
/// # Guarantees
/// For each rotation that is tried, the least makespan of all cuts, where the costs obey
/// the triangle inequality.
///
/// # Complexity
/// O(k log n) for each rotation and halving.
pub(super) fn split(
    passes: &[Traversal],
    lines: &[Line],
    team: &[Uav],
    metric: &impl Metric,
) -> Vec<Vec<Traversal>> {
    let n = passes.len();
    let mut upto = vec![0.0];
    for i in 0..2 * n {
        let (pass, next) = (passes[i % n], passes[(i + 1) % n]);
        let step = pass.cost(lines) + metric.cost(pass.end(lines), next.start(lines));
        upto.push(upto[i] + step);
    }
    let ring = Ring {
        passes,
        lines,
        team,
        metric,
        upto,
    };
    let mut best: Option<(f64, Vec<usize>)> = None;
    let stride = n.div_ceil(ROTATIONS).max(1);
    for from in (0..n).step_by(stride) {
        let limit = best.as_ref().map_or(f64::INFINITY, |b| b.0);
        if let Some(found) = ring.least(from, limit) {
            best = Some(found);
        }
    }
    let cuts = best.map_or_else(Vec::new, |b| b.1);
    (0..team.len())
        .map(|t| match (cuts.get(t), cuts.get(t + 1)) {
            (Some(&i), Some(&j)) => (i..j).map(|p| passes[p % n]).collect(),
            _ => Vec::new(),
        })
        .collect()
}

impl<M: Metric> Ring<'_, M> {
    /// Cost of the passes from `i` up to, without, `j` for one UAV.
    fn stretch(&self, uav: &Uav, i: usize, j: usize) -> f64 {
        if i == j {
            return 0.0;
        }
        let n = self.passes.len();
        let (first, last) = (self.passes[i % n], self.passes[(j - 1) % n]);
        let flown = self.upto[j - 1] - self.upto[i] + last.cost(self.lines);
        self.metric.cost(uav.depot, first.start(self.lines))
            + flown
            + self.metric.cost(last.end(self.lines), uav.depot)
    }

    /// The cuts from `from` on when nobody flies longer than `time`, or `None` if that
    /// is too short. Every UAV takes as much as it can.
    fn cuts(&self, from: usize, time: f64) -> Option<Vec<usize>> {
        let end = from + self.passes.len();
        let mut cuts = vec![from];
        let mut at = from;
        for uav in self.team {
            let (mut least, mut most) = (at, end);
            while least < most {
                let middle = (least + most).div_ceil(2);
                if self.stretch(uav, at, middle) <= time * uav.speed {
                    least = middle;
                } else {
                    most = middle - 1;
                }
            }
            at = least;
            cuts.push(at);
        }
        (at == end).then_some(cuts)
    }

    /// The least makespan from `from` on and its cuts, if below `limit`.
    fn least(&self, from: usize, limit: f64) -> Option<(f64, Vec<usize>)> {
        let speed: f64 = self.team.iter().map(|u| u.speed).sum();
        let mut least = (self.upto[self.passes.len()] / speed) * 0.5;
        let mut most = if limit.is_finite() {
            limit * (1.0 - 1e-6)
        } else {
            let alone = |u: &Uav| self.stretch(u, from, from + self.passes.len()) / u.speed;
            self.team.iter().map(alone).fold(f64::INFINITY, f64::min)
        };
        let mut cuts = self.cuts(from, most)?;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (least + most);
            match self.cuts(from, middle) {
                Some(better) => (most, cuts) = (middle, better),
                None => least = middle,
            }
        }
        Some((most, cuts))
    }
}
