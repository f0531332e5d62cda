//! What a UAV tells of the people of a mass event: type, bytes and limits of the kind `crowd`
//! (docs/protocol.md §12, D2.7 §3.1).
//!
//! One register of sixteen sectors that lie together, a *tile*: all that its author knows of them,
//! whoever saw it. Of each sector that is the newest look, and the newest one that was sure whether
//! it is too dense. Of two registers the newer look counts, sector by sector, so they merge in any
//! order, what a lost UAV saw is said by others, and nobody is counted in two looks.

use super::cbor::{Listed, array_of, number_of};
use super::codec::WireError;
use super::limits::{DURATION_MAX_MS, at_most, in_range};
use super::schema::{Place, Shape, U16, U32, at};
use super::target::TIME_MAX_MS;
use serde::{Deserialize, Serialize};

/// Sectors of a tile: four by four.
pub const SECTORS_EACH: u16 = 16;

/// Registers of an author: one a tile.
pub const TILES_MAX: u16 = 64;

/// Most sectors of an event.
pub const SECTORS_MAX: u16 = SECTORS_EACH * TILES_MAX;

/// Most people who certainly came or left between two looks at one sector.
pub const CAME_MAX: i32 = 65_535;

/// What the newest sure look at a sector said.
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

/// One sector as it was seen last.
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
    /// How long before the time of the register it was looked at, seconds.
    pub age_s: u32,
    /// By whom.
    pub seen_by: u16,
    /// How many more there certainly were than in the look before; fewer below 0.
    pub came: i32,
    /// What the newest sure look said.
    pub sure: Sure,
    /// How long before this look that was, seconds; 0 where there was none.
    pub sure_before_s: u32,
}

/// Of a sector that is too dense since when, and who saw that first.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct CrowdDense {
    /// Which sector of the tile.
    pub sector: u8,
    /// For how long it had been so in the newest sure look, seconds.
    pub dense_s: u32,
    /// Who saw that first.
    pub by: u16,
}

/// The sectors of a tile that its author knows of.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct CrowdTile {
    /// Of which event of which sortie: `Mission::crowd_hash`.
    pub crowd: u32,
    /// The time of the register, seconds of the clock of percepts.
    pub time_s: u64,
    /// Its sectors, ascending.
    pub rows: Vec<CrowdRow>,
    /// Those that are too dense, ascending.
    pub dense: Vec<CrowdDense>,
}

number_of!(Sure { None, Eased, Dense });
array_of!(CrowdRow {
    sector,
    people,
    low,
    high,
    age_s,
    seen_by,
    came,
    sure,
    sure_before_s
});
array_of!(CrowdDense {
    sector,
    dense_s,
    by
});
array_of!(CrowdTile {
    crowd,
    time_s,
    rows,
    dense
});

impl Listed for CrowdRow {
    const MAX: usize = SECTORS_EACH as usize;
}

impl Listed for CrowdDense {
    const MAX: usize = SECTORS_EACH as usize;
}

/// The latest time, seconds of the clock of percepts.
pub const TIME_MAX_S: u64 = TIME_MAX_MS / 1_000;

/// The longest that something may be ago, seconds.
pub const AGO_MAX_S: u32 = DURATION_MAX_MS / 1_000;

/// The first field that is out of range.
pub(super) fn check(t: &CrowdTile) -> Result<(), WireError> {
    at_most("rows", t.rows.len(), usize::from(SECTORS_EACH))?;
    at_most("dense", t.dense.len(), usize::from(SECTORS_EACH))?;
    in_range("time_s", t.time_s <= TIME_MAX_S)?;
    let all = |holds: &dyn Fn(&CrowdRow) -> bool| t.rows.iter().all(holds);
    in_range("sector", all(&|r| u16::from(r.sector) < SECTORS_EACH))?;
    let ascends = t.rows.windows(2).all(|w| w[0].sector < w[1].sector);
    in_range("rows", ascends)?;
    in_range("low", all(&|r| r.low <= r.people))?;
    in_range("high", all(&|r| r.high >= r.people))?;
    let is_before =
        |s: u32, since_s: u32| s <= AGO_MAX_S && u64::from(s) + u64::from(since_s) <= t.time_s;
    in_range("age_s", all(&|r| is_before(r.age_s, 0)))?;
    in_range("came", all(&|r| r.came.abs() <= CAME_MAX))?;
    let sure = |r: &CrowdRow| {
        is_before(r.sure_before_s, r.age_s) && (r.sure != Sure::None || r.sure_before_s == 0)
    };
    in_range("sure_before_s", all(&sure))?;
    let dense = t.rows.iter().filter(|r| r.sure == Sure::Dense);
    let is_of = |(r, d): (&CrowdRow, &CrowdDense)| r.sector == d.sector;
    let are_those = dense.clone().count() == t.dense.len();
    in_range("dense", are_those && dense.clone().zip(&t.dense).all(is_of))?;
    let is_since = |(r, d): (&CrowdRow, &CrowdDense)| {
        is_before(d.dense_s, r.age_s.saturating_add(r.sure_before_s))
    };
    in_range("dense_s", dense.zip(&t.dense).all(is_since))
}

const AGO: Shape = Shape::Number(0, AGO_MAX_S as i128);

const SECTOR: Place = at(
    "sector",
    "which sector of the tile",
    Shape::Number(0, SECTORS_EACH as i128 - 1),
);

const ROW: &[Place] = &[
    SECTOR,
    at("people", "how many people there were", U16),
    at("low", "at least", U16),
    at("high", "at most, in nineteen cases of twenty", U16),
    at(
        "age_s",
        "how long before the time of the register it was looked at, s",
        AGO,
    ),
    at("seen_by", "by whom", U16),
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
        "sure_before_s",
        "how long before this look that was, s; 0 where there was none",
        AGO,
    ),
];

const DENSE: &[Place] = &[
    SECTOR,
    at(
        "dense_s",
        "for how long it had been too dense in the newest sure look, s",
        AGO,
    ),
    at("by", "who saw that first", U16),
];

/// The places of a tile's body.
pub(super) const CROWD: &[Place] = &[
    at("crowd", "of which event of which sortie: a hash", U32),
    at(
        "time_s",
        "the time of the register, s of the clock of percepts",
        Shape::Number(0, TIME_MAX_S as i128),
    ),
    at(
        "rows",
        "its sectors, ascending",
        Shape::Rows(ROW, SECTORS_EACH as usize),
    ),
    at(
        "dense",
        "those that are too dense, ascending",
        Shape::Rows(DENSE, SECTORS_EACH as usize),
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
            time_s: 81,
            rows: vec![
                CrowdRow {
                    sector: 2,
                    people: 1_640,
                    low: 1_480,
                    high: 1_790,
                    seen_by: 2,
                    came: 310,
                    sure: Sure::Dense,
                    ..CrowdRow::default()
                },
                CrowdRow {
                    sector: 3,
                    high: 2,
                    age_s: 1,
                    sure: Sure::Eased,
                    ..CrowdRow::default()
                },
            ],
            dense: vec![CrowdDense {
                sector: 2,
                dense_s: 21,
                by: 3,
            }],
        }
    }

    /// The largest valid one.
    pub(crate) fn largest() -> Vec<Body> {
        let row = |sector| CrowdRow {
            sector,
            people: u16::MAX,
            low: u16::MAX,
            high: u16::MAX,
            age_s: AGO_MAX_S,
            seen_by: u16::MAX,
            came: -CAME_MAX,
            sure: Sure::Dense,
            sure_before_s: AGO_MAX_S,
        };
        let dense = |sector| CrowdDense {
            sector,
            dense_s: AGO_MAX_S,
            by: u16::MAX,
        };
        vec![Body::Crowd(CrowdTile {
            crowd: u32::MAX,
            time_s: TIME_MAX_S,
            rows: (0..16).map(row).collect(),
            dense: (0..16).map(dense).collect(),
        })]
    }
}
