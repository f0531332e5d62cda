//! Shortest paths over the intervals of all waypoints: the bound of every
//! interval, and the best middles.

use super::leg::{Arc, Leg};
use crate::frame::Vector;

/// Whether the last layer joins the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ends {
    Open,
    Closed,
}

/// One round's answer, turn radii.
pub(super) struct Layers {
    /// Every choice of headings within the intervals is at least as long.
    pub least: f64,
    /// The same for choices through an interval, by waypoint and interval.
    pub through: Vec<Vec<f64>>,
    /// Slopes paid at the first waypoint, for the next round.
    pub slopes: Vec<f64>,
    /// The best middles, radians.
    pub headings: Vec<f64>,
}

/// A table of one leg: rows are the intervals it leaves, columns those it reaches.
struct Table {
    columns: usize,
    bound: Vec<f64>,
    length: Vec<f64>,
}

impl Layers {
    /// Solves the chain of `legs` over `layers`; `slopes` are those of the first
    /// layer, used when the chain is closed.
    pub fn solve(legs: &[Vector], layers: &[Vec<Arc>], ends: Ends, slopes: &[f64]) -> Self {
        let (tables, slopes) = tables(legs, layers, ends, slopes);
        let bounds: Vec<(&[f64], usize)> = tables
            .iter()
            .map(|t| (t.bound.as_slice(), t.columns))
            .collect();
        let starts: Vec<Vec<f64>> = starts(layers[0].len(), ends);
        let mut through: Vec<Vec<f64>> = layers
            .iter()
            .map(|l| vec![f64::INFINITY; l.len()])
            .collect();
        for start in &starts {
            let ahead = forward(&bounds, start);
            let behind = backward(&bounds, &ends_at(start, ends, layers));
            for (t, (f, b)) in through.iter_mut().zip(ahead.iter().zip(&behind)) {
                for (t, (f, b)) in t.iter_mut().zip(f.iter().zip(b)) {
                    *t = t.min(f + b);
                }
            }
        }
        let least = through[0].iter().copied().fold(f64::INFINITY, f64::min);
        Self {
            least,
            through,
            slopes,
            headings: best_middles(&tables, &starts, ends, layers),
        }
    }
}

/// Start costs to try: one for all in an open chain, one for each interval of the
/// first waypoint in a closed one, which must end where it began.
fn starts(first: usize, ends: Ends) -> Vec<Vec<f64>> {
    match ends {
        Ends::Open => vec![vec![0.0; first]],
        Ends::Closed => (0..first)
            .map(|s| {
                let mut costs = vec![f64::INFINITY; first];
                costs[s] = 0.0;
                costs
            })
            .collect(),
    }
}

fn ends_at(start: &[f64], ends: Ends, layers: &[Vec<Arc>]) -> Vec<f64> {
    match ends {
        Ends::Open => vec![0.0; layers[layers.len() - 1].len()],
        Ends::Closed => start.to_vec(),
    }
}

/// All legs between all intervals. An interval's slope is that of the shortest way
/// to its middle, so that the bound along good ways is one of second order.
fn tables(
    legs: &[Vector],
    layers: &[Vec<Arc>],
    ends: Ends,
    first: &[f64],
) -> (Vec<Table>, Vec<f64>) {
    let mut reached = vec![0.0; layers[0].len()];
    let mut slopes = match ends {
        Ends::Open => vec![0.0; layers[0].len()],
        Ends::Closed => first.to_vec(),
    };
    let mut made = Vec::new();
    let mut tables = Vec::with_capacity(legs.len());
    let mut last_slopes = Vec::new();
    for (i, v) in legs.iter().enumerate() {
        let (from, to) = (&layers[i], &layers[(i + 1) % layers.len()]);
        made.clear();
        let mut best = vec![(f64::INFINITY, 0.0); to.len()];
        for (a, cost) in from.iter().zip(&reached) {
            for (b, best) in to.iter().zip(&mut best) {
                let leg = Leg::new(*v, a, b);
                if cost + leg.length < best.0 {
                    *best = (cost + leg.length, leg.slope);
                }
                made.push(leg);
            }
        }
        let found: Vec<f64> = best.iter().map(|b| b.1).collect();
        let next = match (i + 1 == legs.len(), ends) {
            (true, Ends::Open) => vec![0.0; to.len()],
            (true, Ends::Closed) => first.to_vec(),
            (false, _) => found.clone(),
        };
        last_slopes = found;
        let mut bound = Vec::with_capacity(made.len());
        for (leg, k) in made.iter().zip(0..) {
            let (a, b) = (k / to.len(), k % to.len());
            bound.push(leg.bound(*v, &from[a], slopes[a], &to[b], next[b]));
        }
        tables.push(Table {
            columns: to.len(),
            bound,
            length: made.iter().map(|l| l.length).collect(),
        });
        reached = best.iter().map(|b| b.0).collect();
        slopes = next;
    }
    let slopes = match ends {
        Ends::Open => vec![0.0; layers[0].len()],
        Ends::Closed => last_slopes,
    };
    (tables, slopes)
}

/// Least cost of reaching each interval of each layer.
fn forward(tables: &[(&[f64], usize)], start: &[f64]) -> Vec<Vec<f64>> {
    let mut costs = vec![start.to_vec()];
    for (i, (table, columns)) in tables.iter().enumerate() {
        let mut next = vec![f64::INFINITY; *columns];
        for (cost, row) in costs[i].iter().zip(table.chunks(*columns)) {
            if *cost < f64::INFINITY {
                for (n, c) in next.iter_mut().zip(row) {
                    *n = n.min(cost + c);
                }
            }
        }
        costs.push(next);
    }
    costs
}

/// Least cost of going on from each interval of each layer.
fn backward(tables: &[(&[f64], usize)], end: &[f64]) -> Vec<Vec<f64>> {
    let mut costs = vec![end.to_vec()];
    for (table, columns) in tables.iter().rev() {
        let after = &costs[costs.len() - 1];
        let next = table
            .chunks(*columns)
            .map(|row| {
                row.iter()
                    .zip(after)
                    .fold(f64::INFINITY, |n, (c, a)| n.min(c + a))
            })
            .collect();
        costs.push(next);
    }
    costs.reverse();
    costs
}

/// The middles of the shortest chain among all middles.
fn best_middles(
    tables: &[Table],
    starts: &[Vec<f64>],
    ends: Ends,
    layers: &[Vec<Arc>],
) -> Vec<f64> {
    let lengths: Vec<(&[f64], usize)> = tables
        .iter()
        .map(|t| (t.length.as_slice(), t.columns))
        .collect();
    let mut best = (f64::INFINITY, Vec::new());
    for start in starts {
        let behind = backward(&lengths, &ends_at(start, ends, layers));
        let first = (0..start.len())
            .min_by(|&a, &b| (start[a] + behind[0][a]).total_cmp(&(start[b] + behind[0][b])))
            .unwrap_or(0);
        let cost = start[first] + behind[0][first];
        if cost < best.0 {
            best = (cost, follow(tables, &behind, first));
        }
    }
    let mut chosen = best.1;
    chosen.truncate(layers.len());
    chosen
        .iter()
        .zip(layers)
        .map(|(&j, layer)| layer[j].mid_rad)
        .collect()
}

/// The intervals a shortest way passes, from interval `first` on.
fn follow(tables: &[Table], behind: &[Vec<f64>], first: usize) -> Vec<usize> {
    let mut at = first;
    let mut way = vec![at];
    for (table, after) in tables.iter().zip(&behind[1..]) {
        let row = &table.length[at * table.columns..(at + 1) * table.columns];
        at = (0..table.columns)
            .min_by(|&a, &b| (row[a] + after[a]).total_cmp(&(row[b] + after[b])))
            .unwrap_or(0);
        way.push(at);
    }
    way
}
