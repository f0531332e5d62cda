//! Whom peers mean by an id that two processes have: checks and the account know each by
//! the number of its radio.

use crate::check::Graph;
use crate::twins::Twins;
use skein_peer::{Beliefs, Incarnation, PeerId, Report};
use std::collections::{BTreeMap, BTreeSet};

/// The twins of one run.
#[derive(Clone, Debug, Default)]
pub struct Names {
    twins: Twins,
    /// Who spoke in each life of an id, in that order, while it is not silent.
    lives: BTreeMap<(u16, Incarnation), Vec<u16>>,
    /// Of whom each peer heard last by an id, by its number and the id.
    heard: BTreeMap<(u16, u16), u16>,
}

impl Names {
    /// Before any of them spoke.
    #[must_use]
    pub fn new(twins: Twins) -> Self {
        Self {
            twins,
            ..Self::default()
        }
    }

    /// Who they are.
    #[must_use]
    pub fn twins(&self) -> &Twins {
        &self.twins
    }

    /// Whether two have this id.
    fn is_ambiguous(&self, id: u16) -> bool {
        self.twins.is_shared(id)
    }

    /// The ids that two have, ascending.
    fn ambiguous(&self) -> BTreeSet<u16> {
        self.twins.shared()
    }

    /// A peer speaks in a life.
    pub fn speaks(&mut self, number: u16, life: Incarnation) {
        let id = self.twins.id_of(number);
        if self.is_ambiguous(id) {
            let spoke = self.lives.entry((id, life)).or_default();
            if !spoke.contains(&number) {
                spoke.push(number);
            }
        }
    }

    /// A peer is silent: whoever spoke beside it in one of its lives is meant by that from
    /// now on. Returns who, and in which life.
    pub fn silence(&mut self, number: u16) -> Vec<(Incarnation, u16)> {
        let mut heirs = Vec::new();
        for ((_, life), spoke) in &mut self.lives {
            if spoke.len() > 1 && spoke.contains(&number) {
                spoke.retain(|n| *n != number);
                heirs.extend(spoke.first().map(|heir| (*life, *heir)));
            }
        }
        heirs
    }

    /// A report with the numbers of those whom its author means: of several that live under an
    /// id one in its component that speaks.
    #[must_use]
    pub fn meant_in(&mut self, by: u16, report: &Report, graph: &Graph) -> Report {
        match *report {
            Report::Membership {
                peer,
                incarnation,
                status,
            } if self.is_ambiguous(peer.0) => Report::Membership {
                peer: PeerId(self.meant((by, peer.0), incarnation, |n| graph.joined(by, n))),
                incarnation,
                status,
            },
            ref other => other.clone(),
        }
    }

    /// What a peer believes, of those whom it means.
    pub fn rename(&mut self, by: u16, view: &mut Beliefs, graph: &Graph) {
        for id in self.ambiguous() {
            if let Some((life, status)) = view.peers.remove(&PeerId(id)) {
                let meant = PeerId(self.meant((by, id), life, |n| graph.joined(by, n)));
                view.peers.insert(meant, (life, status));
            }
        }
    }

    /// Who is meant by an id in a life: the first one that spoke in it of those in reach; else
    /// of whom that was said last, since it is that one who went out of reach; else the first one
    /// that spoke in it, else the one whose number it is.
    fn meant(
        &mut self,
        (by, id): (u16, u16),
        life: Incarnation,
        in_reach: impl Fn(u16) -> bool,
    ) -> u16 {
        let spoke = self.lives.get(&(id, life)).map_or(&[][..], Vec::as_slice);
        if let Some(near) = spoke.iter().find(|n| in_reach(**n)) {
            self.heard.insert((by, id), *near);
            return *near;
        }
        let before = self.heard.get(&(by, id)).filter(|n| spoke.contains(n));
        before.or(spoke.first()).copied().unwrap_or(id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_goes_out_of_reach_is_who_was_heard_last() {
        let mut names = Names::new(Twins::from_iter([(9, 3)]));
        names.speaks(3, 1);
        names.speaks(9, 1);
        assert_eq!(names.meant((1, 3), 1, |_| false), 3, "nobody was heard yet");
        assert_eq!(names.meant((1, 3), 1, |n| n == 9), 9);
        assert_eq!(names.meant((1, 3), 1, |_| false), 9);
        assert_eq!(names.meant((2, 3), 1, |_| false), 3, "by another");
        assert_eq!(names.meant((1, 3), 1, |n| n == 3), 3);
    }

    #[test]
    fn an_id_in_a_life_means_who_spoke_in_it_and_is_in_reach() {
        let mut names = Names::new(Twins::from_iter([(9, 3)]));
        for (number, life) in [(3, 1), (9, 1), (9, 2), (4, 1)] {
            names.speaks(number, life);
        }
        assert_eq!(names.ambiguous(), BTreeSet::from([3]));
        assert_eq!(names.meant((1, 3), 1, |n| n == 3), 3);
        assert_eq!(names.meant((1, 3), 1, |n| n == 9), 9);
        assert_eq!(
            names.meant((1, 3), 2, |n| n == 3),
            9,
            "nobody else spoke in it"
        );
        assert_eq!(names.meant((1, 3), 5, |_| true), 3);
        assert_eq!(names.meant((1, 4), 1, |_| true), 4);
        assert_eq!(names.meant((1, 3), 1, |_| true), 3, "the first one");
        assert_eq!(names.silence(3), [(1, 9)]);
        assert_eq!(names.meant((1, 3), 1, |n| n == 3), 9);
        assert!(names.silence(9).is_empty(), "nobody else is left");
    }
}
