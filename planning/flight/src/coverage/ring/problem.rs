//! What a coverage loop is laid for, and which figures are refused (D2.7 §3.6).

use super::error::LoopError;
use super::tree::Tree;
use crate::route::Router;
use skein_geometry::frame::{Point, Pose};
use skein_geometry::math::TAU;
use skein_geometry::{Curve, NoFlyZones, Polygon, contingency_clear};
use std::sync::Arc;

/// Gates of a loop that are tried from the launch point, and headings there.
const LAUNCH_GATES: usize = 8;
/// See [`LAUNCH_GATES`].
const LAUNCH_HEADINGS: u8 = 8;

/// What is to be covered, and with what.
#[derive(Clone, Debug)]
pub struct LoopProblem {
    /// The area to see.
    pub area: Polygon,
    /// Where nobody may fly.
    pub zones: Arc<NoFlyZones>,
    /// Side of a cell, metres.
    pub lane_spacing_m: f64,
    /// Smallest turn radius of all UAVs of the mission, metres.
    pub turn_radius_m: f64,
    /// Distance that every curve keeps from the zones, metres.
    pub clearance_m: f64,
    /// Half the camera footprint across the track, metres.
    pub footprint_across_m: f64,
    /// Half the camera footprint along the track, metres.
    pub footprint_along_m: f64,
    /// How far a UAV may stray from its curve, metres; taken off the footprint.
    pub tracking_error_m: f64,
    /// A point from which the loop must be reachable (a launch point).
    pub launch: Point,
    /// Which spanning tree the loop goes round.
    pub tree: Tree,
}

impl LoopProblem {
    /// Whether a curve keeps the clearance, and a UAV that has to loiter anywhere on it
    /// stays out of the zones.
    pub(in crate::coverage) fn flyable(&self, curve: &Curve) -> bool {
        self.zones.is_clear(curve, self.clearance_m) && self.contingency_clear(curve)
    }

    /// Whether one of some gates, evenly spread over all, can be reached from the launch
    /// point, whatever the heading there. More than one gate only matters where a zone
    /// crowds the first.
    pub(in crate::coverage) fn launch_reaches(&self, router: &Router, gates: &[Pose]) -> bool {
        let heading = |i: u8| TAU * f64::from(i) / f64::from(LAUNCH_HEADINGS);
        gates
            .iter()
            .step_by(gates.len().div_ceil(LAUNCH_GATES).max(1))
            .any(|&gate| {
                (0..LAUNCH_HEADINGS).any(|i| {
                    let pose = Pose::new(self.launch, heading(i));
                    router.route(pose, gate).is_ok()
                })
            })
    }

    /// A way round the zones on which a UAV may have to loiter anywhere.
    pub(in crate::coverage) fn routed(
        &self,
        router: &Router,
        from: Pose,
        to: Pose,
    ) -> Option<Curve> {
        let way = router.route(from, to).ok();
        way.filter(|curve| self.contingency_clear(curve))
    }

    /// Whether a UAV that has to loiter anywhere on the curve stays out of the zones.
    pub(in crate::coverage) fn contingency_clear(&self, curve: &Curve) -> bool {
        // Farther out than a loiter is wide, no circle reaches a zone.
        self.clearance_m >= 2.0 * self.turn_radius_m + self.tracking_error_m
            || contingency_clear(
                &self.zones,
                curve,
                self.turn_radius_m,
                self.clearance_m / 2.0,
            )
    }
}

/// Refuses lengths that have no meaning.
pub(in crate::coverage) fn check_figures(problem: &LoopProblem) -> Result<(), LoopError> {
    let d = problem.lane_spacing_m;
    let positive = [(d, "lane spacing"), (problem.turn_radius_m, "turn radius")];
    let not_negative = [
        (problem.clearance_m, "clearance"),
        (problem.footprint_across_m, "footprint across the track"),
        (problem.footprint_along_m, "footprint along the track"),
        (problem.tracking_error_m, "tracking error"),
    ];
    let bad = |(value, name): (f64, &'static str), least: f64| {
        (!value.is_finite() || value < least).then_some(LoopError::Number(name))
    };
    // A millimetre is the unit of the loop, so nothing smaller is a length.
    if let Some(e) = positive.into_iter().find_map(|v| bad(v, 1e-3)) {
        return Err(e);
    }
    if let Some(e) = not_negative.into_iter().find_map(|v| bad(v, 0.0)) {
        return Err(e);
    }
    Ok(())
}

/// Refuses a launch point inside a zone's clearance.
pub(in crate::coverage) fn check_launch(problem: &LoopProblem) -> Result<(), LoopError> {
    if problem.zones.distance_m(problem.launch) < problem.clearance_m {
        return Err(LoopError::Launch);
    }
    Ok(())
}
