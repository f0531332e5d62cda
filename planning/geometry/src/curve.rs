//! Curves made of straight lines and circular arcs, joined tangentially.
//!
//! Everything a UAV flies here is such a curve: lanes, quarter turns, Dubins
//! words, loiters. They are sampled exactly by arc length.

use crate::frame::{Point, Pose};
use crate::math::{atan2, sin_cos, wrap_pi};
use serde::{Deserialize, Serialize};

/// One piece: it starts at `start` and bends by `curvature_per_m` (positive to
/// the left, zero for a line) for `length_m`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// Pose at the beginning.
    pub start: Pose,
    /// Signed curvature, 1/m: positive turns left.
    pub curvature_per_m: f64,
    /// Arc length, metres, not negative.
    pub length_m: f64,
}

impl Segment {
    /// The straight line from one point to another; due east where they are the same.
    #[must_use]
    pub fn straight(from: Point, to: Point) -> Self {
        let along = to - from;
        Self {
            start: Pose::new(from, atan2(along.y, along.x)),
            curvature_per_m: 0.0,
            length_m: along.norm(),
        }
    }

    /// The pose after `s_m` metres along the piece.
    #[must_use]
    pub fn pose_at(&self, s_m: f64) -> Pose {
        let p = self.start;
        let k = self.curvature_per_m;
        let turned = k * s_m;
        if turned.abs() < 1e-9 {
            let d = p.direction();
            return Pose {
                east_m: p.east_m + d.x * s_m,
                north_m: p.north_m + d.y * s_m,
                heading_rad: wrap_pi(p.heading_rad + turned),
            };
        }
        let (s0, c0) = sin_cos(p.heading_rad);
        let (s1, c1) = sin_cos(p.heading_rad + turned);
        Pose {
            east_m: p.east_m + (s1 - s0) / k,
            north_m: p.north_m + (c0 - c1) / k,
            heading_rad: wrap_pi(p.heading_rad + turned),
        }
    }

    /// The pose at the end.
    #[must_use]
    pub fn end(&self) -> Pose {
        self.pose_at(self.length_m)
    }

    /// Centre of the circle, if the piece is an arc.
    #[must_use]
    pub fn centre(&self) -> Option<Point> {
        if self.curvature_per_m.abs() < 1e-12 {
            return None;
        }
        let (s, c) = sin_cos(self.start.heading_rad);
        let r = 1.0 / self.curvature_per_m;
        Some(Point::new(
            self.start.east_m - r * s,
            self.start.north_m + r * c,
        ))
    }

    /// The same piece flown from its end to its start.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self {
            start: self.end().reversed(),
            curvature_per_m: -self.curvature_per_m,
            length_m: self.length_m,
        }
    }
}

/// Pieces joined end to start; may be empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    segments: Vec<Segment>,
}

impl Curve {
    /// A curve of no length.
    #[must_use]
    pub fn empty() -> Self {
        Self::default()
    }

    /// Begins at `start` and appends `(curvature_per_m, length_m)` pieces; pieces
    /// shorter than a tenth of a millimetre are left out.
    #[must_use]
    pub fn from_pieces(start: Pose, pieces: &[(f64, f64)]) -> Self {
        let mut segments = Vec::with_capacity(pieces.len());
        let mut at = start;
        for &(curvature_per_m, length_m) in pieces {
            if length_m > 1e-4 {
                let s = Segment {
                    start: at,
                    curvature_per_m,
                    length_m,
                };
                at = s.end();
                segments.push(s);
            }
        }
        Self { segments }
    }

    /// The pieces, in order of flight.
    #[must_use]
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// Whether there is nothing to fly.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.segments.is_empty()
    }

    /// Arc length, metres.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.segments.iter().map(|s| s.length_m).sum()
    }

    /// The pose at the beginning, if there is one.
    #[must_use]
    pub fn start(&self) -> Option<Pose> {
        self.segments.first().map(|s| s.start)
    }

    /// The pose at the end, if there is one.
    #[must_use]
    pub fn end(&self) -> Option<Pose> {
        self.segments.last().map(Segment::end)
    }

    /// The pose `s_m` metres along, clamped to both ends; `None` when empty.
    #[must_use]
    pub fn pose_at(&self, s_m: f64) -> Option<Pose> {
        let mut left = s_m.max(0.0);
        for s in &self.segments {
            if left <= s.length_m {
                return Some(s.pose_at(left));
            }
            left -= s.length_m;
        }
        self.end()
    }

    /// The curve up to `s_m` metres along it, and the rest; `s_m` is clamped to both
    /// ends.
    #[must_use]
    pub fn split_at(&self, s_m: f64) -> (Self, Self) {
        let mut left_m = s_m.max(0.0);
        let (mut before, mut after) = (Self::empty(), Self::empty());
        for s in &self.segments {
            let cut_m = left_m.min(s.length_m);
            left_m -= cut_m;
            if cut_m > 0.0 {
                before.push(Segment {
                    length_m: cut_m,
                    ..*s
                });
            }
            if cut_m < s.length_m {
                after.push(Segment {
                    start: s.pose_at(cut_m),
                    length_m: s.length_m - cut_m,
                    ..*s
                });
            }
        }
        (before, after)
    }

    /// The same curve flown backwards.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self {
            segments: self.segments.iter().rev().map(Segment::reversed).collect(),
        }
    }

    /// Appends a piece as it is.
    pub fn push(&mut self, segment: Segment) {
        self.segments.push(segment);
    }

    /// Appends all pieces of `other`.
    pub fn extend(&mut self, other: &Self) {
        self.segments.extend_from_slice(&other.segments);
    }

    /// The largest curvature, 1/m, without sign.
    #[must_use]
    pub fn max_curvature_per_m(&self) -> f64 {
        self.segments
            .iter()
            .map(|s| s.curvature_per_m.abs())
            .fold(0.0, f64::max)
    }

    /// The largest gap between the end of a piece and the start of the next, metres.
    #[must_use]
    pub fn largest_gap_m(&self) -> f64 {
        self.segments
            .windows(2)
            .map(|w| (w[1].start.position() - w[0].end().position()).norm())
            .fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{FRAC_PI_2, PI};

    #[test]
    fn a_quarter_turn_left_ends_where_it_should() {
        let start = Pose {
            east_m: 0.0,
            north_m: 0.0,
            heading_rad: 0.0,
        };
        let c = Curve::from_pieces(start, &[(0.1, 10.0 * FRAC_PI_2)]);
        let e = c.end().unwrap();
        assert!((e.east_m - 10.0).abs() < 1e-9 && (e.north_m - 10.0).abs() < 1e-9);
        assert!((e.heading_rad - FRAC_PI_2).abs() < 1e-9);
    }

    #[test]
    fn reversing_twice_gives_the_same_poses() {
        let start = Pose {
            east_m: 3.0,
            north_m: -2.0,
            heading_rad: 1.0,
        };
        let c = Curve::from_pieces(start, &[(0.05, 20.0), (0.0, 15.0), (-0.04, 30.0)]);
        let r = c.reversed();
        assert!((r.length_m() - c.length_m()).abs() < 1e-12);
        for i in 0..=65 {
            let s = f64::from(i);
            let a = c.pose_at(s).unwrap();
            let b = r.pose_at(65.0 - s).unwrap();
            assert!((a.position() - b.position()).norm() < 1e-9);
            assert!(wrap_pi(a.heading_rad - b.heading_rad - PI).abs() < 1e-9);
        }
    }
}
