//! What must hold of a swarm, judged from outside while it runs: the rules of
//! docs/protocol.md §8, which says of each what it means, its bound, and what its
//! check does not see.
//!
//! | module | rules |
//! |---|---|
//! | [`findings`] | violations, and where the checks put them |
//! | [`snapshot`] | what all peers believe at one moment, beside what is true |
//! | [`checker`] | all of them behind one door |
//! | [`handicaps`] | whose clock, computer or disk is how late |
//! | [`graph`] | the true components, from which liveness is counted |
//! | [`bounds`] | how long things may take, and how loss grades that |
//! | [`membership`] | detection of deaths, false downs, L1 |
//! | [`layers`] | each layer of a volume was seen from within it |
//! | [`listing`] | I1, L2, S5: which peer lists which cell |
//! | [`record`] | S3, S4, S7, S11: versions, speakers, promises |
//! | [`cover`] | S3 (covered), S6, L4: what is marked covered |
//! | [`rules`] | those of single peers, below, behind one door |
//! | [`cadence`] | durations from below: probation, haste, refute, cadence |
//! | [`patience`] | when rounds are opened: prompt, patience, waiting |
//! | [`decision`] | what rounds decide, from the bids alone; the bids themselves |
//! | [`spoken`] | what is published against what is held |
//! | [`tasks`] | each task in one bundle, and in one at least |
//! | [`relays`] | who holds a relay position is there |
//! | [`tracks`] | who says that it follows a target sees it |
//! | [`watch`] | who flies round leaves no place waiting, and spreads evenly |
//! | [`wind`] | who estimates the wind is right |
//! | [`contours`] | what is told of a contour is there, and who flies along one has it in its picture |
//! | [`counts`] | what is counted at the sites of a mission is what truly passes and stands there |
//! | [`crowds`] | people of a mass event are told to be where they are, and where they are too dense |
//! | [`streets`] | how streets are used is told as it is, and hinted ways are quick |
//! | [`detections`] | what a mission looks for and one had in sight is told, once, and is there |
//! | [`spread`] | L3, L4 of every record, agreement on revision and order |
//! | [`airtime`] | S9: shares of the channel |
//! | [`fuel`] | S10, bids and returns against fuel and place |
//! | [`activity`] | what is done against the diagram of the mission |
//! | [`flight`] | what is flown against what is wanted: hold, home |
//! | [`progress`] | S2, S9, L6, L7: limits and restarts |
//!
//! S1 is recorded by the world, S12 caught by the driver, L5 decided at the end of a
//! run, S8 tested in the peer's crate. Checks run incrementally on reports and
//! transmissions, and once a beacon period on a copy of each peer's beliefs.

pub mod activity;
pub mod airtime;
pub mod bounds;
pub mod cadence;
pub mod checker;
pub mod contours;
pub mod counts;
pub mod cover;
pub mod crowds;
pub mod decision;
pub mod detections;
pub mod findings;
pub mod flight;
pub mod footprint;
pub mod fuel;
pub mod graph;
pub mod handicaps;
pub mod layers;
pub mod listing;
pub mod membership;
pub mod patience;
pub mod progress;
pub mod record;
pub mod relays;
pub mod rules;
pub mod snapshot;
pub mod spoken;
pub mod spread;
pub mod streets;
pub mod tasks;
#[cfg(test)]
mod testing;
pub mod tracks;
pub mod twins;
pub mod watch;
pub mod wind;

pub use bounds::{Bounds, Grade};
pub use checker::{Checker, Reached};
pub use findings::{Clocks, Findings, Violation};
pub use graph::{Graph, Stability};
pub use handicaps::Handicaps;
pub use snapshot::{PeerSnapshot, Snapshot};
