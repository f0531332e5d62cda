//! Work that may take longer than a percept may wait: asked for by an output,
//! computed by the driver with [`solve`], answered by an input.

use crate::mission::Mission;
use skein_planning::coverage::area::CoverageLoop;
use skein_planning::coverage::area::backtracking::{Division, RingCell, Robot, divide};
use skein_planning::path::Router;
use std::sync::Arc;

/// What every UAV of a mission derives from it: the loop and the routes.
#[derive(Clone, Debug)]
pub struct Ground {
    /// The mission it was derived from.
    pub mission: Arc<Mission>,
    /// The loop on which all work.
    pub coverage_loop: Arc<CoverageLoop>,
    /// Routes that keep clear of the zones.
    pub router: Arc<Router>,
}

/// A problem to be solved beside the loop.
#[derive(Clone, Debug)]
pub enum Problem {
    /// Derive the common ground of a mission. Drivers of many peers may remember
    /// the answer by [`Mission::content_hash`].
    Ground(Arc<Mission>),
    /// Divide the open cells of the loop.
    Divide {
        /// The loop's cells.
        ring: Vec<RingCell>,
        /// The members of the round.
        robots: Vec<Robot>,
    },
}

/// The answer to a [`Problem`] of the same name.
#[derive(Clone, Debug)]
pub enum Answer {
    /// The common ground, or why there is none.
    Ground(Result<Arc<Ground>, String>),
    /// The division.
    Divide(Division),
}

/// Solves a problem. Pure; may take milliseconds.
#[must_use]
pub fn solve(problem: &Problem) -> Answer {
    match problem {
        Problem::Ground(mission) => Answer::Ground(mission.ground()),
        Problem::Divide { ring, robots } => Answer::Divide(divide(ring, robots)),
    }
}
