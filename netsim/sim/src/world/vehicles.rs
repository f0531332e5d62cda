//! Vehicles on the ground in a mission's world, and what cameras see of them (D2.7 §1.5.2,
//! §3.7): the vehicles of pursuits under the camera of a mission.
//!
//! # Guarantees
//! Truth stays here: percepts hold places with errors, misses and false alarms, drawn from the
//! seed, the UAV and the time alone, so who asks twice at one time is told the same. Without
//! vehicles there is no detector, and nothing is drawn.

use super::detector::{Look, Sight, displaced};
use super::motion::Kinematic;
use super::obstacles::{Obstacles, Place};
use crate::check::detections::Truth;
use crate::pursuit::KINDS;
use crate::pursuit::sensor::Noise;
use crate::pursuit::vehicle::Vehicle;
use crate::spec::VehicleSpec;
use skein_behaviors::sightings::{Sighted, Sightings};
use skein_flight::tracking::estimate::Detection;
use skein_geometry::frame::Point;
use skein_geometry::math::seconds;
use skein_geometry::random::{SplitMix64, mix};
use skein_peer::criteria::{COLOURS, colour_of, coloured, kind_of};
use skein_peer::mission::mm;
use std::sync::Arc;

/// Vehicles move in steps of this, milliseconds.
const STEP_MS: u64 = 50;

/// A vehicle is seen by its middle, metres above the ground.
const MIDDLE_M: f64 = 1.0;

/// All vehicles.
#[derive(Clone, Debug, Default)]
pub struct Vehicles {
    specs: Arc<[VehicleSpec]>,
    all: Vec<Vehicle>,
    /// How far they have been moved, milliseconds.
    driven_ms: u64,
    seed: u64,
}

impl Vehicles {
    /// All at their starts.
    #[must_use]
    pub(super) fn new(specs: &[VehicleSpec], seed: u64) -> Self {
        let seed = mix(seed ^ 0x00CA_2000);
        let started = |(v, nth): (&VehicleSpec, u64)| {
            let own = mix(seed ^ nth);
            match v.start {
                Some(at) => Vehicle::near(&v.roads, at, v.behaviour, v.speed_mps, own),
                None => Vehicle::new(&v.roads, v.behaviour, v.speed_mps, own),
            }
        };
        Self {
            all: specs.iter().zip(1..).map(started).collect(),
            specs: specs.into(),
            driven_ms: 0,
            seed,
        }
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.all.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// What they are, and where.
    pub fn truth(&self) -> impl Iterator<Item = Truth> + '_ {
        let all = self.all.iter().zip(self.specs.iter());
        all.map(|(v, spec)| Truth {
            at: v.at,
            kind: spec.kind,
            is_confused: spec.confused_permille > 0,
        })
    }

    /// Where they are, metres.
    pub fn places(&self) -> impl Iterator<Item = Point> + '_ {
        self.all.iter().map(|v| v.at)
    }

    /// How far off its place a UAV takes itself to be, and so all that it sees, metres.
    #[must_use]
    pub fn displaced_m(&self, uav: u16) -> f64 {
        displaced(self.seed, uav, &Noise::usual()).norm()
    }

    /// Moves them on; who evades does so from the UAVs in the air.
    pub(super) fn drive(&mut self, to_ms: u64, airborne: &[(u16, Place)]) {
        if self.all.is_empty() {
            return;
        }
        let uavs: Vec<Point> = airborne.iter().map(|(_, place)| place.at).collect();
        while self.driven_ms + STEP_MS <= to_ms {
            self.driven_ms += STEP_MS;
            let now_s = seconds(self.driven_ms);
            for (v, spec) in self.all.iter_mut().zip(self.specs.iter()) {
                v.drive(&spec.roads, now_s, &uavs);
            }
        }
    }

    /// Stops what looks so, or may be taken to, and is nearest to a place, within so many metres
    /// of it, if it is also near to another place; says whether it is.
    pub(super) fn stop_near(
        &mut self,
        (place, within_m): (Point, f64),
        (other, near_m): (Point, f64),
        looks: u8,
    ) -> bool {
        let all = self.all.iter_mut().zip(self.specs.iter());
        let may_be = all.filter(|(_, s)| s.kind == looks || s.confused_permille > 0);
        let off = may_be.map(|(v, _)| ((v.at - place).norm(), v));
        let there = off.filter(|(m, _)| *m <= within_m);
        let nearest = there.min_by(|a, b| a.0.total_cmp(&b.0));
        let reached = nearest.filter(|(_, v)| (v.at - other).norm() <= near_m);
        reached.map(|(_, v)| v.stop()).is_some()
    }

    /// Whether one of them is in the picture of a UAV, and nothing stands in between.
    #[must_use]
    pub(super) fn is_pictured(&self, nth: usize, body: &Kinematic, obstacles: &Obstacles) -> bool {
        let v = self.all.get(nth);
        v.is_some_and(|v| Sight::of(body).sees(middle(v), obstacles))
    }

    /// One look of the detector of a UAV.
    pub(super) fn look(
        &self,
        body: &Kinematic,
        uav: u16,
        now_ms: u64,
        obstacles: &Obstacles,
    ) -> Sightings {
        if self.all.is_empty() {
            return Sightings::default();
        }
        if body.takes_off_in_ms(now_ms) > 0 {
            return Sightings::new([]);
        }
        let (from, height_m) = (body.position(), body.height_m() - MIDDLE_M);
        let mut look = Look::new(self.seed, uav, now_ms);
        let sight = Sight::of(body);
        let mut seen = Vec::new();
        for (nth, (v, spec)) in self.all.iter().zip(self.specs.iter()).enumerate() {
            let (recognised, off) = look.recognised();
            if recognised && sight.sees(middle(v), obstacles) {
                let (at, told) = look.told((from, height_m), v.at, off);
                let kind = spec.kind_in(look.seed, nth);
                seen.push(sighted(at, &told, kind));
            }
        }
        let (random, noise) = (&mut look.random, &look.noise);
        let is_false = random.unit() < noise.false_alarms;
        let (x, y) = (2.0 * random.unit() - 1.0, 2.0 * random.unit() - 1.0);
        let kind = random.below(usize::from(KINDS));
        if is_false {
            let at = body.picture().place(x, y);
            let told = Detection::from_sight(from, height_m, at, &noise.sight);
            let kind = u8::try_from(kind).unwrap_or(0);
            seen.push(sighted(at, &told, kind));
        }
        seen.sort_by_key(|s| s.spread_mm);
        Sightings::new(seen)
    }
}

impl VehicleSpec {
    /// What a detector takes it for in one look: where it is never confused nothing is drawn.
    fn kind_in(&self, look: u64, nth: usize) -> u8 {
        if self.confused_permille == 0 {
            return self.kind;
        }
        let own = mix(look ^ 0x5EE4 << 40) ^ nth as u64;
        let mut random = SplitMix64::new(mix(own));
        if random.unit() >= f64::from(self.confused_permille) / 1000.0 {
            return self.kind;
        }
        let (kind, colour) = (kind_of(self.kind), colour_of(self.kind));
        // Of what has a colour that may be what is taken for another one.
        if colour > 0 && random.unit() < 0.5 {
            return coloured(kind, other_than(colour - 1, COLOURS.len(), &mut random) + 1);
        }
        let other = other_than(kind, usize::from(KINDS), &mut random);
        coloured(other, colour)
    }
}

/// Another one of so many.
fn other_than(this: u8, of: usize, random: &mut SplitMix64) -> u8 {
    let other = 1 + random.below(of - 1);
    u8::try_from((usize::from(this) + other) % of).unwrap_or(this)
}

/// What is to be seen of a vehicle.
fn middle(v: &Vehicle) -> Place {
    Place {
        at: v.at,
        height_m: MIDDLE_M,
    }
}

fn sighted(at: Point, told: &Detection, kind: u8) -> Sighted {
    Sighted {
        east_mm: mm(at.x),
        north_mm: mm(at.y),
        spread_mm: mm(told.spread_m()).unsigned_abs(),
        kind,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pursuit::roads::Roads;
    use crate::pursuit::vehicle::{Behaviour, STEP_S};
    use crate::spec::Spec;
    use crate::world::{World, fixture};
    use skein_geometry::frame::Vector;

    /// A UAV that stands above the road, level, and a vehicle that drives along below.
    fn scene(start: Point, behaviour: Behaviour) -> Spec {
        let road = vec![Point::new(0.0, 300.0), Point::new(460.0, 300.0)];
        Spec {
            vehicles: vec![VehicleSpec {
                roads: Arc::new(Roads::of(&[road]).unwrap()),
                start: Some(start),
                behaviour,
                speed_mps: 8.0,
                kind: 1,
                confused_permille: 0,
            }],
            ..fixture::square(1)
        }
    }

    #[test]
    fn steps_of_vehicles_are_those_of_pursuits() {
        assert!((STEP_S * 1000.0 - STEP_MS as f64).abs() < 1e-9);
    }

    #[test]
    fn a_vehicle_drives_and_who_asks_twice_is_told_the_same() {
        let spec = scene(Point::new(0.0, 300.0), Behaviour::Drives);
        let mut world = World::new(&spec, 3);
        let start = world.vehicles().places().next().unwrap();
        world.advance(10_030);
        let then = world.vehicles().places().next().unwrap();
        assert!((55.0..80.0).contains(&(then - start).norm()), "{then}");
        let uav = spec.uavs[0].id;
        assert_eq!(world.percept(uav), world.percept(uav));
        let mut again = World::new(&spec, 3);
        again.advance(4_000);
        again.advance(10_030);
        assert_eq!(again.vehicles().places().next().unwrap(), then);
    }

    #[test]
    fn what_is_in_the_picture_is_told_with_an_error_and_now_and_then_missed() {
        let at = fixture::square(1).uavs[0].launch.position();
        let near = at + Vector::new(10.0, 5.0);
        let mut spec = scene(near, Behaviour::Parked);
        spec.vehicles[0].roads =
            Arc::new(Roads::of(&[vec![near, near + Vector::new(300.0, 0.0)]]).unwrap());
        let world = World::new(&spec, 5);
        let uav = spec.uavs[0].id;
        let body = world.body(uav).unwrap();
        let (mut hits, mut false_alarms, mut worst_m) = (0, 0, 0.0_f64);
        for look in 0..400 {
            let told = world
                .vehicles
                .look(body, uav, look * 200, world.obstacles());
            for s in told.seen() {
                let off_m = (s.at() - near).norm();
                if off_m < 12.0 {
                    hits += 1;
                    worst_m = worst_m.max(off_m);
                } else {
                    false_alarms += 1;
                }
            }
        }
        assert!((330..395).contains(&hits), "{hits}");
        assert!((5..45).contains(&false_alarms), "{false_alarms}");
        assert!(worst_m > 0.3, "{worst_m}");
        assert_eq!(world.pictured(uav).collect::<Vec<_>>(), [0]);
    }

    #[test]
    fn without_vehicles_there_is_no_detector() {
        let world = World::new(&fixture::square(2), 1);
        assert!(world.percept(1).unwrap().sightings.is_absent());
    }
}
