//! What may happen to the small swarm, and what follows. What must hold whatever
//! happens is in `model.rs`.

use super::world::{Node, World};
use super::{Case, Event, MORTAL, PEERS};
use skein_flight::coverage::ring::Direction;
use skein_peer::cells::CellSet;
use skein_peer::protocol::rounds::{HeardBid, order_of};
use skein_peer::wire::message::{Bid, Claim, Member};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// One step of the swarm; peers are named by their place.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Action {
    Claim(usize, Member, u32, Arc<Claim>),
    Bid(usize, Member, Arc<Bid>),
    Learn(usize, u16),
    Start { who: usize, informed: bool },
    Decide(usize),
    Fly(usize),
    Take(usize),
    Halve(usize, u16),
    Expire(usize),
    Down(usize, u16),
    Up(usize, u16),
    Crash(usize),
    Restart(usize),
    Heal,
}

impl Case {
    pub(super) fn meet(&self, event: Event) {
        self.met[event as usize].fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn first(&self) -> World {
        let mut w = World {
            nodes: (1..=PEERS)
                .map(|id| Some(Arc::new(Node::born(self.cells, id, 1))))
                .collect(),
            lives: vec![1; usize::from(PEERS)],
            claims: BTreeMap::new(),
            bids: Vec::new(),
            flown: CellSet::new(self.cells),
            split: false,
            crashes: 0,
            restarts: 0,
            suspicions: 0,
            gap: None,
            sunk: None,
        };
        for i in 0..w.nodes.len() {
            w.act(i, |n| {
                n.live = (1..=PEERS)
                    .filter(|id| *id != n.me.id)
                    .map(|id| (id, 1))
                    .collect()
            });
        }
        if self.divided {
            for i in 0..w.nodes.len() {
                let bid = w.act(i, Node::start).flatten();
                w.speak(i, bid);
            }
            self.all_hear(&mut w);
            self.all_hear(&mut w);
        }
        if self.begins_split {
            w.split = true;
            for i in 0..w.nodes.len() {
                w.act(i, |n| {
                    n.live.retain(|id, _| (*id == PEERS) == (n.me.id == PEERS))
                });
            }
        }
        w.tidy(self.restarts > 0);
        w
    }

    fn all_hear(&self, w: &mut World) {
        for i in 0..w.nodes.len() {
            for (author, _, s) in w.bids.clone() {
                self.hear_bid(w, i, author, &s);
            }
            for (author, versions) in w.claims.clone() {
                for (seq, claim) in versions {
                    self.hear_claim(w, i, author, seq, &claim);
                }
            }
            w.publish(i, self.versions);
        }
    }

    fn hear_claim(&self, w: &mut World, i: usize, author: Member, seq: u32, claim: &Claim) {
        w.act(i, |n| {
            if n.live
                .get(&author.id)
                .is_some_and(|believed| *believed > author.incarnation)
            {
                self.meet(Event::OldLife);
            }
            n.sections
                .hear(author.id, author.incarnation, seq, claim.clone());
            self.settle(n);
        });
    }

    fn settle(&self, n: &mut Node) {
        let (plan, held) = (n.sections.plan().len(), n.sections.held().len());
        n.sections.settle(&n.live);
        if n.sections.plan().len() < plan {
            self.meet(Event::Yielded);
        }
        if n.sections.held().len() < held {
            self.meet(Event::Released);
        }
    }

    fn hear_bid(&self, w: &mut World, i: usize, author: Member, s: &Bid) {
        let bid = w.act(i, |n| {
            let was_open = n.rounds.open().is_some();
            match n.rounds.hear(author, s) {
                HeardBid::BidWanted => {
                    if was_open {
                        self.meet(Event::Abandoned);
                    }
                    n.bid()
                }
                HeardBid::Added => {
                    self.decide(n);
                    None
                }
                HeardBid::Nothing | HeardBid::Refused(_) => None,
            }
        });
        w.speak(i, bid.flatten());
    }

    fn decide(&self, n: &mut Node) {
        if n.rounds
            .complete()
            .is_some_and(|(_, open)| open.bids.len() < usize::from(PEERS))
        {
            self.meet(Event::DecidedByFew);
        }
        n.decide();
        self.settle(n);
    }

    fn take(&self, n: &mut Node, cells: &[(u16, Direction)]) {
        n.sections.append(&n.sections.taken(cells));
        self.settle(n);
    }

    /// What a peer may do by itself.
    pub(super) fn own_actions(&self, w: &World, i: usize, n: &Node, actions: &mut Vec<Action>) {
        let section = &n.sections;
        let top = section
            .plan()
            .iter()
            .map(|p| p.stamp.take)
            .max()
            .unwrap_or(0);
        let orphans = section.orphans(&n.live);
        if n.rounds.complete().is_some() {
            actions.push(Action::Decide(i));
        } else if !section.complete() && (self.late || w.split >= self.begins_split) {
            let others = w.alive().filter(|o| w.reach(o.me.id, n.me.id));
            let heard = others.map(|o| o.rounds.counter()).max().unwrap_or(0);
            if n.rounds.counter() < self.rounds {
                actions.push(Action::Start {
                    who: i,
                    informed: false,
                });
            }
            if heard > n.rounds.counter() && heard < self.rounds {
                actions.push(Action::Start {
                    who: i,
                    informed: true,
                });
            }
        }
        if w.flown.count() < self.flights && !section.plan().is_empty() {
            actions.push(Action::Fly(i));
        }
        if top < self.takes && !orphans.is_empty() {
            actions.push(Action::Take(i));
        }
        if self.impatient && top < self.takes && section.plan().is_empty() && orphans.is_empty() {
            let owners = n.live.keys().filter(|id| !section.plan_of(**id).is_empty());
            actions.extend(owners.map(|id| Action::Halve(i, *id)));
        }
        if self.impatient && !section.held().is_empty() {
            actions.push(Action::Expire(i));
        }
    }

    pub(super) fn messages(&self, w: &World, i: usize, n: &Node, actions: &mut Vec<Action>) {
        for (author, versions) in &w.claims {
            if author.id == n.me.id || !w.reach(author.id, n.me.id) {
                continue;
            }
            let known = n
                .sections
                .heard()
                .get(&author.id)
                .map(|h| (h.incarnation, h.seq));
            for (seq, claim) in versions {
                if known < Some((author.incarnation, *seq)) {
                    actions.push(Action::Claim(i, *author, *seq, Arc::clone(claim)));
                }
            }
        }
        for (author, order, s) in &w.bids {
            if !w.reach(author.id, n.me.id) || author.id == n.me.id {
                continue;
            }
            if World::wants(n, *author, s, *order) {
                actions.push(Action::Bid(i, *author, Arc::clone(s)));
            } else {
                let mut after = n.rounds.clone();
                after.hear(*author, s);
                assert!(after == n.rounds, "what is not wanted changes nothing");
                if n.rounds.open().is_some_and(|o| order_of(&o.round) > *order) {
                    self.meet(Event::StaleSnapshot);
                }
            }
        }
        for c in w
            .flown
            .iter()
            .filter(|c| !n.sections.covered().contains(*c))
        {
            if !w.split
                || w.alive()
                    .any(|o| w.reach(o.me.id, n.me.id) && o.sections.covered().contains(c))
            {
                actions.push(Action::Learn(i, c));
            }
        }
    }

    pub(super) fn beliefs(&self, w: &World, i: usize, n: &Node, actions: &mut Vec<Action>) {
        for id in (1..=PEERS).filter(|id| *id != n.me.id) {
            let truth = w.nodes[usize::from(id) - 1]
                .as_ref()
                .map(|o| o.me.incarnation);
            let seen = truth.filter(|_| w.reach(id, n.me.id));
            let believed = n.live.get(&id).copied();
            if believed.is_some()
                && (seen.is_none() || (id == MORTAL && w.suspicions < self.suspicions))
            {
                actions.push(Action::Down(i, id));
            }
            if seen.is_some() && believed != seen {
                actions.push(Action::Up(i, id));
            }
        }
    }

    /// Carries out an action; returns who acted.
    pub(super) fn step(&self, w: &mut World, action: Action) -> Option<usize> {
        let actor = match action {
            Action::Claim(i, author, seq, claim) => {
                self.hear_claim(w, i, author, seq, &claim);
                i
            }
            Action::Bid(i, author, s) => {
                self.hear_bid(w, i, author, &s);
                i
            }
            Action::Learn(i, c) => {
                w.act(i, |n| n.sections.cover(&CellSet::of(self.cells, [c])));
                i
            }
            Action::Start { who, informed } => {
                let me = w.nodes[who].as_ref()?.me.id;
                let heard = w
                    .alive()
                    .filter(|o| w.reach(o.me.id, me))
                    .map(|o| o.rounds.counter())
                    .max()?;
                let bid = w.act(who, |n| {
                    n.rounds.hear_counter(if informed { heard } else { 0 });
                    n.start()
                });
                w.speak(who, bid.flatten());
                who
            }
            Action::Decide(i) => {
                w.act(i, |n| self.decide(n));
                i
            }
            Action::Fly(i) => {
                let c = w.nodes[i].as_ref()?.sections.plan().first()?.cell;
                w.flown.insert(c);
                w.act(i, |n| n.sections.cover(&CellSet::of(self.cells, [c])));
                i
            }
            Action::Take(i) => {
                self.meet(Event::Taken);
                w.act(i, |n| {
                    let orphans: Vec<(u16, Direction)> = n
                        .sections
                        .orphans(&n.live)
                        .iter()
                        .map(|c| (c, Direction::Forward))
                        .collect();
                    self.take(n, &orphans);
                });
                i
            }
            Action::Halve(i, owner) => {
                self.meet(Event::Halved);
                w.act(i, |n| {
                    let plan = n.sections.plan_of(owner);
                    let far: Vec<(u16, Direction)> = plan
                        .iter()
                        .skip(plan.len() / 2)
                        .map(|p| (p.cell, Direction::Backward))
                        .collect();
                    self.take(n, &far);
                });
                i
            }
            Action::Expire(i) => {
                self.meet(Event::Expired);
                w.act(i, |n| n.sections.expire_held());
                i
            }
            other => return self.fate(w, &other),
        };
        Some(actor)
    }

    /// What befalls the swarm, and what is believed of it.
    fn fate(&self, w: &mut World, action: &Action) -> Option<usize> {
        match *action {
            Action::Down(i, id) => {
                let me = w.nodes[i].as_ref()?.me.id;
                if w.nodes[usize::from(id) - 1].is_some() && w.reach(id, me) {
                    w.suspicions += 1;
                }
                w.act(i, |n| n.live.remove(&id));
            }
            Action::Up(i, id) => {
                let incarnation = w.nodes[usize::from(id) - 1].as_ref()?.me.incarnation;
                w.act(i, |n| {
                    n.live.insert(id, incarnation);
                    self.settle(n);
                });
                return Some(i);
            }
            Action::Crash(i) => {
                w.nodes[i] = None;
                w.crashes += 1;
            }
            Action::Restart(i) => {
                w.lives[i] += 1;
                w.restarts += 1;
                let id = u16::try_from(i + 1).unwrap();
                w.nodes[i] = Some(Arc::new(Node::born(self.cells, id, w.lives[i])));
            }
            _ => w.split = false,
        }
        None
    }

    /// Whether hand-overs alone, without a death or an expiry, are what happened.
    pub(super) fn only_hand_overs(&self) -> bool {
        self.crashes == 0 && !self.impatient
    }
}
