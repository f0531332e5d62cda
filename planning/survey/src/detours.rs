//! Shortest ways round no-fly zones with clearance, for flights from target to target
//! (D2.7 §3.4: costs are the lengths of shortest paths between the points).
//!
//! Leaves to others: curves, and what a file's zones are.

use skein_flight::route::mesh::{Mesh, MeshError};
use skein_flight::route::two_point::Search;
use skein_geometry::frame::Point;
use skein_geometry::offset::{Grown, Growth, OffsetError, Region, Zone, grow};
use thiserror::Error;

/// Why there are no ways round the zones. Nothing was planned.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum DetourError {
    /// The clearance is no length.
    #[error("the clearance")]
    Clearance(#[source] OffsetError),
    /// The zones cannot be grown by it.
    #[error("the no-fly zones cannot be grown")]
    Zones(#[source] OffsetError),
    /// What they leave free cannot be cut into a mesh.
    #[error("the grown zones have no mesh")]
    Mesh(#[source] MeshError),
}

/// Grown zones and the mesh of what they leave free.
pub struct Detours {
    grown: Grown,
    mesh: Option<Mesh>,
}

impl Detours {
    /// Zones to keep `clearance_m` from, and the places that ways will lead to.
    ///
    /// # Errors
    /// When the clearance is no length or the zones cannot be grown.
    pub fn new(zones: &[Zone], clearance_m: f64, places: &[Point]) -> Result<Self, DetourError> {
        let growth = Growth::new(clearance_m).map_err(DetourError::Clearance)?;
        let grown = grow(zones, &growth).map_err(DetourError::Zones)?;
        let rings: Vec<&[Point]> = grown.regions.iter().flat_map(Region::rings).collect();
        if rings.is_empty() {
            return Ok(Self { grown, mesh: None });
        }
        let mesh = Mesh::around(&rings, places).map_err(DetourError::Mesh)?;
        Ok(Self {
            grown,
            mesh: Some(mesh),
        })
    }

    /// Whether there is anything to fly round.
    #[must_use]
    pub fn is_needed(&self) -> bool {
        self.mesh.is_some()
    }

    /// Outlines and holes of the grown zones.
    #[must_use]
    pub fn rings(&self) -> Vec<&[Point]> {
        self.grown.regions.iter().flat_map(Region::rings).collect()
    }

    /// Whether a place is nearer to a zone than the clearance.
    #[must_use]
    pub fn forbids(&self, p: Point) -> bool {
        self.grown.contains(p)
    }

    /// Memory for many questions.
    #[must_use]
    pub fn search(&self) -> DetourSearch<'_> {
        DetourSearch {
            search: self.mesh.as_ref().map(Search::new),
        }
    }
}

/// Answers questions about ways.
pub struct DetourSearch<'a> {
    search: Option<Search<'a>>,
}

impl DetourSearch<'_> {
    /// The shortest way, both ends included; `None` when there is none.
    pub fn way(&mut self, from: Point, to: Point) -> Option<Vec<Point>> {
        match &mut self.search {
            Some(search) => search.shortest(from, to),
            None => Some(vec![from, to]),
        }
    }

    /// Whether the straight way keeps the clearance.
    pub fn is_straight(&mut self, from: Point, to: Point) -> bool {
        self.way(from, to).is_some_and(|way| way.len() <= 2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ways_lead_round_a_zone_with_clearance() {
        let square = |half: f64| {
            [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(x, y)| Point::new(x * half, y * half))
                .to_vec()
        };
        let zone = Zone {
            outer: square(50.0),
            holes: Vec::new(),
        };
        let (a, b) = (Point::new(-200.0, 0.0), Point::new(200.0, 0.0));
        let detours = Detours::new(&[zone], 10.0, &[a, b]).unwrap();
        assert!(detours.is_needed() && detours.forbids(Point::new(55.0, 0.0)));
        let mut search = detours.search();
        let way = search.way(a, b).unwrap();
        assert!(way.len() > 2 && !search.is_straight(a, b));
        assert!(search.is_straight(a, Point::new(-200.0, 300.0)));
        assert_eq!(search.way(a, Point::new(0.0, 0.0)), None);
        let free = Detours::new(&[], 10.0, &[a, b]).unwrap();
        assert!(!free.is_needed());
        assert_eq!(free.search().way(a, b), Some(vec![a, b]));
        assert!(Detours::new(&[], f64::NAN, &[]).is_err());
    }
}
