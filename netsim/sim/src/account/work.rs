//! Whose cells were open when a peer died, who took them over and who flew them.
//!
//! All of it follows from the peers' own reports: a claim lists what its author will fly
//! and what it still holds for others; coverage is what a peer's own camera has seen. A
//! cell of a dead peer is taken over when a peer that did not list it before lists it as
//! its own, or when somebody sees it anyway. Cells are indices on the newest loop that any
//! peer has derived; what peers on an older loop report is not comparable and left out.

use super::detection::Detection;
use super::lifetimes::Cause;
use super::report::{KillReport, Taker};
use super::secs;
use skein_flight::coverage::ring::backtracking::Leg;
use std::collections::{BTreeMap, BTreeSet};

/// What a peer held when it died.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Held {
    /// Cells that it listed and nobody had seen.
    pub cells: usize,
    /// Whether some of them it had itself taken over from a peer that died.
    pub second_hand: bool,
}

/// A death, and what became of the work.
#[derive(Clone, Debug)]
struct Death {
    peer: u16,
    at_ms: u64,
    cause: Cause,
    held: usize,
    /// Share of an even share of the whole loop.
    share: f64,
    listed_already: usize,
    /// Cells that nobody has listed or seen since.
    pending: BTreeSet<u16>,
    takers: BTreeMap<u16, Taking>,
    /// Cells that nobody has seen since.
    unseen: BTreeSet<u16>,
    seen_by: BTreeMap<u16, usize>,
    seen_unlisted: usize,
    taken_back: usize,
    superseded: usize,
    over_ms: Option<u64>,
}

#[derive(Clone, Copy, Debug)]
struct Taking {
    cells: usize,
    first_ms: u64,
}

impl Death {
    /// What a newer mission replaced nobody took over.
    fn close(&mut self, now_ms: u64) {
        if self.pending.is_empty() && self.superseded == 0 {
            self.over_ms.get_or_insert(now_ms);
        }
    }
}

/// The work of one run.
#[derive(Clone, Debug, Default)]
pub struct Work {
    n_uavs: usize,
    /// Cells of the newest loop.
    n_cells: u16,
    /// Which loop that is, and since which revision of the mission.
    newest: Option<(u32, u64)>,
    /// On which loop each peer works.
    loop_of: BTreeMap<u16, u64>,
    covered: BTreeSet<u16>,
    listed: BTreeMap<u16, BTreeSet<u16>>,
    /// Cells taken over from a dead peer, and who took them.
    inherited: BTreeMap<u16, u16>,
    deaths: Vec<Death>,
}

impl Work {
    /// Nothing is listed or seen yet.
    #[must_use]
    pub fn new(n_uavs: usize) -> Self {
        Self {
            n_uavs,
            ..Self::default()
        }
    }

    /// A peer has derived the loop of a mission. A new loop, that of another lap among
    /// them, begins with everything open.
    pub fn ready(&mut self, peer: u16, revision: u32, loop_hash: u64, cells: u16) {
        if self.loop_of.insert(peer, loop_hash) != Some(loop_hash) {
            self.listed.remove(&peer);
        }
        let newer = self.newest.is_none_or(|(r, _)| r < revision);
        if !newer {
            return;
        }
        let before = self.newest.replace((revision, loop_hash));
        self.n_cells = cells;
        if before.is_some_and(|(_, hash)| hash != loop_hash) {
            self.covered.clear();
            self.listed.clear();
            self.inherited.clear();
            for d in &mut self.deaths {
                d.superseded += d.pending.len();
                d.pending.clear();
                d.unseen.clear();
            }
        }
    }

    fn on_newest(&self, peer: u16) -> bool {
        self.loop_of.get(&peer).copied() == self.newest.map(|(_, hash)| hash)
    }

    /// The cells of some legs.
    #[must_use]
    pub fn cells_of(&self, legs: &[Leg]) -> BTreeSet<u16> {
        let n = usize::from(self.n_cells).max(1);
        legs.iter().flat_map(|leg| leg.cells(n)).collect()
    }

    /// A peer lists what it will fly, and what it holds until others have taken it; gives
    /// a line worth showing when it takes over cells of the dead.
    pub fn listed(
        &mut self,
        now_ms: u64,
        by: u16,
        flown: &BTreeSet<u16>,
        held: &[u16],
    ) -> Option<String> {
        if !self.on_newest(by) {
            return None;
        }
        self.inherited
            .retain(|cell, taker| *taker == by || !flown.contains(cell));
        let mut line = None;
        for d in &mut self.deaths {
            let taken: Vec<u16> = d.pending.intersection(flown).copied().collect();
            if taken.is_empty() {
                continue;
            }
            d.pending.retain(|c| !flown.contains(c));
            if d.peer == by {
                d.taken_back += taken.len();
                d.close(now_ms);
                continue;
            }
            let taking = d.takers.entry(by).or_insert(Taking {
                cells: 0,
                first_ms: now_ms,
            });
            taking.cells += taken.len();
            d.close(now_ms);
            line = Some(format!(
                "uav{by} takes over {} cells of uav{}, {:.1} s after its end",
                taken.len(),
                d.peer,
                secs(now_ms.saturating_sub(d.at_ms))
            ));
            self.inherited.extend(taken.into_iter().map(|c| (c, by)));
        }
        let mut all = flown.clone();
        all.extend(held);
        self.listed.insert(by, all);
        line
    }

    /// A peer's own camera saw cells.
    pub fn saw(&mut self, now_ms: u64, by: u16, cells: &[u16]) {
        if !self.on_newest(by) {
            return;
        }
        for d in &mut self.deaths {
            let before = d.pending.len();
            d.pending.retain(|c| !cells.contains(c));
            d.seen_unlisted += before - d.pending.len();
            let seen = cells.iter().filter(|c| d.unseen.remove(c)).count();
            if seen > 0 {
                *d.seen_by.entry(by).or_default() += seen;
            }
            d.close(now_ms);
        }
        self.covered.extend(cells);
    }

    /// A peer's process ends; gives what it held.
    pub fn ended(&mut self, now_ms: u64, peer: u16, cause: Cause) -> Held {
        let mut unseen = self.listed.remove(&peer).unwrap_or_default();
        unseen.retain(|c| !self.covered.contains(c));
        // What somebody else lists already needs no taking over.
        let is_listed = |c: &u16| self.listed.values().any(|cells| cells.contains(c));
        let pending: BTreeSet<u16> = unseen.iter().filter(|c| !is_listed(c)).copied().collect();
        let held = Held {
            cells: unseen.len(),
            second_hand: unseen.iter().any(|c| self.inherited.get(c) == Some(&peer)),
        };
        #[allow(clippy::cast_precision_loss, reason = "counts of cells and of UAVs")]
        let share = {
            let even = f64::from(self.n_cells).max(1.0) / self.n_uavs.max(1) as f64;
            held.cells as f64 / even
        };
        let mut death = Death {
            peer,
            at_ms: now_ms,
            cause,
            held: held.cells,
            share,
            listed_already: held.cells - pending.len(),
            pending,
            takers: BTreeMap::new(),
            unseen,
            seen_by: BTreeMap::new(),
            seen_unlisted: 0,
            taken_back: 0,
            superseded: 0,
            over_ms: None,
        };
        death.close(now_ms);
        self.deaths.push(death);
        held
    }

    /// A peer starts again: it lists nothing until it says so.
    pub fn restarted(&mut self, peer: u16) {
        self.listed.remove(&peer);
        self.loop_of.remove(&peer);
    }

    /// Cells of dead peers taken over so far.
    #[must_use]
    pub fn taken_over(&self) -> usize {
        self.deaths
            .iter()
            .flat_map(|d| d.takers.values())
            .map(|t| t.cells)
            .sum()
    }

    /// For the report.
    #[must_use]
    pub fn kills(&self, detection: &Detection) -> Vec<KillReport> {
        let report = |d: &Death| {
            let after = |t: u64| t.saturating_sub(d.at_ms);
            let detections_ms = detection.delays_ms(d.peer, d.at_ms);
            let first = detections_ms.iter().min_by_key(|(_, ms)| **ms);
            KillReport {
                peer: d.peer,
                at_ms: d.at_ms,
                cause: d.cause,
                cells_held: d.held,
                share_held: (d.share * 1000.0).round() / 1000.0,
                detected_by: first.map(|(by, _)| *by),
                detection_ms: first.map(|(_, ms)| *ms),
                listed_already: d.listed_already,
                taken_over_by: d
                    .takers
                    .iter()
                    .map(|(peer, t)| Taker {
                        peer: *peer,
                        cells: t.cells,
                        first_ms: after(t.first_ms),
                    })
                    .collect(),
                taken_back: d.taken_back,
                seen_in_passing: d.seen_unlisted,
                takeover_ms: d.over_ms.map(after),
                superseded: d.superseded,
                left: d.pending.len(),
                flown_by: d.seen_by.clone(),
                detections_ms,
            }
        };
        self.deaths.iter().map(report).collect()
    }
}
