//! Who is there: one-hop heartbeats, gossiped with their ages, suspicion, and
//! a bound that holds at any loss.
//!
//! Carries out the fault detection of D2.7 §3.6: who is lost is found without a
//! leader, and everybody in a component knows within one bound. With the interval I
//! that an author announced with its heartbeat, the longest interval T' that anybody alive
//! announced (a period T at least), and the hop diameter D, k1 = 4 + D/4 and k2 = 4 + D/2:
//!
//! | state | event | next state |
//! |---|---|---|
//! | unknown | a heartbeat younger than the bound, not condemned | alive or suspect |
//! | unknown | a heartbeat older than the bound, or condemned | down: its records are asked for |
//! | unknown, or an earlier life | a record of it is held for longer than the bound, and no heartbeat came | down, in that life: gossip tells of it |
//! | alive | its freshest heartbeat was heard directly, k1 I ago | suspect |
//! | alive | half of that, and the transport says that the link is gone | suspect |
//! | alive | a suspicion against this very heartbeat is heard | suspect |
//! | any | a fresher heartbeat from anybody, younger than the bound | alive; suspect if a suspicion against it is told with it |
//! | suspect | k2 T' + (D - 1) T'/2 + k1 (T' - I) unrefuted, (D - 1) T' where T' is longer than T | down |
//! | alive, suspect | heartbeat older than (k1 + k2 + D + 2) T' | down |
//! | any | a heartbeat of a later life, younger than the bound | likewise, in that life |
//! | any | a heartbeat of a later life, older than the bound | down, in that life |
//! | alive | an old heartbeat of the same life with a higher count | alive; gossip says it, until its author takes a new life |
//! | any | its author itself says a lower count of this life than one that was sent more than 2 T' before | as before; gossip says the higher one, until its author takes a new life |
//!
//! Ages are sums of holding times, never differences of clocks, and they count
//! wherever a heartbeat is heard: so one that travelled long is known to be old, and
//! a merging component cannot raise the dead. What follows from a verdict is left to
//! the callers; here it revokes nothing.

mod at_once;
mod extent;
mod known;
#[cfg(test)]
pub(crate) mod many_detectors;
mod questions;
mod telling;
#[cfg(test)]
mod tests;

use super::airtime::ms_of;
use super::life::LIFE_STEP;
use crate::Incarnation;
use crate::input::Time;
use crate::output::Status;
use crate::peer::CADENCE;
use crate::wire::limits::INTERVAL_LEAST;
use crate::wire::limits::{HOPS_MAX, PEERS_MAX};
use crate::wire::message::{Beacon, Fresh, Gossip, OffLoop};
use core::cell::Cell;
use extent::{Extent, Patience, window_ms};
use known::{Age, HeardHeartbeat, Known, Weight};
use questions::Questions;
use std::collections::{BTreeMap, BTreeSet};
use telling::{Moment, Telling};

/// Most other peers known: the largest fleet but this peer itself. A flood of made-up ids
/// must end somewhere.
pub const MAX_KNOWN: usize = PEERS_MAX - 1;

/// What was not told of within so many intervals is no news any more.
const URGENT_INTERVALS: u64 = 6;

/// A belief that changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// About whom.
    pub peer: u16,
    /// In which life.
    pub incarnation: Incarnation,
    /// The new belief; `Alive` for a peer or a life not known before.
    pub status: Status,
}

/// What a peer last said of itself in its present life.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Info {
    /// Whether it can plan; by its own beacon or by gossip.
    pub able: bool,
    /// Whether it is a ground station.
    pub ground_station: bool,
    /// Mission revision it follows; of whoever told of it, until it said so itself.
    pub revision: u32,
    /// The loop it derived, likewise.
    pub loop_hash: u64,
    /// Whether it said so itself: by its beacon, or by a claim, which comes from farther away.
    pub is_own_word: bool,
    /// When its own beacon was last heard, without a relay.
    pub heard: Option<Time>,
    /// Where it was by then.
    pub place: Option<OffLoop>,
}

impl Info {
    /// A neighbour tells of it. Members work on one loop: who is said to be able by a peer is
    /// on that peer's loop, until it says otherwise itself.
    fn hear_of(&mut self, able: bool, said: Option<&Beacon>) {
        self.able = able;
        if let Some(said) = said.filter(|_| able && !self.is_own_word) {
            self.revision = said.revision;
            self.loop_hash = said.loop_hash;
        }
    }
}

/// All that a peer believes of others.
#[derive(Clone, Debug)]
pub struct Membership {
    me: u16,
    period_ms: u64,
    known: BTreeMap<u16, Known>,
    /// Whose records are held that no heartbeat of that life came of: in which life, since when
    /// and by how many hops.
    unheard: BTreeMap<u16, (Incarnation, Time, u8)>,
    telling: Telling,
    questions: Questions,
    /// What this peer announced itself, quarters of T.
    interval: u8,
    doubt_until: Time,
    /// What is heard until then may have waited for so long, since this peer stood still.
    waking: (Time, u64),
    /// Somebody who was suspected or believed down is heard, or a neighbour suspects
    /// somebody who was heard since, and nobody was told yet.
    refuted: bool,
    /// When anything of another peer was last heard.
    last_heard: Option<Time>,
    /// Neighbours whose link is gone, as the transport says.
    gone: BTreeSet<u16>,
    /// How often it changed who is known, who of them lives, or who can plan on which loop.
    changes: u64,
    /// As it was last asked for; nothing where what it follows from changed since.
    extent: Cell<Option<Extent>>,
    /// Until then somebody is taken to be out of the earshot of another, whatever the diameter.
    apart_until: Time,
}

impl Membership {
    /// Nobody is known yet; `period_ms` is the beacon period T.
    #[must_use]
    pub fn new(me: u16, period_ms: u32) -> Self {
        Self {
            me,
            period_ms: u64::from(period_ms.max(1)),
            known: BTreeMap::new(),
            unheard: BTreeMap::new(),
            telling: Telling::new(me),
            questions: Questions::default(),
            interval: INTERVAL_LEAST,
            doubt_until: Time(0),
            waking: (Time(0), 0),
            refuted: false,
            last_heard: None,
            gone: BTreeSet::new(),
            changes: 0,
            extent: Cell::new(None),
            apart_until: Time(0),
        }
    }

    /// Another number than before where somebody else is known or lives, or can plan on
    /// another loop.
    #[must_use]
    pub fn changes(&self) -> u64 {
        self.changes
    }

    /// In which life a peer is believed to be what.
    fn seat(&self, id: u16) -> Option<(Incarnation, bool, [bool; 2], u64)> {
        self.known.get(&id).map(|k| {
            let Info {
                able,
                ground_station,
                loop_hash,
                ..
            } = k.info;
            let lives = k.status != Status::Down;
            let roles = [able, ground_station];
            (k.freshest.incarnation, lives, roles, loop_hash)
        })
    }

    /// The transport believes that a neighbour came or went. A hint: it halves the
    /// silence after which that neighbour is suspected, and decides nothing.
    pub fn link(&mut self, neighbour: u16, up: bool) {
        if up {
            self.gone.remove(&neighbour);
        } else if self.known.contains_key(&neighbour) {
            self.gone.insert(neighbour);
        }
    }

    /// What this peer's own beacons announce, quarters of T.
    pub fn announce(&mut self, interval: u8) {
        if interval != self.interval {
            self.interval = interval;
            self.extent.set(None);
        }
    }

    /// The longest interval that anybody alive announced, this peer included: in it the
    /// swarm's patience is counted, milliseconds.
    #[must_use]
    pub fn interval_ms(&self) -> u64 {
        let known = self.extent.get().map(|e| e.interval);
        ms_of(
            known.unwrap_or_else(|| self.longest_interval()),
            self.period_ms,
        )
    }

    fn longest_interval(&self) -> u8 {
        let told = self.living().map(|k| k.freshest.interval).max();
        told.unwrap_or(0).max(self.interval)
    }

    fn living(&self) -> impl Iterator<Item = &Known> + Clone {
        self.known.values().filter(|k| k.status != Status::Down)
    }

    /// Asked for with every input, and measured only after it changed.
    fn extent(&self, now: Time) -> Extent {
        let known = self.extent.get().filter(|e| now < e.until);
        let extent = known
            .unwrap_or_else(|| Extent::measured(self.living(), self.interval, self.period_ms, now));
        self.extent.set(Some(extent));
        extent
    }

    /// What the extent owes to a peer.
    fn weight(&self, now: Time, id: u16) -> Weight {
        let known = self.known.get(&id).zip(self.extent.get());
        known.map_or(Weight::default(), |(known, extent)| {
            known.weight(now, window_ms(extent.interval, self.period_ms))
        })
    }

    /// A peer weighs something else now.
    fn weighed(&mut self, id: u16, before: Weight, after: Weight) {
        let extent = self.extent.get();
        if extent.is_some_and(|e| e.depends_on(id, before, after)) {
            self.extent.set(None);
        }
    }

    /// Whether somebody is farther than one hop from another, so that heartbeats have to be passed
    /// on. The diameter says so late: who flies out of earshot counts as near for ten intervals.
    fn is_far(&self, now: Time) -> bool {
        self.diameter(now) > 1 || now < self.apart_until
    }

    /// Somebody suspects another of whom others hear: not all hear each other.
    fn note_apart(&mut self, now: Time) {
        self.apart_until = now.plus_ms(URGENT_INTERVALS * self.own_interval_ms());
    }

    fn patience(&self, now: Time) -> Patience {
        let diameter = u64::from(self.diameter(now));
        let doubts = now < self.doubt_until;
        Patience::new(self.interval_ms(), self.period_ms, diameter, doubts)
    }

    /// Silence after which a peer is suspected, milliseconds: k1 T'.
    #[must_use]
    pub fn k1_ms(&self, now: Time) -> u64 {
        let patience = self.patience(now);
        patience.k1_ms(patience.interval_ms)
    }

    /// The longest time by which all know of a death, milliseconds.
    #[must_use]
    pub fn bound_ms(&self, now: Time) -> u64 {
        self.patience(now).bound_ms
    }

    /// Time to refute a suspicion of this peer, milliseconds.
    #[must_use]
    pub fn verdict_ms(&self, now: Time) -> u64 {
        self.patience(now).verdict_ms(self.own_interval_ms())
    }

    /// A beacon, heard from its author directly. Returns what changed.
    pub fn on_beacon(
        &mut self,
        now: Time,
        author: u16,
        incarnation: Incarnation,
        beacon: &Beacon,
    ) -> Vec<Change> {
        let count = beacon.heartbeat;
        let heartbeat = (count, beacon.interval);
        let mut changes = self.on_heartbeat(now, author, incarnation, heartbeat);
        let limits = self.patience(now);
        if author == self.me {
            return changes;
        }
        if !self.known.contains_key(&author) {
            return changes;
        }
        self.noting(now, author, |m| {
            let teller = m.known.get_mut(&author);
            let same = |h: &HeardHeartbeat| (h.incarnation, h.count) == (incarnation, count);
            if let Some(teller) = teller.filter(|t| same(&t.freshest)) {
                teller.info = info_of(beacon, now);
                teller.eccentricity = beacon.eccentricity.min(HOPS_MAX);
            }
        });
        for told in &beacon.gossip {
            if told.id != self.me && told.id != author {
                self.on_gossip(now, told, (author, beacon), limits, &mut changes);
            }
        }
        for told in &beacon.fresh {
            if told.id != self.me && told.id != author {
                self.on_fresh(now, told, (author, Some(beacon)), limits, &mut changes);
            }
        }
        changes
    }

    /// A claim of this life that is new here names the revision and the loop of its author:
    /// beacons are heard one hop away only, and who is farther is known to have left a loop by
    /// nothing else. Of whom nothing is known yet it says nothing: who claims need not be able.
    pub fn on_claim(
        &mut self,
        now: Time,
        (author, incarnation): (u16, Incarnation),
        (revision, loop_hash): (u32, u64),
    ) {
        self.noting(now, author, |m| {
            let known = m.known.get_mut(&author);
            let known = known.filter(|k| k.freshest.incarnation == incarnation);
            if let Some(known) = known.filter(|k| k.info.loop_hash != 0) {
                known.info.revision = revision;
                known.info.loop_hash = loop_hash;
                known.info.is_own_word = true;
            }
        });
    }

    /// A record that is new here, passed on so often. If no heartbeat of its author ever follows,
    /// nobody would tell of the record to who did not hear it.
    pub fn on_record(&mut self, now: Time, (author, incarnation): (u16, Incarnation), hops: u8) {
        let is_new = self.is_unheard(author, incarnation) && author != self.me;
        let has_room = self.unheard.len() < MAX_KNOWN || self.unheard.contains_key(&author);
        if is_new && has_room && self.may_live_in(author, incarnation) {
            let hops = hops.saturating_add(1).min(HOPS_MAX);
            let heard = (incarnation, now, hops);
            let noted = self.unheard.entry(author).or_insert(heard);
            if noted.0 < incarnation {
                *noted = heard;
            }
        }
    }

    /// Whether no heartbeat of this life or a later one is known.
    fn is_unheard(&self, id: u16, life: Incarnation) -> bool {
        let known = self.known.get(&id);
        known.is_none_or(|k| k.freshest.incarnation < life)
    }

    /// Who said something and was never heard living takes its place among the dead.
    fn bury_unheard(&mut self, now: Time, bound_ms: u64, changes: &mut Vec<Change>) {
        let mut unheard = std::mem::take(&mut self.unheard);
        unheard.retain(|id, (life, ..)| self.is_unheard(*id, *life));
        let waited_ms = self.waited_ms(now);
        for (id, (incarnation, since, hops)) in &unheard {
            if now.since_ms(*since).saturating_sub(waited_ms) > bound_ms {
                let last = HeardHeartbeat {
                    id: *id,
                    incarnation: *incarnation,
                    count: 0,
                    age: Age::beyond_all(*since),
                    hops: *hops,
                    interval: self.interval,
                    suspected: None,
                };
                self.noting(now, *id, |m| m.remember_dead(now, last, changes));
            }
        }
        unheard.retain(|id, (life, ..)| self.is_unheard(*id, *life));
        self.unheard = unheard;
    }

    /// What a neighbour says with its heartbeat of those of others. Returns what changed.
    pub fn on_others(&mut self, now: Time, author: u16, others: &[Fresh]) -> Vec<Change> {
        let mut changes = Vec::new();
        let limits = self.patience(now);
        for told in others {
            if told.id != self.me && told.id != author {
                self.on_fresh(now, told, (author, None), limits, &mut changes);
            }
        }
        changes
    }

    /// A heartbeat, heard from its author directly. Returns what changed.
    pub fn on_heartbeat(
        &mut self,
        now: Time,
        author: u16,
        incarnation: Incarnation,
        (count, interval): (u32, u8),
    ) -> Vec<Change> {
        let mut changes = Vec::new();
        if author == self.me {
            return changes;
        }
        self.note_heard(now);
        let limits = self.patience(now);
        let age = Age {
            told_ms: self.waited_ms(now),
            at: now,
        };
        let own = HeardHeartbeat {
            id: author,
            incarnation,
            count,
            age,
            hops: 1,
            interval,
            suspected: None,
        };
        self.noting(now, author, |m| {
            m.merge(now, own, limits, &mut changes);
        });
        self.meet(now, author, limits.interval_ms);
        changes
    }

    /// A neighbour is heard itself. If it was away, it heard of nobody meanwhile who was there
    /// before it came back.
    fn meet(&mut self, now: Time, neighbour: u16, interval_ms: u64) {
        let known = self.known.get_mut(&neighbour);
        let Some(absence) = known.and_then(|k| k.meet(now, interval_ms)) else {
            return;
        };
        let others = self.known.iter_mut().filter(|(id, _)| **id != neighbour);
        let there =
            others.filter(|(_, k)| k.is_believed() && k.was_there(absence.until, interval_ms));
        for (_, other) in there {
            other.note_unknown_to(now, neighbour, absence.since, interval_ms);
        }
    }

    fn on_gossip(
        &mut self,
        now: Time,
        told: &Gossip,
        (teller, said): (u16, &Beacon),
        limits: Patience,
        changes: &mut Vec<Change>,
    ) {
        let age = |ds: u16| Age {
            told_ms: u64::from(ds) * 100,
            at: now,
        };
        let waited_ms = self.waited_ms(now);
        let heartbeat = HeardHeartbeat {
            id: told.id,
            incarnation: told.incarnation,
            count: told.heartbeat,
            age: age(told.age_ds).and_ms(waited_ms),
            hops: told.hops.saturating_add(1),
            interval: told.interval,
            suspected: told.suspected_ds.map(age),
        };
        let urgent_until = now.plus_ms(URGENT_INTERVALS * self.own_interval_ms());
        self.on_told(
            now,
            (teller, told.able, Some(said)),
            heartbeat,
            limits,
            changes,
        );
        if let Some(known) = self.known.get_mut(&told.id)
            && known.disputes(&heartbeat)
        {
            known.is_news_until(urgent_until);
            self.refuted = true;
        }
    }

    /// A heartbeat without anything else. Of a life it tells the last bits: of a peer that is
    /// not known these are the life, until a higher one is heard of; else the life that is known
    /// or one of the next, if it was sent later than what is known.
    fn on_fresh(
        &mut self,
        now: Time,
        told: &Fresh,
        (teller, said): (u16, Option<&Beacon>),
        limits: Patience,
        changes: &mut Vec<Change>,
    ) {
        let age = Age {
            told_ms: u64::from(told.age_ds) * 100 + self.waited_ms(now),
            at: now,
        };
        let incarnation = match self.known.get(&told.id) {
            Some(known) => known.life_told(now, told.life, age),
            None => Some(Incarnation::from(told.life)).filter(|life| *life > 0),
        };
        let Some(incarnation) = incarnation else {
            return;
        };
        let heartbeat = HeardHeartbeat {
            id: told.id,
            incarnation,
            count: told.heartbeat,
            age,
            hops: told.hops.saturating_add(1),
            interval: told.interval,
            suspected: told.suspected_ds.map(|ds| Age {
                told_ms: u64::from(ds) * 100,
                at: now,
            }),
        };
        self.on_told(now, (teller, told.able, said), heartbeat, limits, changes);
    }

    /// A heartbeat of another peer, which a neighbour tells of, with whether that one is able.
    /// Most are known already, and of these only is noted who knows them.
    fn on_told(
        &mut self,
        now: Time,
        (teller, able, said): (u16, bool, Option<&Beacon>),
        heartbeat: HeardHeartbeat,
        limits: Patience,
        changes: &mut Vec<Change>,
    ) {
        let known = self.known.get(&heartbeat.id);
        if known.is_some_and(|known| known.disputes(&heartbeat)) {
            self.note_apart(now);
        }
        self.hear_question(now, &heartbeat, limits);
        let known = self.known.get_mut(&heartbeat.id);
        if let Some(known) = known.filter(|known| known.has_heard(&heartbeat)) {
            return known.note_told(now, teller, &heartbeat, limits.interval_ms);
        }
        self.noting(now, heartbeat.id, |m| {
            let fresher = m.merge(now, heartbeat, limits, changes);
            if let Some(known) = m.known.get_mut(&heartbeat.id) {
                known.note_told(now, teller, &heartbeat, limits.interval_ms);
                if fresher {
                    known.info.hear_of(able, said);
                }
            }
        });
        if self.is_far(now)
            && let Some(known) = self.known.get_mut(&heartbeat.id)
            && known.asks_at_once(now, &limits, self.period_ms)
        {
            self.questions.ask(now, known, &limits);
        }
    }

    /// Does something to what is known of one peer, and notes what the extent and the number
    /// of changes owe to it.
    fn noting(&mut self, now: Time, id: u16, change: impl FnOnce(&mut Self)) {
        let before = (self.weight(now, id), self.seat(id));
        change(self);
        self.weighed(id, before.0, self.weight(now, id));
        self.changes += u64::from(before.1 != self.seat(id));
    }

    /// Merges one heartbeat. Returns whether it was fresher than what was known.
    fn merge(
        &mut self,
        now: Time,
        heard: HeardHeartbeat,
        limits: Patience,
        changes: &mut Vec<Change>,
    ) -> bool {
        let Patience {
            interval_ms,
            bound_ms,
            ..
        } = limits;
        if heard.hops > HOPS_MAX || !self.may_live_in(heard.id, heard.incarnation) {
            return false;
        }
        let verdict_ms = limits.verdict_ms(ms_of(heard.interval, self.period_ms));
        let condemned = heard.suspected.is_some_and(|age| age.ms(now) >= verdict_ms);
        let known_life = self.known.get(&heard.id).map(|k| k.freshest.incarnation);
        // Nobody listened while it waited: that was no silence.
        let waited_ms = self.waited_ms(now);
        let too_old = heard.age.ms(now).saturating_sub(waited_ms) > bound_ms;
        if too_old || (condemned && known_life.is_none()) {
            if known_life.is_none_or(|life| life < heard.incarnation) {
                self.remember_dead(now, heard, changes);
            } else if let Some(known) = self.known.get_mut(&heard.id)
                && known.freshest.incarnation == heard.incarnation
                && known.status == Status::Alive
            {
                known.note_higher_count(now, heard);
            }
            return false;
        }
        let urgent_until = now.plus_ms(URGENT_INTERVALS * self.own_interval_ms());
        let known = self.known.get(&heard.id);
        if known.is_some_and(|known| known.is_refuted_by(&heard)) {
            self.note_apart(now);
        }
        let is_far = self.is_far(now);
        let Some(known) = self.known.get_mut(&heard.id) else {
            if !self.make_room(now) {
                return false;
            }
            let mut known = Known::new(heard, urgent_until);
            known.excused_ms = waited_ms;
            known.note_hops(now, heard.hops, interval_ms);
            changes.push(known.change());
            self.known.insert(heard.id, known);
            return true;
        };
        let version = |h: &HeardHeartbeat| (h.incarnation, h.count);
        if version(&heard) < version(&known.freshest) {
            known.note_lower_count(now, &heard, interval_ms);
            return false;
        }
        if version(&heard) == version(&known.freshest) {
            known.merge_same(now, heard, interval_ms, urgent_until, changes);
            return false;
        }
        let mut heard = heard;
        if known.freshest.age.ms(now) < heard.age.ms(now) {
            // It was sent after the one that is known: who says that it is older had a
            // clock that jumped.
            heard.age = known.freshest.age;
        } else {
            // Nor was it silent for longer: what was no silence since the earlier one is none now.
            let listened_ms = known.silent_ms(now);
            let unheard_ms = heard.age.ms(now).saturating_sub(listened_ms);
            known.excused_ms = waited_ms.max(unheard_ms);
        }
        let new_life = heard.incarnation > known.freshest.incarnation;
        if new_life {
            known.info = Info::default();
            known.eccentricity = 0;
        }
        let was_asked = known.urgency(now, &limits, self.period_ms) > 0;
        let passes_on = is_far && was_asked && heard.suspected.is_none() && !new_life;
        let was_sought = known.is_sought(now);
        let before = known.freshest;
        let was_down = known.status == Status::Down;
        if was_down {
            known.is_back(now);
        }
        known.note_fresh_count(now, &heard);
        if passes_on && heard.hops > 1 {
            // What was asked for comes by whatever way is quick: nobody is farther for it.
            heard.hops = heard.hops.min(before.hops.max(2));
        }
        known.freshest = heard;
        known.asked = 0;
        known.is_untold_suspicion = false;
        if !passes_on || heard.hops == 1 {
            known.note_hops(now, heard.hops, interval_ms);
        }
        let status = if heard.suspected.is_some() {
            Status::Suspect
        } else {
            Status::Alive
        };
        if new_life || status != known.status {
            self.refuted |= status == Status::Alive;
            known.status = status;
            known.is_news_until(urgent_until);
            changes.push(known.change());
        }
        let is_back = was_down && !new_life && status == Status::Alive;
        if passes_on || (is_back && was_sought) {
            self.questions.answer(heard.id, before.count);
        }
        if is_back {
            self.seek(now, bound_ms);
        }
        true
    }

    /// A life that ended before it was ever met, or while it was out of reach: known
    /// as down, so that this peer's beacons ask for the records it left. Nobody else
    /// is forgotten for it.
    fn remember_dead(&mut self, now: Time, heard: HeardHeartbeat, changes: &mut Vec<Change>) {
        let before = self.known.get(&heard.id);
        if before.is_none() && self.known.len() >= MAX_KNOWN {
            return;
        }
        let believed = before.is_some_and(|k| k.status != Status::Down);
        let mut dead = Known::new(heard, now);
        dead.status = Status::Down;
        if believed {
            changes.push(dead.change());
        }
        self.known.insert(heard.id, dead);
    }

    /// Makes room for one more, if need be by forgetting the longest dead; the living
    /// are never forgotten, or made-up ids could displace them. Returns whether there
    /// is room.
    fn make_room(&mut self, now: Time) -> bool {
        if self.known.len() < MAX_KNOWN {
            return true;
        }
        let dead = self.known.iter().filter(|(_, k)| k.status == Status::Down);
        let longest = dead
            .max_by_key(|(id, k)| (k.freshest.age.ms(now), **id))
            .map(|(id, _)| *id);
        longest.is_some_and(|id| {
            self.gone.remove(&id);
            self.known.remove(&id).is_some()
        })
    }

    /// This peer came so late that it did not listen for a time, or its clock jumped: that
    /// time is no silence of others, so no verdict counts it. What is told of ages does:
    /// a heartbeat is as old as it is, whoever slept. What arrived meanwhile, since this
    /// peer last did anything, is heard before it looks at the time again: it may have waited
    /// all the while, and is as old. What is to refute a suspicion is heard within a period;
    /// until then verdicts are doubted.
    pub fn was_late(&mut self, now: Time, late_ms: u64, slept_ms: u64) {
        self.doubt_until = now.plus_ms(self.period_ms);
        self.waking = (now.plus_ms(self.period_ms / CADENCE), slept_ms);
        self.last_heard = self.last_heard.map(|t| t.plus_ms(late_ms).min(now));
        for known in self.known.values_mut() {
            known.excuse(now, late_ms);
        }
    }

    /// For so long what is heard now may have waited for this peer to listen.
    fn waited_ms(&self, now: Time) -> u64 {
        let (until, slept_ms) = self.waking;
        if now < until { slept_ms } else { 0 }
    }

    /// Whether somebody was heard since this was last asked who had been suspected or
    /// believed down, or is suspected by a neighbour: others who do are to be told soon.
    pub fn take_refuted(&mut self) -> bool {
        std::mem::take(&mut self.refuted)
    }

    /// Looks at the time, wanted four times a period: raises suspicions and passes
    /// verdicts. Returns what changed.
    pub fn tick(&mut self, now: Time) -> Vec<Change> {
        assert!(
            self.known.len() <= MAX_KNOWN,
            "peers known keep to their cap"
        );
        let patience = self.patience(now);
        let urgent_until = now.plus_ms(URGENT_INTERVALS * self.own_interval_ms());
        let tick_ms = self.period_ms / CADENCE;
        let mut changes = Vec::new();
        for known in self.known.values_mut().filter(|k| k.status != Status::Down) {
            let silent_ms = known.silent_ms(now);
            // Who heard it from others since its link ended knows that the link ended.
            let answers_for_it = known.freshest.hops == 1;
            let interval_ms = ms_of(known.freshest.interval, self.period_ms);
            let k1_ms = patience.k1_ms(interval_ms);
            let patience_ms = if self.gone.contains(&known.freshest.id) {
                k1_ms / 2
            } else {
                k1_ms
            };
            if known.freshest.suspected.is_none() && answers_for_it && silent_ms >= patience_ms {
                // It begins when the patience ends, not when this is noticed.
                known.freshest.suspected = Some(Age {
                    told_ms: (silent_ms - patience_ms).min(tick_ms),
                    at: now,
                });
                known.is_untold_suspicion = true;
            }
            let verdict_ms = patience.verdict_ms(interval_ms);
            let status = if known.is_condemned(now, verdict_ms) || silent_ms > patience.bound_ms {
                Status::Down
            } else if known.freshest.suspected.is_some() {
                Status::Suspect
            } else {
                Status::Alive
            };
            if status != known.status {
                known.status = status;
                known.is_news_until(urgent_until);
                changes.push(known.change());
            }
        }
        if !changes.is_empty() {
            self.extent.set(None);
            self.changes += 1;
        }
        self.bury_unheard(now, patience.bound_ms, &mut changes);
        self.ask_at_once(now, &patience);
        changes
    }

    /// What a beacon says of others in the room of so many entries: whole entries, soon of those
    /// `behind` whose records neighbours have newer, and heartbeats alone.
    pub fn tell(
        &mut self,
        now: Time,
        entries: usize,
        behind: &BTreeSet<u16>,
    ) -> (Vec<Gossip>, Vec<Fresh>) {
        let moment = self.moment(now);
        self.telling.tell(&mut self.known, moment, entries, behind)
    }

    /// What the next heartbeat says of others.
    pub fn tell_between(&mut self, now: Time) -> Vec<Fresh> {
        let moment = self.moment(now);
        self.telling.between(&mut self.known, moment)
    }

    fn moment(&self, now: Time) -> Moment {
        Moment {
            now,
            is_far: self.is_far(now),
            interval_ms: self.interval_ms(),
            own_interval_ms: self.own_interval_ms(),
            bound_ms: self.patience(now).bound_ms,
        }
    }

    /// Fewest hops to the farthest live author of the last 10 T'.
    #[must_use]
    pub fn eccentricity(&self, now: Time) -> u8 {
        let window_ms = window_ms(self.extent(now).interval, self.period_ms);
        let hops = self.living().map(|k| k.weight(now, window_ms).hops);
        hops.max().unwrap_or(0)
    }

    fn own_interval_ms(&self) -> u64 {
        ms_of(self.interval, self.period_ms)
    }

    /// The largest eccentricity heard from live peers within 10 T', at least 1.
    #[must_use]
    pub fn diameter(&self, now: Time) -> u32 {
        u32::from(self.extent(now).hops.clamp(1, HOPS_MAX))
    }

    /// Everybody known: id, life, belief.
    pub fn all(&self) -> impl Iterator<Item = (u16, Incarnation, Status)> + '_ {
        self.known
            .iter()
            .map(|(id, k)| (*id, k.freshest.incarnation, k.status))
    }

    /// Everybody not taken for down: id and life.
    pub fn live(&self) -> impl Iterator<Item = (u16, Incarnation)> + '_ {
        self.all()
            .filter(|(_, _, s)| *s != Status::Down)
            .map(|(id, i, _)| (id, i))
    }

    /// The other UAVs not taken for down, by their ids.
    pub fn live_uavs(&self) -> impl Iterator<Item = u16> + '_ {
        let live = self.known.iter();
        let live = live.filter(|(_, k)| k.status != Status::Down && !k.info.ground_station);
        live.map(|(id, _)| *id)
    }

    /// Something that another peer wrote is heard, by whatever way.
    pub fn note_heard(&mut self, now: Time) {
        self.last_heard = Some(now);
    }

    /// Whether nobody was heard for k1 T' although some UAV is not believed down yet. That
    /// many die at once is less likely than that this peer is deaf, so it suspects itself
    /// until it has heard somebody, or believes all UAVs down. A ground station has nothing
    /// that could be taken from it, and who flies alone is often out of its reach.
    #[must_use]
    pub fn is_deaf(&self, now: Time) -> bool {
        self.hears_nobody(now) && self.living().any(|k| !k.info.ground_station)
    }

    /// Whether nobody was heard for k1 T', who was heard before.
    #[must_use]
    pub fn hears_nobody(&self, now: Time) -> bool {
        let k1_ms = self.k1_ms(now);
        let silent = |heard: Time| now.since_ms(heard) >= k1_ms;
        self.last_heard.is_some_and(silent)
    }

    /// Whether it knows of ground stations, and believes all of them down.
    #[must_use]
    pub fn lacks_stations(&self) -> bool {
        let mut stations = self.known.values().filter(|k| k.info.ground_station);
        let all_down = stations.clone().all(|k| k.status == Status::Down);
        all_down && stations.next().is_some()
    }

    /// How many UAVs are known, the dead and this one included; of whom only others told
    /// counts as one.
    #[must_use]
    pub fn uavs(&self) -> usize {
        let others = self.known.values().filter(|k| !k.info.ground_station);
        others.count() + 1
    }

    /// What is believed of a peer, if it is known.
    #[must_use]
    pub fn status(&self, id: u16) -> Option<(Incarnation, Status)> {
        self.known
            .get(&id)
            .map(|k| (k.freshest.incarnation, k.status))
    }

    /// Whether a peer may be in this life: not far ahead of the one in which it is known.
    /// A life that was made up would outrank the peer's own for ever.
    #[must_use]
    pub fn may_live_in(&self, id: u16, incarnation: Incarnation) -> bool {
        let known = self.known.get(&id).map_or(0, |k| k.freshest.incarnation);
        incarnation.saturating_sub(known) <= LIFE_STEP
    }

    /// What a peer last said of itself.
    #[must_use]
    pub fn info(&self, id: u16) -> Option<Info> {
        self.known.get(&id).map(|k| k.info)
    }

    /// How many are known, and the cap.
    #[must_use]
    pub fn loads(&self) -> [(&'static str, usize, usize); 1] {
        [("peers known", self.known.len(), MAX_KNOWN)]
    }
}

fn info_of(beacon: &Beacon, now: Time) -> Info {
    Info {
        able: beacon.able,
        ground_station: beacon.ground_station,
        revision: beacon.revision,
        loop_hash: beacon.loop_hash,
        is_own_word: true,
        heard: Some(now),
        place: Some(OffLoop {
            east_mm: beacon.east_mm,
            north_mm: beacon.north_mm,
            course_e4: beacon.heading_e4,
            ready_ms: 0,
        }),
    }
}
