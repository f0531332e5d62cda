//! What a mission may ask for besides an area: points and lines, and the pieces in
//! which they are seen (D2.7 §3.4, §3.5).
//!
//! The pieces belong to the mission, not to a planner: who plans and who judges cut
//! the same way.

use super::bundle::{Bundles, bundle};
use super::{StationsProblem, order};
use crate::coverage::lines::strip;
use crate::coverage::passes::Pass;
use crate::coverage::ring::LoopProblem;
use crate::coverage::ring::patch::Corners;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::atan2;
use skein_geometry::polyline::length_m;

/// A point to be looked at, with what lies around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointTarget {
    /// Where.
    pub at: Point,
    /// Radius of what is to be seen, metres; 0 for the point alone.
    pub radius_m: f64,
}

/// A line to be flown along: a road, a dike, a corridor.
#[derive(Clone, Debug, PartialEq)]
pub struct LineTarget {
    /// Its vertices in order; two at least.
    pub way: Vec<Point>,
    /// Width of what is to be seen along it, metres; 0 for the line alone.
    pub width_m: f64,
}

/// What a mission asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Targets {
    /// Points, seen in any order.
    Points(Vec<PointTarget>),
    /// Lines, seen along their whole length. Lines that share a vertex hang together.
    Lines(Vec<LineTarget>),
}

/// What the ends of passes may leave out, in lane widths; their pieces reach over it.
const END_LANES: f64 = 0.02;

/// Passes over an area as stations, in the order of flight: each cut to at most
/// `longest_m`, as wide as a lane.
fn of_passes(passes: &[Pass], lane_m: f64, longest_m: f64) -> Vec<Corners> {
    let mut stations = Vec::new();
    for pass in passes {
        let over = (pass.to - pass.from) / pass.length_m().max(1e-3) * (END_LANES * lane_m);
        let (from, to) = (pass.from - over, pass.to + over);
        let stretch = Stretch {
            way: vec![from, to],
            width_m: lane_m,
            first: 0,
            pieces: count((to - from).norm(), longest_m),
        };
        stations.extend(cut(&stretch));
    }
    stations
}

/// How many pieces a length is cut into.
fn count(length_m: f64, longest_m: f64) -> usize {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a cast of a float saturates"
    )]
    let pieces = (length_m / longest_m).ceil().max(1.0) as usize;
    pieces
}

/// One stretch of a line between places where lines meet, as a lane is flown.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Stretch {
    pub way: Vec<Point>,
    pub width_m: f64,
    /// The number of its first piece, and how many it has.
    pub first: usize,
    pub pieces: usize,
}

impl Targets {
    /// The pieces, each to be held by one frame: points as they are, lines in stretches
    /// of at most `longest_m`, corridors wider than that in lanes.
    #[must_use]
    pub fn pieces(&self, longest_m: f64) -> Vec<Corners> {
        match self {
            Self::Points(points) => points.iter().map(square).collect(),
            Self::Lines(lines) => stretches(lines, longest_m).iter().flat_map(cut).collect(),
        }
    }
}

impl<'a> StationsProblem<'a> {
    /// The pieces of targets, in the order in which one closed tour from the launch point
    /// sees them; pieces of lines that one frame holds together are one station.
    #[must_use]
    pub fn of_targets(flown: &'a LoopProblem, targets: &Targets) -> Self {
        let longest_m = flown.lane_spacing_m;
        let (stations, order) = match targets {
            Targets::Points(points) => (
                points.iter().map(square).collect(),
                order::of_points(points, flown.launch),
            ),
            Targets::Lines(lines) => {
                let stretches = stretches(lines, longest_m);
                let pieces: Vec<Corners> = stretches.iter().flat_map(cut).collect();
                let along = order::of_lines(&stretches, flown.launch);
                let Bundles { stations, of_piece } = bundle(&pieces, flown);
                let along = along.into_iter().map(|piece| of_piece[piece]);
                let order = order::of_bundles(&stations, along, flown);
                (stations, order)
            }
        };
        Self {
            flown,
            stations,
            order,
        }
    }

    /// Passes in their order, in pieces as long as a lane is wide.
    #[must_use]
    pub fn of_passes(flown: &'a LoopProblem, passes: &[Pass]) -> Self {
        let stations = of_passes(passes, flown.lane_spacing_m, flown.lane_spacing_m);
        Self {
            flown,
            order: (0..stations.len()).collect(),
            stations,
        }
    }
}

fn square(p: &PointTarget) -> Corners {
    let r = p.radius_m;
    [(-r, -r), (r, -r), (r, r), (-r, r)].map(|(x, y)| p.at + Vector::new(x, y))
}

/// Lines cut where they meet, corridors in lanes no wider than `longest_m`.
pub(super) fn stretches(lines: &[LineTarget], longest_m: f64) -> Vec<Stretch> {
    let narrow = |l: &&LineTarget| l.width_m <= longest_m;
    let ways: Vec<(Vec<Point>, f64)> = lines
        .iter()
        .filter(narrow)
        .map(|l| (l.way.clone(), l.width_m))
        .collect();
    let mut all = order::parted(ways);
    for line in lines.iter().filter(|l| !narrow(l)) {
        let lanes = strip::lanes(&line.way, line.width_m, longest_m).unwrap_or_default();
        #[allow(clippy::cast_precision_loss, reason = "at most strip::MAX_LANES")]
        let width_m = line.width_m / lanes.len().max(1) as f64;
        all.extend(lanes.into_iter().map(|way| (way, width_m)));
    }
    let mut first = 0;
    let mut stretches = Vec::with_capacity(all.len());
    for (way, width_m) in all {
        let length_m = length_m(&way);
        if length_m <= 0.0 {
            continue;
        }
        let pieces = count(length_m, longest_m);
        stretches.push(Stretch {
            way,
            width_m,
            first,
            pieces,
        });
        first += pieces;
    }
    stretches
}

/// The pieces of a stretch, of equal length along it: for each the rectangle along its
/// chord that holds it with its width.
fn cut(stretch: &Stretch) -> Vec<Corners> {
    #[allow(clippy::cast_precision_loss, reason = "a few thousand pieces")]
    let step_m = length_m(&stretch.way) / stretch.pieces as f64;
    let mut pieces = Vec::with_capacity(stretch.pieces);
    let mut piece = vec![stretch.way[0]];
    let mut left_m = step_m;
    for w in stretch.way.windows(2) {
        let (mut at, mut rest_m) = (w[0], (w[1] - w[0]).norm());
        while rest_m > left_m && pieces.len() + 1 < stretch.pieces {
            at += (w[1] - at) * (left_m / rest_m);
            rest_m -= left_m;
            left_m = step_m;
            piece.push(at);
            pieces.push(around(
                &std::mem::replace(&mut piece, vec![at]),
                stretch.width_m,
            ));
        }
        left_m -= rest_m;
        piece.push(w[1]);
    }
    pieces.push(around(&piece, stretch.width_m));
    pieces
}

/// The rectangle along the chord of a way that holds it, half its width to each side.
fn around(way: &[Point], width_m: f64) -> Corners {
    let (a, b) = (way[0], way[way.len() - 1]);
    let chord = if (b - a).norm() > 1e-3 {
        b - a
    } else {
        // Closed on itself: along its first edge.
        way.iter()
            .map(|p| p - a)
            .find(|v| v.norm() > 1e-3)
            .unwrap_or(Vector::new(1.0, 0.0))
    };
    let u = chord / chord.norm();
    let left = Vector::new(-u.y, u.x);
    let spread = |v: Vector| {
        way.iter()
            .map(|p| (p - a).dot(&v))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| {
                (l.min(x), h.max(x))
            })
    };
    let ((back, front), (right, over)) = (spread(u), spread(left));
    let half = width_m / 2.0;
    let corner = |along: f64, across: f64| a + u * along + left * across;
    [
        corner(back, right - half),
        corner(front, right - half),
        corner(front, over + half),
        corner(back, over + half),
    ]
}

/// The direction of a piece, as a heading.
pub(super) fn along(patch: &Corners) -> f64 {
    let u = patch[1] - patch[0];
    atan2(u.y, u.x)
}
