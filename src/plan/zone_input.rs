//! Zones and fences of a file in the plane of a plan (D2.7 §2.3.1).

use anyhow::{Context, Error, Result, anyhow};
use skein_geometry::frame::{Origin, Point};
use skein_geometry::offset::{LayeredZone, Zone};
use skein_geometry::{Polygon, PolygonError};
use skein_interop::geojson::{self, HeightRules};
use skein_interop::place::{LatLon, Shape, Side, check_ring, from_plane, to_plane};
use skein_interop::plan;
use skein_survey::zones::{Fence, NamedZone};
use std::path::Path;

/// Zones and fences of a file.
#[derive(Default)]
pub(crate) struct ZoneInput {
    /// What must be kept out of.
    pub(crate) keep_out: Vec<NamedZone>,
    /// What must be stayed within.
    pub(super) keep_in: Vec<Fence>,
    /// The same as the file draws it, for other files: whether it is to be stayed within.
    pub(super) drawn: Vec<(bool, Shape)>,
    /// What was left out or put right.
    pub(crate) notices: Vec<String>,
}

/// Which polygons of GeoJSON are zones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Polygons {
    /// All, from the ground to the sky: a file of zones.
    All,
    /// All, up to their height: a file of buildings.
    Buildings,
    /// Those whose property `no_fly` is true: a file of something else.
    NoFly,
}

/// Reads a `.plan` or GeoJSON file.
///
/// # Errors
/// When the file cannot be read or something of it is wrong; names the place.
pub(crate) fn read(file: &Path, origin: Origin, polygons: Polygons) -> Result<ZoneInput> {
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

/// A ring of a file as a polygon.
///
/// # Errors
/// When it crosses or touches itself, is too far away, or no polygon; names the place.
pub(super) fn polygon(origin: Origin, ring: &[LatLon], name: &str) -> Result<Polygon> {
    check_ring(ring).with_context(|| name.to_owned())?;
    let points = ring.iter().map(|p| to_plane(origin, *p));
    let points = points
        .collect::<Result<Vec<Point>, _>>()
        .with_context(|| name.to_owned())?;
    simple(origin, points, name)
}

/// A ring of the plane as a polygon.
///
/// # Errors
/// When it touches itself, or is no polygon; names the place.
pub(super) fn simple(origin: Origin, ring: Vec<Point>, name: &str) -> Result<Polygon> {
    let corner = |k: usize| {
        let p = ring.get(k % ring.len().max(1)).copied();
        let LatLon { lat_deg, lon_deg } = from_plane(origin, p.unwrap_or(Point::origin()));
        format!("{lat_deg:.7}, {lon_deg:.7}")
    };
    Polygon::new(ring.clone()).map_err(|error| match error {
        PolygonError::SelfCrossing(i, j) => anyhow!(
            "{name}: the ring touches itself: its edge from {} to {} and that from {} to {}; move them apart, or draw two polygons",
            corner(i),
            corner(i + 1),
            corner(j),
            corner(j + 1)
        ),
        error => Error::new(error).context(name.to_owned()),
    })
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
        if let Shape::Ring(ring) = shape {
            check_ring(ring).with_context(|| name.to_owned())?;
        }
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
    let keep_out = file.keep_out.into_iter().map(|s| (false, s));
    let keep_in = file.keep_in.into_iter().map(|s| (true, s));
    input.drawn = keep_out.chain(keep_in).collect();
    Ok(input)
}

fn of_geojson(text: &str, origin: Origin, polygons: Polygons) -> Result<ZoneInput> {
    let mut input = ZoneInput::default();
    // Footprints of map data touch and cross themselves; what is drawn by hand should not.
    let by_hand = polygons != Polygons::Buildings;
    let mut add = |pointer: &str, ring: &[LatLon], ceiling_m: f64| -> Result<()> {
        let name = format!("zone at {pointer}");
        if by_hand {
            check_ring(ring).with_context(|| name.clone())?;
            input.drawn.push((false, Shape::Ring(ring.to_vec())));
        }
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
        for f in &read.polygons {
            if polygons == Polygons::All || f.is_no_fly()? {
                add(&f.pointer, &f.ring, f64::INFINITY)?;
            }
        }
        read.notices
    };
    input.notices = notices.iter().map(ToString::to_string).collect();
    Ok(input)
}
