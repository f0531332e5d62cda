//! How examples begin: what they cannot read they say, and end with exit code 2.

use skein_scenario::{Launch, Overrides, Scenario, Seeds, open};
use std::process::ExitCode;

fn refuse(why: impl core::fmt::Display) -> ExitCode {
    eprintln!("{why}");
    ExitCode::from(2)
}

/// Seeds such as `1..4`.
pub fn seeds(text: &str) -> Result<Seeds, ExitCode> {
    text.parse().map_err(refuse)
}

/// A scenario, built in or of a file, with so many UAVs.
pub fn scenario(name: &str, peers: u16, launch: Option<Launch>) -> Result<Scenario, ExitCode> {
    let over = Overrides {
        peers: Some(peers),
        launch,
        ..Overrides::default()
    };
    open(Some(name), &over).map_err(refuse)
}
