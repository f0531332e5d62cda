//! Teams whose UAVs differ: who sees which part of an area, who flies at all, and at
//! which height (D2.7 §3.1, §3.6: UAVs differ in speed, endurance and sensor).
//!
//! | file | what it holds |
//! |---|---|
//! | [`sections`] | an area divided into one connected section a crew of like swath |
//! | [`team_selection`] | the search for the UAVs of a team that fly at all |
//! | [`layers`] | heights for UAVs whose flights come near to each other |
//!
//! Left to others: the plan of a section (`exact`, `grid`), and what is best.

pub mod layers;
pub mod sections;
pub mod team_selection;
