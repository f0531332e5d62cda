//! The peer: owns the parts, routes inputs, collects outputs. No policy.
//!
//! | what happens | who decides |
//! |---|---|
//! | life, probation, silence | `life` |
//! | records heard | `inbound` |
//! | records spoken | `outbound` |
//! | mission, goal, sections | `cooperation` |

use crate::beliefs::Beliefs;
use crate::config::{PeerConfig, Role};
use crate::input::{Command, Input, Time};
use crate::journal::{Durable, Entry};
use crate::mission::Library;
use crate::mission_state::MissionState;
use crate::offload::{Job, JobResult};
use crate::outbound::Outbound;
use crate::output::{Output, Report};
use crate::protocol::membership::Membership;
use crate::protocol::relay::Relay;
use crate::protocol::runs::PlannedCell;
use crate::wire::message::{Epoch, Order};
use crate::{Incarnation, Mission, PeerId, cooperation, inbound, outbound, protocol::life};
use rand_chacha::ChaCha8Rng;
use rand_core::SeedableRng;
use skein_behaviors::Percept;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

/// Most stores under way: one a kind of promise and a few unions. A driver that
/// answers none of them is broken, and the peer goes silent rather than lie.
pub const MAX_STORES: usize = 32;

/// Most plans under way: one ground a mission revision, one division a round.
pub const MAX_JOBS: usize = 8;

/// How often a peer looks at its deadlines, as a fraction of the beacon period.
pub const CADENCE: u64 = 4;

/// What waits for a store to become durable.
#[derive(Clone, Debug)]
pub(crate) enum Promise {
    /// A life.
    Life(Incarnation),
    /// A bid.
    Bid(Box<crate::wire::message::Bid>),
    /// An adoption, and which of the sections written it is.
    Adopt(u64, Box<crate::protocol::negotiation::Adoption>),
    /// Cells taken without a round, likewise.
    Take(u64, Vec<PlannedCell>),
    /// Coverage; nothing waits for it.
    Covered,
}

/// What waits for an answer of the planner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PendingJob {
    /// The common ground of the mission with this hash.
    Geometry(u64),
    /// A division of this epoch.
    Division(Epoch),
}

/// The mind of one peer. The contract is at the top of the crate.
#[derive(Debug)]
pub struct Peer {
    pub(crate) config: PeerConfig,
    pub(crate) now: Time,
    pub(crate) started: bool,
    pub(crate) life: life::Life,
    pub(crate) rng: ChaCha8Rng,
    pub(crate) membership: Membership,
    pub(crate) relay: Relay,
    pub(crate) library: Library,
    pub(crate) outbound: Outbound,
    pub(crate) mission_state: Option<MissionState>,
    pub(crate) order: StandingOrder,
    pub(crate) percept: Option<Percept>,
    pub(crate) durable: Durable,
    pub(crate) outputs: VecDeque<Output>,
    next_token: u64,
    stores: BTreeMap<u64, (Promise, Entry)>,
    jobs: BTreeMap<u64, PendingJob>,
    next_tick: Time,
}

/// The operator's standing order and the version of the record that gave it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct StandingOrder {
    /// What is wanted.
    pub order: Order,
    /// (incarnation, seq, author) of the record; none yet when zero.
    pub version: (Incarnation, u32, u16),
}

impl Peer {
    /// A peer that has not started; its first input must be [`Input::Start`].
    #[must_use]
    pub fn new(config: PeerConfig) -> Self {
        let period = config.beacon_period_ms.max(1);
        let mut seed = [0u8; 32];
        seed[..8].copy_from_slice(&config.seed.to_le_bytes());
        seed[8..10].copy_from_slice(&config.id.0.to_le_bytes());
        Self {
            membership: Membership::new(config.id.0, period),
            relay: Relay::new(config.id.0, &config.fleet, config.rate_bps, period),
            library: Library::new(config.mission.clone()),
            outbound: Outbound::default(),
            mission_state: None,
            order: StandingOrder {
                order: Order::Resume,
                version: (0, 0, 0),
            },
            percept: None,
            durable: Durable::default(),
            outputs: VecDeque::new(),
            next_token: 1,
            stores: BTreeMap::new(),
            jobs: BTreeMap::new(),
            next_tick: Time(0),
            now: Time(0),
            started: false,
            life: life::Life::default(),
            rng: ChaCha8Rng::from_seed(seed),
            config,
        }
    }

    /// Takes one input at the peer's own time. Time that runs backwards stands still.
    pub fn handle(&mut self, now: Time, input: Input) {
        self.now = self.now.max(now);
        if !self.started {
            if let Input::Start { persisted, nonce } = input {
                self.started = true;
                self.next_tick = self.now;
                life::start(self, &persisted, nonce);
            }
            return;
        }
        match input {
            Input::Start { .. } => {}
            Input::Percept(percept) => self.on_percept(percept),
            Input::Received {
                transmitter,
                hops,
                bytes,
            } => inbound::hear(self, transmitter, hops, &bytes),
            Input::Timer => {}
            Input::LinkHint { neighbour, up } => self.membership.link(neighbour, up),
            Input::Stored { token, ok } => self.on_stored(token, ok),
            Input::Computed { token, result } => self.on_computed(token, result),
            Input::Command(command) => self.on_command(&command),
        }
        self.tick();
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
        let mut next = self.next_tick.min(self.outbound.next_beacon);
        if let Some(t) = self.relay.next_timeout(self.now) {
            next = next.min(t);
        }
        Some(next.max(self.now.plus_ms(1)))
    }

    /// The deadlines that are due, then whatever may be sent now.
    fn tick(&mut self) {
        if self.now >= self.next_tick {
            self.next_tick = self.now.plus_ms(self.period_ms() / CADENCE);
            life::tick(self);
            let changes = self.membership.tick(self.now);
            inbound::on_changes(self, changes);
            cooperation::tick(self);
            outbound::tick(self);
        }
        if self.now >= self.outbound.next_beacon {
            outbound::beacon(self);
        }
        outbound::send(self);
    }

    fn on_percept(&mut self, percept: Percept) {
        let finite = [
            percept.pose.east_m,
            percept.pose.north_m,
            percept.pose.heading_rad,
            percept.endurance_s,
        ];
        if finite.iter().any(|v| !v.is_finite()) {
            self.report(Report::Refused {
                reason: "a percept that is not finite".into(),
            });
            return;
        }
        self.percept = Some(percept);
        cooperation::fly(self, &percept);
    }

    fn on_stored(&mut self, token: u64, ok: bool) {
        let Some((promise, entry)) = self.stores.remove(&token) else {
            return;
        };
        if !ok {
            self.alarm("the journal could not be written; what it was to promise is not spoken");
            cooperation::broken(self, &promise);
            return;
        }
        self.durable.apply(&entry);
        match promise {
            Promise::Life(incarnation) => life::lives(self, incarnation),
            Promise::Bid(bid) => cooperation::bid_is_durable(self, *bid),
            Promise::Adopt(written, adoption) => cooperation::adopt(self, written, &adoption),
            Promise::Take(written, cells) => cooperation::take(self, written, &cells),
            Promise::Covered => {}
        }
    }

    fn on_computed(&mut self, token: u64, result: JobResult) {
        match (self.jobs.remove(&token), result) {
            (Some(PendingJob::Geometry(hash)), JobResult::Geometry(geometry)) => {
                cooperation::geometry_arrived(self, hash, geometry)
            }
            (Some(PendingJob::Division(epoch)), JobResult::Divide(division)) => {
                cooperation::divided(self, epoch, &division);
            }
            _ => {}
        }
    }

    fn on_command(&mut self, command: &Command) {
        if self.config.role != Role::GroundStation {
            self.alarm("a command reached a peer that is no ground station; it was ignored");
            return;
        }
        match command {
            Command::Mission(mission) => {
                self.library.offer(mission.clone());
                outbound::speak_mission(self);
            }
            Command::Order(order) => outbound::speak_order(self, *order),
        }
    }

    /// Asks for a record to be made durable; `promise` is kept once it is.
    pub(crate) fn store(&mut self, promise: Promise, entry: Entry) -> bool {
        if self.stores.len() >= MAX_STORES {
            return false;
        }
        let token = self.token();
        self.outputs.push_back(Output::Store {
            token,
            record: entry.encode(),
        });
        self.stores.insert(token, (promise, entry));
        true
    }

    /// Asks the planner.
    pub(crate) fn ask(&mut self, pending: PendingJob, job: Job) {
        if self.jobs.len() < MAX_JOBS && !self.jobs.values().any(|p| *p == pending) {
            let token = self.token();
            self.outputs.push_back(Output::Compute { token, job });
            self.jobs.insert(token, pending);
        }
    }

    fn token(&mut self) -> u64 {
        self.next_token += 1;
        self.next_token
    }

    pub(crate) fn report(&mut self, report: Report) {
        self.outputs.push_back(Output::Report(report));
    }

    pub(crate) fn alarm(&mut self, text: &str) {
        tracing::warn!(peer = self.config.id.0, at_ms = self.now.0, "{text}");
        self.report(Report::Alarm {
            text: text.to_owned(),
        });
    }

    pub(crate) fn period_ms(&self) -> u64 {
        u64::from(self.config.beacon_period_ms.max(1))
    }

    /// The newest mission that it holds.
    #[must_use]
    pub fn mission(&self) -> Option<Arc<Mission>> {
        self.library.newest()
    }

    /// The revision that the operator's next mission must have to be flown: above those
    /// of all missions that this peer holds, or has heard that others follow.
    #[must_use]
    pub fn next_revision(&self) -> u32 {
        let held = self.library.newest().map(|m| m.revision);
        let heard = self
            .membership
            .all()
            .filter_map(|(id, ..)| self.membership.info(id))
            .map(|info| info.revision);
        held.into_iter()
            .chain(heard)
            .max()
            .unwrap_or(0)
            .saturating_add(1)
    }

    /// The life in which it speaks at present; none while it only listens.
    #[must_use]
    pub fn speaks_in(&self) -> Option<Incarnation> {
        let speaks = self.life.speaks(self.now) && !self.outbound.silenced;
        speaks.then_some(self.life.incarnation)
    }

    /// A copy of what it believes.
    #[must_use]
    pub fn beliefs(&self) -> Beliefs {
        let mut view = Beliefs {
            incarnation: self.life.incarnation,
            speaks: self.life.speaks(self.now),
            diameter: self.membership.diameter(self.now),
            ..Beliefs::default()
        };
        for (id, incarnation, status) in self.membership.all() {
            view.peers.insert(PeerId(id), (incarnation, status));
        }
        view.loads.push(("stores", self.stores.len(), MAX_STORES));
        view.loads.push(("jobs", self.jobs.len(), MAX_JOBS));
        view.loads.extend(self.relay.loads());
        cooperation::view(self, &mut view);
        view
    }

    /// What it believes to be durable: a judge compares it with what replaying the
    /// journal gives.
    #[must_use]
    pub fn durable(&self) -> Durable {
        self.durable.clone()
    }
}
