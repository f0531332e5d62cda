//! What a peer does, each behaviour in a few lines: peers in virtual time, without a world.

mod aircraft;
mod crowds;
mod diagrams;
mod fuel;
mod hostile;
mod life;
mod missions;
mod obstacles;
mod orders;
mod relays;
mod stores;
mod swarm;
mod tasks;
mod twins;
mod zones;

use crate::mission::Mission;
use crate::testing::{GROUND_STATION, Harness};
use crate::wire::codec::{self, Body};
use crate::wire::message::{Beacon, Record};
use crate::wire::samples;

/// The bytes of a record.
fn record(author: u16, incarnation: u32, seq: u32, subject: u16, body: &Body) -> Vec<u8> {
    codec::encode_record(&Record {
        author,
        incarnation,
        seq,
        kind: body.kind().number(),
        subject,
        body: codec::encode_body(body),
        signature: Vec::new(),
    })
}

/// A beacon that says nothing but that somebody is there.
fn beacon(heartbeat: u32, nonce: u32) -> Beacon {
    Beacon {
        able: false,
        nonce,
        revision: 0,
        loop_hash: 0,
        ..samples::beacon(heartbeat)
    }
}

/// So many UAVs that begin a mission, and a ground station that holds it, too.
fn with_operator(n: u16, mission: Mission) -> Harness {
    let mut h = Harness::started(n, mission.clone());
    h.add_ground_station(Some(mission));
    h.start(GROUND_STATION);
    h
}

/// Cells that a peer knows to be covered.
fn covered(h: &Harness, id: u16) -> usize {
    usize::from(h.beliefs(id).covered.count())
}
