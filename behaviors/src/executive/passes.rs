//! How often what the plan has in a picture truly is there at the first pass (D2.7 §1.2.1).

use super::Executive;
use super::transit::CellVisit;
use skein_geometry::frame::Point;

/// What a UAV knows of the cells that it flew.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Passes {
    /// Cells that its camera saw whole.
    pub seen: u32,
    /// Cells that were flown for the first time, and not seen then.
    pub missed: u32,
}

impl Passes {
    /// A cell was flown and not seen.
    pub(super) fn miss(&mut self, visit: &CellVisit) {
        self.missed += u32::from(visit.tries == 0);
    }
}

impl Executive {
    /// What was seen and missed since this executive began.
    #[must_use]
    pub fn passes(&self) -> Passes {
        self.passes
    }

    /// The place on the ground that the plan has in the middle of the picture: straight below the
    /// track, while cells of the loop are flown.
    #[must_use]
    pub fn planned_ground(&self) -> Option<Point> {
        let serves = self
            .stretches
            .front()
            .is_some_and(|s| s.kind.cell().is_some());
        serves.then(|| self.track.pose())?.map(|p| p.position())
    }
}
