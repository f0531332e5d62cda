//! Faults: one enum, for simulated and live swarms.

use serde::{Deserialize, Serialize};
pub use skein_behaviors::Order;
use skein_peer::CoverageTask;
use skein_peer::input::NewTask;
use skein_peer::mission::PointMm;
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
    /// The operator gives another mission: the ground station speaks a revision with another
    /// area, other no-fly zones and other targets, in millimetres from the mission's origin.
    Revise {
        /// The area.
        area: Vec<PointMm>,
        /// All zones.
        zones: Vec<Vec<PointMm>>,
        /// What is to be seen there; none leaves it.
        #[serde(default)]
        task: Option<CoverageTask>,
    },
    /// The operator adds a no-fly zone to the mission that is flown: the ground station speaks
    /// the next revision.
    AddZone {
        /// What it is called from now on.
        name: String,
        /// Its corners, millimetres from the mission's origin.
        ring: Vec<PointMm>,
    },
    /// The operator takes a no-fly zone away that was added.
    RemoveZone {
        /// Which.
        name: String,
    },
    /// The operator asks for a task other than coverage: the ground station speaks it.
    AddTask {
        /// What is asked for.
        task: NewTask,
    },
    /// The operator wants a task no more.
    CancelTask {
        /// Which, by name.
        name: String,
    },
    /// The operator says that a task was done on the ground.
    DoneTask {
        /// Which, by name.
        name: String,
    },
    /// The operator wants something of all UAVs, or of one: the ground station speaks it.
    Order {
        /// What.
        order: Order,
        /// Of whom, if not of all.
        #[serde(default)]
        uav: Option<u16>,
    },
    /// Writes to the peer's journal fail: every one, or one in so many.
    FailStores {
        /// Which peer.
        peer: u16,
        /// Of so many writes one fails, by chance.
        #[serde(default = "every_one")]
        one_in: u32,
    },
    /// Every write to the peer's journal takes this much longer.
    SlowStores {
        /// Which peer.
        peer: u16,
        /// How much, milliseconds.
        delay_ms: u32,
    },
    /// The peer's disk works as it should again.
    HealStores {
        /// Which peer.
        peer: u16,
    },
    /// The peer's computer is busy with something else: it gets round to what has
    /// arrived only this long after the first of it did, and then to all at once.
    SlowComputer {
        /// Which peer.
        peer: u16,
        /// How long, milliseconds; 0 ends it.
        delay_ms: u32,
    },
    /// From now on the peer's clock gains on scenario time, or loses.
    ClockDrift {
        /// Which peer.
        peer: u16,
        /// Millionths gained; at most half, either way. 0 ends it.
        ppm: i32,
    },
    /// The peer's clock jumps ahead. No clock of a peer goes back.
    ClockJump {
        /// Which peer.
        peer: u16,
        /// How far, milliseconds.
        ahead_ms: u32,
    },
    /// The battery of a UAV lasts no longer than this from now on.
    ShortFuel {
        /// Which peer.
        peer: u16,
        /// How long, milliseconds.
        lasts_ms: u32,
    },
    /// An outsider repeats the last record on the air to a peer with bits wrong, so that
    /// nobody can read it.
    SpoiltRecord {
        /// Which peer.
        peer: u16,
    },
    /// A second UAV is switched on at the launch point of this one, whose computer was
    /// configured as that of this one: two processes speak under one id. A partition puts it
    /// on one of its sides, or aside.
    Twin {
        /// Whose id it has.
        peer: u16,
        /// Whether it is a second program in that one's airframe, where there is one in the
        /// air; otherwise it has an airframe of its own.
        #[serde(default)]
        aboard: bool,
    },
    /// The share of transmissions lost on every link, in thousandths.
    Loss {
        /// Thousandths.
        permille: u16,
    },
}

impl Fault {
    /// Whether something else is to be seen after it.
    #[must_use]
    pub fn changes_mission(&self) -> bool {
        matches!(
            self,
            Self::Revise { .. } | Self::AddZone { .. } | Self::RemoveZone { .. }
        )
    }

    /// Whether a ground station has to speak it.
    #[must_use]
    pub fn is_spoken(&self) -> bool {
        self.changes_mission()
            || matches!(
                self,
                Self::Order { .. }
                    | Self::Rebase { .. }
                    | Self::AddTask { .. }
                    | Self::CancelTask { .. }
                    | Self::DoneTask { .. }
            )
    }

    /// The peers that it names.
    #[must_use]
    pub fn peers(&self) -> Vec<u16> {
        match self {
            Self::Kill { peer }
            | Self::KillComputer { peer }
            | Self::Terminate { peer }
            | Self::Pause { peer }
            | Self::Resume { peer }
            | Self::Restart { peer, .. }
            | Self::FailStores { peer, .. }
            | Self::SlowStores { peer, .. }
            | Self::HealStores { peer }
            | Self::SlowComputer { peer, .. }
            | Self::ClockDrift { peer, .. }
            | Self::ClockJump { peer, .. }
            | Self::ShortFuel { peer, .. }
            | Self::SpoiltRecord { peer }
            | Self::Twin { peer, .. } => vec![*peer],
            Self::Cut { a, b, .. } => vec![*a, *b],
            Self::Partition { groups } => groups.concat(),
            Self::Heal
            | Self::Rebase { .. }
            | Self::Revise { .. }
            | Self::AddZone { .. }
            | Self::RemoveZone { .. }
            | Self::AddTask { .. }
            | Self::CancelTask { .. }
            | Self::DoneTask { .. }
            | Self::Loss { .. } => Vec::new(),
            Self::Order { uav, .. } => uav.iter().copied().collect(),
        }
    }
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
            Self::Revise { zones, .. } => {
                let n = zones.len();
                write!(
                    f,
                    "the operator gives another mission, with {n} no-fly zones"
                )
            }
            Self::AddZone { name, .. } => {
                write!(f, "the operator adds the no-fly zone {name}")
            }
            Self::RemoveZone { name } => {
                write!(f, "the operator takes the no-fly zone {name} away")
            }
            Self::AddTask { task } => {
                let name = task.name.as_deref().unwrap_or("without a name");
                write!(f, "the operator asks for the task {name}")
            }
            Self::CancelTask { name } => write!(f, "the operator wants the task {name} no more"),
            Self::DoneTask { name } => {
                write!(
                    f,
                    "the operator says that the task {name} was done on the ground"
                )
            }
            Self::Order { order, uav } => {
                write!(f, "the operator says {}", order.name())?;
                uav.map_or(Ok(()), |uav| write!(f, " to uav{uav}"))
            }
            Self::FailStores {
                peer,
                one_in: 0 | 1,
            } => {
                write!(f, "the disk of peer {peer} takes no writes")
            }
            Self::FailStores { peer, one_in } => {
                write!(f, "the disk of peer {peer} loses one write in {one_in}")
            }
            Self::SlowStores { peer, delay_ms } => {
                write!(f, "writes of peer {peer} take {delay_ms} ms longer")
            }
            Self::HealStores { peer } => write!(f, "the disk of peer {peer} works again"),
            Self::SlowComputer { peer, delay_ms: 0 } => {
                write!(f, "the computer of peer {peer} is quick again")
            }
            Self::SlowComputer { peer, delay_ms } => {
                write!(f, "the computer of peer {peer} is {delay_ms} ms late")
            }
            Self::ClockDrift { peer, ppm } => {
                write!(f, "the clock of peer {peer} gains {ppm} millionths")
            }
            Self::ClockJump { peer, ahead_ms } => {
                write!(f, "the clock of peer {peer} jumps {ahead_ms} ms ahead")
            }
            Self::ShortFuel { peer, lasts_ms } => {
                write!(f, "the battery of peer {peer} lasts {lasts_ms} ms more")
            }
            Self::SpoiltRecord { peer } => write!(f, "peer {peer} is sent a spoilt record"),
            Self::Twin { peer, aboard } => {
                let what = if *aboard {
                    "program is started in the airframe of"
                } else {
                    "UAV is switched on as"
                };
                write!(f, "a second {what} peer {peer}")
            }
            Self::Loss { permille } => {
                let percent = f64::from(*permille) / 10.0;
                write!(f, "{percent:.1} % of transmissions are lost")
            }
        }
    }
}

fn every_one() -> u32 {
    1
}

/// A fault and when it happens.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TimedFault {
    /// Scenario time, milliseconds.
    pub at_ms: u64,
    /// What happens.
    pub fault: Fault,
}
