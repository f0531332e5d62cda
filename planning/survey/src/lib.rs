//! Plans of a team for a person, made before the flight (D2.7 §2.3.2, 3.4–3.6).
//!
//! No peer, node or simulator uses this crate: the swarm divides one loop among itself
//! (`skein-flight`). Here one computer knows the whole team and gives each UAV a plan of
//! its own.
//!
//! Plain values in, plain values out: no files, no flags, and errors that name what is
//! wrong. Lengths are metres in one tangent plane, headings radians counter-clockwise from
//! east.
//!
//! | module | what it plans | D2.7 |
//! |---|---|---|
//! | [`area`] | an area covered by a team | 3.6.1–3.6.5 |
//! | [`tours`] | tours of a team along lines or over points | 3.4, 3.5 |
//! | [`patrol`] | points, lines or an area seen again and again | 3.6.6 |
//! | [`route`] | the shortest way over places round zones | 2.3 |
//!
//! | module | what they share | D2.7 |
//! |---|---|---|
//! | [`team`] | the UAVs: start, speed, endurance, sensors | 3.1 |
//! | [`objective`], [`heights`] | what is to be least; heights of flights that meet | 3.1, 3.6 |
//! | [`flight`] | what a UAV flies, and what that takes | 3.6 |
//! | [`zones`], [`detours`] | zones and fences, and the ways round them | 2.3.1 |
//! | [`landing`] | how a fixed wing comes down after its flight | 2.3, 2.4 |
//! | [`fleet`] | teams whose UAVs differ: sections, selection, layers | 3.1, 3.6 |
//! | [`regions`] | an area in lane cells, one connected region for each UAV | 3.6.2, 3.6.4–3.6.5 |
//! | [`passes`] | the straight passes of an area shared out among a team | 3.6.3 |
//! | [`visits`] | tours of a team over points | 3.4.2 |
//! | [`visibility`] | shortest paths by the visibility graph | 2.3.2 |
//! | [`via_points`] | shortest paths over places in a given order | 2.3.2 |
//!
//! Two UAVs over a field of 600 by 400 m, from its corner (`examples/plan_cover.rs` has
//! zones and unlike sensors):
//!
//! ```
//! use skein_geometry::Polygon;
//! use skein_geometry::frame::Point;
//! use skein_survey::area::{self, AreaRequest};
//! use skein_survey::team::{Sensor, Uav};
//!
//! let corners = [(0.0, 0.0), (600.0, 0.0), (600.0, 400.0), (0.0, 400.0)];
//! let field = Polygon::new(corners.map(|(x, y)| Point::new(x, y)).to_vec())?;
//! let camera = Sensor::Swath { width_m: 60.0 };
//! // From the corner, at 15 m/s, turning within 25 m.
//! let uav = |name| Uav::new(name, Point::origin(), 15.0, 25.0, camera);
//! let (clearance_m, altitude_m) = (10.0, 80.0);
//! let team = vec![uav("red"), uav("blue")];
//! let mut request = AreaRequest::new(field, team, clearance_m, altitude_m);
//! request.steps = 1_000;
//! let plan = area::plan(&request)?;
//! assert!(plan.figures.covered_share > 0.999);
//! assert!(plan.uavs.iter().all(|uav| uav.flies() && uav.path.len() > 2));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod area;
pub mod detours;
pub mod fleet;
pub mod flight;
pub mod flown;
pub mod heights;
pub mod landing;
pub mod measure;
pub mod objective;
pub mod passes;
pub mod patrol;
pub mod regions;
pub mod route;
pub mod team;
pub mod tours;
pub mod via_points;
pub mod visibility;
pub mod visits;
pub mod zones;
