//! What a UAV tells of the people of a mass event: type, bytes and limits of the kind `crowd`
//! (docs/protocol.md §12, D2.7 §3.1).
//!
//! One register of sixteen sectors that lie together, a *tile*, made of the author's own pictures
//! alone, in one of its lives: of each sector the newest look, and the newest one that was sure
//! whether it is too dense. Of all authors and lives the newest looks count, so registers merge in
//! any order, and nobody is counted in two of them.

use super::cbor::{Listed, array_of, number_of};
use super::codec::WireError;
use super::limits::{DURATION_MAX_MS, at_most, in_range};
use super::schema::{Place, Shape, U16, U32, at};
use super::target::{TIME_MAX_MS, TIME_MS};
use serde::{Deserialize, Serialize};

/// Sectors of a tile: four by four.
pub const SECTORS_EACH: u16 = 16;

/// Registers of an author: one a tile.
pub const TILES_MAX: u16 = 64;

/// Most sectors of an event.
pub const SECTORS_MAX: u16 = SECTORS_EACH * TILES_MAX;

/// Most people who certainly came or left between two looks at one sector.
pub const CAME_MAX: i32 = 65_535;

/// What the newest sure look of an author at a sector said.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum Sure {
    /// There was none.
    #[default]
    None,
    /// It is certainly not too dense.
    Eased,
    /// It is certainly too dense.
    Dense,
}

/// One sector as one author saw it last in one life.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct CrowdRow {
    /// Which sector of the tile.
    pub sector: u8,
    /// How many people there were.
    pub people: u16,
    /// At least.
    pub low: u16,
    /// And at most, in nineteen cases of twenty.
    pub high: u16,
    /// How long before the time of the register it was looked at, milliseconds.
    pub age_ms: u32,
    /// How many more there certainly were than in the look before; fewer below 0.
    pub came: i32,
    /// What the newest sure look said.
    pub sure: Sure,
    /// How long before the time of the register that was, milliseconds; 0 where there was none.
    pub sure_age_ms: u32,
    /// Of one that is too dense for how long it had been by then, milliseconds; else 0.
    pub dense_ms: u32,
    /// And who saw that first; else 0.
    pub by: u16,
}

/// The sectors of a tile that one author saw in one life.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct CrowdTile {
    /// Of which event of which sortie: `Mission::crowd_hash`.
    pub crowd: u32,
    /// The time of the register, milliseconds of the clock of percepts.
    pub time_ms: u64,
    /// Its sectors, ascending.
    pub rows: Vec<CrowdRow>,
}

number_of!(Sure { None, Eased, Dense });
array_of!(CrowdRow {
    sector,
    people,
    low,
    high,
    age_ms,
    came,
    sure,
    sure_age_ms,
    dense_ms,
    by
});
array_of!(CrowdTile {
    crowd,
    time_ms,
    rows
});

impl Listed for CrowdRow {
    const MAX: usize = SECTORS_EACH as usize;
}

/// The first field that is out of range.
pub(super) fn check(t: &CrowdTile) -> Result<(), WireError> {
    at_most("rows", t.rows.len(), usize::from(SECTORS_EACH))?;
    in_range("time_ms", t.time_ms <= TIME_MAX_MS)?;
    let all = |holds: &dyn Fn(&CrowdRow) -> bool| t.rows.iter().all(holds);
    in_range("sector", all(&|r| u16::from(r.sector) < SECTORS_EACH))?;
    let ascends = t.rows.windows(2).all(|w| w[0].sector < w[1].sector);
    in_range("rows", ascends)?;
    in_range("low", all(&|r| r.low <= r.people))?;
    in_range("high", all(&|r| r.high >= r.people))?;
    let is_before = |ms: u32| ms <= DURATION_MAX_MS && u64::from(ms) <= t.time_ms;
    in_range("age_ms", all(&|r| is_before(r.age_ms)))?;
    in_range("came", all(&|r| r.came.abs() <= CAME_MAX))?;
    let sure =
        |r: &CrowdRow| is_before(r.sure_age_ms) && (r.sure != Sure::None || r.sure_age_ms == 0);
    in_range("sure_age_ms", all(&sure))?;
    let dense = |r: &CrowdRow| {
        let begun_ms = u64::from(r.dense_ms) + u64::from(r.sure_age_ms);
        let is_so = r.sure == Sure::Dense;
        r.dense_ms <= DURATION_MAX_MS && begun_ms <= t.time_ms && (is_so || r.dense_ms == 0)
    };
    in_range("dense_ms", all(&dense))?;
    in_range("by", all(&|r| r.sure == Sure::Dense || r.by == 0))
}

const AGE: Shape = Shape::Number(0, DURATION_MAX_MS as i128);

const ROW: &[Place] = &[
    at(
        "sector",
        "which sector of the tile",
        Shape::Number(0, SECTORS_EACH as i128 - 1),
    ),
    at("people", "how many people there were", U16),
    at("low", "at least", U16),
    at("high", "at most, in nineteen cases of twenty", U16),
    at(
        "age_ms",
        "how long before the time of the register it was looked at, ms",
        AGE,
    ),
    at(
        "came",
        "how many more there certainly were than in the look before; fewer below 0",
        Shape::Number(-CAME_MAX as i128, CAME_MAX as i128),
    ),
    at(
        "sure",
        "the newest sure look: 0 there was none, 1 not too dense, 2 too dense",
        Shape::Number(0, 2),
    ),
    at(
        "sure_age_ms",
        "how long before the time of the register that was, ms; 0 where there was none",
        AGE,
    ),
    at(
        "dense_ms",
        "for how long it had been too dense by then, ms; 0 where it is not",
        AGE,
    ),
    at("by", "who saw that first; 0 where it is not too dense", U16),
];

/// The places of a tile's body.
pub(super) const CROWD: &[Place] = &[
    at("crowd", "of which event of which sortie: a hash", U32),
    at(
        "time_ms",
        "the time of the register, ms of the clock of percepts",
        TIME_MS,
    ),
    at(
        "rows",
        "its sectors, ascending",
        Shape::Rows(ROW, SECTORS_EACH as usize),
    ),
];

#[cfg(test)]
pub(crate) mod samples {
    use super::super::codec::Body;
    use super::*;

    /// A sector that is too dense beside an empty one, typically.
    pub(crate) fn tile() -> CrowdTile {
        CrowdTile {
            crowd: 0x1234_5678,
            time_ms: 81_400,
            rows: vec![
                CrowdRow {
                    sector: 2,
                    people: 1_640,
                    low: 1_480,
                    high: 1_790,
                    age_ms: 0,
                    came: 310,
                    sure: Sure::Dense,
                    sure_age_ms: 0,
                    dense_ms: 21_000,
                    by: 3,
                },
                CrowdRow {
                    sector: 3,
                    high: 2,
                    age_ms: 1_000,
                    sure: Sure::Eased,
                    sure_age_ms: 1_000,
                    ..CrowdRow::default()
                },
            ],
        }
    }

    /// The largest valid one.
    pub(crate) fn largest() -> Vec<Body> {
        let row = |sector| CrowdRow {
            sector,
            people: u16::MAX,
            low: u16::MAX,
            high: u16::MAX,
            age_ms: DURATION_MAX_MS,
            came: -CAME_MAX,
            sure: Sure::Dense,
            sure_age_ms: DURATION_MAX_MS,
            dense_ms: DURATION_MAX_MS,
            by: u16::MAX,
        };
        vec![Body::Crowd(CrowdTile {
            crowd: u32::MAX,
            time_ms: TIME_MAX_MS,
            rows: (0..16).map(row).collect(),
        })]
    }
}
