//! The radio shim between the transport and the peer's mind: what the air would do to
//! each message (D2.7 §1.5.1: limited range, blocked sight, loss, a channel that all share).
//!
//! In a trial what a peer says goes to the neighbours at once, stamped with the time at
//! which it was handed over, and every node puts it through a channel of its own: the
//! [`Medium`] of the simulator, over the stations that it hears of, with the links that
//! the world tells. So all nodes see the same queues, waits, collisions and losses. A node
//! lets its channel run a moment late ([`SETTLE_MS`]), so that what the others handed
//! over by then has arrived.
//!
//! In flight, without a world, the air does this itself: the shim lets everything pass,
//! and sends no faster than the channel ([`Outgoing`]). It also counts.

use crate::outgoing::{Frame, Outgoing};
use skein_link::counters::LATE_MS;
use skein_link::medium::{self, Channel, Medium, key_hash};
use skein_link::{LinkNews, Neighbourhood, RadioCounters, Reason};
use skein_peer::Time;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap, VecDeque};

/// A record that was passed on more often than this goes round in circles: the
/// longest chain of 64 UAVs that still has a detour is shorter.
pub const MAX_HOPS: u8 = 16;

/// Transmissions on their way at once: at 64 kbit/s and 2 s of queue no more than
/// 400 of the smallest ones can be in the air.
const MAX_IN_FLIGHT: usize = 1024;

/// How long a node waits for what others handed over to arrive, milliseconds of the
/// machine: what loopback and two busy cores take nearly always. What comes later takes
/// part in the channel from when it comes.
pub const SETTLE_MS: u64 = 10;

/// A node's channel moves on no more often than this, milliseconds of the machine:
/// every frame of every station would wake every process otherwise.
const STEP_MS: u64 = 2;

/// A stamp this far ahead of this node's clock is no later than so, milliseconds of
/// scenario time: clocks in a trial follow frames of the world, each 100 ms.
const MAX_AHEAD_MS: u64 = 500;

/// What travels beside the record, unsigned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hop {
    /// Who transmitted it.
    pub transmitter: u16,
    /// Counts the transmissions of the transmitter; the upper half is drawn at its start.
    pub number: u64,
    /// Hops the record had made before.
    pub hops: u8,
    /// When the transmitter handed it to its radio, milliseconds of scenario time.
    pub at_ms: u64,
    /// Which frames go first: the lower.
    pub priority: u8,
    /// Dropped when it is not on the air within this time, milliseconds.
    pub lifetime_ms: u32,
}

/// A transmission that arrived.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Arrived {
    /// Who transmitted it.
    pub transmitter: u16,
    /// Hops the record had made before.
    pub hops: u8,
    /// The record.
    pub bytes: Vec<u8>,
}

/// The air around one peer.
#[derive(Debug)]
pub struct Radio {
    me: u16,
    air: Air,
    next_number: u64,
    in_flight: BinaryHeap<Reverse<(u64, u64)>>,
    arriving: BTreeMap<u64, Arrived>,
    arrivals: u64,
    counters: RadioCounters,
    relayed_by: BTreeMap<u16, u64>,
    /// Bytes that arrived, by who transmitted them.
    bytes_from: BTreeMap<u16, u64>,
}

#[derive(Debug)]
enum Air {
    /// As it is: frames wait here for the channel.
    Open(Outgoing),
    /// A simulated one.
    Shared(Box<Shared>),
}

/// The channel of the stations around.
#[derive(Debug)]
struct Shared {
    medium: Medium,
    links: Neighbourhood,
    queue_age_ms: u32,
    /// To be given to the transport.
    said: VecDeque<(Hop, Frame)>,
    /// Handed over by somebody at a time up to which the channel has not run: by time in
    /// microseconds, station and number.
    pending: BTreeMap<(u64, u16, u64), medium::Frame>,
    /// The half of a transmission's number that names the boot, by station.
    boots: BTreeMap<u16, u64>,
    settle_ms: u64,
    step_ms: u64,
    /// The channel has run so far, microseconds of scenario time.
    ran_us: u64,
    /// Transmissions that were withheld until they were out of date.
    withheld: u64,
}

impl Radio {
    /// The radio of peer `me` without a world: open. `nonce` sets the numbers of one
    /// boot apart from those of the last.
    #[must_use]
    pub fn open(me: u16, nonce: u32, channel: Channel) -> Self {
        Self {
            me,
            air: Air::Open(Outgoing::new(channel)),
            next_number: u64::from(nonce) << 32,
            in_flight: BinaryHeap::new(),
            arriving: BTreeMap::new(),
            arrivals: 0,
            counters: RadioCounters::default(),
            relayed_by: BTreeMap::new(),
            bytes_from: BTreeMap::new(),
        }
    }

    /// The radio of peer `me` in a world that draws from `seed`; until the world sends a
    /// link table nothing arrives.
    #[must_use]
    pub fn in_world(me: u16, nonce: u32, channel: Channel, seed: u64) -> Self {
        Self {
            air: Air::Shared(Box::new(Shared {
                medium: Medium::new(&[me], channel, seed),
                links: Neighbourhood::new(me),
                queue_age_ms: channel.queue_age_ms,
                said: VecDeque::new(),
                pending: BTreeMap::new(),
                boots: BTreeMap::new(),
                settle_ms: SETTLE_MS,
                step_ms: STEP_MS,
                ran_us: 0,
                withheld: 0,
            })),
            ..Self::open(me, nonce, channel)
        }
    }

    /// Takes how fast scenario time runs, and the links where they changed.
    pub fn tick(&mut self, scale: f64, links: Option<LinkNews>) {
        let Air::Shared(air) = &mut self.air else {
            return;
        };
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            clippy::cast_precision_loss,
            reason = "the scale is positive and finite; the cast saturates"
        )]
        let scaled = |ms: u64| (ms as f64 * scale).ceil().clamp(1.0, 1_000.0) as u64;
        air.settle_ms = scaled(SETTLE_MS);
        air.step_ms = scaled(STEP_MS);
        if let Some(news) = links {
            air.links.set(news);
            let stations = air.boots.keys().copied();
            let gone: Vec<u16> = stations.filter(|s| !air.links.knows(*s)).collect();
            for station in gone {
                air.silence(station);
            }
        }
    }

    /// Takes what the peer says; [`Radio::to_send`] gives it to the transport.
    pub fn say(&mut self, now: Time, frame: Frame) {
        match &mut self.air {
            Air::Open(outgoing) => outgoing.push(now, frame),
            Air::Shared(air) => {
                let hop = hop(self.me, &mut self.next_number, now, &frame);
                air.take(now, &hop, key_hash(&frame.key), &frame.bytes);
                air.said.push_back((hop, frame));
            }
        }
    }

    /// What is to be given to the transport now, one after the other.
    pub fn to_send(&mut self, now: Time) -> Option<(Hop, Frame)> {
        match &mut self.air {
            Air::Open(outgoing) => {
                let frame = outgoing.pop(now)?;
                self.counters.sent += 1;
                self.counters.sent_bytes += frame.bytes.len() as u64;
                Some((hop(self.me, &mut self.next_number, now, &frame), frame))
            }
            Air::Shared(air) => air.said.pop_front(),
        }
    }

    /// Takes what the transport brought; [`Radio::due`] gives it back if it arrives.
    /// `key` is the hash of its key.
    pub fn receive(&mut self, now: Time, hop: Hop, key: u64, bytes: Vec<u8>) {
        if hop.hops > MAX_HOPS || self.arriving.len() >= MAX_IN_FLIGHT {
            self.counters.refused += 1;
            return;
        }
        match &mut self.air {
            Air::Open(_) => {
                let arrived = Arrived {
                    transmitter: hop.transmitter,
                    hops: hop.hops,
                    bytes,
                };
                self.arrives(now.0.saturating_mul(1000), arrived);
            }
            Air::Shared(air) => {
                let on_way_ms = now.0.saturating_sub(hop.at_ms);
                self.counters.arrived += 1;
                self.counters.late += u64::from(on_way_ms >= LATE_MS);
                air.hear(self.me, now, &hop, key, &bytes);
            }
        }
    }

    fn arrives(&mut self, at_us: u64, arrived: Arrived) {
        self.counters.received += 1;
        *self.bytes_from.entry(arrived.transmitter).or_default() += arrived.bytes.len() as u64;
        if arrived.hops > 0 {
            self.counters.multi_hop += 1;
            *self.relayed_by.entry(arrived.transmitter).or_default() += 1;
        }
        self.in_flight.push(Reverse((at_us, self.arrivals)));
        self.arriving.insert(self.arrivals, arrived);
        self.arrivals += 1;
    }

    /// Counts bytes that came without a readable hop.
    pub fn refuse(&mut self) {
        self.counters.refused += 1;
    }

    /// The next transmission that has arrived by `now`, in the order of arrival.
    pub fn due(&mut self, now: Time) -> Option<Arrived> {
        let delivered = match &mut self.air {
            Air::Open(_) => Vec::new(),
            Air::Shared(air) => air.run(now),
        };
        for d in delivered {
            let given_us = now.0.saturating_mul(1000).max(d.at_us);
            let age_ms = given_us.saturating_sub(d.queued_us) / 1000;
            self.counters.ages.note(age_ms);
            let arrived = Arrived {
                transmitter: d.tx,
                hops: d.hops,
                bytes: d.bytes.to_vec(),
            };
            self.arrives(d.at_us, arrived);
        }
        let Reverse((at_us, number)) = *self.in_flight.peek()?;
        if at_us > now.0.saturating_mul(1000) {
            return None;
        }
        self.in_flight.pop();
        self.arriving.remove(&number)
    }

    /// When something arrives, or may be sent.
    #[must_use]
    pub fn next_due(&self) -> Option<Time> {
        let arrives = self
            .in_flight
            .peek()
            .map(|Reverse((at_us, _))| Time(at_us.div_ceil(1000)));
        let moves = match &self.air {
            Air::Open(outgoing) => outgoing.next_due(),
            Air::Shared(air) => air.next_due(),
        };
        arrives.into_iter().chain(moves).min()
    }

    /// What happened so far; `overrun` is what the transport had to drop.
    #[must_use]
    pub fn counters(&self, overrun: u64) -> RadioCounters {
        let mut lost: BTreeMap<Reason, u64> = BTreeMap::new();
        let mut counters = self.counters.clone();
        match &self.air {
            Air::Open(outgoing) => {
                lost.insert(Reason::QueueAge, outgoing.dropped());
            }
            Air::Shared(air) => {
                lost.insert(Reason::Range, air.withheld);
                for (station, tally) in air.medium.tallies() {
                    let own = station == self.me;
                    if own {
                        counters.sent = tally.frames;
                        counters.sent_bytes = tally.bytes;
                    }
                    // What never left is the sender's loss, all else the receiver's.
                    for (reason, n) in &tally.dropped {
                        if own == (*reason == Reason::QueueAge) {
                            *lost.entry(*reason).or_default() += n;
                        }
                    }
                }
            }
        }
        lost.retain(|_, n| *n > 0);
        RadioCounters {
            relayed_by: self.relayed_by.iter().map(|(k, v)| (*k, *v)).collect(),
            bytes_by_link: self
                .bytes_from
                .iter()
                .map(|(from, n)| ((*from, self.me), *n))
                .collect(),
            lost: lost.into_iter().collect(),
            overrun,
            ..counters
        }
    }
}

impl Shared {
    /// Takes what a station handed over; it takes part in what has not run yet.
    fn take(&mut self, now: Time, hop: &Hop, key: u64, bytes: &[u8]) {
        let latest_ms = now.0.saturating_add(MAX_AHEAD_MS);
        let at_us = hop.at_ms.min(latest_ms).saturating_mul(1000);
        let frame = medium::Frame {
            key,
            bytes: bytes.into(),
            hops: hop.hops,
            priority: hop.priority,
            lifetime_ms: hop.lifetime_ms,
        };
        let place = (at_us.max(self.ran_us), hop.transmitter, hop.number);
        self.pending.insert(place, frame);
    }

    /// A station's process is gone, and its queue with it.
    fn silence(&mut self, station: u16) {
        self.pending.retain(|(_, tx, _), _| *tx != station);
        self.medium.silence(station);
    }

    fn hear(&mut self, me: u16, now: Time, hop: &Hop, key: u64, bytes: &[u8]) {
        let tx = hop.transmitter;
        // Its own words come back to nobody, and who is not in the table is out of reach.
        if tx == me || !self.links.knows(tx) {
            self.withheld += u64::from(tx != me);
            return;
        }
        if self
            .boots
            .insert(tx, hop.number >> 32)
            .is_some_and(|b| b != hop.number >> 32)
        {
            self.silence(tx);
        }
        // A transport that was cut held it back: it has been on the air long ago.
        let oldest_ms = now.0.saturating_sub(u64::from(self.queue_age_ms));
        if hop.at_ms < oldest_ms {
            self.withheld += 1;
            return;
        }
        self.medium.join(tx);
        self.take(now, hop, key, bytes);
    }

    /// Lets the channel run as far as everything has arrived for.
    fn run(&mut self, now: Time) -> Vec<medium::Delivery> {
        let to_us = now.0.saturating_sub(self.settle_ms).saturating_mul(1000);
        if to_us <= self.ran_us {
            return Vec::new();
        }
        self.ran_us = to_us;
        let later = self.pending.split_off(&(to_us.saturating_add(1), 0, 0));
        let mut delivered = Vec::new();
        let mut reached_us = None;
        for ((at_us, tx, _), frame) in std::mem::replace(&mut self.pending, later) {
            // What is handed over in one instant can share a transmission.
            if reached_us != Some(at_us) {
                delivered.extend(self.medium.advance(at_us, &self.links));
                reached_us = Some(at_us);
            }
            self.medium.submit(at_us, tx, frame);
        }
        delivered.extend(self.medium.advance(to_us, &self.links));
        delivered
    }

    fn next_due(&self) -> Option<Time> {
        let pending_us = self.pending.keys().next().map(|(at_us, ..)| *at_us);
        let event_us = pending_us
            .into_iter()
            .chain(self.medium.next_event())
            .min()?;
        let earliest_us = self
            .ran_us
            .saturating_add(self.step_ms.saturating_mul(1000));
        let at_ms = event_us.max(earliest_us).div_ceil(1000);
        Some(Time(at_ms.saturating_add(self.settle_ms)))
    }
}

fn hop(me: u16, next_number: &mut u64, now: Time, frame: &Frame) -> Hop {
    let number = *next_number;
    *next_number = number.wrapping_add(1);
    Hop {
        transmitter: me,
        number,
        hops: frame.hops,
        at_ms: now.0,
        priority: frame.priority as u8,
        lifetime_ms: frame.lifetime_ms,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_link::fate::mix;
    use skein_link::medium::Links;
    use skein_link::{Hearing, LinkState};
    use skein_peer::Priority;
    use std::collections::BTreeSet;

    const CHANNEL: Channel = Channel {
        rate_bps: 64_000,
        overhead_bytes: 0,
        part_bytes: 0,
        frame_bytes: 0,
        queue_age_ms: 2_000,
    };

    /// On which a transmission carries more than one record.
    const FRAMES: Channel = Channel {
        overhead_bytes: 26,
        part_bytes: 4,
        frame_bytes: 320,
        ..CHANNEL
    };

    const UP: LinkState = LinkState {
        in_range: true,
        in_sight: true,
        delay_ms: 30,
        ..LinkState::DOWN
    };

    fn hop(number: u64, at_ms: u64) -> Hop {
        Hop {
            transmitter: 2,
            number,
            hops: 0,
            at_ms,
            priority: 0,
            lifetime_ms: 60_000,
        }
    }

    fn frame(key: &str, bytes: Vec<u8>, priority: Priority) -> Frame {
        Frame {
            key: key.to_owned(),
            bytes,
            hops: 0,
            priority,
            lifetime_ms: 60_000,
        }
    }

    fn news(link: LinkState) -> LinkNews {
        LinkNews {
            row: vec![(2, link)],
            hearing: Hearing::of(vec![1, 2], |_, _| link.is_up()),
        }
    }

    fn in_world(link: LinkState) -> Radio {
        let mut radio = Radio::in_world(1, 0, CHANNEL, 7);
        radio.tick(1.0, Some(news(link)));
        radio
    }

    /// Lets a second pass; what arrived, with the time.
    fn arrivals(radio: &mut Radio, from_ms: u64) -> Vec<(u64, Arrived)> {
        let mut all = Vec::new();
        for t in from_ms..from_ms + 1_000 {
            while let Some(a) = radio.due(Time(t)) {
                all.push((t, a));
            }
        }
        all
    }

    #[test]
    fn in_flight_everything_passes_at_once() {
        let mut radio = Radio::open(1, 0, CHANNEL);
        let passed_on = Hop {
            hops: 3,
            ..hop(0, 0)
        };
        radio.receive(Time(5), passed_on, 1, vec![1]);
        assert_eq!(radio.due(Time(5)).unwrap().bytes, vec![1]);
        assert_eq!(radio.counters(0).multi_hop, 1);
        assert_eq!(radio.counters(0).relayed_by, [(2, 1)]);
        radio.say(Time(5), frame("k", vec![0; 800], Priority::Claim));
        radio.say(Time(5), frame("l", vec![0; 8], Priority::Claim));
        assert_eq!(radio.to_send(Time(5)).unwrap().1.key, "k");
        assert!(
            radio.to_send(Time(5)).is_none(),
            "the channel is taken for 100 ms"
        );
        assert!(radio.to_send(Time(106)).is_some());
        assert_eq!(radio.counters(0).sent_bytes, 808);
    }

    #[test]
    fn in_a_world_a_frame_takes_its_airtime_and_the_delay_of_the_link() {
        let mut radio = in_world(UP);
        radio.receive(Time(103), hop(0, 100), 1, vec![1; 160]);
        assert!(radio.next_due().is_some());
        let all = arrivals(&mut radio, 103);
        assert_eq!(all.len(), 1);
        // A wait of up to 16 ms, 20 ms of airtime, 30 ms of delay, and what the node waits.
        let took_ms = all[0].0 - 100;
        assert!(
            (50..=50 + 16 + SETTLE_MS + 1).contains(&took_ms),
            "{took_ms}"
        );
        assert_eq!(all[0].1.bytes, vec![1; 160]);
    }

    #[test]
    fn what_is_said_leaves_at_once_and_is_counted_when_it_is_on_the_air() {
        let mut radio = in_world(UP);
        radio.say(Time(100), frame("k", vec![0; 80], Priority::Claim));
        let (hop, _) = radio.to_send(Time(100)).unwrap();
        assert_eq!((hop.transmitter, hop.at_ms), (1, 100));
        assert_eq!(radio.counters(0).sent, 0);
        assert!(arrivals(&mut radio, 100).is_empty(), "nobody hears himself");
        let counted = radio.counters(0);
        assert_eq!((counted.sent, counted.sent_bytes), (1, 80));
    }

    #[test]
    fn what_is_lost_is_counted_with_its_reason() {
        let mut radio = in_world(LinkState {
            in_sight: false,
            ..UP
        });
        radio.receive(Time(0), hop(0, 0), 1, vec![1]);
        assert!(arrivals(&mut radio, 0).is_empty());
        radio.tick(1.0, Some(news(LinkState { cut: true, ..UP })));
        radio.receive(Time(1_000), hop(1, 1_000), 1, vec![1]);
        assert!(arrivals(&mut radio, 1_000).is_empty());
        // Held back by a transport that was cut.
        radio.tick(1.0, Some(news(UP)));
        radio.receive(Time(9_000), hop(2, 6_000), 1, vec![1]);
        assert!(arrivals(&mut radio, 9_000).is_empty());
        // Not in the table: its radio does not work.
        radio.tick(1.0, Some(LinkNews::default()));
        radio.receive(Time(10_000), hop(3, 10_000), 1, vec![1]);
        assert!(arrivals(&mut radio, 10_000).is_empty());
        // 20,000 bytes hold the channel for longer than the next one may wait.
        radio.say(
            Time(11_000),
            frame("a", vec![0; 20_000], Priority::Telemetry),
        );
        radio.due(Time(11_100));
        radio.say(Time(11_100), frame("b", vec![0; 9], Priority::Telemetry));
        for at_ms in [12_000, 13_000, 14_000] {
            assert!(arrivals(&mut radio, at_ms).is_empty());
        }
        let lost = radio.counters(0).lost;
        assert_eq!(
            lost,
            [
                (Reason::Range, 2),
                (Reason::Sight, 1),
                (Reason::Cut, 1),
                (Reason::QueueAge, 1)
            ]
        );
        assert_eq!(radio.counters(0).sent, 1);
    }

    #[test]
    fn of_a_process_that_ended_nothing_more_is_heard() {
        let mut radio = in_world(UP);
        // Ten frames of 100 ms each; after the first its process is gone.
        for number in 0..10 {
            radio.receive(Time(0), hop(number, 0), number, vec![0; 800]);
        }
        let mut heard = 0;
        for t in 0..170 {
            heard += usize::from(radio.due(Time(t)).is_some());
        }
        radio.tick(1.0, Some(LinkNews::default()));
        assert!(arrivals(&mut radio, 170).is_empty());
        // A new process, told of by its number only.
        radio.tick(1.0, Some(news(UP)));
        radio.receive(Time(2_000), hop(10, 2_000), 1, vec![0; 800]);
        radio.receive(Time(2_000), hop(11, 2_000), 2, vec![0; 800]);
        radio.receive(Time(2_001), hop(5 << 32, 2_001), 3, vec![3]);
        let all = arrivals(&mut radio, 2_000);
        assert_eq!((heard, all.len()), (1, 1));
        assert_eq!(all[0].1.bytes, [3]);
    }

    #[test]
    fn a_record_that_goes_round_is_stopped() {
        let mut radio = in_world(UP);
        let circling = Hop {
            hops: MAX_HOPS + 1,
            ..hop(0, 0)
        };
        radio.receive(Time(0), circling, 1, vec![]);
        assert_eq!(radio.next_due(), None);
        assert_eq!(radio.counters(0).refused, 1);
    }

    #[test]
    fn stamps_out_of_all_bounds_do_no_harm() {
        let mut radio = in_world(UP);
        radio.receive(Time(5_000), hop(1, u64::MAX), 1, vec![1]);
        radio.receive(Time(5_000), hop(0, 0), 1, vec![2]);
        let all = arrivals(&mut radio, 5_000);
        assert_eq!(all.len(), 1, "the second is out of date");
        assert!(all[0].0 < 5_000 + MAX_AHEAD_MS + 200);
    }

    #[test]
    fn the_numbers_of_two_boots_do_not_meet() {
        let number = |nonce| {
            let mut radio = Radio::in_world(1, nonce, CHANNEL, 7);
            radio.say(Time(0), frame("k", vec![], Priority::Claim));
            radio.to_send(Time(0)).unwrap().0.number
        };
        assert!(number(10).abs_diff(number(11)) > 1 << 31);
    }

    /// Six stations of which some do not hear some, with loss.
    struct Table;

    impl Links for Table {
        fn state(&self, tx: u16, rx: u16) -> LinkState {
            let cut = [(1, 3), (3, 1), (2, 5), (5, 2), (6, 4)].contains(&(tx, rx));
            LinkState {
                cut,
                loss_permille: 100,
                ..UP
            }
        }

        fn present(&self, _station: u16) -> bool {
            true
        }
    }

    const STATIONS: [u16; 6] = [1, 2, 3, 4, 5, 6];

    fn six_nodes() -> BTreeMap<u16, Radio> {
        let hearing = Hearing::of(STATIONS.to_vec(), |tx, rx| Table.state(tx, rx).is_up());
        let node = |id: u16| {
            let mut node = Radio::in_world(id, u32::from(id), FRAMES, 7);
            let others = STATIONS.iter().filter(|tx| **tx != id);
            let news = LinkNews {
                row: others.map(|tx| (*tx, Table.state(*tx, id))).collect(),
                hearing: hearing.clone(),
            };
            node.tick(1.0, Some(news));
            node
        };
        STATIONS.map(|id| (id, node(id))).into()
    }

    /// What a station says at a time, by chance: for half of the time seven frames a
    /// second of 60 to 187 bytes, which is two thirds of the channel for all six.
    fn chatter(t: u64, tx: u16) -> Option<Frame> {
        let draw = mix(mix(t) ^ u64::from(tx));
        (draw.is_multiple_of(140) && t % 8_000 < 4_000).then(|| {
            let mut bytes = vec![0; 60 + usize::try_from(draw >> 40 & 127).unwrap()];
            bytes[..8].copy_from_slice(&t.to_le_bytes());
            let priority = if draw >> 30 & 1 == 0 {
                Priority::Claim
            } else {
                Priority::Telemetry
            };
            frame(&format!("{tx}/{}", draw >> 20 & 3), bytes, priority)
        })
    }

    /// Receptions at a station: when, from whom, what.
    type Receptions = BTreeMap<u16, Vec<(u64, u16, Vec<u8>)>>;

    /// The channel of the simulator, and six nodes that hear of each other's frames
    /// late and out of order, agree on every single reception.
    #[test]
    fn nodes_see_the_channel_that_the_simulator_has() {
        let mut one = Medium::new(&STATIONS, FRAMES, 7);
        let mut nodes = six_nodes();
        let (mut expected, mut seen) = (Receptions::new(), Receptions::new());
        let mut under_way: BTreeMap<u64, Vec<(u16, Hop, Frame)>> = BTreeMap::new();
        for t in 0..64_000u64 {
            for d in one.advance(t * 1000, &Table) {
                let entry = expected.entry(d.rx).or_default();
                entry.push((d.at_us, d.tx, d.bytes.to_vec()));
            }
            for tx in STATIONS {
                let Some(said) = chatter(t, tx) else {
                    continue;
                };
                let node = nodes.get_mut(&tx).unwrap();
                node.say(Time(t), said);
                let (hop, said) = node.to_send(Time(t)).unwrap();
                let waiting = medium::Frame {
                    key: key_hash(&said.key),
                    bytes: said.bytes.clone().into(),
                    hops: 0,
                    priority: said.priority as u8,
                    lifetime_ms: 60_000,
                };
                one.submit(t * 1000, tx, waiting);
                for rx in STATIONS.iter().filter(|rx| **rx != tx) {
                    let late_ms = mix(t ^ u64::from(*rx) << 40) % SETTLE_MS;
                    let place = under_way.entry(t + late_ms).or_default();
                    place.push((*rx, hop, said.clone()));
                }
            }
            for (rx, hop, said) in under_way.remove(&t).unwrap_or_default() {
                let node = nodes.get_mut(&rx).unwrap();
                node.receive(Time(t), hop, key_hash(&said.key), said.bytes);
            }
            for (rx, node) in &mut nodes {
                while let Some(a) = node.due(Time(t)) {
                    let entry = seen.entry(*rx).or_default();
                    entry.push((t, a.transmitter, a.bytes));
                }
            }
        }
        let total = one.total();
        assert!(total.dropped[&Reason::Collision] > 100, "{total:?}");
        for rx in STATIONS {
            let (all, got) = (&expected[&rx], &seen[&rx]);
            assert!(all.len() > 300, "{}", all.len());
            let what = |list: &[(u64, u16, Vec<u8>)]| -> BTreeSet<(u16, Vec<u8>)> {
                let heard = list.iter().map(|(_, tx, bytes)| (*tx, bytes.clone()));
                heard.collect()
            };
            assert_eq!(what(all), what(got), "at station {rx}");
            for ((at_us, ..), (t, ..)) in all.iter().zip(got) {
                let late_ms = t - at_us.div_ceil(1000);
                assert!(late_ms <= SETTLE_MS, "{late_ms} ms late");
            }
        }
        // Both count the same losses, and the same transmissions.
        let mut lost: BTreeMap<Reason, u64> = BTreeMap::new();
        for node in nodes.values() {
            for (reason, n) in node.counters(0).lost {
                *lost.entry(reason).or_default() += n;
            }
        }
        assert_eq!(lost, total.dropped);
        let sent: u64 = nodes.values().map(|n| n.counters(0).sent).sum();
        assert_eq!(sent, total.frames);
    }
}
