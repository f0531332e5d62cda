//! Services on the ground of a scenario (D2.7 §3.7: until ground services reach it): from where
//! they go to what is to be followed, how fast, and along which streets.

use super::shared::{Notices, lines_of, position, ways};
use crate::files::Files;
use skein_flight::streets::Network;
use skein_geometry::frame::{Origin, Point};
use skein_interop::json::{Error, Node};
use skein_netsim::spec::ServiceSpec;
use std::sync::Arc;

/// How fast a unit goes unless the file says so, m/s.
const SPEED_MPS: f64 = 12.0;

/// Most units of a scenario.
const MOST: usize = 16;

/// The longest network along which they go, in stretches.
const STRETCHES_MAX: usize = 10_000;

/// Reads `services`.
pub(crate) fn read(
    list: &Node<'_>,
    whence: (Origin, &Files<'_>),
    ground: Option<u16>,
    notices: &mut Notices,
) -> Result<Vec<ServiceSpec>, Error> {
    let mut all = Vec::new();
    if ground.is_none() {
        return Err(list.wrong("there is no ground station to call them"));
    }
    for item in list.items()? {
        let f = item.fields(&["base", "speed_mps", "ways_m", "streets"])?;
        let base = f.need("base", "{ east_m: 0, north_m: 0 }")?;
        let lines = match (f.get("ways_m"), f.get("streets")) {
            (None, None) => None,
            (Some(typed), None) => Some((typed, ways(typed)?)),
            (None, Some(file)) => Some((file, lines_of(file, whence, notices)?)),
            (Some(_), Some(file)) => {
                return Err(file.wrong("expected one of ways_m and streets, or neither"));
            }
        };
        let streets = lines
            .map(|(node, lines)| network(node, lines))
            .transpose()?;
        all.push(ServiceSpec {
            base: position(&base.fields(&["east_m", "north_m"])?)?,
            speed_mps: f.number_or("speed_mps", SPEED_MPS, 0.5, 40.0, "m/s")?,
            streets: streets.map(Arc::new),
        });
    }
    if all.len() > MOST {
        return Err(list.wrong(format!("are {}; expected {MOST} at most", all.len())));
    }
    Ok(all)
}

fn network(node: &Node<'_>, lines: Vec<Vec<Point>>) -> Result<Network, Error> {
    let lines: Vec<(u16, Vec<Point>)> = lines.into_iter().map(|way| (0, way)).collect();
    let net = Network::of(&lines);
    match net.edges().len() {
        0 => Err(node.wrong("has no streets to go along; expected 25 m of them at least")),
        n if n > STRETCHES_MAX => Err(node.wrong(format!(
            "has {n} stretches of streets; expected {STRETCHES_MAX} at most"
        ))),
        _ => Ok(net),
    }
}

#[cfg(test)]
mod tests {
    use crate::read::testing::default_with;

    fn with(services: &str) -> Result<crate::Scenario, String> {
        default_with("services", services)
    }

    #[test]
    fn services_are_read_or_refused_with_place_and_remedy() {
        let read = with(
            "[{ base: { east_m: 10, north_m: 20 } }, { base: { east_m: 0, north_m: 0 }, speed_mps: 2, ways_m: [[[0, 0], [400, 0]]] }]",
        );
        let services = read.unwrap().spec.services;
        assert_eq!(services.len(), 2);
        assert!(services[0].streets.is_none() && (services[0].speed_mps - 12.0).abs() < 1e-9);
        assert!(services[1].streets.is_some() && (services[1].speed_mps - 2.0).abs() < 1e-9);
        for (text, place, told) in [
            ("[{}]", "services[0]", "base"),
            ("[{ base: { east_m: 1 } }]", "services[0].base", "north_m"),
            (
                "[{ base: { east_m: 0, north_m: 0 }, speed_mps: 0 }]",
                "services[0].speed_mps",
                "0.5",
            ),
            (
                "[{ base: { east_m: 0, north_m: 0 }, ways_m: [[[0, 0], [4, 0]]] }]",
                "services[0].ways_m",
                "no streets",
            ),
            (
                "[{ base: { east_m: 0, north_m: 0 }, ways_m: [], streets: \"a.geojson\" }]",
                "services[0].streets",
                "one of",
            ),
            (
                "[{ base: { east_m: 0, north_m: 0 }, colour: \"red\" }]",
                "services[0]",
                "colour",
            ),
        ] {
            let error = with(text).unwrap_err();
            assert!(
                error.contains(place) && error.contains(told),
                "{text}: {error}"
            );
        }
    }
}
