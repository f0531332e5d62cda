//! The radio shim between the bus and the peer's mind: what the air would do to
//! each message (D2.7 §1.5.1: limited range, blocked sight, loss).
//!
//! In a trial the world tells, with every frame, the state of the links into this
//! peer; each transmission that the bus brings then meets the same
//! [`skein_link::fate()`] as in the simulator. In flight, without a world, the air
//! does this itself and the shim lets everything pass. It also counts.

use skein_link::{Fate, LinkState, RadioCounters, Reason, fate};
use skein_peer::Time;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

/// A record that was passed on more often than this goes round in circles: the
/// longest chain of 64 UAVs that still has a detour is shorter.
pub const MAX_HOPS: u8 = 16;

/// Transmissions on their way at once: at 64 kbit/s and 2 s of queue no more than
/// 400 of the smallest ones can be in the air.
const MAX_IN_FLIGHT: usize = 1024;

/// What changes at each hop; travels beside the record, unsigned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hop {
    /// Who transmitted it.
    pub transmitter: u16,
    /// Counts the transmissions of the transmitter.
    pub number: u64,
    /// Hops the record had made before.
    pub hops: u8,
}

/// A transmission that arrived.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Arrived {
    /// How it came.
    pub hop: Hop,
    /// The record.
    pub bytes: Vec<u8>,
}

/// The air around one peer.
#[derive(Debug)]
pub struct Radio {
    me: u16,
    world: Option<World>,
    next_number: u64,
    in_flight: BinaryHeap<Reverse<(Time, u64)>>,
    arriving: BTreeMap<u64, Arrived>,
    arrivals: u64,
    counters: RadioCounters,
    lost: BTreeMap<Reason, u64>,
    relayed_by: BTreeMap<u16, u64>,
}

#[derive(Debug)]
struct World {
    seed: u64,
    links: BTreeMap<u16, LinkState>,
}

impl Radio {
    /// The radio of peer `me` without a world: open. `nonce` sets the numbers of one
    /// boot apart from those of the last.
    #[must_use]
    pub fn open(me: u16, nonce: u32) -> Self {
        Self {
            me,
            world: None,
            next_number: u64::from(nonce) << 32,
            in_flight: BinaryHeap::new(),
            arriving: BTreeMap::new(),
            arrivals: 0,
            counters: RadioCounters::default(),
            lost: BTreeMap::new(),
            relayed_by: BTreeMap::new(),
        }
    }

    /// From now on a world decides; until it sends a link table nothing arrives.
    pub fn join(&mut self, seed: u64) {
        self.world = Some(World {
            seed,
            links: BTreeMap::new(),
        });
    }

    /// Takes the state of the links into this peer.
    pub fn links(&mut self, table: Vec<(u16, LinkState)>) {
        if let Some(world) = &mut self.world {
            world.links = table.into_iter().collect();
        }
    }

    /// Numbers a transmission of `length` bytes.
    pub fn transmit(&mut self, hops: u8, length: usize) -> Hop {
        let number = self.next_number;
        self.next_number = self.next_number.wrapping_add(1);
        self.counters.sent += 1;
        self.counters.sent_bytes += length as u64;
        Hop {
            transmitter: self.me,
            number,
            hops,
        }
    }

    /// Takes what the bus brought; [`Radio::due`] gives it back if it arrives.
    pub fn receive(&mut self, now: Time, hop: Hop, bytes: Vec<u8>) {
        if hop.hops > MAX_HOPS || self.arriving.len() >= MAX_IN_FLIGHT {
            self.counters.refused += 1;
            return;
        }
        let delay_ms = match self.fate(&hop) {
            Fate::Delivered { delay_ms } => delay_ms,
            Fate::Lost(reason) => {
                *self.lost.entry(reason).or_default() += 1;
                return;
            }
        };
        self.counters.received += 1;
        if hop.hops > 0 {
            self.counters.multi_hop += 1;
            *self.relayed_by.entry(hop.transmitter).or_default() += 1;
        }
        self.in_flight
            .push(Reverse((now.plus_ms(u64::from(delay_ms)), self.arrivals)));
        self.arriving.insert(self.arrivals, Arrived { hop, bytes });
        self.arrivals += 1;
    }

    fn fate(&self, hop: &Hop) -> Fate {
        let Some(world) = &self.world else {
            return Fate::Delivered { delay_ms: 0 };
        };
        // A transmitter without a row is out of the world's reach.
        match world.links.get(&hop.transmitter) {
            Some(link) => fate(world.seed, hop.transmitter, self.me, hop.number, link),
            None => Fate::Lost(Reason::Range),
        }
    }

    /// Counts bytes that came without a readable hop.
    pub fn refuse(&mut self) {
        self.counters.refused += 1;
    }

    /// The next transmission that has arrived by `now`, in the order of arrival.
    pub fn due(&mut self, now: Time) -> Option<Arrived> {
        let Reverse((at, number)) = *self.in_flight.peek()?;
        if at > now {
            return None;
        }
        self.in_flight.pop();
        self.arriving.remove(&number)
    }

    /// When the next transmission arrives.
    #[must_use]
    pub fn next_due(&self) -> Option<Time> {
        self.in_flight.peek().map(|Reverse((at, _))| *at)
    }

    /// What happened so far; `unsent` frames waited too long for the channel, `overrun`
    /// is what the transport had to drop.
    #[must_use]
    pub fn counters(&self, unsent: u64, overrun: u64) -> RadioCounters {
        let mut lost = self.lost.clone();
        if unsent > 0 {
            *lost.entry(Reason::QueueAge).or_default() += unsent;
        }
        RadioCounters {
            relayed_by: self.relayed_by.iter().map(|(k, v)| (*k, *v)).collect(),
            lost: lost.into_iter().collect(),
            overrun,
            ..self.counters.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UP: LinkState = LinkState {
        in_range: true,
        in_sight: true,
        cut: false,
        loss_permille: 0,
        delay_ms: 30,
    };

    fn hop(number: u64, hops: u8) -> Hop {
        Hop {
            transmitter: 2,
            number,
            hops,
        }
    }

    fn in_world(link: LinkState) -> Radio {
        let mut radio = Radio::open(1, 0);
        radio.join(7);
        radio.links(vec![(2, link)]);
        radio
    }

    #[test]
    fn in_flight_everything_passes_at_once() {
        let mut radio = Radio::open(1, 0);
        radio.receive(Time(5), hop(0, 3), vec![1]);
        assert_eq!(radio.due(Time(5)).unwrap().bytes, vec![1]);
        assert_eq!(radio.counters(0, 0).multi_hop, 1);
        assert_eq!(radio.counters(0, 0).relayed_by, [(2, 1)]);
    }

    #[test]
    fn the_delay_of_the_link_passes_first_and_order_is_kept() {
        let mut radio = in_world(UP);
        radio.receive(Time(100), hop(0, 0), vec![1]);
        radio.receive(Time(100), hop(1, 0), vec![2]);
        assert_eq!(radio.next_due(), Some(Time(130)));
        assert_eq!(radio.due(Time(129)), None);
        assert_eq!(radio.due(Time(130)).unwrap().bytes, vec![1]);
        assert_eq!(radio.due(Time(130)).unwrap().bytes, vec![2]);
        assert_eq!(radio.due(Time(999)), None);
    }

    #[test]
    fn what_is_lost_is_counted_with_its_reason() {
        let mut radio = in_world(LinkState {
            in_sight: false,
            ..UP
        });
        radio.receive(Time(0), hop(0, 0), vec![1]);
        radio.links(vec![(2, LinkState { cut: true, ..UP })]);
        radio.receive(Time(0), hop(1, 0), vec![1]);
        radio.links(vec![]);
        radio.receive(Time(0), hop(2, 0), vec![1]);
        assert_eq!(radio.next_due(), None);
        let lost = radio.counters(2, 0).lost;
        assert_eq!(
            lost,
            [
                (Reason::Range, 1),
                (Reason::Sight, 1),
                (Reason::Cut, 1),
                (Reason::QueueAge, 2)
            ]
        );
    }

    #[test]
    fn loss_is_the_draw_that_the_simulator_makes() {
        let link = LinkState {
            loss_permille: 400,
            delay_ms: 0,
            ..UP
        };
        let mut radio = in_world(link);
        for number in 0..500 {
            radio.receive(Time(0), hop(number, 0), vec![]);
            let arrived = radio.due(Time(0)).is_some();
            let expected = matches!(fate(7, 2, 1, number, &link), Fate::Delivered { .. });
            assert_eq!(arrived, expected, "{number}");
        }
    }

    #[test]
    fn a_record_that_goes_round_is_stopped() {
        let mut radio = in_world(UP);
        radio.receive(Time(0), hop(0, MAX_HOPS + 1), vec![]);
        assert_eq!(radio.next_due(), None);
        assert_eq!(radio.counters(0, 0).refused, 1);
    }

    #[test]
    fn the_numbers_of_two_boots_do_not_meet() {
        let first = Radio::open(1, 10).transmit(0, 1).number;
        let second = Radio::open(1, 11).transmit(0, 1).number;
        assert!(first.abs_diff(second) > 1 << 31);
    }
}
