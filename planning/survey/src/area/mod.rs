//! An area covered by a team (D2.7 §3.6): one closed flight a UAV, exactly by straight
//! passes, or approximately by lane cells, or the better of both.
//!
//! | file | what it holds |
//! |---|---|
//! | `planners` | both planners behind one question: a part of the area, lanes of one width |
//! | `flown_passes` | the exact planner: passes shared out, ordered and flown |
//! | `courses` | the course of exact passes, searched by what they take |
//! | `promise` | what flights over passes come to at best |
//! | `gaps` | passes for what lanes leave unseen beside walls |
//! | `crossing` | a second crossing at right angles to the first |
//! | `cells` | the approximate planner: a region of lane cells for each UAV |
//! | `lanes` | lanes for unlike swaths: one width for all, or a section for each crew |
//! | `team_selection` | which UAVs of the team fly |
//! | `sight` | which points passes see |
//! | `at_once` | plans made at once, each in a thread |
//! | `flights` | what a plan comes to, and the share that it sees |
//!
//! Leaves to others: files, and what a person is shown.

mod at_once;
mod cells;
mod courses;
mod crossing;
mod flights;
mod flown_passes;
mod gaps;
mod lanes;
mod planners;
mod promise;
mod sight;
mod team_selection;
#[cfg(test)]
mod tests;

use crate::detours::DetourError;
use crate::flight::{Stays, UavFlight};
use crate::flown::{Air, AirspaceError};
use crate::heights::{NoSeparation, Separation};
use crate::objective::{Objective, SAME_SHARE, in_watt_hours};
use crate::regions::TaskError;
use crate::regions::raster::RasterError;
use crate::team::{self, PlannedUav, TeamError, Uav, taking_part};
pub use crossing::plan_crossed;
use flights::Flights;
use lanes::Desk;
use planners::OpenArea;
use skein_flight::coverage::metric::{InWind, TooWindy};
use skein_flight::coverage::passes::PassesError;
use skein_geometry::frame::{Point, Vector};
use skein_geometry::{NoFlyZones, Polygon};
use std::sync::Arc;
use team_selection::choose;
use thiserror::Error;

/// Steps of improvement unless said otherwise.
pub const DEFAULT_STEPS: usize = 20_000;

/// Times that swaths are taken from the heights that a plan led to.
const HEIGHT_ROUNDS: usize = 3;

/// A lane may be wider than a swath by this, metres: rounding.
const ROUNDING_M: f64 = 1e-9;

/// What is to be covered, by whom, and how.
#[derive(Clone, Debug)]
pub struct AreaRequest {
    /// The area.
    pub area: Polygon,
    /// Parts of it that need not be seen; they may be flown over.
    pub holes: Vec<Polygon>,
    /// Where nobody may fly.
    pub zones: Arc<NoFlyZones>,
    /// What must be stayed within, with the clearance: inside each of them.
    pub fences: Vec<Polygon>,
    /// The UAVs; those that cannot see, or are not needed, stay.
    pub team: Vec<Uav>,
    /// The sensor to see the area with: UAVs without it stay, and its swath counts.
    pub sensor: Option<String>,
    /// Distance kept from every zone, metres. What is nearer to one is not planned for.
    pub clearance_m: f64,
    /// How far a camera sees before and behind, metres; `None` for half a lane.
    pub look_ahead_m: Option<f64>,
    /// Heading of all exact passes, radians counter-clockwise from east; `None` for the
    /// best found by plans on courses all round.
    pub heading_rad: Option<f64>,
    /// Whether only those courses are planned in full that promise most when they are planned
    /// quickly, and not all that may be best.
    pub quick: bool,
    /// How far each pass runs out straight beyond both ends before a turn, where that is
    /// clear, metres: cameras and autopilots settle there.
    pub run_out_m: f64,
    /// The wind, where it blows to, m/s: flights are compared by their times in it.
    pub wind_mps: Vector,
    /// Which planners are asked.
    pub planners: Planners,
    /// Lanes for UAVs of unlike swath.
    pub lanes: Lanes,
    /// What is to be least.
    pub objective: Objective,
    /// How flights are kept apart.
    pub separation: Separation,
    /// Height of the lowest flight above home, metres.
    pub altitude_m: f64,
    /// Steps of improvement; the same steps give the same plan everywhere.
    pub steps: usize,
}

impl AreaRequest {
    /// An area without holes and zones, seen as soon as can be found: by the better
    /// planner, with the better lanes, in layers as turns ask for.
    #[must_use]
    pub fn new(area: Polygon, team: Vec<Uav>, clearance_m: f64, altitude_m: f64) -> Self {
        Self {
            area,
            holes: Vec::new(),
            zones: Arc::new(NoFlyZones::new(Vec::new())),
            fences: Vec::new(),
            team,
            sensor: None,
            clearance_m,
            look_ahead_m: None,
            heading_rad: None,
            quick: false,
            run_out_m: 0.0,
            wind_mps: Vector::zeros(),
            planners: Planners::Both,
            lanes: Lanes::Best,
            objective: Objective::Time,
            separation: Separation::BY_TURNS,
            altitude_m,
            steps: DEFAULT_STEPS,
        }
    }
}

impl AreaRequest {
    fn air(&self, airspeed_mps: f64) -> Air {
        Air {
            airspeed_mps,
            wind_mps: self.wind_mps,
        }
    }
}

/// Which planners are asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Planners {
    /// One of them.
    Only(Planner),
    /// Both, and the flights are those of the one that sees more, or as much sooner.
    Both,
}

/// The planners.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Planner {
    /// Straight passes over the area as it is drawn.
    Exact,
    /// Lane cells as wide as the swath.
    Approximate,
}

/// Which lanes are planned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lanes {
    /// One width for all: that of the narrowest swath, with the widest turn.
    Common,
    /// A section of the area for the UAVs of like swath, with lanes of their own.
    Sections,
    /// Both, and the better one is flown.
    Best,
}

/// How the lanes of a plan are laid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Laid {
    /// One width for all: that of the narrowest swath, with the widest turn.
    Common,
    /// A section for each crew of like swath, with lanes of its own.
    Sections,
}

/// What a plan comes to.
#[derive(Clone, Debug, PartialEq)]
pub struct Figures {
    /// Which planner.
    pub planner: Planner,
    /// How the lanes are laid.
    pub laid: Laid,
    /// When the last UAV is back, seconds.
    pub makespan_s: f64,
    /// The share of the area that is seen, by samples.
    pub covered_share: f64,
    /// The length of all flights together, over the ground, metres.
    pub total_m: f64,
    /// The energy of all flights together, seconds of cruise.
    pub energy_s: f64,
    /// The energy of all flights together, watt-hours, if all who fly state their power.
    pub energy_wh: Option<f64>,
    /// How many UAVs leave their start.
    pub uavs_flying: usize,
}

/// What a planner tells of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Facts {
    /// Of straight passes.
    Passes {
        /// What is to be seen, square metres.
        area_m2: f64,
        /// Cells that the area was cut into.
        cells: usize,
        /// Passes that are flown.
        passes: usize,
        /// Passes that nobody has the endurance for.
        unserved_passes: usize,
        /// Passes, or lanes of them, to which no curve leads that keeps clear.
        unreached_passes: usize,
    },
    /// Of lane cells.
    Cells {
        /// No plan of these cells is done sooner than this, seconds; where lanes are
        /// common and UAVs equal.
        lower_bound_s: Option<f64>,
        /// Cells to be seen.
        cells: usize,
        /// Cells that zones block.
        cells_blocked: usize,
        /// Cells that nobody has the endurance or the way for.
        cells_left: usize,
        /// Whether a turn fits into a lane.
        turns_fit: bool,
    },
}

impl Facts {
    /// Of two parts together: numbers add up, facts hold for both, and what is not known
    /// of one is not known of both.
    fn and(self, other: Self) -> Self {
        match (self, other) {
            (
                Self::Passes {
                    area_m2,
                    cells,
                    passes,
                    unserved_passes,
                    unreached_passes,
                },
                Self::Passes {
                    area_m2: more_m2,
                    cells: more_cells,
                    passes: more_passes,
                    unserved_passes: more_unserved,
                    unreached_passes: more_unreached,
                },
            ) => Self::Passes {
                area_m2: area_m2 + more_m2,
                cells: cells + more_cells,
                passes: passes + more_passes,
                unserved_passes: unserved_passes + more_unserved,
                unreached_passes: unreached_passes + more_unreached,
            },
            (
                Self::Cells {
                    lower_bound_s,
                    cells,
                    cells_blocked,
                    cells_left,
                    turns_fit,
                },
                Self::Cells {
                    lower_bound_s: more_s,
                    cells: more_cells,
                    cells_blocked: more_blocked,
                    cells_left: more_left,
                    turns_fit: both_fit,
                },
            ) => Self::Cells {
                lower_bound_s: lower_bound_s.zip(more_s).map(|(a, b)| a + b),
                cells: cells + more_cells,
                cells_blocked: cells_blocked + more_blocked,
                cells_left: cells_left + more_left,
                turns_fit: turns_fit && both_fit,
            },
            // Parts of one plan come from one planner.
            (first, _) => first,
        }
    }
}

/// A ring of a plan, for a map.
#[derive(Clone, Debug, PartialEq)]
pub struct Shape {
    /// Its corners.
    pub ring: Vec<Point>,
    /// What it is.
    pub kind: ShapeKind,
}

/// What a ring of a plan is.
#[derive(Clone, Debug, PartialEq)]
pub enum ShapeKind {
    /// A cell of the exact planner.
    Cell {
        /// Its number in its part of the area, from 1.
        number: usize,
        /// What is to be seen of it, square metres.
        area_m2: f64,
    },
    /// A lane cell that nobody covers.
    LeftCell,
    /// A pass to which no curve leads that keeps clear: its two ends.
    Unreached,
    /// A section of the area.
    Section {
        /// Its number, from 1.
        number: usize,
        /// What the UAVs that see it are called.
        uavs: Vec<String>,
        /// Width of its lanes, metres.
        lane_m: f64,
    },
}

/// Flights of a team over an area.
#[derive(Clone, Debug, PartialEq)]
pub struct AreaPlan {
    /// By UAV of the request.
    pub uavs: Vec<UavFlight>,
    /// What they come to.
    pub figures: Figures,
    /// What the planner tells of its own; none where nothing was to be planned.
    pub facts: Option<Facts>,
    /// The best of each planner and kind of lanes, where there is more than one: exact
    /// ones first, common lanes first.
    pub compared: Vec<Figures>,
    /// Cells and sections, for a map.
    pub shapes: Vec<Shape>,
    /// What is worth saying: why a planner that was asked has no plan.
    pub notices: Vec<String>,
}

/// Why there is no plan of an area. Nothing was planned.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum AreaError {
    /// The team cannot be planned for.
    #[error(transparent)]
    Team(#[from] TeamError),
    /// The separation is no distance.
    #[error(transparent)]
    Separation(#[from] NoSeparation),
    /// There are no ways round the zones.
    #[error(transparent)]
    Zones(#[from] DetourError),
    /// A fence cannot be stayed within.
    #[error(transparent)]
    Fences(#[from] AirspaceError),
    /// The wind is as fast as a UAV.
    #[error(transparent)]
    TooWindy(#[from] TooWindy),
    /// None of the planners that were asked has a plan; this is why the first has none.
    #[error(transparent)]
    NoPlan(#[from] PlannerError),
}

/// Why a planner has no plan of an area.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PlannerError {
    /// There are no straight passes.
    #[error(transparent)]
    Passes(#[from] PassesError),
    /// The area has no lane cells.
    #[error(transparent)]
    Raster(#[from] RasterError),
    /// The lane cells are no task.
    #[error(transparent)]
    Cells(#[from] TaskError),
    /// All lane cells are too near to zones.
    #[error("no cell of the area keeps the clearance from the zones")]
    NoCell,
    /// Zones lie all round a UAV, which is named.
    #[error("{0} has no way from its start to the area")]
    NoWay(String),
    /// A UAV starts in a zone; it is named.
    #[error("the launch point of {0} lies in a zone or nearer to one than the clearance")]
    LaunchInZone(String),
    /// No planner was asked.
    #[error("no planner was asked")]
    NotAsked,
}

/// Plans.
///
/// Swaths that depend on the height are those of the lowest height first, then of the
/// heights that the plan leads to as long as a better plan fits its own heights.
///
/// # Guarantees
/// Every UAV sees as wide as the lanes that it flies, and no flight takes longer than its
/// UAV's endurance. The same request gives the same plan everywhere.
///
/// # Errors
/// [`AreaError`] when a figure of the request has no meaning, or no planner that is asked
/// has a plan.
pub fn plan(request: &AreaRequest) -> Result<AreaPlan, AreaError> {
    plan_telling(request, &|_| {})
}

/// How far a search of courses is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Courses that are planned, or known to be no better.
    pub courses_done: usize,
    /// All that are looked at; more may follow.
    pub courses: usize,
}

/// As [`plan`], and tells now and then how far it is.
///
/// # Errors
/// As [`plan`].
pub fn plan_telling(
    request: &AreaRequest,
    tell: &(dyn Fn(Progress) + Sync),
) -> Result<AreaPlan, AreaError> {
    team::check(&request.team)?;
    for uav in &request.team {
        InWind::new(&[], uav.speed_mps, request.wind_mps)?;
    }
    request.separation.check()?;
    let job = Job {
        request,
        tell,
        in_watt_hours: in_watt_hours(&request.team, request.objective)?,
    };
    let chosen = job.planned()?;
    job.told(chosen)
}

/// What is asked.
struct Job<'a> {
    request: &'a AreaRequest,
    tell: &'a (dyn Fn(Progress) + Sync),
    in_watt_hours: bool,
}

/// The plans that were found.
struct Chosen {
    /// The one to fly.
    best: Flights,
    /// The best ones of the other planners and kinds of lanes.
    others: Vec<Flights>,
    /// By UAV: its height above home, metres.
    heights_m: Vec<f64>,
    /// Why a planner has none.
    refused: Vec<String>,
}

impl Job<'_> {
    fn taking_part(&self, heights_m: &[f64]) -> Result<Vec<PlannedUav>, TeamError> {
        let request = self.request;
        let mut all = taking_part(&request.team, request.sensor.as_deref(), heights_m)?;
        for uav in &mut all {
            uav.turn_radius_m = request
                .air(uav.speed_mps)
                .ground_radius_m(uav.turn_radius_m);
        }
        Ok(all)
    }

    /// The plan, and heights at which no swath is narrower than its lanes.
    ///
    /// Swaths are those of the lowest height first: higher up they are wider, so that the
    /// plan fits. Then they are those of the heights that it leads to, as long as a
    /// better plan fits the heights that it leads to itself.
    fn planned(&self) -> Result<Chosen, AreaError> {
        let team = &self.request.team;
        let lowest_m = self.request.altitude_m;
        let mut best = self.at_heights(&vec![lowest_m; team.len()])?;
        let high = |(i, uav): (usize, &Uav)| {
            best.heights_m[i] > lowest_m + ROUNDING_M && uav.depends_on_height()
        };
        if !team.iter().enumerate().any(high) {
            return Ok(best);
        }
        for _ in 0..HEIGHT_ROUNDS {
            let next = self.at_heights(&best.heights_m)?;
            let worth = |f: &Flights| f.worth(self.in_watt_hours);
            let fits = self.fits(&next.best, &next.heights_m)?;
            if !fits || !worth(&next.best).beats(&worth(&best.best), self.request.objective) {
                break;
            }
            best = next;
        }
        Ok(best)
    }

    /// Whether every UAV sees as wide as the lanes that it flies.
    fn fits(&self, flights: &Flights, heights_m: &[f64]) -> Result<bool, TeamError> {
        let uavs = self.taking_part(heights_m)?;
        let narrow = |uav: &PlannedUav| {
            let own = flights.flights.iter().find(|own| own.uav == uav.uav);
            own.is_some_and(|own| own.flies() && own.lane_m > uav.swath_m + ROUNDING_M)
        };
        Ok(!uavs.iter().any(narrow))
    }

    /// Plans with the swaths of these heights; tells the heights that the plan needs.
    fn at_heights(&self, heights_m: &[f64]) -> Result<Chosen, AreaError> {
        let request = self.request;
        let uavs = self.taking_part(heights_m)?;
        let ground = OpenArea::new(request, self.tell, uavs.iter().map(|u| u.start))?;
        let mut plans: Vec<Flights> = Vec::new();
        let mut errors = Vec::new();
        for planner in [Planner::Exact, Planner::Approximate] {
            if matches!(request.planners, Planners::Only(only) if only != planner) {
                continue;
            }
            let desk = Desk {
                ground: &ground,
                planner,
                lanes: request.lanes,
                objective: request.objective,
                in_watt_hours: self.in_watt_hours,
            };
            match choose(&desk, &uavs, request.steps) {
                Ok(found) => {
                    let ahead = match (found.first(), plans.first()) {
                        (Some(own), Some(best)) => desk.beats(own, best),
                        _ => true,
                    };
                    let at = if ahead { 0 } else { plans.len() };
                    plans.splice(at..at, found);
                }
                Err(error) => errors.push(error),
            }
        }
        if plans.is_empty() {
            let first = errors.into_iter().next().unwrap_or(PlannerError::NotAsked);
            return Err(first.into());
        }
        let best = plans.remove(0);
        let mut tracks = vec![Vec::new(); request.team.len()];
        for flight in &best.flights {
            tracks[flight.uav].clone_from(&flight.track);
        }
        let (team, clearance_m) = (&request.team, request.clearance_m);
        let separation = &request.separation;
        Ok(Chosen {
            heights_m: separation.heights_m(team, clearance_m, &tracks, request.altitude_m),
            // One planner's refusal is worth a notice when the other one has a plan.
            refused: errors.iter().map(|e| with_causes(e)).collect(),
            best,
            others: plans,
        })
    }

    fn told(&self, chosen: Chosen) -> Result<AreaPlan, AreaError> {
        let takes_part = self.taking_part(&chosen.heights_m)?;
        let best = chosen.best;
        let uavs = self.request.team.iter().enumerate().map(|(i, uav)| {
            let altitude_m = chosen.heights_m[i];
            match best.flights.iter().find(|f| f.uav == i) {
                Some(flight) => flight.told(altitude_m),
                None if takes_part.iter().any(|f| f.uav == i) => {
                    UavFlight::stays(uav, altitude_m, Stays::NotNeeded)
                }
                None => UavFlight::stays(uav, altitude_m, Stays::NoSensor),
            }
        });
        let uavs = uavs.collect();
        let figures = best.figures();
        let mut compared: Vec<Figures> = Vec::new();
        if !chosen.others.is_empty() {
            compared.push(figures.clone());
            compared.extend(chosen.others.iter().map(Flights::figures));
            compared.sort_by_key(|p| (p.planner, p.laid));
        }
        let mut notices = chosen.refused;
        notices.extend(unseen(&best));
        if best.courses_left > 0 {
            notices.push(format!(
                "{} courses were only looked at, not planned in full: a quick plan was asked for",
                best.courses_left
            ));
        }
        Ok(AreaPlan {
            uavs,
            figures,
            facts: best.facts,
            compared,
            shapes: best.shapes,
            notices,
        })
    }
}

/// What of the area is not seen, and why; nothing is said of less than a person compares.
fn unseen(flights: &Flights) -> Vec<String> {
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    let mut told = Vec::new();
    if flights.too_near_share > SAME_SHARE {
        told.push(format!(
            "{} of the area is nearer to zones or fences than the clearance or outside of these, and not seen",
            percent(flights.too_near_share)
        ));
    }
    let mut others = Vec::new();
    match flights.facts {
        Some(Facts::Passes {
            unserved_passes,
            unreached_passes,
            ..
        }) => {
            if unserved_passes > 0 {
                others.push(format!("{unserved_passes} passes are beyond the endurance"));
            }
            if unreached_passes > 0 {
                others.push(format!(
                    "to {unreached_passes} no flight with its turns keeps clear of zones and fences"
                ));
            }
        }
        Some(Facts::Cells { cells_left, .. }) if cells_left > 0 => {
            others.push(format!(
                "nobody has the endurance or a way for {cells_left} cells"
            ));
        }
        _ => {}
    }
    let rest = 1.0 - flights.covered_share - flights.too_near_share;
    if rest > SAME_SHARE || !others.is_empty() {
        let why = if others.is_empty() {
            "beside zones, fences or other cells no turn fits".to_owned()
        } else {
            others.join(", ")
        };
        told.push(format!(
            "{} of the area is not seen: {why}",
            percent(rest.max(0.0))
        ));
    }
    told
}

/// An error with all that it came from.
fn with_causes(error: &dyn std::error::Error) -> String {
    let causes = std::iter::successors(error.source(), |e| e.source());
    causes.fold(error.to_string(), |text, cause| format!("{text}: {cause}"))
}
