//! A few peers in virtual time, without a world: what a peer does is tried in ten lines.
//!
//! A [`Harness`] drives peers by the contract at the top of the crate. Each has a clock, a
//! disk that can fail or be slow, a planner that can withhold its results, and a wing that
//! flies setpoints exactly in calm air; links have a delay, a loss and a cut in each
//! direction. Nothing in here draws randomness but from a seed, so a story is the same in
//! every run. What a world adds (bodies, radio range, airtime) is left to the
//! simulator.

use crate::config::Launch;
use crate::input::OperatorsTasks;
use crate::journal::Entry;
use crate::mission::{Mission, mm};
use crate::offload::{self, Job, JobResult};
use crate::wire::codec::{self, Body};
use crate::wire::kinds::Kind;
use crate::wire::message::Record;
use crate::{Beliefs, Command, CoverageTask, Input, Output, Peer, PeerConfig, PeerId};
use crate::{Report, Role, Time, Transmission};
use skein_behaviors::obstacle::{Obstacle, Obstacles};
use skein_behaviors::reactive::follow::fly;
use skein_behaviors::traffic::{Aircraft, Traffic};
use skein_behaviors::{Order, Percept, Setpoint, Steer};
use skein_flight::airframe::{Airframe, CLIMB_MPS};
use skein_flight::coverage::ring::Tree;
use skein_flight::coverage::ring::division::Rule;
use skein_flight::mount::Mount;
use skein_flight::trajectory::timed::Objective;
use skein_geometry::frame::Pose;
use skein_geometry::math::PI;
use skein_geometry::random::SplitMix64;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Beacon period of all peers, milliseconds.
pub const PERIOD_MS: u64 = 1000;
/// Side of a cell, millimetres.
pub const LANE_MM: u32 = 48_000;
/// Milliseconds between two percepts.
const PERCEPT_MS: u64 = 200;
/// Milliseconds that a planner takes.
const PLANNER_MS: u64 = 50;
/// The clocks of peers differ by so much from one id to the next, milliseconds.
const CLOCK_MS: u64 = 7_777;
/// The number of the ground station.
pub const GROUND_STATION: u16 = 100;

/// An area of `cols` × `rows` cells without zones; the base lies beside its corner.
#[must_use]
pub fn mission(revision: u32, cols: i32, rows: i32) -> Mission {
    let (w, h) = (cols * 48_000, rows * 48_000);
    Mission {
        revision,
        origin_lat_e7: 601_655_000,
        origin_lon_e7: 249_355_000,
        area: vec![(0, 0), (w, 0), (w, h), (0, h)],
        zones: Vec::new(),
        lane_spacing_mm: LANE_MM,
        turn_radius_mm: 23_500,
        clearance_mm: 8_000,
        footprint_across_mm: 46_000,
        footprint_along_mm: 36_000,
        tracking_error_mm: 2_000,
        launch: (24_000, 24_000),
        base: (-60_000, -60_000),
        task: CoverageTask::Area,
        lap: 0,
        further_laps: 0,
        added_zones: BTreeMap::new(),
        dismissed: Default::default(),
        finds_obstacles: false,
        sortie: 0,
        cancelled: false,
        diagram: None,
        detections: Vec::new(),
        tasks: Vec::new(),
        counts: Vec::new(),
        streets: None,
        layers: None,
        crowd: None,
        buildings: None,
        tree: Tree::default(),
        division: Rule::default(),
        separation_mm: 0,
        fastest_mmps: 0,
    }
}

/// A small fixed wing: 13 m/s, and an hour of fuel with a minute of reserve.
#[must_use]
pub fn airframe() -> Airframe {
    Airframe {
        stall_mps: 9.0,
        cruise_mps: 13.0,
        max_mps: 18.0,
        max_bank_rad: 37.0 * PI / 180.0,
        endurance_s: 3600.0,
        reserve_s: 60.0,
        footprint_across_m: 46.0,
        footprint_along_m: 36.0,
        mount: Mount::Level,
        climb_mps: CLIMB_MPS,
    }
}

/// How far vehicles sense obstacles, metres.
pub const OBSTACLE_RANGE_M: f64 = 250.0;

/// One direction between two peers.
#[derive(Clone, Copy, Debug)]
pub struct Link {
    /// Milliseconds from one to the other.
    pub delay_ms: u64,
    /// Of a hundred transmissions so many are lost.
    pub loss_percent: usize,
    /// Whether nothing gets through.
    pub cut: bool,
}

impl Default for Link {
    fn default() -> Self {
        Self {
            delay_ms: 5,
            loss_percent: 0,
            cut: false,
        }
    }
}

/// What a peer is surrounded by.
#[derive(Debug)]
pub struct Seat {
    config: PeerConfig,
    peer: Option<Peer>,
    boot: u32,
    /// Its clock less the true time, milliseconds.
    pub clock_ms: u64,
    /// The journal: what is durable.
    pub journal: Vec<Vec<u8>>,
    /// Which entries cannot be written.
    pub store_fails: fn(&Entry) -> bool,
    /// Milliseconds that a store takes.
    pub store_ms: u64,
    /// Whether the planner never answers.
    pub planner_withholds: bool,
    /// Whether the vehicle senses.
    pub senses: bool,
    /// Obstacles that its vehicle senses where they are nearer than [`OBSTACLE_RANGE_M`].
    pub obstacles: Vec<Obstacle>,
    /// Aircraft that its vehicle senses, as they fly at time 0.
    pub aircraft: Vec<Aircraft>,
    /// Flight time left, seconds.
    pub fuel_s: f64,
    /// The wind that it flies in and senses, m/s towards east and north.
    pub wind_mps: (f64, f64),
    /// Where it is.
    pub pose: Pose,
    setpoint: Option<Setpoint>,
    /// How many setpoints it was given.
    pub setpoints: usize,
    sensed_ms: u64,
    /// What it reported, with the true time, milliseconds.
    pub reports: Vec<(u64, Report)>,
    /// What it wrote itself and put on the air, likewise.
    pub said: Vec<(u64, Record, Body)>,
    /// Of which kinds the records were that it passed on.
    pub passed_on: Vec<Kind>,
}

impl Seat {
    /// The last percept once more.
    #[must_use]
    pub fn percept_now(&self) -> Percept {
        self.percept(self.sensed_ms)
    }

    fn percept(&self, now_ms: u64) -> Percept {
        let cruise_mps = airframe().cruise_mps;
        Percept {
            time_ms: now_ms + self.clock_ms,
            pose: self.pose,
            height_m: self.config.height_m,
            airspeed_mps: self
                .setpoint
                .as_ref()
                .map_or(cruise_mps, |s| s.airspeed_mps),
            wind_east_mps: self.wind_mps.0,
            wind_north_mps: self.wind_mps.1,
            wind_unknown: false,
            endurance_s: self.fuel_s,
            takes_off_in_ms: 0,
            launch_ready: false,
            failsafe: false,
            circles_per_m: None,
            circles_in_ms: 0,
            traffic: Traffic::default().with_aircraft(self.aircraft_at(now_ms)),
            obstacles: Obstacles::new(self.obstacles.iter().copied().filter(|o| {
                (o.at() - self.pose.position()).norm() - o.radius_m() < OBSTACLE_RANGE_M
            })),
            sightings: skein_behaviors::sightings::Sightings::default(),
            contour: skein_behaviors::contour::ContourLook::default(),
            crowd: skein_behaviors::crowd::CrowdLook::default(),
            attitude: None,
        }
    }

    /// Where the aircraft are that it senses.
    #[must_use]
    pub fn aircraft_at(&self, now_ms: u64) -> Vec<Aircraft> {
        let ms = i32::try_from(now_ms).unwrap_or(i32::MAX);
        let flown = |a: &Aircraft| Aircraft {
            east_dm: a.east_dm + i32::from(a.east_dmps) * (ms / 20) / 50,
            north_dm: a.north_dm + i32::from(a.north_dmps) * (ms / 20) / 50,
            ..*a
        };
        self.aircraft.iter().map(flown).collect()
    }

    /// Flies the last setpoint, or straight on without one.
    fn fly(&mut self, ms: u64) {
        let steps: &[Steer] = self.setpoint.as_ref().map_or(&[], |s| &s.steps);
        let speed_mps = self.setpoint.as_ref().map_or(13.0, |s| s.airspeed_mps);
        let ms32 = u32::try_from(ms).unwrap_or(u32::MAX);
        self.pose = fly(self.pose, speed_mps, steps, ms32);
        #[allow(clippy::cast_precision_loss, reason = "a fraction of a second")]
        let flown_s = ms as f64 / 1000.0;
        self.pose.east_m += self.wind_mps.0 * flown_s;
        self.pose.north_m += self.wind_mps.1 * flown_s;
        self.fuel_s = (self.fuel_s - flown_s).max(0.0);
    }
}

#[derive(Debug)]
enum Event {
    Arrive {
        from: u16,
        hops: u8,
        bytes: Vec<u8>,
    },
    Stored {
        boot: u32,
        token: u64,
        record: Option<Vec<u8>>,
    },
    Computed {
        boot: u32,
        token: u64,
        result: JobResult,
    },
    Sense,
}

/// Peers in virtual time.
#[derive(Debug)]
pub struct Harness {
    now_ms: u64,
    events: BTreeMap<(u64, u64), (u16, Event)>,
    scheduled: u64,
    seats: BTreeMap<u16, Seat>,
    links: BTreeMap<(u16, u16), Link>,
    results: BTreeMap<u64, JobResult>,
    random: SplitMix64,
}

impl Harness {
    /// `n` UAVs, numbered from 1, over a mission; none is started. They stand along the
    /// southern edge of the area, looking north.
    #[must_use]
    pub fn new(n: u16, mission: Mission) -> Self {
        let mut harness = Self {
            now_ms: 0,
            events: BTreeMap::new(),
            scheduled: 0,
            seats: BTreeMap::new(),
            links: BTreeMap::new(),
            results: BTreeMap::new(),
            random: SplitMix64::new(7),
        };
        let mission = Arc::new(mission);
        for id in 1..=n {
            harness.add(id, Role::Uav, Some(Arc::clone(&mission)));
        }
        harness
    }

    /// The same, each told where and when all of them are launched.
    #[must_use]
    pub fn with_roster(n: u16, mission: Mission) -> Self {
        let mut harness = Self::new(n, mission);
        let launch = |id: u16| {
            let pose = harness.pose(id);
            Launch {
                id,
                east_mm: mm(pose.east_m),
                north_mm: mm(pose.north_m),
                takeoff_ms: 0,
                speed_mmps: mm(airframe().cruise_mps).unsigned_abs(),
            }
        };
        let launches: Arc<[Launch]> = (1..=n).map(launch).collect();
        for id in 1..=n {
            harness.seat(id).config.launches = Arc::clone(&launches);
        }
        harness
    }

    /// The same, started, and a period apart from a common step.
    #[must_use]
    pub fn started(n: u16, mission: Mission) -> Self {
        let mut harness = Self::new(n, mission);
        for id in 1..=n {
            harness.start(id);
        }
        harness
    }

    /// One more peer, not started.
    pub fn add(&mut self, id: u16, role: Role, mission: Option<Arc<Mission>>) {
        let uav = role == Role::Uav;
        let config = PeerConfig {
            sensors: crate::wire::tasks::CAMERA_ALONE,
            id: PeerId(id),
            role,
            fleet: "harness".into(),
            beacon_period_ms: 1000,
            rate_bps: 1_000_000,
            airframe: uav.then(airframe),
            objective: Objective::Time,
            height_m: 60.0 + 5.0 * f64::from(id),
            mission,
            launches: Arc::from([]),
            seed: 1,
        };
        let seat = Seat {
            config,
            peer: None,
            boot: 0,
            clock_ms: CLOCK_MS * u64::from(id),
            journal: Vec::new(),
            store_fails: |_| false,
            store_ms: 10,
            planner_withholds: false,
            senses: uav,
            obstacles: Vec::new(),
            aircraft: Vec::new(),
            fuel_s: 3600.0,
            wind_mps: (0.0, 0.0),
            pose: Pose {
                east_m: 96.0 * f64::from(id) - 72.0,
                north_m: 24.0,
                heading_rad: 0.5 * PI,
            },
            setpoint: None,
            setpoints: 0,
            sensed_ms: 0,
            reports: Vec::new(),
            said: Vec::new(),
            passed_on: Vec::new(),
        };
        self.seats.insert(id, seat);
    }

    /// One more peer, not started, that was configured as another one: it has the same id and
    /// height, and a seat of its own under another number, beside that of the other.
    pub fn add_twin(&mut self, number: u16, of: u16) {
        let (config, pose) = (self.seat(of).config.clone(), self.seat(of).pose);
        self.add(number, config.role, config.mission.clone());
        let seat = self.seat(number);
        seat.config = config;
        seat.pose.east_m = pose.east_m - 200.0;
    }

    /// A ground station with a mission of its own, not started.
    pub fn add_ground_station(&mut self, mission: Option<Mission>) {
        self.add(GROUND_STATION, Role::GroundStation, mission.map(Arc::new));
    }

    /// Starts a peer with what its journal holds.
    pub fn start(&mut self, id: u16) {
        let now = self.now_ms;
        let seat = self.seat(id);
        seat.boot += 1;
        seat.peer = Some(Peer::new(seat.config.clone()));
        let (persisted, nonce) = (seat.journal.clone(), u32::from(id) * 1000 + seat.boot);
        let senses = seat.config.role == Role::Uav && seat.boot == 1;
        self.feed(id, Input::Start { persisted, nonce });
        if senses {
            self.at(now + u64::from(id), id, Event::Sense);
        }
    }

    /// Ends a peer's process: what was not durable is lost, its airframe flies on.
    pub fn stop(&mut self, id: u16) {
        let seat = self.seat(id);
        seat.peer = None;
        seat.boot += 1;
    }

    /// What surrounds a peer.
    ///
    /// # Panics
    /// Where there is none of that number.
    pub fn seat(&mut self, id: u16) -> &mut Seat {
        self.seats.get_mut(&id).expect("a peer of the harness")
    }

    /// One direction between two peers.
    pub fn link(&mut self, from: u16, to: u16) -> &mut Link {
        self.links.entry((from, to)).or_default()
    }

    /// Cuts or mends all links between a peer and the others, both ways.
    pub fn isolate(&mut self, id: u16, cut: bool) {
        let others: Vec<u16> = self.seats.keys().copied().filter(|o| *o != id).collect();
        for other in others {
            self.link(id, other).cut = cut;
            self.link(other, id).cut = cut;
        }
    }

    /// The true time, milliseconds.
    #[must_use]
    pub fn now_ms(&self) -> u64 {
        self.now_ms
    }

    fn peer(&self, id: u16) -> Option<&Peer> {
        self.seats.get(&id)?.peer.as_ref()
    }

    /// What a running peer believes; nothing of one that does not run.
    #[must_use]
    pub fn beliefs(&self, id: u16) -> Beliefs {
        self.peer(id).map(Peer::beliefs).unwrap_or_default()
    }

    /// What a running peer does and why.
    ///
    /// # Panics
    /// When it does not run.
    #[must_use]
    pub fn why(&self, id: u16) -> crate::Why {
        self.seats[&id].peer.as_ref().expect("it runs").why()
    }

    /// Predicted end of a running peer's plan, milliseconds from now.
    #[must_use]
    pub fn eta_ms(&self, id: u16) -> u32 {
        self.peer(id).map_or(0, Peer::eta_ms)
    }

    /// The revision that the operator's next mission gets at a running peer.
    #[must_use]
    pub fn next_revision(&self, id: u16) -> u32 {
        self.peer(id).map_or(0, Peer::next_revision)
    }

    /// The newest mission that a running peer holds.
    #[must_use]
    pub fn newest_mission(&self, id: u16) -> Option<Arc<Mission>> {
        self.peer(id)?.mission()
    }

    /// Where a UAV is.
    ///
    /// # Panics
    /// Where there is none of that number.
    #[must_use]
    pub fn pose(&self, id: u16) -> Pose {
        self.seats[&id].pose
    }

    /// All alarms of a peer, in order.
    #[must_use]
    pub fn alarms(&self, id: u16) -> Vec<String> {
        let reports = self.seats.get(&id).map_or(&[][..], |s| &s.reports);
        let alarm = |(_, report): &'_ (u64, Report)| match report {
            Report::Alarm { text } => Some(text.clone()),
            _ => None,
        };
        reports.iter().filter_map(alarm).collect()
    }

    /// How many records of a kind a peer has written and put on the air.
    #[must_use]
    pub fn count_said(&self, id: u16, kind: Kind) -> usize {
        let said = self.seats.get(&id).map_or(&[][..], |s| &s.said);
        said.iter().filter(|(_, _, b)| b.kind() == kind).count()
    }

    /// Gives a peer an input now, and does what it wants.
    pub fn feed(&mut self, id: u16, input: Input) {
        let Some(seat) = self.seats.get_mut(&id) else {
            return;
        };
        let Some(peer) = &mut seat.peer else { return };
        peer.handle(Time(self.now_ms + seat.clock_ms), input);
        let mut outputs = Vec::new();
        while let Some(output) = peer.poll() {
            outputs.push(output);
        }
        for output in outputs {
            self.perform(id, output);
        }
    }

    /// A transmission of anybody, heard by one peer now.
    pub fn inject(&mut self, id: u16, bytes: Vec<u8>) {
        self.feed(
            id,
            Input::Received {
                transmitter: u16::MAX,
                hops: 0,
                heard: Transmission::read(bytes).into(),
            },
        );
    }

    /// What the operator of a ground station said of tasks; nothing where no process runs.
    #[must_use]
    pub fn operators_tasks(&self, id: u16) -> OperatorsTasks {
        self.peer(id).map(Peer::operators_tasks).unwrap_or_default()
    }

    /// Whether a peer speaks.
    #[must_use]
    pub fn speaks(&self, id: u16) -> bool {
        self.peer(id).is_some_and(|p| p.speaks_in().is_some())
    }

    /// The operator gives an order to all at a peer.
    pub fn order(&mut self, id: u16, order: Order) {
        self.feed(id, Input::Command(Command::Orders(order.into())));
    }

    /// The operator gives an order to one UAV at a peer.
    pub fn order_one(&mut self, id: u16, uav: u16, order: Order) {
        let orders = self.beliefs(id).orders;
        let orders = orders.told(Some(uav), order).expect("few are told");
        self.feed(id, Input::Command(Command::Orders(orders)));
    }

    /// Runs for a while.
    pub fn run_s(&mut self, seconds: u64) {
        let until = self.now_ms + 1000 * seconds;
        while self.step(until) {}
        self.now_ms = until;
    }

    /// Runs until something holds, looked at every quarter period; returns whether it
    /// came to hold within the time.
    pub fn run_until(&mut self, most_s: u64, holds: impl Fn(&Self) -> bool) -> bool {
        let end = self.now_ms + 1000 * most_s;
        while self.now_ms < end {
            if holds(self) {
                return true;
            }
            let until = self.now_ms + PERIOD_MS / 4;
            while self.step(until) {}
            self.now_ms = until;
        }
        holds(self)
    }

    /// The next thing that happens up to a time; false when there is none.
    fn step(&mut self, until_ms: u64) -> bool {
        let event = self.events.first_key_value().map(|(at, _)| at.0);
        let timer = self
            .seats
            .iter()
            .filter_map(|(id, s)| {
                let at = s.peer.as_ref()?.next_timeout()?;
                Some((at.0.saturating_sub(s.clock_ms).max(self.now_ms), *id))
            })
            .min();
        match (event, timer) {
            (Some(at), timer) if at <= until_ms && timer.is_none_or(|(t, _)| at <= t) => {
                let Some(((at, _), (id, event))) = self.events.pop_first() else {
                    return false;
                };
                self.now_ms = self.now_ms.max(at);
                self.happen(id, event);
                true
            }
            (_, Some((at, id))) if at <= until_ms => {
                self.now_ms = at;
                self.feed(id, Input::Timer);
                true
            }
            _ => false,
        }
    }

    fn happen(&mut self, id: u16, event: Event) {
        let now_ms = self.now_ms;
        let seat = self.seat(id);
        match event {
            Event::Arrive { from, hops, bytes } => self.feed(
                id,
                Input::Received {
                    transmitter: from,
                    hops,
                    heard: Transmission::read(bytes).into(),
                },
            ),
            Event::Stored {
                boot,
                token,
                record,
            } if boot == seat.boot => {
                let ok = record.is_some();
                seat.journal.extend(record);
                self.feed(id, Input::Stored { token, ok });
            }
            Event::Computed {
                boot,
                token,
                result,
            } if boot == seat.boot => self.feed(id, Input::Computed { token, result }),
            Event::Stored { .. } | Event::Computed { .. } => {}
            Event::Sense => {
                seat.fly(PERCEPT_MS);
                seat.sensed_ms = now_ms;
                let percept = seat.percept(now_ms);
                if seat.senses {
                    self.feed(id, Input::Percept(percept));
                }
                self.at(now_ms + PERCEPT_MS, id, Event::Sense);
            }
        }
    }

    fn at(&mut self, time_ms: u64, id: u16, event: Event) {
        self.scheduled += 1;
        self.events.insert((time_ms, self.scheduled), (id, event));
    }

    fn perform(&mut self, id: u16, output: Output) {
        let now_ms = self.now_ms;
        match output {
            Output::Publish { bytes, hops, .. } => self.publish(id, hops, &bytes),
            Output::Setpoint(setpoint) => {
                let seat = self.seat(id);
                seat.setpoint = Some(setpoint);
                seat.setpoints += 1;
            }
            Output::Store { token, record } => {
                let seat = self.seat(id);
                let fails = Entry::decode(&record).is_some_and(|e| (seat.store_fails)(&e));
                let (boot, at) = (seat.boot, now_ms + seat.store_ms);
                let record = (!fails).then_some(record);
                let stored = Event::Stored {
                    boot,
                    token,
                    record,
                };
                self.at(at, id, stored);
            }
            Output::Compute { token, job } => {
                let seat = self.seat(id);
                if seat.planner_withholds {
                    return;
                }
                let boot = seat.boot;
                let result = self.result(&job);
                let computed = Event::Computed {
                    boot,
                    token,
                    result,
                };
                self.at(now_ms + PLANNER_MS, id, computed);
            }
            Output::Report(report) => self.seat(id).reports.push((now_ms, report)),
        }
    }

    /// The result of a job; geometries are derived once.
    fn result(&mut self, job: &Job) -> JobResult {
        match job {
            Job::Geometry(mission) => self
                .results
                .entry(mission.content_hash())
                .or_insert_with(|| offload::run(job))
                .clone(),
            Job::Divide { .. } | Job::Errand(_) => offload::run(job),
        }
    }

    fn publish(&mut self, from: u16, hops: u8, bytes: &[u8]) {
        let now_ms = self.now_ms;
        if let Ok(record) = codec::decode_record(bytes)
            && let Some(kind) = Kind::of_number(record.kind)
            && let Ok(body) = codec::decode_body(kind, &record.body)
        {
            let seat = self.seat(from);
            match hops {
                0 => seat.said.push((now_ms, record, body)),
                _ => seat.passed_on.push(kind),
            }
        }
        let others: Vec<u16> = self.seats.keys().copied().filter(|o| *o != from).collect();
        for to in others {
            let link = self.links.get(&(from, to)).copied().unwrap_or_default();
            let lost = self.random.below(100) < link.loss_percent;
            if !link.cut && !lost {
                let bytes = bytes.to_vec();
                let arrive = Event::Arrive { from, hops, bytes };
                self.at(now_ms + link.delay_ms, to, arrive);
            }
        }
    }
}
