//! What a peer tells of obstacles that are on no map: type, bytes and limits of the kind `obstacle`
//! (docs/protocol.md §11, D2.7 §1.2.3).
//!
//! One register holds all that its author knows, whoever found it; registers of all authors merge
//! by union.

use super::cbor::{Listed, array_of};
use super::codec::WireError;
use super::limits::{POSITION_MAX_MM, at_most, in_range};
use super::schema::{Place, Shape, at};
use serde::{Deserialize, Serialize};
use skein_behaviors::obstacle::Obstacle;

/// Obstacles that are known at most: of more those are known that come first in their order, to
/// everybody alike.
pub const FOUND_MAX: usize = 16;

/// How often one may be found again after an operator took it out, at most.
pub const AGAIN_MAX: u8 = 15;

const DM_MAX: i32 = POSITION_MAX_MM / 100;

/// The widest one, 0.1 m.
pub const RADIUS_MAX_DM: u16 = 5_000;

/// An obstacle that a UAV sensed and no map shows.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct Found {
    /// How often an operator has taken it out before.
    pub again: u8,
    /// Its middle, 0.1 m east of the origin.
    pub east_dm: i32,
    /// And north of it.
    pub north_dm: i32,
    /// All of it is nearer to its middle than this, 0.1 m.
    pub radius_dm: u16,
}

/// All that a peer knows.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct FoundObstacles {
    /// Each once.
    pub found: Vec<Found>,
}

array_of!(Found {
    again,
    east_dm,
    north_dm,
    radius_dm
});
array_of!(FoundObstacles { found });

impl Listed for Found {
    const MAX: usize = FOUND_MAX;
}

impl Found {
    /// Where it stands, and how wide it is.
    #[must_use]
    pub fn obstacle(&self) -> Obstacle {
        Obstacle {
            east_dm: self.east_dm,
            north_dm: self.north_dm,
            radius_dm: self.radius_dm,
        }
    }

    /// Whether it can be told.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        check_one(self).is_ok()
    }
}

fn check_one(f: &Found) -> Result<(), WireError> {
    in_range("again", f.again <= AGAIN_MAX)?;
    let near = |dm: i32| dm.unsigned_abs() <= DM_MAX.unsigned_abs();
    in_range("east_dm", near(f.east_dm))?;
    in_range("north_dm", near(f.north_dm))?;
    in_range("radius_dm", (1..=RADIUS_MAX_DM).contains(&f.radius_dm))
}

/// The first field that is out of range.
pub(super) fn check(o: &FoundObstacles) -> Result<(), WireError> {
    at_most("found", o.found.len(), FOUND_MAX)?;
    o.found.iter().try_for_each(check_one)
}

const DM: Shape = Shape::Number(-(DM_MAX as i128), DM_MAX as i128);

const FOUND: &[Place] = &[
    at(
        "again",
        "how often an operator has taken it out before",
        Shape::Number(0, AGAIN_MAX as i128),
    ),
    at(
        "east_dm",
        "its middle, 0.1 m east of the mission's origin",
        DM,
    ),
    at(
        "north_dm",
        "its middle, 0.1 m north of the mission's origin",
        DM,
    ),
    at(
        "radius_dm",
        "all of it is nearer to its middle than this, 0.1 m",
        Shape::Number(1, RADIUS_MAX_DM as i128),
    ),
];

/// The places of an obstacle's body.
pub(super) const OBSTACLES: &[Place] = &[at(
    "found",
    "obstacles that are on no map, each once",
    Shape::Rows(FOUND, FOUND_MAX),
)];

#[cfg(test)]
pub(crate) mod samples {
    use super::super::codec::Body;
    use super::*;

    /// A crane and a balloon.
    pub(crate) fn obstacles() -> FoundObstacles {
        let found = |again, east_dm, north_dm, radius_dm| Found {
            again,
            east_dm,
            north_dm,
            radius_dm,
        };
        FoundObstacles {
            found: vec![found(0, 3_204, -1_314, 170), found(1, 5_500, 2_290, 60)],
        }
    }

    /// The largest valid one.
    pub(crate) fn largest() -> Vec<Body> {
        let found = Found {
            again: AGAIN_MAX,
            east_dm: -DM_MAX,
            north_dm: -DM_MAX,
            radius_dm: RADIUS_MAX_DM,
        };
        vec![Body::Obstacles(FoundObstacles {
            found: vec![found; FOUND_MAX],
        })]
    }
}
