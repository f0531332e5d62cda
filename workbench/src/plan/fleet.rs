//! A fleet file: JSON5, one object a UAV, for `plan cover`, `plan line` and `plan visit`
//! (D2.7 §3.1: UAVs differ in speed, endurance and sensor).

use anyhow::{Context, Result, bail, ensure};
use jsonc_parser::{ParseOptions, parse_to_serde_value};
use serde::Deserialize;
use skein_interop::place::LatLon;
use std::collections::BTreeSet;
use std::path::Path;

/// The most UAVs that are planned for: the same as a swarm's.
pub const MAX_TEAM: usize = 1_000;

/// A UAV of a fleet file.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Member {
    /// What it is called.
    pub name: String,
    /// Airspeed, m/s.
    pub speed_mps: f64,
    /// The longest time it flies, seconds; unlimited if not said.
    #[serde(default)]
    pub endurance_s: Option<f64>,
    /// Where it starts and ends, `[latitude, longitude]` in degrees; where all do if not
    /// said.
    #[serde(default)]
    pub start: Option<[f64; 2]>,
    /// Width of the ground that it sees, metres; the flag's if not said.
    #[serde(default)]
    pub swath_m: Option<f64>,
    /// Turn radius, metres; the flag's if not said.
    #[serde(default)]
    pub turn_radius_m: Option<f64>,
}

impl Member {
    /// A UAV without peculiarities, numbered from 0.
    #[must_use]
    pub fn plain(uav: usize, speed_mps: f64, endurance_s: Option<f64>) -> Self {
        Self {
            name: format!("uav-{}", uav + 1),
            speed_mps,
            endurance_s,
            start: None,
            swath_m: None,
            turn_radius_m: None,
        }
    }

    /// Where it starts, if the file says so.
    #[must_use]
    pub fn place(&self) -> Option<LatLon> {
        self.start
            .map(|[lat_deg, lon_deg]| LatLon { lat_deg, lon_deg })
    }

    fn check(&self) -> Result<()> {
        let some = [
            ("speed_mps", Some(self.speed_mps)),
            ("endurance_s", self.endurance_s),
            ("swath_m", self.swath_m),
            ("turn_radius_m", self.turn_radius_m),
        ];
        for (field, value) in some {
            if let Some(x) = value {
                ensure!(
                    x.is_finite() && x > 0.0,
                    "{}: {field} must be above 0, found {x}",
                    self.name
                );
            }
        }
        if let Some([lat, lon]) = self.start {
            ensure!(
                lat.abs() <= 90.0 && lon.abs() <= 180.0,
                "{}: start must be [latitude, longitude] in degrees, found [{lat}, {lon}]",
                self.name
            );
        }
        let plain = |c: char| c.is_alphanumeric() || "-_ ".contains(c);
        // Names become names of files.
        ensure!(
            !self.name.is_empty() && self.name.len() <= 100 && self.name.chars().all(plain),
            "a name has letters, digits, blanks, - and _ only, found {:?}",
            self.name
        );
        Ok(())
    }
}

/// Reads a fleet file.
///
/// # Errors
/// When the file cannot be read or something of it is wrong; names the UAV.
pub fn read(file: &Path) -> Result<Vec<Member>> {
    let shown = || file.display().to_string();
    let text = std::fs::read_to_string(file).with_context(|| format!("cannot read {}", shown()))?;
    parse(&text).with_context(shown)
}

fn parse(text: &str) -> Result<Vec<Member>> {
    let fleet: Vec<Member> = parse_to_serde_value(text, &ParseOptions::default())
        .map_err(|e| anyhow::anyhow!("not a list of UAVs: {e}"))?;
    ensure!(
        (1..=MAX_TEAM).contains(&fleet.len()),
        "a fleet has 1 to {MAX_TEAM} UAVs, found {}",
        fleet.len()
    );
    let mut names = BTreeSet::new();
    for member in &fleet {
        member.check()?;
        if !names.insert(&member.name) {
            bail!("two UAVs are called {:?}", member.name);
        }
    }
    Ok(fleet)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fleet_is_read_and_wrong_ones_are_named() {
        let fleet = parse(
            "[ // two\n {name: 'red', speed_mps: 15, endurance_s: 1800, start: [47.4, 8.54]},\n {name: \"blue\", speed_mps: 22.5, swath_m: 80},]",
        )
        .unwrap();
        assert_eq!(fleet.len(), 2);
        assert_eq!(fleet[1].swath_m, Some(80.0));
        assert!((fleet[0].place().unwrap().lat_deg - 47.4).abs() < 1e-12);
        for (text, says) in [
            ("[]", "1 to 1000"),
            ("{}", "not a list"),
            ("[{name: 'a'}]", "speed_mps"),
            ("[{name: 'a', speed_mps: 0}]", "a: speed_mps must be"),
            ("[{name: 'a', speed_mps: 1, wings: 2}]", "wings"),
            ("[{name: 'a/b', speed_mps: 1}]", "a name has"),
            ("[{name: 'a', speed_mps: 1, start: [91, 0]}]", "a: start"),
            (
                "[{name: 'a', speed_mps: 1}, {name: 'a', speed_mps: 2}]",
                "two UAVs",
            ),
        ] {
            let error = format!("{:#}", parse(text).unwrap_err());
            assert!(error.contains(says), "{error}");
        }
    }
}
