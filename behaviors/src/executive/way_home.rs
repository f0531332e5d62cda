//! What the way home takes at most from anywhere on the loop (D2.7 §2.3.1: zones are kept clear
//! of on the way home, too).
//!
//! Most boundaries of the loop see the home: their way is straight. Between the others and the
//! home zones lie; boundaries that follow each other there lie behind the same zones, so one
//! route is looked for from the middle of each such run, and from its other boundaries the loop
//! is flown to that one first.

use super::transit::Transit;
use crate::reactive::air::Air;
use skein_flight::trajectory::wind::Course;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::atan2;
use skein_geometry::{Curve, Segment};

/// So many routes are looked for at most: of more runs those farthest from home count.
const MOST_ROUTES: usize = 32;

/// A run longer than this many boundaries is looked at in parts.
const LONGEST_RUN: usize = 16;

/// The ways home from the boundaries of a loop.
#[derive(Clone, Debug)]
pub(super) struct WaysHome {
    /// From boundaries that see the home: the farthest ones, as each course has its own wind.
    straight: Vec<Vector>,
    /// Round zones: the route from the middle of a run, and what is flown along the loop before
    /// it, metres.
    round: Vec<(Curve, f64)>,
}

impl WaysHome {
    /// Looks for the ways to `home`. Boundaries from which there is none are left out: nothing
    /// is known of them but that the loop leads on.
    pub(super) fn new(transit: &Transit, home: Point) -> Self {
        let (coverage_loop, router) = (&transit.coverage_loop, &transit.router);
        let clearance_m = router.limits().clearance_m;
        let from = |i: usize| coverage_loop.boundary(i).position();
        let sees_home = |i: usize| {
            let line = Segment::straight(from(i), home);
            router.zones().is_segment_clear(&line, clearance_m)
        };
        let (seen, hidden): (Vec<usize>, Vec<usize>) =
            (0..coverage_loop.len()).partition(|i| sees_home(*i));
        let mut runs: Vec<&[usize]> = hidden
            .chunk_by(|a, b| a + 1 == *b)
            .flat_map(|run| run.chunks(LONGEST_RUN))
            .collect();
        let far_m = |run: &[usize]| (home - from(run[run.len() / 2])).norm();
        runs.sort_by(|a, b| far_m(b).total_cmp(&far_m(a)));
        runs.truncate(MOST_ROUTES);
        let along_m = |a: usize, b: usize| {
            let cells = &coverage_loop.cells()[a..b];
            cells.iter().map(|c| f64::from(c.flown_mm())).sum::<f64>() / 1000.0
        };
        let route = |run: &[usize]| {
            let middle = run[run.len() / 2];
            let pose = coverage_loop.boundary(middle);
            let found = router.route_to_point(pose, home);
            let found = found.or_else(|_| router.route_to_point(pose.reversed(), home));
            let first_m = along_m(run[0], middle);
            let last_m = along_m(middle, run[run.len() - 1]);
            Some((found.ok()?, first_m.max(last_m)))
        };
        Self {
            straight: seen.into_iter().map(|i| home - from(i)).collect(),
            round: runs.into_iter().filter_map(route).collect(),
        }
    }

    /// What the longest of them takes in this air, seconds; infinite where the wind lets a UAV
    /// make no way.
    pub(super) fn longest_s(&self, air: &Air, cruise_mps: f64) -> f64 {
        let straight_s = |way: &Vector| {
            let speed_mps = if air.is_calm() {
                Some(cruise_mps)
            } else {
                let course = Course(atan2(way.y, way.x));
                air.wind.ground_speed_mps(course, air.airspeed_mps)
            };
            let makes_way = speed_mps.filter(|speed| *speed > 0.0);
            makes_way.map_or(f64::INFINITY, |speed| way.norm() / speed)
        };
        let speed_mps = if air.is_calm() {
            cruise_mps
        } else {
            air.airspeed_mps
        };
        let round_s = |(curve, along_m): &(Curve, f64)| {
            (air.air_length_m(curve) + air.longest_m(*along_m)) / speed_mps
        };
        let straight = self.straight.iter().map(straight_s);
        let round = self.round.iter().map(round_s);
        straight.chain(round).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::executive::Executive;
    use crate::testing::{airframe, loop_and_router, rectangle};
    use proptest::prelude::*;
    use skein_geometry::Polygon;

    fn flies_home(zones: &[Polygon], home: Point) -> Executive {
        let (coverage_loop, router) = loop_and_router(12, 10, zones.to_vec());
        Executive::new(airframe(), 90.0, coverage_loop, router).with_home(home)
    }

    /// What the route home takes from each boundary of the loop from which there is one, seconds.
    fn routes_s(executive: &Executive, home: Point) -> Vec<f64> {
        let transit = &executive.transit;
        let all = (0..transit.coverage_loop.len()).map(|i| transit.coverage_loop.boundary(i));
        let routes = all.filter_map(|pose| transit.router.route_to_point(pose, home).ok());
        routes
            .map(|route| route.length_m() / airframe().cruise_mps)
            .collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn no_route_home_takes_longer(
            walls in prop::collection::vec(
                (0.0..520.0f64, 0.0..420.0f64, 10.0..300.0f64, 10.0..300.0f64), 0..4),
            home in (-400.0..900.0f64, -400.0..800.0f64),
        ) {
            let zones: Vec<Polygon> = walls
                .iter()
                .map(|&(x, y, width, height)| rectangle(x, y, width, height))
                .collect();
            let home = Point::new(home.0, home.1);
            let executive = flies_home(&zones, home);
            let told_s = f64::from(executive.home_ms()) / 1000.0;
            for route_s in routes_s(&executive, home) {
                prop_assert!(route_s <= told_s, "{route_s} s home, {told_s} s told");
            }
        }
    }

    #[test]
    fn a_wall_before_the_home_counts() {
        // The home lies in a yard that is open on the far side.
        let yard = [
            rectangle(-300.0, -260.0, 1200.0, 20.0),
            rectangle(-300.0, -700.0, 20.0, 440.0),
            rectangle(880.0, -700.0, 20.0, 440.0),
        ];
        let home = Point::new(288.0, -320.0);
        let (walled, open) = (flies_home(&yard, home), flies_home(&[], home));
        let longest_s = routes_s(&walled, home).into_iter().fold(0.0, f64::max);
        assert!(f64::from(walled.home_ms()) / 1000.0 >= longest_s);
        assert!(
            walled.home_ms() > 2 * open.home_ms(),
            "{} ms, without walls {} ms",
            walled.home_ms(),
            open.home_ms()
        );
    }
}
