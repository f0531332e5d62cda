//! The model in few bytes: what a page draws of a run. A frame of a hundred UAVs takes a
//! quarter of what it takes in the model's own words, and a page keeps thousands of them.
//!
//! Each word is a JSON object with its kind as `k`: `hello`, `scene`, `frame`, `event`, `round`,
//! `task`, `failure_free`, `end`. A round or a task is told anew, as it is by then, whenever it
//! changes.
//! Times are milliseconds of scenario time, places metres east and north of the origin.

use serde::Serialize;
use serde_json::{Map, Value, json};
use skein_recording::model::frame::UavState;
use skein_recording::model::{End, Event, FailureFree, Frame, Knowledge, Record, Ring, Scene};
use skein_view::history::Changed;

/// What is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// A simulated run: it is there at once, and played.
    Sim,
    /// A trial of this process.
    Trial,
    /// A swarm that another process flies.
    Watch,
    /// A recording.
    Replay,
}

/// What a page is told first.
#[derive(Clone, Debug, Serialize)]
pub struct Hello {
    /// What is shown.
    pub mode: Mode,
    /// Who knows what frames say.
    pub knowledge: Knowledge,
    /// What it is, for a person.
    pub title: String,
    /// The command that shows it again.
    pub command: String,
}

/// The first word.
pub(crate) fn hello(hello: &Hello) -> String {
    let mut word = serde_json::to_value(hello).unwrap_or_default();
    if let Some(fields) = word.as_object_mut() {
        fields.insert("k".to_owned(), json!("hello"));
    }
    word.to_string()
}

/// A word of the model; whether it may be left out where room is short.
pub(crate) fn of(record: &Record) -> (String, bool) {
    match record {
        Record::Scene(said) => (scene(said).to_string(), false),
        Record::Frame(said) => (frame(said).to_string(), true),
        Record::Event(said) => (event(said), false),
        Record::FailureFree(said) => (failure_free(said), false),
        Record::End(said) => (end(said), false),
    }
}

/// A round or a task as it is now.
pub(crate) fn changed(changed: &Changed) -> String {
    let (kind, value) = match changed {
        Changed::Round(round) => ("round", serde_json::to_value(round)),
        Changed::Task(task) => ("task", serde_json::to_value(task)),
    };
    of_kind(kind, value).to_string()
}

fn failure_free(run: &FailureFree) -> String {
    of_kind("failure_free", serde_json::to_value(run)).to_string()
}

/// To the decimetre: finer than a pixel of any map.
fn dm(x_m: f64) -> f64 {
    (x_m * 10.0).round() / 10.0 + 0.0
}

/// East, north, east, north and so on, metres.
fn flat(ring: &Ring) -> Vec<f64> {
    ring.east_north_m.iter().flatten().map(|x| dm(*x)).collect()
}

fn scene(scene: &Scene) -> Value {
    let zone = |z: &skein_recording::model::scene::Zone| json!({ "name": z.name, "added": z.added, "ring": flat(&z.ring) });
    let uav = |u: &skein_recording::model::scene::Uav| {
        json!({
            "id": u.id,
            "name": u.name,
            "e": dm(u.launch.east_m),
            "n": dm(u.launch.north_m),
            "endurance_s": u.endurance_s,
            "height_m": u.height_m,
        })
    };
    json!({
        "k": "scene",
        "t": scene.time_ms,
        "scenario": scene.scenario,
        "seed": scene.seed,
        "version": scene.program_version,
        "revision": scene.revision,
        "lap": scene.lap,
        "loop": scene.loop_hash,
        "lat_deg": scene.origin.lat_deg,
        "lon_deg": scene.origin.lon_deg,
        "area": flat(&scene.area),
        "zones": scene.zones.iter().map(zone).collect::<Vec<_>>(),
        "buildings": scene.buildings.iter().map(|b| flat(&b.ring)).collect::<Vec<_>>(),
        "base": [dm(scene.base.east_m), dm(scene.base.north_m)],
        "ground": scene.ground.as_ref().map(|g| json!({
            "id": g.id, "e": dm(g.place.east_m), "n": dm(g.place.north_m),
        })),
        "cells": scene.cells.iter().map(|c| flat(&c.ring)).collect::<Vec<_>>(),
        "needed": scene.cells.iter().map(|c| u8::from(c.needed)).collect::<Vec<_>>(),
        "uavs": scene.uavs.iter().map(uav).collect::<Vec<_>>(),
        "work_bound_ms": scene.bounds.work_bound_ms,
        "wind_mps": [scene.wind_east_mps, scene.wind_north_mps],
        "range_m": scene.radio_range_m,
    })
}

/// A UAV as a row: id, state, east, north, heading, fuel, cells left, nearest other, whether its
/// airframe loiters by itself, who holds it for down.
fn row(uav: &UavState) -> Value {
    let pose = uav.pose;
    json!([
        uav.id,
        uav.state.word(),
        pose.map(|p| dm(p.place.east_m)),
        pose.map(|p| dm(p.place.north_m)),
        pose.map(|p| p.heading_deg.round()),
        uav.fuel_left_s.map(f64::round),
        uav.cells_left,
        uav.nearest_other_m.map(dm),
        u8::from(uav.failsafe),
        uav.held_down_by,
    ])
}

fn frame(frame: &Frame) -> Value {
    json!({
        "k": "frame",
        "t": frame.time_ms,
        "u": frame.uavs.iter().map(row).collect::<Vec<_>>(),
        "l": frame.links,
        "c": frame.components,
        "n": [frame.covered_cells, frame.coverable_cells],
        "s": frame.covered_share,
    })
}

fn event(event: &Event) -> String {
    with_kind("event", event.time_ms, serde_json::to_value(event))
}

fn end(end: &End) -> String {
    with_kind("end", end.time_ms, serde_json::to_value(end))
}

fn with_kind(kind: &str, time_ms: u64, value: serde_json::Result<Value>) -> String {
    let mut word = of_kind(kind, value);
    word["t"] = json!(time_ms);
    word.to_string()
}

fn of_kind(kind: &str, value: serde_json::Result<Value>) -> Value {
    let mut fields = match value {
        Ok(Value::Object(fields)) => fields,
        _ => Map::new(),
    };
    fields.insert("k".to_owned(), json!(kind));
    Value::Object(fields)
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_recording::model::event::{Origin, What};

    #[test]
    fn a_frame_is_rows_and_an_event_keeps_its_fields() {
        let frame = Frame {
            time_ms: 500,
            uavs: vec![UavState {
                id: 3,
                held_down_by: vec![1],
                ..UavState::default()
            }],
            ..Frame::default()
        };
        let (word, spare) = of(&Record::Frame(frame));
        assert!(spare);
        let word: Value = serde_json::from_str(&word).unwrap();
        assert_eq!(word["u"][0][0], 3);
        assert_eq!(word["u"][0][1], "starting");
        assert_eq!(
            (&word["u"][0][2], &word["u"][0][9][0]),
            (&Value::Null, &json!(1))
        );
        let event = Event {
            time_ms: 7,
            origin: Origin::Run,
            uav: Some(2),
            text: "t".to_owned(),
            what: What::Takeover {
                from: 4,
                cells: vec![1, 2],
                after_ms: 9,
            },
        };
        let (word, spare) = of(&Record::Event(event));
        assert!(!spare);
        let word: Value = serde_json::from_str(&word).unwrap();
        let fields = ["k", "t", "kind", "origin", "uav", "from"].map(|f| word[f].clone());
        let told = [
            json!("event"),
            json!(7),
            json!("takeover"),
            json!("run"),
            json!(2),
            json!(4),
        ];
        assert_eq!(fields, told);
    }

    #[test]
    fn a_round_is_told_with_the_times_of_its_bids_and_the_curve_as_pairs() {
        let round = skein_view::history::Round {
            id: 7,
            bids: vec![skein_view::history::Told {
                time_ms: 40,
                what: skein_recording::model::event::Bid {
                    by: 2,
                    anchor: 3,
                    release_ms: 4,
                    endurance_ms: 5,
                    eta_ms: 6,
                },
            }],
            ..skein_view::history::Round::default()
        };
        let word: Value = serde_json::from_str(&changed(&Changed::Round(round))).unwrap();
        assert_eq!((&word["k"], &word["id"]), (&json!("round"), &json!(7)));
        let bid = &word["bids"][0];
        assert_eq!((&bid["time_ms"], &bid["by"]), (&json!(40), &json!(2)));
        let run = FailureFree {
            makespan_ms: Some(9),
            coverage: vec![(0, 0.0), (9, 1.0)],
            ..FailureFree::default()
        };
        let (word, spare) = of(&Record::FailureFree(run));
        let word: Value = serde_json::from_str(&word).unwrap();
        assert!(!spare);
        assert_eq!(word["coverage"], json!([[0, 0.0], [9, 1.0]]));
        // It has no moment of its own: the run does not last as long as it.
        assert_eq!(word["t"], Value::Null);
    }
}
