//! The town of the built-in scenarios, for measurements without a mission: its streets and its
//! buildings (D2.7 §1.5.2). The data and its licence: `configs/data/README.md`.

use crate::builtin::{DEFAULT, data, load_builtin};
use crate::error::ScenarioError;
use crate::request::Overrides;
use skein_geometry::frame::{Origin, Point};
use skein_interop::place::to_plane;
use skein_interop::targets;
use skein_netsim::spec::Building;

/// The file of its streets.
const ROADS: &str = "../data/helsinki_roads.geojson";

/// The origin of the plane, that of the built-in scenarios there.
const ORIGIN: Origin = Origin {
    lat_deg: 60.1655,
    lon_deg: 24.9355,
};

/// Streets and buildings in one plane.
#[derive(Clone, Debug)]
pub struct Town {
    /// The middle lines of its streets.
    pub roads: Vec<Vec<Point>>,
    /// Its buildings.
    pub buildings: Vec<Building>,
}

/// A square kilometre of Helsinki.
///
/// # Errors
/// [`ScenarioError`] when what is built in cannot be read.
pub fn helsinki() -> Result<Town, ScenarioError> {
    let wrong = |problem: String| ScenarioError::Unreadable {
        file: ROADS.to_owned(),
        problem,
    };
    let read = targets::read(&data(ROADS).map_err(wrong)?).map_err(|e| wrong(e.to_string()))?;
    let roads = read.lines.iter().map(|l| {
        let way = l.way.iter().map(|p| to_plane(ORIGIN, *p));
        way.collect::<Result<Vec<Point>, _>>()
            .map_err(|e| wrong(format!("at {}: {e}", l.pointer)))
    });
    Ok(Town {
        roads: roads.collect::<Result<_, _>>()?,
        buildings: load_builtin(DEFAULT, &Overrides::default())?.spec.buildings,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_netsim::pursuit::roads::Roads;

    #[test]
    fn the_town_has_streets_that_hang_together_and_houses_beside_them() {
        let town = helsinki().unwrap();
        let roads = Roads::of(&town.roads).unwrap();
        assert!(roads.len() > 500, "{}", roads.len());
        assert!(town.buildings.len() > 100);
        let in_houses = |p: &Point| town.buildings.iter().any(|b| b.footprint.contains(*p));
        let all: Vec<&Point> = town.roads.iter().flatten().collect();
        let inside = all.iter().filter(|p| in_houses(p)).count();
        assert!(inside * 20 < all.len(), "{inside} of {}", all.len());
    }
}
