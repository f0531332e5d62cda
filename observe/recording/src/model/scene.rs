//! What does not change until the mission does.

use super::{Place, Ring};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where a run takes place, and with whom.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Scene {
    /// [`MODEL_VERSION`](super::MODEL_VERSION) of the program that wrote it.
    pub model_version: u32,
    /// Version of that program.
    pub program_version: String,
    /// From when it holds, milliseconds of scenario time.
    pub time_ms: u64,
    /// Name of the scenario.
    pub scenario: String,
    /// First part of every key of the swarm.
    pub fleet: String,
    /// Seed of the run.
    pub seed: u64,
    /// What moves the run on.
    pub driver: Driver,
    /// Revision of the mission.
    pub revision: u32,
    /// Identifies the loop, hexadecimal; empty where there is none.
    pub loop_hash: String,
    /// Which lap it is, from 0.
    pub lap: u16,
    /// Where the plane touches the earth: 0 m east, 0 m north.
    pub origin: Place,
    /// The area that is to be seen.
    pub area: Ring,
    /// No-fly zones.
    pub zones: Vec<Zone>,
    /// Buildings, which block radio.
    pub buildings: Vec<Building>,
    /// Where UAVs loiter when all is done.
    pub base: Place,
    /// The ground station, if there is one.
    pub ground: Option<Station>,
    /// The cells of the loop, in its order: cell `i` of claims and events is `cells[i]`.
    pub cells: Vec<Cell>,
    /// The UAVs, ascending by id.
    pub uavs: Vec<Uav>,
    /// What the makespan may be compared with.
    pub bounds: Bounds,
    /// Wind towards the east, m/s.
    pub wind_east_mps: f64,
    /// Wind towards the north, m/s.
    pub wind_north_mps: f64,
    /// Links longer than this are cut, metres.
    pub radio_range_m: f64,
}

/// What moves a run on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Driver {
    /// Virtual time, in one process.
    #[default]
    Sim,
    /// Real processes, in real time times a factor.
    Live,
}

/// A no-fly zone.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Zone {
    /// What the operator calls it; `zone 1` and so on for those of the scenario.
    pub name: String,
    /// Whether the operator added it in flight.
    pub added: bool,
    /// Its border.
    pub ring: Ring,
}

/// A building.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Building {
    /// Its footprint.
    pub ring: Ring,
    /// Height of its roof above the origin, metres.
    pub height_m: f64,
}

/// A ground station.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Station {
    /// Its number.
    pub id: u16,
    /// Where it stands.
    pub place: Place,
    /// Height of its antenna above the origin, metres.
    pub height_m: f64,
}

/// One cell of the loop: what one frame of a camera sees whole.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Cell {
    /// Its corners.
    pub ring: Ring,
    /// The mean of them.
    pub centre: Place,
    /// Whether it is to be seen; others are only flown over.
    pub needed: bool,
}

/// One UAV.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Uav {
    /// Its number.
    pub id: u16,
    /// What people call it.
    pub name: String,
    /// Airspeed at cruise, m/s.
    pub airspeed_mps: f64,
    /// Height above the origin at which it flies, metres.
    pub height_m: f64,
    /// What its camera sees.
    pub sensor: Sensor,
    /// Where it starts.
    pub launch: Place,
    /// When it takes off, milliseconds of scenario time.
    pub takeoff_ms: u64,
    /// Flight time at cruise, seconds.
    pub endurance_s: f64,
}

/// A camera that looks straight down.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Sensor {
    /// Half the footprint across the track, metres.
    pub half_across_m: f64,
    /// Half the footprint along the track, metres.
    pub half_along_m: f64,
}

/// What the makespan may be compared with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Bounds {
    /// The least time in which all UAVs, none of them lost, can fly the length of all cells,
    /// milliseconds of scenario time; none where there is no loop.
    pub work_bound_ms: Option<u64>,
    /// The makespan of a run without faults, where it is known, milliseconds of scenario time.
    pub failure_free_ms: Option<u64>,
}
