//! What a peer knows of vehicles on the ground (D2.7 §3.7): tracks from its own sightings,
//! what others tell of theirs, and which of them is followed for which task.
//!
//! | event | what follows |
//! |---|---|
//! | a look of the own camera | tracks are begun, kept or dropped; what is confirmed is put on the board |
//! | a register of another | put on the board, if it is newer and of about now; if it is followed for a task, the task is bound to it |
//! | a register of another, where there is no camera | of the task that it is followed for it is kept: services on the ground are called there |
//! | an interval passes, while a task to follow is open | what was seen since is told: two registers at most, that which is followed first |
//! | whom a task is bound to is not seen for a while, and another is seen where it may be | the task is bound to that |
//! | a task is followed for the first time | it is bound to what is seen nearest to its place |
//!
//! Times are those of percepts (satellite navigation in the air, scenario time in a trial): no
//! two peers have one clock, but all are in one world.
//!
//! # Guarantees
//! Registers merge in any order: of each author and target the newest counts. All that is kept
//! is bounded. Without sightings nothing is said, and without a camera nothing is joined.

mod search;

use crate::Incarnation;
use crate::effect::Effect;
use crate::input::Time;
use crate::mission::{mm, point_m};
use crate::sight::Sight;
use crate::wire::codec::Body;
use crate::wire::target::{SPREAD_MAX_E3, TARGETS_MAX, Target};
use crate::wire::tasks::TaskId;
use search::{Search, WAYS_MAX};
use skein_behaviors::Percept;
use skein_flight::airframe::Airframe;
use skein_flight::tracking::buildings::Town;
use skein_flight::tracking::estimate::{Detection, Estimate};
use skein_flight::tracking::follower::TargetMotion;
use skein_flight::tracking::fusion::{Board, Fused, Register};
use skein_flight::tracking::told::Spread;
use skein_flight::tracking::tracks::{Kind, Sighting, TargetName, Tracks};
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::seconds;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Density of the acceleration of targets, m²/s³: a car that brakes or turns off at 2.5 m/s²
/// for some three seconds, a quarter of the time.
const DENSITY: f64 = 5.0;

/// A UAV's own place is off by this for a whole flight, a standard deviation in metres:
/// satellite navigation without corrections.
pub(crate) const PLACE_M: f64 = 2.0;

/// What was told of a target is fused for so long, milliseconds.
const TOLD_MS: u64 = 8_000;

/// What comes from later than this belongs to no clock of percepts, milliseconds.
const AHEAD_MS: u64 = 2_000;

/// The outermost part of a picture does not count as looked at, as a share: who is at its edge
/// may be beyond it.
const INNER: f64 = 0.85;

/// What was seen for less long may be a false alarm, and is not told, milliseconds.
const WATCHED_MS: u64 = 2_000;

/// A target is seen when so many looks within so long, milliseconds, told it: a false alarm may be
/// taken for one that is out of sight, three within ten looks are hardly ever.
const HITS: usize = 3;
const HITS_MS: u64 = 2_000;

/// A task is bound to nothing farther from its place than this, metres, and so much more for
/// each second since it was asked for; and never farther than that.
const FOUND_M: f64 = 150.0;
const FOUND_MPS: f64 = 10.0;
const FOUND_MOST_M: f64 = 600.0;

/// Nobody saw a target for so long: another one where it may be is taken for it, seconds.
const LOST_S: f64 = 2.5;

/// How far it may have strayed from where it should be: at once, metres, and with time, m/s.
const STRAYS_M: f64 = 40.0;
const STRAYS_MPS: f64 = 10.0;

/// And at most, metres.
const STRAYS_MOST_M: f64 = 250.0;

/// After so long without sight it may be anywhere, seconds.
const ANYWHERE_S: f64 = 60.0;

/// Nobody saw it for so long: whoever follows looks for it, seconds.
const SEARCH_S: f64 = 4.0;

/// Names that a UAV gives in one life before it comes to those of the next: one a second for
/// an hour and more.
const NAMES_OF_LIFE: u32 = 4_096;

/// Registers that are said in an interval.
const SAID: usize = 2;

/// Tasks whose targets are kept in mind.
const BOUND_MAX: usize = 32;

/// What was heard of a target is driven on for so long, seconds.
const DRIVEN_ON_S: f64 = 5.0;

/// A task in a revision.
pub(crate) type Sought = (TaskId, u32);

/// Whom a task is bound to.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bound {
    name: TargetName,
    /// What was known of it last, by all together.
    last: Fused,
    /// Who said so, and of when that is: the latest counts.
    said: (u64, u16),
}

/// What is known of whom a task is bound to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Followed {
    /// Where it probably is now, and how it moves.
    pub motion: TargetMotion,
    /// For how long nobody has seen it, seconds.
    pub unseen_s: f64,
}

/// Vehicles as one peer knows them.
#[derive(Debug)]
pub(crate) struct Targets {
    me: u16,
    flies: Option<Airframe>,
    tracks: Tracks,
    board: Board,
    bound: BTreeMap<Sought, Bound>,
    /// Without a camera, what was heard last of whom a task is to follow, and when.
    heard: BTreeMap<Sought, (Time, Target)>,
    /// When each of its own targets was in the last looks that told it, the latest last.
    hits: BTreeMap<TargetName, [u64; HITS]>,
    /// The time of the last percept, milliseconds.
    now_ms: u64,
    /// Which of the registers is of which target, the first of what is followed.
    subjects: [Option<TargetName>; TARGETS_MAX as usize],
    /// What was said of when.
    said: BTreeMap<TargetName, u64>,
    said_at: Time,
    /// Whom it looks for.
    search: Option<Search>,
    /// Squares of [`WAY_M`] where vehicles were seen to drive, by whomever: where
    /// the mission tells no streets, these are what is known of them.
    ways: BTreeSet<(i16, i16)>,
    /// Buildings and streets, where the mission tells them.
    town: Option<Arc<Town>>,
}

impl Targets {
    /// Nothing is known.
    pub fn new(me: u16, flies: Option<Airframe>) -> Self {
        Self {
            me,
            flies,
            tracks: Tracks::new(me, DENSITY),
            board: Board::default(),
            bound: BTreeMap::new(),
            heard: BTreeMap::new(),
            hits: BTreeMap::new(),
            now_ms: 0,
            subjects: [None; TARGETS_MAX as usize],
            said: BTreeMap::new(),
            said_at: Time(0),
            search: None,
            ways: BTreeSet::new(),
            town: None,
        }
    }

    /// What the mission tells of buildings and streets.
    pub fn knows(&mut self, town: Option<&Arc<Town>>) {
        self.town = town.cloned();
    }

    /// A life begins: what it names from now on nobody has named, and what it saw it sees anew.
    pub fn begin_life(&mut self, incarnation: Incarnation) {
        let first = incarnation.wrapping_mul(NAMES_OF_LIFE);
        self.tracks = Tracks::new(self.me, DENSITY).named_from(first);
        self.hits.clear();
        self.said.clear();
        self.search = None;
    }

    /// Takes in a look.
    pub fn on_percept(&mut self, percept: &Percept) {
        let Some(airframe) = self.flies.filter(|_| !percept.sightings.is_absent()) else {
            return;
        };
        self.now_ms = percept.time_ms;
        let look: Vec<Sighting> = percept.sightings.seen().map(sighting).collect();
        let town = self.town.clone();
        let sight = Sight::of(percept, &airframe, town.as_deref());
        let in_view = |p: Point| sight.shows(p, INNER);
        self.tracks.look(self.now_ms, &look, &in_view);
        self.count_hits();
        let own: Vec<Register> = self.own().collect();
        for mut r in own {
            let before = r.name;
            if self.board.is_contradicted(&r, DENSITY) {
                r.name = self.tracks.name_anew(r.name);
            }
            let name = self.board.name_of(&r, DENSITY);
            if self.tracks.rename(r.name, name) {
                r.name = name;
            }
            // What it follows it follows under its new name.
            if r.name != before
                && let Some(hits) = self.hits.remove(&before)
            {
                self.hits.insert(r.name, hits);
            }
            if r.name != before && r.name == name {
                let renamed = self.bound.values_mut().filter(|b| b.name == before);
                renamed.for_each(|b| b.name = name);
            }
            self.board.put(r);
        }
        self.board.forget(self.now_ms.saturating_sub(TOLD_MS));
        self.learn_ways();
        self.said
            .retain(|_, seen_ms| *seen_ms + TOLD_MS >= self.now_ms);
        self.keep_in_mind();
    }

    /// Notes which of its own targets the last look told.
    fn count_hits(&mut self) {
        let mut hits = core::mem::take(&mut self.hits);
        for t in self.tracks.all() {
            let mut last = hits.remove(&t.name).unwrap_or_default();
            if t.seen_ms == self.now_ms {
                last.rotate_left(1);
                last[HITS - 1] = self.now_ms;
            }
            self.hits.insert(t.name, last);
        }
    }

    /// When one of its own targets was seen last beyond doubt, milliseconds.
    fn sure_ms(&self, name: TargetName) -> Option<u64> {
        let hits = self.hits.get(&name)?;
        let (first, last) = (hits[0], hits[HITS - 1]);
        (first > 0 && last - first <= HITS_MS).then_some(last)
    }

    /// Its own targets that it sees, as they are told.
    fn own(&self) -> impl Iterator<Item = Register> {
        let sure = self.tracks.confirmed();
        let sure = sure.filter(|t| {
            let is_seen = self.sure_ms(t.name) == Some(t.seen_ms);
            is_seen && t.watched_ms() >= WATCHED_MS
        });
        sure.map(|t| Register {
            author: self.me,
            name: t.name,
            kind: t.kind,
            seen_ms: t.seen_ms,
            estimate: t.estimate.told(PLACE_M),
        })
    }

    /// What all know together of whom tasks are bound to is kept, so that who comes later finds
    /// it where it was seen last.
    fn keep_in_mind(&mut self) {
        if self.bound.is_empty() {
            return;
        }
        let fused = self.board.fused(self.now_ms, DENSITY);
        for bound in self.bound.values_mut() {
            let same = fused.iter().find(|f| f.name == bound.name);
            if let Some(f) = same.filter(|f| f.seen_ms >= bound.last.seen_ms) {
                bound.last = *f;
                continue;
            }
            let unseen_s = bound.last.unseen_s(self.now_ms);
            if unseen_s < LOST_S {
                continue;
            }
            let expected = bound.last.expected(self.now_ms, DENSITY);
            let strays_m = if unseen_s > ANYWHERE_S {
                f64::INFINITY
            } else {
                (STRAYS_M + STRAYS_MPS * unseen_s).min(STRAYS_MOST_M)
            };
            let away_m = |f: &Fused| (f.estimate.position() - expected).norm();
            let may_be = |f: &&Fused| {
                f.kind == bound.last.kind
                    && f.seen_ms > bound.last.seen_ms
                    && f.unseen_s(self.now_ms) < LOST_S
                    && away_m(f) <= strays_m
            };
            let found = fused.iter().filter(may_be);
            if let Some(f) = found.min_by(|a, b| away_m(a).total_cmp(&away_m(b))) {
                (bound.name, bound.last) = (f.name, *f);
            }
        }
    }

    /// What another UAV tells.
    pub fn hear(&mut self, now: Time, author: u16, told: &Target) {
        if self.flies.is_none() {
            return self.hear_without_camera(now, author, told);
        }
        let is_now = told.seen_ms <= self.now_ms + AHEAD_MS;
        let is_old = told.seen_ms + 60_000 < self.now_ms;
        if self.now_ms == 0 || author == self.me || !is_now || is_old {
            return;
        }
        let register = register_of(author, told);
        let is_news = self.board.put(register);
        if !is_news || told.task_by == 0 {
            return;
        }
        let sought = sought_of(told);
        let said = (told.seen_ms, author);
        let last = Fused {
            name: register.name,
            kind: register.kind,
            estimate: register.estimate,
            seen_ms: register.seen_ms,
            authors: 1,
        };
        let before = self.bound.get(&sought);
        if before.is_none_or(|b| b.said < said) {
            // What all know together is better than what one says, where both are of one.
            let last = before.map_or(last, |b| {
                let same = b.name == last.name && b.last.seen_ms >= last.seen_ms;
                if same { b.last } else { last }
            });
            self.bind(
                sought,
                Bound {
                    name: register.name,
                    last,
                    said,
                },
            );
        }
    }

    /// Who has no camera has no clock of percepts to join what was told by: of each task what it
    /// heard last counts.
    fn hear_without_camera(&mut self, now: Time, author: u16, told: &Target) {
        if author == self.me || told.task_by == 0 {
            return;
        }
        let sought = sought_of(told);
        if self.heard.len() >= BOUND_MAX && !self.heard.contains_key(&sought) {
            let oldest = self.heard.iter().min_by_key(|(_, (at, _))| *at);
            if let Some(oldest) = oldest.map(|(k, _)| *k) {
                self.heard.remove(&oldest);
            }
        }
        self.heard.insert(sought, (now, *told));
    }

    /// Where whoever follows for a task was heard to have it, driven on for a few seconds: as a
    /// peer without a camera knows it.
    pub fn heard_at(&self, now: Time, sought: Sought) -> Option<Point> {
        let (at, told) = self.heard.get(&sought)?;
        let r = register_of(0, told);
        let late_s = seconds(now.since_ms(*at)).min(DRIVEN_ON_S);
        Some(r.estimate.position() + r.estimate.velocity_mps() * late_s)
    }

    fn bind(&mut self, sought: Sought, bound: Bound) {
        if self.bound.len() >= BOUND_MAX && !self.bound.contains_key(&sought) {
            let oldest = self.bound.iter().min_by_key(|(_, b)| b.last.seen_ms);
            if let Some(oldest) = oldest.map(|(k, _)| *k) {
                self.bound.remove(&oldest);
            }
        }
        self.bound.insert(sought, bound);
    }

    /// Whom one task was bound to goes by another from now on, unless that is bound already.
    pub fn goes_by(&mut self, before: Sought, task: Sought) {
        if let Some(bound) = self.bound.remove(&before)
            && !self.bound.contains_key(&task)
        {
            self.bind(task, bound);
        }
    }

    /// What is known of whom a task is bound to, asked for so many seconds ago; bound to what is seen nearest to its place, if
    /// it is bound to nothing yet.
    pub fn follow(&mut self, sought: Sought, place: Point, asked_s: f64) -> Option<Followed> {
        if !self.bound.contains_key(&sought) {
            let found_m = (FOUND_M + FOUND_MPS * asked_s).min(FOUND_MOST_M);
            let away_m = |f: &Fused| (f.estimate.position() - place).norm();
            let fused = self.board.fused(self.now_ms, DENSITY);
            let near = fused.into_iter().filter(|f| away_m(f) <= found_m);
            let found = near.min_by(|a, b| away_m(a).total_cmp(&away_m(b)))?;
            let said = (found.seen_ms, self.me);
            let bound = Bound {
                name: found.name,
                last: found,
                said,
            };
            self.bind(sought, bound);
        }
        self.known(sought)
    }

    /// What is known of whom a task is bound to, if it is.
    pub fn known(&self, sought: Sought) -> Option<Followed> {
        let bound = self.bound.get(&sought)?;
        Some(Followed {
            motion: bound.last.motion(self.now_ms, DENSITY),
            unseen_s: bound.last.unseen_s(self.now_ms),
        })
    }

    /// How long ago this UAV itself saw whom a task is bound to, milliseconds; none where it
    /// does not know it by its own eyes.
    pub fn unseen_ms(&self, sought: Sought) -> Option<u64> {
        let name = self.bound.get(&sought)?.name;
        let mut own = self.tracks.confirmed().filter(|t| t.name == name);
        let seen_ms = own.find_map(|t| self.sure_ms(t.name));
        Some(self.now_ms.saturating_sub(seen_ms?))
    }

    /// Registers to be said now: `serves` is the task that is flown.
    pub fn tell(&mut self, now: Time, interval_ms: u64, serves: Option<Sought>) -> Vec<Effect> {
        if now.since_ms(self.said_at) < interval_ms {
            return Vec::new();
        }
        let followed = serves.and_then(|s| Some((s, self.bound.get(&s)?.name)));
        let is_news = |r: &Register| self.said.get(&r.name).is_none_or(|ms| *ms < r.seen_ms);
        let mut news: Vec<Register> = self.own().filter(is_news).collect();
        // That which is followed first, then what was told longest ago.
        news.sort_by_key(|r| {
            let is_followed = followed.is_some_and(|(_, name)| name == r.name);
            (!is_followed, self.said.get(&r.name).copied(), r.name)
        });
        news.truncate(SAID);
        if news.is_empty() {
            return Vec::new();
        }
        self.said_at = now;
        let mut effects = Vec::new();
        for r in news {
            let serves = followed.filter(|(_, name)| *name == r.name).map(|(s, _)| s);
            self.said.insert(r.name, r.seen_ms);
            if let Some(sought) = serves
                && let Some(bound) = self.bound.get_mut(&sought)
            {
                bound.said = bound.said.max((r.seen_ms, self.me));
            }
            let subject = self.subject_of(r.name, serves.is_some());
            effects.push(Effect::Speak(subject, Body::Target(told(&r, serves))));
        }
        effects
    }

    /// Under which subject a target is told: the first is that which is followed.
    fn subject_of(&mut self, name: TargetName, is_followed: bool) -> u16 {
        if is_followed {
            self.subjects[0] = Some(name);
            return 0;
        }
        let others = 1..self.subjects.len();
        let has = |i: &usize| self.subjects[*i] == Some(name);
        let at = others.clone().find(has).or_else(|| {
            let oldest = |i: &usize| self.subjects[*i].and_then(|n| self.said.get(&n).copied());
            others.min_by_key(oldest)
        });
        let at = at.unwrap_or(1);
        self.subjects[at] = Some(name);
        u16::try_from(at).unwrap_or(1)
    }

    /// Its own targets, and the time of the last percept, milliseconds.
    pub fn tracks(&self) -> (&Tracks, u64) {
        (&self.tracks, self.now_ms)
    }

    /// How many registers and tasks are kept, with their caps.
    pub fn loads(&self) -> [(&'static str, usize, usize); 3] {
        [
            (
                "targets",
                self.board.registers().count(),
                skein_flight::tracking::fusion::MOST_REGISTERS,
            ),
            ("followed", self.bound.len(), BOUND_MAX),
            ("ways", self.ways.len(), WAYS_MAX),
        ]
    }
}

impl Followed {
    /// Nothing is known but a place.
    #[must_use]
    pub fn nowhere(place: Point) -> Self {
        Self {
            motion: standing(place),
            unseen_s: f64::INFINITY,
        }
    }

    /// Whether whoever follows looks for it.
    #[must_use]
    pub fn is_lost(&self) -> bool {
        self.unseen_s > SEARCH_S
    }
}

/// Which task somebody follows for who told of a target.
fn sought_of(told: &Target) -> Sought {
    let task = TaskId {
        author: told.task_by,
        number: told.task,
    };
    (task, told.revision)
}

/// A target that stands.
pub(crate) fn standing(position: Point) -> TargetMotion {
    TargetMotion {
        position,
        velocity_mps: Vector::zeros(),
        acceleration_mps2: Vector::zeros(),
    }
}

fn sighting(s: &skein_behaviors::sightings::Sighted) -> Sighting {
    // What claims to be exact is not.
    let spread_m = (f64::from(s.spread_mm) / 1000.0).max(0.05);
    Sighting {
        detection: Detection::round(s.at(), spread_m),
        kind: Kind(s.kind),
    }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a cast of a float saturates"
)]
fn spread_e3(value: f64) -> u32 {
    // Rounding what both have in common takes half a thousandth.
    ((value * 1e3).ceil() as u32)
        .saturating_add(1)
        .clamp(1, SPREAD_MAX_E3)
}

/// What is said of a target.
fn told(r: &Register, serves: Option<Sought>) -> Target {
    let spread = r.estimate.spread();
    #[allow(
        clippy::cast_possible_truncation,
        reason = "a cast of a float saturates"
    )]
    let both_e3 = (spread.both * 1e3).round() as i32;
    let (velocity, at) = (r.estimate.velocity_mps(), r.estimate.position());
    let (task, revision) = serves.unwrap_or_default();
    let aged_ms = r.estimate.time_ms.saturating_sub(r.seen_ms);
    Target {
        by: r.name.author,
        number: r.name.number,
        looks: r.kind.0,
        seen_ms: r.seen_ms,
        aged_ms: u16::try_from(aged_ms).unwrap_or(u16::MAX),
        east_mm: mm(at.x),
        north_mm: mm(at.y),
        east_mmps: mm(velocity.x),
        north_mmps: mm(velocity.y),
        place_e3: spread_e3(spread.place_m2),
        both_e3,
        speed_e3: spread_e3(spread.speed),
        task_by: task.author,
        task: task.number,
        revision,
    }
}

/// What a register of another says.
fn register_of(author: u16, t: &Target) -> Register {
    let metres = |mm: i32| f64::from(mm) / 1000.0;
    let spread = Spread {
        place_m2: f64::from(t.place_e3) / 1e3,
        both: f64::from(t.both_e3) / 1e3,
        speed: f64::from(t.speed_e3) / 1e3,
    };
    Register {
        author,
        name: TargetName {
            author: t.by,
            number: t.number,
        },
        kind: Kind(t.looks),
        seen_ms: t.seen_ms,
        estimate: Estimate::round(
            t.seen_ms + u64::from(t.aged_ms),
            point_m((t.east_mm, t.north_mm)),
            Vector::new(metres(t.east_mmps), metres(t.north_mmps)),
            spread,
        ),
    }
}

#[cfg(test)]
mod tests;
