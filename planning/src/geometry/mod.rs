//! Polygons that are valid by construction and no-fly zones (D2.7 §2.3.1).

mod distance;
pub mod offset;
pub mod polygon;
pub mod zones;

pub use polygon::{Polygon, PolygonError};
pub use zones::{NoFlyZones, contingency_clear};
