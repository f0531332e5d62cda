//! The narrow-band half-duplex channel that all peers share (D2.7 §2.2).
//!
//! A station listens before it sends: it starts when it hears nobody, else it waits for
//! the end of what it hears plus a short random time. A transmission carries as many of
//! the waiting records as one frame holds and lasts eight bits a byte of them and their
//! headers at the channel's rate. At its end every other station either gets it or not:
//! the link may be down, the draw of [`fate()`] may lose it, the station may
//! have been sending itself, or it may have heard two at once, from senders that did
//! not hear each other (or began within the same moment).
//!
//! Each station has one queue ([`crate::queue`]).

use crate::fate::mix;
use crate::queue::{Queued, SendQueue, Waiting};
use crate::{Fate, LinkState, Reason, fate};
use skein_geometry::hash::Fnv;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Random wait before a station that found the channel busy, or something new in its
/// queue, listens again, microseconds: about one short frame at 64 kbit/s, so that
/// eight waiting stations rarely begin together and little air is idle.
pub const BACKOFF_US: u64 = 16_000;

/// A transmission is heard this long after it began, microseconds: the time a radio
/// takes from receiving to sending. Two stations that begin within it collide.
pub const SENSE_US: u64 = 200;

/// The channel itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Channel {
    /// Its bit rate, bit/s.
    pub rate_bps: u32,
    /// Bytes that headers add to each transmission.
    pub overhead_bytes: usize,
    /// Bytes that tell a further record in the same transmission from those before it.
    pub part_bytes: usize,
    /// A transmission takes further records up to so many bytes; one record may be longer.
    pub frame_bytes: usize,
    /// Frames that waited longer than this are dropped, milliseconds.
    pub queue_age_ms: u32,
}

impl Channel {
    /// The length that a transmission of so many bytes has with one more record, headers
    /// left out; none where a frame does not hold both.
    #[must_use]
    pub fn joined_bytes(&self, filled: usize, n_bytes: usize) -> Option<usize> {
        let joined = filled
            .saturating_add(self.part_bytes)
            .saturating_add(n_bytes);
        (joined <= self.frame_bytes).then_some(joined)
    }

    /// How long a frame with its headers is on the air, microseconds, at least one.
    #[must_use]
    pub fn airtime_us(&self, n_bytes: usize) -> u64 {
        let n_bytes = n_bytes.saturating_add(self.overhead_bytes);
        let bits = u64::try_from(n_bytes).unwrap_or(u64::MAX).saturating_mul(8);
        bits.saturating_mul(1_000_000)
            .div_ceil(u64::from(self.rate_bps.max(1)))
            .max(1)
    }
}

/// Who hears whom at the moment.
pub trait Links {
    /// The link from `tx` to `rx`.
    fn state(&self, tx: u16, rx: u16) -> LinkState;
    /// Whether a station has a working radio.
    fn present(&self, station: u16) -> bool;
}

/// What stands for a record's key on the channel.
#[must_use]
pub fn key_hash(key: &str) -> u64 {
    let mut hash = Fnv::new();
    hash.write(key.as_bytes());
    hash.finish()
}

/// What a station wants to send.
#[derive(Clone, Debug)]
pub struct Frame {
    /// [`key_hash`] of the key; a newer frame of the same key replaces a waiting older one.
    pub key: u64,
    /// The record.
    pub bytes: Arc<[u8]>,
    /// Hops the record has made before this transmission.
    pub hops: u8,
    /// Which frames go first: the lower.
    pub priority: u8,
    /// Dropped when it has not begun within this time, milliseconds.
    pub lifetime_ms: u32,
}

/// A record of a frame that got through.
#[derive(Clone, Debug)]
pub struct Delivery {
    /// When it is received: the end of the transmission plus the delay of the link, µs.
    pub at_us: u64,
    /// When it was handed to the sender's queue, µs.
    pub queued_us: u64,
    /// Who sent it.
    pub tx: u16,
    /// Who gets it.
    pub rx: u16,
    /// The sender's count of transmissions.
    pub number: u64,
    /// [`key_hash`] of the key.
    pub key: u64,
    /// Hops the record had made before this transmission.
    pub hops: u8,
    /// The record.
    pub bytes: Arc<[u8]>,
}

/// What a station did to the channel, and what became of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Transmissions begun.
    pub frames: u64,
    /// Bytes sent, headers left out.
    pub bytes: u64,
    /// Time on the air, microseconds.
    pub airtime_us: u64,
    /// Receptions, over all receivers.
    pub delivered: u64,
    /// Waiting frames replaced by a newer one of the same key.
    pub replaced: u64,
    /// Receptions that failed (over all receivers present) and frames that left the
    /// queue unsent, by reason.
    pub dropped: BTreeMap<Reason, u64>,
}

impl Tally {
    fn drop_many(&mut self, reason: Reason, n: u64) {
        if n > 0 {
            *self.dropped.entry(reason).or_insert(0) += n;
        }
    }

    /// Adds another station's figures.
    pub fn add(&mut self, other: &Self) {
        self.frames += other.frames;
        self.bytes += other.bytes;
        self.airtime_us += other.airtime_us;
        self.delivered += other.delivered;
        self.replaced += other.replaced;
        for (reason, n) in &other.dropped {
            *self.dropped.entry(*reason).or_insert(0) += n;
        }
    }
}

#[derive(Clone, Debug)]
struct Station {
    id: u16,
    queue: SendQueue<Frame>,
    /// When it listens next; nothing while it sends or has nothing to send.
    listen_us: Option<u64>,
    sending: bool,
    sent: u64,
    draws: u64,
    tally: Tally,
}

#[derive(Clone, Debug)]
struct OnAir {
    station: usize,
    from_us: u64,
    to_us: u64,
    number: u64,
    waiting: Vec<Waiting<Frame>>,
    over: bool,
}

/// The channel and its stations.
#[derive(Clone, Debug)]
pub struct Medium {
    channel: Channel,
    seed: u64,
    stations: Vec<Station>,
    air: Vec<OnAir>,
    /// What [`Medium::earliest`] was after the last change: drivers ask at each step.
    next: Option<(u64, Next)>,
}

/// What happens next. Ends come before begins at the same time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Next {
    End(usize),
    Listen(usize),
}

impl Medium {
    /// A silent channel with some stations.
    #[must_use]
    pub fn new(stations: &[u16], channel: Channel, seed: u64) -> Self {
        let mut stations: Vec<Station> = stations.iter().map(|id| Station::new(*id)).collect();
        stations.sort_by_key(|s| s.id);
        Self {
            channel,
            seed,
            stations,
            air: Vec::new(),
            next: None,
        }
    }

    /// Takes a station in, unless it is one.
    pub fn join(&mut self, station: u16) {
        if self.stations.iter().all(|s| s.id != station) {
            self.stations.push(Station::new(station));
        }
    }

    /// The figures of one station.
    #[must_use]
    pub fn tally(&self, node: u16) -> Option<&Tally> {
        self.stations
            .iter()
            .find(|s| s.id == node)
            .map(|s| &s.tally)
    }

    /// The figures of each station.
    pub fn tallies(&self) -> impl Iterator<Item = (u16, &Tally)> {
        self.stations.iter().map(|s| (s.id, &s.tally))
    }

    /// The figures of all stations together.
    #[must_use]
    pub fn total(&self) -> Tally {
        let mut sum = Tally::default();
        for s in &self.stations {
            sum.add(&s.tally);
        }
        sum
    }

    /// Number of frames waiting at a station.
    #[must_use]
    pub fn n_waiting(&self, node: u16) -> usize {
        self.stations
            .iter()
            .find(|s| s.id == node)
            .map_or(0, |s| s.queue.len())
    }

    /// Puts a frame into a station's queue. Unknown stations are ignored.
    pub fn submit(&mut self, now_us: u64, tx: u16, frame: Frame) {
        let Some(i) = self.stations.iter().position(|s| s.id == tx) else {
            return;
        };
        self.stations[i].enqueue(now_us, frame);
        if self.stations[i].listen_us.is_none() && !self.stations[i].sending {
            let wait_us = self.backoff(i);
            self.stations[i].listen_us = Some(now_us + wait_us);
            self.next = self.earliest();
        }
    }

    /// A station falls silent: its queue is gone and what it is sending is lost.
    pub fn silence(&mut self, node: u16) {
        let Some(i) = self.stations.iter().position(|s| s.id == node) else {
            return;
        };
        self.stations[i].queue.clear();
        self.stations[i].listen_us = None;
        self.stations[i].sending = false;
        self.air.retain(|a| a.station != i || a.over);
        self.next = self.earliest();
    }

    /// When the channel wants [`Medium::advance`] next, microseconds.
    #[must_use]
    pub fn next_event(&self) -> Option<u64> {
        debug_assert_eq!(self.next, self.earliest());
        self.next.map(|(at_us, _)| at_us)
    }

    fn earliest(&self) -> Option<(u64, Next)> {
        let ends = self
            .air
            .iter()
            .enumerate()
            .filter(|(_, a)| !a.over)
            .map(|(k, a)| (a.to_us, Next::End(k)));
        let listens = self
            .stations
            .iter()
            .enumerate()
            .filter_map(|(i, s)| Some((s.listen_us?, Next::Listen(i))));
        ends.chain(listens).min()
    }

    /// Lets everything happen that is due up to now, under the links as they are, and
    /// returns what got through, in order of the transmissions' ends. The receptions
    /// may lie as far after now as the link's delay.
    pub fn advance(&mut self, now_us: u64, links: &impl Links) -> Vec<Delivery> {
        let mut out = Vec::new();
        while let Some((at_us, what)) = self.next.filter(|(at_us, _)| *at_us <= now_us) {
            match what {
                Next::End(k) => self.end(k, links, &mut out),
                Next::Listen(i) => self.listen(at_us, i, links),
            }
            self.next = self.earliest();
        }
        out
    }

    /// A draw of the station's own stream: what others do does not shift it.
    fn backoff(&mut self, i: usize) -> u64 {
        let s = &mut self.stations[i];
        s.draws += 1;
        mix(mix(self.seed ^ (u64::from(s.id) << 48)) ^ s.draws) % BACKOFF_US
    }

    /// A station with something to send listens, and begins or waits.
    fn listen(&mut self, at_us: u64, i: usize, links: &impl Links) {
        let queue_age_ms = self.channel.queue_age_ms;
        let s = &mut self.stations[i];
        s.listen_us = None;
        s.expire(at_us, queue_age_ms);
        if s.queue.is_empty() {
            return;
        }
        let id = s.id;
        let heard_until_us = self
            .air
            .iter()
            .filter(|a| !a.over && a.from_us + SENSE_US <= at_us)
            .filter(|a| links.state(self.stations[a.station].id, id).is_up())
            .map(|a| a.to_us)
            .max();
        if let Some(until_us) = heard_until_us {
            let wait_us = self.backoff(i);
            self.stations[i].listen_us = Some(until_us + wait_us);
            return;
        }
        let channel = self.channel;
        let s = &mut self.stations[i];
        let joined_bytes = |filled, n_bytes| channel.joined_bytes(filled, n_bytes);
        let Some((waiting, n_bytes)) = s.queue.pop_transmission(joined_bytes) else {
            return;
        };
        let airtime_us = channel.airtime_us(n_bytes);
        s.sending = true;
        s.tally.frames += 1;
        s.tally.bytes += u64::try_from(n_bytes).unwrap_or(u64::MAX);
        s.tally.airtime_us += airtime_us;
        let number = s.sent;
        s.sent += 1;
        let to_us = at_us + airtime_us;
        self.air.push(OnAir {
            station: i,
            from_us: at_us,
            to_us,
            number,
            waiting,
            over: false,
        });
    }

    /// A transmission ends: every other station gets it or not.
    fn end(&mut self, k: usize, links: &impl Links, out: &mut Vec<Delivery>) {
        self.air[k].over = true;
        let a = &self.air[k];
        let (i, tx, to_us) = (a.station, self.stations[a.station].id, a.to_us);
        let mut fates = Vec::with_capacity(self.stations.len());
        for r in self
            .stations
            .iter()
            .filter(|r| r.id != tx && links.present(r.id))
        {
            let mut f = fate(self.seed, tx, r.id, a.number, &links.state(tx, r.id));
            if matches!(f, Fate::Delivered { .. }) && self.collides(k, r.id, links) {
                f = Fate::Lost(Reason::Collision);
            }
            fates.push((r.id, f));
        }
        let tally = &mut self.stations[i].tally;
        for (_, f) in &fates {
            match f {
                Fate::Lost(reason) => tally.drop_many(*reason, 1),
                Fate::Delivered { .. } => tally.delivered += 1,
            }
        }
        for Waiting {
            frame, queued_us, ..
        } in &a.waiting
        {
            for (rx, f) in &fates {
                if let Fate::Delivered { delay_ms } = f {
                    out.push(Delivery {
                        at_us: to_us + u64::from(*delay_ms) * 1000,
                        queued_us: *queued_us,
                        tx,
                        rx: *rx,
                        number: a.number,
                        key: frame.key,
                        hops: frame.hops,
                        bytes: Arc::clone(&frame.bytes),
                    });
                }
            }
        }
        self.stations[i].sending = false;
        if !self.stations[i].queue.is_empty() {
            let wait_us = self.backoff(i);
            self.stations[i].listen_us = Some(to_us + wait_us);
        }
        // What ended before everything still on the air began can collide with nothing.
        let oldest_us = self.air.iter().filter(|a| !a.over).map(|a| a.from_us).min();
        self.air
            .retain(|a| !a.over || oldest_us.is_some_and(|t| a.to_us > t));
    }

    /// Whether something else was on the air at a receiver during a transmission: its
    /// own sending, or another one that it heard.
    fn collides(&self, k: usize, rx: u16, links: &impl Links) -> bool {
        let a = &self.air[k];
        self.air.iter().enumerate().any(|(o, b)| {
            let other = self.stations[b.station].id;
            o != k
                && b.station != a.station
                && b.from_us < a.to_us
                && a.from_us < b.to_us
                && (other == rx || links.state(other, rx).is_up())
        })
    }
}

impl Station {
    fn new(id: u16) -> Self {
        Self {
            id,
            queue: SendQueue::default(),
            listen_us: None,
            sending: false,
            sent: 0,
            draws: 0,
            tally: Tally::default(),
        }
    }

    fn enqueue(&mut self, now_us: u64, frame: Frame) {
        let pushed = self.queue.push(now_us, frame);
        self.tally.replaced += u64::from(pushed.replaced);
        if pushed.dropped {
            self.tally.drop_many(Reason::QueueAge, 1);
        }
    }

    fn expire(&mut self, now_us: u64, queue_age_ms: u32) {
        let n = self.queue.expire(now_us, queue_age_ms);
        self.tally.drop_many(Reason::QueueAge, n as u64);
    }
}

impl Queued for Frame {
    type Key = u64;
    type Priority = u8;

    fn key(&self) -> &u64 {
        &self.key
    }

    fn priority(&self) -> u8 {
        self.priority
    }

    fn lifetime_ms(&self) -> u32 {
        self.lifetime_ms
    }

    fn n_bytes(&self) -> usize {
        self.bytes.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::queue::MAX_QUEUE;

    const CONFLICT: u8 = 0;
    const CLAIM: u8 = 1;
    const BEACON: u8 = 3;
    const TELEMETRY: u8 = 4;

    /// All hear each other, but for some that do not hear some.
    #[derive(Default)]
    struct Table {
        /// From the first to the second.
        cuts: Vec<(u16, u16)>,
        loss_permille: u16,
    }

    impl Links for Table {
        fn state(&self, tx: u16, rx: u16) -> LinkState {
            LinkState {
                in_range: true,
                in_sight: true,
                cut: self.cuts.contains(&(tx, rx)),
                loss_permille: self.loss_permille,
                delay_ms: 5,
            }
        }

        fn present(&self, _station: u16) -> bool {
            true
        }
    }

    /// So many stations at 64 kbit/s, with links cut both ways.
    fn setup(n: u16, cuts: &[(u16, u16)]) -> (Table, Medium) {
        let stations: Vec<u16> = (1..=n).collect();
        let channel = Channel {
            rate_bps: 64_000,
            overhead_bytes: 0,
            part_bytes: 0,
            frame_bytes: 0,
            queue_age_ms: 2_000,
        };
        let links = Table {
            cuts: cuts
                .iter()
                .flat_map(|(a, b)| [(*a, *b), (*b, *a)])
                .collect(),
            loss_permille: 0,
        };
        (links, Medium::new(&stations, channel, 5))
    }

    fn frame(key: u64, n_bytes: usize, priority: u8) -> Frame {
        Frame {
            key,
            bytes: vec![0u8; n_bytes].into(),
            hops: 0,
            priority,
            lifetime_ms: 60_000,
        }
    }

    fn drain(m: &mut Medium, links: &impl Links) -> Vec<Delivery> {
        let mut all = Vec::new();
        while let Some(t) = m.next_event() {
            all.extend(m.advance(t, links));
        }
        all
    }

    #[test]
    fn one_frame_takes_its_airtime_and_reaches_all() {
        let (links, mut m) = setup(4, &[]);
        m.submit(1_000_000, 2, frame(1, 100, BEACON));
        let d = drain(&mut m, &links);
        assert_eq!(d.iter().map(|d| d.rx).collect::<Vec<_>>(), [1, 3, 4]);
        // 800 bits at 64 kbit/s are 12.5 ms; 5 ms delay; the rest is the wait.
        let wait = d[0].at_us - 1_000_000 - 12_500 - 5_000;
        assert!(wait < BACKOFF_US, "{wait}");
        let t = m.tally(2).unwrap();
        assert_eq!(
            (t.frames, t.bytes, t.airtime_us, t.delivered),
            (1, 100, 12_500, 3)
        );
        assert!(t.dropped.is_empty());
    }

    #[test]
    fn loss_is_as_stated_and_counted() {
        let (mut links, mut m) = setup(3, &[]);
        links.loss_permille = 250;
        let mut got = 0;
        for k in 0..4000u64 {
            m.submit(k * 50_000, 1, frame(k, 20, BEACON));
            got += drain(&mut m, &links).len();
        }
        let t = m.tally(1).unwrap();
        assert_eq!(t.delivered, got as u64);
        let lost = t.dropped[&Reason::Loss];
        assert_eq!(lost + t.delivered, 8000);
        assert!((1880..2120).contains(&lost), "{lost}");
    }

    #[test]
    fn stations_in_earshot_take_turns() {
        let (links, mut m) = setup(8, &[]);
        let mut d = Vec::new();
        for k in 0..200u64 {
            d.extend(m.advance(k * 400_000, &links));
            for tx in 1..=8 {
                m.submit(k * 400_000, tx, frame(u64::from(tx), 150, BEACON));
            }
        }
        d.extend(drain(&mut m, &links));
        let t = m.total();
        let collided = t.dropped.get(&Reason::Collision).copied().unwrap_or(0);
        assert_eq!(d.len() as u64 + collided, t.frames * 7);
        // Only those that begin within the sensing time of each other collide.
        assert!(collided * 5 < d.len() as u64, "{collided} of {}", d.len());
        assert_eq!(t.airtime_us, t.frames * 18_750);
        assert!(t.frames + t.replaced + t.dropped.get(&Reason::QueueAge).unwrap_or(&0) == 1600);
        assert!(t.frames > 1400, "{}", t.frames);
    }

    #[test]
    fn hidden_senders_collide_at_the_one_between() {
        // 1 and 3 hear 2, but not each other; 4 hears 3 alone.
        let (links, mut m) = setup(4, &[(1, 3), (1, 4), (2, 4)]);
        m.submit(0, 1, frame(1, 400, BEACON));
        m.submit(0, 3, frame(2, 400, BEACON));
        let d = drain(&mut m, &links);
        assert_eq!(d.iter().map(|d| (d.tx, d.rx)).collect::<Vec<_>>(), [(3, 4)]);
        let total = m.total();
        assert_eq!(total.dropped[&Reason::Collision], 2);
        assert_eq!(total.dropped[&Reason::Cut], 3);
        // One after the other both are heard.
        m.submit(1_000_000, 1, frame(1, 400, BEACON));
        let mut d = drain(&mut m, &links);
        m.submit(2_000_000, 3, frame(2, 400, BEACON));
        d.extend(drain(&mut m, &links));
        assert_eq!(
            d.iter().map(|d| (d.tx, d.rx)).collect::<Vec<_>>(),
            [(1, 2), (3, 2), (3, 4)]
        );
    }

    #[test]
    fn who_sends_hears_nothing() {
        // 2 does not hear 1, but 1 hears 2: 1 waits, 2 does not.
        let (mut links, mut m) = setup(2, &[]);
        links.cuts.push((1, 2));
        // 1 sends a long frame; 2 begins in the middle of it and is not heard by 1.
        m.submit(0, 1, frame(1, 1000, BEACON));
        m.submit(40_000, 2, frame(2, 50, BEACON));
        let d = drain(&mut m, &links);
        assert!(d.is_empty());
        assert_eq!(m.tally(2).unwrap().dropped[&Reason::Collision], 1);
        assert_eq!(m.tally(1).unwrap().dropped[&Reason::Cut], 1);
    }

    #[test]
    fn urgent_first_and_newest_value_in_the_old_place() {
        let (links, mut m) = setup(2, &[]);
        // The first one occupies the air while the others queue up.
        m.submit(0, 1, frame(100, 200, TELEMETRY));
        assert!(m.advance(BACKOFF_US, &links).is_empty());
        m.submit(17_000, 1, frame(1, 50, TELEMETRY));
        m.submit(17_001, 1, frame(2, 50, TELEMETRY));
        m.submit(17_002, 1, frame(3, 50, CLAIM));
        m.submit(17_003, 1, frame(4, 50, CONFLICT));
        m.submit(17_004, 1, frame(1, 60, TELEMETRY));
        assert_eq!(m.n_waiting(1), 4);
        let d = drain(&mut m, &links);
        assert_eq!(
            d.iter().map(|d| d.key).collect::<Vec<_>>(),
            [100, 4, 3, 1, 2]
        );
        assert_eq!((d[3].bytes.len(), d[3].queued_us), (60, 17_004));
        assert_eq!(m.tally(1).unwrap().replaced, 1);
        assert_eq!(
            d.iter().map(|d| d.number).collect::<Vec<_>>(),
            [0, 1, 2, 3, 4]
        );
    }

    #[test]
    fn a_transmission_carries_what_waits_up_to_the_length_of_a_frame() {
        let channel = Channel {
            rate_bps: 64_000,
            overhead_bytes: 26,
            part_bytes: 4,
            frame_bytes: 200,
            queue_age_ms: 2_000,
        };
        let links = Table::default();
        let mut m = Medium::new(&[1, 2, 3], channel, 5);
        for (key, n_bytes, priority) in [
            (1, 100, TELEMETRY),
            (2, 60, BEACON),
            (3, 300, CLAIM),
            (4, 50, CONFLICT),
            (5, 60, BEACON),
            (6, 20, TELEMETRY),
        ] {
            m.submit(0, 1, frame(key, n_bytes, priority));
        }
        let d = drain(&mut m, &links);
        // The order stays, but for what no longer fits.
        let to_2 = d.iter().filter(|d| d.rx == 2);
        assert_eq!(
            to_2.map(|d| (d.number, d.key)).collect::<Vec<_>>(),
            [(0, 4), (0, 2), (0, 5), (1, 3), (2, 1), (2, 6)]
        );
        // All of one arrives at once: 178, 300 and 124 bytes, and headers.
        let t = m.tally(1).unwrap();
        assert_eq!((t.frames, t.bytes, t.delivered), (3, 602, 6));
        assert_eq!(t.airtime_us, (602 + 3 * 26) * 125);
        assert_eq!(d[0].at_us, d[5].at_us);
        assert!(d[6].at_us >= d[0].at_us + 326 * 125);
    }

    #[test]
    fn what_waits_too_long_is_dropped() {
        let (links, mut m) = setup(2, &[]);
        // 20,000 bytes take 2.5 s; the age limit is 2 s, one frame's lifetime 100 ms.
        m.submit(0, 1, frame(1, 20_000, TELEMETRY));
        m.advance(BACKOFF_US, &links);
        m.submit(17_000, 1, frame(2, 50, CONFLICT));
        m.submit(2_000_000, 1, frame(3, 50, BEACON));
        m.submit(
            2_000_000,
            1,
            Frame {
                lifetime_ms: 100,
                ..frame(4, 50, BEACON)
            },
        );
        let d = drain(&mut m, &links);
        assert_eq!(d.iter().map(|d| d.key).collect::<Vec<_>>(), [1, 3]);
        assert_eq!(m.tally(1).unwrap().dropped[&Reason::QueueAge], 2);
        // A queue has a cap.
        for k in 0..500 {
            m.submit(9_000_000, 1, frame(k, 1, BEACON));
        }
        assert_eq!(m.n_waiting(1), MAX_QUEUE);
        m.silence(1);
        assert_eq!((m.n_waiting(1), m.next_event()), (0, None));
    }

    #[test]
    fn a_station_that_dies_while_sending_is_not_heard() {
        let (links, mut m) = setup(3, &[]);
        m.submit(0, 1, frame(1, 1000, BEACON));
        m.advance(20_000, &links);
        m.silence(1);
        m.submit(20_000, 2, frame(2, 50, BEACON));
        let d = drain(&mut m, &links);
        assert_eq!(
            d.iter().map(|d| (d.tx, d.rx)).collect::<Vec<_>>(),
            [(2, 1), (2, 3)]
        );
        m.submit(900_000, 1, frame(3, 10, BEACON));
        assert_eq!(drain(&mut m, &links).len(), 2, "and it can come back");
    }

    #[test]
    fn the_same_seed_gives_the_same_air() {
        let run = || {
            let (mut links, mut m) = setup(6, &[(1, 4), (2, 5)]);
            links.loss_permille = 100;
            let mut d = Vec::new();
            for k in 0..300u64 {
                d.extend(m.advance(k * 17_000, &links));
                m.submit(k * 17_000, (k % 6 + 1) as u16, frame(k % 11, 90, BEACON));
            }
            d.extend(drain(&mut m, &links));
            d.iter()
                .map(|d| (d.at_us, d.tx, d.rx, d.number))
                .collect::<Vec<_>>()
        };
        let a = run();
        assert!(a.len() > 500);
        assert_eq!(a, run());
    }
}
