//! `bench cover`: plans on public grid maps, one line an instance, each path cell by cell,
//! so that anyone can recount them.

use super::cover_drawn;
use super::figures::timed;
use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use serde::{Deserialize, Serialize};
use skein_lab::regions::boustrophedon;
use skein_lab::regions::{forest, free_entry, mstc, patrol};
use skein_survey::regions::improve::Improver;
use skein_survey::regions::{Cell, LaneMap, Plan, Task, TaskError, bounds, improve};
use std::collections::BTreeMap;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A UAV with at least this many cells to cover counts as one with long arcs.
const LONG_ARCS: f64 = 500.0;

/// Below this many cells a UAV the bound is loose: ways and dead ends weigh too much.
const SHORT_ARCS: f64 = 100.0;

/// Which planner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Planner {
    /// One loop, each UAV flies on to where the next one began.
    Mstc,
    /// One loop, divided exactly with backtracking.
    Bmstc,
    /// A tree cover of the blocks, each UAV flies round its tree.
    Mfc,
    /// One loop, each UAV flies straight to its arc.
    Free,
    /// The default: a region each, then local search.
    Best,
    /// The first period of a patrol of one loop.
    Patrol,
    /// The boustrophedon decomposition, its walk divided as the loop is.
    Exact,
}

/// Instances, maps and a planner.
#[derive(Debug, Args)]
pub struct CoverArgs {
    /// Instances, one JSON object a line with `map`, `k`, `mode`, `seed`, `roots`.
    #[arg(
        long,
        value_name = "FILE",
        required_unless_present = "drawn",
        requires = "maps"
    )]
    pub instances: Option<PathBuf>,
    /// Folder of the maps (`octile` text, one character a cell); an open field named
    /// `empty-ROWS-COLUMNS` needs no file.
    #[arg(long, value_name = "DIR")]
    pub maps: Option<PathBuf>,
    /// Instances drawn by seeds, one each, instead of those of a file.
    #[arg(long, value_name = "FROM..TO", conflicts_with = "instances", value_parser = seeds)]
    pub drawn: Option<std::ops::Range<u64>>,
    /// The planner.
    #[arg(long, value_enum)]
    pub planner: Planner,
    /// With `--planner best`, go on improving for this many milliseconds, or until nothing
    /// better is found; without it for a fixed number of steps,
    /// as in `skein plan`.
    #[arg(long, value_name = "MS")]
    pub budget_ms: Option<u64>,
    /// Each UAV returns to its root.
    #[arg(long)]
    pub closed: bool,
    /// Where the plans go, one JSON object a line.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}

#[derive(Deserialize)]
struct Instance {
    map: String,
    k: usize,
    #[serde(default)]
    mode: String,
    #[serde(default)]
    seed: i64,
    roots: Vec<(u32, u32)>,
}

#[derive(Serialize)]
struct Line<'a> {
    map: &'a str,
    k: usize,
    mode: &'a str,
    seed: i64,
    planner: Planner,
    makespan_moves: u32,
    lower_bound: u32,
    ratio: f64,
    plan_ms: f64,
    cells_total: usize,
    cells_covered: usize,
    paths: Vec<Vec<(u32, u32)>>,
}

/// Ratios of makespan to bound of one class of instances.
#[derive(Serialize)]
struct Class {
    n: usize,
    geometric_mean: f64,
    worst: f64,
}

#[derive(Serialize)]
struct Answer {
    planner: Planner,
    closed: bool,
    n: usize,
    complete: usize,
    ratio: Class,
    ratio_500: Class,
    ratio_100: Class,
    ratio_small: Class,
    plan_ms_mean: f64,
    plan_ms_max: f64,
}

/// Plans every instance, writes the plans and sums up the ratios.
///
/// # Errors
/// When a file is missing or malformed, or a root is not free; the error names the line.
pub fn run(args: &CoverArgs) -> Result<String> {
    if args.budget_ms.is_some() && args.planner != Planner::Best {
        bail!("--budget-ms is for --planner best: the others take what they take");
    }
    let file = std::fs::File::create(&args.out)
        .with_context(|| format!("cannot write {}", args.out.display()))?;
    let mut out = BufWriter::new(file);
    let mut results = Vec::new();
    let mut solve_next = |map: &LaneMap, instance: &Instance| {
        let (line, cells) = solve(map, instance, args)?;
        results.push((
            cells,
            line.ratio,
            line.plan_ms,
            line.cells_covered == line.cells_total,
        ));
        serde_json::to_writer(&mut out, &line)?;
        out.write_all(b"\n")?;
        Ok(())
    };
    if let (Some(instances), Some(maps)) = (&args.instances, &args.maps) {
        of_file(instances, maps, &mut solve_next)?;
    }
    for seed in args.drawn.clone().into_iter().flatten() {
        let drawn = cover_drawn::draw(seed)?;
        let instance = Instance {
            map: drawn.name,
            k: drawn.roots.len(),
            mode: drawn.mode.to_owned(),
            seed: i64::try_from(seed)?,
            roots: drawn.roots.iter().map(|r| drawn.map.place(*r)).collect(),
        };
        solve_next(&drawn.map, &instance)?;
    }
    out.flush()?;
    Ok(serde_json::to_string(&sum_up(args, &results))?)
}

/// Solves the instances of a file, each on the map that it names.
fn of_file(
    instances: &Path,
    folder: &Path,
    solve_next: &mut impl FnMut(&LaneMap, &Instance) -> Result<()>,
) -> Result<()> {
    let text = std::fs::read_to_string(instances)
        .with_context(|| format!("cannot read {}", instances.display()))?;
    let mut maps: BTreeMap<String, LaneMap> = BTreeMap::new();
    let lines = (1..).zip(text.lines());
    for (number, line) in lines.filter(|(_, l)| !l.trim().is_empty()) {
        let place = || format!("{}:{number}", instances.display());
        let instance: Instance = serde_json::from_str(line).with_context(place)?;
        if !maps.contains_key(&instance.map) {
            let map = named_map(folder, &instance.map).with_context(place)?;
            maps.insert(instance.map.clone(), map);
        }
        solve_next(&maps[&instance.map], &instance).with_context(place)?;
    }
    Ok(())
}

/// Reads `FROM..TO`.
fn seeds(text: &str) -> Result<std::ops::Range<u64>, String> {
    let ends = text.split_once("..");
    let ends = ends.and_then(|(from, to)| Some((from.parse().ok()?, to.parse().ok()?)));
    let (from, to) = ends.ok_or("write FROM..TO, for example 100..200")?;
    Ok(from..to)
}

fn solve<'a>(map: &LaneMap, instance: &'a Instance, args: &CoverArgs) -> Result<(Line<'a>, f64)> {
    if instance.roots.len() != instance.k {
        bail!("{} roots for k = {}", instance.roots.len(), instance.k);
    }
    let root = |&(row, col): &(u32, u32)| {
        map.cell(row, col)
            .with_context(|| format!("root [{row}, {col}] is not a free cell"))
    };
    let roots: Vec<Cell> = instance.roots.iter().map(root).collect::<Result<_>>()?;
    let (planned, plan_us) = timed(|| {
        let task = Task::new(map, &roots, args.closed)?;
        let plan = plan(&task, args);
        Ok::<_, TaskError>((task, plan))
    });
    let (task, plan) = planned?;
    let lower_bound = bounds::least_moves(&task);
    let makespan_moves = plan.makespan_moves();
    let cells_total = task.map.n_free();
    let line = Line {
        map: &instance.map,
        k: instance.k,
        mode: &instance.mode,
        seed: instance.seed,
        planner: args.planner,
        makespan_moves,
        lower_bound,
        ratio: f64::from(makespan_moves) / f64::from(lower_bound.max(1)),
        plan_ms: plan_us / 1000.0,
        cells_total,
        cells_covered: plan.n_covered(&task),
        paths: plan
            .paths
            .iter()
            .map(|path| path.iter().map(|c| task.map.place(*c)).collect())
            .collect(),
    };
    let cells_per_uav = cells_total as f64 / instance.k.max(1) as f64;
    Ok((line, cells_per_uav))
}

fn plan(task: &Task, args: &CoverArgs) -> Plan {
    match args.planner {
        Planner::Mstc => mstc::without_backtracking(task),
        Planner::Bmstc => mstc::with_backtracking(task),
        Planner::Mfc => forest::plan(task),
        Planner::Free => free_entry::free_entry(task),
        Planner::Patrol => patrol::first_period(task),
        Planner::Exact => boustrophedon::plan(task),
        Planner::Best => best(task, args.budget_ms),
    }
}

fn best(task: &Task, budget_ms: Option<u64>) -> Plan {
    let Some(budget_ms) = budget_ms else {
        return improve::best(task);
    };
    let start = Instant::now();
    let mut improver = Improver::new(task, usize::MAX);
    while start.elapsed().as_millis() < u128::from(budget_ms) && improver.round() {}
    improver.plan()
}

fn sum_up(args: &CoverArgs, results: &[(f64, f64, f64, bool)]) -> Answer {
    let class = |from: f64, below: f64| {
        let ratios: Vec<f64> = results
            .iter()
            .filter(|r| r.0 >= from && r.0 < below)
            .map(|r| r.1)
            .collect();
        let n = ratios.len();
        let logs: f64 = ratios.iter().map(|r| r.max(1e-9).ln()).sum();
        Class {
            n,
            geometric_mean: (logs / n.max(1) as f64).exp(),
            worst: ratios.into_iter().fold(0.0, f64::max),
        }
    };
    Answer {
        planner: args.planner,
        closed: args.closed,
        n: results.len(),
        complete: results.iter().filter(|r| r.3).count(),
        ratio: class(0.0, f64::INFINITY),
        ratio_500: class(LONG_ARCS, f64::INFINITY),
        ratio_100: class(SHORT_ARCS, LONG_ARCS),
        ratio_small: class(0.0, SHORT_ARCS),
        plan_ms_mean: results.iter().map(|r| r.2).sum::<f64>() / results.len().max(1) as f64,
        plan_ms_max: results.iter().map(|r| r.2).fold(0.0, f64::max),
    }
}

/// The map of a name: a file of the folder, or without one an open field,
/// `empty-ROWS-COLUMNS`.
fn named_map(folder: &Path, name: &str) -> Result<LaneMap> {
    let path = folder.join(format!("{name}.map"));
    if !path.exists()
        && let Some(sides) = name.strip_prefix("empty-")
        && let Some((rows, cols)) = sides.split_once('-')
        && let (Ok(rows), Ok(cols)) = (rows.parse(), cols.parse())
    {
        return Ok(LaneMap::new(rows, cols, |_, _| true)?);
    }
    read_map(&path)
}

/// Reads a map: `height` and `width` lines, then `map`, then the rows; `.`, `G` and `S`
/// are free.
pub(super) fn read_map(path: &Path) -> Result<LaneMap> {
    let shown = path.display();
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {shown}"))?;
    let mut lines = text.lines();
    let (mut height, mut width) = (None, None);
    for line in lines.by_ref() {
        let mut words = line.split_whitespace();
        match (words.next(), words.next()) {
            (Some("height"), Some(n)) => height = n.parse::<u32>().ok(),
            (Some("width"), Some(n)) => width = n.parse::<u32>().ok(),
            (Some("map"), _) => break,
            _ => {}
        }
    }
    let (Some(height), Some(width)) = (height, width) else {
        bail!("{shown}: no height or width before the rows");
    };
    let rows: Vec<&[u8]> = lines.map(str::as_bytes).collect();
    if rows.len() < height as usize {
        bail!("{shown}: {} rows, not {height}", rows.len());
    }
    let free = |row: u32, col: u32| {
        let cell = rows[row as usize].get(col as usize);
        matches!(cell, Some(b'.' | b'G' | b'S'))
    };
    Ok(LaneMap::new(height, width, free)?)
}
