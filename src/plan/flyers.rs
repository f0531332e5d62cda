//! A team as a plan needs it: where each UAV starts, and how wide it sees with the sensor
//! that is asked for, from the height that it flies at (D2.7 §3.1).

use super::fleet::{Member, Sensor};
use anyhow::{Result, ensure};
use skein_geometry::frame::{Origin, Point};
use std::collections::BTreeSet;

/// A UAV that takes part.
#[derive(Clone, Debug, PartialEq)]
pub struct Flyer {
    /// Which of the team, from 0.
    pub uav: usize,
    /// What it is called.
    pub name: String,
    /// Where it starts and ends.
    pub start: Point,
    /// Airspeed, m/s.
    pub speed_mps: f64,
    /// The longest time it flies, seconds.
    pub endurance_s: f64,
    /// Width of the ground that it sees, metres.
    pub swath_m: f64,
    /// Turn radius, metres.
    pub turn_radius_m: f64,
    /// Power in level cruise, watts.
    pub cruise_power_w: Option<f64>,
    /// How much of its share of the work it is given, 1 for all that its speed is good
    /// for: less leaves more to others that cost less.
    pub pace: f64,
}

impl Flyer {
    /// Whether two UAVs are the same to every plan.
    #[must_use]
    pub fn is_like(&self, other: &Self) -> bool {
        Self {
            uav: self.uav,
            name: self.name.clone(),
            ..other.clone()
        } == *self
    }
}

/// What the flags say where the fleet file does not.
#[derive(Clone, Copy, Debug)]
pub struct Defaults<'a> {
    /// Width of the ground that a UAV sees, metres.
    pub swath_m: f64,
    /// Turn radius, metres.
    pub turn_radius_m: f64,
    /// The sensor that is asked for.
    pub sensor: Option<&'a str>,
}

/// The UAVs that can take part, `heights_m` above ground by UAV.
///
/// # Errors
/// When nobody carries the sensor, or a start is too far away.
pub fn flyers(
    team: &[Member],
    origin: Origin,
    defaults: Defaults<'_>,
    heights_m: &[f64],
) -> Result<Vec<Flyer>> {
    let mut all = Vec::new();
    for (uav, member) in team.iter().enumerate() {
        let start = member.start_in(origin)?;
        let height_m = heights_m.get(uav).copied().unwrap_or_default();
        let Some(swath_m) = swath_m(member, defaults, height_m) else {
            continue;
        };
        ensure!(
            swath_m.is_finite() && swath_m > 0.0,
            "{}: a field of view needs a height above 0 to see by, found {height_m} m",
            member.name
        );
        all.push(Flyer {
            uav,
            name: member.name.clone(),
            start,
            speed_mps: member.speed_mps,
            endurance_s: member.endurance_s.unwrap_or(f64::INFINITY),
            swath_m,
            turn_radius_m: member.turn_radius_m.unwrap_or(defaults.turn_radius_m),
            cruise_power_w: member.cruise_power_w,
            pace: 1.0,
        });
    }
    let sensor = defaults.sensor.unwrap_or_default();
    ensure!(
        !all.is_empty(),
        "nobody carries the sensor {sensor:?} that is asked for: {}",
        carried(team)
    );
    Ok(all)
}

/// Which sensors a team has, for a person.
#[must_use]
pub fn carried(team: &[Member]) -> String {
    let all: BTreeSet<&str> = team
        .iter()
        .flat_map(|m| m.sensors.keys().map(String::as_str))
        .collect();
    if all.is_empty() {
        return "no UAV of the team lists `sensors` (see --fleet)".to_owned();
    }
    let all: Vec<&str> = all.into_iter().collect();
    format!("the team has {}", all.join(", "))
}

/// How wide a UAV sees; `None` without the sensor that is asked for.
///
/// With nothing asked for it is the UAV's own swath, else the narrowest of its sensors,
/// so that all of them see everything, else the flag's.
#[must_use]
pub fn swath_m(member: &Member, defaults: Defaults<'_>, height_m: f64) -> Option<f64> {
    if let Some(sensor) = defaults.sensor {
        return member.sensors.get(sensor)?.across_m(height_m);
    }
    let own = Sensor {
        swath_m: member.swath_m,
        fov_across_deg: member.fov_across_deg,
    };
    let each = member.sensors.values();
    let narrowest = each
        .filter_map(|s| s.across_m(height_m))
        .min_by(f64::total_cmp);
    own.across_m(height_m)
        .or(narrowest)
        .or(Some(defaults.swath_m))
}

/// Whether a UAV sees wider from higher.
#[must_use]
pub fn depends_on_height(member: &Member) -> bool {
    member.fov_across_deg.is_some() || member.sensors.values().any(|s| s.fov_across_deg.is_some())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_swath_is_that_of_the_sensor_at_its_height() {
        let text = "[{name: 'a', speed_mps: 15, sensors: {rgb: {swath_m: 60}, thermal: {fov_across_deg: 53.13010235415598}}},
            {name: 'b', speed_mps: 15, swath_m: 40, sensors: {rgb: {swath_m: 80}}}, {name: 'c', speed_mps: 15}]";
        let team = skein_interop::fleet::read("fleet", text).unwrap();
        let origin = Origin {
            lat_deg: 47.0,
            lon_deg: 8.0,
        };
        let swaths = |sensor: Option<&str>, height_m: f64| -> Result<Vec<f64>> {
            let defaults = Defaults {
                swath_m: 50.0,
                turn_radius_m: 30.0,
                sensor,
            };
            let all = flyers(&team, origin, defaults, &[height_m; 3])?;
            Ok(all.iter().map(|f| f.swath_m.round()).collect())
        };
        assert_eq!(swaths(None, 50.0).unwrap(), [50.0, 40.0, 50.0]);
        assert_eq!(swaths(None, 90.0).unwrap(), [60.0, 40.0, 50.0]);
        assert_eq!(swaths(Some("rgb"), 90.0).unwrap(), [60.0, 80.0]);
        assert_eq!(swaths(Some("thermal"), 90.0).unwrap(), [90.0]);
        let error = swaths(Some("lidar"), 90.0).unwrap_err().to_string();
        assert!(error.contains("\"lidar\"") && error.contains("rgb, thermal"));
        let error = swaths(None, 0.0).unwrap_err().to_string();
        assert!(error.contains("a: a field of view"), "{error}");
    }
}
