//! `plan route`: the shortest way round the zones of a file with clearance (D2.7 §2.3).
//! Planned by [`skein_survey::route`].

use super::args::within;
use super::output::{text, trajectory};
use super::zone_input::{self, Polygons, ZoneInput};
use super::{lat_lon, plane_at};
use anyhow::{Context, Error, Result, anyhow, ensure};
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use skein_geometry::frame::{Origin, Point};
use skein_interop::fleet::TURN_RADIUS_M;
use skein_interop::place::{LatLon, from_plane, to_plane};
use skein_survey::flown::{length_m, track};
use skein_survey::route::{self, NamedRepair, RouteError, RoutePlace, RoutePlan, RouteRequest};
use skein_survey::zones::Level;
use std::path::PathBuf;

/// The shortest way from one place to another that keeps a clearance from all zones.
///
/// Exclusion fences, circles and polygons are kept out of, every inclusion fence is
/// stayed within. Wrong input ends in an error that names the place.
#[derive(Debug, Args)]
pub struct RouteArgs {
    /// A QGroundControl `.plan` with fences, or GeoJSON whose polygons are zones.
    pub file: PathBuf,
    /// Where the route begins, degrees.
    #[arg(long, value_name = "LAT,LON", allow_hyphen_values = true)]
    pub from: String,
    /// Where it ends, degrees.
    #[arg(long, value_name = "LAT,LON", allow_hyphen_values = true)]
    pub to: String,
    /// A place to fly over on the way, degrees; given several times, in this order.
    #[arg(long, value_name = "LAT,LON", allow_hyphen_values = true)]
    pub via: Vec<String>,
    /// Distance kept from every zone and from the fence, metres.
    #[arg(long, value_name = "R", allow_hyphen_values = true)]
    pub clearance_m: f64,
    /// Flight level above the ground, metres: buildings of GeoJSON that end below it
    /// are flown over.
    #[arg(long, value_name = "H", allow_hyphen_values = true)]
    pub level_m: Option<f64>,
    /// Distance kept above buildings, metres.
    #[arg(
        long,
        value_name = "H",
        default_value_t = 10.0,
        allow_hyphen_values = true
    )]
    pub vertical_margin_m: f64,
    /// The tightest turn of who flies it, metres: what is flown is told as `trajectory`, or
    /// that nothing can be. 0 for who stops and turns on the spot: the way with its corners.
    #[arg(
        long,
        value_name = "R",
        default_value_t = 30.0,
        allow_hyphen_values = true
    )]
    pub turn_radius_m: f64,
    /// Which engine looks for the path; both find the shortest.
    #[arg(long, value_enum, default_value_t = Engine::Mesh)]
    pub engine: Engine,
    /// How the result is printed.
    #[arg(long, value_enum, default_value_t = Format::Json)]
    pub format: Format,
}

/// The engines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Engine {
    /// The search over a mesh of free space.
    Mesh,
    /// The visibility graph.
    Graph,
}

/// Forms of the result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// One JSON object.
    Json,
    /// A feature collection: the route as a line, the grown zones as polygons.
    Geojson,
}

/// Plans a route and returns the text to print.
///
/// # Errors
/// When the file or a flag is wrong, an end is too near to a zone, or there is no way.
pub fn run(args: &RouteArgs) -> Result<String> {
    let from = lat_lon(&args.from).context("--from")?;
    let origin = plane_at(from).context("--from")?;
    // 0 stands for nobody who turns.
    if args.turn_radius_m != 0.0 {
        within("--turn-radius-m", args.turn_radius_m, TURN_RADIUS_M, "m")?;
    }
    let place = |text: &str, flag: String| -> Result<RoutePlace> {
        let at = lat_lon(text).and_then(|p| Ok(to_plane(origin, p)?));
        Ok(RoutePlace {
            at: at.with_context(|| flag.clone())?,
            name: flag,
        })
    };
    let mut places = vec![place(&args.from, "--from".to_owned())?];
    for text in &args.via {
        places.push(place(text, format!("--via {text}"))?);
    }
    places.push(place(&args.to, "--to".to_owned())?);
    let level = level(args)?;
    let polygons = if level.is_some() {
        Polygons::Buildings
    } else {
        Polygons::All
    };
    let ZoneInput {
        keep_out,
        keep_in,
        mut notices,
        ..
    } = zone_input::read(&args.file, origin, polygons)?;
    let plan = route::plan(&RouteRequest {
        places,
        keep_out,
        keep_in,
        clearance_m: args.clearance_m,
        level,
        engine: match args.engine {
            Engine::Mesh => route::Engine::Mesh,
            Engine::Graph => route::Engine::Graph,
        },
        turn_radius_m: (args.turn_radius_m > 0.0).then_some(args.turn_radius_m),
    });
    let plan = plan.map_err(|error| route_error(error, args))?;
    notices.extend(plan.notices.iter().cloned());
    Ok(text(match args.format {
        Format::Json => json(&plan, origin, args, &notices),
        Format::Geojson => geojson(&plan, origin),
    }))
}

fn level(args: &RouteArgs) -> Result<Option<Level>> {
    let margin_m = args.vertical_margin_m;
    ensure!(
        margin_m >= 0.0 && margin_m.is_finite(),
        "--vertical-margin-m must be 0 or more, found {margin_m}"
    );
    let Some(level_m) = args.level_m else {
        return Ok(None);
    };
    ensure!(
        level_m.is_finite(),
        "--level-m must be a number of metres, found {level_m}"
    );
    Ok(Some(Level { level_m, margin_m }))
}

fn route_error(error: RouteError, args: &RouteArgs) -> Error {
    match error {
        RouteError::Clearance(cause) => Error::new(cause).context("--clearance-m"),
        RouteError::Radius(_) => Error::new(error).context("--turn-radius-m"),
        RouteError::NoWay { leg, .. } => {
            let ends = |i: usize| match i.checked_sub(1) {
                None => &args.from,
                Some(i) => args.via.get(i).unwrap_or(&args.to),
            };
            anyhow!(
                "there is no way from {} to {} that keeps {} m from every zone",
                ends(leg),
                ends(leg + 1),
                args.clearance_m
            )
        }
        other => other.into(),
    }
}

fn summary(plan: &RoutePlan) -> Value {
    let ends = plan.path.first().zip(plan.path.last());
    let least_m = plan.least_distance_m;
    json!({
        "length_m": plan.length_m(),
        "straight_m": ends.map_or(0.0, |(a, b)| (b - a).norm()),
        "flown_m": (!plan.legs.is_empty()).then(|| length_m(&plan.legs)),
        "bends": plan.path.len().saturating_sub(2),
        "least_distance_m": least_m.is_finite().then_some(least_m),
        "structure_hash": format!("{:016x}", plan.structure_hash),
    })
}

fn json(plan: &RoutePlan, origin: Origin, args: &RouteArgs, notices: &[String]) -> Value {
    let points = plan.path.iter().map(|p| {
        let LatLon { lat_deg, lon_deg } = from_plane(origin, *p);
        json!({"lat_deg": lat_deg, "lon_deg": lon_deg, "east_m": p.x, "north_m": p.y})
    });
    let repair = |r: &NamedRepair| format!("{}, vertex {}: {:?}", r.zone, r.vertex, r.kind);
    let repairs: Vec<String> = plan.repairs.iter().map(repair).collect();
    let mut out = summary(plan);
    out["clearance_m"] = json!(args.clearance_m);
    out["zones"] = json!(plan.n_zones);
    out["regions"] = json!(plan.regions.len());
    out["points"] = points.collect();
    out["repairs"] = json!(repairs);
    out["notices"] = json!(notices);
    let at = |p: &Point| {
        let LatLon { lat_deg, lon_deg } = from_plane(origin, *p);
        json!({"lat_deg": lat_deg, "lon_deg": lon_deg})
    };
    out["origin"] = json!({"lat_deg": origin.lat_deg, "lon_deg": origin.lon_deg});
    out["flights"] = match plan.path.first() {
        Some(start) if !plan.legs.is_empty() => json!([{
            "name": "route", "length_m": length_m(&plan.legs), "turn_radius_m": args.turn_radius_m,
            "points": track(&plan.legs, *start).iter().map(at).collect::<Vec<_>>(),
            "trajectory": trajectory(origin, &plan.legs),
        }]),
        _ => json!([]),
    };
    out
}

fn geojson(plan: &RoutePlan, origin: Origin) -> Value {
    let position = |p: &Point| {
        let at = from_plane(origin, *p);
        json!([at.lon_deg, at.lat_deg])
    };
    let closed =
        |ring: &[Point]| -> Value { ring.iter().chain(ring.first()).map(position).collect() };
    let start = plan.path.first().filter(|_| !plan.legs.is_empty());
    let flown = start.map_or_else(|| plan.path.clone(), |s| track(&plan.legs, *s));
    let line: Vec<Value> = flown.iter().map(position).collect();
    let mut features = vec![json!({
        "type": "Feature", "properties": summary(plan),
        "geometry": {"type": "LineString", "coordinates": line},
    })];
    for r in &plan.regions {
        let rings: Vec<Value> = r.rings().map(closed).collect();
        features.push(json!({
            "type": "Feature", "properties": {"zone": "grown by the clearance"},
            "geometry": {"type": "Polygon", "coordinates": rings},
        }));
    }
    json!({"type": "FeatureCollection", "features": features})
}

#[cfg(test)]
mod tests {
    use super::*;

    fn args(file: &str, from: &str, to: &str, clearance_m: f64) -> RouteArgs {
        let data = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/data");
        RouteArgs {
            file: data.join(file),
            from: from.to_owned(),
            to: to.to_owned(),
            via: Vec::new(),
            clearance_m,
            level_m: None,
            vertical_margin_m: 10.0,
            turn_radius_m: 0.0,
            engine: Engine::Mesh,
            format: Format::Json,
        }
    }

    const PLAN: &str = "px4_multicopter_mission_geofence_avoid.plan";

    const HERE: &str = "47.396546,8.544491";
    const THERE: &str = "47.394466,8.540564";

    fn answer(args: &RouteArgs) -> Value {
        serde_json::from_str(&run(args).unwrap()).unwrap()
    }

    fn error(args: &RouteArgs) -> String {
        format!("{:#}", run(args).unwrap_err())
    }

    #[test]
    fn a_route_among_fences_keeps_its_clearance_and_both_engines_agree() {
        let mut a = args(PLAN, HERE, THERE, 20.0);
        let mesh = answer(&a);
        let length_m = mesh["length_m"].as_f64().unwrap();
        assert!(
            length_m > mesh["straight_m"].as_f64().unwrap() + 1.0,
            "{mesh}"
        );
        assert!(mesh["least_distance_m"].as_f64().unwrap() >= 20.0, "{mesh}");
        assert!(mesh["bends"].as_u64().unwrap() > 0);
        a.engine = Engine::Graph;
        let graph = answer(&a)["length_m"].as_f64().unwrap();
        assert!(
            (graph - length_m).abs() < 1e-9 * length_m,
            "{graph} {length_m}"
        );
        a.format = Format::Geojson;
        let text = run(&a).unwrap();
        let zones = skein_interop::geojson::read(&text).unwrap().polygons.len();
        assert!(zones > 0, "{text}");
    }

    #[test]
    fn a_route_is_flown_with_its_turns() {
        let mut a = args(PLAN, HERE, THERE, 20.0);
        assert!(answer(&a)["flown_m"].is_null());
        a.turn_radius_m = 30.0;
        let flown = answer(&a);
        let length = |v: &Value| v["length_m"].as_f64().unwrap();
        let pieces = flown["flights"][0]["trajectory"].as_array().unwrap();
        let flown_m: f64 = pieces.iter().map(length).sum();
        assert!((flown["flown_m"].as_f64().unwrap() - flown_m).abs() < 1e-6);
        // It rounds a circle, which the way with corners passes on a polygon.
        assert!((flown_m / length(&flown) - 1.0).abs() < 0.01, "{flown_m}");
        a.format = Format::Geojson;
        let map: Value = serde_json::from_str(&run(&a).unwrap()).unwrap();
        let line = &map["features"][0]["geometry"]["coordinates"];
        assert!(line.as_array().unwrap().len() > flown["points"].as_array().unwrap().len());
        a.turn_radius_m = 500.0;
        assert!(
            error(&a).contains("no flight with turns of 500 m"),
            "{}",
            error(&a)
        );
    }

    #[test]
    fn a_place_on_the_way_is_flown_over_and_two_runs_compare_their_structure() {
        let mut a = args(PLAN, HERE, THERE, 20.0);
        let straight = answer(&a);
        a.via = vec![THERE.to_owned(), HERE.to_owned()];
        let over = answer(&a);
        let length_m = |v: &Value| v["length_m"].as_f64().unwrap();
        assert!(
            (length_m(&over) - 3.0 * length_m(&straight)).abs() < 1e-3,
            "{over}"
        );
        let bends = |v: &Value| v["points"].as_array().unwrap().len();
        assert_eq!(bends(&over), 3 * bends(&straight) - 2);
        a.via.clear();
        assert_eq!(answer(&a)["structure_hash"], straight["structure_hash"]);
        a.clearance_m = 21.0;
        assert_ne!(answer(&a)["structure_hash"], straight["structure_hash"]);
        a.via = vec!["47.3953,8.5429".to_owned()];
        assert!(error(&a).starts_with("--via 47.3953,8.5429 lies in a zone: exclusion fence 2"));
        a.via = vec!["47.3953".to_owned()];
        assert!(error(&a).starts_with("--via 47.3953: "));
    }

    #[test]
    fn houses_below_the_level_are_flown_over() {
        let (here, there) = ("60.160,24.931", "60.171,24.940");
        let mut a = args("helsinki_buildings.geojson", here, there, 5.0);
        let round = answer(&a);
        a.level_m = Some(500.0);
        let over = answer(&a);
        assert_eq!(over["zones"], 0);
        assert_eq!(over["bends"], 0);
        assert!(round["zones"].as_u64().unwrap() > 100);
        assert!(round["length_m"].as_f64().unwrap() > over["length_m"].as_f64().unwrap());
    }

    #[test]
    fn wrong_input_is_named() {
        let cases = [
            (args("none.plan", HERE, THERE, 5.0), "none.plan"),
            (args(PLAN, "47,x", THERE, 5.0), "--from"),
            (
                args(PLAN, HERE, "1,1", 5.0),
                "--to: 1.0000000, 1.0000000 lies",
            ),
            (args(PLAN, HERE, THERE, -1.0), "--clearance-m"),
            (args(PLAN, HERE, THERE, f64::NAN), "--clearance-m"),
            (
                args(PLAN, "47.3953,8.5429", THERE, 5.0),
                "--from lies in a zone: exclusion fence 2",
            ),
            (
                args(PLAN, HERE, "47.5,8.54", 5.0),
                "--to lies in a zone: inclusion fence 1",
            ),
            (
                args(PLAN, HERE, THERE, 400.0),
                "nearer than the clearance of 400 m",
            ),
            (args("README.md", HERE, THERE, 5.0), "README.md: line 1"),
        ];
        for (a, says) in cases {
            let e = error(&a);
            assert!(e.contains(says), "{e}, expected {says}");
        }
        let mut a = args(PLAN, HERE, THERE, 5.0);
        a.level_m = Some(f64::NAN);
        assert!(error(&a).contains("--level-m"));
        let mut turns = args(PLAN, HERE, THERE, 5.0);
        for radius_m in [f64::NAN, -1.0, 1e9] {
            turns.turn_radius_m = radius_m;
            assert!(error(&turns).contains("--turn-radius-m must be between"));
        }
        a.vertical_margin_m = -1.0;
        assert!(error(&a).contains("--vertical-margin-m"));
    }
}
