//! Coverage planning (D2.7 §3.4–3.6): points, lines and strips, areas.
//!
//! | module | what it holds |
//! |---|---|
//! | [`ring`] | the closed loop of cells that all UAVs share, and its division |
//! | [`lanes`] | the loop of an area in lanes: spanning-tree coverage |
//! | [`stations`] | the loop through points, pieces of lines, or passes |
//! | [`passes`] | straight passes over an area: boustrophedon decomposition |
//! | [`lines`] | tours along lines: the rural postman |
//! | [`tour`] | one closed tour through points |
//! | [`metric`] | what it costs to fly from place to place |

pub mod lanes;
pub mod lines;
pub mod metric;
pub mod passes;
pub mod ring;
pub mod stations;
pub mod tour;
