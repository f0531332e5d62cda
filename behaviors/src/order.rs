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

impl Order {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 3] = [Self::Resume, Self::Hold, Self::ReturnToBase];

    /// Its name, as a person writes it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Resume => "resume",
            Self::Hold => "hold",
            Self::ReturnToBase => "return-to-base",
        }
    }
}
