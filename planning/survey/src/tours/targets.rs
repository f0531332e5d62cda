//! Points and lines as ways to fly (D2.7 §3.4, §3.5): wide points are swept, wide strips
//! flown in lanes, and roads cut where they meet.

use super::tour_problem::{TourProblem, Way};
use super::{LineTarget, PointTarget, TourRequest, ToursError};
use crate::team::is_point;
use crate::visits::look_at;
use skein_flight::coverage::lines::strip;
use skein_geometry::frame::Point;
use skein_geometry::math::atan2;
use std::collections::BTreeMap;

/// Adds a way over each point, or a sweep of its disc.
pub(super) fn points(
    problem: &mut TourProblem,
    request: &TourRequest,
    points: &[PointTarget],
) -> Result<(), ToursError> {
    for point in points {
        if !is_point(point.at) {
            return Err(ToursError::Nowhere(point.name.clone()));
        }
        let sensor = point.sensor.as_deref().or(request.sensor.as_deref());
        let swath_m = problem.swath_m(request.altitude_m, sensor, &point.name)?;
        // Lanes along the way out from the origin of the plane: where that is the launch
        // point the sweep starts without a turn.
        let heading_rad = atan2(point.at.y, point.at.x);
        let way = look_at(point.at, point.radius_m, swath_m, heading_rad);
        let way = way.ok_or_else(|| ToursError::NoSweep {
            target: point.name.clone(),
            radius_m: point.radius_m,
            swath_m,
        })?;
        problem.push(&way, &point.name, sensor);
    }
    Ok(())
}

/// Adds the lanes of strips that are wider than the swath, and all other lines as a
/// network.
pub(super) fn lines(
    problem: &mut TourProblem,
    request: &TourRequest,
    lines: &[LineTarget],
) -> Result<(), ToursError> {
    let mut narrow: Vec<&LineTarget> = Vec::new();
    for line in lines {
        if !line.way.iter().all(|p| is_point(*p)) {
            return Err(ToursError::Nowhere(line.name.clone()));
        }
        let sensor = line.sensor.as_deref().or(request.sensor.as_deref());
        let swath_m = problem.swath_m(request.altitude_m, sensor, &line.name)?;
        if line.width_m <= swath_m {
            narrow.push(line);
            continue;
        }
        let lanes = strip::lanes(&line.way, line.width_m, swath_m);
        let lanes = lanes.ok_or_else(|| ToursError::NoLanes {
            target: line.name.clone(),
            width_m: line.width_m,
            swath_m,
        })?;
        for lane in lanes {
            problem.push(&lane, &line.name, sensor);
        }
    }
    network(problem, request, &narrow);
    Ok(())
}

/// Adds lines that hang together where they share a point: each is cut there.
fn network(problem: &mut TourProblem, request: &TourRequest, lines: &[&LineTarget]) {
    // Zero has two forms.
    let key = |p: &Point| ((p.x + 0.0).to_bits(), (p.y + 0.0).to_bits());
    let mut places: BTreeMap<(u64, u64), (usize, usize)> = BTreeMap::new();
    let mut numbered = Vec::new();
    for line in lines {
        let mut way = Vec::new();
        for p in &line.way {
            let known = places.get(&key(p)).map(|k| k.0);
            let place = known.unwrap_or_else(|| problem.place(*p));
            if way.last() == Some(&place) {
                continue;
            }
            places.entry(key(p)).or_insert((place, 0)).1 += 1;
            way.push(place);
        }
        numbered.push((way, *line));
    }
    let mut uses = vec![0; problem.at.len()];
    for (place, count) in places.into_values() {
        uses[place] = count;
    }
    for (way, line) in numbered {
        let mut piece = Vec::new();
        for (i, &p) in way.iter().enumerate() {
            piece.push(p);
            let last = i + 1 == way.len();
            if piece.len() > 1 && (last || uses[p] > 1) {
                problem.ways.push(Way {
                    places: std::mem::replace(&mut piece, vec![p]),
                    name: line.name.clone(),
                    sensor: line.sensor.clone().or_else(|| request.sensor.clone()),
                });
            }
        }
    }
}
