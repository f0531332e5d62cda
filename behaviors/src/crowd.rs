//! What a UAV's camera sees of a crowd: people by small squares of the ground, as a recognition
//! subsystem on board estimates them (D2.7 §1.2.1, §3.1). Nobody has a name.

use serde::{Deserialize, Serialize};
use skein_geometry::frame::Point;

/// The side of a square, metres. Squares are anchored at the mission's origin.
pub const SQUARE_M: f64 = 10.0;

/// Most squares that one look tells: a picture of 190 m by 100 m.
pub const SQUARES_MAX: usize = 192;

/// So many of the people in a picture are recognised at least and at most: a recogniser is
/// specified by that, and nobody knows more exactly how good it is in the light of the day.
pub const RECOGNISED: (f64, f64) = (0.80, 0.90);

/// People who are not there are seen in a square so often, on the mean.
pub const FALSE_EACH: f64 = 0.2;

/// A square with what was recognised in it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Square {
    /// Its column, counted to the east from the mission's origin.
    pub col: i16,
    /// Its row, counted to the north.
    pub row: i16,
    /// How many people were recognised in it.
    pub people: u16,
}

impl Square {
    /// The square in which a place lies, with nobody in it.
    #[must_use]
    #[allow(
        clippy::cast_possible_truncation,
        reason = "missions end at 20 km: 2,000 squares"
    )]
    pub fn at(p: Point) -> Self {
        Self {
            col: (p.x / SQUARE_M).floor() as i16,
            row: (p.y / SQUARE_M).floor() as i16,
            people: 0,
        }
    }

    /// Its corners, counter-clockwise from the south-west one.
    #[must_use]
    pub fn corners(&self) -> [Point; 4] {
        let (x, y) = (
            SQUARE_M * f64::from(self.col),
            SQUARE_M * f64::from(self.row),
        );
        let far = SQUARE_M;
        [(0.0, 0.0), (far, 0.0), (far, far), (0.0, far)]
            .map(|(east, north)| Point::new(x + east, y + north))
    }
}

/// All that one look tells of a crowd: squares that were wholly in the picture, empty ones too.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "Told", into = "Told")]
pub struct CrowdLook {
    /// Whether it was looked for people.
    looks: bool,
    n: u16,
    seen: [Square; SQUARES_MAX],
}

/// The same as it is written.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Told {
    looks: bool,
    seen: Vec<Square>,
}

impl From<Told> for CrowdLook {
    fn from(told: Told) -> Self {
        if told.looks {
            Self::new(told.seen)
        } else {
            Self::default()
        }
    }
}

impl From<CrowdLook> for Told {
    fn from(look: CrowdLook) -> Self {
        Self {
            looks: look.looks,
            seen: look.seen().to_vec(),
        }
    }
}

impl Default for CrowdLook {
    fn default() -> Self {
        Self {
            looks: false,
            n: 0,
            seen: [Square::default(); SQUARES_MAX],
        }
    }
}

impl CrowdLook {
    /// A look: of more than [`SQUARES_MAX`] squares the first.
    #[must_use]
    pub fn new(squares: impl IntoIterator<Item = Square>) -> Self {
        let mut look = Self {
            looks: true,
            ..Self::default()
        };
        for (place, square) in look.seen.iter_mut().zip(squares) {
            *place = square;
            look.n += 1;
        }
        look
    }

    /// Whether it was not looked for people at this moment.
    #[must_use]
    pub fn is_absent(&self) -> bool {
        !self.looks
    }

    /// What was seen.
    #[must_use]
    pub fn seen(&self) -> &[Square] {
        &self.seen[..usize::from(self.n).min(SQUARES_MAX)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_look_holds_so_many_squares_and_survives_being_written() {
        assert!(CrowdLook::default().is_absent());
        let squares = (0..300).map(|col| Square {
            col,
            row: -2,
            people: 7,
        });
        let look = CrowdLook::new(squares);
        assert!(!look.is_absent() && look.seen().len() == SQUARES_MAX);
        assert_eq!(CrowdLook::from(Told::from(look)), look);
        assert!(CrowdLook::from(Told::default()).is_absent());
    }

    #[test]
    fn squares_are_anchored_at_the_origin() {
        let square = Square::at(Point::new(-0.5, 19.0));
        assert_eq!((square.col, square.row), (-1, 1));
        let [low, .., high] = square.corners();
        assert_eq!(
            (low, high),
            (Point::new(-10.0, 10.0), Point::new(-10.0, 20.0))
        );
    }
}
