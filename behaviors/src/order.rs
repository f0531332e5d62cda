//! The operator's standing order (D2.7 §1.2.2): one type for consoles, radio and files.

use serde::{Deserialize, Serialize};

/// What the operator wants of every UAV, until the next order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// Carry on with the mission.
    #[default]
    Resume,
    /// Loiter where you are.
    Hold,
    /// Return to base and loiter there.
    ReturnToBase,
}
