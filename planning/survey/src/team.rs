//! A team as a person describes it: where each UAV starts, how it flies, and how wide it
//! sees with which sensor from which height (D2.7 §3.1: UAVs differ in speed, endurance
//! and sensor).

use skein_geometry::frame::Point;
use skein_geometry::math::tan;
use std::collections::{BTreeMap, BTreeSet};
use thiserror::Error;

/// The most UAVs that are planned for.
pub const MOST_UAVS: usize = 1_000;

/// How wide a sensor sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sensor {
    /// The same from every height.
    Swath {
        /// Width of the ground that it sees, metres.
        width_m: f64,
    },
    /// The wider, the higher it is.
    FieldOfView {
        /// Angle across the track, degrees.
        across_deg: f64,
    },
}

impl Sensor {
    /// Width of the ground that it sees from a height, metres.
    #[must_use]
    pub fn across_m(self, height_m: f64) -> f64 {
        match self {
            Self::Swath { width_m } => width_m,
            Self::FieldOfView { across_deg } => 2.0 * height_m * tan(across_deg.to_radians() / 2.0),
        }
    }
}

/// One UAV of the team.
#[derive(Clone, Debug, PartialEq)]
pub struct Uav {
    /// What it is called; no two of a team alike.
    pub name: String,
    /// Where it starts and ends, in the plane of the plan.
    pub start: Point,
    /// Airspeed, m/s.
    pub speed_mps: f64,
    /// The longest time that it flies, seconds; `None` where that does not matter.
    pub endurance_s: Option<f64>,
    /// Turn radius, metres.
    pub turn_radius_m: f64,
    /// What it sees with where no sensor is asked for; `None` for the narrowest of its
    /// `sensors`, so that all of them see everything.
    pub camera: Option<Sensor>,
    /// Its sensors by name.
    pub sensors: BTreeMap<String, Sensor>,
    /// Power in level cruise, watts; `None` where energies are to be seconds of cruise.
    pub cruise_power_w: Option<f64>,
}

impl Uav {
    /// A UAV with one camera, without a limit of endurance.
    #[must_use]
    pub fn new(
        name: impl Into<String>,
        start: Point,
        speed_mps: f64,
        turn_radius_m: f64,
        camera: Sensor,
    ) -> Self {
        Self {
            name: name.into(),
            start,
            speed_mps,
            endurance_s: None,
            turn_radius_m,
            camera: Some(camera),
            sensors: BTreeMap::new(),
            cruise_power_w: None,
        }
    }

    /// How wide it sees with a sensor, or with what it has where none is asked for;
    /// `None` where it has nothing to see with.
    #[must_use]
    pub fn swath_m(&self, sensor: Option<&str>, height_m: f64) -> Option<f64> {
        if let Some(sensor) = sensor {
            return Some(self.sensors.get(sensor)?.across_m(height_m));
        }
        let each = self.sensors.values();
        let narrowest = each.map(|s| s.across_m(height_m)).min_by(f64::total_cmp);
        self.camera.map(|c| c.across_m(height_m)).or(narrowest)
    }

    /// Whether it sees wider from higher.
    #[must_use]
    pub fn depends_on_height(&self) -> bool {
        let wider = |s: &Sensor| matches!(s, Sensor::FieldOfView { .. });
        self.camera.iter().chain(self.sensors.values()).any(wider)
    }
}

/// A figure that a plan divides by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// `speed_mps`.
    Speed,
    /// `turn_radius_m`.
    TurnRadius,
    /// The width that is seen.
    Swath,
}

impl core::fmt::Display for Quantity {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Speed => "speed",
            Self::TurnRadius => "turn radius",
            Self::Swath => "swath",
        })
    }
}

/// Why a team cannot be planned for. Nothing was planned.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum TeamError {
    /// Nobody flies, or too many.
    #[error("a team has 1 to {MOST_UAVS} UAVs, found {0}")]
    Size(usize),
    /// A UAV starts at no point of the plane; it is named.
    #[error("{0}: the start is no point of the plane")]
    Nowhere(String),
    /// A figure is no number, 0 or negative.
    #[error("{uav}: the {quantity} must be above 0, found {value}")]
    NotPositive {
        /// What the UAV is called.
        uav: String,
        /// Which figure.
        quantity: Quantity,
        /// What it is.
        value: f64,
    },
    /// Nobody has a sensor that is asked for.
    #[error("nobody carries the sensor {sensor:?} that is asked for: {}", has(.carried))]
    NoCarrier {
        /// What is asked for; empty for any sensor at all.
        sensor: String,
        /// The sensors that the team has, by name.
        carried: Vec<String>,
    },
    /// A field of view without a height sees nothing.
    #[error("{uav}: a field of view needs a height above 0 to see by, found {height_m} m")]
    NoHeight {
        /// What the UAV is called.
        uav: String,
        /// Its height, metres.
        height_m: f64,
    },
    /// Energies of this team have no common unit.
    #[error("{without} has no cruise_power_w, but {with} has: state it for all UAVs or for none")]
    Power {
        /// A UAV without a power.
        without: String,
        /// A UAV with one.
        with: String,
    },
}

/// Which sensors a team has, for a person.
pub(crate) fn has(carried: &[String]) -> String {
    if carried.is_empty() {
        return "no UAV of the team lists `sensors`".to_owned();
    }
    format!("the team has {}", carried.join(", "))
}

/// The names of all sensors of a team, none twice.
pub(crate) fn carried(team: &[Uav]) -> Vec<String> {
    let all: BTreeSet<&String> = team.iter().flat_map(|u| u.sensors.keys()).collect();
    all.into_iter().cloned().collect()
}

/// Refuses a team that is empty, too large, or starts nowhere.
pub(crate) fn check_places(team: &[Uav]) -> Result<(), TeamError> {
    if !(1..=MOST_UAVS).contains(&team.len()) {
        return Err(TeamError::Size(team.len()));
    }
    match team.iter().find(|u| !is_point(u.start)) {
        Some(uav) => Err(TeamError::Nowhere(uav.name.clone())),
        None => Ok(()),
    }
}

/// Whether both coordinates are numbers.
pub(crate) fn is_point(p: Point) -> bool {
    p.x.is_finite() && p.y.is_finite()
}

/// Refuses a team that is empty, too large, or starts nowhere, or has figures that nothing can be divided
/// by.
pub(crate) fn check(team: &[Uav]) -> Result<(), TeamError> {
    check_places(team)?;
    for quantity in [Quantity::Speed, Quantity::TurnRadius] {
        let of = |u: &Uav| match quantity {
            Quantity::Speed => u.speed_mps,
            _ => u.turn_radius_m,
        };
        let wrong = |u: &&Uav| !(of(u).is_finite() && of(u) > 0.0);
        if let Some(uav) = team.iter().find(wrong) {
            return Err(TeamError::NotPositive {
                uav: uav.name.clone(),
                quantity,
                value: of(uav),
            });
        }
    }
    Ok(())
}

/// A UAV as one plan needs it: with the swath that it sees from its height.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct PlannedUav {
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

impl PlannedUav {
    /// Whether two UAVs are the same to every plan.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        Self {
            uav: self.uav,
            name: self.name.clone(),
            ..other.clone()
        } == *self
    }
}

/// The UAVs that can take part, `heights_m` above ground by UAV.
///
/// # Errors
/// When nobody carries the sensor, or sees nothing from its height.
pub(crate) fn taking_part(
    team: &[Uav],
    sensor: Option<&str>,
    heights_m: &[f64],
) -> Result<Vec<PlannedUav>, TeamError> {
    let mut all = Vec::new();
    for (i, uav) in team.iter().enumerate() {
        let height_m = heights_m.get(i).copied().unwrap_or_default();
        let Some(swath_m) = uav.swath_m(sensor, height_m) else {
            continue;
        };
        if !(swath_m.is_finite() && swath_m > 0.0) {
            let name = uav.name.clone();
            return Err(if uav.depends_on_height() {
                TeamError::NoHeight {
                    uav: name,
                    height_m,
                }
            } else {
                TeamError::NotPositive {
                    uav: name,
                    quantity: Quantity::Swath,
                    value: swath_m,
                }
            });
        }
        all.push(PlannedUav {
            uav: i,
            name: uav.name.clone(),
            start: uav.start,
            speed_mps: uav.speed_mps,
            endurance_s: uav.endurance_s.unwrap_or(f64::INFINITY),
            swath_m,
            turn_radius_m: uav.turn_radius_m,
            cruise_power_w: uav.cruise_power_w,
            pace: 1.0,
        });
    }
    if all.is_empty() {
        return Err(TeamError::NoCarrier {
            sensor: sensor.unwrap_or_default().to_owned(),
            carried: carried(team),
        });
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_swath_is_that_of_the_sensor_at_its_height() {
        let swath = |width_m| Sensor::Swath { width_m };
        let fov = Sensor::FieldOfView {
            across_deg: 53.130_102_354_155_98,
        };
        let uav = |name: &str, camera: Option<Sensor>, sensors: &[(&str, Sensor)]| Uav {
            camera,
            sensors: sensors.iter().map(|(n, s)| ((*n).to_owned(), *s)).collect(),
            ..Uav::new(name, Point::origin(), 15.0, 30.0, swath(1.0))
        };
        let team = [
            uav("a", None, &[("rgb", swath(60.0)), ("thermal", fov)]),
            uav("b", Some(swath(40.0)), &[("rgb", swath(80.0))]),
            uav("c", Some(swath(50.0)), &[]),
        ];
        let swaths = |sensor: Option<&str>, height_m: f64| -> Result<Vec<f64>, TeamError> {
            let all = taking_part(&team, sensor, &[height_m; 3])?;
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
        assert!(team[0].depends_on_height() && !team[1].depends_on_height());
        let blind = uav("blind", None, &[]);
        let error = taking_part(&[blind], None, &[50.0])
            .unwrap_err()
            .to_string();
        assert!(error.contains("no UAV of the team lists"), "{error}");
    }

    #[test]
    fn teams_that_nothing_can_be_divided_by_are_refused() {
        let swath = Sensor::Swath { width_m: 50.0 };
        let uav = |v: f64, r: f64, m: f64| {
            let camera = Sensor::Swath { width_m: m };
            Uav::new("a", Point::origin(), v, r, camera)
        };
        assert_eq!(check(&[]), Err(TeamError::Size(0)));
        assert!(check(&[uav(15.0, 30.0, 50.0)]).is_ok());
        for (v, r, quantity) in [
            (0.0, 30.0, Quantity::Speed),
            (f64::NAN, 30.0, Quantity::Speed),
            (15.0, -1.0, Quantity::TurnRadius),
        ] {
            let found = check(&[Uav::new("a", Point::origin(), v, r, swath)]).unwrap_err();
            assert!(
                matches!(found, TeamError::NotPositive { quantity: q, .. } if q == quantity),
                "{found}"
            );
        }
        let flat = taking_part(&[uav(15.0, 30.0, 0.0)], None, &[50.0]).unwrap_err();
        assert_eq!(flat.to_string(), "a: the swath must be above 0, found 0");
    }
}
