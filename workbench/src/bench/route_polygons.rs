//! `bench route-polygons`: shortest paths among polygons by the visibility graph.

use super::figures::{Times, timed};
use anyhow::{Context, Result, bail};
use clap::Args;
use serde::Serialize;
use skein_planning::frame::Point;
use skein_planning::geometry::Polygon;
use skein_planning::path::visibility::VisibilityGraph;
use std::path::PathBuf;

/// One map of polygons and the questions in the same file.
#[derive(Debug, Args)]
pub struct RoutePolygonsArgs {
    /// First line: questions and obstacles; then an obstacle a line as `x y x y …`;
    /// then a question a line as `Q x y x y`.
    #[arg(long, value_name = "FILE")]
    pub polygons: PathBuf,
    /// Reference lengths, one a line, `inf` where there is no path.
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,
}

#[derive(Serialize)]
struct Answer {
    n: usize,
    vertices: usize,
    corners: usize,
    edges: usize,
    unreachable: usize,
    /// The sum of all lengths, to compare two runs.
    total_length: f64,
    max_rel_error: Option<f64>,
    mismatches: Option<usize>,
    better: Option<usize>,
    build_ms: f64,
    #[serde(flatten)]
    times: Times,
}

/// A relative difference above this is a wrong answer: rounding stays far below.
const TOLERANCE: f64 = 1e-9;

/// Builds the graph, answers all questions and compares.
///
/// # Errors
/// When a file is missing or malformed; the error names the line.
pub fn run(args: &RoutePolygonsArgs) -> Result<String> {
    let (obstacles, questions) = read(&args.polygons)?;
    let (graph, build_us) = timed(|| VisibilityGraph::new(&obstacles));
    let mut lengths = Vec::with_capacity(questions.len());
    let mut each_us = Vec::with_capacity(questions.len());
    for &(from, to) in &questions {
        let (path, us) = timed(|| graph.shortest(from, to));
        lengths.push(path.map_or(f64::INFINITY, |p| p.length_m));
        each_us.push(us);
    }
    let against = args.reference.as_ref().map(numbers).transpose()?;
    if let Some(want) = &against
        && want.len() != lengths.len()
    {
        bail!("{} lengths for {} questions", want.len(), lengths.len());
    }
    // Positive where the answer is longer than the reference.
    let errors = against.map(|want| {
        let relative = |(&a, &b): (&f64, &f64)| match (a.is_finite(), b.is_finite()) {
            (true, true) => (a - b) / b.max(TOLERANCE),
            (false, false) => 0.0,
            (a_is_finite, _) => {
                if a_is_finite {
                    -1.0
                } else {
                    1.0
                }
            }
        };
        lengths
            .iter()
            .zip(&want)
            .map(relative)
            .collect::<Vec<f64>>()
    });
    let count = |wrong: fn(f64) -> bool| {
        errors
            .as_ref()
            .map(|e| e.iter().filter(|&&e| wrong(e)).count())
    };
    Ok(serde_json::to_string(&Answer {
        n: questions.len(),
        vertices: obstacles.iter().map(|o| o.vertices().len()).sum(),
        corners: graph.corners(),
        edges: graph.edges(),
        unreachable: lengths.iter().filter(|l| l.is_infinite()).count(),
        total_length: lengths.iter().filter(|l| l.is_finite()).sum(),
        max_rel_error: errors
            .as_ref()
            .map(|e| e.iter().fold(0.0, |m: f64, e| m.max(e.abs()))),
        mismatches: count(|e| e.abs() > TOLERANCE),
        better: count(|e| e < -TOLERANCE),
        build_ms: build_us / 1e3,
        times: Times::of(each_us),
    })?)
}

type Map = (Vec<Polygon>, Vec<(Point, Point)>);

fn read(path: &PathBuf) -> Result<Map> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let (mut obstacles, mut questions) = (Vec::new(), Vec::new());
    for (i, line) in text.lines().enumerate().skip(1) {
        let place = || format!("{}, line {}", path.display(), i + 1);
        let (is_question, rest) = match line.strip_prefix('Q') {
            Some(rest) => (true, rest),
            None => (false, line),
        };
        let values: Vec<f64> = rest
            .split_whitespace()
            .map(str::parse)
            .collect::<Result<_, _>>()
            .with_context(place)?;
        let points: Vec<Point> = values
            .chunks_exact(2)
            .map(|c| Point::new(c[0], c[1]))
            .collect();
        match points[..] {
            [] => {}
            [from, to] if is_question => questions.push((from, to)),
            _ if is_question => bail!("{}: a question has four numbers", place()),
            _ => obstacles.push(Polygon::new(points).with_context(place)?),
        }
    }
    Ok((obstacles, questions))
}

fn numbers(path: &PathBuf) -> Result<Vec<f64>> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    text.split_whitespace()
        .map(|w| {
            w.parse()
                .with_context(|| format!("{}: {w}", path.display()))
        })
        .collect()
}
