//! What the swarm flies: routes, trajectories and coverage loops (D2.7 §2.3–2.4, 3.4–3.6).
//!
//! Pure functions of their inputs: every peer derives the same loop and the same
//! division of work from the same mission, to the bit.
//!
//! | module | what it holds | D2.7 |
//! |---|---|---|
//! | [`airframe`] | what a UAV can fly | 2.2 |
//! | [`route`] | the shortest route with clearance | 2.3.2 |
//! | [`trajectory`] | Dubins words, flights in wind, timed trajectories | 2.4 |
//! | [`coverage`] | closed loops over areas, points and lines, and their division among UAVs | 3.4–3.6 |

pub mod airframe;
pub mod coverage;
pub mod route;
pub mod trajectory;
