//! The world around the peers: airframes, buildings, and the judge (D2.7 §2.2).
//!
//! A [`World`] is a plain struct without a clock. Whoever drives it (virtual time or a
//! live trial) says how far to go, brings setpoints and takes percepts away; the order
//! of a tick is act, move, radio, sense, decide.

mod board;
pub mod camera;
pub mod contour;
pub mod crowd;
pub(crate) mod detector;
pub mod fact;
pub mod fixture;
pub mod flat;
pub mod ground;
pub mod intruders;
pub mod judge;
mod launcher;
mod layers;
pub mod motion;
mod no_fly;
pub mod obstacles;
pub mod pieces;
mod separation;
pub mod services;
pub mod survey;
mod task_board;
pub mod unmapped;
pub mod vehicles;
mod watch;

pub use fact::{Approach, Fact};
pub use ground::GroundSeen;
pub use judge::{Judge, Sighting};
pub use layers::LayerSeen;
pub use motion::kinematic::Loss;
pub use no_fly::TurnAway;
pub use obstacles::{Obstacles, Place};
pub use survey::{Cell, Survey, Uncoverable};

use crate::spec::Spec;
use crate::weather::Weather;
use contour::Contour;
use crowd::Crowd;
use ground::Ground;
use intruders::Intruders;
use launcher::Launchers;
use motion::{Kinematic, Piece};
use services::Services;
use skein_behaviors::obstacle::Obstacles as ObstaclesSensed;
use skein_behaviors::traffic::{Sighting as Seen, Traffic};
use skein_behaviors::{Percept, Setpoint};
use skein_flight::coverage::ring::patch::{Corners, Patches};
use skein_peer::mission::mm;
use skein_peer::offload::MissionGeometry;
use skein_peer::{Call, CoverageTask, Mission};
use std::collections::BTreeSet;
use std::iter;
use std::sync::Arc;
use unmapped::Unmapped;
use vehicles::Vehicles;

/// The world moves in steps of at most this long, aligned to its multiples, so that
/// separation is looked at this often however seldom the driver asks.
pub const STEP_MS: u64 = 100;

/// After the beginning of each period one of so many UAVs senses by so much: spread over the
/// period, so that no instant does all the work and no two peers decide on the same one by
/// construction. A multiple of the world's step, since other instants would cost more of them.
#[must_use]
pub fn percept_phase_ms(nth: usize, of: usize, period_ms: u32) -> u64 {
    let spread_ms = nth as u64 * u64::from(period_ms) / of.max(1) as u64;
    spread_ms - spread_ms % STEP_MS
}

/// What does not change during a run and can be shared by many: a storm of a thousand
/// seeds surveys the area once.
#[derive(Debug)]
pub struct Site {
    /// The buildings.
    pub obstacles: Obstacles,
    /// The cells.
    pub survey: Arc<Survey>,
    /// What peers name cells, where the survey knows other ones.
    pub claims: Option<Arc<pieces::Pieces>>,
    /// The open ground between the buildings, which nobody has seen yet.
    open: Option<Ground>,
}

impl Site {
    /// Prepares buildings and cells; the geometry is what the mission of the scenario gave,
    /// if it gave any: nobody looks for cells that its planner leaves out.
    #[must_use]
    pub fn new(spec: &Spec, geometry: Option<&MissionGeometry>) -> Self {
        let obstacles = Obstacles::new(&spec.buildings);
        let survey = Survey::new(spec);
        let survey = Arc::new(match geometry {
            Some(geometry) => survey.as_planned(geometry),
            None => survey,
        });
        Self {
            open: Ground::of(&survey, &spec.mission, &obstacles),
            obstacles,
            survey,
            claims: claims(&spec.mission, geometry),
        }
    }
}

/// One UAV of the world.
#[derive(Clone, Debug)]
struct Uav {
    id: u16,
    body: Kinematic,
    failsafe: bool,
    /// The computers in it: its own, and those of twins.
    computers: Vec<Computer>,
    /// Whose setpoint the airframe took last.
    commander: u16,
}

impl Uav {
    fn computer(&self, number: u16) -> Option<&Computer> {
        self.computers.iter().find(|c| c.number == number)
    }
}

/// A computer in an airframe, with a radio.
#[derive(Clone, Copy, Debug)]
struct Computer {
    number: u16,
    /// Whether it works, and with it its radio.
    works: bool,
    /// The revision of the mission that it follows, once it follows any.
    revision: Option<u32>,
}

impl Computer {
    fn new(number: u16) -> Self {
        Self {
            number,
            works: true,
            revision: None,
        }
    }
}

/// The pieces in which peers see an area by exact passes, and lines by stations of
/// several pieces: they come from the planner, and serve to check what peers say, not
/// whether all was seen.
fn claims(mission: &Mission, geometry: Option<&MissionGeometry>) -> Option<Arc<pieces::Pieces>> {
    match mission.task {
        CoverageTask::Exact | CoverageTask::Lines(_) => {}
        CoverageTask::Area | CoverageTask::Points(_) => return None,
    }
    let corners = match geometry?.coverage_loop.patches() {
        Patches::Listed(list) => list.corners().to_vec(),
        Patches::Grid(_) => return None,
    };
    Some(Arc::new(pieces::Pieces::new(corners)))
}

/// The state of everything that is not a peer's mind.
#[derive(Clone, Debug)]
pub struct World {
    site: Arc<Site>,
    seed: u64,
    now_ms: u64,
    uavs: Vec<Uav>,
    /// By number of a computer: in which of the UAVs it is. Asked for at every percept, every
    /// setpoint and for every antenna.
    seats: Vec<Option<usize>>,
    ground: Option<(u16, Place)>,
    nodes: Vec<u16>,
    min_separation_m: f64,
    traffic_range_m: f64,
    judge: Judge,
    vehicles: Vehicles,
    services: Services,
    intruders: Intruders,
    unmapped: Unmapped,
    obstacle_range_m: f64,
    weather: Weather,
    launchers: Option<Launchers>,
    contour: Option<Contour>,
    crowd: Option<Crowd>,
    facts: Vec<Fact>,
    flown: Vec<Piece>,
    airborne: Vec<(u16, Place)>,
}

impl World {
    /// The world of a scenario over a grid of lanes, with a site of its own.
    #[cfg(test)]
    pub(crate) fn new(spec: &Spec, seed: u64) -> Self {
        Self::on(Arc::new(Site::new(spec, None)), spec, seed)
    }

    /// The world of a scenario at time 0, all UAVs at their launch poses, on a
    /// site prepared from the same scenario.
    #[must_use]
    pub fn on(site: Arc<Site>, spec: &Spec, seed: u64) -> Self {
        let aboard = |of: u16| {
            let twins = spec.uavs.iter().filter(move |u| u.aboard);
            let twins = twins.filter(move |u| u.twin_of == Some(of));
            twins.map(|u| Computer::new(u.id))
        };
        let own = spec.uavs.iter().filter(|u| !u.aboard);
        let mut uavs: Vec<Uav> = own
            .map(|u| Uav {
                id: u.id,
                body: Kinematic::new(u.airframe, u.launch, u.height_m, 0)
                    .in_wind(spec.wind.at(0))
                    .taking_off_at(u64::from(u.takeoff_ms)),
                failsafe: false,
                computers: iter::once(Computer::new(u.id))
                    .chain(aboard(u.id))
                    .collect(),
                commander: u.id,
            })
            .collect();
        uavs.sort_by_key(|u| u.id);
        let ground = spec.ground.as_ref().map(|g| {
            (
                g.id,
                Place {
                    at: g.position,
                    height_m: g.height_m,
                },
            )
        });
        let computers = uavs.iter().flat_map(|u| &u.computers);
        let mut nodes: Vec<u16> = computers
            .map(|c| c.number)
            .chain(ground.map(|g| g.0))
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        let mut seats = vec![None; nodes.last().map_or(0, |last| usize::from(*last) + 1)];
        for (i, u) in uavs.iter().enumerate() {
            for c in &u.computers {
                seats[usize::from(c.number)] = Some(i);
            }
        }
        let judge = Judge::new(Arc::clone(&site.survey))
            .with_claims(site.claims.clone())
            .with_laps(spec.mission.further_laps.saturating_add(1))
            .with_watch(spec.mission.goes_round())
            .with_ground(site.open.clone());
        let mut launchers = Launchers::of(spec);
        if let Some(launchers) = &mut launchers {
            launchers.hold(0, &mut uavs, &mut Vec::new());
        }
        Self {
            site,
            seed,
            now_ms: 0,
            uavs,
            seats,
            ground,
            nodes,
            min_separation_m: spec.min_separation_m,
            traffic_range_m: spec.traffic_range_m,
            judge,
            vehicles: Vehicles::new(&spec.vehicles, seed),
            services: Services::new(&spec.services),
            intruders: Intruders::of(spec, seed),
            unmapped: Unmapped::new(spec, seed),
            obstacle_range_m: spec.obstacle_range_m,
            weather: spec.wind.clone(),
            launchers,
            contour: spec.contour.as_ref().map(|c| Contour::new(c, seed)),
            crowd: spec
                .crowd
                .as_ref()
                .map(|c| Crowd::new(c, spec.percept_period_ms, seed)),
            facts: Vec::new(),
            flown: Vec::new(),
            airborne: Vec::new(),
        }
    }

    /// The seed of the run.
    #[must_use]
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// How far the world has moved, milliseconds.
    #[must_use]
    pub fn now_ms(&self) -> u64 {
        self.now_ms
    }

    /// All radio nodes, UAVs and ground station, ascending by number.
    #[must_use]
    pub fn nodes(&self) -> &[u16] {
        &self.nodes
    }

    /// The numbers of all UAVs, ascending, lost ones too.
    pub fn uavs(&self) -> impl Iterator<Item = u16> + '_ {
        self.uavs.iter().map(|u| u.id)
    }

    /// What the computer with this number flies, if it flies.
    #[must_use]
    pub fn body(&self, number: u16) -> Option<&Kinematic> {
        self.uav(number).map(|u| &u.body)
    }

    /// Whether the computer with this number is the one whose setpoints fly its airframe.
    #[must_use]
    pub fn commands(&self, number: u16) -> bool {
        self.uav(number)
            .is_some_and(|u| u.commander == number && u.body.is_commanded(self.now_ms))
    }

    /// The UAV in which the computer with this number is.
    fn uav(&self, number: u16) -> Option<&Uav> {
        self.uavs.get(self.seat(number)?)
    }

    fn seat(&self, number: u16) -> Option<usize> {
        self.seats.get(usize::from(number)).copied().flatten()
    }

    fn uav_mut(&mut self, number: u16) -> Option<&mut Uav> {
        let seat = self.seat(number)?;
        self.uavs.get_mut(seat)
    }

    /// Where the antenna of a node is; nothing for a lost airframe or a dead computer.
    #[must_use]
    pub fn antenna(&self, node: u16) -> Option<Place> {
        if let Some((id, place)) = self.ground
            && id == node
        {
            return Some(place);
        }
        let u = self.uav(node)?;
        let works = u.computer(node).is_some_and(|c| c.works);
        (works && u.body.airborne()).then(|| place_of(&u.body))
    }

    /// The buildings.
    #[must_use]
    pub fn obstacles(&self) -> &Obstacles {
        &self.site.obstacles
    }

    /// The judge and its score.
    #[must_use]
    pub fn judge(&self) -> &Judge {
        &self.judge
    }

    /// A mission ended by its time: nothing is to be seen after the last lap that is complete.
    /// Returns whether there is one.
    pub fn end_laps(&mut self) -> bool {
        self.judge.end_laps()
    }

    /// From now on a revision of the mission with this geometry is judged by.
    pub fn revise(&mut self, survey: Arc<Survey>, geometry: &MissionGeometry) {
        let mission = &*geometry.mission;
        let claims = claims(mission, Some(geometry));
        let ground = Ground::of(&survey, mission, &self.site.obstacles);
        self.judge.revise_ground(ground);
        self.judge.revise(
            survey,
            (
                claims,
                mission.lap,
                mission.further_laps,
                mission.goes_round(),
            ),
            mission.revision,
            TurnAway::of(mission),
        );
    }

    /// Some follow a mission with this geometry, and the newest is another one.
    pub fn follow_beside(&mut self, survey: Arc<Survey>, geometry: &MissionGeometry) {
        let mission = &*geometry.mission;
        let claims = claims(mission, Some(geometry));
        let laps = (mission.lap, mission.further_laps);
        self.judge
            .follow_beside(survey, claims, laps, mission.revision);
    }

    /// A task is to be seen since then, milliseconds, by one of these UAVs; asked twice it is
    /// asked once.
    pub fn ask(
        &mut self,
        task: (u16, u32),
        pieces: Vec<Corners>,
        carriers: BTreeSet<u16>,
        since_ms: u64,
    ) {
        self.judge.ask(task, pieces, carriers, since_ms);
    }

    /// Tasks are heard of so late at most, milliseconds: what was seen meanwhile is kept.
    pub fn keep_looks(&mut self, keeps_ms: u64) {
        self.judge.keep_looks(keeps_ms);
    }

    /// The computer with this number follows this revision of the mission: so does its UAV,
    /// if it commands it.
    pub fn follows(&mut self, number: u16, revision: u32) {
        let Some(u) = self.uav_mut(number) else {
            return;
        };
        let mut computers = u.computers.iter_mut();
        if let Some(c) = computers.find(|c| c.number == number) {
            c.revision = Some(revision);
        }
        let (uav, commands) = (u.id, u.commander == number);
        if commands {
            self.judge.follows(uav, revision);
        }
    }

    /// The facts recorded since the last call, in order of time per UAV.
    pub fn take_facts(&mut self) -> Vec<Fact> {
        std::mem::take(&mut self.facts)
    }

    /// Hands a setpoint of the computer with this number to its airframe; says whether it was
    /// taken. A dead computer commands nothing, and an airframe has one commander: it takes
    /// none of another before its failsafe would trip.
    pub fn apply(&mut self, number: u16, setpoint: Setpoint) -> bool {
        let now_ms = self.now_ms;
        let Some(seat) = self.seat(number) else {
            return false;
        };
        let Some(u) = self.uavs.get_mut(seat) else {
            return false;
        };
        let Some(computer) = u.computer(number).copied().filter(|c| c.works) else {
            return false;
        };
        let changes = u.commander != number;
        if u.body.takes_off_in_ms(now_ms) > 0
            && (!changes || !u.body.is_commanded(now_ms))
            && let Some(launchers) = &mut self.launchers
            && let Some(u) = self.uavs.get_mut(seat)
        {
            launchers.tell(now_ms, u, &setpoint);
            // Its launcher took it: nothing flies yet.
            return true;
        }
        let Some(u) = self.uavs.get_mut(seat) else {
            return false;
        };
        if changes && u.body.is_commanded(now_ms) || !u.body.apply(setpoint, now_ms) {
            return false;
        }
        u.commander = number;
        let uav = u.id;
        if let Some(revision) = computer.revision.filter(|_| changes) {
            self.judge.follows(uav, revision);
        }
        true
    }

    /// What a UAV knows of itself now, without what it senses of others; nothing once it is lost.
    #[must_use]
    pub fn own(&self, uav: u16) -> Option<Percept> {
        self.body(uav)?.percept()
    }

    /// What the computer with this number is told by the sensors of its airframe now; nothing
    /// once that is lost. All in one airframe are told the same.
    #[must_use]
    pub fn percept(&self, number: u16) -> Option<Percept> {
        let Uav { id: uav, body, .. } = self.uav(number)?;
        let uav = *uav;
        let ground_ms = body.takes_off_in_ms(self.now_ms);
        let own = self.weather.sensed(body.percept()?, self.seed, uav);
        let attitude = own.attitude;
        let attitude = attitude.map(|a| camera::sensed(a, self.seed, uav, self.now_ms));
        Some(Percept {
            time_ms: self.now_ms,
            takes_off_in_ms: u32::try_from(ground_ms).unwrap_or(u32::MAX),
            launch_ready: self.launchers.as_ref().is_some_and(|l| l.is_ready(uav)),
            traffic: self
                .traffic(uav, body.position())
                .with_aircraft(self.intruders.sensed(
                    self.now_ms,
                    body.position(),
                    self.traffic_range_m,
                )),
            obstacles: ObstaclesSensed::new(
                self.unmapped.sensed(body.position(), self.obstacle_range_m),
            ),
            sightings: self
                .vehicles
                .look(body, uav, self.now_ms, &self.site.obstacles),
            contour: self.contour.as_ref().map_or_else(Default::default, |c| {
                c.look(body, uav, self.now_ms, &self.site.obstacles)
            }),
            crowd: self.crowd.as_ref().map_or_else(Default::default, |c| {
                c.look(body, uav, self.now_ms, &self.site.obstacles)
            }),
            attitude,
            ..own
        })
    }

    /// The road or fire that no peer knows.
    #[must_use]
    pub fn contour(&self) -> Option<&Contour> {
        self.contour.as_ref()
    }

    /// Which of its places are in the picture of a UAV now.
    #[must_use]
    pub fn contour_pictured(&self, uav: u16) -> Vec<bool> {
        let flies = |b: &&Kinematic| b.takes_off_in_ms(self.now_ms) == 0;
        let both = self.contour.as_ref().zip(self.body(uav).filter(flies));
        both.map_or_else(Vec::new, |(c, body)| {
            c.pictured(body, self.now_ms, &self.site.obstacles)
        })
    }

    /// The people of a mass event, as they are.
    #[must_use]
    pub fn crowd(&self) -> Option<&Crowd> {
        self.crowd.as_ref()
    }

    /// Whether nothing stands between a place on the ground and the camera of a UAV.
    #[must_use]
    pub fn is_open_to(&self, uav: u16, at: skein_geometry::frame::Point) -> bool {
        let eye = self.eye_of(uav);
        eye.is_some_and(|eye| self.is_open_from(eye, at))
    }

    /// Where the camera of a UAV is.
    #[must_use]
    pub fn eye_of(&self, uav: u16) -> Option<Place> {
        self.body(uav).map(place_of)
    }

    /// Whether nothing stands between a place on the ground and a camera.
    #[must_use]
    pub fn is_open_from(&self, eye: Place, at: skein_geometry::frame::Point) -> bool {
        self.site.obstacles.sees(eye, Place::on_ground(at))
    }

    /// The vehicles on the ground, as they are.
    #[must_use]
    pub fn vehicles(&self) -> &Vehicles {
        &self.vehicles
    }

    /// The services on the ground.
    #[must_use]
    pub fn services(&self) -> &Services {
        &self.services
    }

    /// Obstacles that are on no map.
    #[must_use]
    pub fn unmapped(&self) -> &Unmapped {
        &self.unmapped
    }

    /// Aircraft that are no members.
    #[must_use]
    pub fn intruders(&self) -> &Intruders {
        &self.intruders
    }

    /// The ground station calls services on the ground to these; gives those of them that are
    /// served.
    pub fn dispatch(&mut self, calls: &[Call]) -> Vec<Call> {
        self.services.called(calls)
    }

    /// Which of them are in the picture of a UAV, unhidden, now.
    pub fn pictured(&self, uav: u16) -> impl Iterator<Item = usize> + '_ {
        let body = self
            .body(uav)
            .filter(|b| b.takes_off_in_ms(self.now_ms) == 0);
        let all = 0..self.vehicles.len();
        all.filter(move |n| {
            body.is_some_and(|b| self.vehicles.is_pictured(*n, b, &self.site.obstacles))
        })
    }

    /// Whom a UAV senses, where they carry sensors.
    fn traffic(&self, uav: u16, at: skein_geometry::frame::Point) -> Traffic {
        if self.traffic_range_m <= 0.0 {
            return Traffic::default();
        }
        // Who rolls is one of them already.
        let rolls = |id| self.launchers.as_ref().is_some_and(|l| l.rolls(id));
        let flies = |u: &&Uav| u.body.takes_off_in_ms(self.now_ms) == 0 || rolls(u.id);
        let others = self.uavs.iter().filter(|u| u.id != uav);
        let airborne = others.filter(|u| u.body.airborne()).filter(flies);
        let near = airborne.map(|u| ((u.body.position() - at).norm(), u));
        let mut near: Vec<_> = near.filter(|(m, _)| *m <= self.traffic_range_m).collect();
        // Who changes layers has to know of all that are about as high; else the nearest count.
        let high_m = self.body(uav).map_or(0.0, Kinematic::height_m);
        let key = |(away_m, u): &(f64, &Uav)| match self.judge.survey().layers() {
            Some(_) => (u.body.height_m() - high_m).abs(),
            None => *away_m,
        };
        near.sort_by(|a, b| key(a).total_cmp(&key(b)));
        let sighting = |(_, u): (f64, &Uav)| Seen {
            id: u.id,
            east_dm: mm(u.body.position().x) / 100,
            north_dm: mm(u.body.position().y) / 100,
            height_dm: mm(u.body.height_m()) / 100,
        };
        Traffic::new(self.traffic_range_m, near.into_iter().map(sighting))
    }

    /// Takes an airframe out of the air.
    pub fn kill(&mut self, uav: u16) {
        let at_ms = self.now_ms;
        if let Some(u) = self.uav_mut(uav)
            && u.body.airborne()
        {
            u.body.kill();
            let (uav, place) = (u.id, u.body.position());
            self.facts.push(Fact::Lost {
                at_ms,
                uav,
                cause: Loss::Killed,
                place,
            });
        }
    }

    /// Says whether the computer with this number works; without it the radio is silent and the
    /// airframe soon loiters on its own.
    pub fn set_computer(&mut self, number: u16, works: bool) {
        let u = self.uav_mut(number).into_iter();
        let mut computers = u.flat_map(|u| u.computers.iter_mut());
        if let Some(c) = computers.find(|c| c.number == number) {
            c.works = works;
        }
    }

    /// The fuel of a UAV lasts no longer than this from now on, milliseconds.
    pub fn limit_fuel(&mut self, uav: u16, lasts_ms: u64) {
        if let Some(u) = self.uav_mut(uav) {
            u.body.limit_fuel(lasts_ms);
        }
    }

    /// Puts a lost UAV back: a new airframe at the launch point, this computer of it working.
    /// An airframe that still flies is left alone.
    pub fn respawn(&mut self, number: u16) {
        let now_ms = self.now_ms;
        self.set_computer(number, true);
        if let Some(u) = self.uav_mut(number)
            && !u.body.airborne()
        {
            u.body.relaunch(now_ms);
            u.failsafe = false;
            u.commander = number;
            let (uav, launch) = (u.id, u.body.pose());
            self.judge.forget_position(uav);
            self.intruders.is_bound(uav, now_ms);
            self.unmapped.is_bound(uav, now_ms);
            if let Some(launchers) = &mut self.launchers {
                launchers.join(uav, launch, now_ms);
                launchers.hold(now_ms, &mut self.uavs, &mut self.facts);
            }
        }
    }

    /// Moves everything on to a time and judges what was flown.
    pub fn advance(&mut self, to_ms: u64) {
        while self.now_ms < to_ms {
            let step_ms = (self.now_ms / STEP_MS + 1) * STEP_MS;
            let change_ms = self.weather.next_after_ms(self.now_ms);
            let next_ms = to_ms.min(step_ms).min(change_ms.unwrap_or(u64::MAX));
            self.step(next_ms);
            self.now_ms = next_ms;
            if change_ms == Some(next_ms) {
                let wind = self.weather.at(next_ms);
                for u in &mut self.uavs {
                    u.body.take_wind(wind);
                }
            }
        }
        if let Some(crowd) = &mut self.crowd {
            crowd.advance(self.now_ms);
        }
    }

    fn step(&mut self, to_ms: u64) {
        self.airborne.clear();
        if let Some(launchers) = &mut self.launchers {
            launchers.hold(to_ms, &mut self.uavs, &mut self.facts);
        }
        for u in &mut self.uavs {
            if !u.body.airborne() {
                continue;
            }
            self.flown.clear();
            u.body.advance(to_ms, &mut self.flown);
            if u.body.failsafe() || u.body.takes_off_in_ms(to_ms) > 0 {
                self.intruders.is_bound(u.id, to_ms);
                self.unmapped.is_bound(u.id, to_ms);
            }
            if self.flown.is_empty() && u.body.takes_off_in_ms(to_ms) == 0 {
                // It takes off at this instant, and its camera shows what is below already.
                self.flown.push(Piece::at(u.body.pose(), to_ms));
            }
            for piece in &self.flown {
                self.judge.watch(u.id, u.body.eye(), piece, &mut self.facts);
            }
            if u.body.failsafe() != u.failsafe && u.body.airborne() {
                u.failsafe = u.body.failsafe();
                self.facts.push(Fact::Failsafe {
                    at_ms: to_ms,
                    uav: u.id,
                    on: u.failsafe,
                });
            }
            if let Some(cause) = u.body.lost() {
                let at_ms = self.flown.last().map_or(to_ms, |p| p.to_ms);
                self.facts.push(Fact::Lost {
                    at_ms,
                    uav: u.id,
                    cause,
                    place: u.body.position(),
                });
            } else if u.body.takes_off_in_ms(to_ms) == 0 {
                self.airborne.push((u.id, place_of(&u.body)));
                if to_ms.is_multiple_of(ground::LOOK_MS) {
                    self.judge.look_at_ground(&u.body, &self.site.obstacles);
                }
            }
        }
        self.vehicles.drive(to_ms, &self.airborne);
        self.services.drive(to_ms, &mut self.vehicles);
        self.judge.separate(
            to_ms,
            &self.airborne,
            self.min_separation_m,
            &mut self.facts,
        );
        self.intruders
            .observe(to_ms, &self.airborne, &mut self.facts);
        self.unmapped
            .observe(to_ms, &self.airborne, &mut self.facts);
    }
}

fn place_of(body: &Kinematic) -> Place {
    Place {
        at: body.position(),
        height_m: body.height_m(),
    }
}

#[cfg(test)]
mod tests {
    use super::fixture::straight;
    use super::*;
    use skein_flight::coverage::ring::CellId;

    fn fly(step_ms: u64) -> World {
        let spec = fixture::square(4);
        let mut w = World::new(&spec, 1);
        let mut t = 0;
        while t < 20_000 {
            if t % 500 == 0 {
                for id in 1..=3 {
                    assert!(w.apply(id, straight(t)));
                }
            }
            t += step_ms;
            w.advance(t);
        }
        w
    }

    #[test]
    fn the_same_flight_gives_the_same_world() {
        let (a, b) = (fly(100), fly(500));
        for id in 1..=4 {
            assert_eq!(a.percept(id), b.percept(id));
        }
        assert!(a.judge().sightings().eq(b.judge().sightings()));
        assert_eq!(format!("{:?}", a.facts), format!("{:?}", b.facts));
        assert!(a.judge().n_covered() > 10);
    }

    #[test]
    fn an_airframe_has_one_commander_until_that_is_quiet() {
        let mut spec = fixture::square(2);
        spec.traffic_range_m = 5_000.0;
        let mut second = spec.uavs[1].clone();
        (second.id, second.twin_of, second.aboard) = (7, Some(2), true);
        spec.uavs.push(second);
        let mut w = World::new(&spec, 1);
        assert_eq!(w.nodes(), [1, 2, 7, fixture::GROUND_ID]);
        assert_eq!(w.uavs().collect::<Vec<_>>(), [1, 2]);
        for t in (0..3_000).step_by(500) {
            assert!(w.apply(2, straight(t)) && !w.apply(7, straight(t)), "{t}");
            w.advance(t + 500);
        }
        assert_eq!(w.percept(7), w.percept(2));
        let senses: Vec<u16> = w.percept(7).unwrap().traffic.seen().map(|s| s.id).collect();
        assert_eq!(senses, [1], "nobody senses itself");
        assert!(w.antenna(7).is_some() && w.antenna(7) == w.antenna(2));
        // Its radio ends with its computer, and the other one flies when the failsafe is due.
        w.set_computer(2, false);
        assert!(w.antenna(2).is_none() && w.antenna(7).is_some());
        w.advance(3_400);
        assert!(!w.apply(2, straight(3_400)) && !w.apply(7, straight(3_400)));
        w.advance(3_500);
        assert!(w.apply(7, straight(3_500)));
        w.set_computer(2, true);
        w.advance(4_000);
        assert!(!w.apply(2, straight(4_000)) && w.apply(7, straight(4_000)));
        // It goes with the airframe, which comes back under its first commander.
        w.kill(7);
        assert!(w.percept(2).is_none() && w.antenna(7).is_none());
        w.respawn(2);
        assert!(w.apply(2, straight(4_000)) && !w.apply(7, straight(4_000)));
    }

    #[test]
    fn who_gets_no_setpoints_loiters() {
        let mut w = fly(500);
        assert!(w.percept(4).unwrap().failsafe);
        assert!(!w.percept(1).unwrap().failsafe);
        let facts = w.take_facts();
        let began: Vec<&Fact> = facts
            .iter()
            .filter(|f| matches!(f, Fact::Failsafe { .. }))
            .collect();
        assert_eq!(
            began,
            [&Fact::Failsafe {
                at_ms: 1000,
                uav: 4,
                on: true
            }]
        );
        let place = w.body(4).unwrap().position();
        w.advance(200_000);
        assert!((w.body(4).unwrap().position() - place).norm() < 40.0);
    }

    #[test]
    fn who_has_not_taken_off_stands_where_it_is() {
        let mut spec = fixture::square(2);
        spec.uavs[1].takeoff_ms = 3_000;
        let at = spec.uavs[1].launch.position() / fixture::LANE_M;
        let below = CellId {
            col: at.x as i16,
            row: at.y as i16,
        };
        let mut w = World::new(&spec, 1);
        w.advance(1_200);
        let ground = w.percept(2).unwrap();
        assert_eq!((ground.time_ms, ground.takes_off_in_ms), (1_200, 1_800));
        assert_eq!(ground.pose, spec.uavs[1].launch);
        assert!(!w.apply(2, straight(1_200)), "it flies nothing yet");
        assert_eq!(w.percept(1).unwrap().takes_off_in_ms, 0);
        w.advance(2_900);
        assert!(w.judge().sighting(below).is_none());
        w.advance(3_000);
        // Its percept of this instant shows what is below, and so does the judge.
        assert_eq!(w.percept(2).unwrap().takes_off_in_ms, 0);
        let seen = w.judge().sighting(below).unwrap();
        assert_eq!((seen.at_ms, seen.uav), (3_000, 2));
        assert!(w.apply(2, straight(3_000)));
        w.advance(3_500);
        let air = w.percept(2).unwrap();
        assert!(!air.failsafe && air.takes_off_in_ms == 0);
        assert!((air.pose.position() - ground.pose.position()).norm() > 5.0);
        assert!((air.endurance_s - ground.endurance_s + 0.5).abs() < 1e-9);
    }

    #[test]
    fn killed_and_respawned() {
        let spec = fixture::square(3);
        let mut w = World::new(&spec, 1);
        w.advance(5000);
        w.kill(2);
        w.kill(2);
        assert!(w.percept(2).is_none() && w.antenna(2).is_none());
        assert!(!w.apply(2, straight(5000)));
        w.set_computer(3, false);
        assert!(w.percept(3).is_some() && w.antenna(3).is_none());
        assert!(!w.apply(3, straight(5000)));
        w.advance(9000);
        w.respawn(2);
        w.respawn(3);
        assert!(w.antenna(2).is_some() && w.antenna(3).is_some());
        assert_eq!(w.percept(2).unwrap().pose, spec.uavs[1].launch);
        assert!(
            w.percept(3).unwrap().endurance_s < 3592.0,
            "the loitering one goes on"
        );
        let lost = w
            .take_facts()
            .into_iter()
            .filter(|f| matches!(f, Fact::Lost { .. }))
            .count();
        assert_eq!(lost, 1);
    }

    #[test]
    fn fuel_ends() {
        let mut spec = fixture::square(2);
        spec.uavs[0].airframe.endurance_s = 30.25;
        let mut w = World::new(&spec, 1);
        w.advance(60_000);
        let facts = w.take_facts();
        assert!(facts.iter().any(|f| matches!(
            f,
            Fact::Lost {
                at_ms: 30_250,
                uav: 1,
                cause: Loss::Fuel,
                ..
            }
        )));
        assert!(w.percept(1).is_none() && w.percept(2).is_some());
    }

    #[test]
    fn height_slots_separate_what_the_plane_does_not() {
        let mut spec = fixture::square(2);
        spec.uavs[1].launch = spec.uavs[0].launch;
        let mut w = World::new(&spec, 1);
        w.advance(1000);
        let c = w.judge().closest().unwrap();
        assert!((c.distance_m - 5.0).abs() < 1e-9);
        assert!(w.judge().sighting(CellId { col: 0, row: 0 }).is_some());
        assert!(
            !w.take_facts()
                .iter()
                .any(|f| matches!(f, Fact::TooClose(_)))
        );
    }
}
