//! Zones and fences of a file in the plane of a route (D2.7 §2.3.1).

use anyhow::{Context, Result, bail};
use skein_geometry::frame::{Origin, Point};
use skein_geometry::offset::{LayeredZone, Zone, at_level};
use skein_interop::geojson::{self, HeightRules};
use skein_interop::place::{LatLon, Shape, Side, to_plane};
use skein_interop::plan;
use std::path::Path;

/// How far beyond everything the plane of a route ends, metres. A zone reaches at most
/// 20 km from the start, so there is always a way around it inside.
const OUTSKIRTS_M: f64 = 1_000.0;

/// A flight level and the distance kept above and below zones, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Level {
    pub(super) level_m: f64,
    pub(super) margin_m: f64,
}

/// What must be kept away from.
#[derive(Debug, Default)]
pub(super) struct Map {
    /// Where one may not be; a fence to stay within is everything around it.
    pub(super) zones: Vec<Zone>,
    /// What each zone is in the file.
    pub(super) names: Vec<String>,
    /// A ring round all zones and the two ends, counter-clockwise.
    pub(super) border: Vec<Point>,
    /// What was left out or put right.
    pub(super) notices: Vec<String>,
}

/// A ring of a file with its name.
struct Drawn {
    name: String,
    ring: Vec<Point>,
    /// Floor and ceiling, metres above the ground.
    layer_m: (f64, f64),
}

/// Everything of a file.
#[derive(Default)]
struct Sheet {
    keep_out: Vec<Drawn>,
    keep_in: Vec<Drawn>,
    notices: Vec<String>,
}

/// Reads a `.plan` or GeoJSON file around the places that a route names; with a level,
/// buildings below it are flown over.
///
/// # Errors
/// When the file cannot be read or something of it is wrong; names the place.
pub(super) fn read(
    file: &Path,
    origin: Origin,
    places: &[Point],
    level: Option<Level>,
) -> Result<Map> {
    let text = std::fs::read_to_string(file).with_context(|| format!("{}", file.display()))?;
    let is_plan = file.extension().is_some_and(|e| e == "plan");
    let sheet = if is_plan {
        of_plan(&text, origin)
    } else {
        of_geojson(&text, origin, level)
    };
    let sheet = sheet.with_context(|| format!("{}", file.display()))?;
    Ok(assemble(sheet, places, level))
}

fn of_plan(text: &str, origin: Origin) -> Result<Sheet> {
    let file = plan::read(text)?;
    let mut sheet = Sheet {
        notices: file.notices.iter().map(ToString::to_string).collect(),
        ..Sheet::default()
    };
    let drawn = |shape: &Shape, name: String, side: Side| -> Result<Drawn> {
        let ring = shape.to_plane(origin, side).with_context(|| name.clone())?;
        Ok(Drawn {
            name,
            ring,
            layer_m: (f64::NEG_INFINITY, f64::INFINITY),
        })
    };
    for (i, s) in file.keep_out.iter().enumerate() {
        let name = format!("exclusion fence {i}");
        sheet.keep_out.push(drawn(s, name, Side::Outside)?);
    }
    for (i, s) in file.keep_in.iter().enumerate() {
        let name = format!("inclusion fence {i}");
        sheet.keep_in.push(drawn(s, name, Side::Inside)?);
    }
    Ok(sheet)
}

fn of_geojson(text: &str, origin: Origin, level: Option<Level>) -> Result<Sheet> {
    let mut sheet = Sheet::default();
    let mut add = |pointer: &str, ring: &[LatLon], ceiling_m: f64| -> Result<()> {
        let ring = ring
            .iter()
            .map(|p| to_plane(origin, *p))
            .collect::<Result<Vec<_>, _>>()
            .with_context(|| format!("zone at {pointer}"))?;
        sheet.keep_out.push(Drawn {
            name: format!("zone at {pointer}"),
            ring,
            layer_m: (f64::NEG_INFINITY, ceiling_m),
        });
        Ok(())
    };
    let notices = if level.is_some() {
        let read = geojson::buildings(text, &HeightRules::default())?;
        for b in &read.buildings {
            add(&b.pointer, &b.ring, b.height_m)?;
        }
        read.notices
    } else {
        let read = geojson::read(text)?;
        for f in &read.polygons {
            add(&f.pointer, &f.ring, f64::INFINITY)?;
        }
        read.notices
    };
    sheet.notices = notices.iter().map(ToString::to_string).collect();
    Ok(sheet)
}

fn assemble(sheet: Sheet, places: &[Point], level: Option<Level>) -> Map {
    let mut map = Map {
        notices: sheet.notices,
        ..Map::default()
    };
    let layered: Vec<LayeredZone> = sheet
        .keep_out
        .iter()
        .map(|d| LayeredZone {
            zone: Zone {
                outer: d.ring.clone(),
                holes: Vec::new(),
            },
            floor_m: d.layer_m.0,
            ceiling_m: d.layer_m.1,
        })
        .collect();
    let active: Vec<(usize, &Zone)> = match level {
        Some(l) => at_level(&layered, l.level_m, l.margin_m),
        None => layered.iter().map(|z| &z.zone).enumerate().collect(),
    };
    if active.len() < layered.len() {
        let over = layered.len() - active.len();
        map.notices
            .push(format!("{over} zone(s) end below the level: flown over"));
    }
    for (i, zone) in active {
        map.zones.push(zone.clone());
        map.names.push(sheet.keep_out[i].name.clone());
    }
    let drawn = sheet.keep_out.iter().chain(&sheet.keep_in);
    let mut reach_m: f64 = 0.0;
    for p in drawn.flat_map(|d| &d.ring).chain(places) {
        reach_m = reach_m.max(p.coords.amax());
    }
    // Outside of an inclusion fence is a zone with the fence as its hole.
    for fence in sheet.keep_in {
        map.zones.push(Zone {
            outer: square(reach_m + OUTSKIRTS_M),
            holes: vec![fence.ring],
        });
        map.names.push(fence.name);
    }
    map.border = square(reach_m);
    map
}

impl Map {
    /// Moves the border out so that all grown zones are inside with room to pass.
    pub(super) fn widen(&mut self, clearance_m: f64) -> Result<()> {
        let Some(corner) = self.border.get(2) else {
            bail!("the map has no border");
        };
        self.border = square(corner.x + 2.0 * (clearance_m + OUTSKIRTS_M));
        Ok(())
    }
}

/// A square round the origin with half this side.
fn square(half_m: f64) -> Vec<Point> {
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(x, y)| Point::new(x * half_m, y * half_m))
        .to_vec()
}
