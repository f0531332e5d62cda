//! Scenes from scenarios and missions, and the geometry of frames.

use crate::model::scene::{Bounds, Building, Cell, Driver, Scene, Sensor, Station, Uav, Zone};
use crate::model::{MODEL_VERSION, Place, Ring, rounded};
use skein_flight::coverage::ring::patch::middle;
use skein_geometry::frame::{Origin, Point};
use skein_netsim::account::{Setting, lifetimes::Lifetimes, text::name};
use skein_netsim::spec::Spec;
use skein_netsim::world::World;
use skein_peer::Mission;
use skein_peer::offload::MissionGeometry;
use std::sync::Arc;

/// Where the plane of a mission touches the earth.
pub(crate) fn origin(mission: &Mission) -> Origin {
    Origin {
        lat_deg: f64::from(mission.origin_lat_e7) / 1e7,
        lon_deg: f64::from(mission.origin_lon_e7) / 1e7,
    }
}

/// The scene of a scenario before anything happens.
pub(crate) fn scene(
    spec: &Spec,
    geometry: Option<&Arc<MissionGeometry>>,
    seed: u64,
    driver: Driver,
) -> Scene {
    let origin = origin(&spec.mission);
    let place = |p: Point| Place::of(&origin, p);
    let uav = |u: &skein_netsim::spec::UavSpec| Uav {
        id: u.id,
        name: name(u.id, true),
        airspeed_mps: rounded(u.airframe.cruise_mps, 1e3),
        height_m: rounded(u.height_m, 1e3),
        sensor: Sensor {
            half_across_m: rounded(u.airframe.footprint_across_m, 1e3),
            half_along_m: rounded(u.airframe.footprint_along_m, 1e3),
        },
        launch: place(u.launch.position()),
        takeoff_ms: u64::from(u.takeoff_ms),
        endurance_s: rounded(u.airframe.endurance_s, 1e1),
    };
    let building = |b: &skein_netsim::spec::Building| Building {
        ring: Ring::of(&origin, b.footprint.vertices()),
        height_m: rounded(b.height_m, 1e3),
    };
    let mut scene = Scene {
        model_version: MODEL_VERSION,
        program_version: env!("CARGO_PKG_VERSION").to_owned(),
        scenario: spec.name.clone(),
        fleet: spec.fleet.clone(),
        seed,
        driver,
        origin: place(Point::origin()),
        buildings: spec.buildings.iter().map(building).collect(),
        ground: spec.ground.as_ref().map(|g| Station {
            id: g.id,
            place: place(g.position),
            height_m: rounded(g.height_m, 1e3),
        }),
        uavs: spec.uavs.iter().map(uav).collect(),
        bounds: bounds(spec, geometry, seed),
        wind_east_mps: rounded(spec.wind.first.east_mps, 1e3),
        wind_north_mps: rounded(spec.wind.first.north_mps, 1e3),
        radio_range_m: rounded(spec.radio.range_m, 1e3),
        ..Scene::default()
    };
    match geometry {
        Some(geometry) => revise(&mut scene, geometry),
        None => give(&mut scene, &spec.mission),
    }
    scene
}

/// The scene of a mission alone, as whoever hears a swarm knows it: without buildings, UAVs and
/// bounds.
#[must_use]
pub fn of_mission(geometry: &MissionGeometry, fleet: &str) -> Scene {
    let mut scene = Scene {
        model_version: MODEL_VERSION,
        program_version: env!("CARGO_PKG_VERSION").to_owned(),
        scenario: fleet.to_owned(),
        fleet: fleet.to_owned(),
        driver: Driver::Live,
        origin: Place::of(&origin(&geometry.mission), Point::origin()),
        ..Scene::default()
    };
    revise(&mut scene, geometry);
    scene
}

/// Puts what a mission says into a scene.
fn give(scene: &mut Scene, mission: &Mission) {
    let origin = origin(mission);
    scene.revision = mission.revision;
    scene.lap = mission.lap;
    scene.area = Ring::of(&origin, &mission.area_m());
    scene.base = Place::of(&origin, mission.base_m());
    let stated = (1..=mission.zones.len()).map(|n| (format!("zone {n}"), false));
    let added = mission.added_zones.keys().map(|name| (name.clone(), true));
    scene.zones = stated
        .chain(added)
        .zip(mission.zones_m())
        .map(|((name, added), ring)| Zone {
            name,
            added,
            ring: Ring::of(&origin, &ring),
        })
        .collect();
}

/// Puts a mission and its cells into a scene.
pub(crate) fn revise(scene: &mut Scene, geometry: &MissionGeometry) {
    let mission = &geometry.mission;
    give(scene, mission);
    let origin = origin(mission);
    let ring = &geometry.coverage_loop;
    scene.loop_hash = format!("{:016x}", ring.hash());
    let cell = |c: &skein_flight::coverage::ring::LoopCell| {
        let corners = ring.patches().corners(c.id);
        let corners = corners.unwrap_or([Point::origin(); 4]);
        Cell {
            ring: Ring::of(&origin, &corners),
            centre: Place::of(&origin, middle(&corners)),
            needed: c.needed,
        }
    };
    scene.cells = ring.cells().iter().map(cell).collect();
}

/// What the makespan may be compared with before anything happens.
fn bounds(spec: &Spec, geometry: Option<&Arc<MissionGeometry>>, seed: u64) -> Bounds {
    let mut lifetimes = Lifetimes::new(&Setting::new(spec, geometry, seed));
    for uav in spec.uavs.iter().filter(|u| u.twin_of.is_none()) {
        lifetimes.started(0, uav.id);
    }
    Bounds {
        work_bound_ms: geometry.and_then(|_| lifetimes.work_bound_ms()),
        failure_free_ms: None,
    }
}

/// Degrees clockwise from north of radians counter-clockwise from east.
#[must_use]
pub fn compass_deg(heading_rad: f64) -> f64 {
    (90.0 - heading_rad.to_degrees()).rem_euclid(360.0)
}

/// East, north and height of each of these UAVs that is in the air, metres.
pub(crate) fn places(world: &World, uavs: &[u16]) -> Vec<(u16, [f64; 3])> {
    let percepts = uavs
        .iter()
        .filter_map(|id| Some((*id, world.percept(*id)?)));
    percepts
        .filter(|(_, p)| p.takes_off_in_ms == 0)
        .map(|(id, p)| (id, [p.pose.east_m, p.pose.north_m, p.height_m]))
        .collect()
}

/// How far from a UAV in the air the nearest other is, metres.
pub(crate) fn nearest_m(id: u16, places: &[(u16, [f64; 3])]) -> Option<f64> {
    let (_, own) = places.iter().find(|(of, _)| *of == id)?;
    let off_m = |(_, other): &(u16, [f64; 3])| {
        let squares = own.iter().zip(other).map(|(a, b)| (a - b) * (a - b));
        squares.sum::<f64>().sqrt()
    };
    let others = places.iter().filter(|(of, _)| *of != id);
    others.map(off_m).min_by(f64::total_cmp)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_are_told_as_a_compass_shows_them() {
        for (rad, deg) in [
            (0.0, 90.0),
            (core::f64::consts::FRAC_PI_2, 0.0),
            (-3.0, 261.887),
        ] {
            assert!((compass_deg(rad) - deg).abs() < 1e-3, "{rad}");
        }
    }

    #[test]
    fn the_nearest_other_is_in_the_air_and_in_space() {
        let places = [
            (1, [0.0, 0.0, 60.0]),
            (2, [3.0, 4.0, 72.0]),
            (4, [100.0, 0.0, 60.0]),
        ];
        assert_eq!(nearest_m(1, &places), Some(13.0));
        assert_eq!(nearest_m(3, &places), None);
        assert_eq!(nearest_m(1, &places[..1]), None);
    }
}
