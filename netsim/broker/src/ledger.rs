//! What a trial has seen, and the verdict drawn from it.
//!
//! Facts about the world come from the world, facts about beliefs from the peers'
//! reports on their vehicle streams; nothing here listens to the radio.

use crate::verdict::{KillVerdict, RestartVerdict, Taker};
use skein_link::RadioCounters;
use skein_peer::output::{Report, Status};
use std::collections::{BTreeMap, BTreeSet};

/// Alarms and refusals that are kept; a peer that repeats itself must not fill the
/// verdict.
const MAX_NOTES: usize = 50;

/// A kill, and what became of the work.
#[derive(Clone, Debug)]
struct Kill {
    peer: u16,
    at_ms: u64,
    computer_only: bool,
    held: usize,
    share: f64,
    listed_already: usize,
    pending: BTreeSet<u16>,
    takers: BTreeMap<u16, Taking>,
    unseen: BTreeSet<u16>,
    seen_by: BTreeMap<u16, usize>,
    seen_unlisted: usize,
    over_at_ms: Option<u64>,
    detected: Option<(u16, u64)>,
    back_at_ms: Option<u64>,
}

#[derive(Clone, Copy, Debug)]
struct Taking {
    cells: usize,
    first_ms: u64,
}

/// A restart, and when the peer was of use again.
#[derive(Clone, Debug)]
struct Restart {
    peer: u16,
    at_ms: u64,
    fresh_disk: bool,
    before: Option<u32>,
    after: Option<u32>,
    productive_ms: Option<u64>,
}

/// The components of the true link graph, and how they changed.
#[derive(Clone, Debug, Default)]
pub struct Components {
    /// The components at present.
    now: Vec<Vec<u16>>,
    /// When one fell apart or some met, and how many peers each has from then on.
    pub history: Vec<(u64, Vec<usize>)>,
    /// The most at once.
    pub most: usize,
    /// How often one became more.
    pub splits: usize,
    /// How often more became fewer.
    pub merges: usize,
}

/// Everything seen so far.
#[derive(Clone, Debug, Default)]
pub struct Ledger {
    n_uavs: usize,
    cells: u16,
    covered: BTreeSet<u16>,
    listed: BTreeMap<u16, BTreeSet<u16>>,
    incarnations: BTreeMap<u16, u32>,
    ready: BTreeSet<u16>,
    finished: BTreeSet<u16>,
    kills: Vec<Kill>,
    restarts: Vec<Restart>,
    /// Components of the true link graph.
    pub components: Components,
    /// What the radios of peers that have ended did.
    pub radio: RadioCounters,
    /// What people should look at.
    pub alarms: Vec<String>,
    /// What must fail the trial.
    pub failures: Vec<String>,
}

impl Ledger {
    /// An empty ledger of a trial with that many UAVs.
    #[must_use]
    pub fn new(n_uavs: usize) -> Self {
        Self {
            n_uavs,
            ..Self::default()
        }
    }

    /// Takes a report of a peer; gives a line worth showing, if it is one.
    pub fn report(&mut self, now_ms: u64, peer: u16, report: Report) -> Option<String> {
        match report {
            Report::Ready { cells, .. } => {
                self.cells = self.cells.max(cells);
                self.ready.insert(peer);
                None
            }
            Report::Booted { incarnation } => {
                self.incarnations.insert(peer, incarnation);
                // A life without its disk begins low and rises when it hears of itself.
                if let Some(r) = self.restarts.iter_mut().rfind(|r| r.peer == peer) {
                    r.after = Some(incarnation);
                }
                None
            }
            Report::Membership {
                peer: whom,
                status: Status::Down,
                ..
            } => {
                self.down(now_ms, peer, whom.0);
                None
            }
            Report::Claim { legs, held, .. } => {
                let n = usize::from(self.cells).max(1);
                let mut cells: BTreeSet<u16> = legs.iter().flat_map(|leg| leg.cells(n)).collect();
                if !cells.is_empty() {
                    self.productive(now_ms, peer);
                }
                let line = self.taken(now_ms, peer, &cells);
                cells.extend(held);
                self.listed.insert(peer, cells);
                line
            }
            Report::Covered { cells } => {
                self.productive(now_ms, peer);
                for kill in &mut self.kills {
                    let before = kill.pending.len();
                    kill.pending.retain(|c| !cells.contains(c));
                    kill.seen_unlisted += before - kill.pending.len();
                    let seen = cells.iter().filter(|c| kill.unseen.remove(c)).count();
                    if seen > 0 {
                        *kill.seen_by.entry(peer).or_default() += seen;
                    }
                    kill.close(now_ms);
                }
                self.covered.extend(cells);
                None
            }
            Report::Finished { .. } => {
                self.productive(now_ms, peer);
                self.finished
                    .insert(peer)
                    .then(|| format!("uav{peer} holds the mission finished"))
            }
            Report::Alarm { text } => {
                self.note(format!("{:.1} s, uav{peer}: {text}", secs(now_ms)))
            }
            Report::Refused { reason } => self.note(format!(
                "{:.1} s, uav{peer} refused bytes: {reason}",
                secs(now_ms)
            )),
            Report::Membership { .. } | Report::Round { .. } => None,
        }
    }

    fn note(&mut self, text: String) -> Option<String> {
        if self.alarms.len() < MAX_NOTES {
            self.alarms.push(text.clone());
            return Some(text);
        }
        None
    }

    fn down(&mut self, now_ms: u64, by: u16, whom: u16) {
        let open = self
            .kills
            .iter_mut()
            .filter(|k| k.peer == whom && k.back_at_ms.is_none());
        for kill in open {
            kill.detected.get_or_insert((by, now_ms));
        }
    }

    fn productive(&mut self, now_ms: u64, peer: u16) {
        for r in self
            .restarts
            .iter_mut()
            .filter(|r| r.peer == peer && r.after.is_some())
        {
            r.productive_ms.get_or_insert(now_ms);
        }
    }

    fn taken(&mut self, now_ms: u64, by: u16, cells: &BTreeSet<u16>) -> Option<String> {
        let mut line = None;
        for kill in self.kills.iter_mut().filter(|k| k.peer != by) {
            let taken: Vec<u16> = kill.pending.intersection(cells).copied().collect();
            if taken.is_empty() {
                continue;
            }
            kill.pending.retain(|c| !taken.contains(c));
            let taking = kill.takers.entry(by).or_insert(Taking {
                cells: 0,
                first_ms: now_ms,
            });
            taking.cells += taken.len();
            kill.close(now_ms);
            let after = secs(now_ms.saturating_sub(kill.at_ms));
            let (n, victim) = (taken.len(), kill.peer);
            line = Some(format!(
                "uav{by} takes over {n} cells of uav{victim}, {after:.1} s after its end"
            ));
        }
        line
    }

    /// Takes down that a peer, or only its computer, is gone; gives how many uncovered
    /// cells it held.
    pub fn killed(&mut self, now_ms: u64, peer: u16, computer_only: bool) -> usize {
        let empty = BTreeSet::new();
        let mut pending = self.listed.get(&peer).unwrap_or(&empty).clone();
        pending.retain(|c| !self.covered.contains(c));
        let even = f64::from(self.cells).max(1.0) / self.n_uavs.max(1) as f64;
        let held = pending.len();
        let unseen = pending.clone();
        // What somebody else lists already needs no taking over.
        for (other, cells) in &self.listed {
            if *other != peer
                && !self
                    .kills
                    .iter()
                    .any(|k| k.peer == *other && k.back_at_ms.is_none())
            {
                pending.retain(|c| !cells.contains(c));
            }
        }
        self.listed.remove(&peer);
        let mut kill = Kill {
            peer,
            at_ms: now_ms,
            computer_only,
            held,
            share: held as f64 / even,
            listed_already: held - pending.len(),
            pending,
            takers: BTreeMap::new(),
            unseen,
            seen_by: BTreeMap::new(),
            seen_unlisted: 0,
            over_at_ms: None,
            detected: None,
            back_at_ms: None,
        };
        kill.close(now_ms);
        self.kills.push(kill);
        held
    }

    /// Takes down that a peer was started again.
    pub fn restarted(&mut self, now_ms: u64, peer: u16, fresh_disk: bool) {
        for kill in self.kills.iter_mut().filter(|k| k.peer == peer) {
            kill.back_at_ms.get_or_insert(now_ms);
        }
        self.finished.remove(&peer);
        let before = self.incarnations.get(&peer).copied();
        self.restarts.push(Restart {
            peer,
            at_ms: now_ms,
            fresh_disk,
            before,
            after: None,
            productive_ms: None,
        });
    }

    /// Takes down the present components of the true link graph; gives a line when
    /// one fell apart or some met. Peers that come and go do neither.
    pub fn components(&mut self, now_ms: u64, parts: &[Vec<u16>]) -> Option<String> {
        if self.components.now == parts {
            return None;
        }
        let before = std::mem::replace(&mut self.components.now, parts.to_vec());
        self.components.most = self.components.most.max(parts.len());
        let falls = before.iter().any(|old| scattered(old, parts));
        let meets = parts.iter().any(|new| scattered(new, &before));
        let shown = parts
            .iter()
            .map(|p| p.len().to_string())
            .collect::<Vec<_>>()
            .join(" + ");
        self.components.splits += usize::from(falls);
        self.components.merges += usize::from(meets);
        if falls || meets {
            self.components
                .history
                .push((now_ms, parts.iter().map(Vec::len).collect()));
        }
        match (falls, meets) {
            (true, _) => Some(format!("the swarm is split: {shown}")),
            (false, true) => Some(format!("parts of the swarm meet again: {shown}")),
            (false, false) => None,
        }
    }

    /// Adds what the radio of one life of a peer did.
    pub fn add_radio(&mut self, c: &RadioCounters) {
        let sum = &mut self.radio;
        sum.sent += c.sent;
        sum.sent_bytes += c.sent_bytes;
        sum.received += c.received;
        sum.multi_hop += c.multi_hop;
        sum.refused += c.refused;
        sum.overrun += c.overrun;
        merge(&mut sum.relayed_by, &c.relayed_by);
        merge(&mut sum.lost, &c.lost);
    }

    /// Whether that peer has ever held a mission and derived its loop.
    #[must_use]
    pub fn is_ready(&self, peer: u16) -> bool {
        self.ready.contains(&peer)
    }

    /// Whether that peer holds that the mission is finished.
    #[must_use]
    pub fn is_finished(&self, peer: u16) -> bool {
        self.finished.contains(&peer)
    }

    /// Cells of dead peers taken over so far.
    #[must_use]
    pub fn taken_over(&self) -> usize {
        self.kills
            .iter()
            .flat_map(|k| k.takers.values())
            .map(|t| t.cells)
            .sum()
    }

    /// The kills, for the verdict.
    #[must_use]
    pub fn kills(&self) -> Vec<KillVerdict> {
        self.kills.iter().map(Kill::verdict).collect()
    }

    /// The restarts, for the verdict.
    #[must_use]
    pub fn restarts(&self) -> Vec<RestartVerdict> {
        let verdict = |r: &Restart| RestartVerdict {
            peer: r.peer,
            at_s: secs(r.at_ms),
            fresh_disk: r.fresh_disk,
            incarnation_before: r.before,
            incarnation_after: r.after,
            productive_after_s: r.productive_ms.map(|t| secs(t.saturating_sub(r.at_ms))),
        };
        self.restarts.iter().map(verdict).collect()
    }
}

impl Kill {
    fn close(&mut self, now_ms: u64) {
        if self.pending.is_empty() {
            self.over_at_ms.get_or_insert(now_ms);
        }
    }

    fn verdict(&self) -> KillVerdict {
        let after = |t: u64| secs(t.saturating_sub(self.at_ms));
        let taker = |(peer, t): (&u16, &Taking)| Taker {
            peer: *peer,
            cells: t.cells,
            first_after_s: after(t.first_ms),
        };
        KillVerdict {
            peer: self.peer,
            at_s: secs(self.at_ms),
            computer_only: self.computer_only,
            cells_held: self.held,
            of_even_share: (self.share * 1000.0).round() / 1000.0,
            detected_by: self.detected.map(|(by, _)| by),
            detected_after_s: self.detected.map(|(_, t)| after(t)),
            taken_over_by: self.takers.iter().map(taker).collect(),
            listed_already: self.listed_already,
            seen_in_passing: self.seen_unlisted,
            flown_by: self.seen_by.clone(),
            all_after_s: self.over_at_ms.map(after),
            left: self.pending.len(),
        }
    }
}

/// Whether the peers of `group` stand in more than one of `parts`.
fn scattered(group: &[u16], parts: &[Vec<u16>]) -> bool {
    parts
        .iter()
        .filter(|part| part.iter().any(|id| group.contains(id)))
        .count()
        > 1
}

fn merge<K: Ord + Copy>(sum: &mut Vec<(K, u64)>, more: &[(K, u64)]) {
    let mut all: BTreeMap<K, u64> = sum.iter().copied().collect();
    for (k, v) in more {
        *all.entry(*k).or_default() += v;
    }
    *sum = all.into_iter().collect();
}

/// Seconds of milliseconds.
#[must_use]
#[allow(clippy::cast_precision_loss, reason = "a time to be shown")]
pub fn secs(ms: u64) -> f64 {
    ms as f64 / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use skein_flight::coverage::ring::Direction;
    use skein_flight::coverage::ring::backtracking::Leg;
    use skein_peer::PeerId;

    fn claim(first: u16, count: u16) -> Report {
        let legs = vec![Leg {
            first,
            count,
            direction: Direction::Forward,
        }];
        Report::Claim {
            counter: 1,
            epoch: 1,
            take: 0,
            legs,
            held: vec![],
            eta_ms: 0,
        }
    }

    fn ledger() -> Ledger {
        let mut ledger = Ledger::new(2);
        ledger.report(
            0,
            1,
            Report::Ready {
                revision: 1,
                loop_hash: 1,
                cells: 20,
            },
        );
        ledger.report(0, 1, claim(0, 10));
        ledger.report(0, 2, claim(10, 10));
        ledger
    }

    #[test]
    fn a_takeover_is_told_by_whom_how_much_and_when() {
        let mut l = ledger();
        l.report(1_000, 1, Report::Covered { cells: vec![0, 1] });
        assert_eq!(l.killed(2_000, 1, false), 8);
        let down = Report::Membership {
            peer: PeerId(1),
            incarnation: 1,
            status: Status::Down,
        };
        l.report(11_000, 2, down);
        let line = l.report(12_500, 2, claim(2, 18)).unwrap();
        assert_eq!(
            line,
            "uav2 takes over 8 cells of uav1, 10.5 s after its end"
        );
        let kill = &l.kills()[0];
        assert_eq!(
            (kill.cells_held, kill.left, kill.detected_by),
            (8, 0, Some(2))
        );
        assert!((kill.of_even_share - 0.8).abs() < 1e-9);
        assert_eq!(kill.detected_after_s, Some(9.0));
        assert_eq!(kill.all_after_s, Some(10.5));
        assert_eq!(kill.taken_over_by.len(), 1);
        assert_eq!(l.taken_over(), 8);
    }

    #[test]
    fn what_nobody_takes_over_is_left() {
        let mut l = ledger();
        l.killed(0, 1, false);
        l.report(5_000, 2, claim(5, 10));
        l.report(6_000, 2, Report::Covered { cells: vec![4] });
        let kill = &l.kills()[0];
        assert_eq!(
            (kill.left, kill.seen_in_passing, kill.all_after_s),
            (4, 1, None)
        );
    }

    #[test]
    fn a_restart_counts_as_useful_only_in_its_new_life() {
        let mut l = ledger();
        l.report(0, 1, Report::Booted { incarnation: 1 });
        l.killed(1_000, 1, false);
        l.restarted(2_000, 1, true);
        l.report(2_500, 1, Report::Booted { incarnation: 2 });
        l.report(9_000, 1, claim(0, 3));
        let r = &l.restarts()[0];
        assert_eq!(
            (r.incarnation_before, r.incarnation_after),
            (Some(1), Some(2))
        );
        assert_eq!(r.productive_after_s, Some(7.0));
    }

    #[test]
    fn splits_and_merges_are_changes_of_who_can_reach_whom() {
        let mut l = ledger();
        let steps: [&[&[u16]]; 6] = [
            &[&[1, 2, 3]],
            &[&[1], &[2, 3]],
            // The first one dies and comes back: nothing fell apart, nothing met.
            &[&[2, 3]],
            &[&[1], &[2, 3]],
            &[&[1, 2, 3]],
            &[&[1, 2, 3]],
        ];
        for (t, parts) in (0..).zip(steps) {
            let parts: Vec<Vec<u16>> = parts.iter().map(|p| p.to_vec()).collect();
            l.components(t, &parts);
        }
        assert_eq!(
            (l.components.splits, l.components.merges, l.components.most),
            (1, 1, 2)
        );
    }
}
