//! The lanes of a scenario: how far apart, how clear of zones, and which spanning tree they
//! follow. Leaves choosing a tree where none is stated to `choose_tree`.

use skein_flight::coverage::ring::Tree;
use skein_interop::json::{Error, Fields, Node};

/// What a scenario says of its lanes, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lanes {
    pub(crate) spacing_m: f64,
    /// Distance from the zones; it follows from turns and tracking where none is stated.
    pub(crate) clearance_m: Option<f64>,
    pub(crate) tracking_error_m: f64,
    /// None when the scenario leaves it open.
    pub(crate) tree: Option<Tree>,
}

pub(crate) fn read(f: &Fields<'_>) -> Result<Lanes, Error> {
    let lanes = f.need("lanes", "{ spacing_m: 48 }")?.fields(&[
        "spacing_m",
        "clearance_m",
        "tracking_error_m",
        "tree",
    ])?;
    Ok(Lanes {
        spacing_m: lanes
            .need("spacing_m", "48")?
            .number(2.0, 5000.0, "metres")?,
        clearance_m: lanes
            .get("clearance_m")
            .map(|n| n.number(0.0, 5000.0, "metres"))
            .transpose()?,
        tracking_error_m: lanes.number_or("tracking_error_m", 3.0, 0.0, 1000.0, "metres")?,
        tree: lanes.get("tree").map_or(Ok(None), tree)?,
    })
}

fn tree(node: &Node<'_>) -> Result<Option<Tree>, Error> {
    let mut all = vec![("best", None)];
    all.extend(Tree::ALL.into_iter().map(|t| (t.name(), Some(t))));
    node.one_of(&all)
}
