//! How long any plan takes at least (D2.7 §3.6): what a planner's answer is measured
//! against, without knowing the optimum.
//!
//! Cells at least `d` moves from every root can only be visited by UAVs that have spent
//! `d − 1` moves elsewhere; the rest of their moves visit at most one new cell each.

use super::map::UNREACHED;
use super::plan::Task;

/// How many cells of the task lie at each distance from the nearest root.
fn layers(task: &Task) -> Vec<u64> {
    let moves = task.map.distances(&task.roots);
    let mut layers = Vec::new();
    for d in moves.into_iter().filter(|d| *d != UNREACHED) {
        let d = d as usize;
        if d >= layers.len() {
            layers.resize(d + 1, 0);
        }
        layers[d] += 1;
    }
    layers
}

/// No plan for equal UAVs has a shorter longest path, in moves.
///
/// # Guarantees
/// At most the optimum, open or closed as the task says; speeds and endurance are left
/// out.
///
/// # Complexity
/// O(N).
#[must_use]
pub fn reach_moves(task: &Task) -> u32 {
    let k = task.n_uavs().max(1) as u64;
    let mut far = 0;
    let mut bound = 0;
    for (d, here) in (0u64..)
        .zip(layers(task))
        .collect::<Vec<_>>()
        .into_iter()
        .rev()
    {
        far += here;
        // A UAV that returns flies the way to the first and from the last far cell.
        let ways = if task.closed { 2 * d } else { d };
        let closing = u64::from(task.closed && d == 0);
        bound = bound.max((ways + far.div_ceil(k) + closing).saturating_sub(1));
    }
    // One cell alone needs no move, even there and back.
    let bound = if far <= 1 { 0 } else { bound };
    u32::try_from(bound).unwrap_or(u32::MAX)
}

/// No plan is done sooner, in moves of a UAV of speed 1, with each UAV flying `speeds`
/// cells in that time.
///
/// # Complexity
/// O(N + D k log N) for D layers.
#[must_use]
pub fn reach_time(task: &Task) -> f64 {
    let mut far = 0u64;
    let mut bound = 0.0f64;
    for (d, here) in (0u32..)
        .zip(layers(task))
        .collect::<Vec<_>>()
        .into_iter()
        .rev()
    {
        far += here;
        bound = bound.max(least_time(&task.speeds, f64::from(d), far as f64));
    }
    bound
}

/// The least time T with sum over UAVs of max(0, v T − d + 1) at least `cells`.
fn least_time(speeds: &[u32], d: f64, cells: f64) -> f64 {
    // With the r fastest UAVs in play: T = (cells + r (d − 1)) / (their speeds).
    let mut fastest = speeds.to_vec();
    fastest.sort_unstable_by(|a, b| b.cmp(a));
    let mut sum = 0.0;
    let mut least = f64::INFINITY;
    for (r, v) in (1u32..).zip(&fastest) {
        sum += f64::from(*v);
        let t = (cells + f64::from(r) * (d - 1.0)) / sum;
        // UAVs that cannot get there in t do not help; the others alone give the same t.
        least = least.min(t.max(0.0));
    }
    if least.is_finite() { least } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::super::map::LaneMap;
    use super::*;

    #[test]
    fn a_corridor_needs_its_length() {
        let map = LaneMap::new(1, 10, |_, _| true).unwrap();
        let end = map.cell(0, 0).unwrap();
        assert_eq!(reach_moves(&Task::new(&map, &[end], false).unwrap()), 9);
        assert_eq!(reach_moves(&Task::new(&map, &[end], true).unwrap()), 18);
        assert_eq!(
            reach_moves(&Task::new(&map, &[end, end], false).unwrap()),
            9
        );
        assert!((reach_time(&Task::new(&map, &[end], false).unwrap()) - 9.0).abs() < 1e-12);
    }

    #[test]
    fn an_open_field_is_shared() {
        let map = LaneMap::new(20, 20, |_, _| true).unwrap();
        let at = map.cell(10, 10).unwrap();
        // The other 399 cells, shared by four; who returns flies over some of the four
        // beside the root once more.
        assert_eq!(reach_moves(&Task::new(&map, &[at; 4], false).unwrap()), 100);
        assert_eq!(reach_moves(&Task::new(&map, &[at; 4], true).unwrap()), 102);
    }
}
