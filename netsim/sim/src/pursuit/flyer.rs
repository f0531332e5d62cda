//! One UAV of a pursuit: what it sees, what it knows, what it follows and how it flies.
//!
//! It decides by percepts and by what others told it; nothing here sees the truth but the
//! camera and the sensor. With noise off the motion of what is in the picture is handed over
//! exactly: then it is the guidance that is measured.

use super::camera::{Attitude, Camera};
use super::search::{Memory, Search};
use super::sensor::{Noise, Seen, Sensor};
use super::{DENSITY, FOLLOWED, LOOK_MS, OPERATOR, Settings, Town};
use crate::world::motion::Kinematic;
use crate::world::obstacles::Obstacles;
use skein_behaviors::setpoint::{Setpoint, Side, Steer};
use skein_flight::tracking::bend::Guard;
use skein_flight::tracking::follower::{self, Command, Follower, StandOff, TargetMotion};
use skein_flight::tracking::fusion::{Board, Fused, Register};
use skein_flight::tracking::handover::{Wanted, Watch, assign};
use skein_flight::tracking::mode::{Airspeeds, Mode};
use skein_flight::tracking::tracks::{TargetName, Tracks};
use skein_flight::tracking::vantage::{Vantage, View};
use skein_flight::trajectory::wind::Wind;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::math::{seconds, sin_cos};
use std::collections::BTreeMap;

/// Who was not heard of for so long is taken for gone, milliseconds: ten statements.
const GONE_MS: u64 = 2_000;

/// What was told of a target counts for so long, milliseconds.
const TOLD_MS: u64 = 8_000;

/// A target seen this recently is seen, milliseconds.
const SEEN_MS: u64 = 1_000;

/// What a UAV tells the others.
#[derive(Clone, Debug)]
pub(super) struct Statement {
    pub(super) author: u16,
    pub(super) watch: Watch,
    pub(super) registers: Vec<Register>,
    /// What it looks at.
    pub(super) camera: Camera,
    /// Where it flies to, while it searches.
    pub(super) searches: Option<Point>,
}

/// A UAV.
pub(super) struct Flyer {
    pub(super) id: u16,
    pub(super) body: Kinematic,
    pub(super) camera: Camera,
    sensor: Sensor,
    tracks: Tracks,
    board: Board,
    heard: BTreeMap<u16, (u64, Watch)>,
    follows: Option<TargetName>,
    follower: Option<Follower>,
    targets: Vec<Fused>,
    turn_rate_radps: f64,
    last: Option<Command>,
    switches: u32,
    noise: Option<Noise>,
    vantage: Vantage,
    /// From the target to the middle of its circle, metres.
    beside: Vector,
    memory: Memory,
    /// The search for what it follows, while that is out of sight.
    search: Option<Search>,
    /// What the cameras of all looked at since it decided last, and where others search.
    pictures: Vec<Camera>,
    searched: BTreeMap<u16, Point>,
}

impl Flyer {
    pub(super) fn new(id: u16, body: Kinematic, settings: &Settings, seed: u64) -> Self {
        let noise = settings.noise;
        Self {
            id,
            body,
            camera: Camera::new(settings.optics),
            sensor: Sensor::new(noise, seed),
            tracks: Tracks::new(id, DENSITY),
            board: Board::default(),
            heard: BTreeMap::new(),
            follows: None,
            follower: None,
            targets: Vec::new(),
            turn_rate_radps: 0.0,
            last: None,
            switches: 0,
            noise,
            vantage: Vantage::default(),
            beside: Vector::zeros(),
            memory: Memory::default(),
            search: None,
            pictures: Vec::new(),
            searched: BTreeMap::new(),
        }
    }

    /// Hears what the operator tells of targets.
    pub(super) fn told(&mut self, cues: &[Register]) {
        for cue in cues {
            self.board.put(*cue);
        }
    }

    /// What all know of the targets, as it has heard.
    pub(super) fn targets(&self) -> &[Fused] {
        &self.targets
    }

    /// The first of its commands in force.
    pub(super) fn last(&self) -> Option<&Command> {
        self.last.as_ref()
    }

    /// What it tells of the targets that it sees itself.
    pub(super) fn registers(&self) -> impl Iterator<Item = &Register> {
        self.board.registers().filter(|r| r.author == self.id)
    }

    /// Whether it loiters or weaves.
    pub(super) fn mode(&self) -> Option<Mode> {
        self.follower.as_ref().and_then(|f| f.switch().mode())
    }

    /// How often it changed between loiter and weave.
    pub(super) fn switches(&self) -> u32 {
        self.switches + self.follower.as_ref().map_or(0, |f| f.switch().changes())
    }

    /// Whether the middle of its circle is aside of the target.
    pub(super) fn is_aside(&self) -> bool {
        self.beside != Vector::zeros()
    }

    /// The camera turns while it flies; `told` is where the target is, if that is known.
    pub(super) fn turn_camera(&mut self, over_s: f64, told: Option<Point>, now_ms: u64) {
        let pose = self.body.pose();
        let airspeed_mps = self
            .last
            .map_or(self.body.airframe().cruise_mps, |c| c.airspeed_mps);
        let attitude = Attitude::of(
            self.body.airframe(),
            pose.heading_rad,
            airspeed_mps,
            self.turn_rate_radps,
        );
        let displaced = self.sensor.displaced();
        let glances = self
            .target()
            .map(|t| t.expected(now_ms, DENSITY) + searched(t, now_ms));
        let searches = self.search.as_ref().and_then(Search::glance);
        let aim = told.or_else(|| searches.or(glances).map(|p| p - displaced));
        self.camera
            .advance(&pose, self.body.height_m(), &attitude, aim, over_s);
    }

    /// Takes in a look of its camera, what it follows from it, and says what it tells.
    pub(super) fn look(
        &mut self,
        vehicles: &[Seen],
        obstacles: Option<&Obstacles>,
        now_ms: u64,
    ) -> Statement {
        let (at, height_m) = (self.body.position(), self.body.height_m());
        let sightings = self
            .sensor
            .look(&self.camera, at, height_m, vehicles, obstacles);
        let (camera, displaced) = (&self.camera, self.sensor.displaced());
        let in_view = |p: Point| {
            let p = p - displaced;
            camera.sees(p, obstacles)
        };
        self.tracks.look(now_ms, &sightings, &in_view);
        let place_m = self.noise.map_or(0.0, |n| n.place_m);
        let mut own: Vec<Register> = self
            .tracks
            .confirmed()
            .map(|t| Register {
                author: self.id,
                name: t.name,
                kind: t.kind,
                seen_ms: t.seen_ms,
                estimate: t.estimate.told(place_m),
            })
            .collect();
        for r in &mut own {
            if self.board.is_contradicted(r, DENSITY) {
                r.name = self.tracks.name_anew(r.name);
            }
            let name = self.board.name_of(r, DENSITY);
            if self.tracks.rename(r.name, name) {
                r.name = name;
            }
        }
        self.board.forget(now_ms.saturating_sub(TOLD_MS));
        let mut registers = Vec::new();
        for r in own {
            if r.kind == FOLLOWED && self.board.put(r) {
                registers.push(r);
            }
        }
        let camera = self.camera.told(self.sensor.displaced());
        self.pictures.push(camera.clone());
        Statement {
            author: self.id,
            watch: self.watch(now_ms),
            registers,
            camera,
            searches: self.search.as_ref().and_then(Search::aim),
        }
    }

    /// Hears what another one tells.
    pub(super) fn hear(&mut self, statement: &Statement, now_ms: u64) {
        self.heard
            .insert(statement.author, (now_ms, statement.watch));
        for r in &statement.registers {
            self.board.put(*r);
        }
        self.pictures.push(statement.camera.clone());
        match statement.searches {
            Some(aim) => self.searched.insert(statement.author, aim),
            None => self.searched.remove(&statement.author),
        };
    }

    /// Decides what it follows, by what all have told.
    pub(super) fn decide(&mut self, town: &Town<'_>, now_ms: u64) {
        self.heard.retain(|_, (at, _)| *at + GONE_MS >= now_ms);
        let heard = &self.heard;
        self.searched.retain(|id, _| heard.contains_key(id));
        let fused = self.board.fused(now_ms, DENSITY);
        self.targets = fused.into_iter().filter(|t| t.kind == FOLLOWED).collect();
        let mut watches: BTreeMap<u16, Watch> =
            self.heard.iter().map(|(id, (_, w))| (*id, *w)).collect();
        watches.insert(self.id, self.watch(now_ms));
        let mut wanted: Vec<Wanted> = self
            .targets
            .iter()
            .map(|t| Wanted {
                name: t.name,
                at: t.estimate.position(),
            })
            .collect();
        if town.searches {
            let board = &self.board;
            let is_seen = |name: TargetName| {
                let mut told = board.registers().filter(|r| r.name == name);
                told.any(|r| r.author != OPERATOR)
            };
            self.memory.learn(&self.targets, &is_seen, now_ms);
            // Who is lost is looked for by those who are left when all others are followed.
            let spare = watches.len().saturating_sub(wanted.len());
            let lost = self.memory.lost(&self.targets);
            wanted.extend(lost.into_iter().take(spare));
        }
        let follows = assign(&watches, &wanted).follows.get(&self.id).copied();
        if follows.is_some() {
            // One target under another name is still the same.
            let moved = self.jump_m(follows);
            if self.follows != follows && moved > SAME_PLACE_M {
                self.switches = self.switches();
                self.follower = None;
            }
            self.follows = follows;
        }
        self.search(town, now_ms);
    }

    /// What it does about a target that is out of sight.
    fn search(&mut self, town: &Town<'_>, now_ms: u64) {
        let pictures = core::mem::take(&mut self.pictures);
        let known = self.follows.and_then(|name| self.memory.of(name));
        let last = known.filter(|l| town.searches && l.at_ms + SEARCH_MS <= now_ms);
        let Some(last) = last else {
            self.search = None;
            return;
        };
        let goes_on = self.search.take().filter(|s| s.is_of(&last));
        let mut search = goes_on.unwrap_or_else(|| Search::new(&last, town.streets));
        let Some(camera) = pictures.first() else {
            return;
        };
        search.look(&pictures, town, now_ms);
        // Of two the one of the lesser number goes where both would.
        let lesser = self.searched.iter().filter(|(id, _)| **id < self.id);
        let others: Vec<Point> = lesser.map(|(_, at)| *at).collect();
        let again = self.follows.and_then(|n| self.memory.again(n, now_ms));
        let expected = self.target().map(|t| t.expected(now_ms, DENSITY));
        search.choose(camera, town, (&others, again), expected, now_ms);
        self.search = Some(search);
    }

    /// How far apart what it follows and what it is to follow are, metres.
    fn jump_m(&self, to: Option<TargetName>) -> f64 {
        let place = |name: Option<TargetName>| {
            let found = self.targets.iter().find(|t| Some(t.name) == name);
            found.map(|t| t.estimate.position())
        };
        match (place(self.follows), place(to)) {
            (Some(a), Some(b)) => (a - b).norm(),
            _ => f64::INFINITY,
        }
    }

    /// Flies on: `exact` is the motion of what it follows, if nothing hides it and noise is
    /// off.
    pub(super) fn steer(
        &mut self,
        settings: &Settings,
        wind: Wind,
        (town, guard): (&Town<'_>, Option<&Guard<'_>>),
        exact: Option<TargetMotion>,
        now_ms: u64,
    ) {
        let known = self.target().map(|t| t.motion(now_ms, DENSITY));
        let searches = self.search.as_ref().and_then(Search::motion);
        let Some(mut motion) = exact.or(searches).or(known) else {
            return self.hold(now_ms);
        };
        let pose = self.body.pose();
        let airframe = *self.body.airframe();
        let follower = self.follower.get_or_insert_with(|| {
            Follower::new(follower::Settings {
                airframe,
                airspeeds: settings
                    .airspeeds
                    .unwrap_or_else(|| Airspeeds::of(&airframe)),
                field: settings.field,
                stand_off: StandOff::Distance(settings.stand_off_m),
            })
        });
        // It takes itself to be where its own navigation says.
        let mut own = pose;
        own.east_m += self.sensor.displaced().x;
        own.north_m += self.sensor.displaced().y;
        if let Some(buildings) = town.buildings {
            let camera = &self.camera;
            let view = View {
                sees: &|from, at| camera.would_see(from.position(), at, buildings),
                aside: &|_, _| Vector::zeros(),
                reach_m: camera.reach_m(),
                streets: town.streets,
            };
            let circle = self
                .vantage
                .choose(follower, (own, wind), &motion, &view, now_ms);
            follower.circle(circle.map(|c| c.radius_m));
            self.beside = circle.map_or_else(Vector::zeros, |c| c.beside);
            motion.position += self.beside;
        }
        let commands = follower.commands(own, wind, &motion, seconds(LOOK_MS), guard);
        self.fly(&commands, now_ms);
    }

    /// It knows of no target: it circles where it is, by its airframe's own rule.
    fn hold(&mut self, now_ms: u64) {
        let airframe = self.body.airframe();
        let airspeed_mps = airframe.cruise_mps;
        let turn_rate_radps = 0.7 * airframe.max_turn_rate_radps(airspeed_mps);
        self.last = None;
        self.turn_rate_radps = turn_rate_radps;
        self.apply(airspeed_mps, vec![(turn_rate_radps, LOOK_MS)], now_ms);
    }

    fn fly(&mut self, commands: &[Command], now_ms: u64) {
        let Some(first) = commands.first() else {
            return;
        };
        self.last = Some(*first);
        self.turn_rate_radps = first.turn_rate_radps;
        let each_ms = LOOK_MS / (commands.len() as u64).max(1);
        let turns = commands.iter().map(|c| (c.turn_rate_radps, each_ms));
        self.apply(first.airspeed_mps, turns.collect(), now_ms);
    }

    fn apply(&mut self, airspeed_mps: f64, turns: Vec<(f64, u64)>, now_ms: u64) {
        let steps = turns
            .into_iter()
            .map(|(turn_rate_radps, ms)| Steer {
                turn_rate_radps,
                duration_ms: u32::try_from(ms).unwrap_or(u32::MAX),
            })
            .collect();
        let setpoint = Setpoint {
            from_ms: now_ms,
            airspeed_mps,
            height_m: self.body.height_m(),
            steps,
            loiter: Side::Left,
            gimbal: Vec::new(),
            launch: skein_behaviors::setpoint::Launch::Stay,
            promised: None,
        };
        self.body.apply(setpoint, now_ms);
    }

    /// What it says of itself.
    fn watch(&self, now_ms: u64) -> Watch {
        let sees = self
            .tracks
            .confirmed()
            .any(|t| Some(t.name) == self.follows && t.seen_ms + SEEN_MS >= now_ms);
        Watch {
            at: self.body.position() + self.sensor.displaced(),
            airspeed_mps: self.body.airframe().cruise_mps,
            follows: self.follows,
            sees,
            leaving: false,
        }
    }

    /// What all know of the target that it follows.
    pub(super) fn target(&self) -> Option<&Fused> {
        self.targets.iter().find(|t| Some(t.name) == self.follows)
    }
}

/// For so long nobody may see a target before it is searched for, or looked for beside where it
/// should be, milliseconds.
const SEARCH_MS: u64 = 1_200;

/// The camera looks elsewhere so often, milliseconds.
const GLANCE_MS: u64 = 400;

/// Where the camera looks beside that: round about, as far as the target may have come.
fn searched(t: &Fused, now_ms: u64) -> Vector {
    if t.unseen_s(now_ms) < seconds(SEARCH_MS) {
        return Vector::zeros();
    }
    let glance = now_ms / GLANCE_MS;
    // Directions by the golden angle, distances by a sawtooth: no place is left out for long.
    #[allow(clippy::cast_precision_loss, reason = "a remainder")]
    let (way, far) = ((glance % 1_000) as f64 * 2.4, (glance % 3 + 1) as f64 / 3.0);
    let (s, c) = sin_cos(way);
    let widest_m = (1.5 * t.estimate.spread_m()).min(WIDEST_M);
    Vector::new(c, s) * (far * widest_m)
}

/// No farther than this beside where it should be, metres.
const WIDEST_M: f64 = 200.0;

/// A target that moved less by changing its name is the same, metres.
const SAME_PLACE_M: f64 = 40.0;
