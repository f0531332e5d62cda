//! The rules of the negotiation (docs/protocol.md §4: rounds, stamps, release, inheritance,
//! end; D2.7 §3.6.5 made safe for lost messages), checked exhaustively on a small
//! swarm: three peers, four to six cells, and `Section` and `Rounds` as they fly.
//! Left to others: time, radio and motion, which the simulator's stories test.
//!
//! Time is left out: what a clock may permit at some moment may happen at any
//! moment, so what holds here holds for every timing. Messages stay on the air, from
//! where any may be delivered at any time, in any order or never: that is loss,
//! reordering and delay, and repetition is a delivery that changes nothing.
//!
//! One search over all of this at once would not end, so each case bounds another
//! corner. These reductions keep a case small and hide no behaviour of its corner:
//!
//! - A peer answers a message at once (settles, bids, publishes). A late answer is
//!   the same as a late delivery, which is searched.
//! - A round completed by another's bid is decided at once: deciding late is hearing
//!   that bid late. Completed by one's own bid it may be decided at any time.
//! - A counter heard from a beacon matters only to who starts a round, so it is
//!   heard, or not, at the start.
//! - Covered cells are learnt one by one from anybody who knows them: every stale,
//!   cut or repeated union is some sequence of such steps.
//! - Versions count only by their order, and fields that no rule reads (ETA, cells
//!   done, the claim's own epoch) are not published.
//! - What all have heard, and what would change nothing any more, leaves the air.
//! - A cut link in the middle of a round is a message that never arrives, so a
//!   partition stands from the beginning, believed in by all, and heals at any moment.
//!
//! And these bounds are real: a round may start at any time but only while its
//! counter is within the case's; only peer 2 crashes or is wrongly suspected; of an
//! author's claims the newest, or the two newest, can still arrive; some cases
//! stop at a depth. There is no journal: a section that is adopted or taken is listed in
//! the same step, so what happens between a decision and its durability is not searched
//! (the stories in `runtime/peer/src/tests/stores.rs` and the storms' disks do that).

mod calm;
mod step;
mod world;

use calm::calm_leads_to_the_end;
use stateright::{Checker, Model, Property};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use step::Action;
use world::World;

/// The swarm: enough for two that disagree while a third hears only one of them.
const PEERS: u16 = 3;

/// Whom fate may strike: the middle one, as ties go to lower and to higher ids.
const MORTAL: u16 = 2;

type Check = fn(&Case, &World) -> bool;

/// What one search may do, and what it must have met.
struct Case {
    cells: u16,
    /// Whether it begins after a first round that all heard of.
    divided: bool,
    /// The highest counter of a round.
    rounds: u32,
    /// The highest `take` of a stamp.
    takes: u16,
    /// Cells flown while messages are under way.
    flights: u16,
    /// Crashes of peer [`MORTAL`].
    crashes: u8,
    /// Its restarts without a disk.
    restarts: u8,
    /// So many of an author's newest claims stay on the air.
    versions: usize,
    /// Whether it begins in a partition.
    begins_split: bool,
    /// Whether rounds are still started after the partition healed.
    late: bool,
    /// How often peer [`MORTAL`] is believed dead though alive and in reach.
    suspicions: u8,
    /// Whether held cells expire, and half a live owner's plan may be taken.
    impatient: bool,
    /// The longest sequence of steps searched, if the case has more.
    depth: Option<usize>,
    /// States that the search finds at least.
    states: usize,
    /// Events that must be met.
    events: &'static [Event],
    /// What must be met in some state.
    reached: &'static [(&'static str, Check)],
    /// How often each event was met.
    met: [AtomicUsize; EVENTS],
    /// What calm swarms were already brought to the end.
    calm: Mutex<BTreeMap<u64, bool>>,
}

/// How many kinds of [`Event`] there are.
const EVENTS: usize = 9;

/// What a step can be; each case names those that it must have met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Event {
    /// A planned cell was dropped for a higher stamp.
    Yielded,
    /// A held cell was dropped for a higher stamp.
    Released,
    /// Held cells expired.
    Expired,
    /// Orphans were taken without a round.
    Taken,
    /// Half of a live owner's plan was taken.
    Halved,
    /// A round was decided by fewer than all peers.
    DecidedByFew,
    /// A bid of an abandoned round was at hand, and changed nothing.
    StaleSnapshot,
    /// A round was abandoned for a higher one.
    Abandoned,
    /// A claim of an earlier life arrived while the new life was believed in.
    OldLife,
}

impl Model for Case {
    type State = World;
    type Action = Action;

    fn init_states(&self) -> Vec<World> {
        vec![self.first()]
    }

    fn actions(&self, w: &World, actions: &mut Vec<Action>) {
        for (i, n) in w.nodes.iter().enumerate() {
            if let Some(n) = n {
                self.messages(w, i, n, actions);
                self.own_actions(w, i, n, actions);
                self.beliefs(w, i, n, actions);
                if w.crashes < self.crashes && n.me.id == MORTAL {
                    actions.push(Action::Crash(i));
                }
            } else if w.restarts < self.restarts {
                actions.push(Action::Restart(i));
            }
        }
        if w.split {
            actions.push(Action::Heal);
        }
    }

    fn next_state(&self, last: &World, action: Action) -> Option<World> {
        let mut w = last.clone();
        let actor = self.step(&mut w, action);
        if let Some(i) = actor {
            w.publish(i, self.versions);
        }
        if self.only_hand_overs() {
            let lost = |c: &u16| last.lister(*c) && !w.lister(*c) && !w.flown.contains(*c);
            w.gap = w.gap.or((0..self.cells).find(lost));
        }
        if let Some(i) = actor
            && let (Some(old), Some(new)) = (&last.nodes[i], &w.nodes[i])
        {
            let sinks =
                |c: &u16| matches!((old.stamp(*c), new.stamp(*c)), (Some(a), Some(b)) if b < a);
            w.sunk = w.sunk.or((0..self.cells).find(sinks));
        }
        w.tidy(w.restarts < self.restarts);
        Some(w)
    }

    fn properties(&self) -> Vec<Property<Self>> {
        let mut all = vec![
            Property::<Self>::always("covered is only what was flown", |_, w| {
                w.alive().all(|n| n.sections.covered().is_subset(&w.flown))
            }),
            Property::<Self>::always("nobody finishes early", |_, w| {
                w.flown.is_full() || w.alive().all(|n| !n.sections.complete())
            }),
            Property::<Self>::always("a cell has one owner at one stamp", |_, w| {
                let mut seen = BTreeSet::new();
                w.alive()
                    .flat_map(|n| n.sections.plan())
                    .all(|p| seen.insert((p.cell, p.stamp)))
            }),
            Property::<Self>::always("no hand-over loses a cell", |_, w| w.gap.is_none()),
            Property::<Self>::always("stamps only grow", |_, w| w.sunk.is_none()),
            Property::<Self>::always("calm leads to the end", calm_leads_to_the_end),
        ];
        all.extend(
            self.reached
                .iter()
                .map(|(name, check)| Property::sometimes(name, *check)),
        );
        all
    }
}

impl Case {
    /// A settled swarm to which nothing happens.
    const fn settled() -> Self {
        Self {
            cells: 6,
            divided: true,
            rounds: 1,
            takes: 0,
            flights: 0,
            crashes: 0,
            restarts: 0,
            versions: 2,
            begins_split: false,
            late: false,
            suspicions: 0,
            impatient: false,
            depth: None,
            states: 0,
            events: &[],
            reached: &[],
            met: [const { AtomicUsize::new(0) }; EVENTS],
            calm: Mutex::new(BTreeMap::new()),
        }
    }

    /// Searches all that the case allows.
    fn check(self) {
        let (depth, states, events) = (self.depth, self.states, self.events);
        let search = self.checker().threads(2);
        // The depth of the search library counts states, the first one included.
        let search = if let Some(steps) = depth {
            search.target_max_depth(steps + 1)
        } else {
            search
        };
        let done = search.spawn_bfs().join();
        done.assert_properties();
        for event in events {
            let met = done.model().met[*event as usize].load(Ordering::Relaxed);
            assert!(met > 0, "the search never met {event:?}");
        }
        let found = done.unique_state_count();
        println!(
            "{found} states, {} steps, depth {}",
            done.state_count(),
            done.max_depth()
        );
        assert!(
            found >= states,
            "only {found} states: what was reachable is no longer"
        );
    }
}

fn all_plan(_: &Case, w: &World) -> bool {
    w.alive().all(|n| !n.sections.plan().is_empty())
}

fn somebody_holds(_: &Case, w: &World) -> bool {
    w.alive().any(|n| !n.sections.held().is_empty())
}

fn planned_twice(case: &Case, w: &World) -> bool {
    (0..case.cells).any(|c| w.alive().filter(|n| n.plans(c)).count() > 1)
}

fn all_taken_over(case: &Case, w: &World) -> bool {
    let theirs = |c| w.flown.contains(c) || w.alive().any(|n| n.me.id != MORTAL && n.plans(c));
    w.crashes > 0 && w.restarts == 0 && (0..case.cells).all(theirs)
}

fn reborn_plans(_: &Case, w: &World) -> bool {
    w.alive()
        .any(|n| n.me.incarnation > 1 && !n.sections.plan().is_empty())
}

fn all_covered_after_a_crash(_: &Case, w: &World) -> bool {
    w.crashes > 0 && w.alive().all(|n| n.sections.complete())
}

fn one_finished_others_not(_: &Case, w: &World) -> bool {
    w.alive().any(|n| n.sections.complete()) && w.alive().any(|n| !n.sections.complete())
}

/// After the partition, two halves that divided everything list what they did.
fn halves_disagree(case: &Case, w: &World) -> bool {
    !w.split && planned_twice(case, w) && w.alive().all(|n| n.sections.epoch().counter == 2)
}

fn halves_agree(case: &Case, w: &World) -> bool {
    let rounds = w
        .alive()
        .filter(|n| n.sections.epoch().counter == 2)
        .count();
    !w.split
        && rounds == 3
        && (0..case.cells).all(|c| w.alive().filter(|n| n.plans(c)).count() == 1)
}

#[test]
fn a_first_round_and_its_rival() {
    Case {
        divided: false,
        rounds: 2,
        events: &[Event::Abandoned, Event::StaleSnapshot, Event::Released],
        reached: &[("all plan", all_plan), ("held", somebody_holds)],
        states: 68_000,
        ..Case::settled()
    }
    .check();
}

#[test]
fn a_second_round_hands_cells_over() {
    Case {
        rounds: 2,
        flights: 1,
        events: &[Event::Released, Event::Yielded],
        reached: &[("held", somebody_holds), ("planned twice", planned_twice)],
        states: 260_000,
        ..Case::settled()
    }
    .check();
}

#[test]
fn held_cells_expire() {
    Case {
        rounds: 2,
        impatient: true,
        events: &[Event::Expired, Event::Released],
        reached: &[("held", somebody_holds)],
        states: 9_000,
        ..Case::settled()
    }
    .check();
}

#[test]
fn a_crash_is_taken_over_by_round_or_take() {
    Case {
        rounds: 2,
        takes: 1,
        crashes: 1,
        versions: 1,
        events: &[
            Event::Taken,
            Event::DecidedByFew,
            Event::Yielded,
            Event::Abandoned,
        ],
        reached: &[
            ("all taken over", all_taken_over),
            ("planned twice", planned_twice),
        ],
        states: 199_000,
        ..Case::settled()
    }
    .check();
}

#[test]
fn a_crash_amid_takes_and_flights() {
    Case {
        cells: 4,
        takes: 2,
        flights: 1,
        crashes: 1,
        events: &[Event::Taken, Event::Yielded],
        reached: &[
            ("all taken over", all_taken_over),
            ("planned twice", planned_twice),
        ],
        states: 2_300,
        ..Case::settled()
    }
    .check();
}

#[test]
fn a_restart_without_disk_takes() {
    Case {
        rounds: 0,
        takes: 1,
        crashes: 1,
        restarts: 1,
        versions: 1,
        events: &[Event::Taken, Event::Yielded],
        reached: &[
            ("the reborn plans", reborn_plans),
            ("planned twice", planned_twice),
        ],
        states: 143_000,
        ..Case::settled()
    }
    .check();
}

#[test]
fn a_restart_without_disk_joins_a_round() {
    Case {
        rounds: 2,
        crashes: 1,
        restarts: 1,
        versions: 1,
        depth: Some(10),
        events: &[Event::OldLife, Event::DecidedByFew, Event::Abandoned],
        reached: &[("the reborn plans", reborn_plans)],
        states: 160_000,
        ..Case::settled()
    }
    .check();
}

#[test]
fn halves_divide_and_settle() {
    Case {
        rounds: 2,
        begins_split: true,
        events: &[Event::DecidedByFew, Event::Yielded, Event::Released],
        reached: &[
            ("halves disagree", halves_disagree),
            ("halves agree", halves_agree),
        ],
        states: 31_000,
        ..Case::settled()
    }
    .check();
}

#[test]
fn halves_divide_and_take() {
    Case {
        rounds: 2,
        takes: 1,
        begins_split: true,
        versions: 1,
        depth: Some(11),
        events: &[Event::Taken, Event::DecidedByFew, Event::Yielded],
        reached: &[("planned twice", planned_twice)],
        states: 340_000,
        ..Case::settled()
    }
    .check();
}

#[test]
fn halves_meet_in_a_round() {
    Case {
        rounds: 2,
        begins_split: true,
        late: true,
        versions: 1,
        depth: Some(12),
        events: &[Event::DecidedByFew, Event::Abandoned, Event::Yielded],
        reached: &[("planned twice", planned_twice)],
        states: 17_000,
        ..Case::settled()
    }
    .check();
}

#[test]
fn a_wrong_suspicion_costs_work_only() {
    Case {
        rounds: 2,
        suspicions: 1,
        versions: 1,
        events: &[Event::DecidedByFew, Event::Abandoned, Event::Yielded],
        reached: &[("planned twice", planned_twice)],
        states: 223_000,
        ..Case::settled()
    }
    .check();
}

#[test]
fn half_of_a_slow_owner_is_taken() {
    Case {
        takes: 1,
        suspicions: 1,
        impatient: true,
        events: &[Event::Halved, Event::Taken, Event::Yielded],
        reached: &[("planned twice", planned_twice)],
        states: 6_900,
        ..Case::settled()
    }
    .check();
}

#[test]
fn nobody_ends_before_the_end() {
    Case {
        cells: 4,
        flights: 4,
        suspicions: 1,
        reached: &[("one finished, others not", one_finished_others_not)],
        states: 103_000,
        ..Case::settled()
    }
    .check();
}

#[test]
fn the_end_comes_after_a_crash() {
    Case {
        cells: 4,
        flights: 4,
        takes: 1,
        crashes: 1,
        versions: 1,
        depth: Some(11),
        events: &[Event::Taken],
        reached: &[("all covered after a crash", all_covered_after_a_crash)],
        states: 320_000,
        ..Case::settled()
    }
    .check();
}
