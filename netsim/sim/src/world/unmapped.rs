//! Obstacles of a world that no peer has on its map: they stand through all heights, and are sensed
//! by UAVs that are near (D2.7 §1.2.3).
//!
//! # Guarantees
//! Where they stand follows from the scenario and the seed alone.

use super::fact::{Collision, Fact};
use super::obstacles::Place;
use crate::geometry_cache::geometry_of;
use crate::spec::{ObstaclePlace, Spec};
use skein_behaviors::obstacle::Obstacle;
use skein_flight::airframe::Airframe;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::{TAU, seconds, sin_cos};
use skein_geometry::random::SplitMix64;
use skein_geometry::{NoFlyZones, Polygon};
use skein_peer::Mission;
use skein_peer::found_obstacles::MARGIN_DM;
use skein_peer::mission::point_m;
use skein_peer::wire::obstacle::Found;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Until a UAV that senses an obstacle turns, it flies on for so long, seconds.
const REACTION_S: f64 = 3.0;

/// Who took off or got its computer back this short a time ago may not have turned away yet,
/// seconds.
const WARNED_S: f64 = 10.0;

/// A drawn place is tried so often; where none will do there is no obstacle.
const TRIES: u32 = 400;

/// How far a UAV has to sense an obstacle to turn away from it, metres, in a wind of so many m/s.
#[must_use]
pub fn least_range_m(airframe: &Airframe, wind_mps: f64, clearance_m: f64) -> f64 {
    let speed_mps = airframe.cruise_mps + wind_mps;
    let radius_m = speed_mps * speed_mps / (airframe.cruise_mps * airframe.cruise_mps)
        * airframe.min_turn_radius_m();
    speed_mps * REACTION_S + 3.0 * radius_m + clearance_m + f64::from(MARGIN_DM) / 10.0
}

/// All of a world, and how near UAVs came.
#[derive(Clone, Debug)]
pub struct Unmapped {
    all: Arc<[Obstacle]>,
    nearest_m: Option<f64>,
    inside: BTreeSet<(usize, u16)>,
    /// By UAV when it could not turn away last, milliseconds.
    bound_ms: BTreeMap<u16, u64>,
}

impl Unmapped {
    pub(super) fn new(spec: &Spec, seed: u64) -> Self {
        Self {
            all: stand(spec, seed).into(),
            nearest_m: None,
            inside: BTreeSet::new(),
            bound_ms: BTreeMap::new(),
        }
    }

    /// Where they stand.
    #[must_use]
    pub fn all(&self) -> &[Obstacle] {
        &self.all
    }

    /// How near a UAV came to the edge of one, metres; none where there are none, or nobody flew.
    #[must_use]
    pub fn nearest_m(&self) -> Option<f64> {
        self.nearest_m
    }

    /// Whether a place is farther from all of them than so many metres.
    #[must_use]
    pub fn is_clear(&self, at: Point, by_m: f64) -> bool {
        self.all.iter().all(|o| from_edge_m(o, at) > by_m)
    }

    /// Those whose edges a UAV senses, the nearest first; nothing without a sensor.
    #[must_use]
    pub fn sensed(&self, from: Point, range_m: f64) -> Vec<Obstacle> {
        if range_m <= 0.0 {
            return Vec::new();
        }
        let near = self.all.iter().map(|o| (from_edge_m(o, from), *o));
        let mut near: Vec<(f64, Obstacle)> = near.filter(|(m, _)| *m <= range_m).collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near.into_iter().map(|(_, o)| o).collect()
    }

    /// A UAV stands on the ground, or flies its failsafe: it turns away from nothing.
    pub(super) fn is_bound(&mut self, uav: u16, at_ms: u64) {
        if !self.all.is_empty() {
            self.bound_ms.insert(uav, at_ms);
        }
    }

    /// Compares them with all airborne UAVs at one moment.
    pub(super) fn observe(&mut self, at_ms: u64, airborne: &[(u16, Place)], facts: &mut Vec<Fact>) {
        for (n, obstacle) in self.all.iter().enumerate() {
            for (uav, place) in airborne {
                let from_m = from_edge_m(obstacle, place.at);
                self.nearest_m = Some(self.nearest_m.map_or(from_m, |m| m.min(from_m)));
                if from_m > 0.0 {
                    self.inside.remove(&(n, *uav));
                    continue;
                }
                let bound_ms = self.bound_ms.get(uav).copied().unwrap_or(0);
                if self.inside.insert((n, *uav)) {
                    facts.push(Fact::Collided(Collision {
                        at_ms,
                        uav: *uav,
                        obstacle: n,
                        is_free: seconds(at_ms.saturating_sub(bound_ms)) >= WARNED_S,
                    }));
                }
            }
        }
    }
}

fn from_edge_m(o: &Obstacle, at: Point) -> f64 {
    (o.at() - at).norm() - o.radius_m()
}

/// Where those of a scenario stand: drawn ones where UAVs start, land and turn unhindered, and no
/// more of them than leave a mission.
fn stand(spec: &Spec, seed: u64) -> Vec<Obstacle> {
    let mut all = placed(spec, seed);
    let stated = spec.obstacles.iter();
    let stated = stated.filter(|o| matches!(o.place, ObstaclePlace::At(_)));
    let stated = stated.count();
    while all.len() > stated && !is_flown_round(&spec.mission, &all) {
        all.pop();
    }
    all
}

/// Whether there is a mission round all of them.
fn is_flown_round(mission: &Mission, all: &[Obstacle]) -> bool {
    let found = all.iter().map(Found::of);
    let round = mission.with_found(&found.collect());
    let geometry = round.map(|mission| geometry_of(&Arc::new(mission)));
    geometry.is_none_or(|g| g.is_ok_and(|g| g.base_is_clear().is_ok()))
}

fn placed(spec: &Spec, seed: u64) -> Vec<Obstacle> {
    let mission = &spec.mission;
    let turn_m = 2.0 * mission.turn_radius_m() + mission.clearance_m();
    let zones = mission.zones_m().filter_map(|z| Polygon::new(z).ok());
    let zones = NoFlyZones::new(zones.collect());
    let launches = spec.uavs.iter().map(|u| u.launch.position());
    let starts: Vec<Point> = launches.chain([point_m(mission.base)]).collect();
    let stated = spec.obstacles.iter().filter_map(|one| match one.place {
        ObstaclePlace::At(at) => Some(one.standing(at)),
        ObstaclePlace::Within { .. } => None,
    });
    let mut all: Vec<Obstacle> = stated.collect();
    for (n, one) in spec.obstacles.iter().enumerate() {
        if let ObstaclePlace::Within { middle, radius_m } = one.place {
            let mut random = SplitMix64::new(seed ^ ((n as u64) << 40) ^ 0x0b57);
            let drawn = (0..TRIES).map(|_| {
                let (s, c) = sin_cos(TAU * random.unit());
                let out_m = radius_m * random.unit().sqrt();
                one.standing(middle + Vector::new(c, s) * out_m)
            });
            let is_free = |o: &Obstacle| {
                let (at, room_m) = (o.at(), o.radius_m() + 2.0 * turn_m);
                starts.iter().all(|s| (s - at).norm() > room_m + turn_m)
                    && (zones.zones().is_empty() || zones.distance_m(at) > room_m)
                    && all.iter().all(|other| from_edge_m(other, at) > room_m)
            };
            let found = drawn.into_iter().find(|o| is_free(o));
            all.extend(found);
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::ObstacleSpec;
    use crate::world::fixture::square;

    fn world(places: &[ObstaclePlace], seed: u64) -> Unmapped {
        let mut spec = square(2);
        let of = |place: &ObstaclePlace| ObstacleSpec {
            radius_m: 12.0,
            place: place.clone(),
        };
        spec.obstacles = places.iter().map(of).collect();
        Unmapped::new(&spec, seed)
    }

    #[test]
    fn drawn_ones_stand_apart_from_all_else_each_seed_elsewhere() {
        let middle = Point::new(240.0, 192.0);
        let within = ObstaclePlace::Within {
            middle,
            radius_m: 300.0,
        };
        let fixed = ObstaclePlace::At(Point::new(240.0, 200.0));
        let mut places = BTreeSet::new();
        for seed in 0..20 {
            let all = world(&[fixed.clone(), within.clone(), within.clone()], seed);
            for (i, o) in all.all().iter().enumerate() {
                assert!((o.at() - middle).norm() <= 300.1);
                for other in &all.all()[i + 1..] {
                    assert!(from_edge_m(o, other.at()) > other.radius_m() + 40.0);
                }
            }
            places.extend(all.all().iter().skip(1).copied());
        }
        assert!(places.len() > 15, "{}", places.len());
    }

    #[test]
    fn who_comes_into_one_is_told_once_and_whether_it_was_free_to_turn() {
        let mut all = world(&[ObstaclePlace::At(Point::new(240.0, 200.0))], 1);
        let uav = |x: f64| {
            let at = Point::new(x, 200.0);
            [(1, Place { at, height_m: 90.0 })]
        };
        let mut facts = Vec::new();
        all.observe(20_000, &uav(227.0), &mut facts);
        assert!(facts.is_empty());
        all.observe(20_100, &uav(229.0), &mut facts);
        all.observe(20_200, &uav(231.0), &mut facts);
        assert!(matches!(facts[..], [Fact::Collided(c)] if c.is_free && c.uav == 1));
        all.observe(21_000, &uav(200.0), &mut facts);
        all.is_bound(1, 21_500);
        all.observe(22_000, &uav(235.0), &mut facts);
        assert!(matches!(facts[1..], [Fact::Collided(c)] if !c.is_free));
        assert!((all.nearest_m().unwrap() + 7.0).abs() < 0.2);
        assert_eq!(all.sensed(Point::new(0.0, 200.0), 229.0).len(), 1);
        assert!(all.sensed(Point::new(0.0, 200.0), 227.0).is_empty());
    }
}
