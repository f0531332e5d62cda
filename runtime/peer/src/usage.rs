//! How streets of a mission are used, as one peer has it (D2.7 §3.1: patterns of typical road
//! usage): what it sees in its own pictures, by its own tracks, and what others tell of theirs.
//!
//! | event | what follows |
//! |---|---|
//! | a look, a part of a stretch is in the inner part of the picture, no building that the mission tells before it, and nobody of a lower number has it in its own | that part is watched |
//! | a confirmed track is on a watched part | the time that it takes and the way that it drives are counted for its stretch, in the interval of the day |
//! | a track that was well on one stretch is well on another one, for 0.8 s without a break, and their crossing is in the picture | a turn |
//! | an interval is over, or so many beacon intervals passed since a register was told | it is told, if it grew |
//! | a usage of another | kept, of each author, life and register the one that says more |
//! | another life begins, other streets or another sortie | its own counts begin at nothing |
//!
//! Time and way are those of Edie's definitions over the places and times that were watched, so
//! density, flow and space-mean speed have no bias by what was looked at how often; as with
//! [`crate::counting`], of two UAVs above a place one counts, its clock too. A track that has just
//! begun seems to drive faster than it does, since errors of its velocity lengthen it on the
//! average; so what the surer ones say of the speed counts for more, and all time counts as time.
//!
//! # Guarantees
//! Registers merge in any order. Bounded. Without streets nothing is kept and nothing said.

use crate::Incarnation;
use crate::carried::carried;
use crate::counting::{GAP_MS, INNER};
use crate::effect::{Effect, Effects};
use crate::input::Time;
use crate::mission::Mission;
use crate::registers::{Grows, Registers};
use crate::sight::Sight;
use crate::streets::Streets;
use crate::wire::codec::Body;
use crate::wire::usage::{
    INTERVALS_MAX, MOST, STRETCHES_MAX, StretchUse, TURNS_MAX, TurnUse, Usage, interval_of,
    subject_of_stretch, subject_of_turn,
};
use skein_behaviors::Percept;
use skein_flight::airframe::Airframe;
use skein_flight::streets::{Network, Turn};
use skein_flight::tracking::buildings::Town;
use skein_flight::tracking::tracks::{TargetName, Track, Tracks};
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::hash::{Fnv, folded};
use skein_geometry::math::seconds;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

mod sums;
pub use sums::{StretchSum, Usages};

/// The speed of a track whose velocity is so sure, variance of both axes together, m²/s², counts for
/// a quarter of one that is exact; of one that has just been confirmed, for a thousandth.
const SURE_M2PS2: f64 = 4.0;

/// Slower than this is as good as still, m/s.
pub const STILL_MPS: f64 = 2.0;

/// And so is a speed whose square is larger by no more than this share of the variance of the
/// velocity: far below errors are as large as what vehicles drive in a jam.
const STILL_SHARE: f64 = 0.25;

/// A track that was not seen for longer is not where it is thought to be, milliseconds.
const UNSEEN_MS: u64 = 700;

/// Who is so far from both ends of a stretch is well on it, metres; on a short one at its middle.
const WELL_ON_M: f64 = 15.0;

/// Who is on a stretch for so long without a break is on it indeed, milliseconds: near a crossing
/// errors of places put a vehicle on one stretch and on the next one in turns.
const SURE_MS: u64 = 800;

/// Who was not well on any stretch for so long turned somewhere else, milliseconds.
const TURNED_MS: u64 = 30_000;

/// What grows on and on is told once in so many intervals, and turns in twice as many.
const TOLD_INTERVALS: u64 = 40;

/// So many UAVs say a register each in one interval; among more each waits so many times as long
/// as there are such many: at 64 kbit/s registers of 24 and what is passed on of them would take
/// more than the air has.
const UAVS_AN_INTERVAL: u64 = 8;

/// Most registers of others that are kept: all of forty authors and lives.
pub const KNOWN_MAX: usize = 2_560;

/// One of the own tracks beside the streets.
#[derive(Clone, Copy, Debug)]
struct Along {
    begun_ms: u64,
    /// The stretch that it is on, and since when without a break.
    stretch: Option<(u16, u64)>,
    /// The stretches and intervals in which it was counted last, the latest first.
    counted: [Option<(u16, u16)>; 3],
    /// The stretch on which it was well last, and when.
    well: Option<(u16, u64)>,
}

/// The own numbers of one stretch in one interval.
#[derive(Clone, Copy, Debug, Default)]
struct Own {
    watched_m_ms: f64,
    spent_ms: u64,
    stood_ms: u64,
    /// How far they drove, metres, and how long that took, seconds, each time by how much the speed
    /// of the track counts.
    driven_m: f64,
    weighed_s: f64,
    vehicles: u16,
}

/// The streets of the mission that is followed.
#[derive(Clone, Debug, Default)]
struct Followed {
    of: u32,
    streets: Arc<Streets>,
    network: Arc<Network>,
}

/// All that one peer knows of how streets are used.
#[derive(Debug, Default)]
pub(crate) struct Using {
    me: u16,
    life: Incarnation,
    followed: Option<Followed>,
    /// By interval and stretch.
    own: BTreeMap<(u16, u16), Own>,
    turns: BTreeMap<u16, u16>,
    tracks: BTreeMap<TargetName, Along>,
    /// Numbers of the places that are watched in the last look.
    watched: BTreeSet<usize>,
    last_ms: u64,
    /// Where others of lower numbers are.
    others: Vec<Pose>,
    told: BTreeMap<u16, (u64, Time)>,
    said_at: Time,
    known: Registers<Usage, KNOWN_MAX>,
}

impl Mission {
    /// Which streets of which sortie: usages of others are none of these.
    #[must_use]
    pub fn streets_hash(&self) -> u32 {
        let mut h = Fnv::new();
        h.write_i64(i64::from(self.sortie));
        if let Some(streets) = &self.streets {
            streets.hash_ways(&mut h);
        }
        folded(h.finish())
    }
}

impl Along {
    fn begun(t: &Track) -> Self {
        Self {
            begun_ms: t.begun_ms(),
            stretch: None,
            counted: [None; 3],
            well: None,
        }
    }
}

impl Grows for Usage {
    fn of(&self) -> u32 {
        self.streets
    }

    fn amount(&self) -> u64 {
        Self::amount(self)
    }
}

impl Using {
    /// Nothing is known.
    pub fn new(me: u16) -> Self {
        Self {
            me,
            ..Self::default()
        }
    }

    /// A life begins.
    pub fn begin_life(&mut self, life: Incarnation) {
        self.life = life;
        self.followed = None;
        self.clear_own();
    }

    fn clear_own(&mut self) {
        self.own.clear();
        self.turns.clear();
        self.tracks.clear();
        self.watched.clear();
        self.told.clear();
    }

    /// The streets of the mission.
    fn follow(&mut self, mission: &Mission) {
        let Some(streets) = mission.measured_streets() else {
            if self.followed.take().is_some() {
                self.clear_own();
            }
            return;
        };
        // A later lap shares the streets of the one before.
        let of = match &self.followed {
            Some(f) if Arc::ptr_eq(&f.streets, streets) => return,
            _ => mission.streets_hash(),
        };
        if self.followed.as_ref().is_some_and(|f| f.of == of) {
            if let Some(f) = &mut self.followed {
                f.streets = Arc::clone(streets);
            }
            return;
        }
        self.clear_own();
        self.followed = Some(Followed {
            of,
            streets: Arc::clone(streets),
            network: Arc::new(streets.network()),
        });
    }

    /// One look of the own camera; `counts` where this peer is to count at all.
    pub fn look(
        &mut self,
        percept: &Percept,
        airframe: &Airframe,
        tracks: &Tracks,
        (mission, town, counts): (&Mission, Option<&Town>, bool),
    ) {
        self.follow(mission);
        let now_ms = percept.time_ms;
        let apart_ms = now_ms.saturating_sub(self.last_ms);
        let apart_ms = if apart_ms > GAP_MS { 0 } else { apart_ms };
        self.last_ms = now_ms;
        self.watched.clear();
        let Some(followed) = self.followed.clone() else {
            return;
        };
        if !counts || percept.takes_off_in_ms > 0 {
            self.tracks.clear();
            return;
        }
        let interval = followed.streets.interval_at(now_ms);
        let net = &followed.network;
        let sight = Sight::of(percept, airframe, town);
        self.watch(sight, net, (interval, apart_ms));
        let mut before = core::mem::take(&mut self.tracks);
        for t in tracks.confirmed() {
            let known = carried(&mut before, |a: &Along| a.begun_ms, tracks, t);
            let mut along = known.unwrap_or_else(|| Along::begun(t));
            if now_ms.saturating_sub(t.seen_ms) <= UNSEEN_MS {
                self.step(&mut along, t, (net, sight), (interval, now_ms, apart_ms));
            }
            self.tracks.insert(t.name, along);
        }
    }

    /// Whether a place is this peer's to count at.
    fn is_own(&self, sight: Sight<'_>, at: Point) -> bool {
        let in_other = |other: &Pose| sight.of_other(*other).shows(at, INNER);
        sight.shows(at, INNER) && !self.others.iter().any(in_other)
    }

    fn watch(&mut self, sight: Sight<'_>, net: &Network, (interval, apart_ms): (u16, u64)) {
        let (across_m, along_m) = sight.view.reach_m(0.0);
        let reach_m = across_m + along_m;
        for (i, place) in net.places().iter().enumerate() {
            let is_near = (place.at - sight.view.from()).norm() <= reach_m;
            if !is_near || !self.is_own(sight, place.at) {
                continue;
            }
            self.watched.insert(i);
            let own = self.own.entry((interval, place.edge)).or_default();
            own.watched_m_ms += place.length_m * 1_000.0 * seconds(apart_ms);
        }
    }

    /// A track on a street.
    fn step(
        &mut self,
        along: &mut Along,
        t: &Track,
        (net, sight): (&Network, Sight<'_>),
        (interval, now_ms, apart_ms): (u16, u64, u64),
    ) {
        let velocity = t.estimate.velocity_mps();
        let still_m2ps2 = STILL_MPS * STILL_MPS + STILL_SHARE * variance_m2ps2(t);
        let stands = velocity.norm_squared() < still_m2ps2;
        let heading = if velocity.norm() < STILL_MPS {
            Vector::zeros()
        } else {
            velocity
        };
        let at = t.estimate.position();
        let was = along.stretch.take();
        let Some(m) = net.matched(at, heading, was.map(|(stretch, _)| stretch)) else {
            return;
        };
        let since_ms = was.filter(|(stretch, _)| *stretch == m.edge);
        let since_ms = since_ms.map_or(now_ms, |(_, since_ms)| since_ms);
        along.stretch = Some((m.edge, since_ms));
        let is_sure = now_ms.saturating_sub(since_ms) >= SURE_MS;
        let length_m = net.edges()[usize::from(m.edge)].length_m;
        let from_end_m = m.along_m.min(length_m - m.along_m);
        // A short stretch ends before anybody is fifteen metres from its ends.
        if !stands && is_sure && from_end_m >= WELL_ON_M.min(length_m / 4.0) {
            let was = along.well.filter(|(_, ms)| ms + TURNED_MS >= now_ms);
            if let Some((from, _)) = was.filter(|(from, _)| *from != m.edge) {
                self.turned(net, (from, m.edge), at, sight);
            }
            along.well = Some((m.edge, now_ms));
        }
        let place = net.place_along(m.edge, m.along_m);
        if !place.is_some_and(|p| self.watched.contains(&p)) {
            return;
        }
        let own = self.own.entry((interval, m.edge)).or_default();
        let on = Some((m.edge, interval));
        if !along.counted.contains(&on) {
            along.counted.rotate_right(1);
            along.counted[0] = on;
            own.vehicles = own.vehicles.saturating_add(1);
        }
        own.spent_ms += apart_ms;
        own.stood_ms += if stands { apart_ms } else { 0 };
        let weighed_s = weight(t) * seconds(apart_ms);
        own.weighed_s += weighed_s;
        // Of who stands, errors of its place to and fro are no way that was driven.
        own.driven_m += if stands {
            0.0
        } else {
            velocity.norm() * weighed_s
        };
    }

    /// One that was well on a stretch is well on another one.
    fn turned(&mut self, net: &Network, (from, to): (u16, u16), at: Point, sight: Sight<'_>) {
        let Some(over) = net.between((from, to), at) else {
            return;
        };
        let crossing = net.crossings()[usize::from(over)];
        let turn = net.turn(Turn { from, over, to });
        let turn = turn.and_then(|n| u16::try_from(n).ok());
        if let Some(turn) = turn.filter(|_| self.is_own(sight, crossing)) {
            let taken = self.turns.entry(turn).or_default();
            *taken = taken.saturating_add(1);
        }
    }

    /// Where others of lower numbers are now, if they flew straight on.
    pub fn heed(&mut self, others: Vec<Pose>) {
        self.others = others;
    }

    /// A register of its own as it is now.
    fn register(&self, subject: u16) -> Usage {
        let streets = self.followed.as_ref().map_or(0, |f| f.of);
        let of = |(key, own): (&(u16, u16), &Own)| {
            (subject_of_stretch(key.0, key.1) == subject).then(|| own.told(key.1))
        };
        let turn = |(turn, vehicles): (&u16, &u16)| {
            let (turn, vehicles) = (*turn, *vehicles);
            (subject_of_turn(turn) == subject).then_some(TurnUse { turn, vehicles })
        };
        Usage {
            streets,
            stretches: self.own.iter().filter_map(of).collect(),
            turns: self.turns.iter().filter_map(turn).collect(),
        }
    }

    /// What is to be told now: one register at a time, that which was told longest ago. With the
    /// interval of beacons in milliseconds, among so many UAVs that are believed alive.
    pub fn tell(&mut self, now: Time, (beacon_ms, uavs): (u64, u64), counts: bool) -> Effects {
        let mut effects = Effects::new();
        let interval_ms = beacon_ms * uavs.div_ceil(UAVS_AN_INTERVAL).max(1);
        let Some(followed) = &self.followed else {
            return effects;
        };
        if self.last_ms == 0 || now.since_ms(self.said_at) < interval_ms {
            return effects;
        }
        let current = followed.streets.interval_at(self.last_ms);
        let stretches = self.own.keys().map(|(i, s)| subject_of_stretch(*i, *s));
        let all: BTreeSet<u16> = stretches
            .chain(self.turns.keys().map(|t| subject_of_turn(*t)))
            .collect();
        let mut due: Option<(Time, u16, Usage)> = None;
        for subject in all {
            let (amount, at) = self.told.get(&subject).copied().unwrap_or_default();
            let of = interval_of(subject);
            let each = TOLD_INTERVALS * if of.is_none() { 2 } else { 1 };
            let is_over = !counts || of.is_some_and(|i| i < current);
            if !is_over && now.since_ms(at) < each * interval_ms
                || due.as_ref().is_some_and(|(least, ..)| *least <= at)
            {
                continue;
            }
            let own = self.register(subject);
            if own.amount() > amount {
                due = Some((at, subject, own));
            }
        }
        if let Some((_, subject, own)) = due {
            self.told.insert(subject, (own.amount(), now));
            self.said_at = now;
            self.known.told((subject, self.me, self.life), own.clone());
            effects.push(Effect::Speak(subject, Body::Usage(own)));
        }
        effects
    }

    /// What another tells.
    pub fn hear(&mut self, (author, life): (u16, Incarnation), subject: u16, usage: &Usage) {
        let key = (subject, author, life);
        if author == self.me && life == self.life {
            return;
        }
        let of = self.followed.as_ref().map_or(0, |f| f.of);
        self.known.hear(key, usage, of);
    }

    /// What all together saw, as far as is known here; none without streets to measure.
    pub fn sums(&self, mission: &Mission) -> Option<Usages> {
        let streets = mission.measured_streets()?;
        let of = mission.streets_hash();
        let network = match &self.followed {
            Some(f) if f.of == of => Arc::clone(&f.network),
            _ => Arc::new(streets.network()),
        };
        let mut sums = Usages::new(Arc::clone(streets), network);
        for (subject, _, usage) in self.known.of(of) {
            sums.add(subject, usage);
        }
        Some(sums)
    }

    /// What it saw itself, told or not; none without streets.
    pub fn own(&self) -> Option<Usages> {
        let f = self.followed.as_ref()?;
        let mut sums = Usages::new(Arc::clone(&f.streets), Arc::clone(&f.network));
        for ((interval, stretch), own) in &self.own {
            let usage = Usage {
                stretches: vec![own.told(*stretch)],
                ..Usage::default()
            };
            sums.add(subject_of_stretch(*interval, *stretch), &usage);
        }
        let turn = |(turn, vehicles): (&u16, &u16)| TurnUse {
            turn: *turn,
            vehicles: *vehicles,
        };
        let turns = Usage {
            turns: self.turns.iter().map(turn).collect(),
            ..Usage::default()
        };
        sums.add(subject_of_turn(0), &turns);
        Some(sums)
    }

    /// The places of the network that it watches in the percept of this time, by their numbers.
    pub fn watched(&self, percept_ms: u64) -> Option<&BTreeSet<usize>> {
        let looks = self.followed.is_some() && self.last_ms == percept_ms;
        looks.then_some(&self.watched)
    }

    /// How many registers are kept.
    pub fn len(&self) -> usize {
        self.known.len()
    }
}

impl Own {
    /// As it is told, in whole numbers: the way is that of all the time, by the speed as it counts.
    fn told(&self, stretch: u16) -> StretchUse {
        let ds = |ms: u64| u32::try_from(ms / 100).unwrap_or(MOST).min(MOST);
        let speed_mps = if self.weighed_s > 0.0 {
            self.driven_m / self.weighed_s
        } else {
            0.0
        };
        StretchUse {
            stretch,
            watched_m_s: whole(self.watched_m_ms / 1e3),
            spent_ds: ds(self.spent_ms),
            stood_ds: ds(self.stood_ms),
            driven_m: whole(speed_mps * seconds(self.spent_ms)),
            vehicles: self.vehicles,
        }
    }
}

/// The variance of a track's velocity, of both axes together.
fn variance_m2ps2(t: &Track) -> f64 {
    t.estimate.covariance[(2, 2)] + t.estimate.covariance[(3, 3)]
}

/// How much the speed of a track counts, from 0 to 1.
fn weight(t: &Track) -> f64 {
    let share = SURE_M2PS2 / (SURE_M2PS2 + variance_m2ps2(t));
    share * share
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a cast of a float saturates"
)]
fn whole(v: f64) -> u32 {
    (v.round() as u32).min(MOST)
}

// A register holds what its subject says, and no more.
const _: () = assert!(STRETCHES_MAX.is_multiple_of(16) && TURNS_MAX.is_multiple_of(32));
const _: () = assert!(INTERVALS_MAX > 1);

#[cfg(test)]
mod tests;
