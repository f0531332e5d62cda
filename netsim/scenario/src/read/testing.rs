//! Variants of the default scenario, for the tests of readers.

use crate::{Overrides, Scenario};
use skein_peer::Mission;
use std::sync::Arc;

/// The default scenario with these fields besides, or what is wrong with them.
pub(crate) fn default_with(fields: &str) -> Result<Scenario, String> {
    let text = include_str!("../../../../configs/trials/helsinki.json5");
    let text = text.replacen("vehicles: [],", &format!("vehicles: [], {fields}"), 1);
    let files = crate::builtin::files();
    let read = crate::parse_with("s.json5", &text, &files, &Overrides::default());
    read.map_err(|e| e.to_string())
}

/// The mission of the default scenario where this stands for it, or what is wrong with that.
pub(crate) fn mission_of(mission: &str) -> Result<Arc<Mission>, String> {
    default_with(&format!("mission: {mission},")).map(|s| s.spec.mission)
}
