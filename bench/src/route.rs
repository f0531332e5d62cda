//! `bench route`: shortest paths on a mesh, two-point and from a map, against reference lengths.

use super::figures::{Times, timed};
use super::route_graph::GraphFigures;
use super::route_polygons::{self, PolygonsArgs};
use super::{route_graph, route_maps};
use crate::navmesh::{self, Query};
use anyhow::{Context, Result, ensure};
use clap::{Args, ValueEnum};
use serde::Serialize;
use skein_flight::route::mesh::Mesh;
use skein_flight::route::two_point::Search;
use skein_geometry::frame::Point;
use skein_lab::route::continuous::{Effort, PathMap};
use skein_lab::route::landmarks::Landmarks;
use std::hint::black_box;
use std::path::{Path, PathBuf};

/// Lengths further from the reference than this share of it are mismatches.
const EXACT: f64 = 1e-9;

/// Runs over all queries before and besides the one that is timed; the best is kept,
/// because every other run was disturbed by something else on the machine.
const ROUNDS: usize = 3;

/// Queries on a map that is made up.
const QUERIES: usize = 200;

/// The largest field of octagons: 8 million vertices.
const MAX_SIDE: usize = 1000;

/// The largest comb: a million windows for each hundred megabytes.
const MAX_TEETH: usize = 2000;

/// Maps built, from sources evenly spread over the queries.
const MAPS: usize = 16;

/// Zones taken out and put back.
const REPAIRS: usize = 16;

/// Goals of each map that are compared with two-point queries.
const CHECKS: usize = 100;

/// A mesh, and queries with reference lengths.
#[derive(Debug, Args)]
pub struct RouteArgs {
    /// The mesh, in the `.mesh` format, version 2.
    #[arg(long, value_name = "FILE", requires = "queries", required_unless_present_any = ["octagons", "comb", "polygons"])]
    pub mesh: Option<PathBuf>,
    /// Queries, one a line: from x y, to x y, length.
    #[arg(long, value_name = "FILE", requires = "mesh")]
    pub queries: Option<PathBuf>,
    /// Instead of files: N by N octagons, triangulated, and random queries.
    #[arg(long, value_name = "N", conflicts_with_all = ["mesh", "comb"], group = "made_up")]
    pub octagons: Option<usize>,
    /// Instead of files: N diamonds below a shaft, hard for continuous Dijkstra.
    #[arg(long, value_name = "N", conflicts_with = "mesh", group = "made_up")]
    pub comb: Option<usize>,
    /// Instead of a mesh: polygons, and questions in the same file.
    #[command(flatten)]
    pub among: PolygonsArgs,
    /// Also build the visibility graph of the made-up map, and ask it the same.
    #[arg(long, requires = "made_up")]
    pub graph: bool,
    /// Also measure a rival in this process (needs the cargo feature `rivals`).
    #[arg(long, value_name = "RIVAL")]
    pub against: Option<Rival>,
}

/// Who else solves this problem.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum Rival {
    /// The `polyanya` crate, single precision.
    Polyanya,
}

/// Lengths against references, and times.
#[derive(Serialize)]
struct Figures {
    n: usize,
    max_rel_error: f64,
    mismatches: usize,
    better: usize,
    build_ms: f64,
    #[serde(flatten)]
    times: Times,
}

/// Shortest path maps: lengths against two-point queries, and times.
#[derive(Serialize)]
struct MapFigures {
    map_n: usize,
    map_max_rel_error: f64,
    map_mismatches: usize,
    /// Median over the maps.
    map_build_ms: f64,
    /// Of one distance query, median over batches.
    map_query_us: f64,
    /// Most windows of any map, and most of them on one side of a cell.
    map_windows: usize,
    map_windows_kept: usize,
    map_most_on_a_side: usize,
}

#[derive(Serialize)]
struct Answer {
    #[serde(flatten)]
    ours: Figures,
    #[serde(flatten)]
    maps: MapFigures,
    vertices: usize,
    cells: usize,
    /// Number by which processes compare the mesh they have built.
    structure_hash: String,
    #[serde(flatten)]
    graph: Option<GraphFigures>,
    /// A zone taken out of the made-up map, or put back: mean of some.
    #[serde(skip_serializing_if = "Option::is_none")]
    repair_ms: Option<f64>,
    /// Two-point queries with landmarks; the build is that of the landmarks.
    guided: Figures,
    #[serde(skip_serializing_if = "Option::is_none")]
    rival: Option<Figures>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ratio: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    guided_ratio: Option<f64>,
}

/// Solves all queries and compares.
///
/// # Errors
/// When a file is missing or malformed; the error names the line.
pub fn run(args: &RouteArgs) -> Result<String> {
    if let Some(file) = &args.among.polygons {
        ensure!(args.against.is_none(), "a rival needs --mesh");
        return route_polygons::run(file, &args.among);
    }
    let problem = problem(args)?;
    let Problem { mesh, queries, .. } = &problem;
    let ours = two_point(Search::new(mesh), queries, problem.build_ms);
    let (landmarks, guide_us) = timed(|| Landmarks::new(mesh));
    let guided = Search::with_landmarks(mesh, &landmarks);
    let guided = two_point(guided, queries, guide_us / 1e3);
    let rival = match (args.against, &problem.text) {
        (Some(Rival::Polyanya), Some(text)) => Some(against_polyanya(text, queries)?),
        (Some(Rival::Polyanya), None) => anyhow::bail!("a rival needs --mesh"),
        (None, _) => None,
    };
    Ok(serde_json::to_string(&Answer {
        vertices: mesh.n_vertices(),
        cells: mesh.n_cells(),
        structure_hash: format!("{:016x}", mesh.content_hash()),
        graph: args.graph.then(|| {
            route_graph::measure(&problem.rings, queries, ours.build_ms, ours.times.mean_us)
        }),
        repair_ms: repair_ms(mesh, &problem.rings)?,
        ratio: rival.as_ref().map(|r| ours.times.mean_us / r.times.mean_us),
        guided_ratio: rival
            .as_ref()
            .map(|r| guided.times.mean_us / r.times.mean_us),
        ours,
        guided,
        maps: maps(mesh, queries),
        rival,
    })?)
}

/// A mesh and what is asked about it.
struct Problem {
    text: Option<String>,
    /// The border and the holes, if the map was made up.
    rings: Vec<Vec<Point>>,
    mesh: Mesh,
    queries: Vec<Query>,
    build_ms: f64,
}

fn problem(args: &RouteArgs) -> Result<Problem> {
    let (rings, queries) = match (&args.mesh, &args.queries, args.octagons, args.comb) {
        (Some(mesh), Some(queries), ..) => return read_problem(mesh, queries),
        (_, _, Some(n), _) => (
            route_maps::octagons(n.min(MAX_SIDE)),
            route_maps::octagon_queries(n.min(MAX_SIDE), QUERIES),
        ),
        (_, _, _, Some(n)) => (
            route_maps::comb(n.min(MAX_TEETH)),
            route_maps::comb_queries(n.min(MAX_TEETH), QUERIES),
        ),
        _ => anyhow::bail!("--mesh with --queries, --octagons or --comb"),
    };
    let slices: Vec<&[Point]> = rings.iter().map(Vec::as_slice).collect();
    let (mesh, build_us) = best_of_rounds(|| Mesh::from_rings(&slices));
    let mesh = mesh?;
    let reachable = |q: &Query| mesh.contains(q.from) && mesh.contains(q.to);
    let mut queries: Vec<Query> = queries.into_iter().filter(reachable).collect();
    // No reference is known: the landmarks' search is compared with the plain one,
    // and the maps with both.
    let mut search = Search::new(&mesh);
    for q in &mut queries {
        q.length_m = search.distance_m(q.from, q.to).unwrap_or(f64::NAN);
    }
    drop(search);
    Ok(Problem {
        text: None,
        rings,
        mesh,
        queries,
        build_ms: build_us / 1e3,
    })
}

/// Takes zones out and puts them back, one by one.
fn repair_ms(mesh: &Mesh, rings: &[Vec<Point>]) -> Result<Option<f64>> {
    let mut times_us = Vec::new();
    for ring in rings.iter().skip(1).step_by((rings.len() / REPAIRS).max(1)) {
        let (without, us) = timed(|| mesh.with_ring_changed(ring));
        times_us.push(us);
        let without = without?;
        let (with, us) = timed(|| without.with_ring_changed(ring));
        times_us.push(us);
        ensure!(
            with?.n_vertices() == mesh.n_vertices(),
            "a repair left something behind"
        );
    }
    let mean_ms = Times::of(times_us).mean_us / 1e3;
    Ok((rings.len() > 1).then_some(mean_ms))
}

fn read_problem(mesh: &Path, queries: &Path) -> Result<Problem> {
    let text = read(mesh)?;
    let cells = navmesh::read_cells(&text).with_context(|| name(mesh))?;
    let queries = navmesh::read_queries(&read(queries)?).with_context(|| name(queries))?;
    let (linked, build_us) = best_of_rounds(|| navmesh::link(&cells));
    Ok(Problem {
        mesh: linked.with_context(|| name(mesh))?,
        text: Some(text),
        rings: Vec::new(),
        queries,
        build_ms: build_us / 1e3,
    })
}

/// The time of the least disturbed of several runs, microseconds.
fn best_of_rounds<T>(mut work: impl FnMut() -> T) -> (T, f64) {
    let (mut value, mut best_us) = timed(&mut work);
    for _ in 1..ROUNDS {
        let us;
        (value, us) = timed(&mut work);
        best_us = best_us.min(us);
    }
    (value, best_us)
}

fn name(file: &Path) -> String {
    file.display().to_string()
}

fn read(file: &Path) -> Result<String> {
    std::fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))
}

fn two_point(mut search: Search, queries: &[Query], build_ms: f64) -> Figures {
    let mut path = Vec::new();
    measure(queries, build_ms, |q| {
        if search.shortest_into(q.from, q.to, &mut path) {
            path.windows(2).map(|w| (w[1] - w[0]).norm()).sum()
        } else {
            f64::NAN
        }
    })
}

fn maps(mesh: &Mesh, queries: &[Query]) -> MapFigures {
    let mut search = Search::new(mesh);
    let (mut n, mut max_rel_error, mut mismatches) = (0, 0.0f64, 0);
    let (mut build_us, mut query_us) = (Vec::new(), Vec::new());
    let mut effort = Effort::default();
    for source in queries.iter().step_by(queries.len().div_ceil(MAPS).max(1)) {
        let (map, us) = timed(|| PathMap::new(mesh, source.from));
        build_us.push(us);
        let most = map.effort();
        effort.windows = effort.windows.max(most.windows);
        effort.kept = effort.kept.max(most.kept);
        effort.most_on_a_side = effort.most_on_a_side.max(most.most_on_a_side);
        for batch in queries.chunks(CHECKS) {
            let ((), us) = timed(|| {
                for q in batch {
                    black_box(map.distance_m(black_box(q.to)));
                }
            });
            query_us.push(us / batch.len() as f64);
        }
        let others = queries
            .iter()
            .step_by(queries.len().div_ceil(CHECKS).max(1));
        for goal in others.chain(std::iter::once(source)) {
            n += 1;
            let pair = (
                map.distance_m(goal.to),
                search.distance_m(source.from, goal.to),
            );
            match pair {
                (Some(a), Some(b)) => {
                    let error = (a - b).abs() / b.max(1.0);
                    max_rel_error = max_rel_error.max(error);
                    mismatches += usize::from(error > EXACT);
                }
                (None, None) => {}
                _ => mismatches += 1,
            }
        }
    }
    MapFigures {
        map_n: n,
        map_max_rel_error: max_rel_error,
        map_mismatches: mismatches,
        map_build_ms: Times::of(build_us).p50_us / 1e3,
        map_query_us: Times::of(query_us).p50_us,
        map_windows: effort.windows,
        map_windows_kept: effort.kept,
        map_most_on_a_side: effort.most_on_a_side,
    }
}

/// Times each query in several rounds, keeps the best round, and compares all lengths.
fn measure(queries: &[Query], build_ms: f64, mut solve: impl FnMut(&Query) -> f64) -> Figures {
    let mut best: Option<Times> = None;
    let mut lengths = Vec::new();
    for _ in 0..ROUNDS {
        lengths.clear();
        let mut each_us = Vec::with_capacity(queries.len());
        for q in queries {
            let (length_m, us) = timed(|| black_box(solve(black_box(q))));
            each_us.push(us);
            lengths.push(length_m);
        }
        let times = Times::of(each_us);
        if best.is_none_or(|b| times.mean_us < b.mean_us) {
            best = Some(times);
        }
    }
    let mut figures = Figures {
        n: queries.len(),
        max_rel_error: 0.0,
        mismatches: 0,
        better: 0,
        build_ms,
        times: best.unwrap_or(Times::of(Vec::new())),
    };
    for (q, &length_m) in queries.iter().zip(&lengths) {
        let error = (length_m - q.length_m) / q.length_m.max(1.0);
        if error.is_nan() {
            figures.mismatches += 1;
            continue;
        }
        figures.max_rel_error = figures.max_rel_error.max(error.abs());
        figures.mismatches += usize::from(error.abs() > EXACT);
        figures.better += usize::from(error < -EXACT);
    }
    figures
}

#[cfg(feature = "rivals")]
fn against_polyanya(text: &str, queries: &[Query]) -> Result<Figures> {
    let (mesh, build_us) = timed(|| {
        let file = polyanya::PolyanyaFile::from_bytes(text.as_bytes());
        let mesh: Result<polyanya::Mesh, _> = file.try_into();
        mesh.map(|mut mesh| {
            mesh.bake();
            mesh
        })
    });
    let mesh = mesh.map_err(|error| anyhow::anyhow!("polyanya: {error:?}"))?;
    let point = |p: Point| glam::Vec2::new(p.x as f32, p.y as f32);
    Ok(measure(queries, build_us / 1e3, |q| {
        mesh.path(point(q.from), point(q.to))
            .map_or(f64::NAN, |path| f64::from(path.length))
    }))
}

#[cfg(not(feature = "rivals"))]
fn against_polyanya(_: &str, _: &[Query]) -> Result<Figures> {
    anyhow::bail!("built without the cargo feature `rivals`")
}
