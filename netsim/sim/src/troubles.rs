//! The kinds of trouble that storms draw beside loss, kills, restarts, partitions and
//! moved bases, and how each is drawn. A run draws how many kinds it meets, then which:
//! few at once, so that what goes wrong can be told from its cause, and each in many runs
//! of a batch. A few rare kinds are drawn each for itself.

use crate::fault::{Fault, Order, TimedFault};
use crate::spec::{Spec, UavSpec};
use crate::swarm::stream::{Concern, Stream};
use crate::world::flat::{Bounds, clip};
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::{PI, sin_cos};
use skein_peer::input::NewTask;
use skein_peer::mission::{PointMm, mm, ring_mm};
use skein_peer::wire::tasks::TaskKind;
use skein_peer::{CoverageTask, LineTask, PointTask};

/// Shortest time for which something is wrong, milliseconds: two beacon periods.
const SHORTEST_MS: u64 = 2_000;

/// Of so many writes one fails, at the most and at the least, where not all do.
const ONE_WRITE_IN: (u64, u64) = (2, 20);

/// The least that a late disk or computer is late by, milliseconds: less is what a
/// healthy one may be.
const LEAST_DELAY_MS: u64 = 50;

/// The most records that an outsider spoils in a run.
const MOST_SPOILT: u64 = 20;

/// Height slots of further UAVs are so far apart, metres.
const SLOT_M: f64 = 5.0;

/// What the operator takes off an area, thousandths of its width or height.
const LEAST_CUT_PERMILLE: u64 = 100;
/// See [`LEAST_CUT_PERMILLE`].
const MOST_CUT_PERMILLE: u64 = 400;

/// One target in so many is moved, and no farther than this either way, mm.
const MOVED_ONE_IN: u64 = 4;
/// See [`MOVED_ONE_IN`].
const FARTHEST_MM: i32 = 40_000;

/// So often a place for a new zone is drawn at most.
const ZONE_TRIES: u32 = 16;

/// The operator of a storm asks for so many tasks at most, each for so long, milliseconds.
const MOST_TASKS: u64 = 6;
/// And for so many relay positions, each so far around, mm.
const MOST_RELAYS: u64 = 2;
/// See [`MOST_RELAYS`].
const RELAY_RADIUS_MM: u32 = 100_000;
/// See [`MOST_TASKS`].
const LEAST_WITHIN_MS: u64 = 20_000;
/// See [`MOST_TASKS`].
const MOST_WITHIN_MS: u64 = 200_000;

/// A new zone leaves so much room round where UAVs start and loiter at last, metres.
const ZONE_APART_M: f64 = 80.0;

/// A kind of trouble.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// Its name in reports.
    pub name: &'static str,
    /// Whether this scenario can meet it.
    pub can: fn(&Spec) -> bool,
    /// Draws it.
    how: How,
}

/// How a kind of trouble comes into a run.
#[derive(Clone, Copy, Debug)]
enum How {
    /// By faults of its own.
    Faults(fn(&mut Draw<'_>)),
    /// By another scenario, from which all else is drawn; given the failure-free makespan.
    Scenario(fn(&mut Stream, &mut Spec, u64)),
}

impl Kind {
    const fn new(name: &'static str, can: fn(&Spec) -> bool, draw: fn(&mut Draw<'_>)) -> Self {
        let how = How::Faults(draw);
        Self { name, can, how }
    }
}

/// All of them.
pub const KINDS: &[Kind] = &[
    Kind::new("failing-stores", |_| true, failing_stores),
    Kind::new(
        "slow-stores",
        |s| s.storm.troubles.max_store_delay_ms > 0,
        slow_stores,
    ),
    Kind::new("pause", |s| s.storm.troubles.max_pause_s > 0, pause),
    Kind::new(
        "slow-computer",
        |s| s.storm.troubles.max_computer_delay_ms > 0,
        slow_computer,
    ),
    Kind::new(
        "clock-drift",
        |s| s.storm.troubles.max_clock_drift_ppm > 0,
        clock_drift,
    ),
    Kind::new(
        "clock-jump",
        |s| s.storm.troubles.max_clock_jump_ms > 0,
        clock_jump,
    ),
    Kind::new("one-way", |s| s.uavs.len() > 1, one_way),
    Kind::new("order", |s| s.ground.is_some(), order),
    Kind::new("ground-down", can_lose_ground, ground_down),
    Kind::new("spoilt-records", |_| true, spoilt_records),
    Kind::new("short-fuel", |s| s.uavs.len() > 1, short_fuel),
    Kind {
        name: "late-faults",
        can: |s| s.storm.until < 1.0,
        how: How::Scenario(|_, spec, _| spec.storm.until = 1.0),
    },
    Kind {
        name: "fleet",
        can: |s| s.storm.troubles.max_uavs > 0,
        how: How::Scenario(fleet),
    },
];

/// Kinds that are drawn each for itself and seldom, beside the others: a crowd is slow, and
/// what comes in the middle of a mission changes all that follows.
pub const RARE: &[Kind] = &[
    Kind {
        name: "crowd",
        can: can_be_a_crowd,
        how: How::Scenario(crowd),
    },
    Kind::new("mission", can_be_given, missions),
    Kind::new("mission-elsewhere", can_be_elsewhere, missions_elsewhere),
    Kind::new("twin", |s| s.uavs.len() > 1, twin),
    Kind::new("zones", can_be_given, zones),
    Kind::new("tasks", can_be_asked, tasks),
    Kind::new("relays", can_be_asked, relays),
];

/// Each of the rare kinds strikes in one run of so many.
const RARE_ONE_IN: u64 = 12;

/// A kind that a run drew, and when it strikes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Struck {
    /// Its name.
    pub name: &'static str,
    /// Scenario time, milliseconds.
    pub at_ms: u64,
}

/// What one run draws from.
struct Draw<'a> {
    s: &'a mut Stream,
    spec: &'a Spec,
    /// All peers, in the order of their numbers.
    peers: &'a [u16],
    /// UAVs that are not killed for good.
    survivors: &'a [u16],
    end_ms: u64,
    out: Vec<TimedFault>,
}

/// The rare kinds that the run with this seed meets, each by a draw of its own: one more of
/// them changes no other storm.
#[must_use]
pub fn choose_rare(seed: u64, spec: &Spec) -> Vec<Kind> {
    let met = |n: u16| Stream::new(seed, Concern::Rare(n)).one_in(RARE_ONE_IN);
    let some = spec.storm.troubles.max_kinds > 0;
    let numbered = (0..).zip(RARE).filter(|(_, kind)| some && (kind.can)(spec));
    numbered.filter(|(n, _)| met(*n)).map(|(_, k)| *k).collect()
}

/// Draws the kinds that one run meets.
pub fn choose(s: &mut Stream, spec: &Spec) -> Vec<Kind> {
    let numbers: Vec<u16> = (0..)
        .zip(KINDS)
        .filter(|(_, kind)| (kind.can)(spec))
        .map(|(i, _)| i)
        .collect();
    let most = usize::from(spec.storm.troubles.max_kinds).min(numbers.len());
    let n_kinds = usize::try_from(s.between(0, most as u64)).unwrap_or(0);
    let drawn = s.shuffled(&numbers).into_iter().take(n_kinds);
    drawn.map(|i| KINDS[usize::from(i)]).collect()
}

/// The scenario from which the faults of these kinds are drawn, and its failure-free
/// makespan, milliseconds.
#[must_use]
pub fn prepare(s: &mut Stream, kinds: &[Kind], spec: &Spec, makespan_ms: u64) -> (Spec, u64) {
    let mut changed = spec.clone();
    for kind in kinds {
        if let How::Scenario(change) = kind.how {
            change(s, &mut changed, makespan_ms);
        }
    }
    let (before, after) = (spec.uavs.len() as u64, changed.uavs.len() as u64);
    (changed, makespan_ms * before / after.max(1))
}

/// Draws the faults of these kinds until `end_ms`, on all peers and UAVs that survive.
pub fn draw(
    s: &mut Stream,
    kinds: &[Kind],
    spec: &Spec,
    (peers, survivors): (&[u16], &[u16]),
    end_ms: u64,
) -> (Vec<Struck>, Vec<TimedFault>) {
    let (mut struck, mut faults) = (Vec::new(), Vec::new());
    for kind in kinds {
        let mut draw = Draw {
            s,
            spec,
            peers,
            survivors,
            end_ms,
            out: Vec::new(),
        };
        let first_ms = match kind.how {
            How::Faults(of) => {
                of(&mut draw);
                draw.out.iter().map(|f| f.at_ms).min()
            }
            How::Scenario(_) => Some(0),
        };
        struck.extend(first_ms.map(|at_ms| Struck {
            name: kind.name,
            at_ms,
        }));
        faults.append(&mut draw.out);
    }
    (struck, faults)
}

impl Draw<'_> {
    /// One peer, or now and then two.
    fn some_peers(&mut self) -> Vec<u16> {
        let n = if self.s.one_in(3) { 2 } else { 1 };
        self.s.shuffled(self.peers).into_iter().take(n).collect()
    }

    /// When something begins and ends; one in four begins with the run.
    fn span_ms(&mut self, longest_s: u32) -> (u64, u64) {
        let begins_ms = match self.s.one_in(4) {
            true => 0,
            false => self.s.between(0, self.end_ms),
        };
        let longest_ms = (u64::from(longest_s) * 1000).max(SHORTEST_MS);
        (
            begins_ms,
            begins_ms + self.s.between(SHORTEST_MS, longest_ms),
        )
    }

    fn push(&mut self, at_ms: u64, fault: Fault) {
        self.out.push(TimedFault { at_ms, fault });
    }

    /// For some peers, each in its own span, something goes wrong and is put right.
    fn for_a_while(&mut self, longest_s: u32, wrong: impl Fn(&mut Self, u16) -> (Fault, Fault)) {
        for peer in self.some_peers() {
            let (from_ms, to_ms) = self.span_ms(longest_s);
            let (begins, ends) = wrong(self, peer);
            self.push(from_ms, begins);
            self.push(to_ms, ends);
        }
    }

    fn delay_ms(&mut self, most_ms: u32) -> u32 {
        let most_ms = u64::from(most_ms).max(LEAST_DELAY_MS);
        u32::try_from(self.s.between(LEAST_DELAY_MS, most_ms)).unwrap_or(u32::MAX)
    }
}

/// A disk takes no writes for a while, or loses one in so many.
fn failing_stores(d: &mut Draw<'_>) {
    d.for_a_while(d.spec.storm.troubles.max_s, |d, peer| {
        let one_in = match d.s.one_in(2) {
            true => 1,
            false => d.s.between(ONE_WRITE_IN.0, ONE_WRITE_IN.1),
        };
        let one_in = u32::try_from(one_in).unwrap_or(1);
        (
            Fault::FailStores { peer, one_in },
            Fault::HealStores { peer },
        )
    });
}

/// A disk takes long for each write.
fn slow_stores(d: &mut Draw<'_>) {
    d.for_a_while(d.spec.storm.troubles.max_s, |d, peer| {
        let delay_ms = d.delay_ms(d.spec.storm.troubles.max_store_delay_ms);
        (
            Fault::SlowStores { peer, delay_ms },
            Fault::HealStores { peer },
        )
    });
}

/// A process stands still and goes on.
fn pause(d: &mut Draw<'_>) {
    d.for_a_while(d.spec.storm.troubles.max_pause_s, |_, peer| {
        (Fault::Pause { peer }, Fault::Resume { peer })
    });
}

/// A computer gets round to everything late.
fn slow_computer(d: &mut Draw<'_>) {
    d.for_a_while(d.spec.storm.troubles.max_s, |d, peer| {
        let delay_ms = d.delay_ms(d.spec.storm.troubles.max_computer_delay_ms);
        (
            Fault::SlowComputer { peer, delay_ms },
            Fault::SlowComputer { peer, delay_ms: 0 },
        )
    });
}

/// Clocks go too fast or too slowly, all of them by another rate, to the end.
fn clock_drift(d: &mut Draw<'_>) {
    let most_ppm = i64::from(d.spec.storm.troubles.max_clock_drift_ppm);
    for &peer in d.peers {
        let drawn = d.s.between(0, 2 * most_ppm.unsigned_abs());
        let ppm = i64::try_from(drawn).unwrap_or(0) - most_ppm;
        let ppm = i32::try_from(ppm).unwrap_or(0);
        let at_ms = d.s.between(0, d.end_ms);
        d.push(at_ms, Fault::ClockDrift { peer, ppm });
    }
}

/// The clocks of one or two are set ahead, once each.
fn clock_jump(d: &mut Draw<'_>) {
    for peer in d.some_peers() {
        let at_ms = d.s.between(0, d.end_ms);
        let ahead_ms = d.delay_ms(d.spec.storm.troubles.max_clock_jump_ms);
        d.push(at_ms, Fault::ClockJump { peer, ahead_ms });
    }
}

/// One UAV hears nobody, or nobody hears it, or a few links are up one way only.
fn one_way(d: &mut Draw<'_>) {
    let (from_ms, to_ms) = d.span_ms(d.spec.storm.troubles.max_s);
    let order = d.s.shuffled(d.peers);
    let Some((&one, others)) = order.split_first() else {
        return;
    };
    let links: Vec<(u16, u16)> = match d.s.between(0, 2) {
        0 => others.iter().map(|o| (*o, one)).collect(),
        1 => others.iter().map(|o| (one, *o)).collect(),
        _ => order.chunks_exact(2).map(|p| (p[0], p[1])).collect(),
    };
    for (a, b) in links {
        let one_way = true;
        d.push(from_ms, Fault::Cut { a, b, one_way });
    }
    d.push(to_ms, Fault::Heal);
}

/// All, or one, are to hold, or to come back, and then to go on.
fn order(d: &mut Draw<'_>) {
    let (from_ms, to_ms) = d.span_ms(d.spec.storm.troubles.max_s);
    let order = match d.s.one_in(2) {
        true => Order::Hold,
        false => Order::ReturnToBase,
    };
    let one = d.s.one_in(2);
    let uav = one
        .then(|| d.s.shuffled(d.peers).first().copied())
        .flatten();
    d.push(from_ms, Fault::Order { order, uav });
    let order = Order::Resume;
    d.push(to_ms, Fault::Order { order, uav });
}

/// Not where there are laps: a ground station that comes back in a later one does not learn
/// of it.
fn can_lose_ground(spec: &Spec) -> bool {
    spec.ground.is_some() && spec.mission.further_laps == 0
}

/// The ground station is down for a while.
fn ground_down(d: &mut Draw<'_>) {
    let (from_ms, to_ms) = d.span_ms(d.spec.storm.troubles.max_s);
    let Some(peer) = d.spec.ground.as_ref().map(|g| g.id) else {
        return;
    };
    let fresh_disk = d.s.one_in(2);
    d.push(from_ms, Fault::KillComputer { peer });
    d.push(to_ms, Fault::Restart { peer, fresh_disk });
}

/// An outsider now and then repeats a record with bits wrong, so that nobody can read it.
fn spoilt_records(d: &mut Draw<'_>) {
    for _ in 0..d.s.between(1, MOST_SPOILT) {
        let n = d.peers.len() as u64;
        let which = usize::try_from(d.s.between(0, n.saturating_sub(1))).unwrap_or(0);
        let at_ms = d.s.between(0, d.end_ms);
        if let Some(&peer) = d.peers.get(which) {
            d.push(at_ms, Fault::SpoiltRecord { peer });
        }
    }
}

/// Some batteries last about as long as they are needed; a UAV that survives has a good one.
fn short_fuel(d: &mut Draw<'_>) {
    let Some((_, others)) = d.survivors.split_first() else {
        return;
    };
    let reserve_s = d.spec.uavs.iter().map(|u| u.airframe.reserve_s);
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "casts from floats saturate, and a reserve is not negative"
    )]
    let reserve_ms = reserve_s.fold(0.0, f64::max) as u64 * 1000;
    let n = d.s.between(1, others.len() as u64);
    for &peer in others.iter().take(usize::try_from(n).unwrap_or(0)) {
        let lasts_ms = reserve_ms + d.s.between(d.end_ms / 3, d.end_ms + d.end_ms / 3);
        let lasts_ms = u32::try_from(lasts_ms).unwrap_or(u32::MAX);
        d.push(0, Fault::ShortFuel { peer, lasts_ms });
    }
}

/// A second UAV is switched on with the id of one, or a second program in its airframe.
fn twin(d: &mut Draw<'_>) {
    let (from_ms, _) = d.span_ms(0);
    let ids: Vec<u16> = d.spec.uavs.iter().map(|u| u.id).collect();
    if let Some(&peer) = d.s.shuffled(&ids).first() {
        let aboard = d.s.one_in(2);
        d.push(from_ms, Fault::Twin { peer, aboard });
    }
}

/// Where an operator has a ground station.
fn can_be_given(spec: &Spec) -> bool {
    spec.ground.is_some() && spec.storm.troubles.max_missions > 0
}

/// Targets have their places; an area can be anywhere.
fn can_be_elsewhere(spec: &Spec) -> bool {
    can_be_given(spec) && spec.mission.task.targets().is_none()
}

/// The operator wants an area that lies partly beyond the first one, or two.
fn missions_elsewhere(d: &mut Draw<'_>) {
    let mission = &d.spec.mission;
    let area = mission.area_m();
    let within = Bounds::around(&area);
    let size = within.max - within.min;
    for _ in 0..d.s.between(1, d.spec.storm.troubles.max_missions.into()) {
        let by = size * share(d.s, LEAST_CUT_PERMILLE, MOST_CUT_PERMILLE);
        let moved = match d.s.between(0, 3) {
            0 => Vector::new(by.x, 0.0),
            1 => Vector::new(-by.x, 0.0),
            2 => Vector::new(0.0, by.y),
            _ => Vector::new(0.0, -by.y),
        };
        let area: Vec<Point> = area.iter().map(|p| *p + moved).collect();
        let (area, zones) = (ring_mm(&area), mission.zones.clone());
        let at_ms = d.s.between(0, d.end_ms);
        let task = None;
        d.push(at_ms, Fault::Revise { area, zones, task });
    }
}

/// The operator wants some of the first targets, and of these some a little way off.
fn missions_of_targets(d: &mut Draw<'_>) {
    let mission = &d.spec.mission;
    for _ in 0..d.s.between(1, d.spec.storm.troubles.max_missions.into()) {
        let kept_permille = d.s.between(MOST_CUT_PERMILLE, 1000 - LEAST_CUT_PERMILLE);
        let task = match &mission.task {
            CoverageTask::Points(points) => {
                let kept = points.iter().filter_map(|p| {
                    let by = kept_at(d.s, kept_permille)?;
                    let at = moved(p.at, by);
                    Some(PointTask { at, ..*p })
                });
                CoverageTask::Points(kept.collect())
            }
            CoverageTask::Lines(lines) => {
                let kept = lines.iter().filter_map(|l| {
                    let by = kept_at(d.s, kept_permille)?;
                    let way = l.way.iter().map(|p| moved(*p, by)).collect();
                    Some(LineTask { way, ..l.clone() })
                });
                CoverageTask::Lines(kept.collect())
            }
            CoverageTask::Area | CoverageTask::Exact => return,
        };
        let (area, zones) = (mission.area.clone(), mission.zones.clone());
        let at_ms = d.s.between(0, d.end_ms);
        let task = Some(task);
        d.push(at_ms, Fault::Revise { area, zones, task });
    }
}

/// By how much a target that is kept is moved, millimetres; nothing for one that is not kept.
fn kept_at(s: &mut Stream, kept_permille: u64) -> Option<PointMm> {
    let kept = s.between(0, 999) < kept_permille;
    let moves = s.one_in(MOVED_ONE_IN);
    let most = u64::from(FARTHEST_MM.unsigned_abs());
    let mut way = || i32::try_from(s.between(0, 2 * most)).unwrap_or(0) - FARTHEST_MM;
    let by = (way(), way());
    kept.then_some(if moves { by } else { (0, 0) })
}

fn moved(at: PointMm, by: PointMm) -> PointMm {
    (at.0.saturating_add(by.0), at.1.saturating_add(by.1))
}

/// The operator gives another mission, or two, each one a change of the first: a part of
/// its area, a zone less, a zone more, or all of that; or other targets.
fn missions(d: &mut Draw<'_>) {
    let mission = &d.spec.mission;
    if mission.task.targets().is_some() {
        return missions_of_targets(d);
    }
    for _ in 0..d.s.between(1, d.spec.storm.troubles.max_missions.into()) {
        let (mut area, mut zones) = (mission.area.clone(), mission.zones.clone());
        let what = d.s.between(0, 3);
        if (what == 1 || what == 3) && !zones.is_empty() {
            let which = d.s.between(0, zones.len() as u64 - 1);
            zones.remove(usize::try_from(which).unwrap_or(0));
        }
        if what >= 2 {
            zones.extend(new_zone(d, &mission.area_m()));
        }
        if what == 0 || what == 3 || zones == mission.zones {
            area = part_of(d, &mission.area_m());
        }
        let at_ms = d.s.between(0, d.end_ms);
        let task = None;
        d.push(at_ms, Fault::Revise { area, zones, task });
    }
}

/// The operator adds a no-fly zone or two, and takes half of them away again.
fn zones(d: &mut Draw<'_>) {
    let area = d.spec.mission.area_m();
    for n in 1..=d.s.between(1, d.spec.storm.troubles.max_missions.into()) {
        let Some(ring) = new_zone(d, &area) else {
            continue;
        };
        let name = format!("zone-{n}");
        let at_ms = d.s.between(0, d.end_ms);
        let again_ms = d.s.between(at_ms, d.end_ms);
        let again = d.s.one_in(2);
        d.push(
            at_ms,
            Fault::AddZone {
                name: name.clone(),
                ring,
            },
        );
        if again {
            d.push(again_ms, Fault::RemoveZone { name });
        }
    }
}

/// Whether an operator can ask for tasks: somebody speaks them, and no UAVs are kept apart by
/// agreement.
fn can_be_asked(spec: &Spec) -> bool {
    spec.ground.is_some() && spec.mission.separation_mm == 0
}

/// The operator asks for some places and lines in and around the area, some of them within a
/// time, and cancels one in four.
fn tasks(d: &mut Draw<'_>) {
    for n in 1..=d.s.between(1, MOST_TASKS) {
        let Some(task) = new_task(d, n) else {
            continue;
        };
        let name = task.name.clone().unwrap_or_default();
        let at_ms = d.s.between(0, d.end_ms);
        let cancelled_ms = d.s.between(at_ms, d.end_ms + LEAST_WITHIN_MS);
        let is_cancelled = d.s.one_in(4);
        d.push(at_ms, Fault::AddTask { task });
        if is_cancelled {
            d.push(cancelled_ms, Fault::CancelTask { name });
        }
    }
}

/// The operator asks for one or two relay positions in and around the area for some time, and
/// cancels one in four sooner.
fn relays(d: &mut Draw<'_>) {
    let within = Bounds::around(&d.spec.mission.area_m());
    let size = within.max - within.min;
    for n in 1..=d.s.between(1, MOST_RELAYS) {
        let drawn = (0..ZONE_TRIES).find_map(|_| {
            let (east, north) = (share(d.s, 0, 1400) - 0.2, share(d.s, 0, 1400) - 0.2);
            let at = within.min + Vector::new(size.x * east, size.y * north);
            let within_ms = d.s.between(LEAST_WITHIN_MS, MOST_WITHIN_MS);
            let task = NewTask {
                name: Some(format!("relay-{n}")),
                kind: TaskKind::Relay,
                places: vec![(mm(at.x), mm(at.y))],
                radius_mm: RELAY_RADIUS_MM,
                worth: 100,
                within_ms: u32::try_from(within_ms).ok(),
                sensor: 0,
            };
            let asked = task.asked(0, 1).ok()?;
            d.spec.mission.can_do(&asked).ok().map(|()| task)
        });
        let Some(task) = drawn else { continue };
        let name = task.name.clone().unwrap_or_default();
        let at_ms = d.s.between(0, d.end_ms);
        let cancelled_ms = d.s.between(at_ms, d.end_ms + LEAST_WITHIN_MS);
        let is_cancelled = d.s.one_in(4);
        d.push(at_ms, Fault::AddTask { task });
        if is_cancelled {
            d.push(cancelled_ms, Fault::CancelTask { name });
        }
    }
}

/// A place, or now and then a line of two legs, that can be seen in the mission.
fn new_task(d: &mut Draw<'_>, n: u64) -> Option<NewTask> {
    let within = Bounds::around(&d.spec.mission.area_m());
    let size = within.max - within.min;
    (0..ZONE_TRIES).find_map(|_| {
        let place = |d: &mut Draw<'_>| {
            let (east, north) = (share(d.s, 0, 1400) - 0.2, share(d.s, 0, 1400) - 0.2);
            let at = within.min + Vector::new(size.x * east, size.y * north);
            (mm(at.x), mm(at.y))
        };
        let is_line = d.s.one_in(4);
        let places = (0..if is_line { 3 } else { 1 }).map(|_| place(d)).collect();
        let is_late = d.s.one_in(3);
        let within_ms = d.s.between(LEAST_WITHIN_MS, MOST_WITHIN_MS);
        let task = NewTask {
            name: Some(format!("task-{n}")),
            kind: if is_line {
                TaskKind::Line
            } else {
                TaskKind::Pinpoint
            },
            places,
            radius_mm: if is_line { 2_000 } else { 10_000 },
            worth: 100,
            within_ms: is_late.then(|| u32::try_from(within_ms).unwrap_or(u32::MAX)),
            sensor: 0,
        };
        let asked = task.asked(0, 1).ok()?;
        d.spec.mission.can_do(&asked).ok().map(|()| task)
    })
}

/// A number from 0 to 1, in thousandths.
fn share(s: &mut Stream, least_permille: u64, most_permille: u64) -> f64 {
    let drawn = s.between(least_permille, most_permille);
    f64::from(u16::try_from(drawn).unwrap_or(0)) / 1000.0
}

/// An area without what lies beyond some line, north and south or east and west.
fn part_of(d: &mut Draw<'_>, area: &[Point]) -> Vec<PointMm> {
    let mut kept = Bounds::around(area);
    let size = kept.max - kept.min;
    let side = d.s.between(0, 3);
    let off = size * share(d.s, LEAST_CUT_PERMILLE, MOST_CUT_PERMILLE);
    match side {
        0 => kept.min.x += off.x,
        1 => kept.max.x -= off.x,
        2 => kept.min.y += off.y,
        _ => kept.max.y -= off.y,
    }
    ring_mm(&clip(area, &kept))
}

/// An octagon somewhere in the box around an area, away from where UAVs start and land.
fn new_zone(d: &mut Draw<'_>, area: &[Point]) -> Option<Vec<PointMm>> {
    let within = Bounds::around(area);
    let size = within.max - within.min;
    let launches = d.spec.uavs.iter().map(|u| u.launch.position());
    let places: Vec<Point> = launches.chain([d.spec.mission.base_m()]).collect();
    let radius_m = share(d.s, 100, 400) * 100.0;
    let mut drawn = (0..ZONE_TRIES).map(|_| {
        let (east, north) = (share(d.s, 0, 1000), share(d.s, 0, 1000));
        within.min + Vector::new(size.x * east, size.y * north)
    });
    let is_clear = |c: &Point| {
        places
            .iter()
            .all(|p| (*c - *p).norm() > radius_m + ZONE_APART_M)
    };
    let centre = drawn.find(is_clear)?;
    let corner = |k: u8| {
        let (sin, cos) = sin_cos(f64::from(k) * PI / 4.0);
        centre + Vector::new(radius_m * cos, radius_m * sin)
    };
    Some(ring_mm(&(0..8).map(corner).collect::<Vec<_>>()))
}

/// Another number of UAVs: fewer, but enough for the work, or some more.
fn fleet(s: &mut Stream, spec: &mut Spec, makespan_ms: u64) {
    let there = spec.uavs.len();
    let longest_s = spec
        .uavs
        .iter()
        .map(|u| u.airframe.endurance_s - u.airframe.reserve_s);
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "casts from floats saturate"
    )]
    let longest_ms = longest_s.fold(f64::from(spec.max_time_s), f64::min) as u64 * 1000;
    let work_ms = makespan_ms * there as u64;
    let least = (work_ms * 3 / 2).div_ceil(longest_ms.max(1)).max(1);
    let n = s.between(least, u64::from(spec.storm.troubles.max_uavs).max(least));
    resize(spec, usize::try_from(n).unwrap_or(there));
}

/// Whether a crowd is more than the scenario has itself: a fifth of a hundred UAVs that fly all
/// that the hundred were to is none.
fn can_be_a_crowd(spec: &Spec) -> bool {
    let most = spec.storm.troubles.max_crowd;
    most > spec.storm.troubles.max_uavs && usize::from(most) > spec.uavs.len()
}

/// More UAVs than any other fleet has.
fn crowd(s: &mut Stream, spec: &mut Spec, _: u64) {
    let troubles = spec.storm.troubles;
    let n = s.between(u64::from(troubles.max_uavs) + 1, troubles.max_crowd.into());
    resize(spec, usize::try_from(n).unwrap_or(0));
}

/// The first UAVs, or all and some more like those that there are, above them.
fn resize(spec: &mut Spec, n: usize) {
    let there = spec.uavs.len();
    let top_m = spec.uavs.iter().map(|u| u.height_m).fold(0.0, f64::max);
    let taken: Vec<u16> = spec
        .uavs
        .iter()
        .map(|u| u.id)
        .chain(spec.ground.iter().map(|g| g.id))
        .collect();
    let more = (1..=u16::MAX).filter(|id| !taken.contains(id));
    let like = spec.uavs.clone();
    let at_own_heights = spec.mission.separation_mm == 0;
    let above_m = (1..).map(|k: u16| top_m + SLOT_M * f64::from(k));
    let more = more.zip(like.iter().cycle()).zip(above_m);
    let more = more.map(|((id, like), height_m)| UavSpec {
        id,
        height_m,
        // At one height no two begin at one place in the air.
        in_air: like.in_air && at_own_heights,
        ..like.clone()
    });
    let all: Vec<UavSpec> = like
        .iter()
        .cloned()
        .chain(more.take(n.saturating_sub(there)))
        .collect();
    spec.uavs = all.into_iter().take(n).collect();
    spec.uavs.sort_by_key(|u| u.id);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::swarm::stream::Concern;
    use crate::world::fixture;
    use std::collections::BTreeMap;

    /// The fixture with every kind.
    fn spec() -> Spec {
        let mut spec = fixture::square(8);
        spec.storm.troubles.max_clock_jump_ms = 60_000;
        spec
    }

    #[test]
    fn every_number_of_kinds_and_every_kind_is_drawn_as_often() {
        let spec = spec();
        let (mut numbers, mut kinds) = (BTreeMap::new(), BTreeMap::new());
        for seed in 0..2000 {
            let mut s = Stream::new(seed, Concern::Troubles);
            let kinds_drawn = choose(&mut s, &spec);
            let who: (&[u16], &[u16]) = (&[1, 2, 3, 100], &[1, 3]);
            let (struck, faults) = draw(&mut s, &kinds_drawn, &spec, who, 300_000);
            *numbers.entry(struck.len()).or_insert(0) += 1;
            for kind in &struck {
                *kinds.entry(kind.name).or_insert(0) += 1;
                assert!(kind.at_ms == 0 || faults.iter().any(|f| f.at_ms == kind.at_ms));
            }
        }
        assert_eq!(numbers.len(), 4);
        assert!(
            numbers.values().all(|n| (430..570).contains(n)),
            "{numbers:?}"
        );
        assert_eq!(kinds.len(), KINDS.len());
        let each = 2000 * 3 / 2 / KINDS.len();
        let about = |n: &usize| n.abs_diff(each) < each / 4;
        assert!(kinds.values().all(about), "{kinds:?} {each}");
    }

    #[test]
    fn fleets_have_every_size_that_can_do_the_work_and_ids_of_their_own() {
        let spec = spec();
        let mut sizes = std::collections::BTreeSet::new();
        for seed in 0..200 {
            let mut s = Stream::new(seed, Concern::Troubles);
            let mut other = spec.clone();
            // A run lasts 1800 s at most: two are needed for 2400 s of work and a half more.
            fleet(&mut s, &mut other, 300_000);
            let ids: Vec<u16> = other.uavs.iter().map(|u| u.id).collect();
            assert!(ids.windows(2).all(|w| w[0] < w[1]) && !ids.contains(&fixture::GROUND_ID));
            sizes.insert(ids.len());
        }
        let most = usize::from(spec.storm.troubles.max_uavs);
        assert_eq!(sizes, (2..=most).collect());
    }

    #[test]
    fn one_storm_in_twelve_is_a_crowd_and_all_others_stay_what_they_were() {
        let spec = spec();
        let limits = spec.storm.troubles;
        let mut sizes = std::collections::BTreeSet::new();
        let storms = 1200;
        let crowded = (0..storms).filter(|seed| {
            let mut rare = choose_rare(*seed, &spec);
            rare.retain(|k| k.name == "crowd");
            let mut s = Stream::new(*seed, Concern::Troubles);
            let (changed, _) = prepare(&mut s, &rare, &spec, 300_000);
            let n = u16::try_from(changed.uavs.len()).unwrap();
            if rare.is_empty() {
                assert_eq!(changed.uavs, spec.uavs);
            } else {
                assert!((limits.max_uavs + 1..=limits.max_crowd).contains(&n));
                sizes.insert(n);
            }
            !rare.is_empty()
        });
        let n = crowded.count();
        assert!((70..130).contains(&n), "{n}");
        assert!(sizes.len() > 12, "{sizes:?}");
    }

    #[test]
    fn a_swarm_that_is_more_than_a_crowd_is_not_thinned_to_one() {
        let mut spec = spec();
        let most = usize::from(spec.storm.troubles.max_crowd);
        for (n, can) in [(most - 1, true), (most, false), (100, false)] {
            resize(&mut spec, n);
            assert_eq!(can_be_a_crowd(&spec), can, "{n}");
        }
    }

    #[test]
    fn what_begins_also_ends_and_limits_are_kept() {
        let spec = spec();
        let limits = spec.storm.troubles;
        for kind in KINDS.iter().chain(RARE) {
            let How::Faults(draw) = kind.how else {
                continue;
            };
            let mut seen = 0;
            for seed in 0..200 {
                let mut s = Stream::new(seed, Concern::Troubles);
                let mut d = Draw {
                    s: &mut s,
                    spec: &spec,
                    peers: &[1, 2, 100],
                    survivors: &[1, 2],
                    end_ms: 300_000,
                    out: Vec::new(),
                };
                draw(&mut d);
                let mut open: BTreeMap<(&str, u16), i32> = BTreeMap::new();
                let mut count = |what, peer, n| *open.entry((what, peer)).or_default() += n;
                for f in &d.out {
                    match f.fault {
                        Fault::FailStores { peer, .. } => count("disk", peer, 1),
                        Fault::SlowStores { peer, delay_ms } => {
                            assert!(delay_ms <= limits.max_store_delay_ms);
                            count("disk", peer, 1);
                        }
                        Fault::HealStores { peer } => count("disk", peer, -1),
                        Fault::Pause { peer } => count("pause", peer, 1),
                        Fault::Resume { peer } => count("pause", peer, -1),
                        Fault::SlowComputer { peer, delay_ms } => {
                            assert!(delay_ms <= limits.max_computer_delay_ms);
                            count("slow", peer, if delay_ms > 0 { 1 } else { -1 });
                        }
                        Fault::ClockDrift { ppm, .. } => {
                            assert!(ppm.unsigned_abs() <= limits.max_clock_drift_ppm);
                        }
                        Fault::ClockJump { ahead_ms, .. } => {
                            assert!(ahead_ms <= limits.max_clock_jump_ms);
                        }
                        Fault::Cut { one_way, .. } => assert!(one_way),
                        Fault::Order { order, uav } => {
                            count(
                                "order",
                                uav.unwrap_or(0),
                                if order == Order::Resume { -1 } else { 1 },
                            );
                        }
                        Fault::KillComputer { peer } => count("down", peer, 1),
                        Fault::Restart { peer, .. } => count("down", peer, -1),
                        Fault::Heal => assert!(d.out[0].at_ms < f.at_ms),
                        Fault::SpoiltRecord { .. } => {}
                        Fault::Twin { peer, .. } => assert!((1..=8).contains(&peer)),
                        Fault::Revise {
                            ref area,
                            ref zones,
                            ..
                        } => {
                            let first = &spec.mission;
                            assert!(*area != first.area || *zones != first.zones);
                            assert!(area.len() > 2 && zones.len() <= first.zones.len() + 1);
                        }
                        Fault::AddZone { ref ring, .. } => assert!(ring.len() == 8),
                        Fault::RemoveZone { ref name } => {
                            let added = |f: &TimedFault| matches!(&f.fault, Fault::AddZone { name: n, .. } if n == name);
                            assert!(d.out.iter().any(|a| added(a) && a.at_ms <= f.at_ms));
                        }
                        Fault::ShortFuel { peer, lasts_ms } => {
                            assert!(peer != 1 && lasts_ms > 100_000);
                        }
                        Fault::AddTask { ref task } => {
                            let asked = task.asked(0, 1).unwrap();
                            assert!(spec.mission.can_do(&asked).is_ok());
                        }
                        Fault::CancelTask { ref name } => {
                            let asked = |f: &TimedFault| matches!(&f.fault, Fault::AddTask { task } if task.name.as_ref() == Some(name));
                            assert!(d.out.iter().any(|a| asked(a) && a.at_ms <= f.at_ms));
                        }
                        ref other => panic!("{other:?} is no such trouble"),
                    }
                }
                assert!(open.values().all(|n| *n == 0), "{}: {open:?}", kind.name);
                seen += d.out.len();
            }
            assert!(seen >= 200, "{}", kind.name);
        }
    }
}
