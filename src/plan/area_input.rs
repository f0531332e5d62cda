//! An area to be covered, as files have it: survey polygons and fences of a QGroundControl
//! `.plan`, polygons of GeoJSON (D2.7 §3.6).

use super::lat_lon;
use super::zone_input::{self, Polygons, is_no_fly, is_plan};
use anyhow::{Context, Result, bail};
use serde_json::Value;
use skein_geometry::frame::{Origin, Point};
use skein_geometry::{NoFlyZones, Polygon};
use skein_interop::place::{LatLon, to_plane};
use skein_interop::{geojson, plan};
use std::path::Path;
use std::sync::Arc;

/// What is to be covered, in the plane of the launch point.
#[derive(Debug)]
pub struct AreaInput {
    /// The launch point: the origin of the plane.
    pub origin: Origin,
    /// The area.
    pub area: Polygon,
    /// Parts of it that need not be seen.
    pub holes: Vec<Polygon>,
    /// Where nobody may fly.
    pub zones: Arc<NoFlyZones>,
    /// The sensor that it is to be seen with, if the file says so.
    pub sensor: Option<String>,
    /// What of the file was left out.
    pub notices: Vec<String>,
}

/// An area of a file.
struct Drawn {
    name: String,
    ring: Vec<LatLon>,
    holes: Vec<Vec<LatLon>>,
    sensor: Option<String>,
}

/// What a file holds beside its zones.
#[derive(Default)]
struct FileShapes {
    areas: Vec<Drawn>,
    home: Option<LatLon>,
    notices: Vec<String>,
}

/// Reads a file; the launch point is `launch` (`LAT,LON`), or the file's home position,
/// or the area's first corner.
///
/// In a `.plan` the survey's polygon is the area and exclusion fences are zones. In
/// GeoJSON a polygon with the property `"no_fly": true` is a zone, the other one the
/// area; its holes need not be seen, and its property `sensor` names what it is to be
/// seen with.
///
/// # Errors
/// When the file cannot be read, has no area or more than one, or something of it is
/// wrong; names the place.
pub fn read(file: &Path, launch: Option<&str>) -> Result<AreaInput> {
    let shown = || file.display().to_string();
    let text = std::fs::read_to_string(file).with_context(|| format!("cannot read {}", shown()))?;
    let shapes = if is_plan(file) {
        of_plan(&text)
    } else {
        of_geojson(&text)
    };
    let zones = |origin| -> Result<Vec<Polygon>> {
        let input = zone_input::of_text(file, &text, origin, Polygons::NoFly)?;
        let polygons = input.keep_out.into_iter();
        polygons
            .map(|z| Polygon::new(z.zone.zone.outer).context(z.name))
            .collect()
    };
    in_plane(shapes.with_context(shown)?, launch, zones).with_context(shown)
}

fn of_plan(text: &str) -> Result<FileShapes> {
    let file = plan::read(text)?;
    let mut shapes = FileShapes {
        home: file.home,
        notices: file.notices.iter().map(ToString::to_string).collect(),
        ..FileShapes::default()
    };
    for (i, ring) in file.surveys.into_iter().enumerate() {
        shapes.areas.push(Drawn {
            name: format!("survey {}", i + 1),
            ring,
            holes: Vec::new(),
            sensor: None,
        });
    }
    if !file.keep_in.is_empty() {
        let n = file.keep_in.len();
        shapes.notices.push(format!(
            "{n} inclusion fence(s) ignored: passes and turns reach beyond the survey"
        ));
    }
    Ok(shapes)
}

fn of_geojson(text: &str) -> Result<FileShapes> {
    let read = geojson::read(text)?;
    // Holes are used here, whatever the reader says to those who ask for rings alone.
    let notices = read.notices.iter().map(ToString::to_string);
    let mut shapes = FileShapes {
        notices: notices.filter(|n| !n.contains("hole(s)")).collect(),
        ..FileShapes::default()
    };
    for f in read.polygons.into_iter().filter(|f| !is_no_fly(f)) {
        if f.hole_rings.len() < f.holes {
            let text = format!("at {}: a hole without an area was filled", f.pointer);
            shapes.notices.push(text);
        }
        let sensor = match f.properties.get("sensor") {
            None | Some(Value::Null) => None,
            Some(Value::String(name)) => Some(name.clone()),
            Some(other) => bail!(
                "at {}/properties/sensor: expected the name of a sensor, found {other}",
                f.pointer
            ),
        };
        shapes.areas.push(Drawn {
            name: f.pointer,
            ring: f.ring,
            holes: f.hole_rings,
            sensor,
        });
    }
    Ok(shapes)
}

fn in_plane(
    shapes: FileShapes,
    launch: Option<&str>,
    zones: impl FnOnce(Origin) -> Result<Vec<Polygon>>,
) -> Result<AreaInput> {
    let [
        Drawn {
            name,
            ring,
            holes,
            sensor,
        },
    ] = shapes.areas.as_slice()
    else {
        bail!(
            "one area is planned at a time, found {}: a survey of a .plan, or a polygon of GeoJSON without \"no_fly\": true",
            shapes.areas.len()
        );
    };
    let launch = match launch {
        Some(text) => lat_lon(text).context("--launch")?,
        None => match shapes.home.or(ring.first().copied()) {
            Some(at) => at,
            None => bail!("{name}: the area has no corner"),
        },
    };
    let origin = Origin {
        lat_deg: launch.lat_deg,
        lon_deg: launch.lon_deg,
    };
    let polygon = |ring: &[LatLon], name: &str| -> Result<Polygon> {
        let points = ring.iter().map(|p| to_plane(origin, *p));
        let points = points
            .collect::<Result<Vec<Point>, _>>()
            .with_context(|| name.to_owned())?;
        Polygon::new(points).with_context(|| name.to_owned())
    };
    let holes = holes
        .iter()
        .enumerate()
        .map(|(i, hole)| polygon(hole, &format!("{name}, hole {}", i + 1)));
    Ok(AreaInput {
        origin,
        area: polygon(ring, name)?,
        holes: holes.collect::<Result<_>>()?,
        zones: Arc::new(NoFlyZones::new(zones(origin)?)),
        sensor: sensor.clone(),
        notices: shapes.notices,
    })
}
