//! Vehicles on the ground of a scenario (D2.7 §1.5.2): on which roads, from where, how fast,
//! and what they do.

use super::shared::{Notices, position};
use crate::files::Files;
use skein_geometry::frame::{MAX_MISSION_RADIUS_M, Origin, Point};
use skein_interop::json::{Error, Fields, Node, suggestion};
use skein_interop::place::to_plane;
use skein_interop::targets;
use skein_netsim::pursuit::KINDS;
use skein_netsim::pursuit::roads::Roads;
use skein_netsim::pursuit::vehicle::Behaviour;
use skein_netsim::spec::VehicleSpec;
use skein_peer::criteria::LOOKS;
use std::sync::Arc;

/// The usual speed of a vehicle unless the file says so, m/s.
const SPEED_MPS: f64 = 6.0;

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
            "streets",
            "start",
            "speed_mps",
            "does",
            "kind",
            "confused",
        ])?;
        let roads = match (f.get("way_m"), f.get("streets")) {
            (Some(way), None) => of_way(way)?,
            (None, Some(file)) => of_file(file, (origin, files), notices)?,
            _ => {
                return Err(item.wrong(
                    "expected either way_m: [[0, 0], [400, 0]] or streets: \"roads.geojson\"",
                ));
            }
        };
        let start = f
            .get("start")
            .map(|s| position(&s.fields(&["east_m", "north_m"])?));
        Ok(VehicleSpec {
            roads: Arc::new(roads),
            // A way begins where it begins; among streets any place will do.
            start: start.transpose()?.or(first_of(&f)?),
            behaviour: f.get("does").map_or(Ok(Behaviour::Drives), does)?,
            speed_mps: f.number_or("speed_mps", SPEED_MPS, 0.0, 40.0, "m/s")?,
            kind: kind(&f)?,
            confused_permille: confused(&f)?,
        })
    };
    list.items()?
        .iter()
        .map(|item| one(item, notices))
        .collect()
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

fn kind(f: &Fields<'_>) -> Result<u8, Error> {
    f.get("kind").map_or(Ok(KIND), looks)
}

fn does(node: &Node<'_>) -> Result<Behaviour, Error> {
    node.one_of(&[
        ("drives", Behaviour::Drives),
        ("stops-and-goes", Behaviour::StopsAndGoes),
        ("evades", Behaviour::Evades),
        ("parked", Behaviour::Parked),
    ])
}

fn places(way: &Node<'_>) -> Result<Vec<Point>, Error> {
    let far = |n: &Node<'_>| {
        n.number(
            -MAX_MISSION_RADIUS_M,
            MAX_MISSION_RADIUS_M,
            "metres from the origin",
        )
    };
    let place = |n: &Node<'_>| match &n.items()?[..] {
        [east, north] => Ok(Point::new(far(east)?, far(north)?)),
        _ => Err(n.wrong("expected [east, north] in metres")),
    };
    way.items()?.iter().map(place).collect()
}

fn first_of(f: &Fields<'_>) -> Result<Option<Point>, Error> {
    let way = f.get("way_m").map(places).transpose()?;
    Ok(way.and_then(|way| way.first().copied()))
}

fn of_way(way: &Node<'_>) -> Result<Roads, Error> {
    Roads::of(&[places(way)?])
        .ok_or_else(|| way.wrong("is no road to drive on; expected 200 m of it at least"))
}

fn of_file(
    node: &Node<'_>,
    (origin, files): (Origin, &Files<'_>),
    notices: &mut Notices,
) -> Result<Roads, Error> {
    let name = node.text()?;
    let found =
        targets::read(&files.read(node)?).map_err(|e| node.wrong(e.in_file(name).to_string()))?;
    notices.extend(found.notices.iter().map(|n| {
        let said = format!("{name}: at {}: {}", n.pointer, n.text);
        (node.path(), said)
    }));
    let line = |l: &targets::LineTarget| {
        let way = l.way.iter().map(|p| to_plane(origin, *p));
        let way: Result<Vec<Point>, _> = way.collect();
        way.map_err(|e| node.wrong(format!("{name}: at {}: {e}", l.pointer)))
    };
    let lines: Vec<Vec<Point>> = found.lines.iter().map(line).collect::<Result<_, _>>()?;
    Roads::of(&lines).ok_or_else(|| {
        node.wrong(format!(
            "{name} has no streets that hang together; expected 200 m of them at least"
        ))
    })
}

#[cfg(test)]
mod tests {
    use crate::Overrides;

    /// The default scenario with these vehicles.
    fn with(vehicles: &str) -> Result<crate::Scenario, String> {
        let text = include_str!("../../../../configs/trials/helsinki.json5");
        let text = text.replacen("vehicles: [],", &format!("vehicles: {vehicles},"), 1);
        let files = crate::builtin::files();
        crate::parse_with("s.json5", &text, &files, &Overrides::default())
            .map_err(|e| e.to_string())
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
        for (text, why) in [
            ("[{ speed_mps: 5 }]", "expected either way_m"),
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
