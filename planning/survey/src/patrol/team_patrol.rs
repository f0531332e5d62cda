//! Points, lines or an area seen again and again by a team: one closed tour planned as if
//! for one UAV, and the team spaced on it (D2.7 §3.6.6).
//!
//! Leaves to others: the tour ([`crate::tours`], [`crate::area`]) and what spacing is best
//! ([`crate::patrol`]).

use super::{
    Change, Patrol, Pattern, Station, Tour, TourError, Uav as PatrolUav, after_losses,
    patrol_within, revisit_bound, spread,
};
use crate::area::{self, AreaError, AreaRequest, Lanes, Planner, Planners};
use crate::detours::{DetourError, DetourSearch, Detours};
use crate::flight::length_m;
use crate::heights::Separation;
use crate::objective::Objective;
use crate::team::{self, Sensor, TeamError, Uav};
use crate::tours::{Targets, TourProblem, TourRequest, ToursError};
use crate::visits;
use skein_flight::coverage::lines;
use skein_flight::coverage::metric::{InWind, Metric, TooWindy};
use skein_geometry::frame::{Point, Vector};
use skein_geometry::offset::Zone;
use skein_geometry::{NoFlyZones, Polygon};
use std::sync::Arc;
use thiserror::Error;

/// Speeds that differ by less than this are the same, m/s.
const SAME_SPEED_MPS: f64 = 1e-9;

/// What is patrolled.
#[derive(Clone, Debug)]
pub enum Over {
    /// Points or lines.
    Targets {
        /// What is to be seen.
        targets: Targets,
        /// Where nobody may fly.
        zones: Vec<Zone>,
    },
    /// An area.
    Area {
        /// The area.
        area: Polygon,
        /// Parts of it that need not be seen; they may be flown over.
        holes: Vec<Polygon>,
        /// Where nobody may fly.
        zones: Arc<NoFlyZones>,
        /// Which planners are asked.
        planners: Planners,
    },
}

/// What is to be seen again and again, and by whom.
#[derive(Clone, Debug)]
pub struct PatrolRequest {
    /// What is patrolled.
    pub over: Over,
    /// The UAVs. All fly one tour, with lanes for the narrowest swath and the widest turn.
    pub team: Vec<Uav>,
    /// Distance kept from every zone, metres.
    pub clearance_m: f64,
    /// The wind, where it blows to, m/s. In a wind all UAVs fly at one airspeed.
    pub wind_mps: Vector,
    /// Height of all flights above home, metres.
    pub altitude_m: f64,
    /// Steps of improvement; the same steps give the same plan everywhere.
    pub steps: usize,
    /// Who fails, if that is asked.
    pub losses: Option<Losses>,
}

/// UAVs that fail.
#[derive(Clone, Debug, PartialEq)]
pub struct Losses {
    /// What they are called.
    pub names: Vec<String>,
    /// When they fail, seconds after a moment in which all are at their stations.
    pub after_s: f64,
}

/// What the tour of a patrol leads over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TourKind {
    /// Points.
    Points,
    /// Lines.
    Lines,
    /// An area, as this planner has it.
    Area(Planner),
}

/// A patrol of a team.
#[derive(Clone, Debug, PartialEq)]
pub struct PatrolPlan {
    /// What the tour leads over.
    pub over: TourKind,
    /// Length of the tour, metres, with its turns where the planner knows them.
    pub tour_m: f64,
    /// Who flies where on the tour.
    pub pattern: Pattern,
    /// The longest time between two visits of a place, seconds.
    pub revisit_s: f64,
    /// No patrol of this team revisits sooner, seconds.
    pub revisit_bound_s: f64,
    /// When all are at their stations, seconds.
    pub steady_s: f64,
    /// By UAV of the request.
    pub uavs: Vec<PatrolFlight>,
    /// How the others go on, where losses are asked.
    pub after_losses: Option<AfterLosses>,
    /// What is worth saying: who rests, what was left out.
    pub notices: Vec<String>,
}

impl PatrolPlan {
    /// How many UAVs fly.
    #[must_use]
    pub fn uavs_flying(&self) -> usize {
        self.uavs.iter().filter(|u| u.station.is_some()).count()
    }
}

/// One UAV of a patrol: its first period.
#[derive(Clone, Debug, PartialEq)]
pub struct PatrolFlight {
    /// What the UAV is called.
    pub name: String,
    /// Corners: the way to its station, once round or to and fro, and home; its start
    /// alone if it rests.
    pub path: Vec<Point>,
    /// Height above home, metres.
    pub altitude_m: f64,
    /// Airspeed, m/s.
    pub speed_mps: f64,
    /// Its station; none if it rests.
    pub station: Option<PatrolStation>,
}

/// Where a UAV takes part in a patrol.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatrolStation {
    /// Its place on the tour, metres from the first corner.
    pub place_m: f64,
    /// The same as a share of the tour.
    pub phase: f64,
    /// What the way there takes, seconds.
    pub way_s: f64,
    /// How long it waits there for the last one, seconds.
    pub wait_s: f64,
    /// Once round, or to and fro on its arc, seconds.
    pub period_s: f64,
    /// One period with the ways there and back, seconds.
    pub time_s: f64,
    /// Length of its arc, metres, if it flies to and fro.
    pub arc_m: Option<f64>,
}

/// How a patrol goes on without some of its UAVs.
#[derive(Clone, Debug, PartialEq)]
pub struct AfterLosses {
    /// What the lost ones are called.
    pub lost: Vec<String>,
    /// Who flies where on the tour from then on.
    pub pattern: Pattern,
    /// The longest time between two visits of a place from then on, seconds.
    pub revisit_s: f64,
    /// No patrol of those who are left revisits sooner, seconds.
    pub revisit_bound_s: f64,
    /// When all are where they are to be, seconds after the failure.
    pub steady_s: f64,
    /// The longest time that a place waits meanwhile, seconds.
    pub gap_s: f64,
    /// What those who are left and fly do.
    pub uavs: Vec<GoesOn>,
}

/// What a UAV does after a loss.
#[derive(Clone, Debug, PartialEq)]
pub struct GoesOn {
    /// What it is called.
    pub name: String,
    /// Where it takes part from then on, metres from the tour's first corner.
    pub place_m: f64,
    /// The same in the plane.
    pub at: Point,
    /// Whether it rested before.
    pub joins: bool,
    /// How long it flies there, seconds.
    pub way_s: f64,
    /// How long it loiters, seconds.
    pub loiter_s: f64,
    /// Once round, or to and fro on its arc, seconds.
    pub period_s: f64,
    /// Where its arc begins on the tour and how long it is, metres, if it flies to and fro.
    pub arc_m: Option<(f64, f64)>,
}

/// Why there is no patrol. Nothing was planned.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PatrolError {
    /// The team cannot be planned for.
    #[error(transparent)]
    Team(#[from] TeamError),
    /// There is no tour over the area.
    #[error(transparent)]
    Area(#[from] AreaError),
    /// There is no tour over the targets.
    #[error(transparent)]
    Targets(#[from] ToursError),
    /// There are no ways round the zones.
    #[error(transparent)]
    Zones(#[from] DetourError),
    /// Nothing is to be seen.
    #[error("there is nothing to patrol")]
    Nothing,
    /// The tour is too short or too long.
    #[error(transparent)]
    Tour(#[from] TourError),
    /// A UAV starts in a zone; it is named.
    #[error("the launch point of {0} lies in a zone or nearer to one than the clearance")]
    LaunchInZone(String),
    /// UAVs of unlike speeds in a wind.
    #[error("in a wind, UAVs of unlike speeds cannot be planned together")]
    UnlikeInWind,
    /// The wind is as fast as the UAVs.
    #[error(transparent)]
    TooWindy(#[from] TooWindy),
    /// Zones lie all round a UAV, which is named.
    #[error("{0} has no way from its start to the tour")]
    NoWay(String),
    /// No UAV has the endurance for one period.
    #[error(
        "nobody can fly this patrol: once round takes {round_s:.0} s, to and fro on an arc {arc_s:.0} s, and the longest endurance leaves {longest_s:.0} s besides the ways there and back"
    )]
    Nobody {
        /// The fastest UAV once round, seconds.
        round_s: f64,
        /// To and fro on an arc of all, seconds.
        arc_s: f64,
        /// What the longest endurance leaves, seconds.
        longest_s: f64,
    },
    /// A UAV that is to fail is none of the team.
    #[error("no UAV is called {0:?}")]
    Unknown(String),
    /// The time of the losses is no time.
    #[error("the losses come after a time from 0, found {0} s")]
    LossTime(f64),
    /// The losses leave nobody.
    #[error("nobody is left who can fly one period")]
    NobodyLeft,
}

/// Plans.
///
/// One closed tour is planned as if for one UAV. Equal UAVs fly round, evenly spaced. Of
/// unequal ones either each flies to and fro on an arc in proportion to its speed, or the
/// fastest few fly round at the speed of the slowest of them, whichever revisits sooner.
///
/// # Guarantees
/// As [`patrol_within`], for the tour that was found. The same request gives the same plan
/// everywhere.
///
/// # Errors
/// [`PatrolError`] when a figure has no meaning, there is no tour, or nobody can fly one
/// period.
pub fn plan(request: &PatrolRequest) -> Result<PatrolPlan, PatrolError> {
    team::check_places(&request.team)?;
    if let Some(losses) = &request.losses
        && !(losses.after_s.is_finite() && losses.after_s >= 0.0)
    {
        return Err(PatrolError::LossTime(losses.after_s));
    }
    let course = match &request.over {
        Over::Targets { targets, zones } => over_targets(request, targets, zones)?,
        Over::Area {
            area,
            holes,
            zones,
            planners,
        } => {
            let alone = AreaRequest {
                area: area.clone(),
                holes: holes.clone(),
                zones: Arc::clone(zones),
                fences: Vec::new(),
                team: vec![alone(request)],
                sensor: None,
                clearance_m: request.clearance_m,
                look_ahead_m: None,
                heading_rad: None,
                planners: *planners,
                lanes: Lanes::Common,
                objective: Objective::Time,
                separation: Separation::FLAT,
                altitude_m: request.altitude_m,
                steps: request.steps,
            };
            over_area(request, &alone)?
        }
    };
    let watch = Watch::new(request, course)?;
    let flown = watch.flown()?;
    watch.told(&flown)
}

/// What is flown again and again, and by whom.
struct Course {
    kind: TourKind,
    /// Corners; the last leads to the first.
    lap: Vec<Point>,
    /// What a leg takes for each metre of it: turns add to its length.
    stretch: f64,
    detours: Detours,
    notices: Vec<String>,
}

/// One tour over points or lines, without a depot on it.
fn over_targets(
    request: &PatrolRequest,
    targets: &Targets,
    zones: &[Zone],
) -> Result<Course, PatrolError> {
    let mut problem = TourProblem::new(&TourRequest {
        targets: targets.clone(),
        zones: zones.to_vec(),
        clearance_m: request.clearance_m,
        team: request.team.clone(),
        wind_mps: request.wind_mps,
        sensor: None,
        objective: Objective::Time,
        separation: Separation::FLAT,
        altitude_m: request.altitude_m,
        steps: request.steps,
    })?;
    let points = matches!(targets, Targets::Points(_));
    let (plan, detours) = problem.solve(|q| {
        let Some(first) = q.lines.first() else {
            return Ok(None);
        };
        let one = [lines::Uav::at(first.a)];
        let plan = if points {
            visits::visit(q.lines, &one, q.metric, request.steps)
        } else {
            lines::plan(q.lines, &one, q.metric, request.steps)
        };
        Ok(Some(plan?))
    })?;
    problem.ignore_sensors();
    let first = problem.ways.first().and_then(|w| w.places.first());
    let (Some(plan), Some(first)) = (plan, first) else {
        return Err(PatrolError::Nothing);
    };
    let mut lap = problem.track(&detours, &plan.tours[0].passes, problem.at[*first]);
    lap.pop();
    Ok(Course {
        kind: if points {
            TourKind::Points
        } else {
            TourKind::Lines
        },
        lap,
        stretch: 1.0,
        detours,
        notices: problem.notices,
    })
}

/// The UAV that the tour over an area is planned for: it sees as narrow and turns as wide
/// as any of the team.
fn alone(request: &PatrolRequest) -> Uav {
    let (team, height_m) = (&request.team, request.altitude_m);
    let swaths = team.iter().filter_map(|u| u.swath_m(None, height_m));
    let width_m = swaths.fold(f64::INFINITY, f64::min);
    let turns = team.iter().map(|u| u.turn_radius_m);
    // The first of the team lends its name and speed: one UAV's tour is the same at any.
    let (name, speed_mps) = team.first().map_or(("", 0.0), |u| (&u.name, u.speed_mps));
    Uav::new(
        name,
        Point::origin(),
        speed_mps,
        turns.fold(0.0, f64::max),
        Sensor::Swath { width_m },
    )
}

/// One tour over an area: of the planner that is asked for, or the better one.
fn over_area(request: &PatrolRequest, alone: &AreaRequest) -> Result<Course, PatrolError> {
    let plan = area::plan(alone)?;
    let flight = plan.uavs.first().ok_or(PatrolError::Nothing)?;
    let team = &request.team;
    let starts = team.iter().map(|u| u.start);
    let detours = area::detours(&alone.area, &alone.zones, request.clearance_m, starts)?;
    for uav in team {
        if detours.forbids(uav.start) {
            return Err(PatrolError::LaunchInZone(uav.name.clone()));
        }
    }
    let mut lap = flight.lap.clone();
    if let (Some(first), Some(last)) = (lap.first().copied(), lap.last().copied()) {
        let home = detours.search().way(last, first).unwrap_or_default();
        let between = home.len().saturating_sub(2);
        lap.extend(home.into_iter().skip(1).take(between));
    }
    let drawn_m = length_m(&flight.path);
    Ok(Course {
        kind: TourKind::Area(plan.figures.planner),
        lap,
        stretch: (flight.length_m / drawn_m.max(f64::MIN_POSITIVE)).max(1.0),
        detours,
        notices: plan.notices,
    })
}

/// The tour in millimetres with the team beside it.
struct Watch<'a> {
    request: &'a PatrolRequest,
    course: Course,
    tour: Tour,
    /// By UAV, millimetres a second.
    speeds: Vec<u32>,
    /// By UAV: its nearest place on the tour, and the way there.
    nearest: Vec<(u32, f64)>,
    uavs: Vec<PatrolUav>,
}

/// A patrol from its beginning on.
struct Flown {
    patrol: Patrol,
    stations: Vec<Station>,
    /// By UAV: the way to its station; none for one that rests.
    ways: Vec<Option<(Vec<Point>, f64)>>,
    /// When all are there, seconds.
    steady_s: f64,
}

impl<'a> Watch<'a> {
    fn new(request: &'a PatrolRequest, course: Course) -> Result<Self, PatrolError> {
        let wind = request.wind_mps;
        let base_mps = request.team.first().map_or(0.0, |u| u.speed_mps);
        let alike = |u: &Uav| (u.speed_mps - base_mps).abs() < SAME_SPEED_MPS;
        if wind.norm() >= SAME_SPEED_MPS && !request.team.iter().all(alike) {
            return Err(PatrolError::UnlikeInWind);
        }
        InWind::new(&[], base_mps, wind)?;
        let leg = |a: Point, b: Point| course.stretch * air_m(&[a, b], base_mps, wind);
        let tour = Tour::new(course.lap.clone(), leg)?;
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a cast of a float saturates"
        )]
        let whole = |u: &Uav| ((u.speed_mps * 1000.0).round() as u32).max(1);
        let speeds = request.team.iter().map(whole).collect();
        let mut watch = Self {
            nearest: Vec::new(),
            uavs: Vec::new(),
            request,
            course,
            tour,
            speeds,
        };
        let mut search = watch.course.detours.search();
        let mut nearest = Vec::new();
        for (i, uav) in request.team.iter().enumerate() {
            let place = watch.tour.nearest(uav.start);
            let (_, way_s) = watch.way(&mut search, i, place)?;
            nearest.push((place, way_s));
        }
        let able = |(uav, (_, way_s)): (usize, &(u32, f64))| {
            let endurance_s = request.team[uav].endurance_s;
            PatrolUav {
                speed: watch.speeds[uav],
                longest_s: endurance_s.unwrap_or(f64::INFINITY) - 2.0 * way_s,
            }
        };
        let uavs = nearest.iter().enumerate().map(able).collect();
        drop(search);
        (watch.nearest, watch.uavs) = (nearest, uavs);
        Ok(watch)
    }

    fn name(&self, uav: usize) -> &str {
        &self.request.team[uav].name
    }

    /// The way from a UAV's launch point to a place of the tour, and what it takes.
    fn way(
        &self,
        search: &mut DetourSearch<'_>,
        uav: usize,
        place: u32,
    ) -> Result<(Vec<Point>, f64), PatrolError> {
        let to = self.tour.point(place);
        let Uav {
            start, speed_mps, ..
        } = self.request.team[uav];
        let way = search
            .way(start, to)
            .ok_or_else(|| PatrolError::NoWay(self.name(uav).to_owned()))?;
        let way_s = air_m(&way, speed_mps, self.request.wind_mps) / speed_mps;
        Ok((way, way_s))
    }

    /// The pattern, and how it begins.
    fn flown(&self) -> Result<Flown, PatrolError> {
        let n = self.tour.len_mm();
        let Some(patrol) = patrol_within(n, &self.uavs) else {
            let fastest = self.speeds.iter().max().copied().unwrap_or(1);
            let longest = self.uavs.iter().map(|u| u.longest_s).fold(0.0, f64::max);
            return Err(PatrolError::Nobody {
                round_s: f64::from(n) / f64::from(fastest),
                arc_s: 2.0 * revisit_bound(n, &self.speeds),
                longest_s: longest,
            });
        };
        let straight_s = |uav: usize, place: u32| {
            let uav = &self.request.team[uav];
            (self.tour.point(place) - uav.start).norm() / uav.speed_mps
        };
        let (patrol, stations) = spread(n, &patrol, straight_s);
        let mut ways = vec![None; self.uavs.len()];
        let mut search = self.course.detours.search();
        for s in &stations {
            ways[s.uav] = Some(self.way(&mut search, s.uav, s.place)?);
        }
        let steady_s = ways.iter().flatten().map(|w| w.1).fold(0.0, f64::max);
        Ok(Flown {
            patrol,
            stations,
            ways,
            steady_s,
        })
    }

    /// What the caller gets.
    fn told(&self, flown: &Flown) -> Result<PatrolPlan, PatrolError> {
        let n = self.tour.len_mm();
        let mut notices = self.course.notices.clone();
        notices.extend(self.too_short(&flown.patrol));
        let losses = self.request.losses.as_ref();
        let uavs = 0..self.uavs.len();
        Ok(PatrolPlan {
            over: self.course.kind,
            tour_m: f64::from(n) / 1000.0,
            pattern: flown.patrol.pattern.clone(),
            revisit_s: flown.patrol.revisit_s,
            revisit_bound_s: revisit_bound(n, &self.speeds),
            steady_s: flown.steady_s,
            uavs: uavs.map(|uav| self.flight(flown, uav)).collect(),
            after_losses: losses.map(|l| self.after(l, flown)).transpose()?,
            notices,
        })
    }

    /// Who rests because its endurance is short.
    fn too_short(&self, patrol: &Patrol) -> Vec<String> {
        let n = self.tour.len_mm();
        let round_s = |uav: usize| match patrol.pattern {
            Pattern::Round { speed, .. } if self.speeds[uav] < speed => None,
            Pattern::Round { speed, .. } => Some(f64::from(n) / f64::from(speed)),
            Pattern::Arcs { .. } => Some(2.0 * revisit_bound(n, &self.speeds)),
        };
        let short = (0..self.uavs.len()).filter_map(|uav| {
            let (needs_s, has_s) = (round_s(uav)?, self.uavs[uav].longest_s);
            (!patrol.pattern.flies(uav) && needs_s > has_s).then(|| {
                format!(
                    "{} rests: one period takes {needs_s:.0} s, its endurance leaves {:.0} s besides the ways there and back",
                    self.name(uav),
                    has_s.max(0.0)
                )
            })
        });
        short.collect()
    }

    /// One UAV: its station, and the first period.
    fn flight(&self, flown: &Flown, uav: usize) -> PatrolFlight {
        let n = self.tour.len_mm();
        let own = &self.request.team[uav];
        let at = flown.stations.iter().find(|s| s.uav == uav);
        let mut station = None;
        let mut path = vec![own.start];
        if let (Some(at), Some((way, way_s))) = (at, &flown.ways[uav]) {
            let period_s = flown.patrol.period_s(n, uav, &self.speeds);
            let mut arc_m = None;
            path.clone_from(way);
            match &flown.patrol.pattern {
                Pattern::Round { .. } => path.extend(self.tour.stretch(at.place, n)),
                Pattern::Arcs { arcs } => {
                    let (from, len) = arcs[uav];
                    arc_m = Some(f64::from(len) / 1000.0);
                    let forth = self.tour.stretch(from, len);
                    path.extend(forth.iter().chain(forth.iter().rev()));
                }
            }
            path.extend(way.iter().rev());
            station = Some(PatrolStation {
                place_m: f64::from(at.place) / 1000.0,
                phase: f64::from(at.place) / f64::from(n),
                way_s: *way_s,
                wait_s: flown.steady_s - way_s,
                period_s,
                time_s: period_s + 2.0 * way_s,
                arc_m,
            });
        }
        PatrolFlight {
            name: own.name.clone(),
            path,
            altitude_m: self.request.altitude_m,
            speed_mps: own.speed_mps,
            station,
        }
    }

    /// How the others go on.
    fn after(&self, losses: &Losses, flown: &Flown) -> Result<AfterLosses, PatrolError> {
        let named = |name: &String| {
            let known = self.request.team.iter().position(|u| u.name == *name);
            known.ok_or_else(|| PatrolError::Unknown(name.clone()))
        };
        let lost: Vec<usize> = losses.names.iter().map(named).collect::<Result<_, _>>()?;
        let n = self.tour.len_mm();
        let before = flown.patrol.courses(&self.speeds, &flown.stations);
        let joins = |uav: usize| self.nearest[uav];
        let change = after_losses(n, &self.uavs, &before, losses.after_s, &lost, joins)
            .ok_or(PatrolError::NobodyLeft)?;
        let left: Vec<u32> = (0..self.speeds.len())
            .map(|i| if lost.contains(&i) { 0 } else { self.speeds[i] })
            .collect();
        let flies = |uav: &usize| change.stands[*uav].is_some();
        let uavs = (0..self.uavs.len()).filter(flies);
        Ok(AfterLosses {
            lost: lost.iter().map(|i| self.name(*i).to_owned()).collect(),
            pattern: change.patrol.pattern.clone(),
            revisit_s: change.patrol.revisit_s,
            revisit_bound_s: revisit_bound(n, &left),
            steady_s: change.steady_s,
            gap_s: change.gap_s,
            uavs: uavs.map(|uav| self.goes_on(flown, &change, uav)).collect(),
        })
    }

    /// What one of those who are left does.
    fn goes_on(&self, flown: &Flown, change: &Change, uav: usize) -> GoesOn {
        let n = self.tour.len_mm();
        let place = change.stands[uav].map_or(0.0, |s| s.place);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a place on the tour"
        )]
        let at = self.tour.point(place as u32);
        let since_s = change.courses[uav].since_s().unwrap_or(0.0);
        let arc = |arcs: &[(u32, u32)]| {
            let (from, len) = arcs[uav];
            (f64::from(from) / 1000.0, f64::from(len) / 1000.0)
        };
        GoesOn {
            name: self.name(uav).to_owned(),
            place_m: place / 1000.0,
            at,
            joins: flown.ways[uav].is_none(),
            way_s: since_s - change.loiter_s[uav],
            loiter_s: change.loiter_s[uav],
            period_s: change.patrol.period_s(n, uav, &self.speeds),
            arc_m: match &change.patrol.pattern {
                Pattern::Arcs { arcs } => Some(arc(arcs)),
                Pattern::Round { .. } => None,
            },
        }
    }
}

/// The length of a way through the air, metres: in a wind, up to what vanishes on a closed
/// flight.
fn air_m(way: &[Point], airspeed_mps: f64, wind: Vector) -> f64 {
    let legs = way.windows(2).map(|leg| {
        let leg = InWind::new(leg, airspeed_mps, wind);
        leg.map_or(f64::MAX, |l| l.cost(0, 1) * airspeed_mps)
    });
    legs.sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tours::{LineTarget, PointTarget};

    const SQUARE: [(f64, f64); 4] = [(0.0, 0.0), (1500.0, 0.0), (1500.0, 1100.0), (0.0, 1100.0)];

    fn points() -> Over {
        let point = |(i, (x, y)): (usize, (f64, f64))| PointTarget {
            name: i.to_string(),
            at: Point::new(x, y),
            radius_m: 0.0,
            sensor: None,
        };
        Over::Targets {
            targets: Targets::Points(SQUARE.into_iter().enumerate().map(point).collect()),
            zones: Vec::new(),
        }
    }

    fn lines() -> Over {
        let way = SQUARE[..3].iter().map(|&(x, y)| Point::new(x, y));
        let line = LineTarget {
            name: "road".to_owned(),
            way: way.collect(),
            width_m: 0.0,
            sensor: Some("rgb".to_owned()),
        };
        Over::Targets {
            targets: Targets::Lines(vec![line]),
            zones: Vec::new(),
        }
    }

    fn area(planner: Planner) -> Over {
        let polygon = |corners: &[(f64, f64)]| {
            let points = corners.iter().map(|&(x, y)| Point::new(x / 2.0, y / 2.0));
            Polygon::new(points.collect()).unwrap()
        };
        let zone = polygon(&[(700.0, 500.0), (900.0, 500.0), (800.0, 700.0)]);
        Over::Area {
            area: polygon(&SQUARE),
            holes: Vec::new(),
            zones: Arc::new(NoFlyZones::new(vec![zone])),
            planners: Planners::Only(planner),
        }
    }

    fn team(speeds_mps: &[f64]) -> Vec<Uav> {
        let camera = Sensor::Swath { width_m: 60.0 };
        let uav = |(i, v): (usize, &f64)| {
            let mut uav = Uav::new(format!("uav-{}", i + 1), Point::origin(), *v, 20.0, camera);
            uav.sensors.insert("rgb".to_owned(), camera);
            uav
        };
        speeds_mps.iter().enumerate().map(uav).collect()
    }

    fn request(over: Over, speeds_mps: &[f64]) -> PatrolRequest {
        PatrolRequest {
            over,
            team: team(speeds_mps),
            clearance_m: 10.0,
            wind_mps: Vector::zeros(),
            altitude_m: 60.0,
            steps: 2_000,
            losses: None,
        }
    }

    fn losses(names: &[&str], after_s: f64) -> Option<Losses> {
        Some(Losses {
            names: names.iter().map(|n| (*n).to_owned()).collect(),
            after_s,
        })
    }

    #[test]
    fn equal_uavs_are_spaced_evenly_over_any_tour() {
        let windy = PatrolRequest {
            wind_mps: Vector::new(-3.0, -5.0),
            ..request(points(), &[15.0; 3])
        };
        let calm = [
            points(),
            lines(),
            area(Planner::Exact),
            area(Planner::Approximate),
        ];
        let calm = calm.map(|over| request(over, &[15.0; 3]));
        for asked in calm.into_iter().chain([windy]) {
            let found = plan(&asked).unwrap();
            assert!(matches!(found.pattern, Pattern::Round { .. }));
            let ratio = found.revisit_s / found.revisit_bound_s;
            assert!((ratio - 1.0).abs() < 1e-4, "{:?}: {ratio}", found.over);
            let stations: Vec<PatrolStation> =
                found.uavs.iter().map(|u| u.station.unwrap()).collect();
            let third_m = found.tour_m / 3.0;
            let apart_m = (stations[1].place_m - stations[0].place_m).rem_euclid(third_m);
            assert!(apart_m.min(third_m - apart_m) < 0.01, "{:?}", found.over);
            let waits = stations.iter().map(|s| s.wait_s);
            assert!(waits.fold(f64::INFINITY, f64::min).abs() < 1e-9);
            // A station is a place to be: the flight ends where it began.
            assert_eq!(found.uavs[0].path.first(), found.uavs[0].path.last());
        }
        let road = plan(&request(lines(), &[15.0])).unwrap();
        assert!(road.notices[0].contains("sensors of the targets ignored"));
    }

    #[test]
    fn a_failure_is_told_with_who_waits_how_long() {
        let mut asked = request(points(), &[15.0; 4]);
        asked.losses = losses(&["uav-2"], 0.0);
        let found = plan(&asked).unwrap();
        let after = found.after_losses.unwrap();
        assert!((after.revisit_s / found.revisit_s - 4.0 / 3.0).abs() < 1e-4);
        assert!(after.steady_s <= found.revisit_s + 1e-3);
        assert!((after.gap_s / found.revisit_s - 2.0).abs() < 1e-3);
        assert_eq!(after.uavs.len(), 3);
        assert!(after.uavs.iter().any(|u| u.loiter_s < 1e-3));
        asked.losses = losses(&["uav-2", "uav-1"], 33.0);
        let two = plan(&asked).unwrap().after_losses.unwrap();
        assert_eq!((two.uavs.len(), two.lost.len()), (2, 2));
    }

    #[test]
    fn mixed_fleets_and_short_endurance_are_told() {
        let mut asked = request(points(), &[28.0, 10.0, 9.0]);
        asked.losses = losses(&["uav-1"], 0.0);
        // 28 alone is 28; two at 10 and 9 are less; to and fro is 23.5.
        let found = plan(&asked).unwrap();
        assert_eq!(found.uavs_flying(), 1);
        assert!(found.uavs[1].station.is_none() && found.uavs[1].path.len() == 1);
        let after = found.after_losses.unwrap();
        assert!(after.uavs.len() == 2 && after.uavs[0].joins);
        let mut tired = request(points(), &[15.0; 3]);
        for uav in &mut tired.team {
            uav.endurance_s = Some(250.0);
        }
        let arcs = plan(&tired).unwrap();
        assert!(matches!(arcs.pattern, Pattern::Arcs { .. }));
        assert!(arcs.uavs.iter().all(|u| u.station.unwrap().arc_m.is_some()));
        let refused = |change: fn(&mut PatrolRequest)| {
            let mut asked = request(points(), &[15.0, 12.0]);
            change(&mut asked);
            plan(&asked).unwrap_err()
        };
        let short = refused(|r| r.team.iter_mut().for_each(|u| u.endurance_s = Some(60.0)));
        assert!(matches!(short, PatrolError::Nobody { .. }), "{short}");
        let unknown = refused(|r| r.losses = losses(&["x"], 0.0));
        assert_eq!(unknown, PatrolError::Unknown("x".to_owned()));
        let all = refused(|r| r.losses = losses(&["uav-1", "uav-2"], 0.0));
        assert_eq!(all, PatrolError::NobodyLeft);
        let never = refused(|r| r.losses = losses(&["uav-1"], f64::NAN));
        assert!(matches!(never, PatrolError::LossTime(_)));
        let windy = refused(|r| r.wind_mps.x = 3.0);
        assert_eq!(windy, PatrolError::Targets(ToursError::UnlikeInWind));
        let empty = refused(|r| {
            r.over = Over::Targets {
                targets: Targets::Points(Vec::new()),
                zones: Vec::new(),
            };
        });
        assert_eq!(empty, PatrolError::Nothing);
        let inside = plan(&PatrolRequest {
            team: vec![Uav {
                start: Point::new(400.0, 290.0),
                ..team(&[15.0]).remove(0)
            }],
            ..request(area(Planner::Exact), &[])
        });
        let name = "uav-1".to_owned();
        assert_eq!(inside.unwrap_err(), PatrolError::LaunchInZone(name));
    }
}
