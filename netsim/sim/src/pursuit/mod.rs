//! Pursuits: vehicles on roads, and UAVs that follow them (D2.7 §1.5.2, §3.7).
//!
//! The laws, estimates and hand-overs of [`skein_flight::tracking`] fly kinematic airframes in
//! a wind; cameras see vehicles or do not; statements are lost; a judge who knows the truth
//! measures what it came to.
//!
//! | module | what it holds |
//! |---|---|
//! | [`roads`] | the street map |
//! | [`vehicle`] | who drives there, by a script or away from UAVs |
//! | [`camera`] | what is in the picture, and what is hidden |
//! | [`sensor`] | detections with errors, misses and false alarms |
//! | `flyer` | one UAV: percept in, setpoint and statement out |
//! | `search` | what it does about a target that it lost |
//! | `judge` | what it came to |
//! | [`totals`] | what many runs come to |

pub mod camera;
mod flyer;
mod judge;
pub mod roads;
mod search;
pub mod sensor;
#[cfg(test)]
mod tests;
pub mod totals;
pub mod vehicle;

use crate::spec::Building;
use crate::world::motion::Kinematic;
use crate::world::obstacles::{Obstacles, Place};
use camera::Optics;
use flyer::{Flyer, Statement};
use judge::{Judge, Look};
use nalgebra::Matrix2;
use roads::Roads;
use sensor::{Noise, Seen};
use skein_flight::airframe::{Airframe, CLIMB_MPS};
use skein_flight::mount::Mount;
use skein_flight::tracking::bend::Guard;
use skein_flight::tracking::estimate::{Detection, Estimate};
use skein_flight::tracking::field::Field;
use skein_flight::tracking::follower::TargetMotion;
use skein_flight::tracking::fusion::Register;
use skein_flight::tracking::mode::Airspeeds;
use skein_flight::tracking::streets::Streets;
use skein_flight::tracking::tracks::{Kind, TargetName};
use skein_flight::trajectory::wind::Wind;
use skein_geometry::NoFlyZones;
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::{TAU, seconds, sin_cos};
use skein_geometry::random::{SplitMix64, mix};
use totals::Pursuit;
use vehicle::{Behaviour, Vehicle};

/// A percept and a look each so many milliseconds.
pub const LOOK_MS: u64 = 200;

/// The world moves in steps of this, milliseconds.
const STEP_MS: u64 = 50;

/// Kinds of vehicles that a detector tells apart.
pub const KINDS: u8 = 4;

/// The kind that is followed; others are in the way.
pub const FOLLOWED: Kind = Kind(1);

/// Density of the acceleration of targets, m²/s³: a car that brakes or turns off at 2.5 m/s²
/// for some three seconds, a quarter of the time.
pub const DENSITY: f64 = 5.0;

/// What was flown is judged once it has been so for this long, seconds: a circle that was
/// left is reached again by the factor e every three.
const SETTLED_S: f64 = 20.0;

/// A target this much slower than the fastest airspeed can be kept up with.
const KEEPS: f64 = 1.1;

/// The lowest of them flies at this height, metres; each other one higher by a step.
const HEIGHT_M: f64 = 120.0;

/// Heights of UAVs differ by this, metres.
const HEIGHT_STEP_M: f64 = 8.0;

/// Statements that are lost when noise is on, each for each listener.
const LOSS: f64 = 0.1;

/// The operator is author of this number.
const OPERATOR: u16 = 0;

/// It tells of what nobody has seen yet so often, milliseconds.
const CUE_MS: u64 = 2_000;

/// What UAVs know of a town, and what they do with it.
#[allow(
    clippy::struct_excessive_bools,
    reason = "each is one thing to leave out"
)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Knows {
    /// Its buildings: circles are chosen by them, and ground behind them is not taken as looked
    /// at.
    pub buildings: bool,
    /// Its streets: targets are expected on them.
    pub streets: bool,
    /// Who lost its target searches for it; else it looks round about where that should be.
    pub searches: bool,
    /// Where the targets are, whether they are seen or not: the most that sight can come to.
    pub targets: bool,
}

impl Default for Knows {
    fn default() -> Self {
        Self {
            buildings: true,
            streets: true,
            searches: true,
            targets: false,
        }
    }
}

/// What of a town a UAV knows.
#[derive(Clone, Copy, Default)]
pub(crate) struct Town<'a> {
    buildings: Option<&'a Obstacles>,
    streets: Option<&'a Streets>,
    searches: bool,
}

/// A pursuit, but for its seed.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The streets.
    pub roads: Roads,
    /// Buildings that hide what is behind them; none where nothing shall be hidden.
    pub buildings: Option<std::sync::Arc<Obstacles>>,
    /// Where no UAV may fly, and how far from it.
    pub zones: Option<(NoFlyZones, f64)>,
    /// UAVs.
    pub uavs: u16,
    /// Vehicles that are followed.
    pub targets: u16,
    /// Wind, m/s; its direction is drawn.
    pub wind_mps: f64,
    /// The usual speed of a target on a straight road, m/s.
    pub target_mps: f64,
    /// What the targets do; drawn where it is left open.
    pub behaviour: Option<Behaviour>,
    /// The field of the orbits.
    pub field: Field,
    /// The airspeeds that may be flown; all that the airframe has where it is left open.
    pub airspeeds: Option<Airspeeds>,
    /// The stand-off, metres.
    pub stand_off_m: f64,
    /// The camera.
    pub optics: Optics,
    /// Errors of sensors; without any, UAVs know exactly what they see.
    pub noise: Option<Noise>,
    /// What UAVs know of the town.
    pub knows: Knows,
    /// Whether one that follows is taken away on the way.
    pub kill: bool,
    /// How long it lasts, seconds.
    pub lasts_s: f64,
}

impl Settings {
    /// The usual pursuit on these roads: two UAVs after one target at 8 m/s in calm air for 300 s,
    /// nothing that hides it, no noise, and nobody taken away.
    #[must_use]
    pub fn on(roads: Roads) -> Self {
        Self {
            roads,
            buildings: None,
            zones: None,
            uavs: 2,
            targets: 1,
            wind_mps: 0.0,
            target_mps: 8.0,
            behaviour: None,
            field: Field::HOPF,
            airspeeds: None,
            stand_off_m: 150.0,
            optics: Optics::gimballed(),
            noise: None,
            knows: Knows::default(),
            kill: false,
            lasts_s: 300.0,
        }
    }
}

/// A vehicle that is followed, as it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Truth {
    motion: TargetMotion,
    /// Whether it is below a roof, where nobody sees it.
    is_covered: bool,
}

/// The fixed wing of the published comparisons: cruise 20 m/s, 30° of bank.
#[must_use]
pub fn airframe() -> Airframe {
    Airframe {
        stall_mps: 12.0,
        cruise_mps: 20.0,
        max_mps: 26.0,
        max_bank_rad: 30.0_f64.to_radians(),
        endurance_s: 7_200.0,
        reserve_s: 300.0,
        footprint_across_m: 40.0,
        footprint_along_m: 30.0,
        mount: Mount::Level,
        climb_mps: CLIMB_MPS,
    }
}

/// Prepares buildings for many runs.
#[must_use]
pub fn obstacles(buildings: &[Building]) -> Obstacles {
    Obstacles::new(buildings)
}

/// All that moves.
struct World<'a> {
    settings: &'a Settings,
    /// Its streets as UAVs know them.
    streets: Option<Streets>,
    wind: Wind,
    vehicles: Vec<Vehicle>,
    /// Parked ones of other kinds.
    others: Vec<Seen>,
    flyers: Vec<Flyer>,
    lost: SplitMix64,
    operator: SplitMix64,
    judge: Judge,
}

/// Flies a pursuit to its end.
#[must_use]
pub fn run(settings: &Settings, seed: u64) -> Pursuit {
    let mut world = World::new(settings, seed);
    let mut random = SplitMix64::new(mix(seed ^ 0x0DEA_D000));
    let kill_s = 60.0 + 0.4 * settings.lasts_s * random.unit();
    let mut killed = !settings.kill || settings.uavs < 2;
    let mut now_ms = 0;
    while seconds(now_ms) < settings.lasts_s {
        if now_ms.is_multiple_of(CUE_MS) {
            world.tell(now_ms);
        }
        if now_ms.is_multiple_of(LOOK_MS) {
            world.think(now_ms);
        }
        world.drive(now_ms);
        world.fly(now_ms);
        now_ms += STEP_MS;
        if !killed && seconds(now_ms) >= kill_s {
            killed = world.take_away(seconds(now_ms));
        }
    }
    let switches = world.flyers.iter().map(Flyer::switches).sum();
    world.judge.finish(switches)
}

impl<'a> World<'a> {
    fn new(settings: &'a Settings, seed: u64) -> Self {
        let mut random = SplitMix64::new(mix(seed));
        let (s, c) = sin_cos(TAU * random.unit());
        let wind = Wind::new(settings.wind_mps * c, settings.wind_mps * s);
        let vehicles: Vec<Vehicle> = (0..settings.targets)
            .map(|_| {
                let drawn = [
                    Behaviour::Drives,
                    Behaviour::StopsAndGoes,
                    Behaviour::Evades,
                ][random.below(3)];
                let behaviour = settings.behaviour.unwrap_or(drawn);
                Vehicle::new(
                    &settings.roads,
                    behaviour,
                    settings.target_mps,
                    random.bits(),
                )
            })
            .collect();
        let others = (0..6)
            .map(|i| {
                let v = Vehicle::new(&settings.roads, Behaviour::Parked, 0.0, random.bits());
                Seen {
                    at: v.at,
                    kind: Kind(2 + i % 2),
                }
            })
            .collect();
        let mut flyers = Vec::new();
        for (id, nth) in (1..=settings.uavs).zip(0_u32..) {
            // They come from some hundred metres away, each to a target of its own.
            let of = vehicles.get(nth as usize % vehicles.len().max(1));
            let near = of.map_or_else(Point::origin, |v| v.at);
            let (s, c) = sin_cos(TAU * random.unit());
            let far_m = 250.0 + 200.0 * random.unit();
            let from = near + Vector::new(c, s) * far_m;
            let launch = Pose::new(from, TAU * random.unit());
            let height_m = HEIGHT_M + HEIGHT_STEP_M * f64::from(nth);
            let body = Kinematic::new(airframe(), launch, height_m, 0).in_wind(wind);
            flyers.push(Flyer::new(id, body, settings, random.bits()));
        }
        Self {
            settings,
            streets: settings
                .knows
                .streets
                .then(|| Streets::of(&settings.roads.lines()))
                .flatten(),
            wind,
            judge: Judge::new(settings.stand_off_m, wind, vehicles.len()),
            vehicles,
            others,
            flyers,
            lost: SplitMix64::new(mix(seed ^ 0x0105_5000)),
            operator: SplitMix64::new(mix(seed ^ 0x0C0E_5000)),
        }
    }

    /// The operator tells of what nobody has seen.
    fn tell(&mut self, now_ms: u64) {
        let unseen = self.judge.unseen();
        let cues = cues(&self.vehicles, &unseen, now_ms, &mut self.operator);
        for f in &mut self.flyers {
            f.told(&cues);
        }
    }

    fn drive(&mut self, now_ms: u64) {
        let uavs: Vec<Point> = self.flyers.iter().map(|f| f.body.position()).collect();
        for v in &mut self.vehicles {
            v.drive(&self.settings.roads, seconds(now_ms), &uavs);
        }
    }

    /// Where a target is, as one that knows it would say: UAVs take turns.
    fn told(&self, f: &Flyer) -> Option<TargetMotion> {
        let count = self.vehicles.len();
        if !self.settings.knows.targets || count == 0 {
            return None;
        }
        let nth = usize::from(f.id.saturating_sub(1)) % count;
        Some(self.truth()[nth].motion)
    }

    fn obstacles(&self) -> Option<&'a Obstacles> {
        self.settings.buildings.as_deref()
    }

    /// All look, tell, hear, decide and steer.
    fn think(&mut self, now_ms: u64) {
        let obstacles = self.obstacles();
        let mut seen: Vec<Seen> = self.others.clone();
        let followed = self.vehicles.iter().map(|v| Seen {
            at: v.at,
            kind: FOLLOWED,
        });
        seen.extend(followed);
        let statements: Vec<Statement> = self
            .flyers
            .iter_mut()
            .map(|f| f.look(&seen, obstacles, now_ms))
            .collect();
        let loss = if self.settings.noise.is_some() {
            LOSS
        } else {
            0.0
        };
        for f in &mut self.flyers {
            let own = f.id;
            for s in statements.iter().filter(|s| s.author != own) {
                if self.lost.unit() >= loss {
                    f.hear(s, now_ms);
                }
            }
        }
        let truth = self.truth();
        let knows = self.settings.knows;
        let town = Town {
            buildings: obstacles.filter(|_| knows.buildings),
            streets: self.streets.as_ref(),
            searches: knows.searches,
        };
        for f in &mut self.flyers {
            f.decide(&town, now_ms);
        }
        for f in &self.flyers {
            let own: Vec<Register> = f.registers().copied().collect();
            self.judge.consistency(now_ms, &truth, &own, f.targets());
        }
        let is_exact = self.settings.noise.is_none();
        let exact: Vec<Option<TargetMotion>> = self
            .flyers
            .iter()
            .map(|f| {
                let seen = || self.exact(f, &truth).filter(|_| is_exact);
                self.told(f).or_else(seen)
            })
            .collect();
        let zones = self.settings.zones.as_ref();
        let guard = zones.map(|(zones, clearance_m)| Guard {
            zones,
            clearance_m: *clearance_m,
        });
        for (f, exact) in self.flyers.iter_mut().zip(exact) {
            let settings = self.settings;
            f.steer(settings, self.wind, (&town, guard.as_ref()), exact, now_ms);
        }
    }

    /// The motion of what a UAV follows, if some UAV sees it: without noise they know it.
    fn exact(&self, f: &Flyer, truth: &[Truth]) -> Option<TargetMotion> {
        let i = judge::nearest(truth, f.target()?.estimate.position())?;
        let at = truth[i].motion.position;
        let obstacles = self.obstacles();
        let seen = self.flyers.iter().any(|f| f.camera.sees(at, obstacles));
        seen.then_some(truth[i].motion)
    }

    /// The airframes and cameras move, and the judge looks.
    fn fly(&mut self, now_ms: u64) {
        let (then_ms, step_s) = (now_ms + STEP_MS, seconds(STEP_MS));
        let mut flown = Vec::new();
        let told: Vec<Option<Point>> = self
            .flyers
            .iter()
            .map(|f| self.told(f).map(|m| m.position))
            .collect();
        for (f, told) in self.flyers.iter_mut().zip(told) {
            f.body.advance(then_ms, &mut flown);
            f.turn_camera(step_s, told, then_ms);
        }
        let truth = self.truth();
        let obstacles = self.obstacles();
        let looks: Vec<Look<'_>> = self
            .flyers
            .iter()
            .map(|f| Look {
                id: f.id,
                pose: f.body.pose(),
                airframe: f.body.airframe(),
                command: f.last(),
                mode: f.mode(),
                target: f.target(),
                is_aside: f.is_aside(),
                sees: truth
                    .iter()
                    .map(|t| f.camera.sees(t.motion.position, obstacles))
                    .collect(),
                frames: truth
                    .iter()
                    .map(|t| f.camera.frames(t.motion.position))
                    .collect(),
            })
            .collect();
        self.judge.observe(seconds(then_ms), step_s, &truth, &looks);
        if let Some((zones, clearance_m)) = &self.settings.zones {
            for l in &looks {
                let near = zones.distance_m(l.pose.position()) < clearance_m - 1e-6;
                self.judge.near_zone(near, step_s);
            }
        }
    }

    fn truth(&self) -> Vec<Truth> {
        self.vehicles
            .iter()
            .map(|v| Truth {
                motion: TargetMotion {
                    position: v.at,
                    velocity_mps: v.velocity_mps(),
                    acceleration_mps2: v.acceleration_mps2(),
                },
                is_covered: self.obstacles().is_some_and(|o| is_covered(v.at, o)),
            })
            .collect()
    }

    /// Takes away a UAV that follows and sees a target, if there is one.
    fn take_away(&mut self, now_s: f64) -> bool {
        let truth = self.truth();
        let obstacles = self.obstacles();
        let of = |f: &Flyer| {
            let i = judge::nearest(&truth, f.target()?.estimate.position())?;
            let sees = f.camera.sees(truth[i].motion.position, obstacles);
            sees.then_some(i)
        };
        let found = (0..self.flyers.len()).find_map(|n| Some((n, of(&self.flyers[n])?)));
        if let Some((n, target)) = found {
            self.flyers.remove(n);
            self.judge.take_away(now_s, target);
        }
        found.is_some()
    }
}

/// Whether a place is below a roof.
fn is_covered(at: Point, obstacles: &Obstacles) -> bool {
    const ABOVE_M: f64 = 1_000.0;
    let place = |height_m| Place { at, height_m };
    !obstacles.sees(place(0.0), place(ABOVE_M))
}

/// What an operator tells of the targets that nobody has seen yet: where they are, roughly.
fn cues(
    vehicles: &[Vehicle],
    unseen: &[bool],
    now_ms: u64,
    random: &mut SplitMix64,
) -> Vec<Register> {
    const OFF_M: f64 = 15.0;
    let mut cues = Vec::new();
    for ((v, unseen), number) in vehicles.iter().zip(unseen).zip(1..) {
        let off = Vector::new(random.normal(), random.normal()) * OFF_M;
        if !unseen {
            continue;
        }
        let detection = Detection {
            at: v.at + off,
            covariance_m2: Matrix2::identity() * (OFF_M * OFF_M),
        };
        cues.push(Register {
            author: OPERATOR,
            name: TargetName {
                author: OPERATOR,
                number,
            },
            kind: FOLLOWED,
            seen_ms: now_ms,
            estimate: Estimate::first(now_ms, &detection),
        });
    }
    cues
}
