//! A contour in a mission's world that no peer knows: a road that is on no map, or the edge of a
//! fire that grows; and what cameras see of it (D2.7 §3.1).
//!
//! A fire is told by rays from where it began: along each of them the edge moves on at a speed of
//! its own, faster down-wind, until it has burnt as far as it may.
//!
//! # Guarantees
//! Truth stays here: percepts hold places with errors, some missed, drawn from the seed, the UAV
//! and the time alone. Where the contour is is a function of seed and time. Without one there is
//! no detector, and nothing is drawn.

use super::detector::{Look, Sight};
use super::motion::Kinematic;
use super::obstacles::{Obstacles, Place};
use crate::spec::{ContourSpec, FireSpec, RoadSpec};
use skein_behaviors::contour::{CONTOUR_MAX, ContourLook, ContourPlace};
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::{TAU, cos, seconds, sin, sin_cos};
use skein_geometry::random::{SplitMix64, mix};
use skein_peer::mission::mm;

/// Rays of a fire.
const RAYS: u32 = 144;

/// Places of a road are so far apart, metres.
const STEP_M: f64 = 15.0;

/// A look tells places no nearer to each other than this along the contour, metres.
const LEAST_M: f64 = 10.0;

/// The longest sway of a road, metres along it; the second is half as long, the third a third.
const SWAY_M: f64 = 1100.0;

/// By so much the edge of a fire is uneven, as a share of its growth.
const UNEVEN: f64 = 0.15;

#[derive(Clone, Debug)]
struct Ray {
    way: Vector,
    begun_m: f64,
    grows_mps: f64,
    most_m: f64,
}

#[derive(Clone, Debug)]
enum Shape {
    Road(Vec<Point>),
    Fire(Point, Vec<Ray>),
}

/// The contour of a world.
#[derive(Clone, Debug)]
pub struct Contour {
    shape: Shape,
    seed: u64,
}

impl Contour {
    /// As it is drawn from a seed.
    #[must_use]
    pub fn new(spec: &ContourSpec, seed: u64) -> Self {
        let seed = mix(seed ^ 0xC0_4700);
        let mut random = SplitMix64::new(seed);
        let phases = [0, 1, 2].map(|_| TAU * random.unit());
        let shape = match spec {
            ContourSpec::Road(road) => Shape::Road(swayed(road, phases)),
            ContourSpec::Fire(fire) => Shape::Fire(fire.at, rays(fire, phases)),
        };
        Self { shape, seed }
    }

    /// Whether it encloses something.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        matches!(self.shape, Shape::Fire(..))
    }

    /// Its places at a time, always as many, in one order; what it encloses is on the left.
    #[must_use]
    pub fn places(&self, at_ms: u64) -> Vec<Point> {
        match &self.shape {
            Shape::Road(way) => way.clone(),
            Shape::Fire(at, rays) => {
                let edge = |r: &Ray| {
                    let out_m = (r.begun_m + r.grows_mps * seconds(at_ms)).min(r.most_m);
                    at + r.way * out_m
                };
                rays.iter().map(edge).collect()
            }
        }
    }

    /// The same as a line: a closed one ends where it begins.
    #[must_use]
    pub fn line(&self, at_ms: u64) -> Vec<Point> {
        let mut all = self.places(at_ms);
        if self.is_closed() {
            all.extend(all.first().copied());
        }
        all
    }

    /// Which of its places are in the picture of a UAV, and nothing stands in between.
    #[must_use]
    pub(super) fn pictured(
        &self,
        body: &Kinematic,
        at_ms: u64,
        obstacles: &Obstacles,
    ) -> Vec<bool> {
        let (places, sight) = (self.places(at_ms).into_iter(), Sight::of(body));
        places
            .map(|p| sight.sees(Place::on_ground(p), obstacles))
            .collect()
    }

    /// One look of the detector of a UAV.
    pub(super) fn look(
        &self,
        body: &Kinematic,
        uav: u16,
        now_ms: u64,
        obstacles: &Obstacles,
    ) -> ContourLook {
        let sided = self.is_closed();
        if body.takes_off_in_ms(now_ms) > 0 {
            return ContourLook::new(sided, []);
        }
        let mut look = Look::new(self.seed, uav, now_ms);
        let (line, sight) = (self.line(now_ms), Sight::of(body));
        let first = look.random.unit();
        let count = walked(&line, LEAST_M, first)
            .filter(|p| sight.shows(*p))
            .count();
        #[allow(clippy::cast_precision_loss, reason = "some tens")]
        let apart_m = LEAST_M * (count as f64 / (CONTOUR_MAX - 1) as f64).max(1.0);
        let from = (body.position(), body.height_m());
        let mut told: Vec<ContourPlace> = Vec::new();
        let mut begins = true;
        // A closed line is begun where it is out of the picture, so that no piece is cut in two.
        let all: Vec<Point> = walked(&line, apart_m, first).collect();
        let out = all.iter().position(|p| !sight.shows(*p));
        let turned = if sided { out.unwrap_or(0) } else { 0 };
        for p in all.iter().cycle().skip(turned).take(all.len()) {
            if !sight.sees(Place::on_ground(*p), obstacles) {
                begins = true;
                continue;
            }
            let (recognised, off) = look.recognised();
            if !recognised {
                continue;
            }
            let (at, _) = look.told(from, *p, off);
            told.push(ContourPlace {
                east_mm: mm(at.x),
                north_mm: mm(at.y),
                begins,
            });
            begins = false;
        }
        ContourLook::new(sided, told)
    }
}

/// The way of a road, swayed to either side.
fn swayed(road: &RoadSpec, phases: [f64; 3]) -> Vec<Point> {
    let way: Vec<Point> = walked(&road.way, STEP_M, 0.0).collect();
    let mut along_m = 0.0;
    let n = way.len();
    (0..n)
        .map(|i| {
            let (before, after) = (way[i.saturating_sub(1)], way[(i + 1).min(n - 1)]);
            let ahead = (after - before)
                .try_normalize(1e-9)
                .unwrap_or_else(Vector::x);
            let left = Vector::new(-ahead.y, ahead.x);
            let each = phases.iter().zip([1.0, 2.0, 3.0]);
            let sway: f64 = each
                .map(|(phase, k)| sin(TAU * k * along_m / SWAY_M + phase) / (k * k))
                .sum();
            along_m += STEP_M;
            way[i] + left * (road.sway_m * sway)
        })
        .collect()
}

fn rays(fire: &FireSpec, phases: [f64; 3]) -> Vec<Ray> {
    let ray = |k: u32| {
        let rad = TAU * f64::from(k) / f64::from(RAYS);
        let (s, c) = sin_cos(rad);
        // An ellipse with the place where it began in its rear focus.
        let ahead = cos(rad - fire.towards_rad);
        let e = fire.stretch;
        let grows = (1.0 - e) / (1.0 - e * ahead);
        let each = phases.iter().zip([2.0, 3.0, 5.0]);
        let uneven: f64 = each.map(|(phase, m)| sin(m * rad + phase) / m).sum();
        let grows = grows * (1.0 + UNEVEN * uneven);
        Ray {
            way: Vector::new(c, s),
            begun_m: fire.radius_m * grows,
            grows_mps: fire.growth_mps * grows,
            most_m: fire.most_m * grows,
        }
    };
    (0..RAYS).map(ray).collect()
}

/// Places along a line so far apart, metres, the first after a share of that.
fn walked(line: &[Point], apart_m: f64, first: f64) -> impl Iterator<Item = Point> + '_ {
    let mut next_m = first * apart_m;
    line.windows(2).flat_map(move |both| {
        let way = both[1] - both[0];
        let length_m = way.norm();
        let mut on = Vec::new();
        while next_m <= length_m {
            on.push(both[0] + way * (next_m / length_m.max(1e-9)));
            next_m += apart_m;
        }
        next_m -= length_m;
        on
    })
}

/// A place as cameras see it: a step above the ground.
#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec::Spec;
    use crate::world::{World, fixture};
    use skein_geometry::polyline::nearest;

    fn fire() -> ContourSpec {
        ContourSpec::Fire(FireSpec {
            at: Point::new(450.0, 390.0),
            radius_m: 100.0,
            growth_mps: 0.2,
            towards_rad: 0.0,
            stretch: 0.4,
            most_m: 300.0,
        })
    }

    #[test]
    fn a_fire_grows_faster_down_wind_and_no_farther_than_it_may() {
        let contour = Contour::new(&fire(), 4);
        let out_m =
            |ms: u64, ray: usize| (contour.places(ms)[ray] - Point::new(450.0, 390.0)).norm();
        let half = usize::try_from(RAYS / 2).unwrap();
        assert!(out_m(0, 0) > 1.5 * out_m(0, half));
        let grown = |ray| out_m(100_000, ray) - out_m(0, ray);
        assert!(grown(0) > 1.5 * grown(half) && grown(half) > 2.0);
        assert!(out_m(100_000_000, 0) < 300.0 * 1.2);
        assert_ne!(contour.places(0), Contour::new(&fire(), 5).places(0));
        assert_eq!(contour.places(7), Contour::new(&fire(), 4).places(7));
    }

    #[test]
    fn what_is_in_the_picture_is_told_with_an_error_and_in_order() {
        let at = fixture::square(1).uavs[0].launch.position();
        let way = vec![at + Vector::new(-300.0, 8.0), at + Vector::new(300.0, 8.0)];
        let spec = Spec {
            contour: Some(ContourSpec::Road(RoadSpec { way, sway_m: 0.0 })),
            ..fixture::square(1)
        };
        let world = World::new(&spec, 5);
        let uav = spec.uavs[0].id;
        let told = world.percept(uav).unwrap().contour;
        assert_eq!(Some(told), world.percept(uav).map(|p| p.contour));
        let look = told.look();
        assert_eq!(look.pieces.len(), 1);
        assert!(look.pieces[0].len() > 3 && !look.sided);
        let truth = world.contour().unwrap().line(0);
        for p in &look.pieces[0] {
            let off_m = nearest(&truth, *p).unwrap().1;
            assert!(off_m < 12.0, "{off_m}");
        }
        assert!(world.contour_pictured(uav).iter().any(|s| *s));
        let without = World::new(&fixture::square(1), 5);
        assert!(without.percept(uav).unwrap().contour.is_absent());
    }
}
