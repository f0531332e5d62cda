//! What the tests of this crate share: an airframe, areas, and an exact world.

use crate::percept::Percept;
use crate::reactive::follow::fly;
use crate::setpoint::{Setpoint, Side};
use crate::traffic::Aircraft;
use skein_flight::airframe::{Airframe, CLIMB_MPS};
use skein_flight::coverage::lanes;
use skein_flight::coverage::ring::{CoverageLoop, LoopProblem};
use skein_flight::mount::Mount;
use skein_flight::route::{RouteLimits, Router};
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::PI;
use skein_geometry::{NoFlyZones, Polygon};
use std::sync::Arc;

/// Lane spacing of all tests, metres.
pub const LANE_M: f64 = 48.0;
/// Clearance of all tests, metres.
pub const CLEARANCE_M: f64 = 8.0;

/// A small fixed wing at 13 m/s, 45° of bank at most would turn at 17 m.
pub fn airframe() -> Airframe {
    Airframe {
        stall_mps: 9.0,
        cruise_mps: 13.0,
        max_mps: 18.0,
        max_bank_rad: 37.0 * PI / 180.0,
        endurance_s: 3600.0,
        reserve_s: 120.0,
        footprint_across_m: 46.0,
        footprint_along_m: 36.0,
        mount: Mount::Level,
        climb_mps: CLIMB_MPS,
    }
}

pub fn percept_at(pose: Pose, time_ms: u64) -> Percept {
    Percept {
        time_ms,
        pose,
        height_m: 90.0,
        airspeed_mps: 13.0,
        wind_east_mps: 0.0,
        wind_north_mps: 0.0,
        wind_unknown: false,
        endurance_s: 3000.0,
        takes_off_in_ms: 0,
        launch_ready: false,
        failsafe: false,
        circles_per_m: None,
        circles_in_ms: 0,
        traffic: crate::traffic::Traffic::default(),
        obstacles: crate::obstacle::Obstacles::default(),
        sightings: crate::sightings::Sightings::default(),
        contour: crate::contour::ContourLook::default(),
        crowd: crate::crowd::CrowdLook::default(),
        attitude: None,
    }
}

pub fn square(east_m: f64, north_m: f64, side_m: f64) -> Polygon {
    rectangle(east_m, north_m, side_m, side_m)
}

pub fn rectangle(east_m: f64, north_m: f64, width_m: f64, height_m: f64) -> Polygon {
    let (e, n) = (east_m, north_m);
    let ring = vec![
        (e, n),
        (e + width_m, n),
        (e + width_m, n + height_m),
        (e, n + height_m),
    ];
    Polygon::new(ring.into_iter().map(|(x, y)| Point::new(x, y)).collect()).unwrap()
}

/// A loop and a router over `cols` × `rows` cells around the given zones.
pub fn loop_and_router(
    cols: u32,
    rows: u32,
    zones: Vec<Polygon>,
) -> (Arc<CoverageLoop>, Arc<Router>) {
    let zones = Arc::new(NoFlyZones::new(zones));
    let problem = LoopProblem {
        area: rectangle(0.0, 0.0, f64::from(cols) * LANE_M, f64::from(rows) * LANE_M),
        zones: Arc::clone(&zones),
        lane_spacing_m: LANE_M,
        turn_radius_m: 23.5,
        clearance_m: CLEARANCE_M,
        footprint_across_m: 46.0,
        footprint_along_m: 36.0,
        tracking_error_m: 2.0,
        launch: Point::new(-30.0, -30.0),
        tree: skein_flight::coverage::ring::Tree::default(),
    };
    let coverage_loop = lanes::build(&problem).unwrap();
    let limits = RouteLimits {
        turn_radius_m: 23.5,
        clearance_m: CLEARANCE_M,
    };
    (
        Arc::new(coverage_loop),
        Arc::new(Router::new(zones, limits)),
    )
}

/// An airframe that plays setpoints exactly, and its failsafe without them.
#[derive(Clone, Debug)]
pub struct Wing {
    pub pose: Pose,
    pub time_ms: u64,
    pub setpoint: Option<Setpoint>,
    pub failsafe: bool,
    /// The wind, m/s towards east and north.
    pub wind_mps: (f64, f64),
    /// Every pose flown, one for each 10 ms.
    pub flown: Vec<Pose>,
}

impl Wing {
    pub fn new(pose: Pose) -> Self {
        Self {
            pose,
            time_ms: 0,
            setpoint: None,
            failsafe: false,
            wind_mps: (0.0, 0.0),
            flown: vec![pose],
        }
    }

    pub fn percept(&self) -> Percept {
        Percept {
            failsafe: self.failsafe,
            wind_east_mps: self.wind_mps.0,
            wind_north_mps: self.wind_mps.1,
            wind_unknown: false,
            ..percept_at(self.pose, self.time_ms)
        }
    }

    /// Flies for `ms`, a multiple of ten.
    pub fn fly(&mut self, ms: u64) {
        for _ in 0..ms / 10 {
            self.pose = self.next();
            self.pose.east_m += 0.01 * self.wind_mps.0;
            self.pose.north_m += 0.01 * self.wind_mps.1;
            self.time_ms += 10;
            self.flown.push(self.pose);
        }
    }

    fn next(&mut self) -> Pose {
        let a = airframe();
        let Some(s) = &self.setpoint else {
            return fly(self.pose, a.cruise_mps, &[], 10);
        };
        self.failsafe = self.time_ms >= s.from_ms + 1000;
        let limit = a.max_turn_rate_radps(s.airspeed_mps);
        let rate_at = |ms: u64| {
            if self.failsafe {
                return if s.loiter == Side::Left {
                    limit
                } else {
                    -limit
                };
            }
            let mut left = ms - s.from_ms;
            for step in &s.steps {
                if left < u64::from(step.duration_ms) {
                    return step.turn_rate_radps;
                }
                left -= u64::from(step.duration_ms);
            }
            s.steps.last().unwrap().turn_rate_radps
        };
        (0..10).fold(self.pose, |p, ms| {
            let turn_rate_radps = rate_at(self.time_ms + ms).clamp(-limit, limit);
            fly(
                p,
                s.airspeed_mps,
                &[crate::setpoint::Steer {
                    turn_rate_radps,
                    duration_ms: 1,
                }],
                1,
            )
        })
    }
}

/// An aircraft that is no member.
#[allow(clippy::cast_possible_truncation, reason = "some kilometres")]
pub fn aircraft(at: Point, v: Vector, height_m: f64) -> Aircraft {
    let dm = |m: f64| (10.0 * m).round() as i32;
    Aircraft {
        east_dm: dm(at.x),
        north_dm: dm(at.y),
        height_dm: dm(height_m),
        east_dmps: (10.0 * v.x).round() as i16,
        north_dmps: (10.0 * v.y).round() as i16,
    }
}
