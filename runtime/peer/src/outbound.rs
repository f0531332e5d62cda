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
use crate::wire::limits::COVERED_MAX_BYTES;
use crate::wire::message::{
    Beacon, Behaviour, Bid, Cover, Finished, MissionStatus, Order, Record, State,
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
pub(crate) struct Outbound {
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
    peer.outbound.seq = 0;
    peer.outbound.heartbeat = 0;
    peer.outbound.mission_said = None;
    peer.outbound.claim_changed = true;
    peer.outbound.cover_changed = true;
}

pub(crate) fn first_beacon(peer: &mut Peer) {
    peer.outbound.next_beacon = peer.life.listens_until;
    peer.outbound.next_full = peer.life.listens_until;
}

fn may_speak(peer: &Peer) -> bool {
    peer.life.speaks(peer.now) && !peer.outbound.silenced
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
pub(crate) fn tick(peer: &mut Peer) {
    if !may_speak(peer) {
        return;
    }
    let (now, t) = (peer.now, peer.period_ms());
    if peer.config.role == Role::GroundStation {
        speak_mission(peer);
    }
    let due = |last: Time, periods: u64| now.since_ms(last) >= periods * t;
    if peer.mission_state.is_none() {
        return;
    }
    if peer.config.role == Role::Uav
        && ((peer.outbound.claim_changed && due(peer.outbound.last_claim, 1))
            || due(peer.outbound.last_claim, CLAIM_PERIODS))
    {
        speak_claim(peer);
    }
    if (peer.outbound.cover_changed && due(peer.outbound.last_cover, COVER_PERIODS))
        || (peer.outbound.cover_wanted && due(peer.outbound.last_cover, 1))
    {
        speak_cover(peer);
    }
    if due(peer.outbound.last_state, STATE_PERIODS) {
        speak_state(peer);
    }
    if core::mem::take(&mut peer.outbound.finished_due)
        && let Some(mission_state) = &peer.mission_state
    {
        let revision = mission_state.revision();
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
    peer.outbound.seq = peer.outbound.seq.saturating_add(1);
    let record = Record {
        author: peer.config.id.0,
        incarnation: peer.life.incarnation,
        seq: peer.outbound.seq,
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
    let Some(mission_state) = &peer.mission_state else {
        return;
    };
    if peer.config.role != Role::Uav || !may_speak(peer) {
        return;
    }
    let claim = mission_state.claim();
    let sections = &mission_state.negotiation.sections;
    let take = sections
        .plan()
        .iter()
        .map(|p| p.stamp.take)
        .max()
        .unwrap_or(0);
    let report = Report::Claim {
        counter: claim.epoch.counter,
        epoch: claim.epoch.hash,
        take,
        legs: crate::cooperation::legs_of(sections.plan(), sections.cells()),
        held: sections.held().keys().copied().collect(),
        eta_ms: claim.eta_ms,
    };
    peer.outbound.claim_changed = false;
    peer.outbound.last_claim = jittered(peer);
    speak(peer, Kind::Claim, 0, &Body::Claim(claim));
    peer.report(report);
}

/// Now, and up to a quarter of a period: what recurs must not recur in step with
/// others, or it collides for ever.
fn jittered(peer: &mut Peer) -> Time {
    let spread = peer.period_ms() / 4 + 1;
    peer.now.plus_ms(u64::from(peer.rng.next_u32()) % spread)
}

fn speak_cover(peer: &mut Peer) {
    let Some(mission_state) = &peer.mission_state else {
        return;
    };
    let cover = Cover {
        revision: mission_state.revision(),
        loop_hash: mission_state.loop_hash(),
        covered: mission_state.covered().encode_rle(Some(COVERED_MAX_BYTES)),
    };
    peer.outbound.cover_changed = false;
    peer.outbound.cover_wanted = false;
    peer.outbound.last_cover = jittered(peer);
    speak(peer, Kind::Cover, 0, &Body::Cover(cover));
}

fn speak_state(peer: &mut Peer) {
    let ground = peer.config.role == Role::GroundStation;
    let (behaviour, mission, covered, cells) =
        peer.mission_state
            .as_ref()
            .map_or((Behaviour::Waiting, MissionStatus::None, 0, 0), |c| {
                (
                    c.behaviour(),
                    c.status(),
                    c.covered().count(),
                    c.covered().capacity(),
                )
            });
    let p = peer.percept;
    peer.outbound.last_state = jittered(peer);
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
pub(crate) fn speak_bid(peer: &mut Peer, bid: &Bid) {
    speak(peer, Kind::Bid, 0, &Body::Bid(bid.clone()));
}

/// The operator's standing order.
pub(crate) fn speak_order(peer: &mut Peer, order: Order) {
    speak(peer, Kind::Operator, 0, &Body::Operator(order));
    peer.order = crate::peer::StandingOrder {
        order,
        version: (peer.life.incarnation, peer.outbound.seq, peer.config.id.0),
    };
}

/// The mission's body in pieces, once a revision and life.
pub(crate) fn speak_mission(peer: &mut Peer) {
    let Some(mission) = peer.library.newest() else {
        return;
    };
    let hash = mission.content_hash();
    if !may_speak(peer) || peer.outbound.mission_said == Some(hash) {
        return;
    }
    peer.outbound.mission_said = Some(hash);
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
    peer.outbound.suspected_until = peer.now.plus_ms(peer.membership.k2_ms(peer.now));
    let spread = u64::from(peer.rng.next_u32()) % (t / 8 + 1);
    let soonest = peer.outbound.last_beacon.plus_ms(t / 4);
    let at = peer.now.plus_ms(spread).max(soonest);
    peer.outbound.next_beacon = peer.outbound.next_beacon.min(at);
}

/// A neighbour believes again that this peer lives.
pub(crate) fn believed(peer: &mut Peer) {
    if peer.now < peer.outbound.suspected_until {
        peer.outbound.suspected_until = peer.now;
        peer.outbound.next_beacon = peer.outbound.next_full;
    }
}

/// "I am here", with gossip.
pub(crate) fn beacon(peer: &mut Peer) {
    let t = peer.period_ms();
    let bare = peer.now < peer.outbound.next_full;
    let jitter = u64::from(peer.rng.next_u32()) % (t / 5 + 1);
    if !bare {
        peer.outbound.next_full = peer.now.plus_ms(t - t / 10 + jitter);
    }
    peer.outbound.next_beacon = peer.outbound.next_full;
    if peer.now < peer.outbound.suspected_until {
        let again = peer.now.plus_ms(t / 4 + jitter / 2);
        peer.outbound.next_beacon = peer.outbound.next_beacon.min(again);
    }
    if !may_speak(peer) {
        return;
    }
    peer.outbound.heartbeat = peer.outbound.heartbeat.saturating_add(1);
    peer.outbound.last_beacon = peer.now;
    let most = if bare { 0 } else { MAX_GOSSIP };
    let mut gossip = peer.membership.gossip(peer.now, most);
    for g in &mut gossip {
        (g.max_seq, g.digest) = peer.relay.version(g.id, g.incarnation);
    }
    let pose = peer.percept.map(|p| p.pose);
    let mission_state = peer.mission_state.as_ref();
    let beacon = Beacon {
        heartbeat: peer.outbound.heartbeat,
        east_mm: pose.map_or(0, |p| mm(p.east_m)),
        north_mm: pose.map_or(0, |p| mm(p.north_m)),
        heading_e4: pose.map_or(0, |p| e4(p.heading_rad)),
        able: mission_state.is_some_and(crate::mission_state::MissionState::able),
        ground_station: peer.config.role == Role::GroundStation,
        finished: mission_state.is_some_and(crate::mission_state::MissionState::finished),
        nonce: peer.life.nonce,
        counter: mission_state.map_or(0, |c| c.negotiation.rounds.counter()),
        eccentricity: peer.membership.eccentricity(peer.now),
        revision: mission_state.map_or(0, crate::mission_state::MissionState::revision),
        loop_hash: mission_state.map_or(0, crate::mission_state::MissionState::loop_hash),
        cover_digest: mission_state.map_or(0, |c| c.covered().digest()),
        gossip,
    };
    let record = Record {
        author: peer.config.id.0,
        incarnation: peer.life.incarnation,
        seq: peer.outbound.heartbeat,
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
