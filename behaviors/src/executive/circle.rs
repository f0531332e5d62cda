//! A circle that is to be flown until somebody says otherwise, as a relay position is held
//! (D2.7 §1.2.3, executive layer): the way onto it from the side from which it is shortest, and
//! whether the UAV is on it.
//!
//! # Guarantees
//! What is flown is the circle that was given, either way round, and nothing else where there
//! is a way to it that keeps clear of the zones.
//!
//! # Complexity
//! Some Dubins lengths, and routes until `ROUTED` were found.

use super::transit::{Move, Place, Transit};
use super::{Aim, Executive, Kind};
use skein_flight::trajectory::dubins::length_m;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::{cos, sin};
use skein_geometry::{Curve, Segment};

/// Places at which a circle may be entered, each way round.
const ENTRIES: u32 = 16;

/// Of them, nearest first, so many are asked of the router at most.
const ROUTED: usize = 4;

/// Nearer than this two centres are the same, metres: rounding.
const SAME_M: f64 = 0.01;

/// The centre of a circle.
#[must_use]
pub fn centre(circle: &Segment) -> Point {
    let (at, heading_rad) = (circle.start.position(), circle.start.heading_rad);
    let left = Vector::new(-sin(heading_rad), cos(heading_rad));
    at + left * (1.0 / circle.curvature_per_m)
}

/// A full circle in two halves, because a whole one ends where it begins.
#[must_use]
pub fn halves(circle: &Segment) -> Curve {
    let piece = (circle.curvature_per_m, 0.5 * circle.length_m);
    Curve::from_pieces(circle.start, &[piece, piece])
}

/// The same circle, begun elsewhere and flown either way round.
fn entries(circle: &Segment) -> impl Iterator<Item = Segment> {
    let circle = *circle;
    let entered = move |k: u32| {
        let before = Segment {
            length_m: circle.length_m * f64::from(k) / f64::from(ENTRIES),
            ..circle
        };
        let start = before.end();
        let back = Segment {
            start: start.reversed(),
            curvature_per_m: -circle.curvature_per_m,
            ..circle
        };
        [Segment { start, ..circle }, back]
    };
    (0..ENTRIES).flat_map(entered)
}

impl Transit {
    /// The way onto a circle, and that circle. `None` where there is no way to it.
    #[must_use]
    pub fn way_to_circle(&self, from: &Place, circle: &Segment) -> Option<Vec<Move>> {
        let radius_m = self.turn_radius_m();
        let guess = |c: Segment| (length_m(from.pose, c.start, radius_m), c);
        let mut all: Vec<(f64, Segment)> = entries(circle).map(guess).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let routed = all
            .into_iter()
            .filter_map(|(_, c)| Some((self.route(from.pose, c.start).ok()?, c)));
        let found = routed.take(ROUTED);
        let (way, entered) = found.min_by(|a, b| a.0.length_m().total_cmp(&b.0.length_m()))?;
        Some(vec![Move::Route(way), Move::Loiter(entered)])
    }
}

impl Executive {
    /// Whether the UAV is on the circle that is its goal.
    #[must_use]
    pub fn is_on_circle(&self) -> bool {
        let Aim::Circle(goal) = self.aim else {
            return false;
        };
        let on = |c: Segment| (centre(&c) - centre(&goal)).norm() < SAME_M;
        let front = self.stretches.front().filter(|_| !self.replan);
        front.is_some_and(|s| matches!(s.kind, Kind::Loiter(c) if on(c)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Goal;
    use crate::testing::{CLEARANCE_M, Wing, airframe, loop_and_router, square};
    use skein_geometry::frame::Pose;

    fn circle_at(centre_m: (f64, f64), radius_m: f64) -> Segment {
        Segment {
            start: Pose::new(
                Point::new(centre_m.0 + radius_m, centre_m.1),
                core::f64::consts::FRAC_PI_2,
            ),
            curvature_per_m: 1.0 / radius_m,
            length_m: core::f64::consts::TAU * radius_m,
        }
    }

    #[test]
    fn a_circle_is_entered_from_anywhere_clear_of_the_zones() {
        let (coverage_loop, router) = loop_and_router(12, 10, vec![square(200.0, 100.0, 80.0)]);
        let transit = Transit::new(coverage_loop, router, airframe());
        let goal = circle_at((420.0, 140.0), 1.2 * transit.turn_radius_m());
        for k in 0..24 {
            let at = Point::new(20.0 * f64::from(k), 30.0);
            let pose = Pose::new(at, 0.7 * f64::from(k) - 3.0);
            let from = Place {
                pose,
                boundary: None,
            };
            let moves = transit.way_to_circle(&from, &goal).unwrap();
            let [Move::Route(way), Move::Loiter(circle)] = moves.as_slice() else {
                panic!("{moves:?}");
            };
            assert!((centre(circle) - centre(&goal)).norm() < SAME_M);
            let end = way.end().unwrap();
            assert!((end.position() - circle.start.position()).norm() < 1e-3);
            assert!(transit.router.zones().is_clear(way, CLEARANCE_M - 0.01));
        }
    }

    #[test]
    fn who_is_given_a_circle_flies_it_and_says_when_it_is_on_it() {
        let (coverage_loop, router) = loop_and_router(12, 10, vec![]);
        let radius_m = 1.2 * router.limits().turn_radius_m;
        let mut executive = Executive::new(airframe(), 90.0, coverage_loop, router);
        let goal = circle_at((400.0, 300.0), radius_m);
        let mut wing = Wing::new(Pose::new(Point::new(0.0, 0.0), 0.3));
        let mut step = |executive: &mut Executive| {
            let (setpoint, _) = executive.step(&wing.percept(), &|_| false);
            wing.setpoint = Some(setpoint);
            wing.fly(200);
            let off_m = (wing.pose.position() - centre(&goal)).norm() - radius_m;
            off_m.abs()
        };
        executive.set_goal(Goal::Circle(goal), &|_| false);
        assert!(!executive.is_on_circle());
        let mut on_it = 0;
        for _ in 0..600 {
            let off_m = step(&mut executive);
            if executive.is_on_circle() {
                on_it += 1;
                assert!(off_m < 2.0, "{off_m} m off the circle");
            }
        }
        assert!(on_it > 300, "{on_it}");
        // Held there, it stays; sent elsewhere, it leaves.
        executive.set_goal(Goal::Hold, &|_| false);
        for _ in 0..100 {
            let off_m = step(&mut executive);
            assert!(off_m < 2.0, "{off_m} m off the circle");
        }
    }
}
