//! What a UAV tells of aircraft that are no members, as it senses them: type, bytes and limits of
//! the kind `aircraft` (docs/protocol.md §11, D2.7 §1.2.3).

use super::cbor::{Listed, array_of};
use super::codec::WireError;
use super::limits::{POSITION_MAX_MM, at_most, in_range};
use super::schema::{Place, Shape, at};
use super::target::{TIME_MAX_MS, TIME_MS};
use serde::{Deserialize, Serialize};
use skein_behaviors::traffic::Aircraft;

/// Aircraft that are told at a time, the nearest.
pub const SENSED_MAX: usize = 4;

const DM_MAX: i32 = POSITION_MAX_MM / 100;

/// What it senses at one moment.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct SensedAircraft {
    /// When, milliseconds of the clock of percepts.
    pub at_ms: u64,
    /// Which, where and how fast.
    pub seen: Vec<Aircraft>,
}

array_of!(Aircraft {
    east_dm,
    north_dm,
    height_dm,
    east_dmps,
    north_dmps
});
array_of!(SensedAircraft { at_ms, seen });

impl Listed for Aircraft {
    const MAX: usize = SENSED_MAX;
}

/// The first field that is out of range.
pub(super) fn check(s: &SensedAircraft) -> Result<(), WireError> {
    in_range("at_ms", s.at_ms <= TIME_MAX_MS)?;
    at_most("seen", s.seen.len(), SENSED_MAX)?;
    let near = |dm: i32| dm.unsigned_abs() <= DM_MAX.unsigned_abs();
    in_range("east_dm", s.seen.iter().all(|a| near(a.east_dm)))?;
    in_range("north_dm", s.seen.iter().all(|a| near(a.north_dm)))?;
    in_range("height_dm", s.seen.iter().all(|a| near(a.height_dm)))
}

const DM: Shape = Shape::Number(-(DM_MAX as i128), DM_MAX as i128);
const DMPS: Shape = Shape::Number(i16::MIN as i128, i16::MAX as i128);

const AIRCRAFT: &[Place] = &[
    at("east_dm", "0.1 m east of the mission's origin", DM),
    at("north_dm", "0.1 m north of the mission's origin", DM),
    at("height_dm", "0.1 m above the mission's origin", DM),
    at("east_dmps", "over the ground, 0.1 m/s to the east", DMPS),
    at("north_dmps", "over the ground, 0.1 m/s to the north", DMPS),
];

/// The places of an aircraft's body.
pub(super) const SENSED: &[Place] = &[
    at(
        "at_ms",
        "when it was sensed, ms of the clock of percepts",
        TIME_MS,
    ),
    at(
        "seen",
        "aircraft that are no members, the nearest first",
        Shape::Rows(AIRCRAFT, SENSED_MAX),
    ),
];

#[cfg(test)]
pub(crate) mod samples {
    use super::super::codec::Body;
    use super::*;

    /// A helicopter.
    pub(crate) fn aircraft() -> SensedAircraft {
        SensedAircraft {
            at_ms: 81_400,
            seen: vec![Aircraft {
                east_dm: 1_204,
                north_dm: -314,
                height_dm: 700,
                east_dmps: 350,
                north_dmps: -20,
            }],
        }
    }

    /// The largest valid one.
    pub(crate) fn largest() -> Vec<Body> {
        let aircraft = Aircraft {
            east_dm: -DM_MAX,
            north_dm: -DM_MAX,
            height_dm: -DM_MAX,
            east_dmps: i16::MIN,
            north_dmps: i16::MIN,
        };
        vec![Body::Aircraft(SensedAircraft {
            at_ms: TIME_MAX_MS,
            seen: vec![aircraft; SENSED_MAX],
        })]
    }
}
