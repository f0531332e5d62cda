//! Variants of the default scenario, for the tests of readers.

use crate::{Overrides, Scenario};
use skein_netsim::Prepared;
use skein_netsim::fault::Fault;
use skein_netsim::runs::{Wanted, run};
use skein_netsim::spec::Spec;
use skein_netsim::swarm::Outcome;
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

/// A built-in trial with so many UAVs, in calm but for who is lost where there are others, after a
/// change.
pub(crate) fn flown(name: &str, uavs: u16, seed: u64, change: impl FnOnce(&mut Spec)) -> Outcome {
    let over = Overrides {
        peers: Some(uavs),
        ..Overrides::default()
    };
    let mut spec = crate::load_builtin(name, &over).unwrap().spec;
    change(&mut spec);
    let prepared = Prepared::new(spec);
    let mut faults = prepared.spec.faults.clone();
    faults.retain(|f| !matches!(f.fault, Fault::Kill { peer } if peer > uavs || uavs == 1));
    run(&prepared, seed, faults, Wanted::default())
}

/// The mission of the default scenario where this stands for it, or what is wrong with that.
pub(crate) fn mission_of(mission: &str) -> Result<Arc<Mission>, String> {
    let read = default_with("vehicles", &format!("[], mission: {mission}"));
    read.map(|s| s.spec.mission)
}
