//! Ways to a goal with lateral offsets, airspeeds and waiting, cheapest first.
//!
//! The candidates among which a UAV chooses when it has to keep clear of others (D2.7
//! §1.3: negotiation of approaching vehicles): each turns towards a place beside the straight way,
//! flies there, turns towards the goal and flies there; at another airspeed where that
//! helps; after circles where it does not.
//!
//! # Guarantees
//! Equal inputs give equal lists. Turns keep the bank limit at their airspeed.
//!
//! # Complexity
//! O(offsets · places · airspeeds) courses, some five hundred; with the circles before them that
//! makes some sixteen hundred ways, priced and sorted at each search, and made as they are asked
//! for.

use super::motion::{Stretch, radius_mm, to_mm};
use crate::airframe::{Airframe, GRAVITY_MPS2, PowerModel};
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::{TAU, asin, atan2, wrap_tau};
use skein_geometry::{Curve, Segment};

/// Where on the straight way one may be beside it, as shares of it.
const PLACES: [f64; 5] = [0.5, 0.35, 0.65, 0.2, 0.8];

/// Offsets beside the straight way, in separations.
const OFFSETS: [f64; 18] = [
    0.2, 0.4, 0.6, 0.8, 1.0, 1.3, 1.6, 2.0, 2.4, 2.8, 3.3, 3.8, 4.4, 5.0, 5.7, 6.5, 7.5, 9.0,
];

/// Airspeeds, as shares of cruise; the airframe's own limits cut them.
const AIRSPEEDS: [f64; 3] = [1.0, 0.9, 1.1];

/// Circles that are waited at most before the way begins.
const CIRCLES: u32 = 2;

/// What passing on the left costs on top, in seconds: as long as others choose likewise,
/// both turn to the right and neither meets the other's evasion.
const LEFT_S: f64 = 1.0;

/// A turn of less than this is no turn, radians: on a kilometre it is a millimetre.
const NO_TURN_RAD: f64 = 1e-6;

/// A way to a goal.
#[derive(Clone, Debug, PartialEq)]
pub struct Detour {
    /// What is flown.
    pub stretches: Vec<Stretch>,
    /// Flying time, seconds.
    pub duration_s: f64,
    /// What it costs, seconds: its flying time at cruise, by how much another airspeed changes
    /// that, either way, and the energy beyond cruise, in seconds of cruise. So cruise, which
    /// somebody chose for the mission, is the cheapest airspeed.
    pub cost_s: f64,
}

/// Makes ways for one airframe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detours {
    /// The airframe.
    pub airframe: Airframe,
    /// The separation that others keep, metres: the measure of offsets.
    pub separation_m: f64,
}

impl Detours {
    /// The direct way at cruise; `None` only where a goal is nearer than any turn.
    #[must_use]
    pub fn direct(&self, from: Pose, goal: Point) -> Option<Detour> {
        let price = Price::at(&self.airframe, self.airframe.cruise_mps);
        let way = Candidate {
            circles: 0,
            price,
            pieces: towards(from, goal, price.radius_m)?,
        };
        Some(way.made(way.cost_s(0.0)))
    }

    /// No way to a goal costs less than this, seconds: straight there at cruise.
    #[must_use]
    pub fn least_cost_s(&self, from: Pose, goal: Point) -> f64 {
        (goal - from.position()).norm() / self.airframe.cruise_mps
    }

    /// The ways from a pose to a goal that cost at most so much, seconds, cheapest first; each is
    /// made when it is asked for.
    pub fn ways(&self, from: Pose, goal: Point, most_s: f64) -> impl Iterator<Item = Detour> {
        let mut found: Vec<Candidate> = Vec::new();
        let mut order: Vec<(f64, usize)> = Vec::new();
        for share in AIRSPEEDS {
            let mps = (share * self.airframe.cruise_mps)
                .clamp(self.airframe.least_airspeed_mps(), self.airframe.max_mps);
            let price = Price::at(&self.airframe, mps);
            let courses = self.courses(from, goal, price.radius_m);
            for circles in 0..=CIRCLES {
                for (pieces, extra_s) in &courses {
                    let way = Candidate {
                        circles,
                        price,
                        pieces: *pieces,
                    };
                    let cost_s = way.cost_s(*extra_s);
                    if cost_s <= most_s {
                        order.push((cost_s, found.len()));
                        found.push(way);
                    }
                }
            }
        }
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let made = move |(cost_s, nth): (f64, usize)| Some(found.get(nth)?.made(cost_s));
        order.into_iter().filter_map(made)
    }

    /// All courses to a goal at one airspeed, and what each costs on top, seconds.
    fn courses(&self, from: Pose, goal: Point, radius_m: f64) -> Vec<(Pieces, f64)> {
        let direct = towards(from, goal, radius_m).map(|way| (way, 0.0));
        let mut courses: Vec<(Pieces, f64)> = direct.into_iter().collect();
        let straight = goal - from.position();
        let length_m = straight.norm();
        if length_m < f64::EPSILON {
            return courses;
        }
        let right = Vector::new(straight.y, -straight.x) / length_m;
        for place in PLACES {
            for offset in OFFSETS {
                for (side, extra_s) in [(1.0, 0.0), (-1.0, LEFT_S)] {
                    let beside = right * (side * offset * self.separation_m);
                    let via = from.position() + straight * place + beside;
                    courses.extend(through(from, via, goal, radius_m).map(|way| (way, extra_s)));
                }
            }
        }
        courses
    }
}

/// Turns and lines of a course, two each at most.
#[derive(Clone, Copy, Debug, Default)]
struct Pieces {
    /// Curvatures, 1/m, and lengths, metres.
    all: [(f64, f64); 4],
    count: usize,
}

impl Pieces {
    /// Appends a piece that is longer than a tenth of a millimetre, if there is room.
    fn push(&mut self, piece: (f64, f64)) {
        if let Some(free) = self.all.get_mut(self.count).filter(|_| piece.1 > 1e-4) {
            *free = piece;
            self.count += 1;
        }
    }

    fn iter(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.all.iter().take(self.count).copied()
    }

    fn length_m(&self) -> f64 {
        self.iter().map(|(_, length_m)| length_m).sum()
    }

    /// Where it ends that begins at a pose; nothing where there is nothing to fly.
    fn end(&self, from: Pose) -> Option<Pose> {
        let after = |start, (curvature_per_m, length_m)| {
            let piece = Segment {
                start,
                curvature_per_m,
                length_m,
            };
            piece.end()
        };
        (self.count > 0).then(|| self.iter().fold(from, after))
    }
}

/// What flying at one airspeed comes to.
#[derive(Clone, Copy, Debug)]
struct Price {
    mps: f64,
    cruise_mps: f64,
    /// Of its turns.
    radius_m: f64,
    /// Power on a line and in a turn, of that at cruise.
    line: f64,
    turn: f64,
}

impl Price {
    fn at(airframe: &Airframe, mps: f64) -> Self {
        let radius_m = airframe.ground_turn_radius_m(mps, 0.0);
        let power = PowerModel::of(airframe);
        let share = |curvature_per_m: f64| {
            let rate = curvature_per_m * mps;
            power.share(mps, atan2(rate * mps, GRAVITY_MPS2))
        };
        Self {
            mps,
            cruise_mps: airframe.cruise_mps,
            radius_m,
            line: share(0.0),
            turn: share(1.0 / radius_m),
        }
    }
}

/// A way that was not made yet.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    /// Circles to the right that are waited first.
    circles: u32,
    price: Price,
    pieces: Pieces,
}

impl Candidate {
    /// All that is flown, as curvatures, 1/m, and lengths, metres.
    fn flown(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let radius_m = self.price.radius_m;
        let circle = (-1.0 / radius_m, TAU * radius_m);
        (0..self.circles)
            .map(move |_| circle)
            .chain(self.pieces.iter())
    }

    fn length_m(&self) -> f64 {
        self.flown().map(|(_, length_m)| length_m).sum()
    }

    fn cost_s(&self, extra_s: f64) -> f64 {
        let Price {
            mps,
            cruise_mps,
            line,
            turn,
            ..
        } = self.price;
        let energy_s: f64 = self
            .flown()
            .map(|(bend, length_m)| if bend == 0.0 { line } else { turn } * length_m / mps)
            .sum();
        let length_m = self.length_m();
        let at_cruise_s = length_m / cruise_mps;
        let hurry_s = (length_m / mps - at_cruise_s).abs();
        let burnt_s = (energy_s - at_cruise_s).max(0.0);
        at_cruise_s + hurry_s + burnt_s + extra_s
    }

    fn made(&self, cost_s: f64) -> Detour {
        Detour {
            stretches: flown_at(self.flown(), self.price.mps),
            duration_s: self.length_m() / self.price.mps,
            cost_s,
        }
    }
}

/// The stretches of a curve at one airspeed.
#[must_use]
pub fn stretches(curve: &Curve, airspeed_mps: f64) -> Vec<Stretch> {
    let pieces = curve.segments().iter();
    flown_at(
        pieces.map(|s| (s.curvature_per_m, s.length_m)),
        airspeed_mps,
    )
}

fn flown_at(pieces: impl Iterator<Item = (f64, f64)>, airspeed_mps: f64) -> Vec<Stretch> {
    let stretch = |(curvature_per_m, length_m)| Stretch {
        radius_mm: radius_mm(curvature_per_m),
        length_mm: to_mm(length_m),
        airspeed_mmps: to_mm(airspeed_mps),
    };
    pieces.map(stretch).filter(|s| s.length_mm > 0).collect()
}

/// A turn and a line to a place, whatever the heading there; `None` if the place lies within
/// both turns.
fn towards(from: Pose, to: Point, radius_m: f64) -> Option<Pieces> {
    let left = turn_and_line(from, to, radius_m);
    let right = turn_and_line(from, to, -radius_m);
    match (left, right) {
        (Some(l), Some(r)) => Some(if l.length_m() < r.length_m() { l } else { r }),
        (one, other) => one.or(other),
    }
}

/// The same with the turn to one side: the radius is positive to the left.
fn turn_and_line(from: Pose, to: Point, radius_m: f64) -> Option<Pieces> {
    let (side, r) = (radius_m.signum(), radius_m.abs());
    let d = from.direction();
    let centre = from.position() + Vector::new(-d.y, d.x) * radius_m;
    let v = to - centre;
    let far_m = v.norm();
    if far_m <= r {
        return None;
    }
    let line_m = (far_m * far_m - r * r).sqrt();
    let course_rad = atan2(v.y, v.x) + side * asin(r / far_m);
    let mut turned_rad = wrap_tau(side * (course_rad - from.heading_rad));
    if turned_rad > TAU - NO_TURN_RAD {
        turned_rad = 0.0;
    }
    let mut way = Pieces::default();
    way.push((side / r, turned_rad * r));
    way.push((0.0, line_m));
    Some(way)
}

fn through(from: Pose, via: Point, goal: Point, radius_m: f64) -> Option<Pieces> {
    let mut way = towards(from, via, radius_m)?;
    let there = way.end(from)?;
    for piece in towards(there, goal, radius_m)?.iter() {
        way.push(piece);
    }
    Some(way)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The airframe of the reference figures: 20 m/s at 30 degrees of bank.
    fn airframe() -> Airframe {
        Airframe {
            stall_mps: 13.0,
            cruise_mps: 20.0,
            max_mps: 26.0,
            max_bank_rad: std::f64::consts::FRAC_PI_6,
            endurance_s: 3600.0,
            reserve_s: 300.0,
            footprint_across_m: 40.0,
            footprint_along_m: 30.0,
            mount: crate::mount::Mount::Level,
            climb_mps: crate::airframe::CLIMB_MPS,
        }
    }

    #[test]
    fn the_direct_way_is_the_cheapest_and_all_get_there() {
        let makes = Detours {
            airframe: airframe(),
            separation_m: 50.0,
        };
        let from = Pose::new(Point::new(-600.0, 3.0), 0.1);
        let goal = Point::new(600.0, 0.0);
        let direct = makes.direct(from, goal).unwrap();
        let ways: Vec<Detour> = makes.ways(from, goal, f64::INFINITY).collect();
        assert!(ways.len() > 1_000, "{}", ways.len());
        assert!(ways[0].cost_s > direct.cost_s - 0.05, "{:?}", ways[0]);
        for w in &ways {
            let pieces: Vec<(f64, f64)> = w
                .stretches
                .iter()
                .map(|s| {
                    let bend = match s.radius_mm {
                        0 => 0.0,
                        r => 1e3 / f64::from(r),
                    };
                    (bend, f64::from(s.length_mm) / 1e3)
                })
                .collect();
            let end = Curve::from_pieces(from, &pieces).end().unwrap();
            // Radii are whole millimetres, which shows at the end of a circle and a kilometre.
            assert!((end.position() - goal).norm() < 0.3, "{w:?}");
        }
    }

    #[test]
    fn a_goal_beside_a_uav_is_reached_by_the_other_turn() {
        let makes = Detours {
            airframe: airframe(),
            separation_m: 50.0,
        };
        let from = Pose::new(Point::new(0.0, 0.0), 0.0);
        let goal = Point::new(0.0, 70.0);
        let way = makes.direct(from, goal).unwrap();
        assert!(way.stretches[0].radius_mm < 0, "{way:?}");
    }
}
