//! The division that serves the most cells when endurance does not suffice for all
//! (D2.7 §3.6.5, which leaves this case open).
//!
//! Exact, by one pass round the ring for each share of one UAV. The times come
//! from [`super::backtracking`], whose tests compare the result with every choice.

use super::backtracking::Solver;

/// Which shares each UAV can serve within a limit, for the plan that serves the
/// most cells when not all can be served.
///
/// With a share to the left given, the largest to the right is never worse: a cell
/// left to the next UAV costs that UAV at least as much of its own right. So a
/// UAV's state is its left share alone, and one pass over the gaps finds the best
/// for each left share of the first UAV.
pub(super) struct Shares<'a> {
    solver: &'a Solver<'a>,
    /// Largest share to the right by UAV and share to the left; a left share beyond
    /// the list cannot be served.
    rights: Vec<Vec<usize>>,
    /// The UAV after the smallest gap: there the fewest shares have to be tried.
    first: usize,
    /// Open cells before each place of the unrolled ring.
    open_before: Vec<usize>,
}

impl<'a> Shares<'a> {
    pub fn new(solver: &'a Solver<'a>, limit_ms: u64) -> Self {
        let k = solver.uavs.len();
        let rights = (0..k)
            .map(|i| {
                (0..=solver.gap((i + k - 1) % k))
                    .take_while(|&left| solver.fits(i, left, 0, limit_ms))
                    .map(|left| solver.most(solver.gap(i), |x| solver.fits(i, left, x, limit_ms)))
                    .collect()
            })
            .collect();
        let closing = (0..k).min_by_key(|&i| solver.gap(i)).unwrap_or(0);
        let n = solver.ring.len();
        let mut open_before = vec![0; 3 * n + 1];
        for i in 0..3 * n {
            open_before[i + 1] = open_before[i] + usize::from(solver.ring[i % n].open);
        }
        Self {
            solver,
            rights,
            first: (closing + 1) % k.max(1),
            open_before,
        }
    }

    /// Open cells in the shares of UAV `i`.
    fn open(&self, i: usize, left: usize, right: usize) -> usize {
        let at = self.solver.ring.len() + usize::from(self.solver.uavs[i].anchor);
        self.open_before[at + right] - self.open_before[at - left]
    }

    /// The most cells that can be served, and by which shares: ties go to the smallest
    /// share to the left of the first UAV, then of the others.
    pub fn best(&self) -> (usize, Vec<(usize, usize)>) {
        let k = self.solver.uavs.len();
        let mut best: (usize, Vec<usize>) = (0, vec![0; k]);
        for first_left in 0..self.rights[self.first].len() {
            let (count, lefts) = self.sweep(first_left);
            if count > best.0 {
                best = (count, lefts);
            }
        }
        let mut extents = vec![(0, 0); k];
        for j in 0..k {
            let i = (self.first + j) % k;
            let after = best.1[(j + 1) % k];
            let right = self.rights[i][best.1[j]].min(self.solver.gap(i) - after);
            extents[i] = (best.1[j], right);
        }
        (best.0, extents)
    }

    /// The best for one left share of the first UAV: cells served, and the left
    /// shares in the order of the sweep.
    fn sweep(&self, first_left: usize) -> (usize, Vec<usize>) {
        let k = self.solver.uavs.len();
        // By left share: cells served so far, or none when it cannot come to that.
        let mut served: Vec<Option<usize>> = vec![None; first_left + 1];
        served[first_left] = Some(self.open(self.first, first_left, 0));
        let mut came_from: Vec<Vec<usize>> = Vec::with_capacity(k);
        for j in 0..k - 1 {
            let i = (self.first + j) % k;
            let next = (i + 1) % k;
            let gap = self.solver.gap(i);
            // By the cells left over in the gap: the most served, and from which share.
            let mut left_over: Vec<Option<(usize, usize)>> = vec![None; gap + 1];
            for (left, count) in served.iter().enumerate() {
                let Some(count) = count else { continue };
                let right = self.rights[i][left];
                let total = count + self.open(i, 0, right);
                let slot = &mut left_over[gap - right];
                if slot.is_none_or(|(c, _)| total > c) {
                    *slot = Some((total, left));
                }
            }
            // A UAV may take less than what is left over.
            for x in (0..gap).rev() {
                if left_over[x + 1].is_some_and(|(c, _)| left_over[x].is_none_or(|(d, _)| c > d)) {
                    left_over[x] = left_over[x + 1];
                }
            }
            let reachable = self.rights[next].len().min(gap + 1);
            served = (0..reachable)
                .map(|left| Some(left_over[left]?.0 + self.open(next, left, 0)))
                .collect();
            came_from.push(left_over.iter().map(|x| x.map_or(0, |(_, l)| l)).collect());
        }
        let last = (self.first + k - 1) % k;
        let room = self.solver.gap(last) - first_left;
        let mut best: Option<(usize, usize)> = None;
        for (left, count) in served.iter().enumerate() {
            let Some(count) = count else { continue };
            let total = count + self.open(last, 0, self.rights[last][left].min(room));
            if best.is_none_or(|(c, _)| total > c) {
                best = Some((total, left));
            }
        }
        let (count, mut left) = best.unwrap_or((0, 0));
        let mut lefts = vec![left];
        for from in came_from.iter().rev() {
            left = from[left];
            lefts.push(left);
        }
        lefts.reverse();
        (count, lefts)
    }
}
