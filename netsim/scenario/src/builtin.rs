//! Scenarios that are part of the program, so that a trial runs from any directory.

use crate::error::ScenarioError;
use crate::files::Files;
use crate::request::Overrides;
use crate::resolve::{Scenario, parse_with};
use skein_interop::json::suggestion;

/// The scenario that is run when none is named.
pub const DEFAULT: &str = "helsinki";

/// Name, file as errors show it, text.
const SCENARIOS: &[(&str, &str, &str)] = &[
    (
        "helsinki",
        "helsinki.json5",
        include_str!("../../../configs/trials/helsinki.json5"),
    ),
    (
        "convoy",
        "convoy.json5",
        include_str!("../../../configs/trials/convoy.json5"),
    ),
    (
        "cranes",
        "cranes.json5",
        include_str!("../../../configs/trials/cranes.json5"),
    ),
    (
        "crossings",
        "crossings.json5",
        include_str!("../../../configs/trials/crossings.json5"),
    ),
    (
        "streets",
        "streets.json5",
        include_str!("../../../configs/trials/streets.json5"),
    ),
    (
        "event",
        "event.json5",
        include_str!("../../../configs/trials/event.json5"),
    ),
    (
        "stage",
        "stage.json5",
        include_str!("../../../configs/trials/stage.json5"),
    ),
    (
        "parking",
        "parking.json5",
        include_str!("../../../configs/trials/parking.json5"),
    ),
    (
        "accident",
        "accident.json5",
        include_str!("../../../configs/trials/accident.json5"),
    ),
    (
        "helsinki_wind",
        "helsinki_wind.json5",
        include_str!("../../../configs/trials/helsinki_wind.json5"),
    ),
    (
        "airspace",
        "airspace.json5",
        include_str!("../../../configs/trials/airspace.json5"),
    ),
    (
        "border",
        "border.json5",
        include_str!("../../../configs/trials/border.json5"),
    ),
    (
        "fire",
        "fire.json5",
        include_str!("../../../configs/trials/fire.json5"),
    ),
    (
        "gimbal",
        "gimbal.json5",
        include_str!("../../../configs/trials/gimbal.json5"),
    ),
    (
        "gusts",
        "gusts.json5",
        include_str!("../../../configs/trials/gusts.json5"),
    ),
    (
        "geofence",
        "geofence.json5",
        include_str!("../../../configs/trials/geofence.json5"),
    ),
    (
        "field",
        "field.json5",
        include_str!("../../../configs/trials/field.json5"),
    ),
    (
        "highway",
        "highway.json5",
        include_str!("../../../configs/trials/highway.json5"),
    ),
    (
        "wildfire",
        "wildfire.json5",
        include_str!("../../../configs/trials/wildfire.json5"),
    ),
    (
        "inspection",
        "inspection.json5",
        include_str!("../../../configs/trials/inspection.json5"),
    ),
    (
        "patrol",
        "patrol.json5",
        include_str!("../../../configs/trials/patrol.json5"),
    ),
    (
        "points",
        "points.json5",
        include_str!("../../../configs/trials/points.json5"),
    ),
    (
        "relay",
        "relay.json5",
        include_str!("../../../configs/trials/relay.json5"),
    ),
    (
        "roads",
        "roads.json5",
        include_str!("../../../configs/trials/roads.json5"),
    ),
    (
        "search",
        "search.json5",
        include_str!("../../../configs/trials/search.json5"),
    ),
    (
        "track",
        "track.json5",
        include_str!("../../../configs/trials/track.json5"),
    ),
    (
        "downtown",
        "downtown.json5",
        include_str!("../../../configs/trials/downtown.json5"),
    ),
    (
        "lookout",
        "lookout.json5",
        include_str!("../../../configs/trials/lookout.json5"),
    ),
    (
        "tracks",
        "tracks.json5",
        include_str!("../../../configs/trials/tracks.json5"),
    ),
    (
        "volume",
        "volume.json5",
        include_str!("../../../configs/trials/volume.json5"),
    ),
    (
        "swarm_20",
        "swarm_20.json5",
        include_str!("../../../configs/trials/swarm_20.json5"),
    ),
    (
        "swarm_100",
        "swarm_100.json5",
        include_str!("../../../configs/trials/swarm_100.json5"),
    ),
];

/// Files that the built-in scenarios name.
const DATA: &[(&str, &str)] = &[
    (
        "../data/helsinki_buildings.geojson",
        include_str!("../../../configs/data/helsinki_buildings.geojson"),
    ),
    (
        "../data/helsinki_roads.geojson",
        include_str!("../../../configs/data/helsinki_roads.geojson"),
    ),
    (
        "../data/px4_multicopter_mission_geofence_avoid.plan",
        include_str!("../../../configs/data/px4_multicopter_mission_geofence_avoid.plan"),
    ),
];

/// Names of the built-in scenarios.
#[must_use]
pub fn names() -> Vec<&'static str> {
    SCENARIOS.iter().map(|(name, _, _)| *name).collect()
}

/// The text of a built-in scenario.
#[must_use]
pub fn text(name: &str) -> Option<&'static str> {
    SCENARIOS
        .iter()
        .find(|(n, _, _)| *n == name)
        .map(|(_, _, text)| *text)
}

pub(crate) fn data(name: &str) -> Result<String, String> {
    let found = DATA.iter().find(|(n, _)| *n == name);
    found
        .map(|(_, text)| (*text).to_owned())
        .ok_or_else(|| "not built in".to_owned())
}

/// Files of the built-in scenarios.
#[must_use]
pub fn files() -> Files<'static> {
    Files::With(&data)
}

/// Resolves a built-in scenario.
///
/// # Errors
/// [`ScenarioError`] when there is none of that name, or when `over` does not fit it.
pub fn load_builtin(name: &str, over: &Overrides) -> Result<Scenario, ScenarioError> {
    match SCENARIOS.iter().find(|(n, _, _)| *n == name) {
        Some((_, file, text)) => parse_with(file, text, &files(), over),
        None => Err(ScenarioError::Unreadable {
            file: name.to_owned(),
            problem: format!(
                "no such file, and no built-in scenario of that name; {}",
                suggestion(name, &names())
            ),
        }),
    }
}
