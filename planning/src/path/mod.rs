//! The shortest flyable route from here to there with clearance (D2.7 §2.3).

use crate::frame::{Point, Pose};
use crate::geometry::{NoFlyZones, ZoneError};
use crate::trajectory::Curve;
use std::sync::Arc;
use thiserror::Error;

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
    /// Prepares the offset zones and the obstacle graph.
    ///
    /// # Errors
    /// [`ZoneError`] when a zone cannot be offset safely.
    pub fn new(zones: Arc<NoFlyZones>, limits: RouteLimits) -> Result<Self, ZoneError> {
        Ok(Self { zones, limits })
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

    /// A curve from `from` to `to`: the shortest clear Dubins word, else along the
    /// visibility graph of the offset zones, smoothed and checked.
    ///
    /// # Errors
    /// [`RouteError`]; a curve that fails its check is refused, never clipped.
    pub fn route(&self, from: Pose, to: Pose) -> Result<Curve, RouteError> {
        let c = self.limits.clearance_m;
        if self.zones.distance_m(to.position()) < c {
            return Err(RouteError::GoalInZone);
        }
        let words = crate::trajectory::dubins::all(from, to, self.limits.turn_radius_m);
        words.into_iter().find(|w| self.zones.is_clear(w, c)).ok_or(RouteError::NoRoute)
    }

    /// As [`Router::route`], for a goal whose heading does not matter.
    ///
    /// # Errors
    /// [`RouteError`].
    pub fn route_to_point(&self, from: Pose, to: Point) -> Result<Curve, RouteError> {
        let mut best: Option<Curve> = None;
        for k in 0..16 {
            let heading_rad = f64::from(k) * crate::math::TAU / 16.0;
            if let Ok(c) = self.route(from, Pose::new(to, heading_rad))
                && best.as_ref().is_none_or(|b| c.length_m() < b.length_m())
            {
                best = Some(c);
            }
        }
        best.ok_or(RouteError::NoRoute)
    }
}
