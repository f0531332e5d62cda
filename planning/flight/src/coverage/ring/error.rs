//! Why there is no coverage loop.

use crate::coverage::passes::PassesError;
use thiserror::Error;

/// Why there is no loop.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LoopError {
    /// The turn radius does not fit into the lane spacing.
    #[error(
        "a turn radius of {radius_m:.1} m does not fit lanes of {spacing_m:.1} m: the radius may be at most half the spacing"
    )]
    TurnRadius {
        /// Turn radius, metres.
        radius_m: f64,
        /// Lane spacing, metres.
        spacing_m: f64,
    },
    /// The footprint is too small to see a cell from the loop.
    #[error(
        "the camera footprint is too small: seeing a {spacing_m:.1} m cell from a turn needs half a footprint of at least {across_m:.1} m across and {along_m:.1} m along"
    )]
    Footprint {
        /// Lane spacing, metres.
        spacing_m: f64,
        /// Needed half width, metres.
        across_m: f64,
        /// Needed half length, metres.
        along_m: f64,
    },
    /// No cell of the area can be flown.
    #[error("no cell of the area can be flown: the no-fly zones leave no room")]
    Nothing,
    /// More cells than a mission may have.
    #[error("the area has {0} cells, a mission may have at most 65,535")]
    TooManyCells(usize),
    /// The area or the launch point lies too far from the origin.
    #[error("the area or the launch point lies more than 20 km from the mission's origin")]
    Extent,
    /// A length is no number, negative or too small.
    #[error("the {0} is not a usable length")]
    Number(&'static str),
    /// No route leads from the launch point to the loop.
    #[error("no flyable route leads from the launch point to the area: no-fly zones part them")]
    CutOff,
    /// No exact passes over the area.
    #[error(transparent)]
    Passes(#[from] PassesError),
    /// The launch point cannot reach the loop.
    #[error("the launch point lies inside a no-fly zone or its clearance")]
    Launch,
}
