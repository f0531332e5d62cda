//! Objects that a mission looks for as one peer knows them (D2.7 §3.7): what its own camera saw
//! for long enough, what was told, by itself and by others, and what of that is one object.
//!
//! | event | what follows |
//! |---|---|
//! | a look of the own camera | each of its own targets is watched: since when, from where on |
//! | one was watched for three seconds, with two hits in three looks, and fits a criterion | it is told, unless it is known |
//! | a detection of another | kept; told to people here |
//! | a later life of its author is heard, which knows nothing of it | it stands no more, if it is still to be followed: whoever sees that tells it anew |
//! | an own one turns out to be the object of one that was told before | it is withdrawn |
//!
//! Two that are seen at once by two who do not hear each other are told twice; who told the
//! later withdraws it once it hears of the other. Of two the one that was seen first stands,
//! of equal ones that of the lower author and number, so never both are withdrawn.
//!
//! # Guarantees
//! Bounded: eight told a life, 256 known. Nothing is drawn and nothing said here.

use crate::Incarnation;
use crate::carried::carried_alone;
use crate::criteria::looks_name;
use crate::mission::{mm, point_m};
use crate::wire::detection::{DETECTIONS_MAX, Detection, ERROR_MAX_MM, OF_LIFE_MAX, Stands};
use crate::wire::tasks::TaskId;
use skein_flight::tracking::tracks::{TargetName, Tracks};
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::seconds;
use std::collections::BTreeMap;

/// Who was watched for so long is beyond doubt, milliseconds: a false alarm comes to three looks
/// in a second at most.
const WATCHED_MS: u64 = 3_000;

/// And was seen in so many looks of them.
const HITS: u32 = 10;

/// Who was out of sight for so long is watched anew, milliseconds.
const GAP_MS: u64 = 2_000;

/// So many standard deviations are told as the error of a place: it is farther off once in
/// three thousand.
const ERRORS: f64 = 4.0;

/// Two places of one object differ by no more than their errors and this, metres: half the length
/// of a lorry, and what the watch of one who drives is late.
const SLACK_M: f64 = 15.0;

/// Whoever drives may drive so much faster than it did.
const FASTER: f64 = 1.5;

/// And is reckoned with so much at least, m/s: who stood may have set off slowly.
const SLOWEST_MPS: f64 = 3.0;

/// Who is told of twice at once is told within so long, milliseconds: a detection crosses a
/// component in less.
const AT_ONCE_MS: u64 = 15_000;

/// Who was seen by somebody so lately is where that one says, seconds.
const LATELY_S: f64 = 3.0;

/// How far from its follower's word an object may be, metres.
const FOLLOWED_M: f64 = 25.0;

/// Most detections that are kept.
pub const KNOWN_MAX: usize = 256;

/// How one of the own targets was watched.
#[derive(Clone, Copy, Debug)]
struct Watch {
    begun_ms: u64,
    /// Where it was when the watch began, and when that was.
    from: Point,
    from_ms: u64,
    hits: u32,
    last_ms: u64,
}

/// An object as this peer's own camera saw it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seen {
    pub name: TargetName,
    pub looks: u8,
    pub seen_ms: u64,
    pub at: Point,
    /// Its mean velocity over the watch.
    pub velocity_mps: Vector,
    pub error_m: f64,
}

/// Where somebody who follows an object says that it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    pub at: Point,
    pub unseen_s: f64,
}

impl Place {
    /// Whether somebody saw it lately.
    fn is_fresh(&self) -> bool {
        self.unseen_s <= LATELY_S
    }

    /// Whether two that were seen lately are one object.
    pub fn is_one_with(self, other: Self) -> bool {
        let are_fresh = self.is_fresh() && other.is_fresh();
        are_fresh && (self.at - other.at).norm() <= SLACK_M
    }
}

/// All that one peer knows of them.
#[derive(Debug, Default)]
pub(crate) struct Detections {
    life: Incarnation,
    told: u16,
    watches: BTreeMap<TargetName, Watch>,
    /// Each with the life of its author in which it was told.
    known: BTreeMap<TaskId, (Detection, Incarnation)>,
}

impl Detection {
    /// Where it was seen.
    #[must_use]
    pub fn at(&self) -> Point {
        point_m((self.east_mm, self.north_mm))
    }

    /// How it moved.
    #[must_use]
    pub fn velocity_mps(&self) -> Vector {
        Vector::new(f64::from(self.east_mmps), f64::from(self.north_mmps)) / 1e3
    }

    /// What was seen, where, how surely and when, for a person; `by` saw it.
    #[must_use]
    pub fn sentence(&self, by: u16) -> String {
        let metres = |mm: i32| f64::from(mm) / 1000.0;
        let what = looks_name(self.looks);
        if self.stands == Stands::Withdrawn {
            return format!("uav{by} withdraws the {what} that it saw: it was told before");
        }
        let speed_mps = self.velocity_mps().norm();
        format!(
            "uav{by} saw a {what} at ({:.1}, {:.1}) m ± {:.1} m, {speed_mps:.1} m/s, at {:.1} s of the clock of percepts",
            metres(self.east_mm),
            metres(self.north_mm),
            f64::from(self.error_mm) / 1000.0,
            seconds(self.seen_ms)
        )
    }

    fn name(&self) -> TargetName {
        TargetName {
            author: self.by,
            number: self.number,
        }
    }

    /// What it says, as if it were seen just so.
    fn seen(&self) -> Seen {
        Seen {
            name: self.name(),
            looks: self.looks,
            seen_ms: self.seen_ms,
            at: self.at(),
            velocity_mps: self.velocity_mps(),
            error_m: f64::from(self.error_mm) / 1000.0,
        }
    }
}

impl Seen {
    /// How fast it is, mm/s.
    pub fn speed_mmps(&self) -> u32 {
        mm(self.velocity_mps.norm()).unsigned_abs()
    }

    /// Whether it may be what was seen there, and may have gone on since.
    fn may_be(&self, other: &Self) -> bool {
        if self.name == other.name {
            return true;
        }
        if self.looks != other.looks {
            return false;
        }
        let slack_m = self.error_m + other.error_m + SLACK_M;
        let fastest_mps = self.velocity_mps.norm().max(other.velocity_mps.norm());
        let reach_m = if fastest_mps * 1e3 < f64::from(crate::criteria::STILL_MMPS) {
            0.0
        } else {
            let away_s = seconds(self.seen_ms.abs_diff(other.seen_ms));
            FASTER * fastest_mps.max(SLOWEST_MPS) * away_s
        };
        (self.at - other.at).norm() <= slack_m + reach_m
    }

    /// Whether it is where somebody who follows one says that this is.
    pub fn is_at(&self, place: Place) -> bool {
        let away_m = (self.at - place.at).norm();
        place.is_fresh() && away_m <= self.error_m + FOLLOWED_M
    }
}

impl Detections {
    /// A life begins.
    pub fn begin_life(&mut self, life: Incarnation) {
        self.life = life;
        self.told = 0;
        self.watches.clear();
    }

    /// Takes in which of its own targets the last look told.
    pub fn watch(&mut self, now_ms: u64, tracks: &Tracks) {
        let mut before = core::mem::take(&mut self.watches);
        for t in tracks.confirmed() {
            let at = t.estimate.position();
            let anew = Watch {
                begun_ms: t.begun_ms(),
                from: at,
                from_ms: now_ms,
                hits: 0,
                last_ms: now_ms,
            };
            let watch = carried_alone(&mut before, |w: &Watch| w.begun_ms, tracks, t);
            let is_on = |w: &Watch| now_ms.saturating_sub(w.last_ms) <= GAP_MS;
            // A watch begins with a look: where one who is out of sight may be is a guess.
            let begins = (t.seen_ms == now_ms).then_some(anew);
            let Some(mut watch) = watch.filter(is_on).or(begins) else {
                continue;
            };
            if t.seen_ms == now_ms {
                watch.hits = watch.hits.saturating_add(1);
                watch.last_ms = now_ms;
            }
            self.watches.insert(t.name, watch);
        }
    }

    /// What its own camera sees now, beyond doubt; places have an own error of `place_m`, metres,
    /// a standard deviation.
    pub fn seen<'a>(
        &'a self,
        now_ms: u64,
        tracks: &'a Tracks,
        place_m: f64,
    ) -> impl Iterator<Item = Seen> + 'a {
        let long = move |t: &&skein_flight::tracking::tracks::Track| {
            let watch = self.watches.get(&t.name);
            watch.is_some_and(|w| {
                w.hits >= HITS
                    && now_ms.saturating_sub(w.last_ms) < 1_000
                    && w.last_ms.saturating_sub(w.from_ms) >= WATCHED_MS
            })
        };
        tracks.confirmed().filter(long).map(move |t| {
            let watch = self.watches[&t.name];
            let at = t.estimate.position();
            let over_s = seconds(now_ms.saturating_sub(watch.from_ms)).max(1.0);
            Seen {
                name: t.name,
                looks: t.kind.0,
                seen_ms: t.estimate.time_ms,
                at,
                velocity_mps: (at - watch.from) / over_s,
                error_m: ERRORS * t.estimate.told(place_m).spread_m(),
            }
        })
    }

    /// What another, or this peer, tells; says whether that is news. Of more than are kept it is
    /// not.
    pub fn hear(&mut self, id: TaskId, told: Detection, life: Incarnation) -> bool {
        let held = self.known.get(&id);
        if held == Some(&(told, life)) || held.is_none() && self.known.len() >= KNOWN_MAX {
            return false;
        }
        self.known.insert(id, (told, life));
        true
    }

    /// All that count in a sortie.
    pub fn standing(&self, sortie: u16) -> impl Iterator<Item = (TaskId, &Detection)> {
        let all = self.known.iter();
        let all = all.filter(move |(_, (d, _))| d.stands == Stands::Told && d.sortie == sortie);
        all.map(|(id, (d, _))| (*id, d))
    }

    /// All that are known.
    pub fn known(&self) -> impl Iterator<Item = (TaskId, &Detection)> {
        self.known.iter().map(|(id, (d, _))| (*id, d))
    }

    /// What was told in a register.
    pub fn get(&self, id: TaskId) -> Option<&Detection> {
        self.known.get(&id).map(|(d, _)| d)
    }

    /// Those that were told in a life of their authors before the one of which is known now: their
    /// authors know nothing of them any more, and nobody passes them on.
    pub fn former(&self, life_of: &dyn Fn(u16) -> Option<Incarnation>) -> Vec<TaskId> {
        let all = self.known.iter();
        let former = all.filter(|(id, (d, life))| {
            let is_old = life_of(id.author).is_some_and(|now| now > *life);
            is_old && d.stands == Stands::Told
        });
        former.map(|(id, _)| *id).collect()
    }

    /// One does not stand any more, as far as this peer is concerned.
    pub fn void(&mut self, id: TaskId) {
        if let Some((d, _)) = self.known.get_mut(&id) {
            d.stands = Stands::Withdrawn;
        }
    }

    /// Whether what is seen was told: it may be the object of a detection, by where that was
    /// seen, or by where it is `followed` now.
    pub fn is_told(
        &self,
        sortie: u16,
        seen: &Seen,
        followed: &dyn Fn(TaskId) -> Option<Place>,
    ) -> bool {
        self.standing(sortie).any(|(id, d)| {
            let now = followed(id).filter(Place::is_fresh);
            match now {
                Some(place) => seen.name == d.name() || seen.is_at(place),
                None => seen.may_be(&d.seen()),
            }
        })
    }

    /// How many of a criterion were told.
    pub fn count(&self, sortie: u16, criterion: u8) -> usize {
        let of_it = self.standing(sortie);
        of_it.filter(|(_, d)| d.criterion == criterion).count()
    }

    /// One more of this peer's own, with its register; none where it told of too many in this
    /// life.
    pub fn tell(
        &mut self,
        me: u16,
        (sortie, criterion): (u16, u8),
        seen: &Seen,
    ) -> Option<(TaskId, Detection)> {
        if self.told >= OF_LIFE_MAX {
            return None;
        }
        let nth = u64::from(self.life) * u64::from(OF_LIFE_MAX) + u64::from(self.told);
        let id = TaskId {
            author: me,
            number: u16::try_from(nth % u64::from(DETECTIONS_MAX)).unwrap_or(0),
        };
        let told = Detection {
            stands: Stands::Told,
            sortie,
            criterion,
            by: seen.name.author,
            number: seen.name.number,
            looks: seen.looks,
            seen_ms: seen.seen_ms,
            east_mm: mm(seen.at.x),
            north_mm: mm(seen.at.y),
            error_mm: mm(seen.error_m).unsigned_abs().min(ERROR_MAX_MM),
            east_mmps: mm(seen.velocity_mps.x),
            north_mmps: mm(seen.velocity_mps.y),
        };
        if !self.hear(id, told, self.life) {
            return None;
        }
        self.told += 1;
        Some((id, told))
    }

    /// Those of this peer's own that are the object of an earlier one: they no longer stand.
    pub fn withdraw(
        &mut self,
        me: u16,
        followed: &dyn Fn(TaskId) -> Option<Place>,
    ) -> Vec<(TaskId, Detection)> {
        let own = self.known.iter();
        let own = own.filter(|(id, (d, _))| id.author == me && d.stands == Stands::Told);
        let doubles: Vec<TaskId> = own
            .filter(|(id, (d, _))| self.is_double(**id, d, followed))
            .map(|(id, _)| *id)
            .collect();
        let mut withdrawn = Vec::new();
        for id in doubles {
            if let Some((d, _)) = self.known.get_mut(&id) {
                d.stands = Stands::Withdrawn;
                withdrawn.push((id, *d));
            }
        }
        withdrawn
    }

    /// Whether one is the object of another that goes before it.
    fn is_double(
        &self,
        id: TaskId,
        own: &Detection,
        followed: &dyn Fn(TaskId) -> Option<Place>,
    ) -> bool {
        self.standing(own.sortie).any(|(other, d)| {
            let goes_before = (d.seen_ms, other) < (own.seen_ms, id);
            goes_before && is_one((id, own), (other, d), followed)
        })
    }

    /// Which of two detections goes before, where both are known.
    pub fn goes_before(&self, a: TaskId, b: TaskId) -> bool {
        match (self.known.get(&a), self.known.get(&b)) {
            (Some((first, _)), Some((second, _))) => (first.seen_ms, a) < (second.seen_ms, b),
            // What an operator asks for goes before what was seen.
            (None, Some(_)) => true,
            (Some(_), None) => false,
            (None, None) => a < b,
        }
    }
}

/// Whether two detections are of one object, as far as can be told now.
fn is_one(
    (a_id, a): (TaskId, &Detection),
    (b_id, b): (TaskId, &Detection),
    followed: &dyn Fn(TaskId) -> Option<Place>,
) -> bool {
    if a.name() == b.name() {
        return true;
    }
    let lately = |id| followed(id).filter(Place::is_fresh);
    if let (Some(p), Some(q)) = (lately(a_id), lately(b_id)) {
        return a.looks == b.looks && p.is_one_with(q);
    }
    let still = |d: &Detection| {
        let mmps = d.velocity_mps().norm() * 1e3;
        mmps < f64::from(crate::criteria::STILL_MMPS)
    };
    let at_once = a.seen_ms.abs_diff(b.seen_ms) <= AT_ONCE_MS;
    (at_once || still(a) && still(b)) && a.seen().may_be(&b.seen())
}

#[cfg(test)]
mod tests;
