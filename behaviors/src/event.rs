//! What the executive layer reports upwards.

use serde::{Deserialize, Serialize};

/// Something happened that the cooperation layer should know.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Event {
    /// The camera has seen the whole of these cells of the loop, by index.
    Seen(Vec<u16>),
    /// So many pieces of what is watched were seen whole by now, of so many.
    Sighted {
        /// So many.
        seen: u16,
        /// Of so many.
        of: u16,
    },
    /// A detour is flown, as far as it can be; its legs follow.
    DetourFlown,
    /// All legs are flown.
    PlanDone,
    /// No clear route exists to the next leg; its cells are given up.
    Refused {
        /// The cells of the loop, by index, that this UAV cannot reach.
        cells: Vec<u16>,
    },
    /// The given flight ends early.
    CutShort {
        /// So far it is flown, metres along it; there the UAV waits.
        at_m: f64,
        /// What is in the way of the rest.
        why: Unflyable,
    },
}

/// Why a stretch of a given flight is not flown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Unflyable {
    /// It has no proof that it keeps clear of the zones.
    NearZone,
    /// It bends tighter than the airframe can follow in this wind.
    Bend,
    /// The wind is too strong to make way on it.
    Wind,
    /// It does not follow on the stretch before, or is no curve.
    Gap,
    /// No clear way leads to it.
    NoWay,
    /// At its end there is no room to wait, nor on a way from there.
    NoRoom,
}
