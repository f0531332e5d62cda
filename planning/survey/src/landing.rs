//! How a fixed wing comes down: the way from where its flight ends to a circle, the circle,
//! and the glide from its tangent to where it lands (D2.7 §2.3, §2.4).
//!
//! A pattern that a person has drawn is kept if all of it is clear; else one is made: against
//! the wind first, then on courses more and more across it, to either side.
//!
//! # Guarantees
//! The way, the circle and the glide keep the clearance from zones and fences. Heights are
//! left to the caller: zones count at all of them.

use crate::flown::straight;
use skein_flight::route::Router;
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::{TAU, acos, atan2, cos, sin, sin_cos};
use skein_geometry::{Curve, Segment};
use thiserror::Error;

/// Courses of a glide that are tried: every 10°.
const COURSES: u8 = 36;

/// Places on a circle at which a UAV may come to it.
const ENTRIES: u8 = 8;

/// A circle that is made is so many times as wide as the tightest turn: following it has
/// something to spare.
const CIRCLE_RADII: f64 = 1.2;

/// A landing pattern in the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pattern {
    /// Where it touches down.
    pub land: Point,
    /// Middle of the circle.
    pub centre: Point,
    /// Radius of the circle, metres.
    pub radius_m: f64,
    /// Whether it circles clockwise.
    pub clockwise: bool,
}

/// A landing that is proved.
#[derive(Clone, Debug, PartialEq)]
pub struct Landing {
    /// The pattern.
    pub pattern: Pattern,
    /// What is flown to the circle, which it meets on its tangent.
    pub way: Curve,
    /// What is flown from the circle's tangent to where it lands.
    pub glide: Curve,
}

/// Why a landing pattern cannot be flown.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum LandingError {
    /// A figure is no number, or no tangent leads from the circle to where it lands.
    #[error("no tangent leads from its circle to where it lands")]
    NoTangent,
    /// Nobody flies so tight a circle.
    #[error("its circle of {radius_m:.0} m is tighter than turns of {least_m:.0} m")]
    TooTight {
        /// Radius of the circle, metres.
        radius_m: f64,
        /// The tightest turn, metres.
        least_m: f64,
    },
    /// The circle or the glide comes too near to a zone or a fence.
    #[error("its circle or its glide comes nearer to a zone or a fence than the clearance")]
    NotClear,
    /// No clear way leads to the circle.
    #[error("no clear way leads to its circle")]
    NoWay,
}

impl Pattern {
    /// The pattern whose glide has a course and a length.
    fn along(land: Point, course_rad: f64, glide_m: f64, radius_m: f64, clockwise: bool) -> Self {
        let (s, c) = sin_cos(course_rad);
        let side = if clockwise { 1.0 } else { -1.0 };
        let tangent = land - Vector::new(c, s) * glide_m;
        Self {
            land,
            centre: tangent + Vector::new(s, -c) * (side * radius_m),
            radius_m,
            clockwise,
        }
    }

    /// A pose on the circle, flown its way round, at an angle from its middle.
    fn pose_at(&self, angle_rad: f64) -> Pose {
        let (s, c) = sin_cos(angle_rad);
        let side = if self.clockwise { -1.0 } else { 1.0 };
        let ahead = Vector::new(-s, c) * side;
        let at = self.centre + Vector::new(c, s) * self.radius_m;
        Pose::new(at, atan2(ahead.y, ahead.x))
    }

    fn circle(&self, from: Pose) -> [Segment; 2] {
        let side = if self.clockwise { -1.0 } else { 1.0 };
        let half = |start| Segment {
            start,
            curvature_per_m: side / self.radius_m,
            length_m: 0.5 * TAU * self.radius_m,
        };
        // Halves, because a whole circle ends where it begins.
        let first = half(from);
        [first, half(first.end())]
    }

    /// Where it leaves the circle towards where it lands.
    fn tangent(&self) -> Option<Pose> {
        let to = self.land - self.centre;
        let away_m = to.norm();
        if !(away_m.is_finite() && self.radius_m > 0.0 && self.radius_m < away_m) {
            return None;
        }
        let side = if self.clockwise { 1.0 } else { -1.0 };
        let angle_rad = atan2(to.y, to.x) + side * acos(self.radius_m / away_m);
        Some(self.pose_at(angle_rad))
    }

    /// The landing by this pattern of a UAV whose flight ends at a pose.
    ///
    /// # Errors
    /// [`LandingError`] says what of it cannot be flown.
    pub fn landing(&self, router: &Router, end: Pose) -> Result<Landing, LandingError> {
        let limits = router.limits();
        let least_m = limits.turn_radius_m;
        if self.radius_m < least_m * (1.0 - 1e-9) {
            return Err(LandingError::TooTight {
                radius_m: self.radius_m,
                least_m,
            });
        }
        let tangent = self.tangent().ok_or(LandingError::NoTangent)?;
        let glide = straight(tangent.position(), self.land);
        let zones = router.zones();
        let circle = self.circle(tangent);
        let clear = |s: &Segment| zones.is_segment_clear(s, limits.clearance_m);
        if !(circle.iter().all(clear) && zones.is_clear(&glide, limits.clearance_m)) {
            return Err(LandingError::NotClear);
        }
        let entries = (0..ENTRIES).map(|i| self.pose_at(TAU * f64::from(i) / f64::from(ENTRIES)));
        let ways = entries.filter_map(|entry| router.route(end, entry).ok());
        let shortest = ways.min_by(|a, b| a.length_m().total_cmp(&b.length_m()));
        Ok(Landing {
            pattern: *self,
            way: shortest.ok_or(LandingError::NoWay)?,
            glide,
        })
    }
}

/// A landing that is made for a UAV whose flight ends at a pose: with a glide of a length,
/// against a wind that blows there. `None` where no course is clear.
#[must_use]
pub fn made(
    router: &Router,
    end: Pose,
    land: Point,
    glide_m: f64,
    wind_mps: Vector,
) -> Option<Landing> {
    let radius_m = CIRCLE_RADII * router.limits().turn_radius_m;
    // Against the wind; in calm air as the flight ends.
    let wanted_rad = if wind_mps.norm() > 0.0 {
        atan2(-wind_mps.y, -wind_mps.x)
    } else {
        end.heading_rad
    };
    let step_rad = TAU / f64::from(COURSES);
    let courses = (0..=COURSES / 2).flat_map(|i| {
        let off_rad = step_rad * f64::from(i);
        [wanted_rad + off_rad, wanted_rad - off_rad]
    });
    let mut patterns = courses.flat_map(|course_rad| {
        [true, false].map(|right| Pattern::along(land, course_rad, glide_m, radius_m, right))
    });
    patterns.find_map(|pattern| pattern.landing(router, end).ok())
}

/// Length of a glide from a height at an angle, metres.
#[must_use]
pub fn glide_m(height_m: f64, angle_rad: f64) -> f64 {
    height_m * cos(angle_rad) / sin(angle_rad)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flown::Airspace;
    use proptest::prelude::*;
    use skein_geometry::math::wrap_pi;
    use skein_geometry::{NoFlyZones, Polygon};

    const RADIUS_M: f64 = 30.0;

    fn router(blocks: &[(f64, f64, f64, f64)]) -> Router {
        let zones = blocks.iter().map(|&(x, y, w, h)| {
            let corners = [(x, y), (x + w, y), (x + w, y + h), (x, y + h)];
            Polygon::new(corners.map(|(x, y)| Point::new(x, y)).to_vec()).unwrap()
        });
        let zones = NoFlyZones::new(zones.collect());
        let places = [Point::origin()].into_iter();
        Airspace::new(&zones, &[], places, 10.0)
            .unwrap()
            .router(RADIUS_M)
    }

    /// What a landing promises.
    fn check(landing: &Landing, router: &Router, end: Pose) {
        let Landing {
            pattern,
            way,
            glide,
        } = landing;
        let on_circle = |p: Point| ((p - pattern.centre).norm() - pattern.radius_m).abs() < 1e-3;
        let turning = |pose: &Pose| {
            let out = pose.position() - pattern.centre;
            let ahead = pose.direction();
            let turn = out.x * ahead.y - out.y * ahead.x;
            assert!(turn.abs() > 0.999 * pattern.radius_m);
            assert_eq!(turn < 0.0, pattern.clockwise);
        };
        let entry = way.end().unwrap_or(end);
        assert!((way.start().unwrap_or(end).position() - end.position()).norm() < 1e-6);
        assert!(on_circle(entry.position()));
        turning(&entry);
        let (leaves, lands) = (glide.start().unwrap(), glide.end().unwrap());
        assert!(on_circle(leaves.position()));
        turning(&leaves);
        assert!((lands.position() - pattern.land).norm() < 1e-6);
        for s in way.segments().iter().chain(glide.segments()) {
            assert!(router.zones().is_segment_clear(s, 9.999));
        }
        let around = pattern.circle(leaves);
        assert!(
            around
                .iter()
                .all(|s| router.zones().is_segment_clear(s, 9.999))
        );
    }

    #[test]
    fn a_landing_is_made_against_the_wind_and_beside_what_is_in_the_way() {
        let (land, end) = (Point::origin(), Pose::new(Point::origin(), 2.0));
        let free = router(&[]);
        let wind = Vector::new(-4.0, 0.0);
        let landing = made(&free, end, land, 380.0, wind).unwrap();
        check(&landing, &free, end);
        let course = landing.glide.start().unwrap().heading_rad;
        assert!(wrap_pi(course).abs() < 1e-9, "{course}");
        assert!((landing.glide.length_m() - 380.0).abs() < 1e-6);
        let calm = made(&free, end, land, 380.0, Vector::zeros()).unwrap();
        let course = calm.glide.start().unwrap().heading_rad;
        assert!(wrap_pi(course - 2.0).abs() < 1e-9);
        // A wall across the way from the west.
        let walled = router(&[(-300.0, -100.0, 40.0, 200.0)]);
        let landing = made(&walled, end, land, 380.0, wind).unwrap();
        check(&landing, &walled, end);
        // Walls all round: nobody lands in between.
        let ring = [
            (-150.0, -150.0, 300.0, 20.0),
            (-150.0, 130.0, 300.0, 20.0),
            (-150.0, -140.0, 20.0, 280.0),
            (130.0, -140.0, 20.0, 280.0),
        ];
        assert!(made(&router(&ring), end, land, 380.0, wind).is_none());
    }

    #[test]
    fn a_pattern_that_is_drawn_is_kept_or_it_is_said_what_is_wrong() {
        let end = Pose::new(Point::origin(), 0.0);
        let drawn = Pattern {
            land: Point::new(50.0, 20.0),
            centre: Point::new(-400.0, 90.0),
            radius_m: 75.0,
            clockwise: true,
        };
        let free = router(&[]);
        check(&drawn.landing(&free, end).unwrap(), &free, end);
        let other = Pattern {
            clockwise: false,
            ..drawn
        };
        check(&other.landing(&free, end).unwrap(), &free, end);
        let why = |pattern: Pattern, router: &Router| pattern.landing(router, end).unwrap_err();
        let near = Pattern {
            centre: Point::new(40.0, 60.0),
            ..drawn
        };
        assert_eq!(why(near, &free), LandingError::NoTangent);
        let lost = Pattern {
            centre: Point::new(f64::NAN, 0.0),
            ..drawn
        };
        assert_eq!(why(lost, &free), LandingError::NoTangent);
        let tight = Pattern {
            radius_m: 20.0,
            ..drawn
        };
        assert!(matches!(why(tight, &free), LandingError::TooTight { .. }));
        let blocked = router(&[(-200.0, -40.0, 20.0, 200.0)]);
        assert_eq!(why(drawn, &blocked), LandingError::NotClear);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn what_is_made_keeps_clear(
            blocks in prop::collection::vec((-500.0f64..460.0, -500.0f64..460.0, 10.0f64..120.0, 10.0f64..120.0), 0..6),
            wind in (-8.0f64..8.0, -8.0f64..8.0), heading in -3.1f64..3.1, glide_m in 60.0f64..500.0,
        ) {
            let router = router(&blocks);
            let end = Pose::new(Point::origin(), heading);
            let wind = Vector::new(wind.0, wind.1);
            if let Some(landing) = made(&router, end, Point::origin(), glide_m, wind) {
                check(&landing, &router, end);
            }
        }
    }
}
