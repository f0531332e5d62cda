//! What a UAV tells of a contour that it flew along: type, bytes and limits of the kind `trail`
//! (docs/protocol.md §12, D2.7 §3.1).
//!
//! One register a stretch: places in the order of flight, each with the time at which it was
//! seen. The stretch that a UAV is at grows; the registers are used round and round.

use super::cbor::{Listed, array_of};
use super::codec::WireError;
use super::limits::{DURATION_MAX_MS, POSITION_MAX_MM, at_most, in_range};
use super::schema::{Place, Shape, at};
use super::target::{TIME_MAX_MS, TIME_MS};
use serde::{Deserialize, Serialize};
use skein_flight::tracing::outline::Stretch;
use skein_flight::tracing::thread::Mark;
use skein_geometry::frame::Point;

/// Stretches that one author tells of: several rounds of a fire of two kilometres.
pub const TRAILS_MAX: u16 = 16;

/// Places of a stretch.
pub const TRAIL_PLACES_MAX: usize = 16;

const DM_MAX: i32 = POSITION_MAX_MM / 100;
const AFTER_MAX_DS: u32 = DURATION_MAX_MS / 100;

/// A place of a contour.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct TrailPlace {
    /// 0.1 m east of the origin.
    pub east_dm: i32,
    /// And north of it.
    pub north_dm: i32,
    /// How long after the first place of the stretch it was seen, 100 ms.
    pub after_ds: u32,
    /// Whether nothing was seen between the place before and this.
    pub begins: bool,
}

/// A stretch of a contour.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Trail {
    /// Whether what the contour encloses is on the left, and may grow.
    pub sided: bool,
    /// When the first place was seen, milliseconds of the clock of percepts.
    pub seen_ms: u64,
    /// The places, in the order of flight.
    pub places: Vec<TrailPlace>,
}

array_of!(TrailPlace {
    east_dm,
    north_dm,
    after_ds,
    begins
});
array_of!(Trail {
    sided,
    seen_ms,
    places
});

impl Listed for TrailPlace {
    const MAX: usize = TRAIL_PLACES_MAX;
}

impl Trail {
    /// A stretch as it is told: no more than [`TRAIL_PLACES_MAX`] places, the first ones.
    #[must_use]
    pub fn of(marks: &[Mark], sided: bool) -> Self {
        let seen_ms = marks.first().map_or(0, |m| m.seen_ms);
        let place = |m: &Mark| TrailPlace {
            east_dm: dm(m.at.x),
            north_dm: dm(m.at.y),
            after_ds: u32::try_from(m.seen_ms.saturating_sub(seen_ms) / 100)
                .unwrap_or(AFTER_MAX_DS)
                .min(AFTER_MAX_DS),
            begins: m.begins,
        };
        Self {
            sided,
            seen_ms,
            places: marks.iter().take(TRAIL_PLACES_MAX).map(place).collect(),
        }
    }

    /// What it tells.
    #[must_use]
    pub fn stretch(&self) -> Stretch {
        let mark = |p: &TrailPlace| Mark {
            at: Point::new(f64::from(p.east_dm) / 10.0, f64::from(p.north_dm) / 10.0),
            seen_ms: self.seen_ms + 100 * u64::from(p.after_ds),
            begins: p.begins,
        };
        Stretch {
            marks: self.places.iter().map(mark).collect(),
            sided: self.sided,
        }
    }
}

fn dm(m: f64) -> i32 {
    (crate::mission::mm(m) / 100).clamp(-DM_MAX, DM_MAX)
}

/// The first field that is out of range.
pub(super) fn check(t: &Trail) -> Result<(), WireError> {
    let near = |dm: i32| dm.unsigned_abs() <= DM_MAX.unsigned_abs();
    in_range("seen_ms", t.seen_ms <= TIME_MAX_MS)?;
    at_most("places", t.places.len(), TRAIL_PLACES_MAX)?;
    in_range("east_dm", t.places.iter().all(|p| near(p.east_dm)))?;
    in_range("north_dm", t.places.iter().all(|p| near(p.north_dm)))?;
    let is_late = |p: &TrailPlace| p.after_ds > AFTER_MAX_DS;
    in_range("after_ds", !t.places.iter().any(is_late))
}

const DM: Shape = Shape::Number(-(DM_MAX as i128), DM_MAX as i128);

const TRAIL_PLACE: &[Place] = &[
    at("east_dm", "0.1 m east of the mission's origin", DM),
    at("north_dm", "0.1 m north of the mission's origin", DM),
    at(
        "after_ds",
        "how long after the first place it was seen, 100 ms",
        Shape::Number(0, AFTER_MAX_DS as i128),
    ),
    at(
        "begins",
        "whether nothing was seen between the place before and this",
        Shape::Flag,
    ),
];

/// The places of a trail's body.
pub(super) const TRAIL: &[Place] = &[
    at(
        "sided",
        "whether what the contour encloses is on the left, and may grow",
        Shape::Flag,
    ),
    at(
        "seen_ms",
        "when the first place was seen, ms of the clock of percepts",
        TIME_MS,
    ),
    at(
        "places",
        "places of the contour, in the order of flight",
        Shape::Rows(TRAIL_PLACE, TRAIL_PLACES_MAX),
    ),
];

#[cfg(test)]
pub(crate) mod samples {
    use super::super::codec::Body;
    use super::*;

    /// Three places of the edge of a fire.
    pub(crate) fn trail() -> Trail {
        let place = |east_dm, north_dm, after_ds| TrailPlace {
            east_dm,
            north_dm,
            after_ds,
            begins: false,
        };
        Trail {
            sided: true,
            seen_ms: 81_400,
            places: vec![
                TrailPlace {
                    begins: true,
                    ..place(1_204, -314, 0)
                },
                place(1_500, -290, 22),
                place(1_780, -120, 46),
            ],
        }
    }

    /// The largest valid one.
    pub(crate) fn largest() -> Vec<Body> {
        let place = TrailPlace {
            east_dm: -DM_MAX,
            north_dm: -DM_MAX,
            after_ds: AFTER_MAX_DS,
            begins: true,
        };
        vec![Body::Trail(Trail {
            sided: true,
            seen_ms: TIME_MAX_MS,
            places: vec![place; TRAIL_PLACES_MAX],
        })]
    }
}
