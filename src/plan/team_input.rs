//! The team of a plan: from a fleet file, or so many UAVs alike. The file's reader is
//! [`skein_interop::fleet`]; what it leaves unsaid is what the flags say.

use anyhow::{Context, Result, ensure};
use skein_geometry::frame::Origin;
use skein_interop::fleet::{self, MAX_TEAM};
use skein_survey::team::{Sensor, Uav};
use std::path::Path;

/// Turn radius of a UAV that does not state its own where no flag does, metres.
pub const TURN_RADIUS_M: f64 = 30.0;

/// What is so of all UAVs that do not state their own.
#[derive(Clone, Copy, Debug)]
pub struct Defaults {
    /// What one sees with.
    pub camera: Sensor,
    /// Turn radius, metres.
    pub turn_radius_m: f64,
}

/// The fleet of a file, or `k` UAVs of the same speed.
///
/// # Errors
/// When `k` or the file is wrong; names the place.
pub fn team(
    file: Option<&Path>,
    k: usize,
    speed_mps: f64,
    endurance_s: Option<f64>,
) -> Result<Vec<fleet::Uav>> {
    if let Some(file) = file {
        return read(file).context("--fleet");
    }
    ensure!(
        (1..=MAX_TEAM).contains(&k),
        "--k must be between 1 and {MAX_TEAM}, found {k}"
    );
    Ok((0..k)
        .map(|uav| fleet::Uav::plain(uav, speed_mps, endurance_s))
        .collect())
}

fn read(file: &Path) -> Result<Vec<fleet::Uav>> {
    let shown = file.display().to_string();
    let text = std::fs::read_to_string(file).with_context(|| format!("cannot read {shown}"))?;
    Ok(fleet::read(&shown, &text)?)
}

/// The team in the plane of a plan.
///
/// # Errors
/// When a start is too far away; names the UAV.
pub fn in_plane(team: &[fleet::Uav], origin: Origin, defaults: Defaults) -> Result<Vec<Uav>> {
    let uav = |u: &fleet::Uav| -> Result<Uav> {
        let own = sensor(u.swath_m, u.fov_across_deg);
        let sensors = u.sensors.iter().filter_map(|(name, s)| {
            let sees = sensor(s.swath_m, s.fov_across_deg)?;
            Some((name.clone(), sees))
        });
        Ok(Uav {
            name: u.name.clone(),
            start: u.start_in(origin)?,
            speed_mps: u.speed_mps,
            endurance_s: u.endurance_s,
            turn_radius_m: u.turn_radius_m.unwrap_or(defaults.turn_radius_m),
            camera: own.or_else(|| u.sensors.is_empty().then_some(defaults.camera)),
            sensors: sensors.collect(),
            cruise_power_w: u.cruise_power_w,
        })
    };
    team.iter().map(uav).collect()
}

fn sensor(swath_m: Option<f64>, fov_across_deg: Option<f64>) -> Option<Sensor> {
    let fov = fov_across_deg.map(|across_deg| Sensor::FieldOfView { across_deg });
    swath_m.map(|width_m| Sensor::Swath { width_m }).or(fov)
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_geometry::frame::Point;

    #[test]
    fn flags_say_what_the_file_does_not() {
        let text = "[{name: 'a', speed_mps: 15, sensors: {rgb: {swath_m: 60}, thermal: {fov_across_deg: 50}}},
            {name: 'b', speed_mps: 12, fov_across_deg: 40, turn_radius_m: 9, start: [47.001, 8]}, {name: 'c', speed_mps: 15}]";
        let origin = Origin {
            lat_deg: 47.0,
            lon_deg: 8.0,
        };
        let defaults = Defaults {
            camera: Sensor::Swath { width_m: 50.0 },
            turn_radius_m: 30.0,
        };
        let team = fleet::read("fleet", text).unwrap();
        let team = in_plane(&team, origin, defaults).unwrap();
        assert_eq!(team[0].camera, None);
        assert_eq!(team[0].sensors["rgb"], Sensor::Swath { width_m: 60.0 });
        let seen = Sensor::FieldOfView { across_deg: 40.0 };
        assert_eq!(team[1].camera, Some(seen));
        assert!((team[1].turn_radius_m - 9.0).abs() < 1e-9);
        assert!((team[1].start - Point::new(0.0, 111.0)).norm() < 1.0);
        assert_eq!(team[2].camera, Some(Sensor::Swath { width_m: 50.0 }));
        assert!((team[2].turn_radius_m - 30.0).abs() < 1e-9);
    }
}
