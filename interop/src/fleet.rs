//! A fleet file: a list of one object a UAV, for plans of a team (D2.7 §3.1: UAVs differ in
//! speed, endurance and sensor). The limits are those of airframes. Leaves opening the file,
//! and what a UAV without a start or a swath does, to the planner.

use crate::airframe::{ENDURANCE_S, FIELD_OF_VIEW_DEG, SPEED_MPS};
use crate::json::{Document, Error, Fields, Node};
use crate::place::{LatLon, TooFar, to_plane};
use skein_geometry::frame::{Origin, Point};
use skein_geometry::math::tan;
use std::collections::BTreeMap;

/// The most UAVs that are planned for.
pub const MAX_TEAM: usize = 1_000;

/// Swaths that are accepted, metres: the narrowest strip that is worth a pass, the widest
/// footprint of an airframe.
pub const SWATH_M: (f64, f64) = (0.1, 10_000.0);

/// Turn radii that are accepted, metres; at 0 and below nothing turns.
pub const TURN_RADIUS_M: (f64, f64) = (0.1, 20_000.0);

/// Power in level cruise that is accepted, watts.
pub const CRUISE_POWER_W: (f64, f64) = (0.001, 1e6);

/// Most bytes of a name, which becomes the name of a file.
const LONGEST_NAME: usize = 100;

/// A UAV of a fleet file.
#[derive(Clone, Debug, PartialEq)]
pub struct Uav {
    /// What it is called.
    pub name: String,
    /// Airspeed, m/s.
    pub speed_mps: f64,
    /// The longest time it flies, seconds; unlimited if not said.
    pub endurance_s: Option<f64>,
    /// Where it starts and ends; where all do if not said.
    pub start: Option<LatLon>,
    /// Width of the ground that it sees, metres; the flag's if not said.
    pub swath_m: Option<f64>,
    /// Turn radius, metres; the flag's if not said.
    pub turn_radius_m: Option<f64>,
    /// Field of view across the track instead of a swath, degrees: the swath follows from
    /// the height.
    pub fov_across_deg: Option<f64>,
    /// Its sensors by name.
    pub sensors: BTreeMap<String, Sensor>,
    /// Power in level cruise, watts; energies are seconds of cruise if not said.
    pub cruise_power_w: Option<f64>,
}

/// A sensor of a UAV: its swath, or its field of view.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sensor {
    /// Width of the ground that it sees, metres.
    pub swath_m: Option<f64>,
    /// Field of view across the track, degrees.
    pub fov_across_deg: Option<f64>,
}

impl Sensor {
    /// Width of the ground that it sees from a height, metres, if it is known.
    #[must_use]
    pub fn across_m(&self, height_m: f64) -> Option<f64> {
        let seen = |fov_deg: f64| 2.0 * height_m * tan(fov_deg.to_radians() / 2.0);
        self.swath_m.or(self.fov_across_deg.map(seen))
    }
}

/// A UAV starts too far from the origin for one tangent plane.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name}: {cause}")]
pub struct StartTooFar {
    /// What it is called.
    pub name: String,
    /// How far it is.
    pub cause: TooFar,
}

impl Uav {
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

    /// Where it starts in the plane of `origin`, which is where all do that do not say.
    ///
    /// # Errors
    /// When that is too far away; names the UAV.
    pub fn start_in(&self, origin: Origin) -> Result<Point, StartTooFar> {
        let Some(at) = self.start else {
            return Ok(Point::origin());
        };
        to_plane(origin, at).map_err(|cause| StartTooFar {
            name: self.name.clone(),
            cause,
        })
    }
}

/// Reads a fleet file; `file` names it in errors.
///
/// # Errors
/// [`Error`] names the value that is wrong.
pub fn read(file: &str, text: &str) -> Result<Vec<Uav>, Error> {
    let document = Document::parse("fleet", file, text)?;
    let root = document.root();
    let items = root.items()?;
    if !(1..=MAX_TEAM).contains(&items.len()) {
        return Err(root.wrong(format!(
            "a fleet has 1 to {MAX_TEAM} UAVs, found {}",
            items.len()
        )));
    }
    let mut team: Vec<Uav> = Vec::with_capacity(items.len());
    for item in &items {
        let uav = uav(item)?;
        if team.iter().any(|u| u.name == uav.name) {
            let at = item.need("name")?;
            return Err(at.wrong(format!("two UAVs are called \"{}\"", uav.name)));
        }
        team.push(uav);
    }
    Ok(team)
}

fn uav(node: &Node<'_>) -> Result<Uav, Error> {
    let f = node.fields(&[
        "name",
        "speed_mps",
        "endurance_s",
        "start",
        "swath_m",
        "turn_radius_m",
        "fov_across_deg",
        "sensors",
        "cruise_power_w",
    ])?;
    let seen = sensor(&f)?;
    let sensors = match f.given("sensors") {
        Some(node) => node.members()?,
        None => Vec::new(),
    };
    Ok(Uav {
        name: name(f.need("name", "\"red\"")?)?,
        speed_mps: f
            .need("speed_mps", "15")?
            .number(SPEED_MPS.0, SPEED_MPS.1, "m/s")?,
        endurance_s: within(&f, "endurance_s", ENDURANCE_S, "seconds")?,
        start: f.given("start").map(start).transpose()?,
        swath_m: seen.swath_m,
        turn_radius_m: within(&f, "turn_radius_m", TURN_RADIUS_M, "metres")?,
        fov_across_deg: seen.fov_across_deg,
        sensors: sensors
            .into_iter()
            .map(|(name, node)| Ok((name.to_owned(), sensor_of(&node)?)))
            .collect::<Result<_, Error>>()?,
        cruise_power_w: within(&f, "cruise_power_w", CRUISE_POWER_W, "watts")?,
    })
}

fn within(
    f: &Fields<'_>,
    name: &str,
    (low, high): (f64, f64),
    unit: &str,
) -> Result<Option<f64>, Error> {
    let node = f.given(name);
    node.map(|n| n.number(low, high, unit)).transpose()
}

fn name(node: &Node<'_>) -> Result<String, Error> {
    let text = node.text()?;
    let plain = |c: char| c.is_alphanumeric() || "-_ ".contains(c);
    if text.is_empty() || text.len() > LONGEST_NAME || !text.chars().all(plain) {
        return Err(node.wrong("a name has letters, digits, blanks, - and _ only"));
    }
    Ok(text.to_owned())
}

/// `[latitude, longitude]`.
fn start(node: &Node<'_>) -> Result<LatLon, Error> {
    match node.items()?.as_slice() {
        [lat, lon] => Ok(LatLon {
            lat_deg: lat.number(-90.0, 90.0, "a latitude in degrees")?,
            lon_deg: lon.number(-180.0, 180.0, "a longitude in degrees")?,
        }),
        _ => Err(node.wrong("expected [latitude, longitude] in degrees")),
    }
}

fn sensor_of(node: &Node<'_>) -> Result<Sensor, Error> {
    let seen = sensor(&node.fields(&["swath_m", "fov_across_deg"])?)?;
    if seen == Sensor::default() {
        return Err(node.wrong("a sensor needs swath_m or fov_across_deg"));
    }
    Ok(seen)
}

/// What is seen, by a swath or a field of view.
fn sensor(f: &Fields<'_>) -> Result<Sensor, Error> {
    if let (Some(_), Some(node)) = (f.given("swath_m"), f.given("fov_across_deg")) {
        return Err(node.wrong("swath_m and fov_across_deg say the same: leave one out"));
    }
    Ok(Sensor {
        swath_m: within(f, "swath_m", SWATH_M, "metres")?,
        fov_across_deg: within(f, "fov_across_deg", FIELD_OF_VIEW_DEG, "degrees")?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fleet_is_read_and_wrong_ones_are_named() {
        let fleet = read(
            "f",
            "[ // two\n {name: 'red', speed_mps: 15, endurance_s: 1800, start: [47.4, 8.54]},\n {name: \"blue\", speed_mps: 22.5, swath_m: 80, sensors: {rgb: {swath_m: 40}}},]",
        )
        .unwrap();
        assert_eq!(fleet.len(), 2);
        assert_eq!(fleet[1].swath_m, Some(80.0));
        assert_eq!(fleet[1].sensors["rgb"].swath_m, Some(40.0));
        assert!((fleet[0].start.unwrap().lat_deg - 47.4).abs() < 1e-12);
        for (text, says) in [
            ("[]", "f:1:1: fleet: a fleet has 1 to 1000"),
            ("{}", "f:1:1: fleet: expected a list"),
            (
                "[{name: 'a'}]",
                "f:1:2: fleet[0]: the field fleet[0].speed_mps is missing",
            ),
            (
                "[{name: 'a', speed_mps: 0}]",
                "f:1:25: fleet[0].speed_mps: 0 is out",
            ),
            (
                "[{name: 'a', speed_mps: 1, wings: 2}]",
                "fleet[0].wings: unknown",
            ),
            ("[{name: 'a/b', speed_mps: 1}]", "fleet[0].name: a name has"),
            (
                "[{name: 'a', speed_mps: 1, start: [91, 0]}]",
                "start[0]: 91 is",
            ),
            (
                "[{name: 'a', speed_mps: 1, start: [1]}]",
                "[latitude, longitude]",
            ),
            ("[{name: 'a', speed_mps: 1, swath_m: -1}]", "swath_m: -1 is"),
            (
                "[{name: 'a', speed_mps: 1, cruise_power_w: 0}]",
                "cruise_power_w: 0 is",
            ),
            (
                "[{name: 'a', speed_mps: 1, fov_across_deg: 180}]",
                "fov_across_deg: 180 is",
            ),
            (
                "[{name: 'a', speed_mps: 1, swath_m: 9, fov_across_deg: 60}]",
                "leave one out",
            ),
            (
                "[{name: 'a', speed_mps: 1, sensors: {rgb: {}}}]",
                "sensors.rgb: a sensor needs",
            ),
            (
                "[{name: 'a', speed_mps: 1, sensors: {rgb: {swath_m: 0}}}]",
                "fleet[0].sensors.rgb.swath_m: 0 is",
            ),
            (
                "[{name: 'a', speed_mps: 1, sensors: ['rgb']}]",
                "expected an object",
            ),
            (
                "[{name: 'a', speed_mps: 1}, {name: 'a', speed_mps: 2}]",
                "fleet[1].name: two UAVs",
            ),
        ] {
            let error = read("f", text).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
        }
    }
}
