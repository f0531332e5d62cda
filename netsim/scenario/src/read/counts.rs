//! Sites at which a mission counts vehicles (D2.7 §3.1): `mission.counts`.

use super::shared::{places, position};
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::{TAU, sin_cos};
use skein_interop::json::{Error, Node};
use skein_peer::count_site::{CountSite, Counted, SITES_MAX};
use skein_peer::mission::ring_mm;

/// A circle is counted at as a ring of so many corners.
const CIRCLE_CORNERS: u32 = 16;

/// The largest circle, metres: no picture holds more.
const RADIUS_MAX_M: f64 = 1_000.0;

/// Reads `mission.counts`.
pub(crate) fn of_mission(mission: &Node<'_>) -> Result<Vec<CountSite>, Error> {
    let Some(list) = mission.get("counts")? else {
        return Ok(Vec::new());
    };
    let items = list.items()?;
    if items.len() > SITES_MAX {
        return Err(list.wrong(format!(
            "has {} sites; expected {SITES_MAX} at most",
            items.len()
        )));
    }
    items.iter().map(site).collect()
}

fn site(node: &Node<'_>) -> Result<CountSite, Error> {
    let f = node.fields(&["name", "what", "ring_m", "circle", "capacity"])?;
    let what = f.need("what", "\"passing\"")?;
    let corners = match (f.get("ring_m"), f.get("circle")) {
        (Some(node), None) => places(node)?,
        (None, Some(node)) => circle(node)?,
        _ => {
            return Err(node.wrong(
                "expected either ring_m: [[0, 0], [30, 0], [30, 30]] or circle: { east_m: 0, north_m: 0, radius_m: 20 }",
            ));
        }
    };
    let site = CountSite {
        name: f.need("name", "\"north\"")?.text()?.to_owned(),
        what: what.one_of(&Counted::ALL.map(|c| (c.name(), c)))?,
        ring: ring_mm(&corners),
        capacity: f.small_or("capacity", 0, 1, 10_000, "vehicles")?,
    };
    // Whether a picture holds it depends on the cameras of the fleet.
    match site.check(f64::INFINITY) {
        Ok(()) => Ok(site),
        Err((field, text)) => Err(f.get(field).unwrap_or(node).wrong(text)),
    }
}

fn circle(node: &Node<'_>) -> Result<Vec<Point>, Error> {
    let f = node.fields(&["east_m", "north_m", "radius_m"])?;
    let middle = position(&f)?;
    let radius_m = f
        .need("radius_m", "20")?
        .number(1.0, RADIUS_MAX_M, "metres")?;
    let corner = |i: u32| {
        let (s, c) = sin_cos(TAU * f64::from(i) / f64::from(CIRCLE_CORNERS));
        middle + Vector::new(c, s) * radius_m
    };
    Ok((0..CIRCLE_CORNERS).map(corner).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read::testing::mission_of;

    fn with(mission: &str) -> Result<Vec<CountSite>, String> {
        mission_of(mission).map(|m| m.counts.clone())
    }

    #[test]
    fn sites_are_read_or_refused_with_place_and_remedy() {
        let read = with(
            "{ counts: [{ name: 'north', what: 'passing', circle: { east_m: 100, north_m: 60, radius_m: 20 } }, { name: 'lot', what: 'standing', ring_m: [[0, 0], [40, 0], [40, 20], [0, 20]], capacity: 12 }] }",
        );
        let read = read.unwrap();
        assert_eq!((read[0].what, read[0].ring.len()), (Counted::Passing, 16));
        assert!((read[0].radius_m() - 20.0).abs() < 0.01);
        assert_eq!((read[1].what, read[1].capacity), (Counted::Standing, 12));
        let circle = "circle: { east_m: 0, north_m: 0, radius_m: 20 }";
        for (site, why) in [
            ("{ what: 'passing' }".to_owned(), "expected either ring_m"),
            (format!("{{ what: 'passing', {circle} }}"), "name"),
            (format!("{{ name: 'a', {circle} }}"), "what"),
            (
                format!("{{ name: 'a', what: 'flying', {circle} }}"),
                "counts[0].what",
            ),
            (
                format!("{{ name: 'a', what: 'passing', capacity: 3, {circle} }}"),
                "leave it out",
            ),
            (
                "{ name: 'a', what: 'passing', circle: { east_m: 0, north_m: 0, radius_m: 60 } }"
                    .to_owned(),
                "divide it, or fly higher",
            ),
        ] {
            let said = with(&format!("{{ counts: [{site}] }}")).unwrap_err();
            assert!(said.contains(why), "{said}");
        }
    }
}
