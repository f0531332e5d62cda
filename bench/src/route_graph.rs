//! `bench route --graph`: the visibility graph beside the mesh, on the same questions
//! (D2.7 §2.3.2 against §2.3.3).

use super::figures::timed;
use crate::navmesh::Query;
use serde::Serialize;
use skein_geometry::frame::Point;
use skein_survey::visibility::VisibilityGraph;

/// A relative difference above this is a wrong answer of one of the two.
const EXACT: f64 = 1e-9;

/// The graph: size, lengths against those of the mesh, times, and when it pays.
#[derive(Serialize)]
pub struct GraphFigures {
    graph_corners: usize,
    graph_edges: usize,
    graph_mismatches: usize,
    graph_build_ms: f64,
    /// Of one question, mean.
    graph_query_us: f64,
    /// Questions from which on the graph is cheaper than the mesh, building included;
    /// none if it never is.
    graph_pays_from: Option<f64>,
}

/// Builds the graph of all rings, of which the first is the border, and asks it what
/// the mesh was asked.
pub fn measure(
    rings: &[Vec<Point>],
    queries: &[Query],
    mesh_build_ms: f64,
    mesh_query_us: f64,
) -> GraphFigures {
    // The border of the field is no obstacle: no shortest path between points inside
    // goes round it.
    let holes = (0..).zip(rings.iter().skip(1).map(Vec::as_slice));
    let (graph, build_us) = timed(|| VisibilityGraph::of_rings(holes));
    let (lengths, query_us) = timed(|| {
        let length = |q: &Query| {
            graph
                .shortest(q.from, q.to)
                .map_or(f64::NAN, |p| p.length_m)
        };
        queries.iter().map(length).collect::<Vec<f64>>()
    });
    let is_wrong = |(q, length_m): &(&Query, &f64)| {
        let error = (*length_m - q.length_m).abs() / q.length_m.max(1.0);
        error.is_nan() || error > EXACT
    };
    let graph_query_us = query_us / queries.len().max(1) as f64;
    let saved_us = mesh_query_us - graph_query_us;
    let extra_us = build_us - mesh_build_ms * 1e3;
    GraphFigures {
        graph_corners: graph.corners(),
        graph_edges: graph.edges(),
        graph_mismatches: queries.iter().zip(&lengths).filter(is_wrong).count(),
        graph_build_ms: build_us / 1e3,
        graph_query_us,
        graph_pays_from: (saved_us > 0.0).then_some((extra_us / saved_us).max(0.0)),
    }
}
