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

use crate::Input;
use crate::input::{Command, NewTask, TaskEdit};
use crate::mission::{Mission, mm};
use crate::testing::{GROUND_STATION, Harness};
use crate::wire::codec::{self, Body};
use crate::wire::message::{Beacon, Record};
use crate::wire::samples;
use crate::wire::tasks::TaskKind;

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

/// A place that is to be seen, from within ten metres.
fn point(name: &str, east_m: f64, north_m: f64) -> NewTask {
    NewTask {
        name: Some(name.to_owned()),
        kind: TaskKind::Pinpoint,
        places: vec![(mm(east_m), mm(north_m))],
        radius_mm: 10_000,
        worth: 100,
        within_ms: None,
        sensor: 0,
    }
}

/// The operator says something of tasks.
fn edit(h: &mut Harness, edit: TaskEdit) {
    h.feed(GROUND_STATION, Input::Command(Command::Task(edit)));
}

/// The operator asks for a task.
fn add(h: &mut Harness, task: NewTask) {
    edit(h, TaskEdit::Add(task));
}
