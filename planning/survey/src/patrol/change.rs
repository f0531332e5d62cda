//! How a patrol begins, and how the others go on when UAVs have failed.

use super::course::Course;
use super::pattern::{Patrol, Pattern, Uav, equal_periods, patrol_within, respace, to_and_fro_s};

/// Phases of the whole pattern that are tried at its beginning: the farthest way differs
/// by a sixteenth of the distance between two UAVs at most.
const PHASES: u32 = 16;

/// Shifts of all arcs that are tried: a UAV moves less than a 256th of the tour too far.
const SHIFTS: u32 = 256;

/// How far from a bend the promise is looked at, units: between bends it is straight.
const BESIDE: f64 = 1e-3;

/// Where a UAV begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// Which UAV.
    pub uav: usize,
    /// Its place on the tour when the patrol begins, flying forward.
    pub place: u32,
}

/// The beginning: the pattern turned so that the longest way there is short, and where
/// each UAV that flies begins, by UAV. All begin at once: who is there early loiters, or
/// takes off later.
///
/// `cost(uav, place)` is what the way from a UAV's launch point to a place takes.
///
/// # Guarantees
/// Stations on a loop are evenly spaced to one unit. Of the phases that are tried, and
/// with the UAVs in the order in which their launch points lie along the tour, no other
/// beginning has a shorter longest way.
///
/// # Complexity
/// O(k²) costs.
#[must_use]
pub fn spread(n: u32, patrol: &Patrol, cost: impl Fn(usize, u32) -> f64) -> (Patrol, Vec<Station>) {
    match &patrol.pattern {
        Pattern::Round { uavs, .. } => (patrol.clone(), spread_round(n, uavs, cost)),
        Pattern::Arcs { arcs, turn } => {
            let (arcs, stations) = spread_arcs(n, arcs, cost);
            let pattern = Pattern::Arcs { arcs, turn: *turn };
            let patrol = Patrol {
                pattern,
                revisit_s: patrol.revisit_s,
            };
            (patrol, stations)
        }
    }
}

/// `part / parts` of the tour.
fn share(n: u32, part: usize, parts: usize) -> u32 {
    let at = u64::from(n) * part as u64 / parts.max(1) as u64;
    u32::try_from(at).unwrap_or(n)
}

fn spread_round(n: u32, uavs: &[usize], cost: impl Fn(usize, u32) -> f64) -> Vec<Station> {
    let k = uavs.len();
    let slot = |j: usize, phase: u32| {
        let at = u64::from(share(n, j % k, k)) + u64::from(share(n, phase as usize, 16 * k));
        u32::try_from(at % u64::from(n.max(1))).unwrap_or(0)
    };
    let mut order: Vec<usize> = uavs.to_vec();
    order.sort_by_cached_key(|u| {
        let nearest = (0..k).min_by(|a, b| cost(*u, slot(*a, 0)).total_cmp(&cost(*u, slot(*b, 0))));
        (nearest, *u)
    });
    let mut best = (f64::INFINITY, Vec::new());
    for phase in 0..PHASES {
        for turn in 0..k {
            let stations = order.iter().enumerate().map(|(i, uav)| Station {
                uav: *uav,
                place: slot(i + turn, phase),
            });
            let mut longest: f64 = 0.0;
            for s in stations.clone() {
                longest = longest.max(cost(s.uav, s.place));
                if longest >= best.0 {
                    break;
                }
            }
            if longest < best.0 {
                best = (longest, stations.collect());
            }
        }
    }
    if best.1.is_empty() {
        // No way has a finite cost: who begins where makes no difference.
        let stations = order.iter().enumerate();
        best.1 = stations
            .map(|(i, uav)| Station {
                uav: *uav,
                place: slot(i, 0),
            })
            .collect();
    }
    best.1.sort_by_key(|s| s.uav);
    best.1
}

fn spread_arcs(
    n: u32,
    arcs: &[(u32, u32)],
    cost: impl Fn(usize, u32) -> f64,
) -> (Vec<(u32, u32)>, Vec<Station>) {
    let turned = |by: u32| -> Vec<(u32, u32)> {
        let place = |from: u32| (u64::from(from) + u64::from(by)) % u64::from(n.max(1));
        let arc = |a: &(u32, u32)| (u32::try_from(place(a.0)).unwrap_or(0), a.1);
        arcs.iter().map(arc).collect()
    };
    let stations = |arcs: &[(u32, u32)]| -> Vec<Station> {
        let flying = arcs.iter().enumerate().filter(|(_, a)| a.1 > 0);
        flying.map(|(uav, a)| Station { uav, place: a.0 }).collect()
    };
    let longest = |by: u32| {
        let all = stations(&turned(by));
        all.iter().map(|s| cost(s.uav, s.place)).fold(0.0, f64::max)
    };
    let shifts = (0..SHIFTS).map(|i| share(n, i as usize, SHIFTS as usize));
    let best = shifts.map(|by| (longest(by), by));
    let best = best.reduce(|a, b| if b.0 < a.0 { b } else { a });
    let arcs = turned(best.map_or(0, |b| b.1));
    let stations = stations(&arcs);
    (arcs, stations)
}

impl Patrol {
    /// The motion of each of `speeds.len()` UAVs when all begin at their stations at 0 s.
    #[must_use]
    pub fn courses(&self, speeds: &[u32], stations: &[Station]) -> Vec<Course> {
        let mut courses = vec![Course::Rest; speeds.len()];
        for s in stations {
            courses[s.uav] = match &self.pattern {
                Pattern::Round { speed, .. } => Course::Round {
                    from: f64::from(s.place),
                    since_s: 0.0,
                    speed: f64::from(*speed),
                },
                Pattern::Arcs { arcs, turn } => Course::ToAndFro {
                    from: f64::from(arcs[s.uav].0),
                    len: f64::from(arcs[s.uav].1),
                    turn: f64::from(*turn),
                    at: 0.0,
                    since_s: 0.0,
                    speed: f64::from(speeds[s.uav]),
                },
            };
        }
        courses
    }
}

/// Where a UAV is when others fail, or where and when it comes to the tour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stand {
    /// The place on the tour.
    pub place: f64,
    /// How long it takes to be there, seconds: 0 for one that flies.
    pub way_s: f64,
    /// Whether it flies forward.
    pub forward: bool,
}

/// How a UAV comes to its new arc: back on its place first or as it flies, and then along
/// the tour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToArc {
    /// Whether it turns back first.
    pub turns: bool,
    /// Whether it then flies forward.
    pub forward: bool,
    /// How far along the tour, units.
    pub along: f64,
}

/// What follows a failure. Times begin at the failure.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// The patrol of those who are left, by the numbers that they had.
    pub patrol: Patrol,
    /// By UAV: its motion from when it has loitered or is at its arc.
    pub courses: Vec<Course>,
    /// By UAV: where it was, or comes to the tour; none for those who failed or rest.
    pub stands: Vec<Option<Stand>>,
    /// By UAV: how long it loiters, seconds.
    pub loiter_s: Vec<f64>,
    /// By UAV: how it comes to its new arc; none for one that flies round, or is on it.
    pub to_arc: Vec<Option<ToArc>>,
    /// When all fly the new pattern, seconds.
    pub steady_s: f64,
    /// The longest time between two visits of a place from the last one before the
    /// failure on, seconds.
    pub gap_s: f64,
}

/// The others go on after some have failed, all at once, `t_s` seconds into a patrol that
/// has been steady for one period at least. `None` when nobody is left who can fly.
/// The tour has `n` units, and turning round at the end of an arc takes `turn` of them.
///
/// `joins(uav)` says where one that has rested would come to the tour, and how long it
/// takes to be there; `turns_back(stand)` what turning back at a place of the tour takes,
/// units, none where there is no room.
///
/// # Guarantees
/// Round a tour the cyclic order stays and the longest loiter is the shortest for it: after
/// one failure among k evenly spaced ones, none loiters longer than n / k takes, and no
/// place waits longer than 2 n / k takes, which nobody could avoid. `gap_s` is what is
/// flown then, and at least what is flown on new arcs.
///
/// # Complexity
/// O(k² log k).
#[must_use]
pub fn after_losses(
    (n, turn): (u32, u32),
    uavs: &[Uav],
    before: &[Course],
    t_s: f64,
    lost: &[usize],
    joins: impl Fn(usize) -> (u32, f64),
    turns_back: impl Fn(&Stand) -> Option<f64>,
) -> Option<Change> {
    let round = f64::from(n);
    let left: Vec<Uav> = uavs
        .iter()
        .enumerate()
        .map(|(i, u)| Uav {
            speed: if lost.contains(&i) { 0 } else { u.speed },
            ..*u
        })
        .collect();
    let patrol = patrol_within(n, turn, &left)?;
    let stand = |i: usize| -> Option<Stand> {
        if !patrol.pattern.flies(i) {
            return None;
        }
        if let Some((place, forward)) = before[i].place(round, t_s) {
            return Some(Stand {
                place,
                way_s: 0.0,
                forward,
            });
        }
        let (place, way_s) = joins(i);
        Some(Stand {
            place: f64::from(place),
            way_s,
            forward: true,
        })
    };
    let stands: Vec<Option<Stand>> = (0..uavs.len()).map(stand).collect();
    let mut change = Change {
        patrol,
        courses: vec![Course::Rest; uavs.len()],
        stands,
        loiter_s: vec![0.0; uavs.len()],
        to_arc: vec![None; uavs.len()],
        steady_s: 0.0,
        gap_s: 0.0,
    };
    match change.patrol.pattern.clone() {
        Pattern::Round { uavs, speed } => change.round(n, &uavs, speed),
        Pattern::Arcs { .. } => change.arcs(n, turn, &left, turns_back),
    }
    let since = change.courses.iter().filter_map(Course::since_s);
    change.steady_s = since.fold(0.0, f64::max);
    change.gap_s = change.gap_s(round, before, t_s);
    Some(change)
}

impl Change {
    /// Everyone loiters where it is until all are evenly spaced.
    fn round(&mut self, n: u32, uavs: &[usize], speed: u32) {
        let speed = f64::from(speed);
        let (round, stands) = (f64::from(n), &self.stands);
        let places: Vec<u32> = uavs
            .iter()
            .map(|i| {
                // Who is still on its way is as far behind as it flies meanwhile.
                let at = stands[*i].map_or(0.0, |s| s.place - s.way_s * speed);
                #[allow(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "from 0 to the tour's length"
                )]
                let place = (at - (at / round).floor() * round) as u32;
                place
            })
            .collect();
        for (i, delay) in uavs.iter().zip(respace(n, &places)) {
            if let Some(stand) = self.stands[*i] {
                self.loiter_s[*i] = f64::from(delay) / speed;
                self.courses[*i] = Course::Round {
                    from: stand.place,
                    since_s: stand.way_s + self.loiter_s[*i],
                    speed,
                };
            }
        }
    }

    /// Everyone moves along the tour to its new arc, in the order in which they are.
    fn arcs(
        &mut self,
        n: u32,
        turn: u32,
        uavs: &[Uav],
        turns_back: impl Fn(&Stand) -> Option<f64>,
    ) {
        let flying = self.stands.iter().enumerate();
        let mut order: Vec<(usize, Stand)> = flying.filter_map(|(i, s)| Some((i, (*s)?))).collect();
        order.sort_by(|a, b| a.1.place.total_cmp(&b.1.place).then(a.0.cmp(&b.0)));
        let speeds: Vec<u32> = order.iter().map(|(i, _)| uavs[*i].speed).collect();
        let backs = order.iter().map(|(_, stand)| turns_back(stand));
        let backs: Vec<f64> = backs.map(|b| b.unwrap_or(f64::INFINITY)).collect();
        let lens = equal_periods(n, turn, &speeds);
        let course = |j: usize, by: u32| {
            let (i, stand) = order[j];
            let (from, len) = (u64::from(lens[j].0) + u64::from(by), lens[j].1);
            let from = u32::try_from(from % u64::from(n)).unwrap_or(0);
            let speed = f64::from(uavs[i].speed);
            let turns = (f64::from(turn), backs[j]);
            to_arc(f64::from(n), stand, (from, len), turns, speed)
        };
        let last = |by: u32| {
            let since = (0..order.len()).filter_map(|j| course(j, by).0.since_s());
            since.fold(0.0, f64::max)
        };
        let shifts = (0..SHIFTS).map(|i| share(n, i as usize, SHIFTS as usize));
        let best = shifts.map(|by| (last(by), by));
        let by = best.reduce(|a, b| if b.0 < a.0 { b } else { a });
        let by = by.map_or(0, |b| b.1);
        let mut arcs = vec![(0, 0); uavs.len()];
        let mut revisit_s: f64 = 0.0;
        for (j, (i, _)) in order.iter().enumerate() {
            let from = (u64::from(lens[j].0) + u64::from(by)) % u64::from(n);
            arcs[*i] = (u32::try_from(from).unwrap_or(0), lens[j].1);
            if lens[j].1 > 0 {
                (self.courses[*i], self.to_arc[*i]) = course(j, by);
                let period_s = to_and_fro_s(lens[j].1, turn, uavs[*i].speed);
                revisit_s = revisit_s.max(period_s);
            }
        }
        self.patrol = Patrol {
            pattern: Pattern::Arcs { arcs, turn },
            revisit_s,
        };
    }

    /// The longest time between two visits from the last one before the failure on.
    fn gap_s(&self, n: f64, before: &[Course], t_s: f64) -> f64 {
        let mut bends: Vec<f64> = before.iter().flat_map(|c| c.bends(n, t_s)).collect();
        for course in &self.courses {
            bends.extend(course.bends(n, course.since_s().unwrap_or(0.0)));
        }
        bends.sort_by(f64::total_cmp);
        bends.dedup();
        let is_round = matches!(self.patrol.pattern, Pattern::Round { .. });
        let mut worst = self.patrol.revisit_s;
        let mut firsts = Vec::new();
        for bend in bends {
            for x in [bend - BESIDE, bend + BESIDE] {
                let x = if x < 0.0 { x + n } else { x };
                firsts.clear();
                firsts.extend(self.courses.iter().filter_map(|c| c.first_s(n, x)));
                firsts.sort_by(|a, b| a.0.total_cmp(&b.0));
                let Some((first, period)) = firsts.first().copied() else {
                    continue;
                };
                let ages = before.iter().filter_map(|c| c.age_s(n, x, t_s));
                worst = worst.max(ages.fold(f64::INFINITY, f64::min).min(f64::MAX) + first);
                if is_round {
                    let again = firsts.iter().skip(1).map(|f| f.0).chain([first + period]);
                    let gaps = firsts.iter().zip(again).map(|(a, b)| b - a.0);
                    worst = gaps.fold(worst, f64::max);
                }
            }
        }
        worst
    }
}

/// The motion of a UAV that moves along the tour to its arc, the shorter way, and how it
/// comes there. A turn at an end of the arc takes the first of `turns`, one back where the UAV
/// is the second.
fn to_arc(
    n: f64,
    stand: Stand,
    arc: (u32, u32),
    (turn, back): (f64, f64),
    speed: f64,
) -> (Course, Option<ToArc>) {
    let (from, len) = (f64::from(arc.0), f64::from(arc.1));
    let ahead = |from: f64, to: f64| {
        let d = to - from;
        if d < 0.0 { d + n } else { d }
    };
    let y = ahead(from, stand.place);
    let (at, way, comes) = if y <= len {
        let homeward = 2.0 * len + turn - y;
        (if stand.forward { y } else { homeward }, 0.0, None)
    } else {
        // Forward to the arc's beginning, or back to its end; who flies the other way turns.
        let comes = |forward: bool, along: f64| ToArc {
            turns: stand.forward != forward,
            forward,
            along,
        };
        let (forth, fro) = (comes(true, n - y), comes(false, y - len));
        let way = |c: &ToArc| c.along + if c.turns { back } else { 0.0 };
        if way(&forth) <= way(&fro) {
            (0.0, way(&forth), Some(forth))
        } else {
            (len + turn, way(&fro), Some(fro))
        }
    };
    let course = Course::ToAndFro {
        from,
        len,
        turn,
        at,
        since_s: stand.way_s + way / speed,
        speed,
    };
    (course, comes)
}
