//! Vehicles on the ground of a scenario (D2.7 §1.5.2): on which roads, from where, how fast,
//! and what they do.

use super::shared::{Notices, lines_of, places, position, ways};
use crate::files::Files;
use skein_geometry::frame::{Origin, Point, Vector};
use skein_interop::json::{Error, Fields, Node, suggestion};
use skein_netsim::pursuit::KINDS;
use skein_netsim::pursuit::roads::Roads;
use skein_netsim::pursuit::vehicle::Behaviour;
use skein_netsim::spec::VehicleSpec;
use skein_peer::criteria::{COLOURS, LOOKS, coloured};
use std::sync::Arc;

/// The usual speed of a vehicle unless the file says so, m/s.
const SPEED_MPS: f64 = 6.0;

/// Most vehicles of a scenario: each look of each UAV asks for all of them.
const MOST: u16 = 256;

/// How much faster and slower than said the fastest and the slowest of several of a kind are.
const SPREAD: f64 = 0.2;

/// Who is parked has a road that it never drives, metres.
const PARKED_ROAD_M: f64 = 300.0;

/// What a vehicle looks like unless the file says so.
const KIND: u8 = 1;

/// Reads `vehicles`.
pub(crate) fn read(
    list: &Node<'_>,
    (origin, files): (Origin, &Files<'_>),
    notices: &mut Notices,
) -> Result<Vec<VehicleSpec>, Error> {
    let one = |item: &Node<'_>, notices: &mut Notices| {
        let f = item.fields(&[
            "way_m",
            "ways_m",
            "streets",
            "places_m",
            "count",
            "start",
            "speed_mps",
            "does",
            "kind",
            "colour",
            "confused",
        ])?;
        if let Some(list) = f.get("places_m") {
            return parked(&f, list);
        }
        let roads = match (f.get("way_m"), f.get("ways_m"), f.get("streets")) {
            (Some(way), None, None) => of_ways(way, &[places(way)?])?,
            (None, Some(typed), None) => of_ways(typed, &ways(typed)?)?,
            (None, None, Some(file)) => of_file(file, (origin, files), notices)?,
            _ => {
                return Err(item.wrong(
                    "expected either way_m: [[0, 0], [400, 0]], ways_m: [[[0, 0], [400, 0]], [[400, 0], [400, 200]]] or streets: \"roads.geojson\"",
                ));
            }
        };
        let start = f
            .get("start")
            .map(|s| position(&s.fields(&["east_m", "north_m"])?));
        let vehicle = VehicleSpec {
            roads: Arc::new(roads),
            // A way begins where it begins; among streets any place will do.
            start: start.transpose()?.or(first_of(&f)?),
            behaviour: f.get("does").map_or(Ok(Behaviour::Drives), does)?,
            speed_mps: f.number_or("speed_mps", SPEED_MPS, 0.0, 40.0, "m/s")?,
            kind: kind(&f)?,
            confused_permille: confused(&f)?,
        };
        let n = f.small_or("count", 1, 1, MOST, "vehicles")?;
        if n > 1 && vehicle.start.is_some() {
            let text =
                "they would all begin at one place; leave start and count out, or take streets";
            return Err(item.wrong(text));
        }
        Ok(spread(vehicle, n))
    };
    let mut all = Vec::new();
    for item in list.items()? {
        all.extend(one(&item, notices)?);
    }
    if all.len() > usize::from(MOST) {
        return Err(list.wrong(format!("are {}; expected {MOST} at most", all.len())));
    }
    Ok(all)
}

/// Several of a kind, their usual speeds spread evenly: no two drive side by side for long.
fn spread(vehicle: VehicleSpec, n: u16) -> Vec<VehicleSpec> {
    let mut all = vec![vehicle; usize::from(n)];
    for (i, v) in (0..n).zip(&mut all) {
        let along = if n > 1 {
            2.0 * f64::from(i) / f64::from(n - 1) - 1.0
        } else {
            0.0
        };
        v.speed_mps *= 1.0 + SPREAD * along;
    }
    all
}

/// Vehicles that are parked, one at each of some places.
fn parked(f: &Fields<'_>, list: &Node<'_>) -> Result<Vec<VehicleSpec>, Error> {
    for name in [
        "way_m",
        "ways_m",
        "streets",
        "start",
        "speed_mps",
        "does",
        "count",
    ] {
        if let Some(node) = f.get(name) {
            return Err(
                node.wrong("who is parked at one of places_m does nothing else; leave it out")
            );
        }
    }
    let (kind, confused_permille) = (kind(f)?, confused(f)?);
    let one = |at: Point| {
        let road = vec![at, at + Vector::new(PARKED_ROAD_M, 0.0)];
        let roads = Roads::of(&[road]).ok_or_else(|| list.wrong("is no place to stand at"))?;
        Ok(VehicleSpec {
            roads: Arc::new(roads),
            start: Some(at),
            behaviour: Behaviour::Parked,
            speed_mps: 0.0,
            kind,
            confused_permille,
        })
    };
    places(list)?.into_iter().map(one).collect()
}

fn confused(f: &Fields<'_>) -> Result<u16, Error> {
    let share = f.number_or("confused", 0.0, 0.0, 0.5, "of the looks")?;
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most 500"
    )]
    let permille = (share * 1000.0).round() as u16;
    Ok(permille)
}

/// What a vehicle looks like: by its number, or by its name.
pub(super) fn looks(node: &Node<'_>) -> Result<u8, Error> {
    if let Ok(name) = node.text() {
        let found = LOOKS.iter().position(|l| *l == name);
        let found = found.and_then(|n| u8::try_from(n).ok());
        return found.ok_or_else(|| {
            let known = suggestion(name, &LOOKS);
            node.wrong(format!("no vehicle is a \"{name}\"; {known}"))
        });
    }
    let most = u16::from(KINDS) - 1;
    let kind = node.small(0, most, "the kind of a vehicle")?;
    Ok(u8::try_from(kind).unwrap_or(KIND))
}

/// The colour of a vehicle by its name, from 1 on.
pub(super) fn colour(node: &Node<'_>) -> Result<u8, Error> {
    let name = node.text()?;
    let found = COLOURS.iter().position(|c| *c == name);
    let found = found.and_then(|n| u8::try_from(n + 1).ok());
    found.ok_or_else(|| {
        let known = suggestion(name, &COLOURS);
        node.wrong(format!("no vehicle is \"{name}\"; {known}"))
    })
}

fn kind(f: &Fields<'_>) -> Result<u8, Error> {
    let kind = f.get("kind").map_or(Ok(KIND), looks)?;
    let colour = f.get("colour").map_or(Ok(0), colour)?;
    Ok(coloured(kind, colour))
}

fn does(node: &Node<'_>) -> Result<Behaviour, Error> {
    node.one_of(&[
        ("drives", Behaviour::Drives),
        ("stops-and-goes", Behaviour::StopsAndGoes),
        ("evades", Behaviour::Evades),
        ("parked", Behaviour::Parked),
    ])
}

fn first_of(f: &Fields<'_>) -> Result<Option<Point>, Error> {
    let way = f.get("way_m").map(places).transpose()?;
    Ok(way.and_then(|way| way.first().copied()))
}

fn of_ways(way: &Node<'_>, lines: &[Vec<Point>]) -> Result<Roads, Error> {
    Roads::of(lines)
        .ok_or_else(|| way.wrong("is no road to drive on; expected 200 m of it at least"))
}

fn of_file(
    node: &Node<'_>,
    whence: (Origin, &Files<'_>),
    notices: &mut Notices,
) -> Result<Roads, Error> {
    let name = node.text()?;
    let lines = lines_of(node, whence, notices)?;
    Roads::of(&lines).ok_or_else(|| {
        node.wrong(format!(
            "{name} has no streets that hang together; expected 200 m of them at least"
        ))
    })
}

#[cfg(test)]
mod tests {
    use crate::read::testing::default_with;

    /// The default scenario with these vehicles.
    fn with(vehicles: &str) -> Result<crate::Scenario, String> {
        default_with("vehicles", vehicles)
    }

    #[test]
    fn vehicles_are_read_or_refused_with_place_and_remedy() {
        let read = with(
            "[{ way_m: [[0, 0], [300, 0]], does: 'parked' }, { streets: '../data/helsinki_roads.geojson', start: { east_m: 200, north_m: 200 }, speed_mps: 9, kind: 2 }]",
        );
        let vehicles = read.unwrap().spec.vehicles;
        assert_eq!(vehicles.len(), 2);
        assert!(vehicles[0].start.is_some_and(|p| p.coords.norm() < 1e-9));
        assert_eq!((vehicles[1].speed_mps, vehicles[1].kind), (9.0, 2));
        let many = with(
            "[{ ways_m: [[[0, 0], [200, 0]], [[200, 0], [200, 90]]], count: 5 }, { places_m: [[10, 20], [30, 20]], kind: 'bus' }]",
        );
        let many = many.unwrap().spec.vehicles;
        assert_eq!(many.len(), 7);
        assert_eq!(
            many[6].behaviour,
            skein_netsim::pursuit::vehicle::Behaviour::Parked
        );
        for (text, why) in [
            ("[{ speed_mps: 5 }]", "expected either way_m"),
            ("[{ way_m: [[0, 0], [300, 0]], count: 3 }]", "at one place"),
            ("[{ places_m: [[0, 0]], does: 'drives' }]", "leave it out"),
            (
                "[{ streets: '../data/helsinki_roads.geojson', count: 200 }, { streets: '../data/helsinki_roads.geojson', count: 200 }]",
                "expected 256 at most",
            ),
            ("[{ way_m: [[0, 0], [50, 0]] }]", "200 m of it at least"),
            (
                "[{ way_m: [[0, 0], [500, 0]], does: 'flies' }]",
                "vehicles[0].does",
            ),
            ("[{ way_m: [[0, 0], [500]] }]", "expected [east, north]"),
            ("[{ streets: 'none.geojson' }]", "cannot read none.geojson"),
        ] {
            let said = with(text).unwrap_err();
            assert!(said.contains(why), "{said}");
        }
    }
}
