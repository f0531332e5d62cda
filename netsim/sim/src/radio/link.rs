//! The state of every radio link: range, line of sight, faults, loss (D2.7 §2.2).
//!
//! In this mode a link beyond the range or behind a building is simply cut; path loss
//! and fading belong to a budget mode.

use crate::fault::Fault;
use crate::spec::RadioSpec;
use crate::world::{Place, World};
use skein_link::medium::Links;
use skein_link::{LinkState, Reason};
use std::collections::{BTreeMap, BTreeSet};

/// Links are computed anew at most this often, milliseconds: at 16 m/s an end moves
/// 3 m meanwhile, less than a building's outline is known.
pub const RECOMPUTE_MS: u64 = 200;

/// A line of sight is looked at again when one of its ends has moved this far, metres.
const SIGHT_MOVE_M: f64 = 2.0;

/// What faults do to the links at the moment.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Overlay {
    cuts: BTreeSet<(u16, u16)>,
    groups: Option<BTreeMap<u16, usize>>,
    loss_permille: Option<u16>,
}

impl Overlay {
    /// Takes a fault that concerns links; says whether it did.
    pub fn apply(&mut self, fault: &Fault) -> bool {
        match fault {
            Fault::Cut { a, b, one_way } => {
                self.cuts.insert((*a, *b));
                if !one_way {
                    self.cuts.insert((*b, *a));
                }
            }
            Fault::Partition { groups } => {
                let named = groups.iter().enumerate();
                self.groups = Some(
                    named
                        .flat_map(|(i, g)| g.iter().map(move |p| (*p, i)))
                        .collect(),
                );
            }
            Fault::Heal => {
                self.cuts.clear();
                self.groups = None;
            }
            Fault::Loss { permille } => self.loss_permille = Some((*permille).min(1000)),
            _ => return false,
        }
        true
    }

    /// Whether a fault stops any transmissions.
    #[must_use]
    pub fn cuts_any(&self) -> bool {
        self.groups.is_some() || !self.cuts.is_empty()
    }

    /// Whether a fault stops transmissions from `tx` to `rx`.
    #[must_use]
    pub fn cuts(&self, tx: u16, rx: u16) -> bool {
        let parted = self
            .groups
            .as_ref()
            .is_some_and(|g| g.get(&tx) != g.get(&rx));
        parted || self.cuts.contains(&(tx, rx))
    }

    /// The share of transmissions lost in force, in thousandths.
    #[must_use]
    pub fn loss_permille(&self, radio: &RadioSpec) -> u16 {
        self.loss_permille.unwrap_or(radio.loss_permille)
    }
}

/// The links between all nodes of a world, as of the last computation.
#[derive(Clone, Debug)]
pub struct LinkTable {
    nodes: Vec<u16>,
    /// By number: where the node is in `nodes`.
    indices: Vec<Option<u16>>,
    radio: RadioSpec,
    computed_ms: Option<u64>,
    places: Vec<Option<Place>>,
    /// Row by row: from the row's node to the column's.
    states: Vec<LinkState>,
    /// By pair, the lower index first: the last look and what it showed.
    looks: Vec<Option<(Place, Place, bool)>>,
    /// By pair: whether both directions were up; nothing while an end is absent.
    up: Vec<Option<bool>>,
    cut_by_range: u64,
    cut_by_sight: u64,
    cut_by_fault: u64,
}

impl LinkTable {
    /// A table for some nodes, ascending by number, everything down until the first
    /// computation.
    #[must_use]
    pub fn new(nodes: &[u16], radio: RadioSpec) -> Self {
        let n = nodes.len();
        let mut indices = vec![None; nodes.last().map_or(0, |id| usize::from(*id) + 1)];
        for (i, id) in (0..).zip(nodes) {
            indices[usize::from(*id)] = Some(i);
        }
        Self {
            nodes: nodes.to_vec(),
            indices,
            radio,
            computed_ms: None,
            places: vec![None; n],
            states: vec![LinkState::DOWN; n * n],
            looks: vec![None; n * n],
            up: vec![None; n * n],
            cut_by_range: 0,
            cut_by_sight: 0,
            cut_by_fault: 0,
        }
    }

    /// The nodes, ascending.
    #[must_use]
    pub fn nodes(&self) -> &[u16] {
        &self.nodes
    }

    /// Computes the links anew unless that was done less than [`RECOMPUTE_MS`] ago;
    /// says whether it did.
    pub fn refresh(&mut self, world: &World, faults: &Overlay) -> bool {
        let due = self
            .computed_ms
            .is_none_or(|t| world.now_ms() >= t + RECOMPUTE_MS);
        if due {
            self.compute(world, faults);
        }
        due
    }

    /// Computes the links anew: after a fault, a kill or a restart.
    pub fn compute(&mut self, world: &World, faults: &Overlay) {
        self.computed_ms = Some(world.now_ms());
        for (place, id) in self.places.iter_mut().zip(&self.nodes) {
            *place = world.antenna(*id);
        }
        let n = self.nodes.len();
        let loss_permille = faults.loss_permille(&self.radio);
        let cuts_any = faults.cuts_any();
        for i in 0..n {
            for j in i + 1..n {
                let (there, back, pair) = (i * n + j, j * n + i, i * n + j);
                let (Some(a), Some(b)) = (self.places[i], self.places[j]) else {
                    (self.states[there], self.states[back], self.up[pair]) =
                        (LinkState::DOWN, LinkState::DOWN, None);
                    continue;
                };
                let in_range = a.distance_m(&b) <= self.radio.range_m;
                // Out of range nobody asks for sight; it counts as free then.
                let in_sight = !in_range || self.look(pair, a, b, world);
                let state = |tx, rx| LinkState {
                    in_range,
                    in_sight,
                    cut: cuts_any && faults.cuts(tx, rx),
                    loss_permille,
                    delay_ms: self.radio.delay_ms,
                };
                let (ab, ba) = (
                    state(self.nodes[i], self.nodes[j]),
                    state(self.nodes[j], self.nodes[i]),
                );
                (self.states[there], self.states[back]) = (ab, ba);
                self.note(i, j, cause(&ab).or(cause(&ba)));
            }
        }
    }

    /// Whether two places see each other, asked again only after one has moved.
    fn look(&mut self, pair: usize, a: Place, b: Place, world: &World) -> bool {
        if let Some((pa, pb, sees)) = self.looks[pair]
            && pa.distance_m(&a) < SIGHT_MOVE_M
            && pb.distance_m(&b) < SIGHT_MOVE_M
        {
            return sees;
        }
        let sees = world.obstacles().sees(a, b);
        self.looks[pair] = Some((a, b, sees));
        sees
    }

    fn note(&mut self, i: usize, j: usize, cause: Option<Reason>) {
        let pair = i * self.nodes.len() + j;
        let was = self.up[pair].replace(cause.is_none());
        if was == Some(cause.is_none()) || (was.is_none() && cause.is_some()) {
            return;
        }
        match cause {
            Some(Reason::Range) => self.cut_by_range += 1,
            Some(Reason::Sight) => self.cut_by_sight += 1,
            Some(_) => self.cut_by_fault += 1,
            None => {}
        }
    }

    /// How often a pair that heard each other ceased to, by range, by sight, by fault. A link
    /// that ended because one end was lost is not cut.
    #[must_use]
    pub fn cuts(&self) -> (u64, u64, u64) {
        (self.cut_by_range, self.cut_by_sight, self.cut_by_fault)
    }

    /// Where a node is in [`LinkTable::nodes`].
    #[must_use]
    pub fn index_of(&self, node: u16) -> Option<usize> {
        let index = self.indices.get(usize::from(node)).copied().flatten();
        index.map(usize::from)
    }

    /// Whether two nodes hear each other both ways.
    #[must_use]
    pub fn joined(&self, a: u16, b: u16) -> bool {
        self.state(a, b).is_up() && self.state(b, a).is_up()
    }
}

impl Links for LinkTable {
    /// Down for a node that is absent or unknown, and to itself.
    fn state(&self, tx: u16, rx: u16) -> LinkState {
        match (self.index_of(tx), self.index_of(rx)) {
            (Some(i), Some(j)) => self.states[i * self.nodes.len() + j],
            _ => LinkState::DOWN,
        }
    }

    fn present(&self, node: u16) -> bool {
        self.index_of(node)
            .is_some_and(|i| self.places[i].is_some())
    }
}

fn cause(link: &LinkState) -> Option<Reason> {
    if link.cut {
        Some(Reason::Cut)
    } else if !link.in_range {
        Some(Reason::Range)
    } else if !link.in_sight {
        Some(Reason::Sight)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::fixture::{GROUND_ID, square};

    fn table(spec: &crate::spec::Spec) -> (World, LinkTable) {
        let w = World::new(spec, 1);
        let t = LinkTable::new(w.nodes(), spec.radio);
        (w, t)
    }

    #[test]
    fn range_and_sight_cut_links() {
        let mut spec = square(4);
        spec.radio.range_m = 300.0;
        let (w, mut t) = table(&spec);
        assert!(
            !t.state(1, 2).is_up(),
            "nothing is up before the first computation"
        );
        assert!(t.refresh(&w, &Overlay::default()));
        assert!(!t.refresh(&w, &Overlay::default()), "computed just now");
        for a in w.nodes() {
            for b in w.nodes() {
                if a == b {
                    continue;
                }
                let (pa, pb) = (w.antenna(*a).unwrap(), w.antenna(*b).unwrap());
                let s = t.state(*a, *b);
                assert_eq!(s.in_range, pa.distance_m(&pb) <= 300.0);
                assert_eq!(s.in_sight, !s.in_range || w.obstacles().sees(pa, pb));
                assert_eq!(s, t.state(*b, *a));
            }
        }
        assert!(t.cuts() == (0, 0, 0), "what was never up was not cut");
    }

    #[test]
    fn causes_are_told_apart_and_lost_nodes_are_no_cut() {
        let mut spec = square(3);
        spec.buildings.clear();
        let (mut w, mut t) = table(&spec);
        let mut o = Overlay::default();
        t.compute(&w, &o);
        let all = [
            (1, 2),
            (1, 3),
            (2, 3),
            (1, GROUND_ID),
            (2, GROUND_ID),
            (3, GROUND_ID),
        ];
        assert!(all.iter().all(|(a, b)| t.joined(*a, *b)));
        assert!(o.apply(&Fault::Cut {
            a: 1,
            b: 2,
            one_way: true
        }));
        t.compute(&w, &o);
        assert!(!t.state(1, 2).is_up() && t.state(2, 1).is_up() && !t.joined(1, 2));
        assert_eq!(t.cuts(), (0, 0, 1));
        assert!(o.apply(&Fault::Partition {
            groups: vec![vec![1, 2]]
        }));
        t.compute(&w, &o);
        assert!(!t.joined(1, 3) && !t.joined(2, GROUND_ID) && t.joined(3, GROUND_ID));
        assert_eq!(t.cuts(), (0, 0, 5));
        assert!(o.apply(&Fault::Heal) && o.apply(&Fault::Loss { permille: 2000 }));
        assert!(!o.apply(&Fault::Kill { peer: 1 }));
        w.kill(3);
        t.compute(&w, &o);
        assert!(t.joined(1, 2) && !t.present(3));
        assert_eq!(t.state(1, 2).loss_permille, 1000);
        assert_eq!(t.cuts(), (0, 0, 5));
        w.respawn(3);
        t.compute(&w, &o);
        assert!(all.iter().all(|(a, b)| t.joined(*a, *b)));
    }
}
