//! What a person may ask of a scenario besides its text: the planner of an area by its
//! name, and what a command line changes.

use skein_peer::CoverageTask;
use std::path::PathBuf;
use std::str::FromStr;

/// How an area is covered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AreaPlanner {
    /// A spanning-tree loop over a grid of lanes: approximate coverage.
    Lanes,
    /// Straight passes over the cells of a boustrophedon decomposition: exact coverage.
    Exact,
}

impl AreaPlanner {
    /// Both, in the order in which they are told.
    pub const ALL: [Self; 2] = [Self::Lanes, Self::Exact];

    /// Its name in a scenario file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Lanes => "lanes",
            Self::Exact => "exact",
        }
    }

    /// What it makes of an area.
    pub(crate) fn task(self) -> CoverageTask {
        match self {
            Self::Lanes => CoverageTask::Area,
            Self::Exact => CoverageTask::Exact,
        }
    }

    /// The planner of a task over an area; `None` for points and lines.
    #[must_use]
    pub fn of(task: &CoverageTask) -> Option<Self> {
        Self::ALL.into_iter().find(|p| p.task() == *task)
    }
}

/// Where the UAVs of a generated fleet begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Launch {
    /// In the air, evenly round the coverage loop.
    Spread,
    /// At the base, taking off one after the other.
    Base,
}

impl Launch {
    /// Its word in a file and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Spread => "spread",
            Self::Base => "base",
        }
    }
}

impl FromStr for Launch {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "spread" => Ok(Self::Spread),
            "base" => Ok(Self::Base),
            _ => Err("expected \"spread\" (evenly round the coverage loop) or \"base\" (one after the other at the base)".to_owned()),
        }
    }
}

/// The seeds of many runs, written as `0..1000`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seeds {
    /// The first.
    pub from: u64,
    /// The one after the last, above the first.
    pub to: u64,
}

impl FromStr for Seeds {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (from, to) = text
            .split_once("..")
            .ok_or("expected two numbers with two dots between, for example 0..1000")?;
        let number = |s: &str| s.trim().parse::<u64>().map_err(|e| format!("{s:?}: {e}"));
        let (from, to) = (number(from)?, number(to)?);
        if from >= to {
            return Err(format!(
                "{text} holds no seed; the second number is not included"
            ));
        }
        Ok(Self { from, to })
    }
}

/// What a command line changes in a scenario.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overrides {
    /// Number of UAVs of a generated fleet. Faults that name others are left out.
    pub peers: Option<u16>,
    /// The default seed.
    pub seed: Option<u64>,
    /// Scenario seconds per second of wall time, at most 10.
    pub time_scale: Option<f64>,
    /// Who plans an area, instead of whom the scenario names.
    pub planner: Option<AreaPlanner>,
    /// Where the UAVs of a generated fleet begin, instead of where the scenario says.
    pub launch: Option<Launch>,
    /// A chaos plan, a file, whose faults happen instead of the scenario's. What its operator
    /// does stays.
    pub faults: Option<PathBuf>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_of_seeds_are_read_or_refused_with_a_reason() {
        assert_eq!("0..1000".parse(), Ok(Seeds { from: 0, to: 1000 }));
        for wrong in ["7", "5..5", "9..2", "a..b", "-1..4"] {
            assert!(wrong.parse::<Seeds>().is_err(), "{wrong}");
        }
    }
}
