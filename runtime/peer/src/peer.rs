//! The peer: routes events to its parts and carries out their effects. No policy.
//!
//! | what happens | who decides |
//! |---|---|
//! | life, probation, silence | `protocol::life` |
//! | what bytes are | `inbound` |
//! | who is there | `protocol::membership` |
//! | what is passed on | `protocol::relay` |
//! | what is spoken, when | `outbound` |
//! | mission, goal, sections | `cooperation` |
//!
//! Outputs, the journal's tokens and the relay belong to the peer alone.

use crate::Follows;
use crate::beliefs::Beliefs;
use crate::config::{PeerConfig, Role};
use crate::cooperation::{Cooperation, Situation};
use crate::diary::Diary;
use crate::effect::{Effect, Effects, PendingJob, Promise};
use crate::footprint::Footprint;
use crate::gathering::{Crowd, Sector};
use crate::hint::{Hint, NoWay, WayHint};
use crate::inbound::{self, Heard};
use crate::input::{Command, Input, Time};
use crate::input::{OperatorsTasks, TaskEdit};
use crate::journal::{Durable, Entry};
use crate::mission::{PointMm, point_m};
use crate::offload::{Job, JobResult};
use crate::outbound::{self, Outbound, Sources};
use crate::output::{Output, Report, Status};
use crate::overview::Overview;
use crate::protocol::life::Life;
use crate::protocol::membership::{Change, Membership};
use crate::protocol::negotiation::are_many;
use crate::protocol::relay::{Offer, Relay};
use crate::task_desk::TaskView;
use crate::tasking::Call;
use crate::timers::{Timer, Timers};
use crate::transmission::Transmission;
use crate::usage::Usages;
use crate::why::{self, Other, Why};
use crate::wire::codec::{self, Body};
use crate::wire::count::Count;
use crate::wire::key;
use crate::wire::kinds::Kind;
use crate::wire::message::{Beacon, Fresh, Gossip, Heartbeat, Lacking, Member, Orders, Record};
use crate::{Incarnation, Mission, PeerId};
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};
use skein_behaviors::Percept;
use skein_behaviors::wind_estimate::WindEstimate;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

/// Most stores under way: one per kind of promise and a few of covered cells. A driver
/// that answers none of them is broken: the peer promises nothing more.
pub const MAX_STORES: usize = 32;

/// Most jobs under way: one geometry a mission revision, one division a round. Of more the
/// oldest is given up: a driver that still works on it is too late.
pub const MAX_JOBS: usize = 8;

/// Whoever was not heard for so many intervals may have missed what was said meanwhile.
const STRANGE_INTERVALS: u64 = 4;

/// A mission of which nobody heard follows it, and no piece came for so many intervals, is
/// asked for no more: it may be made up.
const COLLECTING_INTERVALS: u64 = 32;

/// Two programs in one airframe sense one place: what one of them tells of it is at most a
/// second old when the other hears it, and a position is known to some metres.
const SAME_PLACE_M: f64 = 60.0;

/// What is said at once carries so many heartbeats of others at most.
const AT_ONCE_MAX: usize = 12;

/// What is said at once waits a random time up to so long for each who shares the channel: it
/// takes as long on the air.
const QUESTION_SPREAD_MS: u64 = 12;

/// How often a peer looks at its deadlines, as a fraction of the beacon period.
pub const CADENCE: u64 = 4;

/// Who stood still for more periods than this does not bid by where it was before.
const LOST_PERIODS: u64 = 2;

/// The mind of one peer. The contract is at the top of the crate.
#[derive(Debug)]
pub struct Peer {
    config: PeerConfig,
    now: Time,
    started: bool,
    rng: ChaCha8Rng,
    timers: Timers,
    life: Life,
    membership: Membership,
    relay: Relay,
    outbound: Outbound,
    cooperation: Cooperation,
    percept: Option<Percept>,
    /// Until then, at the latest, it waits for a percept before it bids: it stood still, and
    /// knows only where it was before.
    lost_until: Option<Time>,
    /// The wind, where percepts do not tell it.
    wind: WindEstimate,
    durable: Durable,
    outputs: VecDeque<Output>,
    last_token: u64,
    stores: BTreeMap<u64, (Promise, Entry)>,
    jobs: BTreeMap<u64, PendingJob>,
    /// Whether the last beacon was one with which goes what is lacking.
    lacking_told: bool,
    diary: Diary,
}

impl Peer {
    /// A peer that has not started; its first input must be [`Input::Start`].
    #[must_use]
    pub fn new(config: PeerConfig) -> Self {
        let period = config.beacon_period_ms.max(1);
        let mut seed = [0u8; 32];
        seed[..8].copy_from_slice(&config.seed.to_le_bytes());
        seed[8..10].copy_from_slice(&config.id.0.to_le_bytes());
        let mut timers = Timers::default();
        let mut relay = Relay::new(config.id.0, &config.fleet, config.rate_bps, period);
        if are_many(config.launches.len()) {
            relay.air.expect(config.launches.len());
        }
        Self {
            membership: Membership::new(config.id.0, period),
            relay,
            outbound: Outbound::new(u64::from(period), &mut timers),
            cooperation: Cooperation::new(&config),
            percept: None,
            lost_until: None,
            wind: WindEstimate::default(),
            durable: Durable::default(),
            outputs: VecDeque::new(),
            last_token: 1,
            stores: BTreeMap::new(),
            jobs: BTreeMap::new(),
            lacking_told: false,
            diary: Diary::default(),
            now: Time(0),
            started: false,
            life: Life::default(),
            rng: ChaCha8Rng::from_seed(seed),
            timers,
            config,
        }
    }

    /// Takes one input at the peer's own time. Time that runs backwards stands still.
    pub fn handle(&mut self, now: Time, input: Input) {
        let before = self.now;
        self.now = before.max(now);
        self.notice_lateness(before);
        match input {
            Input::Start { persisted, nonce } if !self.started => {
                return self.on_start(&persisted, nonce);
            }
            _ if !self.started => return,
            Input::Start { .. } | Input::Timer => {}
            Input::Percept(percept) => self.on_percept(percept),
            // What is passed on is judged by the copies heard, whoever sent them.
            Input::Received { hops, heard, .. } => self.on_received(hops, &heard),
            Input::LinkHint { neighbour, up } => self.membership.link(neighbour, up),
            Input::Stored { token, ok } => self.on_stored(token, ok),
            Input::Computed { token, result } => self.on_computed(token, result),
            Input::Command(command) => self.on_command(command),
        }
        self.on_time();
    }

    /// The next output of the last input, if there is one left.
    pub fn poll(&mut self) -> Option<Output> {
        self.outputs.pop_front()
    }

    /// When the peer wants [`Input::Timer`] at the latest.
    #[must_use]
    pub fn next_timeout(&self) -> Option<Time> {
        if !self.started {
            return None;
        }
        let timers = self.timers.next_timeout();
        let relay = self.relay.next_timeout(self.now);
        let next = timers.into_iter().chain(relay).min();
        next.map(|t| t.max(self.now.plus_ms(1)))
    }

    // --- Events.

    fn on_start(&mut self, persisted: &[Vec<u8>], nonce: u32) {
        self.started = true;
        self.timers.set(Timer::Tick, self.now);
        let (durable, unread) = Durable::replay(persisted);
        self.durable = durable;
        if unread > 0 {
            self.alarm(&format!(
                "{unread} journal records of a later version were skipped"
            ));
        }
        let (period_ms, last_life) = (self.period_ms(), self.durable.incarnation);
        let effects = self
            .life
            .start(self.now, period_ms, &mut self.timers, nonce, last_life);
        Outbound::start(&mut self.timers);
        self.carry_out(effects);
        let effects = self.cooperation.consider_mission();
        self.carry_out(effects);
    }

    /// Whoever stood still, or whose clock jumped, was deaf meanwhile: what it waits for
    /// from others it waits for in the time in which it listens.
    fn notice_lateness(&mut self, before: Time) {
        let due = self.timers.at(Timer::Tick).unwrap_or(self.now);
        let late_ms = self.now.since_ms(due);
        if late_ms > self.period_ms() / 2 {
            let slept_ms = self.now.since_ms(before);
            self.membership.was_late(self.now, late_ms, slept_ms);
            self.life.was_late(late_ms);
            self.cooperation.was_late(late_ms, &mut self.timers);
            if slept_ms > LOST_PERIODS * self.period_ms() {
                self.lost_until = Some(self.now.plus_ms(self.period_ms() / CADENCE));
            }
        }
    }

    /// The timers that are due, then whatever may be sent now.
    fn on_time(&mut self) {
        if self.timers.is_due(Timer::Tick, self.now) {
            let next = self.now.plus_ms(self.period_ms() / CADENCE);
            self.timers.set(Timer::Tick, next);
            let durations_ms = (self.period_ms(), self.membership.bound_ms(self.now));
            let durable = self.durable.incarnation;
            let effects = self
                .life
                .tick(self.now, durations_ms, &mut self.timers, durable);
            self.carry_out(effects);
            let changes = self.membership.tick(self.now);
            self.report_changes(changes);
            self.negotiate();
            if self.speaks() {
                let effects = self.with_sources(Outbound::tick);
                self.carry_out(effects);
            }
        }
        if self.timers.is_due(Timer::Beacon, self.now) {
            self.beacon();
        }
        if self.timers.take_due(Timer::Question, self.now) {
            self.say_at_once();
        }
        self.send();
    }

    fn on_percept(&mut self, percept: Percept) {
        let finite = [
            percept.pose.east_m,
            percept.pose.north_m,
            percept.pose.heading_rad,
            percept.endurance_s,
        ];
        if finite.iter().any(|v| !v.is_finite()) {
            return self.refuse("a percept that is not finite".into());
        }
        let percept = self.wind.complete(percept);
        self.percept = Some(percept);
        let was_lost = self.lost_until.take().is_some();
        let mut effects = self.cooperation.on_percept(self.now, &percept);
        // One airframe is not flown by two.
        if self.life.shares_airframe() {
            effects.retain(|e| !matches!(e, Effect::Fly(_)));
        }
        self.carry_out(effects);
        if was_lost {
            self.negotiate();
        }
    }

    fn on_received(&mut self, hops: u8, transmission: &Transmission) {
        let heard = inbound::sort(transmission, self.config.id.0, &self.life);
        if let Heard::Beacon(record, _) | Heard::Heartbeat(record, _) | Heard::Record(_, record, _) =
            &heard
            && !self
                .membership
                .may_live_in(record.author, record.incarnation)
        {
            return self.refuse("a life far ahead of the one that is known".into());
        }
        match heard {
            Heard::Refused(why) => self.refuse(why.to_owned()),
            Heard::Twin(twin, at) => {
                let mine = self.percept.map(|p| p.pose.position());
                let here = mine.is_some_and(|mine| (at - mine).norm() < SAME_PLACE_M);
                let (now, sent) = (self.now, self.outbound.heartbeat());
                let effects = self.life.hear_twin((now, &self.timers), twin, sent, here);
                self.carry_out(effects);
            }
            Heard::Myself => {}
            Heard::Echo(record) => {
                self.relay.echo(record);
                let effects = self.life.hear_of_myself(record.incarnation, false);
                self.carry_out(effects);
            }
            Heard::Beacon(record, beacon) => self.on_beacon(record, beacon),
            Heard::Heartbeat(record, h) => {
                let (now, author, life) = (self.now, record.author, record.incarnation);
                let heartbeat = (record.seq, h.interval);
                let mut changes = self.membership.on_heartbeat(now, author, life, heartbeat);
                changes.extend(self.membership.on_others(now, author, &h.fresh));
                self.on_question_of_me(&h.fresh);
                self.report_changes(changes);
                self.relay.air.hear(now, author, (h.interval, h.sharers));
            }
            Heard::Record(_, record, Body::Lacking(lacking)) => {
                self.relay.on_lacking(self.now, record.author, lacking);
            }
            Heard::Record(kind, record, body) => {
                self.membership.note_heard(self.now);
                let bytes = transmission.bytes();
                if kind.relayed() && self.relay.offer(self.now, record, bytes, hops) != Offer::New {
                    return;
                }
                let author = (record.author, record.incarnation);
                self.membership.on_record(self.now, author, hops);
                if let Body::Bid(bid) = body {
                    self.diary.note_bid(self.now, record.author, bid);
                }
                if let Body::Claim(claim) = body {
                    let works_on = (claim.revision, claim.loop_hash);
                    self.membership.on_claim(self.now, author, works_on);
                }
                let effects = self.cooperation.hear(self.now, (record, hops), body);
                self.carry_out(effects);
            }
        }
    }

    /// What a neighbour knows of this peer's own id.
    fn on_gossip_of_me(&mut self, told: &Gossip) {
        let heartbeat = (told.incarnation, told.heartbeat);
        let age_ms = u64::from(told.age_ds) * 100;
        let never_said = told.max_seq > self.outbound.seq();
        let sent = (self.outbound.heartbeat(), never_said);
        let now = (self.now, &self.timers);
        let ages_ms = (age_ms, self.membership.k1_ms(self.now));
        let effects = self.life.hear_of_heartbeat(now, heartbeat, ages_ms, sent);
        self.carry_out(effects);
    }

    /// A neighbour suspects this peer, and asks for it at once.
    fn on_question_of_me(&mut self, told: &[Fresh]) {
        let (me, life) = (self.me().id, Fresh::life_of(self.me().incarnation));
        if told
            .iter()
            .any(|f| f.id == me && f.life == life && f.suspected_ds.is_some())
        {
            let until = self.now.plus_ms(self.membership.verdict_ms(self.now));
            self.outbound
                .refute(self.now, until, &mut self.timers, &mut self.rng);
        }
    }

    fn on_beacon(&mut self, record: &Record, beacon: &Beacon) {
        let (now, author, me) = (self.now, record.author, self.config.id.0);
        let lately_ms = STRANGE_INTERVALS * self.membership.interval_ms();
        let heard = self.membership.info(author).and_then(|info| info.heard);
        if heard.is_none_or(|t| now.since_ms(t) > lately_ms) {
            self.outbound.meet();
        }
        let changes = self
            .membership
            .on_beacon(now, author, record.incarnation, beacon);
        self.report_changes(changes);
        for told in beacon.gossip.iter().filter(|g| g.id == me) {
            self.on_gossip_of_me(told);
            if told.incarnation == self.life.incarnation() {
                match told.suspected_ds {
                    Some(_) => {
                        let until = now.plus_ms(self.membership.verdict_ms(now));
                        self.outbound
                            .refute(now, until, &mut self.timers, &mut self.rng);
                    }
                    None => self.outbound.believed(now, &mut self.timers),
                }
            }
        }
        self.relay.on_beacon(now, author, beacon);
        let effects = self.cooperation.hear_beacon(author, beacon);
        self.carry_out(effects);
    }

    fn on_stored(&mut self, token: u64, ok: bool) {
        let Some((promise, entry)) = self.stores.remove(&token) else {
            return;
        };
        if !ok {
            self.alarm("the journal could not be written; what it was to promise is not spoken");
            return self.on_broken(&promise);
        }
        self.durable.apply(&entry);
        let plans = matches!(promise, Promise::Adopt(..) | Promise::Take(..));
        if plans && self.life.is_silent() {
            return self.on_broken(&promise);
        }
        let effects = match promise {
            Promise::Life(incarnation) => self.life.on_durable(incarnation),
            Promise::Bid(bid) => self.cooperation.on_bid_durable(*bid),
            Promise::Adopt(written, adoption) => {
                let (situation, cooperation, timers) = self.situation();
                cooperation.on_adoption_durable(&situation, written, &adoption, timers)
            }
            Promise::Take(written, cells) => {
                let (situation, cooperation, _) = self.situation();
                cooperation.on_take_durable(&situation, written, &cells)
            }
            Promise::Covered(_) => Effects::new(),
        };
        self.carry_out(effects);
    }

    fn on_computed(&mut self, token: u64, result: JobResult) {
        let effects = match (self.jobs.remove(&token), result) {
            (Some(PendingJob::Geometry(hash)), JobResult::Geometry(geometry)) => {
                let me = self.me();
                let effects = self.cooperation.geometry_arrived(
                    hash,
                    geometry,
                    me,
                    &self.config,
                    &self.durable,
                    &mut self.timers,
                );
                // The way home may be another one.
                self.cooperation
                    .keep_within_endurance(self.percept.as_ref());
                effects
            }
            (Some(PendingJob::Division(epoch)), JobResult::Divide(division)) => {
                let (situation, cooperation, _) = self.situation();
                cooperation.divided(&situation, epoch, &division)
            }
            (Some(PendingJob::Errand(id, revision, _)), JobResult::Errand(planned)) => {
                let task = (id, revision);
                let percept = self.percept.as_ref();
                self.cooperation.errand_planned(task, planned, percept)
            }
            _ => Effects::new(),
        };
        self.carry_out(effects);
    }

    fn on_command(&mut self, command: Command) {
        if self.config.role != Role::GroundStation {
            return self
                .alarm("a command reached a peer that is no ground station; it was ignored");
        }
        match command {
            Command::Mission(mission) => {
                let held = self.cooperation.newest_mission();
                if held.is_some_and(|m| m.revision >= mission.revision && *m != *mission) {
                    return self
                        .alarm("a mission is no newer than the one that is held; it was ignored");
                }
                self.cooperation.offer(Arc::clone(&mission));
                self.report(Report::Revised { mission });
                if self.speaks() {
                    let effects = self.with_sources(|o, s, _, _| o.speak_mission(s));
                    self.carry_out(effects);
                }
            }
            Command::Orders(orders) => self.give_orders(orders),
            Command::Task(edit) => self.edit_task(&edit),
        }
    }

    /// The operator asks for a task, changes one or wants it no more.
    fn edit_task(&mut self, edit: &TaskEdit) {
        let mission = self.cooperation.newest_mission();
        match self.cooperation.edit_task(self.now, edit, mission.as_ref()) {
            Ok(effects) => self.carry_out(effects),
            Err(why) => self.alarm(&format!("a task is not asked for: {why}")),
        }
    }

    /// Whether the operator's words on tasks can be carried out.
    ///
    /// # Errors
    /// A sentence that says why not.
    pub fn check_task(&self, edit: &TaskEdit) -> Result<(), String> {
        let mission = self.mission();
        self.cooperation.check_task(edit, mission.as_ref())
    }

    /// The tasks of this ground station's operator with their numbers, and how long ago each
    /// was asked for, milliseconds, and what it said to be done: what is to be said again in
    /// another life.
    #[must_use]
    pub fn operators_tasks(&self) -> OperatorsTasks {
        self.cooperation.tasking.asked(self.now)
    }

    /// What services on the ground are wanted for: objects that are to be followed, as far as it
    /// knows.
    #[must_use]
    pub fn calls(&self) -> Vec<Call> {
        self.cooperation.tasking.calls(self.now)
    }

    /// A number that changes with what its operator said of tasks; 0 where that is nothing.
    #[must_use]
    pub fn tasks_version(&self) -> u64 {
        self.cooperation.tasking.asked_version()
    }

    /// All tasks that it knows, for a person.
    #[must_use]
    pub fn tasks(&self) -> Vec<TaskView> {
        self.cooperation.tasking.views(self.now)
    }

    fn give_orders(&mut self, orders: Orders) {
        self.carry_out(vec![Effect::Speak(0, Body::Operator(orders.clone()))]);
        let me = self.me();
        let version = (me.incarnation, self.outbound.seq(), me.id);
        self.cooperation.give_orders(orders, version);
    }

    // --- Effects.

    /// Carries out effects in order, each with what follows from it before the next.
    fn carry_out(&mut self, effects: Effects) {
        for effect in effects {
            self.carry_out_one(effect);
        }
    }

    fn carry_out_one(&mut self, effect: Effect) {
        match effect {
            Effect::Speak(subject, body) => self.speak(subject, &body),
            Effect::Store(promise, entry) => self.store(promise, entry),
            Effect::Compute(pending, job) => self.compute(pending, job),
            Effect::Fly(setpoint) => self.outputs.push_back(Output::Setpoint(setpoint)),
            Effect::Report(report) => self.report(report),
            Effect::Alarm(text) => self.alarm(&text),
            Effect::Live(incarnation) => {
                assert_eq!(incarnation, self.life.incarnation());
                self.relay.new_life();
                self.outbound.new_life(&mut self.timers);
                let me = self.me();
                self.cooperation.void_ownership(me, &mut self.timers);
            }
            Effect::Silent => {
                let me = self.me();
                self.cooperation.void_ownership(me, &mut self.timers);
                self.negotiate();
            }
            Effect::Negotiate => self.negotiate(),
            Effect::ClaimChanged => self.outbound.claim_changed(&mut self.timers),
            Effect::ClaimNow => {
                if self.speaks() {
                    let effects = self.with_sources(Outbound::speak_claim);
                    self.carry_out(effects);
                }
            }
            Effect::SayNow(body) => self.say_now(&body),
            Effect::PassOn(record) => self.pass_on(&record),
            Effect::CoverageChanged => self.outbound.coverage_changed(&mut self.timers),
            Effect::CoverageHeard(loop_hash, cells) => {
                if self.relay.air.is_crowded() {
                    self.outbound.coverage_heard(loop_hash, &cells);
                }
            }
            Effect::CoverageWanted => self.outbound.coverage_wanted(&mut self.timers),
            Effect::MissionFinished => self.timers.set(Timer::Finished, self.now),
            Effect::Offer(mission) => self.cooperation.offer(mission),
            Effect::HearAgain => self.hear_again(),
        }
    }

    /// Whether it stood still and has not been told where it is since.
    fn is_lost(&self) -> bool {
        self.lost_until.is_some_and(|until| self.now < until)
    }

    /// Looks at what is to be settled with others, once it knows where it is.
    fn negotiate(&mut self) {
        if self.is_lost() {
            return;
        }
        let (situation, cooperation, timers) = self.situation();
        let effects = cooperation.tick(&situation, timers);
        self.carry_out(effects);
    }

    /// After the geometry changed, claims and bids heard before it are looked at again.
    fn hear_again(&mut self) {
        for record in self.relay.records() {
            let Some(kind) = Kind::of_number(record.kind) else {
                continue;
            };
            if matches!(kind, Kind::Claim | Kind::Bid)
                && record.author != self.config.id.0
                && let Ok(body) = codec::decode_body(kind, &record.body)
            {
                let effects = self.cooperation.hear(self.now, (&record, 0), &body);
                self.carry_out(effects);
            }
        }
        self.carry_out_one(Effect::ClaimNow);
    }

    /// Writes a record of this peer's own and hands it to the relay.
    fn speak(&mut self, subject: u16, body: &Body) {
        if !self.speaks() {
            return;
        }
        let me = self.me();
        if let Body::Bid(bid) = body {
            self.diary.note_bid(self.now, me.id, bid);
        }
        let record = self.outbound.record(me.id, me.incarnation, subject, body);
        let bytes = codec::encode_record(&record);
        self.relay.own(self.now, &record, bytes);
    }

    /// "I am here": a beacon when one is due, else a heartbeat.
    fn beacon(&mut self) {
        let full = !self.timers.is_running(Timer::FullBeacon, self.now);
        let entries = full.then(|| {
            let plan = self.relay.air.plan_beacon(self.now);
            self.membership.announce(plan.interval);
            self.outbound.announce(self.relay.air.interval_ms());
            plan.entries
        });
        self.outbound
            .beacon_due(self.now, full, &mut self.timers, &mut self.rng);
        if !self.speaks() {
            return;
        }
        let (interval, sharers) = (self.relay.air.interval(), self.relay.air.counted());
        let body = if let Some(entries) = entries {
            let behind = self.relay.take_behind();
            let (mut gossip, fresh) = self.membership.tell(self.now, entries, &behind);
            let heartbeat = self.outbound.heartbeat().saturating_add(1);
            for g in &mut gossip {
                (g.max_seq, g.digest) = self.relay.version(g.id, g.incarnation, heartbeat);
            }
            Body::Beacon(Beacon {
                heartbeat,
                nonce: self.life.nonce(),
                eccentricity: self.membership.eccentricity(self.now),
                interval,
                sharers,
                gossip,
                fresh,
                ..self.with_sources(|_, s, _, _| outbound::beacon_of(s))
            })
        } else {
            // An answer to a suspicion is as short as can be.
            let answers = self.timers.is_running(Timer::Refutation, self.now);
            let fresh = (!answers).then(|| self.membership.tell_between(self.now));
            Body::Heartbeat(Heartbeat {
                interval,
                sharers,
                fresh: fresh.unwrap_or_default(),
                ..self.with_sources(|_, s, _, _| outbound::heartbeat_of(s))
            })
        };
        let answers = !full && self.timers.is_running(Timer::Refutation, self.now);
        self.publish_beat(&body, answers);
        if let Body::Beacon(beacon) = &body {
            self.tell_lacking(beacon.revision);
        }
    }

    /// Says what is asked for and answered at once, with a heartbeat.
    fn say_at_once(&mut self) {
        if !self.speaks() {
            return;
        }
        if !self.relay.may_answer(self.now) {
            let later = self.now.plus_ms(self.relay.air.interval_ms() / 8);
            self.timers.set(Timer::Question, later);
            return;
        }
        let fresh = self.membership.tell_at_once(self.now, AT_ONCE_MAX);
        if let Some(at) = self.membership.question_at() {
            self.delay_question(at);
        }
        if fresh.is_empty() {
            return;
        }
        let body = Body::Heartbeat(Heartbeat {
            interval: self.relay.air.interval(),
            sharers: self.relay.air.counted(),
            fresh,
            ..self.with_sources(|_, s, _, _| outbound::heartbeat_of(s))
        });
        self.publish_beat(&body, true);
    }

    /// What is to be said at once is said a random time after it could be.
    fn delay_question(&mut self, from: Time) {
        let spread_ms = QUESTION_SPREAD_MS * self.relay.air.sharers().max(8);
        let delay_ms = 20 + u64::from(self.rng.next_u32()) % spread_ms;
        let at = from.max(self.now).plus_ms(delay_ms);
        self.timers.set_earlier(Timer::Question, at);
    }

    fn publish_beat(&mut self, body: &Body, answers: bool) {
        let me = self.me();
        let record = self.outbound.beat(self.now, me.id, me.incarnation, body);
        let bytes = codec::encode_record(&record);
        if answers {
            self.relay.air.charge_answer(self.now, bytes.len());
        } else {
            self.relay.air.charge(self.now, bytes.len());
        }
        self.broadcast(body.kind(), bytes);
    }

    /// Puts a record of this peer that nobody passes on, and that is paid for, on the air.
    fn broadcast(&mut self, kind: Kind, bytes: Vec<u8>) {
        self.outputs.push_back(Output::Publish {
            key: key::key(&self.config.fleet, kind, 0, self.me().id),
            bytes,
            hops: 0,
            priority: kind.priority(),
            lifetime_ms: self.relay.lifetime_ms(kind),
        });
    }

    /// With a beacon goes, in one transmission, which pieces of a newer mission are lacking; in a
    /// crowd with every second one.
    fn tell_lacking(&mut self, follows: u32) {
        self.relay.follow(self.now, follows);
        let newest = self.relay.newest(self.now);
        let told = self
            .cooperation
            .lacking(newest)
            .and_then(|(lacking, came)| {
                let holders = self.relay.holders(self.now, lacking.revision);
                let lately_ms = COLLECTING_INTERVALS * self.relay.air.interval_ms();
                let is_sought = holders > 0 || self.now.since_ms(came) < lately_ms;
                is_sought.then_some(Lacking { holders, ..lacking })
            });
        let was_told = core::mem::replace(&mut self.lacking_told, false);
        if told.is_some() && was_told && self.relay.air.is_crowded() {
            return;
        }
        self.relay.lack(self.now, told.as_ref());
        let Some(lacking) = told else {
            return;
        };
        self.lacking_told = true;
        self.say_now(&Body::Lacking(lacking));
    }

    /// Says what nobody passes on.
    fn say_now(&mut self, body: &Body) {
        if !self.speaks() {
            return;
        }
        let me = self.me();
        let record = self.outbound.record(me.id, me.incarnation, 0, body);
        let bytes = codec::encode_record(&record);
        self.relay.air.charge(self.now, bytes.len());
        self.broadcast(body.kind(), bytes);
    }

    /// Passes on, at once, what another peer said and the relay does not.
    fn pass_on(&mut self, record: &Record) {
        let kind = Kind::of_number(record.kind).filter(|_| self.speaks());
        let Some(kind) = kind else {
            return;
        };
        let bytes = codec::encode_record(record);
        self.relay.air.charge(self.now, bytes.len());
        self.outputs.push_back(Output::Publish {
            key: key::key(&self.config.fleet, kind, record.subject, record.author),
            bytes,
            hops: 1,
            priority: kind.priority(),
            lifetime_ms: self.relay.lifetime_ms(kind),
        });
    }

    /// Sends what the relay lets go.
    fn send(&mut self) {
        if !self.speaks() {
            return;
        }
        while let Some(out) = self.relay.poll(self.now) {
            self.outputs.push_back(Output::Publish {
                key: out.key,
                bytes: out.bytes,
                hops: out.hops,
                priority: out.priority,
                lifetime_ms: out.lifetime_ms,
            });
        }
    }

    /// Asks for an entry to be made durable; what it promises is broken at once where
    /// too many are under way.
    fn store(&mut self, promise: Promise, entry: Entry) {
        if self.stores.len() >= MAX_STORES {
            return self.on_broken(&promise);
        }
        let token = self.token();
        self.outputs.push_back(Output::Store {
            token,
            record: entry.encode(),
        });
        let before = self.stores.insert(token, (promise, entry));
        assert!(before.is_none(), "tokens are unique");
    }

    /// What was promised does not happen.
    fn on_broken(&mut self, promise: &Promise) {
        match promise {
            Promise::Life(incarnation) => self.life.on_broken(*incarnation),
            other => self.cooperation.on_broken(other),
        }
    }

    /// Asks for a job to be computed, unless it is under way.
    fn compute(&mut self, pending: PendingJob, job: Job) {
        if self.jobs.values().any(|p| *p == pending) {
            return;
        }
        if self.jobs.len() >= MAX_JOBS {
            self.jobs.pop_first();
        }
        let token = self.token();
        self.outputs.push_back(Output::Compute { token, job });
        let before = self.jobs.insert(token, pending);
        assert!(before.is_none(), "tokens are unique");
    }

    fn token(&mut self) -> u64 {
        self.last_token += 1;
        self.last_token
    }

    /// Reports what changed in the beliefs about others.
    fn report_changes(&mut self, changes: Vec<Change>) {
        if self.membership.take_refuted() && self.speaks() && self.relay.may_hasten(self.now) {
            self.outbound
                .hasten(self.now, &mut self.timers, &mut self.rng);
        }
        if self.membership.take_question()
            && let Some(at) = self.membership.question_at()
        {
            self.delay_question(at);
        }
        for c in changes {
            let (by, at_ms) = (self.config.id.0, self.now.0);
            if c.status == Status::Down {
                tracing::info!(peer = by, at_ms, down = c.peer, "believed down");
            }
            self.report(Report::Membership {
                peer: PeerId(c.peer),
                incarnation: c.incarnation,
                status: c.status,
            });
        }
    }

    fn refuse(&mut self, reason: String) {
        self.report(Report::Refused { reason });
    }

    fn report(&mut self, report: Report) {
        self.diary.note(self.now, &report);
        self.outputs.push_back(Output::Report(report));
    }

    fn alarm(&mut self, text: &str) {
        tracing::warn!(peer = self.config.id.0, at_ms = self.now.0, "{text}");
        self.report(Report::Alarm {
            text: text.to_owned(),
        });
    }

    // --- What it knows.

    fn period_ms(&self) -> u64 {
        u64::from(self.config.beacon_period_ms.max(1))
    }

    fn me(&self) -> Member {
        Member {
            id: self.config.id.0,
            incarnation: self.life.incarnation(),
        }
    }

    fn speaks(&self) -> bool {
        self.life.speaks(self.now, &self.timers)
    }

    /// What the cooperation manager is told, and itself.
    fn situation(&mut self) -> (Situation<'_>, &mut Cooperation, &mut Timers) {
        let situation = Situation {
            now: self.now,
            period_ms: self.period_ms(),
            me: self.me(),
            role: self.config.role,
            speaks: self.life.speaks(self.now, &self.timers),
            is_silent: self.life.is_silent(),
            percept: self.percept.as_ref(),
            membership: &self.membership,
        };
        (situation, &mut self.cooperation, &mut self.timers)
    }

    /// Lets the outbound part look at what there is to say.
    fn with_sources<T>(
        &mut self,
        ask: impl FnOnce(&mut Outbound, &Sources<'_>, &mut Timers, &mut ChaCha8Rng) -> T,
    ) -> T {
        let sources = Sources {
            now: self.now,
            config: &self.config,
            mission_state: self.cooperation.state(),
            mission: self.cooperation.newest_mission(),
            percept: self.percept.as_ref(),
            cover_waits: self.relay.waits(Kind::Cover),
        };
        ask(
            &mut self.outbound,
            &sources,
            &mut self.timers,
            &mut self.rng,
        )
    }

    /// The newest mission that it holds.
    #[must_use]
    pub fn mission(&self) -> Option<Arc<Mission>> {
        self.cooperation.newest_mission()
    }

    /// The revision that the operator's next mission must have to be flown: above those
    /// of all missions that this peer holds, or has heard that others follow
    /// ([`Mission::revision_after`]).
    #[must_use]
    pub fn next_revision(&self) -> u32 {
        let held = self.cooperation.newest_mission();
        let heard = self
            .membership
            .all()
            .filter_map(|(id, ..)| self.membership.info(id))
            .map(|info| info.revision);
        let revisions = held.iter().map(|m| m.revision).chain(heard);
        let newest = revisions.max().unwrap_or(0);
        held.map_or(newest.saturating_add(1), |m| m.revision_after(newest))
    }

    /// Whether it is a ground station, at which an operator may speak.
    #[must_use]
    pub fn is_ground_station(&self) -> bool {
        self.config.role == Role::GroundStation
    }

    /// Whether its journal holds the life that it is in: before that it says nothing.
    #[must_use]
    pub fn has_life(&self) -> bool {
        self.life.incarnation() > 0
    }

    /// The life that it is in, whether it speaks already or not: what it counts itself is of that
    /// life. None before its journal holds it.
    #[must_use]
    pub fn lives_in(&self) -> Option<Incarnation> {
        self.has_life().then_some(self.life.incarnation())
    }

    /// The life in which it speaks at present; none while it only listens.
    #[must_use]
    pub fn speaks_in(&self) -> Option<Incarnation> {
        self.speaks().then_some(self.life.incarnation())
    }

    /// What the operator ordered last, as far as it was heard.
    #[must_use]
    pub fn orders(&self) -> &Orders {
        self.cooperation.orders()
    }

    /// Whether it has heard of a UAV with this number.
    #[must_use]
    pub fn knows_uav(&self, id: u16) -> bool {
        let info = self.membership.info(id);
        info.is_some_and(|info| !info.ground_station)
    }

    /// A copy of what it believes.
    #[must_use]
    pub fn beliefs(&self) -> Beliefs {
        let mut beliefs = Beliefs {
            incarnation: self.life.incarnation(),
            speaks: self.speaks(),
            is_silent: self.life.is_silent(),
            diameter: self.membership.diameter(self.now),
            interval_ms: self.relay.air.interval_ms(),
            order: self.cooperation.order(),
            orders: self.cooperation.orders().clone(),
            wind_mps: self.percept.and_then(|p| {
                let flies = p.takes_off_in_ms == 0;
                flies.then_some((p.wind_east_mps, p.wind_north_mps))
            }),
            ..Beliefs::default()
        };
        let others = self.membership.all();
        beliefs.peers = others
            .map(|(id, life, s)| (PeerId(id), (life, s)))
            .collect();
        beliefs.loads = vec![
            ("stores", self.stores.len(), MAX_STORES),
            ("jobs", self.jobs.len(), MAX_JOBS),
        ];
        beliefs.loads.extend(self.membership.loads());
        beliefs.loads.extend(self.relay.loads());
        let counter = self.durable.counter;
        self.cooperation
            .fill(&mut beliefs, counter, self.percept.as_ref());
        beliefs
    }

    /// What it plans to have in its picture; none of who flies nothing.
    #[must_use]
    pub fn footprint(&self) -> Option<Footprint> {
        let executive = self.cooperation.state()?.executive.as_ref()?;
        Some(Footprint::of(executive))
    }

    /// When it sensed last, milliseconds.
    pub(crate) fn sensed_ms(&self) -> Option<u64> {
        self.percept.as_ref().map(|p| p.time_ms)
    }

    /// Whom it says that it follows, once it had seen it.
    pub(crate) fn follows(&self) -> Option<Follows> {
        self.cooperation.tasking.follows()
    }

    /// The mission that it follows.
    pub(crate) fn followed(&self) -> Option<&Mission> {
        Some(&self.cooperation.state()?.geometry.mission)
    }

    /// What this UAV counted itself at each site of its mission, and whether it does so by its last
    /// percept.
    pub fn counted(&self) -> impl Iterator<Item = (bool, Count)> {
        let percept_ms = self.percept.as_ref().map_or(0, |p| p.time_ms);
        self.cooperation.tasking.counted(percept_ms)
    }

    /// The places of its mission's streets that this UAV watches by its last percept, by their
    /// numbers; none without streets.
    #[must_use]
    pub fn watched_streets(&self) -> Option<&BTreeSet<usize>> {
        let percept_ms = self.percept.as_ref().map_or(0, |p| p.time_ms);
        self.cooperation.tasking.watched(percept_ms)
    }

    /// What this UAV saw itself of how streets are used, in this life.
    #[must_use]
    pub fn own_usages(&self) -> Option<Usages> {
        self.cooperation.tasking.own_usages()
    }

    /// What is known of how the streets of its mission are used, by all together.
    #[must_use]
    pub fn usages(&self) -> Option<Usages> {
        let mission = &self.cooperation.state()?.geometry.mission;
        self.cooperation.tasking.usages(mission)
    }

    /// The quickest ways that its mission asks for, by what is known now, and from its station to
    /// all that was detected. Another way is [`Usages::hint`]'s.
    #[must_use]
    pub fn hints(&self) -> Vec<Hint> {
        let state = self.cooperation.state();
        let mission = state.map(|s| &s.geometry.mission);
        mission.map_or_else(Vec::new, |m| self.cooperation.tasking.hints(m))
    }

    /// The quickest way along the streets of its mission from a place to a place, mm, by what
    /// is known now.
    ///
    /// # Errors
    /// When no mission is held, it brings no streets, or these do not lead there.
    pub fn way(&self, from: PointMm, to: PointMm) -> Result<WayHint, NoWay> {
        self.cooperation.state().ok_or(NoWay::Mission)?;
        let usages = self.usages().ok_or(NoWay::Streets)?;
        usages.way(point_m(from), point_m(to))
    }

    /// What all together saw of the event that its mission watches, as far as is known here; none
    /// without one.
    #[must_use]
    pub fn crowd(&self) -> Option<Crowd> {
        let mission = &self.cooperation.state()?.geometry.mission;
        self.cooperation.tasking.crowd(mission)
    }

    /// What this UAV saw of it itself in this life, told or not, by sector.
    pub fn own_crowd(&self) -> impl Iterator<Item = (u16, Sector)> {
        self.cooperation.tasking.own_crowd()
    }

    /// What is known of the sites of its mission, of its streets and its event, for a person.
    fn counts_told(&self) -> Vec<String> {
        let Some(state) = self.cooperation.state() else {
            return Vec::new();
        };
        let mission = &state.geometry.mission;
        let counts = self.cooperation.tasking.counts(mission);
        let of = mission.counts.iter().zip(counts);
        let mut told: Vec<String> = of.map(|(site, count)| count.sentence(site)).collect();
        let hints = self.hints();
        told.extend(hints.iter().map(Hint::sentence));
        told.extend(self.usages().iter().flat_map(Usages::sentences));
        told.extend(self.crowd().iter().flat_map(Crowd::sentences));
        told
    }

    /// What it does and why, for a person.
    #[must_use]
    pub fn why(&self) -> Why {
        let state = self.cooperation.state();
        let reserve_s = self.config.airframe.map_or(0.0, |a| a.reserve_s);
        let percept = self.percept.as_ref();
        Why {
            id: self.config.id.0,
            incarnation: self.life.incarnation(),
            time_ms: self.now.0,
            ground_station: self.config.role == Role::GroundStation,
            speaks: self.speaks(),
            order: self.cooperation.order(),
            orders: self.cooperation.orders().clone(),
            flight: percept.map(|p| why::flight(state, p, reserve_s)),
            work: state.map(|s| why::work(s, self.now)),
            round: self.diary.round(self.now),
            tasks: self.tasks(),
            detections: self.cooperation.tasking.detections_told(),
            contour: self.cooperation.trails.sentence(),
            counts: self.counts_told(),
            others: self.others(),
            events: self.diary.events(self.now),
        }
    }

    /// What it knows of the newest mission that it holds, for a person; none without one.
    #[must_use]
    pub fn overview(&self) -> Option<Overview> {
        let mission = self.mission()?;
        let work = self.cooperation.state().map(|s| why::work(s, self.now));
        let others = (self.tasks(), self.others());
        let orders = self.cooperation.orders();
        Some(Overview::of(&mission, orders, work, others))
    }

    fn others(&self) -> Vec<Other> {
        let state = self.cooperation.state();
        let of = |(id, incarnation, status): (u16, Incarnation, Status)| {
            let info = self.membership.info(id).unwrap_or_default();
            Other {
                id,
                incarnation,
                status,
                since_ms: self.diary.since_ms(self.now, id),
                heard_ms_ago: info.heard.map(|at| self.now.since_ms(at)),
                revision: info.revision,
                open_cells: state.map_or(0, |s| s.negotiation.sections.n_left(id)),
            }
        };
        self.membership.all().map(of).collect()
    }

    /// Predicted end of its plan, milliseconds from now; 0 without a plan.
    #[must_use]
    pub fn eta_ms(&self) -> u32 {
        let state = self.cooperation.state();
        state.map_or(0, crate::mission_state::MissionState::eta_ms)
    }

    /// Divisions adopted in this life.
    #[must_use]
    pub fn adoptions(&self) -> u32 {
        let state = self.cooperation.state();
        state.map_or(0, |s| s.negotiation.adoptions)
    }

    /// What it believes to be durable: a judge compares it with what replaying the
    /// journal gives.
    #[must_use]
    pub fn durable(&self) -> Durable {
        self.durable.clone()
    }
}
