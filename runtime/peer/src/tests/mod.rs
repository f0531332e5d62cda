//! What a peer does, each behaviour in a few lines: peers in virtual time, without a world.

mod fuel;
mod hostile;
mod life;
mod missions;
mod orders;
mod stores;
mod swarm;

use crate::testing::Harness;
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

/// Cells that a peer knows to be covered.
fn covered(h: &Harness, id: u16) -> usize {
    h.beliefs(id).covered.iter().filter(|c| **c).count()
}
