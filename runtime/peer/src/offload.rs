//! Work that may take longer than a percept may wait: asked for by an output,
//! computed by the driver with [`run`], answered by an input.

use crate::mission::{GeometryError, Mission};
use skein_flight::coverage::ring::CoverageLoop;
use skein_flight::coverage::ring::backtracking::{Division, RingCell, Uav};
use skein_flight::coverage::ring::division::{RouteNetwork, divide};
use skein_flight::route::Router;
use std::sync::Arc;

/// What every UAV of a mission derives from it: the loop and the routes.
#[derive(Clone, Debug)]
pub struct MissionGeometry {
    /// The mission it was derived from.
    pub mission: Arc<Mission>,
    /// The loop on which all work.
    pub coverage_loop: Arc<CoverageLoop>,
    /// Routes that keep clear of the zones.
    pub router: Arc<Router>,
}

impl MissionGeometry {
    /// Divides the open cells of its loop by the rule of its mission.
    #[must_use]
    pub fn divide(&self, ring: &[RingCell], uavs: &[Uav]) -> Division {
        let network = RouteNetwork {
            coverage_loop: &self.coverage_loop,
            router: &self.router,
        };
        divide(ring, uavs, network, self.mission.division)
    }
}

/// A problem to be solved beside the loop.
#[derive(Clone, Debug)]
pub enum Job {
    /// Derive the geometry of a mission. Drivers of many peers may remember the answer by [`Mission::content_hash`].
    Geometry(Arc<Mission>),
    /// Divide the open cells of the loop by the rule of its mission.
    Divide {
        /// On what they fly.
        geometry: Arc<MissionGeometry>,
        /// The loop's cells.
        ring: Vec<RingCell>,
        /// The members of the round.
        uavs: Vec<Uav>,
    },
}

/// The answer to a [`Job`] of the same name.
#[derive(Clone, Debug)]
pub enum JobResult {
    /// The geometry, or why there is none.
    Geometry(Result<Arc<MissionGeometry>, GeometryError>),
    /// The division.
    Divide(Division),
}

/// Solves a problem. Pure; may take milliseconds.
#[must_use]
pub fn run(job: &Job) -> JobResult {
    match job {
        Job::Geometry(mission) => JobResult::Geometry(mission.geometry()),
        Job::Divide {
            geometry,
            ring,
            uavs,
        } => JobResult::Divide(geometry.divide(ring, uavs)),
    }
}
