//! What `plan line` and `plan visit` share: the team, the wind, and how tours are printed.
//! Leaves to them which lines there are to fly.

use super::lat_lon;
use anyhow::{Context, Result, bail, ensure};
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use skein_interop::place::{LatLon, from_plane, to_plane};
use skein_interop::plan::{PlanFile, Waypoint, write};
use skein_planning::coverage::line::{Line, LinePlan, Surveyor};
use skein_planning::coverage::metric::{InWind, Metric};
use skein_planning::frame::{Origin, Point, Vector};
use skein_planning::math::sin_cos;
use std::path::PathBuf;

/// The most UAVs that are planned for: the same as a swarm's.
const MAX_TEAM: usize = 1_000;

/// Points nearer to each other than this are one in the track, metres.
const COINCIDENT_M: f64 = 1e-3;

/// The team, the wind and the form of the result.
#[derive(Debug, Args)]
pub struct TourArgs {
    /// How many UAVs.
    #[arg(long, default_value_t = 1, value_name = "K")]
    pub k: usize,
    /// Where all UAVs start and end, degrees; by default the file's home position, or
    /// its first target.
    #[arg(long, value_name = "LAT,LON", allow_hyphen_values = true)]
    pub depot: Option<String>,
    /// Airspeed, m/s.
    #[arg(long, default_value_t = 15.0, value_name = "V")]
    pub speed_mps: f64,
    /// Wind speed, m/s.
    #[arg(long, default_value_t = 0.0, value_name = "W")]
    pub wind_mps: f64,
    /// Where the wind comes from, degrees clockwise from north.
    #[arg(
        long,
        default_value_t = 0.0,
        value_name = "DEG",
        allow_hyphen_values = true
    )]
    pub wind_from_deg: f64,
    /// The longest time that a UAV flies, seconds; lines beyond that are left out and named.
    #[arg(long, value_name = "S")]
    pub endurance_s: Option<f64>,
    /// Width of the ground that a UAV sees, metres: what is wider is flown in lanes.
    #[arg(long, default_value_t = 60.0, value_name = "M")]
    pub swath_m: f64,
    /// Steps of improvement; the same steps give the same plan everywhere.
    #[arg(long, default_value_t = skein_planning::coverage::line::DEFAULT_STEPS, value_name = "N")]
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

/// The ways to fly, over numbered places.
pub struct Ways {
    origin: Origin,
    /// All places: the depot first.
    pub at: Vec<Point>,
    /// Each way as places in order, and the name of the item that it serves.
    pub ways: Vec<(Vec<usize>, String)>,
    notices: Vec<String>,
}

impl Ways {
    /// No ways yet, and a depot: the flag's, or `home`.
    ///
    /// # Errors
    /// When the flag is wrong, or there is nothing to go by.
    pub fn new(args: &TourArgs, home: Option<LatLon>, notices: Vec<String>) -> Result<Self> {
        let depot = match &args.depot {
            Some(text) => lat_lon(text).context("--depot")?,
            None => home.context("the file holds nothing to plan")?,
        };
        let origin = Origin {
            lat_deg: depot.lat_deg,
            lon_deg: depot.lon_deg,
        };
        Ok(Self {
            origin,
            at: vec![to_plane(origin, depot)?],
            ways: Vec::new(),
            notices,
        })
    }

    /// A point of the file in the plane.
    ///
    /// # Errors
    /// When it is too far from the depot; the error names the item.
    pub fn point(&self, at: LatLon, name: &str) -> Result<Point> {
        to_plane(self.origin, at).with_context(|| name.to_owned())
    }

    /// A new place.
    pub fn place(&mut self, p: Point) -> usize {
        self.at.push(p);
        self.at.len() - 1
    }

    /// Adds a way over new places.
    pub fn push(&mut self, way: &[Point], name: &str) {
        let places = way.iter().map(|&p| self.place(p)).collect();
        self.ways.push((places, name.to_owned()));
    }

    /// Plans with `planner` and returns the text to print.
    ///
    /// # Errors
    /// When a flag is wrong, or a file cannot be written.
    pub fn plan(
        &self,
        args: &TourArgs,
        planner: impl FnOnce(&[Line], &[Surveyor], &InWind<'_>) -> Result<LinePlan>,
    ) -> Result<String> {
        ensure!(
            (1..=MAX_TEAM).contains(&args.k),
            "--k must be between 1 and {MAX_TEAM}, found {}",
            args.k
        );
        let (s, c) = sin_cos(args.wind_from_deg.to_radians());
        let wind = Vector::new(-s, -c) * args.wind_mps;
        let metric = InWind::new(&self.at, args.speed_mps, wind).context("--wind-mps")?;
        let lines: Vec<Line> = self
            .ways
            .iter()
            .map(|(way, _)| {
                let cost = way.windows(2).map(|w| metric.cost(w[0], w[1])).sum();
                let ends = way.first().zip(way.last());
                let (a, b) = ends.map_or((0, 0), |(a, b)| (*a, *b));
                Line::new(a, b, cost)
            })
            .collect();
        let uav = Surveyor {
            endurance: args.endurance_s.unwrap_or(f64::INFINITY),
            ..Surveyor::at(0)
        };
        let plan = planner(&lines, &vec![uav; args.k], &metric)?;
        match args.format {
            Format::Json => Ok(self.json(&plan).to_string()),
            Format::Geojson => Ok(self.geojson(&plan).to_string()),
            Format::Plan => self.plans(args, &plan),
        }
    }

    /// The points of a tour, from the depot back to it.
    fn track(&self, plan: &LinePlan, uav: usize) -> Vec<Point> {
        let mut places = vec![0];
        for pass in &plan.tours[uav].passes {
            let way = &self.ways[pass.line].0;
            if pass.backward {
                places.extend(way.iter().rev());
            } else {
                places.extend(way);
            }
        }
        places.push(0);
        let mut track: Vec<Point> = places.iter().map(|&p| self.at[p]).collect();
        // Different places may coincide, a target with the depot for example.
        track.dedup_by(|p, q| (*p - *q).norm() < COINCIDENT_M);
        track
    }

    fn summary(&self, plan: &LinePlan) -> Value {
        let unserved: Vec<&str> = plan
            .unserved
            .iter()
            .map(|&i| self.ways[i].1.as_str())
            .collect();
        json!({
            "makespan_s": plan.makespan, "lower_bound_s": plan.lower_bound,
            "total_s": plan.tours.iter().map(|t| t.cost).sum::<f64>(),
            "targets": self.ways.len(), "unserved": unserved, "notices": self.notices,
        })
    }

    fn tour(&self, plan: &LinePlan, uav: usize) -> Value {
        let track = self.track(plan, uav);
        let length_m: f64 = track.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        json!({
            "uav": uav + 1, "time_s": plan.tours[uav].cost, "length_m": length_m,
            "targets": plan.tours[uav].passes.len(),
        })
    }

    fn json(&self, plan: &LinePlan) -> Value {
        let tours: Vec<Value> = (0..plan.tours.len())
            .map(|uav| {
                let passes: Vec<Value> = plan.tours[uav]
                    .passes
                    .iter()
                    .map(|p| json!({"target": self.ways[p.line].1, "backward": p.backward}))
                    .collect();
                let points: Vec<Value> = self
                    .track(plan, uav)
                    .iter()
                    .map(|p| {
                        let at = from_plane(self.origin, *p);
                        json!({"lat_deg": at.lat_deg, "lon_deg": at.lon_deg})
                    })
                    .collect();
                let mut tour = self.tour(plan, uav);
                tour["passes"] = json!(passes);
                tour["points"] = json!(points);
                tour
            })
            .collect();
        let mut out = self.summary(plan);
        out["tours"] = json!(tours);
        out
    }

    fn geojson(&self, plan: &LinePlan) -> Value {
        let features: Vec<Value> = (0..plan.tours.len())
            .map(|uav| {
                let line: Vec<Value> = self
                    .track(plan, uav)
                    .iter()
                    .map(|p| {
                        let at = from_plane(self.origin, *p);
                        json!([at.lon_deg, at.lat_deg])
                    })
                    .collect();
                // A line has two points at least; a UAV that stays has one.
                let geometry = if line.len() < 2 {
                    json!({"type": "Point", "coordinates": line.first()})
                } else {
                    json!({"type": "LineString", "coordinates": line})
                };
                json!({"type": "Feature", "properties": self.tour(plan, uav), "geometry": geometry})
            })
            .collect();
        let mut out = self.summary(plan);
        out["type"] = json!("FeatureCollection");
        out["features"] = json!(features);
        out
    }

    /// One QGroundControl plan a UAV.
    fn plans(&self, args: &TourArgs, plan: &LinePlan) -> Result<String> {
        let home = from_plane(self.origin, self.at[0]);
        let text = |uav: usize| {
            let track = self.track(plan, uav);
            let waypoint = |p: &Point| Waypoint::new(from_plane(self.origin, *p), args.altitude_m);
            write(&PlanFile {
                waypoints: track.iter().skip(1).map(waypoint).collect(),
                home: Some(home),
                cruise_mps: Some(args.speed_mps),
                ..PlanFile::default()
            })
        };
        let Some(dir) = &args.out else {
            if plan.tours.len() == 1 {
                return Ok(text(0));
            }
            bail!("--format plan for several UAVs needs --out DIR: one file a UAV");
        };
        std::fs::create_dir_all(dir).with_context(|| format!("cannot make {}", dir.display()))?;
        let mut written = Vec::new();
        for uav in 0..plan.tours.len() {
            let path = dir.join(format!("uav-{}.plan", uav + 1));
            std::fs::write(&path, text(uav) + "\n")
                .with_context(|| format!("cannot write {}", path.display()))?;
            written.push(path.display().to_string());
        }
        let mut out = self.summary(plan);
        out["files"] = json!(written);
        Ok(out.to_string())
    }
}
