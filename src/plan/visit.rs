//! `plan visit`: tours of a team over all points of a file (D2.7 §3.4).

use super::target_input::Kind;
use super::tour_args::{self, TourArgs, Wishes};
use anyhow::Result;
use clap::Args;
use std::path::PathBuf;

/// Tours of a team over all points of a file, the longest as short as can be found.
///
/// Points of GeoJSON (property `radius_m` asks for one to be seen with its surroundings:
/// in one pass, or in a small sweep; property `sensor` names what it is to be seen with)
/// or waypoints of a QGroundControl `.plan`.
#[derive(Debug, Args)]
pub struct VisitArgs {
    /// A QGroundControl `.plan` or GeoJSON.
    pub file: PathBuf,
    /// Team, wind and form of the result.
    #[command(flatten)]
    pub tours: TourArgs,
    /// Sensor, objective and heights.
    #[command(flatten)]
    pub wishes: Wishes,
}

/// Plans, and returns the text to print.
///
/// # Errors
/// When the file or a flag is wrong; the error names the place.
pub fn run(args: &VisitArgs) -> Result<String> {
    tour_args::run(Kind::Points, &args.file, &args.tours, &args.wishes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        args: VisitArgs,
    }

    #[test]
    fn points_are_shared_out_and_wide_ones_swept() {
        let dir = std::env::temp_dir().join(format!("skein-plan-visit-{}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        let file = dir.join("points.geojson");
        let text = r#"{"type":"FeatureCollection","features":[
            {"type":"Feature","geometry":{"type":"MultiPoint","coordinates":[[8.54,47.40],[8.56,47.40],[8.54,47.42]]}},
            {"type":"Feature","properties":{"radius_m":100},"geometry":{"type":"Point","coordinates":[8.57,47.41]}}]}"#;
        std::fs::write(&file, text).unwrap();
        let path = file.display().to_string();
        let told = |more: &[&str]| -> Result<serde_json::Value> {
            let all = ["visit", &path].into_iter().chain(more.iter().copied());
            Ok(serde_json::from_str(
                &run(&Cli::try_parse_from(all)?.args)?,
            )?)
        };
        let one = told(&[]).unwrap();
        assert_eq!(one["targets"], 4);
        // The depot twice, four lanes for the disc of 200 m, two other points, and turns.
        assert!(one["flights"][0]["points"].as_array().unwrap().len() >= 12);
        let two = told(&["--k", "2", "--depot", "47.405,8.55"]).unwrap();
        assert!(two["makespan_s"].as_f64() < one["makespan_s"].as_f64());
        assert!(two["unserved"].as_array().unwrap().is_empty());
        let short = told(&["--endurance-s", "100"]).unwrap();
        assert!(!short["unserved"].as_array().unwrap().is_empty());
        assert!(told(&["--swath-m", "0"]).is_err());
        // A zone between the depot and the points makes the way longer, one over a point
        // leaves it out.
        let write = |name: &str, text: &str| {
            let path = dir.join(name);
            std::fs::write(&path, text).unwrap();
            path.display().to_string()
        };
        let square = |west: f64, south: f64, east: f64, north: f64| {
            format!(
                r#"{{"type":"Polygon","coordinates":[[[{west},{south}],[{east},{south}],[{east},{north}],[{west},{north}],[{west},{south}]]]}}"#
            )
        };
        let wall = write("wall.geojson", &square(8.545, 47.39, 8.55, 47.415));
        let round = told(&["--zones", &wall]).unwrap();
        assert!(round["makespan_s"].as_f64() > one["makespan_s"].as_f64());
        assert!(round["unserved"].as_array().unwrap().is_empty() && round["targets"] == 4);
        let length = |told: &serde_json::Value| told["flights"][0]["length_m"].as_f64().unwrap();
        let (flown_m, time_s) = (length(&round), round["makespan_s"].as_f64().unwrap());
        assert!(
            (flown_m / 15.0 - time_s).abs() < 1e-6 * time_s,
            "as long as it is flown"
        );
        let over = write("over.geojson", &square(8.559, 47.399, 8.561, 47.401));
        let less = told(&["--zones", &over]).unwrap();
        assert_eq!(less["targets"], 3);
        assert!(less["notices"].to_string().contains("a zone is in the way"));
        let fleet =
            "[{name: 'slow', speed_mps: 10}, {name: 'fast', speed_mps: 20, start: [47.42, 8.56]}]";
        let fleet = write("fleet.json5", fleet);
        let pair = told(&["--fleet", &fleet]).unwrap();
        assert_eq!(pair["flights"][1]["name"], "fast");
        assert!(
            (pair["flights"][1]["points"][0]["lat_deg"].as_f64().unwrap() - 47.42).abs() < 1e-9
        );
        assert!(told(&["--fleet", &fleet, "--wind-mps", "3"]).is_err());
        assert!(told(&["--zones", &wall, "--clearance-m", "-1"]).is_err());
        std::fs::remove_dir_all(&dir).unwrap();
    }
}
