//! A contour of a scenario that no peer knows (D2.7 §3.1): a road beside a way, or a fire that
//! grows.

use super::shared::{places, position};
use skein_geometry::frame::Point;
use skein_interop::json::{Error, Node};
use skein_netsim::spec::{ContourSpec, FireSpec, RoadSpec};

/// How far a road sways unless the file says so, metres.
const SWAY_M: f64 = 80.0;

/// Reads `contour`.
pub(crate) fn read(node: &Node<'_>) -> Result<ContourSpec, Error> {
    let f = node.fields(&["road", "fire"])?;
    match (f.get("road"), f.get("fire")) {
        (Some(road), None) => Ok(ContourSpec::Road(of_road(road)?)),
        (None, Some(fire)) => Ok(ContourSpec::Fire(of_fire(fire)?)),
        _ => Err(node.wrong(
            "expected either road: { way_m: [[0, 0], [900, 300]] } or fire: { east_m: 450, north_m: 390, radius_m: 120, growth_mps: 0.1 }",
        )),
    }
}

fn of_road(node: &Node<'_>) -> Result<RoadSpec, Error> {
    let f = node.fields(&["way_m", "sway_m"])?;
    let way = f.need("way_m", "[[0, 0], [900, 300]]")?;
    let all = places(way)?;
    let is_short = |b: &[Point]| (b[1] - b[0]).norm() < 1.0;
    if all.len() < 2 || all.windows(2).any(is_short) {
        return Err(way.wrong("expected two places or more, a metre apart at least"));
    }
    Ok(RoadSpec {
        way: all,
        sway_m: f.number_or("sway_m", SWAY_M, 0.0, 500.0, "metres")?,
    })
}

fn of_fire(node: &Node<'_>) -> Result<FireSpec, Error> {
    let f = node.fields(&[
        "east_m",
        "north_m",
        "radius_m",
        "growth_mps",
        "towards_deg",
        "stretch",
        "most_m",
    ])?;
    let radius_m = f.need("radius_m", "120")?.number(10.0, 5_000.0, "metres")?;
    Ok(FireSpec {
        at: position(&f)?,
        radius_m,
        growth_mps: f.number_or("growth_mps", 0.1, 0.0, 2.0, "m/s")?,
        towards_rad: f
            .number_or("towards_deg", 0.0, -360.0, 360.0, "degrees")?
            .to_radians(),
        stretch: f.number_or("stretch", 0.4, 0.0, 0.8, "of 1")?,
        most_m: f.number_or("most_m", 4.0 * radius_m, radius_m, 10_000.0, "metres")?,
    })
}
