//! Pieces of lines that one frame holds together, as one station (D2.7 §3.5): short
//! stretches between crossings and lanes beside each other are seen in one pass.
//!
//! Who judges keeps the pieces as they are: whoever sees a station whole has seen all
//! of its pieces.

use super::targets::along;
use crate::coverage::ring::LoopProblem;
use crate::coverage::ring::patch::{Corners, middle};
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::sin_cos;
use std::collections::BTreeMap;

/// Stations, and the station of each piece.
pub(super) struct Bundles {
    pub stations: Vec<Corners>,
    pub of_piece: Vec<usize>,
}

/// Bundles pieces into rectangles of at most a lane by a lane, which a frame holds at any
/// heading. Near a zone pieces stay apart: the smaller they are, the more places there
/// are beside them from which they are seen.
///
/// # Guarantees
/// Each piece lies in its station; a station of more than one piece is no longer and no
/// wider than a lane, and a straight pass over its middle keeps clear of the zones.
///
/// # Complexity
/// O(n) for pieces that are spread over the plane, each looking at those within a lane
/// or two of it.
pub(super) fn bundle(pieces: &[Corners], flown: &LoopProblem) -> Bundles {
    let squares = Squares::new(pieces, flown.lane_spacing_m);
    let mut of_piece = vec![usize::MAX; pieces.len()];
    let mut stations = Vec::new();
    for seed in 0..pieces.len() {
        if of_piece[seed] != usize::MAX {
            continue;
        }
        let axes = Axes::of(&pieces[seed]);
        let mut spread = axes.spread(&pieces[seed]);
        of_piece[seed] = stations.len();
        let near: Vec<usize> = squares.around(middle(&pieces[seed])).collect();
        let mut alone = true;
        while let Some((n, wider)) = near
            .iter()
            .filter(|n| of_piece[**n] == usize::MAX)
            .map(|&n| (n, spread.with(axes.spread(&pieces[n]))))
            .filter(|(_, s)| s.fits(flown.lane_spacing_m) && is_clear(axes.middle(*s), flown))
            .min_by(|a, b| a.1.girth_m().total_cmp(&b.1.girth_m()))
        {
            of_piece[n] = stations.len();
            spread = wider;
            alone = false;
        }
        // One that stays alone is as it was, not even rounded.
        stations.push(if alone {
            pieces[seed]
        } else {
            axes.corners(spread)
        });
    }
    Bundles { stations, of_piece }
}

/// Whether a pass with room to turn keeps clear here.
fn is_clear(at: Point, flown: &LoopProblem) -> bool {
    flown.zones.distance_m(at) >= flown.clearance_m + flown.turn_radius_m
}

/// The axes of a rectangle.
struct Axes {
    origin: Point,
    forward: Vector,
    left: Vector,
}

impl Axes {
    fn of(piece: &Corners) -> Self {
        let (s, c) = sin_cos(along(piece));
        Self {
            origin: piece[0],
            forward: Vector::new(c, s),
            left: Vector::new(-s, c),
        }
    }

    fn spread(&self, piece: &Corners) -> Spread {
        let mut spread = Spread {
            low: Vector::repeat(f64::INFINITY),
            high: Vector::repeat(f64::NEG_INFINITY),
        };
        for corner in piece {
            let v = corner - self.origin;
            let at = Vector::new(v.dot(&self.forward), v.dot(&self.left));
            spread.low = spread.low.inf(&at);
            spread.high = spread.high.sup(&at);
        }
        spread
    }

    fn at(&self, forward_m: f64, left_m: f64) -> Point {
        self.origin + self.forward * forward_m + self.left * left_m
    }

    fn middle(&self, s: Spread) -> Point {
        let m = (s.low + s.high) / 2.0;
        self.at(m.x, m.y)
    }

    fn corners(&self, s: Spread) -> Corners {
        [
            self.at(s.low.x, s.low.y),
            self.at(s.high.x, s.low.y),
            self.at(s.high.x, s.high.y),
            self.at(s.low.x, s.high.y),
        ]
    }
}

/// How far something reaches along both axes.
#[derive(Clone, Copy)]
struct Spread {
    low: Vector,
    high: Vector,
}

impl Spread {
    fn with(self, other: Self) -> Self {
        Self {
            low: self.low.inf(&other.low),
            high: self.high.sup(&other.high),
        }
    }

    fn fits(self, side_m: f64) -> bool {
        (self.high - self.low).max() <= side_m
    }

    fn girth_m(self) -> f64 {
        (self.high - self.low).sum()
    }
}

/// Pieces by the square that their middle lies in.
struct Squares {
    side_m: f64,
    within: BTreeMap<(i64, i64), Vec<usize>>,
}

impl Squares {
    fn new(pieces: &[Corners], side_m: f64) -> Self {
        let mut squares = Self {
            side_m,
            within: BTreeMap::new(),
        };
        for (n, piece) in pieces.iter().enumerate() {
            let key = squares.key(middle(piece));
            squares.within.entry(key).or_default().push(n);
        }
        squares
    }

    fn key(&self, p: Point) -> (i64, i64) {
        #[allow(
            clippy::cast_possible_truncation,
            reason = "a cast of a float saturates"
        )]
        let index = |v: f64| (v / self.side_m).floor() as i64;
        (index(p.x), index(p.y))
    }

    /// Pieces whose middle lies within a side of a place at least, and some more.
    fn around(&self, at: Point) -> impl Iterator<Item = usize> + '_ {
        let (x, y) = self.key(at);
        (x - 1..=x + 1)
            .flat_map(move |x| (y - 1..=y + 1).map(move |y| (x, y)))
            .filter_map(|key| self.within.get(&key))
            .flatten()
            .copied()
    }
}
