//! The cooperation manager (D2.7 §1.2.3): mission, goal, and the peer's part in the
//! negotiations.
//!
//! Where it flies is the goal of its state in the mission's diagram (`stage.rs`), by default:
//!
//! | what holds | goal |
//! |---|---|
//! | the operator said hold | loiter here |
//! | the operator said return or cancelled the mission, or all is covered, or the fuel is due, or another process speaks under its id | loiter at base |
//! | it was given a relay position, and its circle is planned | fly there and circle |
//! | it was given a target to follow, and where that may be is near | follow it |
//! | it was given a task, and its flight is planned | fly that, then the cells of the plan |
//! | the plan has cells | fly them |
//! | nothing to fly, others at work | loiter where it is |
//! | and among many nobody is heard, or for 20 T' nobody who has cells to fly | loiter at base |
//!
//! | event | what follows |
//! |---|---|
//! | a newer mission is whole | its zones are kept clear of; its geometry is asked for, once |
//! | the geometry arrives | the mission begins; claims and bids held are heard again |
//! | there is no geometry | an alarm; the old mission stays |
//! | a percept | a setpoint; what the camera saw is covered, told, and durable every 5 cells |
//! | the fuel is due | an alarm; the plan is given up; home |
//! | the operator said return | the plan is given up, and a claim says so at once; home |
//! | it is given a relay position | the plan is given up likewise; it takes part again when it leaves it |
//! | half a minute of fuel is back | it takes part again |
//! | a claim or a bid of this loop | the negotiation ticks |
//! | covered cells that are news | they are spoken |
//! | a beacon of this loop with other coverage | the own is spoken |
//! | a beacon of this revision and another loop | an alarm, once |
//! | a beacon of a later lap of this mission | that lap begins: its author knows that this one is seen |
//! | a tick | the negotiation ticks, the end is noticed, the goal follows |
//! | a bid is durable | it is spoken, if its round is still open |
//! | a division, a take is durable | it is flown and spoken, if nothing was written after it |
//! | a store failed | what was promised does not happen |

use crate::Incarnation;
use crate::beliefs::Beliefs;
use crate::config::{PeerConfig, Role};
use crate::effect::{Effect, Effects, PendingJob, Promise};
use crate::errand::Planned;
use crate::found_obstacles::KnownObstacles;
use crate::input::Time;
use crate::journal::Durable;
use crate::library::Library;
use crate::mission::{GeometryError, Mission};
use crate::mission_state::MissionState;
use crate::offload::{Job, MissionGeometry};
use crate::output::{Report, Status};
use crate::protocol::membership::Membership;
use crate::protocol::negotiation::Adoption;
use crate::protocol::runs::PlannedCell;
use crate::sensed_aircraft::ToldAircraft;
use crate::tasking::Tasking;
use crate::timers::{Timer, Timers};
use crate::trails::Trails;
use crate::wire::codec::Body;
use crate::wire::message::{Beacon, Bid, Epoch, Lacking, Member, Order, Orders, Record};
use crate::wire::tasks::TaskId;
use skein_behaviors::{Event, Percept};
use skein_flight::coverage::ring::backtracking::Division;
use std::sync::Arc;

/// What the rest of the peer knows at the moment of an event.
#[derive(Debug)]
pub(crate) struct Situation<'a> {
    /// The peer's time.
    pub now: Time,
    /// Beacon period T, milliseconds.
    pub period_ms: u64,
    /// This peer in its present life.
    pub me: Member,
    /// What it is for.
    pub role: Role,
    /// Whether it speaks.
    pub speaks: bool,
    /// Whether another process under its id has silenced it.
    pub is_silent: bool,
    /// What it last sensed.
    pub percept: Option<&'a Percept>,
    /// Who else is there.
    pub membership: &'a Membership,
}

/// The operator's standing orders and the version of the record that gave them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct StandingOrders {
    orders: Orders,
    /// (incarnation, seq, author) of the record; none yet when zero.
    version: (Incarnation, u32, u16),
}

/// The cooperation manager of one peer.
#[derive(Debug)]
pub(crate) struct Cooperation {
    /// This peer's number.
    id: u16,
    library: Library,
    orders: StandingOrders,
    state: Option<MissionState>,
    pub(crate) tasking: Tasking,
    pub(crate) trails: Trails,
    obstacles: KnownObstacles,
    aircraft: ToldAircraft,
    mismatch_told: bool,
    /// When a piece of a mission came last.
    piece_came: Time,
}

impl Cooperation {
    /// A manager that begins with the mission found on disk, if any.
    pub fn new(config: &PeerConfig) -> Self {
        Self {
            id: config.id.0,
            library: Library::new(config.mission.clone()),
            tasking: Tasking::new(config),
            trails: Trails::default(),
            obstacles: KnownObstacles::default(),
            aircraft: ToldAircraft::default(),
            orders: StandingOrders::default(),
            state: None,
            mismatch_told: false,
            piece_came: Time(0),
        }
    }

    /// What it has of its mission, once there is one.
    pub fn state(&self) -> Option<&MissionState> {
        self.state.as_ref()
    }

    /// The newest whole mission, derived or not.
    pub fn newest_mission(&self) -> Option<Arc<Mission>> {
        self.library.newest()
    }

    /// Which pieces it lacks of a newer mission than the one it follows, and when one came last;
    /// all of them of the `newest` that neighbours follow, where none came.
    pub fn lacking(&self, newest: u32) -> Option<(Lacking, Time)> {
        let follows = self.state.as_ref().map_or(0, MissionState::revision);
        let unseen = || (newest > follows).then(|| (newest, 0, Lacking::bits(1, |_| true)));
        let told = self.library.lacking(follows).or_else(unseen);
        let (revision, content_hash, pieces) = told?;
        let lacking = Lacking {
            revision,
            content_hash,
            holders: 0,
            pieces,
        };
        Some((lacking, self.piece_came))
    }

    /// A whole mission is on offer.
    pub fn offer(&mut self, mission: Arc<Mission>) {
        self.library.offer(mission);
    }

    /// Orders, by the version of their record; only later ones count.
    fn hear_orders(&mut self, orders: &Orders, version: (Incarnation, u32, u16)) {
        if version > self.orders.version {
            self.give_orders(orders.clone(), version);
        }
    }

    /// What the operator wants of this peer, as far as it was heard.
    pub fn order(&self) -> Order {
        self.orders.orders.of(self.id)
    }

    /// What the operator wants of everybody, as far as it was heard.
    pub fn orders(&self) -> &Orders {
        &self.orders.orders
    }

    /// Orders that this peer itself gives for its operator.
    pub fn give_orders(&mut self, orders: Orders, version: (Incarnation, u32, u16)) {
        self.orders = StandingOrders { orders, version };
    }

    /// What it owned is void: a life of this peer begins, or another process silences it.
    pub fn void_ownership(&mut self, me: Member, timers: &mut Timers) {
        if let Some(state) = &mut self.state {
            state.void_ownership(me, timers);
        }
        self.tasking.void_ownership(me, self.state.as_mut());
        self.trails.begin_life(me.incarnation);
        self.obstacles.begin_life();
    }

    /// For so long this peer did not listen: it waits that much longer for others.
    pub fn was_late(&mut self, late_ms: u64, timers: &mut Timers) {
        if let Some(state) = &mut self.state {
            state.negotiation.was_late(late_ms);
            state.able_since = state.able_since.map(|t| t.plus_ms(late_ms));
        }
        if let Some(at) = timers.at(Timer::HeldCells) {
            timers.set(Timer::HeldCells, at.plus_ms(late_ms));
        }
    }

    /// Asks for the geometry of the newest whole mission, unless it is held.
    pub fn consider_mission(&self) -> Effects {
        let newest = self.library.newest().filter(|newest| {
            let held = self.state.as_ref().map(MissionState::revision);
            held.is_none_or(|revision| revision < newest.revision)
        });
        let ask = |mission: Arc<Mission>| {
            let pending = PendingJob::Geometry(mission.content_hash());
            Effect::Compute(pending, Job::Geometry(mission))
        };
        newest.map(ask).into_iter().collect()
    }

    /// The last piece of a newer mission came: its zones are kept clear of at once.
    fn mission_is_whole(&mut self) -> Effects {
        let (newest, state) = (self.library.newest(), self.state.as_mut());
        let zones = state.zip(newest).and_then(|(s, newest)| s.heed(&newest));
        zones.into_iter().chain(self.consider_mission()).collect()
    }

    /// What the UAV senses on no map is flown round by all, and kept clear of by itself meanwhile.
    fn sense_obstacles(&mut self, percept: &Percept) -> Effects {
        let newest = self.library.newest();
        let Some(newest) = newest.filter(|_| !percept.obstacles.is_absent()) else {
            return Effects::new();
        };
        if self.obstacles.is_as_before(&percept.obstacles, &newest) {
            return Effects::new();
        }
        let is_news = self.obstacles.sense(&percept.obstacles, &newest);
        let mut effects = if is_news {
            self.fly_round_found()
        } else {
            Effects::new()
        };
        let newest = self.library.newest().unwrap_or(newest);
        let unmapped = self.obstacles.unmapped(&percept.obstacles, &newest);
        if let (Some(unmapped), Some(state)) = (unmapped, &mut self.state) {
            effects.extend(state.heed_obstacles(&newest, &unmapped));
        }
        effects
    }

    /// The newest mission with zones round all that is known, if it lacks any.
    fn fly_round_found(&mut self) -> Effects {
        let known = self.obstacles.known();
        let newest = self.library.newest().filter(|_| !known.is_empty());
        let Some(next) = newest.and_then(|newest| newest.with_found(known)) else {
            return Effects::new();
        };
        let mission = Arc::new(next);
        self.library.offer(Arc::clone(&mission));
        let mut effects = vec![Effect::Report(Report::Found { mission })];
        effects.extend(self.mission_is_whole());
        effects
    }

    /// The geometry of the mission with this hash arrived: from now on it is the mission.
    pub fn geometry_arrived(
        &mut self,
        hash: u64,
        geometry: Result<Arc<MissionGeometry>, GeometryError>,
        me: Member,
        config: &PeerConfig,
        durable: &Durable,
        timers: &mut Timers,
    ) -> Effects {
        let geometry = match geometry {
            Ok(g) if g.mission.content_hash() == hash => g,
            Ok(_) => return Effects::new(),
            Err(why) => {
                let text = format!("the mission cannot be flown: {why}");
                return vec![Effect::Alarm(text)];
            }
        };
        let old = self.state.take();
        self.obstacles.heed_anew();
        let state = MissionState::begun(geometry, old, me, config, durable, timers);
        let ready = Report::Ready {
            revision: state.revision(),
            loop_hash: state.loop_hash(),
            cells: state.covered().capacity(),
        };
        let state = self.state.insert(state);
        let mut effects = vec![Effect::Report(ready), Effect::HearAgain];
        effects.extend(self.tasking.plan_anew(state));
        effects
    }

    /// Lists only what can be flown, by what the UAV has left.
    pub fn keep_within_endurance(&mut self, percept: Option<&Percept>) {
        if let Some(state) = &mut self.state {
            state.keep_within_endurance(percept);
        }
    }

    /// A percept: fly, and note what the camera saw.
    pub fn on_percept(&mut self, now: Time, percept: &Percept) -> Effects {
        let mut effects = self.sense_obstacles(percept);
        let percept = &self.aircraft.complete(percept);
        let Some(state) = &mut self.state else {
            return effects;
        };
        let aims_anew = self.tasking.look(now, percept, state);
        let expects_cells = state.expects_cells();
        let sections = &state.negotiation.sections;
        let Some(executive) = &mut state.executive else {
            return effects;
        };
        if executive.leaves_alone(percept) {
            return effects;
        }
        executive.expect_cells(expects_cells);
        let is_open = |c: u16| !sections.covered().contains(c);
        let (mut setpoint, events) = executive.step(percept, &is_open);
        self.trails.note(self.id, executive.take_traced());
        if aims_anew {
            effects.push(Effect::Negotiate);
        }
        if let Some(separation) = &mut state.separation {
            effects.extend(separation.on_percept(now, percept, executive, &is_open));
            // Told to the airframe no later than to others.
            setpoint.promised = separation.promised(percept.time_ms);
        }
        effects.insert(0, Effect::Fly(setpoint));
        for event in events {
            match event {
                Event::Sighted { seen, of } => {
                    effects.extend(self.tasking.sighted(now, seen >= of, state));
                }
                Event::Refused { cells } if cells.is_empty() && state.relay.is_some() => {
                    effects.extend(self.tasking.no_way(state));
                }
                Event::DetourFlown => effects.extend(self.tasking.flown_in_vain(state)),
                event => effects.extend(state.on_event(event)),
            }
        }
        effects
    }

    /// A neighbour's beacon.
    pub fn hear_beacon(&mut self, author: u16, beacon: &Beacon) -> Effects {
        let Some(state) = &mut self.state else {
            return Effects::new();
        };
        state.negotiation.rounds.hear_counter(beacon.counter);
        if beacon.loop_hash == state.loop_hash() {
            let differs = beacon.cover_digest != state.covered().digest();
            return differs
                .then_some(Effect::CoverageWanted)
                .into_iter()
                .collect();
        }
        if let Some(lap) = state.lap_of(beacon) {
            return vec![Effect::Offer(Arc::new(lap))];
        }
        let mismatch = beacon.revision == state.revision() && beacon.loop_hash != 0;
        if mismatch && !core::mem::replace(&mut self.mismatch_told, true) {
            let text = format!("peer {author} derived another loop from the same mission");
            return vec![Effect::Alarm(text)];
        }
        Effects::new()
    }

    /// A record of another peer that is new here, after so many hops.
    pub fn hear(&mut self, now: Time, (record, hops): (&Record, u8), body: &Body) -> Effects {
        let author = record.said_by();
        match body {
            Body::Mission(chunk) => {
                self.piece_came = now;
                match self.library.chunk(record.subject, chunk) {
                    Ok(true) => self.mission_is_whole(),
                    Ok(false) => Effects::new(),
                    Err(why) => vec![Effect::Alarm(why)],
                }
            }
            Body::Operator(orders) => {
                self.hear_orders(orders, (record.incarnation, record.seq, record.author));
                Effects::new()
            }
            Body::Task(_)
            | Body::Bundle(_)
            | Body::Target(_)
            | Body::Detection(_)
            | Body::Count(_)
            | Body::Usage(_)
            | Body::Crowd(_) => self.tasking.hear(now, record, body),
            Body::Trail(trail) => {
                self.trails.hear(record.author, record.subject, trail);
                Effects::new()
            }
            Body::Obstacles(told) => {
                if self.obstacles.hear(record.author, told) {
                    return self.fly_round_found();
                }
                Effects::new()
            }
            Body::Aircraft(told) => {
                self.aircraft.hear(record.author, told);
                Effects::new()
            }
            Body::Intent(_) | Body::Conflict(_) => {
                let state = self.state.as_mut();
                if let Some(separation) = state.and_then(|s| s.separation.as_mut()) {
                    match body {
                        Body::Intent(intent) => separation.hear(now, (record, hops), intent),
                        Body::Conflict(brief) => separation.hear_brief(now, (record, hops), brief),
                        _ => {}
                    }
                }
                Effects::new()
            }
            body => match &mut self.state {
                Some(state) => state.hear(now, author, record.seq, body),
                None => Effects::new(),
            },
        }
    }

    /// Looks at everything that depends on time.
    pub fn tick(&mut self, s: &Situation<'_>, timers: &mut Timers) -> Effects {
        let mut effects = self.fly_round_found();
        effects.extend(self.obstacles.tick(s));
        effects.extend(self.aircraft.tick(s));
        effects.extend(self.consider_mission());
        let order = self.order();
        let Some(state) = &mut self.state else {
            return effects;
        };
        effects.extend(state.watch_fuel(s.percept));
        let all = s.membership.all();
        state.lost = all.filter(|(.., status)| *status == Status::Down).count();
        let wind = |p: &Percept| p.wind_east_mps.hypot(p.wind_north_mps);
        state.wind_mps = s.percept.map_or(0.0, wind);
        state.look(s.now, order);
        if let Some(separation) = &mut state.separation {
            let all = s.membership.all();
            let down = all.filter(|(.., status)| *status == Status::Down);
            separation.believe_down(s.now, down.map(|(id, ..)| id));
        }
        let releases = order == Order::ReturnToBase || state.relay.is_some();
        let releases = releases || state.stage.lets_go();
        match order {
            _ if releases => effects.extend(state.release_section(s.role)),
            Order::Resume => effects.extend(state.check_endurance(s.now, s.percept, s.period_ms)),
            Order::ReturnToBase | Order::Hold => {}
        }
        state.has_released &= releases;
        let able = s.speaks && order == Order::Resume && state.can_fly_plans(s);
        let able = able && state.relay.is_none() && state.stage.takes_part();
        let able = able && !s.membership.is_deaf(s.now);
        effects.extend(state.negotiate(s, able, timers));
        effects.extend(self.tasking.tick(s, order, state));
        effects.extend(state.notice_end(s, timers));
        state.notice_astray(s);
        state.silent = s.is_silent;
        state.listen(s, order);
        state.steer_by_state(s.now, order);
        state.keep_even(s);
        effects.extend(self.trails.tick(s, state));
        assert!(
            !effects.iter().any(|e| matches!(e, Effect::Negotiate)),
            "a tick asks for no tick"
        );
        effects
    }

    /// A bid is durable: it may be spoken, if its round is still open.
    pub fn on_bid_durable(&mut self, bid: Bid) -> Effects {
        let spoken = self
            .state
            .as_mut()
            .is_some_and(|s| s.negotiation.on_bid_durable(bid.clone()));
        if spoken {
            vec![Effect::Speak(0, Body::Bid(bid)), Effect::Negotiate]
        } else {
            Effects::new()
        }
    }

    /// The flight of a task is planned, or there is none.
    pub fn errand_planned(
        &mut self,
        task: (TaskId, u32),
        planned: Result<Planned, String>,
        percept: Option<&Percept>,
    ) -> Effects {
        match &mut self.state {
            Some(state) => self.tasking.planned(task, planned, percept, state),
            None => Effects::new(),
        }
    }

    /// The planner divided the loop.
    pub fn divided(&mut self, s: &Situation<'_>, epoch: Epoch, division: &Division) -> Effects {
        match &mut self.state {
            Some(state) => state.divided(s, epoch, division),
            None => Effects::new(),
        }
    }

    /// An adoption is durable: it is flown from now on.
    pub fn on_adoption_durable(
        &mut self,
        s: &Situation<'_>,
        written: u64,
        adoption: &Adoption,
        timers: &mut Timers,
    ) -> Effects {
        let order = self.order();
        let Some(state) = &mut self.state else {
            return Effects::new();
        };
        if !state.claims.answer(written) {
            return Effects::new();
        }
        let present = state.company.present();
        if state.negotiation.adopt(s.now, adoption, &present.live) {
            let expiry = s.now.plus_ms(2 * u64::from(adoption.wait_ms));
            timers.set(Timer::HeldCells, expiry);
        }
        state.keep_within_endurance(s.percept);
        let mut effects = Effects::new();
        if !adoption.unassigned.is_empty() {
            let count = adoption.unassigned.len();
            let text = format!("{count} cells are beyond the endurance of all");
            effects.push(Effect::Alarm(text));
        }
        effects.push(state.claim_changed());
        effects.extend(state.save_covered(true));
        state.steer_by_state(s.now, order);
        effects.push(Effect::ClaimNow);
        effects
    }

    /// Cells taken without a round are durable: they are flown from now on.
    pub fn on_take_durable(
        &mut self,
        s: &Situation<'_>,
        written: u64,
        taken: &[PlannedCell],
    ) -> Effects {
        let order = self.order();
        let Some(state) = &mut self.state else {
            return Effects::new();
        };
        if !state.claims.answer(written) {
            state.negotiation.cancel_take();
            return Effects::new();
        }
        state.negotiation.append_take(taken);
        state.keep_within_endurance(s.percept);
        // Runs of orphans are taken one after the other, several in a period: the claim
        // tells of all of them at once.
        let changed = state.claim_changed();
        state.steer_by_state(s.now, order);
        vec![changed]
    }

    /// A promise could not be made durable, so what it was for does not happen.
    pub fn on_broken(&mut self, promise: &Promise) {
        let Some(state) = &mut self.state else {
            return;
        };
        match promise {
            Promise::Take(written, _) => {
                state.claims.answer(*written);
                state.negotiation.cancel_take();
            }
            Promise::Adopt(written, _) => {
                state.claims.answer(*written);
            }
            // They are written with the next cell that is seen.
            Promise::Covered(cells) => {
                state.unsaved_cells = state.unsaved_cells.saturating_add(*cells);
            }
            // The round is given up when its time is over.
            Promise::Life(_) | Promise::Bid(_) => {}
        }
    }

    /// Fills the mission's part of what the peer believes.
    pub fn fill(&self, beliefs: &mut Beliefs, counter: u32, percept: Option<&Percept>) {
        self.tasking.fill(beliefs);
        let trails = self.trails.known();
        beliefs.trails = trails.map(|(key, t)| (key, t.clone())).collect();
        let Some(state) = &self.state else {
            return;
        };
        beliefs.counts = self.tasking.counts(&state.geometry.mission);
        let sections = &state.negotiation.sections;
        beliefs.able = state.able();
        beliefs.loop_hash = state.loop_hash();
        beliefs.revision = state.revision();
        beliefs.covered = sections.covered().clone();
        beliefs.plan = sections.plan().iter().map(|p| p.cell).collect();
        beliefs.stamps = sections.plan().iter().map(|p| p.stamp).collect();
        beliefs.held = sections.held().keys().copied().collect();
        beliefs.unassigned = sections.unassigned().iter().collect();
        beliefs.epoch = sections.epoch();
        beliefs.counter = counter;
        beliefs.adoptions = state.negotiation.adoptions;
        beliefs.unheard = state.company.present().unheard;
        beliefs.finished = state.finished;
        beliefs.relays = state.relay.is_some();
        beliefs.evades = state.executive.as_ref().is_some_and(|e| e.evades());
        beliefs.traces = state.executive.as_ref().is_some_and(|e| e.is_tracing());
        beliefs.astray = state.astray;
        beliefs.cannot_fly_all = state.cannot_fly_all();
        beliefs.missed = state.stage.missed(state.lost);
        beliefs.stage = Some((state.stage.at(), state.stage.by()));
        beliefs.spendable_ms = state.spendable_ms(percept);
        beliefs.is_fuel_due = state.fuel.is_due();
    }
}
