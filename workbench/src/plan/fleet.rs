//! A fleet file: JSON5, one object a UAV, for `plan cover`, `plan line` and `plan visit`
//! (D2.7 §3.1: UAVs differ in speed, endurance and sensor).

use anyhow::{Context, Result, bail, ensure};
use jsonc_parser::{ParseOptions, parse_to_serde_value};
use serde::Deserialize;
use skein_interop::place::{LatLon, to_plane};
use skein_planning::frame::{Origin, Point};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The most UAVs that are planned for: the same as a swarm's.
pub const MAX_TEAM: usize = 1_000;

/// The widest field of view, degrees: beyond, the edge of the picture is the horizon.
const WIDEST_FOV_DEG: f64 = 150.0;

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
    /// Field of view across the track instead of a swath, degrees: the swath follows from
    /// the height.
    #[serde(default)]
    pub fov_across_deg: Option<f64>,
    /// Its sensors by name.
    #[serde(default)]
    pub sensors: BTreeMap<String, Sensor>,
    /// Power in level cruise, watts; energies are seconds of cruise if not said.
    #[serde(default)]
    pub cruise_power_w: Option<f64>,
}

/// A sensor of a UAV: its swath, or its field of view.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sensor {
    /// Width of the ground that it sees, metres.
    #[serde(default)]
    pub swath_m: Option<f64>,
    /// Field of view across the track, degrees.
    #[serde(default)]
    pub fov_across_deg: Option<f64>,
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
            fov_across_deg: None,
            sensors: BTreeMap::new(),
            cruise_power_w: None,
        }
    }

    /// Where it starts, if the file says so.
    #[must_use]
    pub fn place(&self) -> Option<LatLon> {
        self.start
            .map(|[lat_deg, lon_deg]| LatLon { lat_deg, lon_deg })
    }

    /// Where it starts in the plane of `origin`, which is where all do that do not say.
    ///
    /// # Errors
    /// When that is too far away; names the UAV.
    pub fn start_in(&self, origin: Origin) -> Result<Point> {
        match self.place() {
            Some(at) => to_plane(origin, at).with_context(|| self.name.clone()),
            None => Ok(Point::origin()),
        }
    }

    fn check(&self) -> Result<()> {
        let some = [
            ("speed_mps", Some(self.speed_mps)),
            ("endurance_s", self.endurance_s),
            ("turn_radius_m", self.turn_radius_m),
            ("cruise_power_w", self.cruise_power_w),
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
        check_view(&self.name, self.swath_m, self.fov_across_deg)?;
        for (sensor, seen) in &self.sensors {
            let shown = format!("{}: sensor {sensor:?}", self.name);
            ensure!(
                seen.swath_m.is_some() || seen.fov_across_deg.is_some(),
                "{shown} needs swath_m or fov_across_deg"
            );
            check_view(&shown, seen.swath_m, seen.fov_across_deg)?;
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

/// Refuses swaths and fields of view that are none.
fn check_view(name: &str, swath_m: Option<f64>, fov_deg: Option<f64>) -> Result<()> {
    if let Some(x) = swath_m {
        ensure!(
            x.is_finite() && x > 0.0,
            "{name}: swath_m must be above 0, found {x}"
        );
        ensure!(
            fov_deg.is_none(),
            "{name}: swath_m and fov_across_deg say the same: leave one out"
        );
    }
    if let Some(x) = fov_deg {
        ensure!(
            x > 0.0 && x <= WIDEST_FOV_DEG,
            "{name}: fov_across_deg must be above 0 and at most {WIDEST_FOV_DEG}, found {x}"
        );
    }
    Ok(())
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

pub(super) fn parse(text: &str) -> Result<Vec<Member>> {
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
                "[{name: 'a', speed_mps: 1, swath_m: -1}]",
                "a: swath_m must be",
            ),
            (
                "[{name: 'a', speed_mps: 1, cruise_power_w: 0}]",
                "a: cruise_power_w must be",
            ),
            (
                "[{name: 'a', speed_mps: 1, fov_across_deg: 180}]",
                "a: fov_across_deg must be",
            ),
            (
                "[{name: 'a', speed_mps: 1, swath_m: 9, fov_across_deg: 60}]",
                "leave one out",
            ),
            (
                "[{name: 'a', speed_mps: 1, sensors: {rgb: {}}}]",
                "a: sensor \"rgb\" needs",
            ),
            (
                "[{name: 'a', speed_mps: 1, sensors: {rgb: {swath_m: 0}}}]",
                "sensor \"rgb\": swath_m must be",
            ),
            ("[{name: 'a', speed_mps: 1, sensors: ['rgb']}]", "map"),
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
