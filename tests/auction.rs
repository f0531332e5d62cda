//! The task auction (docs/protocol.md §12), searched breadth first: two or three UAVs, two or
//! three tasks, and [`Auction`] as it is in a peer. What tasks are worth is a table.
//!
//! Bundles stay on the air, from where any may reach anybody at any time, in any order, again
//! or never: that is loss, delay, reordering and repetition. One UAV may be cut off or crash
//! and come back; who is believed to live follows at any later moment, for each by itself.
//! A commitment may be made by agreement or by patience alone.
//!
//! From **every** state that is found, everything that was said is let arrive: within so many
//! exchanges all agree, no two who live hold one task, every task is held, and when the UAVs
//! then fly on every task gets done. So there is no way into a livelock.
//!
//! Only the first 20,000 states are generated, those nearest to the beginning: more would
//! take minutes.
//!
//! These bounds are real: so many acts of each UAV, one trouble, one change of a task, and of
//! each author's bundles the two newest can still arrive.

use skein_peer::PeerId;
use skein_peer::protocol::auction::settlement::Flying;
use skein_peer::protocol::auction::{Auction, Effect, Event, Version};
use skein_peer::wire::tasks::{
    Bundle, EVERY_KIND, Offer, Progress, Task, TaskId, TaskKind, TaskPlace,
};
use stateright::{Checker, Model, Property};
use std::collections::{BTreeMap, BTreeSet};

/// Bundles of one author that can still arrive.
const ON_AIR: usize = 2;

/// Exchanges of everybody with everybody after which all must agree.
const EXCHANGES: usize = 16;

/// What a UAV gains by a task, less the more it did before.
struct Worth(&'static [&'static [u32]]);

impl Flying for Worth {
    type At = (PeerId, u32);

    fn begin(&self, who: PeerId, _: &Offer) -> (PeerId, u32) {
        (who, 0)
    }

    fn then(&self, at: &(PeerId, u32), id: TaskId, task: &Task) -> Option<((PeerId, u32), u32)> {
        let worth = self.0[usize::from(at.0.0)][usize::from(id.number)];
        // A change of a task turns round who is good at it.
        let worth = if task.revision > 1 { 20 - worth } else { worth };
        (worth > 0).then(|| ((at.0, at.1 + 1), worth * 60 / (1 + at.1)))
    }
}

/// What one search may do.
struct Case {
    /// What each UAV gains by each task.
    worth: Worth,
    /// How often each UAV may ask for its next task.
    asks: u8,
    /// Whether the last UAV may be cut off, and come back.
    cut: bool,
    /// Whether the last UAV may crash.
    crash: bool,
    /// Whether the first task may be changed.
    change: bool,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Sky {
    uavs: Vec<Auction>,
    asked: Vec<u8>,
    /// What each is flying to.
    flies: Vec<Option<TaskId>>,
    believes: Vec<BTreeSet<PeerId>>,
    heard_change: Vec<bool>,
    air: Vec<Vec<(Version, Bundle)>>,
    is_cut: bool,
    was_cut: bool,
    is_down: bool,
    is_changed: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Action {
    Deliver {
        author: usize,
        nth: usize,
        to: usize,
    },
    /// Asks for its next task; the second way without patience left.
    Ask(usize, bool),
    Finish(usize),
    /// A period passes without news.
    Wait(usize),
    Believe(usize),
    HearChange(usize),
    Cut,
    Heal,
    Crash,
    Change,
}

fn id(nth: usize) -> PeerId {
    PeerId(u16::try_from(nth).unwrap())
}

fn task(number: usize, revision: u32) -> (TaskId, Task) {
    let name = TaskId {
        author: 9,
        number: u16::try_from(number).unwrap(),
    };
    let task = Task {
        revision,
        kind: TaskKind::Pinpoint,
        places: vec![TaskPlace {
            east_mm: 0,
            north_mm: 0,
        }],
        sensor: 0,
        worth: 1,
        ..Task::default()
    };
    (name, task)
}

impl Case {
    fn n(&self) -> usize {
        self.worth.0.len()
    }

    fn tasks(&self) -> usize {
        self.worth.0[0].len()
    }

    /// An event at a UAV; what it has to say goes on the air.
    fn tell(&self, sky: &mut Sky, i: usize, events: Vec<Event>) {
        for effect in sky.uavs[i].handle(events, &self.worth) {
            match effect {
                Effect::Fly(task) => sky.flies[i] = Some(task),
                Effect::Drop(task) if sky.flies[i] == Some(task) => sky.flies[i] = None,
                Effect::Drop(_) | Effect::Publish => {}
            }
        }
        let (version, bundle) = sky.uavs[i].bundle();
        let air = &mut sky.air[i];
        if air.last().map(|said| said.0) != Some(version) {
            air.push((version, bundle.clone()));
            if air.len() > ON_AIR {
                air.remove(0);
            }
        }
    }

    fn last(&self) -> usize {
        self.n() - 1
    }

    fn is_up(&self, sky: &Sky, i: usize) -> bool {
        !(sky.is_down && i == self.last())
    }

    /// Who lives, as a UAV could know it.
    fn truth(&self, sky: &Sky, i: usize) -> BTreeSet<PeerId> {
        let apart = |j: usize| sky.is_cut && (i == self.last()) != (j == self.last());
        let others = (0..self.n()).filter(|j| self.is_up(sky, *j) && !apart(*j));
        others.map(id).collect()
    }

    fn believe(&self, sky: &mut Sky, i: usize) {
        let live = self.truth(sky, i);
        sky.believes[i].clone_from(&live);
        self.tell(sky, i, vec![Event::Live(live)]);
    }

    fn up(&self, sky: &Sky) -> Vec<usize> {
        (0..self.n()).filter(|i| self.is_up(sky, *i)).collect()
    }

    /// Everything arrives, until nobody has anything new to say.
    fn calm_down(&self, sky: &mut Sky) -> bool {
        sky.is_cut = false;
        for i in self.up(sky) {
            if sky.is_changed {
                let (name, changed) = task(0, 2);
                self.tell(sky, i, vec![Event::Task(name, changed)]);
            }
            self.believe(sky, i);
        }
        for _ in 0..EXCHANGES {
            let said: Vec<(Version, Bundle)> = sky
                .uavs
                .iter()
                .map(|u| (u.bundle().0, u.bundle().1.clone()))
                .collect();
            let mut news = false;
            for i in self.up(sky) {
                let unknown = |j: &usize| *j != i && sky.uavs[i].known(id(*j)) != Some(said[*j].0);
                let unknown: Vec<usize> = (0..self.n()).filter(unknown).collect();
                news |= !unknown.is_empty() || sky.uavs[i].has_more_to_say();
                let heard = |j: &usize| Event::Heard(id(*j), said[*j].0, said[*j].1.clone());
                let heard = unknown.iter().map(heard);
                self.tell(sky, i, heard.chain([Event::Period(1)]).collect());
            }
            if !news {
                return self.up(sky).iter().all(|i| sky.uavs[*i].is_agreed());
            }
        }
        false
    }

    /// How many who live hold each task, and what is done in its present revision.
    fn held(&self, sky: &Sky) -> (BTreeMap<TaskId, usize>, BTreeSet<TaskId>) {
        let current = |t: TaskId| {
            if t.number == 0 && sky.is_changed {
                2
            } else {
                1
            }
        };
        let mut held = BTreeMap::new();
        let mut done = BTreeSet::new();
        for (i, uav) in sky.uavs.iter().enumerate() {
            let bundle = uav.bundle().1;
            let before = bundle.done.iter().map(|d| (d.task, d.revision));
            done.extend(before.filter(|d| d.1 == current(d.0)).map(|d| d.0));
            for t in bundle
                .tasks
                .iter()
                .filter(|t| t.revision == current(t.task))
            {
                if t.progress == Progress::Done {
                    done.insert(t.task);
                } else if self.is_up(sky, i) {
                    *held.entry(t.task).or_insert(0) += 1;
                }
            }
        }
        held.retain(|t, _| !done.contains(t));
        (held, done)
    }

    /// Each task is held by exactly one who lives, or done.
    fn is_shared_out(&self, sky: &Sky) -> bool {
        let (held, done) = self.held(sky);
        (0..self.tasks()).all(|k| {
            let name = task(k, 1).0;
            done.contains(&name) != (held.get(&name) == Some(&1))
        })
    }

    /// From here on nothing goes wrong any more: all agree, and all gets done.
    fn ends_well(&self, sky: &Sky) -> bool {
        let mut sky = sky.clone();
        if !self.calm_down(&mut sky) || !self.is_shared_out(&sky) {
            return false;
        }
        for _ in 0..2 * self.tasks() + 2 {
            for i in self.up(&sky) {
                if let Some(task) = sky.flies[i].take() {
                    self.tell(&mut sky, i, vec![Event::Finished(task)]);
                }
                self.tell(&mut sky, i, vec![Event::Free]);
            }
            if !self.calm_down(&mut sky) || !self.is_shared_out(&sky) {
                return false;
            }
        }
        self.held(&sky).1.len() == self.tasks()
    }
}

impl Model for Case {
    type State = Sky;
    type Action = Action;

    fn init_states(&self) -> Vec<Sky> {
        let offer = Offer {
            speed_mmps: 1,
            takes: EVERY_KIND,
            ..Offer::default()
        };
        let n = self.n();
        let mut sky = Sky {
            uavs: (0..n).map(|i| Auction::new(id(i), 1, offer)).collect(),
            asked: vec![0; n],
            flies: vec![None; n],
            believes: vec![BTreeSet::new(); n],
            heard_change: vec![false; n],
            air: vec![Vec::new(); n],
            is_cut: false,
            was_cut: false,
            is_down: false,
            is_changed: false,
        };
        for i in 0..n {
            let tasks = (0..self.tasks()).map(|k| task(k, 1));
            let known = tasks.map(|(name, task)| Event::Task(name, task)).collect();
            self.tell(&mut sky, i, known);
            self.believe(&mut sky, i);
        }
        vec![sky]
    }

    fn actions(&self, sky: &Sky, actions: &mut Vec<Action>) {
        for i in self.up(sky) {
            if sky.flies[i].is_some() {
                actions.push(Action::Finish(i));
            } else if sky.asked[i] < self.asks {
                actions.extend([Action::Ask(i, false), Action::Ask(i, true)]);
            }
            if sky.uavs[i].has_more_to_say() {
                actions.push(Action::Wait(i));
            }
            if sky.believes[i] != self.truth(sky, i) {
                actions.push(Action::Believe(i));
            }
            if sky.is_changed && !sky.heard_change[i] {
                actions.push(Action::HearChange(i));
            }
            for (author, air) in sky.air.iter().enumerate().filter(|(a, _)| *a != i) {
                let apart = sky.is_cut && (i == self.last()) != (author == self.last());
                if !apart {
                    let to = i;
                    actions.extend((0..air.len()).map(|nth| Action::Deliver { author, nth, to }));
                }
            }
        }
        if self.cut && !sky.was_cut {
            actions.push(Action::Cut);
        }
        if sky.is_cut {
            actions.push(Action::Heal);
        }
        if self.crash && !sky.is_down {
            actions.push(Action::Crash);
        }
        if self.change && !sky.is_changed {
            actions.push(Action::Change);
        }
    }

    fn next_state(&self, sky: &Sky, action: Action) -> Option<Sky> {
        let mut next = sky.clone();
        match action {
            Action::Deliver { author, nth, to } => {
                let (version, bundle) = sky.air[author][nth].clone();
                if sky.uavs[to].known(id(author)) >= Some(version) {
                    return None;
                }
                let heard = Event::Heard(id(author), version, bundle);
                self.tell(&mut next, to, vec![heard]);
            }
            Action::Ask(i, waited) => {
                next.asked[i] += 1;
                let periods = if waited { 5 } else { 0 };
                let mut events = vec![Event::Period(1); periods];
                events.push(Event::Free);
                self.tell(&mut next, i, events);
            }
            Action::Finish(i) => {
                let task = next.flies[i].take()?;
                self.tell(&mut next, i, vec![Event::Finished(task)]);
            }
            Action::Wait(i) => self.tell(&mut next, i, vec![Event::Period(1)]),
            Action::Believe(i) => self.believe(&mut next, i),
            Action::HearChange(i) => {
                next.heard_change[i] = true;
                let (name, changed) = task(0, 2);
                self.tell(&mut next, i, vec![Event::Task(name, changed)]);
            }
            Action::Cut => {
                next.is_cut = true;
                next.was_cut = true;
            }
            Action::Heal => next.is_cut = false,
            Action::Crash => next.is_down = true,
            Action::Change => next.is_changed = true,
        }
        Some(next)
    }

    fn properties(&self) -> Vec<Property<Self>> {
        vec![
            Property::always("from everywhere all gets done", |case: &Case, sky: &Sky| {
                case.ends_well(sky)
            }),
            Property::sometimes("two fly to one task", |_: &Case, sky: &Sky| {
                let flown: Vec<TaskId> = sky.flies.iter().flatten().copied().collect();
                let different: BTreeSet<TaskId> = flown.iter().copied().collect();
                different.len() < flown.len()
            }),
            Property::sometimes("something is done", |case: &Case, sky: &Sky| {
                !case.held(sky).1.is_empty()
            }),
        ]
    }
}

/// Generates so many states, the nearest to the beginning first.
fn search(case: Case, states: usize, most: usize) {
    let checker = case.checker().threads(2).target_state_count(most);
    let checker = checker.spawn_bfs().join();
    checker.assert_properties();
    let found = checker.unique_state_count();
    assert!(found >= states, "only {found} states");
}

#[test]
fn two_share_three_tasks_while_one_is_cut_off() {
    let case = Case {
        worth: Worth(&[&[10, 8, 6], &[9, 9, 3]]),
        asks: 1,
        cut: true,
        crash: false,
        change: false,
    };
    search(case, 10_000, 20_000);
}

#[test]
fn two_share_two_tasks_of_which_one_changes_and_one_uav_crashes() {
    let case = Case {
        worth: Worth(&[&[10, 8], &[9, 9]]),
        asks: 1,
        cut: false,
        crash: true,
        change: true,
    };
    search(case, 10_000, 20_000);
}

#[test]
fn three_of_whom_one_crashes_and_only_two_can_do_the_second_task() {
    let case = Case {
        worth: Worth(&[&[10, 0], &[9, 9], &[10, 8]]),
        asks: 1,
        cut: false,
        crash: true,
        change: false,
    };
    search(case, 10_000, 20_000);
}
