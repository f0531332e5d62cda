//! What `plan line` and `plan visit` share: the team, the wind, and the zones on the way.
//! Leaves to them which lines there are to fly.

use super::around::{Around, Asker};
use super::fleet::{self, Member};
use super::flyers::{Defaults, carried, swath_m};
use super::output::OutputArgs;
use super::{lat_lon, map};
use anyhow::{Context, Result, ensure};
use clap::Args;
use serde_json::Value;
use skein_flight::coverage::lines::{Line, Traversal, Uav};
use skein_flight::coverage::metric::{InWind, Matrix, Metric};
use skein_geometry::frame::{Origin, Point, Vector};
use skein_geometry::math::sin_cos;
use skein_geometry::offset::Zone;
use skein_interop::place::{LatLon, to_plane};
use skein_interop::{geojson, plan as qgc};
use std::cell::RefCell;
use std::path::{Path, PathBuf};

/// Round zones the ways between all places are written down: more places than this take
/// too long.
const MOST_PLACES: usize = 3_000;

/// Turn radius of a UAV that does not state its own, metres: what `plan cover` has for a
/// default.
pub const TURN_RADIUS_M: f64 = 30.0;

/// Speeds that differ by less than this are the same, m/s.
const SAME_SPEED_MPS: f64 = 1e-9;

/// The team, the wind and the form of the result.
#[derive(Clone, Debug, Args)]
pub struct TourArgs {
    /// How many UAVs.
    #[arg(long, default_value_t = 1, value_name = "K")]
    pub k: usize,
    /// The UAVs, one by one, instead of `--k`: JSON5, a list of `{name, speed_mps,
    /// endurance_s?, start?: [lat, lon], swath_m? or fov_across_deg?, turn_radius_m?,
    /// sensors?: {rgb: {swath_m or fov_across_deg}, ...}, cruise_power_w?}`.
    #[arg(long, value_name = "FILE")]
    pub fleet: Option<PathBuf>,
    /// Zones to fly round on the way, besides those of the file itself: fences of a
    /// `.plan`, or polygons of GeoJSON.
    #[arg(long, value_name = "FILE")]
    pub zones: Option<PathBuf>,
    /// Distance kept from every zone, metres.
    #[arg(
        long,
        default_value_t = 10.0,
        value_name = "M",
        allow_hyphen_values = true
    )]
    pub clearance_m: f64,
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
    #[arg(long, default_value_t = skein_flight::coverage::lines::DEFAULT_STEPS, value_name = "N")]
    pub steps: usize,
    /// The form of the result.
    #[command(flatten)]
    pub output: OutputArgs,
}

impl TourArgs {
    /// The wind, where it blows to, m/s.
    #[must_use]
    pub fn wind(&self) -> Vector {
        let (s, c) = sin_cos(self.wind_from_deg.to_radians());
        Vector::new(-s, -c) * self.wind_mps
    }
}

/// A way that is flown along in one piece.
#[derive(Clone, Debug, PartialEq)]
pub struct Way {
    /// Its places in order.
    pub places: Vec<usize>,
    /// The name of the item that it serves.
    pub name: String,
    /// The sensor that is asked for.
    pub sensor: Option<String>,
}

/// What is to be planned: lines between places, and who flies.
pub struct Question<'a> {
    /// The ways that the lines stand for, one each.
    pub ways: &'a Ways,
    /// The lines.
    pub lines: &'a [Line],
    /// The team.
    pub team: &'a [Uav],
    /// What flights cost.
    pub metric: &'a Cost<'a>,
    /// The zones that ways lead round.
    pub around: &'a Around,
}

/// The ways to fly, over numbered places.
pub struct Ways {
    /// Where the plane lies.
    pub origin: Origin,
    /// All places: the depot first.
    pub at: Vec<Point>,
    /// The ways.
    pub ways: Vec<Way>,
    /// What was left out.
    pub notices: Vec<String>,
    /// The UAVs.
    pub team: Vec<Member>,
    /// By UAV: the place where it starts and ends.
    pub depots: Vec<usize>,
    zones: Vec<Zone>,
}

/// What flights cost: straight, or round zones.
pub enum Cost<'a> {
    /// Straight.
    Straight(InWind<'a>),
    /// Written down.
    Round(Matrix),
}

impl Metric for Cost<'_> {
    fn cost(&self, a: usize, b: usize) -> f64 {
        match self {
            Self::Straight(wind) => wind.cost(a, b),
            Self::Round(matrix) => matrix.cost(a, b),
        }
    }
}

impl Ways {
    /// No ways yet, and a depot: the flag's, or `home`; the zones are those of `file` and
    /// of the flag.
    ///
    /// # Errors
    /// When a flag is wrong, or there is nothing to go by.
    pub fn new(
        args: &TourArgs,
        home: Option<LatLon>,
        notices: Vec<String>,
        file: &Path,
    ) -> Result<Self> {
        let depot = match &args.depot {
            Some(text) => lat_lon(text).context("--depot")?,
            None => home.context("the file holds nothing to plan")?,
        };
        let origin = Origin {
            lat_deg: depot.lat_deg,
            lon_deg: depot.lon_deg,
        };
        let mut ways = Self {
            origin,
            at: vec![to_plane(origin, depot)?],
            ways: Vec::new(),
            notices,
            team: fleet::team(
                args.fleet.as_deref(),
                args.k,
                args.speed_mps,
                args.endurance_s,
            )?,
            depots: Vec::new(),
            zones: zones_inside(file, origin)?,
        };
        args.output.check(ways.team.len())?;
        if let Some(file) = &args.zones {
            let map = map::read(file, origin, &[], None).context("--zones")?;
            ways.zones.extend(map.zones);
        }
        for uav in 0..ways.team.len() {
            let place = match ways.team[uav].start {
                Some(at) => {
                    let p = ways.point(at, &ways.team[uav].name)?;
                    ways.place(p)
                }
                None => 0,
            };
            ways.depots.push(place);
        }
        Ok(ways)
    }

    /// The narrowest swath of those who can see an item, metres: lanes are laid for it.
    ///
    /// # Errors
    /// When nobody can; the error names the item.
    pub fn swath_m(&self, args: &TourArgs, sensor: Option<&str>, name: &str) -> Result<f64> {
        let defaults = Defaults {
            swath_m: args.swath_m,
            turn_radius_m: TURN_RADIUS_M,
            sensor,
        };
        let height_m = args.output.altitude_m;
        let each = self.team.iter();
        let each = each.filter_map(|m| swath_m(m, defaults, height_m));
        let narrowest = each.min_by(f64::total_cmp);
        narrowest.with_context(|| {
            let sensor = sensor.unwrap_or_default();
            format!(
                "{name} asks for the sensor {sensor:?}, nobody carries it: {}",
                carried(&self.team)
            )
        })
    }

    /// Says so where targets ask for sensors and all fly the same tour.
    pub fn ignore_sensors(&mut self) {
        if self.ways.iter().any(|w| w.sensor.is_some()) {
            let text = "sensors of the targets ignored: all fly the same tour";
            self.notices.push(text.to_owned());
        }
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
    pub fn push(&mut self, way: &[Point], name: &str, sensor: Option<&str>) {
        let places = way.iter().map(|&p| self.place(p)).collect();
        self.ways.push(Way {
            places,
            name: name.to_owned(),
            sensor: sensor.map(str::to_owned),
        });
    }

    /// Plans with `planner`; gives the zones that the ways lead round as well.
    ///
    /// # Errors
    /// When a flag is wrong.
    pub fn solve<T>(
        &mut self,
        args: &TourArgs,
        planner: impl FnOnce(&Question<'_>) -> Result<T>,
    ) -> Result<(T, Around)> {
        let around = Around::new(&self.zones, args.clearance_m, &self.at)?;
        self.leave_out_forbidden(&around)?;
        let wind = args.wind();
        let base_mps = self.team[0].speed_mps;
        let alike = |m: &Member| (m.speed_mps - base_mps).abs() < SAME_SPEED_MPS;
        ensure!(
            args.wind_mps.abs() < SAME_SPEED_MPS || self.team.iter().all(alike),
            "--wind-mps: in a wind, UAVs of unlike speeds cannot be planned together"
        );
        let straight = InWind::new(&self.at, base_mps, wind).context("--wind-mps")?;
        let lines: Vec<Line> = self
            .ways
            .iter()
            .map(|way| {
                let way = &way.places;
                let cost = way.windows(2).map(|w| straight.cost(w[0], w[1])).sum();
                let ends = way.first().zip(way.last());
                let (a, b) = ends.map_or((0, 0), |(a, b)| (*a, *b));
                Line::new(a, b, cost)
            })
            .collect();
        let metric = if around.is_needed() {
            Cost::Round(self.round(&around, base_mps, wind)?)
        } else {
            Cost::Straight(straight)
        };
        let uav = |(m, depot): (&Member, &usize)| Uav {
            depot: *depot,
            speed: m.speed_mps / base_mps,
            endurance: m.endurance_s.unwrap_or(f64::INFINITY),
        };
        let team: Vec<Uav> = self.team.iter().zip(&self.depots).map(uav).collect();
        let found = planner(&Question {
            ways: self,
            lines: &lines,
            team: &team,
            metric: &metric,
            around: &around,
        })?;
        Ok((found, around))
    }

    /// The points flown along some ways in order, from a place and back to it.
    #[must_use]
    pub fn track(&self, around: &Around, passes: &[Traversal], depot: Point) -> Vec<Point> {
        let mut asker = around.asker();
        let mut track = vec![depot];
        let go = |track: &mut Vec<Point>, asker: &mut Asker<'_>, to: Point| {
            let from = track.last().copied().unwrap_or(depot);
            let way = asker.way(from, to);
            track.extend(way.iter().flatten().skip(1));
        };
        for pass in passes {
            let way = &self.ways[pass.line].places;
            let mut way: Vec<Point> = way.iter().map(|p| self.at[*p]).collect();
            if pass.backward {
                way.reverse();
            }
            if let Some(first) = way.first() {
                go(&mut track, &mut asker, *first);
            }
            track.extend(way.iter().skip(1));
        }
        go(&mut track, &mut asker, depot);
        track
    }

    /// Costs of the shortest ways round the zones between all places.
    fn round(&self, around: &Around, speed_mps: f64, wind: Vector) -> Result<Matrix> {
        ensure!(
            self.at.len() <= MOST_PLACES,
            "{} places are too many to plan round zones, {MOST_PLACES} are possible",
            self.at.len()
        );
        let asker = RefCell::new(around.asker());
        let cost = |a: usize, b: usize| -> f64 {
            let way = asker.borrow_mut().way(self.at[a], self.at[b]);
            // Places without a way have been left out before.
            let way = way.unwrap_or_else(|| vec![self.at[a], self.at[b]]);
            let legs = way.windows(2).map(|leg| {
                let wind = InWind::new(leg, speed_mps, wind);
                wind.map_or(f64::MAX, |w| w.cost(0, 1))
            });
            legs.sum()
        };
        Ok(Matrix::of(self.at.len(), &cost))
    }

    /// Leaves out, with a notice, what cannot be flown without entering a zone.
    fn leave_out_forbidden(&mut self, around: &Around) -> Result<()> {
        if !around.is_needed() {
            return Ok(());
        }
        let mut asker = around.asker();
        for (uav, depot) in self.team.iter().zip(&self.depots) {
            ensure!(
                !around.forbids(self.at[*depot]),
                "{} starts in a zone or nearer to one than the clearance",
                uav.name
            );
        }
        let home = self.at[self.depots[0]];
        let (at, notices) = (&self.at, &mut self.notices);
        self.ways.retain(
            |Way {
                 places: way, name, ..
             }| {
                let mut legs = way.windows(2);
                let clear = way.iter().all(|p| !around.forbids(at[*p]))
                    && legs.all(|w| asker.is_straight(at[w[0]], at[w[1]]))
                    && way
                        .first()
                        .is_none_or(|p| asker.way(home, at[*p]).is_some());
                if !clear {
                    notices.push(format!("{name}: left out, a zone is in the way"));
                }
                clear
            },
        );
        Ok(())
    }
}

/// Zones that a file of targets holds itself: fences of a `.plan`, polygons of GeoJSON
/// with the property `"no_fly": true`.
fn zones_inside(file: &Path, origin: Origin) -> Result<Vec<Zone>> {
    let named = || file.display().to_string();
    let text = std::fs::read_to_string(file).with_context(named)?;
    if file.extension().is_some_and(|e| e == "plan") {
        // Without a fence there is nothing to read twice.
        let fences = qgc::read(&text).with_context(named)?;
        if fences.keep_in.is_empty() && fences.keep_out.is_empty() {
            return Ok(Vec::new());
        }
        return Ok(map::read(file, origin, &[], None)?.zones);
    }
    let mut zones = Vec::new();
    for f in geojson::read(&text).with_context(named)?.polygons {
        if f.properties.get("no_fly").and_then(Value::as_bool) == Some(true) {
            let ring = f.ring.iter().map(|p| to_plane(origin, *p));
            zones.push(Zone {
                outer: ring
                    .collect::<Result<_, _>>()
                    .with_context(|| f.pointer.clone())?,
                holes: Vec::new(),
            });
        }
    }
    Ok(zones)
}
