//! Variants of the default scenario, for the tests of readers.

use crate::{Overrides, Scenario};
use skein_peer::Mission;
use std::sync::Arc;

/// The default scenario where this stands for a field that says nothing, or what is wrong.
pub(crate) fn default_with(field: &str, value: &str) -> Result<Scenario, String> {
    let text = include_str!("../../../../configs/trials/helsinki.json5");
    let text = text.replacen(&format!("{field}: [],"), &format!("{field}: {value},"), 1);
    let files = crate::builtin::files();
    let read = crate::parse_with("s.json5", &text, &files, &Overrides::default());
    read.map_err(|e| e.to_string())
}

/// The mission of the default scenario where this stands for it, or what is wrong with that.
pub(crate) fn mission_of(mission: &str) -> Result<Arc<Mission>, String> {
    let read = default_with("vehicles", &format!("[], mission: {mission}"));
    read.map(|s| s.spec.mission)
}
