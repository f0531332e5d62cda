//! Bounds against brute force, symmetry, and what is refused.

use super::air::Air;
use super::*;
use proptest::prelude::*;

fn solve(waypoints: &[Point], chain: Chain, gap: f64) -> Headings {
    choose(&Request {
        waypoints,
        chain,
        radius_m: 1.0,
        gap,
        pairs_a_leg: None,
    })
    .unwrap()
}

fn leg_length(v: Vector, a_rad: f64, b_rad: f64) -> f64 {
    Air::default().cost(v, a_rad, b_rad)
}

const FREE: Chain = Chain::Open {
    first_rad: None,
    last_rad: None,
};

fn solve_in_wind(waypoints: &[Point], chain: Chain, gap: f64, wind: Vector) -> TimedHeadings {
    let request = Request {
        waypoints,
        chain,
        radius_m: 1.0,
        gap,
        pairs_a_leg: None,
    };
    choose_in_wind(&request, 1.0, Wind::new(wind.x, wind.y)).unwrap()
}

fn brute(waypoints: &[Point], chain: Chain, steps: usize) -> f64 {
    brute_in(&Air::default(), waypoints, chain, steps)
}

/// The shortest or fastest chain over `steps` headings a waypoint.
fn brute_in(air: &Air, waypoints: &[Point], chain: Chain, steps: usize) -> f64 {
    let heading = |k: usize| TAU * k as f64 / steps as f64;
    let leg = |i: usize, j: usize, costs: &[f64]| -> Vec<f64> {
        let v = waypoints[j] - waypoints[i];
        (0..steps)
            .map(|b| {
                (0..steps)
                    .filter(|&a| costs[a] < f64::INFINITY)
                    .map(|a| costs[a] + air.cost(v, heading(a), heading(b)))
                    .fold(f64::INFINITY, f64::min)
            })
            .collect()
    };
    let run = |mut costs: Vec<f64>| {
        for i in 1..waypoints.len() {
            costs = leg(i - 1, i, &costs);
        }
        costs
    };
    let least = |costs: Vec<f64>| costs.into_iter().fold(f64::INFINITY, f64::min);
    match chain {
        Chain::Open { .. } => least(run(vec![0.0; steps])),
        Chain::Closed => (0..steps)
            .map(|s| {
                let mut costs = vec![f64::INFINITY; steps];
                costs[s] = 0.0;
                leg(waypoints.len() - 1, 0, &run(costs))[s]
            })
            .fold(f64::INFINITY, f64::min),
    }
}

fn monotone(h: &Headings) -> bool {
    h.rounds
        .windows(2)
        .all(|w| w[0].lower_m <= w[1].lower_m && w[0].upper_m >= w[1].upper_m)
        && h.lower_bound_m <= h.length_m
}

fn points(raw: &[(f64, f64)]) -> Vec<Point> {
    raw.iter().map(|p| Point::new(p.0, p.1)).collect()
}

#[test]
fn thirty_six_hundred_headings_lie_between_the_bounds() {
    let p = points(&[(0.0, 0.0), (1.5, 0.7), (0.4, 2.2)]);
    let h = solve(&p, FREE, 1e-5);
    let best = brute(&p, FREE, 3_600);
    assert!(h.lower_bound_m <= best + 1e-9, "{h:?} {best}");
    assert!(h.gap() <= 1e-5 && best <= h.length_m + 1e-4, "{h:?} {best}");
}

#[test]
fn a_straight_line_of_waypoints_is_flown_straight() {
    let p = points(&[(0.0, 0.0), (3.0, 0.0), (7.0, 0.0), (7.5, 0.0)]);
    let h = solve(&p, FREE, 1e-6);
    assert!(
        (h.length_m - 7.5).abs() < 1e-5 && h.lower_bound_m <= 7.5,
        "{h:?}"
    );
    let back = Chain::Open {
        first_rad: Some(1.0),
        last_rad: Some(2.0),
    };
    let h = solve(&p, back, 1e-4);
    assert!((h.headings_rad[0] - 1.0).abs() < 1e-12 && (h.headings_rad[3] - 2.0).abs() < 1e-12);
}

#[test]
fn malformed_requests_are_refused() {
    let refused = |waypoints: &[Point], radius_m: f64, gap: f64, chain: Chain| {
        choose(&Request {
            waypoints,
            chain,
            radius_m,
            gap,
            pairs_a_leg: None,
        })
        .unwrap_err()
    };
    let p = points(&[(0.0, 0.0), (1.0, 0.0)]);
    assert_eq!(refused(&p[..1], 1.0, 0.1, FREE), HeadingsError::TooFew(1));
    assert_eq!(refused(&p, 0.0, 0.1, FREE), HeadingsError::Radius);
    assert_eq!(refused(&p, 1.0, f64::NAN, FREE), HeadingsError::Gap);
    let odd = points(&[(0.0, 0.0), (f64::NAN, 0.0)]);
    assert_eq!(refused(&odd, 1.0, 0.1, FREE), HeadingsError::NotFinite(1));
    let odd = Chain::Open {
        first_rad: None,
        last_rad: Some(f64::INFINITY),
    };
    assert_eq!(refused(&p, 1.0, 0.1, odd), HeadingsError::NotFinite(1));
}

#[test]
fn a_wind_no_slower_than_the_uav_is_refused() {
    let p = points(&[(0.0, 0.0), (9.0, 0.0)]);
    let request = Request {
        waypoints: &p,
        chain: FREE,
        radius_m: 50.0,
        gap: 1e-2,
        pairs_a_leg: None,
    };
    for (airspeed_mps, wind) in [
        (20.0, Wind::new(12.0, 16.0)),
        (20.0, Wind::new(f64::NAN, 0.0)),
        (0.0, Wind::new(0.0, 0.0)),
        (f64::INFINITY, Wind::new(0.0, 0.0)),
    ] {
        let refused = choose_in_wind(&request, airspeed_mps, wind);
        assert_eq!(refused, Err(HeadingsError::Wind), "{airspeed_mps} {wind:?}");
    }
}

#[test]
fn down_wind_and_back_against_it() {
    let request = Request {
        waypoints: &points(&[(0.0, 0.0), (900.0, 0.0)]),
        chain: FREE,
        radius_m: 50.0,
        gap: 1e-4,
        pairs_a_leg: None,
    };
    for (east_mps, seconds) in [(10.0, 30.0), (-10.0, 90.0)] {
        let h = choose_in_wind(&request, 20.0, Wind::new(east_mps, 0.0)).unwrap();
        assert!((h.time_s - seconds).abs() < 1e-2, "{h:?}");
        assert!(h.lower_bound_s <= seconds && h.gap() <= 1e-4, "{h:?}");
    }
}

#[test]
fn an_answer_says_whether_the_gap_is_certified() {
    let p = points(&[(0.0, 0.0), (1.5, 0.7), (0.4, 2.2)]);
    let wind = Vector::new(0.3, 0.0);
    let wide = solve_in_wind(&p, FREE, 0.9, wind);
    assert!(wide.certified && wide.gap() <= 0.9, "{wide:?}");
    // Rounding alone keeps the bounds apart.
    let none = solve_in_wind(&p, FREE, 0.0, wind);
    assert!(!none.certified && none.gap() > 0.0, "{none:?}");
}

#[test]
fn more_pairs_narrow_the_gap() {
    let p = points(&[(0.0, 0.0), (1.5, 0.7), (0.4, 2.2), (2.0, 2.5), (0.2, 1.0)]);
    let gap = |pairs_a_leg| {
        let request = Request {
            waypoints: &p,
            chain: FREE,
            radius_m: 1.0,
            gap: 1e-4,
            pairs_a_leg: Some(pairs_a_leg),
        };
        choose_in_wind(&request, 1.0, Wind::new(0.3, 0.0))
            .unwrap()
            .gap()
    };
    assert!(gap(500) > gap(2_000) && gap(2_000) > gap(20_000));
}

#[test]
fn the_same_place_twice_is_no_trouble() {
    let p = points(&[(0.0, 0.0), (0.0, 0.0), (4.0, 1.0), (4.0, 1.0)]);
    let h = solve(&p, FREE, 1e-3);
    assert!(h.gap() <= 1e-3 && h.length_m < 4.2, "{h:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn the_optimum_lies_between_the_bounds(
        raw in prop::collection::vec((-3.0f64..3.0, -3.0f64..3.0), 2..5), closed in 0usize..2,
    ) {
        let p = points(&raw);
        let chain = [FREE, Chain::Closed][closed];
        let h = solve(&p, chain, 1e-3);
        let best = brute(&p, chain, [180, 48][closed]);
        prop_assert!(h.lower_bound_m <= best + 1e-9, "{h:?} {best}");
        prop_assert!(h.length_m * (1.0 - h.gap().max(1e-3)) <= best + 1e-9, "{h:?} {best}");
        // A few points within a turn or two may take too many pairs.
        prop_assert!(monotone(&h) && h.gap() <= 1e-2, "{h:?}");
        prop_assert!(h.certified == (h.gap() <= 1e-3 + 1e-12), "{h:?}");
        let flown: f64 = (0..p.len() - usize::from(closed == 0))
            .map(|i| leg_length(p[(i + 1) % p.len()] - p[i], h.headings_rad[i], h.headings_rad[(i + 1) % p.len()]))
            .sum();
        prop_assert!((flown - h.length_m).abs() < 1e-6);
    }

    #[test]
    fn a_chain_flown_backwards_is_as_long(
        raw in prop::collection::vec((-8.0f64..8.0, -8.0f64..8.0), 2..9), closed in 0usize..2,
    ) {
        let mut p = points(&raw);
        let chain = [FREE, Chain::Closed][closed];
        let there = solve(&p, chain, 1e-3);
        p.reverse();
        let back = solve(&p, chain, 1e-3);
        prop_assert!(back.lower_bound_m <= there.length_m + 1e-9);
        prop_assert!(there.lower_bound_m <= back.length_m + 1e-9);
        prop_assert!(there.gap() <= 1e-2 && back.gap() <= 1e-2);
    }

    #[test]
    fn in_wind_the_fastest_chain_lies_between_the_bounds(
        raw in prop::collection::vec((-4.0f64..4.0, -4.0f64..4.0), 2..5), share in 0.0f64..0.5, course in 0.0f64..6.3,
        closed in 0usize..2,
    ) {
        let p = points(&raw);
        let chain = [FREE, Chain::Closed][closed];
        let wind = Vector::new(skein_geometry::math::cos(course), skein_geometry::math::sin(course)) * share;
        let h = solve_in_wind(&p, chain, 0.02, wind);
        let air = Air { wind: Some(wind) };
        let best = brute_in(&air, &p, chain, [72, 24][closed]);
        prop_assert!(h.lower_bound_s <= best + 1e-9, "{h:?} {best}");
        prop_assert!(h.time_s * (1.0 - h.gap()) <= best + 1e-9, "{h:?} {best}");
        prop_assert!(h.rounds_s.windows(2).all(|w| w[0].0 <= w[1].0 && w[0].1 >= w[1].1));
        let flown: f64 = (0..p.len() - usize::from(closed == 0))
            .map(|i| {
                let j = (i + 1) % p.len();
                air.cost(p[j] - p[i], h.headings_rad[i], h.headings_rad[j])
            })
            .sum();
        prop_assert!((flown - h.time_s).abs() < 1e-6, "{flown} {h:?}");
    }

    #[test]
    fn in_a_breath_of_wind_time_is_length(
        raw in prop::collection::vec((-8.0f64..8.0, -8.0f64..8.0), 2..6), course in 0.0f64..6.3,
    ) {
        let p = points(&raw);
        let wind = Vector::new(skein_geometry::math::cos(course), skein_geometry::math::sin(course)) * 1e-7;
        let calm = solve(&p, FREE, 5e-3);
        let airy = solve_in_wind(&p, FREE, 5e-3, wind);
        prop_assert!(airy.lower_bound_s <= calm.length_m * (1.0 + 1e-5));
        prop_assert!(calm.lower_bound_m <= airy.time_s * (1.0 + 1e-5));
    }

    #[test]
    fn swapping_neighbours_for_the_better_never_lengthens_the_chain(
        raw in prop::collection::vec((-8.0f64..8.0, -8.0f64..8.0), 4..7), cut in prop::array::uniform2(0usize..7),
    ) {
        // One step of 2-opt over the order: it is taken only if certified shorter.
        let p = points(&raw);
        let before = solve(&p, FREE, 1e-3);
        let (i, j) = (cut[0].min(cut[1]).min(p.len()), cut[0].max(cut[1]).min(p.len()));
        let mut turned = p.clone();
        turned[i..j].reverse();
        let after = solve(&turned, FREE, 1e-3);
        let kept = if after.length_m < before.lower_bound_m { &turned } else { &p };
        let best = brute(kept, FREE, 90);
        prop_assert!(best <= brute(&p, FREE, 90) * (1.0 + 1e-9) + 0.3);
        prop_assert!(solve(kept, FREE, 1e-3).lower_bound_m <= before.length_m + 1e-9);
    }
}
