//! What a peer has once it holds a mission and its geometry, and what of it is kept when
//! another mission arrives.
//!
//! | the new mission has | kept |
//! |---|---|
//! | the same loop | sections, rounds, claims being written, since when it is able |
//! | and the same zones, turn radius and clearance | the flight itself, with its goal |
//! | another loop, the same lap and sortie | covered cells of the same places |
//! | another lap or sortie | nothing is covered |
//! | any | the highest round counter; what the journal knows of that loop; that the fuel is due |
//!
//! And what it does with them: it hears of others' cells, negotiates and watches
//! the end. When that is, and where it flies, is the cooperation manager's; what it takes
//! without a round is in `taking`, what its fuel allows in `fuel`.

use crate::PeerId;
use crate::cells::CellSet;
use crate::company::Company;
use crate::config::{PeerConfig, Role};
use crate::cooperation::Situation;
use crate::diagram::StateGoal;
use crate::effect::{Effect, Effects, PendingJob, Promise};
use crate::fuel::Fuel;
use crate::input::Time;
use crate::journal::{Durable, Entry};
use crate::listening::Listening;
use crate::mission::Mission;
use crate::mission_change::{SeenBefore, executive_for, negotiation_begun, separation_for};
use crate::offload::{Job, MissionGeometry};
use crate::output::Report;
use crate::protocol::auction::flown::AskedWays;
use crate::protocol::division;
use crate::protocol::negotiation::{Action, Context, Negotiation, are_many};
use crate::protocol::runs::PlannedCell;
use crate::protocol::sections::FIRST_LIFE;
use crate::separation::Separation;
use crate::stage::Stage;
use crate::timers::{Timer, Timers};
use crate::why::BidHeard;
use crate::wire::codec::Body;
use crate::wire::limits::BID_COVERED_MAX_BYTES;
use crate::wire::message::{
    Activity, Beacon, Bid, Claim, Epoch, Finished, Member, MissionStatus, Order,
};
use skein_behaviors::executive::circuit::Fellow;
use skein_behaviors::executive::detour::Watched;
use skein_behaviors::executive::{GivenFlight, UNREACHABLE_MS};
use skein_behaviors::{Event, Executive, Goal};
use skein_flight::coverage::ring::Direction;
use skein_flight::coverage::ring::backtracking::{Division, Uav};
use skein_geometry::Segment;
use std::sync::Arc;

/// Own coverage is made durable every so many cells: a crash costs at most these.
pub const CELLS_PER_COVERED_RECORD: u16 = 5;

/// Beacon periods for which the last cells of a lap are told before the next lap begins:
/// one to speak, two to be passed on. Who misses them flies those cells again, and hears
/// of the next lap from the ground station.
const LAP_PERIODS: u64 = 3;

/// Among many, who has nothing to fly waits near the others for so many intervals T' while nobody
/// that it hears has cells to fly: as long as after a division nobody asks for another one.
const IDLE_INTERVALS: u64 = 20;

/// For so many periods after a beacon its author is taken to fly on round the loop.
const FELLOW_PERIODS: u64 = 60;

/// Claims on their way to the journal, numbered in the order in which it gets them. Only
/// the last of them may be installed, for it is the one that the journal ends with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ClaimsWritten {
    written: u64,
    answered: u64,
}

impl ClaimsWritten {
    /// All that was written so far is void: none of it is the last.
    fn void(self) -> Self {
        let written = self.written + 1;
        Self {
            written,
            answered: written,
        }
    }

    /// The number of one more.
    pub fn next(&mut self) -> u64 {
        self.written += 1;
        self.written
    }

    /// The answer to one of them came. Returns whether it is the last.
    pub fn answer(&mut self, number: u64) -> bool {
        self.answered = self.answered.max(number);
        assert!(self.answered <= self.written, "an answer to nothing");
        number >= self.written
    }

    /// Whether one of them is still on its way.
    pub fn under_way(self) -> bool {
        self.answered < self.written
    }
}

/// A relay position that a UAV was given.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RelayPosition {
    /// The circle that is flown there, once it is planned.
    pub circle: Option<Segment>,
    /// Of a target to follow, once it is near: how far from it the UAV stays, metres.
    pub follow: Option<f64>,
}

/// What a peer has once it holds a mission and its geometry.
#[derive(Debug)]
pub(crate) struct MissionState {
    pub geometry: Arc<MissionGeometry>,
    /// Ways round its zones for which bids were made.
    pub asked_ways: AskedWays,
    pub executive: Option<Executive>,
    /// How it is kept apart from others at its height.
    pub separation: Option<Separation>,
    pub negotiation: Negotiation,
    goal: Option<Goal>,
    /// The flight of the task that it was given, between two cells of its section.
    pub errand: Option<GivenFlight>,
    /// The relay position that it was given, which it holds instead of a section.
    pub relay: Option<RelayPosition>,
    /// Whether a task is open that somebody can do.
    pub has_tasks: bool,
    /// Whether the goal is to be given to the executive again.
    pub(crate) replan: bool,
    /// Since when this peer can plan without a break.
    pub able_since: Option<crate::Time>,
    /// Who shares the work.
    pub company: Company,
    /// Whether all others were believed down at the last tick.
    alone: bool,
    pub finished: bool,
    /// Since when it has nothing to fly and nobody that it hears has cells to fly.
    idle_since: Option<Time>,
    /// Whether it heard of many, and to wait where it is leads to nothing.
    pub astray: bool,
    /// Where it waits with nothing to do.
    pub listening: Listening,
    /// Whether another process under its id has silenced this peer.
    pub silent: bool,
    /// How many peers of its fleet it believes to be down.
    pub lost: usize,
    /// What it takes the wind for, m/s; 0 without a percept.
    pub wind_mps: f64,
    /// Whether something that the mission looks for was told.
    pub detected: bool,
    /// Whether a sector of the event that its mission watches is too dense.
    pub too_dense: bool,
    /// Whether it lost the target that it follows.
    pub target_lost: bool,
    /// Whether everything is seen, and no task is open that somebody can do.
    pub complete: bool,
    /// Where in the diagram of its mission it is.
    pub stage: Stage,
    /// What is known of its fuel.
    pub fuel: Fuel,
    /// Whether it said that it lists nothing since it was told to return.
    pub has_released: bool,
    /// Cells covered by itself since the last entry of the journal.
    pub unsaved_cells: u16,
    pub claims: ClaimsWritten,
    /// What was covered on the loops before this one.
    seen_before: SeenBefore,
}

impl MissionState {
    /// What it owned is void.
    pub fn void_ownership(&mut self, me: Member, timers: &mut Timers) {
        timers.stop(Timer::HeldCells);
        self.negotiation.void_ownership(me);
        if me.incarnation > FIRST_LIFE {
            self.company.forget_launches();
        }
        self.able_since = None;
        self.replan = true;
        // What another life said of the end this one has not.
        self.finished = false;
        if let Some(separation) = &mut self.separation {
            separation.begin_life(me);
        }
    }

    pub fn revision(&self) -> u32 {
        self.geometry.mission.revision
    }

    pub fn loop_hash(&self) -> u64 {
        self.geometry.coverage_loop.hash()
    }

    pub fn able(&self) -> bool {
        self.able_since.is_some()
    }

    pub fn finished(&self) -> bool {
        self.finished
    }

    pub fn covered(&self) -> &CellSet {
        self.negotiation.sections.covered()
    }

    pub fn activity(&self) -> Activity {
        match &self.goal {
            Some(Goal::Legs(_) | Goal::Round | Goal::Trace | Goal::Given(_) | Goal::Detour(..)) => {
                Activity::Covering
            }
            Some(Goal::Hold | Goal::Circle(_) | Goal::Follow(_)) => Activity::Holding,
            Some(Goal::Point(_)) => Activity::Returning,
            None => Activity::Waiting,
        }
    }

    pub fn status(&self) -> MissionStatus {
        let sections = &self.negotiation.sections;
        if self.finished {
            MissionStatus::Accomplished
        } else if !sections.unassigned().is_empty() && sections.plan().is_empty() {
            MissionStatus::Failed
        } else {
            MissionStatus::Active
        }
    }

    /// The own claim, with the expected end of the plan.
    pub fn claim(&self) -> Claim {
        let sections = &self.negotiation.sections;
        Claim {
            // Who lists nothing takes nothing from anybody, and may be asked for a bid.
            alone: self.alone && self.lists(),
            ..sections.claim(self.revision(), self.loop_hash(), self.eta_ms())
        }
    }

    /// Whether its claim lists any cell.
    pub fn lists(&self) -> bool {
        let sections = &self.negotiation.sections;
        !sections.plan().is_empty() || !sections.held().is_empty()
    }

    pub fn eta_ms(&self) -> u32 {
        let sections = &self.negotiation.sections;
        match &self.executive {
            Some(e) if !sections.plan().is_empty() => {
                e.finish_ms(&|c| !sections.covered().contains(c))
            }
            _ => 0,
        }
    }

    pub fn on_event(&mut self, event: Event) -> Effects {
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
            // Whoever flies a task is told of these.
            Event::Sighted { .. } | Event::DetourFlown => Effects::new(),
            Event::PlanDone => {
                self.replan |= !self.negotiation.sections.plan().is_empty();
                Effects::new()
            }
            Event::Refused { cells } => {
                self.negotiation.sections.give_up(&cells);
                let text = "a cell could not be reached clear of the zones; it was given up";
                vec![self.claim_changed(), Effect::Alarm(text.into())]
            }
            Event::CutShort { at_m, why } => {
                let text = format!("the given flight ends after {at_m:.0} m: {why:?}");
                vec![Effect::Alarm(text)]
            }
        }
    }

    /// A claim, a bid or covered cells of another peer.
    pub fn hear(&mut self, now: Time, author: Member, seq: u32, body: &Body) -> Effects {
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
                let sections = &mut negotiation.sections;
                let news = claim.loop_hash == mine && sections.hear(id, life, seq, claim.clone());
                news.then_some(Effect::Negotiate).into_iter().collect()
            }
            Body::Bid(bid) if bid.round.loop_hash == mine => {
                if let Err(why) = negotiation.hear_bid(now, author, bid) {
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
            Body::Finished(Finished { revision }) => {
                if self.geometry.mission.has_lap_of(*revision) {
                    self.stage.hear_finished();
                }
                Effects::new()
            }
            _ => Effects::new(),
        }
    }

    /// The own claim changed: it is spoken, and flown by.
    pub fn claim_changed(&mut self) -> Effect {
        self.replan = true;
        Effect::ClaimChanged
    }

    /// Covered cells, if enough are new to be made durable; `now` takes any.
    pub fn save_covered(&mut self, now: bool) -> Option<Effect> {
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

    /// It is told to return, or holds a relay position: what it was to fly is for the others, from now on, also
    /// where a division gave it something meanwhile. What it gave away before it still holds,
    /// until its new owner says so or it expires.
    pub fn release_section(&mut self, role: Role) -> Effects {
        let is_said = core::mem::replace(&mut self.has_released, true);
        if role != Role::Uav || (is_said && self.negotiation.sections.plan().is_empty()) {
            return Effects::new();
        }
        self.negotiation.sections.keep(0);
        vec![self.claim_changed(), Effect::ClaimNow]
    }

    /// Whether this peer can fly what a division gives it.
    pub fn can_fly_plans(&self, s: &Situation<'_>) -> bool {
        let senses = s.percept.is_some() && self.executive.is_some();
        s.role == Role::Uav && senses && !self.fuel.is_due()
    }

    /// Lets the negotiation look at the time, and carries out what it wants.
    pub fn negotiate(&mut self, s: &Situation<'_>, able: bool, timers: &mut Timers) -> Effects {
        let before = self.company.present();
        let (loop_hash, alone) = (self.loop_hash(), self.negotiation.sections.alone());
        let live_changed = self.company.gather(s, able, loop_hash, alone);
        let present = self.company.present();
        self.able_since = able.then(|| self.able_since.unwrap_or(s.now));
        let is_lost = |(id, life)| present.live.get(id) != Some(life);
        if live_changed && before.live.iter().any(is_lost) {
            self.negotiation.note_gone();
        }
        let mut ctx = Context {
            now: s.now,
            interval_ms: s.membership.interval_ms(),
            live: &present.live,
            live_changed,
            members: &present.members,
            unheard: present.unheard,
            elsewhere: &present.elsewhere,
            diameter: s.membership.diameter(s.now),
            able_since: self.able_since,
            revision: self.revision(),
            loop_hash,
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
        // Who stood still has been flown on by its airframe, as was promised.
        let common_ms = self.separation.as_ref().map(|x| x.common_ms(s.now));
        let flown_on = common_ms.and_then(|at_ms| executive.flown_on(at_ms));
        let executive = flown_on.as_ref().unwrap_or(executive);
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
                .offered_ms(s.percept)
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
            repair: bid.round.repair,
            bid: BidHeard::of(s.me.id, &bid),
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

    pub fn divided(&mut self, s: &Situation<'_>, epoch: Epoch, division: &Division) -> Effects {
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

    /// All that can be covered is covered, or again not: the mission ends, the next lap
    /// begins once the others had the time to hear of the last cells, or it goes on.
    pub fn notice_end(&mut self, s: &Situation<'_>, timers: &mut Timers) -> Effects {
        let covered = self.negotiation.sections.complete();
        let complete = covered && !self.has_tasks;
        let ended = self.stage.ended();
        if covered && self.geometry.mission.further_laps > 0 && !ended {
            return self.next_lap(s, timers);
        }
        self.complete = complete;
        let finished = complete && !self.stage.goes_on() || ended;
        if finished == self.finished {
            return Effects::new();
        }
        self.finished = finished;
        self.replan = true;
        if !finished || s.role != Role::Uav {
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

    /// The later lap of this mission that the author of a beacon has begun.
    pub fn lap_of(&self, beacon: &Beacon) -> Option<Mission> {
        let (geometry, mission) = (&self.geometry, &self.geometry.mission);
        let later = mission.later_lap(beacon.revision)?;
        let hash = geometry.coverage_loop.hash_in_lap(mission.lap, later.lap);
        (hash == beacon.loop_hash).then_some(later)
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

    /// From now on this flight is flown between two cells, and this is looked for; or nothing.
    pub fn set_errand(&mut self, errand: Option<(GivenFlight, Watched)>) {
        let (flight, watched) = errand.unzip();
        self.errand = flight;
        if let Some(executive) = &mut self.executive {
            executive.watch(watched);
        }
    }

    /// How far it stays from the target that it was given, metres, once that may be near.
    pub fn followed_at_m(&self) -> Option<f64> {
        self.relay.and_then(|r| r.follow)
    }

    /// The circle of the relay position that it was given, once it is planned.
    pub fn relay_circle(&self) -> Option<Segment> {
        self.relay.and_then(|r| r.circle)
    }

    /// Looks at the events that hold, and gives the executive the goal of the state.
    pub fn steer_by_state(&mut self, now: Time, order: Order) {
        self.look(now, order);
        if !self.waits_at_base(order) {
            self.listening = Listening::default();
        }
        self.steer(self.goal_of_state());
    }

    /// Whether it has nothing to do, and nobody told it to be at its base. Where circles are
    /// settled with others it stays on that which it has.
    fn waits_at_base(&self, order: Order) -> bool {
        let is_free = order == Order::Resume && !self.fuel.is_due() && !self.silent;
        is_free && self.separation.is_none() && self.stage.state().goal == StateGoal::Home
    }

    /// Looks whether to wait where it is leads to anything: among many that hear no more than a
    /// part of each other the rest may be done, and whoever is done is at the base.
    pub fn notice_astray(&mut self, s: &Situation<'_>) {
        let is_many = are_many(s.membership.uavs());
        let sections = &self.negotiation.sections;
        let waits = is_many && sections.plan().is_empty();
        let live = &self.company.present().live;
        self.idle_since = if waits && live.keys().all(|id| sections.n_left(*id) == 0) {
            self.idle_since.or(Some(s.now))
        } else {
            None
        };
        let wait_ms = IDLE_INTERVALS * s.membership.interval_ms();
        let nobody_works = self
            .idle_since
            .is_some_and(|t| s.now.since_ms(t) >= wait_ms);
        self.astray = is_many && (nobody_works || s.membership.hears_nobody(s.now));
    }

    /// Looks where to wait for what the operator wants next.
    pub fn listen(&mut self, s: &Situation<'_>, order: Order) {
        if !self.waits_at_base(order) {
            return;
        }
        let base = self.geometry.mission.base_m();
        let hears = !s.membership.lacks_stations();
        let place = (base, &*self.geometry.router);
        self.listening.look(s.now, hears, s.period_ms, place);
    }

    /// Tells the executive who else flies round, as far as their beacons said so: who is able has
    /// nothing else to do once everything is seen, and who is elsewhere is not on the loop.
    pub fn keep_even(&mut self, s: &Situation<'_>) {
        if self.goal != Some(Goal::Round) {
            return;
        }
        let fellows = self.fellows(s);
        if let Some(executive) = &mut self.executive {
            executive.keep_even(&fellows);
        }
    }

    /// By which goal its executive flies.
    pub fn flown_goal(&self) -> Option<&Goal> {
        self.goal.as_ref()
    }

    /// Who else is able on its loop, as far as beacons said so lately.
    pub fn fellows(&self, s: &Situation<'_>) -> Vec<Fellow> {
        let loop_hash = self.loop_hash();
        let fellow = |(id, _)| {
            let info = s.membership.info(id)?;
            let age_ms = s.now.since_ms(info.heard?);
            let place = info
                .place
                .filter(|_| info.able && info.loop_hash == loop_hash)?;
            let is_new = age_ms <= FELLOW_PERIODS * s.period_ms;
            let age_ms = u32::try_from(age_ms).ok().filter(|_| is_new)?;
            let pose = place.pose();
            Some(Fellow { id, pose, age_ms })
        };
        s.membership.live().filter_map(fellow).collect()
    }

    /// Gives the executive its goal, if that changed.
    fn steer(&mut self, goal: Goal) {
        let sections = &self.negotiation.sections;
        let same_kind = match (&self.goal, &goal) {
            (Some(Goal::Legs(_)), Goal::Legs(_)) => true,
            (Some(Goal::Detour(a, _)), Goal::Detour(b, _)) => a == b,
            (Some(a), b) => a == b,
            (None, _) => false,
        };
        if same_kind && !core::mem::take(&mut self.replan) {
            return;
        }
        self.replan = false;
        if same_kind && !matches!(goal, Goal::Legs(_) | Goal::Detour(..)) {
            return;
        }
        if let Some(executive) = &mut self.executive {
            executive.set_goal(goal.clone(), &|c| !sections.covered().contains(c));
        }
        self.goal = Some(goal);
    }

    /// The state of a mission whose geometry has arrived, with what is kept of the last
    /// one.
    pub fn begun(
        geometry: Arc<MissionGeometry>,
        old: Option<Self>,
        me: Member,
        config: &PeerConfig,
        durable: &Durable,
        timers: &mut Timers,
    ) -> Self {
        // A loop of more cells is no geometry: `LoopError::TooManyCells`.
        let cells = u16::try_from(geometry.coverage_loop.len()).unwrap_or(u16::MAX);
        timers.stop(Timer::NextLap);
        let before = old.as_ref().map(|m| (&*m.geometry, &m.negotiation));
        let left = |m: &Self| m.seen_before.clone().left(&m.geometry, &m.negotiation);
        let seen_before = old.as_ref().map_or_else(SeenBefore::default, left);
        let mut new = Self {
            negotiation: negotiation_begun(&geometry, before, &seen_before, me, durable, cells),
            executive: executive_for(&geometry, config),
            separation: separation_for(&geometry, me, config),
            goal: None,
            errand: None,
            relay: None,
            has_tasks: old.as_ref().is_some_and(|m| m.has_tasks),
            replan: true,
            able_since: None,
            company: Company::begun(old.is_none(), me, config, durable),
            alone: false,
            finished: false,
            idle_since: None,
            astray: false,
            listening: Listening::default(),
            silent: false,
            lost: 0,
            wind_mps: 0.0,
            detected: false,
            too_dense: false,
            target_lost: false,
            complete: false,
            stage: Stage::begun(
                &geometry.mission,
                old.as_ref().map(|m| (&*m.geometry.mission, &m.stage)),
            ),
            fuel: old.as_ref().map_or_else(Fuel::default, |m| m.fuel.kept()),
            has_released: false,
            unsaved_cells: 0,
            // What is still being written was promised for the old loop.
            claims: old
                .as_ref()
                .map_or_else(Default::default, |m| m.claims.void()),
            geometry,
            asked_ways: AskedWays::default(),
            seen_before,
        };
        match old {
            Some(old) if old.loop_hash() == new.loop_hash() => new.keep_on(old),
            old => {
                timers.stop(Timer::HeldCells);
                if let Some(old) = old {
                    new.keep_promises(old.executive.as_ref(), old.separation);
                }
            }
        }
        new
    }

    /// What others were promised is flown on whatever else changes, and what they said counts.
    fn keep_promises(&mut self, flew: Option<&Executive>, before: Option<Separation>) {
        let (Some(executive), Some(flew)) = (&mut self.executive, flew) else {
            return;
        };
        if let Some(before) = before
            && let Some(new) = self.separation.take()
        {
            let _ = executive.take_over(flew);
            self.separation = Some(new.after(before, executive));
        }
    }

    /// On the same loop sections and rounds stay what they are, so that a revision which
    /// arrives at one peer after the other parts nobody; between the same zones a UAV
    /// stays on its curve, too.
    fn keep_on(&mut self, old: Self) {
        self.negotiation = old.negotiation;
        self.able_since = old.able_since;
        self.company = old.company;
        self.alone = old.alone;
        self.claims = old.claims;
        self.unsaved_cells = old.unsaved_cells;
        let (new, before) = (&self.geometry.mission, &old.geometry.mission);
        let flown_alike = new.zones == before.zones
            && new.added_zones == before.added_zones
            && new.turn_radius_mm == before.turn_radius_mm
            && new.clearance_mm == before.clearance_mm;
        if flown_alike {
            let base = new.base_m();
            let town = &self.geometry.town;
            let kept = |e: Executive| e.with_home(base).with_town(town.clone());
            self.executive = old.executive.map(|e| kept(e).without_heeded());
            self.separation = old.separation;
            self.errand = old.errand;
            self.relay = old.relay;
            self.goal = old.goal;
            self.replan = old.replan;
        } else {
            self.keep_promises(old.executive.as_ref(), old.separation);
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_last_claim_written_is_installed() {
        let mut claims = ClaimsWritten::default();
        let (first, second) = (claims.next(), claims.next());
        assert!(!claims.answer(first) && claims.under_way());
        assert!(claims.answer(second) && !claims.under_way());
        let third = claims.next();
        let mut on_a_new_loop = claims.void();
        assert!(!on_a_new_loop.under_way());
        assert!(
            !on_a_new_loop.answer(third),
            "it was written for the old loop"
        );
    }
}
