//! The closed tour of a patrol as it is flown: over points, lines or an area, for the
//! narrowest swath and the widest turn of a team.

use super::team_patrol::{Over, PatrolError, PatrolRequest, TourKind};
use crate::area::{self, AreaRequest, Lanes};
use crate::flight::Leg;
use crate::flown::{Airspace, Stop, fly_round};
use crate::heights::Separation;
use crate::objective::Objective;
use crate::team::{Sensor, Uav};
use crate::tours::{self, Targets, TourProblem, TourRequest};
use crate::visits;
use skein_flight::coverage::lines;
use skein_flight::route::Router;
use skein_geometry::frame::Point;
use skein_geometry::offset::Zone;
use std::sync::Arc;

/// What is flown again and again.
pub(super) struct Course {
    pub kind: TourKind,
    /// What leads back to its beginning.
    pub legs: Vec<Leg>,
    /// Ways for all of the team.
    pub router: Router,
    pub notices: Vec<String>,
}

/// Ways for all of the team: turns as wide as any needs, in a wind as wide over the ground
/// as the wind from behind makes them.
fn router(request: &PatrolRequest, airspace: &Airspace) -> Result<Router, PatrolError> {
    let over_ground = |u: &Uav| request.air(u.speed_mps).ground_radius_m(u.turn_radius_m);
    let turns = request.team.iter().map(over_ground);
    for uav in &request.team {
        // What is no clearance is refused by the planners.
        if airspace.zones().distance_m(uav.start) < airspace.clearance_m() {
            return Err(PatrolError::LaunchInZone(uav.name.clone()));
        }
    }
    Ok(airspace.router(turns.fold(0.0, f64::max)))
}

/// One tour over points or lines, without a depot on it.
pub(super) fn over_targets(
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
    let (plan, _) = problem.solve(|q| {
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
    let Some(plan) = plan else {
        return Err(PatrolError::Nothing);
    };
    let airspace = Airspace::of_zones(zones, problem.at.iter().copied(), request.clearance_m)?;
    let router = router(request, &airspace)?;
    let radius_m = router.limits().turn_radius_m;
    let (mut stops, mut of) = (Vec::new(), Vec::new());
    for pass in &plan.tours[0].passes {
        let sensor = problem.ways[pass.line].sensor.as_deref();
        let swath_m = problem.swath_m(request.altitude_m, sensor, "").ok();
        for stop in tours::stops(&problem, pass, points, swath_m, radius_m) {
            stops.push(stop);
            of.push(pass.line);
        }
    }
    let Some(cycle) = fly_round(&router, &stops) else {
        return Err(PatrolError::NoRound { radius_m });
    };
    let mut left: Vec<usize> = cycle.left.iter().map(|stop| of[*stop]).collect();
    left.dedup();
    for line in left {
        let name = &problem.ways[line].name;
        let text = format!("{name}: left out, no curve leads there and on");
        problem.notices.push(text);
    }
    Ok(Course {
        kind: if points {
            TourKind::Points
        } else {
            TourKind::Lines
        },
        legs: cycle.legs,
        router,
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
    let (name, start, speed_mps) = team.first().map_or(("", Point::origin(), 0.0), |u| {
        (&u.name, u.start, u.speed_mps)
    });
    Uav::new(
        name,
        start,
        speed_mps,
        turns.fold(0.0, f64::max),
        Sensor::Swath { width_m },
    )
}

/// One tour over an area: of the planner that is asked for, or the better one.
pub(super) fn over_area(request: &PatrolRequest) -> Result<Course, PatrolError> {
    let Over::Area {
        area,
        holes,
        zones,
        fences,
        planners,
    } = &request.over
    else {
        return Err(PatrolError::Nothing);
    };
    let alone = AreaRequest {
        holes: holes.clone(),
        zones: Arc::clone(zones),
        fences: fences.clone(),
        wind_mps: request.wind_mps,
        planners: *planners,
        lanes: Lanes::Common,
        separation: Separation::FLAT,
        steps: request.steps,
        ..AreaRequest::new(
            area.clone(),
            vec![alone(request)],
            request.clearance_m,
            request.altitude_m,
        )
    };
    let starts = request.team.iter().map(|u| u.start);
    let places = starts.chain(alone.area.vertices().iter().copied());
    let airspace = Airspace::new(&alone.zones, &alone.fences, places, request.clearance_m)?;
    let router = router(request, &airspace)?;
    let plan = area::plan(&alone)?;
    let flight = plan.uavs.first().ok_or(PatrolError::Nothing)?;
    let seen = flight.legs.iter().filter(|leg| leg.sees);
    let stops: Vec<Stop> = seen
        .filter_map(|leg| Stop::along(leg.curve.clone()))
        .collect();
    let mut notices = plan.notices;
    let radius_m = router.limits().turn_radius_m;
    let Some(cycle) = fly_round(&router, &stops) else {
        return Err(PatrolError::NoRound { radius_m });
    };
    if !cycle.left.is_empty() {
        let left = cycle.left.len();
        notices.push(format!(
            "{left} pass(es) left out of the tour: no curve leads there and on"
        ));
    }
    Ok(Course {
        kind: TourKind::Area(plan.figures.planner),
        legs: cycle.legs,
        router,
        notices,
    })
}
