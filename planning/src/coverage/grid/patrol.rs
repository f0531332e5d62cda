//! Continuous patrol of a closed loop (D2.7 §3.6.6): equal UAVs spaced evenly; unequal
//! ones either each to and fro on an arc in proportion to its speed, or the fastest few
//! round the loop at the speed of the slowest of them, whichever revisits sooner.
//!
//! The loop may be any closed tour: of cells, points, roads or swaths; lengths are in any
//! unit, speeds in that unit per unit of time.
//!
//! Left to others: the loop, and who is alive.

use super::mstc::{closed_walk, places};
use super::plan::{Plan, Task};
use super::spanning::Tree;

/// How the loop is patrolled.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Pattern {
    /// These UAVs fly round, evenly spaced, all at one speed; the others rest.
    Round {
        /// Who flies, in the order of their numbers.
        uavs: Vec<usize>,
        /// The common speed.
        speed: u32,
    },
    /// Each UAV flies to and fro on an arc of its own.
    Arcs {
        /// By UAV: where its arc begins on the loop, and its length.
        arcs: Vec<(u32, u32)>,
    },
}

/// A patrol.
#[derive(Clone, Debug, PartialEq)]
pub struct Patrol {
    /// Who flies where.
    pub pattern: Pattern,
    /// The longest time between two visits of a place.
    pub revisit: f64,
}

/// The pattern that revisits soonest on a loop of length `n`; `None` without a UAV that
/// moves. On a tie all fly round.
///
/// # Guarantees
/// With equal speeds the revisit time is the least possible, n / (k v). With mixed ones
/// it is the smaller of n / max_r (r v_r), v_r the r-th fastest, and 2 n / sum of v (and
/// what rounding arcs to whole units adds), so at most twice the least possible.
///
/// # Complexity
/// O(k log k).
#[must_use]
pub fn patrol(n: u32, speeds: &[u32]) -> Option<Patrol> {
    let mut fastest: Vec<usize> = (0..speeds.len()).filter(|i| speeds[*i] > 0).collect();
    fastest.sort_by_key(|i| (core::cmp::Reverse(speeds[*i]), *i));
    let rate = |r: usize| (r as u64 + 1) * u64::from(speeds[fastest[r]]);
    let r = (0..fastest.len()).max_by_key(|r| (rate(*r), *r))?;
    let round = f64::from(n) / rate(r) as f64;
    let arcs = proportional(n, speeds);
    let slowest = |(arc, v): (&(u32, u32), &u32)| match arc.1 {
        0 => 0.0,
        len => 2.0 * f64::from(len) / f64::from(*v),
    };
    let to_and_fro = arcs.iter().zip(speeds).map(slowest).fold(0.0, f64::max);
    if round <= to_and_fro {
        let mut uavs = fastest[..=r].to_vec();
        let speed = speeds[fastest[r]];
        uavs.sort_unstable();
        return Some(Patrol {
            pattern: Pattern::Round { uavs, speed },
            revisit: round,
        });
    }
    Some(Patrol {
        pattern: Pattern::Arcs { arcs },
        revisit: to_and_fro,
    })
}

/// No patrol revisits all of a loop of length `n` sooner.
#[must_use]
pub fn revisit_bound(n: u32, speeds: &[u32]) -> f64 {
    let sum: u64 = speeds.iter().map(|v| u64::from(*v)).sum();
    f64::from(n) / sum.max(1) as f64
}

/// Arcs of whole units in proportion to the speeds, one after the other.
fn proportional(n: u32, speeds: &[u32]) -> Vec<(u32, u32)> {
    let sum: u64 = speeds.iter().map(|v| u64::from(*v)).sum::<u64>().max(1);
    let mut before = 0u64;
    let mut arcs = Vec::with_capacity(speeds.len());
    for v in speeds {
        let place = |flown: u64| u32::try_from(u64::from(n) * flown / sum).unwrap_or(n);
        let (from, to) = (place(before), place(before + u64::from(*v)));
        arcs.push((from, to - from));
        before += u64::from(*v);
    }
    arcs
}

/// How much each of the UAVs that fly round a loop of length `n` has to fall behind so
/// that all are evenly spaced, after one has failed or another has joined: by loitering,
/// since nobody flies faster than the common speed.
///
/// # Guarantees
/// At least one falls behind by nothing, none by `n` or more, the cyclic order stays, and
/// no other set of delays has a shorter longest one for that order. Spacing is even to
/// one unit.
///
/// # Complexity
/// O(k log k).
#[must_use]
pub fn respace(n: u32, places: &[u32]) -> Vec<u32> {
    let k = places.len() as i64;
    if k == 0 || n == 0 {
        return vec![0; places.len()];
    }
    let mut order: Vec<usize> = (0..places.len()).collect();
    order.sort_by_key(|i| (places[*i] % n, *i));
    // How far each is ahead of an evenly spaced slot, up to one common shift.
    let ahead: Vec<i64> = (0i64..)
        .zip(&order)
        .map(|(i, uav)| i64::from(places[*uav] % n) - i * i64::from(n) / k)
        .collect();
    let least = ahead.iter().copied().min().unwrap_or(0);
    let mut delays = vec![0; places.len()];
    for (uav, ahead) in order.iter().zip(&ahead) {
        delays[*uav] = u32::try_from(ahead - least).unwrap_or(0);
    }
    delays
}

/// The first period of a patrol of a task: each UAV flies straight to its place on the
/// loop over all cells and then on to where the next one began.
#[must_use]
pub fn first_period(task: &Task) -> Plan {
    let walk = closed_walk(task, Tree::DepthFirst);
    let n = walk.len();
    let at = places(task, &walk);
    let mut orders = vec![Vec::new(); task.n_uavs()];
    let all = u32::try_from(n).unwrap_or(u32::MAX);
    let Some(patrol) = patrol(all, &task.speeds) else {
        return task.fly(&orders);
    };
    let arcs: Vec<(usize, u32, u32)> = match patrol.pattern {
        Pattern::Round { mut uavs, .. } => {
            // Slots go round in the order in which the UAVs stand at the loop.
            uavs.sort_by_key(|u| (at[*u], *u));
            let arcs = proportional(all, &vec![1; uavs.len()]);
            uavs.into_iter()
                .zip(arcs)
                .map(|(u, a)| (u, a.0, a.1))
                .collect()
        }
        Pattern::Arcs { arcs } => (0..).zip(arcs).map(|(u, a)| (u, a.0, a.1)).collect(),
    };
    let first = arcs.first().map_or(0, |a| at[a.0]);
    for (uav, from, len) in arcs {
        let cells = (0..len as usize).map(|i| walk[(first + from as usize + i) % n]);
        orders[uav] = cells.collect();
    }
    task.fly(&orders)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The longest time between two visits of any unit of the loop, flown tick by tick.
    fn flown(n: u32, speeds: &[u32], patrol: &Patrol) -> f64 {
        // Fine ticks: each UAV moves `speed` / `fine` units a tick.
        let fine = 60u64;
        let round = u64::from(n) * fine;
        let position = |uav: usize, tick: u64| -> Option<u64> {
            match &patrol.pattern {
                Pattern::Round { uavs, speed } => {
                    let slot = uavs.iter().position(|u| *u == uav)? as u64;
                    let start = slot * round / uavs.len() as u64;
                    Some((start + tick * u64::from(*speed)) % round / fine)
                }
                Pattern::Arcs { arcs } => {
                    let (from, len) = arcs[uav];
                    let len = u64::from(len) * fine;
                    (len > 0).then(|| {
                        let x = tick * u64::from(speeds[uav]) % (2 * len);
                        u64::from(from) + x.min(2 * len - 1 - x) / fine
                    })
                }
            }
        };
        let ticks = (4.0 * patrol.revisit * fine as f64) as u64 + 4 * fine;
        let mut last = vec![None; n as usize];
        let mut worst = 0;
        for tick in 0..ticks {
            for uav in 0..speeds.len() {
                if let Some(unit) = position(uav, tick) {
                    let seen: &mut Option<u64> = &mut last[unit as usize];
                    worst = worst.max(seen.map_or(tick, |s| tick - s));
                    *seen = Some(tick);
                }
            }
        }
        assert!(last.iter().all(Option::is_some));
        worst as f64 / fine as f64
    }

    proptest! {
        #[test]
        fn nobody_waits_longer_than_promised(
            n in 5u32..60,
            speeds in prop::collection::vec(1u32..6, 1..6),
        ) {
            let patrol = patrol(n, &speeds).unwrap();
            let slow = f64::from(*speeds.iter().min().unwrap());
            prop_assert!(flown(n, &speeds, &patrol) <= patrol.revisit + 1.0 / slow + 0.1);
            let bound = revisit_bound(n, &speeds);
            prop_assert!(patrol.revisit >= bound - 1e-9);
            prop_assert!(patrol.revisit <= 2.0 * bound + 2.0 / slow);
            if speeds.iter().all(|v| *v == speeds[0]) {
                prop_assert!((patrol.revisit - bound).abs() < 1e-9);
            }
        }

        #[test]
        fn spacing_is_even_again(
            n in 10u32..500,
            places in prop::collection::vec(0u32..500, 1..9),
        ) {
            let delays = respace(n, &places);
            prop_assert!(delays.contains(&0));
            prop_assert!(delays.iter().all(|d| *d < n));
            // Falling behind may take a UAV backwards past the loop's first unit.
            let mut now: Vec<u32> = places
                .iter()
                .zip(&delays)
                .map(|(p, d)| (p % n + n - d) % n)
                .collect();
            now.sort_unstable();
            let k = now.len() as u32;
            for i in 0..now.len() {
                let next = if i + 1 == now.len() { now[0] + n } else { now[i + 1] };
                prop_assert!((next - now[i]).abs_diff(n / k) <= 1);
            }
        }
    }

    #[test]
    fn mixed_speeds_take_the_better_pattern() {
        // Round: 3 at 2 are 6, 4 at 1 are 4. To and fro: 10 / 2 are 5.
        let p = patrol(120, &[1, 2, 3, 4]).unwrap();
        assert_eq!(
            p.pattern,
            Pattern::Round {
                uavs: vec![1, 2, 3],
                speed: 2
            }
        );
        assert!((p.revisit - 20.0).abs() < 1e-12);
        // One fast and many slow: 2 n / 20 beats n / 10.
        let p = patrol(140, &[7, 1, 3, 2, 1]).unwrap();
        assert!((p.revisit - 20.0).abs() < 1e-9, "{p:?}");
        assert!(patrol(10, &[0]).is_none());
        assert!(patrol(10, &[]).is_none());
    }
}
