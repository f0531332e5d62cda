//! Tours as they are flown: the targets of each UAV in order, with turns that keep clear
//! and times in the wind (D2.7 §3.4, §3.5).
//!
//! Leaves to [`super::sensor_groups`] who flies which targets, in which order.

use super::tour_problem::TourProblem;
use super::{Targets, TourRequest, ToursError};
use crate::flight::Flight;
use crate::flown::{Air, Airspace, Flown, Stop, fly, straight, stretches};
use crate::team::Uav;
use skein_flight::coverage::lines::Traversal;
use skein_flight::route::Router;
use skein_geometry::frame::Point;

/// A line is seen where a corner is cut by no more than this share of the swath.
const STRAY_SHARE: f64 = 0.25;

/// Who flies tours, and where one may fly.
pub(super) struct Pilot<'a> {
    problem: &'a TourProblem,
    request: &'a TourRequest,
    airspace: Airspace,
}

/// One UAV's tour as it is flown.
pub(super) struct FlownTour {
    /// With its trajectory and its length through the air.
    pub flight: Flight,
    /// What it sees, in order.
    pub passes: Vec<Traversal>,
    /// What no curve leads to.
    pub left: Vec<Traversal>,
}

impl<'a> Pilot<'a> {
    /// Zones and fences of a request.
    ///
    /// # Errors
    /// When one of them is no polygon.
    pub(super) fn new(
        problem: &'a TourProblem,
        request: &'a TourRequest,
    ) -> Result<Self, ToursError> {
        let places = problem.at.iter().copied();
        let airspace = Airspace::of_zones(&request.zones, places, request.clearance_m)?;
        Ok(Self {
            problem,
            request,
            airspace,
        })
    }

    /// Flies targets in this order, from the UAV's start and back.
    pub(super) fn flown(&self, flight: &Flight, passes: &[Traversal]) -> FlownTour {
        let uav = &self.problem.team[flight.uav];
        let router = self.router(uav);
        let (mut stops, mut of) = (Vec::new(), Vec::new());
        for (i, pass) in passes.iter().enumerate() {
            for stop in self.stops(uav, pass) {
                stops.push(stop);
                of.push(i);
            }
        }
        let flown = fly(&router, uav.start, &stops);
        let left = |i: &usize| flown.left.iter().any(|stop| of[*stop] == *i);
        let mut order: Vec<usize> = Vec::new();
        for (stop, _) in &flown.order {
            if !order.contains(&of[*stop]) && !left(&of[*stop]) {
                order.push(of[*stop]);
            }
        }
        FlownTour {
            passes: order.iter().map(|i| passes[*i]).collect(),
            left: (0..passes.len()).filter(left).map(|i| passes[i]).collect(),
            flight: self.with(flight, &flown, uav),
        }
    }

    /// As [`Pilot::flown`], of as many targets from the first on as it has the endurance
    /// for; the others are returned beside it.
    pub(super) fn flown_within(
        &self,
        flight: &Flight,
        passes: &[Traversal],
    ) -> (FlownTour, Vec<Traversal>) {
        let uav = &self.problem.team[flight.uav];
        let longest_s = uav.endurance_s.unwrap_or(f64::INFINITY);
        let all = self.flown(flight, passes);
        if all.flight.time_s() <= longest_s {
            return (all, Vec::new());
        }
        let (mut low, mut high) = (0, passes.len());
        let mut best = self.flown(flight, &[]);
        while high - low > 1 {
            let n = usize::midpoint(low, high);
            let some = self.flown(flight, &passes[..n]);
            if some.flight.time_s() <= longest_s {
                (best, low) = (some, n);
            } else {
                high = n;
            }
        }
        (best, passes[low..].to_vec())
    }

    /// Ways for a UAV. In a wind its turns over the ground are as wide as the wind from
    /// behind makes them.
    fn router(&self, uav: &Uav) -> Router {
        let air = Air {
            airspeed_mps: uav.speed_mps,
            wind_mps: self.request.wind_mps,
        };
        self.airspace.router(air.ground_radius_m(uav.turn_radius_m))
    }

    fn air(&self, uav: &Uav) -> Air {
        Air {
            airspeed_mps: uav.speed_mps,
            wind_mps: self.request.wind_mps,
        }
    }

    fn with(&self, flight: &Flight, flown: &Flown, uav: &Uav) -> Flight {
        Flight {
            track: flown.track(uav.start),
            legs: flown.legs.clone(),
            length_m: flown.air_m(&self.air(uav)),
            ..flight.clone()
        }
    }

    /// What is flown over to see one target.
    fn stops(&self, uav: &Uav, pass: &Traversal) -> Vec<Stop> {
        let sensor = self.problem.ways[pass.line].sensor.as_deref();
        let swath_m = uav.swath_m(sensor, self.request.altitude_m);
        let radius_m = self.router(uav).limits().turn_radius_m;
        let points = matches!(self.request.targets, Targets::Points(_));
        stops(self.problem, pass, points, swath_m, radius_m)
    }
}

/// What is flown over to see one target: a point, or a piece of a line with a swath, by a
/// UAV that turns no tighter.
pub(crate) fn stops(
    problem: &TourProblem,
    pass: &Traversal,
    points: bool,
    swath_m: Option<f64>,
    radius_m: f64,
) -> Vec<Stop> {
    let way = &problem.ways[pass.line];
    let mut places: Vec<Point> = way.places.iter().map(|p| problem.at[*p]).collect();
    if pass.backward {
        places.reverse();
    }
    if let [point] = places.as_slice() {
        return vec![Stop::over(*point)];
    }
    let curves = if points {
        // Lanes over a disc: what joins them need not be flown.
        let lanes = places.chunks(2);
        lanes.map(|l| straight(l[0], l[l.len() - 1])).collect()
    } else {
        stretches(&places, radius_m, STRAY_SHARE * swath_m.unwrap_or(0.0))
    };
    curves.into_iter().filter_map(Stop::along).collect()
}
