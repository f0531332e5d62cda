//! What a UAV's camera sees of vehicles on the ground: places as a detector on board tells
//! them, each with its error (D2.7 §1.5.2, §3.7).

use serde::{Deserialize, Serialize};
use skein_geometry::frame::Point;

/// Most vehicles that one look tells, the surest first: a car park that fits into a picture.
pub const SIGHTINGS_MAX: usize = 24;

/// One vehicle as one look saw it, or something that was taken for one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sighted {
    /// Where, millimetres east of the mission's origin.
    pub east_mm: i32,
    /// Where, millimetres north of it.
    pub north_mm: i32,
    /// The standard deviation of that place in the worst direction, mm; an error that the
    /// UAV's own place has for the whole flight is not part of it.
    pub spread_mm: u32,
    /// What it looks like: a class of vehicle, as the detector tells it.
    pub kind: u8,
}

impl Sighted {
    /// Where, in metres.
    #[must_use]
    pub fn at(&self) -> Point {
        Point::new(
            f64::from(self.east_mm) / 1000.0,
            f64::from(self.north_mm) / 1000.0,
        )
    }
}

/// All that one look tells of vehicles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sightings {
    /// Whether there is a detector.
    looks: bool,
    seen: [Option<Sighted>; SIGHTINGS_MAX],
}

impl Sightings {
    /// A look: of more than [`SIGHTINGS_MAX`] the first.
    #[must_use]
    pub fn new(surest_first: impl IntoIterator<Item = Sighted>) -> Self {
        let mut seen = [None; SIGHTINGS_MAX];
        for (place, sighted) in seen.iter_mut().zip(surest_first) {
            *place = Some(sighted);
        }
        Self { looks: true, seen }
    }

    /// Whether there is no detector.
    #[must_use]
    pub fn is_absent(&self) -> bool {
        !self.looks
    }

    /// What was seen.
    pub fn seen(&self) -> impl Iterator<Item = &Sighted> {
        self.seen.iter().flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_look_holds_so_many_and_no_look_is_not_an_empty_one() {
        assert!(Sightings::default().is_absent());
        let look = Sightings::new([]);
        assert!(!look.is_absent() && look.seen().count() == 0);
        let many = (0..40).map(|east_mm| Sighted {
            east_mm,
            ..Sighted::default()
        });
        let look = Sightings::new(many);
        assert_eq!(look.seen().count(), SIGHTINGS_MAX);
        assert!((look.seen().last().unwrap().at().x - 0.023).abs() < 1e-9);
    }
}
