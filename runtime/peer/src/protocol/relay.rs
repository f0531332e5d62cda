//! What a peer holds of everybody, and what it passes on.
//!
//! Records travel by two ways: a relayed record is passed on once when it is new
//! (unless enough copies were heard first), and beacons tell neighbours which
//! versions a peer holds, so that whoever has newer ones puts them on the air again.
//! So a record reaches everybody that a chain of meetings reaches, also long after
//! its author died.
//!
//! | record | event | what follows |
//! |---|---|---|
//! | unknown, or of an older version | it is heard | held; passed on after 20 to 260 ms, if it made fewer than 16 hops |
//! | held in this version | a copy is heard | with the second copy it is not passed on any more; all that its author says itself are one |
//! | an order | it is heard | passed on before all else, by everybody once |
//! | held in a newer version, or of an earlier life and no piece of a mission | it is heard | nothing |
//! | any of an author but pieces of missions | a later life of the author is heard | void: neither held nor sent |
//! | held | a neighbour's beacon shows that it lacks it | sent again, once in 2 T, unless somebody was heard doing so |
//! | this peer's own, and nobody was heard passing it on | a neighbour's beacon shows other records of this peer than it holds | sent again, once, whatever that neighbour has that is newer |
//! | less of an author than a neighbour's beacon shows, or other versions | that beacon is heard | one of the next beacons tells of that author, so that who has them says them again |
//! | pieces of a mission | pieces of a newer one of its author come | held until that one is whole and followed; said again once no more of it come (the module `pieces`) |
//! | a piece of a mission | a neighbour lacks it: its beacon, the last ten intervals considered, shows an older revision, and it says no pieces of that mission or this one; else it only is held | passed on, or sent again as to who lacks it |
//! | a piece of a mission | it is due | of all that wait goes first what is new in a revision, until somebody passes it on or it was said eight times, then what was never on the air, then what most lack, what nobody passed on, what was on the air longest ago |
//! | this peer's own | it is written | held; sent at once, a bid within 200 ms |
//! | this peer's own bid, claim or order | it was sent, and nobody is heard passing it on | sent again, twice at most |
//! | waiting | the share allows it, it is this peer's own bid or claim and was not sent yet, or its coverage and as much else went since the last of it, or nothing is due earlier | sent |
//! | waiting for its random time | something is sent, one transmission holds both, and more than twelve share the channel | sent with it |
//! | waiting | its lifetime is over, or the queue is full of what is more urgent | not sent |
//!
//! Everything a peer sends is paid for from its share of the channel, [`Airtime`]. Newer values replace older ones of the same key in the queue.
//!
//! Pieces of missions are most of what there is to say, and all know the first mission before
//! they start: they are no part of what a beacon tells of an author's records, so that one
//! other record lacked does not bring them all again. Nor are trails, which are as long and which
//! their authors say again in turn.

use crate::Incarnation;
use crate::input::Time;
use crate::library::pieces_from_end;
use crate::output::Priority;
use crate::protocol::airtime::{Airtime, LASTING_INTERVALS};
use crate::wire::codec::{self, Body};
use crate::wire::key;
use crate::wire::kinds::Kind;
use crate::wire::limits::{CHUNKS_MAX, HOPS_MAX, PEERS_MAX};
use crate::wire::message::{Beacon, Gossip, Lacking, MissionChunk, Record};
use core::cmp::Reverse;
use skein_geometry::hash::Fnv;
mod digest;
#[cfg(test)]
mod many_relays;
mod pieces;
mod queue;
mod wants;

pub use queue::MAX_QUEUE;
use queue::{Queue, Standing, Waiting};
use std::collections::{BTreeMap, BTreeSet};
use wants::{Mission, Wants};

/// Most records held: 256 peers with a state, a bid, a claim, an order, a finish and
/// four events each, and two missions of 256 pieces, the one that is followed and a newer one.
pub const MAX_RECORDS: usize = PEERS_MAX * 9 + 2 * CHUNKS_MAX as usize;

/// A record is not passed on if so many copies of it were heard first: one is not enough
/// where three in ten are lost. Copies count, not neighbours: of two from one neighbour
/// the second has reached others too.
const COPIES_HEARD: u8 = 2;

/// A passed-on record waits at least this long, milliseconds, so that its first copies
/// are heard before the next one is sent.
const RELAY_DELAY_MS: u64 = 20;

/// And a random time up to this longer for each who shares the channel, milliseconds: a
/// neighbour that passes on a bid of 110 bytes needs 15 ms of air.
const RELAY_SPREAD_MS: u64 = 30;

/// What a neighbour lacks is not urgent: the random time before it is sent is up to
/// this long for each who shares the channel, milliseconds.
const REPAIR_SPREAD_MS: u64 = 40;

/// A round is opened by one bid that all the others answer: each waits a random time
/// up to this long for each who shares the channel, milliseconds.
const BID_SPREAD_MS: u64 = 25;

/// This peer's own bid, claim or order is sent again so often while nobody is heard passing
/// it on: what hidden stations spoil would else wait for a beacon that shows the lack.
const REPEATS: u8 = 2;

/// Neighbours pass a record on within the time of one relay, and their own transmissions.
const REPEAT_DELAYS: u64 = 2;

/// Even in small swarms the random times are those of so many.
const LEAST_SPREAD: u64 = 8;

/// What is new in a revision goes before its other pieces until this peer has said it so often.
const PRESSED_TIMES: u8 = 8;

/// A piece of a mission takes as long as this of a peer's share, in intervals: each one that
/// waits is due so much later, and what is said meanwhile goes before it.
const PIECE_INTERVALS: u64 = 3;

/// Where it is not told which of an author's records are lacking, so many of its newest are said
/// again, and as many others in turn: most often what came last did not arrive.
const NEWEST: usize = 4;

/// What was on the air within this part of an interval before a neighbour told what it lacks
/// may have been on the way to it.
const ON_THE_WAY: u64 = 4;

/// What became of a record that was heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Offer {
    /// Newer than what was held.
    New,
    /// Held already.
    Duplicate,
    /// Older than what is held.
    Stale,
}

/// A transmission that may go out now.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Out {
    /// The natural key.
    pub key: String,
    /// The record.
    pub bytes: Vec<u8>,
    /// Hops it has made so far.
    pub hops: u8,
    /// Which goes first.
    pub priority: Priority,
    /// Worth sending for this long, milliseconds.
    pub lifetime_ms: u32,
}

/// Author, kind, subject, and of a piece of a mission its revision, else 0: an author's records
/// lie together.
type RecordKey = (u16, u8, u16, u32);

/// The key of a record that says so much of a mission, if it is a piece of one.
fn key_of(record: &Record, piece: Option<&MissionChunk>) -> RecordKey {
    let revision = piece.map_or(0, |piece| piece.revision);
    (record.author, record.kind, record.subject, revision)
}

/// Whether a record is part of what a beacon tells of its author's records.
fn is_counted(kind: Kind) -> bool {
    kind.relayed() && !matches!(kind, Kind::Mission | Kind::Trail | Kind::Crowd)
}

/// What a record says of the mission of which it is a piece.
fn piece_of(kind: Kind, record: &Record) -> Option<MissionChunk> {
    // Most records are none: only a piece is decoded a second time.
    if kind != Kind::Mission {
        return None;
    }
    match codec::decode_body(kind, &record.body) {
        Ok(Body::Mission(piece)) => Some(piece),
        _ => None,
    }
}

/// The mission, and how many pieces it has; none and 0 of what is no piece.
fn mission_of(piece: Option<&MissionChunk>) -> (Option<Mission>, u16) {
    let mission = piece.map(|piece| (piece.revision, piece.content_hash));
    (mission, piece.map_or(0, |piece| piece.chunks))
}

/// Leaves of records `(key, seq, kind)` of which a beacon of this number may lack one those that it
/// most likely does, and others in turn; of kinds of which digests tell all.
fn leave_likely(lacking: &mut Vec<(RecordKey, u32, Kind)>, beacon: u32) {
    let (mut left, mut untold): (Vec<_>, Vec<_>) = lacking
        .drain(..)
        .partition(|(_, _, kind)| digest::is_told(*kind));
    untold.sort_unstable_by_key(|(_, seq, _)| Reverse(*seq));
    let mut others = untold.split_off(untold.len().min(NEWEST));
    if others.len() > NEWEST {
        let mut turn = Fnv::new();
        turn.write(&beacon.to_le_bytes());
        let first = (turn.finish() >> 16) % others.len() as u64;
        others.rotate_left(usize::try_from(first).unwrap_or(0));
        others.truncate(NEWEST);
    }
    left.extend(untold);
    left.extend(others);
    left.sort_unstable_by_key(|(key, ..)| *key);
    *lacking = left;
}

fn is_piece(key: &RecordKey) -> bool {
    key.1 == Kind::Mission.number()
}

/// Whether a record is an order that this peer has not passed on yet: everybody does, once.
fn is_for_all(key: &RecordKey, held: &Held) -> bool {
    key.1 == Kind::Operator.number() && held.said == 0
}

/// All keys of one author.
fn keys_of(author: u16) -> core::ops::RangeInclusive<RecordKey> {
    (author, 0, 0, 0)..=(author, u8::MAX, u16::MAX, u32::MAX)
}

#[derive(Clone, Debug)]
struct Held {
    record: Record,
    bytes: Vec<u8>,
    hops: u8,
    copies: u8,
    /// Whether this version was heard once more since it is held here.
    is_passed_on: bool,
    /// How often this peer's own record may be sent again yet.
    repeats: u8,
    /// Of which mission it is a piece.
    mission: Option<Mission>,
    /// How many pieces that mission has.
    pieces: u16,
    /// Whether it is a piece that the revisions before, of which pieces are held, have not at its
    /// place.
    changed: bool,
    /// How often this peer said it.
    said: u8,
    /// When this version came.
    came: Time,
    /// How many neighbours told since it was last on the air that they lack this piece.
    lack: usize,
    /// When somebody, this peer included, was last heard sending this version.
    sent: Time,
}

/// Whether it presses no more, whether it was on the air, how many lack it, whether anybody passed
/// it on, and when it was on the air last; and how far it is from the nearer end of its mission.
type Turn = (bool, bool, Reverse<usize>, bool, Time, u16);

impl Held {
    /// Among pieces: first what is new in this revision, until it was said a few times or passed on:
    /// with it who holds the revision before has all. Then what nobody can have, then what most
    /// lack, of those what nobody was heard passing on, and what was on the air longest ago. Pieces
    /// that waited in vain till their lifetime was over would else wait behind the same ones again,
    /// for ever. Then the ends of a mission, where most of what is new is.
    fn turn(&self, key: &RecordKey) -> Turn {
        let lack = Reverse(self.lack);
        let from_end = pieces_from_end(key.2, self.pieces);
        let presses = self.changed && !self.is_passed_on && self.said < PRESSED_TIMES;
        let is_said = self.copies > 0;
        (
            !presses,
            is_said,
            lack,
            self.is_passed_on,
            self.sent,
            from_end,
        )
    }
}

/// The relay of one peer.
#[derive(Clone, Debug)]
pub struct Relay {
    me: u16,
    /// What this peer may send.
    pub air: Airtime,
    fleet: String,
    held: BTreeMap<RecordKey, Held>,
    queue: Queue,
    answered: BTreeMap<u16, Time>,
    /// Authors of whom neighbours have what this peer may lack, since its last beacon.
    behind: BTreeSet<u16>,
    wants: Wants,
    /// Which revision this peer's last beacon showed.
    follows: u32,
    /// The newest revision of which a piece was held.
    newest_piece: u32,
    salt: u64,
}

impl Relay {
    /// An empty relay of `me` on a channel of `rate_bps`, beacon period in milliseconds.
    #[must_use]
    pub fn new(me: u16, fleet: &str, rate_bps: u32, period_ms: u32) -> Self {
        Self {
            me,
            fleet: fleet.to_owned(),
            air: Airtime::new(rate_bps, period_ms),
            held: BTreeMap::new(),
            queue: Queue::new(),
            answered: BTreeMap::new(),
            behind: BTreeSet::new(),
            wants: Wants::default(),
            follows: 0,
            newest_piece: 0,
            salt: u64::from(me).wrapping_mul(0x9E37_79B9_7F4A_7C15),
        }
    }

    /// A new life of this peer: its own old records are void.
    pub fn new_life(&mut self) {
        let me = self.me;
        self.held.retain(|k, _| k.0 != me);
        self.queue.remove_author(me);
    }

    /// A record of this peer's own: held, and queued at once.
    pub fn own(&mut self, now: Time, record: &Record, bytes: Vec<u8>) {
        let Some(kind) = Kind::of_number(record.kind) else {
            return;
        };
        let piece = piece_of(kind, record);
        let key = key_of(record, piece.as_ref());
        let (mission, pieces) = mission_of(piece.as_ref());
        let vital = kind.priority() <= Priority::Claim;
        self.hold(
            key,
            Held {
                record: record.clone(),
                bytes,
                hops: 0,
                copies: 0,
                is_passed_on: false,
                repeats: if vital { REPEATS } else { 0 },
                mission,
                pieces,
                changed: self.is_changed(&key, piece.as_ref()),
                said: 0,
                came: now,
                lack: 0,
                sent: now,
            },
        );
        if !self.held.contains_key(&key) || !self.is_wanted(now, &key) {
            return;
        }
        let delay = if kind == Kind::Bid {
            self.jitter(&key, (record.incarnation, record.seq)) % self.spread_ms(BID_SPREAD_MS)
        } else {
            0
        };
        self.wait(now, key, kind, delay);
    }

    /// A record of somebody else's that was heard.
    pub fn offer(&mut self, now: Time, record: &Record, bytes: &[u8], hops: u8) -> Offer {
        let version = (record.incarnation, record.seq);
        let Some(kind) = Kind::of_number(record.kind) else {
            return Offer::Stale;
        };
        let piece = piece_of(kind, record);
        let key = key_of(record, piece.as_ref());
        if let Some(h) = self.held.get_mut(&key) {
            let known = (h.record.incarnation, h.record.seq);
            if version < known {
                return Offer::Stale;
            }
            if version == known {
                // What its author says again reaches those whom it reached before. Of pieces it is
                // told who lacks them.
                let is_repeated = hops == 0 && h.hops == 1 && !is_piece(&key);
                h.copies = if is_repeated {
                    h.copies.max(1)
                } else {
                    h.copies.saturating_add(1)
                };
                h.is_passed_on = true;
                h.lack = 0;
                h.sent = now;
                // A copy by a shorter way: what is passed on has made fewer hops.
                h.hops = h.hops.min(hops.saturating_add(1));
                if h.copies >= COPIES_HEARD && !is_for_all(&key, h) {
                    self.queue.remove(&key);
                }
                return Offer::Duplicate;
            }
        }
        let (mission, pieces) = mission_of(piece.as_ref());
        if mission.is_none() && self.newest_life(record.author) > record.incarnation {
            return Offer::Stale;
        }
        self.void(record.author, record.incarnation);
        let hops = hops.saturating_add(1);
        let held = Held {
            record: record.clone(),
            bytes: bytes.to_vec(),
            hops,
            copies: 1,
            is_passed_on: false,
            repeats: 0,
            mission,
            pieces,
            changed: self.is_changed(&key, piece.as_ref()),
            said: 0,
            came: now,
            lack: 0,
            sent: now,
        };
        self.hold(key, held);
        if !self.held.contains_key(&key) {
            return Offer::Stale;
        }
        if kind.relayed() && hops < HOPS_MAX && self.is_wanted(now, &key) {
            let delay =
                RELAY_DELAY_MS + self.jitter(&key, version) % self.spread_ms(RELAY_SPREAD_MS);
            self.wait(now, key, kind, delay);
        }
        Offer::New
    }

    /// This peer's own record is heard: a neighbour passes it on, so it was received.
    pub fn echo(&mut self, record: &Record) {
        let piece = Kind::of_number(record.kind).and_then(|kind| piece_of(kind, record));
        let key = key_of(record, piece.as_ref());
        let version = (record.incarnation, record.seq);
        if let Some(held) = self.held.get_mut(&key)
            && (held.record.incarnation, held.record.seq) == version
            && held.copies > 0
        {
            held.copies = held.copies.saturating_add(1);
            held.is_passed_on = true;
            held.repeats = 0;
            self.queue.remove(&key);
        }
    }

    /// Whether some neighbour may need a record: a piece of a mission only if it lacks it and no
    /// newer one comes.
    fn is_wanted(&self, now: Time, key: &RecordKey) -> bool {
        let comes = is_piece(key) && key.3 < self.coming(now, key.0);
        !comes && self.is_lacking(now, key)
    }

    /// Whether some neighbour lacks a piece of a mission; all else may be lacking.
    fn is_lacking(&self, now: Time, key: &RecordKey) -> bool {
        let mission = self.held.get(key).and_then(|h| h.mission);
        mission.is_none_or(|mission| self.wants.is_wanted(now, mission, key.2))
    }

    fn newest_life(&self, author: u16) -> Incarnation {
        self.held
            .range(keys_of(author))
            .map(|(_, h)| h.record.incarnation)
            .max()
            .unwrap_or(0)
    }

    /// A later life supersedes all that earlier ones said: it is neither held nor
    /// sent any more. Pieces of a mission stay: they count by its revision, and whoever holds
    /// them may be the only one in reach who does.
    fn void(&mut self, author: u16, incarnation: Incarnation) {
        let is_past = |held: &Held| held.record.incarnation < incarnation;
        self.forget(author, |held| is_past(held) && held.mission.is_none());
    }

    /// Such records of an author are neither held nor sent any more.
    fn forget(&mut self, author: u16, is_past: impl Fn(&Held) -> bool) {
        let past = self.held.range(keys_of(author));
        let past = past.filter(|(_, held)| is_past(held));
        let past: Vec<RecordKey> = past.map(|(key, _)| *key).collect();
        for key in past {
            self.held.remove(&key);
            self.queue.remove(&key);
        }
    }

    fn spread_ms(&self, each_ms: u64) -> u64 {
        each_ms * self.air.sharers().max(LEAST_SPREAD)
    }

    /// By when a record is to be sent: own coverage at once, what others wrote may wait an
    /// interval, telemetry one or two more. Where all are late, each class gets its part:
    /// nothing waits for ever behind what is more urgent. A piece that nobody passes on, so
    /// that maybe nobody has it, waits only for others of that kind.
    fn due(&self, key: &RecordKey, from: Time, priority: Priority) -> Time {
        let telemetry = priority == Priority::Telemetry;
        let intervals = match (key.0 == self.me, telemetry) {
            // The first of what this peer alone has is said at once: who hears it says what it
            // lacks, and lends.
            (true, true) if is_piece(key) => PIECE_INTERVALS * self.pieces_before(key) as u64,
            _ if is_piece(key) => PIECE_INTERVALS * (1 + self.pieces_before(key) as u64),
            (true, false) => 0,
            (true, true) | (false, false) => 1,
            (false, true) => 3,
        };
        from.plus_ms(intervals * self.air.interval_ms())
    }

    fn pieces_before(&self, key: &RecordKey) -> usize {
        let is_passed_on = |key: &RecordKey| self.held.get(key).is_none_or(|h| h.is_passed_on);
        if is_passed_on(key) {
            return self.queue.n_pieces();
        }
        let waiting = self.queue.pieces();
        waiting.iter().filter(|key| !is_passed_on(key)).count()
    }

    /// What this peer bids and claims itself goes before all else, once: nobody else can say
    /// it; and so does that its mission is finished, which is so short that nothing waits for it.
    /// Sent again it waits its turn, or what this peer has seen would never be said.
    /// Its coverage goes next: nobody passes it on, and claims that others wrote and that wait for
    /// longer than coverage lives would never let it go. But as much of the rest goes between:
    /// after parts of a swarm meet, each has coverage to tell for half a minute.
    fn standing(&self, key: &RecordKey, priority: Priority) -> Standing {
        let unsaid = || self.held.get(key).is_some_and(|h| h.copies == 0);
        let is_end = key.1 == Kind::Finished.number();
        let passes_on = || self.held.get(key).is_some_and(|h| is_for_all(key, h));
        match priority {
            _ if key.0 != self.me && passes_on() => Standing::First,
            _ if key.0 != self.me => Standing::Due,
            Priority::Conflict | Priority::Claim if unsaid() => Standing::First,
            Priority::Telemetry if is_end && unsaid() => Standing::First,
            Priority::Beacon => Standing::Coverage,
            _ => Standing::Due,
        }
    }

    fn jitter(&self, key: &RecordKey, version: (Incarnation, u32)) -> u64 {
        let mut h = Fnv::new();
        for v in [
            u64::from(key.0),
            u64::from(key.1),
            u64::from(key.2),
            u64::from(version.1),
            self.salt,
        ] {
            h.write(&v.to_le_bytes());
        }
        h.finish() >> 16
    }

    /// Another draw for a version that was sent before.
    fn jitter_again(&self, now: Time, key: &RecordKey) -> u64 {
        self.jitter(key, (0, u32::try_from(now.0 & 0xffff_ffff).unwrap_or(0)))
    }

    /// Holds a record, if need be in place of another's: telemetry goes before what
    /// the living and the dead claimed, and what was on the air longest ago first.
    fn hold(&mut self, key: RecordKey, held: Held) {
        if self.held.len() >= MAX_RECORDS && !self.held.contains_key(&key) {
            let me = self.me;
            let urgency = |k: &RecordKey| Kind::of_number(k.1).map(Kind::priority);
            let others = self.held.iter().filter(|(k, _)| k.0 != me);
            let oldest = others.min_by_key(|(k, h)| (core::cmp::Reverse(urgency(k)), h.sent, **k));
            if let Some(k) = oldest.map(|(k, _)| *k) {
                self.held.remove(&k);
                self.queue.remove(&k);
            }
        }
        let mission = held.mission;
        self.held.insert(key, held);
        if let Some((revision, _)) = mission {
            self.newest_piece = self.newest_piece.max(revision);
            self.outdate(key.0, revision);
            self.keep_missions(key.0);
        }
        assert!(self.held.len() <= MAX_RECORDS, "records keep to their cap");
    }

    /// A piece of a mission waits until it is due, however many are before it: those that were
    /// said lately would else wait in front of those whose lifetime is over, for ever.
    fn wait(&mut self, now: Time, key: RecordKey, kind: Kind, delay_ms: u64) {
        self.queue.make_room(&key);
        let row = kind.row();
        let from = now.plus_ms(delay_ms);
        let due = self.due(&key, from, row.priority);
        let lasts_from = if is_piece(&key) { due } else { from };
        let until = lasts_from.plus_ms(u64::from(self.lifetime_ms(kind)));
        let standing = self.standing(&key, row.priority);
        // A later version has waited as long as the one that it replaces.
        let before = self.queue.first_due(&key);
        let before = before.filter(|_| standing == Standing::First);
        self.queue.insert(
            key,
            Waiting {
                from,
                until,
                due: before.map_or(due, |before| before.min(due)),
                priority: row.priority,
                standing,
            },
        );
    }

    /// Whether a record of this peer's own waits to be sent.
    #[must_use]
    pub fn waits(&self, kind: Kind) -> bool {
        self.queue.contains(&(self.me, kind.number(), 0, 0))
    }

    /// Whether a beacon may be said sooner than it is due: nothing is owed, and nothing is saved
    /// for.
    #[must_use]
    pub fn may_hasten(&self, now: Time) -> bool {
        self.air.is_in_credit() && !self.saves(now)
    }

    /// Whether something may be asked for at once, or such a question answered.
    pub fn may_answer(&mut self, now: Time) -> bool {
        let saves = self.saves(now);
        self.air.may_answer(now, saves)
    }

    /// Whether something that this peer alone can say has waited for an interval: the share is
    /// saved for it. Where what is said early took each byte before it, a long claim would never
    /// go.
    fn saves(&self, now: Time) -> bool {
        self.queue.waits_first(now, self.air.interval_ms())
    }

    /// How long a record of this kind is worth sending, milliseconds.
    #[must_use]
    pub fn lifetime_ms(&self, kind: Kind) -> u32 {
        kind.lifetime_ms(u32::try_from(self.air.interval_ms()).unwrap_or(u32::MAX))
    }

    /// A neighbour's beacon: what it lacks is queued for it.
    pub fn on_beacon(&mut self, now: Time, author: u16, beacon: &Beacon) {
        self.air
            .hear(now, author, (beacon.interval, beacon.sharers));
        let window = 2 * self.air.interval_ms();
        self.answered.retain(|_, t| now.since_ms(*t) < window);
        self.bring_mission(now, author, beacon);
        // What is told of somebody last counts.
        let mut theirs: Vec<&Gossip> = beacon.gossip.iter().rev().collect();
        theirs.sort_by_key(|g| g.id);
        theirs.dedup_by_key(|g| g.id);
        for g in theirs.into_iter().filter(|g| g.id != author) {
            self.catch_up(now, g, beacon.heartbeat);
        }
    }

    /// Notes what a neighbour follows, and queues the pieces of missions that it may lack.
    fn bring_mission(&mut self, now: Time, author: u16, beacon: &Beacon) {
        let interval_ms = self.air.told_ms(beacon.interval);
        let spans_ms = (interval_ms, LASTING_INTERVALS * interval_ms);
        self.wants.on_beacon(now, author, beacon.revision, spans_ms);
        self.queue_pieces(now, beacon.revision < self.newest_piece);
    }

    /// A neighbour says which pieces of a mission it lacks.
    pub fn on_lacking(&mut self, now: Time, author: u16, lacking: &Lacking) {
        self.wants.on_lacking(now, author, lacking);
        self.queue_pieces(now, self.newest_piece > 0);
    }

    /// Takes out the pieces that nobody lacks any more, and queues those that somebody lacks,
    /// `wanted` by the one that was heard.
    fn queue_pieces(&mut self, now: Time, wanted: bool) {
        self.borrow(now);
        let waiting = self.queue.pieces();
        if waiting.is_empty() && !wanted {
            return;
        }
        let coming = self.all_coming(now);
        for key in waiting {
            let newest = coming.get(&key.0).copied().unwrap_or(0);
            if key.3 < newest || !self.is_lacking(now, &key) {
                self.queue.remove(&key);
            }
        }
        if !wanted {
            return;
        }
        // What was said a moment ago may not have arrived when its want was told.
        let on_the_way_ms = self.air.interval_ms() / ON_THE_WAY;
        let mut lacking: Vec<(Turn, RecordKey)> = Vec::new();
        for (key, held) in &mut self.held {
            let newest = coming.get(&key.0).copied().unwrap_or(0);
            let Some(mission) = held.mission.filter(|m| m.0 >= newest) else {
                continue;
            };
            let said = (held.copies > 0).then(|| held.sent.plus_ms(on_the_way_ms));
            held.lack = self.wants.lacking(now, (mission, key.2), said);
            if held.lack > 0 && !self.queue.contains(key) {
                lacking.push((held.turn(key), *key));
            }
        }
        lacking.sort_unstable();
        for (_, key) in lacking {
            self.send_again(now, key, Kind::Mission);
        }
    }

    /// This peer's beacon shows this revision.
    pub fn follow(&mut self, now: Time, revision: u32) {
        if core::mem::replace(&mut self.follows, revision) != revision {
            self.keep_all_missions();
        }
        self.borrow(now);
    }

    /// This peer says which pieces of a mission it lacks, or none any more.
    pub fn lack(&mut self, now: Time, lacking: Option<&Lacking>) {
        self.air.lend(now, lacking.is_some_and(wants::lends));
    }

    /// The newest revision that a neighbour follows.
    #[must_use]
    pub fn newest(&self, now: Time) -> u32 {
        self.wants.newest(now)
    }

    /// How many neighbours follow this revision or a newer one.
    #[must_use]
    pub fn holders(&self, now: Time, revision: u32) -> u16 {
        self.wants.holders(now, revision)
    }

    /// What neighbours lend is for the pieces that they lack.
    fn borrow(&mut self, now: Time) {
        let lent = self.wants.lent_permille(now, self.follows);
        self.air.borrow(now, lent);
    }

    /// Queues a record that a neighbour lacks.
    fn send_again(&mut self, now: Time, key: RecordKey, kind: Kind) {
        let delay =
            RELAY_DELAY_MS + self.jitter_again(now, &key) % self.spread_ms(REPAIR_SPREAD_MS);
        if let Some(h) = self.held.get_mut(&key) {
            // Who lacks a piece says so again: one more copy on the air is enough.
            h.copies = if kind == Kind::Mission {
                h.copies.min(1)
            } else {
                0
            };
        }
        self.wait(now, key, kind, delay);
    }

    /// Queues what a neighbour lacks of one author's records, as its beacon of this number tells.
    fn catch_up(&mut self, now: Time, theirs: &Gossip, beacon: u32) {
        let Gossip {
            id: author,
            incarnation,
            max_seq,
            digest,
            ..
        } = *theirs;
        let quiet = 2 * self.air.interval_ms();
        if self
            .answered
            .get(&author)
            .is_some_and(|t| now.since_ms(*t) < quiet)
        {
            return;
        }
        let life = self.newest_life(author);
        let (mine_seq, mine_digest) = self.version(author, life, beacon);
        if (life, mine_seq, mine_digest) == (incarnation, max_seq, digest) {
            return;
        }
        let known = self.behind.len() < PEERS_MAX && author != self.me;
        if known && max_seq > 0 && (life, mine_seq) <= (incarnation, max_seq) {
            self.behind.insert(author);
        }
        if life == 0 || (life, mine_seq) < (incarnation, max_seq) {
            return;
        }
        self.answered.insert(author, now);
        // Of equal numbers the digests tell of which kinds the versions differ.
        let differs = |kind| match (life > incarnation, mine_seq == max_seq) {
            (true, _) => true,
            (false, true) => digest::differs(kind, mine_digest, digest),
            (false, false) => false,
        };
        // What nobody passed on that this peer said has arrived nowhere, whatever came later.
        let is_unheard = |h: &Held| author == self.me && !h.is_passed_on;
        let lacking = self.held.range(keys_of(author)).filter(|(_, h)| {
            h.record.incarnation == life && (now.since_ms(h.sent) >= quiet || h.copies == 0)
        });
        let lacking = lacking
            .filter_map(|(k, h)| Kind::of_number(k.1).map(|kind| (*k, h, kind)))
            .filter(|(_, _, kind)| is_counted(*kind))
            .filter(|(_, h, kind)| h.record.seq > max_seq || differs(*kind) || is_unheard(h));
        let mut lacking: Vec<(RecordKey, u32, Kind)> = lacking
            .map(|(key, h, kind)| (key, h.record.seq, kind))
            .collect();
        if (life, mine_seq) == (incarnation, max_seq) {
            leave_likely(&mut lacking, beacon);
        }
        for (key, _, kind) in lacking {
            if self.queue.contains(&key) {
                continue;
            }
            self.send_again(now, key, kind);
            // Once: whoever hears it now may have passed it on before.
            if let Some(held) = self.held.get_mut(&key).filter(|_| author == self.me) {
                held.is_passed_on = true;
            }
        }
    }

    /// Of whom neighbours have what this peer may lack, as beacons showed since it was asked last:
    /// by the ids of the authors.
    pub fn take_behind(&mut self) -> BTreeSet<u16> {
        core::mem::take(&mut self.behind)
    }

    /// The versions held of an author's records of one life, pieces of missions left out:
    /// highest `seq`, digest as a beacon of this number tells it.
    #[must_use]
    pub fn version(&self, author: u16, incarnation: Incarnation, beacon: u32) -> (u32, u16) {
        let counted = self.held.range(keys_of(author)).filter(|(key, held)| {
            held.record.incarnation == incarnation && Kind::of_number(key.1).is_some_and(is_counted)
        });
        let versions = counted.map(|(key, held)| (key.1, key.2, held.record.seq));
        let max = versions.clone().map(|(_, _, seq)| seq).max();
        (max.unwrap_or(0), digest::of(versions, beacon))
    }

    /// All records held, newest versions, by author, kind and subject.
    #[must_use]
    pub fn records(&self) -> Vec<Record> {
        self.held.values().map(|h| h.record.clone()).collect()
    }

    /// What may go out now, the most urgent first; `None` when nothing may.
    pub fn poll(&mut self, now: Time) -> Option<Out> {
        self.queue.expire(now);
        let lent = self.lent_turn(now);
        let lent = lent.filter(|(_, bytes)| self.air.pay_lent(now, *bytes));
        let (key, priority) = match lent {
            Some((key, _)) => (key, Kind::Mission.priority()),
            None => {
                let (key, priority) = self.first(now)?;
                (self.in_its_place(now, key), priority)
            }
        };
        let kind = Kind::of_number(key.1)?;
        let lifetime_ms = self.lifetime_ms(kind);
        let held = self.held.get_mut(&key)?;
        if lent.is_none() && !self.air.pay(now, held.bytes.len()) {
            return None;
        }
        let share_bytes = if lent.is_none() { held.bytes.len() } else { 0 };
        self.queue.sent(&key, share_bytes);
        held.lack = 0;
        held.sent = now;
        held.copies = held.copies.saturating_add(1);
        held.said = held.said.saturating_add(1);
        let out = Out {
            key: key::key(&self.fleet, kind, key.2, key.0),
            bytes: held.bytes.clone(),
            hops: held.hops,
            priority,
            lifetime_ms,
        };
        if held.repeats > 0 && self.air.counted() > 1 {
            held.repeats -= 1;
            let spread_ms = self.spread_ms(RELAY_SPREAD_MS);
            let delay_ms = REPEAT_DELAYS * spread_ms + self.jitter_again(now, &key) % spread_ms;
            self.wait(now, key, kind, delay_ms);
        }
        Some(out)
    }

    /// The piece that goes next from what neighbours lent, and its bytes.
    fn lent_turn(&self, now: Time) -> Option<(RecordKey, usize)> {
        if !self.air.borrows() {
            return None;
        }
        let key = self.first_piece(now)?;
        Some((key, self.held.get(&key)?.bytes.len()))
    }

    /// When a piece may go is a question of what else waits; which goes is told by who lacks it.
    fn instead(&self, now: Time, key: RecordKey) -> RecordKey {
        let first = is_piece(&key).then(|| self.first_piece(now)).flatten();
        first.unwrap_or(key)
    }

    /// The same, and what is not sent gets the turn of what is.
    fn in_its_place(&mut self, now: Time, key: RecordKey) -> RecordKey {
        let first = self.instead(now, key);
        self.queue.swap(&key, &first);
        first
    }

    /// What goes next: it is its turn, or it can share the headers of what goes now.
    fn first(&self, now: Time) -> Option<(RecordKey, Priority)> {
        if !self.air.is_crowded() || !self.air.is_filling(now) {
            return self.queue.turn(now).first;
        }
        // What was sent a moment ago is sent again only for being later.
        let again = |k: &RecordKey, h: &Held| k.0 == self.me && h.copies > 0;
        self.queue.first(now, |k| {
            let held = self.held.get(k).filter(|h| !again(k, h));
            held.is_some_and(|h| self.air.joins(now, h.bytes.len()))
        })
    }

    /// When [`Relay::poll`] may have something, if it ever will.
    #[must_use]
    pub fn next_timeout(&self, now: Time) -> Option<Time> {
        let turn = self.queue.turn(now);
        if turn.first.is_none() {
            return (self.queue.len() > 0).then_some(turn.next);
        }
        let (key, _) = self.first(now)?;
        let key = self.instead(now, key);
        let bytes = self.held.get(&key)?.bytes.len();
        let own = now.plus_ms(self.air.wait_ms(now, bytes));
        if !self.air.borrows() {
            return Some(own);
        }
        let lent = self.lent_turn(now);
        let lent = lent.map(|(_, bytes)| now.plus_ms(self.air.wait_lent_ms(now, bytes)));
        Some(own.min(lent.unwrap_or(turn.next)))
    }

    /// What is held and what waits, each with its cap.
    #[must_use]
    pub fn loads(&self) -> [(&'static str, usize, usize); 3] {
        [
            ("records", self.held.len(), MAX_RECORDS),
            ("queue", self.queue.len(), MAX_QUEUE),
            self.air.load(),
        ]
    }
}

#[cfg(test)]
mod tests;
