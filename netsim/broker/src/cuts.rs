//! Faults of links: what is cut although the world would let it through.

use skein_link::LinkState;
use skein_netsim::chaos::Fault;
use std::collections::{BTreeMap, BTreeSet};

/// All link faults in force.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cuts {
    ways: BTreeSet<(u16, u16)>,
    groups: Option<BTreeMap<u16, usize>>,
    loss_permille: Option<u16>,
}

impl Cuts {
    /// Takes a fault of links; leaves all others alone.
    pub fn apply(&mut self, fault: &Fault) {
        match fault {
            Fault::Cut { a, b, one_way } => {
                self.ways.insert((*a, *b));
                if !one_way {
                    self.ways.insert((*b, *a));
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
                self.ways.clear();
                self.groups = None;
            }
            Fault::Loss { permille } => self.loss_permille = Some(*permille),
            _ => {}
        }
    }

    /// The state of the link from `tx` to `rx` under these faults.
    #[must_use]
    pub fn on(&self, tx: u16, rx: u16, link: LinkState) -> LinkState {
        // Peers that no group names form one more, so an absent one is a group too.
        let apart = self
            .groups
            .as_ref()
            .is_some_and(|g| g.get(&tx) != g.get(&rx));
        LinkState {
            cut: link.cut || apart || self.ways.contains(&(tx, rx)),
            loss_permille: self.loss_permille.unwrap_or(link.loss_permille),
            ..link
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UP: LinkState = LinkState {
        in_range: true,
        in_sight: true,
        cut: false,
        loss_permille: 5,
        delay_ms: 1,
    };

    fn cut(cuts: &Cuts, tx: u16, rx: u16) -> bool {
        cuts.on(tx, rx, UP).cut
    }

    #[test]
    fn a_partition_cuts_between_groups_and_those_left_over_stay_together() {
        let mut cuts = Cuts::default();
        cuts.apply(&Fault::Partition {
            groups: vec![vec![1, 2], vec![3]],
        });
        assert!(cut(&cuts, 1, 3) && cut(&cuts, 3, 2) && cut(&cuts, 1, 9));
        assert!(!cut(&cuts, 1, 2) && !cut(&cuts, 8, 9));
        cuts.apply(&Fault::Heal);
        assert_eq!(cuts, Cuts::default());
    }

    #[test]
    fn a_cut_has_one_way_or_two() {
        let mut cuts = Cuts::default();
        cuts.apply(&Fault::Cut {
            a: 1,
            b: 2,
            one_way: true,
        });
        assert!(cut(&cuts, 1, 2) && !cut(&cuts, 2, 1));
        cuts.apply(&Fault::Cut {
            a: 4,
            b: 3,
            one_way: false,
        });
        assert!(cut(&cuts, 3, 4) && cut(&cuts, 4, 3));
    }

    #[test]
    fn loss_replaces_the_scenario_s_own() {
        let mut cuts = Cuts::default();
        cuts.apply(&Fault::Loss { permille: 300 });
        assert_eq!(cuts.on(1, 2, UP).loss_permille, 300);
    }
}
