//! Which scenario `check`, `sim`, `trial` and `mission` take, and what is changed in it.

use clap::Args;
use skein_scenario::{AreaPlanner, Launch, Overrides, Scenario, ScenarioError};
use std::path::PathBuf;

/// A scenario, and what of it is replaced.
#[derive(Debug, Args)]
pub struct ScenarioArgs {
    /// A scenario file or the name of a built-in scenario; without it the default one.
    pub scenario: Option<String>,
    /// Flies with this many UAVs instead of the scenario's number.
    #[arg(long, value_name = "N")]
    pub peers: Option<u16>,
    /// Who plans an area.
    #[command(flatten)]
    pub planner: PlannerArgs,
    /// Where the UAVs of a generated fleet begin: `base`, one after the other, or `spread`
    /// round the coverage loop.
    #[arg(long, value_name = "WHERE")]
    pub launch: Option<Launch>,
    /// Faults of this file instead of the scenario's, in the form of a plan for `skein chaos`.
    #[arg(long, value_name = "FILE")]
    pub faults: Option<PathBuf>,
}

impl ScenarioArgs {
    /// Reads and resolves the scenario; `seed` and `time_scale` replace those of the file.
    ///
    /// # Errors
    /// What is wrong with the scenario, with its place.
    pub fn open(
        &self,
        seed: Option<u64>,
        time_scale: Option<f64>,
    ) -> Result<Scenario, ScenarioError> {
        let over = Overrides {
            peers: self.peers,
            seed,
            time_scale,
            planner: self.planner.chosen(),
            launch: self.launch,
            faults: self.faults.clone(),
        };
        skein_scenario::open(self.scenario.as_deref(), &over)
    }

    /// The text of the scenario, as it can be read by now; empty where it cannot.
    #[must_use]
    pub fn text(&self) -> String {
        let name = self.scenario.as_deref().unwrap_or(skein_scenario::DEFAULT);
        let read = std::fs::read_to_string(name).ok();
        let builtin = || skein_scenario::builtin_text(name).map(str::to_owned);
        read.or_else(builtin).unwrap_or_default()
    }

    /// These arguments as one would type them, each after a space.
    #[must_use]
    pub fn as_typed(&self) -> String {
        let flag = |given: bool, name: &str| given.then(|| name.to_owned());
        [
            self.scenario.clone(),
            self.peers.map(|n| format!("--peers {n}")),
            flag(self.planner.exact, "--exact"),
            flag(self.planner.approximate, "--approximate"),
            self.launch.map(|l| format!("--launch {}", l.name())),
            (self.faults.as_ref()).map(|file| format!("--faults {}", file.display())),
        ]
        .iter()
        .flatten()
        .map(|argument| format!(" {argument}"))
        .collect()
    }
}

/// Who plans an area, instead of whom the scenario names. `plan cover` has flags of the same
/// names for planners of its own.
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
