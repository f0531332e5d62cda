//! Turns along a contour that was seen, and on where it was not (D2.7 §3.1): what is seen ends
//! some seconds ahead of the UAV, where the picture ends.
//!
//! | place | what is flown |
//! |---|---|
//! | beside what was seen, or straight on from its end for [`BEYOND_M`] | the arc through a place ahead on it (pure pursuit) |
//! | farther on | arcs that widen, [`SEEK_ARCS`] of them, an eighth of a circle each |
//!
//! # Guarantees
//! No arc bends tighter than the radius. Equal inputs give equal arcs.

use skein_geometry::Segment;
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::{PI, atan2, cos, sin, wrap_pi};
use skein_geometry::polyline::{length_m, nearest};

/// Beyond the end of what was seen it is taken to go straight on for so long, metres: two
/// pictures.
pub const BEYOND_M: f64 = 120.0;

/// So many arcs of an eighth of a circle are flown to look for what was lost: two turns.
pub const SEEK_ARCS: u16 = 16;

/// The first of them has this radius, in least ones, and each is wider by [`WIDER`].
const FIRST_RADII: f64 = 1.2;
const WIDER: f64 = 0.25;

/// The place ahead that is aimed at is so many radii away.
const AHEAD_RADII: f64 = 1.3;

/// The direction of the end of what was seen is that of its last so many metres.
const END_M: f64 = 35.0;

/// What was seen of a contour, as it is flown along.
#[derive(Clone, Debug, PartialEq)]
pub struct Lead {
    line: Vec<Point>,
    length_m: f64,
    /// Which way it is taken to go on.
    on: Vector,
}

/// Where somebody is beside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beside {
    /// Metres along it; more than its length beyond its end.
    pub along_m: f64,
    /// Metres from it.
    pub off_m: f64,
}

impl Lead {
    /// `None` where the line has no direction.
    #[must_use]
    pub fn new(line: Vec<Point>) -> Option<Self> {
        let end = *line.last()?;
        let mut back_m = 0.0;
        let mut from = end;
        for both in line.windows(2).rev() {
            from = both[0];
            back_m += (both[1] - both[0]).norm();
            if back_m >= END_M {
                break;
            }
        }
        let way = end - from;
        let norm_m = way.norm();
        (norm_m > 0.0).then(|| Self {
            length_m: length_m(&line),
            line,
            on: way / norm_m,
        })
    }

    /// How long it is, metres.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// Where a place is beside it.
    #[must_use]
    pub fn beside(&self, p: Point) -> Beside {
        let (mut along_m, mut off_m) =
            nearest(&self.line, p).map_or((0.0, f64::MAX), |(s, m, _)| (s, m));
        if let Some(end) = self.line.last() {
            let beyond_m = (p - end).dot(&self.on);
            let beside_m = (p - (end + self.on * beyond_m)).norm();
            if beyond_m > 0.0 && (beside_m < off_m || along_m >= self.length_m - 1e-6) {
                (along_m, off_m) = (self.length_m + beyond_m, beside_m);
            }
        }
        Beside { along_m, off_m }
    }

    /// A place on it, and the way there; straight on beyond its end.
    #[must_use]
    pub fn pose_at(&self, along_m: f64) -> Pose {
        let mut left_m = along_m.max(0.0);
        for both in self.line.windows(2) {
            let way = both[1] - both[0];
            let piece_m = way.norm();
            if piece_m > 0.0 && left_m <= piece_m {
                return Pose::new(both[0] + way * (left_m / piece_m), atan2(way.y, way.x));
            }
            left_m -= piece_m;
        }
        let end = self.line.last().copied().unwrap_or_else(Point::origin);
        Pose::new(end + self.on * left_m, atan2(self.on.y, self.on.x))
    }

    /// The arc from a pose towards a place ahead on it, of so many metres, no tighter than a
    /// radius, metres.
    #[must_use]
    pub fn arc(&self, from: Pose, radius_m: f64, arc_m: f64) -> Segment {
        let ahead_m = AHEAD_RADII * radius_m;
        let aim = self.pose_at(self.beside(from.position()).along_m + ahead_m);
        let to = aim.position() - from.position();
        let away_m = to.norm().max(1.0);
        let turn_rad = wrap_pi(atan2(to.y, to.x) - from.heading_rad);
        let tightest = 1.0 / radius_m;
        let bend = if cos(turn_rad) < 0.0 {
            tightest.copysign(turn_rad)
        } else {
            (2.0 * sin(turn_rad) / away_m).clamp(-tightest, tightest)
        };
        Segment {
            start: from,
            curvature_per_m: bend,
            length_m: arc_m,
        }
    }
}

/// The nth arc that is flown to look for what was lost.
#[must_use]
pub fn seek_arc(from: Pose, nth: u16, radius_m: f64) -> Segment {
    let wide_m = radius_m * (FIRST_RADII + WIDER * f64::from(nth));
    Segment {
        start: from,
        curvature_per_m: 1.0 / wide_m,
        length_m: wide_m * PI / 4.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The farthest that somebody is from a circle of this radius that it flies along, metres,
    /// after it has come to it.
    fn strays_m(circle_m: f64, off_m: f64) -> f64 {
        let at = |rad: f64| Point::new(circle_m * cos(rad), circle_m * sin(rad));
        let mut pose = Pose::new(Point::new(circle_m + off_m, 0.0), PI / 2.0);
        let mut worst_m = 0.0_f64;
        for k in 0..300 {
            let here = pose.position();
            let rad = atan2(here.y, here.x);
            // It sees 45 m to either side.
            let line = (-5..=5).map(|i| at(rad + f64::from(i) * 9.0 / circle_m));
            let lead = Lead::new(line.collect()).unwrap();
            let arc = lead.arc(pose, 22.0, 8.0);
            assert!(arc.curvature_per_m.abs() <= 1.0 / 22.0 + 1e-9);
            pose = arc.end();
            if k > 30 {
                worst_m = worst_m.max((pose.position().coords.norm() - circle_m).abs());
            }
        }
        worst_m
    }

    #[test]
    fn a_circle_is_flown_along_from_beside() {
        assert!(strays_m(200.0, 30.0) < 5.0, "{}", strays_m(200.0, 30.0));
        assert!(strays_m(60.0, -20.0) < 10.0, "{}", strays_m(60.0, -20.0));
    }

    #[test]
    fn beyond_its_end_it_goes_straight_on_and_arcs_widen() {
        let line = vec![Point::new(0.0, 0.0), Point::new(100.0, 0.0)];
        let lead = Lead::new(line).unwrap();
        let beside = lead.beside(Point::new(150.0, 10.0));
        assert!((beside.along_m - 150.0).abs() < 1e-9 && (beside.off_m - 10.0).abs() < 1e-9);
        assert!((lead.pose_at(180.0).east_m - 180.0).abs() < 1e-9);
        assert!(Lead::new(vec![Point::origin()]).is_none());
        let mut pose = Pose::new(Point::origin(), 0.0);
        let mut radius_m = 0.0;
        for nth in 0..SEEK_ARCS {
            let arc = seek_arc(pose, nth, 20.0);
            assert!(1.0 / arc.curvature_per_m > radius_m);
            radius_m = 1.0 / arc.curvature_per_m;
            pose = arc.end();
        }
    }
}
