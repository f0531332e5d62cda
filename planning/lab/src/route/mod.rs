//! Other ways to shortest paths, to compare the mesh search with (D2.7 §2.3.2–2.3.3).
//!
//! | module | what it holds |
//! |---|---|
//! | [`continuous`] | all shortest paths from one source: continuous Dijkstra |
//! | [`landmarks`] | lower bounds of distances from a few such maps ("ALT") |
//! | [`cut`] | why there is no path: a closed chain of walls |

pub mod continuous;
pub mod cut;
#[cfg(test)]
#[path = "../../../flight/src/route/degenerate_maps.rs"]
mod degenerate_maps;
pub mod landmarks;
#[cfg(test)]
use skein_flight::route::mesh;
