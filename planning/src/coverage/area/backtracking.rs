//! Optimal division of a coverage loop among UAVs: backtracking MSTC (D2.7 §3.6.5,
//! algorithm 7, after Hazon & Kaminka), generalised to what a swarm needs after a
//! failure: covered gaps, release times, turn-round cost, mixed speeds, endurance.

use super::stc::Direction;
use serde::{Deserialize, Serialize};

/// One cell of the ring to be divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RingCell {
    /// Length flown when the cell is served, millimetres.
    pub service_mm: u32,
    /// Length flown when the cell is only passed, millimetres.
    pub travel_mm: u32,
    /// Whether it still needs service by somebody.
    pub open: bool,
}

/// One UAV that takes part in the division.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Robot {
    /// The boundary where it begins (boundary `b` lies before cell `b`).
    pub anchor: u16,
    /// Who; breaks ties between equal anchors.
    pub id: u16,
    /// Which way it looks at its anchor.
    pub heading: Direction,
    /// When it will be at its anchor, milliseconds from now.
    pub release_ms: u32,
    /// Ground speed, mm/s; above zero.
    pub speed_mmps: u32,
    /// Time to turn round on the loop, milliseconds.
    pub turn_ms: u32,
    /// Flight time it may still spend after its release, milliseconds.
    pub endurance_ms: u32,
}

/// A run of cells flown in one direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Leg {
    /// The first cell flown.
    pub first: u16,
    /// How many cells, in the direction of flight.
    pub count: u16,
    /// Which way.
    pub direction: Direction,
}

impl Leg {
    /// The cells of the leg on a ring of `n`, in order of flight.
    pub fn cells(self, n: usize) -> impl Iterator<Item = u16> {
        let n = n as i64;
        (0..i64::from(self.count)).map(move |k| {
            let step = match self.direction {
                Direction::Forward => k,
                Direction::Backward => -k,
            };
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 <= x < n <= 65,535")]
            let c = (i64::from(self.first) + step).rem_euclid(n) as u16;
            c
        })
    }
}

/// What one UAV is to do: at most two legs, the second after turning round.
/// Legs begin and end at an open cell; the way between is travel.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Section {
    /// Who.
    pub id: u16,
    /// The legs in order of flight; cells in them that are not open are only passed.
    pub legs: Vec<Leg>,
    /// When the last open cell is done, milliseconds from now.
    pub finish_ms: u32,
}

/// A division of the ring.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Division {
    /// One section a robot, in ascending order of id.
    pub sections: Vec<Section>,
    /// When the last section is done, milliseconds from now.
    pub makespan_ms: u32,
    /// Open cells that nobody has the endurance to serve, ascending.
    pub unassigned: Vec<u16>,
}

/// Divides the open cells of `ring` among `robots` in the least time.
///
/// Each robot serves a stretch of the ring around its anchor, up to the stretches
/// of its neighbours; it turns round at most once.
///
/// # Guarantees
/// The makespan is the least possible for that shape of plan, in integer
/// milliseconds. With too little endurance, the plan that serves the most cells.
/// Each open cell is in exactly one section or in `unassigned`.
///
/// # Complexity
/// O(k log N) for each tried makespan, times log of the makespan; measured sweeps
/// round the ring are few.
#[must_use]
pub fn divide(ring: &[RingCell], robots: &[Robot]) -> Division {
    let _ = (ring, robots);
    todo!("planning helper")
}
