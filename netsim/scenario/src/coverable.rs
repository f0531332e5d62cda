//! What the world's own geometry says of an area: which cells a camera can see, and which
//! of those the planner's loop leaves out.

use crate::resolve::Scenario;
use skein_flight::coverage::ring::CellId;
use skein_peer::CoverageTask;

/// What can be seen of a scenario's area, by the world's own geometry.
#[derive(Clone, Debug, PartialEq)]
pub struct Coverable {
    /// All cells.
    pub n_cells: usize,
    /// Cells that some UAV can see whole on a straight pass.
    pub n_coverable: usize,
    /// Share of the area that those cover, 0 to 1.
    pub share: f64,
    /// Cells that could be seen and are not on the planner's loop.
    pub missed: Vec<CellId>,
}

impl Coverable {
    /// Compares what can be seen of a scenario's area with the loop of its mission.
    #[must_use]
    pub fn of(scenario: &Scenario) -> Self {
        let survey = &scenario.survey;
        let the_loop = &scenario.geometry.coverage_loop;
        let open = survey.cells().iter().filter(|c| c.uncoverable.is_none());
        Self {
            n_cells: survey.cells().len(),
            n_coverable: survey.n_coverable(),
            share: survey.coverable_share(),
            // Squares and pieces of the world's own have no names on the loop.
            missed: match scenario.spec.mission.task {
                CoverageTask::Area | CoverageTask::Points(_) => open
                    .map(|c| c.id)
                    .filter(|id| the_loop.index_of(*id).is_none())
                    .collect(),
                CoverageTask::Exact | CoverageTask::Lines(_) => Vec::new(),
            },
        }
    }
}
