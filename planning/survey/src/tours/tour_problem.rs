//! What tours are planned from: ways over numbered places, what flights cost in the wind
//! and round zones, and who flies. Leaves to [`super::targets`] which ways there are.

use super::targets;
use super::{Targets, TourRequest, ToursError};
use crate::detours::{DetourSearch, Detours};
use crate::team::{self, Uav, carried};
use skein_flight::coverage::lines::{self, Line, Traversal};
use skein_flight::coverage::metric::{InWind, Matrix, Metric};
use skein_geometry::frame::{Point, Vector};
use skein_geometry::offset::Zone;
use std::cell::RefCell;

/// Round zones the ways between all places are written down: more places than this take
/// too long.
pub(super) const MOST_PLACES: usize = 3_000;

/// Speeds that differ by less than this are the same, m/s.
const SAME_SPEED_MPS: f64 = 1e-9;

/// A way that is flown along in one piece.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Way {
    /// Its places in order.
    pub places: Vec<usize>,
    /// The name of the item that it serves.
    pub name: String,
    /// The sensor that is asked for.
    pub sensor: Option<String>,
}

/// What is to be planned: lines between places, and who flies.
pub(crate) struct Question<'a> {
    /// The ways that the lines stand for, one each.
    pub problem: &'a TourProblem,
    /// The lines.
    pub lines: &'a [Line],
    /// The team.
    pub team: &'a [lines::Uav],
    /// What flights cost.
    pub metric: &'a Cost<'a>,
    /// The zones that ways lead round.
    pub detours: &'a Detours,
}

/// The ways to fly, over numbered places.
pub(crate) struct TourProblem {
    /// All places: those where UAVs start first.
    pub at: Vec<Point>,
    /// The ways.
    pub ways: Vec<Way>,
    /// What was left out.
    pub notices: Vec<String>,
    /// The UAVs.
    pub team: Vec<Uav>,
    /// By UAV: the place where it starts and ends.
    pub depots: Vec<usize>,
    zones: Vec<Zone>,
    clearance_m: f64,
    wind_mps: Vector,
}

/// What flights cost: straight, or round zones.
pub(crate) enum Cost<'a> {
    /// Straight.
    Straight(InWind<'a>),
    /// Written down.
    Round(Matrix),
}

impl Metric for Cost<'_> {
    fn cost(&self, a: usize, b: usize) -> f64 {
        match self {
            Self::Straight(wind) => wind.cost(a, b),
            Self::Round(matrix) => matrix.cost(a, b),
        }
    }
}

impl TourProblem {
    /// The ways of a request.
    ///
    /// # Errors
    /// When there is nobody, or a target cannot be seen; the error names it.
    pub(crate) fn new(request: &TourRequest) -> Result<Self, ToursError> {
        team::check_places(&request.team)?;
        let mut problem = Self {
            at: Vec::new(),
            ways: Vec::new(),
            notices: Vec::new(),
            team: request.team.clone(),
            depots: Vec::new(),
            zones: request.zones.clone(),
            clearance_m: request.clearance_m,
            wind_mps: request.wind_mps,
        };
        for uav in &request.team {
            let known = problem.at.iter().position(|p| *p == uav.start);
            let depot = known.unwrap_or_else(|| problem.place(uav.start));
            problem.depots.push(depot);
        }
        match &request.targets {
            Targets::Points(points) => targets::points(&mut problem, request, points)?,
            Targets::Lines(lines) => targets::lines(&mut problem, request, lines)?,
        }
        Ok(problem)
    }

    /// The narrowest swath of those who can see a target, metres: lanes are laid for it.
    ///
    /// # Errors
    /// When nobody can; the error names the target.
    pub(crate) fn swath_m(
        &self,
        altitude_m: f64,
        sensor: Option<&str>,
        target: &str,
    ) -> Result<f64, ToursError> {
        let each = self.team.iter();
        let each = each.filter_map(|u| u.swath_m(sensor, altitude_m));
        each.min_by(f64::total_cmp)
            .ok_or_else(|| ToursError::NoCarrier {
                target: target.to_owned(),
                sensor: sensor.unwrap_or_default().to_owned(),
                carried: carried(&self.team),
            })
    }

    /// Says so where targets ask for sensors and all fly the same tour.
    pub(crate) fn ignore_sensors(&mut self) {
        if self.ways.iter().any(|w| w.sensor.is_some()) {
            let text = "sensors of the targets ignored: all fly the same tour";
            self.notices.push(text.to_owned());
        }
    }

    /// A new place.
    pub(super) fn place(&mut self, p: Point) -> usize {
        self.at.push(p);
        self.at.len() - 1
    }

    /// Adds a way over new places.
    pub(super) fn push(&mut self, way: &[Point], name: &str, sensor: Option<&str>) {
        let places = way.iter().map(|&p| self.place(p)).collect();
        self.ways.push(Way {
            places,
            name: name.to_owned(),
            sensor: sensor.map(str::to_owned),
        });
    }

    /// Plans with `planner`; gives the zones that the ways lead round as well.
    ///
    /// # Errors
    /// When a figure has no meaning; the error names it.
    pub(crate) fn solve<T>(
        &mut self,
        planner: impl FnOnce(&Question<'_>) -> Result<T, ToursError>,
    ) -> Result<(T, Detours), ToursError> {
        let detours = Detours::new(&self.zones, self.clearance_m, &self.at)?;
        self.leave_out_forbidden(&detours)?;
        let wind = self.wind_mps;
        let base_mps = self.team[0].speed_mps;
        let alike = |u: &Uav| (u.speed_mps - base_mps).abs() < SAME_SPEED_MPS;
        if wind.norm() >= SAME_SPEED_MPS && !self.team.iter().all(alike) {
            return Err(ToursError::UnlikeInWind);
        }
        let straight = InWind::new(&self.at, base_mps, wind)?;
        let lines: Vec<Line> = self
            .ways
            .iter()
            .map(|way| {
                let way = &way.places;
                let cost = way.windows(2).map(|w| straight.cost(w[0], w[1])).sum();
                let ends = way.first().zip(way.last());
                let (a, b) = ends.map_or((0, 0), |(a, b)| (*a, *b));
                Line::new(a, b, cost)
            })
            .collect();
        let metric = if detours.is_needed() {
            Cost::Round(self.round(&detours, base_mps, wind)?)
        } else {
            Cost::Straight(straight)
        };
        let uav = |(u, depot): (&Uav, &usize)| lines::Uav {
            depot: *depot,
            speed: u.speed_mps / base_mps,
            endurance: u.endurance_s.unwrap_or(f64::INFINITY),
        };
        let team: Vec<lines::Uav> = self.team.iter().zip(&self.depots).map(uav).collect();
        let found = planner(&Question {
            problem: self,
            lines: &lines,
            team: &team,
            metric: &metric,
            detours: &detours,
        })?;
        Ok((found, detours))
    }

    /// The points flown along some ways in order, from a place and back to it.
    pub(crate) fn track(
        &self,
        detours: &Detours,
        passes: &[Traversal],
        depot: Point,
    ) -> Vec<Point> {
        let mut search = detours.search();
        let mut track = vec![depot];
        let go = |track: &mut Vec<Point>, search: &mut DetourSearch<'_>, to: Point| {
            let from = track.last().copied().unwrap_or(depot);
            let way = search.way(from, to);
            track.extend(way.iter().flatten().skip(1));
        };
        for pass in passes {
            let way = &self.ways[pass.line].places;
            let mut way: Vec<Point> = way.iter().map(|p| self.at[*p]).collect();
            if pass.backward {
                way.reverse();
            }
            if let Some(first) = way.first() {
                go(&mut track, &mut search, *first);
            }
            track.extend(way.iter().skip(1));
        }
        go(&mut track, &mut search, depot);
        track
    }

    /// Costs of the shortest ways round the zones between all places.
    fn round(&self, detours: &Detours, speed_mps: f64, wind: Vector) -> Result<Matrix, ToursError> {
        if self.at.len() > MOST_PLACES {
            return Err(ToursError::TooManyPlaces(self.at.len()));
        }
        let search = RefCell::new(detours.search());
        let cost = |a: usize, b: usize| -> f64 {
            let way = search.borrow_mut().way(self.at[a], self.at[b]);
            // Places without a way have been left out before.
            let way = way.unwrap_or_else(|| vec![self.at[a], self.at[b]]);
            let legs = way.windows(2).map(|leg| {
                let wind = InWind::new(leg, speed_mps, wind);
                wind.map_or(f64::MAX, |w| w.cost(0, 1))
            });
            legs.sum()
        };
        Ok(Matrix::of(self.at.len(), &cost))
    }

    /// Leaves out, with a notice, what cannot be flown without entering a zone.
    fn leave_out_forbidden(&mut self, detours: &Detours) -> Result<(), ToursError> {
        if !detours.is_needed() {
            return Ok(());
        }
        let mut search = detours.search();
        for (uav, depot) in self.team.iter().zip(&self.depots) {
            if detours.forbids(self.at[*depot]) {
                return Err(ToursError::StartInZone(uav.name.clone()));
            }
        }
        let home = self.at[self.depots[0]];
        let (at, notices) = (&self.at, &mut self.notices);
        self.ways.retain(
            |Way {
                 places: way, name, ..
             }| {
                let mut legs = way.windows(2);
                let clear = way.iter().all(|p| !detours.forbids(at[*p]))
                    && legs.all(|w| search.is_straight(at[w[0]], at[w[1]]))
                    && way
                        .first()
                        .is_none_or(|p| search.way(home, at[*p]).is_some());
                if !clear {
                    notices.push(format!("{name}: left out, a zone is in the way"));
                }
                clear
            },
        );
        Ok(())
    }
}
