//! One peer of a swarm as its driver sees it: process, clock, disk, inbox.

use super::stream::{Concern, Stream};
use crate::disk::Disk;
use skein_peer::{Input, Peer, PeerConfig, Time};
use std::collections::VecDeque;

/// Most inputs that wait for a process that stands still; the oldest is dropped. The
/// receive buffer of a socket holds about as many records of 200 bytes.
pub const INBOX_CAP: usize = 256;

/// The largest difference between a peer's clock at its boot and scenario time, milliseconds.
const MAX_OFFSET_MS: u64 = 60_000;

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
    /// What it is told before it starts.
    pub config: PeerConfig,
    /// The mind, while there is a process.
    pub peer: Option<Peer>,
    /// What the process does.
    pub process: Process,
    /// Whether its airframe is in the air.
    pub airframe: bool,
    /// How often it was started; answers to an earlier start are void.
    pub boots: u32,
    /// Its clock less scenario time, milliseconds.
    pub offset_ms: u64,
    /// When its process last started or went on, milliseconds.
    pub since_ms: u64,
    /// Its disk.
    pub disk: Disk,
    /// Inputs that wait while it stands still.
    pub inbox: VecDeque<Input>,
    /// For when the earliest timer event in the queue is, scenario time.
    pub timer_ms: Option<u64>,
    /// Whether it held that the mission is finished when last judged.
    pub finished: bool,
    clock: Stream,
    nonce: Stream,
}

impl SimPeer {
    /// A peer whose process has not been started.
    #[must_use]
    pub fn new(seed: u64, mut config: PeerConfig) -> Self {
        let id = config.id.0;
        let mut clock = Stream::new(seed, Concern::Peer(id));
        config.seed = clock.any();
        Self {
            config,
            peer: None,
            process: Process::Stopped,
            airframe: false,
            boots: 0,
            offset_ms: 0,
            since_ms: 0,
            disk: Disk::new(Stream::new(seed, Concern::Disk(id))),
            inbox: VecDeque::new(),
            timer_ms: None,
            finished: false,
            clock,
            nonce: Stream::new(seed, Concern::Nonce(id)),
        }
    }

    /// Its number.
    #[must_use]
    pub fn id(&self) -> u16 {
        self.config.id.0
    }

    /// When it is switched on for the first time, milliseconds: no two computers of a
    /// fleet start in the same instant, and peers that did would send in step for ever.
    pub fn first_boot_ms(&mut self, latest_ms: u64) -> u64 {
        self.clock.between(0, latest_ms)
    }

    /// Starts a process, with a clock of its own, and returns its first input.
    pub fn start(&mut self, now_ms: u64) -> Input {
        self.boots += 1;
        self.offset_ms = self.clock.between(0, MAX_OFFSET_MS);
        self.since_ms = now_ms;
        self.process = Process::Running;
        self.timer_ms = None;
        self.finished = false;
        self.inbox.clear();
        self.peer = Some(Peer::new(self.config.clone()));
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
    pub fn stop(&mut self) -> Option<Peer> {
        self.process = Process::Stopped;
        self.inbox.clear();
        self.disk.crash();
        self.finished = false;
        self.peer.take()
    }

    /// The process stands still.
    pub fn stand_still(&mut self) {
        if self.process == Process::Running {
            self.process = Process::Paused;
        }
    }

    /// The time on its own clock.
    #[must_use]
    pub fn clock(&self, now_ms: u64) -> Time {
        Time(now_ms + self.offset_ms)
    }

    /// Keeps an input for later. Of percepts only the newest counts.
    pub fn wait(&mut self, input: Input) {
        if matches!(input, Input::Percept(_)) {
            self.inbox.retain(|i| !matches!(i, Input::Percept(_)));
        }
        if self.inbox.len() >= INBOX_CAP {
            self.inbox.pop_front();
        }
        self.inbox.push_back(input);
    }
}
