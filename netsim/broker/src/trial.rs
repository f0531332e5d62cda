//! A trial: launch the peers, run the world around them, inject the faults, judge.

use crate::control::{Control, Request};
use crate::ledger::{Ledger, secs};
use crate::live_world::LiveWorld;
use crate::member::{Computer, LEASE_MS, Member};
use crate::pacer::{Pacer, STEP_MS};
use crate::process::Processes;
use crate::proxy::Proxy;
use crate::registry::{Entry, Registered, RegistryError, private_dir, private_file, shared_dir};
use crate::stream::Streams;
use crate::verdict::Verdict;
use nix::sys::signal::Signal;
use skein_console::{Answer, Asked, Token, TokenError};
use skein_link::LinkState;
use skein_netsim::fault::TimedFault;
use skein_netsim::spec::Spec;
use skein_netsim::world::{Fact, Loss};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;
use tokio::time::Instant;

/// A link that has been down this long goes dark for the transports too: two leases,
/// so that a transport that loses a neighbour truly lost it.
const DARK_AFTER: Duration = Duration::from_millis(2 * LEASE_MS as u64);

/// How often progress is told, milliseconds of scenario time.
const PROGRESS_MS: u64 = 10_000;

/// Once all live UAVs hold the mission finished nobody looks for more; after this
/// long, milliseconds of scenario time, what was not seen by then never will be. Long
/// enough for somebody to learn that it was wrong.
const IDLE_MS: u64 = 30_000;

/// What a trial is to be.
#[derive(Debug)]
pub struct Options {
    /// The scenario.
    pub spec: Spec,
    /// Seed of the run.
    pub seed: u64,
    /// Where to keep everything; a directory of its own if not given.
    pub run_dir: Option<PathBuf>,
    /// This program's own file, which peers run.
    pub program: PathBuf,
}

/// Something that happened, for a person.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The trial has a name and a directory.
    Begun {
        /// Its name, for `--trial`.
        id: String,
        /// Its directory.
        run_dir: PathBuf,
    },
    /// How it stands.
    Progress(Progress),
    /// A line worth showing.
    Note {
        /// Scenario time, seconds.
        time_s: f64,
        /// What.
        text: String,
    },
}

/// How a trial stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Progress {
    /// Scenario time, seconds.
    pub time_s: f64,
    /// Scenario seconds per second at present.
    pub scale: f64,
    /// Share of the coverable cells that was seen, 0 to 1.
    pub covered: f64,
    /// UAVs that fly with a computer.
    pub alive: Vec<u16>,
    /// Parts of the swarm that cannot talk to each other.
    pub components: usize,
    /// Cells of dead peers taken over so far.
    pub taken_over: usize,
    /// UAVs that hold the mission finished.
    pub finished: usize,
}

/// Why a trial has no verdict.
#[derive(Debug, thiserror::Error)]
pub enum TrialError {
    /// A file or a socket failed.
    #[error("{what}: {cause}")]
    Io {
        /// Doing what.
        what: String,
        /// Why.
        cause: std::io::Error,
    },
    /// The directory shared with other commands failed.
    #[error(transparent)]
    Registry(#[from] RegistryError),
    /// There is no token for its ports.
    #[error(transparent)]
    Token(#[from] TokenError),
    /// A peer did not come up.
    #[error("uav{peer} did not start: {why}")]
    Launch {
        /// Which.
        peer: u16,
        /// Its last words.
        why: String,
    },
    /// The person at the keyboard had enough.
    #[error("interrupted; all peers are gone")]
    Interrupted,
}

pub(crate) fn io(what: impl Into<String>) -> impl FnOnce(std::io::Error) -> TrialError {
    let what = what.into();
    move |cause| TrialError::Io { what, cause }
}

/// Runs a trial to its end, or until `stop` does. Every process it started is gone
/// when it returns.
///
/// # Errors
/// When there is nothing to judge.
pub async fn run(
    options: Options,
    stop: impl Future<Output = ()>,
    tell: &mut (dyn FnMut(Event) + Send),
) -> Result<Verdict, TrialError> {
    let keep = options.run_dir.is_some();
    let mut trial = Trial::prepare(options, tell).await?;
    let flown = tokio::select! {
        flown = trial.fly() => flown,
        () = stop => Err(TrialError::Interrupted),
    };
    trial.flown = trial.began.elapsed();
    trial.end().await;
    let result = flown.map(|()| trial.verdict());
    if let Ok(verdict) = &result {
        let json = serde_json::to_vec_pretty(verdict).map_err(|e| io("verdict")(e.into()))?;
        private_file(&trial.run_dir.join("verdict.json"), &json)?;
    }
    trial
        .close(keep || result.as_ref().is_ok_and(|v| !v.passed))
        .await;
    result
}

/// A fault that has not happened yet.
#[derive(Clone, Debug)]
pub(crate) struct Due {
    /// What and when.
    pub(crate) timed: TimedFault,
    /// Whether the scenario wants it, so that the trial fails without it.
    pub(crate) scenario: bool,
}

/// The proxy of a pair and the state of its link.
#[derive(Debug)]
pub(crate) struct Pair {
    pub(crate) proxy: Proxy,
    down_since: Option<Instant>,
}

pub(crate) struct Trial<'a> {
    pub(crate) spec: Spec,
    pub(crate) seed: u64,
    pub(crate) world: LiveWorld,
    pub(crate) members: BTreeMap<u16, Member>,
    pub(crate) ledger: Ledger,
    pub(crate) processes: Option<Processes>,
    pub(crate) now_ms: u64,
    pub(crate) components: Vec<Vec<u16>>,
    pub(crate) pacer: Pacer,
    pub(crate) began: Instant,
    pub(crate) flown: Duration,
    pub(crate) setpoint_delay_ms: u64,
    pub(crate) pairs: BTreeMap<(u16, u16), Pair>,
    pub(crate) streams: Streams,
    pub(crate) control: Control,
    pub(crate) registered: Registered,
    pub(crate) run_dir: PathBuf,
    pub(crate) faults: Vec<Due>,
    pub(crate) progress_due_ms: u64,
    all_finished_ms: Option<u64>,
    tell: &'a mut (dyn FnMut(Event) + Send),
}

impl<'a> Trial<'a> {
    /// Opens every port and writes every file; starts only the guard.
    async fn prepare(
        options: Options,
        tell: &'a mut (dyn FnMut(Event) + Send),
    ) -> Result<Self, TrialError> {
        let Options {
            spec,
            seed,
            run_dir,
            program,
        } = options;
        let id = format!("{}-{}", spec.name, std::process::id());
        let run_dir = match run_dir {
            Some(dir) => dir,
            None => shared_dir()?.join(&id),
        };
        private_dir(&run_dir)?;
        let run_dir = run_dir
            .canonicalize()
            .map_err(io(run_dir.display().to_string()))?;
        let token = Token::draw()?;
        let streams = Streams::listen(token.secret().to_owned())
            .await
            .map_err(io("the vehicle streams"))?;
        let control = Control::listen(0, token.clone())
            .await
            .map_err(io("the control port"))?;
        let world = LiveWorld::new(&spec, seed);
        let entry = Entry {
            id: id.clone(),
            pid: std::process::id(),
            control: control.address(),
            token: token.secret().to_owned(),
            run_dir: run_dir.clone(),
            observe: None,
            console: None,
            fleet: spec.fleet.clone(),
        };
        let registered = Registered::enter(entry)?;
        let mut members: BTreeMap<u16, Member> = spec
            .uavs
            .iter()
            .map(|u| (u.id, Member::new(&run_dir, u.id, true)))
            .collect();
        if let Some(g) = &spec.ground {
            members.insert(g.id, Member::new(&run_dir, g.id, false));
        }
        let pairs = bind_pairs(&members).await.map_err(io("a link's proxy"))?;
        let mut trial = Self {
            ledger: Ledger::new(spec.uavs.len()),
            pacer: Pacer::new(spec.time_scale, Instant::now()),
            began: Instant::now(),
            flown: Duration::ZERO,
            processes: None,
            now_ms: 0,
            components: Vec::new(),
            setpoint_delay_ms: 0,
            progress_due_ms: 0,
            all_finished_ms: None,
            faults: spec
                .faults
                .iter()
                .map(|f| Due {
                    timed: f.clone(),
                    scenario: true,
                })
                .collect(),
            spec,
            seed,
            world,
            members,
            pairs,
            streams,
            control,
            registered,
            run_dir: run_dir.clone(),
            tell,
        };
        trial.write_configs(token.secret())?;
        trial.processes =
            Some(Processes::start(&program).map_err(io(program.display().to_string()))?);
        (trial.tell)(Event::Begun { id, run_dir });
        Ok(trial)
    }

    /// Launches everybody, and runs the world until the mission is over.
    async fn fly(&mut self) -> Result<(), TrialError> {
        self.launch().await?;
        self.began = Instant::now();
        self.pacer = Pacer::new(self.spec.time_scale, self.began);
        loop {
            tokio::select! {
                Some(heard) = self.streams.next() => self.hear(heard),
                Some(asked) = self.control.next() => self.answer(asked).await,
                () = tokio::time::sleep_until(self.pacer.next()) => {
                    self.carry_out_due().await;
                    self.step();
                    if self.is_over() {
                        self.name_missed();
                        return Ok(());
                    }
                    if self.pacer.stepped(Instant::now()) {
                        self.note_slow("the world is behind");
                    }
                }
            }
        }
    }

    /// One step of the world.
    fn step(&mut self) {
        self.now_ms += STEP_MS;
        for fact in self.world.advance(self.now_ms) {
            self.fact(&fact);
        }
        self.follow_links();
        let percepts_due = self
            .now_ms
            .is_multiple_of(u64::from(self.spec.percept_period_ms).max(STEP_MS));
        let (now_ms, scale) = (self.now_ms, self.pacer.scale());
        let ids: Vec<u16> = self.members.keys().copied().collect();
        for id in &ids {
            let row = self.row(*id, &ids);
            let percept = if percepts_due {
                self.world.percept(*id)
            } else {
                None
            };
            let Some(member) = self.members.get_mut(id) else {
                continue;
            };
            let Some(line) = &member.line else { continue };
            let links = (member.told.as_ref() != Some(&row)).then(|| row.clone());
            line.tick(
                now_ms,
                scale,
                percept.filter(|_| member.flies && member.airborne),
                links,
            );
            member.told = Some(row);
        }
        if now_ms >= self.progress_due_ms {
            self.progress_due_ms = now_ms + PROGRESS_MS;
            let progress = self.progress();
            (self.tell)(Event::Progress(progress));
        }
    }

    /// The links into `rx`.
    fn row(&self, rx: u16, ids: &[u16]) -> Vec<(u16, LinkState)> {
        let on_air = |id: &u16| self.members.get(id).is_some_and(Member::on_air);
        ids.iter()
            .filter(|tx| **tx != rx && on_air(tx))
            .map(|tx| (*tx, self.world.link(*tx, rx)))
            .collect()
    }

    /// Follows the true links: darkens the proxies of what stays down, and finds the
    /// components.
    fn follow_links(&mut self) {
        let now = Instant::now();
        for ((low, high), pair) in &mut self.pairs {
            let (there, back) = (self.world.link(*low, *high), self.world.link(*high, *low));
            // One way up keeps the transport, which can only carry both.
            if there.is_up() || back.is_up() {
                pair.down_since = None;
                pair.proxy.set_dark(false);
            } else {
                let since = *pair.down_since.get_or_insert(now);
                pair.proxy.set_dark(now.duration_since(since) > DARK_AFTER);
            }
        }
        self.components = self.world.components(|id| self.on_air(id));
        if let Some(text) = self.ledger.components(self.now_ms, &self.components) {
            self.note(text);
        }
    }

    /// Whether the radio of a peer works.
    pub(crate) fn on_air(&self, id: u16) -> bool {
        self.members.get(&id).is_some_and(Member::on_air)
    }

    /// What truly happened in the world.
    fn fact(&mut self, fact: &Fact) {
        match fact {
            Fact::ZoneEntry { uav, zone, .. } => {
                self.note(format!("uav{uav} entered no-fly zone {zone}"))
            }
            Fact::Lost { uav, cause, .. } if *cause != Loss::Killed => {
                let text = format!("uav{uav} is lost: {cause:?}");
                self.ledger.failures.push(text.clone());
                self.note(text);
                self.ledger.killed(self.now_ms, *uav, false);
                if let Some(member) = self.members.get_mut(uav) {
                    member.airborne = false;
                    member.computer = Computer::Off;
                    if let Some(process) = &mut member.process {
                        process.signal(Signal::SIGKILL);
                    }
                }
            }
            Fact::Failsafe { uav, on: true, .. } if self.on_air(*uav) => {
                self.note(format!(
                    "uav{uav} got no setpoint for too long and loiters by itself"
                ));
                if self.pacer.starved() {
                    self.note_slow("computers are starved");
                }
            }
            Fact::Seen { .. } | Fact::TooClose(_) | Fact::Lost { .. } | Fact::Failsafe { .. } => {}
        }
    }

    pub(crate) fn note(&mut self, text: String) {
        (self.tell)(Event::Note {
            time_s: secs(self.now_ms),
            text,
        });
    }

    pub(crate) fn note_slow(&mut self, why: &str) {
        let scale = self.pacer.scale();
        self.note(format!(
            "the machine is too slow ({why}); time runs at x{scale:.1} for now"
        ));
    }

    fn progress(&self) -> Progress {
        Progress {
            time_s: secs(self.now_ms),
            scale: self.pacer.scale(),
            covered: self.world.covered_share(),
            alive: self.live_uavs(),
            components: self.components.len(),
            taken_over: self.ledger.taken_over(),
            finished: self
                .live_uavs()
                .iter()
                .filter(|id| self.ledger.is_finished(**id))
                .count(),
        }
    }

    /// UAVs that fly with a computer that runs.
    pub(crate) fn live_uavs(&self) -> Vec<u16> {
        let live = |m: &&Member| m.flies && m.airborne && m.computer == Computer::Runs;
        self.members.values().filter(live).map(|m| m.id).collect()
    }

    fn is_over(&mut self) -> bool {
        let live = self.live_uavs();
        let finished = live.iter().all(|id| self.ledger.is_finished(*id));
        self.all_finished_ms = finished.then(|| self.all_finished_ms.unwrap_or(self.now_ms));
        let idle = self
            .all_finished_ms
            .is_some_and(|since| self.now_ms - since >= IDLE_MS);
        let done = finished && self.world.is_covered();
        done || idle || live.is_empty() || self.now_ms >= u64::from(self.spec.max_time_s) * 1000
    }

    async fn answer(&mut self, asked: Asked<Request>) {
        let answer: Answer = match asked.request {
            Request::Fault(fault) => self.inject(&fault).await,
            Request::Later(faults) => self.later(faults),
        };
        // Who asked may have gone away.
        let _ = asked.answer.send(answer);
    }
}

/// A proxy for each pair of peers.
async fn bind_pairs(
    members: &BTreeMap<u16, Member>,
) -> std::io::Result<BTreeMap<(u16, u16), Pair>> {
    let mut pairs = BTreeMap::new();
    for low in members.keys() {
        for high in members.keys().filter(|high| *high > low) {
            let pair = Pair {
                proxy: Proxy::bind().await?,
                down_since: None,
            };
            pairs.insert((*low, *high), pair);
        }
    }
    Ok(pairs)
}
