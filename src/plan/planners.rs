//! Both planners of areas behind one question: flights of some UAVs over a part of the
//! area, with lanes of one width (D2.7 §3.6).
//!
//! Leaves to [`super::lanes`] which UAVs work on which part.

use super::approximate::{self, Request};
use super::around::Around;
use super::flights::Flight;
use super::flyers::Flyer;
use super::site::Site;
use anyhow::{Result, ensure};
use serde_json::{Map, Value, json};
use skein_flight::coverage::passes::{Directions, Pass, PassesError, PassesProblem};
use skein_geometry::Polygon;
use skein_geometry::frame::Point;
use skein_geometry::offset::Zone;
use skein_survey::passes::{self, plan_team};

/// Steps of improvement of the approximate planner for each of the exact one's: its steps
/// are smaller.
const CELL_STEPS: usize = 50;

/// The planners.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Planner {
    /// Straight passes over the area as it is drawn.
    Exact,
    /// Lane cells.
    Approximate,
}

impl Planner {
    /// What it is called.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Approximate => "approximate",
        }
    }
}

/// What all plans of one area share.
pub struct Ground<'a> {
    /// The area.
    pub site: &'a Site,
    /// Distance kept from every zone, metres.
    pub clearance_m: f64,
    /// How far the camera sees before and behind, metres; half a lane if not said.
    pub look_ahead_m: Option<f64>,
    /// Headings of lanes.
    pub directions: Directions,
    around: Around,
}

/// A part of the area, and who sees it.
#[derive(Clone, Copy)]
pub struct Job<'a> {
    /// The part.
    pub area: &'a Polygon,
    /// Who flies.
    pub crew: &'a [Flyer],
    /// Width of the lanes, metres.
    pub lane_m: f64,
    /// Turn radius that lanes are ordered for, metres.
    pub turn_radius_m: f64,
    /// Steps of improvement.
    pub steps: usize,
}

/// The flights over a part.
#[derive(Default)]
pub struct Part {
    /// In the order of the crew.
    pub flights: Vec<Flight>,
    /// The share of its lanes that endurance lets it fly.
    pub done_share: f64,
    /// What else is worth telling.
    pub more: Map<String, Value>,
    /// Rings with properties for a map.
    pub shapes: Vec<(Vec<Point>, Value)>,
    seen: Seen,
}

/// What of the ground is seen.
#[derive(Default)]
enum Seen {
    #[default]
    Nothing,
    Passes {
        passes: Vec<Pass>,
        across_m: f64,
        along_m: f64,
    },
    Cells(Box<approximate::Flights>),
}

impl Part {
    /// Whether a point is seen.
    #[must_use]
    pub fn sees(&self, p: Point) -> bool {
        match &self.seen {
            Seen::Nothing => false,
            Seen::Passes {
                passes,
                across_m,
                along_m,
            } => passes.iter().any(|pass| pass.sees(p, *across_m, *along_m)),
            Seen::Cells(cells) => cells.sees(p),
        }
    }

    /// When its last UAV is back, seconds.
    #[must_use]
    pub fn makespan_s(&self) -> f64 {
        self.flights.iter().map(Flight::time_s).fold(0.0, f64::max)
    }
}

impl<'a> Ground<'a> {
    /// The area with its zones grown by the clearance; `starts` are the UAVs'.
    ///
    /// # Errors
    /// When the clearance is no length.
    pub fn new(
        site: &'a Site,
        clearance_m: f64,
        look_ahead_m: Option<f64>,
        course_deg: Option<f64>,
        starts: impl Iterator<Item = Point>,
    ) -> Result<Self> {
        Ok(Self {
            site,
            clearance_m,
            look_ahead_m,
            directions: match course_deg {
                Some(course) => Directions::Fixed((90.0 - course).to_radians()),
                None => Directions::Best,
            },
            around: around(site, clearance_m, starts)?,
        })
    }

    /// Whether a point of the area is to be seen: not in a hole, and not nearer to a zone
    /// than the clearance.
    #[must_use]
    pub fn wants(&self, p: Point) -> bool {
        !self.around.forbids(p) && !self.site.holes.iter().any(|h| h.contains(p))
    }

    /// Plans a part.
    ///
    /// # Errors
    /// When there is no plan.
    pub fn plan(&self, planner: Planner, job: Job<'_>) -> Result<Part> {
        match planner {
            Planner::Exact => self.exact(job),
            Planner::Approximate => self.approximate(job),
        }
    }

    fn exact(&self, job: Job<'_>) -> Result<Part> {
        let look_ahead_m = self.look_ahead_m.unwrap_or(job.lane_m / 2.0);
        let problem = PassesProblem {
            holes: self.site.holes.clone(),
            zones: self.site.zones.clone(),
            clearance_m: self.clearance_m,
            look_ahead_m,
            steps: job.steps,
            directions: self.directions,
            ..PassesProblem::new(
                job.area.clone(),
                job.lane_m,
                job.turn_radius_m,
                Point::origin(),
            )
        };
        let member = |flyer: &Flyer| passes::Uav {
            speed: flyer.speed_mps * flyer.pace,
            // In the time of that pace, so that the length is the same.
            endurance: flyer.endurance_s / flyer.pace,
            ..passes::Uav::at(flyer.start)
        };
        let members: Vec<passes::Uav> = job.crew.iter().map(member).collect();
        let plan = match plan_team(&problem, &members) {
            // A section that zones and holes fill is no work.
            Err(PassesError::Nothing) if job.area != &self.site.area => {
                return Ok(Part::at_home(&job));
            }
            plan => plan?,
        };
        let flights = job.crew.iter().enumerate().map(|(i, flyer)| {
            let mut flight = flight(flyer, &job, &plan.tracks[i], plan.lengths_m[i]);
            let passes = plan.tours[i].len();
            flight.lap = lap(&plan.tracks[i], &plan.tours[i]);
            flight.more.insert("passes".to_owned(), json!(passes));
            if passes == 0 {
                flight.track.truncate(1);
            }
            flight
        });
        let flights = flights.collect();
        let shapes = plan.cells.iter().enumerate().map(|(i, cell)| {
            let properties = json!({"cell": i + 1, "area_m2": cell.area_m2});
            (cell.ring.clone(), properties)
        });
        let passes: Vec<Pass> = plan.tours.into_iter().flatten().collect();
        let length_m = |passes: &[Pass]| passes.iter().map(Pass::length_m).sum();
        let (flown_m, left_m): (f64, f64) = (length_m(&passes), length_m(&plan.unserved));
        Ok(Part {
            flights,
            done_share: flown_m / (flown_m + left_m).max(f64::MIN_POSITIVE),
            more: fields(json!({
                "area_m2": plan.cells.iter().map(|c| c.area_m2).sum::<f64>(),
                "cells": plan.cells.len(),
                "passes": passes.len(),
                "unserved_passes": plan.unserved.len(),
            })),
            shapes: shapes.collect(),
            seen: Seen::Passes {
                passes,
                across_m: job.lane_m / 2.0,
                along_m: look_ahead_m,
            },
        })
    }

    fn approximate(&self, job: Job<'_>) -> Result<Part> {
        for flyer in job.crew {
            check_start(&self.around, &flyer.name, flyer.start)?;
        }
        let plan = approximate::plan(&Request {
            area: job.area,
            holes: &self.site.holes,
            around: &self.around,
            team: job.crew,
            lane_m: job.lane_m,
            steps: job.steps.saturating_mul(CELL_STEPS),
        })?;
        let flights = job.crew.iter().enumerate();
        let flights = flights.map(|(i, flyer)| Flight {
            lap: plan.laps[i].clone(),
            ..flight(flyer, &job, &plan.tracks[i], plan.lengths_m[i])
        });
        let cells = plan.raster.map.n_free();
        let left = plan.left.iter();
        Ok(Part {
            flights: flights.collect(),
            done_share: 1.0 - plan.left.len() as f64 / cells.max(1) as f64,
            more: fields(json!({
                "lower_bound_s": plan.least_s,
                "cells": cells,
                "cells_blocked": plan.raster.n_blocked,
                "cells_left": plan.left.len(),
                "turns_fit": 2.0 * job.turn_radius_m <= job.lane_m,
            })),
            shapes: left
                .map(|p| (square(*p, job.lane_m), json!({"left": true})))
                .collect(),
            seen: Seen::Cells(Box::new(plan)),
        })
    }
}

impl Part {
    /// Nothing to see: all stay.
    fn at_home(job: &Job<'_>) -> Self {
        let stay = |flyer| flight(flyer, job, &[], 0.0);
        Self {
            flights: job.crew.iter().map(stay).collect(),
            done_share: 1.0,
            ..Self::default()
        }
    }
}

/// The zones of a site to fly round, from these starts too.
///
/// # Errors
/// When the clearance is no length.
pub fn around(
    site: &Site,
    clearance_m: f64,
    starts: impl Iterator<Item = Point>,
) -> Result<Around> {
    let zones = site.zones.zones().iter().map(|zone| Zone {
        outer: zone.vertices().to_vec(),
        holes: Vec::new(),
    });
    let zones: Vec<Zone> = zones.collect();
    let places: Vec<Point> = starts.chain(site.area.vertices().iter().copied()).collect();
    Around::new(&zones, clearance_m, &places)
}

/// Refuses a start in a zone.
///
/// # Errors
/// Names the UAV.
pub fn check_start(around: &Around, name: &str, start: Point) -> Result<()> {
    ensure!(
        !around.forbids(start),
        "the launch point of {name} lies in a zone or nearer to one than the clearance"
    );
    Ok(())
}

/// One UAV's flight; without a track it stays at its start.
pub fn flight(flyer: &Flyer, job: &Job<'_>, track: &[Point], length_m: f64) -> Flight {
    Flight {
        uav: flyer.uav,
        name: flyer.name.clone(),
        track: match track {
            [] => vec![flyer.start],
            track => track.to_vec(),
        },
        lap: Vec::new(),
        length_m,
        speed_mps: flyer.speed_mps,
        turn_radius_m: flyer.turn_radius_m,
        lane_m: job.lane_m,
        cruise_power_w: flyer.cruise_power_w,
        more: Map::new(),
    }
}

/// What lies between the beginning of the first pass and the end of the last one.
fn lap(track: &[Point], passes: &[Pass]) -> Vec<Point> {
    let place = |p: Point| move |q: &Point| (q - p).norm() < 1e-9;
    let from = passes
        .first()
        .and_then(|p| track.iter().position(place(p.from)));
    let to = passes
        .last()
        .and_then(|p| track.iter().rposition(place(p.to)));
    let ends = from.zip(to).filter(|(from, to)| from <= to);
    ends.map_or_else(|| track.to_vec(), |(from, to)| track[from..=to].to_vec())
}

/// The fields of an object.
fn fields(object: Value) -> Map<String, Value> {
    match object {
        Value::Object(fields) => fields,
        _ => Map::new(),
    }
}

/// A square round a point, to show a cell.
fn square(middle: Point, side_m: f64) -> Vec<Point> {
    let half = side_m / 2.0;
    [(-half, -half), (half, -half), (half, half), (-half, half)]
        .map(|(x, y)| Point::new(middle.x + x, middle.y + y))
        .to_vec()
}
