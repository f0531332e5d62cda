//! What is wrong with each peer's clock, computer and disk, and by how much it makes the
//! peer late. No check leaves out a peer because of it: durations of one peer are judged
//! by its own clock, and a bound grows by what is told here, as long as it lasts.
//!
//! | what is wrong | what grows | until |
//! |---|---|---|
//! | a clock drifts | nothing of the peer's own, which is judged by its clock; what several do together, by the share of the drift | it ends |
//! | a clock jumps | nothing: what is to last at least so long counts the jump, what at most does not; a silence that is to last counts what a peer takes for its own waiting, up to a look at the time | – |
//! | a computer is x ms late | whatever the peer does after it heard of something, by 2 x: it hears late, and its timer comes late | it is quick again |
//! | a disk is x ms late | whatever is written before it is spoken, by 4 x a write: four kinds of promises share one disk | the last of these is written |
//! | a disk takes no writes, or not all | as above without end, for what must be written | it is healed |
//! | a process stands still | it is silent; counts from where it goes on | it goes on |

use crate::fault::Fault;
use std::collections::BTreeMap;

/// A peer looks at the time so many times a period.
const LOOKS_A_PERIOD: u64 = 4;

/// Promises of as many kinds may be under way on one disk, one each: a life, a bid, a
/// section, covered cells.
const WRITES_UNDER_WAY: u64 = 4;

/// A stretch of time over which a clock runs evenly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Stretch {
    from_ms: u64,
    ppm: i64,
    /// What it jumped ahead by when the stretch began.
    jump_ms: u64,
}

/// How late a disk is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Writes {
    Late(u64),
    Fail,
}

/// One peer: each list by time, the last entry holds on.
#[derive(Clone, Debug, Default)]
struct Handicap {
    clock: Vec<Stretch>,
    computer: Vec<(u64, u64)>,
    disk: Vec<(u64, Writes)>,
}

/// The handicaps of one run.
#[derive(Clone, Debug, Default)]
pub struct Handicaps {
    peers: BTreeMap<u16, Handicap>,
}

const MILLION: i64 = 1_000_000;

impl Handicaps {
    /// A fault strikes, or is over.
    pub fn on_fault(&mut self, now_ms: u64, fault: &Fault) {
        match *fault {
            Fault::ClockDrift { peer, ppm } => self.clock(now_ms, peer, Some(ppm), 0),
            Fault::ClockJump { peer, ahead_ms } => {
                self.clock(now_ms, peer, None, u64::from(ahead_ms));
            }
            Fault::SlowComputer { peer, delay_ms } => {
                let of = self.peers.entry(peer).or_default();
                of.computer.push((now_ms, u64::from(delay_ms)));
            }
            Fault::FailStores { peer, .. } => self.disk(now_ms, peer, Writes::Fail),
            Fault::SlowStores { peer, delay_ms } => {
                self.disk(now_ms, peer, Writes::Late(u64::from(delay_ms)));
            }
            Fault::HealStores { peer } => self.disk(now_ms, peer, Writes::Late(0)),
            _ => {}
        }
    }

    fn clock(&mut self, now_ms: u64, peer: u16, ppm: Option<i32>, jump_ms: u64) {
        let clock = &mut self.peers.entry(peer).or_default().clock;
        let before = clock.last().map_or(0, |s| s.ppm);
        clock.push(Stretch {
            from_ms: now_ms,
            ppm: ppm.map_or(before, i64::from),
            jump_ms,
        });
    }

    fn disk(&mut self, now_ms: u64, peer: u16, writes: Writes) {
        let of = self.peers.entry(peer).or_default();
        of.disk.push((now_ms, writes));
    }

    /// How much a peer's clock went on while it ran, jumps left out: what is to take at
    /// most so long is judged by this.
    #[must_use]
    pub fn lived_ms(&self, id: u16, from_ms: u64, to_ms: u64) -> u64 {
        let whole_ms = to_ms.saturating_sub(from_ms);
        let Some(of) = self.peers.get(&id) else {
            return whole_ms;
        };
        let ends = of.clock.iter().skip(1).map(|s| s.from_ms).chain([u64::MAX]);
        let gained: i64 = of.clock.iter().zip(ends).fold(0, |sum, (s, end_ms)| {
            let lasts_ms = to_ms.min(end_ms).saturating_sub(from_ms.max(s.from_ms));
            sum + i64::try_from(lasts_ms).unwrap_or(i64::MAX / MILLION) * s.ppm / MILLION
        });
        whole_ms.saturating_add_signed(gained)
    }

    /// How much a peer's clock went on: what is to take at least so long is judged by
    /// this, and what the peer says of its own past.
    #[must_use]
    pub fn shown_ms(&self, id: u16, from_ms: u64, to_ms: u64) -> u64 {
        let jumped_ms: u64 = self.jumps_ms(id, from_ms, to_ms).sum();
        self.lived_ms(id, from_ms, to_ms).saturating_add(jumped_ms)
    }

    /// How much of the jumps of its clock a peer may take for time in which it listened, when
    /// it looks at the time four times a period: one that comes just after a look is late only
    /// from the next on, and late is who is so by more than half a period. So does another, who
    /// tells it for how long somebody is suspected.
    #[must_use]
    pub fn taken_for_listening_ms(
        &self,
        id: u16,
        (from_ms, to_ms): (u64, u64),
        period_ms: u64,
    ) -> u64 {
        let (look_ms, late_ms) = (period_ms / LOOKS_A_PERIOD, period_ms / 2);
        let taken = |jump_ms: u64| {
            if jump_ms <= late_ms + look_ms {
                jump_ms
            } else {
                look_ms
            }
        };
        let of = |id: u16| -> u64 { self.jumps_ms(id, from_ms, to_ms).map(taken).sum() };
        let others = self.peers.keys().filter(|other| **other != id);
        of(id) + others.map(|other| of(*other)).max().unwrap_or(0)
    }

    fn jumps_ms(&self, id: u16, from_ms: u64, to_ms: u64) -> impl Iterator<Item = u64> + '_ {
        let clock = self.peers.get(&id).into_iter().flat_map(|of| &of.clock);
        let within = clock.filter(move |s| (from_ms..=to_ms).contains(&s.from_ms));
        within.map(|s| s.jump_ms)
    }

    /// How much later a peer may have done something that it was to do between these
    /// times: it heard of the reason late, and its timer came late.
    #[must_use]
    pub fn late_ms(&self, id: u16, from_ms: u64, to_ms: u64) -> u64 {
        let of = self.peers.get(&id);
        2 * of.map_or(0, |of| most(&of.computer, from_ms, to_ms).unwrap_or(0))
    }

    /// How much later a promise may have become durable that was to be so between these
    /// times; nothing when it may not have become so at all.
    #[must_use]
    pub fn write_ms(&self, id: u16, from_ms: u64, to_ms: u64) -> Option<u64> {
        let Some(of) = self.peers.get(&id) else {
            return Some(0);
        };
        let most_ms = |from_ms| match most(&of.disk, from_ms, to_ms) {
            Some(Writes::Fail) => None,
            Some(Writes::Late(ms)) => Some(WRITES_UNDER_WAY * ms),
            None => Some(0),
        };
        // What was begun on a slow disk before is still under way.
        let slowest_ms = of.disk.iter().filter_map(|(_, w)| match w {
            Writes::Late(ms) => Some(*ms),
            Writes::Fail => None,
        });
        let under_way_ms = WRITES_UNDER_WAY * slowest_ms.max().unwrap_or(0);
        most_ms(from_ms.saturating_sub(under_way_ms))
    }

    /// How much longer something takes that all do together and that began at `from_ms`:
    /// each late computer on its way makes it later once, and slow clocks stretch it.
    #[must_use]
    pub fn grown_ms(&self, bound_ms: u64, from_ms: u64, to_ms: u64) -> u64 {
        let late_ms: u64 = self
            .peers
            .keys()
            .map(|id| self.late_ms(*id, from_ms, to_ms))
            .sum();
        bound_ms + late_ms + bound_ms * self.drift_ppm(from_ms, to_ms) / (MILLION.unsigned_abs())
    }

    /// The largest drift of any clock between these times, millionths, either way.
    #[must_use]
    pub fn drift_ppm(&self, from_ms: u64, to_ms: u64) -> u64 {
        let of = |of: &Handicap| {
            let drifts: Vec<(u64, u64)> = of
                .clock
                .iter()
                .map(|s| (s.from_ms, s.ppm.unsigned_abs()))
                .collect();
            most(&drifts, from_ms, to_ms)
        };
        self.peers.values().filter_map(of).max().unwrap_or(0)
    }

    /// Since when every write of a peer succeeds; nothing while some fail.
    #[must_use]
    pub fn writes_since_ms(&self, id: u16, now_ms: u64) -> Option<u64> {
        let disk = self.peers.get(&id).map_or(&[][..], |of| &of.disk);
        let begun = &disk[..disk.partition_point(|(t, _)| *t <= now_ms)];
        let fails = |(_, w): &&(u64, Writes)| *w == Writes::Fail;
        match begun.iter().rposition(|w| fails(&w)) {
            None => Some(0),
            Some(last) => begun.get(last + 1).map(|(t, _)| *t),
        }
    }
}

/// The largest value in force at some time between these.
fn most<T: Copy + Ord>(list: &[(u64, T)], from_ms: u64, to_ms: u64) -> Option<T> {
    let begun = list.partition_point(|(t, _)| *t <= from_ms);
    let within = list[begun.saturating_sub(1)..].iter();
    within.filter(|(t, _)| *t <= to_ms).map(|(_, v)| *v).max()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_is_followed_with_its_jumps_and_without() {
        let mut h = Handicaps::default();
        h.on_fault(
            10_000,
            &Fault::ClockDrift {
                peer: 1,
                ppm: 20_000,
            },
        );
        h.on_fault(
            20_000,
            &Fault::ClockJump {
                peer: 1,
                ahead_ms: 3_000,
            },
        );
        h.on_fault(30_000, &Fault::ClockDrift { peer: 1, ppm: 0 });
        assert_eq!(h.lived_ms(1, 0, 10_000), 10_000);
        assert_eq!(h.lived_ms(1, 5_000, 15_000), 10_100);
        assert_eq!(h.lived_ms(1, 5_000, 45_000), 40_400);
        assert_eq!(h.shown_ms(1, 5_000, 45_000), 43_400);
        assert_eq!(h.shown_ms(1, 20_001, 45_000), 25_198);
        assert_eq!((h.lived_ms(2, 3, 9), h.shown_ms(2, 3, 9)), (6, 6));
        assert_eq!(h.drift_ppm(30_000, 50_000), 0);
        assert_eq!(h.drift_ppm(29_000, 50_000), 20_000);
    }

    #[test]
    fn lateness_counts_while_it_lasts_and_what_is_under_way_with_it() {
        let mut h = Handicaps::default();
        h.on_fault(
            10_000,
            &Fault::SlowComputer {
                peer: 1,
                delay_ms: 700,
            },
        );
        h.on_fault(
            20_000,
            &Fault::SlowComputer {
                peer: 1,
                delay_ms: 0,
            },
        );
        let late = |from_ms, to_ms| h.late_ms(1, from_ms, to_ms);
        assert_eq!(
            [late(0, 9_999), late(0, 10_000), late(15_000, 99_000)],
            [0, 1_400, 1_400]
        );
        assert_eq!((late(20_000, 99_000), h.late_ms(2, 0, 99_000)), (0, 0));
        assert_eq!(h.grown_ms(5_000, 12_000, 13_000), 6_400);
        let mut h = Handicaps::default();
        h.on_fault(
            10_000,
            &Fault::SlowStores {
                peer: 1,
                delay_ms: 500,
            },
        );
        h.on_fault(20_000, &Fault::FailStores { peer: 1, one_in: 1 });
        h.on_fault(30_000, &Fault::HealStores { peer: 1 });
        assert_eq!(h.write_ms(1, 0, 9_000), Some(0));
        assert_eq!(h.write_ms(1, 12_000, 13_000), Some(2_000));
        assert_eq!(h.write_ms(1, 12_000, 20_000), None);
        assert_eq!(h.write_ms(1, 31_999, 50_000), None);
        assert_eq!(h.write_ms(1, 32_000, 50_000), Some(0));
        let since = |now_ms| h.writes_since_ms(1, now_ms);
        assert_eq!(
            [since(19_999), since(20_000), since(40_000)],
            [Some(0), None, Some(30_000)]
        );
    }
}
