//! How the flights of a team are printed, whoever planned them: JSON, GeoJSON, or one
//! QGroundControl plan a UAV (D2.7 §3.4–3.6).
//!
//! Leaves to the planners what is worth telling about a flight.

use super::args::{LENGTH_M, within};
use super::site::Site;
use super::upload::{self, UploadArgs};
use super::view::ALTITUDE_M;
use anyhow::{Context, Result, anyhow, bail, ensure};
use clap::{Args, ValueEnum};
use serde_json::{Map, Value, json};
use skein_geometry::Segment;
use skein_geometry::frame::{Origin, Point};
use skein_interop::mission::write;
use skein_interop::place::from_plane;
use skein_survey::flight::{Leg, UavFlight};
use skein_survey::heights::{MOST_HEIGHT_M, check_heights};
use std::path::{Path, PathBuf};

/// Points nearer to each other than this are one in the track, metres.
const COINCIDENT_M: f64 = 1e-3;

/// Of so many UAVs it is said why nobody flies.
const SHOWN: usize = 3;

/// Nothing that this plans for flies higher above its home, metres.
const HIGHEST_M: f64 = 20_000.0;

/// The form of the result.
#[derive(Clone, Debug, Args)]
pub struct OutputArgs {
    /// Height of the lowest flight above home, metres; by default that of the file's
    /// survey, else 60.
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub altitude_m: Option<f64>,
    /// Plans with a flight above this height above home are refused, metres.
    #[arg(
        long,
        default_value_t = MOST_HEIGHT_M,
        value_name = "M",
        allow_hyphen_values = true
    )]
    pub max_height_m: f64,
    /// How the result is printed.
    #[arg(long, value_enum, default_value_t = Format::Json)]
    pub format: Format,
    /// Directory for the `.plan` files, one a UAV, instead of printing.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// What is written into files beside the flights.
    #[command(flatten)]
    pub upload: UploadArgs,
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
    /// The height of the lowest flight where no file says one, metres.
    #[must_use]
    pub fn altitude_m(&self) -> f64 {
        self.altitude_m.unwrap_or(ALTITUDE_M)
    }

    /// Refuses a height of the lowest flight, whoever chose it.
    ///
    /// # Errors
    /// Names the flag.
    pub fn check_altitude(&self, altitude_m: f64) -> Result<()> {
        within("--altitude-m", altitude_m, (-HIGHEST_M, HIGHEST_M), "m")?;
        ensure!(
            altitude_m <= self.max_height_m,
            "the lowest flight would be at {altitude_m} m, above --max-height-m {}: a lower --altitude-m, or a higher limit where one may fly there",
            self.max_height_m
        );
        ensure!(
            self.format != Format::Plan || altitude_m > 0.0,
            "--altitude-m must be above 0 in .plan files, which begin with a take-off, found {altitude_m}"
        );
        Ok(())
    }

    /// Refuses what cannot be printed for a team of this size, before it is planned.
    ///
    /// # Errors
    /// When the height is no height, a folder was named for what is printed, or several
    /// plans have none.
    pub fn check(&self, n_uavs: usize) -> Result<()> {
        let heights_m = (-HIGHEST_M, HIGHEST_M);
        within("--max-height-m", self.max_height_m, heights_m, "m")?;
        // Where no flag says one, a file may.
        if let Some(altitude_m) = self.altitude_m {
            self.check_altitude(altitude_m)?;
        }
        if let Some(altitude_m) = self.upload.home_altitude_m {
            within("--home-altitude-m", altitude_m, heights_m, "m")?;
        }
        if let Some(trigger_m) = self.upload.trigger_m {
            within("--trigger-m", trigger_m, LENGTH_M, "m")?;
        }
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
        ensure!(
            sheet.flights.iter().any(Printed::flies),
            "nobody can fly: {}",
            sheet.reasons()
        );
        let flying = sheet.flights.iter().filter(|flight| flight.flies());
        let heights = flying.map(|flight| (flight.name.as_str(), flight.altitude_m));
        let heights: Vec<(&str, f64)> = heights.collect();
        check_heights(&heights, self.max_height_m).map_err(|error| {
            anyhow!(
                "{error}; fewer UAVs, a smaller --layer-step-m or --separation-m, a lower --altitude-m, several launches one after the other, or a higher --max-height-m where one may fly there"
            )
        })?;
        let json = match (self.format, &self.out, sheet.flights.as_slice()) {
            (Format::Json, ..) => sheet.json(),
            (Format::Geojson, ..) => sheet.geojson(),
            (Format::Plan, Some(dir), _) => sheet.write(dir, &self.upload)?,
            (Format::Plan, None, [flight]) => return Ok(sheet.plan(flight, &self.upload)),
            (Format::Plan, None, _) => bail!("there are no flights"),
        };
        Ok(text(json))
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
    /// Distance between two pictures where nobody else says one, metres.
    pub trigger_m: Option<f64>,
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
            ("speed_mps", Some(flight.speed_mps)),
            ("turn_radius_m", Some(flight.turn_radius_m)),
            ("swath_m", flight.lane_m),
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
            // A picture sees half a lane before and behind; half of that is shared.
            trigger_m: flight.lane_m.map(|lane_m| lane_m / 2.0),
            legs: flight.legs.clone(),
            told,
            details: Map::new(),
        }
    }

    /// Whether it leaves its start at all.
    #[must_use]
    pub fn flies(&self) -> bool {
        self.points().len() > 1
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
    /// What files for upload take over.
    pub site: Site,
    /// What is told about all flights together: an object.
    pub summary: Value,
    /// By UAV.
    pub flights: Vec<Printed>,
    /// Rings with properties for a map.
    pub shapes: Vec<(Vec<Point>, Value)>,
}

impl Sheet {
    /// Why UAVs stay at home, and what was noticed: the first few, for a person.
    fn reasons(&self) -> String {
        let home = self.summary["at_home"].as_array().into_iter().flatten();
        let home = home.filter_map(|uav| {
            let (name, why) = (uav["name"].as_str()?, uav["why"].as_str()?);
            Some(format!("{name} {why}"))
        });
        let notices = self.summary["notices"].as_array().into_iter().flatten();
        let notices = notices.filter_map(|notice| notice.as_str().map(str::to_owned));
        let all: Vec<String> = home.take(SHOWN).chain(notices.take(SHOWN)).collect();
        all.join("; ")
    }

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
                tour.insert(
                    "trajectory".to_owned(),
                    trajectory(self.origin, &flight.legs),
                );
            }
            Value::Object(tour)
        });
        let mut out = self.summary.clone();
        let Origin { lat_deg, lon_deg } = self.origin;
        out["origin"] = json!({"lat_deg": lat_deg, "lon_deg": lon_deg});
        out["flights"] = flights.collect();
        out
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
            // Two corners are a line.
            let is_line = ring.len() == 2;
            let ring = ring.iter().chain(ring.first().filter(|_| !is_line));
            let ring: Vec<Value> = ring.map(|p| self.position(p)).collect();
            let geometry = if is_line {
                json!({"type": "LineString", "coordinates": ring})
            } else {
                json!({"type": "Polygon", "coordinates": [ring]})
            };
            json!({"type": "Feature", "properties": properties, "geometry": geometry})
        });
        let mut out = self.summary.clone();
        out["type"] = json!("FeatureCollection");
        out["features"] = flights.chain(shapes).collect();
        out
    }

    /// The QGroundControl plan of a flight.
    fn plan(&self, flight: &Printed, asked: &UploadArgs) -> String {
        write(&upload::mission(flight, self.origin, &self.site, asked))
    }

    /// Writes one plan for each UAV that flies. What an older plan of one that stays would
    /// have it fly is removed.
    fn write(&self, dir: &Path, asked: &UploadArgs) -> Result<Value> {
        std::fs::create_dir_all(dir)
            .with_context(|| format!("--out: cannot make the folder {}", dir.display()))?;
        let (mut written, mut removed) = (Vec::new(), Vec::new());
        let mut notices = upload::notices(&self.flights, self.origin, &self.site, asked);
        for flight in &self.flights {
            let path = dir.join(format!("{}.plan", flight.name));
            let shown = path.display().to_string();
            if flight.flies() {
                std::fs::write(&path, self.plan(flight, asked) + "\n")
                    .with_context(|| format!("--out: cannot write {shown}"))?;
                written.push(shown);
            } else if std::fs::symlink_metadata(&path).is_ok() {
                std::fs::remove_file(&path).with_context(|| {
                    format!(
                        "--out: {} stays at home, and {shown} of an earlier plan cannot be removed",
                        flight.name
                    )
                })?;
                notices.push(format!(
                    "{shown} was removed: {} stays at home",
                    flight.name
                ));
                removed.push(shown);
            } else {
                notices.push(format!("{} stays at home: no file", flight.name));
            }
        }
        let older = older_plans(dir, &written);
        if !older.is_empty() {
            notices.push(format!("not of this plan: {}", older.join(", ")));
        }
        let mut out = self.summary.clone();
        out["files"] = json!(written);
        out["removed"] = json!(removed);
        match out.get_mut("notices").and_then(Value::as_array_mut) {
            Some(all) => all.extend(notices.into_iter().map(Value::from)),
            None => out["notices"] = json!(notices),
        }
        Ok(out)
    }
}

/// Plans in a folder that were not written now.
fn older_plans(dir: &Path, written: &[String]) -> Vec<String> {
    let entries = std::fs::read_dir(dir).into_iter().flatten().flatten();
    let paths = entries.map(|entry| entry.path());
    let plans = paths.filter(|path| path.extension().is_some_and(|e| e == "plan"));
    let shown = plans.map(|path| path.display().to_string());
    let mut older: Vec<String> = shown.filter(|path| !written.contains(path)).collect();
    older.sort();
    older
}

/// The text of a value.
pub(super) fn text(mut value: Value) -> String {
    positive_zeros(&mut value);
    value.to_string()
}

/// Writes -0.0 as 0.0 wherever it stands.
fn positive_zeros(value: &mut Value) {
    match value {
        Value::Number(n) if n.is_f64() && n.as_f64() == Some(0.0) => *value = json!(0.0),
        Value::Array(items) => items.iter_mut().for_each(positive_zeros),
        Value::Object(members) => members.values_mut().for_each(positive_zeros),
        _ => {}
    }
}

/// Lines and arcs one after the other. Courses are clockwise from north, and radii
/// positive to the right; a line has none.
pub(super) fn trajectory(origin: Origin, legs: &[Leg]) -> Value {
    let piece = |leg: &Leg, s: &Segment| {
        let at = from_plane(origin, s.start.position());
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

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet(names: &[&str]) -> Sheet {
        let flight = |name: &&str| Printed {
            name: (*name).to_owned(),
            track: [0.0, 0.0, 100.0, 0.0].map(|x| Point::new(x, 0.0)).to_vec(),
            altitude_m: 80.0,
            speed_mps: 15.0,
            trigger_m: None,
            legs: Vec::new(),
            told: Map::new(),
            details: Map::from_iter([("passes".to_owned(), json!(2))]),
        };
        Sheet {
            origin: Origin {
                lat_deg: 47.0,
                lon_deg: 8.0,
            },
            site: Site::default(),
            summary: json!({"makespan_s": 1.0}),
            flights: names.iter().map(flight).collect(),
            shapes: Vec::new(),
        }
    }

    fn args(format: Format, out: Option<PathBuf>) -> OutputArgs {
        OutputArgs {
            altitude_m: None,
            max_height_m: MOST_HEIGHT_M,
            format,
            out,
            upload: UploadArgs::default(),
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
        // Take-off, out and back.
        assert_eq!(plan.waypoints.len(), 3);
        assert!(
            plan.waypoints
                .iter()
                .all(|w| (w.altitude_m - 80.0).abs() < 1e-9)
        );
    }

    #[test]
    fn who_stays_gets_no_file_and_loses_an_older_one() {
        let dir = std::env::temp_dir().join(format!("skein-plan-stays-{}", std::process::id()));
        let mut both = sheet(&["a", "b"]);
        let to_plan = args(Format::Plan, Some(dir.clone()));
        let told = |sheet: &Sheet| -> Value {
            serde_json::from_str(&to_plan.print(sheet).unwrap()).unwrap()
        };
        assert_eq!(told(&both)["files"].as_array().unwrap().len(), 2);
        both.flights[1].track.truncate(1);
        let second = told(&both);
        assert_eq!(second["files"].as_array().unwrap().len(), 1);
        assert!(second["removed"][0].as_str().unwrap().ends_with("b.plan"));
        assert!(
            second["notices"]
                .to_string()
                .contains("was removed: b stays at home")
        );
        assert!(dir.join("a.plan").exists() && !dir.join("b.plan").exists());
        let third = told(&sheet(&["c"]));
        assert!(
            third["notices"].to_string().contains("not of this plan: "),
            "{third}"
        );
        let mut alone = sheet(&["a"]);
        alone.flights[0].track.truncate(1);
        alone.summary["at_home"] = json!([{"name": "a", "why": "rests"}]);
        let error = args(Format::Plan, None)
            .print(&alone)
            .unwrap_err()
            .to_string();
        assert!(error.contains("nobody can fly: a rests"), "{error}");
        std::fs::remove_dir_all(&dir).unwrap();
    }

    #[test]
    fn nobody_is_sent_higher_than_allowed() {
        let mut both = sheet(&["a", "b"]);
        both.flights[1].altitude_m = 140.0;
        let mut json = args(Format::Json, None);
        let error = format!("{:#}", json.print(&both).unwrap_err());
        assert!(
            error.contains("b would fly at 140 m, above the 120 m"),
            "{error}"
        );
        assert!(
            error.contains("layers of at most 40 m fit; fewer UAVs"),
            "{error}"
        );
        json.max_height_m = 150.0;
        assert!(json.print(&both).is_ok());
        both.flights[1].track.truncate(1);
        json.max_height_m = 120.0;
        assert!(json.print(&both).is_ok());
    }

    #[test]
    fn zeros_have_no_sign() {
        let value = json!({"a": [-0.0, {"b": -0.0}], "c": -1.5, "d": 0});
        assert_eq!(text(value), r#"{"a":[0.0,{"b":0.0}],"c":-1.5,"d":0}"#);
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
            high.altitude_m = Some(altitude_m);
            assert!(error(&high).contains("--altitude-m must be"));
        }
        high.altitude_m = Some(130.0);
        assert!(error(&high).contains("at 130 m, above --max-height-m 120"));
        let mut low = args(Format::Plan, Some(dir.clone()));
        low.altitude_m = Some(0.0);
        assert!(error(&low).contains("begin with a take-off"));
        high.altitude_m = None;
        high.upload.trigger_m = Some(-1.0);
        assert!(error(&high).contains("--trigger-m must be"));
        high.upload.trigger_m = None;
        high.upload.home_altitude_m = Some(f64::NAN);
        assert!(error(&high).contains("--home-altitude-m must be"));
    }
}
