//! What all of a component hold soon: every record that is passed on (L4), the mission's
//! revision and the operator's order (`agree`), and each open cell in one plan only (L3).

use super::{Bounds, Clocks, Findings, Grade, PeerSnapshot, Snapshot};
use crate::twins::Twins;
use skein_peer::Incarnation;
use skein_peer::cells::CellSet;
use skein_peer::wire::kinds::Kind;
use skein_peer::wire::limits::MEMBERS_MAX;
use skein_peer::wire::message::Record;
use std::collections::BTreeMap;

/// Author, kind, subject.
type Key = (u16, u8, u16);

/// Life and number of a record.
type Version = (Incarnation, u32);

/// A record that a peer lacks: which version at least, and since when.
#[derive(Clone, Copy, Debug)]
struct Lack {
    version: Version,
    since_ms: u64,
    /// How long it had gone on at the last snapshot, and how long it may.
    took_ms: u64,
    bound_ms: u64,
    told: bool,
}

/// What came to whom in one run.
#[derive(Clone, Debug, Default)]
pub struct SpreadCheck {
    /// All records that anybody held, each with its place in the rows of `held`.
    places: BTreeMap<Key, usize>,
    /// Which version each peer holds, by place; (0, 0) of what it does not hold.
    held: BTreeMap<u16, Vec<Version>>,
    lacks: BTreeMap<(u16, Key), Lack>,
    apart: Clocks<(u16, u16, bool)>,
    doubles: Clocks<(u16, u16, u16)>,
    twins: Twins,
    /// Pieces of the longest mission that the operator gave.
    pieces: u64,
}

/// A piece of a mission is 308 bytes of the least urgent kind: at a share of a ninth of
/// 45 % of 64 kbit/s, half of it for beacons, it is due three periods after the one before,
/// on every hop.
const PIECE_PERIODS: u64 = 3;

/// A record that was lost in the flood comes once its receiver has shown that it lacks it:
/// a beacon of a crowd gossips about so many at least, and about all of them in turn.
const GOSSIP_LEAST: u64 = 3;

/// Turns, in intervals, that the bound of L4 allows on a hop as it is: those of eight.
const SMALL_ROTATION: u64 = 3;

/// Beyond the time that a record takes to all: deriving the loop of a revision is
/// modelled to take 200 ms, and a peer looks four times a period; the check looks once.
const LOOK_PERIODS: u64 = 2;

/// So many bounds are what a single record may take, also without a loss, since collisions lose
/// records, too. In some 700 storms 3.6 was measured without a loss and 5.7 at up to 10 %, in
/// others before 6.8; beyond that it may be many more.
const RECORD_FACTOR: u64 = 7;

/// The same for a mission, of which each piece may be lost: measured 1.3 and 2.8.
const MISSION_FACTOR: u64 = 4;

/// The same for an order, and for a cell that two plan, where the claims are said anew: at up
/// to 30 % loss 0.5 and 2.0 were measured.
const ORDER_FACTOR: u64 = 2;
/// See [`ORDER_FACTOR`].
const DOUBLE_FACTOR: u64 = 3;

/// What a single case may take, milliseconds.
fn limit_ms(snapshot: &Snapshot<'_>, bound_ms: u64, factor: u64, from_ms: u64) -> Option<u64> {
    let graded = snapshot.grade() != Grade::Reported;
    graded.then(|| snapshot.grown_ms(bound_ms, from_ms) * factor)
}

/// The same of what is counted on up to a tenth lost only.
pub(super) fn light_limit_ms(
    snapshot: &Snapshot<'_>,
    bound_ms: u64,
    factor: u64,
    from_ms: u64,
) -> Option<u64> {
    let light = snapshot.grade() <= Grade::Light;
    limit_ms(snapshot, bound_ms, factor, from_ms).filter(|_| light)
}

/// How long a record may take to all of so many.
fn record_ms(bounds: &Bounds, peers: usize) -> u64 {
    let rotation = (peers as u64).saturating_sub(1).div_ceil(GOSSIP_LEAST);
    let crowd = rotation.saturating_sub(SMALL_ROTATION) * bounds.diameter;
    bounds.spread_ms() + crowd * bounds.interval_ms
}

/// How long a record may take to all of so many, and how often that where it is lost now and then.
pub(super) fn record_limit(bounds: &Bounds, peers: usize) -> (u64, u64) {
    (record_ms(bounds, peers), RECORD_FACTOR)
}

/// Whether a record reaches everybody: passed on, and worth it for longer than the two
/// periods of a state, which is for people and is said again soon. Pieces of a mission reach
/// who follows an older one: that is `agree`. Trails are said again in turn by their authors, and what is known of
/// a mass event by whoever knows it: that is `crowd-agree`.
fn spreads(kind: u8) -> bool {
    let some = [Kind::State, Kind::Mission, Kind::Trail, Kind::Crowd];
    Kind::of_number(kind).is_some_and(|k| k.relayed() && !some.contains(&k))
}

impl SpreadCheck {
    /// Of a run with these twins.
    #[must_use]
    pub fn new(twins: Twins) -> Self {
        Self {
            twins,
            ..Self::default()
        }
    }

    /// The operator has a mission of so many pieces.
    pub fn on_mission(&mut self, pieces: usize) {
        self.pieces = self.pieces.max(pieces as u64);
    }

    /// How long a mission may take to all.
    fn mission_ms(&self, bounds: &Bounds) -> u64 {
        let pieces = self.pieces * bounds.diameter * PIECE_PERIODS;
        bounds.spread_ms() + pieces * bounds.interval_ms
    }

    /// A process starts, ends or stands still.
    pub fn on_silent(&mut self, id: u16) {
        self.lacks.retain(|(p, _), _| *p != id);
        self.apart.retain(|(a, b, _)| *a != id && *b != id);
    }

    /// A process starts or ends: it holds nothing.
    pub fn on_death(&mut self, id: u16) {
        self.held.remove(&id);
    }

    /// A running peer receives a record, or says one of its own.
    pub fn on_held(&mut self, by: u16, record: &Record) {
        if !spreads(record.kind) {
            return;
        }
        // Of twins' records under one key the newer is kept by everybody, whoever said it.
        let author = self.twins.id_of(record.author);
        let key = (author, record.kind, record.subject);
        let version = (record.incarnation, record.seq);
        let next = self.places.len();
        let place = *self.places.entry(key).or_insert(next);
        let held = self.held.entry(by).or_default();
        if held.len() <= place {
            held.resize(place + 1, Version::default());
        }
        held[place] = held[place].max(version);
    }

    /// Judges what each member of a component lacks.
    pub fn on_snapshot(&mut self, snapshot: &Snapshot<'_>, found: &mut Findings) {
        let mut lacking: Vec<(u16, Key)> = Vec::new();
        for component in snapshot.graph.components() {
            let peers: Vec<&PeerSnapshot> = component
                .iter()
                .filter_map(|id| snapshot.peer(*id))
                .filter(|m| m.view.speaks)
                .collect();
            let since_ms = component
                .first()
                .and_then(|id| snapshot.stability.component_since_ms(*id))
                .unwrap_or(snapshot.now_ms);
            self.look_for_lacks(snapshot, &peers, since_ms, &mut lacking, found);
            self.look_for_dissent(snapshot, &peers, since_ms, found);
            self.look_for_doubles(snapshot, &peers, since_ms, found);
        }
        lacking.sort_unstable();
        self.lacks.retain(|key, lack| {
            let goes_on = lacking.binary_search(key).is_ok();
            if !goes_on {
                found.took("L4", snapshot.grade(), lack.took_ms, lack.bound_ms);
            }
            goes_on
        });
    }

    /// The newest version of each record that any of these holds, of its author's newest life,
    /// with its place.
    fn newest(&self, peers: &[&PeerSnapshot]) -> Vec<(Key, usize, Version)> {
        let mut most = vec![Version::default(); self.places.len()];
        for held in peers.iter().filter_map(|m| self.held.get(&m.id)) {
            for (most, version) in most.iter_mut().zip(held) {
                *most = (*most).max(*version);
            }
        }
        let mut lives: BTreeMap<u16, Incarnation> = BTreeMap::new();
        for (key, place) in &self.places {
            let life = lives.entry(key.0).or_default();
            *life = (*life).max(most[*place].0);
        }
        // A later life voids all that earlier ones said, whether or not it said anything; an
        // author knows its own.
        for m in peers {
            let life = lives.entry(m.speaks_as).or_default();
            *life = (*life).max(m.view.incarnation);
            // No record is of a life before the first.
            let later = m.view.peers.iter().filter(|(_, (life, _))| *life > 1);
            for (known, (incarnation, _)) in later {
                let life = lives.entry(known.0).or_default();
                *life = (*life).max(*incarnation);
            }
        }
        let newest = self.places.iter().map(|(key, i)| (*key, *i, most[*i]));
        let is_held = |version: &Version| *version > Version::default();
        newest
            .filter(|(key, _, version)| is_held(version) && lives.get(&key.0) == Some(&version.0))
            .collect()
    }

    fn look_for_lacks(
        &mut self,
        snapshot: &Snapshot<'_>,
        peers: &[&PeerSnapshot],
        since_ms: u64,
        lacking: &mut Vec<(u16, Key)>,
        found: &mut Findings,
    ) {
        let newest = self.newest(peers);
        // Among more no round is opened: nobody waits for a bid of one that was.
        let few = peers.iter().filter(|m| m.uav).count() <= MEMBERS_MAX;
        let is_owed = |kind: u8| few || kind != Kind::Bid.number();
        for m in peers {
            let row = self.held.get(&m.id).map_or(&[][..], |row| &row[..]);
            let others = newest
                .iter()
                .filter(|(key, ..)| key.0 != m.speaks_as && is_owed(key.1));
            for (key, place, wanted) in others {
                let held = row.get(*place).copied().unwrap_or_default();
                if held >= *wanted {
                    continue;
                }
                let bound_ms = record_ms(&snapshot.bounds, peers.len());
                let fresh = Lack {
                    version: *wanted,
                    since_ms: snapshot.now_ms,
                    took_ms: 0,
                    bound_ms,
                    told: false,
                };
                let lack = self.lacks.entry((m.id, *key)).or_insert(fresh);
                // Whoever got what it lacked and lacks something newer lacks it since now.
                if held >= lack.version || wanted.0 > lack.version.0 {
                    *lack = fresh;
                }
                lacking.push((m.id, *key));
                let from_ms = lack.since_ms.max(since_ms).max(m.since_ms);
                let took_ms = snapshot.now_ms - from_ms;
                lack.took_ms = took_ms;
                let limit_ms = light_limit_ms(snapshot, bound_ms, RECORD_FACTOR, from_ms);
                let late = limit_ms.is_some_and(|l| took_ms > l);
                if late && !std::mem::replace(&mut lack.told, true) {
                    found.broken("L4", snapshot.now_ms, Some(m.id), || {
                        let kind = Kind::of_number(key.1).map_or("record", Kind::name);
                        format!(
                            "lacks {kind} {} of peer {} in version {:?}, {took_ms} ms after a peer of its component held it (bound {bound_ms} ms)",
                            key.2, key.0, lack.version
                        )
                    });
                }
            }
        }
    }

    fn look_for_dissent(
        &mut self,
        snapshot: &Snapshot<'_>,
        peers: &[&PeerSnapshot],
        since_ms: u64,
        found: &mut Findings,
    ) {
        let mission_ms = self.mission_ms(&snapshot.bounds);
        let order_ms = record_ms(&snapshot.bounds, peers.len());
        let look_ms = LOOK_PERIODS * snapshot.bounds.period_ms;
        for (i, a) in peers.iter().enumerate() {
            for b in &peers[i + 1..] {
                let differ = [
                    (
                        false,
                        a.view.revision != b.view.revision
                            && a.view.revision.min(b.view.revision) > 0,
                    ),
                    (true, a.view.orders != b.view.orders),
                ];
                for (of_order, differs) in differ {
                    let bound_ms = look_ms + if of_order { order_ms } else { mission_ms };
                    let key = (a.id, b.id, of_order);
                    if !differs {
                        self.apart.stop(key);
                        continue;
                    }
                    let began_ms = self.apart.start(key, snapshot.now_ms);
                    let from_ms = began_ms.max(since_ms).max(a.since_ms).max(b.since_ms);
                    let took_ms = snapshot.now_ms - from_ms;
                    let limit_ms = if of_order {
                        limit_ms(snapshot, bound_ms, ORDER_FACTOR, from_ms)
                    } else {
                        light_limit_ms(snapshot, bound_ms, MISSION_FACTOR, from_ms)
                    };
                    if limit_ms.is_some_and(|l| took_ms > l) && self.apart.tell_once(key) {
                        found.broken("agree", snapshot.now_ms, Some(b.id), || {
                            let what = if of_order { "order" } else { "revision" };
                            format!(
                                "follows another {what} than peer {} in its component, for {took_ms} ms (bound {bound_ms} ms): {} {}, {} {}",
                                a.id, b.view.revision, b.view.orders, a.view.revision, a.view.orders
                            )
                        });
                    }
                }
            }
        }
    }

    /// L3: an open cell that two plan is given up by one of them: the claims reach both, as
    /// all records do, and the one with the lower stamp yields within 2 T.
    fn look_for_doubles(
        &mut self,
        snapshot: &Snapshot<'_>,
        peers: &[&PeerSnapshot],
        since_ms: u64,
        found: &mut Findings,
    ) {
        let bound_ms = record_ms(&snapshot.bounds, peers.len()) + snapshot.bounds.yield_ms();
        let on_the_loop = peers.iter();
        let on_the_loop = on_the_loop.filter(|m| m.view.loop_hash == snapshot.loop_hash);
        let n = snapshot.covered.capacity();
        let (mut planned, mut twice) = (CellSet::new(n), CellSet::new(n));
        for c in on_the_loop.clone().flat_map(|m| &m.view.plan) {
            if !planned.insert(*c) {
                twice.insert(*c);
            }
        }
        twice.subtract(snapshot.covered);
        // Of most cells there is one planner at most.
        let mut planners: BTreeMap<u16, Vec<&PeerSnapshot>> = BTreeMap::new();
        for m in on_the_loop.filter(|_| !twice.is_empty()) {
            for c in m.view.plan.iter().filter(|c| twice.contains(**c)) {
                planners.entry(*c).or_default().push(m);
            }
        }
        let in_both = |(a, b, c): &(u16, u16, u16)| {
            planners
                .get(c)
                .is_some_and(|p| p.iter().any(|m| m.id == *a) && p.iter().any(|m| m.id == *b))
        };
        let here: Vec<u16> = peers.iter().map(|m| m.id).collect();
        self.doubles
            .retain(|k| !here.contains(&k.0) && !here.contains(&k.1) || in_both(k));
        for (cell, by) in planners.iter().filter(|(_, by)| by.len() > 1) {
            let (a, b) = (by[0], by[1]);
            let key = (a.id, b.id, *cell);
            let began_ms = self.doubles.start(key, snapshot.now_ms);
            let from_ms = began_ms.max(since_ms).max(a.since_ms).max(b.since_ms);
            let took_ms = snapshot.now_ms - from_ms;
            let limit_ms = limit_ms(snapshot, bound_ms, DOUBLE_FACTOR, from_ms);
            if limit_ms.is_some_and(|l| took_ms > l) && self.doubles.tell_once(key) {
                found.broken("L3", snapshot.now_ms, Some(b.id), || {
                    format!(
                        "plans cell {cell} as peer {} in its component does, for {took_ms} ms (bound {bound_ms} ms)",
                        a.id
                    )
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Story, speaking};
    use super::*;
    use skein_peer::output::Status;
    use skein_peer::wire::message::Order;
    use skein_peer::{Beliefs, PeerId};

    fn record(kind: Kind, incarnation: u32, seq: u32) -> Record {
        Record {
            author: 9,
            incarnation,
            seq,
            kind: kind.number(),
            subject: 0,
            body: Vec::new(),
            signature: Vec::new(),
        }
    }

    /// Peers 1 and 2 for so many seconds; what is broken then.
    fn after(
        check: &mut SpreadCheck,
        seconds: u64,
        loss: u16,
        change: impl Fn(&mut Beliefs),
    ) -> BTreeMap<&'static str, u64> {
        let (mut story, mut found) = (Story::new(loss), Findings::new(1));
        let mut other = speaking();
        change(&mut other);
        for t in 0..seconds {
            let views = [(1, speaking()), (2, other.clone())];
            story.snapshot(t * 1000, &views, |s| check.on_snapshot(s, &mut found));
        }
        found.counts
    }

    #[test]
    fn a_record_of_the_dead_that_one_member_never_gets_breaks_l4() {
        for (kind, loss, has, broken) in [
            (Kind::Claim, 0, (1, 4), true),
            (Kind::Claim, 0, (1, 5), false),
            (Kind::Operator, 0, (1, 4), true),
            (Kind::Mission, 0, (1, 4), false),
            (Kind::Claim, 100, (1, 4), true),
            (Kind::Claim, 300, (1, 4), false),
            (Kind::State, 0, (1, 4), false),
        ] {
            let mut check = SpreadCheck::default();
            check.on_held(1, &record(kind, 1, 5));
            check.on_held(2, &record(kind, has.0, has.1));
            assert!(after(&mut check.clone(), 57, loss, |_| {}).is_empty());
            let counts = after(&mut check, 58, loss, |_| {});
            assert_eq!(counts.contains_key("L4"), broken, "{kind:?} {has:?} {loss}");
        }
    }

    /// Bids are for rounds, and these for few.
    #[test]
    fn a_bid_is_owed_among_few() {
        for (uavs, kind, broken) in [
            (8, Kind::Bid, true),
            (9, Kind::Bid, false),
            (9, Kind::Claim, true),
        ] {
            let (mut story, mut found) = (Story::new(0), Findings::new(1));
            let mut check = SpreadCheck::default();
            let said = Record {
                author: 20,
                ..record(kind, 1, 5)
            };
            (1..uavs).for_each(|id| check.on_held(id, &said));
            let views: Vec<_> = (1..=uavs).map(|id| (id, speaking())).collect();
            for t in 0..120 {
                story.snapshot(t * 1000, &views, |s| check.on_snapshot(s, &mut found));
            }
            let is_broken = found.counts.contains_key("L4");
            assert_eq!(is_broken, broken, "{kind:?} among {uavs}");
        }
    }

    #[test]
    fn of_twins_records_under_one_key_the_newer_is_owed_whoever_said_it() {
        // 8 and 9 have one id. 1 holds what 9 said last, 2 only what 8 said.
        for (newest, broken) in [(6, false), (5, false), (4, true)] {
            let mut check = SpreadCheck::new(Twins::from_iter([(9, 8)]));
            check.on_held(1, &record(Kind::Claim, 1, 5));
            let by_its_twin = Record {
                author: 8,
                ..record(Kind::Claim, 1, newest)
            };
            check.on_held(2, &by_its_twin);
            if newest > 5 {
                check.on_held(1, &by_its_twin);
            }
            let counts = after(&mut check, 58, 0, |_| {});
            assert_eq!(counts.contains_key("L4"), broken, "{newest}");
        }
    }

    #[test]
    fn what_an_earlier_life_said_is_not_owed() {
        let mut check = SpreadCheck::default();
        check.on_held(1, &record(Kind::Claim, 1, 5));
        check.on_held(2, &record(Kind::Bid, 2, 1));
        check.on_held(1, &record(Kind::Bid, 2, 1));
        assert!(after(&mut check, 20, 0, |_| {}).is_empty());
        // Somebody knows of a later life, which said nothing yet, or of none.
        for (life, owed) in [(2, true), (3, false)] {
            let mut check = SpreadCheck::default();
            check.on_held(1, &record(Kind::Bid, 2, 1));
            let knows = |b: &mut Beliefs| {
                b.peers.insert(PeerId(9), (life, Status::Down));
            };
            let broken = after(&mut check, 90, 0, knows).contains_key("L4");
            assert_eq!(broken, owed, "{life}");
        }
    }

    #[test]
    fn different_revisions_or_orders_in_one_component_are_found() {
        type Change = fn(&mut Beliefs);
        // After how many seconds, without a loss, at 10 % and at 30 %.
        let changes: [(Change, [Option<u64>; 3]); 4] = [
            (|_| {}, [None; 3]),
            (|b| b.revision = 2, [Some(42), Some(42), None]),
            (|b| b.orders = Order::Hold.into(), [Some(22); 3]),
            (|b| b.revision = 0, [None; 3]),
        ];
        for (n, (change, within)) in changes.into_iter().enumerate() {
            for (loss, broken_s) in [0, 100, 300].into_iter().zip(within) {
                let counts = |s| after(&mut SpreadCheck::default(), s, loss, change);
                assert!(
                    counts(broken_s.map_or(90, |s| s - 1)).is_empty(),
                    "{n} {loss}"
                );
                let broken = broken_s.is_some_and(|s| counts(s).contains_key("agree"));
                assert_eq!(broken, broken_s.is_some(), "{n} {loss}");
            }
        }
    }

    #[test]
    fn a_cell_that_two_go_on_planning_breaks_l3() {
        let plans: [(&[u16], bool); 3] = [(&[0, 1], true), (&[2], false), (&[], false)];
        for (plan, broken) in plans {
            let (mut story, mut found) = (Story::new(0), Findings::new(1));
            let mut check = SpreadCheck::default();
            let planning = |plan: &[u16]| Beliefs {
                plan: plan.to_vec(),
                ..speaking()
            };
            for t in 0..72 {
                let views = [(1, planning(&[1])), (2, planning(plan))];
                story.snapshot(t * 1000, &views, |s| check.on_snapshot(s, &mut found));
            }
            assert_eq!(found.counts.contains_key("L3"), broken, "{plan:?}");
        }
    }
}
