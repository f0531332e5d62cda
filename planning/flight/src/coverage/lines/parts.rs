//! Union-find whose parts are named by their least member (a tool of D2.7 §3.5).
//!
//! petgraph's `UnionFind` names a part by rank. Here the name decides ties (which of two
//! parts of one size is joined first), and the least member is the same whatever the
//! order of joining.

/// Places that are joined, as a forest of references to the least of each part.
#[derive(Clone, Debug)]
pub struct Parts {
    up: Vec<usize>,
}

impl Parts {
    /// `n` places, none of them joined.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self {
            up: (0..n).collect(),
        }
    }

    /// The least place of the part of `x`.
    pub fn find(&mut self, mut x: usize) -> usize {
        while self.up[x] != x {
            self.up[x] = self.up[self.up[x]];
            x = self.up[x];
        }
        x
    }

    /// Joins two parts; `false` when they were one already.
    pub fn join(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.find(a), self.find(b));
        self.up[a.max(b)] = a.min(b);
        a != b
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_named_by_its_least_member_in_any_order_of_joining() {
        for pairs in [[(4, 3), (3, 1), (2, 5)], [(2, 5), (1, 3), (4, 1)]] {
            let mut parts = Parts::new(6);
            assert!(pairs.iter().all(|&(a, b)| parts.join(a, b)));
            assert!(!parts.join(1, 4));
            let names: Vec<usize> = (0..6).map(|p| parts.find(p)).collect();
            assert_eq!(names, [0, 1, 2, 1, 1, 2]);
        }
    }
}
