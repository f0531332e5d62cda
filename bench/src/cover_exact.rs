//! `bench exact`: exact area coverage of generated areas with holes and of field outlines.
//!
//! What is seen is recounted here by random points, with code of its own.

use super::cover_trees;
use super::figures::{Times, timed};
use super::measure::is_inside;
use anyhow::{Context, Result, ensure};
use clap::{Args, ValueEnum};
use serde::Serialize;
use skein_flight::coverage::passes::{Directions, PassesPlan, PassesProblem, plan};
use skein_geometry::frame::{Origin, Point};
use skein_geometry::random::SplitMix64;
use skein_geometry::{NoFlyZones, Polygon};
use skein_interop::geojson;
use skein_interop::place::to_plane;
use skein_survey::passes::{Uav, plan_team};
use std::path::PathBuf;
use std::sync::Arc;

/// The most areas that are generated: a run of some minutes.
const MOST_AREAS: usize = 10_000;

/// Zones in an area up to which each is as large as if it were alone.
const MOST_LARGE: usize = 15;

/// The largest team: the same as a swarm.
const MOST_UAVS: usize = 1_000;

/// Exact coverage of generated areas, and of the fields of a file.
#[derive(Debug, Args)]
pub struct ExactArgs {
    /// How many areas are generated.
    #[arg(long, default_value_t = 20, value_name = "N")]
    pub n: usize,
    /// No-fly zones in each area.
    #[arg(long, default_value_t = 15, value_name = "N")]
    pub holes: usize,
    /// GeoJSON with field outlines: each is planned as it is and with zones.
    #[arg(long, value_name = "FILE")]
    pub fields: Option<PathBuf>,
    /// Lanes across a square of the area's size.
    #[arg(long, default_value_t = 40.0, value_name = "N")]
    pub lanes: f64,
    /// Turn radius in lane spacings.
    #[arg(long, default_value_t = 0.5, value_name = "R")]
    pub turn_radius: f64,
    /// UAVs of the team that each area is planned for as well.
    #[arg(long, default_value_t = 1, value_name = "K")]
    pub k: usize,
    /// Steps of improvement.
    #[arg(long, default_value_t = skein_flight::coverage::passes::DEFAULT_STEPS, value_name = "N")]
    pub steps: usize,
    /// Steps of improvement of a team's plan.
    #[arg(long, default_value_t = 20_000, value_name = "N")]
    pub team_steps: usize,
    /// A planner that teams are compared with.
    #[arg(long, value_enum, value_name = "PLANNER")]
    pub baseline: Option<Baseline>,
    /// Random points that are looked for in each area.
    #[arg(long, default_value_t = 50_000, value_name = "N")]
    pub samples: usize,
}

/// What teams are compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Baseline {
    /// D2.7's own: a tree of whole cells for each UAV.
    Trees,
}

#[derive(Serialize)]
struct Answer {
    areas: usize,
    fields: usize,
    holes: usize,
    passes_mean: f64,
    cells_mean: f64,
    pocket_passes_mean: f64,
    length_over_bound_mean: f64,
    over_one_direction_mean: f64,
    over_one_direction_worst: f64,
    k: usize,
    team_ratio_mean: f64,
    team_ratio_worst: f64,
    team_over_bound_mean: f64,
    team_over_bound_worst: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    over_trees_mean: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    over_trees_worst: Option<f64>,
    team_ms_mean: f64,
    seen_share_mean: f64,
    seen_share_least: f64,
    nearest_to_zone: f64,
    #[serde(flatten)]
    plan: Times,
}

struct Instance {
    problem: PassesProblem,
    zones: Vec<Vec<Point>>,
    is_field: bool,
}

/// Measures, and returns the JSON text to print.
///
/// # Errors
/// When a file or a flag is wrong, or an area cannot be planned.
pub fn run(args: &ExactArgs) -> Result<String> {
    ensure!(
        args.n <= MOST_AREAS,
        "--n must be at most {MOST_AREAS}, found {}",
        args.n
    );
    ensure!(
        args.lanes > 1.0 && args.lanes <= 1000.0,
        "--lanes must be above 1 and at most 1000, found {}",
        args.lanes
    );
    ensure!(
        (1..=MOST_UAVS).contains(&args.k),
        "--k must be between 1 and {MOST_UAVS}, found {}",
        args.k
    );
    let instances = instances(args)?;
    let mut rows = Vec::new();
    for (i, instance) in instances.iter().enumerate() {
        rows.push(measure(instance, args, i as u64).with_context(|| format!("area {i}"))?);
    }
    Ok(serde_json::to_string(&sum_up(args, &instances, &rows))?)
}

struct Row {
    best: PassesPlan,
    /// The longest tour of the team over a fair share of the work, or over the farthest
    /// pass there and back, whichever is longer. The work is the tour of one UAV, with
    /// the way out and back to the nearest pass for each UAV more.
    team_ratio: f64,
    /// The longest tour of the team over what no tours along the passes can beat.
    over_bound: f64,
    /// The longest tour of the team over that of the baseline.
    over_trees: Option<f64>,
    team_us: f64,
    one_direction_m: f64,
    seen: f64,
    nearest: f64,
    plan_us: f64,
}

fn measure(instance: &Instance, args: &ExactArgs, seed: u64) -> Result<Row> {
    let (best, plan_us) = timed(|| plan(&instance.problem));
    let best = best?;
    let one = plan(&PassesProblem {
        directions: Directions::Huang,
        ..instance.problem.clone()
    })?;
    let team = vec![Uav::at(instance.problem.launch); args.k];
    let team_problem = PassesProblem {
        steps: args.team_steps,
        ..instance.problem.clone()
    };
    let (together, team_us) = timed(|| plan_team(&team_problem, &team));
    let together = together?;
    let launch = instance.problem.launch;
    let ends = best.passes.iter().flat_map(|p| [p.from, p.to]);
    let way_m = ends
        .map(|p| (p - launch).norm())
        .fold(f64::INFINITY, f64::min);
    let k = args.k as f64;
    let share_m = ((best.length_m + 2.0 * (k - 1.0) * way_m) / k).max(together.farthest);
    let seen = seen_share(instance, &best, args.samples, seed);
    let nearest = nearest_m(instance, &best) / instance.problem.clearance_m;
    let over_trees = args.baseline.and_then(|Baseline::Trees| {
        let trees_m = cover_trees::makespan_m(&instance.problem, &one, args.k)?;
        Some(together.makespan / trees_m)
    });
    Ok(Row {
        team_ratio: together.makespan / share_m,
        over_bound: together.makespan / together.lower_bound.max(together.farthest),
        over_trees,
        team_us,
        one_direction_m: one.length_m,
        seen,
        nearest,
        plan_us,
        best,
    })
}

fn sum_up(args: &ExactArgs, instances: &[Instance], rows: &[Row]) -> Answer {
    let n = rows.len().max(1) as f64;
    let mean = |f: &dyn Fn(&Row) -> f64| rows.iter().map(f).sum::<f64>() / n;
    let worst = |f: &dyn Fn(&Row) -> f64| rows.iter().map(f).fold(0.0, f64::max);
    let over_one = |r: &Row| r.best.length_m / r.one_direction_m;
    let over_trees = |r: &Row| r.over_trees.unwrap_or(0.0);
    Answer {
        areas: rows.len(),
        fields: instances.iter().filter(|i| i.is_field).count(),
        holes: args.holes,
        passes_mean: mean(&|r| r.best.passes.len() as f64),
        cells_mean: mean(&|r| r.best.cells.len() as f64),
        pocket_passes_mean: mean(&|r| r.best.pocket_passes as f64),
        length_over_bound_mean: mean(&|r| r.best.length_m / r.best.lower_bound_m),
        over_one_direction_mean: mean(&over_one),
        over_one_direction_worst: worst(&over_one),
        k: args.k,
        team_ratio_mean: mean(&|r| r.team_ratio),
        team_ratio_worst: worst(&|r| r.team_ratio),
        team_over_bound_mean: mean(&|r| r.over_bound),
        team_over_bound_worst: worst(&|r| r.over_bound),
        over_trees_mean: args.baseline.map(|_| mean(&over_trees)),
        over_trees_worst: args.baseline.map(|_| worst(&over_trees)),
        team_ms_mean: mean(&|r| r.team_us / 1000.0),
        seen_share_mean: mean(&|r| r.seen),
        seen_share_least: rows.iter().map(|r| r.seen).fold(1.0, f64::min),
        nearest_to_zone: rows.iter().map(|r| r.nearest).fold(f64::INFINITY, f64::min),
        plan: Times::of(rows.iter().map(|r| r.plan_us).collect()),
    }
}

/// A star with this many spokes round a point.
fn star(
    at: Point,
    spokes: usize,
    least_m: f64,
    most_m: f64,
    random: &mut SplitMix64,
) -> Vec<Point> {
    let turn = random.unit();
    (0..spokes)
        .map(|i| {
            let r = least_m + (most_m - least_m) * random.unit();
            let a = std::f64::consts::TAU * (i as f64 + turn) / spokes as f64;
            Point::new(at.x + r * a.cos(), at.y + r * a.sin())
        })
        .collect()
}

fn instances(args: &ExactArgs) -> Result<Vec<Instance>> {
    let mut random = SplitMix64::new(2_016);
    let mut all = Vec::new();
    for _ in 0..args.n {
        let spokes = 6 + (random.unit() * 9.0) as usize;
        let ring = star(Point::new(0.0, 0.0), spokes, 350.0, 650.0, &mut random);
        all.push(instance(ring, args.holes, args, &mut random)?);
    }
    let Some(file) = &args.fields else {
        return Ok(all);
    };
    let text =
        std::fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))?;
    let read = geojson::read(&text).with_context(|| file.display().to_string())?;
    for field in read.polygons {
        let place = || format!("{}: {}", file.display(), field.pointer);
        let first = field.ring[0];
        let origin = Origin {
            lat_deg: first.lat_deg,
            lon_deg: first.lon_deg,
        };
        let points = field.ring.iter().map(|p| to_plane(origin, *p));
        let ring = points.collect::<Result<Vec<_>, _>>().with_context(place)?;
        for holes in [0, args.holes] {
            let mut one = instance(ring.clone(), holes, args, &mut random).with_context(place)?;
            one.is_field = true;
            all.push(one);
        }
    }
    Ok(all)
}

fn instance(
    ring: Vec<Point>,
    holes: usize,
    args: &ExactArgs,
    random: &mut SplitMix64,
) -> Result<Instance> {
    let area = Polygon::new(ring)?;
    let size_m = area.area_m2().sqrt();
    let (low, high) = area.bounds();
    // More zones than a few take no more of the area, but are smaller.
    let scale_m = size_m * (MOST_LARGE as f64 / holes.max(MOST_LARGE) as f64).sqrt();
    let mut zones = Vec::new();
    while zones.len() < holes {
        let at = Point::new(
            low.x + (high.x - low.x) * random.unit(),
            low.y + (high.y - low.y) * random.unit(),
        );
        if is_inside(at, area.vertices()) {
            let spokes = 4 + (random.unit() * 5.0) as usize;
            zones.push(star(at, spokes, 0.02 * scale_m, 0.06 * scale_m, random));
        }
    }
    let spacing_m = size_m / args.lanes;
    let polygons = zones.iter().map(|z| Polygon::new(z.clone()));
    let launch = Point::new(low.x - size_m / 10.0, low.y - size_m / 10.0);
    let problem = PassesProblem {
        zones: Arc::new(NoFlyZones::new(polygons.collect::<Result<_, _>>()?)),
        clearance_m: spacing_m / 4.0,
        steps: args.steps,
        ..PassesProblem::new(area, spacing_m, args.turn_radius * spacing_m, launch)
    };
    Ok(Instance {
        problem,
        zones,
        is_field: false,
    })
}

fn to_ring_m(p: Point, ring: &[Point]) -> f64 {
    let mut least = f64::INFINITY;
    for (i, a) in ring.iter().enumerate() {
        let d = ring[(i + 1) % ring.len()] - a;
        let t = ((p - a).dot(&d) / d.norm_squared()).clamp(0.0, 1.0);
        least = least.min((p - (a + d * t)).norm());
    }
    least
}

/// The share of random points of the area, at least the clearance from all zones, that
/// some pass sees.
fn seen_share(instance: &Instance, plan: &PassesPlan, samples: usize, seed: u64) -> f64 {
    let problem = &instance.problem;
    let (low, high) = problem.area.bounds();
    let mut random = SplitMix64::new(seed);
    let (mut seen, mut all) = (0usize, 0usize);
    while all < samples {
        let p = Point::new(
            low.x + (high.x - low.x) * random.unit(),
            low.y + (high.y - low.y) * random.unit(),
        );
        let needed = is_inside(p, problem.area.vertices())
            && instance
                .zones
                .iter()
                .all(|z| !is_inside(p, z) && to_ring_m(p, z) >= problem.clearance_m);
        if !needed {
            continue;
        }
        all += 1;
        let half = problem.lane_spacing_m / 2.0 + 1e-6;
        seen += usize::from(plan.passes.iter().any(|pass| {
            let (dx, dy) = (pass.to.x - pass.from.x, pass.to.y - pass.from.y);
            let length = (dx * dx + dy * dy).sqrt();
            let (x, y) = (p.x - pass.from.x, p.y - pass.from.y);
            let along = (x * dx + y * dy) / length;
            let across = (x * dy - y * dx) / length;
            across.abs() <= half
                && along >= -problem.look_ahead_m
                && along <= length + problem.look_ahead_m
        }));
    }
    seen as f64 / all.max(1) as f64
}

/// The least distance of a point on a pass from a zone, by steps along each pass.
fn nearest_m(instance: &Instance, plan: &PassesPlan) -> f64 {
    let mut least = f64::INFINITY;
    for pass in &plan.passes {
        for i in 0..=50 {
            let p = pass.from + (pass.to - pass.from) * (f64::from(i) / 50.0);
            for zone in &instance.zones {
                let d = if is_inside(p, zone) {
                    0.0
                } else {
                    to_ring_m(p, zone)
                };
                least = least.min(d);
            }
        }
    }
    least
}
