//! Plans of a team for a person, made before the flight (D2.7 §2.3.2, 3.4–3.6).
//!
//! No peer, node or simulator uses this crate: the swarm divides one loop among itself
//! (`skein-flight`). Here one computer knows the whole team and gives each UAV a plan of
//! its own.
//!
//! | module | what it holds | D2.7 |
//! |---|---|---|
//! | [`regions`] | an area in lane cells, one connected region for each UAV | 3.6.2, 3.6.4–3.6.5 |
//! | [`passes`] | the straight passes of an area shared out among a team | 3.6.3 |
//! | [`visits`] | tours of a team over points | 3.4.2 |
//! | [`patrol`] | any closed tour flown again and again | 3.6.6 |
//! | [`fleet`] | teams whose UAVs differ: sections, selection, heights | 3.1, 3.6 |
//! | [`visibility`] | shortest paths by the visibility graph | 2.3.2 |
//! | [`via_points`] | shortest paths over places in a given order | 2.3.2 |
//!
//! ```
//! use skein_flight::coverage::passes::PassesProblem;
//! use skein_geometry::Polygon;
//! use skein_geometry::frame::Point;
//! use skein_survey::passes::{Uav, plan_team};
//!
//! let corners = [(0.0, 0.0), (400.0, 0.0), (400.0, 200.0), (0.0, 200.0)];
//! let area = Polygon::new(corners.map(|(x, y)| Point::new(x, y)).to_vec())?;
//! let base = Point::new(0.0, 0.0);
//! let plan = plan_team(&PassesProblem::new(area, 50.0, 20.0, base), &[Uav::at(base); 2])?;
//! assert_eq!(plan.tours.len(), 2);
//! assert!(plan.unserved.is_empty() && plan.makespan >= plan.lower_bound);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod fleet;
pub mod passes;
pub mod patrol;
pub mod regions;
pub mod via_points;
pub mod visibility;
pub mod visits;
