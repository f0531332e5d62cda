//! Coverage planning (D2.7 §3.4–3.6): points, lines and strips, areas.

pub mod area;
mod dice;
pub mod exact;
pub mod fleet;
pub mod grid;
pub mod line;
pub mod metric;
pub mod patrol;
pub mod pinpoint;
pub mod stations;
