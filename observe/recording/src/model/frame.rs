//! How everything stands at one moment: the truth of the simulated world, beside what each
//! UAV said last of its work.

use super::Place;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How everything stands.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Frame {
    /// When, milliseconds of scenario time.
    pub time_ms: u64,
    /// The UAVs, ascending by id, lost ones too.
    pub uavs: Vec<UavState>,
    /// Pairs of peers, the ground station included, that hear each other both ways; the lower
    /// number first.
    pub links: Vec<[u16; 2]>,
    /// Peers that can reach each other over such links, each part ascending.
    pub components: Vec<Vec<u16>>,
    /// Coverable cells that cameras saw whole, as the judge counts them.
    pub covered_cells: usize,
    /// Cells that some UAV can see whole on a straight pass, as the judge counts them.
    pub coverable_cells: usize,
    /// The share of the coverable cells that was seen, 0 to 1; cells of an area weigh alike.
    pub covered_share: f64,
}

/// One UAV at one moment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct UavState {
    /// Its number.
    pub id: u16,
    /// What it does.
    pub state: State,
    /// Where it is; none once its airframe is gone.
    pub pose: Option<Pose>,
    /// Flight time left at cruise, seconds; none once its airframe is gone.
    pub fuel_left_s: Option<f64>,
    /// Uncovered cells that it lists as its own future.
    pub cells_left: usize,
    /// Distance to the nearest other UAV in the air, metres; none where there is none.
    pub nearest_other_m: Option<f64>,
    /// Whether the airframe loiters by itself for want of setpoints.
    pub failsafe: bool,
    /// Running peers that hold it for down.
    pub held_down_by: Vec<u16>,
}

/// Where a UAV is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Pose {
    /// East, north, latitude, longitude.
    #[serde(flatten)]
    pub place: Place,
    /// Where its nose points, degrees clockwise from north, 0 to 360.
    pub heading_deg: f64,
    /// Height above the origin, metres.
    pub height_m: f64,
    /// Airspeed, m/s.
    pub airspeed_mps: f64,
}

/// What a UAV does.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// Its computer has not run yet, or has no mission yet.
    #[default]
    Starting,
    /// It stands on the ground and will take off.
    Standing,
    /// It has cells to fly.
    Working,
    /// It has nothing to fly, and does not hold that the mission is finished.
    Idle,
    /// It holds that the mission is finished, and is on its way.
    Finished,
    /// The same, and it is at the base.
    Home,
    /// Its process stands still, or is silent since another one speaks under its id.
    Silent,
    /// Its computer is gone; the airframe flies.
    ComputerDead,
    /// Its airframe is gone.
    Lost,
}

impl State {
    /// The word of the JSON.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Starting => "starting",
            Self::Standing => "standing",
            Self::Working => "working",
            Self::Idle => "idle",
            Self::Finished => "finished",
            Self::Home => "home",
            Self::Silent => "silent",
            Self::ComputerDead => "computer_dead",
            Self::Lost => "lost",
        }
    }

    /// Whether its airframe and its computer work.
    #[must_use]
    pub fn is_alive(self) -> bool {
        !matches!(self, Self::Lost | Self::ComputerDead)
    }
}
