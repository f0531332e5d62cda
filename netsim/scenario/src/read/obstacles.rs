//! Obstacles of a scenario that are on no map: cranes, masts, tethered balloons.

use super::shared::position;
use skein_interop::json::{Error, Node};
use skein_netsim::spec::{ObstaclePlace, ObstacleSpec};

/// Most of a scenario.
const MOST: usize = 12;

/// How wide one is unless the file says so, metres.
const RADIUS_M: f64 = 10.0;

/// Reads `obstacles`.
pub(crate) fn read(list: &Node<'_>) -> Result<Vec<ObstacleSpec>, Error> {
    let items = list.items()?;
    if items.len() > MOST {
        return Err(list.wrong(format!("are {}; expected {MOST} at most", items.len())));
    }
    items.iter().map(one).collect()
}

fn one(item: &Node<'_>) -> Result<ObstacleSpec, Error> {
    let f = item.fields(&["east_m", "north_m", "radius_m", "within"])?;
    let is_placed = f.get("east_m").or(f.get("north_m")).is_some();
    let place = match f.get("within") {
        None if is_placed => ObstaclePlace::At(position(&f)?),
        Some(circle) if !is_placed => {
            let circle = circle.fields(&["east_m", "north_m", "radius_m"])?;
            ObstaclePlace::Within {
                middle: position(&circle)?,
                radius_m: circle
                    .need("radius_m", "400")?
                    .number(0.0, 20_000.0, "metres")?,
            }
        }
        _ => {
            return Err(item.wrong(
                "expected either east_m and north_m or within: { east_m: 0, north_m: 0, radius_m: 400 }, where the seed draws a place",
            ));
        }
    };
    Ok(ObstacleSpec {
        radius_m: f.number_or("radius_m", RADIUS_M, 0.1, 400.0, "metres")?,
        place,
    })
}

#[cfg(test)]
mod tests {
    use crate::read::testing::default_with;
    use skein_netsim::spec::ObstaclePlace;

    fn with(obstacles: &str) -> Result<crate::Scenario, String> {
        default_with("obstacles", obstacles)
    }

    #[test]
    fn obstacles_are_read_or_refused_with_place_and_remedy() {
        let read = with(
            "[{ east_m: 700, north_m: 300 }, { radius_m: 4, within: { east_m: 500, north_m: 500, radius_m: 300 } }]",
        );
        let spec = read.map_err(drop).unwrap().spec;
        assert!(spec.mission.finds_obstacles);
        assert!(spec.obstacle_range_m > 100.0, "{}", spec.obstacle_range_m);
        let [first, second] = &spec.obstacles[..] else {
            panic!("{:?}", spec.obstacles)
        };
        assert!(matches!(first.place, ObstaclePlace::At(_)));
        assert!(matches!(second.place, ObstaclePlace::Within { .. }));
        assert!(!with("[]").unwrap().spec.mission.finds_obstacles);
        for (text, place, told) in [
            ("[{ radius_m: 5 }]", "obstacles[0]", "either east_m"),
            ("[{ east_m: 5 }]", "obstacles[0]", "north_m"),
            (
                "[{ east_m: 5, north_m: 5, radius_m: 0 }]",
                "obstacles[0].radius_m",
                "between 0.1",
            ),
            (
                "[{ east_m: 5, north_m: 5, within: { east_m: 5, north_m: 5, radius_m: 9 } }]",
                "obstacles[0]",
                "either east_m",
            ),
            (
                "[{ east_m: 5, north_m: 5, height_m: 30 }]",
                "obstacles[0]",
                "height_m",
            ),
        ] {
            let error = with(text).map(drop).unwrap_err();
            assert!(
                error.contains(place) && error.contains(told),
                "{text}: {error}"
            );
        }
    }

    #[test]
    fn where_uavs_start_nothing_stands() {
        let launch = with("[]").map_err(drop).unwrap().spec.uavs[0].launch;
        let (east_m, north_m) = (launch.east_m + 80.0, launch.north_m);
        let text = format!("[{{ east_m: {east_m:.1}, north_m: {north_m:.1} }}]");
        let error = with(&text).map(drop).unwrap_err();
        let told = "obstacles[0]: its edge is 70.0 m from the launch place of uav1";
        assert!(error.contains(told), "{error}");
    }
}
