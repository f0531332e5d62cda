//! The share of the air: how many bytes a peer may send, how often it beacons, and with
//! how much gossip.
//!
//! | event | what follows |
//! |---|---|
//! | a beacon or a heartbeat is heard | its author shares the channel for ten of its intervals; so do as many as it says that it shares with |
//! | a record is sent | it is paid for; one that is larger than the bucket goes when the bucket is full, and the rest is owed |
//! | another follows in the same instant | it shares the headers of the first while one transmission holds both |
//! | a beacon or a heartbeat is sent | it is paid for, if need be later: what is owed makes everything else wait |
//! | a suspicion is answered, or something is asked for at once | it is paid from a reserve, and from the share when the reserve is empty |
//! | an own bid or claim that was not said yet has waited for I | the share is saved for it: no beacon is said early, and what is asked for at once, or answers that, is paid from the reserve alone |
//! | pieces of a newer mission are lacking, and a neighbour follows it | a tenth of the share is lent to it, or in even parts to those who do |
//! | a piece of a mission is sent that neighbours lack | it is paid from what they lend, or from the share |
//! | a beacon is due | its interval is the shortest in which three fifths of the share carry it and a heartbeat, 16 T at most |
//!
//! Who shares a channel is the most that this peer or a neighbour counts: a station hears
//! nothing of those behind its neighbours, and its neighbours hear them all. Beyond twenty it is
//! what this peer counts itself, twenty at least: over several hops the most of all neighbours is
//! more than most receivers hear, and what is left of the air brings heartbeats. Counting for
//! ten intervals makes loss hide nobody: where the count fell with each beacon that
//! collided, everybody's share would grow as the channel fills.

use crate::input::Time;
use crate::wire::limits::{GOSSIP_MAX, INTERVAL_LEAST, INTERVAL_MOST, PEERS_MAX};
use std::collections::BTreeMap;

/// Share of the channel that all in one earshot may use together. Peers that do not hear
/// each other send at once at whoever is between them: beyond half of the air most of it
/// is collisions.
pub const SHARE_PERCENT: u64 = 45;

/// Bytes that Zenoh, the attachment and the radio add to a transmission.
pub const OVERHEAD_BYTES: usize = 26;

/// Bytes that a further record in the same transmission adds: its length and hops.
pub const PART_BYTES: usize = 4;

/// A transmission takes further records up to so many bytes, 40 ms of a 64 kbit/s channel
/// like a piece of a mission: in a longer one somebody hidden sends nearly always.
pub const FRAME_BYTES: usize = 320;

/// What a peer hands to its radio in one instant, in transmissions.
#[derive(Clone, Copy, Debug, Default)]
pub struct Filling {
    at: u64,
    filled: usize,
}

impl Filling {
    /// What one more record costs, headers included, when it is handed over now.
    #[must_use]
    pub fn cost_bytes(&self, now_ms: u64, bytes: usize) -> usize {
        let joined = self.filled.saturating_add(PART_BYTES).saturating_add(bytes);
        let joins = self.is_open(now_ms) && joined <= FRAME_BYTES;
        bytes.saturating_add(if joins { PART_BYTES } else { OVERHEAD_BYTES })
    }

    /// Whether a transmission is under way that could take more.
    fn is_open(&self, now_ms: u64) -> bool {
        self.filled > 0 && self.at == now_ms
    }

    /// A record is handed over. Returns what it costs, headers included.
    pub fn add(&mut self, now_ms: u64, bytes: usize) -> usize {
        let cost = self.cost_bytes(now_ms, bytes);
        let joins = cost < bytes.saturating_add(OVERHEAD_BYTES);
        self.filled = if joins {
            self.filled.saturating_add(cost)
        } else {
            bytes
        };
        self.at = now_ms;
        cost
    }
}

/// More than so many in one earshot are a crowd.
const CROWD: u64 = 12;

/// Where more than so many share the channel, each counts those that it hears itself: those at
/// the edge of a dense place say more than those within, and beacons come often everywhere.
const DENSE: u64 = 20;

/// A bucket holds the share of so many periods: what a round asks of a peer at once.
pub const BURST_PERIODS: u64 = 3;

/// A neighbour counts for so many of the intervals it announced: at three beacons in ten
/// lost it is missed once in 170,000 times.
pub const LASTING_INTERVALS: u64 = 10;

/// A peer that has sent fewer than three beacons spends as one of all that were launched, and its
/// interval is long enough for all of them; where it does not know how many those are, it spends as
/// one of so many, itself included: a whole swarm may have been started at once, and of 255 some
/// 150 are heard in an interval of 16 T in which all begin.
const FIRST_SHARERS: u64 = 64;
const FIRST_BEACONS: u8 = 3;

/// A beacon without gossip, in its envelope, at most as long as this but for counters that
/// ran for hours.
const BARE_BYTES: usize = 58;

/// A heartbeat, likewise, without those of others, three kilometres from the origin at most.
const HEARTBEAT_BYTES: usize = 25;

/// Of a share beacons and heartbeats take so much at most, percent.
const BEACON_PERCENT: u64 = 60;

/// And an entry of gossip.
pub const ENTRY_BYTES: usize = 17;

/// And a heartbeat of somebody else alone.
pub const FRESH_BYTES: usize = 7;

/// A beacon has room for so many entries at least: one for news, one for the rotation, and two
/// for the heartbeats of four others.
const LEAST_ENTRIES: usize = 4;

/// What a suspicion is answered from: so many heartbeats, refilled by a quarter of the
/// share. At four an interval that is more than a whole k2 at D = 1.
const RESERVE_BEACONS: i64 = 16;

/// Of its share who lacks pieces of a mission lends so much, percent, and of what all in one
/// earshot may use together one peer borrows so much at most. Of the two fifths that beacons
/// leave, what is said meanwhile needs the rest.
pub const LENT_PERCENT: u64 = 10;

/// What was lent keeps for one piece of a mission, or for a period.
const LENT_BYTES: usize = FRAME_BYTES + OVERHEAD_BYTES;

/// Longer pauses refill nothing more, milliseconds.
const REFILL_MAX_MS: u64 = 600_000;

#[derive(Clone, Copy, Debug)]
struct Neighbour {
    until: Time,
    sharers: u16,
}

/// When the next beacon follows, and what this one carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BeaconPlan {
    /// Until the next one, quarters of T.
    pub interval: u8,
    /// Most entries of gossip.
    pub entries: usize,
}

/// What one peer may send.
#[derive(Clone, Debug)]
pub struct Airtime {
    period_ms: u64,
    rate_bps: u64,
    neighbours: BTreeMap<u16, Neighbour>,
    /// Before this none of them is to be forgotten.
    first_until: Time,
    /// The most that any of them counts: asked for with every input.
    most_told: u16,
    /// What may be sent; below zero, what is owed.
    tokens_millibytes: i64,
    reserve_millibytes: i64,
    /// Whether a part of the share is lent.
    lends: bool,
    /// What is borrowed: bytes a second, and what of it may be sent.
    lent_bytes_ps: u64,
    lent_millibytes: i64,
    filled: Time,
    frame: Filling,
    interval: u8,
    /// Full beacons planned so far, as far as it matters.
    planned: u8,
    /// How many were to be launched, where that is known.
    fleet: u64,
}

impl Airtime {
    /// A channel of `rate_bps` on which nobody was heard yet.
    #[must_use]
    pub fn new(rate_bps: u32, period_ms: u32) -> Self {
        Self {
            period_ms: u64::from(period_ms.max(1)),
            rate_bps: u64::from(rate_bps.max(1)),
            neighbours: BTreeMap::new(),
            first_until: Time(u64::MAX),
            most_told: 0,
            tokens_millibytes: 0,
            reserve_millibytes: full_reserve(),
            lends: false,
            lent_bytes_ps: 0,
            lent_millibytes: 0,
            filled: Time(0),
            frame: Filling::default(),
            interval: INTERVAL_LEAST,
            planned: 0,
            fleet: 0,
        }
    }

    /// So many were to be launched, this peer included: at first it takes all of them to share
    /// the channel with it, and a ground station.
    pub fn expect(&mut self, fleet: usize) {
        self.fleet = fleet as u64 + 1;
    }

    /// A neighbour's beacon or heartbeat: its interval in quarters of T, and among how many
    /// it counts itself.
    pub fn hear(&mut self, now: Time, author: u16, (interval, sharers): (u8, u16)) {
        self.forget(now);
        if self.neighbours.len() >= PEERS_MAX && !self.neighbours.contains_key(&author) {
            return;
        }
        let until = now.plus_ms(LASTING_INTERVALS * self.told_ms(interval));
        self.first_until = self.first_until.min(until);
        let before = self.neighbours.insert(author, Neighbour { until, sharers });
        // Whoever told the most may have been the only one.
        if before.is_some_and(|n| n.sharers == self.most_told && n.sharers > sharers) {
            self.count();
        } else {
            self.most_told = self.most_told.max(sharers);
        }
    }

    /// Who was not heard for so long shares no more.
    fn forget(&mut self, now: Time) {
        if now < self.first_until {
            return;
        }
        // Until now the share was one among them: who stood still was not alone meanwhile.
        self.refill(now);
        self.neighbours.retain(|_, n| n.until > now);
        let untils = self.neighbours.values().map(|n| n.until);
        self.first_until = untils.min().unwrap_or(Time(u64::MAX));
        self.count();
    }

    fn count(&mut self) {
        let told = self.neighbours.values().map(|n| n.sharers).max();
        self.most_told = told.unwrap_or(0);
    }

    /// How many this peer counts in its own earshot, itself included.
    #[must_use]
    pub fn counted(&self) -> u16 {
        u16::try_from(self.neighbours.len() + 1).unwrap_or(u16::MAX)
    }

    /// How many share the channel: as many as whoever hears most of them counts, up to so many
    /// that all who are told of have an even part where that is dense; else as many as this
    /// peer hears.
    #[must_use]
    pub fn sharers(&self) -> u64 {
        let own = u64::from(self.counted());
        u64::from(self.most_told).clamp(own, own.max(DENSE))
    }

    /// Whether so many share it that headers are dearer than random times, and what neighbours
    /// say need not be said again.
    #[must_use]
    pub fn is_crowded(&self) -> bool {
        self.sharers() > CROWD
    }

    /// Bytes a second that this peer may send among so many.
    fn share_bytes_ps(&self, sharers: u64) -> u64 {
        (self.rate_bps * SHARE_PERCENT / 800 / sharers.max(1)).max(1)
    }

    fn rate_bytes_ps(&self) -> u64 {
        let least = match (self.is_new(), self.fleet) {
            (false, _) => 1,
            (true, 0) => FIRST_SHARERS,
            (true, fleet) => fleet,
        };
        let share = self.share_bytes_ps(self.sharers().max(least));
        if self.lends {
            (share * (100 - LENT_PERCENT) / 100).max(1)
        } else {
            share
        }
    }

    /// From now on a part of the share is lent to who has what this peer lacks, or none is.
    pub fn lend(&mut self, now: Time, lends: bool) {
        self.refill(now);
        self.lends = lends;
    }

    /// From now on so many neighbours lend, thousandths.
    pub fn borrow(&mut self, now: Time, permille: u64) {
        if permille > 0 || self.borrows() {
            self.refill(now);
            let each = self.share_bytes_ps(self.sharers()) * LENT_PERCENT / 100;
            let most = self.share_bytes_ps(1) * LENT_PERCENT / 100;
            self.lent_bytes_ps = (each * permille / 1000).min(most);
        }
    }

    /// Whether anything is lent to this peer.
    #[must_use]
    pub fn borrows(&self) -> bool {
        self.lent_bytes_ps > 0
    }

    /// Pays for a record from what is lent, if that is enough now.
    pub fn pay_lent(&mut self, now: Time, bytes: usize) -> bool {
        self.refill(now);
        let goes = self.lent_millibytes >= millibytes(self.frame.cost_bytes(now.0, bytes));
        if goes {
            self.lent_millibytes -= millibytes(self.frame.add(now.0, bytes));
        }
        goes
    }

    /// How long a record waits until what is lent is enough, milliseconds, at least one.
    #[must_use]
    pub fn wait_lent_ms(&self, now: Time, bytes: usize) -> u64 {
        let later = now.plus_ms(1);
        let cost = millibytes(self.frame.cost_bytes(later.0, bytes));
        let lacking = u64::try_from(cost - self.lent_millibytes).unwrap_or(0);
        let passed_ms = now.since_ms(self.filled);
        let wait_ms = lacking.div_ceil(self.lent_bytes_ps.max(1));
        wait_ms.saturating_sub(passed_ms).max(1)
    }

    fn is_new(&self) -> bool {
        self.planned < FIRST_BEACONS
    }

    fn expects(&self) -> bool {
        self.fleet > 0 && self.is_new()
    }

    /// An interval that a beacon announces, in milliseconds.
    #[must_use]
    pub fn told_ms(&self, interval: u8) -> u64 {
        ms_of(interval, self.period_ms)
    }

    /// Milliseconds between two beacons as last announced.
    #[must_use]
    pub fn interval_ms(&self) -> u64 {
        self.told_ms(self.interval)
    }

    /// The same in quarters of T.
    #[must_use]
    pub fn interval(&self) -> u8 {
        self.interval
    }

    /// A beacon with gossip is due. The interval at most doubles from one to the next: who
    /// misses the one that announces it is not to be alarmed by the silence. The first two
    /// are no next ones: they are long enough for all that are expected.
    pub fn plan_beacon(&mut self, now: Time) -> BeaconPlan {
        self.forget(now);
        self.refill(now);
        self.planned = self.planned.saturating_add(1).min(FIRST_BEACONS);
        let (expected, most) = if self.expects() {
            (self.fleet, INTERVAL_MOST)
        } else {
            (1, self.interval.saturating_mul(2).min(INTERVAL_MOST))
        };
        let share = self.share_bytes_ps(self.sharers().max(expected));
        let part = (share * self.period_ms * BEACON_PERCENT / 100_000).max(1);
        let bare = (BARE_BYTES + HEARTBEAT_BYTES + 2 * OVERHEAD_BYTES) as u64;
        let least = bare + (LEAST_ENTRIES * ENTRY_BYTES) as u64;
        let interval = u8::try_from((4 * least).div_ceil(part)).unwrap_or(INTERVAL_MOST);
        self.interval = interval.clamp(INTERVAL_LEAST, most);
        // What nothing else has used is there for gossip.
        let unused = u64::try_from(self.tokens_millibytes / 2000).unwrap_or(0);
        let room = (part * u64::from(self.interval) / 4).max(unused);
        let entries = usize::try_from(room.saturating_sub(bare)).unwrap_or(0) / ENTRY_BYTES;
        BeaconPlan {
            interval: self.interval,
            entries: entries.clamp(LEAST_ENTRIES, GOSSIP_MAX),
        }
    }

    fn depth_millibytes(&self) -> i64 {
        let depth = self.rate_bytes_ps() * BURST_PERIODS * self.period_ms;
        i64::try_from(depth).unwrap_or(i64::MAX / 2)
    }

    fn refill(&mut self, now: Time) {
        let passed_ms = now.since_ms(self.filled).min(REFILL_MAX_MS);
        let gained = i64::try_from(passed_ms * self.rate_bytes_ps()).unwrap_or(i64::MAX / 2);
        self.tokens_millibytes =
            (self.tokens_millibytes.saturating_add(gained)).min(self.depth_millibytes());
        let lent = i64::try_from(passed_ms * self.lent_bytes_ps).unwrap_or(i64::MAX / 2);
        let lent_most = (self.lent_bytes_ps * self.period_ms).max(1000 * LENT_BYTES as u64);
        self.lent_millibytes = (self.lent_millibytes.saturating_add(lent))
            .min(i64::try_from(lent_most).unwrap_or(i64::MAX / 2));
        let refilled = self.reserve_millibytes.saturating_add(gained / 4);
        self.reserve_millibytes = refilled.min(full_reserve());
        self.filled = now;
    }

    /// Pays for a record that cannot wait. What is lacking is owed.
    pub fn charge(&mut self, now: Time, bytes: usize) {
        self.refill(now);
        let cost = millibytes(self.frame.add(now.0, bytes));
        self.tokens_millibytes = self.tokens_millibytes.saturating_sub(cost);
    }

    /// Pays for an answer to a suspicion.
    pub fn charge_answer(&mut self, now: Time, bytes: usize) {
        self.refill(now);
        let cost = millibytes(self.frame.add(now.0, bytes));
        let reserved = self.reserve_millibytes.min(cost);
        self.reserve_millibytes -= reserved;
        self.tokens_millibytes = self.tokens_millibytes.saturating_sub(cost - reserved);
    }

    /// Whether an answer to a suspicion could be paid from the reserve, or from the share where
    /// nothing else is saved for.
    pub fn may_answer(&mut self, now: Time, saves: bool) -> bool {
        self.refill(now);
        self.reserve_millibytes >= millibytes(2 * (HEARTBEAT_BYTES + OVERHEAD_BYTES))
            || (self.tokens_millibytes >= 0 && !saves)
    }

    /// Pays for a record if it may go now.
    pub fn pay(&mut self, now: Time, bytes: usize) -> bool {
        self.refill(now);
        let goes = self.tokens_millibytes >= self.asked(now, bytes);
        if goes {
            let cost = millibytes(self.frame.add(now.0, bytes));
            self.tokens_millibytes -= cost;
        }
        goes
    }

    /// Whether something was just sent whose transmission others could share.
    #[must_use]
    pub fn is_filling(&self, now: Time) -> bool {
        self.frame.is_open(now.0)
    }

    /// Whether a record would share the transmission of what was just sent.
    #[must_use]
    pub fn joins(&self, now: Time, bytes: usize) -> bool {
        self.frame.cost_bytes(now.0, bytes) < bytes.saturating_add(OVERHEAD_BYTES)
    }

    /// Whether nothing is owed.
    #[must_use]
    pub fn is_in_credit(&self) -> bool {
        self.tokens_millibytes >= 0
    }

    /// How long a record has to wait yet, milliseconds, at least one.
    #[must_use]
    pub fn wait_ms(&self, now: Time, bytes: usize) -> u64 {
        let rate = self.rate_bytes_ps();
        let later = now.plus_ms(1);
        let lacking = self
            .asked(later, bytes)
            .saturating_sub(self.tokens_millibytes);
        let lacking = u64::try_from(lacking).unwrap_or(0);
        let passed_ms = now.since_ms(self.filled);
        lacking.div_ceil(rate).saturating_sub(passed_ms).max(1)
    }

    /// What the bucket must hold for a record: its cost, or all that it can hold.
    fn asked(&self, now: Time, bytes: usize) -> i64 {
        millibytes(self.frame.cost_bytes(now.0, bytes)).min(self.depth_millibytes())
    }

    /// How many neighbours are counted, and the cap.
    #[must_use]
    pub fn load(&self) -> (&'static str, usize, usize) {
        ("neighbours", self.neighbours.len(), PEERS_MAX)
    }
}

/// An interval in milliseconds.
#[must_use]
pub fn ms_of(interval: u8, period_ms: u64) -> u64 {
    u64::from(interval.clamp(INTERVAL_LEAST, INTERVAL_MOST)) * period_ms / 4
}

fn full_reserve() -> i64 {
    RESERVE_BEACONS * millibytes(HEARTBEAT_BYTES + OVERHEAD_BYTES)
}

fn millibytes(bytes: usize) -> i64 {
    i64::try_from(bytes)
        .unwrap_or(i64::MAX / 2000)
        .saturating_mul(1000)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::codec::{self, Body};
    use crate::wire::message::{Beacon, Heartbeat, Record};
    use crate::wire::samples;

    fn air(rate_bps: u32, neighbours: u16) -> Airtime {
        let mut air = Airtime::new(rate_bps, 1000);
        air.planned = FIRST_BEACONS;
        for author in 1..=neighbours {
            air.hear(Time(0), author, (4, 3));
        }
        air
    }

    /// Bytes on the air of a beacon with so many entries of gossip.
    fn beacon_bytes(entries: usize) -> usize {
        let beacon = Beacon {
            heartbeat: 3000,
            east_mm: -1_000_000,
            north_mm: 1_000_000,
            heading_e4: 31_000,
            nonce: u32::MAX,
            loop_hash: u64::MAX,
            cover_digest: u32::MAX,
            gossip: vec![samples::gossip(99); entries],
            ..samples::beacon(1)
        };
        let record = Record {
            author: 100,
            incarnation: 2,
            seq: 3000,
            kind: 0,
            subject: 0,
            body: codec::encode_body(&Body::Beacon(beacon)),
            signature: Vec::new(),
        };
        codec::encode_record(&record).len()
    }

    #[test]
    fn the_sizes_of_beacons_are_those_that_are_reckoned_with() {
        assert!(beacon_bytes(0) <= BARE_BYTES, "{}", beacon_bytes(0));
        let entry = beacon_bytes(11) - beacon_bytes(1);
        // Counters of this sample have run for a day.
        assert!(entry <= 10 * (ENTRY_BYTES + 4), "{entry}");
        let heartbeat = Record {
            author: 100,
            incarnation: 2,
            seq: 30_000,
            kind: 12,
            subject: 0,
            body: codec::encode_body(&Body::Heartbeat(Heartbeat {
                interval: 64,
                sharers: 65,
                east_dm: -30_000,
                north_dm: -30_000,
                fresh: Vec::new(),
            })),
            signature: Vec::new(),
        };
        let bytes = codec::encode_record(&heartbeat).len();
        assert!(bytes <= HEARTBEAT_BYTES, "{bytes}");
    }

    #[test]
    fn beacons_and_heartbeats_take_three_fifths_of_the_share_at_most() {
        for (rate_bps, neighbours) in [
            (64_000, 0),
            (64_000, 7),
            (64_000, 19),
            (64_000, 49),
            (64_000, 62),
            (20_000, 7),
            (20_000, 30),
            (1_000_000, 50),
        ] {
            let mut air = air(rate_bps, neighbours);
            let share = u64::from(rate_bps) / 8 * 45 / 100 / (u64::from(neighbours) + 1);
            let mut plan = air.plan_beacon(Time(100));
            for t in 1..6 {
                plan = air.plan_beacon(Time(100 + t));
            }
            let bytes = BARE_BYTES + HEARTBEAT_BYTES + 2 * OVERHEAD_BYTES;
            let bytes = (bytes + plan.entries * ENTRY_BYTES) as u64;
            let per_s = bytes * 4 / u64::from(plan.interval);
            assert!(
                per_s * 5 <= (share + 2) * 3,
                "{rate_bps} {neighbours}: {plan:?}"
            );
            assert!(
                plan.interval == 4 || plan.entries == LEAST_ENTRIES,
                "{plan:?}"
            );
        }
    }

    #[test]
    fn an_overdraft_is_owed() {
        let mut air = air(64_000, 8);
        // 3,600 bytes a second among nine are 400 a second, and a bucket of 1,200.
        assert!(!air.pay(Time(0), 100));
        assert!(air.is_in_credit());
        air.charge(Time(3000), 1_974);
        assert!(!air.is_in_credit());
        assert!(!air.pay(Time(4_900), 100));
        assert_eq!(air.wait_ms(Time(4_900), 374), 1_100);
        assert!(air.pay(Time(6_000), 374));
        // What is larger than the bucket goes when that is full.
        assert!(!air.pay(Time(8_999), 3_000));
        assert!(air.pay(Time(9_000), 3_000));
        assert!(!air.pay(Time(13_500), 1));
    }

    #[test]
    fn whoever_hears_most_of_a_channel_says_among_how_many_it_is_shared() {
        let mut air = air(64_000, 3);
        assert_eq!((air.counted(), air.sharers()), (4, 4));
        air.hear(Time(500), 3, (4, 12));
        assert_eq!((air.counted(), air.sharers()), (4, 12));
        air.plan_beacon(Time(10_200));
        assert_eq!((air.counted(), air.sharers()), (2, 12));
        air.plan_beacon(Time(10_600));
        assert_eq!((air.counted(), air.sharers()), (1, 1));
    }

    /// What it did not hear meanwhile was there all the same: a minute alone would be a bucket of
    /// three seconds of all the channel.
    #[test]
    fn the_bucket_of_who_stood_still_is_that_of_one_among_its_neighbours() {
        for hears_first in [false, true] {
            let mut air = air(64_000, 8);
            let woke = Time(60_000);
            if hears_first {
                air.hear(woke, 3, (4, 1));
            }
            air.plan_beacon(woke);
            assert!(air.sharers() < 3);
            assert_eq!(air.tokens_millibytes, 1_200_000, "{hears_first}");
        }
    }

    /// The most that a neighbour counts holds up to twenty; beyond it what is heard here.
    #[test]
    fn who_hears_fewer_than_a_dense_place_near_by_counts_those_or_twenty() {
        for (heard, told, sharers) in [
            (3, 19, 19),
            (3, 20, 20),
            (3, 45, 20),
            (30, 45, 31),
            (30, 25, 31),
        ] {
            let mut air = air(64_000, 0);
            for author in 1..=heard {
                air.hear(Time(0), author, (4, told));
            }
            assert_eq!(air.sharers(), sharers, "{heard} heard, {told} told");
        }
    }

    #[test]
    fn answers_to_a_suspicion_have_a_reserve_of_their_own() {
        let mut air = air(64_000, 8);
        air.refill(Time(3000));
        // The bucket is full, and stays so.
        for t in 0..RESERVE_BEACONS.unsigned_abs() {
            air.charge_answer(Time(3000 + t), HEARTBEAT_BYTES);
        }
        assert_eq!(air.tokens_millibytes, 1_200_000);
        air.charge_answer(Time(3000 + 16), HEARTBEAT_BYTES);
        assert!(air.tokens_millibytes < 1_200_000);
    }

    #[test]
    fn what_goes_in_one_instant_shares_its_headers() {
        let mut air = air(64_000, 8);
        air.refill(Time(3_000));
        let spent = |air: &Airtime| (1_200_000 - air.tokens_millibytes) / 1000;
        air.charge(Time(3_000), 58);
        assert_eq!(spent(&air), 84);
        assert!(air.joins(Time(3_000), 100) && !air.joins(Time(3_001), 100));
        assert!(air.pay(Time(3_000), 100));
        assert_eq!(spent(&air), 84 + 104);
        // A frame ends at 320 bytes: the next one has headers of its own.
        assert!(!air.joins(Time(3_000), 160));
        assert!(air.pay(Time(3_000), 160));
        assert_eq!(spent(&air), 84 + 104 + 186);
        assert!(air.pay(Time(3_000), 156));
        assert_eq!(spent(&air), 84 + 104 + 186 + 160);
    }

    #[test]
    fn a_beacon_carries_as_much_gossip_as_its_part_of_the_share_and_what_nobody_used() {
        // Of 3,600 bytes a second, three fifths among all, less 135 of a beacon and a
        // heartbeat without gossip; 17 an entry.
        for (neighbours, entries) in [(3, 20), (4, 17), (5, 13), (7, 7), (9, 4), (19, 4)] {
            let mut air = air(64_000, neighbours);
            assert_eq!(air.plan_beacon(Time(0)).entries, entries, "{neighbours}");
        }
        let mut quiet = air(64_000, 7);
        assert_eq!(quiet.plan_beacon(Time(3_000)).entries, 20);
        // Half of what the bucket holds: of 450 bytes after a second, 225.
        quiet.tokens_millibytes = 330_000;
        quiet.filled = Time(3_000);
        assert_eq!(quiet.plan_beacon(Time(3_000)).entries, 7);
        quiet.tokens_millibytes = 700_000;
        assert_eq!(quiet.plan_beacon(Time(3_000)).entries, 12);
    }

    #[test]
    fn who_knows_how_many_were_launched_counts_on_them_until_it_heard_them() {
        for (fleet, first) in [(20, 8), (100, 39), (255, 64)] {
            let mut air = Airtime::new(64_000, 1000);
            air.expect(fleet);
            air.refill(Time(3_000));
            let bucket = 3_600 / (fleet as i64 + 1) * 3_000;
            assert_eq!(air.tokens_millibytes, bucket, "{fleet}");
            assert_eq!(air.plan_beacon(Time(3_000)).interval, first, "{fleet}");
            assert_eq!(air.plan_beacon(Time(19_000)).interval, first, "{fleet}");
            assert_eq!(air.rate_bytes_ps(), 3_600 / (fleet as u64 + 1));
            // Nobody else was heard: from the third on all follows that.
            assert_eq!(air.plan_beacon(Time(35_000)).interval, 4, "{fleet}");
            assert_eq!(air.rate_bytes_ps(), 3_600);
        }
    }

    #[test]
    fn the_interval_at_most_doubles_from_one_beacon_to_the_next() {
        let mut air = air(64_000, 99);
        let intervals = [0; 6].map(|_| air.plan_beacon(Time(100)).interval);
        // 4 · 203 bytes of 21 a second.
        assert_eq!(intervals, [8, 16, 32, 39, 39, 39]);
        assert_eq!(air.interval_ms(), 9_750);
        let mut crowded = super::tests::air(20_000, 200);
        let intervals = [0; 6].map(|_| crowded.plan_beacon(Time(100)).interval);
        assert_eq!(intervals, [8, 16, 32, 64, 64, 64]);
    }

    #[test]
    fn who_lends_sends_a_tenth_less_and_what_is_borrowed_is_no_more_than_that() {
        let sent = |lends: bool, permille: u64| {
            let mut air = air(64_000, 27);
            air.lend(Time(0), lends);
            air.borrow(Time(0), permille);
            let mut bytes = (0, 0);
            for t in 0..100_000 {
                bytes.0 += if air.pay(Time(t), 100) { 126 } else { 0 };
                bytes.1 += if air.pay_lent(Time(t), 274) { 300 } else { 0 };
            }
            bytes
        };
        let ((whole, none), (lending, _)) = (sent(false, 0), sent(true, 0));
        let (own, lent) = sent(false, 27_000);
        assert_eq!((none, own), (0, whole));
        assert!(whole - lending >= whole / 11, "{whole} {lending}");
        assert!(lent > 20 * (whole - lending), "{whole} {lending} {lent}");
        assert!(
            lent <= 27 * (whole - lending) + 600,
            "{whole} {lending} {lent}"
        );
    }
}
