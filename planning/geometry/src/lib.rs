//! Polygons, curves, frames and the arithmetic below all planning (D2.7 §2.2, 2.3.1).
//!
//! No clock, no peers, no files, no randomness. Everything here gives the same answer
//! to the bit on every machine, because every peer derives the same coverage loop and
//! the same division of work from it.
//!
//! | module | what it holds | D2.7 |
//! |---|---|---|
//! | [`frame`] | points, vectors, poses; the ENU tangent plane of a mission | 2.2 |
//! | [`math`] | the only source of transcendental functions | |
//! | [`polygon`] | simple polygons, valid by construction; exact orientation | 2.3.1 |
//! | [`polyline`] | lines from place to place: their length, what is nearest on them | 3.5 |
//! | [`curve`] | lines and arcs joined tangentially | 2.4 |
//! | [`clearance`] | exact clearance of points and curves from no-fly zones | 2.3.1 |
//! | [`offset`] | zones grown by a safety radius, with a certificate | 2.3.1 |
//! | [`random`] | the seeded pseudo-random generator | |
//! | [`hash`] | FNV-1a, and the fingerprint by which two processes compare what they have built | |
//!
//! ```
//! use skein_geometry::frame::Point;
//! use skein_geometry::{NoFlyZones, Polygon};
//! let corners = [(0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0)];
//! let zone = Polygon::new(corners.map(|(x, y)| Point::new(x, y)).to_vec())?;
//! let zones = NoFlyZones::new(vec![zone]);
//! assert!((zones.distance_m(Point::new(130.0, 50.0)) - 30.0).abs() < 1e-9);
//! # Ok::<(), skein_geometry::PolygonError>(())
//! ```

pub mod clearance;
pub mod curve;
mod distance;
pub mod frame;
pub mod hash;
pub mod math;
pub mod offset;
pub mod polygon;
pub mod polyline;
pub mod random;

pub use clearance::{NoFlyZones, contingency_clear};
pub use curve::{Curve, Segment};
pub use polygon::{Polygon, PolygonError};
