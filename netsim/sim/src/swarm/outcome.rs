//! What a run came to.

use super::{Swarm, sim_peer::SimPeer};
use crate::check::listing::Takeover;
use crate::check::{Reached, Violation};
use crate::fault::TimedFault;
use crate::history::Entry;
use crate::prepared::Prepared;
use skein_link::Reason;
use std::collections::BTreeMap;

/// The result of one run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Its seed.
    pub seed: u64,
    /// Whether everything coverable was covered and every live UAV finished in time.
    pub completed: bool,
    /// Whether cells were alarmed as beyond anybody's endurance when it ended.
    pub infeasible: bool,
    /// Share of the coverable cells that the world saw covered.
    pub coverage: f64,
    /// When the last of them was, milliseconds.
    pub makespan_ms: Option<u64>,
    /// Makespan relative to the reference, where one was computed.
    pub makespan_ratio: Option<f64>,
    /// When it ended, milliseconds.
    pub end_ms: u64,
    /// The first violations of each rule.
    pub violations: Vec<Violation>,
    /// All violations, by rule.
    pub violation_counts: BTreeMap<&'static str, u64>,
    /// How long graded things took under light loss, as shares of their bounds.
    pub ratios: BTreeMap<&'static str, Vec<f64>>,
    /// From each death to its detection by each live peer, milliseconds.
    pub detect_ms: Vec<u64>,
    /// What became of the sections of the dead.
    pub takeovers: Vec<Takeover>,
    /// Living peers in reach that were declared Down: when, milliseconds, by whom, whom.
    pub false_downs: Vec<(u64, u16, u16)>,
    /// Milliseconds all processes ran, together.
    pub peer_ms: u64,
    /// Bytes all peers transmitted.
    pub bytes: u64,
    /// Processes that ended, restarted or not.
    pub kills: u32,
    /// UAVs that were gone at the end.
    pub dead: u32,
    /// The largest loss that was set, thousandths.
    pub loss_permille: u16,
    /// Hard places reached.
    pub reached: Reached,
    /// Smallest distance between two airborne UAVs, metres (recorded, S1).
    pub separation_m: Option<f64>,
    /// Transmissions that did not arrive, by reason.
    pub lost: BTreeMap<Reason, u64>,
    /// Longest time in which a cell was not seen again, milliseconds, where everything is
    /// to be seen several times.
    pub revisit_ms: Option<u64>,
    /// Hash of the history.
    pub history_hash: u64,
    /// Events in it.
    pub events: u64,
    /// The main events, where they were kept.
    pub entries: Vec<Entry>,
}

impl Swarm {
    /// Ends the run and sums it up.
    pub(super) fn outcome(mut self) -> Outcome {
        self.air.advance(self.now_ms);
        let coverage = self.air.coverage();
        let completed = self.done && self.covered_ms.is_some();
        if self.covered_ms.is_none() {
            let text = format!(
                "{:.1} % covered after {} s",
                coverage * 100.0,
                self.now_ms / 1000
            );
            self.checker.found.broken("L5", self.now_ms, None, || text);
        } else if !completed {
            let unfinished: Vec<u16> = self.unfinished();
            self.checker.found.broken("finish", self.now_ms, None, || {
                format!(
                    "all is covered, but peers {unfinished:?} do not hold the mission for finished"
                )
            });
        }
        for p in &self.peers {
            if let Some(peer) = &p.peer {
                self.checker
                    .on_crash(self.now_ms, p.id(), &peer.durable(), p.disk.records());
            }
        }
        let takeovers = self.checker.takeovers().to_vec();
        Outcome {
            seed: self.seed,
            completed,
            infeasible: self.unassigned || self.covered.is_empty(),
            coverage,
            makespan_ms: self.covered_ms,
            makespan_ratio: None,
            end_ms: self.now_ms,
            detect_ms: std::mem::take(&mut self.checker.members.detect_ms),
            takeovers,
            false_downs: std::mem::take(&mut self.checker.members.false_downs),
            peer_ms: self.peers.iter().map(|s| s.ran_ms(self.now_ms)).sum(),
            bytes: self.air.bytes(),
            kills: self.kills,
            dead: u32::try_from(self.peers.iter().filter(|s| is_gone(s)).count())
                .unwrap_or(u32::MAX),
            loss_permille: self.loss_max_permille,
            reached: self.checker.reached,
            separation_m: self.air.separation_m(),
            lost: self.air.lost(),
            revisit_ms: self.air.longest_gap_ms(),
            history_hash: self.history.hash(),
            events: self.history.events(),
            entries: self.history.entries().to_vec(),
            violations: self.checker.found.violations,
            violation_counts: self.checker.found.counts,
            ratios: self.checker.found.ratios,
        }
    }

    fn unfinished(&self) -> Vec<u16> {
        let running = self.peers.iter().filter(|s| s.config.airframe.is_some());
        running
            .filter(|s| s.peer.as_ref().is_some_and(|p| !p.beliefs().finished))
            .map(SimPeer::id)
            .collect()
    }
}

fn is_gone(p: &SimPeer) -> bool {
    p.config.airframe.is_some() && p.peer.is_none()
}

impl Outcome {
    /// Sets the makespan against that of the reference, where both have one.
    pub fn compare(&mut self, reference_ms: Option<u64>) {
        #[allow(clippy::cast_precision_loss, reason = "runs last less than 2^52 ms")]
        let ratio = |a: u64, b: u64| a as f64 / b.max(1) as f64;
        self.makespan_ratio = self.makespan_ms.zip(reference_ms).map(|(a, b)| ratio(a, b));
    }
}

/// Runs a swarm; a panic anywhere in it becomes a violation of S12 that names the seed.
#[must_use]
pub fn run_guarded(prepared: &Prepared, seed: u64, faults: Vec<TimedFault>, keep: bool) -> Outcome {
    let run = std::panic::AssertUnwindSafe(|| Swarm::new(prepared, seed, faults, keep).run());
    std::panic::catch_unwind(run).unwrap_or_else(|payload| {
        let text = payload
            .downcast_ref::<&str>()
            .map(ToString::to_string)
            .or_else(|| payload.downcast_ref::<String>().cloned())
            .unwrap_or_else(|| "a panic without words".to_owned());
        Outcome {
            seed,
            violations: vec![Violation {
                check: "S12",
                seed,
                time_ms: 0,
                peer: None,
                text,
            }],
            violation_counts: BTreeMap::from([("S12", 1)]),
            ..Outcome::default()
        }
    })
}
