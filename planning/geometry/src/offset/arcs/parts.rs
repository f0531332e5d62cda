//! The candidates of an exact outline, cut where they meet, and joined (D2.7 §2.3.1).
//!
//! Which parts are kept is decided by distance alone; whether the loops mean what
//! they should is left to the proof in [`super`].

use super::super::boxes::{Bounds, overlaps, overlaps_between, sort};
use super::super::shape::{Shape, small};
use super::{Piece, turn_rad};
use crate::frame::{Point, Vector};
use crate::math::{PI, TAU};
use crate::polygon::point_to_line_m;

/// A candidate this much nearer than its radius is inside, metres; coordinates are
/// taken from the middle of a cluster, where a unit in the last place is a picometre.
const INSIDE_M: f64 = 1e-11;

/// Ends of pieces that are one point are this near, metres.
const JOIN_M: f64 = 1e-6;

/// Pieces shorter than this are left out, metres.
const SHORTEST_M: f64 = 1e-9;

/// Slack of the ends of a candidate when it is cut, as a share of it: a cut too many
/// changes nothing.
const END_SHARE: f64 = 1e-9;

/// A line or an arc that may be part of the outline, before it is cut.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) piece: Piece,
    pub(super) turn_rad: f64,
}

impl Candidate {
    pub(super) fn bounds(&self, id: u32, radius_m: f64) -> Bounds {
        match self.piece {
            Piece::Line { from, to } => Bounds::of(from, to, id),
            Piece::Arc { centre, .. } => Bounds::of(centre, centre, id).grown(radius_m),
        }
    }

    fn length_m(&self, radius_m: f64) -> f64 {
        match self.piece {
            Piece::Line { from, to } => (to - from).norm(),
            Piece::Arc { .. } => self.turn_rad * radius_m,
        }
    }

    /// The share of the way at which `p`, a point of the whole line or circle, lies;
    /// `None` beyond the ends.
    fn share(&self, p: Point) -> Option<f64> {
        let share = match self.piece {
            Piece::Line { from, to } => {
                let along = to - from;
                (p - from).dot(&along) / along.norm_squared()
            }
            Piece::Arc { centre, from, .. } => {
                let turn = turn_rad(from - centre, p - centre);
                // Just before the begin is nearly a whole turn after it.
                let turn = if turn > TAU - END_SHARE { 0.0 } else { turn };
                turn / self.turn_rad
            }
        };
        (-END_SHARE..=1.0 + END_SHARE)
            .contains(&share)
            .then(|| share.clamp(0.0, 1.0))
    }

    fn part(&self, from: f64, to: f64) -> Piece {
        let (a, b) = (self.piece.at(from), self.piece.at(to));
        match self.piece {
            Piece::Line { .. } => Piece::Line { from: a, to: b },
            Piece::Arc { centre, .. } => Piece::Arc {
                centre,
                from: a,
                to: b,
            },
        }
    }
}

/// A part of a candidate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    piece: Piece,
    /// Which candidate, to put together what needed no cut.
    of: usize,
}

/// The parts of candidates that keep the radius from all shapes.
pub(super) fn candidates(shapes: &[&Shape], radius_m: f64) -> Vec<Part> {
    let origin = shapes[0].rings[0].points[0].coords;
    let mut all = Vec::new();
    for ring in shapes.iter().flat_map(|s| &s.rings) {
        let local: Vec<Point> = ring.points.iter().map(|p| p - origin).collect();
        outward(&local, radius_m, &mut all);
    }
    let mut cuts: Vec<Vec<f64>> = vec![Vec::new(); all.len()];
    let mut boxes: Vec<Bounds> = all
        .iter()
        .enumerate()
        .map(|(i, c)| c.bounds(small(i), radius_m))
        .collect();
    sort(&mut boxes);
    let done: Result<(), ()> = overlaps(&boxes, |i, j| {
        let (a, b) = (&all[i as usize], &all[j as usize]);
        for p in meetings(a, b, radius_m).into_iter().flatten() {
            if let (Some(s), Some(t)) = (a.share(p), b.share(p)) {
                cuts[i as usize].push(s);
                cuts[j as usize].push(t);
            }
        }
        Ok(())
    });
    debug_assert!(done.is_ok());
    let mut parts = Vec::new();
    for (of, (c, cuts)) in all.iter().zip(&mut cuts).enumerate() {
        cuts.push(1.0);
        cuts.sort_by(f64::total_cmp);
        let shortest = SHORTEST_M / c.length_m(radius_m).max(SHORTEST_M);
        let mut from = 0.0;
        for &to in cuts.iter() {
            if to - from > shortest {
                let piece = c.part(from, to);
                parts.push(Part { piece, of });
                from = to;
            }
        }
    }
    keep_clear(shapes, origin, &mut parts, radius_m);
    for p in &mut parts {
        shift(&mut p.piece, origin);
    }
    parts
}

/// Edges moved outward and arcs round convex corners of one ring.
fn outward(ring: &[Point], radius_m: f64, all: &mut Vec<Candidate>) {
    let n = ring.len();
    let right = |i: usize| {
        let d = (ring[(i + 1) % n] - ring[i % n]).normalize();
        Vector::new(d.y, -d.x) * radius_m
    };
    let mut before = right(n - 1);
    for i in 0..n {
        let after = right(i);
        let turn = turn_rad(before, after);
        // A full reversal turns either way; outward is never wrong.
        if turn > 0.0 && turn <= PI + 1e-9 {
            all.push(Candidate {
                piece: Piece::Arc {
                    centre: ring[i],
                    from: ring[i] + before,
                    to: ring[i] + after,
                },
                turn_rad: turn,
            });
        }
        all.push(Candidate {
            piece: Piece::Line {
                from: ring[i] + after,
                to: ring[(i + 1) % n] + after,
            },
            turn_rad: 0.0,
        });
        before = after;
    }
}

/// Where two candidates, prolonged to a line and a circle, meet.
fn meetings(a: &Candidate, b: &Candidate, radius_m: f64) -> [Option<Point>; 2] {
    match (a.piece, b.piece) {
        (Piece::Line { from, to }, Piece::Line { from: c, to: d }) => {
            let (u, v) = (to - from, d - c);
            let square = u.perp(&v);
            if square.abs() <= 1e-12 * u.norm() * v.norm() {
                return [None, None];
            }
            [Some(from + u * ((c - from).perp(&v) / square)), None]
        }
        (Piece::Line { from, to }, Piece::Arc { centre, .. })
        | (Piece::Arc { centre, .. }, Piece::Line { from, to }) => {
            if tangent(&a.piece, &b.piece) || tangent(&b.piece, &a.piece) {
                return [None, None];
            }
            let along = (to - from).normalize();
            let foot = from + along * (centre - from).dot(&along);
            around(
                foot,
                along,
                radius_m * radius_m - (foot - centre).norm_squared(),
            )
        }
        (Piece::Arc { centre, .. }, Piece::Arc { centre: other, .. }) => {
            let between = other - centre;
            let square = between.norm_squared();
            if square <= 0.0 {
                return [None, None];
            }
            let across = Vector::new(-between.y, between.x) / square.sqrt();
            around(
                centre + between / 2.0,
                across,
                radius_m * radius_m - square / 4.0,
            )
        }
    }
}

/// Whether `b` goes on where `a` ends: an edge and the arc at its corner, which touch
/// there and meet nowhere else.
fn tangent(a: &Piece, b: &Piece) -> bool {
    (a.to() - b.from()).norm_squared() <= 0.0
}

/// The two points at the root of `square` from `middle`.
fn around(middle: Point, along: Vector, square: f64) -> [Option<Point>; 2] {
    if square > 0.0 {
        let half = along * square.sqrt();
        [Some(middle - half), Some(middle + half)]
    } else {
        [None, None]
    }
}

/// Drops parts whose middle is nearer to a shape than the radius.
fn keep_clear(shapes: &[&Shape], origin: Vector, parts: &mut Vec<Part>, radius_m: f64) {
    let mut clear = vec![true; parts.len()];
    let mut middles: Vec<Bounds> = parts
        .iter()
        .enumerate()
        .map(|(i, p)| Bounds::of(p.piece.at(0.5), p.piece.at(0.5), small(i)))
        .collect();
    sort(&mut middles);
    let least = radius_m - INSIDE_M;
    for ring in shapes.iter().flat_map(|s| &s.rings) {
        let edges: Vec<(Point, Point)> = ring
            .edges()
            .map(|(a, b)| (a - origin, b - origin))
            .collect();
        let mut near: Vec<Bounds> = edges
            .iter()
            .enumerate()
            .map(|(i, e)| Bounds::of(e.0, e.1, small(i)).grown(radius_m))
            .collect();
        sort(&mut near);
        let done: Result<(), ()> = overlaps_between(&near, &middles, |e, m| {
            let (a, b) = edges[e.id as usize];
            let at = Point::new(m.west, m.south);
            if clear[m.id as usize] && point_to_line_m(at, a, b) < least {
                clear[m.id as usize] = false;
            }
            Ok(())
        });
        debug_assert!(done.is_ok());
    }
    let mut i = 0;
    parts.retain(|p| {
        i += 1;
        clear[i - 1] && !shapes.iter().any(|s| s.contains(p.piece.at(0.5) + origin))
    });
}

/// Joins parts end to begin into closed loops; `None` if an end has no begin.
pub(super) fn join(parts: &[Part]) -> Option<Vec<Vec<Piece>>> {
    let mut begins: Vec<Bounds> = parts
        .iter()
        .enumerate()
        .map(|(i, p)| Bounds::of(p.piece.from(), p.piece.from(), small(i)))
        .collect();
    let mut ends: Vec<Bounds> = parts
        .iter()
        .enumerate()
        .map(|(i, p)| Bounds::of(p.piece.to(), p.piece.to(), small(i)).grown(JOIN_M))
        .collect();
    sort(&mut begins);
    sort(&mut ends);
    let mut next: Vec<Option<(f64, usize)>> = vec![None; parts.len()];
    let done: Result<(), ()> = overlaps_between(&ends, &begins, |e, b| {
        let (e, b) = (e.id as usize, b.id as usize);
        let gap = (parts[e].piece.to() - parts[b].piece.from()).norm();
        if next[e].is_none_or(|(best, _)| gap < best) {
            next[e] = Some((gap, b));
        }
        Ok(())
    });
    debug_assert!(done.is_ok());
    let mut used = vec![false; parts.len()];
    let mut loops = Vec::new();
    for first in 0..parts.len() {
        if used[first] {
            continue;
        }
        let mut ring: Vec<Part> = Vec::new();
        let mut at = first;
        loop {
            if used[at] {
                return None;
            }
            used[at] = true;
            ring.push(parts[at]);
            at = next[at]?.1;
            if at == first {
                break;
            }
        }
        loops.push(whole(&ring));
    }
    (!loops.is_empty()).then_some(loops)
}

/// The pieces of a closed ring of parts: what needed no cut is one piece again, and
/// each begins where the one before ends, to the bit.
fn whole(ring: &[Part]) -> Vec<Piece> {
    let n = ring.len();
    // Begin where a candidate does, so that none is split between end and begin.
    let first = (0..n)
        .find(|&i| ring[i].of != ring[(i + n - 1) % n].of)
        .unwrap_or(0);
    let mut pieces: Vec<Piece> = Vec::with_capacity(n);
    let mut of = usize::MAX;
    for part in ring[first..].iter().chain(&ring[..first]) {
        let end = part.piece.to();
        match pieces.last_mut() {
            Some(Piece::Line { to, .. } | Piece::Arc { to, .. }) if of == part.of => *to = end,
            last => {
                let begin = last.map_or(part.piece.from(), |p| p.to());
                pieces.push(match part.piece {
                    Piece::Line { to, .. } => Piece::Line { from: begin, to },
                    Piece::Arc { centre, to, .. } => Piece::Arc {
                        centre,
                        from: begin,
                        to,
                    },
                });
            }
        }
        of = part.of;
    }
    let begin = pieces[0].from();
    if let Some(Piece::Line { to, .. } | Piece::Arc { to, .. }) = pieces.last_mut() {
        *to = begin;
    }
    pieces
}

fn shift(piece: &mut Piece, by: Vector) {
    match piece {
        Piece::Line { from, to } => {
            *from += by;
            *to += by;
        }
        Piece::Arc { centre, from, to } => {
            *centre += by;
            *from += by;
            *to += by;
        }
    }
}
