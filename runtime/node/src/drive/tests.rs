//! The driver among doubles: what goes in, what comes out, and in which order.

use super::*;
use crate::journal::{Disk, MAX_RECORD_BYTES};
use crate::radio::Hop;
use crate::testing::{mission, percept};
use skein_behaviors::Setpoint;
use skein_behaviors::setpoint::Side;
use skein_link::medium::Channel;
use skein_link::{RadioCounters, Reason};
use skein_peer::witness::{Known, Looked};
use skein_peer::{Priority, Report};
use std::sync::{Mutex, MutexGuard};
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};

/// How long a test waits for something to happen.
const DEADLINE: Duration = Duration::from_secs(20);

/// All that a driver did to its surroundings, and what the peer was given.
#[derive(Debug, Default)]
struct Seen {
    inputs: Vec<(u64, Input)>,
    setpoints: Vec<Setpoint>,
    published: Vec<String>,
    reports: Vec<Report>,
    witnesses: Vec<Witness>,
    counters: RadioCounters,
    left: bool,
    closed: bool,
}

#[derive(Clone, Debug, Default)]
struct Log(Arc<Mutex<Seen>>);

impl Log {
    fn seen(&self) -> MutexGuard<'_, Seen> {
        self.0.lock().unwrap()
    }

    /// Waits until something has happened.
    async fn until(&self, what: &str, mut happened: impl FnMut(&Seen) -> bool) {
        let deadline = Instant::now() + DEADLINE;
        while !happened(&self.seen()) {
            assert!(
                Instant::now() < deadline,
                "not in time: {what}: {:#?}",
                self.seen()
            );
            tokio::time::sleep(Duration::from_millis(2)).await;
        }
    }

    /// Orders that the peer was given.
    fn orders(&self) -> Vec<Orders> {
        let seen = self.seen();
        let order = |(_, input): &(u64, Input)| match input {
            Input::Command(Command::Orders(orders)) => Some(orders.clone()),
            _ => None,
        };
        seen.inputs.iter().filter_map(order).collect()
    }

    /// Missions that the peer was given.
    fn missions(&self) -> Vec<Arc<Mission>> {
        let seen = self.seen();
        let mission = |(_, input): &(u64, Input)| match input {
            Input::Command(Command::Mission(mission)) => Some(Arc::clone(mission)),
            _ => None,
        };
        seen.inputs.iter().filter_map(mission).collect()
    }
}

/// What a double of a peer puts out for an input.
type React = fn(&Input) -> Vec<Output>;

/// A peer that notes its inputs and does as it is told.
struct Double {
    log: Log,
    react: React,
    outputs: std::collections::VecDeque<Output>,
    life: Arc<Mutex<Option<Incarnation>>>,
    mission: Option<Arc<Mission>>,
}

impl PeerLogic for Double {
    fn handle(&mut self, now: Time, input: Input) {
        self.outputs.extend((self.react)(&input));
        self.log.seen().inputs.push((now.0, input));
    }

    fn poll(&mut self) -> Option<Output> {
        self.outputs.pop_front()
    }

    fn next_timeout(&self) -> Option<Time> {
        None
    }

    fn speaks_in(&self) -> Option<Incarnation> {
        *self.life.lock().unwrap()
    }

    fn orders(&self) -> Orders {
        self.log.orders().last().cloned().unwrap_or_default()
    }

    fn knows_uav(&self, id: u16) -> bool {
        id == 3
    }

    fn mission(&self) -> Option<Arc<Mission>> {
        self.mission.clone()
    }

    fn next_revision(&self) -> u32 {
        7
    }

    fn is_ground_station(&self) -> bool {
        self.mission.is_some()
    }

    fn why(&self) -> String {
        "{}".to_owned()
    }

    fn overview(&self) -> Option<String> {
        None
    }

    fn way(&self, from: PointMm, to: PointMm) -> Result<String, String> {
        Err(format!("no way from {from:?} to {to:?}"))
    }

    fn check_task(&self, _: &TaskEdit) -> Result<(), String> {
        Ok(())
    }

    fn operators_tasks(&self) -> OperatorsTasks {
        OperatorsTasks::default()
    }

    fn tasks_version(&self) -> u64 {
        0
    }

    fn looked(&self) -> Option<Witness> {
        let seen = self.log.seen();
        let percept = |(_, input): &(u64, Input)| match input {
            Input::Percept(percept) => Some(percept.time_ms),
            _ => None,
        };
        let seen_ms = seen.inputs.iter().rev().find_map(percept)?;
        Some(Witness::Looked(Box::new(Looked {
            seen_ms,
            ..Looked::default()
        })))
    }

    fn known(&self, at_ms: u64) -> Option<Witness> {
        Some(Witness::Known(Box::new(Known {
            at_ms,
            ..Known::default()
        })))
    }
}

/// One end of everything: the driver's when it holds receivers.
struct Around {
    log: Log,
    percepts: UnboundedReceiver<Percept>,
}

impl Vehicle for Around {
    async fn sense(&mut self) -> Percept {
        match self.percepts.recv().await {
            Some(percept) => percept,
            None => std::future::pending().await,
        }
    }

    async fn fly(&mut self, setpoint: Setpoint) {
        self.log.seen().setpoints.push(setpoint);
    }
}

struct TestWorld {
    log: Log,
    news: UnboundedReceiver<News>,
}

impl World for TestWorld {
    async fn next(&mut self) -> News {
        self.news.recv().await.unwrap_or(News::End)
    }

    async fn report(&mut self, report: &Report) {
        self.log.seen().reports.push(report.clone());
    }

    fn judges(&self) -> bool {
        true
    }

    async fn witness(&mut self, witness: &Witness) {
        self.log.seen().witnesses.push(witness.clone());
    }

    async fn count(&mut self, counters: RadioCounters) {
        self.log.seen().counters = counters;
    }

    async fn leave(&mut self) {
        self.log.seen().left = true;
    }
}

struct TestConsole(UnboundedReceiver<Asked<Request>>);

impl Console for TestConsole {
    async fn next(&mut self) -> Asked<Request> {
        match self.0.recv().await {
            Some(asked) => asked,
            None => std::future::pending().await,
        }
    }
}

struct TestTransport {
    log: Log,
    events: UnboundedReceiver<Event>,
}

impl Transport for TestTransport {
    async fn next(&mut self) -> Event {
        match self.events.recv().await {
            Some(event) => event,
            None => std::future::pending().await,
        }
    }

    async fn publish(&mut self, key: &str, _bytes: Vec<u8>, _hop: Hop, _priority: Priority) {
        self.log.seen().published.push(key.to_owned());
    }

    fn overrun(&self) -> u64 {
        3
    }

    async fn close(self) {
        self.log.seen().closed = true;
    }
}

/// A disk on which nothing can be written.
struct FullDisk;

impl Disk for FullDisk {
    fn append(&mut self, _bytes: &[u8]) -> std::io::Result<()> {
        Err(std::io::ErrorKind::StorageFull.into())
    }

    fn cut(&mut self, _end: u64) -> std::io::Result<()> {
        Ok(())
    }
}

/// A driver that runs, and what it is surrounded with.
struct Running {
    log: Log,
    percepts: UnboundedSender<Percept>,
    news: UnboundedSender<News>,
    console: UnboundedSender<Asked<Request>>,
    events: UnboundedSender<Event>,
    life: Arc<Mutex<Option<Incarnation>>>,
    driver: tokio::task::JoinHandle<()>,
    dir: tempfile::TempDir,
}

impl Running {
    /// Scenario time passes with ticks alone: between them it hardly moves.
    fn start(react: React) -> Self {
        Self::with(react, Clock::following(0, 1e-6, Instant::now()), None)
    }

    fn with(react: React, clock: Clock, journal: Option<Journal>) -> Self {
        let log = Log::default();
        let life = Arc::new(Mutex::new(Some(1)));
        let (percepts, sensed) = unbounded_channel();
        let (news, told) = unbounded_channel();
        let (console, asked) = unbounded_channel();
        let (events, brought) = unbounded_channel();
        let dir = tempfile::tempdir().unwrap();
        let journal = journal.unwrap_or_else(|| Journal::open(&dir.path().join("j")).unwrap().0);
        let peer = Double {
            log: log.clone(),
            react,
            outputs: std::collections::VecDeque::new(),
            life: Arc::clone(&life),
            mission: Some(Arc::new(mission())),
        };
        let around = Surroundings {
            vehicle: Around {
                log: log.clone(),
                percepts: sensed,
            },
            world: TestWorld {
                log: log.clone(),
                news: told,
            },
            console: TestConsole(asked),
            transport: TestTransport {
                log: log.clone(),
                events: brought,
            },
        };
        let equipment = Equipment {
            clock,
            // 100 bytes a second.
            radio: Radio::open(
                1,
                0,
                Channel {
                    rate_bps: 800,
                    overhead_bytes: 0,
                    part_bytes: 0,
                    frame_bytes: 0,
                    queue_age_ms: 60_000,
                },
            ),
            journal,
            standing: Some(Standing::open(&dir.path().join("j"), Some(&mission())).unwrap()),
        };
        let start = Input::Start {
            persisted: Vec::new(),
            nonce: 5,
        };
        let driver = Driver::new(peer, around, equipment).run(start, std::future::pending());
        Self {
            driver: tokio::spawn(driver),
            log,
            percepts,
            news,
            console,
            events,
            life,
            dir,
        }
    }

    fn tick(&self, time_ms: u64) {
        let tick = Tick {
            time_ms,
            scale: 1e-6,
            links: None,
        };
        self.news.send(News::Tick(tick)).unwrap();
    }

    async fn ask(&self, request: Request) -> Answer {
        let (answer, told) = oneshot::channel();
        self.console.send(Asked { request, answer }).unwrap();
        tokio::time::timeout(DEADLINE, told).await.unwrap().unwrap()
    }
}

fn silent(_: &Input) -> Vec<Output> {
    Vec::new()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn a_percept_becomes_a_setpoint_that_answers_it() {
    let running = Running::start(|input| match input {
        Input::Percept(percept) => vec![Output::Setpoint(Setpoint {
            from_ms: percept.time_ms,
            airspeed_mps: 13.0,
            height_m: 60.0,
            steps: Vec::new(),
            loiter: Side::Left,
            gimbal: Vec::new(),
            launch: skein_behaviors::setpoint::Launch::Stay,
            promised: None,
        })],
        _ => Vec::new(),
    });
    running.tick(400);
    running.percepts.send(percept(400)).unwrap();
    let flown = |seen: &Seen| seen.setpoints.first().is_some_and(|s| s.from_ms == 400);
    running.log.until("a setpoint", flown).await;
}

#[tokio::test]
async fn who_judges_is_told_what_was_seen_in_each_percept_and_what_is_known_at_last() {
    let running = Running::start(|_| Vec::new());
    running.tick(400);
    running.percepts.send(percept(400)).unwrap();
    let looked = |w: &Witness| matches!(w, Witness::Looked(l) if l.seen_ms == 400);
    let said = |seen: &Seen| seen.witnesses.iter().any(looked);
    running.log.until("what was seen", said).await;
    running.tick(9_000);
    let known = |w: &Witness| matches!(w, Witness::Known(k) if k.at_ms >= 9_000);
    let said = |seen: &Seen| seen.witnesses.iter().any(known);
    running.log.until("what is known", said).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn the_peer_learns_that_a_record_could_not_be_stored() {
    let store: React = |input| match input {
        Input::Start { .. } => vec![
            Output::Store {
                token: 11,
                record: b"a life".to_vec(),
            },
            Output::Store {
                token: 12,
                record: vec![0; MAX_RECORD_BYTES + 1],
            },
        ],
        _ => Vec::new(),
    };
    let clock = || Clock::following(0, 1e-6, Instant::now());
    let answered = |token: u64, ok: bool| {
        move |seen: &Seen| {
            let is = |(_, i): &(u64, Input)| matches!(i, Input::Stored { token: t, ok: o } if (*t, *o) == (token, ok));
            seen.inputs.iter().any(is)
        }
    };
    let full = Running::with(store, clock(), Some(Journal::over(FullDisk, 0).unwrap()));
    full.log.until("no", answered(11, false)).await;
    full.log.until("no", answered(12, false)).await;
    let good = Running::with(store, clock(), None);
    good.log.until("yes", answered(11, true)).await;
    good.log.until("too long", answered(12, false)).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn what_could_not_be_sent_within_its_lifetime_is_not_sent() {
    let running = Running::start(|input| match input {
        Input::Percept(_) => [("first", 50), ("short", 900), ("long", 5_000)]
            .map(|(key, lifetime_ms)| Output::Publish {
                key: key.to_owned(),
                bytes: vec![0; 100],
                hops: 0,
                priority: Priority::Beacon,
                lifetime_ms,
            })
            .to_vec(),
        _ => Vec::new(),
    });
    running.tick(1_000);
    running.percepts.send(percept(1_000)).unwrap();
    running
        .log
        .until("the first is sent", |seen| seen.published == ["first"])
        .await;
    running.tick(2_001);
    running
        .log
        .until("the last is sent", |seen| {
            seen.published == ["first", "long"]
        })
        .await;
    running.news.send(News::End).unwrap();
    running.driver.await.unwrap();
    let counters = running.log.seen().counters.clone();
    assert_eq!(counters.lost, [(Reason::QueueAge, 1)]);
    assert_eq!((counters.sent, counters.overrun), (2, 3));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn an_order_is_spoken_in_each_life_until_the_next_order() {
    let running = Running::start(silent);
    *running.life.lock().unwrap() = None;
    let told = running.ask(Request::Order(Order::Hold)).await.unwrap();
    assert!(told[0].contains("as soon as"), "{told:?}");
    assert_eq!(running.log.orders(), []);
    for (life, n) in [(Some(1), 1), (Some(1), 1), (None, 1), (Some(2), 2)] {
        *running.life.lock().unwrap() = life;
        let inputs = running.log.seen().inputs.len();
        running.percepts.send(percept(0)).unwrap();
        let sensed = |seen: &Seen| seen.inputs.len() > inputs;
        running.log.until("a percept", sensed).await;
        // The order follows the percept in the same turn of the loop.
        running.ask(Request::Base((0, 0))).await.unwrap();
        assert_eq!(
            running.log.orders(),
            vec![Orders::from(Order::Hold); n],
            "{life:?}"
        );
    }
    let told = running.ask(Request::Order(Order::Resume)).await.unwrap();
    assert_eq!(told, ["the ground station says resume to all"]);
    assert_eq!(running.log.orders().last(), Some(&Order::Resume.into()));
    let one = |id| running.ask(Request::OrderOne(id, Order::ReturnToBase));
    assert!(one(4).await.is_err_and(|e| e.contains("number 4")));
    let told = one(3).await.unwrap();
    assert_eq!(told, ["the ground station says return-to-base to uav3"]);
    let orders = Orders::default().told(Some(3), Order::ReturnToBase);
    assert_eq!(running.log.orders().last(), orders.as_ref());
    let standing = Standing::open(&running.dir.path().join("j"), Some(&mission())).unwrap();
    assert_eq!(standing.orders(), orders);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn what_cannot_be_kept_over_a_restart_is_not_said() {
    let running = Running::start(silent);
    std::fs::remove_dir_all(running.dir.path()).unwrap();
    for request in [Request::Order(Order::Hold), Request::Base((1, 2))] {
        let told = running.ask(request).await;
        assert!(
            told.as_ref().is_err_and(|e| e.contains("cannot be kept")),
            "{told:?}"
        );
    }
    assert_eq!(
        (running.log.orders(), running.log.missions()),
        (vec![], vec![])
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn a_mission_gets_the_next_revision_and_what_cannot_be_flown_is_refused() {
    let running = Running::start(silent);
    let revised = Mission {
        area: vec![(0, 0), (480_000, 0), (480_000, 240_000), (0, 240_000)],
        ..mission()
    };
    let told = running
        .ask(Request::Mission(Arc::new(revised.clone())))
        .await;
    assert_eq!(
        told,
        Ok(vec![
            "the ground station speaks the mission as revision 7".to_owned()
        ])
    );
    let told = running.ask(Request::Base((50_000, 60_000))).await;
    assert!(told.is_ok(), "{told:?}");
    let expected = [
        Mission {
            revision: 7,
            ..revised
        },
        Mission {
            revision: 7,
            base: (50_000, 60_000),
            ..mission()
        },
    ];
    let given: Vec<Mission> = running
        .log
        .missions()
        .iter()
        .map(|m| (**m).clone())
        .collect();
    assert_eq!(given, expected);

    type Change = fn(&mut Mission);
    let wrong: [(Change, &str); 6] = [
        (
            |m| m.origin_lat_e7 += 1,
            "its origin is not that of the swarm",
        ),
        (|m| m.turn_radius_mm -= 1, "turn radius of"),
        (|m| m.footprint_along_mm += 1, "half a footprint of"),
        (|m| m.lane_spacing_mm = 0, "cannot be flown"),
        (|m| m.zones = vec![m.area.clone()], "cannot be flown"),
        (
            |m| m.zones = vec![vec![(9_000, 9_000), (19_000, 9_000), (9_000, 19_000)]],
            "its base is",
        ),
    ];
    for (change, why) in wrong {
        let mut mission = mission();
        change(&mut mission);
        mission.base = (10_000, 10_000);
        let told = running.ask(Request::Mission(Arc::new(mission))).await;
        assert!(
            told.as_ref().is_err_and(|e| e.contains(why)),
            "{why}: {told:?}"
        );
    }
    assert_eq!(running.log.missions().len(), 2, "nothing else was given");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn when_the_world_ends_everything_is_flushed_and_said_goodbye_to() {
    let running = Running::start(|input| match input {
        Input::Start { .. } => vec![
            Output::Store {
                token: 1,
                record: b"kept".to_vec(),
            },
            Output::Report(Report::Booted { incarnation: 1 }),
        ],
        _ => Vec::new(),
    });
    let path = running.dir.path().join("j");
    drop(running.news);
    tokio::time::timeout(DEADLINE, running.driver)
        .await
        .unwrap()
        .unwrap();
    let seen = running.log.seen();
    assert!(seen.left && seen.closed);
    assert_eq!(seen.reports, [Report::Booted { incarnation: 1 }]);
    let (journal, replayed) = Journal::open(&path).unwrap();
    journal.close();
    assert_eq!(replayed.records, [b"kept".to_vec()]);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 1)]
async fn after_a_pause_messages_wait_for_the_frame_that_tells_how_late_it_is() {
    // At this scale the clock is at the end of its tether in half a millisecond.
    let clock = Clock::following(0, 1_000.0, Instant::now());
    let running = Running::with(silent, clock, None);
    tokio::time::sleep(Duration::from_millis(20)).await;
    for neighbour in [2, 3] {
        let link = Event::Link {
            neighbour,
            up: true,
        };
        running.events.send(link).unwrap();
    }
    tokio::time::sleep(Duration::from_millis(50)).await;
    running.tick(60_000);
    let hints = |seen: &Seen| -> Vec<(u64, u16)> {
        let hint = |(at, input): &(u64, Input)| match input {
            Input::LinkHint { neighbour, .. } => Some((*at, *neighbour)),
            _ => None,
        };
        seen.inputs.iter().filter_map(hint).collect()
    };
    running
        .log
        .until("both", |seen| hints(seen).len() == 2)
        .await;
    assert_eq!(hints(&running.log.seen()), [(60_000, 2), (60_000, 3)]);
}
