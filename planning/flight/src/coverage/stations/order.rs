//! In which order a closed tour sees the pieces: points by the tour of §3.4, lines by
//! the postman's of §3.5 (D2.7).

use super::targets::{PointTarget, Stretch};
use crate::coverage::lines::{self, Line, Uav};
use crate::coverage::metric::Straight;
use crate::coverage::ring::LoopProblem;
use crate::coverage::ring::patch::{Corners, middle};
use crate::coverage::tour;
use skein_geometry::frame::Point;
use skein_geometry::math::atan2;
use std::collections::BTreeMap;

/// Points by a short closed tour, beginning near `launch`.
pub(super) fn of_points(points: &[PointTarget], launch: Point) -> Vec<usize> {
    let at: Vec<Point> = points.iter().map(|p| p.at).collect();
    by_places(&at, launch)
}

/// Places by a short closed tour, beginning near `launch`.
fn by_places(at: &[Point], launch: Point) -> Vec<usize> {
    let Some(first) = nearest(at, launch) else {
        return Vec::new();
    };
    let places: Vec<usize> = std::iter::once(first)
        .chain((0..at.len()).filter(|&i| i != first))
        .collect();
    tour::tour(&places, &Straight(at)).order
}

/// Pieces of lines in the order of one closed tour along all of them.
pub(super) fn of_lines(stretches: &[Stretch], launch: Point) -> Vec<usize> {
    let mut names = Names::default();
    let lines: Vec<Line> = stretches
        .iter()
        .map(|s| {
            let ends = (s.way[0], s.way[s.way.len() - 1]);
            let length_m: f64 = s.way.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
            Line::new(names.of(ends.0), names.of(ends.1), length_m)
        })
        .collect();
    let Some(depot) = nearest(&names.at, launch) else {
        return Vec::new();
    };
    let metric = Straight(&names.at);
    let plan = lines::plan(&lines, &[Uav::at(depot)], &metric, lines::DEFAULT_STEPS);
    let passes = plan.map(|p| {
        p.tours
            .into_iter()
            .flat_map(|t| t.passes)
            .collect::<Vec<_>>()
    });
    let mut order = Vec::new();
    for pass in passes.unwrap_or_default() {
        let s = &stretches[pass.line];
        let pieces = s.first..s.first + s.pieces;
        if pass.backward {
            order.extend(pieces.rev());
        } else {
            order.extend(pieces);
        }
    }
    order
}

/// Stations in an order of flight: as the postman comes by them first, or by a short tour
/// over their middles, whichever bends and flies less.
pub(super) fn of_bundles(
    stations: &[Corners],
    along: impl Iterator<Item = usize>,
    flown: &LoopProblem,
) -> Vec<usize> {
    let mut seen = vec![false; stations.len()];
    let first = along.filter(|&n| !std::mem::replace(&mut seen[n], true));
    let first: Vec<usize> = first.collect();
    let at: Vec<Point> = stations.iter().map(middle).collect();
    let tour = by_places(&at, flown.launch);
    let cost_m = |order: &[usize]| bent_m(order, &at, flown.turn_radius_m);
    if cost_m(&tour) < cost_m(&first) {
        tour
    } else {
        first
    }
}

/// Length of a closed tour over places in straight legs, and of its bends at this radius.
fn bent_m(order: &[usize], at: &[Point], turn_radius_m: f64) -> f64 {
    let n = order.len();
    let place = |i: usize| at[order[i % n]];
    let leg = |i: usize| place(i + 1) - place(i);
    let bend = |i: usize| {
        let (a, b) = (leg(i), leg(i + 1));
        atan2(a.perp(&b), a.dot(&b)).abs() * turn_radius_m
    };
    (0..n).map(|i| leg(i).norm() + bend(i)).sum()
}

/// Ways cut at every vertex that another way, or the same a second time, goes through.
pub(super) fn parted(ways: Vec<(Vec<Point>, f64)>) -> Vec<(Vec<Point>, f64)> {
    let mut names = Names::default();
    let mut uses: Vec<usize> = Vec::new();
    for (way, _) in &ways {
        for &p in way {
            let place = names.of(p);
            uses.resize(names.at.len(), 0);
            uses[place] += 1;
        }
    }
    let mut parts = Vec::with_capacity(ways.len());
    for (way, width_m) in ways {
        let mut part: Vec<Point> = Vec::new();
        for (i, &p) in way.iter().enumerate() {
            if part.last() == Some(&p) {
                continue;
            }
            part.push(p);
            let meets = uses[names.of(p)] > 1 || i + 1 == way.len();
            if part.len() > 1 && meets {
                parts.push((std::mem::replace(&mut part, vec![p]), width_m));
            }
        }
    }
    parts
}

fn nearest(at: &[Point], to: Point) -> Option<usize> {
    let gap = |i: &usize| (at[*i] - to).norm_squared();
    (0..at.len()).min_by(|a, b| gap(a).total_cmp(&gap(b)))
}

/// Places by where they are, to the millimetre.
#[derive(Default)]
struct Names {
    at: Vec<Point>,
    known: BTreeMap<(i64, i64), usize>,
}

impl Names {
    fn of(&mut self, p: Point) -> usize {
        #[allow(
            clippy::cast_possible_truncation,
            reason = "within 20 km of the origin"
        )]
        let key = ((p.x * 1000.0).round() as i64, (p.y * 1000.0).round() as i64);
        *self.known.entry(key).or_insert_with(|| {
            self.at.push(p);
            self.at.len() - 1
        })
    }
}
