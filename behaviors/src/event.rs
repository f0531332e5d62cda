//! What the executive layer reports upwards.

use serde::{Deserialize, Serialize};

/// Something happened that the cooperation layer should know.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Event {
    /// The camera has seen the whole of these cells of the loop, by index.
    Seen(Vec<u16>),
    /// All legs are flown.
    PlanDone,
    /// No clear route exists to the next leg; its cells are given up.
    Refused {
        /// The cells of the loop, by index, that this UAV cannot reach.
        cells: Vec<u16>,
    },
}
