//! What a UAV tells of vehicles that it counted at a site of its mission: type, bytes and limits
//! of the kind `count` (docs/protocol.md §12, D2.7 §3.1).
//!
//! One register a site, made of the author's own pictures alone, in one of its lives: numbers that
//! grow, so the newest says all that the older ones said, and registers of all authors and lives
//! are added.

use super::cbor::array_of;
use super::codec::WireError;
use super::limits::in_range;
use super::schema::{Place, Shape, U16, U32, at};
use super::target::{TIME_MAX_MS, TIME_MS};
use serde::{Deserialize, Serialize};

/// Registers of an author: one a site.
pub const COUNTS_MAX: u16 = 16;

/// Most vehicles that are counted at one site in a sortie.
pub const PASSED_MAX: u32 = 1_000_000;

/// The longest way that they may have driven there together, decimetres.
pub const DRIVEN_MAX_DM: u64 = 1 << 40;

/// What was counted at one site by one author in one life.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct Count {
    /// Which sites of which sortie: `Mission::sites_hash`.
    pub sites: u32,
    /// For how long all of it was in the author's picture and nobody else counted, milliseconds.
    pub watched_ms: u64,
    /// Vehicles that drove in meanwhile.
    pub passed: u32,
    /// How long vehicles were there meanwhile, all of them together, milliseconds.
    pub spent_ms: u64,
    /// How far they drove there, all of them together, decimetres.
    pub driven_dm: u64,
    /// Vehicles that stood there when it was seen last.
    pub standing: u16,
    /// When that was, milliseconds of the clock of percepts; 0 for never.
    pub seen_ms: u64,
}

array_of!(Count {
    sites,
    watched_ms,
    passed,
    spent_ms,
    driven_dm,
    standing,
    seen_ms
});

/// The first field that is out of range.
pub(super) fn check(c: &Count) -> Result<(), WireError> {
    in_range("watched_ms", c.watched_ms <= TIME_MAX_MS)?;
    in_range("passed", c.passed <= PASSED_MAX)?;
    in_range("spent_ms", c.spent_ms <= TIME_MAX_MS)?;
    in_range("driven_dm", c.driven_dm <= DRIVEN_MAX_DM)?;
    in_range("seen_ms", c.seen_ms <= TIME_MAX_MS)?;
    in_range("standing", c.standing == 0 || c.seen_ms > 0)
}

/// The places of a count's body.
pub(super) const COUNT: &[Place] = &[
    at("sites", "which sites of which sortie: a hash", U32),
    at(
        "watched_ms",
        "for how long all of the site was in the author's picture and nobody else counted, ms",
        TIME_MS,
    ),
    at(
        "passed",
        "vehicles that drove in meanwhile",
        Shape::Number(0, PASSED_MAX as i128),
    ),
    at(
        "spent_ms",
        "how long vehicles were there meanwhile, all together, ms",
        TIME_MS,
    ),
    at(
        "driven_dm",
        "how far they drove there, all together, dm",
        Shape::Number(0, DRIVEN_MAX_DM as i128),
    ),
    at(
        "standing",
        "vehicles that stood there when it was seen last",
        U16,
    ),
    at(
        "seen_ms",
        "when that was, ms of the clock of percepts; 0 for never",
        TIME_MS,
    ),
];

#[cfg(test)]
pub(crate) mod samples {
    use super::super::codec::Body;
    use super::*;

    /// A crossing, typically.
    pub(crate) fn count() -> Count {
        Count {
            sites: 0x1234_5678,
            watched_ms: 81_400,
            passed: 14,
            spent_ms: 61_000,
            driven_dm: 4_310,
            standing: 0,
            seen_ms: 0,
        }
    }

    /// The largest valid one.
    pub(crate) fn largest() -> Vec<Body> {
        vec![Body::Count(Count {
            sites: u32::MAX,
            watched_ms: TIME_MAX_MS,
            passed: PASSED_MAX,
            spent_ms: TIME_MAX_MS,
            driven_dm: DRIVEN_MAX_DM,
            standing: u16::MAX,
            seen_ms: TIME_MAX_MS,
        })]
    }
}
