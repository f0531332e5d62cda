//! Many relays on a lossy channel: eventual delivery, suppression, bytes, partitions.

use crate::input::Time;
use crate::protocol::airtime::Filling;
use crate::protocol::membership::Membership;
use crate::protocol::membership::many_detectors::Dice;
use crate::protocol::relay::{Offer, Relay};
use crate::wire::codec::{self, Body};
use crate::wire::message::{Beacon, Record};
use crate::wire::samples;
use proptest::prelude::*;
use std::collections::BTreeMap;

const T_MS: u64 = 1000;
const STEP_MS: u64 = 10;
const RATE_BPS: u32 = 64_000;
/// Bytes of the envelope of a beacon.
const ENVELOPE_BYTES: usize = 12;

struct Node {
    relay: Relay,
    membership: Membership,
    heartbeat: u32,
    seq: u32,
    alive: bool,
    next_beacon: u64,
    sent: usize,
    bytes: usize,
    frame: Filling,
}

struct Net {
    nodes: Vec<Node>,
    dice: Dice,
    loss_percent: u64,
    now: u64,
}

fn id(i: usize) -> u16 {
    u16::try_from(i).unwrap()
}

impl Net {
    fn new(n: usize, seed: u64, loss_percent: u64) -> Self {
        let mut dice = Dice::new(seed);
        let period = u32::try_from(T_MS).unwrap();
        let nodes = (0..n)
            .map(|i| Node {
                relay: Relay::new(id(i), "f", RATE_BPS, period),
                membership: Membership::new(id(i), period),
                heartbeat: 0,
                seq: 0,
                alive: true,
                next_beacon: dice.below(T_MS),
                sent: 0,
                bytes: 0,
                frame: Filling::default(),
            })
            .collect();
        Self {
            nodes,
            dice,
            loss_percent,
            now: 0,
        }
    }

    /// A record of `i`: kind 1 is a state, 2 a bid, 3 a claim; `size` bytes of body.
    fn write(&mut self, i: usize, kind: u8, size: usize) {
        let node = &mut self.nodes[i];
        node.seq += 1;
        let record = Record {
            author: id(i),
            incarnation: 1,
            seq: node.seq,
            kind,
            subject: 0,
            body: vec![kind; size],
            signature: Vec::new(),
        };
        let bytes = codec::encode_record(&record);
        node.relay.own(Time(self.now), &record, bytes);
    }

    fn run(&mut self, for_ms: u64, links: impl Fn(usize, usize) -> bool) {
        let until = self.now + for_ms;
        while self.now < until {
            self.now += STEP_MS;
            for i in 0..self.nodes.len() {
                if !self.nodes[i].alive {
                    continue;
                }
                if self.now >= self.nodes[i].next_beacon {
                    self.beacon(i, &links);
                }
                while let Some(out) = self.nodes[i].relay.poll(Time(self.now)) {
                    self.nodes[i].sent += 1;
                    let cost = self.nodes[i].frame.add(self.now, out.bytes.len());
                    self.nodes[i].bytes += cost;
                    let record = codec::decode_record(&out.bytes).unwrap();
                    for j in 0..self.nodes.len() {
                        if self.hears(i, j, &links) && record.author != id(j) {
                            let now = Time(self.now);
                            self.nodes[j]
                                .relay
                                .offer(now, &record, &out.bytes, out.hops);
                        }
                    }
                }
                for (name, used, cap) in self.nodes[i].relay.loads() {
                    assert!(used <= cap, "{name}: {used} of {cap}");
                }
            }
        }
    }

    fn hears(&mut self, i: usize, j: usize, links: &impl Fn(usize, usize) -> bool) -> bool {
        let lost = self.dice.below(100) < self.loss_percent;
        links(i, j) && self.nodes[j].alive && !lost
    }

    fn beacon(&mut self, i: usize, links: &impl Fn(usize, usize) -> bool) {
        let now = Time(self.now);
        let node = &mut self.nodes[i];
        let plan = node.relay.air.plan_beacon(now);
        node.membership.announce(plan.interval);
        let interval_ms = node.relay.air.interval_ms();
        node.next_beacon = self.now + interval_ms * 9 / 10 + self.dice.below(interval_ms / 5);
        node.heartbeat += 1;
        node.membership.tick(now);
        let behind = node.relay.take_behind();
        let (mut gossip, mut fresh) = node.membership.tell(now, plan.entries, &behind);
        // There are no heartbeats here.
        fresh.extend(node.membership.tell_between(now));
        fresh.sort_by_key(|f| f.id);
        fresh.dedup_by_key(|f| f.id);
        for g in &mut gossip {
            (g.max_seq, g.digest) = node.relay.version(g.id, g.incarnation, node.heartbeat);
        }
        let said = Beacon {
            eccentricity: node.membership.eccentricity(now),
            interval: plan.interval,
            sharers: node.relay.air.counted(),
            gossip,
            fresh,
            ..samples::beacon(node.heartbeat)
        };
        let bytes = codec::encode_body(&Body::Beacon(said.clone())).len();
        node.relay.air.charge(now, ENVELOPE_BYTES + bytes);
        node.bytes += node.frame.add(self.now, ENVELOPE_BYTES + bytes);
        for j in 0..self.nodes.len() {
            if self.hears(i, j, links) {
                self.nodes[j].membership.on_beacon(now, id(i), 1, &said);
                self.nodes[j].relay.on_beacon(now, id(i), &said);
            }
        }
    }

    /// What a node holds: version by (author, kind).
    fn held(&self, i: usize) -> BTreeMap<(u16, u8), u32> {
        let records = self.nodes[i].relay.records();
        records
            .iter()
            .map(|r| ((r.author, r.kind), r.seq))
            .collect()
    }

    /// Runs until all living nodes hold the same, at most `for_ms`; returns whether
    /// they do.
    fn agree(&mut self, for_ms: u64, links: impl Fn(usize, usize) -> bool) -> bool {
        let until = self.now + for_ms;
        loop {
            let mut held = (0..self.nodes.len())
                .filter(|i| self.nodes[*i].alive)
                .map(|i| self.held(i));
            let first = held.next();
            if held.all(|h| Some(&h) == first.as_ref()) {
                return true;
            }
            if self.now >= until {
                return false;
            }
            self.run(T_MS / 4, &links);
        }
    }
}

fn line(a: usize, b: usize) -> bool {
    a.abs_diff(b) == 1
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, max_shrink_iters: 24, ..ProptestConfig::default() })]

    #[test]
    fn a_lossy_line_of_five_delivers_all(seed: u64, loss in 0_u64..31, size in 10_usize..200) {
        let mut net = Net::new(5, seed, loss);
        net.run(20 * T_MS, line);
        for round in 0..3 {
            for i in 0..5 {
                net.write(i, if round == 1 { 3 } else { 2 }, size);
            }
            net.run(T_MS / 2, line);
        }
        // (3 D + 5) T without loss; seven times that with.
        let bound = (3 * 4 + 5) * T_MS * if loss == 0 { 1 } else { 7 };
        prop_assert!(net.agree(bound, line), "{:?}", (0..5).map(|i| net.held(i)).collect::<Vec<_>>());
        prop_assert_eq!(net.held(2).len(), 10);
        // All is said: nobody sends any more.
        net.run(5 * T_MS, line);
        let sent: usize = net.nodes.iter().map(|n| n.sent).sum();
        net.run(10 * T_MS, line);
        prop_assert_eq!(net.nodes.iter().map(|n| n.sent).sum::<usize>(), sent);
    }

    #[test]
    fn after_a_partition_both_sides_hold_all_and_the_dead_speak_on(
        n in 4_usize..9, seed: u64, loss in 0_u64..31, apart in 15_u64..60,
    ) {
        let mut net = Net::new(n, seed, loss);
        let half = n / 2;
        let split = |a: usize, b: usize| a != b && (a < half) == (b < half);
        net.run(5 * T_MS, split);
        for i in 0..n {
            net.write(i, 3, 100);
        }
        prop_assert!(net.agree(0, split) || half > 0);
        net.run(apart * T_MS, split);
        for i in 1..n {
            net.write(i, 1, 30);
        }
        // The other half never met this one; its records are all that is left of it.
        net.nodes[0].alive = false;
        net.run(30 * T_MS, split);
        let all = |a: usize, b: usize| a != b;
        prop_assert!(net.agree(8 * 7 * T_MS, all), "{:?}", (1..n).map(|i| net.held(i)).collect::<Vec<_>>());
        prop_assert!(net.held(n - 1).contains_key(&(0, 3)), "the dead peer's claim is lost");
    }

    #[test]
    fn a_peer_keeps_to_its_share(seed: u64, n in 2_usize..32) {
        let mut net = Net::new(n, seed, 0);
        let all = |a: usize, b: usize| a != b;
        net.run(20 * T_MS, all);
        let before: Vec<usize> = net.nodes.iter().map(|x| x.bytes).collect();
        for _ in 0..400 {
            for i in 0..n {
                net.write(i, 3, 900);
            }
            net.run(T_MS / 20, all);
        }
        let share = usize::try_from(RATE_BPS).unwrap() / 8 * 45 / 100 / n;
        for (x, b) in net.nodes.iter().zip(before) {
            // Twenty seconds of beacons and records, what the bucket held, and one record
            // and a beacon that are owed; or were, when it began.
            let (sent, owed) = (x.bytes - b, 1000 + 200);
            prop_assert!(sent <= share * 23 + owed, "{sent} of {}", share * 20);
            prop_assert!(sent + owed >= share * 20, "{sent} of {}", share * 20);
        }
    }
}

#[test]
fn a_crowd_does_not_repeat_what_all_have_heard() {
    let mut net = Net::new(12, 5, 0);
    let all = |a: usize, b: usize| a != b;
    net.run(10 * T_MS, all);
    net.write(3, 3, 100);
    net.run(5 * T_MS, all);
    let sent: usize = net.nodes.iter().map(|n| n.sent).sum();
    assert!((0..12).all(|i| net.held(i).len() == 1));
    assert!((2..=6).contains(&sent), "{sent} transmissions");
}

#[test]
fn a_large_record_gets_through_on_a_small_share() {
    // Thirty neighbours leave 200 bytes a second: less than the record in two.
    let mut relay = Relay::new(0, "f", RATE_BPS, 1000);
    let record = Record {
        author: 0,
        incarnation: 1,
        seq: 1,
        kind: 5,
        subject: 0,
        body: vec![7; 1040],
        signature: Vec::new(),
    };
    let mut sent = None;
    for t in 0..200 {
        let now = Time(t * 100);
        for i in 1..=30 {
            relay.on_beacon(now, i, &samples::beacon(1));
        }
        if t == 50 {
            relay.own(now, &record, codec::encode_record(&record));
        }
        sent = sent.or_else(|| relay.poll(now).map(|_| t));
    }
    assert!(sent.is_some_and(|t| t < 150), "{sent:?}");
}

#[test]
fn a_later_life_voids_what_waits_of_the_earlier_one() {
    let mut relay = Relay::new(9, "f", RATE_BPS, 1000);
    let record = |author, incarnation, kind| Record {
        author,
        incarnation,
        seq: 1,
        kind,
        subject: 0,
        body: vec![0; 20],
        signature: Vec::new(),
    };
    let offer =
        |relay: &mut Relay, now, r: &Record| relay.offer(Time(now), r, &codec::encode_record(r), 0);
    assert_eq!(offer(&mut relay, 5000, &record(1, 1, 3)), Offer::New);
    assert_eq!(offer(&mut relay, 5001, &record(1, 2, 1)), Offer::New);
    assert_eq!(offer(&mut relay, 5002, &record(2, 1, 1)), Offer::New);
    assert_eq!(offer(&mut relay, 5003, &record(1, 1, 3)), Offer::Stale);
    let mut out = Vec::new();
    for t in 0..20 {
        while let Some(o) = relay.poll(Time(5003 + 10 * t)) {
            out.push(o.key);
        }
    }
    out.sort();
    assert_eq!(out, ["f/v4/state/0/1", "f/v4/state/0/2"]);
}

#[test]
fn a_flood_of_made_up_records_ends_at_the_caps() {
    let mut relay = Relay::new(0, "f", RATE_BPS, 1000);
    let mut dice = Dice::new(1);
    for t in 0..4000_u64 {
        let author = u16::try_from(1 + dice.below(3000)).unwrap();
        let record = Record {
            author,
            incarnation: u32::try_from(1 + dice.below(3)).unwrap(),
            seq: u32::try_from(dice.below(100)).unwrap(),
            kind: [1, 2, 3, 7, 8][usize::try_from(dice.below(5)).unwrap()],
            subject: 0,
            body: vec![1; 30],
            signature: Vec::new(),
        };
        relay.offer(Time(5000 + t), &record, &codec::encode_record(&record), 0);
        relay.on_beacon(Time(5000 + t), author, &samples::beacon(1));
        for (name, used, cap) in relay.loads() {
            assert!(used <= cap, "{name}: {used} of {cap}");
        }
        // The rate falls with the neighbours heard, but the peer is never silenced.
        relay.poll(Time(5000 + t));
    }
    assert!(relay.next_timeout(Time(9000)).is_some());
}
