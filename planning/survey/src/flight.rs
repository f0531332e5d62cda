//! What flights of a team are predicted to take, whoever planned them (D2.7 §3.6): while
//! they are compared, and as the caller gets them.

use crate::flown;
use crate::team::Uav;
use skein_flight::airframe::{Airframe, CLIMB_MPS, GRAVITY_MPS2, PowerModel};
use skein_flight::mount::Mount;
use skein_geometry::Curve;
use skein_geometry::frame::Point;
use skein_geometry::math::{PI, atan2};

/// Stall speed of a typical survey UAV, as a share of the speed that it flies.
const TYPICAL_STALL: f64 = 0.6;

/// One UAV's flight while plans are compared.
#[derive(Clone, Debug, Default)]
pub(crate) struct Flight {
    /// Which of the team, from 0.
    pub uav: usize,
    /// What it is called.
    pub name: String,
    /// Its corners, from its start and back to it.
    pub track: Vec<Point>,
    /// Its corners without the ways from its start and back: what closes to be flown again
    /// and again.
    pub lap: Vec<Point>,
    /// Length through the air, metres.
    pub length_m: f64,
    /// Speed, m/s.
    pub speed_mps: f64,
    /// Turn radius, metres.
    pub turn_radius_m: f64,
    /// Distance of the lanes it flies, metres.
    pub lane_m: f64,
    /// Power in level cruise, watts.
    pub cruise_power_w: Option<f64>,
    /// How many straight passes it flies, where the planner knows passes.
    pub passes: Option<usize>,
    /// What it flies, piece by piece; empty if it stays.
    pub legs: Vec<Leg>,
}

impl Flight {
    /// Whether it leaves its start at all.
    pub(crate) fn flies(&self) -> bool {
        self.track.len() > 1
    }

    /// Length over the ground, metres.
    pub(crate) fn ground_m(&self) -> f64 {
        if self.legs.is_empty() {
            return self.length_m;
        }
        flown::length_m(&self.legs)
    }

    /// How long it takes, seconds.
    pub(crate) fn time_s(&self) -> f64 {
        self.length_m / self.speed_mps
    }

    /// Energy, watt-hours, if the power of cruise is known.
    pub(crate) fn energy_wh(&self) -> Option<f64> {
        let power_w = self.cruise_power_w?;
        Some(self.energy_s() * power_w / 3600.0)
    }

    /// Energy as seconds of level cruise: turns take more than level flight.
    pub(crate) fn energy_s(&self) -> f64 {
        let v = self.speed_mps;
        let bank_rad = atan2(v * v, GRAVITY_MPS2 * self.turn_radius_m);
        let power = PowerModel::of(&Airframe {
            stall_mps: TYPICAL_STALL * v,
            cruise_mps: v,
            max_mps: v,
            max_bank_rad: bank_rad,
            endurance_s: f64::INFINITY,
            reserve_s: 0.0,
            footprint_across_m: 0.0,
            footprint_along_m: 0.0,
            mount: Mount::Level,
            climb_mps: CLIMB_MPS,
        });
        let turned_rad: f64 = self
            .track
            .windows(3)
            .map(|w| turn_rad(w[0], w[1], w[2]))
            .sum();
        let more = power.share(v, bank_rad) - 1.0;
        self.time_s() + more * turned_rad * self.turn_radius_m / v
    }

    /// The same for the caller, flown at a height.
    pub(crate) fn told(&self, altitude_m: f64) -> UavFlight {
        UavFlight {
            name: self.name.clone(),
            path: self.track.clone(),
            lap: self.lap.clone(),
            altitude_m,
            speed_mps: self.speed_mps,
            turn_radius_m: self.turn_radius_m,
            length_m: self.ground_m(),
            time_s: self.time_s(),
            energy_s: self.energy_s(),
            energy_wh: self.energy_wh(),
            lane_m: self.flies().then_some(self.lane_m),
            passes: self.passes,
            legs: self.legs.clone(),
            stays: (!self.flies()).then_some(Stays::NotNeeded),
        }
    }
}

/// A stretch of a flight: lines and arcs that follow on the leg before without a gap or a
/// bend.
#[derive(Clone, Debug, PartialEq)]
pub struct Leg {
    /// What is flown, in the plane of the plan.
    pub curve: Curve,
    /// Whether the camera works on it; the others are ways and turns.
    pub sees: bool,
}

/// What one UAV of a team flies.
#[derive(Clone, Debug, PartialEq)]
pub struct UavFlight {
    /// What the UAV is called.
    pub name: String,
    /// Corners, from its start and back to it; its start alone if it stays.
    pub path: Vec<Point>,
    /// The corners over the area without the ways there and back: what closes to be flown
    /// again and again. Empty where targets are flown.
    pub lap: Vec<Point>,
    /// Height above home, metres.
    pub altitude_m: f64,
    /// Airspeed, m/s.
    pub speed_mps: f64,
    /// The tightest turn that it can fly, metres.
    pub turn_radius_m: f64,
    /// Length over the ground, metres, with the turns where the planner knows them.
    pub length_m: f64,
    /// How long it takes, seconds.
    pub time_s: f64,
    /// Energy as seconds of level cruise: turns take more than level flight.
    pub energy_s: f64,
    /// Energy, watt-hours, if the power of cruise is known and it was planned for.
    pub energy_wh: Option<f64>,
    /// Distance of the lanes it flies, metres.
    pub lane_m: Option<f64>,
    /// How many straight passes it flies, where the planner knows passes.
    pub passes: Option<usize>,
    /// What it flies, piece by piece, from its start and back to it; empty if it stays.
    pub legs: Vec<Leg>,
    /// Why it stays, if it does.
    pub stays: Option<Stays>,
}

/// Why a UAV stays at its start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stays {
    /// It is not needed, or has not the endurance.
    NotNeeded,
    /// It has none of the sensors that are asked for.
    NoSensor,
}

impl UavFlight {
    /// A UAV that was not planned for.
    pub(crate) fn stays(uav: &Uav, altitude_m: f64, why: Stays) -> Self {
        Self {
            name: uav.name.clone(),
            path: vec![uav.start],
            lap: Vec::new(),
            altitude_m,
            speed_mps: uav.speed_mps,
            turn_radius_m: uav.turn_radius_m,
            length_m: 0.0,
            time_s: 0.0,
            energy_s: 0.0,
            energy_wh: None,
            lane_m: None,
            passes: None,
            legs: Vec::new(),
            stays: Some(why),
        }
    }

    /// Whether it leaves its start at all.
    #[must_use]
    pub fn flies(&self) -> bool {
        self.stays.is_none()
    }
}

/// How far a corner turns, radians, either way.
fn turn_rad(a: Point, b: Point, c: Point) -> f64 {
    let (u, v) = (b - a, c - b);
    atan2(u.perp(&v).abs(), u.dot(&v)).min(PI)
}

/// Length of a track, metres.
pub(crate) fn length_m(track: &[Point]) -> f64 {
    track.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_cost_energy() {
        let at = |x: f64, y: f64| Point::new(x, y);
        let straight = Flight {
            track: vec![at(0.0, 0.0), at(500.0, 0.0), at(1000.0, 0.0)],
            length_m: 1000.0,
            speed_mps: 15.0,
            turn_radius_m: 30.0,
            ..Flight::default()
        };
        assert!((straight.energy_s() - straight.time_s()).abs() < 1e-9);
        let bent = Flight {
            track: vec![at(0.0, 0.0), at(500.0, 0.0), at(500.0, 500.0)],
            ..straight.clone()
        };
        assert!(bent.energy_s() > straight.energy_s() + 0.5);
    }
}
