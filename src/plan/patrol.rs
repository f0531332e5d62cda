//! `plan patrol`: points, lines or an area seen again and again by a team (D2.7 §3.6.6).
//! Planned by [`skein_survey::patrol`].

use super::args::{area_error, detour_error, planners, tours_error, within};
use super::output::{Printed, Sheet, trajectory};
use super::site::Site;
use super::target_input::{Kind, TargetInput};
use super::tour_args::TourArgs;
use super::view::{Flags, View};
use super::{area_input, cover, team_input};
use anyhow::{Context, Error, Result, anyhow, ensure};
use clap::{Args, ValueEnum};
use serde_json::{Map, Value, json};
use skein_geometry::frame::Origin;
use skein_interop::fleet::TURN_RADIUS_M;
use skein_interop::place::from_plane;
use skein_survey::patrol::{
    self, AfterLosses, GoesOn, Losses, PatrolError, PatrolFlight, PatrolPlan, PatrolRequest,
    Pattern, TourKind,
};
use skein_survey::team::Uav;
use std::path::PathBuf;

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
/// unequal ones either each flies to and fro on an arc, all in the same time, or the
/// fastest few fly round at the speed of the slowest of them, whichever revisits sooner.
/// Each flight that is shown is what a UAV flies at first, turns included: the way to the
/// tour, once round (or to and fro), and home.
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
    /// Over an area: holes of it may be flown over; without it they are no-fly zones.
    #[arg(long)]
    pub cross_holes: bool,
    /// Over an area: turn radius, metres.
    #[arg(
        long,
        default_value_t = 30.0,
        value_name = "M",
        allow_hyphen_values = true
    )]
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
    args.tours.check()?;
    within("--turn-radius-m", args.turn_radius_m, TURN_RADIUS_M, "m")?;
    let mut input = match args.over {
        Over::Area => over_area(args),
        Over::Points => over_targets(args, Kind::Points),
        Over::Lines => over_targets(args, Kind::Lines),
    }?;
    let losses = Losses {
        names: args.lost.clone(),
        after_s: args.lost_after_s,
    };
    let plan = patrol::plan(&PatrolRequest {
        over: input.over.clone(),
        team: input.team.clone(),
        clearance_m: args.tours.clearance_m,
        wind_mps: args.tours.wind.velocity(),
        altitude_m: input.altitude_m,
        steps: args.tours.steps,
        losses: (!args.lost.is_empty()).then_some(losses),
    });
    let plan = plan.map_err(|error| patrol_error(error, args))?;
    input.site.clearance_m = args.tours.clearance_m;
    input.site.wind_mps = args.tours.wind.velocity();
    args.tours.output.print(&sheet(&plan, args, input))
}

/// What is patrolled, by whom.
struct Input {
    origin: Origin,
    over: patrol::Over,
    team: Vec<Uav>,
    altitude_m: f64,
    site: Site,
    notices: Vec<String>,
}

fn over_targets(args: &PatrolArgs, kind: Kind) -> Result<Input> {
    ensure!(
        !args.exact && !args.approximate,
        "--exact and --approximate are for --over area"
    );
    let output = &args.tours.output;
    output.check_altitude(output.altitude_m())?;
    let input = TargetInput::read(kind, &args.file, &args.tours, args.turn_radius_m)?;
    Ok(Input {
        origin: input.origin,
        over: patrol::Over::Targets {
            targets: input.targets,
            zones: input.zones,
        },
        team: input.team,
        altitude_m: args.tours.output.altitude_m(),
        site: input.site,
        notices: input.notices,
    })
}

fn over_area(args: &PatrolArgs) -> Result<Input> {
    let tours = &args.tours;
    ensure!(
        tours.zones.is_none(),
        "--zones is for --over points and lines: an area's file holds its zones"
    );
    let team = team_input::team(
        tours.fleet.as_deref(),
        tours.k,
        tours.speed_mps,
        tours.endurance_s,
    )?;
    tours.output.check(team.len())?;
    let asked = area_input::Asked {
        launch: tours.depot.as_deref(),
        cross_holes: args.cross_holes,
        zones: None,
    };
    let mut site = area_input::read(&args.file, asked)?;
    if site.survey.as_ref().is_some_and(|grid| grid.refly) {
        let text = "Refly90Degrees of the survey is ignored: a patrol comes again on one course";
        site.notices.push(text.to_owned());
    }
    let flags = Flags {
        altitude_m: tours.output.altitude_m,
        swath_m: tours.swath_m,
        trigger_m: tours.output.upload.trigger_m,
        no_course: Some("the survey's angle is ignored: a patrol has the shortest course"),
        ..Flags::default()
    };
    let view = View::of(flags, site.survey.as_ref())?;
    tours.output.check_altitude(view.altitude_m)?;
    site.notices.extend(view.notices.iter().cloned());
    if let Some(sensor) = site.sensor.take() {
        let text = format!("sensor {sensor:?} of the area ignored: all fly the same tour");
        site.notices.push(text);
    }
    let defaults = team_input::Defaults {
        camera: view.camera,
        turn_radius_m: args.turn_radius_m,
    };
    let team = team_input::in_plane(&team, site.origin, defaults)?;
    site.check_zones(&team)
        .with_context(|| args.file.display().to_string())?;
    site.site.trigger_m = view.trigger_m;
    site.site.pictures_in_turns = view.pictures_in_turns;
    Ok(Input {
        origin: site.origin,
        team,
        altitude_m: view.altitude_m,
        over: patrol::Over::Area {
            zones: site.no_fly(),
            fences: site.stay_within(),
            area: site.area,
            holes: site.holes,
            planners: planners(args.exact, args.approximate),
        },
        site: site.site,
        notices: site.notices,
    })
}

fn patrol_error(error: PatrolError, args: &PatrolArgs) -> Error {
    match error {
        PatrolError::Area(error) => area_error(error, &args.file),
        PatrolError::Targets(error) => tours_error(error),
        PatrolError::Zones(error) => detour_error(error),
        PatrolError::Fences(error) => Error::new(error).context(args.file.display().to_string()),
        PatrolError::NoRound { .. } | PatrolError::NoWay(_) | PatrolError::LaunchInZone(_) => {
            Error::new(error).context(args.file.display().to_string())
        }
        PatrolError::Nothing => anyhow!("the file holds nothing to patrol"),
        PatrolError::UnlikeInWind | PatrolError::TooWindy(_) => {
            Error::new(error).context("--wind-mps")
        }
        PatrolError::Unknown(_) | PatrolError::NobodyLeft => Error::new(error).context("--lost"),
        other => other.into(),
    }
}

/// What is told about everybody together.
fn sheet(plan: &PatrolPlan, args: &PatrolArgs, input: Input) -> Sheet {
    let Input {
        origin,
        site,
        notices,
        ..
    } = input;
    let mut summary = json!({
        "over": match plan.over {
            TourKind::Points => "points",
            TourKind::Lines => "lines",
            TourKind::Area(planner) => cover::planner_name(planner),
        },
        "tour_m": plan.tour_m,
        "pattern": pattern(&plan.pattern),
        "uavs_flying": plan.uavs_flying(),
        "revisit_s": plan.revisit_s,
        "revisit_bound_s": plan.revisit_bound_s,
        "ratio": plan.revisit_s / plan.revisit_bound_s,
        "steady_s": plan.steady_s,
        "clearance_m": args.tours.clearance_m,
        "wind_mps": args.tours.wind.wind_mps,
        "wind_from_deg": args.tours.wind.wind_from_deg,
        "notices": ([&notices[..], &plan.notices].concat()),
    });
    if let Some(after) = &plan.after_losses {
        summary["after_losses"] = after_losses(after, origin);
    }
    Sheet {
        origin,
        site,
        summary,
        flights: plan.uavs.iter().map(printed).collect(),
        shapes: Vec::new(),
    }
}

fn pattern(pattern: &Pattern) -> &'static str {
    match pattern {
        Pattern::Round { .. } => "round",
        Pattern::Arcs { .. } => "arcs",
    }
}

/// One UAV: its station, and the first period.
fn printed(flight: &PatrolFlight) -> Printed {
    let mut told = Map::new();
    if let Some(station) = &flight.station {
        for (key, value) in [
            ("place_m", station.place_m),
            ("phase", station.phase),
            ("way_s", station.way_s),
            ("wait_s", station.wait_s),
            ("period_s", station.period_s),
            ("time_s", station.time_s),
        ] {
            told.insert(key.to_owned(), json!(value));
        }
        if let Some(arc_m) = station.arc_m {
            told.insert("arc_m".to_owned(), json!(arc_m));
        }
    }
    if flight.station.is_some() {
        for (key, value) in [
            ("speed_mps", flight.speed_mps),
            ("turn_radius_m", flight.turn_radius_m),
            ("length_m", flight.length_m),
        ] {
            told.insert(key.to_owned(), json!(value));
        }
    }
    told.insert("at_home".to_owned(), json!(flight.station.is_none()));
    Printed {
        name: flight.name.clone(),
        track: flight.path.clone(),
        altitude_m: flight.altitude_m,
        speed_mps: flight.speed_mps,
        trigger_m: None,
        legs: flight.legs.clone(),
        told,
        details: Map::new(),
    }
}

/// How the others go on.
fn after_losses(after: &AfterLosses, origin: Origin) -> Value {
    let uav = |uav: &GoesOn| goes_on(uav, origin);
    let uavs: Vec<Value> = after.uavs.iter().map(uav).collect();
    json!({
        "lost": after.lost,
        "pattern": pattern(&after.pattern),
        "uavs_flying": uavs.len(),
        "revisit_s": after.revisit_s,
        "revisit_bound_s": after.revisit_bound_s,
        "ratio": after.revisit_s / after.revisit_bound_s,
        "steady_s": after.steady_s,
        "gap_s": after.gap_s,
        "uavs": uavs,
    })
}

/// What one of those who are left does.
fn goes_on(uav: &GoesOn, origin: Origin) -> Value {
    let at = from_plane(origin, uav.at);
    let mut out = json!({
        "name": uav.name,
        "place_m": uav.place_m,
        "at": {"lat_deg": at.lat_deg, "lon_deg": at.lon_deg},
        "joins": uav.joins,
        "way_s": uav.way_s,
        "loiter_s": uav.loiter_s,
        "trajectory": trajectory(origin, &uav.legs),
        "period_s": uav.period_s,
    });
    if let Some((from_m, arc_m)) = uav.arc_m {
        out["arc_from_m"] = json!(from_m);
        out["arc_m"] = json!(arc_m);
    }
    out
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
                .map(|i| told["flights"][i]["place_m"].as_f64().unwrap())
                .collect();
            let apart = (places[1] - places[0]).rem_euclid(tour_m / 3.0);
            assert!(apart.min(tour_m / 3.0 - apart) < 0.01, "{places:?}");
            let waits = (0..3).map(|i| told["flights"][i]["wait_s"].as_f64().unwrap());
            assert!(waits.fold(f64::INFINITY, f64::min).abs() < 1e-9);
            // A point is a place to be: the flight ends where it began.
            let points = told["flights"][0]["points"].as_array().unwrap();
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
        assert_eq!(dir.told(&flags).unwrap()["after_losses"]["uavs_flying"], 2);
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
            (told["pattern"].as_str(), &told["uavs_flying"]),
            (Some("round"), &json!(1))
        );
        assert_eq!(told["flights"][1]["at_home"], true);
        let after = &told["after_losses"];
        assert_eq!(after["uavs_flying"], 2);
        assert!(after["uavs"][0]["joins"].as_bool().unwrap());
        let fleet = dir.file(
            "arcs.json5",
            "[{name: 'fast', speed_mps: 28, endurance_s: 300}, {name: 'a', speed_mps: 14}, {name: 'b', speed_mps: 14}]",
        );
        let flags = ["--over", "points", "--fleet", &fleet];
        let told = dir.told(&flags).unwrap();
        assert_eq!(told["pattern"], "round");
        let middle = ["--depot", "47.405,8.55", "--k", "3", "--endurance-s", "400"];
        let arcs = dir
            .told(&[&["--over", "points"], &middle[..]].concat())
            .unwrap();
        assert_eq!(arcs["pattern"], "arcs");
        let first = &arcs["flights"][0];
        assert!(first["time_s"].as_f64().unwrap() <= 400.0, "{first}");
        let pieces = first["trajectory"].as_array().unwrap();
        assert!(pieces.iter().any(|piece| !piece["radius_m"].is_null()));
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
