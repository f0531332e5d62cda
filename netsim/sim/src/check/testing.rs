//! Snapshots for the tests of checks: so many peers that all hear each other.

use super::{Bounds, Graph, Handicaps, PeerSnapshot, Snapshot, Stability};
use crate::twins::Twins;
use skein_geometry::frame::Point;
use skein_peer::Beliefs;
use skein_peer::cells::CellSet;
use std::collections::BTreeMap;

/// Identifies the loop of these snapshots.
pub(super) const LOOP: u64 = 3;

/// Bounds at T = 1 s in one hop.
pub(super) const BOUNDS: Bounds = Bounds {
    period_ms: 1000,
    interval_ms: 1000,
    diameter: 1,
};

/// A peer that speaks, is able, and holds the loop, of which it knows nothing covered.
pub(super) fn speaking() -> Beliefs {
    Beliefs {
        incarnation: 1,
        speaks: true,
        able: true,
        loop_hash: LOOP,
        revision: 1,
        covered: CellSet::new(4),
        diameter: 1,
        spendable_ms: 1_000_000,
        ..Beliefs::default()
    }
}

/// Snapshots one after the other.
pub(super) struct Story {
    stability: Stability,
    loss_permille: u16,
    covered: CellSet,
    places: BTreeMap<u16, Point>,
    fuel_ms: BTreeMap<u16, u64>,
    /// When all expect their plans to be flown, milliseconds from now.
    pub(super) eta_ms: u32,
    /// Who speaks under the id of another.
    pub(super) twins: Twins,
    /// Whose clock, computer or disk is how late.
    pub(super) handicaps: Handicaps,
}

impl Story {
    /// Begins at a loss in thousandths, with nothing covered of four cells.
    pub(super) fn new(loss_permille: u16) -> Self {
        Self {
            stability: Stability::default(),
            loss_permille,
            covered: CellSet::new(4),
            places: BTreeMap::new(),
            fuel_ms: BTreeMap::new(),
            eta_ms: 0,
            twins: Twins::default(),
            handicaps: Handicaps::default(),
        }
    }

    /// Puts a UAV somewhere.
    pub(super) fn place(&mut self, id: u16, at: Point) {
        self.places.insert(id, at);
    }

    /// Fills the tank of a UAV.
    pub(super) fn fuel(&mut self, id: u16, lasts_ms: u64) {
        self.fuel_ms.insert(id, lasts_ms);
    }

    /// One snapshot of these peers, all UAVs, for a check.
    pub(super) fn snapshot(
        &mut self,
        now_ms: u64,
        views: &[(u16, Beliefs)],
        check: impl FnOnce(&Snapshot<'_>),
    ) {
        let peers: Vec<PeerSnapshot> = views
            .iter()
            .map(|(id, view)| PeerSnapshot {
                id: *id,
                speaks_as: self.twins.id_of(*id),
                uav: true,
                since_ms: 0,
                at: self.places.get(id).copied(),
                fuel_ms: self.fuel_ms.get(id).copied(),
                eta_ms: self.eta_ms,
                view: view.clone(),
            })
            .collect();
        let graph = Graph::new(peers.iter().map(|m| m.id).collect(), |_, _| true);
        self.stability.observe(now_ms, &graph, |_| 1, 10_000);
        check(&Snapshot {
            now_ms,
            loss_permille: self.loss_permille,
            bounds: BOUNDS,
            graph: &graph,
            stability: &self.stability,
            handicaps: &self.handicaps,
            peers: &peers,
            covered: &self.covered,
            loop_hash: LOOP,
        });
    }
}
