//! Tasks other than coverage in a mission (D2.7 §1.2.3, §1.3, §3.2): what of them this peer
//! knows, its part in the auction, and the one that its UAV flies.
//!
//! | event | what follows |
//! |---|---|
//! | a task is heard, revised, over | the auction is told while a task is open |
//! | a bundle is heard | likewise; what it says to be done is done |
//! | a period passes | likewise, with the present offer and who lives |
//! | the auction gives a task to fly | its flight is planned beside the loop |
//! | the flight is planned | it is flown between two cells of the section |
//! | it is a relay position, or a target to follow | the section is given up at once; the circle is flown, or the target followed, until the task is over |
//! | the circle is reached, a first piece of a line or an area is seen | begun: told |
//! | the fuel lasts for as long as it takes others to come | others are asked to relieve it; it stays until one has begun |
//! | all of it is seen | done: told, and the UAV is free for the next |
//! | the flight is over and not all is seen, there is none | once more, then others are asked to relieve it |
//! | the auction drops it, the fuel is due, the operator says return, another life begins | it is left |
//! | what it claims its mission, as it stands, does not lead it to | it is let go |
//! | its time is over | it is expired |
//! | a ground station: somebody did a task of its operator, its time is over | that is told in the task's next revision |
//!
//! While no task is open nothing is said.

mod brought;
mod circles;
mod counts;
mod crowds;
mod detecting;
mod relaying;
mod serving;
mod tracking;
mod using;

use crate::beliefs::Beliefs;
use crate::config::{PeerConfig, Role};
use crate::cooperation::Situation;
use crate::counting::Counting;
use crate::detections::Detections;
use crate::effect::{Effect, Effects, PendingJob};
use crate::errand::{Planned, Request};
use crate::gathering::Gathering;
use crate::input::Time;
use crate::mission::mm;
use crate::mission_state::{MissionState, RelayPosition, speed_mmps};
use crate::offload::Job;
use crate::output::{Report, TaskNews};
use crate::protocol::auction::flown::RoutedTime;
use crate::protocol::auction::{self, Auction, Event, KNOWN_MAX, Version};
use crate::targets::Targets;
use crate::task_desk::TaskHolder;
use crate::usage::Using;
use crate::wire::codec::Body;
use crate::wire::limits::{DURATION_MAX_MS, PEERS_MAX};
use crate::wire::message::{Member, Record};
use crate::wire::tasks::{
    Bundle, BundleTask, DoneTask, Offer, Progress, Task, TaskId, TaskKind, TaskState, sensor_name,
};
use crate::{Incarnation, PeerId};
use brought::is_brought;
pub use brought::{BROUGHT_MAX, MISSION};
pub use circles::circled_sector;
use circles::{Circles, flies_circles};
use relaying::Held;
pub(crate) use relaying::KEPT_FOR_COVER;
pub use serving::Call;
use skein_behaviors::executive::detour::Watched;
use skein_behaviors::{Order, Percept};
use skein_flight::airframe::Airframe;
use skein_geometry::hash::{Fnv, folded};
use skein_geometry::math::wrap_pi;
use std::collections::{BTreeMap, BTreeSet};
use std::hash::{Hash, Hasher};
use std::sync::Arc;
pub use tracking::Follows;

/// A task whose flight did not see all of it is flown once more, then others are asked.
const MAX_TRIES: u8 = 2;

/// What nobody could do is offered for again after so many beacon periods, where that may
/// have changed: a section is flown meanwhile.
const AGAIN_PERIODS: u64 = 20;

/// A task that is known.
#[derive(Clone, Debug)]
pub(crate) struct Known {
    pub task: Task,
    /// When it was heard of, or asked for here.
    pub since: Time,
    /// Who did it, and when that was known here.
    pub done: Option<(u16, Time)>,
    /// Whether people were told that nobody can do it.
    hopeless_told: bool,
}

impl Known {
    /// Whether somebody has yet to do it.
    pub fn is_open(&self) -> bool {
        self.task.is_open() && self.done.is_none()
    }

    /// Whether somebody did it, and who asked for it has not told so.
    fn is_newly_done(&self) -> bool {
        self.task.is_open() && self.done.is_some()
    }

    /// The task in its next revision, by which who asked for it tells that it is over: done, where
    /// somebody did it, else as it stands.
    fn ended(&self, now: Time) -> Task {
        let mut task = self.task.clone();
        task.revision = task.revision.saturating_add(1);
        let over_at = self.done.map_or(now, |(_, at)| at);
        task.over_after_ms = after_ms(over_at, self.since);
        if let Some((by, _)) = self.done {
            (task.state, task.done_by) = (TaskState::Done, by);
        }
        task
    }
}

/// The task that the UAV flies.
#[derive(Clone, Debug)]
struct Flown {
    id: TaskId,
    revision: u32,
    tries: u8,
    /// Whether its flight is the goal.
    is_planned: bool,
    /// Of a relay position, how far it is with it.
    held: Option<Held>,
}

/// Tasks as one peer has them.
#[derive(Debug)]
pub(crate) struct Tasking {
    me: u16,
    flies: Option<Airframe>,
    sensors: u32,
    pub(crate) auction: Auction,
    pub(crate) known: BTreeMap<TaskId, Known>,
    pub(crate) bundles: BTreeMap<PeerId, (Version, Bundle)>,
    /// What the auction was not told yet.
    news: BTreeSet<TaskId>,
    heard: BTreeSet<PeerId>,
    flown: Option<Flown>,
    /// Vehicles that were seen.
    pub(crate) targets: Targets,
    /// What of them the mission looks for.
    pub(crate) detections: Detections,
    /// What it and others counted at its sites.
    pub(crate) counting: Counting,
    /// And how they saw its streets used.
    pub(crate) using: Using,
    /// And who is where at the event that it watches.
    pub(crate) gathering: Gathering,
    circles: Circles,
    /// The version of the bundle that was spoken last.
    spoken: Option<Version>,
    /// Tasks of others that this peer's operator said to be done, ascending.
    said_done: Vec<DoneTask>,
    /// The life in which the tasks of this peer's operator were spoken.
    told_in: Incarnation,
    last_period: Time,
    last_again: Time,
    was_able: bool,
}

impl Tasking {
    /// Nothing is known.
    pub fn new(config: &PeerConfig) -> Self {
        Self {
            me: config.id.0,
            flies: config.airframe.filter(|_| config.role == Role::Uav),
            sensors: config.sensors,
            auction: Auction::new(config.id, 0, Offer::default()),
            known: BTreeMap::new(),
            bundles: BTreeMap::new(),
            news: BTreeSet::new(),
            heard: BTreeSet::new(),
            flown: None,
            targets: Targets::new(
                config.id.0,
                config.airframe.filter(|_| config.role == Role::Uav),
            ),
            detections: Detections::default(),
            counting: Counting::new(config.id.0),
            using: Using::new(config.id.0),
            gathering: Gathering::new(config.id.0),
            circles: Circles::default(),
            spoken: None,
            said_done: Vec::new(),
            told_in: 0,
            last_period: Time(0),
            last_again: Time(0),
            was_able: false,
        }
    }

    /// A life begins, or another process silences this one: what it held is void.
    pub fn void_ownership(&mut self, me: Member, state: Option<&mut MissionState>) {
        self.auction.begin_life(me.incarnation);
        self.targets.begin_life(me.incarnation);
        self.detections.begin_life(me.incarnation);
        self.counting.begin_life(me.incarnation);
        self.using.begin_life(me.incarnation);
        self.gathering.begin_life(me.incarnation);
        self.spoken = None;
        self.leave(state);
    }

    /// The UAV is on no errand any more.
    fn leave(&mut self, state: Option<&mut MissionState>) {
        if self.flown.take().is_some()
            && let Some(state) = state
        {
            state.set_errand(None);
            state.relay = None;
        }
    }

    /// Who this peer is.
    pub fn me_id(&self) -> u16 {
        self.me
    }

    /// The tasks of this peer's own operator.
    pub fn own(&self) -> impl Iterator<Item = (&TaskId, &Known)> {
        self.known.iter().filter(|(id, _)| id.author == self.me)
    }

    /// What the own operator asked for is said again, also where this life said what it knew of that
    /// before: what an earlier life said nobody passes on to those who come.
    pub fn say_anew(&mut self) {
        self.told_in = 0;
    }

    /// A task was asked for at this time, not when it was heard of.
    pub fn was_asked(&mut self, id: TaskId, since: Time) {
        if let Some(known) = self.known.get_mut(&id) {
            known.since = since;
        }
    }

    /// The task that the UAV flies to.
    pub fn flown(&self) -> Option<TaskId> {
        self.flown.as_ref().map(|f| f.id)
    }

    /// Whether a task is open that somebody can do, as far as is known; a relay position keeps
    /// nobody in the air but who holds it. Where its time ends the mission it is open for who can
    /// do nothing, too: others may, and are told by `finished` that the time is over.
    fn has_work(&self, ends_by_time: bool) -> bool {
        let hopeless = self.auction.unassigned();
        let hopeless = |id: &TaskId| !ends_by_time && hopeless.contains(id);
        let mine = |id: &TaskId| self.flown() == Some(*id);
        let mut open = self.known.iter().filter(|(_, k)| k.is_open());
        // What a mission brings is a part of it.
        let keeps = |id: &TaskId, k: &Known| !k.task.is_held() || is_brought(*id) || mine(id);
        open.any(|(id, k)| !hopeless(id) && keeps(id, k))
    }

    /// What it holds, and what of all it knows to be open that somebody can do.
    pub fn fill(&self, beliefs: &mut Beliefs) {
        beliefs.follows = self.follows();
        beliefs.loads.extend(self.targets.loads());
        let held = self.auction.held().iter();
        let said = self.said_done.iter();
        let said = said.map(|d| (d.task, d.revision, Progress::Done));
        let held = held.map(|t| (t.task, t.revision, t.progress));
        beliefs.tasks = held.chain(said).collect();
        let hopeless = self.auction.unassigned();
        let open = self.known.iter().filter(|(_, k)| k.is_open());
        let open = open.filter(|(id, _)| !hopeless.contains(id));
        beliefs.open_tasks = open.map(|(id, k)| (*id, k.task.revision)).collect();
        let standing = self.detections.known();
        beliefs.detections = standing.map(|(id, d)| (id, *d)).collect();
        beliefs.loads.push(("tasks", self.known.len(), KNOWN_MAX));
        beliefs
            .loads
            .push(("bundles", self.bundles.len(), PEERS_MAX));
        let detections = self.detections.known().count();
        let cap = crate::detections::KNOWN_MAX;
        beliefs.loads.push(("detections", detections, cap));
        let cap = crate::counting::KNOWN_MAX;
        beliefs.loads.push(("counts", self.counting.len(), cap));
        let cap = crate::usage::KNOWN_MAX;
        beliefs.loads.push(("usages", self.using.len(), cap));
        let cap = crate::gathering::KNOWN_MAX;
        beliefs.loads.push(("sectors", self.gathering.len(), cap));
        beliefs.crowd = self.gathering.followed().collect();
    }

    /// Whether anything is to be settled or flown.
    fn is_active(&self) -> bool {
        let claims = |t: &BundleTask| t.progress != Progress::Done;
        self.known.values().any(Known::is_open)
            || self.flown.is_some()
            || self.auction.held().iter().any(claims)
    }

    /// A record of another peer.
    pub fn hear(&mut self, now: Time, record: &Record, body: &Body) -> Effects {
        match body {
            Body::Target(target) => {
                self.targets.hear(now, record.author, target);
                Effects::new()
            }
            Body::Detection(told) => self.hear_detection(record, told),
            Body::Count(count) => {
                let by = (record.author, record.incarnation);
                self.counting.hear(by, record.subject, count);
                Effects::new()
            }
            Body::Usage(usage) => {
                let by = (record.author, record.incarnation);
                self.using.hear(by, record.subject, usage);
                Effects::new()
            }
            Body::Crowd(tile) => self.gathering.hear(now, record.subject, tile),
            Body::Task(task) => {
                let id = TaskId {
                    author: record.author,
                    number: record.subject,
                };
                self.learn(now, id, task.clone())
            }
            Body::Bundle(bundle) => {
                let author = PeerId(record.author);
                let version = (record.incarnation, record.seq);
                let held = self.bundles.get(&author).map(|(v, _)| *v);
                let room = self.bundles.len() < PEERS_MAX;
                if author.0 == self.me || !held.map_or(room, |v| version > v) {
                    return Effects::new();
                }
                let mut effects = Effects::new();
                for (task, revision) in done_in(bundle) {
                    effects.extend(self.note_done(now, task, revision, author.0));
                }
                self.bundles.insert(author, (version, bundle.clone()));
                self.heard.insert(author);
                effects.push(Effect::Negotiate);
                effects
            }
            _ => Effects::new(),
        }
    }

    /// A task, a change of one, or its end.
    pub fn learn(&mut self, now: Time, id: TaskId, task: Task) -> Effects {
        let held = self.known.get(&id);
        let room = self.known.len() < KNOWN_MAX;
        if !held.map_or(room, |k| task > k.task) {
            return Effects::new();
        }
        let asked = task.revision_as_asked();
        let same = held.filter(|k| k.task.revision_as_asked() == asked);
        let by = (task.state == TaskState::Done).then_some(task.done_by);
        let by = by.or_else(|| self.told_done(id, asked));
        let known = Known {
            since: same.map_or(now, |k| k.since),
            done: same.and_then(|k| k.done).or(by.map(|by| (by, now))),
            hopeless_told: false,
            task,
        };
        let news = match known.task.state {
            TaskState::Open => TaskNews::Asked,
            over => TaskNews::Over(over),
        };
        let report = report(id, &known.task, news);
        self.known.insert(id, known);
        self.news.insert(id);
        vec![report, Effect::Negotiate]
    }

    /// Who said to have done a task before it was known.
    fn told_done(&self, id: TaskId, revision: u32) -> Option<u16> {
        let is_it = |b: &Bundle| done_in(b).contains(&(id, revision));
        let mut all = self.bundles.iter();
        let other = all.find(|(_, (_, b))| is_it(b)).map(|(peer, _)| peer.0);
        let said = |d: &DoneTask| (d.task, d.revision) == (id, revision);
        other.or_else(|| self.said_done.iter().any(said).then_some(self.me))
    }

    fn note_done(&mut self, now: Time, id: TaskId, revision: u32, by: u16) -> Option<Effect> {
        let known = self.known.get_mut(&id)?;
        if known.done.is_some() || known.task.revision_as_asked() != revision {
            return None;
        }
        known.done = Some((by, now));
        Some(report(id, &known.task, TaskNews::DoneBy(PeerId(by))))
    }

    /// Tasks whose time is over are over for this peer, whoever says so.
    fn expire(&mut self, now: Time) -> Vec<TaskId> {
        let is_late = |k: &Known| {
            let within_ms = u64::from(k.task.within_ms);
            k.is_open() && within_ms > 0 && now.since_ms(k.since) >= within_ms
        };
        let late = self.known.iter_mut().filter(|(_, k)| is_late(k));
        let mut expired = Vec::new();
        for (id, known) in late {
            known.task.state = TaskState::Expired;
            self.news.insert(*id);
            expired.push(*id);
        }
        expired
    }

    /// Looks at everything that depends on time, and at what was heard.
    pub fn tick(&mut self, s: &Situation<'_>, order: Order, state: &mut MissionState) -> Effects {
        let sortie = state.geometry.mission.sortie;
        state.detected = self.detections.standing(sortie).next().is_some();
        state.too_dense = self.gathering.dense().next().is_some();
        if s.role == Role::GroundStation {
            let keeps = |k: &Known| k.is_open() && !k.task.is_held();
            state.has_tasks = self.known.values().any(keeps);
            let mut effects = self.void_former(s);
            let (mission, ended) = (&state.geometry.mission, state.stage.ended());
            effects.extend(self.take_brought(s.now, mission, ended));
            effects.extend(self.tell_of_tasks(s));
            effects.extend(self.tell_of_event(s, state));
            effects.extend(self.derive_circles(s, state));
            effects.retain(|e| !matches!(e, Effect::Negotiate));
            return effects;
        }
        let geometry = Arc::clone(&state.geometry);
        let brought = self.take_brought(s.now, &geometry.mission, state.stage.ended());
        let found = if s.speaks {
            self.detect(s, state)
        } else {
            Effects::new()
        };
        let asked = self.watch_event(s, state);
        let mut effects: Effects = self
            .expire(s.now)
            .iter()
            .filter_map(|id| Some((*id, &self.known.get(id)?.task)))
            .map(|(id, task)| report(id, task, TaskNews::Over(TaskState::Expired)))
            .collect();
        let served = if s.speaks {
            self.tell_served(s.now)
        } else {
            Effects::new()
        };
        effects.extend(
            brought
                .into_iter()
                .chain(found)
                .chain(served)
                .chain(asked)
                .filter(|e| !matches!(e, Effect::Negotiate)),
        );
        if self.is_active() && s.speaks {
            effects.extend(self.settle(s, order, state));
        }
        // That the last task is done is said, too.
        effects.extend(self.speak(s));
        effects.extend(self.tell_of_targets(s));
        effects.extend(self.tell_of_counts(s, state));
        state.has_tasks = self.has_work(state.stage.ends_by_time());
        state.target_lost = self.has_lost();
        effects
    }

    /// Whether this UAV has anything to offer.
    fn is_able(s: &Situation<'_>, order: Order, state: &MissionState) -> bool {
        state.can_fly_plans(s)
            && order != Order::ReturnToBase
            && !s.is_silent
            && !state.geometry.mission.cancelled
            && state.separation.is_none()
    }

    /// What this UAV can offer: its section is predicted for that.
    fn present(&self, s: &Situation<'_>, state: &MissionState) -> Option<Offer> {
        let (percept, executive) = (s.percept?, state.executive.as_ref()?);
        // What may be flown from here and back before the section is flown, and all would still
        // end with enough for the way home.
        let within = state.plan_within_endurance(Some(percept))?;
        let is_whole = within.cut.is_none();
        let spare_ms = if is_whole { within.spare_ms } else { 0 };
        let section_ms = within.cells.last().map_or(0, |(_, ms)| *ms);
        #[allow(
            clippy::cast_possible_truncation,
            reason = "a heading is within ±31,416 of these"
        )]
        let course_e4 = (wrap_pi(percept.pose.heading_rad) * 10_000.0).round() as i32;
        Some(Offer {
            east_mm: mm(percept.pose.east_m),
            north_mm: mm(percept.pose.north_m),
            course_e4,
            speed_mmps: speed_mmps(executive).max(1),
            radius_mm: state.geometry.mission.turn_radius_mm,
            endurance_ms: spare_ms.min(DURATION_MAX_MS),
            sensors: self.sensors,
            section_ms: section_ms.min(DURATION_MAX_MS),
            takes: state.takes(s.now),
        })
    }

    /// Tells the auction what is new, and carries out what follows.
    fn settle(&mut self, s: &Situation<'_>, order: Order, state: &mut MissionState) -> Effects {
        let withdrawn = core::mem::take(&mut self.circles.withdrawn);
        let mut events: Vec<Event> = withdrawn.into_iter().map(Event::Withdrawn).collect();
        for id in core::mem::take(&mut self.news) {
            if let Some(known) = self.known.get(&id) {
                events.push(Event::Task(id, known.task.clone()));
            }
        }
        for author in core::mem::take(&mut self.heard) {
            if let Some((version, bundle)) = self.bundles.get(&author) {
                events.push(Event::Heard(author, *version, bundle.clone()));
            }
        }
        let is_period = s.now.since_ms(self.last_period) >= s.membership.interval_ms();
        let able = Self::is_able(s, order, state);
        // What a mission brings goes before its cells; nobody circles but beside those who patrol.
        let mission = &state.geometry.mission;
        let covers = !state.negotiation.sections.complete() && mission.tasks.is_empty();
        let is_open = !state.stage.ended() && (covers || flies_circles(mission));
        // Nobody has to be left for cells from now on, or somebody has.
        let turns = is_open != self.auction.cells_open();
        let is_told = is_period || able != self.was_able || turns;
        let offer = (is_told && able).then(|| self.present(s, state)).flatten();
        if is_told {
            let live = s.membership.live_uavs().map(PeerId);
            events.push(Event::Live(live.collect()));
            events.push(Event::Map(map_of(state)));
            events.push(Event::Cells(is_open));
            events.push(Event::Present(offer.unwrap_or_default()));
        }
        let mut effects = Effects::new();
        if self.was_able && !able {
            events.push(Event::GiveUp);
            if let Some(id) = self.flown() {
                effects.extend(self.told(id, TaskNews::Left));
            }
            self.leave(Some(state));
        }
        self.was_able = able;
        if let Some(offer) = &offer {
            let strays = self.led_off(offer);
            events.extend(strays.iter().map(|id| Event::LetGo(*id)));
            if let Some(id) = self.flown().filter(|id| strays.contains(id)) {
                effects.extend(self.told(id, TaskNews::Left));
                self.leave(Some(state));
            }
        }
        if is_period {
            self.last_period = s.now;
            let diameter = s.membership.diameter(s.now);
            events.push(Event::Period(u8::try_from(diameter).unwrap_or(u8::MAX)));
            if self.may_offer_anew(s, offer.as_ref()) {
                events.push(Event::OfferAnew);
            }
        }
        if self.flown.is_none() && able && order == Order::Resume {
            events.push(Event::Free);
        }
        effects.extend(self.handle(events, state));
        effects.extend(self.hold(s, state));
        // Without a percept, or while a mission changes, there was no flight to plan.
        if self.flown.as_ref().is_some_and(|f| !f.is_planned) {
            effects.extend(self.plan(state));
        }
        effects.extend(self.tell_hopeless());
        effects
    }

    /// What it claims, and its mission does not lead it to.
    fn led_off(&self, offer: &Offer) -> Vec<TaskId> {
        let claims = self.auction.held().iter();
        let claims = claims.filter(|t| t.progress != Progress::Done);
        let strays = |id: &TaskId| {
            let known = self.known.get(id);
            known.is_some_and(|k| !offer.flies(k.task.kind))
        };
        claims.map(|t| t.task).filter(strays).collect()
    }

    /// Whether a task that nobody could do is in the reach of this UAV by now.
    fn may_offer_anew(&mut self, s: &Situation<'_>, offer: Option<&Offer>) -> bool {
        let wait_ms = AGAIN_PERIODS * s.membership.interval_ms();
        if s.now.since_ms(self.last_again) < wait_ms {
            return false;
        }
        let Some(offer) = offer else { return false };
        let more = offer.endurance_ms > self.auction.bundle().1.offer.endurance_ms;
        if !more {
            return false;
        }
        let kept = self.auction.kept_for_cover();
        let has = |id: &TaskId| {
            let known = self.known.get(id);
            known.is_some_and(|k| k.is_open() && carries(offer.sensors, k.task.sensor))
        };
        let mut hopeless = self.auction.unassigned().iter();
        let again = hopeless.any(|id| has(id) && !kept.contains(id));
        if again {
            self.last_again = s.now;
        }
        again
    }

    /// Lets the auction handle events; what it gives to fly is planned.
    fn handle(&mut self, events: Vec<Event>, state: &mut MissionState) -> Effects {
        let bids = RoutedTime::new(&state.geometry.router, &state.asked_ways);
        let settled = self.auction.handle(events, &bids);
        let mut effects = Effects::new();
        for effect in settled {
            match effect {
                auction::Effect::Publish => {}
                auction::Effect::Drop(id) => {
                    if self.flown() == Some(id) {
                        self.leave(Some(state));
                        effects.extend(self.told(id, TaskNews::Left));
                    }
                }
                auction::Effect::Fly(id) => {
                    let known = self.known.get(&id).map(|k| &k.task);
                    let is_held = known.is_some_and(Task::is_held);
                    let news = match known.map(|task| task.kind) {
                        Some(TaskKind::Track) => TaskNews::Tracks,
                        Some(TaskKind::Relay) => TaskNews::Relays,
                        _ => TaskNews::Flies,
                    };
                    self.flown = Some(Flown {
                        id,
                        revision: known.map_or(0, |task| task.revision),
                        tries: 0,
                        is_planned: false,
                        held: is_held.then(Held::default),
                    });
                    state.relay = is_held.then(RelayPosition::default);
                    effects.extend(self.told(id, news));
                    effects.extend(self.plan(state));
                }
            }
        }
        effects
    }

    /// Asks for the flight that does the task.
    fn plan(&self, state: &MissionState) -> Option<Effect> {
        let flown = self.flown.as_ref()?;
        let task = &self.known.get(&flown.id)?.task;
        let (executive, airframe) = (state.executive.as_ref()?, self.flies?);
        let request = Request {
            geometry: Arc::clone(&state.geometry),
            task: self.as_flown((flown.id, flown.revision), task, &state.geometry.mission),
            from: executive.pose()?,
            airspeed_mps: airframe.cruise_mps,
            eye: self.eye(flown.id, &state.geometry.mission),
        };
        let pending = PendingJob::Errand(flown.id, flown.revision, flown.tries);
        Some(Effect::Compute(pending, Job::Errand(Box::new(request))))
    }

    /// The mission changed: what is flown is planned anew.
    pub fn plan_anew(&mut self, state: &mut MissionState) -> Option<Effect> {
        let flown = self.flown.as_mut()?;
        flown.is_planned = false;
        state.set_errand(None);
        let follow = state.followed_at_m();
        state.relay = flown.held.is_some().then_some(RelayPosition {
            circle: None,
            follow,
        });
        self.plan(state)
    }

    /// The flight of a task is planned, or there is none.
    pub fn planned(
        &mut self,
        (id, revision): (TaskId, u32),
        planned: Result<Planned, String>,
        percept: Option<&Percept>,
        state: &mut MissionState,
    ) -> Effects {
        let wanted = |f: &&mut Flown| f.id == id && f.revision == revision && !f.is_planned;
        let Some(flown) = self.flown.as_mut().filter(wanted) else {
            return Effects::new();
        };
        match planned {
            Ok(planned) if !state.returns_from(&planned.flown(), percept) => {
                self.relieve("with the fuel that is left it could not come home", state)
            }
            Ok(Planned::Flight(errand)) => {
                flown.is_planned = true;
                state.set_errand(Some((errand.flight, Watched::new(errand.pieces))));
                vec![Effect::Negotiate]
            }
            Ok(Planned::Circle(circle)) => {
                flown.is_planned = true;
                state.relay.get_or_insert_default().circle = Some(circle);
                vec![Effect::Negotiate]
            }
            Err(why) => self.relieve(&why, state),
        }
    }

    /// Others are asked to do what this UAV could not.
    fn relieve(&mut self, why: &str, state: &mut MissionState) -> Effects {
        let Some(id) = self.flown() else {
            return Effects::new();
        };
        self.leave(Some(state));
        let name = self
            .known
            .get(&id)
            .map_or_else(String::new, |k| k.task.name());
        let text = format!("the task {name:?} is left to others: {why}");
        let mut effects = vec![Effect::Alarm(text)];
        effects.extend(self.handle(vec![Event::Relieve(id)], state));
        effects.push(Effect::Negotiate);
        effects
    }

    /// The camera saw a piece of what is flown to, and with it the `whole`, or less.
    pub fn sighted(&mut self, now: Time, whole: bool, state: &mut MissionState) -> Effects {
        let Some(id) = self.flown() else {
            return Effects::new();
        };
        if !whole {
            // Who is in the midst of it is not relieved by who is nearer to its begin.
            let held = self.auction.held().iter().find(|t| t.task == id);
            let begins = held.is_some_and(|t| t.progress == Progress::Committed);
            let events = begins.then(|| self.handle(vec![Event::Begun(id)], state));
            return events.unwrap_or_default();
        }
        self.leave(Some(state));
        if let Some(known) = self.known.get_mut(&id) {
            known.done = Some((self.me, now));
        }
        let mut effects: Effects = self.told(id, TaskNews::Seen).into_iter().collect();
        effects.extend(self.handle(vec![Event::Finished(id)], state));
        effects.push(Effect::Negotiate);
        effects
    }

    /// The flight is over, and not all of it was seen.
    pub fn flown_in_vain(&mut self, state: &mut MissionState) -> Effects {
        let Some(flown) = self.flown.as_mut().filter(|f| f.is_planned) else {
            return Effects::new();
        };
        flown.tries += 1;
        if flown.tries >= MAX_TRIES {
            return self.relieve("its flight was cut short, or saw not all of it", state);
        }
        self.plan_anew(state).into_iter().collect()
    }

    /// The bundle, where it is new and this peer speaks.
    fn speak(&mut self, s: &Situation<'_>) -> Option<Effect> {
        let (version, bundle) = self.auction.bundle();
        let is_news = s.speaks && version.1 > 0 && self.spoken != Some(version);
        is_news.then(|| {
            self.spoken = Some(version);
            Effect::Speak(0, Body::Bundle(bundle.clone()))
        })
    }

    fn told(&self, id: TaskId, news: TaskNews) -> Option<Effect> {
        let known = self.known.get(&id)?;
        Some(report_held(id, &known.task, news, self.holders(id)))
    }

    /// People hear once that nobody can do a task.
    fn tell_hopeless(&mut self) -> Effects {
        if !self.auction.is_agreed() || self.auction.unassigned().is_empty() {
            return Effects::new();
        }
        let mut effects = Effects::new();
        let kept = self.auction.kept_for_cover();
        for id in self.auction.unassigned() {
            let Some(known) = self.known.get_mut(id).filter(|k| k.is_open()) else {
                continue;
            };
            if !core::mem::replace(&mut known.hopeless_told, true) {
                let why = if kept.contains(id) {
                    KEPT_FOR_COVER.to_owned()
                } else {
                    why_nobody(&known.task, self.auction.offers())
                };
                effects.push(report(*id, &known.task, TaskNews::NobodyCan(why)));
            }
        }
        effects
    }

    /// A ground station says its operator's tasks in each life, and what became of them.
    fn tell_of_tasks(&mut self, s: &Situation<'_>) -> Effects {
        let mut effects = Effects::new();
        let expired = self.expire(s.now);
        let mut over: Vec<(TaskId, Task)> = Vec::new();
        for (id, known) in self.known.iter_mut().filter(|(id, _)| id.author == self.me) {
            if known.is_newly_done() || expired.contains(id) {
                known.task = known.ended(s.now);
                over.push((*id, known.task.clone()));
            }
        }
        for (id, task) in over {
            effects.push(report(id, &task, TaskNews::Over(task.state)));
            effects.push(Effect::Speak(id.number, Body::Task(task)));
        }
        if s.speaks && self.told_in != s.me.incarnation {
            self.told_in = s.me.incarnation;
            let say =
                |(id, k): (&TaskId, &Known)| Effect::Speak(id.number, Body::Task(k.task.clone()));
            effects.extend(self.own().map(say));
            effects.extend(self.bundle_of_done());
        }
        effects
    }
}

/// How long after it was asked for a task was over, as that is said, milliseconds.
pub(crate) fn after_ms(over: Time, since: Time) -> u32 {
    let ms = u32::try_from(over.since_ms(since)).unwrap_or(u32::MAX);
    ms.min(DURATION_MAX_MS)
}

/// What a bundle says to be done, with the revisions.
fn done_in(bundle: &Bundle) -> Vec<(TaskId, u32)> {
    let since = bundle.tasks.iter();
    let since = since.filter(|t| t.progress == Progress::Done);
    let since = since.map(|t| (t.task, t.revision));
    let before = bundle.done.iter().map(|d| (d.task, d.revision));
    before.chain(since).collect()
}

fn report(id: TaskId, task: &Task, news: TaskNews) -> Effect {
    report_held(id, task, news, Vec::new())
}

fn report_held(id: TaskId, task: &Task, news: TaskNews, held_by: Vec<TaskHolder>) -> Effect {
    Effect::Report(Report::Task {
        id,
        revision: task.revision_as_asked(),
        name: task.name(),
        news,
        held_by,
    })
}

/// Whether somebody with these sensors carries the one that is needed.
pub(crate) fn carries(sensors: u32, needed: u8) -> bool {
    let bit = u32::from(needed).checked_sub(1);
    bit.is_none_or(|bit| sensors >> bit.min(31) & 1 == 1)
}

/// Why nobody does a task, as far as the offers of all tell.
pub(crate) fn why_nobody<'a>(task: &Task, offers: impl Iterator<Item = &'a Offer>) -> String {
    let able: Vec<&Offer> = offers.filter(|o| o.speed_mmps > 0).collect();
    if able.is_empty() {
        "no UAV takes tasks".to_owned()
    } else if !able.iter().any(|o| o.flies(task.kind)) {
        "as it stands, the mission leads no UAV to it".to_owned()
    } else if !able.iter().any(|o| carries(o.sensors, task.sensor)) {
        format!("no UAV carries {}", sensor_name(task.sensor))
    } else {
        "those who could have not the endurance beside their sections, or found no way".to_owned()
    }
}

/// Identifies the zones by which ways are reckoned.
fn map_of(state: &MissionState) -> u32 {
    let mission = &state.geometry.mission;
    let mut hash = Fnv::new();
    (&mission.zones, &mission.added_zones).hash(&mut hash);
    (mission.turn_radius_mm, mission.clearance_mm).hash(&mut hash);
    folded(Hasher::finish(&hash))
}
