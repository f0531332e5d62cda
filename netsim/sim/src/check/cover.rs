//! What peers mark as covered: truly seen (S6), never forgotten (S3), and soon known
//! to all (L4).

use super::{Findings, Snapshot};
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
/// twice as news and thrice with all; of a hundred such cells three would be later, of a thousand
/// one than two bounds, of a million one than four. A thousand storms have millions. In one hop
/// nothing is hidden.
const HIDDEN_FACTOR: u64 = 4;

/// Which covered cells one peer does not know of that others of its component do.
#[derive(Clone, Debug)]
struct Lacking {
    cells: CellSet,
    /// Since when, a place for each cell of the loop.
    since_ms: Vec<u64>,
    /// Those of which it was told that they take too long.
    told: CellSet,
}

impl Lacking {
    /// Nothing of so many cells.
    fn nothing(cells: u16) -> Self {
        Self {
            cells: CellSet::new(cells),
            since_ms: vec![0; usize::from(cells)],
            told: CellSet::new(cells),
        }
    }

    /// From now on it is these. Returns how many are not lacking any more.
    fn become_these(&mut self, cells: CellSet, now_ms: u64) -> u16 {
        let mut fresh = cells.clone();
        fresh.subtract(&self.cells);
        for cell in fresh.iter() {
            self.since_ms[usize::from(cell)] = now_ms;
        }
        self.told.intersect_with(&cells);
        let before = core::mem::replace(&mut self.cells, cells);
        before.count() + fresh.count() - self.cells.count()
    }
}

/// What the marks of one run were found to be.
#[derive(Clone, Debug, Default)]
pub struct CoverCheck {
    known: BTreeMap<u16, (u64, CellSet)>,
    lacking: BTreeMap<u16, Lacking>,
    false_marks: BTreeMap<(u16, u16), ()>,
}

impl CoverCheck {
    /// A process starts with what its disk held: it may know less than before.
    pub fn on_boot(&mut self, id: u16) {
        self.known.remove(&id);
        self.lacking.remove(&id);
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
        let hidden = if snapshot.collides() {
            HIDDEN_FACTOR
        } else {
            1
        };
        let bound_ms = bounds.spread_ms() + WHOLE_PERIODS * bounds.interval_ms;
        let mut lacks: BTreeMap<u16, (CellSet, u64)> = BTreeMap::new();
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
                lacks.insert(m.id, (lacking, from_ms));
            }
        }
        let limit_ms = |bound_ms| {
            let limit_ms = snapshot.grade().limit_of(bound_ms, LOSSY_FACTOR);
            limit_ms.map_or(u64::MAX, |l| l * hidden)
        };
        // Whatever is wrong with peers makes it longer.
        let least_ms = limit_ms(bound_ms);
        let mut before = core::mem::take(&mut self.lacking);
        let mut ended = 0;
        for (id, (cells, from_ms)) in lacks {
            let lacking = before.remove(&id).filter(|l| l.cells.capacity() == n);
            let mut lacking = lacking.unwrap_or_else(|| Lacking::nothing(n));
            ended += u64::from(lacking.become_these(cells, snapshot.now_ms));
            for cell in lacking.cells.iter() {
                let since_ms = lacking.since_ms[usize::from(cell)].max(from_ms);
                let took_ms = snapshot.now_ms - since_ms;
                if took_ms > least_ms
                    && took_ms > limit_ms(snapshot.grown_ms(bound_ms, since_ms))
                    && lacking.told.insert(cell)
                {
                    found.broken("L4", snapshot.now_ms, Some(id), || {
                        format!("does not know that cell {cell} is covered, {took_ms} ms after a peer of its component did (bound {bound_ms} ms)")
                    });
                }
            }
            self.lacking.insert(id, lacking);
        }
        let gone = before.values().map(|l| u64::from(l.cells.count()));
        ended += gone.sum::<u64>();
        // What ended between two snapshots kept the bound unless it was told above.
        for _ in 0..ended {
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
                fuel_ms: None,
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
    fn over_several_hops_what_one_alone_knows_may_take_four_times_the_bound() {
        // (3D + 9) T: 15 T at D = 2.
        for (diameter, at_14, at_62) in [(1, 1, 1), (2, 0, 1)] {
            let (mut c, mut found, mut s) = (
                CoverCheck::default(),
                Findings::new(1),
                Stability::default(),
            );
            let mut told = Vec::new();
            for t in 0..63 {
                let unions = [(1, [true, false]), (2, [false, false])];
                look_at(&mut c, &mut found, &mut s, (t * 1000, diameter), &unions);
                told.push(found.counts.get("L4").copied().unwrap_or(0));
            }
            assert_eq!((told[14], told[60], told[62]), (at_14, at_14, at_62));
        }
    }
}
