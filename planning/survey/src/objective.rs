//! What a plan is to be short in: time, distance or energy (D2.7 §3.1).
//!
//! Leaves to the planners which plans there are to choose from.

use crate::flight::Flight;
use crate::team::{TeamError, Uav};

/// Shares of the work are told apart in steps of this, from all of it down: samples are no
/// finer.
pub(crate) const SAME_SHARE: f64 = 0.002;

/// How many whole steps a share of the work is below all of it. What has the same number is
/// the same to a person; so that of three plans no two can each be better than the next.
pub(crate) fn lacks(share: f64) -> u32 {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a cast of a float saturates"
    )]
    let steps = ((1.0 - share) / SAME_SHARE).max(0.0) as u32;
    steps
}

/// Figures that differ by less than this share are the same.
const SAME: f64 = 1e-9;

/// What is to be least.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Objective {
    /// The time until the last UAV is back.
    Time,
    /// The length of all flights together: one UAV may fly alone.
    Distance,
    /// The energy of all flights together: watt-hours where the fleet states
    /// `cruise_power_w`, else seconds of cruise.
    Energy,
}

/// What a plan comes to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Worth {
    /// The share of the work that is done.
    pub share: f64,
    /// The longest flight, seconds.
    pub makespan_s: f64,
    /// All flights together, metres.
    pub total_m: f64,
    /// All flights together, in one unit of energy.
    pub energy: f64,
}

impl Worth {
    /// What flights come to that do this share of the work; energies in watt-hours where
    /// those are known and asked for, else in seconds of cruise.
    pub(crate) fn of<'a>(
        flights: impl Iterator<Item = &'a Flight> + Clone,
        share: f64,
        in_watt_hours: bool,
    ) -> Self {
        let flying = flights.clone().filter(|f| f.flies());
        let energy_wh: Option<f64> = flying.map(Flight::energy_wh).sum();
        Self {
            share,
            makespan_s: flights.clone().map(Flight::time_s).fold(0.0, f64::max),
            total_m: flights.clone().map(Flight::ground_m).sum(),
            energy: match energy_wh {
                Some(energy_wh) if in_watt_hours => energy_wh,
                _ => flights.map(Flight::energy_s).sum(),
            },
        }
    }

    /// The figure of an objective.
    pub(crate) fn figure(&self, objective: Objective) -> f64 {
        match objective {
            Objective::Time => self.makespan_s,
            Objective::Distance => self.total_m,
            Objective::Energy => self.energy,
        }
    }

    /// Whether this plan does more than the other, or as much for less; for as much, what
    /// is sooner and then shorter.
    pub(crate) fn beats(&self, other: &Self, objective: Objective) -> bool {
        let (lacks, others) = (lacks(self.share), lacks(other.share));
        if lacks != others {
            return lacks < others;
        }
        let both = |w: &Self| [w.figure(objective), w.makespan_s, w.total_m];
        for (a, b) in both(self).into_iter().zip(both(other)) {
            if (a - b).abs() > SAME * a.abs().max(b.abs()) {
                return a < b;
            }
        }
        false
    }
}

/// Whether energies of this team are watt-hours: when every UAV states its power.
///
/// # Errors
/// When energy is asked for and only some of the team state their power.
pub(crate) fn in_watt_hours(team: &[Uav], objective: Objective) -> Result<bool, TeamError> {
    let without = team.iter().find(|u| u.cruise_power_w.is_none());
    let with = team.iter().find(|u| u.cruise_power_w.is_some());
    if let (Objective::Energy, Some(without), Some(with)) = (objective, without, with) {
        return Err(TeamError::Power {
            without: without.name.clone(),
            with: with.name.clone(),
        });
    }
    Ok(without.is_none())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_is_better_than_less_for_less() {
        let worth = |share: f64, figures: [f64; 3]| Worth {
            share,
            makespan_s: figures[0],
            total_m: figures[1],
            energy: figures[2],
        };
        let (soon, short) = (
            worth(1.0, [10.0, 300.0, 30.0]),
            worth(1.0, [20.0, 200.0, 20.0]),
        );
        assert!(soon.beats(&short, Objective::Time) && !short.beats(&soon, Objective::Time));
        assert!(short.beats(&soon, Objective::Distance) && short.beats(&soon, Objective::Energy));
        let less = worth(0.9, [1.0, 1.0, 1.0]);
        assert!(!less.beats(&soon, Objective::Distance) && soon.beats(&less, Objective::Energy));
        assert!(!soon.beats(&soon, Objective::Time));
    }
}
