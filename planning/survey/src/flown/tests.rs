use super::*;
use skein_flight::coverage::passes::Pass;
use skein_geometry::{NoFlyZones, Polygon};

fn at(x: f64, y: f64) -> Point {
    Point::new(x, y)
}

fn rectangle(x: f64, y: f64, w: f64, h: f64) -> Polygon {
    let corners = [(x, y), (x + w, y), (x + w, y + h), (x, y + h)];
    Polygon::new(corners.map(|(x, y)| at(x, y)).to_vec()).unwrap()
}

fn air(zones: Vec<Polygon>, fences: &[Polygon]) -> Airspace {
    let zones = NoFlyZones::new(zones);
    Airspace::new(&zones, fences, [at(-500.0, -500.0)].into_iter(), 5.0).unwrap()
}

/// Joined without gap or bend, no tighter than the radius, clear, from the start and back.
fn check(flown: &Flown, air: &Airspace, start: Point, radius_m: f64) {
    let pieces: Vec<&Segment> = flown.legs.iter().flat_map(|l| l.curve.segments()).collect();
    assert!((pieces[0].start.position() - start).norm() < 1e-6);
    assert!((pieces[pieces.len() - 1].end().position() - start).norm() < 1e-6);
    for w in pieces.windows(2) {
        let (a, b) = (w[0].end(), w[1].start);
        assert!((a.position() - b.position()).norm() < 1e-6, "{a:?} {b:?}");
        let bend = skein_geometry::math::wrap_pi(a.heading_rad - b.heading_rad);
        assert!(bend.abs() < 1e-6, "{a:?} {b:?}");
    }
    for s in pieces {
        assert!(s.curvature_per_m.abs() <= (1.0 + 1e-9) / radius_m);
        assert!(air.zones().segment_distance_m(s) > air.clearance_m() - 1e-3);
    }
}

fn lane(x0: f64, x1: f64, y: f64) -> Stop {
    Stop::along(straight(at(x0, y), at(x1, y))).unwrap()
}

#[test]
fn turns_between_lanes_keep_clear_of_a_wall_behind_them() {
    // A wall 20 m behind the lanes' ends: a turn of 30 m fits only 15 m earlier.
    let air = air(vec![rectangle(420.0, -300.0, 40.0, 800.0)], &[]);
    let start = at(-100.0, -50.0);
    let facing = [lane(0.0, 400.0, 0.0), lane(400.0, 0.0, 40.0)];
    assert_eq!(fly(&air.router(30.0), start, &facing).left, [0, 1]);
    let cut = |x0, x1, y| {
        let pass = Pass {
            from: at(x0, y),
            to: at(x1, y),
        };
        let cut = turnable(&air.router(30.0), pass).unwrap();
        Stop::along(straight(cut.from, cut.to)).unwrap()
    };
    let stops = [cut(0.0, 400.0, 0.0), cut(400.0, 0.0, 40.0)];
    let flown = fly(&air.router(30.0), start, &stops);
    assert!(flown.left.is_empty(), "{:?}", flown.left);
    check(&flown, &air, start, 30.0);
    let seen_m: f64 = flown
        .legs
        .iter()
        .filter(|l| l.sees)
        .map(|l| l.curve.length_m())
        .sum();
    assert!((seen_m - 770.0).abs() < 0.2, "{seen_m}");
    assert!(flown.length_m() > 1000.0 && flown.length_m() < 1600.0);
}

#[test]
fn what_lies_behind_walls_is_left_out_and_the_rest_is_flown() {
    let walls = vec![
        rectangle(500.0, -100.0, 300.0, 20.0),
        rectangle(500.0, 180.0, 300.0, 20.0),
        rectangle(500.0, -90.0, 20.0, 280.0),
        rectangle(780.0, -90.0, 20.0, 280.0),
    ];
    let air = air(walls, &[]);
    let stops = [
        lane(0.0, 400.0, 0.0),
        lane(560.0, 740.0, 20.0),
        lane(400.0, 0.0, 60.0),
        Stop::over(at(640.0, 50.0)),
        Stop::over(at(640.0, 300.0)),
    ];
    let start = at(-100.0, -50.0);
    let flown = fly(&air.router(20.0), start, &stops);
    assert_eq!(flown.left, [1, 3]);
    check(&flown, &air, start, 20.0);
    let none = fly(&air.router(20.0), start, &stops[1..2]);
    assert!(none.legs.is_empty() && none.left == [0]);
}

#[test]
fn a_fence_is_not_left_by_any_turn() {
    let fence = [rectangle(-150.0, -100.0, 600.0, 200.0)];
    let air = air(Vec::new(), &fence);
    let start = at(-100.0, -50.0);
    let stops = [
        lane(0.0, 400.0, 0.0),
        lane(400.0, 0.0, 40.0),
        lane(0.0, 400.0, -40.0),
    ];
    let flown = fly(&air.router(30.0), start, &stops);
    assert!(flown.left.is_empty());
    check(&flown, &air, start, 30.0);
}

#[test]
fn soft_corners_are_cut_and_sharp_ones_end_a_stretch() {
    let line = [
        at(0.0, 0.0),
        at(200.0, 0.0),
        at(400.0, 30.0),
        at(400.0, 300.0),
        at(0.0, 300.0),
    ];
    let found = stretches(&line, 30.0, 3.0);
    assert_eq!(found.len(), 3);
    assert!(found[0].segments().len() == 3 && found[0].largest_gap_m() < 1e-9);
    assert!((found[0].end().unwrap().position() - line[2]).norm() < 1e-9);
    // Where much may be strayed all corners are cut.
    let whole = stretches(&line, 30.0, 100.0);
    assert_eq!(whole.len(), 1);
    assert!(whole[0].largest_gap_m() < 1e-9);
    assert!((whole[0].end().unwrap().position() - line[4]).norm() < 1e-9);
    assert!(stretches(&line[..1], 30.0, 3.0).is_empty());
    // Back on itself.
    let back = [at(0.0, 0.0), at(100.0, 0.0), at(0.0, 0.0)];
    assert_eq!(stretches(&back, 30.0, 1e9).len(), 2);
}

#[test]
fn a_headwind_makes_a_flight_longer_in_time() {
    let air = air(Vec::new(), &[]);
    let start = at(0.0, 0.0);
    let flown = fly(&air.router(30.0), start, &[lane(100.0, 400.0, 0.0)]);
    let in_wind = |east_mps: f64| {
        let air = Air {
            airspeed_mps: 15.0,
            wind_mps: Vector::new(east_mps, 0.0),
        };
        time_s(&flown.legs, &air)
    };
    let calm_s = in_wind(0.0);
    assert!((calm_s - flown.length_m() / 15.0).abs() < 1e-9);
    assert!(in_wind(5.0) > calm_s * 1.05);
    assert!(in_wind(16.0).is_infinite());
}
