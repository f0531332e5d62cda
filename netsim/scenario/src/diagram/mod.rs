//! Transition diagrams of missions (D2.7 §1.2.2): those that are built in, those in files, and
//! pictures of both. What a peer obeys is what was read here; the names of a diagram and of its
//! events are explained in `configs/diagrams/coverage.json5`.

mod picture;
mod read;

pub use picture::{Format, picture};

use crate::error::ScenarioError;
use crate::files::{Files, read_text};
use crate::request::Overrides;
use skein_interop::json::{Document, Error, Node, suggestion};
use skein_peer::diagram::Diagram;
use std::path::Path;

/// Name, file as errors show it, text.
const DIAGRAMS: &[(&str, &str, &str)] = &[
    (
        "coverage",
        "coverage.json5",
        include_str!("../../../../configs/diagrams/coverage.json5"),
    ),
    (
        "inspection",
        "inspection.json5",
        include_str!("../../../../configs/diagrams/inspection.json5"),
    ),
    (
        "patrol",
        "patrol.json5",
        include_str!("../../../../configs/diagrams/patrol.json5"),
    ),
];

/// Names of the built-in diagrams.
#[must_use]
pub fn names() -> Vec<&'static str> {
    DIAGRAMS.iter().map(|(name, _, _)| *name).collect()
}

/// Reads a diagram from its text; `file` names it in errors.
///
/// # Errors
/// [`ScenarioError`] names the place of what is wrong.
pub fn parse(file: &str, text: &str) -> Result<Diagram, ScenarioError> {
    let document = Document::parse("diagram", file, text)?;
    Ok(read::diagram(&document.root())?)
}

/// A built-in diagram.
#[must_use]
pub fn builtin(name: &str) -> Option<Diagram> {
    let (_, file, text) = DIAGRAMS.iter().find(|(n, _, _)| *n == name)?;
    // Tests read all of them.
    parse(file, text).ok()
}

/// What a command line means by a diagram: the name of a built-in one, a file that holds one, or
/// a scenario, by name or file, whose mission is flown by it.
///
/// # Errors
/// [`ScenarioError`] names the place of what is wrong.
pub fn open(target: &str) -> Result<Diagram, ScenarioError> {
    let path = Path::new(target);
    if !path.exists() {
        if let Some(diagram) = builtin(target) {
            return Ok(diagram);
        }
        if crate::builtin_names().contains(&target) {
            return flown(crate::load_builtin(target, &Overrides::default()));
        }
        let known = [names(), crate::builtin_names()].concat();
        return Err(ScenarioError::Unreadable {
            file: target.to_owned(),
            problem: format!(
                "no such file, and no built-in diagram or scenario of that name; {}",
                suggestion(target, &known)
            ),
        });
    }
    let text = read_text(path).map_err(|problem| ScenarioError::Unreadable {
        file: target.to_owned(),
        problem,
    })?;
    let document = Document::parse("diagram", target, &text)?;
    if document.root().get("states")?.is_some() {
        return Ok(read::diagram(&document.root())?);
    }
    flown(crate::load_with(path, &Overrides::default()))
}

fn flown(scenario: Result<crate::Scenario, ScenarioError>) -> Result<Diagram, ScenarioError> {
    Ok(scenario?.spec.mission.flown_by().into_owned())
}

/// What a scenario says of its mission: the diagram that it is flown by, where it names one or
/// brings its own; none where that is the default one.
pub(crate) fn of_mission(node: &Node<'_>, files: &Files<'_>) -> Result<Option<Diagram>, Error> {
    let f = node.fields(&["diagram"])?;
    let at = f.need("diagram", "\"patrol\"")?;
    let diagram = if let Ok(name) = at.text() {
        builtin(name).ok_or_else(|| {
            let known = suggestion(name, &names());
            at.wrong(format!("no diagram is called \"{name}\"; {known}; or bring your own: {{ file: \"watch.json5\" }}"))
        })?
    } else if let Some(file) = at.get("file")? {
        at.fields(&["file"])?;
        let (name, text) = (file.text()?, files.read(&file)?);
        let document = Document::parse("diagram", name, &text)?;
        read::diagram(&document.root())?
    } else {
        read::diagram(at)?
    };
    Ok(Some(diagram).filter(|d| *d != Diagram::coverage()))
}

#[cfg(test)]
mod tests;
