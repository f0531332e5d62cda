//! What peers mark as covered: truly seen (S6), never forgotten (S3), and soon known
//! to all (L4).

use super::{Clocks, Findings, Grade, Snapshot};
use skein_peer::cells::CellSet;
use std::collections::BTreeMap;

/// What is news of coverage is said twice, two intervals apart; what collided both times comes
/// with all of it, four intervals after that was said last, and may collide, too: four more
/// than where all of it is said every two.
const WHOLE_PERIODS: u64 = 4;

/// So many bounds are what a single cell may take where something is lost: in some 700 storms
/// 1.9 was measured, and 3.3 among twenty UAVs over several hops.
const LOSSY_FACTOR: u64 = 5;

/// And so many at loss 0 over several hops. A cell is known to who saw it alone until somebody
/// hears of it, and at the edge all who do may be in earshot of stations that their author cannot
/// hear: then one transmission in two arrives. Within the bound at D = 2 it says so five times,
/// twice as news and thrice with all; of a hundred such cells three would be later, within two
/// bounds one of a thousand. In one hop nothing is hidden.
const HIDDEN_FACTOR: u64 = 2;

/// What the marks of one run were found to be.
#[derive(Clone, Debug, Default)]
pub struct CoverCheck {
    known: BTreeMap<u16, (u64, CellSet)>,
    lacking: Clocks<(u16, u16)>,
    false_marks: BTreeMap<(u16, u16), ()>,
}

impl CoverCheck {
    /// A process starts with what its disk held: it may know less than before.
    pub fn on_boot(&mut self, id: u16) {
        self.known.remove(&id);
        self.lacking.retain(|(p, _)| *p != id);
    }

    /// Looks at everybody's union of covered cells.
    pub fn on_snapshot(&mut self, snapshot: &Snapshot<'_>, found: &mut Findings) {
        for m in snapshot
            .peers
            .iter()
            .filter(|m| m.view.loop_hash == snapshot.loop_hash)
        {
            self.check_marks(snapshot, m.id, &m.view.covered, found);
        }
        self.check_spread(snapshot, found);
    }

    fn check_marks(
        &mut self,
        snapshot: &Snapshot<'_>,
        id: u16,
        covered: &CellSet,
        found: &mut Findings,
    ) {
        let known = self.known.entry(id).or_default();
        if known.0 == snapshot.loop_hash && known.1 == *covered {
            return;
        }
        let mut unseen = covered.clone();
        unseen.subtract(snapshot.covered);
        for cell in unseen.iter() {
            if self.false_marks.insert((id, cell), ()).is_none() {
                found.broken("S6", snapshot.now_ms, Some(id), || {
                    format!("marks cell {cell} as covered, no camera has seen it")
                });
            }
        }
        if known.0 == snapshot.loop_hash {
            known.1.subtract(covered);
            if let Some(c) = known.1.iter().next() {
                found.broken("S3", snapshot.now_ms, Some(id), || {
                    format!("forgot that cell {c} is covered")
                });
            }
        }
        *known = (snapshot.loop_hash, covered.clone());
    }

    /// L4: what one member of an unchanged component knows, all know soon.
    fn check_spread(&mut self, snapshot: &Snapshot<'_>, found: &mut Findings) {
        let n = snapshot.covered.capacity();
        let bounds = snapshot.bounds;
        let hidden = snapshot.grade() == Grade::Hard && bounds.diameter > 1;
        let hidden = if hidden { HIDDEN_FACTOR } else { 1 };
        let bound_ms = bounds.spread_ms() + WHOLE_PERIODS * bounds.interval_ms;
        let mut lacks: Vec<(u16, u16, u64)> = Vec::new();
        for component in snapshot.graph.components() {
            let peers: Vec<_> = component
                .iter()
                .filter_map(|id| snapshot.peer(*id))
                .filter(|m| {
                    m.view.loop_hash == snapshot.loop_hash
                        && m.view.speaks
                        && m.view.covered.capacity() == n
                })
                .collect();
            let since_ms = component
                .first()
                .and_then(|id| snapshot.stability.component_since_ms(*id));
            let mut known = CellSet::new(n);
            for m in &peers {
                known.union_with(&m.view.covered);
            }
            for m in peers.iter().filter(|m| m.view.covered != known) {
                let from_ms = since_ms.unwrap_or(snapshot.now_ms).max(m.since_ms);
                let mut lacking = known.clone();
                lacking.subtract(&m.view.covered);
                lacks.extend(lacking.iter().map(|cell| (m.id, cell, from_ms)));
            }
        }
        lacks.sort_unstable();
        let mut ended = Vec::new();
        self.lacking.retain(|k| {
            let goes_on = lacks.binary_search_by(|l| (l.0, l.1).cmp(k)).is_ok();
            if !goes_on {
                ended.push(*k);
            }
            goes_on
        });
        for (id, cell, from_ms) in lacks {
            let since_ms = self.lacking.start((id, cell), snapshot.now_ms).max(from_ms);
            let took_ms = snapshot.now_ms - since_ms;
            if snapshot
                .grade()
                .limit_of(snapshot.grown_ms(bound_ms, since_ms), LOSSY_FACTOR)
                .is_some_and(|l| took_ms > l * hidden)
                && self.lacking.tell_once((id, cell))
            {
                found.broken("L4", snapshot.now_ms, Some(id), || {
                    format!("does not know that cell {cell} is covered, {took_ms} ms after a peer of its component did (bound {bound_ms} ms)")
                });
            }
        }
        // What ended between two snapshots kept the bound unless it was told above.
        for _ in ended {
            found.took("L4", snapshot.grade(), snapshot.bounds.period_ms, bound_ms);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Bounds, Graph, Handicaps, PeerSnapshot, Stability};
    use super::*;
    use skein_peer::Beliefs;

    fn look_at(
        check: &mut CoverCheck,
        found: &mut Findings,
        s: &mut Stability,
        (now_ms, diameter): (u64, u64),
        unions: &[(u16, [bool; 2])],
    ) {
        let peers: Vec<PeerSnapshot> = unions
            .iter()
            .map(|(id, covered)| PeerSnapshot {
                id: *id,
                speaks_as: *id,
                uav: true,
                since_ms: 0,
                at: None,
                eta_ms: 0,
                view: Beliefs {
                    speaks: true,
                    loop_hash: 3,
                    covered: CellSet::of(
                        2,
                        (0..).zip(covered).filter(|(_, is)| **is).map(|(c, _)| c),
                    ),
                    ..Beliefs::default()
                },
            })
            .collect();
        let graph = Graph::new(peers.iter().map(|m| m.id).collect(), |_, _| true);
        s.observe(now_ms, &graph, |_| 1, 10_000);
        let snapshot = Snapshot {
            now_ms,
            loss_permille: 0,
            bounds: Bounds {
                period_ms: 1000,
                interval_ms: 1000,
                diameter,
            },
            graph: &graph,
            stability: s,
            handicaps: &Handicaps::default(),
            peers: &peers,
            covered: &CellSet::of(2, [0]),
            loop_hash: 3,
        };
        check.on_snapshot(&snapshot, found);
    }

    #[test]
    fn marking_forgetting_and_not_hearing_are_all_found() {
        let (mut c, mut found, mut s) = (
            CoverCheck::default(),
            Findings::new(1),
            Stability::default(),
        );
        for t in 0..13 {
            look_at(
                &mut c,
                &mut found,
                &mut s,
                (t * 1000, 1),
                &[(1, [true, false]), (2, [false, false])],
            );
        }
        assert!(found.counts.is_empty(), "{:?}", found.violations);
        look_at(
            &mut c,
            &mut found,
            &mut s,
            (13_000, 1),
            &[(1, [true, true]), (2, [false, false])],
        );
        assert_eq!(
            found.counts.keys().copied().collect::<Vec<_>>(),
            ["L4", "S6"]
        );
        look_at(
            &mut c,
            &mut found,
            &mut s,
            (14_000, 1),
            &[(1, [false, true]), (2, [false, false])],
        );
        assert_eq!(found.counts.get("S3"), Some(&1));
        assert_eq!(found.counts.get("S6"), Some(&1));
    }

    #[test]
    fn over_several_hops_what_one_alone_knows_may_take_twice_the_bound() {
        // (3D + 9) T: 15 T at D = 2.
        for (diameter, at_14, at_32) in [(1, 1, 1), (2, 0, 1)] {
            let (mut c, mut found, mut s) = (
                CoverCheck::default(),
                Findings::new(1),
                Stability::default(),
            );
            let mut told = Vec::new();
            for t in 0..33 {
                let unions = [(1, [true, false]), (2, [false, false])];
                look_at(&mut c, &mut found, &mut s, (t * 1000, diameter), &unions);
                told.push(found.counts.get("L4").copied().unwrap_or(0));
            }
            assert_eq!((told[14], told[30], told[32]), (at_14, at_14, at_32));
        }
    }
}
