//! Tours of a team along lines or over points, the longest as short as can be found
//! (D2.7 §3.4, §3.5).
//!
//! | file | what it holds |
//! |---|---|
//! | `targets` | points and lines as ways to fly: sweeps, lanes of strips, networks of roads |
//! | `tour_problem` | ways over numbered places, what flights cost, and the zones on the way |
//! | `flown_tours` | tours as they are flown, with turns and in the wind |
//! | `sensor_groups` | who flies which targets where sensors differ |
//!
//! Leaves to others: files, and what a person is shown. The local search of tours is that
//! of [`skein_flight::coverage::lines`] and [`crate::visits`].

mod flown_tours;
mod sensor_groups;
mod targets;
#[cfg(test)]
mod tests;
mod tour_problem;

use crate::detours::DetourError;
use crate::flight::UavFlight;
use crate::flown::AirspaceError;
use crate::heights::{NoSeparation, Separation};
use crate::objective::Objective;
use crate::team::{TeamError, Uav, has};
pub(crate) use flown_tours::stops;
use skein_flight::coverage::lines::LineError;
use skein_flight::coverage::metric::TooWindy;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::offset::Zone;
use thiserror::Error;
use tour_problem::MOST_PLACES;
pub(crate) use tour_problem::TourProblem;

/// Steps of improvement unless said otherwise.
pub const DEFAULT_STEPS: usize = skein_flight::coverage::lines::DEFAULT_STEPS;

/// Sensors that one request may ask for: five can be grouped in 52 ways.
const MOST_SENSORS: usize = 5;

/// A point to be seen.
#[derive(Clone, Debug, PartialEq)]
pub struct PointTarget {
    /// What it is called in plans, notices and errors.
    pub name: String,
    /// Where it is.
    pub at: Point,
    /// Radius around it that is to be seen, metres; 0 for the point alone.
    pub radius_m: f64,
    /// The sensor to see it with, if that is not the request's.
    pub sensor: Option<String>,
}

/// A line to be seen.
#[derive(Clone, Debug, PartialEq)]
pub struct LineTarget {
    /// What it is called in plans, notices and errors.
    pub name: String,
    /// Its points; lines that share one, exactly, hang together there, as roads do.
    pub way: Vec<Point>,
    /// Width of the strip around it that is to be seen, metres; 0 for the line alone.
    pub width_m: f64,
    /// The sensor to see it with, if that is not the request's.
    pub sensor: Option<String>,
}

/// What is to be seen.
#[derive(Clone, Debug, PartialEq)]
pub enum Targets {
    /// Points, each with what is around it.
    Points(Vec<PointTarget>),
    /// Lines and strips.
    Lines(Vec<LineTarget>),
}

/// What is to be seen, by whom, and how.
#[derive(Clone, Debug)]
pub struct TourRequest {
    /// What is to be seen.
    pub targets: Targets,
    /// Where nobody may fly.
    pub zones: Vec<Zone>,
    /// Distance kept from every zone, metres. Targets nearer to one are left out.
    pub clearance_m: f64,
    /// The UAVs; those that cannot see, or are not needed, stay.
    pub team: Vec<Uav>,
    /// The wind, where it blows to, m/s. In a wind all UAVs fly at one airspeed.
    pub wind_mps: Vector,
    /// The sensor for targets that do not ask for one themselves.
    pub sensor: Option<String>,
    /// What is to be least.
    pub objective: Objective,
    /// How flights are kept apart.
    pub separation: Separation,
    /// Height of the lowest flight above home, metres.
    pub altitude_m: f64,
    /// Steps of improvement; the same steps give the same plan everywhere.
    pub steps: usize,
}

impl TourRequest {
    /// Targets without zones and wind, seen as soon as can be found, in layers as turns
    /// ask for.
    #[must_use]
    pub fn new(targets: Targets, team: Vec<Uav>, altitude_m: f64) -> Self {
        Self {
            targets,
            zones: Vec::new(),
            clearance_m: 0.0,
            team,
            wind_mps: Vector::zeros(),
            sensor: None,
            objective: Objective::Time,
            separation: Separation::BY_TURNS,
            altitude_m,
            steps: DEFAULT_STEPS,
        }
    }
}

/// A target on a tour: a point, or a piece of a line.
#[derive(Clone, Debug, PartialEq)]
pub struct Visit {
    /// The name of the target.
    pub target: String,
    /// Whether it is flown from its end to its beginning.
    pub backward: bool,
}

/// The tour of one UAV.
#[derive(Clone, Debug, PartialEq)]
pub struct UavTour {
    /// Its flight.
    pub flight: UavFlight,
    /// What it sees, in order.
    pub visits: Vec<Visit>,
}

/// Tours of a team.
#[derive(Clone, Debug, PartialEq)]
pub struct TourPlan {
    /// By UAV of the request.
    pub uavs: Vec<UavTour>,
    /// When the last UAV is back, seconds.
    pub makespan_s: f64,
    /// No plan of this team is faster, seconds; where time is to be least.
    pub lower_bound_s: Option<f64>,
    /// The time of all flights together, seconds.
    pub total_s: f64,
    /// The length of all flights together, over the ground, metres.
    pub total_m: f64,
    /// The energy of all flights together, seconds of cruise.
    pub energy_s: f64,
    /// The energy of all flights together, watt-hours, if all who fly state their power.
    pub energy_wh: Option<f64>,
    /// How many pieces there are to see.
    pub targets: usize,
    /// The names of targets that nobody has the endurance for.
    pub unserved: Vec<String>,
    /// What is worth saying: targets that were left out.
    pub notices: Vec<String>,
}

impl TourPlan {
    /// How many UAVs leave their start.
    #[must_use]
    pub fn uavs_flying(&self) -> usize {
        self.uavs.iter().filter(|u| u.flight.flies()).count()
    }
}

/// Why there are no tours. Nothing was planned.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ToursError {
    /// The team cannot be planned for.
    #[error(transparent)]
    Team(#[from] TeamError),
    /// The separation is no distance.
    #[error(transparent)]
    Separation(#[from] NoSeparation),
    /// There are no ways round the zones.
    #[error(transparent)]
    Zones(#[from] DetourError),
    /// A zone is no polygon, or a fence cannot be stayed within.
    #[error(transparent)]
    Fences(#[from] AirspaceError),
    /// Nobody has the sensor that a target asks for.
    #[error(
        "{target} asks for the sensor {sensor:?}, nobody carries it: {}",
        has(.carried)
    )]
    NoCarrier {
        /// The name of the target.
        target: String,
        /// What it asks for; empty for any sensor at all.
        sensor: String,
        /// The sensors that the team has, by name.
        carried: Vec<String>,
    },
    /// A target lies at no point of the plane; it is named.
    #[error("{0}: a point of the plane has two numbers")]
    Nowhere(String),
    /// A point has no sweep.
    #[error("{target}: no sweep of radius {radius_m} m with a swath of {swath_m} m")]
    NoSweep {
        /// The name of the target.
        target: String,
        /// Its radius, metres.
        radius_m: f64,
        /// The swath, metres.
        swath_m: f64,
    },
    /// A strip has no lanes.
    #[error("{target}: a strip {width_m} m wide has no lanes of a swath of {swath_m} m")]
    NoLanes {
        /// The name of the target.
        target: String,
        /// Its width, metres.
        width_m: f64,
        /// The swath, metres.
        swath_m: f64,
    },
    /// A UAV starts in a zone; it is named.
    #[error("{0} starts in a zone or nearer to one than the clearance")]
    StartInZone(String),
    /// UAVs of unlike speeds in a wind.
    #[error("in a wind, UAVs of unlike speeds cannot be planned together")]
    UnlikeInWind,
    /// The wind is as fast as the UAVs.
    #[error(transparent)]
    TooWindy(#[from] TooWindy),
    /// Too many places for ways round zones.
    #[error("{0} places are too many to plan round zones, {MOST_PLACES} are possible")]
    TooManyPlaces(usize),
    /// Too many kinds of sensors.
    #[error("the targets ask for {0} kinds of sensors, {MOST_SENSORS} are possible")]
    TooManySensors(usize),
    /// The planner of lines or points refused a figure.
    #[error(transparent)]
    Lines(#[from] LineError),
}

/// Plans.
///
/// # Guarantees
/// Each target that is not left out is seen once by a UAV that has its sensor, or is in
/// `unserved`; no flight takes longer than its UAV's endurance. The same request gives the
/// same plan everywhere.
///
/// # Errors
/// [`ToursError`] names the target or the UAV.
pub fn plan(request: &TourRequest) -> Result<TourPlan, ToursError> {
    let problem = TourProblem::new(request)?;
    sensor_groups::plan(problem, request)
}
