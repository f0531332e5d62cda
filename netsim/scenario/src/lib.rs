//! A scenario file, resolved: mission, world, fleet, radio, faults, storm, checks.
//!
//! The text is JSON5. Everything that is wrong with it, in form (an unknown field, a
//! number out of range, NaN) or in meaning (a zone that swallows the area, lanes too
//! narrow for the turn radius), is an error that names file, line, column and field
//! and says what would be right. Fields are explained in `configs/trials/helsinki.json5`.
//!
//! A straight line, each module of the earlier ones only:
//!
//! | module | what it adds |
//! |---|---|
//! | `request` | what a command line may ask for |
//! | `read` | the values that the text states, with their places |
//! | `flight_model` | how its UAVs fly in its wind |
//! | `mounts` | what cameras that tilt ask of it |
//! | `mission` | the mission: metres become millimetres |
//! | `choose_tree` | the spanning tree of the lanes, where it is left open |
//! | `feasibility` | what cannot succeed, or may disappoint |
//! | `forecast` | what it is expected to take |
//! | `resolve` | all of it in order: a [`Scenario`] |
//! | [`diagram`] | diagrams of missions, built in and from files, and pictures of them |
//! | [`town`] | streets and buildings without a mission |
//! | `coverable` | what the world's own geometry says of the same area |
//! | [`drawn`] | scenarios drawn from a seed, to try what nobody thought of |
//!
//! ```
//! let spec = skein_scenario::builtin(skein_scenario::DEFAULT).unwrap();
//! assert_eq!(spec.uavs.len(), 8);
//! ```

#[cfg(test)]
mod at_one_height;
mod builtin;
mod choose_tree;
#[cfg(test)]
mod counted;
mod coverable;
#[cfg(test)]
mod detected;
pub mod diagram;
pub mod drawn;
mod error;
mod feasibility;
mod files;
mod flight_model;
mod forecast;
#[cfg(test)]
mod gathered;
#[cfg(test)]
mod intruded;
mod mission;
mod mounts;
#[cfg(test)]
mod obstructed;
#[cfg(test)]
mod operated;
mod read;
mod request;
mod resolve;
pub mod town;
#[cfg(test)]
mod volumes;

pub use builtin::{
    DEFAULT, files as builtin_files, load_builtin, names as builtin_names, text as builtin_text,
};
pub use coverable::Coverable;
pub use error::{Finding, Place, ScenarioError, Severity};
pub use feasibility::{Summary, extent_m, feasibility, summary};
pub use files::Files;
pub use forecast::Forecast;
pub use read::faults::{chaos_plan, load_chaos_plan};
pub use request::{AreaPlanner, Launch, Overrides, Seeds};
pub use resolve::{Scenario, parse_with};

use skein_netsim::spec::Spec;
use std::path::Path;

/// Reads and resolves a scenario file with everything that was noticed; files that
/// it names are looked up beside it.
///
/// # Errors
/// [`ScenarioError`] names the place of what is wrong.
pub fn load_with(path: &Path, over: &Overrides) -> Result<Scenario, ScenarioError> {
    let file = path.display().to_string();
    let text = files::read_text(path).map_err(|problem| ScenarioError::Unreadable {
        file: file.clone(),
        problem,
    })?;
    let base = path
        .parent()
        .map_or_else(Default::default, Path::to_path_buf);
    parse_with(&file, &text, &Files::Directory(base), over)
}

/// Reads and resolves a scenario file.
///
/// # Errors
/// [`ScenarioError`] names the place of what is wrong.
pub fn load(path: &Path) -> Result<Spec, ScenarioError> {
    load_with(path, &Overrides::default()).map(|s| s.spec)
}

/// Resolves a scenario from its text; `file` names it in errors.
///
/// # Errors
/// [`ScenarioError`] names the place of what is wrong.
pub fn parse(file: &str, text: &str, files: &Files<'_>) -> Result<Spec, ScenarioError> {
    parse_with(file, text, files, &Overrides::default()).map(|s| s.spec)
}

/// Resolves a built-in scenario by its name.
///
/// # Errors
/// [`ScenarioError`] when there is none of that name.
pub fn builtin(name: &str) -> Result<Spec, ScenarioError> {
    load_builtin(name, &Overrides::default()).map(|s| s.spec)
}

/// What a command line means by a scenario: nothing is the default one, a name that
/// is no file may be a built-in one.
///
/// # Errors
/// [`ScenarioError`] names the place of what is wrong.
pub fn open(target: Option<&str>, over: &Overrides) -> Result<Scenario, ScenarioError> {
    let target = target.unwrap_or(DEFAULT);
    let path = Path::new(target);
    if !path.exists() {
        return load_builtin(target, over);
    }
    load_with(path, over)
}
