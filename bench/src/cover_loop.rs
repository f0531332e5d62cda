//! `bench cover-loop`: the closed loop over all cells of an open square or of maps, how
//! much of it is flown twice, and its exact division among many UAVs that stand on it.

use super::cover::read_map;
use super::figures::{Times, timed};
use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use serde::Serialize;
use skein_lab::regions::ring::{Uav, divide};
use skein_survey::regions::map::Router;
use skein_survey::regions::spanning::{Tree, closed_loop, lean_loop};
use skein_survey::regions::{Cell, LaneMap};
use std::hint::black_box;
use std::path::{Path, PathBuf};

/// Which spanning tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TreeKind {
    /// Long winding lanes.
    Depth,
    /// Branches that lead straight away from the root.
    Breadth,
    /// Lanes along the rows.
    Rows,
    /// Lanes along the columns.
    Columns,
}

impl From<TreeKind> for Tree {
    fn from(kind: TreeKind) -> Self {
        match kind {
            TreeKind::Depth => Self::DepthFirst,
            TreeKind::Breadth => Self::BreadthFirst,
            TreeKind::Rows => Self::Rows,
            TreeKind::Columns => Self::Columns,
        }
    }
}

/// A square of cells, one with obstacles, or maps.
#[derive(Debug, Args)]
pub struct CoverLoopArgs {
    /// Cells a side.
    #[arg(long, default_value_t = 1000, value_name = "N")]
    pub side: u32,
    /// Obstacles of 7 × 5 cells in every 20 × 20, which cut through blocks.
    #[arg(long)]
    pub obstacles: bool,
    /// A map (`octile` text) instead of the square, or a folder of them: the loop over
    /// the largest part of each that hangs together.
    #[arg(long, value_name = "FILE|DIR")]
    pub maps: Option<PathBuf>,
    /// The spanning tree.
    #[arg(long, value_enum, default_value_t = TreeKind::Depth)]
    pub tree: TreeKind,
    /// Bring cells that the loop leaves out together, and try all offsets of the blocks.
    #[arg(long)]
    pub lean: bool,
    /// UAVs among which the loop is divided.
    #[arg(long, default_value_t = 1000, value_name = "K")]
    pub k: u32,
    /// Times that each is measured.
    #[arg(long, default_value_t = 20, value_name = "N")]
    pub runs: usize,
}

#[derive(Serialize)]
struct Answer {
    #[serde(skip_serializing_if = "Option::is_none")]
    map: Option<String>,
    cells: usize,
    /// Places where the next cell is not a neighbour.
    hops: usize,
    /// Moves of the closed walk, with the ways of the hops.
    moves: u64,
    /// Moves above the number of cells, as a share of it.
    redundancy: f64,
    turns: usize,
    loop_times: Times,
    k: u32,
    divide_times: Times,
    makespan_moves: u32,
}

/// Lays the loops and divides them.
///
/// # Errors
/// When the square is too large, or a map cannot be read.
pub fn run(args: &CoverLoopArgs) -> Result<String> {
    let Some(maps) = &args.maps else {
        let blocked =
            |row: u32, col: u32| args.obstacles && row % 20 < 7 && (col + row / 20) % 20 < 5;
        let map = LaneMap::new(args.side, args.side, |r, c| !blocked(r, c))?;
        return Ok(serde_json::to_string(&measured(args, &map, None)?)?);
    };
    let answers = files(maps)?.into_iter().map(|file| {
        let name = file.file_stem().map(|s| s.to_string_lossy().into_owned());
        let map = read_map(&file)?;
        measured(args, &map, name).with_context(|| file.display().to_string())
    });
    let mut answers = answers.collect::<Result<Vec<Answer>>>()?;
    // One map is one flat object, as everywhere.
    Ok(match (maps.is_dir(), answers.pop()) {
        (false, Some(only)) => serde_json::to_string(&only)?,
        (_, last) => {
            answers.extend(last);
            serde_json::to_string(&answers)?
        }
    })
}

/// A map, or the maps of a folder by name.
fn files(maps: &Path) -> Result<Vec<PathBuf>> {
    if !maps.is_dir() {
        return Ok(vec![maps.to_owned()]);
    }
    let shown = || format!("cannot read the folder {}", maps.display());
    let mut files = Vec::new();
    for entry in std::fs::read_dir(maps).with_context(shown)? {
        let path = entry.with_context(shown)?.path();
        if path.extension().is_some_and(|e| e == "map") {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

fn measured(args: &CoverLoopArgs, map: &LaneMap, name: Option<String>) -> Result<Answer> {
    let root = largest_part(map).context("no free cell")?;
    let (mut loop_us, mut divide_us) = (Vec::new(), Vec::new());
    let mut order = Vec::new();
    let mut makespan_moves = 0;
    let lay = if args.lean { lean_loop } else { closed_loop };
    for _ in 0..args.runs.max(1) {
        let (cells, us) = timed(|| lay(map, root, args.tree.into()));
        loop_us.push(us);
        order = cells;
        let n = u32::try_from(order.len())?;
        // Unevenly spread, the same in every run.
        let uavs: Vec<Uav> = (0..args.k)
            .map(|i| Uav {
                place: i.wrapping_mul(0x9E37_79B1) % n,
                speed: 1,
                endurance: u32::MAX,
            })
            .collect();
        let (division, us) = timed(|| black_box(divide(n, &uavs)));
        divide_us.push(us);
        makespan_moves = division.map_or(0, |d| d.finish.0);
    }
    let walk = walk(map, &order);
    let moves = walk.len() as u64;
    let next = walk.iter().cycle().skip(1);
    let after = walk.iter().cycle().skip(2);
    let turns = walk.iter().zip(next).zip(after);
    let turns = turns.filter(|((a, b), c)| *b - *a != *c - *b).count();
    let hop = |(a, b): (&Cell, &Cell)| !map.adjacent(*a, *b);
    let hops = order.iter().zip(order.iter().cycle().skip(1));
    Ok(Answer {
        map: name,
        cells: order.len(),
        hops: hops.filter(|h| order.len() > 1 && hop(*h)).count(),
        moves,
        redundancy: moves as f64 / order.len() as f64 - 1.0,
        turns,
        loop_times: Times::of(loop_us),
        k: args.k,
        divide_times: Times::of(divide_us),
        makespan_moves,
    })
}

/// A cell of the part with the most cells, the first of several.
fn largest_part(map: &LaneMap) -> Option<Cell> {
    let mut seen = vec![false; map.table_len()];
    let mut best: Option<(usize, Cell)> = None;
    for start in map.cells() {
        if seen[start as usize] {
            continue;
        }
        let part = map.reachable(&[start]);
        for cell in part.cells() {
            seen[cell as usize] = true;
        }
        if best.is_none_or(|(n, _)| part.n_free() > n) {
            best = Some((part.n_free(), start));
        }
    }
    best.map(|b| b.1)
}

/// All moves of the closed walk, numbers signed so that moves can be compared.
fn walk(map: &LaneMap, order: &[Cell]) -> Vec<i64> {
    let mut router = Router::new(map);
    let mut walk = Vec::new();
    for (a, b) in order.iter().zip(order.iter().cycle().skip(1)) {
        router.append_way(*a, *b, &mut walk);
    }
    walk.into_iter().map(i64::from).collect()
}
