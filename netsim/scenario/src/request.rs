//! What a person may ask of a scenario besides its text: the planner of an area by its
//! name, and what a command line changes.

use skein_peer::CoverageTask;
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

/// What a command line changes in a scenario.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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
}
