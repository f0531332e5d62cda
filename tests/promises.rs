//! The rule by which promised motions change (docs/protocol.md §11), searched exhaustively:
//! three UAVs, some ways each, and [`Promises`] as it flies. Geometry is a table of who
//! conflicts with whom.
//!
//! Statements stay on the air, from where any may reach anybody at any time, in any order,
//! again or never: that is loss, delay, reordering and repetition. Whoever crashes says
//! nothing more and hears nothing more, which is one of the ways in which messages get lost.
//! Time is left out: a proposal may be made, agreed on or withdrawn at any moment. What everybody
//! has heard, or something newer of its author, is taken off the air: nobody would heed it.
//!
//! These bounds are real: so many proposals of each UAV, and of each author's statements the
//! three newest can still arrive.

use skein_peer::PeerId;
use skein_peer::protocol::promises::{Promises, Statement};
use stateright::{Checker, Model, Property};
use std::cell::RefCell;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Deref;
use std::sync::Arc;

/// A motion: whose it is, and which of its ways. Way 0 is in force at the beginning.
type Way = (u16, u8);

/// UAVs of the largest search.
const UAVS_MOST: usize = 3;

/// Statements of one author that can still arrive.
const ON_AIR: usize = 3;

/// What one search may do.
struct Case {
    uavs: u16,
    /// Ways of each, that in force at the beginning included.
    ways: u8,
    /// Proposals that each may make.
    proposals: u8,
    /// Pairs that come too near to each other.
    conflicts: &'static [(Way, Way)],
    /// What must be met in some state: all on these ways.
    reached: &'static [u8],
}

impl Case {
    fn apart(&self, a: &Way, b: &Way) -> bool {
        let meets = |p: &(Way, Way)| *p == (*a, *b) || *p == (*b, *a);
        !self.conflicts.iter().any(meets)
    }

    /// What becomes of a UAV by a step; looked up where it was met before.
    fn step(&self, uav: &Part<Promises<Way>>, step: &Step<'_>) -> Become {
        BECAME.with_borrow_mut(|became| {
            let after = became.entry((uav.hash, hash_of(step)));
            let after = after.or_insert_with(|| {
                let mut uav = Promises::clone(uav);
                match step {
                    Step::Propose(way) => uav.propose(*way),
                    Step::Withdraw => {
                        let _ = uav.withdraw();
                    }
                    Step::Hear(author, said) => {
                        let is_newer = uav.hear(*author, said);
                        assert!(is_newer, "what is not newer is not delivered");
                    }
                }
                let _ = uav.settle(true, &|_| true, &|a, b| self.apart(a, b));
                let said = Part::new(uav.statement());
                (Part::new(uav), said)
            });
            after.clone()
        })
    }
}

/// A part of a state. A step changes one or two of them: the others are shared with the state
/// before it, and their hashes are known.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Part<T> {
    of: Arc<T>,
    hash: u64,
}

impl<T: Hash> Part<T> {
    fn new(of: T) -> Self {
        let hash = hash_of(&of);
        Self {
            of: Arc::new(of),
            hash,
        }
    }
}

fn hash_of(of: &impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    of.hash(&mut hasher);
    hasher.finish()
}

impl<T> Deref for Part<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.of
    }
}

impl<T> Hash for Part<T> {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        self.hash.hash(hasher);
    }
}

type Said = Part<Statement<Way>>;

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Sky {
    uavs: Vec<Part<Promises<Way>>>,
    made: [u8; UAVS_MOST],
    air: Vec<Part<Vec<Said>>>,
    /// The number of the newest statement that each heard of each.
    heard: [[u32; UAVS_MOST]; UAVS_MOST],
}

/// What becomes of a UAV, and what it says then.
type Become = (Part<Promises<Way>>, Said);

thread_local! {
    /// What became of a UAV in such a state by such a step: it met the same one in many states of
    /// the others. A thread works on one search.
    static BECAME: RefCell<HashMap<(u64, u64), Become>> = RefCell::default();
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Action {
    Propose(usize, u8),
    Withdraw(usize),
    Deliver {
        author: usize,
        nth: usize,
        to: usize,
    },
}

/// What happens to one UAV.
#[derive(Hash)]
enum Step<'a> {
    Propose(Way),
    Withdraw,
    Hear(PeerId, &'a Said),
}

fn id(nth: usize) -> PeerId {
    PeerId(u16::try_from(nth + 1).unwrap())
}

impl Sky {
    /// What a UAV has to say goes on the air.
    fn say(&mut self, i: usize, said: Said) {
        if self.air[i].last() != Some(&said) {
            let mut air = Vec::clone(&self.air[i]);
            air.push(said);
            if air.len() > ON_AIR {
                air.remove(0);
            }
            self.air[i] = Part::new(air);
        }
    }

    /// Takes off the air what nobody would heed.
    fn clear_air(&mut self) {
        for (author, air) in self.air.iter_mut().enumerate() {
            let others = self.heard.iter().take(self.uavs.len()).enumerate();
            let others = others.filter(|(i, _)| *i != author);
            let least = others.map(|(_, of)| of[author]).min();
            let is_news = |said: &Said| least.is_none_or(|least| said.number > least);
            if !air.iter().all(is_news) {
                let left = air.iter().filter(|said| is_news(said));
                *air = Part::new(left.cloned().collect());
            }
        }
    }
}

impl Model for Case {
    type State = Sky;
    type Action = Action;

    fn init_states(&self) -> Vec<Sky> {
        let new = |i: u16| Promises::new((0, PeerId(i)), (i, 0));
        let mut uavs: Vec<Promises<Way>> = (1..=self.uavs).map(new).collect();
        let said: Vec<Statement<Way>> = uavs.iter().map(Promises::statement).collect();
        for u in &mut uavs {
            for (j, s) in said.iter().enumerate() {
                let _ = u.hear(id(j), s);
            }
        }
        let mut heard = [0; UAVS_MOST];
        for (of, said) in heard.iter_mut().zip(&said) {
            *of = said.number;
        }
        vec![Sky {
            made: [0; UAVS_MOST],
            air: vec![Part::new(Vec::new()); uavs.len()],
            heard: [heard; UAVS_MOST],
            uavs: uavs.into_iter().map(Part::new).collect(),
        }]
    }

    fn actions(&self, sky: &Sky, actions: &mut Vec<Action>) {
        let apart = |a: &Way, b: &Way| self.apart(a, b);
        for (i, u) in sky.uavs.iter().enumerate() {
            if u.proposal().is_some() {
                actions.push(Action::Withdraw(i));
            } else if sky.made[i] < self.proposals {
                let wanted = (0..self.ways).filter(|way| *way != u.in_force().1);
                let clear = wanted.filter(|way| u.is_clear(&(id(i).0, *way), &apart));
                actions.extend(clear.map(|way| Action::Propose(i, way)));
            }
            for (author, air) in sky.air.iter().enumerate().filter(|(a, _)| *a != i) {
                let to = i;
                // What is not newer than what was heard changes nothing.
                let news = (0..air.len()).filter(|nth| air[*nth].number > sky.heard[i][author]);
                actions.extend(news.map(|nth| Action::Deliver { author, nth, to }));
            }
        }
    }

    fn next_state(&self, sky: &Sky, action: Action) -> Option<Sky> {
        let mut next = sky.clone();
        let (who, step) = match action {
            Action::Propose(i, way) => {
                next.made[i] += 1;
                (i, Step::Propose((id(i).0, way)))
            }
            Action::Withdraw(i) => (i, Step::Withdraw),
            Action::Deliver { author, nth, to } => {
                let said = &sky.air[author][nth];
                next.heard[to][author] = said.number;
                (to, Step::Hear(id(author), said))
            }
        };
        let (uav, said) = self.step(&sky.uavs[who], &step);
        next.uavs[who] = uav;
        next.say(who, said);
        next.clear_air();
        Some(next)
    }

    fn properties(&self) -> Vec<Property<Self>> {
        vec![
            Property::always("motions in force keep apart", |case: &Case, sky: &Sky| {
                let flown: Vec<&Way> = sky.uavs.iter().map(|u| u.in_force()).collect();
                flown.iter().all(|a| flown.iter().all(|b| case.apart(a, b)))
            }),
            Property::sometimes("somebody gets through", |case: &Case, sky: &Sky| {
                let flown = sky.uavs.iter().map(|u| u.in_force().1);
                flown.eq(case.reached.iter().copied())
            }),
        ]
    }
}

fn search(case: Case, states: usize) {
    let checker = case.checker().threads(2).spawn_bfs().join();
    checker.assert_properties();
    let found = checker.unique_state_count();
    assert!(found >= states, "only {found} states");
}

#[test]
fn two_that_want_through_each_other() {
    // Straight ways conflict; so does one's straight way with the other's loiter.
    let conflicts = &[((1, 1), (2, 1)), ((1, 2), (2, 0)), ((1, 0), (2, 2))];
    let case = Case {
        uavs: 2,
        ways: 3,
        proposals: 3,
        conflicts,
        reached: &[2, 1],
    };
    search(case, 100_000);
}

#[test]
fn three_that_meet_in_one_place() {
    let conflicts = &[((1, 1), (2, 1)), ((2, 1), (3, 1)), ((1, 1), (3, 1))];
    let case = Case {
        uavs: 3,
        ways: 2,
        proposals: 1,
        conflicts,
        reached: &[0, 1, 0],
    };
    search(case, 100_000);
}

#[test]
fn three_in_a_ring_of_loiters() {
    // Each may go only once the one before it has left its loiter.
    let conflicts = &[((1, 1), (2, 0)), ((2, 1), (3, 0)), ((3, 1), (1, 1))];
    let case = Case {
        uavs: 3,
        ways: 2,
        proposals: 2,
        conflicts,
        reached: &[0, 0, 1],
    };
    search(case, 100_000);
}
