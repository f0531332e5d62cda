//! Who is there: one-hop beacons, gossiped heartbeats with their ages, suspicion,
//! and a bound that holds at any loss (D2.7 §1.3: nodes relay for each other).
//!
//! | state | event | next state |
//! |---|---|---|
//! | unknown | a heartbeat younger than the bound | alive |
//! | alive | no fresher heartbeat for k1 T | suspect |
//! | suspect | a fresher heartbeat from anybody | alive |
//! | suspect | k2 T unrefuted | down |
//! | alive, suspect | freshest heartbeat older than (k1 + k2 + D + 2) T | down |
//! | down | a fresher heartbeat, younger than the bound | alive |
//! | any | a heartbeat of a later life | alive, in that life |
//!
//! k1 = 4 + D/4 and k2 = 4 + D/2 periods. Ages are sums of holding times, so that a
//! heartbeat that travelled long is known to be old: an old one refutes and revives
//! nothing, and a merging component cannot raise the dead.

use crate::Incarnation;
use crate::input::Time;
use crate::output::Status;
use crate::wire::message::{Beacon, Gossip};
use std::collections::BTreeMap;

/// Most peers remembered; a fleet is smaller, and a flood of made-up ids must end.
pub const MAX_KNOWN: usize = 64;

/// Hops and eccentricities count for this many periods after they were heard.
const HOP_PERIODS: u64 = 10;

/// No relay path is longer; more hops than this are somebody's error.
pub const MAX_HOPS: u8 = 16;

/// A belief that changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// About whom.
    pub peer: u16,
    /// In which life.
    pub incarnation: Incarnation,
    /// The new belief.
    pub status: Status,
}

/// What a peer last said of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Info {
    /// Whether it can plan.
    pub able: bool,
    /// Whether it is a ground station.
    pub ground: bool,
    /// Whether it holds that the mission is finished.
    pub finished: bool,
    /// Mission revision it follows.
    pub revision: u32,
    /// The loop it derived.
    pub loop_hash: u64,
}

#[derive(Clone, Debug)]
struct Known {
    incarnation: Incarnation,
    heartbeat: u32,
    /// When the freshest heartbeat was made, on our clock.
    made: Time,
    suspected: Option<Time>,
    status: Status,
    info: Info,
    /// Whether `info` is of this life and heard from itself or by gossip.
    hops: Vec<(Time, u8)>,
    eccentricity: u8,
    eccentricity_heard: Time,
}

/// All that a peer believes of others.
#[derive(Clone, Debug)]
pub struct Membership {
    me: u16,
    period_ms: u64,
    known: BTreeMap<u16, Known>,
    next_gossip: u16,
    expected_tick: Option<Time>,
    late_until: Time,
}

impl Membership {
    /// Nobody is known yet.
    #[must_use]
    pub fn new(me: u16, period_ms: u32) -> Self {
        Self {
            me,
            period_ms: u64::from(period_ms.max(1)),
            known: BTreeMap::new(),
            next_gossip: 0,
            expected_tick: None,
            late_until: Time(0),
        }
    }

    /// A new life of this peer itself: what it knows of others stays.
    pub fn set_self(&mut self, _incarnation: Incarnation) {}

    fn k1_ms(&self, now: Time) -> u64 {
        self.doubt(now) * self.period_ms * (16 + u64::from(self.diameter(now))) / 4
    }

    fn k2_ms(&self, now: Time) -> u64 {
        self.doubt(now) * self.period_ms * (8 + u64::from(self.diameter(now))) / 2
    }

    /// A peer whose own loop ran late doubts its verdicts: both factors double.
    fn doubt(&self, now: Time) -> u64 {
        if now < self.late_until { 2 } else { 1 }
    }

    /// Everybody in the component knows of a death within this time, milliseconds.
    #[must_use]
    pub fn bound_ms(&self, now: Time) -> u64 {
        self.k1_ms(now) + self.k2_ms(now) + (u64::from(self.diameter(now)) + 2) * self.period_ms
    }

    /// A beacon, heard from its author directly.
    pub fn on_beacon(&mut self, now: Time, author: u16, incarnation: Incarnation, beacon: &Beacon) -> Vec<Change> {
        let mut changes = Vec::new();
        let info = Info {
            able: beacon.able,
            ground: beacon.ground,
            finished: beacon.finished,
            revision: beacon.revision,
            loop_hash: beacon.loop_hash,
        };
        self.heartbeat(now, author, incarnation, beacon.heartbeat, now, 1, &mut changes);
        if let Some(k) = self.known.get_mut(&author)
            && k.incarnation == incarnation
        {
            k.info = info;
            k.eccentricity = beacon.eccentricity.min(MAX_HOPS);
            k.eccentricity_heard = now;
        }
        let me = self.me;
        for g in beacon.gossip.iter().filter(|g| g.id != me && g.id != author) {
            self.on_gossip(now, g, &info, &mut changes);
        }
        changes
    }

    fn on_gossip(&mut self, now: Time, g: &Gossip, teller: &Info, changes: &mut Vec<Change>) {
        let age_ms = u64::from(g.age_ds) * 100;
        if age_ms > self.bound_ms(now) || g.hops >= MAX_HOPS {
            return;
        }
        let made = Time(now.0.saturating_sub(age_ms));
        let fresher = self.heartbeat(now, g.id, g.incarnation, g.heartbeat, made, g.hops + 1, changes);
        let Some(k) = self.known.get_mut(&g.id) else {
            return;
        };
        if k.incarnation != g.incarnation {
            return;
        }
        if fresher {
            k.info.able = g.able;
            if k.info.loop_hash == 0 && g.able {
                // Members work on one ground; who says able by way of a member of ours
                // is on it, until its own beacon tells otherwise.
                k.info.revision = teller.revision;
                k.info.loop_hash = teller.loop_hash;
            }
        }
        if let Some(ds) = g.suspected_ds
            && g.heartbeat >= k.heartbeat
            && k.status == Status::Alive
        {
            k.suspected = Some(Time(now.0.saturating_sub(u64::from(ds) * 100)));
            k.status = Status::Suspect;
            changes.push(Change { peer: g.id, incarnation: k.incarnation, status: Status::Suspect });
        } else if let (Some(ds), Some(since)) = (g.suspected_ds, k.suspected)
            && g.heartbeat >= k.heartbeat
        {
            k.suspected = Some(since.min(Time(now.0.saturating_sub(u64::from(ds) * 100))));
        }
    }

    /// A heartbeat made at `made` on our clock. Returns whether it is fresher than
    /// what was known.
    #[allow(clippy::too_many_arguments, reason = "one heartbeat, all of its parts")]
    fn heartbeat(
        &mut self,
        now: Time,
        id: u16,
        incarnation: Incarnation,
        heartbeat: u32,
        made: Time,
        hops: u8,
        changes: &mut Vec<Change>,
    ) -> bool {
        if id == self.me {
            return false;
        }
        let Some(k) = self.known.get_mut(&id) else {
            self.make_room();
            self.known.insert(
                id,
                Known {
                    incarnation,
                    heartbeat,
                    made,
                    suspected: None,
                    status: Status::Alive,
                    info: Info::default(),
                    hops: vec![(now, hops)],
                    eccentricity: 0,
                    eccentricity_heard: Time(0),
                },
            );
            changes.push(Change { peer: id, incarnation, status: Status::Alive });
            return true;
        };
        if (incarnation, heartbeat) <= (k.incarnation, k.heartbeat) {
            if (incarnation, heartbeat) == (k.incarnation, k.heartbeat) {
                // Every hop adds a little delay, so the oldest estimate is the truest;
                // taking the youngest would let gossip keep the dead alive.
                k.made = k.made.min(made);
                k.hops.push((now, hops));
            }
            return false;
        }
        let new_life = incarnation > k.incarnation;
        if new_life {
            k.info = Info::default();
        }
        k.incarnation = incarnation;
        k.heartbeat = heartbeat;
        k.made = made;
        k.suspected = None;
        k.hops.push((now, hops));
        if new_life || k.status != Status::Alive {
            k.status = Status::Alive;
            changes.push(Change { peer: id, incarnation, status: Status::Alive });
        }
        true
    }

    fn make_room(&mut self) {
        if self.known.len() >= MAX_KNOWN {
            let oldest = self.known.iter().min_by_key(|(id, k)| (k.status != Status::Down, k.made, **id));
            if let Some(id) = oldest.map(|(id, _)| *id) {
                self.known.remove(&id);
            }
        }
    }

    /// Looks at the time: raises suspicions and passes verdicts.
    pub fn tick(&mut self, now: Time) -> Vec<Change> {
        if let Some(expected) = self.expected_tick
            && now.since_ms(expected) > self.period_ms / 2
        {
            self.late_until = now.plus_ms(self.period_ms * 2);
        }
        self.expected_tick = Some(now.plus_ms(self.period_ms / 4));
        let (k1, k2, bound) = (self.k1_ms(now), self.k2_ms(now), self.bound_ms(now));
        let window = HOP_PERIODS * self.period_ms;
        let mut changes = Vec::new();
        for (id, k) in &mut self.known {
            k.hops.retain(|(t, _)| now.since_ms(*t) < window);
            if k.hops.len() > 64 {
                k.hops.drain(..32);
            }
            if k.status == Status::Down {
                continue;
            }
            let silent = now.since_ms(k.made);
            if silent >= k1 && k.suspected.is_none() {
                k.suspected = Some(now);
            }
            let condemned = k.suspected.is_some_and(|t| now.since_ms(t) >= k2);
            let status = if silent >= bound || condemned {
                Status::Down
            } else if k.suspected.is_some() {
                Status::Suspect
            } else {
                Status::Alive
            };
            if status != k.status {
                k.status = status;
                changes.push(Change { peer: *id, incarnation: k.incarnation, status });
            }
        }
        changes
    }

    /// What to say of others: at most `max` entries, rotating, so that nobody is left
    /// out for long. The relay fills in the versions of records.
    pub fn gossip(&mut self, now: Time, max: usize) -> Vec<Gossip> {
        let bound = self.bound_ms(now);
        let ids: Vec<u16> = self
            .known
            .range(self.next_gossip..)
            .chain(self.known.range(..self.next_gossip))
            .map(|(id, _)| *id)
            .take(max)
            .collect();
        if let Some(last) = ids.last() {
            self.next_gossip = last.saturating_add(1);
        }
        ids.iter().filter_map(|id| self.gossip_of(now, *id, bound)).collect()
    }

    fn gossip_of(&self, now: Time, id: u16, bound_ms: u64) -> Option<Gossip> {
        let k = self.known.get(&id)?;
        let age_ms = now.since_ms(k.made).min(bound_ms.saturating_mul(2));
        let ds = |ms: u64| u16::try_from(ms.div_ceil(100)).unwrap_or(u16::MAX);
        Some(Gossip {
            id,
            incarnation: k.incarnation,
            heartbeat: k.heartbeat,
            age_ds: ds(age_ms),
            hops: self.hops(id, now).unwrap_or(MAX_HOPS),
            suspected_ds: k.suspected.map(|t| ds(now.since_ms(t))),
            able: k.info.able,
            max_seq: 0,
            digest: 0,
        })
    }

    fn hops(&self, id: u16, now: Time) -> Option<u8> {
        let window = HOP_PERIODS * self.period_ms;
        let k = self.known.get(&id)?;
        k.hops.iter().filter(|(t, _)| now.since_ms(*t) < window).map(|(_, h)| *h).min()
    }

    /// Fewest hops to the farthest live author of the last 10 T.
    #[must_use]
    pub fn eccentricity(&self, now: Time) -> u8 {
        let live = self.known.iter().filter(|(_, k)| k.status != Status::Down);
        live.filter_map(|(id, _)| self.hops(*id, now)).max().unwrap_or(0)
    }

    /// The largest eccentricity heard from live peers, at least 1, at most 16.
    #[must_use]
    pub fn diameter(&self, now: Time) -> u32 {
        let window = HOP_PERIODS * self.period_ms;
        let heard = self
            .known
            .values()
            .filter(|k| k.status != Status::Down && now.since_ms(k.eccentricity_heard) < window)
            .map(|k| k.eccentricity)
            .max()
            .unwrap_or(0);
        u32::from(heard.max(self.eccentricity(now)).clamp(1, MAX_HOPS))
    }

    /// Everybody known: id, life, belief.
    pub fn all(&self) -> impl Iterator<Item = (u16, Incarnation, Status)> + '_ {
        self.known.iter().map(|(id, k)| (*id, k.incarnation, k.status))
    }

    /// Everybody not believed dead: id and life.
    pub fn live(&self) -> impl Iterator<Item = (u16, Incarnation)> + '_ {
        self.all().filter(|(_, _, s)| *s != Status::Down).map(|(id, i, _)| (id, i))
    }

    /// What a peer last said of itself.
    #[must_use]
    pub fn info(&self, id: u16) -> Option<Info> {
        self.known.get(&id).map(|k| k.info)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn beacon(heartbeat: u32, gossip: Vec<Gossip>) -> Beacon {
        Beacon {
            heartbeat,
            east_mm: 0,
            north_mm: 0,
            heading_e4: 0,
            able: true,
            ground: false,
            finished: false,
            nonce: 1,
            counter: 0,
            eccentricity: 1,
            revision: 1,
            loop_hash: 1,
            cover_digest: 0,
            gossip,
        }
    }

    #[test]
    fn silence_leads_to_suspicion_and_then_to_a_verdict() {
        let mut m = Membership::new(1, 1000);
        m.on_beacon(Time(0), 2, 1, &beacon(1, Vec::new()));
        let mut seen = Vec::new();
        for t in 0..80 {
            for c in m.tick(Time(t * 250)) {
                seen.push((t * 250, c.status));
            }
        }
        assert_eq!(seen, [(4250, Status::Suspect), (8750, Status::Down)]);
        assert!(8750 <= m.bound_ms(Time(20_000)));
    }

    #[test]
    fn an_old_heartbeat_does_not_raise_the_dead() {
        let mut m = Membership::new(1, 1000);
        m.on_beacon(Time(0), 2, 1, &beacon(5, Vec::new()));
        for t in 0..80 {
            m.tick(Time(t * 250));
        }
        assert_eq!(m.live().count(), 0);
        let old = Gossip {
            id: 2,
            incarnation: 1,
            heartbeat: 6,
            age_ds: 190,
            hops: 1,
            suspected_ds: None,
            able: true,
            max_seq: 0,
            digest: 0,
        };
        let changes = m.on_beacon(Time(20_000), 3, 1, &beacon(9, vec![old]));
        assert!(changes.iter().all(|c| c.peer == 3));
        let fresh = Gossip { age_ds: 5, ..old };
        let changes = m.on_beacon(Time(20_100), 3, 1, &beacon(10, vec![fresh]));
        assert!(changes.contains(&Change { peer: 2, incarnation: 1, status: Status::Alive }));
    }

    #[test]
    fn a_late_loop_doubts_itself() {
        let mut m = Membership::new(1, 1000);
        m.on_beacon(Time(0), 2, 1, &beacon(1, Vec::new()));
        m.tick(Time(0));
        assert!(m.tick(Time(9_000)).iter().all(|c| c.status != Status::Down));
    }
}
