//! Faults: one enum, for simulated and live swarms.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Something that goes wrong, or is put right. Peers are named by their numbers.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Fault {
    /// The peer's process and its airframe are gone at once.
    Kill {
        /// Which peer.
        peer: u16,
    },
    /// The process ends at once; the airframe loiters on its failsafe.
    KillComputer {
        /// Which peer.
        peer: u16,
    },
    /// The process is asked to end.
    Terminate {
        /// Which peer.
        peer: u16,
    },
    /// The process stands still.
    Pause {
        /// Which peer.
        peer: u16,
    },
    /// The process goes on.
    Resume {
        /// Which peer.
        peer: u16,
    },
    /// The process starts again: after `Kill` at its launch point with a new
    /// airframe, after `KillComputer` in the loitering one.
    Restart {
        /// Which peer.
        peer: u16,
        /// Without its journal.
        #[serde(default)]
        fresh_disk: bool,
    },
    /// The radio link between two peers is cut.
    Cut {
        /// One end.
        a: u16,
        /// The other end.
        b: u16,
        /// Whether only transmissions from `a` to `b` are lost.
        #[serde(default)]
        one_way: bool,
    },
    /// Links between different groups are cut; peers named in no group form one more.
    Partition {
        /// The groups.
        groups: Vec<Vec<u16>>,
    },
    /// All cuts and partitions end.
    Heal,
    /// The operator moves the base: the ground station speaks the mission's next revision.
    Rebase {
        /// East of the mission's origin, mm.
        east_mm: i32,
        /// North of it, mm.
        north_mm: i32,
    },
    /// The share of transmissions lost on every link, in thousandths.
    Loss {
        /// Thousandths.
        permille: u16,
    },
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Kill { peer } => write!(f, "peer {peer} is killed"),
            Self::KillComputer { peer } => write!(f, "the computer of peer {peer} is killed"),
            Self::Terminate { peer } => write!(f, "peer {peer} is asked to end"),
            Self::Pause { peer } => write!(f, "peer {peer} stands still"),
            Self::Resume { peer } => write!(f, "peer {peer} goes on"),
            Self::Restart { peer, fresh_disk } => {
                let disk = if *fresh_disk { "without" } else { "with" };
                write!(f, "peer {peer} is restarted {disk} its disk")
            }
            Self::Cut { a, b, one_way } => {
                let and = if *one_way { "to" } else { "and" };
                write!(f, "link {a} {and} {b} is cut")
            }
            Self::Partition { groups } => write!(f, "partition {groups:?}"),
            Self::Heal => write!(f, "all links heal"),
            Self::Rebase { .. } => write!(f, "the operator moves the base"),
            Self::Loss { permille } => {
                let percent = f64::from(*permille) / 10.0;
                write!(f, "{percent:.1} % of transmissions are lost")
            }
        }
    }
}

/// A fault and when it happens.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TimedFault {
    /// Scenario time, milliseconds.
    pub at_ms: u64,
    /// What happens.
    pub fault: Fault,
}
