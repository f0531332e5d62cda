//! Messages of the types that Foxglove knows (`foxglove.LocationFix`, `foxglove.GeoJSON`,
//! `foxglove.Log`; docs.foxglove.dev/docs/sdk/schemas), so that its map and log panels show a
//! recording without configuration. Left to others: which channel, and when.

use crate::cells::{Cell, Cells};
use crate::model::event::{Belief, Event, What};
use crate::model::frame::UavState;
use crate::model::{Ring, Scene};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Colours that can be told apart on white and on black, also by the colour-blind: UAVs take
/// turns.
pub const COLOURS: [&str; 8] = [
    "#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#a59a00", "#8a63d2",
];

/// The colour of a UAV of a scene.
#[must_use]
pub fn colour(scene: &Scene, uav: u16) -> &'static str {
    let at = scene.uavs.iter().position(|u| u.id == uav).unwrap_or(0);
    COLOURS[at % COLOURS.len()]
}

/// A colour such as `#0072b2` in parts of 1.
pub(crate) fn rgba(colour: &str) -> Value {
    let part = |from: usize| {
        let hex = colour.get(from..from + 2);
        hex.and_then(|h| u8::from_str_radix(h, 16).ok())
            .map_or(0.0, |n| f64::from(n) / 255.0)
    };
    json!({ "r": part(1), "g": part(3), "b": part(5), "a": 1 })
}

/// Scenario time as seconds and nanoseconds.
pub(crate) fn stamp(time_ms: u64) -> Value {
    json!({ "sec": time_ms / 1000, "nsec": time_ms % 1000 * 1_000_000 })
}

/// The frame of coordinates of a UAV.
pub(crate) fn frame_id(uav: u16) -> String {
    format!("uav{uav}")
}

/// Where a UAV is; none once its airframe is gone.
#[must_use]
pub fn location(time_ms: u64, scene: &Scene, uav: &UavState) -> Option<Value> {
    let pose = uav.pose?;
    Some(json!({
        "timestamp": stamp(time_ms),
        "frame_id": frame_id(uav.id),
        "latitude": pose.place.lat_deg,
        "longitude": pose.place.lon_deg,
        "altitude": pose.height_m,
        "position_covariance": [0, 0, 0, 0, 0, 0, 0, 0, 0],
        "position_covariance_type": 0,
        "heading": pose.heading_deg.to_radians(),
        "color": rgba(colour(scene, uav.id)),
        "metadata": [{ "key": "state", "value": uav.state.word() }],
    }))
}

/// An event as a line of a log.
#[must_use]
pub fn log(event: &Event) -> Value {
    let name = event
        .uav
        .map_or_else(|| "run".to_owned(), |id| format!("peer {id}"));
    json!({
        "timestamp": stamp(event.time_ms),
        "level": level(&event.what),
        "message": event.text,
        "name": name,
        "file": event.what.kind(),
        "line": 0,
    })
}

/// 1 for what is said all the time, 2 for news, 3 for trouble, 4 for what must not be.
fn level(what: &What) -> u8 {
    match what {
        What::Violation { .. } | What::ZoneEntry { .. } | What::Lost => 4,
        What::Fault { .. }
        | What::Ended { .. }
        | What::Alarm
        | What::Refused
        | What::Silenced
        | What::Failsafe { on: true }
        | What::Membership {
            belief: Belief::Down,
            ..
        } => 3,
        What::Claim { .. }
        | What::Covered { .. }
        | What::Bids { .. }
        | What::Ready { .. }
        | What::Membership { .. } => 1,
        _ => 2,
    }
}

/// The closed ring of GeoJSON: longitude first, the first corner repeated.
#[must_use]
pub fn closed(ring: &Ring) -> Vec<[f64; 2]> {
    let corners = ring.lat_lon_deg.iter().chain(ring.lat_lon_deg.first());
    corners.map(|[lat, lon]| [*lon, *lat]).collect()
}

/// A feature of GeoJSON with how it is drawn.
#[must_use]
pub fn feature(geometry: Value, properties: Value) -> Value {
    json!({ "type": "Feature", "geometry": geometry, "properties": properties })
}

fn polygon(ring: &Ring) -> Value {
    json!({ "type": "Polygon", "coordinates": [closed(ring)] })
}

/// Area, zones, base, ground station and buildings as features.
#[must_use]
pub fn site(scene: &Scene) -> Vec<Value> {
    let line = |colour: &str, fill: f64| json!({ "color": colour, "fillOpacity": fill });
    let mut all = vec![feature(
        polygon(&scene.area),
        json!({ "name": "area", "style": line("#222222", 0.0) }),
    )];
    all.extend(scene.zones.iter().map(|z| {
        let style = line("#dd1111", 0.4);
        feature(
            polygon(&z.ring),
            json!({ "name": z.name, "style": style, "kind": "no-fly zone" }),
        )
    }));
    all.extend(scene.buildings.iter().map(|b| {
        let style = line("#888888", 0.2);
        feature(
            polygon(&b.ring),
            json!({ "kind": "building", "height_m": b.height_m, "style": style }),
        )
    }));
    let point = |lon: f64, lat: f64| json!({ "type": "Point", "coordinates": [lon, lat] });
    let base = scene.base;
    all.push(feature(
        point(base.lon_deg, base.lat_deg),
        json!({ "name": "base" }),
    ));
    all.extend(scene.ground.iter().map(|g| {
        feature(
            point(g.place.lon_deg, g.place.lat_deg),
            json!({ "name": "ground station", "id": g.id }),
        )
    }));
    all
}

/// Those of the cells that are told as one feature for each UAV and status: covered by it,
/// planned by it, orphaned from it.
#[must_use]
pub fn cells(scene: &Scene, cells: &Cells, is_told: impl Fn(Cell) -> bool) -> Vec<Value> {
    let mut groups: BTreeMap<(u8, u16), Vec<Value>> = BTreeMap::new();
    let all = scene.cells.iter().zip(cells.all());
    for (cell, is) in all.filter(|(_, is)| is_told(*is)) {
        let group = match is {
            Cell::Open => (3, 0),
            Cell::Planned(by) => (1, by),
            Cell::Orphaned(of) => (2, of),
            Cell::Covered(by) => (0, by),
        };
        let ring = json!([closed(&cell.ring)]);
        groups.entry(group).or_default().push(ring);
    }
    let told = groups.into_iter().map(|((status, uav), rings)| {
        let (word, fill) = [
            ("covered", 0.5),
            ("planned", 0.12),
            ("orphaned", 0.3),
            ("open", 0.0),
        ][usize::from(status)];
        let colour = match status {
            2 => "#dd1111",
            3 => "#888888",
            _ => colour(scene, uav),
        };
        let mut properties = json!({
            "status": word,
            "cells": rings.len(),
            "style": { "color": colour, "fillOpacity": fill, "weight": 1 },
        });
        if status < 3 {
            properties["uav"] = json!(uav);
        }
        feature(
            json!({ "type": "MultiPolygon", "coordinates": rings }),
            properties,
        )
    });
    told.collect()
}

/// Features as one message.
#[must_use]
pub fn geojson(features: Vec<Value>) -> Value {
    json!({ "geojson": collection(features).to_string() })
}

/// Features as one object of GeoJSON.
#[must_use]
pub fn collection(features: Vec<Value>) -> Value {
    json!({ "type": "FeatureCollection", "features": features })
}

/// The JSON schema of one of the types above, with the fields that are used here.
#[must_use]
pub fn schema(name: &str) -> Value {
    let number = |what: &str| json!({ "type": "number", "description": what });
    let text = |what: &str| json!({ "type": "string", "description": what });
    let time = json!({
        "type": "object",
        "title": "time",
        "properties": {
            "sec": { "type": "integer", "minimum": 0 },
            "nsec": { "type": "integer", "minimum": 0, "maximum": 999_999_999 },
        },
    });
    let (properties, required) = match name {
        "foxglove.LocationFix" => (
            json!({
                "timestamp": time,
                "frame_id": text("Which UAV"),
                "latitude": number("Degrees, WGS84"),
                "longitude": number("Degrees, WGS84"),
                "altitude": number("Metres above the origin of the mission"),
                "position_covariance": {
                    "type": "array",
                    "items": { "type": "number" },
                    "minItems": 9,
                    "maxItems": 9,
                },
                "position_covariance_type": { "type": "integer", "description": "0: unknown" },
                "heading": number("Radians clockwise from north"),
                "color": {
                    "type": "object",
                    "title": "foxglove.Color",
                    "properties": { "r": number(""), "g": number(""), "b": number(""), "a": number("") },
                },
                "metadata": {
                    "type": "array",
                    "items": {
                        "type": "object",
                        "title": "foxglove.KeyValuePair",
                        "properties": { "key": text(""), "value": text("") },
                    },
                },
            }),
            json!([
                "timestamp",
                "frame_id",
                "latitude",
                "longitude",
                "altitude",
                "position_covariance",
                "position_covariance_type"
            ]),
        ),
        "foxglove.Log" => (
            json!({
                "timestamp": time,
                "level": { "type": "integer", "description": "1 debug, 2 info, 3 warning, 4 error" },
                "message": text("What happened"),
                "name": text("Whom it concerns"),
                "file": text("Kind of the event"),
                "line": { "type": "integer", "minimum": 0 },
            }),
            json!(["timestamp", "level", "message", "name", "file", "line"]),
        ),
        _ => (
            json!({ "geojson": text("GeoJSON in UTF-8") }),
            json!(["geojson"]),
        ),
    };
    json!({ "title": name, "type": "object", "properties": properties, "required": required })
}
