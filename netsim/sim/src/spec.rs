//! A scenario with nothing left to resolve: no file names, no units to convert.

use crate::fault::TimedFault;
use crate::pursuit::roads::Roads;
use crate::pursuit::vehicle::Behaviour;
use crate::twins::Twins;
use crate::weather::Weather;
use skein_behaviors::obstacle::Obstacle;
use skein_flight::airframe::Airframe;
use skein_flight::streets::Network;
use skein_flight::trajectory::timed::Objective;
use skein_geometry::Polygon;
use skein_geometry::frame::{Point, Pose};
use skein_peer::Mission;
use skein_peer::config::Launch;
use skein_peer::mission::mm;
use std::sync::Arc;

/// Everything a run needs, besides a seed.
#[derive(Clone, Debug)]
pub struct Spec {
    /// Name of the scenario.
    pub name: String,
    /// First part of every key.
    pub fleet: String,
    /// The mission, as the operator speaks it.
    pub mission: Arc<Mission>,
    /// Buildings, which block radio.
    pub buildings: Vec<Building>,
    /// No-fly zones as they are, for the judge.
    pub zones: Vec<Polygon>,
    /// The flying peers, ascending by id.
    pub uavs: Vec<UavSpec>,
    /// The ground station, if there is one.
    pub ground: Option<GroundStationSpec>,
    /// The wind, everywhere the same.
    pub wind: Weather,
    /// What UAVs spend little of, off the loop.
    pub objective: Objective,
    /// The radio.
    pub radio: RadioSpec,
    /// Beacon period T, milliseconds.
    pub beacon_period_ms: u32,
    /// Time between percepts, milliseconds.
    pub percept_period_ms: u32,
    /// Scenario seconds per second of wall time in a trial, at most 10.
    pub time_scale: f64,
    /// A run that lasts longer has failed, seconds.
    pub max_time_s: u32,
    /// Share of the area that must be coverable, 0 to 1.
    pub min_coverable: f64,
    /// Smallest separation of airborne UAVs, metres: recorded, and a rule where the mission
    /// has UAVs keep apart by agreement.
    pub min_separation_m: f64,
    /// Within so many seconds what the operator asks to be looked at is seen, or the run has
    /// failed; any time will do where none is said.
    pub max_visit_s: Option<u32>,
    /// How far UAVs sense each other, metres; 0 without such sensors.
    pub traffic_range_m: f64,
    /// Vehicles on the ground, of which cameras see those in their pictures.
    pub vehicles: Vec<VehicleSpec>,
    /// Services on the ground, which drive to what the ground station knows to be followed.
    pub services: Vec<ServiceSpec>,
    /// Aircraft that are no members of the fleet and make way for nobody.
    pub intruders: Vec<IntruderSpec>,
    /// Obstacles that no peer has on its map.
    pub obstacles: Vec<ObstacleSpec>,
    /// How far UAVs sense them, metres; 0 without such sensors.
    pub obstacle_range_m: f64,
    /// A road or a fire that no peer knows, of which cameras see what is in their pictures.
    pub contour: Option<ContourSpec>,
    /// The people of a mass event, of whom cameras see those in their pictures.
    pub crowd: Option<CrowdSpec>,
    /// Faults of the scenario, ascending by time.
    pub faults: Vec<TimedFault>,
    /// From what random faults are drawn.
    pub storm: StormSpec,
    /// The default seed.
    pub seed: u64,
}

impl Spec {
    /// Who is launched where and when, as every peer of the fleet is told.
    #[must_use]
    pub fn launches(&self) -> Arc<[Launch]> {
        let launch = |u: &UavSpec| Launch {
            id: u.id,
            east_mm: mm(u.launch.east_m),
            north_mm: mm(u.launch.north_m),
            takeoff_ms: u.takeoff_ms,
            speed_mmps: mm(u.airframe.cruise_mps).unsigned_abs(),
        };
        let own = self.uavs.iter().filter(|u| u.twin_of.is_none());
        own.map(launch).collect()
    }

    /// Which of its UAVs speak under the id of another.
    #[must_use]
    pub fn twins(&self) -> Twins {
        let twin = |u: &UavSpec| Some((u.id, u.twin_of?));
        let aboard = self.uavs.iter().filter(|u| u.aboard).map(|u| u.id);
        let twins: Twins = self.uavs.iter().filter_map(twin).collect();
        twins.with_aboard(aboard)
    }
}

/// A prism that blocks radio.
#[derive(Clone, Debug)]
pub struct Building {
    /// Its footprint.
    pub footprint: Polygon,
    /// Height of its roof above the origin, metres.
    pub height_m: f64,
}

/// One flying peer.
#[derive(Clone, Debug, PartialEq)]
pub struct UavSpec {
    /// Its number.
    pub id: u16,
    /// What it can fly.
    pub airframe: Airframe,
    /// Where it starts.
    pub launch: Pose,
    /// When it takes off, milliseconds; until then it stands there, its peer at work and
    /// its antenna as high as it will fly.
    pub takeoff_ms: u32,
    /// Whether it begins in the air, at any time; else it takes off from where it stands.
    pub in_air: bool,
    /// Its height slot above the origin, metres.
    pub height_m: f64,
    /// What it carries: a bit for each sensor, the lowest for sensor 1.
    pub sensors: u32,
    /// As which other one it was configured by mistake: its peer speaks under that id. It is
    /// switched on by a fault, and its number is that of its airframe and radio.
    pub twin_of: Option<u16>,
    /// Whether it is a program in the airframe of that one, with a radio of its own.
    pub aboard: bool,
}

impl UavSpec {
    /// Whether it carries a sensor, by number; 0 for any.
    #[must_use]
    pub fn carries(&self, sensor: u8) -> bool {
        let bit = u32::from(sensor).checked_sub(1);
        bit.is_none_or(|bit| self.sensors >> bit.min(31) & 1 == 1)
    }
}

/// A vehicle on the ground.
#[derive(Clone, Debug)]
pub struct VehicleSpec {
    /// Where it drives.
    pub roads: Arc<Roads>,
    /// Near which place it starts, if it matters; else anywhere.
    pub start: Option<Point>,
    /// What it does.
    pub behaviour: Behaviour,
    /// Its usual speed on a straight road, m/s.
    pub speed_mps: f64,
    /// What it looks like to a detector.
    pub kind: u8,
    /// In how many looks of a thousand a detector takes it for another kind.
    pub confused_permille: u16,
}

/// A unit of services on the ground.
#[derive(Clone, Debug)]
pub struct ServiceSpec {
    /// Where it waits at first.
    pub base: Point,
    /// How fast it goes, m/s.
    pub speed_mps: f64,
    /// The streets along which it goes; straight where there are none.
    pub streets: Option<Arc<Network>>,
}

/// An aircraft that is no member of the fleet: it says nothing and makes way for nobody.
#[derive(Clone, Debug, PartialEq)]
pub struct IntruderSpec {
    /// What it is called in reports.
    pub name: String,
    /// When it comes first, milliseconds.
    pub from_ms: u64,
    /// How long after that it comes again, and again, milliseconds; once where none is said.
    pub every_ms: Option<u64>,
    /// How fast over the ground, m/s.
    pub speed_mps: f64,
    /// How high above the origin, metres.
    pub height_m: f64,
    /// Where it flies.
    pub way: IntruderWay,
}

/// Where an intruder flies.
#[derive(Clone, Debug, PartialEq)]
pub enum IntruderWay {
    /// From the first place to the last, straight between them.
    Places(Vec<Point>),
    /// Each time straight on another course, drawn by the run's seed, over some place of this
    /// circle.
    Over {
        /// Its middle.
        middle: Point,
        /// Its radius, metres.
        radius_m: f64,
    },
}

/// Something that stands through all heights and is on no map.
#[derive(Clone, Debug, PartialEq)]
pub struct ObstacleSpec {
    /// How far from its middle it reaches, metres.
    pub radius_m: f64,
    /// Where it stands.
    pub place: ObstaclePlace,
}

impl ObstacleSpec {
    /// It, where it stands there.
    #[must_use]
    pub fn standing(&self, at: Point) -> Obstacle {
        Obstacle {
            east_dm: mm(at.x) / 100,
            north_dm: mm(at.y) / 100,
            radius_dm: u16::try_from(mm(self.radius_m) / 100).unwrap_or(u16::MAX),
        }
    }
}

/// Where an obstacle stands.
#[derive(Clone, Debug, PartialEq)]
pub enum ObstaclePlace {
    /// There.
    At(Point),
    /// Somewhere in this circle, drawn by the run's seed, away from where UAVs start and come home,
    /// from zones, and from others.
    Within {
        /// Its middle.
        middle: Point,
        /// Its radius, metres.
        radius_m: f64,
    },
}

/// A contour that no peer knows.
#[derive(Clone, Debug, PartialEq)]
pub enum ContourSpec {
    /// A road.
    Road(RoadSpec),
    /// The edge of a fire.
    Fire(FireSpec),
}

/// A road that is on no map.
#[derive(Clone, Debug, PartialEq)]
pub struct RoadSpec {
    /// Beside which way it leads.
    pub way: Vec<Point>,
    /// How far it sways to either side of that, metres: where is drawn from the seed.
    pub sway_m: f64,
}

/// A fire that grows.
#[derive(Clone, Debug, PartialEq)]
pub struct FireSpec {
    /// Where it began.
    pub at: Point,
    /// How far its head is from there at first, metres.
    pub radius_m: f64,
    /// How fast its head moves on, m/s.
    pub growth_mps: f64,
    /// Where its head moves to, radians.
    pub towards_rad: f64,
    /// How much slower it moves elsewhere, 0 to below 1: the eccentricity of its ellipse.
    pub stretch: f64,
    /// Its head moves no farther than this, metres.
    pub most_m: f64,
}

/// The people of a mass event.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CrowdSpec {
    /// Groups of them.
    pub groups: Vec<GroupSpec>,
    /// By up to so much of its people, in thousandths, each group is larger or smaller than said.
    pub vary_permille: u16,
    /// By up to so much each group walks earlier or later than said, milliseconds.
    pub vary_ms: u32,
}

/// People who stand at one place first and go the same ways.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GroupSpec {
    /// How many.
    pub people: u32,
    /// Where they stand first.
    pub at: Field,
    /// Where they go, one after the other.
    pub moves: Vec<MoveSpec>,
}

/// A rectangle in which people stand, each at a place of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Field {
    /// Its south-west corner, metres east and north.
    pub low: (f64, f64),
    /// Its north-east corner.
    pub high: (f64, f64),
}

/// A way that a group goes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MoveSpec {
    /// When the first sets off, milliseconds.
    pub from_ms: u64,
    /// Within so long after that the last does, milliseconds.
    pub over_ms: u64,
    /// Past which places.
    pub way: Vec<Point>,
    /// Where they stand then.
    pub to: Field,
    /// How fast they walk on the mean, m/s.
    pub speed_mps: f64,
}

/// The ground station.
#[derive(Clone, Debug)]
pub struct GroundStationSpec {
    /// Its number.
    pub id: u16,
    /// Where it stands.
    pub position: Point,
    /// Height of its antenna above the origin, metres.
    pub height_m: f64,
}

/// The radio that all peers have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadioSpec {
    /// Links longer than this are cut, metres.
    pub range_m: f64,
    /// Bit rate of the shared channel, bit/s.
    pub rate_bps: u32,
    /// Share of transmissions lost, in thousandths.
    pub loss_permille: u16,
    /// Time from the end of a transmission to its reception, milliseconds.
    pub delay_ms: u16,
    /// Transmissions that waited longer than this for the channel are dropped, milliseconds.
    pub queue_age_ms: u32,
}

/// From what the faults of one storm are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StormSpec {
    /// Most UAVs killed for good in one run; at least one always lives.
    pub max_kills: u16,
    /// Kills, partitions and restarts happen before this share of the failure-free makespan.
    pub until: f64,
    /// Largest loss, in thousandths; each run draws its own.
    pub max_loss_permille: u16,
    /// Most partitions in one run, each of which heals.
    pub max_partitions: u16,
    /// Longest partition, seconds.
    pub max_partition_s: u32,
    /// Most restarts in one run.
    pub max_restarts: u16,
    /// Most revisions of the mission in one run, each of which moves the base.
    pub max_revisions: u16,
    /// What else goes wrong.
    pub troubles: TroubleSpec,
}

/// How bad the kinds of trouble of a storm are at worst. A kind whose
/// limit is 0 is not drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TroubleSpec {
    /// Most kinds that one run meets.
    pub max_kinds: u16,
    /// Longest time for which something is wrong, seconds.
    pub max_s: u32,
    /// Longest time for which a process stands still, seconds.
    pub max_pause_s: u32,
    /// Longest time by which a disk is late with each write, milliseconds.
    pub max_store_delay_ms: u32,
    /// Longest time by which a computer is late, milliseconds.
    pub max_computer_delay_ms: u32,
    /// Largest drift of a clock, millionths.
    pub max_clock_drift_ppm: u32,
    /// Largest jump of a clock, milliseconds.
    pub max_clock_jump_ms: u32,
    /// Largest fleet; 0 leaves the scenario's.
    pub max_uavs: u16,
    /// Largest crowd, a fleet of more than that.
    pub max_crowd: u16,
    /// Most missions that the operator gives in place of the first one.
    pub max_missions: u16,
}

impl TroubleSpec {
    /// Nothing else goes wrong.
    pub const NONE: Self = Self {
        max_kinds: 0,
        max_s: 0,
        max_pause_s: 0,
        max_store_delay_ms: 0,
        max_computer_delay_ms: 0,
        max_clock_drift_ppm: 0,
        max_clock_jump_ms: 0,
        max_uavs: 0,
        max_crowd: 0,
        max_missions: 0,
    };

    /// What a storm brings where its scenario says nothing else: what a small flight
    /// computer may meet and its peers are to live with.
    pub const USUAL: Self = Self {
        max_kinds: 3,
        max_s: 60,
        max_pause_s: 60,
        max_store_delay_ms: 1_000,
        max_computer_delay_ms: 400,
        max_clock_drift_ppm: 20_000,
        max_clock_jump_ms: 60_000,
        max_uavs: 12,
        max_crowd: 30,
        max_missions: 2,
    };
}
