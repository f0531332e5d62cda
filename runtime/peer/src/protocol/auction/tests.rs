//! The auction in short stories, and its settlement against plain sequential greedy.

use super::settlement::{Bidder, Flying, Problem, settle, settle_greedily, value_of};
use super::*;
use crate::wire::tasks::{EVERY_KIND, TaskKind, TaskPlace};
use proptest::collection::vec;
use proptest::prelude::*;

/// What each UAV gains by each task, less the more it did before; of a changed task the
/// worth is in its place.
struct Worth(Vec<Vec<u32>>);

impl Flying for Worth {
    type At = (usize, u32);

    fn begin(&self, who: PeerId, offer: &Offer) -> (usize, u32) {
        // An offer from further east begins later.
        (usize::from(who.0), offer.east_mm.unsigned_abs())
    }

    fn then(&self, at: &(usize, u32), id: TaskId, _: &Task) -> Option<((usize, u32), u32)> {
        let worth = self.0[at.0][usize::from(id.number)];
        (worth > 0).then(|| ((at.0, at.1 + 1), worth * 1000 / (1 + at.1)))
    }
}

fn name(number: u16) -> TaskId {
    TaskId { author: 9, number }
}

fn task(kind: TaskKind, revision: u32) -> Task {
    Task {
        revision,
        kind,
        places: vec![TaskPlace {
            east_mm: 0,
            north_mm: 0,
        }],
        sensor: 0,
        worth: 1,
        ..Task::default()
    }
}

const OFFER: Offer = Offer {
    east_mm: 0,
    north_mm: 0,
    course_e4: 0,
    speed_mmps: 1,
    radius_mm: 1,
    endurance_ms: 1,
    sensors: 0,
    section_ms: 0,
    takes: EVERY_KIND,
};

/// Some peers that hear each other.
struct Swarm {
    peers: Vec<Auction>,
    worth: Worth,
}

impl Swarm {
    fn new(worth: &[&[u32]]) -> Self {
        let n = u16::try_from(worth.len()).unwrap();
        let mut swarm = Self {
            peers: (0..n).map(|i| Auction::new(PeerId(i), 1, OFFER)).collect(),
            worth: Worth(worth.iter().map(|w| w.to_vec()).collect()),
        };
        let all: Vec<usize> = (0..usize::from(n)).collect();
        for i in &all {
            for k in 0..u16::try_from(worth[0].len()).unwrap() {
                let asked = Event::Task(name(k), task(TaskKind::Pinpoint, 1));
                let _ = swarm.tell(*i, asked);
            }
        }
        swarm.meet(&all);
        swarm
    }

    fn tell(&mut self, i: usize, event: Event) -> Vec<Effect> {
        self.peers[i].handle([event], &self.worth)
    }

    fn tell_all(&mut self, event: &Event) -> Vec<(usize, Effect)> {
        let mut all = Vec::new();
        for i in 0..self.peers.len() {
            all.extend(self.tell(i, event.clone()).into_iter().map(|e| (i, e)));
        }
        all.extend(self.exchange(&(0..self.peers.len()).collect::<Vec<_>>()));
        all
    }

    /// These live and hear each other; nobody else does.
    fn meet(&mut self, these: &[usize]) -> Vec<(usize, Effect)> {
        let live: BTreeSet<PeerId> = these.iter().map(|i| self.peers[*i].me).collect();
        let mut all = Vec::new();
        for i in these {
            let effects = self.tell(*i, Event::Live(live.clone()));
            all.extend(effects.into_iter().map(|e| (*i, e)));
        }
        all.extend(self.exchange(these));
        all.retain(|(_, e)| *e != Effect::Publish);
        all
    }

    fn exchange(&mut self, these: &[usize]) -> Vec<(usize, Effect)> {
        let mut all = Vec::new();
        for _ in 0..6 {
            for i in these {
                let effects = self.tell(*i, Event::Period(1));
                all.extend(effects.into_iter().map(|e| (*i, e)));
            }
            for from in these {
                let (version, bundle) = self.peers[*from].bundle();
                let (id, bundle) = (self.peers[*from].me, bundle.clone());
                for to in these {
                    let heard = Event::Heard(id, version, bundle.clone());
                    let effects = self.tell(*to, heard);
                    all.extend(effects.into_iter().map(|e| (*to, e)));
                }
            }
        }
        assert!(these.iter().all(|i| self.peers[*i].is_agreed()));
        all.retain(|(_, e)| *e != Effect::Publish);
        all
    }

    /// What a peer holds: numbers of tasks, and how far it is.
    fn holds(&self, i: usize) -> Vec<(u16, Progress)> {
        let held = self.peers[i].held().iter();
        held.map(|t| (t.task.number, t.progress)).collect()
    }
}

use Progress::{Begun, Committed, Leaving, Tentative};

#[test]
fn each_gets_what_it_is_best_at_and_doing_it_changes_nothing() {
    let mut s = Swarm::new(&[&[10, 2, 6], &[3, 9, 5]]);
    assert_eq!(s.holds(0), [(0, Tentative), (2, Tentative)]);
    assert_eq!(s.holds(1), [(1, Tentative)]);
    let other = s.holds(1);
    assert_eq!(
        s.tell(0, Event::Free),
        [Effect::Fly(name(0)), Effect::Publish]
    );
    assert!(s.exchange(&[0, 1]).is_empty());
    assert_eq!(s.tell(0, Event::Begun(name(0))), [Effect::Publish]);
    assert_eq!(s.tell(0, Event::Finished(name(0))), [Effect::Publish]);
    assert!(s.exchange(&[0, 1]).is_empty());
    assert_eq!(s.holds(1), other);
    assert_eq!(
        s.tell(0, Event::Free),
        [Effect::Fly(name(2)), Effect::Publish]
    );
}

/// Counts how often it is asked.
struct Counted<'a>(&'a Worth, std::cell::Cell<u32>);

impl Settler for Counted<'_> {
    fn settle(&self, problem: &settlement::Problem, tasks: &Tasks) -> Settlement {
        self.1.set(self.1.get() + 1);
        self.0.settle(problem, tasks)
    }
}

#[test]
fn while_offers_come_in_nothing_is_settled() {
    let worth = Worth(vec![vec![2, 3]; 12]);
    let counted = Counted(&worth, std::cell::Cell::new(0));
    let mut one = Auction::new(PeerId(0), 1, OFFER);
    let others: BTreeSet<PeerId> = (1..12).map(PeerId).collect();
    let _ = one.handle([Event::Live(others.clone())], &counted);
    for k in 0..2 {
        let asked = Event::Task(name(k), task(TaskKind::Pinpoint, 1));
        let _ = one.handle([asked], &counted);
    }
    for id in others {
        let bundle = Bundle {
            offer: OFFER,
            ..Bundle::default()
        };
        let _ = one.handle([Event::Heard(id, (1, 1), bundle)], &counted);
        assert!(one.held().is_empty(), "{:?}", one.held());
    }
    assert_eq!(counted.1.get(), 0);
    // A period without news: now it is said, so now it is settled, once.
    for _ in 0..3 {
        let _ = one.handle([Event::Period(1)], &counted);
    }
    assert_eq!(counted.1.get(), 1);
    assert_eq!(one.bundle().1.tasks.len(), 1);
}

#[test]
fn nobody_commits_before_all_agree_unless_it_has_waited() {
    let mut s = Swarm::new(&[&[10], &[3]]);
    let strange = Event::Task(name(0), task(TaskKind::Pinpoint, 2));
    assert!(s.tell(0, strange).is_empty(), "what it won it says later");
    assert!(s.tell(0, Event::Free).is_empty(), "the other knows it not");
    assert_eq!(s.tell(0, Event::Period(1)), [Effect::Publish]);
    for _ in 0..3 {
        assert!(s.tell(0, Event::Period(1)).is_empty());
    }
    let effects = s.tell(0, Event::Period(1));
    assert_eq!(effects, [Effect::Fly(name(0)), Effect::Publish]);
}

#[test]
fn a_task_that_is_changed_or_cancelled_is_dropped_by_who_flies_to_it() {
    for cancelled in [false, true] {
        let mut s = Swarm::new(&[&[10, 0], &[0, 9]]);
        s.tell(0, Event::Free);
        s.exchange(&[0, 1]);
        let changed = Task {
            state: if cancelled {
                TaskState::Cancelled
            } else {
                TaskState::Open
            },
            ..task(TaskKind::Pinpoint, 2)
        };
        let effects = s.tell_all(&Event::Task(name(0), changed));
        assert!(effects.contains(&(0, Effect::Drop(name(0)))), "{effects:?}");
        // Whoever is free is given the changed task.
        assert_eq!(s.holds(0).len(), usize::from(!cancelled));
        assert_eq!(s.holds(1), [(1, Tentative)]);
    }
}

#[test]
fn what_the_dead_claimed_is_open_and_what_they_did_is_done() {
    let mut s = Swarm::new(&[&[10, 8], &[1, 1]]);
    assert_eq!(s.holds(1), []);
    s.tell(0, Event::Free);
    s.tell(0, Event::Finished(name(0)));
    s.tell(0, Event::Free);
    s.exchange(&[0, 1]);
    assert_eq!(s.holds(0)[1], (1, Committed));
    s.meet(&[1]);
    assert_eq!(s.holds(1), [(1, Tentative)]);
    s.tell(1, Event::Free);
    // Both fly to it: of equal claims the higher bid keeps it.
    let effects = s.meet(&[0, 1]);
    assert_eq!(effects, [(1, Effect::Drop(name(1)))]);
    // What it did stays listed until it has a reason for another offer.
    assert_eq!(s.holds(0), [(0, Progress::Done), (1, Committed)]);
}

#[test]
fn a_commitment_moves_for_a_tenth_and_for_no_less() {
    // A UAV that comes back is better at the task by so much.
    for (better, moves) in [(105, false), (120, true)] {
        let mut s = Swarm::new(&[&[100], &[better]]);
        s.meet(&[0]);
        s.tell(0, Event::Free);
        assert_eq!(s.holds(0), [(0, Committed)]);
        let effects = s.meet(&[0, 1]);
        assert_eq!(
            effects == [(0, Effect::Drop(name(0)))],
            moves,
            "{effects:?}"
        );
        assert_eq!(s.holds(1).len(), usize::from(moves));
        assert_eq!(s.holds(0).len(), usize::from(!moves));
    }
}

#[test]
fn what_is_begun_does_not_move() {
    let mut s = Swarm::new(&[&[10], &[100]]);
    s.meet(&[0]);
    s.tell(0, Event::Free);
    s.tell(0, Event::Begun(name(0)));
    assert!(s.meet(&[0, 1]).is_empty());
    assert_eq!(s.holds(0), [(0, Begun)]);
    assert_eq!(s.holds(1), []);
}

#[test]
fn a_track_is_handed_over_made_before_broken() {
    let mut s = Swarm::new(&[&[10], &[5]]);
    s.tell_all(&Event::Task(name(0), task(TaskKind::Track, 2)));
    s.tell(0, Event::Free);
    s.tell(0, Event::Begun(name(0)));
    s.exchange(&[0, 1]);
    s.tell(0, Event::Relieve(name(0)));
    assert!(s.exchange(&[0, 1]).is_empty());
    assert_eq!(s.holds(0), [(0, Leaving)]);
    assert_eq!(s.holds(1), [(0, Tentative)]);
    s.tell(1, Event::Free);
    assert!(s.holds(1).is_empty() || s.holds(1) == [(0, Committed)]);
    assert!(s.exchange(&[0, 1]).is_empty(), "nobody lets go yet");
    assert_eq!(s.holds(0), [(0, Leaving)]);
    s.tell(1, Event::Begun(name(0)));
    assert_eq!(s.exchange(&[0, 1]), [(0, Effect::Drop(name(0)))]);
    assert_eq!(s.holds(1), [(0, Begun)]);
}

#[test]
fn who_offers_anew_does_so_from_where_it_is() {
    let mut s = Swarm::new(&[&[10, 9], &[8, 1]]);
    assert_eq!(s.holds(1), [(0, Tentative)]);
    // Where it is counts from the next reason on to ask.
    let far = Offer {
        east_mm: 50,
        ..OFFER
    };
    assert!(s.tell(1, Event::Present(far)).is_empty());
    s.tell_all(&Event::Task(name(1), task(TaskKind::Pinpoint, 2)));
    assert_eq!(s.holds(1), []);
    assert_eq!(s.holds(0).len(), 2);
}

/// Sequential greedy as one would write it down, without memory of anything.
fn plain_greedy(problem: &Problem, tasks: &Tasks, worth: &Worth) -> u64 {
    let mut orders: Vec<Vec<TaskId>> = vec![Vec::new(); problem.bidders.len()];
    let mut open = problem.open.clone();
    let value = |b: usize, order: &[TaskId]| {
        let bidder = &problem.bidders[b];
        value_of((bidder.id, &bidder.offer), order, (tasks, worth))
    };
    loop {
        let mut best: Option<(i64, usize, TaskId, Vec<TaskId>)> = None;
        for (b, held) in orders.iter().enumerate() {
            let now = i64::try_from(value(b, held).unwrap()).unwrap();
            for task in &open {
                let mut own: Option<(i64, Vec<TaskId>)> = None;
                for at in (0..=held.len()).rev() {
                    let mut order = held.clone();
                    order.insert(at, *task);
                    let Some(value) = value(b, &order) else {
                        continue;
                    };
                    let gain = i64::try_from(value).unwrap() - now;
                    if own.as_ref().is_none_or(|o| gain > o.0) {
                        own = Some((gain, order));
                    }
                }
                if let Some((gain, order)) = own
                    && best.as_ref().is_none_or(|x| gain > x.0)
                {
                    best = Some((gain, b, *task, order));
                }
            }
        }
        let Some((_, b, task, order)) = best else {
            break;
        };
        orders[b] = order;
        open.retain(|t| *t != task);
    }
    (0..orders.len())
        .map(|b| value(b, &orders[b]).unwrap())
        .sum()
}

proptest! {
    #[test]
    fn settlements_are_greedy_or_better_and_share_everything_out(
        worth in vec(vec(0_u32..50, 5), 1..4),
        late in vec(0_i32..4, 4),
        room in 1_usize..6,
    ) {
        let tasks: Tasks = (0..5).map(|k| (name(k), task(TaskKind::Pinpoint, 1))).collect();
        let bidder = |i: usize| Bidder {
            id: PeerId(u16::try_from(i).unwrap()),
            offer: Offer { east_mm: late[i], ..OFFER },
            first: Vec::new(),
            barred: BTreeSet::new(),
            room: 5,
        };
        let mut problem = Problem {
            bidders: (0..worth.len()).map(bidder).collect(),
            open: tasks.keys().copied().collect(),
        };
        let worth = Worth(worth);
        let greedy = settle_greedily(&problem, &tasks, &worth);
        prop_assert_eq!(greedy.value, plain_greedy(&problem, &tasks, &worth));
        let settled = settle(&problem, &tasks, &worth);
        prop_assert!(settled.value >= greedy.value);
        for b in &mut problem.bidders {
            b.room = room;
        }
        let tight = settle(&problem, &tasks, &worth);
        let mut had: Vec<TaskId> = tight.orders.iter().flatten().map(|t| t.0).collect();
        had.extend(&tight.unassigned);
        had.sort_unstable();
        prop_assert_eq!(had, problem.open.clone(), "each once");
        for (b, order) in tight.orders.iter().enumerate() {
            prop_assert!(order.len() <= room);
            let idle = order.len() < room;
            let could = |t: &TaskId| worth.0[b][usize::from(t.number)] > 0;
            prop_assert!(!(idle && tight.unassigned.iter().any(could)));
        }
    }
}

/// Of many some are given up and heard again all the time, and others offer anew for it.
#[test]
fn where_no_basis_ever_stands_a_task_is_committed_to_all_the_same() {
    let mut s = Swarm::new(&[&[10], &[3], &[2]]);
    let task = Event::Task(name(0), task(TaskKind::Pinpoint, 2));
    let _ = s.tell(0, task);
    let _ = s.tell(0, Event::Free);
    let mut flown = Vec::new();
    for period in 1..=20_u32 {
        for other in [1, 2] {
            let offer = Offer {
                east_mm: 3,
                north_mm: i32::try_from(period).unwrap(),
                ..OFFER
            };
            let bundle = Bundle {
                offer,
                ..Bundle::default()
            };
            let _ = s.tell(0, Event::Heard(PeerId(other), (2, period), bundle));
        }
        assert!(!s.peers[0].is_agreed());
        let effects = s.tell(0, Event::Period(1));
        if effects.contains(&Effect::Fly(name(0))) {
            flown.push(period);
        }
    }
    // Two ways through a component of one hop, with what is lost on the way: five periods.
    assert_eq!(flown, [10]);
    assert_eq!(s.holds(0), [(0, Committed)]);
}
