//! Which places zones part from where all take off: nobody comes to a station in a yard that is
//! shut, and it must not keep others from the chain.

use crate::coverage::ring::LoopProblem;
use crate::route::mesh::Mesh;
use skein_geometry::frame::Point;
use skein_geometry::offset::{Growth, Region, Zone, grow};

/// Zones are grown by this share of the clearance: outlines overshoot by half a percent, and what
/// is parted by them is surely parted by the clearance.
const SHARE: f64 = 0.99;

/// The free plane, as the launch point lies in it.
pub(super) struct Parts {
    /// None where no zone parts anything.
    free: Option<(Mesh, u32)>,
}

impl Parts {
    pub(super) fn of(problem: &LoopProblem) -> Self {
        Self {
            free: free_plane(problem),
        }
    }

    /// Whether zones surely part a place from the launch point.
    pub(super) fn is_parted(&self, p: Point) -> bool {
        self.free.as_ref().is_some_and(|(mesh, launch)| {
            let cell = mesh.locate(p).and_then(|cell| u32::try_from(cell).ok());
            cell.is_some_and(|cell| !mesh.joined(cell, *launch))
        })
    }
}

/// The plane between the grown zones, and the cell of the launch point; nothing where there is
/// none or where it cannot be told.
fn free_plane(problem: &LoopProblem) -> Option<(Mesh, u32)> {
    let growth = Growth::new(SHARE * problem.clearance_m).ok()?;
    let zones: Vec<Zone> = problem.zones.zones().iter().map(Zone::from).collect();
    let grown = grow(&zones, &growth).ok()?;
    let rings: Vec<&[Point]> = grown.regions.iter().flat_map(Region::rings).collect();
    if rings.is_empty() {
        return None;
    }
    let mesh = Mesh::around(&rings, &[problem.launch]).ok()?;
    let launch = u32::try_from(mesh.locate(problem.launch)?).ok()?;
    Some((mesh, launch))
}
