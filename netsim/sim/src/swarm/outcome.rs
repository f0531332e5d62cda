//! What a run came to.

use super::{Swarm, sim_peer::SimPeer};
use crate::account::{Details, Ending, FalseDown, RunReport, Simulated, Violations};
use crate::check::{Reached, Violation};
use crate::history::Entry;
use std::collections::BTreeMap;

/// The result of one run: its report, and what only a batch or a timeline wants to know.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// The report, in the form that live trials have too.
    pub report: RunReport,
    /// How long graded things took under light loss, as shares of their bounds.
    pub ratios: BTreeMap<&'static str, Vec<f64>>,
    /// UAVs that were gone at the end.
    pub dead: u32,
    /// UAV milliseconds spent able and with nothing to fly while cells were open.
    pub idle_ms: u64,
    /// The largest loss that was set, thousandths.
    pub loss_permille: u16,
    /// Hard places reached.
    pub reached: Reached,
    /// The kinds of trouble that struck.
    pub struck: Vec<&'static str>,
    /// Cells that were seen and the ground station did not know of, once a beacon period;
    /// nothing while it does not run, or has another loop.
    pub ground_lacks: Vec<Option<u16>>,
    /// For how long somebody held each relay position, milliseconds, by number and revision.
    pub relays_held_ms: BTreeMap<(u16, u32), u64>,
    /// Hash of the history.
    pub history_hash: u64,
    /// The main events, where they were kept.
    pub entries: Vec<Entry>,
}

impl Outcome {
    /// The seed of the run.
    #[must_use]
    pub fn seed(&self) -> u64 {
        self.report.seed
    }

    /// The first violations of each rule.
    #[must_use]
    pub fn violations(&self) -> &[Violation] {
        self.report.violations.as_ref().map_or(&[], |v| &v.first)
    }

    /// Living peers in reach that were declared down.
    #[must_use]
    pub fn false_downs(&self) -> &[FalseDown] {
        let simulated = self.report.simulated.as_ref();
        simulated.map_or(&[], |s| &s.false_downs)
    }

    /// Whether cells were beyond anybody's endurance when it ended.
    #[must_use]
    pub fn infeasible(&self) -> bool {
        self.report.simulated.as_ref().is_some_and(|s| s.infeasible)
    }
}

impl Swarm {
    /// Sums the run up.
    pub(super) fn outcome(&mut self) -> Outcome {
        self.air.advance(self.now_ms);
        self.check_the_end();
        self.conclude_streets();
        self.conclude_crowd();
        let (rules, found) = (&mut self.checker.rules, &mut self.checker.found);
        rules.counts.on_end(self.now_ms, found);
        for p in &self.peers {
            if let Some(peer) = &p.peer {
                let kept = (&peer.durable(), p.disk.records(), p.untold_writes());
                self.checker.on_crash(self.now_ms, p.id(), kept);
            }
        }
        self.account.radio(&self.traffic.counters(self.air.tally()));
        let found = self.checker.found.take();
        let false_downs = std::mem::take(&mut self.checker.members.false_downs);
        let history_hash = self.history.hash();
        let report = self.account.conclude(Ending {
            now_ms: self.now_ms,
            judge: self.air.judge(),
            nearest_intruder_m: self.air.world().intruders().nearest_m(),
            nearest_obstacle_m: self.air.world().unmapped().nearest_m(),
            link_cuts: self.air.link_cuts(),
            violations: Some(Violations {
                counts: found
                    .counts
                    .iter()
                    .map(|(check, n)| ((*check).to_owned(), *n))
                    .collect(),
                first: found.violations,
            }),
            details: Details::Simulated(Simulated {
                history_hash: format!("{history_hash:016x}"),
                events: self.history.events(),
                infeasible: self.unassigned || self.judged.covered().capacity() == 0,
                false_downs: false_downs
                    .into_iter()
                    .map(|(at_ms, by, of)| FalseDown { at_ms, by, of })
                    .collect(),
                bytes_by_kind: self.traffic.bytes_by_kind(),
                wind_errors: self.checker.rules.wind.errors(),
                footprint_errors: self
                    .spec
                    .uavs
                    .iter()
                    .any(|u| !u.airframe.mount.is_level())
                    .then(|| self.checker.rules.footprint.errors()),
            }),
        });
        Outcome {
            report,
            ratios: found.ratios,
            dead: u32::try_from(self.peers.iter().filter(|p| self.is_gone(p)).count())
                .unwrap_or(u32::MAX),
            idle_ms: self.checker.rules.flight.idle_ms,
            loss_permille: self.loss_max_permille,
            reached: self.checker.reached,
            struck: Vec::new(),
            ground_lacks: std::mem::take(&mut self.ground_lacks),
            relays_held_ms: std::mem::take(&mut self.checker.rules.relays.held_ms),
            history_hash,
            entries: self.history.entries().to_vec(),
        }
    }

    /// L5 and that all know of the end.
    fn check_the_end(&mut self) {
        if self.account.covered_ms().is_none() {
            let text = format!(
                "{:.1} % covered after {} s",
                self.air.judge().covered_share() * 100.0,
                self.now_ms / 1000
            );
            self.checker.found.broken("L5", self.now_ms, None, || text);
        } else if !self.done {
            let unfinished: Vec<u16> = self.unfinished();
            self.checker.found.broken("finish", self.now_ms, None, || {
                format!(
                    "all is covered, but peers {unfinished:?} do not believe the mission finished"
                )
            });
        }
    }

    fn unfinished(&self) -> Vec<u16> {
        let running = self.peers.iter().filter(|p| p.config.airframe.is_some());
        running
            .filter(|p| {
                let believes = p.peer.as_ref().map(|p| p.beliefs());
                believes.is_some_and(|b| !b.finished && !b.relays)
            })
            .map(SimPeer::id)
            .collect()
    }

    /// Of two programs in one airframe only the first one stands for it.
    fn is_gone(&self, p: &SimPeer) -> bool {
        let own = self.airframe_of(p.id()) == p.id();
        own && p.config.airframe.is_some() && p.peer.is_none() && p.boots > 0
    }
}
