//! How the flights of a team are printed, whoever planned them: JSON, GeoJSON, or one
//! QGroundControl plan a UAV (D2.7 §3.4–3.6).
//!
//! Leaves to the planners what is worth telling about a flight.

use anyhow::{Context, Result, bail, ensure};
use clap::{Args, ValueEnum};
use serde_json::{Map, Value, json};
use skein_geometry::Segment;
use skein_geometry::frame::{Origin, Point};
use skein_interop::place::from_plane;
use skein_interop::plan::{PlanFile, Waypoint, write};
use skein_survey::flight::{Leg, UavFlight};
use std::path::{Path, PathBuf};

/// Points nearer to each other than this are one in the track, metres.
const COINCIDENT_M: f64 = 1e-3;

/// Nothing that this plans for flies higher above its home, metres.
const HIGHEST_M: f64 = 20_000.0;

/// The form of the result.
#[derive(Clone, Debug, Args)]
pub struct OutputArgs {
    /// Height of the waypoints above home, metres.
    #[arg(
        long,
        default_value_t = 60.0,
        value_name = "M",
        allow_hyphen_values = true
    )]
    pub altitude_m: f64,
    /// How the result is printed.
    #[arg(long, value_enum, default_value_t = Format::Json)]
    pub format: Format,
    /// Directory for the `.plan` files, one a UAV, instead of printing.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

/// Forms of the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// One JSON object.
    Json,
    /// A feature collection: one line a UAV.
    Geojson,
    /// QGroundControl plans, one a UAV: several need `--out`.
    Plan,
}

impl OutputArgs {
    /// Refuses what cannot be printed for a team of this size, before it is planned.
    ///
    /// # Errors
    /// When the height is no height, a folder was named for what is printed, or several
    /// plans have none.
    pub fn check(&self, n_uavs: usize) -> Result<()> {
        ensure!(
            self.altitude_m.abs() <= HIGHEST_M,
            "--altitude-m must be between -{HIGHEST_M} and {HIGHEST_M}, found {}",
            self.altitude_m
        );
        let files = self.format == Format::Plan;
        // Nobody is to look for files in a folder that gets none.
        if self.out.is_some() && !files {
            bail!("--out is for .plan files, one a UAV: add --format plan, or leave it out");
        }
        if self.out.is_none() && files && n_uavs > 1 {
            bail!("--format plan for several UAVs needs --out DIR: one file a UAV");
        }
        Ok(())
    }

    /// The text to print; writes the files that were asked for.
    ///
    /// # Errors
    /// As [`OutputArgs::check`], or when a file cannot be written.
    pub fn print(&self, sheet: &Sheet) -> Result<String> {
        self.check(sheet.flights.len())?;
        Ok(match (self.format, &self.out, sheet.flights.as_slice()) {
            (Format::Json, ..) => sheet.json().to_string(),
            (Format::Geojson, ..) => sheet.geojson().to_string(),
            (Format::Plan, Some(dir), _) => sheet.write(dir)?.to_string(),
            (Format::Plan, None, [flight]) => sheet.plan(flight),
            (Format::Plan, None, _) => bail!("there are no flights"),
        })
    }
}

/// One UAV's flight to be printed.
#[derive(Clone, Debug)]
pub struct Printed {
    /// What the UAV is called: the name of its file.
    pub name: String,
    /// Its corners, from its start and back to it.
    pub track: Vec<Point>,
    /// Height above home, metres.
    pub altitude_m: f64,
    /// Airspeed, m/s.
    pub speed_mps: f64,
    /// What it flies, piece by piece; empty if it stays.
    pub legs: Vec<Leg>,
    /// What is told about it in every form but files.
    pub told: Map<String, Value>,
    /// What is told about it in JSON alone.
    pub details: Map<String, Value>,
}

impl Printed {
    /// A flight of a plan.
    #[must_use]
    pub fn new(flight: &UavFlight) -> Self {
        let mut told = Map::new();
        for (key, value) in [
            ("time_s", Some(flight.time_s)),
            ("length_m", Some(flight.length_m)),
            ("energy_s", Some(flight.energy_s)),
            ("energy_wh", flight.energy_wh),
            ("lane_m", flight.lane_m),
        ] {
            if let Some(value) = value {
                told.insert(key.to_owned(), json!(value));
            }
        }
        if let Some(passes) = flight.passes {
            told.insert("passes".to_owned(), json!(passes));
        }
        Self {
            name: flight.name.clone(),
            track: flight.path.clone(),
            altitude_m: flight.altitude_m,
            speed_mps: flight.speed_mps,
            legs: flight.legs.clone(),
            told,
            details: Map::new(),
        }
    }

    /// The corners, none twice in a row: different places may coincide, a target with the
    /// depot for example.
    fn points(&self) -> Vec<Point> {
        let mut track = self.track.clone();
        track.dedup_by(|p, q| (*p - *q).norm() < COINCIDENT_M);
        track
    }

    fn told(&self, uav: usize) -> Map<String, Value> {
        let mut told = self.told.clone();
        told.insert("uav".to_owned(), json!(uav + 1));
        told.insert("name".to_owned(), json!(self.name));
        told.insert("altitude_m".to_owned(), json!(self.altitude_m));
        told
    }
}

/// Flights to be printed.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// Where the plane lies.
    pub origin: Origin,
    /// What is told about all flights together: an object.
    pub summary: Value,
    /// By UAV.
    pub flights: Vec<Printed>,
    /// Rings with properties for a map.
    pub shapes: Vec<(Vec<Point>, Value)>,
}

impl Sheet {
    fn position(&self, p: &Point) -> Value {
        let at = from_plane(self.origin, *p);
        json!([at.lon_deg, at.lat_deg])
    }

    fn json(&self) -> Value {
        let flights = self.flights.iter().enumerate().map(|(uav, flight)| {
            let points = flight.points().into_iter().map(|p| {
                let at = from_plane(self.origin, p);
                json!({"lat_deg": at.lat_deg, "lon_deg": at.lon_deg})
            });
            let mut tour = flight.told(uav);
            tour.extend(flight.details.clone());
            tour.insert("points".to_owned(), points.collect());
            if !flight.legs.is_empty() {
                tour.insert("trajectory".to_owned(), self.trajectory(&flight.legs));
            }
            Value::Object(tour)
        });
        let mut out = self.summary.clone();
        let Origin { lat_deg, lon_deg } = self.origin;
        out["origin"] = json!({"lat_deg": lat_deg, "lon_deg": lon_deg});
        out["flights"] = flights.collect();
        out
    }

    /// Lines and arcs one after the other. Courses are clockwise from north, and radii
    /// positive to the right; a line has none.
    fn trajectory(&self, legs: &[Leg]) -> Value {
        let piece = |leg: &Leg, s: &Segment| {
            let at = from_plane(self.origin, s.start.position());
            let arc = s.curvature_per_m != 0.0;
            json!({
                "lat_deg": at.lat_deg, "lon_deg": at.lon_deg,
                "course_deg": (90.0 - s.start.heading_rad.to_degrees()).rem_euclid(360.0),
                "length_m": s.length_m,
                "radius_m": arc.then(|| -1.0 / s.curvature_per_m),
                "sees": leg.sees,
            })
        };
        let pieces = legs
            .iter()
            .flat_map(|leg| leg.curve.segments().iter().map(move |s| piece(leg, s)));
        pieces.collect()
    }

    fn geojson(&self) -> Value {
        let flights = self.flights.iter().enumerate().map(|(uav, flight)| {
            let points = flight.points();
            let line: Vec<Value> = points.iter().map(|p| self.position(p)).collect();
            // A line has two points at least; a UAV that stays has one.
            let geometry = if line.len() < 2 {
                json!({"type": "Point", "coordinates": line.first()})
            } else {
                json!({"type": "LineString", "coordinates": line})
            };
            json!({"type": "Feature", "properties": flight.told(uav), "geometry": geometry})
        });
        let shapes = self.shapes.iter().map(|(ring, properties)| {
            let ring = ring.iter().chain(ring.first());
            let ring: Vec<Value> = ring.map(|p| self.position(p)).collect();
            json!({
                "type": "Feature", "properties": properties,
                "geometry": {"type": "Polygon", "coordinates": [ring]},
            })
        });
        let mut out = self.summary.clone();
        out["type"] = json!("FeatureCollection");
        out["features"] = flights.chain(shapes).collect();
        out
    }

    /// The QGroundControl plan of a flight.
    fn plan(&self, flight: &Printed) -> String {
        let at = |p: &Point| from_plane(self.origin, *p);
        let track = flight.points();
        let waypoints = track.iter().skip(1);
        write(&PlanFile {
            waypoints: waypoints
                .map(|p| Waypoint::new(at(p), flight.altitude_m))
                .collect(),
            home: track.first().map(at),
            cruise_mps: Some(flight.speed_mps),
            ..PlanFile::default()
        })
    }

    /// Writes one plan a UAV, also for one that stays: an older file would be flown.
    fn write(&self, dir: &Path) -> Result<Value> {
        std::fs::create_dir_all(dir)
            .with_context(|| format!("--out: cannot make the folder {}", dir.display()))?;
        let mut written = Vec::new();
        for flight in &self.flights {
            let path = dir.join(format!("{}.plan", flight.name));
            std::fs::write(&path, self.plan(flight) + "\n")
                .with_context(|| format!("--out: cannot write {}", path.display()))?;
            written.push(path.display().to_string());
        }
        let mut out = self.summary.clone();
        out["files"] = json!(written);
        Ok(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet(names: &[&str]) -> Sheet {
        let flight = |name: &&str| Printed {
            name: (*name).to_owned(),
            track: [0.0, 0.0, 100.0, 0.0].map(|x| Point::new(x, 0.0)).to_vec(),
            altitude_m: 80.0,
            speed_mps: 15.0,
            legs: Vec::new(),
            told: Map::new(),
            details: Map::from_iter([("passes".to_owned(), json!(2))]),
        };
        Sheet {
            origin: Origin {
                lat_deg: 47.0,
                lon_deg: 8.0,
            },
            summary: json!({"makespan_s": 1.0}),
            flights: names.iter().map(flight).collect(),
            shapes: Vec::new(),
        }
    }

    fn args(format: Format, out: Option<PathBuf>) -> OutputArgs {
        OutputArgs {
            altitude_m: 60.0,
            format,
            out,
        }
    }

    #[test]
    fn each_form_tells_the_height_and_no_point_twice() {
        let told = args(Format::Json, None).print(&sheet(&["a"])).unwrap();
        let told: Value = serde_json::from_str(&told).unwrap();
        assert_eq!(told["flights"][0]["points"].as_array().unwrap().len(), 3);
        assert_eq!(told["flights"][0]["passes"], 2);
        let map = args(Format::Geojson, None).print(&sheet(&["a"])).unwrap();
        assert!(map.contains("\"altitude_m\":80.0") && !map.contains("passes"));
        let plan = args(Format::Plan, None).print(&sheet(&["a"])).unwrap();
        let plan = skein_interop::plan::read(&plan).unwrap();
        assert_eq!(plan.waypoints.len(), 2);
        assert!((plan.waypoints[0].altitude_m - 80.0).abs() < 1e-9);
    }

    #[test]
    fn folders_and_heights_without_a_meaning_are_refused() {
        let error = |args: &OutputArgs| {
            let error = args.print(&sheet(&["a", "b"])).unwrap_err();
            format!("{error:#}")
        };
        let dir = std::env::temp_dir().join(format!("skein-plan-out-{}", std::process::id()));
        let folder = || Some(dir.clone());
        assert!(error(&args(Format::Json, folder())).contains("add --format plan"));
        assert!(error(&args(Format::Geojson, folder())).contains("add --format plan"));
        assert!(error(&args(Format::Plan, None)).contains("needs --out DIR"));
        assert!(!dir.exists());
        // A file where the folder would be.
        std::fs::write(&dir, "").unwrap();
        assert!(error(&args(Format::Plan, folder())).contains("--out: cannot make the folder"));
        std::fs::remove_file(&dir).unwrap();
        std::fs::create_dir_all(dir.join("b.plan")).unwrap();
        assert!(error(&args(Format::Plan, folder())).contains("--out: cannot write"));
        std::fs::remove_dir_all(&dir).unwrap();
        let mut high = args(Format::Json, None);
        for altitude_m in [f64::NAN, f64::INFINITY, 1e6] {
            high.altitude_m = altitude_m;
            assert!(error(&high).contains("--altitude-m must be"));
        }
    }
}
