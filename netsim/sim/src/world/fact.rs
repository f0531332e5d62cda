//! What the world records: facts, not beliefs.

use super::motion::kinematic::Loss;
use skein_flight::coverage::ring::CellId;
use skein_geometry::frame::Point;

/// The closest approach of two airborne UAVs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approach {
    /// When, milliseconds.
    pub at_ms: u64,
    /// One of them.
    pub a: u16,
    /// The other.
    pub b: u16,
    /// Distance in space, metres.
    pub distance_m: f64,
}

/// An aircraft that is no member came nearer to a UAV than is to be kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrusion {
    /// When, milliseconds.
    pub at_ms: u64,
    /// To whom.
    pub uav: u16,
    /// Which intruder, by its place in the scenario.
    pub intruder: usize,
    /// Distance across, metres.
    pub across_m: f64,
    /// Whether there was time to make way for it.
    pub is_warned: bool,
}

/// A UAV flew into an obstacle that is on no map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Collision {
    /// When, milliseconds.
    pub at_ms: u64,
    /// Who.
    pub uav: u16,
    /// Into which, by its place in the world.
    pub obstacle: usize,
    /// Whether it had flown and been commanded for long enough to turn away.
    pub is_free: bool,
}

/// Something that truly happened.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fact {
    /// A UAV was the first to see a whole cell.
    Seen {
        /// When, milliseconds.
        at_ms: u64,
        /// Who.
        uav: u16,
        /// Which cell.
        cell: CellId,
    },
    /// A UAV flew into a no-fly zone.
    ZoneEntry {
        /// When, milliseconds.
        at_ms: u64,
        /// Who.
        uav: u16,
        /// Which zone, by its place in the scenario.
        zone: usize,
        /// Where, to within a chord of the arc.
        place: Point,
    },
    /// Two airborne UAVs came closer than the least separation.
    TooClose(Approach),
    /// An aircraft that is no member came too near.
    Intruded(Intrusion),
    /// A UAV flew into an obstacle that is on no map.
    Collided(Collision),
    /// An airframe is gone.
    Lost {
        /// When, milliseconds.
        at_ms: u64,
        /// Who.
        uav: u16,
        /// Why.
        cause: Loss,
        /// Where.
        place: Point,
    },
    /// A UAV left its launcher, at the word of its computer.
    TookOff {
        /// When, milliseconds.
        at_ms: u64,
        /// Who.
        uav: u16,
    },
    /// An airframe began or ended to loiter on its own.
    Failsafe {
        /// When the world noticed, milliseconds.
        at_ms: u64,
        /// Who.
        uav: u16,
        /// Whether it began.
        on: bool,
    },
}
