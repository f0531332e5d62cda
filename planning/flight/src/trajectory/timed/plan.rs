//! The best trajectory between two poses for an objective (D2.7 §2.4.2): which
//! airspeed, and through the air or along a curve over the ground.
//!
//! For each of a few airspeeds the candidates are the fastest flight through the air
//! and all Dubins words over the ground whose turns the airframe can follow in the
//! wind. They are tried in the order of their cost until one keeps clear of the zones.

use super::{LimitError, TimedError, Trajectory};
use crate::airframe::Airframe;
use crate::trajectory::dubins;
use crate::trajectory::wind::{Answer, Heading, Performance, Wind, time_optimal};
use serde::{Deserialize, Serialize};
use skein_geometry::NoFlyZones;
use skein_geometry::frame::Pose;

/// What a trajectory should spend little of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Objective {
    /// Seconds.
    #[default]
    Time,
    /// Metres over the ground.
    Distance,
    /// Energy, which is endurance.
    Energy,
}

/// Which airspeeds may be flown.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Airspeeds {
    /// The airframe's cruise only.
    #[default]
    Cruise,
    /// Anything between the margin above the stall and the most that thrust allows.
    Any,
    /// This one, m/s.
    Only(f64),
}

/// Airspeeds tried between the slowest and the fastest: neighbours differ by a tenth
/// or less on airframes whose maximum is twice the stall, and near its least value an
/// energy changes with the square of that.
const AIRSPEEDS: u8 = 8;

/// The slowest airspeed that is planned, as a multiple of the stall's: a gust of a
/// tenth must not stall the wing.
const ABOVE_STALL: f64 = 1.1;

/// A flight to be planned.
#[derive(Clone, Copy, Debug)]
pub struct Flight<'a> {
    /// Where it begins, with the heading of the nose.
    pub from: Pose,
    /// Where it ends, with the heading of the nose.
    pub to: Pose,
    /// Who flies.
    pub airframe: &'a Airframe,
    /// Airspeeds to choose from.
    pub airspeeds: Airspeeds,
    /// The wind.
    pub wind: Wind,
    /// What counts.
    pub objective: Objective,
    /// What must not be flown over.
    pub zones: &'a NoFlyZones,
    /// Distance kept from the zones, metres.
    pub margin_m: f64,
    /// Share of the fastest turn that is planned, over 0 to 1: whoever follows the
    /// trajectory with an error needs the rest.
    pub turning: f64,
}

impl Flight<'_> {
    /// The best trajectory that keeps within the airframe's limits and clear of the
    /// zones, with its cost in the unit of the objective (for energy seconds of
    /// cruise).
    ///
    /// # Errors
    /// [`TimedError::NoWay`] if the wind forbids every candidate,
    /// [`TimedError::NotClear`] if zones do, [`TimedError::Limit`] or
    /// [`TimedError::Wind`] for a flight that no airspeed makes possible.
    pub fn best(&self) -> Result<(Trajectory, f64), TimedError> {
        if let Some(fastest) = self.fastest_at_one_airspeed() {
            return Ok(fastest);
        }
        let mut candidates = Vec::new();
        let mut refused = TimedError::NoWay;
        for airspeed_mps in self.speeds_mps() {
            for found in self.candidates(airspeed_mps) {
                match found {
                    Ok(trajectory) => candidates.push((self.cost(&trajectory), trajectory)),
                    Err(error) => refused = error,
                }
            }
        }
        candidates.sort_by(|a, b| a.0.total_cmp(&b.0));
        if !candidates.is_empty() {
            refused = TimedError::NotClear;
        }
        candidates
            .into_iter()
            .find(|(_, t)| t.stays_clear(self.zones, self.margin_m))
            .map(|(cost, t)| (t, cost))
            .ok_or(refused)
    }

    fn cost(&self, trajectory: &Trajectory) -> f64 {
        match self.objective {
            Objective::Time => trajectory.duration_s(),
            Objective::Distance => trajectory.ground_length_m(),
            Objective::Energy => trajectory.energy_s(self.airframe),
        }
    }

    fn speeds_mps(&self) -> Vec<f64> {
        let a = self.airframe;
        if let Airspeeds::Only(airspeed_mps) = self.airspeeds {
            return vec![airspeed_mps];
        }
        let slowest = a.stall_mps * ABOVE_STALL;
        if self.airspeeds == Airspeeds::Cruise || slowest >= a.max_mps {
            return vec![a.cruise_mps];
        }
        let share = |i: u8| f64::from(i) / f64::from(AIRSPEEDS - 1);
        let mut speeds: Vec<f64> = (0..AIRSPEEDS)
            .map(|i| slowest + (a.max_mps - slowest) * share(i))
            .collect();
        speeds.push(a.cruise_mps);
        speeds
    }

    /// Where one airspeed is flown and time counts, nothing is better than the fastest
    /// flight through the air, if it is clear.
    fn fastest_at_one_airspeed(&self) -> Option<(Trajectory, f64)> {
        let speeds = self.speeds_mps();
        let [airspeed_mps] = speeds[..] else {
            return None;
        };
        if self.objective != Objective::Time {
            return None;
        }
        let fastest = self.through_air(self.performance(airspeed_mps)).ok()?;
        let clear = fastest.stays_clear(self.zones, self.margin_m);
        clear.then(|| (fastest.clone(), fastest.duration_s()))
    }

    fn performance(&self, airspeed_mps: f64) -> Performance {
        let bank_rad = self.airframe.steepest_bank_rad(airspeed_mps);
        Performance {
            airspeed_mps,
            turn_radius_m: self.airframe.banked_radius_m(airspeed_mps, bank_rad) / self.turning,
        }
    }

    /// The fastest flight through the air.
    fn through_air(&self, performance: Performance) -> Result<Trajectory, TimedError> {
        match time_optimal(self.from, self.to, performance, self.wind) {
            Ok(Answer::Path(path)) => self.within_limits(Trajectory::through_air(&path)),
            Ok(Answer::Unreachable) => Err(TimedError::NoWay),
            Err(error) => Err(error.into()),
        }
    }

    /// What can be flown at one airspeed.
    fn candidates(&self, airspeed_mps: f64) -> Vec<Result<Trajectory, TimedError>> {
        let performance = self.performance(airspeed_mps);
        let mut all = vec![self.through_air(performance)];
        let share = self.wind.speed_mps() / airspeed_mps;
        if share < 1.0 {
            let over_ground = |pose: Pose| {
                let heading = Heading(pose.heading_rad);
                let course = self.wind.course_of(heading, airspeed_mps);
                Pose::new(pose.position(), course.0)
            };
            // Downwind the nose turns (1 + w/V)² as fast as in calm on the same arc.
            let radius_m = performance.turn_radius_m * (1.0 + share) * (1.0 + share);
            let words = dubins::all(over_ground(self.from), over_ground(self.to), radius_m);
            all.extend(words.iter().map(|curve| {
                Trajectory::along(curve, airspeed_mps, self.wind)
                    .and_then(|t| self.within_limits(t))
            }));
        }
        all
    }

    fn within_limits(&self, trajectory: Trajectory) -> Result<Trajectory, TimedError> {
        let checked: Result<(), LimitError> = trajectory.check(self.airframe);
        checked?;
        Ok(trajectory)
    }
}
