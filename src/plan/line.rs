//! `plan line`: tours of a team along all lines of a file; wide strips in lanes
//! (D2.7 §3.5).

use super::target_input::Kind;
use super::tour_args::{self, TourArgs, Wishes};
use anyhow::Result;
use clap::Args;
use std::path::PathBuf;

/// Tours of a team along all lines of a file, the longest as short as can be found.
///
/// Lines of GeoJSON (property `width_m` makes one a strip) or corridor scans of a
/// QGroundControl `.plan`. Lines that share a point hang together there, as roads do. The
/// property `sensor` names the sensor that a line is to be seen with.
#[derive(Debug, Args)]
pub struct LineArgs {
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
pub fn run(args: &LineArgs) -> Result<String> {
    tour_args::run(Kind::Lines, &args.file, &args.tours, &args.wishes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        args: LineArgs,
    }

    fn args(dir: &std::path::Path, text: &str, more: &[&str]) -> LineArgs {
        let file = dir.join("lines.geojson");
        std::fs::write(&file, text).unwrap();
        let file = file.display().to_string();
        let all = ["line", &file].into_iter().chain(more.iter().copied());
        Cli::try_parse_from(all).unwrap().args
    }

    const CROSS: &str = r#"{"type":"FeatureCollection","features":[
        {"type":"Feature","geometry":{"type":"LineString","coordinates":[[8.54,47.40],[8.55,47.40],[8.56,47.40]]}},
        {"type":"Feature","geometry":{"type":"LineString","coordinates":[[8.55,47.39],[8.55,47.40],[8.55,47.41]]}},
        {"type":"Feature","properties":{"width_m":150},"geometry":{"type":"LineString","coordinates":[[8.54,47.42],[8.56,47.42]]}}]}"#;

    #[test]
    fn crossing_roads_are_cut_and_wide_strips_become_lanes() {
        let dir = std::env::temp_dir().join(format!("skein-plan-line-{}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        let one = args(&dir, CROSS, &["--swath-m", "50"]);
        let told: serde_json::Value = serde_json::from_str(&run(&one).unwrap()).unwrap();
        // Four arms of the cross and three lanes.
        assert_eq!(told["targets"], 7);
        assert_eq!(told["flights"][0]["passes"].as_array().unwrap().len(), 7);
        let team = args(
            &dir,
            CROSS,
            &["--k", "2", "--wind-mps", "5", "--format", "geojson"],
        );
        let map: serde_json::Value = serde_json::from_str(&run(&team).unwrap()).unwrap();
        assert_eq!(map["features"].as_array().unwrap().len(), 2);
        assert!(map["makespan_s"].as_f64() >= map["lower_bound_s"].as_f64());
        let out = dir.join("plans").display().to_string();
        let split = args(
            &dir,
            CROSS,
            &["--k", "2", "--format", "plan", "--out", &out],
        );
        let told = run(&split).unwrap();
        assert!(told.contains("uav-2.plan"));
        let text = std::fs::read_to_string(dir.join("plans/uav-1.plan")).unwrap();
        assert!(skein_interop::plan::read(&text).unwrap().waypoints.len() > 2);
        for (more, says) in [
            (&["--k", "0"][..], "--k must be"),
            (&["--wind-mps", "20"], "--wind-mps"),
            (&["--k", "2", "--format", "plan"], "--out DIR"),
            (&["--out", "plans"], "add --format plan"),
            (&["--depot", "x"], "--depot"),
            (&["--swath-m", "0"], "--swath-m must be"),
        ] {
            let error = format!("{:#}", run(&args(&dir, CROSS, more)).unwrap_err());
            assert!(error.contains(says), "{error}");
        }
        let none = r#"{"type":"FeatureCollection","features":[]}"#;
        assert!(run(&args(&dir, none, &[])).is_err());
        std::fs::remove_dir_all(&dir).unwrap();
    }
}
