//! The buildings that a mission tells its UAVs (D2.7 §3.7.1): `mission.buildings`.

use super::fleet::Fleet;
use super::shared::Notices;
use super::terrain::{self, Terrain, hull};
use crate::files::Files;
use skein_flight::tracking::buildings::MIDDLE_M;
use skein_geometry::Polygon;
use skein_geometry::frame::Point;
use skein_geometry::polygon::line_to_line_m;
use skein_interop::json::{Error, Node};
use skein_netsim::spec;
use skein_peer::buildings::{Building, Buildings, PointDm};
use std::sync::Arc;

/// Reads `mission.buildings`: those of the scenario, or of a file, as far as one of them can stand
/// between a UAV and a target in the area.
pub(crate) fn of_mission(
    mission: &Node<'_>,
    (terrain, fleet): (&Terrain, &Fleet),
    files: &Files<'_>,
    notices: &mut Notices,
) -> Result<Option<Arc<Buildings>>, Error> {
    let Some(node) = mission.get("buildings")? else {
        return Ok(None);
    };
    let known = match node.flag() {
        Ok(false) => return Ok(None),
        Ok(true) if terrain.buildings.is_empty() => {
            return Err(node.wrong(
                "the scenario has no buildings; expected buildings: { file: \"buildings.geojson\" } beside mission, or in it",
            ));
        }
        Ok(true) => terrain.buildings.clone(),
        Err(_) => terrain::buildings(&node, terrain.origin, files, notices)?,
    };
    let reach_m = camera_reach_m(fleet);
    let near = |b: &&spec::Building| is_within(&b.footprint, &terrain.area, reach_m);
    let near = known.iter().filter(|b| b.height_m > MIDDLE_M).filter(near);
    let mut all = Vec::new();
    let mut small = 0_usize;
    for building in near {
        match outline(&building.footprint) {
            Some(ring) => all.push(Building {
                roof_dm: dm_up(building.height_m),
                ring,
            }),
            None => small += 1,
        }
    }
    let told = Buildings { all };
    told.check().map_err(|why| node.wrong(why))?;
    let mut said = format!(
        "{} of {} buildings are told, {} corners in {} bytes: those that are nearer to the area than {reach_m:.0} m, as far as its cameras see",
        told.all.len(),
        known.len(),
        told.corners(),
        told.bytes()
    );
    if small > 0 {
        said = format!("{said}; {small} are smaller than a few decimetres");
    }
    notices.push((node.path(), said));
    Ok(Some(Arc::new(told)))
}

/// How far away over the ground a camera of the fleet sees anything, metres.
fn camera_reach_m(fleet: &Fleet) -> f64 {
    let corner_m = |a: &skein_flight::airframe::Airframe| {
        let (across_m, along_m) = (a.footprint_across_m, a.footprint_along_m);
        (across_m * across_m + along_m * along_m).sqrt()
    };
    let members = fleet.members.iter();
    members.map(|m| corner_m(&m.airframe)).fold(0.0, f64::max)
}

/// Whether something of a footprint is within so many metres of an area.
fn is_within(footprint: &Polygon, area: &Polygon, reach_m: f64) -> bool {
    let touches = || footprint.vertices().iter().any(|p| area.contains(*p));
    let covers = || area.vertices().iter().any(|p| footprint.contains(*p));
    let near = || {
        footprint.edges().any(|(a, b)| {
            area.edges()
                .any(|(c, d)| line_to_line_m(a, b, c, d) <= reach_m)
        })
    };
    touches() || covers() || near()
}

/// An outline in whole decimetres; its hull where rounding breaks it, and none where nothing is
/// left.
fn outline(footprint: &Polygon) -> Option<Vec<PointDm>> {
    let rounded = |points: &[Point]| {
        let mut ring: Vec<PointDm> = points.iter().map(|p| (dm(p.x), dm(p.y))).collect();
        ring.dedup();
        while ring.len() > 1 && ring.first() == ring.last() {
            ring.pop();
        }
        let building = Building { roof_dm: 1, ring };
        building.footprint().is_some().then_some(building.ring)
    };
    let points = footprint.vertices();
    rounded(points).or_else(|| rounded(&hull(points.to_vec())))
}

#[allow(
    clippy::cast_possible_truncation,
    reason = "a cast of a float saturates, and what is told is checked"
)]
fn dm(m: f64) -> i32 {
    (m * 10.0).round() as i32
}

/// A roof, rounded up: what is taken to be hidden is looked at from elsewhere.
fn dm_up(m: f64) -> u16 {
    u16::try_from(dm(m + 0.049)).unwrap_or(u16::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read::testing::mission_of;
    use skein_peer::library::{Library, chunks};

    const TOWN: &str = "{ file: '../data/helsinki_buildings.geojson', default_storeys: 2 }";

    #[test]
    fn buildings_are_told_where_they_are_asked_for_and_come_through_the_radio() {
        assert_eq!(
            mission_of("{ diagram: 'coverage' }").unwrap().buildings,
            None
        );
        assert_eq!(mission_of("{ buildings: false }").unwrap().buildings, None);
        let mission = mission_of("{ buildings: true }").unwrap();
        let told = mission.buildings.clone().unwrap();
        assert!(told.all.len() > 100 && told.corners() > 1_000);
        // A square kilometre of a town takes less than half of what a mission may have.
        assert!(told.bytes() < 28_000, "{}", told.bytes());
        let mut library = Library::new(None);
        for (i, piece) in (0u16..).zip(&chunks(&mission).unwrap()) {
            library.chunk(i, piece).unwrap();
        }
        assert_eq!(library.newest(), Some(mission));
        // Those of another file, with other heights.
        let other = mission_of(&format!("{{ buildings: {TOWN} }}")).unwrap();
        let lower = |b: &Buildings| b.all.iter().map(|b| u32::from(b.roof_dm)).sum::<u32>();
        assert!(lower(&other.buildings.clone().unwrap()) < lower(&told));
    }

    #[test]
    fn what_is_no_building_is_refused_with_place() {
        for (buildings, why) in [
            ("{ }", "mission.buildings"),
            ("'all'", "mission.buildings"),
            ("{ file: 'none.geojson' }", "cannot read none.geojson"),
        ] {
            let said = mission_of(&format!("{{ buildings: {buildings} }}")).unwrap_err();
            assert!(said.contains(why), "{said}");
        }
        let files = crate::builtin::files();
        let text = include_str!("../../../../configs/trials/track.json5");
        let text = text.replacen("faults:", "mission: { buildings: true }, faults:", 1);
        let over = crate::Overrides::default();
        let said = crate::parse_with("s.json5", &text, &files, &over).unwrap_err();
        assert!(said.to_string().contains("has no buildings"), "{said}");
    }

    fn square(west_m: f64, side_m: f64) -> Polygon {
        let ring = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        let corner = |(x, y): (f64, f64)| Point::new(west_m + x * side_m, y * side_m);
        Polygon::new(ring.map(corner).to_vec()).unwrap()
    }

    #[test]
    fn only_what_cameras_reach_is_told_and_what_rounding_breaks_is_its_hull() {
        let area = square(0.0, 100.0);
        for (west_m, side_m, is_near) in [
            (140.0, 10.0, true),
            (160.0, 10.0, false),
            (40.0, 10.0, true),
            (-50.0, 900.0, true),
            (-165.0, 10.0, false),
        ] {
            let building = square(west_m, side_m);
            assert_eq!(is_within(&building, &area, 50.0), is_near, "{west_m}");
        }
        assert_eq!(outline(&square(0.02, 0.01)), None);
        let ring = outline(&square(10.04, 2.0)).unwrap();
        assert_eq!(ring, [(100, 0), (120, 0), (120, 20), (100, 20)]);
        // A slit of a centimetre closes.
        let slit = [
            (0.0, 0.0),
            (9.0, 0.0),
            (9.0, 4.0),
            (1.0, 4.0),
            (1.0, 4.01),
            (9.0, 4.01),
            (9.0, 9.0),
            (0.0, 9.0),
        ];
        let slit = Polygon::new(slit.map(|(x, y)| Point::new(x, y)).to_vec()).unwrap();
        assert_eq!(outline(&slit).unwrap().len(), 4);
        assert_eq!((dm_up(30.0), dm_up(30.01), dm_up(29.96)), (300, 301, 300));
    }
}
