//! The exact division of a ring of cells among UAVs that stand on it: backtracking MSTC
//! (D2.7 §3.6.5, algorithm 7, after Hazon & Kaminka) in its plain form of counted cells,
//! with mixed speeds and endurance, at the scale of thousands of UAVs.
//!
//! Left to [`skein_flight::coverage::ring::backtracking`], which the swarm flies: cells of
//! unlike length, turns, cells already seen.

/// A UAV that stands on the ring.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Uav {
    /// The place of its cell on the ring.
    pub place: u32,
    /// Cells it flies in a unit of time; zero counts as one.
    pub speed: u32,
    /// Moves it can make.
    pub endurance: u32,
}

/// What each UAV covers besides its own cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Share {
    /// Cells against the order of the ring.
    pub before: u32,
    /// Cells in the order of the ring.
    pub after: u32,
}

impl Share {
    /// Moves to cover both sides, the shorter one first and back again.
    #[must_use]
    pub fn moves(self) -> u32 {
        self.before + self.after + self.before.min(self.after)
    }
}

/// A division.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RingDivision {
    /// The shares, in the order of the UAVs given.
    pub shares: Vec<Share>,
    /// When all is covered: `moves / speed` of the slowest share, as that fraction.
    pub finish: (u32, u32),
}

/// Divides a ring of `n` cells in the least time.
///
/// # Guarantees
/// Each cell is in exactly one share (or is a UAV's own), no share is beyond its
/// UAV's endurance, and no such division finishes sooner. `None` when there is no
/// such division, or no UAV.
///
/// # Complexity
/// O(k log k) to sort, then O(k) a sweep, O(log n) tried times for each distinct speed,
/// each of usually one sweep and at most n / k.
#[must_use]
pub fn divide(n: u32, uavs: &[Uav]) -> Option<RingDivision> {
    let mut order: Vec<usize> = (0..uavs.len()).collect();
    order.sort_by_key(|i| (uavs[*i].place % n.max(1), *i));
    if order.is_empty() || n == 0 {
        return None;
    }
    let gap = |i: usize| {
        let here = uavs[order[i]].place % n;
        let next = uavs[order[(i + 1) % order.len()]].place % n;
        let last = i + 1 == order.len();
        // The last gap goes once round; UAVs on one cell have nothing between.
        (next + if last { n } else { 0 }).saturating_sub(here + 1)
    };
    let gaps: Vec<u32> = (0..order.len()).map(gap).collect();
    // The ring is closed at the smallest gap: its share is the least to be guessed.
    let smallest = (0..gaps.len()).min_by_key(|i| gaps[*i]).unwrap_or(0);
    let turn = (smallest + 1) % order.len();
    order.rotate_left(turn);
    let ring = Ring {
        gaps: (0..gaps.len())
            .map(|i| gaps[(i + turn) % gaps.len()])
            .collect(),
        uavs: order.iter().map(|i| uavs[*i]).collect(),
    };
    let (finish, befores) = ring.least()?;
    let mut shares = vec![Share::default(); uavs.len()];
    for (i, uav) in order.iter().enumerate() {
        let next = befores[(i + 1) % befores.len()];
        shares[*uav] = Share {
            before: befores[i],
            after: ring.gaps[i] - next,
        };
    }
    Some(RingDivision { shares, finish })
}

struct Ring {
    /// Cells between each UAV and the next.
    gaps: Vec<u32>,
    uavs: Vec<Uav>,
}

impl Ring {
    /// The least time, as moves of a UAV over its speed, and what each covers against
    /// the order.
    fn least(&self) -> Option<((u32, u32), Vec<u32>)> {
        let mut speeds: Vec<u32> = self.uavs.iter().map(|r| r.speed.max(1)).collect();
        speeds.sort_unstable();
        speeds.dedup();
        // Nobody flies further than once round and back.
        let most = self.gaps.iter().map(|g| u64::from(*g)).sum::<u64>() * 2;
        let most = u32::try_from(most).unwrap_or(u32::MAX);
        let mut best: Option<((u32, u32), Vec<u32>)> = None;
        for speed in speeds {
            let mut good = match &best {
                // Only a time below the best so far is of interest.
                Some(((m, v), _)) => {
                    let below = (u64::from(*m) * u64::from(speed)).div_ceil(u64::from(*v));
                    u32::try_from(below).unwrap_or(u32::MAX).saturating_sub(1)
                }
                None => most,
            };
            let Some(mut befores) = self.feasible(good, speed) else {
                continue;
            };
            let mut low = 0;
            while low < good {
                let middle = low.midpoint(good);
                match self.feasible(middle, speed) {
                    Some(found) => (good, befores) = (middle, found),
                    None => low = middle + 1,
                }
            }
            best = Some(((good, speed), befores));
        }
        best
    }

    /// The least shares against the order with which all is covered in `moves / speed`.
    fn feasible(&self, moves: u32, speed: u32) -> Option<Vec<u32>> {
        let limits: Vec<u32> = self
            .uavs
            .iter()
            .map(|r| {
                let reach = u64::from(moves) * u64::from(r.speed.max(1)) / u64::from(speed);
                u32::try_from(reach).unwrap_or(u32::MAX).min(r.endurance)
            })
            .collect();
        let k = self.gaps.len();
        let mut befores = vec![0u32; k];
        loop {
            let mut before = befores[0];
            for i in 0..k {
                befores[i] = before;
                let limit = limits[i];
                if before > limit {
                    return None;
                }
                let after = if before <= limit / 3 {
                    limit - 2 * before
                } else {
                    (limit - before) / 2
                };
                before = self.gaps[i].saturating_sub(after);
            }
            // The first UAV's share only ever has to grow: the least fixpoint.
            if before <= befores[0] {
                return Some(befores);
            }
            if before > self.gaps[k - 1] {
                return None;
            }
            befores[0] = before;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The least time over all splits of all gaps, or `None`.
    fn brute(n: u32, uavs: &[Uav]) -> Option<f64> {
        let mut order = uavs.to_vec();
        order.sort_by_key(|r| r.place);
        let k = order.len();
        let gap = |i: usize| {
            let next = order[(i + 1) % k].place + if i + 1 == k { n } else { 0 };
            next.saturating_sub(order[i].place + 1)
        };
        let mut after = vec![0; k];
        let mut best: Option<f64> = None;
        loop {
            let mut worst = Some(0.0f64);
            for i in 0..k {
                let before = gap((i + k - 1) % k) - after[(i + k - 1) % k];
                let moves = Share {
                    before,
                    after: after[i],
                }
                .moves();
                let fits = moves <= order[i].endurance;
                let time = f64::from(moves) / f64::from(order[i].speed);
                worst = worst.filter(|_| fits).map(|w| w.max(time));
            }
            best = match (best, worst) {
                (Some(b), Some(w)) => Some(b.min(w)),
                (b, w) => b.or(w),
            };
            let Some(i) = (0..k).find(|i| after[*i] < gap(*i)) else {
                return best;
            };
            after[i] += 1;
            after[..i].fill(0);
        }
    }

    fn assert_covers(n: u32, uavs: &[Uav], d: &RingDivision) {
        let mut owners = vec![0; n as usize];
        for (r, s) in uavs.iter().zip(&d.shares) {
            assert!(s.moves() <= r.endurance);
            assert!(
                u64::from(s.moves()) * u64::from(d.finish.1)
                    <= u64::from(d.finish.0) * u64::from(r.speed)
            );
            for i in 1..=s.after {
                owners[((r.place + i) % n) as usize] += 1;
            }
            for i in 1..=s.before {
                owners[((r.place + n - i) % n) as usize] += 1;
            }
        }
        for r in uavs {
            owners[r.place as usize] = 1;
        }
        assert!(owners.iter().all(|o| *o == 1), "{d:?}");
    }

    fn uavs(n: u32) -> impl Strategy<Value = Vec<Uav>> {
        let uav = (0..n, 1u32..5, prop_oneof![Just(u32::MAX), 0u32..30]).prop_map(
            |(place, speed, endurance)| Uav {
                place,
                speed,
                endurance,
            },
        );
        prop::collection::vec(uav, 1..5)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(3000))]

        #[test]
        fn no_split_is_faster((n, uavs) in (1u32..15).prop_flat_map(|n| (Just(n), uavs(n)))) {
            let d = divide(n, &uavs);
            let best = brute(n, &uavs);
            prop_assert_eq!(d.is_some(), best.is_some());
            if let (Some(d), Some(best)) = (d, best) {
                assert_covers(n, &uavs, &d);
                let finish = f64::from(d.finish.0) / f64::from(d.finish.1);
                prop_assert!((finish - best).abs() < 1e-9, "{} {} {:?}", finish, best, d);
            }
        }

        #[test]
        fn more_speed_never_hurts((n, uavs, who) in (1u32..60).prop_flat_map(|n| {
            (Just(n), uavs(n), any::<prop::sample::Index>())
        })) {
            let Some(slow) = divide(n, &uavs) else { return Ok(()) };
            let mut faster = uavs;
            let i = who.index(faster.len());
            faster[i].speed += 1;
            faster[i].endurance = faster[i].endurance.saturating_add(3);
            let fast = divide(n, &faster).unwrap();
            prop_assert!(
                u64::from(fast.finish.0) * u64::from(slow.finish.1)
                    <= u64::from(slow.finish.0) * u64::from(fast.finish.1)
            );
        }
    }

    #[test]
    fn neighbours_on_the_ring_take_half_the_rest() {
        for k in 1..20u32 {
            let uavs: Vec<Uav> = (0..k)
                .map(|place| Uav {
                    place,
                    speed: 1,
                    endurance: u32::MAX,
                })
                .collect();
            let d = divide(1000, &uavs).unwrap();
            let expect = if k == 1 { 999 } else { (1000 - k).div_ceil(2) };
            assert_eq!(d.finish, (expect, 1), "{k}");
        }
    }
}
