//! `bench cover-loop`: the closed loop over all cells of an open square, and its exact
//! division among many UAVs that stand on it.

use super::figures::{Times, timed};
use anyhow::{Context, Result};
use clap::Args;
use serde::Serialize;
use skein_planning::coverage::grid::ring::{Robot, divide};
use skein_planning::coverage::grid::spanning::{Tree, closed_loop};
use skein_planning::coverage::grid::{LaneMap, NOWHERE};
use std::hint::black_box;

/// A square of cells, or one with obstacles.
#[derive(Debug, Args)]
pub struct CoverLoopArgs {
    /// Cells a side.
    #[arg(long, default_value_t = 1000, value_name = "N")]
    pub side: u32,
    /// Obstacles of 7 × 5 cells in every 20 × 20, which cut through blocks.
    #[arg(long)]
    pub obstacles: bool,
    /// UAVs among which the loop is divided.
    #[arg(long, default_value_t = 1000, value_name = "K")]
    pub k: u32,
    /// Times that each is measured.
    #[arg(long, default_value_t = 20, value_name = "N")]
    pub runs: usize,
}

#[derive(Serialize)]
struct Answer {
    cells: usize,
    hops: usize,
    loop_times: Times,
    k: u32,
    divide_times: Times,
    makespan_moves: u32,
}

/// Lays the loop and divides it.
///
/// # Errors
/// When the square is too large.
pub fn run(args: &CoverLoopArgs) -> Result<String> {
    let blocked = |row: u32, col: u32| args.obstacles && row % 20 < 7 && (col + row / 20) % 20 < 5;
    let map = LaneMap::new(args.side, args.side, |r, c| !blocked(r, c))?;
    let root = map.cells().next().context("no free cell")?;
    let (mut loop_us, mut divide_us) = (Vec::new(), Vec::new());
    let mut order = Vec::new();
    let mut makespan_moves = 0;
    for _ in 0..args.runs.max(1) {
        let (cells, us) = timed(|| closed_loop(&map, root, Tree::DepthFirst));
        loop_us.push(us);
        order = cells;
        let n = u32::try_from(order.len())?;
        // Unevenly spread, the same in every run.
        let robots: Vec<Robot> = (0..args.k)
            .map(|i| Robot {
                place: i.wrapping_mul(0x9E37_79B1) % n,
                speed: 1,
                endurance: u32::MAX,
            })
            .collect();
        let (division, us) = timed(|| black_box(divide(n, &robots)));
        divide_us.push(us);
        makespan_moves = division.map_or(0, |d| d.finish.0);
    }
    let mut before = order.last().copied().unwrap_or(NOWHERE);
    let mut hops = 0;
    for cell in &order {
        hops += usize::from(!map.adjacent(before, *cell));
        before = *cell;
    }
    Ok(serde_json::to_string(&Answer {
        cells: order.len(),
        hops,
        loop_times: Times::of(loop_us),
        k: args.k,
        divide_times: Times::of(divide_us),
        makespan_moves,
    })?)
}
