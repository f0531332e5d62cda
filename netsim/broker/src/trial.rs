//! A trial: launch the peers, run the world around them, inject the faults, judge.

use crate::control::{Control, Request};
use crate::error::{TrialError, io};
use crate::faults::{Injector, Schedule};
use crate::live_world::LiveWorld;
use crate::looked_for::LookedFor;
use crate::observed::Observed;
use crate::pacer::{Due, Pacer, STEP_MS};
use crate::peers::{Clock, Peers, Said};
use crate::process::Used;
use crate::registry::{ConsoleEntry, Entry, Registered, private_dir, shared_dir};
use skein_console::{Answer, Asked, Token};
use skein_netsim::account::{
    Account, Cause, Details, Ending, Live, Processes, RunReport, Setting, secs,
};
use skein_netsim::fault::Fault;
use skein_netsim::spec::Spec;
use skein_netsim::witnessed::{AskedLook, Witnessed};
use skein_netsim::world::{Fact, Loss, Survey};
use skein_peer::input::AskedTask;
use skein_peer::offload::MissionGeometry;
use skein_peer::output::TaskNews;
use skein_peer::witness::Witness;
use skein_peer::{Call, Mission, Report};
use skein_recording::Sink;
use skein_recording::run_dir::{self, Manifest};
use skein_recording::writer::Writer;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use tokio::time::Instant;

/// How long UAVs may take to derive the loop of the mission before time begins
/// without them: they share two cores, and a square kilometre takes a debug build
/// some seconds each.
const READY_TIMEOUT: Duration = Duration::from_secs(45);

/// How often progress is told, milliseconds of scenario time.
const PROGRESS_MS: u64 = 10_000;

/// How often it is looked at how late transmissions come, milliseconds of scenario time: as
/// often as nodes tell.
const LOOK_MS: u64 = 1_000;

/// Once all live UAVs believe the mission finished nobody looks for more; after this
/// long, milliseconds of scenario time, what was not seen by then never will be. Long
/// enough for somebody to learn that it was wrong.
const IDLE_MS: u64 = 30_000;

/// After a mission was cancelled the operator may submit another one for so long, milliseconds
/// of scenario time: all fly home meanwhile.
const CANCELLED_IDLE_MS: u64 = 120_000;

/// What a trial is to be.
#[derive(Debug)]
pub struct Options {
    /// The scenario.
    pub spec: Spec,
    /// What was derived from its mission.
    pub geometry: Arc<MissionGeometry>,
    /// Seed of the run.
    pub seed: u64,
    /// Where to keep everything; a directory of its own if not given.
    pub run_dir: Option<PathBuf>,
    /// This program's own file, which peers run.
    pub program: PathBuf,
    /// Who looks at it, besides.
    pub sinks: Vec<Box<dyn Sink>>,
    /// What its run directory says of it.
    pub manifest: Manifest,
}

/// Run directories of passed trials that are kept, the newest; a helsinki takes some MB.
const KEPT_TRIALS: usize = 10;

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
    /// UAVs that believe the mission finished.
    pub finished: usize,
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
) -> Result<RunReport, TrialError> {
    let (keep, disposable) = (options.run_dir.is_some(), options.run_dir.is_none());
    let manifest = options.manifest.clone();
    let mut trial = Trial::prepare(options, tell).await?;
    let flown = tokio::select! {
        flown = trial.fly() => flown,
        () = stop => Err(TrialError::Interrupted),
    };
    let wall = trial.began.elapsed();
    let used = trial.peers.used();
    let (radios, last) = trial.peers.end().await;
    for radio in radios {
        trial.account.radio(&radio);
    }
    for said in last {
        trial.take(Some(said));
    }
    trial.judge_witnessed();
    let result = flown.map(|()| trial.conclude(wall, &used));
    if let Ok(report) = &result {
        trial.observed.tell(|o| o.end(report));
    }
    let run_dir = trial.run_dir.clone();
    trial.close().await;
    let Ok(report) = &result else {
        if !keep {
            let _ = std::fs::remove_dir_all(&run_dir);
        }
        return result;
    };
    let disposable = disposable && report.passed;
    let manifest = Manifest {
        disposable,
        ..manifest
    };
    manifest
        .conclude(&run_dir, report)
        .map_err(io(run_dir.display().to_string()))?;
    if disposable {
        run_dir::strip(&run_dir);
        run_dir::prune(&shared_dir()?, KEPT_TRIALS);
    }
    result
}

struct Trial<'a> {
    spec: Spec,
    run_dir: PathBuf,
    peers: Peers,
    world: LiveWorld,
    faults: Schedule,
    account: Account,
    observed: Observed,
    pacer: Pacer,
    control: Control,
    registered: Registered,
    began: Instant,
    now_ms: u64,
    progress_due_ms: u64,
    all_finished_ms: Option<u64>,
    /// Whether the operator ended the mission that is judged.
    cancelled: bool,
    /// Whether the mission that is judged ends by its time.
    timed: bool,
    /// What the mission looks for.
    looked_for: LookedFor,
    /// Tasks of which the operator is to say that services on the ground are there, by name.
    served: BTreeSet<String>,
    /// What peers say of what they see.
    witnessed: Witnessed,
    /// The mission that is judged.
    mission: Arc<Mission>,
    /// Transmissions that reached a node since it was last looked at, and late ones.
    transmissions: (u64, u64),
    /// Setpoints that arrived.
    setpoints: u64,
    /// How often an airframe loitered by itself although its computer ran.
    starved: u64,
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
            geometry,
            seed,
            run_dir,
            program,
            mut sinks,
            manifest,
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
        manifest
            .write(&run_dir)
            .map_err(io(run_dir.display().to_string()))?;
        let recording = run_dir.join(run_dir::RECORDING);
        let writer = Writer::create(&recording).map_err(io(recording.display().to_string()))?;
        sinks.push(Box::new(writer));
        let token = Token::draw()?;
        let control = Control::listen(0, token.clone())
            .await
            .map_err(io("the control port"))?;
        let registered = Registered::enter(Entry {
            id: id.clone(),
            pid: std::process::id(),
            control: control.address(),
            token: token.secret().to_owned(),
            run_dir: run_dir.clone(),
            observe: None,
            console: None,
            consoles: BTreeMap::new(),
            fleet: spec.fleet.clone(),
        })?;
        let peers = Peers::prepare(&spec, seed, &run_dir, &program, token.secret()).await?;
        tell(Event::Begun {
            id,
            run_dir: run_dir.clone(),
        });
        Ok(Self {
            peers,
            world: LiveWorld::new(&spec, &geometry, seed),
            faults: Schedule::new(&spec.faults),
            observed: Observed::new(&spec, &geometry, seed, sinks)
                .map_err(io("the thread of those who look at it"))?,
            account: Account::new(Setting::new(&spec, Some(&geometry), seed)),
            pacer: Pacer::new(spec.time_scale, Instant::now()),
            control,
            registered,
            began: Instant::now(),
            now_ms: 0,
            progress_due_ms: 0,
            all_finished_ms: None,
            cancelled: false,
            timed: geometry.mission.ends_after_s().is_some(),
            looked_for: LookedFor::new(&geometry.mission),
            served: BTreeSet::new(),
            witnessed: Witnessed::new(&spec, &geometry.mission),
            mission: Arc::clone(&geometry.mission),
            transmissions: (0, 0),
            setpoints: 0,
            starved: 0,
            spec,
            run_dir,
            tell,
        })
    }

    /// Launches everybody, and runs the world until the mission is over.
    async fn fly(&mut self) -> Result<(), TrialError> {
        self.launch().await?;
        let brought = self.mission.brought(false);
        self.asked(&brought);
        self.began = Instant::now();
        self.pacer = Pacer::new(self.spec.time_scale, self.began);
        loop {
            tokio::select! {
                Some(heard) = self.peers.next() => {
                    let said = self.peers.take(heard, self.clock());
                    self.take(said);
                }
                Some(asked) = self.control.next() => self.answer(asked).await,
                () = tokio::time::sleep_until(self.pacer.next()) => {
                    if !self.may_step() {
                        continue;
                    }
                    self.carry_out_due().await;
                    self.step();
                    if self.is_over() {
                        for missed in self.faults.missed() {
                            self.account.failed(missed);
                        }
                        return Ok(());
                    }
                    if self.pacer.stepped(Instant::now()) {
                        self.note_slow("the world is behind");
                    }
                }
            }
        }
    }

    /// Starts everybody, and waits until all UAVs have derived the loop of their mission:
    /// nobody launches an airframe whose computer is still busy starting, and here all
    /// computers share one machine. Time stands still meanwhile.
    async fn launch(&mut self) -> Result<(), TrialError> {
        self.peers.start_all()?;
        let uavs = self.spec.uavs.iter().map(|u| u.id);
        for id in uavs.chain(self.spec.ground.iter().map(|g| g.id)) {
            self.account.started(self.now_ms, id);
        }
        for said in self.peers.wait_for_all(self.clock()).await? {
            self.take(Some(said));
        }
        let deadline = Instant::now() + READY_TIMEOUT;
        let ready = |account: &Account| {
            let live = account.live_uavs();
            live.iter().all(|id| account.is_ready(*id))
        };
        while !ready(&self.account) {
            match tokio::time::timeout_at(deadline, self.peers.next()).await {
                Ok(Some(heard)) => {
                    let said = self.peers.take(heard, self.clock());
                    self.take(said);
                }
                Ok(None) | Err(_) => {
                    let text = "not all UAVs are ready; time begins all the same";
                    self.note(text.to_owned());
                    return Ok(());
                }
            }
        }
        self.peers.all_answer();
        Ok(())
    }

    fn clock(&self) -> Clock {
        Clock {
            now_ms: self.now_ms,
            scale: self.pacer.scale(),
        }
    }

    /// Takes what a peer said.
    fn take(&mut self, said: Option<Said>) {
        match said {
            None => {}
            Some(Said::Up {
                id,
                locator,
                console,
            }) => {
                self.observable(id, locator);
                if let Some(console) = console {
                    self.operable(id, console);
                }
            }
            Some(Said::Setpoint { id, setpoint, runs }) => {
                if runs {
                    self.setpoints += 1;
                    let delay_ms = self.now_ms.saturating_sub(setpoint.from_ms);
                    self.pacer.answered(delay_ms);
                }
                self.world.apply(id, setpoint);
            }
            Some(Said::Heard { arrived, late }) => {
                self.transmissions.0 += arrived;
                self.transmissions.1 += late;
            }
            Some(Said::Report { id, report }) => {
                match &report {
                    Report::Ready { revision, .. } => self.world.follows(id, *revision),
                    Report::Revised { mission } => self.revise(mission, "the operator gives"),
                    Report::Found { mission } => self.found(mission),
                    Report::Detected { id: task, told } if task.author == id => {
                        let at = (self.now_ms, id);
                        let truth = self.world.world().vehicles().truth();
                        let wrong = self.looked_for.told(at, (*task, told), truth);
                        wrong.into_iter().for_each(|text| self.account.failed(text));
                        self.account.detected(self.looked_for.reports());
                    }
                    Report::Crowd { told } => {
                        let is_ground = self.spec.ground.as_ref().is_some_and(|g| g.id == id);
                        self.witnessed.alerted((self.now_ms, id, is_ground), told);
                    }
                    Report::Task { id: task, news, .. } if *news == TaskNews::Follows => {
                        self.looked_for.follows(self.now_ms, *task);
                        self.account.detected(self.looked_for.reports());
                    }
                    _ => {}
                }
                self.observed.reported(self.now_ms, id, &report);
                if let Some(line) = self.account.reported(self.now_ms, id, &report) {
                    self.note(line);
                }
            }
            Some(Said::Witness { id, witness }) => self.witness(id, witness),
            Some(Said::Radio(radio)) => self.account.radio(&radio),
            Some(Said::Crashed { id, radio, why }) => {
                self.account.radio(&radio);
                self.account.ended(self.now_ms, id, Cause::Crashed);
                self.observed.tell(|o| o.ended(self.now_ms, id, false));
                let text = format!("{} ended by itself: {why}", self.peers.name(id));
                self.account.failed(text.clone());
                self.note(text);
            }
            Some(Said::Wrong(text)) => self.account.failed(text),
        }
    }

    /// A peer knows of obstacles that are on no map.
    fn found(&mut self, mission: &Arc<Mission>) {
        let is_lap = || self.mission.later_lap(mission.revision).as_ref() == Some(&**mission);
        if mission.revision > self.mission.revision && !is_lap() {
            self.revise(mission, "obstacles are found:");
        }
    }

    /// The operator gave another mission: it is judged by from now on. Time stands still while
    /// its site is surveyed.
    fn revise(&mut self, mission: &Arc<Mission>, why: &str) {
        let surveyed = tokio::task::block_in_place(|| {
            let geometry = skein_netsim::geometry_of(mission).map_err(|e| e.to_string())?;
            let survey = Survey::of_mission(&self.spec, mission).map_err(|e| e.to_string())?;
            Ok::<_, String>((
                survey.left_out(&geometry).len(),
                survey.as_planned(&geometry),
                geometry,
            ))
        });
        match surveyed {
            // The ground station checked it before it spoke.
            Err(why) => self.note(format!("a mission cannot be judged: {why}")),
            Ok((left_out, survey, geometry)) => {
                self.world.revise(Arc::new(survey), &geometry);
                self.observed.tell(|o| o.given(&geometry));
                self.account.revised();
                self.cancelled = mission.cancelled;
                self.timed = mission.ends_after_s().is_some();
                self.looked_for.given(mission);
                self.witnessed.given(mission);
                self.mission = Arc::clone(mission);
                self.asked(&mission.brought(false));
                // Whoever believed the last one finished has not begun this one.
                self.all_finished_ms = None;
                let mut text = format!("{why} revision {}", mission.revision);
                if left_out > 0 {
                    let _ = write!(
                        text,
                        "; {left_out} cells that could be seen are left out by the planner and not asked for"
                    );
                }
                self.note(text);
            }
        }
    }

    /// A peer says what it sees or knows.
    fn witness(&mut self, id: u16, witness: Witness) {
        match witness {
            Witness::Looked(looked) => self.witnessed.looked(id, *looked),
            Witness::Known(known) => {
                if known.is_ground {
                    self.asked(&known.tasks);
                    self.call(id, &known.calls);
                }
                self.witnessed.knows(id, *known);
            }
        }
    }

    /// The ground station calls services on the ground; its operator will say of those that are
    /// served that they are.
    fn call(&mut self, station: u16, calls: &[Call]) {
        for call in self.world.dispatch(calls) {
            let task = (call.task, call.revision);
            self.looked_for.served((self.now_ms, station), task);
            self.account.detected(self.looked_for.reports());
            self.served.insert(call.name);
        }
    }

    /// Tasks that the ground station holds, or the mission brings.
    fn asked(&mut self, tasks: &[AskedTask]) {
        for asked in tasks {
            self.account.asked(self.now_ms, asked);
            self.witnessed.asked(asked);
            if let Some(look) = AskedLook::of(&self.spec, &self.mission, asked) {
                let since_ms = self.now_ms.saturating_sub(asked.age_ms);
                self.world.ask(look, since_ms);
            }
        }
    }

    /// The run is over: what peers said last is judged, and all of it goes into the account.
    fn judge_witnessed(&mut self) {
        self.witnessed.end(self.now_ms, self.world.world());
        self.note_broken();
        self.account.counted(self.witnessed.counts(self.now_ms));
        self.account.used(self.witnessed.streets());
        self.account.gathered(self.witnessed.crowd());
        self.account.traced(self.witnessed.contour());
        for (task, tracked) in self.witnessed.tracked() {
            self.account.tracked(task, tracked);
        }
    }

    /// Rules that were broken fail the trial.
    fn note_broken(&mut self) {
        for text in self.witnessed.broken() {
            self.account.failed(text.clone());
            self.note(text);
        }
    }

    /// Observers attach to the ground station, or to the first UAV where there is none.
    fn observable(&mut self, id: u16, locator: String) {
        let ground = self.spec.ground.as_ref().map(|g| g.id);
        let observed = ground.or_else(|| self.spec.uavs.first().map(|u| u.id));
        if observed == Some(id)
            && let Err(cause) = self.registered.observe_at(locator)
        {
            tracing::warn!(%cause, "observers will not find this trial");
        }
    }

    /// Orders and missions enter at the ground station's console; any peer tells at its own what
    /// it does.
    fn operable(&mut self, id: u16, console: ConsoleEntry) {
        let station = self.spec.ground.as_ref().map(|g| g.id);
        if let Err(cause) = self.registered.console_at(id, station == Some(id), console) {
            tracing::warn!(%cause, id, "this peer of the trial will not be found");
        }
    }

    /// Whether the world may move on: it stands still while UAVs owe answers, so that a slow
    /// machine flies the same mission slower.
    fn may_step(&mut self) -> bool {
        let owed_ms = self.peers.owed_ms(self.now_ms);
        match self.pacer.due(Instant::now(), owed_ms) {
            Due::Step => true,
            Due::Hold => {
                if self.pacer.starved() {
                    self.note_slow("peers answer late");
                }
                false
            }
            Due::Abandon => {
                let who = self.peers.excuse_all();
                self.note(format!("time goes on without an answer of {who:?}"));
                self.pacer.due(Instant::now(), 0) == Due::Step
            }
        }
    }

    /// One step of the world.
    fn step(&mut self) {
        self.now_ms += STEP_MS;
        for fact in self.world.advance(self.now_ms) {
            self.fact(&fact);
        }
        if self.world.judge().complete() {
            self.all_covered();
        }
        let components = self.world.components(|id| self.peers.on_air(id));
        self.observed
            .tell(|o| o.connected(self.now_ms, &components));
        self.observed
            .stepped(self.now_ms, &self.world, &|id| self.peers.on_air(id));
        if let Some(text) = self.account.connected(&components) {
            self.note(text);
        }
        let period_ms = self.spec.percept_period_ms;
        for uav in self.peers.tell(self.clock(), &self.world, period_ms) {
            self.witnessed.sensed(self.now_ms, uav, self.world.world());
        }
        self.witnessed.stepped(self.now_ms, self.world.world());
        self.note_broken();
        if self.now_ms.is_multiple_of(LOOK_MS) {
            let (arrived, late) = std::mem::take(&mut self.transmissions);
            if self.pacer.heard(arrived, late) {
                self.note_slow("transmissions come late");
            }
        }
        if self.now_ms >= self.progress_due_ms {
            self.progress_due_ms = self.now_ms + PROGRESS_MS;
            let progress = self.progress();
            (self.tell)(Event::Progress(progress));
        }
    }

    /// What truly happened in the world.
    fn fact(&mut self, fact: &Fact) {
        self.observed.fact(self.now_ms, fact);
        if let Some(text) = self.account.happened(self.now_ms, fact) {
            self.note(text);
        }
        match fact {
            Fact::Lost { uav, cause, .. } if *cause != Loss::Killed => {
                if let Ok(peer) = self.peers.known(*uav) {
                    peer.lose_airframe();
                }
            }
            Fact::Failsafe { uav, on: true, .. } if self.peers.on_air(*uav) => {
                self.starved += 1;
                self.note(format!(
                    "uav{uav} got no setpoint for too long and loiters by itself"
                ));
                if self.pacer.starved() {
                    self.note_slow("computers are starved");
                }
            }
            _ => {}
        }
    }

    fn note(&mut self, text: String) {
        (self.tell)(Event::Note {
            time_s: secs(self.now_ms),
            text,
        });
    }

    fn note_slow(&mut self, why: &str) {
        let scale = self.pacer.scale();
        self.note(format!(
            "the machine is too slow ({why}); time runs at x{scale:.1} for now"
        ));
    }

    fn progress(&self) -> Progress {
        let alive = self.account.live_uavs();
        Progress {
            time_s: secs(self.now_ms),
            scale: self.pacer.scale(),
            covered: self.world.judge().covered_share(),
            components: self.account.n_components(),
            taken_over: self.account.taken_over(),
            finished: alive
                .iter()
                .filter(|id| self.account.is_finished(**id))
                .count(),
            alive,
        }
    }

    /// All of the mission is seen, or its time is over.
    fn all_covered(&mut self) {
        self.account.covered(self.now_ms);
        self.observed.tell(|o| o.all_covered(self.now_ms));
    }

    fn is_over(&mut self) -> bool {
        let live = self.account.live_uavs();
        let finished = live.iter().all(|id| self.account.is_through(*id));
        let open = self.account.covered_ms().is_none();
        if self.timed && open && finished && !live.is_empty() {
            if self.world.end_laps() {
                self.all_covered();
            } else if self.looked_for.brings()
                && live.iter().all(|id| self.account.is_finished(*id))
            {
                self.account.over(self.now_ms);
            }
        }
        if open && finished && !live.is_empty() && self.looked_for.ends_it() {
            self.account.found(self.now_ms);
            self.all_covered();
        }
        self.all_finished_ms = finished.then(|| self.all_finished_ms.unwrap_or(self.now_ms));
        let longest_ms = if self.cancelled {
            CANCELLED_IDLE_MS
        } else {
            IDLE_MS
        };
        let idle = self
            .all_finished_ms
            .is_some_and(|since| self.now_ms - since >= longest_ms);
        let done = finished && self.account.covered_ms().is_some() && !self.cancelled;
        let waits = self.looked_for.waits(self.now_ms) && !live.is_empty();
        (done || idle) && !waits
            || live.is_empty()
            || self.now_ms >= u64::from(self.spec.max_time_s) * 1000
    }

    async fn answer(&mut self, asked: Asked<Request>) {
        self.faults.note_by_hand();
        let answer: Answer = match asked.request {
            Request::Fault(fault) => self.inject(&fault).await,
            Request::Later(faults) => self.faults.later(self.now_ms, faults),
        };
        // Who asked may have gone away.
        let _ = asked.answer.send(answer);
    }

    /// Carries out what is due by now, in the order of the times.
    async fn carry_out_due(&mut self) {
        for name in std::mem::take(&mut self.served) {
            // Where it is not heard the ground station will call again.
            if let Err(why) = self.inject(&Fault::DoneTask { name }).await {
                self.note(format!(
                    "the ground station was not told that services are there: {why}"
                ));
            }
        }
        while let Some((fault, needed)) = self.faults.take_due(self.now_ms) {
            if let Err(why) = self.inject(&fault).await {
                let text = format!("a fault could not be carried out: {fault:?}: {why}");
                self.note(text.clone());
                if needed {
                    self.account.failed(text);
                }
            }
        }
    }

    async fn inject(&mut self, fault: &Fault) -> Answer {
        let ground = self.spec.ground.as_ref().map(|g| g.id);
        let mut injector = Injector {
            peers: &mut self.peers,
            world: &mut self.world,
            account: &mut self.account,
            console: ground.zip(self.registered.console()),
            now_ms: self.now_ms,
            period_s: f64::from(self.spec.beacon_period_ms) / 1000.0,
        };
        let lines = injector.inject(fault).await?;
        self.observed.fault(self.now_ms, fault);
        if let Some(text) = lines.first() {
            self.note(text.clone());
        }
        Ok(lines)
    }

    /// Draws up the report; call it when everybody is gone.
    fn conclude(&self, wall: Duration, used: &[Used]) -> RunReport {
        self.account.conclude(Ending {
            now_ms: self.now_ms,
            judge: self.world.judge(),
            nearest_intruder_m: self.world.intruders().nearest_m(),
            nearest_obstacle_m: self.world.unmapped().nearest_m(),
            link_cuts: self.world.link_cuts(),
            violations: None,
            details: Details::Live(Live {
                wall_s: wall.as_secs_f64(),
                time_scale: self.spec.time_scale,
                mean_time_scale: secs(self.now_ms) / wall.as_secs_f64().max(1e-3),
                lowest_time_scale: self.pacer.lowest(),
                held_s: self.pacer.held().as_secs_f64(),
                setpoint_delay_ms: self.pacer.longest_delay_ms(),
                setpoints: self.setpoints,
                starved: self.starved,
                processes: used_by(used),
            }),
        })
    }

    /// Ends the guard, and waits until everything that was said is on the disk.
    async fn close(self) {
        self.peers.close().await;
        tokio::task::block_in_place(|| self.observed.close());
    }
}

/// What the peers' processes used, and this one.
fn used_by(peers: &[Used]) -> Processes {
    let n = peers.len().max(1) as f64;
    let mean = |of: fn(&Used) -> f64| peers.iter().map(of).sum::<f64>() / n;
    let max = |of: fn(&Used) -> f64| peers.iter().map(of).fold(0.0, f64::max);
    Processes {
        counted: peers.len(),
        cpu_s_mean: mean(|u| u.cpu_s),
        cpu_s_max: max(|u| u.cpu_s),
        peak_mb_mean: mean(|u| u.peak_mb),
        peak_mb_max: max(|u| u.peak_mb),
        trial_cpu_s: Used::of(std::process::id()).map_or(0.0, |u| u.cpu_s),
    }
}
