//! Pinpoint coverage: points to visit, by one UAV or by a team (D2.7 §3.4).
//!
//! | module | what it holds | D2.7 |
//! |---|---|---|
//! | [`tour`] | one closed tour: spanning tree in preorder, then exchanges | 3.4.1 |
//! | [`tree_cover`] | min-max tree covers, rooted and free, with their proofs | 3.4.2 |
//! | [`multi`] | tours of a team, the default | 3.4.2 |
//! | [`graph`] | the graphs of the tree covers | |
//!
//! Distances come from a [`crate::coverage::metric::Metric`], so flown distances can be
//! passed in.

pub mod graph;
pub mod multi;
pub mod tour;
pub mod tree_cover;
