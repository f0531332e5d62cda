//! What a peer says, and when.
//!
//! | record | when |
//! |---|---|
//! | beacon | every T, ±10 %; at once when this peer hears that it is suspected |
//! | claim | at once when a section was adopted or taken, within T when it shrank by a rule; every 10 T for its ETA |
//! | cover | own or heard coverage is news, at most every 2 T |
//! | state | every 10 T |
//! | round | a bid, once it is durable |
//! | finished | once a mission revision |

use crate::config::Role;
use crate::input::Time;
use crate::mission::mm;
use crate::output::{Output, Priority, Report};
use crate::peer::Peer;
use crate::wire::codec::{self, Body};
use crate::wire::key;
use crate::wire::kinds::Kind;
use crate::wire::limits::COVER_UNION_MAX_BYTES;
use crate::wire::message::{
    Beacon, Behaviour, Cover, Finished, MissionStatus, Order, Record, Snapshot, State,
};
use rand_core::Rng;

/// A claim is spoken again after this many beacon periods, for its ETA.
pub const CLAIM_PERIODS: u64 = 10;

/// Coverage is spoken at most every so many beacon periods: a cell takes three to
/// four seconds to fly, so more would repeat what is known.
pub const COVER_PERIODS: u64 = 2;

/// State is for people: they read no faster.
pub const STATE_PERIODS: u64 = 10;

/// Most peers one beacon gossips about.
pub const MAX_GOSSIP: usize = 20;

/// What is due to be said.
#[derive(Clone, Debug, Default)]
pub(crate) struct Voice {
    pub heartbeat: u32,
    pub seq: u32,
    pub next_beacon: Time,
    /// When the next beacon with all its gossip is due.
    next_full: Time,
    /// Until when this peer answers a suspicion.
    suspected_until: Time,
    last_beacon: Time,
    pub claim_changed: bool,
    pub cover_changed: bool,
    pub cover_wanted: bool,
    pub finished_due: bool,
    pub silenced: bool,
    pub mismatch_said: bool,
    last_claim: Time,
    last_cover: Time,
    last_state: Time,
    mission_said: Option<u64>,
}

pub(crate) fn new_life(peer: &mut Peer) {
    peer.voice.seq = 0;
    peer.voice.heartbeat = 0;
    peer.voice.mission_said = None;
    peer.voice.claim_changed = true;
    peer.voice.cover_changed = true;
}

pub(crate) fn first_beacon(peer: &mut Peer) {
    peer.voice.next_beacon = peer.boot.listens_until;
    peer.voice.next_full = peer.boot.listens_until;
}

fn may_speak(peer: &Peer) -> bool {
    peer.boot.speaks(peer.now) && !peer.voice.silenced
}

/// Sends what the relay lets go.
pub(crate) fn send(peer: &mut Peer) {
    if !may_speak(peer) {
        return;
    }
    while let Some(out) = peer.relay.poll(peer.now) {
        peer.outputs.push_back(Output::Publish {
            key: out.key,
            bytes: out.bytes,
            hops: out.hops,
            priority: out.priority,
            lifetime_ms: out.lifetime_ms,
        });
    }
}

/// Says whatever is due.
pub(crate) fn look(peer: &mut Peer) {
    if !may_speak(peer) {
        return;
    }
    let (now, t) = (peer.now, peer.period_ms());
    if peer.config.role == Role::Ground {
        speak_mission(peer);
    }
    let due = |last: Time, periods: u64| now.since_ms(last) >= periods * t;
    if peer.crew.is_none() {
        return;
    }
    if peer.config.role == Role::Uav
        && ((peer.voice.claim_changed && due(peer.voice.last_claim, 1))
            || due(peer.voice.last_claim, CLAIM_PERIODS))
    {
        speak_claim(peer);
    }
    if (peer.voice.cover_changed && due(peer.voice.last_cover, COVER_PERIODS))
        || (peer.voice.cover_wanted && due(peer.voice.last_cover, 1))
    {
        speak_cover(peer);
    }
    if due(peer.voice.last_state, STATE_PERIODS) {
        speak_state(peer);
    }
    if core::mem::take(&mut peer.voice.finished_due)
        && let Some(crew) = &peer.crew
    {
        let revision = crew.revision();
        speak(
            peer,
            Kind::Finished,
            0,
            &Body::Finished(Finished { revision }),
        );
    }
}

/// Writes a record of this peer's own and hands it to the relay.
fn speak(peer: &mut Peer, kind: Kind, subject: u16, body: &Body) {
    if !may_speak(peer) {
        return;
    }
    peer.voice.seq = peer.voice.seq.saturating_add(1);
    let record = Record {
        author: peer.config.id.0,
        incarnation: peer.boot.incarnation,
        seq: peer.voice.seq,
        kind: kind.number(),
        subject,
        body: codec::encode_body(body),
        signature: Vec::new(),
    };
    let bytes = codec::encode_record(&record);
    peer.relay.own(peer.now, &record, bytes);
}

/// The own section, as a claim.
pub(crate) fn speak_claim(peer: &mut Peer) {
    let Some(crew) = &peer.crew else {
        return;
    };
    if peer.config.role != Role::Uav || !may_speak(peer) {
        return;
    }
    let register = crew.register();
    let section = &crew.negotiation.section;
    let take = section
        .plan()
        .iter()
        .map(|p| p.stamp.take)
        .max()
        .unwrap_or(0);
    let report = Report::Register {
        counter: register.epoch.counter,
        epoch: register.epoch.hash,
        take,
        legs: crate::cooperation::legs_of(section.plan(), section.cells()),
        held: section.held().keys().copied().collect(),
        eta_ms: register.eta_ms,
    };
    peer.voice.claim_changed = false;
    peer.voice.last_claim = jittered(peer);
    speak(peer, Kind::Claim, 0, &Body::Claim(register));
    peer.report(report);
}

/// Now, and up to a quarter of a period: what recurs must not recur in step with
/// others, or it collides for ever.
fn jittered(peer: &mut Peer) -> Time {
    let spread = peer.period_ms() / 4 + 1;
    peer.now.plus_ms(u64::from(peer.rng.next_u32()) % spread)
}

fn speak_cover(peer: &mut Peer) {
    let Some(crew) = &peer.crew else {
        return;
    };
    let cover = Cover {
        revision: crew.revision(),
        loop_hash: crew.loop_hash(),
        union: crew.union().encode_rle(Some(COVER_UNION_MAX_BYTES)),
    };
    peer.voice.cover_changed = false;
    peer.voice.cover_wanted = false;
    peer.voice.last_cover = jittered(peer);
    speak(peer, Kind::Cover, 0, &Body::Cover(cover));
}

fn speak_state(peer: &mut Peer) {
    let ground = peer.config.role == Role::Ground;
    let (behaviour, mission, covered, cells) =
        peer.crew
            .as_ref()
            .map_or((Behaviour::Waiting, MissionStatus::None, 0, 0), |c| {
                (
                    c.behaviour(),
                    c.status(),
                    c.union().count(),
                    c.union().len(),
                )
            });
    let p = peer.percept;
    peer.voice.last_state = jittered(peer);
    let state = State {
        east_mm: p.map_or(0, |p| mm(p.pose.east_m)),
        north_mm: p.map_or(0, |p| mm(p.pose.north_m)),
        height_mm: p.map_or(0, |p| mm(p.height_m)),
        heading_e4: p.map_or(0, |p| e4(p.pose.heading_rad)),
        airspeed_mmps: p.map_or(0, |p| mm(p.airspeed_mps).unsigned_abs()),
        endurance_s: p.map_or(0, |p| mm(p.endurance_s / 1000.0).unsigned_abs()),
        behaviour: if ground { Behaviour::Ground } else { behaviour },
        mission,
        covered,
        cells,
    };
    speak(peer, Kind::State, 0, &Body::State(state));
}

/// A bid that is durable.
pub(crate) fn speak_bid(peer: &mut Peer, snapshot: &Snapshot) {
    speak(peer, Kind::Round, 0, &Body::Round(snapshot.clone()));
}

/// The operator's standing order.
pub(crate) fn speak_order(peer: &mut Peer, order: Order) {
    speak(peer, Kind::Operator, 0, &Body::Operator(order));
    peer.order = crate::peer::Ordered {
        order,
        version: (peer.boot.incarnation, peer.voice.seq, peer.config.id.0),
    };
}

/// The mission's body in pieces, once a revision and life.
pub(crate) fn speak_mission(peer: &mut Peer) {
    let Some(mission) = peer.library.newest() else {
        return;
    };
    let hash = mission.content_hash();
    if !may_speak(peer) || peer.voice.mission_said == Some(hash) {
        return;
    }
    peer.voice.mission_said = Some(hash);
    for (i, chunk) in crate::mission::chunks(&mission).into_iter().enumerate() {
        let subject = u16::try_from(i).unwrap_or(u16::MAX);
        speak(peer, Kind::Mission, subject, &Body::Mission(chunk));
    }
}

#[allow(clippy::cast_possible_truncation, reason = "a heading is at most 2 pi")]
fn e4(rad: f64) -> i32 {
    (rad * 10_000.0).round() as i32
}

/// Somebody suspects this peer: it says that it lives, four times a period, until it is
/// believed or the verdict is passed. The suspicion tells that its beacons collide, so
/// these carry no gossip: what is short collides rarely.
pub(crate) fn refute(peer: &mut Peer) {
    let t = peer.period_ms();
    peer.voice.suspected_until = peer.now.plus_ms(peer.membership.k2_ms(peer.now));
    let spread = u64::from(peer.rng.next_u32()) % (t / 8 + 1);
    let soonest = peer.voice.last_beacon.plus_ms(t / 4);
    let at = peer.now.plus_ms(spread).max(soonest);
    peer.voice.next_beacon = peer.voice.next_beacon.min(at);
}

/// A neighbour believes again that this peer lives.
pub(crate) fn believed(peer: &mut Peer) {
    if peer.now < peer.voice.suspected_until {
        peer.voice.suspected_until = peer.now;
        peer.voice.next_beacon = peer.voice.next_full;
    }
}

/// "I am here", with gossip.
pub(crate) fn beacon(peer: &mut Peer) {
    let t = peer.period_ms();
    let bare = peer.now < peer.voice.next_full;
    let jitter = u64::from(peer.rng.next_u32()) % (t / 5 + 1);
    if !bare {
        peer.voice.next_full = peer.now.plus_ms(t - t / 10 + jitter);
    }
    peer.voice.next_beacon = peer.voice.next_full;
    if peer.now < peer.voice.suspected_until {
        let again = peer.now.plus_ms(t / 4 + jitter / 2);
        peer.voice.next_beacon = peer.voice.next_beacon.min(again);
    }
    if !may_speak(peer) {
        return;
    }
    peer.voice.heartbeat = peer.voice.heartbeat.saturating_add(1);
    peer.voice.last_beacon = peer.now;
    let most = if bare { 0 } else { MAX_GOSSIP };
    let mut gossip = peer.membership.gossip(peer.now, most);
    for g in &mut gossip {
        (g.max_seq, g.digest) = peer.relay.version(g.id, g.incarnation);
    }
    let pose = peer.percept.map(|p| p.pose);
    let crew = peer.crew.as_ref();
    let beacon = Beacon {
        heartbeat: peer.voice.heartbeat,
        east_mm: pose.map_or(0, |p| mm(p.east_m)),
        north_mm: pose.map_or(0, |p| mm(p.north_m)),
        heading_e4: pose.map_or(0, |p| e4(p.heading_rad)),
        able: crew.is_some_and(crate::cooperation::Crew::able),
        ground: peer.config.role == Role::Ground,
        finished: crew.is_some_and(crate::cooperation::Crew::finished),
        nonce: peer.boot.nonce,
        counter: crew.map_or(0, |c| c.negotiation.rounds.counter()),
        eccentricity: peer.membership.eccentricity(peer.now),
        revision: crew.map_or(0, crate::cooperation::Crew::revision),
        loop_hash: crew.map_or(0, crate::cooperation::Crew::loop_hash),
        cover_digest: crew.map_or(0, |c| c.union().digest()),
        gossip,
    };
    let record = Record {
        author: peer.config.id.0,
        incarnation: peer.boot.incarnation,
        seq: peer.voice.heartbeat,
        kind: Kind::Beacon.number(),
        subject: 0,
        body: codec::encode_body(&Body::Beacon(beacon)),
        signature: Vec::new(),
    };
    let bytes = codec::encode_record(&record);
    peer.relay.charge(peer.now, bytes.len());
    peer.outputs.push_back(Output::Publish {
        key: key::key(&peer.config.fleet, Kind::Beacon, 0, record.author),
        bytes,
        hops: 0,
        priority: Priority::Beacon,
        lifetime_ms: peer.config.beacon_period_ms,
    });
}
