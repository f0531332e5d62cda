//! Exact cell decompositions of an area with holes (D2.7 §3.6.1): the classical one into
//! trapezoids, and the boustrophedon one (Choset and Pignon, "Coverage path planning: the
//! boustrophedon cellular decomposition", 1998,
//! <https://doi.org/10.1007/978-1-4471-1273-0_32>).
//!
//! A line sweeps the turned frame from left to right. Between two neighbouring events
//! (vertices, crossings of borders) the free parts of the line are trapezoids; at an
//! event they are linked where they touch along a piece of the line. What follows is
//! D2.7's table of events:
//!
//! | links | event | boustrophedon | trapezoidal |
//! |---|---|---|---|
//! | one to several | In | one cell closes, several open | the same |
//! | several to one | Out | several cells close, one opens | the same |
//! | one to one | Middle | the cell goes on | goes on if floor and ceiling do, else a new one |
//! | none to one, one to none | begin, end | a cell opens, closes | the same |
//!
//! # Guarantees
//! Cells have no common inner points and together are the free space, up to slivers
//! thinner than a few micrometres. The line meets every cell in one piece. There are
//! never more boustrophedon cells than trapezoids.
//!
//! # Complexity
//! O((n + c) a log a) for n edges, c crossings of borders and a edges on the line at
//! most, plus the pairs of edges whose extents in `x` overlap.

use super::frame::{Edge, Kind, SAME_M, snap};
use skein_geometry::frame::Point;

/// Which decomposition.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Decomposition {
    /// Cells that the sweep line meets in one piece.
    #[default]
    Boustrophedon,
    /// Trapezoids and triangles.
    Trapezoidal,
}

/// A part of a cell between two events, or several with the same floor and ceiling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slice {
    pub(super) left: f64,
    pub(super) right: f64,
    pub(super) floor: Edge,
    pub(super) ceiling: Edge,
}

impl Slice {
    /// Area, square metres.
    fn area_m2(&self) -> f64 {
        let (a, b) = (self.gap_m(self.left), self.gap_m(self.right));
        (self.right - self.left) * (a + b) / 2.0
    }

    fn gap_m(&self, x: f64) -> f64 {
        (self.ceiling.y_at(x) - self.floor.y_at(x)).max(0.0)
    }
}

/// A cell: slices from left to right, each beginning where the one before ends.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Cell {
    pub(super) slices: Vec<Slice>,
}

impl Cell {
    pub(super) fn left(&self) -> f64 {
        self.slices.first().map_or(0.0, |s| s.left)
    }

    pub(super) fn right(&self) -> f64 {
        self.slices.last().map_or(0.0, |s| s.right)
    }

    pub(super) fn area_m2(&self) -> f64 {
        self.slices.iter().map(Slice::area_m2).sum()
    }

    /// The ring round the cell in the turned frame, counter-clockwise.
    pub(super) fn ring(&self) -> Vec<Point> {
        let mut ring: Vec<Point> = Vec::new();
        let mut push = |p: Point| {
            if ring.last().is_none_or(|q| (p - *q).norm() > SAME_M) {
                ring.push(p);
            }
        };
        for s in &self.slices {
            push(Point::new(s.left, s.floor.y_at(s.left)));
            push(Point::new(s.right, s.floor.y_at(s.right)));
        }
        for s in self.slices.iter().rev() {
            push(Point::new(s.right, s.ceiling.y_at(s.right)));
            push(Point::new(s.left, s.ceiling.y_at(s.left)));
        }
        if ring.len() > 1 && (ring[0] - ring[ring.len() - 1]).norm() <= SAME_M {
            ring.pop();
        }
        ring
    }
}

/// A free part of the sweep line between two events.
#[derive(Clone, Copy, Debug)]
struct Part {
    floor: usize,
    ceiling: usize,
    /// The cell it belongs to.
    cell: usize,
}

/// Decomposes what lies inside an area ring and outside all holes and zones.
pub(super) fn decompose(edges: &[Edge], kind: Decomposition) -> Vec<Cell> {
    let events = events(edges);
    let mut order: Vec<usize> = (0..edges.len()).collect();
    order.sort_by(|&a, &b| edges[a].left.x.total_cmp(&edges[b].left.x).then(a.cmp(&b)));
    let mut coming = order.into_iter().peekable();
    let mut active: Vec<usize> = Vec::new();
    let mut heights: Vec<(f64, f64, usize)> = Vec::new();
    let mut cells: Vec<Cell> = Vec::new();
    let mut before: Vec<Part> = Vec::new();
    for pair in events.windows(2) {
        let (left, right) = (pair[0], pair[1]);
        active.retain(|&e| edges[e].right.x > left);
        while let Some(&e) = coming.peek() {
            if edges[e].left.x > left {
                break;
            }
            active.push(e);
            coming.next();
        }
        let middle = left.midpoint(right);
        heights.clear();
        heights.extend(active.iter().map(|&e| {
            let edge = &edges[e];
            let slope = (edge.right.y - edge.left.y) / (edge.right.x - edge.left.x);
            (edge.y_at(middle), slope, e)
        }));
        heights.sort_by(|a, b| {
            (a.0.total_cmp(&b.0))
                .then(a.1.total_cmp(&b.1))
                .then(a.2.cmp(&b.2))
        });
        let mut parts = free_parts(edges, &heights, left, right);
        link(edges, &before, &mut parts, (left, right), kind, &mut cells);
        before = parts;
    }
    cells
}

/// The places at which the order of the edges on the line may change.
fn events(edges: &[Edge]) -> Vec<f64> {
    let mut xs: Vec<f64> = edges.iter().flat_map(|e| [e.left.x, e.right.x]).collect();
    let mut order: Vec<usize> = (0..edges.len()).collect();
    order.sort_by(|&a, &b| edges[a].left.x.total_cmp(&edges[b].left.x));
    for (i, &a) in order.iter().enumerate() {
        for &b in &order[i + 1..] {
            if edges[b].left.x >= edges[a].right.x {
                break;
            }
            // Grown zones are disjoint already.
            if edges[a].kind == Kind::Zone && edges[b].kind == Kind::Zone {
                continue;
            }
            xs.extend(crossing(&edges[a], &edges[b]));
        }
    }
    xs.sort_by(f64::total_cmp);
    xs.dedup_by(|a, b| a.total_cmp(b).is_eq());
    xs
}

/// Where two edges cross inside both of their extents, on the grid.
fn crossing(a: &Edge, b: &Edge) -> Option<f64> {
    let left = a.left.x.max(b.left.x);
    let right = a.right.x.min(b.right.x);
    let from = a.y_at(left) - b.y_at(left);
    let to = a.y_at(right) - b.y_at(right);
    if from * to >= 0.0 {
        return None;
    }
    Some(snap(left + (right - left) * (from / (from - to))))
}

fn free_parts(edges: &[Edge], heights: &[(f64, f64, usize)], left: f64, right: f64) -> Vec<Part> {
    let mut parts = Vec::new();
    let (mut area, mut hole, mut zone) = (0, 0, 0);
    let mut floor = None;
    for &(_, _, e) in heights {
        let edge = &edges[e];
        match edge.kind {
            Kind::Area => area += edge.step,
            Kind::Hole => hole += edge.step,
            Kind::Zone => zone += edge.step,
        }
        let free = area > 0 && hole <= 0 && zone <= 0;
        match (floor, free) {
            (None, true) => floor = Some(e),
            (Some(f), false) => {
                let gap_m = |x: f64| edge.y_at(x) - edges[f].y_at(x);
                if gap_m(left).max(gap_m(right)) > SAME_M {
                    parts.push(Part {
                        floor: f,
                        ceiling: e,
                        cell: usize::MAX,
                    });
                }
                floor = None;
            }
            _ => {}
        }
    }
    parts
}

/// Gives each part a cell: the one it goes on with, or a new one.
fn link(
    edges: &[Edge],
    before: &[Part],
    parts: &mut [Part],
    (left, right): (f64, f64),
    kind: Decomposition,
    cells: &mut Vec<Cell>,
) {
    let span = |p: &Part| (edges[p.floor].y_at(left), edges[p.ceiling].y_at(left));
    let touch = |p: &Part, q: &Part| {
        let (a, b) = (span(p), span(q));
        a.1.min(b.1) - a.0.max(b.0) > SAME_M
    };
    // Both lists are ordered from below: one walk finds all contacts.
    let mut behind = vec![0u32; before.len()];
    let mut links: Vec<(u32, usize)> = vec![(0, usize::MAX); parts.len()];
    let mut first = 0;
    for (q, link) in parts.iter().zip(&mut links) {
        let low = span(q).0;
        while first < before.len() && span(&before[first]).1 <= low {
            first += 1;
        }
        let high = span(q).1;
        for (i, p) in before.iter().enumerate().skip(first) {
            if span(p).0 >= high {
                break;
            }
            if touch(p, q) {
                behind[i] += 1;
                *link = (link.0 + 1, i);
            }
        }
    }
    for (q, (count, p)) in parts.iter_mut().zip(links) {
        let goes_on = count == 1
            && behind[p] == 1
            && match kind {
                Decomposition::Boustrophedon => true,
                Decomposition::Trapezoidal => {
                    before[p].floor == q.floor && before[p].ceiling == q.ceiling
                }
            };
        let slice = Slice {
            left,
            right,
            floor: edges[q.floor],
            ceiling: edges[q.ceiling],
        };
        if !goes_on {
            q.cell = cells.len();
            cells.push(Cell {
                slices: vec![slice],
            });
            continue;
        }
        let old = before[p];
        q.cell = old.cell;
        let slices = &mut cells[q.cell].slices;
        match slices.last_mut() {
            Some(last) if old.floor == q.floor && old.ceiling == q.ceiling => last.right = right,
            _ => slices.push(slice),
        }
    }
}

#[cfg(test)]
mod tests;
