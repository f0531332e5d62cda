//! The peer: owns the parts, routes inputs, collects outputs. No policy.
//!
//! | what happens | who decides |
//! |---|---|
//! | life, probation, silence | `boot` |
//! | records heard | `ear` |
//! | records spoken | `voice` |
//! | mission, goal, sections | `cooperation` |

use crate::config::{PeerConfig, Role};
use crate::cooperation::Crew;
use crate::coverage::runs::PlanCell;
use crate::input::{Command, Input, Time};
use crate::journal::{Durable, Entry};
use crate::membership::Membership;
use crate::mission::Library;
use crate::output::{Output, Report};
use crate::plan::{Answer, Problem};
use crate::relay::Relay;
use crate::view::View;
use crate::voice::Voice;
use crate::wire::message::{Epoch, Order};
use crate::{Incarnation, PeerId, boot, cooperation, ear, voice};
use rand_chacha::ChaCha8Rng;
use rand_core::SeedableRng;
use skein_behaviors::Percept;
use std::collections::{BTreeMap, VecDeque};

/// Most stores under way: one a kind of promise and a few unions. A driver that
/// answers none of them is broken, and the peer goes silent rather than lie.
pub const MAX_STORES: usize = 32;

/// Most plans under way: one ground a mission revision, one division a round.
pub const MAX_PLANS: usize = 8;

/// How often a peer looks at its deadlines, as a fraction of the beacon period.
pub const CADENCE: u64 = 4;

/// What waits for a store to become durable.
#[derive(Clone, Debug)]
pub(crate) enum Promise {
    /// A life.
    Life(Incarnation),
    /// A bid.
    Bid(Box<crate::wire::message::Snapshot>),
    /// An adoption, and which of the sections written it is.
    Adopt(u64, Box<crate::coverage::negotiation::Adoption>),
    /// Cells taken without a round, likewise.
    Take(u64, Vec<PlanCell>),
    /// Coverage; nothing waits for it.
    Union,
}

/// What waits for an answer of the planner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Asked {
    /// The common ground of the mission with this hash.
    Ground(u64),
    /// A division of this epoch.
    Division(Epoch),
}

/// The mind of one peer. The contract is at the top of the crate.
#[derive(Debug)]
pub struct Peer {
    pub(crate) config: PeerConfig,
    pub(crate) now: Time,
    pub(crate) started: bool,
    pub(crate) boot: boot::Boot,
    pub(crate) rng: ChaCha8Rng,
    pub(crate) membership: Membership,
    pub(crate) relay: Relay,
    pub(crate) library: Library,
    pub(crate) voice: Voice,
    pub(crate) crew: Option<Crew>,
    pub(crate) order: Ordered,
    pub(crate) percept: Option<Percept>,
    pub(crate) durable: Durable,
    pub(crate) outputs: VecDeque<Output>,
    next_token: u64,
    stores: BTreeMap<u64, (Promise, Entry)>,
    plans: BTreeMap<u64, Asked>,
    next_look: Time,
}

/// The operator's standing order and the version of the record that gave it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Ordered {
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
            voice: Voice::default(),
            crew: None,
            order: Ordered {
                order: Order::Resume,
                version: (0, 0, 0),
            },
            percept: None,
            durable: Durable::default(),
            outputs: VecDeque::new(),
            next_token: 1,
            stores: BTreeMap::new(),
            plans: BTreeMap::new(),
            next_look: Time(0),
            now: Time(0),
            started: false,
            boot: boot::Boot::default(),
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
                self.next_look = self.now;
                boot::start(self, &persisted, nonce);
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
            } => ear::hear(self, transmitter, hops, &bytes),
            Input::Timer => {}
            Input::LinkHint { neighbour, up } => self.membership.link(neighbour, up),
            Input::Stored { token, ok } => self.on_stored(token, ok),
            Input::Planned { token, answer } => self.on_planned(token, answer),
            Input::Command(command) => self.on_command(&command),
        }
        self.look();
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
        let mut next = self.next_look.min(self.voice.next_beacon);
        if let Some(t) = self.relay.next_timeout(self.now) {
            next = next.min(t);
        }
        Some(next.max(self.now.plus_ms(1)))
    }

    /// The deadlines that are due, then whatever may be sent now.
    fn look(&mut self) {
        if self.now >= self.next_look {
            self.next_look = self.now.plus_ms(self.period_ms() / CADENCE);
            boot::look(self);
            let changes = self.membership.tick(self.now);
            ear::on_changes(self, changes);
            cooperation::look(self);
            voice::look(self);
        }
        if self.now >= self.voice.next_beacon {
            voice::beacon(self);
        }
        voice::send(self);
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
            Promise::Life(incarnation) => boot::lives(self, incarnation),
            Promise::Bid(snapshot) => cooperation::bid_is_durable(self, *snapshot),
            Promise::Adopt(written, adoption) => cooperation::adopt(self, written, &adoption),
            Promise::Take(written, cells) => cooperation::take(self, written, &cells),
            Promise::Union => {}
        }
    }

    fn on_planned(&mut self, token: u64, answer: Answer) {
        match (self.plans.remove(&token), answer) {
            (Some(Asked::Ground(hash)), Answer::Ground(ground)) => {
                cooperation::grounded(self, hash, ground)
            }
            (Some(Asked::Division(epoch)), Answer::Divide(division)) => {
                cooperation::divided(self, epoch, &division);
            }
            _ => {}
        }
    }

    fn on_command(&mut self, command: &Command) {
        if self.config.role != Role::Ground {
            self.alarm("a command reached a peer that is no ground station; it was ignored");
            return;
        }
        match command {
            Command::Mission(mission) => {
                self.library.offer(mission.clone());
                voice::speak_mission(self);
            }
            Command::Resume => voice::speak_order(self, Order::Resume),
            Command::Hold => voice::speak_order(self, Order::Hold),
            Command::ReturnToBase => voice::speak_order(self, Order::ReturnToBase),
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
    pub(crate) fn ask(&mut self, asked: Asked, problem: Problem) {
        if self.plans.len() < MAX_PLANS && !self.plans.values().any(|a| *a == asked) {
            let token = self.token();
            self.outputs.push_back(Output::Plan { token, problem });
            self.plans.insert(token, asked);
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

    /// A copy of what it believes.
    #[must_use]
    pub fn view(&self) -> View {
        let mut view = View {
            incarnation: self.boot.incarnation,
            speaks: self.boot.speaks(self.now),
            diameter: self.membership.diameter(self.now),
            ..View::default()
        };
        for (id, incarnation, status) in self.membership.all() {
            view.peers.insert(PeerId(id), (incarnation, status));
        }
        view.loads.push(("stores", self.stores.len(), MAX_STORES));
        view.loads.push(("plans", self.plans.len(), MAX_PLANS));
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
