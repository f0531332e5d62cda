//! The team of a plan: from a fleet file, or so many UAVs alike. The file's reader is
//! [`skein_interop::fleet`].

use anyhow::{Context, Result, ensure};
use skein_interop::fleet;
pub use skein_interop::fleet::{MAX_TEAM, Sensor, Uav as Member};
use std::path::Path;

/// Reads a fleet file.
///
/// # Errors
/// When the file cannot be read or something of it is wrong; names the place.
pub fn read(file: &Path) -> Result<Vec<Member>> {
    let shown = file.display().to_string();
    let text = std::fs::read_to_string(file).with_context(|| format!("cannot read {shown}"))?;
    Ok(fleet::read(&shown, &text)?)
}

/// The fleet of a file, or `k` UAVs of the same speed.
///
/// # Errors
/// When `k` or the file is wrong.
pub fn team(
    file: Option<&Path>,
    k: usize,
    speed_mps: f64,
    endurance_s: Option<f64>,
) -> Result<Vec<Member>> {
    if let Some(file) = file {
        return read(file).context("--fleet");
    }
    ensure!(
        (1..=MAX_TEAM).contains(&k),
        "--k must be between 1 and {MAX_TEAM}, found {k}"
    );
    Ok((0..k)
        .map(|uav| Member::plain(uav, speed_mps, endurance_s))
        .collect())
}
