//! The auction of a peer in the channel of rounds, and what it passes on: its versions in
//! each round, and the bundles that a neighbour was last heard to lack.

use super::channel::Agent;
use super::scene::Instance;
use skein_peer::PeerId;
use skein_peer::protocol::auction::flown::FlownTime;
use skein_peer::protocol::auction::settlement::{Problem, Settlement, Settler, Tasks, settle};
use skein_peer::protocol::auction::{Auction, Event, Version};
use skein_peer::wire::codec::{Body, encode_body};
use skein_peer::wire::tasks::{Bundle, Progress, TaskId};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

/// Bytes of an envelope in the first life: author, life, number, kind, subject, heads.
const ENVELOPE_BYTES: usize = 14;

/// Bytes by which a version is told: peer, life, number.
const VERSION_BYTES: usize = 6;

/// What one says in a round.
pub(super) struct Said {
    versions: BTreeMap<PeerId, Version>,
    bundles: Vec<(PeerId, Version, Rc<Bundle>)>,
}

/// What was settled already: whoever knows the same gets the same, so that it is computed
/// once for all peers of a run.
#[derive(Default)]
struct Remembered(RefCell<BTreeMap<Problem, Settlement>>);

impl Settler for Remembered {
    fn settle(&self, problem: &Problem, tasks: &Tasks) -> Settlement {
        if let Some(known) = self.0.borrow().get(problem) {
            return known.clone();
        }
        // All tasks of a run are known from the beginning and stay as they are.
        let settled = settle(problem, tasks, &FlownTime);
        self.0.borrow_mut().insert(problem.clone(), settled.clone());
        settled
    }
}

/// A peer.
pub(super) struct Registers {
    id: PeerId,
    auction: Auction,
    settler: Rc<Remembered>,
    /// Bundles of all, its own included.
    held: BTreeMap<PeerId, (Version, Rc<Bundle>, usize)>,
    /// What neighbours had when they were heard last.
    neighbours: BTreeMap<PeerId, BTreeMap<PeerId, Version>>,
    events: Vec<Event>,
    hops: u8,
}

fn bytes_of(bundle: &Bundle) -> usize {
    ENVELOPE_BYTES + encode_body(&Body::Bundle(bundle.clone())).len()
}

impl Registers {
    fn hold(&mut self, peer: PeerId, version: Version, bundle: Rc<Bundle>) -> bool {
        let newer = self.held.get(&peer).is_none_or(|(v, ..)| version > *v);
        if newer {
            let bytes = bytes_of(&bundle);
            self.held.insert(peer, (version, bundle, bytes));
        }
        newer
    }
}

impl Agent for Registers {
    type Said = Said;

    fn all(instance: &Instance, hops: u16) -> Vec<Self> {
        let settler = Rc::new(Remembered::default());
        let peer = |(id, offer): &(PeerId, _)| {
            let tasks = instance.tasks.iter();
            Self {
                id: *id,
                auction: Auction::new(*id, 1, *offer),
                settler: Rc::clone(&settler),
                held: BTreeMap::new(),
                neighbours: BTreeMap::new(),
                events: tasks
                    .map(|(t, task)| Event::Task(*t, task.clone()))
                    .collect(),
                hops: u8::try_from(hops).unwrap_or(u8::MAX),
            }
        };
        instance.uavs.iter().map(peer).collect()
    }

    fn believe(&mut self, live: &BTreeSet<PeerId>) {
        self.events.push(Event::Live(live.clone()));
    }

    fn say(&mut self) -> (Said, usize) {
        let versions: BTreeMap<PeerId, Version> =
            self.held.iter().map(|(id, (v, ..))| (*id, *v)).collect();
        let lacks = |id: &PeerId, version: &Version| {
            let mut neighbours = self.neighbours.values();
            self.neighbours.is_empty()
                || neighbours.any(|has| has.get(id).is_none_or(|v| v < version))
        };
        let wanted = self.held.iter().filter(|(id, (v, ..))| lacks(id, v));
        let bytes: usize = wanted.clone().map(|(_, (_, _, bytes))| bytes).sum();
        let bundles = wanted.map(|(id, (v, b, _))| (*id, *v, Rc::clone(b)));
        let said = Said {
            bundles: bundles.collect(),
            versions,
        };
        let told = said.versions.len() * VERSION_BYTES;
        (said, told + bytes)
    }

    fn hear(&mut self, from: PeerId, said: &Said) {
        self.neighbours.insert(from, said.versions.clone());
        for (author, version, bundle) in &said.bundles {
            if *author != self.id && self.hold(*author, *version, Rc::clone(bundle)) {
                let bundle = Bundle::clone(bundle);
                self.events.push(Event::Heard(*author, *version, bundle));
            }
        }
    }

    fn think(&mut self) {
        let period = Event::Period(self.hops);
        let events = self.events.drain(..).chain([period]);
        let _ = self.auction.handle(events, &*self.settler);
        let (version, bundle) = self.auction.bundle();
        let bundle = Rc::new(bundle.clone());
        self.hold(self.id, version, bundle);
    }

    fn act(&mut self) {
        self.events.push(Event::Free);
    }

    fn order(&self) -> Vec<TaskId> {
        let held = self.auction.held().iter();
        let held = held.filter(|t| t.progress != Progress::Done);
        held.map(|t| t.task).collect()
    }

    fn agree(agents: &[&Self]) -> bool {
        let current: BTreeMap<PeerId, Version> = agents
            .iter()
            .map(|a| (a.id, a.auction.bundle().0))
            .collect();
        agents.iter().all(|a| {
            let known = |(id, version): (&PeerId, &Version)| {
                a.held.get(id).is_some_and(|(v, ..)| v == version)
            };
            let settled = a.auction.is_agreed() && !a.auction.has_more_to_say();
            current.iter().all(known) && settled && a.events.is_empty()
        })
    }
}
