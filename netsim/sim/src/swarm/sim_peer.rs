//! One peer of a swarm as its driver sees it: process, clock, disk, inbox.

use super::air::Air;
use super::operator::Voice;
use super::stream::{Concern, Stream};
use crate::check::PeerSnapshot;
use crate::disk::Disk;
use crate::spec::Spec;
use skein_behaviors::Percept;
use skein_peer::protocol::airtime::Filling;
use skein_peer::{Input, Peer, PeerConfig, PeerId, Role, Time};
use std::collections::VecDeque;
use std::sync::Arc;

/// Most inputs that wait for a process that stands still; the oldest is dropped. The
/// receive buffer of a socket holds about as many records of 200 bytes.
pub const INBOX_CAP: usize = 256;

/// The largest difference between a peer's clock at its boot and scenario time, milliseconds.
const MAX_OFFSET_MS: u64 = 60_000;

/// The clock of a computer: set at every start, at a rate of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Clock {
    set_ms: u64,
    showed_ms: u64,
    ppm: i32,
}

/// The largest drift that a clock may have, millionths.
pub const MAX_DRIFT_PPM: i32 = 500_000;

impl Clock {
    const MILLION: u64 = 1_000_000;

    fn rate(self) -> u64 {
        Self::MILLION.saturating_add_signed(i64::from(self.ppm))
    }

    /// It shows `shows_ms` at `now_ms`.
    fn set(&mut self, now_ms: u64, shows_ms: u64) {
        self.set_ms = now_ms;
        self.showed_ms = shows_ms;
    }

    /// What it shows at `now_ms`.
    #[must_use]
    pub fn reads(self, now_ms: u64) -> Time {
        let since_ms = now_ms.saturating_sub(self.set_ms);
        Time(self.showed_ms + since_ms * self.rate() / Self::MILLION)
    }

    /// The first scenario time at which it shows at least `time`, milliseconds.
    #[must_use]
    pub fn when_ms(self, time: Time) -> u64 {
        let ahead_ms = time.0.saturating_sub(self.showed_ms);
        self.set_ms + (ahead_ms * Self::MILLION).div_ceil(self.rate())
    }

    /// From now on it gains so many millionths, and goes on at what it shows.
    pub fn drift(&mut self, now_ms: u64, ppm: i32) {
        self.set(now_ms, self.reads(now_ms).0);
        self.ppm = ppm.clamp(-MAX_DRIFT_PPM, MAX_DRIFT_PPM);
    }

    /// It jumps ahead.
    pub fn jump(&mut self, now_ms: u64, ahead_ms: u64) {
        self.set(now_ms, self.reads(now_ms).0 + ahead_ms);
    }
}

/// What a process does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Process {
    /// It runs.
    Running,
    /// It stands still; what arrives waits.
    Paused,
    /// There is none.
    Stopped,
}

/// One peer.
#[derive(Debug)]
pub struct SimPeer {
    /// The number of its radio and airframe; its id, unless it is a twin.
    number: u16,
    /// What it is told before it starts.
    pub config: PeerConfig,
    /// The mind, while there is a process; boxed, since it changes hands with every input.
    pub peer: Option<Box<Peer>>,
    /// What the process does.
    pub process: Process,
    /// Whether its airframe is in the air.
    pub airframe: bool,
    /// How often it was started; answers to an earlier start are void.
    pub boots: u32,
    /// Its clock.
    pub clock: Clock,
    /// How long it takes to get round to what arrives, milliseconds; 0 for a quick one.
    pub slow_ms: u64,
    /// When its process last started or went on, milliseconds.
    pub since_ms: u64,
    /// Its disk.
    pub disk: Disk,
    /// Inputs that wait while it stands still, each with when it arrived.
    pub inbox: VecDeque<(u64, Input)>,
    /// For when the earliest timer event in the queue is, scenario time.
    pub timer_ms: Option<u64>,
    /// The fuel that its last percept told it of, seconds.
    pub told_fuel_s: f64,
    /// What is computed for it beside its mind, the last of it.
    pub plan: Option<&'static str>,
    /// What it handed to its radio last.
    pub frame: Filling,
    /// Whether it held that the mission is finished when last judged.
    pub finished: bool,
    /// Whether it is silent since a twin speaks.
    pub silent: bool,
    /// Whether its disk did not take the life that it was to begin: it says nothing, and passes
    /// nothing on.
    pub is_lifeless: bool,
    clock_draws: Stream,
    nonce: Stream,
}

impl SimPeer {
    /// A peer whose process has not been started, in the airframe with this number.
    #[must_use]
    pub fn new(seed: u64, id: u16, mut config: PeerConfig) -> Self {
        let mut clock_draws = Stream::new(seed, Concern::Peer(id));
        config.seed = clock_draws.any();
        Self {
            number: id,
            config,
            peer: None,
            process: Process::Stopped,
            airframe: false,
            boots: 0,
            clock: Clock::default(),
            slow_ms: 0,
            since_ms: 0,
            disk: Disk::new(Stream::new(seed, Concern::Disk(id))),
            inbox: VecDeque::new(),
            timer_ms: None,
            told_fuel_s: 0.0,
            plan: None,
            frame: Filling::default(),
            finished: false,
            silent: false,
            is_lifeless: false,
            clock_draws,
            nonce: Stream::new(seed, Concern::Nonce(id)),
        }
    }

    /// Its number.
    #[must_use]
    pub fn id(&self) -> u16 {
        self.number
    }

    /// Whether another UAV has its id.
    #[must_use]
    pub fn is_twin(&self) -> bool {
        self.number != self.config.id.0
    }

    /// When it is switched on for the first time, milliseconds: no two computers of a
    /// fleet start in the same instant, and peers that did would send in step for ever.
    pub fn first_boot_ms(&mut self, latest_ms: u64) -> u64 {
        self.clock_draws.between(0, latest_ms)
    }

    /// Starts a process, with a clock of its own, and returns its first input.
    pub fn start(&mut self, now_ms: u64) -> Input {
        self.boots += 1;
        let offset_ms = self.clock_draws.between(0, MAX_OFFSET_MS);
        self.clock.set(now_ms, now_ms + offset_ms);
        self.since_ms = now_ms;
        self.process = Process::Running;
        self.timer_ms = None;
        self.finished = false;
        self.silent = false;
        self.is_lifeless = false;
        self.inbox.clear();
        self.plan = None;
        self.peer = Some(Box::new(Peer::new(self.config.clone())));
        #[allow(
            clippy::cast_possible_truncation,
            reason = "the low half of a random number is one"
        )]
        let nonce = self.nonce.any() as u32;
        Input::Start {
            persisted: self.disk.records().to_vec(),
            nonce,
        }
    }

    /// Ends the process; what it had not synced is gone.
    pub fn stop(&mut self) -> Option<Box<Peer>> {
        self.process = Process::Stopped;
        self.inbox.clear();
        self.disk.crash();
        self.finished = false;
        self.silent = false;
        self.is_lifeless = false;
        self.peer.take()
    }

    /// The process stands still.
    pub fn stand_still(&mut self) {
        if self.process == Process::Running {
            self.process = Process::Paused;
        }
    }

    /// How many writes are durable of which it has not been told yet.
    #[must_use]
    pub fn untold_writes(&self) -> usize {
        let told = |(_, i): &&(u64, Input)| matches!(i, Input::Stored { ok: true, .. });
        self.inbox.iter().filter(told).count()
    }

    /// Keeps an input for later. Of percepts only the newest counts, and only what came
    /// by radio is ever dropped: answers of disk and planner are the process's own.
    pub fn wait(&mut self, now_ms: u64, input: Input) {
        if matches!(input, Input::Percept(_)) {
            self.inbox.retain(|(_, i)| !matches!(i, Input::Percept(_)));
        }
        let received = |(_, i): &(u64, Input)| matches!(i, Input::Received { .. });
        if self.inbox.len() >= INBOX_CAP
            && let Some(oldest) = self.inbox.iter().position(received)
        {
            self.inbox.remove(oldest);
        }
        self.inbox.push_back((now_ms, input));
    }

    /// Its disk took a write, or did not.
    pub fn on_stored(&mut self, ok: bool) {
        let has_life = self.peer.as_ref().is_some_and(|p| p.has_life());
        self.is_lifeless |= !ok && !has_life;
    }

    /// Whether its radio carries anything: what it says itself, and in its beacons what it
    /// knows of others.
    #[must_use]
    pub fn has_voice(&self) -> bool {
        self.process == Process::Running && !self.silent && !self.is_lifeless
    }

    /// In which life it speaks, and in which run of its process; none where it does not.
    #[must_use]
    pub fn voice(&self) -> Option<Voice> {
        let life = self.peer.as_ref()?.speaks_in()?;
        Some((self.boots, life))
    }

    /// What it believes and where it is, while it runs.
    #[must_use]
    pub fn snapshot(&self, air: &Air) -> Option<PeerSnapshot> {
        let running = self.process == Process::Running;
        let peer = self.peer.as_ref().filter(|_| running)?;
        let percept = air.own(self.id());
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "the world counts fuel in milliseconds, and none is negative"
        )]
        let fuel_ms = |p: &Percept| (p.endurance_s * 1000.0) as u64;
        Some(PeerSnapshot {
            id: self.id(),
            speaks_as: self.config.id.0,
            uav: self.config.role == Role::Uav,
            since_ms: self.since_ms,
            at: percept.as_ref().map(|p| p.pose.position()),
            fuel_ms: percept.as_ref().map(fuel_ms),
            eta_ms: peer.eta_ms(),
            view: peer.beliefs(),
        })
    }
}

/// The peers of a scenario, ascending by number.
#[must_use]
pub fn of_scenario(spec: &Spec, seed: u64) -> Vec<SimPeer> {
    let launches = spec.launches();
    let config = |id: u16| PeerConfig {
        id: PeerId(id),
        role: Role::Uav,
        fleet: spec.fleet.clone(),
        beacon_period_ms: spec.beacon_period_ms,
        rate_bps: spec.radio.rate_bps,
        airframe: None,
        objective: spec.objective,
        height_m: 0.0,
        mission: Some(Arc::clone(&spec.mission)),
        launches: Arc::clone(&launches),
        sensors: 0,
        seed: 0,
    };
    let mut peers: Vec<SimPeer> = spec
        .uavs
        .iter()
        .map(|u| {
            SimPeer::new(
                seed,
                u.id,
                PeerConfig {
                    airframe: Some(u.airframe),
                    height_m: u.height_m,
                    sensors: u.sensors,
                    ..config(u.twin_of.unwrap_or(u.id))
                },
            )
        })
        .collect();
    if let Some(g) = &spec.ground {
        peers.push(SimPeer::new(
            seed,
            g.id,
            PeerConfig {
                role: Role::GroundStation,
                height_m: g.height_m,
                ..config(g.id)
            },
        ));
    }
    peers.sort_by_key(SimPeer::id);
    peers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_never_goes_back_and_finds_the_instant_at_which_it_shows_a_time() {
        let mut clock = Clock::default();
        clock.set(1_000, 31_000);
        let mut before = clock.reads(1_000);
        for (from_ms, ppm, ahead_ms) in [
            (1_000, 0, 0),
            (5_000, 20_000, 0),
            (9_000, -400_000, 700),
            (12_000, 0, 0),
        ] {
            clock.drift(from_ms, ppm);
            clock.jump(from_ms, ahead_ms);
            for now_ms in from_ms..from_ms + 500 {
                let shows = clock.reads(now_ms);
                assert!(shows >= before);
                before = shows;
                let first_ms = clock.when_ms(shows);
                assert!(first_ms <= now_ms && clock.reads(first_ms) >= shows);
                assert!(first_ms == from_ms || clock.reads(first_ms - 1) < shows);
            }
        }
        // 4 s true, 4 s with 2 % more, 3 s with 40 % less after a jump.
        assert_eq!(clock.reads(12_000).0, 31_000 + 4_000 + 4_080 + 700 + 1_800);
    }
}
