use super::*;
use crate::Goal;
use crate::contour::{ContourLook, ContourPlace};
use crate::testing::{CLEARANCE_M, Wing, airframe, loop_and_router, square};
use skein_geometry::math::{TAU, sin};
use skein_geometry::polyline::nearest;
use std::sync::Arc;

/// What a level camera shows of a polyline.
#[allow(clippy::cast_possible_truncation, reason = "some hundred metres")]
fn look(line: &[Point], pose: Pose, sided: bool) -> ContourLook {
    let a = airframe();
    let ahead = pose.direction();
    let left = Vector::new(-ahead.y, ahead.x);
    let (mut told, mut begins) = (Vec::new(), true);
    for p in line {
        let to = p - pose.position();
        let shown = to.dot(&ahead).abs() <= a.footprint_along_m
            && to.dot(&left).abs() <= a.footprint_across_m;
        if shown {
            told.push(ContourPlace {
                east_mm: (p.x * 1000.0) as i32,
                north_mm: (p.y * 1000.0) as i32,
                begins,
            });
        }
        begins = !shown;
    }
    ContourLook::new(sided, told)
}

/// A road of two bends, 1.2 km long, a place each ten metres.
fn road() -> Vec<Point> {
    (0..120)
        .map(|k| {
            let x = 10.0 * f64::from(k);
            Point::new(x, 120.0 + 90.0 * sin(x / 130.0))
        })
        .collect()
}

/// Flies so many seconds along a line from beside a place of it; the farthest it was from it
/// while it traced, the share of the line that was in its picture, and how near a zone it came.
fn traced(
    line: &[Point],
    sided: bool,
    zones: Vec<skein_geometry::Polygon>,
    s: u32,
) -> (f64, f64, f64) {
    let (coverage_loop, router) = loop_and_router(12, 10, zones);
    let zones = Arc::clone(router.zones());
    let mut executive = Executive::new(airframe(), 90.0, coverage_loop, router);
    let mut wing = Wing::new(Pose::new(line[10] + Vector::new(-25.0, -10.0), 0.5));
    executive.set_goal(Goal::Trace, &|_| false);
    let (mut off_m, mut zone_m) = (0.0_f64, f64::MAX);
    let mut seen = vec![false; line.len()];
    for step in 0..5 * s {
        let mut percept = wing.percept();
        percept.contour = look(line, wing.pose, sided);
        for (p, was) in line.iter().zip(&mut seen) {
            *was |= (p - wing.pose.position()).norm() <= airframe().footprint_along_m;
        }
        let (setpoint, _) = executive.step(&percept, &|_| false);
        wing.setpoint = Some(setpoint);
        wing.fly(200);
        zone_m = zone_m.min(zones.distance_m(wing.pose.position()));
        if executive.is_tracing() && step > 50 {
            let beside = nearest(line, wing.pose.position());
            off_m = off_m.max(beside.map_or(f64::MAX, |(_, m, _)| m));
        }
    }
    let all = u32::try_from(seen.len()).unwrap_or(1);
    let count = u32::try_from(seen.iter().filter(|s| **s).count()).unwrap_or(0);
    (off_m, f64::from(count) / f64::from(all), zone_m)
}

#[test]
fn a_road_is_flown_from_one_end_to_the_other_and_back() {
    let (_, seen, _) = traced(&road(), false, Vec::new(), 110);
    assert!(seen > 0.85, "{seen}");
    let (_, seen, _) = traced(&road(), false, Vec::new(), 400);
    assert!(seen > 0.98, "{seen}");
}

#[test]
fn a_closed_edge_is_flown_round_with_what_it_encloses_on_the_left() {
    let ring: Vec<Point> = (0..100)
        .map(|k| {
            let rad = TAU * f64::from(k) / 100.0;
            Point::new(300.0 + 150.0 * cos(rad), 240.0 + 150.0 * sin(rad))
        })
        .collect();
    let (off_m, seen, _) = traced(&ring, true, Vec::new(), 150);
    assert!(seen > 0.98 && off_m < 30.0, "{seen} {off_m}");
}

#[test]
fn a_zone_on_the_road_is_flown_round() {
    let zone = square(500.0, 40.0, 40.0);
    let (_, seen, zone_m) = traced(&road(), false, vec![zone], 400);
    assert!(zone_m > CLEARANCE_M - 2.5, "{zone_m} m from the zone");
    assert!(seen > 0.85, "{seen}");
}

#[test]
fn gaps_are_counted_along_the_contour() {
    let ring: Vec<Point> = [(0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0)]
        .map(|(x, y)| Point::new(x, y))
        .to_vec();
    let at = |x: f64, y: f64, deg: f64| Pose::new(Point::new(x, y), deg.to_radians());
    let mine = at(50.0, 0.0, 0.0);
    let others = [(at(100.0, 30.0, 90.0), 10.0), (at(0.0, 60.0, -90.0), 0.0)];
    let gaps = gaps_along(&ring, mine, &others).unwrap();
    assert!((gaps.ahead_m - 90.0).abs() < 1e-6 && (gaps.behind_m - 110.0).abs() < 1e-6);
    assert!(gaps_along(&ring, mine, &[]).is_none());
    assert!(gaps_along(&ring, at(50.0, 0.0, 180.0), &others).is_none());
}
