//! What peers say: one type per kind, integers only.
//!
//! Every type is encoded as a CBOR array (short on the air); the JSON Schemas and
//! the table of kinds name the places of the arrays.

use crate::Incarnation;
use serde::{Deserialize, Serialize};
pub use skein_behaviors::{Order, Orders};
pub use skein_flight::coverage::ring::backtracking::OffLoop;

/// The envelope around every body. Relays pass it on unchanged.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Record {
    /// Who wrote it.
    pub author: u16,
    /// In which life.
    pub incarnation: Incarnation,
    /// Counts all that the author wrote in this life, over all kinds.
    pub seq: u32,
    /// Number of the kind, see [`super::kinds::Kind`].
    pub kind: u8,
    /// Which of the author's registers of that kind.
    pub subject: u16,
    /// The encoded body.
    #[serde(with = "serde_bytes")]
    pub body: Vec<u8>,
    /// Signature over all of the above as encoded; empty where signing is off.
    #[serde(with = "serde_bytes")]
    pub signature: Vec<u8>,
}

impl Record {
    /// Who wrote it, in which life.
    #[must_use]
    pub fn said_by(&self) -> Member {
        Member {
            id: self.author,
            incarnation: self.incarnation,
        }
    }
}

/// "I am here": one hop, between two beacons. Its number in the envelope counts on from
/// that of the last beacon.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Heartbeat {
    /// Until its next beacon, from the last one, quarters of T.
    pub interval: u8,
    /// How many it counts in its earshot, itself included.
    pub sharers: u16,
    /// East, dm.
    pub east_dm: i32,
    /// North, dm.
    pub north_dm: i32,
    /// Heartbeats of those whom a neighbour hears by more hops, ascending.
    pub fresh: Vec<Fresh>,
}

/// "I am here", and what its author knows: one hop.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Beacon {
    /// Counts the beacons of this life.
    pub heartbeat: u32,
    /// East, mm.
    pub east_mm: i32,
    /// North, mm.
    pub north_mm: i32,
    /// Heading, 1e-4 rad.
    pub heading_e4: i32,
    /// Whether it can take part in planning.
    pub able: bool,
    /// Whether it is a ground station.
    pub ground_station: bool,
    /// Whether it believes that the mission is finished.
    pub finished: bool,
    /// Boot nonce: tells two peers under one id apart.
    pub nonce: u32,
    /// The highest round counter it knows.
    pub counter: u32,
    /// Fewest hops to its farthest live author.
    pub eccentricity: u8,
    /// Until its next beacon, quarters of T.
    pub interval: u8,
    /// How many it counts in its earshot, itself included.
    pub sharers: u16,
    /// Mission revision it follows.
    pub revision: u32,
    /// The loop it derived; 0 when none.
    pub loop_hash: u64,
    /// Digest of its union of covered cells.
    pub cover_digest: u32,
    /// What it knows of others.
    pub gossip: Vec<Gossip>,
    /// The heartbeats of more of them, for those who hear them by more hops; ascending.
    pub fresh: Vec<Fresh>,
}

/// What one peer knows of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Gossip {
    /// Whom it concerns.
    pub id: u16,
    /// The latest life known.
    pub incarnation: Incarnation,
    /// The freshest heartbeat known.
    pub heartbeat: u32,
    /// Age of that heartbeat, sum of holding times, 100 ms units.
    pub age_ds: u16,
    /// The fewest hops by which its author was heard of lately.
    pub hops: u8,
    /// The interval its author announced with it, quarters of T.
    pub interval: u8,
    /// Age of a suspicion against that heartbeat, 100 ms units, if there is one.
    pub suspected_ds: Option<u16>,
    /// Whether it said it can plan.
    pub able: bool,
    /// The highest `seq` held of that author and life.
    pub max_seq: u32,
    /// Digest of the versions held of that author: of which kinds they differ, and a hash.
    pub digest: u16,
}

/// A heartbeat that one peer knows of another, of whom nothing else is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fresh {
    /// Whose it is.
    pub id: u16,
    /// The last three bits of the life it counts.
    pub life: u8,
    /// Its count.
    pub heartbeat: u32,
    /// Its age, sum of holding times, 100 ms units.
    pub age_ds: u16,
    /// The fewest hops by which its author was heard of lately.
    pub hops: u8,
    /// The interval its author announced with it, quarters of T.
    pub interval: u8,
    /// Whether its author said it can plan.
    pub able: bool,
    /// Age of a suspicion against it, 100 ms units, if there is one.
    pub suspected_ds: Option<u16>,
}

impl Fresh {
    /// The bits of a life that are told.
    pub const LIFE_BITS: u8 = 7;

    /// What is told of a life: consecutive ones differ.
    #[must_use]
    pub fn life_of(incarnation: Incarnation) -> u8 {
        u8::try_from(incarnation & Incarnation::from(Self::LIFE_BITS)).unwrap_or(0)
    }
}

/// What a peer does at present, for people.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Activity {
    /// Waits for a mission or for its own probation to end.
    Waiting,
    /// Flies its section.
    Covering,
    /// Loiters where it is: it was told to hold, or has nothing to fly.
    Holding,
    /// Flies to the base, or loiters above it.
    Returning,
    /// Stands on the ground: a ground station.
    GroundStation,
}

/// How the mission stands, as far as one peer knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum MissionStatus {
    /// Under way.
    Active,
    /// All that can be covered is covered.
    Accomplished,
    /// Cells remain that nobody has the endurance for, and this peer has nothing to fly;
    /// others may.
    Failed,
}

/// Pose, fuel, activity and mission status, for people.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct State {
    /// East, mm.
    pub east_mm: i32,
    /// North, mm.
    pub north_mm: i32,
    /// Height above the origin, mm.
    pub height_mm: i32,
    /// Heading, 1e-4 rad.
    pub heading_e4: i32,
    /// Airspeed, mm/s.
    pub airspeed_mmps: u32,
    /// Flight time left, seconds.
    pub endurance_s: u32,
    /// What it does.
    pub activity: Activity,
    /// How the mission stands.
    pub mission: MissionStatus,
    /// Cells of the loop it knows to be covered.
    pub covered: u16,
    /// Cells of the loop.
    pub cells: u16,
}

/// The negotiation to which a listing of cells goes back. Totally ordered.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct Epoch {
    /// Counter of the round.
    pub counter: u32,
    /// Hash of the round's sorted bids.
    pub hash: u32,
}

/// Orders listings of the same cell: the higher one keeps it.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct Stamp {
    /// The round it goes back to.
    pub epoch: Epoch,
    /// How often the cell was taken without a round since; of a first section, and of orphans
    /// among many, by up to 60 more, the nearer the first cell is.
    pub take: u16,
    /// Who lists it.
    pub id: u16,
}

/// Cells `first .. first + count` of the loop (cyclic).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct CellRun {
    /// The first cell, in forward order.
    pub first: u16,
    /// How many.
    pub count: u16,
}

/// A run of cells in a register, flown in one direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ListedRun {
    /// Which cells.
    pub run: CellRun,
    /// Whether they are flown against the order of the loop.
    pub backward: bool,
    /// By what right.
    pub stamp: Stamp,
}

/// A peer's own section: what it will fly, and what it gave away but still answers for.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Claim {
    /// Mission revision.
    pub revision: u32,
    /// The loop the cells are counted on.
    pub loop_hash: u64,
    /// The latest division adopted.
    pub epoch: Epoch,
    /// What it will fly, in order.
    pub plan: Vec<ListedRun>,
    /// What it gave away and nobody has taken over yet.
    pub held: Vec<ListedRun>,
    /// Expected end of the plan, milliseconds from this record's writing.
    pub eta_ms: u32,
    /// Whether its author hears nobody: it believes all others down.
    pub alone: bool,
}

/// A member of a round.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Member {
    /// Who.
    pub id: u16,
    /// In which life.
    pub incarnation: Incarnation,
}

/// A round of negotiation: which members, on which loop.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Round {
    /// One more than any counter seen by the starter.
    pub counter: u32,
    /// Ascending.
    pub members: Vec<Member>,
    /// Mission revision.
    pub revision: u32,
    /// The loop.
    pub loop_hash: u64,
    /// Whether the starter saw cells that nobody lists: a repair needs no gain to be adopted,
    /// any other round rebalances, and does.
    pub repair: bool,
    /// How long to wait for all bids, milliseconds.
    pub wait_ms: u32,
}

/// A peer's bid in one round. Immutable once spoken.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Bid {
    /// The round it belongs to.
    pub round: Round,
    /// Boundary of the loop where it will be.
    pub anchor: u16,
    /// Whether it looks against the order of the loop there.
    pub backward: bool,
    /// When, milliseconds from now.
    pub release_ms: u32,
    /// Ground speed, mm/s.
    pub speed_mmps: u32,
    /// Time to turn round, milliseconds.
    pub turn_ms: u32,
    /// Flight time it may still spend after its release, milliseconds.
    pub endurance_ms: u32,
    /// Covered cells it knows of, run-length encoded, at most 256 bytes.
    #[serde(with = "serde_bytes")]
    pub covered: Vec<u8>,
    /// Cells it will finish whatever is decided.
    pub commits: Vec<CellRun>,
    /// Where it is, if it can leave for anywhere, at once or when it takes off; at most one
    /// place.
    pub off_loop: Vec<OffLoop>,
    /// Expected end of its present plan, milliseconds from now.
    pub eta_ms: u32,
    /// Whether it adopted its last division so long ago that it may be given another one
    /// without need.
    pub calm: bool,
    /// Whether it covered a cell since.
    pub progressed: bool,
}

/// The union of covered cells one peer knows of, from all authors and lives.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cover {
    /// Mission revision.
    pub revision: u32,
    /// The loop the cells are counted on.
    pub loop_hash: u64,
    /// Run-length encoded.
    #[serde(with = "serde_bytes")]
    pub covered: Vec<u8>,
}

/// A piece of a mission's body.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MissionChunk {
    /// Mission revision.
    pub revision: u32,
    /// Hash of the content.
    pub content_hash: u64,
    /// How many pieces there are; the piece's number is the record's subject.
    pub chunks: u16,
    /// The piece, at most 1,024 bytes of the encoded mission.
    #[serde(with = "serde_bytes")]
    pub bytes: Vec<u8>,
}

/// Which pieces of a newer mission than the one it follows its author lacks: one hop, with
/// each beacon of that time. None where it has them all and cannot follow it yet.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lacking {
    /// Revision of that mission.
    pub revision: u32,
    /// Hash of its content; 0 where no piece of it came yet, and all of them are lacking.
    pub content_hash: u64,
    /// How many neighbours follow that revision or a newer one, as far as their beacons tell:
    /// its author lends them a part of its share of the air.
    pub holders: u16,
    /// A bit for each piece that it lacks, the lowest of the first byte for the first piece;
    /// without bytes of zero at the end.
    #[serde(with = "serde_bytes")]
    pub pieces: Vec<u8>,
}

impl Lacking {
    /// Whether a piece is lacking.
    #[must_use]
    pub fn lacks(&self, piece: u16) -> bool {
        let byte = self.pieces.get(usize::from(piece / 8));
        byte.is_some_and(|byte| byte >> (piece % 8) & 1 == 1)
    }

    /// The bits of the pieces that are lacking of so many.
    #[must_use]
    pub fn bits(pieces: u16, is_lacking: impl Fn(u16) -> bool) -> Vec<u8> {
        let mut bits = vec![0; usize::from(pieces.div_ceil(8))];
        for piece in (0..pieces).filter(|piece| is_lacking(*piece)) {
            bits[usize::from(piece / 8)] |= 1 << (piece % 8);
        }
        while bits.last() == Some(&0) {
            bits.pop();
        }
        bits
    }
}

/// "All that can be covered is covered."
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Finished {
    /// Mission revision.
    pub revision: u32,
}
