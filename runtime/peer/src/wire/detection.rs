//! What a UAV tells of an object that its mission looks for: type, bytes and limits of the
//! kind `detection` (docs/protocol.md §12, D2.7 §3.7).
//!
//! One register an object, told once. Where a criterion says follow, a task of the same author
//! and number asks for that.

use super::cbor::{array_of, number_of};
use super::codec::WireError;
use super::limits::{in_range, is_near, is_slow};
use super::schema::{MM, MMPS, Place, Shape, U8, U16, U32, at};
use super::target::{TIME_MAX_MS, TIME_MS};
use crate::criteria::CRITERIA_MAX;
use serde::{Deserialize, Serialize};

/// Registers of an author: eight lives of [`OF_LIFE_MAX`].
pub const DETECTIONS_MAX: u16 = 64;

/// Objects that one UAV tells of in a life: what it sees beyond that others tell.
pub const OF_LIFE_MAX: u16 = 8;

/// The largest error that is told, mm.
pub const ERROR_MAX_MM: u32 = 1_000_000;

/// Whether it counts.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub enum Stands {
    /// It does.
    #[default]
    Told,
    /// It is the object of another detection, which was told before.
    Withdrawn,
}

number_of!(Stands { Told, Withdrawn });

/// An object as it was seen when it was told.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct Detection {
    /// Whether it counts.
    pub stands: Stands,
    /// In which sortie.
    pub sortie: u16,
    /// Which criterion of the mission it fits, from 0.
    pub criterion: u8,
    /// Who named it as a target.
    pub by: u16,
    /// Its how-manieth target that was.
    pub number: u32,
    /// What it looks like.
    pub looks: u8,
    /// When it was seen, milliseconds of the clock of percepts.
    pub seen_ms: u64,
    /// Where it was then, mm east of the origin.
    pub east_mm: i32,
    /// And north of it.
    pub north_mm: i32,
    /// It was no farther from there than this, mm.
    pub error_mm: u32,
    /// Its mean velocity over the watch, mm/s to the east.
    pub east_mmps: i32,
    /// And to the north.
    pub north_mmps: i32,
}

array_of!(Detection {
    stands,
    sortie,
    criterion,
    by,
    number,
    looks,
    seen_ms,
    east_mm,
    north_mm,
    error_mm,
    east_mmps,
    north_mmps
});

/// The first field that is out of range.
pub(super) fn check(d: &Detection) -> Result<(), WireError> {
    in_range("criterion", usize::from(d.criterion) < CRITERIA_MAX)?;
    in_range("seen_ms", d.seen_ms <= TIME_MAX_MS)?;
    in_range("east_mm", is_near(d.east_mm))?;
    in_range("north_mm", is_near(d.north_mm))?;
    in_range("error_mm", d.error_mm <= ERROR_MAX_MM)?;
    in_range("east_mmps", is_slow(d.east_mmps))?;
    in_range("north_mmps", is_slow(d.north_mmps))
}

/// The places of a detection's body.
pub(super) const DETECTION: &[Place] = &[
    at(
        "stands",
        "0 it counts, 1 withdrawn: it is the object of an earlier one",
        Shape::Number(0, 1),
    ),
    at("sortie", "in which sortie of the mission", U16),
    at(
        "criterion",
        "which criterion of the mission it fits, from 0",
        Shape::Number(0, CRITERIA_MAX as i128 - 1),
    ),
    at("by", "who named it as a target", U16),
    at("number", "its how-manieth target that was", U32),
    at(
        "looks",
        "its kind and eight times its colour, 0 for none that could be told",
        U8,
    ),
    at(
        "seen_ms",
        "when it was seen, ms of the clock of percepts",
        TIME_MS,
    ),
    at("east_mm", "mm east of the mission's origin", MM),
    at("north_mm", "mm north of the mission's origin", MM),
    at(
        "error_mm",
        "it was no farther from there than this, mm",
        Shape::Number(0, ERROR_MAX_MM as i128),
    ),
    at("east_mmps", "mean velocity, mm/s to the east", MMPS),
    at("north_mmps", "mean velocity, mm/s to the north", MMPS),
];

#[cfg(test)]
pub(crate) mod samples {
    use super::super::codec::Body;
    use super::super::limits::POSITION_MAX_MM;
    use super::*;

    /// A car that drives along, typically.
    pub(crate) fn detection() -> Detection {
        Detection {
            stands: Stands::Told,
            sortie: 0,
            criterion: 0,
            by: 3,
            number: 4_098,
            looks: 1,
            seen_ms: 81_400,
            east_mm: 120_450,
            north_mm: -31_415,
            error_mm: 8_500,
            east_mmps: 5_900,
            north_mmps: -400,
        }
    }

    /// The largest valid one.
    pub(crate) fn largest() -> Vec<Body> {
        vec![Body::Detection(Detection {
            stands: Stands::Withdrawn,
            sortie: u16::MAX,
            criterion: 7,
            by: u16::MAX,
            number: u32::MAX,
            looks: u8::MAX,
            seen_ms: TIME_MAX_MS,
            east_mm: -POSITION_MAX_MM,
            north_mm: -POSITION_MAX_MM,
            error_mm: ERROR_MAX_MM,
            east_mmps: -200_000,
            north_mmps: -200_000,
        })]
    }
}
