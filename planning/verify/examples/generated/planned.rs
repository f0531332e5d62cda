//! Generated sites planned by the planners of areas, and their plans recounted.

use skein_geometry::frame::Point as Theirs;
use skein_geometry::{NoFlyZones, Polygon};
use skein_survey::area::{self, AreaPlan, AreaRequest, Planners};
use skein_survey::flight::UavFlight;
use skein_survey::team::{Sensor, Uav};
use skein_verify::generate::{PLANE, Site};
use skein_verify::path::Piece;
use skein_verify::plan::{Flight, FlightClaims, Plan, PlanClaims};
use skein_verify::plane::Point;
use skein_verify::recount::{Report, Settings, recount};
use std::sync::Arc;

/// Steps of improvement: plans are to be right, not good.
const STEPS: usize = 200;

fn polygon(ring: &[Point]) -> Result<Polygon, String> {
    let points = ring.iter().map(|p| Theirs::new(p.x, p.y)).collect();
    Polygon::new(points).map_err(|error| format!("Polygon {error:?}"))
}

/// What is asked of a site.
///
/// # Errors
/// Which of its rings is no polygon.
pub fn request(site: &Site, planners: Planners, quick: bool) -> Result<AreaRequest, String> {
    let manner = &site.manner;
    let camera = Sensor::Swath {
        width_m: manner.swath_m,
    };
    let start = Theirs::new(site.launch.x, site.launch.y);
    let uav = |i| {
        let name = format!("uav-{}", i + 1);
        Uav::new(name, start, manner.speed_mps, manner.turn_radius_m, camera)
    };
    let team = (0..manner.n_uavs).map(uav).collect();
    let rings = |rings: &[Vec<Point>]| {
        rings
            .iter()
            .map(|r| polygon(r))
            .collect::<Result<Vec<_>, _>>()
    };
    // Holes are kept out of, as the command asks for them.
    let mut zones = rings(&site.zones)?;
    zones.extend(rings(&site.holes)?);
    Ok(AreaRequest {
        zones: Arc::new(NoFlyZones::new(zones)),
        fences: rings(&site.fences)?,
        look_ahead_m: manner.look_ahead_m,
        planners,
        steps: STEPS,
        quick,
        ..AreaRequest::new(polygon(&site.area)?, team, manner.clearance_m, 60.0)
    })
}

fn flight(site: &Site, own: &UavFlight) -> Flight {
    let point = |p: &Theirs| Point::new(p.x, p.y);
    let mut pieces = Vec::new();
    for leg in &own.legs {
        pieces.extend(leg.curve.segments().iter().map(|s| Piece {
            start: Point::new(s.start.east_m, s.start.north_m),
            heading_rad: s.start.heading_rad,
            length_m: s.length_m,
            radius_m: (s.curvature_per_m.abs() > 0.0).then(|| -1.0 / s.curvature_per_m),
            sees: leg.sees,
        }));
    }
    Flight {
        speed_mps: Some(own.speed_mps),
        turn_radius_m: Some(site.manner.turn_radius_m),
        swath_m: Some(site.manner.swath_m),
        look_ahead_m: site.manner.look_ahead_m,
        claims: FlightClaims {
            length_m: Some(own.length_m),
            time_s: Some(own.time_s),
            from: own.path.first().map(point),
            to: own.path.last().map(point),
        },
        ..Flight::new(own.name.clone(), pieces)
    }
}

fn report(site: &Site, own: &AreaPlan) -> Result<Report, String> {
    let plan = Plan {
        flights: own.uavs.iter().map(|f| flight(site, f)).collect(),
        clearance_m: Some(site.manner.clearance_m),
        claims: PlanClaims {
            makespan_s: Some(own.figures.makespan_s),
            total_m: Some(own.figures.total_m),
            covered_share: Some(own.figures.covered_share),
        },
        ..Plan::new(PLANE)
    };
    let ground = site.ground().map_err(|e| e.to_string())?;
    recount(&plan, &ground, &Settings::default()).map_err(|e| e.to_string())
}

/// What came of a site.
pub enum Outcome {
    /// Why there is no plan.
    Refused(String),
    /// Somebody flies and nobody says what.
    NoTrajectory,
    /// What the recount says.
    Recounted(Report),
}

/// Plans a site and recounts the plan.
pub fn outcome(site: &Site, planners: Planners, quick: bool) -> Outcome {
    let planned = request(site, planners, quick)
        .and_then(|r| area::plan(&r).map_err(|error| format!("{error:?}")));
    let plan = match planned {
        Ok(plan) => plan,
        Err(why) => return Outcome::Refused(kind(&why)),
    };
    if plan.uavs.iter().any(|f| f.flies() && f.legs.is_empty()) {
        return Outcome::NoTrajectory;
    }
    match report(site, &plan) {
        Ok(report) => Outcome::Recounted(report),
        Err(why) => Outcome::Refused(why),
    }
}

/// An error without its numbers and names.
fn kind(why: &str) -> String {
    let end = why.find(|c: char| c == '{' || c == '"' || c.is_ascii_digit());
    why[..end.unwrap_or(why.len())]
        .trim_end_matches([' ', '(', '-'])
        .to_owned()
}
