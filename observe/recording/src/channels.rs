//! The channels of a recording: their topics, and the JSON schema of each.

use crate::model::{End, Event, FailureFree, Frame, Scene};
use crate::{foxglove, space, viewers};
use schemars::{JsonSchema, SchemaGenerator, generate::SchemaSettings};
use serde_json::Value;

/// A channel of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Channel {
    /// Its topic; `*` stands for the number of a UAV.
    pub topic: &'static str,
    /// The name of its schema.
    pub schema: &'static str,
}

const fn channel(topic: &'static str, schema: &'static str) -> Channel {
    Channel { topic, schema }
}

/// What does not change until the mission does.
pub const SCENE: Channel = channel("/skein/scene", "skein.Scene");
/// How everything stands, twice a second of scenario time.
pub const FRAME: Channel = channel("/skein/frame", "skein.Frame");
/// What happened.
pub const EVENT: Channel = channel("/skein/event", "skein.Event");
/// The run without failures, where one is known.
pub const FAILURE_FREE: Channel = channel("/skein/failure_free", "skein.FailureFree");
/// What the run came to.
pub const END: Channel = channel("/skein/end", "skein.End");
/// Where a UAV is.
pub const LOCATION: Channel = channel("/uav/*/location", "foxglove.LocationFix");
/// Area, zones, buildings, base.
pub const SITE: Channel = channel("/map/site", "foxglove.GeoJSON");
/// The cells, by who has them.
pub const CELLS: Channel = channel("/map/cells", "foxglove.GeoJSON");
/// Where the UAVs are, as frames of coordinates.
pub const TRANSFORMS: Channel = channel("/tf", "foxglove.FrameTransforms");
/// Area, zones and roofs in three dimensions.
pub const SITE_DRAWN: Channel = channel("/drawn/site", "foxglove.SceneUpdate");
/// The UAVs in three dimensions.
pub const UAVS_DRAWN: Channel = channel("/drawn/uavs", "foxglove.SceneUpdate");
/// Events in words.
pub const LOG: Channel = channel("/log", "foxglove.Log");

/// All of them.
pub const ALL: [Channel; 12] = [
    SCENE,
    FRAME,
    EVENT,
    FAILURE_FREE,
    END,
    LOCATION,
    SITE,
    CELLS,
    TRANSFORMS,
    SITE_DRAWN,
    UAVS_DRAWN,
    LOG,
];

impl Channel {
    /// The JSON schema of its messages.
    #[must_use]
    pub fn json_schema(self) -> Value {
        match self.schema {
            "skein.Scene" => of::<Scene>(self.schema),
            "skein.Frame" => of::<Frame>(self.schema),
            "skein.Event" => of::<Event>(self.schema),
            "skein.FailureFree" => of::<FailureFree>(self.schema),
            "skein.End" => of::<End>(self.schema),
            name @ ("foxglove.FrameTransforms" | "foxglove.SceneUpdate") => space::schema(name),
            name => foxglove::schema(name),
        }
    }
}

/// The schema of a type of the model. Readers of recordings follow no references, so that none
/// are made.
fn of<T: JsonSchema>(title: &str) -> Value {
    let settings = SchemaSettings::draft2020_12().with(|s| s.inline_subschemas = true);
    let whole = SchemaGenerator::new(settings).into_root_schema_for::<T>();
    viewers::schema_for_both(title, whole.to_value())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_channel_has_a_schema_of_its_own_fields() {
        for channel in ALL {
            let schema = channel.json_schema();
            assert_eq!(schema["title"], channel.schema);
            assert_eq!(schema["type"], "object", "{schema}");
            assert!(!schema.to_string().contains("$ref"), "{schema}");
        }
        let frame = FRAME.json_schema();
        let uav = &frame["properties"]["uavs"]["items"]["properties"];
        assert_eq!(uav["cells_left"]["type"], "integer");
        let event = EVENT.json_schema();
        let kinds = event["allOf"][0]["oneOf"].as_array().unwrap();
        let kind = |k: &Value| k["properties"]["kind"]["const"].clone();
        assert!(kinds.iter().any(|k| kind(k) == "takeover"), "{event}");
    }
}
