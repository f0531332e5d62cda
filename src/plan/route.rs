//! `plan route`: the shortest way round the zones of a file with clearance (D2.7 §2.3).
//!
//! Zones are grown by the clearance, the path is the shortest among what they become,
//! and its distance from the zones as drawn is measured again before it is printed.
//! Turns are left to the UAV: D2.7 §2.4 is the business of trajectories.

use super::lat_lon;
use super::map::{self, Level, Map};
use super::measure::to_piece_m;
use anyhow::{Context, Result, bail, ensure};
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use skein_flight::route::mesh::Mesh;
use skein_flight::route::two_point::Search;
use skein_geometry::frame::{Origin, Point};
use skein_geometry::offset::{Grown, Growth, OffsetError, Place, Region, Zone, grow};
use skein_interop::place::{LatLon, from_plane, to_plane};
use skein_survey::via_points::{NoLeg, shortest_through};
use skein_survey::visibility::VisibilityGraph;
use std::path::PathBuf;

/// A path is refused if it comes this much nearer to a zone than the clearance, metres:
/// outlines keep the clearance to the nanometre, so only a defect can cause that.
const SLACK_M: f64 = 1e-6;

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
    #[arg(long, value_name = "R")]
    pub clearance_m: f64,
    /// Flight level above the ground, metres: buildings of GeoJSON that end below it
    /// are flown over.
    #[arg(long, value_name = "H")]
    pub level_m: Option<f64>,
    /// Distance kept above buildings, metres.
    #[arg(long, value_name = "H", default_value_t = 10.0)]
    pub vertical_margin_m: f64,
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
    let to = lat_lon(&args.to).context("--to")?;
    let growth = Growth::new(args.clearance_m).context("--clearance-m")?;
    let level = level(args)?;
    let origin = Origin {
        lat_deg: from.lat_deg,
        lon_deg: from.lon_deg,
    };
    let mut places = vec![(
        "--from".to_owned(),
        to_plane(origin, from).context("--from")?,
    )];
    for text in &args.via {
        let flag = format!("--via {text}");
        let at = lat_lon(text).and_then(|p| Ok(to_plane(origin, p)?));
        let at = at.with_context(|| flag.clone())?;
        places.push((flag, at));
    }
    places.push(("--to".to_owned(), to_plane(origin, to).context("--to")?));
    let (flags, places): (Vec<String>, Vec<Point>) = places.into_iter().unzip();
    let mut map = map::read(&args.file, origin, &places, level)?;
    map.widen(args.clearance_m)?;
    let grown = grow(&map.zones, &growth).map_err(|e| named(&e, &map))?;
    for (flag, p) in flags.iter().zip(&places) {
        check_place(*p, flag, &grown, &map, args.clearance_m)?;
    }
    let (path, hash) = shortest(args.engine, &places, &grown, &map)?;
    let path = path.map_err(|NoLeg { leg }| {
        let names: Vec<&String> = std::iter::once(&args.from)
            .chain(&args.via)
            .chain(std::iter::once(&args.to))
            .collect();
        anyhow::anyhow!(
            "there is no way from {} to {} that keeps {} m from every zone",
            names[leg],
            names[leg + 1],
            args.clearance_m
        )
    })?;
    let least_m = least_distance_m(&path, &map.zones);
    ensure!(
        least_m >= args.clearance_m - SLACK_M,
        "the route found comes within {least_m} m of a zone: refused"
    );
    let route = Route {
        origin,
        path,
        hash,
        least_m,
        grown,
        map,
    };
    Ok(match args.format {
        Format::Json => route.json(args).to_string(),
        Format::Geojson => route.geojson().to_string(),
    })
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

/// The error with the name that the zone has in the file.
fn named(error: &OffsetError, map: &Map) -> anyhow::Error {
    let zone = match *error {
        OffsetError::NotFinite(p) | OffsetError::TooFar(p) | OffsetError::Unproven(p) => p.zone,
        OffsetError::TooFewVertices { zone, .. } => zone,
        OffsetError::Radius(_) | OffsetError::Overshoot(_) => usize::MAX,
    };
    match map.names.get(zone) {
        Some(name) => anyhow::anyhow!("{name}: {error}"),
        None => anyhow::anyhow!("{error}"),
    }
}

fn check_place(p: Point, flag: &str, grown: &Grown, map: &Map, clearance_m: f64) -> Result<()> {
    if !grown.contains(p) {
        return Ok(());
    }
    let nearest = map
        .zones
        .iter()
        .zip(&map.names)
        .map(|(z, name)| (distance_m(p, z), name))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    match nearest {
        Some((d, name)) if d <= 0.0 => bail!("{flag} lies in a zone: {name}"),
        Some((d, name)) => bail!(
            "{flag} lies {d:.1} m from {name}, nearer than the clearance of {clearance_m} m \
             (outlines are up to half a percent wider)"
        ),
        None => bail!("{flag} lies in a zone"),
    }
}

/// The path, and the number by which the structure it was found on is compared.
fn shortest(
    engine: Engine,
    places: &[Point],
    grown: &Grown,
    map: &Map,
) -> Result<(Result<Vec<Point>, NoLeg>, u64)> {
    match engine {
        Engine::Mesh => {
            let rings = grown.regions.iter().flat_map(Region::rings);
            let all: Vec<&[Point]> = std::iter::once(map.border.as_slice())
                .chain(rings)
                .collect();
            let mesh = Mesh::from_rings(&all).context("the grown zones have no mesh")?;
            let path = shortest_through(&mut Search::new(&mesh), places);
            Ok((path, mesh.content_hash()))
        }
        Engine::Graph => {
            let graph = VisibilityGraph::round(&grown.regions);
            Ok((graph.shortest_through(places), graph.content_hash()))
        }
    }
}

/// A route with all that is worth telling about it.
struct Route {
    origin: Origin,
    path: Vec<Point>,
    hash: u64,
    least_m: f64,
    grown: Grown,
    map: Map,
}

impl Route {
    fn length_m(&self) -> f64 {
        self.path.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
    }

    fn summary(&self) -> Value {
        let ends = self.path.first().zip(self.path.last());
        let least_m = self.least_m.is_finite().then_some(self.least_m);
        json!({
            "length_m": self.length_m(),
            "straight_m": ends.map_or(0.0, |(a, b)| (b - a).norm()),
            "bends": self.path.len().saturating_sub(2),
            "least_distance_m": least_m,
            "structure_hash": format!("{:016x}", self.hash),
        })
    }

    fn json(&self, args: &RouteArgs) -> Value {
        let points: Vec<Value> = self
            .path
            .iter()
            .map(|p| {
                let LatLon { lat_deg, lon_deg } = from_plane(self.origin, *p);
                json!({"lat_deg": lat_deg, "lon_deg": lon_deg, "east_m": p.x, "north_m": p.y})
            })
            .collect();
        let repairs: Vec<String> = self
            .grown
            .repairs
            .iter()
            .map(|r| self.repair(r.place, r.kind))
            .collect();
        let mut out = self.summary();
        out["clearance_m"] = json!(args.clearance_m);
        out["zones"] = json!(self.map.zones.len());
        out["regions"] = json!(self.grown.regions.len());
        out["points"] = json!(points);
        out["repairs"] = json!(repairs);
        out["notices"] = json!(self.map.notices);
        out
    }

    fn repair(&self, at: Place, kind: impl core::fmt::Debug) -> String {
        let name = self.map.names.get(at.zone).map_or("?", String::as_str);
        format!("{name}, vertex {}: {kind:?}", at.vertex)
    }

    fn geojson(&self) -> Value {
        let position = |p: &Point| {
            let at = from_plane(self.origin, *p);
            json!([at.lon_deg, at.lat_deg])
        };
        let closed =
            |ring: &[Point]| -> Value { ring.iter().chain(ring.first()).map(position).collect() };
        let line: Vec<Value> = self.path.iter().map(position).collect();
        let mut features = vec![json!({
            "type": "Feature", "properties": self.summary(),
            "geometry": {"type": "LineString", "coordinates": line},
        })];
        for r in &self.grown.regions {
            let rings: Vec<Value> = r.rings().map(closed).collect();
            features.push(json!({
                "type": "Feature", "properties": {"zone": "grown by the clearance"},
                "geometry": {"type": "Polygon", "coordinates": rings},
            }));
        }
        json!({"type": "FeatureCollection", "features": features})
    }
}

fn rings(zone: &Zone) -> impl Iterator<Item = &Vec<Point>> {
    std::iter::once(&zone.outer).chain(&zone.holes)
}

fn edges(zone: &Zone) -> impl Iterator<Item = (Point, Point)> + '_ {
    rings(zone).flat_map(|r| (0..r.len()).map(move |i| (r[i], r[(i + 1) % r.len()])))
}

/// Distance from `p` to a zone, 0 inside, metres.
fn distance_m(p: Point, zone: &Zone) -> f64 {
    // Odd crossings in the outer ring or in a hole change sides once each.
    let inside = rings(zone).fold(false, |inside, r| inside ^ crosses_oddly(r, p));
    if inside {
        return 0.0;
    }
    edges(zone)
        .map(|(a, b)| to_piece_m(p, a, b))
        .fold(f64::INFINITY, f64::min)
}

fn crosses_oddly(ring: &[Point], p: Point) -> bool {
    let n = ring.len();
    (0..n).fold(false, |odd, i| {
        let (a, b) = (ring[i], ring[(i + 1) % n]);
        let spans = (a.y <= p.y) != (b.y <= p.y);
        let west = a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x);
        odd ^ (spans && p.x < west)
    })
}

/// Distance from a path to the edges of zones, 0 when it crosses one, metres.
fn least_distance_m(path: &[Point], zones: &[Zone]) -> f64 {
    let mut least = f64::INFINITY;
    for w in path.windows(2) {
        for (a, b) in zones.iter().flat_map(edges) {
            let left = |p: Point, q: Point, x: Point| (q - p).perp(&(x - p)) > 0.0;
            let crosses =
                left(a, b, w[0]) != left(a, b, w[1]) && left(w[0], w[1], a) != left(w[0], w[1], b);
            least = least
                .min(if crosses { 0.0 } else { f64::INFINITY })
                .min(to_piece_m(w[0], a, b))
                .min(to_piece_m(w[1], a, b))
                .min(to_piece_m(a, w[0], w[1]))
                .min(to_piece_m(b, w[0], w[1]));
        }
    }
    least
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
        assert!(error(&a).starts_with("--via 47.3953,8.5429 lies in a zone: exclusion fence 1"));
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
                "--from lies in a zone: exclusion fence 1",
            ),
            (
                args(PLAN, HERE, "47.5,8.54", 5.0),
                "--to lies in a zone: inclusion fence 0",
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
        a.vertical_margin_m = -1.0;
        assert!(error(&a).contains("--vertical-margin-m"));
    }
}
