//! What a check may look at: what each running peer believes at one moment, beside what
//! is true.

use super::{Bounds, Grade, Graph, Stability};
use skein_geometry::frame::Point;
use skein_peer::Beliefs;

/// One running peer at the moment of a snapshot.
#[derive(Clone, Debug)]
pub struct PeerSnapshot {
    /// Which peer.
    pub id: u16,
    /// Whether it flies.
    pub uav: bool,
    /// When its process last started or was resumed, milliseconds.
    pub since_ms: u64,
    /// Where its airframe is, if it flies.
    pub at: Option<Point>,
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
    /// The running peers, ascending by id.
    pub peers: &'a [PeerSnapshot],
    /// What the world saw, by index on the loop; empty before any peer has a loop.
    pub covered: &'a [bool],
    /// Identifies that loop.
    pub loop_hash: u64,
}

impl Snapshot<'_> {
    /// How the present loss grades a bound.
    #[must_use]
    pub fn grade(&self) -> Grade {
        Grade::of(self.loss_permille)
    }

    /// A running peer by its number.
    #[must_use]
    pub fn peer(&self, id: u16) -> Option<&PeerSnapshot> {
        self.peers
            .binary_search_by_key(&id, |m| m.id)
            .ok()
            .map(|i| &self.peers[i])
    }

    /// The UAVs that hold the loop and can take part in planning.
    pub fn able(&self) -> impl Iterator<Item = &PeerSnapshot> {
        self.peers
            .iter()
            .filter(|m| m.uav && m.view.able && m.view.loop_hash == self.loop_hash)
    }
}
