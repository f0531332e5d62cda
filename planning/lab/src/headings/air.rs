//! The air the legs are flown through: at rest, or drifting with a constant wind.
//!
//! Seen from drifting air a goal moves, and a flight that meets it after a time T is a
//! word to where it is then, exactly T long. So no flight is faster than the first T
//! at which some word, bounded from below and above over both heading intervals, may
//! be that long. Slices of time are looked at one after the other, each with the goal's
//! drift within it added to what the intervals leave open; a slice whose bound is later
//! than its end is left behind, one whose bound lies within is begun there. In the last
//! slice the planes of the words hold, divided by how fast the goal's drift and the
//! flight close in on each other along the straight.
//!
//! The flight itself, for the upper bound, is `wind`'s.

use super::leg::{Arc, Drift, Leg, Slice};
use skein_flight::trajectory::dubins;
use skein_flight::trajectory::wind::{Performance, Wind, time_s};
use skein_geometry::frame::{Point, Pose, Vector};

/// The first slice, in the time of a radian's turn: the goal drifts by a tenth of the
/// wind's share of a radius.
const FIRST_SLICE: f64 = 0.5;

/// Slices looked at, at most: with less than a quarter of one gained by each look
/// its length is halved, and 20 halvings exhaust any interval.
const LOOKS: usize = 48;

/// The last slice in half widths: a wide one lets in words that only fit elsewhere in it,
/// a narrow one takes more looks.
const LAST_SLICE: f64 = 2.0;

/// The air over a chain, in turn radii and airspeeds.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Air {
    /// Its velocity; nothing for calm.
    pub wind: Option<Vector>,
}

impl Air {
    /// The leg by `v` between two intervals.
    pub fn leg(&self, v: Vector, a: &Arc, b: &Arc) -> Leg {
        match self.wind {
            None => Leg::new(v, a, b),
            Some(wind) => {
                let mut leg = slices(v, a, b, wind);
                leg.length = self.cost(v, a.mid_rad, b.mid_rad);
                leg
            }
        }
    }

    /// Time of the fastest flight by `v` between two headings; its length in calm.
    pub fn cost(&self, v: Vector, a_rad: f64, b_rad: f64) -> f64 {
        let from = Pose::new(Point::new(0.0, 0.0), a_rad);
        let to = Pose::new(Point::new(v.x, v.y), b_rad);
        let unit = Performance {
            airspeed_mps: 1.0,
            turn_radius_m: 1.0,
        };
        match self.wind {
            None => dubins::length_m(from, to, 1.0),
            Some(w) => time_s(from, to, unit, Wind::new(w.x, w.y)).unwrap_or(f64::INFINITY),
        }
    }
}

/// The first moment at which a straight flight can be there.
fn earliest(v: Vector, wind: Vector) -> f64 {
    let square = v.norm_squared();
    let along = v.dot(&wind);
    let a = 1.0 - wind.norm_squared();
    let root = (along * along + a * square).sqrt();
    if square <= 0.0 {
        0.0
    } else if along >= 0.0 {
        square / (along + root)
    } else {
        (root - along) / a
    }
}

/// The bound of a leg in wind, slice by slice.
fn slices(v: Vector, a: &Arc, b: &Arc, wind: Vector) -> Leg {
    let last = LAST_SLICE * (a.half_rad + b.half_rad) / (1.0 - wind.norm()) + 1e-9;
    let mut from = earliest(v, wind);
    let mut wide = FIRST_SLICE.max(last);
    let mut leg = Leg::nowhere();
    for _ in 0..LOOKS {
        let until = from + wide;
        let moment = 0.5 * (from + until);
        let drift = Drift {
            wind,
            moment,
            spread: 0.5 * wide,
        };
        leg = Leg::drifting(v - wind * moment, a, b, &drift);
        leg.slice = Some(Slice { from, until });
        let least = leg.least(a, b);
        if least >= until {
            from = until;
            wide *= 2.0;
        } else if least > from + 0.25 * wide {
            from = least;
        } else {
            from = from.max(least);
            if wide <= last {
                break;
            }
            wide = (0.5 * wide).max(last);
        }
    }
    if let Some(slice) = &mut leg.slice {
        slice.from = from;
        // Left behind as a whole: nothing holds but where it ended.
        slice.until = slice.until.max(from);
    }
    leg
}
