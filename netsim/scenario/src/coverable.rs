//! What the world's own geometry says of an area: which cells a camera can see, and which
//! of those the planner's loop leaves out.

use crate::resolve::Scenario;
use skein_flight::coverage::ring::CellId;

/// What can be seen of a scenario's area, by the world's own geometry.
#[derive(Clone, Debug, PartialEq)]
pub struct Coverable {
    /// All cells.
    pub n_cells: usize,
    /// Cells that some UAV can see whole on a straight pass.
    pub n_coverable: usize,
    /// Share of the area that those cover, 0 to 1.
    pub share: f64,
    /// Cells that could be seen and that the planner leaves out, by the world's names.
    pub missed: Vec<CellId>,
}

impl Coverable {
    /// Compares what can be seen of a scenario's area with the loop of its mission.
    #[must_use]
    pub fn of(scenario: &Scenario) -> Self {
        let survey = &scenario.survey;
        Self {
            n_cells: survey.cells().len(),
            n_coverable: survey.n_coverable(),
            share: survey.coverable_share(),
            missed: survey.left_out(&scenario.geometry),
        }
    }
}
