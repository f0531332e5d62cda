//! Coverage planning (D2.7 §3.4–3.6). This slice holds area coverage.

pub mod area;
pub mod grid;
