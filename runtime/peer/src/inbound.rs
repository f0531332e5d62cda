//! What a peer does with the records it hears. Malformed bytes change nothing.

use crate::output::{Report, Status};
use crate::peer::Peer;
use crate::protocol::relay::Offer;
use crate::protocol::{life, membership};
use crate::wire::codec::{self, Body};
use crate::wire::kinds::Kind;
use crate::wire::message::{Beacon, Member, MissionChunk, Record};
use crate::{PeerId, cells::CellSet, cooperation, outbound};

/// One transmission, as received.
pub(crate) fn hear(peer: &mut Peer, transmitter: u16, hops: u8, bytes: &[u8]) {
    let record = match codec::decode_record(bytes) {
        Ok(record) => record,
        Err(why) => return refuse(peer, &why.to_string()),
    };
    let Some(kind) = Kind::of_number(record.kind) else {
        return refuse(peer, "a kind of a later version");
    };
    let body = match codec::decode_body(kind, &record.body) {
        Ok(body) => body,
        Err(why) => return refuse(peer, &why.to_string()),
    };
    if record.author == peer.config.id.0 {
        return hear_own(peer, &record, &body);
    }
    if let Body::Beacon(beacon) = &body {
        return hear_beacon(peer, &record, beacon);
    }
    if kind.relayed()
        && peer
            .relay
            .offer(peer.now, &record, bytes, transmitter, hops)
            != Offer::New
    {
        return;
    }
    deliver(peer, &record, body);
}

fn refuse(peer: &mut Peer, reason: &str) {
    peer.report(Report::Refused {
        reason: reason.to_owned(),
    });
}

/// Something under this peer's own name: an echo, an earlier life, or a double.
fn hear_own(peer: &mut Peer, record: &Record, body: &Body) {
    match body {
        Body::Beacon(b)
            if record.incarnation == peer.life.incarnation && b.nonce != peer.life.nonce =>
        {
            peer.alarm("another peer speaks under this id");
            if b.nonce > peer.life.nonce {
                peer.outbound.silenced = true;
            }
        }
        Body::Beacon(b) => life::heard_of_myself(peer, record.incarnation, b.heartbeat),
        _ => life::heard_of_myself(peer, record.incarnation, 0),
    }
}

fn hear_beacon(peer: &mut Peer, record: &Record, beacon: &Beacon) {
    let now = peer.now;
    let changes = peer
        .membership
        .on_beacon(now, record.author, record.incarnation, beacon);
    on_changes(peer, changes);
    for g in &beacon.gossip {
        if g.id == peer.config.id.0 {
            life::heard_of_myself(peer, g.incarnation, g.heartbeat);
            if g.incarnation != peer.life.incarnation {
                continue;
            }
            if g.suspected_ds.is_some() {
                outbound::refute(peer);
            } else {
                outbound::believed(peer);
            }
        }
    }
    peer.relay.on_beacon(now, record.author, beacon);
    if let Some(mission_state) = &mut peer.mission_state {
        mission_state
            .negotiation
            .rounds
            .hear_counter(beacon.counter);
        if beacon.loop_hash == mission_state.loop_hash()
            && beacon.cover_digest != mission_state.covered().digest()
        {
            peer.outbound.cover_wanted = true;
        } else if beacon.revision == mission_state.revision()
            && beacon.loop_hash != mission_state.loop_hash()
            && beacon.loop_hash != 0
            && !core::mem::replace(&mut peer.outbound.mismatch_said, true)
        {
            peer.alarm(&format!(
                "uav{} derived another loop from the same mission",
                record.author
            ));
        }
    }
}

/// Reports what changed in the beliefs about others.
pub(crate) fn on_changes(peer: &mut Peer, changes: Vec<membership::Change>) {
    for c in changes {
        let (id, incarnation, status) = (PeerId(c.peer), c.incarnation, c.status);
        if status == Status::Down {
            tracing::info!(
                peer = peer.config.id.0,
                at_ms = peer.now.0,
                down = c.peer,
                "believed down"
            );
        }
        peer.report(Report::Membership {
            peer: id,
            incarnation,
            status,
        });
    }
}

/// A record that is new here.
fn deliver(peer: &mut Peer, record: &Record, body: Body) {
    let author = Member {
        id: record.author,
        incarnation: record.incarnation,
    };
    match body {
        Body::Claim(claim) => {
            if let Some(mission_state) = &mut peer.mission_state
                && claim.loop_hash == mission_state.loop_hash()
                && mission_state.negotiation.sections.hear(
                    author.id,
                    author.incarnation,
                    record.seq,
                    claim,
                )
            {
                cooperation::tick(peer);
            }
        }
        Body::Bid(bid) => {
            let now = peer.now;
            if let Some(mission_state) = &mut peer.mission_state {
                let n = mission_state.covered().capacity();
                if bid.round.loop_hash == mission_state.loop_hash() {
                    if let Ok(covered) = CellSet::decode_rle(n, &bid.covered) {
                        mission_state.negotiation.sections.cover(&covered);
                    }
                    mission_state.negotiation.hear_bid(now, author, &bid);
                    cooperation::tick(peer);
                } else {
                    mission_state
                        .negotiation
                        .rounds
                        .hear_counter(bid.round.counter);
                }
            }
        }
        Body::Cover(cover) => {
            if let Some(mission_state) = &mut peer.mission_state
                && cover.loop_hash == mission_state.loop_hash()
                && let Ok(covered) =
                    CellSet::decode_rle(mission_state.covered().capacity(), &cover.covered)
                && mission_state.negotiation.sections.cover(&covered)
            {
                peer.outbound.cover_changed = true;
            }
        }
        Body::Mission(chunk) => hear_mission(peer, record, &chunk),
        Body::Operator(order) => {
            let version = (record.incarnation, record.seq, record.author);
            if version > peer.order.version {
                peer.order = crate::peer::StandingOrder { order, version };
            }
        }
        Body::Beacon(_) | Body::State(_) | Body::Finished(_) | Body::Event(_) => {}
    }
}

fn hear_mission(peer: &mut Peer, record: &Record, chunk: &MissionChunk) {
    match peer.library.chunk(record.subject, chunk) {
        Ok(true) => cooperation::consider_mission(peer),
        Ok(false) => {}
        Err(why) => peer.alarm(&why),
    }
}

/// After the common ground changed, what was heard before it is looked at again.
pub(crate) fn hear_again(peer: &mut Peer) {
    for record in peer.relay.records() {
        let Some(kind) = Kind::of_number(record.kind) else {
            continue;
        };
        if matches!(kind, Kind::Claim | Kind::Bid)
            && record.author != peer.config.id.0
            && let Ok(body) = codec::decode_body(kind, &record.body)
        {
            deliver(peer, &record, body);
        }
    }
    outbound::speak_claim(peer);
}
