//! Which spanning tree the loop of an area goes round (D2.7 §3.6.2, algorithm 5: "any
//! spanning tree"; the document compares trees by the turns they cost).
//!
//! Left to others: blocks and curves ([`crate::coverage::lanes`]), and which tree is best in a wind.

use serde::{Deserialize, Serialize};

/// A kind of spanning tree over the blocks of an area.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub enum Tree {
    /// The least one with cheap edges along the area's longer side: few long lanes.
    #[default]
    Longer,
    /// The least one with cheap edges eastward: lanes run east and west.
    East,
    /// The least one with cheap edges northward: lanes run north and south.
    North,
    /// Depth-first from the south-western block: one long winding lane.
    DepthFirst,
}

impl Tree {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Longer, Self::East, Self::North, Self::DepthFirst];

    /// Its name in a scenario file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Longer => "longer",
            Self::East => "east",
            Self::North => "north",
            Self::DepthFirst => "depth_first",
        }
    }

    /// Whether it is what a mission has that does not say.
    #[must_use]
    #[allow(
        clippy::trivially_copy_pass_by_ref,
        reason = "the signature that serde asks for"
    )]
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }
}
