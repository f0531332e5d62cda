//! `bench line`: tours along the roads of a city, straight deadheads, one depot.

use super::figures::timed;
use anyhow::{Context, Result, bail};
use clap::Args;
use serde::Serialize;
use skein_flight::coverage::lines::{Line, Uav, plan};
use skein_flight::coverage::metric::{Metric, Straight};
use skein_geometry::frame::Point;
use std::path::{Path, PathBuf};

/// A road network and a team.
#[derive(Debug, Args)]
pub struct LineArgs {
    /// Directory with `node_data` ("id x_m y_m ...") and `req_edge_list` ("id id").
    #[arg(long, value_name = "DIR")]
    pub city: PathBuf,
    /// How many UAVs.
    #[arg(long, default_value_t = 1, value_name = "K")]
    pub k: usize,
    /// Identifier of the depot's node; by default the node nearest the mean of all.
    #[arg(long, value_name = "ID")]
    pub depot: Option<u64>,
    /// Steps of the improvement.
    #[arg(long, default_value_t = 20_000, value_name = "N")]
    pub steps: usize,
    /// Where the plan with its tours is written.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
}

#[derive(Serialize)]
struct Answer {
    k: usize,
    nodes: usize,
    required_edges: usize,
    depot: u64,
    length_m: Vec<f64>,
    makespan_m: f64,
    total_m: f64,
    lower_bound_m: f64,
    ratio: f64,
    plan_ms: f64,
}

#[derive(Serialize)]
struct Plan<'a> {
    #[serde(flatten)]
    answer: &'a Answer,
    tours: Vec<Vec<u64>>,
}

struct City {
    ids: Vec<u64>,
    at: Vec<Point>,
    lines: Vec<Line>,
}

fn read(path: &Path) -> Result<String> {
    std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))
}

fn city(dir: &Path) -> Result<City> {
    let (mut ids, mut at) = (Vec::new(), Vec::new());
    let nodes = dir.join("node_data");
    for (i, row) in read(&nodes)?.lines().enumerate() {
        let fields: Vec<&str> = row.split_whitespace().collect();
        let [id, x, y, ..] = fields[..] else { continue };
        let place = || format!("{}: line {}", nodes.display(), i + 1);
        ids.push(id.parse().with_context(place)?);
        at.push(Point::new(
            x.parse().with_context(place)?,
            y.parse().with_context(place)?,
        ));
    }
    if !at.iter().all(|p| p.x.is_finite() && p.y.is_finite()) {
        bail!("{}: a coordinate is not finite", nodes.display());
    }
    let mut order: Vec<usize> = (0..ids.len()).collect();
    order.sort_unstable_by_key(|&i| ids[i]);
    let edges = dir.join("req_edge_list");
    let mut lines = Vec::new();
    for (i, row) in read(&edges)?.lines().enumerate() {
        let mut ends = Vec::new();
        for field in row.split_whitespace().take(2) {
            let id: u64 = field
                .parse()
                .with_context(|| format!("{}: line {}", edges.display(), i + 1))?;
            match order.binary_search_by_key(&id, |&n| ids[n]) {
                Ok(k) => ends.push(order[k]),
                Err(_) => bail!("{}: line {}: no node {id}", edges.display(), i + 1),
            }
        }
        if let [a, b] = ends[..] {
            lines.push(Line::new(a, b, Straight(&at).cost(a, b)));
        }
    }
    Ok(City { ids, at, lines })
}

/// The node nearest the mean of all nodes, the first of several.
fn middle(at: &[Point]) -> Option<usize> {
    let n = at.len() as f64;
    let mean = Point::new(
        at.iter().map(|p| p.x).sum::<f64>() / n,
        at.iter().map(|p| p.y).sum::<f64>() / n,
    );
    (0..at.len()).min_by(|&a, &b| (at[a] - mean).norm().total_cmp(&(at[b] - mean).norm()))
}

/// Plans, writes the plan and returns its figures.
///
/// # Errors
/// When a file is missing or malformed, or the plan cannot be written.
pub fn run(args: &LineArgs) -> Result<String> {
    let city = city(&args.city)?;
    let depot = match args.depot {
        Some(id) => city.ids.iter().position(|&i| i == id),
        None => middle(&city.at),
    }
    .context("the depot is no node of the network")?;
    let team = vec![Uav::at(depot); args.k];
    let metric = Straight(&city.at);
    let (plan, us) = timed(|| plan(&city.lines, &team, &metric, args.steps));
    let plan = plan?;
    let length_m: Vec<f64> = plan.tours.iter().map(|t| t.cost).collect();
    let answer = Answer {
        k: args.k,
        nodes: city.ids.len(),
        required_edges: city.lines.len(),
        depot: city.ids[depot],
        makespan_m: plan.makespan,
        total_m: length_m.iter().sum(),
        length_m,
        lower_bound_m: plan.lower_bound,
        ratio: plan.makespan / plan.lower_bound,
        plan_ms: us / 1000.0,
    };
    let name = |p: usize| city.ids[p];
    let tours = plan
        .tours
        .iter()
        .map(|t| t.places(&city.lines, depot).into_iter().map(name).collect())
        .collect();
    let text = serde_json::to_string(&Plan {
        answer: &answer,
        tours,
    })?;
    std::fs::write(&args.out, text + "\n")
        .with_context(|| format!("cannot write {}", args.out.display()))?;
    Ok(serde_json::to_string(&answer)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// The tours of a plan, recounted from the files alone: their lengths, after checking
    /// that each starts and ends at the depot and that together they fly along every road.
    fn recount(dir: &Path, told: &serde_json::Value) -> Vec<f64> {
        let nodes = std::fs::read_to_string(dir.join("node_data")).unwrap();
        let at = |id: u64| -> (f64, f64) {
            let row = nodes
                .lines()
                .map(|l| l.split_whitespace().collect::<Vec<_>>())
                .find(|f| f[0] == id.to_string())
                .unwrap();
            (row[1].parse().unwrap(), row[2].parse().unwrap())
        };
        let mut left = BTreeSet::new();
        for row in std::fs::read_to_string(dir.join("req_edge_list"))
            .unwrap()
            .lines()
        {
            let ids: Vec<u64> = row.split_whitespace().map(|f| f.parse().unwrap()).collect();
            left.insert((ids[0].min(ids[1]), ids[0].max(ids[1])));
        }
        let mut lengths = Vec::new();
        for tour in told["tours"].as_array().unwrap() {
            let ids: Vec<u64> = tour
                .as_array()
                .unwrap()
                .iter()
                .map(|v| v.as_u64().unwrap())
                .collect();
            assert_eq!(Some(&told["depot"].as_u64().unwrap()), ids.first());
            assert_eq!(ids.first(), ids.last());
            let mut length = 0.0;
            for w in ids.windows(2) {
                left.remove(&(w[0].min(w[1]), w[0].max(w[1])));
                let (p, q) = (at(w[0]), at(w[1]));
                length += ((p.0 - q.0).powi(2) + (p.1 - q.1).powi(2)).sqrt();
            }
            lengths.push(length);
        }
        assert!(left.is_empty(), "not flown: {left:?}");
        lengths
    }

    fn planned(city: &str, k: usize) -> (Vec<f64>, serde_json::Value) {
        let dir = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("data/roads")
            .join(city);
        let out =
            std::env::temp_dir().join(format!("skein-line-{}-{city}-{k}", std::process::id()));
        run(&LineArgs {
            city: dir.clone(),
            k,
            depot: None,
            steps: 2_000,
            out: out.clone(),
        })
        .unwrap();
        let told: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(&out).unwrap()).unwrap();
        std::fs::remove_file(&out).unwrap();
        let lengths = recount(&dir, &told);
        for (length, said) in lengths.iter().zip(told["length_m"].as_array().unwrap()) {
            assert!((length - said.as_f64().unwrap()).abs() < 1e-6);
        }
        (lengths, told)
    }

    #[test]
    fn one_tour_meets_the_known_bounds_of_real_roads() {
        // Roads plus the cheapest matching of odd crossings, computed independently.
        let (lengths, _) = planned("kuala_lumpur", 1);
        assert!((lengths[0] - 5104.38).abs() < 0.02, "{lengths:?}");
        let (lengths, _) = planned("hong_kong", 1);
        assert!(lengths[0] < 5213.25 * 1.001, "{lengths:?}");
    }

    #[test]
    fn teams_share_real_roads_evenly() {
        let (lengths, told) = planned("kuala_lumpur", 2);
        let longest = lengths.iter().copied().fold(0.0, f64::max);
        assert!(longest < 1.05 * 2552.2, "{lengths:?}");
        assert!((longest - told["makespan_m"].as_f64().unwrap()).abs() < 1e-6);
        let (lengths, _) = planned("hong_kong", 5);
        assert_eq!(lengths.len(), 5);
    }

    #[test]
    fn files_that_are_wrong_are_named() {
        let args = LineArgs {
            city: PathBuf::from("no-such-city"),
            k: 1,
            depot: None,
            steps: 0,
            out: PathBuf::from("unused"),
        };
        assert!(run(&args).unwrap_err().to_string().contains("node_data"));
    }
}
