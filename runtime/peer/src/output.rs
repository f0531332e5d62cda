//! What a peer wants done, and what it reports.

use crate::gathering::CrowdAlert;
use crate::offload::Job;
use crate::task_desk::TaskHolder;
use crate::why::BidHeard;
use crate::wire::detection::Detection;
use crate::wire::tasks::{TaskId, TaskState};
use crate::{Incarnation, Mission, PeerId};
use serde::{Deserialize, Serialize};
use skein_behaviors::Setpoint;
use skein_flight::coverage::ring::backtracking::Leg;
use std::sync::Arc;

/// One thing to do. Drain them all after each input.
#[derive(Clone, Debug)]
pub enum Output {
    /// Broadcast these bytes one hop, under this key.
    Publish {
        /// The natural key, `<fleet>/v4/<kind>/<subject>/<author>`.
        key: String,
        /// The record.
        bytes: Vec<u8>,
        /// Hops these bytes have made so far; 0 for what this peer wrote itself.
        hops: u8,
        /// Which transmissions go first when the channel is short.
        priority: Priority,
        /// Drop it if it could not be sent within this time, milliseconds.
        lifetime_ms: u32,
    },
    /// Fly this.
    Setpoint(Setpoint),
    /// Make this record durable, then answer with `Stored`.
    Store {
        /// Names the answer.
        token: u64,
        /// The journal record.
        record: Vec<u8>,
    },
    /// Compute this, then answer with `Computed`.
    Compute {
        /// Names the answer.
        token: u64,
        /// The problem.
        job: Job,
    },
    /// For logs, displays and judges; nothing depends on it.
    Report(Report),
}

/// Which transmissions go first. Lower goes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Priority {
    /// Approach conflicts.
    Conflict,
    /// Claims, bids, orders.
    Claim,
    /// Beacons and coverage.
    Beacon,
    /// States, missions and all else.
    Telemetry,
}

/// What became known of a task.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TaskNews {
    /// Somebody asks for it.
    Asked,
    /// This UAV won it and flies there.
    Flies,
    /// This UAV won it, a relay position, and gives its section up for it.
    Relays,
    /// This UAV is at the relay position.
    Holds,
    /// This UAV won it, a target to follow, and gives its section up for it.
    Tracks,
    /// This UAV sees the target and follows it.
    Follows,
    /// This UAV lost the target and searches where it may be.
    Searches,
    /// This UAV wants to be relieved of it: its fuel will be due.
    Leaving,
    /// This UAV saw all of it.
    Seen,
    /// It is another's, changed or over: this UAV left it.
    Left,
    /// Another UAV says that it did it.
    DoneBy(PeerId),
    /// Nobody who lives can do it, and why.
    NobodyCan(String),
    /// Who asked for it says that it is over, or its time is.
    Over(TaskState),
}

impl TaskNews {
    /// Its name.
    #[must_use]
    pub const fn word(&self) -> &'static str {
        match self {
            Self::Asked => "asked",
            Self::Flies => "flies",
            Self::Relays => "relays",
            Self::Holds => "holds",
            Self::Tracks => "tracks",
            Self::Follows => "follows",
            Self::Searches => "searches",
            Self::Leaving => "leaving",
            Self::Seen => "seen",
            Self::Left => "left",
            Self::DoneBy(_) => "done-by",
            Self::NobodyCan(_) => "nobody-can",
            Self::Over(_) => "over",
        }
    }

    /// What it says of the task of a name, `it` being who tells.
    #[must_use]
    pub fn sentence(&self, name: &str) -> String {
        match self {
            Self::Asked => format!("the task {name:?} is asked for"),
            Self::Flies => format!("it won the task {name:?} and flies there"),
            Self::Relays => {
                format!("it won the relay position {name:?}, gives its section up and flies there")
            }
            Self::Holds => format!("it holds the relay position {name:?}"),
            Self::Tracks => {
                format!(
                    "it won the task {name:?} to follow a target, gives its section up and flies there"
                )
            }
            Self::Follows => format!("it sees the target of the task {name:?} and follows it"),
            Self::Searches => {
                format!("it lost the target of the task {name:?} and searches where it may be")
            }
            Self::Leaving => {
                format!("it asks to be relieved of the task {name:?}: its fuel will be due")
            }
            Self::Seen => format!("it did the task {name:?}: all of it was seen"),
            Self::Left => format!("it left the task {name:?}: another's, changed or over"),
            Self::DoneBy(PeerId(by)) => format!("uav{by} did the task {name:?}"),
            Self::NobodyCan(why) => format!("nobody can do the task {name:?}: {why}"),
            Self::Over(state) => format!("the task {name:?} is {}", state.word()),
        }
    }
}

/// What a peer believes of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Status {
    /// Heard from recently enough.
    Alive,
    /// Silent for too long; may be refuted.
    Suspect,
    /// Believed dead or out of reach; its work may be taken over.
    Down,
}

/// Something a person or a judge may want to know.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Report {
    /// The peer runs under this incarnation.
    Booted {
        /// The incarnation.
        incarnation: Incarnation,
    },
    /// The peer holds the mission and has derived its loop.
    Ready {
        /// Mission revision.
        revision: u32,
        /// Identifies the loop.
        loop_hash: u64,
        /// Number of cells on the loop.
        cells: u16,
    },
    /// The belief about another peer changed.
    Membership {
        /// Whom it concerns.
        peer: PeerId,
        /// Which life of it.
        incarnation: Incarnation,
        /// The new belief.
        status: Status,
    },
    /// A round of negotiation was started or joined.
    Round {
        /// Its counter.
        counter: u32,
        /// Its members.
        members: Vec<PeerId>,
        /// Whether it answers cells that nobody lists; any other rebalances.
        repair: bool,
        /// The own bid.
        bid: BidHeard,
    },
    /// The own claim was spoken: a division was adopted, cells were taken without a round, or
    /// the expected end changed.
    Claim {
        /// Counter of the epoch.
        counter: u32,
        /// Hash of the epoch's bids.
        epoch: u32,
        /// How often cells were taken without a round since, and how near they were by then,
        /// up to 60.
        take: u16,
        /// What will be flown, in order.
        legs: Vec<Leg>,
        /// Cells given away and not yet taken over.
        held: Vec<u16>,
        /// Expected end of the plan, milliseconds from now.
        eta_ms: u32,
    },
    /// Cells newly seen by this peer's own camera, by index on the loop.
    Covered {
        /// The cells.
        cells: Vec<u16>,
    },
    /// The whole union is covered, as far as this peer knows.
    Finished {
        /// Mission revision.
        revision: u32,
    },
    /// The operator gave this ground station a newer mission, which it speaks.
    Revised {
        /// The mission.
        mission: Arc<Mission>,
    },
    /// This peer knows of obstacles that are on no map, and follows its mission with zones round
    /// them.
    Found {
        /// The mission.
        mission: Arc<Mission>,
    },
    /// Something about a task other than coverage.
    Task {
        /// Which.
        id: TaskId,
        /// In which revision it was asked for.
        revision: u32,
        /// What people call it.
        name: String,
        /// What.
        news: TaskNews,
        /// Who holds it by then, with which bids, as far as this peer knows; told with what it
        /// does of the task itself.
        held_by: Vec<TaskHolder>,
    },
    /// An object that the mission looks for: this peer saw it, or was told of it, and tells or
    /// withdraws it.
    Detected {
        /// By whom, and in which of its registers.
        id: TaskId,
        /// What, where and when.
        told: Detection,
    },
    /// A sector of the event that the mission watches became too dense, or has eased, as this peer
    /// saw or was told.
    Crowd {
        /// Which, and how dense.
        told: CrowdAlert,
    },
    /// What this peer knows of a contour has changed by much.
    Traced {
        /// Its length, metres.
        length_m: u64,
        /// What it encloses, m², where it closes.
        area_m2: Option<u64>,
        /// By so many places.
        places: u32,
    },
    /// Another process speaks under this id: this one is silent from now on, until it
    /// reports that it runs under another incarnation.
    Silenced,
    /// Something a person should look at.
    Alarm {
        /// What.
        text: String,
    },
    /// A record, a percept or an order that was refused: it changes no belief. A claim or a bid
    /// that is refused for a round far ahead was well formed, and is passed on all the same.
    Refused {
        /// Why.
        reason: String,
    },
}
