//! The consensus-based bundle algorithm as it was published, to compare with: Choi, Brunet
//! and How, *Consensus-based decentralized auctions for robust task allocation*, IEEE Trans.
//! Robot. 25 (4), 2009, <https://doi.org/10.1109/TRO.2009.2022423>.
//!
//! Each agent knows for each task the highest bid and who made it, and for each other agent
//! how new its knowledge of it is. It adds tasks to the end of its bundle while it bids more
//! than anybody known, takes over what it hears by the table of the paper, and releases what
//! it was outbid for with all that it added after.

use super::channel::Agent;
use super::scene::Instance;
use skein_peer::PeerId;
use skein_peer::protocol::auction::flown::FlownTime;
use skein_peer::protocol::auction::settlement::{Tasks, best_insertion};
use skein_peer::wire::tasks::{Offer, TaskId};
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

/// The highest bid known for a task, and whose it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Winning {
    bid: u32,
    who: Option<PeerId>,
}

impl Winning {
    /// Whether it goes before another bid: of equal ones the lower id.
    fn beats(self, other: Self) -> bool {
        let key = |w: Self| (w.bid, std::cmp::Reverse(w.who.map_or(u16::MAX, |p| p.0)));
        key(self) > key(other)
    }
}

/// What one says in a round: all that it knows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Said {
    winning: BTreeMap<TaskId, Winning>,
    /// The round in which the newest word of each agent left it.
    stamps: BTreeMap<PeerId, u32>,
}

/// What to do with what another knows of a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Action {
    Update,
    Leave,
    Reset,
}

/// The table of the paper: `me` hears from `sender`.
fn decide(
    (me, sender): (PeerId, PeerId),
    (theirs, mine): (Winning, Winning),
    newer: impl Fn(PeerId) -> bool,
    older: impl Fn(PeerId) -> bool,
) -> Action {
    use Action::{Leave, Reset, Update};
    let update_if = |yes: bool| if yes { Update } else { Leave };
    match (theirs.who, mine.who) {
        // The sender believes that it is the sender's.
        (Some(k), mine_who) if k == sender => match mine_who {
            Some(i) if i == me => update_if(theirs.beats(mine)),
            Some(m) if m != sender => update_if(newer(m) || theirs.beats(mine)),
            _ => Update,
        },
        // The sender believes that it is the listener's.
        (Some(i), mine_who) if i == me => match mine_who {
            Some(k) if k == sender => Reset,
            Some(m) if m != me && newer(m) => Reset,
            _ => Leave,
        },
        // The sender believes that it is another's.
        (Some(m), mine_who) => match mine_who {
            Some(i) if i == me => update_if(newer(m) && theirs.beats(mine)),
            Some(k) if k == sender => {
                if newer(m) {
                    Update
                } else {
                    Reset
                }
            }
            Some(n) if n != m => {
                if newer(m) && (newer(n) || theirs.beats(mine)) {
                    Update
                } else if newer(n) && older(m) {
                    Reset
                } else {
                    Leave
                }
            }
            _ => update_if(newer(m)),
        },
        // The sender believes that it is nobody's.
        (None, mine_who) => match mine_who {
            Some(k) if k == sender => Update,
            Some(m) if m != me => update_if(newer(m)),
            _ => Leave,
        },
    }
}

/// An agent.
#[derive(Clone)]
pub(super) struct Cbba {
    id: PeerId,
    offer: Offer,
    tasks: Rc<Tasks>,
    know: Said,
    /// In the order in which tasks were added.
    bundle: Vec<TaskId>,
    /// In the order in which they are flown.
    path: Vec<TaskId>,
    round: u32,
}

impl Cbba {
    fn winning(&self, task: TaskId) -> Winning {
        self.know.winning.get(&task).copied().unwrap_or_default()
    }

    /// Adds tasks while there is one for which it bids more than anybody known.
    fn build(&mut self) {
        loop {
            let mut best: Option<(Winning, TaskId, usize)> = None;
            for id in self.tasks.keys().filter(|t| !self.path.contains(t)) {
                let order = (self.id, &self.offer);
                let world = (&*self.tasks, &FlownTime);
                let Some((gain, index)) = best_insertion(order, &self.path, *id, world) else {
                    continue;
                };
                let mine = Winning {
                    bid: u32::try_from(gain.max(0)).unwrap_or(u32::MAX),
                    who: Some(self.id),
                };
                let wins = mine.bid > 0 && mine.beats(self.winning(*id));
                if wins && best.is_none_or(|(b, ..)| mine.bid > b.bid) {
                    best = Some((mine, *id, index));
                }
            }
            let Some((mine, task, index)) = best else {
                return;
            };
            self.bundle.push(task);
            self.path.insert(index, task);
            self.know.winning.insert(task, mine);
        }
    }

    /// Releases the first task that another won, and all that was added after it.
    fn release(&mut self) {
        let lost = |t: &TaskId| self.winning(*t).who != Some(self.id);
        let Some(first) = self.bundle.iter().position(lost) else {
            return;
        };
        for task in self.bundle.split_off(first) {
            if self.winning(task).who == Some(self.id) {
                self.know.winning.insert(task, Winning::default());
            }
            self.path.retain(|t| *t != task);
        }
    }
}

/// Bytes of a number in CBOR.
fn number_bytes(value: u32) -> usize {
    match value {
        0..=23 => 1,
        24..=255 => 2,
        256..=65_535 => 3,
        _ => 5,
    }
}

impl Agent for Cbba {
    type Said = Said;

    fn all(instance: &Instance, _: u16) -> Vec<Self> {
        let tasks = Rc::new(instance.tasks.clone());
        let agent = |(id, offer): &(PeerId, Offer)| Self {
            id: *id,
            offer: *offer,
            tasks: Rc::clone(&tasks),
            know: Said::default(),
            bundle: Vec::new(),
            path: Vec::new(),
            round: 0,
        };
        instance.uavs.iter().map(agent).collect()
    }

    /// The published algorithm does not ask who lives.
    fn believe(&mut self, _: &BTreeSet<PeerId>) {}

    fn say(&mut self) -> (Said, usize) {
        self.round += 1;
        self.know.stamps.insert(self.id, self.round);
        // Bids and winners of all tasks in their order, and a stamp for each agent.
        let tasks: usize = self
            .tasks
            .keys()
            .map(|t| {
                let w = self.winning(*t);
                number_bytes(w.bid) + number_bytes(w.who.map_or(0, |p| u32::from(p.0)))
            })
            .sum();
        let stamp =
            |(id, round): (&PeerId, &u32)| number_bytes(u32::from(id.0)) + number_bytes(*round);
        let stamps: usize = self.know.stamps.iter().map(stamp).sum();
        (self.know.clone(), tasks + stamps)
    }

    fn hear(&mut self, from: PeerId, said: &Said) {
        let stamp = |of: &Said, who: PeerId| of.stamps.get(&who).copied().unwrap_or(0);
        let mut next = self.know.clone();
        for task in self.tasks.keys() {
            let theirs = said.winning.get(task).copied().unwrap_or_default();
            let newer = |who| stamp(said, who) > stamp(&self.know, who);
            let older = |who| stamp(&self.know, who) > stamp(said, who);
            let both = (theirs, self.winning(*task));
            match decide((self.id, from), both, newer, older) {
                Action::Update => {
                    next.winning.insert(*task, theirs);
                }
                Action::Reset => {
                    next.winning.insert(*task, Winning::default());
                }
                Action::Leave => {}
            }
        }
        for (who, round) in &said.stamps {
            let known = next.stamps.entry(*who).or_default();
            if *who != self.id {
                *known = (*known).max(*round);
            }
        }
        self.know = next;
    }

    fn think(&mut self) {
        self.release();
        self.build();
    }

    fn act(&mut self) {}

    fn order(&self) -> Vec<TaskId> {
        self.path.clone()
    }

    fn agree(agents: &[&Self]) -> bool {
        let Some(first) = agents.first() else {
            return true;
        };
        agents.iter().all(|a| {
            let same = a.tasks.keys().all(|t| a.winning(*t) == first.winning(*t));
            let mut next = (*a).clone();
            next.think();
            same && next.know == a.know && next.path == a.path
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Winners by name: `i` hears from `k`; `m` and `n` are others.
    fn who(name: char) -> Option<PeerId> {
        match name {
            'i' => Some(PeerId(1)),
            'k' => Some(PeerId(2)),
            'm' => Some(PeerId(3)),
            'n' => Some(PeerId(4)),
            _ => None,
        }
    }

    /// What happens, by whether the sender bids more and of whom its word is newer.
    fn action(theirs: char, mine: char, more: bool, newer: &str, older: &str) -> Action {
        let winning = |name, bid| Winning {
            bid,
            who: who(name),
        };
        let (y_k, y_i) = if more { (2, 1) } else { (1, 2) };
        let is = |names: &str, p: PeerId| names.chars().any(|c| who(c) == Some(p));
        decide(
            (PeerId(1), PeerId(2)),
            (winning(theirs, y_k), winning(mine, y_i)),
            |p| is(newer, p),
            |p| is(older, p),
        )
    }

    #[test]
    fn the_table_is_the_one_of_the_paper() {
        use Action::{Leave, Reset, Update};
        for (theirs, mine, more, newer, older, expected) in [
            ('k', 'i', true, "", "", Update),
            ('k', 'i', false, "", "", Leave),
            ('k', 'k', false, "", "", Update),
            ('k', 'm', false, "m", "", Update),
            ('k', 'm', true, "", "", Update),
            ('k', 'm', false, "", "", Leave),
            ('k', '-', false, "", "", Update),
            ('i', 'i', true, "", "", Leave),
            ('i', 'k', false, "", "", Reset),
            ('i', 'm', false, "m", "", Reset),
            ('i', 'm', true, "", "", Leave),
            ('i', '-', true, "", "", Leave),
            ('m', 'i', true, "m", "", Update),
            ('m', 'i', false, "m", "", Leave),
            ('m', 'i', true, "", "", Leave),
            ('m', 'k', false, "m", "", Update),
            ('m', 'k', true, "", "", Reset),
            ('m', 'm', false, "m", "", Update),
            ('m', 'm', true, "", "", Leave),
            ('m', 'n', false, "mn", "", Update),
            ('m', 'n', true, "m", "", Update),
            ('m', 'n', false, "m", "", Leave),
            ('m', 'n', true, "n", "m", Reset),
            ('m', 'n', true, "n", "", Leave),
            ('m', '-', false, "m", "", Update),
            ('m', '-', true, "", "", Leave),
            ('-', 'i', true, "", "", Leave),
            ('-', 'k', false, "", "", Update),
            ('-', 'm', false, "m", "", Update),
            ('-', 'm', true, "", "", Leave),
            ('-', '-', true, "m", "", Leave),
        ] {
            let got = action(theirs, mine, more, newer, older);
            assert_eq!(got, expected, "{theirs} {mine} {more} {newer} {older}");
        }
    }
}
