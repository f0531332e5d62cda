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
//! | alive | its freshest heartbeat was heard directly, k1 I ago | suspect |
//! | alive | half of that, and the transport says that the link is gone | suspect |
//! | alive | a suspicion against this very heartbeat is heard | suspect |
//! | any | a fresher heartbeat from anybody, younger than the bound | alive; suspect if a suspicion against it is told with it |
//! | suspect | k2 T' + k1 (T' - I), and T'/3 for each hop of D beyond four, unrefuted | down |
//! | alive, suspect | heartbeat older than (k1 + k2 + D + 2) T' | down |
//! | any | a heartbeat of a later life, younger than the bound | likewise, in that life |
//! | any | a heartbeat of a later life, older than the bound | down, in that life |
//! | alive | an old heartbeat of the same life with a higher count | alive; gossip says it, until its author takes a new life |
//!
//! Ages are sums of holding times, never differences of clocks, and they count
//! wherever a heartbeat is heard: so one that travelled long is known to be old, and
//! a merging component cannot raise the dead. What follows from a verdict is left to
//! the callers; here it revokes nothing.

mod known;
#[cfg(test)]
pub(crate) mod many_detectors;
#[cfg(test)]
mod tests;

use super::airtime::{ENTRY_BYTES, FRESH_BYTES, ms_of};
use super::life::LIFE_STEP;
use crate::Incarnation;
use crate::input::Time;
use crate::output::Status;
use crate::peer::CADENCE;
use crate::wire::limits::INTERVAL_LEAST;
use crate::wire::limits::{HOPS_MAX, PEERS_MAX};
use crate::wire::message::{Beacon, Fresh, Gossip, OffLoop};
use core::cell::Cell;
use core::cmp::Reverse;
use known::{Age, HeardHeartbeat, Known, Weight};
use std::collections::{BTreeMap, BTreeSet};

/// Most other peers known: the largest fleet but this peer itself. A flood of made-up ids
/// must end somewhere.
pub const MAX_KNOWN: usize = PEERS_MAX - 1;

/// Hops and eccentricities count for so many of the longest intervals after they were
/// heard: what a neighbour says of others comes round, and what is lost comes again.
const HOP_INTERVALS: u64 = 10;

/// Over so many hops an answer to a suspicion comes back within k2.
const NEAR_HOPS: u64 = 4;

/// What was not told of within so many intervals is no news any more.
const URGENT_INTERVALS: u64 = 6;

/// A heartbeat carries so many of others at most: then it is half as long as a beacon.
const BETWEEN_MAX: usize = 8;

/// Of a heartbeat that is older than such a part of the bound a later one is asked for, by
/// telling it: most that are known are younger, and the rest of the bound is for the answer.
const OLD: u64 = 4;

/// For each again after so many intervals: each neighbour has spoken twice by then.
const ASK_INTERVALS: u64 = 2;

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

/// How long a peer waits before it believes what, at one moment.
#[derive(Clone, Copy, Debug)]
struct Patience {
    /// The longest interval announced, T'.
    interval_ms: u64,
    /// D beyond [`NEAR_HOPS`].
    far_hops: u64,
    /// k1, quarters.
    k1_quarters: u64,
    /// Time to refute a suspicion: k2 T'.
    k2_ms: u64,
    /// No living peer's heartbeat is older: (k1 + k2 + D + 2) T'.
    bound_ms: u64,
}

impl Patience {
    /// Time to refute a suspicion of who announced such an interval: k2 T', and as much more
    /// as it is suspected sooner than the slowest would be. Where many are on the way what a
    /// heartbeat takes is counted in the longest interval, whoever sent it. A question and its
    /// answer wait for their turn at each hop: a third of T' more for each beyond four.
    fn verdict_ms(&self, interval_ms: u64) -> u64 {
        let sooner_ms = self.interval_ms.saturating_sub(interval_ms);
        let far_ms = self.far_hops * self.interval_ms / 3;
        self.k2_ms + sooner_ms * self.k1_quarters / 4 + far_ms
    }
}

/// How slow and how wide the swarm is, as far as this peer knows.
#[derive(Clone, Copy, Debug)]
struct Extent {
    /// The longest interval that anybody alive announced, T', quarters of T.
    interval: u8,
    /// Who announced it, unless this peer did.
    interval_by: Option<u16>,
    /// The most hops that anybody alive is away, or says that somebody is.
    hops: u8,
    /// Whose hops these are: of several the one of whom they were heard last.
    hops_by: Option<u16>,
    /// Unless something else is heard it is so until then.
    until: Time,
}

/// What a peer last said of itself in its present life.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Info {
    /// Whether it can plan; by its own beacon or by gossip.
    pub able: bool,
    /// Whether it is a ground station.
    pub ground_station: bool,
    /// Mission revision it follows; of whoever told of it, until it is heard itself.
    pub revision: u32,
    /// The loop it derived, likewise.
    pub loop_hash: u64,
    /// When its own beacon was last heard, without a relay.
    pub heard: Option<Time>,
    /// Where it was by then.
    pub place: Option<OffLoop>,
}

impl Info {
    /// A neighbour tells of it. Members work on one loop: who is said to be able by a peer is
    /// on that peer's loop, until its own beacon says otherwise.
    fn hear_of(&mut self, able: bool, said: Option<&Beacon>) {
        self.able = able;
        if let Some(said) = said.filter(|_| able && self.heard.is_none()) {
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
    next_gossip: u16,
    /// So many heartbeats of others the next own one carries.
    between: usize,
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
}

impl Membership {
    /// Nobody is known yet; `period_ms` is the beacon period T.
    #[must_use]
    pub fn new(me: u16, period_ms: u32) -> Self {
        Self {
            me,
            period_ms: u64::from(period_ms.max(1)),
            known: BTreeMap::new(),
            // Neighbours tell of different peers.
            next_gossip: me,
            between: 0,
            interval: INTERVAL_LEAST,
            doubt_until: Time(0),
            waking: (Time(0), 0),
            refuted: false,
            last_heard: None,
            gone: BTreeSet::new(),
            changes: 0,
            extent: Cell::new(None),
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

    fn living(&self) -> impl Iterator<Item = &Known> {
        self.known.values().filter(|k| k.status != Status::Down)
    }

    /// Asked for with every input, and measured only after it changed.
    fn extent(&self, now: Time) -> Extent {
        let known = self.extent.get().filter(|e| now < e.until);
        let extent = known.unwrap_or_else(|| self.measured(now));
        self.extent.set(Some(extent));
        extent
    }

    fn measured(&self, now: Time) -> Extent {
        let slowest = self.living().max_by_key(|k| k.freshest.interval);
        let slowest = slowest.map(|k| k.freshest);
        let slowest = slowest.filter(|h| h.interval > self.interval);
        let interval = slowest.map_or(self.interval, |h| h.interval);
        let window_ms = self.window_ms(interval);
        let each: Vec<(&Known, Weight)> = self
            .living()
            .map(|k| (k, k.weight(now, window_ms)))
            .collect();
        let hops = each.iter().map(|(_, w)| w.hops.max(w.eccentricity)).max();
        let hops = hops.unwrap_or(0);
        // Until then nobody is farther, and somebody is as far.
        let mut nearer = Time(u64::MAX);
        let mut as_far: Option<(Time, u16)> = None;
        for (known, weight) in each {
            let last = known.last_within(hops);
            let said = known.info.heard.filter(|_| weight.eccentricity == hops);
            let is_as_far = (weight.hops == hops).then_some(last).max(said);
            if weight.hops > 0 {
                nearer = nearer.min(last);
            }
            as_far = as_far.max(is_as_far.map(|since| (since, known.freshest.id)));
        }
        let as_far = as_far.filter(|_| hops > 0);
        let until = as_far.map_or(nearer, |(since, _)| nearer.min(since));
        Extent {
            interval,
            interval_by: slowest.map(|h| h.id),
            hops,
            hops_by: as_far.map(|(_, id)| id),
            until: until.plus_ms(window_ms),
        }
    }

    /// Hops and eccentricities count for so long.
    fn window_ms(&self, interval: u8) -> u64 {
        HOP_INTERVALS * ms_of(interval, self.period_ms)
    }

    /// What the extent owes to a peer.
    fn weight(&self, now: Time, id: u16) -> Weight {
        let known = self.known.get(&id).zip(self.extent.get());
        known.map_or(Weight::default(), |(known, extent)| {
            known.weight(now, self.window_ms(extent.interval))
        })
    }

    /// A peer weighs something else now: the extent stays what it is unless this peer's was
    /// the most or is more. Of who comes back what was heard before it went counts again.
    fn weighed(&mut self, id: u16, before: Weight, after: Weight) {
        let Some(extent) = self.extent.get().filter(|_| before != after) else {
            return;
        };
        let was_most = [extent.interval_by, extent.hops_by].contains(&Some(id));
        let is_more = after.interval > extent.interval
            || after.hops > extent.hops
            || after.eccentricity > extent.hops;
        if was_most || is_more || before == Weight::default() {
            self.extent.set(None);
        }
    }

    /// A peer whose own loop ran late doubts its verdicts first: both factors double.
    fn patience(&self, now: Time) -> Patience {
        let doubt = if now < self.doubt_until { 2 } else { 1 };
        let diameter = u64::from(self.diameter(now));
        let interval_ms = self.interval_ms();
        let k1_quarters = doubt * (16 + diameter);
        let k2_ms = doubt * interval_ms * (8 + diameter) / 2;
        let travel_ms = (diameter + 2) * interval_ms;
        Patience {
            interval_ms,
            far_hops: diameter.saturating_sub(NEAR_HOPS),
            k1_quarters,
            k2_ms,
            bound_ms: interval_ms * k1_quarters / 4 + k2_ms + travel_ms,
        }
    }

    /// Silence after which a peer is suspected, milliseconds: k1 T'.
    #[must_use]
    pub fn k1_ms(&self, now: Time) -> u64 {
        let patience = self.patience(now);
        patience.interval_ms * patience.k1_quarters / 4
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
        changes
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
            && known.disputes(told)
        {
            known.is_news_until(urgent_until);
            self.refuted = true;
        }
    }

    /// A heartbeat without anything else. Of a life it tells the last bits: of a peer that is
    /// not known these are the life, until a higher one is heard of.
    fn on_fresh(
        &mut self,
        now: Time,
        told: &Fresh,
        (teller, said): (u16, Option<&Beacon>),
        limits: Patience,
        changes: &mut Vec<Change>,
    ) {
        let life = self.known.get(&told.id).map(|k| k.freshest.incarnation);
        let incarnation = life.unwrap_or(Incarnation::from(told.life));
        if incarnation == 0 || Fresh::life_of(incarnation) != told.life {
            return;
        }
        let heartbeat = HeardHeartbeat {
            id: told.id,
            incarnation,
            count: told.heartbeat,
            age: Age {
                told_ms: u64::from(told.age_ds) * 100 + self.waited_ms(now),
                at: now,
            },
            hops: told.hops.saturating_add(1),
            interval: told.interval,
            suspected: None,
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
                known.note_higher_count(heard);
            }
            return false;
        }
        let urgent_until = now.plus_ms(URGENT_INTERVALS * self.own_interval_ms());
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
            known.excused_ms = waited_ms;
        }
        let new_life = heard.incarnation > known.freshest.incarnation;
        if new_life {
            known.info = Info::default();
            known.eccentricity = 0;
        }
        known.freshest = heard;
        known.is_untold_suspicion = false;
        if new_life
            || known
                .higher_count_heard
                .is_some_and(|h| h.count <= heard.count)
        {
            known.higher_count_heard = None;
        }
        known.note_hops(now, heard.hops, interval_ms);
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
        let Patience {
            k1_quarters,
            bound_ms,
            ..
        } = patience;
        let urgent_until = now.plus_ms(URGENT_INTERVALS * self.own_interval_ms());
        let tick_ms = self.period_ms / CADENCE;
        let mut changes = Vec::new();
        for known in self.known.values_mut().filter(|k| k.status != Status::Down) {
            let silent_ms = known.silent_ms(now);
            // Who heard it from others since its link ended knows that the link ended.
            let answers_for_it = known.freshest.hops == 1;
            let interval_ms = ms_of(known.freshest.interval, self.period_ms);
            let k1_ms = interval_ms * k1_quarters / 4;
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
            let status = if known.is_condemned(now, verdict_ms) || silent_ms > bound_ms {
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
        changes
    }

    /// What to say of others in the room of so many entries: where not everybody fits, a
    /// quarter of it is for whole entries and another for news, the rest for heartbeats alone,
    /// of those first of whom it gains most to tell. Half of these go with the heartbeat between
    /// this beacon and the next ([`Membership::tell_between`]). One of them asks: it is told since
    /// it is old, and whoever knows a later one tells that.
    pub fn tell(&mut self, now: Time, entries: usize) -> (Vec<Gossip>, Vec<Fresh>) {
        if self.known.len() <= entries {
            self.between = 0;
            return (self.gossip(now, entries), Vec::new());
        }
        let untold = |k: &&Known| k.is_untold_news(now);
        let news = self.known.values().filter(untold).count();
        let full = entries.div_ceil(4) + news.min(entries / 4);
        let told = self.gossip(now, full);
        let room = (entries - full) * ENTRY_BYTES / FRESH_BYTES;
        self.between = room.div_ceil(2).min(BETWEEN_MAX);
        let fresh = self.fresh(now, &told, room - self.between, true);
        (told, fresh)
    }

    fn fresh(&mut self, now: Time, told: &[Gossip], max: usize, asks: bool) -> Vec<Fresh> {
        // Where everybody hears everybody nobody has to be told.
        let far = self.diameter(now) > 1;
        let old_ms = self.patience(now).bound_ms / OLD;
        let again_ms = ASK_INTERVALS * self.own_interval_ms();
        let interval_ms = self.interval_ms();
        let others = self
            .known
            .iter_mut()
            .filter(|(_, k)| k.is_believed() && (far || k.is_wanted(now)));
        let mut wanted: Vec<&mut Known> = others
            .filter(|(id, _)| told.iter().all(|g| g.id != **id))
            .map(|(_, k)| k)
            .collect();
        wanted.sort_by_cached_key(|k| (Reverse(k.want(now)), k.freshest.id));
        if asks && far {
            let old = wanted.iter().enumerate();
            let old = old.filter(|(_, k)| k.asks(now, old_ms, again_ms));
            let oldest = old.max_by_key(|(at, k)| (k.freshest.age.ms(now), Reverse(*at)));
            if let Some((at, _)) = oldest {
                wanted[..=at].rotate_right(1);
            }
        }
        wanted.truncate(max);
        wanted.sort_by_key(|k| k.freshest.id);
        let say = |known: &mut Known| {
            known.tell(now);
            known.fresh(now, interval_ms)
        };
        wanted.into_iter().map(say).collect()
    }

    /// What the next heartbeat says of others: those that the last beacon had no room for.
    /// It is short, so it often arrives where a beacon does not.
    pub fn tell_between(&mut self, now: Time) -> Vec<Fresh> {
        let room = std::mem::take(&mut self.between);
        self.fresh(now, &[], room, false)
    }

    /// Whole entries of others: at most `max`. Who began a life anew without
    /// knowing is reminded first (a quarter of the entries at most), then news (half of
    /// the rest at most), then those whom a neighbour is farther from than this peer (two
    /// thirds of the rest), then all in rotation, so that nobody is left out for long. The
    /// relay fills in the versions of records.
    pub fn gossip(&mut self, now: Time, max: usize) -> Vec<Gossip> {
        let interval_ms = self.interval_ms();
        let known = self.known.values();
        let reminders = known.filter_map(|k| k.reminder(now, interval_ms));
        let mut told: Vec<Gossip> = reminders.take(max / 4).collect();
        let max = max - told.len();
        let urgent = self.known.iter().filter(|(_, k)| k.is_news(now));
        let mut ids: Vec<u16> = urgent.map(|(id, _)| *id).collect();
        // Nobody can refute a suspicion before it is told. Then the latest news: a flood of them
        // must not starve the last one.
        let order = |k: &Known| (k.is_untold_suspicion, Reverse(k.news_told), k.urgent_until);
        ids.sort_by_key(|id| Reverse(self.known.get(id).map(order)));
        ids.truncate(max / 2);
        let others = self.known.iter().filter(|(id, _)| !ids.contains(id));
        let wanted = others.filter(|(_, k)| k.is_wanted(now));
        let mut wanted: Vec<(Reverse<(u64, u64)>, u16)> =
            wanted.map(|(id, k)| (Reverse(k.want(now)), *id)).collect();
        wanted.sort_unstable();
        let room = max - ids.len();
        ids.extend(
            wanted
                .iter()
                .take(room - room.div_ceil(3))
                .map(|(_, id)| *id),
        );
        let rotation = self
            .known
            .range(self.next_gossip..)
            .chain(self.known.range(..self.next_gossip));
        let rest: Vec<u16> = rotation
            .map(|(id, _)| *id)
            .filter(|id| !ids.contains(id))
            .take(max - ids.len())
            .collect();
        if let Some(last) = rest.last() {
            self.next_gossip = last.wrapping_add(1);
        }
        ids.extend(rest);
        let own_ms = self.own_interval_ms();
        for id in &ids {
            if let Some(known) = self.known.get_mut(id) {
                known.tell(now);
                known.tell_news(now, own_ms);
            }
        }
        let entries = ids.iter().filter_map(|id| self.known.get(id));
        told.extend(entries.map(|k| k.gossip(now, interval_ms)));
        told
    }

    /// Fewest hops to the farthest live author of the last 10 T'.
    #[must_use]
    pub fn eccentricity(&self, now: Time) -> u8 {
        let window_ms = self.window_ms(self.extent(now).interval);
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
        let Patience {
            interval_ms,
            k1_quarters,
            ..
        } = self.patience(now);
        let silent = |heard: Time| now.since_ms(heard) >= interval_ms * k1_quarters / 4;
        self.last_heard.is_some_and(silent)
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
        heard: Some(now),
        place: Some(OffLoop {
            east_mm: beacon.east_mm,
            north_mm: beacon.north_mm,
            course_e4: beacon.heading_e4,
            ready_ms: 0,
        }),
    }
}
