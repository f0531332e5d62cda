//! The true radio graph: components, diameter, articulation peers, and since when
//! each pair has been joined. Built from the links of the world, never from beliefs.

use fixedbitset::FixedBitSet;
use std::collections::BTreeMap;

/// Who can reach whom at one moment.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Graph {
    ids: Vec<u16>,
    /// Bit `j` of entry `i`: radio `i` and radio `j` hear each other.
    adjacent: Vec<FixedBitSet>,
    /// Bit `j` of entry `i`: radio `i` hears radio `j`.
    hears: Vec<FixedBitSet>,
    /// Bit `j` of entry `i`: some path joins them (a radio reaches itself).
    reach: Vec<FixedBitSet>,
    diameter: u32,
}

impl Graph {
    /// The graph of the radios `ids` (ascending) where `heard(i, j)` tells whether the first
    /// hears the second.
    #[must_use]
    pub fn new(ids: Vec<u16>, mut heard: impl FnMut(u16, u16) -> bool) -> Self {
        let n = ids.len();
        let mut row = |i: usize| {
            let mut bits = FixedBitSet::with_capacity(n);
            let others = (0..n).filter(|j| *j != i);
            bits.extend(others.filter(|j| heard(ids[i], ids[*j])));
            bits
        };
        let hears: Vec<FixedBitSet> = (0..n).map(&mut row).collect();
        let both = |i: usize| {
            let mut bits = FixedBitSet::with_capacity(n);
            bits.extend(hears[i].ones().filter(|j| hears[*j].contains(i)));
            bits
        };
        let adjacent: Vec<FixedBitSet> = (0..n).map(both).collect();
        // What is heard goes further than components, along links that are up one way.
        let (reach, mutual) = close(&adjacent);
        let diameter = if hears == adjacent {
            mutual
        } else {
            close(&hears).1
        };
        Self {
            ids,
            adjacent,
            hears,
            reach,
            diameter,
        }
    }

    /// The radios, ascending.
    #[must_use]
    pub fn ids(&self) -> &[u16] {
        &self.ids
    }

    /// The most hops that anything takes which reaches anybody, at least 1.
    #[must_use]
    pub fn diameter(&self) -> u32 {
        self.diameter.max(1)
    }

    /// How many radios this one hears.
    #[must_use]
    pub fn neighbours(&self, a: u16) -> u32 {
        let heard = self
            .ids
            .binary_search(&a)
            .map(|i| self.hears[i].count_ones(..));
        heard.map_or(0, |n| u32::try_from(n).unwrap_or(u32::MAX))
    }

    /// Whether two radios hear each other.
    #[must_use]
    pub fn linked(&self, a: u16, b: u16) -> bool {
        match (self.ids.binary_search(&a), self.ids.binary_search(&b)) {
            (Ok(i), Ok(j)) => self.adjacent[i].contains(j),
            _ => false,
        }
    }

    /// Whether a path joins two radios.
    #[must_use]
    pub fn joined(&self, a: u16, b: u16) -> bool {
        match (self.ids.binary_search(&a), self.ids.binary_search(&b)) {
            (Ok(i), Ok(j)) => self.reach[i].contains(j),
            _ => false,
        }
    }

    /// The component of a radio, ascending; empty when it is not there.
    #[must_use]
    pub fn component(&self, a: u16) -> Vec<u16> {
        let Ok(i) = self.ids.binary_search(&a) else {
            return Vec::new();
        };
        self.reach[i].ones().map(|j| self.ids[j]).collect()
    }

    /// The components, each ascending, in the order of their least members.
    #[must_use]
    pub fn components(&self) -> Vec<Vec<u16>> {
        let mut out = Vec::new();
        for (i, &id) in self.ids.iter().enumerate() {
            if self.reach[i].ones().next() == Some(i) {
                out.push(self.component(id));
            }
        }
        out
    }

    /// Whether losing this radio would split its component.
    #[must_use]
    pub fn is_articulation(&self, a: u16) -> bool {
        let Ok(i) = self.ids.binary_search(&a) else {
            return false;
        };
        let mut rest = self.adjacent.clone();
        rest[i].clear();
        for bits in &mut rest {
            bits.remove(i);
        }
        let (reach, _) = close(&rest);
        let mut others = self.reach[i].clone();
        others.remove(i);
        let first = others.ones().next();
        first.is_some_and(|k| !others.is_subset(&reach[k]))
    }
}

/// Reachability of every node and the longest of all shortest paths.
fn close(adjacent: &[FixedBitSet]) -> (Vec<FixedBitSet>, u32) {
    let n = adjacent.len();
    let mut diameter = 0;
    let mut next = FixedBitSet::with_capacity(n);
    let reach = (0..n).map(|i| {
        let mut seen = FixedBitSet::with_capacity(n);
        seen.insert(i);
        let (mut front, mut hops) = (seen.clone(), 0);
        loop {
            next.clear();
            for j in front.ones() {
                next.union_with(&adjacent[j]);
            }
            next.difference_with(&seen);
            if next.is_clear() {
                break;
            }
            seen.union_with(&next);
            core::mem::swap(&mut front, &mut next);
            hops += 1;
        }
        diameter = diameter.max(hops);
        seen
    });
    (reach.collect(), diameter)
}

/// Since when each radio's component has been what it is, and each pair joined.
#[derive(Clone, Debug, Default)]
pub struct Stability {
    component: BTreeMap<u16, (Vec<(u16, u32)>, u64)>,
    joined: BTreeMap<(u16, u16), u64>,
    /// The components of which these pairs are.
    joined_of: Vec<Vec<u16>>,
    diameters: Vec<(u64, u32)>,
    window_ms: u64,
}

impl Stability {
    /// Takes the graph at `now_ms`; `life(id)` counts the lives of a radio, so that a
    /// restart counts as a change even when it falls between two snapshots.
    /// Returns whether any component changed.
    pub fn observe(
        &mut self,
        now_ms: u64,
        graph: &Graph,
        life: impl Fn(u16) -> u32,
        window_ms: u64,
    ) -> bool {
        let mut changed = false;
        let components = graph.components();
        for members in &components {
            let named: Vec<(u16, u32)> = members.iter().map(|m| (*m, life(*m))).collect();
            for m in members {
                let known = self.component.get(m);
                if known.is_none_or(|(old, _)| *old != named) {
                    self.component.insert(*m, (named.clone(), now_ms));
                    changed = true;
                }
            }
        }
        let before = self.component.len();
        self.component
            .retain(|id, _| graph.ids().binary_search(id).is_ok());
        changed |= before != self.component.len();
        if components != self.joined_of {
            self.join(now_ms, graph);
            self.joined_of = components;
        }
        // What a peer reckons with was measured in a window, and told in the one after it.
        self.window_ms = window_ms;
        self.diameters
            .retain(|(t, _)| t + 2 * window_ms + window_ms / 5 >= now_ms);
        self.diameters.push((now_ms, graph.diameter()));
        changed
    }

    fn join(&mut self, now_ms: u64, graph: &Graph) {
        self.joined.retain(|(a, b), _| graph.joined(*a, *b));
        for (i, &a) in graph.ids().iter().enumerate() {
            for &b in &graph.ids()[i + 1..] {
                if graph.joined(a, b) {
                    self.joined.entry((a, b)).or_insert(now_ms);
                }
            }
        }
    }

    /// A radio fell silent or began a new life: its pairs start again.
    pub fn forget(&mut self, id: u16) {
        self.joined.retain(|(a, b), _| *a != id && *b != id);
        self.joined_of.clear();
        self.component.remove(&id);
    }

    /// Since when a path has joined the two without a break, if one does.
    #[must_use]
    pub fn joined_since_ms(&self, a: u16, b: u16) -> Option<u64> {
        self.joined.get(&(a.min(b), a.max(b))).copied()
    }

    /// Since when the component of a radio has been what it is.
    #[must_use]
    pub fn component_since_ms(&self, id: u16) -> Option<u64> {
        self.component.get(&id).map(|(_, since)| *since)
    }

    /// The largest true diameter within the window.
    #[must_use]
    pub fn diameter(&self) -> u32 {
        let now_ms = self.diameters.last().map_or(0, |(t, _)| *t);
        let recent = |(t, _): &&(u64, u32)| *t + self.window_ms >= now_ms;
        let all = self.diameters.iter().filter(recent).map(|(_, d)| *d);
        all.max().unwrap_or(1).max(1)
    }

    /// The largest true diameter that any peer may still reckon with: hops count for a
    /// window after they were heard, and what was measured is told for one more, with a
    /// fifth of a window for the way.
    #[must_use]
    pub fn lasting_diameter(&self) -> u32 {
        let all = self.diameters.iter().map(|(_, d)| *d);
        all.max().unwrap_or(1).max(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn graph(ids: &[u16], edges: &[(u16, u16)]) -> Graph {
        Graph::new(ids.to_vec(), |a, b| {
            edges.contains(&(a, b)) || edges.contains(&(b, a))
        })
    }

    #[test]
    fn a_link_that_is_up_one_way_joins_nobody_and_carries_what_is_heard() {
        // 2 and 3 hear each other; 1 is deaf and is heard by 2 alone.
        let heard = [(2, 1), (2, 3), (3, 2)];
        let g = Graph::new(vec![1, 2, 3], |a, b| heard.contains(&(a, b)));
        assert_eq!(g.components(), [vec![1], vec![2, 3]]);
        assert_eq!((g.diameter(), g.neighbours(1), g.neighbours(2)), (2, 0, 2));
    }

    #[test]
    fn a_chain_has_its_length_as_diameter_and_its_inner_peers_as_articulations() {
        let g = graph(&[1, 2, 3, 9], &[(1, 2), (2, 3), (3, 9)]);
        assert_eq!(g.diameter(), 3);
        assert_eq!(g.components(), [vec![1, 2, 3, 9]]);
        let cuts: Vec<bool> = g.ids().iter().map(|i| g.is_articulation(*i)).collect();
        assert_eq!(cuts, [false, true, true, false]);
    }

    #[test]
    fn separate_radios_make_separate_components() {
        let g = graph(&[1, 2, 3, 4], &[(1, 3), (2, 4)]);
        assert_eq!(g.components(), [vec![1, 3], vec![2, 4]]);
        assert!(g.joined(1, 3) && !g.joined(1, 2) && g.joined(2, 2));
        assert!(!g.is_articulation(1));
    }

    #[test]
    fn more_radios_than_a_word_has_bits_are_all_there() {
        let ids: Vec<u16> = (1..=257).collect();
        let chain: Vec<(u16, u16)> = ids.windows(2).map(|w| (w[0], w[1])).collect();
        let g = graph(&ids, &chain[..255]);
        assert_eq!((g.ids().len(), g.diameter()), (257, 255));
        assert_eq!(g.components().len(), 2);
        assert!(g.joined(1, 256) && !g.joined(256, 257) && g.is_articulation(200));
        assert_eq!((g.neighbours(1), g.neighbours(200)), (1, 2));
    }

    #[test]
    fn stability_counts_from_the_last_change_and_a_new_life_is_one() {
        let mut s = Stability::default();
        let whole = graph(&[1, 2, 3], &[(1, 2), (2, 3)]);
        let split = graph(&[1, 2, 3], &[(1, 2)]);
        assert!(s.observe(0, &whole, |_| 1, 10_000));
        assert!(!s.observe(1000, &whole, |_| 1, 10_000));
        assert_eq!(s.component_since_ms(2), Some(0));
        assert!(s.observe(2000, &split, |_| 1, 10_000));
        assert_eq!(
            (s.joined_since_ms(2, 1), s.joined_since_ms(2, 3)),
            (Some(0), None)
        );
        assert_eq!(s.diameter(), 2);
        assert!(s.observe(3000, &split, |p| if p == 2 { 2 } else { 1 }, 10_000));
        assert_eq!(s.component_since_ms(1), Some(3000));
        assert_eq!(s.component_since_ms(3), Some(2000));
    }
}
