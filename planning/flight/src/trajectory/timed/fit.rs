//! The ground track of a trajectory as lines and arcs (D2.7 §2.4.2).
//!
//! What follows curves over the ground follows trochoids as well once they are such
//! curves. A trochoid is cut into stretches; each becomes a biarc, which is two arcs
//! that leave and arrive along the trochoid's own courses and touch in the middle. A
//! stretch is halved until the biarc stays within the tolerance of it.

use super::{Medium, Piece, State, Trajectory};
use crate::trajectory::wind::Wind;
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::{atan2, sin};
use skein_geometry::{Curve, Segment};

/// A stretch is first cut so that the course turns by at most this, radians: a biarc
/// through a quarter turn has no ambiguous side.
const MOST_TURN_RAD: f64 = core::f64::consts::FRAC_PI_4;

/// Places of a stretch that are measured against its biarc.
const PROBES: u8 = 4;

/// Halvings of a piece at most: stretches of a thousandth of a second.
const DEEPEST: u8 = 16;

/// Pieces shorter than this are left out, metres, as in curves.
const SHORTEST_M: f64 = 1e-4;

impl Trajectory {
    /// The ground track as lines and arcs that join tangentially, at most
    /// `tolerance_m` from it where that was measured: at five places of each stretch,
    /// between which a biarc and a trochoid of the same ends and courses differ by
    /// hardly more. Pieces over the ground are kept as they are.
    ///
    /// # Complexity
    /// A turn of a trochoid needs some ten arcs for a tolerance of a centimetre.
    #[must_use]
    pub fn over_ground(&self, tolerance_m: f64) -> Curve {
        let mut curve = Curve::empty();
        for piece in &self.pieces {
            let whole = (0.0, piece.duration_s);
            if piece.is_trochoid(self.wind) {
                let fit = Fit {
                    piece,
                    wind: self.wind,
                    tolerance_m,
                };
                fit.stretch(whole, DEEPEST, &mut curve);
            } else if piece.medium == Medium::Air && !piece.is_arc() {
                let (a, b) = ends(piece, self.wind, whole);
                push(&mut curve, Segment::straight(a.position, b.position));
            } else {
                push(&mut curve, piece.segment);
            }
        }
        curve
    }
}

struct Fit<'a> {
    piece: &'a Piece,
    wind: Wind,
    tolerance_m: f64,
}

impl Fit<'_> {
    /// Appends a stretch, in seconds from the beginning of the piece.
    fn stretch(&self, (from_s, to_s): (f64, f64), depth: u8, out: &mut Curve) {
        let (a, b) = ends(self.piece, self.wind, (from_s, to_s));
        let found = biarc(&a, &b).filter(|arcs| self.is_close(arcs, from_s, to_s));
        match found {
            Some(arcs) => arcs.into_iter().for_each(|arc| push(out, arc)),
            None if depth == 0 => push(out, Segment::straight(a.position, b.position)),
            None => {
                let middle_s = 0.5 * (from_s + to_s);
                self.stretch((from_s, middle_s), depth - 1, out);
                self.stretch((middle_s, to_s), depth - 1, out);
            }
        }
    }

    /// Whether places between the ends lie within the tolerance of one of the arcs.
    fn is_close(&self, arcs: &[Segment; 2], from_s: f64, to_s: f64) -> bool {
        (1..=PROBES).all(|i| {
            let share = f64::from(i) / f64::from(PROBES + 1);
            let at_s = from_s + (to_s - from_s) * share;
            let p = self.piece.state_after(at_s, self.wind).position;
            let off_m = arcs.iter().map(|a| off_circle_m(a, p));
            off_m.fold(f64::INFINITY, f64::min) <= self.tolerance_m
        })
    }
}

fn ends(piece: &Piece, wind: Wind, (from_s, to_s): (f64, f64)) -> (State, State) {
    (
        piece.state_after(from_s, wind),
        piece.state_after(to_s, wind),
    )
}

fn push(curve: &mut Curve, segment: Segment) {
    if segment.length_m > SHORTEST_M {
        curve.push(segment);
    }
}

/// Distance of a place from the line or circle of a piece, metres.
fn off_circle_m(segment: &Segment, p: Point) -> f64 {
    match segment.centre() {
        Some(c) => ((p - c).norm() - 1.0 / segment.curvature_per_m.abs()).abs(),
        None => {
            let (v, d) = (p - segment.start.position(), segment.start.direction());
            (d.x * v.y - d.y * v.x).abs()
        }
    }
}

/// Two arcs with equally long tangents from one state to the other; `None` where the
/// courses differ by too much for it, or a state stands still.
fn biarc(a: &State, b: &State) -> Option<[Segment; 2]> {
    let unit = |v: Vector| (v.norm() > 1e-9).then(|| v / v.norm());
    let (t0, t1) = (unit(a.ground_velocity)?, unit(b.ground_velocity)?);
    let v = b.position - a.position;
    let turned = t0.dot(&t1);
    if turned < skein_geometry::math::cos(MOST_TURN_RAD) || v.dot(&t0) <= 0.0 || v.dot(&t1) <= 0.0 {
        return None;
    }
    // The tangents have the length d for which their tips lie 2 d apart.
    let (p, q, r) = (v.dot(&v), v.dot(&(t0 + t1)), 2.0 * (1.0 - turned));
    let d = p / (q + (q * q + r * p).sqrt());
    let middle = a.position + (v + (t0 - t1) * d) / 2.0;
    let first = arc(a.position, t0, middle)?;
    let second = arc(b.position, -t1, middle)?.reversed();
    Some([first, second])
}

/// The arc that leaves `from` along `tangent` and reaches `to`.
fn arc(from: Point, tangent: Vector, to: Point) -> Option<Segment> {
    let chord = to - from;
    let square = chord.dot(&chord);
    if square < SHORTEST_M * SHORTEST_M {
        return None;
    }
    let across = tangent.x * chord.y - tangent.y * chord.x;
    let half = atan2(across, tangent.dot(&chord));
    let stretch = if half.abs() < 1e-9 {
        1.0
    } else {
        half / sin(half)
    };
    Some(Segment {
        start: Pose::new(from, atan2(tangent.y, tangent.x)),
        curvature_per_m: 2.0 * across / square,
        length_m: square.sqrt() * stretch,
    })
}
