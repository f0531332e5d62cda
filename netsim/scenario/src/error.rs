//! What is wrong with a scenario, and where: file, line, column, field.

use core::fmt;
use skein_interop::json;
use thiserror::Error;

pub use skein_interop::json::Place;

/// Why a scenario cannot be used. Nothing of it was started.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ScenarioError {
    /// The file itself cannot be read.
    #[error("{file}: {problem}")]
    Unreadable {
        /// The file, as it was named.
        file: String,
        /// What the system says, and what would help.
        problem: String,
    },
    /// A value in the file is wrong, in form or in meaning.
    #[error(transparent)]
    Invalid(#[from] json::Error),
}

/// How bad a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Worth knowing.
    Note,
    /// The run may disappoint.
    Warning,
    /// The run cannot succeed.
    Error,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Note => "note",
            Self::Warning => "warning",
            Self::Error => "error",
        })
    }
}

/// Something that a check of a scenario found out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// How bad it is.
    pub severity: Severity,
    /// The field to change, such as `lanes.spacing_m`.
    pub field: String,
    /// What it is and what would be right.
    pub problem: String,
    /// Where the field stands, when the scenario came from a file.
    pub place: Option<Place>,
}

impl Finding {
    pub(crate) fn new(severity: Severity, field: &str, problem: impl Into<String>) -> Self {
        Self {
            severity,
            field: field.to_owned(),
            problem: problem.into(),
            place: None,
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(place) = &self.place {
            write!(f, "{place}: ")?;
        }
        write!(f, "{}: {}: {}", self.severity, self.field, self.problem)
    }
}
