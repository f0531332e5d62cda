//! How often the swarm fell apart and met again, by the true link graph.

/// The components of the true link graph, and how they changed.
#[derive(Clone, Debug, Default)]
pub struct Connectivity {
    now: Vec<Vec<u16>>,
    /// The most components at once.
    pub most: usize,
    /// How often one became more.
    pub splits: usize,
    /// How often more became fewer.
    pub merges: usize,
}

impl Connectivity {
    /// How many components there are at present.
    #[must_use]
    pub fn n_components(&self) -> usize {
        self.now.len()
    }

    /// The components at present; gives a line when one fell apart or some met.
    pub fn observe(&mut self, components: &[Vec<u16>]) -> Option<String> {
        if self.now == components {
            return None;
        }
        let before = std::mem::replace(&mut self.now, components.to_vec());
        self.most = self.most.max(components.len());
        let falls = before.iter().any(|old| is_scattered(old, components));
        let meets = components.iter().any(|new| is_scattered(new, &before));
        self.splits += usize::from(falls);
        self.merges += usize::from(meets);
        let sizes: Vec<String> = components.iter().map(|p| p.len().to_string()).collect();
        let shown = sizes.join(" + ");
        match (falls, meets) {
            (true, _) => Some(format!("the swarm is split: {shown}")),
            (false, true) => Some(format!("parts of the swarm meet again: {shown}")),
            (false, false) => None,
        }
    }
}

/// Whether the peers of `group` stand in more than one of `components`.
fn is_scattered(group: &[u16], components: &[Vec<u16>]) -> bool {
    components
        .iter()
        .filter(|part| part.iter().any(|id| group.contains(id)))
        .count()
        > 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splits_and_merges_are_changes_of_who_can_reach_whom() {
        let mut c = Connectivity::default();
        let steps: [&[&[u16]]; 6] = [
            &[&[1, 2, 3]],
            &[&[1], &[2, 3]],
            // The first one dies and comes back: nothing fell apart, nothing met.
            &[&[2, 3]],
            &[&[1], &[2, 3]],
            &[&[1, 2, 3]],
            &[&[1, 2, 3]],
        ];
        for parts in steps {
            let parts: Vec<Vec<u16>> = parts.iter().map(|p| p.to_vec()).collect();
            c.observe(&parts);
        }
        assert_eq!((c.splits, c.merges, c.most), (1, 1, 2));
    }
}
