//! Transfers off the loop, by what the mission wants to spend little of (D2.7 §2.4.2).
//!
//! In calm air a transfer is the router's curve, unless turns are to be spared. In a
//! wind the fastest flight between two poses is made of trochoids, which turn with the
//! air and not against it; so the best flight of [`Flight`] competes with the router's
//! curve, flown with the nose held into the wind, and the cheaper one is flown. Both are curves over the ground when
//! they leave here, proved to keep the clearance from the zones as they are; what has
//! no proof is not emitted.
//!
//! What a transfer costs is told in metres: of the way through the air for time, over the
//! ground for distance, of cruise for energy.

use super::transit::Transit;
use skein_flight::coverage::ring::Direction;
use skein_flight::route::RouteError;
use skein_flight::trajectory::Trajectory;
use skein_flight::trajectory::timed::{Airspeeds, Flight, Objective};
use skein_flight::trajectory::wind::{Course, Performance, turn_round_s};
use skein_geometry::Curve;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::{TAU, atan2, wrap_pi};

/// Lines and arcs stray at most this from the trochoid that they stand for, metres: a
/// hundredth of the least tracking error.
const FIT_M: f64 = 0.02;

/// Share of the fastest turn that transfers through the air plan: the rest takes errors away.
const TURNING: f64 = 0.9;

/// Courses tried at a point where any will do: every 22.5°, so that the best one is
/// missed by a few percent of a turn's time.
const COURSES: u8 = 16;

impl Transit {
    /// A clear way between two poses that face along their courses, the cheapest found.
    pub(super) fn transfer(&self, from: Pose, to: Pose) -> Result<Curve, RouteError> {
        let over_ground = self.router.route(from, to);
        if self.is_shortest_best() {
            return over_ground;
        }
        self.cheaper(self.through_air(from, to), over_ground)
    }

    /// As [`Transit::transfer`], with any course at the end.
    pub(super) fn transfer_to_point(&self, from: Pose, to: Point) -> Result<Curve, RouteError> {
        let over_ground = self.router.route_to_point(from, to);
        if self.is_shortest_best() {
            return over_ground;
        }
        let ahead = to - from.position();
        let straight_rad = atan2(ahead.y, ahead.x);
        let all = (0..COURSES).filter_map(|i| {
            let course_rad = straight_rad + TAU * f64::from(i) / f64::from(COURSES);
            self.through_air(from, Pose::new(to, wrap_pi(course_rad)))
        });
        let best = all.min_by(|a, b| a.0.total_cmp(&b.0));
        self.cheaper(best, over_ground)
    }

    /// Whether nothing beats the shortest way: in calm air, unless turns are to be spared.
    fn is_shortest_best(&self) -> bool {
        self.air().is_calm() && self.objective != Objective::Energy
    }

    /// The flight as lines and arcs, if they are clear and it costs less, else the route.
    fn cheaper(
        &self,
        flight: Option<(f64, Trajectory)>,
        route: Result<Curve, RouteError>,
    ) -> Result<Curve, RouteError> {
        let route_m = route.as_ref().map_or(f64::INFINITY, |g| self.cost_m(g));
        let Some((_, trajectory)) = flight.filter(|(cost_m, _)| *cost_m < route_m) else {
            return route;
        };
        let curve = trajectory.over_ground(FIT_M);
        let clearance_m = self.router.limits().clearance_m;
        if self.router.zones().is_clear(&curve, clearance_m) {
            Ok(curve)
        } else {
            route
        }
    }

    /// The cheapest flight at the airspeed of the mission with its cost, metres; `None`
    /// where none is proved clear.
    fn through_air(&self, from: Pose, to: Pose) -> Option<(f64, Trajectory)> {
        let air = self.air();
        let nose = |p: Pose| {
            let heading = air
                .wind
                .heading_for_course(Course(p.heading_rad), air.airspeed_mps)?;
            Some(Pose::new(p.position(), heading.0))
        };
        let flight = Flight {
            from: nose(from)?,
            to: nose(to)?,
            airframe: &self.airframe,
            airspeeds: Airspeeds::Only(air.airspeed_mps),
            wind: air.wind,
            objective: self.objective,
            zones: self.router.zones(),
            margin_m: self.router.limits().clearance_m,
            turning: TURNING,
        };
        let (trajectory, cost) = flight.best().ok()?;
        let cost_m = match self.objective {
            Objective::Time => cost * air.airspeed_mps,
            Objective::Distance => cost,
            Objective::Energy => cost * self.airframe.cruise_mps,
        };
        Some((cost_m, trajectory))
    }

    /// What a curve over the ground costs, metres.
    pub(super) fn cost_m(&self, curve: &Curve) -> f64 {
        let air = self.air();
        match self.objective {
            Objective::Time => air.air_length_m(curve),
            Objective::Distance => curve.length_m(),
            Objective::Energy => Trajectory::along(curve, air.airspeed_mps, air.wind)
                .map_or(f64::INFINITY, |t| {
                    t.energy_s(&self.airframe) * self.airframe.cruise_mps
                }),
        }
    }

    /// What a cell costs that is only passed, metres.
    pub(super) fn passing_m(&self, cell: u16, direction: Direction) -> f64 {
        let both = self.cells_cost_m.get(usize::from(cell));
        match (both, direction) {
            (Some(both), Direction::Forward) => both[0],
            (Some(both), Direction::Backward) => both[1],
            (None, _) => self.travel_m(cell),
        }
    }

    /// The longest time to turn round in the wind, whatever the course, seconds.
    #[must_use]
    pub fn turn_round_s(&self) -> f64 {
        let air = self.air();
        let bank_rad = self.airframe.steepest_bank_rad(air.airspeed_mps);
        let uav = Performance {
            airspeed_mps: air.airspeed_mps,
            turn_radius_m: self.airframe.banked_radius_m(air.airspeed_mps, bank_rad) / TURNING,
        };
        turn_round_s(uav, air.wind).unwrap_or(f64::INFINITY)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reactive::air::{self, Air};
    use crate::reactive::follow::{Track, fly};
    use crate::testing::{CLEARANCE_M, airframe, loop_and_router, rectangle};
    use proptest::prelude::*;
    use skein_flight::trajectory::wind::Wind;
    use skein_geometry::Polygon;
    use skein_geometry::math::{PI, cos, sin};

    /// A transit in a wind of `share` of what the turns of the mission allow.
    fn transit(zones: Vec<Polygon>, share: f64, towards_rad: f64, objective: Objective) -> Transit {
        let (coverage_loop, router) = loop_and_router(8, 6, zones);
        let a = airframe();
        let radius_m = router.limits().turn_radius_m;
        let most_mps = a.airspeed_for_turns_mps(radius_m, 0.0).min(a.cruise_mps);
        let wind_mps = share * (most_mps - a.least_airspeed_mps());
        let wind = Wind::new(wind_mps * cos(towards_rad), wind_mps * sin(towards_rad));
        let airspeed_mps = Air::airspeed_for_turns_mps(&a, wind, radius_m);
        let mut transit = Transit::new(coverage_loop, router, a).with_objective(objective);
        transit.set_air(Air { wind, airspeed_mps });
        transit
    }

    /// The least distance of a curve from the zones by places a decimetre apart, metres.
    fn sampled_m(curve: &Curve, zones: &[Polygon]) -> f64 {
        let mut least_m = f64::INFINITY;
        let mut at_m = 0.0;
        while at_m <= curve.length_m() {
            let p = curve.pose_at(at_m).unwrap().position();
            let each = zones.iter().map(|z| z.distance_m(p));
            least_m = each.fold(least_m, f64::min);
            at_m += 0.1;
        }
        least_m
    }

    fn objectives() -> impl Strategy<Value = Objective> {
        prop::sample::select(vec![
            Objective::Time,
            Objective::Distance,
            Objective::Energy,
        ])
    }

    /// The largest distance from a curve that is flown by percepts every 200 ms, metres.
    fn strayed_m(transit: &Transit, curve: &Curve) -> f64 {
        let air = *transit.air();
        let limit = transit.airframe.max_turn_rate_radps(air.airspeed_mps);
        let start = curve.start().unwrap();
        let heading = air
            .wind
            .heading_for_course(Course(start.heading_rad), air.airspeed_mps);
        let mut pose = Pose::new(start.position(), heading.unwrap().0);
        let (mut track, mut worst_m) = (Track::new(curve), 0.0f64);
        for _ in 0..3000 {
            let offset = track.advance(&air.over_ground(pose), 6.0).unwrap();
            worst_m = worst_m.max(offset.cross_m.abs());
            if track.left_m() < 1.0 {
                return worst_m;
            }
            let turns = air::steps(&track, offset, &air, limit);
            pose = fly(pose, air.airspeed_mps, &turns, 200);
            pose.east_m += 0.2 * air.wind.east_mps;
            pose.north_m += 0.2 * air.wind.north_mps;
        }
        f64::INFINITY
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(96))]

        #[test]
        fn every_transfer_keeps_clear_and_is_followed(
            share in 0.0f64..1.0, towards in 0.0f64..TAU, objective in objectives(),
            blocks in prop::collection::vec((20.0f64..340.0, 20.0f64..240.0, 8.0f64..70.0, 8.0f64..70.0), 0..4),
            from in (0.0f64..380.0, 0.0f64..280.0, -3.1f64..3.1), to in (0.0f64..380.0, 0.0f64..280.0, -3.1f64..3.1),
        ) {
            let zones: Vec<Polygon> = blocks.iter().map(|&(x, y, w, h)| rectangle(x, y, w, h)).collect();
            let transit = transit(zones.clone(), share, towards, objective);
            let pose = |(x, y, rad): (f64, f64, f64)| Pose::new(Point::new(x, y), rad);
            let (from, to) = (pose(from), pose(to));
            let plain = transit.router.route(from, to);
            let leg = transit.transfer(from, to);
            prop_assert!(leg.is_ok() || plain.is_err());
            let any = transit.transfer_to_point(from, to.position());
            for curve in [&leg, &any].into_iter().flatten() {
                prop_assert!(sampled_m(curve, &zones) > CLEARANCE_M - 1e-3);
                prop_assert!((curve.end().unwrap().position() - to.position()).norm() < 0.01);
                prop_assert!(curve.largest_gap_m() < 1e-3);
                let strayed_m = strayed_m(&transit, curve);
                prop_assert!(strayed_m < 1.0, "{strayed_m}");
            }
            if let (Ok(leg), Ok(plain)) = (&leg, &plain) {
                // Lines and arcs cost what the trochoid does but for what they cut.
                prop_assert!(transit.cost_m(leg) <= transit.cost_m(plain) * 1.0002 + 0.02);
                prop_assert!(wrap_pi(leg.end().unwrap().heading_rad - to.heading_rad).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn turning_with_the_air_saves_time_and_each_objective_gets_its_own() {
        let transits = [Objective::Time, Objective::Distance, Objective::Energy]
            .map(|objective| transit(Vec::new(), 1.0, PI / 3.0, objective));
        let from = Pose::new(Point::new(0.0, 0.0), 0.0);
        let mut sums = [[0.0; 3]; 4];
        for i in 0..200 {
            let (angle_rad, heading_rad) = (f64::from(i) * 2.4, f64::from(i) * 1.7);
            let away_m = 30.0 + f64::from(i % 20) * 12.0;
            let at = Point::new(away_m * cos(angle_rad), away_m * sin(angle_rad));
            let to = Pose::new(at, wrap_pi(heading_rad));
            let legs = transits.each_ref().map(|t| t.transfer(from, to).unwrap());
            let plain = transits[0].router.route(from, to).unwrap();
            for (sum, leg) in sums.iter_mut().zip(legs.iter().chain([&plain])) {
                for (total, c) in sum.iter_mut().zip(&transits) {
                    *total += c.cost_m(leg);
                }
            }
        }
        let [time, distance, energy, plain] = sums;
        assert!(time[0] < 0.97 * plain[0], "{sums:?}");
        for (i, own) in [time, distance, energy].iter().enumerate() {
            let others = [time, distance, energy, plain];
            let least = others.iter().map(|o| o[i]).fold(f64::INFINITY, f64::min);
            assert!(own[i] <= least + 1e-6, "{i}: {sums:?}");
        }
        assert!(time[0] < energy[0] && energy[2] < time[2], "{sums:?}");
    }

    #[test]
    fn a_wind_from_any_side_is_turned_round_in_within_what_is_told() {
        let c = transit(Vec::new(), 0.8, 1.0, Objective::Time);
        let told_s = c.turn_round_s();
        for i in 0..24 {
            let from = Pose::new(Point::new(0.0, 0.0), f64::from(i) * 0.26);
            let leg = c.transfer(from, from.reversed()).unwrap();
            let took_s = c.air().air_length_m(&leg) / c.air().airspeed_mps;
            assert!(took_s < told_s + 0.3, "{took_s} {told_s}");
        }
    }
}
