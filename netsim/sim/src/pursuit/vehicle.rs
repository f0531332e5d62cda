//! Ground vehicles under surveillance (D2.7 §1.5.2): on roads, by a script or by a simple
//! heuristic of who does not want to be followed.
//!
//! A vehicle steers towards a point that runs ahead of it on its road, with a bounded
//! curvature, and brakes before corners; so its velocity has no jumps.

use super::roads::Roads;
use serde::{Deserialize, Serialize};
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::{atan2, sin, sin_cos, wrap_pi};
use skein_geometry::random::SplitMix64;

/// The world moves a vehicle in steps of this, seconds.
pub(crate) const STEP_S: f64 = 0.05;

/// Speeding up, m/s².
const SPEED_UP_MPS2: f64 = 2.0;

/// Braking, m/s².
const BRAKE_MPS2: f64 = 3.0;

/// Sideways in a curve, m/s².
const SIDEWAYS_MPS2: f64 = 2.5;

/// The tightest curve, metres.
const TIGHTEST_M: f64 = 6.0;

/// The point ahead is at least this far, metres.
const AHEAD_M: f64 = 6.0;

/// Who has a point ahead that is more to its side than this, forward over aside (a radian), has to
/// turn round to it.
const ASIDE: f64 = 0.64;

/// Corners are looked for this far ahead, metres.
const LOOK_M: f64 = 120.0;

/// Who evades notices UAVs within this, metres.
const NOTICES_M: f64 = 250.0;

/// Who evades then drives so much faster.
const HURRIES: f64 = 1.3;

/// What a vehicle does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Behaviour {
    /// Stands where it is.
    Parked,
    /// Drives on.
    Drives,
    /// Stands for some seconds now and then.
    StopsAndGoes,
    /// Hurries and turns off away from the nearest UAV, and now and then stands still until
    /// it may have been passed.
    Evades,
}

/// A vehicle.
#[derive(Clone, Debug)]
pub(crate) struct Vehicle {
    pub(crate) at: Point,
    heading_rad: f64,
    speed_mps: f64,
    acceleration_mps2: Vector,
    behaviour: Behaviour,
    usual_mps: f64,
    /// Places of the road from behind the point ahead on: it is between the first two.
    way: Vec<usize>,
    ahead: Point,
    /// The last corner that the point ahead has passed: its speed, and the way since, metres.
    corner: Option<(f64, f64)>,
    /// Stands, or drives on, until then, seconds.
    until_s: f64,
    stands: bool,
    /// It was stopped, and stays where it is.
    is_stopped: bool,
    random: SplitMix64,
}

impl Vehicle {
    /// One that stands somewhere on the roads.
    pub(crate) fn new(roads: &Roads, behaviour: Behaviour, usual_mps: f64, seed: u64) -> Self {
        let mut random = SplitMix64::new(seed);
        let first = roads.draw(&mut random);
        Self::from(roads, first, behaviour, usual_mps, random)
    }

    /// One that stands at the place of the roads that is nearest to a given one.
    pub(crate) fn near(
        roads: &Roads,
        start: Point,
        behaviour: Behaviour,
        usual_mps: f64,
        seed: u64,
    ) -> Self {
        let mut random = SplitMix64::new(seed);
        let first = roads.nearest(start, &mut random);
        Self::from(roads, first, behaviour, usual_mps, random)
    }

    fn from(
        roads: &Roads,
        (from, to): (usize, usize),
        behaviour: Behaviour,
        usual_mps: f64,
        mut random: SplitMix64,
    ) -> Self {
        let at = roads.place(from);
        let along = roads.place(to) - at;
        let first_s = 10.0 + 30.0 * random.unit();
        Self {
            at,
            heading_rad: atan2(along.y, along.x),
            speed_mps: 0.0,
            acceleration_mps2: Vector::zeros(),
            behaviour,
            usual_mps,
            way: vec![from, to],
            ahead: at,
            corner: None,
            until_s: first_s,
            stands: behaviour == Behaviour::Parked,
            is_stopped: false,
            random,
        }
    }

    /// It brakes, and stays where it comes to stand.
    pub(crate) fn stop(&mut self) {
        (self.is_stopped, self.stands) = (true, true);
    }

    pub(super) fn velocity_mps(&self) -> Vector {
        let (s, c) = sin_cos(self.heading_rad);
        Vector::new(c, s) * self.speed_mps
    }

    pub(super) fn acceleration_mps2(&self) -> Vector {
        self.acceleration_mps2
    }

    /// Drives for one step; `uavs` are where UAVs are.
    pub(crate) fn drive(&mut self, roads: &Roads, now_s: f64, uavs: &[Point]) {
        if self.behaviour == Behaviour::Parked {
            return;
        }
        self.decide(now_s);
        self.lead(roads, uavs);
        let wanted_mps = if self.stands {
            0.0
        } else {
            self.wanted_mps(roads, uavs)
        };
        let change = (wanted_mps - self.speed_mps) / STEP_S;
        let along = change.clamp(-BRAKE_MPS2, SPEED_UP_MPS2);
        let to = self.ahead - self.at;
        let off_rad = wrap_pi(atan2(to.y, to.x) - self.heading_rad);
        let most = self.most_curvature_per_m();
        // The circle through the point ahead that the vehicle is tangent to.
        let asked = 2.0 * sin(off_rad.clamp(-1.57, 1.57)) / to.norm().max(1.0);
        let curvature_per_m = asked.clamp(-most, most);
        let (s, c) = sin_cos(self.heading_rad);
        let (forward, left) = (Vector::new(c, s), Vector::new(-s, c));
        let sideways = self.speed_mps * self.speed_mps * curvature_per_m;
        self.acceleration_mps2 = forward * along + left * sideways;
        let driven_m = (self.speed_mps + along * STEP_S / 2.0).max(0.0) * STEP_S;
        let turned_rad = curvature_per_m * driven_m;
        let (s, c) = sin_cos(self.heading_rad + turned_rad / 2.0);
        self.at += Vector::new(c, s) * driven_m;
        self.heading_rad = wrap_pi(self.heading_rad + turned_rad);
        self.speed_mps = (self.speed_mps + along * STEP_S).max(0.0);
        self.corner = self
            .corner
            .map(|(mps, since_m)| (mps, since_m + driven_m))
            .filter(|(_, since_m)| *since_m < 2.0 * self.ahead_m());
    }

    fn decide(&mut self, now_s: f64) {
        let moves_on = matches!(self.behaviour, Behaviour::StopsAndGoes | Behaviour::Evades);
        if now_s < self.until_s || !moves_on || self.is_stopped {
            return;
        }
        self.stands = !self.stands;
        let lasts_s = if self.stands {
            5.0 + 15.0 * self.random.unit()
        } else {
            20.0 + 30.0 * self.random.unit()
        };
        self.until_s = now_s + lasts_s;
    }

    fn ahead_m(&self) -> f64 {
        AHEAD_M.max(0.8 * self.speed_mps)
    }

    /// The curvature of the tightest circle at its speed.
    fn most_curvature_per_m(&self) -> f64 {
        (SIDEWAYS_MPS2 / (self.speed_mps * self.speed_mps).max(0.1)).min(1.0 / TIGHTEST_M)
    }

    /// How far the point ahead is before the vehicle, and to its left, metres.
    fn off_m(&self) -> (f64, f64) {
        let to = self.ahead - self.at;
        let (s, c) = sin_cos(self.heading_rad);
        (to.dot(&Vector::new(c, s)), to.dot(&Vector::new(-s, c)))
    }

    /// Moves the point ahead on along the road.
    fn lead(&mut self, roads: &Roads, uavs: &[Point]) {
        let reach_m = self.ahead_m();
        while (self.ahead - self.at).norm() < reach_m || self.would_circle() {
            self.extend(roads, uavs);
            let next = roads.place(self.way[1]);
            let left = next - self.ahead;
            let left_m = left.norm();
            let step_m = 0.5;
            if left_m > step_m {
                self.ahead += left * (step_m / left_m);
                continue;
            }
            self.ahead = next;
            let mps = corner_mps(roads, self.way[0], self.way[1], self.way[2]);
            if mps < self.usual_mps * HURRIES {
                let slower = self.corner.is_none_or(|(before, _)| mps <= before);
                if slower {
                    self.corner = Some((mps, 0.0));
                }
            }
            self.way.remove(0);
        }
    }

    /// Whether the point ahead is behind, and within the tightest circle on its side: it would
    /// stay there, and the vehicle circle round it. Behind a hairpin it is.
    fn would_circle(&self) -> bool {
        let (forward_m, aside_m) = self.off_m();
        let radius_m = 1.0 / self.most_curvature_per_m();
        forward_m < 0.0 && forward_m.hypot(aside_m.abs() - radius_m) < radius_m
    }

    /// The road is known as far as corners are looked for.
    fn extend(&mut self, roads: &Roads, uavs: &[Point]) {
        let length_m = |way: &[usize]| -> f64 {
            way.windows(2)
                .map(|w| (roads.place(w[1]) - roads.place(w[0])).norm())
                .sum()
        };
        while self.way.len() < 3 || length_m(&self.way[1..]) < LOOK_M {
            let n = self.way.len();
            let (before, at) = (self.way[n - 2], self.way[n - 1]);
            let others: Vec<usize> = roads
                .next_of(at)
                .iter()
                .copied()
                .filter(|p| *p != before)
                .collect();
            let next = match others.len() {
                0 => before,
                1 => others[0],
                _ => self.choose(roads, at, &others, uavs),
            };
            self.way.push(next);
        }
    }

    /// At a crossing: anywhere, or away from the nearest UAV.
    fn choose(&mut self, roads: &Roads, at: usize, others: &[usize], uavs: &[Point]) -> usize {
        let drawn = others[self.random.below(others.len())];
        let here = roads.place(at);
        let nearest = uavs
            .iter()
            .min_by(|a, b| (*a - here).norm().total_cmp(&(*b - here).norm()));
        let (Behaviour::Evades, Some(uav)) = (self.behaviour, nearest) else {
            return drawn;
        };
        let away = |n: &usize| {
            let along = (roads.place(*n) - here).normalize();
            along.dot(&(here - uav))
        };
        let farthest = others.iter().max_by(|a, b| away(a).total_cmp(&away(b)));
        farthest.copied().unwrap_or(drawn)
    }

    /// As fast as it likes, and as corners allow.
    fn wanted_mps(&self, roads: &Roads, uavs: &[Point]) -> f64 {
        let noticed = uavs.iter().any(|u| (u - self.at).norm() < NOTICES_M);
        let hurries = self.behaviour == Behaviour::Evades && noticed;
        let free_mps = self.usual_mps * if hurries { HURRIES } else { 1.0 };
        let mut most_mps = self.corner.map_or(free_mps, |(mps, _)| free_mps.min(mps));
        let (forward_m, aside_m) = self.off_m();
        if forward_m < ASIDE * aside_m.abs() {
            // Who has to turn so far does it on the tightest circle.
            most_mps = most_mps.min((SIDEWAYS_MPS2 * TIGHTEST_M).sqrt());
        }
        // To the vertex of the road, and to where the vehicle itself is half as far.
        let mut distance_m = 0.5 * (self.ahead - self.at).norm();
        let mut from = self.ahead;
        for w in self.way.windows(3) {
            let corner = roads.place(w[1]);
            distance_m += (corner - from).norm();
            from = corner;
            let mps = corner_mps(roads, w[0], w[1], w[2]);
            let now_mps = (mps * mps + 1.6 * BRAKE_MPS2 * distance_m).sqrt();
            most_mps = most_mps.min(now_mps);
        }
        most_mps
    }
}

/// How fast a corner of a road is taken, m/s.
fn corner_mps(roads: &Roads, a: usize, b: usize, c: usize) -> f64 {
    (SIDEWAYS_MPS2 * TIGHTEST_M / roads.half_turn(a, b, c))
        .sqrt()
        .max(2.0)
}

#[cfg(test)]
mod tests {
    use super::super::roads::tests::grid;
    use super::*;

    fn drive(behaviour: Behaviour, mps: f64, seed: u64, look: &mut dyn FnMut(&Vehicle, f64)) {
        let roads = Roads::of(&grid(6, 150.0)).unwrap();
        let mut v = Vehicle::new(&roads, behaviour, mps, seed);
        for k in 0..6_000_u32 {
            let now_s = f64::from(k) * STEP_S;
            v.drive(&roads, now_s, &[Point::new(450.0, 450.0)]);
            look(&v, now_s);
        }
    }

    #[test]
    fn a_vehicle_stays_on_its_road_and_within_its_limits() {
        for (mps, seed) in [(8.0, 1), (14.0, 2), (20.0, 3)] {
            let (mut worst_m, mut most_mps, mut hardest) = (0.0_f64, 0.0_f64, 0.0_f64);
            let mut before: Option<Vector> = None;
            drive(Behaviour::Drives, mps, seed, &mut |v, _| {
                // Distance to the nearest street of the grid.
                let off = |x: f64| (x - (x / 150.0).round() * 150.0).abs();
                worst_m = worst_m.max(off(v.at.x).min(off(v.at.y)));
                most_mps = most_mps.max(v.speed_mps);
                if let Some(b) = before {
                    hardest = hardest.max((v.velocity_mps() - b).norm() / STEP_S);
                }
                before = Some(v.velocity_mps());
            });
            assert!(worst_m < 6.0, "{mps}: {worst_m} m beside the road");
            assert!(most_mps > 0.7 * mps && most_mps <= mps + 0.2, "{most_mps}");
            assert!(hardest < 5.0, "{hardest} m/s²");
        }
    }

    #[test]
    fn hairpins_are_driven_through() {
        // Zigzags of streets, each corner of 100 to 170 degrees, legs of 8 to 60 m.
        let mut random = SplitMix64::new(7);
        for case in 0..40_u32 {
            let mut way = vec![Point::new(0.0, 0.0), Point::new(60.0, 0.0)];
            let (mut heading_rad, mut left) = (0.0, 1.0);
            for _ in 0..6 {
                heading_rad += left * (100.0 + 70.0 * random.unit()).to_radians();
                left = if random.unit() < 0.5 { left } else { -left };
                let (s, c) = sin_cos(heading_rad);
                let leg_m = 8.0 + 52.0 * random.unit();
                let last = way[way.len() - 1];
                way.push(last + Vector::new(c, s) * leg_m);
            }
            let (s, c) = sin_cos(heading_rad);
            let end = way[way.len() - 1] + Vector::new(c, s) * 120.0;
            way.push(end);
            let roads = Roads::of(&[way.clone()]).unwrap();
            let mut v = Vehicle::near(&roads, way[0], Behaviour::Drives, 9.0, u64::from(case));
            let (mut reached, mut k) = (false, 0_u32);
            while !reached && k < 3_000 {
                v.drive(&roads, f64::from(k) * STEP_S, &[]);
                reached = (v.at - end).norm() < 10.0;
                k += 1;
            }
            assert!(reached, "case {case}: {way:?}, at {:?}", v.at);
        }
    }

    #[test]
    fn who_stops_and_goes_does_both_and_who_is_parked_neither() {
        let (mut stood_s, mut drove_s) = (0.0, 0.0);
        drive(Behaviour::StopsAndGoes, 10.0, 5, &mut |v, _| {
            if v.speed_mps < 0.1 {
                stood_s += STEP_S;
            }
            if v.speed_mps > 5.0 {
                drove_s += STEP_S;
            }
        });
        assert!(stood_s > 20.0 && drove_s > 50.0, "{stood_s} {drove_s}");
        let mut farthest_m = 0.0_f64;
        let mut first = None;
        drive(Behaviour::Parked, 10.0, 5, &mut |v, _| {
            let from = *first.get_or_insert(v.at);
            farthest_m = farthest_m.max((v.at - from).norm());
        });
        assert!(farthest_m < f64::EPSILON);
    }

    #[test]
    fn who_evades_is_farther_from_the_uav_than_who_does_not_mind() {
        let mean = |behaviour| {
            let mut sum = 0.0;
            for seed in 0..6 {
                drive(behaviour, 12.0, seed, &mut |v, _| {
                    sum += (v.at - Point::new(450.0, 450.0)).norm();
                });
            }
            sum
        };
        assert!(mean(Behaviour::Evades) > 1.05 * mean(Behaviour::Drives));
    }
}
