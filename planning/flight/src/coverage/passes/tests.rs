//! Tests of whole plans: everything is seen, nothing is entered, bad input is named.

use super::*;
use proptest::prelude::*;
use skein_geometry::math::{TAU, cos, sin};
use skein_geometry::polygon::point_to_line_m;

fn polygon(points: &[(f64, f64)]) -> Polygon {
    Polygon::new(points.iter().map(|&(x, y)| Point::new(x, y)).collect()).unwrap()
}

fn square(x: f64, y: f64, half: f64) -> Polygon {
    polygon(&[
        (x - half, y - half),
        (x + half, y - half),
        (x + half, y + half),
        (x - half, y + half),
    ])
}

fn problem(area: Polygon, zones: Vec<Polygon>) -> PassesProblem {
    PassesProblem {
        zones: Arc::new(NoFlyZones::new(zones)),
        clearance_m: 5.0,
        steps: 200,
        ..PassesProblem::new(area, 20.0, 10.0, Point::new(-400.0, -400.0))
    }
}

/// The share of a grid of points, of those to be seen, that no pass sees.
fn unseen(problem: &PassesProblem, passes: &[Pass]) -> f64 {
    let (low, high) = problem.area.bounds();
    let (mut unseen, mut all) = (0u32, 0u32);
    for i in 0..150 {
        for j in 0..150 {
            let at = |l: f64, h: f64, k: i32| l + (h - l) * (f64::from(k) + 0.5) / 150.0;
            let p = Point::new(at(low.x, high.x, i), at(low.y, high.y, j));
            if !problem.area.contains(p)
                || problem.holes.iter().any(|h| h.contains(p))
                || problem.zones.distance_m(p) < problem.clearance_m * 1.1
            {
                continue;
            }
            all += 1;
            let seen = passes.iter().any(|pass| {
                // A square footprint, written differently from `Pass::sees`.
                let d = (pass.to - pass.from).normalize() * problem.look_ahead_m;
                point_to_line_m(p, pass.from - d, pass.to + d)
                    <= problem.lane_spacing_m / 2.0 + 1e-6
                    || pass.sees(p, problem.lane_spacing_m / 2.0, problem.look_ahead_m)
            });
            unseen += u32::from(!seen);
        }
    }
    f64::from(unseen) / f64::from(all.max(1))
}

#[test]
fn a_plain_field_is_its_lanes() {
    let p = PassesProblem::new(square(0.0, 0.0, 100.0), 50.0, 20.0, Point::origin());
    let found = plan(&p).unwrap();
    assert_eq!((found.passes.len(), found.cells.len()), (4, 1));
    assert_eq!(found.pocket_passes, 0);
    assert!((found.lower_bound_m - 800.0).abs() < 1e-3);
    assert!(found.length_m > found.passes_m);
}

#[test]
fn bad_figures_are_refused_by_name() {
    let good = problem(square(0.0, 0.0, 100.0), vec![]);
    let with = |change: fn(&mut PassesProblem)| {
        let mut bad = good.clone();
        change(&mut bad);
        plan(&bad).unwrap_err()
    };
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let mut p = good.clone();
        p.lane_spacing_m = bad;
        assert_eq!(plan(&p).unwrap_err(), PassesError::Number("lane spacing"));
    }
    assert_eq!(
        with(|p| p.clearance_m = -1.0),
        PassesError::Number("clearance")
    );
    assert_eq!(
        with(|p| p.clearance_m = f64::NAN),
        PassesError::Number("clearance")
    );
    assert_eq!(
        with(|p| p.look_ahead_m = f64::NAN),
        PassesError::Number("look ahead")
    );
    assert_eq!(
        with(|p| p.launch = Point::new(f64::NAN, 0.0)),
        PassesError::Number("launch point")
    );
    assert_eq!(
        with(|p| p.directions = Directions::Fixed(f64::INFINITY)),
        PassesError::Number("heading")
    );
    assert_eq!(with(|p| p.lane_spacing_m = 1e-4), PassesError::TooMany);
    let filled = problem(square(0.0, 0.0, 100.0), vec![square(0.0, 0.0, 99.0)]);
    assert_eq!(plan(&filled).unwrap_err(), PassesError::Nothing);
    let mut inside = problem(square(0.0, 0.0, 100.0), vec![square(0.0, 0.0, 20.0)]);
    inside.launch = Point::new(24.0, 0.0);
    assert_eq!(plan(&inside).unwrap_err(), PassesError::Launch);
}

#[test]
fn lanes_cross_holes_but_not_zones() {
    let hole = square(0.0, 0.0, 30.0);
    let mut free = problem(square(0.0, 0.0, 100.0), vec![]);
    free.holes = vec![hole.clone()];
    let found = plan(&free).unwrap();
    assert!(unseen(&free, &found.passes) < 1e-9);
    assert!(found.cells.len() == 4 && found.pocket_passes == 0);
}

fn star(x: f64, y: f64, radii: &[f64], turn: f64) -> Polygon {
    let n = radii.len();
    let at = |i: usize| {
        let a = TAU * i as f64 / n as f64 + turn;
        (x + radii[i] * cos(a), y + radii[i] * sin(a))
    };
    polygon(&(0..n).map(at).collect::<Vec<_>>())
}

fn is_clear(problem: &PassesProblem, pass: &Pass) -> bool {
    let along = skein_geometry::Segment {
        start: pass.start(),
        curvature_per_m: 0.0,
        length_m: pass.length_m(),
    };
    (problem.zones).is_segment_clear(&along, problem.clearance_m)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn all_is_seen_and_no_zone_is_entered(
        border in prop::collection::vec(120.0f64..260.0, 5..11),
        zones in prop::collection::vec(
            (-150.0f64..150.0, -150.0f64..150.0, prop::collection::vec(8.0f64..40.0, 5..8), 0.0f64..6.0), 0..6),
        directions in 0usize..4,
        look in 0.0f64..15.0,
    ) {
        let zones = zones.iter().map(|(x, y, r, turn)| star(*x, *y, r, *turn)).collect();
        let mut p = problem(star(0.0, 0.0, &border, 0.0), zones);
        p.look_ahead_m = look;
        p.directions = [
            Directions::Best,
            Directions::PerCell,
            Directions::Huang,
            Directions::Fixed(look),
        ][directions];
        let found = match plan(&p) {
            Err(PassesError::Nothing) => return Ok(()),
            other => other.unwrap(),
        };
        // What lanes leave is judged at points a quarter of a lane apart: corners of less may
        // stay unseen, and the share that a plan tells knows of them.
        prop_assert!(unseen(&p, &found.passes) <= 3e-4, "{}", unseen(&p, &found.passes));
        for pass in &found.passes {
            prop_assert!(is_clear(&p, pass), "{pass:?}");
        }
        prop_assert!(found.length_m >= found.passes_m - 1e-6);
        let lanes: usize = found.cells.iter().map(|c| c.lanes).sum();
        prop_assert!(lanes == 0 || lanes + found.pocket_passes == found.passes.len());
    }
}

/// On a border that is this steep, rounding puts the end of a lane inside the zone.
#[test]
fn a_lane_that_ends_on_a_steep_border_is_not_prolonged_into_its_zone() {
    let border = [
        125.53326681179672,
        245.05168211115426,
        120.0,
        120.0,
        120.0,
        227.1215871596595,
        232.10655916669032,
    ];
    let zones = vec![
        star(
            88.61391207506061,
            -32.70690593178619,
            &[
                21.893937647455772,
                8.0,
                23.361714646143263,
                8.0,
                33.12333303533892,
            ],
            0.0,
        ),
        star(
            134.8898457046352,
            -106.47008470631974,
            &[
                8.0,
                17.704601860332627,
                38.62264480663994,
                26.453654402594548,
                8.0,
            ],
            1.3221856363548665,
        ),
        star(
            0.0,
            0.0,
            &[28.45504572931845, 8.0, 12.6049623829092, 8.0, 8.0],
            2.717118320900763,
        ),
    ];
    let mut p = problem(star(0.0, 0.0, &border, 0.0), zones);
    p.look_ahead_m = 1.9346019746679324;
    p.directions = Directions::PerCell;
    let found = plan(&p).unwrap();
    assert!(found.passes.iter().all(|pass| is_clear(&p, pass)));
}
