//! What a peer plans to have in its picture, beside which its world can lay what is there
//! (D2.7 §1.2.1).

use skein_behaviors::Executive;
pub use skein_behaviors::executive::passes::Passes;
use skein_geometry::frame::Point;

/// The picture that is planned.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Footprint {
    /// Its middle on the ground; none while nothing is to be seen.
    pub planned: Option<Point>,
    /// How often what was planned was missed, on this mission in this life.
    pub passes: Passes,
}

impl Footprint {
    pub(crate) fn of(executive: &Executive) -> Self {
        Self {
            planned: executive.planned_ground(),
            passes: executive.passes(),
        }
    }
}
