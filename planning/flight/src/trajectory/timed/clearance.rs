//! The certificate that a trajectory stays out of the zones (D2.7 §2.3.1, §2.4).
//!
//! Lines and arcs over the ground are measured exactly. A trochoid is cut into
//! stretches until each is proved: within a stretch of duration d the UAV is at most
//! a d²/8 from the chord if its acceleration is at most a, and the chord's distance
//! is exact. Only what is proved counts as clear; a stretch whose doubt falls below
//! the rounding of coordinates decides by its chord.

use super::{Piece, Trajectory};
use crate::trajectory::wind::Wind;
use skein_geometry::NoFlyZones;
use skein_geometry::{Curve, Segment};

/// Slack of every certificate, metres, as for curves: routes are built to touch the
/// clearance exactly.
const ROUNDING_M: f64 = 1e-6;

/// A trochoid this near to its chord is its chord, metres: a tenth of the slack.
const FLAT_M: f64 = 1e-7;

impl Trajectory {
    /// Whether the whole trajectory is proved to keep `margin_m` from every zone.
    ///
    /// # Guarantees
    /// True only if no point of the ground track is nearer than the margin, to a
    /// micrometre; false only if some point is, to a micrometre, or a coordinate is
    /// no number.
    ///
    /// # Complexity
    /// A trochoid costs O(√(length / slack)) distances where it passes a zone at
    /// nearly the margin, one elsewhere.
    #[must_use]
    pub fn stays_clear(&self, zones: &NoFlyZones, margin_m: f64) -> bool {
        self.pieces
            .iter()
            .all(|p| piece_is_clear(p, self.wind, zones, margin_m))
    }
}

fn piece_is_clear(piece: &Piece, wind: Wind, zones: &NoFlyZones, margin_m: f64) -> bool {
    let (from, to) = (
        piece.state_after(0.0, wind),
        piece.state_after(piece.duration_s, wind),
    );
    let sum = from.position.x + from.position.y + to.position.x + to.position.y;
    if !(sum + piece.duration_s * (1.0 + piece.acceleration_mps2())).is_finite() {
        return false;
    }
    if piece.is_trochoid(wind) {
        return stretch_is_clear(piece, wind, zones, margin_m, (0.0, piece.duration_s));
    }
    let straight = piece.segment.curvature_per_m.abs() * piece.segment.length_m < 1e-9;
    let segment = if straight {
        Segment::straight(from.position, to.position)
    } else {
        piece.segment
    };
    let mut curve = Curve::empty();
    curve.push(segment);
    zones.is_clear(&curve, margin_m)
}

/// A stretch of a trochoid, in seconds from the beginning of its piece.
fn stretch_is_clear(
    piece: &Piece,
    wind: Wind,
    zones: &NoFlyZones,
    margin_m: f64,
    (from_s, to_s): (f64, f64),
) -> bool {
    let middle_s = 0.5 * (from_s + to_s);
    let middle_m = zones.distance_m(piece.state_after(middle_s, wind).position);
    if middle_m < margin_m - ROUNDING_M {
        return false;
    }
    let lasts_s = to_s - from_s;
    if middle_m - 0.5 * lasts_s * piece.velocity_bound_mps(wind) >= margin_m {
        return true;
    }
    let doubt_m = piece.acceleration_mps2() * lasts_s * lasts_s / 8.0;
    let (a, b) = (
        piece.state_after(from_s, wind),
        piece.state_after(to_s, wind),
    );
    let chord_m = zones.segment_distance_m(&Segment::straight(a.position, b.position));
    if chord_m - doubt_m >= margin_m - ROUNDING_M {
        return true;
    }
    if doubt_m <= FLAT_M {
        return false;
    }
    stretch_is_clear(piece, wind, zones, margin_m, (from_s, middle_s))
        && stretch_is_clear(piece, wind, zones, margin_m, (middle_s, to_s))
}
