//! `plan cover`: an area covered by a team (D2.7 §3.6), exactly by straight passes.

use super::site::{self, Site};
use super::tours::Format;
use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use serde_json::{Value, json};
use skein_interop::place::from_plane;
use skein_interop::plan::{PlanFile, Waypoint, write};
use skein_planning::coverage::exact::{Directions, ExactProblem, Member, TeamPlan, plan_team};
use skein_planning::frame::Point;
use std::path::PathBuf;

/// The most UAVs that are planned for: the same as a swarm's.
const MAX_TEAM: usize = 1_000;

/// Points nearer to each other than this are one in the track, metres.
const COINCIDENT_M: f64 = 1e-3;

/// An area covered by a team: one closed flight a UAV, the longest as short as can be
/// found.
///
/// The survey of a QGroundControl `.plan` with its exclusion fences, or a GeoJSON polygon
/// with its holes, and zones with the property "no_fly": true. Times are without wind.
#[derive(Debug, Args)]
pub struct CoverArgs {
    /// A QGroundControl `.plan` or GeoJSON.
    pub file: PathBuf,
    /// Exact coverage: cells of the area as it is drawn, in straight passes.
    #[arg(long)]
    pub exact: bool,
    /// How many UAVs.
    #[arg(long, default_value_t = 1, value_name = "K")]
    pub k: usize,
    /// Where all UAVs start and end, degrees; by default the file's home position, or the
    /// area's first corner.
    #[arg(long, value_name = "LAT,LON", allow_hyphen_values = true)]
    pub launch: Option<String>,
    /// Width of the ground that a pass sees, metres.
    #[arg(long, default_value_t = 60.0, value_name = "M")]
    pub swath_m: f64,
    /// How far the camera sees before and behind, metres; half the swath by default.
    #[arg(long, value_name = "M")]
    pub look_ahead_m: Option<f64>,
    /// Turn radius, metres.
    #[arg(long, default_value_t = 30.0, value_name = "M")]
    pub turn_radius_m: f64,
    /// Distance kept from every zone, metres.
    #[arg(
        long,
        default_value_t = 10.0,
        value_name = "M",
        allow_hyphen_values = true
    )]
    pub clearance_m: f64,
    /// Ground speed, m/s.
    #[arg(long, default_value_t = 15.0, value_name = "V")]
    pub speed_mps: f64,
    /// The longest time that a UAV flies, seconds; passes beyond that are left out and
    /// listed.
    #[arg(long, value_name = "S")]
    pub endurance_s: Option<f64>,
    /// Course of all lanes, degrees clockwise from north; by default the shortest found.
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    pub course_deg: Option<f64>,
    /// Steps of improvement; the same steps give the same plan everywhere.
    #[arg(long, default_value_t = 20_000, value_name = "N")]
    pub steps: usize,
    /// Height of the waypoints above home in `.plan` files, metres.
    #[arg(long, default_value_t = 60.0, value_name = "M")]
    pub altitude_m: f64,
    /// How the result is printed.
    #[arg(long, value_enum, default_value_t = Format::Json)]
    pub format: Format,
    /// Directory for the `.plan` files, one a UAV, instead of printing.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Plans, and returns the text to print.
///
/// # Errors
/// When the file or a flag is wrong; the error names the place.
pub fn run(args: &CoverArgs) -> Result<String> {
    ensure!(
        (1..=MAX_TEAM).contains(&args.k),
        "--k must be between 1 and {MAX_TEAM}, found {}",
        args.k
    );
    let site = site::read(&args.file, args.launch.as_deref())?;
    exact(args, &site)
}

/// Exact coverage: straight passes over the area as it is drawn.
fn exact(args: &CoverArgs, site: &Site) -> Result<String> {
    let problem = ExactProblem {
        holes: site.holes.clone(),
        zones: site.zones.clone(),
        clearance_m: args.clearance_m,
        look_ahead_m: args.look_ahead_m.unwrap_or(args.swath_m / 2.0),
        steps: args.steps,
        directions: match args.course_deg {
            Some(course) => Directions::Fixed((90.0 - course).to_radians()),
            None => Directions::Best,
        },
        ..ExactProblem::new(
            site.area.clone(),
            args.swath_m,
            args.turn_radius_m,
            Point::origin(),
        )
    };
    let member = Member {
        speed: args.speed_mps,
        endurance: args.endurance_s.unwrap_or(f64::INFINITY),
        ..Member::at(Point::origin())
    };
    let plan = plan_team(&problem, &vec![member; args.k])
        .with_context(|| args.file.display().to_string())?;
    let sheet = Sheet { args, site, plan };
    match args.format {
        Format::Json => Ok(sheet.json().to_string()),
        Format::Geojson => Ok(sheet.geojson().to_string()),
        Format::Plan => sheet.plans(),
    }
}

/// A plan to be printed.
struct Sheet<'a> {
    args: &'a CoverArgs,
    site: &'a Site,
    plan: TeamPlan,
}

impl Sheet<'_> {
    fn summary(&self) -> Value {
        let length_m: f64 = self.plan.lengths_m.iter().sum();
        json!({
            "planner": "exact",
            "makespan_s": self.plan.makespan,
            "total_m": length_m,
            "area_m2": self.plan.cells.iter().map(|c| c.area_m2).sum::<f64>(),
            "cells": self.plan.cells.len(),
            "passes": self.plan.tours.iter().map(Vec::len).sum::<usize>(),
            "unserved_passes": self.plan.unserved.len(),
            "notices": self.site.notices,
        })
    }

    fn tour(&self, uav: usize) -> Value {
        json!({
            "uav": uav + 1,
            "time_s": self.plan.lengths_m[uav] / self.args.speed_mps,
            "length_m": self.plan.lengths_m[uav],
            "passes": self.plan.tours[uav].len(),
        })
    }

    fn track(&self, uav: usize) -> Vec<Point> {
        let mut track = self.plan.tracks[uav].clone();
        track.dedup_by(|p, q| (*p - *q).norm() < COINCIDENT_M);
        track
    }

    fn json(&self) -> Value {
        let tours = (0..self.plan.tours.len()).map(|uav| {
            let points = self.track(uav).into_iter().map(|p| {
                let at = from_plane(self.site.origin, p);
                json!({"lat_deg": at.lat_deg, "lon_deg": at.lon_deg})
            });
            let mut tour = self.tour(uav);
            tour["points"] = points.collect();
            tour
        });
        let mut out = self.summary();
        out["tours"] = tours.collect();
        out
    }

    fn geojson(&self) -> Value {
        let place = |p: &Point| {
            let at = from_plane(self.site.origin, *p);
            json!([at.lon_deg, at.lat_deg])
        };
        let flights = (0..self.plan.tours.len()).map(|uav| {
            let line: Vec<Value> = self.track(uav).iter().map(place).collect();
            // A line has two points at least; a UAV that stays has one.
            let geometry = if line.len() < 2 {
                json!({"type": "Point", "coordinates": line.first()})
            } else {
                json!({"type": "LineString", "coordinates": line})
            };
            json!({"type": "Feature", "properties": self.tour(uav), "geometry": geometry})
        });
        let cells = self.plan.cells.iter().enumerate().map(|(i, cell)| {
            let ring: Vec<Value> = cell
                .ring
                .iter()
                .chain(cell.ring.first())
                .map(place)
                .collect();
            json!({
                "type": "Feature",
                "properties": {"cell": i + 1, "area_m2": cell.area_m2},
                "geometry": {"type": "Polygon", "coordinates": [ring]},
            })
        });
        let mut out = self.summary();
        out["type"] = json!("FeatureCollection");
        out["features"] = flights.chain(cells).collect();
        out
    }

    /// One QGroundControl plan a UAV.
    fn plans(&self) -> Result<String> {
        let home = from_plane(self.site.origin, Point::origin());
        let text = |uav: usize| {
            let at = |p: &Point| from_plane(self.site.origin, *p);
            let track = self.track(uav);
            let waypoints = track.iter().skip(1);
            write(&PlanFile {
                waypoints: waypoints
                    .map(|p| Waypoint::new(at(p), self.args.altitude_m))
                    .collect(),
                home: Some(home),
                cruise_mps: Some(self.args.speed_mps),
                ..PlanFile::default()
            })
        };
        let Some(dir) = &self.args.out else {
            if self.plan.tours.len() == 1 {
                return Ok(text(0));
            }
            bail!("--format plan for several UAVs needs --out DIR: one file a UAV");
        };
        std::fs::create_dir_all(dir).with_context(|| format!("cannot make {}", dir.display()))?;
        let mut written = Vec::new();
        for uav in 0..self.plan.tours.len() {
            let path = dir.join(format!("uav-{}.plan", uav + 1));
            std::fs::write(&path, text(uav) + "\n")
                .with_context(|| format!("cannot write {}", path.display()))?;
            written.push(path.display().to_string());
        }
        let mut out = self.summary();
        out["files"] = json!(written);
        Ok(out.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        args: CoverArgs,
    }

    fn told(dir: &std::path::Path, text: &str, more: &[&str]) -> Result<String> {
        let file = dir.join("area.geojson");
        std::fs::write(&file, text).unwrap();
        let file = file.display().to_string();
        let all = ["cover", &file, "--exact"]
            .into_iter()
            .chain(more.iter().copied());
        run(&Cli::try_parse_from(all).unwrap().args)
    }

    const FIELD: &str = r#"{"type":"FeatureCollection","features":[
        {"type":"Feature","geometry":{"type":"Polygon","coordinates":[
            [[8.54,47.40],[8.55,47.40],[8.55,47.41],[8.54,47.41],[8.54,47.40]],
            [[8.542,47.402],[8.544,47.402],[8.544,47.404],[8.542,47.402]]]}},
        {"type":"Feature","properties":{"no_fly":true},"geometry":{"type":"Polygon","coordinates":[
            [[8.546,47.405],[8.548,47.405],[8.547,47.407],[8.546,47.405]]]}}]}"#;

    #[test]
    fn a_field_with_a_hole_and_a_zone_is_planned_in_every_form() {
        let dir = std::env::temp_dir().join(format!("skein-plan-cover-{}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        let alone: Value = serde_json::from_str(&told(&dir, FIELD, &[]).unwrap()).unwrap();
        assert_eq!(alone["tours"].as_array().unwrap().len(), 1);
        assert!(alone["cells"].as_u64().unwrap() >= 4);
        let three = ["--k", "3", "--format", "geojson"];
        let map: Value = serde_json::from_str(&told(&dir, FIELD, &three).unwrap()).unwrap();
        assert!(map["features"].as_array().unwrap().len() > 6);
        assert!(map["makespan_s"].as_f64() < alone["makespan_s"].as_f64());
        let out = dir.join("plans").display().to_string();
        let split = ["--k", "2", "--format", "plan", "--out", &out];
        assert!(told(&dir, FIELD, &split).unwrap().contains("uav-2.plan"));
        let text = std::fs::read_to_string(dir.join("plans/uav-1.plan")).unwrap();
        assert!(skein_interop::plan::read(&text).unwrap().waypoints.len() > 4);
        let survey = r#"{"type":"FeatureCollection","features":[]}"#;
        for (text, more, says) in [
            (FIELD, &["--k", "0"][..], "--k must be"),
            (FIELD, &["--swath-m", "0"], "lane spacing"),
            (FIELD, &["--clearance-m", "-3"], "clearance"),
            (FIELD, &["--speed-mps", "0"], "speed must be"),
            (FIELD, &["--launch", "x"], "--launch"),
            (FIELD, &["--launch", "47.4055,8.547"], "launch point"),
            (FIELD, &["--k", "2", "--format", "plan"], "--out DIR"),
            (survey, &[], "found 0"),
            ("{", &[], "not valid JSON"),
        ] {
            let error = format!("{:#}", told(&dir, text, more).unwrap_err());
            assert!(error.contains(says), "{error}");
        }
        std::fs::remove_dir_all(&dir).unwrap();
    }
}
