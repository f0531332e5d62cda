//! What the files that UAVs upload take from the file that was planned from: home, vehicle,
//! fence and rally points.

use serde_json::Value;
use skein_geometry::frame::Vector;
use skein_interop::landing::LandingPattern;
use skein_interop::mission::{Vehicle, add_to_fence, no_fence, no_rally};
use skein_interop::place::{LatLon, Shape};
use skein_interop::plan::PlanFile;

/// What a file says beside what is to be seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Site {
    /// Home as the file has it.
    pub home: Option<LatLon>,
    /// Altitude of home above the sea, metres.
    pub home_altitude_m: Option<f64>,
    /// What flies.
    pub vehicle: Vehicle,
    /// The fence: that of the file word for word, and what was added.
    pub fence: Value,
    /// The rally points of the file, word for word.
    pub rally: Value,
    /// Distance between two pictures, metres; by default half of what one sees along.
    pub trigger_m: Option<f64>,
    /// Whether the camera goes on between the first pass and the last one.
    pub pictures_in_turns: bool,
    /// How a fixed wing lands, as the file has it.
    pub landing: Option<LandingPattern>,
    /// What the fence holds: whether to stay within, and what.
    pub shapes: Vec<(bool, Shape)>,
    /// Distance kept from all of it, metres.
    pub clearance_m: f64,
    /// The wind, where it blows to, m/s.
    pub wind_mps: Vector,
}

impl Default for Site {
    /// A site of which no file says anything.
    fn default() -> Self {
        Self {
            home: None,
            home_altitude_m: None,
            vehicle: Vehicle::default(),
            fence: no_fence(),
            rally: no_rally(),
            trigger_m: None,
            pictures_in_turns: false,
            landing: None,
            shapes: Vec::new(),
            clearance_m: 0.0,
            wind_mps: Vector::zeros(),
        }
    }
}

impl Site {
    /// The site of a QGroundControl plan.
    #[must_use]
    pub fn of(file: &PlanFile) -> Self {
        let usual = Vehicle::default();
        let mut site = Self {
            home: file.home,
            home_altitude_m: file.home_altitude_m,
            vehicle: Vehicle {
                firmware_type: file.firmware_type.unwrap_or(usual.firmware_type),
                vehicle_type: file.vehicle_type.unwrap_or(usual.vehicle_type),
                hover_mps: file.hover_mps.unwrap_or(usual.hover_mps),
            },
            fence: file.fence.clone().unwrap_or_else(no_fence),
            rally: file.rally.clone().unwrap_or_else(no_rally),
            landing: file.landing,
            ..Self::default()
        };
        // A fence of version 1 is skipped by today's QGroundControl.
        if file.fence.is_none() {
            site.keep(true, &file.keep_in);
            site.keep(false, &file.keep_out);
        } else {
            let within = file.keep_in.iter().map(|shape| (true, shape.clone()));
            let out = file.keep_out.iter().map(|shape| (false, shape.clone()));
            site.shapes = within.chain(out).collect();
        }
        site
    }

    /// Adds shapes to the fence: ones to stay within (`inclusion`), or ones to keep out of.
    pub fn keep<'a>(&mut self, inclusion: bool, shapes: impl IntoIterator<Item = &'a Shape>) {
        for shape in shapes {
            add_to_fence(&mut self.fence, inclusion, shape);
            self.shapes.push((inclusion, shape.clone()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;
    use skein_interop::plan::read;

    #[test]
    fn fences_are_kept_word_for_word_and_old_ones_in_todays_words() {
        let text = r#"{"fileType":"Plan","geoFence":{"version":2,"breachReturn":[47,8,30],"circles":[],"polygons":[]},
            "mission":{"firmwareType":3,"vehicleType":1,"plannedHomePosition":[47,8,410]},
            "rallyPoints":{"version":2,"points":[[47,8,30]]}}"#;
        let mut site = Site::of(&read(text).unwrap());
        assert_eq!(site.fence["breachReturn"], json!([47, 8, 30]));
        assert_eq!(site.rally["points"], json!([[47, 8, 30]]));
        assert_eq!(site.vehicle.firmware_type, 3);
        assert_eq!(site.home_altitude_m, Some(410.0));
        let ring = [(47.0, 8.0), (47.0, 8.1), (47.1, 8.1)];
        let ring = ring.map(|(lat_deg, lon_deg)| LatLon { lat_deg, lon_deg });
        site.keep(false, &[Shape::Ring(ring.to_vec())]);
        assert_eq!(site.fence["polygons"][0]["inclusion"], false);
        assert_eq!(site.fence["breachReturn"], json!([47, 8, 30]));
        let old = r#"{"fileType":"Plan","geoFence":{"version":1,"polygon":[[47,8],[47,8.1],[47.1,8.1]]}}"#;
        let site = Site::of(&read(old).unwrap());
        assert_eq!(site.fence["version"], 2);
        assert_eq!(site.fence["polygons"][0]["inclusion"], true);
    }
}
