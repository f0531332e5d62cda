//! What a state of the small swarm is: peers, messages on the air, covered cells; and
//! which states are one. What may happen to it is in `step.rs`.

use super::PEERS;
use skein_flight::coverage::ring::Direction;
use skein_peer::cells::CellSet;
use skein_peer::protocol::division::{adopted, commits_of};
use skein_peer::protocol::rounds::{HeardBid, RoundOrder, Rounds, order_of};
use skein_peer::protocol::sections::{LivePeers, Sections};
use skein_peer::wire::message::{Bid, CellRun, Claim, Epoch, Member, Stamp};
use std::collections::BTreeMap;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Node {
    pub(super) me: Member,
    pub(super) sections: Sections,
    pub(super) rounds: Rounds,
    /// What the failure detector says.
    pub(super) live: LivePeers,
    pub(super) seq: u32,
    pub(super) said: Claim,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) struct World {
    pub(super) nodes: Vec<Option<Arc<Node>>>,
    pub(super) lives: Vec<u32>,
    pub(super) claims: BTreeMap<Member, Vec<(u32, Arc<Claim>)>>,
    pub(super) bids: Vec<(Member, RoundOrder, Arc<Bid>)>,
    pub(super) flown: CellSet,
    pub(super) split: bool,
    pub(super) crashes: u8,
    pub(super) restarts: u8,
    pub(super) suspicions: u8,
    /// A cell that a hand-over lost.
    pub(super) gap: Option<u16>,
    /// A cell that a peer lists at a lower stamp than before.
    pub(super) sunk: Option<u16>,
}

/// Two states are one if no rule can tell them apart.
impl Hash for World {
    fn hash<H: Hasher>(&self, h: &mut H) {
        for n in &self.nodes {
            let Some(n) = n else {
                0_u8.hash(h);
                continue;
            };
            (n.me.incarnation, &n.rounds, &n.live).hash(h);
            hash_ownership(&n.sections, h);
            for (id, heard) in n.sections.heard() {
                let author = Member {
                    id: *id,
                    incarnation: heard.incarnation,
                };
                let newer = self
                    .claims
                    .get(&author)
                    .into_iter()
                    .flatten()
                    .filter(|c| c.0 > heard.seq)
                    .count();
                (id, heard.incarnation, &heard.claim, newer).hash(h);
            }
        }
        for (author, versions) in &self.claims {
            author.hash(h);
            for (_, claim) in versions {
                claim.hash(h);
            }
        }
        (&self.bids, &self.flown, &self.lives, self.gap, self.sunk).hash(h);
        (self.split, self.crashes, self.restarts, self.suspicions).hash(h);
    }
}

pub(super) fn hash_ownership<H: Hasher>(s: &Sections, h: &mut H) {
    (s.covered(), s.plan(), s.held(), s.epoch()).hash(h);
}

impl Node {
    pub(super) fn born(cells: u16, id: u16, incarnation: u32) -> Self {
        let me = Member { id, incarnation };
        Self {
            me,
            sections: Sections::new(id, cells, CellSet::new(cells)),
            rounds: Rounds::new(me, 0),
            live: LivePeers::new(),
            seq: 0,
            said: Claim::default(),
        }
    }

    /// The claim as others will read it.
    pub(super) fn claim(&self) -> Claim {
        Claim {
            epoch: Epoch::default(),
            ..self.sections.claim(0, 0, 0)
        }
    }

    /// A bid for the open round: the first planned cell is committed.
    pub(super) fn bid(&mut self) -> Option<Arc<Bid>> {
        let round = self.rounds.open()?.round.clone();
        let commits = self.sections.plan().iter().take(1).map(|p| CellRun {
            first: p.cell,
            count: 1,
        });
        let bid = Bid {
            round,
            anchor: 0,
            backward: false,
            release_ms: 0,
            speed_mmps: 1,
            turn_ms: 0,
            endurance_ms: 0,
            covered: self.sections.covered().encode_rle(None),
            commits: commits.collect(),
            off_loop: Vec::new(),
            eta_ms: 0,
            calm: false,
            progressed: false,
        };
        self.rounds.bid(bid.clone()).then(|| Arc::new(bid))
    }

    /// Opens a round of all that are believed alive.
    pub(super) fn start(&mut self) -> Option<Arc<Bid>> {
        if self.rounds.open().is_some() {
            self.rounds.give_up();
        }
        let mut members: Vec<Member> = self
            .live
            .iter()
            .map(|(id, incarnation)| Member {
                id: *id,
                incarnation: *incarnation,
            })
            .collect();
        members.push(self.me);
        self.rounds.start(members, 0, 0, true, 0);
        self.bid()
    }

    /// What a complete round decides: the open cells dealt out in runs, to other
    /// members in each round, so that as many cells as can be change hands.
    pub(super) fn decide(&mut self) {
        let Some((epoch, open)) = self.rounds.complete() else {
            return;
        };
        let n = self.sections.cells();
        let mut free = CellSet::full(n);
        for s in open.bids.values() {
            free.subtract(&CellSet::decode_rle(n, &s.covered).unwrap());
            free.subtract(&commits_of(s, n));
        }
        let members: Vec<u16> = open.bids.keys().copied().collect();
        let mine = members.iter().position(|m| *m == self.me.id).unwrap();
        let place = (mine + open.round.counter as usize) % members.len();
        let share = usize::from(free.count()).div_ceil(members.len());
        let section: Vec<(u16, Direction)> = free
            .iter()
            .skip(place * share)
            .take(share)
            .map(|c| (c, Direction::Forward))
            .collect();
        let plan = adopted(&self.sections, epoch, &open.bids[&self.me.id], &section);
        self.rounds.close();
        self.sections.install(epoch, &plan);
    }

    /// By what right this peer lists a cell.
    pub(super) fn stamp(&self, cell: u16) -> Option<Stamp> {
        let planned = self
            .sections
            .plan()
            .iter()
            .find(|p| p.cell == cell)
            .map(|p| p.stamp);
        planned.or_else(|| self.sections.held().get(&cell).copied())
    }

    pub(super) fn plans(&self, cell: u16) -> bool {
        self.sections.plan().iter().any(|p| p.cell == cell)
    }

    pub(super) fn lists(&self, cell: u16) -> bool {
        self.plans(cell) || self.sections.held().contains_key(&cell)
    }
}

impl World {
    pub(super) fn alive(&self) -> impl Iterator<Item = &Arc<Node>> {
        self.nodes.iter().flatten()
    }

    /// The partition cuts off the highest id.
    pub(super) fn reach(&self, a: u16, b: u16) -> bool {
        !self.split || (a == PEERS) == (b == PEERS)
    }

    pub(super) fn lister(&self, cell: u16) -> bool {
        self.alive().any(|n| n.lists(cell))
    }

    pub(super) fn act<T>(&mut self, i: usize, what: impl FnOnce(&mut Node) -> T) -> Option<T> {
        self.nodes[i].as_mut().map(|n| what(Arc::make_mut(n)))
    }

    /// Publishes the claim of a peer, if it changed.
    pub(super) fn publish(&mut self, i: usize, keep: usize) {
        let said = self.act(i, |n| {
            let claim = n.claim();
            (claim != n.said).then(|| {
                n.seq += 1;
                n.said = claim.clone();
                (n.me, n.seq, Arc::new(claim))
            })
        });
        if let Some(Some((me, seq, claim))) = said {
            let versions = self.claims.entry(me).or_default();
            versions.push((seq, claim));
            if versions.len() > keep {
                versions.remove(0);
            }
        }
    }

    pub(super) fn speak(&mut self, i: usize, bid: Option<Arc<Bid>>) {
        if let (Some(bid), Some(n)) = (bid, &self.nodes[i]) {
            self.bids.push((n.me, order_of(&bid.round), bid));
            self.bids
                .sort_by_key(|(author, order, _)| (*author, *order));
        }
    }

    /// Whether a bid may still change something for a peer.
    pub(super) fn wants(n: &Node, author: Member, s: &Bid, order: RoundOrder) -> bool {
        if author.id == n.me.id {
            return false;
        }
        if !s.round.members.contains(&n.me) || !s.round.members.contains(&author) {
            return n.rounds.counter() < s.round.counter;
        }
        match n.rounds.open() {
            Some(open) if order_of(&open.round) >= order => {
                order_of(&open.round) == order && !open.bids.contains_key(&author.id)
            }
            _ => {
                let mut rounds = n.rounds.clone();
                rounds.hear(author, s) != HeardBid::Nothing || rounds.counter() > n.rounds.counter()
            }
        }
    }

    /// Takes off the air what nobody alive or yet to be born could use.
    pub(super) fn tidy(&mut self, births: bool) {
        let nodes: Vec<Arc<Node>> = self.alive().cloned().collect();
        self.bids
            .retain(|(author, order, s)| nodes.iter().any(|n| Self::wants(n, *author, s, *order)));
        for (author, versions) in &mut self.claims {
            let last = versions.last().map(|v| v.0);
            versions.retain(|(seq, _)| {
                let new = |n: &Arc<Node>| {
                    let heard = n.sections.heard().get(&author.id);
                    n.me.id != author.id
                        && heard.is_none_or(|h| (h.incarnation, h.seq) < (author.incarnation, *seq))
                };
                (births && Some(*seq) == last) || nodes.iter().any(new)
            });
        }
        self.claims.retain(|_, versions| !versions.is_empty());
    }
}
