//! What must hold of a swarm, judged from outside while it runs: the rules of
//! docs/protocol.md §8, which says of each what it means, its bound, and what its
//! check does not see.
//!
//! | module | rules |
//! |---|---|
//! | [`checker`] | all of them behind one door |
//! | [`graph`] | the true components, from which liveness is counted |
//! | [`bounds`] | how long things may take, and how loss grades that |
//! | [`membership`] | detection of deaths, false downs, L1 |
//! | [`listing`] | I1, L2, S5: who lists which cell, takeovers |
//! | [`record`] | S3, S4, S7, S11: versions, speakers, promises |
//! | [`cover`] | S3 (covered), S6, L4: what is marked covered |
//! | [`progress`] | S2, S9, S10, L6, L7: limits and restarts |
//!
//! S1 is recorded by the world, S12 caught by the driver, L5 decided at the end of a
//! run, S8 tested in the peer's crate. Checks run incrementally on reports and
//! transmissions, and once a beacon period on a copy of each peer's beliefs.

pub mod bounds;
pub mod checker;
pub mod cover;
pub mod graph;
pub mod listing;
pub mod membership;
pub mod progress;
pub mod record;

pub use bounds::{Bounds, Grade};
pub use checker::{Checker, Reached};
pub use graph::{Graph, Stability};

use serde::Serialize;
use skein_peer::Beliefs;
use std::collections::BTreeMap;

/// A rule that was broken.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Violation {
    /// Which rule: its name in the protocol, `S3` to `L7`, or `detect`.
    pub check: &'static str,
    /// Seed of the run.
    pub seed: u64,
    /// When, milliseconds of scenario time.
    pub time_ms: u64,
    /// By or at which peer, where it is one peer's.
    pub peer: Option<u16>,
    /// How.
    pub text: String,
}

/// The most violations of one rule that a run keeps: the first ones tell the story,
/// the others only count.
const KEPT_PER_CHECK: usize = 5;

/// Where the checks put what they find.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    seed: u64,
    /// The first violations of each rule.
    pub violations: Vec<Violation>,
    /// Violations by rule, all of them.
    pub counts: BTreeMap<&'static str, u64>,
    /// How long graded things took, as a share of their bound, by rule; only where
    /// some loss made the bound a percentile.
    pub ratios: BTreeMap<&'static str, Vec<f64>>,
    fresh: usize,
}

impl Findings {
    /// Nothing found yet.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self {
            seed,
            ..Self::default()
        }
    }

    /// A rule was broken.
    pub fn broken(
        &mut self,
        check: &'static str,
        time_ms: u64,
        peer: Option<u16>,
        text: impl FnOnce() -> String,
    ) {
        let n = self.counts.entry(check).or_default();
        *n += 1;
        if *n <= KEPT_PER_CHECK as u64 {
            self.violations.push(Violation {
                check,
                seed: self.seed,
                time_ms,
                peer,
                text: text(),
            });
        }
    }

    /// A graded thing ended after `took_ms` under `bound_ms`.
    pub fn took(&mut self, check: &'static str, grade: Grade, took_ms: u64, bound_ms: u64) {
        if grade == Grade::Light {
            #[allow(clippy::cast_precision_loss, reason = "runs last less than 2^52 ms")]
            let share = took_ms as f64 / bound_ms.max(1) as f64;
            self.ratios.entry(check).or_default().push(share);
        }
    }

    /// Violations found since the last call.
    pub fn drain_fresh(&mut self) -> Vec<Violation> {
        let out = self.violations[self.fresh..].to_vec();
        self.fresh = self.violations.len();
        out
    }
}

/// One running peer at the moment of a snapshot.
#[derive(Clone, Debug)]
pub struct PeerSnapshot {
    /// Which peer.
    pub id: u16,
    /// Whether it flies.
    pub uav: bool,
    /// When its process last started or was resumed, milliseconds.
    pub since_ms: u64,
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

/// Things that go on for longer than they may are told once: remembers since when.
#[derive(Clone, Debug, Default)]
pub struct Clocks<K: Ord + Copy> {
    running: BTreeMap<K, (u64, bool)>,
}

impl<K: Ord + Copy> Clocks<K> {
    /// The thing goes on; returns since when.
    pub fn start(&mut self, key: K, now_ms: u64) -> u64 {
        self.running.entry(key).or_insert((now_ms, false)).0
    }

    /// The thing ended; returns since when it had been going on.
    pub fn stop(&mut self, key: K) -> Option<u64> {
        self.running.remove(&key).map(|(since, _)| since)
    }

    /// True the first time it is called for a thing that goes on.
    pub fn tell_once(&mut self, key: K) -> bool {
        match self.running.get_mut(&key) {
            Some((_, told)) => !std::mem::replace(told, true),
            None => false,
        }
    }

    /// Ends everything that `keep` refuses.
    pub fn retain(&mut self, mut keep: impl FnMut(&K) -> bool) {
        self.running.retain(|k, _| keep(k));
    }
}
