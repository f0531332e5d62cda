//! What a loop through stations owes, checked without the code that made it.

use super::targets::{LineTarget, PointTarget, Targets};
use super::*;
use crate::coverage::passes::{self, PassesProblem};
use crate::coverage::ring::patch::frame_holds;
use proptest::prelude::*;
use skein_geometry::math::wrap_pi;
use skein_geometry::{NoFlyZones, Polygon, contingency_clear};

fn rectangle(x0: f64, y0: f64, x1: f64, y1: f64) -> Polygon {
    let ring = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)];
    Polygon::new(ring.map(|(x, y)| Point::new(x, y)).to_vec()).unwrap()
}

/// What a mission of these zones is flown with.
fn flown(zones: Vec<Polygon>) -> LoopProblem {
    LoopProblem {
        area: rectangle(0.0, 0.0, 1000.0, 1000.0),
        zones: Arc::new(NoFlyZones::new(zones)),
        lane_spacing_m: 48.0,
        turn_radius_m: 23.0,
        clearance_m: 20.0,
        footprint_across_m: 59.0,
        footprint_along_m: 45.0,
        tracking_error_m: 3.0,
        launch: Point::new(-200.0, -200.0),
        tree: crate::coverage::ring::Tree::default(),
    }
}

fn judge(problem: &StationsProblem<'_>, l: &CoverageLoop) {
    let (p, stations) = (problem.flown, &problem.stations);
    let mut seen = vec![0; stations.len()];
    let (across_m, along_m) = (
        p.footprint_across_m - p.tracking_error_m,
        p.footprint_along_m - p.tracking_error_m,
    );
    for (i, c) in l.cells().iter().enumerate() {
        let n = usize::from(c.id.number().unwrap());
        seen[n] += 1;
        assert_eq!(l.index_of(c.id), u16::try_from(i).ok());
        assert!(p.zones.is_clear(&c.curve, p.clearance_m), "{n}");
        assert!(contingency_clear(
            &p.zones,
            &c.curve,
            p.turn_radius_m,
            p.clearance_m / 2.0
        ));
        assert!(c.curve.largest_gap_m() < 1e-2);
        assert!(c.curve.max_curvature_per_m() <= 1.0 / p.turn_radius_m + 1e-12);
        let (end, next) = (c.curve.end().unwrap(), l.boundary(i + 1));
        assert!((end.position() - next.position()).norm() < 1e-2, "{n}");
        assert!(
            wrap_pi(end.heading_rad - next.heading_rad).abs() < 1e-3,
            "{n}"
        );
        let view = c.curve.pose_at(c.view_m).unwrap();
        assert!(
            frame_holds(&stations[n], view, across_m + 1e-2, along_m + 1e-2),
            "{n}"
        );
    }
    for (id, _) in l.uncoverable() {
        seen[usize::from(id.number().unwrap())] += 1;
    }
    assert!(seen.iter().all(|&times| times == 1), "{seen:?}");
}

fn points(at: &[(f64, f64)]) -> Targets {
    let target = |&(x, y): &(f64, f64)| PointTarget {
        at: Point::new(x, y),
        radius_m: 10.0,
    };
    Targets::Points(at.iter().map(target).collect())
}

#[test]
fn points_are_strung_on_one_loop() {
    let targets = points(&[
        (0.0, 0.0),
        (500.0, 0.0),
        (500.0, 400.0),
        (0.0, 400.0),
        (250.0, 900.0),
    ]);
    let flown = flown(vec![rectangle(200.0, 350.0, 300.0, 450.0)]);
    let p = StationsProblem::of_targets(&flown, &targets);
    let l = build(&p).unwrap();
    judge(&p, &l);
    assert_eq!(l.len(), 5);
    let length_m: f64 = l.cells().iter().map(|c| c.curve.length_m()).sum();
    // The hull is 500 + 400 + 559 + 559 + 400 m; turns and the zone cost little.
    assert!(length_m < 2418.0 * 1.05, "{length_m}");
    assert_eq!(l.hash(), build(&p).unwrap().hash());
}

#[test]
fn one_point_is_circled_and_two_of_the_same_are_two_cells() {
    for targets in [points(&[(50.0, 0.0)]), points(&[(50.0, 0.0), (50.0, 0.0)])] {
        let flown = flown(vec![]);
        let p = StationsProblem::of_targets(&flown, &targets);
        let l = build(&p).unwrap();
        judge(&p, &l);
        assert!(l.cells().iter().all(|c| c.curve.length_m() > 100.0));
    }
}

#[test]
fn what_cannot_be_seen_is_listed_with_the_reason() {
    let targets = points(&[(0.0, 0.0), (500.0, 0.0), (250.0, 300.0), (900.0, 900.0)]);
    let wall = |x0: f64, y0: f64, x1: f64, y1: f64| rectangle(x0, y0, x1, y1);
    let zones = vec![
        rectangle(150.0, 200.0, 350.0, 400.0),
        wall(700.0, 700.0, 1100.0, 710.0),
        wall(700.0, 1090.0, 1100.0, 1100.0),
        wall(700.0, 711.0, 710.0, 1089.0),
        wall(1090.0, 711.0, 1100.0, 1089.0),
    ];
    let flown = flown(zones);
    let p = StationsProblem::of_targets(&flown, &targets);
    let l = build(&p).unwrap();
    judge(&p, &l);
    let why: Vec<(u16, &str)> = l
        .uncoverable()
        .iter()
        .map(|(id, why)| (id.number().unwrap(), why.as_str()))
        .collect();
    assert_eq!(
        why,
        [
            (2, "inside a no-fly zone"),
            (3, "no-fly zones part it from the launch point")
        ]
    );
    // A way into a dead end costs the pieces in it, not those after it.
    let large = Targets::Points(vec![PointTarget {
        at: Point::new(0.0, 0.0),
        radius_m: 60.0,
    }]);
    assert_eq!(
        build(&StationsProblem::of_targets(&self::flown(vec![]), &large)).unwrap_err(),
        LoopError::Nothing
    );
}

/// Three of four points lie in a yard that is shut: the others are flown as if they were alone.
#[test]
fn what_is_in_a_shut_yard_keeps_nothing_else_from_the_loop() {
    let walls = vec![
        rectangle(500.0, -20.0, 1_500.0, 0.0),
        rectangle(500.0, 1_000.0, 1_500.0, 1_020.0),
        rectangle(500.0, 0.0, 520.0, 1_000.0),
        rectangle(1_480.0, 0.0, 1_500.0, 1_000.0),
    ];
    let grid = |x0: f64, y0: f64, columns: usize, rows: usize, step_m: f64| {
        let at = move |i: usize| (i / rows, i % rows);
        let places = (0..columns * rows).map(at);
        places.map(move |(c, r)| (x0 + step_m * c as f64, y0 + step_m * r as f64))
    };
    let outside: Vec<_> = grid(-500.0, 100.0, 3, 4, 230.0).collect();
    let inside = grid(700.0, 200.0, 6, 6, 110.0);
    // They come in turns, so that each is next to one behind a wall.
    let mut all: Vec<(f64, f64)> = inside.collect();
    for (i, p) in outside.iter().enumerate() {
        all.insert(4 * i, *p);
    }
    let flown = flown(walls);
    let (all, alone) = (points(&all), points(&outside));
    let problem = StationsProblem::of_targets(&flown, &all);
    let with_yard = build(&problem).unwrap();
    judge(&problem, &with_yard);
    let alone = build(&StationsProblem::of_targets(&flown, &alone)).unwrap();
    assert_eq!(with_yard.len(), outside.len());
    assert_eq!(with_yard.uncoverable().len(), 36);
    let length_m = |l: &CoverageLoop| l.cells().iter().map(|c| c.curve.length_m()).sum::<f64>();
    assert!(length_m(&with_yard) < 1.15 * length_m(&alone));
}

#[test]
fn a_crossing_of_roads_is_seen_piece_by_piece() {
    let way = |at: &[(f64, f64)]| LineTarget {
        way: at.iter().map(|&(x, y)| Point::new(x, y)).collect(),
        width_m: 8.0,
    };
    let targets = Targets::Lines(vec![
        way(&[(0.0, 300.0), (300.0, 300.0), (600.0, 310.0)]),
        way(&[(300.0, 0.0), (300.0, 300.0), (280.0, 600.0)]),
    ]);
    let flown = flown(vec![]);
    let p = StationsProblem::of_targets(&flown, &targets);
    // Four arms of 300 m in seven pieces each; around a corner of the crossing one frame
    // holds two of them.
    assert_eq!(targets.pieces(48.0).len(), 28);
    assert!((25..28).contains(&p.stations.len()), "{}", p.stations.len());
    let l = build(&p).unwrap();
    judge(&p, &l);
    assert!(l.uncoverable().is_empty());
    // Every point of the roads lies in some piece.
    let Targets::Lines(lines) = &targets else {
        unreachable!()
    };
    for line in lines {
        for w in line.way.windows(2) {
            for i in 0..=100u8 {
                let at = w[0] + (w[1] - w[0]) * (f64::from(i) / 100.0);
                let held = p.stations.iter().any(|s| {
                    let u = (s[1] - s[0]).normalize();
                    let v = at - s[0];
                    let (along, across) = (v.dot(&u), u.perp(&v));
                    let (long, wide) = ((s[1] - s[0]).norm(), (s[3] - s[0]).norm());
                    along >= -1e-6
                        && along <= long + 1e-6
                        && across >= -1e-6
                        && across <= wide + 1e-6
                });
                assert!(held, "{at}");
            }
        }
    }
    // The roads are 1,201 m; a closed tour flies each arm twice, but sees it once.
    let length_m: f64 = l.cells().iter().map(|c| c.curve.length_m()).sum();
    assert!(length_m < 2.0 * 1201.0 * 1.35, "{length_m}");
}

#[test]
fn a_corridor_wider_than_a_lane_is_flown_in_lanes() {
    let targets = Targets::Lines(vec![LineTarget {
        way: vec![Point::new(0.0, 0.0), Point::new(960.0, 0.0)],
        width_m: 144.0,
    }]);
    let flown = flown(vec![]);
    let p = StationsProblem::of_targets(&flown, &targets);
    assert_eq!(p.stations.len(), 3 * 20);
    let l = build(&p).unwrap();
    judge(&p, &l);
    assert!(l.uncoverable().is_empty());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn any_points_among_any_houses(
        at in prop::collection::vec((0.0f64..900.0, 0.0f64..900.0), 1..20),
        houses in prop::collection::vec((0.0f64..800.0, 0.0f64..800.0, 10.0f64..150.0, 10.0f64..150.0), 0..5),
    ) {
        let zones = houses.iter().map(|&(x, y, w, h)| rectangle(x, y, x + w, y + h)).collect();
        let flown = flown(zones);
        let p = StationsProblem::of_targets(&flown, &points(&at));
        match build(&p) {
            Ok(l) => judge(&p, &l),
            Err(e) => prop_assert!(matches!(e, LoopError::Nothing | LoopError::CutOff), "{e}"),
        }
    }

    #[test]
    fn any_line_is_cut_without_gaps(
        at in prop::collection::vec((-500.0f64..500.0, -500.0f64..500.0), 2..8), width_m in 0.0f64..40.0,
    ) {
        let way: Vec<Point> = at.iter().map(|&(x, y)| Point::new(x, y)).collect();
        let targets = Targets::Lines(vec![LineTarget { way: way.clone(), width_m }]);
        let flown = flown(vec![]);
        let StationsProblem { stations, mut order, .. } = StationsProblem::of_targets(&flown, &targets);
        order.sort_unstable();
        prop_assert_eq!(order, (0..stations.len()).collect::<Vec<_>>());
        for s in &stations {
            let diagonal = (s[2] - s[0]).norm();
            prop_assert!(diagonal <= 48.0 + 48.0 + width_m, "{}", diagonal);
        }
    }

    #[test]
    fn who_sees_a_station_has_seen_its_pieces(
        ways in prop::collection::vec((0.0f64..400.0, 0.0f64..400.0, -60.0f64..60.0, -60.0f64..60.0), 1..40),
        house in (0.0f64..400.0, 0.0f64..400.0),
    ) {
        let line = |&(x, y, u, v): &(f64, f64, f64, f64)| LineTarget {
            way: vec![Point::new(x, y), Point::new(x + u, y + v)],
            width_m: 6.0,
        };
        let targets = Targets::Lines(ways.iter().map(line).collect());
        let zone = rectangle(house.0, house.1, house.0 + 30.0, house.1 + 30.0);
        let flown = flown(vec![zone]);
        let p = StationsProblem::of_targets(&flown, &targets);
        let pieces = targets.pieces(flown.lane_spacing_m);
        prop_assert!(p.stations.len() <= pieces.len());
        let sides = |s: &Corners| ((s[1] - s[0]).norm(), (s[3] - s[0]).norm());
        for piece in &pieces {
            let holds = |s: &Corners| {
                let (long, wide) = sides(s);
                let (u, v) = ((s[1] - s[0]) / long, (s[3] - s[0]) / wide);
                piece.iter().all(|c| {
                    let at = c - s[0];
                    let within = |x: f64, most: f64| (-1e-6..=most + 1e-6).contains(&x);
                    within(at.dot(&u), long) && within(at.dot(&v), wide)
                })
            };
            prop_assert!(p.stations.contains(piece) || p.stations.iter().any(holds));
        }
        for s in p.stations.iter().filter(|s| !pieces.contains(s)) {
            let (long, wide) = sides(s);
            prop_assert!(long.max(wide) <= flown.lane_spacing_m + 1e-6);
            let middle = crate::coverage::ring::patch::middle(s);
            prop_assert!(flown.zones.distance_m(middle) >= flown.clearance_m);
        }
    }
}

/// Zones so near to each other that what keeps clear of both is a notch: few pieces lie in it.
/// All legs have ways left there, and at one place no way in meets a way out.
#[test]
fn what_lies_between_two_zones_is_left_out_and_nothing_else() {
    let around = |x: f64, y: f64| {
        let at = |i: u32| {
            let (s, c) = skein_geometry::math::sin_cos(f64::from(i) * core::f64::consts::PI / 4.0);
            Point::new(x + 20.6 * c, y + 20.6 * s)
        };
        Polygon::new((0..8).map(at).collect()).unwrap()
    };
    let flown = LoopProblem {
        area: rectangle(0.0, 60.0, 860.0, 720.0),
        lane_spacing_m: 72.0,
        turn_radius_m: 36.0,
        clearance_m: 75.0,
        footprint_across_m: 68.0,
        footprint_along_m: 42.9,
        launch: Point::new(430.0, -40.0),
        ..flown(vec![around(300.0, 430.0), around(246.0, 281.8)])
    };
    let passes = PassesProblem {
        zones: Arc::clone(&flown.zones),
        clearance_m: flown.clearance_m,
        look_ahead_m: 0.0,
        ..PassesProblem::new(flown.area.clone(), 72.0, 36.0, flown.launch)
    };
    let passes = passes::plan(&passes).unwrap().passes;
    let problem = StationsProblem::of_passes(&flown, &passes);
    let l = build(&problem).unwrap();
    judge(&problem, &l);
    let (served, left_out) = (l.len(), l.uncoverable().len());
    assert!(served > 110 && left_out <= 5, "{served} {left_out}");
}
