//! Coverage planning (D2.7 §3.4–3.6): points, lines and strips, areas.

pub mod area;
pub mod exact;
pub mod line;
pub mod metric;
pub mod stations;
pub mod tour;
