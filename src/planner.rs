//! `--exact` and `--approximate` of `check`, `sim` and `trial`: who plans the area of a
//! scenario. `plan cover` has flags of the same names for planners of its own.

use clap::Args;
use skein_scenario::AreaPlanner;

/// Who plans an area, instead of whom the scenario names.
#[derive(Clone, Copy, Debug, Default, Args)]
pub struct PlannerArgs {
    /// Covers the area exactly: straight passes over the cells of a decomposition.
    #[arg(long, conflicts_with = "approximate")]
    pub exact: bool,
    /// Covers the area approximately: a loop over a grid of lanes, which is not the planner
    /// of `plan cover --approximate`.
    #[arg(long)]
    pub approximate: bool,
}

impl PlannerArgs {
    /// The planner, if one was chosen.
    #[must_use]
    pub fn chosen(self) -> Option<AreaPlanner> {
        match (self.exact, self.approximate) {
            (true, _) => Some(AreaPlanner::Exact),
            (_, true) => Some(AreaPlanner::Lanes),
            (false, false) => None,
        }
    }
}
