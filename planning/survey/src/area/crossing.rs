//! An area seen twice: on one course, and a second time across it, in one flight a UAV.
//!
//! Both crossings are plans of their own; what a UAV flies of the first goes on with what it
//! flies of the second without a way home in between.

use super::{AreaError, AreaPlan, AreaRequest, Facts, Figures, Planner, Planners, plan};
use crate::flight::{Flight, Leg, Stays, UavFlight};
use crate::flown::{Airspace, length_m, time_s, track};
use crate::heights::Separation;
use crate::team::Uav;
use skein_flight::route::Router;
use skein_geometry::math::{FRAC_PI_2, wrap_pi};

/// Twice the difference of headings of one course, radians: rounding.
const SAME_RAD: f64 = 1e-3;

/// Plans both crossings, by straight passes.
///
/// # Guarantees
/// As [`plan`], of each crossing; each gets half of the endurance, so that both together do
/// not take more than all of it. The share that is told is that of the crossing that sees
/// less.
///
/// # Errors
/// As [`plan`]. Where only the second crossing has no plan, the first is told with a notice.
pub fn plan_crossed(request: &AreaRequest) -> Result<AreaPlan, AreaError> {
    let mut first = plan(&half(request, request.heading_rad))?;
    let Some(heading_rad) = request.heading_rad.or_else(|| heading_rad(&first)) else {
        return Ok(first);
    };
    let across = half(request, Some(wrap_pi(heading_rad + FRAC_PI_2)));
    match plan(&across) {
        Ok(second) => joined(request, first, second),
        Err(error) => {
            let text = format!("the second crossing is left out: {error}");
            first.notices.push(text);
            Ok(first)
        }
    }
}

/// One crossing: on a course, with half of the endurance.
fn half(request: &AreaRequest, heading_rad: Option<f64>) -> AreaRequest {
    let tired = |uav: &Uav| Uav {
        endurance_s: uav.endurance_s.map(|s| s / 2.0),
        ..uav.clone()
    };
    AreaRequest {
        team: request.team.iter().map(tired).collect(),
        heading_rad,
        planners: Planners::Only(Planner::Exact),
        separation: Separation::FLAT,
        ..request.clone()
    }
}

/// The heading of the passes of a plan: the one on which most is flown, either way; passes
/// along walls have others.
fn heading_rad(plan: &AreaPlan) -> Option<f64> {
    let legs = plan.uavs.iter().flat_map(|uav| &uav.legs);
    let seen = legs.filter(|leg| leg.sees);
    let pieces = seen.flat_map(|leg| leg.curve.segments());
    let passes: Vec<(f64, f64)> = pieces.map(|s| (s.start.heading_rad, s.length_m)).collect();
    let alike_m = |heading_rad: f64| -> f64 {
        let alike = |other: f64| wrap_pi(2.0 * (other - heading_rad)).abs() < SAME_RAD;
        let alike = passes.iter().filter(|p| alike(p.0));
        alike.map(|p| p.1).sum()
    };
    let each = passes.iter().map(|p| (alike_m(p.0), p.0));
    each.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, rad)| rad)
}

fn joined(request: &AreaRequest, first: AreaPlan, second: AreaPlan) -> Result<AreaPlan, AreaError> {
    let starts = request.team.iter().map(|u| u.start);
    let places = starts.chain(request.area.vertices().iter().copied());
    let clearance_m = request.clearance_m;
    let airspace = Airspace::new(&request.zones, &request.fences, places, clearance_m)?;
    let mut notices = crossings(&first.notices, &second.notices);
    let mut flights: Vec<Option<Flight>> = Vec::new();
    for (i, uav) in request.team.iter().enumerate() {
        let air = request.air(uav.speed_mps);
        let router = airspace.router(air.ground_radius_m(uav.turn_radius_m));
        let (one, two) = (&first.uavs[i], &second.uavs[i]);
        let legs = match (one.flies(), two.flies()) {
            (true, true) => {
                let legs = both(&router, &one.legs, &two.legs, |l| time_s(l, &air));
                legs.unwrap_or_else(|| {
                    let text = format!(
                        "{} flies no second crossing: no clear way leads to it",
                        uav.name
                    );
                    notices.push(text);
                    one.legs.clone()
                })
            }
            (true, false) => one.legs.clone(),
            (false, true) => two.legs.clone(),
            (false, false) => Vec::new(),
        };
        flights.push((!legs.is_empty()).then(|| Flight {
            uav: i,
            name: uav.name.clone(),
            track: track(&legs, uav.start),
            lap: [&one.lap[..], &two.lap[..]].concat(),
            length_m: time_s(&legs, &air) * uav.speed_mps,
            speed_mps: uav.speed_mps,
            turn_radius_m: uav.turn_radius_m,
            lane_m: one.lane_m.or(two.lane_m).unwrap_or(0.0),
            cruise_power_w: uav.cruise_power_w,
            passes: Some(one.passes.unwrap_or(0) + two.passes.unwrap_or(0)),
            legs,
        }));
    }
    Ok(told(request, (first, second), &flights, notices))
}

/// What is worth saying of both crossings, what is the same once.
fn crossings(first: &[String], second: &[String]) -> Vec<String> {
    let of = |which: &str, text: &String| format!("{which} crossing: {text}");
    let first = first.iter().map(|text| of("first", text));
    first
        .chain(second.iter().map(|text| of("second", text)))
        .collect()
}

fn told(
    request: &AreaRequest,
    (first, second): (AreaPlan, AreaPlan),
    flights: &[Option<Flight>],
    notices: Vec<String>,
) -> AreaPlan {
    let tracks = flights.iter().map(|f| {
        let track = f.as_ref().map(|f| f.track.clone());
        track.unwrap_or_default()
    });
    let tracks: Vec<_> = tracks.collect();
    let heights_m = request.separation.heights_m(
        &request.team,
        request.clearance_m,
        &tracks,
        request.altitude_m,
    );
    let uavs = flights.iter().enumerate().map(|(i, flight)| match flight {
        Some(flight) => flight.told(heights_m[i]),
        None => {
            let why = first.uavs[i].stays.unwrap_or(Stays::NotNeeded);
            UavFlight::stays(&request.team[i], heights_m[i], why)
        }
    });
    let uavs: Vec<UavFlight> = uavs.collect();
    let flying = || flights.iter().flatten();
    let figures = Figures {
        planner: Planner::Exact,
        laid: first.figures.laid,
        makespan_s: flying().map(Flight::time_s).fold(0.0, f64::max),
        covered_share: first
            .figures
            .covered_share
            .min(second.figures.covered_share),
        total_m: flying().map(|f| length_m(&f.legs)).sum(),
        energy_s: flying().map(Flight::energy_s).sum(),
        energy_wh: flying().map(Flight::energy_wh).sum(),
        uavs_flying: flying().count(),
    };
    let facts = match (first.facts, second.facts) {
        (Some(one), Some(two)) => Some(Facts::and(one, two)),
        (one, two) => one.or(two),
    };
    AreaPlan {
        uavs,
        figures,
        facts,
        compared: Vec::new(),
        shapes: first.shapes,
        notices,
    }
}

/// The legs of two flights from one start as one flight: each forward or backward, whichever
/// is soonest, and the clear way between them. `None` where there is none.
fn both(
    router: &Router,
    first: &[Leg],
    second: &[Leg],
    time_s: impl Fn(&[Leg]) -> f64,
) -> Option<Vec<Leg>> {
    let ways = |legs: &[Leg]| {
        let back = legs.iter().rev().map(|leg| Leg {
            curve: leg.curve.reversed(),
            sees: leg.sees,
        });
        [legs.to_vec(), back.collect()]
    };
    let mut best: Option<(f64, Vec<Leg>)> = None;
    for mut one in ways(first) {
        // The way home is not flown, nor is the way out of what follows.
        one.pop_if(|leg| !leg.sees);
        let Some(from) = one.last().and_then(|leg| leg.curve.end()) else {
            continue;
        };
        for two in ways(second) {
            let skip = usize::from(two.first().is_some_and(|leg| !leg.sees));
            let Some(to) = two.get(skip).and_then(|leg| leg.curve.start()) else {
                continue;
            };
            let Ok(curve) = router.route(from, to) else {
                continue;
            };
            let mut legs = one.clone();
            if !curve.is_empty() {
                legs.push(Leg { curve, sees: false });
            }
            legs.extend_from_slice(&two[skip..]);
            let takes_s = time_s(&legs);
            if best.as_ref().is_none_or(|(least_s, _)| takes_s < *least_s) {
                best = Some((takes_s, legs));
            }
        }
    }
    best.map(|(_, legs)| legs)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::team::Sensor;
    use skein_geometry::frame::{Point, Vector};
    use skein_geometry::{NoFlyZones, Polygon};
    use std::sync::Arc;

    fn polygon(corners: &[(f64, f64)]) -> Polygon {
        Polygon::new(corners.iter().map(|&(x, y)| Point::new(x, y)).collect()).unwrap()
    }

    fn request(n_uavs: usize) -> AreaRequest {
        let area = polygon(&[(0.0, 0.0), (700.0, 0.0), (700.0, 400.0), (0.0, 400.0)]);
        let zone = polygon(&[(300.0, 150.0), (360.0, 150.0), (330.0, 220.0)]);
        let camera = Sensor::Swath { width_m: 60.0 };
        let start = Point::new(-40.0, -40.0);
        let uav = |i| Uav::new(format!("uav-{i}"), start, 15.0, 25.0, camera);
        AreaRequest {
            zones: Arc::new(NoFlyZones::new(vec![zone])),
            heading_rad: Some(0.3),
            steps: 200,
            run_out_m: 15.0,
            ..AreaRequest::new(area, (0..n_uavs).map(uav).collect(), 10.0, 60.0)
        }
    }

    fn check(request: &AreaRequest, plan: &AreaPlan) {
        for uav in plan.uavs.iter().filter(|u| u.flies()) {
            let start = uav.legs[0].curve.start().unwrap().position();
            let end = uav.legs.last().unwrap().curve.end().unwrap().position();
            assert!((start - end).norm() < 1e-3);
            for pair in uav.legs.windows(2) {
                let (a, b) = (pair[0].curve.end().unwrap(), pair[1].curve.start().unwrap());
                assert!((a.position() - b.position()).norm() < 1e-3);
                assert!(wrap_pi(a.heading_rad - b.heading_rad).abs() < 1e-3);
            }
            let clear = |leg: &Leg| request.zones.is_clear(&leg.curve, 9.999);
            assert!(uav.legs.iter().all(clear));
            let told_s = time_s(&uav.legs, &request.air(uav.speed_mps));
            assert!((told_s - uav.time_s).abs() < 1e-6);
        }
    }

    /// Metres that are seen on a course and across it.
    fn seen_m(plan: &AreaPlan, heading_rad: f64) -> (f64, f64) {
        let legs = plan.uavs.iter().flat_map(|u| &u.legs).filter(|l| l.sees);
        legs.fold((0.0, 0.0), |(along, across), leg| {
            let off = 2.0 * (leg.curve.start().unwrap().heading_rad - heading_rad);
            let m = leg.curve.length_m();
            if wrap_pi(off).abs() < 0.1 {
                (along + m, across)
            } else {
                (along, across + m)
            }
        })
    }

    #[test]
    fn both_crossings_are_flown_in_one_flight() {
        for (n_uavs, wind) in [(1, 0.0), (2, 4.0), (3, 0.0)] {
            let asked = AreaRequest {
                wind_mps: Vector::new(0.0, wind),
                ..request(n_uavs)
            };
            let once = plan(&half(&asked, Some(0.3))).unwrap();
            let twice = plan_crossed(&asked).unwrap();
            check(&asked, &twice);
            let (along_m, across_m) = seen_m(&twice, 0.3);
            assert!(
                along_m > 3_000.0 && across_m > 3_000.0,
                "{along_m} {across_m}"
            );
            assert!(twice.figures.covered_share > 0.98);
            let ratio = twice.figures.makespan_s / once.figures.makespan_s;
            assert!((1.5..2.6).contains(&ratio), "{n_uavs}: {ratio}");
        }
    }

    #[test]
    fn the_endurance_is_shared_and_the_course_is_found_where_none_is_asked_for() {
        let mut asked = request(2);
        asked.heading_rad = None;
        let free = plan_crossed(&asked).unwrap();
        check(&asked, &free);
        let endurance_s = 0.7 * free.figures.makespan_s;
        for uav in &mut asked.team {
            uav.endurance_s = Some(endurance_s);
        }
        let tired = plan_crossed(&asked).unwrap();
        check(&asked, &tired);
        assert!(tired.figures.makespan_s <= endurance_s + 1e-6);
        assert!(tired.figures.covered_share < free.figures.covered_share);
        assert!(tired.notices.iter().any(|n| n.contains("crossing: ")));
    }
}
