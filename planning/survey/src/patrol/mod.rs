//! Continuous patrol of any closed tour (D2.7 §3.6.6): of points, lines, strips, exact
//! passes, cells. What counts is the longest time between two visits of a place.
//!
//! Equal UAVs fly round, evenly spaced. Unequal ones either fly to and fro, each on an
//! arc with a turn at both ends, so that all take equally long, or the fastest few fly round at the speed of the
//! slowest of them, whichever revisits sooner. When UAVs fail the others go on from
//! where they are: round the tour some loiter until spacing is even again, on arcs each
//! moves over to its new one.
//!
//! | module | what it holds |
//! |---|---|
//! | `pattern` | which pattern, and how soon it revisits |
//! | `course` | where a UAV is, and when it sees a place |
//! | `change` | the beginning, and what follows a failure |
//! | `tour` | a closed flight, by length |
//! | `team_tour` | that flight over points, lines or an area, with its turns |
//! | `watch` | the team beside it |
//! | `team_patrol` | all of it for a team over points, lines or an area: [`plan`] |
//!
//! Lengths are whole units of any kind: millimetres, cells, or flight times at the common
//! speed. Speeds are units a second. In a constant wind, what a piece takes is the mean of
//! both directions: what that leaves out vanishes once round, and is the same for all who
//! pass a place, so the time between them stays.
//!
//! Left to others by all but `team_patrol`: the tour, who is alive, and the ways there.
//!
//! ```
//! use skein_survey::patrol::{Pattern, patrol, revisit_bound};
//! // Three equal UAVs on a tour of 9 km at 15 m/s: each place every 200 s.
//! let speeds = [15_000; 3];
//! let three = patrol(9_000_000, &speeds).unwrap();
//! assert!(matches!(three.pattern, Pattern::Round { .. }));
//! assert!((three.revisit_s - 200.0).abs() < 1e-9);
//! assert!((revisit_bound(9_000_000, &speeds) - 200.0).abs() < 1e-9);
//! ```

mod change;
mod course;
mod pattern;
mod team_patrol;
mod team_tour;
#[cfg(test)]
mod tests;
mod tour;
mod watch;

pub use change::{Change, Stand, Station, after_losses, spread};
pub use course::Course;
pub use pattern::{
    Patrol, Pattern, Uav, patrol, patrol_within, proportional, respace, revisit_bound,
};
pub use team_patrol::{
    AfterLosses, GoesOn, Losses, Over, PatrolError, PatrolFlight, PatrolPlan, PatrolRequest,
    PatrolStation, TourKind, plan,
};
pub use tour::{Tour, TourError};
