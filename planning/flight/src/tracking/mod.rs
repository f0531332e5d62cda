//! Following ground targets (D2.7 §3.7): where to fly, what of it can be flown, what is
//! known of a target, and who follows which.
//!
//! | module | what it holds | D2.7 |
//! |---|---|---|
//! | [`field`] | vector fields that wind round a centre: Hopf's, and Lyapunov's beside it | 3.7.1 |
//! | [`orbit`] | headings along a field when the target moves and the wind blows | 3.7.1 |
//! | [`flyable`] | the least radius, and what a weave takes | 3.7.1, 3.7.2 |
//! | [`weave`] | sinusoids as long as their target is slow | 3.7.2 |
//! | [`mode`] | which of the two is flown, without chatter | 3.7.2 |
//! | [`follower`] | turn rate and airspeed, from percept to percept | 3.7 |
//! | [`aside`] | circles beside a zone lie aside from the target | 2.3.1, 3.7.1 |
//! | [`bend`] | ways beside the wanted one that keep clear of zones | 2.3.1 |
//! | [`estimate`] | position and velocity of a target from detections | 3.7.1 |
//! | [`tracks`] | several targets, false alarms, targets lost and found | 3.7 |
//! | [`told`] | estimates in few numbers, for the radio | 3.7 |
//! | [`chance`] | where a target that is out of sight may be, and where to look for it | 3.7 |
//! | [`streets`] | where it is if it keeps to streets that are known | 3.7 |
//! | [`buildings`] | whether a building stands before a target | 3.7.1 |
//! | [`vantage`] | the circle from which buildings hide it least | 3.7.1 |
//! | [`lookout`] | where to point a camera, and where to fly, by chances | 3.7 |
//! | [`fusion`] | what all UAVs know of a target together | 3.7 |
//! | [`handover`] | who follows which target | 3.7 |
//!
//! All of it is pure: the state that it needs from percept to percept is a value that the
//! caller keeps.

pub mod aside;
pub mod bend;
pub mod buildings;
pub mod chance;
pub mod estimate;
pub mod field;
pub mod flyable;
pub mod follower;
pub mod fusion;
pub mod handover;
pub mod lookout;
pub mod mode;
pub mod orbit;
pub mod streets;
pub mod told;
pub mod tracks;
pub mod vantage;
pub mod weave;

pub use field::{Field, Turn};
pub use follower::{Command, Follower, StandOff, TargetMotion};
