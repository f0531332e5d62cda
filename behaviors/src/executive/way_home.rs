//! What the way home takes at most from each boundary of the loop (D2.7 §2.3.1: zones are kept
//! clear of on the way home, too).
//!
//! Most boundaries of the loop see the home: their way is straight. Between the others and the
//! home zones lie; boundaries that follow each other there lie behind the same zones, so one
//! route is looked for from the middle of each such run. From all others the loop is flown to a
//! boundary whose way is known, whichever makes the whole shortest.
//!
//! # Guarantees
//! Each time is that of a way that can be flown; the shortest takes no longer. A boundary from
//! which none is known has none: zones or the wind let nobody come home from there.
//!
//! # Complexity
//! At most `MOST_ROUTES` routes for a loop and a home; for each wind a few numbers a boundary.

use super::transit::Transit;
use skein_flight::coverage::ring::Direction;
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
    /// The straight way from each boundary that sees the home.
    straight: Vec<Option<Vector>>,
    /// Round zones: from which boundary, and the route.
    round: Vec<(usize, Curve)>,
}

/// Whether the straight way between two places keeps clear of the zones.
pub(super) fn is_straight_clear(transit: &Transit, from: Point, to: Point) -> bool {
    let router = &transit.router;
    let clearance_m = router.limits().clearance_m;
    router
        .zones()
        .is_segment_clear(&Segment::straight(from, to), clearance_m)
}

/// What a straight way takes in the air of a transit, seconds; infinite where the wind lets a
/// UAV make none.
pub(super) fn straight_s(transit: &Transit, way: Vector) -> f64 {
    let air = transit.air();
    let speed_mps = if air.is_calm() {
        Some(air.airspeed_mps)
    } else {
        let course = Course(atan2(way.y, way.x));
        air.wind.ground_speed_mps(course, air.airspeed_mps)
    };
    let makes_way = speed_mps.filter(|speed| *speed > 0.0);
    makes_way.map_or(f64::INFINITY, |speed| way.norm() / speed)
}

/// What so many metres through the air take, seconds.
pub(super) fn flown_s(transit: &Transit, air_m: f64) -> f64 {
    air_m / transit.air().airspeed_mps
}

impl WaysHome {
    /// Looks for the ways to `home`.
    pub(super) fn new(transit: &Transit, home: Point) -> Self {
        let (coverage_loop, router) = (&transit.coverage_loop, &transit.router);
        let from = |i: usize| coverage_loop.boundary(i).position();
        let straight: Vec<Option<Vector>> = (0..coverage_loop.len())
            .map(|i| is_straight_clear(transit, from(i), home).then(|| home - from(i)))
            .collect();
        let hidden: Vec<usize> = (0..coverage_loop.len())
            .filter(|i| straight[*i].is_none())
            .collect();
        let mut runs: Vec<&[usize]> = hidden
            .chunk_by(|a, b| a + 1 == *b)
            .flat_map(|run| run.chunks(LONGEST_RUN))
            .collect();
        let far_m = |run: &[usize]| (home - from(run[run.len() / 2])).norm();
        runs.sort_by(|a, b| far_m(b).total_cmp(&far_m(a)));
        runs.truncate(MOST_ROUTES);
        let route = |run: &[usize]| {
            let middle = run[run.len() / 2];
            let pose = coverage_loop.boundary(middle);
            let found = router.route_to_point(pose, home);
            let found = found.or_else(|_| router.route_to_point(pose.reversed(), home));
            Some((middle, found.ok()?))
        };
        Self {
            round: runs.into_iter().filter_map(route).collect(),
            straight,
        }
    }

    /// What the way home takes from each boundary in the air of a transit, without what turning
    /// towards it does, seconds; infinite where there is none.
    pub(super) fn each_s(&self, transit: &Transit) -> Vec<f64> {
        let way_s = |way: &Option<Vector>| way.map_or(f64::INFINITY, |w| straight_s(transit, w));
        let mut each_s: Vec<f64> = self.straight.iter().map(way_s).collect();
        for (from, curve) in &self.round {
            let takes_s = flown_s(transit, transit.air().air_length_m(curve));
            each_s[*from] = each_s[*from].min(takes_s);
        }
        self.along_the_loop(transit, &mut each_s);
        each_s
    }

    /// The next boundary this way along the loop from which a way is known that does not go on
    /// along it, and how many cells away it is.
    pub(super) fn next_known(&self, from: u16, direction: Direction) -> Option<(u16, usize)> {
        let n = self.straight.len();
        let at = |cells: usize| match direction {
            Direction::Forward => (usize::from(from) + cells) % n,
            Direction::Backward => (usize::from(from) + n - cells) % n,
        };
        let is_known = |i: usize| self.straight[i].is_some() || self.round.iter().any(|r| r.0 == i);
        let cells = (1..n).find(|cells| is_known(at(*cells)))?;
        Some((u16::try_from(at(cells)).ok()?, cells))
    }

    /// From no boundary it takes longer than to fly to the next one and home from there. Twice
    /// round each way: a way along the loop may begin anywhere.
    fn along_the_loop(&self, transit: &Transit, each_s: &mut [f64]) {
        let n = each_s.len();
        let cell_s = |i: usize, direction: Direction| {
            let cell = u16::try_from(i).unwrap_or(u16::MAX);
            flown_s(transit, transit.passed_m(cell, direction))
        };
        for i in (0..n).rev().chain((0..n).rev()) {
            let after = if i + 1 < n { i + 1 } else { 0 };
            each_s[i] = each_s[i].min(cell_s(i, Direction::Forward) + each_s[after]);
        }
        for i in (0..n).chain(0..n) {
            let after = if i + 1 < n { i + 1 } else { 0 };
            each_s[after] = each_s[after].min(cell_s(i, Direction::Backward) + each_s[i]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::executive::Executive;
    use crate::testing::{airframe, loop_and_router, percept_at, rectangle, square};
    use proptest::prelude::*;
    use skein_flight::trajectory::wind::Wind;
    use skein_geometry::Polygon;
    use skein_geometry::frame::Pose;

    fn flies_home(zones: &[Polygon], home: Point) -> Executive {
        let (coverage_loop, router) = loop_and_router(12, 10, zones.to_vec());
        Executive::new(airframe(), 90.0, coverage_loop, router).with_home(home)
    }

    /// What the route home takes from each boundary of the loop from which there is one, seconds.
    fn routes_s(executive: &Executive, home: Point) -> Vec<Option<f64>> {
        let transit = &executive.transit;
        let all = (0..transit.coverage_loop.len()).map(|i| transit.coverage_loop.boundary(i));
        let route = |pose| transit.router.route_to_point(pose, home).ok();
        all.map(|pose| Some(route(pose)?.length_m() / airframe().cruise_mps))
            .collect()
    }

    fn told_s(executive: &Executive, boundary: usize) -> Option<f64> {
        let ms = executive.home_from_ms(u16::try_from(boundary).unwrap())?;
        Some(f64::from(ms) / 1000.0)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        /// The time told at a boundary is that of a way: the shortest takes no longer, and where
        /// there is one a time is told.
        #[test]
        fn no_route_home_takes_longer_than_its_boundary_tells(
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
            for (i, route_s) in routes_s(&executive, home).into_iter().enumerate() {
                let Some(route_s) = route_s else { continue };
                let told_s = told_s(&executive, i);
                prop_assert!(
                    told_s.is_some_and(|told_s| route_s <= told_s),
                    "from {i}: {route_s} s home, {told_s:?} s told"
                );
            }
        }

        /// Against the wind it takes longer than with it, and nowhere less than the straight
        /// line does.
        #[test]
        fn in_a_wind_each_boundary_tells_its_own_way(
            towards_rad in 0.0..core::f64::consts::TAU,
            wind_mps in 0.5..6.0f64,
        ) {
            let home = Point::new(-200.0, -150.0);
            let mut executive = flies_home(&[square(180.0, 150.0, 60.0)], home);
            executive.set_air(Wind::new(
                wind_mps * towards_rad.cos(),
                wind_mps * towards_rad.sin(),
            ));
            let air = *executive.transit.air();
            for i in 0..executive.transit.coverage_loop.len() {
                let way = home - executive.transit.coverage_loop.boundary(i).position();
                let course = Course(atan2(way.y, way.x));
                let speed_mps = air.wind.ground_speed_mps(course, air.airspeed_mps).unwrap();
                let told_s = told_s(&executive, i).unwrap();
                prop_assert!(told_s >= way.norm() / speed_mps + 30.0 - 1e-3);
                prop_assert!(told_s < 3.0 * way.norm() / speed_mps + 120.0);
            }
        }
    }

    #[test]
    fn beside_the_home_it_takes_less_than_from_the_far_corner() {
        let home = Point::new(-60.0, -60.0);
        let executive = flies_home(&[], home);
        let transit = &executive.transit;
        let told = |i: &usize| executive.home_from_ms(u16::try_from(*i).unwrap()).unwrap();
        let away_m = |i: &usize| (transit.coverage_loop.boundary(*i).position() - home).norm();
        let mut all: Vec<usize> = (0..transit.coverage_loop.len()).collect();
        all.sort_by(|a, b| away_m(a).total_cmp(&away_m(b)));
        assert!(
            all.is_sorted_by_key(told),
            "in calm air without zones the straight way counts"
        );
        let (near, far) = (told(&all[0]), told(all.last().unwrap()));
        assert!(2 * near < far, "{near} {far}");
        assert_eq!(executive.home_ms(), far);
    }

    #[test]
    fn whom_a_wind_drives_off_has_no_way_home() {
        let home = Point::new(288.0, 240.0);
        let mut executive = flies_home(&[], home);
        // Nobody makes way against it.
        executive.set_air(Wind::new(40.0, 0.0));
        let transit = &executive.transit;
        for i in 0..transit.coverage_loop.len() {
            let at = transit.coverage_loop.boundary(i).position();
            if at.x > home.x {
                assert_eq!(told_s(&executive, i), None, "{at:?} is down the wind");
            }
        }
        assert!(executive.n_without_way_home(&|_| true) > 40);
        assert_eq!(executive.n_without_way_home(&|_| false), 0);
    }

    #[test]
    fn from_behind_walls_without_a_gate_there_is_no_way_home() {
        // The home lies in a yard that is shut.
        let yard = [
            rectangle(-300.0, -260.0, 1200.0, 20.0),
            rectangle(-300.0, -700.0, 20.0, 440.0),
            rectangle(880.0, -700.0, 20.0, 440.0),
            rectangle(-300.0, -720.0, 1200.0, 20.0),
        ];
        let executive = flies_home(&yard, Point::new(288.0, -480.0));
        let n = executive.transit.coverage_loop.len();
        assert!((0..n).all(|i| told_s(&executive, i).is_none()));
        let percept = percept_at(Pose::new(Point::new(20.0, 20.0), 0.0), 0);
        assert_eq!(executive.offered_ms(&percept, &|_| true), 0);
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
        let routes_s = routes_s(&walled, home).into_iter().flatten();
        let longest_s = routes_s.fold(0.0, f64::max);
        assert!(f64::from(walled.home_ms()) / 1000.0 >= longest_s);
        assert!(
            walled.home_ms() > 2 * open.home_ms(),
            "{} ms, without walls {} ms",
            walled.home_ms(),
            open.home_ms()
        );
    }
}
