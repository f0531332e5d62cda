//! The cooperation manager (D2.7 §1.2.3): mission, goal, and the peer's part in the
//! negotiations.
//!
//! | what holds | goal |
//! |---|---|
//! | the operator said hold | loiter here |
//! | the operator said return, or all is covered, or the fuel is due, or another process speaks under its id | loiter at base |
//! | the plan has cells | fly them |
//! | nothing to fly, others at work | loiter where it is |
//! | and among many nobody is heard | loiter at base |
//!
//! | event | what follows |
//! |---|---|
//! | a newer mission is whole | its geometry is asked for, once |
//! | the geometry arrives | the mission begins; claims and bids held are heard again |
//! | there is no geometry | an alarm; the old mission stays |
//! | a percept | a setpoint; what the camera saw is covered, told, and durable every 5 cells |
//! | the fuel is due | an alarm; the plan is given up; home |
//! | half a minute of fuel is back | it takes part again |
//! | a claim or a bid of this loop | the negotiation ticks |
//! | covered cells that are news | they are spoken |
//! | a beacon of this loop with other coverage | the own is spoken |
//! | a beacon of this revision and another loop | an alarm, once |
//! | a tick | the negotiation ticks, the end is noticed, the goal follows |
//! | a bid is durable | it is spoken, if its round is still open |
//! | a division, a take is durable | it is flown and spoken, if nothing was written after it |
//! | a store failed | what was promised does not happen |

use crate::beliefs::Beliefs;
use crate::cells::CellSet;
use crate::config::{PeerConfig, Role};
use crate::effect::{Effect, Effects, PendingJob, Promise};
use crate::input::Time;
use crate::journal::{Durable, Entry};
use crate::mission::{GeometryError, Library, Mission};
use crate::mission_state::{Company, MissionState};
use crate::offload::{Job, MissionGeometry};
use crate::output::Report;
use crate::protocol::division;
use crate::protocol::membership::Membership;
use crate::protocol::negotiation::{Action, Adoption, Context, are_many};
use crate::protocol::runs::{PlannedCell, legs_of};
use crate::protocol::sections::LivePeers;
use crate::timers::{Timer, Timers};
use crate::wire::codec::Body;
use crate::wire::limits::BID_COVERED_MAX_BYTES;
use crate::wire::message::{Beacon, Bid, Epoch, Member, Order, Record};
use crate::{Incarnation, PeerId};
use skein_behaviors::executive::UNREACHABLE_MS;
use skein_behaviors::{Event, Executive, Goal, Percept};
use skein_flight::coverage::ring::Direction;
use skein_flight::coverage::ring::backtracking::{Division, Uav};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Own coverage is made durable every so many cells: a crash costs at most these.
pub const CELLS_PER_COVERED_RECORD: u16 = 5;

/// Beacon periods for which the last cells of a lap are told before the next lap begins:
/// one to speak, two to be passed on. Who misses them flies those cells again, and hears
/// of the next lap from the ground station.
const LAP_PERIODS: u64 = 3;

/// A UAV whose fuel was due works again when it may spend this much, milliseconds: less
/// would be due again before the next round is decided.
const FUEL_BACK_MS: u32 = 30_000;

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

/// The operator's standing order and the version of the record that gave it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct StandingOrder {
    order: Order,
    /// (incarnation, seq, author) of the record; none yet when zero.
    version: (Incarnation, u32, u16),
}

/// The cooperation manager of one peer.
#[derive(Debug)]
pub(crate) struct Cooperation {
    library: Library,
    order: StandingOrder,
    state: Option<MissionState>,
    mismatch_told: bool,
}

impl Cooperation {
    /// A manager that begins with the mission found on disk, if any.
    pub fn new(mission: Option<Arc<Mission>>) -> Self {
        Self {
            library: Library::new(mission),
            order: StandingOrder::default(),
            state: None,
            mismatch_told: false,
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

    /// A whole mission is on offer.
    pub fn offer(&mut self, mission: Arc<Mission>) {
        self.library.offer(mission);
    }

    /// An order, by the version of its record; only a later one counts.
    pub fn hear_order(&mut self, order: Order, version: (Incarnation, u32, u16)) {
        if version > self.order.version {
            self.order = StandingOrder { order, version };
        }
    }

    /// What the operator wants, as far as it was heard.
    pub fn order(&self) -> Order {
        self.order.order
    }

    /// An order that this peer itself gives for its operator.
    pub fn give_order(&mut self, order: Order, version: (Incarnation, u32, u16)) {
        self.order = StandingOrder { order, version };
    }

    /// What it owned is void: a life of this peer begins, or another process silences it.
    pub fn void_ownership(&mut self, me: Member, timers: &mut Timers) {
        if let Some(state) = &mut self.state {
            state.void_ownership(me, timers);
        }
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
        let state = MissionState::begun(geometry, old, me, config, durable, timers);
        let ready = Report::Ready {
            revision: state.revision(),
            loop_hash: state.loop_hash(),
            cells: state.covered().capacity(),
        };
        self.state = Some(state);
        vec![Effect::Report(ready), Effect::HearAgain]
    }

    /// Lists only what can be flown, by what the UAV has left.
    pub fn keep_within_endurance(&mut self, percept: Option<&Percept>) {
        if let Some(state) = &mut self.state {
            state.keep_within_endurance(percept);
        }
    }

    /// A percept: fly, and note what the camera saw.
    pub fn on_percept(&mut self, percept: &Percept) -> Effects {
        let Some(state) = &mut self.state else {
            return Effects::new();
        };
        let sections = &state.negotiation.sections;
        let Some(executive) = &mut state.executive else {
            return Effects::new();
        };
        let (setpoint, events) = executive.step(percept, &|c| !sections.covered().contains(c));
        let mut effects = vec![Effect::Fly(setpoint)];
        for event in events {
            effects.extend(state.on_event(event));
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
        let mismatch = beacon.revision == state.revision() && beacon.loop_hash != 0;
        if mismatch && !core::mem::replace(&mut self.mismatch_told, true) {
            let text = format!("peer {author} derived another loop from the same mission");
            return vec![Effect::Alarm(text)];
        }
        Effects::new()
    }

    /// A record of another peer that is new here.
    pub fn hear(&mut self, now: Time, record: &Record, body: Body) -> Effects {
        let author = Member {
            id: record.author,
            incarnation: record.incarnation,
        };
        match body {
            Body::Mission(chunk) => match self.library.chunk(record.subject, &chunk) {
                Ok(true) => self.consider_mission(),
                Ok(false) => Effects::new(),
                Err(why) => vec![Effect::Alarm(why)],
            },
            Body::Operator(order) => {
                self.hear_order(order, (record.incarnation, record.seq, record.author));
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
        let mut effects = self.consider_mission();
        let order = self.order.order;
        let Some(state) = &mut self.state else {
            return effects;
        };
        if state.fuel_is_due(s.percept) {
            effects.extend(state.give_up_for_fuel());
        } else if state.fuel_is_back(s.percept) {
            state.exhausted = false;
        }
        if order == Order::Resume {
            effects.extend(state.check_endurance(s));
        }
        let able = s.speaks && order == Order::Resume && state.can_fly_plans(s);
        let able = able && !s.membership.is_deaf(s.now);
        effects.extend(state.negotiate(s, able, timers));
        effects.extend(state.notice_end(s, timers));
        state.astray = are_many(s.membership.uavs()) && s.membership.hears_nobody(s.now);
        state.silent = s.is_silent;
        state.steer(order);
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
        let order = self.order.order;
        let Some(state) = &mut self.state else {
            return Effects::new();
        };
        if !state.claims.answer(written) {
            return Effects::new();
        }
        if state.negotiation.adopt(s.now, adoption) {
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
        state.steer(order);
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
        let order = self.order.order;
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
        state.steer(order);
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
        let Some(state) = &self.state else {
            return;
        };
        let sections = &state.negotiation.sections;
        beliefs.able = state.able();
        beliefs.loop_hash = state.loop_hash();
        beliefs.revision = state.revision();
        beliefs.covered = sections.covered().flags();
        beliefs.plan = sections.plan().iter().map(|p| p.cell).collect();
        beliefs.stamps = sections.plan().iter().map(|p| p.stamp).collect();
        beliefs.held = sections.held().keys().copied().collect();
        beliefs.unassigned = sections.unassigned().iter().collect();
        beliefs.epoch = sections.epoch();
        beliefs.counter = counter;
        beliefs.adoptions = state.negotiation.adoptions;
        beliefs.finished = state.finished;
        beliefs.eta_ms = state.eta_ms();
        beliefs.spendable_ms = state.spendable_ms(percept);
    }
}

impl MissionState {
    fn on_event(&mut self, event: Event) -> Effects {
        match event {
            Event::Seen(cells) => {
                let mut seen = CellSet::of(self.covered().capacity(), cells);
                seen.subtract(self.covered());
                if seen.is_empty() {
                    return Effects::new();
                }
                self.negotiation.sections.cover(&seen);
                self.negotiation.note_covered();
                self.unsaved_cells = self.unsaved_cells.saturating_add(seen.count());
                let cells = seen.iter().collect();
                let mut effects = vec![
                    Effect::Report(Report::Covered { cells }),
                    Effect::CoverageChanged,
                ];
                effects.extend(self.save_covered(false));
                effects
            }
            Event::PlanDone => {
                self.replan |= !self.negotiation.sections.plan().is_empty();
                Effects::new()
            }
            Event::Refused { cells } => {
                self.negotiation.sections.give_up(&cells);
                let text = "a cell could not be reached clear of the zones; it was given up";
                vec![self.claim_changed(), Effect::Alarm(text.into())]
            }
        }
    }

    /// A claim, a bid or covered cells of another peer.
    fn hear(&mut self, now: Time, author: Member, seq: u32, body: Body) -> Effects {
        let mine = self.loop_hash();
        let capacity = self.covered().capacity();
        let negotiation = &mut self.negotiation;
        let refused = |why: &str| {
            let reason = why.to_owned();
            vec![Effect::Report(Report::Refused { reason })]
        };
        match body {
            Body::Claim(claim) => {
                let listed = claim.plan.iter().chain(&claim.held);
                let counters = listed.map(|l| l.stamp.epoch.counter);
                let latest = counters.fold(claim.epoch.counter, u32::max);
                if !negotiation.rounds.hear_counter(latest) {
                    return refused("a claim of a round that is far ahead of all heard of");
                }
                let (id, life) = (author.id, author.incarnation);
                let news =
                    claim.loop_hash == mine && negotiation.sections.hear(id, life, seq, claim);
                news.then_some(Effect::Negotiate).into_iter().collect()
            }
            Body::Bid(bid) if bid.round.loop_hash == mine => {
                if let Err(why) = negotiation.hear_bid(now, author, &bid) {
                    return refused(why);
                }
                if let Ok(covered) = CellSet::decode_rle(capacity, &bid.covered) {
                    negotiation.sections.cover(&covered);
                }
                vec![Effect::Negotiate]
            }
            Body::Bid(bid) => {
                let believed = negotiation.rounds.believe(&bid.round);
                believed.err().map_or_else(Effects::new, refused)
            }
            Body::Cover(cover) if cover.loop_hash == mine => {
                let Ok(covered) = CellSet::decode_rle(capacity, &cover.covered) else {
                    return Effects::new();
                };
                let news = negotiation.sections.cover(&covered);
                let news = news.then_some(Effect::CoverageChanged);
                let heard = Effect::CoverageHeard(mine, covered);
                news.into_iter().chain([heard]).collect()
            }
            _ => Effects::new(),
        }
    }

    /// The own claim changed: it is spoken, and flown by.
    fn claim_changed(&mut self) -> Effect {
        self.replan = true;
        Effect::ClaimChanged
    }

    /// Covered cells, if enough are new to be made durable; `now` takes any.
    fn save_covered(&mut self, now: bool) -> Option<Effect> {
        let least = if now { 1 } else { CELLS_PER_COVERED_RECORD };
        if self.unsaved_cells < least {
            return None;
        }
        let cells = core::mem::take(&mut self.unsaved_cells);
        let entry = Entry::Covered {
            loop_hash: self.loop_hash(),
            cells: self.covered().capacity(),
            covered: self.covered().encode_rle(None),
        };
        Some(Effect::Store(Promise::Covered(cells), entry))
    }

    /// Whether the fuel is due, and the plan was not given up for it yet.
    fn fuel_is_due(&self, percept: Option<&Percept>) -> bool {
        percept.is_some() && !self.exhausted && self.spendable_ms(percept) == 0
    }

    /// Whether a UAV whose fuel was due has some to spend again: it was refuelled, or what
    /// it had sensed was wrong.
    fn fuel_is_back(&self, percept: Option<&Percept>) -> bool {
        self.exhausted && self.spendable_ms(percept) >= FUEL_BACK_MS
    }

    /// The fuel is due: the plan is given up.
    fn give_up_for_fuel(&mut self) -> Effects {
        assert!(!self.exhausted, "fuel that is due comes due once");
        self.exhausted = true;
        self.negotiation.sections.keep(0);
        let mut effects = vec![self.claim_changed()];
        if self.executive.is_some() {
            let text = "the fuel is due: returning to base";
            effects.push(Effect::Alarm(text.into()));
        }
        effects
    }

    /// Whether this peer can fly what a division gives it.
    fn can_fly_plans(&self, s: &Situation<'_>) -> bool {
        let senses = s.percept.is_some() && self.executive.is_some();
        s.role == Role::Uav && senses && !self.exhausted
    }

    /// Looks up who is there to share the work, where that changed. Returns whether it did.
    fn gather(&mut self, s: &Situation<'_>, able: bool) -> bool {
        let of = Some((s.membership.changes(), s.me, able));
        let alone = self.negotiation.sections.alone();
        let company = &self.company;
        if company.of == of && company.alone == *alone && s.now < company.until {
            return false;
        }
        let alone = alone.clone();
        let mut live = reachable(s.membership, &alone);
        let members = self.members(s, &live, able);
        let unheard = self.add_expected(s, &mut live);
        let until = self.expected.values().min().copied();
        self.company = Arc::new(Company {
            live,
            members,
            unheard,
            of,
            alone,
            until: until.unwrap_or(Time(u64::MAX)),
        });
        true
    }

    /// Reachable UAVs on this loop whose beacon says able, this peer included if it is.
    fn members(&self, s: &Situation<'_>, live: &LivePeers, able: bool) -> Vec<Member> {
        let on_this_loop = |id: u16| {
            s.membership
                .info(id)
                .is_some_and(|i| i.able && !i.ground_station && i.loop_hash == self.loop_hash())
        };
        let others = live.iter().filter(|(id, _)| on_this_loop(**id));
        let others = others.map(|(id, incarnation)| Member {
            id: *id,
            incarnation: *incarnation,
        });
        let mut members: Vec<Member> = others.chain(able.then_some(s.me)).collect();
        members.sort_unstable();
        members
    }

    /// Lets the negotiation look at the time, and carries out what it wants.
    fn negotiate(&mut self, s: &Situation<'_>, able: bool, timers: &mut Timers) -> Effects {
        let before = Arc::clone(&self.company);
        let live_changed = self.gather(s, able);
        let company = Arc::clone(&self.company);
        self.able_since = able.then(|| self.able_since.unwrap_or(s.now));
        let is_lost = |(id, life)| company.live.get(id) != Some(life);
        if live_changed && before.live.iter().any(is_lost) {
            self.negotiation.note_gone();
        }
        let mut ctx = Context {
            now: s.now,
            interval_ms: s.membership.interval_ms(),
            live: &company.live,
            live_changed,
            members: &company.members,
            unheard: company.unheard,
            diameter: s.membership.diameter(s.now),
            able_since: self.able_since,
            revision: self.revision(),
            loop_hash: self.loop_hash(),
            held_expired: timers.take_due(Timer::HeldCells, s.now),
            gain_in_sight: false,
        };
        if self.negotiation.take_foresight(&ctx) {
            ctx.gain_in_sight = self.foresees_gain(s.me.id, &ctx);
        }
        let coverage_loop = Arc::clone(&self.geometry.coverage_loop);
        let mut actions = self.negotiation.tick(&ctx, &coverage_loop);
        let left_over = self.negotiation.take_left_over(&ctx);
        let within_reach = left_over.and_then(|cells| self.within_reach(&cells, s.percept));
        let taken = within_reach.and_then(|cells| self.negotiation.begin_take(&cells));
        let taken = taken.or_else(|| self.taken_without_a_round(s, &ctx));
        let taken = taken.or_else(|| self.first_section(s, &ctx));
        actions.extend(taken.map(Action::Take));
        let mut effects = Effects::new();
        let alone = s.membership.live().next().is_none();
        // What was said of being alone is taken back even where nothing is listed any more.
        if core::mem::replace(&mut self.alone, alone) != alone && (self.lists() || !alone) {
            effects.push(Effect::ClaimChanged);
        }
        for action in actions {
            match action {
                Action::Bid => effects.extend(self.bid(s)),
                Action::Divide { epoch, ring, uavs } => {
                    let geometry = Arc::clone(&self.geometry);
                    let job = Job::Divide {
                        geometry,
                        ring,
                        uavs,
                    };
                    effects.push(Effect::Compute(PendingJob::Division(epoch), job));
                }
                Action::Take(taken) => effects.extend(self.write_take(taken)),
                Action::Changed => effects.push(self.claim_changed()),
            }
        }
        effects
    }

    /// Whether this peer, with nothing to fly, would be of use in a new division of what
    /// the claims of others list.
    fn foresees_gain(&self, id: u16, ctx: &Context<'_>) -> bool {
        let sections = &self.negotiation.sections;
        let Some(executive) = &self.executive else {
            return false;
        };
        let forecast = executive.forecast(0, &|c| !sections.covered().contains(c));
        let me = Uav {
            anchor: forecast.anchor,
            id,
            heading: forecast.heading,
            release_ms: forecast.release_ms,
            speed_mmps: speed_mmps(executive),
            turn_ms: executive.turn_ms(),
            endurance_ms: UNREACHABLE_MS,
            off_loop: forecast.off_loop,
        };
        let present_ms = self.negotiation.present_end_ms(ctx);
        // The round takes a waiting time.
        let delay_ms = ctx.first_wait_ms();
        division::gain_in_sight(
            &self.geometry,
            (sections, ctx.live),
            me,
            present_ms,
            delay_ms,
        )
    }

    /// This peer's bid in the open round, to be told and made durable.
    fn bid(&self, s: &Situation<'_>) -> Effects {
        let (Some(open), Some(executive)) = (self.negotiation.rounds.open(), &self.executive)
        else {
            return Effects::new();
        };
        let sections = &self.negotiation.sections;
        let is_open = |c: u16| !sections.covered().contains(c);
        let forecast = executive.forecast(open.round.wait_ms, &is_open);
        let is_planned = |c: &u16| sections.plan().iter().any(|p| p.cell == *c);
        let commits = forecast.cells.iter().copied().filter(is_planned);
        let idle = sections.plan().is_empty();
        let bid = Bid {
            round: open.round.clone(),
            anchor: forecast.anchor,
            backward: forecast.heading == Direction::Backward,
            release_ms: forecast.release_ms,
            speed_mmps: speed_mmps(executive),
            turn_ms: executive.turn_ms(),
            endurance_ms: self
                .spendable_ms(s.percept)
                .saturating_sub(forecast.release_ms),
            covered: sections.covered().encode_rle(Some(BID_COVERED_MAX_BYTES)),
            commits: CellSet::of(sections.cells(), commits).runs(),
            off_loop: forecast.off_loop.into_iter().collect(),
            eta_ms: if idle { 0 } else { forecast.finish_ms },
            calm: self.negotiation.is_calm(s.now, s.membership.interval_ms()),
            progressed: self.negotiation.progressed(),
        };
        let report = Report::Round {
            counter: bid.round.counter,
            members: bid.round.members.iter().map(|m| PeerId(m.id)).collect(),
        };
        let entry = Entry::Bid(bid.clone());
        vec![
            Effect::Report(report),
            Effect::Store(Promise::Bid(Box::new(bid)), entry),
        ]
    }

    /// Cells to be taken without a round are made durable, as many as a claim holds.
    fn write_take(&mut self, mut taken: Vec<PlannedCell>) -> Option<Effect> {
        let sections = &self.negotiation.sections;
        let mut plan: Vec<PlannedCell> = sections.plan().iter().chain(&taken).copied().collect();
        plan.truncate(sections.fitting(&plan));
        taken.truncate(plan.len().saturating_sub(sections.plan().len()));
        if self.claims.under_way() || taken.is_empty() {
            self.negotiation.cancel_take();
            return None;
        }
        let (revision, loop_hash) = (self.revision(), self.loop_hash());
        let claim = sections.claim_with(sections.epoch(), &plan, revision, loop_hash);
        let promise = Promise::Take(self.claims.next(), taken);
        Some(Effect::Store(promise, Entry::Claim(claim)))
    }

    fn divided(&mut self, s: &Situation<'_>, epoch: Epoch, division: &Division) -> Effects {
        let Some(adoption) = self.negotiation.divided(s.now, epoch, division) else {
            return Effects::new();
        };
        let claim = self.negotiation.sections.claim_with(
            adoption.epoch,
            &adoption.plan,
            self.revision(),
            self.loop_hash(),
        );
        let promise = Promise::Adopt(self.claims.next(), Box::new(adoption));
        vec![Effect::Store(promise, Entry::Claim(claim))]
    }

    /// Lists only what can be flown (S10): the rest is orphaned, and that is a loss.
    /// Returns whether anything was given up.
    fn keep_within_endurance(&mut self, percept: Option<&Percept>) -> bool {
        let spendable = self.spendable_ms(percept);
        let Some(executive) = &self.executive else {
            return false;
        };
        let sections = &self.negotiation.sections;
        let legs = legs_of(sections.plan(), sections.cells());
        let times = executive.schedule(&legs, &|c| !sections.covered().contains(c));
        let Some((late, _)) = times.iter().find(|(_, ms)| *ms > spendable) else {
            return false;
        };
        let good = sections.plan().iter().position(|p| p.cell == *late);
        self.negotiation.sections.keep(good.unwrap_or(0));
        self.replan = true;
        true
    }

    /// A plan takes longer than when it was adopted if its first turn is begun from another
    /// pose, or if the UAV waited elsewhere meanwhile: what the fuel allows is looked at
    /// once a period.
    fn check_endurance(&mut self, s: &Situation<'_>) -> Option<Effect> {
        let looked_ago_ms = self.fuel_looked_at.map(|t| s.now.since_ms(t));
        let planned = !self.negotiation.sections.plan().is_empty();
        if !planned || looked_ago_ms.is_some_and(|ms| ms < s.period_ms) {
            return None;
        }
        self.fuel_looked_at = Some(s.now);
        self.keep_within_endurance(s.percept)
            .then(|| self.claim_changed())
    }

    /// All that can be covered is covered, or again not: the mission ends, the next lap
    /// begins once the others had the time to hear of the last cells, or it goes on.
    fn notice_end(&mut self, s: &Situation<'_>, timers: &mut Timers) -> Effects {
        let complete = self.negotiation.sections.complete();
        if complete && self.geometry.mission.further_laps > 0 {
            return self.next_lap(s, timers);
        }
        if complete == self.finished {
            return Effects::new();
        }
        self.finished = complete;
        self.replan = true;
        if !complete || s.role != Role::Uav {
            return Effects::new();
        }
        let revision = self.revision();
        let mut effects = vec![
            Effect::Report(Report::Finished { revision }),
            Effect::MissionFinished,
            Effect::ClaimChanged,
            Effect::CoverageChanged,
        ];
        effects.extend(self.save_covered(true));
        effects
    }

    fn next_lap(&mut self, s: &Situation<'_>, timers: &mut Timers) -> Effects {
        if timers.at(Timer::NextLap).is_none() {
            timers.set(Timer::NextLap, s.now.plus_ms(LAP_PERIODS * s.period_ms));
            let mut effects = vec![Effect::CoverageChanged];
            effects.extend(self.save_covered(true));
            return effects;
        }
        let next = timers
            .is_due(Timer::NextLap, s.now)
            .then(|| self.geometry.mission.next_lap())
            .flatten();
        next.map(|m| Effect::Offer(Arc::new(m)))
            .into_iter()
            .collect()
    }

    /// Gives the executive its goal, if that changed.
    fn steer(&mut self, order: Order) {
        let sections = &self.negotiation.sections;
        let base = self.geometry.mission.base_m();
        let goal = if order == Order::Hold {
            Goal::Hold
        } else if order == Order::ReturnToBase || self.finished || self.exhausted || self.silent {
            Goal::Point(base)
        } else if sections.plan().is_empty() && self.astray {
            // Where the ground station is and whoever is finished, somebody is heard.
            Goal::Point(base)
        } else if sections.plan().is_empty() {
            Goal::Hold
        } else {
            Goal::Legs(legs_of(sections.plan(), sections.cells()))
        };
        let same_kind = match (&self.goal, &goal) {
            (Some(Goal::Legs(_)), Goal::Legs(_)) => true,
            (Some(a), b) => a == b,
            (None, _) => false,
        };
        if same_kind && !core::mem::take(&mut self.replan) {
            return;
        }
        self.replan = false;
        if same_kind && !matches!(goal, Goal::Legs(_)) {
            return;
        }
        if let Some(executive) = &mut self.executive {
            executive.set_goal(goal.clone(), &|c| !sections.covered().contains(c));
        }
        self.goal = Some(goal);
    }
}

/// The peers that are alive and hear somebody. Whose claim says that it holds all others
/// for down hears no round and yields to nobody, so it counts as if it were out of reach
/// both ways: each side plans as if the other were dead.
fn reachable(membership: &Membership, alone: &BTreeMap<u16, Incarnation>) -> LivePeers {
    let live = membership.live();
    live.filter(|(id, life)| alone.get(id) != Some(life))
        .collect()
}

/// How fast a UAV gets on along the loop, mm/s.
pub(crate) fn speed_mmps(executive: &Executive) -> u32 {
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "an airspeed is a small positive number"
    )]
    let speed_mmps = (executive.loop_speed_mps() * 1000.0) as u32;
    speed_mmps
}
