//! Who is connected with whom, truly: the graph of links that are up both ways
//! (D2.7 §1.5.1).

use super::LinkTable;
use skein_link::medium::Links as _;
use std::collections::VecDeque;

impl LinkTable {
    /// Hops from one node to every other over links that are up both ways, by place in
    /// [`LinkTable::nodes`]; nothing where there is no way. Only nodes that have a
    /// radio and that `counts` accepts take part, the first one included.
    fn hops_by_index(&self, from: usize, counts: &impl Fn(u16) -> bool) -> Vec<Option<u16>> {
        let nodes = self.nodes();
        let usable = |i: usize| self.present(nodes[i]) && counts(nodes[i]);
        let mut hops = vec![None; nodes.len()];
        if !usable(from) {
            return hops;
        }
        hops[from] = Some(0);
        let mut todo = VecDeque::from([(from, 0u16)]);
        while let Some((i, h)) = todo.pop_front() {
            for j in 0..nodes.len() {
                if hops[j].is_none() && self.joined(nodes[i], nodes[j]) && usable(j) {
                    hops[j] = Some(h + 1);
                    todo.push_back((j, h + 1));
                }
            }
        }
        hops
    }

    /// Least number of hops between two nodes over links that are up both ways, through
    /// nodes that `counts` accepts (those whose process runs, for example).
    #[must_use]
    pub fn hops(&self, a: u16, b: u16, counts: impl Fn(u16) -> bool) -> Option<u16> {
        let (from, to) = (self.index_of(a)?, self.index_of(b)?);
        self.hops_by_index(from, &counts)[to]
    }

    /// The groups of nodes that can reach each other, each ascending, ordered by their
    /// lowest number.
    #[must_use]
    pub fn components(&self, counts: impl Fn(u16) -> bool) -> Vec<Vec<u16>> {
        let nodes = self.nodes();
        let mut done = vec![false; nodes.len()];
        let mut all = Vec::new();
        for i in 0..nodes.len() {
            if done[i] {
                continue;
            }
            let hops = self.hops_by_index(i, &counts);
            let mut part = Vec::new();
            for j in (0..nodes.len()).filter(|j| hops[*j].is_some()) {
                done[j] = true;
                part.push(nodes[j]);
            }
            if !part.is_empty() {
                all.push(part);
            }
        }
        all
    }

    /// The most hops that the shortest way between any two connected nodes takes.
    #[must_use]
    pub fn diameter(&self, counts: impl Fn(u16) -> bool) -> u16 {
        (0..self.nodes().len())
            .flat_map(|i| self.hops_by_index(i, &counts))
            .flatten()
            .max()
            .unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use crate::fault::Fault;
    use crate::radio::{LinkTable, Overlay};
    use crate::world::World;
    use crate::world::fixture::square;

    #[test]
    fn a_chain_has_as_many_hops_as_links() {
        let mut spec = square(6);
        spec.ground = None;
        spec.buildings.clear();
        let w = World::new(&spec, 1);
        let mut t = LinkTable::new(w.nodes(), spec.radio);
        let mut o = Overlay::default();
        for a in 1..=6u16 {
            for b in a + 2..=6 {
                o.apply(&Fault::Cut {
                    a,
                    b,
                    one_way: false,
                });
            }
        }
        t.compute(&w, &o);
        let all = |_: u16| true;
        assert_eq!(t.diameter(all), 5);
        assert_eq!(t.hops(2, 6, all), Some(4));
        assert_eq!(t.components(all), [vec![1, 2, 3, 4, 5, 6]]);
        // Node 3 is down: two parts.
        let no_3 = |n: u16| n != 3;
        assert_eq!(t.components(no_3), [vec![1, 2], vec![4, 5, 6]]);
        assert_eq!(
            (t.diameter(no_3), t.hops(1, 4, no_3), t.hops(3, 4, no_3)),
            (2, None, None)
        );
        // One way only is no connection.
        o.apply(&Fault::Cut {
            a: 4,
            b: 5,
            one_way: true,
        });
        t.compute(&w, &o);
        assert_eq!(t.components(all), [vec![1, 2, 3, 4], vec![5, 6]]);
    }
}
