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
use skein_peer::diagram::{AFTER_MAX_S, Diagram, MissionEvent, Part};
use std::path::Path;

/// Name, file as errors show it, text.
const DIAGRAMS: &[(&str, &str, &str)] = &[
    (
        "coverage",
        "coverage.json5",
        include_str!("../../../../configs/diagrams/coverage.json5"),
    ),
    (
        "convoy",
        "convoy.json5",
        include_str!("../../../../configs/diagrams/convoy.json5"),
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
    (
        "search",
        "search.json5",
        include_str!("../../../../configs/diagrams/search.json5"),
    ),
    (
        "trace",
        "trace.json5",
        include_str!("../../../../configs/diagrams/trace.json5"),
    ),
    (
        "volume",
        "volume.json5",
        include_str!("../../../../configs/diagrams/volume.json5"),
    ),
    (
        "weather",
        "weather.json5",
        include_str!("../../../../configs/diagrams/weather.json5"),
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
        let mut known = [names(), crate::builtin_names()].concat();
        known.sort_unstable();
        known.dedup();
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

/// What a mission may bring, also to the default diagram.
const BRINGS: [&str; 7] = [
    "detections",
    "tasks",
    "counts",
    "streets",
    "layers_m",
    "crowd",
    "buildings",
];

/// What a scenario says of its mission: the diagram that it is flown by, where it names one or
/// brings its own; none where that is the default one.
pub(crate) fn of_mission(node: &Node<'_>, files: &Files<'_>) -> Result<Option<Diagram>, Error> {
    let f = node.fields(&[&["diagram", "for_s"], &BRINGS[..]].concat())?;
    let at = match f.get("diagram") {
        None if f.get("for_s").is_none() && BRINGS.iter().any(|name| f.get(name).is_some()) => {
            return Ok(None);
        }
        _ => f.need("diagram", "\"patrol\"")?,
    };
    let mut diagram = if let Ok(name) = at.text() {
        builtin(name).ok_or_else(|| {
            let known = suggestion(name, &names());
            at.wrong(format!("no diagram is called \"{name}\"; bring your own, {{ file: \"watch.json5\" }}, or name a built-in one: {known}"))
        })?
    } else if let Some(file) = at.get("file")? {
        at.fields(&["file"])?;
        let (name, text) = (file.text()?, files.read(&file)?);
        let document = Document::parse("diagram", name, &text)?;
        read::diagram(&document.root())?
    } else {
        read::diagram(at)?
    };
    if let Some(for_s) = f.get("for_s") {
        last_for(&mut diagram, for_s)?;
    }
    Ok(Some(diagram).filter(|d| *d != Diagram::coverage()))
}

/// From now on the mission ends after so long.
fn last_for(diagram: &mut Diagram, node: &Node<'_>) -> Result<(), Error> {
    let for_s = node.whole(1, AFTER_MAX_S, "seconds")?;
    let ends = |name: &str| {
        let mut states = diagram.states.iter();
        states.any(|s| s.name == name && s.part == Part::Ends)
    };
    let timers = diagram.transitions.iter().enumerate();
    let timers = timers.filter(|(_, t)| t.on == MissionEvent::Timer && ends(&t.to));
    let timers: Vec<usize> = timers.map(|(k, _)| k).collect();
    if timers.is_empty() {
        return Err(node.wrong(format!(
            "the diagram \"{}\" ends by what is seen, and has no timer that ends it; leave for_s out, or take \"patrol\"",
            diagram.name
        )));
    }
    for k in timers {
        diagram.transitions[k].after_s = for_s;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
