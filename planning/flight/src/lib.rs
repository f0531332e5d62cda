//! What the swarm flies: routes, trajectories and coverage loops (D2.7 §2.3–2.4, 3.4–3.6).
//!
//! Pure functions of their inputs: every peer derives the same loop and the same
//! division of work from the same mission, to the bit.
//!
//! | module | what it holds | D2.7 |
//! |---|---|---|
//! | [`airframe`] | what a UAV can fly | 2.2 |
//! | [`mount`] | how its camera is held | 1.2.1 |
//! | [`route`] | the shortest route with clearance | 2.3.2 |
//! | [`trajectory`] | Dubins words, flights in wind, timed trajectories | 2.4 |
//! | [`separation`] | promised motions, whether two keep apart, ways round | 1.3 |
//! | [`tracking`] | following targets: guidance, estimates, hand-over | 3.7 |
//! | [`tracing`] | following a road or a fire's edge by what is seen of it | 3.1 |
//! | [`streets`] | networks of streets: where a vehicle is on one, the quickest way | 3.1 |
//! | [`coverage`] | closed loops over areas, points and lines, and their division among UAVs | 3.4–3.6 |
//!
//! ```
//! use skein_flight::coverage::lanes;
//! use skein_flight::coverage::ring::backtracking::{RingCell, Uav, divide};
//! use skein_flight::coverage::ring::{Direction, LoopProblem, Tree};
//! use skein_geometry::frame::Point;
//! use skein_geometry::{NoFlyZones, Polygon};
//! use std::sync::Arc;
//!
//! let corners = [(0.0, 0.0), (384.0, 0.0), (384.0, 192.0), (0.0, 192.0)];
//! let problem = LoopProblem {
//!     area: Polygon::new(corners.map(|(x, y)| Point::new(x, y)).to_vec())?,
//!     zones: Arc::new(NoFlyZones::new(Vec::new())),
//!     lane_spacing_m: 48.0,
//!     turn_radius_m: 23.0,
//!     clearance_m: 8.0,
//!     footprint_across_m: 46.0,
//!     footprint_along_m: 36.0,
//!     tracking_error_m: 2.0,
//!     launch: Point::new(-20.0, -20.0),
//!     tree: Tree::default(),
//! };
//! // The loop that every peer derives for itself: eight columns and four rows of cells.
//! let coverage_loop = lanes::build(&problem)?;
//! assert_eq!(coverage_loop.len(), 32);
//!
//! // One of the two divisions of which every peer computes the better from the same bids.
//! let ring: Vec<RingCell> = coverage_loop
//!     .cells()
//!     .iter()
//!     .map(|c| RingCell { service_mm: c.service_mm, travel_mm: c.travel_mm, open: true })
//!     .collect();
//! let uav = |id, anchor| Uav {
//!     anchor,
//!     id,
//!     heading: Direction::Forward,
//!     release_ms: 0,
//!     speed_mmps: 20_000,
//!     turn_ms: 8_000,
//!     endurance_ms: 3_600_000,
//!     off_loop: None,
//! };
//! let division = divide(&ring, &[uav(1, 0), uav(2, 16)]);
//! assert_eq!(division.sections.len(), 2);
//! assert!(division.unassigned.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod airframe;
pub mod coverage;
pub mod mount;
pub mod route;
pub mod separation;
pub mod streets;
pub mod tracing;
pub mod tracking;
pub mod trajectory;
