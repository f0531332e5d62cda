//! Who is there to share the work of a mission: the peers whose claims count, of them those
//! that can plan, and who is on the roster and was not heard of yet. It is looked up again
//! only where it may have changed.

use crate::Incarnation;
use crate::config::{Launch, PeerConfig};
use crate::cooperation::Situation;
use crate::input::Time;
use crate::journal::Durable;
use crate::protocol::negotiation::are_many;
use crate::protocol::sections::{FIRST_LIFE, LivePeers};
use crate::wire::limits::MEMBERS_MAX;
use crate::wire::message::Member;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Who is there, and what this was computed from.
#[derive(Clone, Debug, Default)]
pub(crate) struct Present {
    /// The others whose claims count.
    pub live: LivePeers,
    /// Of them those that can plan on this loop, this peer included if it can.
    pub members: Vec<Member>,
    /// How many of them were never heard of.
    pub unheard: usize,
    /// Since when this peer knows by their own word that others of them work on another loop.
    pub elsewhere: BTreeMap<u16, Time>,
    /// As it was numbered by the membership, for this peer, able or not; none where it is to
    /// be looked up again.
    of: Option<(u64, Member, bool)>,
    /// The lives in which peers said that they are alone.
    alone: BTreeMap<u16, Incarnation>,
    /// When somebody is not expected any more.
    until: Time,
}

/// Who shares the work of one mission.
#[derive(Debug)]
pub(crate) struct Company {
    present: Arc<Present>,
    /// The roster: who begins where.
    launches: Arc<[Launch]>,
    /// Who of it was not heard of yet, and until when it is taken to be there.
    expected: BTreeMap<u16, Time>,
}

impl Company {
    /// Nobody but whom the roster names, where it says how things are: of a large fleet, at its
    /// first mission and in the first life.
    pub fn begun(first_mission: bool, me: Member, config: &PeerConfig, durable: &Durable) -> Self {
        let first = first_mission && me.incarnation.max(durable.incarnation) <= FIRST_LIFE;
        let is_told = first && are_many(config.launches.len());
        let launches = if is_told && config.launches.iter().any(|l| l.id == me.id) {
            Arc::clone(&config.launches)
        } else {
            Arc::from([])
        };
        let others = launches.iter().map(|l| l.id).filter(|id| *id != me.id);
        Self {
            present: Arc::default(),
            expected: others.map(|id| (id, Time(u64::MAX))).collect(),
            launches,
        }
    }

    /// Who was there when it was last looked up.
    pub fn present(&self) -> Arc<Present> {
        Arc::clone(&self.present)
    }

    /// The roster; empty where there is none.
    pub fn launches(&self) -> &[Launch] {
        &self.launches
    }

    /// The roster says nothing any more.
    pub fn forget_launches(&mut self) {
        self.launches = Arc::from([]);
        self.expected.clear();
    }

    /// Until when those are taken to be there who were not heard of yet.
    pub fn expect(&mut self, expected: BTreeMap<u16, Time>) {
        self.expected = expected;
        Arc::make_mut(&mut self.present).of = None;
    }

    /// How many times eight peers are heard of and live, at least one.
    pub fn eights(&self) -> u64 {
        let heard_of = self.present.live.len().saturating_sub(self.expected.len());
        (heard_of / MEMBERS_MAX).max(1) as u64
    }

    /// Looks up who is there, where that may have changed: for this peer, able or not, on its
    /// loop, when some said that they are `alone`. Returns whether others are live than
    /// before, or may be.
    pub fn gather(
        &mut self,
        s: &Situation<'_>,
        able: bool,
        loop_hash: u64,
        alone: &BTreeMap<u16, Incarnation>,
    ) -> bool {
        let of = Some((s.membership.changes(), s.me, able));
        let present = &self.present;
        if present.of == of && present.alone == *alone && s.now < present.until {
            return false;
        }
        // Whose claim says that it holds all others for down hears no round and yields to
        // nobody, so it counts as if it were out of reach both ways: each side plans as if
        // the other were dead.
        let live = s.membership.live();
        let mut live: LivePeers = live
            .filter(|(id, life)| alone.get(id) != Some(life))
            .collect();
        let members = members(s, &live, able, loop_hash);
        let unheard = self.add_expected(s, &mut live);
        let until = self.expected.values().min().copied();
        let elsewhere = elsewhere(s, &live, loop_hash, &self.present.elsewhere);
        let is_changed = self.present.of.is_none() || live != self.present.live;
        self.present = Arc::new(Present {
            live,
            members,
            unheard,
            elsewhere,
            of,
            alone: alone.clone(),
            until: until.unwrap_or(Time(u64::MAX)),
        });
        is_changed
    }

    /// Who was to be launched and was not heard of yet is taken to be there until its section
    /// would be flown. Returns how many that are.
    fn add_expected(&mut self, s: &Situation<'_>, live: &mut LivePeers) -> usize {
        let unheard = |id: u16| s.membership.status(id).is_none();
        self.expected
            .retain(|id, until| s.now < *until && unheard(*id));
        live.extend(self.expected.keys().map(|id| (*id, FIRST_LIFE)));
        self.expected.len()
    }
}

/// Which live UAVs say that they work on another loop than this one, and since when that is known.
fn elsewhere(
    s: &Situation<'_>,
    live: &LivePeers,
    loop_hash: u64,
    before: &BTreeMap<u16, Time>,
) -> BTreeMap<u16, Time> {
    let is_elsewhere = |id: &u16| {
        let info = s
            .membership
            .info(*id)
            .filter(|i| i.is_own_word && !i.ground_station);
        info.is_some_and(|i| i.loop_hash != 0 && i.loop_hash != loop_hash)
    };
    let there = live.keys().copied().filter(is_elsewhere);
    there
        .map(|id| (id, before.get(&id).copied().unwrap_or(s.now)))
        .collect()
}

/// Live UAVs on this loop whose beacon says able, this peer included if it is; ascending.
fn members(s: &Situation<'_>, live: &LivePeers, able: bool, loop_hash: u64) -> Vec<Member> {
    let on_this_loop = |id: u16| {
        let info = s.membership.info(id);
        info.is_some_and(|i| i.able && !i.ground_station && i.loop_hash == loop_hash)
    };
    let others = live.iter().filter(|(id, _)| on_this_loop(**id));
    let others = others.map(|(id, incarnation)| Member {
        id: *id,
        incarnation: *incarnation,
    });
    let mut members: Vec<Member> = others.chain(able.then_some(s.me)).collect();
    members.sort_unstable();
    members
}
