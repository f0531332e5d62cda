//! What a check may look at: what each running peer believes at one moment, beside what
//! is true.

use super::{Bounds, Grade, Graph, Handicaps, Stability};
use skein_geometry::frame::Point;
use skein_peer::Beliefs;
use skein_peer::cells::CellSet;
use skein_peer::output::Status;

/// One running peer at the moment of a snapshot.
#[derive(Clone, Debug)]
pub struct PeerSnapshot {
    /// Which peer: the number of its radio.
    pub id: u16,
    /// Its id; that of another one where it is a twin.
    pub speaks_as: u16,
    /// Whether it flies.
    pub uav: bool,
    /// When its process last started or was resumed, milliseconds.
    pub since_ms: u64,
    /// Where its airframe is, if it flies.
    pub at: Option<Point>,
    /// How long its fuel lasts, if it flies, milliseconds.
    pub fuel_ms: Option<u64>,
    /// When it expects its plan to be flown, milliseconds from now.
    pub eta_ms: u32,
    /// What it believes.
    pub view: Beliefs,
}

/// Everything a check may look at: what each peer believes, beside what is true.
#[derive(Debug)]
pub struct Snapshot<'a> {
    /// Scenario time, milliseconds.
    pub now_ms: u64,
    /// Loss on every link now, thousandths.
    pub loss_permille: u16,
    /// The bounds at the diameters of now.
    pub bounds: Bounds,
    /// The true radio graph of the running peers.
    pub graph: &'a Graph,
    /// Since when it has been so.
    pub stability: &'a Stability,
    /// Whose clock, computer or disk is how late.
    pub handicaps: &'a Handicaps,
    /// The running peers, ascending by id.
    pub peers: &'a [PeerSnapshot],
    /// Which cells of the loop the world saw; of no cells before any peer has a loop.
    pub covered: &'a CellSet,
    /// Identifies that loop.
    pub loop_hash: u64,
}

impl Snapshot<'_> {
    /// How the present loss grades a bound.
    #[must_use]
    pub fn grade(&self) -> Grade {
        Grade::of(self.loss_permille)
    }

    /// Whether what somebody says may be lost though nothing is: over several hops it collides with
    /// what others say whom it cannot hear.
    #[must_use]
    pub fn collides(&self) -> bool {
        self.grade() == Grade::Hard && self.bounds.diameter > 1
    }

    /// How long something may take by now that all do together, that began at `from_ms`
    /// and takes `bound_ms` among healthy peers.
    #[must_use]
    pub fn grown_ms(&self, bound_ms: u64, from_ms: u64) -> u64 {
        self.handicaps.grown_ms(bound_ms, from_ms, self.now_ms)
    }

    /// How long an orphan may remain one that counts from then: beside the bound each
    /// disk makes a bid and a section late, and a member whose disk takes no writes spoils
    /// a round and the next, which waits twice as long, before it is left out.
    #[must_use]
    pub fn takeover_ms(&self, from_ms: u64) -> u64 {
        let h = self.handicaps;
        let write_ms = |m: &PeerSnapshot| h.write_ms(m.id, from_ms, self.now_ms);
        let writes: Vec<Option<u64>> = self.peers.iter().map(write_ms).collect();
        let late_ms: u64 = writes.iter().flatten().map(|w| 2 * w).sum();
        let spoiled = writes.iter().any(Option::is_none);
        let spoiled_ms = if spoiled {
            3 * self.bounds.first_wait_ms()
        } else {
            0
        };
        self.grown_ms(self.bounds.takeover_ms(), from_ms) + late_ms + spoiled_ms
    }

    /// How long ago a time is by the clock of a peer, jumps left out.
    #[must_use]
    pub fn lived_ms(&self, id: u16, from_ms: u64) -> u64 {
        self.handicaps.lived_ms(id, from_ms, self.now_ms)
    }

    /// How much later a peer may be with what it was to do since then.
    #[must_use]
    pub fn late_ms(&self, id: u16, from_ms: u64) -> u64 {
        self.handicaps.late_ms(id, from_ms, self.now_ms)
    }

    /// A running peer by its number.
    #[must_use]
    pub fn peer(&self, id: u16) -> Option<&PeerSnapshot> {
        self.peers
            .binary_search_by_key(&id, |m| m.id)
            .ok()
            .map(|i| &self.peers[i])
    }

    /// Those of these peers that are UAVs and speak.
    #[must_use]
    pub fn speaking_uavs(&self, members: &[u16]) -> Vec<&PeerSnapshot> {
        let peers = members.iter().filter_map(|id| self.peer(*id));
        peers.filter(|m| m.uav && m.view.speaks).collect()
    }

    /// The UAVs that hold the loop and can take part in planning.
    pub fn able(&self) -> impl Iterator<Item = &PeerSnapshot> {
        self.peers
            .iter()
            .filter(|m| m.uav && m.view.able && m.view.loop_hash == self.loop_hash)
    }
}

/// Whether a peer believes all others down.
pub(super) fn is_alone(view: &Beliefs) -> bool {
    view.peers.values().all(|(_, s)| *s == Status::Down)
}
