//! The shortest flyable route from here to there with clearance (D2.7 §2.3).
//!
//! Two questions are kept apart. [`two_point`] knows the shortest path of a point among
//! polygons. [`Router`] gives what a fixed wing flies: curves of lines and arcs
//! that keep the clearance from the zones exactly as they are, and that bend round
//! them where no Dubins word is clear. A curve that fails its check is refused,
//! never clipped.

#[cfg(test)]
mod degenerate_maps;
pub mod lower_bounds;
pub mod mesh;
#[cfg(test)]
mod mesh_properties;
mod search;
mod straight_ends;
mod tangent_circles;
#[cfg(test)]
mod tests;
pub mod two_point;
pub mod visibility_step;

use crate::trajectory::dubins;
use search::Search;
use skein_geometry::Curve;
use skein_geometry::NoFlyZones;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::{TAU, atan2};
use std::sync::Arc;
use tangent_circles::{Circle, Wheels};
use thiserror::Error;

/// Slack for ends that lie on the clearance exactly, metres.
const ROUNDING_M: f64 = 1e-6;

/// Headings tried at a point without one: every 45°, beside the straight ones.
const POINT_HEADINGS: u8 = 8;

/// What a route must respect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RouteLimits {
    /// Smallest turn radius, metres.
    pub turn_radius_m: f64,
    /// Distance kept from the original zones along the whole curve, metres.
    pub clearance_m: f64,
}

/// Answers "how do I fly from this pose to that pose without entering a zone".
///
/// Built once for a mission and a clearance class, shared by all UAVs of it: what
/// one question finds out about the zones serves the next. Answers do not depend on
/// what was asked before.
#[derive(Clone, Debug)]
pub struct Router {
    zones: Arc<NoFlyZones>,
    limits: RouteLimits,
    wheels: Arc<Wheels>,
}

/// Why there is no route.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RouteError {
    /// The start is closer to a zone than the clearance.
    #[error("the start is inside a no-fly zone or its clearance")]
    StartInZone,
    /// The goal is closer to a zone than the clearance.
    #[error("the goal is inside a no-fly zone or its clearance")]
    GoalInZone,
    /// No curve of the limits was found that keeps clear.
    #[error("no flyable route keeps clear of the zones")]
    NoRoute,
}

/// Where a route ends.
#[derive(Clone, Copy, Debug)]
enum Goal {
    Pose(Pose),
    Point(Point),
}

impl Goal {
    fn position(&self) -> Point {
        match self {
            Self::Pose(pose) => pose.position(),
            Self::Point(point) => *point,
        }
    }

    fn heading_rad(&self) -> Option<f64> {
        match self {
            Self::Pose(pose) => Some(pose.heading_rad),
            Self::Point(_) => None,
        }
    }

    /// The circles on which a route can end: a point is a circle of no size.
    fn circles(&self, turn_radius_m: f64) -> Vec<Circle> {
        match self {
            Self::Pose(pose) => [1.0, -1.0]
                .map(|side| Circle::beside(*pose, turn_radius_m, side))
                .to_vec(),
            Self::Point(centre) => vec![Circle {
                centre: *centre,
                radius_m: 0.0,
                side: 1.0,
            }],
        }
    }
}

impl Router {
    /// A router round these zones within these limits.
    #[must_use]
    pub fn new(zones: Arc<NoFlyZones>, limits: RouteLimits) -> Self {
        let wheels = Arc::new(Wheels::new(&zones, &limits));
        Self {
            zones,
            limits,
            wheels,
        }
    }

    /// The zones this router avoids.
    #[must_use]
    pub fn zones(&self) -> &Arc<NoFlyZones> {
        &self.zones
    }

    /// The limits this router keeps.
    #[must_use]
    pub fn limits(&self) -> RouteLimits {
        self.limits
    }

    /// The shortest curve found from `from` to `to` that keeps clear: a Dubins word,
    /// or one that bends round corners of the zones.
    ///
    /// # Guarantees
    /// Every piece keeps the clearance from the zones as given and bends no more than
    /// the turn radius allows. Where the shortest Dubins word is clear it is the
    /// answer. Work is bounded.
    ///
    /// # Errors
    /// [`RouteError`]; a curve that fails its check is refused, never clipped.
    pub fn route(&self, from: Pose, to: Pose) -> Result<Curve, RouteError> {
        self.check_ends(from.position(), to.position())?;
        self.find(from, Goal::Pose(to)).ok_or(RouteError::NoRoute)
    }

    /// As [`Router::route`], for a goal whose heading does not matter.
    ///
    /// # Errors
    /// [`RouteError`].
    pub fn route_to_point(&self, from: Pose, to: Point) -> Result<Curve, RouteError> {
        self.check_ends(from.position(), to)?;
        // Near zones a heading that no straight way gives may be the only one.
        let any_heading = || {
            self.headings_at(from, to)
                .into_iter()
                .find_map(|h| self.find(from, Goal::Pose(Pose::new(to, h))))
        };
        self.find(from, Goal::Point(to))
            .or_else(any_heading)
            .ok_or(RouteError::NoRoute)
    }

    fn check_ends(&self, from: Point, to: Point) -> Result<(), RouteError> {
        // A distance that is no number fails both comparisons' negations.
        let clear = |p: Point| {
            p.x.is_finite()
                && p.y.is_finite()
                && self.zones.distance_m(p) >= self.limits.clearance_m - ROUNDING_M
        };
        if !clear(from) {
            return Err(RouteError::StartInZone);
        }
        if !clear(to) {
            return Err(RouteError::GoalInZone);
        }
        Ok(())
    }

    /// Direct, else round the corners, else with straight pieces at the ends.
    fn find(&self, from: Pose, goal: Goal) -> Option<Curve> {
        let (direct, nothing_shorter) = self.direct(from, goal);
        if nothing_shorter {
            return direct;
        }
        let limit_m = direct.as_ref().map_or(f64::INFINITY, Curve::length_m);
        self.search()
            .run(from, goal, limit_m)
            .or(direct)
            .or_else(|| self.with_loose_ends(from, goal))
    }

    fn search(&self) -> Search<'_> {
        Search {
            zones: &self.zones,
            limits: self.limits,
            wheels: &self.wheels,
        }
    }

    /// The shortest Dubins word that keeps clear, and whether no word is shorter.
    fn direct(&self, from: Pose, goal: Goal) -> (Option<Curve>, bool) {
        let r = self.limits.turn_radius_m;
        let words = match goal {
            Goal::Pose(to) => dubins::all(from, to, r),
            Goal::Point(to) => {
                let mut words: Vec<(f64, Curve)> = self
                    .headings_at(from, to)
                    .into_iter()
                    .flat_map(|h| dubins::all(from, Pose::new(to, h), r))
                    .map(|c| (c.length_m(), c))
                    .collect();
                words.sort_by(|a, b| a.0.total_cmp(&b.0));
                words.into_iter().map(|(_, c)| c).collect()
            }
        };
        let clear = words
            .iter()
            .position(|c| self.zones.is_clear(c, self.limits.clearance_m));
        (clear.map(|i| words[i].clone()), clear == Some(0))
    }

    /// Headings worth trying at a goal that has none: those at which a turn to
    /// either side runs straight on to the goal, and all around.
    fn headings_at(&self, from: Pose, to: Point) -> Vec<f64> {
        let r = self.limits.turn_radius_m;
        let d = from.direction();
        let mut headings = Vec::new();
        for turn in [1.0, -1.0] {
            let centre = Point::new(from.east_m - turn * r * d.y, from.north_m + turn * r * d.x);
            let v = to - centre;
            let straight = v.norm_squared() - r * r;
            if straight > 0.0 {
                headings.push(atan2(v.y, v.x) + turn * atan2(r, straight.sqrt()));
            }
        }
        headings.extend(all_around());
        headings
    }
}

fn all_around() -> impl Iterator<Item = f64> {
    (0..POINT_HEADINGS).map(|i| TAU * f64::from(i) / f64::from(POINT_HEADINGS))
}
