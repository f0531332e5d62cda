//! Zones and fences of a file in the plane of a plan (D2.7 §2.3.1).

use anyhow::{Context, Result};
use serde_json::Value;
use skein_geometry::frame::{Origin, Point};
use skein_geometry::offset::{LayeredZone, Zone};
use skein_interop::geojson::{self, HeightRules};
use skein_interop::place::{LatLon, Shape, Side, to_plane};
use skein_interop::plan;
use skein_survey::zones::{Fence, NamedZone};
use std::path::Path;

/// Zones and fences of a file.
#[derive(Default)]
pub(super) struct ZoneInput {
    /// What must be kept out of.
    pub(super) keep_out: Vec<NamedZone>,
    /// What must be stayed within.
    pub(super) keep_in: Vec<Fence>,
    /// What was left out or put right.
    pub(super) notices: Vec<String>,
}

/// Which polygons of GeoJSON are zones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Polygons {
    /// All, from the ground to the sky: a file of zones.
    All,
    /// All, up to their height: a file of buildings.
    Buildings,
    /// Those with the property `"no_fly": true`: a file of something else.
    NoFly,
}

/// Reads a `.plan` or GeoJSON file.
///
/// # Errors
/// When the file cannot be read or something of it is wrong; names the place.
pub(super) fn read(file: &Path, origin: Origin, polygons: Polygons) -> Result<ZoneInput> {
    let text = std::fs::read_to_string(file).with_context(|| format!("{}", file.display()))?;
    of_text(file, &text, origin, polygons).with_context(|| format!("{}", file.display()))
}

/// The same of a file that was read already.
///
/// # Errors
/// When something of it is wrong; names the place in the file.
pub(super) fn of_text(
    file: &Path,
    text: &str,
    origin: Origin,
    polygons: Polygons,
) -> Result<ZoneInput> {
    if is_plan(file) {
        of_plan(text, origin)
    } else {
        of_geojson(text, origin, polygons)
    }
}

/// Whether a file is one of QGroundControl, by its name.
pub(super) fn is_plan(file: &Path) -> bool {
    file.extension().is_some_and(|e| e == "plan")
}

/// Whether a polygon says that it is a zone.
pub(super) fn is_no_fly(polygon: &geojson::Feature) -> bool {
    polygon.properties.get("no_fly").and_then(Value::as_bool) == Some(true)
}

fn named(name: String, ring: Vec<Point>, ceiling_m: f64) -> NamedZone {
    let holes = Vec::new();
    NamedZone {
        name,
        zone: LayeredZone {
            zone: Zone { outer: ring, holes },
            floor_m: f64::NEG_INFINITY,
            ceiling_m,
        },
    }
}

fn of_plan(text: &str, origin: Origin) -> Result<ZoneInput> {
    let file = plan::read(text)?;
    let mut input = ZoneInput {
        notices: file.notices.iter().map(ToString::to_string).collect(),
        ..ZoneInput::default()
    };
    let drawn = |shape: &Shape, name: &str, side: Side| {
        let ring = shape.to_plane(origin, side);
        ring.with_context(|| name.to_owned())
    };
    for (i, s) in file.keep_out.iter().enumerate() {
        let name = format!("exclusion fence {}", i + 1);
        let ring = drawn(s, &name, Side::Outside)?;
        input.keep_out.push(named(name, ring, f64::INFINITY));
    }
    for (i, s) in file.keep_in.iter().enumerate() {
        let name = format!("inclusion fence {}", i + 1);
        let ring = drawn(s, &name, Side::Inside)?;
        input.keep_in.push(Fence { name, ring });
    }
    Ok(input)
}

fn of_geojson(text: &str, origin: Origin, polygons: Polygons) -> Result<ZoneInput> {
    let mut input = ZoneInput::default();
    let mut add = |pointer: &str, ring: &[LatLon], ceiling_m: f64| -> Result<()> {
        let name = format!("zone at {pointer}");
        let ring = ring
            .iter()
            .map(|p| to_plane(origin, *p))
            .collect::<Result<Vec<_>, _>>()
            .with_context(|| name.clone())?;
        input.keep_out.push(named(name, ring, ceiling_m));
        Ok(())
    };
    let notices = if polygons == Polygons::Buildings {
        let read = geojson::buildings(text, &HeightRules::default())?;
        for b in &read.buildings {
            add(&b.pointer, &b.ring, b.height_m)?;
        }
        read.notices
    } else {
        let read = geojson::read(text)?;
        let counts = |f: &&_| polygons == Polygons::All || is_no_fly(f);
        for f in read.polygons.iter().filter(counts) {
            add(&f.pointer, &f.ring, f64::INFINITY)?;
        }
        read.notices
    };
    input.notices = notices.iter().map(ToString::to_string).collect();
    Ok(input)
}
