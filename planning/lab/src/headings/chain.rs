//! Shortest paths over the intervals of all waypoints: the bound of every
//! interval, and the best middles.

use super::air::Air;
use super::leg::{Arc, Leg};
use skein_geometry::frame::Vector;

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
    /// How loose the bound is at each waypoint, on the shortest way by bound.
    pub looseness: Vec<f64>,
    /// And for choices through a pair of neighbouring intervals, by leg.
    pub pairs: Vec<Table>,
    /// The intervals on the shortest way by length and by bound; empty when every
    /// choice is put aside.
    pub ways: [Vec<usize>; 2],
}

/// A table of one leg: rows are the intervals it leaves, columns those it reaches.
pub(super) struct Table {
    columns: usize,
    cells: Vec<f64>,
}

impl Table {
    fn infinite(rows: usize, columns: usize) -> Self {
        Self {
            columns,
            cells: vec![f64::INFINITY; rows * columns],
        }
    }

    fn row(&self, i: usize) -> &[f64] {
        &self.cells[i * self.columns..(i + 1) * self.columns]
    }

    fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.cells.chunks(self.columns.max(1))
    }
}

/// What the round before found about pairs of parents.
#[derive(Default)]
pub(super) struct Known {
    pub pairs: Vec<Table>,
    /// Pairs at least this long are put aside.
    pub wanted: f64,
}

impl Known {
    pub fn aside(&self, leg: usize, a: &Arc, b: &Arc) -> bool {
        self.pairs
            .get(leg)
            .is_some_and(|t| t.row(a.parent)[b.parent] >= self.wanted)
    }
}

/// All legs between all intervals.
struct Tables {
    bounds: Vec<Table>,
    lengths: Vec<Table>,
    /// Slopes paid, by waypoint; a loop's first waypoint comes again at the end.
    paid: Vec<Vec<f64>>,
    /// Slopes for the first waypoint in the next round.
    first: Vec<f64>,
}

impl Layers {
    /// Solves the chain of `legs` over `layers`; `slopes` are those of the first
    /// layer, used when the chain is closed.
    pub fn solve(
        air: &Air,
        legs: &[Vector],
        layers: &[Vec<Arc>],
        ends: Ends,
        slopes: &[f64],
        known: &Known,
    ) -> Self {
        let tables = Tables::new(air, legs, layers, ends, slopes, known);
        let starts: Vec<Vec<f64>> = starts(layers[0].len(), ends);
        let mut through: Vec<Vec<f64>> = layers
            .iter()
            .map(|l| vec![f64::INFINITY; l.len()])
            .collect();
        let mut pairs: Vec<Table> = tables
            .bounds
            .iter()
            .zip(layers)
            .map(|(t, l)| Table::infinite(l.len(), t.columns))
            .collect();
        for start in &starts {
            let ahead = forward(&tables.bounds, start);
            let behind = backward(&tables.bounds, &ends_at(start, ends, layers));
            for (t, (f, b)) in through.iter_mut().zip(ahead.iter().zip(&behind)) {
                for (t, (f, b)) in t.iter_mut().zip(f.iter().zip(b)) {
                    *t = t.min(f + b);
                }
            }
            for (i, (pair, table)) in pairs.iter_mut().zip(&tables.bounds).enumerate() {
                through_pairs(pair, table, &ahead[i], &behind[i + 1]);
            }
        }
        let by_length = shortest_way(&tables.lengths, &starts, ends, layers);
        let by_bound = shortest_way(&tables.bounds, &starts, ends, layers);
        let least = through[0].iter().copied().fold(f64::INFINITY, f64::min);
        Self {
            least,
            through,
            pairs,
            looseness: looseness(air, legs, layers, &tables, &by_bound),
            slopes: tables.first,
            ways: [by_length, by_bound],
        }
    }
}

/// Lowers `pair` to the cost of the ways through each cell of `table`.
fn through_pairs(pair: &mut Table, table: &Table, ahead: &[f64], behind: &[f64]) {
    let columns = table.columns.max(1);
    let rows = pair.cells.chunks_mut(columns).zip(table.rows());
    for ((p, t), f) in rows.zip(ahead) {
        if *f < f64::INFINITY {
            for ((p, t), b) in p.iter_mut().zip(t).zip(behind) {
                *p = p.min(f + t + b);
            }
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

impl Tables {
    /// An interval's slope is that of the way on which the bound reaches it, so that
    /// the bound along good ways is one of second order.
    fn new(
        air: &Air,
        legs: &[Vector],
        layers: &[Vec<Arc>],
        ends: Ends,
        first: &[f64],
        known: &Known,
    ) -> Self {
        let at_ends = |n: usize| match ends {
            Ends::Open => vec![0.0; n],
            Ends::Closed => first.to_vec(),
        };
        let mut tables = Self {
            bounds: Vec::with_capacity(legs.len()),
            lengths: Vec::with_capacity(legs.len()),
            paid: vec![at_ends(layers[0].len())],
            first: vec![0.0; layers[0].len()],
        };
        let mut reached = vec![0.0; layers[0].len()];
        let mut made: Vec<(usize, usize, Leg)> = Vec::new();
        for (i, v) in legs.iter().enumerate() {
            let (from, to) = (&layers[i], &layers[(i + 1) % layers.len()]);
            let slopes = &tables.paid[i];
            let mut lengths = Table::infinite(from.len(), to.len());
            let mut best = vec![(f64::INFINITY, 0.0); to.len()];
            made.clear();
            for (j, a) in from.iter().enumerate() {
                for (k, b) in to.iter().enumerate() {
                    if known.aside(i, a, b) {
                        continue;
                    }
                    let leg = air.leg(*v, a, b);
                    let (low, last) = leg.open_bound(a, slopes[j]);
                    if reached[j] + low < best[k].0 {
                        best[k] = (reached[j] + low, last);
                    }
                    lengths.cells[j * to.len() + k] = leg.length;
                    made.push((j, k, leg));
                }
            }
            let found: Vec<f64> = best.iter().map(|b| b.1).collect();
            let next = if i + 1 == legs.len() {
                at_ends(to.len())
            } else {
                found.clone()
            };
            let mut bounds = Table::infinite(from.len(), to.len());
            let mut costs = vec![f64::INFINITY; to.len()];
            for (j, k, leg) in &made {
                let (j, k) = (*j, *k);
                let least = leg.bound(*v, &from[j], slopes[j], &to[k], next[k]);
                costs[k] = costs[k].min(reached[j] + least);
                bounds.cells[j * to.len() + k] = least;
            }
            if ends == Ends::Closed && i + 1 == legs.len() {
                tables.first = found;
            }
            tables.bounds.push(bounds);
            tables.lengths.push(lengths);
            tables.paid.push(next);
            reached = costs;
        }
        tables
    }
}

/// Least cost of reaching each interval of each layer.
fn forward(tables: &[Table], start: &[f64]) -> Vec<Vec<f64>> {
    let mut costs = vec![start.to_vec()];
    for (i, table) in tables.iter().enumerate() {
        let mut next = vec![f64::INFINITY; table.columns];
        for (cost, row) in costs[i].iter().zip(table.rows()) {
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
fn backward(tables: &[Table], end: &[f64]) -> Vec<Vec<f64>> {
    let mut costs = vec![end.to_vec()];
    for table in tables.iter().rev() {
        let after = &costs[costs.len() - 1];
        let least = |row: &[f64]| {
            row.iter()
                .zip(after)
                .fold(f64::INFINITY, |n, (c, a)| n.min(c + a))
        };
        costs.push(table.rows().map(least).collect());
    }
    costs.reverse();
    costs
}

/// The intervals on the shortest way through the tables.
fn shortest_way(
    tables: &[Table],
    starts: &[Vec<f64>],
    ends: Ends,
    layers: &[Vec<Arc>],
) -> Vec<usize> {
    let mut best = (f64::INFINITY, Vec::new());
    for start in starts {
        let behind = backward(tables, &ends_at(start, ends, layers));
        let first = (0..start.len())
            .min_by(|&a, &b| (start[a] + behind[0][a]).total_cmp(&(start[b] + behind[0][b])))
            .unwrap_or(0);
        let cost = start[first] + behind[0][first];
        if cost < best.0 {
            best = (cost, follow(tables, &behind, first));
        }
    }
    best.1
}

/// The middles of the intervals on a way, radians.
pub(super) fn middles(way: &[usize], layers: &[Vec<Arc>]) -> Vec<f64> {
    way.iter()
        .zip(layers)
        .map(|(&j, layer)| layer[j].mid_rad)
        .collect()
}

/// How loose the bound is at each waypoint of a way.
fn looseness(
    air: &Air,
    legs: &[Vector],
    layers: &[Vec<Arc>],
    tables: &Tables,
    way: &[usize],
) -> Vec<f64> {
    let mut loose = vec![0.0; layers.len()];
    for (i, v) in legs.iter().enumerate() {
        let next = (i + 1) % layers.len();
        let (Some(&a), Some(&b)) = (way.get(i), way.get(i + 1)) else {
            continue;
        };
        let (from, to) = (&layers[i][a], &layers[next][b]);
        let bound = tables.bounds[i].row(a)[b];
        let leg = air.leg(*v, from, to);
        let paid = (tables.paid[i][a], tables.paid[i + 1][b]);
        let (first, last) = leg.looseness(bound, (from, paid.0), (to, paid.1));
        loose[i] += first;
        loose[next] += last;
    }
    loose
}

/// The intervals a shortest way passes, from interval `first` on.
fn follow(tables: &[Table], behind: &[Vec<f64>], first: usize) -> Vec<usize> {
    let mut at = first;
    let mut way = vec![at];
    for (table, after) in tables.iter().zip(&behind[1..]) {
        let row = table.row(at);
        at = (0..table.columns)
            .min_by(|&a, &b| (row[a] + after[a]).total_cmp(&(row[b] + after[b])))
            .unwrap_or(0);
        way.push(at);
    }
    way
}
