//! Which pattern revisits soonest.

/// How the tour is patrolled.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Pattern {
    /// These UAVs fly round, evenly spaced, all at one speed; the others rest.
    Round {
        /// Who flies, in the order of their numbers.
        uavs: Vec<usize>,
        /// The common speed, units a second.
        speed: u32,
    },
    /// Each UAV flies to and fro on an arc of its own, at its own speed.
    Arcs {
        /// By UAV: where its arc begins on the tour, and its length; 0 for one that rests.
        arcs: Vec<(u32, u32)>,
        /// What turning round at the end of an arc takes, units.
        turn: u32,
    },
}

impl Pattern {
    /// Whether a UAV flies.
    #[must_use]
    pub fn flies(&self, uav: usize) -> bool {
        match self {
            Self::Round { uavs, .. } => uavs.contains(&uav),
            Self::Arcs { arcs, .. } => arcs.get(uav).is_some_and(|a| a.1 > 0),
        }
    }
}

/// A patrol.
#[derive(Clone, Debug, PartialEq)]
pub struct Patrol {
    /// Who flies where.
    pub pattern: Pattern,
    /// The longest time between two visits of a place, seconds.
    pub revisit_s: f64,
}

impl Patrol {
    /// How long a UAV takes to be where it was, seconds: once round, or to and fro.
    #[must_use]
    pub fn period_s(&self, n: u32, uav: usize, speeds: &[u32]) -> f64 {
        match &self.pattern {
            Pattern::Round { speed, .. } => f64::from(n) / f64::from(*speed),
            Pattern::Arcs { arcs, turn } => to_and_fro_s(arcs[uav].1, *turn, speeds[uav]),
        }
    }
}

/// A UAV that may take part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Uav {
    /// Units a second; 0 for one that cannot fly.
    pub speed: u32,
    /// It takes part where once round, or to and fro on its arc, takes at most this long,
    /// seconds: what its endurance leaves besides the ways there and back.
    pub longest_s: f64,
}

/// The pattern that revisits soonest on a tour of length `n`; `None` without a UAV that
/// moves. On a tie all fly round.
///
/// # Guarantees
/// With equal speeds the revisit time is the least possible, n / (k v). With mixed ones
/// it is the smaller of n / max_r (r v_r), v_r the r-th fastest, and 2 n / sum of v (and
/// what rounding to whole units adds), so at most twice the least possible.
///
/// # Complexity
/// O(k log k).
#[must_use]
pub fn patrol(n: u32, speeds: &[u32]) -> Option<Patrol> {
    let tireless = |v: &u32| Uav {
        speed: *v,
        longest_s: f64::INFINITY,
    };
    patrol_within(n, 0, &speeds.iter().map(tireless).collect::<Vec<_>>())
}

/// The same where endurance is short, and where turning round at the end of an arc takes
/// `turn` units: who cannot fly one period rests. `None` when nobody can.
///
/// # Complexity
/// O(k²).
#[must_use]
pub fn patrol_within(n: u32, turn: u32, uavs: &[Uav]) -> Option<Patrol> {
    match (round(n, uavs), arcs(n, turn, uavs)) {
        (Some(round), Some(arcs)) if arcs.revisit_s < round.revisit_s => Some(arcs),
        (Some(round), _) => Some(round),
        (None, arcs) => arcs,
    }
}

/// All who are fast enough fly round at one speed.
fn round(n: u32, uavs: &[Uav]) -> Option<Patrol> {
    let mut speeds: Vec<u32> = uavs.iter().map(|u| u.speed).filter(|v| *v > 0).collect();
    speeds.sort_unstable();
    speeds.dedup();
    let at = |speed: u32| -> (u64, Vec<usize>) {
        let lap_s = f64::from(n) / f64::from(speed);
        let can = |i: &usize| uavs[*i].speed >= speed && lap_s <= uavs[*i].longest_s;
        let who: Vec<usize> = (0..uavs.len()).filter(can).collect();
        (who.len() as u64 * u64::from(speed), who)
    };
    // On a tie the slower speed: more fly.
    let best = speeds.into_iter().map(|v| (at(v), v)).filter(|c| c.0.0 > 0);
    let ((_, who), speed) = best.reduce(|a, b| if b.0.0 > a.0.0 { b } else { a })?;
    // Slots are whole units apart.
    let apart = n.div_ceil(u32::try_from(who.len()).unwrap_or(u32::MAX));
    Some(Patrol {
        pattern: Pattern::Round { uavs: who, speed },
        revisit_s: f64::from(apart) / f64::from(speed),
    })
}

/// Each flies to and fro on its own arc.
fn arcs(n: u32, turn: u32, uavs: &[Uav]) -> Option<Patrol> {
    let mut speeds: Vec<u32> = uavs.iter().map(|u| u.speed).collect();
    loop {
        let arcs = equal_periods(n, turn, &speeds);
        let period = |i: usize| to_and_fro_s(arcs[i].1, turn, speeds[i]);
        // Who is left out makes the arcs of the others longer, so none comes back.
        let over: Vec<usize> = (0..uavs.len())
            .filter(|i| period(*i) > uavs[*i].longest_s)
            .collect();
        if speeds.iter().all(|v| *v == 0) {
            return None;
        }
        if over.is_empty() {
            let revisit_s = (0..uavs.len()).map(period).fold(0.0, f64::max);
            return Some(Patrol {
                pattern: Pattern::Arcs { arcs, turn },
                revisit_s,
            });
        }
        for i in over {
            speeds[i] = 0;
        }
    }
}

/// Once to and fro on an arc, with a turn at each end.
pub(super) fn to_and_fro_s(len: u32, turn: u32, speed: u32) -> f64 {
    match len {
        0 => 0.0,
        len => 2.0 * (f64::from(len) + f64::from(turn)) / f64::from(speed),
    }
}

/// Arcs of whole units, one after the other, on which to and fro takes all equally long:
/// as [`proportional`] without turns. Who would do nothing but turn has none.
pub(super) fn equal_periods(n: u32, turn: u32, speeds: &[u32]) -> Vec<(u32, u32)> {
    let mut speeds = speeds.to_vec();
    loop {
        let k = speeds.iter().filter(|v| **v > 0).count() as u64;
        let sum: u64 = speeds.iter().map(|v| u64::from(*v)).sum::<u64>().max(1);
        // What all of them fly in half a period.
        let all = u128::from(n) + u128::from(k) * u128::from(turn);
        let idle = |v: u32| v > 0 && u128::from(v) * all <= u128::from(turn) * u128::from(sum);
        let slowest = speeds.iter().copied().filter(|v| idle(*v)).min();
        if let Some(slow) = slowest
            && k > 1
        {
            let last = speeds.iter().rposition(|v| *v == slow);
            if let Some(v) = last.and_then(|i| speeds.get_mut(i)) {
                *v = 0;
            }
            continue;
        }
        let (mut flown, mut turns) = (0u64, 0u64);
        let mut arcs = Vec::with_capacity(speeds.len());
        let mut from = 0;
        for v in &speeds {
            flown += u64::from(*v);
            turns += u64::from(*v > 0);
            let at = all * u128::from(flown) / u128::from(sum);
            let at = at.saturating_sub(u128::from(turns) * u128::from(turn));
            let to = u32::try_from(at).unwrap_or(n).clamp(from, n);
            arcs.push((from, to - from));
            from = to;
        }
        return arcs;
    }
}

/// No patrol revisits all of a tour of length `n` sooner, seconds.
#[must_use]
pub fn revisit_bound(n: u32, speeds: &[u32]) -> f64 {
    let sum: u64 = speeds.iter().map(|v| u64::from(*v)).sum();
    f64::from(n) / sum.max(1) as f64
}

/// Arcs of whole units in proportion to the speeds, one after the other.
pub fn proportional(n: u32, speeds: &[u32]) -> Vec<(u32, u32)> {
    equal_periods(n, 0, speeds)
}

/// How much each of the UAVs that fly round a tour of length `n` has to fall behind so
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
