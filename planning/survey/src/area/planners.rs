//! Both planners of areas behind one question: flights of some UAVs over a part of the
//! area, with lanes of one width (D2.7 §3.6).
//!
//! Leaves to [`super::lanes`] which UAVs work on which part.

use super::cells::{self, CellFlights, CellProblem};
use super::courses::{self, Courses, Effort};
use super::flights::{self, MOST_SAMPLES, Samples};
use super::flown_passes::{FlownPasses, Ground, Laid, fly_within};
use super::lanes::FEW_SAMPLES;
use super::promise::{Flyers, Promise};
use super::sight::Footprint;
use super::{AreaError, AreaRequest, Facts, Planner, PlannerError, Progress, Shape, ShapeKind};
use crate::detours::{DetourError, Detours};
use crate::flight::Flight;
use crate::flown::{Air, Airspace};
use crate::objective::Worth;
use crate::passes;
use crate::team::PlannedUav;
use skein_flight::coverage::passes::{Directions, Pass, PassesError, PassesProblem};
use skein_geometry::frame::Point;
use skein_geometry::offset::Zone;
use skein_geometry::{NoFlyZones, Polygon};

/// Steps of improvement of the approximate planner for each of the exact one's: its steps
/// are smaller.
const CELL_STEPS: usize = 50;

/// Times that cells are shared out again where turns take what endurance was left.
const ENDURANCE_ROUNDS: usize = 3;

/// What all plans of one area share: the request, and the zones grown by the clearance.
pub(crate) struct OpenArea<'a> {
    /// What is asked.
    pub request: &'a AreaRequest,
    /// Told how far a search is.
    tell: &'a (dyn Fn(Progress) + Sync),
    airspace: Airspace,
    detours: Detours,
}

/// Plans of a part on one course after the other.
struct CourseDesk<'a> {
    open: &'a OpenArea<'a>,
    job: Job<'a>,
    ground: Ground<'a>,
    flyers: Flyers,
    /// Samples for plans that are only compared, and for others.
    few: Samples,
    all: Samples,
}

impl Courses for CourseDesk<'_> {
    type Laid = Laid;

    fn laid(&self, directions: Directions, effort: Effort) -> Result<Laid, PlannerError> {
        let problem = self.open.passes_problem(&self.job, directions, effort);
        Ok(self.ground.laid(&problem, effort.rounds > 1)?)
    }

    fn promise(&self, laid: &Laid) -> Promise {
        let footprint = self.open.footprint(&self.job);
        Promise::of(laid.passes(), &self.flyers, &self.all, footprint)
    }

    fn flown(&self, laid: Laid, effort: Effort) -> Result<Part, PlannerError> {
        let problem = self
            .open
            .passes_problem(&self.job, Directions::Best, effort);
        let plan = self.ground.flown(&problem, laid, effort.rounds)?;
        Ok(self.open.part(&self.job, plan, self.ground.airs()))
    }

    fn worth(&self, part: &Part, effort: Effort) -> Worth {
        let samples = if effort.is_full() {
            &self.all
        } else {
            &self.few
        };
        let share = samples.share(part.seen().into_iter());
        Worth::of(part.flights.iter(), share, self.job.in_watt_hours)
    }
}

/// A part of the area, and who sees it.
#[derive(Clone, Copy)]
pub(crate) struct Job<'a> {
    /// The part.
    pub area: &'a Polygon,
    /// Who flies.
    pub crew: &'a [PlannedUav],
    /// Width of the lanes, metres.
    pub lane_m: f64,
    /// Turn radius that lanes are ordered for, metres.
    pub turn_radius_m: f64,
    /// Steps of improvement.
    pub steps: usize,
    /// Whether energies are compared in watt-hours.
    pub in_watt_hours: bool,
    /// Whether the plan is only compared with others: no courses are searched for it.
    pub rough: bool,
    /// A plan is wanted only if it may be better than this.
    pub better_than: Option<Worth>,
}

/// The flights over a part.
#[derive(Default)]
pub(crate) struct Part {
    /// In the order of the crew.
    pub flights: Vec<Flight>,
    /// The share of its lanes that endurance lets it fly.
    pub done_share: f64,
    /// What the planner tells of its own.
    pub facts: Option<Facts>,
    /// Rings for a map.
    pub shapes: Vec<Shape>,
    /// What it took to plan, about, in edges that were looked at; 0 if nobody counted.
    pub work: u64,
    /// Courses that would have taken too long to plan in full.
    pub courses_left: usize,
    /// What all courses promise that were looked at; none where some were not.
    pub promises: Vec<Promise>,
    seen: Seen,
}

/// What of the ground is seen: from passes, and how far.
type Seen = Option<(Vec<Pass>, Footprint)>;

impl Part {
    /// What of the ground is seen.
    pub(crate) fn seen(&self) -> Option<flights::Seen<'_>> {
        let (passes, footprint) = self.seen.as_ref()?;
        Some((passes, *footprint))
    }

    /// Whether a point is seen.
    fn sees(&self, p: Point) -> bool {
        self.seen()
            .is_some_and(|(passes, Footprint { across_m, along_m })| {
                passes.iter().any(|pass| pass.sees(p, across_m, along_m))
            })
    }

    /// When its last UAV is back, seconds.
    pub(crate) fn makespan_s(&self) -> f64 {
        self.flights.iter().map(Flight::time_s).fold(0.0, f64::max)
    }
}

impl<'a> OpenArea<'a> {
    /// The area with its zones grown by the clearance; `starts` are the UAVs'.
    ///
    /// # Errors
    /// When the clearance is no length, or a fence has no outside.
    pub(crate) fn new(
        request: &'a AreaRequest,
        tell: &'a (dyn Fn(Progress) + Sync),
        starts: impl Iterator<Item = Point>,
    ) -> Result<Self, AreaError> {
        let starts: Vec<Point> = starts.collect();
        let places = starts.iter().chain(request.area.vertices()).copied();
        let (zones, fences) = (&request.zones, &request.fences);
        let airspace = Airspace::new(zones, fences, places, request.clearance_m)?;
        let keep_m = airspace.clearance_m();
        Ok(Self {
            request,
            tell,
            detours: detours(&request.area, airspace.zones(), keep_m, starts.into_iter())?,
            airspace,
        })
    }

    /// Whether a point of the area is to be seen: in no hole and no zone as they are drawn.
    pub(crate) fn wants(&self, p: Point) -> bool {
        self.request.zones.distance_m(p) > 0.0 && !self.request.holes.iter().any(|h| h.contains(p))
    }

    /// Whether a point that is to be seen is nearer to a zone or a fence than the clearance,
    /// or outside of a fence.
    pub(crate) fn is_too_near(&self, p: Point) -> bool {
        self.airspace.zones().distance_m(p) < self.airspace.clearance_m()
    }

    /// Plans a part; none where no plan can be better than what is to be beaten.
    ///
    /// # Errors
    /// When there is no plan.
    pub(crate) fn plan(
        &self,
        planner: Planner,
        job: Job<'_>,
    ) -> Result<Option<Part>, PlannerError> {
        match planner {
            Planner::Exact => match self.exact(job) {
                // A section that zones and holes fill is no work.
                Err(PlannerError::Passes(PassesError::Nothing))
                    if job.area != &self.request.area =>
                {
                    Ok(Some(self.at_home(&job)))
                }
                plan => plan,
            },
            Planner::Approximate => self.approximate(job).map(Some),
        }
    }

    /// Straight passes on the course that is asked for, or the one that is best when they are
    /// flown.
    fn exact(&self, job: Job<'_>) -> Result<Option<Part>, PlannerError> {
        let problem = self.passes_problem(&job, Directions::Best, Effort::FULL);
        let (crew, airs) = (crew_of(&job), self.airs(&job));
        let ground = Ground::new(&problem, &crew, &airs, self.request.run_out_m)?;
        let wants = |p| self.wants(p);
        let samples = |most| Samples::new(job.area, wants, job.lane_m, most);
        let desk = CourseDesk {
            open: self,
            job,
            flyers: ground.flyers(),
            ground,
            few: samples(FEW_SAMPLES),
            all: samples(MOST_SAMPLES),
        };
        let asked = courses::Asked {
            objective: self.request.objective,
            steps: job.steps,
            quick: self.request.quick,
            better_than: job.better_than,
            tell: self.tell,
        };
        let one = match self.request.heading_rad {
            Some(heading_rad) => Directions::Fixed(heading_rad),
            None if job.rough => Directions::Best,
            None => return courses::best(job.area, asked, &desk),
        };
        let laid = desk.laid(one, Effort::FULL)?;
        let promise = desk.promise(&laid);
        if let Some(worth) = &job.better_than
            && !promise.may_be_better(worth, asked.objective)
        {
            return Ok(None);
        }
        let part = desk.flown(laid, Effort::FULL)?;
        Ok(Some(Part {
            promises: vec![promise],
            ..part
        }))
    }

    fn passes_problem(
        &self,
        job: &Job<'_>,
        directions: Directions,
        effort: Effort,
    ) -> PassesProblem {
        PassesProblem {
            holes: self.request.holes.clone(),
            zones: self.airspace.zones().clone(),
            clearance_m: self.airspace.clearance_m(),
            look_ahead_m: self.look_ahead_m(job),
            steps: (job.steps / effort.steps_part).max(1),
            directions,
            ..PassesProblem::new(
                job.area.clone(),
                job.lane_m,
                job.turn_radius_m,
                Point::origin(),
            )
        }
    }

    fn look_ahead_m(&self, job: &Job<'_>) -> f64 {
        self.request.look_ahead_m.unwrap_or(job.lane_m / 2.0)
    }

    fn footprint(&self, job: &Job<'_>) -> Footprint {
        Footprint {
            across_m: job.lane_m / 2.0,
            along_m: self.look_ahead_m(job),
        }
    }

    /// By UAV: what it flies through.
    fn airs(&self, job: &Job<'_>) -> Vec<Air> {
        let air = |uav: &PlannedUav| self.request.air(uav.speed_mps);
        job.crew.iter().map(air).collect()
    }

    /// A plan of passes as flights.
    fn part(&self, job: &Job<'_>, plan: FlownPasses, airs: &[Air]) -> Part {
        let flights = job.crew.iter().enumerate().map(|(i, uav)| {
            let flown = &plan.flights[i];
            let track = flown.track(uav.start);
            let mut flight = self.flight(uav, job, &track, flown.air_m(&airs[i]));
            flight.lap = lap(&track, &plan.tours[i]);
            flight.passes = Some(plan.tours[i].len());
            flight.legs.clone_from(&flown.legs);
            flight
        });
        let flights = flights.collect();
        let shapes = plan.cells.iter().enumerate().map(|(i, cell)| {
            let kind = ShapeKind::Cell {
                number: i + 1,
                area_m2: cell.area_m2,
            };
            let ring = cell.ring.clone();
            Shape { ring, kind }
        });
        let passes: Vec<Pass> = plan.tours.into_iter().flatten().collect();
        let length_m = |passes: &[Pass]| passes.iter().map(Pass::length_m).sum();
        let (flown_m, left_m): (f64, f64) = (length_m(&passes), length_m(&plan.unserved));
        let unreached = plan.unreached.iter().map(|pass| Shape {
            ring: vec![pass.from, pass.to],
            kind: ShapeKind::Unreached,
        });
        let shapes = shapes.chain(unreached);
        Part {
            flights,
            done_share: flown_m / (flown_m + left_m).max(f64::MIN_POSITIVE),
            facts: Some(Facts::Passes {
                area_m2: plan.cells.iter().map(|c| c.area_m2).sum(),
                cells: plan.cells.len(),
                passes: passes.len(),
                unserved_passes: plan.unserved.len(),
                unreached_passes: plan.unreached.len(),
            }),
            shapes: shapes.collect(),
            work: plan.work,
            courses_left: 0,
            promises: Vec::new(),
            seen: Some((passes, self.footprint(job))),
        }
    }

    /// Cells shared out, and flown cell by cell or as the passes over them are best flown.
    fn approximate(&self, job: Job<'_>) -> Result<Part, PlannerError> {
        for uav in job.crew {
            check_start(&self.detours, &uav.name, uav.start)?;
        }
        let cells = self.cells(&job)?;
        let by_cell = self.cell_by_cell(&job, &cells);
        if job.rough {
            return Ok(by_cell);
        }
        let Ok(by_pass) = self.pass_by_pass(&job, &cells) else {
            return Ok(by_cell);
        };
        let samples = Samples::new(job.area, |p| self.wants(p), job.lane_m, MOST_SAMPLES);
        let worth = |part: &Part| {
            let share = samples.share(part.seen().into_iter());
            Worth::of(part.flights.iter(), share, job.in_watt_hours)
        };
        let sooner = worth(&by_pass).beats(&worth(&by_cell), self.request.objective);
        Ok(if sooner { by_pass } else { by_cell })
    }

    /// Cells for each UAV, as many as its endurance lets it fly with all turns.
    fn cells(&self, job: &Job<'_>) -> Result<CellFlights, PlannerError> {
        let router = self.airspace.router(job.turn_radius_m);
        let mut crew = job.crew.to_vec();
        let mut rounds = ENDURANCE_ROUNDS;
        loop {
            let plan = cells::plan(&CellProblem {
                area: job.area,
                holes: &self.request.holes,
                detours: &self.detours,
                team: &crew,
                lane_m: job.lane_m,
                steps: job.steps.saturating_mul(CELL_STEPS),
            })?;
            // What turns take of the endurance is not flown over cells: others fly these.
            let mut late = false;
            for (i, uav) in job.crew.iter().enumerate() {
                if uav.endurance_s.is_finite() && rounds > 0 {
                    let air = self.request.air(uav.speed_mps);
                    let all = fly_within(
                        &router,
                        uav.start,
                        &plan.passes[i],
                        f64::INFINITY,
                        &air,
                        self.request.run_out_m,
                    );
                    let over = all.0.air_m(&air) / (uav.endurance_s * uav.speed_mps);
                    late |= over > 1.0;
                    crew[i].endurance_s /= over.max(1.0) * 1.01;
                }
            }
            if !late {
                return Ok(plan);
            }
            rounds -= 1;
        }
    }

    /// Every UAV flies its cells in the order in which they were shared out.
    fn cell_by_cell(&self, job: &Job<'_>, cells: &CellFlights) -> Part {
        let router = self.airspace.router(job.turn_radius_m);
        let (mut flights, mut seen) = (Vec::new(), Vec::new());
        let (mut wanted_m, mut seen_m) = (0.0, 0.0);
        for (i, uav) in job.crew.iter().enumerate() {
            let longest_m = uav.endurance_s * uav.speed_mps;
            let air = self.request.air(uav.speed_mps);
            let (flown, passes) = fly_within(
                &router,
                uav.start,
                &cells.passes[i],
                longest_m,
                &air,
                self.request.run_out_m,
            );
            let length_m = |p: &[Pass]| p.iter().map(|p| p.length_m() + job.lane_m).sum::<f64>();
            wanted_m += length_m(&cells.passes[i]);
            seen_m += length_m(&passes);
            flights.push(Flight {
                lap: cells.laps[i].clone(),
                passes: Some(passes.len()),
                legs: flown.legs.clone(),
                ..self.flight(uav, job, &flown.track(uav.start), flown.air_m(&air))
            });
            seen.extend(passes);
        }
        let covered = 1.0 - cells.left.len() as f64 / cells.raster.map.n_free().max(1) as f64;
        let part = Part {
            flights,
            done_share: covered * seen_m / f64::max(wanted_m, f64::MIN_POSITIVE),
            seen: Some((seen, self.footprint(job))),
            ..Part::default()
        };
        of_cells(part, job, cells, cells.left.clone())
    }

    /// The passes over all cells, and such that see what no cell does, shared out and ordered
    /// by what they take when they are flown.
    fn pass_by_pass(&self, job: &Job<'_>, cells: &CellFlights) -> Result<Part, PlannerError> {
        let problem = self.passes_problem(job, Directions::Best, Effort::FULL);
        let passes = cells.passes.iter().flatten().copied().collect();
        let (crew, airs) = (crew_of(job), self.airs(job));
        let ground = Ground::new(&problem, &crew, &airs, self.request.run_out_m)?;
        let laid = ground.laid_before(&problem, passes)?;
        let plan = ground.flown(&problem, laid, Effort::FULL.rounds)?;
        let part = self.part(job, plan, &airs);
        let left = cells.left.iter().filter(|p| !part.sees(**p));
        let left = left.copied().collect();
        Ok(of_cells(part, job, cells, left))
    }
}

/// A plan of cells with what is told of these: how many, and which are left.
fn of_cells(part: Part, job: &Job<'_>, cells: &CellFlights, left: Vec<Point>) -> Part {
    let shape = |p: &Point| Shape {
        ring: square(*p, job.lane_m),
        kind: ShapeKind::LeftCell,
    };
    let shapes = part.shapes.iter().cloned();
    Part {
        shapes: shapes.chain(left.iter().map(shape)).collect(),
        facts: Some(Facts::Cells {
            lower_bound_s: cells.least_s,
            cells: cells.raster.map.n_free(),
            cells_blocked: cells.raster.n_blocked,
            cells_left: left.len(),
            turns_fit: 2.0 * job.turn_radius_m <= job.lane_m,
        }),
        work: 0,
        ..part
    }
}

impl OpenArea<'_> {
    /// Nothing to see: all stay.
    fn at_home(&self, job: &Job<'_>) -> Part {
        let stay = |uav| self.flight(uav, job, &[], 0.0);
        Part {
            flights: job.crew.iter().map(stay).collect(),
            done_share: 1.0,
            ..Part::default()
        }
    }

    /// One UAV's flight, so long through the air; without a track it stays at its start.
    fn flight(&self, uav: &PlannedUav, job: &Job<'_>, track: &[Point], length_m: f64) -> Flight {
        Flight {
            uav: uav.uav,
            name: uav.name.clone(),
            track: match track {
                [] => vec![uav.start],
                track => track.to_vec(),
            },
            lap: Vec::new(),
            length_m,
            speed_mps: uav.speed_mps,
            turn_radius_m: self.request.team[uav.uav].turn_radius_m,
            lane_m: job.lane_m,
            cruise_power_w: uav.cruise_power_w,
            passes: None,
            legs: Vec::new(),
        }
    }
}

/// A crew as planners of passes take it.
fn crew_of(job: &Job<'_>) -> Vec<passes::Uav> {
    let uav = |uav: &PlannedUav| passes::Uav {
        speed: uav.speed_mps * uav.pace,
        // In the time of that pace, so that the length is the same.
        endurance: uav.endurance_s / uav.pace,
        ..passes::Uav::at(uav.start)
    };
    job.crew.iter().map(uav).collect()
}

/// The zones of an area to fly round, from these starts too.
///
/// # Errors
/// When the clearance is no length.
pub(super) fn detours(
    area: &Polygon,
    zones: &NoFlyZones,
    clearance_m: f64,
    starts: impl Iterator<Item = Point>,
) -> Result<Detours, DetourError> {
    let zones = zones.zones().iter().map(|zone| Zone {
        outer: zone.vertices().to_vec(),
        holes: Vec::new(),
    });
    let zones: Vec<Zone> = zones.collect();
    let places: Vec<Point> = starts.chain(area.vertices().iter().copied()).collect();
    Detours::new(&zones, clearance_m, &places)
}

/// Refuses a start in a zone.
///
/// # Errors
/// Names the UAV.
pub(crate) fn check_start(detours: &Detours, name: &str, start: Point) -> Result<(), PlannerError> {
    if detours.forbids(start) {
        return Err(PlannerError::LaunchInZone(name.to_owned()));
    }
    Ok(())
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

/// A square round a point, to show a cell.
fn square(middle: Point, side_m: f64) -> Vec<Point> {
    let half = side_m / 2.0;
    [(-half, -half), (half, -half), (half, half), (-half, half)]
        .map(|(x, y)| Point::new(middle.x + x, middle.y + y))
        .to_vec()
}
