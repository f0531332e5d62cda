//! A closed flight, by what it takes.

use crate::flight::Leg;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::FRAC_PI_2;
use skein_geometry::{Curve, Segment};
use thiserror::Error;

/// Arcs are cut into pieces of at most this turn, radians: along a piece what a metre takes
/// hardly changes, and its chord stands for it.
const PIECE_RAD: f64 = FRAC_PI_2 / 6.0;

/// Curvatures nearer to each other than this are of one arc, 1/m.
const SAME_BEND_PER_M: f64 = 1e-12;

/// A closed tour over the plane; places on it are millimetres from its beginning (or what
/// its pieces take, as thousandths).
#[derive(Clone, Debug, PartialEq)]
pub struct Tour {
    /// Lines and short arcs, and whether the camera works on them.
    pieces: Vec<(Segment, bool)>,
    /// Where each piece begins, and where the last ends.
    at: Vec<u32>,
}

/// Why legs make no tour.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum TourError {
    /// No way to go.
    #[error("there is nothing to go round: the tour has no length")]
    Empty,
    /// Beyond what is counted.
    #[error("a tour of {0:.0} m is too long to patrol, 4,294 km are possible")]
    TooLong(f64),
}

impl Tour {
    /// The tour along legs that lead back to where they begin; `cost_m` gives what a line or
    /// an arc takes, metres.
    ///
    /// # Errors
    /// [`TourError`].
    pub fn new(legs: &[Leg], cost_m: impl Fn(&Curve) -> f64) -> Result<Self, TourError> {
        let (mut pieces, mut at) = (Vec::new(), vec![0]);
        let mut flown_m = 0.0;
        for leg in legs {
            for segment in leg.curve.segments().iter().flat_map(cut) {
                let mut curve = Curve::empty();
                curve.push(segment);
                flown_m += cost_m(&curve);
                let mm = (flown_m * 1000.0).round();
                if !(0.0..=f64::from(u32::MAX)).contains(&mm) {
                    return Err(TourError::TooLong(flown_m));
                }
                #[allow(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "within the range just checked"
                )]
                at.push(mm as u32);
                pieces.push((segment, leg.sees));
            }
        }
        match at.last() {
            Some(0) | None => Err(TourError::Empty),
            _ => Ok(Self { pieces, at }),
        }
    }

    /// Its length, millimetres.
    #[must_use]
    pub fn len_mm(&self) -> u32 {
        self.at.last().copied().unwrap_or(0)
    }

    /// The point at a place.
    #[must_use]
    pub fn point(&self, place: u32) -> Point {
        self.pose(place).position()
    }

    /// The point at a place, and the course there.
    #[must_use]
    pub fn pose(&self, place: u32) -> Pose {
        let place = place % self.len_mm().max(1);
        let piece = self.piece(place);
        self.pieces[piece]
            .0
            .pose_at(self.along_m(piece, u64::from(place)))
    }

    /// The piece on which a place below the length lies.
    fn piece(&self, place: u32) -> usize {
        let after = self.at.partition_point(|a| *a <= place);
        after.saturating_sub(1).min(self.pieces.len() - 1)
    }

    /// How far along a piece a place lies, metres: 0 before it, its length behind it.
    fn along_m(&self, piece: usize, place: u64) -> f64 {
        let (from, to) = (self.at[piece], self.at[piece + 1]);
        let length_m = self.pieces[piece].0.length_m;
        if place >= u64::from(to) {
            return length_m;
        }
        let on = u32::try_from(place.saturating_sub(u64::from(from))).unwrap_or(0);
        length_m * (f64::from(on) / f64::from((to - from).max(1)))
    }

    /// The place that is nearest to a point; the first of several.
    #[must_use]
    pub fn nearest(&self, p: Point) -> u32 {
        let mut best = (f64::INFINITY, 0);
        for (i, (segment, _)) in self.pieces.iter().enumerate() {
            let (a, b) = (segment.start.position(), segment.end().position());
            let along = b - a;
            let share = (p - a).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE);
            let share = share.clamp(0.0, 1.0);
            let distance = (a + along * share - p).norm();
            if distance < best.0 {
                let (from, to) = (self.at[i], self.at[i + 1]);
                #[allow(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "a share of a length that fits"
                )]
                let place = from + (f64::from(to - from) * share) as u32;
                best = (distance, place);
            }
        }
        best.1
    }

    /// What is flown from a place on over a length: once round at most.
    #[must_use]
    pub fn stretch(&self, from: u32, len: u32) -> Vec<Leg> {
        let n = self.len_mm();
        let from = from % n.max(1);
        let (begin, end) = (u64::from(from), u64::from(from) + u64::from(len.min(n)));
        let mut stretches = Vec::new();
        for lap in [0, u64::from(n)] {
            for (i, (segment, sees)) in self.pieces.iter().enumerate() {
                let (a, b) = (u64::from(self.at[i]) + lap, u64::from(self.at[i + 1]) + lap);
                if b <= begin || a >= end {
                    continue;
                }
                let place = |at: u64| self.along_m(i, at.saturating_sub(lap));
                let (from_m, to_m) = (place(begin.max(a)), place(end.min(b)));
                let cut = Segment {
                    start: segment.pose_at(from_m),
                    length_m: to_m - from_m,
                    ..*segment
                };
                append(&mut stretches, cut, *sees);
            }
        }
        stretches.into_iter().map(leg).collect()
    }
}

/// Lengthens stretches by a piece that begins where they end; pieces of one arc become one
/// again.
fn append(stretches: &mut Vec<(Vec<Segment>, bool)>, piece: Segment, sees: bool) {
    if piece.length_m <= 0.0 {
        return;
    }
    let Some((pieces, _)) = stretches.last_mut().filter(|s| s.1 == sees) else {
        stretches.push((vec![piece], sees));
        return;
    };
    let bend = piece.curvature_per_m;
    let is_same = |last: &&mut Segment| {
        bend.abs() > 0.0 && (last.curvature_per_m - bend).abs() < SAME_BEND_PER_M
    };
    match pieces.last_mut().filter(is_same) {
        Some(last) => last.length_m += piece.length_m,
        None => pieces.push(piece),
    }
}

fn leg((pieces, sees): (Vec<Segment>, bool)) -> Leg {
    let mut curve = Curve::empty();
    for piece in pieces {
        curve.push(piece);
    }
    Leg { curve, sees }
}

/// A line as it is, an arc in short pieces.
fn cut(segment: &Segment) -> impl Iterator<Item = Segment> + use<> {
    let turned_rad = segment.length_m * segment.curvature_per_m.abs();
    let pieces = (turned_rad / PIECE_RAD).ceil().max(1.0);
    let length_m = segment.length_m / pieces;
    let whole = *segment;
    let starts = std::iter::successors(Some(0.0), |i| Some(i + 1.0));
    let starts = starts.take_while(move |i| *i < pieces);
    starts.map(move |i| Segment {
        start: whole.pose_at(i * length_m),
        length_m,
        ..whole
    })
}
