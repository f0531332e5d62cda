//! `plan cover`: an area covered by a team (D2.7 §3.6), exactly by straight passes, or
//! approximately by lane cells, or the better of both.

use super::approximate::{self, Request};
use super::around::Around;
use super::fleet::{self, Member};
use super::flights::{Flight, Flights, covered_share};
use super::output::OutputArgs;
use super::site::{self, Site};
use anyhow::{Context, Result, ensure};
use clap::Args;
use serde_json::{Map, Value, json};
use skein_interop::place::to_plane;
use skein_planning::coverage::exact::{self, Directions, ExactProblem, plan_team};
use skein_planning::frame::Point;
use skein_planning::geometry::offset::Zone;
use std::path::PathBuf;

/// Shares of the area that differ by less than this are the same to a person: samples
/// are no finer.
const SAME_SHARE: f64 = 0.002;

/// Steps of improvement of the approximate planner for each of the exact one's: its steps
/// are smaller.
const CELL_STEPS: usize = 50;

/// An area covered by a team: one closed flight a UAV, the longest as short as can be
/// found.
///
/// Without `--exact` or `--approximate` both planners are asked, both are told, and the
/// flights are those of the one that sees more, or as much sooner.
///
/// The survey of a QGroundControl `.plan` with its exclusion fences, or a GeoJSON polygon
/// with its holes, and zones with the property "no_fly": true. Times are without wind.
#[derive(Debug, Args)]
pub struct CoverArgs {
    /// A QGroundControl `.plan` or GeoJSON.
    pub file: PathBuf,
    /// Exact coverage: cells of the area as it is drawn, in straight passes.
    #[arg(long, conflicts_with = "approximate")]
    pub exact: bool,
    /// Approximate coverage: lane cells as wide as the swath, a region of them each.
    #[arg(long)]
    pub approximate: bool,
    /// How many UAVs.
    #[arg(long, default_value_t = 1, value_name = "K")]
    pub k: usize,
    /// The UAVs, one by one, instead of `--k`: JSON5, a list of `{name, speed_mps,
    /// endurance_s?, start?: [lat, lon], swath_m?, turn_radius_m?}`. Lanes are laid for
    /// the narrowest swath and the widest turn.
    #[arg(long, value_name = "FILE")]
    pub fleet: Option<PathBuf>,
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
    /// The form of the result.
    #[command(flatten)]
    pub output: OutputArgs,
}

/// Plans, and returns the text to print.
///
/// # Errors
/// When the file or a flag is wrong; the error names the place.
pub fn run(args: &CoverArgs) -> Result<String> {
    let (site, plans) = planned(args)?;
    let flights = plans.iter().reduce(|a, b| better(a, b));
    let flights = flights.context("no planner was asked")?;
    let compared: Vec<Value> = plans.iter().map(Flights::compared).collect();
    let notices = &site.notices;
    let sheet = flights.sheet(site.origin, &compared, notices, args.output.altitude_m);
    args.output.print(&sheet)
}

/// The site, and the plans of those that were asked.
pub(super) fn planned(args: &CoverArgs) -> Result<(Site, Vec<Flights>)> {
    let team = fleet::team(
        args.fleet.as_deref(),
        args.k,
        args.speed_mps,
        args.endurance_s,
    )?;
    args.output.check(team.len())?;
    for (flag, value) in [
        ("--speed-mps: the speed", args.speed_mps),
        ("--turn-radius-m: the turn radius", args.turn_radius_m),
    ] {
        ensure!(
            value.is_finite() && value > 0.0,
            "{flag} must be above 0, found {value}"
        );
    }
    let mut site = site::read(&args.file, args.launch.as_deref())?;
    let starts = starts(&site, &team)?;
    let job = Job {
        lane_m: narrowest(&team, args.swath_m),
        turn_radius_m: widest(&team, args.turn_radius_m),
        args,
        site: &site,
        team: &team,
        starts: &starts,
    };
    let mut notices = Vec::new();
    let mut plans = Vec::new();
    if !args.approximate {
        plans.push(job.exact());
    }
    if !args.exact {
        plans.push(job.approximate());
    }
    if plans.iter().any(Result::is_ok) {
        // One planner's refusal is worth a notice when the other one has a plan.
        let refused = plans.iter().filter_map(|p| p.as_ref().err());
        notices.extend(refused.map(|e| format!("{e:#}")));
        plans.retain(Result::is_ok);
    }
    let plans: Vec<Flights> = plans
        .into_iter()
        .collect::<Result<_>>()
        .with_context(|| args.file.display().to_string())?;
    site.notices.extend(notices);
    Ok((site, plans))
}

/// The plan that sees more, or as much sooner.
pub(super) fn better<'a>(a: &'a Flights, b: &'a Flights) -> &'a Flights {
    let more = a.covered_share - b.covered_share;
    let first = if more.abs() > SAME_SHARE {
        more > 0.0
    } else {
        a.makespan_s() <= b.makespan_s()
    };
    if first { a } else { b }
}

/// The zones of a site to fly round; nobody may start in one.
pub(super) fn around(
    site: &Site,
    clearance_m: f64,
    team: &[Member],
    starts: &[Point],
) -> Result<Around> {
    let zones = site.zones.zones().iter().map(|zone| Zone {
        outer: zone.vertices().to_vec(),
        holes: Vec::new(),
    });
    let mut places = starts.to_vec();
    places.extend(site.area.vertices());
    let around = Around::new(&zones.collect::<Vec<_>>(), clearance_m, &places)?;
    for (member, start) in team.iter().zip(starts) {
        ensure!(
            !around.forbids(*start),
            "the launch point of {} lies in a zone or nearer to one than the clearance",
            member.name
        );
    }
    Ok(around)
}

pub(super) fn starts(site: &Site, team: &[Member]) -> Result<Vec<Point>> {
    let start = |member: &Member| match member.place() {
        Some(at) => to_plane(site.origin, at).with_context(|| member.name.clone()),
        None => Ok(Point::origin()),
    };
    team.iter().map(start).collect()
}

fn narrowest(team: &[Member], swath_m: f64) -> f64 {
    let each = team.iter().map(|m| m.swath_m.unwrap_or(swath_m));
    each.fold(f64::INFINITY, f64::min)
}

fn widest(team: &[Member], turn_radius_m: f64) -> f64 {
    let each = team
        .iter()
        .map(|m| m.turn_radius_m.unwrap_or(turn_radius_m));
    each.fold(0.0, f64::max)
}

/// What both planners are asked.
struct Job<'a> {
    args: &'a CoverArgs,
    site: &'a Site,
    team: &'a [Member],
    starts: &'a [Point],
    lane_m: f64,
    turn_radius_m: f64,
}

impl Job<'_> {
    /// One UAV's flight, without what a planner may add.
    fn flight(&self, uav: usize, track: &[Point], length_m: f64) -> Flight {
        let member = &self.team[uav];
        Flight {
            name: member.name.clone(),
            track: track.to_vec(),
            lap: Vec::new(),
            length_m,
            speed_mps: member.speed_mps,
            turn_radius_m: member.turn_radius_m.unwrap_or(self.args.turn_radius_m),
            more: Map::new(),
        }
    }

    fn share(&self, sees: impl Fn(Point) -> bool) -> f64 {
        covered_share(&self.site.area, &self.site.holes, self.lane_m, sees)
    }

    /// Exact coverage: straight passes over the area as it is drawn.
    fn exact(&self) -> Result<Flights> {
        let (args, site) = (self.args, self.site);
        let look_ahead_m = args.look_ahead_m.unwrap_or(self.lane_m / 2.0);
        let problem = ExactProblem {
            holes: site.holes.clone(),
            zones: site.zones.clone(),
            clearance_m: args.clearance_m,
            look_ahead_m,
            steps: args.steps,
            directions: match args.course_deg {
                Some(course) => Directions::Fixed((90.0 - course).to_radians()),
                None => Directions::Best,
            },
            ..ExactProblem::new(
                site.area.clone(),
                self.lane_m,
                self.turn_radius_m,
                Point::origin(),
            )
        };
        let members = self.team.iter().zip(self.starts);
        let members: Vec<exact::Member> = members
            .map(|(member, start)| exact::Member {
                speed: member.speed_mps,
                endurance: member.endurance_s.unwrap_or(f64::INFINITY),
                ..exact::Member::at(*start)
            })
            .collect();
        let plan = plan_team(&problem, &members)?;
        let passes: Vec<&exact::Pass> = plan.tours.iter().flatten().collect();
        let flights = (0..plan.tours.len()).map(|uav| {
            let mut flight = self.flight(uav, &plan.tracks[uav], plan.lengths_m[uav]);
            let n = plan.tours[uav].len();
            flight.lap = lap(&plan.tracks[uav], &plan.tours[uav]);
            flight.more.insert("passes".to_owned(), json!(n));
            flight
        });
        let shapes = plan.cells.iter().enumerate().map(|(i, cell)| {
            let properties = json!({"cell": i + 1, "area_m2": cell.area_m2});
            (cell.ring.clone(), properties)
        });
        let area_m2: f64 = plan.cells.iter().map(|c| c.area_m2).sum();
        Ok(Flights {
            planner: "exact",
            flights: flights.collect(),
            covered_share: self.share(|p| {
                let sees = |pass: &&exact::Pass| pass.sees(p, self.lane_m / 2.0, look_ahead_m);
                passes.iter().any(sees)
            }),
            more: fields(json!({
                "area_m2": area_m2,
                "cells": plan.cells.len(),
                "passes": passes.len(),
                "unserved_passes": plan.unserved.len(),
            })),
            shapes: shapes.collect(),
        })
    }

    /// Approximate coverage: lane cells.
    fn approximate(&self) -> Result<Flights> {
        let (args, site) = (self.args, self.site);
        let around = around(site, args.clearance_m, self.team, self.starts)?;
        let plan = approximate::plan(&Request {
            area: &site.area,
            holes: &site.holes,
            around: &around,
            team: self.team,
            starts: self.starts,
            lane_m: self.lane_m,
            steps: args.steps.saturating_mul(CELL_STEPS),
        })?;
        let flights = (0..self.team.len()).map(|uav| Flight {
            lap: plan.laps[uav].clone(),
            ..self.flight(uav, &plan.tracks[uav], plan.lengths_m[uav])
        });
        Ok(Flights {
            planner: "approximate",
            flights: flights.collect(),
            covered_share: self.share(|p| plan.sees(p)),
            more: fields(json!({
                "lower_bound_s": plan.least_s,
                "cells": plan.raster.map.n_free(),
                "cells_blocked": plan.raster.n_blocked,
                "cells_left": plan.left.len(),
                "turns_fit": 2.0 * self.turn_radius_m <= self.lane_m,
            })),
            shapes: plan
                .left
                .iter()
                .map(|p| (square(*p, self.lane_m), json!({"left": true})))
                .collect(),
        })
    }
}

/// What lies between the beginning of the first pass and the end of the last one.
fn lap(track: &[Point], passes: &[exact::Pass]) -> Vec<Point> {
    let place = |p: Point| move |q: &Point| (q - p).norm() < 1e-9;
    let from = passes
        .first()
        .and_then(|p| track.iter().position(place(p.from)));
    let to = passes
        .last()
        .and_then(|p| track.iter().rposition(place(p.to)));
    let ends = from.zip(to).filter(|(from, to)| from <= to);
    ends.map_or_else(|| track.to_vec(), |(from, to)| track[from..=to].to_vec())
}

/// The fields of an object.
fn fields(object: Value) -> Map<String, Value> {
    match object {
        Value::Object(fields) => fields,
        _ => Map::new(),
    }
}

/// A square round a point, to show a cell.
fn square(middle: Point, side_m: f64) -> Vec<Point> {
    let half = side_m / 2.0;
    [(-half, -half), (half, -half), (half, half), (-half, half)]
        .map(|(x, y)| Point::new(middle.x + x, middle.y + y))
        .to_vec()
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
        let all = ["cover", &file].into_iter().chain(more.iter().copied());
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
        let alone: Value = serde_json::from_str(&told(&dir, FIELD, &["--exact"]).unwrap()).unwrap();
        assert_eq!(alone["tours"].as_array().unwrap().len(), 1);
        assert!(alone["cells"].as_u64().unwrap() >= 4);
        let three = ["--exact", "--k", "3", "--format", "geojson"];
        let map: Value = serde_json::from_str(&told(&dir, FIELD, &three).unwrap()).unwrap();
        assert!(map["features"].as_array().unwrap().len() > 6);
        assert!(map["makespan_s"].as_f64() < alone["makespan_s"].as_f64());
        let out = dir.join("plans").display().to_string();
        let split = ["--exact", "--k", "2", "--format", "plan", "--out", &out];
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
            for planner in [&["--exact"][..], &["--approximate"], &[]] {
                let flags: Vec<&str> = planner.iter().chain(more).copied().collect();
                let error = format!("{:#}", told(&dir, text, &flags).unwrap_err());
                let approximate = planner.first() == Some(&"--approximate");
                // What only the exact planner calls so.
                let says = match says {
                    "lane spacing" if approximate => "a cell of 0 m",
                    says => says,
                };
                assert!(error.contains(says), "{error}");
            }
        }
        std::fs::remove_dir_all(&dir).unwrap();
    }

    #[test]
    fn both_planners_are_told_side_by_side() {
        let dir = std::env::temp_dir().join(format!("skein-plan-both-{}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        let flags = ["--k", "3", "--turn-radius-m", "25"];
        let both: Value = serde_json::from_str(&told(&dir, FIELD, &flags).unwrap()).unwrap();
        let compared = both["compared"].as_array().unwrap();
        assert_eq!(compared.len(), 2);
        for plan in compared {
            let share = plan["covered_share"].as_f64().unwrap();
            assert!((0.9..=1.0).contains(&share), "{plan}");
            assert!(plan["energy_s"].as_f64() > plan["makespan_s"].as_f64());
        }
        let fleet = dir.join("fleet.json5");
        let text = "[{name: 'slow', speed_mps: 10, swath_m: 40}, {name: 'fast', speed_mps: 20, endurance_s: 400, start: [47.40, 8.55]}]";
        std::fs::write(&fleet, text).unwrap();
        let fleet = fleet.display().to_string();
        for planner in ["--exact", "--approximate"] {
            let flags = [planner, "--fleet", &fleet, "--turn-radius-m", "15"];
            let told: Value = serde_json::from_str(&told(&dir, FIELD, &flags).unwrap()).unwrap();
            let fast = &told["tours"][1];
            assert_eq!(fast["name"], "fast");
            assert!(fast["time_s"].as_f64().unwrap() <= 400.0 + 1e-6, "{fast}");
            assert!((fast["points"][0]["lon_deg"].as_f64().unwrap() - 8.55).abs() < 1e-9);
            assert!(told.get("compared").is_none());
        }
        std::fs::remove_dir_all(&dir).unwrap();
    }
}
