//! `bench route --polygons`: shortest paths among polygons by either engine, or with a
//! turn radius the routes that a UAV flies among them.

use super::figures::{Times, timed};
use anyhow::{Context, Result, bail};
use clap::{Args, ValueEnum};
use serde::Serialize;
use skein_flight::route::mesh::Mesh;
use skein_flight::route::two_point::Search;
use skein_flight::route::{RouteLimits, Router};
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::atan2;
use skein_geometry::{NoFlyZones, Polygon};
use skein_survey::visibility::VisibilityGraph;
use std::path::PathBuf;
use std::sync::Arc;

/// A map of polygons and the questions in the same file.
#[derive(Debug, Args)]
pub struct PolygonsArgs {
    /// Polygons and questions. First line: their numbers; then an obstacle a line as
    /// `x y x y …`; then a question a line as `Q x y x y`.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["mesh", "octagons", "comb"])]
    pub polygons: Option<PathBuf>,
    /// Reference lengths for the questions, one a line, `inf` where there is no path.
    #[arg(long, value_name = "FILE", requires = "polygons")]
    pub reference: Option<PathBuf>,
    /// Which engine answers the questions.
    #[arg(long, value_enum, default_value_t = Engine::Graph, requires = "polygons")]
    pub engine: Engine,
    /// Fly the questions: from start to goal point, facing it, with this turn radius,
    /// in the unit of the file.
    #[arg(
        long,
        value_name = "R",
        requires = "polygons",
        conflicts_with = "reference"
    )]
    pub turn_radius: Option<f64>,
    /// Distance kept from the polygons when flying.
    #[arg(
        long,
        value_name = "R",
        default_value_t = 0.0,
        requires = "turn_radius"
    )]
    pub clearance: f64,
}

/// The engines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Engine {
    /// The search over a mesh of free space.
    Mesh,
    /// The visibility graph.
    Graph,
}

/// How far beyond all polygons and questions the mesh ends, as a share of the map:
/// paths bend at polygons only, so any room at all is enough.
const OUTSKIRTS: f64 = 0.1;

#[derive(Serialize)]
struct Answer {
    n: usize,
    vertices: usize,
    /// Corners and edges of the graph, or of the mesh its corners and cells.
    corners: usize,
    edges: usize,
    unreachable: usize,
    /// Number by which processes compare what they have built.
    structure_hash: String,
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
pub fn run(polygons: &PathBuf, args: &PolygonsArgs) -> Result<String> {
    let (obstacles, questions) = read(polygons)?;
    if let Some(turn_radius_m) = args.turn_radius {
        let limits = RouteLimits {
            turn_radius_m,
            clearance_m: args.clearance,
        };
        return fly(&obstacles, &questions, limits);
    }
    let built = match args.engine {
        Engine::Graph => by_graph(&obstacles, &questions),
        Engine::Mesh => by_mesh(&obstacles, &questions)?,
    };
    let lengths = &built.lengths;
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
        corners: built.corners,
        edges: built.edges,
        structure_hash: format!("{:016x}", built.hash),
        unreachable: lengths.iter().filter(|l| l.is_infinite()).count(),
        total_length: lengths.iter().filter(|l| l.is_finite()).sum(),
        max_rel_error: errors
            .as_ref()
            .map(|e| e.iter().fold(0.0, |m: f64, e| m.max(e.abs()))),
        mismatches: count(|e| e.abs() > TOLERANCE),
        better: count(|e| e < -TOLERANCE),
        build_ms: built.build_us / 1e3,
        times: Times::of(built.each_us),
    })?)
}

/// A structure, and what it answered.
struct Built {
    corners: usize,
    edges: usize,
    hash: u64,
    build_us: f64,
    lengths: Vec<f64>,
    each_us: Vec<f64>,
}

type Ends = (Point, Point);

/// Lengths of all paths, infinite where there is none, and the times.
fn ask(questions: &[Ends], mut length: impl FnMut(&Ends) -> Option<f64>) -> (Vec<f64>, Vec<f64>) {
    let answer = |q| {
        let (length, us) = timed(|| length(q));
        (length.unwrap_or(f64::INFINITY), us)
    };
    questions.iter().map(answer).unzip()
}

fn by_graph(obstacles: &[Polygon], questions: &[Ends]) -> Built {
    let (graph, build_us) = timed(|| VisibilityGraph::new(obstacles));
    let (lengths, each_us) = ask(questions, |&(from, to)| {
        graph.shortest(from, to).map(|p| p.length_m)
    });
    Built {
        corners: graph.corners(),
        edges: graph.edges(),
        hash: graph.content_hash(),
        build_us,
        lengths,
        each_us,
    }
}

fn by_mesh(obstacles: &[Polygon], questions: &[Ends]) -> Result<Built> {
    let border = border(obstacles, questions);
    let rings: Vec<&[Point]> = std::iter::once(border.as_slice())
        .chain(obstacles.iter().map(Polygon::vertices))
        .collect();
    let (mesh, build_us) = timed(|| Mesh::from_rings(&rings));
    let mesh = mesh.context("polygons must not cross each other for the mesh")?;
    let mut search = Search::new(&mesh);
    let (lengths, each_us) = ask(questions, |&(from, to)| search.distance_m(from, to));
    Ok(Built {
        corners: mesh.n_corners(),
        edges: mesh.n_cells(),
        hash: mesh.content_hash(),
        build_us,
        lengths,
        each_us,
    })
}

/// A rectangle round everything, with some room.
pub(super) fn border(obstacles: &[Polygon], questions: &[Ends]) -> Vec<Point> {
    let ends = questions.iter().flat_map(|&(a, b)| [a, b]);
    let points = obstacles
        .iter()
        .flat_map(Polygon::vertices)
        .copied()
        .chain(ends);
    let (mut low, mut high) = (Point::origin(), Point::origin());
    for (i, p) in points.enumerate() {
        (low, high) = if i == 0 {
            (p, p)
        } else {
            (low.inf(&p), high.sup(&p))
        };
    }
    let room = OUTSKIRTS * (high - low).amax().max(1.0);
    let (low, high) = (low.map(|c| c - room), high.map(|c| c + room));
    vec![
        low,
        Point::new(high.x, low.y),
        high,
        Point::new(low.x, high.y),
    ]
}

#[derive(Serialize)]
struct Flown {
    n: usize,
    vertices: usize,
    refused: usize,
    /// Length over that of the shortest path of a point that keeps no distance.
    mean_over_taut: f64,
    max_over_taut: f64,
    build_ms: f64,
    /// Times of the first pass over the questions, which fills the router.
    first: Times,
    #[serde(flatten)]
    times: Times,
}

/// Routes instead of paths; asked twice, because a router keeps what it finds out.
fn fly(obstacles: &[Polygon], questions: &[(Point, Point)], limits: RouteLimits) -> Result<String> {
    if !(limits.turn_radius_m > 0.0 && limits.clearance_m >= 0.0) {
        bail!("a turn radius is above zero and a clearance not below");
    }
    let graph = VisibilityGraph::new(obstacles);
    let zones = Arc::new(NoFlyZones::new(obstacles.to_vec()));
    let (router, build_us) = timed(|| Router::new(zones, limits));
    let mut ratios = Vec::new();
    let mut passes = [Vec::new(), Vec::new()];
    for (i, pass) in passes.iter_mut().enumerate() {
        for &(from, to) in questions {
            let d = to - from;
            let start = Pose::new(from, atan2(d.y, d.x));
            let (route, us) = timed(|| router.route_to_point(start, to));
            pass.push(us);
            if i == 0
                && let (Ok(route), Some(taut)) = (route, graph.shortest(from, to))
            {
                ratios.push(route.length_m() / taut.length_m);
            }
        }
    }
    let [first, again] = passes;
    Ok(serde_json::to_string(&Flown {
        n: questions.len(),
        vertices: obstacles.iter().map(|o| o.vertices().len()).sum(),
        refused: questions.len() - ratios.len(),
        mean_over_taut: ratios.iter().sum::<f64>() / ratios.len().max(1) as f64,
        max_over_taut: ratios.iter().copied().fold(0.0, f64::max),
        build_ms: build_us / 1e3,
        first: Times::of(first),
        times: Times::of(again),
    })?)
}

type Map = (Vec<Polygon>, Vec<Ends>);

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
