//! Aircraft of a scenario that are no members of the fleet: they say nothing, and make way for
//! nobody.

use super::shared::{places, position};
use skein_interop::json::{Error, Node};
use skein_netsim::spec::{IntruderSpec, IntruderWay};

/// Most of a scenario.
const MOST: usize = 16;

/// How fast one flies unless the file says so, m/s.
const SPEED_MPS: f64 = 30.0;

/// Reads `intruders`.
pub(crate) fn read(list: &Node<'_>) -> Result<Vec<IntruderSpec>, Error> {
    let items = list.items()?;
    if items.len() > MOST {
        return Err(list.wrong(format!("are {}; expected {MOST} at most", items.len())));
    }
    items.iter().enumerate().map(one).collect()
}

fn one((n, item): (usize, &Node<'_>)) -> Result<IntruderSpec, Error> {
    let f = item.fields(&[
        "name",
        "at_s",
        "every_s",
        "speed_mps",
        "height_m",
        "way_m",
        "over",
    ])?;
    let name = f
        .get("name")
        .map_or_else(|| Ok(format!("intruder-{n}")), Node::word)?;
    let way = match (f.get("way_m"), f.get("over")) {
        (Some(way), None) => IntruderWay::Places(places(way)?),
        (None, Some(circle)) => {
            let circle = circle.fields(&["east_m", "north_m", "radius_m"])?;
            IntruderWay::Over {
                middle: position(&circle)?,
                radius_m: circle
                    .need("radius_m", "400")?
                    .number(0.0, 20_000.0, "metres")?,
            }
        }
        _ => {
            return Err(item.wrong(
                "expected either way_m: [[-900, 200], [900, 250]] or over: { east_m: 0, north_m: 0, radius_m: 400 }, each time on another course over that",
            ));
        }
    };
    let seconds = |node: &Node<'_>| -> Result<u64, Error> {
        Ok(1_000 * u64::from(node.whole(0, 100_000, "seconds")?))
    };
    let every_ms = f
        .get("every_s")
        .map(|node| match seconds(node)? {
            0 => Err(node.wrong("expected a second at least, or leave it out: then it comes once")),
            ms => Ok(ms),
        })
        .transpose()?;
    Ok(IntruderSpec {
        name,
        from_ms: f.get("at_s").map_or(Ok(0), seconds)?,
        every_ms,
        speed_mps: f.number_or("speed_mps", SPEED_MPS, 1.0, 300.0, "m/s")?,
        height_m: f.need("height_m", "100")?.number(0.0, 20_000.0, "metres")?,
        way,
    })
}

#[cfg(test)]
mod tests {
    use crate::read::testing::default_with;
    use skein_netsim::spec::IntruderWay;

    fn with(intruders: &str) -> Result<crate::Scenario, String> {
        default_with("intruders", intruders)
    }

    #[test]
    fn intruders_are_read_or_refused_with_place_and_remedy() {
        let read = with(
            "[{ height_m: 60, way_m: [[0, 0], [900, 0]] }, { name: 'helicopter', at_s: 30, every_s: 60, speed_mps: 40, height_m: 80, over: { east_m: 5, north_m: 6, radius_m: 300 } }]",
        );
        let all = read.unwrap().spec;
        assert!(all.traffic_range_m > 500.0, "{}", all.traffic_range_m);
        let [first, second] = &all.intruders[..] else {
            panic!("{:?}", all.intruders)
        };
        assert_eq!((first.name.as_str(), first.every_ms), ("intruder-0", None));
        assert!(matches!(&first.way, IntruderWay::Places(p) if p.len() == 2));
        assert_eq!((second.from_ms, second.every_ms), (30_000, Some(60_000)));
        for (text, place, told) in [
            (
                "[{ way_m: [[0, 0], [900, 0]] }]",
                "intruders[0]",
                "height_m",
            ),
            ("[{ height_m: 60 }]", "intruders[0]", "either way_m"),
            (
                "[{ height_m: 60, way_m: [[0, 0], [9, 0]], every_s: 0 }]",
                "intruders[0].every_s",
                "comes once",
            ),
            (
                "[{ height_m: 60, way_m: [[0, 0], [9, 0]], speed_mps: 0 }]",
                "intruders[0].speed_mps",
                "between 1",
            ),
            (
                "[{ height_m: 60, way_m: [[0, 0], [9, 0]], colour: 'red' }]",
                "intruders[0]",
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
