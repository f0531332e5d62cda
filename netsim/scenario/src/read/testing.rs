//! Missions of the default scenario, for the tests of readers.

use crate::Overrides;
use skein_peer::Mission;
use std::sync::Arc;

/// The mission of the default scenario where this stands for it, or what is wrong with that.
pub(crate) fn mission_of(mission: &str) -> Result<Arc<Mission>, String> {
    let text = include_str!("../../../../configs/trials/helsinki.json5");
    let mission = format!("vehicles: [], mission: {mission},");
    let text = text.replacen("vehicles: [],", &mission, 1);
    let files = crate::builtin::files();
    let read = crate::parse_with("s.json5", &text, &files, &Overrides::default());
    read.map(|s| s.spec.mission).map_err(|e| e.to_string())
}
