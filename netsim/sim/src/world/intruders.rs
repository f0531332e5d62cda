//! Aircraft of a world that are no members of the fleet: they fly their ways whatever the UAVs
//! do, and are sensed by those that are near (D2.7 §1.2.3, reactive layer).
//!
//! # Guarantees
//! Where an intruder is follows from the seed and the time alone.

use super::fact::{Fact, Intrusion};
use super::obstacles::Place;
use crate::spec::{IntruderSpec, IntruderWay, Spec};
use skein_behaviors::reactive::pass_over;
use skein_behaviors::reactive::well_clear::{self, AHEAD_S, KEPT_HEIGHT_M, KEPT_M};
use skein_behaviors::traffic::Aircraft;
use skein_flight::airframe::Airframe;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::{TAU, seconds, sin_cos};
use skein_geometry::random::SplitMix64;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// A drawn way begins and ends so far beyond its circle, metres.
const BEYOND_M: f64 = 2_000.0;

/// Nobody could make way for what has flown as it does for less, seconds; nor has who took off, or
/// got its computer back, for less.
fn warned_s(spec: &Spec) -> f64 {
    let airframes = spec.uavs.iter().map(|u| &u.airframe);
    let passes_s = airframes.map(|a| pass_over::passes_s(a.climb_mps));
    if spec.mission.separation_mm > 0 {
        passes_s.fold(AHEAD_S, f64::max)
    } else {
        AHEAD_S
    }
}

/// How far a UAV has to sense an intruder that flies so fast, metres, to make way for it: to turn
/// away, or to pass over where its way over the ground is promised.
#[must_use]
pub fn least_range_m(airframe: &Airframe, their_mps: f64, is_promised: bool) -> f64 {
    if is_promised {
        return pass_over::least_range_m(airframe.cruise_mps, airframe.climb_mps, their_mps);
    }
    let radius_m = airframe.min_turn_radius_m();
    well_clear::least_range_m(airframe.cruise_mps, radius_m, their_mps)
}

/// An intruder in the air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flown {
    /// Where.
    pub place: Place,
    /// How fast over the ground, m/s.
    pub velocity_mps: Vector,
    /// For how long it has flown straight, seconds.
    pub straight_s: f64,
}

/// All of a world, and how near they came.
#[derive(Clone, Debug)]
pub struct Intruders {
    specs: Arc<[IntruderSpec]>,
    /// Who was warned for less could not make way, seconds.
    warned_s: f64,
    seed: u64,
    nearest_m: Option<f64>,
    near: BTreeSet<(usize, u16)>,
    /// By UAV when it could not make way last, milliseconds.
    bound_ms: BTreeMap<u16, u64>,
}

impl Intruders {
    pub(super) fn of(spec: &Spec, seed: u64) -> Self {
        Self::new(&spec.intruders, warned_s(spec), seed)
    }

    fn new(specs: &[IntruderSpec], warned_s: f64, seed: u64) -> Self {
        Self {
            specs: specs.into(),
            warned_s,
            seed,
            nearest_m: None,
            near: BTreeSet::new(),
            bound_ms: BTreeMap::new(),
        }
    }

    /// How near one came at most to a UAV at its height, metres, across.
    #[must_use]
    pub fn nearest_m(&self) -> Option<f64> {
        self.nearest_m
    }

    /// Where those are that fly at a time, with their places in the scenario.
    pub fn flown(&self, at_ms: u64) -> impl Iterator<Item = (usize, Flown)> + '_ {
        let all = self.specs.iter().enumerate();
        all.filter_map(move |(n, spec)| Some((n, self.one(n, spec, at_ms)?)))
    }

    fn one(&self, n: usize, spec: &IntruderSpec, at_ms: u64) -> Option<Flown> {
        let since_ms = at_ms.checked_sub(spec.from_ms)?;
        let (nth, since_ms) = match spec.every_ms {
            Some(every_ms) => (since_ms / every_ms.max(1), since_ms % every_ms.max(1)),
            None => (0, since_ms),
        };
        let drawn;
        let places = match &spec.way {
            IntruderWay::Places(places) => places.as_slice(),
            IntruderWay::Over { middle, radius_m } => {
                let mixed = (self.seed, n as u64, nth);
                drawn = across(*middle, *radius_m, mixed);
                &drawn
            }
        };
        let mut left_m = spec.speed_mps * seconds(since_ms);
        for (from, to) in places.iter().zip(places.iter().skip(1)) {
            let (leg, length_m) = (to - from, (to - from).norm());
            if left_m < length_m {
                let direction = leg / length_m;
                return Some(Flown {
                    place: Place {
                        at: from + direction * left_m,
                        height_m: spec.height_m,
                    },
                    velocity_mps: direction * spec.speed_mps,
                    straight_s: left_m / spec.speed_mps,
                });
            }
            left_m -= length_m;
        }
        None
    }

    /// Those that a UAV senses, the nearest first.
    #[must_use]
    pub fn sensed(&self, at_ms: u64, from: Point, range_m: f64) -> Vec<Aircraft> {
        let near = self
            .flown(at_ms)
            .map(|(_, f)| ((f.place.at - from).norm(), f));
        let mut near: Vec<(f64, Flown)> = near.filter(|(m, _)| *m <= range_m).collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let dm = |m: f64| super::mm(m) / 100;
        let dmps = |mps: f64| i16::try_from(dm(mps)).unwrap_or(0);
        let aircraft = |(_, f): (f64, Flown)| Aircraft {
            east_dm: dm(f.place.at.x),
            north_dm: dm(f.place.at.y),
            height_dm: dm(f.place.height_m),
            east_dmps: dmps(f.velocity_mps.x),
            north_dmps: dmps(f.velocity_mps.y),
        };
        near.into_iter().map(aircraft).collect()
    }

    /// A UAV stands on the ground, or flies its failsafe: it makes way for nobody.
    pub(super) fn is_bound(&mut self, uav: u16, at_ms: u64) {
        if !self.specs.is_empty() {
            self.bound_ms.insert(uav, at_ms);
        }
    }

    /// Compares them with all airborne UAVs at one moment.
    pub(super) fn observe(&mut self, at_ms: u64, airborne: &[(u16, Place)], facts: &mut Vec<Fact>) {
        if self.specs.is_empty() {
            return;
        }
        let flown: Vec<(usize, Flown)> = self.flown(at_ms).collect();
        for (n, f) in flown {
            for (uav, at) in airborne {
                let across_m = (f.place.at - at.at).norm();
                let is_as_high = (f.place.height_m - at.height_m).abs() < KEPT_HEIGHT_M;
                if !is_as_high {
                    continue;
                }
                self.nearest_m = Some(self.nearest_m.map_or(across_m, |m| m.min(across_m)));
                if across_m >= KEPT_M {
                    self.near.remove(&(n, *uav));
                    continue;
                }
                let bound_ms = self.bound_ms.get(uav).copied().unwrap_or(0);
                let free_s = seconds(at_ms.saturating_sub(bound_ms));
                let is_warned = f.straight_s >= self.warned_s && free_s >= self.warned_s;
                if self.near.insert((n, *uav)) {
                    facts.push(Fact::Intruded(Intrusion {
                        at_ms,
                        uav: *uav,
                        intruder: n,
                        across_m,
                        is_warned,
                    }));
                }
            }
        }
    }
}

/// A straight way over some place of a circle, on some course.
fn across(middle: Point, radius_m: f64, (seed, n, nth): (u64, u64, u64)) -> [Point; 2] {
    let mut random = SplitMix64::new(seed ^ (n << 48) ^ (nth << 16) ^ 0x1a7d);
    let direction = |turn: f64| {
        let (s, c) = sin_cos(TAU * turn);
        Vector::new(c, s)
    };
    let over = middle + direction(random.unit()) * (radius_m * random.unit().sqrt());
    let along = direction(random.unit()) * (radius_m + BEYOND_M);
    [over - along, over + along]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(way: IntruderWay, every_ms: Option<u64>) -> Intruders {
        let spec = IntruderSpec {
            name: "helicopter".to_owned(),
            from_ms: 10_000,
            every_ms,
            speed_mps: 20.0,
            height_m: 100.0,
            way,
        };
        Intruders::new(&[spec], AHEAD_S, 7)
    }

    #[test]
    fn it_flies_its_way_at_its_speed_and_comes_again() {
        let corner = |x: f64, y: f64| Point::new(x, y);
        let places = vec![
            corner(0.0, 0.0),
            corner(1_000.0, 0.0),
            corner(1_000.0, 500.0),
        ];
        let all = of(IntruderWay::Places(places), Some(100_000));
        let at = |ms: u64| all.flown(ms).next().map(|(_, f)| f);
        assert_eq!(at(9_999), None);
        for from_ms in [10_000, 110_000] {
            let f = at(from_ms + 25_000).unwrap();
            assert!((f.place.at - corner(500.0, 0.0)).norm() < 1e-9);
            let f = at(from_ms + 60_000).unwrap();
            assert!((f.place.at - corner(1_000.0, 200.0)).norm() < 1e-9);
            assert!((f.straight_s - 10.0).abs() < 1e-9);
            assert_eq!(at(from_ms + 75_000), None);
        }
        let sensed = all.sensed(35_000, corner(500.0, 300.0), 301.0);
        assert_eq!(sensed.len(), 1);
        assert_eq!((sensed[0].east_dm, sensed[0].east_dmps), (5_000, 200));
        assert!(all.sensed(35_000, corner(500.0, 300.0), 299.0).is_empty());
    }

    #[test]
    fn drawn_ways_lead_over_the_circle_each_time_elsewhere() {
        let (middle, radius_m) = (Point::new(300.0, 200.0), 400.0);
        let all = of(IntruderWay::Over { middle, radius_m }, Some(300_000));
        let mut courses = Vec::new();
        for nth in 0..8_u64 {
            let seen = (0..300_u64).filter_map(|s| {
                let (_, f) = all.flown(10_000 + nth * 300_000 + s * 1_000).next()?;
                Some((f.place.at - middle).norm())
            });
            let nearest_m = seen.fold(f64::INFINITY, f64::min);
            assert!(nearest_m <= radius_m, "{nearest_m}");
            courses.push(all.flown(10_000 + nth * 300_000).next().unwrap().1);
        }
        let unlike = |a: &Flown, b: &Flown| (a.velocity_mps - b.velocity_mps).norm() > 0.1;
        assert!(courses.windows(2).all(|w| unlike(&w[0], &w[1])));
    }

    #[test]
    fn who_comes_near_is_told_once_and_whether_there_was_time() {
        let places = vec![Point::new(0.0, 0.0), Point::new(2_000.0, 0.0)];
        let mut all = of(IntruderWay::Places(places), None);
        let uav = |x: f64, height_m: f64| {
            let at = Point::new(x, 10.0);
            [(1, Place { at, height_m })]
        };
        let mut facts = Vec::new();
        all.observe(40_000, &uav(600.0, 120.0), &mut facts);
        assert!(facts.is_empty(), "20 m above it");
        all.observe(40_000, &uav(600.0, 110.0), &mut facts);
        all.observe(40_050, &uav(600.0, 110.0), &mut facts);
        assert_eq!(facts.len(), 1);
        assert!(matches!(facts[0], Fact::Intruded(i) if i.is_warned && i.uav == 1));
        all.observe(41_000, &uav(900.0, 110.0), &mut facts);
        all.is_bound(1, 30_000);
        all.observe(42_000, &uav(640.0, 110.0), &mut facts);
        assert!(matches!(facts[1], Fact::Intruded(i) if !i.is_warned));
        assert!((all.nearest_m().unwrap() - 10.0).abs() < 1e-9);
    }
}
