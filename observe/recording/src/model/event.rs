//! What happened: structured, and in a sentence for a person.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Something that happened. In JSON the fields of [`What`] stand beside the others, its variant
/// as `kind`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Event {
    /// When, milliseconds of scenario time.
    pub time_ms: u64,
    /// Who knows it.
    pub origin: Origin,
    /// Whom it concerns: the UAV or ground station that it struck, or that said it.
    pub uav: Option<u16>,
    /// The same for a person.
    pub text: String,
    /// What.
    #[serde(flatten)]
    pub what: What,
}

/// Who knows of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Origin {
    /// A peer said so: what it believes or has decided.
    Peer,
    /// The simulated world: what is true, whether any peer knows it or not.
    World,
    /// The run: faults that were injected, what follows from several reports, rules that were
    /// checked.
    Run,
}

/// What happened. Cells are indices into the scene's `cells`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum What {
    /// A fault was injected.
    Fault {
        /// Its kind and fields, as scenario files and `skein chaos` name them.
        fault: serde_json::Map<String, serde_json::Value>,
    },
    /// A computer, with or without its airframe, is no more.
    Ended {
        /// Whether the airframe is gone too.
        airframe: bool,
        /// Cells that it listed and nobody had seen.
        cells: Vec<u16>,
        /// Those of them that nobody else lists: orphans.
        orphans: Vec<u16>,
    },
    /// A computer runs.
    Booted {
        /// In which life.
        incarnation: u32,
    },
    /// It holds the mission and has derived its loop.
    Ready {
        /// Revision of the mission.
        revision: u32,
        /// Cells of the loop.
        n_cells: u16,
    },
    /// A peer holds another for suspect, down, or alive again.
    Membership {
        /// Whom.
        of: u16,
        /// In which life.
        incarnation: u32,
        /// What it believes.
        belief: Belief,
    },
    /// A round of negotiation was started or joined.
    Round {
        /// Its counter.
        counter: u32,
        /// Its members.
        members: Vec<u16>,
        /// Whether it answers cells that nobody lists; any other rebalances. None in recordings
        /// of older programs.
        #[serde(default)]
        repair: Option<bool>,
    },
    /// The bids of a round, as far as they were told by then.
    Bids {
        /// Counter of the round.
        counter: u32,
        /// Whose, and what.
        bids: Vec<Bid>,
    },
    /// A peer says what it will fly: it replaces what it said before.
    Claim {
        /// Counter of the round that it goes back to.
        counter: u32,
        /// How often cells were taken without a round since.
        take: u16,
        /// Cells that it lists as its own future, in order of flight, covered ones among them.
        cells: Vec<u16>,
        /// Cells that it gave away and nobody has taken yet.
        held: Vec<u16>,
        /// When it expects to have flown them, milliseconds of scenario time from now.
        eta_ms: u32,
    },
    /// A peer lists orphans of one that ended.
    Takeover {
        /// Whose they were.
        from: u16,
        /// Which.
        cells: Vec<u16>,
        /// How long after the end, milliseconds of scenario time.
        after_ms: u64,
    },
    /// A peer's own camera saw cells.
    Covered {
        /// Which.
        cells: Vec<u16>,
        /// Those that no report named before.
        new: Vec<u16>,
    },
    /// The last coverable cell was seen.
    AllCovered,
    /// Which peers can reach each other changed.
    Components {
        /// The parts, each ascending.
        components: Vec<Vec<u16>>,
    },
    /// A peer holds that the mission is finished.
    Finished {
        /// Revision of the mission.
        revision: u32,
    },
    /// The operator gave another revision of the mission, or a peer knows of obstacles that are on
    /// no map.
    Revised {
        /// Which.
        revision: u32,
    },
    /// Something became known of a task other than coverage.
    Task {
        /// What people call it.
        name: String,
        /// What: `asked`, `won`, `flies`, `seen`, `left`, `done-by`, `nobody-can` or `over`; `won`
        /// where bundles are heard.
        news: String,
        /// Who asked for it; none in recordings of older programs.
        #[serde(default)]
        author: Option<u16>,
        /// Which of its author's tasks it is.
        #[serde(default)]
        number: Option<u16>,
        /// In which revision it was asked for.
        #[serde(default)]
        revision: Option<u32>,
        /// Of `done-by` who did it.
        #[serde(default)]
        by: Option<u16>,
        /// Who holds it by then, with their bids, as far as who tells knows.
        #[serde(default)]
        held_by: Vec<TaskBid>,
    },
    /// An object that the mission looks for was told, or withdrawn.
    Detected {
        /// Who saw it.
        by: u16,
        /// What it looks like.
        looks: String,
        /// Where, metres east of the origin.
        east_m: f64,
        /// And north of it.
        north_m: f64,
        /// No farther from there than this, metres.
        error_m: f64,
        /// Whether it counts; else it was told before.
        stands: bool,
    },
    /// A sector of a mass event became too dense, or has eased.
    Crowd {
        /// Who saw it first.
        by: u16,
        /// Where its middle is, metres east of the origin.
        east_m: f64,
        /// And north of it.
        north_m: f64,
        /// No farther from there than this, each way, metres.
        error_m: f64,
        /// People to a square metre.
        per_m2: f64,
        /// At least.
        low_per_m2: f64,
        /// And at most.
        high_per_m2: f64,
        /// Whether it is too dense; else it has eased.
        dense: bool,
    },
    /// What a peer knows of a contour has changed by much.
    Traced {
        /// Its length, metres.
        length_m: u64,
        /// What it encloses, m², where it closes.
        #[serde(default)]
        area_m2: Option<u64>,
    },
    /// A peer is silent: another process speaks under its id.
    Silenced,
    /// Something a person should look at.
    Alarm,
    /// A record, a percept or an order was refused.
    Refused,
    /// A UAV flew into a no-fly zone.
    ZoneEntry {
        /// Which, by its place among the scene's `zones`.
        zone: usize,
    },
    /// An airframe is gone without a fault that took it.
    Lost,
    /// A UAV left its launcher, at the word of its computer.
    TookOff,
    /// An airframe began or ceased to loiter by itself.
    Failsafe {
        /// Whether it began.
        on: bool,
    },
    /// A rule of the protocol was broken.
    Violation {
        /// Its name in `docs/protocol.md` §8.
        rule: String,
    },
    /// Something else worth a line.
    Note,
}

impl What {
    /// Its `kind` in JSON.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Fault { .. } => "fault",
            Self::Ended { .. } => "ended",
            Self::Booted { .. } => "booted",
            Self::Ready { .. } => "ready",
            Self::Membership { .. } => "membership",
            Self::Round { .. } => "round",
            Self::Bids { .. } => "bids",
            Self::Claim { .. } => "claim",
            Self::Takeover { .. } => "takeover",
            Self::Covered { .. } => "covered",
            Self::AllCovered => "all_covered",
            Self::Components { .. } => "components",
            Self::Finished { .. } => "finished",
            Self::Revised { .. } => "revised",
            Self::Task { .. } => "task",
            Self::Detected { .. } => "detected",
            Self::Crowd { .. } => "crowd",
            Self::Traced { .. } => "traced",
            Self::Silenced => "silenced",
            Self::Alarm => "alarm",
            Self::Refused => "refused",
            Self::ZoneEntry { .. } => "zone_entry",
            Self::Lost => "lost",
            Self::TookOff => "took_off",
            Self::Failsafe { .. } => "failsafe",
            Self::Violation { .. } => "violation",
            Self::Note => "note",
        }
    }
}

/// What a peer believes of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Belief {
    /// Heard from recently enough.
    Alive,
    /// Silent for too long.
    Suspect,
    /// Dead or out of reach; its work may be taken over.
    Down,
}

/// A bid for a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct TaskBid {
    /// Whose.
    pub by: u16,
    /// What the task adds to the value of what that UAV does, in millionths of the task's worth.
    pub bid_ppm: u32,
}

/// A bid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Bid {
    /// Whose.
    pub by: u16,
    /// The cell of the loop before which it will be.
    pub anchor: u16,
    /// When, milliseconds of scenario time after the bid.
    pub release_ms: u32,
    /// What it may fly after that, milliseconds of scenario time.
    pub endurance_ms: u32,
    /// Expected end of the plan that it had, milliseconds of scenario time after the bid.
    pub eta_ms: u32,
}

impl From<&skein_peer::why::BidHeard> for Bid {
    fn from(bid: &skein_peer::why::BidHeard) -> Self {
        Self {
            by: bid.by,
            anchor: bid.anchor,
            release_ms: bid.release_ms,
            endurance_ms: bid.endurance_ms,
            eta_ms: bid.eta_ms,
        }
    }
}

impl From<&skein_peer::TaskHolder> for TaskBid {
    fn from(holder: &skein_peer::TaskHolder) -> Self {
        Self {
            by: holder.uav,
            bid_ppm: holder.bid,
        }
    }
}
