//! `bench route`: shortest paths on a mesh, two-point and from a map, against reference lengths.

use super::figures::{Times, timed};
use crate::navmesh::{self, Query};
use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use serde::Serialize;
use skein_planning::path::continuous::{Effort, PathMap};
use skein_planning::path::mesh::Mesh;
use skein_planning::path::two_point::Search;
use std::hint::black_box;
use std::path::PathBuf;

/// Lengths further from the reference than this share of it are mismatches.
const EXACT: f64 = 1e-9;

/// Runs over all queries before and besides the one that is timed; the best is kept,
/// because every other run was disturbed by something else on the machine.
const ROUNDS: usize = 3;

/// Maps built, from sources evenly spread over the queries.
const MAPS: usize = 16;

/// Goals of each map that are compared with two-point queries.
const CHECKS: usize = 100;

/// A mesh, and queries with reference lengths.
#[derive(Debug, Args)]
pub struct RouteArgs {
    /// The mesh, in the `.mesh` format, version 2.
    #[arg(long, value_name = "FILE")]
    pub mesh: PathBuf,
    /// Queries, one a line: from x y, to x y, length.
    #[arg(long, value_name = "FILE")]
    pub queries: PathBuf,
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
    /// Mean over the maps.
    map_build_ms: f64,
    /// Mean of one distance query.
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
    #[serde(skip_serializing_if = "Option::is_none")]
    rival: Option<Figures>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ratio: Option<f64>,
}

/// Solves all queries and compares.
///
/// # Errors
/// When a file is missing or malformed; the error names the line.
pub fn run(args: &RouteArgs) -> Result<String> {
    let text = read(&args.mesh)?;
    let cells = navmesh::read_cells(&text).with_context(|| name(&args.mesh))?;
    let queries =
        navmesh::read_queries(&read(&args.queries)?).with_context(|| name(&args.queries))?;
    let (mesh, build_us) = timed(|| navmesh::link(&cells));
    let mesh = mesh.with_context(|| name(&args.mesh))?;
    let ours = two_point(&mesh, &queries, build_us / 1e3);
    let rival = match args.against {
        Some(Rival::Polyanya) => Some(against_polyanya(&text, &queries)?),
        None => None,
    };
    Ok(serde_json::to_string(&Answer {
        vertices: mesh.n_vertices(),
        cells: mesh.n_cells(),
        ratio: rival.as_ref().map(|r| ours.times.mean_us / r.times.mean_us),
        ours,
        maps: maps(&mesh, &queries),
        rival,
    })?)
}

fn name(file: &std::path::Path) -> String {
    file.display().to_string()
}

fn read(file: &std::path::Path) -> Result<String> {
    std::fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))
}

fn two_point(mesh: &Mesh, queries: &[Query], build_ms: f64) -> Figures {
    let mut search = Search::new(mesh);
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
    let (mut build_us, mut query_us, mut built) = (0.0, 0.0, 0);
    let mut effort = Effort::default();
    for source in queries.iter().step_by(queries.len().div_ceil(MAPS).max(1)) {
        let (map, us) = timed(|| PathMap::new(mesh, source.from));
        built += 1;
        build_us += us;
        let most = map.effort();
        effort.windows = effort.windows.max(most.windows);
        effort.kept = effort.kept.max(most.kept);
        effort.most_on_a_side = effort.most_on_a_side.max(most.most_on_a_side);
        let ((), us) = timed(|| {
            for q in queries {
                black_box(map.distance_m(black_box(q.to)));
            }
        });
        query_us += us / queries.len() as f64;
        let others = queries.iter().step_by(queries.len().div_ceil(CHECKS));
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
    let n_maps = f64::from(built.max(1));
    MapFigures {
        map_n: n,
        map_max_rel_error: max_rel_error,
        map_mismatches: mismatches,
        map_build_ms: build_us / 1e3 / n_maps,
        map_query_us: query_us / n_maps,
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
    let point = |p: skein_planning::frame::Point| glam::Vec2::new(p.x as f32, p.y as f32);
    Ok(measure(queries, build_us / 1e3, |q| {
        mesh.path(point(q.from), point(q.to))
            .map_or(f64::NAN, |path| f64::from(path.length))
    }))
}

#[cfg(not(feature = "rivals"))]
fn against_polyanya(_: &str, _: &[Query]) -> Result<Figures> {
    anyhow::bail!("built without the cargo feature `rivals`")
}
