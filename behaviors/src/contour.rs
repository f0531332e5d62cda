//! What a UAV's camera sees of a contour: a road that is on no map, or the edge of a fire, as a
//! detector on board tells it (D2.7 §3.1).

use serde::{Deserialize, Serialize};
use skein_flight::tracing::thread::Look;
use skein_geometry::frame::Point;

/// Most places that one look tells.
pub const CONTOUR_MAX: usize = 16;

/// A place of a contour as one look saw it, with the error of the UAV's own place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ContourPlace {
    /// Where, millimetres east of the mission's origin.
    pub east_mm: i32,
    /// Where, millimetres north of it.
    pub north_mm: i32,
    /// Whether nothing was seen between the place before and this.
    pub begins: bool,
}

impl ContourPlace {
    fn at(&self) -> Point {
        Point::new(
            f64::from(self.east_mm) / 1000.0,
            f64::from(self.north_mm) / 1000.0,
        )
    }
}

/// All that one look tells of a contour: places in order along it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ContourLook {
    /// Whether there is a detector.
    looks: bool,
    /// Whether what the contour encloses is on the left.
    sided: bool,
    seen: [Option<ContourPlace>; CONTOUR_MAX],
}

impl ContourLook {
    /// A look: of more than [`CONTOUR_MAX`] places the first. `sided` says whether they are in
    /// such an order that what the contour encloses is on their left.
    #[must_use]
    pub fn new(sided: bool, in_order: impl IntoIterator<Item = ContourPlace>) -> Self {
        let mut seen = [None; CONTOUR_MAX];
        for (place, told) in seen.iter_mut().zip(in_order) {
            *place = Some(told);
        }
        Self {
            looks: true,
            sided,
            seen,
        }
    }

    /// Whether there is no detector.
    #[must_use]
    pub fn is_absent(&self) -> bool {
        !self.looks
    }

    /// What was seen.
    pub fn seen(&self) -> impl Iterator<Item = &ContourPlace> {
        self.seen.iter().flatten()
    }

    /// The pieces that were seen, in metres.
    #[must_use]
    pub fn look(&self) -> Look {
        let mut pieces: Vec<Vec<Point>> = Vec::new();
        for place in self.seen() {
            match pieces.last_mut().filter(|_| !place.begins) {
                Some(piece) => piece.push(place.at()),
                None => pieces.push(vec![place.at()]),
            }
        }
        Look {
            pieces,
            sided: self.sided,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_look_holds_so_many_places_and_falls_into_its_pieces() {
        assert!(ContourLook::default().is_absent());
        let places = (0..20).map(|k| ContourPlace {
            east_mm: 1000 * k,
            north_mm: 0,
            begins: k == 5,
        });
        let told = ContourLook::new(true, places);
        assert!(!told.is_absent() && told.seen().count() == CONTOUR_MAX);
        let look = told.look();
        assert!(look.sided);
        let sizes: Vec<usize> = look.pieces.iter().map(Vec::len).collect();
        assert_eq!(sizes, [5, 11]);
        assert!((look.pieces[1][0].x - 5.0).abs() < 1e-9);
    }
}
