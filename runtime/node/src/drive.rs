//! The driver: wait for one thing, make it one input, drain the outputs (the
//! canonical loop of `skein_peer`; D2.7 §1.2: the layers of one UAV).
//!
//! It knows its surroundings by their traits alone: vehicle, world, console,
//! transport. Computing runs beside the loop, storing in its own thread; percept to
//! setpoint waits for neither. What the world tells goes first: nothing that came
//! later is given to the peer at an earlier time.
//!
//! The only thing decided here is what an operator is told ([`crate::console`]).

use crate::clock::Clock;
use crate::console::{Console, can_be_flown, edited, fits};
use crate::journal::{Journal, Stored};
use crate::outgoing::Frame;
use crate::radio::Radio;
use crate::standing::{Standing, StandingError};
use crate::transport::{Event, Transport};
use crate::vehicle::Vehicle;
use crate::world::{News, Tick, World};
use skein_behaviors::order::SINGLES_MAX;
use skein_behaviors::{Order, Orders, Percept};
use skein_console::{Answer, Asked, Command as Request};
use skein_peer::input::{OperatorsTasks, TaskEdit};
use skein_peer::mission::PointMm;
use skein_peer::offload::{Job, JobResult, run};
use skein_peer::witness::Witness;
use skein_peer::{Command, Incarnation, Input, Mission, Output, Peer, Time, Transmission};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::{mpsc, oneshot};

/// How often the radio's counters go to the world, milliseconds of scenario time.
const COUNTERS_PERIOD_MS: u64 = 1_000;

/// How often what the peer knows goes to the world, for its judge, milliseconds of scenario time.
const KNOWN_PERIOD_MS: u64 = 2_000;

/// Jobs under way at once: a peer asks for the next division only when the last
/// one is dead, and for the geometry once a revision.
const MAX_OPEN_JOBS: usize = 16;

/// Without anything else to wait for, look again after this long.
const IDLE: Duration = Duration::from_secs(3_600);

/// What the driver needs of a peer. [`Peer`] is the one that flies; a test has one
/// that does as it is told.
pub trait PeerLogic: Send {
    /// Takes one input.
    fn handle(&mut self, now: Time, input: Input);
    /// The next output of the last input.
    fn poll(&mut self) -> Option<Output>;
    /// When it wants [`Input::Timer`] at the latest.
    fn next_timeout(&self) -> Option<Time>;
    /// The life in which it speaks at present; none while it only listens.
    fn speaks_in(&self) -> Option<Incarnation>;
    /// The newest mission that it holds.
    fn mission(&self) -> Option<Arc<Mission>>;
    /// The revision that the operator's next mission must have to be flown.
    fn next_revision(&self) -> u32;
    /// Whether it is a ground station: any other is asked only what it does.
    fn is_ground_station(&self) -> bool;
    /// What the operator ordered last, as far as it was heard.
    fn orders(&self) -> Orders;
    /// Whether it has heard of a UAV with this number.
    fn knows_uav(&self, id: u16) -> bool;
    /// What it does and why, as JSON.
    fn why(&self) -> String;
    /// What it knows of the mission, as JSON; none without a mission.
    fn overview(&self) -> Option<String>;
    /// The quickest way between two places, as a line of JSON; a sentence where there is none.
    fn way(&self, from: PointMm, to: PointMm) -> Result<String, String>;
    /// Whether the operator's words on tasks can be carried out; a sentence that says why not.
    fn check_task(&self, edit: &TaskEdit) -> Result<(), String>;
    /// What its operator said of tasks.
    fn operators_tasks(&self) -> OperatorsTasks;
    /// A number that changes with that; 0 where it is nothing.
    fn tasks_version(&self) -> u64;
    /// What it says of its last percept, for a judge; none where there is nothing to judge.
    fn looked(&self) -> Option<Witness>;
    /// What it knows now, milliseconds of scenario time, likewise.
    fn known(&self, at_ms: u64) -> Option<Witness>;
}

impl PeerLogic for Peer {
    fn handle(&mut self, now: Time, input: Input) {
        Peer::handle(self, now, input);
    }

    fn poll(&mut self) -> Option<Output> {
        Peer::poll(self)
    }

    fn next_timeout(&self) -> Option<Time> {
        Peer::next_timeout(self)
    }

    fn speaks_in(&self) -> Option<Incarnation> {
        Peer::speaks_in(self)
    }

    fn orders(&self) -> Orders {
        Peer::orders(self).clone()
    }

    fn knows_uav(&self, id: u16) -> bool {
        Peer::knows_uav(self, id)
    }

    fn mission(&self) -> Option<Arc<Mission>> {
        Peer::mission(self)
    }

    fn next_revision(&self) -> u32 {
        Peer::next_revision(self)
    }

    fn is_ground_station(&self) -> bool {
        Peer::is_ground_station(self)
    }

    fn why(&self) -> String {
        // Numbers and names alone: nothing of it cannot be written.
        serde_json::to_string(&Peer::why(self)).unwrap_or_default()
    }

    fn overview(&self) -> Option<String> {
        serde_json::to_string(&Peer::overview(self)?).ok()
    }

    fn way(&self, from: PointMm, to: PointMm) -> Result<String, String> {
        let way = Peer::way(self, from, to).map_err(|e| e.to_string())?;
        serde_json::to_string(&way).map_err(|e| e.to_string())
    }

    fn check_task(&self, edit: &TaskEdit) -> Result<(), String> {
        Peer::check_task(self, edit)
    }

    fn operators_tasks(&self) -> OperatorsTasks {
        Peer::operators_tasks(self)
    }

    fn tasks_version(&self) -> u64 {
        Peer::tasks_version(self)
    }

    fn looked(&self) -> Option<Witness> {
        Peer::looked(self)
    }

    fn known(&self, at_ms: u64) -> Option<Witness> {
        Peer::known(self, at_ms)
    }
}

/// What is around a peer.
#[derive(Debug)]
pub struct Surroundings<V, W, C, T> {
    /// What it flies.
    pub vehicle: V,
    /// What rules its clock and its radio.
    pub world: W,
    /// Where the operator speaks.
    pub console: C,
    /// What carries its transmissions.
    pub transport: T,
}

/// What a driver keeps itself.
#[derive(Debug)]
pub struct Equipment {
    /// The peer's time.
    pub clock: Clock,
    /// What the air does to each message.
    pub radio: Radio,
    /// What must not be forgotten.
    pub journal: Journal,
    /// What the operator said last, where there is a console.
    pub standing: Option<Standing>,
}

/// A peer and everything it acts through.
#[derive(Debug)]
pub struct Driver<P, V, W, C, T> {
    peer: P,
    around: Surroundings<V, W, C, T>,
    clock: Clock,
    radio: Radio,
    journal: Journal,
    standing: Option<Standing>,
    results: mpsc::Receiver<(u64, JobResult)>,
    workers: mpsc::Sender<(u64, JobResult)>,
    verdicts: mpsc::Receiver<Feasibility>,
    checkers: mpsc::Sender<Feasibility>,
    checking: bool,
    orders: Option<Orders>,
    /// The life in which the orders were spoken.
    ordered_in: Option<Incarnation>,
    /// Whether the tasks that were kept were said in this process.
    tasks_told: bool,
    /// The version of the tasks that were kept last.
    tasks_kept: u64,
    /// Came while the clock stood still.
    early: Option<Event>,
    counters_due: Time,
    known_due: Time,
}

/// Whether a mission of the operator can be flown.
#[derive(Debug)]
struct Feasibility {
    mission: Mission,
    verdict: Result<(), String>,
    answer: oneshot::Sender<Answer>,
}

/// Something that happened.
enum Happened {
    World(News),
    Sensed(Box<Percept>),
    Stored(Stored),
    Computed(u64, JobResult),
    Asked(Asked<Request>),
    Checked(Box<Feasibility>),
    Transport(Event),
    Time,
}

impl<P, V, W, C, T> Driver<P, V, W, C, T>
where
    P: PeerLogic,
    V: Vehicle,
    W: World,
    C: Console,
    T: Transport,
{
    /// Puts the parts together.
    pub fn new(peer: P, around: Surroundings<V, W, C, T>, equipment: Equipment) -> Self {
        let (workers, results) = mpsc::channel(MAX_OPEN_JOBS);
        let (checkers, verdicts) = mpsc::channel(1);
        let Equipment {
            clock,
            radio,
            journal,
            standing,
        } = equipment;
        Self {
            peer,
            around,
            clock,
            radio,
            journal,
            results,
            workers,
            verdicts,
            checkers,
            checking: false,
            orders: standing.as_ref().and_then(Standing::orders),
            standing,
            ordered_in: None,
            tasks_told: false,
            tasks_kept: 0,
            early: None,
            counters_due: Time(0),
            known_due: Time(0),
        }
    }

    /// Runs from the first input until the world ends or `stop` does.
    pub async fn run(mut self, start: Input, stop: impl Future<Output = ()>) {
        tokio::pin!(stop);
        self.step(start).await;
        loop {
            let wait = self.wait();
            // While the clock stands still (after a pause of the process, say) messages
            // wait for the frame that tells how late it is: their ages count from then.
            let hears = self.early.is_none() && !self.clock.stands_still(Instant::now());
            let Surroundings {
                vehicle,
                world,
                console,
                transport,
            } = &mut self.around;
            let happened = tokio::select! {
                biased;
                () = &mut stop => break,
                news = world.next() => Happened::World(news),
                percept = vehicle.sense() => Happened::Sensed(Box::new(percept)),
                Some(stored) = self.journal.answer() => Happened::Stored(stored),
                Some((token, result)) = self.results.recv() => Happened::Computed(token, result),
                asked = console.next() => Happened::Asked(asked),
                Some(found) = self.verdicts.recv() => Happened::Checked(Box::new(found)),
                event = transport.next(), if hears => Happened::Transport(event),
                () = tokio::time::sleep(wait) => Happened::Time,
            };
            if !self.take(happened).await {
                break;
            }
            self.deliver().await;
            self.repeat_order().await;
            self.repeat_tasks().await;
            self.fire_timers().await;
            self.transmit().await;
        }
        self.leave().await;
    }

    /// How long nothing but the passing of time can be due.
    fn wait(&mut self) -> Duration {
        let due = [self.peer.next_timeout(), self.radio.next_due()];
        let due = due.into_iter().flatten().min();
        let at = Instant::now();
        // Where only a frame of the world can bring the time, the frame will wake us.
        due.and_then(|t| self.clock.wait_until(t, at))
            .unwrap_or(IDLE)
    }

    fn now(&mut self) -> Time {
        self.clock.now(Instant::now())
    }

    /// Makes one input of what happened; false when it is the end.
    async fn take(&mut self, happened: Happened) -> bool {
        match happened {
            Happened::World(News::End) => return false,
            Happened::World(News::Tick(tick)) => self.tick(tick).await,
            Happened::Sensed(percept) => {
                self.step(Input::Percept(*percept)).await;
                self.bear_witness(P::looked).await;
            }
            Happened::Stored(Stored { token, ok }) => self.step(Input::Stored { token, ok }).await,
            Happened::Computed(token, result) => self.step(Input::Computed { token, result }).await,
            Happened::Asked(asked) => self.asked(asked).await,
            Happened::Checked(found) => self.mission_checked(*found).await,
            Happened::Transport(event) => {
                if self.clock.stands_still(Instant::now()) {
                    self.early = Some(event);
                } else {
                    self.hear(event).await;
                }
            }
            Happened::Time => {}
        }
        true
    }

    async fn tick(&mut self, tick: Tick) {
        self.clock.tick(tick.time_ms, tick.scale, Instant::now());
        self.radio.tick(tick.scale, tick.links);
        if let Some(event) = self.early.take() {
            self.hear(event).await;
        }
        let now = self.now();
        if now >= self.counters_due {
            self.counters_due = now.plus_ms(COUNTERS_PERIOD_MS);
            self.count().await;
        }
        if now >= self.known_due {
            self.known_due = now.plus_ms(KNOWN_PERIOD_MS);
            self.tell_known(now).await;
        }
    }

    async fn tell_known(&mut self, now: Time) {
        self.bear_witness(|peer| peer.known(now.0)).await;
    }

    /// Tells the world's judge something of the peer; nothing is made up where there is none.
    async fn bear_witness(&mut self, of: impl FnOnce(&P) -> Option<Witness>) {
        if self.around.world.judges()
            && let Some(witness) = of(&self.peer)
        {
            self.around.world.witness(&witness).await;
        }
    }

    async fn count(&mut self) {
        let overrun = self.around.transport.overrun();
        let counters = self.radio.counters(overrun);
        self.around.world.count(counters).await;
    }

    /// What the transport brought meets the air.
    async fn hear(&mut self, event: Event) {
        match event {
            Event::Link { neighbour, up } => self.step(Input::LinkHint { neighbour, up }).await,
            Event::Heard {
                hop: Some(hop),
                key,
                bytes,
            } => {
                let now = self.now();
                self.radio.receive(now, hop, key, bytes);
            }
            Event::Heard { hop: None, .. } => self.radio.refuse(),
        }
    }

    /// Gives the peer what has arrived through the air.
    async fn deliver(&mut self) {
        let now = self.now();
        while let Some(arrived) = self.radio.due(now) {
            self.step(Input::Received {
                transmitter: arrived.transmitter,
                hops: arrived.hops,
                heard: Transmission::read(arrived.bytes).into(),
            })
            .await;
        }
    }

    /// Lets the peer look at its deadlines, if one is due.
    async fn fire_timers(&mut self) {
        let now = self.now();
        if self.peer.next_timeout().is_some_and(|due| due <= now) {
            self.step(Input::Timer).await;
        }
    }

    /// Sends what may be sent.
    async fn transmit(&mut self) {
        let now = self.now();
        while let Some((hop, frame)) = self.radio.to_send(now) {
            self.around
                .transport
                .publish(&frame.key, frame.bytes, hop, frame.priority)
                .await;
        }
    }

    /// One input, and everything that follows from it.
    async fn step(&mut self, input: Input) {
        let now = self.now();
        self.peer.handle(now, input);
        while let Some(output) = self.peer.poll() {
            self.act(now, output).await;
        }
    }

    async fn act(&mut self, now: Time, output: Output) {
        match output {
            Output::Publish {
                key,
                bytes,
                hops,
                priority,
                lifetime_ms,
            } => self.radio.say(
                now,
                Frame {
                    key,
                    bytes,
                    hops,
                    priority,
                    lifetime_ms,
                },
            ),
            Output::Setpoint(setpoint) => self.around.vehicle.fly(setpoint).await,
            Output::Store { token, record } => self.journal.store(token, record).await,
            Output::Compute { token, job } => self.compute(token, job),
            Output::Report(report) => {
                tracing::info!(time_ms = now.0, ?report);
                self.around.world.report(&report).await;
            }
        }
    }

    /// Does a job beside the loop.
    fn compute(&self, token: u64, job: Job) {
        let workers = self.workers.clone();
        tokio::task::spawn_blocking(move || {
            let result = run(&job);
            // A loop that has ended needs no result.
            let _ = workers.blocking_send((token, result));
        });
    }

    /// The operator wants something.
    async fn asked(&mut self, asked: Asked<Request>) {
        let Asked { request, answer } = asked;
        let told = match &request {
            Request::Why => Some(Ok(vec![self.peer.why()])),
            _ if !self.peer.is_ground_station() => {
                let why = "this peer is no ground station: it can be asked only what it does";
                Some(Err(why.to_owned()))
            }
            Request::Show => {
                let nothing = || "the ground station holds no mission".to_owned();
                Some(
                    self.peer
                        .overview()
                        .map(|line| vec![line])
                        .ok_or_else(nothing),
                )
            }
            Request::Hint(from, to) => Some(self.peer.way(*from, *to).map(|line| vec![line])),
            Request::Order(order) => Some(self.order(None, *order).await),
            Request::OrderOne(uav, order) => Some(self.order(Some(*uav), *order).await),
            Request::Task(edit) => Some(self.task(edit.clone()).await),
            _ => None,
        };
        if let Some(told) = told {
            // Who asked may have gone away; likewise below.
            return drop(answer.send(told));
        }
        let mission = edited(request, self.peer.mission().as_deref());
        let fitting = mission.and_then(|m| {
            fits(&m, self.peer.mission().as_deref())?;
            if self.checking {
                return Err("another mission is being checked; try again".to_owned());
            }
            Ok(m)
        });
        match fitting {
            Ok(mission) => self.check_mission(mission, answer),
            Err(why) => drop(answer.send(Err(why))),
        }
    }

    /// A new standing order, to one UAV or to all: kept, then spoken. A ground station has no
    /// percept that would wait for the disk.
    async fn order(&mut self, uav: Option<u16>, order: Order) -> Answer {
        let unknown = uav.filter(|id| !self.peer.knows_uav(*id));
        if let Some(id) = unknown {
            return Err(format!(
                "no UAV with the number {id} was heard of by this ground station"
            ));
        }
        // What stands is what was heard last; before it speaks, what was kept.
        let kept = self.orders.clone().filter(|_| self.ordered_in.is_none());
        let standing = kept.unwrap_or_else(|| self.peer.orders());
        let orders = standing.told(uav, order).ok_or_else(|| {
            format!("{SINGLES_MAX} UAVs are told something of their own; no more can be, until all are told something")
        })?;
        if let Some(standing) = &mut self.standing {
            standing.keep_orders(orders.clone()).map_err(unkept)?;
        }
        self.orders = Some(orders);
        self.ordered_in = None;
        self.repeat_order().await;
        let name = order.name();
        let whom = uav.map_or_else(|| "all".to_owned(), |id| format!("uav{id}"));
        Ok(vec![match self.ordered_in {
            Some(_) => format!("the ground station says {name} to {whom}"),
            None => format!(
                "the ground station will say {name} to {whom}, as soon as it has listened long enough to speak"
            ),
        }])
    }

    /// A task more or less: checked, spoken, and kept for the next start of this process.
    async fn task(&mut self, edit: TaskEdit) -> Answer {
        self.peer.check_task(&edit)?;
        let told = match &edit {
            TaskEdit::Add(_) => "asked for",
            TaskEdit::Cancel(_) => "cancelled",
            TaskEdit::Done(_) => "done",
            TaskEdit::Again(_) => {
                return Err("tasks are said again by the ground station itself".to_owned());
            }
        };
        let before: Vec<String> = self.names_of_tasks();
        self.step(Input::Command(Command::Task(edit.clone()))).await;
        self.keep_tasks()?;
        let added = self.names_of_tasks().into_iter();
        let added: Vec<String> = added.filter(|n| !before.contains(n)).collect();
        let name = match edit {
            TaskEdit::Cancel(name) | TaskEdit::Done(name) => name,
            TaskEdit::Add(task) => task.name.unwrap_or_else(|| added.join(", ")),
            TaskEdit::Again(_) => String::new(),
        };
        Ok(vec![format!("the task {name} is {told}")])
    }

    fn names_of_tasks(&self) -> Vec<String> {
        let tasks = self.peer.operators_tasks().asked.into_iter();
        let open = tasks.filter(|t| t.task.is_open());
        open.map(|t| t.task.name()).collect()
    }

    /// Keeps the operator's tasks, where they are others than before.
    fn keep_tasks(&mut self) -> Result<(), String> {
        let version = self.peer.tasks_version();
        if version == self.tasks_kept {
            return Ok(());
        }
        self.tasks_kept = version;
        let tasks = self.peer.operators_tasks();
        match &mut self.standing {
            Some(standing) => standing.keep_tasks(tasks).map_err(unkept),
            None => Ok(()),
        }
    }

    /// Tasks of before this process started are said again once it speaks; what became of
    /// them since is kept.
    async fn repeat_tasks(&mut self) {
        if self.peer.speaks_in().is_none() {
            return;
        }
        if !std::mem::replace(&mut self.tasks_told, true) {
            let tasks = self.standing.as_ref().map(Standing::tasks);
            if let Some(tasks) = tasks.filter(|t| !t.is_empty()) {
                let again = TaskEdit::Again(tasks);
                self.step(Input::Command(Command::Task(again))).await;
            }
        }
        if let Err(why) = self.keep_tasks() {
            tracing::warn!("{why}");
        }
    }

    /// Speaks the standing orders once in each life of the peer: what an earlier life
    /// said is void.
    async fn repeat_order(&mut self) {
        let life = self.peer.speaks_in();
        let is_new = life.is_some() && life != self.ordered_in;
        if let Some(orders) = self.orders.clone().filter(|_| is_new) {
            self.ordered_in = life;
            self.step(Input::Command(Command::Orders(orders))).await;
        }
    }

    /// Asks beside the loop whether a mission can be flown.
    fn check_mission(&mut self, mission: Mission, answer: oneshot::Sender<Answer>) {
        self.checking = true;
        let checkers = self.checkers.clone();
        tokio::task::spawn_blocking(move || {
            let mission = Arc::new(mission);
            let verdict = can_be_flown(&mission);
            let mission = Arc::unwrap_or_clone(mission);
            let _ = checkers.blocking_send(Feasibility {
                mission,
                verdict,
                answer,
            });
        });
    }

    async fn mission_checked(&mut self, found: Feasibility) {
        self.checking = false;
        let Feasibility {
            mission,
            verdict,
            answer,
        } = found;
        let told = match verdict {
            Err(why) => Err(format!("the mission cannot be flown: {why}")),
            Ok(()) => self.revise(mission).await,
        };
        let _ = answer.send(told);
    }

    /// The next revision of the mission: kept, then spoken.
    async fn revise(&mut self, mission: Mission) -> Answer {
        let revision = self.peer.next_revision();
        let mission = Arc::new(Mission {
            revision,
            ..mission
        });
        if let Some(standing) = &mut self.standing {
            standing
                .keep_mission(Arc::clone(&mission))
                .map_err(unkept)?;
        }
        self.step(Input::Command(Command::Mission(mission))).await;
        let mut told = vec![format!(
            "the ground station speaks the mission as revision {revision}"
        )];
        let standing = self.orders.as_ref();
        if let Some(orders) = standing.filter(|orders| **orders != Orders::default()) {
            told.push(format!(
                "the order {orders} stands; `skein mission resume` ends it"
            ));
        }
        Ok(told)
    }

    /// Flushes what is under way and says goodbye.
    async fn leave(mut self) {
        let now = self.now();
        self.tell_known(now).await;
        self.count().await;
        self.around.world.leave().await;
        self.around.transport.close().await;
        let _ = tokio::task::spawn_blocking(move || self.journal.close()).await;
    }
}

fn unkept(why: StandingError) -> String {
    format!("it cannot be kept over a restart, so nothing was said: {why}")
}

#[cfg(test)]
mod tests;
