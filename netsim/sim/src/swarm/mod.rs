//! A swarm in virtual time: N peers, one world, one radio, one seed, one clock.
//!
//! The order within a millisecond is fixed: act → radio → answer → sense → decide →
//! judge (see `queue::Phase`). One run is single-threaded and owes everything to its seed, its
//! scenario and its faults: the same three give the same history, event for event.
//!
//! | module | what it holds |
//! |---|---|
//! | `queue` | the event queue |
//! | `stream` | independent random streams |
//! | `operator` | the mission and the order given last |
//! | `judged_loop` | the loop on which cells are counted |
//! | `looks` | what is followed and looked for, beside where vehicles are |
//! | `traffic` | what the radios were given and brought |
//! | `observed` | what an observer may look at |
//! | `names` | whom peers mean by an id that two processes have |
//! | `sim_peer` | one peer: process, clock, disk, inbox |
//! | `air` | the world and the medium as the driver uses them |
//! | `fault_effects` | what each fault does |
//! | [`outcome`] | what a run came to |
//! | [`meter`] | how long its parts take |
//! | [`latency`] | how long a peer takes to answer one input |

mod air;
mod crowd;
mod fault_effects;
mod found;
mod judged_loop;
pub mod latency;
mod looks;
pub mod meter;
mod names;
mod observed;
mod operator;
pub mod outcome;
mod queue;
mod sim_peer;
pub(crate) mod stream;
mod streets;
mod traffic;

pub use outcome::Outcome;

#[cfg(test)]
mod tests;

use crate::account::{Account, Cause};
use crate::check::layers::is_judged;
use crate::check::record::Said;
use crate::check::{Checker, PeerSnapshot};
use crate::fault::TimedFault;
use crate::geometry_cache::GeometryCache;
use crate::history::{History, Kind, What, bytes_hash, pose_hash, report_hash, setpoint_hash};
use crate::prepared::Prepared;
use crate::radio::{Delivery, Frame};
use crate::spec::Spec;
use crate::witnessed::AskedLook;
use crate::world::{Approach, Fact, Loss, percept_phase_ms};
use air::Air;
use judged_loop::JudgedLoop;
use meter::{Meter, Part};
use names::Names;
use operator::Operator;
use queue::{Phase, Queue};
use sim_peer::{Process, SimPeer};
use skein_behaviors::Order;
use skein_geometry::frame::{Point, Pose};
use skein_link::medium::key_hash;
use skein_peer::input::TaskEdit;
use skein_peer::journal::Entry;
use skein_peer::offload::{Job, JobResult};
use skein_peer::output::TaskNews;
use skein_peer::wire;
use skein_peer::{Beliefs, Command, Input, Output, Peer, Report, Role, Transmission, Why};
use std::collections::BTreeMap;
use std::sync::Arc;
use stream::{Concern, Stream};
use traffic::Traffic;

/// How long a division is modelled to take, milliseconds: ten times what a desktop
/// needs for the largest ring, about what a flight computer does.
const DIVIDE_MS: u64 = 50;
/// How long deriving the loop is modelled to take, milliseconds.
const GEOMETRY_MS: u64 = 200;

/// The longest time in which those who are finished may fly home, milliseconds: longer
/// than the endurance that any of them has left.
const LONGEST_WAY_HOME_MS: u64 = 1_200_000;

/// A task that nobody has seen yet keeps a run going for so many beacon periods, though all
/// believe that everything is done: they may not have heard of it.
const FRESH_TASK_PERIODS: u64 = 30;

/// Something to come.
#[derive(Debug)]
enum Event {
    Boot(usize),
    Fault(usize),
    Percept {
        idx: usize,
        boot: u32,
    },
    Timer {
        idx: usize,
        boot: u32,
        due_ms: u64,
    },
    Stored {
        idx: usize,
        boot: u32,
    },
    Planned {
        idx: usize,
        boot: u32,
        token: u64,
        answer: JobResult,
    },
    Receive(Vec<Delivery>),
    /// A slow computer gets round to what has arrived.
    CatchUp {
        idx: usize,
        boot: u32,
    },
    Judge,
}

/// What all receivers of one transmission share: it is hashed, read and looked up once.
struct Shared {
    hash: u64,
    heard: Arc<Transmission>,
    said: Option<Arc<Said>>,
}

/// A run under way.
#[derive(Debug)]
pub struct Swarm {
    spec: Arc<Spec>,
    now_ms: u64,
    end_ms: u64,
    queue: Queue<Event>,
    peers: Vec<SimPeer>,
    names: Names,
    air: Air,
    geometry_cache: GeometryCache,
    operator: Operator,
    judged: JudgedLoop,
    faults: Vec<TimedFault>,
    history: History,
    checker: Checker,
    account: Account,
    /// Records spoken so far, by hash of their bytes.
    spoken: BTreeMap<u64, Arc<Said>>,
    done: bool,
    /// All is over but the way home of those who are finished.
    homing: bool,
    /// When UAVs were asked last what they saw of streets, milliseconds.
    streets_at_ms: u64,
    unassigned: bool,
    traffic: Traffic,
    /// The bytes that a peer said last, for an outsider to spoil.
    last_said: Vec<u8>,
    outsider: Stream,
    /// A spoilt record is with a peer that has not refused it yet.
    spoilt: bool,
    /// Which group of the last partition each peer was in.
    sides: BTreeMap<u16, usize>,
    loss_max_permille: u16,
    /// Cells that were seen and the ground station did not know of, once a period.
    ground_lacks: Vec<Option<u16>>,
    meter: Meter,
}

impl Swarm {
    /// A swarm before its first event. `keep` keeps the main events for a timeline.
    #[must_use]
    pub fn new(prepared: &Prepared, seed: u64, faults: Vec<TimedFault>, keep: bool) -> Self {
        let prepared = &prepared.with_twins(&faults);
        let spec = &prepared.spec;
        let mut geometry_cache = prepared.geometry_cache.clone();
        let judged = JudgedLoop::new(&spec.mission, &mut geometry_cache);
        let mut swarm = Self {
            spec: Arc::clone(spec),
            now_ms: 0,
            end_ms: u64::from(spec.max_time_s) * 1000,
            queue: Queue::default(),
            peers: sim_peer::of_scenario(spec, seed),
            names: Names::new(spec.twins()),
            air: Air::new(prepared, seed),
            geometry_cache,
            operator: Operator::new(Arc::clone(&spec.mission)),
            judged,
            faults,
            history: History::new(keep),
            checker: Checker::new(seed, spec),
            account: Account::new(prepared.setting(seed)),
            spoken: BTreeMap::new(),
            done: false,
            homing: false,
            streets_at_ms: 0,
            unassigned: false,
            traffic: Traffic::default(),
            last_said: Vec::new(),
            outsider: Stream::new(seed, Concern::Outsider),
            spoilt: false,
            sides: BTreeMap::new(),
            loss_max_permille: spec.radio.loss_permille,
            ground_lacks: Vec::new(),
            meter: Meter::default(),
        };
        for (i, f) in swarm.faults.iter().enumerate() {
            swarm.queue.push(f.at_ms, Phase::Act, Event::Fault(i));
        }
        let latest_ms = swarm.period_ms() / 2;
        for idx in 0..swarm.peers.len() {
            if swarm.peers[idx].is_twin() {
                let own = swarm.airframe_of(swarm.peers[idx].id()) == swarm.peers[idx].id();
                swarm.air.stop(swarm.peers[idx].id(), own);
                continue;
            }
            let first_ms = swarm.peers[idx].first_boot_ms(latest_ms);
            swarm.queue.push(first_ms, Phase::Act, Event::Boot(idx));
        }
        swarm
            .queue
            .push(swarm.period_ms(), Phase::Judge, Event::Judge);
        swarm
    }

    /// Measures what its parts take from now on.
    #[must_use]
    pub fn measured(mut self, meter: Meter) -> Self {
        self.meter = meter;
        self
    }

    /// What its parts took so far.
    #[must_use]
    pub fn meter(&self) -> &Meter {
        &self.meter
    }

    /// Does something on behalf of a part.
    fn metered<T>(&mut self, part: Part, work: impl FnOnce(&mut Self) -> T) -> T {
        let before = self.meter.enter(part);
        let done = work(self);
        self.meter.enter(before);
        done
    }

    /// Runs to the end: mission complete and every live UAV finished, or out of time.
    #[must_use]
    pub fn run(mut self) -> Outcome {
        while self.step() {}
        let outcome = self.outcome();
        self.fly_home(outcome)
    }

    /// Runs until some scenario time, or the end; returns whether it goes on.
    pub fn run_until(&mut self, until_ms: u64) -> bool {
        while self.queue.next().is_some_and(|(t, _)| t <= until_ms) {
            if !self.step() {
                return false;
            }
        }
        true
    }

    /// Handles the next event; false when the run is over.
    pub fn step(&mut self) -> bool {
        let radio_ms = self.air.next_ms();
        let queued = self.queue.next();
        let radio_first = match (radio_ms, queued) {
            (Some(r), Some(q)) => (r, Phase::Radio) <= q,
            (Some(_), None) => true,
            _ => false,
        };
        let next_ms = if radio_first {
            radio_ms
        } else {
            queued.map(|q| q.0)
        };
        let Some(next_ms) = next_ms.filter(|t| *t < self.end_ms && !self.done) else {
            return false;
        };
        self.now_ms = self.now_ms.max(next_ms);
        if radio_first {
            self.carry();
        } else if let Some((_, event)) = self.queue.pop() {
            self.happen(event);
        }
        true
    }

    /// Scenario time, milliseconds.
    #[must_use]
    pub fn now_ms(&self) -> u64 {
        self.now_ms
    }

    /// What a running peer believes.
    #[must_use]
    pub fn view(&self, id: u16) -> Option<Beliefs> {
        let sim_peer = &self.peers[self.peer_idx(id)?];
        sim_peer.peer.as_deref().map(skein_peer::Peer::beliefs)
    }

    /// What a running peer does and why.
    #[must_use]
    pub fn why(&self, id: u16) -> Option<Why> {
        let sim_peer = &self.peers[self.peer_idx(id)?];
        sim_peer.peer.as_deref().map(skein_peer::Peer::why)
    }

    /// What a running peer believes.
    #[must_use]
    pub fn beliefs(&self, id: u16) -> Option<Beliefs> {
        let sim_peer = &self.peers[self.peer_idx(id)?];
        sim_peer.peer.as_deref().map(skein_peer::Peer::beliefs)
    }

    /// Where the vehicles are.
    pub fn vehicles(&self) -> impl Iterator<Item = Point> + '_ {
        self.air.vehicles().places()
    }

    /// Where a UAV is; nothing once its airframe is gone.
    #[must_use]
    pub fn pose(&self, id: u16) -> Option<Pose> {
        self.air.own(id).map(|p| p.pose)
    }

    /// The share of the coverable cells that was seen, 0 to 1.
    #[must_use]
    pub fn covered_share(&self) -> f64 {
        self.air.judge().covered_share()
    }

    /// The checks so far.
    #[must_use]
    pub fn checker(&self) -> &Checker {
        &self.checker
    }

    /// The account so far.
    #[must_use]
    pub fn account(&self) -> &Account {
        &self.account
    }

    /// The history so far.
    #[must_use]
    pub fn history(&self) -> &History {
        &self.history
    }

    fn period_ms(&self) -> u64 {
        u64::from(self.spec.beacon_period_ms.max(1))
    }

    /// In whose airframe a peer is.
    fn airframe_of(&self, id: u16) -> u16 {
        self.names.twins().airframe_of(id)
    }

    fn peer_idx(&self, id: u16) -> Option<usize> {
        self.peers.binary_search_by_key(&id, SimPeer::id).ok()
    }

    fn happen(&mut self, event: Event) {
        match event {
            Event::Fault(i) => {
                let fault = self.faults[i].fault.clone();
                self.strike(&fault);
            }
            // A fault may have started it before.
            Event::Boot(idx) => {
                if self.peers[idx].boots == 0 {
                    self.boot(idx, false, false);
                }
            }
            Event::Percept { idx, boot } => self.sense(idx, boot),
            Event::Timer { idx, boot, due_ms } => self.timer(idx, boot, due_ms),
            Event::Stored { idx, boot } => {
                if self.peers[idx].boots == boot
                    && let Some((token, ok)) = self.peers[idx].disk.sync()
                {
                    self.fold(idx, Kind::Stored, token);
                    self.peers[idx].on_stored(ok);
                    self.feed(idx, Input::Stored { token, ok });
                }
            }
            Event::Planned {
                idx,
                boot,
                token,
                answer,
            } => {
                if self.peers[idx].boots == boot {
                    self.peers[idx].plan = None;
                    self.fold(idx, Kind::Planned, token);
                    self.feed(
                        idx,
                        Input::Computed {
                            token,
                            result: answer,
                        },
                    );
                }
            }
            Event::Receive(deliveries) => self.receive(deliveries),
            Event::CatchUp { idx, boot } => {
                if self.peers[idx].boots == boot && self.peers[idx].process == Process::Running {
                    self.catch_up(idx);
                }
            }
            Event::Judge => self.metered(Part::Checks, Self::judge),
        }
    }

    fn fold(&mut self, idx: usize, kind: Kind, content: u64) {
        self.history
            .fold(self.now_ms, self.peers[idx].id(), kind, content);
    }

    fn first_percept_ms(&self, idx: usize) -> u64 {
        let period_ms = u64::from(self.spec.percept_period_ms.max(1));
        let phase_ms = percept_phase_ms(idx, self.peers.len(), self.spec.percept_period_ms);
        let past = (self.now_ms + period_ms).saturating_sub(phase_ms) / period_ms;
        past * period_ms + phase_ms
    }

    fn sense(&mut self, idx: usize, boot: u32) {
        let s = &self.peers[idx];
        if s.boots != boot || s.process == Process::Stopped || !s.airframe {
            return;
        }
        let id = s.id();
        self.advance_world();
        let Some(percept) = self.air.percept(id) else {
            self.airframe_lost(idx);
            return;
        };
        self.history
            .fold(self.now_ms, id, Kind::Percept, pose_hash(&percept.pose));
        let again_ms = self.now_ms + u64::from(self.spec.percept_period_ms.max(1));
        self.queue
            .push(again_ms, Phase::Sense, Event::Percept { idx, boot });
        self.feed(idx, Input::Percept(percept));
        self.note_counts(idx);
        self.note_footprint(idx);
        self.note_streets(idx);
        self.note_crowd(idx);
    }

    fn advance_world(&mut self) {
        self.metered(Part::World, |swarm| {
            swarm.air.advance(swarm.now_ms);
            swarm.judge_world();
        });
    }

    /// Zone entries and the moment of completion, as the world's judge sees them.
    fn judge_world(&mut self) {
        for fact in self.air.facts() {
            match &fact {
                Fact::Lost {
                    uav,
                    cause: Loss::Fuel,
                    place,
                    ..
                } if self.checker.rules.is_home(*uav, *place) => {
                    self.account.ended(self.now_ms, *uav, Cause::Landed);
                }
                _ => drop(self.account.happened(self.now_ms, &fact)),
            }
            self.keep_fact(&fact);
            match fact {
                Fact::ZoneEntry {
                    at_ms, uav, zone, ..
                } => self.checker.on_zone_entry(at_ms, uav, zone),
                Fact::TooClose(approach) if self.is_judged(&approach) => {
                    self.checker.on_too_close(&approach);
                }
                Fact::Intruded(intrusion) if intrusion.is_warned => {
                    self.checker.on_intrusion(&intrusion);
                }
                Fact::Collided(collision) if collision.is_free => {
                    self.checker.on_collision(&collision);
                }
                _ => {}
            }
        }
        if self.account.covered_ms().is_none() && self.air.judge().complete() {
            self.account.covered(self.now_ms);
            self.history.keep(self.now_ms, || What::Covered);
        }
    }

    fn timer(&mut self, idx: usize, boot: u32, due_ms: u64) {
        let s = &mut self.peers[idx];
        if s.boots != boot || s.timer_ms != Some(due_ms) {
            return;
        }
        s.timer_ms = None;
        if s.process != Process::Running {
            return;
        }
        let wants_ms = s
            .peer
            .as_deref()
            .and_then(skein_peer::Peer::next_timeout)
            .map(|t| s.clock.when_ms(t));
        // The peer may want it later by now: then no input is spent.
        if wants_ms.is_some_and(|w| w <= self.now_ms) {
            self.fold(idx, Kind::Timer, 0);
            self.feed(idx, Input::Timer);
        } else {
            self.schedule_timer(idx);
        }
    }

    fn schedule_timer(&mut self, idx: usize) {
        let now_ms = self.now_ms;
        let s = &mut self.peers[idx];
        let wants = s.peer.as_deref().and_then(skein_peer::Peer::next_timeout);
        let Some(wants) = wants else {
            return;
        };
        // At least a millisecond ahead: a peer that wants "now" after its timer must not stop time.
        let due_ms = s.clock.when_ms(wants).max(now_ms + 1);
        if s.timer_ms.is_none_or(|t| due_ms < t || t <= now_ms) {
            s.timer_ms = Some(due_ms);
            let boot = s.boots;
            self.queue
                .push(due_ms, Phase::Decide, Event::Timer { idx, boot, due_ms });
        }
    }

    /// The channel does what is due; what got through is received after its delay. All
    /// that ends at the same instant is one event.
    fn carry(&mut self) {
        let mut batch: Vec<Delivery> = Vec::new();
        for d in self.metered(Part::Medium, |swarm| swarm.air.carry(swarm.now_ms)) {
            if batch.first().is_some_and(|b| b.at_us != d.at_us) {
                self.receive_later(std::mem::take(&mut batch));
            }
            batch.push(d);
        }
        self.receive_later(batch);
    }

    fn receive_later(&mut self, batch: Vec<Delivery>) {
        if let Some(first) = batch.first() {
            let at_ms = first.at_us.div_ceil(1000).max(self.now_ms);
            self.queue.push(at_ms, Phase::Radio, Event::Receive(batch));
        }
    }

    fn receive(&mut self, deliveries: Vec<Delivery>) {
        let mut last: Option<(Arc<[u8]>, Shared)> = None;
        for d in deliveries {
            let Some(idx) = self.peer_idx(d.rx) else {
                continue;
            };
            if self.peers[idx].process == Process::Stopped {
                continue;
            }
            let known = last
                .take()
                .filter(|(bytes, _)| Arc::ptr_eq(bytes, &d.bytes));
            let size = d.bytes.len();
            let (_, shared) = last.insert(known.unwrap_or_else(|| {
                let shared = self.shared(&d.bytes);
                (d.bytes, shared)
            }));
            self.fold(idx, Kind::Receive, shared.hash);
            self.traffic.received(d.tx, d.rx, size, d.hops);
            let s = &self.peers[idx];
            if s.process == Process::Running && s.slow_ms == 0 {
                self.heard(self.now_ms, d.rx, shared.said.as_deref());
            }
            let heard = Arc::clone(&shared.heard);
            self.feed(
                idx,
                Input::Received {
                    transmitter: d.tx,
                    hops: d.hops,
                    heard,
                },
            );
        }
    }

    fn shared(&self, bytes: &[u8]) -> Shared {
        let hash = bytes_hash(bytes);
        Shared {
            hash,
            heard: Arc::new(Transmission::read(bytes.to_vec())),
            said: self.spoken.get(&hash).map(Arc::clone),
        }
    }

    /// A running peer is given a record, which arrived then.
    fn heard(&mut self, arrived_ms: u64, id: u16, said: Option<&Said>) {
        let before = self.meter.enter(Part::Checks);
        if let Some(said) = said {
            self.checker
                .on_received((self.now_ms, arrived_ms), id, said);
        }
        self.meter.enter(before);
    }

    /// A peer gets round to an input that arrived then.
    fn hear_late(&mut self, idx: usize, arrived_ms: u64, input: &Input) {
        if let Input::Received { heard, .. } = input {
            let shared = self.shared(heard.bytes());
            self.heard(arrived_ms, self.peers[idx].id(), shared.said.as_deref());
        }
    }

    /// Gives one input to a peer, now or when its process gets round to it.
    fn feed(&mut self, idx: usize, input: Input) {
        self.feed_arrived(idx, self.now_ms, input);
    }

    /// The same of an input that arrived then.
    fn feed_arrived(&mut self, idx: usize, arrived_ms: u64, input: Input) {
        let s = &mut self.peers[idx];
        match s.process {
            Process::Stopped => {}
            Process::Paused => s.wait(arrived_ms, input),
            Process::Running if s.slow_ms > 0 => {
                if s.inbox.is_empty() {
                    let (boot, at_ms) = (s.boots, self.now_ms + s.slow_ms);
                    self.queue
                        .push(at_ms, Phase::Decide, Event::CatchUp { idx, boot });
                }
                self.peers[idx].wait(arrived_ms, input);
            }
            Process::Running => self.handle(idx, input),
        }
    }

    /// What has waited is handled at once, in order.
    fn catch_up(&mut self, idx: usize) {
        let waiting: Vec<(u64, Input)> = self.peers[idx].inbox.drain(..).collect();
        for (arrived_ms, input) in waiting {
            self.hear_late(idx, arrived_ms, &input);
            self.handle(idx, input);
        }
    }

    /// Gives one input to a peer and does what it says.
    fn handle(&mut self, idx: usize, input: Input) {
        let now_ms = self.now_ms;
        let s = &mut self.peers[idx];
        let Some(mut peer) = s.peer.take() else {
            return;
        };
        if let Input::Percept(percept) = &input {
            s.told_fuel_s = percept.endurance_s;
        }
        self.meter.input();
        let (is_percept, plan) = (matches!(input, Input::Percept(_)), s.plan);
        let before = self.meter.enter(Part::Peer);
        let from_ns = self.meter.now_ns();
        peer.handle(s.clock.reads(now_ms), input);
        self.meter.answered(from_ns, is_percept, plan);
        self.meter.enter(before);
        while let Some(output) = peer.poll() {
            self.perform(idx, &peer, output);
        }
        self.peers[idx].peer = Some(peer);
        self.schedule_timer(idx);
    }

    fn perform(&mut self, idx: usize, peer: &Peer, output: Output) {
        let id = self.peers[idx].id();
        let boot = self.peers[idx].boots;
        match output {
            Output::Publish {
                key,
                bytes,
                hops,
                priority,
                lifetime_ms,
            } => {
                let hash = bytes_hash(&bytes);
                self.history.fold(self.now_ms, id, Kind::Publish, hash);
                let before = self.meter.enter(Part::Checks);
                self.checker.on_transmission(self.now_ms, id, bytes.len());
                self.meter.enter(before);
                let cost = self.peers[idx].frame.add(self.now_ms, bytes.len());
                self.traffic.transmitted(&key, cost as u64);
                if hops == 0 {
                    self.metered(Part::Checks, |swarm| swarm.said(idx, peer, &bytes, hash));
                    self.last_said.clone_from(&bytes);
                }
                let frame = Frame {
                    key: key_hash(&key),
                    bytes: bytes.into(),
                    hops,
                    priority: priority as u8,
                    lifetime_ms,
                };
                let before = self.meter.enter(Part::Medium);
                self.air.transmit(self.now_ms, id, frame);
                self.meter.enter(before);
            }
            Output::Setpoint(setpoint) => {
                self.history
                    .fold(self.now_ms, id, Kind::Setpoint, setpoint_hash(&setpoint));
                let taken = self.air.apply(id, setpoint);
                self.checker.on_setpoint(self.now_ms, id, taken);
            }
            Output::Store { token, record } => {
                if let Some(Entry::Bid(bid)) = Entry::decode(&record) {
                    let at = self.air.own(id);
                    let fuel_s = self.peers[idx].told_fuel_s;
                    let at = at.map(|p| (p.pose.position(), fuel_s));
                    self.checker
                        .on_bid(self.now_ms, id, &bid, (&peer.beliefs(), at));
                }
                let done_ms = self.peers[idx].disk.write(self.now_ms, token, record);
                self.queue
                    .push(done_ms, Phase::Answer, Event::Stored { idx, boot });
            }
            Output::Compute { token, job } => {
                let (takes_ms, plan) = match job {
                    Job::Geometry(_) => (GEOMETRY_MS, "geometry"),
                    Job::Divide { .. } => (DIVIDE_MS, "division"),
                    Job::Errand(_) => (DIVIDE_MS, "errand"),
                };
                self.peers[idx].plan = Some(plan);
                let before = self.meter.enter(Part::Planning);
                let answer = self.geometry_cache.answer(&job);
                self.meter.enter(Part::Checks);
                match (&job, &answer) {
                    (Job::Divide { ring, uavs, .. }, JobResult::Divide(division)) => {
                        let divided = (&ring[..], &uavs[..], division);
                        self.checker.on_divide(self.now_ms, id, divided);
                    }
                    (_, JobResult::Geometry(Ok(geometry))) => {
                        self.checker.on_loop(geometry);
                    }
                    _ => {}
                }
                self.meter.enter(before);
                self.queue.push(
                    self.now_ms + takes_ms,
                    Phase::Answer,
                    Event::Planned {
                        idx,
                        boot,
                        token,
                        answer,
                    },
                );
            }
            Output::Report(report) => self.reported(id, peer, report),
        }
    }

    fn said(&mut self, idx: usize, peer: &Peer, bytes: &[u8], hash: u64) {
        let id = self.peers[idx].id();
        if let Some(mut said) = Said::read(bytes) {
            // Checks know whoever speaks by the number of its radio.
            if said.record.author == self.peers[idx].config.id.0 {
                said.record.author = id;
                self.names.speaks(id, said.record.incarnation);
            }
            if said.tells_of_cells() {
                self.refresh_covered();
            }
            if said.record.kind == wire::kinds::Kind::Operator.number() {
                self.operator.was_spoken(bytes);
            }
            if said.record.kind == wire::kinds::Kind::Beacon.number() {
                self.checker
                    .on_beacon(self.now_ms, id, &said, &peer.beliefs());
            }
            if let wire::codec::Body::Heartbeat(heartbeat) = &said.body {
                self.checker.on_heartbeat(self.now_ms, id, heartbeat);
            }
            // Of another loop than the one that cells are counted on only its peer knows what
            // its runs bridge.
            let other = said.claim.as_ref().map(|c| c.loop_hash);
            let other = other.filter(|hash| *hash != self.judged.hash());
            let covered = other.map(|_| peer.beliefs().covered);
            let covered = covered.as_ref().unwrap_or(self.judged.covered());
            let durable = (self.peers[idx].disk.records(), covered);
            self.checker.on_said(self.now_ms, id, &said, hash, durable);
            self.spoken.insert(hash, Arc::new(said));
        } else {
            self.checker.found.broken("S8", self.now_ms, Some(id), || {
                "published bytes nobody can read".to_owned()
            });
        }
    }

    fn reported(&mut self, id: u16, peer: &Peer, report: Report) {
        self.history
            .fold(self.now_ms, id, Kind::Report, report_hash(&report));
        let adoptions = match &report {
            Report::Claim { .. } => peer.adoptions(),
            _ => 0,
        };
        let before = self.meter.enter(Part::Checks);
        let meant = self.names.meant_in(id, &report, self.checker.graph());
        self.checker.on_report(self.now_ms, id, &meant, adoptions);
        self.meter.enter(before);
        self.account.reported(self.now_ms, id, &meant);
        self.note_voice(id, &report);
        self.note_look_asked(id, peer, &report);
        self.note_task(id, &report);
        self.note_detection(id, &report);
        self.note_finished(id, &report);
        self.note_alert(id, &report);
        if let Report::Refused { reason } = &report
            && !std::mem::take(&mut self.spoilt)
        {
            self.checker.found.broken("S8", self.now_ms, Some(id), || {
                format!("refused what another peer said: {reason}")
            });
        }
        if let Report::Found { mission } = &report {
            self.obstacles_found(mission);
        }
        if let Report::Ready {
            revision,
            loop_hash,
            ..
        } = &report
        {
            self.air.follows(id, *revision);
            self.mission_begun(*revision, *loop_hash);
        }
        self.history
            .keep(self.now_ms, || What::Report { peer: id, report });
    }

    /// Judges what every peer believes, once a beacon period.
    fn judge(&mut self) {
        self.queue
            .push(self.now_ms + self.period_ms(), Phase::Judge, Event::Judge);
        self.advance_world();
        self.observe_graph();
        self.refresh_covered();
        self.repeat_order();
        self.speak_tasks();
        let (silent, peers): (Vec<PeerSnapshot>, Vec<PeerSnapshot>) =
            self.snapshots().into_iter().partition(|m| m.view.is_silent);
        self.carry_order(&peers);
        if self.homing {
            self.done = self
                .checker
                .on_way_home(self.now_ms, &peers, self.judged.covered());
            return;
        }
        self.judge_crowd();
        let loss_permille = self.air.loss_permille();
        self.checker.on_snapshot(
            self.now_ms,
            loss_permille,
            (&peers, &silent),
            self.judged.covered(),
            self.judged.hash(),
        );
        self.judge_tracks(&peers);
        self.judge_detections(&peers);
        self.judge_contour(&peers);
        self.judge_counts(&peers);
        self.judge_streets(&peers);
        self.unassigned = peers.iter().any(|m| !m.view.unassigned.is_empty());
        let mut flying = 0;
        let (mut finished, mut ended) = (true, true);
        for m in peers.iter().filter(|m| m.uav) {
            flying += 1;
            // A relay position is over for nobody but who holds it.
            finished &= m.view.finished || m.view.relays;
            ended &= m.view.finished;
        }
        self.note_ground(&peers);
        // Whoever ends it by its time before that is found by a rule.
        let timed = || self.operator.mission().ends_after_s().is_some();
        let open = self.account.covered_ms().is_none();
        if open && flying > 0 && finished && timed() {
            if self.air.end_laps() {
                self.account.covered(self.now_ms);
                self.history.keep(self.now_ms, || What::Covered);
            } else if ended && !self.operator.mission().tasks.is_empty() {
                // What it brings goes before its cells: it is over by its time.
                self.account.over(self.now_ms);
            }
        }
        // Whoever ends it by what is not there is found by a rule.
        let is_found = || {
            let found = self.checker.rules.detections.has_found();
            found && self.operator.mission().ends_when_found()
        };
        if open && flying > 0 && finished && is_found() {
            self.account.found(self.now_ms);
            self.history.keep(self.now_ms, || What::Covered);
        }
        let fresh_ms = FRESH_TASK_PERIODS * self.period_ms();
        let detections = &self.checker.rules.detections;
        let waits = self.has_fresh_task()
            || self.is_following(&peers)
            || detections.has_fresh(self.now_ms, fresh_ms);
        self.done = self.account.covered_ms().is_some() && flying > 0 && finished && !waits;
        for v in self.checker.found.drain_fresh() {
            self.history.keep(v.time_ms, || What::Violation {
                check: v.check.clone(),
                peer: v.peer,
                text: v.text,
            });
        }
    }

    /// The ground station says the standing order once in each life, as a live one does.
    fn repeat_order(&mut self) {
        let Some(idx) = self.ground_station() else {
            return;
        };
        let speaks_in = self.peers[idx].voice();
        if let Some(orders) = self.operator.speaks(speaks_in) {
            self.feed(idx, Input::Command(Command::Orders(orders)));
        }
    }

    /// The ground station is told what its operator wants of tasks, once in each life.
    fn speak_tasks(&mut self) {
        let Some(idx) = self.ground_station() else {
            return;
        };
        let speaks_in = self.peers[idx].voice();
        for edit in self.operator.task_edits(self.now_ms, speaks_in) {
            self.feed(idx, Input::Command(Command::Task(edit)));
        }
        self.serve(idx);
        let Some(peer) = self.peers[idx].peer.as_ref() else {
            return;
        };
        let tasks = peer.operators_tasks();
        let mission = self.operator.mission();
        let brought = mission.brought(false);
        for asked in tasks.asked.iter().chain(&brought) {
            self.account.asked(self.now_ms, asked);
            self.checker.rules.relays.on_asked(asked);
            self.checker.rules.tracks.on_asked(asked);
            if let Some(look) = AskedLook::of(&self.spec, mission, asked) {
                let since_ms = self.now_ms.saturating_sub(asked.age_ms);
                self.air
                    .ask(look.task, look.pieces, look.carriers, since_ms);
            }
        }
        self.operator.note_tasks(self.now_ms, tasks);
    }

    /// Services on the ground go where the ground station calls them, and its operator says that
    /// they are there.
    fn serve(&mut self, ground: usize) {
        if self.spec.services.is_empty() {
            return;
        }
        let peer = self.peers[ground].peer.as_ref();
        let Some(peer) = peer.filter(|p| p.speaks_in().is_some()) else {
            return;
        };
        for call in self.air.dispatch(&peer.calls()) {
            let station = self.peers[ground].id();
            let rules = &mut self.checker.rules;
            rules
                .detections
                .on_served((self.now_ms, station), (call.task, call.revision));
            self.feed(
                ground,
                Input::Command(Command::Task(TaskEdit::Done(call.name))),
            );
        }
    }

    /// How many cells were seen of which the ground station does not know.
    fn note_ground(&mut self, peers: &[PeerSnapshot]) {
        let same = |m: &&PeerSnapshot| !m.uav && m.view.loop_hash == self.judged.hash();
        let lacks = peers.iter().find(same).map(|m| {
            let mut lacks = self.judged.covered().clone();
            lacks.subtract(&m.view.covered);
            lacks.count()
        });
        self.ground_lacks.push(lacks);
    }

    /// Whether a task was asked for so lately that not all may have heard of it.
    fn has_fresh_task(&self) -> bool {
        let fresh = |t: &skein_peer::input::AskedTask| {
            t.task.is_open() && t.age_ms < FRESH_TASK_PERIODS * self.period_ms()
        };
        // While somebody is to be followed for some time that is not over.
        let follows = |t: &skein_peer::input::AskedTask| {
            let is_track = t.task.kind == wire::tasks::TaskKind::Track;
            t.task.is_open() && is_track && t.task.within_ms > 0
        };
        let mut tasks = self.operator.tasks().iter();
        tasks.any(|t| fresh(t) || follows(t))
    }

    /// Whoever waits for the operator out of reach of the ground station is told to go on
    /// by somebody who goes there with the record.
    fn carry_order(&mut self, peers: &[PeerSnapshot]) {
        let station = self.spec.ground.as_ref().map_or(0, |g| g.id);
        let waits = |m: &&PeerSnapshot| {
            m.uav && m.view.order != Order::Resume && self.operator.wants_to_fly(m.id)
        };
        let out_of_reach = |m: &&PeerSnapshot| !self.checker.graph().joined(m.id, station);
        let stranded = peers.iter().filter(waits).find(out_of_reach).map(|m| m.id);
        if let Some(bytes) = self.operator.courier(self.now_ms, stranded.is_some())
            && let Some(id) = stranded
            && let Some(idx) = self.peer_idx(id)
        {
            let Shared { heard, said, .. } = self.shared(&bytes);
            self.heard(self.now_ms, id, said.as_deref());
            let (transmitter, hops) = (station, 0);
            self.feed(
                idx,
                Input::Received {
                    transmitter,
                    hops,
                    heard,
                },
            );
        }
    }

    fn ground_station(&self) -> Option<usize> {
        let mut peers = self.peers.iter();
        peers.position(|p| p.config.role == Role::GroundStation)
    }

    /// What every running peer believes, and where it is.
    fn snapshots(&mut self) -> Vec<PeerSnapshot> {
        let of = |s: &SimPeer| s.snapshot(&self.air);
        let mut all: Vec<PeerSnapshot> = self.peers.iter().filter_map(of).collect();
        for m in &mut all {
            self.names.rename(m.id, &mut m.view, self.checker.graph());
        }
        all
    }

    /// A peer begins a life, or falls silent since a twin speaks.
    fn note_voice(&mut self, id: u16, report: &Report) {
        let Some(idx) = self.peer_idx(id) else {
            return;
        };
        let now_ms = self.now_ms;
        match report {
            Report::Booted { .. } => {
                self.peers[idx].is_lifeless = false;
                if !self.peers[idx].silent {
                    return;
                }
                self.peers[idx].silent = false;
                self.peers[idx].since_ms = now_ms;
                self.checker.on_voice(id);
            }
            Report::Silenced => {
                self.peers[idx].silent = true;
                let heirs = self.names.silence(id);
                self.checker.on_silenced(now_ms, id, &heirs);
            }
            _ => {}
        }
    }

    /// A UAV says that its mission is finished: the judge knows whether each layer was seen.
    fn note_finished(&mut self, id: u16, report: &Report) {
        let mission = self.operator.mission();
        if let Report::Finished { revision } = report
            && mission.has_lap_of(*revision)
        {
            self.air.advance(self.now_ms);
            let (seen, rules) = (self.air.judge().layers(), &mut self.checker.rules);
            let found = &mut self.checker.found;
            rules
                .layers
                .on_finished((self.now_ms, id), mission, &seen, found);
        }
    }

    fn is_judged(&self, approach: &Approach) -> bool {
        let twins = self.names.twins();
        is_judged(&self.spec.mission, approach, |number| twins.id_of(number))
    }

    /// A UAV says that it saw all of a task: the judge knows.
    fn note_task(&mut self, id: u16, report: &Report) {
        let Report::Task {
            id: task,
            revision,
            name,
            news: TaskNews::Seen,
            ..
        } = report
        else {
            return;
        };
        self.air.advance(self.now_ms);
        if self
            .air
            .judge()
            .saw_task(self.judged_as(*task, *revision))
            .is_none()
        {
            let text = format!("says that it saw the task {name:?}, and did not");
            self.checker
                .found
                .broken("task-seen", self.now_ms, Some(id), || text);
        }
    }

    /// After the end those who are finished fly home: that is checked, and is no part of the
    /// history.
    fn fly_home(mut self, mut outcome: Outcome) -> Outcome {
        if outcome.report.completed {
            (self.done, self.homing) = (false, true);
            self.end_ms = self.now_ms + LONGEST_WAY_HOME_MS;
            while self.step() {}
            outcome.report.add_violations(&self.checker.found);
        }
        outcome
    }

    fn observe_graph(&mut self) {
        let running = self.peers.iter().filter(|s| s.has_voice()).map(SimPeer::id);
        let mut ids: Vec<u16> = running.collect();
        ids.sort_unstable();
        let graph = self.air.graph(ids);
        if self.checker.on_graph(self.now_ms, graph) {
            let components = self.checker.graph().components();
            self.account.connected(&components);
            self.history
                .keep(self.now_ms, || What::Components(components));
        }
    }

    fn refresh_covered(&mut self) {
        self.judged.refresh(&self.air);
    }
}
