//! The shortest flyable route from here to there with clearance (D2.7 §2.3).

pub mod mesh;
pub mod two_point;
pub mod visibility;

use crate::frame::{Point, Pose};
use crate::geometry::NoFlyZones;
use crate::math::{TAU, atan2};
use crate::trajectory::{Curve, dubins};
use std::sync::Arc;
use thiserror::Error;

/// Slack for ends that lie on the clearance exactly, metres.
const ROUNDING_M: f64 = 1e-6;

/// Headings tried at a goal without one: every 45°, beside the two straight ones.
const GOAL_HEADINGS: u8 = 8;

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
/// Built once for a mission and a clearance class, shared by all UAVs of it.
#[derive(Clone, Debug)]
pub struct Router {
    zones: Arc<NoFlyZones>,
    limits: RouteLimits,
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

impl Router {
    /// A router round these zones within these limits.
    #[must_use]
    pub fn new(zones: Arc<NoFlyZones>, limits: RouteLimits) -> Self {
        Self { zones, limits }
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

    /// The shortest Dubins word from `from` to `to` that keeps clear; all six are tried.
    ///
    /// # Errors
    /// [`RouteError`]; a curve that fails its check is refused, never clipped.
    pub fn route(&self, from: Pose, to: Pose) -> Result<Curve, RouteError> {
        self.check_ends(from.position(), to.position())?;
        self.direct(from, to).ok_or(RouteError::NoRoute)
    }

    /// As [`Router::route`], for a goal whose heading does not matter.
    ///
    /// # Errors
    /// [`RouteError`].
    pub fn route_to_point(&self, from: Pose, to: Point) -> Result<Curve, RouteError> {
        self.check_ends(from.position(), to)?;
        let mut best: Option<Curve> = None;
        for heading_rad in self.headings_at(from, to) {
            if let Some(c) = self.direct(from, Pose::new(to, heading_rad))
                && best.as_ref().is_none_or(|b| c.length_m() < b.length_m())
            {
                best = Some(c);
            }
        }
        best.ok_or(RouteError::NoRoute)
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

    /// The shortest Dubins word that keeps clear.
    fn direct(&self, from: Pose, to: Pose) -> Option<Curve> {
        dubins::all(from, to, self.limits.turn_radius_m)
            .into_iter()
            .find(|c| self.zones.is_clear(c, self.limits.clearance_m))
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
        headings.extend((0..GOAL_HEADINGS).map(|i| TAU * f64::from(i) / f64::from(GOAL_HEADINGS)));
        headings
    }
}
