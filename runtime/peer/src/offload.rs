//! Work that may take longer than a percept may wait: asked for by an output,
//! computed by the driver with [`run`], answered by an input.

use crate::config::Launch;
use crate::errand;
use crate::mission::{GeometryError, Mission};
use crate::protocol::launches::{self, Planned};
use skein_flight::coverage::ring::CoverageLoop;
use skein_flight::coverage::ring::backtracking::{Division, RingCell, Uav};
use skein_flight::coverage::ring::division::{RouteNetwork, divide};
use skein_flight::route::Router;
use skein_flight::tracking::buildings::Town;
use skein_geometry::frame::Point;
use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

/// Turning round and coming onto a stretch is reckoned as so many turn radii: 7π/3.
const TURN_RADII: u32 = 7;

/// What every UAV of a mission derives from it: the loop and the routes.
#[derive(Clone, Debug)]
pub struct MissionGeometry {
    /// The mission it was derived from.
    pub mission: Arc<Mission>,
    /// The loop on which all work.
    pub coverage_loop: Arc<CoverageLoop>,
    /// Routes that keep clear of the zones.
    pub router: Arc<Router>,
    /// Buildings and streets, where the mission tells of any.
    pub town: Option<Arc<Town>>,
    launched: OnceLock<(Vec<Launch>, Vec<Planned>)>,
}

impl MissionGeometry {
    /// A loop and routes derived from a mission.
    #[must_use]
    pub fn new(mission: Arc<Mission>, coverage_loop: CoverageLoop, router: Router) -> Self {
        Self {
            town: mission.town(),
            mission,
            coverage_loop: Arc::new(coverage_loop),
            router: Arc::new(router),
            launched: OnceLock::new(),
        }
    }

    /// Whether UAVs may loiter above the base.
    ///
    /// # Errors
    /// A sentence that says how near a no-fly zone is.
    pub fn base_is_clear(&self) -> Result<(), String> {
        self.may_be_base(self.mission.base_m())
    }

    /// Whether UAVs may loiter above a place, were it the base.
    ///
    /// # Errors
    /// A sentence that says how near a no-fly zone is.
    pub fn may_be_base(&self, place: Point) -> Result<(), String> {
        let clearance_m = self.mission.clearance_m();
        let base_m = self.router.zones().distance_m(place);
        if base_m < clearance_m {
            return Err(format!(
                "its base is {base_m:.1} m from a no-fly zone; expected at least the clearance of {clearance_m:.1} m"
            ));
        }
        Ok(())
    }

    /// The sections that a roster begins with. Those of the first roster are remembered: peers
    /// of one process share the geometry.
    #[must_use]
    pub fn first_division(&self, roster: &[Launch]) -> Cow<'_, [Planned]> {
        let turn_mm = self.mission.turn_radius_mm.saturating_mul(TURN_RADII);
        let divide = || launches::first_division(roster, &self.coverage_loop, turn_mm);
        let (of, planned) = self.launched.get_or_init(|| (roster.to_vec(), divide()));
        if of == roster {
            Cow::Borrowed(planned)
        } else {
            Cow::Owned(divide())
        }
    }

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
    /// Plan the flight that does a task.
    Errand(Box<errand::Request>),
}

/// The answer to a [`Job`] of the same name.
#[derive(Clone, Debug)]
pub enum JobResult {
    /// The geometry, or why there is none.
    Geometry(Result<Arc<MissionGeometry>, GeometryError>),
    /// The division.
    Divide(Division),
    /// The flight, or why there is none.
    Errand(Result<errand::Planned, String>),
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
        Job::Errand(request) => JobResult::Errand(request.plan()),
    }
}
