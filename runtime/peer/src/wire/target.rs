//! What a UAV tells of a vehicle that it saw: type, bytes and limits of the kind `target`
//! (docs/protocol.md §12, D2.7 §3.7).
//!
//! One register a target, made of the author's own sightings alone, so that registers of all
//! authors merge in any order. Of the covariance three numbers are told that bound it: a
//! spread of place and of velocity alike in all directions, and what both have in common.

use super::cbor::array_of;
use super::codec::WireError;
use super::limits::{in_range, is_near, is_slow};
use super::schema::{MM, MMPS, Place, Shape, U8, U16, U32, at};
use serde::{Deserialize, Serialize};

/// Targets that one author tells of at a time: subjects `0 .. 8`, of which the first is that
/// which it follows.
pub const TARGETS_MAX: u16 = 8;

/// The latest time, milliseconds: what a double counts.
pub const TIME_MAX_MS: u64 = 1 << 53;

/// A time of the clock of percepts, or one that is counted by it.
pub(super) const TIME_MS: Shape = Shape::Number(0, TIME_MAX_MS as i128);

/// The widest spread that is told, thousandths of m² and of m²/s².
pub const SPREAD_MAX_E3: u32 = 1_000_000_000;

/// A target as one UAV saw it.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct Target {
    /// Who named it.
    pub by: u16,
    /// Its how-manieth target that was.
    pub number: u32,
    /// What it looks like.
    pub looks: u8,
    /// When it was seen last, milliseconds of the clock of percepts.
    pub seen_ms: u64,
    /// How long after that its estimate is of, milliseconds.
    pub aged_ms: u16,
    /// Where it was then, mm east of the origin.
    pub east_mm: i32,
    /// And north of it.
    pub north_mm: i32,
    /// Its velocity, mm/s to the east.
    pub east_mmps: i32,
    /// And to the north.
    pub north_mmps: i32,
    /// Variance of its place, thousandths of m².
    pub place_e3: u32,
    /// Covariance of place and velocity, thousandths of m²/s.
    pub both_e3: i32,
    /// Variance of its velocity, thousandths of m²/s².
    pub speed_e3: u32,
    /// Who asked for the task that its author follows it for; 0 where it follows it for none.
    pub task_by: u16,
    /// Which of its tasks.
    pub task: u16,
    /// In which revision.
    pub revision: u32,
}

array_of!(Target {
    by,
    number,
    looks,
    seen_ms,
    aged_ms,
    east_mm,
    north_mm,
    east_mmps,
    north_mmps,
    place_e3,
    both_e3,
    speed_e3,
    task_by,
    task,
    revision
});

/// The first field that is out of range.
pub(super) fn check(t: &Target) -> Result<(), WireError> {
    let spread = |e3: u32| (1..=SPREAD_MAX_E3).contains(&e3);
    in_range("seen_ms", t.seen_ms <= TIME_MAX_MS)?;
    in_range("east_mm", is_near(t.east_mm))?;
    in_range("north_mm", is_near(t.north_mm))?;
    in_range("east_mmps", is_slow(t.east_mmps))?;
    in_range("north_mmps", is_slow(t.north_mmps))?;
    in_range("place_e3", spread(t.place_e3))?;
    in_range("speed_e3", spread(t.speed_e3))?;
    // No covariance is as large as both variances.
    let both = u64::from(t.both_e3.unsigned_abs());
    let most = u64::from(t.place_e3) * u64::from(t.speed_e3);
    in_range("both_e3", both * both < most)?;
    in_range("task", t.task_by > 0 || (t.task, t.revision) == (0, 0))
}

const SPREAD: Shape = Shape::Number(1, SPREAD_MAX_E3 as i128);

/// The places of a target's body.
pub(super) const TARGET: &[Place] = &[
    at("by", "who named it", U16),
    at("number", "its how-manieth target that was", U32),
    at(
        "looks",
        "its kind and eight times its colour, 0 for none that could be told",
        U8,
    ),
    at(
        "seen_ms",
        "when it was seen last, ms of the clock of percepts",
        TIME_MS,
    ),
    at("aged_ms", "how long after that its estimate is of, ms", U16),
    at("east_mm", "mm east of the mission's origin", MM),
    at("north_mm", "mm north of the mission's origin", MM),
    at("east_mmps", "mm/s to the east", MMPS),
    at("north_mmps", "mm/s to the north", MMPS),
    at("place_e3", "variance of its place, 0.001 m²", SPREAD),
    at(
        "both_e3",
        "covariance of place and velocity, 0.001 m²/s",
        Shape::Number(-(SPREAD_MAX_E3 as i128), SPREAD_MAX_E3 as i128),
    ),
    at("speed_e3", "variance of its velocity, 0.001 m²/s²", SPREAD),
    at(
        "task_by",
        "who asked for the task that it is followed for; 0 for none",
        U16,
    ),
    at("task", "which of its tasks", U16),
    at("revision", "in which revision", U32),
];

#[cfg(test)]
pub(crate) mod samples {
    use super::super::codec::Body;
    use super::super::limits::POSITION_MAX_MM;
    use super::*;

    /// A target that drives along and is followed for a task, typically.
    pub(crate) fn target() -> Target {
        Target {
            by: 3,
            number: 2,
            looks: 1,
            seen_ms: 81_400,
            aged_ms: 200,
            east_mm: 120_450,
            north_mm: -31_415,
            east_mmps: 5_900,
            north_mmps: -400,
            place_e3: 4_600,
            both_e3: 350,
            speed_e3: 1_200,
            task_by: 100,
            task: 0,
            revision: 1,
        }
    }

    /// The largest valid ones.
    pub(crate) fn largest() -> Vec<Body> {
        vec![Body::Target(Target {
            by: u16::MAX,
            number: u32::MAX,
            looks: u8::MAX,
            seen_ms: TIME_MAX_MS,
            aged_ms: u16::MAX,
            east_mm: -POSITION_MAX_MM,
            north_mm: -POSITION_MAX_MM,
            east_mmps: -200_000,
            north_mmps: -200_000,
            place_e3: SPREAD_MAX_E3,
            both_e3: -999_999_999,
            speed_e3: SPREAD_MAX_E3,
            task_by: u16::MAX,
            task: u16::MAX,
            revision: u32::MAX,
        })]
    }
}
