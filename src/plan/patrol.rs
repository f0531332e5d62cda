//! `plan patrol`: points, lines or an area seen again and again by a team: one closed tour
//! planned as if for one UAV, and the team spaced on it (D2.7 §3.6.6).
//!
//! Leaves to others: the tour (`visit`, `line`, `cover`) and what spacing is best
//! (`planning::coverage::patrol`).

use super::around::{Around, Asker};
use super::cover::{self, CoverArgs};
use super::errands::Wishes;
use super::fleet::Member;
use super::flyers::{Defaults, swath_m};
use super::heights::LayerArgs;
use super::lanes::Lanes;
use super::line::{self, LineArgs};
use super::objective::Objective;
use super::output::{Printed, Sheet};
use super::planners;
use super::tours::{TourArgs, Ways};
use super::visit::{self, VisitArgs};
use anyhow::{Context, Result, bail, ensure};
use clap::{Args, ValueEnum};
use serde_json::{Map, Value, json};
use skein_flight::coverage::lines::{self, LinePlan, plan};
use skein_flight::coverage::metric::{InWind, Metric};
use skein_geometry::frame::{Origin, Point, Vector};
use skein_interop::place::from_plane;
use skein_survey::patrol::{
    Change, Patrol, Pattern, Station, Tour, Uav, after_losses, patrol_within, revisit_bound, spread,
};
use skein_survey::visits;
use std::path::PathBuf;

/// Speeds that differ by less than this are the same, m/s.
const SAME_SPEED_MPS: f64 = 1e-9;

/// What is patrolled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Over {
    /// The points of the file, as `plan visit` reads them.
    Points,
    /// Its lines and strips, as `plan line` reads them.
    Lines,
    /// Its area, as `plan cover` reads it.
    Area,
}

/// Points, lines or an area seen again and again by a team.
///
/// One closed tour is planned as if for one UAV. Equal UAVs fly round, evenly spaced. Of
/// unequal ones either each flies to and fro on an arc in proportion to its speed, or the
/// fastest few fly round at the speed of the slowest of them, whichever revisits sooner.
/// Each flight that is shown is one period: the way to the tour, once round (or to and
/// fro), and home.
#[derive(Debug, Args)]
pub struct PatrolArgs {
    /// A QGroundControl `.plan` or GeoJSON.
    pub file: PathBuf,
    /// What of the file is patrolled.
    #[arg(long, value_enum)]
    pub over: Over,
    /// Over an area: in straight passes over it as it is drawn.
    #[arg(long, conflicts_with = "approximate")]
    pub exact: bool,
    /// Over an area: by lane cells as wide as the swath.
    #[arg(long)]
    pub approximate: bool,
    /// A UAV that fails; may be repeated. Shows how the others go on from where they are.
    #[arg(long, value_name = "NAME")]
    pub lost: Vec<String>,
    /// When they fail, seconds after a moment in which all are at their stations.
    #[arg(long, default_value_t = 0.0, value_name = "S")]
    pub lost_after_s: f64,
    /// Over an area: turn radius, metres.
    #[arg(long, default_value_t = 30.0, value_name = "M")]
    pub turn_radius_m: f64,
    /// Team, wind and form of the result.
    #[command(flatten)]
    pub tours: TourArgs,
}

/// Plans, and returns the text to print.
///
/// # Errors
/// When the file or a flag is wrong, or nobody can fly one period; the error names the
/// place.
pub fn run(args: &PatrolArgs) -> Result<String> {
    ensure!(
        args.lost_after_s.is_finite() && args.lost_after_s >= 0.0,
        "--lost-after-s must be a time, found {}",
        args.lost_after_s
    );
    let course = match args.over {
        Over::Area => over_area(args),
        Over::Points | Over::Lines => over_targets(args),
    };
    let watch = Watch::new(course?, args.tours.wind())?;
    let flown = watch.flown()?;
    let sheet = watch.sheet(args, &flown)?;
    args.tours.output.print(&sheet)
}

/// What is flown again and again, and by whom.
struct Course {
    origin: Origin,
    /// Which planner, where there are several.
    planner: &'static str,
    /// Corners; the last leads to the first.
    lap: Vec<Point>,
    /// What a leg takes for each metre of it: turns add to its length.
    stretch: f64,
    team: Vec<Member>,
    /// By UAV: its launch point.
    starts: Vec<Point>,
    around: Around,
    notices: Vec<String>,
}

/// One tour over points or lines, without a depot on it.
fn over_targets(args: &PatrolArgs) -> Result<Course> {
    ensure!(
        !args.exact && !args.approximate,
        "--exact and --approximate are for --over area"
    );
    let (file, tours) = (args.file.clone(), args.tours.clone());
    let wishes = Wishes::default();
    let steps = tours.steps;
    let alone = |ways: &mut Ways, points: bool| -> Result<(LinePlan, Around)> {
        ways.solve(&args.tours, |q| {
            let (lines, metric) = (q.lines, q.metric);
            let first = lines.first().context("the file holds nothing to patrol")?;
            let one = [lines::Uav::at(first.a)];
            Ok(if points {
                visits::visit(lines, &one, metric, steps)?
            } else {
                plan(lines, &one, metric, steps)?
            })
        })
    };
    let points = args.over == Over::Points;
    let mut ways = if points {
        visit::ways(&VisitArgs {
            file,
            tours,
            wishes,
        })?
    } else {
        line::ways(&LineArgs {
            file,
            tours,
            wishes,
        })?
    };
    let (plan, around) = alone(&mut ways, points)?;
    ways.ignore_sensors();
    let first = ways.ways.first().and_then(|w| w.places.first());
    let first = first.context("the file holds nothing to patrol")?;
    let mut lap = ways.track(&around, &plan.tours[0].passes, ways.at[*first]);
    lap.pop();
    Ok(Course {
        origin: ways.origin,
        planner: if points { "points" } else { "lines" },
        lap,
        stretch: 1.0,
        starts: ways.depots.iter().map(|d| ways.at[*d]).collect(),
        team: ways.team,
        around,
        notices: ways.notices,
    })
}

/// One tour over an area: of the planner that is asked for, or the better one.
fn over_area(args: &PatrolArgs) -> Result<Course> {
    let tours = &args.tours;
    ensure!(
        tours.zones.is_none(),
        "--zones is for --over points and lines: an area's file holds its zones"
    );
    let team = super::fleet::team(
        tours.fleet.as_deref(),
        tours.k,
        tours.speed_mps,
        tours.endurance_s,
    )?;
    tours.output.check(team.len())?;
    let defaults = Defaults {
        swath_m: tours.swath_m,
        turn_radius_m: args.turn_radius_m,
        sensor: None,
    };
    let height_m = tours.output.altitude_m;
    let swath = |m: &Member| swath_m(m, defaults, height_m).unwrap_or(tours.swath_m);
    let radius = |m: &Member| m.turn_radius_m.unwrap_or(args.turn_radius_m);
    let alone = CoverArgs {
        file: args.file.clone(),
        exact: args.exact,
        approximate: args.approximate,
        k: 1,
        fleet: None,
        launch: tours.depot.clone(),
        swath_m: team.iter().map(swath).fold(f64::INFINITY, f64::min),
        look_ahead_m: None,
        turn_radius_m: team.iter().map(radius).fold(0.0, f64::max),
        clearance_m: tours.clearance_m,
        speed_mps: tours.speed_mps,
        endurance_s: None,
        course_deg: None,
        sensor: None,
        objective: Objective::Time,
        lanes: Lanes::Common,
        layers: LayerArgs::FLAT,
        steps: tours.steps,
        output: tours.output.clone(),
    };
    let (site, best) = cover::planned(&alone)?;
    let flight = best.flights.first().context("nothing is flown")?;
    let starts = team.iter().map(|m| m.start_in(site.origin));
    let starts: Vec<Point> = starts.collect::<Result<_, _>>()?;
    let around = planners::around(&site, tours.clearance_m, starts.iter().copied())?;
    for (member, start) in team.iter().zip(&starts) {
        planners::check_start(&around, &member.name, *start)?;
    }
    let mut lap = flight.lap.clone();
    if let (Some(first), Some(last)) = (lap.first().copied(), lap.last().copied()) {
        let home = around.asker().way(last, first).unwrap_or_default();
        let between = home.len().saturating_sub(2);
        lap.extend(home.into_iter().skip(1).take(between));
    }
    let drawn_m = super::approximate::length_m(&flight.track);
    Ok(Course {
        origin: site.origin,
        planner: best.planner,
        lap,
        stretch: (flight.length_m / drawn_m.max(f64::MIN_POSITIVE)).max(1.0),
        team,
        starts,
        around,
        notices: site.notices,
    })
}

/// The tour in millimetres with the team beside it.
struct Watch {
    course: Course,
    tour: Tour,
    wind: Vector,
    /// By UAV, millimetres a second.
    speeds: Vec<u32>,
    /// By UAV: its nearest place on the tour, and the way there.
    nearest: Vec<(u32, f64)>,
    uavs: Vec<Uav>,
}

/// A patrol from its beginning on.
struct Flown {
    patrol: Patrol,
    stations: Vec<Station>,
    /// By UAV: the way to its station; none for one that rests.
    ways: Vec<Option<(Vec<Point>, f64)>>,
    /// When all are there, seconds.
    steady_s: f64,
}

impl Watch {
    fn new(course: Course, wind: Vector) -> Result<Self> {
        let base_mps = course.team[0].speed_mps;
        let alike = |m: &Member| (m.speed_mps - base_mps).abs() < SAME_SPEED_MPS;
        ensure!(
            wind.norm() < SAME_SPEED_MPS || course.team.iter().all(alike),
            "--wind-mps: in a wind, UAVs of unlike speeds cannot be planned together"
        );
        InWind::new(&[], base_mps, wind).context("--wind-mps")?;
        let leg = |a: Point, b: Point| course.stretch * air_m(&[a, b], base_mps, wind);
        let tour = Tour::new(course.lap.clone(), leg)?;
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a cast of a float saturates"
        )]
        let whole = |m: &Member| ((m.speed_mps * 1000.0).round() as u32).max(1);
        let speeds = course.team.iter().map(whole).collect();
        let mut watch = Self {
            nearest: Vec::new(),
            uavs: Vec::new(),
            tour,
            wind,
            speeds,
            course,
        };
        let mut asker = watch.course.around.asker();
        let mut nearest = Vec::new();
        for (uav, start) in watch.course.starts.iter().enumerate() {
            let place = watch.tour.nearest(*start);
            let (_, way_s) = watch.way(&mut asker, uav, place)?;
            nearest.push((place, way_s));
        }
        let able = |(uav, (_, way_s)): (usize, &(u32, f64))| {
            let endurance_s = watch.course.team[uav].endurance_s;
            Uav {
                speed: watch.speeds[uav],
                longest_s: endurance_s.unwrap_or(f64::INFINITY) - 2.0 * way_s,
            }
        };
        let uavs = nearest.iter().enumerate().map(able).collect();
        drop(asker);
        (watch.nearest, watch.uavs) = (nearest, uavs);
        Ok(watch)
    }

    fn name(&self, uav: usize) -> &str {
        &self.course.team[uav].name
    }

    /// The way from a UAV's launch point to a place of the tour, and what it takes.
    fn way(&self, asker: &mut Asker<'_>, uav: usize, place: u32) -> Result<(Vec<Point>, f64)> {
        let to = self.tour.point(place);
        let way = asker
            .way(self.course.starts[uav], to)
            .with_context(|| format!("{} has no way from its start to the tour", self.name(uav)))?;
        let v = self.course.team[uav].speed_mps;
        let way_s = air_m(&way, v, self.wind) / v;
        Ok((way, way_s))
    }

    /// The pattern, and how it begins.
    fn flown(&self) -> Result<Flown> {
        let n = self.tour.len_mm();
        let Some(patrol) = patrol_within(n, &self.uavs) else {
            let fastest = self.speeds.iter().max().copied().unwrap_or(1);
            let longest = self.uavs.iter().map(|u| u.longest_s).fold(0.0, f64::max);
            bail!(
                "nobody can fly this patrol: once round takes {:.0} s, to and fro on an arc {:.0} s, and the longest endurance leaves {:.0} s besides the ways there and back",
                f64::from(n) / f64::from(fastest),
                2.0 * revisit_bound(n, &self.speeds),
                longest
            );
        };
        let straight_s = |uav: usize, place: u32| {
            let way_m = (self.tour.point(place) - self.course.starts[uav]).norm();
            way_m / self.course.team[uav].speed_mps
        };
        let (patrol, stations) = spread(n, &patrol, straight_s);
        let mut ways = vec![None; self.uavs.len()];
        let mut asker = self.course.around.asker();
        for s in &stations {
            ways[s.uav] = Some(self.way(&mut asker, s.uav, s.place)?);
        }
        let steady_s = ways.iter().flatten().map(|w| w.1).fold(0.0, f64::max);
        Ok(Flown {
            patrol,
            stations,
            ways,
            steady_s,
        })
    }

    /// What is told about everybody together.
    fn sheet(&self, args: &PatrolArgs, flown: &Flown) -> Result<Sheet> {
        let n = self.tour.len_mm();
        let bound_s = revisit_bound(n, &self.speeds);
        let mut notices = self.course.notices.clone();
        notices.extend(self.too_short(&flown.patrol));
        let mut summary = json!({
            "over": self.course.planner,
            "tour_m": f64::from(n) / 1000.0,
            "pattern": pattern(&flown.patrol),
            "flying": flown.stations.len(),
            "revisit_s": flown.patrol.revisit_s,
            "revisit_bound_s": bound_s,
            "ratio": flown.patrol.revisit_s / bound_s,
            "steady_s": flown.steady_s,
            "notices": notices,
        });
        if !args.lost.is_empty() {
            summary["after_losses"] = self.after(args, flown)?;
        }
        let uavs = 0..self.uavs.len();
        Ok(Sheet {
            origin: self.course.origin,
            summary,
            flights: uavs.map(|uav| self.printed(args, flown, uav)).collect(),
            shapes: Vec::new(),
        })
    }

    /// Who rests because its endurance is short.
    fn too_short(&self, patrol: &Patrol) -> Vec<String> {
        let n = self.tour.len_mm();
        let round_s = |uav: usize| match patrol.pattern {
            Pattern::Round { speed, .. } if self.speeds[uav] < speed => None,
            Pattern::Round { speed, .. } => Some(f64::from(n) / f64::from(speed)),
            Pattern::Arcs { .. } => Some(2.0 * revisit_bound(n, &self.speeds)),
        };
        let short = (0..self.uavs.len()).filter_map(|uav| {
            let (needs_s, has_s) = (round_s(uav)?, self.uavs[uav].longest_s);
            (!patrol.pattern.flies(uav) && needs_s > has_s).then(|| {
                format!(
                    "{} rests: one period takes {needs_s:.0} s, its endurance leaves {:.0} s besides the ways there and back",
                    self.name(uav),
                    has_s.max(0.0)
                )
            })
        });
        short.collect()
    }

    /// One UAV: its station, and the first period.
    fn printed(&self, args: &PatrolArgs, flown: &Flown, uav: usize) -> Printed {
        let n = self.tour.len_mm();
        let station = flown.stations.iter().find(|s| s.uav == uav);
        let mut told = Map::new();
        let mut track = vec![self.course.starts[uav]];
        if let (Some(station), Some((way, way_s))) = (station, &flown.ways[uav]) {
            let period_s = flown.patrol.period_s(n, uav, &self.speeds);
            told = fields(json!({
                "place_m": f64::from(station.place) / 1000.0,
                "phase": f64::from(station.place) / f64::from(n),
                "way_s": way_s,
                "wait_s": flown.steady_s - way_s,
                "period_s": period_s,
                "time_s": period_s + 2.0 * way_s,
            }));
            track = way.clone();
            match &flown.patrol.pattern {
                Pattern::Round { .. } => track.extend(self.tour.stretch(station.place, n)),
                Pattern::Arcs { arcs } => {
                    let (from, len) = arcs[uav];
                    told.insert("arc_m".to_owned(), json!(f64::from(len) / 1000.0));
                    let forth = self.tour.stretch(from, len);
                    track.extend(forth.iter().chain(forth.iter().rev()));
                }
            }
            track.extend(way.iter().rev());
        }
        told.insert("rests".to_owned(), json!(station.is_none()));
        Printed {
            name: self.name(uav).to_owned(),
            track,
            altitude_m: args.tours.output.altitude_m,
            speed_mps: self.course.team[uav].speed_mps,
            told,
            details: Map::new(),
        }
    }

    /// How the others go on.
    fn after(&self, args: &PatrolArgs, flown: &Flown) -> Result<Value> {
        let named = |name: &String| {
            let known = self.course.team.iter().position(|m| m.name == *name);
            known.with_context(|| format!("--lost: no UAV is called {name:?}"))
        };
        let lost: Vec<usize> = args.lost.iter().map(named).collect::<Result<_>>()?;
        let n = self.tour.len_mm();
        let before = flown.patrol.courses(&self.speeds, &flown.stations);
        let joins = |uav: usize| self.nearest[uav];
        let change = after_losses(n, &self.uavs, &before, args.lost_after_s, &lost, joins)
            .context("--lost: nobody is left who can fly one period")?;
        let left: Vec<u32> = (0..self.speeds.len())
            .map(|i| if lost.contains(&i) { 0 } else { self.speeds[i] })
            .collect();
        let bound_s = revisit_bound(n, &left);
        let flies = |uav: &usize| change.stands[*uav].is_some();
        let uavs: Vec<Value> = (0..self.uavs.len())
            .filter(flies)
            .map(|uav| self.goes_on(flown, &change, uav))
            .collect();
        Ok(json!({
            "lost": lost.iter().map(|i| self.name(*i)).collect::<Vec<_>>(),
            "pattern": pattern(&change.patrol),
            "flying": uavs.len(),
            "revisit_s": change.patrol.revisit_s,
            "revisit_bound_s": bound_s,
            "ratio": change.patrol.revisit_s / bound_s,
            "steady_s": change.steady_s,
            "gap_s": change.gap_s,
            "uavs": uavs,
        }))
    }

    /// What one of those who are left does.
    fn goes_on(&self, flown: &Flown, change: &Change, uav: usize) -> Value {
        let n = self.tour.len_mm();
        let stand = change.stands[uav];
        let place = stand.map_or(0.0, |s| s.place);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a place on the tour"
        )]
        let at = from_plane(self.course.origin, self.tour.point(place as u32));
        let since_s = change.courses[uav].since_s().unwrap_or(0.0);
        let mut out = json!({
            "name": self.name(uav),
            "place_m": place / 1000.0,
            "at": {"lat_deg": at.lat_deg, "lon_deg": at.lon_deg},
            "joins": flown.ways[uav].is_none(),
            "way_s": since_s - change.loiter_s[uav],
            "loiter_s": change.loiter_s[uav],
            "period_s": change.patrol.period_s(n, uav, &self.speeds),
        });
        if let Pattern::Arcs { arcs } = &change.patrol.pattern {
            let (from, len) = arcs[uav];
            out["arc_from_m"] = json!(f64::from(from) / 1000.0);
            out["arc_m"] = json!(f64::from(len) / 1000.0);
        }
        out
    }
}

fn pattern(patrol: &Patrol) -> &'static str {
    match patrol.pattern {
        Pattern::Round { .. } => "round",
        Pattern::Arcs { .. } => "arcs",
    }
}

/// The length of a way through the air, metres: in a wind, up to what vanishes on a closed
/// flight.
fn air_m(way: &[Point], airspeed_mps: f64, wind: Vector) -> f64 {
    let legs = way.windows(2).map(|leg| {
        let leg = InWind::new(leg, airspeed_mps, wind);
        leg.map_or(f64::MAX, |l| l.cost(0, 1) * airspeed_mps)
    });
    legs.sum()
}

/// The fields of an object.
fn fields(object: Value) -> Map<String, Value> {
    match object {
        Value::Object(fields) => fields,
        _ => Map::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Cli {
        #[command(flatten)]
        args: PatrolArgs,
    }

    const SITE: &str = r#"{"type":"FeatureCollection","features":[
        {"type":"Feature","geometry":{"type":"MultiPoint","coordinates":[[8.54,47.40],[8.56,47.40],[8.56,47.41],[8.54,47.41]]}},
        {"type":"Feature","geometry":{"type":"LineString","coordinates":[[8.54,47.40],[8.55,47.40],[8.56,47.41]]}},
        {"type":"Feature","geometry":{"type":"Polygon","coordinates":[
            [[8.54,47.40],[8.55,47.40],[8.55,47.41],[8.54,47.41],[8.54,47.40]]]}},
        {"type":"Feature","properties":{"no_fly":true},"geometry":{"type":"Polygon","coordinates":[
            [[8.546,47.405],[8.548,47.405],[8.547,47.407],[8.546,47.405]]]}}]}"#;

    struct Dir(PathBuf);

    impl Dir {
        fn new(name: &str) -> Self {
            let dir =
                std::env::temp_dir().join(format!("skein-patrol-{name}-{}", std::process::id()));
            std::fs::create_dir_all(&dir).unwrap();
            std::fs::write(dir.join("site.geojson"), SITE).unwrap();
            Self(dir)
        }

        fn file(&self, name: &str, text: &str) -> String {
            let file = self.0.join(name);
            std::fs::write(&file, text).unwrap();
            file.display().to_string()
        }

        fn told(&self, more: &[&str]) -> Result<Value> {
            let file = self.0.join("site.geojson").display().to_string();
            let all = ["patrol", &file].into_iter().chain(more.iter().copied());
            Ok(serde_json::from_str(
                &run(&Cli::try_parse_from(all)?.args)?,
            )?)
        }
    }

    impl Drop for Dir {
        fn drop(&mut self) {
            let _ = std::fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn equal_uavs_are_spaced_evenly_over_any_tour() {
        let dir = Dir::new("equal");
        for over in [
            &["--over", "points"][..],
            &["--over", "lines"],
            &["--over", "area", "--exact", "--turn-radius-m", "20"],
            &["--over", "area", "--approximate", "--turn-radius-m", "20"],
            &[
                "--over",
                "points",
                "--wind-mps",
                "6",
                "--wind-from-deg",
                "30",
            ],
        ] {
            let flags: Vec<&str> = over.iter().copied().chain(["--k", "3"]).collect();
            let told = dir.told(&flags).unwrap();
            assert_eq!(told["pattern"], "round", "{told}");
            let ratio = told["ratio"].as_f64().unwrap();
            assert!((ratio - 1.0).abs() < 1e-4, "{over:?}: {ratio}");
            let tour_m = told["tour_m"].as_f64().unwrap();
            let places: Vec<f64> = (0..3)
                .map(|i| told["tours"][i]["place_m"].as_f64().unwrap())
                .collect();
            let apart = (places[1] - places[0]).rem_euclid(tour_m / 3.0);
            assert!(apart.min(tour_m / 3.0 - apart) < 0.01, "{places:?}");
            let waits = (0..3).map(|i| told["tours"][i]["wait_s"].as_f64().unwrap());
            assert!(waits.fold(f64::INFINITY, f64::min).abs() < 1e-9);
            // A point is a place to be: the flight ends where it began.
            let points = told["tours"][0]["points"].as_array().unwrap();
            assert_eq!(points.first(), points.last());
        }
    }

    #[test]
    fn a_failure_is_told_with_who_waits_how_long() {
        let dir = Dir::new("lost");
        let flags = ["--over", "points", "--k", "4", "--lost", "uav-2"];
        let told = dir.told(&flags).unwrap();
        let after = &told["after_losses"];
        let (before_s, after_s) = (&told["revisit_s"], &after["revisit_s"]);
        let (before_s, after_s) = (before_s.as_f64().unwrap(), after_s.as_f64().unwrap());
        assert!((after_s / before_s - 4.0 / 3.0).abs() < 1e-4);
        assert!(after["steady_s"].as_f64().unwrap() <= before_s + 1e-3);
        assert!((after["gap_s"].as_f64().unwrap() / before_s - 2.0).abs() < 1e-3);
        let uavs = after["uavs"].as_array().unwrap();
        assert_eq!(uavs.len(), 3);
        assert!(uavs.iter().any(|u| u["loiter_s"].as_f64().unwrap() < 1e-3));
        let two = ["--lost", "uav-1", "--lost-after-s", "33"];
        let flags: Vec<&str> = flags.iter().copied().chain(two).collect();
        assert_eq!(dir.told(&flags).unwrap()["after_losses"]["flying"], 2);
    }

    #[test]
    fn mixed_fleets_and_short_endurance_are_told() {
        let dir = Dir::new("mixed");
        let fleet = dir.file(
            "fleet.json5",
            "[{name: 'fast', speed_mps: 28}, {name: 'a', speed_mps: 10}, {name: 'b', speed_mps: 9, start: [47.405, 8.57]}]",
        );
        let flags = ["--over", "points", "--fleet", &fleet, "--lost", "fast"];
        let told = dir.told(&flags).unwrap();
        // 28 alone is 28; two at 10 and 9 are less; to and fro is 23.5.
        assert_eq!(
            (told["pattern"].as_str(), &told["flying"]),
            (Some("round"), &json!(1))
        );
        assert_eq!(told["tours"][1]["rests"], true);
        let after = &told["after_losses"];
        assert_eq!(after["flying"], 2);
        assert!(after["uavs"][0]["joins"].as_bool().unwrap());
        let fleet = dir.file(
            "arcs.json5",
            "[{name: 'fast', speed_mps: 28, endurance_s: 300}, {name: 'a', speed_mps: 14}, {name: 'b', speed_mps: 14}]",
        );
        let flags = ["--over", "points", "--fleet", &fleet];
        let told = dir.told(&flags).unwrap();
        assert_eq!(told["pattern"], "round");
        let all = dir.told(&["--over", "points", "--k", "3", "--endurance-s", "250"]);
        assert_eq!(all.unwrap()["pattern"], "arcs");
        for (more, says) in [
            (
                &["--over", "points", "--endurance-s", "60"][..],
                "nobody can fly this patrol",
            ),
            (
                &["--over", "points", "--lost", "x"],
                "no UAV is called \"x\"",
            ),
            (&["--over", "points", "--lost", "uav-1"], "nobody is left"),
            (&["--over", "points", "--exact"], "--over area"),
            (
                &["--over", "points", "--lost-after-s", "nan"],
                "--lost-after-s",
            ),
            (&["--over", "lines", "--wind-mps", "20"], "--wind-mps"),
            (&["--over", "area", "--zones", "x"], "--zones"),
            (&["--over", "area", "--k", "0"], "--k must be"),
        ] {
            let error = format!("{:#}", dir.told(more).unwrap_err());
            assert!(error.contains(says), "{error}");
        }
        let none = dir.file(
            "site.geojson",
            r#"{"type":"FeatureCollection","features":[]}"#,
        );
        assert!(std::path::Path::new(&none).exists());
        for over in ["points", "lines", "area"] {
            assert!(dir.told(&["--over", over]).is_err());
        }
    }
}
