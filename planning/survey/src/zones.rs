//! What must be kept out of and stayed within, as zones of one kind (D2.7 §2.3.1).

use skein_geometry::frame::Point;
use skein_geometry::offset::{LayeredZone, Zone, at_level};

/// How far beyond everything what lies outside of a fence ends, metres. A zone reaches at
/// most 20 km from the start, so there is always a way around it inside.
const OUTSKIRTS_M: f64 = 1_000.0;

/// A zone with its name.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedZone {
    /// What it is called in errors.
    pub name: String,
    /// Where it is.
    pub zone: LayeredZone,
}

/// A fence to stay within.
#[derive(Clone, Debug, PartialEq)]
pub struct Fence {
    /// What it is called in errors.
    pub name: String,
    /// Its corners.
    pub ring: Vec<Point>,
}

/// A flight level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    /// Its height above the ground, metres.
    pub level_m: f64,
    /// Distance kept above and below zones, metres.
    pub margin_m: f64,
}

/// Where one may not be.
#[derive(Clone, Debug, PartialEq)]
pub struct FlightZones {
    /// The zones; a fence to stay within is everything around it.
    pub zones: Vec<Zone>,
    /// What each is called.
    pub names: Vec<String>,
    /// How many zones end below the level.
    pub flown_over: usize,
    /// The largest coordinate of all zones, fences and places, metres.
    pub(crate) reach_m: f64,
}

/// Zones and fences as zones, those that matter at a level; `places` lie within what
/// surrounds a fence.
#[must_use]
pub fn flight_zones(
    keep_out: &[NamedZone],
    keep_in: &[Fence],
    places: &[Point],
    level: Option<Level>,
) -> FlightZones {
    let layered: Vec<LayeredZone> = keep_out.iter().map(|z| z.zone.clone()).collect();
    let active: Vec<(usize, &Zone)> = match level {
        Some(l) => at_level(&layered, l.level_m, l.margin_m),
        None => layered.iter().map(|z| &z.zone).enumerate().collect(),
    };
    let outlines = keep_out.iter().map(|z| &z.zone.zone.outer);
    let fences = keep_in.iter().map(|f| &f.ring);
    let drawn = outlines.chain(fences).flatten();
    let far = |p: &Point| p.coords.amax();
    let mut all = FlightZones {
        zones: Vec::new(),
        names: Vec::new(),
        flown_over: layered.len() - active.len(),
        reach_m: drawn.chain(places).map(far).fold(0.0, f64::max),
    };
    for (i, zone) in active {
        all.zones.push(zone.clone());
        all.names.push(keep_out[i].name.clone());
    }
    // Outside of an inclusion fence is a zone with the fence as its hole.
    for fence in keep_in {
        all.zones.push(Zone {
            outer: square(all.reach_m + OUTSKIRTS_M),
            holes: vec![fence.ring.clone()],
        });
        all.names.push(fence.name.clone());
    }
    all
}

/// A square round the origin with half this side.
pub(crate) fn square(half_m: f64) -> Vec<Point> {
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(x, y)| Point::new(x * half_m, y * half_m))
        .to_vec()
}
