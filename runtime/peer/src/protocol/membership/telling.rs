//! What a beacon and a heartbeat say of others: of whom first, and how much.

use super::known::Known;
use crate::input::Time;
use crate::protocol::airtime::{ENTRY_BYTES, FRESH_BYTES};
use crate::wire::message::{Fresh, Gossip};
use core::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

/// A heartbeat carries so many of others at most: then it is half as long as a beacon.
const BETWEEN_MAX: usize = 8;

/// Of a heartbeat that is older than such a part of the bound a later one is asked for, by
/// telling it: most that are known are younger, and the rest of the bound is for the answer.
const OLD: u64 = 4;

/// For each again after so many intervals: each neighbour has spoken twice by then.
const ASK_INTERVALS: u64 = 2;

/// All that are known, by their ids.
type Peers = BTreeMap<u16, Known>;

/// The swarm at the moment in which something is told, as far as the teller knows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    pub(super) now: Time,
    /// Whether somebody is farther than one hop; else nobody has to be told.
    pub(super) is_far: bool,
    /// The longest interval announced, T'.
    pub(super) interval_ms: u64,
    /// What the teller itself announces.
    pub(super) own_interval_ms: u64,
    /// No living peer's heartbeat is older.
    pub(super) bound_ms: u64,
}

/// Whose turn it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Telling {
    /// With whom the rotation goes on.
    next: u16,
    /// So many heartbeats of others the next own one carries.
    between: usize,
    /// Whether the next odd entry is for the rotation.
    rotates: bool,
}

impl Telling {
    /// Neighbours tell of different peers: the rotation begins with the next id after their own.
    pub(super) fn new(me: u16) -> Self {
        Self {
            next: me,
            between: 0,
            rotates: false,
        }
    }

    /// What to say of others in the room of so many entries: where not everybody fits, a
    /// quarter of it is for whole entries and another for news, the rest for heartbeats alone,
    /// of those first of whom it gains most to tell. Half of these go with the heartbeat between
    /// this beacon and the next ([`Telling::between`]). One of them asks: it is told since
    /// it is old, and whoever knows a later one tells that.
    pub(super) fn tell(
        &mut self,
        peers: &mut Peers,
        moment: Moment,
        entries: usize,
        behind: &BTreeSet<u16>,
    ) -> (Vec<Gossip>, Vec<Fresh>) {
        if peers.len() <= entries {
            self.between = 0;
            return (
                self.whole(peers, moment, entries, &BTreeSet::new()),
                Vec::new(),
            );
        }
        let untold = |k: &&Known| k.is_untold_news(moment.now);
        let news = peers.values().filter(untold).count();
        let full = entries.div_ceil(4) + news.min(entries / 4);
        let told = self.whole(peers, moment, full, behind);
        let room = (entries - full) * ENTRY_BYTES / FRESH_BYTES;
        self.between = room.div_ceil(2).min(BETWEEN_MAX);
        let fresh = heartbeats(peers, moment, &told, room - self.between, true);
        (told, fresh)
    }

    /// What the next heartbeat says of others: those that the last beacon had no room for.
    /// It is short, so it often arrives where a beacon does not.
    pub(super) fn between(&mut self, peers: &mut Peers, moment: Moment) -> Vec<Fresh> {
        let room = std::mem::take(&mut self.between);
        heartbeats(peers, moment, &[], room, false)
    }

    /// Whole entries of others: at most `max`. Who began a life anew without
    /// knowing is reminded first (a quarter of the entries at most), then news (half of
    /// the rest at most), then those whom a neighbour is farther from than this peer (two
    /// thirds of the rest), then those `behind` whose records neighbours have newer (half of the
    /// rest, of one entry every other time; ground stations first), then all in
    /// rotation, so that nobody is left out for long. The relay fills in the versions of records.
    pub(super) fn whole(
        &mut self,
        peers: &mut Peers,
        moment: Moment,
        max: usize,
        behind: &BTreeSet<u16>,
    ) -> Vec<Gossip> {
        let (now, interval_ms) = (moment.now, moment.interval_ms);
        let intervals_ms = (interval_ms, moment.own_interval_ms);
        let reminders = peers.values().filter_map(|k| k.reminder(now, intervals_ms));
        let mut told: Vec<Gossip> = reminders.take(max.div_ceil(4)).collect();
        for reminder in &told {
            if let Some(known) = peers.get_mut(&reminder.id) {
                known.remind(now);
            }
        }
        let max = max - told.len();
        let urgent = peers.iter().filter(|(_, k)| k.is_news(now));
        let mut ids: Vec<u16> = urgent.map(|(id, _)| *id).collect();
        // Nobody can refute a suspicion before it is told. Then the latest news: a flood of them
        // must not starve the last one.
        let order = |k: &Known| (k.is_untold_suspicion, Reverse(k.news_told), k.urgent_until);
        ids.sort_by_key(|id| Reverse(peers.get(id).map(order)));
        ids.truncate(max / 2);
        let others = peers.iter().filter(|(id, _)| !ids.contains(id));
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
        let in_turn = |next: u16| peers.range(next..).chain(peers.range(..next));
        let room = max - ids.len();
        let asked = in_turn(self.next);
        let asked = asked.filter(|(id, _)| behind.contains(id) && !ids.contains(id));
        let mut asked: Vec<(bool, u16)> =
            asked.map(|(id, k)| (!k.info.ground_station, *id)).collect();
        // What a ground station says others wait for.
        asked.sort_by_key(|(is_uav, _)| *is_uav);
        let room = self.for_those_behind(room);
        ids.extend(asked.into_iter().take(room).map(|(_, id)| id));
        let rest: Vec<u16> = in_turn(self.next)
            .map(|(id, _)| *id)
            .filter(|id| !ids.contains(id))
            .take(max - ids.len())
            .collect();
        if let Some(last) = rest.last() {
            self.next = last.wrapping_add(1);
        }
        ids.extend(rest);
        for id in &ids {
            if let Some(known) = peers.get_mut(id) {
                known.tell(now);
                known.tell_news(now, moment.own_interval_ms);
            }
        }
        let entries = ids.iter().filter_map(|id| peers.get(id));
        told.extend(entries.map(|k| k.gossip(now, interval_ms)));
        told
    }

    /// Half of so many entries; of an odd one every other time.
    fn for_those_behind(&mut self, room: usize) -> usize {
        if room.is_multiple_of(2) {
            return room / 2;
        }
        self.rotates = !self.rotates;
        if self.rotates {
            room.div_ceil(2)
        } else {
            room / 2
        }
    }
}

/// Heartbeats alone, of those first of whom it gains most, of nobody whose whole entry is
/// told; one of them may ask.
fn heartbeats(
    peers: &mut Peers,
    moment: Moment,
    told: &[Gossip],
    max: usize,
    asks: bool,
) -> Vec<Fresh> {
    let now = moment.now;
    let others = peers
        .iter_mut()
        .filter(|(_, k)| k.is_believed() && (moment.is_far || k.is_wanted(now)));
    let mut wanted: Vec<&mut Known> = others
        .filter(|(id, _)| told.iter().all(|g| g.id != **id))
        .map(|(_, k)| k)
        .collect();
    // Of what was told once and may have been lost the heartbeat alone tells as much.
    let is_old_news = |k: &Known| k.is_news(now) && !k.is_untold_news(now);
    wanted.sort_by_cached_key(|k| {
        let gain = (is_old_news(k), k.want(now));
        (Reverse(gain), k.freshest.id)
    });
    if asks && moment.is_far {
        let old_ms = moment.bound_ms / OLD;
        let again_ms = ASK_INTERVALS * moment.own_interval_ms;
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
        if is_old_news(known) {
            known.tell_news(now, moment.own_interval_ms);
        }
        known.fresh(now, moment.interval_ms)
    };
    wanted.into_iter().map(say).collect()
}
