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
//! O(offsets · places · airspeeds · circles): some sixteen hundred candidates, made and
//! sorted at each search.

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
        let mps = self.airframe.cruise_mps;
        let way = towards(from, goal, self.airframe.ground_turn_radius_m(mps, 0.0))?;
        Some(self.priced(&way, mps, 0.0))
    }

    /// No way to a goal costs less than this, seconds: straight there at cruise.
    #[must_use]
    pub fn least_cost_s(&self, from: Pose, goal: Point) -> f64 {
        (goal - from.position()).norm() / self.airframe.cruise_mps
    }

    /// All ways from a pose to a goal, cheapest first.
    #[must_use]
    pub fn all(&self, from: Pose, goal: Point) -> Vec<Detour> {
        let mut ways: Vec<Detour> = Vec::new();
        for share in AIRSPEEDS {
            let mps = (share * self.airframe.cruise_mps)
                .clamp(self.airframe.least_airspeed_mps(), self.airframe.max_mps);
            let radius_m = self.airframe.ground_turn_radius_m(mps, 0.0);
            for circles in 0..=CIRCLES {
                self.at_airspeed(from, goal, (mps, radius_m, circles), &mut ways);
            }
        }
        ways.sort_by(|a, b| a.cost_s.total_cmp(&b.cost_s));
        ways
    }

    fn at_airspeed(
        &self,
        from: Pose,
        goal: Point,
        (mps, radius_m, circles): (f64, f64, u32),
        ways: &mut Vec<Detour>,
    ) {
        let wait = waiting(from, radius_m, circles);
        let mut add = |curve: Option<Curve>, extra_s: f64| {
            if let Some(c) = curve {
                let mut all = wait.clone();
                all.extend(&c);
                ways.push(self.priced(&all, mps, extra_s));
            }
        };
        add(towards(from, goal, radius_m), 0.0);
        let straight = goal - from.position();
        let length_m = straight.norm();
        if length_m < f64::EPSILON {
            return;
        }
        let right = Vector::new(straight.y, -straight.x) / length_m;
        for place in PLACES {
            for offset in OFFSETS {
                for (side, extra_s) in [(1.0, 0.0), (-1.0, LEFT_S)] {
                    let beside = right * (side * offset * self.separation_m);
                    let via = from.position() + straight * place + beside;
                    add(through(from, via, goal, radius_m), extra_s);
                }
            }
        }
    }

    fn priced(&self, curve: &Curve, mps: f64, extra_s: f64) -> Detour {
        let duration_s = curve.length_m() / mps;
        let power = PowerModel::of(&self.airframe);
        let energy_s: f64 = curve
            .segments()
            .iter()
            .map(|s| {
                let rate = s.curvature_per_m.abs() * mps;
                let bank = atan2(rate * mps, GRAVITY_MPS2);
                power.share(mps, bank) * s.length_m / mps
            })
            .sum();
        let at_cruise_s = curve.length_m() / self.airframe.cruise_mps;
        let hurry_s = (duration_s - at_cruise_s).abs();
        let burnt_s = (energy_s - at_cruise_s).max(0.0);
        Detour {
            stretches: stretches(curve, mps),
            duration_s,
            cost_s: at_cruise_s + hurry_s + burnt_s + extra_s,
        }
    }
}

/// Circles to the right at a pose.
fn waiting(from: Pose, radius_m: f64, circles: u32) -> Curve {
    let mut wait = Curve::empty();
    for _ in 0..circles {
        wait.push(Segment {
            start: from,
            curvature_per_m: -1.0 / radius_m,
            length_m: TAU * radius_m,
        });
    }
    wait
}

/// The stretches of a curve at one airspeed.
#[must_use]
pub fn stretches(curve: &Curve, airspeed_mps: f64) -> Vec<Stretch> {
    curve
        .segments()
        .iter()
        .map(|s| Stretch {
            radius_mm: radius_mm(s.curvature_per_m),
            length_mm: to_mm(s.length_m),
            airspeed_mmps: to_mm(airspeed_mps),
        })
        .filter(|s| s.length_mm > 0)
        .collect()
}

/// A turn and a line to a place, whatever the heading there; `None` if the place lies within
/// both turns.
fn towards(from: Pose, to: Point, radius_m: f64) -> Option<Curve> {
    let left = turn_and_line(from, to, radius_m);
    let right = turn_and_line(from, to, -radius_m);
    match (left, right) {
        (Some(l), Some(r)) => Some(if l.length_m() < r.length_m() { l } else { r }),
        (one, other) => one.or(other),
    }
}

/// The same with the turn to one side: the radius is positive to the left.
fn turn_and_line(from: Pose, to: Point, radius_m: f64) -> Option<Curve> {
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
    Some(Curve::from_pieces(
        from,
        &[(side / r, turned_rad * r), (0.0, line_m)],
    ))
}

fn through(from: Pose, via: Point, goal: Point, radius_m: f64) -> Option<Curve> {
    let mut way = towards(from, via, radius_m)?;
    let there = way.end()?;
    way.extend(&towards(there, goal, radius_m)?);
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
        let ways = makes.all(from, goal);
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
