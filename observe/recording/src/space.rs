//! The swarm in three dimensions, in Foxglove's types: where each UAV is as a frame of
//! coordinates (`foxglove.FrameTransforms`), and what is drawn there (`foxglove.SceneUpdate`).
//!
//! The fixed frame is [`FIXED`]: x east, y north, z up, metres from the scene's origin.

use crate::foxglove::{colour, frame_id, rgba, stamp};
use crate::model::frame::{Pose, UavState};
use crate::model::{Frame, Ring, Scene};
use serde_json::{Value, json};

/// The frame in which everything stands.
pub const FIXED: &str = "site";

/// What an entity may consist of.
const KINDS: [&str; 9] = [
    "arrows",
    "cubes",
    "cylinders",
    "lines",
    "metadata",
    "models",
    "spheres",
    "texts",
    "triangles",
];

/// How large a UAV is drawn, metres: large enough to be seen from where all of it is in view.
const UAV_M: f64 = 34.0;

fn at_origin() -> Value {
    json!({
        "position": { "x": 0, "y": 0, "z": 0 },
        "orientation": { "x": 0, "y": 0, "z": 0, "w": 1 },
    })
}

/// Where something stands, and how it is turned about the vertical: its x axis is its nose.
fn placed(pose: &Pose) -> (Value, Value) {
    let half_rad = (90.0 - pose.heading_deg).to_radians() / 2.0;
    let place = json!({ "x": pose.place.east_m, "y": pose.place.north_m, "z": pose.height_m });
    let turned = json!({ "x": 0, "y": 0, "z": half_rad.sin(), "w": half_rad.cos() });
    (place, turned)
}

/// Where the UAVs are; none while nobody is anywhere.
#[must_use]
pub fn transforms(frame: &Frame) -> Option<Value> {
    let of = |uav: &UavState| {
        let (translation, rotation) = placed(uav.pose.as_ref()?);
        Some(json!({
            "timestamp": stamp(frame.time_ms),
            "parent_frame_id": FIXED,
            "child_frame_id": frame_id(uav.id),
            "translation": translation,
            "rotation": rotation,
        }))
    };
    let all: Vec<Value> = frame.uavs.iter().filter_map(of).collect();
    (!all.is_empty()).then(|| json!({ "transforms": all }))
}

/// Something that is drawn, of nothing yet.
fn entity(time_ms: u64, id: &str) -> Value {
    let mut entity = json!({
        "timestamp": stamp(time_ms),
        "frame_id": FIXED,
        "id": id,
        "lifetime": { "sec": 0, "nsec": 0 },
        "frame_locked": false,
    });
    for kind in KINDS {
        entity[kind] = json!([]);
    }
    entity
}

/// A ring at a height, as a closed line.
fn outline(ring: &Ring, height_m: f64, colour: &str) -> Value {
    let points = ring.east_north_m.iter();
    let points: Vec<Value> = points
        .map(|[east_m, north_m]| json!({ "x": east_m, "y": north_m, "z": height_m }))
        .collect();
    json!({
        "type": 1,
        "pose": at_origin(),
        "thickness": 2,
        "scale_invariant": true,
        "points": points,
        "color": rgba(colour),
        "colors": [],
        "indices": [],
    })
}

/// Area, no-fly zones, and the edges of the roofs.
#[must_use]
pub fn site(scene: &Scene) -> Value {
    let mut lines = vec![outline(&scene.area, 0.0, "#888888")];
    lines.extend(scene.zones.iter().map(|z| outline(&z.ring, 0.0, "#dd1111")));
    let roofs = scene.buildings.iter();
    lines.extend(roofs.map(|b| outline(&b.ring, b.height_m, "#999999")));
    let mut drawn = entity(scene.time_ms, "site");
    drawn["lines"] = lines.into();
    json!({ "deletions": [], "entities": [drawn] })
}

/// The UAVs as arrows with their number and state; those whose airframe is gone are gone.
#[must_use]
pub fn uavs(scene: &Scene, frame: &Frame) -> Value {
    let (mut entities, mut deletions) = (Vec::new(), Vec::new());
    for uav in &frame.uavs {
        let id = frame_id(uav.id);
        let Some(pose) = &uav.pose else {
            deletions.push(json!({ "timestamp": stamp(frame.time_ms), "type": 0, "id": id }));
            continue;
        };
        let (position, orientation) = placed(pose);
        let colour = rgba(colour(scene, uav.id));
        let mut label = at_origin();
        label["position"] = json!({
            "x": pose.place.east_m,
            "y": pose.place.north_m,
            "z": pose.height_m + UAV_M / 3.0,
        });
        let arrow = json!({
            "pose": { "position": position, "orientation": orientation },
            "shaft_length": 0.6 * UAV_M,
            "shaft_diameter": 0.2 * UAV_M,
            "head_length": 0.4 * UAV_M,
            "head_diameter": 0.4 * UAV_M,
            "color": colour,
        });
        let text = json!({
            "pose": label,
            "billboard": true,
            "font_size": 14,
            "scale_invariant": true,
            "color": colour,
            "text": format!("{} {}", uav.id, uav.state.word()),
        });
        let mut drawn = entity(frame.time_ms, &id);
        drawn["arrows"] = json!([arrow]);
        drawn["texts"] = json!([text]);
        entities.push(drawn);
    }
    json!({ "deletions": deletions, "entities": entities })
}

fn object(title: &str, properties: Value) -> Value {
    json!({ "title": title, "type": "object", "properties": properties })
}

fn list(of: Value) -> Value {
    json!({ "type": "array", "items": of })
}

fn numbers(title: &str, names: &[&str]) -> Value {
    let mut properties = json!({});
    for name in names {
        properties[*name] = json!({ "type": "number" });
    }
    object(title, properties)
}

/// The JSON schema of one of the types above, with the fields that are used here.
#[must_use]
pub fn schema(name: &str) -> Value {
    let whole = json!({ "type": "integer" });
    let time = object("time", json!({ "sec": whole, "nsec": whole }));
    let (text, truth) = (json!({ "type": "string" }), json!({ "type": "boolean" }));
    let number = json!({ "type": "number" });
    let vector = numbers("foxglove.Vector3", &["x", "y", "z"]);
    let turn = numbers("foxglove.Quaternion", &["x", "y", "z", "w"]);
    if name == "foxglove.FrameTransforms" {
        let one = json!({
            "timestamp": time,
            "parent_frame_id": text,
            "child_frame_id": text,
            "translation": vector,
            "rotation": turn,
        });
        let transforms = list(object("foxglove.FrameTransform", one));
        return object(name, json!({ "transforms": transforms }));
    }
    let pose = object(
        "foxglove.Pose",
        json!({ "position": vector, "orientation": turn }),
    );
    let colour = numbers("foxglove.Color", &["r", "g", "b", "a"]);
    let arrow = json!({
        "pose": pose,
        "shaft_length": number,
        "shaft_diameter": number,
        "head_length": number,
        "head_diameter": number,
        "color": colour,
    });
    let line = json!({
        "type": whole,
        "pose": pose,
        "thickness": number,
        "scale_invariant": truth,
        "points": list(numbers("foxglove.Point3", &["x", "y", "z"])),
        "color": colour,
        "colors": list(colour.clone()),
        "indices": list(whole.clone()),
    });
    let words = json!({
        "pose": pose,
        "billboard": truth,
        "font_size": number,
        "scale_invariant": truth,
        "color": colour,
        "text": text,
    });
    let mut entity = json!({
        "timestamp": time,
        "frame_id": text,
        "id": text,
        "lifetime": object("duration", json!({ "sec": whole, "nsec": whole })),
        "frame_locked": truth,
    });
    for kind in KINDS {
        entity[kind] = list(object("", json!({})));
    }
    entity["arrows"] = list(object("foxglove.ArrowPrimitive", arrow));
    entity["lines"] = list(object("foxglove.LinePrimitive", line));
    entity["texts"] = list(object("foxglove.TextPrimitive", words));
    let deletion = json!({ "timestamp": time, "type": whole, "id": text });
    object(
        name,
        json!({
            "deletions": list(object("foxglove.SceneEntityDeletion", deletion)),
            "entities": list(object("foxglove.SceneEntity", entity)),
        }),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{Place, scene::Uav};

    fn frame() -> Frame {
        let pose = Pose {
            place: Place {
                east_m: 100.0,
                north_m: 200.0,
                ..Place::default()
            },
            heading_deg: 90.0,
            height_m: 60.0,
            airspeed_mps: 13.0,
        };
        let flies = UavState {
            id: 7,
            pose: Some(pose),
            ..UavState::default()
        };
        let lost = UavState {
            id: 3,
            ..UavState::default()
        };
        Frame {
            time_ms: 1_500,
            uavs: vec![flies, lost],
            ..Frame::default()
        }
    }

    #[test]
    fn a_uav_stands_where_it_is_with_its_nose_along_x() {
        let told = transforms(&frame()).unwrap();
        let one = &told["transforms"][0];
        assert_eq!(one["child_frame_id"], "uav7");
        assert_eq!(
            one["translation"],
            json!({ "x": 100.0, "y": 200.0, "z": 60.0 })
        );
        // East: the x axis of the site, so that nothing is turned.
        assert_eq!(one["rotation"]["w"], 1.0);
        assert_eq!(told["transforms"].as_array().unwrap().len(), 1);
        assert_eq!(transforms(&Frame::default()), None);
    }

    #[test]
    fn who_is_gone_is_drawn_no_more() {
        let scene = Scene {
            uavs: vec![Uav {
                id: 7,
                ..Uav::default()
            }],
            ..Scene::default()
        };
        let told = uavs(&scene, &frame());
        assert_eq!(told["deletions"][0]["id"], "uav3");
        assert_eq!(
            told["entities"][0]["arrows"][0]["pose"]["position"]["x"],
            100.0
        );
        assert_eq!(told["entities"].as_array().unwrap().len(), 1);
    }
}
