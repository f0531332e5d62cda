//! What UAVs do against the diagram of their mission (`activity`): the state of a UAV changes
//! only along transitions whose events hold, and it takes those that do; and nobody ends a
//! mission by its timer before its time. Which events hold is told from orders, fuel, plans and
//! time, beside the peer's own evaluation of its diagram; of the flights of tasks and relay
//! positions only whether there may be one.

use super::{Clocks, Findings, PeerSnapshot, Snapshot};
use skein_peer::diagram::{Machine, MissionEvent, Part, StateGoal};
use skein_peer::output::Status;
use skein_peer::wire::detection::{Detection, Stands};
use skein_peer::wire::message::Order;
use skein_peer::wire::tasks::{Progress, TaskId};
use skein_peer::{Mission, WIND_CALMER_MPS};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// A peer looks four times a period, and a snapshot may fall between two looks: so many periods
/// it may be in another state than its events lead to.
const PERIODS: u64 = 3;

/// A state that was reached since the last snapshot lasts for so many periods at most.
const FRESH_PERIODS: u64 = 3;

/// Most transitions between two snapshots: a peer looks twice a quarter of a period.
const LOOKS: usize = 8;

/// What is known of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Holds {
    Yes,
    No,
    Maybe,
}

impl Holds {
    fn of(holds: bool) -> Self {
        if holds { Self::Yes } else { Self::No }
    }

    /// Of something that lasts from `low_ms` to `high_ms` by now, whether it lasts so long.
    fn past((low_ms, high_ms): (u64, u64), after_s: u32) -> Self {
        let after_ms = 1000 * u64::from(after_s);
        if low_ms >= after_ms {
            Self::Yes
        } else if high_ms < after_ms {
            Self::No
        } else {
            Self::Maybe
        }
    }
}

/// What was seen of a UAV in the last snapshot.
#[derive(Clone, Debug)]
struct Last {
    at: usize,
    revision: u32,
    /// When it was first seen in that state.
    entered_ms: u64,
    /// Whether it was seen in another one just before.
    came: bool,
    facts: BTreeMap<(MissionEvent, u32), bool>,
    /// What it knew to be found.
    told: BTreeSet<TaskId>,
}

#[derive(Clone, Debug)]
struct Flown {
    machine: Machine,
    sortie: u16,
    cancelled: bool,
}

/// What the states of one run were found to be.
#[derive(Clone, Debug, Default)]
pub struct ActivityCheck {
    missions: BTreeMap<u32, Arc<Flown>>,
    /// What an operator ever wanted: an order may come and go between two snapshots.
    ordered: Vec<Order>,
    last: BTreeMap<u16, Last>,
    /// Which sortie a process has, when it was first seen with it, and since when it may have it.
    began: BTreeMap<u16, (u16, u64, u64)>,
    /// When each process was last looked at, or started: who is silent for a twin is not looked at.
    looked_ms: BTreeMap<u16, u64>,
    /// Sorties that some UAV ended by its timer.
    ended: BTreeSet<u16>,
    /// The sortie in which a process knew of what ends it. Of what was told twice one is
    /// withdrawn, and who hears of that first has ended rightly all the same.
    found: BTreeMap<u16, u16>,
    /// Who was told of an object since it was looked at last.
    heard: BTreeSet<u16>,
    /// The goals to which the events of now lead, where they lead to one.
    wanted: BTreeMap<u16, StateGoal>,
    wrong: Clocks<u16>,
    early: BTreeSet<u16>,
}

impl ActivityCheck {
    /// The operator has a mission.
    pub fn on_mission(&mut self, mission: &Mission) {
        if let Ok(machine) = mission.machine() {
            let flown = Flown {
                machine,
                sortie: mission.sortie,
                cancelled: mission.cancelled,
            };
            self.missions.insert(mission.revision, Arc::new(flown));
        }
    }

    /// The operator gives an order.
    pub fn on_order(&mut self, order: Order) {
        if !self.ordered.contains(&order) {
            self.ordered.push(order);
        }
    }

    /// A process starts.
    pub fn on_boot(&mut self, now_ms: u64, id: u16) {
        self.looked_ms.insert(id, now_ms);
    }

    /// A process knows of an object that a mission looks for: it may be withdrawn before the next
    /// snapshot, and have ended that mission meanwhile.
    pub fn on_detected(&mut self, id: u16, told: &Detection) {
        if told.stands == Stands::Told {
            self.heard.insert(id);
            let known = self.found.entry(id).or_insert(told.sortie);
            *known = told.sortie.max(*known);
        }
    }

    /// A process ends, with all that it knew, or stands still (`death` is false).
    pub fn on_silent(&mut self, id: u16, death: bool) {
        self.last.remove(&id);
        self.wrong.stop(id);
        self.wanted.remove(&id);
        if death {
            self.began.remove(&id);
            self.early.remove(&id);
            self.found.remove(&id);
            self.heard.remove(&id);
        }
    }

    /// The goal to which the events lead that hold for a UAV, where they lead to one.
    #[must_use]
    pub fn wanted(&self, id: u16) -> Option<StateGoal> {
        self.wanted.get(&id).copied()
    }

    /// The goal of the state in which a UAV says that it is.
    #[must_use]
    pub fn goal(&self, m: &PeerSnapshot) -> Option<StateGoal> {
        let (at, _) = m.view.stage.filter(|_| m.view.loop_hash != 0)?;
        let flown = self.flown(m)?;
        flown.machine.states().get(at).map(|s| s.goal)
    }

    /// Whether a UAV is in a state in which its mission has it take part in no planning. Whether
    /// it is there rightly is judged here, too.
    #[must_use]
    pub fn stands_by(&self, m: &PeerSnapshot) -> bool {
        let state = m.view.stage.filter(|_| m.view.loop_hash != 0);
        let flown = self.flown(m);
        let state = state.and_then(|(at, _)| Some(flown.as_ref()?.machine.states().get(at)?.part));
        state.is_some_and(|part| part != Part::Takes)
    }

    /// Looks at the states of all UAVs.
    pub fn on_snapshot(&mut self, snapshot: &Snapshot<'_>, found: &mut Findings) {
        // Who ends a mission is heard at once: whoever may have been the first counts for all.
        let uavs = || snapshot.peers.iter().filter(|m| m.uav);
        for m in uavs() {
            self.on_order(m.view.order);
        }
        for may_be_first in [true, false] {
            for m in uavs() {
                self.judge_end(snapshot, m, may_be_first, found);
            }
        }
        for m in uavs() {
            self.look_at(snapshot, m, found);
        }
        self.heard.clear();
    }

    /// What is known of a UAV whose mission is known.
    fn facts<'a>(
        &mut self,
        snapshot: &Snapshot<'_>,
        m: &'a PeerSnapshot,
        flown: &'a Flown,
    ) -> Facts<'a> {
        let now_ms = snapshot.now_ms;
        let looked_ms = self.looked_ms.insert(m.id, now_ms).unwrap_or(now_ms);
        let began = self.began.entry(m.id);
        let began = began.or_insert((flown.sortie, now_ms, looked_ms));
        if began.0 != flown.sortie {
            *began = (flown.sortie, now_ms, looked_ms);
        }
        let (began_ms, may_ms) = (began.1, began.2);
        Facts {
            m,
            flown,
            full: snapshot.covered.is_full(),
            told_over: self.ended.contains(&flown.sortie),
            age_ms: (
                lasts(snapshot, m.id, began_ms).0,
                lasts(snapshot, m.id, may_ms).1,
            ),
            here_ms: None,
            fresh_ms: FRESH_PERIODS * snapshot.bounds.period_ms + snapshot.late_ms(m.id, began_ms),
        }
    }

    /// By what the mission of a UAV is flown.
    fn flown(&self, m: &PeerSnapshot) -> Option<Arc<Flown>> {
        let flown = self.missions.range(..=m.view.revision).next_back();
        flown.map(|(_, flown)| Arc::clone(flown))
    }

    fn look_at(&mut self, snapshot: &Snapshot<'_>, m: &PeerSnapshot, found: &mut Findings) {
        let (id, now_ms) = (m.id, snapshot.now_ms);
        let (Some((at, by)), Some(flown)) = (m.view.stage, self.flown(m)) else {
            self.on_silent(id, false);
            return;
        };
        let facts = self.facts(snapshot, m, &flown);
        let last = self.last.get(&id).filter(|l| {
            let same = self.missions.range(..=l.revision).next_back();
            same.is_some_and(|(_, f)| f.machine == flown.machine && f.sortie == flown.sortie)
        });
        let entered_ms = last.filter(|l| l.at == at).map_or(now_ms, |l| l.entered_ms);
        let last_at = last.map_or(at, |l| l.at);
        let (low_ms, high_ms) = lasts(snapshot, id, last.map_or(now_ms, |l| l.entered_ms));
        let came = last.is_some_and(|l| l.came || l.at != at);
        // Who was in it when it was first seen may have been so for long.
        let is_known = last.is_some_and(|l| l.came);
        let here_ms = (low_ms, if is_known { high_ms } else { u64::MAX });
        let facts = Facts {
            here_ms: Some((last_at, here_ms)),
            ..facts
        };
        // By the events of now alone: what is wanted of its flight.
        let mut to = BTreeSet::from([last_at]);
        for _ in 0..LOOKS {
            to = to.iter().flat_map(|s| facts.step(*s, &|_, h| h)).collect();
        }
        let goals: BTreeSet<&str> = to
            .iter()
            .map(|s| flown.machine.state(*s).goal.name())
            .collect();
        self.wanted.remove(&id);
        if let (1, Some(s)) = (goals.len(), to.first()) {
            self.wanted.insert(id, flown.machine.state(*s).goal);
        }
        // By those of now and of the last snapshot: where it may be.
        let before = last.map(|l| l.facts.clone()).unwrap_or_default();
        let either = |key: (MissionEvent, u32), now: Holds| match (before.get(&key), now) {
            (Some(true), Holds::No) | (Some(false), Holds::Yes) => Holds::Maybe,
            _ => now,
        };
        let mut may = BTreeSet::new();
        let mut from = BTreeSet::from([last_at]);
        for _ in 0..LOOKS {
            from = from.iter().flat_map(|s| facts.step(*s, &either)).collect();
            may.extend(from.iter().copied());
        }
        let is_first = last.is_none();
        // And where, whatever came and went between the two.
        let told: BTreeSet<TaskId> = facts.told().collect();
        // What was found is withdrawn, and a moment later found by another: in between it is not.
        let is_replaced = last.is_some_and(|l| l.told.is_disjoint(&told) && !told.is_empty());
        // Or it is found and withdrawn between two looks.
        let is_passing_by = is_replaced || self.heard.contains(&id);
        let passing = |key: (MissionEvent, u32), now: Holds| {
            if self.is_passing(key.0) || key.0 == MissionEvent::ObjectDetected && is_passing_by {
                Holds::Maybe
            } else {
                either(key, now)
            }
        };
        let mut reached = BTreeSet::from([last_at]);
        for _ in 0..LOOKS {
            let next = reached.iter().flat_map(|s| facts.step(*s, &passing));
            reached = next.chain(reached.iter().copied()).collect();
        }
        let jumped = !is_first && !reached.contains(&at);
        let next = Last {
            at,
            revision: m.view.revision,
            entered_ms,
            came,
            facts: facts.known(),
            told,
        };
        self.last.insert(id, next);
        if may.contains(&at) || is_first {
            self.wrong.stop(id);
            return;
        }
        let since_ms = self.wrong.start(id, now_ms).max(m.since_ms);
        let took_ms = now_ms.saturating_sub(since_ms);
        let bound_ms = snapshot.grown_ms(PERIODS * snapshot.bounds.period_ms, since_ms);
        // A late computer may have been where its events of long ago led.
        let is_late = snapshot.late_ms(id, since_ms) > 0;
        if (took_ms > bound_ms || jumped && !is_late) && self.wrong.tell_once(id) {
            let name = |s: usize| flown.machine.state(s).name.clone();
            let to: Vec<String> = to.iter().map(|s| name(*s)).collect();
            found.broken("activity", now_ms, Some(id), || {
                format!(
                    "is in the state {} by {}, and was in {}; its events lead to {}",
                    name(at),
                    by.name(),
                    name(last_at),
                    to.join(" or ")
                )
            });
        }
    }

    /// Who says that a mission is finished of which something is left, or that goes on once
    /// everything is seen, says that its time is over.
    fn judge_end(
        &mut self,
        snapshot: &Snapshot<'_>,
        m: &PeerSnapshot,
        may_be_first: bool,
        found: &mut Findings,
    ) {
        let Some(flown) = self.flown(m).filter(|_| m.view.finished) else {
            return;
        };
        let facts = self.facts(snapshot, m, &flown);
        let after_s = flown.machine.ends_after_s();
        let timer = after_s.map(|s| facts.holds(0, (MissionEvent::Timer, s)));
        if facts.is_found() {
            self.found.insert(m.id, flown.sortie);
        }
        if flown.machine.ends_when_found() && self.found.get(&m.id) == Some(&flown.sortie) {
            return;
        }
        if timer.is_some_and(|holds| holds != Holds::No) {
            // Also where everything is seen, and tasks of the mission kept it from its end.
            self.ended.insert(flown.sortie);
        } else if m.view.covered.is_full() && !flown.machine.goes_on() {
            // It ended by what was seen.
        } else if !may_be_first && self.early.insert(m.id) {
            found.broken("activity", snapshot.now_ms, Some(m.id), || {
                "says that its mission is finished before its time is over, and not everything is seen, or it was to go on then"
                    .to_owned()
            });
        }
    }

    /// Whether an event may hold between two snapshots and in neither: a run of one cell is taken
    /// and seen, a word is heard, an order comes late and the next one after it.
    fn is_passing(&self, on: MissionEvent) -> bool {
        match on {
            MissionEvent::CellsGiven
            | MissionEvent::TaskGiven
            | MissionEvent::TargetGiven
            | MissionEvent::TargetLost
            | MissionEvent::RelayGiven
            | MissionEvent::PeerLost
            | MissionEvent::NobodyHeard => true,
            MissionEvent::OperatorHold => self.ordered.contains(&Order::Hold),
            MissionEvent::OperatorReturn => self.ordered.contains(&Order::ReturnToBase),
            _ => false,
        }
    }
}

/// How long something lasts for a peer that was first seen then: at least, and at most. By its
/// own clock, whether that runs fast or jumps.
fn lasts(snapshot: &Snapshot<'_>, id: u16, from_ms: u64) -> (u64, u64) {
    let now_ms = snapshot.now_ms;
    let slack_ms = 2 * snapshot.bounds.period_ms;
    // It began before it was seen, and its clock may have jumped in between.
    let before_ms = from_ms.saturating_sub(slack_ms);
    let all = [
        now_ms.saturating_sub(from_ms),
        snapshot.lived_ms(id, from_ms),
        snapshot.handicaps.shown_ms(id, from_ms, now_ms),
        snapshot
            .handicaps
            .shown_ms(id, before_ms, now_ms)
            .saturating_sub(from_ms - before_ms),
    ];
    let (low_ms, high_ms) = all.iter().fold((u64::MAX, 0), |(low, high), ms| {
        (low.min(*ms), high.max(*ms))
    });
    let late_ms = snapshot.late_ms(id, from_ms);
    (
        low_ms.saturating_sub(slack_ms),
        high_ms.saturating_add(slack_ms + late_ms),
    )
}

/// What a UAV believes and the world knows, beside the diagram that it obeys.
#[derive(Clone, Copy)]
struct Facts<'a> {
    m: &'a PeerSnapshot,
    flown: &'a Flown,
    /// Whether everything was seen.
    full: bool,
    /// Whether somebody ended this sortie by its timer.
    told_over: bool,
    /// For how long it follows this sortie.
    age_ms: (u64, u64),
    /// In which state it was, and for how long.
    here_ms: Option<(usize, (u64, u64))>,
    /// For how long it may be in a state to which it came since the last snapshot.
    fresh_ms: u64,
}

impl Facts<'_> {
    fn holds(&self, at: usize, (on, amount): (MissionEvent, u32)) -> Holds {
        let view = &self.m.view;
        let claims = view.tasks.iter();
        let mut claims =
            claims.filter(|(.., p)| matches!(p, Progress::Committed | Progress::Begun));
        match on {
            MissionEvent::OperatorHold => Holds::of(view.order == Order::Hold),
            MissionEvent::OperatorReturn => Holds::of(view.order == Order::ReturnToBase),
            MissionEvent::MissionCancelled => Holds::of(self.flown.cancelled),
            // Of a mission that ends by its timer somebody may be finished with cells left.
            MissionEvent::MissionComplete if view.finished && self.ends() => {
                if self.full || view.covered.is_full() {
                    Holds::Maybe
                } else {
                    Holds::No
                }
            }
            // Where it goes on, tasks may be open that nobody here knows of.
            MissionEvent::MissionComplete if self.flown.machine.goes_on() => {
                if view.covered.is_full() {
                    Holds::Maybe
                } else {
                    Holds::No
                }
            }
            MissionEvent::MissionComplete => Holds::of(view.finished),
            MissionEvent::LowFuel => Holds::of(view.is_fuel_due),
            MissionEvent::TwinSpeaks => Holds::of(view.is_silent),
            MissionEvent::Timer => match Holds::past(self.age_ms, amount) {
                Holds::No if self.told_over => Holds::Maybe,
                holds => holds,
            },
            MissionEvent::Stayed => {
                let here = self.here_ms.filter(|(s, _)| *s == at);
                let fresh = (0, self.here_ms.map_or(u64::MAX, |_| self.fresh_ms));
                Holds::past(here.map_or(fresh, |(_, ms)| ms), amount)
            }
            MissionEvent::PeerLost => {
                Holds::of(view.peers.values().any(|(_, s)| *s == Status::Down))
            }
            // What was lost since it came to this state it knows best.
            MissionEvent::PeerBack => Holds::of(view.missed),
            MissionEvent::WindAbove => self.is_windy(f64::from(amount) / 10.0),
            MissionEvent::PlanInfeasible => Holds::of(view.cannot_fly_all),
            MissionEvent::ObjectDetected => Holds::of(self.is_found()),
            MissionEvent::CrowdDense => {
                Holds::of(view.crowd.iter().any(|(_, s)| s.dense().is_some()))
            }
            MissionEvent::TargetLost if view.relays => Holds::Maybe,
            MissionEvent::TargetLost => Holds::No,
            MissionEvent::TargetGiven | MissionEvent::RelayGiven if view.relays => Holds::Maybe,
            MissionEvent::TaskGiven if claims.next().is_some() => Holds::Maybe,
            MissionEvent::TargetGiven | MissionEvent::RelayGiven | MissionEvent::TaskGiven => {
                Holds::No
            }
            MissionEvent::CellsGiven => Holds::of(!view.plan.is_empty()),
            MissionEvent::AllSeen => Holds::of(view.covered.is_full()),
            MissionEvent::NobodyHeard => Holds::of(view.astray),
            MissionEvent::Otherwise => Holds::Yes,
        }
    }

    /// Whether it takes the wind for one above so much. What it came to its state by holds on for
    /// a while.
    fn is_windy(&self, above_mps: f64) -> Holds {
        let Some((east_mps, north_mps)) = self.m.view.wind_mps else {
            return Holds::No;
        };
        let mps = east_mps.hypot(north_mps);
        if mps > above_mps {
            Holds::Yes
        } else if self.came_by(MissionEvent::WindAbove) && mps + WIND_CALMER_MPS > above_mps {
            Holds::Maybe
        } else {
            Holds::No
        }
    }

    fn came_by(&self, event: MissionEvent) -> bool {
        self.m.view.stage.is_some_and(|(_, by)| by == event)
    }

    fn ends(&self) -> bool {
        let machine = &self.flown.machine;
        machine.ends_after_s().is_some() || machine.ends_when_found()
    }

    /// Whether it knows of something that its mission looks for. Whether that is there is judged
    /// by a rule of its own.
    fn is_found(&self) -> bool {
        self.told().next().is_some()
    }

    /// What it knows of that its mission looks for.
    fn told(&self) -> impl Iterator<Item = TaskId> {
        let all = self.m.view.detections.iter();
        let told = all.filter(|(_, d)| d.stands == Stands::Told && d.sortie == self.flown.sortie);
        told.map(|(id, _)| *id)
    }

    /// To which states one look may lead from there.
    fn step(&self, at: usize, heed: &dyn Fn((MissionEvent, u32), Holds) -> Holds) -> Vec<usize> {
        let mut to = Vec::new();
        for way in self.flown.machine.ways(at) {
            let key = (way.on, way.amount);
            match heed(key, self.holds(at, key)) {
                Holds::Yes => {
                    to.push(way.to);
                    return to;
                }
                Holds::Maybe => to.push(way.to),
                Holds::No => {}
            }
        }
        to.push(at);
        to
    }

    /// What is known of all events.
    fn known(&self) -> BTreeMap<(MissionEvent, u32), bool> {
        let machine = &self.flown.machine;
        let ways =
            (0..machine.states().len()).flat_map(|s| machine.ways(s).iter().map(move |w| (s, w)));
        let known = ways.filter(|(_, w)| !w.on.is_timed()).map(|(s, w)| {
            let key = (w.on, w.amount);
            (key, self.holds(s, key))
        });
        known
            .filter(|(_, h)| *h != Holds::Maybe)
            .map(|(key, h)| (key, h == Holds::Yes))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::{Story, speaking};
    use super::*;
    use crate::world::fixture;
    use skein_peer::Beliefs;
    use skein_peer::Mission;
    use skein_peer::diagram::{State, Transition};
    use std::sync::Arc;

    fn mission() -> Arc<Mission> {
        fixture::square(1).mission
    }

    /// Whether the rule is broken when peer 1 says this after each second.
    fn broken(seconds: u64, view: impl Fn(u64) -> Beliefs) -> bool {
        let (mut story, mut found) = (Story::new(300), Findings::new(1));
        let mut check = ActivityCheck::default();
        check.on_mission(&mission());
        for t in 0..seconds {
            story.snapshot(t * 1000, &[(1, view(t))], |s| {
                check.on_snapshot(s, &mut found);
            });
        }
        found.counts.contains_key("activity")
    }

    /// A state of the default diagram.
    fn in_state(name: &str, view: Beliefs) -> Beliefs {
        let machine = mission().machine().unwrap();
        let at = machine.states().iter().position(|s| s.name == name);
        Beliefs {
            stage: at.map(|at| (at, MissionEvent::Otherwise)),
            ..view
        }
    }

    /// The default mission with one state more, in which its UAVs are at home as well, and the
    /// event that leads there.
    fn with_state(
        name: &str,
        part: Option<Part>,
        (on, above_dmps): (MissionEvent, u32),
    ) -> Mission {
        let mut diagram = mission().flown_by().into_owned();
        let mut all = diagram.states.iter();
        let home = all.find(|s| s.name == "recalled").unwrap();
        let state = State {
            name: name.into(),
            part: part.unwrap_or(home.part),
            ..home.clone()
        };
        diagram.states.push(state);
        for t in &mut diagram.transitions {
            t.priority *= 2;
        }
        let mut all = diagram.transitions.iter();
        let low_fuel = all.find(|t| t.on == MissionEvent::LowFuel).unwrap();
        let leads = Transition {
            from: None,
            on,
            after_s: 0,
            above_dmps,
            to: name.into(),
            priority: low_fuel.priority + 1,
        };
        diagram.transitions.push(leads);
        Mission {
            diagram: Some(Arc::new(diagram)),
            ..(*mission()).clone()
        }
    }

    fn flying() -> Beliefs {
        Beliefs {
            plan: vec![1, 2],
            ..speaking()
        }
    }

    #[test]
    fn who_does_not_what_its_diagram_says_is_found() {
        assert!(!broken(20, |_| in_state("section", flying())));
        assert!(!broken(20, |_| in_state("wait", speaking())));
        // It has cells, and waits.
        assert!(broken(20, |_| in_state("wait", flying())));
        assert!(!broken(3, |_| in_state("wait", flying())));
        let due = || Beliefs {
            is_fuel_due: true,
            ..flying()
        };
        assert!(broken(20, |_| in_state("section", due())));
        assert!(!broken(20, |_| in_state("home", due())));
        let told = || Beliefs {
            order: Order::Hold,
            is_fuel_due: true,
            ..flying()
        };
        assert!(broken(20, |_| in_state("home", told())));
        assert!(!broken(20, |_| in_state("hold", told())));
    }

    #[test]
    fn a_state_that_no_event_led_to_is_found_at_once() {
        let jumps = |t| match t {
            9.. => in_state("recalled", flying()),
            _ => in_state("section", flying()),
        };
        assert!(broken(10, jumps));
        assert!(!broken(9, jumps));
        // Cells may come and go between two snapshots, and an event may end with one.
        let ends = |t| match t {
            9 => in_state("section", speaking()),
            7 | 10.. => in_state("wait", speaking()),
            _ => in_state("section", flying()),
        };
        assert!(!broken(30, ends));
    }

    #[test]
    fn an_order_that_came_and_went_leads_somewhere_where_one_was_given() {
        let held_once = |ordered: Option<u64>| {
            broken(20, move |t| match t {
                _ if Some(t) == ordered => Beliefs {
                    order: Order::Hold,
                    ..in_state("hold", flying())
                },
                9 => in_state("hold", flying()),
                _ => in_state("section", flying()),
            })
        };
        assert!(!held_once(Some(4)));
        assert!(held_once(None) && held_once(Some(12)));
    }

    #[test]
    fn who_was_silent_may_have_its_mission_since_its_process_started() {
        let (mut story, mut check) = (Story::new(0), ActivityCheck::default());
        check.on_mission(&mission());
        check.on_boot(10_000, 1);
        let mut age_ms = |now_ms| {
            let mut age_ms = (0, 0);
            story.snapshot(now_ms, &[(1, flying())], |s| {
                let flown = check.flown(&s.peers[0]).unwrap();
                age_ms = check.facts(s, &s.peers[0], &flown).age_ms;
            });
            age_ms
        };
        assert_eq!(age_ms(100_000), (0, 92_000));
        assert_eq!(age_ms(130_000), (28_000, 122_000));
    }

    #[test]
    fn a_clock_that_jumped_just_before_the_first_look_counts_too() {
        let mut story = Story::new(0);
        let jump = crate::fault::Fault::ClockJump {
            peer: 1,
            ahead_ms: 45_000,
        };
        story.handicaps.on_fault(700, &jump);
        let mut at = |from_ms| {
            let mut both = (0, 0);
            story.snapshot(100_000, &[(1, speaking())], |s| both = lasts(s, 1, from_ms));
            both
        };
        assert_eq!(at(1_000), (97_000, 146_000));
        assert_eq!(at(3_000), (95_000, 99_000));
    }

    #[test]
    fn what_a_uav_came_home_for_in_a_wind_holds_on_for_a_while() {
        let mission = with_state("shelter", None, (MissionEvent::WindAbove, 60));
        let machine = mission.machine().unwrap();
        let broken = |views: &[(&str, MissionEvent, f64)]| {
            let (mut story, mut found) = (Story::new(0), Findings::new(1));
            let mut check = ActivityCheck::default();
            check.on_mission(&mission);
            let each = views.iter().flat_map(|v| [v; 8]);
            for (t, (name, by, mps)) in (0..).zip(each) {
                let at = machine
                    .states()
                    .iter()
                    .position(|s| s.name == *name)
                    .unwrap();
                let plan = if *name == "section" {
                    vec![1, 2]
                } else {
                    Vec::new()
                };
                let view = Beliefs {
                    stage: Some((at, *by)),
                    wind_mps: Some((0.0, *mps)),
                    plan,
                    ..speaking()
                };
                story.snapshot(t * 1000, &[(1, view)], |s| check.on_snapshot(s, &mut found));
            }
            found.counts.contains_key("activity")
        };
        let (covers, came, waits) = (
            MissionEvent::CellsGiven,
            MissionEvent::WindAbove,
            MissionEvent::Otherwise,
        );
        assert!(!broken(&[
            ("section", covers, 5.9),
            ("shelter", came, 6.1),
            ("shelter", came, 5.2)
        ]));
        assert!(broken(&[
            ("section", covers, 5.9),
            ("section", covers, 6.1)
        ]));
        assert!(broken(&[("section", covers, 5.9), ("shelter", came, 4.9)]));
        assert!(broken(&[
            ("section", covers, 5.9),
            ("shelter", came, 6.1),
            ("shelter", came, 4.9)
        ]));
        assert!(!broken(&[("shelter", came, 6.1), ("wait", waits, 4.9)]));
    }

    #[test]
    fn who_ended_by_what_was_found_has_ended_rightly_when_that_is_withdrawn() {
        let mission = with_state("found", Some(Part::Ends), (MissionEvent::ObjectDetected, 0));
        let found = mission.machine().unwrap();
        let found = found.states().iter().position(|s| s.name == "found");
        let broken = |stands: &[Stands]| {
            let (mut story, mut findings) = (Story::new(0), Findings::new(1));
            let mut check = ActivityCheck::default();
            check.on_mission(&mission);
            for (t, stands) in (0..).zip(stands) {
                let told = Detection {
                    stands: *stands,
                    ..Detection::default()
                };
                let id = TaskId {
                    author: 2,
                    number: 8,
                };
                let view = Beliefs {
                    finished: true,
                    stage: found.map(|at| (at, MissionEvent::ObjectDetected)),
                    detections: vec![(id, told)],
                    ..speaking()
                };
                story.snapshot(t * 1000, &[(1, view)], |s| {
                    check.on_snapshot(s, &mut findings)
                });
            }
            findings.counts.contains_key("activity")
        };
        assert!(!broken(&[
            Stands::Told,
            Stands::Withdrawn,
            Stands::Withdrawn
        ]));
        assert!(broken(&[Stands::Withdrawn]));
    }

    /// It hears of it, ends, and hears that it is withdrawn, all between two snapshots.
    #[test]
    fn who_heard_of_it_between_two_snapshots_has_ended_rightly_too() {
        let ends = with_state("found", Some(Part::Ends), (MissionEvent::ObjectDetected, 0));
        let goes_on = with_state("found", None, (MissionEvent::ObjectDetected, 0));
        let broken = |mission: &Mission, heard: Option<Detection>| {
            let (mut story, mut findings) = (Story::new(0), Findings::new(1));
            let mut check = ActivityCheck::default();
            check.on_mission(mission);
            if let Some(told) = heard {
                check.on_detected(1, &told);
            }
            let view = Beliefs {
                finished: true,
                ..speaking()
            };
            story.snapshot(0, &[(1, view)], |s| check.on_snapshot(s, &mut findings));
            findings.counts.contains_key("activity")
        };
        let told = |sortie| Detection {
            sortie,
            ..Detection::default()
        };
        assert!(!broken(&ends, Some(told(ends.sortie))));
        assert!(broken(&ends, None));
        assert!(broken(&ends, Some(told(ends.sortie + 1))));
        assert!(broken(&goes_on, Some(told(ends.sortie))));
        let withdrawn = Detection {
            stands: Stands::Withdrawn,
            ..told(ends.sortie)
        };
        assert!(broken(&ends, Some(withdrawn)));
    }

    #[test]
    fn what_was_found_and_withdrawn_between_two_looks_leads_on() {
        let mission = with_state("found", Some(Part::Ends), (MissionEvent::ObjectDetected, 0));
        let machine = mission.machine().unwrap();
        let at = |name| machine.states().iter().position(|s| s.name == name);
        let broken = |told_before: Option<usize>| {
            let (mut story, mut findings) = (Story::new(0), Findings::new(1));
            let mut check = ActivityCheck::default();
            check.on_mission(&mission);
            for (t, name) in ["wait", "wait", "found"].into_iter().enumerate() {
                if told_before == Some(t) {
                    check.on_detected(1, &Detection::default());
                }
                let view = Beliefs {
                    stage: at(name).map(|at| (at, MissionEvent::Otherwise)),
                    ..speaking()
                };
                story.snapshot(t as u64 * 1000, &[(1, view)], |s| {
                    check.on_snapshot(s, &mut findings)
                });
            }
            findings.counts.contains_key("activity")
        };
        assert!(!broken(Some(2)));
        assert!(broken(None));
        assert!(broken(Some(1)), "it was looked at since");
    }

    /// It came from a task when what was found was withdrawn, and waits; then another tells the
    /// same thing.
    #[test]
    fn what_is_found_again_by_another_was_not_found_in_between() {
        let mission = with_state("found", Some(Part::Ends), (MissionEvent::ObjectDetected, 0));
        let machine = mission.machine().unwrap();
        let at = |name| {
            machine
                .states()
                .iter()
                .position(|s| s.name == name)
                .unwrap()
        };
        let broken = |second: u16| {
            let (mut story, mut findings) = (Story::new(0), Findings::new(1));
            let mut check = ActivityCheck::default();
            check.on_mission(&mission);
            let states = [
                ("task", 2),
                ("task", 2),
                ("wait", second),
                ("found", second),
            ];
            for (t, (name, author)) in (0..).zip(states) {
                let told = Detection {
                    stands: Stands::Told,
                    ..Detection::default()
                };
                let view = Beliefs {
                    stage: Some((at(name), MissionEvent::Otherwise)),
                    detections: vec![(TaskId { author, number: 8 }, told)],
                    ..speaking()
                };
                story.snapshot(t * 1000, &[(1, view)], |s| {
                    check.on_snapshot(s, &mut findings)
                });
            }
            findings.counts.contains_key("activity")
        };
        assert!(!broken(3));
        assert!(broken(2), "it was found all the time");
    }

    #[test]
    fn who_is_finished_with_cells_left_is_found_where_no_timer_ends_the_mission() {
        let finished = || Beliefs {
            finished: true,
            ..speaking()
        };
        assert!(broken(2, |_| in_state("home", finished())));
        let all = || {
            let mut covered = skein_peer::cells::CellSet::new(4);
            (0..4).for_each(|c| {
                covered.insert(c);
            });
            Beliefs {
                covered,
                ..finished()
            }
        };
        assert!(!broken(20, |_| in_state("home", all())));
    }
}
