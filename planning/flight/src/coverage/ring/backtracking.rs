//! Optimal division of a coverage loop among UAVs: backtracking MSTC (D2.7 §3.6.5,
//! algorithm 7, after Hazon & Kaminka), generalised to what a swarm needs after a
//! failure: covered gaps, release times, turn-round cost, mixed speeds, endurance.
//!
//! Hazon and Kaminka, "Redundancy, efficiency and robustness in multi-robot coverage",
//! 2005, <https://doi.org/10.1109/ROBOT.2005.1570205>, and "On redundancy, efficiency, and
//! robustness in coverage for multiple robots", 2008,
//! <https://doi.org/10.1016/j.robot.2008.01.006>.
//!
//! Left to `endurance_limited`: which cells are served when not all can be.

use super::coverage_loop::Direction;
use super::endurance_limited::Shares;
use serde::{Deserialize, Serialize};
use skein_geometry::frame::Pose;

/// One cell of the ring to be divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RingCell {
    /// Length flown when the cell is served, millimetres.
    pub service_mm: u32,
    /// Length flown when the cell is only passed, millimetres.
    pub travel_mm: u32,
    /// Whether it still needs service by somebody.
    pub open: bool,
}

/// One UAV that takes part in the division.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Uav {
    /// The boundary where it begins (boundary `b` lies before cell `b`).
    pub anchor: u16,
    /// Who; breaks ties between equal anchors.
    pub id: u16,
    /// Which way it looks at its anchor.
    pub heading: Direction,
    /// When it will be at its anchor, milliseconds from now.
    pub release_ms: u32,
    /// Ground speed, mm/s; above zero.
    pub speed_mmps: u32,
    /// Time to turn round on the loop, milliseconds.
    pub turn_ms: u32,
    /// Flight time it may still spend after its release, milliseconds.
    pub endurance_ms: u32,
    /// Where it is now, if nothing keeps it from leaving for anywhere; otherwise it begins
    /// at its anchor.
    pub off_loop: Option<OffLoop>,
}

/// Where a UAV is that has nothing to fly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct OffLoop {
    /// East, mm.
    pub east_mm: i32,
    /// North, mm.
    pub north_mm: i32,
    /// Course over the ground, 1e-4 rad.
    pub course_e4: i32,
    /// When it can leave, milliseconds from now.
    pub ready_ms: u32,
}

impl OffLoop {
    /// The nearest to a pose; beyond what fits it saturates.
    #[must_use]
    pub fn of(pose: Pose, ready_ms: u32) -> Self {
        #[allow(
            clippy::cast_possible_truncation,
            reason = "a cast of a float saturates"
        )]
        let whole = |v: f64| v.round() as i32;
        Self {
            east_mm: whole(pose.east_m * 1000.0),
            north_mm: whole(pose.north_m * 1000.0),
            course_e4: whole(pose.heading_rad * 1e4),
            ready_ms,
        }
    }

    /// The pose.
    #[must_use]
    pub fn pose(self) -> Pose {
        Pose {
            east_m: f64::from(self.east_mm) / 1000.0,
            north_m: f64::from(self.north_mm) / 1000.0,
            heading_rad: f64::from(self.course_e4) / 1e4,
        }
    }
}

/// A run of cells flown in one direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Leg {
    /// The first cell flown.
    pub first: u16,
    /// How many cells, in the direction of flight.
    pub count: u16,
    /// Which way.
    pub direction: Direction,
}

impl Leg {
    /// The cells of the leg on a ring of `n`, in order of flight.
    pub fn cells(self, n: usize) -> impl Iterator<Item = u16> {
        let n = n as i64;
        (0..i64::from(self.count)).map(move |k| {
            let step = match self.direction {
                Direction::Forward => k,
                Direction::Backward => -k,
            };
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "0 <= x < n <= 65,535"
            )]
            let c = (i64::from(self.first) + step).rem_euclid(n) as u16;
            c
        })
    }
}

/// What one UAV is to do, in backtracking MSTC at most two legs, the second after turning
/// round. Legs begin and end at an open cell; the way between is travel.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Section {
    /// Who.
    pub id: u16,
    /// The legs in order of flight; cells in them that are not open are only passed.
    pub legs: Vec<Leg>,
    /// When the last open cell is done, milliseconds from now.
    pub finish_ms: u32,
}

/// A division of the ring.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Division {
    /// One section a UAV, in ascending order of id.
    pub sections: Vec<Section>,
    /// When the last section is done, milliseconds from now.
    pub makespan_ms: u32,
    /// Open cells that nobody has the endurance to serve, ascending.
    pub unassigned: Vec<u16>,
}

/// Divides the open cells of `ring` among `uavs` in the least time.
///
/// Each UAV serves a stretch of the ring around its anchor, up to the stretches
/// of its neighbours; it turns round at most once.
///
/// # Guarantees
/// The makespan is the least possible for that shape of plan, in integer
/// milliseconds. With too little endurance, the plan that serves the most cells.
/// Each open cell is in exactly one section or in `unassigned`. A UAV with nothing
/// to do has no legs and finishes at 0. An anchor beyond the ring is taken modulo its
/// length; cells beyond the 65,535th are ignored.
///
/// # Complexity
/// O(k log N) for each tried makespan, times log of the makespan; measured sweeps
/// round the ring are few. With too little endurance O(N g) for each, g the smallest
/// gap between two anchors.
#[must_use]
pub fn divide(ring: &[RingCell], uavs: &[Uav]) -> Division {
    // Boundaries are numbered by `u16`, and a ring is cyclic.
    let ring = &ring[..ring.len().min(usize::from(u16::MAX))];
    let n = u16::try_from(ring.len()).unwrap_or(u16::MAX);
    let mut order: Vec<Uav> = uavs.to_vec();
    for r in &mut order {
        r.anchor %= n.max(1);
    }
    order.sort_unstable_by_key(|r| (r.anchor, r.id));
    let solver = Solver::new(ring, &order);
    let (extents, unassigned) = solver.solve();
    let mut sections: Vec<Section> = order
        .iter()
        .enumerate()
        .map(|(i, r)| {
            let (legs, finish_ms) = solver.legs(i, extents[i].0, extents[i].1);
            Section {
                id: r.id,
                legs,
                finish_ms,
            }
        })
        .collect();
    let makespan_ms = sections
        .iter()
        .filter(|s| !s.legs.is_empty())
        .map(|s| s.finish_ms)
        .max()
        .unwrap_or(0);
    sections.sort_by_key(|s| s.id);
    Division {
        sections,
        makespan_ms,
        unassigned,
    }
}

/// The ring unrolled three times, with prefix sums of what is flown.
pub(super) struct Solver<'a> {
    pub ring: &'a [RingCell],
    pub uavs: &'a [Uav],
    serve_mm: Vec<u64>,
    travel_mm: Vec<u64>,
    /// Cells from a place back to the last open one before it, by place.
    last_open: Vec<usize>,
    next_open: Vec<usize>,
}

impl<'a> Solver<'a> {
    fn new(ring: &'a [RingCell], uavs: &'a [Uav]) -> Self {
        let n = ring.len();
        let (mut serve_mm, mut travel_mm) = (vec![0], vec![0]);
        let (mut last_open, mut next_open) = (vec![0], vec![3 * n; 3 * n + 1]);
        for i in 0..3 * n {
            let c = ring[i % n];
            let serve = if c.open { c.service_mm } else { c.travel_mm };
            serve_mm.push(serve_mm[i] + u64::from(serve));
            travel_mm.push(travel_mm[i] + u64::from(c.travel_mm));
            last_open.push(if c.open { i + 1 } else { last_open[i] });
        }
        for i in (0..3 * n).rev() {
            next_open[i] = if ring[i % n].open {
                i
            } else {
                next_open[i + 1]
            };
        }
        Self {
            ring,
            uavs,
            serve_mm,
            travel_mm,
            last_open,
            next_open,
        }
    }

    /// Cells between this UAV's anchor and the next one's.
    pub fn gap(&self, i: usize) -> usize {
        let n = self.ring.len();
        let k = self.uavs.len();
        let (a, b) = (
            usize::from(self.uavs[i].anchor),
            usize::from(self.uavs[(i + 1) % k].anchor),
        );
        if i + 1 == k { n - (a - b) } else { b - a }
    }

    /// How far a share of `extent` cells really reaches, and what that costs:
    /// (cells, mm served going out, mm travelled coming back).
    fn reach(&self, i: usize, extent: usize, right: bool) -> (usize, u64, u64) {
        let at = self.ring.len() + usize::from(self.uavs[i].anchor);
        let (from, to) = if right {
            (at, self.last_open[at + extent].max(at))
        } else {
            (self.next_open[at - extent].min(at), at)
        };
        (
            to - from,
            self.serve_mm[to] - self.serve_mm[from],
            self.travel_mm[to] - self.travel_mm[from],
        )
    }

    /// The least time after its release in which UAV `i` serves both shares, and
    /// whether it goes right first.
    fn time_ms(&self, i: usize, left: usize, right: usize) -> (u64, bool) {
        let r = &self.uavs[i];
        let ms = |mm: u64| (mm * 1000).div_ceil(u64::from(r.speed_mmps.max(1)));
        let (l, l_out, l_back) = self.reach(i, left, false);
        let (g, r_out, r_back) = self.reach(i, right, true);
        let turn = u64::from(r.turn_ms);
        let away = |forward: bool| {
            if (r.heading == Direction::Forward) == forward {
                0
            } else {
                turn
            }
        };
        let right_first = match (l, g) {
            (0, 0) => 0,
            (0, _) => away(true) + ms(r_out),
            (_, 0) => u64::MAX,
            _ => away(true) + ms(r_out) + turn + ms(r_back) + ms(l_out),
        };
        let left_first = match (l, g) {
            (0, _) => u64::MAX,
            (_, 0) => away(false) + ms(l_out),
            _ => away(false) + ms(l_out) + turn + ms(l_back) + ms(r_out),
        };
        if right_first <= left_first {
            (right_first, true)
        } else {
            (left_first, false)
        }
    }

    pub fn fits(&self, i: usize, left: usize, right: usize, limit_ms: u64) -> bool {
        let r = &self.uavs[i];
        let t = self.time_ms(i, left, right).0;
        t == 0 || (t <= u64::from(r.endurance_ms) && t + u64::from(r.release_ms) <= limit_ms)
    }

    pub fn most(&self, cap: usize, fits: impl Fn(usize) -> bool) -> usize {
        let (mut good, mut bad) = (0, cap + 1);
        while bad - good > 1 {
            let middle = good.midpoint(bad);
            if fits(middle) {
                good = middle
            } else {
                bad = middle
            }
        }
        good
    }

    /// The least left shares with which everything is served in time, if any.
    fn feasible(&self, limit_ms: u64) -> Option<Vec<(usize, usize)>> {
        let k = self.uavs.len();
        let mut first_left = 0;
        loop {
            let mut left = first_left;
            let mut extents = Vec::with_capacity(k);
            for i in 0..k {
                if !self.fits(i, left, 0, limit_ms) {
                    return None;
                }
                let gap = self.gap(i);
                let cap = if k == 1 { gap - left } else { gap };
                let right = self.most(cap, |x| self.fits(i, left, x, limit_ms));
                extents.push((left, right));
                left = gap - right;
            }
            if k == 1 {
                left = self.ring.len() - extents[0].1;
            }
            if left <= first_left {
                if k > 1 {
                    extents[0].0 = left;
                }
                return Some(extents);
            }
            first_left = left;
            if first_left > self.gap(k - 1) {
                return None;
            }
        }
    }

    fn solve(&self) -> (Vec<(usize, usize)>, Vec<u16>) {
        let open: Vec<u16> = (0u16..)
            .zip(self.ring)
            .filter(|(_, c)| c.open)
            .map(|(i, _)| i)
            .collect();
        if self.uavs.is_empty() {
            return (Vec::new(), open);
        }
        if open.is_empty() {
            return (vec![(0, 0); self.uavs.len()], Vec::new());
        }
        const FOREVER_MS: u64 = 1 << 40;
        if self.feasible(FOREVER_MS).is_none() {
            return self.most_cells(&open);
        }
        let (mut bad, mut good) = (0, 1u64 << 40);
        while good - bad > 1 {
            let middle = good.midpoint(bad);
            if self.feasible(middle).is_some() {
                good = middle
            } else {
                bad = middle
            }
        }
        (self.feasible(good).unwrap_or_default(), Vec::new())
    }

    /// Too little endurance: the extents that serve the most cells, in the least time
    /// in which so many can be served, and the cells that nobody serves.
    fn most_cells(&self, open: &[u16]) -> (Vec<(usize, usize)>, Vec<u16>) {
        let longest = |r: &Uav| u64::from(r.release_ms) + u64::from(r.endurance_ms);
        let (mut bad, mut good) = (0, self.uavs.iter().map(longest).max().unwrap_or(0));
        let most = Shares::new(self, good).best().0;
        while good - bad > 1 {
            let middle = good.midpoint(bad);
            if Shares::new(self, middle).best().0 == most {
                good = middle;
            } else {
                bad = middle;
            }
        }
        let extents = Shares::new(self, good).best().1;
        let n = self.ring.len();
        let mut served = vec![false; n];
        for (uav, (left, right)) in self.uavs.iter().zip(&extents) {
            let at = n + usize::from(uav.anchor);
            for c in at - left..at + right {
                served[c % n] = true;
            }
        }
        let rest = open
            .iter()
            .copied()
            .filter(|c| !served[usize::from(*c)])
            .collect();
        (extents, rest)
    }

    fn legs(&self, i: usize, left: usize, right: usize) -> (Vec<Leg>, u32) {
        let n = self.ring.len();
        let r = &self.uavs[i];
        let at = n + usize::from(r.anchor);
        let (l, g) = (self.reach(i, left, false).0, self.reach(i, right, true).0);
        let (t, right_first) = self.time_ms(i, left, right);
        let cell = |x: usize| u16::try_from(x % n.max(1)).unwrap_or(0);
        let count = |x: usize| u16::try_from(x).unwrap_or(u16::MAX);
        let mut legs = Vec::new();
        if g > 0 {
            let first = self.next_open[at];
            legs.push(Leg {
                first: cell(first),
                count: count(at + g - first),
                direction: Direction::Forward,
            });
        }
        if l > 0 {
            let last = self.last_open[at];
            let leg = Leg {
                first: cell(last - 1),
                count: count(last - (at - l)),
                direction: Direction::Backward,
            };
            if right_first {
                legs.push(leg)
            } else {
                legs.insert(0, leg)
            }
        }
        let finish = if legs.is_empty() {
            0
        } else {
            u64::from(r.release_ms) + t
        };
        (legs, u32::try_from(finish).unwrap_or(u32::MAX))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn ring(n: usize) -> Vec<RingCell> {
        vec![
            RingCell {
                service_mm: 1000,
                travel_mm: 1000,
                open: true
            };
            n
        ]
    }

    fn uav(id: u16, anchor: u16) -> Uav {
        Uav {
            anchor,
            id,
            heading: Direction::Forward,
            release_ms: 0,
            speed_mmps: 1000,
            turn_ms: 0,
            endurance_ms: 1_000_000,
            off_loop: None,
        }
    }

    #[test]
    fn contiguous_starts_take_half_the_rest() {
        for k in 1..5u16 {
            let uavs: Vec<Uav> = (0..k).map(|i| uav(i, i)).collect();
            let d = divide(&ring(40), &uavs);
            let mut seen = [0; 40];
            for s in &d.sections {
                for l in &s.legs {
                    for c in l.cells(40) {
                        seen[usize::from(c)] += 1;
                    }
                }
            }
            assert!(seen.iter().all(|x| *x == 1), "{k}: {d:?}");
            assert!(d.unassigned.is_empty());
        }
    }

    /// The least makespan over all splits of all gaps, by trying each, or `None` when
    /// no split is within the endurance.
    fn brute(ring: &[RingCell], uavs: &[Uav]) -> Option<u64> {
        let mut order = uavs.to_vec();
        order.sort_unstable_by_key(|r| (r.anchor, r.id));
        let k = order.len();
        let n = ring.len();
        let gap = |i: usize| {
            let (a, b) = (order[i].anchor as usize, order[(i + 1) % k].anchor as usize);
            if i + 1 == k { n - (a - b) } else { b - a }
        };
        let mut rights = vec![0usize; k];
        let mut best: Option<u64> = None;
        loop {
            let mut worst = Some(0u64);
            for i in 0..k {
                let before = (i + k - 1) % k;
                let left = gap(before) - rights[before];
                let t = flown(ring, &order[i], left, rights[i]);
                worst = worst.zip(t).map(|(w, t)| w.max(t));
            }
            best = match (best, worst) {
                (Some(b), Some(w)) => Some(b.min(w)),
                (b, w) => b.or(w),
            };
            let Some(i) = (0..k).find(|i| rights[*i] < gap(*i)) else {
                return best;
            };
            rights[i] += 1;
            rights[..i].fill(0);
        }
    }

    /// When a UAV is done with `left` cells behind and `right` cells ahead of its
    /// anchor, flying cell by cell; `None` beyond its endurance.
    fn flown(ring: &[RingCell], r: &Uav, left: usize, right: usize) -> Option<u64> {
        let n = ring.len();
        let cell = |i: i64| ring[(i64::from(r.anchor) + i).rem_euclid(n as i64) as usize];
        let ahead: Vec<RingCell> = (0..right as i64).map(cell).collect();
        let behind: Vec<RingCell> = (1..=left as i64).map(|i| cell(-i)).collect();
        let need = |side: &[RingCell]| side.iter().rposition(|c| c.open).map_or(0, |p| p + 1);
        let (a, b) = (need(&ahead), need(&behind));
        let out = |side: &[RingCell], m: usize| -> u64 {
            side[..m]
                .iter()
                .map(|c| u64::from(if c.open { c.service_mm } else { c.travel_mm }))
                .sum()
        };
        let back = |side: &[RingCell], m: usize| -> u64 {
            side[..m].iter().map(|c| u64::from(c.travel_mm)).sum()
        };
        let ms = |mm: u64| (mm * 1000).div_ceil(u64::from(r.speed_mmps));
        let turn = u64::from(r.turn_ms);
        let forward = r.heading == Direction::Forward;
        let t = match (a, b) {
            (0, 0) => return Some(0),
            (a, 0) => ms(out(&ahead, a)) + if forward { 0 } else { turn },
            (0, b) => ms(out(&behind, b)) + if forward { turn } else { 0 },
            (a, b) => {
                let first_ahead =
                    ms(out(&ahead, a)) + turn + ms(back(&ahead, a)) + ms(out(&behind, b));
                let first_behind =
                    ms(out(&behind, b)) + turn + ms(back(&behind, b)) + ms(out(&ahead, a));
                (first_ahead + if forward { 0 } else { turn })
                    .min(first_behind + if forward { turn } else { 0 })
            }
        };
        (t <= u64::from(r.endurance_ms)).then_some(t + u64::from(r.release_ms))
    }

    fn cells() -> impl Strategy<Value = Vec<RingCell>> {
        let cell = (1u32..5, 0u32..5, any::<bool>()).prop_map(|(s, t, open)| RingCell {
            service_mm: s * 1000,
            travel_mm: (t * 1000).min(s * 1000),
            open,
        });
        prop::collection::vec(cell, 1..9)
    }

    fn uavs(n: u16, endurance_s: core::ops::Range<u32>) -> impl Strategy<Value = Vec<Uav>> {
        let uav = (0..n, any::<bool>(), 0u32..6, 1u32..4, 0u32..4, endurance_s).prop_map(
            |(anchor, forward, release, speed, turn, endurance)| Uav {
                anchor,
                id: 0,
                heading: if forward {
                    Direction::Forward
                } else {
                    Direction::Backward
                },
                release_ms: release * 1000,
                speed_mmps: speed * 1000,
                turn_ms: turn * 1000,
                endurance_ms: endurance * 1000,
                off_loop: None,
            },
        );
        prop::collection::vec(uav, 1..4).prop_map(|mut uavs| {
            for (id, r) in (0u16..).zip(&mut uavs) {
                r.id = id;
            }
            uavs
        })
    }

    /// Every open cell is in exactly one section or unassigned, and no section is
    /// beyond its UAV's endurance.
    fn assert_sound(ring: &[RingCell], uavs: &[Uav], d: &Division) {
        let mut owners = vec![0; ring.len()];
        for s in &d.sections {
            let mut mine = vec![false; ring.len()];
            for leg in &s.legs {
                for c in leg.cells(ring.len()) {
                    mine[usize::from(c)] |= ring[usize::from(c)].open;
                }
            }
            for (o, m) in owners.iter_mut().zip(mine) {
                *o += u32::from(m);
            }
            let r = uavs.iter().find(|r| r.id == s.id).unwrap();
            let spent = s.finish_ms.saturating_sub(r.release_ms);
            assert!(
                s.legs.is_empty() || spent <= r.endurance_ms,
                "{s:?} of {r:?}"
            );
        }
        for c in &d.unassigned {
            owners[usize::from(*c)] += 1;
        }
        for (o, c) in owners.iter().zip(ring) {
            assert_eq!(*o, u32::from(c.open), "{d:?}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn no_split_is_faster((ring, uavs) in cells().prop_flat_map(|r| {
            let n = u16::try_from(r.len()).unwrap();
            (Just(r), uavs(n, 900..1000))
        })) {
            let d = divide(&ring, &uavs);
            assert_sound(&ring, &uavs, &d);
            prop_assert!(d.unassigned.is_empty());
            prop_assert_eq!(Some(u64::from(d.makespan_ms)), brute(&ring, &uavs), "{:?}", d);
        }

        #[test]
        fn short_endurance_is_kept_and_a_feasible_split_is_found((ring, uavs) in cells().prop_flat_map(|r| {
            let n = u16::try_from(r.len()).unwrap();
            (Just(r), uavs(n, 1..25))
        })) {
            let d = divide(&ring, &uavs);
            assert_sound(&ring, &uavs, &d);
            if let Some(best) = brute(&ring, &uavs) {
                prop_assert!(d.unassigned.is_empty(), "{:?}", d);
                prop_assert_eq!(u64::from(d.makespan_ms), best, "{:?}", d);
            }
        }

        #[test]
        fn with_too_little_endurance_no_plan_serves_more_or_as_many_sooner(
            (ring, uavs) in cells().prop_flat_map(|r| {
                let n = u16::try_from(r.len()).unwrap();
                (Just(r), uavs(n, 0..14))
            })
        ) {
            let d = divide(&ring, &uavs);
            assert_sound(&ring, &uavs, &d);
            let open = ring.iter().filter(|c| c.open).count();
            let (most, least_ms) = brute_most(&ring, &uavs);
            prop_assert_eq!(open - d.unassigned.len(), most, "{:?}", d);
            prop_assert_eq!(u64::from(d.makespan_ms), least_ms, "{:?}", d);
        }
    }

    /// The most cells that any shares serve, and the least makespan of those, by trying
    /// every left and right share of every UAV.
    fn brute_most(ring: &[RingCell], uavs: &[Uav]) -> (usize, u64) {
        let mut order = uavs.to_vec();
        order.sort_unstable_by_key(|r| (r.anchor, r.id));
        let (k, n) = (order.len(), ring.len());
        let gap = |i: usize| {
            let (a, b) = (order[i].anchor as usize, order[(i + 1) % k].anchor as usize);
            if i + 1 == k { n - (a - b) } else { b - a }
        };
        let open = |r: &Uav, left: usize, right: usize| {
            let at = n + usize::from(r.anchor);
            (at - left..at + right).filter(|c| ring[c % n].open).count()
        };
        // One choice a gap: how much of it the UAVs on both sides take.
        let choices: Vec<Vec<(usize, usize)>> = (0..k)
            .map(|i| {
                let all = (0..=gap(i)).flat_map(|x| (0..=gap(i) - x).map(move |y| (x, y)));
                all.collect()
            })
            .collect();
        let mut at = vec![0usize; k];
        let mut best = (0, 0);
        loop {
            let shares = |i: usize| {
                (
                    choices[(i + k - 1) % k][at[(i + k - 1) % k]].1,
                    choices[i][at[i]].0,
                )
            };
            let mut total = Some((0, 0u64));
            for (i, r) in order.iter().enumerate() {
                let (left, right) = shares(i);
                let t = flown(ring, r, left, right);
                total = total
                    .zip(t)
                    .map(|((c, w), t)| (c + open(r, left, right), w.max(t)));
            }
            if let Some((c, w)) = total
                && (c > best.0 || c == best.0 && w < best.1)
            {
                best = (c, w);
            }
            let Some(i) = (0..k).find(|i| at[*i] + 1 < choices[*i].len()) else {
                return best;
            };
            at[i] += 1;
            at[..i].fill(0);
        }
    }

    #[test]
    fn senseless_input_divides_into_something_without_a_panic() {
        let far = Uav {
            anchor: 60_000,
            speed_mmps: 0,
            ..uav(1, 0)
        };
        let late = Uav {
            id: 2,
            release_ms: u32::MAX,
            ..far
        };
        assert_eq!(divide(&[], &[far]).makespan_ms, 0);
        assert_eq!(divide(&ring(3), &[]).unassigned, vec![0, 1, 2]);
        assert_sound(&ring(7), &[far, late], &divide(&ring(7), &[far, late]));
        let d = divide(&ring(7), &[uav(0, 7 * 9 + 3), uav(1, 5)]);
        assert!(d.unassigned.is_empty());
    }
}
